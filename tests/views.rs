//! The lookup of stored views: weights, continuity, layers.

use canopy::physics::views::{self, Basis};
use glam::DVec3;
use proptest::prelude::*;

/// Weight of every stored view in a direction.
fn weights(n: u32, w: DVec3) -> Vec<f64> {
    let mut all = vec![0.0; views::count(n) as usize];
    for v in views::lookup(n, w).views {
        assert!(v.i.abs() + v.j.abs() <= n as i32, "no such view: {v:?} for {w}");
        assert!((0.0..=1.0).contains(&v.weight), "{v:?} for {w}");
        all[views::layer(n, v.i, v.j) as usize] += v.weight;
    }
    let sum: f64 = all.iter().sum();
    assert!((sum - 1.0).abs() < 1e-12, "weights sum to {sum} for {w}");
    all
}

fn direction(zenith: f64, azimuth: f64) -> DVec3 {
    let ((st, ct), (sa, ca)) = (zenith.to_radians().sin_cos(), azimuth.to_radians().sin_cos());
    DVec3::new(st * ca, st * sa, ct)
}

#[test]
fn layers_are_a_bijection() {
    assert_eq!(views::count(9), 181);
    for n in 1..=16 {
        let layers: Vec<u32> = views::pairs(n).map(|(i, j)| views::layer(n, i, j)).collect();
        assert_eq!(layers, (0..views::count(n)).collect::<Vec<_>>(), "n = {n}");
    }
}

#[test]
fn a_stored_direction_finds_its_view() {
    for n in [1, 2, 9, 16] {
        for (i, j) in views::pairs(n) {
            let w = views::direction(n, i, j);
            let own = weights(n, DVec3::new(w.x, w.y, w.z.max(0.0)))[views::layer(n, i, j) as usize];
            assert!((own - 1.0).abs() < 1e-9, "({i}, {j}) of {n}: {own}");
        }
    }
}

#[test]
fn rings_are_ten_degrees_apart_with_4k_views() {
    for k in 0..=9u32 {
        let ring = views::pairs(9)
            .filter(|&(i, j)| {
                (views::angles(views::direction(9, i, j)).0.to_degrees() - 10.0 * k as f64).abs() < 1e-9
            })
            .count();
        assert_eq!(ring as u32, (4 * k).max(1), "ring {k}");
    }
}

/// Weights change no faster than the layout allows: over a step of ε degrees by a bounded multiple of ε,
/// through the vertical, across the axes and diagonals, and up to the horizon.
#[test]
fn weights_are_continuous_over_the_hemisphere() {
    let n = 9;
    let step = 0.01;
    let largest = |paths: &mut dyn Iterator<Item = DVec3>| {
        let mut before: Option<Vec<f64>> = None;
        let mut jump: f64 = 0.0;
        for w in paths {
            let now = weights(n, w);
            if let Some(b) = &before {
                jump = now.iter().zip(b).map(|(x, y)| (x - y).abs()).fold(jump, f64::max);
            }
            before = Some(now);
        }
        jump
    };
    // A step of 0.01° along a meridian is 0.001 rings.
    for azimuth in (0..3600).step_by(25) {
        let azimuth = azimuth as f64 / 10.0;
        let jump = largest(&mut (0..=9000).map(|k| direction(k as f64 * step, azimuth)));
        assert!(jump < 0.003, "meridian {azimuth}: {jump}");
    }
    // Along a parallel a quarter turn passes n views of the outermost ring: at most 0.4 views a degree.
    for zenith in [0.0, 1e-9, 1e-3, 0.5, 10.0, 44.9, 45.0, 60.0, 80.0, 89.999_999, 90.0 - 1e-13] {
        let jump = largest(&mut (0..=36000).map(|k| direction(zenith, k as f64 * step)));
        assert!(jump < 0.005, "parallel {zenith}: {jump}");
    }
}

#[test]
fn from_below_the_opposite_views_are_used() {
    let w = direction(50.0, 77.0);
    let (above, below) = (views::lookup(9, w), views::lookup(9, -w));
    assert!(!above.below && below.below);
    assert_eq!(above.views, below.views);
    for w in [DVec3::Z, -DVec3::Z, DVec3::X, -DVec3::X, DVec3::Y * 1e-300, DVec3::new(-1e200, 1e200, 1.0)] {
        weights(9, w);
    }
}

proptest! {
    #[test]
    fn weights_are_valid_everywhere(x in -1.0..1.0f64, y in -1.0..1.0f64, z in -1.0..1.0f64, n in 1u32..=16) {
        let w = DVec3::new(x, y, z);
        prop_assume!(w.length() > 1e-6);
        weights(n, w);
    }

    #[test]
    fn bases_are_orthonormal_and_right_handed(zenith in 0.0..90.0f64, azimuth in -180.0..180.0f64) {
        let b = Basis::new(direction(zenith, azimuth) * 3.0);
        prop_assert!((b.right.cross(b.up) - b.w).length() < 1e-12);
        prop_assert!((b.w - direction(zenith, azimuth)).length() < 1e-12);
        // The cylinder's rim stays within the image.
        for k in 0..360 {
            let (s, c) = (k as f64).to_radians().sin_cos();
            for z in [-1.0, 1.0] {
                prop_assert!(DVec3::new(c, s, z).dot(b.up).abs() <= b.extent + 1e-12);
            }
        }
    }
}
