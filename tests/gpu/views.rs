//! The lookup of stored views on the device: weights, layers, continuity.

use crate::device::{self, Arguments, Function, Worst, evaluate, float, words};
use canopy::gpu::Gpu;
use canopy::physics::views;
use glam::DVec3;

/// Of a weight against the oracle: weights are sums of |i| and |j| of the view plane, n m / 2 (1 ± t) with m <= 1 from
/// atan (4096 ulp in Vulkan) and a ratio t (a few ulp): at most 2 n 4096 ulp.
fn bound(n: u32) -> f64 {
    2.0 * f64::from(n) * 4096.0 * 1.2e-7
}

fn direction(zenith: f64, azimuth: f64) -> DVec3 {
    let ((st, ct), (sa, ca)) = (zenith.to_radians().sin_cos(), azimuth.to_radians().sin_cos());
    DVec3::new(st * ca, st * sa, ct)
}

/// Weight of every view, in each direction, as the device says; the directions are rounded to what it gets.
fn weights(gpu: &Gpu, n: u32, directions: &mut [DVec3]) -> Vec<Vec<f64>> {
    let arguments: Vec<Arguments> = directions
        .iter_mut()
        .map(|w| {
            let f = w.as_vec3();
            *w = f.as_dvec3();
            let mut a = words(&[f.x, f.y, f.z]);
            a[3] = n;
            a
        })
        .collect();
    let outcomes = evaluate(gpu, Function::ViewLookup, &arguments);
    let table = |(out, w): (&[u32; 8], &DVec3)| {
        let mut all = vec![0.0; views::count(n) as usize];
        let mut sum = 0.0;
        for k in 0..3 {
            let weight = float(out, 4 + k);
            assert!((0.0..=1.0).contains(&weight), "weight {weight} for {w} of {n}");
            all[out[k] as usize] += weight;
            sum += weight;
        }
        // Three roundings of numbers up to 1.
        assert!((sum - 1.0).abs() <= 4.0 * 6e-8, "weights sum to {sum} for {w} of {n}");
        all
    };
    outcomes.iter().zip(directions.iter()).map(table).collect()
}

fn oracle(n: u32, w: DVec3) -> Vec<f64> {
    let mut all = vec![0.0; views::count(n) as usize];
    for v in views::lookup(n, w).views {
        all[views::layer(n, v.i, v.j) as usize] += v.weight;
    }
    all
}

fn difference(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max)
}

#[test]
fn views_and_weights_are_those_of_the_oracle() {
    let gpu = device::open();
    for n in [1, 2, 6, 9, 16] {
        let mut all: Vec<DVec3> = views::pairs(n)
            .map(|(i, j)| views::direction(n, i, j))
            .map(|w| DVec3::new(w.x, w.y, w.z.max(0.0)))
            .collect();
        for z in 0..=90 {
            for a in 0..72 {
                all.push(direction(f64::from(z), f64::from(a) * 5.0).max(DVec3::new(-2.0, -2.0, 0.0)));
                all.push(direction(f64::from(z) * 0.999 + 0.017, f64::from(a) * 5.0 + 1.3));
            }
        }
        // Axes, the zenith and the horizon exactly and nearly, signed zeros, and lengths that are not 1.
        for tiny in [0.0f64, 1e-30, 1e-12, 1e-6] {
            for (x, y) in [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0), (0.7, 0.7), (-0.6, 0.6)] {
                all.extend([
                    DVec3::new(x, y, tiny),
                    DVec3::new(x * tiny, y * tiny, 1.0),
                    DVec3::new(x, y + tiny, 0.3),
                ]);
            }
        }
        all.extend([DVec3::new(-0.0, -0.0, 1.0), DVec3::new(-0.0, 1.0, 0.0), DVec3::new(1.0, -0.0, 0.0)]);
        for length in [1e-3, 0.02, 50.0, 1e4] {
            all.extend([direction(33.0, 21.0) * length, direction(89.0, 251.0) * length]);
        }
        let found = weights(&gpu, n, &mut all);
        let mut worst = Worst::default();
        for (w, got) in all.iter().zip(&found) {
            worst.note(difference(got, &oracle(n, *w)), || format!("{w} of {n} rings"));
        }
        worst.within(bound(n), "view weights");
    }
    gpu.close().unwrap();
}

#[test]
fn layers_are_those_of_the_oracle() {
    let gpu = device::open();
    for n in [1u32, 2, 9, 16] {
        let pairs: Vec<_> = views::pairs(n).collect();
        let arguments: Vec<Arguments> =
            pairs.iter().map(|(i, j)| [*i as u32, *j as u32, n, 0, 0, 0, 0, 0, 0, 0, 0, 0]).collect();
        for ((i, j), out) in pairs.iter().zip(evaluate(&gpu, Function::ViewLayer, &arguments)) {
            assert_eq!(out[0], views::layer(n, *i, *j), "({i}, {j}) of {n}");
        }
    }
    gpu.close().unwrap();
}

/// Along meridians from the zenith to the horizon and parallels all around, through every border between cells.
#[test]
fn weights_are_continuous_over_the_hemisphere() {
    let gpu = device::open();
    let (n, step) = (9, 0.01);
    let mut worst = Worst::default();
    let mut walk = |mut path: Vec<DVec3>, per_step: f64, what: &str| {
        for w in &mut path {
            w.z = w.z.max(0.0);
        }
        for (k, pair) in weights(&gpu, n, &mut path).windows(2).enumerate() {
            // Beyond what the step allows, only rounding: the same bound as against the oracle, at both ends.
            let excess = difference(&pair[0], &pair[1]) - per_step;
            worst.note(excess, || format!("{what}, {} to {}", path[k], path[k + 1]));
        }
    };
    for azimuth in [0.0, 1e-5, 12.5, 44.99, 45.0, 90.0, 135.0, 180.0, 200.0, 270.0, 315.0, 359.999] {
        // 0.01 degrees are 0.001 rings, and a weight changes by at most two a ring.
        let path = (0..=9000).map(|k| direction(f64::from(k) * step, azimuth)).collect();
        walk(path, 0.002, &format!("meridian {azimuth}"));
    }
    for zenith in [1e-6, 1e-3, 0.5, 10.0, 45.0, 60.0, 89.999, 89.999_999, 90.0] {
        // A quarter turn passes n views of a ring of side m: a view changes by at most 1 over 1/(n m) of it times
        // 4/pi at the middle of a side; two weights change so.
        let path = (0..=36000).map(|k| direction(zenith, f64::from(k) * step)).collect();
        walk(path, 2.0 * 9.0 * step / 90.0 * 1.28, &format!("parallel {zenith}"));
    }
    worst.within(2.0 * bound(n), "jump of a weight");
    gpu.close().unwrap();
}
