//! How light comes to what a texel of shells shows: by its own crown, as spherical harmonics of the species' faces; and between the other
//! trees, by rays.
//!
//! **Own crown.** The transfer of a face ([`crate::bake::harmonics`]), turned as its tree is turned, to the side that faces up (`seen`, for slices
//! are seen from above) and to the other one, is averaged over the samples that see the face. Tiles are never turned, so these are axes of the
//! world, and a sun's irradiance is Σ cᵢ Yᵢ(sun).
//!
//! **Other trees.** V(ω) is the share of a texel's surfaces that see the direction ω past all trees but their own, at the full density: of
//! the tile and the eight neighbours that it was painted amid. Rays go from as many of the samples that see something to directions all over
//! the upper hemisphere, and V is the sum of the nine functions nearest to what they found, by least squares over those directions: a
//! projection of V on harmonics of the whole sphere, half of which is ground, would ring at the horizon, and say 1/2 there where all is free.
//! Below the horizon the sum means nothing.
//!
//! **Own and others.** Sky that the others leave is that which rays found, each weighed by what the own crown lets in along it.

use std::f64::consts::TAU;
use std::path::Path;
use std::sync::Arc;

use glam::{Vec2, Vec3};

use super::pyramid::{Slices, Texel};
use super::slices::{SAMPLES, Samples, Seen};
use super::{Forest, ShellSettings};
use crate::Result;
use crate::bake::foliage::Foliage;
use crate::bake::grove::Grove;
use crate::bake::harmonics::{self, Transfer};
use crate::bake::least_squares::solve;
use crate::physics::harmonics::{KEPT, RANGE, encode, evaluate, turned};
use crate::physics::hash::{hash2, unit};
pub use crate::plan::{SHELL_LIGHT_TEXELS as LIGHT_TEXELS, SHELL_LIGHTS as LIGHT_IMAGES};
use crate::rays::Stack;
use crate::scene::{Mesh, Scene};

/// Numbers of a texel: transfer to the side that is seen and to the other, V, and how much of the sky the other trees leave.
pub const LIGHT: usize = 3 * KEPT + 1;
/// What the byte 127 means of a number of V. Where all is free the first one is √(4π): 64 to the byte, without rounding.
pub const FREE_RANGE: f64 = 3.544_907_701_811_032 * 127.0 / 64.0;
/// Rays of a texel of a slice. Held against other single rays, V of so many has a mean square 6 % above that of V of 512; of 48, 16 %.
pub const FREE_RAYS: u32 = 96;
/// Step from a ray's place among the samples to the next one's: rays are in the order of their height, and samples in rows from the south.
const STRIDE: u32 = 59;

/// One mip of one level of light: seven images of four signed bytes a texel; layers and rows as those of [`super::Mip`].
///
/// It belongs to the cover of as many texels a side, [`LIGHT_TEXELS`] times fewer than the level's finest, and is premultiplied by
/// that at full density.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LightMip {
    /// Texels a side.
    pub side: u32,
    /// 28 numbers in their order: nine of the transfer to the side that is seen (byte 127: [`crate::physics::harmonics::RANGE`]), nine to the
    /// other, nine of V ([`FREE_RANGE`]), and the share of the sky that the other trees leave (1).
    pub images: [Vec<u8>; LIGHT_IMAGES],
}

impl LightMip {
    /// Levels and mips of these settings, without texels.
    pub(super) fn empty(settings: ShellSettings) -> Vec<Vec<LightMip>> {
        let side = settings.texels / LIGHT_TEXELS;
        let mips = || (0..=side.ilog2()).map(|m| LightMip { side: side >> m, ..LightMip::default() });
        (0..=settings.slices.ilog2()).map(|_| mips().collect()).collect()
    }

    /// Slices as bytes.
    pub(super) fn new(slices: &Slices<LIGHT>) -> Self {
        let mut mip = LightMip { side: slices.side as u32, ..LightMip::default() };
        for t in &slices.texels {
            for (k, v) in t.values.iter().enumerate() {
                // In the range of a transfer's number.
                let number = f64::from(*v) * RANGE / range(k);
                mip.images[k / 4].push(encode(number).cast_unsigned());
            }
        }
        mip
    }
}

/// What the byte 127 means of a number of a texel, by its place.
pub fn range(number: usize) -> f64 {
    if number < 2 * KEPT {
        RANGE
    } else if number < 3 * KEPT {
        FREE_RANGE
    } else {
        1.0
    }
}

/// What is known of the light of a forest's trees.
pub struct Lights {
    /// Of each face of each species the transfer to the side that faces up, and to the other.
    transfers: Vec<Vec<[Transfer; 2]>>,
    pub(super) foliage: Vec<Arc<Foliage>>,
    fit: Fit,
}

impl Lights {
    /// Of a scene's species, whose harmonics are in the cache in `dir` or made and put there.
    ///
    /// # Errors
    /// [`crate::Error::Usage`] for a model without extent.
    pub fn new(scene: &Scene, forest: &Forest, dir: Option<&Path>, quiet: bool) -> Result<Self> {
        let up = |[a, b, c]: &[Vec3; 3]| (*b - *a).cross(*c - *a).z >= 0.0;
        let of = |(mesh, kind): (&Mesh, &super::Kind)| {
            let faces = harmonics::file::load(mesh, dir, quiet)?.0.faces;
            let sides = faces.into_iter().zip(&kind.corners);
            Ok(sides.map(|([front, back], p)| if up(p) { [front, back] } else { [back, front] }).collect())
        };
        Ok(Lights {
            transfers: scene
                .species
                .iter()
                .map(|s| &*s.mesh)
                .zip(&forest.kinds)
                .map(of)
                .collect::<Result<_>>()?,
            foliage: foliage(scene)?,
            fit: Fit::new(),
        })
    }

    /// Of a tile, which is then shown its samples.
    pub(super) fn tile(&self, forest: &Forest, kind: usize, settings: ShellSettings) -> LightTile<'_> {
        let side = settings.texels / LIGHT_TEXELS;
        LightTile {
            lights: self,
            grove: grove(&self.foliage, forest, kind),
            kind: kind as u32,
            side,
            values: vec![[0.0; LIGHT]; (side * side * settings.slices) as usize],
            texel: forest.patch.side as f32 / side as f32,
        }
    }
}

/// All species as rays meet them.
pub(super) fn foliage(scene: &Scene) -> Result<Vec<Arc<Foliage>>> {
    scene.species.iter().map(|s| Foliage::new(&s.mesh, &s.optics).map(Arc::new)).collect()
}

/// The trees of a tile and its neighbours, those that the tile shows first.
pub(super) fn grove(foliage: &[Arc<Foliage>], forest: &Forest, kind: usize) -> Grove {
    let trees = forest.patch.tiles[kind].iter().chain(&forest.patch.around[kind]);
    Grove::new(foliage.to_vec(), trees.map(|i| i.tree).collect())
}

/// Light of one tile.
pub(super) struct LightTile<'a> {
    lights: &'a Lights,
    grove: Grove,
    kind: u32,
    side: u32,
    /// By slice from the ground up, row from the south, and column; premultiplied by the share of samples that see a tree.
    values: Vec<[f32; LIGHT]>,
    /// Side of a texel, m.
    texel: f32,
}

impl LightTile<'_> {
    /// Takes samples of whole texels of light.
    pub(super) fn add(&mut self, samples: &Samples) {
        let mut stack = Stack::new();
        let all = ((LIGHT_TEXELS * SAMPLES) as f32).powi(2);
        samples.blocks(LIGHT_TEXELS, |slab, _, seen| {
            let [x, y] = (seen[0].0.truncate() / self.texel).to_array().map(|v| v as u32);
            let at = (slab * self.side + y) * self.side + x;
            let cover = seen.len() as f32 / all;
            self.values[at as usize] = self.texel(seen, hash2(self.kind, at), &mut stack).map(|v| cover * v);
        });
    }

    /// What a texel keeps of its samples.
    fn texel(&self, seen: &[(Vec3, Seen)], seed: u32, stack: &mut Stack) -> [f32; LIGHT] {
        let own = self.own(seen);
        let turn = unit(seed) * TAU as f32;
        let free: [bool; FREE_RAYS as usize] = std::array::from_fn(|k| {
            let place = (k as u32 * STRIDE % FREE_RAYS) as f32 + unit(hash2(seed, k as u32));
            let (from, sample) = seen[(place / FREE_RAYS as f32 * seen.len() as f32) as usize % seen.len()];
            let [x, y, z] = self.lights.fit.directions[k];
            let across = Vec2::from_angle(turn).rotate(Vec2::new(x, y));
            !self.grove.occluded_by_others(sample.tree, from, across.extend(z), stack)
        });
        let (numbers, open) = self.lights.fit.of(&free, turn, &own);
        let parts = [own[0], own[1], numbers];
        std::array::from_fn(|k| parts.as_flattened().get(k).copied().unwrap_or(open))
    }

    /// Mean transfer to the sides that are seen, and to the others.
    fn own(&self, seen: &[(Vec3, Seen)]) -> [Transfer; 2] {
        let mut sum = [[0.0; KEPT]; 2];
        for (_, Seen { tree, face, .. }) in seen {
            let tree = &self.grove.trees[*tree as usize];
            let sides = self.lights.transfers[tree.species as usize][*face as usize];
            for (sum, side) in sum.iter_mut().zip(sides) {
                sum.iter_mut().zip(turned(side, tree.turn)).for_each(|(s, v)| *s += v);
            }
        }
        sum.map(|sum| sum.map(|s| s / seen.len() as f32))
    }

    /// Its slices, covered as the finest ones of the same tile.
    pub(super) fn slices(self, finest: &Slices) -> Slices<LIGHT> {
        let coarse = (1..LIGHT_TEXELS.ilog2()).fold(finest.halved(), |s, _| s.halved());
        let Slices { side, texels, above } = coarse;
        let both = texels.iter().zip(self.values);
        Slices { side, above, texels: both.map(|(t, values)| Texel { cover: t.cover, values }).collect() }
    }
}

/// Rays over the upper hemisphere, and the sum of harmonics that is nearest to what they find.
pub(super) struct Fit {
    /// Evenly by solid angle, a spiral from the horizon up.
    pub(super) directions: [[f32; 3]; FREE_RAYS as usize],
    /// Y there.
    functions: Vec<[f64; KEPT]>,
    /// Of each ray that is free what it adds to the numbers.
    adds: Vec<[f64; KEPT]>,
}

impl Fit {
    pub(super) fn new() -> Self {
        const GOLDEN: f64 = 0.618_033_988_749_894_9;
        let direction = |k: usize| {
            let z = (k as f64 + 0.5) / f64::from(FREE_RAYS);
            let (s, c) = (TAU * (k as f64 * GOLDEN).fract()).sin_cos();
            let across = (1.0 - z * z).sqrt();
            [across * c, across * s, z]
        };
        let directions: [[f64; 3]; FREE_RAYS as usize] = std::array::from_fn(direction);
        let functions: Vec<[f64; KEPT]> =
            directions.iter().map(|w| std::array::from_fn(|k| evaluate(*w)[k])).collect();
        let of = |i: usize, j: usize| functions.iter().map(|y| y[i] * y[j]).sum::<f64>();
        let normal: [[f64; KEPT]; KEPT] = std::array::from_fn(|i| std::array::from_fn(|j| of(i, j)));
        let adds = functions.iter().map(|y| solve(normal, *y, KEPT).expect("nine functions of more rays"));
        Fit { directions: directions.map(|w| w.map(|v| v as f32)), adds: adds.collect(), functions }
    }

    /// Of rays that were turned by an angle about z which are free: V, and their share weighed by an own crown's transfer to both sides.
    pub(super) fn of(&self, free: &[bool], turn: f32, own: &[Transfer; 2]) -> (Transfer, f32) {
        let (sin, cos) = turn.sin_cos();
        let both: [f32; KEPT] = std::array::from_fn(|k| own[0][k] + own[1][k]);
        let back = turned(both, [cos, -sin]);
        let (mut numbers, mut open) = ([0.0; KEPT], [1e-6; 2]);
        for ((y, adds), free) in self.functions.iter().zip(&self.adds).zip(free) {
            let own = y.iter().zip(back).map(|(y, c)| y * f64::from(c)).sum::<f64>().max(0.0);
            open[0] += own;
            if *free {
                open[1] += own;
                numbers.iter_mut().zip(adds).for_each(|(n, a)| *n += a);
            }
        }
        (turned(numbers.map(|n| n as f32), [cos, sin]), (open[1] / open[0]) as f32)
    }
}
