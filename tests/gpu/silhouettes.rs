//! Trees on silhouettes: there beyond the hand-over, where they should be, and nowhere else.

use std::collections::HashMap;

use crate::device;
use canopy::camera::Eye;
use canopy::forest::cull::{CLASS_CAMERA, classify, tree_centre};
use canopy::frame::Renderer;
use canopy::gpu::Gpu;
use canopy::gpu::interface::{DrawCommand, Seed, SeedQuad, Tree, View};
use canopy::land::silhouette::clearance;
use canopy::physics::raster::Raster;
use canopy::plan::Plan;
use canopy::scene::{Camera, Distribution, Scene};

const SIZE: [u32; 2] = [320, 240];
/// Samples a side of the terrain, and metres between them.
const CELLS: (u32, f64) = (121, 10.0);

/// A birch forest on 1200 m of a relief.
fn forest(relief: impl Fn(f64, f64) -> f64) -> Scene {
    let mut scene = device::small_scene(
        "seed = 5\n[terrain]\nextent = 1200.0\nalbedo = 0.3\n\
         [[species]]\nname = \"a\"\nmodel = \"builtin:birch\"\ndensity = 0.02\nscale = [0.7, 1.3]\n\
         [sun]\nazimuth = 210.0\nelevation = 35.0\nirradiance = 1.0\n[sky]\nradiance = 0.3\n\
         [[camera]]\nname = \"c\"\nposition = [600.0, 20.0, 60.0]\ntarget = [600.0, 900.0, 60.0]\nvertical_fov = 50.0\n",
    );
    let (side, cell) = CELLS;
    let at = |k: u32| relief(f64::from(k % side) * cell, f64::from(k / side) * cell) as f32;
    scene.terrain.heights =
        Some(Raster { width: side, height: side, samples: (0..side * side).map(at).collect() });
    scene.terrain.cell_size = cell;
    scene
}

/// A ridge across the view, 800 m from the camera, behind a level valley.
fn ridge() -> Scene {
    forest(|x, y| 90.0 * (-((y - 820.0 - 0.05 * x) / 130.0).powi(2)).exp() * (1.0 + 0.15 * (x * 0.02).sin()))
}

/// Sets the range of single trees, m, and that of trees on silhouettes as a multiple.
fn set_range(scene: &mut Scene, range: f64, reach: f64) {
    let height = scene.species[0].mesh.positions.iter().map(|p| p[2]).fold(0.0, f32::max);
    let eye = Eye::new(&scene.cameras[0], &scene.terrain, SIZE);
    let pixels = f64::from(height) * eye.pixels_at_1m / range;
    scene.settings.set("zfield_min_pixels", pixels).unwrap();
    scene.settings.set("silhouette_min_pixels", (pixels / reach).clamp(0.25, 64.0)).unwrap();
}

/// Draws a frame; the camera's trees.
fn trees(gpu: &Gpu, renderer: &mut Renderer, eye: &Eye) -> (Vec<Tree>, View) {
    let (report, view) = renderer.render_eye(eye, 1.0).unwrap();
    let cull = &renderer.forest().unwrap().near.as_ref().unwrap().cull;
    let list: Vec<u32> = gpu.read(&cull.lists, 0, report.trees.camera as usize).unwrap();
    let all: Vec<Tree> = gpu.read(&cull.trees, 0, report.trees.camera as usize).unwrap();
    (list.iter().map(|k| all[*k as usize]).collect(), view)
}

/// Every seed of the frame's quads, and its class on the device.
fn seeds(gpu: &Gpu, renderer: &Renderer) -> Vec<(SeedQuad, Seed, u32)> {
    let forest = renderer.forest().unwrap();
    let capacity = forest.seeds.region_capacity as usize;
    let regions = renderer.plan().seed_regions as usize;
    let all: Vec<Seed> = gpu.read(&forest.seeds.seeds, 0, regions * capacity).unwrap();
    let counts: Vec<DrawCommand> = gpu.read(&forest.seeds.draws, 0, regions).unwrap();
    let quads = &forest.seeds.visible_quads;
    let classes: Vec<u32> =
        gpu.read(&forest.near.as_ref().unwrap().cull.classes, 0, quads.len() * capacity).unwrap();
    let mut found = Vec::new();
    for (k, quad) in quads.iter().enumerate() {
        let region = quad.region as usize;
        for slot in 0..counts[region].index_count as usize / 6 {
            found.push((*quad, all[region * capacity + slot], classes[k * capacity + slot]));
        }
    }
    found
}

fn distance(c: [f32; 3]) -> f64 {
    c.iter().map(|v| f64::from(*v).powi(2)).sum::<f64>().sqrt()
}

#[test]
fn a_far_ridge_keeps_its_trees_before_the_sky() {
    let gpu = device::open();
    let mut scene = ridge();
    let camera = scene.cameras[0].clone();
    let mut draw = |range: f64, reach: f64| {
        set_range(&mut scene, range, reach);
        let mut renderer = device::renderer(&gpu, &scene, &camera, SIZE, true);
        let report = renderer.render(&camera, 1.0).unwrap();
        let picture = renderer.picture().unwrap();
        (picture.linear.unwrap().coverage, report.trees.camera)
    };
    // The ridge is at one and a half times the range, or within it.
    let (lifted, few) = draw(530.0, 0.01);
    let (kept, some) = draw(530.0, 3.0);
    let (reference, many) = draw(1500.0, 0.01);
    scene.species.clear();
    let mut renderer = device::renderer(&gpu, &scene, &camera, SIZE, true);
    renderer.render(&camera, 1.0).unwrap();
    let fractions = renderer.picture().unwrap().linear.unwrap().fractions;
    let bare: Vec<f32> = fractions.iter().map(|f| f.iter().sum()).collect();
    drop(renderer);
    println!("{few} trees within the range, {some} with silhouettes, {many} everywhere");
    assert!(some > few + 100 && some - few < (many - few) / 4, "{few} {some} {many}");
    let at = |image: &[f32], x: u32, y: u32| f64::from(image[(y * SIZE[0] + x) as usize]);
    // The sky begins where no coverage is; of each column, the highest pixel that is half covered.
    let top = |image: &[f32], x: u32| (0..SIZE[1]).find(|y| at(image, x, *y) > 0.5).unwrap_or(SIZE[1]);
    let (mut sum, mut rise, mut same, mut stand) = ([0.0; 3], 0.0, 0, 0);
    for x in 0..SIZE[0] {
        let line = top(&bare, x);
        for (total, image) in sum.iter_mut().zip([&lifted, &kept, &reference]) {
            *total += (0..line).map(|y| at(image, x, y)).sum::<f64>();
        }
        let [got, want] = [&kept, &reference].map(|image| top(image, x));
        rise += f64::from(line) - f64::from(want);
        same += u32::from(got.abs_diff(want) <= 1);
        stand += u32::from(top(&lifted, x).abs_diff(want) <= 1);
    }
    println!("coverage above the bare line {sum:?}, rise {rise}, {same} and {stand} columns of equal height");
    assert!(rise > 1.5 * f64::from(SIZE[0]), "crowns rise by pixels: {rise}");
    assert!(same > SIZE[0] * 95 / 100, "{same}");
    assert!((sum[1] - sum[2]).abs() < 0.05 * sum[2], "{sum:?}");
    // Where none is looked for, the shader-map has them all, of one height.
    assert!((sum[0] - sum[2]).abs() < 0.15 * sum[2] && stand > SIZE[0] * 9 / 10, "{sum:?}, {stand}");
    gpu.close().unwrap();
}

#[test]
fn ground_that_faces_the_camera_and_level_ground_keep_none() {
    let gpu = device::open();
    for (name, slope) in [("inclined", 0.3), ("level", 0.0)] {
        let mut scene = forest(|_, y| slope * y);
        set_range(&mut scene, 200.0, 2.0);
        let camera = scene.cameras[0].clone();
        let mut renderer = device::renderer(&gpu, &scene, &camera, SIZE, false);
        let eye = Eye::new(&camera, &scene.terrain, SIZE);
        assert!(renderer.plan().last_range() > 350.0);
        let (found, _) = trees(&gpu, &mut renderer, &eye);
        let farthest = found.iter().map(|t| distance(t.centre)).fold(0.0, f64::max);
        println!("{name}: {} trees to {farthest} m", found.len());
        assert!(found.len() > 50 && farthest < renderer.plan().range, "{name}: {farthest}");
    }
    gpu.close().unwrap();
}

/// Hills with crests at many distances.
fn hills() -> Scene {
    let mut scene = forest(|x, y| {
        35.0 * (x * 0.021).sin() * (y * 0.017 + 0.5).cos() + 12.0 * (x * 0.05 + y * 0.043).sin()
    });
    // Dense, so that seed quads are small.
    if let Distribution::Density { max_density, .. } = &mut scene.species[0].distribution {
        *max_density = 0.1;
    }
    set_range(&mut scene, 250.0, 4.0);
    scene
}

fn cameras() -> [(&'static str, Camera); 5] {
    [
        ("from a valley", device::camera([600.0, 30.0, 8.0], [600.0, 900.0, 20.0])),
        ("from a hill", device::camera([75.0, 60.0, 25.0], [900.0, 900.0, -10.0])),
        ("from above", device::camera([600.0, 100.0, 250.0], [600.0, 700.0, 0.0])),
        ("from outside", device::camera([-150.0, 500.0, 60.0], [600.0, 600.0, 0.0])),
        ("down", device::camera([600.0, 600.0, 500.0], [601.0, 600.0, 0.0])),
    ]
}

#[test]
fn the_device_keeps_exactly_the_trees_of_the_cpu() {
    let gpu = device::open();
    let scene = hills();
    let mut renderer = device::renderer(&gpu, &scene, &scene.cameras[0], SIZE, false);
    for (name, camera) in cameras() {
        let eye = Eye::new(&camera, &scene.terrain, SIZE);
        let (found, view) = trees(&gpu, &mut renderer, &eye);
        let rows = &renderer.forest().unwrap().species.rows;
        for (quad, seed, class) in seeds(&gpu, &renderer) {
            let kind = &rows[device::species(&seed)];
            let centre = tree_centre(&view, &quad, &seed, kind);
            let want = classify(&view, &quad, &seed, kind, centre, scene.terrain.heights.as_ref());
            assert_eq!(class, want, "{name}: {seed:?} at {centre:?}");
        }
        let beyond = found.iter().filter(|t| distance(t.centre) > renderer.plan().range).count();
        println!("{name}: {beyond} of {} trees stand on silhouettes", found.len());
        assert!(beyond > 20 || name == "down" || name == "from above", "{name} tests nothing");
    }
    drop(renderer);
    gpu.close().unwrap();
}

/// Whether terrain hides a point from the eye.
fn hidden(scene: &Scene, eye: &Eye, centre: [f32; 3], height: f64) -> bool {
    let [x, y, z] = centre.map(f64::from);
    (1..2000).any(|k| {
        let s = f64::from(k) / 2000.0;
        let ground = scene.terrain.height_at(eye.position[0] + s * x, eye.position[1] + s * y);
        eye.position[2] + s * (z + 0.5 * height) < ground
    })
}

#[test]
fn no_quad_with_a_tree_on_a_silhouette_in_view_is_left_out() {
    let gpu = device::open();
    let scene = hills();
    let mut everywhere = scene.clone();
    set_range(&mut everywhere, 3000.0, 0.01);
    for (name, camera) in cameras() {
        let eye = Eye::new(&camera, &scene.terrain, SIZE);
        let mut renderer = device::renderer(&gpu, &scene, &camera, SIZE, false);
        let (found, view) = trees(&gpu, &mut renderer, &eye);
        let found: HashMap<u32, f32> = found.iter().map(|t| (t.identity, t.fade)).collect();
        let mut all = device::renderer(&gpu, &everywhere, &camera, SIZE, false);
        all.render_eye(&eye, 1.0).unwrap();
        assert_eq!(all.plan().quad_side, renderer.plan().quad_side);
        let (mut kept, mut missing) = (0, 0);
        for (quad, seed, class) in seeds(&gpu, &all) {
            let kind = &renderer.forest().unwrap().species.rows[device::species(&seed)];
            let centre = tree_centre(&view, &quad, &seed, kind);
            let height = 2.0 * kind.scale_to_metres[2] * seed.scale;
            let d = distance(centre);
            let least =
                clearance(&view, &quad, &seed, centre, height, scene.terrain.heights.as_ref().unwrap());
            // In view, and far from where it fades.
            if class & CLASS_CAMERA == 0
                || d < 260.0
                || d > 0.85 * renderer.plan().last_range()
                || least < 0.05 * height
            {
                continue;
            }
            if hidden(&scene, &eye, centre, f64::from(height)) {
                continue;
            }
            kept += 1;
            if !found.contains_key(&seed.identity) {
                missing += 1;
                println!("{centre:?} clearance {} of {height}", least / height);
            }
        }
        println!("{name}: {missing} of {kept} are missing");
        assert!(missing == 0, "{name}: {missing} of {kept}");
    }
    gpu.close().unwrap();
}

#[test]
fn opacities_change_little_under_a_small_move() {
    let gpu = device::open();
    let scene = hills();
    let camera = cameras()[1].1.clone();
    let mut renderer = device::renderer(&gpu, &scene, &camera, SIZE, false);
    let half = f64::from(renderer.forest().unwrap().species.rows[0].scale_to_metres[2]);
    let start = Eye::new(&camera, &scene.terrain, SIZE);
    let mut before: Option<HashMap<u32, Tree>> = None;
    let (mut worst, mut changed) = (0.0f32, 0);
    for k in 0..12 {
        // A tenth of a metre a frame: of the clearance, at most that much times t / d of the last step.
        let step = f64::from(k) * 0.1;
        let at = [start.position[0] + step, start.position[1] - 0.5 * step, start.position[2] + 0.4 * step];
        let eye = Eye { position: at, ..start };
        let (found, _) = trees(&gpu, &mut renderer, &eye);
        let now: HashMap<u32, Tree> =
            found.iter().filter(|t| distance(t.centre) > 240.0).map(|t| (t.identity, *t)).collect();
        if let Some(before) = &before {
            // Trees at the image's edge come and go whole.
            let middle = |t: &Tree| {
                let [r, u, f] = [eye.right, eye.up, eye.forward]
                    .map(|a| (0..3).map(|k| a[k] * f64::from(t.centre[k])).sum::<f64>());
                r.abs() < (eye.tangents[0] * f - 20.0) && u.abs() < (eye.tangents[1] * f - 20.0)
            };
            for id in now.keys().chain(before.keys()) {
                let of = |all: &HashMap<u32, Tree>| all.get(id).map_or(0.0, |t| t.fade);
                let change = (of(&now) - of(before)).abs();
                changed += u32::from(change > 0.0);
                let tree = now.get(id).or(before.get(id)).unwrap();
                if change > worst
                    && middle(tree)
                    && !hidden(&scene, &eye, tree.centre, 2.0 * half * f64::from(tree.scale))
                {
                    worst = change;
                }
            }
        }
        before = Some(now);
    }
    println!("largest change {worst}, {changed} changes");
    assert!(changed > 100, "tests nothing");
    // Clearance in tree heights changes by at most 0.13 m * (1 + 64 L / d) / H of 10 m, and opacity 3 times as much.
    assert!(worst < 0.25, "{worst}");
    drop(renderer);
    gpu.close().unwrap();
}

#[test]
fn quads_are_dropped_from_the_far_end_when_regions_are_few() {
    let gpu = device::open();
    let scene = hills();
    let camera = cameras()[1].1.clone();
    let eye = Eye::new(&camera, &scene.terrain, SIZE);
    let baked = device::bake(&scene);
    let full = Plan::new(&scene, &camera, SIZE, false, Some(gpu.info())).unwrap();
    let draw = |mut plan: Plan| {
        plan.list(&scene);
        let mut renderer = Renderer::new(&gpu, scene.clone().into(), plan, &baked).unwrap();
        let (report, _) = renderer.render_eye(&eye, 1.0).unwrap();
        (report.seed_quads, report.trees.camera)
    };
    let mut none = full.clone();
    none.silhouette_ratio = 1.0;
    let (near, fewest) = draw(none);
    let (quads, most) = draw(full.clone());
    assert!(quads > near + 1 && most > fewest, "{near} {quads}");
    let mut few = full;
    // Those for quads that only cast are not the camera's.
    (few.shadow_quads, few.silhouette_quads) = (8, 1);
    few.seed_regions = near + few.silhouette_quads + few.shadow_quads;
    let (quads, some) = draw(few);
    assert!(quads == near + 1 && some < most && some >= fewest, "{quads} {fewest} {some} {most}");
    gpu.close().unwrap();
}
