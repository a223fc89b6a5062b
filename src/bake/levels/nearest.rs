//! How far a place is from a set of triangles.

use std::collections::HashMap;

use glam::{IVec3, Vec3};

/// Cells along the longest side of all triangles' box.
const CELLS: f32 = 64.0;

/// Triangles by the cells of a grid that their boxes touch.
pub(super) struct Nearest<'a> {
    triangles: &'a [[Vec3; 3]],
    cells: HashMap<IVec3, Vec<u32>>,
    side: f32,
    low: IVec3,
    high: IVec3,
}

impl<'a> Nearest<'a> {
    /// For some triangles, at least one.
    pub fn new(triangles: &'a [[Vec3; 3]]) -> Self {
        let all = triangles.iter().flatten();
        let (low, high) =
            all.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| (low.min(*p), high.max(*p)));
        let side = ((high - low).max_element() / CELLS).max(1e-6);
        let cell = |p: Vec3| (p / side).floor().as_ivec3();
        let mut cells: HashMap<IVec3, Vec<u32>> = HashMap::new();
        for (k, [a, b, c]) in (0u32..).zip(triangles) {
            let (first, last) = (cell(a.min(*b).min(*c)), cell(a.max(*b).max(*c)));
            for z in first.z..=last.z {
                for y in first.y..=last.y {
                    for x in first.x..=last.x {
                        cells.entry(IVec3::new(x, y, z)).or_default().push(k);
                    }
                }
            }
        }
        Nearest { triangles, cells, side, low: cell(low), high: cell(high) }
    }

    /// Distance of a place from the nearest triangle, and which that is; `within`, and any, where none is so near.
    pub fn find(&self, place: Vec3, within: f32) -> (f32, u32) {
        let middle = (place / self.side).floor().as_ivec3();
        // Rings of cells that reach the box of all, from the inside out.
        let clamped = middle.clamp(self.low, self.high);
        let first = (middle - clamped).abs().max_element();
        let last = (middle - self.low).abs().max((middle - self.high).abs()).max_element();
        let mut best = (within, 0);
        for ring in first..=last {
            // What is in this ring is at least so far.
            if best.0 <= (ring - 1).max(0) as f32 * self.side {
                break;
            }
            self.visit(middle, ring, |k| {
                let distance = distance(place, &self.triangles[k as usize]);
                if distance < best.0 || (distance == best.0 && k < best.1) {
                    best = (distance, k);
                }
            });
        }
        best
    }

    /// Visits the triangles of the cells that are so many from a middle along some axis, and no more along others.
    fn visit(&self, middle: IVec3, ring: i32, mut visit: impl FnMut(u32)) {
        let (first, last) = ((middle - ring).max(self.low), (middle + ring).min(self.high));
        for z in first.z..=last.z {
            for y in first.y..=last.y {
                let inside = (z - middle.z).abs() < ring && (y - middle.y).abs() < ring;
                let step = if inside { (2 * ring).max(1) as usize } else { 1 };
                let start = if inside { middle.x - ring } else { first.x };
                for x in (start..=last.x).step_by(step).filter(|x| *x >= first.x) {
                    self.cells.get(&IVec3::new(x, y, z)).into_iter().flatten().for_each(|k| visit(*k));
                }
            }
        }
    }
}

/// Distance of a place from a triangle (Ericson 2005, "Real-Time Collision Detection", 5.1.5).
fn distance(p: Vec3, [a, b, c]: &[Vec3; 3]) -> f32 {
    let segment = |a: Vec3, b: Vec3| {
        let along = b - a;
        let t = ((p - a).dot(along) / along.length_squared().max(1e-30)).clamp(0.0, 1.0);
        (a + along * t - p).length_squared()
    };
    let edges = segment(*a, *b).min(segment(*b, *c)).min(segment(*c, *a));
    let n = (*b - *a).cross(*c - *a);
    let inside = |a: Vec3, b: Vec3| (b - a).cross(p - a).dot(n) >= 0.0;
    let square = n.length_squared();
    if square > 0.0 && inside(*a, *b) && inside(*b, *c) && inside(*c, *a) {
        return ((p - *a).dot(n).powi(2) / square).min(edges).sqrt();
    }
    edges.sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::hash::Stream;

    #[test]
    fn the_nearest_triangle_is_that_of_all() {
        let mut random = Stream::new(9);
        let mut point = |size: f64| Vec3::from_array([0; 3].map(|_| (size * random.unit()) as f32));
        let triangles: Vec<[Vec3; 3]> = (0..200)
            .map(|_| {
                let at = point(10.0);
                [at, at + point(1.0), at + point(1.0)]
            })
            .collect();
        let grid = Nearest::new(&triangles);
        for _ in 0..400 {
            let p = point(16.0) - Vec3::splat(3.0);
            let all = triangles.iter().map(|t| distance(p, t)).fold(f32::INFINITY, f32::min);
            let (found, k) = grid.find(p, f32::INFINITY);
            assert_eq!((found, distance(p, &triangles[k as usize])), (all, all), "{p:?}");
            assert_eq!(grid.find(p, 0.5).0, all.min(0.5), "{p:?}");
        }
        // On a corner, over the middle, beside an edge.
        let t = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let from = |x, y, z| distance(Vec3::new(x, y, z), &t);
        assert_eq!([from(1.0, 0.0, 0.0), from(0.25, 0.25, 2.0), from(0.5, -3.0, 0.0)], [0.0, 2.0, 3.0]);
    }
}
