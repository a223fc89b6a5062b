//! Angles, coordinates and lookups of the forest tables, against their twin in f64.

use crate::device::{self, Arguments, Function, Worst, dispatch, evaluate, float, words};
use canopy::forest::tables::TableData;
use canopy::gpu::{Resource, Sampler, shaders};
use canopy::physics::hash::Stream;
use canopy::physics::tables;
use canopy::physics::tables::ForestTables;
use canopy::plan::tables as described_tables;
use glam::DVec3;
use std::f64::consts::PI;

/// Relative rounding of a single operation.
const EPS: f64 = 6e-8;
/// Of atan, relative: 4096 ulp.
const ATAN: f64 = 4096.0 * 2.0 * EPS;

fn direction(zenith: f64, azimuth: f64) -> DVec3 {
    let ((sz, cz), (sa, ca)) = (zenith.to_radians().sin_cos(), azimuth.to_radians().sin_cos());
    DVec3::new(sz * ca, sz * sa, cz)
}

#[test]
fn angles_about_any_ground_are_those_of_the_oracle() {
    let gpu = device::open();
    let zeniths = [0.0, 1e-6, 1e-3, 5.0, 40.0, 70.0, 88.0, 89.9, 90.0, 95.0, 180.0];
    let mut directions: Vec<DVec3> = vec![DVec3::Z];
    directions.extend(zeniths.iter().enumerate().map(|(k, z)| direction(*z, 70.0 * k as f64)));
    // Level, gentle, steep, vertical, overhanging, upside down.
    let normals = [
        (0.0, 0.0),
        (1e-4, 0.0),
        (10.0, 200.0),
        (45.0, 30.0),
        (80.0, 310.0),
        (90.0, 100.0),
        (120.0, 0.0),
        (180.0, 0.0),
    ];
    let mut cases: Vec<([[f32; 3]; 3], f32)> = Vec::new();
    for n in normals.map(|(z, a)| direction(z, a)) {
        let mut lights = directions.clone();
        // Across the ground, and along its normal.
        lights.extend([n, direction(90.0, 100.0).cross(n).try_normalize().unwrap_or(DVec3::X)]);
        for v in &lights {
            // The same to the bit, opposite, next to it, mirrored about the vertical; and all others.
            let near =
                [*v, -*v, (*v + DVec3::new(1e-4, -2e-4, 1e-4)).normalize(), DVec3::new(-v.x, -v.y, v.z)];
            for l in near.iter().chain(&lights) {
                for k in [0.2, 1.0, 3.0] {
                    cases.push(([*v, *l, n].map(|w| w.as_vec3().into()), k));
                }
            }
        }
    }
    let arguments: Vec<Arguments> = cases
        .iter()
        .map(|([v, l, n], k)| words(&[v[0], v[1], v[2], *k, l[0], l[1], l[2], 0.0, n[0], n[1], n[2]]))
        .collect();
    let [mut zenith, mut azimuth, mut secant, mut other] = [0; 4].map(|_| Worst::default());
    let mut same = 0;
    for (c, out) in cases.iter().zip(evaluate(&gpu, Function::TableAngles, &arguments)) {
        let [v, l, n] = c.0.map(|w| w.map(f64::from));
        let want = tables::angles(v, l, n, f64::from(c.1));
        let got: [f64; 8] = std::array::from_fn(|k| float(&out, k));
        assert!(got.iter().all(|x| x.is_finite()), "{c:?}: {got:?}");
        let at = || format!("{c:?}: {got:?} {want:?}");
        // The height of a sheared vector is a product of up to four roundings, and three more of its sum's largest term, k w.n
        // over n.z; it turns the vector by its part across. Then atan.
        let level = f64::from(c.1) / n[2].max(1e-3);
        let off = |w: [f64; 3], length: f64| {
            let largest = (0..3).map(|i| (w[i] * n[i]).abs()).fold(0.0, f64::max);
            10.0 * EPS * level * largest / length.max(1e-12)
        };
        let off = [off(v, want.lengths[0]), off(l, want.lengths[1])];
        for (got, want, off) in [(got[0], want.v, off[0]), (got[1], want.l, off[1])] {
            zenith.note((got - want).abs() / (off + 30.0 * EPS + ATAN * want), at);
        }
        // 1 / cos, at most 1000.
        for (got, want, off) in [(got[3], want.sec_v, off[0]), (got[4], want.sec_l, off[1])] {
            secant.note((got - want).abs() / ((off + 30.0 * EPS) * want * want + 6.0 * EPS * want), at);
        }
        for ((got, want), off) in [got[5], got[6]].into_iter().zip(want.lengths).zip(off) {
            other.note((got - want).abs() / (want * (off + 10.0 * EPS)), at);
        }
        // Of the parts along the ground; what keeps atan defined is 1e-9.
        let along = |w: [f64; 3]| w[0].hypot(w[1]).max(1e-12);
        let (sin_v, sin_l) = (along(v), along(l));
        let room = 40.0 * EPS * (1.0 / sin_v + 1.0 / sin_l) + 2e-9 / (sin_v * sin_l) + ATAN * want.phi;
        azimuth.note((got[2] - want.phi).abs() / room.min(PI), at);
        assert!((0.0..=PI + 1e-6).contains(&got[2]), "{}", at());
        // The smoothstep's slope is 1.5 / 0.0349.
        other.note((got[7] - tables::sun_facing(l, n)).abs() / (43.0 * 30.0 * EPS), at);
        if c.0[0] == c.0[1] {
            same += 1;
            assert_eq!((want.v, want.phi), (want.l, 0.0), "{c:?}");
            // A fused product may leave the rounding of a square.
            assert!(out[0] == out[1] && got[2] <= 4.0 * EPS, "{}", at());
        }
    }
    assert!(same > 300, "{same}");
    zenith.within(1.0, "zenith angles");
    azimuth.within(1.0, "azimuth");
    secant.within(1.0, "secants");
    other.within(1.0, "lengths and sun");
    gpu.close().unwrap();
}

#[test]
fn coordinates_are_those_of_the_oracle() {
    let gpu = device::open();
    let max = tables::THETA_MAX;
    let zeniths = [-0.1, 0.0, 1e-12, 1e-7, 1e-3, 0.1, 0.8, 1.3, 1.5, max - 1e-7, max, 1.5690, PI / 2.0, 3.0];
    let mut cases: Vec<[f32; 7]> = Vec::new();
    for (i, v) in zeniths.into_iter().enumerate() {
        let near = [0.0, 1e-7, -1e-7, 1e-5, -1e-5, 1e-2, -1e-2].map(|d| v + d);
        for (j, l) in zeniths.into_iter().chain(near).enumerate() {
            let phi = [0.0, 1e-10, 1e-3, 1.0, 3.0, PI, 4.0][(i + j) % 7];
            let x_max = [1e-6, 0.3, 2.5][j % 3];
            let x =
                [-1.0, 0.0, 1e-20, 1e-9, 0.1 * x_max, 0.99 * x_max, x_max, 2.0 * x_max, 1e6][(2 * i + j) % 9];
            for n in [4.0, 5.0, 16.0] {
                cases.push([v, l, phi, n, x, x_max, n].map(|v| v as f32));
            }
        }
    }
    let arguments: Vec<Arguments> = cases.iter().map(|c| words(c)).collect();
    let [mut azimuth, mut light, mut view, mut density] = [0; 4].map(|_| Worst::default());
    let mut ridge = 0;
    for (c, out) in cases.iter().zip(evaluate(&gpu, Function::TableCoordinates, &arguments)) {
        let [v, l, phi, _, x, x_max, _] = c.map(f64::from);
        let n = c[3] as usize;
        let got: [f64; 4] = std::array::from_fn(|k| float(&out, k));
        assert!(got.iter().all(|x| (0.0..=f64::from(c[3]) - 1.0).contains(x)), "{c:?}: {got:?}");
        let at = || format!("{c:?}: {got:?}");
        // Relative: a division of 2.5 ulp, a root of 3 ulp, a product.
        let last = (n - 1) as f64;
        azimuth.note((got[0] - tables::azimuth_coordinate(n, phi)).abs() / last, at);
        view.note((got[2] - tables::zenith_coordinate(n, v)).abs() / last, at);
        density.note((got[3] - tables::density_coordinate(n, x_max, x)).abs() / last, at);
        // A root of |l - v| over the room on that side, which is known to roundings of the angles and of their largest
        // value: near the ridge the root of that.
        let (v, l) = (v.clamp(0.0, max), l.clamp(0.0, max));
        let room = if l < v { v } else { max - v }.max(1e-6);
        let share = ((l - v).abs() / room).min(1.0);
        let error = 4.0 * EPS * v.max(l) / room + 8.0 * EPS * share;
        let error = error.sqrt().min(error / share.sqrt().max(1e-30)) + 12.0 * EPS;
        light.note((got[1] - tables::light_coordinate(n, v, l)).abs() / (last * error), at);
        if c[0] == c[1] {
            ridge += 1;
            assert_eq!(got[1], tables::ridge(n) as f64, "{c:?}");
        }
    }
    assert!(ridge > 20);
    azimuth.within(12.0 * EPS, "azimuth");
    view.within(12.0 * EPS, "viewer's zenith");
    density.within(12.0 * EPS, "density");
    light.within(1.0, "light's zenith");
    gpu.close().unwrap();
}

/// Tables of random values, so that any wrong index shows.
fn random(seed: u32, (n, m): (u32, u32), max_thickness: f32) -> ForestTables {
    let mut stream = Stream::new(seed);
    let mut value = || (1.5 * stream.unit()) as f32;
    let (pairs, views) = ((m * n * n * n) as usize, (m * n) as usize);
    ForestTables {
        angles: n,
        densities: m,
        max_thickness,
        area: 10.0,
        vertical_scale: 1.0,
        hole: 1.0,
        pair: (0..pairs).map(|_| [0; 4].map(|_| value())).collect(),
        pair_stderr: Vec::new(),
        view: (0..views).map(|_| [0; 4].map(|_| value())).collect(),
        view_stderr: Vec::new(),
        ground: (0..m).map(|_| [0; 2].map(|_| value())).collect(),
        ground_stderr: Vec::new(),
        seen_sky: (0..views).map(|_| value()).collect(),
        near_sky: (0..views).map(|_| value()).collect(),
    }
}

#[test]
fn lookups_are_those_of_the_oracle_within_half_floats_and_filters() {
    let gpu = device::open();
    for (n, m) in [(4, 2), (5, 3), (16, 8)] {
        let all: Vec<ForestTables> = (0..3).map(|k| random(7 + k, (n, m), 0.5 + k as f32)).collect();
        let (pairs, views) = described_tables(3, n, m);
        let data = TableData::new(&gpu, (Some(pairs), &views), &all.iter().collect::<Vec<_>>()).unwrap();
        let mut stream = Stream::new(n);
        let mut cases = Vec::new();
        for k in 0..4000u32 {
            // Between the nodes, on them, and beyond the ends.
            let mut at = |end: f64| match k % 4 {
                0 => end * f64::from(stream.bits() % n) / f64::from(n - 1),
                1 => [-0.1, 0.0, end, end + 0.03][(stream.bits() % 4) as usize],
                _ => end * stream.unit(),
            };
            let (v, phi, x) = (at(tables::THETA_MAX), at(PI).max(0.0), at(1.2));
            let l = if k % 5 == 0 { v } else { at(tables::THETA_MAX) };
            cases.push((v, l, phi, x, (k % 3) as usize));
        }
        let places: Vec<[f32; 8]> = cases
            .iter()
            .map(|&(v, l, phi, x, s)| {
                let (n, m, end) = (n as usize, m as usize, f64::from(all[s].max_thickness));
                let at = [
                    tables::azimuth_coordinate(n, phi),
                    tables::light_coordinate(n, v, l),
                    tables::zenith_coordinate(n, v),
                    tables::density_coordinate(m, end, x),
                ]
                .map(|c| c as f32);
                [at[0], at[1], at[2], at[3], s as f32, 0.0, 0.0, 0.0]
            })
            .collect();
        let buffer = gpu.buffer_with("places", &places).unwrap();
        let found: Vec<[[f32; 4]; 3]> = dispatch(
            &gpu,
            &shaders::PROBE_TABLES_COMP,
            &[("TABLE_ANGLES", (n as f32).to_bits()), ("TABLE_DENSITIES", (m as f32).to_bits())],
            &[
                ("places", Resource::Buffer(&buffer)),
                ("pair_table", Resource::Texture(&data.pairs, Sampler::Linear)),
                ("view_table", Resource::Texture(&data.views, Sampler::Linear)),
            ],
            places.len(),
            &[],
        );
        let mut worst = Worst::default();
        for (&(v, l, phi, x, s), got) in cases.iter().zip(&found) {
            let t = &all[s];
            let [pair, view, ground] = got.map(|g| g.map(f64::from));
            let (p, w, g) = (
                tables::pair(t, v, l, phi, x),
                tables::view(t, v, x),
                [
                    tables::seen_sky(t, v, x),
                    tables::ground(t, x)[1],
                    tables::near_sky(t, v, x),
                    tables::ground(t, x)[0],
                ],
            );
            let wants = p.iter().zip(&pair).chain(w.iter().zip(&view)).chain(g.iter().zip(&ground));
            for (want, got) in wants {
                worst.note((got - want).abs(), || {
                    format!("{n} x {m}, {v} {l} {phi} {x} of {s}: {got} {want}")
                });
            }
        }
        // Half floats of values up to 1.5: half a step of 2^-10. Filters weigh in steps of 2^-8, which is what devices for
        // whose images this is made have: half of that off along each of three axes between values up to 1.5 apart.
        worst.within(1.5 / 2048.0 + 3.0 * 1.5 / 512.0, "values");
    }
    gpu.close().unwrap();
}
