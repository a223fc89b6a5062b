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
        let fold =
            |here: f32, other: f32| if a.z < 0.0 { (1.0 - other.abs()) * 1f32.copysign(here) } else { here };
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
    use crate::physics::wind::{PERIOD, Wind, turned};
    use glam::{DVec3, Vec2};

    fn card(at: Vec3, side: f32) -> [Face; 2] {
        let (e, f) = (Vec3::new(side, 0.0, 0.0), Vec3::new(0.0, 0.6 * side, 0.8 * side));
        let corner = |u: f32, v: f32| (at + e * u + f * v, Vec2::new(u, 1.0 - v));
        let face =
            |c: [(Vec3, Vec2); 3]| Face { p: c.map(|c| c.0), uv: c.map(|c| c.1), mask: None, material: 0 };
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

    /// The axis of a leaf as shaders take it apart.
    fn unfolded(bits: u32) -> [f64; 3] {
        let e = [0, 8].map(|k| f64::from((bits >> k) as u8 as i8) / 127.0);
        let mut v = [e[0], e[1], 1.0 - e[0].abs() - e[1].abs()];
        if v[2] < 0.0 {
            let sign = |v: f64| if v < 0.0 { -1.0 } else { 1.0 };
            (v[0], v[1]) = ((1.0 - e[1].abs()) * sign(e[0]), (1.0 - e[0].abs()) * sign(e[1]));
        }
        let length = v.iter().map(|v| v * v).sum::<f64>().sqrt();
        v.map(|v| v / length)
    }

    #[test]
    fn leaves_of_a_real_tree_keep_their_normals_on_average_and_hold_together() {
        let w = Wind { speed: 25.0, azimuth: 270.0, gustiness: 0.8 };
        for name in ["oak", "pine"] {
            let path = format!("{}/tests/data/{name}.glb", env!("CARGO_MANIFEST_DIR"));
            let text = format!(
                "[terrain]\nextent = 9.0\nalbedo = 0.1\n[[species]]\nname = \"t\"\nmodel = \"{path}\"\ndensity = 0.1\n\
                 [[camera]]\nname = \"c\"\nposition = [0.0, 0.0, 1.0]\ntarget = [1.0, 1.0, 1.0]\nvertical_fov = 50.0\n"
            );
            let scene = crate::scene::parse(&text, std::path::Path::new("t.toml")).unwrap();
            let mesh = &scene.species[0].mesh;
            let surface = Surface::new(mesh).unwrap();
            let foliage = |m: u32| mesh.materials[m as usize].foliage;
            let found = leaves(&surface, foliage);
            let all = surface.faces.iter().filter(|f| foliage(f.material)).count();
            let turning = found.iter().flatten().count();
            println!("{name}: {turning} of {all} triangles of leaves turn");
            assert!(turning * 10 >= all * 9);
            let mut worst = 0f64;
            for (face, leaf) in surface.faces.iter().zip(&found).step_by(97) {
                let Some(leaf) = leaf else { continue };
                worst = worst.max(mean_normal(&w, &surface, face.p, leaf));
            }
            // Of axes of two bytes, which are up to 0.6 degrees out of the leaf's plane, the mean of a turn by 30 degrees keeps a fifteenth of that; of a
            // sum of shears and swings by up to 0.07 the second order is left, 0.002.
            println!("{name}: mean normals are {:.3} degrees off at most", worst.to_degrees());
            assert!(worst < 0.2f64.to_radians(), "{name}: {worst}");
        }
    }

    /// Angle between a face's normal and its mean over time, rad.
    fn mean_normal(w: &Wind, surface: &Surface, p: [Vec3; 3], leaf: &Leaf) -> f64 {
        let [packed, rest] = [leaf.packed(), [0; 2]];
        assert_ne!(packed, rest);
        let axis = unfolded(packed[1] >> 16);
        let middle = leaf.middle.to_array().map(f64::from);
        let places = p.map(|p| (p * surface.frame.scale()).to_array().map(f64::from));
        let normal = |c: [[f64; 3]; 3]| {
            let [a, b, c] = c.map(DVec3::from);
            (b - a).cross(c - a).normalize()
        };
        let mut sum = DVec3::ZERO;
        for k in 0..2048 {
            let m = w.at(PERIOD * f64::from(k) / 2048.0);
            let (angle, branch, sway) =
                (m.flutter(packed[0] ^ packed[1]), m.branch(middle, 77), m.sway(0.0, 12.0, 1234));
            let moved = places.map(|p| {
                let q = turned([0, 1, 2].map(|i| p[i] - middle[i]), axis, angle);
                let [x, y, z] = [0, 1, 2].map(|i| q[i] + middle[i] + branch[i]);
                [x + sway[0] * z, y + sway[1] * z, z]
            });
            sum += normal(moved);
        }
        sum.angle_between(normal(places))
    }
}
