//! Trees that are their models' meshes: where they are, how they are lit, and how they hand over to z-fields.

use std::sync::Arc;

use crate::device::{self, Arguments, Function, evaluate};

use canopy::camera::Eye;
use canopy::frame::{FrameReport, Renderer};
use canopy::gpu::Gpu;
use canopy::image::Picture;
use canopy::ladder::Ladder;
use canopy::physics::masks::{mesh_mask, rest_mask};
use canopy::plan::{Drawing, Plan, Rasterizer, ViewMode};
use canopy::reference::{Light, Options, Until, World};
use canopy::scene::{Camera, Distribution, Scene, TreePosition};

const SIZE: [u32; 2] = [96, 72];
/// Of what is held against truth: trees are as high as those that are meshes.
const LARGE: [u32; 2] = [240, 180];
const DAY: &str = "[sun]\nazimuth = 210.0\nelevation = 35.0\nirradiance = [1.0, 0.95, 0.85]\n[sky]\nradiance = [0.06, 0.09, 0.14]";

fn ladder(text: &str) -> Ladder {
    text.parse().unwrap()
}

/// Oaks, where they are listed: east, north and scale.
fn oaks(places: &[[f64; 3]], light: &str) -> Scene {
    let mut scene = device::small_scene(&format!(
        "seed = 2\n[terrain]\nextent = 100.0\nalbedo = 0.2\n\
         [[species]]\nname = \"oak\"\nmodel = \"builtin:oak\"\ndensity = 0.0\n{light}\n\
         [[camera]]\nname = \"c\"\nposition = [20.0, 20.0, 6.0]\ntarget = [50.0, 50.0, 5.0]\nvertical_fov = 50.0\n"
    ));
    let tree =
        |p: &[f64; 3]| TreePosition { x: p[0], y: p[1], scale: Some(p[2] as f32), rotation: Some(30.0) };
    scene.species[0].distribution = Distribution::Positions(Arc::new(places.iter().map(tree).collect()));
    scene
}

fn plan(gpu: &Gpu, scene: &Scene, camera: &Camera, drawing: impl Into<Drawing>, layers: bool) -> Plan {
    let eye = Eye::new(camera, &scene.terrain, SIZE);
    Plan::for_eye(scene, &eye, layers, drawing, Some(gpu.info())).unwrap()
}

fn draw(gpu: &Gpu, scene: &Scene, camera: &Camera, by: &str) -> (FrameReport, Picture) {
    draw_at(gpu, scene, camera, by, SIZE)
}

fn draw_at(gpu: &Gpu, scene: &Scene, camera: &Camera, by: &str, size: [u32; 2]) -> (FrameReport, Picture) {
    let eye = Eye::new(camera, &scene.terrain, size);
    let plan = Plan::for_eye(scene, &eye, true, ladder(by), Some(gpu.info())).unwrap();
    let mut renderer =
        Renderer::new(gpu, Arc::new(scene.clone()), plan, &device::bake_meshes(scene)).unwrap();
    let report = renderer.render(camera, 1.0).unwrap();
    let picture = renderer.picture().unwrap();
    let l = picture.linear.as_ref().unwrap();
    assert!(l.sun.iter().chain(&l.sky).flatten().all(|v| v.is_finite() && *v >= 0.0));
    assert!(l.depth.iter().all(|d| d.is_finite() && *d >= 0.0));
    assert!(l.coverage.iter().all(|c| (0.0..=1.0).contains(c)));
    (report, picture)
}

fn mean(values: impl IntoIterator<Item = f32>) -> f64 {
    let (mut sum, mut n) = (0.0, 0.0);
    for v in values {
        sum += f64::from(v);
        n += 1.0;
    }
    sum / n
}

const NEAR: &str = "mesh:32,zfield:4,shader-map";

#[test]
fn a_lone_tree_covers_and_shines_as_paths_traced_through_its_mesh_say() {
    let gpu = device::open();
    // Near enough for a cascade of 256 texels to tell leaves apart.
    let mut scene = oaks(&[[50.0, 50.0, 1.0]], DAY);
    scene.settings.set("cascade_size", 1024.0).unwrap();
    scene.terrain.albedo = canopy::scene::Albedo::Uniform([0.0; 3]);
    for (position, target) in [
        ([50.0, 31.0, 8.0], [50.0, 50.0, 7.0]),
        ([47.0, 47.0, 1.7], [50.0, 50.0, 9.0]),
        ([62.0, 58.0, 24.0], [50.0, 50.0, 7.0]),
    ] {
        let camera = device::camera(position, target);
        let (report, picture) = draw_at(&gpu, &scene, &camera, NEAR, LARGE);
        assert_eq!((report.trees.camera, report.trees.meshes), (1, 1));
        let eye = Eye::new(&camera, &scene.terrain, LARGE);
        let options =
            Options { bounces: Some(1), light: Light::All, until: Until::Samples(64), ..Options::default() };
        let world = World::new(&scene, &[eye]).unwrap();
        let truth = world.render(&eye, &options, None, &mut |_| ()).unwrap().linear();
        let drawn = picture.linear.as_ref().unwrap();
        let covers = [drawn, &truth].map(|l| mean(l.coverage.iter().copied()));
        // 43,000 pixels of four samples, a quarter of them on edges: three standard errors are 0.0025. Cards that overlap along their twig hide more
        // of each other than masks averaged over a pixel say: measured +0.002 at 200 pixels a tree, and half of that at 400.
        assert!((covers[0] - covers[1]).abs() < 0.006, "{position:?}: coverage {covers:?}");
        // Where nothing but the tree is seen.
        let whole = |k: &usize| drawn.coverage[*k] > 0.99 && truth.coverage[*k] > 0.99;
        let light = |l: &canopy::image::Linear| {
            let of = |part: &[[f32; 3]]| mean((0..part.len()).filter(whole).flat_map(|k| part[k]));
            [of(&l.sun), of(&l.sky)]
        };
        let [got, want] = [drawn, &truth].map(light);
        let ratio = [0, 1].map(|k| got[k] / want[k]);
        println!("{position:?}: coverage {covers:.4?}, sun {:.3}, sky {:.3}", ratio[0], ratio[1]);
        // Measured over views of oak and pine: sun 0.95 to 1.13 where a few leaves fill the view, sky by 14 directions 0.87 to 1.16.
        assert!((ratio[0] - 1.0).abs() < 0.12 && (ratio[1] - 1.0).abs() < 0.16, "{position:?}: {ratio:?}");
        // How far its first surfaces are: those of half the pixels agree to a tenth of a metre, and where one has a leaf and the other a gap they do not.
        let deep = (0..truth.depth.len()).filter(whole).map(|k| (drawn.depth[k] - truth.depth[k]).abs());
        let mut deep: Vec<f32> = deep.collect();
        deep.sort_by(f32::total_cmp);
        assert!(deep[deep.len() / 2] < 0.5, "{position:?}: {}", deep[deep.len() / 2]);
    }
    gpu.close().unwrap();
}

#[test]
fn finer_shadow_maps_do_not_have_what_the_sun_reaches_shade_itself() {
    let gpu = device::open();
    // Trees near each other, of several names in the map. Their depths are told apart by what names leave: 2^-16 of a cascade's
    // depth, which is half a texel of a map of 2048 and two of 8192.
    let places = [[50.0, 50.0, 1.0], [53.0, 49.0, 0.9], [46.0, 51.0, 1.1], [50.0, 54.0, 1.0]];
    let mut scene = oaks(&places, DAY);
    for (knob, value) in
        [("cascades", 1.0), ("shadow_distance", 60.0), ("mesh_shadow_texels", 2.0), ("memory_mib", 4096.0)]
    {
        scene.settings.set(knob, value).unwrap();
    }
    let camera = device::camera([44.0, 38.0, 5.0], [50.0, 50.0, 7.0]);
    let eye = Eye::new(&camera, &scene.terrain, LARGE);
    let options =
        Options { bounces: Some(1), light: Light::Sun, until: Until::Samples(64), ..Options::default() };
    let truth =
        World::new(&scene, &[eye]).unwrap().render(&eye, &options, None, &mut |_| ()).unwrap().linear();
    let lit = [2048.0, 8192.0].map(|size| {
        scene.settings.set("cascade_size", size).unwrap();
        let drawn = draw_at(&gpu, &scene, &camera, NEAR, LARGE).1.linear.unwrap();
        // Of all that is tree and that the sun reaches.
        let all = |k: &usize| truth.fractions[*k][2] > 0.97 && drawn.coverage[*k] > 0.99;
        let lit: Vec<f32> = (0..drawn.sun.len()).filter(all).map(|k| drawn.fractions[k][2]).collect();
        assert!(lit.len() > 500, "{}", lit.len());
        mean(lit)
    });
    println!("lit of what the sun reaches: {lit:.3?}");
    // Finer maps blur shadows' edges less. With names in the depths that were compared, the second was 0.1 less than the first.
    assert!(lit[0] > 0.8 && lit[1] > lit[0], "{lit:?}");
    gpu.close().unwrap();
}

#[test]
fn the_shaders_part_samples_as_the_twin_does() {
    let gpu = device::open();
    let mut cases: Vec<Arguments> = Vec::new();
    for samples in [1, 4, 8] {
        for count in 0..=samples {
            cases.extend((0..64 * (samples + 1)).map(|k| {
                let mut words = [0; 12];
                words[..4].copy_from_slice(&[k % (samples + 1), count, 13 * k % 1024, samples]);
                words
            }));
        }
    }
    for (c, out) in cases.iter().zip(evaluate(&gpu, Function::MeshMask, &cases)) {
        let [covered, count, bits, samples] = [c[0], c[1], c[2], c[3]];
        let want = [mesh_mask(count, bits, samples), rest_mask(covered, count, bits, samples)];
        assert_eq!(out[..2], want, "{c:?}");
    }
    gpu.close().unwrap();
}

#[test]
fn a_mesh_hands_over_to_its_z_field_sample_by_sample() {
    let gpu = device::open();
    // At its range's 0.8 to 1 a tree is partly both. Of no light, where what is seen is opaque, so that coverage tells how much is drawn.
    let scene = oaks(&[[50.0, 50.0, 1.0]], DAY);
    let camera = device::camera([50.0, 20.0, 8.0], [50.0, 50.0, 7.0]);
    let eye = Eye::new(&camera, &scene.terrain, SIZE);
    let height = scene.species[0].mesh.positions.iter().map(|p| f64::from(p[2])).fold(0.0, f64::max);
    let pixels = height * eye.pixels_at_1m / 30.0;
    let covers = |by: &str| mean(draw(&gpu, &scene, &camera, by).1.linear.unwrap().coverage);
    let (mesh, zfield) = (covers("mesh:16,zfield:4,shader-map"), covers("zfield:4,shader-map"));
    let mut steps = std::collections::BTreeSet::new();
    for k in 0..=12 {
        // Of the range the tree is at 0.78 to 1.02.
        let relative = 0.78 + 0.02 * f64::from(k);
        let by = format!("mesh:{},zfield:4,shader-map", pixels * relative);
        let between = covers(&by);
        // A sample has the one or the other, and never both or none: between the two, but for what single samples round.
        let (low, high) = (mesh.min(zfield), mesh.max(zfield));
        assert!((low - 0.003..=high + 0.003).contains(&between), "{by}: {between}, of {mesh} and {zfield}");
        steps.insert((between * 1e6) as u64);
    }
    assert!(steps.len() >= 4, "{steps:?}");
    gpu.close().unwrap();
}

#[test]
fn eyes_in_crowns_tiny_and_giant_trees_and_no_sun_are_drawn() {
    let gpu = device::open();
    let scene = oaks(&[[50.0, 50.0, 1.0], [53.0, 50.0, 0.01], [20.0, 80.0, 8.0]], DAY);
    for (position, target) in [
        // In the middle of a crown, a centimetre from the trunk, under the smallest tree, in the giant, looking straight up and down.
        ([50.0, 50.0, 9.0], [60.0, 50.0, 9.0]),
        ([50.3, 50.0, 1.0], [50.0, 50.0, 1.0]),
        ([53.05, 50.0, 0.05], [53.0, 50.0, 0.07]),
        ([20.0, 80.0, 60.0], [30.0, 80.0, 61.0]),
        ([49.0, 49.0, 0.5], [49.0, 49.0, 20.0]),
        ([50.0, 50.0, 30.0], [50.0, 50.0, 0.0]),
    ] {
        let (report, _) =
            draw(&gpu, &scene, &device::camera(position, target), "mesh:16,zfield:4,shader-map");
        assert!(report.trees.meshes > 0, "{position:?}");
    }
    let night = oaks(&[[50.0, 50.0, 1.0]], "[sky]\nradiance = 0.1");
    let camera = device::camera([50.0, 40.0, 5.0], [50.0, 50.0, 7.0]);
    let l = draw(&gpu, &night, &camera, NEAR).1.linear.unwrap();
    assert!(l.sun.iter().flatten().all(|v| *v == 0.0) && l.sky.iter().flatten().any(|v| *v > 0.0));
    let dark = oaks(&[[50.0, 50.0, 1.0]], "[sky]\nradiance = 0.0");
    let l = draw(&gpu, &dark, &camera, NEAR).1.linear.unwrap();
    assert!(l.sky.iter().flatten().all(|v| *v == 0.0));
    gpu.close().unwrap();
}

#[test]
fn a_tree_is_a_mesh_as_long_as_it_is_as_high_as_the_ladder_says() {
    let gpu = device::open();
    // Of the same species, of one fifth, once and four times the size: 60 m away they are about 4, 20 and 80 pixels high.
    let scene = oaks(&[[44.0, 90.0, 0.2], [50.0, 90.0, 1.0], [56.0, 90.0, 4.0]], DAY);
    let camera = device::camera([50.0, 30.0, 10.0], [50.0, 90.0, 10.0]);
    let meshes = |by: &str| draw(&gpu, &scene, &camera, by).0.trees.meshes;
    let by = ["mesh:16,zfield:4,shader-map", "mesh:40,zfield:4,shader-map", "mesh:200,zfield:4,shader-map"];
    assert_eq!(by.map(meshes), [2, 1, 0]);
    gpu.close().unwrap();
}

#[test]
fn frames_of_meshes_are_the_same_bits_whatever_came_before() {
    let gpu = device::open();
    let places: Vec<[f64; 3]> =
        (0..25).map(|k| [20.0 + 12.0 * f64::from(k % 5), 20.0 + 12.0 * f64::from(k / 5), 1.0]).collect();
    let scene = oaks(&places, DAY);
    let cameras = [
        device::camera([44.0, 30.0, 1.7], [50.0, 60.0, 6.0]),
        device::camera([70.0, 66.0, 20.0], [40.0, 40.0, 2.0]),
    ];
    let alone = cameras.clone().map(|c| draw(&gpu, &scene, &c, NEAR).1);
    let all = plan(&gpu, &scene, &cameras[0], ladder(NEAR), true);
    let mut renderer =
        Renderer::new(&gpu, Arc::new(scene.clone()), all, &device::bake_meshes(&scene)).unwrap();
    for k in [0, 1, 1, 0, 1] {
        renderer.render(&cameras[k], 1.0).unwrap();
        assert_eq!(renderer.picture().unwrap(), alone[k], "camera {k}");
    }
    drop(renderer);
    gpu.close().unwrap();
}

#[test]
fn every_view_mode_and_one_sample_a_pixel_show_meshes() {
    let gpu = device::open();
    let scene = oaks(&[[50.0, 50.0, 1.0]], DAY);
    let camera = device::camera([50.0, 31.0, 8.0], [50.0, 50.0, 7.0]);
    for (name, mode) in ViewMode::NAMES {
        let mut modes = plan(&gpu, &scene, &camera, ladder(NEAR), false);
        modes.view_mode = mode;
        modes.list(&scene);
        let mut renderer =
            Renderer::new(&gpu, Arc::new(scene.clone()), modes, &device::bake_meshes(&scene)).unwrap();
        renderer.render(&camera, 1.0).unwrap();
        let shown = renderer.picture().unwrap().display;
        // Of the coverage mode the ground alone is shown; all others show the crown in the middle in a colour that the corners do not have.
        let at = |x: u32, y: u32| &shown[4 * (y * SIZE[0] + x) as usize..][..3];
        assert_eq!(at(48, 36) == at(2, 2), mode == ViewMode::Coverage, "{name}");
    }
    let mut single = scene.clone();
    single.settings.set("samples", 1.0).unwrap();
    let [one, four] =
        [&single, &scene].map(|s| mean(draw(&gpu, s, &camera, NEAR).1.linear.unwrap().coverage));
    assert!((one - four).abs() < 0.01, "{one} {four}");
    gpu.close().unwrap();
}

#[test]
fn what_meshes_take_is_planned_and_what_they_cannot_be_is_refused() {
    let gpu = device::open();
    let scene = oaks(&[[50.0, 50.0, 1.0]], DAY);
    let (near, far) = (
        device::camera([50.0, 31.0, 8.0], [50.0, 50.0, 7.0]),
        device::camera([50.0, -900.0, 300.0], [50.0, 50.0, 7.0]),
    );
    let of = |camera: &Camera, by: &str| plan(&gpu, &scene, camera, ladder(by), false);
    let names = |plan: &Plan| {
        plan.items.iter().filter(|i| i.name.contains("mesh") || i.name.contains("leaf")).count()
    };
    assert_eq!(names(&of(&near, NEAR)), 3 + 1 + 3 + 3);
    // Without the rung, and where no tree comes near enough, nothing of it is there.
    assert_eq!([names(&of(&near, "zfield:4,shader-map")), names(&of(&far, NEAR))], [0, 0]);
    let refused = |drawing: Drawing| {
        let eye = Eye::new(&near, &scene.terrain, SIZE);
        Plan::for_eye(&scene, &eye, false, drawing, Some(gpu.info())).unwrap_err().to_string()
    };
    let graphics = refused(Drawing { ladder: Some(ladder(NEAR)), rasterizer: Some(Rasterizer::Graphics) });
    assert!(graphics.contains("--rasterizer tiles"), "{graphics}");
    // A ladder that may go without meshes does, and says why: for the rasteriser, and for memory that holds z-fields and no meshes.
    let planned = |scene: &Scene, drawing: Drawing| {
        let eye = Eye::new(&near, &scene.terrain, SIZE);
        Plan::for_eye(scene, &eye, false, drawing, Some(gpu.info()))
    };
    let auto = |rasterizer| Drawing { ladder: Some(Ladder::AUTO), rasterizer };
    let all = planned(&scene, auto(None)).unwrap();
    assert!(all.meshes && all.no_meshes.is_none() && all.rasterizer == Rasterizer::Tiles);
    let fewer = planned(&scene, auto(Some(Rasterizer::Graphics))).unwrap();
    assert!(
        !fewer.meshes && !fewer.ladder.meshes() && fewer.no_meshes.unwrap().contains("--rasterizer tiles")
    );
    let without = planned(&scene, Drawing::from(Ladder::BN12)).unwrap();
    assert!(without.bytes() < all.bytes());
    let mut tight = scene.clone();
    tight.settings.memory_mib = ((without.bytes() >> 20) + 1) as u32;
    assert!(all.bytes() > u64::from(tight.settings.memory_mib) << 20, "{} {}", all.bytes(), without.bytes());
    let fewer = planned(&tight, auto(None)).unwrap();
    assert!(!fewer.meshes && fewer.no_meshes.unwrap().contains("memory_mib"));
    assert!(planned(&tight, Drawing::from(ladder(NEAR))).is_err());
    let mut large = scene.clone();
    let mesh = Arc::make_mut(&mut large.species[0].mesh);
    mesh.triangles = mesh.triangles.iter().cycle().take(530_000).cloned().collect();
    let fewer = planned(&large, auto(None)).unwrap();
    assert!(!fewer.meshes && fewer.no_meshes.unwrap().contains("simplify the model"));
    // A camera that comes nearer than the plan was made for is told so.
    let mut renderer =
        Renderer::new(&gpu, Arc::new(scene.clone()), of(&far, NEAR), &device::bake_meshes(&scene)).unwrap();
    let e = renderer.render(&near, 1.0).unwrap_err().to_string();
    assert!(e.contains("plan again"), "{e}");
    drop(renderer);
    // So is one that is amid more of them than lists hold.
    let places: Vec<[f64; 3]> =
        (0..4900).map(|k| [30.0 + 0.5 * f64::from(k % 70), 30.0 + 0.5 * f64::from(k / 70), 0.05]).collect();
    let many = oaks(&places, DAY);
    let above = device::camera([47.5, 47.5, 40.0], [47.5, 48.0, 0.0]);
    let eye = Eye::looking([47.5, 47.5, 40.0], [0.0, 0.01, -1.0], 50.0, [1600, 1600]);
    let plan =
        Plan::for_eye(&many, &eye, false, ladder("mesh:16,zfield:4,shader-map"), Some(gpu.info())).unwrap();
    let mut renderer =
        Renderer::new(&gpu, Arc::new(many.clone()), plan, &device::bake_meshes(&many)).unwrap();
    let e = renderer.render(&above, 1.0).unwrap_err().to_string();
    assert!(e.contains("raise mesh_min_pixels"), "{e}");
    drop(renderer);
    // Where the ladder leaves it to the plan, meshes end where no more of them can be in view: four trees stand on a square metre.
    let mut few = many.clone();
    few.settings.mesh_min_pixels = 16.0;
    let plan = Plan::for_eye(&few, &eye, false, Ladder::AUTO, Some(gpu.info())).unwrap();
    assert!(!plan.meshes && (6.0..12.0).contains(&plan.last_mesh_range), "{}", plan.last_mesh_range);
    let mut renderer = Renderer::new(&gpu, Arc::new(few.clone()), plan, &device::bake_meshes(&few)).unwrap();
    renderer.render(&above, 1.0).unwrap();
    drop(renderer);
    gpu.close().unwrap();
}
