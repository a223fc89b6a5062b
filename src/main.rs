//! The `canopy` program.
use std::sync::Arc;
fn main() -> canopy::Result<()> {
    let a: Vec<String> = std::env::args().collect();
    let scene =
        if a[1] == "default" { canopy::scene::default_scene()? } else { canopy::scene::load(a[1].as_ref())? };
    let gpu = canopy::gpu::Gpu::new(&canopy::gpu::GpuOptions { device: None, validate: true })?;
    let cam = scene.cameras.iter().find(|c| c.name == a[2]).unwrap_or(&scene.cameras[0]).clone();
    let plan = canopy::plan::Plan::new(&scene, &cam, [1024, 768], false, Some(gpu.info()))?;
    for i in &plan.items {
        println!("{:8} {:30} {:10} {}", i.kind, i.name, i.bytes >> 10, i.reason);
    }
    let t = std::time::Instant::now();
    let baked: Vec<_> = scene
        .species
        .iter()
        .map(|s| {
            canopy::bake::load_or_bake(
                &s.mesh,
                &s.optics,
                &(&scene.settings).into(),
                canopy::bake::cache::default_dir().as_deref(),
                false,
            )
            .map(|b| Arc::new(b.0))
        })
        .collect::<Result<_, _>>()?;
    for b in &baked {
        println!(
            "{:?} {} {} tau {} r {:?} t {:?} A {} h {}",
            b.center, b.radius, b.half_height, b.extinction, b.reflectance, b.transmittance, b.area, b.height
        );
    }
    println!("bake {:?}", t.elapsed());
    let mut r = canopy::frame::Renderer::new(&gpu, Arc::new(scene), plan, &baked)?;
    for _ in 0..2 {
        let t = std::time::Instant::now();
        let report = r.render(&cam, 2.0);
        println!("frame {:?}", t.elapsed());
        match report {
            Ok(rep) => {
                for p in &rep.passes {
                    println!("{:20} {:.2}", p.name, p.gpu_ms);
                }
                println!("{:?} quads {} seeds {}", rep.trees, rep.terrain_quads, rep.seed_quads);
            }
            Err(e) => println!("{e}"),
        }
    }
    r.picture()?.write_png(a[3].as_ref())?;
    drop(r);
    gpu.close()
}
