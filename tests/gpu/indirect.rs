//! Light that met more than one surface, against its twin in f64.

use crate::device::{self, Worst};
use canopy::gpu::{Resource, shaders};
use canopy::physics::hash::Stream;
use canopy::physics::indirect::{Angles, COEFFICIENTS, GROUND, Indirect};
use canopy::plan::NODE_TEXELS;

/// Nodes with coefficients of the sizes that bakes have: those of z and of angles a few tenths of the first.
fn light(stream: &mut Stream) -> Indirect {
    let row = |stream: &mut Stream, base: f64| [0; 3].map(|_| (base + 0.3 * (stream.unit() - 0.5)) as f32);
    // What is in front stands alone in each group.
    let firsts = [0, 15, 36, 46, 49, 52];
    let node = |stream: &mut Stream| {
        std::array::from_fn(|i: usize| {
            row(stream, if firsts.contains(&i) || (20..36).contains(&i) { 1.0 } else { 0.0 })
        })
    };
    let nodes: Vec<[[f32; 3]; COEFFICIENTS]> = (0..8).map(|_| node(stream)).collect();
    Indirect { max_thickness: 0.8, nodes }
}

#[test]
fn light_between_leaves_is_what_the_oracle_says() {
    let gpu = device::open();
    let mut stream = Stream::new(17);
    let indirect = light(&mut stream);
    let split = COEFFICIENTS - GROUND;
    let rows = |of: std::ops::Range<usize>| {
        indirect.nodes.iter().flat_map(move |n| n[of.clone()].to_vec()).map(|[r, g, b]| [r, g, b, 0.0])
    };
    let mut texels: Vec<[f32; 4]> = rows(split..COEFFICIENTS).chain(rows(0..split)).collect();
    texels[0][3] = indirect.max_thickness;
    let buffer = gpu.texel_buffer("nodes", 16 * texels.len() as u64, NODE_TEXELS).unwrap();
    gpu.upload(&buffer, 0, &texels).unwrap();
    let cases: Vec<[f32; 8]> = (0..512)
        .map(|k| {
            let mut u = || stream.unit() as f32;
            // No crowns, as many as the last node has, more, and between; from straight above and below, along the ground.
            let x = [0.0, 0.8, 5.0, 0.8 * u()][k % 4];
            let v = [1.0, -1.0, 0.0, 2.0 * u() - 1.0][k / 4 % 4];
            [x, v, u(), 2.0 * u() - 1.0, 2.2 * u() - 1.1, 0.0, 0.0, 0.0]
        })
        .collect();
    let inputs = gpu.buffer_with("cases", &cases.concat()).unwrap();
    let results: Vec<[[f32; 4]; 6]> = device::dispatch(
        &gpu,
        &shaders::PROBE_INDIRECT_COMP,
        &[("NODES", 8)],
        &[("cases", Resource::Buffer(&inputs)), ("nodes", Resource::Texels(&buffer))],
        cases.len(),
        &[],
    );
    drop((inputs, buffer));
    let (mut packed, mut whole) = (Worst::default(), Worst::default());
    for (case, got) in cases.iter().zip(results) {
        let [x, view, sun, between, z] = [0, 1, 2, 3, 4].map(|k| f64::from(case[k]));
        let angles = Angles { view, sun, between };
        let [of_sun, of_sky] = indirect.near(x, angles);
        let ([far_sun, far_sky], [ground_sun, ground_sky]) =
            (indirect.far(x, angles), indirect.ground(x, sun));
        for c in 0..3 {
            for (k, handed) in [of_sun, of_sky].into_iter().enumerate() {
                // Relative to the brightest channel at this height: the colour has 9 bits of it.
                let largest = handed.at(z).into_iter().fold(0.1, f64::max);
                packed.note((f64::from(got[k][c]) - handed.at(z)[c]).abs() / largest, || {
                    format!("near {k} {c} {case:?}: {} {:?}", got[k][c], handed.at(z))
                });
            }
            for (k, want) in [far_sun, far_sky, ground_sun, ground_sky].into_iter().enumerate() {
                whole.note((f64::from(got[2 + k][c]) - want[c]).abs(), || {
                    format!("far {k} {c} {case:?}: {} {want:?}", got[2 + k][c])
                });
            }
        }
        let open = indirect.open(x, view).at(z);
        packed.note((f64::from(got[1][3]) - open).abs() / open.max(0.1), || {
            format!("open {case:?}: {} {open}", got[1][3])
        });
    }
    // Half a step of 9 bits, of which the largest channel has at least 8 in use, is 0.2 % of it; profiles' halves have 11 bits, and where they fall to
    // a fifth of the colour that is as much again.
    packed.within(6e-3, "near trees");
    // Sums of up to ten terms near 1, each with a few roundings.
    whole.within(1e-5, "far trees and the ground");
    gpu.close().unwrap();
}
