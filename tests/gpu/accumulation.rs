//! Pictures that are means of frames, each shifted by a part of a pixel.

use std::sync::Arc;

use canopy::camera::Eye;
use canopy::frame::Renderer;
use canopy::frame::accumulation::shift;
use canopy::gpu::Gpu;
use canopy::image::Linear;
use canopy::plan::{Plan, Rasterizer};
use canopy::scene::{Camera, Scene};

use crate::device;

const SIZE: [u32; 2] = [48, 36];

/// The layers of a picture of so many samples and frames; `finer` times as many pixels along a side as [`SIZE`], of the same levels
/// of detail.
fn draw(gpu: &Gpu, scene: &Scene, camera: &Camera, by: Rasterizer, finer: u32, n: [f64; 2]) -> Linear {
    let mut scene = scene.clone();
    scene.settings.set("samples", n[0]).unwrap();
    scene.settings.set("accumulation", n[1]).unwrap();
    let eye = Eye::new(camera, &scene.terrain, SIZE.map(|s| finer * s));
    let eye = Eye { pixels_at_1m: eye.pixels_at_1m / f64::from(finer), ..eye };
    let plan = Plan::for_eye(&scene, &eye, true, by, Some(gpu.info())).unwrap();
    let baked = device::bake(&scene);
    let mut renderer = Renderer::new(gpu, Arc::new(scene), plan, &baked).unwrap();
    let report = renderer.render_eye(&eye, 1.0).unwrap().0;
    // What is drawn several times is one row of a report.
    let mut names: Vec<_> = report.timing.passes.iter().map(|p| &p.name).collect();
    names.sort();
    assert!(names.windows(2).all(|w| w[0] != w[1]), "{names:?}");
    renderer.picture().unwrap().linear.unwrap()
}

/// A level square of black ground under a bright sky, looked down at so that two of its edges cross the picture aslant.
fn corner() -> (Scene, Camera) {
    let scene = device::small_scene(
        "[terrain]\nextent = 40.0\nalbedo = 0.0\n[sun]\nazimuth = 0.0\nelevation = 40.0\nirradiance = 0.0\n\
         [sky]\nradiance = 1.0\n[[camera]]\nname = \"c\"\nposition = [0.0, 0.0, 1.0]\ntarget = [1.0, 1.0, 0.0]\nvertical_fov = 50.0\n",
    );
    (scene, device::camera([4.0, 9.0, 30.0], [-2.0, -3.0, 0.0]))
}

#[test]
fn edges_are_means_over_pixels() {
    let gpu = device::open();
    let (scene, camera) = corner();
    let eye = Eye::new(&camera, &scene.terrain, SIZE);
    // The share of a pixel that is sky, by 64 x 64 rays: where the ray meets the ground's plane is in the square or is not.
    let dot = |a: [f64; 3], b: [f64; 3]| (0..3).map(|k| a[k] * b[k]).sum::<f64>();
    let sky = |x: f64, y: f64| {
        let [u, v] = [
            eye.tangents[0] * (2.0 * x / f64::from(SIZE[0]) - 1.0),
            eye.tangents[1] * (1.0 - 2.0 * y / f64::from(SIZE[1])),
        ];
        let ray: [f64; 3] = std::array::from_fn(|k| eye.forward[k] + u * eye.right[k] + v * eye.up[k]);
        assert!(dot(ray, [0.0, 0.0, 1.0]) < 0.0);
        let t = -eye.position[2] / ray[2];
        let hit = [0, 1].map(|k| eye.position[k] + t * ray[k]);
        !hit.iter().all(|h| (0.0..=40.0).contains(h))
    };
    let share = |k: usize| {
        let [x, y] = [k % SIZE[0] as usize, k / SIZE[0] as usize].map(|v| v as f64);
        let inside = |i: u32| {
            let at = |i: u32| (f64::from(i) + 0.5) / 64.0;
            sky(x + at(i % 64), y + at(i / 64))
        };
        (0..64 * 64).filter(|i| inside(*i)).count() as f64 / 4096.0
    };
    let shares: Vec<f64> = (0..(SIZE[0] * SIZE[1]) as usize).map(share).collect();
    assert!(shares.iter().filter(|s| (0.02..0.98).contains(*s)).count() > 40);
    // Mean errors on edges. Of lines that part a square in any way, so many points of the lattice are off by 0.037 of it on average (16)
    // and 0.010 (64), one point by 0.23; here are two lines. Several samples reach an eighth of a pixel beyond the pixel and so
    // soften edges by a few per cent.
    for (samples, frames, most) in [(1, 1, 0.3), (1, 16, 0.06), (1, 64, 0.015), (4, 16, 0.03)] {
        let got = draw(&gpu, &scene, &camera, Rasterizer::Tiles, 1, [samples, frames].map(f64::from));
        let edges: Vec<usize> = (0..shares.len()).filter(|k| (0.02..0.98).contains(&shares[*k])).collect();
        let error = |want: &dyn Fn(usize) -> f64, k: usize| (f64::from(got.sky[k][1]) - want(k)).abs();
        let mean = edges.iter().map(|k| error(&|k| shares[k], *k)).sum::<f64>() / edges.len() as f64;
        println!("{samples} samples, {frames} frames: off by {mean:.4}");
        assert!(mean <= most, "{samples} samples, {frames} frames: {mean}");
        if samples == 1 {
            // What is seen is that from which the picture is shifted. Where an edge goes through a point, it may be on either side.
            let seen = |k: usize| {
                let [x, y] = [k % SIZE[0] as usize, k / SIZE[0] as usize].map(|v| v as f64 + 0.5);
                let at = |f: u32| shift(f, frames, samples);
                (0..frames).filter(|f| sky(x - at(*f)[0], y - at(*f)[1])).count() as f64 / f64::from(frames)
            };
            let most = edges.iter().map(|k| error(&seen, *k)).fold(0.0, f64::max);
            assert!(most < 1.01 / f64::from(frames), "{frames} frames: {most}");
        }
    }
    gpu.close().unwrap();
}

/// A few trees and the ground, in sun.
fn wood() -> (Scene, Camera) {
    let scene = device::small_scene(
        "[terrain]\nextent = 200.0\nalbedo = 0.1\n[[species]]\nname = \"oak\"\nmodel = \"builtin:oak\"\ndensity = 0.004\n\
         [sun]\nazimuth = 160.0\nelevation = 45.0\nirradiance = 1.0\n[sky]\nradiance = 0.1\n\
         [[camera]]\nname = \"c\"\nposition = [0.0, 0.0, 1.0]\ntarget = [1.0, 1.0, 0.0]\nvertical_fov = 50.0\n",
    );
    (scene, device::camera([100.0, 60.0, 45.0], [100.0, 95.0, 0.0]))
}

#[test]
fn both_rasterisers_tend_to_the_mean_of_finer_pixels() {
    let gpu = device::open();
    let (scene, camera) = wood();
    // Sixteen pixels for each, of the same trees at the same levels of detail; and several frames, because in one a tree of an opacity
    // of 0.93 covers three samples of four everywhere, or all.
    let fine = draw(&gpu, &scene, &camera, Rasterizer::Tiles, 4, [4.0, 16.0]);
    let fewer = |part: &dyn Fn(usize) -> f64| -> Vec<f64> {
        let [w, h] = SIZE.map(|n| n as usize);
        let at = |k: usize, o: usize| 4 * w * (4 * (k / w) + o / 4) + 4 * (k % w) + o % 4;
        (0..w * h).map(|k| (0..16).map(|o| part(at(k, o))).sum::<f64>() / 16.0).collect()
    };
    let light = |l: &Linear, k: usize| f64::from(l.sun[k][1] + l.sky[k][1]);
    let (light_there, cover_there) = (fewer(&|k| light(&fine, k)), fewer(&|k| f64::from(fine.coverage[k])));
    for by in [Rasterizer::Tiles, Rasterizer::Graphics] {
        let rms = |frames: f64| {
            let got = draw(&gpu, &scene, &camera, by, 1, [4.0, frames]);
            let off = |want: &[f64], of: &dyn Fn(usize) -> f64| {
                let sum: f64 = want.iter().enumerate().map(|(k, w)| (of(k) - w).powi(2)).sum();
                (sum / want.len() as f64).sqrt()
            };
            let mean: f64 = light_there.iter().sum::<f64>() / light_there.len() as f64;
            [
                off(&light_there, &|k| light(&got, k)) / mean,
                off(&cover_there, &|k| f64::from(got.coverage[k])),
                (0..light_there.len()).map(|k| light(&got, k)).sum::<f64>() / light_there.len() as f64 / mean
                    - 1.0,
            ]
        };
        let (one, many) = (rms(1.0), rms(16.0));
        println!("{}: {one:.4?} with one frame, {many:.4?} with 16", by.name());
        // Half of what one frame is off by, or less; and no brighter nor darker.
        assert!(many[0] < 0.6 * one[0] && many[1] < 0.6 * one[1], "{}", by.name());
        assert!(many[2].abs() < 0.03, "{}: {}", by.name(), many[2]);
    }
    gpu.close().unwrap();
}

#[test]
fn depth_and_species_are_of_the_frame_that_is_not_shifted() {
    let gpu = device::open();
    let (scene, camera) = wood();
    for by in [Rasterizer::Tiles, Rasterizer::Graphics] {
        let [one, four, again] =
            [1.0, 4.0, 4.0].map(|frames| draw(&gpu, &scene, &camera, by, 1, [4.0, frames]));
        assert!(one.species.iter().any(|s| *s != 0));
        assert_eq!(one.species, four.species, "{}", by.name());
        assert_eq!(one.depth, four.depth, "{}", by.name());
        assert_ne!(one.sky, four.sky);
        assert!(four.sun == again.sun && four.sky == again.sky && four.fractions == again.fractions);
    }
    gpu.close().unwrap();
}
