//! What of a renderer is the image's: its targets, and the passes that draw to them. An image of another size gets another.

use super::accumulation::Accumulation;
use super::ground::Ground;
use super::horizon::Horizon;
use super::report::ReadBacks;
use super::seen_ground::SeenGround;
use super::stream::{Moment, Streamed};
use super::targets::ImageTargets;
use super::tonemap::Tonemap;
use super::trees::cards::Cards;
use super::trees::meshes::Meshes;
use super::trees::shells::Shells;
use super::trees::tiles::TreeTiles;
use super::trees::zfield::Trees;
use super::world::World;
use crate::Result;
use crate::gpu::{Gpu, Recorder};
use crate::plan::{Plan, Rasterizer};
use crate::scene::Scene;

/// What an image of one size takes.
pub struct Canvas {
    /// What is drawn to.
    pub targets: ImageTargets,
    passes: Passes,
    accumulation: Option<Accumulation>,
    tonemap: Tonemap,
}

/// What draws ground and trees; without trees drawn one by one, the ground alone.
enum Passes {
    /// The graphics pipeline: what it finds it lights.
    Graphics(Box<Ground>, Option<Box<Trees>>),
    /// Compute tiles: what is seen is found first, and lit once.
    Tiles(Box<Seen>),
}

/// Passes by which surfaces are seen first.
struct Seen {
    ground: SeenGround,
    horizon: Option<Horizon>,
    meshes: Option<Meshes>,
    cards: Option<Cards>,
    shells: Option<Shells>,
    trees: Option<TreeTiles>,
}

impl Seen {
    fn new(gpu: &Gpu, (scene, plan): (&Scene, &Plan), world: &World) -> Result<Self> {
        let rows = world.near().filter(|_| plan.z_fields).map(|(forest, _)| forest.species.mask_rows);
        let meshes = world.meshes().filter(|_| plan.shows_meshes());
        let cards = world.cards().filter(|_| plan.shows_cards());
        Ok(Seen {
            ground: SeenGround::new(gpu, scene, plan)?,
            horizon: Horizon::new(gpu, scene, plan)?,
            meshes: meshes.map(|(_, _, data)| Meshes::new(gpu, scene, plan, data)).transpose()?,
            cards: cards
                .map(|(_, cull, (data, _))| Cards::new(gpu, scene, plan, (cull, data)))
                .transpose()?,
            shells: world
                .shells()
                .filter(|_| plan.shows_shells())
                .map(|(_, data)| Shells::new(gpu, scene, plan, data))
                .transpose()?,
            trees: rows.map(|rows| TreeTiles::new(gpu, scene, plan, rows)).transpose()?,
        })
    }
}

impl Canvas {
    /// Builds what the plan lists for the image.
    ///
    /// # Errors
    /// [`crate::Error::Device`] when out of memory.
    pub fn new(gpu: &Gpu, (scene, plan): (&Scene, &Plan), world: &World) -> Result<Self> {
        Ok(Canvas {
            targets: ImageTargets::new(gpu, plan)?,
            passes: match plan.rasterizer {
                Rasterizer::Graphics => {
                    let rows = world.near().map(|(forest, _)| forest.species.mask_rows);
                    let trees = rows.map(|rows| Trees::new(gpu, scene, plan, rows)).transpose()?;
                    Passes::Graphics(Box::new(Ground::new(gpu, plan)?), trees.map(Box::new))
                }
                Rasterizer::Tiles => Passes::Tiles(Box::new(Seen::new(gpu, (scene, plan), world)?)),
            },
            accumulation: Accumulation::new(gpu, plan)?,
            tonemap: Tonemap::new(gpu, plan)?,
        })
    }

    /// Records all that shows in the image.
    pub fn draw(
        &self,
        recorder: &mut Recorder,
        plan: &Plan,
        world: &World,
        streamed: &Streamed,
        moment: Moment,
    ) {
        recorder.stage("image", |r| {
            let ground = (&world.terrain, &streamed.draws);
            if let Some(sky) = &world.sky {
                sky.record(r, &world.view, &self.targets);
            }
            if let Some((forest, map)) = world.forest.as_ref().zip(world.shader_map.as_ref()) {
                map.record(r, &world.view, ground, forest);
            }
            match &self.passes {
                Passes::Graphics(pass, trees) => {
                    self.graphics(r, world, streamed, moment, (pass, trees.as_deref()));
                }
                Passes::Tiles(passes) => self.tiles(r, plan, world, streamed, moment, passes),
            }
        });
    }

    /// Ground and trees in the graphics pipeline.
    fn graphics(
        &self,
        r: &mut Recorder,
        world: &World,
        streamed: &Streamed,
        moment: Moment,
        (pass, trees): (&Ground, Option<&Trees>),
    ) {
        let (view, indices, map) = (&world.view, &world.terrain_indices, &world.shadows.map);
        let ground = (&world.terrain, &streamed.draws);
        let forest = world.forest.as_ref().zip(world.shader_map.as_ref());
        let light = moment.light;
        let clear = world.sky.is_none().then(|| light.sky.map(|c| (c * light.scale) as f32));
        pass.record(r, view, indices, ground, forest, map, &self.targets, clear);
        if let (Some(trees), Some((forest, cull))) = (trees, world.near()) {
            trees.record(r, view, forest, cull, map, &self.targets);
        }
    }

    /// Ground and trees in tiles: what each sample sees, then the light on that.
    fn tiles(
        &self,
        r: &mut Recorder,
        plan: &Plan,
        world: &World,
        streamed: &Streamed,
        moment: Moment,
        passes: &Seen,
    ) {
        let (view, indices, map) = (&world.view, &world.terrain_indices, &world.shadows.map);
        let ground = (&world.terrain, &streamed.draws);
        let forest = world.forest.as_ref().zip(world.shader_map.as_ref());
        let trees = passes.trees.as_ref().filter(|_| plan.shows_z_fields()).zip(world.near());
        let meshes = passes.meshes.as_ref().zip(world.meshes());
        let cards = passes.cards.as_ref().zip(world.cards());
        let shells = passes.shells.as_ref().zip(world.shells());
        passes.ground.see(r, view, indices, ground, &self.targets);
        if let Some((pass, (_, cull, data))) = meshes {
            pass.see(r, view, (cull, data, plan.last_mesh_range), &self.targets);
        }
        if let Some((pass, (forest, cull, (data, _)))) = cards {
            pass.see(r, view, forest, (cull, data), &self.targets);
        }
        if let Some((pass, (forest, data))) = shells {
            pass.see(r, world, (moment.eye, &streamed.draws, (forest, data)), &self.targets);
        }
        if let Some((horizon, far)) = passes.horizon.as_ref().zip(forest) {
            if streamed.far_trees {
                horizon.record(r, view, ground, far, &self.targets);
            } else {
                horizon.clear(r, moment.light.sky.map(|c| (c * moment.light.scale) as f32), &self.targets);
            }
        }
        if let Some((tiles, (forest, cull))) = trees {
            tiles.see(r, view, forest, cull, &self.targets);
        }
        let seen = trees.map(|(tiles, _)| &tiles.seen);
        passes.ground.light(r, view, ground, forest, map, seen, &self.targets);
        if let Some((pass, (forest, cull, data))) = meshes {
            pass.light(r, view, forest, (cull, data, world.sky_of_forest()), map, seen, &self.targets);
        }
        if let Some((pass, (forest, cull, (data, sky)))) = cards {
            pass.light(r, view, forest, (cull, data, sky), map, seen, &self.targets);
        }
        if let Some((pass, (forest, data))) = shells {
            pass.light(r, world, (forest, data), seen, &self.targets);
        }
        if let Some((tiles, (forest, cull))) = trees {
            tiles.shade(r, view, forest, cull, map, &self.targets);
        }
    }

    /// Records the display picture.
    pub fn resolve(&self, recorder: &mut Recorder, plan: &Plan, moment: Moment) {
        self.tonemap.record(recorder, &self.targets, plan, moment.exposure / moment.light.scale);
    }

    /// Adds frame `k` of a picture of several to their sums.
    pub fn accumulate(&self, recorder: &mut Recorder, plan: &Plan, k: u32) {
        if let Some(accumulation) = &self.accumulation {
            recorder.stage("image", |r| accumulation.record(r, &self.targets, plan, k));
        }
    }

    /// Has what the tiles find read back.
    pub(super) fn read(
        &self,
        recorder: &mut Recorder,
        (plan, world): (&Plan, &World),
        reads: &mut ReadBacks,
    ) -> Result<()> {
        let Passes::Tiles(passes) = &self.passes else { return Ok(()) };
        if let Some(tiles) = passes.trees.as_ref().filter(|_| plan.shows_z_fields()) {
            reads.tiles = Some(tiles.read_state(recorder)?);
        }
        if let Some((pass, (_, _, data))) = passes.meshes.as_ref().zip(world.meshes()) {
            reads.meshes = Some(pass.read_kinds(recorder, data)?);
        }
        if let Some((pass, (_, _, (data, _)))) = passes.cards.as_ref().zip(world.cards()) {
            reads.cards = Some(pass.read_kinds(recorder, data)?);
        }
        Ok(())
    }
}
