//! Orthographic depth views of a mesh: the nearest and the farthest surface through the leaf masks.

use glam::{Vec2, Vec3};

use super::surface::{Face, Surface};
use crate::physics::views::Basis;

/// Sub-samples a side of a texel: 16 a texel, as levels of opacity.
pub const SUBSAMPLES: u32 = 4;

/// A raster of nearest and farthest depths, `SUBSAMPLES`² a texel, one sample in the middle of each cell.
pub struct Raster {
    /// Samples a side.
    pub size: u32,
    /// Largest depth along w (nearest to the viewer), −∞ where there is nothing; rows from the bottom up.
    pub nearest: Vec<f32>,
    /// Smallest depth along w, +∞ where there is nothing.
    pub farthest: Vec<f32>,
    /// Index of the nearest face, [`NO_FACE`] where there is none.
    pub faces: Vec<u32>,
}

/// Where a raster has no face.
pub const NO_FACE: u32 = u32::MAX;

/// Where samples of a view lie in scaled tree space.
#[derive(Clone, Copy, Debug)]
pub struct View {
    /// Image axis to the right.
    pub right: Vec3,
    /// Image axis upwards.
    pub up: Vec3,
    /// Towards the viewer.
    pub w: Vec3,
    /// Half extents of the image.
    pub half: Vec2,
}

impl View {
    /// The view of an image of `resolution`² texels, its outermost ring empty: (u, v) of
    /// [`crate::physics::zfield::project`].
    pub fn new(basis: &Basis, resolution: u32) -> Self {
        let m = f64::from(resolution) / (f64::from(resolution) - 2.0);
        View {
            right: basis.right.as_vec3(),
            up: basis.up.as_vec3(),
            w: basis.w.as_vec3(),
            half: Vec2::new(m as f32, (m * basis.extent) as f32),
        }
    }

    /// The point at a depth behind the middle of sample (column, row) of `size`².
    pub fn point(&self, size: u32, column: u32, row: u32, depth: f32) -> Vec3 {
        let c = (Vec2::new(column as f32, row as f32) + 0.5) * (2.0 / size as f32) - 1.0;
        self.right * (c.x * self.half.x) + self.up * (c.y * self.half.y) + self.w * depth
    }
}

impl Raster {
    /// An empty raster for images of `resolution`² texels.
    pub fn new(resolution: u32) -> Self {
        let size = resolution * SUBSAMPLES;
        let n = (size * size) as usize;
        Raster {
            size,
            nearest: vec![f32::NEG_INFINITY; n],
            farthest: vec![f32::INFINITY; n],
            faces: vec![NO_FACE; n],
        }
    }

    /// Draws a view of the surface, in place of what was there.
    pub fn draw(&mut self, surface: &Surface, view: &View) {
        self.nearest.fill(f32::NEG_INFINITY);
        self.farthest.fill(f32::INFINITY);
        self.faces.fill(NO_FACE);
        let scale = Vec2::splat(0.5 * self.size as f32) / view.half;
        let middle = 0.5 * self.size as f32;
        for (index, face) in surface.faces.iter().enumerate() {
            let corners = face.p.map(|p| {
                let xy = Vec2::new(p.dot(view.right), p.dot(view.up)) * scale + middle;
                Vec3::new(xy.x, xy.y, p.dot(view.w))
            });
            self.draw_face(surface, (face, index as u32), corners);
        }
    }

    /// One triangle by rows. A sample belongs to it if its middle lies on or right of the left edge and left
    /// of the right edge; both neighbours compute a shared edge alike (from its lower end), so no sample is
    /// lost or drawn twice between them.
    fn draw_face(&mut self, surface: &Surface, (face, index): (&Face, u32), corners: [Vec3; 3]) {
        let mut order = [0, 1, 2];
        order.sort_by(|&a, &b| corners[a].y.total_cmp(&corners[b].y));
        let [a, b, c] = order.map(|i| corners[i]);
        let ((ax, ay), (bx, by), (cx, cy)) = (wide(a), wide(b), wide(c));
        let area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay);
        if area == 0.0 {
            return;
        }
        // Depth and texture coordinates are planes over the image: value = origin + dx·x + dy·y, about a.
        let gradient = |f: [f32; 3]| {
            let (f0, f1, f2) = (f64::from(f[0]), f64::from(f[1]), f64::from(f[2]));
            let dx = ((f1 - f0) * (cy - ay) - (f2 - f0) * (by - ay)) / area;
            let dy = ((f2 - f0) * (bx - ax) - (f1 - f0) * (cx - ax)) / area;
            (f0 - dx * ax - dy * ay, dx, dy)
        };
        let depth = gradient([a.z, b.z, c.z]);
        let uv = order.map(|i| face.uv[i]);
        let (u, v) = (gradient(uv.map(|c| c.x)), gradient(uv.map(|c| c.y)));
        // Nearly edge-on triangles have steep planes: rounding must not leave the triangle's own range.
        let (low, high) = (a.z.min(b.z).min(c.z), a.z.max(b.z).max(c.z));
        let mask = face.mask.map(|m| &surface.masks[m as usize]);

        let limit = f64::from(self.size);
        let first = (ay - 0.5).ceil().clamp(0.0, limit) as u32;
        let last = (cy - 0.5).ceil().clamp(0.0, limit) as u32;
        for row in first..last {
            let y = f64::from(row) + 0.5;
            let long = ax + (cx - ax) * ((y - ay) / (cy - ay));
            let short = if y < by {
                ax + (bx - ax) * ((y - ay) / (by - ay))
            } else {
                bx + (cx - bx) * ((y - by) / (cy - by))
            };
            let (left, right) = if long < short { (long, short) } else { (short, long) };
            let left = (left - 0.5).ceil().clamp(0.0, limit) as u32;
            let right = (right - 0.5).ceil().clamp(0.0, limit) as u32;
            if left >= right {
                continue;
            }
            let x = f64::from(left) + 0.5;
            let at = |(f0, dx, dy): (f64, f64, f64)| (f0 + dx * x + dy * y) as f32;
            let (depth0, u0, v0) = (at(depth), at(u), at(v));
            let (ddepth, du, dv) = (depth.1 as f32, u.1 as f32, v.1 as f32);
            let start = (row * self.size) as usize;
            let span = start + left as usize..start + right as usize;
            let depths = self.nearest[span.clone()].iter_mut().zip(&mut self.farthest[span.clone()]);
            for (i, ((near, far), nearest)) in depths.zip(&mut self.faces[span]).enumerate() {
                let t = i as f32;
                let d = (depth0 + t * ddepth).clamp(low, high);
                // The mask is looked up only where the sample would change anything: late in a dense
                // crown that is seldom.
                if (d > *near || d < *far)
                    && mask.is_none_or(|m| m.opaque(Vec2::new(u0 + t * du, v0 + t * dv)))
                {
                    if d > *near {
                        (*near, *nearest) = (d, index);
                    }
                    *far = far.min(d);
                }
            }
        }
    }
}

fn wide(p: Vec3) -> (f64, f64) {
    (f64::from(p.x), f64::from(p.y))
}
