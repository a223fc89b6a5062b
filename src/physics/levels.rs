//! How much of a tree's mesh is drawn at its apparent size; twin of `shaders/physics/levels.glsl`.
//!
//! **Leaves**: stochastic simplification (Cook, Halstead, Planck & Ryu 2007, "Stochastic Simplification of Aggregate Detail"). Cards
//! of leaves stand in one shuffled order; of N cards the first N u are drawn, and each is as much larger in area as there are fewer, 1/u, so that the
//! expected area along every line of sight stays. A card's **rank** is the share of all leaf area that comes before it, and half of its own.
//!
//! Cook et al. draw u = (z/z₀)^(−log_h 2) from the distance z₀ on where an element is of pixel size; at h times that half of them are left.
//! Here h = √2, u = (z/z₀)⁻². A card of side l that is 1/√u as wide is then seen at z as wide as a whole model's is at z₀: l f / z₀ pixels,
//! with f pixels a metre at one metre. So no card is ever drawn smaller than that, the number of cards goes with the tree's area on the
//! screen, and so does its cost. With l f / z the side of a card in pixels, u is the square of its ratio to the least side, at most 1.
//! Cook's pixel size is a least side of 1. A card stands for a whole spray of leaves, with holes between, so that fewer and
//! larger ones are not told apart at several pixels: the knob `leaf_pixels`.
//!
//! **The last cards fade**: around rank u, over [`FADE_BAND`] u (1 − u) to either side, a card's area falls from full to nothing. The mean over ranks is u, as
//! without the band, and each card's size is a continuous function of the distance. At u = 1 there is no band, and all is whole.
//!
//! **Pull**: larger cards reach farther out of the crown, which then covers more. So their middles are drawn towards the middle of all leaves, by a factor
//! that brings the mean coverage back to that of the whole model; it is measured at [`OCTAVES`] shares when a species is baked. The leaves' area stays, and
//! with it how deep one sees into the crown. (Less area in place of that would also cover as much: but then one sees deeper, to where it is darker.)
//!
//! **Bark** has levels of a simplifier, of which the coarsest is drawn whose distance from the whole bark is at most [`BARK_PIXELS`].

/// Shares u at which the pull is known: 1, 1/2, 1/4 and so on.
pub const OCTAVES: usize = 7;
/// The last of them, under which u never is.
pub const LEAST_SHARE: f64 = 1.0 / 64.0;
/// Half the width of the band of ranks in which cards fade, over u (1 − u).
pub const FADE_BAND: f64 = 0.1;
/// Most levels of bark, the whole among them: each of half the triangles of the one before.
pub const BARK_LEVELS: usize = 6;
/// Farthest that a drawn level of bark may be from the whole bark, pixels.
pub const BARK_PIXELS: f64 = 0.5;

/// u: share of the leaves that is drawn of a tree whose cards have a side of so many pixels, from a least side on. 1 where that is 0.
pub fn leaf_share(pixels: f64, least: f64) -> f64 {
    if pixels >= least { 1.0 } else { (pixels / least).powi(2).max(LEAST_SHARE) }
}

/// Rank from which on cards are not drawn.
pub fn drawn_end(share: f64) -> f64 {
    share + FADE_BAND * share * (1.0 - share)
}

/// What is left of the area of a card of a rank while it fades: 1 to 0.
pub fn card_weight(rank: f64, share: f64) -> f64 {
    if share >= 1.0 {
        return 1.0;
    }
    ((drawn_end(share) - rank) / (2.0 * FADE_BAND * share * (1.0 - share))).clamp(0.0, 1.0)
}

/// The pull at a share, from those at octaves: linear in the octave.
pub fn pull(octaves: &[f64; OCTAVES], share: f64) -> f64 {
    let octave = (-share.log2()).clamp(0.0, (OCTAVES - 1) as f64);
    let k = (octave as usize).min(OCTAVES - 2);
    octaves[k] + (octaves[k + 1] - octaves[k]) * (octave - k as f64)
}

/// Factor of the size of a card of a rank, along each side.
pub fn card_scale(rank: f64, share: f64) -> f64 {
    if share >= 1.0 { 1.0 } else { (card_weight(rank, share) / share).sqrt() }
}

/// The level of bark for a tree of which a metre covers so many pixels, from the levels' distances from the whole bark in metres; trees
/// whose leaves are all drawn have all of their bark.
pub fn bark_level(errors: impl IntoIterator<Item = f64>, pixels: f64, share: f64) -> usize {
    let within = |error: &f64| error * pixels <= BARK_PIXELS;
    let some = errors.into_iter().enumerate().filter(|(k, e)| *k > 0 && share < 1.0 && within(e));
    some.last().map_or(0, |(k, _)| k)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_share_is_one_near_and_falls_with_the_square_of_the_distance() {
        let (side, least, focal) = (0.6, 6.0, 1000.0);
        let at = |distance: f64| leaf_share(side * focal / distance, least);
        assert_eq!((at(1.0), at(100.0)), (1.0, 1.0));
        // Cook's law with h = √2: half of them at √2 times where it begins.
        assert!((at(100.0 * 2f64.sqrt()) - 0.5).abs() < 1e-12);
        let mut before = 1.0;
        for k in 0..4000 {
            let now = at(50.0 * 1.001f64.powi(k));
            // Never more with the distance, and without jumps.
            assert!(now <= before && before - now < 0.0021, "{k}: {now} after {before}");
            before = now;
        }
        assert_eq!((before, leaf_share(1e-9, 0.0)), (LEAST_SHARE, 1.0));
    }

    #[test]
    fn fading_cards_keep_the_area_and_go_without_a_jump() {
        let n = 100_000;
        for share in [1.0, 0.999, 0.7, 0.5, 0.1, LEAST_SHARE] {
            let weights: Vec<f64> =
                (0..n).map(|k| card_weight((f64::from(k) + 0.5) / f64::from(n), share)).collect();
            let mean = weights.iter().sum::<f64>() / f64::from(n);
            assert!((mean - share).abs() < 1e-4, "{share}: {mean}");
            assert!(weights.is_sorted_by(|a, b| a >= b), "{share}");
            let drawn = weights.iter().filter(|w| **w > 0.0).count() as f64 / f64::from(n);
            assert!((drawn - drawn_end(share).min(1.0)).abs() < 1e-4, "{share}: {drawn}");
        }
        // Of one card, from where all are drawn on: whole at first, gone at last, and in between in steps that get smaller with those of the share.
        let along = |steps: u32| {
            let at = |k: u32| card_weight(0.9, 1.0 - 0.5 * f64::from(k) / f64::from(steps));
            assert_eq!((at(0), at(steps)), (1.0, 0.0));
            (0..steps).map(|k| (at(k) - at(k + 1)).abs()).fold(0.0, f64::max)
        };
        assert!(along(10_000) < 0.004 && along(100_000) < 0.0004, "{}", along(10_000));
    }

    #[test]
    fn a_level_of_bark_is_within_half_a_pixel_and_the_coarsest_such() {
        let errors = [0.0, 0.01, 0.02, 0.08];
        let level = |pixels: f64| bark_level(errors, pixels, 0.5);
        assert_eq!([100.0, 50.0, 26.0, 25.0, 7.0, 6.0].map(level), [0, 1, 1, 2, 2, 3]);
        // Near trees are whole.
        assert_eq!(bark_level(errors, 1.0, 1.0), 0);
        let octaves = [1.0, 0.9, 0.8, 0.7, 0.65, 0.6, 0.5];
        assert_eq!([1.0, 0.5, LEAST_SHARE].map(|u| pull(&octaves, u)), [1.0, 0.9, 0.5]);
        assert!((pull(&octaves, 0.125f64.sqrt()) - 0.85).abs() < 1e-12);
    }
}
