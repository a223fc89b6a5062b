//! A cluster painted on a card: seen along the card's normal from both sides.

use glam::{Vec2, Vec3};
use image::{Rgba, RgbaImage};

use super::Card;
use crate::bake::optics::texel_of;
use crate::bake::surface::Surface;
use crate::physics::tonemap;
use crate::scene::Mesh;

/// Samples a side of a texel.
const SAMPLES: u32 = 4;

/// What a sample sees from one side.
#[derive(Clone, Copy)]
pub struct Seen {
    /// How far from the card it is, towards the viewer of its front, m.
    pub depth: f32,
    /// Index of the face.
    pub face: u32,
    uv: Vec2,
}

/// Samples of a card.
pub struct Painted {
    /// Texels.
    pub size: [u32; 2],
    /// What the viewer of its front sees in each sample, and that of its back, in the same places: the back is not turned round. Rows from the top.
    sides: [Vec<Seen>; 2],
    /// Samples of each texel in which anything is seen: from both sides the same.
    counts: Vec<u32>,
}

/// Texels of so many metres that a card has along its sides.
pub fn texels_of(card: &Card, texel: f32) -> [u32; 2] {
    [card.right, card.up].map(|side| ((2.0 * side.length() / texel).ceil() as u32).max(1))
}

impl Painted {
    /// Paints a card with texels of so many metres.
    pub fn new(surface: &Surface, card: &Card, texel: f32) -> Self {
        let size = texels_of(card, texel);
        let [columns, rows] = size.map(|n| n * SAMPLES);
        let nothing = |depth| Seen { depth, face: u32::MAX, uv: Vec2::ZERO };
        let sides = [nothing(f32::NEG_INFINITY), nothing(f32::INFINITY)]
            .map(|none| vec![none; (columns * rows) as usize]);
        let mut painted = Painted { size, sides, counts: vec![0; (size[0] * size[1]) as usize] };
        let (right, up) = (card.right.normalize_or_zero(), card.up.normalize_or_zero());
        let scale = Vec2::new(
            columns as f32 / (2.0 * card.right.length()).max(1e-9),
            rows as f32 / (2.0 * card.up.length()).max(1e-9),
        );
        let middle = Vec2::new(columns as f32, rows as f32) * 0.5;
        for face in &card.faces {
            let p = surface.faces[*face as usize].p.map(|p| surface.frame.to_metres(p) - card.centre);
            let at = p.map(|p| middle + Vec2::new(p.dot(right), -p.dot(up)) * scale);
            painted.draw(surface, *face, at, p.map(|p| p.dot(right.cross(up))));
        }
        for k in 0..columns * rows {
            if painted.sides[0][k as usize].face != u32::MAX {
                painted.counts[(k / columns / SAMPLES * size[0] + k % columns / SAMPLES) as usize] += 1;
            }
        }
        painted
    }

    /// Draws a face whose corners are at these samples and depths.
    fn draw(&mut self, surface: &Surface, face: u32, at: [Vec2; 3], depth: [f32; 3]) {
        let [columns, rows] = self.size.map(|n| n * SAMPLES);
        let f = &surface.faces[face as usize];
        let area = (at[1] - at[0]).perp_dot(at[2] - at[0]);
        if area == 0.0 {
            return;
        }
        let low = at[0].min(at[1]).min(at[2]).max(Vec2::ZERO);
        let high = at[0].max(at[1]).max(at[2]);
        for y in low.y.floor() as u32..(high.y.ceil() as u32).min(rows) {
            for x in low.x.floor() as u32..(high.x.ceil() as u32).min(columns) {
                let q = Vec2::new(x as f32, y as f32) + 0.5;
                let weight = |i: usize, j: usize| (at[j] - at[i]).perp_dot(q - at[i]) / area;
                let w = [weight(1, 2), weight(2, 0), weight(0, 1)];
                if w.iter().any(|w| *w < 0.0) {
                    continue;
                }
                let uv = f.uv[0] * w[0] + f.uv[1] * w[1] + f.uv[2] * w[2];
                let d = depth[0] * w[0] + depth[1] * w[1] + depth[2] * w[2];
                let k = (y * columns + x) as usize;
                let nearer = [d > self.sides[0][k].depth, d < self.sides[1][k].depth];
                if nearer != [false; 2] && surface.opaque(f, uv) {
                    for side in (0..2).filter(|side| nearer[*side]) {
                        self.sides[side][k] = Seen { depth: d, face, uv };
                    }
                }
            }
        }
    }

    /// Samples in which anything is: their texel, and what the viewer of the front sees there, and that of the back.
    pub fn samples(&self) -> impl Iterator<Item = ([u32; 2], [Seen; 2])> {
        let columns = self.size[0] * SAMPLES;
        let texel = move |k: u32| [k % columns / SAMPLES, k / columns / SAMPLES];
        let pairs = (0..).zip(self.sides[0].iter().zip(&self.sides[1]));
        pairs.filter(|(_, s)| s.0.face != u32::MAX).map(move |(k, s)| (texel(k), [*s.0, *s.1]))
    }

    /// How far from the card's plane anything is that is seen, at most, m.
    pub fn depth(&self) -> f32 {
        self.samples().flat_map(|(_, seen)| seen).fold(0.0, |most, s| s.depth.abs().max(most))
    }

    /// Opacity of every texel, rows from the top: as many are at least 128 as the cluster covers.
    pub fn opacity(&self) -> impl Iterator<Item = u8> {
        let least = self.threshold();
        self.counts.iter().map(move |count| {
            // From the threshold on at least a half.
            let alpha = if *count >= least {
                128 + 127 * (*count - least) / (SAMPLES * SAMPLES - least).max(1)
            } else {
                127 * *count / least.max(1)
            };
            alpha.min(255) as u8
        })
    }

    /// How many samples of a texel must be covered for it to count as covered, so that as many texels do as are covered in all.
    fn threshold(&self) -> u32 {
        let wanted = self.counts.iter().sum::<u32>() as f32 / (SAMPLES * SAMPLES) as f32;
        let having = |least: u32| self.counts.iter().filter(|c| **c >= least).count() as f32;
        (1..=SAMPLES * SAMPLES)
            .min_by(|a, b| (having(*a) - wanted).abs().total_cmp(&(having(*b) - wanted).abs()))
            .unwrap_or(1)
    }

    /// The picture of a card: colour as sRGB, the mean of what both sides show, and opacity.
    pub fn picture(&self, mesh: &Mesh, surface: &Surface) -> RgbaImage {
        let mut sums = vec![Vec3::ZERO; self.counts.len()];
        for ([x, y], seen) in self.samples() {
            let [front, back] = seen.map(|s| color(mesh, surface, &s));
            sums[(y * self.size[0] + x) as usize] += 0.5 * (front + back);
        }
        // Where nothing is, the card's mean, so that filters do not darken edges.
        let mean = sums.iter().sum::<Vec3>() / self.counts.iter().sum::<u32>().max(1) as f32;
        let mut image = RgbaImage::new(self.size[0], self.size[1]);
        let texels = sums.iter().zip(&self.counts).zip(self.opacity());
        for (pixel, ((sum, count), alpha)) in image.pixels_mut().zip(texels) {
            let linear = if *count > 0 { *sum / *count as f32 } else { mean };
            let byte = |v: f32| (255.0 * tonemap::srgb(f64::from(v.clamp(0.0, 1.0)))).round() as u8;
            *pixel = Rgba([byte(linear.x), byte(linear.y), byte(linear.z), alpha]);
        }
        image
    }
}

/// Linear base colour of what a sample sees.
fn color(mesh: &Mesh, surface: &Surface, seen: &Seen) -> Vec3 {
    let material = &mesh.materials[surface.faces[seen.face as usize].material as usize];
    let texel = texel_of(&material.texture, seen.uv);
    let linear = |k: usize| tonemap::linear(f64::from(texel[k]) / 255.0) as f32 * material.base_color[k];
    Vec3::new(linear(0), linear(1), linear(2))
}
