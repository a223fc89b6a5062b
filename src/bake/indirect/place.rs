//! Paths among trees that stand around a place, on level ground.

use std::f64::consts::{FRAC_1_PI, TAU};

use glam::{DVec3, Vec3};

use crate::bake::grove::Grove;
use crate::physics::hash::Stream;
use crate::rays::Stack;

/// Surfaces before Russian roulette begins, and after which a path ends.
const SURE: u32 = 2;
const LONGEST: u32 = 64;
/// Rays leave the ground at this height, m.
pub(super) const GROUND_STEP: f64 = 1e-4;
/// Rays to the sky from each place that a ray meets: yes and no vary more than light that is summed up along a path.
const SKY_RAYS: u32 = 8;

/// A surface on a path.
#[derive(Clone, Copy)]
pub(super) struct Met {
    pub at: DVec3,
    pub normal: DVec3,
    pub step: f64,
    pub reflectance: Vec3,
    pub transmittance: Vec3,
    pub thin: bool,
}

/// Trees around the origin, on level ground.
pub(super) struct Place {
    pub grove: Grove,
    pub ground: Vec3,
}

impl Place {
    /// The nearest surface on a ray.
    pub fn nearest(&self, from: DVec3, direction: DVec3, stack: &mut Stack) -> Option<Met> {
        let end = if direction.z < 0.0 { (-from.z / direction.z).max(0.0) } else { f64::from(f32::MAX) };
        let limit = end.min(f64::from(f32::MAX)) as f32;
        if let Some((tree, met)) = self.grove.nearest(from.as_vec3(), direction.as_vec3(), limit, stack) {
            return Some(self.leaf(tree, &met, direction));
        }
        (direction.z < 0.0).then(|| Met {
            at: (from + direction * end).with_z(0.0),
            normal: DVec3::Z,
            step: GROUND_STEP,
            reflectance: self.ground,
            transmittance: Vec3::ZERO,
            thin: false,
        })
    }

    pub fn leaf(&self, tree: u32, met: &crate::rays::Met, direction: DVec3) -> Met {
        let leaf = self.grove.leaf(tree, met, direction);
        Met {
            at: leaf.point.as_dvec3(),
            normal: leaf.normal,
            step: leaf.step,
            reflectance: leaf.reflectance,
            transmittance: leaf.transmittance,
            thin: leaf.thin,
        }
    }

    /// Whether a way up is free.
    pub fn open(&self, from: DVec3, direction: DVec3, stack: &mut Stack) -> bool {
        direction.z > 0.0 && !self.grove.occluded(from.as_vec3(), direction.as_vec3(), stack)
    }

    /// Whether nothing is on a way of so many metres.
    pub fn free(&self, from: DVec3, direction: DVec3, metres: f64, stack: &mut Stack) -> bool {
        self.grove.nearest(from.as_vec3(), direction.as_vec3(), metres as f32, stack).is_none()
    }

    /// Radiance that a surface sends where a path came from, per irradiance of the sun, straight from it.
    pub fn sent(&self, met: &Met, sun: DVec3, stack: &mut Stack) -> Vec3 {
        let cosine = met.normal.dot(sun);
        let scattered = if cosine > 0.0 { met.reflectance } else { met.transmittance };
        let from = met.at + met.normal * met.step.copysign(cosine);
        if scattered != Vec3::ZERO && self.open(from, sun, stack) {
            scattered * (cosine.abs() * FRAC_1_PI) as f32
        } else {
            Vec3::ZERO
        }
    }

    /// Light that a surface sends where a path came from, after it met others: of a sun of irradiance 1, and of a sky of radiance 1.
    pub fn handed(&self, first: Met, sun: DVec3, stream: &mut Stream, stack: &mut Stack) -> [Vec3; 2] {
        let (mut met, mut weight) = (first, Vec3::ONE);
        let mut light = [Vec3::ZERO; 2];
        for surface in 0..LONGEST {
            if surface > 0 {
                light[0] += weight * self.sent(&met, sun, stack);
            }
            let Some((from, away)) = scattered(&met, &mut weight, surface >= SURE, stream) else { break };
            match self.nearest(from, away, stack) {
                Some(next) => met = next,
                None => {
                    light[1] += if surface > 0 && away.z > 0.0 { weight } else { Vec3::ZERO };
                    break;
                }
            }
        }
        light
    }
}

/// Where a path goes on from a surface; `None` where it ends. Its weight becomes that of what it will meet.
pub(super) fn scattered(
    met: &Met,
    weight: &mut Vec3,
    may_end: bool,
    stream: &mut Stream,
) -> Option<(DVec3, DVec3)> {
    let (reflected, passed) = (*weight * met.reflectance, *weight * met.transmittance);
    let (r, t) = (reflected.element_sum(), passed.element_sum());
    if r + t <= 0.0 {
        return None;
    }
    let chance = r / (r + t);
    let through = stream.unit() as f32 >= chance;
    *weight = if through { passed / (1.0 - chance) } else { reflected / chance };
    if may_end {
        // Twice the weight, so that the few bright paths are followed.
        let sure = (2.0 * weight.max_element()).min(1.0);
        if stream.unit() as f32 >= sure {
            return None;
        }
        *weight /= sure;
    }
    let normal = if through { -met.normal } else { met.normal };
    Some((met.at + normal * met.step, (normal + sphere(stream)).normalize_or(normal)))
}

/// Share of the directions in which a surface scatters where the sky is.
pub(super) fn open(place: &Place, met: &Met, stream: &mut Stream, stack: &mut Stack) -> f32 {
    let mut sky = || {
        let (from, away) = scattered(met, &mut { Vec3::ONE }, false, stream)?;
        place.open(from, away, stack).then_some(())
    };
    (0..SKY_RAYS).filter(|_| sky().is_some()).count() as f32 / SKY_RAYS as f32
}

/// A direction anywhere. A unit vector more than a normal has the density of the cosine to it.
pub(super) fn sphere(stream: &mut Stream) -> DVec3 {
    let (z, turn) = (2.0 * stream.unit() - 1.0, TAU * stream.unit());
    let r = (1.0 - z * z).sqrt();
    DVec3::new(r * turn.cos(), r * turn.sin(), z)
}
