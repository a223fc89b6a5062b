//! Real spherical harmonics, orthonormal over the sphere (Sloan, Kautz & Snyder 2002; Behrendt et al. 2005, section 4); twin of
//! `shaders/physics/harmonics.glsl`.
//!
//! Y_lm stands at l² + l + m: Y_00; then y, z, x; then xy, yz, 3z² − 1, xz, x² − y²; then the seven of l = 3; each times the positive
//! factor that makes ∫ Y² dω = 1 (no sign of Condon and Shortley). A light L(ω) is the vector of ∫ L Y dω, a surface's transfer that of
//! ∫ V max(n·ω, 0) Y dω, V being what is free: their product is the irradiance, as far as the bands go. Transfer of a free surface ends
//! within l = 2 (l = 3 is zero, and what is beyond is a hundredth of a sun's light in the mean), so textures keep [`KEPT`] numbers.

use std::f64::consts::PI;

/// Bands of the light and the transfer that are kept: l = 0, 1, 2.
pub const BANDS: u32 = 3;
/// Numbers of these bands.
pub const KEPT: usize = count(BANDS);
/// Numbers of all bands that there are here: l = 0 to 3.
pub const ALL: usize = count(4);
/// What the byte 127 means of a transfer's number: no part of a hemisphere, weighed by its cosine, has one above (2π/3) √(3/4π) =
/// 1.0233, that of a whole one in band 1.
pub const RANGE: f64 = 1.024;

/// Numbers of the first bands.
pub const fn count(bands: u32) -> usize {
    (bands * bands) as usize
}

/// Y at a unit vector: bands l = 0 to 3, l² + l + m.
pub fn evaluate([x, y, z]: [f64; 3]) -> [f64; ALL] {
    let [k0, k1, k2] = [1.0, 3.0, 15.0].map(|k: f64| (k / (4.0 * PI)).sqrt());
    let [k20, k22] = [5.0, 15.0].map(|k: f64| (k / (16.0 * PI)).sqrt());
    let [k30, k31] = [7.0 / 16.0, 21.0 / 32.0].map(|k: f64| (k / PI).sqrt());
    let [k32, k33] = [105.0 / 4.0, 35.0 / 32.0].map(|k: f64| (k / PI).sqrt());
    [
        k0,
        k1 * y,
        k1 * z,
        k1 * x,
        k2 * x * y,
        k2 * y * z,
        k20 * (3.0 * z * z - 1.0),
        k2 * x * z,
        k22 * (x * x - y * y),
        k33 * y * (3.0 * x * x - y * y),
        k32 * x * y * z,
        k31 * y * (5.0 * z * z - 1.0),
        k30 * z * (5.0 * z * z - 3.0),
        k31 * x * (5.0 * z * z - 1.0),
        0.5 * k32 * z * (x * x - y * y),
        k33 * x * (x * x - 3.0 * y * y),
    ]
}

/// Transfer of a free surface with a unit normal: ∫ max(n·ω, 0) Y dω = A_l Y(n) with A = π, 2π/3, π/4, 0 (Ramamoorthi & Hanrahan 2001).
pub fn clamped_cosine(normal: [f64; 3]) -> [f64; ALL] {
    let mut transfer = evaluate(normal);
    transfer.iter_mut().enumerate().for_each(|(k, y)| *y *= [PI, 2.0 * PI / 3.0, 0.25 * PI, 0.0][band(k)]);
    transfer
}

/// l of a number's place.
fn band(place: usize) -> usize {
    place.isqrt()
}

/// An even sky of radiance 1 above the horizon z = 0, and nothing under it: √π, √(3π)/2, 0 and −√(7π)/8 where m = 0.
pub fn even_sky() -> [f64; ALL] {
    let mut light = [0.0; ALL];
    light[0] = PI.sqrt();
    light[2] = 0.5 * (3.0 * PI).sqrt();
    light[12] = -0.125 * (7.0 * PI).sqrt();
    light
}

/// The sun in the direction of a unit vector, of irradiance 1 on what faces it: Y there.
pub fn sun(to: [f64; 3]) -> [f64; ALL] {
    evaluate(to)
}

/// Irradiance of a surface by a light, over as many bands as both have.
pub fn irradiance(transfer: &[f64], light: &[f64]) -> f64 {
    transfer.iter().zip(light).map(|(t, l)| t * l).sum()
}

/// The numbers of what is turned about z, counterclockwise seen from above, by an angle of this cosine and sine: those of ±m turn among
/// themselves, by m times the angle.
pub fn turned(numbers: [f32; KEPT], [c, s]: [f32; 2]) -> [f32; KEPT] {
    let [n0, y, z, x, xy, yz, zz, xz, xx] = numbers;
    let (c2, s2) = (c * c - s * s, 2.0 * s * c);
    [
        n0,
        c * y + s * x,
        z,
        c * x - s * y,
        c2 * xy + s2 * xx,
        c * yz + s * xz,
        zz,
        c * xz - s * yz,
        c2 * xx - s2 * xy,
    ]
}

/// A number of a transfer as a signed byte.
pub fn encode(x: f64) -> i8 {
    (127.0 * x / RANGE).round().clamp(-127.0, 127.0) as i8
}

/// The reverse, off by [`RANGE`]/254 at most.
pub fn decode(byte: i8) -> f64 {
    f64::from(byte) * RANGE / 127.0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Directions all over, with poles, axes and those between.
    fn directions() -> Vec<[f64; 3]> {
        let mut all = Vec::new();
        for k in 0..=40 {
            for j in 0..50 {
                let (theta, phi) = (PI * f64::from(k) / 40.0, 2.0 * PI * f64::from(j) / 50.0);
                all.push([theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()]);
            }
        }
        all
    }

    /// Y_lm by angles: associated Legendre functions by recursion, times cos mφ or sin |m|φ.
    fn by_recursion(l: i32, m: i32, [x, y, z]: [f64; 3]) -> f64 {
        let (order, sine) = (m.abs(), x.hypot(y));
        let mut low = (1..=order).map(|k| f64::from(2 * k - 1) * sine).product::<f64>();
        let mut high = z * f64::from(2 * order + 1) * low;
        for k in order + 2..=l {
            let next =
                (f64::from(2 * k - 1) * z * high - f64::from(k + order - 1) * low) / f64::from(k - order);
            (low, high) = (high, next);
        }
        let legendre = if l == order { low } else { high };
        let factorial = |n: i32| (1..=n).map(f64::from).product::<f64>();
        let norm = (f64::from(2 * l + 1) / (4.0 * PI) * factorial(l - order) / factorial(l + order)).sqrt();
        let angle = f64::from(order) * y.atan2(x);
        legendre
            * norm
            * if m == 0 { 1.0 } else { 2f64.sqrt() * if m > 0 { angle.cos() } else { angle.sin() } }
    }

    #[test]
    fn polynomials_are_legendre_functions_of_the_angles() {
        for w in directions() {
            let y = evaluate(w);
            for l in 0..4 {
                for m in -l..=l {
                    // A dozen roundings of numbers of at most 7.
                    let want = by_recursion(l, m, w);
                    assert!((y[(l * l + l + m) as usize] - want).abs() < 1e-12, "{l} {m} {w:?}: {want}");
                }
            }
        }
    }

    /// Values by hand at (2, −1, 2)/3 and at the north pole.
    #[test]
    fn held_vectors() {
        let at = |w: [f64; 3], want: [f64; ALL]| {
            for (k, (y, want)) in evaluate(w).into_iter().zip(want).enumerate() {
                // Held to the twelfth digit.
                assert!((y - want).abs() < 1e-12, "{k} {w:?}: {y} {want}");
            }
        };
        let root = |n: f64, d: f64| (n / (d * PI)).sqrt();
        let zero = 0.0;
        #[rustfmt::skip]
        at([0.0, 0.0, 1.0], [
            0.5 / PI.sqrt(), zero, root(3.0, 4.0), zero, zero, zero, root(5.0, 4.0), zero, zero,
            zero, zero, zero, root(7.0, 4.0), zero, zero, zero,
        ]);
        #[rustfmt::skip]
        at([2.0 / 3.0, -1.0 / 3.0, 2.0 / 3.0], [
            0.282_094_791_773_878_14,
            -root(1.0, 12.0), root(1.0, 3.0), root(1.0, 3.0),
            -2.0 / 9.0 * root(15.0, 4.0), -2.0 / 9.0 * root(15.0, 4.0), root(5.0, 16.0) / 3.0,
            4.0 / 9.0 * root(15.0, 4.0), root(15.0, 16.0) / 3.0,
            -11.0 / 27.0 * root(35.0, 32.0), -4.0 / 27.0 * root(105.0, 4.0), -11.0 / 27.0 * root(21.0, 32.0),
            -14.0 / 27.0 * root(7.0, 16.0), 22.0 / 27.0 * root(21.0, 32.0), 6.0 / 27.0 * root(105.0, 16.0),
            2.0 / 27.0 * root(35.0, 32.0),
        ]);
    }

    /// ∫ f over the sphere, exact for polynomials up to the seventh degree in each hemisphere: Gauss and Legendre's four heights in
    /// each, and sixteen azimuths.
    fn integral(f: impl Fn([f64; 3]) -> f64) -> f64 {
        let nodes = [
            (0.339_981_043_584_856_26, 0.652_145_154_862_546_1),
            (0.861_136_311_594_052_6, 0.347_854_845_137_453_85),
        ];
        let heights = nodes.into_iter().flat_map(|(x, w)| [(x, w), (-x, w)]);
        let rule = heights.flat_map(|(x, w)| [(0.5 + 0.5 * x, 0.5 * w), (-0.5 - 0.5 * x, 0.5 * w)]);
        let ring = |z: f64| {
            let turn = |j: i32| 2.0 * PI * (f64::from(j) + 0.5) / 16.0;
            let at = |j| f([(1.0 - z * z).sqrt() * turn(j).cos(), (1.0 - z * z).sqrt() * turn(j).sin(), z]);
            (0..16).map(at).sum::<f64>() * 2.0 * PI / 16.0
        };
        rule.map(|(z, w)| w * ring(z)).sum()
    }

    #[test]
    fn they_are_orthonormal_and_lights_and_cosines_are_their_integrals() {
        let near = |got: f64, want: f64, what: &str| {
            // Sixty-four terms of at most 4, and nodes to the sixteenth digit.
            assert!((got - want).abs() < 1e-12, "{what}: {got} {want}");
        };
        for i in 0..ALL {
            for j in 0..ALL {
                let both = integral(|w| evaluate(w)[i] * evaluate(w)[j]);
                near(both, f64::from(u8::from(i == j)), &format!("{i} {j}"));
            }
            near(integral(|w| if w[2] > 0.0 { evaluate(w)[i] } else { 0.0 }), even_sky()[i], "sky");
            let up = [0.0, 0.0, 1.0];
            near(integral(|w| w[2].max(0.0) * evaluate(w)[i]), clamped_cosine(up)[i], "cosine");
        }
    }

    /// A free surface under a sky has exactly π (1 + n_z)/2 of two bands. Of a sun it has 1/4 + c/2 + 5 (3c² − 1)/32, which is the
    /// clamped cosine c but for bands of l = 4, 6, …
    #[test]
    fn irradiances_of_free_surfaces() {
        let suns: Vec<[f64; 3]> = directions().into_iter().step_by(17).collect();
        for n in directions() {
            let transfer = clamped_cosine(n);
            let sky = irradiance(&transfer[..KEPT], &even_sky());
            assert!((sky - 0.5 * PI * (1.0 + n[2])).abs() < 1e-12, "{n:?}: {sky}");
            for s in &suns {
                let c: f64 = (0..3).map(|k| n[k] * s[k]).sum();
                let got = irradiance(&transfer, &sun(*s));
                assert!((got - (0.25 + 0.5 * c + 5.0 / 32.0 * (3.0 * c * c - 1.0))).abs() < 1e-12);
                // What is left out is largest where c = 0: 3/32.
                assert!((got - c.max(0.0)).abs() < 3.0 / 32.0 + 1e-12, "{c}: {got}");
            }
        }
    }

    #[test]
    fn what_is_turned_has_at_turned_directions_what_it_had() {
        let numbers: [f32; KEPT] = std::array::from_fn(|k| (1.7 * k as f32 + 0.3).sin());
        let at = |numbers: [f32; KEPT], w| irradiance(&numbers.map(f64::from), &evaluate(w));
        for (k, [x, y, z]) in directions().into_iter().enumerate() {
            let (s, c) = (0.37 * k as f64).sin_cos();
            let got = at(turned(numbers, [c as f32, s as f32]), [c * x - s * y, s * x + c * y, z]);
            // Nine numbers and a cosine rounded to singles.
            assert!((got - at(numbers, [x, y, z])).abs() < 2e-6, "{k}: {got}");
        }
    }

    #[test]
    fn bytes_hold_every_transfer() {
        let largest = directions().into_iter().flat_map(clamped_cosine).fold(0.0, |a, x| x.abs().max(a));
        assert!(largest < RANGE && largest > 0.999 * RANGE, "{largest}");
        for k in -1000..=1000 {
            let x = 1e-3 * f64::from(k);
            assert!((decode(encode(x)) - x).abs() <= RANGE / 254.0 + 1e-12, "{x}");
        }
        assert_eq!([encode(9.0), encode(-9.0)], [127, -127]);
    }
}
