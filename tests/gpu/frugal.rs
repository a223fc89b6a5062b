//! A device without what Vulkan 1.3 does not promise: pushed descriptors, and vertex shaders that choose layers. The same bits.

use canopy::gpu::{Failure, GpuOptions, Validation};

use crate::device;

const SIZE: [u32; 2] = [96, 64];

#[test]
fn a_device_without_what_vulkan_does_not_promise_draws_the_same_bits() {
    let mut scene = device::small_scene(device::WOODS);
    scene.cameras[0] = device::camera([4000.0, 4000.0, 40.0], [4000.0, 4300.0, 20.0]);
    let pictures = [false, true].map(|frugal| {
        let gpu =
            device::open_with(&GpuOptions { validation: Validation::Full, frugal, ..GpuOptions::default() });
        assert_eq!(
            [gpu.info().push_descriptors, gpu.info().vertex_layers, gpu.info().counted_draws].contains(&true),
            !frugal
        );
        let mut renderer = device::renderer(&gpu, &scene, &scene.cameras[0], SIZE, true);
        let mut draw = |frame| {
            let report = renderer.render(&device::jump(&scene, frame), 1.0).unwrap();
            let shadows = report.timing.passes.iter().find(|p| p.name == "shadows").map_or(0, |p| p.recorded);
            let layers = if frugal { renderer.plan().cascades } else { 1 };
            assert!(shadows >= layers && shadows % layers == 0, "{shadows} passes for {layers} layers");
            (renderer.picture().unwrap(), report.trees)
        };
        let drawn: Vec<_> = (0..4).map(&mut draw).collect();
        let report = renderer.render(&scene.cameras[0], 1.0).unwrap();
        assert!(report.trees.cascades.iter().all(|n| *n > 0), "{:?} prove nothing", report.trees);
        let last = renderer.picture().unwrap();
        drop(renderer);
        gpu.close().unwrap();
        (drawn, report.trees, last)
    });
    assert!(pictures[0] == pictures[1]);
}

/// Where sets come from pools, memory for them can run out.
#[test]
fn sets_that_there_is_no_memory_for_are_an_error() {
    let gpu = device::open_with(&GpuOptions {
        validation: Validation::Full,
        frugal: true,
        ..GpuOptions::default()
    });
    let scene = device::small_scene(device::WOODS);
    let mut renderer = device::renderer(&gpu, &scene, &device::jump(&scene, 0), SIZE, false);
    renderer.render(&device::jump(&scene, 0), 1.0).unwrap();
    gpu.fail(Failure::HostMemory, 0);
    renderer.render(&device::jump(&scene, 0), 1.0).unwrap();
    let places = gpu.passed()[0];
    assert!(places > 10, "a frame takes {places} places: sets are none of them");
    for place in [places / 2, places - 3] {
        gpu.fail(Failure::HostMemory, place);
        assert_eq!(renderer.render(&device::jump(&scene, 0), 1.0).unwrap_err().exit_code(), 6);
    }
    gpu.fail(Failure::HostMemory, 0);
    renderer.render(&device::jump(&scene, 1), 1.0).unwrap();
    drop(renderer);
    gpu.close().unwrap();
}
