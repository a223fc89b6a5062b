//! Ambient occlusion of an isolated tree on horizontal ground (BN12 §5).
//!
//! Leaves scatter by an isotropic phase function, so what sky light they scatter depends on where they are
//! and not on how they lie:
//!
//! δ(p) = 1/(2π) ∫_{upper hemisphere} V(p, ω) dω,   V = 1 where the ray from p reaches the sky.
//!
//! It is smooth on the scale of branches, and is sampled at the vertices of a grid near the surface, by rays
//! through the leaf masks, and interpolated in between.

use std::f32::consts::TAU;

use glam::{UVec3, Vec3};
use rayon::prelude::*;

use super::rays::Rays;
use super::surface::Surface;
use crate::progress::Progress;

/// Grid cells along the longest side of the tree.
const CELLS: u32 = 56;

/// The fraction of the sky hemisphere seen, on a grid over a tree.
#[derive(Clone, Debug)]
pub struct Occlusion {
    /// Lowest vertex, in scaled tree space.
    low: Vec3,
    /// Cells a unit of scaled space, per axis.
    cells: Vec3,
    /// Vertices per axis.
    size: UVec3,
    values: Vec<f32>,
}

impl Occlusion {
    /// Casts `rays` rays from each grid vertex that the surface's interpolation can touch; `opaque_sided`
    /// tells for each material whether its back is the inside of something solid.
    pub fn new(surface: &Surface, solid: &[bool], rays: u32, progress: &Progress) -> Self {
        let scale = surface.frame.scale();
        let longest = 2.0 * scale.max_element();
        let cells_per_axis = (2.0 * scale / longest * CELLS as f32).ceil().max(Vec3::ONE).as_uvec3();
        let size = cells_per_axis + 1;
        let mut grid = Occlusion {
            low: Vec3::NEG_ONE,
            cells: cells_per_axis.as_vec3() / 2.0,
            size,
            values: vec![0.0; (size.x * size.y * size.z) as usize],
        };
        let touched = grid.touched(surface, solid);
        let caster = Rays::new(surface);
        let cell = longest / CELLS as f32;
        let values: Vec<Option<f32>> = touched
            .par_iter()
            .enumerate()
            .map(|(i, &touch)| {
                let value = (touch != Touch::None).then(|| {
                    let p = surface.frame.to_metres(grid.vertex(i as u32));
                    visibility(&caster, p, solid, touch == Touch::Solid, rays, i as u32, cell)
                });
                progress.step(1);
                value.flatten()
            })
            .collect();
        grid.fill(&values, &touched);
        grid
    }

    /// Vertices of the grid: what [`Progress`] counts.
    pub fn vertices(surface: &Surface) -> u64 {
        let scale = surface.frame.scale();
        let size = (scale / scale.max_element() * CELLS as f32).ceil().max(Vec3::ONE).as_uvec3() + 1;
        u64::from(size.x) * u64::from(size.y) * u64::from(size.z)
    }

    /// δ at a point of scaled tree space, trilinear.
    pub fn at(&self, p: Vec3) -> f32 {
        let top = (self.size - 1).as_vec3();
        let x = ((p - self.low) * self.cells).clamp(Vec3::ZERO, top);
        let i = x.as_uvec3().min(self.size - 2);
        let f = x - i.as_vec3();
        let at = |dx: u32, dy: u32, dz: u32| self.values[self.index(i + UVec3::new(dx, dy, dz))];
        let row = |dy, dz| at(0, dy, dz) * (1.0 - f.x) + at(1, dy, dz) * f.x;
        let plane = |dz| row(0, dz) * (1.0 - f.y) + row(1, dz) * f.y;
        plane(0) * (1.0 - f.z) + plane(1) * f.z
    }

    fn index(&self, v: UVec3) -> usize {
        ((v.z * self.size.y + v.y) * self.size.x + v.x) as usize
    }

    fn vertex(&self, index: u32) -> Vec3 {
        let v = UVec3::new(
            index % self.size.x,
            index / self.size.x % self.size.y,
            index / self.size.x / self.size.y,
        );
        self.low + v.as_vec3() / self.cells
    }

    /// Marks the vertices of every cell with a surface in it, holes included: a few too many do no harm.
    fn touched(&self, surface: &Surface, solid: &[bool]) -> Vec<Touch> {
        let mut marks = vec![Touch::None; self.values.len()];
        let mut cells: Vec<Touch> = marks.clone();
        for face in &surface.faces {
            let touch = if solid[face.material as usize] { Touch::Solid } else { Touch::Thin };
            let [a, b, c] = face.p.map(|p| (p - self.low) * self.cells);
            // Points closer than half a cell over the triangle: no cell that it crosses by much is missed,
            // and its neighbours are marked below.
            let steps = (2.0 * (b - a).length().max((c - a).length()).max((c - b).length())).ceil().max(1.0);
            let steps = steps.min(4096.0) as u32;
            for i in 0..=steps {
                for j in 0..=steps - i {
                    let (s, t) = (i as f32 / steps as f32, j as f32 / steps as f32);
                    let p = a + (b - a) * s + (c - a) * t;
                    let cell = p.clamp(Vec3::ZERO, (self.size - 1).as_vec3()).as_uvec3().min(self.size - 2);
                    let at = &mut cells[self.index(cell)];
                    *at = (*at).max(touch);
                }
            }
        }
        for z in 0..self.size.z - 1 {
            for y in 0..self.size.y - 1 {
                for x in 0..self.size.x - 1 {
                    let touch = cells[self.index(UVec3::new(x, y, z))];
                    if touch == Touch::None {
                        continue;
                    }
                    // The cell's corners, and one more around for what the samples above skipped.
                    for dz in 0..4 {
                        for dy in 0..4 {
                            for dx in 0..4 {
                                let v =
                                    (UVec3::new(x, y, z) + UVec3::new(dx, dy, dz)).saturating_sub(UVec3::ONE);
                                if v.cmplt(self.size).all() {
                                    let at = &mut marks[self.index(v)];
                                    *at = (*at).max(touch);
                                }
                            }
                        }
                    }
                }
            }
        }
        marks
    }

    /// Writes the values; a touched vertex without one (inside the wood) takes the mean of its neighbours.
    fn fill(&mut self, values: &[Option<f32>], touched: &[Touch]) {
        let mut known = values.to_vec();
        for _ in 0..4 {
            let before = known.clone();
            for i in (0..known.len()).filter(|&i| touched[i] != Touch::None) {
                if before[i].is_none() {
                    known[i] = self.mean_around(i, &before);
                }
            }
        }
        self.values = known.into_iter().map(|v| v.unwrap_or(0.0)).collect();
    }

    fn mean_around(&self, index: usize, values: &[Option<f32>]) -> Option<f32> {
        let index = index as u32;
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

/// What surface a grid vertex is near to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Touch {
    None,
    Thin,
    Solid,
}

/// δ at one point; `None` if the point is inside something solid.
fn visibility(
    caster: &Rays,
    p: Vec3,
    solid: &[bool],
    near_solid: bool,
    rays: u32,
    cell_index: u32,
    cell: f32,
) -> Option<f32> {
    // Not the leaf that the point may happen to lie on.
    let t_min = 1e-3 * cell;
    // Below the ground nothing is seen; on it, all the sky. Half a cell of leeway for the lowest vertices,
    // which stand for surfaces just above.
    if p.z < -0.5 * cell {
        return Some(0.0);
    }
    let (mut open, mut inside) = (0, 0);
    for k in 0..rays {
        let direction = sky_direction(k, rays, cell_index);
        if near_solid {
            match caster.closest(p, direction, t_min) {
                None => open += 1,
                Some(hit) if hit.back && caster.is_solid(hit.face, solid) => inside += 1,
                Some(_) => {}
            }
        } else if !caster.occluded(p, direction, t_min) {
            open += 1;
        }
    }
    (2 * inside <= rays).then(|| open as f32 / rays as f32)
}

/// Direction k of n over the upper hemisphere: a Fibonacci spiral, equal solid angles, turned by a hash of
/// the cell so that neighbours do not share the same error.
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
