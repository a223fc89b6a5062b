//! The artefact of a cloud.

use glam::Vec3;

use super::artefact::FAR;
use super::{CardCloud, CloudSettings};
use crate::bake::cache::{CacheState, Source};
use crate::bake::harmonics::{self, Harmonics};
use crate::bake::surface::Surface;
use crate::physics::harmonics::{KEPT, RANGE, clamped_cosine, decode};
use crate::scene::mesh::{Material, Triangle};
use crate::scene::{Mesh, OpticsOverride};
use crate::settings::Settings;

/// A leaf that lies askew, with a trunk of one triangle.
fn model() -> Mesh {
    let bark = Material { name: "bark".into(), foliage: false, ..Material::leaf() };
    let mut mesh = Mesh { materials: vec![Material::leaf(), bark], ..Mesh::default() };
    let turn = glam::Quat::from_euler(glam::EulerRot::ZYX, 0.4, 0.9, 0.3);
    let leaf = [Vec3::ZERO, Vec3::X * 2.0, Vec3::Y * 3.0].map(|p| turn * p + Vec3::Z * 40.0);
    let trunk = [Vec3::ZERO, Vec3::X * 0.5, Vec3::Z * 5.0];
    for (corners, material) in [(leaf, 0), (trunk, 1)] {
        let first = mesh.positions.len() as u32;
        for p in corners {
            mesh.positions.push(p.to_array());
            mesh.normals.push([0.0, 0.0, 1.0]);
            mesh.uvs.push([0.0; 2]);
        }
        mesh.triangles.push(Triangle { vertices: [0, 1, 2].map(|k| first + k), material });
    }
    mesh
}

fn oak() -> Mesh {
    crate::scene::model::load_named(std::path::Path::new("builtin:oak"), None).unwrap()
}

const SMALL: CloudSettings = CloudSettings { cards: 24, atlas: 256 };

#[test]
fn a_lone_leaf_is_on_its_card_as_it_is() {
    let mesh = model();
    let light = Harmonics::new(&mesh, true).unwrap();
    let cloud = CardCloud::new(&mesh, &light, CloudSettings { atlas: 1024, ..SMALL }).unwrap();
    assert_eq!((cloud.full, cloud.cards.len()), (2, 2 + FAR));
    // Bark is first.
    for (k, card) in cloud.cards[..2].iter().enumerate() {
        let [right, up] = [card.right, card.up].map(Vec3::from);
        let out = right.cross(up).normalize();
        for (corner, side) in [(card.front, 1.0), (card.back, -1.0)] {
            let (mut covered, width) = (0, cloud.size[0]);
            for y in corner[1]..corner[1] + card.size[1] {
                for x in corner[0]..corner[0] + card.size[0] {
                    let at = (y * width + x) as usize;
                    covered += u32::from(cloud.opacity[0][at] >= 128);
                    // All of a picture shows the one face, holes too: its normal is the card's, but for what the box's turn is off (three quarters of
                    // a degree), and for 0, which lies between two bytes.
                    let [leaf, nx, ny] = [0, 2, 3].map(|c| cloud.surface[0][4 * at + c]);
                    assert_eq!(leaf, [0, 255][k]);
                    assert!(nx.abs_diff(128) <= 3 && ny.abs_diff(128) <= 3, "{nx} {ny}");
                    let number = |n: usize| {
                        let at = (y / 2 * (width / 2) + x / 2) as usize;
                        decode(cloud.harmonics[n / 4][4 * at + n % 4].cast_signed())
                    };
                    let normal = (out * side).as_dvec3();
                    for n in 0..KEPT {
                        // Half a byte, and a ray and a box's turn that are off.
                        let near = |got: f64, want: f64| {
                            assert!((got - want).abs() < RANGE / 254.0 + 0.06, "{n} {got} {want}")
                        };
                        near(number(n), clamped_cosine(normal.into())[n]);
                        near(number(KEPT + n), clamped_cosine((-normal).into())[n]);
                    }
                }
            }
            // As much as the triangle: half of 6 m², or of 2.5; its sides are hundreds or dozens of texels long, of which each end is half off.
            let texel = (4.0 * right.length() * up.length()) / (card.size[0] * card.size[1]) as f32;
            let area = covered as f32 * texel;
            assert!((area / [1.25, 3.0][k] - 1.0).abs() < 0.05, "{k}: {area}");
        }
    }
}

#[test]
fn pictures_stand_apart_and_coarser_levels_keep_coverage() {
    let oak = oak();
    let cloud = CardCloud::new(&oak, &Harmonics::new(&oak, true).unwrap(), SMALL).unwrap();
    assert!(cloud.full > 10 && cloud.full <= SMALL.cards && cloud.cards.len() == cloud.full as usize + FAR);
    let [width, height] = cloud.size;
    assert!(width == 256 && height == 256 && cloud.textures().map(Vec::len).eq(CardCloud::sizes(256)));
    let mut owner = vec![false; (width * height) as usize];
    for card in &cloud.cards {
        for corner in [card.front, card.back] {
            assert!(corner.iter().all(|x| x % 4 == 0 && *x >= 4));
            let [x, y] = [0, 1].map(|a| corner[a] - 4..corner[a] + card.size[a] + 4);
            for at in y.flat_map(|y| x.clone().map(move |x| (y * width + x) as usize)) {
                assert!(!owner[at], "pictures with their gutters overlap");
                owner[at] = true;
            }
        }
    }
    // The rest is empty, and so is every gutter.
    let mut left = cloud.opacity[0].clone();
    for card in &cloud.cards {
        for corner in [card.front, card.back] {
            for y in corner[1]..corner[1] + card.size[1] {
                let row = (y * width + corner[0]) as usize;
                left[row..row + card.size[0] as usize].fill(0);
            }
        }
    }
    assert!(left.iter().all(|a| *a == 0));
    let covered = cloud.opacity[0].iter().filter(|a| **a >= 128).count() as f64 / f64::from(width * height);
    assert!(covered > 0.05);
    for (level, opacity) in cloud.opacity.iter().enumerate().skip(1) {
        let mean = opacity.iter().map(|a| f64::from(*a)).sum::<f64>() / (255.0 * opacity.len() as f64);
        // Each byte is rounded by a half at most.
        assert!((mean - covered).abs() < 0.5 / 255.0, "{level}: {mean} {covered}");
    }
}

#[test]
fn clouds_are_the_same_on_any_number_of_threads_and_from_the_cache() {
    let (mesh, dir) = (model(), tempfile::tempdir().unwrap());
    let bake = (&Settings::default()).into();
    let optics = OpticsOverride::default();
    let source = Source::new(&mesh, &optics, &bake, Some(dir.path()), true).unwrap();
    let light = Harmonics::new(&mesh, true).unwrap();
    let (made, state) = source.load_cards(&light, SMALL).unwrap();
    assert_eq!(state, CacheState::Baked);
    let (read, state) = source.load_cards(&light, SMALL).unwrap();
    assert_eq!(state, CacheState::Hit);
    assert!(made == read);
    // Another knob is another cloud.
    assert_eq!(source.load_cards(&light, CloudSettings { cards: 25, ..SMALL }).unwrap().1, CacheState::Baked);
    // Damage in either file is found.
    for entry in std::fs::read_dir(dir.path()).unwrap() {
        let path = entry.unwrap().path();
        let mut bytes = std::fs::read(&path).unwrap();
        let last = bytes.len() - 40;
        bytes[last] ^= 1;
        std::fs::write(&path, &bytes).unwrap();
        let states =
            [SMALL, CloudSettings { cards: 25, ..SMALL }].map(|s| source.load_cards(&light, s).unwrap());
        assert!(
            states.iter().any(|(_, s)| *s == CacheState::Rebuilt) && states[0].0 == made,
            "{}",
            path.display()
        );
    }
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| CardCloud::new(&mesh, &light, SMALL).unwrap())
    };
    assert!(on(1) == made && on(3) == made);
}

#[test]
fn a_viewer_of_a_leafs_back_has_front_and_back_changed_over() {
    // A roof over the leaf: what falls on its upper side is little, whichever picture shows that side.
    let mut mesh = model();
    let first = mesh.positions.len() as u32;
    for p in [[-90.0, -90.0, 45.0], [90.0, -90.0, 45.0], [0.0, 120.0, 45.0]] {
        mesh.positions.push(p);
        mesh.normals.push([0.0, 0.0, 1.0]);
        mesh.uvs.push([0.0; 2]);
    }
    mesh.triangles.push(Triangle { vertices: [0, 1, 2].map(|k| first + k), material: 1 });
    let surface = Surface::new(&mesh).unwrap();
    let [front, back] = harmonics::transfers(&mesh, &surface, true)[0];
    let light = Harmonics::new(&mesh, true).unwrap();
    let cloud = CardCloud::new(&mesh, &light, CloudSettings { atlas: 1024, ..SMALL }).unwrap();
    let card = cloud.cards[..cloud.full as usize].last().unwrap();
    let normal = Vec3::from(card.right).cross(card.up.into());
    let [a, b, c] = [0, 1, 2].map(|k| Vec3::from(mesh.positions[k]));
    let faces_front = (b - a).cross(c - a).dot(normal) > 0.0;
    for (corner, is_front) in [(card.front, faces_front), (card.back, !faces_front)] {
        let at = (corner[1] / 2 * (cloud.size[0] / 2) + corner[0] / 2) as usize;
        let (own, other) = if is_front { (front, back) } else { (back, front) };
        for n in 0..2 * KEPT {
            let got = decode(cloud.harmonics[n / 4][4 * at + n % 4].cast_signed());
            let want = f64::from(if n < KEPT { own[n] } else { other[n - KEPT] });
            // One face: what its bytes are off.
            assert!((got - want).abs() < RANGE / 254.0 + 1e-6, "{n}: {got} {want}");
        }
    }
    // The level card of the far form has the roof above its front, and the leaf before it as its back sees it.
    let level = cloud.cards.last().unwrap();
    let (height, leaf) = (level.centre[2] + surface.frame.centre, (a + b + c) / 3.0);
    for (corner, depth) in [(level.front, 45.0 - height), (level.back, height - leaf.z)] {
        let texel = [leaf.x - level.centre[0], level.centre[1] - leaf.y];
        let half = [level.right[0], level.up[1]];
        let [x, y] =
            [0, 1].map(|a| corner[a] + ((0.5 + 0.5 * texel[a] / half[a]) * level.size[a] as f32) as u32);
        let byte = cloud.surface[0][4 * (y * cloud.size[0] + x) as usize + 1];
        let want = 127.5 + 127.5 * depth / level.depth;
        // The leaf is steep: a metre over a metre, and a texel is a tenth of one, of a depth of 5 m.
        assert!((f32::from(byte) - want).abs() < 4.0, "{byte} {want}");
    }
    assert!((front[0] - back[0]).abs() > 0.3, "{} {}: the roof does nothing", front[0], back[0]);
}
