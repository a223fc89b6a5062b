//! A frame: every pass in order, in [`Renderer::render`].

pub mod ground;
pub mod pages;
pub mod receivers;
pub mod seen_ground;
pub mod shadow_ground;
pub mod shadows;
pub mod sky;
pub mod targets;
pub mod tonemap;
pub mod trees;
pub mod view;

use std::sync::Arc;

use tracing::info_span;

use crate::bake::Baked;
use crate::camera::{Cascade, Eye, Light};
use crate::clock::{monotonic_ns, process_cpu_ms_since, process_cpu_ns};
use crate::forest::casters::CasterData;
use crate::forest::coverage::CoverageData;
use crate::forest::cull::{CullData, TreeCounts};
use crate::forest::seeds::{FreshSeeds, SeedData, SeedWork};
use crate::forest::species::SpeciesData;
use crate::forest::tables::TableData;
use crate::forest::terrain::TerrainData;
use crate::gpu::interface::View;
use crate::gpu::{Buffer, Gpu, Timing};
use crate::image::Picture;
use crate::plan::{Plan, Rasterizer};
use crate::scene::{Camera, Scene, Sun};
use crate::{Error, Result};
use ground::Ground;
use seen_ground::SeenGround;
use shadows::{CastingTrees, Shadows};
use sky::SkyPass;
use targets::ImageTargets;
use tonemap::Tonemap;
use trees::shader_map::ShaderMap;
use trees::tiles::TreeTiles;
use trees::zfield::Trees;

/// What lives between frames for the trees; absent from scenes without.
pub struct Forest {
    /// Seeds.
    pub seeds: SeedData,
    /// Coverage tiles.
    pub coverage: CoverageData,
    /// Species.
    pub species: SpeciesData,
    /// Forest tables of the species.
    pub tables: TableData,
    /// What draws trees one by one, if any can come within range.
    pub near: Option<NearTrees>,
}

impl Forest {
    /// The seeds to produce before anything is drawn: those that the camera sees, and of the first batch of casters.
    fn fresh(&self, seen: &SeedWork) -> Vec<FreshSeeds<'_>> {
        let casters = self.near.as_ref().and_then(|n| n.casters.as_ref());
        let batch = casters.and_then(|c| c.work.batches.first().map(|b| c.fresh(b)));
        std::iter::once((&self.seeds.quads, seen.fresh)).chain(batch).collect()
    }

    /// What draws the trees that cast.
    fn casting(&self) -> Option<CastingTrees<'_>> {
        let data = self.near.as_ref()?.casters.as_ref()?;
        Some(CastingTrees { data, seeds: &self.seeds, species: &self.species })
    }
}

/// Trees drawn one by one.
pub struct NearTrees {
    /// Culling.
    pub cull: CullData,
    /// What finds the trees that cast shadows, where there is a sun.
    pub casters: Option<CasterData>,
    pass: TreePass,
}

/// What draws them.
enum TreePass {
    /// The graphics pipeline.
    Graphics(Box<Trees>),
    /// Compute tiles.
    Tiles(Box<TreeTiles>),
}

/// What lights the ground.
enum GroundPass {
    /// Every fragment of its mesh, as it is drawn.
    Drawn(Ground),
    /// Once a pixel, where it is seen.
    Seen(SeenGround),
}

/// Draws a scene as its plan says.
pub struct Renderer {
    gpu: Gpu,
    scene: Arc<Scene>,
    plan: Plan,
    light: Light,
    view: Buffer,
    targets: ImageTargets,
    terrain: TerrainData,
    terrain_indices: Buffer,
    ground: GroundPass,
    shader_map: Option<ShaderMap>,
    shadows: Shadows,
    sky: Option<SkyPass>,
    tonemap: Tonemap,
    forest: Option<Forest>,
}

/// Contents of the caches, by cache.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Tiles {
    /// Quads of terrain: heights and slopes.
    pub terrain: u32,
    /// Quads of tree seeds.
    pub seeds: u32,
    /// Coverage tiles.
    pub coverage: u32,
}

/// What a frame took and drew.
#[derive(Clone, Debug, serde::Serialize)]
pub struct FrameReport {
    /// What its recording measured: GPU time of every pass, in order.
    pub timing: Timing,
    /// When it began, on the clock of [`crate::clock::monotonic_ns`].
    pub start_ns: u64,
    /// CPU wall time of choosing what is drawn and uploading it, waits for uploads included, ms.
    pub stream_ms: f64,
    /// CPU wall time of recording commands, ms.
    pub record_ms: f64,
    /// CPU time of all threads of the process from its beginning until the device was done, ms.
    pub cpu_ms: Option<f64>,
    /// Tiles produced.
    pub produced: Tiles,
    /// Tiles thrown out of their caches for others.
    pub evicted: Tiles,
    /// Trees drawn.
    pub trees: TreeCounts,
    /// Terrain quads drawn to the image.
    pub terrain_quads: u32,
    /// Seed quads culled.
    pub seed_quads: u32,
}

impl Renderer {
    /// Builds what the plan lists.
    ///
    /// # Errors
    /// [`crate::Error::Usage`] when that is not what its numbers ask for ([`Plan::list`]); [`crate::Error::Device`] when out of
    /// memory.
    pub fn new(gpu: &Gpu, scene: Arc<Scene>, plan: Plan, baked: &[Baked]) -> Result<Self> {
        let _build = info_span!("build").entered();
        plan.check_items(&scene)?;
        let terrain = TerrainData::new(gpu, &scene, &plan)?;
        let forest = if plan.forest {
            let species = SpeciesData::new(gpu, &scene, &plan, baked)?;
            let tables: Vec<_> = baked.iter().map(|b| b.tables.as_ref()).collect();
            let tables = TableData::new(gpu, plan.tables()?, &tables)?;
            let near = || -> Result<NearTrees> {
                Ok(NearTrees {
                    cull: CullData::new(gpu, &scene, &plan, &tables)?,
                    casters: (plan.cascades > 0).then(|| CasterData::new(gpu, &scene, &plan)).transpose()?,
                    pass: match plan.rasterizer {
                        Rasterizer::Graphics => {
                            TreePass::Graphics(Box::new(Trees::new(gpu, &scene, &plan, species.mask_rows)?))
                        }
                        Rasterizer::Tiles => {
                            TreePass::Tiles(Box::new(TreeTiles::new(gpu, &scene, &plan, species.mask_rows)?))
                        }
                    },
                })
            };
            let near = plan.z_fields.then(near).transpose()?;
            Some(Forest {
                coverage: CoverageData::new(gpu, &scene, &plan, &species, &terrain.tree)?,
                seeds: SeedData::new(gpu, &scene, &plan)?,
                near,
                species,
                tables,
            })
        } else {
            None
        };
        Ok(Renderer {
            view: gpu.buffer("view", size_of::<View>() as u64)?,
            targets: ImageTargets::new(gpu, &plan)?,
            terrain,
            terrain_indices: ground::mesh_indices(gpu)?,
            ground: match plan.rasterizer {
                Rasterizer::Graphics => GroundPass::Drawn(Ground::new(gpu, &plan)?),
                Rasterizer::Tiles => GroundPass::Seen(SeenGround::new(gpu, &scene, &plan)?),
            },
            shader_map: forest.as_ref().map(|f| ShaderMap::new(gpu, &plan, f)).transpose()?,
            shadows: Shadows::new(gpu, &scene, &plan)?,
            sky: SkyPass::new(gpu, &scene, &plan)?,
            tonemap: Tonemap::new(gpu, &plan)?,
            light: Light::new(&scene),
            gpu: gpu.clone(),
            scene,
            plan,
            forest,
        })
    }

    /// The scene that is drawn.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The plan that is drawn.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// The ground: its quadtree and its tiles.
    pub fn terrain(&self) -> &TerrainData {
        &self.terrain
    }

    /// What lives between frames for the trees.
    pub fn forest(&self) -> Option<&Forest> {
        self.forest.as_ref()
    }

    /// Puts the sun elsewhere, or gives it another irradiance.
    ///
    /// # Errors
    /// [`Error::Usage`] when it shines and the plan was made without.
    pub fn set_sun(&mut self, sun: Sun) -> Result<()> {
        if !self.plan.sun && sun.shines() {
            return Err(Error::Usage("the plan was made without a sun: plan again for this one".into()));
        }
        Arc::make_mut(&mut self.scene).sun = sun;
        self.light = Light::new(&self.scene);
        Ok(())
    }

    /// Draws one frame and waits for it.
    ///
    /// # Errors
    /// [`crate::Error::Usage`] when the view needs more quads or trees than the plan holds, or trees one by one where it has
    /// none; [`crate::Error::Device`].
    pub fn render(&mut self, camera: &Camera, exposure: f64) -> Result<FrameReport> {
        self.render_eye(&Eye::new(camera, &self.scene.terrain, self.plan.size), exposure).map(|(r, _)| r)
    }

    /// Draws one frame from an eye; also returns the view that the shaders got.
    ///
    /// # Errors
    /// As [`Renderer::render`].
    pub fn render_eye(&mut self, eye: &Eye, exposure: f64) -> Result<(FrameReport, View)> {
        let highest = self.terrain.tree.total_range()[1] + self.plan.tallest;
        let cascades = Shadows::cascades(&self.scene, &self.plan, eye, self.light.direction, highest);
        self.draw(eye, &cascades, exposure)
    }

    /// Draws one frame from an eye with the shadow cascades given, as many as the plan has.
    ///
    /// # Errors
    /// As [`Renderer::render`].
    pub fn draw(&mut self, eye: &Eye, cascades: &[Cascade], exposure: f64) -> Result<(FrameReport, View)> {
        let drawn = self.draw_kept(eye, cascades, exposure);
        if drawn.is_err() {
            self.shadows.forget();
            if let Some(forest) = &mut self.forest {
                forest.seeds.forget();
            }
        }
        drawn
    }

    /// Draws a frame that takes what the ones before left to be drawn.
    fn draw_kept(&mut self, eye: &Eye, cascades: &[Cascade], exposure: f64) -> Result<(FrameReport, View)> {
        let _frame = info_span!("frame").entered();
        let (start_ns, cpu) = (monotonic_ns(), process_cpu_ns());
        let evicted = self.evicted();
        let (gpu, scene, plan) = (&self.gpu, &self.scene, &self.plan);
        let (extent, heights) = (scene.terrain.extent, self.terrain.tree.total_range());
        if !plan.z_fields && plan.trees_in_range(extent, heights, eye.position) {
            return Err(Error::Usage(format!(
                "trees are within {:.0} m of this camera, and the plan was made where none are, so it draws none by itself: plan \
                 again for this camera",
                plan.last_range()
            )));
        }
        if !plan.trees_within(extent, heights, eye.position) {
            return Err(Error::Usage(format!(
                "trees are farther than {:.0} m from this camera, and the plan was made where none is, so it does not draw them: plan \
                 again for this camera",
                plan.range
            )));
        }
        // Stream: which quads, where in the caches, what is new.
        let streaming = info_span!("stream").entered();
        let pixels = f64::from(scene.settings.terrain_pixels);
        let mut draws = self.terrain.update(eye, cascades.last().map_or(-1.0, |c| c.far), pixels)?;
        let tree = &self.terrain.tree;
        self.shadows.update(gpu, (scene, plan), tree, eye, cascades)?;
        let mut work = None;
        if let Some(forest) = &mut self.forest {
            let seeds = forest.seeds.update(gpu, scene, plan, tree, eye)?;
            let coverage = forest.coverage.update(gpu, tree, &forest.seeds, &mut draws)?;
            if let Some(casters) = forest.near.as_mut().and_then(|n| n.casters.as_mut()) {
                casters.update(gpu, &mut forest.seeds, tree, cascades, &self.shadows.work.blocks)?;
            }
            work = Some((seeds, coverage));
        }
        self.terrain.upload(gpu, &draws)?;
        let seeds = self.forest.as_ref().map(|f| &f.seeds);
        let step = self.terrain.tree.step();
        let view = view::view(scene, plan, eye, &self.light, cascades, seeds, step);
        gpu.upload(&self.view, 0, &[view])?;

        drop(streaming);
        let recording = info_span!("record").entered();
        let record_ns = monotonic_ns();
        let mut recorder = gpu.record()?;
        recorder.stage("stream", |r| {
            self.terrain.produce(r, &draws);
            if let (Some(forest), Some((seeds, tiles))) = (&self.forest, &work) {
                forest.seeds.produce(r, &forest.fresh(seeds), &self.terrain, &forest.species);
                forest.coverage.produce(r, tiles, &forest.seeds, &self.terrain, &forest.species);
            }
        });
        if let Some(Forest { seeds, species, tables, near: Some(NearTrees { cull, .. }), .. }) = &self.forest
        {
            recorder.stage("visibility", |r| {
                cull.record(r, &self.view, seeds, species, tables, &self.terrain);
            });
        }
        let casting = self.forest.as_ref().and_then(Forest::casting);
        self.shadows.record(&mut recorder, &self.view, &self.terrain, casting);
        let ground = (&self.terrain, &draws);
        recorder.stage("image", |r| {
            if let Some(sky) = &self.sky {
                sky.record(r, &self.view, &self.targets);
            }
            let clear = self.sky.is_none().then(|| self.light.sky.map(|c| (c * self.light.scale) as f32));
            let shadow_map = &self.shadows.map;
            let forest = self.forest.as_ref().zip(self.shader_map.as_ref());
            if let Some((forest, map)) = forest {
                map.record(r, &self.view, ground, forest);
            }
            let near = self.forest.as_ref().and_then(|f| Some((f, f.near.as_ref()?)));
            match &self.ground {
                GroundPass::Drawn(pass) => {
                    let (view, indices) = (&self.view, &self.terrain_indices);
                    pass.record(r, view, indices, ground, forest, shadow_map, &self.targets, clear);
                    if let Some((forest, NearTrees { cull, pass: TreePass::Graphics(trees), .. })) = near {
                        trees.record(r, view, forest, cull, shadow_map, &self.targets);
                    }
                }
                GroundPass::Seen(pass) => {
                    let (view, indices, targets) = (&self.view, &self.terrain_indices, &self.targets);
                    pass.see(r, view, indices, ground, targets);
                    let shown = near.filter(|_| plan.shows_trees());
                    let trees = shown.and_then(|(forest, near)| match &near.pass {
                        TreePass::Tiles(tiles) => Some((tiles, forest, &near.cull)),
                        TreePass::Graphics(_) => None,
                    });
                    if let Some((tiles, forest, cull)) = trees {
                        tiles.see(r, view, forest, cull, targets);
                    }
                    let seen = trees.map(|(tiles, ..)| &tiles.seen);
                    pass.light(r, view, ground, forest, shadow_map, seen, targets);
                    if let Some((tiles, forest, cull)) = trees {
                        tiles.shade(r, view, forest, cull, shadow_map, targets);
                    }
                }
            }
        });
        self.tonemap.record(&mut recorder, &self.targets, plan, exposure / self.light.scale);
        drop(recording);
        let timing = info_span!("submit").in_scope(|| recorder.submit())?;
        let cpu_ms = process_cpu_ms_since(cpu);
        let ms = |from: u64, to: u64| to.saturating_sub(from) as f64 * 1e-6;
        let after = self.evicted();

        let trees = self.count_trees(cascades.len())?;
        let report = FrameReport {
            start_ns,
            stream_ms: ms(start_ns, record_ns),
            record_ms: (ms(record_ns, timing.done_ns) - timing.wait_ms).max(0.0),
            cpu_ms,
            produced: Tiles {
                terrain: draws.fresh.1,
                seeds: work.as_ref().map_or(0, |(seeds, _)| seeds.fresh.1)
                    + self.casters().map_or(0, CasterData::fresh_quads),
                coverage: work.as_ref().map_or(0, |(_, coverage)| coverage.tiles),
            },
            // A cache that is made anew begins to count again.
            evicted: Tiles {
                terrain: after.terrain.saturating_sub(evicted.terrain),
                seeds: after.seeds.saturating_sub(evicted.seeds),
                coverage: after.coverage.saturating_sub(evicted.coverage),
            },
            timing,
            trees,
            terrain_quads: draws.camera.1,
            seed_quads: self.forest.as_ref().map_or(0, |f| f.seeds.visible),
        };
        Ok((report, view))
    }

    /// Reads how many trees a frame drew.
    fn count_trees(&self, cascades: usize) -> Result<TreeCounts> {
        let mut counts = TreeCounts::default();
        let Some(Forest { seeds, near: Some(near), .. }) = &self.forest else { return Ok(counts) };
        if let TreePass::Tiles(tiles) = &near.pass {
            tiles.check(&self.gpu)?;
        }
        if seeds.visible > 0 {
            counts.camera = near.cull.count(&self.gpu)?;
        }
        counts.cascades = vec![0; cascades];
        if let Some(casters) = &near.casters {
            for (block, count) in self.shadows.work.blocks.iter().zip(casters.counts(&self.gpu)?) {
                counts.cascades[block.cascade] += count;
            }
        }
        Ok(counts)
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

    /// Reads the last frame back: the display picture, and with layers the linear image.
    ///
    /// # Errors
    /// [`crate::Error::Device`] if the device fails.
    pub fn picture(&self) -> Result<Picture> {
        let _read = info_span!("read back").entered();
        self.targets.read(&self.gpu, &self.plan, self.light.scale)
    }

    /// The shadow maps.
    pub fn shadows(&self) -> &Shadows {
        &self.shadows
    }

    /// What finds the trees that cast shadows.
    pub fn casters(&self) -> Option<&CasterData> {
        self.forest.as_ref()?.near.as_ref()?.casters.as_ref()
    }

    /// The device that draws.
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }
}
