//! Memory that runs out, and a device that is lost, at every place where a frame can meet it.

use std::collections::BTreeSet;
use std::sync::Arc;

use canopy::bake::Baked;
use canopy::frame::Renderer;
use canopy::gpu::{Failure, Gpu};
use canopy::image::Picture;
use canopy::plan::Plan;
use canopy::scene::Scene;

use crate::device;

const SCENE: &str = "[terrain]\nheightmap = \"builtin:ridge\"\n[[species]]\nname = \"oak\"\nmodel = \"builtin:oak\"\n\
    density = 0.02\n[sun]\nazimuth = 180.0\nelevation = 40.0\nirradiance = 1.0\n[sky]\nradiance = 0.1\n\
    [[camera]]\nname = \"a\"\nposition = [4000.0, 4000.0, 30.0]\ntarget = [4000.0, 4300.0, 0.0]\nvertical_fov = 45.0\n";

/// From nothing to a picture, by every kind of call that the module makes.
fn draw(gpu: &Gpu, scene: &Scene, baked: &[Baked]) -> canopy::Result<Picture> {
    let camera = &scene.cameras[0];
    let plan = Plan::new(scene, camera, [32, 24], true, Some(gpu.info()))?;
    let mut renderer = Renderer::new(gpu, Arc::new(scene.clone()), plan, baked)?;
    renderer.render(camera, 1.0)?;
    renderer.picture()
}

/// Lets each place fail that `chosen` takes (the first is 0), one after the other on one device, and then none.
fn walk(failure: Failure, chosen: impl Fn(u32) -> bool) {
    let gpu = device::open();
    let mut scene = device::small_scene(SCENE);
    scene.settings.coverage_size = 32;
    scene.settings.cascade_size = 64;
    let baked = device::bake(&scene);
    let whole = draw(&gpu, &scene, &baked).unwrap();
    // Counted the second time: the first needs memory that the device then keeps.
    gpu.fail(failure, 0);
    assert!(draw(&gpu, &scene, &baked).unwrap() == whole);
    let places = gpu.passed()[usize::from(failure == Failure::DeviceLost)];
    let mut said = BTreeSet::new();
    let mut failed = 0;
    for n in (0..places).filter(|n| chosen(*n)) {
        gpu.fail(failure, n + 1);
        let error = match draw(&gpu, &scene, &baked) {
            Err(error) => error,
            Ok(_) => panic!("{failure:?} at place {n} of {places} went unnoticed"),
        };
        assert_eq!(error.exit_code(), 6, "place {n}: {error}");
        let text = error.to_string();
        let clear = match failure {
            Failure::DeviceMemory => "out of device memory",
            Failure::HostMemory => "out of host memory",
            Failure::DeviceLost => "the device was lost",
        };
        assert!(text.contains(clear), "place {n}: {text}");
        said.insert(text.split(':').next().unwrap_or_default().to_string());
        failed += 1;
        // The next submission shows that the device still works, and frees what was waiting.
        gpu.fail(failure, 0);
        gpu.record().unwrap().submit().unwrap();
        assert_eq!(gpu.memory_report(), [], "place {n}: {text}");
        assert_eq!(gpu.messages(), [""; 0], "place {n}: {text}");
    }
    println!("{failure:?}: {failed} of {places} places, {} different messages", said.len());
    assert!(draw(&gpu, &scene, &baked).unwrap() == whole, "a failure has left its mark");
    gpu.close().unwrap();
}

/// Of hundreds of places, most of which are the same call again: every 61st, from another beginning each.
fn some(from: u32) -> impl Fn(u32) -> bool {
    move |n| n % 61 == from
}

#[test]
fn device_memory_runs_out() {
    walk(Failure::DeviceMemory, some(3));
}

#[test]
fn host_memory_runs_out() {
    walk(Failure::HostMemory, some(11));
}

#[test]
fn the_device_is_lost() {
    walk(Failure::DeviceLost, |n| n % 17 == 0);
}

#[test]
#[ignore = "takes minutes"]
fn every_place() {
    for failure in [Failure::DeviceMemory, Failure::HostMemory, Failure::DeviceLost] {
        walk(failure, |_| true);
    }
}

/// What a place leaves behind unfinished, the layers say when the device closes.
#[test]
fn objects_that_are_forgotten_are_reported() {
    let gpu = device::open();
    gpu.forget_for_test();
    let error = gpu.close().expect_err("a forgotten object must fail the run");
    assert_eq!(error.exit_code(), 4, "{error}");
    assert!(error.to_string().contains("vkDestroyDevice"), "{error}");
}
