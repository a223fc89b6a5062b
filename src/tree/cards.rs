//! Made textures: cards that show a spray of leaves or needles.
//!
//! Reflectances are linear: leaves about (0.05, 0.10, 0.03), as broad-leaved crowns have in the visible.

use image::{Rgba, RgbaImage};

use super::parameters::{Blade, Color, Leaves};
use super::random::Random;
use crate::physics::tonemap;

/// Texels a side of a card.
pub(super) const SIZE: u32 = 256;
/// Sub-samples a side of a texel, for soft edges.
const FINE: u32 = 3;

fn srgb(linear: f64) -> u8 {
    (255.0 * tonemap::srgb(linear.clamp(0.0, 1.0))).round() as u8
}

/// A texel of linear reflectance.
pub(super) fn encode(color: Color, alpha: f64) -> Rgba<u8> {
    Rgba([srgb(color[0]), srgb(color[1]), srgb(color[2]), (255.0 * alpha).round() as u8])
}

/// A straight stroke with a width at each place along it: a leaf, a needle or a twig; in image sizes, y down.
struct Stroke {
    from: [f64; 2],
    along: [f64; 2],
    length: f64,
    color: Color,
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
        color: Color,
        half: fn(f64, f64) -> f64,
    ) -> Self {
        // Angles are from the image's up direction, clockwise.
        let along = [angle.to_radians().sin(), -angle.to_radians().cos()];
        Stroke { from, along, length, color, half, width }
    }

    /// The colour at a place, if the stroke covers it.
    fn at(&self, x: f64, y: f64) -> Option<Color> {
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

/// Two round shoulders and a short tip.
fn heart(s: f64, width: f64) -> f64 {
    width * (std::f64::consts::PI * s.powf(0.5)).sin().max(0.0).powf(0.75)
}

/// Narrow, tapered to both ends.
fn lance(s: f64, width: f64) -> f64 {
    width * (std::f64::consts::PI * s.powf(0.8)).sin().max(0.0).powf(0.8)
}

const TWIG: Color = [0.07, 0.05, 0.035];

/// The outline of a blade: half its width at 0 (base) to 1 (tip).
fn outline(blade: Blade) -> fn(f64, f64) -> f64 {
    match blade {
        Blade::Lobed => oak_leaf,
        Blade::Ovate => birch_leaf,
        Blade::Heart => heart,
        Blade::Lance => lance,
        Blade::Needles => needle,
    }
}

/// Leaves to both sides of a shoot and one at its end.
fn broad(leaves: &Leaves) -> Vec<Stroke> {
    let mut random = Random::new(leaves.drawing, 1);
    let (half, [length, width]) = (outline(leaves.blade), leaves.blade_size);
    let mut strokes = vec![Stroke::new([0.5, 1.0], 0.0, 0.72, 0.006, TWIG, even)];
    let last = 2 * leaves.pairs;
    for i in 0..=last {
        let share = f64::from(i) / f64::from(last);
        let side = if i % 2 == 0 { 1.0 } else { -1.0 };
        let angle = if i == last { 0.0 } else { side * (72.0 - 34.0 * share) } + random.around(14.0);
        let size = 1.0 - 0.22 * share + random.around(0.12);
        let tint = 1.0 + random.around(0.28);
        let [red, green, blue] = leaves.color;
        let color = [red * tint * (1.0 + random.around(0.15)), green * tint, blue * tint];
        let from = [0.5, 0.93 - 0.62 * share];
        // Side twigs first, so that leaves lie over them.
        strokes.push(Stroke::new(from, angle, 0.09, 0.003, TWIG, even));
        let start = [from[0] + 0.05 * angle.to_radians().sin(), from[1] - 0.05 * angle.to_radians().cos()];
        match leaves.leaflets {
            0 => strokes.push(Stroke::new(start, angle, length * size, width * size, color, half)),
            pairs => {
                let axis = Stroke::new(start, angle, length * size, 0.0025, color, even);
                compound(&mut strokes, axis, angle, pairs, width * size, half);
            }
        }
    }
    strokes
}

/// A compound leaf along an axis: pairs of leaflets, and one at the end.
fn compound(
    strokes: &mut Vec<Stroke>,
    axis: Stroke,
    angle: f64,
    pairs: u32,
    width: f64,
    half: fn(f64, f64) -> f64,
) {
    let (from, along, length, color) = (axis.from, axis.along, axis.length, axis.color);
    // Leaflets that just leave gaps between one another.
    let leaflet = 2.4 * length / f64::from(pairs + 2);
    strokes.push(axis);
    for k in 0..=2 * pairs {
        let place = length * (0.15 + 0.7 * f64::from(k / 2) / f64::from(pairs));
        let turn = match k {
            k if k == 2 * pairs => 0.0,
            k if k % 2 == 0 => 58.0,
            _ => -58.0,
        };
        let start = [from[0] + along[0] * place, from[1] + along[1] * place];
        strokes.push(Stroke::new(start, angle + turn, leaflet, width, color, half));
    }
}

/// The main shoot and side shoots, each bristling with needles.
fn needles(leaves: &Leaves) -> Vec<Stroke> {
    let mut random = Random::new(leaves.drawing, 1);
    let [long, width] = leaves.blade_size;
    let mut strokes = vec![Stroke::new([0.5, 1.0], 0.0, 0.8, 0.008, TWIG, even)];
    let mut shoots = vec![([0.5, 1.0], 0.0, 0.82)];
    let step = 0.3 / f64::from(leaves.pairs);
    for i in 0..2 * leaves.pairs {
        let side = if i % 2 == 0 { 1.0 } else { -1.0 };
        let base = 0.88 - step * f64::from(i);
        shoots.push(([0.5, base], side * 46.0 + random.around(6.0), 0.42 - 0.35 * step * f64::from(i)));
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
            let color = leaves.color.map(|c| c * tint);
            let turn = angle + side * (40.0 + random.around(16.0));
            strokes.push(Stroke::new(
                base,
                turn,
                long * (1.0 + random.around(1.0 / 6.0)),
                width,
                color,
                needle,
            ));
        }
    }
    strokes
}

/// A card of leaves: base of the spray at the middle of the lower edge, opacity cut out.
pub(super) fn draw(leaves: &Leaves) -> RgbaImage {
    let strokes = match leaves.blade {
        Blade::Needles => needles(leaves),
        _ => broad(leaves),
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tree::Preset;
    use crate::tree::parameters::Parameters;

    #[test]
    fn leaf_cards_have_holes_and_natural_reflectance() {
        let linear = |c: u8| tonemap::linear(f64::from(c) / 255.0);
        for preset in Preset::ALL {
            let parameters: Parameters = toml::from_str(preset.text()).unwrap();
            let Some(leaves) = parameters.leaves else { continue };
            let image = draw(&leaves);
            let opaque: Vec<_> = image.pixels().filter(|p| p[3] > 127).collect();
            let share = opaque.len() as f64 / f64::from(SIZE * SIZE);
            assert!((0.12..0.75).contains(&share), "{preset:?}: {share} is opaque");
            let mean =
                [0, 1, 2].map(|i| opaque.iter().map(|p| linear(p[i])).sum::<f64>() / opaque.len() as f64);
            assert!(mean[1] > mean[0] && mean[0] > mean[2], "{preset:?}: {mean:?}");
            assert!((0.05..0.13).contains(&mean[1]), "{preset:?}: {mean:?}");
        }
    }
}
