//! Trees that stand, as rays meet them: each a species' mesh, turned about its trunk and scaled.

use std::sync::Arc;

use glam::{DVec3, Vec3};

use super::foliage::Foliage;
use crate::rays::{Hierarchy, Met, Stack};

/// Rays leave a tree's surface at this part of the tree's size, against meeting it again.
const LEAST_STEP: f64 = 1e-5;
/// And at this part of their distance from the grove's origin, for its coordinates are singles.
const ROUNDING: f64 = 2.5e-7;

/// A tree of a grove.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tree {
    /// Base of the trunk, m from the grove's origin.
    pub base: Vec3,
    /// Scale.
    pub scale: f32,
    /// Cosine and sine of the rotation, counterclockwise seen from above.
    pub turn: [f32; 2],
    /// Factor of its colours.
    pub tint: f32,
    /// Index of its species.
    pub species: u32,
}

impl Tree {
    /// A place of the grove, from the trunk's base, as the tree's mesh has it; directions likewise.
    pub fn to_mesh(self, p: Vec3) -> Vec3 {
        let ([c, s], inverse) = (self.turn, 1.0 / self.scale);
        Vec3::new(c * p.x + s * p.y, c * p.y - s * p.x, p.z) * inverse
    }

    /// A direction of the mesh in the grove, times the scale.
    pub fn to_grove(self, p: Vec3) -> Vec3 {
        let [c, s] = self.turn;
        Vec3::new(c * p.x - s * p.y, s * p.x + c * p.y, p.z) * self.scale
    }

    /// Bounds from the grove's origin.
    fn bounds(&self, foliage: &Foliage) -> (Vec3, Vec3) {
        let (low, high) = foliage.bounds(self.turn);
        // Rounding of the corners' turn.
        let room = 1e-5 * self.scale * low.abs().max(high.abs()).max_element();
        (self.base + low * self.scale - room, self.base + high * self.scale + room)
    }
}

/// A surface of a tree that a ray met.
#[derive(Clone, Copy, Debug)]
pub struct Leaf {
    /// Place, m from the grove's origin.
    pub point: Vec3,
    /// Unit normal, on the side that the ray came from.
    pub normal: DVec3,
    /// How far above the surface a ray starts that leaves it, m.
    pub step: f64,
    /// Diffuse reflectance.
    pub reflectance: Vec3,
    /// Diffuse transmittance.
    pub transmittance: Vec3,
    /// Index of the species.
    pub species: u32,
    /// Whether light passes through it; bark is solid.
    pub thin: bool,
}

/// Trees of some species.
pub struct Grove {
    species: Vec<Arc<Foliage>>,
    /// The trees.
    pub trees: Vec<Tree>,
    top: Hierarchy,
}

impl Grove {
    /// Builds the hierarchy over the trees.
    pub fn new(species: Vec<Arc<Foliage>>, trees: Vec<Tree>) -> Self {
        let boxes: Vec<(Vec3, Vec3)> = trees.iter().map(|t| t.bounds(&species[t.species as usize])).collect();
        Grove { top: Hierarchy::new(&boxes, 1, |tree| tree[0]), species, trees }
    }

    /// Corners of the box of all trees, m from the origin; `None` without trees.
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        (!self.top.is_empty()).then_some((self.top.low, self.top.high))
    }

    /// Triangles of all species' meshes, each counted once.
    pub fn triangles(&self) -> usize {
        self.species.iter().map(|s| s.triangles()).sum()
    }

    /// The nearest surface along a ray between 0 and `end`: its tree's index, and where on it.
    pub fn nearest(&self, origin: Vec3, direction: Vec3, end: f32, stack: &mut Stack) -> Option<(u32, Met)> {
        let mut found = None;
        self.top.walk(origin, direction, end, stack, |stack, k, t_max| {
            let met = self.nearest_of(k, origin, direction, t_max, stack);
            met.map_or(t_max, |met| {
                let t = met.t;
                found = Some((k, met));
                t
            })
        });
        found
    }

    /// The nearest surface of one tree along a ray between 0 and `end`.
    pub fn nearest_of(
        &self,
        tree: u32,
        origin: Vec3,
        direction: Vec3,
        end: f32,
        stack: &mut Stack,
    ) -> Option<Met> {
        let tree = &self.trees[tree as usize];
        // The direction keeps its length in metres of the grove, so t is the same in both.
        let (o, d) = (tree.to_mesh(origin - tree.base), tree.to_mesh(direction));
        self.species[tree.species as usize].nearest(o, d, end, stack)
    }

    /// Whether any tree is on a ray.
    pub fn occluded(&self, origin: Vec3, direction: Vec3, stack: &mut Stack) -> bool {
        self.occluded_by_others(u32::MAX, origin, direction, stack)
    }

    /// Whether any tree but one, by its index, is on a ray.
    pub fn occluded_by_others(&self, own: u32, origin: Vec3, direction: Vec3, stack: &mut Stack) -> bool {
        let end = self.top.walk(origin, direction, f32::MAX, stack, |stack, k, t_max| {
            if k == own {
                return t_max;
            }
            let tree = &self.trees[k as usize];
            let (o, d) = (tree.to_mesh(origin - tree.base), tree.to_mesh(direction));
            if self.species[tree.species as usize].occludes(o, d, stack) { -1.0 } else { t_max }
        });
        end < 0.0
    }

    /// The surface that a ray along `direction` met there.
    pub fn leaf(&self, tree: u32, met: &Met, direction: DVec3) -> Leaf {
        let tree = &self.trees[tree as usize];
        let foliage = &self.species[tree.species as usize];
        let point = tree.base + tree.to_grove(foliage.point(met));
        let normal = tree.to_grove(foliage.normal(met.face)).as_dvec3().normalize();
        let thin = foliage.is_leaf(met.face);
        let colours = &foliage.colours;
        let (r, t) = if thin {
            (Vec3::from(colours.reflectance), Vec3::from(colours.transmittance))
        } else {
            (Vec3::from(colours.bark_reflectance), Vec3::ZERO)
        };
        // No tint makes a surface scatter more than it gets.
        let tint = (Vec3::splat(tree.tint)).min((r + t).max(Vec3::splat(1e-6)).recip());
        let size = f64::from(tree.scale * foliage.reach());
        Leaf {
            point,
            normal: if normal.dot(direction) > 0.0 { -normal } else { normal },
            step: LEAST_STEP * size + ROUNDING * f64::from(point.abs().max_element()),
            reflectance: r * tint,
            transmittance: t * tint,
            species: tree.species,
            thin,
        }
    }
}
