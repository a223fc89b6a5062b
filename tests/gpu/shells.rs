//! Trees that are slices of a forest over the ground (Behrendt et al. 2005, section 3): where they are, how they merge, and how they take over.

use std::sync::Arc;

use crate::device;

use canopy::bake::shells::{Forest, March, Stack};
use canopy::camera::Eye;
use canopy::frame::Renderer;
use canopy::gpu::Gpu;
use canopy::image::Linear;
use canopy::ladder::Ladder;
use canopy::physics::light::luminance;
use canopy::physics::raster::Raster;
use canopy::plan::{Drawing, Plan, Rasterizer};
use canopy::scene::{Camera, Distribution, Scene, TreePosition};
use glam::{DVec2, DVec3};

const SIZE: [u32; 2] = [96, 72];
/// Field of view of the test device's cameras, half of it, rad.
const HALF_VIEW: f64 = 25.0 * std::f64::consts::PI / 180.0;

/// Birches on black level ground.
fn birches(density: f64) -> Scene {
    let mut scene = device::small_scene(&format!(
        "seed = 5\n[terrain]\nextent = 4000.0\nalbedo = 0.0\n\
         [[species]]\nname = \"birch\"\nmodel = \"builtin:birch\"\ndensity = {density}\nscale = [0.8, 1.2]\n\
         [sun]\nazimuth = 210.0\nelevation = 35.0\nirradiance = [1.0, 0.95, 0.85]\n[sky]\nradiance = [0.06, 0.09, 0.14]\n\
         [[camera]]\nname = \"c\"\nposition = [2000.0, 2000.0, 300.0]\ntarget = [2000.0, 2001.0, 0.0]\nvertical_fov = 50.0\n"
    ));
    for (knob, value) in [("shell_slices", 8.0), ("shell_texels", 64.0)] {
        scene.settings.set(knob, value).unwrap();
    }
    scene
}

fn drawn_by(gpu: &Gpu, scene: &Scene, by: &str) -> Renderer {
    let ladder: Ladder = by.parse().unwrap();
    let eye = Eye::new(&scene.cameras[0], &scene.terrain, SIZE);
    let plan = Plan::for_eye(scene, &eye, true, ladder, Some(gpu.info())).unwrap();
    Renderer::new(gpu, Arc::new(scene.clone()), plan, &device::bake_for(scene, ladder)).unwrap()
}

fn draw(renderer: &mut Renderer, camera: &Camera) -> Linear {
    renderer.render(camera, 1.0).unwrap();
    let l = renderer.picture().unwrap().linear.unwrap();
    assert!(l.sun.iter().chain(&l.sky).flatten().all(|v| v.is_finite() && *v >= 0.0));
    assert!(l.coverage.iter().all(|c| (0.0..=1.0).contains(c)));
    l
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0), |(s, n), v| (s + v, n + 1));
    sum / f64::from(count.max(1))
}

fn cover(l: &Linear) -> f64 {
    mean(l.coverage.iter().map(|c| f64::from(*c)))
}

/// Straight down, nearly, at a place of the plain.
fn down(at: [f64; 2], height: f64) -> Camera {
    device::camera([at[0], at[1], height], [at[0], at[1] + 1e-3 * height, 0.0])
}

/// What the stack of the same bytes hides on the CPU where each pixel of such a picture looks.
fn stack_covers(scene: &Scene, at: [f64; 2], height: f64) -> Vec<f64> {
    let baked = device::bake_for(scene, "shells".parse().unwrap());
    let shells = baked[0].shells.as_ref().unwrap();
    let stack = Stack::new(shells, scene.seed, 0, 0);
    let metre = 2.0 * height * HALF_VIEW.tan() / f64::from(SIZE[1]);
    let pixels = (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (x, y)));
    let hides = |(x, y): (u32, u32)| {
        let from_middle = |k: u32, size: u32| (f64::from(k) + 0.5 - 0.5 * f64::from(size)) * metre;
        let ground = DVec2::new(at[0] + from_middle(x, SIZE[0]), at[1] - from_middle(y, SIZE[1]));
        let toward = (DVec3::new(at[0], at[1], height) - ground.extend(0.0)).normalize();
        1.0 - stack.passes(ground, toward, &[1.0])[0][March::Long as usize]
    };
    pixels.map(hides).collect()
}

fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let (ma, mb) = (mean(a.iter().copied()), mean(b.iter().copied()));
    let product = |f: &dyn Fn(usize) -> f64| (0..a.len()).map(f).sum::<f64>();
    let both = product(&|k| (a[k] - ma) * (b[k] - mb));
    both / (product(&|k| (a[k] - ma).powi(2)) * product(&|k| (b[k] - mb).powi(2))).sqrt()
}

#[test]
fn slices_hide_what_the_stack_hides_where_it_does() {
    let gpu = device::open();
    let mut scene = birches(0.004);
    scene.settings.set("accumulation", 16.0).unwrap();
    scene.settings.set("shell_slice_pixels", 0.25).unwrap();
    // A pixel spans a texel of 4 m, and the picture two by one and a half tiles: their places and kinds count.
    let (at, height) = ([2010.0, 1990.0], 309.0);
    let mut renderer = drawn_by(&gpu, &scene, "shells");
    let seen: Vec<f64> =
        draw(&mut renderer, &down(at, height)).coverage.iter().map(|c| f64::from(*c)).collect();
    let hidden = stack_covers(&scene, at, height);
    let apart = mean(seen.iter().copied()) - mean(hidden.iter().copied());
    let agreement = correlation(&seen, &hidden);
    // Elsewhere in the plane there is other forest.
    let elsewhere = correlation(&seen, &stack_covers(&scene, [at[0] + 30.0, at[1]], height));
    println!("mean {apart:.4} apart, correlation {agreement:.3}, elsewhere {elsewhere:.3}");
    println!("{:.4} {:.4}", mean(seen.iter().copied()), mean(hidden.iter().copied()));
    assert!(agreement > 0.9 && elsewhere < 0.3, "{agreement} {elsewhere}");
    // 64 samples a pixel: noise of 0.05 a pixel, 0.0006 of the mean. Places are off by no more than filters blur.
    assert!(apart.abs() < 0.01, "{apart}");
    drop(renderer);
    gpu.close().unwrap();
}

#[test]
fn no_edge_of_a_tile_is_seen() {
    let gpu = device::open();
    let mut scene = birches(0.02);
    scene.settings.set("accumulation", 16.0).unwrap();
    // Down at edges between two tiles, which go up the middle of the picture, a pixel a metre: texels of light are seven wide.
    let side = Forest::new(&scene).unwrap().patch.side;
    let height = f64::from(SIZE[1]) / (2.0 * HALF_VIEW.tan());
    let mut renderer = drawn_by(&gpu, &scene, "shells");
    // Squared steps of radiance and cover from column to column, over all rows and views.
    let mut steps = vec![[0.0; 2]; SIZE[0] as usize - 1];
    for view in 0..20 {
        let at = [f64::from(10 + view) * side, 2000.0 + 0.37 * f64::from(view) * side];
        let l = draw(&mut renderer, &down(at, height));
        for (k, x) in
            (0..l.coverage.len()).map(|k| (k, k % SIZE[0] as usize)).filter(|(_, x)| x + 1 < SIZE[0] as usize)
        {
            let sun = |k: usize| luminance(l.sun[k].map(f64::from));
            steps[x][0] += (sun(k + 1) - sun(k)).powi(2);
            steps[x][1] += f64::from(l.coverage[k + 1] - l.coverage[k]).powi(2);
        }
    }
    let middle = steps.len() / 2;
    for (k, what) in ["radiance", "cover"].into_iter().enumerate() {
        let (at_edge, elsewhere): (Vec<_>, Vec<_>) = (0..steps.len()).partition(|x| x.abs_diff(middle) < 2);
        let of = |x: &[usize]| mean(x.iter().map(|x| steps[*x][k])).sqrt();
        let most = elsewhere.iter().map(|x| steps[*x][k]).fold(0.0, f64::max).sqrt();
        let (edge, usual) = (of(&at_edge), of(&elsewhere));
        println!(
            "{what}: {:.3} of the usual step at edges, {:.3} at most elsewhere",
            edge / usual,
            most / usual
        );
        // Crowns from farther inside end there (docs/shells.md: 1.2 times). Filters that end at edges as well: 1.63 times.
        assert!(edge < 1.3 * usual, "{what}");
    }
    drop(renderer);
    gpu.close().unwrap();
}

#[test]
fn neighbours_move_together_before_they_merge() {
    let gpu = device::open();
    let scene = birches(0.006);
    let mut renderer = drawn_by(&gpu, &scene, "shells");
    // Away from the forest, through all numbers of slices from eight to two.
    let frames: Vec<Linear> = (0..60)
        .map(|k| {
            let away = 150.0 * 1.03f64.powi(k);
            draw(&mut renderer, &device::camera([2000.0, 2000.0 - away, 0.7 * away], [2000.0, 2000.0, 0.0]))
        })
        .collect();
    let light = |l: &Linear, k: usize| luminance(l.sun[k]) + luminance(l.sky[k]);
    let step = |pair: &[Linear]| {
        mean((0..pair[0].sun.len()).map(|k| (light(&pair[1], k) - light(&pair[0], k)).abs()))
    };
    let steps: Vec<f64> = frames.windows(2).map(step).collect();
    let worst = (4..steps.len() - 4).map(|k| {
        let mut around = steps[k - 4..=k + 4].to_vec();
        around.sort_by(f64::total_cmp);
        steps[k] / around[4]
    });
    let worst = worst.fold(0.0, f64::max);
    println!("largest step {worst:.3} of its local median");
    assert!(worst < 2.0, "{worst}");
    drop(renderer);
    gpu.close().unwrap();
}

#[test]
fn trees_that_hand_over_to_slices_leave_no_gap() {
    let gpu = device::open();
    let mut scene = birches(0.004);
    scene.cameras[0] = down([2000.0, 2000.0], 200.0);
    let [mut slices, mut trees] = ["shells", "zfield"].map(|by| drawn_by(&gpu, &scene, by));
    let mut both = drawn_by(&gpu, &scene, "zfield:4,shells");
    let range = both.plan().range;
    for part in [0.7, 0.85, 0.9, 0.95, 1.1] {
        let camera = down([2000.0, 2000.0], part * range);
        let covers = [&mut both, &mut slices, &mut trees].map(|r| cover(&draw(r, &camera)));
        let [mixed, far, near] = covers;
        // Trees of either are apart as others are: where half of both stand they cover as much as all of one, but for chance.
        assert!(
            mixed > near.min(far) - 0.03 && mixed < near.max(far) + 0.03,
            "{part}: {mixed} between {near} and {far}"
        );
    }
    drop((slices, trees, both));
    gpu.close().unwrap();
}

#[test]
fn forest_thins_with_its_density() {
    let gpu = device::open();
    let mut covers = Vec::new();
    for map in [1.0, 0.5, 0.0] {
        let mut scene = birches(0.006);
        let everywhere = Raster { width: 2, height: 2, samples: vec![map; 4] };
        if let Distribution::Density { map, .. } = &mut scene.species[0].distribution {
            *map = Some(Arc::new(everywhere));
        }
        covers.push(cover(&draw(&mut drawn_by(&gpu, &scene, "shells"), &down([2000.0, 2000.0], 400.0))));
    }
    // Of trees that keep apart half cover a little more than half of what all do.
    assert!((0.45..0.75).contains(&(covers[1] / covers[0])) && covers[2] == 0.0, "{covers:?}");
    gpu.close().unwrap();
}

#[test]
fn what_slices_cannot_show_is_refused_with_a_remedy() {
    let gpu = device::open();
    let scene = birches(0.004);
    let eye = Eye::new(&scene.cameras[0], &scene.terrain, SIZE);
    let ladder: Ladder = "zfield:12,shells".parse().unwrap();
    let graphics = Drawing { ladder: Some(ladder), rasterizer: Some(Rasterizer::Graphics) };
    let e = Plan::for_eye(&scene, &eye, false, graphics, Some(gpu.info())).unwrap_err().to_string();
    assert!(e.contains("slices of a forest") && e.contains("without shells"), "{e}");
    let mut listed = scene;
    listed.species[0].distribution = Distribution::Positions(Arc::new(Vec::new()));
    let e = Plan::for_eye(&listed, &eye, false, ladder, Some(gpu.info()));
    // A list of none is no forest: nothing is asked of shells.
    assert!(e.is_ok());
    let tree = TreePosition { x: 2000.0, y: 2000.0, scale: None, rotation: None };
    listed.species[0].distribution = Distribution::Positions(Arc::new(vec![tree]));
    let e = Plan::for_eye(&listed, &eye, false, ladder, Some(gpu.info())).unwrap_err().to_string();
    assert!(e.contains("\"birch\"") && e.contains("end the ladder with shader-map"), "{e}");
    gpu.close().unwrap();
}
