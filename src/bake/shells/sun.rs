//! The sun on what is seen of shells, over what their texels say of it.
//!
//! A texel's transfer past its own crown and what other trees leave of the sun's direction are each a mean over all that is seen of it from straight
//! above, whoever looks. What a viewer sees through a gap is lit through the same gap where the sun is behind him, of the tree itself and of those
//! before it; and what shells show a viewer is not what trees do. So rays go down at both, the trees and their shells, tile by tile as they stand
//! on flat ground, at all shares s of the full density that are kept; and of each of what a side of leaves, or bark, sends on of the sun's
//! irradiance that it faces (ρ E of the side that is seen, τ E of the other), corrections K ([`ShellCorrection`])
//!
//! min Σ (K Ê − E)²/Ê
//!
//! bring what is said Ê to the truth E in the mean over every one of their terms and over all rays, whatever each meets ([`crate::bake::harmonics::seen`] does
//! the same for single trees).

use std::f64::consts::TAU;
use std::sync::Arc;

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::light::LIGHT_TEXELS;
use super::lit::{numbers, sun_past};
use super::march::{March, Stack};
use super::slices::SHARES;
use super::verify::{BLOCK, standing};
use super::{Forest, Shells};
use crate::bake::correction::Fit;
use crate::bake::foliage::Foliage;
use crate::bake::grove::Grove;
use crate::physics::correction::{SHELL_TERMS, ShellCorrection};
use crate::physics::hash::{Stream, hash2};
use crate::physics::light::{angle_between, luminance, side_seen};
use crate::rays;

/// K of what is sent back from the side that is seen, and of what comes through from the other.
pub type SunCorrections = [ShellCorrection; 2];

/// Rays of viewers for each share of the density, at most: what shells send is then known to a hundredth in each eighth of the phase angle.
pub const SUN_RAYS: u32 = 65_536;
/// At least.
const FEWEST_RAYS: u32 = 8192;
/// Of these a random stream; streams are the unit of work.
const CHUNK: u32 = 512;
/// Suns of a ray.
const SUNS: usize = 3;
/// Sine of the lowest elevation of viewers and suns: lower ones look along the tops, and at trees without end.
const LOWEST: f64 = 0.1;
/// Seed of the rays.
const SEED: u32 = 0x5e1f;

/// What a ray finds under a sun.
#[derive(Clone, Copy, Debug)]
struct Sample {
    /// Sines of the elevations of viewer and sun, and the phase angle, rad.
    view: f64,
    sun: f64,
    angle: f64,
    /// Share of the full density.
    share: f64,
    /// What shells say is sent on of the sun's irradiance, by [`SunCorrections`]: luminances.
    said: [f64; 2],
    /// What trees send on.
    truth: [f64; 2],
}

/// What [`super::verify`] finds of the sun that is sent to viewers at phase angles around one, all elevations together.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct SunTold {
    /// Share of the full density.
    pub share: f64,
    /// Phase angles are from here, degrees
    pub from: f64,
    /// to here.
    pub to: f64,
    /// By rays: luminance over the sun's irradiance times the mean share of viewers' rays that meet trees.
    pub truth: f64,
    /// By shells, over that, without corrections.
    pub plain: f64,
    /// With them.
    pub corrected: f64,
}

/// Measures the shells of the trees that have this foliage, tiled by this scene's seed; the same bits on any number of threads.
pub(super) fn measure(
    seed: u32,
    forest: &Forest,
    foliage: &[Arc<Foliage>],
    shells: &Shells,
) -> SunCorrections {
    let samples = samples((seed, forest, foliage), shells, SEED);
    std::array::from_fn(|part| {
        let mut fit = Fit::default();
        for s in samples.iter().filter(|s| s.said[part] > 0.0 || s.truth[part] > 0.0) {
            fit.add_row(&s.terms(), 1.0, (s.said[part], s.truth[part]));
        }
        ShellCorrection { coefficients: fit.coefficients() }
    })
}

/// Holds corrections against rays of another seed, in eighths of the phase angle; the trees as [`measure`] has them.
pub(super) fn check(trees: (u32, &Forest, &[Arc<Foliage>]), shells: &Shells, seed: u32) -> Vec<SunTold> {
    const BINS: usize = 8;
    let samples = samples(trees, shells, seed);
    let told = |(share, bin): (f64, usize)| {
        let edge = |k: usize| 180.0 * k as f64 / BINS as f64;
        let (from, to) = (edge(bin), edge(bin + 1));
        let mine = samples.iter().filter(|s| s.share == share && (from..to).contains(&s.angle.to_degrees()));
        let sums = mine.clone().fold([0.0; 3], |[truth, plain, corrected], s| {
            let by = |of: &dyn Fn(usize) -> f64| of(0) + of(1);
            let k = |part: usize| shells.sun[part].at(&s.terms());
            [
                truth + by(&|part| s.truth[part]),
                plain + by(&|part| s.said[part]),
                corrected + by(&|part| s.said[part] * k(part)),
            ]
        });
        let [truth, plain, corrected] = sums;
        let over = truth.max(1e-9);
        let rays = mine.count().max(1) as f64;
        SunTold { share, from, to, truth: truth / rays, plain: plain / over, corrected: corrected / over }
    };
    shares().flat_map(|share| (0..BINS).map(move |bin| (share, bin))).map(told).collect()
}

/// Those that are kept.
fn shares() -> impl Iterator<Item = f64> {
    (1..=SHARES).map(|k| k as f64 / SHARES as f64)
}

impl Sample {
    fn terms(&self) -> [f64; SHELL_TERMS] {
        ShellCorrection::terms(self.view, self.sun, self.angle, self.share)
    }
}

fn samples(
    (tiling, forest, foliage): (u32, &Forest, &[Arc<Foliage>]),
    shells: &Shells,
    seed: u32,
) -> Vec<Sample> {
    // As far as the lowest ray goes below the tops, and from there a sun's.
    let reach = f64::from(shells.height) / LOWEST / shells.tile_side;
    let margin = (2.0 * reach).ceil() as i32;
    // Coarse shells, whose texels are means of more, are worth fewer: one for four texels of a tile.
    let texels = shells.settings.texels.pow(2) * shells.settings.slices;
    let count = (texels / 4).clamp(FEWEST_RAYS, SUN_RAYS);
    let mut all = Vec::new();
    for share in shares() {
        let trees = standing(&forest.patch, tiling, -margin..BLOCK + margin, share);
        let rays = Rays {
            shells,
            stack: Stack::new(shells, tiling, 0, 0),
            grove: Grove::new(foliage.to_vec(), trees),
            share,
        };
        let chunk = |k: u32| {
            let mut stream = Stream::new(hash2(hash2(seed, k), (SHARES as f64 * share) as u32));
            let mut open = rays::Stack::new();
            (0..CHUNK).flat_map(|_| rays.cast(&mut stream, &mut open)).collect::<Vec<_>>()
        };
        all.par_extend((0..count / CHUNK).into_par_iter().flat_map_iter(chunk));
    }
    all
}

/// Trees and shells of a share of the full density.
struct Rays<'a> {
    shells: &'a Shells,
    stack: Stack<'a>,
    grove: Grove,
    share: f64,
}

impl Rays<'_> {
    /// Sends a viewer's ray down at both.
    fn cast(&self, stream: &mut Stream, open: &mut rays::Stack) -> [Sample; SUNS] {
        let (view, suns) = directions(stream);
        let side = f64::from(BLOCK) * self.shells.tile_side;
        let ground = DVec2::new(side * stream.unit(), side * stream.unit());
        let mut of = suns.map(|sun| Sample {
            view: view.z,
            sun: sun.z,
            angle: angle_between(view.into(), sun.into()),
            share: self.share,
            said: [0.0; 2],
            truth: [0.0; 2],
        });
        self.trees(ground, view, open, suns.iter().zip(&mut of));
        self.slices(ground, view, stream.unit(), suns.iter().zip(&mut of));
        of
    }

    /// What the first tree sends on.
    fn trees<'a>(
        &self,
        ground: DVec2,
        view: DVec3,
        open: &mut rays::Stack,
        suns: impl Iterator<Item = (&'a DVec3, &'a mut Sample)>,
    ) {
        let end = f64::from(self.shells.height) / view.z;
        let from = ground.extend(0.0) + view * end;
        let Some((tree, met)) = self.grove.nearest(from.as_vec3(), -view.as_vec3(), end as f32, open) else {
            return;
        };
        let leaf = self.grove.leaf(tree, &met, -view);
        let sent = [luminance(leaf.reflectance.into()), luminance(leaf.transmittance.into())];
        for (sun, of) in suns {
            let cosine = leaf.normal.dot(*sun);
            let above = leaf.normal * cosine.signum() * leaf.step;
            let part = usize::from(cosine < 0.0);
            if sent[part] > 0.0 && !self.grove.occluded(leaf.point + above.as_vec3(), sun.as_vec3(), open) {
                of.truth[part] = sent[part] * cosine.abs();
            }
        }
    }

    /// What one of the slices sends on, each picked as often as it is what a viewer sees.
    fn slices<'a>(
        &self,
        ground: DVec2,
        view: DVec3,
        mut pick: f64,
        suns: impl Iterator<Item = (&'a DVec3, &'a mut Sample)>,
    ) {
        let covers = self.stack.level(ground, view);
        let mut left = 1.0;
        let seen = covers.iter().enumerate().rev().find(|(_, cover)| {
            let hides = left * (1.0 - March::long(**cover, self.share, view.z));
            pick -= hides;
            left -= hides;
            pick < 0.0
        });
        let Some((slice, _)) = seen else { return };
        let texel = self.stack.texel_at(slice as u32, ground, view, 1);
        let light = self.stack.texel_at(slice as u32, ground, view, LIGHT_TEXELS);
        let Some(numbers) = numbers(self.shells, light) else { return };
        let sent = self.sent(texel);
        for (sun, of) in suns {
            let (own, free) = sun_past(&numbers, *sun);
            let ([seen, same], [above, _]) = (side_seen(of.angle), side_seen(sun.z.acos()));
            let both = (own[0] + own[1]) * free.powf(self.share) * seen / above;
            of.said = [sent[0] * same * both, sent[1] * (1.0 - same) * both];
        }
    }

    /// Reflectance and transmittance of a texel of the finest slices: luminances.
    fn sent(&self, texel: usize) -> [f64; 2] {
        let mip = &self.shells.levels[0][0];
        let cover = f64::from(mip.cover[SHARES * texel + SHARES - 1]).max(1.0);
        [0, 1].map(|k| {
            let image = [&mip.reflected, &mip.passed][k];
            luminance(std::array::from_fn::<f64, 3, _>(|i| {
                (f64::from(image[4 * texel + i]) / cover).min(1.0) * f64::from(self.shells.most[k][i])
            }))
        })
    }
}

/// A viewer and suns: one anywhere, one near the viewer, where most changes, and one opposite, where few would be otherwise.
fn directions(stream: &mut Stream) -> (DVec3, [DVec3; SUNS]) {
    let mut any = || {
        let z = LOWEST + (1.0 - LOWEST) * stream.unit();
        (DVec2::from_angle(TAU * stream.unit()) * (1.0 - z * z).sqrt()).extend(z)
    };
    let (view, sun, [a, b]) = (any(), any(), [any(), any()]);
    let mut near = |to: DVec3, other: DVec3| {
        let d = (to + 2.0 * stream.unit().powi(3) * other).normalize();
        d.with_z(d.z.max(LOWEST)).normalize()
    };
    (view, [sun, near(view, a), near(DVec3::new(-view.x, -view.y, view.z), b)])
}
