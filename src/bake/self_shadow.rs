//! How a crown shadows itself, and how its leaves are turned, measured from the mesh along the z-field's own rays.
//!
//! A renderer that sees a point of the z-field's surface, and follows light from it for s metres to that surface again, asks
//! how likely the point is lit. Rays through the mesh answer: along each view ray the first surface that is really there,
//! and whether the sun reaches it past the tree's own leaves. [`crate::physics::light::self_shadow`] is what these answers
//! look like; here are its two constants, by least squares over cells of phase angle and distance:
//!
//! min Σ w (exp(−√α (c + √(τ s))) − P)²,
//!
//! with w the number of the cell's rays that meet the mesh. (Those that the mesh lets through are no part of it; their opacity is in
//! this number already, and weighing by it again would count thin places, where more is lit, too little.) Light is followed by one iteration: the first look
//! already tells near surfaces from far ones, and more iterations bring the point nearer to itself where it matters
//! least (on an oak and a pine 0.027 and 0.028 are left with one iteration, 0.032 and 0.032 with two). A renderer that looks twice does better
//! with the law of one look than with one of its own (of oaks 33 pixels high, with the sun behind, beside and before the viewer, it errs by 37.5, 40.1 and 42.6 %
//! in place of 38.5, 41.9 and 44.4 %).
//!
//! What the law leaves out by the directions of viewer and sun and by height is measured last, from the same answers
//! ([`crate::physics::correction`]): with P' and G what the law says of a ray's light and of the radiance that goes to the viewer, and
//! t = 0 or 1 and T what the mesh does,
//!
//! min Σ (K P' − t)²/P' and min Σ (K G − T)²/G,
//!
//! weighed as counts are, whose variance is their mean.

use std::f64::consts::{PI, TAU};

use glam::DVec3;
use rayon::prelude::*;

use super::correction::{Fit, Law};
use super::surface::{Caster, Surface};
use super::{SpeciesBake, Turned};
use crate::Result;
use crate::physics::correction::{self, Correction};
use crate::physics::crown::{Crown, Frame};
use crate::physics::hash::{Stream, hash2};
use crate::physics::light;
use crate::physics::transfer;
use crate::physics::views::{self, Basis};
use crate::physics::zfield::ZField;
use crate::physics::zfield::{self, Ray};
use crate::rays::{Met, Stack};
use crate::scene::Mesh;

/// Pairs of rays: every cell that matters then has hundreds, and P of it a standard error of a few hundredths.
const PAIRS: u32 = 262_144;
/// Pairs a random stream; streams are the unit of work.
const CHUNK: u32 = 512;
/// Edges of the cells of the phase angle, degrees, and of the distance, in half heights of the tree.
const ANGLES: [f64; 13] = [0.0, 0.5, 1.0, 2.0, 4.0, 8.0, 15.0, 30.0, 50.0, 75.0, 100.0, 130.0, 181.0];
const DISTANCES: [f64; 11] = [-1e30, 1e-4, 0.007, 0.02, 0.05, 0.1, 0.2, 0.35, 0.6, 1.0, 1e30];
/// Fainter view rays show next to nothing.
const FAINTEST: f64 = 0.02;
/// Pairs that a cell needs to count.
const LEAST: f64 = 20.0;
/// Seed of the rays.
const SEED: u32 = 0x5e1f;

/// A pair of rays.
struct Sample {
    /// Phase angle, rad.
    angle: f64,
    /// Distance of light through the z-field, m.
    metres: f64,
    /// Whether the sun reaches what the view ray meets of the mesh.
    lit: bool,
    /// Cosines of the zenith angles of viewer and sun.
    up: [f64; 2],
    /// Height of the z-field's point, in scaled space.
    height: f64,
    /// Radiance that goes to the viewer, per irradiance, if the sun reaches it.
    sent: f64,
    /// Above the crown's base: whether that is foliage, whether the sun shines on the side that is seen, |n·l|.
    leaf: Option<(bool, bool, f64)>,
}

/// What a crown does with light, measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// c and τ of [`light::self_shadow`], 1/√rad and 1/(m rad).
    pub shadow: [f64; 2],
    /// How its leaves are turned.
    pub turned: Turned,
    /// What these leave out of the share that is lit, and of the light that is sent.
    pub corrections: [Correction; 2],
}

/// What the mesh is made of, beside its shape.
pub struct Matter<'a> {
    /// Whether a material is foliage.
    pub foliage: &'a [bool],
    /// Height of the crown's base, m.
    pub base: f32,
    /// Luminances of the reflectance and transmittance of leaves, and of the reflectance of bark.
    pub luminances: [f64; 3],
}

/// Samples in a cell of phase angle and distance.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LitCell {
    /// Pairs of rays.
    pub pairs: f64,
    /// Mean phase angle, rad.
    pub angle: f64,
    /// Mean distance that light goes through the z-field, m.
    pub metres: f64,
    /// Share of the mesh's visible surface that is lit.
    pub lit: f64,
}

/// What the mesh of a baked species shows by cells, with rays of a seed of one's own: to test the law by.
///
/// # Errors
/// [`crate::Error::Usage`] for a mesh without extent.
pub fn lit_cells(mesh: &Mesh, bake: &SpeciesBake, seed: u32) -> Result<Vec<LitCell>> {
    let surface = Surface::new(mesh)?;
    let foliage: Vec<bool> = mesh.materials.iter().map(|m| m.foliage).collect();
    let matter = Matter { foliage: &foliage, base: bake.crown.base, luminances: [0.0; 3] };
    Ok(cells(&samples(&surface, &matter, &bake.views, seed), f64::from(bake.crown.frame.half_height)))
}

/// Measures a crown.
pub fn measure(surface: &Surface, matter: &Matter, field: &ZField) -> Measured {
    let samples = samples(surface, matter, field, SEED);
    let cells = cells(&samples, f64::from(surface.frame.half_height));
    let (shadow, turned) = (fit(&cells), turned(&samples));
    Measured { shadow, turned, corrections: corrections(&samples, (surface.frame, matter), shadow, &turned) }
}

/// Corrections of the law's share that is lit, and of the light that it sends.
fn corrections(
    samples: &[Sample],
    (frame, matter): (Frame, &Matter),
    [c, tau]: [f64; 2],
    turned: &Turned,
) -> [Correction; 2] {
    let [leaf, passed, bark] = matter.luminances;
    let reflected = f64::from(turned.reflected) * leaf + f64::from(turned.bark_reflected) * bark;
    let passed = f64::from(turned.passed) * passed;
    // Of all of a crown only the base matters here.
    let crown = Crown { frame, base: matter.base, ..Crown::default() };
    let law = Law::new(crown, [reflected, passed], turned.slope_of().into(), bark);
    let mut fits = [Fit::default(); 2];
    for s in samples {
        let terms = correction::terms(s.up[0], s.up[1], s.angle);
        let lit = light::self_shadow(s.angle, s.metres, c, tau);
        let sent = lit * law.colour(s.height as f32) * law.phase(s.angle);
        let truth = f64::from(u8::from(s.lit));
        fits[0].add(&terms, (transfer::strength(s.angle), s.height, 1.0), (lit, truth));
        fits[1].add(&terms, (1.0, s.height, 1.0), (sent, truth * s.sent));
    }
    fits.map(|f| f.solve())
}

fn samples(surface: &Surface, matter: &Matter, field: &ZField, seed: u32) -> Vec<Sample> {
    let rays = Caster::new(surface);
    let mesh = (surface, matter, &rays);
    (0..PAIRS / CHUNK)
        .into_par_iter()
        .flat_map_iter(|k| {
            let (mut stream, mut stack) = (Stream::new(hash2(seed, k)), Stack::new());
            (0..CHUNK).filter_map(|_| sample(mesh, field, &mut stream, &mut stack)).collect::<Vec<_>>()
        })
        .collect()
}

/// How what is seen and lit of the crown differs from leaves of uniform orientation (Ross 1981, [`light::leaf_phase`]), whose
/// mean |n·l| is 2Γ_r(α) where they are seen from the lit side and 2Γ_t(α) where from the other, 0 else. Least squares over what is seen
/// and lit, leaves and bark alike, with the angle's share of the first because it falls with α in every tree that was looked at (in an
/// oak from 0.99 at 7° to 0.70 at 97°, while the second stays 1.2):
///
/// |n·l| ≈ (κ₀ + κ₁ α) 2Γ_r on leaves seen from the lit side,  κ_t 2Γ_t on leaves seen from the other,  κ_b 2Γ_r on bark.
///
/// Twigs take 4 to 7 % of what is lit in an oak and a pine; the rest is how leaves are turned, and that those that are seen and lit
/// are not all leaves.
fn turned(samples: &[Sample]) -> Turned {
    // Of leaves from the lit side: Σ g x, Σ α g x, Σ g², Σ α g², Σ α² g²; of the two others Σ g x and Σ g².
    let (mut lit, mut passed, mut bark) = ([0.0; 5], [0.0; 2], [0.0; 2]);
    let (mut seen, mut seen_bark) = (0.0, 0.0);
    for s in samples {
        let Some((foliage, same, cosine)) = s.leaf else { continue };
        seen += 1.0;
        if !foliage {
            seen_bark += 1.0;
        }
        if !s.lit {
            continue;
        }
        // ρp of eq. 7 is a radiance, |n·l|/π: times π.
        let [g, h] = [(1.0, 0.0), (0.0, 1.0)].map(|(r, t)| PI * light::leaf_phase(s.angle, r, t));
        let of = |wanted: bool| if wanted { cosine } else { 0.0 };
        let x = of(foliage && same);
        let terms = [g * x, s.angle * g * x, g * g, s.angle * g * g, s.angle * s.angle * g * g];
        lit.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
        passed[0] += h * of(foliage && !same);
        passed[1] += h * h;
        bark[0] += g * of(!foliage && same);
        bark[1] += g * g;
    }
    let [gx, agx, gg, agg, aagg] = lit;
    let det = gg * aagg - agg * agg;
    let ratio = |[a, b]: [f64; 2], none: f64| if b > 0.0 { a / b } else { none };
    let (first, slope) = if det > 1e-9 * gg * aagg {
        ((gx * aagg - agx * agg) / det, (agx * gg - gx * agg) / det)
    } else {
        (1.0, 0.0)
    };
    Turned {
        reflected: first as f32,
        slope: slope as f32,
        passed: ratio(passed, 1.0) as f32,
        bark_reflected: ratio(bark, 0.0) as f32,
        bark_share: ratio([seen_bark, seen], 0.0) as f32,
    }
}

/// A direction of the upper hemisphere, with a density of √z over the solid angle: between that and the projected one, so that neither
/// suns and views along the ground nor those from above are few.
pub(super) fn direction(stream: &mut Stream) -> DVec3 {
    let (z, turn) = ((1.0 - 0.99 * stream.unit()).powf(2.0 / 3.0), TAU * stream.unit());
    let r = (1.0 - z * z).sqrt();
    DVec3::new(r * turn.cos(), r * turn.sin(), z)
}

fn sample(
    (surface, matter, rays): (&Surface, &Matter, &Caster),
    field: &ZField,
    stream: &mut Stream,
    stack: &mut Stack,
) -> Option<Sample> {
    let view = direction(stream);
    let (other, near, turn) = (direction(stream), stream.unit(), stream.unit());
    // Half of the lights anywhere, half near the viewer, where P changes fast.
    let sun = if turn < 0.5 { other } else { (view + 2.0 * near.powi(3) * other).normalize() };
    let scale = surface.frame.scale().as_dvec3();
    let basis = Basis::new((view / scale).normalize());
    let (a, b) = (2.0 * stream.unit() - 1.0, 2.0 * stream.unit() - 1.0);
    let origin = basis.right * a + basis.up * (b * basis.extent);
    let lookup = views::lookup(field.n, basis.w);
    let seen = zfield::intersect(field, 0, &lookup, &Ray { origin, to: basis.w }, 2);
    if seen.alpha < FAINTEST {
        return None;
    }
    // From beyond the cylinder, which is no farther than sqrt 2 from its centre.
    let from = surface.frame.to_metres((origin + 2.0 * basis.w).as_vec3());
    let (eye, to_sun) = (view.as_vec3(), sun.as_vec3());
    let Met { t, face, .. } = rays.first(from, -eye, stack)?;
    let hit = from - eye * t;
    let w = (sun / scale).normalize();
    let metres = zfield::light_ray(field, 0, seen.point, w, 1).s * (w * scale).length();
    let normal = rays.normal(face);
    let (seen_from, lit_from) = (normal.dot(eye), normal.dot(to_sun));
    let foliage = matter.foliage[surface.faces[face as usize].material as usize];
    let same = seen_from * lit_from > 0.0;
    let [leaf, passed, bark] = matter.luminances;
    let scattered = match (foliage, same) {
        (true, true) => leaf,
        (true, false) => passed,
        (false, true) => bark,
        (false, false) => 0.0,
    };
    Some(Sample {
        angle: light::angle_between(view.into(), sun.into()),
        metres: metres.max(0.0),
        lit: !rays.occluded(hit, to_sun, 1e-4 * surface.frame.half_height, stack),
        up: [view.z, sun.z],
        height: seen.point.z,
        sent: scattered * f64::from(lit_from.abs()) / PI,
        leaf: (hit.z > matter.base).then_some((foliage, same, f64::from(lit_from.abs()))),
    })
}

fn cells(samples: &[Sample], unit: f64) -> Vec<LitCell> {
    let mut cells = vec![LitCell::default(); (ANGLES.len() - 1) * (DISTANCES.len() - 1)];
    for &Sample { angle, metres, lit, .. } in samples {
        let place =
            |edges: &[f64], x: f64| edges.iter().rposition(|e| *e <= x).unwrap_or(0).min(edges.len() - 2);
        let (i, j) = (place(&ANGLES, angle * 180.0 / PI), place(&DISTANCES, metres / unit));
        let c = &mut cells[i * (DISTANCES.len() - 1) + j];
        c.pairs += 1.0;
        c.angle += angle;
        c.metres += metres;
        c.lit += f64::from(u8::from(lit));
    }
    cells.retain(|c| c.pairs >= LEAST);
    for c in &mut cells {
        c.angle /= c.pairs;
        c.metres /= c.pairs;
        c.lit /= c.pairs;
    }
    cells
}

/// Gauss and Newton in x = (c, √τ), in which the exponent is linear, with Levenberg's damping. Crowns with nothing to measure
/// shadow nothing.
fn fit(cells: &[LitCell]) -> [f64; 2] {
    let loss = |x: [f64; 2]| -> f64 {
        cells
            .iter()
            .map(|c| c.pairs * (light::self_shadow(c.angle, c.metres, x[0], x[1] * x[1]) - c.lit).powi(2))
            .sum()
    };
    let (mut x, mut damping) = ([0.5, 0.7], 1e-3);
    for _ in 0..100 {
        let (mut h, mut g) = ([[0.0; 2]; 2], [0.0; 2]);
        for c in cells {
            let p = light::self_shadow(c.angle, c.metres, x[0], x[1] * x[1]);
            let d = [-p * c.angle.sqrt(), -p * (c.angle * c.metres).sqrt()];
            for i in 0..2 {
                g[i] += c.pairs * d[i] * (p - c.lit);
                (0..2).for_each(|j| h[i][j] += c.pairs * d[i] * d[j]);
            }
        }
        let (a, d) = (h[0][0] * (1.0 + damping), h[1][1] * (1.0 + damping));
        let det = a * d - h[0][1] * h[1][0];
        if det <= 0.0 || !det.is_finite() {
            break;
        }
        let step = [(d * g[0] - h[0][1] * g[1]) / det, (a * g[1] - h[1][0] * g[0]) / det];
        let next = [(x[0] - step[0]).max(0.0), (x[1] - step[1]).max(0.0)];
        if loss(next) < loss(x) {
            (x, damping) = (next, damping * 0.3);
        } else {
            damping *= 10.0;
        }
        if damping > 1e12 {
            break;
        }
    }
    if cells.is_empty() { [0.0; 2] } else { [x[0], x[1] * x[1]] }
}
