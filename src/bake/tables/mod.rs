//! Tables of a species' forest for the shader-map: G, T, D and E of BN12 §6, measured by casting rays through a forest of
//! z-field trees. What the tables hold, and between which nodes, is told in [`crate::physics::tables`].
//!
//! What is measured is what the near renderer draws, in expectation, so that radiance is the same at any distance: opacity,
//! depth and sky visibility of the iterated view ray, the light ray's path through the own crown, and the shadow maps' one
//! look at where every other crown stops light.

mod crown;
mod field;
mod finish;
mod measure;
mod patch;
mod sky;
mod statistics;
mod store;
mod trace;

pub use crown::{Cast, CrownModel, LeafOptics, Seen, TransferAt};
pub use field::{FieldAim, FieldCrown};
pub(super) use patch::{Patch, whole_patches};
pub use store::{key, load_or_measure, path};

use crate::bake::SpeciesBake;
use crate::physics::crown::Crown;
use crate::physics::tables::ForestTables;
use crate::progress::Progress;
use crate::settings::Settings;
use crate::{Error, Result};

/// Texels a side of the level that rays are cast at. On the oak of `tests/data`, levels of 32, 64, 128 and 256 texels give W =
/// 0.58, 0.56, 0.55, 0.54 and T = 0.86, 0.82, 0.80, 0.78 where view and light are one direction 45° from the zenith, and agree
/// within 1 % 20° from there; V differs by 0.5 %. The finest needs four times the memory of the one taken.
pub const RESOLUTION: u32 = 128;
/// Least x = λA to measure at full density. Sparser patterns are taken from one of this density by thinning, or hardly a ray
/// would meet a tree; what is then missing of the distance that trees keep is of the order of x²/2, 0.005 at most.
const SPARSEST: f64 = 0.1;
/// Most nodes of the density.
const MOST_DENSITIES: usize = 16;

/// What tables depend on beside the species.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForestSettings {
    /// Nodes n of each angle.
    pub angles: u32,
    /// Nodes m of the density.
    pub densities: u32,
    /// Points on crowns that light is cast to, four to a ground point.
    pub rays: u32,
    /// Full density of the scene's pattern, trees per m².
    pub pattern_density: f64,
    /// Range of uniformly distributed scales.
    pub scale_range: [f32; 2],
    /// Poisson points (for species with listed positions) instead of the Wang pattern.
    pub poisson: bool,
    /// Radius of the hole around a tree times the square root of the density; 0: measured.
    pub hole_radius: f32,
    /// Fixed-point iterations for the light ray; 0 leaves out self-shadow.
    pub light_iterations: u32,
    /// Fixed-point iterations for the view ray.
    pub view_iterations: u32,
}

impl ForestSettings {
    /// From the knobs and what a scene says of a species.
    pub fn new(settings: &Settings, pattern_density: f64, scale_range: [f32; 2], poisson: bool) -> Self {
        ForestSettings {
            angles: settings.table_angles,
            densities: settings.table_densities,
            rays: settings.table_rays,
            pattern_density,
            scale_range,
            poisson,
            hole_radius: settings.hole_radius,
            light_iterations: settings.light_iterations,
            view_iterations: settings.view_iterations,
        }
    }

    /// Trees per m² of the patches: the pattern's density, or what gives [`SPARSEST`].
    fn measured_density(&self, crown: &Crown) -> f64 {
        self.pattern_density.max(SPARSEST / mean_area(crown, self.scale_range))
    }
}

impl Default for ForestSettings {
    fn default() -> Self {
        ForestSettings {
            angles: 16,
            densities: 8,
            rays: 2048,
            pattern_density: 0.03,
            scale_range: [1.0; 2],
            poisson: false,
            hole_radius: 0.0,
            light_iterations: 1,
            view_iterations: 2,
        }
    }
}

/// Mean horizontal area of a species' trees, m²: A = π `crown.radius`² E(scale²).
pub fn mean_area(crown: &Crown, scale_range: [f32; 2]) -> f64 {
    std::f64::consts::PI * f64::from(crown.radius).powi(2) * mean_squared_scale(scale_range)
}

/// E(scale²) of scales drawn evenly from a range: (a² + ab + b²) / 3.
pub fn mean_squared_scale(range: [f32; 2]) -> f64 {
    let [a, b] = range.map(f64::from);
    (a * a + a * b + b * b) / 3.0
}

/// Refuses settings that nothing can be measured with.
fn check(forest: &ForestSettings) -> Result<()> {
    let [low, high] = forest.scale_range;
    let ok = (4..=64).contains(&forest.angles)
        && (2..=MOST_DENSITIES as u32).contains(&forest.densities)
        && (1..=1 << 24).contains(&forest.rays)
        && (1e-9..=1e3).contains(&forest.pattern_density)
        && low > 0.0
        && high >= low
        && high.is_finite()
        && forest.hole_radius >= 0.0
        && forest.view_iterations > 0;
    if ok {
        return Ok(());
    }
    Err(Error::Usage(format!(
        "cannot measure tables with {forest:?}: 4 to 64 angles, 2 to {MOST_DENSITIES} densities, at least one ray, \
         1e-9 to 1000 trees per m², scales above 0 in order, a hole of 0 or more, at least one iteration of the view ray"
    )))
}

/// Measures tables for a baked species.
///
/// # Errors
/// [`Error::Usage`] for settings out of range.
pub fn measure_species(bake: &SpeciesBake, forest: &ForestSettings, quiet: bool) -> Result<ForestTables> {
    let crown = FieldCrown::new(bake, RESOLUTION, forest.view_iterations, forest.light_iterations);
    measure(&crown, forest, quiet)
}

/// Measures tables for any crown, on all threads of the current rayon pool; the same bits for any number of them.
///
/// # Errors
/// [`Error::Usage`] for settings out of range.
pub fn measure<C: CrownModel>(crown: &C, forest: &ForestSettings, quiet: bool) -> Result<ForestTables> {
    check(forest)?;
    let progress =
        Progress::new("measuring forest", u64::from(forest.angles) * u64::from(forest.angles), quiet);
    let measured = match forest.densities {
        ..=8 => measure::measure::<C, 8>(crown, forest, &progress),
        _ => measure::measure::<C, MOST_DENSITIES>(crown, forest, &progress),
    };
    progress.finish();
    Ok(finish::tables((crown.crown(), crown.leaf()), forest, &measured))
}
