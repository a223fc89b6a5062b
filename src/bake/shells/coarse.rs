//! Cover of stacks of merged slices and coarse texels, as they stand for forest farther and farther away, against rays cast at the same trees.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::Shells;
use super::march::{March, Stack};
use super::verify::{BLOCK, DENSITIES, Truth, mean};
use crate::physics::hash::Stream;
use crate::rays;
use crate::scene::Scene;

/// Angles from the zenith that are looked from, degrees.
const ZENITHS: [f64; 2] = [0.0, 60.0];

/// Cover of a stack of merged slices and coarse texels.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Coarse {
    /// Side of a texel, m.
    pub texel: f64,
    /// Slices.
    pub slices: u32,
    /// From the zenith, degrees.
    pub zenith: f64,
    /// Share of the full density.
    pub share: f64,
    /// What it hides of rays on their long way ([`March::Long`]), less what meshes do.
    pub difference: f64,
    /// Standard error of the difference.
    pub error: f64,
}

/// Casts so many rays at each angle.
pub(super) fn coarse(scene: &Scene, shells: &Shells, truth: &Truth, rays: u32) -> Vec<Coarse> {
    let mips = 0..shells.levels[0].len();
    let all = mips.flat_map(|mip| (0..shells.levels.len()).map(move |level| (level, mip)));
    let all: Vec<(usize, usize)> = all.collect();
    let stacks: Vec<Stack> =
        all.iter().map(|(level, mip)| Stack::new(shells, scene.seed, *level, *mip)).collect();
    let side = f64::from(BLOCK) * shells.tile_side;
    let seen = ZENITHS.map(|zenith| -> Vec<Vec<[f64; 2]>> {
        let (sin, cos) = zenith.to_radians().sin_cos();
        let cast = |open: &mut rays::Stack, ray| {
            let mut stream = Stream::new(ray);
            let ground = DVec2::new(stream.unit(), stream.unit()) * side;
            let toward = (DVec2::from_angle(std::f64::consts::TAU * stream.unit()) * sin).extend(cos);
            let hidden = truth.hidden(ground, toward.as_vec3(), open);
            let more = |s: &Stack| [0, 1].map(|d| hides(s, ground, toward)[d] - hidden[d]);
            stacks.iter().map(more).collect()
        };
        (0..rays).into_par_iter().map_init(rays::Stack::new, cast).collect()
    });
    let mut found = Vec::new();
    for (k, (level, mip)) in all.iter().enumerate() {
        let texel = shells.tile_side / f64::from(shells.levels[*level][*mip].side);
        let slices = shells.settings.slices >> level;
        for (d, share) in DENSITIES.into_iter().enumerate() {
            for (zenith, seen) in ZENITHS.into_iter().zip(&seen) {
                let (difference, error) = mean(seen.iter().map(|r| r[k][d]));
                found.push(Coarse { texel, slices, zenith, share, difference, error });
            }
        }
    }
    found
}

/// What a stack hides, by density.
fn hides(stack: &Stack, ground: DVec2, toward: DVec3) -> [f64; 2] {
    let mut passes = [1.0; 2];
    for cover in stack.level(ground, toward) {
        for (p, share) in passes.iter_mut().zip(DENSITIES) {
            *p *= March::long(cover, share, toward.z);
        }
    }
    passes.map(|p| 1.0 - p)
}
