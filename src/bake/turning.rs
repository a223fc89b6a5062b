//! How the wind turns the leaves of a model (`src/physics/wind.rs`): about an axis through the middle of each, along the vertical of its texture. That runs
//! from where a leaf is attached to its tip, and both stay where they are.

use glam::Vec3;

use super::envelope::joined;
use super::surface::{Face, Surface};
use crate::physics::wind::LEAF_REACH;

/// Steps of a leaf's middle along an axis of the tree's box.
const STEPS: f32 = 1023.0;

/// How a leaf turns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turning {
    /// Middle of its corners, in scaled tree space.
    pub middle: Vec3,
    /// Unit vector of the axis through it, in the plane of its first triangle, in metres.
    pub axis: Vec3,
}

impl Turning {
    /// As shaders take it, of a face: that it turns, with its axis in two bytes (`card_axis` of `shaders/physics/wind.glsl`); and its middle.
    pub fn packed(self) -> [u32; 2] {
        let a = self.axis / self.axis.abs().element_sum().max(1e-9);
        let fold =
            |here: f32, other: f32| if a.z < 0.0 { (1.0 - other.abs()) * 1f32.copysign(here) } else { here };
        let byte = |v: f32| u32::from((v * 127.0).round() as i8 as u8);
        let [u, v] = [fold(a.x, a.y), fold(a.y, a.x)].map(byte);
        [2 | u << 16 | v << 24, packed_place(self.middle)]
    }
}

/// A place of scaled tree space, 10 bits along each axis of the tree's box.
pub fn packed_place(place: Vec3) -> u32 {
    let step = |v: f32| ((0.5 + 0.5 * v.clamp(-1.0, 1.0)) * STEPS).round() as u32;
    let [x, y, z] = place.to_array().map(step);
    x | y << 10 | z << 20
}

/// How each face turns with the leaf that it is of: all that hang together. `None` for what does not: bark, and what is larger than a leaf.
pub fn turning(surface: &Surface, is_leaf: impl Fn(&Face) -> bool) -> Vec<Option<Turning>> {
    let metres = surface.frame.scale();
    let mut leaves = vec![Vec::new(); surface.faces.len()];
    for (face, root) in joined(surface, &is_leaf).into_iter().enumerate() {
        leaves[root as usize].push(face);
    }
    let mut found = vec![None; surface.faces.len()];
    for faces in leaves.iter().filter(|f| f.first().is_some_and(|k| is_leaf(&surface.faces[*k]))) {
        let corners = || faces.iter().flat_map(|k| surface.faces[*k].p);
        let low = corners().fold(Vec3::INFINITY, Vec3::min);
        let high = corners().fold(Vec3::NEG_INFINITY, Vec3::max);
        // With room for the steps in which the middle is kept.
        let small =
            0.5 * ((high - low) * metres).length() < 0.95 * LEAF_REACH as f32 * surface.frame.half_width;
        let of = faces.iter().find_map(|k| axis(&surface.faces[*k], metres)).filter(|_| small);
        let turning = of.map(|axis| Turning { middle: 0.5 * (low + high), axis });
        faces.iter().for_each(|k| found[*k] = turning);
    }
    found
}

/// The direction in which a face's texture goes up, or where it has none, its longest side, as a unit vector in metres; `None` for a face without area.
fn axis(face: &Face, metres: Vec3) -> Option<Vec3> {
    let [a, b, c] = face.p.map(|p| p * metres);
    let (e, f) = (b - a, c - a);
    let (s, t) = (face.uv[1] - face.uv[0], face.uv[2] - face.uv[0]);
    let area = s.perp_dot(t);
    let sides = [e, f, c - b];
    let longest = sides.into_iter().max_by(|x, y| x.length_squared().total_cmp(&y.length_squared()))?;
    let along = if area.abs() > 1e-12 { (f * s.x - e * t.x) * area.signum() } else { longest };
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
    fn both_triangles_of_a_card_turn_about_its_middle_in_its_plane_and_bark_and_pieces_do_not() {
        // Two cards, what is larger than a leaf, and bark.
        let cards = [(Vec3::ZERO, 0.2), (Vec3::new(0.5, 0.1, 0.2), 0.1), (Vec3::Y, 1.0), (Vec3::X, 0.1)];
        let mut cards = cards.map(|(at, side)| card(at, side)).concat();
        cards[6..].iter_mut().for_each(|f| f.material = 1);
        let found = turning(&surface(cards), |f| f.material == 0);
        let first = found[0].unwrap();
        assert_eq!((found[0], found[2], &found[4..]), (found[1], found[3], &[None; 4][..]));
        assert!(first.middle.distance(Vec3::new(0.1, 0.06, 0.08)) < 1e-6, "{first:?}");
        assert!((first.axis.dot(Vec3::new(0.0, 0.6, 0.8)).abs() - 1.0).abs() < 1e-6, "{first:?}");
        assert_ne!(found[0], found[2]);
        let flat = Face { p: [Vec3::X; 3], uv: [Vec2::ZERO; 3], mask: None, material: 0 };
        assert_eq!(axis(&flat, Vec3::ONE), None);
    }

    /// The axis and the middle of a leaf as shaders take them apart.
    fn unpacked([turns, middle]: [u32; 2]) -> ([f64; 3], [f64; 3]) {
        assert_eq!(turns & 0xffff, 2);
        let e = [16, 24].map(|k| f64::from((turns >> k) as u8 as i8) / 127.0);
        let mut v = [e[0], e[1], 1.0 - e[0].abs() - e[1].abs()];
        if v[2] < 0.0 {
            let sign = |v: f64| if v < 0.0 { -1.0 } else { 1.0 };
            (v[0], v[1]) = ((1.0 - e[1].abs()) * sign(e[0]), (1.0 - e[0].abs()) * sign(e[1]));
        }
        let length = v.iter().map(|v| v * v).sum::<f64>().sqrt();
        let place = |k: u32| f64::from(middle >> k & 1023) / (0.5 * f64::from(STEPS)) - 1.0;
        (v.map(|v| v / length), [place(0), place(10), place(20)])
    }

    #[test]
    fn leaves_of_real_trees_turn_about_their_rest() {
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
            let found = turning(&surface, |f| mesh.materials[f.material as usize].foliage);
            let all = surface.faces.iter().filter(|f| mesh.materials[f.material as usize].foliage).count();
            let turns = found.iter().flatten().count();
            println!("{name}: {turns} of {all} triangles of leaves turn");
            assert!(turns * 10 >= all * 9);
            let (mut angle, mut reach) = (0f64, 0f64);
            for (face, leaf) in surface.faces.iter().zip(&found).step_by(97) {
                let Some(leaf) = leaf else { continue };
                let (off, far) = over_a_period(&w, &surface, face.p, leaf.packed());
                (angle, reach) = (angle.max(off), reach.max(far));
            }
            let share = reach / f64::from(surface.frame.half_width);
            println!(
                "{name}: mean normals {:.3} degrees off, leaves reach {share:.3} of the tree's",
                angle.to_degrees()
            );
            // Of axes of two bytes, which are up to 0.6 degrees out of the leaf's plane, the mean of a turn by 30 degrees keeps a fifteenth of that;
            // of shears and swings by up to 0.07 the second order is left.
            assert!(angle < 0.2f64.to_radians(), "{name}: {angle}");
            assert!(share < LEAF_REACH, "{name}: {share}");
        }
    }

    /// Angle between a face's normal and its mean over time, rad; and how far its corners are from what it turns about, m.
    fn over_a_period(w: &Wind, surface: &Surface, p: [Vec3; 3], packed: [u32; 2]) -> (f64, f64) {
        let metres = surface.frame.scale();
        let (axis, middle) = unpacked(packed);
        let middle: [f64; 3] = std::array::from_fn(|i| middle[i] * f64::from(metres[i]));
        let places = p.map(|p| (p * metres).to_array().map(f64::from));
        let normal = |c: [[f64; 3]; 3]| {
            let [a, b, c] = c.map(DVec3::from);
            (b - a).cross(c - a).normalize()
        };
        let mut sum = DVec3::ZERO;
        for k in 0..2048 {
            let m = w.at(PERIOD * f64::from(k) / 2048.0);
            let (angle, branch, sway) = (m.flutter(packed[1]), m.branch(middle, 77), m.sway(0.0, 12.0, 1234));
            let moved = places.map(|p| {
                let q = turned(std::array::from_fn(|i| p[i] - middle[i]), axis, angle);
                let [x, y, z]: [f64; 3] = std::array::from_fn(|i| q[i] + middle[i] + branch[i]);
                [x + sway[0] * z, y + sway[1] * z, z]
            });
            sum += normal(moved);
        }
        let reach = places.iter().map(|p| DVec3::from(*p).distance(middle.into())).fold(0.0, f64::max);
        (sum.angle_between(normal(places)), reach)
    }
}
