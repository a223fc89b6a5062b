//! Nothing pops: slow dollies through every threshold.

use canopy::frame::auto_exposure;
use canopy::scene::Camera;

use crate::{bake, device, folder, plot};

/// Mean absolute change from frame to frame of the display picture, and the largest over its local median.
fn dolly(name: &str, frames: u32, knobs: &[(&str, f64)], path: impl Fn(f64) -> Camera) -> f64 {
    let mut scene = canopy::scene::default_scene().unwrap();
    for (knob, value) in knobs {
        scene.settings.set(knob, *value).unwrap();
    }
    let gpu = device::open();
    let baked = bake(&scene);
    let size = [240, 160];
    let exposure = auto_exposure(&scene);
    let plan = canopy::plan::Plan::new(&scene, &path(0.5), size, false, Some(gpu.info())).unwrap();
    let mut renderer = canopy::frame::Renderer::new(&gpu, std::sync::Arc::new(scene), plan, &baked).unwrap();
    let (mut last, mut changes) = (Vec::new(), Vec::new());
    for k in 0..frames {
        renderer.render(&path(f64::from(k) / f64::from(frames - 1)), exposure).unwrap();
        let picture = renderer.picture().unwrap();
        if k % 60 == 0 {
            picture.write_png(&folder().join(format!("{name}_{k:03}.png"))).unwrap();
        }
        if !last.is_empty() {
            let sum: u64 =
                picture.display.iter().zip(&last).map(|(a, b): (&u8, &u8)| u64::from(a.abs_diff(*b))).sum();
            changes.push(sum as f64 / (0.75 * picture.display.len() as f64));
        }
        last = picture.display;
    }
    drop(renderer);
    gpu.close().unwrap();
    let spike = |k: usize| {
        let mut around: Vec<f64> = changes[k.saturating_sub(7)..(k + 8).min(changes.len())].to_vec();
        around.sort_by(f64::total_cmp);
        changes[k] / around[around.len() / 2].max(1e-6)
    };
    let spikes: Vec<f64> = (0..changes.len()).map(spike).collect();
    let points = |v: &[f64]| v.iter().enumerate().map(|(k, c)| [k as f64, *c]).collect::<Vec<_>>();
    let series = [
        ("change, 8-bit steps".to_string(), points(&changes)),
        ("over the local median".to_string(), points(&spikes)),
    ];
    let highest = changes.iter().chain(&spikes).copied().fold(0.0, f64::max);
    plot::lines(
        &folder().join(format!("{name}.svg")),
        name,
        ("frame", ""),
        (0.0, 1.1 * highest),
        false,
        &series,
    );
    let worst = spikes.iter().copied().fold(0.0, f64::max);
    let mean = changes.iter().sum::<f64>() / changes.len() as f64;
    println!("{name}: mean change {mean:.3}, largest over the local median {worst:.2}");
    worst
}

fn camera(position: [f64; 3], target: [f64; 3]) -> Camera {
    Camera { name: "dolly".into(), position, target, vertical_fov: 45.0 }
}

#[test]
#[ignore = "takes minutes"]
fn nothing_pops_on_the_way_in() {
    // A hillside from 7 km to 150 m: through fade, hand-over, convergence, cascades and tile levels.
    let worst = dolly("dolly_in", 240, &[("zfield_min_pixels", 4.0)], |t| {
        let d = 5200.0 * (300.0f64 / 5200.0).powf(t);
        camera([4200.0, 5000.0 - 0.92 * d, 60.0 + 0.28 * d], [4200.0, 5000.0, 0.0])
    });
    assert!(worst <= 2.0, "{worst}");
}

#[test]
#[ignore = "takes minutes"]
fn nothing_pops_along_a_ridge() {
    let worst = dolly("dolly_ridge", 240, &[("zfield_min_pixels", 6.0)], |t| {
        camera([2600.0 + 480.0 * t, 2700.0, 45.0], [4300.0 + 480.0 * t, 4800.0, -300.0])
    });
    assert!(worst <= 2.0, "{worst}");
}
