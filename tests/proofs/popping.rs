//! Nothing pops: slow dollies through every threshold.

use canopy::camera::auto_exposure;
use canopy::scene::Camera;

use crate::{bake, device, folder, plot};

/// Size of the pictures, and side of a block that is watched on its own: a tile or a quad that pops is a few blocks, and
/// would drown in the mean of the whole picture. A bright patch that leaves the picture is a spike of its block too, so the worst
/// difference image is written for eyes: in it no edge of a tile or quad may show.
const SIZE: [u32; 2] = [240, 160];
const BLOCK: usize = 20;

/// The median of values around a time.
fn local_median(changes: &[f64], k: usize) -> f64 {
    let mut around: Vec<f64> = changes[k.saturating_sub(7)..(k + 8).min(changes.len())].to_vec();
    around.sort_by(f64::total_cmp);
    around[around.len() / 2]
}

/// Each block's change over the largest local median of it and its neighbours: a skyline moves from one into the next. What
/// changes by a step or less is the rounding of the display.
fn block_spikes(blocks: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let (across, down) = (SIZE[0] as usize / BLOCK, SIZE[1] as usize / BLOCK);
    let of = |b: usize| -> Vec<f64> { blocks.iter().map(|all| all[b]).collect() };
    let medians: Vec<Vec<f64>> = (0..across * down)
        .map(of)
        .map(|one| (0..one.len()).map(|k| local_median(&one, k)).collect())
        .collect();
    let usual = |k: usize, b: usize| {
        let (x, y) = (b % across, b / across);
        let near = |c: usize, n: usize| c.saturating_sub(1)..(c + 2).min(n);
        near(y, down)
            .flat_map(|v| near(x, across).map(move |u| v * across + u))
            .map(|n| medians[n][k])
            .fold(1.0, f64::max)
    };
    blocks.iter().enumerate().map(|(k, all)| (0..all.len()).map(|b| all[b] / usual(k, b)).collect()).collect()
}

/// Mean absolute difference of two pictures in each block, 8-bit steps.
fn block_changes(a: &[u8], b: &[u8]) -> Vec<f64> {
    let (width, across) = (SIZE[0] as usize, SIZE[0] as usize / BLOCK);
    let mut sums = vec![0.0; across * (SIZE[1] as usize / BLOCK)];
    for (k, (p, q)) in a.chunks_exact(4).zip(b.chunks_exact(4)).enumerate() {
        let change: u32 = (0..3).map(|c| u32::from(p[c].abs_diff(q[c]))).sum();
        sums[k / width / BLOCK * across + k % width / BLOCK] += f64::from(change);
    }
    sums.iter().map(|s| s / (3 * BLOCK * BLOCK) as f64).collect()
}

/// Writes the difference of two pictures, eight times amplified.
fn write_difference(path: &std::path::Path, a: &[u8], b: &[u8]) {
    let amplified = |(p, q): (&u8, &u8)| p.abs_diff(*q).saturating_mul(8);
    let mut rgba: Vec<u8> = a.iter().zip(b).map(amplified).collect();
    rgba.chunks_exact_mut(4).for_each(|p| p[3] = 255);
    image::save_buffer(path, &rgba, SIZE[0], SIZE[1], image::ColorType::Rgba8).unwrap();
}

/// Flies a path and compares each frame's picture with the last one's: the largest change over its local median in time.
fn dolly(name: &str, frames: u32, knobs: &[(&str, f64)], path: impl Fn(f64) -> Camera) -> f64 {
    let mut scene = canopy::scene::default_scene().unwrap();
    for (knob, value) in knobs {
        scene.settings.set(knob, *value).unwrap();
    }
    let gpu = device::open();
    let baked = bake(&scene);
    let exposure = auto_exposure(&scene);
    let plan = canopy::plan::Plan::new(&scene, &path(0.5), SIZE, false, Some(gpu.info())).unwrap();
    let mut renderer = canopy::frame::Renderer::new(&gpu, std::sync::Arc::new(scene), plan, &baked).unwrap();
    let mut pictures: Vec<Vec<u8>> = Vec::new();
    for k in 0..frames {
        renderer.render(&path(f64::from(k) / f64::from(frames - 1)), exposure).unwrap();
        let picture = renderer.picture().unwrap();
        if k % 60 == 0 {
            picture.write_png(&folder().join(format!("{name}_{k:03}.png"))).unwrap();
        }
        pictures.push(picture.display);
    }
    drop(renderer);
    gpu.close().unwrap();
    let blocks: Vec<Vec<f64>> = pictures.windows(2).map(|p| block_changes(&p[0], &p[1])).collect();
    let changes: Vec<f64> = blocks.iter().map(|b| b.iter().sum::<f64>() / b.len() as f64).collect();
    let spikes: Vec<f64> =
        (0..changes.len()).map(|k| changes[k] / local_median(&changes, k).max(1e-6)).collect();
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
    let picture = spikes.iter().copied().fold(0.0, f64::max);
    let mean = changes.iter().sum::<f64>() / changes.len() as f64;
    let local = block_spikes(&blocks);
    let all = local.iter().enumerate().flat_map(|(k, b)| b.iter().enumerate().map(move |(b, s)| (*s, k, b)));
    let (block, frame, at) = all.max_by(|a, b| a.0.total_cmp(&b.0)).unwrap();
    let across = SIZE[0] as usize / BLOCK;
    println!(
        "{name}: mean change {mean:.3}; over the local median at most {picture:.2}, of a block {block:.2}: frame {frame}, \
         pixel {}, {}, change {:.2}",
        at % across * BLOCK,
        at / across * BLOCK,
        blocks[frame][at]
    );
    for (what, k) in [("worst", frame), ("typical", frame.max(2) - 2)] {
        let file = folder().join(format!("{name}_difference_{what}.png"));
        write_difference(&file, &pictures[k], &pictures[k + 1]);
    }
    picture
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
