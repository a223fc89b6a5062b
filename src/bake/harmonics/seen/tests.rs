//! The sun on what is seen, against rays that nothing was fitted to, and against a closed form.

use std::f64::consts::{PI, TAU};

use super::*;
use crate::bake::harmonics::{tests::ball, transfers};
use crate::physics::correction::at;

/// Bins of the phase angle.
const BINS: usize = 8;

/// A viewer and a sun above the horizon; all phase angles are as many, but those that no viewer has, who is never nearer the horizon than 2.7°.
fn even(stream: &mut Stream) -> (DVec3, [DVec3; 1]) {
    let angle = 0.95 * PI * stream.unit();
    loop {
        let view = direction(stream);
        let (a, b) = view.any_orthonormal_pair();
        let (s, c) = (TAU * stream.unit()).sin_cos();
        let sun = view * angle.cos() + (a * c + b * s) * angle.sin();
        if sun.z > 0.0 {
            return (view, [sun]);
        }
    }
}

/// Of each bin how many samples there are, and sums over both sides: what there is, what harmonics say, and that corrected.
fn bins(samples: &[Sample], seen: &Corrections) -> [[f64; 4]; BINS] {
    let mut sums = [[0.0; 4]; BINS];
    for s in samples {
        let sum = &mut sums[((s.angle / PI * BINS as f64) as usize).min(BINS - 1)];
        sum[0] += 1.0;
        for (part, correction) in seen.iter().enumerate() {
            let line = correction.line(&phase_terms(s.up[0], s.up[1], s.angle), 1.0);
            sum[1] += s.truth[part];
            sum[2] += s.said[part];
            sum[3] += at(line, s.height) * s.said[part];
        }
    }
    sums
}

#[test]
fn what_is_seen_of_trees_has_the_sun_that_it_has() {
    for name in ["builtin:oak", "builtin:birch", "tests/data/oak.glb", "tests/data/pine.glb"] {
        let mesh = crate::scene::model::load_named(std::path::Path::new(name), None).unwrap();
        let surface = Surface::new(&mesh).unwrap();
        let faces = transfers(&mesh, &surface, true);
        let seen = measure(&mesh, &surface, &faces);
        // Other viewers and other suns than those it was fitted to.
        let model = Model::new(&mesh, &surface, &faces);
        let other: Vec<Sample> = (77..81).flat_map(|seed| model.samples(seed, even)).collect();
        let found = bins(&other, &seen);
        let [raw, corrected] = [2, 3].map(|k| found.map(|b| b[k] / b[1]));
        println!("{name}: {raw:.3?} {corrected:.3?}, {:?}", found.map(|b| b[0]));
        assert!(found.iter().all(|b| b[0] > 10_000.0), "{name}: {found:?}");
        assert!(corrected.iter().all(|r| (r - 1.0).abs() < 0.05), "{name}: {corrected:.3?}");
        // Without, the sun behind the viewer is a third short.
        assert!(raw[0] < 0.75, "{name}: {raw:.3?}");
    }
}

/// Of a convex ball all that faces viewer and sun is lit: the mean over what is seen of max(n·l, 0) is ((π − α) cos α + sin α) 2/(3π), and
/// three bands of that (Funk and Hecke; A_l as in [`crate::physics::harmonics::clamped_cosine`]) are Σ A_l² (2l + 1)/(4π) P_l(cos α) / π: they leave
/// nothing for corrections to do, half a per cent at most, until next to nothing is lit.
#[test]
fn a_ball_needs_no_correction() {
    let mesh = ball();
    let surface = Surface::new(&mesh).unwrap();
    let faces = transfers(&mesh, &surface, true);
    let seen = measure(&mesh, &surface, &faces);
    for (k, [count, truth, said, corrected]) in
        bins(&Model::new(&mesh, &surface, &faces).samples(5, even), &seen).into_iter().enumerate().take(6)
    {
        let (mut want, mut banded) = (0.0, 0.0);
        for j in 0..64 {
            let angle = PI * (k as f64 + (f64::from(j) + 0.5) / 64.0) / BINS as f64;
            let c = angle.cos();
            want += 2.0 / (3.0 * PI) * ((PI - angle) * c + angle.sin()) / 64.0;
            banded += (0.25 + c / 3.0 + 5.0 / 128.0 * (3.0 * c * c - 1.0)) / 64.0;
        }
        // Some ten thousand samples of at most 1, and the ball's 32 sides; harmonics of 64 rays are off by 2/64 at a face, as often up as down,
        // and nowhere below nothing.
        assert!((truth / count - want).abs() < 0.01, "{k}: {} {want}", truth / count);
        // From 112° on the ringing that is cut off counts: up to 0.04 of places that are turned away from the sun.
        assert!(k > 4 || (said / count - banded).abs() < 0.01, "{k}: {} {banded}", said / count);
        assert!((corrected / count - want).abs() < 0.01, "{k}: {} {want}", corrected / count);
    }
}

#[test]
fn any_number_of_threads_measures_the_same() {
    let mesh = ball();
    let surface = Surface::new(&mesh).unwrap();
    let faces = transfers(&mesh, &surface, true);
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| measure(&mesh, &surface, &faces))
    };
    assert!(on(1) == on(3));
}
