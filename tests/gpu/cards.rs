//! Trees that are clouds of cards (Behrendt et al. 2005): where they are, how they are lit, and how they hand over.

use std::sync::Arc;

use crate::device;

use canopy::camera::Eye;
use canopy::frame::{FrameReport, Renderer};
use canopy::gpu::Gpu;
use canopy::image::Linear;
use canopy::ladder::Ladder;
use canopy::physics::light::luminance;
use canopy::plan::{Drawing, Plan, Rasterizer, ViewMode};
use canopy::scene::{Camera, Distribution, Scene, TreePosition};

const SIZE: [u32; 2] = [160, 120];
/// Height of `builtin:oak`, m.
const HEIGHT: f64 = 14.0;

fn ladder(text: &str) -> Ladder {
    text.parse().unwrap()
}

/// Oaks at their places on black ground; clouds are full to the ladder's end unless a test says otherwise.
fn oaks(places: &[[f64; 2]]) -> Scene {
    let mut scene = device::small_scene(
        "seed = 2\n[terrain]\nextent = 400.0\nalbedo = 0.0\n\
         [[species]]\nname = \"oak\"\nmodel = \"builtin:oak\"\ndensity = 0.0\n\
         [sun]\nazimuth = 210.0\nelevation = 35.0\nirradiance = [1.0, 0.95, 0.85]\n[sky]\nradiance = [0.06, 0.09, 0.14]\n\
         [[camera]]\nname = \"c\"\nposition = [20.0, 20.0, 6.0]\ntarget = [50.0, 50.0, 5.0]\nvertical_fov = 50.0\n",
    );
    let tree = |p: &[f64; 2]| TreePosition { x: p[0], y: p[1], scale: Some(1.0), rotation: Some(30.0) };
    scene.species[0].distribution = Distribution::Positions(Arc::new(places.iter().map(tree).collect()));
    for (knob, value) in
        [("cards", 60.0), ("card_atlas", 512.0), ("cloud_min_pixels", 1.0), ("light_model", 1.0)]
    {
        scene.settings.set(knob, value).unwrap();
    }
    scene
}

fn planned(gpu: &Gpu, scene: &Scene, camera: &Camera, by: &str) -> Plan {
    let eye = Eye::new(camera, &scene.terrain, SIZE);
    Plan::for_eye(scene, &eye, true, ladder(by), Some(gpu.info())).unwrap()
}

fn draw(gpu: &Gpu, scene: &Scene, camera: &Camera, by: &str) -> (FrameReport, Linear) {
    let plan = planned(gpu, scene, camera, by);
    let baked = device::bake_for(scene, ladder(by));
    let mut renderer = Renderer::new(gpu, Arc::new(scene.clone()), plan, &baked).unwrap();
    let report = renderer.render(camera, 1.0).unwrap();
    let l = renderer.picture().unwrap().linear.unwrap();
    assert!(l.sun.iter().chain(&l.sky).flatten().all(|v| v.is_finite() && *v >= 0.0));
    assert!(l.depth.iter().all(|d| d.is_finite() && *d >= 0.0));
    assert!(l.coverage.iter().all(|c| (0.0..=1.0).contains(c)));
    (report, l)
}

/// From which a tree in the middle of the terrain is so many pixels high; `azimuth` and the height of the eye over its distance.
fn from(pixels: f64, azimuth: f64, up: f64) -> Camera {
    let away = HEIGHT * f64::from(SIZE[1]) / pixels / (2.0 * 25f64.to_radians().tan());
    let flat = away / (1.0 + up * up).sqrt();
    let position = [200.0 + flat * azimuth.cos(), 200.0 + flat * azimuth.sin(), 0.5 * HEIGHT + flat * up];
    device::camera(position, [200.0, 200.0, 0.5 * HEIGHT])
}

/// What trees cover, and the light that they send from the sun and from the sky where they are all that is seen.
fn trees(l: &Linear) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for k in 0..l.coverage.len() {
        sum[0] += f64::from(l.coverage[k]);
        let whole = if l.coverage[k] > 0.99 { 1.0 } else { 0.0 };
        sum[1] += whole * luminance(l.sun[k]);
        sum[2] += whole * luminance(l.sky[k]);
    }
    sum
}

const CARDS: &str = "cards:4,shader-map";
const MESH: &str = "mesh:16,zfield:4,shader-map";

#[test]
fn a_cloud_covers_and_shines_as_its_mesh_does() {
    let gpu = device::open();
    let scene = oaks(&[[200.0, 200.0]]);
    let mut sums = [[0.0; 3]; 2];
    for k in 0..8u32 {
        let camera = from(90.0, 0.8 * f64::from(k), [0.1, 0.5, 1.0, 2.5][k as usize % 4]);
        let (report, cloud) = draw(&gpu, &scene, &camera, CARDS);
        assert_eq!((report.trees.camera, report.trees.cards, report.trees.meshes), (1, 1, 0));
        let [a, b] = [&cloud, &draw(&gpu, &scene, &camera, MESH).1].map(trees);
        (0..3).for_each(|i| {
            sums[0][i] += a[i];
            sums[1][i] += b[i];
        });
        // Each direction has its own few dozen cards: measured over 50 directions 0.975 to 1.065.
        assert!((a[0] / b[0] - 1.0).abs() < 0.1, "{k}: {a:?} {b:?}");
    }
    let ratio = [0, 1, 2].map(|i| sums[0][i] / sums[1][i]);
    println!("coverage, sun, sky: {ratio:.3?}");
    // Over directions: coverage of 60 cards 1.02 to 1.03; light of whole pixels, of which a cloud has some more, within a tenth.
    assert!((ratio[0] - 1.0).abs() < 0.05 && (1..3).all(|i| (ratio[i] - 1.0).abs() < 0.12), "{ratio:?}");
    gpu.close().unwrap();
}

#[test]
fn every_sample_of_a_tree_that_hands_over_is_of_one_rung() {
    let gpu = device::open();
    let scene = oaks(&[[200.0, 200.0]]);
    let all = "mesh:60,cards:30,zfield:4,shader-map";
    let ends = [(60.0, MESH), (30.0, "zfield:4,shader-map")];
    for (pixels, other) in ends {
        // Over the band of the hand-over, 0.8 to 1 of the range.
        for part in [0.75, 0.82, 0.86, 0.9, 0.94, 0.98, 1.05] {
            let camera = from(pixels / part, 0.3, 0.3);
            let [mixed, cards, far] =
                [all, CARDS, other].map(|by| trees(&draw(&gpu, &scene, &camera, by).1)[0]);
            let [least, most] = [cards.min(far), cards.max(far)];
            // Samples of both are disjoint: neither a gap nor both at once; two coverages with independent edges differ by as much as single pixels do.
            assert!(mixed > 0.93 * least && mixed < 1.07 * most, "{pixels} {part}: {mixed} of {cards} {far}");
        }
    }
    gpu.close().unwrap();
}

#[test]
fn the_far_form_takes_over_without_a_gap() {
    let gpu = device::open();
    let mut scene = oaks(&[[200.0, 200.0]]);
    scene.settings.set("cloud_min_pixels", 80.0).unwrap();
    for (azimuth, up) in [(0.0, 0.1), (0.785, 0.1), (0.4, 1.0), (1.0, 40.0)] {
        for part in [0.9, 1.0, 1.2, 1.4, 1.5, 1.6, 1.8, 2.0, 2.2] {
            let camera = from(80.0 / part, azimuth, up);
            let [cloud, mesh] = [CARDS, MESH].map(|by| trees(&draw(&gpu, &scene, &camera, by).1)[0]);
            // Three cards cover 0.82 to 1.08 of the mesh; while both forms are there they cover up to a fifth more.
            assert!((0.78..1.3).contains(&(cloud / mesh)), "{azimuth} {up} {part}: {cloud} {mesh}");
        }
    }
    gpu.close().unwrap();
}

#[test]
fn eyes_inside_clouds_and_suns_under_the_horizon_draw_numbers() {
    let gpu = device::open();
    let mut scene = oaks(&[[200.0, 200.0], [203.0, 200.0]]);
    scene.settings.set("cloud_min_pixels", 64.0).unwrap();
    for (position, target) in [
        ([200.0, 200.0, 9.0], [210.0, 200.0, 9.0]),
        ([200.3, 200.0, 1.0], [200.0, 200.0, 1.0]),
        ([199.0, 199.0, 0.5], [199.0, 199.0, 20.0]),
        ([200.0, 200.0, 60.0], [200.0, 200.0, 0.0]),
    ] {
        let (report, _) = draw(&gpu, &scene, &device::camera(position, target), CARDS);
        assert!(report.trees.cards > 0, "{position:?}");
    }
    let camera = from(90.0, 0.3, 0.3);
    scene.sun.elevation = -5.0;
    let under = draw(&gpu, &scene, &camera, CARDS).1;
    assert!(trees(&under)[0] > 100.0);
    scene.sun.irradiance = [0.0; 3];
    let l = draw(&gpu, &scene, &camera, CARDS).1;
    assert!(l.sun.iter().flatten().all(|v| *v == 0.0) && trees(&l)[2] > 0.0);
    gpu.close().unwrap();
}

#[test]
fn frames_of_cards_are_the_same_bits_whatever_came_before() {
    let gpu = device::open();
    let places: Vec<[f64; 2]> =
        (0..25).map(|k| [180.0 + 10.0 * f64::from(k % 5), 180.0 + 10.0 * f64::from(k / 5)]).collect();
    let mut scene = oaks(&places);
    scene.settings.set("cloud_min_pixels", 40.0).unwrap();
    let cameras = [from(60.0, 0.2, 0.1), from(30.0, 2.0, 0.6)];
    let alone = cameras.clone().map(|c| draw(&gpu, &scene, &c, CARDS).1);
    let plan = planned(&gpu, &scene, &cameras[1], CARDS);
    let baked = device::bake_for(&scene, ladder(CARDS));
    let mut renderer = Renderer::new(&gpu, Arc::new(scene), plan, &baked).unwrap();
    for k in [0, 1, 1, 0] {
        renderer.render(&cameras[k], 1.0).unwrap();
        assert!(renderer.picture().unwrap().linear.unwrap() == alone[k], "camera {k}");
    }
    drop(renderer);
    gpu.close().unwrap();
}

#[test]
fn what_a_chain_does_not_use_is_not_planned() {
    let gpu = device::open();
    let scene = oaks(&[[200.0, 200.0]]);
    let camera = from(90.0, 0.3, 0.3);
    let has = |by: &str, what: &str| {
        let plan = planned(&gpu, &scene, &camera, by);
        plan.items.iter().any(|i| i.name.contains(what))
    };
    // Tiles, their buffers and light transfer of views are z-fields'; views themselves also cast shadows.
    for what in ["trees seen", "tile lists", "light transfer", "view outlines", "light ray"] {
        assert!(!has(CARDS, what) && has("zfield:4,shader-map", what), "{what}");
    }
    for what in ["card light", "cards", "forest sky"] {
        assert!(has(CARDS, what) && !has("zfield:4,shader-map", what), "{what}");
    }
    assert!(has(CARDS, "z-field views") && !has(CARDS, "face transfers") && !has(CARDS, "leaf envelopes"));
    // Meshes by harmonics have no envelopes.
    assert!(has(MESH, "face transfers") && !has(MESH, "leaf envelopes") && has(MESH, "forest sky"));
    // Far away nothing of it is there.
    let far = device::camera([200.0, -5000.0, 300.0], [200.0, 200.0, 5.0]);
    assert!(planned(&gpu, &scene, &far, CARDS).items.iter().all(|i| !i.name.contains("card")));
    let eye = Eye::new(&camera, &scene.terrain, SIZE);
    let drawing = Drawing { ladder: Some(ladder(CARDS)), rasterizer: Some(Rasterizer::Graphics) };
    let e = Plan::for_eye(&scene, &eye, true, drawing, Some(gpu.info())).unwrap_err().to_string();
    assert!(e.contains("without cards"), "{e}");
    gpu.close().unwrap();
}

#[test]
fn a_plan_for_trees_beyond_all_cards_draws_them_together() {
    let gpu = device::open();
    let mut scene = oaks(&[]);
    scene.species[0].distribution =
        Distribution::Density { map: None, max_density: 0.005, between_heights: None, below_slope: None };
    // Single trees end at 30 pixels, 60 m away, and the range of cards is twice as far.
    let camera = device::camera([200.0, 200.0, 100.0], [200.0, 200.1, 0.0]);
    let (report, l) = draw(&gpu, &scene, &camera, "cards:30,shader-map");
    assert!(report.trees.camera == 0 && l.coverage.iter().sum::<f32>() > 100.0, "{}", report.trees.camera);
    gpu.close().unwrap();
}

#[test]
fn every_view_mode_and_one_sample_a_pixel_show_cards() {
    let gpu = device::open();
    let scene = oaks(&[[200.0, 200.0]]);
    let camera = from(90.0, 0.3, 0.3);
    let baked = device::bake_for(&scene, ladder(CARDS));
    for (name, mode) in ViewMode::NAMES {
        let eye = Eye::new(&camera, &scene.terrain, SIZE);
        let mut plan = Plan::for_eye(&scene, &eye, false, ladder(CARDS), Some(gpu.info())).unwrap();
        plan.view_mode = mode;
        plan.list(&scene);
        let mut renderer = Renderer::new(&gpu, Arc::new(scene.clone()), plan, &baked).unwrap();
        renderer.render(&camera, 1.0).unwrap();
        let shown = renderer.picture().unwrap().display;
        let at = |x: u32, y: u32| &shown[4 * (y * SIZE[0] + x) as usize..][..3];
        // In the crown's middle rows something differs from the corner, but where the mode shows the ground alone.
        let crown = (60..100).any(|x| at(x, 50) != at(2, 2));
        assert!(crown || mode == ViewMode::Coverage, "{name}");
    }
    let mut single = scene.clone();
    single.settings.set("samples", 1.0).unwrap();
    let [one, four] = [&single, &scene].map(|s| trees(&draw(&gpu, s, &camera, CARDS).1)[0]);
    assert!((one / four - 1.0).abs() < 0.03, "{one} {four}");
    gpu.close().unwrap();
}
