//! What of a renderer is the world's and not the image's: caches, species, tables, shadow maps. It goes on when the image gets
//! another size.

use super::ground;
use super::report::ReadBacks;
use super::shadows::{CastingTrees, Shadows};
use super::sky::SkyPass;
use super::trees::shader_map::ShaderMap;
use crate::bake::Baked;
use crate::forest::cards::CardData;
use crate::forest::casters::CasterData;
use crate::forest::coverage::CoverageData;
use crate::forest::cull::CullData;
use crate::forest::forest_sky::ForestSky;
use crate::forest::indirect::IndirectData;
use crate::forest::meshes::MeshData;
use crate::forest::seeds::SeedData;
use crate::forest::shells::ShellData;
use crate::forest::species::SpeciesData;
use crate::forest::tables::TableData;
use crate::forest::terrain::TerrainData;
use crate::gpu::interface::{TERRAIN_CELLS, View};
use crate::gpu::{Buffer, Gpu, Recorder};
use crate::plan::Plan;
use crate::scene::Scene;
use crate::{Error, Result};

/// What lives between frames for the trees; absent from scenes without.
pub struct Forest {
    /// What leaves, bark and ground hand to each other.
    pub indirect: IndirectData,
    /// Seeds.
    pub seeds: SeedData,
    /// Coverage tiles.
    pub coverage: CoverageData,
    /// Species.
    pub species: SpeciesData,
    /// Forest tables of the species.
    pub tables: TableData,
    /// What the forest leaves of the sky, where harmonics light something.
    pub sky: Option<ForestSky>,
    /// Slices of the forest, where trees far away are such.
    pub shells: Option<ShellData>,
    /// What finds the trees that are drawn one by one, if any can come within range.
    pub near: Option<NearTrees>,
}

/// Trees drawn one by one.
pub struct NearTrees {
    /// Culling.
    pub cull: CullData,
    /// What finds the trees that cast shadows, where there is a sun.
    pub casters: Option<CasterData>,
    /// What the nearest are drawn from, where those are meshes.
    pub meshes: Option<MeshData>,
    /// What those are drawn from that are clouds of cards.
    pub cards: Option<CardData>,
}

/// What lives between frames whatever their size.
pub struct World {
    /// What shaders know of the moment.
    pub view: Buffer,
    /// The ground.
    pub terrain: TerrainData,
    /// Indices of a quad of it.
    pub terrain_indices: Buffer,
    /// The trees.
    pub forest: Option<Forest>,
    /// Trees far away.
    pub shader_map: Option<ShaderMap>,
    /// Shadow maps.
    pub shadows: Shadows,
    /// The sky, where it is an image.
    pub sky: Option<SkyPass>,
}

impl Forest {
    fn new(
        gpu: &Gpu,
        (scene, plan): (&Scene, &Plan),
        baked: &[Baked],
        terrain: &TerrainData,
    ) -> Result<Self> {
        let species = SpeciesData::new(gpu, scene, plan, baked)?;
        let indirect = IndirectData::new(gpu, plan, baked)?;
        let tables: Vec<_> = baked.iter().map(|b| b.tables.as_ref()).collect();
        let tables = TableData::new(gpu, plan.tables()?, &tables)?;
        let near = || -> Result<NearTrees> {
            Ok(NearTrees {
                cull: CullData::new(gpu, scene, plan, &tables)?,
                meshes: plan.meshes.then(|| MeshData::new(gpu, scene, plan, baked)).transpose()?,
                cards: plan.cards.then(|| CardData::new(gpu, scene, plan, baked)).transpose()?,
                casters: (plan.cascades > 0).then(|| CasterData::new(gpu, scene, plan)).transpose()?,
            })
        };
        let near = plan.near_trees.then(near).transpose()?;
        Ok(Forest {
            coverage: CoverageData::new(gpu, scene, plan, &species, &terrain.tree)?,
            seeds: SeedData::new(gpu, scene, plan)?,
            sky: plan.harmonics().then(|| ForestSky::new(gpu, scene, plan, baked)).transpose()?,
            shells: plan.shells.then(|| ShellData::new(gpu, scene, plan, baked)).transpose()?,
            near,
            indirect,
            species,
            tables,
        })
    }

    /// What draws the trees that cast.
    fn casting(&self) -> Option<CastingTrees<'_>> {
        let data = self.near.as_ref()?.casters.as_ref()?;
        let meshes = self.near.as_ref()?.meshes.as_ref();
        Some(CastingTrees { data, seeds: &self.seeds, species: &self.species, meshes })
    }
}

impl World {
    /// Builds what the plan lists.
    ///
    /// # Errors
    /// [`crate::Error::Device`] when out of memory.
    pub fn new(gpu: &Gpu, (scene, plan): (&Scene, &Plan), baked: &[Baked]) -> Result<Self> {
        let terrain = TerrainData::new(gpu, scene, plan)?;
        let forest = plan.forest.then(|| Forest::new(gpu, (scene, plan), baked, &terrain)).transpose()?;
        Ok(World {
            view: gpu.buffer("view", size_of::<View>() as u64)?,
            terrain_indices: ground::mesh_indices(gpu, "terrain indices", TERRAIN_CELLS)?,
            shader_map: forest.as_ref().map(|f| ShaderMap::new(gpu, plan, f)).transpose()?,
            shadows: Shadows::new(gpu, scene, plan)?,
            sky: SkyPass::new(gpu, scene, plan)?,
            forest,
            terrain,
        })
    }

    /// Takes another plan that this world serves.
    ///
    /// # Errors
    /// [`crate::Error::Device`] if the device fails.
    pub fn adapt(&mut self, gpu: &Gpu, plan: &Plan) -> Result<()> {
        let Some(forest) = &mut self.forest else { return Ok(()) };
        forest.species.set_ranges(gpu, plan)?;
        if let Some(shells) = &forest.shells {
            shells.set_ranges(gpu, plan)?;
        }
        if let Some(near) = &mut forest.near {
            near.cull.set_limits(plan);
        }
        Ok(())
    }

    /// What was to be drawn may not have been: nothing kept is relied on.
    pub fn forget(&mut self) {
        self.terrain.forget();
        self.shadows.forget();
        if let Some(forest) = &mut self.forest {
            forest.seeds.forget();
            forest.coverage.forget();
        }
    }

    /// Records which trees the camera sees.
    pub fn visibility(&self, recorder: &mut Recorder) {
        if let Some(Forest { seeds, species, tables, indirect, near: Some(NearTrees { cull, .. }), .. }) =
            &self.forest
        {
            recorder.stage("visibility", |r| {
                cull.record(r, &self.view, seeds, species, (tables, indirect), &self.terrain);
            });
        }
    }

    /// Records what the sun sees that it did not see before.
    pub fn shadows(&self, recorder: &mut Recorder) {
        let casting = self.forest.as_ref().and_then(Forest::casting);
        self.shadows.record(recorder, &self.view, &self.terrain, casting);
    }

    /// Has the numbers of trees read back.
    pub(super) fn read(&self, recorder: &mut Recorder, cascades: usize, reads: &mut ReadBacks) -> Result<()> {
        let Some(Forest { seeds, near: Some(near), .. }) = &self.forest else { return Ok(()) };
        reads.cascades = cascades;
        if seeds.visible > 0 {
            reads.trees = Some(near.cull.read_total(recorder)?);
        }
        if let Some(casters) = &near.casters {
            let cascades = self.shadows.work.blocks.iter().map(|b| b.cascade).collect();
            reads.casters = Some((casters.read_commands(recorder)?, cascades));
        }
        Ok(())
    }

    /// The trees that are drawn one by one, with all that they need.
    pub fn near(&self) -> Option<(&Forest, &CullData)> {
        self.forest.as_ref().and_then(|f| Some((f, &f.near.as_ref()?.cull)))
    }

    /// The same with what the nearest of them are drawn from, where those are meshes.
    pub fn meshes(&self) -> Option<(&Forest, &CullData, &MeshData)> {
        let forest = self.forest.as_ref()?;
        let near = forest.near.as_ref()?;
        Some((forest, &near.cull, near.meshes.as_ref()?))
    }

    /// The trees that are drawn one by one with what those are drawn from that are clouds of cards.
    pub fn cards(&self) -> Option<(&Forest, &CullData, (&CardData, &ForestSky))> {
        let forest = self.forest.as_ref()?;
        let near = forest.near.as_ref()?;
        Some((forest, &near.cull, (near.cards.as_ref()?, forest.sky.as_ref()?)))
    }

    /// The trees with the slices of them, where trees far away are such.
    pub fn shells(&self) -> Option<(&Forest, &ShellData)> {
        let forest = self.forest.as_ref()?;
        Some((forest, forest.shells.as_ref()?))
    }

    /// What the forest leaves of the sky, where harmonics light something.
    pub fn sky_of_forest(&self) -> Option<&ForestSky> {
        self.forest.as_ref()?.sky.as_ref()
    }

    /// What finds the trees that cast shadows.
    pub fn casters(&self) -> Option<&CasterData> {
        self.forest.as_ref()?.near.as_ref()?.casters.as_ref()
    }
}

/// The plan of a world that serves what another plan wants: the size and the distances are those wanted, the capacities those held.
///
/// # Errors
/// [`Error::Usage`] with what differs, or does not suffice.
pub(super) fn served(scene: &Scene, held: &Plan, wanted: &Plan) -> Result<Plan> {
    let same = |a: &Plan, b: &Plan| -> [(&str, bool); 13] {
        let grid = |p: &Plan| [p.quad_side, p.tile_side, p.pattern_density, p.plain_side].map(f64::to_bits);
        [
            ("ladder", a.ladder == b.ladder),
            ("rasterizer", a.rasterizer == b.rasterizer),
            ("view mode", a.view_mode == b.view_mode),
            ("samples and layers", (a.samples, a.layers) == (b.samples, b.layers)),
            ("trees one by one", (a.near_trees, a.transfer_bands) == (b.near_trees, b.transfer_bands)),
            ("z-fields", a.z_fields == b.z_fields),
            ("meshes", a.meshes == b.meshes),
            ("cards", (a.cards, a.mesh_harmonics) == (b.cards, b.mesh_harmonics)),
            ("tables", a.pair_tables == b.pair_tables),
            ("indirect light", a.indirect == b.indirect),
            ("sun", (a.sun, a.cascades) == (b.sun, b.cascades)),
            ("wind", a.wind == b.wind),
            ("seed quads", grid(a) == grid(b) && a.region_capacity == b.region_capacity),
        ]
    };
    let room = |p: &Plan| {
        [
            ("seed quads", p.seed_regions),
            ("seed quads on silhouettes", p.silhouette_quads),
            ("seed quads of shadows", p.shadow_quads),
            ("trees", p.tree_capacity),
            ("casters", p.caster_capacity),
            ("terrain tiles", p.terrain_tiles),
            ("coverage tiles", p.cover_slots),
        ]
    };
    let differs =
        same(held, wanted).into_iter().find(|(_, same)| !same).map(|(what, _)| format!("other {what}"));
    let short = room(held).into_iter().zip(room(wanted)).find(|((_, has), (_, wants))| has < wants);
    let short = short.map(|((what, has), (_, wants))| format!("{wants} {what}, and there are {has}"));
    if let Some(why) = differs.or(short) {
        let [w, h] = wanted.size;
        return Err(Error::Usage(format!(
            "an image of {w} x {h} takes another world: {why}; make another renderer, or plan the world for the largest image"
        )));
    }
    let mut plan = Plan {
        size: wanted.size,
        shadow_distance: wanted.shadow_distance,
        species_range: wanted.species_range.clone(),
        mesh_range: wanted.mesh_range.clone(),
        last_mesh_range: wanted.last_mesh_range,
        card_range: wanted.card_range.clone(),
        last_card_range: wanted.last_card_range,
        cloud_range: wanted.cloud_range,
        far_from: wanted.far_from,
        range: wanted.range,
        silhouette_ratio: wanted.silhouette_ratio,
        draw_limits: wanted.draw_limits,
        ..held.clone()
    };
    plan.list(scene);
    Ok(plan)
}
