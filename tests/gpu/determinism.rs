//! The same scene gives the same bits: from one renderer to the next, and for any number of driver threads.

use crate::device;
use canopy::image::Picture;
use canopy::physics::raster::Raster;
use canopy::scene::Scene;
use std::path::Path;
use std::process::Command;

/// Hills with a thinned forest, sun and sky.
fn scene() -> Scene {
    let mut scene = device::small_scene(
        "seed = 4\n[terrain]\nextent = 600.0\nalbedo = [0.2, 0.15, 0.1]\n\
         [[species]]\nname = \"a\"\nmodel = \"builtin:birch\"\ndensity = 0.03\nscale = [0.5, 1.5]\n\
         [[species]]\nname = \"b\"\nmodel = \"builtin:birch\"\ndensity = 0.01\n\
         [sun]\nazimuth = 210.0\nelevation = 25.0\nirradiance = 1.0\n[sky]\nradiance = 0.1\n\
         [[camera]]\nname = \"c\"\nposition = [40.0, 60.0, 25.0]\ntarget = [300.0, 280.0, 0.0]\nvertical_fov = 50.0\n",
    );
    let samples = (0..31 * 31u32)
        .map(|k| (30.0 * (f64::from(k % 31) * 0.4).sin() * (f64::from(k / 31) * 0.3).cos()) as f32)
        .collect();
    scene.terrain.heights = Some(Raster { width: 31, height: 31, samples });
    scene.terrain.cell_size = 20.0;
    scene
}

/// A picture of a fresh device and renderer.
fn picture(layers: bool) -> Picture {
    let gpu = device::open();
    let scene = scene();
    let mut renderer = device::renderer(&gpu, &scene, &scene.cameras[0], [160, 96], layers);
    let report = renderer.render(&scene.cameras[0], 1.0).unwrap();
    assert!(report.trees.camera > 500, "{:?}", report.trees);
    // A second frame, with everything in the caches, is the same.
    let first = renderer.picture().unwrap();
    renderer.render(&scene.cameras[0], 1.0).unwrap();
    let second = renderer.picture().unwrap();
    assert_eq!(first, second, "the second frame differs");
    drop(renderer);
    gpu.close().unwrap();
    first
}

#[test]
fn fresh_renderers_draw_the_same_bits() {
    for layers in [false, true] {
        assert_eq!(picture(layers), picture(layers), "layers: {layers}");
    }
}

/// What the test below runs in other processes, with the driver's number of threads in their environment.
#[test]
#[ignore = "run by any_number_of_driver_threads_draws_the_same_bits"]
fn child() {
    let path = std::env::var_os("CANOPY_TEST_DIGEST").expect("set by the parent");
    std::fs::write(path, picture(true).digest()).unwrap();
}

#[test]
fn any_number_of_driver_threads_draws_the_same_bits() {
    let run = |threads: &str| {
        let path = device::folder().join(format!("digest-{threads}-{}", std::process::id()));
        let output = Command::new(std::env::current_exe().unwrap())
            .args(["--exact", "determinism::child", "--ignored"])
            .env("LP_NUM_THREADS", threads)
            .env("CANOPY_TEST_DIGEST", &path)
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(output.status.success(), "with {threads} threads: {said}");
        let digest =
            std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}\n{said}", shown(&path)));
        std::fs::remove_file(&path).unwrap();
        digest
    };
    let one = run("1");
    for threads in ["0", "2", "5"] {
        assert_eq!(run(threads), one, "{threads} threads");
    }
}

fn shown(path: &Path) -> String {
    path.display().to_string()
}
