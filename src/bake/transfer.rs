//! Light transfer of every view ([`crate::physics::transfer`]), measured from the mesh.
//!
//! Points on the surface see which of [`LIGHTS`] suns the tree leaves to them, and how far light from there goes through the
//! z-field. What a texel shows is some of these points, their leaves turned to the viewer with one side or the other. Its radiance
//! T under each sun k is held against the law's, G (what the renderer draws without transfer), and
//!
//! min Σ_k (T_k − G_k Σ_i x_i Y_i(l_k))²/G_k + λ ((x_0 − 1)² + Σ_{i>0} x_i²),  λ = ½ mean G,
//!
//! with T times what makes its mean over the view the law's, gives the coefficients: transfer tells texels from each other, and a crown
//! from near is as bright as from afar, where the law is all there is. λ is worth half a sun, and keeps texels that the law leaves in darkness at M = 1. On leaves of an oak at
//! 0.1 m a texel the law explains a fifth of how T differs from texel to texel, one band about half, and two three fifths.

use glam::Vec3;
use rayon::prelude::*;

use super::correction::{Fit, Law};
use super::raster::{NO_FACE, Raster, SUBSAMPLES, View};
use super::surface::{Caster, Surface};
use super::tables::{CrownModel, FieldAim, FieldCrown};
use super::views::rasters;
use super::{SpeciesBake, least_squares};
use crate::physics::correction;
use crate::physics::light::{self, luminance};
use crate::physics::transfer::Transfer;
use crate::physics::transfer::{self, TERMS};
use crate::physics::views;
use crate::progress::Progress;
use crate::rays::Stack;
use crate::scene::Mesh;

/// Suns, evenly over the upper hemisphere: enough for eight coefficients of visibilities that are 0 or 1.
const LIGHTS: usize = 64;
/// Points along a radius of the tree, over texels a side of a view: three in the area of two texels. 7 cm apart on a 15 m oak in
/// views of 128².
const POINTS: f32 = 0.8;
/// Most points on one triangle.
const MOST: u32 = 64;
/// Texels of z-fields that light goes through.
const FIELD: u32 = 128;
/// Of so many texels one is asked what is left amiss: millions of pairs of texels and suns still.
const SOME: usize = 31;
/// Samples of a texel, of the raster's [`SUBSAMPLES`]²: every second in both directions.
const STRIDE: usize = 2;
/// What a point knows of the suns.
struct Point {
    /// m.
    at: Vec3,
    /// Bit k: sun k reaches it.
    lit: u64,
}

/// Points on the surface, face after face.
struct Points {
    all: Vec<Point>,
    /// Index of each face's first.
    first: Vec<u32>,
}

/// A sun.
struct Sun {
    /// Unit vector to it.
    to: Vec3,
    /// Terms of the transfer.
    terms: [f64; 8],
    aim: FieldAim,
    /// Right, up and w of the aim.
    axes: [Vec3; 3],
    /// Metres along w in a unit of scaled space.
    metres: f32,
}

/// The suns, by a spherical Fibonacci lattice over the upper hemisphere.
fn suns(surface: &Surface, field: &FieldCrown) -> Vec<Sun> {
    let scale = surface.frame.scale();
    let sun = |k: usize| {
        let z = (k as f32 + 0.5) / LIGHTS as f32;
        let (r, turn) = ((1.0 - z * z).sqrt(), k as f32 * 2.399_963_2);
        let to = Vec3::new(r * turn.cos(), r * turn.sin(), z);
        let w = (to / scale).normalize();
        let (zenith, azimuth) = views::angles(w.as_dvec3());
        let ((st, ct), (sa, ca)) = (zenith.sin_cos(), azimuth.sin_cos());
        let axes = [[-sa, ca, 0.0], [-ct * ca, -ct * sa, st], [st * ca, st * sa, ct]];
        let [first, second] = transfer::basis(to.as_dvec3().into());
        Sun {
            to,
            terms: std::array::from_fn(|i| if i < TERMS { first[i] } else { second[i - TERMS] }),
            aim: field.aim(zenith, azimuth),
            axes: axes.map(|a| Vec3::from(a.map(|x| x as f32))),
            metres: (w * scale).length(),
        }
    };
    (0..LIGHTS).map(sun).collect()
}

impl Sun {
    /// Light's way through the z-field to a point of scaled space, m.
    fn way(&self, field: &FieldCrown, p: Vec3) -> f32 {
        let [right, up, w] = self.axes;
        let entry = field.entry(&self.aim, p.dot(right), p.dot(up)).unwrap_or(0.0);
        ((entry - p.dot(w)) * self.metres).max(0.0)
    }
}

impl Points {
    fn new(surface: &Surface, suns: &[Sun], resolution: u32, quiet: bool) -> Self {
        let frame = surface.frame;
        let rays = Caster::new(surface);
        let progress = Progress::new("baking light transfer: points", surface.faces.len() as u64, quiet);
        let per_face: Vec<Vec<Point>> = surface
            .faces
            .par_iter()
            .map_init(Stack::new, |stack, face| {
                progress.step(1);
                let [a, b, c] = face.p.map(|p| frame.to_metres(p));
                let area = 0.5 * (b - a).cross(c - a).length() / frame.half_width.powi(2);
                let tries =
                    ((POINTS * resolution as f32).powi(2) * area).ceil().clamp(1.0, MOST as f32) as u32;
                let on = |k: u32| surface.spread(face, k).map(|(s, t)| a + (b - a) * s + (c - a) * t);
                let mut free =
                    |at: Vec3, sun: &Sun| !rays.occluded(at, sun.to, 1e-4 * frame.half_height, stack);
                let mut lit =
                    |at: Vec3| suns.iter().enumerate().map(|(k, s)| u64::from(free(at, s)) << k).sum();
                (0..tries).filter_map(on).map(|at| Point { at, lit: lit(at) }).collect()
            })
            .collect();
        progress.finish();
        let mut first = vec![0];
        let mut all = Vec::new();
        for points in per_face {
            all.extend(points);
            first.push(all.len() as u32);
        }
        Points { all, first }
    }

    /// The point of a face that is nearest, if it has any.
    fn nearest(&self, face: u32, at: Vec3) -> Option<&Point> {
        let range = self.first[face as usize] as usize..self.first[face as usize + 1] as usize;
        self.all[range].iter().min_by(|a, b| a.at.distance_squared(at).total_cmp(&b.at.distance_squared(at)))
    }
}

/// What scatters light: luminances per irradiance.
struct Scatter {
    /// Of each face, from the side that is lit and through it, times π.
    faces: Vec<[f32; 2]>,
    normals: Vec<Vec3>,
    /// What the renderer has for it without transfer.
    law: Law,
}

impl Scatter {
    fn new(mesh: &Mesh, surface: &Surface, bake: &SpeciesBake) -> Self {
        let leafless = !mesh.materials.iter().any(|m| m.foliage);
        let leaf = [luminance(bake.reflectance) as f32, luminance(bake.transmittance) as f32];
        let bark = [luminance(bake.bark_reflectance) as f32, 0.0];
        let of = |material: u32| {
            if leafless || mesh.materials[material as usize].foliage { leaf } else { bark }
        };
        let leaves = bake.crown_leaves().map(luminance);
        Scatter {
            faces: surface.faces.iter().map(|f| of(f.material)).collect(),
            normals: surface
                .faces
                .iter()
                .map(|f| {
                    let [a, b, c] = f.p.map(|p| surface.frame.to_metres(p));
                    (b - a).cross(c - a).normalize_or_zero()
                })
                .collect(),
            law: Law::new(
                bake.crown,
                leaves,
                bake.turned.slope_of().into(),
                luminance(bake.bark_reflectance),
            ),
        }
    }
}

/// The transfer of all views of a species: bands, and texels a side of a view.
pub fn draw(
    mesh: &Mesh,
    surface: &Surface,
    bake: &SpeciesBake,
    (bands, resolution): (u32, u32),
    quiet: bool,
) -> Transfer {
    if bands == 0 {
        return Transfer::default();
    }
    let field = FieldCrown::new(bake, FIELD, 1, 1);
    let suns = suns(surface, &field);
    let points = Points::new(surface, &suns, resolution, quiet);
    let scatter = Scatter::new(mesh, surface, bake);
    let n = bake.views.n;
    let progress = Progress::new("baking light transfer", u64::from(views::count(n)), quiet);
    // By view, band and level.
    let layers: Vec<(Vec<Vec<Vec<u8>>>, Fit)> = rasters(surface, n, resolution, &progress, |raster, view| {
        // Parallel rays of the scaled space along w are parallel to S w.
        let eye = (view.w * surface.frame.scale()).normalize();
        let shown = show(raster, (view, eye), (surface, bake, &field), &suns, (&points, &scatter));
        let (texels, fit) = texels(shown, eye, &suns, TERMS * bands as usize);
        let levels: Vec<Vec<Vec<u8>>> =
            (0..bands as usize).map(|band| mips(&texels, band, resolution as usize)).collect();
        (levels, fit)
    });
    progress.finish();
    let (layers, fits): (Vec<_>, Vec<Fit>) = layers.into_iter().unzip();
    let mut fit = Fit::default();
    fits.iter().for_each(|f| fit.merge(f));
    let level = |band: usize, l: usize| layers.iter().flat_map(|v| v[band][l].iter().copied()).collect();
    let levels = |band| (0..=resolution.ilog2() as usize).map(|l| level(band, l)).collect();
    Transfer { resolution, bands: (0..bands as usize).map(levels).collect(), sent: fit.solve() }
}

/// What each texel shows.
fn show(
    raster: &Raster,
    (view, eye): (&View, Vec3),
    (surface, bake, field): (&Surface, &SpeciesBake, &FieldCrown),
    suns: &[Sun],
    (points, scatter): (&Points, &Scatter),
) -> Vec<Option<Shown>> {
    let law: [(f64, f64, [f64; 2]); LIGHTS] = std::array::from_fn(|k| {
        let angle = light::angle_between(eye.as_dvec3().into(), suns[k].to.as_dvec3().into());
        let terms = correction::terms(eye.z.into(), suns[k].to.z.into(), angle);
        (angle, scatter.law.phase(angle), bake.crown.sent.line(&terms, 1.0))
    });
    let [c, tau] = [bake.crown.leaf_shadow, bake.crown.extinction].map(f64::from);
    let side = (raster.size / SUBSAMPLES) as usize;
    let block = SUBSAMPLES as usize / STRIDE;
    let texel = |texel: usize| {
        let (mut seen, mut middle, mut truth) = (0.0, Vec3::ZERO, [0f32; LIGHTS]);
        for sub in 0..block * block {
            let column = texel % side * SUBSAMPLES as usize + sub % block * STRIDE;
            let row = texel / side * SUBSAMPLES as usize + sub / block * STRIDE;
            let sample = row * raster.size as usize + column;
            let face = raster.faces[sample];
            if face == NO_FACE {
                continue;
            }
            let p = view.point(raster.size, column as u32, row as u32, raster.nearest[sample]);
            let Some(point) = points.nearest(face, surface.frame.to_metres(p)) else { continue };
            seen += 1.0;
            middle += p;
            let normal = scatter.normals[face as usize];
            let normal = if normal.dot(eye) < 0.0 { -normal } else { normal };
            let [reflected, passed] = scatter.faces[face as usize];
            for (k, sun) in suns.iter().enumerate() {
                let cosine = normal.dot(sun.to);
                let radiance = if cosine > 0.0 { reflected * cosine } else { -passed * cosine };
                truth[k] += (point.lit >> k & 1) as f32 * radiance;
            }
        }
        if seen == 0.0 {
            return None;
        }
        // The renderer knows the texel's mean depth.
        middle /= seen;
        let colour = scatter.law.colour(middle.z);
        let plain = std::array::from_fn(|k| {
            let (angle, phase, _) = law[k];
            let way = f64::from(suns[k].way(field, middle));
            (colour * phase * light::self_shadow(angle, way, c, tau)) as f32
        });
        let height = f64::from(middle.z);
        let law = std::array::from_fn(|k| plain[k] * correction::at(law[k].2, height) as f32);
        let truth = truth.map(|t| t / (seen * std::f32::consts::PI));
        Some(Shown { truth, law, plain, height, opacity: seen / (block * block) as f32 })
    };
    (0..side * side).map(texel).collect()
}

/// Coefficients, as many as wanted, of each texel, and its opacity; and what is then amiss of the view's light.
fn texels(
    mut shown: Vec<Option<Shown>>,
    eye: Vec3,
    suns: &[Sun],
    terms: usize,
) -> (Vec<([f64; 8], f32)>, Fit) {
    let mut sums = [[0f32; 2]; LIGHTS];
    for s in shown.iter().flatten() {
        for (k, [truth, law]) in sums.iter_mut().enumerate() {
            *truth += s.opacity * s.truth[k];
            *law += s.opacity * s.law[k];
        }
    }
    let ratios = sums.map(|[truth, law]| if truth > 0.0 { law / truth } else { 0.0 });
    let angles: [f64; LIGHTS] =
        std::array::from_fn(|k| light::angle_between(eye.as_dvec3().into(), suns[k].to.as_dvec3().into()));
    let strength = angles.map(transfer::strength);
    for s in shown.iter_mut().flatten() {
        s.truth.iter_mut().zip(ratios).for_each(|(t, r)| *t *= r);
    }
    let coefficients = |s: &Option<Shown>| match s {
        Some(s) => (fit(suns, s, &strength, terms), s.opacity),
        None => ([0.0; 8], 0.0),
    };
    let texels: Vec<([f64; 8], f32)> = shown.iter().map(coefficients).collect();
    let amiss = amiss(&shown, &texels, eye, (suns, &angles, &strength));
    (texels, amiss)
}

/// What the law with transfer leaves out of what some of a view's texels show, on average as bright as the corrected law makes them. (Points
/// stand for what lies around them, and behind them what is seen may be hidden from a sun that shines on it: their own level is too low by 4 % in an
/// oak and 10 % in a birch, most where view and sun are one direction.)
fn amiss(
    shown: &[Option<Shown>],
    texels: &[([f64; 8], f32)],
    eye: Vec3,
    (suns, angles, strength): (&[Sun], &[f64; LIGHTS], &[f64; LIGHTS]),
) -> Fit {
    let terms: [_; LIGHTS] =
        std::array::from_fn(|k| correction::terms(eye.z.into(), suns[k].to.z.into(), angles[k]));
    let mut fit = Fit::default();
    for (s, (x, opacity)) in shown.iter().zip(texels).step_by(SOME) {
        let Some(s) = s else { continue };
        for (k, sun) in suns.iter().enumerate() {
            let sum: f64 = x.iter().zip(sun.terms).map(|(x, y)| x * y).sum();
            let law = f64::from(s.plain[k]) * (1.0 + strength[k] * sum).max(0.0);
            fit.add(&terms[k], (1.0, s.height, f64::from(*opacity)), (law, s.truth[k].into()));
        }
    }
    fit
}

/// What a texel shows under every sun, by the mesh and by the law.
struct Shown {
    truth: [f32; LIGHTS],
    law: [f32; LIGHTS],
    /// The law without the crown's correction.
    plain: [f32; LIGHTS],
    /// In scaled space.
    height: f64,
    opacity: f32,
}

/// The least squares of the module's head, for the first `n` coefficients: normal equations, by Cholesky's factors.
fn fit(suns: &[Sun], shown: &Shown, strength: &[f64; LIGHTS], n: usize) -> [f64; 8] {
    let (mut h, mut x) = ([[0.0; 8]; 8], [0.0; 8]);
    for k in 0..LIGHTS {
        let (t, g) = (f64::from(shown.truth[k]), f64::from(shown.law[k]));
        let y = suns[k].terms.map(|y| strength[k] * y);
        for i in 0..n {
            x[i] += y[i] * (t - g);
            for j in 0..=i {
                h[i][j] += g * y[i] * y[j];
            }
        }
    }
    // The first term is 1: its entry is the sum over suns of G w2.
    let ridge = 0.5 * h[0][0] / LIGHTS as f64;
    if ridge.is_nan() || ridge <= 1e-20 {
        return [0.0; 8];
    }
    (0..n).for_each(|i| h[i][i] += ridge);
    // The ridge keeps H positive definite.
    least_squares::solve(h, x, n).unwrap_or_default()
}

/// Levels of bytes of one band, down to one texel. Texels that show nothing take what the next level has there, so that
/// filtering blends what is seen only.
fn mips(texels: &[([f64; 8], f32)], band: usize, resolution: usize) -> Vec<Vec<u8>> {
    let four = |x: &[f64; 8]| -> [f64; TERMS] { std::array::from_fn(|i| x[TERMS * band + i]) };
    // Times opacity; and opacity.
    let mut weighted: Vec<Vec<([f64; TERMS], f64)>> =
        vec![texels.iter().map(|(x, a)| (four(x).map(|x| x * f64::from(*a)), f64::from(*a))).collect()];
    let mut size = resolution;
    while size > 1 {
        let (from, half) = (&weighted[weighted.len() - 1], size / 2);
        let next = (0..half * half)
            .map(|i| {
                let at = 2 * (i / half) * size + 2 * (i % half);
                let children = [from[at], from[at + 1], from[at + size], from[at + size + 1]];
                let sum = |c: usize| 0.25 * children.iter().map(|t| t.0[c]).sum::<f64>();
                (std::array::from_fn(sum), 0.25 * children.iter().map(|t| t.1).sum::<f64>())
            })
            .collect();
        weighted.push(next);
        size = half;
    }
    let mut levels: Vec<Vec<u8>> = Vec::new();
    let mut coarser = vec![[0.0; TERMS]];
    for (level, texels) in weighted.iter().enumerate().rev() {
        let size = resolution >> level;
        let filled: Vec<_> = texels
            .iter()
            .enumerate()
            .map(|(i, (sum, opacity))| match *opacity > 0.0 {
                true => sum.map(|x| x / opacity),
                false => coarser[(i / size / 2) * (size / 2).max(1) + (i % size) / 2],
            })
            .collect();
        levels.push(filled.iter().flat_map(|t| transfer::encode(*t)).collect());
        coarser = filled;
    }
    levels.reverse();
    levels
}
