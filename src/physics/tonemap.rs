//! Display transform; twin of `shaders/physics/tonemap.glsl`.

/// x (1 + x/w²)/(1 + x) on the luminance, white w = 4 (Reinhard et al. 2002, eq. 4).
pub fn tone_curve(c: [f64; 3]) -> [f64; 3] {
    let l: f64 = c.iter().zip([0.2126, 0.7152, 0.0722]).map(|(c, w)| c.max(0.0) * w).sum();
    c.map(|c| (c * (1.0 + l / 16.0) / (1.0 + l)).clamp(0.0, 1.0))
}

/// Linear to sRGB (IEC 61966-2-1).
pub fn srgb(c: f64) -> f64 {
    if c <= 0.003_130_8 { 12.92 * c } else { 1.055 * c.powf(1.0 / 2.4) - 0.055 }
}

/// sRGB to linear.
pub fn linear(c: f64) -> f64 {
    if c <= 0.040_45 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_and_linear_are_inverse() {
        for k in 0..=1000 {
            let x = f64::from(k) / 1000.0;
            assert!((linear(srgb(x)) - x).abs() < 1e-6);
        }
        assert!(tone_curve([1e9; 3]).iter().all(|c| *c <= 1.0));
        assert_eq!(tone_curve([0.0; 3]), [0.0; 3]);
    }
}
