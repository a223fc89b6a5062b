//! Trees cut into level slabs, each seen from straight above (BCF05 3.1): which tree and which of its faces every sample sees. What that
//! means for a texel is summed up in a second step, [`Samples::texels`], for whatever is known of trees and faces.

use glam::{Vec2, Vec3};

use super::patch::Image;
use crate::Result;
use crate::bake::surface::{Face, Surface};
use crate::scene::Mesh;

/// Samples a side of a texel: 16 a texel.
pub const SAMPLES: u32 = 4;
/// Shares of the full density at which cover is known: 1/4, 2/4, 3/4, 4/4.
pub const SHARES: usize = 4;
/// By so much of its size a triangle is wider than it is.
const EDGE: f32 = 1e-5;
/// Where a sample sees no tree.
pub const NONE: u32 = u32::MAX;

/// A species as it is painted.
pub struct Kind {
    /// Its surface; faces are numbered as here.
    pub surface: Surface,
    /// Whether each face is a leaf, and not bark.
    pub leaf: Vec<bool>,
    /// Corners of each face, m about the trunk's base.
    pub(super) corners: Vec<[Vec3; 3]>,
    /// How far the tree reaches from its trunk, m.
    pub reach: f32,
    /// How high it is, m.
    pub height: f32,
}

impl Kind {
    /// Prepares a model.
    ///
    /// # Errors
    /// [`crate::Error::Usage`] for a mesh without extent.
    pub fn new(mesh: &Mesh) -> Result<Self> {
        let surface = Surface::new(mesh)?;
        let metres = |f: &Face| f.p.map(|p| surface.frame.to_metres(p));
        Ok(Kind {
            leaf: surface.faces.iter().map(|f| mesh.materials[f.material as usize].foliage).collect(),
            corners: surface.faces.iter().map(metres).collect(),
            reach: surface.frame.half_width,
            height: surface.frame.centre + surface.frame.half_height,
            surface,
        })
    }
}

/// A rectangle of the ground and how finely it is painted.
#[derive(Clone, Copy, Debug)]
pub struct Window {
    /// South-west corner, m.
    pub low: Vec2,
    /// Side of a texel, m.
    pub texel: f32,
    /// Texels east and north.
    pub size: [u32; 2],
    /// Number of slabs, from the ground up.
    pub slices: u32,
    /// Upper end of the highest slab, m.
    pub height: f32,
}

/// The uppermost surface of a slab at a sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen {
    /// Height above the ground, in slabs.
    pub height: f32,
    /// Index of the tree among those painted; `u32::MAX` where there is none.
    pub tree: u32,
    /// Index of its face.
    pub face: u32,
}

/// What all samples of a window see.
pub struct Samples {
    window: Window,
    /// By slab, row from the south, and column.
    seen: Vec<Seen>,
    /// The least of the [`SHARES`] at which the sample is covered in its slab, by index; SHARES where nothing ever is.
    least: Vec<u8>,
}

impl Samples {
    /// Paints trees.
    pub fn paint(kinds: &[Kind], images: &[Image], window: Window) -> Self {
        let count = (window.size[0] * window.size[1] * SAMPLES * SAMPLES * window.slices) as usize;
        let nothing = Seen { height: f32::NEG_INFINITY, tree: NONE, face: NONE };
        let mut samples = Samples { window, seen: vec![nothing; count], least: vec![SHARES as u8; count] };
        let extent = Vec2::new(window.size[0] as f32, window.size[1] as f32) * window.texel;
        for (index, image) in (0u32..).zip(images) {
            let kind = &kinds[image.tree.species as usize];
            let at = image.tree.base.truncate() - window.low;
            if at.distance(at.clamp(Vec2::ZERO, extent)) < kind.reach * image.tree.scale {
                samples.paint_tree(kind, image, index);
            }
        }
        samples
    }

    fn paint_tree(&mut self, kind: &Kind, image: &Image, tree: u32) {
        let w = self.window;
        let class = ((image.activation * SHARES as f32) as u8).min(SHARES as u8 - 1);
        let (across, up) = (SAMPLES as f32 / w.texel, w.slices as f32 / w.height);
        let base = (image.tree.base.truncate() - w.low) * across;
        for (face, corners) in (0u32..).zip(&kind.corners) {
            let corners = corners.map(|p| {
                let p = image.tree.to_grove(p);
                (base + p.truncate() * across).extend(p.z * up)
            });
            self.paint_face(&kind.surface, face, corners, (tree, class));
        }
    }

    /// One triangle, its corners in samples and slabs. A sample whose middle is on an edge belongs to both sides: the higher one is seen, and
    /// rounding leaves no gap between them.
    fn paint_face(&mut self, surface: &Surface, face: u32, p: [Vec3; 3], (tree, class): (u32, u8)) {
        let [columns, rows] = self.window.size.map(|n| (n * SAMPLES) as f32);
        let (low, high) = (p[0].min(p[1]).min(p[2]), p[0].max(p[1]).max(p[2]));
        let first = [low.x, low.y].map(|v| (v - 0.5).ceil().max(0.0));
        let last = [(high.x - 0.5).floor().min(columns - 1.0), (high.y - 0.5).floor().min(rows - 1.0)];
        let [a, b, c] = p.map(Vec3::truncate);
        let area = (b - a).perp_dot(c - a);
        // Nothing of it is above the ground, beside the window, or seen from above.
        if high.z <= 0.0 || first[0] > last[0] || first[1] > last[1] || area == 0.0 {
            return;
        }
        let f = &surface.faces[face as usize];
        // Weights of the second and third corner are planes over the samples.
        let (step1, step2) = (Vec2::new(c.y - a.y, a.x - c.x) / area, Vec2::new(a.y - b.y, b.x - a.x) / area);
        for y in first[1] as u32..=last[1] as u32 {
            for x in first[0] as u32..=last[0] as u32 {
                let q = Vec2::new(x as f32 + 0.5, y as f32 + 0.5) - a;
                let (w1, w2) = (step1.dot(q), step2.dot(q));
                if w1 < -EDGE || w2 < -EDGE || w1 + w2 > 1.0 + EDGE {
                    continue;
                }
                let w0 = 1.0 - w1 - w2;
                // Rounding of steep planes must not leave the triangle's own range.
                let height = (p[0].z * w0 + p[1].z * w1 + p[2].z * w2).clamp(low.z, high.z);
                if height < 0.0 {
                    continue;
                }
                let k = self.index(height, x, y);
                let (seen, least) = (&mut self.seen[k], &mut self.least[k]);
                // Holes are looked for only where a surface would change anything.
                if (height > seen.height || class < *least)
                    && surface.opaque(f, f.uv[0] * w0 + f.uv[1] * w1 + f.uv[2] * w2)
                {
                    *least = class.min(*least);
                    if height > seen.height {
                        *seen = Seen { height, tree, face };
                    }
                }
            }
        }
    }

    /// Share of the ground of each texel that is hidden from straight above at each of the [`SHARES`]; by row from the south, and column.
    pub fn above(&self) -> Vec<[f32; SHARES]> {
        let [columns, rows] = self.window.size;
        let plane = (columns * rows * SAMPLES * SAMPLES) as usize;
        let part = 1.0 / (SAMPLES * SAMPLES) as f32;
        let mut above = vec![[0.0; SHARES]; (columns * rows) as usize];
        for k in 0..plane {
            let least = self.least[k..].iter().step_by(plane).min().map_or(SHARES, |l| usize::from(*l));
            let (x, y) = (k as u32 % (columns * SAMPLES), k as u32 / (columns * SAMPLES));
            let cover = &mut above[(y / SAMPLES * columns + x / SAMPLES) as usize];
            cover[least..].iter_mut().for_each(|c| *c += part);
        }
        above
    }

    /// What is seen of blocks of so many texels a side: of each slab, and block by row from the south and column, the samples that see a tree,
    /// and where, m. Blocks that see none are left out.
    pub fn blocks(&self, texels: u32, mut visit: impl FnMut(u32, [u32; 2], &[(Vec3, Seen)])) {
        let w = self.window;
        let (side, [columns, rows]) = (texels * SAMPLES, w.size.map(|n| n * SAMPLES));
        let mut seen = Vec::with_capacity((side * side) as usize);
        for (slab, y) in (0..w.slices).flat_map(|slab| (0..rows / side).map(move |y| (slab, y))) {
            for x in 0..columns / side {
                seen.clear();
                for (v, u) in (0..side).flat_map(|v| (0..side).map(move |u| (y * side + v, x * side + u))) {
                    let sample = self.seen[((slab * rows + v) * columns + u) as usize];
                    if sample.tree != NONE {
                        let across = Vec2::new(u as f32 + 0.5, v as f32 + 0.5) * (w.texel / SAMPLES as f32);
                        let up = sample.height * (w.height / w.slices as f32);
                        seen.push(((w.low + across).extend(up), sample));
                    }
                }
                if !seen.is_empty() {
                    visit(slab, [x, y], &seen);
                }
            }
        }
    }

    fn index(&self, height: f32, x: u32, y: u32) -> usize {
        let slab = (height as u32).min(self.window.slices - 1);
        let [columns, rows] = self.window.size.map(|n| n * SAMPLES);
        ((slab * rows + y) * columns + x) as usize
    }

    /// Share of each texel that is covered at each of the [`SHARES`], and the mean over the texel of what `value` says of the surfaces that are
    /// seen there at full density, 0 where there is none: both are premultiplied. By slab, row from the south, and column.
    pub fn texels<const N: usize>(
        &self,
        value: impl Fn(&Seen) -> [f32; N],
    ) -> Vec<([f32; SHARES], [f32; N])> {
        let [columns, rows] = self.window.size;
        let part = 1.0 / (SAMPLES * SAMPLES) as f32;
        let mut texels = vec![([0.0; SHARES], [0.0; N]); (columns * rows * self.window.slices) as usize];
        for (k, (seen, least)) in self.seen.iter().zip(&self.least).enumerate() {
            if seen.tree == NONE {
                continue;
            }
            let (x, line) = (k as u32 % (columns * SAMPLES), k as u32 / (columns * SAMPLES));
            // Lines of samples of all slabs follow one another, and a slab has whole texels of them.
            let (cover, sum) = &mut texels[(line / SAMPLES * columns + x / SAMPLES) as usize];
            cover[usize::from(*least)..].iter_mut().for_each(|c| *c += part);
            sum.iter_mut().zip(value(seen)).for_each(|(s, v)| *s += part * v);
        }
        texels
    }
}
