//! The sun on what is seen of a model lit by harmonics, over what these say of the same places.
//!
//! A face's transfer is a mean over all places of the face, in bands that tell apart what lies a right angle apart. What is seen of a crown is
//! not such a mean: the leaf that a viewer sees through a gap is lit through the same gap where the sun is behind him, with no mean and no band that
//! would say so. So rays are cast at the model as a viewer's are, from afar, and from the places that they meet to suns: the
//! irradiance E of the side that is seen and of the other against Ê of the face's harmonics, with the bands' ringing cut off as
//! `shaders/physics/received.glsl` has it. Corrections K ([`crate::physics::correction`]) of each side of leaves, and of bark,
//!
//! min Σ (K Ê − E)²/Ê,
//!
//! make good in the mean over every one of their terms what Ê leaves out: Σ Y (K Ê − E) = 0.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::{LARGEST, Transfer, leaves};
use crate::bake::correction::Fit;
use crate::bake::self_shadow::direction;
use crate::bake::surface::{Caster, Surface};
use crate::physics::correction::{Correction, phase_terms};
use crate::physics::crown::Frame;
use crate::physics::harmonics::{evaluate, irradiance};
use crate::physics::hash::{Stream, hash2};
use crate::physics::light;
use crate::physics::views::Basis;
use crate::rays::Stack;
use crate::scene::Mesh;

/// Rays of viewers: what a bin of the phase angle is off by chance is then less than a hundredth of what is seen there, where most light is.
pub(in crate::bake) const RAYS: u32 = 262_144;
/// Of these a random stream; streams are the unit of work.
const CHUNK: u32 = 512;
/// Seed of the rays.
pub(in crate::bake) const SEED: u32 = 0x5ee2;

/// K of the side of leaves that is seen, of their other side, and of bark.
pub type Corrections = [Correction; 3];

/// A place that is seen, under a sun.
#[derive(Clone, Copy, Debug)]
pub(in crate::bake) struct Sample {
    /// Cosines of the zenith angles of viewer and sun.
    pub up: [f64; 2],
    /// Phase angle, rad.
    pub angle: f64,
    /// Height, in scaled space.
    pub height: f64,
    /// By harmonics, irradiance over the sun's of each of [`Corrections`].
    pub said: [f64; 3],
    /// The same as it is.
    pub truth: [f64; 3],
}

/// Measures a model whose faces have these transfers; the same bits on any number of threads.
pub(super) fn measure(mesh: &Mesh, surface: &Surface, faces: &[[Transfer; 2]]) -> Corrections {
    fit(&Model::new(mesh, surface, faces).samples(SEED, directions))
}

/// Corrections that bring what harmonics say to the truth.
pub(in crate::bake) fn fit(samples: &[Sample]) -> Corrections {
    std::array::from_fn(|part| {
        let mut fit = Fit::default();
        for s in samples.iter().filter(|s| s.said[part] > 0.0 || s.truth[part] > 0.0) {
            let terms = phase_terms(s.up[0], s.up[1], s.angle);
            fit.add(&terms, (1.0, s.height, 1.0), (s.said[part], s.truth[part]));
        }
        fit.solve()
    })
}

/// A viewer and suns: one anywhere, one near the viewer, where most changes, and one opposite, where few would be otherwise.
pub(in crate::bake) fn directions(stream: &mut Stream) -> (DVec3, [DVec3; 3]) {
    let view = direction(stream);
    let mut near = |to: DVec3| {
        let away = stream.unit();
        (to + 2.0 * away.powi(3) * direction(stream)).normalize()
    };
    let (same, opposite) = (near(view), near(DVec3::new(-view.x, -view.y, view.z)));
    (view, [direction(stream), same, opposite])
}

/// Collects what [`RAYS`] find that come from afar, as dense all over a model as seen from there, towards viewers and under suns in `directions`:
/// `found` is given where a ray begins, m about the trunk's base, and both directions.
pub(in crate::bake) fn cast<T: Send, const N: usize>(
    frame: Frame,
    seed: u32,
    directions: impl Fn(&mut Stream) -> (DVec3, [DVec3; N]) + Sync,
    found: impl Fn(Vec3, DVec3, [DVec3; N], &mut Stack) -> Option<[T; N]> + Sync,
) -> Vec<T> {
    let one = |stream: &mut Stream, stack: &mut Stack| {
        let (view, suns) = directions(stream);
        let basis = Basis::new((view / frame.scale().as_dvec3()).normalize());
        let (a, b) = (2.0 * stream.unit() - 1.0, 2.0 * stream.unit() - 1.0);
        let origin = basis.right * a + basis.up * (b * basis.extent);
        // From beyond the cylinder, which is no farther than √2 from its centre.
        found(frame.to_metres((origin + 2.0 * basis.w).as_vec3()), view, suns, stack)
    };
    let chunk = |k: u32| {
        let (mut stream, mut stack) = (Stream::new(hash2(seed, k)), Stack::new());
        (0..CHUNK).filter_map(|_| one(&mut stream, &mut stack)).flatten().collect::<Vec<T>>()
    };
    (0..RAYS / CHUNK).into_par_iter().flat_map_iter(chunk).collect()
}

/// A model that rays are cast at, and the transfers of its faces.
pub(in crate::bake) struct Model<'a> {
    surface: &'a Surface,
    caster: Caster<'a>,
    leaf_of: Vec<Option<u32>>,
    faces: &'a [[Transfer; 2]],
}

impl<'a> Model<'a> {
    pub fn new(mesh: &Mesh, surface: &'a Surface, faces: &'a [[Transfer; 2]]) -> Self {
        let (leaf_of, _) = leaves(mesh, surface, LARGEST);
        Model { surface, caster: Caster::new(surface), leaf_of, faces }
    }

    /// What is seen of it along directions of viewers, under each one's suns.
    pub fn samples<const N: usize>(
        &self,
        seed: u32,
        directions: impl Fn(&mut Stream) -> (DVec3, [DVec3; N]) + Sync,
    ) -> Vec<Sample> {
        cast(self.surface.frame, seed, directions, |from, view, suns, stack| {
            let eye = view.as_vec3();
            let met = self.caster.first(from, -eye, stack)?;
            Some(suns.map(|sun| self.sample((from - eye * met.t, met.face), view, sun, stack)))
        })
    }

    /// A place that is seen on a face, under a sun.
    fn sample(&self, (place, face): (Vec3, u32), view: DVec3, sun: DVec3, stack: &mut Stack) -> Sample {
        let (normal, leaf) = (self.caster.normal(face), self.leaf_of[face as usize].is_some());
        let front = normal.dot(view.as_vec3()) >= 0.0;
        // Bark is lit as its front is, whichever side is seen.
        let sides = if front || !leaf { [0, 1] } else { [1, 0] };
        let light = evaluate(sun.into());
        let faces = self.faces[face as usize];
        let hidden = self.caster.occluded(place, sun.as_vec3(), 1e-4 * self.surface.frame.half_height, stack);
        let cosine = f64::from(normal.dot(sun.as_vec3()));
        let towards = if front { cosine } else { -cosine };
        let of = |[seen, other]: [f64; 2]| if leaf { [seen, other, 0.0] } else { [0.0, 0.0, seen] };
        Sample {
            up: [view.z, sun.z],
            angle: light::angle_between(view.into(), sun.into()),
            height: f64::from(self.surface.frame.to_scaled(place).z),
            // As `shaders/physics/received.glsl` has it.
            said: of(sides.map(|side| irradiance(&faces[side].map(f64::from), &light).max(0.0))),
            truth: if hidden { [0.0; 3] } else { of([towards.max(0.0), (-towards).max(0.0)]) },
        }
    }
}

#[cfg(test)]
mod tests;
