//! Species to data: z-field views, occlusion, optics; cached on disk by content.

pub mod cache;
pub mod cards;
mod correction;
pub mod envelope;
#[doc(hidden)]
pub mod file;
pub(crate) mod foliage;
pub(crate) mod grove;
pub mod harmonics;
pub mod hiding;
pub mod indirect;
mod least_squares;
pub mod levels;
pub(crate) mod occlusion;
pub(crate) mod optics;
mod raster;
mod scene;
mod self_shadow;
pub mod shells;
pub(crate) mod surface;
pub mod tables;
mod transfer;
pub(crate) mod turning;
mod verify;
mod views;

pub use cache::{CacheState, Source};
pub use scene::{Baked, BakedFrom, Needs, forest_settings, load_or_bake_scene, pattern_density};
pub use self_shadow::{LitCell, lit_cells};
pub use tables::{ForestSettings, load_or_measure};
pub use verify::{QualityReport, ViewQuality, demand, verify};

use crate::physics::correction::Correction;
use crate::physics::crown::Crown;
use crate::physics::transfer::Transfer;
use crate::physics::zfield::ZField;
use crate::progress::Progress;
use crate::scene::{Mesh, OpticsOverride};
use crate::settings::Settings;
use crate::{Error, Result};
use occlusion::Occlusion;
use surface::Surface;

/// Everything that drawing one species needs, baked from its mesh once.
#[derive(Clone, Debug, PartialEq)]
pub struct SpeciesBake {
    /// The depth views.
    pub views: ZField,
    /// Light transfer of the same views; empty where none is wanted.
    pub transfer: Transfer,
    /// Proportions and self-shadow.
    pub crown: Crown,
    /// How the leaves that are seen and lit are turned, and the bark among them.
    pub turned: Turned,
    /// Leaf reflectance, linear RGB.
    pub reflectance: [f32; 3],
    /// Leaf transmittance, linear RGB; with the reflectance it makes the single-scattering albedo.
    pub transmittance: [f32; 3],
    /// Bark reflectance, linear RGB.
    pub bark_reflectance: [f32; 3],
    /// Horizontal projected area of the unscaled tree, m² (A of BN12 for scale 1).
    pub area: f32,
}

/// How what is seen and lit of a crown differs from leaves of uniform orientation: κ₀, κ₁, κ_t and κ_b of
/// `src/bake/self_shadow.rs`, and how much of what is seen is bark.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turned {
    /// κ₀, of the leaves' reflectance.
    pub reflected: f32,
    /// κ₁, 1/rad.
    pub slope: f32,
    /// κ_t, of the leaves' transmittance.
    pub passed: f32,
    /// κ_b, of the bark's reflectance.
    pub bark_reflected: f32,
    /// Share of bark in what is seen above the crown's base.
    pub bark_share: f32,
}

impl Turned {
    /// κ₁/κ₀: change of the reflectance with the phase angle, 1/rad.
    pub fn slope_of(&self) -> f32 {
        if self.reflected > 0.0 { self.slope / self.reflected } else { 0.0 }
    }
}

impl SpeciesBake {
    /// Reflectance (at phase angle 0; over that it changes with 1 + [`Turned::slope_of`] α) and transmittance of the uniform leaves
    /// that scatter sunlight as the crown does, linear RGB.
    pub fn crown_leaves(&self) -> [[f32; 3]; 2] {
        let k = self.turned;
        let reflectance = std::array::from_fn(|i| {
            k.reflected * self.reflectance[i] + k.bark_reflected * self.bark_reflectance[i]
        });
        [reflectance, self.transmittance.map(|x| k.passed * x)]
    }

    /// Reflectance of bark over the albedo of the crown's leaves, linear RGB.
    pub fn bark_ratio(&self) -> [f32; 3] {
        let [reflectance, transmittance] = self.crown_leaves();
        // Black leaves have no colour to compare with.
        std::array::from_fn(|i| self.bark_reflectance[i] / (reflectance[i] + transmittance[i]).max(1e-3))
    }

    /// What is left out of the sunlight that is sent to the viewer: by the crown's laws, and by light transfer where there is any.
    pub fn sent(&self) -> Correction {
        if self.transfer.bands.is_empty() { self.crown.sent } else { self.transfer.sent }
    }

    /// Share of the sky's light that the crown's visible surface scatters, leaves and bark, linear RGB.
    pub fn sky_albedo(&self) -> [f32; 3] {
        let share = self.turned.bark_share;
        let leaf = self.albedo();
        std::array::from_fn(|i| (1.0 - share) * leaf[i] + share * self.bark_reflectance[i])
    }

    /// Leaf single-scattering albedo, linear RGB: reflectance + transmittance.
    pub fn albedo(&self) -> [f32; 3] {
        std::array::from_fn(|i| self.reflectance[i] + self.transmittance[i])
    }
}

/// What a bake depends on beside the mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BakeSettings {
    /// Rings n of views, 1 to 16: 2n(n+1) + 1 views.
    pub rings: u32,
    /// Texels a side of a view: a power of two, 16 to 512.
    pub resolution: u32,
    /// Rays for ambient occlusion in each of the grid's cells with a surface in it, at least 1.
    pub occlusion_rays: u32,
    /// Bands of light transfer, 0 to 2.
    pub transfer_bands: u32,
    /// Texels a side of the light transfer of a view: a power of two, 8 to the view's.
    pub transfer_resolution: u32,
}

impl From<&Settings> for BakeSettings {
    fn from(s: &Settings) -> Self {
        BakeSettings {
            rings: s.view_rings,
            resolution: s.view_resolution,
            occlusion_rays: s.occlusion_rays,
            transfer_bands: s.transfer_bands,
            transfer_resolution: s.transfer_side(),
        }
    }
}

/// Refuses settings that no bake can be made with.
fn check(settings: &BakeSettings) -> Result<()> {
    let BakeSettings { rings, resolution, occlusion_rays, transfer_bands, transfer_resolution } = *settings;
    if !(1..=16).contains(&rings)
        || !(16..=512).contains(&resolution)
        || !resolution.is_power_of_two()
        || occlusion_rays == 0
        || transfer_bands > 2
        || !(8..=resolution).contains(&transfer_resolution)
        || !transfer_resolution.is_power_of_two()
    {
        return Err(Error::Usage(format!(
            "cannot bake {rings} rings of {resolution} texels with {occlusion_rays} rays and \
             {transfer_bands} bands of transfer of {transfer_resolution} texels: 1 to 16 rings, a power of two from 16 to 512 texels, at \
             least one ray, and at most two bands, of a power of two from 8 to the views' texels"
        )));
    }
    Ok(())
}

/// Bakes one species, on all threads of the current rayon pool; the result is the same bits for any number of
/// them. Errors: settings out of range, a mesh without extent.
pub fn bake_species(
    mesh: &Mesh,
    optics: &OpticsOverride,
    settings: &BakeSettings,
    quiet: bool,
) -> Result<SpeciesBake> {
    let mut bake = bake_views(mesh, optics, settings, quiet)?;
    bake.transfer = bake_transfer(mesh, &bake, settings, quiet)?;
    Ok(bake)
}

/// Bakes all of a species but its light transfer.
///
/// # Errors
/// As [`bake_species`].
pub fn bake_views(
    mesh: &Mesh,
    optics: &OpticsOverride,
    settings: &BakeSettings,
    quiet: bool,
) -> Result<SpeciesBake> {
    check(settings)?;
    let surface = Surface::new(mesh)?;
    let solid: Vec<bool> =
        mesh.materials.iter().map(|m| !m.foliage && !m.double_sided && m.alpha_cutoff.is_none()).collect();
    let occlusion = Occlusion::new(&surface, &solid, settings.occlusion_rays, quiet);
    let count = crate::physics::views::count(settings.rings);
    let progress = Progress::new("baking views", u64::from(count), quiet);
    let field = views::draw(&surface, &occlusion, settings.rings, settings.resolution, &progress);
    progress.finish();
    Ok(optics::species(mesh, &surface, field, optics))
}

/// Bakes the light transfer of a species' views, in as many bands as the settings say.
///
/// # Errors
/// [`Error::Usage`] for a mesh without extent.
pub fn bake_transfer(
    mesh: &Mesh,
    bake: &SpeciesBake,
    settings: &BakeSettings,
    quiet: bool,
) -> Result<Transfer> {
    let how = (settings.transfer_bands, settings.transfer_resolution);
    Ok(transfer::draw(mesh, &Surface::new(mesh)?, bake, how, quiet))
}
