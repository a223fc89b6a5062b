//! Rays against a z-field, fast: the model of [`crate::physics::zfield`] in f32, for parallel rays, with all that depends
//! on the direction prepared, on a level small enough for the processor's caches.

use std::f32::consts::SQRT_2;

use super::crown::{Cast, CrownModel, LeafOptics, Seen, TransferAt};
use crate::bake::SpeciesBake;
use crate::physics::crown::Crown;
use crate::physics::transfer::{self, TERMS};
use crate::physics::views::{self, Basis};
use crate::physics::zfield::AGREEMENT;

/// Shadows fainter than this are not drawn (`shaders/frame/trees/zfield_shadow.frag`).
const FAINTEST: f32 = 1.0 / 64.0;

/// One mip level, with a border of empty texels: outside lies transparent black.
struct Level {
    /// Texels a side, without the border.
    size: f32,
    /// Texels a row, with the border.
    stride: u32,
    /// RGBA8 of all layers.
    texels: Vec<u32>,
}

impl Level {
    fn new(bake: &SpeciesBake, level: usize) -> Self {
        let level = level.min(bake.views.levels.len() - 1);
        let size = (bake.views.resolution >> level) as usize;
        let stride = size + 2;
        let layers = views::count(bake.views.n) as usize;
        let mut texels = vec![0; layers * stride * stride];
        for (row, bytes) in bake.views.levels[level].chunks_exact(4 * size).enumerate() {
            let (layer, y) = (row / size, row % size);
            let to = &mut texels[layer * stride * stride + (y + 1) * stride + 1..][..size];
            for (t, b) in to.iter_mut().zip(bytes.as_chunks::<4>().0) {
                *t = u32::from_le_bytes(*b);
            }
        }
        Level { size: size as f32, stride: stride as u32, texels }
    }

    #[inline(always)]
    fn layer(&self, layer: u32) -> &[u32] {
        let size = (self.stride * self.stride) as usize;
        &self.texels[layer as usize * size..][..size]
    }

    /// The four texels around a position, and their weights in 1/256, which sum to 256: a fraction of 8 bits, as graphics
    /// hardware filters. `None` where all four are empty.
    #[inline(always)]
    fn around(&self, layer: u32, x: f32, y: f32) -> Option<([u32; 4], [u32; 4])> {
        // Texel centres lie at whole numbers, the border's at 0 and size + 1.
        let place = |v: f32| ((v * self.size + 0.5).clamp(0.0, self.size + 0.999) * 256.0) as u32;
        let (x, y) = (place(x), place(y));
        let at = ((y >> 8) * self.stride + (x >> 8)) as usize;
        let texels = &self.layer(layer)[at..at + self.stride as usize + 2];
        let t = [texels[0], texels[1], texels[self.stride as usize], texels[self.stride as usize + 1]];
        if t[0] | t[1] | t[2] | t[3] < 1 << 24 {
            return None;
        }
        let (fx, fy) = (x & 255, y & 255);
        let both = (fx * fy + 128) >> 8;
        Some((t, [256 + both - fx - fy, fx - both, fy - both, both]))
    }

    /// Bilinear sample of nearest depth, occlusion and opacity.
    #[inline(always)]
    fn near(&self, layer: u32, x: f32, y: f32) -> [f32; 3] {
        let Some((t, w)) = self.around(layer, x, y) else { return [0.0; 3] };
        // Two channels at a time: a weighted sum of bytes fits 16 bits.
        let (mut rb, mut ga) = (0, 0);
        for (t, w) in t.iter().zip(w) {
            rb += (t & 0xff00ff) * w;
            ga += (t >> 8 & 0xff00ff) * w;
        }
        [rb & 0xffff, rb >> 16, ga >> 16].map(|x| x as f32 * (1.0 / 65280.0))
    }

    /// Bilinear sample of nearest and farthest depth and opacity.
    #[inline(always)]
    fn ends(&self, layer: u32, x: f32, y: f32) -> Option<[f32; 3]> {
        let (t, w) = self.around(layer, x, y)?;
        let (mut rb, mut ga) = (0, 0);
        for (t, w) in t.iter().zip(w) {
            rb += (t & 0xff00ff) * w;
            ga += (t >> 8 & 0xff00ff) * w;
        }
        Some([rb & 0xffff, ga & 0xffff, ga >> 16].map(|x| x as f32 * (1.0 / 65280.0)))
    }

    /// The texel at a position, unfiltered; outside, that of the field's border.
    #[inline(always)]
    fn nearest(&self, layer: u32, x: f32, y: f32) -> [f32; 3] {
        let at = |v: f32| (v * self.size).clamp(0.0, self.size - 1.0) as u32 + 1;
        let t = self.layer(layer)[(at(y) * self.stride + at(x)) as usize];
        [t & 255, t >> 16 & 255, t >> 24].map(|x| x as f32 * (1.0 / 255.0))
    }
}

/// One of the three views around a direction: texture coordinates and depth of the point a·right + b·up + s·w, as
/// coefficients of (a, b, s).
#[derive(Clone, Copy, Debug)]
struct Projection {
    u: [f32; 3],
    v: [f32; 3],
    depth: [f32; 3],
    inverse_depth: f32,
    weight: f32,
    layer: u32,
}

impl Projection {
    /// Texture coordinates of a point.
    #[inline(always)]
    fn at(&self, [a, b, s]: [f32; 3]) -> (f32, f32) {
        let of = |row: [f32; 3]| 0.5 + a * row[0] + b * row[1] + s * row[2];
        (of(self.u), of(self.v))
    }
}

/// The three views around a direction.
pub struct FieldAim {
    views: [Projection; 3],
    /// Depth at which light starts its search, Σ wᵢ dᵢ = 0, as coefficients of (a, b).
    start: [f32; 2],
}

/// Light transfer of all views, on one level.
struct TransferLevel {
    size: usize,
    /// By band, as in [`crate::physics::transfer::Transfer`].
    bands: Vec<Vec<u8>>,
}

impl TransferLevel {
    /// The level with at most `size` texels a side.
    fn new(bake: &SpeciesBake, size: u32) -> Self {
        let level = (bake.transfer.resolution / size).max(1).ilog2();
        TransferLevel {
            size: (bake.transfer.resolution >> level) as usize,
            bands: bake.transfer.bands.iter().map(|b| b[level as usize].clone()).collect(),
        }
    }

    /// Coefficients of the texel at a position.
    fn nearest(&self, layer: u32, x: f32, y: f32) -> [f32; 2 * TERMS] {
        let at = |v: f32| (v * self.size as f32).clamp(0.0, self.size as f32 - 1.0) as usize;
        let texel = (layer as usize * self.size + at(y)) * self.size + at(x);
        let mut all = [0.0; 2 * TERMS];
        for (to, band) in all.as_chunks_mut::<TERMS>().0.iter_mut().zip(&self.bands) {
            *to = transfer::decode(band.as_chunks::<TERMS>().0[texel]).map(|x| x as f32);
        }
        all
    }
}

/// A z-field to cast rays at.
pub struct FieldCrown {
    crown: Crown,
    leaf: LeafOptics,
    rings: u32,
    border: f64,
    fine: Level,
    coarse: Level,
    transfer: TransferLevel,
    magnified: bool,
    view_iterations: u32,
    light_iterations: u32,
}

/// One look into the three views; see [`crate::physics::zfield`].
#[derive(Clone, Copy)]
struct Look {
    s: f32,
    alpha: f32,
    occlusion: f32,
}

impl FieldCrown {
    /// Prepares the level with at most `resolution` texels a side, and the next.
    pub fn new(bake: &SpeciesBake, resolution: u32, view_iterations: u32, light_iterations: u32) -> Self {
        let level = Self::level(bake, resolution);
        let r = f64::from(bake.views.resolution);
        FieldCrown {
            crown: Crown { sent: bake.sent(), ..bake.crown },
            leaf: LeafOptics::of(bake),
            rings: bake.views.n,
            border: r / (r - 2.0),
            fine: Level::new(bake, level),
            coarse: Level::new(bake, level + 1),
            transfer: TransferLevel::new(bake, resolution / 2),
            magnified: level == 0,
            view_iterations,
            light_iterations,
        }
    }

    /// The mip level with at most `resolution` texels a side.
    pub fn level(bake: &SpeciesBake, resolution: u32) -> usize {
        (bake.views.resolution / resolution.max(1)).max(1).ilog2() as usize
    }

    /// The formula of `look` in [`crate::physics::zfield`], for nearest surfaces.
    #[inline]
    fn look(
        &self,
        level: &Level,
        aim: &FieldAim,
        (a, b, s): (f32, f32, f32),
        filter: bool,
        refine: bool,
    ) -> Look {
        let (mut sum_k, mut sum_s, mut alpha, mut occlusion) = (0.0, 0.0, 0.0, 0.0);
        for view in &aim.views {
            let (x, y) = view.at([a, b, s]);
            let [r, o, t_alpha] =
                if filter { level.near(view.layer, x, y) } else { level.nearest(view.layer, x, y) };
            let z = SQRT_2 * (2.0 * r - t_alpha);
            let across = a * view.depth[0] + b * view.depth[1];
            let mut k = view.weight;
            if refine && t_alpha > 0.0 {
                let e = (z / t_alpha - across - s * view.depth[2]) * (1.0 / AGREEMENT as f32);
                k *= 1.0 - t_alpha * (e * e / (1.0 + e * e));
            }
            sum_k += k;
            alpha += k * t_alpha;
            occlusion += k * o;
            sum_s += k * (z - t_alpha * across) * view.inverse_depth;
        }
        if alpha <= 0.0 {
            return Look { s, alpha: 0.0, occlusion: 0.0 };
        }
        Look { s: sum_s / alpha, alpha: alpha / sum_k.max(1e-6), occlusion: (occlusion / alpha).min(1.0) }
    }
}

impl CrownModel for FieldCrown {
    type Aim = FieldAim;

    fn crown(&self) -> &Crown {
        &self.crown
    }

    fn leaf(&self) -> &LeafOptics {
        &self.leaf
    }

    fn aim(&self, zenith: f64, azimuth: f64) -> FieldAim {
        let ((st, ct), (sa, ca)) = (zenith.sin_cos(), azimuth.sin_cos());
        let w = glam::DVec3::new(st * ca, st * sa, ct);
        // Not the basis of w: at the zenith right and up must still turn with the azimuth.
        let axes = [glam::DVec3::new(-sa, ca, 0.0), glam::DVec3::new(-ct * ca, -ct * sa, st), w];
        let lookup = views::lookup(self.rings, w);
        let mut mean = [0.0; 3];
        let views = lookup.views.map(|view| {
            let basis = Basis::new(views::direction(self.rings, view.i, view.j));
            let along = |axis: glam::DVec3, scale: f64| axes.map(|x| (scale * x.dot(axis)) as f32);
            for (m, x) in mean.iter_mut().zip(axes) {
                *m += view.weight * x.dot(basis.w);
            }
            Projection {
                u: along(basis.right, 0.5 / self.border),
                v: along(basis.up, 0.5 / (self.border * basis.extent)),
                depth: along(basis.w, 1.0),
                inverse_depth: (1.0 / w.dot(basis.w)) as f32,
                weight: view.weight as f32,
                layer: views::layer(self.rings, view.i, view.j),
            }
        });
        FieldAim { views, start: [-mean[0] / mean[2], -mean[1] / mean[2]].map(|x| x as f32) }
    }

    #[inline]
    fn seen(&self, aim: &FieldAim, a: f32, b: f32) -> Seen {
        let mut s = 0.0;
        for iteration in 1..self.view_iterations {
            let found =
                self.look(&self.coarse, aim, (a, b, s), self.magnified, self.magnified && iteration > 1);
            s += (found.s - s) * (24.0 * found.alpha).min(1.0);
        }
        let found = self.look(&self.fine, aim, (a, b, s), true, self.view_iterations > 1);
        Seen { alpha: found.alpha, depth: found.s, occlusion: found.occlusion }
    }

    #[inline]
    fn cast(&self, aim: &FieldAim, a: f32, b: f32) -> Cast {
        let (mut back, mut front, mut alpha) = (0.0, 0.0, 0.0);
        for view in &aim.views {
            let x = 0.5 + a * view.u[0] + b * view.u[1];
            let y = 0.5 + a * view.v[0] + b * view.v[1];
            let Some([r, g, t_alpha]) = self.fine.ends(view.layer, x, y) else { continue };
            let across = a * view.depth[0] + b * view.depth[1];
            alpha += view.weight * t_alpha;
            let along = |z: f32| view.weight * (SQRT_2 * (2.0 * z - t_alpha) - t_alpha * across);
            back += along(g) * view.inverse_depth;
            front += along(r) * view.inverse_depth;
        }
        if alpha < FAINTEST {
            Cast::default()
        } else {
            Cast { alpha: alpha.min(1.0), back: back / alpha, front: front / alpha }
        }
    }

    #[inline]
    fn entry(&self, aim: &FieldAim, a: f32, b: f32) -> Option<f32> {
        let mut s = a * aim.start[0] + b * aim.start[1];
        for iteration in 0..self.light_iterations {
            s = self.look(&self.fine, aim, (a, b, s), true, iteration > 0).s;
        }
        (self.light_iterations > 0).then_some(s)
    }

    fn transfer(&self, aim: &FieldAim, [a, b, s]: [f32; 3]) -> TransferAt {
        let (mut sum, mut alpha) = ([0.0; 2 * TERMS], 0.0);
        for view in aim.views.iter().filter(|_| !self.transfer.bands.is_empty()) {
            let (x, y) = view.at([a, b, s]);
            let share = view.weight * self.fine.near(view.layer, x, y)[2];
            alpha += share;
            let found = self.transfer.nearest(view.layer, x, y);
            sum.iter_mut().zip(found).for_each(|(s, x)| *s += share * x);
        }
        TransferAt(sum.map(|s| if alpha > 0.0 { s / alpha } else { 0.0 }))
    }
}
