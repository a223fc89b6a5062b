//! All species of a scene, each with its z-field and its forest tables.

use std::path::Path;
use std::sync::Arc;

use super::{CacheState, ForestSettings, SpeciesBake, load_or_bake, load_or_measure};
use crate::Result;
use crate::physics::tables::ForestTables;
use crate::scene::{Distribution, Scene};

/// One species, ready to draw.
#[derive(Clone, Debug)]
pub struct Baked {
    /// Its z-field and optics.
    pub species: Arc<SpeciesBake>,
    /// Its tables in the scene's forest.
    pub tables: Arc<ForestTables>,
}

/// Where the parts of a [`Baked`] came from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BakedFrom {
    /// The z-field.
    pub species: CacheState,
    /// The tables.
    pub tables: CacheState,
}

/// Full density of the point pattern that a scene's densities thin, trees per m²; or, in a scene of lists only, of the lists.
pub fn pattern_density(scene: &Scene) -> f64 {
    let [width, height] = scene.terrain.extent;
    let sum =
        |of: &dyn Fn(&Distribution) -> f64| scene.species.iter().map(|s| of(&s.distribution)).sum::<f64>();
    let thinned = sum(&|d| match d {
        Distribution::Density { max_density, .. } => f64::from(*max_density),
        Distribution::Positions(_) => 0.0,
    });
    if thinned > 0.0 {
        return thinned;
    }
    sum(&|d| match d {
        Distribution::Positions(list) => list.len() as f64 / (width * height),
        Distribution::Density { .. } => 0.0,
    })
}

/// What the tables of a scene's species are measured with.
pub fn forest_settings(scene: &Scene, species: usize) -> ForestSettings {
    let kind = &scene.species[species];
    // A scene without trees still has species: any density will do.
    let density = Some(pattern_density(scene)).filter(|d| *d > 0.0).unwrap_or(0.01);
    let poisson = matches!(kind.distribution, Distribution::Positions(_));
    ForestSettings::new(&scene.settings, density, kind.scale, poisson)
}

/// Everything that drawing a scene's trees needs, from the cache in `dir` where it is there.
///
/// # Errors
/// As [`load_or_bake`] and [`load_or_measure`].
pub fn load_or_bake_scene(scene: &Scene, dir: Option<&Path>, quiet: bool) -> Result<Vec<(Baked, BakedFrom)>> {
    let _bake = tracing::info_span!("bake").entered();
    let mut all = Vec::new();
    for (k, s) in scene.species.iter().enumerate() {
        let (species, baked) = load_or_bake(&s.mesh, &s.optics, &(&scene.settings).into(), dir, quiet)?;
        let (tables, measured) = load_or_measure(&species, &forest_settings(scene, k), dir, quiet)?;
        let one = Baked { species: Arc::new(species), tables: Arc::new(tables) };
        all.push((one, BakedFrom { species: baked, tables: measured }));
    }
    Ok(all)
}
