//! Nothing grows, and nothing is said: a thousand frames, each from another place, two in flight.

use std::sync::Arc;

use canopy::camera::Eye;
use canopy::frame::Renderer;
use canopy::gpu::{Gpu, GpuOptions};
use canopy::plan::{Drawing, Plan, Rasterizer};

use crate::device;

/// Memory of the process that is in use, MiB.
fn resident() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find(|l| l.starts_with("VmRSS:")).unwrap();
    line.split_whitespace().nth(1).unwrap().parse::<f64>().unwrap() / 1024.0
}

fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[sorted.len() / 2]
}

#[test]
#[ignore = "takes minutes"]
fn a_thousand_camera_jumps_leave_memory_flat() {
    // Without validation: the layers remember more with every submission, 0.1 to 0.2 MiB a frame.
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    let scene = device::small_scene(device::WOODS);
    let mut found = Vec::new();
    device::soak_in_flight(&gpu, &scene, (1000, 2), |frame| {
        if frame % 10 == 9 {
            found.push(resident());
        }
    });
    gpu.close().unwrap();
    // The first hundreds of frames fill caches that were set aside, the driver's too; single views take more for a moment.
    let (early, late) = (median(&found[20..50]), median(&found[70..]));
    println!("{early:.1} MiB in frames 200 to 500, {late:.1} in 700 to 1000");
    assert!(late <= 1.01 * early, "{found:?}");
}

#[test]
#[ignore = "takes minutes"]
fn a_thousand_camera_jumps_leave_validation_silent() {
    let gpu = device::open();
    device::soak_in_flight(&gpu, &device::small_scene(device::WOODS), (1000, 2), |_| ());
    gpu.close().unwrap();
}

#[test]
#[ignore = "takes minutes"]
fn the_same_picture_again_leaves_memory_flat() {
    // From one place nothing is loaded or made anew, so that what a driver keeps of every frame shows in few: a shader that
    // lavapipe compiles at every use (see `cascade_at` in shaders/physics/shadow.glsl) took 0.7 MiB a frame.
    let plain = device::WOODS.replace("heightmap = \"builtin:ridge\"", "extent = 400.0");
    let tiles = Drawing::default();
    let graphics = Drawing::from(Rasterizer::Graphics);
    for (text, drawing, layers, samples) in [
        (device::WOODS, tiles, false, 4),
        (device::WOODS, tiles, true, 1),
        (device::WOODS, graphics, false, 4),
        (device::WOODS, graphics, true, 1),
        (&plain, tiles, false, 4),
    ] {
        let gpu = Gpu::new(&GpuOptions::default()).unwrap();
        let mut scene = device::small_scene(text);
        scene.settings.samples = samples;
        let camera = device::camera([180.0, 190.0, 60.0], [250.0, 260.0, 10.0]);
        let eye = Eye::new(&camera, &scene.terrain, [96, 64]);
        let plan = Plan::for_eye(&scene, &eye, layers, drawing, Some(gpu.info())).unwrap();
        let baked = device::bake(&scene);
        let mut renderer = Renderer::new(&gpu, Arc::new(scene), plan, &baked).unwrap();
        let mut found = Vec::new();
        for _ in 0..60 {
            let cascades = renderer.cascades(&eye);
            let frame = renderer.submit(&eye, &cascades, 1.0).unwrap();
            renderer.finish(frame).unwrap();
            found.push(resident());
        }
        let (early, late) = (median(&found[15..25]), median(&found[50..]));
        println!(
            "{drawing:?}, layers {layers}, {samples} samples: {early:.1} MiB, {late:.1} MiB 30 frames later"
        );
        assert!(late <= early + 3.0, "{drawing:?}, layers {layers}, {samples} samples: {found:?}");
    }
}
