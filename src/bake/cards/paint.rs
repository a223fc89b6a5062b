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
struct Seen {
    depth: f32,
    face: u32,
    uv: Vec2,
}

/// The picture of a card with texels of so many metres: colour as sRGB, the mean of what both sides show, and opacity, of which
/// as many texels are at least a half as the cluster covers.
pub fn paint(mesh: &Mesh, surface: &Surface, card: &Card, texel: f32) -> RgbaImage {
    let size = [card.right, card.up].map(|side| ((2.0 * side.length() / texel).ceil() as u32).max(1));
    let [columns, rows] = size.map(|n| n * SAMPLES);
    let nothing = |depth| Seen { depth, face: u32::MAX, uv: Vec2::ZERO };
    let mut sides = [nothing(f32::NEG_INFINITY), nothing(f32::INFINITY)]
        .map(|none| vec![none; (columns * rows) as usize]);
    let axis = |side: Vec3| side.normalize_or_zero();
    let (right, up) = (axis(card.right), axis(card.up));
    let toward = right.cross(up);
    let scale = Vec2::new(
        columns as f32 / (2.0 * card.right.length()).max(1e-9),
        rows as f32 / (2.0 * card.up.length()).max(1e-9),
    );
    let middle = Vec2::new(columns as f32, rows as f32) * 0.5;
    for face in &card.faces {
        let f = &surface.faces[*face as usize];
        let p = f.p.map(|p| surface.frame.to_metres(p) - card.centre);
        let at = p.map(|p| middle + Vec2::new(p.dot(right), -p.dot(up)) * scale);
        let depth = p.map(|p| p.dot(toward));
        let area = (at[1] - at[0]).perp_dot(at[2] - at[0]);
        if area == 0.0 {
            continue;
        }
        let low = at[0].min(at[1]).min(at[2]).max(Vec2::ZERO);
        let high = at[0].max(at[1]).max(at[2]).min(2.0 * middle);
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
                if (d > sides[0][k].depth || d < sides[1][k].depth) && surface.opaque(f, uv) {
                    let seen = Seen { depth: d, face: *face, uv };
                    if d > sides[0][k].depth {
                        sides[0][k] = seen;
                    }
                    if d < sides[1][k].depth {
                        sides[1][k] = seen;
                    }
                }
            }
        }
    }
    resolve(mesh, surface, size, &sides)
}

/// Texels of samples.
fn resolve(mesh: &Mesh, surface: &Surface, size: [u32; 2], sides: &[Vec<Seen>; 2]) -> RgbaImage {
    let columns = size[0] * SAMPLES;
    let mut texels = vec![(Vec3::ZERO, 0u32); (size[0] * size[1]) as usize];
    let (mut sum, mut covered) = (Vec3::ZERO, 0u32);
    for (k, _) in sides[0].iter().enumerate().filter(|(_, s)| s.face != u32::MAX) {
        let (x, y) = (k as u32 % columns / SAMPLES, k as u32 / columns / SAMPLES);
        let colour = 0.5 * (color(mesh, surface, &sides[0][k]) + color(mesh, surface, &sides[1][k]));
        let texel = &mut texels[(y * size[0] + x) as usize];
        texel.0 += colour;
        texel.1 += 1;
        sum += colour;
        covered += 1;
    }
    // Where nothing is, the card's mean, so that filters do not darken edges.
    let mean = sum / covered.max(1) as f32;
    let least = threshold(&texels, covered);
    let mut image = RgbaImage::new(size[0], size[1]);
    for (pixel, (colour, count)) in image.pixels_mut().zip(&texels) {
        let linear = if *count > 0 { *colour / *count as f32 } else { mean };
        let byte = |v: f32| (255.0 * tonemap::srgb(f64::from(v.clamp(0.0, 1.0)))).round() as u8;
        // From the threshold on at least a half.
        let alpha = if *count >= least {
            128 + 127 * (*count - least) / (SAMPLES * SAMPLES - least).max(1)
        } else {
            127 * *count / least.max(1)
        };
        *pixel = Rgba([byte(linear.x), byte(linear.y), byte(linear.z), alpha.min(255) as u8]);
    }
    image
}

/// How many samples of a texel must be covered for it to count as covered, so that as many texels do as are covered in all.
fn threshold(texels: &[(Vec3, u32)], covered: u32) -> u32 {
    let wanted = covered as f32 / (SAMPLES * SAMPLES) as f32;
    let having = |least: u32| texels.iter().filter(|t| t.1 >= least).count() as f32;
    (1..=SAMPLES * SAMPLES)
        .min_by(|a, b| (having(*a) - wanted).abs().total_cmp(&(having(*b) - wanted).abs()))
        .unwrap_or(1)
}

/// Linear base colour of what a sample sees.
fn color(mesh: &Mesh, surface: &Surface, seen: &Seen) -> Vec3 {
    let material = &mesh.materials[surface.faces[seen.face as usize].material as usize];
    let texel = texel_of(&material.texture, seen.uv);
    let linear = |k: usize| tonemap::linear(f64::from(texel[k]) / 255.0) as f32 * material.base_color[k];
    Vec3::new(linear(0), linear(1), linear(2))
}
