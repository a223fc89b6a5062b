//! From trees drawn one by one to the shader-map (BN12, section 7), so that the mean radiance of a forest does not depend
//! on the distance; twin of `shaders/physics/handover.glsl`.
//!
//! `relative` is the distance s over the range, s/s_max. BN12 fade all trees alike with 1 − smoothstep(0.8, 1, s/s_max) and mix the shader-map's trees in with
//! (1 − k_g − k_ḡ)·smoothstep (eq. 26, 27). Two things are changed:
//!
//! - Each tree fades over a tenth of the range at a time of its own, u in [0, 1) from its hash, so that single trees go and
//!   not a film of all. The mean over u is the quadratic smoothstep 1 − S of [`handed_over`].
//! - Trees faded to a fraction f on average leave exp(−f L) of the ground where all leave exp(−L), since each crown hides
//!   what it did with the probability f. So the shader-map must leave exp(−S L), not 1 − (1 − exp(−L)) S, for the product
//!   exp(−(1−S) L) exp(−S L) to be exp(−L) at every distance. At S = 1 this is eq. 13.
//!
//! The ground condition "k_g = k_ḡ = 0 where Γ = 1" is enforced linearly: with Γ's expectation C the visible ground is
//! exp(−L) (1 − Γ)/(1 − C), whose mean over any distribution of Γ is exp(−L); replacing Λ by Γ/A, as BN12 do, makes
//! the mean of a convex function of it, and too much ground: 0.6 instead of 0.23 at 70° and half coverage. Written as
//! 1 + (C − Γ)/(1 − C), the divisor can be kept from 0 (where gaps of less than 1/64 of the ground are finer than coverage is
//! known) without a change of the mean.

/// ν of BN12, eq. 22–25: how far light and ground have converged to their averages, which they are from `end` on.
///
/// BN12 end at 0.8. Trees of a few pixels know their light only roughly: shadow maps blur it, so that what is brightest
/// (the hotspot) darkens and what is darkest brightens. An earlier end keeps more of the average and takes fewer shadows. At an
/// end of 0 nothing ever converges.
pub fn converged(relative: f64, end: f64) -> f64 {
    if end <= 0.0 {
        return 0.0;
    }
    let t = (relative / end).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// s/s_max from which on the shader-map shows trees: where the first one begins to fade.
pub const HANDOVER_FROM: f64 = 0.8;
/// 1 over the width of the band in which all of them fade.
pub const HANDOVER_RATE: f64 = 5.0;

/// S: share of the trees that the shader-map shows; 0 up to 0.8, 1 from 1 on.
pub fn handed_over(relative: f64) -> f64 {
    let t = ((relative - HANDOVER_FROM) * HANDOVER_RATE).clamp(0.0, 1.0);
    if t < 0.5 { 2.0 * t * t } else { 1.0 - 2.0 * (1.0 - t) * (1.0 - t) }
}

/// s/s_max at which the first of a species' trees has faded out.
pub const FADE_FIRST: f64 = 0.9;
/// How much later in s/s_max the last one has.
pub const FADE_SPREAD: f64 = 0.1;
/// Opacity that a tree loses per s/s_max while it fades.
pub const FADE_RATE: f64 = 10.0;

/// s/s_max at which a tree has faded out that does so at its own time u in [0, 1).
pub fn fade_end(u: f64) -> f64 {
    FADE_FIRST + FADE_SPREAD * u
}

/// Opacity factor of that tree.
pub fn tree_fade(relative: f64, u: f64) -> f64 {
    ((fade_end(u) - relative) * FADE_RATE).clamp(0.0, 1.0)
}

/// Ground that the shader-map's trees leave: `thickness` is Σ S_i L_i, `over` its share of Σ L_i.
pub fn open_ground(thickness: f64, over: f64, coverage: f64, expected: f64) -> f64 {
    let between = over.powi(4) * ((expected - coverage) / (1.0 - expected).max(1.0 / 64.0));
    ((-thickness).exp() * (1.0 + between)).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn trees_fade_one_by_one_and_all_together_as_the_shader_map_takes_over() {
        let n = 20_000;
        for k in 0..=240 {
            let relative = f64::from(k) / 200.0;
            let mean = (0..n).map(|i| tree_fade(relative, (f64::from(i) + 0.5) / f64::from(n))).sum::<f64>();
            assert!((mean / f64::from(n) - (1.0 - handed_over(relative))).abs() < 1e-6, "{relative}");
        }
        // Alone, a tree fades within a tenth of the range.
        assert_eq!((tree_fade(0.85, 0.5), tree_fade(0.951, 0.5)), (1.0, 0.0));
    }

    #[test]
    fn light_that_never_converges_does_so_at_no_distance() {
        assert!([0.0, 0.5, 1.0, 1e9].iter().all(|relative| converged(*relative, 0.0) == 0.0));
        assert_eq!([0.0, 0.45, 1.0].map(|relative| converged(relative, 0.45)), [0.0, 1.0, 1.0]);
    }

    #[test]
    fn ground_does_not_depend_on_the_distance_on_average() {
        // Poisson crowns of thickness L, a fraction 1 - S of them drawn, and the shader-map behind.
        for thickness in [0.1, 0.7, 2.5] {
            for k in 0..=40 {
                let s = handed_over(0.8 + 0.005 * f64::from(k));
                let drawn = (-(1.0 - s) * thickness).exp();
                let mean = drawn * open_ground(s * thickness, s, 0.5, 0.5);
                assert!((mean - (-thickness).exp()).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn coverage_takes_the_ground_without_changing_its_mean() {
        for (thickness, expected) in [(1.2f64, 0.5), (0.7, 0.4), (4.0, 0.9), (6.0, 0.995)] {
            if expected < 63.0 / 64.0 {
                assert!(open_ground(thickness, 1.0, 1.0, expected) < 1e-15);
            }
            // Sharp discs, and half blurred ones.
            for blur in [0.0, 0.5] {
                let level = |covered: f64| covered + blur * (expected - covered);
                let ground = |c: f64| open_ground(thickness, 1.0, level(c), expected);
                let mean = expected * ground(1.0) + (1.0 - expected) * ground(0.0);
                assert!((mean - (-thickness).exp()).abs() < 1e-12, "{thickness} {expected} {blur}");
            }
        }
    }
}
