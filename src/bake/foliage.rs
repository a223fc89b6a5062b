//! The surface of one species as rays meet it: triangles four at a time, through the leaf masks.

use std::collections::HashSet;

use glam::{Vec2, Vec3};

use super::optics::{Colours, colours};
use super::surface::Surface;
use crate::Result;
use crate::rays::{Met, Stack, Triangles};
use crate::scene::{Mesh, OpticsOverride};

/// A species: its mesh in a hierarchy, and its reflectances.
#[derive(Clone, Debug)]
pub struct Foliage {
    surface: Surface,
    /// Unit normals of the faces.
    normals: Vec<Vec3>,
    /// Whether each material is leaves.
    leaves: Vec<bool>,
    triangles: Triangles,
    /// Reflectances, as the renderer has them.
    pub colours: Colours,
    /// Convex hull of the mesh as seen from above, m.
    hull: Vec<Vec2>,
}

impl Foliage {
    /// Builds the hierarchy of a species' mesh.
    ///
    /// # Errors
    /// [`crate::Error::Usage`] for a mesh without extent.
    pub fn new(mesh: &Mesh, optics: &OpticsOverride) -> Result<Self> {
        let mut surface = Surface::new(mesh)?;
        let colours = colours(mesh, &surface, optics);
        // A card modelled as two triangles, one for each side, is one leaf.
        let mut seen = HashSet::new();
        surface.faces.retain(|f| {
            let mut key = f.p.map(|p| p.to_array().map(f32::to_bits));
            key.sort_unstable();
            !mesh.materials[f.material as usize].foliage || seen.insert(key)
        });
        let corners: Vec<[Vec3; 3]> =
            surface.faces.iter().map(|f| f.p.map(|p| surface.frame.to_metres(p))).collect();
        Ok(Foliage {
            normals: corners.iter().map(|[a, b, c]| (*b - *a).cross(*c - *a).normalize_or(Vec3::Z)).collect(),
            leaves: mesh.materials.iter().map(|m| m.foliage).collect(),
            surface,
            triangles: Triangles::new(&corners),
            colours,
            hull: hull(corners.iter().flatten().map(|p| p.truncate()).collect()),
        })
    }

    /// Farthest coordinate of the mesh from the trunk's base, m.
    pub fn reach(&self) -> f32 {
        let (low, high) = self.triangles.bounds();
        low.abs().max(high.abs()).max_element()
    }

    /// Number of triangles.
    pub fn triangles(&self) -> usize {
        self.normals.len()
    }

    /// Bounds of the tree turned counterclockwise by an angle of this cosine and sine.
    pub fn bounds(&self, [c, s]: [f32; 2]) -> (Vec3, Vec3) {
        let (mut low, mut high) = (Vec2::INFINITY, Vec2::NEG_INFINITY);
        for p in &self.hull {
            let turned = Vec2::new(c * p.x - s * p.y, s * p.x + c * p.y);
            (low, high) = (low.min(turned), high.max(turned));
        }
        let (lowest, highest) = self.triangles.bounds();
        (low.extend(lowest.z), high.extend(highest.z))
    }

    /// The nearest surface along a ray between 0 and `t_max`.
    pub fn nearest(&self, origin: Vec3, direction: Vec3, t_max: f32, stack: &mut Stack) -> Option<Met> {
        let opaque = |face, u, v| self.surface.is_at(face, u, v);
        self.triangles.nearest(origin, direction, t_max, stack, opaque)
    }

    /// Whether any surface is on a ray beyond 0.
    pub fn occludes(&self, origin: Vec3, direction: Vec3, stack: &mut Stack) -> bool {
        let opaque = |face, u, v| self.surface.is_at(face, u, v);
        self.triangles.occluded(origin, direction, 0.0, stack, opaque)
    }

    /// Unit normal of a face.
    pub fn normal(&self, face: u32) -> Vec3 {
        self.normals[face as usize]
    }

    /// Whether a face is a leaf, and not bark.
    pub fn is_leaf(&self, face: u32) -> bool {
        self.leaves[self.surface.faces[face as usize].material as usize]
    }

    /// The point of a face with these barycentric coordinates, m.
    pub fn point(&self, met: &Met) -> Vec3 {
        let [a, b, c] = self.surface.faces[met.face as usize].p.map(|p| self.surface.frame.to_metres(p));
        a + (b - a) * met.at[0] + (c - a) * met.at[1]
    }
}

/// Convex hull by Andrew's monotone chains.
fn hull(mut points: Vec<Vec2>) -> Vec<Vec2> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup();
    let chain = |points: &mut dyn Iterator<Item = &Vec2>| {
        let mut chain: Vec<Vec2> = Vec::new();
        for p in points {
            while let [.., a, b] = chain[..]
                && (b - a).perp_dot(*p - a) <= 0.0
            {
                chain.pop();
            }
            chain.push(*p);
        }
        chain
    };
    let mut all = chain(&mut points.iter());
    all.extend(chain(&mut points.iter().rev()));
    all
}
