//! Compute tiles see and light what the graphics pipeline does; long lists, and no lists, change no bit.

use std::sync::Arc;

use crate::device;
use canopy::camera::{Eye, auto_exposure};
use canopy::frame::{FrameReport, Renderer};
use canopy::gpu::Gpu;
use canopy::image::{Linear, Picture};
use canopy::ladder::Ladder;
use canopy::plan::{Drawing, Plan, Rasterizer};
use canopy::scene::Scene;

/// Two species on a plain, with light.
fn woods(extent: f64, density: f64) -> Scene {
    device::small_scene(&format!(
        "seed = 11\n[terrain]\nextent = {extent:?}\nalbedo = [0.13, 0.11, 0.08]\n\
         [[species]]\nname = \"birch\"\nmodel = \"builtin:birch\"\ndensity = {density}\nscale = [0.7, 1.2]\n\
         [[species]]\nname = \"pine\"\nmodel = \"builtin:pine\"\ndensity = {density}\n\
         [sun]\nazimuth = 210.0\nelevation = 35.0\nirradiance = 1.0\n[sky]\nradiance = 0.08\n\
         [[camera]]\nname = \"c\"\nposition = [60.0, 60.0, 14.0]\ntarget = [160.0, 150.0, 4.0]\nvertical_fov = 50.0\n",
    ))
}

fn plan(gpu: &Gpu, scene: &Scene, size: [u32; 2], layers: bool, drawing: impl Into<Drawing>) -> Plan {
    let eye = Eye::new(&scene.cameras[0], &scene.terrain, size);
    Plan::for_eye(scene, &eye, layers, drawing, Some(gpu.info())).unwrap()
}

fn draw(gpu: &Gpu, scene: &Scene, plan: Plan) -> canopy::Result<(FrameReport, Picture)> {
    let mut renderer = Renderer::new(gpu, Arc::new(scene.clone()), plan, &device::bake(scene))?;
    let report = renderer.render(&scene.cameras[0], auto_exposure(scene))?;
    Ok((report, renderer.picture()?))
}

fn mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let n = values.len() as f64;
    values.sum::<f64>() / n
}

/// Means of the layers: sun, sky, coverage, each fraction.
fn means(l: &Linear) -> Vec<f64> {
    let colour = |of: &[[f32; 3]]| mean(of.iter().map(|c| c.iter().map(|v| f64::from(*v)).sum::<f64>()));
    let mut all = vec![colour(&l.sun), colour(&l.sky), mean(l.coverage.iter().map(|v| f64::from(*v)))];
    all.extend((0..4).map(|k| mean(l.fractions.iter().map(|f| f64::from(f[k])))));
    all
}

/// Largest difference of the mean of a part of the picture: which tree of two at the same depth is seen, a tree's coefficients as half
/// floats, and a sampler's weights of 8 bits have no sign. Measured: 2e-4.
const PART: f64 = 0.002;
/// Largest relative difference of the mean light, of which the ground's is found once a pixel instead of once a fragment.
const LIGHT: f64 = 0.01;
/// Largest part of the values on the display that may differ by more than a quarter, as when one of four samples turns to sky.
const OTHER: f64 = 0.005;

/// Whether trees cover the same, as bright.
fn agree(graphics: &Picture, tiles: &Picture, what: &str) {
    let pairs = graphics.display.iter().zip(&tiles.display);
    let bias = mean(pairs.clone().map(|(a, b)| f64::from(*b) - f64::from(*a))) / 255.0;
    let far = pairs.filter(|(a, b)| a.abs_diff(**b) > 64).count() as f64 / graphics.display.len() as f64;
    println!("{what}: bias {bias:+.5}, {far:.5} of the values differ by more than a quarter");
    let [a, b] = [graphics, tiles].map(|p| p.linear.as_ref().map(means).unwrap_or_default());
    println!("{what}: {a:.5?} {b:.5?}");
    // Coverage, and lit and shadowed trees.
    let trees = a.iter().zip(&b).enumerate().filter(|(k, _)| [2, 5, 6].contains(k));
    let worst = trees.map(|(_, (a, b))| (a - b).abs()).fold(bias.abs(), f64::max);
    assert!(worst <= PART && far <= OTHER, "{what}: {worst} {far}");
}

/// Whether light is the same, in a picture that is fine enough for light on the ground not to depend on where in a pixel it is found.
fn light_agrees(graphics: &Picture, tiles: &Picture, what: &str) {
    let (Some(a), Some(b)) = (&graphics.linear, &tiles.linear) else { return };
    for (a, b) in means(a).iter().zip(means(b)).take(2) {
        assert!((a - b).abs() <= LIGHT * a, "{what}: {a} {b}");
    }
}

#[test]
fn tiles_show_what_the_graphics_pipeline_shows() {
    let gpu = device::open();
    // Sizes that no tile divides; one, four and eight samples; layers and none; near trees, whose texels are magnified.
    for (size, samples, layers, resolution) in [
        ([93, 61], 4.0, true, 32.0),
        ([64, 48], 1.0, true, 32.0),
        ([75, 53], 8.0, false, 32.0),
        ([64, 48], 4.0, true, 16.0),
    ] {
        let mut scene = woods(300.0, 0.02);
        scene.settings.set("samples", samples).unwrap();
        scene.settings.set("view_resolution", resolution).unwrap();
        let [a, b] = [Rasterizer::Graphics, Rasterizer::Tiles].map(|r| {
            let (report, picture) = draw(&gpu, &scene, plan(&gpu, &scene, size, layers, r)).unwrap();
            assert!(report.trees.camera > 100, "{}", report.trees.camera);
            picture
        });
        let what = format!("{size:?}, {samples} samples, {resolution} texels");
        agree(&a, &b, &what);
        light_agrees(&a, &b, &what);
    }
    gpu.close().unwrap();
}

/// Drivers end loops after 65,535 turns: what a tile does for each tree that it has nothing to do with must be few of them.
#[test]
fn without_lists_tiles_go_through_tens_of_thousands_of_trees() {
    let gpu = device::open();
    let scene = woods(2500.0, 0.01);
    let drawing = Drawing { ladder: Some(Ladder::ZFIELD), rasterizer: Some(Rasterizer::Tiles) };
    let listed = plan(&gpu, &scene, [32, 24], true, drawing);
    let (report, with_lists) = draw(&gpu, &scene, listed.clone()).unwrap();
    assert!(report.trees.camera > 30_000, "{} trees are too few to tell", report.trees.camera);
    let mut short = Plan { tile_steps: 0, ..listed };
    short.list(&scene);
    let (_, whole) = draw(&gpu, &scene, short).unwrap();
    assert!(whole == with_lists, "without lists other bits are drawn");
    gpu.close().unwrap();
}

#[test]
fn long_lists_are_gone_through_to_the_end_and_without_lists_all_trees_are() {
    let gpu = device::open();
    let mut scene = woods(900.0, 0.01);
    // Over the crowns, to the horizon: most tiles see sky, and are done with no tree.
    scene.cameras[0].position = [-40.0, 450.0, 16.0];
    scene.cameras[0].target = [450.0, 450.0, 12.0];
    let size = [24, 16];
    let far = |rasterizer| Drawing { ladder: Some(Ladder::ZFIELD), rasterizer: Some(rasterizer) };
    let tiled = plan(&gpu, &scene, size, true, far(Rasterizer::Tiles));
    let (report, tiles) = draw(&gpu, &scene, tiled.clone()).unwrap();
    // Six lists, and every tree in view is in one at least.
    assert!(report.trees.camera > 6 * 1024, "no list has two parts: {} trees", report.trees.camera);
    let (_, graphics) =
        draw(&gpu, &scene, plan(&gpu, &scene, size, true, far(Rasterizer::Graphics))).unwrap();
    agree(&graphics, &tiles, "lists of several parts");
    for tile_steps in [0, report.trees.camera] {
        let mut short = Plan { tile_steps, ..tiled.clone() };
        short.list(&scene);
        let (_, whole) = draw(&gpu, &scene, short).unwrap();
        assert!(whole == tiles, "with room for {tile_steps} steps other bits are drawn");
    }
    // Nor does it matter how many write the lists: their counts take less than a block of sums, or several.
    for list_lanes in [8, 512] {
        let mut shared = Plan { list_lanes, ..tiled.clone() };
        shared.list(&scene);
        let (_, other) = draw(&gpu, &scene, shared).unwrap();
        assert!(other == tiles, "with lists written by {list_lanes} other bits are drawn");
    }
    gpu.close().unwrap();
}
