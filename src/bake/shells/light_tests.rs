use std::f64::consts::PI;
use std::sync::Arc;

use super::light::{Fit, range};
use super::tests::plain;
use super::*;
use crate::bake::grove::Tree;
use crate::physics::harmonics::{KEPT, clamped_cosine, evaluate, irradiance};
use crate::physics::hash::Stream;
use crate::scene::mesh::Triangle;
use crate::scene::{Material, Mesh};
use glam::Vec3;

/// A leaf of 2 × 2 m a metre above the trunk's base, level but for so much of a rise to the east; seen from above its front or its back.
fn leaf(rise: f32, front: bool) -> Mesh {
    let corner = |x: f32, y: f32| [x, y, 1.0 + rise * x];
    let order: [u32; 4] = if front { [0, 1, 2, 3] } else { [0, 3, 2, 1] };
    let [a, b, c, d] = order;
    Mesh {
        positions: vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)],
        normals: vec![[0.0, 0.0, 1.0]; 4],
        uvs: vec![[0.0; 2]; 4],
        triangles: [[a, b, c], [a, c, d]].map(|vertices| Triangle { vertices, material: 0 }).to_vec(),
        materials: vec![Material::leaf()],
        dropped_triangles: 0,
    }
}

/// A tree of such a leaf in the middle of a tile.
fn tree(scale: f32, turn: f32) -> Image {
    let turn = [turn.cos(), turn.sin()];
    Image {
        tree: Tree { base: Vec3::new(8.0, 8.0, 0.0), scale, turn, tint: 1.0, species: 0 },
        activation: 0.0,
    }
}

/// Light of a tile of 16 m in which these trees stand, and others around it, in texels of 4 m of slices of 4 m: slices, rows and columns.
fn light(mesh: Mesh, trees: &[Image], around: &[Image]) -> Slices<LIGHT> {
    let mut scene = plain("builtin:pine", "[0.5, 1.0]", "density = 0.01");
    // A model must extend both sideways and upwards: a speck of bark under the ground.
    let mut mesh = mesh;
    let first = mesh.positions.len() as u32;
    mesh.positions.extend([[0.0, 0.0, -0.1], [0.01, 0.0, -0.1], [0.0, 0.01, -0.11]]);
    mesh.normals.extend([[0.0, 0.0, 1.0]; 3]);
    mesh.uvs.extend([[0.0; 2]; 3]);
    mesh.materials.push(Material { foliage: false, ..Material::leaf() });
    mesh.triangles.push(Triangle { vertices: [0, 1, 2].map(|k| first + k), material: 1 });
    scene.species[0].mesh = Arc::new(mesh);
    let mut forest = Forest::new(&scene).unwrap();
    forest.height = 16.0;
    forest.patch.side = 16.0;
    forest.patch.tiles = vec![trees.to_vec(); TILES];
    forest.patch.around = vec![around.to_vec(); TILES];
    let settings = ShellSettings { slices: 4, texels: 16 };
    let lights = Lights::new(&scene, &forest, None, true).unwrap();
    let mut light = lights.tile(&forest, 0, settings);
    let finest = forest.tile(0, settings, |samples| light.add(samples));
    light.slices(&finest)
}

fn near(got: &[f32], want: &[f64], bound: f64, what: &str) {
    for (k, (got, want)) in got.iter().zip(want).enumerate() {
        assert!((f64::from(*got) - want).abs() < bound, "{what}, {k}: {got} {want}");
    }
}

/// The four texels in the middle of a slice.
fn middle(slices: &Slices<LIGHT>, slice: usize) -> Vec<Texel<LIGHT>> {
    [5, 6, 9, 10].map(|k| slices.texels[16 * slice + k]).to_vec()
}

#[test]
fn a_lone_level_leaf_has_a_clamped_cosine_on_either_side_and_all_of_the_sky() {
    for front in [false, true] {
        // 8 × 8 m at a height of 4 m: all of four texels in the second slice, and nothing else.
        let light = light(leaf(0.0, front), &[tree(4.0001, 0.0)], &[]);
        assert!(light.texels.iter().filter(|t| t.values != [0.0; LIGHT]).count() == 4);
        for t in middle(&light, 1) {
            assert!(t.cover[SHARES - 1] > 0.999);
            // As exact as the transfer of a face, of 64 rays.
            near(&t.values[..KEPT], &clamped_cosine([0.0, 0.0, 1.0]), 0.05, "seen");
            near(&t.values[KEPT..2 * KEPT], &clamped_cosine([0.0, 0.0, -1.0]), 0.05, "other");
            let mut all = [0.0; KEPT + 1];
            (all[0], all[KEPT]) = ((4.0 * PI).sqrt(), 1.0);
            near(&t.values[2 * KEPT..], &all, 1e-3, "free");
        }
    }
}

#[test]
fn light_turns_with_the_tree() {
    for turn in [0.0f32, 1.0, 2.5, 4.0] {
        let light = light(leaf(0.75, true), &[tree(4.0001, turn)], &[]);
        // The leaf looks to the west, up: turned by the angle.
        let normal = [-0.6 * f64::from(turn.cos()), -0.6 * f64::from(turn.sin()), 0.8];
        let seen: Vec<_> = (0..4).flat_map(|s| middle(&light, s)).filter(|t| t.cover[3] > 0.1).collect();
        assert!(seen.len() > 3);
        for t in seen {
            let cover = t.cover[SHARES - 1];
            let [up, down] = [0, 1].map(|side| t.values[side * KEPT..][..KEPT].iter().map(|v| v / cover));
            near(&up.collect::<Vec<_>>(), &clamped_cosine(normal), 0.05, "seen");
            near(&down.collect::<Vec<_>>(), &clamped_cosine(normal.map(|n| -n)), 0.05, "other");
        }
    }
}

#[test]
fn under_a_roof_there_is_less_light_than_on_it_whichever_tile_it_stands_in() {
    // 16 × 16 m at 8 m, and 4 × 4 m under its middle at 2 m.
    let (roof, low) = (tree(8.0001, 0.0), tree(2.0, 0.0));
    // V towards a direction, as a renderer has it.
    let free = |t: &Texel<LIGHT>, w: [f64; 3]| {
        let free: Vec<f64> = t.values[2 * KEPT..3 * KEPT].iter().map(|v| f64::from(v / t.cover[3])).collect();
        irradiance(&free, &evaluate(w)).clamp(0.0, 1.0)
    };
    let (up, low_sun) = ([0.0, 0.0, 1.0], [0.8, 0.55, 0.24]);
    let under = |light: &Slices<LIGHT>| {
        for t in middle(light, 0) {
            // Of the sky there is what is 53° and more from the zenith, 0.31 of it by cosines; at the edge the sum of few functions is a slope.
            let open = t.values[LIGHT - 1] / t.cover[3];
            assert!((0.2..0.42).contains(&open), "{open}");
            assert!(free(&t, up) < 0.05 && free(&t, low_sun) > 0.8, "{} {}", free(&t, up), free(&t, low_sun));
        }
    };
    let both = light(leaf(0.0, true), &[roof, low], &[]);
    under(&both);
    for t in middle(&both, 2) {
        assert!((free(&t, up) - 1.0).abs() < 0.01 && (t.values[LIGHT - 1] - 1.0).abs() < 1e-3);
    }
    let across = light(leaf(0.0, true), &[low], &[roof]);
    under(&across);
    assert!(across.texels[32..].iter().all(|t| t.values == [0.0; LIGHT]));
}

#[test]
fn v_is_what_rays_find_where_few_bands_can_tell() {
    let fit = Fit::new();
    let at = |free: &dyn Fn([f32; 3]) -> bool, turn: f32, w: [f64; 3]| {
        let found: Vec<bool> = fit
            .directions
            .iter()
            .map(|[x, y, z]| free([turn.cos() * x - turn.sin() * y, turn.sin() * x + turn.cos() * y, *z]))
            .collect();
        let numbers = fit.of(&found, turn, &[[0.0; KEPT]; 2]).0;
        irradiance(&numbers.map(f64::from), &evaluate(w)).clamp(0.0, 1.0)
    };
    for turn in [0.0, 0.7, 3.0] {
        // A wall in the west, and a ring of trees up to 30°: the middles of what is free and of what is not.
        for (w, want) in [([0.8, 0.0, 0.6], 1.0), ([-0.8, 0.0, 0.6], 0.0), ([0.0, 0.8, 0.6], 0.5)] {
            let got = at(&|w| w[0] > 0.0, turn, w);
            assert!((got - want).abs() < 0.2, "{turn} {w:?}: {got}");
        }
        for (w, want) in [([0.0, 0.0, 1.0], 1.0), ([0.6, 0.0, 0.8], 1.0), ([0.0, 0.97, 0.243], 0.0)] {
            let got = at(&|w| w[2] > 0.5, turn, w);
            assert!((got - want).abs() < 0.25, "{turn} {w:?}: {got}");
        }
    }
}

#[test]
fn merged_bytes_are_those_of_slices_drawn_one_by_one() {
    let mut stream = Stream::new(5);
    let texels = (0..8 * 16).map(|_| {
        let cover = stream.unit() as f32;
        let value = |k: usize| (range(k) * (2.0 * stream.unit() - 1.0)) as f32 * cover;
        Texel { cover: [cover; SHARES], values: std::array::from_fn(value) }
    });
    let finest = Slices { side: 4, texels: texels.collect(), above: vec![[0.9; SHARES]; 16] };
    let one = std::iter::successors(Some(finest.clone()), |s| Some(s.merged())).nth(3).unwrap();
    let (bytes, merged) = (LightMip::new(&finest), LightMip::new(&one));
    let byte = |mip: &LightMip, texel: usize, k: usize| {
        f64::from(mip.images[k / 4][4 * texel + k % 4].cast_signed())
    };
    for (texel, k) in (0..16).flat_map(|t| (0..LIGHT).map(move |k| (t, k))) {
        let (mut sum, mut through) = (0.0, 1.0);
        for slice in (0..8).rev() {
            sum += through * byte(&bytes, 16 * slice + texel, k);
            through *= 1.0 - f64::from(finest.texels[16 * slice + texel].cover[SHARES - 1]);
        }
        // Half a byte of each of eight slices, of which what is above lets through less and less, and of their sum.
        assert!((sum - byte(&merged, texel, k)).abs() < 4.5, "{texel} {k}: {sum}");
    }
}
