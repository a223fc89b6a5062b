//! How well a stack of slices hides the ground: against rays cast at the same trees, direction by direction, at the full density and at half
//! of it; and whether one can tell where tiles meet (`seams.rs`).

use std::sync::Arc;

use glam::{DVec2, Vec3};
use rayon::prelude::*;

use super::march::{MARCHES, March, Stack};
use super::{Forest, Patch, Shells};
use crate::Result;
use crate::bake::foliage::Foliage;
use crate::bake::grove::{Grove, Tree};
use crate::land::candidate::tile_kind;
use crate::physics::hash::Stream;
use crate::rays;
use crate::scene::Scene;

/// Tiles a side of the ground that rays start from.
const BLOCK: i32 = 4;
/// The lowest view, degrees from the zenith.
const LOWEST: f64 = 80.0;
/// Shares of the full density that are looked at.
const DENSITIES: [f64; 2] = [1.0, 0.5];

/// Cover of the ground as a stack has it.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Agreement {
    /// How rays went through the stack.
    pub march: March,
    /// Share of rays that it hides the ground from.
    pub cover: f64,
    /// That less the truth.
    pub difference: f64,
    /// Standard error of the difference; both are of the same rays.
    pub error: f64,
}

/// Cover of the ground seen at an angle.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Quality {
    /// From the zenith, degrees.
    pub zenith: f64,
    /// Share of the full density.
    pub share: f64,
    /// Share of the ground that meshes hide.
    pub truth: f64,
    /// Its standard error.
    pub error: f64,
    /// What the stack hides.
    pub stack: [Agreement; MARCHES],
}

/// Looks at the ground from so many angles between the zenith and 80 degrees, at so many points each, at full and half density.
///
/// # Errors
/// As [`Forest::new`].
pub fn verify(scene: &Scene, shells: &Shells, directions: u32, points: u32) -> Result<Vec<Quality>> {
    let forest = Forest::new(scene)?;
    let stack = Stack::new(shells, scene.seed, 0, 0);
    let foliage = scene.species.iter().map(|s| Foliage::new(&s.mesh, &s.optics).map(Arc::new));
    let foliage = foliage.collect::<Result<Vec<_>>>()?;
    // As far as a ray at the lowest view goes before it leaves the highest tree.
    let margin = (f64::from(shells.height) * LOWEST.to_radians().tan() / shells.tile_side).ceil() as i32 + 1;
    let groves = DENSITIES.map(|share| {
        let trees = standing(&forest.patch, scene.seed, -margin..BLOCK + margin, share);
        Grove::new(foliage.clone(), trees)
    });
    let mut found = Vec::new();
    for k in 0..directions {
        let zenith = LOWEST * f64::from(k) / f64::from((directions - 1).max(1));
        let seen: Vec<[Outcome; 2]> = (0..points)
            .into_par_iter()
            .map_init(rays::Stack::new, |open, ray| {
                let mut stream = Stream::new(crate::physics::hash::hash2(k, ray));
                let side = f64::from(BLOCK) * shells.tile_side;
                let ground = DVec2::new(side * stream.unit(), side * stream.unit());
                let azimuth = std::f64::consts::TAU * stream.unit();
                let (sin, cos) = zenith.to_radians().sin_cos();
                let toward = (DVec2::from_angle(azimuth) * sin).extend(cos);
                let passes = stack.passes(ground, toward, &DENSITIES);
                let origin = ground.as_vec2().extend(0.0);
                [0, 1].map(|d| Outcome {
                    hidden: f64::from(u8::from(groves[d].occluded(origin, toward.as_vec3(), open))),
                    cover: passes[d].map(|p| 1.0 - p),
                })
            })
            .collect();
        for (d, share) in DENSITIES.into_iter().enumerate() {
            found.push(quality(zenith, share, seen.iter().map(|s| s[d])));
        }
    }
    Ok(found)
}

/// The trees of a square of tiles that stand at a share of the full density, with the origin at the south-west corner of tile 0, 0.
fn standing(patch: &Patch, seed: u32, tiles: std::ops::Range<i32>, share: f64) -> Vec<Tree> {
    let mut trees = Vec::new();
    for (x, y) in tiles.clone().flat_map(|y| tiles.clone().map(move |x| (x, y))) {
        let corner = Vec3::new(x as f32, y as f32, 0.0) * patch.side as f32;
        let here = patch.trees(tile_kind(seed, x, y)).iter().filter(|i| f64::from(i.activation) < share);
        trees.extend(here.map(|i| Tree { base: i.tree.base + corner, ..i.tree }));
    }
    trees
}

/// A ray.
#[derive(Clone, Copy)]
struct Outcome {
    /// 1 where meshes hide the ground.
    hidden: f64,
    cover: [f64; MARCHES],
}

fn quality(zenith: f64, share: f64, rays: impl Iterator<Item = Outcome> + Clone) -> Quality {
    let (truth, error) = mean(rays.clone().map(|r| r.hidden));
    let stack = std::array::from_fn(|m| {
        let (difference, error) = mean(rays.clone().map(|r| r.cover[m] - r.hidden));
        Agreement { march: March::ALL[m], cover: truth + difference, difference, error }
    });
    Quality { zenith, share, truth, error, stack }
}

/// Mean and its standard error, of independent values.
pub(super) fn mean(values: impl Iterator<Item = f64> + Clone) -> (f64, f64) {
    let n = (values.clone().count() as f64).max(1.0);
    let mean = values.clone().sum::<f64>() / n;
    let squares = values.map(|v| (v - mean).powi(2)).sum::<f64>();
    (mean, (squares / (n - 1.0).max(1.0) / n).sqrt())
}
