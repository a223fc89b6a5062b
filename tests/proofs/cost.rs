//! Cost follows the screen, not the number of trees.

use std::time::Instant;

use canopy::frame::Renderer;
use canopy::plan::Plan;
use canopy::scene::Camera;

use crate::{device, oaks};

#[test]
#[ignore = "takes minutes"]
fn ten_times_the_trees_cost_no_more() {
    let gpu = device::open();
    let density = 0.02;
    let mut found = Vec::new();
    for trees in [1e5f64, 1e6, 1e7] {
        let (mut scene, baked) = oaks(density, "zfield_min_pixels = 6.0\n");
        let side = (trees / density).sqrt();
        scene.terrain.extent = [side; 2];
        // The same view: from the middle of the southern border, over the forest to its end or the horizon.
        let camera = Camera {
            name: "over".into(),
            position: [0.5 * side, 20.0, 150.0],
            target: [0.5 * side, 1520.0, 0.0],
            vertical_fov: 45.0,
        };
        let plan = Plan::new(&scene, &camera, [640, 480], false, Some(gpu.info())).unwrap();
        let mut renderer = Renderer::new(&gpu, std::sync::Arc::new(scene), plan, &baked).unwrap();
        let mut times = Vec::new();
        let mut drawn = 0;
        for frame in 0..6 {
            let start = Instant::now();
            drawn = renderer.render(&camera, 1.0).unwrap().trees.camera;
            if frame > 0 {
                times.push(start.elapsed().as_secs_f64());
            }
        }
        times.sort_by(f64::total_cmp);
        let bytes: u64 = gpu.memory_report().iter().map(|(_, b)| b).sum();
        println!("{trees:.0} trees: frame {:.3} s, {} MiB, {drawn} drawn one by one", times[2], bytes >> 20);
        found.push((times[2], bytes as f64));
    }
    println!("10^6 to 10^7: time {:.2}, memory {:.2}", found[2].0 / found[1].0, found[2].1 / found[1].1);
    gpu.close().unwrap();
    assert!(found[2].1 <= 1.5 * found[1].1);
    assert!(found[2].0 <= 1.5 * found[1].0);
}
