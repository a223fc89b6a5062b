//! Popping: what changes under a small move of the camera beyond what should.

use super::{Estimate, block_sums, estimate, variance};
use crate::image::Layers;

/// Root-mean-square change of radiance between two camera positions, less that of the reference between the same two, over the
/// reference's mean radiance. Positive where the image pops or flickers, negative where it changes too little; the
/// reference's noise, which changes too, is taken out. `None` for a black reference, or where something is no finite number.
pub fn popping(actual: [&Layers; 2], reference: [&Layers; 2]) -> Option<Estimate> {
    let change = |of: [&Layers; 2], k: usize, c: usize| {
        f64::from(of[1].radiance[k][c]) - f64::from(of[0].radiance[k][c])
    };
    let blocks = block_sums(reference[0].size, |k| {
        let mut sums = [3.0, 0.0, 0.0, 0.0];
        for c in 0..3 {
            let noise = reference.map(|r| f64::from(variance(r, k)[c]));
            sums[1] += change(actual, k, c).powi(2);
            sums[2] += change(reference, k, c).powi(2) - noise[0] - noise[1];
            sums[3] += f64::from(reference[0].radiance[k][c]);
        }
        Some(sums)
    });
    estimate(&blocks, |[n, a, r, mean]| {
        // Not max(), which would turn what is no number into 0.
        let root = |x: f64| if x < 0.0 { 0.0 } else { (x / n).sqrt() };
        if mean > 0.0 { (root(a) - root(r)) / (mean / n) } else { f64::NAN }
    })
}

#[cfg(test)]
mod tests {
    use super::super::fixtures::{image, mapped, noisy, texture};
    use super::*;

    #[test]
    fn only_change_beyond_the_references_counts() {
        let [a, b] = [texture([64, 64], 1), texture([64, 64], 2)];
        // The same images, or the same images brighter by a constant: the same change.
        assert_eq!(popping([&a, &b], [&a, &b]).unwrap().value, 0.0);
        let brighter = [&a, &b].map(|i| mapped(i, |v| v + 0.5));
        assert!(popping([&brighter[0], &brighter[1]], [&a, &b]).unwrap().value.abs() < 1e-6);
        // A jump of 0.1 where nothing should change, on 0.4.
        let still = image([64, 64], |_| [0.4; 3]);
        let jumped = popping([&still, &mapped(&still, |v| v + 0.1)], [&still, &still]).unwrap();
        assert!((jumped.value - 0.25).abs() < 1e-6, "{jumped:?}");
        // No change where there should be some.
        assert!(popping([&a, &a], [&a, &b]).unwrap().value < -0.3);
    }

    #[test]
    fn noise_that_changes_is_no_change() {
        let a = texture([96, 96], 1);
        let e = popping([&a, &mapped(&a, |v| v + 0.05)], [&noisy(&a, 0.1, 2), &noisy(&a, 0.1, 3)]).unwrap();
        // 0.05 on a mean of 0.5; what is left of the noise is a root of a small number.
        assert!((e.value - 0.1).abs() < 0.06, "{e:?}");
    }

    #[test]
    fn what_does_not_exist_is_none() {
        let (a, black) = (texture([4, 4], 1), image([4, 4], |_| [0.0; 3]));
        assert_eq!(popping([&a, &a], [&black, &black]), None);
        let mut broken = a.clone();
        broken.radiance[0][0] = f32::NAN;
        assert_eq!(popping([&a, &broken], [&a, &a]), None);
    }
}
