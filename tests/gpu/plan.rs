//! What a scene does not require is neither planned, allocated nor drawn.

use crate::device;
use canopy::gpu::Gpu;
use canopy::plan::Plan;
use canopy::scene::{Distribution, Scene};

fn scene() -> Scene {
    device::small_scene(
        "seed = 4\n[terrain]\nextent = 300.0\nalbedo = 0.2\n\
         [[species]]\nname = \"a\"\nmodel = \"builtin:birch\"\ndensity = 0.03\n\
         [sun]\nazimuth = 210.0\nelevation = 25.0\nirradiance = 1.0\n[sky]\nradiance = 0.1\n\
         [[camera]]\nname = \"c\"\nposition = [40.0, 60.0, 15.0]\ntarget = [150.0, 180.0, 0.0]\nvertical_fov = 50.0\n",
    )
}

struct Drawn {
    items: Vec<String>,
    passes: Vec<String>,
    allocated: Vec<(String, u64)>,
    planned: u64,
}

/// Plans, builds and draws; the frame's passes are those of the plan.
fn draw(gpu: &Gpu, scene: &Scene) -> Drawn {
    let camera = &scene.cameras[0];
    let mut renderer = device::renderer(gpu, scene, camera, [64, 48], false);
    let report = renderer.render(camera, 1.0).unwrap();
    let plan = renderer.plan();
    let passes: Vec<String> = report.timing.passes.iter().map(|p| p.name.clone()).collect();
    let planned: Vec<String> =
        plan.items.iter().filter(|i| i.kind == "pass").map(|i| i.name.clone()).collect();
    assert_eq!(passes, planned, "what is drawn is what is planned, in order");
    assert!(plan.items.iter().all(|i| !i.reason.is_empty()));
    Drawn {
        items: plan.items.iter().filter(|i| i.kind != "pass").map(|i| i.name.clone()).collect(),
        passes,
        allocated: gpu.memory_report(),
        planned: plan.bytes(),
    }
}

impl Drawn {
    fn has(&self, item: &str) -> bool {
        self.items.iter().any(|i| i == item)
    }

    fn draws(&self, pass: &str) -> bool {
        self.passes.iter().any(|p| p == pass)
    }

    /// Bytes of the allocations of a name.
    fn bytes(&self, name: &str) -> u64 {
        self.allocated.iter().filter(|(n, _)| n == name).map(|(_, b)| b).sum()
    }
}

#[test]
fn without_a_sun_there_are_no_shadows() {
    let gpu = device::open();
    let mut scene = scene();
    let day = draw(&gpu, &scene);
    assert!(day.has("shadow cascades") && day.draws("shadows") && day.bytes("shadow cascades") > 1 << 18);
    for (elevation, irradiance) in [(-5.0, 1.0), (25.0, 0.0)] {
        scene.sun.elevation = elevation;
        scene.sun.irradiance = [irradiance; 3];
        let night = draw(&gpu, &scene);
        assert!(!night.has("shadow cascades") && !night.draws("shadows"));
        // One texel stands for the map that nobody reads.
        assert!(night.bytes("shadow cascades") < 1 << 16 && night.bytes("shadow depth") == 0);
        assert!(night.planned < day.planned);
    }
    gpu.close().unwrap();
}

#[test]
fn without_trees_there_is_no_forest() {
    let gpu = device::open();
    let mut scene = scene();
    let forest = draw(&gpu, &scene);
    let tree_passes =
        ["seeds", "coverage tiles", "cull", "prefix sums", "draw commands", "compact", "shader-map", "trees"];
    let tree_items = [
        "z-field views of a",
        "seeds",
        "coverage tiles",
        "coverage sums",
        "point pattern",
        "trees and lists",
        "forest tables of a",
        "shader-map nodes",
    ];
    assert!(tree_passes.iter().all(|p| forest.draws(p)), "{:?}", forest.passes);
    assert!(tree_items.iter().all(|p| forest.has(p)), "{:?}", forest.items);
    if let Distribution::Density { max_density, .. } = &mut scene.species[0].distribution {
        *max_density = 0.0;
    }
    let thinned = draw(&gpu, &scene);
    scene.species.clear();
    for bare in [thinned, draw(&gpu, &scene)] {
        assert!(!tree_passes.iter().any(|p| bare.draws(p)), "{:?}", bare.passes);
        assert!(!tree_items.iter().any(|p| bare.has(p)), "{:?}", bare.items);
        let names = [
            "seeds",
            "trees",
            "z-field views",
            "coverage tiles",
            "coverage sums",
            "pair tables",
            "view tables",
            "shader-map nodes",
        ];
        for name in names {
            assert!(forest.bytes(name) > 0, "{name}");
            assert_eq!(bare.bytes(name), 0, "{name}");
        }
        assert!(bare.draws("shadows"), "the ground still casts");
    }
    gpu.close().unwrap();
}

#[test]
fn a_listed_forest_needs_no_pattern_and_a_plain_no_height_map() {
    let gpu = device::open();
    let mut scene = scene();
    let thinned = draw(&gpu, &scene);
    assert!(thinned.has("point pattern") && !thinned.has("height map") && !thinned.has("density maps"));
    let tree = canopy::scene::TreePosition { x: 150.0, y: 150.0, scale: None, rotation: None };
    scene.species[0].distribution = Distribution::Positions(vec![tree; 1].into());
    let listed = draw(&gpu, &scene);
    assert!(!listed.has("point pattern") && listed.draws("seeds"));
    assert!(listed.has("density maps"), "how densely listed trees stand");
    let (width, height) = (11, 11);
    scene.terrain.heights = Some(canopy::scene::Raster { width, height, samples: vec![1.0; 121] });
    scene.terrain.cell_size = 30.0;
    assert!(draw(&gpu, &scene).has("height map"));
    gpu.close().unwrap();
}

#[test]
fn a_range_beyond_the_terrain_does_not_coarsen_the_seed_quads() {
    let mut scene = scene();
    scene.terrain.extent = [400.0; 2];
    scene.settings.set("zfield_min_pixels", 0.25).unwrap();
    let far = canopy::scene::Camera { vertical_fov: 1.0, ..scene.cameras[0].clone() };
    let plan = |camera| Plan::new(&scene, camera, [640, 480], false, None).unwrap();
    let (near, far) = (plan(&scene.cameras[0]), plan(&far));
    assert!(far.range > 1e5 && near.range > 1e3, "{} {}", near.range, far.range);
    // Four Wang tiles of 256 points, 0.03 a square metre: 370 m. A range of 10^5 m is 24 quads of 5 km.
    assert!(far.quad_side < 400.0 && near.quad_side == far.quad_side, "{} {}", near.quad_side, far.quad_side);
    assert_eq!(far.seed_regions, 4, "every quad that exists");
}

#[test]
fn the_plan_knows_what_will_be_allocated() {
    let gpu = device::open();
    let scene = scene();
    let drawn = draw(&gpu, &scene);
    let allocated: u64 = drawn.allocated.iter().map(|(_, b)| b).sum();
    println!("planned {} KiB, allocated {} KiB", drawn.planned >> 10, allocated >> 10);
    // Small buffers (view, indices, tables) are not worth an item each: a tenth, and a MiB.
    assert!(allocated <= drawn.planned + drawn.planned / 10 + (1 << 20), "{:?}", drawn.allocated);
    gpu.close().unwrap();
}

#[test]
fn a_plan_beyond_the_budget_is_refused_with_its_largest_items() {
    let gpu = device::open();
    let mut scene = scene();
    scene.settings.set("memory_mib", 16.0).unwrap();
    scene.settings.set("cascade_size", 8192.0).unwrap();
    let e = Plan::new(&scene, &scene.cameras[0], [64, 48], false, Some(gpu.info())).unwrap_err();
    assert_eq!(e.exit_code(), 2);
    assert!(e.to_string().contains("shadow cascades"), "{e}");
    gpu.close().unwrap();
}
