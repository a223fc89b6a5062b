//! How well levels of detail stand for the whole mesh, each at the apparent height where it is drawn.

use glam::DVec3;
use rayon::prelude::*;

use super::Levels;
use super::coverage::{self, MARGIN, silhouette};
use crate::bake::SpeciesBake;
use crate::bake::envelope::Envelopes;
use crate::bake::raster::{NO_FACE, Raster, SUBSAMPLES};
use crate::bake::surface::Surface;
use crate::physics::leaf::{Directions, Leaf, Sun, hemisphere, scattering};
use crate::physics::levels::{bark_level, pull};
use crate::physics::light::luminance;
use crate::scene::Mesh;
use crate::{Error, Result};

/// Shares of the leaves that are looked at.
const SHARES: [f64; 5] = [1.0, 0.5, 0.25, 0.125, 0.0625];
/// Light by which radiances are compared: towards a sun of irradiance 1, in scaled tree space, and radiance of an even sky.
const SUN: DVec3 = DVec3::new(0.6, 0.0, 0.8);
const SKY: f64 = 0.1;
/// Most pixels along a side of a picture.
const MOST_PIXELS: f64 = 512.0;

/// A level from one direction, over the whole mesh.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Agreement {
    /// Samples covered.
    pub coverage: f64,
    /// Intersection over union of the silhouettes (pixels of which at least a half is covered).
    pub iou: f64,
    /// Mean radiance of what is covered.
    pub radiance: f64,
}

/// A level of detail.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct LevelQuality {
    /// Share of the leaves.
    pub share: f64,
    /// Height of a tree of middle size at which it is drawn, pixels.
    pub height_px: f64,
    /// Triangles of leaves.
    pub leaf_triangles: usize,
    /// Factor of how far cards are from the middle of all leaves.
    pub pull: f64,
    /// Level of bark, 0 the whole.
    pub bark_level: usize,
    /// Its triangles.
    pub bark_triangles: usize,
    /// Its error, m.
    pub bark_error_m: f64,
    /// Mean over the directions.
    pub mean: Agreement,
    /// The least of each, and the greatest.
    pub range: [Agreement; 2],
}

/// What is looked at.
pub struct Seen<'a> {
    /// The model.
    pub mesh: &'a Mesh,
    /// Its optics.
    pub bake: &'a SpeciesBake,
    /// The crown around its leaves.
    pub envelopes: &'a Envelopes,
    /// Its levels of detail.
    pub levels: &'a Levels,
}

/// Compares levels with the whole mesh from `directions` directions over the upper hemisphere, lit by what their envelopes leave of sun and sky, where trees are drawn
/// of which a card has `leaf_pixels` pixels on a side at first.
///
/// # Errors
/// [`Error::Usage`] for a mesh without extent.
pub fn verify(of: &Seen, directions: usize, leaf_pixels: f64) -> Result<Vec<LevelQuality>> {
    let surface = Surface::new(of.mesh)?;
    let rule = Directions::new(of.envelopes.directions)
        .ok_or_else(|| Error::Usage("envelopes have 8, 14 or 26 directions".into()))?;
    let light = Light::new(of, &surface, &rule);
    Ok(SHARES.iter().map(|share| level(of, &surface, &light, directions, (*share, leaf_pixels))).collect())
}

fn level(
    of: &Seen,
    surface: &Surface,
    light: &Light,
    directions: usize,
    (share, leaf_pixels): (f64, f64),
) -> LevelQuality {
    let levels = of.levels;
    let metre = leaf_pixels.max(1.0) * share.sqrt() / levels.cards.side;
    let height = 2.0 * f64::from(surface.frame.half_height) * metre;
    let bark = bark_level(levels.bark.iter().map(|b| b.error), metre, share);
    let pull = pull(&levels.pull, share);
    let (drawn, like) = levels.surface(surface, share, pull, bark);
    let whole: Vec<u32> = (0..surface.faces.len() as u32).collect();
    let resolution = (f64::from(MARGIN) * height).clamp(16.0, MOST_PIXELS) as u32;
    let compare = |rasters: &mut [Raster; 2], towards: DVec3| {
        let viewer = (towards * surface.frame.scale().as_dvec3()).normalize();
        let [first, second] = rasters;
        let seen = silhouette(surface, towards, resolution, first);
        let other = silhouette(&drawn, towards, resolution, second);
        let radiance = [light.mean(surface, &whole, seen, viewer), light.mean(&drawn, &like, other, viewer)];
        let [a, b] = [seen, other].map(|faces| faces.iter().filter(|f| **f != NO_FACE).count() as f64);
        Agreement {
            coverage: b / a.max(1.0),
            iou: overlap(seen, other, resolution),
            radiance: radiance[1] / radiance[0].max(1e-12),
        }
    };
    let rasters = || [Raster::new(resolution), Raster::new(resolution)];
    let each: Vec<Agreement> =
        coverage::directions(directions).into_par_iter().map_init(rasters, |r, w| compare(r, w)).collect();
    let bark_triangles = levels.bark[bark].kept.len() + levels.bark[bark].new.len();
    LevelQuality {
        share,
        height_px: height,
        leaf_triangles: drawn.faces.len() - bark_triangles,
        pull,
        bark_level: bark,
        bark_triangles,
        bark_error_m: levels.bark[bark].error,
        mean: fold(&each, 0.0, |a, b| a + b / each.len() as f64),
        range: [fold(&each, f64::INFINITY, f64::min), fold(&each, f64::NEG_INFINITY, f64::max)],
    }
}

fn fold(each: &[Agreement], from: f64, step: impl Fn(f64, f64) -> f64) -> Agreement {
    let of = |part: fn(&Agreement) -> f64| each.iter().map(part).fold(from, &step);
    Agreement { coverage: of(|a| a.coverage), iou: of(|a| a.iou), radiance: of(|a| a.radiance) }
}

/// Intersection over union of two pictures' pixels that are at least half covered.
fn overlap(a: &[u32], b: &[u32], resolution: u32) -> f64 {
    let size = (resolution * SUBSAMPLES) as usize;
    let mut counts = vec![[0u32; 2]; (resolution * resolution) as usize];
    for (which, faces) in [a, b].into_iter().enumerate() {
        for (k, _) in faces.iter().enumerate().filter(|(_, f)| **f != NO_FACE) {
            let [row, column] = [k / size, k % size].map(|at| at / SUBSAMPLES as usize);
            counts[row * resolution as usize + column][which] += 1;
        }
    }
    let is = |count: u32| 2 * count >= SUBSAMPLES * SUBSAMPLES;
    let both = counts.iter().filter(|c| is(c[0]) && is(c[1])).count();
    let either = counts.iter().filter(|c| is(c[0]) || is(c[1])).count();
    if either == 0 { 1.0 } else { both as f64 / either as f64 }
}

/// Sun and sky on leaves and bark, as their envelopes leave them (BBP08 eq. 6 and 8).
struct Light<'a> {
    of: &'a Seen<'a>,
    leaf: Leaf,
    bark: Leaf,
    sun: [f64; 3],
    towards: Sun,
    half: Vec<[f64; 3]>,
}

impl<'a> Light<'a> {
    fn new(of: &'a Seen, surface: &Surface, rule: &Directions) -> Self {
        let sun = (SUN * surface.frame.scale().as_dvec3()).normalize().to_array();
        let [r, t, bark] =
            [of.bake.reflectance, of.bake.transmittance, of.bake.bark_reflectance].map(luminance);
        let leaf = Leaf::uniform(r, t);
        let bark = Leaf { reflectance: [bark, 0.0], transmittance: [0.0; 2] };
        Light { of, leaf, bark, sun, towards: Sun::new(rule, leaf, sun), half: rule.half(true) }
    }

    /// Mean radiance towards a viewer of what samples see.
    fn mean(&self, surface: &Surface, like: &[u32], seen: &[u32], viewer: DVec3) -> f64 {
        let mut known = vec![f64::NAN; surface.faces.len()];
        let (mut sum, mut count) = (0.0, 0u32);
        for face in seen.iter().filter(|f| **f != NO_FACE) {
            let at = *face as usize;
            if known[at].is_nan() {
                known[at] = self.radiance(surface, at, like[at], viewer);
            }
            sum += known[at];
            count += 1;
        }
        sum / f64::from(count.max(1))
    }

    fn radiance(&self, surface: &Surface, face: usize, like: u32, viewer: DVec3) -> f64 {
        let parts = &self.of.envelopes.parts;
        let is_leaf = (parts.of[like as usize] as usize) < parts.leaves;
        let [a, b, c] = surface.faces[face].p.map(|p| (p * surface.frame.scale()).as_dvec3());
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let normal = if !is_leaf && normal.dot(viewer) < 0.0 { -normal } else { normal };
        let (n, side) = (normal.to_array(), usize::from(normal.dot(viewer) < 0.0));
        let leaf = if is_leaf { self.leaf } else { self.bark };
        let envelope = self.of.envelopes.seen(like, viewer.z);
        let lit = hemisphere(&self.half, true, n, |k| (-envelope[k]).exp());
        let sky: f64 = (0..2).map(|from| leaf.scattered(from, side) * lit[from]).sum();
        SKY * sky + scattering(leaf, n, viewer.to_array(), self.sun) * self.towards.visible(&envelope)
    }
}
