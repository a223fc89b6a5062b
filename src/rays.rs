//! Rays against boxes and triangles: bounding-volume hierarchies four boxes wide, walked front to back. Bakes and the reference
//! cast all their rays through them.
//!
//! The `bvh` crate builds them by the surface-area heuristic (two children a node, one shape a leaf). Its own iterators
//! allocate, and visit either everything that a ray's box touches or one box after the other; so its tree is folded here:
//! a node holds the boxes of up to four descendants, tested together, and subtrees of a few shapes are one leaf.

mod triangles;

use bvh::aabb::{Aabb, Bounded};
use bvh::bounding_hierarchy::BHShape;
use bvh::bvh::{Bvh, BvhNode};
use glam::{Vec3, Vec4};

pub use triangles::{Met, Triangles};

/// Boxes of a node.
const WIDTH: usize = 4;
/// Marks a child that is a leaf; the other bits are its index.
const LEAF: u32 = 1 << 31;
/// A ray enters a box that it touches within the rounding of its three products and differences.
const SLACK: f32 = 1.0 + 8.0 * f32::EPSILON;

/// A box, and its place in the crate's tree.
struct Shape {
    low: Vec3,
    high: Vec3,
    node: usize,
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

/// Two cache lines.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
struct Node {
    /// Low x, y, z and high x, y, z of the four boxes; a box that is not there is inside out, and never hit.
    planes: [Vec4; 6],
    children: [u32; WIDTH],
}

/// What a walk has still to visit: nodes or leaves, and where the ray enters their boxes. Walks may nest in one stack.
pub type Stack = Vec<(u32, f32)>;

/// A hierarchy over boxes.
#[derive(Clone, Debug)]
pub struct Hierarchy {
    nodes: Vec<Node>,
    root: u32,
    /// Smallest corner of all boxes.
    pub low: Vec3,
    /// Largest corner of all boxes.
    pub high: Vec3,
}

impl Hierarchy {
    /// Builds a hierarchy over (low, high) boxes. `leaf` takes the indices of up to `most` boxes and returns the number
    /// by which [`Hierarchy::walk`] names them.
    pub fn new(boxes: &[(Vec3, Vec3)], most: usize, mut leaf: impl FnMut(&[u32]) -> u32) -> Self {
        let mut shapes: Vec<Shape> = boxes.iter().map(|&(low, high)| Shape { low, high, node: 0 }).collect();
        // Sequential: the order of nodes is then the same every time.
        let tree = if shapes.is_empty() { Vec::new() } else { Bvh::build(&mut shapes).nodes };
        drop(shapes);
        let all = boxes.iter();
        let low = all.clone().fold(Vec3::INFINITY, |a, b| a.min(b.0));
        let high = all.fold(Vec3::NEG_INFINITY, |a, b| a.max(b.1));
        let mut hierarchy = Hierarchy { nodes: Vec::new(), root: 0, low, high };
        if tree.is_empty() {
            return hierarchy;
        }
        // Children stand behind their parents.
        let mut counts = vec![1u32; tree.len()];
        for (k, node) in tree.iter().enumerate().rev() {
            if let BvhNode::Node { child_l_index, child_r_index, .. } = node {
                counts[k] = counts[*child_l_index] + counts[*child_r_index];
            }
        }
        let mut shapes = Vec::new();
        let mut make_leaf = |k: usize| {
            shapes.clear();
            collect(&tree, k, &mut shapes);
            LEAF | leaf(&shapes)
        };
        if counts[0] as usize <= most {
            hierarchy.root = make_leaf(0);
            return hierarchy;
        }
        // (place in the crate's tree, where its number belongs)
        let mut open = vec![(0usize, None::<(u32, usize)>)];
        while let Some((k, parent)) = open.pop() {
            let index = if counts[k] as usize <= most {
                make_leaf(k)
            } else {
                let index = hierarchy.nodes.len() as u32;
                let (node, inner) = fold(&tree, k);
                hierarchy.nodes.push(node);
                open.extend(inner.iter().enumerate().map(|(lane, k)| (*k, Some((index, lane)))));
                index
            };
            if let Some((node, lane)) = parent {
                hierarchy.nodes[node as usize].children[lane] = index;
            }
        }
        hierarchy
    }

    /// Whether there is nothing in it.
    pub fn is_empty(&self) -> bool {
        self.low.x > self.high.x
    }

    /// Visits the leaves whose boxes the ray meets between 0 and `t_max`, about from front to back. `visit` gets the
    /// stack, a leaf's number and `t_max`, and returns the new `t_max`; a negative one ends the walk. Returns the last.
    #[inline]
    pub fn walk(
        &self,
        origin: Vec3,
        direction: Vec3,
        mut t_max: f32,
        stack: &mut Stack,
        mut visit: impl FnMut(&mut Stack, u32, f32) -> f32,
    ) -> f32 {
        if self.is_empty() {
            return t_max;
        }
        // Finite, so that no 0 * infinity is NaN.
        let tiny = |d: f32| if d.abs() < 1e-20 { 1e-20f32.copysign(d) } else { d };
        let inverse = Vec3::new(tiny(direction.x), tiny(direction.y), tiny(direction.z)).recip();
        let sides = [inverse.x >= 0.0, inverse.y >= 0.0, inverse.z >= 0.0];
        let (ox, oy, oz) = (Vec4::splat(origin.x), Vec4::splat(origin.y), Vec4::splat(origin.z));
        let (ix, iy, iz) = (Vec4::splat(inverse.x), Vec4::splat(inverse.y), Vec4::splat(inverse.z));
        let base = stack.len();
        let (mut index, mut entry) = (self.root, 0.0f32);
        loop {
            if index & LEAF != 0 {
                if entry <= t_max {
                    t_max = visit(stack, index & !LEAF, t_max);
                    if t_max < 0.0 {
                        stack.truncate(base);
                        return t_max;
                    }
                }
            } else {
                let node = &self.nodes[index as usize];
                let [lx, ly, lz, hx, hy, hz] = &node.planes;
                let (nx, fx) = if sides[0] { (lx, hx) } else { (hx, lx) };
                let (ny, fy) = if sides[1] { (ly, hy) } else { (hy, ly) };
                let (nz, fz) = if sides[2] { (lz, hz) } else { (hz, lz) };
                let enter = ((*nx - ox) * ix).max((*ny - oy) * iy).max(((*nz - oz) * iz).max(Vec4::ZERO));
                let leave = ((*fx - ox) * ix).min((*fy - oy) * iy).min((*fz - oz) * iz) * SLACK;
                let mut hit = (enter.cmple(leave) & enter.cmple(Vec4::splat(t_max))).bitmask();
                if hit != 0 {
                    let enter = enter.to_array();
                    // The nearest is next; the others wait.
                    let lane = hit.trailing_zeros() as usize & 3;
                    hit &= hit - 1;
                    (index, entry) = (node.children[lane], enter[lane]);
                    while hit != 0 {
                        let lane = hit.trailing_zeros() as usize & 3;
                        hit &= hit - 1;
                        let other = (node.children[lane], enter[lane]);
                        if other.1 < entry {
                            stack.push((index, entry));
                            (index, entry) = other;
                        } else {
                            stack.push(other);
                        }
                    }
                    continue;
                }
            }
            loop {
                if stack.len() <= base {
                    return t_max;
                }
                let Some(next) = stack.pop() else { return t_max };
                if next.1 <= t_max {
                    (index, entry) = next;
                    break;
                }
            }
        }
    }
}

/// Indices of the shapes under a node.
fn collect(tree: &[BvhNode<f32, 3>], k: usize, shapes: &mut Vec<u32>) {
    match &tree[k] {
        BvhNode::Leaf { shape_index, .. } => shapes.push(*shape_index as u32),
        BvhNode::Node { child_l_index, child_r_index, .. } => {
            collect(tree, *child_l_index, shapes);
            collect(tree, *child_r_index, shapes);
        }
    }
}

/// A node of up to four of an inner node's descendants: the largest box is opened first.
fn fold(tree: &[BvhNode<f32, 3>], k: usize) -> (Node, Vec<usize>) {
    let children = |k: usize| match &tree[k] {
        BvhNode::Node { child_l_index, child_l_aabb, child_r_index, child_r_aabb, .. } => {
            vec![(*child_l_index, *child_l_aabb), (*child_r_index, *child_r_aabb)]
        }
        BvhNode::Leaf { .. } => Vec::new(),
    };
    let area = |b: &Aabb<f32, 3>| {
        let e: [f32; 3] = std::array::from_fn(|k| b.max[k] - b.min[k]);
        e[0] * e[1] + e[1] * e[2] + e[2] * e[0]
    };
    let mut all = children(k);
    while all.len() < WIDTH {
        let inner = all.iter().enumerate().filter(|(_, c)| matches!(tree[c.0], BvhNode::Node { .. }));
        let Some((largest, _)) = inner.max_by(|a, b| area(&a.1.1).total_cmp(&area(&b.1.1))) else { break };
        let (opened, _) = all.swap_remove(largest);
        all.extend(children(opened));
    }
    let plane = |f: &dyn Fn(&Aabb<f32, 3>) -> f32, none: f32| {
        Vec4::from_array(std::array::from_fn(|lane| all.get(lane).map_or(none, |c| f(&c.1))))
    };
    let planes = std::array::from_fn(|p| match p {
        0..3 => plane(&|b| b.min[p], f32::INFINITY),
        _ => plane(&|b| b.max[p - 3], f32::NEG_INFINITY),
    });
    (Node { planes, children: [0; WIDTH] }, all.iter().map(|c| c.0).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::hash::Stream;

    /// Slabs in doubles; where the ray enters.
    fn meets(low: Vec3, high: Vec3, o: Vec3, d: Vec3) -> Option<f64> {
        let (mut enter, mut leave) = (0.0f64, f64::INFINITY);
        for k in 0..3 {
            let (o, d) = (f64::from(o[k]), f64::from(d[k]));
            let (a, b) = ((f64::from(low[k]) - o) / d, (f64::from(high[k]) - o) / d);
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b));
        }
        (enter <= leave).then_some(enter)
    }

    #[test]
    fn every_box_on_the_ray_is_visited_and_the_nearest_among_the_first() {
        for (count, most) in [(1usize, 4), (3, 4), (5, 4), (700, 4), (700, 1)] {
            let mut random = Stream::new(count as u32);
            let mut point = |size: f64| Vec3::from_array([0; 3].map(|_| (size * random.unit()) as f32));
            let boxes: Vec<(Vec3, Vec3)> = (0..count)
                .map(|_| {
                    let low = point(50.0);
                    (low, low + point(4.0))
                })
                .collect();
            let mut leaves: Vec<Vec<u32>> = Vec::new();
            let hierarchy = Hierarchy::new(&boxes, most, |l| {
                leaves.push(l.to_vec());
                leaves.len() as u32 - 1
            });
            let mut held: Vec<u32> = leaves.concat();
            held.sort_unstable();
            assert!(held.iter().copied().eq(0..count as u32), "each box in one leaf");
            assert!(leaves.iter().all(|l| l.len() <= most));
            let mut stack = Stack::new();
            for _ in 0..300 {
                let (o, d) = (point(60.0), point(2.0) - Vec3::ONE);
                let mut seen = vec![false; count];
                hierarchy.walk(o, d, f32::INFINITY, &mut stack, |_, leaf, t| {
                    leaves[leaf as usize].iter().for_each(|b| seen[*b as usize] = true);
                    t
                });
                let mut nearest = (f64::INFINITY, 0);
                for (k, (low, high)) in boxes.iter().enumerate() {
                    if let Some(t) = meets(*low, *high, o, d) {
                        assert!(seen[k], "box {k} of {count}");
                        nearest = if t < nearest.0 { (t, k) } else { nearest };
                    }
                }
                // A walk cut at the nearest entry still comes to that box.
                let mut found = nearest.0 == f64::INFINITY;
                let limit = nearest.0 as f32 * 1.00001 + 1e-5;
                hierarchy.walk(o, d, limit, &mut stack, |_, leaf, t| {
                    found |= leaves[leaf as usize].contains(&(nearest.1 as u32));
                    t
                });
                assert!(found && stack.is_empty());
            }
        }
    }

    #[test]
    fn nothing_is_met_in_an_empty_one_and_a_negative_limit_ends_the_walk() {
        let mut stack = Stack::new();
        let empty = Hierarchy::new(&[], 1, |_| 0);
        assert_eq!(empty.walk(Vec3::ZERO, Vec3::X, 7.0, &mut stack, |_, _, _| unreachable!()), 7.0);
        let boxes: Vec<_> = (0..9).map(|k| (Vec3::X * k as f32, Vec3::X * k as f32 + Vec3::ONE)).collect();
        let row = Hierarchy::new(&boxes, 1, |l| l[0]);
        let (mut visits, o) = (0, Vec3::new(-1.0, 0.5, 0.5));
        let end = row.walk(o, Vec3::X, 99.0, &mut stack, |_, first, _| {
            visits += 1;
            assert_eq!(first, 0);
            -1.0
        });
        assert!(end < 0.0 && visits == 1 && stack.is_empty());
    }
}
