//! Rays against a tree's surface, through the leaf masks.
//!
//! The `bvh` crate builds the hierarchy; it is walked here as a flat list, because the crate's own iterators
//! either collect every leaf that a ray's box touches or keep a stack of 32 nodes, which a degenerate mesh
//! overflows.

use bvh::aabb::{Aabb, Bounded};
use bvh::bounding_hierarchy::BHShape;
use bvh::bvh::Bvh;
use glam::Vec3;

use super::surface::Surface;

/// A box, and its place in the crate's tree.
pub(crate) struct Shape {
    low: Vec3,
    high: Vec3,
    node: usize,
}

impl Shape {
    /// A box by its lowest and highest corner.
    pub(crate) fn new(low: Vec3, high: Vec3) -> Self {
        Shape { low, high, node: 0 }
    }
}

impl Bounded<f32, 3> for Shape {
    fn aabb(&self) -> Aabb<f32, 3> {
        Aabb::with_bounds(self.low.to_array().into(), self.high.to_array().into())
    }
}

impl BHShape<f32, 3> for Shape {
    fn set_bh_node_index(&mut self, index: usize) {
        self.node = index;
    }

    fn bh_node_index(&self) -> usize {
        self.node
    }
}

/// A node of the flat hierarchy: an inner one goes on to the next node if its box is hit and else to `exit`.
struct Node {
    low: Vec3,
    high: Vec3,
    exit: u32,
    /// Face index at a leaf; `u32::MAX` inside.
    face: u32,
}

/// A hierarchy over the faces of a surface, in metres.
pub struct Rays<'a> {
    surface: &'a Surface,
    corners: Vec<[Vec3; 3]>,
    nodes: Vec<Node>,
}

impl<'a> Rays<'a> {
    /// Builds the hierarchy.
    pub fn new(surface: &'a Surface) -> Self {
        let corners: Vec<[Vec3; 3]> =
            surface.faces.iter().map(|f| f.p.map(|p| surface.frame.to_metres(p))).collect();
        let mut shapes: Vec<Shape> =
            corners.iter().map(|[a, b, c]| Shape::new(a.min(*b).min(*c), a.max(*b).max(*c))).collect();
        // Sequential on purpose: the order of nodes is then the same every time.
        let nodes = Bvh::build(&mut shapes).flatten_custom(&|aabb: &Aabb<f32, 3>, entry, exit, face| Node {
            low: Vec3::new(aabb.min[0], aabb.min[1], aabb.min[2]),
            high: Vec3::new(aabb.max[0], aabb.max[1], aabb.max[2]),
            exit,
            face: if entry == u32::MAX { face } else { u32::MAX },
        });
        Rays { surface, corners, nodes }
    }

    /// Whether any surface lies on the ray beyond the parameter `t_min`.
    pub fn occluded(&self, origin: Vec3, direction: Vec3, t_min: f32) -> bool {
        let inverse = direction.recip();
        let mut index = 0;
        while let Some(node) = self.nodes.get(index) {
            if node.face != u32::MAX {
                if self.hits(node.face, origin, direction, t_min) {
                    return true;
                }
                index += 1;
                continue;
            }
            // Slabs. A ray in the plane of a slab gives 0·∞ = NaN, which min and max pass over.
            let (t0, t1) = ((node.low - origin) * inverse, (node.high - origin) * inverse);
            let (near, far) = (t0.min(t1).max_element(), t0.max(t1).min_element());
            let enters = near <= far * (1.0 + 4.0 * f32::EPSILON) && far >= t_min;
            index = if enters { index + 1 } else { node.exit as usize };
        }
        false
    }

    /// The first surface on the ray, if there is any: its parameter, and the index of its face.
    pub fn first(&self, origin: Vec3, direction: Vec3) -> Option<(f32, u32)> {
        let inverse = direction.recip();
        let (mut index, mut first) = (0, (f32::INFINITY, 0));
        while let Some(node) = self.nodes.get(index) {
            if node.face != u32::MAX {
                if let Some(t) = self.hit(node.face, origin, direction).filter(|t| *t > 0.0 && *t < first.0) {
                    first = (t, node.face);
                }
                index += 1;
                continue;
            }
            let (t0, t1) = ((node.low - origin) * inverse, (node.high - origin) * inverse);
            let (near, far) = (t0.min(t1).max_element(), t0.max(t1).min_element());
            let enters = near <= far * (1.0 + 4.0 * f32::EPSILON) && far >= 0.0 && near <= first.0;
            index = if enters { index + 1 } else { node.exit as usize };
        }
        first.0.is_finite().then_some(first)
    }

    /// Unit normal of a face, to either side.
    pub fn normal(&self, face: u32) -> Vec3 {
        let [a, b, c] = self.corners[face as usize];
        (b - a).cross(c - a).normalize_or_zero()
    }

    fn hits(&self, face: u32, origin: Vec3, direction: Vec3, t_min: f32) -> bool {
        self.hit(face, origin, direction).is_some_and(|t| t > t_min)
    }

    /// Möller and Trumbore's intersection, then the mask: the parameter on the ray.
    fn hit(&self, face: u32, origin: Vec3, direction: Vec3) -> Option<f32> {
        let [a, b, c] = self.corners[face as usize];
        let (e1, e2) = (b - a, c - a);
        let p = direction.cross(e2);
        let det = e1.dot(p);
        if det == 0.0 {
            return None;
        }
        let inverse = 1.0 / det;
        let s = origin - a;
        let u = s.dot(p) * inverse;
        let q = s.cross(e1);
        let v = direction.dot(q) * inverse;
        if u < 0.0 || v < 0.0 || u + v > 1.0 {
            return None;
        }
        let f = &self.surface.faces[face as usize];
        let there = self.surface.opaque(f, f.uv[0] * (1.0 - u - v) + f.uv[1] * u + f.uv[2] * v);
        there.then_some(e2.dot(q) * inverse)
    }
}
