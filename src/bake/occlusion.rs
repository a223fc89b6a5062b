//! Ambient occlusion of an isolated tree on horizontal ground (BN12 §5).
//!
//! Leaves scatter by an isotropic phase function, so what sky light they scatter depends on where they are
//! and not on how they lie:
//!
//! δ(p) = 1/(2π) ∫_{upper hemisphere} V(p, ω) dω,   V = 1 where the ray from p reaches the sky.
//!
//! It is measured at points of the surface, by rays through the leaf masks, a leaf never hiding the sky from
//! itself; solid bark does. A grid keeps the tent-weighted mean over the points around each vertex, and is
//! interpolated in between. (Rays from the vertices themselves would see every leaf from beside it, and lose up
//! to half of its sky to the leaf itself; some vertices would lie inside the wood.)
//!
//! Against 2,048 rays from the very point, on leaves seen from one side: rms error 0.07 and bias −0.005 on the
//! oak (mean 0.38), 0.10 and −0.04 on the pine (mean 0.39), nearly all of it the grid's smoothing: 56 cells
//! instead of 96 give 0.09 and 0.13, four times the rays give the same.

use std::f32::consts::TAU;

use glam::{UVec3, Vec3};
use rayon::prelude::*;

use super::surface::{Caster, Surface};
use crate::progress::Progress;
use crate::rays::Stack;

/// Grid cells along the longest side of the tree.
const CELLS: u32 = 96;
/// Points measured in a cell, at most.
const POINTS: u32 = 4;
/// Points tried on a surface as large as a cell's side, before masks and the choice of [`POINTS`].
const DENSITY: f32 = 8.0;

/// The fraction of the sky hemisphere seen, on a grid over a tree.
#[derive(Clone, Debug)]
pub struct Occlusion {
    /// Cells a unit of scaled space, per axis; the lowest vertex is at (−1, −1, −1).
    cells: Vec3,
    /// Vertices per axis.
    size: UVec3,
    values: Vec<f32>,
}

/// A point of the surface, in scaled tree space.
#[derive(Clone, Copy, Debug)]
struct Point {
    p: Vec3,
    /// Outward normal (in metres) of a solid surface; zero for a leaf.
    normal: Vec3,
}

impl Occlusion {
    /// Casts about `rays` rays a cell; `solid` tells for each material whether its back is the inside of
    /// something opaque.
    pub fn new(surface: &Surface, solid: &[bool], rays: u32, quiet: bool) -> Self {
        let scale = surface.frame.scale();
        let per_axis = (scale / scale.max_element() * CELLS as f32).ceil().max(Vec3::ONE).as_uvec3();
        let size = per_axis + 1;
        let count = (size.x * size.y * size.z) as usize;
        let mut grid = Occlusion { cells: per_axis.as_vec3() / 2.0, size, values: vec![0.0; count] };
        let points = grid.points(surface, solid);
        let caster = Caster::new(surface);
        // Off the surface by a thousandth of a cell.
        let offset = 2e-3 * scale.max_element() / CELLS as f32;
        let rays = rays.div_ceil(POINTS);
        let progress = Progress::new("baking occlusion", points.len() as u64, quiet);
        let seen: Vec<f32> = points
            .par_iter()
            .enumerate()
            .map_init(Stack::new, |stack, (i, point)| {
                progress.step(1);
                let p = surface.frame.to_metres(point.p);
                visibility(&caster, (p, point.normal), offset, rays, i as u32, stack)
            })
            .collect();
        progress.finish();
        grid.splat(&points, &seen);
        grid
    }

    /// δ at a point of scaled tree space, trilinear.
    pub fn at(&self, p: Vec3) -> f32 {
        self.corners(p).map(|(i, w)| w * self.values[i]).iter().sum()
    }

    /// The vertices of the cell around a point, and their trilinear weights.
    fn corners(&self, p: Vec3) -> [(usize, f32); 8] {
        let x = ((p + 1.0) * self.cells).clamp(Vec3::ZERO, (self.size - 1).as_vec3());
        let i = x.as_uvec3().min(self.size - 2);
        let f = x - i.as_vec3();
        let base = self.index(i);
        let (row, plane) = (self.size.x as usize, (self.size.x * self.size.y) as usize);
        std::array::from_fn(|k| {
            let (dx, dy, dz) = (k & 1, k >> 1 & 1, k >> 2);
            let weight = |d: usize, f: f32| if d == 0 { 1.0 - f } else { f };
            (base + dx + dy * row + dz * plane, weight(dx, f.x) * weight(dy, f.y) * weight(dz, f.z))
        })
    }

    fn index(&self, v: UVec3) -> usize {
        ((v.z * self.size.y + v.y) * self.size.x + v.x) as usize
    }

    /// Up to [`POINTS`] points in each cell that the surface passes through, evenly over what lies there.
    fn points(&self, surface: &Surface, solid: &[bool]) -> Vec<Point> {
        let mut found: Vec<(usize, Point)> = Vec::new();
        for face in &surface.faces {
            let [a, b, c] = face.p;
            let area = 0.5 * ((b - a) * self.cells).cross((c - a) * self.cells).length();
            let metres = (b - a) * surface.frame.scale();
            let normal = metres.cross((c - a) * surface.frame.scale()).normalize_or_zero();
            let normal = if solid[face.material as usize] { normal } else { Vec3::ZERO };
            let tries = (DENSITY * area).ceil().clamp(1.0, 65536.0) as u32;
            for k in 0..tries {
                if let Some((s, t)) = surface.spread(face, k) {
                    let p = a + (b - a) * s + (c - a) * t;
                    found.push((self.corners(p)[0].0, Point { p, normal }));
                }
            }
        }
        found.sort_by_key(|(cell, _)| *cell);
        let mut points = Vec::new();
        for cell in found.chunk_by(|x, y| x.0 == y.0) {
            let take = cell.len().min(POINTS as usize);
            points.extend((0..take).map(|k| cell[(2 * k + 1) * cell.len() / (2 * take)].1));
        }
        points
    }

    /// Tent-weighted means at the vertices; those without a point near them, which a lookup can still touch
    /// where a mask let every try through, take the mean of their neighbours.
    fn splat(&mut self, points: &[Point], seen: &[f32]) {
        let mut sums = vec![(0f32, 0f32); self.values.len()];
        for (point, seen) in points.iter().zip(seen) {
            for (i, w) in self.corners(point.p) {
                sums[i].0 += w * seen;
                sums[i].1 += w;
            }
        }
        let mut known: Vec<Option<f32>> = sums.iter().map(|&(s, w)| (w > 0.0).then(|| s / w)).collect();
        for _ in 0..2 {
            let before = known.clone();
            for (i, value) in known.iter_mut().enumerate().filter(|(_, v)| v.is_none()) {
                *value = self.mean_around(i as u32, &before);
            }
        }
        self.values = known.into_iter().map(|v| v.unwrap_or(0.0)).collect();
    }

    fn mean_around(&self, index: u32, values: &[Option<f32>]) -> Option<f32> {
        let (sx, sy) = (self.size.x, self.size.y);
        let v = UVec3::new(index % sx, index / sx % sy, index / sx / sy);
        let (mut sum, mut count) = (0.0, 0);
        for d in 0..27u32 {
            let n = (v + UVec3::new(d % 3, d / 3 % 3, d / 9)).saturating_sub(UVec3::ONE);
            if n.cmplt(self.size).all()
                && let Some(x) = values[self.index(n)]
            {
                sum += x;
                count += 1;
            }
        }
        (count > 0).then(|| sum / count as f32)
    }
}

/// δ at a point, in metres; `normal` is zero for a leaf. Below the ground nothing is seen.
fn visibility(
    caster: &Caster,
    (p, normal): (Vec3, Vec3),
    offset: f32,
    rays: u32,
    seed: u32,
    stack: &mut Stack,
) -> f32 {
    if p.z < -offset {
        return 0.0;
    }
    let origin = p + normal * offset;
    let open = (0..rays).map(|k| sky_direction(k, rays, seed)).filter(|&direction| {
        (normal == Vec3::ZERO || normal.dot(direction) > 0.0)
            && !caster.occluded(origin, direction, offset, stack)
    });
    open.count() as f32 / rays as f32
}

/// Direction k of n over the upper hemisphere: a Fibonacci spiral, equal solid angles, turned by a hash of
/// the point so that neighbours do not share the same error.
pub fn sky_direction(k: u32, n: u32, seed: u32) -> Vec3 {
    const GOLDEN: f32 = 0.618_034;
    let mut h = seed.wrapping_mul(0x9e37_79b9) ^ 0x85eb_ca6b;
    h = (h ^ (h >> 16)).wrapping_mul(0x7feb_352d);
    h = (h ^ (h >> 15)).wrapping_mul(0x846c_a68b);
    h ^= h >> 16;
    let turn = h as f32 / u32::MAX as f32;
    let z = 1.0 - (k as f32 + 0.5) / n as f32;
    let r = (1.0 - z * z).sqrt();
    let (s, c) = (TAU * (k as f32 * GOLDEN + turn).fract()).sin_cos();
    Vec3::new(r * c, r * s, z)
}

/// Direction k of n, an even number, over the whole sphere: the hemisphere's, turned by a seed, and behind them as many by another.
pub fn sphere_direction(k: u32, n: u32, seeds: [u32; 2]) -> Vec3 {
    let half = n / 2;
    let w = sky_direction(k % half, half, seeds[(k / half) as usize]);
    if k < half { w } else { -w }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::mesh::Triangle;
    use crate::scene::{Material, Mesh};

    fn quad(mesh: &mut Mesh, corner: Vec3, a: Vec3, b: Vec3) {
        let base = mesh.positions.len() as u32;
        for p in [corner, corner + a, corner + a + b, corner + b] {
            mesh.positions.push(p.to_array());
            mesh.normals.push([0.0, 0.0, 1.0]);
            mesh.uvs.push([0.0; 2]);
        }
        for vertices in [[base, base + 1, base + 2], [base, base + 2, base + 3]] {
            mesh.triangles.push(Triangle { vertices, material: 0 });
        }
    }

    fn bake(mesh: &Mesh, rays: u32) -> (Surface, Occlusion) {
        let surface = Surface::new(mesh).unwrap();
        let occlusion = Occlusion::new(&surface, &[false], rays, true);
        (surface, occlusion)
    }

    #[test]
    fn directions_are_unit_and_evenly_spread() {
        let n = 1000;
        let mean = (0..n).map(|k| sky_direction(k, n, 7)).sum::<Vec3>() / n as f32;
        assert!((mean - Vec3::new(0.0, 0.0, 0.5)).length() < 0.01, "{mean}");
        assert!((0..n).all(|k| (sky_direction(k, n, 7).length() - 1.0).abs() < 1e-5));
    }

    #[test]
    fn a_roof_hides_the_sky_and_a_wall_half_of_it() {
        // A wide roof at 1 m and a floor of leaves under it; edges are far away from the axis.
        let mut mesh = Mesh { materials: vec![Material::leaf()], ..Mesh::default() };
        let wide = |z| Vec3::new(-50.0, -50.0, z);
        quad(&mut mesh, wide(2.0), Vec3::X * 100.0, Vec3::Y * 100.0);
        quad(&mut mesh, wide(0.1), Vec3::X * 100.0, Vec3::Y * 100.0);
        let (surface, _) = bake(&mesh, 8);
        let caster = Caster::new(&surface);
        let seen = |p| visibility(&caster, (p, Vec3::ZERO), 1e-4, 4096, 1, &mut Stack::new());
        // Under the roof, the sky is seen past its edge only: elevation under 1/50 rad.
        assert!(seen(Vec3::new(0.0, 0.0, 1.0)) < 0.03);
        assert_eq!(seen(Vec3::new(0.0, 0.0, 2.5)), 1.0);
        assert_eq!(seen(Vec3::new(0.0, 0.0, -1.0)), 0.0, "under the ground");

        let mut mesh = Mesh { materials: vec![Material::leaf()], ..Mesh::default() };
        quad(&mut mesh, Vec3::new(0.0, -500.0, 0.0), Vec3::Y * 1000.0, Vec3::Z * 500.0);
        quad(&mut mesh, Vec3::new(-1.0, 0.0, 0.0), Vec3::X, Vec3::Z);
        let (surface, _) = bake(&mesh, 8);
        let caster = Caster::new(&surface);
        let wall =
            visibility(&caster, (Vec3::new(0.1, 0.0, 1.0), Vec3::ZERO), 1e-4, 4096, 1, &mut Stack::new());
        assert!((wall - 0.5).abs() < 0.01, "{wall}");
    }

    #[test]
    fn a_solid_hides_half_the_sky_from_its_own_skin() {
        // A closed box as a trunk.
        let mut mesh = Mesh { materials: vec![Material::leaf()], ..Mesh::default() };
        let (x, y, z) = (Vec3::X * 2.0, Vec3::Y * 2.0, Vec3::Z * 20.0);
        let low = Vec3::new(-1.0, -1.0, 0.0);
        // Wound so that the corners run anticlockwise from outside.
        for (corner, a, b) in
            [(low, y, x), (low + z, x, y), (low, x, z), (low + y, z, x), (low, z, y), (low + x, y, z)]
        {
            quad(&mut mesh, corner, a, b);
        }
        let surface = Surface::new(&mesh).unwrap();
        let occlusion = Occlusion::new(&surface, &[true], 256, true);
        for p in [Vec3::new(1.0, 0.0, 10.0), Vec3::new(0.0, -1.0, 5.0), Vec3::new(0.9, 0.3, 12.0)] {
            let seen = occlusion.at(surface.frame.to_scaled(p));
            assert!((0.45..0.6).contains(&seen), "{p}: {seen}");
        }
    }

    #[test]
    fn interpolation_agrees_with_rays_from_the_surface() {
        // A ball of 400 random cards.
        let mut mesh = Mesh { materials: vec![Material::leaf()], ..Mesh::default() };
        let random = |i: u32| sky_direction(i % 97, 97, i) * if i.is_multiple_of(2) { 1.0 } else { -1.0 };
        for i in 0..400 {
            let centre = random(i) * 4.0 * ((i as f32 + 1.0) / 400.0).cbrt() + Vec3::Z * 5.0;
            let a = random(1000 + i).cross(Vec3::X).normalize() * 0.6;
            let b = a.cross(random(2000 + i)).normalize() * 0.6;
            quad(&mut mesh, centre - 0.5 * (a + b), a, b);
        }
        let (surface, occlusion) = bake(&mesh, 128);
        let caster = Caster::new(&surface);
        let (mut square, mut bias) = (0.0, 0.0);
        for (i, face) in surface.faces.iter().enumerate().step_by(8) {
            let p = (face.p[0] + face.p[1] + face.p[2]) / 3.0;
            let metres = surface.frame.to_metres(p);
            let truth = visibility(&caster, (metres, Vec3::ZERO), 1e-4, 4096, i as u32, &mut Stack::new());
            let error = occlusion.at(p) - truth;
            square += error * error / 100.0;
            bias += error / 100.0;
        }
        assert!(square.sqrt() < 0.15 && bias.abs() < 0.04, "rms {} bias {bias}", square.sqrt());
    }
}
