//! Pure shader functions on arrays of inputs (`shaders/probe`), and their comparison with the twins in [`crate::physics`].

use bytemuck::Pod;

use super::{Finding, finding, law};
use crate::Result;
use crate::gpu::{Gpu, Resource, Shader, shaders};
use crate::physics::{handover, hash, light, masks, tonemap, transfer};

/// Up to twelve words in.
pub type Arguments = [u32; 12];
/// Eight words out.
pub type Words = [u32; 8];

/// The functions of `shaders/probe/physics.comp`, in its order.
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs)]
pub enum Function {
    Hash = 0,
    ViewLookup,
    Hotspot,
    LeafPhase,
    HoleOcclusion,
    GroundContrast,
    CoveredSamples,
    MaskColumn,
    PlaneGradient,
    ToneCurve,
    Srgb,
    ViewLayer,
    Handover,
    TableAngles,
    TableCoordinates,
    SelfShadow,
    Transfer,
    MeshMask,
    Harmonics,
    PhaseTerms,
}

/// The results of a function for many arguments.
///
/// # Errors
/// [`crate::Error::Device`].
pub fn evaluate(gpu: &Gpu, function: Function, arguments: &[Arguments]) -> Result<Vec<Words>> {
    let inputs = gpu.buffer_with("probe inputs", arguments)?;
    let (shader, constants) = (&shaders::PROBE_PHYSICS_COMP, [("FUNCTION", function as u32)]);
    dispatch(gpu, shader, &constants, &[("inputs", Resource::Buffer(&inputs))], arguments.len(), &[])
}

/// Runs a probe over `count` inputs; `more`, at most one word, follows the count in the push constants.
///
/// # Errors
/// [`crate::Error::Device`].
pub fn dispatch<T: Pod>(
    gpu: &Gpu,
    shader: &'static Shader,
    constants: &[(&str, u32)],
    resources: &[(&str, Resource)],
    count: usize,
    more: &[u32],
) -> Result<Vec<T>> {
    let program = gpu.compute(shader, constants)?;
    let results = gpu.buffer("probe results", (count * size_of::<T>()) as u64)?;
    let mut all = resources.to_vec();
    all.push(("results", Resource::Buffer(&results)));
    let mut recorder = gpu.record()?;
    recorder.compute("probe", |pass| {
        pass.bind(&program, &all);
        match *more {
            [] => pass.push(&(count as u32)),
            [a, ..] => pass.push(&[count as u32, a]),
        }
        pass.dispatch([(count as u32).div_ceil(64), 1, 1]);
    });
    recorder.submit()?;
    gpu.read(&results, 0, count)
}

/// Bits of floats, padded with zeros.
pub fn words(floats: &[f32]) -> Arguments {
    let mut all = [0; 12];
    floats.iter().zip(&mut all).for_each(|(f, w)| *w = f.to_bits());
    all
}

/// A float of a result.
pub fn float(result: &Words, k: usize) -> f64 {
    f64::from(f32::from_bits(result[k]))
}

/// A probe of the suite.
pub(super) type Probe = fn(&Gpu) -> Result<Finding>;

/// Every probe.
pub(super) const ALL: &[(&str, Probe)] = &[
    ("hash", hashes),
    ("hotspot", hotspot),
    ("leaf-phase", leaf_phase),
    ("ground-contrast", ground_contrast),
    ("light-transfer", light_transfer),
    ("hand-over", hand_over),
    ("display-curve", display_curve),
    ("covered-samples", covered_samples),
    ("mask-columns", mask_columns),
    ("coverage-law", law::coverage),
];

/// What a function should give for an input, and how far from it rounding may lead: words of the result from the first.
type Want = Vec<(f64, f64)>;

/// Compares a function with its twin; the error is in units of the bound.
fn compare(
    gpu: &Gpu,
    function: Function,
    inputs: &[Vec<f32>],
    twin: impl Fn(&[f64]) -> Want,
) -> Result<Finding> {
    let arguments: Vec<Arguments> = inputs.iter().map(|i| words(i)).collect();
    let (mut worst, mut at) = (0.0, String::new());
    for (input, result) in inputs.iter().zip(evaluate(gpu, function, &arguments)?) {
        let exact: Vec<f64> = input.iter().map(|x| f64::from(*x)).collect();
        for (k, (want, bound)) in twin(&exact).into_iter().enumerate() {
            let error = (float(&result, k) - want).abs() / bound;
            // NaN is the worst.
            if error.is_nan() || error > worst {
                worst = if error.is_nan() { f64::INFINITY } else { error };
                at = format!("{input:?}: {} instead of {want}", float(&result, k));
            }
        }
    }
    let problem = (worst > 1.0).then(|| format!("{worst:.2} times the bound at {at}"));
    let measured = format!("{} inputs, largest error {worst:.3} of the bound", inputs.len());
    Ok(finding(problem.as_slice(), measured))
}

/// Compares words exactly.
fn equal(
    gpu: &Gpu,
    function: Function,
    cases: &[Arguments],
    twin: impl Fn(&Arguments) -> Vec<u32>,
) -> Result<Finding> {
    let results = evaluate(gpu, function, cases)?;
    let wrong = cases.iter().zip(&results).find(|(c, r)| {
        let want = twin(c);
        r[..want.len()] != want[..]
    });
    let problem = wrong.map(|(c, r)| format!("{c:x?}: {r:x?} instead of {:x?}", twin(c)));
    Ok(finding(problem.as_slice(), format!("{} inputs", cases.len())))
}

/// Relative rounding of a single operation.
const EPS: f64 = 6e-8;
/// Of atan, relative, as Vulkan allows: 4096 ulp.
const ATAN: f64 = 4096.0 * 2.0 * EPS;

/// Unit vectors at all angles, from none to opposite.
fn pairs() -> Vec<[f32; 6]> {
    let tiny = (1..8).flat_map(|k| [10f64.powi(-k), std::f64::consts::PI - 10f64.powi(-k)]);
    let angles = (0..=60).map(|k| std::f64::consts::PI * f64::from(k) / 60.0).chain(tiny);
    angles
        .enumerate()
        .map(|(k, angle)| {
            let turn = 0.37 * k as f64;
            let frame = glam::DQuat::from_euler(glam::EulerRot::ZYX, turn, 0.7 * turn + 0.3, 1.9 * turn);
            let a: [f32; 3] = (frame * glam::DVec3::X).as_vec3().into();
            let b: [f32; 3] = (frame * glam::DVec3::new(angle.cos(), angle.sin(), 0.0)).as_vec3().into();
            [a[0], a[1], a[2], b[0], b[1], b[2]]
        })
        .collect()
}

fn angle(x: &[f64]) -> f64 {
    light::angle_between([x[0], x[1], x[2]], [x[4], x[5], x[6]])
}

fn hashes(gpu: &Gpu) -> Result<Finding> {
    let mut stream = hash::Stream::new(5);
    let mut cases = vec![[0; 12], [u32::MAX; 12]];
    cases.extend((0..4096).map(|_| std::array::from_fn(|k| if k < 2 { stream.bits() } else { 0 })));
    equal(gpu, Function::Hash, &cases, |c| {
        vec![hash::hash(c[0]), hash::hash2(c[0], c[1]), hash::unit(c[0]).to_bits()]
    })
}

fn hotspot(gpu: &Gpu) -> Result<Finding> {
    let amplitudes = [(0.2f32, 20.0f32), (1.0, 1000.0), (0.0, 0.0)];
    let inputs: Vec<Vec<f32>> = pairs()
        .into_iter()
        .flat_map(|p| amplitudes.map(|(a1, a2)| vec![p[0], p[1], p[2], 0.0, p[3], p[4], p[5], 0.0, a1, a2]))
        .collect();
    compare(gpu, Function::Hotspot, &inputs, |x| {
        let (at, a1, a2) = (angle(x), x[8], x[9]);
        // The angle: atan, and products that cancel near 0 and pi. The exponential: its slope times twice that, and 4 ulp.
        let of_angle = ATAN * at + 4.0 * EPS;
        let slope = a1 * a2 * (-a2 * at).exp();
        vec![(at, of_angle), (light::hotspot(at, a1, a2), slope * 2.0 * of_angle + 16.0 * EPS)]
    })
}

fn leaf_phase(gpu: &Gpu) -> Result<Finding> {
    let leaves = [([0.1f32, 0.5, 0.0], [0.05f32, 0.45, 0.3]), ([0.3, 1.0, 0.0], [0.0; 3])];
    let inputs: Vec<Vec<f32>> = pairs()
        .into_iter()
        .flat_map(|p| {
            leaves.map(|(r, t)| vec![p[0], p[1], p[2], r[1], p[3], p[4], p[5], t[1], r[0], t[0], r[2], t[2]])
        })
        .collect();
    compare(gpu, Function::LeafPhase, &inputs, |x| {
        let at = angle(x);
        // sin and cos to 2^-11, weighed by at most 0.4; the angle's error times a slope of at most 1.
        let bound = 0.4 / 2048.0 + ATAN;
        [(x[8], x[9]), (x[3], x[7]), (x[10], x[11])].map(|(r, t)| (light::leaf_phase(at, r, t), bound)).into()
    })
}

fn ground_contrast(gpu: &Gpu) -> Result<Finding> {
    let values = [0.0f32, 0.2, 0.5, 1.0];
    let inputs: Vec<Vec<f32>> = values
        .iter()
        .flat_map(|c| values.iter().flat_map(move |e| [0.0, 1.0, 4.0].map(|a| vec![*c, *e, a])))
        .collect();
    // A difference, a product and a difference of numbers up to 5.
    compare(gpu, Function::GroundContrast, &inputs, |x| {
        vec![(light::ground_contrast(x[0], x[1], x[2]), 15.0 * EPS)]
    })
}

fn light_transfer(gpu: &Gpu) -> Result<Finding> {
    // Texels that change nothing, of darkness and of the largest coefficients, and others, under suns all over the sky.
    let mut stream = hash::Stream::new(16);
    let mut texels = vec![[128; 8], [0; 8], [255; 8]];
    texels.extend((0..64).map(|_| std::array::from_fn(|_| (stream.bits() >> 24) as u8)));
    let inputs: Vec<Vec<f32>> = texels
        .iter()
        .zip(pairs().iter().cycle())
        .map(|(texel, sun)| {
            let sampled = texel.map(|b| f32::from(b) / 255.0);
            sampled.into_iter().chain([sun[0], sun[1], sun[2].abs(), 1.5 * sun[1].abs()]).collect()
        })
        .collect();
    compare(gpu, Function::Transfer, &inputs, |x| {
        let bytes = |k: usize| std::array::from_fn(|i| (255.0 * x[k + i]).round() as u8);
        let bands = [transfer::decode(bytes(0)), transfer::decode(bytes(4))];
        // A coefficient is a difference of 8 and 4 at most, 12 roundings of 1; eight of them times terms of at most 1, and
        // seven sums of at most 32.
        // The strength's exponential has 4 ulp of 1, times 16 that coefficients make at most.
        let error = (8.0 * 12.0 + 7.0 * 32.0 + 16.0 * 12.0) * EPS;
        vec![(transfer::transfer(&bands, [x[8], x[9], x[10]], transfer::strength(x[11])), error)]
    })
}

fn hand_over(gpu: &Gpu) -> Result<Finding> {
    let relative = (0..=120).map(|k| k as f32 / 100.0);
    let inputs: Vec<Vec<f32>> = relative
        .flat_map(|r| [0.0f32, 0.4, 0.9].map(|x| vec![r, 0.45, x, 0.0, 3.0 * r, x, 1.0 - x, 0.5 + 0.4 * x]))
        .collect();
    compare(gpu, Function::Handover, &inputs, |x| {
        let ground = handover::open_ground(x[4], x[5], x[6], x[7]);
        // Steps of tests/gpu/handover.rs, at their largest: slopes of 1.5, 10 and 10 of a few roundings, and exp.
        vec![
            (handover::converged(x[0], x[1]), 16.0 * EPS),
            (handover::handed_over(x[0]), 24.0 * EPS),
            (handover::tree_fade(x[0], x[2]), 40.0 * EPS),
            (ground, 200.0 * EPS),
        ]
    })
}

fn display_curve(gpu: &Gpu) -> Result<Finding> {
    let inputs: Vec<Vec<f32>> = (0..200)
        .map(|k| 1e-4 * 1.08f32.powi(k))
        .flat_map(|x| [vec![x; 3], vec![x, 0.1 * x, 3.0 * x], vec![0.0, 0.0, x]])
        .collect();
    // A dozen operations on values of at most 1.
    compare(gpu, Function::ToneCurve, &inputs, |x| {
        tonemap::tone_curve([x[0], x[1], x[2]]).map(|v| (v, 16.0 * EPS)).into()
    })
}

fn covered_samples(gpu: &Gpu) -> Result<Finding> {
    let mut cases = Vec::new();
    for samples in [1, 4, 8] {
        for a in [-1.0f32, 0.0, 1e-30, 1e-3, 0.125, 0.25, 0.3, 0.5, 0.75, 0.999_999, 1.0, 1.5, 1e9] {
            for d in [0.0f32, 1e-7, 0.1, 0.25, 0.5, 0.75, 0.9, 0.999_999_94] {
                cases.push([a.to_bits(), d.to_bits(), samples, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
            }
        }
    }
    // Powers of two scale exactly, so only the sum rounds, and both round it alike.
    equal(gpu, Function::CoveredSamples, &cases, |c| {
        vec![masks::covered_samples(f32::from_bits(c[0]), f32::from_bits(c[1]), c[2])]
    })
}

fn mask_columns(gpu: &Gpu) -> Result<Finding> {
    let mut cases = Vec::new();
    for samples in [1, 4, 8] {
        for row in masks::combination_table(samples) {
            cases.extend(
                (0..=samples).map(|k| [row[0], row[1], row[2], row[3], k, samples, 0, 0, 0, 0, 0, 0]),
            );
        }
    }
    // The twin, and what both are for: k samples of them.
    let found = equal(gpu, Function::MaskColumn, &cases, |c| {
        vec![masks::mask_column(&[c[0], c[1], c[2], c[3]], c[4], c[5])]
    })?;
    let wrong =
        cases.iter().find(|c| masks::mask_column(&[c[0], c[1], c[2], c[3]], c[4], c[5]).count_ones() != c[4]);
    let problems: Vec<String> = found
        .failure
        .into_iter()
        .chain(wrong.map(|c| format!("row {:x?}: column {} has another number of samples", &c[..4], c[4])))
        .collect();
    Ok(finding(&problems, found.measured))
}
