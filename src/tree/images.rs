//! Made textures: bark, and cards that show a spray of leaves or needles.
//!
//! Reflectances are linear: leaves about (0.05, 0.10, 0.03), as broad-leaved crowns have in the visible.

use image::{Rgba, RgbaImage};

use super::Preset;
use super::random::Random;
use crate::physics::tonemap;

const SIZE: u32 = 256;
/// Sub-samples a side of a texel, for soft edges.
const FINE: u32 = 3;

fn srgb(linear: f64) -> u8 {
    (255.0 * tonemap::srgb(linear.clamp(0.0, 1.0))).round() as u8
}

fn encode(color: [f64; 3], alpha: f64) -> Rgba<u8> {
    Rgba([srgb(color[0]), srgb(color[1]), srgb(color[2]), (255.0 * alpha).round() as u8])
}

/// A straight stroke with a width at each place along it: a leaf, a needle or a twig; in image sizes, y down.
struct Stroke {
    from: [f64; 2],
    along: [f64; 2],
    length: f64,
    color: [f64; 3],
    /// Half the width at 0 (base) to 1 (tip), in image sizes.
    half: fn(f64, f64) -> f64,
    /// The second argument of `half`.
    width: f64,
}

impl Stroke {
    fn new(
        from: [f64; 2],
        angle: f64,
        length: f64,
        width: f64,
        color: [f64; 3],
        half: fn(f64, f64) -> f64,
    ) -> Self {
        // Angles are from the image's up direction, clockwise.
        let along = [angle.to_radians().sin(), -angle.to_radians().cos()];
        Stroke { from, along, length, color, half, width }
    }

    /// The colour at a place, if the stroke covers it.
    fn at(&self, x: f64, y: f64) -> Option<[f64; 3]> {
        let d = [x - self.from[0], y - self.from[1]];
        let s = (d[0] * self.along[0] + d[1] * self.along[1]) / self.length;
        let t = (d[1] * self.along[0] - d[0] * self.along[1]).abs();
        if !(0.0..=1.0).contains(&s) {
            return None;
        }
        let half = (self.half)(s, self.width);
        if t > half {
            return None;
        }
        // A paler midrib, darker edges.
        let shade = 1.12 - 0.24 * t / half.max(1e-9);
        Some(self.color.map(|c| c * shade))
    }
}

fn even(_: f64, width: f64) -> f64 {
    width
}

fn needle(s: f64, width: f64) -> f64 {
    width * (1.0 - s * s)
}

/// Rounded lobes on an obovate blade.
fn oak_leaf(s: f64, width: f64) -> f64 {
    let blade = (std::f64::consts::PI * s.powf(1.35)).sin().max(0.0).powf(0.7);
    width * blade * (0.82 + 0.18 * (s * 22.0).cos())
}

/// Triangular-ovate with a drawn-out tip.
fn birch_leaf(s: f64, width: f64) -> f64 {
    width * (std::f64::consts::PI * s.powf(0.62)).sin().max(0.0)
}

const TWIG: [f64; 3] = [0.07, 0.05, 0.035];

fn broad(seed: u32, pairs: u32, length: f64, width: f64, leaf: fn(f64, f64) -> f64) -> Vec<Stroke> {
    let mut random = Random::new(seed, 1);
    let mut strokes = vec![Stroke::new([0.5, 1.0], 0.0, 0.72, 0.006, TWIG, even)];
    for i in 0..=2 * pairs {
        let share = f64::from(i) / f64::from(2 * pairs);
        let side = if i % 2 == 0 { 1.0 } else { -1.0 };
        let angle = if i == 2 * pairs { 0.0 } else { side * (72.0 - 34.0 * share) } + random.around(14.0);
        let size = 1.0 - 0.22 * share + random.around(0.12);
        let tint = 1.0 + random.around(0.28);
        let color = [0.052 * tint * (1.0 + random.around(0.15)), 0.102 * tint, 0.028 * tint];
        let from = [0.5, 0.93 - 0.62 * share];
        // Side twigs first, so that leaves lie over them.
        strokes.push(Stroke::new(from, angle, 0.09, 0.003, TWIG, even));
        let start = [from[0] + 0.05 * angle.to_radians().sin(), from[1] - 0.05 * angle.to_radians().cos()];
        strokes.push(Stroke::new(start, angle, length * size, width * size, color, leaf));
    }
    strokes
}

fn needles() -> Vec<Stroke> {
    let mut random = Random::new(3, 1);
    let mut strokes = vec![Stroke::new([0.5, 1.0], 0.0, 0.8, 0.008, TWIG, even)];
    // The main shoot and side shoots, each bristling with needles.
    let mut shoots = vec![([0.5, 1.0], 0.0, 0.82)];
    for i in 0..6 {
        let side = if i % 2 == 0 { 1.0 } else { -1.0 };
        let base = 0.88 - 0.1 * f64::from(i);
        shoots.push(([0.5, base], side * 46.0 + random.around(6.0), 0.42 - 0.035 * f64::from(i)));
    }
    for (from, angle, length) in shoots {
        let lean = f64::to_radians(angle);
        strokes.push(Stroke::new(from, angle, length, 0.005, TWIG, even));
        let count = (length * 120.0) as u32;
        for k in 0..count {
            let s = length * f64::from(k) / f64::from(count);
            let base = [from[0] + lean.sin() * s, from[1] - lean.cos() * s];
            let side = if k % 2 == 0 { 1.0 } else { -1.0 };
            let tint = 1.0 + random.around(0.35);
            let color = [0.038 * tint, 0.078 * tint, 0.027 * tint];
            let turn = angle + side * (40.0 + random.around(16.0));
            strokes.push(Stroke::new(base, turn, 0.15 + random.around(0.025), 0.0065, color, needle));
        }
    }
    strokes
}

/// A card of leaves: base of the spray at the middle of the lower edge, opacity cut out.
pub(super) fn leaves(preset: Preset) -> RgbaImage {
    let strokes = match preset {
        Preset::Oak => broad(1, 7, 0.34, 0.075, oak_leaf),
        Preset::Birch => broad(2, 9, 0.21, 0.068, birch_leaf),
        Preset::Pine => needles(),
    };
    let texel = 1.0 / f64::from(SIZE);
    let mut colors = Vec::with_capacity((SIZE * SIZE) as usize);
    for y in 0..SIZE {
        for x in 0..SIZE {
            let (mut sum, mut hits) = ([0.0; 3], 0u32);
            for k in 0..FINE * FINE {
                let at = |i: u32, sub: u32| (f64::from(i) + (f64::from(sub) + 0.5) / f64::from(FINE)) * texel;
                let (px, py) = (at(x, k % FINE), at(y, k / FINE));
                // The last stroke lies on top.
                if let Some(c) = strokes.iter().rev().find_map(|s| s.at(px, py)) {
                    sum = [sum[0] + c[0], sum[1] + c[1], sum[2] + c[2]];
                    hits += 1;
                }
            }
            // Cards are cut at their border, where filtering would wrap around.
            let border = x == 0 || x == SIZE - 1 || y == 0;
            colors.push((sum, if border { 0 } else { hits }));
        }
    }
    let total: u32 = colors.iter().map(|c| c.1).sum();
    let mean =
        [0, 1, 2].map(|i| colors.iter().filter(|c| c.1 > 0).map(|c| c.0[i]).sum::<f64>() / f64::from(total));
    RgbaImage::from_fn(SIZE, SIZE, |x, y| {
        let (sum, hits) = colors[(y * SIZE + x) as usize];
        // Holes have the leaves' mean colour, so that filtering across an edge brings in no other.
        let color = if hits == 0 { mean } else { sum.map(|c| c / f64::from(hits)) };
        encode(color, f64::from(hits) / f64::from(FINE * FINE))
    })
}

/// Value noise that repeats after `period` cells, 0 to 1.
fn noise(x: f64, y: f64, period: [u32; 2], seed: u32) -> f64 {
    let value = |i: i64, j: i64| {
        let (i, j) = (i.rem_euclid(period[0].into()) as u32, j.rem_euclid(period[1].into()) as u32);
        Random::new(seed, i * 4099 + j).unit()
    };
    let (i, j) = (x.floor(), y.floor());
    let fade = |t: f64| t * t * (3.0 - 2.0 * t);
    let (s, t) = (fade(x - i), fade(y - j));
    let (i, j) = (i as i64, j as i64);
    let row = |j| value(i, j) * (1.0 - s) + value(i + 1, j) * s;
    row(j) * (1.0 - t) + row(j + 1) * t
}

/// Sum of noise, repeating at the image's edges; `cells` across and down at the coarsest.
fn fractal(u: f64, v: f64, cells: [u32; 2], seed: u32) -> f64 {
    (0..4)
        .map(|o| {
            let period = cells.map(|c| c << o);
            noise(u * f64::from(period[0]), v * f64::from(period[1]), period, seed + o)
                * 0.5f64.powi(o as i32 + 1)
        })
        .sum()
}

/// Bark, repeating both ways: half as wide as high.
pub(super) fn bark(preset: Preset) -> RgbaImage {
    let (width, height) = (SIZE / 2, SIZE);
    RgbaImage::from_fn(width, height, |x, y| {
        let (u, v) = (f64::from(x) / f64::from(width), f64::from(y) / f64::from(height));
        let mix =
            |a: [f64; 3], b: [f64; 3], t: f64| [0, 1, 2].map(|i| a[i] + (b[i] - a[i]) * t.clamp(0.0, 1.0));
        let color = match preset {
            // Deep fissures along the trunk.
            Preset::Oak => {
                let fissure = (2.0 * fractal(u, v, [9, 4], 10) - 0.94).abs() * 3.0;
                mix(
                    [0.030, 0.024, 0.018],
                    [0.15, 0.12, 0.09],
                    fissure * (0.6 + 0.6 * fractal(u, v, [16, 16], 20)),
                )
            }
            // Reddish plates.
            Preset::Pine => {
                let plate = (2.0 * fractal(u, v, [6, 5], 30) - 0.94).abs() * 4.0;
                mix(
                    [0.035, 0.022, 0.015],
                    [0.20, 0.12, 0.075],
                    plate * (0.6 + 0.5 * fractal(u, v, [16, 16], 40)),
                )
            }
            // White with dark lenticels across and some black patches.
            Preset::Birch => {
                let lenticel = 7.0 * (fractal(u, v, [3, 40], 50) - 0.62);
                let patch = 6.0 * (fractal(u, v, [3, 3], 60) - 0.66);
                let white = mix([0.50, 0.47, 0.42], [0.66, 0.64, 0.60], fractal(u, v, [8, 8], 70));
                mix(white, [0.05, 0.045, 0.04], lenticel.max(patch))
            }
        };
        encode(color, 1.0)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn linear(c: u8) -> f64 {
        tonemap::linear(f64::from(c) / 255.0)
    }

    #[test]
    fn leaf_cards_have_holes_and_natural_reflectance() {
        for preset in Preset::ALL {
            let image = leaves(preset);
            let opaque: Vec<_> = image.pixels().filter(|p| p[3] > 127).collect();
            let share = opaque.len() as f64 / f64::from(SIZE * SIZE);
            assert!((0.2..0.75).contains(&share), "{preset:?}: {share} is opaque");
            let mean =
                [0, 1, 2].map(|i| opaque.iter().map(|p| linear(p[i])).sum::<f64>() / opaque.len() as f64);
            assert!(mean[1] > mean[0] && mean[0] > mean[2], "{preset:?}: {mean:?}");
            assert!((0.05..0.13).contains(&mean[1]), "{preset:?}: {mean:?}");
        }
    }

    #[test]
    fn bark_repeats_without_a_seam() {
        for preset in Preset::ALL {
            let image = bark(preset);
            let step = |a: (u32, u32), b: (u32, u32)| {
                f64::from(image.get_pixel(a.0, a.1)[1].abs_diff(image.get_pixel(b.0, b.1)[1]))
            };
            let (w, h) = image.dimensions();
            let seam: f64 = (0..h).map(|y| step((w - 1, y), (0, y))).sum::<f64>() / f64::from(h);
            let inside: f64 = (0..h).map(|y| step((w / 2 - 1, y), (w / 2, y))).sum::<f64>() / f64::from(h);
            assert!(seam < 2.0 * inside + 4.0, "{preset:?}: {seam} against {inside}");
        }
    }
}
