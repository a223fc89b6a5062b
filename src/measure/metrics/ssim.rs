//! Structural similarity (Wang et al. 2004).

/// Standard deviation of the window, pixels, and its radius: 11 × 11.
const SIGMA: f64 = 1.5;
const RADIUS: isize = 5;
/// (K1 L)² and (K2 L)² for values from 0 to 1.
const C1: f64 = 0.01 * 0.01;
const C2: f64 = 0.03 * 0.03;

/// Similarity at every pixel, −1 to 1, of two images with values from 0 to 1; at the border the window is what of it lies
/// in the image.
pub fn ssim_map(size: [u32; 2], a: &[f64], b: &[f64]) -> Vec<f64> {
    let mean = |of: &dyn Fn(usize) -> f64| blurred(size, &(0..a.len()).map(of).collect::<Vec<_>>());
    let (ma, mb) = (mean(&|k| a[k]), mean(&|k| b[k]));
    let (aa, bb, ab) = (mean(&|k| a[k] * a[k]), mean(&|k| b[k] * b[k]), mean(&|k| a[k] * b[k]));
    (0..a.len())
        .map(|k| {
            let (ma, mb) = (ma[k], mb[k]);
            // Rounding must not make a variance negative.
            let (va, vb) = ((aa[k] - ma * ma).max(0.0), (bb[k] - mb * mb).max(0.0));
            let cov = ab[k] - ma * mb;
            (2.0 * ma * mb + C1) * (2.0 * cov + C2) / ((ma * ma + mb * mb + C1) * (va + vb + C2))
        })
        .collect()
}

/// Gaussian means.
fn blurred(size: [u32; 2], values: &[f64]) -> Vec<f64> {
    let [width, height] = size.map(|s| s as isize);
    let pass = |values: &[f64], dx: isize, dy: isize| -> Vec<f64> {
        (0..values.len() as isize)
            .map(|k| {
                let (x, y) = (k % width, k / width);
                let (mut sum, mut weights) = (0.0, 0.0);
                for d in -RADIUS..=RADIUS {
                    let (u, v) = (x + d * dx, y + d * dy);
                    if (0..width).contains(&u) && (0..height).contains(&v) {
                        let weight = (-0.5 * (d as f64 / SIGMA).powi(2)).exp();
                        sum += weight * values[(v * width + u) as usize];
                        weights += weight;
                    }
                }
                sum / weights
            })
            .collect()
    };
    pass(&pass(values, 1, 0), 0, 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::statistics::Random;

    const SIZE: [u32; 2] = [40, 30];

    fn texture() -> Vec<f64> {
        let mut random = Random::new(5);
        (0..SIZE[0] * SIZE[1]).map(|_| random.unit()).collect()
    }

    fn mean(map: &[f64]) -> f64 {
        map.iter().sum::<f64>() / map.len() as f64
    }

    #[test]
    fn closed_forms() {
        let a = texture();
        assert!(ssim_map(SIZE, &a, &a).iter().all(|s| (s - 1.0).abs() < 1e-12));
        let negated: Vec<f64> = a.iter().map(|v| 1.0 - v).collect();
        assert!(mean(&ssim_map(SIZE, &a, &negated)) < -0.8);
        // Without structure only the means are compared: (2 ab + C1) / (a² + b² + C1).
        let [x, y] = [0.25, 0.75];
        let flat = ssim_map(SIZE, &[x; 1200], &[y; 1200]);
        let expected = (2.0 * x * y + C1) / (x * x + y * y + C1);
        assert!(flat.iter().all(|s| (s - expected).abs() < 1e-9), "{} {expected}", flat[0]);
        assert!((ssim_map([1, 1], &[x], &[y])[0] - expected).abs() < 1e-12);
    }

    #[test]
    fn it_is_symmetric_and_falls_with_noise() {
        let (a, mut random) = (texture(), Random::new(6));
        let noise: Vec<f64> = a.iter().map(|_| random.unit() - 0.5).collect();
        let with = |s: f64| a.iter().zip(&noise).map(|(v, n)| v + s * n).collect::<Vec<_>>();
        let similarity = [0.1, 0.3, 0.9].map(|s| mean(&ssim_map(SIZE, &a, &with(s))));
        assert!(1.0 > similarity[0] && similarity[0] > similarity[1] && similarity[1] > similarity[2]);
        let [b, c] = [ssim_map(SIZE, &a, &with(0.5)), ssim_map(SIZE, &with(0.5), &a)];
        assert!(b.iter().zip(&c).all(|(b, c)| (b - c).abs() < 1e-12));
    }
}
