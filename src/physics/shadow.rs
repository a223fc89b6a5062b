//! Shadow map texels; twin of `shaders/physics/shadow.glsl`.

/// Depth towards the sun (1 nearest) in 24 bits and opacity in 8.
pub fn pack_caster(depth: f64, opacity: f64) -> u32 {
    let depth = (depth.clamp(0.0, 1.0) * 16_777_215.0) as u32;
    depth << 8 | (opacity.clamp(0.0, 1.0) * 255.0 + 0.5) as u32
}

/// How much of the sun a caster leaves to a point at `depth`.
pub fn caster_visibility(caster: u32, depth: f64) -> f64 {
    let at = f64::from(caster >> 8) / 16_777_215.0;
    if at > depth { 1.0 - f64::from(caster & 255) / 255.0 } else { 1.0 }
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
    fn casters_keep_their_depth_and_opacity() {
        for k in 0..=1000 {
            let (d, o) = (f64::from(k) / 1000.0, 1.0 - f64::from(k) / 1000.0);
            let c = pack_caster(d, o);
            // A step of 24 and of 8 bits.
            assert!((caster_visibility(c, -1.0) - (1.0 - o)).abs() <= 0.5 / 255.0 + 1e-12);
            assert_eq!(caster_visibility(c, d + 1e-7), 1.0);
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
