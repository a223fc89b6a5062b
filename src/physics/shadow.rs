//! Shadow maps; twin of `shaders/physics/shadow.glsl`.
//!
//! A texel holds one depth. Where several semi-transparent trees lie one behind the other towards the sun, each is drawn into
//! the texel with the probability of its opacity: a point behind all of them is lit with the probability ∏ (1 − α), as
//! it should be, at every resolution of the map. Depth and opacity of the nearest tree alone, as BN12 keep them, forget
//! the others: ten times too much light on the ground of a dense forest.

/// Change of depth along a cascade's axes x and y, per unit of xy where the cascade is [−1, 1]² wide and its depth [0, 1], on a
/// plane of normal n: dz = −(n·x, n·y)/(n·sun)/2, at most 2 either way.
pub fn plane_gradient(n: [f64; 3], x: [f64; 3], y: [f64; 3], sun: [f64; 3]) -> [f64; 2] {
    let dot = |a: [f64; 3]| n[0] * a[0] + n[1] * a[1] + n[2] * a[2];
    [x, y].map(|a| (-0.5 * dot(a) / dot(sun).max(1e-3)).clamp(-2.0, 2.0))
}

/// Cascade ranges of parallel-split shadow maps (Zhang et al. 2006): logarithmic and uniform splits mixed by `lambda`.
/// Returns the far distance of each of `count` cascades.
pub fn parallel_splits(near: f64, far: f64, count: u32, lambda: f64) -> Vec<f64> {
    (1..=count)
        .map(|i| {
            let t = f64::from(i) / f64::from(count);
            lambda * near * (far / near).powf(t) + (1.0 - lambda) * (near + (far - near) * t)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plane_is_as_deep_as_its_gradient_says() {
        // The sun at 40 degrees above the south; level ground and a slope. Points of the plane, in the cascade's axes.
        let (s, c) = 40f64.to_radians().sin_cos();
        let (x, y, sun) = ([1.0, 0.0, 0.0], [0.0, s, c], [0.0, -c, s]);
        let dot = |a: [f64; 3], b: [f64; 3]| (0..3).map(|k| a[k] * b[k]).sum::<f64>();
        for n in [[0.0, 0.0, 1.0], [0.2, -0.1, 0.97]] {
            let g = plane_gradient(n, x, y, sun);
            for p in [[1.0, 0.0], [0.0, 1.0], [3.0, -2.0]] {
                let point = [p[0], p[1], -(n[0] * p[0] + n[1] * p[1]) / n[2]];
                // Half the change of z over the same distance: depth is over twice the half width.
                let depth = 0.5 * dot(point, sun);
                assert!((g[0] * dot(point, x) + g[1] * dot(point, y) - depth).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn splits_grow_to_the_far_distance() {
        for lambda in [0.0, 0.5, 1.0] {
            let s = parallel_splits(1.0, 1000.0, 4, lambda);
            assert!(s.windows(2).all(|w| w[0] < w[1]));
            assert!((s[3] - 1000.0).abs() < 1e-9);
        }
    }
}
