//! Surfaces from z-fields on the device, of a real baked tree, against the oracle.
//!
//! The device filters textures with weights of 8 bits, and may round the result to 8 bits: a texel's component is off by
//! up to 1/256 an axis and 1/255. What that does to a ray depends on the tree there, so each ray's bound is measured on
//! the oracle: the range of its results under such errors of every texel component, with random signs. The range is wide
//! where nothing but a view of almost no weight sees the tree: there one iteration decides where the next one looks.

use crate::device::{self, dispatch};
use canopy::forest::species::SpeciesData;
use canopy::gpu::{Resource, Sampler, shaders};
use canopy::physics::hash::Stream;
use canopy::physics::views::{self, Basis, Lookup};
use canopy::physics::zfield::ZField;
use canopy::physics::zfield::{self, AGREEMENT, Ray};
use canopy::plan::Plan;
use glam::DVec3;

/// Largest error of a texel component, see above.
const TEXEL: f64 = 2.0 / 256.0 + 1.0 / 255.0;
/// Draws of errors a ray.
const DRAWS: usize = 64;

/// What an iteration is for, see `zfield::intersect`.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    /// Unfiltered: moves the point.
    Estimate,
    /// Filtered: moves the point; the number says which it is.
    Filtered(u32),
    /// Gives the result; after others or alone.
    Last(bool),
}

/// One iteration at `s`, with errors added to the texels: (s, opacity, occlusion).
fn step(
    field: &ZField,
    level: usize,
    lookup: &Lookup,
    ray: &Ray,
    s: f64,
    kind: Kind,
    noise: &mut dyn FnMut() -> f64,
) -> [f64; 3] {
    let q = ray.origin + s * ray.to;
    let level = level.min(field.levels.len() - 1);
    let (mut sum_k, mut alpha, mut occlusion, mut sum_s) = (0.0, 0.0, 0.0, 0.0);
    for view in &lookup.views {
        let basis = Basis::new(views::direction(field.n, view.i, view.j));
        let (mut u, mut v) = zfield::project(field.resolution, &basis, q);
        if kind == Kind::Estimate {
            // The nearest texel's centre; single precision may take the one beside it.
            let size = f64::from((field.resolution >> level).max(1));
            let centre = |x: f64| ((x * size).floor().clamp(0.0, size - 1.0) + 0.5) / size;
            (u, v) = (centre(u + 1e-4 * noise()), centre(v + 1e-4 * noise()));
        }
        let t = zfield::sample(field, level, views::layer(field.n, view.i, view.j), u, v);
        // The texel's own components: (d + alpha sqrt 2) / (2 sqrt 2).
        let root = std::f64::consts::SQRT_2;
        let z = if lookup.below { t.farthest } else { t.nearest };
        let stored = (z / root + t.alpha) / 2.0 + noise();
        let a = (t.alpha + noise()).clamp(0.0, 1.0);
        let z = root * (2.0 * stored - a);
        let mut k = view.weight;
        if matches!(kind, Kind::Filtered(1..) | Kind::Last(true)) && a > 0.0 {
            let e = ((z / a - q.dot(basis.w)) / AGREEMENT).powi(2);
            k *= 1.0 - a * e / (1.0 + e);
        }
        sum_k += k;
        alpha += k * a;
        occlusion += k * (t.occlusion + noise());
        sum_s += k * (z - a * ray.origin.dot(basis.w)) / ray.to.dot(basis.w);
    }
    if alpha <= 0.0 {
        return [s, 0.0, 0.0];
    }
    [sum_s / alpha, alpha / sum_k, occlusion / alpha]
}

/// All iterations of the frame.
fn steps(
    field: &ZField,
    level: usize,
    ray: &Ray,
    iterations: u32,
    noise: &mut dyn FnMut() -> f64,
) -> [f64; 3] {
    let lookup = views::lookup(field.n, ray.to);
    let mut start = 0.0;
    for n in 0..iterations - 1 {
        let kind = if level == 0 { Kind::Filtered(n) } else { Kind::Estimate };
        let at = step(field, level + 1, &lookup, ray, start, kind, noise);
        start += (at[0] - start) * (24.0 * at[1]).min(1.0);
    }
    step(field, level, &lookup, ray, start, Kind::Last(iterations > 1), noise)
}

fn rays(stream: &mut Stream) -> Vec<(Ray, usize, u32)> {
    let mut all = Vec::new();
    let mut push = |ray: Ray, k: usize| all.push((ray, k % 4, 1 + (k / 4 % 3) as u32));
    for k in 0..3000 {
        let zenith = [0.0, 90.0, 180.0, 30.0, 89.9, 120.0, 60.0, 91.0][k % 8]
            + 5.0 * stream.unit() * f64::from(k as u32 % 3);
        let (st, ct) = zenith.to_radians().sin_cos();
        let (sa, ca) = (std::f64::consts::TAU * stream.unit()).sin_cos();
        let w = DVec3::new(st * ca, st * sa, ct);
        let b = Basis::new(w);
        let (x, y) = (2.4 * stream.unit() - 1.2, 2.4 * stream.unit() - 1.2);
        let through = x * b.right + y * b.up;
        // Numbers as the device gets them.
        let single = |v: DVec3| v.as_vec3().as_dvec3();
        push(Ray { origin: single(through), to: single(w * (0.5 + stream.unit())) }, k);
    }
    all
}

#[test]
fn surfaces_are_those_of_the_oracle_within_the_filter() {
    let gpu = device::open();
    let scene = device::small_scene(
        "[terrain]\nextent = 200.0\n[[species]]\nname = \"birch\"\nmodel = \"builtin:birch\"\ndensity = 0.01\n\
         [[camera]]\nname = \"c\"\nposition = [0.0, 0.0, 10.0]\ntarget = [9.0, 9.0, 5.0]\nvertical_fov = 50.0\n",
    );
    let baked = device::bake(&scene);
    let plan = Plan::new(&scene, &scene.cameras[0], [64, 64], false, Some(gpu.info())).unwrap();
    let species = SpeciesData::new(&gpu, &scene, &plan, &baked).unwrap();
    let field = &baked[0].species.views;
    let mut stream = Stream::new(77);
    let rays = rays(&mut stream);
    let words: Vec<[f32; 8]> = rays
        .iter()
        .map(|(r, mip, n)| {
            let (o, t) = (r.origin.as_vec3(), r.to.as_vec3());
            [o.x, o.y, o.z, *mip as f32, t.x, t.y, t.z, *n as f32]
        })
        .collect();
    let buffer = gpu.buffer_with("rays", &words).unwrap();
    let resources = [
        ("rays", Resource::Buffer(&buffer)),
        ("bases", Resource::Buffer(&species.bases)),
        ("views", Resource::Texture(&species.views, Sampler::LinearBorder)),
    ];
    let found: Vec<[f32; 4]> =
        dispatch(&gpu, &shaders::PROBE_ZFIELD_COMP, &[], &resources, rays.len(), &[field.n]);
    let (mut hits, mut worst) = (0, [0.0f64; 3]);
    let mut errors: Vec<f64> = Vec::new();
    for ((ray, level, n), got) in rays.iter().zip(&found) {
        let got = [0, 1, 2].map(|k| f64::from(got[k]));
        assert!(got.iter().all(|v| v.is_finite()), "{got:?} for {ray:?}");
        let exact = steps(field, *level, ray, *n, &mut || 0.0);
        let entry = zfield::intersect(field, *level, &views::lookup(field.n, ray.to), ray, *n);
        if entry.alpha > 0.0 {
            let twin = [entry.s, entry.alpha, entry.occlusion];
            assert!(
                (0..3).all(|k| (twin[k] - exact[k]).abs() < 1e-9),
                "{twin:?} {exact:?}: this test's own iteration"
            );
        }
        let (mut low, mut high) = (exact, exact);
        for _ in 0..DRAWS {
            let mut noise = || TEXEL * (2.0 * stream.unit() - 1.0).signum();
            let at = steps(field, *level, ray, *n, &mut noise);
            for k in 0..3 {
                low[k] = low[k].min(at[k]);
                high[k] = high[k].max(at[k]);
            }
        }
        // Where opacity may be nothing, place and occlusion mean nothing.
        let means = if low[1] > 0.05 { [true, true, true] } else { [false, true, false] };
        for k in (0..3).filter(|k| means[*k]) {
            // A quarter more than the draws found, and single precision.
            let room = 0.25 * (high[k] - low[k]) + 1e-4;
            // The device's occlusion is cut at 1.
            let top = if k == 2 { high[k].min(1.0) } else { high[k] };
            assert!(
                (low[k].min(1.0) - room..=top + room).contains(&got[k])
                    || (k == 0 && (low[k] - room..=high[k] + room).contains(&got[k])),
                "component {k}: {got:?}, exact {exact:?}, from {low:?} to {high:?}, level {level}, {n} iterations, {ray:?}"
            );
            worst[k] = worst[k].max((got[k] - exact[k].min(if k == 2 { 1.0 } else { 1e9 })).abs());
        }
        if exact[1] > 0.5 && means[0] {
            hits += 1;
            errors.push((got[0] - exact[0]).abs());
        }
    }
    errors.sort_by(f64::total_cmp);
    println!(
        "{hits} opaque rays, worst s, opacity, occlusion {worst:?}, median error of s {}",
        errors[hits / 2]
    );
    assert!(hits > 500, "{hits}");
    // At the median a ray is as good as the texels: half the largest error of a depth.
    assert!(errors[hits / 2] < 0.5 * TEXEL * 2.0 * std::f64::consts::SQRT_2, "{}", errors[hits / 2]);
    drop((buffer, species));
    gpu.close().unwrap();
}
