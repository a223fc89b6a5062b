//! One path of light, backwards from the eye; see the equations in [`super`].

use std::f32::consts::FRAC_1_PI;

use glam::{DVec3, Vec3};

use super::sampling::Random;
use super::world::{Hit, World};
use super::{Light, Options};
use crate::rays::Stack;

/// Surfaces before Russian roulette begins.
const SURE: u32 = 3;
/// A path goes on with the largest part of its weight times this as its chance: dark leaves rarely see more than four orders.
const BOLDNESS: f32 = 2.0;
/// Surfaces after which no path is sure to go on, whatever its weight: white walls could hold one for ever.
const LONG: u32 = 1024;

/// What the first surface along a path is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct First {
    /// Distance from the eye, m.
    pub t: f64,
    /// Species, if it is a tree.
    pub species: Option<u32>,
    /// Whether the sun shines on it.
    pub lit: bool,
}

/// What a path found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sample {
    /// Radiance from the sun.
    pub sun: Vec3,
    /// Radiance from the sky.
    pub sky: Vec3,
    /// The first surface, if any.
    pub first: Option<First>,
    /// Rays traced.
    pub rays: u32,
}

impl World {
    /// Follows a path from the eye.
    pub(super) fn trace(
        &self,
        origin: DVec3,
        direction: DVec3,
        options: &Options,
        random: &mut Random,
        stack: &mut Stack,
    ) -> Sample {
        let mut sample = Sample { sun: Vec3::ZERO, sky: Vec3::ZERO, first: None, rays: 1 };
        let Some(mut hit) = self.nearest(origin, direction, stack) else {
            if options.light != Light::Sun {
                sample.sky = self.sky.radiance(direction);
            }
            return sample;
        };
        let last = options.bounces.unwrap_or(u32::MAX);
        let has_sun = self.light.sun.iter().any(|e| *e > 0.0);
        let irradiance = Vec3::from(self.light.sun.map(|e| e as f32));
        let mut weight = Vec3::ONE;
        for surface in 1u32.. {
            let is_first = surface == 1;
            let mut lit = false;
            if has_sun && (is_first || options.light != Light::Sky) {
                let towards = DVec3::from(self.light.direction);
                let cosine = hit.normal.dot(towards);
                let scattered = if cosine > 0.0 { hit.reflectance } else { hit.transmittance };
                // Bark and ground that turn away from the sun are dark without asking.
                if (cosine > 0.0 || hit.thin) && (is_first || scattered != Vec3::ZERO) {
                    sample.rays += 1;
                    lit = !self.occluded(leave(&hit, cosine > 0.0), towards, stack);
                }
                if lit && options.light != Light::Sky {
                    sample.sun += weight * scattered * irradiance * (FRAC_1_PI * cosine.abs() as f32);
                }
            }
            if is_first {
                sample.first = Some(First { t: hit.t, species: hit.species, lit });
            }
            // The last surface is still lit by the sky, but by nothing beyond.
            if surface == last && options.light == Light::Sun {
                break;
            }
            let Some((away, through)) = scatter(&hit, &mut weight, random) else { break };
            if surface >= SURE {
                let most = if surface >= LONG { 0.98 } else { 1.0 };
                let chance = (BOLDNESS * weight.max_element()).min(most);
                if random.unit() >= f64::from(chance) {
                    break;
                }
                weight /= chance;
            }
            let from = leave(&hit, !through);
            sample.rays += 1;
            if surface == last {
                if away.z > 0.0 && !self.occluded(from, away, stack) {
                    sample.sky += weight * self.sky.radiance(away);
                }
                break;
            }
            match self.nearest(from, away, stack) {
                Some(next) => hit = next,
                None => {
                    // Under the horizon, beyond the end of the terrain, nothing shines.
                    if away.z > 0.0 && options.light != Light::Sun {
                        sample.sky += weight * self.sky.radiance(away);
                    }
                    break;
                }
            }
        }
        sample
    }
}

/// Chooses a direction of the light that a surface scatters towards where the path came from, and whether it came through
/// the surface; `None` if it is black.
fn scatter(hit: &Hit, weight: &mut Vec3, random: &mut Random) -> Option<(DVec3, bool)> {
    let (reflected, passed) = (*weight * hit.reflectance, *weight * hit.transmittance);
    let (r, t) = (reflected.element_sum(), passed.element_sum());
    if r + t <= 0.0 {
        return None;
    }
    let chance = r / (r + t);
    // Not rounded to single precision, where the greatest numbers are 1: a surface that lets nothing through would.
    let through = random.unit() >= f64::from(chance);
    *weight = if through { passed / (1.0 - chance) } else { reflected / chance };
    let normal = if through { -hit.normal } else { hit.normal };
    Some((random.cosine_direction(normal), through))
}

/// Where a ray starts that leaves a surface, on the side that the path came from or behind it.
fn leave(hit: &Hit, before: bool) -> DVec3 {
    hit.at + hit.normal * if before { hit.step } else { -hit.step }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_number_sends_a_path_through_an_opaque_surface() {
        let hit = Hit {
            t: 1.0,
            at: DVec3::ZERO,
            normal: DVec3::Z,
            step: 1e-3,
            reflectance: Vec3::splat(0.2),
            transmittance: Vec3::ZERO,
            species: None,
            thin: false,
        };
        let mut random = Random::greatest();
        assert_eq!(random.clone().unit(), 1.0 - f64::EPSILON / 2.0);
        let mut weight = Vec3::ONE;
        let (_, through) = scatter(&hit, &mut weight, &mut random).unwrap();
        assert_eq!((through, weight), (false, Vec3::splat(0.2)));
    }
}
