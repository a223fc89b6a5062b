//! What rays meet: the ground, the trees on it, and behind them the sky.

use std::sync::Arc;

use glam::{DVec3, Vec3};

use super::foliage::Foliage;
use super::ground::Ground;
use super::key::Key;
use super::trees::{self, Tree};
use crate::Result;
use crate::camera::{Eye, Light};
use crate::rays::{Hierarchy, Stack};
use crate::scene::{Scene, Sky};

/// Rays leave a tree's surface at this part of the tree's size, against meeting it again.
const LEAST_STEP: f64 = 1e-5;
/// And at this part of their distance from the world's origin, for its coordinates are singles.
const ROUNDING: f64 = 2.5e-7;
/// Rays leave the ground at this height, m: far above the rounding of doubles, and so low that next to a crease hardly any
/// starts under the other side of it.
const GROUND_STEP: f64 = 1e-6;

/// A scene as light meets it: the species' own triangles on the renderer's own seeds, around what some eyes see.
pub struct World {
    ground: Ground,
    species: Vec<Foliage>,
    trees: Vec<Tree>,
    top: Hierarchy,
    origin: DVec3,
    pub(super) light: Light,
    pub(super) sky: SkyLight,
    pub(super) key: Key,
}

/// A surface that a ray met.
#[derive(Clone, Copy, Debug)]
pub(super) struct Hit {
    /// Distance along the ray, m.
    pub t: f64,
    /// Place, m from the terrain's south-west corner.
    pub at: DVec3,
    /// Unit normal, on the side that the ray came from.
    pub normal: DVec3,
    /// How far above the surface a ray starts that leaves it, m.
    pub step: f64,
    /// Diffuse reflectance.
    pub reflectance: Vec3,
    /// Diffuse transmittance.
    pub transmittance: Vec3,
    /// Species, if it is a tree.
    pub species: Option<u32>,
    /// Whether light passes through it.
    pub thin: bool,
}

impl World {
    /// The world around what these eyes see.
    ///
    /// # Errors
    /// [`crate::Error::Usage`] when that takes more than [`trees::MOST_TREES`] trees, or for a mesh without extent.
    pub fn new(scene: &Scene, eyes: &[Eye]) -> Result<Self> {
        let light = Light::new(scene);
        let (trees, origin) = trees::collect(scene, eyes, light.direction)?;
        let species = scene.species.iter().map(Foliage::new).collect::<Result<Vec<_>>>()?;
        let boxes: Vec<(Vec3, Vec3)> = trees.iter().map(|t| t.bounds(&species[t.species as usize])).collect();
        Ok(World {
            ground: Ground::new(&scene.terrain),
            top: Hierarchy::new(&boxes, 1, |tree| tree[0]),
            key: Key::of_world(scene, &trees),
            sky: SkyLight::new(&scene.sky),
            species,
            trees,
            origin,
            light,
        })
    }

    /// The same with every tree in the mean colours of its species, which the renderer varies a little from tree to tree.
    pub fn without_tints(mut self) -> Self {
        self.trees.iter_mut().for_each(|t| t.tint = 1.0);
        self.key.note("tints of trees", b"none");
        self
    }

    /// Number of trees.
    pub fn tree_count(&self) -> usize {
        self.trees.len()
    }

    /// Triangles of all species' meshes, each counted once.
    pub fn triangle_count(&self) -> usize {
        self.species.iter().map(Foliage::triangles).sum()
    }

    /// The nearest surface along a ray.
    pub(super) fn nearest(&self, origin: DVec3, direction: DVec3, stack: &mut Stack) -> Option<Hit> {
        let ground = self.ground.nearest(origin, direction, f64::INFINITY);
        let end = ground.map_or(f64::INFINITY, |g| g.0);
        if let Some(hit) = self.nearest_tree(origin, direction, end, stack) {
            return Some(hit);
        }
        ground.map(|(t, normal)| {
            let at = origin + direction * t;
            Hit {
                t,
                at,
                normal,
                step: GROUND_STEP,
                reflectance: Vec3::from(self.ground.albedo(at.x, at.y)),
                transmittance: Vec3::ZERO,
                species: None,
                thin: false,
            }
        })
    }

    /// Whether anything is on a ray.
    pub(super) fn occluded(&self, origin: DVec3, direction: DVec3, stack: &mut Stack) -> bool {
        if self.ground.nearest(origin, direction, f64::INFINITY).is_some() {
            return true;
        }
        let Some((_, o)) = self.to_trees(origin, direction) else { return false };
        let d = direction.as_vec3();
        let end = self.top.walk(o, d, f32::MAX, stack, |stack, k, t_max| {
            let tree = &self.trees[k as usize];
            let (o, d) = (tree.to_mesh(o - tree.base), tree.to_mesh(d));
            if self.species[tree.species as usize].occludes(o, d, stack) { -1.0 } else { t_max }
        });
        end < 0.0
    }

    /// Where a ray comes to the box of all trees: its parameter, and the place from the world's origin. Rays from far away
    /// keep their precision so.
    fn to_trees(&self, origin: DVec3, direction: DVec3) -> Option<(f64, Vec3)> {
        if self.top.is_empty() {
            return None;
        }
        let o = origin - self.origin;
        let (mut enter, mut leave) = (0.0f64, f64::INFINITY);
        for k in 0..3 {
            let (low, high) = (f64::from(self.top.low[k]), f64::from(self.top.high[k]));
            if direction[k] == 0.0 {
                if o[k] < low || o[k] > high {
                    return None;
                }
                continue;
            }
            let (a, b) = ((low - o[k]) / direction[k], (high - o[k]) / direction[k]);
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b));
        }
        (enter <= leave).then(|| (enter, (o + direction * enter).as_vec3()))
    }

    fn nearest_tree(&self, origin: DVec3, direction: DVec3, end: f64, stack: &mut Stack) -> Option<Hit> {
        let (from, o) = self.to_trees(origin, direction).filter(|(from, _)| *from < end)?;
        let d = direction.as_vec3();
        let mut found = None;
        let limit = (end - from).min(f64::from(f32::MAX)) as f32;
        self.top.walk(o, d, limit, stack, |stack, k, t_max| {
            let tree = &self.trees[k as usize];
            // The direction keeps its length in metres of the world, so t is the same in both.
            let (o, d) = (tree.to_mesh(o - tree.base), tree.to_mesh(d));
            match self.species[tree.species as usize].nearest(o, d, t_max, stack) {
                Some(met) => {
                    found = Some((k, met));
                    met.t
                }
                None => t_max,
            }
        });
        let (k, met) = found?;
        let tree = &self.trees[k as usize];
        let foliage = &self.species[tree.species as usize];
        let point = (tree.base + tree.to_world(foliage.point(&met))).as_dvec3();
        let normal = tree.to_world(foliage.normal(met.face)).as_dvec3().normalize();
        let thin = foliage.is_leaf(met.face);
        let colours = &foliage.colours;
        let (mut r, mut t) = if thin {
            (Vec3::from(colours.reflectance), Vec3::from(colours.transmittance))
        } else {
            (Vec3::from(colours.bark_reflectance), Vec3::ZERO)
        };
        // No tint makes a surface scatter more than it gets.
        let tint = (Vec3::splat(tree.tint)).min((r + t).max(Vec3::splat(1e-6)).recip());
        (r, t) = (r * tint, t * tint);
        let size = f64::from(tree.scale * foliage.reach());
        Some(Hit {
            t: from + f64::from(met.t),
            at: self.origin + point,
            normal: if normal.dot(direction) > 0.0 { -normal } else { normal },
            step: LEAST_STEP * size + ROUNDING * point.abs().max_element(),
            reflectance: r,
            transmittance: t,
            species: Some(tree.species),
            thin,
        })
    }
}

/// Radiance of the sky by direction.
pub(super) enum SkyLight {
    Uniform(Vec3),
    Image { width: usize, height: usize, pixels: Arc<Vec<f32>> },
}

impl SkyLight {
    fn new(sky: &Sky) -> Self {
        match sky {
            Sky::Uniform(c) => SkyLight::Uniform(Vec3::from(*c)),
            Sky::LatLong { width, height, pixels } => {
                SkyLight::Image { width: *width as usize, height: *height as usize, pixels: pixels.clone() }
            }
        }
    }

    /// As `shaders/frame/sky.glsl`: row 0 at the zenith, column 0 at north, turning east; bilinear, around the horizon without
    /// a seam.
    pub fn radiance(&self, d: DVec3) -> Vec3 {
        match self {
            SkyLight::Uniform(c) => *c,
            SkyLight::Image { width, height, pixels } => {
                let east = d.x.atan2(d.y) / std::f64::consts::TAU;
                let down = d.truncate().length().atan2(d.z) / std::f64::consts::PI;
                let x = east.rem_euclid(1.0) * *width as f64 - 0.5;
                let y = (down * *height as f64 - 0.5).clamp(0.0, *height as f64 - 1.0);
                let column = |k: f64| k.rem_euclid(*width as f64) as usize % width;
                let row = |k: f64| (k as usize).min(height - 1);
                let at = |x: usize, y: usize| {
                    let k = 3 * (y * width + x);
                    Vec3::new(pixels[k], pixels[k + 1], pixels[k + 2])
                };
                let (x0, x1, fx) = (column(x.floor()), column(x.floor() + 1.0), (x - x.floor()) as f32);
                let (y0, y1, fy) = (row(y.floor()), row(y.floor() + 1.0), (y - y.floor()) as f32);
                at(x0, y0).lerp(at(x1, y0), fx).lerp(at(x0, y1).lerp(at(x1, y1), fx), fy)
            }
        }
    }
}
