//! Shadow cascades: parallel splits (Zhang et al. 2006), each a sphere around its slice of the frustum, moved in whole
//! texels so that shadows do not swim as the camera moves or turns.

use super::{Eye, add, cross, dot, normalize};
use crate::physics::shadow::parallel_splits;

/// One cascade: an orthographic view from the sun.
#[derive(Clone, Debug, PartialEq)]
pub struct Cascade {
    /// Directions of x, y and of the sun.
    pub axes: [[f64; 3]; 3],
    /// Centre from the eye along the axes, m.
    pub centre: [f64; 3],
    /// Half extent across the sun, m.
    pub half: f64,
    /// Distance from the eye to which the cascade is used, m.
    pub far: f64,
    /// Metres a texel.
    pub texel: f64,
    /// What casts into it, as planes for points from the eye: everything before it towards the sun does.
    pub planes: Vec<[f64; 4]>,
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
            // One texel more on each side: the centre moves by up to one, and lookups filter over another.
            let half = radius * f64::from(texels) / f64::from(texels - 4);
            let texel = 2.0 * half / f64::from(texels);
            Cascade::around(sun, eye, eye.forward.map(|f| along * f), half, texel, to)
        })
        .collect()
}

impl Cascade {
    /// Clip from world coordinates relative to the eye, column by column; z is 1 at the sun's side, 0 at the far one.
    pub fn matrix(&self) -> [[f64; 4]; 4] {
        let mut columns = [[0.0; 4]; 4];
        let scale = [1.0 / self.half, 1.0 / self.half, 0.5 / self.half];
        for (row, s) in scale.iter().enumerate() {
            for (k, column) in columns.iter_mut().take(3).enumerate() {
                column[row] = self.axes[row][k] * s;
            }
            columns[3][row] = -self.centre[row] * s;
        }
        columns[3][2] += 0.5;
        columns[3][3] = 1.0;
        columns
    }

    /// A cascade around a point relative to the eye, snapped to whole texels.
    pub fn around(sun: [f64; 3], eye: &Eye, target: [f64; 3], half: f64, texel: f64, far: f64) -> Self {
        let across = cross([0.0, 0.0, 1.0], sun);
        let x = if dot(across, across) > 1e-12 { normalize(across) } else { [1.0, 0.0, 0.0] };
        let axes = [x, cross(sun, x), sun];
        // Snapped in world coordinates, then taken relative to the eye again, all in doubles.
        let world = add(eye.position, target, 1.0);
        let snapped = |axis: [f64; 3]| (dot(axis, world) / texel).floor() * texel - dot(axis, eye.position);
        let centre = axes.map(snapped);
        let mut planes = Vec::new();
        for k in 0..2 {
            let a = axes[k];
            planes.push([a[0], a[1], a[2], half - centre[k]]);
            planes.push([-a[0], -a[1], -a[2], half + centre[k]]);
        }
        planes.push([sun[0], sun[1], sun[2], half - centre[2]]);
        Cascade { axes, centre, half, far, texel, planes }
    }
}

/// The sphere around what the frustum sees between two distances from the eye: where its centre is along the view, and
/// its radius. Depends on the field of view only, so turning does not change it.
fn slice_sphere(eye: &Eye, from: f64, to: f64) -> (f64, f64) {
    let cosine = dot(eye.corner(), eye.forward);
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
        let e = eye([100.0, 200.0, 30.0], [0.5, 0.8, -0.1]);
        let sun = normalize([0.3, -0.6, 0.5]);
        let all = cascades(&e, sun, (0.0, 5.0, 4000.0), 4, 0.8, 1024);
        let mut from = 0.0;
        for c in &all {
            for k in 0..500 {
                let (u, v) = (f64::from(k % 21) / 10.0 - 1.0, f64::from(k % 19) / 9.0 - 1.0);
                let d = normalize(add(add(e.forward, e.right, u * e.tangents[0]), e.up, v * e.tangents[1]));
                let p = d.map(|x| x * (from + (c.far - from) * f64::from(k % 7) / 6.0));
                for (axis, centre) in c.axes.iter().zip(c.centre) {
                    assert!((dot(*axis, p) - centre).abs() <= c.half + 1e-9);
                }
            }
            from = c.far;
        }
    }

    #[test]
    fn texels_stay_put_when_the_camera_moves_and_turns() {
        let sun = normalize([0.3, -0.6, 0.5]);
        let a = cascades(&eye([0.0; 3], [0.0, 1.0, 0.0]), sun, (0.0, 5.0, 4000.0), 4, 0.8, 512);
        let e = eye([3.21, -1.7, 0.4], [0.3, 0.9, -0.2]);
        let b = cascades(&e, sun, (0.0, 5.0, 4000.0), 4, 0.8, 512);
        for (a, b) in a.iter().zip(&b) {
            assert!((a.half - b.half).abs() < 1e-9 * a.half);
            for k in 0..2 {
                // World positions of texel borders differ by whole texels.
                let shift = (b.centre[k] + dot(b.axes[k], e.position) - a.centre[k]) / a.texel;
                assert!((shift - shift.round()).abs() < 1e-6, "{shift}");
            }
        }
    }
}
