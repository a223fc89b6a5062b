//! What the laws of a crown's light leave out, by the directions of viewer and sun and by height; twin of
//! `shaders/physics/correction.glsl`.
//!
//! [`super::light::self_shadow`] and [`super::light::leaf_phase`] know a crown by four numbers. A real one is denser below than at
//! its top, its leaves lie flatter there, and its far side is darker than any law of the distance and the phase angle says: in an oak, 4 % too
//! few of what is seen are lit with the sun at 45°, 21 % with it at 20° behind the tree, and what lit leaves send is 13 % too much there. Held
//! against rays through the mesh, in cells of view, sun and height that such laws were not fitted in, what is left of either has an
//! rms of 6 % in an oak and 10 % in a pine; times
//!
//! K(z) = max(1 + s Σ_i (a_i + b_i z) Y_i, 0),  Y = 1, q, q², l_z, l_z², v_z, v_z q, l_z q,  q = √(α/π),
//!
//! with the phase angle α and z in [−1, 1] from the trunk's foot to the tree's top, 2 and 4 %. Without b, heights keep their errors:
//! 2 and 10 %, and that is what makes dense forests wrong, of which only the tops are seen and lit. `bake` measures a and b of every
//! mesh.

/// Terms Y.
pub const TERMS: usize = 8;

/// a and b of a crown; by default nothing is corrected, K is 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Correction {
    /// a: at the middle of the tree's height.
    pub middle: [f32; TERMS],
    /// b: change over half of it.
    pub change: [f32; TERMS],
}

/// Y, of the cosines v_z and l_z of the zenith angles of viewer and sun (none below the horizon) and the phase angle, rad.
pub fn terms(view: f64, sun: f64, angle: f64) -> [f64; TERMS] {
    let (v, l, q) = (view.clamp(0.0, 1.0), sun.clamp(0.0, 1.0), (angle / std::f64::consts::PI).sqrt());
    [1.0, q, q * q, l, l * l, v, v * q, l * q]
}

/// Terms for light that is known at the surfaces themselves (`src/bake/harmonics/seen.rs`), where only the way from phase angle to phase angle
/// is left to find: hats about q = 0, 1/5, … 1 (0, 7, 29, 65, 115 and 180°), between which their sum is linear in q; and l_z and v_z.
///
/// Held against other rays at oaks, a pine and a birch, in eighths of the phase angle, the sum of both sides' light is then off by 2 % where it
/// is most; with Y by 6 %, with a polynomial in q of the fourth degree by 4 %.
pub fn phase_terms(view: f64, sun: f64, angle: f64) -> [f64; TERMS] {
    let x = 5.0 * (angle / std::f64::consts::PI).sqrt();
    let hat = |node: f64| (1.0 - (x - node).abs()).max(0.0);
    [hat(0.0), hat(1.0), hat(2.0), hat(3.0), hat(4.0), hat(5.0), sun.clamp(0.0, 1.0), view.clamp(0.0, 1.0)]
}

/// Terms of [`ShellCorrection`].
pub const SHELL_TERMS: usize = 20;

/// Coefficients for the sun on slices of a forest (`src/bake/shells/sun.rs`), K = max(1 + Σ c_i x_i, 0); by default nothing is corrected.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ShellCorrection {
    /// c.
    pub coefficients: [f32; SHELL_TERMS],
}

impl ShellCorrection {
    /// x: (1, s) times [`phase_terms`], l_z⁴ and v_z², at a share s of the full density. What slices show is seen from straight above, and so is lit
    /// by a high sun where means say it is not: that is no line in l_z.
    pub fn terms(view: f64, sun: f64, angle: f64, share: f64) -> [f64; SHELL_TERMS] {
        let y = phase_terms(view, sun, angle);
        let more = [y[6].powi(4), y[7] * y[7]];
        std::array::from_fn(|i| match i {
            0..8 => y[i],
            8..10 => more[i - 8],
            10..12 => share * more[i - 10],
            _ => share * y[i - 12],
        })
    }

    /// K.
    pub fn at(&self, terms: &[f64; SHELL_TERMS]) -> f64 {
        let sum: f64 = self.coefficients.iter().zip(terms).map(|(c, x)| f64::from(*c) * x).sum();
        (1.0 + sum).max(0.0)
    }
}

impl Correction {
    /// Of all coefficients, a before b: what is stored, sent to shaders and solved for.
    pub fn from_coefficients(all: [f32; 2 * TERMS]) -> Self {
        let of = |first: usize| std::array::from_fn(|i| all[first + i]);
        Correction { middle: of(0), change: of(TERMS) }
    }

    /// The reverse.
    pub fn coefficients(&self) -> [f32; 2 * TERMS] {
        std::array::from_fn(|i| if i < TERMS { self.middle[i] } else { self.change[i - TERMS] })
    }

    /// K as a line in z: its value at 0, and its slope.
    pub fn line(&self, terms: &[f64; TERMS], strength: f64) -> [f64; 2] {
        let sum = |c: &[f32; TERMS]| c.iter().zip(terms).map(|(c, y)| f64::from(*c) * y).sum::<f64>();
        [1.0 + strength * sum(&self.middle), strength * sum(&self.change)]
    }
}

/// K at a height.
pub fn at([value, slope]: [f64; 2], z: f64) -> f64 {
    (value + slope * z).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_corrected_without_coefficients_and_never_below_zero() {
        let y = terms(0.3, 0.8, 1.0);
        assert_eq!(Correction::default().line(&y, 1.0), [1.0, 0.0]);
        let c = Correction { middle: [-0.5; TERMS], change: [1.0; TERMS] };
        let line = c.line(&y, 0.5);
        let sum: f64 = y.iter().sum();
        assert!((line[0] - (1.0 - 0.25 * sum)).abs() < 1e-12 && (line[1] - 0.5 * sum).abs() < 1e-12);
        assert_eq!(at(line, -9.0), 0.0);
        // Hats are a part of unity, of two neighbours at most.
        for k in 0..=90 {
            let y = phase_terms(0.25, 0.5, std::f64::consts::PI * f64::from(k) / 90.0);
            assert!((y[..6].iter().sum::<f64>() - 1.0).abs() < 1e-12 && y[6..] == [0.5, 0.25]);
            assert!(y[..6].iter().filter(|h| **h > 0.0).count() <= 2);
        }
        // Slices: terms for all of the density begin with those for none, but for two.
        let x = ShellCorrection::terms(0.5, 0.25, 1.0, 0.5);
        assert!(x[..8] == phase_terms(0.5, 0.25, 1.0) && x[8..12] == [0.00390625, 0.25, 0.001953125, 0.125]);
        assert!((0..8).all(|i| x[12 + i] == 0.5 * x[i]));
        let mut k = ShellCorrection::default();
        assert_eq!(k.at(&x), 1.0);
        k.coefficients[10] = -1000.0;
        assert_eq!(k.at(&x), 0.0);
        // From under the ground nothing is known that the horizon does not know.
        assert_eq!(terms(-0.5, 2.0, 1.0), terms(0.0, 1.0, 1.0));
    }
}
