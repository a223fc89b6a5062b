//! Root-mean-square error and bias of linear radiance.

use super::{Estimate, block_sums, estimate, signed_root, variance};
use crate::image::Layers;

/// Errors of radiance over the mean radiance of the reference, in the same pixels.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct RadianceError {
    /// Root of the mean squared error over pixels and channels, the reference's noise subtracted before the root; negative
    /// where less is left than nothing.
    pub rmse: Estimate,
    /// Mean error.
    pub bias: Estimate,
    /// Standard error of the bias that the reference's noise alone makes, at most (channels of a pixel may be noisy together).
    pub bias_standard_error: f64,
    /// Pixels.
    pub pixels: u64,
}

/// Errors over the pixels that `counts` lets through; `None` without any, where the reference is black there, or where
/// something is no finite number.
pub fn radiance_error(
    actual: &Layers,
    reference: &Layers,
    counts: impl Fn(usize) -> bool,
) -> Option<RadianceError> {
    let blocks = block_sums(reference.size, |k| {
        let of = |c: usize| {
            let (a, r, v) =
                (actual.radiance[k][c], reference.radiance[k][c], f64::from(variance(reference, k)[c]));
            let d = f64::from(a) - f64::from(r);
            [3.0f64.recip(), d, d * d - v, f64::from(r), v.sqrt()]
        };
        counts(k).then(|| {
            let [mut sum, b, c] = [of(0), of(1), of(2)];
            sum.iter_mut().zip(b).zip(c).for_each(|((s, b), c)| *s += b + c);
            // Channels noisy together: their deviations add, not their variances.
            sum[4] *= sum[4];
            sum
        })
    });
    let mean = |s: [f64; 5]| if s[3] > 0.0 { s[3] / (3.0 * s[0]) } else { f64::NAN };
    let total = |k: usize| blocks.iter().map(|b| b[k]).sum::<f64>();
    Some(RadianceError {
        rmse: estimate(&blocks, |s| signed_root(s[2] / (3.0 * s[0])) / mean(s))?,
        bias: estimate(&blocks, |s| if s[3] > 0.0 { s[1] / s[3] } else { f64::NAN })?,
        bias_standard_error: total(4).sqrt() / total(3),
        pixels: total(0).round() as u64,
    })
}

/// Squared errors of the pixels that count by block, over the square of the reference's mean radiance there, noise subtracted,
/// scaled so that their mean is the square of [`RadianceError::rmse`]. For comparing images block by block. `None` as there.
pub fn squared_errors(
    actual: &Layers,
    reference: &Layers,
    counts: impl Fn(usize) -> bool,
) -> Option<Vec<f64>> {
    let blocks = block_sums(reference.size, |k| {
        let of = |c: usize| {
            let r = f64::from(reference.radiance[k][c]);
            let d = f64::from(actual.radiance[k][c]) - r;
            [d * d - f64::from(variance(reference, k)[c]), r]
        };
        let [a, b, c] = [of(0), of(1), of(2)];
        counts(k).then(|| [a[0] + b[0] + c[0], a[1] + b[1] + c[1], 3.0])
    });
    let total = |k: usize| blocks.iter().map(|b| b[k]).sum::<f64>();
    let mean = total(1) / total(2);
    let scale = blocks.len() as f64 / (total(2) * mean * mean);
    let errors: Vec<f64> = blocks.iter().map(|b| b[0] * scale).collect();
    (mean > 0.0 && errors.iter().all(|e| e.is_finite())).then_some(errors)
}

/// Root of the reference's mean variance over its mean radiance; `None` without a variance, or with a black reference.
pub fn relative_noise(reference: &Layers) -> Option<f64> {
    let values = 3.0 * reference.radiance.len() as f64;
    let mean = |all: &[[f32; 3]]| all.iter().flatten().map(|v| f64::from(*v)).sum::<f64>() / values;
    let noise = mean(reference.variance.as_ref()?).sqrt() / mean(&reference.radiance);
    noise.is_finite().then_some(noise)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::fixtures::{image, mapped, noisy, texture};
    use super::*;

    fn close(a: f64, b: f64) -> bool {
        (a - b).abs() < 1e-6 * b.abs().max(1.0)
    }

    fn holds(e: Estimate, value: f64) -> bool {
        e.interval.is_some_and(|[low, high]| low <= value && value <= high)
    }

    #[test]
    fn closed_forms() {
        let flat = image([64, 64], |_| [0.5; 3]);
        // An offset of 0.1 on 0.5: both 20 %, and every block says so.
        let e = radiance_error(&mapped(&flat, |v| v + 0.1), &flat, |_| true).unwrap();
        assert!(close(e.rmse.value, 0.2) && close(e.bias.value, 0.2) && e.pixels == 4096, "{e:?}");
        assert!(e.rmse.interval.unwrap().iter().all(|v| close(*v, 0.2)) && e.bias_standard_error == 0.0);
        // A scale is the same bias for any image.
        let any = texture([50, 70], 3);
        let e = radiance_error(&mapped(&any, |v| 0.9 * v), &any, |_| true).unwrap();
        assert!(close(e.bias.value, -0.1) && e.rmse.value > 0.1, "{e:?}");
        // Half of the pixels brighter, half darker: no bias.
        let half = |k: usize| if k.is_multiple_of(2) { 0.6 } else { 0.4 };
        let e = radiance_error(&image([64, 64], |k| [half(k); 3]), &flat, |_| true).unwrap();
        assert!(close(e.rmse.value, 0.2) && close(1.0 + e.bias.value, 1.0), "{e:?}");
        // Only what counts.
        let e = radiance_error(&image([64, 64], |k| [half(k); 3]), &flat, |k| k.is_multiple_of(2)).unwrap();
        assert!(close(e.bias.value, 0.2) && e.pixels == 2048, "{e:?}");
    }

    #[test]
    fn noise_of_the_reference_is_no_error_and_hides_none() {
        let clean = texture([96, 96], 1);
        let reference = noisy(&clean, 0.15, 2);
        let e = radiance_error(&clean, &reference, |_| true).unwrap();
        assert!(holds(e.rmse, 0.0) && holds(e.bias, 0.0) && e.rmse.value.abs() < 0.03, "{e:?}");
        assert!(e.bias.value.abs() < 3.0 * e.bias_standard_error, "{e:?}");
        // 0.15 in all three channels, over 96² pixels, on a mean of 0.5.
        assert!((e.bias_standard_error / (0.15 / 96.0 / 0.5) - 1.0).abs() < 0.02, "{e:?}");
        assert!((relative_noise(&reference).unwrap() - 0.3).abs() < 0.01);
        let e = radiance_error(&mapped(&clean, |v| v + 0.1), &reference, |_| true).unwrap();
        assert!((e.rmse.value - 0.2).abs() < 0.02 && holds(e.rmse, 0.2), "{e:?}");
        // Without knowing of the noise it would be taken for error.
        let unaware = Layers { variance: None, ..reference };
        assert!(radiance_error(&clean, &unaware, |_| true).unwrap().rmse.value > 0.25);
    }

    #[test]
    fn what_does_not_exist_is_none() {
        let (one, black) = (texture([1, 1], 1), image([20, 20], |_| [0.0; 3]));
        let e = radiance_error(&mapped(&one, |v| 1.5 * v), &one, |_| true).unwrap();
        assert!(close(e.bias.value, 0.5) && e.rmse.interval.is_none(), "{e:?}");
        assert_eq!(radiance_error(&texture([20, 20], 1), &black, |_| true), None);
        assert_eq!(squared_errors(&texture([20, 20], 1), &black, |_| true), None);
        assert_eq!(radiance_error(&black, &texture([20, 20], 1), |_| false), None);
        let any = texture([20, 20], 2);
        for value in [f32::NAN, f32::INFINITY] {
            let mut broken = any.clone();
            broken.radiance[7][1] = value;
            assert_eq!(radiance_error(&broken, &any, |_| true), None);
            assert_eq!(squared_errors(&broken, &any, |_| true), None);
            assert!(radiance_error(&broken, &any, |k| k != 7).is_some());
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..Default::default() })]

        #[test]
        fn errors_do_not_depend_on_the_unit_of_light(seed in 0u32..1000, exponent in -12i32..12) {
            let (a, r) = (texture([24, 18], seed), noisy(&texture([24, 18], seed + 1), 0.05, seed));
            let unit = 2f32.powi(exponent);
            let (a2, mut r2) = (mapped(&a, |v| unit * v), mapped(&r, |v| unit * v));
            r2.variance = r.variance.clone().map(|v| v.iter().map(|c| c.map(|v| unit * unit * v)).collect());
            let (e, e2) = (radiance_error(&a, &r, |_| true).unwrap(), radiance_error(&a2, &r2, |_| true).unwrap());
            prop_assert!(close(e.rmse.value, e2.rmse.value) && close(e.bias.value, e2.bias.value));
            prop_assert!(close(e.bias_standard_error, e2.bias_standard_error));
            // Bias is part of the error.
            prop_assert!(e.rmse.value.powi(2) + 2.0 * e.bias_standard_error.powi(2) + 1e-3 >= e.bias.value.powi(2));
            // 24 × 18 pixels: blocks of two sizes.
            let clean = Layers { variance: None, ..r };
            let blocks = squared_errors(&a, &clean, |k| k % 3 > 0).unwrap();
            let rmse = radiance_error(&a, &clean, |k| k % 3 > 0).unwrap().rmse.value;
            prop_assert!(close(blocks.iter().sum::<f64>() / blocks.len() as f64, rmse * rmse));
        }
    }
}
