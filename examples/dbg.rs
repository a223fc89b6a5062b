//! dbg
use canopy::bake::load_or_bake_scene;
use canopy::frame::Renderer;
use canopy::gpu::*;
use canopy::plan::Plan;
use std::sync::Arc;
fn main() {
    let mut scene = canopy::scene::default_scene().unwrap();
    scene.settings = canopy::settings::Settings::preset("fast").unwrap();
    for (k, v) in [
        ("view_rings", 2.0),
        ("view_resolution", 32.0),
        ("zfield_min_pixels", 16.0),
        ("cascade_size", 256.0),
        ("occlusion_rays", 8.0),
    ] {
        scene.settings.set(k, v).unwrap();
    }
    let gpu = Gpu::new(&GpuOptions { device: None, validate: true }).unwrap();
    let cam = scene.cameras[0].clone();
    let baked: Vec<_> = load_or_bake_scene(&scene, Some(std::path::Path::new("target/tmp/cli-cache")), true)
        .unwrap()
        .into_iter()
        .map(|b| b.0)
        .collect();
    let size = [1024u32, 768];
    let plan = Plan::new(&scene, &cam, size, false, Some(gpu.info())).unwrap();
    let mut r = Renderer::new(&gpu, Arc::new(scene.clone()), plan, &baked).unwrap();
    let mut best = f64::INFINITY;
    for _ in 0..9 {
        let rep = r.render(&cam, 1.0).unwrap();
        for p in rep.passes.iter().filter(|p| p.name == "terrain") {
            best = best.min(p.gpu_ms);
        }
    }
    println!("terrain {best}");
}
