//! What a ray meets in one crown: the shapes that tables can be measured for.
//!
//! All is in the scaled space of the tree, the cylinder r ≤ 1, |z| ≤ 1, and rays are parallel. With w the unit vector to
//! viewer or light there, and right and up as in [`crate::physics::views::Basis`], a ray is the two coordinates (a, b) of
//! the point a·right + b·up where it meets the plane through the centre across w; depths count from there along w.

use crate::bake::SpeciesBake;
use crate::physics::crown::Crown;
use crate::physics::light::luminance;
use crate::physics::transfer::TERMS;

/// What leaves do with light, luminances.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeafOptics {
    /// Reflectance and transmittance of the leaves that scatter the sun as the crown does ([`SpeciesBake::crown_leaves`]).
    pub scattered: [f32; 2],
    /// Change of the reflectance with the phase angle, 1/rad.
    pub turning: f32,
    /// Share of the sky's light that is scattered ([`SpeciesBake::sky_albedo`]).
    pub albedo: f32,
}

impl LeafOptics {
    /// Of a baked species.
    pub fn of(bake: &SpeciesBake) -> Self {
        LeafOptics {
            scattered: bake.crown_leaves().map(|c| luminance(c) as f32),
            turning: bake.turned.slope_of(),
            albedo: luminance(bake.sky_albedo()) as f32,
        }
    }
}

/// What a viewer sees of a crown on a ray.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Seen {
    /// Opacity α_v; with 0 the rest means nothing.
    pub alpha: f32,
    /// Depth of p_v along w.
    pub depth: f32,
    /// Sky visibility δ_v in the isolated tree.
    pub occlusion: f32,
}

/// What a crown casts on a ray of light.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cast {
    /// Opacity; with 0 the rest means nothing.
    pub alpha: f32,
    /// Depth along w of its back, the end away from the sun.
    pub back: f32,
    /// Depth along w of its front.
    pub front: f32,
}

/// Coefficients of light transfer ([`crate::physics::transfer`]) of a point that is seen; by default they change nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TransferAt(pub [f32; 2 * TERMS]);

impl TransferAt {
    /// M for light from a unit vector in the tree's own axes, with w = `strength`.
    #[inline]
    pub fn of(&self, [x, y, z]: [f32; 3], strength: f32) -> f32 {
        let terms = [1.0, x, y, z, x * y, y * z, x * z, x * x - y * y];
        let sum: f32 = self.0.iter().zip(terms).map(|(c, y)| c * y).sum();
        (1.0 + strength * sum).max(0.0)
    }
}

/// A crown that rays can be cast at.
pub trait CrownModel: Sync {
    /// All that is the same for parallel rays.
    type Aim: Send + Sync;

    /// The tree's proportions and self-shadow.
    fn crown(&self) -> &Crown;

    /// What its leaves do with light.
    fn leaf(&self) -> &LeafOptics;

    /// Prepares rays along w, by its zenith angle in [0, π/2) and azimuth, rad, in the scaled space.
    fn aim(&self, zenith: f64, azimuth: f64) -> Self::Aim;

    /// The view ray (a, b).
    fn seen(&self, aim: &Self::Aim, a: f32, b: f32) -> Seen;

    /// The shadow of the ray of light (a, b).
    fn cast(&self, aim: &Self::Aim, a: f32, b: f32) -> Cast;

    /// Depth along w at which the ray of light (a, b) enters the crown; `None` where self-shadows are left out.
    fn entry(&self, aim: &Self::Aim, a: f32, b: f32) -> Option<f32>;

    /// Light transfer of what the view ray (a, b) has met at a depth along w.
    fn transfer(&self, _aim: &Self::Aim, _at: [f32; 3]) -> TransferAt {
        TransferAt::default()
    }
}
