//! Light transfer in a frame: the sun on an oak's leaves as paths through its triangles have it, from a view that is stored
//! and from between views, better with every band.

use std::path::Path;
use std::sync::Arc;

use canopy::bake::{Needs, load_or_bake_scene};
use canopy::camera::Eye;
use canopy::frame::Renderer;
use canopy::gpu::Gpu;
use canopy::plan::Plan;
use canopy::reference::{Light, Options, Until, World};
use canopy::scene::{self, Camera, Scene};

use crate::device;

/// Pixels a side: 0.3 m on the oak.
const SIDE: u32 = 64;

/// One oak on black ground.
fn oak() -> Scene {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data");
    let positions = device::folder().join("one_oak.csv");
    std::fs::write(&positions, "x,y,scale,rotation\n200,200,1,30\n").unwrap();
    let text = format!(
        "[terrain]\nextent = 400.0\nalbedo = 0.0\n[[species]]\nname = \"oak\"\nmodel = {:?}\npositions = {positions:?}\n\
         [sun]\nazimuth = 240.0\nelevation = 40.0\nirradiance = 1.0\n\
         [[camera]]\nname = \"c\"\nposition = [0.0, 0.0, 10.0]\ntarget = [9.0, 9.0, 5.0]\nvertical_fov = 50.0\n\
         [quality]\npreset = \"fast\"\nview_rings = 6\nview_resolution = 128\nocclusion_rays = 8\nconvergence = 0.8\n\
         table_angles = 6\ntable_densities = 3\ntable_rays = 64\n",
        folder.join("oak.glb"),
    );
    scene::parse(&text, Path::new("test.toml")).unwrap()
}

/// A camera 300 m from the tree's middle.
fn camera(azimuth: f64, elevation: f64) -> Camera {
    let ((s, c), (up, along)) = (azimuth.to_radians().sin_cos(), elevation.to_radians().sin_cos());
    let target = [200.0, 200.0, 7.5];
    let away = [s * along, c * along, up];
    let position = [0, 1, 2].map(|k| target[k] + 300.0 * away[k]);
    Camera { name: "c".into(), position, target, vertical_fov: 3.6 }
}

/// Sunlight of every pixel.
fn sun(gpu: &Gpu, scene: &Scene, camera: &Camera) -> Vec<f64> {
    let plan = Plan::new(scene, camera, [SIDE; 2], true, Some(gpu.info())).unwrap();
    let cache = device::folder().join("bakes");
    let baked: Vec<_> = load_or_bake_scene(scene, Needs::ALL, Some(&cache), true)
        .unwrap()
        .into_iter()
        .map(|(b, _)| b)
        .collect();
    let mut renderer = Renderer::new(gpu, Arc::new(scene.clone()), plan, &baked).unwrap();
    renderer.render(camera, 1.0).unwrap();
    renderer.picture().unwrap().linear.unwrap().sun.iter().map(|c| f64::from(c[1])).collect()
}

fn truth(scene: &Scene, camera: &Camera) -> Vec<f64> {
    let eye = Eye::new(camera, &scene.terrain, [SIDE; 2]);
    let options =
        Options { light: Light::Sun, bounces: Some(1), until: Until::Samples(64), ..Options::default() };
    let estimate = World::new(scene, &[eye]).unwrap().render(&eye, &options, None, &mut |_| ()).unwrap();
    estimate.linear().sun.iter().map(|c| f64::from(c[1])).collect()
}

fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let n = a.len() as f64;
    let mean = |x: &[f64]| x.iter().sum::<f64>() / n;
    let (ma, mb) = (mean(a), mean(b));
    let of = |x: &[f64], y: &[f64], mx: f64, my: f64| {
        x.iter().zip(y).map(|(x, y)| (x - mx) * (y - my)).sum::<f64>()
    };
    of(a, b, ma, mb) / (of(a, a, ma, ma) * of(b, b, mb, mb)).sqrt()
}

/// How much better: squares of correlations are shares of what varies from pixel to pixel.
#[test]
fn leaves_are_lit_as_their_triangles_are() {
    let gpu = device::open();
    let (mut scene, mut gained) = (oak(), 0.0);
    // With the sun behind the viewer, beside, and before.
    for (azimuth, elevation) in [(225.0, 45.0), (140.0, 20.0), (80.0, 35.0)] {
        let camera = camera(azimuth, elevation);
        let want = truth(&scene, &camera);
        let mut found = |looks: f64, bands: f64| {
            scene.settings.set("light_iterations", looks).unwrap();
            scene.settings.set("transfer_bands", bands).unwrap();
            let got = sun(&gpu, &scene, &camera);
            // Pixels that the tree fills: the silhouette is not what this is about.
            let seen = want.iter().zip(&got).filter(|(w, g)| **w > 0.0 && **g > 0.0);
            let (w, g): (Vec<f64>, Vec<f64>) = seen.map(|(w, g)| (*w, *g)).unzip();
            (correlation(&w, &g), g.iter().sum::<f64>() / w.iter().sum::<f64>() - 1.0)
        };
        let (found, twice) =
            ([0.0, 1.0, 2.0].map(|bands| found(1.0, bands)), [0.0, 2.0].map(|bands| found(2.0, bands)));
        println!(
            "azimuth {azimuth}, elevation {elevation}: correlation and bias with 0, 1, 2 bands {found:.3?}, with two looks at light and 0, 2 \
             {twice:.3?}"
        );
        let [none, one, two] = found.map(|f| f.0 * f.0);
        assert!(one > 1.15 * none && two > 1.05 * one, "{found:?}");
        gained += twice[0].0.powi(2) - found[0].0.powi(2) + twice[1].0.powi(2) - found[2].0.powi(2);
        // The crown's mean is the law's; what the sun reaches of single views is allowed a few per cent.
        assert!(found.iter().all(|f| (f.1 - found[0].1).abs() < 0.08), "{found:?}");
    }
    // A second look for where light enters a crown tells leaves apart where the sun is high, and loses less where it is low.
    assert!(gained > 0.0, "{gained}");
    gpu.close().unwrap();
}

/// A bake for a plan that needs less does not do for one that needs more, and says so.
#[test]
fn a_bake_without_the_transfer_that_the_plan_lists_is_refused() {
    let gpu = device::open();
    let mut scene = device::small_scene(
        "[terrain]\nextent = 300.0\nalbedo = 0.2\n[[species]]\nname = \"a\"\nmodel = \"builtin:birch\"\ndensity = 0.03\n\
         [sun]\nazimuth = 210.0\nelevation = 25.0\nirradiance = 1.0\n\
         [[camera]]\nname = \"c\"\nposition = [40.0, 60.0, 15.0]\ntarget = [150.0, 180.0, 0.0]\nvertical_fov = 50.0\n",
    );
    scene.settings.set("transfer_bands", 0.0).unwrap();
    let baked = device::bake(&scene);
    assert!(baked[0].species.transfer.bands.is_empty());
    scene.settings.set("transfer_bands", 1.0).unwrap();
    let plan = Plan::new(&scene, &scene.cameras[0], [SIDE; 2], true, Some(gpu.info())).unwrap();
    assert!(plan.transfer_bands > 0);
    let scene = Arc::new(scene);
    let error = Renderer::new(&gpu, scene.clone(), plan.clone(), &baked).err().unwrap();
    assert!(error.exit_code() == 2 && error.to_string().contains("without the light transfer"), "{error}");
    let error = Renderer::new(&gpu, scene, plan, &[]).err().unwrap();
    assert!(error.exit_code() == 2 && error.to_string().contains("0 species were baked"), "{error}");
}
