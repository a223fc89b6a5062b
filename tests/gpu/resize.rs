//! Images of another size from the same world.

use std::sync::Arc;

use canopy::frame::Renderer;
use canopy::gpu::Gpu;
use canopy::plan::Plan;
use canopy::scene::Scene;

use crate::device;

/// A plan of the scene's camera.
fn plan(gpu: &Gpu, scene: &Scene, size: [u32; 2]) -> Plan {
    Plan::new(scene, &scene.cameras[0], size, true, Some(gpu.info())).unwrap()
}

fn renderer(gpu: &Gpu, scene: &Scene, plan: Plan) -> Renderer {
    Renderer::new(gpu, Arc::new(scene.clone()), plan, &device::bake(scene)).unwrap()
}

#[test]
fn an_image_of_another_size_is_drawn_with_what_the_world_holds() {
    let gpu = device::open();
    let mut scene = device::small_scene(device::WOODS);
    scene.cameras[0] = device::camera([4000.0, 4000.0, 40.0], [4000.0, 4300.0, 20.0]);
    let camera = scene.cameras[0].clone();
    let sizes = [[96, 64], [80, 60], [150, 50], [96, 64]];
    let mut kept = renderer(&gpu, &scene, plan(&gpu, &scene, sizes[0]));
    let held = |name: &str| -> u64 {
        gpu.memory_report().iter().filter(|(n, _)| n == name).map(|(_, bytes)| bytes).sum()
    };
    kept.render(&camera, 1.0).unwrap();
    let world = ["seeds", "coverage tiles", "z-field views"].map(held);
    let mut made = Vec::new();
    for size in &sizes[1..] {
        kept.resize(&plan(&gpu, &scene, *size)).unwrap();
        made.push(kept.render(&camera, 1.0).unwrap().produced.seeds);
        assert_eq!(["seeds", "coverage tiles", "z-field views"].map(held), world, "{size:?}");
        let mut fresh = renderer(&gpu, &scene, plan(&gpu, &scene, *size));
        let trees = fresh.render(&camera, 1.0).unwrap().trees.camera;
        assert!(trees > 100, "{trees} trees prove nothing");
        assert!(
            kept.picture().unwrap() == fresh.picture().unwrap(),
            "{size:?}: a fresh renderer draws other bits"
        );
    }
    assert_eq!(made.last(), Some(&0), "back at the first size all seeds are there");
    drop(kept);
    gpu.close().unwrap();
}

#[test]
fn an_image_that_takes_another_world_says_so() {
    let gpu = device::open();
    let scene = device::small_scene(device::WOODS);
    let camera = scene.cameras[0].clone();
    let mut kept = renderer(&gpu, &scene, plan(&gpu, &scene, [96, 64]));
    kept.render(&camera, 1.0).unwrap();
    let before = kept.picture().unwrap();
    let error = kept.resize(&plan(&gpu, &scene, [960, 640])).unwrap_err();
    assert_eq!(error.exit_code(), 2);
    assert!(error.to_string().contains("another world: "), "{error}");
    kept.render(&camera, 1.0).unwrap();
    assert!(kept.picture().unwrap() == before);
    drop(kept);
    gpu.close().unwrap();
}
