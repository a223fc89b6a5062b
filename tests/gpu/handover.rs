//! The hand-over from trees to the shader-map, against its twin in f64.

use crate::device::{self, Arguments, Function, Worst, evaluate, float, words};
use canopy::physics::handover;

/// Relative rounding of a single operation.
const EPS: f64 = 6e-8;

#[test]
fn trees_fade_and_the_shader_map_takes_over_as_the_oracle_says() {
    let gpu = device::open();
    let mut cases: Vec<[f32; 3]> = Vec::new();
    let distances =
        (0..=300).map(|k| k as f32 / 200.0).chain([1e-30, 0.799_999_9, 0.8, 1.0, 1.000_000_1, 1e6, 1e30]);
    for (k, relative) in distances.enumerate() {
        let end = [0.1, 0.5, 0.6, 0.8, 0.0][k % 5];
        cases.extend([0.0, 0.3, 0.5, 0.999_999_94].map(|u| [relative, end, u]));
    }
    let arguments: Vec<Arguments> = cases.iter().map(|c| words(c)).collect();
    let (mut nu, mut over, mut fade) = (Worst::default(), Worst::default(), Worst::default());
    for (c, out) in cases.iter().zip(evaluate(&gpu, Function::Handover, &arguments)) {
        let [relative, end, u] = c.map(f64::from);
        nu.note((float(&out, 0) - handover::converged(relative, end)).abs(), || format!("{c:?}"));
        over.note((float(&out, 1) - handover::handed_over(relative)).abs(), || format!("{c:?}"));
        fade.note((float(&out, 2) - handover::tree_fade(relative, u)).abs(), || format!("{c:?}"));
        assert!((0..3).all(|k| (0.0..=1.0).contains(&float(&out, k))), "{c:?} {out:?}");
    }
    // t to 2.5 ulp, times the largest slope 1.5, and four operations on numbers up to 3.
    nu.within(16.0 * EPS, "converged");
    // 0.8 and a difference to an ulp of 1, times 5, times the largest slope 2.
    over.within(24.0 * EPS, "handed over");
    // Four roundings of numbers up to 1, times 10.
    fade.within(40.0 * EPS, "fade of a tree");
    gpu.close().unwrap();
}

#[test]
fn ground_between_trees_is_as_open_as_the_oracle_says() {
    let gpu = device::open();
    let mut cases: Vec<[f32; 4]> = Vec::new();
    for thickness in [0.0, 1e-30, 1e-4, 0.1, 0.7, 3.0, 30.0, 90.0, 1e4] {
        for over in [0.0, 1e-12, 0.3, 0.9, 1.0] {
            for coverage in [0.0, 1e-6, 0.3, 0.9, 0.999, 0.999_999_9, 1.0] {
                cases.extend(
                    [0.0, 1e-6, 0.3, 0.9, 63.0 / 64.0, 0.999_999_9, 1.0]
                        .map(|e| [thickness, over, coverage, e]),
                );
            }
        }
    }
    let arguments: Vec<Arguments> =
        cases.iter().map(|c| words(&[0.0, 1.0, 0.0, 0.0, c[0], c[1], c[2], c[3]])).collect();
    let mut worst = Worst::default();
    for (c, out) in cases.iter().zip(evaluate(&gpu, Function::Handover, &arguments)) {
        let [thickness, over, coverage, expected] = c.map(f64::from);
        let (got, want) = (float(&out, 3), handover::open_ground(thickness, over, coverage, expected));
        assert!((0.0..=1.0).contains(&got), "{c:?}: {got}");
        // exp to (3 + 2x) ulp; the gap over the expected gap (up to 64) to a difference, a division of 2.5 ulp, four
        // products of the share and the mix: twenty roundings.
        let gap = (expected - coverage).abs() / (1.0 - expected).max(1.0 / 64.0);
        let room = EPS * (-thickness).exp() * (1.0 + gap) * (20.0 + 2.0 * (3.0 + 2.0 * thickness)) + 1e-37;
        worst.note((got - want).abs() / room, || format!("{c:?}: {got} {want}"));
        // Where discs are all that is seen, no ground shows in a disc; unless they leave less than can be told, and where
        // nothing can be told of them, all that is left does.
        assert!(over < 1.0 || coverage < 1.0 || expected > 63.0 / 64.0 || got < 6.0 * EPS, "{c:?}: {got}");
        assert!(coverage != expected || (got - (-thickness).exp()).abs() <= room, "{c:?}: {got}");
    }
    worst.within(1.0, "open ground");
    gpu.close().unwrap();
}

#[test]
fn the_average_light_comes_in_as_the_oracle_says_from_a_centimetre_to_a_thousand_kilometres() {
    let gpu = device::open();
    let mut cases: Vec<[f32; 3]> = Vec::new();
    for k in 0..=160 {
        let distance = 10f32.powf(-2.0 + 0.05 * k as f32);
        cases.extend([0.1, 30.0, 3000.0, 1e15].map(|range| [distance / range, 0.45, 0.5]));
    }
    let arguments: Vec<Arguments> = cases.iter().map(|c| words(c)).collect();
    let mut worst = Worst::default();
    for (c, out) in cases.iter().zip(evaluate(&gpu, Function::Handover, &arguments)) {
        let (got, want) = (float(&out, 0), handover::converged(f64::from(c[0]), f64::from(c[1])));
        // Relative, however small: twice a division of 2.5 ulp, and four operations. Squares of less than 1e-19 vanish.
        worst.note((got - want).abs() / (want * 16.0 * EPS + 1.2e-38), || format!("{c:?}: {got} {want}"));
    }
    worst.within(1.0, "share of the average");
    gpu.close().unwrap();
}
