//! The culled set and its order, exactly those of the CPU.

use crate::device;
use canopy::camera::Eye;
use canopy::forest::cull::{bin_end, classify, tree_centre};
use canopy::frame::Renderer;
use canopy::gpu::Gpu;
use canopy::gpu::interface::{CAMERA_DRAWS, CULL_GROUP, DISTANCE_BINS, DrawCommand, TREE_LISTS, Tree, View};
use canopy::physics::raster::Raster;
use canopy::plan::Plan;
use canopy::scene::{Camera, Distribution, Scene, TreePosition};
use std::sync::Arc;

/// Hills of 900 m with a dense species and a listed one.
fn hills() -> Scene {
    let mut scene = device::small_scene(
        "seed = 3\n[terrain]\nextent = 900.0\nalbedo = 0.2\n\
         [[species]]\nname = \"a\"\nmodel = \"builtin:birch\"\ndensity = 0.03\nscale = [0.5, 1.5]\n\
         [[species]]\nname = \"b\"\nmodel = \"builtin:birch\"\ndensity = 0.0\n\
         [sun]\nazimuth = 210.0\nelevation = 25.0\nirradiance = 1.0\n[sky]\nradiance = 0.1\n\
         [[camera]]\nname = \"c\"\nposition = [0.0, 0.0, 10.0]\ntarget = [9.0, 9.0, 5.0]\nvertical_fov = 50.0\n",
    );
    let (width, height) = (31, 31);
    let samples = (0..width * height)
        .map(|k: u32| (40.0 * (f64::from(k % width) * 0.4).sin() * (f64::from(k / width) * 0.3).cos()) as f32)
        .collect();
    scene.terrain.heights = Some(Raster { width, height, samples });
    scene.terrain.cell_size = 30.0;
    let place = |k: u32| TreePosition {
        x: f64::from(k % 60) * 15.0,
        y: f64::from(k / 60) * 21.0,
        scale: k.is_multiple_of(3).then_some(0.2 + (k % 7) as f32),
        rotation: None,
    };
    scene.species[1].distribution = Distribution::Positions(Arc::new((0..2400).map(place).collect()));
    scene
}

/// Compares everything that the cull wrote with what the CPU says; returns the number of trees that are seen.
fn check(gpu: &Gpu, renderer: &Renderer, view: &View) -> usize {
    let forest = renderer.forest().unwrap();
    let (seeds, cull) = (&forest.seeds, &forest.near.as_ref().unwrap().cull);
    let capacity = seeds.region_capacity as usize;
    let plan = renderer.plan();
    let all: Vec<canopy::gpu::interface::Seed> =
        gpu.read(&seeds.seeds, 0, plan.seed_regions as usize * capacity).unwrap();
    let counts: Vec<DrawCommand> = gpu.read(&seeds.draws, 0, plan.seed_regions as usize).unwrap();
    let classes: Vec<u32> = gpu.read(&cull.classes, 0, seeds.visible as usize * capacity).unwrap();
    assert_eq!(capacity % CULL_GROUP as usize, 0);
    assert_eq!(seeds.visible_quads.len(), seeds.visible as usize);

    let mut lists: Vec<Vec<u32>> = vec![Vec::new(); TREE_LISTS as usize];
    let mut records = Vec::new();
    for (k, quad) in seeds.visible_quads.iter().enumerate() {
        let count = counts[quad.region as usize].index_count as usize / 6;
        for slot in 0..capacity {
            let got = classes[k * capacity + slot];
            if slot >= count {
                assert_eq!(got, 0, "quad {k}: no seed in slot {slot}");
                continue;
            }
            let seed = all[quad.region as usize * capacity + slot];
            let kind = &forest.species.rows[device::species(&seed)];
            let centre = tree_centre(view, quad, &seed, kind);
            let want = classify(view, quad, &seed, kind, centre, renderer.scene().terrain.heights.as_ref());
            assert_eq!(got, want, "quad {k} slot {slot} at {centre:?}");
            if want == 0 {
                continue;
            }
            let index = records.len() as u32;
            records.push((seed, centre));
            lists[0].push(index);
            lists[1 + (want & 31) as usize].push(index);
        }
    }

    let totals: Vec<u32> = gpu.read(&cull.totals, 0, TREE_LISTS as usize).unwrap();
    assert_eq!(totals, lists.iter().map(|l| l.len() as u32).collect::<Vec<_>>());
    let trees: Vec<Tree> = gpu.read(&cull.trees, 0, records.len()).unwrap();
    for (k, (tree, (seed, centre))) in trees.iter().zip(&records).enumerate() {
        assert_eq!(
            (tree.identity, tree.species, tree.scale),
            (seed.identity, device::species(seed) as u32, seed.scale),
            "tree {k}"
        );
        assert_eq!(tree.centre, *centre, "tree {k}");
        let angle = f64::from(seed.turn_tint & 0xffff) * std::f64::consts::TAU / 65536.0;
        for (got, want) in tree.turn.iter().zip([angle.cos(), angle.sin()]) {
            // sin and cos within 2^-11 in Vulkan; outside [-pi, pi] no more is promised, so a little is added.
            assert!((f64::from(*got) - want).abs() < 1e-3, "tree {k}: {:?} {angle}", tree.turn);
        }
    }

    // The camera's list: bin after bin, nearest first; in a bin in the order of seeds.
    let camera: Vec<u32> = lists[1..1 + DISTANCE_BINS as usize].concat();
    assert_eq!(gpu.read::<u32>(&cull.lists, 0, camera.len()).unwrap(), camera);
    let bin = |tree: u32| {
        let c = records[tree as usize].1;
        let d2 = (c[0] * c[0] + c[1] * c[1]) + c[2] * c[2];
        (0..DISTANCE_BINS as usize - 1).filter(|k| d2 > view.bins[k / 4][k % 4]).count()
    };
    assert!(camera.windows(2).all(|w| bin(w[0]) <= bin(w[1])), "not front to back");
    // Four draws of it: the bins that hold a tree of magnified texels; of those beyond, the bins of more than a few pixels;
    // those of only a few; and those where all light is the average.
    let first_from = |distance: f64| {
        (1..DISTANCE_BINS).find(|b| bin_end(b - 1, plan.last_range()) >= distance).unwrap_or(DISTANCE_BINS)
    };
    assert!(plan.draw_limits.is_sorted(), "{:?}", plan.draw_limits);
    let limits = plan.draw_limits.map(first_from);
    let ends: [u32; CAMERA_DRAWS as usize] = [limits[0], limits[1], limits[2], DISTANCE_BINS];
    let mut commands = Vec::new();
    let mut first = 0;
    for end in ends {
        let count = lists[1..1 + end as usize].iter().map(Vec::len).sum::<usize>() as u32;
        commands.push((6 * (count - first), 4 * first as i32));
        first = count;
    }
    let found: Vec<DrawCommand> = gpu.read(&cull.commands, 0, commands.len()).unwrap();
    let want: Vec<DrawCommand> = commands
        .into_iter()
        .map(|(index_count, vertex_offset)| DrawCommand {
            index_count,
            instance_count: 1,
            first_index: 0,
            vertex_offset,
            first_instance: 0,
        })
        .collect();
    assert_eq!(found, want);
    camera.len()
}

#[test]
fn the_culled_set_and_its_order_are_those_of_the_cpu() {
    let gpu = device::open();
    let scene = hills();
    let cameras = [
        ("inside the forest", device::camera([450.0, 450.0, 3.0], [500.0, 470.0, 3.0])),
        ("aerial", device::camera([430.0, 300.0, 220.0], [450.0, 460.0, 0.0])),
        ("grazing", device::camera([20.0, 20.0, 0.5], [800.0, 700.0, 1.0])),
        ("straight down", device::camera([451.0, 449.0, 150.0], [451.0, 449.0, 0.0])),
        ("beside the terrain", device::camera([-60.0, 400.0, 30.0], [200.0, 420.0, 0.0])),
        ("away from everything", device::camera([450.0, -90.0, 5.0], [450.0, -900.0, 5.0])),
    ];
    let mut renderer = device::renderer(&gpu, &scene, &cameras[0].1, [96, 64], false);
    for (name, camera) in &cameras {
        let eye = Eye::new(camera, &scene.terrain, [96, 64]);
        let (report, view) = renderer.render_eye(&eye, 1.0).unwrap();
        let seen = check(&gpu, &renderer, &view);
        println!("{name}: {seen} seen");
        assert_eq!(report.trees.camera as usize, seen);
        if *name != "away from everything" {
            assert!(seen > 20, "{name} tests nothing");
        } else {
            assert_eq!(seen, 0);
        }
    }
    drop(renderer);
    gpu.close().unwrap();
}

#[test]
fn trees_a_thousand_kilometres_away_are_culled_as_the_cpu_does() {
    let gpu = device::open();
    let mut scene = hills();
    scene.terrain.heights = None;
    let Distribution::Positions(listed) = scene.species[1].distribution.clone() else { unreachable!() };
    scene.species.remove(0);
    scene.species[0].distribution = Distribution::Positions(listed);
    scene.settings.set("zfield_min_pixels", 0.25).unwrap();
    // A telescope: a tree of 14 m is 0.8 pixels high.
    let camera = Camera { vertical_fov: 0.04, ..device::camera([-1e6, 450.0, 2e4], [450.0, 450.0, 0.0]) };
    let mut renderer = device::renderer(&gpu, &scene, &camera, [64, 64], false);
    let eye = Eye::new(&camera, &scene.terrain, [64, 64]);
    let (_, view) = renderer.render_eye(&eye, 1.0).unwrap();
    let seen = check(&gpu, &renderer, &view);
    println!("{seen} seen");
    assert!(seen > 100, "{seen}");
    drop(renderer);
    gpu.close().unwrap();
}

#[test]
fn the_sets_of_two_frames_do_not_depend_on_what_came_between() {
    let gpu = device::open();
    let scene = hills();
    let home = device::camera([450.0, 450.0, 3.0], [500.0, 470.0, 3.0]);
    let mut renderer = device::renderer(&gpu, &scene, &home, [96, 64], false);
    let mut trees = |camera: &Camera| -> Vec<Tree> {
        let eye = Eye::new(camera, &scene.terrain, [96, 64]);
        let (report, _) = renderer.render_eye(&eye, 1.0).unwrap();
        let forest = renderer.forest().unwrap();
        gpu.read(&forest.near.as_ref().unwrap().cull.trees, 0, report.trees.camera as usize).unwrap()
    };
    let first = trees(&home);
    trees(&device::camera([100.0, 800.0, 90.0], [300.0, 300.0, 0.0]));
    assert_eq!(trees(&home), first);
    drop(renderer);
    gpu.close().unwrap();
}

#[test]
fn trees_on_the_very_border_of_the_view_are_in_or_out_as_the_cpu_says() {
    let gpu = device::open();
    let mut scene = hills();
    scene.terrain.heights = None;
    scene.species.remove(0);
    let camera = device::camera([451.3, 200.7, 8.0], [480.0, 500.0, 3.0]);
    let eye = Eye::new(&camera, &scene.terrain, [96, 64]);
    let mut renderer = device::renderer(&gpu, &scene, &camera, [96, 64], false);
    let (_, view) = renderer.render_eye(&eye, 1.0).unwrap();
    let kind = renderer.forest().unwrap().species.rows[0];
    drop(renderer);
    // Along the left and right planes at a bounding radius outside, and around the range; off by a few roundings of a
    // position, so that the order of operations decides.
    let (radius, z) = (f64::from(kind.bounding_radius), f64::from(kind.centre) - eye.position[2]);
    let mut list = Vec::new();
    for k in 0..6000u32 {
        let off = (f64::from(k % 61) - 30.0) * 2e-6;
        let along = 20.0 + f64::from(k / 3) * 0.1;
        let [x, y] = if k % 3 < 2 {
            let p = view.planes[(k % 3) as usize].map(f64::from);
            [-(radius + off + p[1] * along + p[2] * z) / p[0], along]
        } else {
            let flat = ((f64::from(kind.range) + off).powi(2) - z * z).sqrt();
            let angle = 0.3 * (f64::from(k) / 6000.0 - 0.5) + 0.095;
            [flat * angle.sin(), flat * angle.cos()]
        };
        list.push(TreePosition {
            x: eye.position[0] + x,
            y: eye.position[1] + y,
            scale: Some(1.0),
            rotation: None,
        });
    }
    list.retain(|t| [t.x, t.y].iter().all(|v| (0.0..=900.0).contains(v)));
    let placed = list.len();
    scene.species[0].distribution = Distribution::Positions(Arc::new(list));
    let mut renderer = device::renderer(&gpu, &scene, &camera, [96, 64], false);
    let (_, view) = renderer.render_eye(&eye, 1.0).unwrap();
    let seen = check(&gpu, &renderer, &view);
    println!("{seen} of {placed} on the border are seen");
    assert!(placed > 2000 && seen > placed / 5 && seen < placed * 4 / 5);
    drop(renderer);
    gpu.close().unwrap();
}

#[test]
fn sums_over_many_workgroups_are_right_to_the_last() {
    let gpu = device::open();
    let mut scene = hills();
    scene.terrain.heights = None;
    scene.species.remove(1);
    if let Distribution::Density { max_density, .. } = &mut scene.species[0].distribution {
        *max_density = 0.2;
    }
    scene.settings.set("zfield_min_pixels", 0.25).unwrap();
    let above = |side: f64| Camera {
        vertical_fov: 120.0,
        ..device::camera([0.5 * side, 0.5 * side, 0.6 * side], [0.5 * side, 0.5 * side, 0.0])
    };
    // Sixteen whole quads of 4096 points, sixteen workgroups each: one a thread of the prefix sum, and seeds in the last.
    let plan =
        |scene: &Scene, side| Plan::new(scene, &above(side), [48, 48], false, Some(gpu.info())).unwrap();
    let side = 4.0 * plan(&scene, 450.0).quad_side;
    scene.terrain.extent = [side; 2];
    let (camera, mut plan) = (above(side), plan(&scene, side));
    plan.region_capacity = 16 * CULL_GROUP;
    plan.caster_capacity = 16 * plan.region_capacity;
    plan.list(&scene);
    let baked = device::bake(&scene);
    let mut renderer = Renderer::new(&gpu, Arc::new(scene.clone()), plan, &baked).unwrap();
    let (report, view) = renderer.render_eye(&Eye::new(&camera, &scene.terrain, [48, 48]), 1.0).unwrap();
    assert_eq!(report.seed_quads, 16);
    let seen = check(&gpu, &renderer, &view);
    println!("{seen} seen");
    assert!(seen > 30_000);
    drop(renderer);
    gpu.close().unwrap();
}
