//! Whole frames along paths through the extremes: finite everywhere, and without a jump.

use crate::device;
use canopy::frame::Renderer;
use canopy::gpu::Gpu;
use canopy::image::Linear;
use canopy::scene::{Camera, Scene, Sun};

const SIZE: [u32; 2] = [48, 36];
/// Sun part, sky part, and the four fractions: means over the image.
const NAMES: [&str; 6] = ["sun", "sky", "lit ground", "shadowed ground", "lit trees", "shadowed trees"];
/// Steps to either side of a step that say how large it should be.
const WINDOW: usize = 5;
/// A step of a smooth path is about as large as those around it: were a function as steep as exp(s / 3) of the step, the
/// window's end would be 5 times as steep as its middle, and the median half of that.
const STEEPNESS: f64 = 4.0;
/// What no one sees: a hundredth of what there is at most on the path (Weber's contrast).
const UNSEEN: f64 = 0.01;
/// Share of the image's samples that one texel of a shadow map may give or take, when its grid moves on: eight.
const TEXEL: f64 = 8.0 / (48.0 * 36.0 * 4.0);

fn scene() -> Scene {
    device::small_scene(
        "seed = 6\n[terrain]\nextent = 120.0\nalbedo = 0.2\n\
         [[species]]\nname = \"a\"\nmodel = \"builtin:birch\"\ndensity = 0.02\n\
         [sun]\nazimuth = 140.0\nelevation = 50.0\nirradiance = 1.0\n[sky]\nradiance = 0.1\n\
         [[camera]]\nname = \"c\"\nposition = [20.0, 10.0, 30.0]\ntarget = [60.0, 60.0, 0.0]\nvertical_fov = 50.0\n",
    )
}

/// Means of a frame, all of whose numbers are numbers.
fn means(l: &Linear, what: &str) -> [f64; 6] {
    let mut sums = [0.0; 6];
    for ((sun, sky), fractions) in l.sun.iter().zip(&l.sky).zip(&l.fractions) {
        let values = [sun[1], sky[1], fractions[0], fractions[1], fractions[2], fractions[3]];
        for (sum, v) in sums.iter_mut().zip(values) {
            assert!(v.is_finite() && v >= 0.0, "{what}: {v}");
            *sum += f64::from(v);
        }
    }
    assert!(l.depth.iter().all(|d| d.is_finite() && *d >= 0.0), "{what}: depth");
    sums.map(|s| s / l.sun.len() as f64)
}

fn picture(renderer: &mut Renderer, camera: &Camera, what: &str) -> Linear {
    renderer.render(camera, 1.0).unwrap_or_else(|e| panic!("{what}: {e}"));
    renderer.picture().unwrap().linear.unwrap()
}

/// No step exceeds what the steps around it, the eye and the texels of shadow maps allow.
fn smooth(path: &str, frames: &[[f64; 6]]) {
    for (k, name) in NAMES.iter().enumerate() {
        let most = frames.iter().map(|f| f[k]).fold(0.0, f64::max);
        let steps: Vec<f64> = frames.windows(2).map(|w| (w[1][k] - w[0][k]).abs()).collect();
        let mut worst = (0.0, 0);
        for (i, step) in steps.iter().enumerate() {
            let near = &steps[i.saturating_sub(WINDOW)..(i + WINDOW + 1).min(steps.len())];
            let mut near: Vec<f64> = near.to_vec();
            near.sort_unstable_by(f64::total_cmp);
            let texel = if k < 2 { TEXEL * most } else { TEXEL };
            let room = STEEPNESS * near[near.len() / 2] + UNSEEN * most + texel;
            if most > 0.0 && step / room > worst.0 {
                worst = (step / room, i);
            }
        }
        println!(
            "{path}, {name}: at most {most:.4}, largest step {:.2} of its room, at {}",
            worst.0, worst.1
        );
        assert!(worst.0 <= 1.0, "{path}: {name} jumps at step {}: {:?}", worst.1, &steps[worst.1]);
    }
}

/// Frames of a camera under suns.
fn suns(gpu: &Gpu, path: &str, places: impl Iterator<Item = [f64; 2]>) -> Vec<[f64; 6]> {
    let scene = scene();
    let camera = scene.cameras[0].clone();
    let mut renderer = device::renderer(gpu, &scene, &camera, SIZE, true);
    places
        .map(|[azimuth, elevation]| {
            renderer.set_sun(Sun { azimuth, elevation, ..scene.sun }).unwrap();
            means(&picture(&mut renderer, &camera, path), &format!("{path}, {azimuth} {elevation}"))
        })
        .collect()
}

#[test]
fn the_sun_sets_without_a_jump() {
    let gpu = device::open();
    let frames = suns(&gpu, "sunset", (0..=200).map(|k| [140.0, 5.0 - 0.05 * f64::from(k)]));
    smooth("sunset", &frames);
    assert!(frames[0][0] > 5e-4 && frames[200][0] == 0.0, "{:?}", frames[0]);
    gpu.close().unwrap();
}

#[test]
fn the_sun_passes_the_zenith_without_a_jump() {
    let gpu = device::open();
    let side = |k: i32| if k < 0 { 140.0 } else { 320.0 };
    let place = |k: i32| [side(k), 90.0 - 0.1 * f64::from(k).abs()];
    let frames = suns(&gpu, "zenith", (-40..=40).map(place));
    smooth("zenith", &frames);
    gpu.close().unwrap();
}

#[test]
fn the_camera_rises_without_a_jump() {
    let gpu = device::open();
    let mut scene = scene();
    scene.cameras[0].position = [60.0, 60.0, 0.01];
    let mut renderer = device::renderer(&gpu, &scene, &scene.cameras[0].clone(), SIZE, true);
    let mut frames = Vec::new();
    for k in 0..=240 {
        let height = 10f64.powf(-2.0 + f64::from(k) / 30.0);
        // What is nearer than the near plane, 5 cm, leaves the image from below, row by row.
        let camera = device::camera([60.3, 59.1, height], [90.3, 59.1, 0.0]);
        let l = picture(&mut renderer, &camera, "rise");
        frames.push(means(&l, &format!("{height} m")));
    }
    drop(renderer);
    smooth("rise", &frames);
    gpu.close().unwrap();
}

#[test]
fn the_view_passes_the_light_without_a_jump() {
    let gpu = device::open();
    let scene = scene();
    let light = glam::DVec3::from(canopy::camera::sun_direction(&scene.sun));
    let across = light.cross(glam::DVec3::Z).normalize();
    // With the light, from above; and against it, from the ground.
    for (path, distance, target) in [("hotspot", 100.0, 0.0), ("against the light", -11.0, 10.0)] {
        let target = glam::DVec3::new(60.0, 60.0, target);
        let camera = |angle: f64| {
            let eye = target + distance * (light * angle.cos() + across * angle.sin());
            Camera { vertical_fov: 20.0, ..device::camera(eye.into(), target.into()) }
        };
        let mut renderer = device::renderer(&gpu, &scene, &camera(0.0), SIZE, true);
        let mut angles: Vec<f64> = (0..=60).map(|k| 10f64.powf(-7.0 + 0.1 * f64::from(k))).collect();
        angles = angles.iter().rev().map(|a| -a).chain([0.0]).chain(angles.iter().copied()).collect();
        let frames: Vec<_> = angles
            .iter()
            .map(|a| means(&picture(&mut renderer, &camera(*a), path), &format!("{path} {a}")))
            .collect();
        smooth(path, &frames);
    }
    gpu.close().unwrap();
}
