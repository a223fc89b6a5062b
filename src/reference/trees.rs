//! The trees that matter for an image: those of the renderer's own seeds that the eye may see, or that take or give light
//! where it looks.

use std::sync::atomic::{AtomicUsize, Ordering};

use glam::DVec3;
use rayon::prelude::*;

use crate::bake::grove::Tree;
use crate::camera::{Bounds, Eye};
use crate::land::candidate::{Candidate, Layout, listed};
use crate::land::quadtree::Quadtree;
use crate::physics::light::sun_disc_fraction;
use crate::scene::{Distribution, Scene};
use crate::{Error, Result};

/// Most trees of a world: 0.4 GB, and about as much again while its hierarchy is built.
pub const MOST_TREES: usize = 4_000_000;
/// Trees up to so many heights of the tallest one away from what is seen change its light. From the ground, those beyond
/// are lower than 10 degrees, where 3 % of the light of an even sky comes from if nothing nearer is in the way.
const LIGHT_REACH: f64 = 6.0;
/// Shadows are at most so many times as long as their casters are tall, as in the renderer.
const LONGEST_SHADOW: f64 = 20.0;

/// Trees around what some eyes see, and the origin that they are relative to: the middle of them.
///
/// # Errors
/// [`Error::Usage`] when there are more than [`MOST_TREES`].
pub fn collect(scene: &Scene, eyes: &[Eye], sun: [f64; 3]) -> Result<(Vec<Tree>, DVec3)> {
    let region = Region::new(scene, eyes, sun);
    let mut found: Vec<([f64; 2], Candidate)> = Vec::new();
    if let Some(layout) = Layout::new(scene) {
        let count = scene.terrain.extent.map(|e| (e / layout.tile_side).ceil() as i32);
        let total = AtomicUsize::new(0);
        let rows: Vec<Vec<([f64; 2], Candidate)>> = (0..count[1])
            .into_par_iter()
            .map(|y| {
                let mut row = Vec::new();
                for x in 0..count[0] {
                    let corner = [x, y].map(|v| f64::from(v) * layout.tile_side);
                    let inside = region.holds(corner, corner.map(|c| c + layout.tile_side));
                    if inside && total.load(Ordering::Relaxed) <= MOST_TREES {
                        let trees = layout.trees(scene, [x, y], 1);
                        total.fetch_add(trees.len(), Ordering::Relaxed);
                        row.extend(trees.into_iter().map(|t| (corner, t)));
                    }
                }
                row
            })
            .collect();
        found = rows.concat();
    }
    for (k, species) in scene.species.iter().enumerate() {
        let Distribution::Positions(list) = &species.distribution else { continue };
        for (index, tree) in list.iter().enumerate() {
            if found.len() <= MOST_TREES && region.holds([tree.x, tree.y], [tree.x, tree.y]) {
                let mut one = listed(scene, k as u32, index as u32, tree);
                one.position = [0.0; 2];
                found.push(([tree.x, tree.y], one));
            }
        }
    }
    if found.len() > MOST_TREES {
        return Err(Error::Usage(format!(
            "the reference would need more than {MOST_TREES} trees for what is seen from here; look at less ground, or at \
             fewer trees"
        )));
    }
    let place = |(corner, t): &([f64; 2], Candidate)| {
        DVec3::new(corner[0] + f64::from(t.position[0]), corner[1] + f64::from(t.position[1]), t.ground)
    };
    let (low, high) = found
        .iter()
        .map(place)
        .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(a, b), p| (a.min(p), b.max(p)));
    // Whole metres, so that a place has the same bits from it wherever it is.
    let origin = if found.is_empty() { DVec3::ZERO } else { (0.5 * (low + high)).round() };
    let trees = found
        .iter()
        .map(|f| {
            let (sin, cos) = f.1.turn().sin_cos();
            Tree {
                base: (place(f) - origin).as_vec3(),
                scale: f.1.scale,
                turn: [cos as f32, sin as f32],
                tint: f.1.tint() as f32,
                species: f.1.species,
            }
        })
        .collect();
    Ok((trees, origin))
}

/// What ground matters.
struct Region<'a> {
    eyes: Vec<(&'a Eye, Vec<[f64; 4]>)>,
    tree: Quadtree,
    /// Where the light of a tree's surroundings reaches from it: horizontally, and up and down, m.
    around: f64,
    /// How far, and which way, shadows reach, m.
    shadow: [f64; 2],
    tallest: f64,
}

impl<'a> Region<'a> {
    fn new(scene: &Scene, eyes: &'a [Eye], sun: [f64; 3]) -> Self {
        let tree = Quadtree::new(&scene.terrain, 160.0);
        let tallest = scene.species.iter().map(tallest).fold(0.0, f64::max);
        let [low, high] = tree.total_range();
        let has_sun = sun_disc_fraction(scene.sun.elevation) > 0.0;
        let tall = tallest + 0.25 * (high - low);
        let length = if has_sun { tall * (1.0 / sun[2]).min(LONGEST_SHADOW) } else { 0.0 };
        let shadow = [0, 1].map(|k| -sun[k] * length);
        let eyes = eyes.iter().map(|e| (e, e.planes())).collect();
        Region { eyes, tree, around: LIGHT_REACH * tallest, shadow, tallest }
    }

    /// Whether trees on a rectangle of ground matter.
    fn holds(&self, low: [f64; 2], high: [f64; 2]) -> bool {
        let ground = self.tree.ground_bounds(low, high);
        let (mut low, mut high) = (ground.low, ground.high);
        for k in 0..2 {
            low[k] += self.shadow[k].min(0.0) - self.around;
            high[k] += self.shadow[k].max(0.0) + self.around;
        }
        low[2] -= self.around;
        high[2] += self.tallest + self.around;
        let bounds = Bounds { low, high };
        self.eyes.iter().any(|(eye, planes)| {
            bounds.touches(planes, eye.position) || bounds.distance(eye.position) <= self.around
        })
    }
}

/// Height of the tallest tree of a species, or its reach to a side if that is more, m.
fn tallest(species: &crate::scene::Species) -> f64 {
    let reach = species.mesh.positions.iter().map(|p| p[0].hypot(p[1]).max(p[2])).fold(0.0, f32::max);
    f64::from(reach * species.largest_scale() as f32)
}
