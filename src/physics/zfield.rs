//! Reconstruction of a tree's surface from its z-field (BN12 §5), in the scaled space of the tree where
//! p' = S⁻¹ (p − o): the cylinder r ≤ 1, |z| ≤ 1. Rays stay rays and depths stay affine in that space, so
//! nothing is lost by working there.

use glam::DVec3;

use super::views::{self, Basis, Lookup};

/// Depth views of one tree: a texture array with one layer a view and mip levels down to 1 × 1.
#[derive(Clone, Debug, PartialEq)]
pub struct ZField {
    /// n of the 2n(n+1)+1 views.
    pub n: u32,
    /// Texels a side of level 0; a power of two.
    pub resolution: u32,
    /// Per level, all layers one after the other, rows from the bottom (v = 0) up, RGBA8:
    /// premultiplied nearest depth, farthest depth, occlusion; opacity.
    pub levels: Vec<Vec<u8>>,
}

/// A texel, decoded: everything premultiplied by the opacity.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Texel {
    /// Premultiplied depth along the view of the surface nearest to the viewer (the largest depth).
    pub nearest: f64,
    /// Premultiplied depth of the farthest surface.
    pub farthest: f64,
    /// Premultiplied fraction of the sky seen from the nearest surface.
    pub occlusion: f64,
    /// Opacity.
    pub alpha: f64,
}

/// Texture coordinates of the point `p` in a view: u = ½ + ½ (p·right)/m, v = ½ + ½ (p·up)/(m·extent),
/// where m = N/(N−2) leaves a border of one empty texel at level 0.
pub fn project(resolution: u32, basis: &Basis, p: DVec3) -> (f64, f64) {
    let m = resolution as f64 / (resolution as f64 - 2.0);
    (0.5 + 0.5 * p.dot(basis.right) / m, 0.5 + 0.5 * p.dot(basis.up) / (m * basis.extent))
}

/// A bilinear sample of one layer at one mip level; outside lies transparent black.
pub fn sample(field: &ZField, level: usize, layer: u32, u: f64, v: f64) -> Texel {
    let size = (field.resolution >> level).max(1) as i64;
    let (x, y) = (u * size as f64 - 0.5, v * size as f64 - 0.5);
    let mut sum = [0.0; 4];
    if !(x.abs() < 1e9 && y.abs() < 1e9) {
        return Texel::default();
    }
    let (x0, y0) = (x.floor() as i64, y.floor() as i64);
    for (xi, yi) in [(x0, y0), (x0 + 1, y0), (x0, y0 + 1), (x0 + 1, y0 + 1)] {
        if (0..size).contains(&xi) && (0..size).contains(&yi) {
            let w = (1.0 - (x - xi as f64).abs()) * (1.0 - (y - yi as f64).abs());
            let at = 4 * (layer as i64 * size * size + yi * size + xi) as usize;
            for (s, b) in sum.iter_mut().zip(&field.levels[level][at..at + 4]) {
                *s += w * *b as f64 / 255.0;
            }
        }
    }
    let [r, g, b, alpha] = sum;
    let depth = |x: f64| std::f64::consts::SQRT_2 * (2.0 * x - alpha);
    Texel { nearest: depth(r), farthest: depth(g), occlusion: b, alpha }
}

/// A ray p(s) = `origin` + s·`to`, with `to` towards the viewer or the light (need not be of unit length).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// p(0).
    pub origin: DVec3,
    /// p(1) − p(0).
    pub to: DVec3,
}

impl Ray {
    /// The ray from the viewer at `c` through `through`, starting where it meets the plane through the
    /// tree's centre perpendicular to the direction of the viewer, c·(c − x) = |c|².
    pub fn from_viewer(c: DVec3, through: DVec3) -> Self {
        let direction = c - through;
        let s = -through.dot(c) / direction.dot(c);
        let origin = through + s * direction;
        Ray { origin, to: c - origin }
    }
}

/// Where a ray enters the tree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Entry {
    /// Ray parameter of the surface.
    pub s: f64,
    /// The surface.
    pub point: DVec3,
    /// Opacity α_v, in [0, 1]; with 0, `s` is the last estimate and means nothing.
    pub alpha: f64,
    /// Fraction of the sky hemisphere seen, in [0, 1].
    pub occlusion: f64,
}

/// Depth, in scaled tree space, by which a view may disagree with the point found so far before it counts half.
pub const AGREEMENT: f64 = 0.2;

/// What one look into the three views gives.
#[derive(Clone, Copy, Debug, Default)]
struct Look {
    s: f64,
    alpha: f64,
    occlusion: f64,
}

/// Projects q = p₀ + s·to into the views (texels Zᵢ, αᵢ, premultiplied) and solves, for each,
/// dᵢ(p₀) + s dᵢ(to) = zᵢ with dᵢ(x) = x·wᵢ; the premultiplied mean over the views is
///
/// s = Σ kᵢ (Zᵢ − αᵢ dᵢ(p₀))/dᵢ(to) / Σ kᵢ αᵢ,   α = Σ kᵢ αᵢ / Σ kᵢ.
///
/// kᵢ is the view's weight wᵢ, or with `refine`, when q is more than the start of the search,
/// kᵢ = wᵢ (1 − αᵢ eᵢ/(1 + eᵢ)), eᵢ = ((zᵢ − dᵢ(q))/σ)² with σ = [`AGREEMENT`]: a view whose surface lies far from q shows
/// another branch there, before or behind, and knows nothing about q. In the plain mean it adds its opacity all the same
/// (silhouettes 3 % too large) and pulls the depth to between the branches. As αᵢ → 0, kᵢ → wᵢ: the weights stay
/// continuous at holes. Where nothing is, s stays.
fn look(
    field: &ZField,
    level: usize,
    lookup: &Lookup,
    ray: &Ray,
    s: f64,
    texel: fn(&ZField, usize, u32, f64, f64) -> Texel,
    (farthest, refine): (bool, bool),
) -> Look {
    let level = level.min(field.levels.len() - 1);
    let q = ray.origin + s * ray.to;
    let (mut sum_k, mut sum_s, mut sum) = (0.0, 0.0, Look::default());
    for view in &lookup.views {
        let basis = Basis::new(views::direction(field.n, view.i, view.j));
        let (u, v) = project(field.resolution, &basis, q);
        let t = texel(field, level, views::layer(field.n, view.i, view.j), u, v);
        let z = if farthest { t.farthest } else { t.nearest };
        let mut k = view.weight;
        if refine && t.alpha > 0.0 {
            let e = ((z / t.alpha - q.dot(basis.w)) / AGREEMENT).powi(2);
            k *= 1.0 - t.alpha * e / (1.0 + e);
        }
        sum_k += k;
        sum.alpha += k * t.alpha;
        sum.occlusion += k * t.occlusion;
        sum_s += k * (z - t.alpha * ray.origin.dot(basis.w)) / ray.to.dot(basis.w);
    }
    if sum.alpha <= 0.0 {
        return Look { s, alpha: 0.0, occlusion: 0.0 };
    }
    Look {
        s: sum_s / sum.alpha,
        alpha: sum.alpha / sum_k.max(1e-6),
        occlusion: (sum.occlusion / sum.alpha).min(1.0),
    }
}

/// The texel at a position, unfiltered; outside, that of the border.
fn nearest(field: &ZField, level: usize, layer: u32, u: f64, v: f64) -> Texel {
    let size = f64::from((field.resolution >> level).max(1));
    let centre = |x: f64| ((x * size).floor().clamp(0.0, size - 1.0) + 0.5) / size;
    sample(field, level, layer, centre(u), centre(v))
}

/// The surface of the tree on a ray, towards the end that the ray's direction points to, by `iterations` ≥ 1 fixed-point
/// iterations over the three views of `lookup`.
///
/// All but the last only move the point. They read one mip coarser, so that a small hole before p₀ does not end the
/// search, unfiltered unless texels are magnified (level 0), and move by as much as 24 times the opacity that
/// they find, at most all the way: a faint texel must not decide where to look, or silhouettes follow the borders of texels.
/// Opacity, occlusion and depth are of the last iteration, from the same texels. From below, the views are looked at from
/// behind: the surface nearest to that viewer is the farthest one along wᵢ; its occlusion is that of the other side, the
/// only one stored.
pub fn intersect(field: &ZField, level: usize, lookup: &Lookup, ray: &Ray, iterations: u32) -> Entry {
    let mut s = 0.0;
    for iteration in 1..iterations {
        let (texel, refine): (fn(&_, _, _, _, _) -> _, _) =
            if level == 0 { (sample, iteration > 1) } else { (nearest, false) };
        let found = look(field, level + 1, lookup, ray, s, texel, (lookup.below, refine));
        s += (found.s - s) * (24.0 * found.alpha).min(1.0);
    }
    let found = look(field, level, lookup, ray, s, sample, (lookup.below, iterations > 1));
    Entry { s: found.s, point: ray.origin + found.s * ray.to, alpha: found.alpha, occlusion: found.occlusion }
}

/// The surface that a viewer at `c` sees on the ray through `through`, both in scaled tree space.
pub fn view_ray(field: &ZField, level: usize, c: DVec3, through: DVec3, iterations: u32) -> Entry {
    let ray = Ray::from_viewer(c, through);
    intersect(field, level, &views::lookup(field.n, c), &ray, iterations)
}

/// Where light from the direction `l` (scaled tree space, any length) on its way to `p` enters the tree: the search starts
/// on the plane through the centre on which the mean depth Σ wᵢ dᵢ is 0, and s counts from `p`.
pub fn light_ray(field: &ZField, level: usize, p: DVec3, l: DVec3, iterations: u32) -> Entry {
    let lookup = views::lookup(field.n, l);
    let mean: DVec3 = lookup.views.iter().map(|v| v.weight * views::direction(field.n, v.i, v.j)).sum();
    let ray = Ray { origin: p, to: l };
    let mut found = Look { s: -p.dot(mean) / l.dot(mean), ..Look::default() };
    for iteration in 0..iterations {
        let from = found.s;
        found = look(field, level, &lookup, &ray, from, sample, (lookup.below, iteration > 0));
    }
    Entry { s: found.s, point: p + found.s * l, alpha: found.alpha, occlusion: found.occlusion }
}

/// The back of the tree on a ray towards the light, for the shadow map: one look, at the start of the ray.
pub fn cast(field: &ZField, level: usize, lookup: &Lookup, ray: &Ray) -> Entry {
    let found = look(field, level, lookup, ray, 0.0, sample, (!lookup.below, false));
    Entry { s: found.s, point: ray.origin + found.s * ray.to, alpha: found.alpha, occlusion: found.occlusion }
}
