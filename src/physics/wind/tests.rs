use super::*;
use crate::physics::hash::{Stream, hash2};

fn wind(speed: f64) -> Wind {
    Wind { speed, azimuth: 240.0, gustiness: 0.7 }
}

/// Seconds over the whole period, of which each frequency has a whole number of sines.
fn period() -> impl Iterator<Item = f64> {
    (0..4096).map(|k| PERIOD * f64::from(k) / 4096.0)
}

#[test]
fn no_shear_exceeds_its_bound_and_no_speed_is_too_great() {
    let mut stream = Stream::new(1);
    for speed in [1e-9, 0.1, 3.0, 20.0, 100.0, 1e6, 1e300] {
        let w = Wind { gustiness: 0.5 + 0.5 * stream.unit(), ..wind(speed) };
        assert!(w.shear() <= MOST_SHEAR && w.shear() >= 0.0);
        let mut most: f64 = 0.0;
        for _ in 0..3000 {
            let t = 1e4 * stream.unit();
            let (m, x) = (w.at(t), [3e3 * stream.unit(), 3e3 * stream.unit()]);
            let s = m.sway(m.gusts(m.waves, x), 0.1 + 50.0 * stream.unit(), stream.bits());
            most = most.max(s[0].hypot(s[1]));
        }
        assert!(most <= w.shear() * (1.0 + 1e-9), "{speed}: {most}");
        assert!(speed < 1.0 || most > 0.5 * w.shear(), "the bound is of the order of what there is: {most}");
    }
}

#[test]
fn what_is_moved_stays_within_reach() {
    let mut stream = Stream::new(2);
    let w = wind(15.0);
    for k in 0..2000 {
        let m = w.at(100.0 * stream.unit());
        let [height, radius, centre] = [12.0, 5.0, 6.5];
        let a = TAU * stream.unit();
        let p = [radius * a.cos(), radius * a.sin(), (height - centre) * (2.0 * stream.unit() - 1.0)];
        let d = m.branch(p, k % 256);
        let s = m.sway(1.0, height, stream.bits());
        let above = p[2] + d[2] + centre;
        let moved = [d[0] + s[0] * above, d[1] + s[1] * above, d[2]];
        let leaf = w.flutter() * LEAF_REACH * radius;
        let by = moved.iter().map(|v| v * v).sum::<f64>().sqrt();
        assert!(by + leaf <= w.reach(height, radius), "{by}");
    }
}

#[test]
fn every_motion_has_no_mean() {
    let w = wind(12.0);
    let mean = |of: &dyn Fn(Motion) -> f64| period().map(|t| of(w.at(t))).sum::<f64>() / 4096.0;
    for k in 0..20 {
        let hash = hash2(3, k);
        // What gusts do has other periods.
        for axis in 0..2 {
            assert!(mean(&|m| m.sway(0.0, 3.0 + f64::from(k), hash)[axis]).abs() < 1e-9);
        }
        assert!(mean(&|m| m.flutter(hash)).abs() < 1e-9);
        for axis in 0..3 {
            assert!(mean(&|m| m.branch([1.0 + f64::from(k), -2.0, 3.0], k)[axis]).abs() < 1e-9);
        }
    }
    // Each wave, over its own.
    let gusts = |t: f64| w.at(t).gusts(w.at(t).waves, [17.0, 5.0]);
    let long = (0..200_000).map(|k| gusts(0.5 * f64::from(k))).sum::<f64>() / 200_000.0;
    assert!(long.abs() < 1e-3, "{long}");
}

#[test]
fn a_leafs_mean_normal_is_its_rest_normal() {
    let w = wind(25.0);
    for k in 0..50u32 {
        let mut stream = Stream::new(k);
        let mut unit = || {
            let (z, a) = (2.0 * stream.unit() - 1.0, TAU * stream.unit());
            [(1.0 - z * z).sqrt() * a.cos(), (1.0 - z * z).sqrt() * a.sin(), z]
        };
        let (axis, other) = (unit(), unit());
        // A normal across the axis.
        let across = [
            axis[1] * other[2] - axis[2] * other[1],
            axis[2] * other[0] - axis[0] * other[2],
            axis[0] * other[1] - axis[1] * other[0],
        ];
        let length = across.iter().map(|v| v * v).sum::<f64>().sqrt();
        let normal = across.map(|v| v / length);
        let mut sum = [0.0; 3];
        let mut swing: f64 = 0.0;
        for t in period() {
            let angle = w.at(t).flutter(hash2(4, k));
            swing = swing.max(angle.abs());
            let n = turned(normal, axis, angle);
            (0..3).for_each(|i| sum[i] += n[i] / 4096.0);
        }
        assert!(swing > 0.3, "{swing}");
        let length = sum.iter().map(|v| v * v).sum::<f64>().sqrt();
        // J0 of the largest angle is what is left of its length.
        assert!(length > 0.85 && length < 0.99, "{length}");
        for i in 0..3 {
            assert!((sum[i] / length - normal[i]).abs() < 1e-9, "{sum:?} {normal:?}");
        }
    }
}

#[test]
fn gusts_travel_with_the_wind_and_time_is_exact_however_late() {
    let w = wind(9.0);
    let (x, t) = ([40.0, -70.0], 3.7);
    let ahead = w.toward().map(|v| v * 9.0 * t);
    let (now, then) = (w.at(0.0), w.at(t));
    let moved = [x[0] + ahead[0], x[1] + ahead[1]];
    assert!((now.gusts(now.waves, x) - then.gusts(then.waves, moved)).abs() < 1e-9);
    assert!((then.gusts(then.phases_at(x), [0.0; 2]) - then.gusts(then.waves, x)).abs() < 1e-9);
    // Blowing from the west it blows to the east.
    let west = Wind { azimuth: 270.0, ..w }.toward();
    assert!((west[0] - 1.0).abs() < 1e-12 && west[1].abs() < 1e-12);
    for late in [1e6, 1e9, -1e9, -0.25] {
        let (a, b) = (w.at(late), w.at(late + PERIOD));
        assert_eq!(a.clock, b.clock);
        let step = w.at(late + 1e-3).flutter(77) - a.flutter(77);
        assert!(step.abs() < 0.6 * TAU * 6.0 * 1.1e-3, "{late}: {step}");
    }
    let end = w.at(f64::MAX);
    assert!(end.waves.iter().all(|v| (0.0..=1.0).contains(v)));
    let phases = w.place_phases(x);
    for (k, p) in now.phases_at(x).into_iter().enumerate() {
        let packed = f64::from(phases >> (10 * k) & 1023) / 1024.0;
        assert!(((packed - p + 0.5).rem_euclid(1.0) - 0.5).abs() <= 0.5 / 1024.0 + 1e-9);
    }
}

#[test]
fn shears_are_packed_to_a_step_and_none_is_no_bits() {
    assert_eq!(pack_sway([0.0; 2]), 0);
    let mut stream = Stream::new(5);
    for _ in 0..1000 {
        let s = [0, 1].map(|_| MOST_SHEAR * (2.0 * stream.unit() - 1.0));
        let word = pack_sway(s);
        assert_eq!(word & 15, 0);
        let back = unpack_sway(word | 7);
        assert!((0..2).all(|i| (back[i] - s[i]).abs() <= 0.5001 * MOST_SHEAR / 8191.0), "{s:?} {back:?}");
    }
    assert_eq!(unpack_sway(pack_sway([1.0, -1.0])), [MOST_SHEAR, -MOST_SHEAR]);
}

#[test]
fn tall_trees_sway_slowly() {
    assert!(
        natural_frequency(10.0) > natural_frequency(20.0)
            && natural_frequency(20.0) > natural_frequency(40.0)
    );
    assert!((natural_frequency(20.0) - 0.311).abs() < 1e-3);
    assert!(natural_frequency(0.0) <= 4.0);
}
