//! Least squares of light.

use glam::Vec3;

use crate::bake::least_squares;

/// Sums of a least-squares fit of N coefficients, linear RGB.
#[derive(Clone, Copy)]
pub(super) struct Fit<const N: usize> {
    h: [[[f64; N]; N]; 3],
    y: [[f64; N]; 3],
}

impl<const N: usize> Default for Fit<N> {
    fn default() -> Self {
        Fit { h: [[[0.0; N]; N]; 3], y: [[0.0; N]; 3] }
    }
}

impl<const N: usize> Fit<N> {
    /// Adds a sample: `light` is to be `share` of what the terms say.
    pub fn add(&mut self, terms: &[f64; N], share: Vec3, light: Vec3) {
        for c in 0..3 {
            let (share, light) = (f64::from(share[c]), f64::from(light[c]));
            for i in 0..N {
                for j in 0..=i {
                    self.h[c][i][j] += share * share * terms[i] * terms[j];
                }
                self.y[c][i] += share * terms[i] * light;
            }
        }
    }

    pub fn merge(&mut self, other: &Self) {
        self.h
            .iter_mut()
            .flatten()
            .flatten()
            .zip(other.h.iter().flatten().flatten())
            .for_each(|(a, b)| *a += b);
        self.y.iter_mut().flatten().zip(other.y.iter().flatten()).for_each(|(a, b)| *a += b);
    }

    /// The coefficients; none where nothing was seen.
    pub fn solve(self) -> [[f32; 3]; N] {
        let of = |c: usize| {
            let mut h = self.h[c];
            // Worth a hundred-thousandth of the samples: only what they cannot tell stays 0.
            let ridge = 1e-5 * h[0][0];
            (0..N).for_each(|i| h[i][i] += ridge);
            least_squares::solve(h, self.y[c], N).unwrap_or([0.0; N])
        };
        let rgb = [0, 1, 2].map(of);
        std::array::from_fn(|i| std::array::from_fn(|c| rgb[c][i] as f32))
    }
}
