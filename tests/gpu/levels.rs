//! Levels of detail of trees that are meshes: what the device draws of each is what the law says, near trees are whole, and far ones cover as much as whole ones.

use std::sync::Arc;

use crate::device;
use canopy::bake::levels::Levels;

use canopy::camera::Eye;
use canopy::frame::Renderer;
use canopy::gpu::interface::{DrawCommand, MESH_DRAWS, MeshFace, MeshKind, MeshTree, Tree};
use canopy::gpu::{Gpu, GpuOptions, Validation};
use canopy::image::Picture;
use canopy::physics::levels::{bark_level, drawn_end, leaf_share, pull};
use canopy::plan::Plan;
use canopy::scene::{Camera, Distribution, Scene, TreePosition};

const SIZE: [u32; 2] = [160, 120];
/// Of what tells levels of bark apart.
const LARGE: [u32; 2] = [640, 480];
const LADDER: &str = "mesh:16,zfield:4,shader-map";
const DAY: &str = "[sun]\nazimuth = 210.0\nelevation = 35.0\nirradiance = 1.0\n[sky]\nradiance = 0.1";
const NIGHT: &str = "[sky]\nradiance = 0.1";

/// Oaks and pines in turn, where they are listed: east, north and scale.
fn trees(places: &[[f64; 3]], light: &str) -> Scene {
    let mut scene = device::small_scene(&format!(
        "seed = 2\n[terrain]\nextent = 400.0\nalbedo = 0.2\n\
         [[species]]\nname = \"oak\"\nmodel = \"builtin:oak\"\ndensity = 0.0\n\
         [[species]]\nname = \"pine\"\nmodel = \"builtin:pine\"\ndensity = 0.0\n{light}\n\
         [[camera]]\nname = \"c\"\nposition = [20.0, 20.0, 6.0]\ntarget = [50.0, 50.0, 5.0]\nvertical_fov = 50.0\n"
    ));
    for (k, species) in scene.species.iter_mut().enumerate() {
        let of = places.iter().skip(k).step_by(2);
        let tree = |p: &[f64; 3]| TreePosition {
            x: p[0],
            y: p[1],
            scale: Some(p[2] as f32),
            rotation: Some(30.0 + 20.0 * p[0] as f32),
        };
        species.distribution = Distribution::Positions(Arc::new(of.map(tree).collect()));
    }
    scene
}

fn renderer(gpu: &Gpu, scene: &Scene, camera: &Camera, size: [u32; 2]) -> Renderer {
    let eye = Eye::new(camera, &scene.terrain, size);
    let plan =
        Plan::for_eye(scene, &eye, true, LADDER.parse::<canopy::ladder::Ladder>().unwrap(), Some(gpu.info()));
    Renderer::new(gpu, Arc::new(scene.clone()), plan.unwrap(), &device::bake_meshes(scene)).unwrap()
}

fn picture(gpu: &Gpu, scene: &Scene, camera: &Camera) -> Picture {
    let mut renderer = renderer(gpu, scene, camera, SIZE);
    renderer.render(camera, 1.0).unwrap();
    renderer.picture().unwrap()
}

fn with(scene: &Scene, knob: &str, value: f64) -> Scene {
    let mut scene = scene.clone();
    scene.settings.set(knob, value).unwrap();
    scene
}

/// What the law says of a tree: its share, and how many triangles of leaves and of bark are drawn at most and at least, for shares that differ by
/// rounding.
fn law(levels: &Levels, metre: f64, leaf_pixels: f64, ranks: &[f32]) -> (f64, [usize; 2], usize) {
    let share = leaf_share(levels.cards.side * metre, leaf_pixels);
    let leaves = [1.0 - 1e-5, 1.0 + 1e-5]
        .map(|slack| ranks.partition_point(|rank| f64::from(*rank) < drawn_end(share) * slack));
    (share, leaves, bark_level(levels.bark.iter().map(|b| b.error), metre, share))
}

#[test]
fn the_device_draws_of_each_tree_what_the_law_says() {
    let gpu = device::open();
    let places: Vec<[f64; 3]> = (0..40)
        .map(|k| {
            [190.0 + f64::from(k % 5) * 9.0, 20.0 + f64::from(k / 5) * 20.0, 0.7 + 0.1 * f64::from(k % 7)]
        })
        .collect();
    let scene = with(&trees(&places, NIGHT), "leaf_pixels", 12.0);
    let camera = device::camera([200.0, 8.0, 3.0], [205.0, 120.0, 8.0]);
    let mut renderer = renderer(&gpu, &scene, &camera, LARGE);
    let report = renderer.render(&camera, 1.0).unwrap();
    let total = report.trees.meshes as usize;
    let focal = Eye::new(&camera, &scene.terrain, LARGE).pixels_at_1m;
    let near = renderer.forest().unwrap().near.as_ref().unwrap();
    let data = near.meshes.as_ref().unwrap();
    let kinds: Vec<MeshKind> = gpu.read(&data.kinds, 0, 2).unwrap();
    let shown: Vec<MeshTree> = gpu.read(&data.trees, 0, total).unwrap();
    let draws: Vec<DrawCommand> = gpu.read(&data.draws, 0, MESH_DRAWS as usize * total).unwrap();
    let count: Vec<u32> = gpu.read(&data.draw_count, 0, 1).unwrap();
    assert_eq!(count[0] as usize, draws.len());
    let trees: Vec<Tree> = gpu.read(&near.cull.trees, 0, report.trees.camera as usize).unwrap();
    let baked = device::bake_meshes(&scene);
    let (mut whole, mut bark_levels) = (0, std::collections::BTreeSet::new());
    let mut distances: Vec<[f64; 2]> = Vec::new();
    for (place, t) in shown.iter().enumerate() {
        let tree = &trees[t.tree as usize];
        let (kind, levels) =
            (&kinds[tree.species as usize], baked[tree.species as usize].levels.as_ref().unwrap());
        let ranks: Vec<f32> = levels.cards.order.iter().map(|k| levels.cards.rank[*k as usize]).collect();
        let distance = glam::Vec3::from(tree.centre).as_dvec3().length();
        distances.push([f64::from(tree.species), distance]);
        let metre = focal * f64::from(tree.scale) / distance;
        let (share, leaves, level) = law(levels, metre, 12.0, &ranks);
        assert!((f64::from(t.share) / share - 1.0).abs() < 1e-4, "{share} {}", t.share);
        let pull = pull(&levels.pull, share);
        assert!((f64::from(t.pull) / pull - 1.0).abs() < 1e-4, "{pull} {}", t.pull);
        let [first, second] = [0, 1].map(|k| draws[MESH_DRAWS as usize * place + k]);
        assert_eq!([first.first_instance, second.first_instance], [place as u32; 2]);
        if t.share >= 1.0 {
            whole += 1;
            assert_eq!((first.index_count, first.first_index), (3 * kind.face_count, kind.first_whole));
            assert_eq!(second.index_count, 0);
            continue;
        }
        let drawn = first.index_count as usize / 3;
        assert!((leaves[0]..=leaves[1]).contains(&drawn), "{drawn}, not {leaves:?} of {share}");
        assert_eq!(first.first_index, kind.first_leaf);
        assert_eq!(t.bark as usize, level);
        let bark = &levels.bark[level];
        assert_eq!(second.index_count as usize, 3 * (bark.kept.len() + bark.new.len()));
        assert_eq!(second.first_index, kind.first_bark[level]);
        bark_levels.insert(level);
    }
    assert!(whole > 0 && whole < total && bark_levels.len() > 1, "{whole} of {total} whole, {bark_levels:?}");
    // Species by species, bin by bin from near to far: a bin spans 1.25 of the distance at this range and less.
    let ordered = |w: &[[f64; 2]]| w[0][0] < w[1][0] || (w[0][0] == w[1][0] && w[1][1] > 0.75 * w[0][1]);
    assert!(distances.windows(2).all(ordered), "{distances:?}");
    let faces: Vec<MeshFace> = gpu.read(&data.faces, 0, kinds[0].face_count as usize).unwrap();
    assert!(faces.iter().any(|f| f.foliage != 0 && f.rank > 0.5));
    drop(renderer);
    gpu.close().unwrap();
}

#[test]
fn near_trees_are_drawn_to_the_bit_as_whole_ones_and_far_ones_cover_as_much() {
    let gpu = device::open();
    let scene = trees(&[[200.0, 200.0, 1.0], [212.0, 206.0, 0.9]], DAY);
    let near = device::camera([203.0, 190.0, 3.0], [206.0, 202.0, 7.0]);
    let [some, whole] = [2.0, 0.0].map(|least| picture(&gpu, &with(&scene, "leaf_pixels", least), &near));
    assert_eq!(some, whole);

    // Trees of 37 pixels, from eight sides. Cards of one and a half pixels are drawn four pixels wide, a seventh of them: some thirty stand on a tree's outline, each of which
    // is there or not with its eight pixels outside of it. That is a standard deviation of sqrt(30) / 2 · 8 = 22 of a tree's 600 pixels, 2.6 % of two trees and 0.9 % of the mean
    // of eight sides, if they were independent; bark of that size lacks twigs of a pixel, up to a hundredth of what is seen.
    let mut ratios = Vec::new();
    for k in 0..8 {
        let (s, c) = (0.7 * f64::from(k)).sin_cos();
        let far = device::camera([206.0 + 52.0 * s, 203.0 + 52.0 * c, 9.0], [206.0, 203.0, 7.5]);
        let cover = |least: f64| {
            let shown = picture(&gpu, &with(&scene, "leaf_pixels", least), &far).linear.unwrap();
            shown.coverage.iter().map(|c| f64::from(*c)).sum::<f64>()
        };
        ratios.push(cover(4.0) / cover(0.0));
    }
    let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
    println!("{mean:.4}: {ratios:.3?}");
    assert!((mean - 1.0).abs() < 0.025, "{mean}: {ratios:?}");
    assert!(ratios.iter().all(|r| *r != 1.0), "nothing was left out: {ratios:?}");
    gpu.close().unwrap();
}

#[test]
fn a_device_that_does_not_count_draws_draws_the_same_bits() {
    let places: Vec<[f64; 3]> =
        (0..12).map(|k| [190.0 + f64::from(k % 4) * 8.0, 30.0 + f64::from(k / 4) * 25.0, 1.0]).collect();
    let scene = trees(&places, NIGHT);
    let camera = device::camera([200.0, 10.0, 4.0], [203.0, 80.0, 8.0]);
    let pictures = [false, true].map(|frugal| {
        let gpu =
            device::open_with(&GpuOptions { validation: Validation::Full, frugal, ..GpuOptions::default() });
        assert_eq!(gpu.info().counted_draws, !frugal);
        let drawn = picture(&gpu, &scene, &camera);
        gpu.close().unwrap();
        drawn
    });
    assert!(pictures[0] == pictures[1]);
}
