//! What a scene does not require is neither planned, allocated nor drawn; and what is left out changes no bit of the image.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::device;
use canopy::Error;
use canopy::camera::Eye;
use canopy::frame::Renderer;
use canopy::gpu::{Description, Gpu};
use canopy::image::{Linear, Picture};
use canopy::ladder::Ladder;
use canopy::physics::raster::Raster;
use canopy::plan::names::{pass, pipeline, resource};
use canopy::plan::{Drawing, Plan, Rasterizer, TileBuffers};
use canopy::scene::{Camera, Distribution, Scene};

const SIZE: [u32; 2] = [64, 48];
const RASTERIZERS: [Rasterizer; 2] = [Rasterizer::Graphics, Rasterizer::Tiles];

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
    pipelines: Vec<&'static str>,
    planned: u64,
    /// The same by buffer and image.
    described: BTreeMap<&'static str, u64>,
}

/// Bytes that a plan describes, by buffer and image.
fn described(plan: &Plan) -> BTreeMap<&'static str, u64> {
    let mut all = BTreeMap::new();
    for item in &plan.items {
        for d in &item.allocations {
            *all.entry(d.name()).or_default() += d.bytes() / u64::from(item.shares);
        }
    }
    all
}

/// Plans, builds and draws.
fn draw(gpu: &Gpu, scene: &Scene, rasterizer: Rasterizer) -> Drawn {
    let eye = Eye::new(&scene.cameras[0], &scene.terrain, SIZE);
    let plan = Plan::for_eye(scene, &eye, false, rasterizer, Some(gpu.info())).unwrap();
    drawn(gpu, scene, plan).0
}

/// Builds and draws what is planned; the frame's passes are those of the plan.
fn drawn(gpu: &Gpu, scene: &Scene, plan: Plan) -> (Drawn, Picture) {
    let mut renderer = Renderer::new(gpu, Arc::new(scene.clone()), plan, &device::bake(scene)).unwrap();
    let report = renderer.render(&scene.cameras[0], 1.0).unwrap();
    let plan = renderer.plan();
    let passes: Vec<String> = report.timing.passes.iter().map(|p| p.name.clone()).collect();
    let planned: Vec<String> =
        plan.items.iter().filter(|i| i.kind == "pass").map(|i| i.name.clone()).collect();
    assert_eq!(passes, planned, "what is drawn is what is planned, in order");
    assert!(plan.items.iter().all(|i| !i.reason.is_empty()));
    let drawn = Drawn {
        items: plan.items.iter().filter(|i| i.kind != "pass").map(|i| i.name.clone()).collect(),
        passes,
        allocated: gpu.memory_report(),
        pipelines: gpu.pipelines().into_iter().map(|p| p.0).collect(),
        planned: plan.bytes(),
        described: described(plan),
    };
    (drawn, renderer.picture().unwrap())
}

/// The picture under a plan whose numbers were changed: it need not list the passes that are drawn.
fn picture(gpu: &Gpu, scene: &Scene, mut plan: Plan) -> Picture {
    plan.list(scene);
    let mut renderer = Renderer::new(gpu, Arc::new(scene.clone()), plan, &device::bake(scene)).unwrap();
    renderer.render(&scene.cameras[0], 1.0).unwrap();
    renderer.picture().unwrap()
}

/// The plan of the scene's camera, with layers.
fn planned(gpu: &Gpu, scene: &Scene, how: impl Into<Drawing>) -> Plan {
    let eye = Eye::new(&scene.cameras[0], &scene.terrain, SIZE);
    Plan::for_eye(scene, &eye, true, how, Some(gpu.info())).unwrap()
}

/// Most bytes that textures of a texel take, of which there are a few: on a GPU each is padded to some hundreds.
fn texel(gpu: &Gpu) -> u64 {
    if gpu.info().kind == "cpu" { 1024 } else { 2048 }
}

/// All but the fractions, which tell lit from shadowed where there is no sun too. The two are drawn by other variants of a program, in
/// which a GPU's compiler may make one operation of others: there a half float may differ by a step, and a shown colour by one.
fn same_light(gpu: &Gpu, a: &Picture, b: &Picture) -> bool {
    let step = if gpu.info().kind == "cpu" { 0.0 } else { 1.0 / 1024.0 };
    let near = |a: &[[f32; 3]], b: &[[f32; 3]]| {
        let mut all = a.iter().flatten().zip(b.iter().flatten());
        all.all(|(a, b)| (a - b).abs() <= step * a.abs().max(b.abs()))
    };
    let shown =
        a.display.iter().zip(&b.display).all(|(a, b)| u32::from(a.abs_diff(*b)) <= (step > 0.0) as u32);
    let seen = |p: &Picture| {
        let l = p.linear.clone().unwrap();
        Linear { fractions: Vec::new(), sun: Vec::new(), sky: Vec::new(), depth: Vec::new(), ..l }
    };
    let as_deep =
        |a: &[f32], b: &[f32]| a.iter().zip(b).all(|(a, b)| (a - b).abs() <= 0.01 * step * a.max(*b));
    let [l, m] = [a, b].map(|p| p.linear.as_ref().unwrap());
    shown && as_deep(&l.depth, &m.depth) && near(&l.sun, &m.sun) && near(&l.sky, &m.sky) && seen(a) == seen(b)
}

/// Hills, 10 m high.
fn hills(scene: &mut Scene) {
    let samples =
        (0..961u32).map(|k| 5.0 + 5.0 * ((k % 31) as f32 * 0.9).sin() * ((k / 31) as f32 * 0.7).cos());
    scene.terrain.heights = Some(Raster { width: 31, height: 31, samples: samples.collect() });
    scene.terrain.cell_size = 10.0;
}

impl Drawn {
    fn has(&self, item: &str) -> bool {
        self.items.iter().any(|i| i == item)
    }

    fn draws(&self, pass: &str) -> bool {
        self.passes.iter().any(|p| p == pass)
    }

    /// Whether a pipeline was made whose last shader is this, or lies in this folder.
    fn builds(&self, shader: &str) -> bool {
        self.pipelines.iter().any(|p| p.starts_with(shader))
    }

    /// Bytes of the allocations of a name.
    fn bytes(&self, name: &str) -> u64 {
        self.allocated.iter().filter(|(n, _)| n == name).map(|(_, b)| b).sum()
    }
}

#[test]
fn without_a_sun_there_are_no_shadows() {
    RASTERIZERS.into_iter().for_each(without_a_sun);
}

fn without_a_sun(rasterizer: Rasterizer) {
    let gpu = device::open();
    let mut scene = scene();
    let day = draw(&gpu, &scene, rasterizer);
    assert!(
        day.has("shadow cascades") && day.draws(pass::SHADOWS) && day.bytes(resource::CASCADES) > 1 << 18
    );
    for (elevation, irradiance) in [(-5.0, 1.0), (25.0, 0.0)] {
        scene.sun.elevation = elevation;
        scene.sun.irradiance = [irradiance; 3];
        let night = draw(&gpu, &scene, rasterizer);
        assert!(!night.has("shadow cascades") && !night.draws(pass::SHADOWS));
        for shader in ["forest/casters.comp", "frame/trees/zfield_shadow.frag"] {
            assert!(day.builds(shader) && !night.builds(shader), "{shader}: {:?}", night.pipelines);
        }
        assert!(!day.builds("frame/terrain_shadow.frag"), "level ground shades nothing");
        let mut relief = scene.clone();
        relief.sun = self::scene().sun;
        hills(&mut relief);
        assert!(draw(&gpu, &relief, rasterizer).builds("frame/terrain_shadow.frag"));
        // One texel stands for the map that nobody reads.
        assert!(night.bytes(resource::CASCADES) < 1 << 16 && night.bytes("shadow depth") == 0);
        assert!(night.planned < day.planned);
    }
    gpu.close().unwrap();
}

#[test]
fn without_trees_there_is_no_forest() {
    RASTERIZERS.into_iter().for_each(without_trees);
}

/// Passes and pipelines that draw trees one by one.
fn tree_drawing(rasterizer: Rasterizer) -> (&'static [&'static str], &'static [&'static str]) {
    match rasterizer {
        Rasterizer::Graphics => {
            (&[pass::TREES], &[pipeline::TREES, pipeline::MAGNIFIED, pipeline::SMALL, pipeline::CONVERGED])
        }
        Rasterizer::Tiles => (
            &[
                pass::TREE_ORDER,
                pass::TREE_SIGHTS,
                pass::LIST_COUNTS,
                pass::TILE_LISTS,
                pass::TILES,
                pass::TREE_LIGHT,
            ],
            &[
                pipeline::TREE_ORDER,
                pipeline::TREE_SIGHTS,
                pipeline::TILE_LISTS,
                pipeline::TILES,
                pipeline::TREE_LIGHT,
            ],
        ),
    }
}

fn without_trees(rasterizer: Rasterizer) {
    let gpu = device::open();
    let mut scene = scene();
    let forest = draw(&gpu, &scene, rasterizer);
    let (passes, pipelines) = tree_drawing(rasterizer);
    let tree_passes = [
        &[
            pass::SEEDS,
            pass::COVERAGE,
            pass::CULL,
            pass::SUMS,
            pass::COMMANDS,
            pass::COMPACT,
            pass::SHADER_MAP,
        ][..],
        passes,
    ]
    .concat();
    let tree_items = [
        "z-field views of a",
        "seeds",
        "coverage tiles",
        "coverage sums",
        "point pattern",
        "trees and lists",
        "pair tables of a",
        "view tables of a",
        pipeline::LIGHT_RAY,
        "shader-map nodes",
    ];
    let tree_items = [&tree_items[..], pipelines].concat();
    assert!(tree_passes.iter().all(|p| forest.draws(p)), "{:?}", forest.passes);
    assert!(tree_items.iter().all(|p| forest.has(p)), "{:?}", forest.items);
    if let Distribution::Density { max_density, .. } = &mut scene.species[0].distribution {
        *max_density = 0.0;
    }
    let thinned = draw(&gpu, &scene, rasterizer);
    scene.species.clear();
    for bare in [thinned, draw(&gpu, &scene, rasterizer)] {
        assert!(!tree_passes.iter().any(|p| bare.draws(p)), "{:?}", bare.passes);
        assert!(!tree_items.iter().any(|p| bare.has(p)), "{:?}", bare.items);
        for shader in ["forest/", "frame/trees/"] {
            let tiles = |p: &&str| !p.starts_with("forest/terrain") && p.starts_with(shader);
            assert!(forest.pipelines.iter().any(tiles), "{:?}", forest.pipelines);
            assert!(!bare.pipelines.iter().any(tiles), "{:?}", bare.pipelines);
        }
        let names = [
            resource::SEEDS,
            resource::TREES,
            resource::VIEWS,
            resource::COVERAGE,
            resource::COVERAGE_SUMS,
            resource::PAIR_TABLES,
            resource::VIEW_TABLES,
            resource::NODES,
        ];
        for name in names {
            assert!(forest.bytes(name) > 0, "{name}");
            assert_eq!(bare.bytes(name), 0, "{name}");
        }
        assert!(bare.draws(pass::SHADOWS), "the ground still casts");
    }
    gpu.close().unwrap();
}

#[test]
fn a_listed_forest_needs_no_pattern_and_a_plain_no_height_map() {
    let gpu = device::open();
    let mut scene = scene();
    let draw = |gpu: &Gpu, scene: &Scene| draw(gpu, scene, Rasterizer::Graphics);
    let thinned = draw(&gpu, &scene);
    assert!(thinned.has("point pattern") && !thinned.has("height map") && !thinned.has("density maps"));
    let tree = canopy::scene::TreePosition { x: 150.0, y: 150.0, scale: None, rotation: None };
    scene.species[0].distribution = Distribution::Positions(vec![tree; 1].into());
    let listed = draw(&gpu, &scene);
    assert!(!listed.has("point pattern") && listed.draws(pass::SEEDS));
    assert!(listed.has("density maps"), "how densely listed trees stand");
    let (width, height) = (11, 11);
    scene.terrain.heights = Some(canopy::physics::raster::Raster { width, height, samples: vec![1.0; 121] });
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
    for rasterizer in RASTERIZERS {
        let drawn = draw(&gpu, &scene, rasterizer);
        // What frames are uploaded and read back through is not the scene's: it is as large as the frames in flight take.
        let ring = |name: &str| ["uploads", "read-backs"].contains(&name);
        let allocated: u64 = drawn.allocated.iter().filter(|(n, _)| !ring(n)).map(|(_, b)| b).sum();
        println!("planned {} KiB, allocated {} KiB", drawn.planned >> 10, allocated >> 10);
        // Small buffers (view, indices, tables) are not worth an item each: a tenth, and a MiB.
        assert!(allocated <= drawn.planned + drawn.planned / 10 + (1 << 20), "{:?}", drawn.allocated);
    }
    gpu.close().unwrap();
}

/// A buffer or image whose allocation is not what a plan describes: smaller, or larger by more than drivers add.
fn disagreement(described: &BTreeMap<&'static str, u64>, drawn: &Drawn) -> Option<String> {
    // Rows, levels and layers are padded, most where an image has few texels a row.
    let fits = |wanted: u64, has: u64| has >= wanted && has <= wanted + wanted / 10 + (1 << 16);
    let wrong = described.iter().find(|(name, bytes)| !fits(**bytes, drawn.bytes(name)));
    wrong.map(|(name, bytes)| format!("{name}: {bytes} planned, {} allocated", drawn.bytes(name)))
}

#[test]
fn every_allocation_is_the_one_that_its_item_describes_and_a_false_one_is_refused() {
    let gpu = device::open();
    let mut scene = scene();
    scene.settings.set("transfer_bands", 2.0).unwrap();
    for rasterizer in RASTERIZERS {
        let plan = planned(&gpu, &scene, rasterizer);
        let (drawn, _) = drawn(&gpu, &scene, plan.clone());
        assert!(drawn.described.len() > 20, "{:?}", drawn.described);
        assert_eq!(disagreement(&drawn.described, &drawn), None);
        // The check can fail: on any item that is told to have half of its bytes, or twice as many.
        for name in drawn.described.keys().filter(|n| drawn.described[*n] > 1 << 18) {
            for wrong in [drawn.described[name] / 2, 2 * drawn.described[name]] {
                let mut false_plan = drawn.described.clone();
                false_plan.insert(name, wrong);
                let found = disagreement(&false_plan, &drawn).unwrap_or_default();
                assert!(found.starts_with(name), "{name}: {wrong} bytes: {found}");
            }
        }
        // And nothing is drawn by a plan that describes other things than its numbers ask for.
        for k in (0..plan.items.len()).filter(|k| !plan.items[*k].allocations.is_empty()) {
            let mut false_plan = plan.clone();
            match &mut false_plan.items[k].allocations[0] {
                Description::Buffer(d) => d.bytes += 16,
                Description::Image(d) => d.layers += 1,
                Description::Volume(d) => d.size[2] += 1,
            }
            let refused =
                Renderer::new(&gpu, Arc::new(scene.clone()), false_plan, &device::bake(&scene)).err();
            let name = &plan.items[k].name;
            assert!(
                matches!(&refused, Some(Error::Usage(text)) if text.contains(name.as_str())),
                "{name}: {refused:?}"
            );
        }
    }
    gpu.close().unwrap();
}

#[test]
fn each_rasterizer_needs_nothing_of_the_other() {
    let gpu = device::open();
    let scene = scene();
    for layers in [false, true] {
        let eye = Eye::new(&scene.cameras[0], &scene.terrain, SIZE);
        let plan = |r: Rasterizer| Plan::for_eye(&scene, &eye, layers, r, Some(gpu.info())).unwrap();
        let [graphics, tiles] = RASTERIZERS.map(|r| drawn(&gpu, &scene, plan(r)).0);
        for (own, other, rasterizer) in
            [(&graphics, &tiles, RASTERIZERS[0]), (&tiles, &graphics, RASTERIZERS[1])]
        {
            let (passes, items) = tree_drawing(rasterizer);
            assert!(passes.iter().all(|p| own.draws(p) && !other.draws(p)), "{:?}", own.passes);
            assert!(items.iter().all(|i| own.has(i) && !other.has(i)), "{:?}", own.items);
        }
        for shader in ["frame/trees/tiles/", "frame/ground", "frame/terrain_seen.frag"] {
            assert!(tiles.builds(shader) && !graphics.builds(shader), "{shader}");
        }
        for shader in ["frame/trees/zfield.frag", "frame/trees/zfield_layers.frag", "frame/terrain.frag"] {
            assert!(!tiles.builds(shader), "{shader}: {:?}", tiles.pipelines);
        }
        assert!(graphics.builds("frame/trees/zfield") && graphics.builds("frame/terrain"));
        let plan = plan(Rasterizer::Tiles);
        for buffer in TileBuffers::new(&plan).all() {
            // To the next 16 bytes, and the padding of allocations.
            let (bytes, wanted) = (tiles.bytes(buffer.desc.name), buffer.desc.bytes);
            assert!(bytes >= wanted && bytes < wanted + 4096, "{buffer:?}: {bytes}");
            assert_eq!(graphics.bytes(buffer.desc.name), 0, "{}", buffer.desc.name);
        }
        let [with, without] = [&tiles, &graphics]
            .map(|d| [resource::QUADS_SEEN, resource::FIRST_DEPTH].map(|n| d.bytes(n) > 0));
        assert_eq!((with, without), ([true, layers], [false, false]));
        // A colour a pixel, not a sample.
        let colour = if layers { "sun part" } else { "radiance" };
        assert!(graphics.bytes(colour) >= 4 * tiles.bytes(colour), "{:?}", graphics.allocated);
    }
    gpu.close().unwrap();
}

#[test]
fn tiles_that_a_device_cannot_hold_are_refused_and_not_chosen() {
    let gpu = device::open();
    let scene = scene();
    let eye = Eye::new(&scene.cameras[0], &scene.terrain, SIZE);
    let plan =
        |how: Drawing, info: &canopy::gpu::DeviceInfo| Plan::for_eye(&scene, &eye, false, how, Some(info));
    let mut info = gpu.info().clone();
    let chosen = |info: &canopy::gpu::DeviceInfo| plan(Drawing::default(), info).unwrap().rasterizer;
    for kind in ["cpu", "discrete"] {
        info.kind = kind;
        assert_eq!(chosen(&info), Rasterizer::Tiles);
    }
    let trees = plan(Drawing::default(), &info).unwrap().tree_capacity;
    // The lists have three million entries; a record of a tree has eight texels.
    let needed = TileBuffers::new(&plan(Drawing::default(), &info).unwrap()).all().map(|b| {
        let texel = b.desc.texels.map_or(4, |(_, bytes)| bytes);
        b.desc.bytes / texel
    });
    let needed = needed.into_iter().max().unwrap() as u32;
    assert!(needed >= 8 * trees);
    info.max_texel_elements = needed;
    assert_eq!(chosen(&info), Rasterizer::Tiles);
    info.max_texel_elements = needed - 1;
    assert_eq!(chosen(&info), Rasterizer::Graphics);
    let refused = plan(Rasterizer::Tiles.into(), &info).unwrap_err();
    assert!(matches!(&refused, Error::Usage(text) if text.contains("--rasterizer graphics")), "{refused}");
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

#[test]
fn without_a_sun_there_is_no_light_ray_and_no_average_of_its_light() {
    let gpu = device::open();
    let mut scene = scene();
    scene.settings.set("transfer_bands", 2.0).unwrap();
    RASTERIZERS.into_iter().for_each(|r| without_sunlight(&gpu, scene.clone(), r));
    gpu.close().unwrap();
}

fn without_sunlight(gpu: &Gpu, mut scene: Scene, rasterizer: Rasterizer) {
    let unreduced = planned(gpu, &scene, rasterizer);
    let (day, _) = drawn(gpu, &scene, unreduced.clone());
    let (passes, pipelines) = tree_drawing(rasterizer);
    let has_trees = |d: &Drawn| passes.iter().all(|p| d.draws(p)) && pipelines.iter().all(|p| d.has(p));
    assert!(day.has("light transfer of a") && day.bytes(resource::TRANSFER) > 30_000);
    assert!(day.has(pipeline::LIGHT_RAY) && day.has("pair tables of a") && has_trees(&day));
    scene.sun.irradiance = [0.0; 3];
    let (overcast, reduced) = drawn(gpu, &scene, planned(gpu, &scene, rasterizer));
    assert!(!overcast.has(pipeline::LIGHT_RAY) && !overcast.has("pair tables of a"));
    assert!(overcast.has("view tables of a") && has_trees(&overcast));
    // One texel a band stands for the transfer that nobody reads, and two for the tables.
    assert!(!overcast.has("light transfer of a") && overcast.bytes(resource::TRANSFER) < 1 << 14);
    let [with, without] = [&day, &overcast].map(|d| d.bytes(resource::PAIR_TABLES));
    assert!(without <= texel(gpu) && with >= 6 * 6 * 18 * 8, "{with} {without}");
    assert!(overcast.planned < day.planned);
    assert!(reduced.linear.as_ref().unwrap().coverage.iter().any(|c| *c > 0.5), "no tree is seen");
    assert!(same_light(gpu, &reduced, &picture(gpu, &scene, unreduced)));
}

#[test]
fn level_ground_is_one_tile_without_slopes() {
    let gpu = device::open();
    let mut scene = scene();
    let plan = planned(&gpu, &scene, Ladder::BN12);
    assert!(plan.terrain_tiles > 1 && plan.height_tiles == 1);
    let (level, reduced) = drawn(&gpu, &scene, plan.clone());
    assert!(!level.draws(pass::TERRAIN_TILES) && !level.has("height map"));
    assert!(!level.builds("forest/terrain_tile.comp"), "{:?}", level.pipelines);
    assert!(reduced == picture(&gpu, &scene, Plan { height_tiles: plan.terrain_tiles, ..plan }));
    hills(&mut scene);
    let relief = draw(&gpu, &scene, Rasterizer::Tiles);
    assert!(relief.draws(pass::TERRAIN_TILES) && relief.has("height map"));
    assert!(relief.builds("forest/terrain_tile.comp"), "{:?}", relief.pipelines);
    for name in [resource::SLOPE_TILES, resource::HEIGHT_TILES] {
        assert!(level.bytes(name) > 0 && relief.bytes(name) > 500 * level.bytes(name), "{name}");
    }
    gpu.close().unwrap();
}

#[test]
fn from_afar_no_tree_is_drawn_by_itself() {
    let gpu = device::open();
    for (relief, rasterizer) in [false, true].into_iter().zip(RASTERIZERS) {
        let mut scene = scene();
        if relief {
            hills(&mut scene);
        }
        let near = scene.cameras[0].clone();
        // 240 pixels a metre at one metre: trees of 14 m are less than two pixels.
        let away = Camera { position: [150.0, -9000.0, 5000.0], vertical_fov: 3.0, ..near.clone() };
        let [here, there] = [&near, &away].map(|c| Eye::new(c, &scene.terrain, SIZE));
        scene.settings.set("silhouette_min_pixels", 3.0).unwrap();
        scene.settings.set("zfield_min_pixels", 3.0).unwrap();
        let device = Some(gpu.info());
        let plan = |place: &[[f64; 3]]| Plan::for_path(&scene, &there, place, true, rasterizer, device);
        let (reduced, unreduced) = (plan(&[]).unwrap(), plan(&[here.position]).unwrap());
        assert!(!reduced.z_fields && unreduced.z_fields && reduced.last_range() < 9000.0);
        let mut far = scene.clone();
        far.cameras[0] = away;
        let ((without, image), whole) = (drawn(&gpu, &far, reduced.clone()), picture(&gpu, &far, unreduced));
        let (with, _) = drawn(&gpu, &scene, planned(&gpu, &scene, rasterizer));
        let (passes, pipelines) = tree_drawing(rasterizer);
        for item in
            ["seeds", "z-field views of a", "trees and lists", pipeline::LIGHT_RAY].iter().chain(pipelines)
        {
            assert!(with.has(item) && !without.has(item), "{item}");
        }
        for pass in [pass::SEEDS, pass::CULL, pass::SUMS, pass::COMMANDS, pass::COMPACT].iter().chain(passes)
        {
            assert!(with.draws(pass) && !without.draws(pass), "{pass}");
        }
        let tree_shader = match rasterizer {
            Rasterizer::Graphics => "frame/trees/zfield",
            Rasterizer::Tiles => "frame/trees/tiles/",
        };
        for shader in ["forest/cull.comp", "forest/scan.comp", "forest/compact.comp", tree_shader] {
            assert!(with.builds(shader) && !without.builds(shader), "{shader}: {:?}", without.pipelines);
        }
        for item in ["coverage tiles", "shader-map nodes", "view tables of a", "pair tables of a"] {
            assert!(without.has(item), "{item}");
        }
        for name in ["seeds", "trees", "tree lists", "seed classes", "z-field views", "view bases"] {
            assert!(with.bytes(name) > 0 && without.bytes(name) <= 1024, "{name}: {}", without.bytes(name));
        }
        assert!(without.planned < with.planned);
        assert!(image == whole, "relief {relief}");
        let trees: f32 = image.linear.unwrap().fractions.iter().map(|f| f[2] + f[3]).sum();
        assert!(trees > 10.0, "no forest is seen: {trees}");
        let mut renderer =
            Renderer::new(&gpu, Arc::new(scene.clone()), reduced, &device::bake(&scene)).unwrap();
        let refused = renderer.render(&near, 1.0).unwrap_err();
        assert!(matches!(&refused, Error::Usage(text) if text.contains("plan again")), "{refused}");
    }
    gpu.close().unwrap();
}

#[test]
fn a_chosen_representation_needs_nothing_of_the_other() {
    RASTERIZERS.into_iter().for_each(one_representation);
}

fn one_representation(rasterizer: Rasterizer) {
    let gpu = device::open();
    let scene = scene();
    let how = |ladder| Drawing { ladder: Some(ladder), rasterizer: Some(rasterizer) };
    let shown = tree_drawing(rasterizer).0[0];
    let auto = planned(&gpu, &scene, how(Ladder::BN12));
    assert!(auto.z_fields && auto.pair_tables);
    assert!(!auto.ladder.to_string().is_empty() && auto.convergence > 0.0 && auto.cascades > 0);
    // Trees at any distance never converge to an average.
    let plan = planned(&gpu, &scene, how(Ladder::ZFIELD));
    let (trees, reduced) = drawn(&gpu, &scene, plan.clone());
    assert!(
        trees.draws(shown)
            && !trees.has("pair tables of a")
            && trees.bytes(resource::PAIR_TABLES) <= texel(&gpu)
    );
    assert!(reduced == picture(&gpu, &scene, Plan { pair_tables: true, ..plan }));
    // No tree stands by itself where the shader-map shows all.
    let plan = planned(&gpu, &scene, how(Ladder::SHADER_MAP));
    let (map, reduced) = drawn(&gpu, &scene, plan.clone());
    assert!(map.has("pair tables of a") && !map.has("seeds") && !map.draws(shown));
    // Average light includes its shadows.
    assert!(plan.sun && !map.draws(pass::SHADOWS) && map.bytes(resource::CASCADES) < 1 << 16);
    let Plan { cascades, shadow_distance, .. } = auto;
    assert!(reduced == picture(&gpu, &scene, Plan { cascades, shadow_distance, ..plan.clone() }));
    let Plan { seed_regions, tree_capacity, shadow_quads, caster_capacity, .. } = auto;
    let near = Plan { z_fields: true, seed_regions, tree_capacity, shadow_quads, caster_capacity, ..plan };
    assert!(reduced == picture(&gpu, &scene, near));
    // Where no tree is near enough to be drawn by itself, it is what the usual ladder shows.
    let mut far = scene.clone();
    far.cameras[0].position = [150.0, -9000.0, 5000.0];
    far.cameras[0].vertical_fov = 3.0;
    far.settings.set("zfield_min_pixels", 3.0).unwrap();
    let [auto, map] = [Ladder::BN12, Ladder::SHADER_MAP].map(|l| planned(&gpu, &far, how(l)));
    assert!(!auto.z_fields && !map.z_fields);
    assert!(picture(&gpu, &far, auto) == picture(&gpu, &far, map));
    gpu.close().unwrap();
}

/// The distance that a plan draws trees to is what its ladder needs, and no number that stands for none or for all.
#[test]
fn a_ladder_says_how_far_trees_are_drawn_one_by_one() {
    let mut scene = scene();
    hills(&mut scene);
    let plan = |scene: &Scene, how: Drawing| {
        let eye = Eye::new(&scene.cameras[0], &scene.terrain, SIZE);
        Plan::for_eye(scene, &eye, false, how, None).unwrap()
    };
    let of = |text: &str| plan(&scene, text.parse::<Ladder>().unwrap().into());
    let (eight, four) = (of("zfield:8,shader-map"), of("zfield:4,shader-map"));
    assert!(four.range == 2.0 * eight.range && four.silhouette_ratio == 0.5 * eight.silhouette_ratio);
    assert_eq!(four.last_range(), eight.last_range(), "silhouettes have a knob of their own");
    // A scene's own ladder is as one that is asked for, and the knob is where neither says.
    scene.ladder = "zfield:8,shader-map".parse().unwrap();
    assert_eq!(plan(&scene, Drawing::default()).items, eight.items);
    scene.settings.set("zfield_min_pixels", 8.0).unwrap();
    assert_eq!(plan(&scene, Ladder::BN12.into()).ladder, eight.ladder);

    let alone = plan(&scene, Ladder::ZFIELD.into());
    let diagonal = scene.terrain.extent[0].hypot(scene.terrain.extent[1]);
    assert!(alone.range > diagonal && alone.range < 2.0 * diagonal, "{}", alone.range);
    assert!(alone.convergence == 0.0 && !alone.pair_tables && alone.silhouette_ratio == 1.0);
    assert!(alone.draw_limits.is_sorted() && alone.draw_limits[2] >= alone.range, "{:?}", alone.draw_limits);
    assert!(alone.shadow_distance > diagonal && alone.cascades > 0);
    // From farther away, farther.
    let far = scene.cameras[0].position.map(|p| p - 2000.0);
    let eye = Eye::new(&scene.cameras[0], &scene.terrain, SIZE);
    let both = Plan::for_path(&scene, &eye, &[far], false, Ladder::ZFIELD, None).unwrap();
    assert!(both.range > 3000.0 && both.range < 6000.0, "{}", both.range);

    let map = plan(&scene, Ladder::SHADER_MAP.into());
    assert!(
        map.convergence > 0.0
            && map.range == 0.0
            && map.species_range == [0.0]
            && map.forest
            && !map.z_fields
    );
    assert!(map.sun && map.pair_tables && map.cascades == 0);
    // Bare ground between far trees is in the shadow of hills as far as the user says.
    scene.settings.set("shadow_distance", 500.0).unwrap();
    let shaded = plan(&scene, Ladder::SHADER_MAP.into());
    assert!(shaded.cascades > 0 && shaded.shadow_distance == 500.0);
}

#[test]
fn z_fields_alone_are_planned_again_for_a_camera_that_is_farther_away() {
    let gpu = device::open();
    let scene = scene();
    let plan = planned(&gpu, &scene, Ladder::ZFIELD);
    let mut renderer = Renderer::new(&gpu, Arc::new(scene.clone()), plan, &device::bake(&scene)).unwrap();
    let near = &scene.cameras[0];
    let away = Camera { position: [150.0, -3000.0, 900.0], ..near.clone() };
    let refused = renderer.render(&away, 1.0).unwrap_err();
    assert!(matches!(&refused, Error::Usage(text) if text.contains("plan again")), "{refused}");
    assert!(renderer.render(near, 1.0).unwrap().trees.camera > 100);
    drop(renderer);
    gpu.close().unwrap();
}

#[test]
fn one_species_has_one_density() {
    let gpu = device::open();
    let mut scene = scene();
    let plan = planned(&gpu, &scene, Ladder::BN12);
    assert_eq!((plan.cover_channels, plan.cover_layers()), (2, 1));
    let (two, reduced) = drawn(&gpu, &scene, plan.clone());
    let mut four = Plan { cover_channels: 4, ..plan };
    four.list(&scene);
    let (four, whole) = drawn(&gpu, &scene, four);
    let [two, four] = [two, four].map(|d| d.bytes(resource::COVERAGE));
    // But for the padding of allocations, which takes whole tiles of a texture on a GPU.
    let padding = four / if gpu.info().kind == "cpu" { 50 } else { 8 };
    assert!(four.abs_diff(2 * two) < padding, "{two} {four}");
    assert!(reduced == whole);
    let one = scene.species[0].clone();
    for (count, layers) in [(3, 1), (4, 2), (8, 3)] {
        scene.species = vec![one.clone(); count];
        let plan = planned(&gpu, &scene, Ladder::BN12);
        assert_eq!((plan.cover_channels, plan.cover_layers()), (4 * layers, layers), "{count} species");
    }
    gpu.close().unwrap();
}
