//! Whole frames at the ends of every range: finite, not negative, and what the extreme means.

use crate::device;
use canopy::frame::FrameReport;
use canopy::gpu::Gpu;
use canopy::image::{Linear, Picture};
use canopy::scene::{Camera, Distribution, Scene, TreePosition};
use std::sync::Arc;

const SIZE: [u32; 2] = [64, 48];

/// A grove of listed birches on a plain of 100 m, one of them in the middle.
fn grove(text: &str) -> Scene {
    let mut scene = device::small_scene(&format!(
        "seed = 2\n[terrain]\nextent = 100.0\nalbedo = 0.2\n\
         [[species]]\nname = \"a\"\nmodel = \"builtin:birch\"\ndensity = 0.0\n{text}\n\
         [[camera]]\nname = \"c\"\nposition = [20.0, 20.0, 6.0]\ntarget = [50.0, 50.0, 5.0]\nvertical_fov = 50.0\n"
    ));
    let place = |k: u32| TreePosition {
        x: f64::from(k % 15) * 7.0 + 1.0,
        y: f64::from(k / 15) * 7.0 + 1.0,
        scale: None,
        rotation: None,
    };
    let mut list: Vec<_> = (0..225).map(place).collect();
    list[0] = TreePosition { x: 50.0, y: 50.0, scale: Some(1.0), rotation: Some(30.0) };
    scene.species[0].distribution = Distribution::Positions(Arc::new(list));
    scene
}

const DAY: &str = "[sun]\nazimuth = 210.0\nelevation = 35.0\nirradiance = [1.0, 0.95, 0.85]\n[sky]\nradiance = [0.06, 0.09, 0.14]";

/// Draws a frame, and checks that every number of it is one.
fn frame(gpu: &Gpu, scene: &Scene, camera: &Camera, size: [u32; 2], what: &str) -> (FrameReport, Picture) {
    let mut renderer = device::renderer(gpu, scene, camera, size, true);
    let report = renderer.render(camera, 1.0).unwrap_or_else(|e| panic!("{what}: {e}"));
    let picture = renderer.picture().unwrap();
    let l = picture.linear.as_ref().unwrap();
    let pixels = (size[0] * size[1]) as usize;
    assert_eq!((picture.size, l.sun.len(), picture.display.len()), (size, pixels, 4 * pixels), "{what}");
    for (k, value) in l.sun.iter().chain(&l.sky).flatten().enumerate() {
        assert!(value.is_finite() && *value >= 0.0, "{what}: radiance {value} at {k}");
    }
    assert!(l.depth.iter().all(|d| d.is_finite() && *d >= 0.0), "{what}: depth");
    assert!(l.coverage.iter().all(|c| (0.0..=1.0).contains(c)), "{what}: coverage");
    assert!(l.species.iter().all(|s| *s as usize <= scene.species.len()), "{what}: species");
    (report, picture)
}

fn linear(picture: &Picture) -> &Linear {
    picture.linear.as_ref().unwrap()
}

fn mean(values: impl IntoIterator<Item = f32>) -> f64 {
    let (mut sum, mut n) = (0.0, 0.0);
    for v in values {
        sum += f64::from(v);
        n += 1.0;
    }
    sum / n
}

fn passes(report: &FrameReport) -> Vec<&str> {
    report.timing.passes.iter().map(|p| p.name.as_str()).collect()
}

#[test]
fn trees_from_a_hand_to_a_hundred_metres() {
    let gpu = device::open();
    for height in [0.1, 100.0] {
        let mut scene = grove(DAY);
        let factor = height / 14.0;
        let mesh = Arc::make_mut(&mut scene.species[0].mesh);
        mesh.positions.iter_mut().flatten().for_each(|v| *v *= factor);
        let f = f64::from(factor);
        let camera = device::camera([50.0 - 20.0 * f, 50.0 - 20.0 * f, 7.0 * f], [50.0, 50.0, 6.0 * f]);
        let (report, picture) = frame(&gpu, &scene, &camera, SIZE, &format!("{height} m"));
        let cover = mean(linear(&picture).coverage.clone());
        println!("{height} m: {:?}, coverage {cover:.3}", report.trees);
        assert!(report.trees.camera > 0 && cover > 0.02, "{height} m: nothing is seen");
        // The tree in the middle of the image stands where it should: 28 f metres away, give or take its crown.
        let l = linear(&picture);
        let nearest = l.depth.iter().zip(&l.species).filter(|(d, s)| **s > 0 && **d > 0.0).map(|(d, _)| *d);
        let nearest = f64::from(nearest.fold(f32::INFINITY, f32::min));
        assert!(nearest < 40.0 * f, "{height} m: nearest tree at {nearest} m");
    }
    gpu.close().unwrap();
}

#[test]
fn cameras_where_no_camera_belongs() {
    let gpu = device::open();
    let scene = grove(DAY);
    // In the very middle of a tree's box there is no direction to it.
    let centre = f64::from(device::bake(&scene)[0].species.crown.frame.centre);
    let cases = [
        ("the centre of a crown", device::camera([50.0, 50.0, centre], [60.0, 60.0, 8.0])),
        ("inside a crown", device::camera([50.0, 50.0, 8.0], [60.0, 60.0, 8.0])),
        ("inside a crown, down", device::camera([50.1, 50.0, 8.0], [50.1, 50.0, 0.0])),
        ("at a trunk base", device::camera([50.0, 50.0, 0.0], [51.0, 50.0, 1.0])),
        ("under the ground", device::camera([50.0, 40.0, -5.0], [50.0, 60.0, 5.0])),
        ("far under the ground", device::camera([50.0, 40.0, -5000.0], [50.0, 60.0, 5.0])),
        ("a centimetre above it", device::camera([40.0, 40.0, 0.01], [60.0, 60.0, 0.5])),
        ("a thousand kilometres up", device::camera([50.0, 50.0, 1e6], [50.0, 50.0, 0.0])),
        ("a thousand kilometres aside", device::camera([1e6, 50.0, 100.0], [50.0, 50.0, 0.0])),
        ("straight down", device::camera([50.0, 50.0, 40.0], [50.0, 50.0, 0.0])),
        ("straight up", device::camera([47.0, 47.0, 0.5], [47.0, 47.0, 40.0])),
        ("a needle's view", Camera { vertical_fov: 0.1, ..scene.cameras[0].clone() }),
        ("a fish's view", Camera { vertical_fov: 170.0, ..scene.cameras[0].clone() }),
    ];
    for (what, camera) in cases {
        let (report, picture) = frame(&gpu, &scene, &camera, SIZE, what);
        let cover = mean(linear(&picture).coverage.clone());
        println!("{what}: {:?}, coverage {cover:.3}", report.trees);
        if matches!(what, "straight down" | "straight up" | "a fish's view" | "a centimetre above it") {
            assert!(cover > 0.005, "{what}: no tree is seen");
        }
    }
    gpu.close().unwrap();
}

#[test]
fn images_of_one_pixel_and_of_the_widest() {
    let gpu = device::open();
    let scene = grove(DAY);
    for size in [[1, 1], [1, 300], [16384.min(gpu.info().max_image_side), 16]] {
        frame(&gpu, &scene, &scene.cameras[0], size, &format!("{size:?}"));
    }
    gpu.close().unwrap();
}

#[test]
fn suns_at_the_zenith_at_the_horizon_and_below() {
    let gpu = device::open();
    let sunlight = |elevation: f64| {
        let sky = "[sky]\nradiance = 0.1";
        let scene =
            grove(&format!("[sun]\nazimuth = 90.0\nelevation = {elevation:?}\nirradiance = 1.0\n{sky}"));
        let (report, picture) = frame(&gpu, &scene, &scene.cameras[0], SIZE, &format!("sun at {elevation}"));
        (mean(linear(&picture).sun.iter().map(|c| c[0])), passes(&report).contains(&"shadows"))
    };
    let (zenith, shadows) = sunlight(90.0);
    assert!(zenith > 0.01 && shadows);
    let (horizon, shadows) = sunlight(0.0);
    assert!(shadows);
    let (below, shadows) = sunlight(-5.0);
    assert!(below == 0.0 && !shadows, "{below}");
    // The sun goes without a jump: what is left of its disc times what is left of the light.
    let (almost, _) = sunlight(-0.26);
    println!("zenith {zenith}, horizon {horizon}, almost gone {almost}");
    assert!(horizon < zenith && almost < 0.02 * horizon.max(1e-3), "{almost} {horizon}");
    gpu.close().unwrap();
}

#[test]
fn light_of_nothing_and_of_a_million() {
    let gpu = device::open();
    let light = |sun: f64, sky: f64| {
        let scene = grove(&format!(
            "[sun]\nazimuth = 90.0\nelevation = 30.0\nirradiance = {sun:?}\n[sky]\nradiance = {sky:?}"
        ));
        frame(&gpu, &scene, &scene.cameras[0], SIZE, &format!("sun {sun} sky {sky}"))
    };
    let (report, dark) = light(0.0, 0.0);
    assert!(linear(&dark).sun.iter().chain(&linear(&dark).sky).all(|c| *c == [0.0; 3]));
    assert!(dark.display.chunks_exact(4).all(|p| p == [0, 0, 0, 255]));
    assert!(!passes(&report).contains(&"shadows"));
    let (_, no_sky) = light(1.0, 0.0);
    assert!(linear(&no_sky).sky.iter().all(|c| *c == [0.0; 3]));
    let (_, one) = light(1.0, 0.125);
    let (_, million) = light(1e6, 0.125e6);
    for (a, b) in linear(&one)
        .sun
        .iter()
        .zip(&linear(&million).sun)
        .chain(linear(&one).sky.iter().zip(&linear(&million).sky))
    {
        for k in 0..3 {
            // Half floats scaled to the brightest light: a step of them, and half floats of almost nothing.
            let room = f64::from(a[k]) / 1024.0 + 1e-7;
            assert!((f64::from(b[k]) / 1e6 - f64::from(a[k])).abs() <= room, "{a:?} {b:?}");
        }
    }
    let (_, bright) = light(1e6, 0.0);
    let (_, dim) = light(1e-6, 0.0);
    assert!(mean(linear(&bright).sun.iter().map(|c| c[0])) > 1e3);
    assert!(mean(linear(&dim).sun.iter().map(|c| c[0])) > 1e-9);
    gpu.close().unwrap();
}

#[test]
fn a_scene_without_trees_and_one_with_a_single_tree() {
    let gpu = device::open();
    let mut scene = grove(DAY);
    let listed = |list: Vec<TreePosition>| Distribution::Positions(Arc::new(list));
    scene.species[0].distribution =
        listed(vec![TreePosition { x: 50.0, y: 50.0, scale: None, rotation: None }]);
    let (report, picture) = frame(&gpu, &scene, &scene.cameras[0], SIZE, "one tree");
    assert_eq!(report.trees.camera, 1);
    assert!(mean(linear(&picture).coverage.clone()) > 0.005);
    scene.species[0].distribution = listed(Vec::new());
    let (report, picture) = frame(&gpu, &scene, &scene.cameras[0], SIZE, "an empty list");
    assert_eq!(report.trees.camera, 0);
    scene.species.clear();
    let (report, bare) = frame(&gpu, &scene, &scene.cameras[0], SIZE, "no species");
    assert_eq!(report.trees.camera, 0);
    assert_eq!(picture, bare, "a species without trees changes nothing");
    assert!(linear(&bare).coverage.iter().all(|c| *c == 0.0));
    gpu.close().unwrap();
}

#[test]
fn moving_the_origin_by_ten_thousand_kilometres_changes_no_bit() {
    let gpu = device::open();
    let picture = |origin: f64| {
        let at = |x: f64, y: f64, z: f64| format!("[{:?}, {:?}, {z:?}]", origin + x, origin + y);
        let scene = device::small_scene(&format!(
            "seed = 2\n[terrain]\norigin = [{origin:?}, {origin:?}]\nextent = 200.0\nalbedo = 0.2\n\
             [[species]]\nname = \"a\"\nmodel = \"builtin:birch\"\ndensity = 0.02\n{DAY}\n\
             [[camera]]\nname = \"c\"\nposition = {}\ntarget = {}\nvertical_fov = 50.0\n",
            at(20.5, 31.25, 6.0),
            at(60.0, 70.0, 5.0)
        ));
        frame(&gpu, &scene, &scene.cameras[0], SIZE, &format!("origin {origin}"))
    };
    let ((report, here), (_, there)) = (picture(0.0), picture(1e7));
    assert!(report.trees.camera > 50);
    assert_eq!(here, there);
    gpu.close().unwrap();
}
