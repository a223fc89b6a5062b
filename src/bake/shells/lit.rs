//! Light on what texels show, from their bytes, against rays cast at the same trees from all samples of a texel.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use glam::{DVec2, DVec3, Vec2, Vec3};
use rayon::prelude::*;

use super::light::{LIGHT, LIGHT_TEXELS, foliage, grove, range};
use super::slices::{SAMPLES, SHARES, Samples, Seen, Window};
use super::verify::mean;
use super::{Forest, Shells};
use crate::Result;
use crate::bake::envelope::{LARGEST, leaves};
use crate::bake::foliage::Foliage;
use crate::bake::grove::Grove;
use crate::bake::surface::Caster;
use crate::land::pattern::TILES;
use crate::physics::harmonics::{KEPT, evaluate, even_sky, irradiance};
use crate::physics::hash::Stream;
use crate::rays;
use crate::scene::Scene;

/// Elevations of suns, degrees; in every texel from another side. The last light is an even sky of radiance 1/π.
const SUNS: [f64; 4] = [10.0, 25.0, 45.0, 70.0];
/// Lights.
const LIGHTS: usize = SUNS.len() + 1;
/// Directions of the sky that each sample looks in.
const SKY: u32 = 4;

/// What bytes tell of light, against rays.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Told {
    /// Mean by rays over texels, each as much as its cover.
    pub truth: f64,
    /// That of the bytes less that.
    pub difference: f64,
    /// Standard error of the difference.
    pub error: f64,
    /// Root of the mean square of the difference.
    pub rms: f64,
}

/// Light of one source on one side of what texels of the finest slices show.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Lit {
    /// Elevation of the sun, degrees; none: an even sky.
    pub elevation: Option<f64>,
    /// Whether it is the side that is seen from above.
    pub seen: bool,
    /// Irradiance past the own crown alone, over that of a surface that faces the sun, or of open level ground under the sky.
    pub own: Told,
    /// Share of the sun that other trees leave, or of what the own crown leaves of the sky.
    pub free: Told,
    /// Irradiance past all trees.
    pub both: Told,
}

/// Of one texel, one light and one side, by rays and by bytes: past the own crown, past other trees, past both.
#[derive(Clone, Copy, Default)]
struct Found {
    truth: [f64; 3],
    told: [f64; 3],
}

/// A texel: its cover, and what was found by light and side.
type FoundTexel = (f64, [[Found; 2]; LIGHTS]);

/// Looks at so many texels of the ground, in all slices.
///
/// # Errors
/// [`crate::Error::Usage`] for a model without extent.
pub(super) fn lit(scene: &Scene, shells: &Shells, forest: &Forest, columns: u32) -> Result<Vec<Lit>> {
    let trees = Trees::new(scene, forest)?;
    let seen: Vec<Vec<FoundTexel>> =
        (0..columns).into_par_iter().map(|column| trees.column(shells, forest, column)).collect();
    let all = (0..LIGHTS).flat_map(|light| [0, 1].map(|side| (light, side)));
    let told = |part: usize, light: usize, side: usize| {
        let cover = seen.iter().flatten().map(|t| t.0).sum::<f64>().max(1e-9);
        let sum = |of: &dyn Fn(&Found) -> f64| {
            seen.iter().flatten().map(|(w, found)| w * of(&found[light][side])).sum::<f64>() / cover
        };
        let off = |f: &Found| f.told[part] - f.truth[part];
        // Slices of a column are lit alike: chance is in the columns.
        let columns = seen.iter().map(|c| {
            let sum: f64 = c.iter().map(|(w, found)| w * off(&found[light][side])).sum();
            sum * seen.len() as f64 / cover
        });
        let (difference, error) = mean(columns.collect::<Vec<_>>().into_iter());
        Told { truth: sum(&|f| f.truth[part]), difference, error, rms: sum(&|f| off(f).powi(2)).sqrt() }
    };
    let lit = |(light, side)| Lit {
        elevation: SUNS.get(light).copied(),
        seen: side == 0,
        own: told(0, light, side),
        free: told(1, light, side),
        both: told(2, light, side),
    };
    Ok(all.map(lit).collect())
}

/// The trees, as single rays meet them.
struct Trees<'a> {
    casters: Vec<Caster<'a>>,
    /// The leaf of each face of each species, if it is one.
    leaves: Vec<Vec<Option<u32>>>,
    foliage: Vec<Arc<Foliage>>,
}

impl<'a> Trees<'a> {
    fn new(scene: &Scene, forest: &'a Forest) -> Result<Self> {
        let leaf = |(s, k): (&crate::scene::Species, &super::Kind)| leaves(&s.mesh, &k.surface, LARGEST).0;
        Ok(Trees {
            casters: forest.kinds.iter().map(|k| Caster::new(&k.surface)).collect(),
            leaves: scene.species.iter().zip(&forest.kinds).map(leaf).collect(),
            foliage: foliage(scene)?,
        })
    }

    /// All slices of a texel of the ground that chance picks.
    fn column(&self, shells: &Shells, forest: &Forest, column: u32) -> Vec<FoundTexel> {
        let mut stream = Stream::new(column);
        let side = shells.settings.texels / LIGHT_TEXELS;
        let mut pick = |n: u32| ((stream.unit() * f64::from(n)) as u32).min(n - 1);
        let (kind, x, y) = (pick(TILES as u32) as usize, pick(side), pick(side));
        let texel = (shells.tile_side / f64::from(shells.settings.texels)) as f32;
        let window = Window {
            low: Vec2::new(x as f32, y as f32) * (texel * LIGHT_TEXELS as f32),
            texel,
            size: [LIGHT_TEXELS; 2],
            slices: shells.settings.slices,
            height: shells.height,
        };
        let samples = Samples::paint(&forest.kinds, &forest.patch.tiles[kind], window);
        let grove = grove(&self.foliage, forest, kind);
        let suns = SUNS.map(|elevation| {
            let (sin, cos) = elevation.to_radians().sin_cos();
            (DVec2::from_angle(TAU * stream.unit()) * cos).extend(sin)
        });
        let mut found = Vec::new();
        samples.blocks(LIGHT_TEXELS, |slab, _, seen| {
            let at = (kind as u32 * shells.settings.slices + slab) * side.pow(2) + y * side + x;
            let Some(numbers) = numbers(shells, at as usize) else { return };
            let mut of = [[Found::default(); 2]; LIGHTS];
            told(&mut of, &numbers, &suns);
            self.truth(&mut of, (&grove, seen), &suns, &mut stream);
            found.push((seen.len() as f64 / f64::from((LIGHT_TEXELS * SAMPLES).pow(2)), of));
        });
        found
    }

    /// By rays from all samples.
    fn truth(
        &self,
        of: &mut [[Found; 2]; LIGHTS],
        (grove, seen): (&Grove, &[(Vec3, Seen)]),
        suns: &[DVec3],
        stream: &mut Stream,
    ) {
        let part = 1.0 / seen.len() as f64;
        let mut open = rays::Stack::new();
        for (place, sample) in seen {
            let normal = self.normal(grove, sample);
            for (k, sun) in suns.iter().enumerate() {
                let free = !grove.occluded_by_others(sample.tree, *place, sun.as_vec3(), &mut open);
                let own = self.past_own(grove, (*place, sample), *sun, &mut open);
                for (side, normal) in [normal, -normal].into_iter().enumerate() {
                    let cosine = normal.dot(*sun).max(0.0);
                    of[k][side].truth[0] += part * f64::from(u8::from(own)) * cosine;
                    of[k][side].truth[1] += part * f64::from(u8::from(free));
                    of[k][side].truth[2] += part * f64::from(u8::from(own && free)) * cosine;
                }
            }
            for (side, _) in (0..2).flat_map(|side| (0..SKY).map(move |k| (side, k))) {
                let to = cosine_direction([normal, -normal][side], stream);
                if to.z > 0.0 && self.past_own(grove, (*place, sample), to, &mut open) {
                    let free = !grove.occluded_by_others(sample.tree, *place, to.as_vec3(), &mut open);
                    of[LIGHTS - 1][side].truth[0] += part / f64::from(SKY);
                    of[LIGHTS - 1][side].truth[2] += part / f64::from(SKY) * f64::from(u8::from(free));
                }
            }
        }
        for sky in &mut of[LIGHTS - 1] {
            sky.truth[1] = sky.truth[2] / sky.truth[0].max(1e-9);
        }
    }

    /// Unit normal of the side that faces up.
    fn normal(&self, grove: &Grove, sample: &Seen) -> DVec3 {
        let tree = &grove.trees[sample.tree as usize];
        let n = tree.to_grove(self.casters[tree.species as usize].normal(sample.face)).as_dvec3().normalize();
        if n.z >= 0.0 { n } else { -n }
    }

    /// Whether a ray leaves the tree that it starts from; a leaf does not hide itself.
    fn past_own(
        &self,
        grove: &Grove,
        (place, sample): (Vec3, &Seen),
        to: DVec3,
        open: &mut rays::Stack,
    ) -> bool {
        let tree = &grove.trees[sample.tree as usize];
        let (species, face) = (tree.species as usize, sample.face);
        let leaf = self.leaves[species][face as usize];
        let own = |other| other == face || leaf.is_some() && self.leaves[species][other as usize] == leaf;
        let (o, d) = (tree.to_mesh(place - tree.base), tree.to_mesh(to.as_vec3()));
        !self.casters[species].occluded_by_others(o, d, &own, open)
    }
}

/// Numbers of a texel of the finest light, which its cover's bytes are divided out of; `None` where they have none.
pub(super) fn numbers(shells: &Shells, texel: usize) -> Option<[f64; LIGHT]> {
    let (light, cover) = (&shells.light[0][0], &shells.levels[0][LIGHT_TEXELS.ilog2() as usize].cover);
    let cover = f64::from(cover[SHARES * texel + SHARES - 1]) / 255.0;
    let number = |k: usize| {
        let byte = light.images[k / 4][4 * texel + k % 4].cast_signed();
        f64::from(byte) * range(k) / 127.0 / cover
    };
    (cover > 0.0).then(|| std::array::from_fn(number))
}

/// By a texel's numbers what of a sun gets past the own crown, on either side, and the share that other trees leave.
pub(super) fn sun_past(numbers: &[f64; LIGHT], sun: DVec3) -> ([f64; 2], f64) {
    let y = evaluate(sun.into());
    let of = |k: usize| irradiance(&numbers[k * KEPT..(k + 1) * KEPT], &y);
    ([of(0).max(0.0), of(1).max(0.0)], of(2).clamp(0.0, 1.0))
}

/// By a texel's numbers, as a renderer would.
fn told(of: &mut [[Found; 2]; LIGHTS], numbers: &[f64; LIGHT], suns: &[DVec3]) {
    for (side, own) in numbers.chunks_exact(KEPT).take(2).enumerate() {
        for (k, sun) in suns.iter().enumerate() {
            let (own, free) = sun_past(numbers, *sun);
            of[k][side].told = [own[side], free, own[side] * free];
        }
        let (own, free) = ((irradiance(own, &even_sky()) / PI).max(0.0), numbers[LIGHT - 1]);
        of[LIGHTS - 1][side].told = [own, free, own * free];
    }
}

/// A direction above a normal, as likely as its cosine.
fn cosine_direction(normal: DVec3, stream: &mut Stream) -> DVec3 {
    let (out, turn) = (stream.unit(), TAU * stream.unit());
    let (a, b) = normal.any_orthonormal_pair();
    (a * turn.cos() + b * turn.sin()) * out.sqrt() + normal * (1.0 - out).sqrt()
}
