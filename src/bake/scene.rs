//! All species of a scene, each with its z-field and its forest tables.

use std::path::Path;
use std::sync::Arc;

use super::cards::CardCloud;
use super::envelope::Envelopes;
use super::harmonics::Harmonics;
use super::indirect::{Kind, Mix};
use super::levels::Levels;
use super::shells::Shells;
use super::{CacheState, ForestSettings, Source, SpeciesBake, cache};
use crate::Result;
use crate::ladder::Ladder;
use crate::physics::indirect::Indirect;
use crate::physics::tables::ForestTables;
use crate::plan::Plan;
use crate::scene::{Distribution, Scene};

/// One species, ready to draw.
#[derive(Clone, Debug)]
pub struct Baked {
    /// Its z-field and optics.
    pub species: Arc<SpeciesBake>,
    /// Its tables in the scene's forest.
    pub tables: Arc<ForestTables>,
    /// The crown around its leaves, where it is drawn as a mesh.
    pub envelopes: Option<Arc<Envelopes>>,
    /// Its mesh's levels of detail, likewise.
    pub levels: Option<Arc<Levels>>,
    /// How light comes to its faces, where spherical harmonics light it.
    pub harmonics: Option<Arc<Harmonics>>,
    /// Its cloud of cards, where it is drawn as one.
    pub cards: Option<Arc<CardCloud>>,
    /// Slices of the scene's forest, one stack for all its species, where a ladder ends with them.
    pub shells: Option<Arc<Shells>>,
    /// Light that met more than one surface in the scene's forest, where it counts.
    pub indirect: Option<Arc<Indirect>>,
}

/// Where the parts of a [`Baked`] came from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BakedFrom {
    /// The z-field's views.
    pub views: CacheState,
    /// Their light transfer; `None` where nothing needed it.
    pub transfer: Option<CacheState>,
    /// The tables.
    pub tables: CacheState,
    /// The crown around its leaves; `None` where nothing needed it.
    pub envelopes: Option<CacheState>,
    /// Its mesh's levels of detail; likewise.
    pub levels: Option<CacheState>,
    /// How light comes to its faces; likewise.
    pub harmonics: Option<CacheState>,
    /// Its cloud of cards; likewise.
    pub cards: Option<CacheState>,
    /// Slices of the scene's forest; likewise.
    pub shells: Option<CacheState>,
    /// Light that met more than one surface; `None` where it is left out.
    pub indirect: Option<CacheState>,
}

/// What is needed of a scene's species.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Needs {
    /// Their views and tables. Whatever stands for a tree, near or far, needs both: tables are measured from views, and tell
    /// near trees of the sky's light among others. Nor do tables come apart, into those of a sun, which a plan without pair
    /// tables does not read, and those of the sky: an even sky is many suns, and its light is summed up from theirs.
    pub trees: bool,
    /// The light transfer of the views, to draw trees one by one. Measuring tables needs it as well and gets it by itself; once
    /// they are in the cache, a plan without z-fields or without a sun does without.
    pub transfer: bool,
    /// What light at leaves takes, as the settings have it, and the levels of detail, to draw trees as meshes.
    pub envelopes: bool,
    /// Clouds of cards, to draw trees as such.
    pub cards: bool,
    /// Slices of the forest, to draw trees far away as such.
    pub shells: bool,
    /// Light that met more than one surface, where the settings ask for it.
    pub indirect: bool,
}

impl Needs {
    /// All but what meshes take, for whoever draws by several plans.
    pub const ALL: Needs =
        Needs { trees: true, transfer: true, envelopes: false, cards: false, shells: false, indirect: true };

    /// All that plans of these ladders may need.
    pub fn of(ladders: impl IntoIterator<Item = Ladder>) -> Self {
        ladders.into_iter().fold(Needs::ALL, |all, l| Needs {
            envelopes: all.envelopes || l.meshes(),
            cards: all.cards || l.cards(),
            shells: all.shells || l.shells(),
            ..all
        })
    }
}

impl From<&Plan> for Needs {
    fn from(plan: &Plan) -> Self {
        Needs {
            trees: plan.forest,
            transfer: plan.transfer_bands > 0,
            envelopes: plan.meshes,
            cards: plan.cards,
            shells: plan.shells,
            indirect: plan.indirect > 0,
        }
    }
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

/// What is needed of a scene's species, one after the other, from the cache in `dir` where it is there; nothing where no trees
/// are.
///
/// # Errors
/// As [`super::bake_species`] and [`super::load_or_measure`].
pub fn load_or_bake_scene(
    scene: &Scene,
    needs: impl Into<Needs>,
    dir: Option<&Path>,
    quiet: bool,
) -> Result<Vec<(Baked, BakedFrom)>> {
    let _bake = tracing::info_span!("bake").entered();
    let needs = needs.into();
    let (mut all, mut keys) = (Vec::new(), Vec::new());
    for (k, s) in scene.species.iter().enumerate().filter(|_| needs.trees) {
        let source = Source::new(&s.mesh, &s.optics, &(&scene.settings).into(), dir, quiet)?;
        keys.push(source.views_key());
        let (mut species, views) = source.load_views()?;
        let mut transfer = if needs.transfer { source.load_transfer(&mut species)? } else { None };
        let (measured, tables) =
            source.load_tables(&forest_settings(scene, k), &mut species, &mut transfer)?;
        let by_harmonics = scene.settings.light_model == 1;
        let around = || source.load_envelopes(scene.settings.leaf_directions);
        let around = (needs.envelopes && !by_harmonics).then(around).transpose()?;
        let transfers = needs.cards || needs.envelopes && by_harmonics;
        let transfers = transfers.then(|| source.load_harmonics()).transpose()?;
        let coarser = needs.envelopes.then(|| source.load_levels()).transpose()?;
        let (envelopes, levels) = (around.as_ref().map(|a| a.1), coarser.as_ref().map(|l| l.1));
        let pictures = transfers.as_ref().filter(|_| needs.cards);
        let pictures =
            pictures.map(|(light, _)| source.load_cards(light, (&scene.settings).into())).transpose()?;
        let (harmonics, light) = transfers.map_or((None, None), |(h, from)| (Some(Arc::new(h)), Some(from)));
        let (cloud, cards) = pictures.map_or((None, None), |(c, from)| (Some(Arc::new(c)), Some(from)));
        let one = Baked {
            species: Arc::new(species),
            tables: Arc::new(measured),
            envelopes: around.map(|a| Arc::new(a.0)),
            levels: coarser.map(|l| Arc::new(l.0)),
            harmonics,
            cards: cloud,
            shells: None,
            indirect: None,
        };
        all.push((
            one,
            BakedFrom {
                views,
                transfer,
                tables,
                envelopes,
                levels,
                harmonics: light,
                cards,
                shells: None,
                indirect: None,
            },
        ));
    }
    if needs.trees && needs.shells {
        let (shells, state) = Shells::load(scene, (&scene.settings).into(), dir, quiet)?;
        let shells = Arc::new(shells);
        for (one, from) in &mut all {
            (one.shells, from.shells) = (Some(shells.clone()), Some(state));
        }
    }
    if needs.trees && needs.indirect && scene.settings.indirect > 0 {
        load_indirect_light(scene, (&mut all, &keys), dir, quiet)?;
    }
    Ok(all)
}

/// Light that met more than one surface in a scene's forest, which is measured among trees of all its species.
fn load_indirect_light(
    scene: &Scene,
    (baked, keys): (&mut [(Baked, BakedFrom)], &[[u8; 32]]),
    dir: Option<&Path>,
    quiet: bool,
) -> Result<()> {
    let bakes: Vec<Arc<SpeciesBake>> = baked.iter().map(|(b, _)| b.species.clone()).collect();
    let kinds = scene.species.iter().enumerate().map(|(k, s)| Kind {
        mesh: &s.mesh,
        optics: &s.optics,
        bake: &bakes[k],
        key: keys[k],
        // A scene without trees still has species: any density will do.
        density: s.full_density(scene.terrain.extent).max(1e-6),
        scale: s.scale,
    });
    let mix = Mix {
        kinds: kinds.collect(),
        ground: scene.terrain.mean_albedo(),
        nodes: scene.settings.table_densities,
        rays: scene.settings.table_rays,
        poisson: scene.species.iter().all(|s| matches!(s.distribution, Distribution::Positions(_))),
    };
    for (k, (one, from)) in baked.iter_mut().enumerate() {
        let (light, state) = cache::load_indirect(dir, &mix, k, quiet)?;
        one.indirect = Some(Arc::new(light));
        from.indirect = Some(state);
    }
    Ok(())
}
