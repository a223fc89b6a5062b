//! What storing a quantity in few bits costs, against 32: as shares of a step of radiance that the eye just sees.

use canopy::physics::hash::Stream;
use canopy::physics::tables::ForestTables;
use canopy::physics::transfer::Transfer;
use canopy::physics::views::{self, Basis};
use canopy::physics::zfield::ZField;
use canopy::physics::{tables, transfer, zfield};
use glam::DVec3;
use half::f16;
use std::f64::consts::PI;

use crate::oaks;

/// Weber's contrast: the relative step of radiance that the eye just sees.
const VISIBLE: f64 = 0.01;

fn half(x: f64) -> f64 {
    f64::from(f16::from_f64(x))
}

/// A value in [0, `most`] in steps of so many bits.
fn steps(x: f64, most: f64, bits: u32) -> f64 {
    let last = f64::from((1u32 << bits) - 1);
    (x / most * last).round() / last * most
}

/// Root mean square.
fn rms(errors: &[f64]) -> f64 {
    assert!(errors.len() > 1000, "{}", errors.len());
    (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt()
}

/// Prints the row of a quantity, whose errors are of radiance, relative: as 8 bits, as 16 and as half floats. The format
/// that is used is bound by its share of what is visible.
fn row(quantity: &str, [bits_8, bits_16, halves]: [f64; 3], used: (&str, f64), share: f64) {
    println!("| {quantity} | {bits_8:.2e} | {bits_16:.2e} | {halves:.2e} | {} |", used.0);
    assert!(used.1 <= share * VISIBLE, "{quantity} as {}: {:e} of radiance", used.0, used.1);
}

#[test]
#[ignore = "takes minutes"]
fn few_bits_cost_less_than_is_seen() {
    // Of the tables only how they are stored is looked at: a few rays do.
    let (_, baked) = oaks(0.02, "table_angles = 6\ntable_densities = 4\ntable_rays = 64\n");
    println!("| quantity | 8 bits | 16 bits | half | used |\n|---|---|---|---|---|");
    let species = &baked[0].species;
    z_fields(&species.views, f64::from(species.crown.frame.half_width));
    light_transfer(&species.transfer);
    forest_tables(&baked[0].tables);
    coverage();
    targets();
}

/// Rounds to every fifth step, whose error is the root of 2 steps where that of rounding to 8 bits is the root of 1/12: of
/// numbers that are only known to 8 bits, what rounding them costs is 1/4.9 of what this costs.
fn coarser(field: &ZField) -> ZField {
    let mut coarse = field.clone();
    coarse.levels.iter_mut().flatten().for_each(|b| *b = (*b).saturating_add(2) / 5 * 5);
    coarse
}

/// Texels of z-fields: opacity hides, so that all its error is one of radiance where a tree stands before bright ground;
/// the sky part is proportional to the occlusion; and a light ray's end moves the self-shadow exp(-sqrt(tau s)), at a
/// phase angle of 1 rad and 1 m deep with tau = 0.55 by 0.37 a metre.
fn z_fields(field: &ZField, metres: f64) {
    let (coarse, scale) = (coarser(field), (1.0f64 / 24.0).sqrt());
    let mut stream = Stream::new(5);
    let [mut opacity, mut occlusion, mut depth] = [0; 3].map(|_| Vec::new());
    for _ in 0..20_000 {
        let (z, a) = (stream.unit().acos(), std::f64::consts::TAU * stream.unit());
        let w = DVec3::new(z.sin() * a.cos(), z.sin() * a.sin(), z.cos());
        let basis = Basis::new(w);
        let through = (2.0 * stream.unit() - 1.0) * basis.right + (2.0 * stream.unit() - 1.0) * basis.up;
        let ray = zfield::Ray { origin: through, to: w };
        let [fine, rough] =
            [field, &coarse].map(|f| zfield::intersect(f, 0, &views::lookup(f.n, w), &ray, 2));
        opacity.push(scale * (fine.alpha - rough.alpha));
        if fine.alpha > 0.5 && rough.alpha > 0.5 {
            occlusion.push(scale * (fine.occlusion - rough.occlusion) / fine.occlusion.max(0.05));
            depth.push(scale * (fine.s - rough.s) * metres * 0.37);
        }
    }
    for (name, errors) in [
        ("opacity of a z-field", opacity),
        ("occlusion of a z-field", occlusion),
        ("depth of a z-field", depth),
    ] {
        // A pixel at the hand-over averages dozens of texels; a single one may take what is just seen.
        let e = rms(&errors);
        // Steps of 1/65535; and of 2^-11, of half floats from 1/2 to 1.
        row(name, [e, e / 257.0, e * 255.0 / 2048.0], ("8 bits", e), 1.0);
    }
}

/// Coefficients of light transfer: M of single texels, over its mean of 1. What is stored lies anywhere within its byte's step.
fn light_transfer(t: &Transfer) {
    let texels: Vec<&[[u8; 4]]> = t.bands.iter().map(|b| b[0].as_chunks::<4>().0).collect();
    let mut stream = Stream::new(7);
    let mut errors: [Vec<f64>; 3] = Default::default();
    while errors[0].len() < 20_000 {
        let k = (stream.unit() * texels[0].len() as f64) as usize;
        if texels.iter().all(|b| b[k] == transfer::NEUTRAL) {
            continue;
        }
        let l = transfer_light(&mut stream);
        let exact: Vec<[f64; 4]> = texels
            .iter()
            .map(|b| transfer::decode(b[k]).map(|x| x + transfer::STEP * (stream.unit() - 0.5)))
            .collect();
        let m = |f: &dyn Fn([f64; 4]) -> [f64; 4]| {
            let bands: Vec<[f64; 4]> = exact.iter().map(|x| f(*x)).collect();
            // At a phase angle of 1 rad.
            transfer::transfer(&bands, l, transfer::strength(1.0))
        };
        let truth = m(&|x| x);
        let finer = transfer::STEP / 256.0;
        let formats: [&dyn Fn([f64; 4]) -> [f64; 4]; 3] =
            [&|x| transfer::decode(transfer::encode(x)), &|x| x.map(|x| (x / finer).round() * finer), &|x| {
                x.map(half)
            }];
        for (errors, f) in errors.iter_mut().zip(formats) {
            errors.push(m(f) - truth);
        }
    }
    let e = errors.map(|e| rms(&e));
    // Of one texel; three views of four texels each are blended.
    row("light transfer of a texel", e, ("8 bits", e[0]), 1.0);
}

/// A light above the horizon.
fn transfer_light(stream: &mut Stream) -> [f64; 3] {
    let (z, a) = (stream.unit(), std::f64::consts::TAU * stream.unit());
    let r = (1.0 - z * z).sqrt();
    [r * a.cos(), r * a.sin(), z]
}

/// Tables: lit leaves and what is seen of the ground through them, as they are looked up.
fn forest_tables(t: &ForestTables) {
    let stored = |f: &dyn Fn(f64, f64) -> f64| {
        let most = |all: &mut dyn Iterator<Item = f32>| f64::from(all.fold(0.0, f32::max));
        let (pair, view) =
            (most(&mut t.pair.iter().flatten().copied()), most(&mut t.view.iter().flatten().copied()));
        let mut copy = t.clone();
        copy.pair.iter_mut().flatten().for_each(|v| *v = f(f64::from(*v), pair) as f32);
        copy.view.iter_mut().flatten().for_each(|v| *v = f(f64::from(*v), view) as f32);
        copy
    };
    let copies = [stored(&|v, m| steps(v, m, 8)), stored(&|v, m| steps(v, m, 16)), stored(&|v, _| half(v))];
    let mut stream = Stream::new(9);
    let mut errors: [[Vec<f64>; 3]; 2] = Default::default();
    for _ in 0..20_000 {
        let mut angle = || tables::THETA_MAX * stream.unit();
        let (v, l) = (angle(), angle());
        let (phi, x) = (PI * stream.unit(), 10f64.powf(-3.0 + 3.3 * stream.unit()));
        let (leaves, ground) = (tables::pair(t, v, l, phi, x)[1], tables::visible_ground(t, v, x));
        for (k, copy) in copies.iter().enumerate() {
            errors[0][k].push((tables::pair(copy, v, l, phi, x)[1] - leaves) / leaves.max(0.01));
            errors[1][k].push(tables::visible_ground(copy, v, x) - ground);
        }
    }
    for (name, errors) in ["lit leaves of a table", "visible ground of a table"].into_iter().zip(errors) {
        let e = errors.map(|e| rms(&e));
        row(name, e, ("half", e[2]), 0.1);
    }
}

/// Coverage tiles: what discs cover, and what a density leaves of the ground in top view.
fn coverage() {
    let mut stream = Stream::new(3);
    let mut errors: [[Vec<f64>; 3]; 2] = Default::default();
    for _ in 0..20_000 {
        let (covered, thickness) = (stream.unit(), 3.0 * stream.unit());
        let ground = (-thickness).exp();
        let formats: [&dyn Fn(f64, f64) -> f64; 3] =
            [&|v, m| steps(v, m, 8), &|v, m| steps(v, m, 16), &|v, _| half(v)];
        for (k, f) in formats.iter().enumerate() {
            errors[0][k].push(f(covered, 1.0) - covered);
            // Densities have no end: 8 bits must reach 100 crowns over one another.
            errors[1][k].push((-f(thickness, 100.0)).exp() - ground);
        }
    }
    for (name, errors) in ["coverage of a tile", "density of a tile"].into_iter().zip(errors) {
        let e = errors.map(|e| rms(&e));
        row(name, e, ("half", e[2]), 0.1);
    }
}

/// Radiance in the image: of the brightest light, down to a ten-thousandth of it; and the shader-map's paths, of which
/// exp(-thickness path) is left, at a path of up to 30 where the view grazes.
fn targets() {
    let mut stream = Stream::new(1);
    let mut errors: [[Vec<f64>; 3]; 2] = Default::default();
    for _ in 0..20_000 {
        let radiance = 10f64.powf(-4.0 * stream.unit());
        let (path, thickness) = (1.0 + 29.0 * stream.unit(), 10f64.powf(-3.0 + 3.3 * stream.unit()));
        let formats: [&dyn Fn(f64, f64) -> f64; 3] =
            [&|v, m| steps(v, m, 8), &|v, m| steps(v, m, 16), &|v, _| half(v)];
        for (k, f) in formats.iter().enumerate() {
            errors[0][k].push((f(radiance, 1.0) - radiance) / radiance);
            errors[1][k].push((-thickness * f(path, 30.0)).exp() - (-thickness * path).exp());
        }
    }
    let [radiance, path] = errors.map(|e| e.map(|e| rms(&e)));
    row("radiance of a target", radiance, ("half", radiance[2]), 0.1);
    // Twenty-four bits of the mantissa, of an exponent that matters up to 10.
    row("path of a shader-map node", path, ("32 bits", 10.0 * f64::from(f32::EPSILON)), 0.001);
}
