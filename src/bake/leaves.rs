//! Which triangles of a model are one leaf, and how the wind turns it (`src/physics/wind.rs`).
//!
//! Triangles of foliage that share a corner's place are one leaf: the two of a card, or all of a leaf that is bent. It turns about an axis through
//! its middle along the vertical of its texture, which runs from where it is attached to its tip: both stay where they are. What is larger than a leaf is
//! part of a crown that hangs together, and does not turn.

use std::collections::HashMap;

use glam::Vec3;
use half::f16;

use super::surface::{Face, Surface};
use crate::physics::wind::LARGEST_LEAF;

/// How a leaf turns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Leaf {
    /// Middle of its corners, from the middle of the tree's box, m.
    pub middle: Vec3,
    /// Unit vector of the axis through it, in the plane of its first triangle.
    pub axis: Vec3,
}

impl Leaf {
    /// As shaders take it: halves of the middle, and two bytes of the axis (`card_axis` of `shaders/physics/wind.glsl`).
    pub fn packed(&self) -> [u32; 2] {
        let half = |v: f32| u32::from(f16::from_f32(v).to_bits());
        let a = self.axis / self.axis.abs().element_sum().max(1e-9);
        let fold = |here: f32, other: f32| if a.z < 0.0 { (1.0 - other.abs()) * 1f32.copysign(here) } else { here };
        let byte = |v: f32| u32::from((v * 127.0).round() as i8 as u8);
        let [u, v] = [fold(a.x, a.y), fold(a.y, a.x)].map(byte);
        [half(self.middle.x) | half(self.middle.y) << 16, half(self.middle.z) | u << 16 | v << 24]
    }
}

/// The leaf of each face; `None` for what does not turn.
pub fn leaves(surface: &Surface, foliage: impl Fn(u32) -> bool) -> Vec<Option<Leaf>> {
    let places = |face: &Face| face.p.map(|p| p * surface.frame.scale());
    let mut group: Vec<usize> = (0..surface.faces.len()).collect();
    let mut at: HashMap<[u32; 3], usize> = HashMap::new();
    let leaf = |k: &usize| foliage(surface.faces[*k].material);
    for k in (0..surface.faces.len()).filter(leaf) {
        for p in surface.faces[k].p {
            let first = *at.entry(p.to_array().map(f32::to_bits)).or_insert(k);
            let (a, b) = (root(&mut group, first), root(&mut group, k));
            group[a.max(b)] = a.min(b);
        }
    }
    let mut members: HashMap<usize, Vec<usize>> = HashMap::new();
    for k in (0..surface.faces.len()).filter(leaf) {
        members.entry(root(&mut group, k)).or_default().push(k);
    }
    let mut found = vec![None; surface.faces.len()];
    for faces in members.values() {
        let corners: Vec<Vec3> = faces.iter().flat_map(|k| places(&surface.faces[*k])).collect();
        let (low, high) = corners.iter().fold((corners[0], corners[0]), |(l, h), p| (l.min(*p), h.max(*p)));
        let middle = 0.5 * (low + high);
        let reach = corners.iter().map(|p| p.distance(middle)).fold(0.0, f32::max);
        if f64::from(reach) <= LARGEST_LEAF {
            let first = &surface.faces[faces[0]];
            let turning = axis(places(first), first).map(|axis| Leaf { middle, axis });
            faces.iter().for_each(|k| found[*k] = turning);
        }
    }
    found
}

/// The first face of a group, to which all on the way are hung.
fn root(group: &mut [usize], k: usize) -> usize {
    let mut at = k;
    while group[at] != at {
        group[at] = group[group[at]];
        at = group[at];
    }
    at
}

/// The direction in which a face's texture goes up, or where it has none, its longest side; `None` for a face without area.
fn axis([a, b, c]: [Vec3; 3], face: &Face) -> Option<Vec3> {
    let (e, f) = (b - a, c - a);
    let (s, t) = (face.uv[1] - face.uv[0], face.uv[2] - face.uv[0]);
    let area = s.perp_dot(t);
    let up = (f * s.x - e * t.x) * area.signum();
    let sides = [e, f, c - b];
    let longest = sides.into_iter().max_by(|x, y| x.length_squared().total_cmp(&y.length_squared()))?;
    let along = if area.abs() > 1e-12 { up } else { longest };
    (e.cross(f).length() > 0.0).then(|| along.try_normalize()).flatten()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::crown::Frame;
    use glam::Vec2;

    fn card(at: Vec3, side: f32) -> [Face; 2] {
        let (e, f) = (Vec3::new(side, 0.0, 0.0), Vec3::new(0.0, 0.6 * side, 0.8 * side));
        let corner = |u: f32, v: f32| (at + e * u + f * v, Vec2::new(u, 1.0 - v));
        let face = |c: [(Vec3, Vec2); 3]| Face { p: c.map(|c| c.0), uv: c.map(|c| c.1), mask: None, material: 0 };
        [
            face([corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0)]),
            face([corner(1.0, 1.0), corner(0.0, 1.0), corner(0.0, 0.0)]),
        ]
    }

    fn surface(faces: Vec<Face>) -> Surface {
        Surface { frame: Frame { centre: 5.0, half_width: 1.0, half_height: 1.0 }, faces, masks: Vec::new() }
    }

    #[test]
    fn both_triangles_of_a_card_are_one_leaf_and_turn_about_its_middle_in_its_plane() {
        let cards = [card(Vec3::ZERO, 0.3), card(Vec3::new(0.5, 0.1, 0.2), 0.2)].concat();
        let found = leaves(&surface(cards), |_| true);
        let first = found[0].unwrap();
        assert_eq!((found[0], found[2]), (found[1], found[3]));
        assert!(first.middle.distance(Vec3::new(0.15, 0.09, 0.12)) < 1e-6, "{first:?}");
        // Texture rows go down, so that up in the texture is down on the card: the axis is the same.
        assert!((first.axis.dot(Vec3::new(0.0, 0.6, 0.8)).abs() - 1.0).abs() < 1e-6, "{first:?}");
        assert_ne!(found[0], found[2]);
    }

    #[test]
    fn bark_large_parts_and_faces_without_area_do_not_turn() {
        let mut faces = card(Vec3::ZERO, 0.3).to_vec();
        faces.extend(card(Vec3::new(5.0, 0.0, 0.0), 2.0));
        let flat = Face { p: [Vec3::X; 3], uv: [Vec2::ZERO; 3], mask: None, material: 0 };
        faces.push(flat);
        assert_eq!(leaves(&surface(faces.clone()), |_| true).iter().filter(|l| l.is_some()).count(), 2);
        assert!(leaves(&surface(faces), |_| false).iter().all(Option::is_none));
    }
}
