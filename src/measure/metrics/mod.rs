//! How far an image is from a reference: error and bias of linear radiance by region, FLIP, structural similarity, energy of detail, popping,
//! and consistency over distance. Pure functions over [`Layers`].
//!
//! The reference may be noisy (a Monte-Carlo mean r + n with a known variance v of the mean, by pixel and channel). Its noise is
//! taken out of each metric:
//!
//! * Squared errors: E (a − r − n)² = (a − r)² + v, so v is subtracted. What is left may be negative by chance; a root of it keeps
//!   the sign, so that −0.01 reads "as far below the noise as 0.01 is above".
//! * FLIP and structural similarity have no closed form: noise of the same variance is added once more, and the metric
//!   extrapolated back to none (simulation-extrapolation, Cook and Stefanski 1994).
//!
//! Every value has a 95 % interval from a bootstrap of the image's blocks ([`Estimate`]): neighbouring pixels show the
//! same thing, so blocks and not pixels are the samples. It tells how much the value depends on what the image happens to show, noise
//! included. A value that does not exist (no pixel of the region, a black reference, a pixel that is no finite number) is `None`;
//! [`Difference::not_finite`] counts the last.

mod detail;
mod difference;
mod distance;
mod estimate;
mod motion;
mod picture;
mod radiance;
mod region;
mod ssim;

pub use detail::{Detail, detail};
pub use difference::{AVERAGED, Difference, difference};
pub use distance::{DistanceBin, Range, over_distance, spread};
pub use estimate::{Estimate, block_sums, estimate};
pub use motion::popping;
pub use picture::{Flip, display, flip, flip_error, key_exposure, structural};
pub use radiance::{RadianceError, radiance_error, relative_noise, squared_errors};
pub use region::{Region, regions};
pub use ssim::ssim_map;

use crate::image::Layers;

/// Square root that keeps the sign.
fn signed_root(x: f64) -> f64 {
    x.signum() * x.abs().sqrt()
}

/// Variance of a pixel's channels; none without a layer of it.
fn variance(layers: &Layers, pixel: usize) -> [f32; 3] {
    layers.variance.as_ref().map_or([0.0; 3], |v| v[pixel])
}

/// Images that several tests take.
#[cfg(test)]
mod fixtures {
    use super::*;
    use crate::measure::statistics::Random;

    /// Any image: trees left, ground in the middle, sky right.
    pub fn image(size: [u32; 2], radiance: impl FnMut(usize) -> [f32; 3]) -> Layers {
        let n = (size[0] * size[1]) as usize;
        let third = |k: usize| 3 * (k % size[0] as usize) / size[0] as usize;
        let part = |k: usize| match third(k) {
            0 => [0.0, 0.0, 0.75, 0.25],
            1 => [0.5, 0.5, 0.0, 0.0],
            _ => [0.0; 4],
        };
        Layers {
            size,
            radiance: (0..n).map(radiance).collect(),
            depth: (0..n).map(|k| if third(k) < 2 { 10.0 + k as f32 } else { 0.0 }).collect(),
            fractions: (0..n).map(part).collect(),
            variance: None,
        }
    }

    /// A normal deviate, from twelve uniform ones.
    pub fn normal(random: &mut Random) -> f64 {
        (0..12).map(|_| random.unit()).sum::<f64>() - 6.0
    }

    /// Texture without any order.
    pub fn texture(size: [u32; 2], seed: u32) -> Layers {
        let mut random = Random::new(seed);
        image(size, |_| [0; 3].map(|_| 0.2 + 0.6 * random.unit() as f32))
    }

    /// The same with noise of a standard deviation, which it knows.
    pub fn noisy(clean: &Layers, deviation: f64, seed: u32) -> Layers {
        let mut random = Random::new(seed);
        let radiance = clean
            .radiance
            .iter()
            .map(|c| {
                let n = (deviation * normal(&mut random)) as f32;
                c.map(|v| v + n)
            })
            .collect();
        let variance = Some(vec![[(deviation * deviation) as f32; 3]; clean.radiance.len()]);
        Layers { radiance, variance, ..clean.clone() }
    }

    /// The same with each radiance passed through a function.
    pub fn mapped(image: &Layers, of: impl Fn(f32) -> f32) -> Layers {
        Layers { radiance: image.radiance.iter().map(|c| c.map(&of)).collect(), ..image.clone() }
    }
}
