//! Shadow cascades: parallel splits (Zhang et al. 2006), each a sphere around its slice of the frustum. A cascade's texels are
//! those of one endless map of the world as the sun sees it: where the eye is decides which of them it holds, and nothing else.
//! So what is drawn of the map stays right while the eye moves and turns, and shadows do not swim.

use super::{Bounds, Eye, add, cross, dot, normalize};
use crate::gpu::interface::{SHADOW_DEPTHS, SHADOW_PAGES};
use crate::physics::shadow::parallel_splits;

/// Texels around what is seen that lookups may filter over.
pub const MARGIN: u32 = 2;

/// The endless map of which a cascade holds a square: all that what is drawn depends on, besides the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct ShadowGrid {
    /// Directions of x, y and of the sun.
    pub axes: [[f64; 3]; 3],
    /// Metres a texel.
    pub texel: f64,
    /// Texels along a side of the square that a cascade holds.
    pub texels: u32,
    /// Along the sun from the world's origin: where depth 0 is, m.
    pub lowest: f64,
}

/// One cascade: an orthographic view from the sun.
#[derive(Clone, Debug, PartialEq)]
pub struct Cascade {
    /// Its map.
    pub grid: ShadowGrid,
    /// Texel of the map from which on it holds a square, in whole pages.
    pub first: [i64; 2],
    /// Distance from the eye to which the cascade is used, m.
    pub far: f64,
}

/// Texels along a square that a cascade of so many texels holds wherever it is: it moves in whole pages, and is one larger.
pub fn held(texels: u32) -> u32 {
    texels - texels / SHADOW_PAGES - 2 * MARGIN
}

/// Texels of a cascade, a power of two, that holds a square of so many.
pub fn map_for(texels: f64) -> u32 {
    (SHADOW_PAGES.ilog2()..30).map(|k| 1 << k).find(|t| f64::from(held(*t)) >= texels).unwrap_or(1 << 30)
}

/// The cascades of an eye to `far` metres, split as if they began at `near`; nothing is nearer than `clear`.
pub fn cascades(
    eye: &Eye,
    sun: [f64; 3],
    (clear, near, far): (f64, f64, f64),
    count: u32,
    split: f64,
    texels: u32,
) -> Vec<Cascade> {
    let mut from = clear;
    parallel_splits(near, far.max(near * 1.01), count, split)
        .into_iter()
        .map(|to| {
            let (along, radius) = slice_sphere(eye, from, to);
            from = to;
            let texel = 2.0 * radius / f64::from(held(texels));
            Cascade::around(sun, eye, eye.forward.map(|f| along * f), texel, texels, to)
        })
        .collect()
}

impl ShadowGrid {
    /// Depth range, m.
    pub fn depth(&self) -> f64 {
        f64::from(SHADOW_DEPTHS) * self.texel * f64::from(self.texels)
    }

    /// Texels along a page.
    pub fn page(&self) -> i64 {
        i64::from(self.texels / SHADOW_PAGES)
    }

    /// Whether any of a box is nearer to the sun than where the depth ends, and so casts.
    pub fn before_the_end(&self, bounds: &Bounds) -> bool {
        let sun = self.axes[2];
        let nearest: f64 =
            (0..3).map(|k| sun[k] * if sun[k] > 0.0 { bounds.high[k] } else { bounds.low[k] }).sum();
        nearest >= self.lowest
    }

    /// A point of the world in the map: x and y in texels, z the depth.
    pub fn place(&self, p: [f64; 3]) -> [f64; 3] {
        let [x, y, z] = self.axes.map(|a| dot(a, p));
        [x / self.texel, y / self.texel, (z - self.lowest) / self.depth()]
    }
}

impl Cascade {
    /// A cascade around a point relative to the eye.
    pub fn around(sun: [f64; 3], eye: &Eye, target: [f64; 3], texel: f64, texels: u32, far: f64) -> Self {
        let across = cross([0.0, 0.0, 1.0], sun);
        let x = if dot(across, across) > 1e-12 { normalize(across) } else { [1.0, 0.0, 0.0] };
        let mut grid = ShadowGrid { axes: [x, cross(sun, x), sun], texel, texels, lowest: 0.0 };
        let world = add(eye.position, target, 1.0);
        // Depths begin at multiples of half their range, so that the centre is in their middle half.
        let step = 0.5 * grid.depth();
        grid.lowest = ((dot(sun, world) / step).floor() - 0.5) * step;
        let page = grid.page();
        let half = 0.5 * f64::from(texels) - 0.5 * page as f64;
        let place = grid.place(world);
        let first = [0, 1].map(|k| ((place[k] - half) / page as f64).floor() as i64 * page);
        Cascade { grid, first, far }
    }

    /// Clip from world coordinates relative to the eye, column by column: xy in [-1, 1]; z is 1 at the sun's side, 0 at the far one.
    pub fn matrix(&self, eye: &Eye) -> [[f64; 4]; 4] {
        let (g, texels) = (&self.grid, f64::from(self.grid.texels));
        let place = g.place(eye.position);
        let scales = [2.0 / (g.texel * texels), 2.0 / (g.texel * texels), 1.0 / g.depth()];
        let mut columns = [[0.0; 4]; 4];
        for (row, s) in scales.iter().enumerate() {
            for (k, column) in columns.iter_mut().take(3).enumerate() {
                column[row] = g.axes[row][k] * s;
            }
        }
        let from_first = |k: usize| 2.0 * (place[k] - self.first[k] as f64) / texels - 1.0;
        columns[3] = [from_first(0), from_first(1), place[2], 1.0];
        columns
    }
}

/// The sphere around what the frustum sees between two distances from the eye: where its centre is along the view, and
/// its radius. Depends on the field of view only, to the bit.
fn slice_sphere(eye: &Eye, from: f64, to: f64) -> (f64, f64) {
    let [tx, ty] = eye.reach();
    let cosine = 1.0 / (1.0 + tx * tx + ty * ty).sqrt();
    let radius = |t: f64| {
        // The farthest of: the rim at both distances, and the middle at the far one.
        let rim = |d: f64| (t * t - 2.0 * t * d * cosine + d * d).sqrt();
        rim(to).max(rim(from)).max((to - t).abs())
    };
    // The maximum of convex functions: ternary search.
    let (mut low, mut high) = (0.0, to);
    for _ in 0..60 {
        let (a, b) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
        if radius(a) < radius(b) { high = b } else { low = a }
    }
    (low, radius(low))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn eye(position: [f64; 3], direction: [f64; 3]) -> Eye {
        Eye::looking(position, direction, 45.0, [1024, 768])
    }

    #[test]
    fn every_visible_point_is_in_its_cascade() {
        let sun = normalize([0.3, -0.6, 0.5]);
        for x in 0..40 {
            let e = eye([100.0 + 1.7 * f64::from(x), 200.0 - 0.9 * f64::from(x), 30.0], [0.5, 0.8, -0.1]);
            let all = cascades(&e, sun, (0.0, 5.0, 4000.0), 4, 0.8, 1024);
            let mut from = 0.0;
            for c in &all {
                for k in 0..500 {
                    let (u, v) = (f64::from(k % 21) / 10.0 - 1.0, f64::from(k % 19) / 9.0 - 1.0);
                    let d =
                        normalize(add(add(e.forward, e.right, u * e.tangents[0]), e.up, v * e.tangents[1]));
                    let p = d.map(|x| x * (from + (c.far - from) * f64::from(k % 7) / 6.0));
                    let place = c.grid.place(add(e.position, p, 1.0));
                    for (place, first) in place.iter().zip(c.first) {
                        let within = place - first as f64;
                        let margin = f64::from(MARGIN) - 1e-6;
                        assert!((margin..=1024.0 - margin).contains(&within), "{within}");
                    }
                    assert!((0.2..=0.8).contains(&place[2]), "{place:?}");
                    // The matrix says the same.
                    let m = c.matrix(&e);
                    let at = [0, 1, 2].map(|r| (0..3).map(|i| m[i][r] * p[i]).sum::<f64>() + m[3][r]);
                    let want = [0, 1].map(|k| 2.0 * (place[k] - c.first[k] as f64) / 1024.0 - 1.0);
                    assert!((at[0] - want[0]).abs().max((at[1] - want[1]).abs()) < 1e-9);
                    assert!((at[2] - place[2]).abs() < 1e-12);
                }
                from = c.far;
            }
        }
    }

    #[test]
    fn the_map_is_the_same_to_the_bit_wherever_the_camera_is_and_looks() {
        let sun = normalize([0.3, -0.6, 0.5]);
        let maps =
            |position, direction| cascades(&eye(position, direction), sun, (0.0, 5.0, 4000.0), 4, 0.8, 512);
        let a = maps([0.0; 3], [0.0, 1.0, 0.0]);
        for k in 0..50 {
            let t = 0.1 * f64::from(k);
            let b = maps([3.21 * t, -1.7 * t, 0.4 * t], [t.cos(), t.sin(), -0.2]);
            for (a, b) in a.iter().zip(&b) {
                // Depths begin elsewhere where the camera leaves the middle of their range.
                assert_eq!(a.grid, ShadowGrid { lowest: a.grid.lowest, ..b.grid.clone() });
                assert_eq!(b.first.map(|f| f % b.grid.page()), [0; 2]);
            }
        }
    }
}
