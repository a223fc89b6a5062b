//! Light from the sun's direction to what a texel of a view shows (precomputed radiance transfer: Sloan, Kautz & Snyder
//! 2002); twin of `shaders/physics/transfer.glsl`.
//!
//! What one texel shows of a crown, a few leaves, gets more or less of the sun than the crown's law gives to any surface at its
//! depth ([`super::light::self_shadow`]), and scatters it more or less to the viewer, because of the branches that stand
//! before it and of how its leaves lie. That depends on the sun's direction l, in the tree's own axes, and varies slowly with it:
//!
//! M(l) = max(1 + w(α) Σ x_i Y_i(l), 0),  w = 1 − exp(−√α),  Y = 1, x, y, z, xy, yz, xz, x² − y²:
//!
//! spherical harmonics of band 1, and of band 2 without 3z² − 1, which over the upper hemisphere, from where the sun shines, is much
//! like z (leaving it out costs 0.01 of the 0.6 to 0.7 of the variance between texels that all nine explain). w is for the hotspot: at
//! the phase angle α = 0 all that is seen is lit, and from there shadows grow with the root of the angle, which slow terms cannot
//! follow (without w a crown is 8 to 11 % too dark there). On average over a crown M is about 1: what is amiss of that goes into
//! [`Transfer::sent`].

use super::correction::Correction;

/// Coefficients that a texel of one texture holds; each band has a texture.
pub const TERMS: usize = 4;
/// What lies between two neighbouring bytes: 0 is stored as it is, and coefficients reach from −4 to 3.97.
pub const STEP: f64 = 1.0 / 32.0;
/// The byte of 0.
pub const ZERO: f64 = 128.0;
/// The bytes that change nothing: M = 1.
pub const NEUTRAL: [u8; TERMS] = [128; TERMS];

/// Light transfer of the views of a z-field: a texture array like its own, but smaller.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Transfer {
    /// Texels a side of level 0: half of the views'.
    pub resolution: u32,
    /// Per band and level, all layers one after the other, rows from the bottom (v = 0) up: coefficients of each texel, encoded.
    pub bands: Vec<Vec<Vec<u8>>>,
    /// What the crown's laws and transfer together leave out of the sunlight that is sent to the viewer, in place of [`super::crown::Crown`]'s:
    /// few terms a texel cannot keep the mean over a crown for every pair of directions.
    pub sent: Correction,
}

/// w: the strength of transfer at a phase angle, rad.
pub fn strength(angle: f64) -> f64 {
    1.0 - (-angle.sqrt()).exp()
}

/// Y at a unit vector, by band.
pub fn basis([x, y, z]: [f64; 3]) -> [[f64; TERMS]; 2] {
    [[1.0, x, y, z], [x * y, y * z, x * z, x * x - y * y]]
}

/// Four coefficients as bytes, cut off at their range.
pub fn encode(x: [f64; TERMS]) -> [u8; 4] {
    x.map(|x| (x / STEP + ZERO).round().clamp(0.0, 255.0) as u8)
}

/// The reverse.
pub fn decode(bytes: [u8; 4]) -> [f64; 4] {
    bytes.map(|b| STEP * (f64::from(b) - ZERO))
}

/// M of a texel, of as many bands as there are, for light from the unit vector `l` with w = `strength`.
pub fn transfer(bands: &[[f64; TERMS]], l: [f64; 3], strength: f64) -> f64 {
    let terms = bands.iter().flatten().zip(basis(l).into_iter().flatten());
    (1.0 + strength * terms.map(|(x, y)| x * y).sum::<f64>()).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_lost_of_what_changes_nothing() {
        assert_eq!(encode([0.0; 4]), NEUTRAL);
        assert_eq!(transfer(&[NEUTRAL; 2].map(decode), [0.6, 0.0, 0.8], 0.7), 1.0);
        assert_eq!(transfer(&[[-1.0, 0.0, 0.0, 3.0]], [0.0, 0.0, 1.0], 0.0), 1.0);
        assert_eq!(transfer(&[[-3.0, 0.0, 0.0, 0.5]], [0.0, 0.0, 1.0], 0.5), 0.0);
    }

    #[test]
    fn bytes_are_at_most_half_a_step_off_and_saturate() {
        for k in -380..=380 {
            let x = f64::from(k) * 0.01;
            assert!((decode(encode([x; 4]))[0] - x).abs() <= 0.5 * STEP + 1e-12, "{x}");
        }
        assert_eq!(encode([1e9, -1e9, f64::INFINITY, 0.0]), [255, 0, 255, 128]);
    }
}
