//! What rays meet: the ground, the trees on it, and behind them the sky.

use std::sync::Arc;

use glam::{DVec3, Vec3};

use super::ground::Ground;
use super::key::Key;
use super::trees;
use crate::bake::foliage::Foliage;
use crate::bake::grove::Grove;
use crate::camera::{Eye, Light};
use crate::rays::Stack;
use crate::scene::{Scene, Sky};
use crate::{Error, Result};

/// Rays leave the ground at this height, m: far above the rounding of doubles, and so low that next to a crease hardly any
/// starts under the other side of it.
const GROUND_STEP: f64 = 1e-6;

/// A scene as light meets it: the species' own triangles on the renderer's own seeds, around what some eyes see.
pub struct World {
    ground: Ground,
    grove: Grove,
    /// That of the grove.
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
    /// [`crate::Error::Usage`] for a scene with wind, when that takes more than [`trees::MOST_TREES`] trees, or for a mesh without extent.
    pub fn new(scene: &Scene, eyes: &[Eye]) -> Result<Self> {
        if scene.wind.is_some() {
            return Err(Error::Usage(
                "the reference knows no wind, and its trees stand still: leave out [wind], or give it a speed of 0".into(),
            ));
        }
        let light = Light::new(scene);
        let (trees, origin) = trees::collect(scene, eyes, light.direction)?;
        let foliage = |s: &crate::scene::Species| Ok(Arc::new(Foliage::new(&s.mesh, &s.optics)?));
        let species = scene.species.iter().map(foliage).collect::<Result<Vec<_>>>()?;
        Ok(World {
            ground: Ground::new(&scene.terrain),
            key: Key::of_world(scene, &trees),
            grove: Grove::new(species, trees),
            sky: SkyLight::new(&scene.sky),
            origin,
            light,
        })
    }

    /// The same with every tree in the mean colours of its species, which the renderer varies a little from tree to tree.
    pub fn without_tints(mut self) -> Self {
        self.grove.trees.iter_mut().for_each(|t| t.tint = 1.0);
        self.key.note("tints of trees", b"none");
        self
    }

    /// Number of trees.
    pub fn tree_count(&self) -> usize {
        self.grove.trees.len()
    }

    /// Triangles of all species' meshes, each counted once.
    pub fn triangle_count(&self) -> usize {
        self.grove.triangles()
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
        self.grove.occluded(o, direction.as_vec3(), stack)
    }

    /// Where a ray comes to the box of all trees: its parameter, and the place from the world's origin. Rays from far away
    /// keep their precision so.
    fn to_trees(&self, origin: DVec3, direction: DVec3) -> Option<(f64, Vec3)> {
        let (lowest, highest) = self.grove.bounds()?;
        let o = origin - self.origin;
        let (mut enter, mut leave) = (0.0f64, f64::INFINITY);
        for k in 0..3 {
            let (low, high) = (f64::from(lowest[k]), f64::from(highest[k]));
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
        let limit = (end - from).min(f64::from(f32::MAX)) as f32;
        let (tree, met) = self.grove.nearest(o, direction.as_vec3(), limit, stack)?;
        let leaf = self.grove.leaf(tree, &met, direction);
        Some(Hit {
            t: from + f64::from(met.t),
            at: self.origin + leaf.point.as_dvec3(),
            normal: leaf.normal,
            step: leaf.step,
            reflectance: leaf.reflectance,
            transmittance: leaf.transmittance,
            species: Some(leaf.species),
            thin: leaf.thin,
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
