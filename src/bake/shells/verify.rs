//! How well a stack of slices hides the ground: against rays cast at the same trees, direction by direction, at the full density and at half
//! of it; near the edges of tiles (`edges.rs`), in coarse texels (`coarse.rs`), and whether one can tell where tiles meet (`seams.rs`).

use std::f64::consts::TAU;
use std::ops::Range;

use glam::{DVec2, Vec3};
use rayon::prelude::*;

use super::coarse::{Coarse, coarse};
use super::edges::{Near, edges};
use super::light::foliage;
use super::lit::{Lit, lit};
use super::march::{MARCHES, March, Stack};
use super::seams::{Seam, seams};
use super::slices::SHARES;
use super::sun::{self, SunTold};
use super::{Forest, Patch, Shells};
use crate::Result;
use crate::bake::grove::{Grove, Tree};
use crate::land::candidate::tile_kind;
use crate::physics::hash::{Stream, hash2};
use crate::rays;
use crate::scene::Scene;

/// Tiles a side of the ground that rays start from.
pub(super) const BLOCK: i32 = 4;
/// The lowest view, degrees from the zenith.
const LOWEST: f64 = 80.0;
/// So many rays for the ground are asked for each texel whose light is looked at, by some ten thousand rays.
const RAYS_A_TEXEL: u32 = 100;
/// Seed of rays that corrections are held against: not that of those they were fitted to.
const SUN_SEED: u32 = 1;
/// Shares of the full density that are looked at.
pub(super) const DENSITIES: [f64; 2] = [1.0, 0.5];

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

/// What [`verify`] finds.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Verified {
    /// Cover of the ground by angle, at full and half density.
    pub angles: Vec<Quality>,
    /// Cover from above by distance from the edges of tiles, at half and a quarter of the density.
    pub edges: Vec<Near>,
    /// Cover by merged slices and mips.
    pub coarse: Vec<Coarse>,
    /// Light on what the finest slices show, at full density.
    pub light: Vec<Lit>,
    /// The sun that shells send to viewers, by density and phase angle.
    pub sun: Vec<SunTold>,
    /// Tiles side by side, at each share of the full density.
    pub seams: [Seam; SHARES],
}

/// Holds shells against the trees that they were made of: by rays from so many angles between the zenith and 80 degrees, at so many points
/// each; from above at four times as many, by distance from edges; and tiles against one another.
///
/// # Errors
/// As [`Forest::new`].
pub fn verify(scene: &Scene, shells: &Shells, directions: u32, points: u32) -> Result<Verified> {
    let forest = Forest::new(scene)?;
    // As far as a ray at the lowest view goes before it leaves the highest tree.
    let margin = (f64::from(shells.height) * LOWEST.to_radians().tan() / shells.tile_side).ceil() as i32 + 1;
    let truth = Truth::new(scene, &forest, -margin..BLOCK + margin, DENSITIES)?;
    Ok(Verified {
        angles: angles(scene, shells, &truth, (directions, points)),
        coarse: coarse(scene, shells, &truth, points),
        light: lit(scene, shells, &forest, points.div_ceil(RAYS_A_TEXEL))?,
        sun: sun::check((scene.seed, &forest, &foliage(scene)?), shells, SUN_SEED),
        edges: edges(scene, shells, &forest, 4 * points)?,
        seams: seams(shells),
    })
}

/// Cover by angle.
fn angles(scene: &Scene, shells: &Shells, truth: &Truth, (directions, points): (u32, u32)) -> Vec<Quality> {
    let stack = Stack::new(shells, scene.seed, 0, 0);
    let side = f64::from(BLOCK) * shells.tile_side;
    let mut found = Vec::new();
    for k in 0..directions {
        let zenith = LOWEST * f64::from(k) / f64::from((directions - 1).max(1));
        let (sin, cos) = zenith.to_radians().sin_cos();
        let seen: Vec<[Outcome; 2]> = (0..points)
            .into_par_iter()
            .map_init(rays::Stack::new, |open, ray| {
                let mut stream = Stream::new(hash2(k, ray));
                let ground = DVec2::new(side * stream.unit(), side * stream.unit());
                let toward = (DVec2::from_angle(TAU * stream.unit()) * sin).extend(cos);
                let passes = stack.passes(ground, toward, &DENSITIES);
                let hidden = truth.hidden(ground, toward.as_vec3(), open);
                [0, 1].map(|d| Outcome { hidden: hidden[d], cover: passes[d].map(|p| 1.0 - p) })
            })
            .collect();
        for (d, share) in DENSITIES.into_iter().enumerate() {
            found.push(quality(zenith, share, seen.iter().map(|s| s[d])));
        }
    }
    found
}

/// The meshes of a square of tiles, by density.
pub(super) struct Truth {
    groves: [Grove; 2],
}

impl Truth {
    /// Of these tiles east and north, at two shares of the full density; their origin is the south-west corner of tile 0, 0.
    pub fn new(scene: &Scene, forest: &Forest, tiles: Range<i32>, shares: [f64; 2]) -> Result<Self> {
        let foliage = foliage(scene)?;
        let of =
            |share| Grove::new(foliage.clone(), standing(&forest.patch, scene.seed, tiles.clone(), share));
        Ok(Truth { groves: shares.map(of) })
    }

    /// 1 where a place on the ground is hidden from a viewer in this direction, else 0.
    pub fn hidden(&self, ground: DVec2, toward: Vec3, open: &mut rays::Stack) -> [f64; 2] {
        let origin = ground.as_vec2().extend(0.0);
        [0, 1].map(|d| f64::from(u8::from(self.groves[d].occluded(origin, toward, open))))
    }
}

/// The trees of a square of tiles that stand at a share of the full density, with the origin at the south-west corner of tile 0, 0.
pub(super) fn standing(patch: &Patch, seed: u32, tiles: Range<i32>, share: f64) -> Vec<Tree> {
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
