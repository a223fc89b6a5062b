//! Made textures: bark.

use image::RgbaImage;

use super::cards::{SIZE, encode};
use super::parameters::{Bark, Relief};
use super::random::Random;

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

fn mix(a: [f64; 3], b: [f64; 3], t: f64) -> [f64; 3] {
    [0, 1, 2].map(|i| a[i] + (b[i] - a[i]) * t.clamp(0.0, 1.0))
}

/// How far up the relief is, 0 to 1 and beyond.
fn height(relief: Relief, u: f64, v: f64) -> f64 {
    match relief {
        Relief::Fissured => {
            let fissure = (2.0 * fractal(u, v, [9, 4], 10) - 0.94).abs() * 3.0;
            fissure * (0.6 + 0.6 * fractal(u, v, [16, 16], 20))
        }
        Relief::Plated => {
            let plate = (2.0 * fractal(u, v, [6, 5], 30) - 0.94).abs() * 4.0;
            plate * (0.6 + 0.5 * fractal(u, v, [16, 16], 40))
        }
        Relief::Smooth => fractal(u, v, [8, 8], 70),
    }
}

/// Bark, repeating both ways: half as wide as high.
pub(super) fn draw(bark: &Bark) -> RgbaImage {
    let (width, size) = (SIZE / 2, SIZE);
    RgbaImage::from_fn(width, size, |x, y| {
        let (u, v) = (f64::from(x) / f64::from(width), f64::from(y) / f64::from(size));
        let plain = mix(bark.dark, bark.light, height(bark.relief, u, v));
        let color = bark.spots.map_or(plain, |spots| {
            let lenticel = 7.0 * (fractal(u, v, [3, 40], 50) - 0.62);
            let patch = 6.0 * (fractal(u, v, [3, 3], 60) - 0.66);
            mix(plain, spots, lenticel.max(patch))
        });
        encode(color, 1.0)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tree::Preset;
    use crate::tree::parameters::Parameters;

    #[test]
    fn bark_repeats_without_a_seam() {
        for preset in Preset::ALL {
            let parameters: Parameters = toml::from_str(preset.text()).unwrap();
            let image = draw(&parameters.bark);
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
