//! Energy of detail: how much radiance changes from pixel to pixel within crowns, whether or not it changes where the reference does.
//!
//! Errors reward blur: an image that does not know where a leaf is lit errs least when it shows the mean. What an eye then misses is
//! contrast, which these two measure, by squared central differences and by the squared Laplacian of five points,
//!
//! |∇L|² = ¼ ((L₊ₓ − L₋ₓ)² + (L₊ᵧ − L₋ᵧ)²),  (ΔL)² = (L₊ₓ + L₋ₓ + L₊ᵧ + L₋ᵧ − 4 L)²,
//!
//! summed over channels and over pixels that are trees with their four neighbours. Of noise alone that is ¼ Σ v and Σ v + 16 v, with v the variance of
//! the four neighbours, and of the pixel itself; it is subtracted from the reference's.

use super::{Estimate, Region, block_sums, estimate, variance};
use crate::image::Layers;

/// Energy of detail within crowns over the reference's: 1 for the same, less for an image that is blurred.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Detail {
    /// Of the gradient.
    pub gradient: Estimate,
    /// Of the Laplacian, which looks at what is smaller.
    pub laplacian: Estimate,
}

/// A pixel's four neighbours.
fn neighbours(k: usize, width: usize) -> [usize; 4] {
    [k - 1, k + 1, k - width, k + width]
}

/// Energies of gradient and Laplacian at a pixel; of a reference without its noise.
fn energies(image: &Layers, k: usize, noise: bool) -> [f64; 2] {
    let around = neighbours(k, image.size[0] as usize);
    let mut sums = [0.0; 2];
    for c in 0..3 {
        let at = |k: usize| f64::from(image.radiance[k][c]);
        let [west, east, north, south] = around.map(at);
        sums[0] += 0.25 * ((east - west).powi(2) + (south - north).powi(2));
        sums[1] += (west + east + north + south - 4.0 * at(k)).powi(2);
        if noise {
            let v = |k: usize| f64::from(variance(image, k)[c]);
            let of_neighbours: f64 = around.map(v).iter().sum();
            sums[0] -= 0.25 * of_neighbours;
            sums[1] -= of_neighbours + 16.0 * v(k);
        }
    }
    sums
}

/// Energy of detail of an image over that of its reference, whose regions are given. `None` where no pixel is trees with all of its neighbours, where the
/// reference has no detail above its noise, and where something is no finite number.
pub fn detail(actual: &Layers, reference: &Layers, regions: &[Region]) -> Option<Detail> {
    let [width, height] = reference.size.map(|s| s as usize);
    let crown = |k: usize| {
        let (x, y) = (k % width, k / width);
        let inner = x > 0 && y > 0 && x + 1 < width && y + 1 < height;
        inner
            && regions[k] == Region::Trees
            && neighbours(k, width).iter().all(|n| regions[*n] == Region::Trees)
    };
    let blocks = block_sums(reference.size, |k| {
        crown(k).then(|| {
            let ([g, l], [gr, lr]) = (energies(actual, k, false), energies(reference, k, true));
            [g, gr, l, lr]
        })
    });
    let ratio = |a: f64, r: f64| if r > 0.0 { a / r } else { f64::NAN };
    Some(Detail {
        gradient: estimate(&blocks, |[g, gr, ..]| ratio(g, gr))?,
        laplacian: estimate(&blocks, |[.., l, lr]| ratio(l, lr))?,
    })
}

#[cfg(test)]
mod tests {
    use super::super::fixtures::{mapped, noisy, texture};
    use super::super::regions;
    use super::*;

    const SIZE: [u32; 2] = [120, 80];

    fn of(actual: &Layers, reference: &Layers) -> Option<[f64; 2]> {
        let d = detail(actual, reference, &regions(reference))?;
        Some([d.gradient.value, d.laplacian.value])
    }

    #[test]
    fn contrast_counts_squared_and_brightness_does_not() {
        let a = texture(SIZE, 1);
        assert_eq!(of(&a, &a), Some([1.0, 1.0]));
        let [g, l] = of(&mapped(&a, |v| 0.5 * v + 3.0), &a).unwrap();
        assert!((g - 0.25).abs() < 1e-5 && (l - 0.25).abs() < 1e-5, "{g} {l}");
        // Detail elsewhere counts as much as detail in its place.
        let [g, l] = of(&texture(SIZE, 2), &a).unwrap();
        assert!((g - 1.0).abs() < 0.1 && (l - 1.0).abs() < 0.1, "{g} {l}");
        assert_eq!(of(&a, &mapped(&a, |_| 0.4)), None);
    }

    #[test]
    fn a_blur_of_three_texels_loses_what_its_transfer_function_says() {
        let a = texture(SIZE, 3);
        let width = SIZE[0] as usize;
        let blurred = |k: usize| {
            let (x, y) = (k % width, k / width);
            let inner = x > 0 && x + 1 < width && y > 0 && y + 1 < SIZE[1] as usize;
            let along = if inner { [k - 1, k, k + 1] } else { [k; 3] };
            [0, 1, 2].map(|c| along.iter().map(|i| a.radiance[*i][c]).sum::<f32>() / 3.0)
        };
        let b = Layers { radiance: (0..a.radiance.len()).map(blurred).collect(), ..a.clone() };
        let [g, l] = of(&b, &a).unwrap();
        // Of white noise of variance 1 a difference at two texels has 2 along each axis. Blurred along x by thirds, that along x keeps four of its six
        // addends, 4/9, and that across 2/3: (4/9 + 2/3) / 4. The Laplacian, 20, becomes the weights 1/3 (1, -3, -2, -3, 1) and twice 1/3 (1, 1, 1).
        let (expected_g, expected_l) = ((4.0 / 9.0 + 2.0 / 3.0) / 4.0, (24.0 + 6.0) / 9.0 / 20.0);
        assert!((g / expected_g - 1.0).abs() < 0.1, "{g} {expected_g}");
        assert!((l / expected_l - 1.0).abs() < 0.1, "{l} {expected_l}");
    }

    #[test]
    fn noise_of_the_reference_is_no_detail() {
        let clean = texture(SIZE, 4);
        let [g, l] = of(&clean, &noisy(&clean, 0.1, 5)).unwrap();
        assert!((g - 1.0).abs() < 0.1 && (l - 1.0).abs() < 0.1, "{g} {l}");
        let unaware = Layers { variance: None, ..noisy(&clean, 0.1, 5) };
        assert!(of(&clean, &unaware).unwrap()[0] < 0.8);
    }
}
