//! How much of the picture a tree covers, and how near to its middle fewer and larger leaves must be to cover as much.

use glam::DVec3;
use rayon::prelude::*;

use super::Levels;
use crate::bake::raster::{NO_FACE, Raster, View};
use crate::bake::surface::Surface;
use crate::physics::levels::{OCTAVES, bark_level};
use crate::physics::views::{Basis, spread};

/// Directions from which it is measured: of the upper hemisphere, because from the opposite side a tree covers the same.
const DIRECTIONS: usize = 24;
/// Texels along a side of a picture of it, each of 16 samples.
const RESOLUTION: u32 = 64;
/// Of the view that just holds the tree, how much wider a picture is: fewer cards, wider, reach out of the tree's box.
pub(super) const MARGIN: f32 = 1.5;
/// Least side of a card, pixels, with whose size on the screen bark goes: what twigs no longer cover leaves have to. As the knob `leaf_pixels` has it at first.
const TYPICAL_PIXELS: f64 = 6.0;
/// Steps towards the pull.
const STEPS: usize = 3;
/// Least and most of it.
const BOUNDS: [f64; 2] = [0.3, 1.3];

/// The nearest face that each sample of a picture of `resolution`² texels shows from a direction in scaled tree space.
pub(super) fn silhouette<'a>(
    surface: &Surface,
    towards: DVec3,
    resolution: u32,
    raster: &'a mut Raster,
) -> &'a [u32] {
    let mut view = View::new(&Basis::new(towards), resolution);
    view.half *= MARGIN;
    raster.draw(surface, &view);
    &raster.faces
}

/// The first directions of [`spread`].
pub(super) fn directions(count: usize) -> Vec<DVec3> {
    spread().take(count).collect()
}

/// Samples that a surface covers from each direction.
fn covered(surface: &Surface) -> Vec<u32> {
    let count = |raster: &mut Raster, w: DVec3| {
        let seen = silhouette(surface, w, RESOLUTION, raster);
        seen.iter().filter(|f| **f != NO_FACE).count() as u32
    };
    directions(DIRECTIONS).into_par_iter().map_init(|| Raster::new(RESOLUTION), count).collect()
}

/// Mean over directions of what is covered over what is covered of the whole.
fn ratio(of: &[u32], whole: &[u32]) -> f64 {
    let each = of.iter().zip(whole).map(|(a, b)| f64::from(*a) / f64::from((*b).max(1)));
    each.sum::<f64>() / whole.len() as f64
}

/// Factor of how far cards are from the middle of all leaves at each octave of the share with which the tree covers as much as whole, on average over the directions.
pub(super) fn pull(surface: &Surface, levels: &Levels) -> [f64; OCTAVES] {
    let whole = covered(surface);
    let mut found = [1.0; OCTAVES];
    if levels.cards.count == 0 {
        return found;
    }
    for octave in 1..OCTAVES {
        let share = 0.5f64.powi(octave as i32);
        let metre = TYPICAL_PIXELS * share.sqrt() / levels.cards.side;
        let bark = bark_level(levels.bark.iter().map(|b| b.error), metre, share);
        let at = |pull: f64| ratio(&covered(&levels.surface(surface, share, pull, bark).0), &whole).ln();
        // The secant in logarithms: what a crown covers grows at most with the square of its width.
        let (mut before, mut now) = (found[octave - 1], found[octave - 1]);
        let mut error = [0.0, at(now)];
        for step in 0..STEPS {
            let slope = if step == 0 { 1.5 } else { (error[1] - error[0]) / (now / before).ln() };
            let slope = if slope.is_finite() { slope.clamp(0.5, 3.0) } else { 1.5 };
            before = now;
            now = (now * (-error[1] / slope).exp()).clamp(BOUNDS[0], BOUNDS[1]);
            error = [error[1], if step + 1 < STEPS { at(now) } else { 0.0 }];
        }
        // As it is kept.
        found[octave] = f64::from(now as f32);
    }
    found
}

#[cfg(test)]
/// Coverage of a surface over that of another, on average over the directions.
pub(super) fn of(whole: &Surface, surface: &Surface) -> f64 {
    ratio(&covered(surface), &covered(whole))
}
