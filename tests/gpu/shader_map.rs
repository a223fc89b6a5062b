//! Far forests in whole frames: fractions and radiances against the tables in f64, the hand-over, and extremes.

use crate::device::{self, Worst};
use canopy::camera::{Eye, sun_direction};
use canopy::frame::Renderer;
use canopy::gpu::Gpu;
use canopy::gpu::interface::Species;
use canopy::image::Linear;
use canopy::ladder::Ladder;
use canopy::measure::reflectance::{Method, Request, measure};
use canopy::physics::raster::Raster;
use canopy::physics::tables::ForestTables;
use canopy::physics::{forest, light, tables};
use canopy::plan::Plan;
use canopy::scene::{Distribution, Scene, TreePosition};
use std::f64::consts::PI;
use std::sync::Arc;

const SIZE: [u32; 2] = [64, 48];
const E: [f64; 3] = [1.0, 0.9, 0.8];
const SKY: [f64; 3] = [0.1, 0.2, 0.3];
const ALBEDO: [f64; 3] = [0.2, 0.15, 0.1];
const EXTENT: f64 = 2400.0;
/// Of the pattern that all densities are thinned from, so that all have the same tables.
const DENSEST: f64 = 0.1;

/// Birches on a plain that descends to the south by some degrees; the sun in the south.
fn plain(density: f64, elevation: f64, slope: f64) -> Scene {
    let mut scene = device::small_scene(&format!(
        "seed = 2\n[terrain]\nextent = {EXTENT:?}\nalbedo = {ALBEDO:?}\n\
         [[species]]\nname = \"a\"\nmodel = \"builtin:birch\"\ndensity = {DENSEST:?}\n\
         [sun]\nazimuth = 180.0\nelevation = {elevation:?}\nirradiance = {E:?}\n[sky]\nradiance = {SKY:?}\n\
         [[camera]]\nname = \"c\"\nposition = [150.0, 120.0, 30.0]\ntarget = [200.0, 200.0, 0.0]\nvertical_fov = 50.0\n"
    ));
    if let Distribution::Density { map, .. } = &mut scene.species[0].distribution {
        let relative = (density / DENSEST) as f32;
        *map = Some(Arc::new(Raster { width: 1, height: 1, samples: vec![relative] }));
    }
    if slope != 0.0 {
        let side = 25u32;
        scene.terrain.cell_size = EXTENT / f64::from(side - 1);
        let rise = scene.terrain.cell_size * slope.to_radians().tan();
        let samples = (0..side * side).map(|k| (f64::from(k / side) * rise) as f32).collect();
        scene.terrain.heights = Some(Raster { width: side, height: side, samples });
    }
    scene
}

/// An eye that looks at the middle of a plain from a zenith angle and an azimuth from the sun's, from a distance.
fn eye(scene: &Scene, (zenith, azimuth): (f64, f64), distance: f64, width: f64) -> Eye {
    let (z, a) = (zenith.to_radians(), azimuth.to_radians());
    let v = [z.sin() * a.sin(), -z.sin() * a.cos(), z.cos()];
    let middle = 0.5 * EXTENT;
    let ground = scene.terrain.height_at(middle, middle);
    let target = [middle, middle, ground];
    let fov = 2.0 * (0.5 * width / distance).atan().to_degrees();
    Eye::looking([0, 1, 2].map(|k| target[k] + distance * v[k]), v.map(|c| -c), fov, SIZE)
}

fn renderer(gpu: &Gpu, scene: &Scene, eye: &Eye, how: Ladder) -> Renderer {
    let plan = Plan::for_eye(scene, eye, true, how, Some(gpu.info())).unwrap();
    Renderer::new(gpu, Arc::new(scene.clone()), plan, &device::bake(scene)).unwrap()
}

/// Direction through a pixel's centre, with a component of 1 along the view axis.
fn ray(eye: &Eye, k: usize) -> [f64; 3] {
    let (x, y) = ((k % SIZE[0] as usize) as f64 + 0.5, (k / SIZE[0] as usize) as f64 + 0.5);
    let (u, v) = (2.0 * x / f64::from(SIZE[0]) - 1.0, 1.0 - 2.0 * y / f64::from(SIZE[1]));
    [0, 1, 2].map(|i| eye.forward[i] + u * eye.tangents[0] * eye.right[i] + v * eye.tangents[1] * eye.up[i])
}

fn unit(v: [f64; 3]) -> [f64; 3] {
    glam::DVec3::from(v).normalize().into()
}

/// Fractions, sun and sky part of a pixel as the tables have them in f64.
fn oracle(
    scene: &Scene,
    t: &ForestTables,
    row: &Species,
    density: f64,
    v: [f64; 3],
    n: [f64; 3],
) -> [[f64; 4]; 3] {
    let l = sun_direction(&scene.sun);
    let level = density * f64::from(row.mean_area);
    let f = forest::forest(t, v, l, n, level, forest::Known::own(level));
    let (open, joint) = ((-f.seen).exp(), (-f.joint).exp());
    let ([leaf, bark], [sky_leaf, sky_bark]) = (f.sun, f.sky);
    let sky = light::ground_sky(n[2], f.ground[0], level);
    let trees = 1.0 - open;
    let facing = tables::sun_facing(l, n);
    let lit = facing * (leaf + bark);
    let cosine = (0..3).map(|k| n[k] * l[k]).sum::<f64>().max(0.0);
    let joint = if cosine > 0.0 { joint } else { 0.0 };
    let angle = light::angle_between(v, l);
    let hotspot = light::hotspot(
        angle,
        f64::from(scene.settings.hotspot_amplitude),
        f64::from(scene.settings.hotspot_width),
    );
    let (mut from_sun, mut from_sky) = ([0.0; 4], [0.0; 4]);
    for c in 0..3 {
        let (r, t, b) =
            (f64::from(row.reflectance[c]), f64::from(row.transmittance[c]), f64::from(row.bark_ratio[c]));
        let turned = light::turned_reflectance(row.turning.into(), angle);
        let full = light::leaf_phase(angle, r * turned, t) * hotspot * E[c];
        from_sun[c] =
            trees * facing * f.transfer * full * (leaf + b * bark) + joint * ALBEDO[c] * cosine / PI * E[c];
        let leaves =
            0.5 * light::sky_over_slope(n[2], level) * f64::from(row.albedo[c]) * (sky_leaf + b * sky_bark);
        from_sky[c] = SKY[c] * (trees * leaves + open * ALBEDO[c] * sky);
    }
    [[joint, open - joint, trees * lit, trees * (1.0 - lit)], from_sun, from_sky]
}

#[test]
fn a_forest_far_away_is_what_the_tables_say() {
    let gpu = device::open();
    let [mut fractions, mut sun, mut sky, mut hotspot] = [0; 4].map(|_| Worst::default());
    for (density, elevation, slope) in [
        (0.02, 50.0, 0.0),
        (0.1, 20.0, 0.0),
        (0.001, 70.0, 0.0),
        (0.03, 40.0, 25.0),
        (0.03, 30.0, -20.0),
        (0.03, 10.0, -20.0),
    ] {
        let mut scene = plain(density, elevation, slope);
        scene.settings.set("samples", 1.0).unwrap();
        let tables = device::bake(&scene)[0].tables.clone();
        let above = eye(&scene, (0.0, 0.0), 30_000.0, 200.0);
        let mut renderer = renderer(&gpu, &scene, &above, Ladder::SHADER_MAP);
        let row = renderer.forest().unwrap().species.rows[0];
        let n = [0.0, -slope.to_radians().sin(), slope.to_radians().cos()];
        for (zenith, azimuth) in
            [(0.0, 0.0), (35.0, 180.0), (45.0, 70.0), (50.0, 40.0), (90.0 - elevation, 0.0)]
        {
            // From 30 km a cell of the mesh is 0.15 degrees; discs of a few metres are too small for any texel.
            let eye = eye(&scene, (zenith, azimuth), 30_000.0, 200.0);
            if -(0..3).map(|k| n[k] * eye.forward[k]).sum::<f64>() < 0.15 {
                continue;
            }
            renderer.render_eye(&eye, 1.0).unwrap();
            let l = renderer.picture().unwrap().linear.unwrap();
            for k in 0..l.sun.len() {
                let d = unit(ray(&eye, k));
                let want = oracle(&scene, &tables, &row, density, d.map(|c| -c), n);
                let at = || {
                    let got = (l.fractions[k], l.sun[k], l.sky[k]);
                    format!(
                        "density {density} sun {elevation} slope {slope} view {zenith} {azimuth}: {got:?} {want:?}"
                    )
                };
                assert!(l.depth[k] > 0.0 && l.species[k] == 0, "{}", at());
                let sum: f64 = l.fractions[k].iter().map(|f| f64::from(*f)).sum();
                // Four half floats.
                assert!((sum - 1.0).abs() <= 1.0 / 1024.0, "{}", at());
                let opposite = sun_direction(&scene.sun).map(|c| -c);
                if light::angle_between(d, opposite) < 0.1 {
                    let error = (0..4).map(|c| (f64::from(l.fractions[k][c]) - want[0][c]).abs());
                    hotspot.note(error.fold(0.0, f64::max), at);
                    continue;
                }
                for (got, want) in l.fractions[k].iter().zip(want[0]) {
                    fractions.note((f64::from(*got) - want).abs(), at);
                }
                // Where the sun is behind the slope nothing is lit.
                for (got, want) in l.sun[k].iter().zip(want[1]) {
                    sun.note((f64::from(*got) - want).abs() / want.max(1e-6), at);
                }
                for (got, want) in l.sky[k].iter().zip(want[2]) {
                    sky.note((f64::from(*got) / want - 1.0).abs(), at);
                }
            }
        }
    }
    // Next to the direction of the sun the tables' coordinates are roots of the angle from it: half a cell of the mesh, 0.1
    // degrees, is sqrt(0.1 / 50) = 0.04 of the way to where view and light have nothing in common. What changes on the way
    // is what is lit: up to all of it.
    hotspot.within(0.04, "hotspot");
    // Half floats, 2^-11 each: of the density in its tile, of V and of W. Each moves an optical path L by that part, and
    // exp(-L) by at most 1/e of it; T, slopes and the stored fraction, another 2^-11 each of at most 1. Linear between nodes
    // of the mesh, 0.2 degrees apart, paths are within 1e-4. A GPU's filter weights tables' nodes with 8 bits: half a step of
    // them, where fractions of neighbouring nodes differ by a tenth.
    let filter = if gpu.info().kind == "cpu" { 0.0 } else { 0.1 / 512.0 };
    fractions.within((3.0 / std::f64::consts::E + 3.0) / 2048.0 + 2e-4 + filter, "fractions");
    // The same of the terms of a sum; L reaches 3 where it matters at all; tables, slopes and radiance are half floats.
    sun.within((3.0 * 3.0 + 4.0) / 2048.0, "sunlight");
    sky.within((3.0 * 3.0 + 4.0) / 2048.0, "skylight");
    gpu.close().unwrap();
}

/// Heights between which a species' crowns are, m: from where there is not only bark.
fn crowns(row: &Species) -> [f64; 2] {
    let scale = 0.5 * (row.scale_range[0] + row.scale_range[1]);
    [row.bare_below, 1.0].map(|z| f64::from(scale * (row.centre + z * row.scale_to_metres[2])))
}

/// Fractions of a level mix of species, of `densities`, as the tables have them in f64.
fn mixed(
    scene: &Scene,
    tables: &[Arc<ForestTables>],
    rows: &[Species],
    densities: &[f64],
    v: [f64; 3],
) -> [f64; 4] {
    let (l, up) = (sun_direction(&scene.sun), [0.0, 0.0, 1.0]);
    let member = |(k, t): (usize, &Arc<ForestTables>)| forest::Member {
        thickness: densities[k] * f64::from(rows[k].mean_area),
        alone: forest::alone(t, v, l, up),
        sky: forest::sky_path(t),
        crowns: crowns(&rows[k]),
        listed: rows[k].listed_density > 0.0,
    };
    let members: Vec<forest::Member> = tables.iter().enumerate().map(member).collect();
    let total: f64 = members.iter().map(|m| m.thickness).sum();
    let [mut seen, mut joint, mut lit, mut weights] = [0.0; 4];
    for ((t, m), (known, stratum)) in tables.iter().zip(&members).zip(forest::mix(&members)) {
        let f = forest::forest(t, v, l, up, total, known);
        let share = m.thickness / total;
        seen += share * f.seen;
        joint += share * f.joint;
        // What is seen of a species is as much as its layer says, of paths as its tables have them.
        let weight = f.seen / m.alone[0] * stratum;
        lit += weight * (f.sun[0] + f.sun[1]);
        weights += weight;
    }
    let (open, joint, lit) = ((-seen).exp(), (-joint).exp(), lit / weights);
    [joint, open - joint, (1.0 - open) * lit, (1.0 - open) * (1.0 - lit)]
}

/// A mix is what its species' tables say together; and undergrowth that covers half a per cent of what the large trees do changes no
/// light on them, however many small trees it has. (Looked up by the number of all trees, the large ones' light was that of a
/// forest three times as dense.)
#[test]
fn a_mix_of_large_and_small_trees_is_what_their_tables_say() {
    let gpu = device::open();
    let (mut fractions, mut alone) = (Worst::default(), Worst::default());
    let densities = [0.02, 0.04];
    for scale in [0.6, 0.05] {
        let mut scene = plain(densities[0], 40.0, 0.0);
        scene.settings.set("samples", 1.0).unwrap();
        let mut small = scene.species[0].clone();
        small.name = "b".into();
        small.scale = [scale; 2];
        small.distribution = Distribution::Density {
            max_density: densities[1] as f32,
            map: None,
            between_heights: None,
            below_slope: None,
        };
        scene.species.push(small);
        let tables: Vec<Arc<ForestTables>> = device::bake(&scene).iter().map(|b| b.tables.clone()).collect();
        let at = |view| eye(&scene, view, 30_000.0, 200.0);
        let mut renderer = renderer(&gpu, &scene, &at((0.0, 0.0)), Ladder::SHADER_MAP);
        let rows = renderer.forest().unwrap().species.rows.clone();
        for view in [(0.0, 0.0), (35.0, 180.0), (45.0, 70.0)] {
            let eye = at(view);
            renderer.render_eye(&eye, 1.0).unwrap();
            let l = renderer.picture().unwrap().linear.unwrap();
            let k = l.sun.len() / 2 + SIZE[0] as usize / 2;
            let v = unit(ray(&eye, k)).map(|c| -c);
            let want = mixed(&scene, &tables, &rows, &densities, v);
            let one = oracle(&scene, &tables[0], &rows[0], densities[0], v, [0.0, 0.0, 1.0])[0];
            for c in 0..4 {
                let got = f64::from(l.fractions[k][c]);
                let at = || format!("scale {scale}, {view:?}: {:?}, {want:?}, alone {one:?}", l.fractions[k]);
                fractions.note((got - want[c]).abs(), at);
                if scale < 0.1 {
                    alone.note((got - one[c]).abs(), at);
                }
            }
        }
    }
    // As in the test of one species; the shader adds 1e-4 to each thickness, of 0.1 and more, to which paths are in proportion.
    let bound = (3.0 / std::f64::consts::E + 3.0) / 2048.0 + 2e-4 + 2e-3 / std::f64::consts::E;
    fractions.within(bound, "fractions");
    // A path grows by 0.005 of it at most, and exp(-L) changes by 1/e of that.
    alone.within(0.005 / std::f64::consts::E + bound, "beside trees alone");
    gpu.close().unwrap();
}

#[test]
fn fractions_are_shares_of_a_pixel_at_every_distance() {
    let gpu = device::open();
    let scene = plain(0.03, 40.0, 0.0);
    let mut shown = Vec::new();
    for how in [Ladder::BN12, Ladder::ZFIELD, Ladder::SHADER_MAP] {
        let eyes = [60.0, 140.0, 170.0, 600.0].map(|d| eye(&scene, (35.0, 60.0), d, d));
        let mut renderer = renderer(&gpu, &scene, &eyes[0], how);
        let range = renderer.plan().range;
        // Trees of a pixel, all of them drawn, are many.
        for eye in &eyes[..if how == Ladder::ZFIELD { 2 } else { 4 }] {
            let (report, _) = renderer.render_eye(eye, 1.0).unwrap();
            let l = renderer.picture().unwrap().linear.unwrap();
            let (mut mean, relative) = ([0.0; 4], eye.position[2] / 35f64.to_radians().cos() / range);
            for f in &l.fractions {
                assert!(f.iter().all(|v| (0.0..=1.0).contains(v)), "{how:?} {relative}: {f:?}");
                let sum: f64 = f.iter().map(|v| f64::from(*v)).sum();
                // Half floats of what each sample has, and of their mean, rounded either way.
                assert!((sum - 1.0).abs() <= 2.0 / 1024.0, "{how:?} {relative}: {f:?}");
                (0..4).for_each(|k| mean[k] += f64::from(f[k]) / l.fractions.len() as f64);
            }
            println!("{how:?} at {relative:.2} of the range: {} trees, {mean:.3?}", report.trees.camera);
            assert!(mean.iter().all(|f| *f > 0.02), "{how:?} {relative}: {mean:?}");
            shown.push(report.trees.camera);
        }
    }
    // Near all trees are drawn, and within the hand-over; far none. The others always, and never.
    assert!(shown[..3].iter().chain(&shown[4..6]).all(|n| *n > 50), "{shown:?}");
    assert!(shown[3..4].iter().chain(&shown[6..]).all(|n| *n == 0), "{shown:?}");
    gpu.close().unwrap();
}

#[test]
fn where_a_crown_is_no_ground_shows() {
    let gpu = device::open();
    let mut scene = plain(0.03, 40.0, 0.0);
    scene.terrain.extent = [100.0; 2];
    scene.settings.set("coverage_size", 128.0).unwrap();
    scene.settings.set("samples", 1.0).unwrap();
    let places: Vec<[f64; 2]> =
        (0..16).map(|k| [12.0 + 24.0 * f64::from(k % 4), 9.0 + 25.0 * f64::from(k / 4)]).collect();
    let list = places.iter().map(|p| TreePosition { x: p[0], y: p[1], scale: Some(3.0), rotation: None });
    scene.species[0].distribution = Distribution::Positions(Arc::new(list.collect()));
    let eye = Eye::looking([50.0, 22.0, 90.0], [0.0, 0.2, -0.9], 20.0, SIZE);
    let mut renderer = renderer(&gpu, &scene, &eye, Ladder::SHADER_MAP);
    renderer.render_eye(&eye, 1.0).unwrap();
    let l = renderer.picture().unwrap().linear.unwrap();
    let row = renderer.forest().unwrap().species.rows[0];
    let (radius, [low, high]) = (3.0 * f64::from(row.crown_radius), crowns(&row));
    let (mut within, mut between) = (0, 0);
    for k in (0..l.depth.len()).filter(|k| l.depth[*k] > 0.0) {
        let d = ray(&eye, k);
        let at = [0, 1].map(|i| eye.position[i] - eye.position[2] / d[2] * d[i]);
        // Over what the sight line passes while it is among crowns.
        let over = |h: f64| {
            let place = [0, 1].map(|i| at[i] + h / d[2] * d[i]);
            places.iter().map(|p| (p[0] - place[0]).hypot(p[1] - place[1])).fold(f64::INFINITY, f64::min)
        };
        let passed = (0..=8).map(|i| over(low + (high - low) * f64::from(i) / 8.0));
        let (nearest, farthest) = passed.fold((f64::INFINITY, 0.0f64), |(a, b), d| (a.min(d), b.max(d)));
        // Mips up to twice as coarse as a pixel is long on the ground, 1.3 of its width; their filter reaches a texel and a
        // half. And the discs' own edge is a texel wide, of 100 m / 112.
        let pixel = 2.0 * eye.tangents[1] * f64::from(l.depth[k]) / f64::from(SIZE[1]);
        let blur = 3.0 * 1.3 * pixel + 0.5 * 100.0 / 112.0;
        let ground = l.fractions[k][0] + l.fractions[k][1];
        if farthest < radius - blur {
            within += 1;
            // Discs leave 2^-12 of texels that they cover whole, which rounds to 1 or 2^-11 less, as does each of two mips;
            // between discs at most all of the ground shows.
            assert!(ground <= 3.0 / 2048.0, "{ground} of the ground {farthest} m from a tree of {radius} m");
        } else if nearest > radius + blur {
            between += 1;
            // exp(-L) / (1 - C): from 20 degrees, and where trees are known to stand only within a few dozen metres.
            assert!(ground > 0.3, "{ground} of the ground {nearest} m from a tree of {radius} m");
        }
    }
    println!("{within} pixels of crowns of {radius} m, {between} between");
    drop(renderer);
    assert!(within > 50 && between > 200);
    gpu.close().unwrap();
}

/// Ridges with slopes of up to 80 degrees under trees that keep to some heights.
fn steep() -> Scene {
    let mut scene = plain(0.05, 50.0, 0.0);
    let side = 31u32;
    scene.terrain.extent = [600.0; 2];
    scene.terrain.cell_size = 20.0;
    let wave = |k: u32| [0.0, 110.0, -20.0, 60.0][(k % 4) as usize];
    let samples = (0..side * side).map(|k| (wave(k % side) + 0.3 * wave(k / side + 1)) as f32).collect();
    scene.terrain.heights = Some(Raster { width: side, height: side, samples });
    if let Distribution::Density { between_heights, .. } = &mut scene.species[0].distribution {
        *between_heights = Some([-10.0, 70.0]);
    }
    scene
}

#[test]
fn no_light_angle_or_slope_breaks_a_far_forest() {
    let gpu = device::open();
    let all = [
        (Ladder::BN12, 90.0),
        (Ladder::SHADER_MAP, 50.0),
        (Ladder::BN12, 0.5),
        (Ladder::SHADER_MAP, 0.0),
        (Ladder::BN12, -5.0),
    ];
    for (what, mut scene, cases) in
        [("steep", steep(), &all[..]), ("level", plain(0.05, 50.0, 0.0), &all[1..3])]
    {
        for &(how, elevation) in cases {
            scene.sun.elevation = elevation;
            let l = sun_direction(&scene.sun);
            let middle = 0.5 * scene.terrain.extent[0];
            let towards = |v: [f64; 3], distance: f64| {
                let at = [0, 1, 2].map(|k| [middle, middle, 20.0][k] + distance * v[k]);
                Eye::looking(at, v.map(|c| -c), 40.0, SIZE)
            };
            let eyes = [
                ("from the sun", towards(l, 400.0)),
                ("from far in the sun's direction", towards(l, 30_000.0)),
                ("against the sun", towards(unit([-l[0], -l[1], l[2].max(0.1)]), 400.0)),
                ("grazing", towards(unit([0.3, -1.0, 0.003]), 500.0)),
                ("along the ground", Eye::looking([middle, middle, 0.02], [0.3, 1.0, 0.0], 60.0, SIZE)),
                ("from below", Eye::looking([middle, middle, -300.0], [0.2, 0.3, 0.8], 60.0, SIZE)),
            ];
            let mut renderer = renderer(&gpu, &scene, &eyes[0].1, how);
            for (from, eye) in &eyes {
                renderer.render_eye(eye, 1.0).unwrap();
                check(
                    &renderer.picture().unwrap().linear.unwrap(),
                    &format!("{what}, sun at {elevation}, {how:?} {from}"),
                );
            }
        }
    }
    gpu.close().unwrap();
}

/// Everything is a number, no fraction is negative, and no leaf, bark or ground reflects more than all light.
fn check(l: &Linear, what: &str) {
    for (k, f) in l.fractions.iter().enumerate() {
        let light = || (l.sun[k].iter().zip(E)).chain(l.sky[k].iter().zip(SKY));
        let bad = light().any(|(v, most)| !(0.0..=1.001 * most).contains(&f64::from(*v)));
        // Half floats of each sample and of their mean.
        let shares = f.iter().all(|v| *v >= 0.0) && f.iter().sum::<f32>() <= 1.0 + 2.0 / 1024.0;
        assert!(!bad && shares, "{what}, pixel {k}: {:?} {:?} {f:?}", l.sun[k], l.sky[k]);
    }
}

#[test]
fn near_and_far_forests_are_equally_bright() {
    let gpu = device::open();
    // At a node of the tables' densities: of three nodes the next is a regular pattern, in which crowns hide twice as much.
    let density = 0.25 * DENSEST;
    let mut scene = plain(density, 50.0, 0.0);
    // Tables as good as the patches, and views of the trees in texels finer than what is seen of them.
    scene.settings.set("table_rays", 2048.0).unwrap();
    scene.settings.set("view_resolution", 64.0).unwrap();
    scene.settings.set("cascade_size", 1024.0).unwrap();
    let baked = device::bake(&scene);
    let camera = scene.cameras[0].clone();
    let plan = Plan::new(&scene, &camera, SIZE, false, Some(gpu.info())).unwrap();
    let method = Method { patches: 4, side: 50.0, pixels: 64 };
    let seen = |relative: f64| {
        let request = Request {
            sun_zenith: 40.0,
            slope: 0.0,
            distance: relative * plan.range,
            drawing: Ladder::BN12.into(),
            views: vec![[0.0, 0.0], [40.0, 0.0], [-40.0, 0.0], [30.0, 90.0]],
        };
        measure(&gpu, &scene, &[density], &baked, (&camera, SIZE), &method, &request, &mut || ()).unwrap()
    };
    let mut worst = Worst::default();
    let (near, far) = (seen(0.3), seen(1.5));
    for (near, far) in near.iter().zip(&far) {
        for (c, (a, b)) in near.radiance().into_iter().zip(far.radiance()).enumerate() {
            println!(
                "{:?} {c}: {a:.5} +- {:.5}, {b:.5}, {:.3?} {:.3?}",
                near.view, near.stderr[c], near.fractions, far.fractions
            );
            worst.note((b / a - 1.0).abs(), || format!("{:?}, channel {c}: {a} {b}", near.view));
        }
    }
    // Standard errors near are 1.5 to 5.4 %, and far, where light and gaps are averages, the trees are the same: two of them.
    worst.within(0.1, "radiance far over near");
    gpu.close().unwrap();
}
