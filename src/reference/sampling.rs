//! Random numbers and directions of a path.

use std::f64::consts::TAU;

use glam::DVec3;

/// A stream of random numbers: a counter through the finaliser of SplitMix64 (Steele, Lea and Flood 2014). Any key gives a
/// stream, and none depends on what other threads do.
#[derive(Clone, Debug)]
pub struct Random {
    state: u64,
}

fn mix(v: u64) -> u64 {
    let v = (v ^ (v >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let v = (v ^ (v >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    v ^ (v >> 31)
}

impl Random {
    /// The stream of a sample of a pixel.
    pub fn new(seed: u32, pixel: u32, sample: u32) -> Self {
        let one = mix(u64::from(seed) ^ 0x6a09_e667_f3bc_c909);
        Random { state: mix(one ^ (u64::from(pixel) << 32 | u64::from(sample))) }
    }

    /// The stream whose first number is the greatest that there is, 1 − 2⁻⁵³.
    #[cfg(test)]
    pub fn greatest() -> Self {
        Random { state: 0x3162_8af6_7b21_31ab }
    }

    /// Uniform in [0, 1), multiples of 2⁻⁵³.
    pub fn unit(&mut self) -> f64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        (mix(self.state) >> 11) as f64 * (1.0 / 9_007_199_254_740_992.0)
    }

    /// A direction of the hemisphere around a unit normal, with the density cos θ / π.
    pub fn cosine_direction(&mut self, normal: DVec3) -> DVec3 {
        let (u, v) = (self.unit(), self.unit());
        let (sin, cos) = (TAU * v).sin_cos();
        let radius = u.sqrt();
        let (a, b) = normal.any_orthonormal_pair();
        (a * (radius * cos) + b * (radius * sin) + normal * (1.0 - u).sqrt()).normalize()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_have_the_density_of_a_cosine() {
        let n = DVec3::new(0.3, -0.8, 0.5).normalize();
        let mut random = Random::new(1, 2, 3);
        let count = 100_000;
        let (mut mean, mut cosines, mut squares) = (DVec3::ZERO, 0.0, 0.0);
        for _ in 0..count {
            let d = random.cosine_direction(n);
            let c = d.dot(n);
            assert!(c >= 0.0 && (d.length() - 1.0).abs() < 1e-12);
            mean += d / f64::from(count);
            cosines += c / f64::from(count);
            squares += c * c / f64::from(count);
        }
        // ∫ cos² dω/π = 2/3 and ∫ cos³ dω/π = 1/2, with variances 1/18 and 1/12; across, each component has 1/4 of variance.
        // Five standard errors.
        assert!((mean - n * (2.0 / 3.0)).length() < 5.0 * (0.8f64 / 1e5).sqrt(), "{mean}");
        assert!((cosines - 2.0 / 3.0).abs() < 5.0 * (1.0f64 / 18e5).sqrt(), "{cosines}");
        assert!((squares - 0.5).abs() < 5.0 * (1.0f64 / 12e5).sqrt(), "{squares}");
    }

    #[test]
    fn samples_and_pixels_have_numbers_of_their_own() {
        // Products of first numbers around 1/4, of variance 7/144.
        let mut sum = [0.0; 3];
        for k in 0..10_000 {
            let first = |seed, pixel, sample| Random::new(seed, pixel, sample).unit();
            let here = first(5, k, 0);
            for (s, other) in sum.iter_mut().zip([first(5, k, 1), first(5, k + 1, 0), first(6, k, 0)]) {
                *s += here * other / 10_000.0;
            }
        }
        assert!(sum.iter().all(|s| (s - 0.25).abs() < 5.0 * (7.0f64 / 144e4).sqrt()), "{sum:?}");
    }
}
