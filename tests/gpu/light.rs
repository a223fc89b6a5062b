//! Functions of light, shadow texels, display curve and hashes, against their twins in f64.
//!
//! Bounds come from what Vulkan promises of single precision: + - * exact to half an ulp, / 2.5 ulp, sin and cos within
//! 2^-11, atan 4096 ulp, exp (3 + 2|x|) ulp, log and pow built from those.

use crate::device::{self, Arguments, Function, Worst, evaluate, float, words};
use canopy::physics::{hash, light, shadow, tonemap};
use std::f64::consts::PI;

/// Relative rounding of a single operation.
const EPS: f64 = 6e-8;
/// Of atan, relative: 4096 ulp.
const ATAN: f64 = 4096.0 * 2.0 * EPS;

/// Two unit vectors with an angle between them, turned about some axis.
fn pair(angle: f64, turn: f64) -> [[f32; 3]; 2] {
    let frame = glam::DQuat::from_euler(glam::EulerRot::ZYX, turn, 0.7 * turn + 0.3, 1.9 * turn);
    let a = frame * glam::DVec3::X;
    let b = frame * glam::DVec3::new(angle.cos(), angle.sin(), 0.0);
    [a.as_vec3().into(), b.as_vec3().into()]
}

/// The angle of the vectors as stored: rounding moves it by up to two ulps.
fn angle([v, l]: [[f32; 3]; 2]) -> f64 {
    light::angle_between(v.map(f64::from), l.map(f64::from))
}

/// Pairs at ordinary and extreme angles; among them v = l and v = -l to the bit.
fn pairs() -> Vec<[[f32; 3]; 2]> {
    let mut all = Vec::new();
    for turn in 0..23 {
        let turn = f64::from(turn) * 0.37;
        for k in 0..60 {
            all.push(pair(PI * f64::from(k) / 59.0, turn));
        }
        for k in 1..8 {
            let tiny = 10f64.powi(-k);
            all.extend([pair(tiny, turn), pair(PI - tiny, turn)]);
        }
        let [v, _] = pair(0.0, turn);
        all.extend([[v, v], [v, v.map(|x| -x)]]);
    }
    all
}

#[test]
fn hotspot_is_that_of_the_oracle_down_to_no_angle_at_all() {
    let gpu = device::open();
    let pairs = pairs();
    for (a1, a2) in [(0.2f32, 20.0f32), (1.0, 1000.0), (0.0, 0.0), (1.0, 0.0)] {
        let arguments: Vec<Arguments> = pairs
            .iter()
            .map(|[v, l]| words(&[v[0], v[1], v[2], 0.0, l[0], l[1], l[2], 0.0, a1, a2]))
            .collect();
        let (mut angles, mut values) = (Worst::default(), Worst::default());
        for (p, out) in pairs.iter().zip(evaluate(&gpu, Function::Hotspot, &arguments)) {
            let at = angle(*p);
            // Of the cross product, near 0 and pi: products of components up to 1 cancel to within 2 ulp of 1.
            angles.note((float(&out, 0) - at).abs() / (ATAN * at + 4.0 * EPS), || format!("{at} {p:?}"));
            let want = light::hotspot(at, f64::from(a1), f64::from(a2));
            // exp' <= 1 times the error of a2 angle, and exp's own: (3 + 2x) ulp of exp(-x), at most 4 ulp.
            let slope = f64::from(a1) * f64::from(a2) * (-f64::from(a2) * at).exp();
            // The exponential's slope is largest at the smaller end of the uncertain angle: twice covers it.
            let error = slope * 2.0 * (ATAN * at + 4.0 * EPS) + 16.0 * EPS;
            values.note((float(&out, 1) - want).abs() / error, || {
                format!("{at} a1 {a1} a2 {a2}: {out:?} {want}")
            });
            if p[0] == p[1] {
                assert_eq!(float(&out, 0), 0.0, "no angle between the same directions");
                assert_eq!(float(&out, 1), 1.0, "largest at v = l, exactly");
            }
        }
        angles.within(1.0, "angle, in units of its bound");
        values.within(1.0, "hotspot, in units of its bound");
    }
    gpu.close().unwrap();
}

#[test]
fn leaf_phase_is_that_of_the_oracle_and_never_negative() {
    let gpu = device::open();
    let pairs = pairs();
    for (r, t) in [([0.1f32, 0.5, 0.0], [0.05f32, 0.45, 0.3]), ([0.3, 1.0, 0.0], [0.0, 0.0, 0.0])] {
        let arguments: Vec<Arguments> = pairs
            .iter()
            .map(|[v, l]| words(&[v[0], v[1], v[2], r[1], l[0], l[1], l[2], t[1], r[0], t[0], r[2], t[2]]))
            .collect();
        let mut worst = Worst::default();
        for (p, out) in pairs.iter().zip(evaluate(&gpu, Function::LeafPhase, &arguments)) {
            let at = angle(*p);
            for k in 0..3 {
                let want = light::leaf_phase(at, f64::from(r[k]), f64::from(t[k]));
                let got = float(&out, k);
                assert!(got >= 0.0, "{got} at {at}");
                worst.note((got - want).abs(), || format!("{at} r {} t {}: {got} {want}", r[k], t[k]));
            }
        }
        // sin and cos to 2^-11 each: (2/pi) ((r + t)(1 + pi)/(3 pi) + t/3) 2^-11 with r + t = 1 and t = 0.45 is
        // 0.38 * 2^-11; the angle's 4096 ulp times the slope's largest, (2/pi)(pi/(3 pi) + 0.15), add 0.3 * ATAN * pi.
        worst.within(0.4 / 2048.0 + ATAN, "leaf phase");
    }
    gpu.close().unwrap();
}

#[test]
fn sky_through_holes_and_contrast_of_the_ground_are_those_of_the_oracle() {
    let gpu = device::open();
    let depths = [0.0f32, 1e-20, 1e-3, 0.5, 1.0, 7.0, 30.0, 1e4, 1e10];
    let cases: Vec<[f32; 2]> =
        depths.iter().flat_map(|d| [0.0, 1e-12, 0.01, 1.0, 1e6].map(|i| [*d, i])).collect();
    let arguments: Vec<Arguments> = cases.iter().map(|c| words(c)).collect();
    let mut worst = Worst::default();
    for (c, out) in cases.iter().zip(evaluate(&gpu, Function::HoleOcclusion, &arguments)) {
        let want = light::hole_occlusion(f64::from(c[0]), f64::from(c[1]));
        worst.note((float(&out, 0) - want).abs(), || format!("{c:?}: {want}"));
    }
    // Two products, a sum and a division of a value of at most 1.
    worst.within(8.0 * EPS, "hole occlusion");

    let cases = [
        [0.0f32, 0.0, 1.0],
        [1.0, 0.3, 1.0],
        [0.0, 1.0, 4.0],
        [1.0, 0.0, 4.0],
        [0.5, 0.5, 0.0],
        [0.7, 0.2, 2.0],
    ];
    let arguments: Vec<Arguments> = cases.iter().map(|c| words(c)).collect();
    for (c, out) in cases.iter().zip(evaluate(&gpu, Function::GroundContrast, &arguments)) {
        let want = light::ground_contrast(f64::from(c[0]), f64::from(c[1]), f64::from(c[2]));
        // A difference, a product and a difference of numbers up to 5.
        assert!((float(&out, 0) - want).abs() <= 3.0 * 5.0 * EPS, "{c:?} {want} {}", float(&out, 0));
    }
    gpu.close().unwrap();
}

#[test]
fn planes_are_as_steep_to_the_sun_as_the_oracle_says() {
    let gpu = device::open();
    let unit = |v: [f64; 3]| glam::DVec3::from(v).normalize();
    let mut cases: Vec<[[f32; 3]; 4]> = Vec::new();
    let mut stream = hash::Stream::new(11);
    // Level and gentle, vertical, overhanging and hanging upside down; and any.
    let mut normals = vec![
        [0.0, 0.0, 1.0],
        [0.2, -0.1, 0.97],
        [1.0, 0.0, 0.0],
        [0.6, 0.7, 0.0],
        [0.7, 0.0, -0.3],
        [0.0, 0.0, -1.0],
    ];
    normals.extend((0..60).map(|_| [0, 1, 2].map(|_| stream.unit() - 0.5)));
    // At the zenith, ordinary, grazing, on the horizon and below.
    for (k, elevation) in [90.0, 89.9999, 60.0, 35.0, 3.0, 0.1, 0.0, -0.2].into_iter().enumerate() {
        let ((sa, ca), (se, ce)) = ((1.3 * k as f64).sin_cos(), f64::to_radians(elevation).sin_cos());
        let sun = glam::DVec3::new(sa * ce, ca * ce, se);
        let x = unit([ca, -sa, 0.0]);
        let y = sun.cross(x);
        for n in &normals {
            cases.push([unit(*n), x, y, sun].map(|v| v.as_vec3().into()));
        }
        // The plane that faces the sun, and planes that the sun grazes: to the bit, and by the least that counts.
        for n in [sun, x, -y, -sun, x + 1e-3 * sun, y + 0.999e-3 * sun, y + 0.25 * sun] {
            cases.push([n.normalize(), x, y, sun].map(|v| v.as_vec3().into()));
        }
    }
    let arguments: Vec<Arguments> = cases
        .iter()
        .map(|[n, x, y, s]| words(&[n[0], n[1], n[2], s[0], x[0], x[1], x[2], s[1], y[0], y[1], y[2], s[2]]))
        .collect();
    let (mut worst, mut steepest) = (Worst::default(), 0);
    for (c, out) in cases.iter().zip(evaluate(&gpu, Function::PlaneGradient, &arguments)) {
        let [n, x, y, sun] = c.map(|v| v.map(f64::from));
        let want = shadow::plane_gradient(n, x, y, sun);
        let facing = (0..3).map(|k| n[k] * sun[k]).sum::<f64>().max(1e-3);
        for (k, want) in want.into_iter().enumerate() {
            // Three products of at most 1 and their sum, above and below; a division. Beyond the limit only it is left.
            let room = EPS * (3.0 * 0.5 / facing + want.abs() * (3.0 / facing + 6.0));
            worst.note((float(&out, k) - want).abs() / room, || {
                format!("{c:?}[{k}]: {} {want}", float(&out, k))
            });
            steepest += usize::from(want.abs() == 2.0);
        }
    }
    assert!(steepest > 50, "{steepest}: the limit is not tested");
    worst.within(1.0, "plane gradient");
    gpu.close().unwrap();
}

#[test]
fn the_display_curve_is_that_of_the_oracle() {
    let gpu = device::open();
    let mut colors = vec![[0.0f32; 3], [-1.0, 0.5, -1e30], [1e30; 3], [65504.0; 3], [1e-30, 1e-10, 1e-5]];
    for k in 0..200 {
        let x = 1e-4 * 1.08f32.powi(k);
        colors.extend([[x; 3], [x, 0.1 * x, 3.0 * x], [0.0, 0.0, x]]);
    }
    let arguments: Vec<Arguments> = colors.iter().map(|c| words(c)).collect();
    let mut worst = Worst::default();
    for (c, out) in colors.iter().zip(evaluate(&gpu, Function::ToneCurve, &arguments)) {
        let want = tonemap::tone_curve(c.map(f64::from));
        for (k, want) in want.into_iter().enumerate() {
            worst.note((float(&out, k) - want).abs(), || format!("{c:?}[{k}]: {} {want}", float(&out, k)));
        }
    }
    // A dozen operations, a value of at most 1.
    worst.within(16.0 * EPS, "tone curve");

    let mut worst = Worst::default();
    let mut xs: Vec<f32> = (0..=2000).map(|k| k as f32 / 2000.0).collect();
    xs.extend([0.003_130_8, 0.003_130_81, 1e-30, 0.0]);
    let arguments: Vec<Arguments> = xs.iter().map(|x| words(&[*x; 3])).collect();
    for (x, out) in xs.iter().zip(evaluate(&gpu, Function::Srgb, &arguments)) {
        worst.note((float(&out, 0) - tonemap::srgb(f64::from(*x))).abs(), || {
            format!("{x}: {}", float(&out, 0))
        });
    }
    // pow(x, y) = exp2(y log2 x): log2 to 3 ulp (of up to 8.3 here) and exp2 to (3 + 2 * 3.5) ulp of at most 1, which is
    // 3e-6; a display has steps of 4e-3.
    worst.within(4e-6, "sRGB");
    gpu.close().unwrap();
}

#[test]
fn hashes_are_equal_to_the_bit() {
    let gpu = device::open();
    let mut cases: Vec<[u32; 2]> = vec![[0, 0], [u32::MAX, 0], [0, u32::MAX], [u32::MAX; 2], [1 << 31, 1]];
    let mut stream = hash::Stream::new(5);
    cases.extend((0..20_000).map(|_| [stream.bits(), stream.bits()]));
    let arguments: Vec<Arguments> =
        cases.iter().map(|c| [c[0], c[1], 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]).collect();
    for ([a, b], out) in cases.iter().zip(evaluate(&gpu, Function::Hash, &arguments)) {
        assert_eq!(out[..3], [hash::hash(*a), hash::hash2(*a, *b), hash::unit(*a).to_bits()], "{a:x} {b:x}");
    }
    gpu.close().unwrap();
}

#[test]
fn self_shadow_is_that_of_the_oracle_from_no_angle_to_opposite_and_in_any_crown() {
    let gpu = device::open();
    let angles: Vec<f64> = (-14..=-2)
        .flat_map(|k| [10f64.powf(0.5 * f64::from(k)), PI - 10f64.powf(0.5 * f64::from(k))])
        .chain([0.0, 0.5, 1.5, 3.0, PI])
        .collect();
    let mut cases: Vec<[f32; 4]> = Vec::new();
    for angle in angles {
        for metres in [-1.0, 0.0, 1e-9, 1e-4, 0.01, 0.3, 3.0, 50.0, 1e3, 1e6] {
            for (c, tau) in [(0.5, 0.55), (0.0, 0.0), (2.0, 1e-9), (0.0, 1e3)] {
                cases.push([angle as f32, metres, c, tau]);
            }
        }
    }
    let arguments: Vec<Arguments> = cases.iter().map(|c| words(c)).collect();
    let mut worst = Worst::default();
    for (case, out) in cases.iter().zip(evaluate(&gpu, Function::SelfShadow, &arguments)) {
        let [angle, metres, c, tau] = case.map(f64::from);
        let (got, want) = (float(&out, 0), light::self_shadow(angle, metres, c, tau));
        // The exponent's terms to three roundings and a root of 3 ulp, which counts as much of the result; exp to
        // (3 + 2x) ulp. Below the smallest normal number there may be nothing.
        let depth = -want.max(1e-300).ln();
        let room = want * EPS * (10.0 * depth + 2.0 * (3.0 + 2.0 * depth)) + 1.2e-38;
        worst.note((got - want).abs() / room, || format!("{case:?}: {got} {want}"));
        assert!((0.0..=1.0).contains(&got), "{case:?}: {got}");
        assert!(angle > 0.0 || got == 1.0, "what is seen along the light is lit: {case:?} {got}");
    }
    worst.within(1.0, "self-shadow, in units of its bound");
    gpu.close().unwrap();
}
