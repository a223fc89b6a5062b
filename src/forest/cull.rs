//! Culling and ordered compaction: which seeds does a frame draw, where, and in which order.
//!
//! Three dispatches: classify every seed and count, a workgroup, how many are in each list; prefix sums over the counts;
//! write every tree's record and its index into the lists, each at the place that the sums give it. No atomics on
//! memory decide any order, so the same seeds give the same bits. [`classify`] is the CPU's twin of the decision.

use super::indirect::IndirectData;
use super::seeds::SeedData;
use super::species::SpeciesData;
use super::tables::TableData;
use super::terrain::TerrainData;
use crate::gpu::interface::{
    CAMERA_DRAWS, CULL_GROUP, CullParameters, DISTANCE_BINS, DrawCommand, FADE_FIRST, FADE_RATE, FADE_SPREAD,
    Seed, SeedQuad, Species, TREE_LISTS, View,
};
use crate::gpu::{Buffer, Gpu, Later, Program, Recorder, Resource, Sampler, shaders};
use crate::land::silhouette::clearance;
use crate::physics::handover;
use crate::physics::hash::{HASH_FADE, hash, unit};
use crate::physics::raster::Raster;
use crate::plan::Plan;
use crate::plan::names::{pass, resource};
use crate::scene::Scene;
use crate::{Error, Result};

const _: () = assert!(TREE_LISTS == 1 + DISTANCE_BINS);
// The band over which trees fade is that of the models.
const _: () = assert!(FADE_FIRST == handover::FADE_FIRST as f32);
const _: () = assert!(FADE_SPREAD == handover::FADE_SPREAD as f32);
const _: () = assert!(FADE_RATE == handover::FADE_RATE as f32);

/// A seed's class: seen by the camera; the low five bits are its distance bin.
pub const CLASS_CAMERA: u32 = 1 << 5;

/// Buffers and programs of the cull.
pub struct CullData {
    /// Records of all trees that are seen.
    pub trees: Buffer,
    /// Indices into `trees`, bin after bin.
    pub lists: Buffer,
    /// Draw commands: near, middle, far and converged trees.
    pub commands: Buffer,
    /// Number of trees in each list.
    pub totals: Buffer,
    /// Class of every seed, workgroup after workgroup.
    pub classes: Buffer,
    counts: Buffer,
    /// Where the bins begin in the lists.
    pub starts: Buffer,
    programs: [Program; 4],
    capacity: u32,
    /// Distances under which a tree's texels may be magnified, from which it covers few pixels, and from which its light
    /// is the average, m.
    draw_limits: [f64; 3],
    last: f64,
}

/// How many trees a frame draws.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct TreeCounts {
    /// Trees in view.
    pub camera: u32,
    /// Of these, those that are meshes.
    pub meshes: u32,
    /// And those that are clouds of cards.
    pub cards: u32,
    /// Casters drawn into each cascade: those of pages that frames before have not left.
    pub cascades: Vec<u32>,
}

impl CullData {
    /// Allocates for a plan.
    ///
    /// # Errors
    /// [`Error::Device`] when out of memory.
    pub fn new(gpu: &Gpu, scene: &Scene, plan: &Plan, tables: &TableData) -> Result<Self> {
        let float = |n: u32| (n as f32).to_bits();
        let constants = [
            ("VIEW_RINGS", scene.settings.view_rings),
            ("VIEW_RESOLUTION", float(scene.settings.view_resolution)),
            ("TABLE_ANGLES", float(tables.angles)),
            ("TABLE_DENSITIES", float(tables.densities)),
            ("PAIR_TABLES", u32::from(plan.pair_tables)),
            ("SAMPLES", plan.samples),
            ("INDIRECT", u32::from(plan.indirect > 0)),
            ("INDIRECT_FIRST", IndirectData::first_species(plan)),
            ("INDIRECT_NODES", plan.indirect.max(2)),
            ("WIND", u32::from(plan.wind)),
        ];
        Ok(CullData {
            trees: gpu.described_buffer(&plan.buffer(resource::TREES))?,
            lists: gpu.described_buffer(&plan.buffer(resource::TREE_LISTS))?,
            commands: gpu.buffer("tree draws", u64::from(CAMERA_DRAWS) * size_of::<DrawCommand>() as u64)?,
            totals: gpu.buffer("tree totals", 4 * u64::from(TREE_LISTS))?,
            classes: gpu.described_buffer(&plan.buffer(resource::SEED_CLASSES))?,
            counts: gpu.described_buffer(&plan.buffer(resource::LIST_COUNTS))?,
            starts: gpu.buffer("list starts", 4 * u64::from(TREE_LISTS))?,
            programs: [
                gpu.compute(&shaders::FOREST_CULL_COMP, &[])?,
                gpu.compute(&shaders::FOREST_SCAN_COMP, &[])?,
                gpu.compute(&shaders::FOREST_COMMANDS_COMP, &[])?,
                gpu.compute(&shaders::FOREST_COMPACT_COMP, &constants)?,
            ],
            capacity: plan.tree_capacity,
            draw_limits: plan.draw_limits,
            last: plan.last_range(),
        })
    }

    /// How many of the distance bins have trees that are nearer than this, m.
    pub fn bins_within(&self, distance: f64) -> u32 {
        first_bin_from(distance, self.last)
    }

    /// How many of the distance bins have trees only that are nearer than this, m.
    pub fn bins_before(&self, distance: f64) -> u32 {
        (0..DISTANCE_BINS).take_while(|b| bin_end(*b, self.last) <= distance).count() as u32
    }

    /// Takes the distances of another plan.
    pub fn set_limits(&mut self, plan: &Plan) {
        (self.draw_limits, self.last) = (plan.draw_limits, plan.last_range());
    }

    /// Records the cull of `seeds.visible` quads.
    pub fn record(
        &self,
        recorder: &mut Recorder,
        view: &Buffer,
        seeds: &SeedData,
        species: &SpeciesData,
        (tables, indirect): (&TableData, &IndirectData),
        terrain: &TerrainData,
    ) {
        let groups_per_region = seeds.region_capacity / CULL_GROUP;
        let parameters = CullParameters {
            group_count: seeds.visible * groups_per_region,
            groups_per_region,
            region_capacity: seeds.region_capacity,
            tree_capacity: self.capacity,
            near_bins: first_bin_from(self.draw_limits[0], self.last),
            far_bins: first_bin_from(self.draw_limits[1], self.last),
            converged_bins: first_bin_from(self.draw_limits[2], self.last),
        };
        let shared = [
            ("view", Resource::Buffer(view)),
            ("quads", Resource::Buffer(&seeds.quads)),
            ("draws", Resource::Buffer(&seeds.draws)),
            ("seeds", Resource::Buffer(&seeds.seeds)),
            ("species", Resource::Buffer(&species.table)),
            ("classes", Resource::Buffer(&self.classes)),
            ("counts", Resource::Buffer(&self.counts)),
            ("totals", Resource::Buffer(&self.totals)),
            ("starts", Resource::Buffer(&self.starts)),
            ("commands", Resource::Buffer(&self.commands)),
            ("trees", Resource::Buffer(&self.trees)),
            ("lists", Resource::Buffer(&self.lists)),
            ("pair_table", Resource::Texture(&tables.pairs, Sampler::Linear)),
            ("view_table", Resource::Texture(&tables.views, Sampler::Linear)),
            ("indirect", Resource::Texels(&indirect.nodes)),
            ("handed_light", Resource::Buffer(&indirect.handed)),
            ("heights", Resource::Texture(&terrain.heights, Sampler::Nearest)),
        ];
        let groups = [parameters.group_count, 1, 1];
        for (name, program, size) in [
            (pass::CULL, 0, groups),
            (pass::SUMS, 1, [1, 1, 1]),
            (pass::COMMANDS, 2, [1, 1, 1]),
            (pass::COMPACT, 3, groups),
        ] {
            recorder.compute(name, |pass| {
                pass.bind(&self.programs[program], &shared);
                pass.push(&parameters);
                pass.dispatch(size);
            });
        }
    }

    /// Has the number of trees in view read back.
    ///
    /// # Errors
    /// Those of [`Recorder::read`].
    pub fn read_total(&self, recorder: &mut Recorder) -> Result<Later<u32>> {
        recorder.read(&self.totals, 0, 1)
    }

    /// That a frame drew all of so many trees in view.
    ///
    /// # Errors
    /// [`Error::Usage`] when there were more than the plan holds.
    pub fn check(&self, total: u32) -> Result<()> {
        if total > self.capacity {
            return Err(Error::Usage(format!(
                "{total} trees in view, and the plan holds {}: raise zfield_max_trees or zfield_min_pixels",
                self.capacity
            )));
        }
        Ok(())
    }
}

/// Distance to which a bin reaches, m, of those up to the distance `last`: bins of equal ratio, because what matters for
/// drawing front to back is relative distance. The last one has no end.
pub fn bin_end(bin: u32, last: f64) -> f64 {
    last.max(2.0).powf(f64::from(bin + 1) / f64::from(DISTANCE_BINS))
}

/// The first bin all of whose trees are at least this far.
fn first_bin_from(distance: f64, last: f64) -> u32 {
    (0..DISTANCE_BINS).find(|b| *b > 0 && bin_end(b - 1, last) >= distance).unwrap_or(DISTANCE_BINS)
}

/// Centre of a tree's box from the camera; twin of `tree_centre` in `shaders/forest/cull.glsl`, to the bit.
pub fn tree_centre(view: &View, quad: &SeedQuad, seed: &Seed, species: &Species) -> [f32; 3] {
    let xy = [0, 1].map(|k| (quad.corner[k] + seed.position[k]) - view.quad_offset[k]);
    [xy[0], xy[1], (seed.ground - view.camera_height) + species.centre * seed.scale]
}

/// Twin of `fade_end` in `shaders/physics/handover.glsl`, to the bit.
fn fade_end(u: f32) -> f32 {
    FADE_FIRST + FADE_SPREAD * u
}

/// Class of a seed, 0 if the camera does not see it; twin of `classify` in `shaders/forest/cull.glsl`, to the bit. `heights` is the
/// terrain's height map.
pub fn classify(
    view: &View,
    quad: &SeedQuad,
    seed: &Seed,
    species: &Species,
    centre: [f32; 3],
    heights: Option<&Raster>,
) -> u32 {
    let dot = |a: &[f32]| (a[0] * centre[0] + a[1] * centre[1]) + a[2] * centre[2];
    let radius = species.bounding_radius * seed.scale;
    let d2 = dot(&centre);
    let end = species.range * fade_end(unit(hash(seed.identity ^ HASH_FADE)));
    let last = end * view.silhouette_ratio;
    if d2 >= last * last {
        return 0;
    }
    let beyond = d2 >= end * end;
    let height = (2.0 * species.scale_to_metres[2]) * seed.scale;
    let stays = || heights.is_some_and(|h| clearance(view, quad, seed, centre, height, h) > 0.0);
    if view.planes.iter().all(|p| dot(&p[..3]) + p[3] >= -radius) && (!beyond || stays()) {
        let bins = (0..DISTANCE_BINS as usize - 1).filter(|k| d2 > view.bins[k / 4][k % 4]).count();
        return CLASS_CAMERA | bins as u32;
    }
    0
}
