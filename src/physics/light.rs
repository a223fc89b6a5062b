//! Light at leaves and on the ground (BN12, section 5, with the corrections that the README lists); twin of
//! `shaders/physics/light.glsl`.

use std::f64::consts::PI;

/// Luminance of linear RGB (Rec. 709).
pub fn luminance<T: Copy + Into<f64>>([r, g, b]: [T; 3]) -> f64 {
    0.2126 * r.into() + 0.7152 * g.into() + 0.0722 * b.into()
}

/// Angle between two unit vectors, rad; atan2 keeps its precision at 0 and π, where acos loses it.
pub fn angle_between(a: [f64; 3], b: [f64; 3]) -> f64 {
    let c = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    let dot = a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    (c[0] * c[0] + c[1] * c[1] + c[2] * c[2]).sqrt().atan2(dot)
}

/// Reflectance of a crown at a phase angle, rad, over that at 0: seen from beside the light, more of its leaves show their unlit
/// side than uniform ones would (`Turned` of a bake).
pub fn turned_reflectance(turning: f64, angle: f64) -> f64 {
    (1.0 + turning * angle).max(0.0)
}

/// Leaf-scale hotspot F (BN12, eq. 8) at a phase angle, rad: 1 − a₁ (1 − exp(−a₂ angle)).
pub fn hotspot(angle: f64, a1: f64, a2: f64) -> f64 {
    1.0 - a1 * (1.0 - (-a2 * angle).exp())
}

/// Share of a crown's visible surface that the crown itself leaves lit: at the phase angle α (rad) between viewer and light,
/// where light has gone s metres from the z-field's surface to the point that is seen,
///
/// P = exp(−√α (c + √(τ s))).
///
/// BN12 have exp(−τ s) with the hotspot of eq. 8 on top. Both assume a homogeneous medium; in real crowns, whose leaves
/// sit on twigs around hollows, and of whose surfaces a z-field knows the outermost only, what a ray meets in s metres
/// varies from ray to ray. The mean of exp(−k) over k of a Lévy distribution of scale τ s/2 is exp(−√(τ s)): much light
/// stops within decimetres, and some comes through ten metres. And what is seen through a gap is lit through the same gap
/// when light comes from there: k grows from 0 with the angle, and measured as √α for either term. Over 60,000
/// pairs of rays through an oak and a pine, in 180 cells of α and s, this leaves 0.027 of P (rms), with c = 0.52, 0.50 and √τ
/// = 0.74, 0.76; the homogeneous medium, with L/(2V) for τ, leaves 0.154. `bake` measures c and τ of every mesh.
pub fn self_shadow(angle: f64, metres: f64, c: f64, tau: f64) -> f64 {
    (-(c * angle.sqrt() + (tau * angle * metres).max(0.0).sqrt())).exp()
}

/// Radiance of fully lit, uniformly oriented bi-Lambertian leaves per irradiance (ρ p of BN12 eq. 7), at a phase angle
/// between viewer and light, from leaf reflectance r and transmittance t.
///
/// Ross (1981): Γ = (r + t)(sin β − β cos β)/(3π) + t cos β/3 with β = π − angle; the radiance is 2Γ/π because uniformly
/// oriented leaves extinguish half their area per volume.
pub fn leaf_phase(angle: f64, r: f64, t: f64) -> f64 {
    let b = PI - angle;
    let gamma = (r + t) * (b.sin() - b * b.cos()) / (3.0 * PI) + t * b.cos() / 3.0;
    gamma.max(0.0) * 2.0 / PI
}

/// Of leaves of uniform orientation whose sides a viewer sees, weighed by what he sees of them, at a phase angle, rad: the mean irradiance of either
/// side, over that of all leaves; and the share of it that is on the side that is seen.
///
/// Means of |n·v| |n·l| over the sphere where both are of one sign and where they are not: sin α + (π − α) cos α and sin α − α cos α, to the
/// same factor (Ross 1981).
pub fn side_seen(angle: f64) -> [f64; 2] {
    let (s, c) = angle.sin_cos();
    let same = s + (PI - angle) * c;
    let both = same + s - angle * c;
    [both * 4.0 / (3.0 * PI), same / both]
}

/// Sky seen from depth d on the axis of a cylindrical hole of radius r (BN12, eq. 9), `inverse_r2` = 1/r².
pub fn hole_occlusion(d: f64, inverse_r2: f64) -> f64 {
    1.0 / (1.0 + d * d * inverse_r2)
}

/// Sine of a slope's angle, from the cosine.
fn slope_sine(up: f64) -> f64 {
    (1.0 - up * up).max(0.0).sqrt().max(1e-3)
}

/// Sky on the ground of a slope whose unit normal has the vertical part `up`, under trees of an optical thickness on the map, that leave
/// `visible` of the whole hemisphere about the normal. Directions of that hemisphere under the horizon, (1 − up)/2 of it by cosine, bring
/// nothing. They graze the slope, at two thirds of its sine on average (as cosines weigh them), and most are behind trees anyway.
pub fn ground_sky(up: f64, visible: f64, thickness: f64) -> f64 {
    (visible - 0.5 * (1.0 - up) * (-1.5 * thickness * up / slope_sine(up)).exp()).max(0.0)
}

/// Sky on a tree on that slope, over that on one of level ground: leaves of all orientations lose the lune between the horizon and the
/// ground that rises behind, the slope's angle over π of the sky, of which they see what half of the trees in front leave.
pub fn sky_over_slope(up: f64, thickness: f64) -> f64 {
    1.0 - up.clamp(-1.0, 1.0).acos() / PI * (-0.75 * thickness * up / slope_sine(up)).exp()
}

/// 2 E₃(x): mean sky visibility of the ground under opaque Poisson crowns of optical thickness x = density × area, the
/// closed form of D (BN12, eq. 18) for opaque crowns. E₁ by its series below 1 and its continued fraction above.
pub fn ground_visibility(x: f64) -> f64 {
    if x <= 0.0 {
        return 1.0;
    }
    let e1 = if x < 1.0 {
        let (mut sum, mut term) = (-0.577_215_664_901_532_9 - x.ln(), 1.0);
        for k in 1..40 {
            term *= -x / f64::from(k);
            sum -= term / f64::from(k);
        }
        sum
    } else {
        let mut fraction = 0.0;
        for k in (1..200).rev() {
            let k = f64::from(k);
            fraction = k / (1.0 + k / (x + fraction));
        }
        (-x).exp() / (x + fraction)
    };
    let e = (-x).exp();
    e - x * (e - x * e1)
}

/// Contrast of the ground near trees (BN12, eq. 10), clamped at 0.
pub fn ground_contrast(coverage: f64, expected: f64, a3: f64) -> f64 {
    (1.0 - a3 * (coverage - expected)).max(0.0)
}

/// Fraction of the sun's disc above a level horizon, for the elevation of its centre in degrees; the disc's radius is
/// 0.2665°. Continuous, 1/2 at 0.
pub fn sun_disc_fraction(elevation: f64) -> f64 {
    let h = (elevation / 0.2665).clamp(-1.0, 1.0);
    0.5 + (h * (1.0 - h * h).sqrt() + h.asin()) / PI
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn leaf_phase_conserves_energy() {
        // Over all directions 2 Γ / π must give what leaves that extinguish half their area scatter: r + t of what they
        // intercept, 1/(4π) a steradian on average.
        let n = 20_000;
        for (r, t) in [(0.1, 0.05), (0.5, 0.45), (0.3, 0.0), (0.0, 0.3)] {
            let sum: f64 = (0..n)
                .map(|k| {
                    let angle = PI * (f64::from(k) + 0.5) / f64::from(n);
                    leaf_phase(angle, r, t) * 2.0 * PI * angle.sin() * PI / f64::from(n)
                })
                .sum();
            assert!((sum - (r + t)).abs() < 1e-6, "r {r} t {t}: {sum}");
        }
    }

    #[test]
    fn leaf_phase_at_backscatter_is_that_of_lambertian_leaves() {
        // Visible leaves weigh cos, lit ones cos: r/π <cos²>/<cos> = 2r/(3π).
        assert!((leaf_phase(0.0, 0.3, 0.2) - 2.0 * 0.3 / (3.0 * PI)).abs() < 1e-12);
    }

    #[test]
    fn sides_that_are_seen_are_lit_as_uniform_leaves_are() {
        let n = 400;
        for angle in [0.0, 0.4, 1.3, PI / 2.0, 2.8, PI] {
            // Normals over the sphere, the viewer at the pole: weights of what is seen, |n·v|, and of light on the same side and on either.
            let (mut seen, mut same, mut both) = (0.0, 0.0, 0.0);
            for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
                let (z, turn) =
                    ((f64::from(i) + 0.5) / f64::from(n), 2.0 * PI * (f64::from(j) + 0.5) / f64::from(n));
                let lit = (1.0 - z * z).sqrt() * turn.cos() * angle.sin() + z * angle.cos();
                (seen, same, both) = (seen + z, same + z * lit.max(0.0), both + z * lit.abs());
            }
            let [mean, share] = side_seen(angle);
            // The mean of |n·l| over all leaves is 1/2.
            assert!((mean - 2.0 * both / seen).abs() < 1e-4 && (share - same / both).abs() < 1e-4, "{angle}");
        }
    }

    #[test]
    fn ground_visibility_is_the_integral_of_exp_sec() {
        // 2 ∫ exp(-x / μ) μ dμ by the midpoint rule.
        for x in [1e-6, 1e-3, 0.1, 0.5, 0.99, 1.01, 3.0, 20.0] {
            let n = 200_000;
            let sum: f64 = (0..n)
                .map(|k| {
                    let mu = (f64::from(k) + 0.5) / f64::from(n);
                    2.0 * (-x / mu).exp() * mu / f64::from(n)
                })
                .sum();
            assert!((ground_visibility(x) - sum).abs() < 1e-8, "x {x}: {} {sum}", ground_visibility(x));
        }
        assert_eq!(ground_visibility(0.0), 1.0);
    }

    /// Under a layer of spheres parallel to a slope, of λ A = x on the map and so x n_z on the slope, exp(−x n_z / (l·n)) of a sun's light
    /// arrives; ∫ over the sky above the horizon, by cosine, against the closed form less the lune. One mean angle stands for the
    /// lune's: a hundredth.
    #[test]
    fn the_sky_on_a_slope_is_that_above_its_normal_less_what_is_under_the_horizon() {
        let count = 400;
        for slope in [0.0f64, 10.0, 20.0, 30.0] {
            let (sine, up) = slope.to_radians().sin_cos();
            for x in [0.0, 0.1, 0.4, 1.5] {
                let (mut sum, mut free) = (0.0, 0.0);
                for k in 0..count * count {
                    let (u, turn) = (
                        (f64::from(k / count) + 0.5) / f64::from(count),
                        2.0 * PI * (f64::from(k % count) + 0.5) / f64::from(count),
                    );
                    // By cosine about the normal (sin, 0, cos); what is under the horizon brings nothing.
                    let (across, along) = ((1.0 - u).sqrt(), u.sqrt());
                    if along * up - across * turn.cos() * sine > 0.0 {
                        sum += (-x * up / along).exp();
                    }
                    free += (-x * up / along).exp();
                }
                let [sum, free] = [sum, free].map(|s| s / f64::from(count * count));
                let got = ground_sky(up, free, x);
                assert!((got - sum).abs() < 0.01, "{slope} {x}: {got} {sum}");
                assert!((free - ground_visibility(x * up)).abs() < 1e-3);
            }
            // A lone tree loses the slope's share of half a turn.
            assert!(
                (sky_over_slope(up, 0.0) - (1.0 - slope / 180.0)).abs() < 1e-9
                    && sky_over_slope(up, 9.0) <= 1.0
            );
        }
    }

    #[test]
    fn the_sun_sets_smoothly() {
        assert_eq!(sun_disc_fraction(5.0), 1.0);
        assert_eq!(sun_disc_fraction(0.0), 0.5);
        assert_eq!(sun_disc_fraction(-5.0), 0.0);
    }
}
