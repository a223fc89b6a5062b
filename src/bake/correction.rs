//! Corrections of a crown's laws ([`crate::physics::correction`]), by least squares.

use super::least_squares;
use crate::physics::correction::{Correction, TERMS};
use crate::physics::crown::Crown;
use crate::physics::light;

/// What a crown's laws send to a viewer of the sun's light, per irradiance, where it is lit: luminances.
pub struct Law {
    crown: Crown,
    leaves: [f64; 2],
    turning: f64,
    bark_ratio: f64,
}

impl Law {
    /// Of the reflectance and transmittance of [`super::SpeciesBake::crown_leaves`], the change of the first with the phase angle, 1/rad,
    /// and the reflectance of bark.
    pub fn new(crown: Crown, leaves: [f64; 2], turning: f64, bark: f64) -> Self {
        Law { crown, leaves, turning, bark_ratio: bark / (leaves[0] + leaves[1]).max(1e-3) }
    }

    /// Of leaves, at a phase angle, rad.
    pub fn phase(&self, angle: f64) -> f64 {
        let turned = light::turned_reflectance(self.turning, angle);
        light::leaf_phase(angle, self.leaves[0] * turned, self.leaves[1])
    }

    /// What is seen at a height of scaled space over leaves: bark under the crown.
    pub fn colour(&self, height: f32) -> f64 {
        1.0 + f64::from(self.crown.bark_share(height)) * (self.bark_ratio - 1.0)
    }
}

/// Sums of a correction's least squares, min Σ w (K law − truth)²/law: weighed as counts are, whose variance is their mean.
#[derive(Clone, Copy)]
pub struct Fit<const N: usize = { 2 * TERMS }> {
    h: [[f64; N]; N],
    y: [f64; N],
}

impl<const N: usize> Default for Fit<N> {
    fn default() -> Self {
        Fit { h: [[0.0; N]; N], y: [0.0; N] }
    }
}

impl Fit {
    /// Adds a sample at a height of scaled space, with a weight: what the law says, and what the mesh does.
    pub fn add(
        &mut self,
        terms: &[f64; TERMS],
        (strength, height, weight): (f64, f64, f64),
        (law, truth): (f64, f64),
    ) {
        let x = std::array::from_fn(|i| strength * terms[i % TERMS] * if i < TERMS { 1.0 } else { height });
        self.add_row(&x, weight, (law, truth));
    }

    /// The coefficients; none where there is nothing to fit to.
    pub fn solve(self) -> Correction {
        Correction::from_coefficients(self.coefficients())
    }
}

impl<const N: usize> Fit<N> {
    /// Adds a sample whose coefficients belong to these terms.
    pub fn add_row(&mut self, x: &[f64; N], weight: f64, (law, truth): (f64, f64)) {
        for (i, xi) in x.iter().enumerate() {
            // The derivative of (law (1 + x c) − truth)²/law.
            self.y[i] += weight * xi * (truth - law);
            for (j, xj) in x.iter().enumerate().take(i + 1) {
                self.h[i][j] += weight * law * xi * xj;
            }
        }
    }

    /// Adds what another has summed up.
    pub fn merge(&mut self, other: &Self) {
        self.y.iter_mut().zip(other.y).for_each(|(a, b)| *a += b);
        self.h.iter_mut().flatten().zip(other.h.iter().flatten()).for_each(|(a, b)| *a += b);
    }

    /// The coefficients; none where there is nothing to fit to.
    pub fn coefficients(mut self) -> [f32; N] {
        // Worth a hundred-thousandth of the samples: only what they cannot tell stays 0.
        let ridge = 1e-5 * self.h[0][0];
        (0..N).for_each(|i| self.h[i][i] += ridge);
        least_squares::solve(self.h, self.y, N).unwrap_or([0.0; N]).map(|x| x as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::correction::{at, terms};
    use crate::physics::hash::Stream;

    #[test]
    fn what_was_corrected_is_found_again() {
        let truth = Correction {
            middle: [0.1, -0.2, 0.3, 0.05, -0.1, 0.2, -0.05, 0.1],
            change: [0.05, 0.1, -0.1, 0.0, 0.1, -0.05, 0.02, 0.1],
        };
        let (mut stream, mut halves) = (Stream::new(3), [Fit::default(); 2]);
        for k in 0..4000 {
            let y = terms(stream.unit(), stream.unit(), 3.0 * stream.unit());
            let (z, law) = (2.0 * stream.unit() - 1.0, stream.unit());
            halves[k % 2].add(&y, (1.0, z, 1.0), (law, law * at(truth.line(&y, 1.0), z)));
        }
        let [mut fit, other] = halves;
        fit.merge(&other);
        let found = fit.solve();
        let pairs = found.middle.iter().zip(truth.middle).chain(found.change.iter().zip(truth.change));
        // The ridge holds back by about its own size over the least that any term explains.
        assert!(pairs.into_iter().all(|(a, b)| (a - b).abs() < 0.01), "{found:?}");
        assert_eq!(Fit::default().solve(), Correction::default());
    }
}
