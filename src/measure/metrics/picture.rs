//! What an eye sees of the difference: FLIP (Andersson et al. 2020) and structural similarity, of images as they are displayed.

use super::{Estimate, block_sums, estimate, ssim_map, variance};
use crate::image::Layers;
use crate::measure::statistics::Random;
use crate::physics::light::luminance;
use crate::physics::tonemap::{srgb, tone_curve};

/// FLIP raises colour differences to the power 0.7 (its q_c), so of noise alone this power of it grows with the variance.
const FLIP_POWER: f64 = 2.0 / 0.7;
/// Grey that the mean of a picture is exposed to.
const KEY: f64 = 0.18;

/// A map of FLIP.
#[derive(Clone, Debug, PartialEq)]
pub struct Flip {
    /// 0 (the same) to 1, a pixel each.
    pub values: Vec<f32>,
    /// The same in the colours of magma, RGB.
    pub colours: Vec<u8>,
}

impl Flip {
    /// Mean of the map.
    pub fn mean(&self) -> f64 {
        self.values.iter().map(|v| f64::from(*v)).sum::<f64>() / self.values.len() as f64
    }
}

/// FLIP of two 8-bit sRGB images, at its usual 67 pixels a degree.
pub fn flip([width, height]: [u32; 2], reference: &[u8], actual: &[u8]) -> Flip {
    let image = |rgb: &[u8]| nv_flip::FlipImageRgb8::with_data(width, height, rgb);
    let map = nv_flip::flip(image(reference), image(actual), nv_flip::DEFAULT_PIXELS_PER_DEGREE);
    Flip { values: map.to_vec(), colours: map.apply_color_lut(&nv_flip::magma_lut()).to_vec() }
}

/// The display picture of linear radiance at an exposure, 8-bit sRGB, by the renderer's own tone curve.
pub fn display(radiance: &[[f32; 3]], exposure: f64) -> Vec<u8> {
    let bytes = |c: &[f32; 3]| encoded(*c, exposure).map(|v| (255.0 * v).round() as u8);
    radiance.iter().flat_map(bytes).collect()
}

/// The exposure at which the mean luminance is a grey of 18 %, for images whose scene is not known; 1 for black ones.
pub fn key_exposure(radiance: &[[f32; 3]]) -> f64 {
    let mean = radiance.iter().map(|c| luminance(*c)).sum::<f64>() / radiance.len() as f64;
    if mean.is_finite() && mean > 0.0 { KEY / mean } else { 1.0 }
}

fn encoded(c: [f32; 3], exposure: f64) -> [f64; 3] {
    tone_curve(c.map(|v| f64::from(v) * exposure)).map(|v| srgb(v.clamp(0.0, 1.0)))
}

/// Mean FLIP of an image against a reference without the reference's noise. What is extrapolated is the power of
/// FLIP that, of noise alone, grows in proportion to the variance. `None` where something is no finite number.
pub fn flip_error(actual: &Layers, reference: &Layers, exposure: f64) -> Option<Estimate> {
    let shown = display(&actual.radiance, exposure);
    let map = |r: &[[f32; 3]]| flip(reference.size, &display(r, exposure), &shown).values;
    let [once, twice] = at_noise(reference, |r| map(r).into_iter().map(f64::from).collect())?;
    let blocks = block_sums(reference.size, |k| Some([1.0, once[k], twice[k]]));
    finite(actual)?;
    estimate(&blocks, |[n, f1, f2]| {
        let left = 2.0 * (f1 / n).powf(FLIP_POWER) - (f2 / n).powf(FLIP_POWER);
        left.signum() * left.abs().powf(1.0 / FLIP_POWER)
    })
}

/// Mean structural similarity of the displayed luminance, 1 for the same, without the reference's noise. `None` where something
/// is no finite number.
pub fn structural(actual: &Layers, reference: &Layers, exposure: f64) -> Option<Estimate> {
    let shown = |radiance: &[[f32; 3]]| -> Vec<f64> {
        radiance.iter().map(|c| luminance(encoded(*c, exposure).map(|v| v as f32))).collect()
    };
    let a = shown(&actual.radiance);
    let [once, twice] = at_noise(reference, |r| ssim_map(reference.size, &a, &shown(r)))?;
    let blocks = block_sums(reference.size, |k| Some([1.0, once[k], twice[k]]));
    finite(actual)?;
    estimate(&blocks, |[n, s1, s2]| (2.0 * s1 - s2) / n)
}

/// A map against the reference as it is, and with its noise added once more.
fn at_noise(reference: &Layers, map: impl Fn(&[[f32; 3]]) -> Vec<f64>) -> Option<[Vec<f64>; 2]> {
    finite(reference)?;
    let once = map(&reference.radiance);
    let twice = if reference.variance.is_some() { map(&noisier(reference)) } else { once.clone() };
    Some([once, twice])
}

/// The reference with normal noise of its own variance added, the same every time. Noise of light paths is mostly of
/// brightness: a pixel's channels get the same deviate.
fn noisier(reference: &Layers) -> Vec<[f32; 3]> {
    let mut random = Random::new(reference.radiance.len() as u32);
    let add = |(k, c): (usize, &[f32; 3])| {
        let radius = (-2.0 * random.unit().ln()).sqrt();
        let n = radius * (std::f64::consts::TAU * random.unit()).cos();
        let v = variance(reference, k);
        [0, 1, 2].map(|i| (f64::from(c[i]) + n * f64::from(v[i]).sqrt()) as f32)
    };
    reference.radiance.iter().enumerate().map(add).collect()
}

fn finite(layers: &Layers) -> Option<()> {
    layers.radiance.iter().flatten().all(|v| v.is_finite()).then_some(())
}

#[cfg(test)]
mod tests {
    use super::super::fixtures::{image, mapped, noisy, texture};
    use super::*;

    #[test]
    fn the_same_picture_is_the_same() {
        for size in [[1, 1], [3, 2], [64, 48]] {
            let a = texture(size, 1);
            assert_eq!(flip_error(&a, &a, 1.0).unwrap().value, 0.0);
            assert!((structural(&a, &a, 1.0).unwrap().value - 1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn more_difference_is_more() {
        let a = texture([64, 48], 1);
        let by = |s: f32| mapped(&a, |v| s * v);
        let [small, large] = [1.1, 2.0].map(|s| flip_error(&by(s), &a, 1.0).unwrap().value);
        assert!(0.0 < small && small < large && large < 1.0, "{small} {large}");
        let negated = structural(&mapped(&a, |v| 1.0 - v), &a, 1.0).unwrap().value;
        assert!(negated < 0.0, "{negated}");
    }

    #[test]
    fn noise_of_the_reference_is_taken_out() {
        // As smooth as a picture, so that noise is what differs.
        let clean = image([96, 96], |k| [0.2 + 0.001 * (k % 96) as f32; 3]);
        let reference = noisy(&clean, 0.02, 4);
        let unaware = Layers { variance: None, ..reference.clone() };
        let seen = flip_error(&clean, &unaware, 1.0).unwrap();
        let left = flip_error(&clean, &reference, 1.0).unwrap();
        assert!(left.value.abs() < 0.35 * seen.value, "{left:?} of {seen:?}");
        let seen = 1.0 - structural(&clean, &unaware, 1.0).unwrap().value;
        let left = 1.0 - structural(&clean, &reference, 1.0).unwrap().value;
        assert!(left.abs() < 0.35 * seen, "{left} of {seen}");
    }

    #[test]
    fn what_is_no_number_is_none() {
        let a = texture([20, 20], 1);
        let mut broken = a.clone();
        broken.radiance[3][0] = f32::NAN;
        for (x, y) in [(&broken, &a), (&a, &broken)] {
            assert_eq!(flip_error(x, y, 1.0), None);
            assert_eq!(structural(x, y, 1.0), None);
        }
        assert_eq!(key_exposure(&image([2, 2], |_| [0.0; 3]).radiance), 1.0);
        assert!((key_exposure(&image([2, 2], |_| [0.09; 3]).radiance) - 2.0).abs() < 1e-6);
    }
}
