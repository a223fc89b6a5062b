//! The eye: a camera at a resolution, in doubles.

use crate::scene::{Camera, Terrain};

/// Near plane, m.
pub const NEAR_PLANE: f64 = 0.05;

/// A camera placed in the world at an image size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Eye {
    /// Position in world coordinates, m.
    pub position: [f64; 3],
    /// Unit vector of the view.
    pub forward: [f64; 3],
    /// Unit vector to the right of the image.
    pub right: [f64; 3],
    /// Unit vector to the top of the image.
    pub up: [f64; 3],
    /// Tangents of half the field of view, horizontal and vertical.
    pub tangents: [f64; 2],
    /// Pixels.
    pub size: [u32; 2],
    /// Pixels that one metre covers at one metre, for everything that chooses a level of detail. Usually those of the image; a
    /// measurement may take few samples of what a sharper image would show.
    pub pixels_at_1m: f64,
    /// By how much the picture is shifted to the right and down, pixels: a part of one, for frames of which a picture is the mean.
    pub shift: [f64; 2],
    /// What is looked for beyond the picture's edges, pixels: as far as shifts go.
    pub margin: f64,
}

pub(crate) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(crate) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub(crate) fn normalize(a: [f64; 3]) -> [f64; 3] {
    let n = dot(a, a).sqrt();
    a.map(|v| v / n)
}

pub(crate) fn add(a: [f64; 3], b: [f64; 3], s: f64) -> [f64; 3] {
    [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]]
}

impl Eye {
    /// Places a scene's camera; its heights are above the ground there.
    pub fn new(camera: &Camera, terrain: &Terrain, size: [u32; 2]) -> Self {
        let place = |p: [f64; 3]| [p[0], p[1], p[2] + terrain.height_at(p[0], p[1])];
        let (position, target) = (place(camera.position), place(camera.target));
        Eye::looking(position, add(target, position, -1.0), camera.vertical_fov, size)
    }

    /// An eye at a world position, looking along a direction of any length (north where it has none).
    pub fn looking(position: [f64; 3], direction: [f64; 3], vertical_fov: f64, size: [u32; 2]) -> Self {
        let forward = if dot(direction, direction) > 0.0 { normalize(direction) } else { [0.0, 1.0, 0.0] };
        // Straight up or down there is no horizon to level: north is then up in the image.
        let across = cross(forward, [0.0, 0.0, 1.0]);
        let right = if dot(across, across) > 1e-20 { normalize(across) } else { [1.0, 0.0, 0.0] };
        let vertical = (0.5 * vertical_fov.to_radians()).tan();
        Eye {
            position,
            forward,
            right,
            up: cross(right, forward),
            tangents: [vertical * f64::from(size[0]) / f64::from(size[1]), vertical],
            size,
            pixels_at_1m: 0.5 * f64::from(size[1]) / vertical,
            shift: [0.0; 2],
            margin: 0.0,
        }
    }

    /// The picture's shift in clip space.
    pub fn clip_shift(&self) -> [f64; 2] {
        [0, 1].map(|k| 2.0 * self.shift[k] / f64::from(self.size[k]))
    }

    /// Tangents of half of what is looked for: the field of view and the margin.
    pub fn reach(&self) -> [f64; 2] {
        [0, 1].map(|k| self.tangents[k] * (1.0 + 2.0 * self.margin / f64::from(self.size[k])))
    }

    /// Clip from world coordinates relative to the eye, column by column: reverse Z with an infinite far plane, y down.
    pub fn clip(&self) -> [[f64; 4]; 4] {
        let [tx, ty] = self.tangents;
        let row_x = self.right.map(|v| v / tx);
        let row_y = self.up.map(|v| -v / ty);
        let (f, [sx, sy]) = (self.forward, self.clip_shift());
        let mut columns = [[0.0; 4]; 4];
        for k in 0..3 {
            columns[k] = [row_x[k] + sx * f[k], row_y[k] + sy * f[k], 0.0, f[k]];
        }
        columns[3] = [0.0, 0.0, NEAR_PLANE, 0.0];
        columns
    }

    /// The planes of the frustum and its margin, for points relative to the eye: left, right, bottom, top, near; inside is positive, metres.
    pub fn planes(&self) -> Vec<[f64; 4]> {
        let [tx, ty] = self.reach();
        let side = |axis: [f64; 3], sign: f64, t: f64| {
            let n = normalize(add(self.forward.map(|v| v * t), axis, sign));
            [n[0], n[1], n[2], 0.0]
        };
        let f = self.forward;
        vec![
            side(self.right, 1.0, tx),
            side(self.right, -1.0, tx),
            side(self.up, 1.0, ty),
            side(self.up, -1.0, ty),
            [f[0], f[1], f[2], -NEAR_PLANE],
        ]
    }

    /// Distances between the image's own pixels that one metre covers at one metre.
    pub fn raster_at_1m(&self) -> f64 {
        0.5 * f64::from(self.size[1]) / self.tangents[1]
    }

    /// Unit vector through a corner of the image and its margin.
    pub fn corner(&self) -> [f64; 3] {
        let [tx, ty] = self.reach();
        normalize(add(add(self.forward, self.right, tx), self.up, ty))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn planes_and_projection_agree() {
        let eye = Eye::looking([0.0; 3], [0.3, 0.8, -0.2], 50.0, [640, 480]);
        let (m, planes) = (eye.clip(), eye.planes());
        for k in 0..2000 {
            let p = [f64::from(k % 13) - 6.0, f64::from(k % 17) - 4.0, f64::from(k % 11) - 5.0];
            let c = [0, 1, 3].map(|r| (0..3).map(|i| m[i][r] * p[i]).sum::<f64>());
            let visible = c[2] > NEAR_PLANE && c[0].abs() < c[2] && c[1].abs() < c[2];
            let inside = planes.iter().all(|n| dot([n[0], n[1], n[2]], p) + n[3] > 0.0);
            assert_eq!(visible, inside, "{p:?}");
        }
    }

    #[test]
    fn straight_down_has_north_up() {
        let eye = Eye::looking([0.0; 3], [0.0, 0.0, -1.0], 50.0, [64, 64]);
        assert!(dot(eye.up, [0.0, 1.0, 0.0]) > 0.999 && dot(eye.right, [1.0, 0.0, 0.0]) > 0.999);
    }
}
