//! Tree seeds: which quads of ground have them, and where in the seed buffer.

use super::cache::SlotCache;
use super::species::SpeciesData;
use super::terrain::TerrainData;
use crate::camera::{Bounds, Eye};
use crate::gpu::interface::{DrawCommand, SeedParameters, SeedQuad};
use crate::gpu::{Buffer, Gpu, Program, Recorder, Resource, Sampler, shaders};
use crate::land::density::density_map_size;
use crate::land::listed::{ListedRanges, bin_listed};
use crate::land::quadtree::Quadtree;
use crate::land::silhouette::{Belt, Ground, silhouette_quads};
use crate::physics::wind::Wind;
use crate::plan::names::{pass, resource};
use crate::plan::{Plan, QUAD_INDEX_BYTES};
use crate::scene::{Scene, Species};
use crate::{Error, Result};

/// Seeds of the quads near the camera.
pub struct SeedData {
    /// Seeds, region after region.
    pub seeds: Buffer,
    /// A draw command a region; its index count is six times the region's number of seeds.
    pub draws: Buffer,
    /// This frame's quads: `visible` ones, then those to produce.
    pub quads: Buffer,
    /// The visible quads as uploaded, for the CPU's twin of the cull.
    pub visible_quads: Vec<SeedQuad>,
    /// Number of visible quads.
    pub visible: u32,
    /// Seeds a region.
    pub region_capacity: u32,
    /// Indices of a quad a tree: 0, 1, 2, 2, 1, 3, and so on.
    pub quad_indices: Buffer,
    pub(super) pattern: Buffer,
    pub(super) listed: Buffer,
    pub(super) species_count: Buffer,
    pub(super) parameters: SeedParameters,
    /// Quads along the terrain's sides.
    pub(super) quad_count: [i32; 2],
    /// Side of a quad, m.
    pub(super) side: f64,
    wind: Option<Wind>,
    listed_ranges: ListedRanges,
    cache: SlotCache<(i32, i32)>,
    /// Regions that the camera leaves to quads that only cast.
    spare: u32,
    keys: Vec<(i32, i32)>,
    program: Program,
    top: f64,
}

/// What a frame has to produce.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SeedWork {
    /// First and number of quads whose seeds are to be produced, in [`SeedData::quads`].
    pub fresh: (u32, u32),
}

/// Quads whose seeds are to be produced: where they are, first and number.
pub type FreshSeeds<'a> = (&'a Buffer, (u32, u32));

impl SeedData {
    /// Allocates for a plan and bins listed trees to their quads.
    ///
    /// # Errors
    /// [`Error::Device`] when out of memory.
    pub fn new(gpu: &Gpu, scene: &Scene, plan: &Plan) -> Result<Self> {
        let (listed, listed_ranges) = bin_listed(scene, plan.quad_side);
        let quad_indices = plan.buffer(resource::QUAD_INDICES);
        let indices: Vec<u32> = (0..(quad_indices.bytes / QUAD_INDEX_BYTES) as u32)
            .flat_map(|k| [0, 1, 2, 2, 1, 3].map(|c| 4 * k + c))
            .collect();
        let pattern = plan.pattern.as_ref().map_or_else(Vec::new, |p| p.packed());
        let heights = scene.terrain.heights.is_some();
        let mapped = |s: &&Species| density_map_size(s, scene.terrain.extent).is_some();
        let maps = scene.species.iter().filter(mapped).count() as u32;
        Ok(SeedData {
            seeds: gpu.described_buffer(&plan.buffer(resource::SEEDS))?,
            draws: gpu
                .buffer("seed draws", u64::from(plan.seed_regions) * size_of::<DrawCommand>() as u64)?,
            quads: gpu
                .buffer("seed quads", 2 * u64::from(plan.seed_regions) * size_of::<SeedQuad>() as u64)?,
            visible_quads: Vec::new(),
            visible: 0,
            region_capacity: plan.region_capacity,
            quad_indices: gpu.described_buffer_with(&quad_indices, &indices)?,
            pattern: gpu.described_buffer_with(&plan.buffer(resource::PATTERN), &pattern)?,
            listed: gpu.buffer_with("listed trees", &listed)?,
            species_count: gpu.buffer_with("species count", &[scene.species.len() as u32])?,
            listed_ranges,
            cache: SlotCache::new(plan.seed_regions),
            spare: plan.shadow_quads,
            keys: Vec::new(),
            program: gpu.compute(&shaders::FOREST_SEEDS_COMP, &[("DENSITY_MAPS", maps)])?,
            parameters: SeedParameters {
                extent: scene.terrain.extent.map(|e| e as f32),
                quad_side: plan.quad_side as f32,
                tile_side: plan.tile_side as f32,
                cell_size: if heights { scene.terrain.cell_size as f32 } else { plan.quad_side as f32 },
                pattern_density: plan.pattern_density as f32,
                seed: scene.seed,
                region_capacity: plan.region_capacity,
                tiles_per_side: if plan.pattern.is_some() { plan.tiles_per_quad } else { 0 },
                points_per_tile: plan.pattern.as_ref().map_or(1, |p| p.max_points()),
                first_quad: 0,
                has_heights: u32::from(heights),
            },
            quad_count: scene.terrain.extent.map(|e| (e / plan.quad_side).ceil().max(1.0) as i32),
            side: plan.quad_side,
            wind: scene.wind,
            top: plan.tallest,
        })
    }

    /// Contents thrown out of the cache so far.
    pub fn evicted(&self) -> u32 {
        self.cache.evicted() as u32
    }

    /// The camera's quad and its position in it.
    pub fn camera_quad(&self, eye: &Eye) -> ([i32; 2], [f64; 2]) {
        let side = f64::from(self.parameters.quad_side);
        let quad = [0, 1].map(|k| (eye.position[k] / side).floor());
        (quad.map(|q| q as i32), [0, 1].map(|k| eye.position[k] - quad[k] * side))
    }

    /// Selects the quads whose trees this frame may see, and uploads them.
    ///
    /// # Errors
    /// [`Error::Usage`] when the view needs more quads than the plan holds.
    pub fn update(
        &mut self,
        recorder: &mut Recorder,
        scene: &Scene,
        plan: &Plan,
        tree: &Quadtree,
        eye: &Eye,
    ) -> Result<SeedWork> {
        self.cache.begin_frame();
        self.visible = 0;
        self.visible_quads.clear();
        self.keys.clear();
        if !plan.near_trees {
            return Ok(SeedWork::default());
        }
        let mut visible = self.select(tree, eye, plan.range);
        if let Some(heights) = scene.terrain.heights.as_ref().filter(|_| plan.silhouette_ratio > 1.0) {
            let ground = Ground { heights, terrain: &scene.terrain, lowest: tree.total_range()[0] };
            self.add_silhouettes(&ground, plan, tree, eye, &mut visible);
        }
        let mut fresh = Vec::new();
        for quad in &visible {
            let slot = self.cache.slot(*quad).ok_or_else(|| {
                Error::Usage(format!(
                    "this view needs more than the {} seed quads of the plan: raise zfield_min_pixels or memory_mib",
                    self.cache.capacity()
                ))
            })?;
            let seeds =
                SeedQuad { corner: self.beside_camera(*quad, eye), ..self.seed_quad(*quad, slot.index) };
            self.visible_quads.push(seeds);
            if slot.fresh {
                fresh.push(seeds);
            }
        }
        self.visible = visible.len() as u32;
        self.keys = visible;
        let work = SeedWork { fresh: (self.visible, fresh.len() as u32) };
        recorder.upload(&self.quads, 0, &self.visible_quads)?;
        recorder.upload(&self.quads, u64::from(self.visible) * size_of::<SeedQuad>() as u64, &fresh)?;
        Ok(work)
    }

    /// Region of a quad that casts, and whether its seeds are still to be produced; `None` when all are in use.
    pub(super) fn claim(&mut self, quad: (i32, i32)) -> Option<(SeedQuad, bool)> {
        self.cache.slot(quad).map(|slot| (self.seed_quad(quad, slot.index), slot.fresh))
    }

    /// Gives the regions of what was claimed to others; those that the camera sees stay.
    pub(super) fn release(&mut self) {
        self.cache.begin_frame();
        for quad in &self.keys {
            self.cache.slot(*quad);
        }
    }

    /// What was to be produced may not have been: no region holds anything.
    pub fn forget(&mut self) {
        self.cache = SlotCache::new(self.cache.capacity());
    }

    /// Number of quads along the terrain's sides.
    pub(super) fn count(&self) -> [u32; 2] {
        self.quad_count.map(|n| n as u32)
    }

    /// Quads within `range` whose trees may be in view.
    fn select(&self, tree: &Quadtree, eye: &Eye, range: f64) -> Vec<(i32, i32)> {
        let side = f64::from(self.parameters.quad_side);
        let planes = eye.planes();
        let span = |k: usize| {
            let low = ((eye.position[k] - range) / side).floor() as i32;
            let high = ((eye.position[k] + range) / side).floor() as i32;
            low.max(0)..=high.min(self.quad_count[k] - 1)
        };
        let mut found = Vec::new();
        for y in span(1) {
            for x in span(0) {
                let tall = self.tree_bounds(tree, (x, y));
                if tall.distance(eye.position) <= range && tall.touches(&planes, eye.position) {
                    found.push((x, y));
                }
            }
        }
        found.sort_unstable_by_key(|(x, y)| (*y, *x));
        found
    }

    /// Bounds of a quad's trees.
    fn tree_bounds(&self, tree: &Quadtree, (x, y): (i32, i32)) -> Bounds {
        self.bounds(tree, [x, y], [x + 1, y + 1])
    }

    /// Bounds of the trees of the quads from one to before another: crowns reach out of their quad, and up.
    pub(super) fn bounds(&self, tree: &Quadtree, low: [i32; 2], high: [i32; 2]) -> Bounds {
        let ground =
            tree.ground_bounds(low.map(|v| f64::from(v) * self.side), high.map(|v| f64::from(v) * self.side));
        let margin = self.top;
        Bounds {
            low: [ground.low[0] - margin, ground.low[1] - margin, ground.low[2]],
            high: [ground.high[0] + margin, ground.high[1] + margin, ground.high[2] + margin],
        }
    }

    /// Adds the quads beyond the range whose trees may stand on silhouettes, as many as there are regions for, nearest first.
    fn add_silhouettes(
        &self,
        ground: &Ground,
        plan: &Plan,
        tree: &Quadtree,
        eye: &Eye,
        visible: &mut Vec<(i32, i32)>,
    ) {
        let planes = eye.planes();
        let belt = Belt {
            from: plan.range,
            to: plan.last_range(),
            quad_side: plan.quad_side,
            tallest: plan.tallest,
        };
        let mut beyond: Vec<(f64, (i32, i32))> = silhouette_quads(ground, eye, &belt)
            .into_iter()
            .map(|quad| (self.tree_bounds(tree, quad), quad))
            .filter(|(bounds, quad)| bounds.touches(&planes, eye.position) && !visible.contains(quad))
            .map(|(bounds, quad)| (bounds.distance(eye.position), quad))
            .collect();
        beyond.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let room = ((self.cache.capacity() - self.spare) as usize).saturating_sub(visible.len());
        visible.extend(beyond.into_iter().take(room).map(|(_, quad)| quad));
        visible.sort_unstable_by_key(|(x, y)| (*y, *x));
    }

    /// South-west corner of a quad from the camera's quad, m.
    fn beside_camera(&self, (x, y): (i32, i32), eye: &Eye) -> [f32; 2] {
        let (camera, _) = self.camera_quad(eye);
        [x - camera[0], y - camera[1]].map(|v| (f64::from(v) * f64::from(self.parameters.quad_side)) as f32)
    }

    /// A quad as shaders take it to find its trees.
    pub(super) fn seed_quad(&self, (x, y): (i32, i32), region: u32) -> SeedQuad {
        let p = &self.parameters;
        let (side, cell) = (f64::from(p.quad_side), f64::from(p.cell_size));
        let corner = [f64::from(x) * side, f64::from(y) * side];
        let texel = corner.map(|c| (c / cell).floor());
        let (first, count) = self.listed_ranges.get(&(x, y)).copied().unwrap_or((0, 0));
        SeedQuad {
            tile: [x, y].map(|v| v * p.tiles_per_side as i32),
            texel: texel.map(|t| t as i32),
            texel_offset: [0, 1].map(|k| (corner[k] / cell - texel[k]) as f32),
            region,
            first_position: first,
            position_count: count,
            wind_phases: self.wind.map_or(0, |w| w.place_phases(corner)),
            ..bytemuck::Zeroable::zeroed()
        }
    }

    /// Records the production of fresh seeds.
    pub fn produce(
        &self,
        recorder: &mut Recorder,
        fresh: &[FreshSeeds],
        terrain: &TerrainData,
        species: &SpeciesData,
    ) {
        if fresh.iter().all(|(_, (_, count))| *count == 0) {
            return;
        }
        recorder.compute(pass::SEEDS, |pass| {
            for (quads, (first, count)) in fresh {
                pass.bind(
                    &self.program,
                    &[
                        ("quads", Resource::Buffer(quads)),
                        ("pattern", Resource::Buffer(&self.pattern)),
                        ("listed", Resource::Buffer(&self.listed)),
                        ("species", Resource::Buffer(&species.table)),
                        ("seeds", Resource::Buffer(&self.seeds)),
                        ("draws", Resource::Buffer(&self.draws)),
                        ("heights", Resource::Texture(&terrain.heights, Sampler::Nearest)),
                        ("densities", Resource::Texture(&species.densities, Sampler::Nearest)),
                        ("scene_size", Resource::Buffer(&self.species_count)),
                    ],
                );
                pass.push(&SeedParameters { first_quad: *first, ..self.parameters });
                pass.dispatch([*count, 1, 1]);
            }
        });
    }
}
