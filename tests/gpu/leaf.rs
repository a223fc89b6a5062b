//! Light on a leaf by its envelope, against its twin in f64.

use crate::device::{self, Worst};
use canopy::gpu::{Resource, shaders};
use canopy::physics::hash::Stream;
use canopy::physics::leaf::{Directions, Leaf, Sun, hemisphere, scattering};

/// Relative rounding of a single operation.
const EPS: f64 = 6e-8;

/// A unit vector anywhere.
fn unit(stream: &mut Stream) -> [f64; 3] {
    let z = 2.0 * stream.unit() - 1.0;
    let (a, r) = (std::f64::consts::TAU * stream.unit(), (1.0 - z * z).sqrt());
    [r * a.cos(), r * a.sin(), z]
}

#[test]
fn leaves_get_the_light_that_the_oracle_says() {
    let gpu = device::open();
    let leaf = Leaf::uniform(0.3, 0.2);
    for count in Directions::COUNTS {
        let rule = Directions::new(count).unwrap();
        let above = rule.half(true);
        let block: Vec<[f32; 4]> = rule
            .to
            .iter()
            .zip(&rule.weights)
            .zip(&above)
            .flat_map(|((to, w), sky)| [[to[0], to[1], to[2], *w], [sky[0], sky[1], sky[2], 0.0]])
            .map(|row| row.map(|x| x as f32))
            .collect();
        let mut stream = Stream::new(count as u32);
        let mut cases = Vec::new();
        for k in 0..256 {
            let mut case = [0f32; 80];
            for j in 0..count {
                // Open, thick beyond what is left of single precision, and all between.
                case[j] = [0.0, 200.0, 6.0 * stream.unit() as f32][(k + j) % 3];
                case[26 + j] = if k % 5 == 0 { 1.0 } else { stream.unit() as f32 };
            }
            let vectors = match k {
                // Level, upright and edge-on leaves; the sun at the zenith, at the horizon and below.
                0 => [[0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [0.0, 0.0, 1.0]],
                1 => [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]],
                2 => [[0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]],
                3 => [[0.0, 1.0, 0.0], [0.0, 0.6, -0.8], [0.0, 1.0, 0.0]],
                _ => [unit(&mut stream), unit(&mut stream), unit(&mut stream)],
            };
            vectors.iter().flatten().zip(&mut case[52..61]).for_each(|(x, c)| *c = *x as f32);
            cases.push(case);
        }
        let (inputs, rule_buffer) =
            (gpu.buffer_with("cases", &cases.concat()).unwrap(), gpu.buffer_with("rule", &block).unwrap());
        let results: Vec<[[f32; 4]; 2]> = device::dispatch(
            &gpu,
            &shaders::PROBE_LEAF_COMP,
            &[("DIRECTIONS", count as u32), ("LEAF_POWER", rule.power as u32)],
            &[("cases", Resource::Buffer(&inputs)), ("rule", Resource::Buffer(&rule_buffer))],
            cases.len(),
            &[],
        );
        let mut worst = Worst::default();
        for (case, [a, b]) in cases.iter().zip(results) {
            let vector = |k: usize| [0, 1, 2].map(|i| f64::from(case[52 + 3 * k + i]));
            let (normal, sun, viewer) = (vector(0), vector(1), vector(2));
            let thickness: Vec<f64> = case[..count].iter().map(|t| f64::from(*t)).collect();
            let left = |k: usize| (-thickness[k]).exp() * f64::from(case[26 + k]);
            let sky = hemisphere(&above, true, normal, left);
            let side = usize::from(normal.iter().zip(viewer).map(|(a, b)| a * b).sum::<f64>() < 0.0);
            let seen: f64 = (0..2).map(|lit| leaf.scattered(lit, side) * sky[lit]).sum();
            let visible = Sun::new(&rule, leaf, sun).visible(&thickness);
            let want = [sky[0], sky[1], visible, scattering(leaf, normal, viewer, sun), seen];
            for (k, want) in want.iter().enumerate() {
                let got = f64::from([a[0], a[1], a[2], a[3], b[0]][k]);
                // Where the sun is below all lobes of 8 directions nothing is known of it, and both say 0 or nothing.
                let error = if want.is_nan() { 0.0 } else { (got - want).abs() };
                worst.note(error, || format!("{count} directions, {k}: {got} {want} {case:?}"));
            }
        }
        // Ratios of sums of up to 26 terms, whose roundings are random; each a product of numbers up to 1 with a few roundings, an exponential to
        // 5 ulp among them.
        worst.within(16.0 * EPS, "light on leaves");
    }
    gpu.close().unwrap();
}
