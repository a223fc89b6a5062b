//! Streaming: which quads and tiles a moment needs, where in the caches they are, and what brings those that are new.

use super::report::Tiles;
use super::view::{frame_view, view};
use super::world::{Forest, World};
use crate::camera::{Cascade, Eye, Light};
use crate::forest::casters::CasterData;
use crate::forest::coverage::CoverageWork;
use crate::forest::seeds::{FreshSeeds, SeedWork};
use crate::forest::terrain::TerrainDraws;
use crate::gpu::Recorder;
use crate::gpu::interface::View;
use crate::plan::Plan;
use crate::scene::Scene;
use crate::{Error, Result};

/// All that varies from frame to frame.
#[derive(Clone, Copy)]
pub struct Moment<'a> {
    /// Where from.
    pub eye: &'a Eye,
    /// Shadow cascades, as many as the plan has.
    pub cascades: &'a [Cascade],
    /// Sun and sky.
    pub light: &'a Light,
    /// Exposure of the display picture.
    pub exposure: f64,
    /// Time of the scene, s.
    pub time: f64,
}

/// What a frame draws, and what it has to produce before.
pub struct Streamed {
    /// Quads of terrain.
    pub draws: TerrainDraws,
    /// What shaders know of the moment.
    pub view: View,
    /// Tiles to produce.
    pub produced: Tiles,
    /// Tiles thrown out for them.
    pub evicted: Tiles,
    /// Whether any ground is so far that trees on it may be the shader-map's.
    pub far_trees: bool,
    trees: Option<(SeedWork, CoverageWork)>,
}

impl World {
    /// Chooses what a moment needs, and records the uploads.
    ///
    /// # Errors
    /// [`Error::Usage`] when the view needs more quads than the plan holds, or trees one by one where it has none;
    /// [`Error::Device`] when out of memory.
    pub fn stream(
        &mut self,
        recorder: &mut Recorder,
        (scene, plan): (&Scene, &Plan),
        moment: Moment,
    ) -> Result<Streamed> {
        let Moment { eye, cascades, light, time, .. } = moment;
        self.can_show(scene, plan, eye)?;
        let before = self.evicted();
        let pixels = f64::from(scene.settings.terrain_pixels);
        let mut draws = self.terrain.update(eye, cascades.last().map_or(-1.0, |c| c.far), pixels)?;
        let tree = &self.terrain.tree;
        let motion = scene.wind.filter(|_| plan.wind).map(|w| w.at(time));
        self.shadows.moved(motion);
        self.shadows.update(recorder, (scene, plan), tree, eye, cascades)?;
        let mut trees = None;
        if let Some(forest) = &mut self.forest {
            let seeds = forest.seeds.update(recorder, scene, plan, tree, eye)?;
            let coverage = forest.coverage.update(recorder, tree, &forest.seeds, &mut draws)?;
            if let Some(casters) = forest.near.as_mut().and_then(|n| n.casters.as_mut()) {
                casters.update(recorder, &mut forest.seeds, tree, cascades, &self.shadows.work.blocks)?;
            }
            trees = Some((seeds, coverage));
        }
        self.terrain.upload(recorder, &draws)?;
        let seeds = self.forest.as_ref().map(|f| &f.seeds);
        let view = view(scene, plan, eye, (light, motion), cascades, seeds, self.terrain.tree.step());
        recorder.upload(&self.view, 0, &[frame_view(view, eye, plan, 0)])?;
        let produced = Tiles {
            terrain: draws.fresh.1,
            seeds: trees.as_ref().map_or(0, |(seeds, _)| seeds.fresh.1)
                + self.casters().map_or(0, CasterData::fresh_quads),
            coverage: trees.as_ref().map_or(0, |(_, coverage)| coverage.tiles),
        };
        let tree = &self.terrain.tree;
        let averages_from = plan.averages_from();
        let far_trees = draws.keys.iter().any(|quad| tree.farthest(*quad, eye.position) > averages_from);
        Ok(Streamed { draws, view, produced, evicted: self.evicted().since(before), far_trees, trees })
    }

    /// Has frame `k` of the picture, but the first, looked at as it is shifted.
    ///
    /// # Errors
    /// [`Error::Device`] when out of memory.
    pub fn look(
        &self,
        recorder: &mut Recorder,
        plan: &Plan,
        (streamed, moment): (&Streamed, Moment),
        k: u32,
    ) -> Result<()> {
        if k > 0 {
            recorder.upload(&self.view, 0, &[frame_view(streamed.view, moment.eye, plan, k)])?;
        }
        Ok(())
    }

    /// Records the passes that produce what is new.
    pub fn produce(&self, recorder: &mut Recorder, streamed: &Streamed) {
        recorder.stage("stream", |r| {
            self.terrain.produce(r, &streamed.draws);
            if let (Some(forest), Some((seeds, tiles))) = (&self.forest, &streamed.trees) {
                forest.seeds.produce(r, &fresh(forest, seeds), &self.terrain, &forest.species);
                forest.coverage.produce(r, tiles, &forest.seeds, &self.terrain, &forest.species);
            }
        });
    }

    /// That no tree is to be drawn by itself where the plan has none such.
    fn can_show(&self, scene: &Scene, plan: &Plan, eye: &Eye) -> Result<()> {
        let (extent, heights) = (scene.terrain.extent, self.terrain.tree.total_range());
        if !plan.near_trees && plan.trees_in_range(extent, heights, eye.position) {
            return Err(Error::Usage(format!(
                "trees are within {:.0} m of this camera, and the plan was made where none are, so it draws none by itself: plan \
                 again for this camera",
                plan.last_range()
            )));
        }
        if plan.ladder.meshes() && !plan.meshes && plan.mesh_in_range(extent, heights, eye.position) {
            return Err(Error::Usage(format!(
                "trees are within {:.0} m of this camera, where they are meshes, and the plan was made where none are: plan again for \
                 this camera",
                plan.last_mesh_range
            )));
        }
        if plan.ladder.cards() && !plan.cards && plan.card_in_range(extent, heights, eye.position) {
            return Err(Error::Usage(format!(
                "trees are within {:.0} m of this camera, where they are clouds of cards, and the plan was made where none are: plan \
                 again for this camera",
                plan.last_card_range
            )));
        }
        if !plan.trees_within(extent, heights, eye.position) {
            return Err(Error::Usage(format!(
                "trees are farther than {:.0} m from this camera, and the plan was made where none is, so it does not draw them: plan \
                 again for this camera",
                plan.range
            )));
        }
        Ok(())
    }

    /// Tiles thrown out so far.
    fn evicted(&self) -> Tiles {
        let forest = self.forest.as_ref();
        Tiles {
            terrain: self.terrain.evicted(),
            seeds: forest.map_or(0, |f| f.seeds.evicted()),
            coverage: forest.map_or(0, |f| f.coverage.evicted()),
        }
    }
}

/// The seeds to produce before anything is drawn: those that the camera sees, and of the first batch of casters.
fn fresh<'a>(forest: &'a Forest, seen: &SeedWork) -> Vec<FreshSeeds<'a>> {
    let casters = forest.near.as_ref().and_then(|n| n.casters.as_ref());
    let batch = casters.and_then(|c| c.work.batches.first().map(|b| c.fresh(b)));
    std::iter::once((&forest.seeds.quads, seen.fresh)).chain(batch).collect()
}
