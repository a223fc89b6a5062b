//! Spherical harmonics, and the terms of what they leave out of the sun, on the device against their twins in f64.

use canopy::physics::{correction, harmonics};

use crate::device::{self, Function, Worst, evaluate, float, words};

/// Directions all over, with axes, poles and those at right angles to them.
fn directions() -> Vec<[f32; 3]> {
    let turns = (0..=24).flat_map(|k| (0..48).map(move |j| (7.5 * f64::from(k), 7.5 * f64::from(j))));
    let at = |(polar, turn): (f64, f64)| {
        let ((s, c), (sin, cos)) = (polar.to_radians().sin_cos(), turn.to_radians().sin_cos());
        [s * cos, s * sin, c].map(|x| x as f32)
    };
    let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [0.0, -1.0, 0.0]];
    turns.map(at).chain(axes).collect()
}

#[test]
fn harmonics_are_those_of_the_oracle() {
    let gpu = device::open();
    let directions = directions();
    let mut worst = Worst::default();
    for first in [0u32, 8] {
        let arguments: Vec<_> = directions
            .iter()
            .map(|w| {
                let mut words = words(w);
                words[3] = first;
                words
            })
            .collect();
        for (w, out) in directions.iter().zip(evaluate(&gpu, Function::Harmonics, &arguments)) {
            let want = harmonics::evaluate(w.map(f64::from));
            for k in 0..8 {
                let want = want[first as usize + k];
                worst.note((float(&out, k) - want).abs(), || format!("{} {w:?}", first as usize + k));
            }
        }
    }
    // Constants of eight digits, and five roundings of numbers of at most 3: 2e-6.
    worst.within(1e-5, "harmonics");
}

#[test]
fn terms_of_the_phase_angle_are_those_of_the_oracle() {
    let gpu = device::open();
    let angles = (0..=180).map(|k| std::f32::consts::PI * k as f32 / 180.0);
    let inputs: Vec<[f32; 3]> =
        angles.flat_map(|a| [[0.3, 0.7, a], [-0.5, 0.2, a], [0.9, -0.1, a]]).collect();
    let arguments: Vec<_> = inputs.iter().map(|i| words(i)).collect();
    let mut worst = Worst::default();
    for (input, out) in inputs.iter().zip(evaluate(&gpu, Function::PhaseTerms, &arguments)) {
        let [view, sun, angle] = input.map(f64::from);
        for (k, want) in correction::phase_terms(view, sun, angle).into_iter().enumerate() {
            worst.note((float(&out, k) - want).abs(), || format!("{k} {input:?}"));
        }
    }
    // A square root, and a difference of numbers of up to 5, each of a few roundings of 5: 1e-6.
    worst.within(5e-6, "terms");
}
