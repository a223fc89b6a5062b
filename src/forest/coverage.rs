//! Coverage tiles: what of the ground trees cover in top view, and each species' density, for every terrain quad that the
//! camera sees, near or far (BN12, section 4).
//!
//! A tile holds the union of its trees' discs in one channel and Λ·A a species in the others, four channels a layer, with
//! mip levels 0 to 3. Its quad spans all but a gutter of [`COVER_GUTTER`] texels on each side, drawn with what is there, so
//! that lookups up to the quad's edge are right in every level, and equal in neighbouring tiles. Discs come from the seeds'
//! own candidates, so they are the very trees that are drawn one by one nearby.
//!
//! * Discs smaller than about a texel are drawn on a grid two or four times finer, and averaged: their union is what it
//!   is at finer levels too. Once a disc is under 1/16 texel, none is drawn.
//! * Quads whose own tile would be needlessly fine use that of an ancestor: of the finest level with useful texels, or of
//!   a coarser one when there are not slots enough for a frame. All quads of a level change together, so that neighbours
//!   have texels of equal size.

use super::cache::SlotCache;
use super::seeds::SeedData;
use super::species::SpeciesData;
use super::terrain::{TerrainData, TerrainDraws};
use crate::Result;
use crate::gpu::interface::{
    COVER_GUTTER, COVER_SCRATCH, CoverageParameters, CoverageSplat, CoverageTile, SeedParameters, SeedQuad,
    TERRAIN_CELLS,
};
use crate::gpu::{Buffer, Gpu, Image, ImageDesc, Program, Recorder, Resource, Sampler, shaders};
use crate::land::density::density_map_size;
use crate::land::quadtree::{QuadKey, Quadtree};
use crate::plan::Plan;
use crate::plan::names::{pass, resource};
use crate::scene::{Distribution, Scene};

/// Texels finer than this are needless, m.
const LEAST_TEXEL: f64 = 0.35;
/// So are texels finer than this part of the smallest species' crown radius.
const LEAST_RADIUS_PART: f64 = 0.1;
/// Discs of a smaller part of a texel are not drawn (BN12, section 4).
const LEAST_DISC: f64 = 1.0 / 16.0;
/// Smallest radius of a mean disc on the grid on which discs are drawn, in cells of that grid: discs side by side share
/// cells, in which the product of what each leaves open takes too much off, 3 % of discs of this radius.
const LEAST_RADIUS: f64 = 0.75;
/// Most workgroups a dispatch.
const MOST_GROUPS: u32 = 32768;
/// Texels of a workgroup's region.
const REGION: [u32; 2] = [32, 16];

/// Both push constants of the production.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Push {
    seeds: SeedParameters,
    coverage: CoverageParameters,
}

/// The tiles and what produces them.
pub struct CoverageData {
    /// The tiles, `groups` layers a slot: coverage, then a channel a species.
    pub tiles: Image,
    groups: u32,
    cache: SlotCache<QuadKey>,
    sums: Buffer,
    quads: Buffer,
    splats: Buffer,
    jobs: Buffer,
    splat: Program,
    resolve: Program,
    /// Finest level with tiles of its own.
    finest: u32,
    /// Mean area of a disc, m².
    disc: f64,
    /// Radius of the largest disc, m.
    largest_radius: f64,
    /// Length over which densities may change, m.
    smooth: f64,
}

/// Tiles produced together, through one scratch buffer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Batch {
    tiles: (u32, u32),
    splats: (u32, u32),
}

/// What a frame has to produce.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct CoverageWork {
    /// Number of tiles.
    pub tiles: u32,
    batches: Vec<Batch>,
}

impl CoverageData {
    /// Allocates for a plan.
    ///
    /// # Errors
    /// [`crate::Error::Device`] when out of memory.
    pub fn new(
        gpu: &Gpu,
        scene: &Scene,
        plan: &Plan,
        species: &SpeciesData,
        tree: &Quadtree,
    ) -> Result<Self> {
        let size = plan.coverage_size;
        let (mut weight, mut area, mut largest, mut smallest) = (0.0, 0.0, 0.0f64, f64::INFINITY);
        let mut smooth =
            if scene.terrain.heights.is_some() { scene.terrain.cell_size } else { f64::INFINITY };
        let extent = scene.terrain.extent;
        for (s, row) in scene.species.iter().zip(&species.rows) {
            let radius = f64::from(row.crown_radius);
            let mut scale = f64::from(s.scale[1]);
            let density = match &s.distribution {
                Distribution::Density { max_density, .. } => f64::from(*max_density),
                Distribution::Positions(list) => {
                    let listed = list.iter().filter_map(|p| p.scale).fold(0.0, f32::max);
                    scale = scale.max(f64::from(listed));
                    list.len() as f64 / (extent[0] * extent[1])
                }
            };
            weight += density;
            area += density * f64::from(row.mean_area);
            largest = largest.max(radius * scale);
            smallest = smallest.min(radius);
            if let Some(map) = density_map_size(s, extent) {
                smooth = smooth.min(extent[0] / f64::from(map[0])).min(extent[1] / f64::from(map[1]));
            }
        }
        let least = LEAST_TEXEL.max(LEAST_RADIUS_PART * smallest);
        let inner = f64::from(size - 2 * COVER_GUTTER);
        let finest = (0..tree.levels()).rev().find(|l| tree.side(*l) / inner >= least).unwrap_or(0);
        let of_discs = [("COVER_SIDE", size), ("DENSITY_MAPS", species.map_count)];
        let of_tiles = [&of_discs[..], &[("SPECIES_COUNT", scene.species.len() as u32)]].concat();
        // Zeros, as the production leaves them.
        let sums = plan.buffer(resource::COVERAGE_SUMS);
        let sums = gpu.described_buffer_with(&sums, &vec![0u32; (sums.bytes / 4) as usize])?;
        let none = ImageDesc::stand_in(resource::COVERAGE, plan.cover_format());
        Ok(CoverageData {
            tiles: gpu.image(plan.images(resource::COVERAGE).next().unwrap_or(&none))?,
            groups: plan.cover_layers(),
            cache: SlotCache::new(plan.cover_slots),
            sums,
            quads: gpu.buffer("coverage quads", 0)?,
            splats: gpu.buffer("coverage splats", 0)?,
            jobs: gpu.buffer("coverage jobs", 0)?,
            splat: gpu.compute(&shaders::FOREST_COVERAGE_SPLAT_COMP, &of_discs)?,
            resolve: gpu.compute(
                match plan.cover_channels {
                    2 => &shaders::FOREST_COVERAGE_RESOLVE_PAIR_COMP,
                    _ => &shaders::FOREST_COVERAGE_RESOLVE_COMP,
                },
                &of_tiles,
            )?,
            finest,
            disc: if weight > 0.0 { area / weight } else { 0.0 },
            largest_radius: largest,
            smooth,
        })
    }

    /// Contents thrown out of the cache so far.
    pub fn evicted(&self) -> u32 {
        self.cache.evicted() as u32
    }

    /// What was to be produced may not have been: no tile holds anything.
    pub fn forget(&mut self) {
        self.cache = SlotCache::new(self.cache.capacity());
    }

    /// First layer of the tile of a quad, if this frame uses it.
    pub fn layer(&self, key: &QuadKey) -> Option<u32> {
        self.cache.find(key).map(|slot| slot * self.groups)
    }

    /// Gives each quad that the camera draws its tile, and says which tiles are to be produced.
    ///
    /// # Errors
    /// [`crate::Error::Device`] when out of memory.
    pub fn update(
        &mut self,
        recorder: &mut Recorder,
        tree: &Quadtree,
        seeds: &SeedData,
        draws: &mut TerrainDraws,
    ) -> Result<CoverageWork> {
        let keys = self.choose(&draws.keys);
        self.cache.begin_frame();
        let (mut jobs, mut quads, mut splats) = (Vec::new(), Vec::new(), Vec::new());
        let mut work = CoverageWork::default();
        let (mut batch, mut words) = (Batch::default(), 0);
        for (quad, key) in draws.quads[draws.camera.0 as usize..].iter_mut().zip(keys) {
            // There are no more keys than slots.
            let Some(slot) = self.cache.slot(key) else { continue };
            let own = tree.side(key.level);
            let texel = self.texel(own);
            let corner =
                [0, 1].map(|k| f64::from(quad.corner[k]) * tree.step() - f64::from([key.x, key.y][k]) * own);
            let size = f64::from(self.tiles.size()[0]);
            quad.cover_offset = corner.map(|c| ((c / texel + f64::from(COVER_GUTTER)) / size) as f32);
            let side = f64::from(quad.spacing) * f64::from(TERRAIN_CELLS) * tree.step();
            quad.cover_scale = (side / texel / size) as f32;
            quad.cover_layer = slot.index * self.groups;
            quad.cover_disc = (self.disc / (texel * texel)).max(1e-30).log2() as f32;
            quad.cover_floor = if side == own { 1.0 } else { 0.0 };
            if !slot.fresh {
                continue;
            }
            let (mut job, low) = self.job(key, own, slot.index, f64::from(seeds.parameters.cell_size));
            let taken = job.fine.max(1).pow(2);
            if words + taken > COVER_SCRATCH {
                work.batches.push(batch);
                let (tiles, discs) = (jobs.len() as u32, splats.len() as u32);
                (batch, words) = (Batch { tiles: (tiles, 0), splats: (discs, 0) }, 0);
            }
            job.first = words * self.tiles.size()[0].pow(2);
            words += taken;
            if job.fine > 0 {
                self.overlapping(seeds, low, texel, jobs.len() as u32, &mut quads, &mut splats);
            }
            jobs.push(job);
            batch.tiles.1 += 1;
            batch.splats.1 = splats.len() as u32 - batch.splats.0;
        }
        if batch.tiles.1 > 0 {
            work.batches.push(batch);
        }
        work.tiles = jobs.len() as u32;
        recorder.renew(&mut self.jobs, "coverage jobs", &jobs)?;
        recorder.renew(&mut self.quads, "coverage quads", &quads)?;
        recorder.renew(&mut self.splats, "coverage splats", &splats)?;
        Ok(work)
    }

    /// The tile of each quad: its own or an ancestor's, of the finest level for which all fit the slots.
    fn choose(&self, quads: &[QuadKey]) -> Vec<QuadKey> {
        let mut finest = self.finest;
        loop {
            let keys: Vec<QuadKey> = quads.iter().map(|q| q.ancestor(finest)).collect();
            let mut different = keys.clone();
            different.sort_unstable();
            different.dedup();
            if finest == 0 || different.len() <= self.cache.capacity() as usize {
                return keys;
            }
            finest -= 1;
        }
    }

    /// Metres a texel of the tile of a quad of this side.
    fn texel(&self, side: f64) -> f64 {
        side / f64::from(self.tiles.size()[0] - 2 * COVER_GUTTER)
    }

    /// How to produce a tile, and its south-west corner, m.
    fn job(&self, key: QuadKey, side: f64, slot: u32, cell_size: f64) -> (CoverageTile, [f64; 2]) {
        let texel = self.texel(side);
        let low = [key.x, key.y].map(|v| f64::from(v) * side - f64::from(COVER_GUTTER) * texel);
        let cell = low.map(|v| (v / cell_size).floor());
        let ratio = self.disc / (texel * texel);
        let radius = (ratio / std::f64::consts::PI).sqrt();
        let fine = [1, 2, 4].into_iter().find(|f| f64::from(*f) * radius >= LEAST_RADIUS).unwrap_or(4);
        // Densities are interpolated over a third of what they change in, at most; and averaged from half of it on.
        let step =
            [16, 8, 4, 2].into_iter().find(|s| f64::from(*s) * texel <= self.smooth / 3.0).unwrap_or(1);
        let samples = [1, 2].into_iter().find(|n| texel <= f64::from(*n) * 0.5 * self.smooth).unwrap_or(4);
        let tile = CoverageTile {
            cell: cell.map(|c| c as i32),
            cell_offset: [0, 1].map(|k| (low[k] / cell_size - cell[k]) as f32),
            texel: texel as f32,
            layer: slot * self.groups,
            first: 0,
            fine: if ratio >= LEAST_DISC { fine } else { 0 },
            step,
            samples,
        };
        (tile, low)
    }

    /// Every seed quad from which a disc may reach a tile.
    fn overlapping(
        &self,
        seeds: &SeedData,
        low: [f64; 2],
        texel: f64,
        tile: u32,
        quads: &mut Vec<SeedQuad>,
        splats: &mut Vec<CoverageSplat>,
    ) {
        let (side, count) = (seeds.side, seeds.quad_count);
        let across = f64::from(self.tiles.size()[0]) * texel;
        let span = |k: usize| {
            let first = ((low[k] - self.largest_radius) / side).floor().max(0.0) as i32;
            let last = ((low[k] + across + self.largest_radius) / side).floor() as i32;
            first..=last.min(count[k] - 1)
        };
        for y in span(1) {
            for x in span(0) {
                quads.push(seeds.seed_quad((x, y), 0));
                let corner = [(x, 0), (y, 1)].map(|(v, k)| (f64::from(v) * side - low[k]) as f32);
                splats.push(CoverageSplat { corner, tile, ..bytemuck::Zeroable::zeroed() });
            }
        }
    }

    /// Records the production of fresh tiles.
    pub fn produce(
        &self,
        recorder: &mut Recorder,
        work: &CoverageWork,
        seeds: &SeedData,
        terrain: &TerrainData,
        species: &SpeciesData,
    ) {
        if work.tiles == 0 {
            return;
        }
        let [across, down] = REGION.map(|n| self.tiles.size()[0] / n);
        recorder.compute(pass::COVERAGE, |pass| {
            let push = |first_tile, first_splat| Push {
                seeds: seeds.parameters,
                coverage: CoverageParameters {
                    largest_radius: self.largest_radius as f32,
                    first_tile,
                    first_splat,
                },
            };
            for batch in &work.batches {
                pass.bind(
                    &self.splat,
                    &[
                        ("quads", Resource::Buffer(&self.quads)),
                        ("pattern", Resource::Buffer(&seeds.pattern)),
                        ("listed", Resource::Buffer(&seeds.listed)),
                        ("species", Resource::Buffer(&species.table)),
                        ("splats", Resource::Buffer(&self.splats)),
                        ("tiles", Resource::Buffer(&self.jobs)),
                        ("sums", Resource::Buffer(&self.sums)),
                        ("heights", Resource::Texture(&terrain.heights, Sampler::Nearest)),
                        ("densities", Resource::Texture(&species.densities, Sampler::Nearest)),
                        ("scene_size", Resource::Buffer(&seeds.species_count)),
                    ],
                );
                let (first, count) = batch.splats;
                for done in (0..count).step_by(MOST_GROUPS as usize) {
                    pass.push(&push(batch.tiles.0, first + done));
                    pass.dispatch([(count - done).min(MOST_GROUPS), 1, 1]);
                }
                pass.barrier();
                pass.bind(
                    &self.resolve,
                    &[
                        ("species", Resource::Buffer(&species.table)),
                        ("tiles", Resource::Buffer(&self.jobs)),
                        ("sums", Resource::Buffer(&self.sums)),
                        ("heights", Resource::Texture(&terrain.heights, Sampler::Nearest)),
                        ("densities", Resource::Texture(&species.densities, Sampler::Nearest)),
                        ("level_0", Resource::StorageLevel(&self.tiles, 0)),
                        ("level_1", Resource::StorageLevel(&self.tiles, 1)),
                        ("level_2", Resource::StorageLevel(&self.tiles, 2)),
                        ("level_3", Resource::StorageLevel(&self.tiles, 3)),
                    ],
                );
                pass.push(&push(batch.tiles.0, first));
                pass.dispatch([across, down, batch.tiles.1]);
                pass.barrier();
            }
        });
    }
}
