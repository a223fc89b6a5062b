//! Reconstruction of a tree's surface from its z-field (BN12 §5), in the scaled space of the tree where
//! p' = S⁻¹ (p − o): the cylinder r ≤ 1, |z| ≤ 1. Rays stay rays and depths stay affine in that space, so
//! nothing is lost by working there.

use glam::DVec3;

use super::views::{self, Basis, Lookup};
use crate::bake::ZField;

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
pub const AGREEMENT: f64 = 0.15;

/// The surface of the tree on a ray, towards the end that the ray's direction points to, by
/// `iterations` ≥ 1 fixed-point iterations over the three views of `lookup` (weights wᵢ).
///
/// Each iteration projects the current point q into the views (texels Zᵢ, αᵢ, premultiplied) and solves, for
/// each, dᵢ(p₀) + s dᵢ(to) = zᵢ with dᵢ(x) = x·wᵢ; the premultiplied mean over the views is
///
/// s = Σ kᵢ (Zᵢ − αᵢ dᵢ(p₀))/dᵢ(to) / Σ kᵢ αᵢ,   q = p₀ + s·to,   α = Σ kᵢ αᵢ / Σ kᵢ,
///
/// and q = p₀ at the start. Two things go beyond BN12:
///
/// - kᵢ = wᵢ (1 − αᵢ eᵢ/(1 + eᵢ)), eᵢ = ((zᵢ − dᵢ(q))/σ)² with σ = [`AGREEMENT`], from the second iteration on
///   (kᵢ = wᵢ in the first, where q is only a guess). A view whose surface lies far from q shows another
///   branch there, before or behind, and knows nothing about q. In the plain mean it adds its opacity all the
///   same (silhouettes 3 % too large) and pulls the depth to between the branches. As αᵢ → 0, kᵢ → wᵢ: the
///   weights stay continuous at holes.
/// - The first of several iterations reads one mip coarser, so that a small hole in front of p₀ does not end
///   the search.
///
/// Opacity and occlusion are of the last iteration, from the same texels as the depth. From below, the views
/// are looked at from behind: the surface nearest to that viewer is the farthest one along wᵢ; its occlusion
/// is that of the other side, the only one stored.
pub fn intersect(field: &ZField, level: usize, lookup: &Lookup, ray: &Ray, iterations: u32) -> Entry {
    let mut entry = Entry { s: 0.0, point: ray.origin, alpha: 0.0, occlusion: 0.0 };
    for iteration in 0..iterations {
        let coarser = usize::from(iteration == 0 && iterations > 1);
        let level = (level + coarser).min(field.levels.len() - 1);
        let (mut sum_k, mut sum_alpha, mut sum_occlusion, mut sum_s) = (0.0, 0.0, 0.0, 0.0);
        for view in &lookup.views {
            let basis = Basis::new(views::direction(field.n, view.i, view.j));
            let (u, v) = project(field.resolution, &basis, entry.point);
            let texel = sample(field, level, views::layer(field.n, view.i, view.j), u, v);
            let z = if lookup.below { texel.farthest } else { texel.nearest };
            let mut k = view.weight;
            if iteration > 0 && texel.alpha > 0.0 {
                let e = ((z / texel.alpha - entry.point.dot(basis.w)) / AGREEMENT).powi(2);
                k *= 1.0 - texel.alpha * e / (1.0 + e);
            }
            sum_k += k;
            sum_alpha += k * texel.alpha;
            sum_occlusion += k * texel.occlusion;
            sum_s += k * (z - texel.alpha * ray.origin.dot(basis.w)) / ray.to.dot(basis.w);
        }
        if sum_alpha <= 0.0 {
            return Entry { alpha: 0.0, occlusion: 0.0, ..entry };
        }
        entry.s = sum_s / sum_alpha;
        entry.alpha = sum_alpha / sum_k;
        entry.occlusion = sum_occlusion / sum_alpha;
        entry.point = ray.origin + entry.s * ray.to;
    }
    entry
}

/// The surface that a viewer at `c` sees on the ray through `through`, both in scaled tree space.
pub fn view_ray(field: &ZField, level: usize, c: DVec3, through: DVec3, iterations: u32) -> Entry {
    let ray = Ray::from_viewer(c, through);
    intersect(field, level, &views::lookup(field.n, c), &ray, iterations)
}

/// Where light from the direction `l` (scaled tree space, any length) on its way to `p` enters the tree.
pub fn light_ray(field: &ZField, level: usize, p: DVec3, l: DVec3, iterations: u32) -> Entry {
    intersect(field, level, &views::lookup(field.n, l), &Ray { origin: p, to: l }, iterations)
}
