//! Wind: against its twin in f64, and what of a picture it moves.

use std::sync::Arc;

use crate::device::{self, Worst};

use canopy::camera::Eye;
use canopy::frame::Renderer;
use canopy::gpu::{Gpu, Resource, shaders};
use canopy::image::{Linear, Picture};
use canopy::physics::hash::Stream;
use canopy::physics::wind::{MOST_SHEAR, Motion, PERIOD, Wind, pack_sway, turned, unpack_sway};
use canopy::plan::{Drawing, Plan, Rasterizer};
use canopy::reference::World;
use canopy::scene::{Camera, Distribution, Scene, TreePosition};

const SIZE: [u32; 2] = [120, 90];
const NEAR: &str = "mesh:16,zfield:4,shader-map";
const TREES: &str = "zfield:4,shader-map";
const FAR: &str = "shader-map";

/// A wind from the west, across the view of the tests' cameras, which look north.
const WEST: Wind = Wind { speed: 15.0, azimuth: 270.0, gustiness: 0.8 };

/// Oaks where they are listed, east and north, and birches at a density.
fn scene(places: &[[f64; 2]], density: f64, wind: Option<Wind>) -> Scene {
    let mut scene = device::small_scene(&format!(
        "seed = 2\n[terrain]\nextent = 600.0\nalbedo = 0.2\n\
         [[species]]\nname = \"oak\"\nmodel = \"builtin:oak\"\ndensity = 0.0\n\
         [[species]]\nname = \"birch\"\nmodel = \"builtin:birch\"\ndensity = {density:?}\n\
         [sun]\nazimuth = 210.0\nelevation = 35.0\nirradiance = [1.0, 0.95, 0.85]\n[sky]\nradiance = [0.06, 0.09, 0.14]\n\
         [[camera]]\nname = \"c\"\nposition = [300.0, 270.0, 8.0]\ntarget = [300.0, 300.0, 6.0]\nvertical_fov = 50.0\n"
    ));
    let tree = |p: &[f64; 2]| TreePosition { x: p[0], y: p[1], scale: Some(1.0), rotation: Some(30.0) };
    scene.species[0].distribution = Distribution::Positions(Arc::new(places.iter().map(tree).collect()));
    scene.wind = wind;
    scene
}

fn renderer(gpu: &Gpu, scene: &Scene, camera: &Camera, by: &str, rasterizer: Option<Rasterizer>) -> Renderer {
    let eye = Eye::new(camera, &scene.terrain, SIZE);
    let drawing = Drawing { ladder: Some(by.parse().unwrap()), rasterizer };
    let plan = Plan::for_eye(scene, &eye, true, drawing, Some(gpu.info())).unwrap();
    Renderer::new(gpu, Arc::new(scene.clone()), plan, &device::bake_meshes(scene)).unwrap()
}

fn at(renderer: &mut Renderer, camera: &Camera, time: f64) -> Picture {
    renderer.set_time(time);
    renderer.render(camera, 1.0).unwrap();
    let picture = renderer.picture().unwrap();
    let l = picture.linear.as_ref().unwrap();
    assert!(l.sun.iter().chain(&l.sky).flatten().all(|v| v.is_finite() && *v >= 0.0), "at {time} s");
    assert!(l.depth.iter().chain(&l.coverage).all(|v| v.is_finite() && *v >= 0.0), "at {time} s");
    picture
}

fn linear(picture: &Picture) -> &Linear {
    picture.linear.as_ref().unwrap()
}

/// What the shaders get of a motion.
fn words(m: &Motion) -> Vec<u32> {
    let floats = [m.toward[0], m.toward[1], m.gust, m.own, m.branch, m.leaf].map(|v| (v as f32).to_bits());
    let waves = m.waves.map(|v| (v as f32).to_bits());
    [&floats[..], &[m.clock], &waves].concat()
}

#[test]
fn the_shaders_sway_trees_as_the_twin_does() {
    let gpu = device::open();
    let mut stream = Stream::new(3);
    let mut cases: Vec<(Motion, [f32; 4], u32, u32)> = Vec::new();
    for k in 0..2048u32 {
        let speed = [1e-3, 8.0, 40.0, 100.0][k as usize % 4];
        let wind = Wind { speed, azimuth: 720.0 * stream.unit() - 360.0, gustiness: stream.unit() };
        // At the beginning, before it, and after thirty years.
        let time = [0.0, -7.3, 1e9, 1e4 * stream.unit()][k as usize / 4 % 4];
        let mut far = |most: f64| (most * (2.0 * stream.unit() - 1.0)) as f32;
        let p = [
            [0.0; 3],
            [far(60.0), far(60.0), far(30.0)],
            [far(3.0), far(3.0), far(3.0)],
            [far(200.0), far(200.0), 0.0],
        ];
        let height = [0.0, 1e-2, 12.0, 100.0][k as usize / 16 % 4];
        let [x, y, z] = p[k as usize / 64 % 4];
        cases.push((wind.at(time), [x, y, z, height], stream.bits(), stream.bits()));
    }
    let bits: Vec<u32> = cases
        .iter()
        .flat_map(|(m, p, hash, word)| [words(m), p.map(f32::to_bits).to_vec(), vec![*hash, *word]].concat())
        .collect();
    let inputs = gpu.buffer_with("cases", &bits).unwrap();
    let results: Vec<[[f32; 4]; 4]> = device::dispatch(
        &gpu,
        &shaders::PROBE_WIND_COMP,
        &[],
        &[("cases", Resource::Buffer(&inputs))],
        cases.len(),
        &[],
    );
    drop(inputs);
    let (mut shear, mut places, mut bits) = (Worst::default(), Worst::default(), Worst::default());
    for ((m, [x, y, z, height], hash, word), got) in cases.iter().zip(results) {
        let [x, y, z, height] = [*x, *y, *z, *height].map(f64::from);
        let (gusts, leaf) = (m.gusts(m.waves, [x, y]), m.flutter(*hash));
        let sway = m.sway(gusts, height, *hash);
        let said = || format!("{m:?} {:?} {hash} {word}: {got:?} {gusts} {sway:?}", [x, y, z, height]);
        for (k, want) in [gusts, sway[0] / MOST_SHEAR, sway[1] / MOST_SHEAR, leaf].into_iter().enumerate() {
            let got = f64::from(got[0][k]) / if k == 1 || k == 2 { MOST_SHEAR } else { 1.0 };
            shear.note((got - want).abs(), said);
        }
        let branch = m.branch([x, y, z], hash & 255);
        let axis = unfolded(word >> 16);
        let leaf = turned([x, y, z], axis, leaf);
        let size = 1.0 + x.abs() + y.abs() + z.abs();
        for k in 0..3 {
            places.note((f64::from(got[1][k]) - branch[k]).abs() / size, said);
            places.note((f64::from(got[2][k]) - leaf[k]).abs() / size, said);
        }
        for k in 0..2 {
            // Of what the shader packs no more than a step is lost, and what the twin packs it takes apart to the same.
            let back = unpack_sway(got[1][3].to_bits());
            bits.note((back[k] - sway[k]).abs() / (MOST_SHEAR / 8191.0), said);
            places.note((f64::from(got[3][k]) - unpack_sway(*word)[k]).abs(), said);
            places.note((f64::from(got[3][2 + k]) - axis[k]).abs(), said);
        }
        let turns: f64 = (0..3).map(|k| f64::from(word >> (10 * k) & 1023) / 1024.0).sum();
        places.note((f64::from(got[2][3]) - turns).abs(), said);
        assert_eq!(pack_sway(sway) & 15, 0);
    }
    // Sines of turns up to a few, in single precision: 2 pi times the rounding of the turns, which is 2^-23 of up to 8 turns, for places 280 m off.
    shear.within(1e-5, "shear, gusts and leaves");
    // The same of phases near 20 turns, 60 m from the trunk.
    places.within(2e-5, "places");
    bits.within(0.51, "packed shears");
    gpu.close().unwrap();
}

/// The axis of a leaf as shaders take it apart.
fn unfolded(bits: u32) -> [f64; 3] {
    let e = [0, 8].map(|k| f64::from((bits >> k) as u8 as i8) / 127.0);
    let mut v = [e[0], e[1], 1.0 - e[0].abs() - e[1].abs()];
    if v[2] < 0.0 {
        let sign = |v: f64| if v < 0.0 { -1.0 } else { 1.0 };
        (v[0], v[1]) = ((1.0 - e[1].abs()) * sign(e[0]), (1.0 - e[0].abs()) * sign(e[1]));
    }
    let length = v.iter().map(|v| v * v).sum::<f64>().sqrt();
    v.map(|v| v / length)
}

#[test]
fn without_wind_nothing_is_another() {
    let gpu = device::open();
    let places = [[300.0, 300.0], [310.0, 306.0]];
    let camera = device::camera([300.0, 280.0, 5.0], [302.0, 302.0, 6.0]);
    let still = scene(&places, 0.01, None);
    let mut renderer = renderer(&gpu, &still, &camera, NEAR, None);
    let first = at(&mut renderer, &camera, 0.0);
    let plan = renderer.plan().clone();
    assert!(!plan.wind && plan.items.iter().all(|i| !i.name.contains("sway") && !i.reason.contains("wind")));
    assert!(!serde_json::to_string(&plan).unwrap().contains("wind"));
    for time in [1.0, 77.7] {
        assert!(at(&mut renderer, &camera, time) == first, "time passes without wind");
    }
    assert_eq!(renderer.render(&camera, 1.0).unwrap().trees.cascades.iter().sum::<u32>(), 0, "maps are kept");
    drop(renderer);
    gpu.close().unwrap();
}

#[test]
fn a_time_has_its_picture_whatever_came_before_and_no_other_has() {
    let gpu = device::open();
    let places: Vec<[f64; 2]> =
        (0..25).map(|k| [270.0 + 12.0 * f64::from(k % 5), 290.0 + 12.0 * f64::from(k / 5)]).collect();
    let scene = scene(&places, 0.01, Some(WEST));
    let camera = device::camera([300.0, 270.0, 6.0], [300.0, 300.0, 6.0]);
    for (by, rasterizer) in
        [(NEAR, None), (TREES, Some(Rasterizer::Graphics)), (TREES, Some(Rasterizer::Tiles))]
    {
        let new = || renderer(&gpu, &scene, &camera, by, rasterizer);
        let mut one = new();
        let [a, b] = [1.0, 2.0].map(|t| at(&mut one, &camera, t));
        assert!(a != b, "{by}: time moves the picture");
        // Where the camera was before, what shadow maps held, and time itself leave no trace.
        let elsewhere = device::camera([310.0, 330.0, 20.0], [290.0, 300.0, 3.0]);
        at(&mut one, &elsewhere, 2.0);
        assert!(at(&mut one, &camera, 1.0) == a, "{by}: back in time");
        let mut other = new();
        assert!(at(&mut other, &camera, 2.0) == b, "{by}: directly");
    }
    gpu.close().unwrap();
}

#[test]
fn rasterizers_agree_on_swaying_trees() {
    let gpu = device::open();
    let scene = scene(&[[296.0, 300.0], [307.0, 312.0]], 0.006, Some(Wind { speed: 60.0, ..WEST }));
    let camera = device::camera([300.0, 278.0, 6.0], [300.0, 300.0, 6.0]);
    let drawn = [Rasterizer::Graphics, Rasterizer::Tiles].map(|r| {
        let mut renderer = renderer(&gpu, &scene, &camera, TREES, Some(r));
        at(&mut renderer, &camera, 5.0)
    });
    let [a, b] = drawn.each_ref().map(linear);
    let differs = a.coverage.iter().zip(&b.coverage).filter(|(a, b)| (*a - *b).abs() > 0.26).count();
    // Ties of order and rounding.
    assert!(differs * 500 < a.coverage.len(), "{differs} of {}", a.coverage.len());
    gpu.close().unwrap();
}

/// Where the tree of a picture is: the middle of its coverage, in pixels from the image's left and top, of rows from `top` to `bottom`.
fn middle(picture: &Picture, rows: std::ops::Range<u32>) -> [f64; 2] {
    let l = linear(picture);
    let (mut sum, mut x, mut y) = (0.0, 0.0, 0.0);
    for row in rows {
        for column in 0..SIZE[0] {
            let c = f64::from(l.coverage[(row * SIZE[0] + column) as usize]);
            sum += c;
            x += c * (f64::from(column) + 0.5);
            y += c * (f64::from(row) + 0.5);
        }
    }
    [x / sum, y / sum]
}

#[test]
fn a_trees_mesh_and_its_z_field_sway_alike_and_its_foot_stays() {
    let gpu = device::open();
    let wind = Wind { speed: 45.0, gustiness: 1.0, ..WEST };
    let camera = device::camera([300.0, 262.0, 6.0], [300.0, 300.0, 6.0]);
    let eye = Eye::new(&camera, &scene(&[], 0.0, None).terrain, SIZE);
    // Whole meshes: of a few leaves that stand for all, the middle goes where those few do.
    let [still, swaying] = [None, Some(wind)].map(|wind| {
        let mut scene = scene(&[[300.0, 300.0]], 0.0, wind);
        scene.settings.leaf_pixels = 0.0;
        scene
    });
    let rest = [NEAR, TREES].map(|by| at(&mut renderer(&gpu, &still, &camera, by, None), &camera, 0.0));
    let mut both = [NEAR, TREES].map(|by| renderer(&gpu, &swaying, &camera, by, None));
    let mut most: f64 = 0.0;
    let all = 0..SIZE[1];
    for k in 0..16 {
        let time = 4.0 * f64::from(k);
        let pictures = both.each_mut().map(|r| at(r, &camera, time));
        let moved = [0, 1].map(|k| middle(&pictures[k], all.clone())[0] - middle(&rest[k], all.clone())[0]);
        println!("{time} s: mesh {:.3}, z-field {:.3} pixels", moved[0], moved[1]);
        most = most.max(moved[1].abs());
        // Branches of a mesh swing by up to a tenth of their length besides, the left ones as the right ones; a pixel is half a metre.
        assert!((moved[0] - moved[1]).abs() < 0.25, "{time}: {moved:?}");
        // The lowest metre of the trunk: a tenth of half a metre is an eighth of a pixel.
        let foot = |p: &Picture| middle(p, 57..60)[0];
        let feet = [0, 1].map(|k| foot(&pictures[k]) - foot(&rest[k]));
        assert!(feet.iter().all(|f| f.abs() < 0.35), "{time}: the foot moves: {feet:?}");
    }
    let metre = eye.pixels_at_1m / 38.0;
    // Half of the bound at the middle of the crown, six metres up.
    assert!(most > 0.25 * wind.shear() * 6.0 * metre, "{most} pixels, {metre} a metre");
    assert!(most < wind.shear() * 14.0 * metre, "{most}");
    drop(both);
    gpu.close().unwrap();
}

#[test]
fn shadows_of_meshes_and_of_z_fields_move_along() {
    let gpu = device::open();
    let scene = scene(&[[300.0, 300.0]], 0.0, Some(Wind { speed: 40.0, ..WEST }));
    // From above, where only ground is looked at: the tree's shadow falls to the north-east.
    let camera = device::camera([309.0, 314.0, 22.0], [309.0, 314.5, 0.0]);
    for by in [NEAR, TREES] {
        let mut renderer = renderer(&gpu, &scene, &camera, by, None);
        let mut lit = |time: f64| -> Vec<f32> {
            let picture = at(&mut renderer, &camera, time);
            let report = renderer.render(&camera, 1.0).unwrap();
            assert_eq!(report.trees.cascades.iter().sum::<u32>(), 0, "{by}: of the same time maps are kept");
            let l = linear(&picture);
            let bare = |k: &usize| l.coverage[*k] == 0.0;
            (0..l.coverage.len()).map(|k| if bare(&k) { l.fractions[k][0] } else { -1.0 }).collect()
        };
        let (a, b) = (lit(0.0), lit(1.5));
        let pairs = || a.iter().zip(&b).filter(|(a, b)| **a >= 0.0 && **b >= 0.0);
        let moved = pairs().filter(|(a, b)| (*a - *b).abs() > 0.4).count();
        let dark = pairs().filter(|(a, _)| **a < 0.5).count();
        assert!(dark > 200, "{by}: {dark} pixels of shadow");
        assert!(moved * 50 > dark, "{by}: {moved} of {dark} pixels of shadow change");
    }
    gpu.close().unwrap();
}

#[test]
fn gusts_move_the_far_forest_and_keep_its_light() {
    let gpu = device::open();
    let strong = scene(&[], 0.02, Some(Wind { speed: 60.0, gustiness: 1.0, ..WEST }));
    let camera = device::camera([300.0, 40.0, 90.0], [300.0, 300.0, 0.0]);
    for rasterizer in [Rasterizer::Tiles, Rasterizer::Graphics] {
        let mut far = renderer(&gpu, &strong, &camera, FAR, Some(rasterizer));
        let [a, b] = [0.0, 2.0].map(|t| at(&mut far, &camera, t));
        assert!(a != b, "gusts show");
        let light = |p: &Picture| linear(p).sun.iter().flatten().map(|v| f64::from(*v)).sum::<f64>();
        assert!((light(&a) / light(&b) - 1.0).abs() < 0.01, "{} {}", light(&a), light(&b));
    }
    gpu.close().unwrap();
}

#[test]
fn extremes_of_wind_and_time_are_drawn() {
    let gpu = device::open();
    let camera = device::camera([300.0, 288.0, 3.0], [300.0, 300.0, 8.0]);
    for (speed, gustiness) in [(100.0, 1.0), (1e-6, 0.0), (100.0, 0.0)] {
        let scene =
            scene(&[[300.0, 300.0], [301.0, 296.0]], 0.01, Some(Wind { speed, azimuth: -90.0, gustiness }));
        let mut renderer = renderer(&gpu, &scene, &camera, NEAR, None);
        for time in [0.0, -1e9, 1e9, 0.5 * PERIOD] {
            at(&mut renderer, &camera, time);
        }
        // Spheres of the cull hold the tree wherever it is moved to: its box, which is a hair wider than its places, and what the wind adds.
        let (row, wind) = (renderer.forest().unwrap().species.rows[0], scene.wind.unwrap());
        let [half_width, _, half_height] = row.scale_to_metres.map(f64::from);
        let reach = wind.reach(f64::from(row.centre) + half_height, half_width);
        let radius = half_width.hypot(half_height) + reach;
        assert!(
            (f64::from(row.bounding_radius) - radius).abs() < 1e-5 * radius,
            "{} {radius}",
            row.bounding_radius
        );
        // Inside the crown, and under it.
        for position in [[300.0, 300.0, 9.0], [300.2, 300.0, 0.5]] {
            at(&mut renderer, &device::camera(position, [310.0, 305.0, 9.0]), 3.0);
        }
    }
    gpu.close().unwrap();
}

#[test]
fn the_plan_says_what_wind_adds_and_the_reference_refuses_it() {
    let gpu = device::open();
    let camera = device::camera([300.0, 270.0, 6.0], [300.0, 300.0, 6.0]);
    let [still, windy] = [None, Some(WEST)].map(|w| {
        let scene = scene(&[[300.0, 300.0]], 0.01, w);
        let eye = Eye::new(&camera, &scene.terrain, SIZE);
        let drawing = Drawing { ladder: Some(NEAR.parse().unwrap()), rasterizer: None };
        Plan::for_eye(&scene, &eye, false, drawing, Some(gpu.info())).unwrap()
    });
    let names = |plan: &Plan| plan.items.iter().map(|i| i.name.clone()).collect::<Vec<_>>();
    let added: Vec<_> = names(&windy).into_iter().filter(|n| !names(&still).contains(n)).collect();
    assert_eq!(added, ["sway of trees", "flutter of leaves", "gusts over the shader-map"]);
    assert!(windy.items.iter().any(|i| i.name == "shadows" && i.reason.contains("wind")));
    // Trees reach farther, and so may the quads in which they are looked for; nothing else takes memory.
    assert!(windy.tallest > still.tallest && windy.tallest < 1.3 * still.tallest);
    let scene = scene(&[[300.0, 300.0]], 0.01, Some(WEST));
    let refused = World::new(&scene, &[Eye::new(&camera, &scene.terrain, SIZE)]).err().unwrap().to_string();
    assert!(refused.contains("[wind]"), "{refused}");
    gpu.close().unwrap();
}
