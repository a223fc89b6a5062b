//! What many paths say about an image, and how sure that is.

use bytemuck::{Pod, Zeroable};

use super::key::Key;
use crate::image::{Linear, Noise, Picture};
use crate::physics::tonemap::{srgb, tone_curve};
use crate::{Error, Result};

/// Sums over the samples of a pixel. In doubles and in the order of samples, so that a resumed run has the bits of one that
/// went through.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Sums {
    pub sun: [f64; 3],
    pub sky: [f64; 3],
    pub sun_squares: [f64; 3],
    pub sky_squares: [f64; 3],
    /// Of the radiance: sun and sky are not independent.
    pub squares: [f64; 3],
    /// Over the samples that show a surface, m.
    pub depth: f64,
    /// Samples of lit and shadowed ground, lit and shadowed trees.
    pub counts: [u32; 4],
    /// Species at the first sample, from 1; 0 where that is no tree.
    pub species: u32,
    pub unused: u32,
}

/// An image so far, with its variance.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    /// Pixels.
    pub size: [u32; 2],
    /// Samples of every pixel.
    pub samples: u32,
    pub(super) key: Key,
    pub(super) sums: Vec<Sums>,
}

/// Variances of the mean of a pixel's samples, RGB, in units of squared radiance.
#[derive(Clone, Debug, PartialEq)]
pub struct Variance {
    /// Of the radiance.
    pub radiance: Vec<[f64; 3]>,
    /// Of its part from the sun.
    pub sun: Vec<[f64; 3]>,
    /// Of its part from the sky.
    pub sky: Vec<[f64; 3]>,
}

/// Mean over all pixels of an image.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Mean {
    /// Fractions k of lit and shadowed ground, lit and shadowed trees.
    pub fractions: [f64; 4],
    /// Radiance from the sun, RGB.
    pub sun: [f64; 3],
    /// Radiance from the sky, RGB.
    pub sky: [f64; 3],
    /// Standard error of the radiance, RGB: of the paths, not of the choice of the ground.
    pub stderr: [f64; 3],
}

impl Estimate {
    pub(super) fn new(size: [u32; 2], key: Key) -> Self {
        let pixels = size[0] as usize * size[1] as usize;
        Estimate { size, samples: 0, key, sums: vec![Sums::default(); pixels] }
    }

    /// Refuses a key that is not the estimate's own.
    pub(super) fn check_same(&self, key: &Key) -> Result<()> {
        let different = self.key.differences(key);
        if different.is_empty() {
            return Ok(());
        }
        Err(Error::Usage(format!(
            "this estimate cannot be resumed: it is of something else. What differs: {}",
            different.join(", ")
        )))
    }

    /// Linear image: means, with the variance of their sum.
    pub fn linear(&self) -> Linear {
        let n = f64::from(self.samples.max(1));
        let mean = |of: fn(&Sums) -> [f64; 3]| -> Vec<[f32; 3]> {
            self.sums.iter().map(|s| of(s).map(|v| (v / n) as f32)).collect()
        };
        let variance = self.variance().radiance;
        let hits = |s: &Sums| s.counts.iter().sum::<u32>();
        Linear {
            sun: mean(|s| s.sun),
            sky: mean(|s| s.sky),
            depth: self.sums.iter().map(|s| (s.depth / f64::from(hits(s).max(1))) as f32).collect(),
            coverage: self.sums.iter().map(|s| (f64::from(s.counts[2] + s.counts[3]) / n) as f32).collect(),
            species: self.sums.iter().map(|s| s.species).collect(),
            fractions: self.sums.iter().map(|s| s.counts.map(|c| (f64::from(c) / n) as f32)).collect(),
            noise: Some(Noise {
                variance: variance.iter().map(|v| v.map(|v| v as f32)).collect(),
                samples: vec![self.samples; self.sums.len()],
            }),
        }
    }

    /// Variance of the mean of every pixel: the samples' variance s² = Σ(x − x̄)²/(n − 1), over n. Infinite for fewer than
    /// two samples.
    pub fn variance(&self) -> Variance {
        let n = f64::from(self.samples);
        let one = |sum: f64, squares: f64| {
            if n < 2.0 { f64::INFINITY } else { ((squares - sum * sum / n) / (n * (n - 1.0))).max(0.0) }
        };
        let part = |of: &dyn Fn(&Sums, usize) -> (f64, f64)| -> Vec<[f64; 3]> {
            self.sums
                .iter()
                .map(|s| {
                    std::array::from_fn(|k| {
                        let (sum, squares) = of(s, k);
                        one(sum, squares)
                    })
                })
                .collect()
        };
        Variance {
            radiance: part(&|s, k| (s.sun[k] + s.sky[k], s.squares[k])),
            sun: part(&|s, k| (s.sun[k], s.sun_squares[k])),
            sky: part(&|s, k| (s.sky[k], s.sky_squares[k])),
        }
    }

    /// Relative error of the image: the root mean square, over pixels and channels, of the standard error of a pixel's
    /// radiance, over the root mean square radiance. 0 for a black image that is known to be black.
    pub fn relative_error(&self) -> f64 {
        let n = f64::from(self.samples.max(1));
        let square: f64 =
            self.sums.iter().flat_map(|s| [0, 1, 2].map(|k| ((s.sun[k] + s.sky[k]) / n).powi(2))).sum();
        let variance: f64 = self.variance().radiance.iter().flatten().sum();
        if variance > 0.0 { (variance / square).sqrt() } else { 0.0 }
    }

    /// Relative error of the mean of the image: of the channel with the largest, the standard error of the mean over the mean.
    /// Pixels are independent, so that its square is the sum of theirs over the squared number of pixels.
    pub fn relative_error_of_mean(&self) -> f64 {
        let mean = self.mean();
        (0..3).fold(0.0, |worst: f64, k| match mean.stderr[k] {
            0.0 => worst,
            stderr => worst.max(stderr / (mean.sun[k] + mean.sky[k])),
        })
    }

    /// Mean over all pixels.
    pub fn mean(&self) -> Mean {
        let pixels = self.sums.len() as f64;
        let all = pixels * f64::from(self.samples.max(1));
        let mean = |of: &dyn Fn(&Sums) -> f64| self.sums.iter().map(of).sum::<f64>() / all;
        let variance = self.variance().radiance;
        Mean {
            fractions: std::array::from_fn(|k| mean(&|s| f64::from(s.counts[k]))),
            sun: std::array::from_fn(|k| mean(&|s| s.sun[k])),
            sky: std::array::from_fn(|k| mean(&|s| s.sky[k])),
            stderr: std::array::from_fn(|k| variance.iter().map(|v| v[k]).sum::<f64>().sqrt() / pixels),
        }
    }

    /// The picture as the renderer would show it at this exposure, with its linear image.
    pub fn picture(&self, exposure: f64) -> Picture {
        let linear = self.linear();
        let display = linear
            .sun
            .iter()
            .zip(&linear.sky)
            .flat_map(|(sun, sky)| {
                let light = std::array::from_fn(|k| f64::from(sun[k] + sky[k]) * exposure);
                let [r, g, b] = tone_curve(light).map(|c| (255.0 * srgb(c)).round() as u8);
                [r, g, b, 255]
            })
            .collect();
        Picture { size: self.size, display, linear: Some(linear) }
    }
}
