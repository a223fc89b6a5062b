//! Trees that cast into what is drawn of the shadow cascades. Who casts depends on the ground and the sun alone: every tree whose
//! shadow may meet a page that is drawn, wherever the camera is. [`reached`] is the CPU's twin of the decision.
//!
//! There may be more of them than memory holds at once. They are found and drawn in batches, each of as many seed quads as
//! there are regions and records for; a batch takes the regions of the one before.

use std::collections::BTreeMap;

use super::pages::{Block, PageSet};
use super::seeds::{FreshSeeds, SeedData};
use super::species::SpeciesData;
use crate::camera::cascades::Cascade;
use crate::gpu::interface::{
    CULL_GROUP, CasterParameters, CasterQuad, DrawCommand, PlainDraw, Seed, SeedQuad, ShadowBlock, Species,
};
use crate::gpu::{Buffer, Gpu, Later, Layers, Program, Recorder, Resource, shaders};
use crate::land::quadtree::{Quadtree, grid_cells};
use crate::plan::Plan;
use crate::plan::names::{pass, resource};
use crate::scene::Scene;
use crate::{Error, Result};

/// What is drawn of a cascade between two seams of its map.
#[derive(Clone, Debug)]
pub struct DrawnBlock {
    /// Index of its cascade.
    pub cascade: usize,
    /// Metres a texel of that.
    pub texel: f64,
    /// Where it is.
    pub block: Block,
    /// The pages drawn, in the cascade's square.
    pub pages: PageSet,
    /// The same for shaders.
    pub gpu: ShadowBlock,
}

impl DrawnBlock {
    /// Whether it is drawn with these layers.
    pub fn in_layers(&self, layers: Layers) -> bool {
        !matches!(layers, Layers::One(layer) if layer as usize != self.cascade)
    }
}

/// Buffers and program.
pub struct CasterData {
    /// Records of a batch.
    pub casters: Buffer,
    /// Draw commands: one a block, batch after batch.
    pub commands: Buffer,
    /// The same for casters that are drawn as meshes.
    pub mesh_commands: Buffer,
    /// Corners of the largest mesh.
    mesh_corners: u32,
    /// What this frame finds and draws.
    pub work: CasterWork,
    quads: Buffer,
    seed_quads: Buffer,
    program: Program,
    capacity: u32,
}

/// One batch.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CasterBatch {
    /// First and number of its quads, once for each block that they may cast into.
    pub quads: (u32, u32),
    /// First and number of those whose seeds are to be produced.
    pub fresh: (u32, u32),
    /// Blocks that they may cast into.
    pub blocks: Vec<usize>,
}

/// What a frame has to find and draw.
#[derive(Clone, Debug, Default)]
pub struct CasterWork {
    /// Batches, in order.
    pub batches: Vec<CasterBatch>,
    /// All quads, as uploaded, for the CPU's twin.
    pub quads: Vec<CasterQuad>,
    /// Number of blocks.
    pub blocks: usize,
}

impl CasterWork {
    /// Byte of the draw command of a batch's block.
    pub fn command(&self, batch: usize, block: usize) -> u64 {
        ((batch * self.blocks + block) * size_of::<DrawCommand>()) as u64
    }

    /// The same of casters that are drawn as meshes, and the first record.
    pub fn mesh_command(&self, batch: usize, block: usize) -> (u64, u32) {
        let (first, count) = self.batches[batch].quads;
        let quads = &self.quads[first as usize..][..count as usize];
        let base = quads.iter().find(|q| q.block as usize == block).map_or(0, |q| q.base);
        (((batch * self.blocks + block) * size_of::<PlainDraw>()) as u64, base)
    }
}

/// A batch while it is filled.
#[derive(Default)]
struct Filling {
    /// Quads by block.
    quads: BTreeMap<usize, Vec<CasterQuad>>,
    records: u32,
    fresh: Vec<SeedQuad>,
}

impl CasterData {
    /// Allocates for a plan.
    ///
    /// # Errors
    /// [`Error::Device`] when out of memory.
    pub fn new(gpu: &Gpu, scene: &Scene, plan: &Plan) -> Result<Self> {
        let constants = [
            ("VIEW_RINGS", scene.settings.view_rings),
            ("VIEW_RESOLUTION", (scene.settings.view_resolution as f32).to_bits()),
            ("WIND", u32::from(plan.wind)),
        ];
        Ok(CasterData {
            casters: gpu.described_buffer(&plan.buffer(resource::CASTERS))?,
            commands: gpu.buffer("caster draws", 64 * size_of::<DrawCommand>() as u64)?,
            mesh_commands: gpu.buffer("mesh caster draws", 64 * size_of::<PlainDraw>() as u64)?,
            mesh_corners: 3 * scene.species.iter().map(|s| s.mesh.triangles.len() as u32).max().unwrap_or(0),
            work: CasterWork::default(),
            quads: gpu.buffer("caster quads", 4096 * size_of::<CasterQuad>() as u64)?,
            seed_quads: gpu.buffer("caster seed quads", 1024 * size_of::<SeedQuad>() as u64)?,
            program: gpu.compute(&shaders::FOREST_CASTERS_COMP, &constants)?,
            capacity: plan.caster_capacity,
        })
    }

    /// Finds the quads that may cast into blocks, shares them out among batches, and uploads them.
    ///
    /// # Errors
    /// [`Error::Usage`] when the camera leaves no region to any of them; [`Error::Device`].
    pub fn update(
        &mut self,
        recorder: &mut Recorder,
        seeds: &mut SeedData,
        tree: &Quadtree,
        cascades: &[Cascade],
        blocks: &[DrawnBlock],
    ) -> Result<()> {
        self.work = CasterWork::default();
        if blocks.is_empty() {
            return Ok(());
        }
        let mut work = CasterWork { blocks: blocks.len(), ..CasterWork::default() };
        let (mut fresh, mut filling) = (Vec::new(), Filling::default());
        for ((y, x), into) in casting_quads(seeds, tree, cascades, blocks) {
            let records = into.len() as u32 * seeds.region_capacity;
            let mut claimed = None;
            if filling.records + records <= self.capacity {
                claimed = seeds.claim((x, y));
            }
            if claimed.is_none() && records <= self.capacity {
                filling.close(&mut work, &mut fresh);
                seeds.release();
                claimed = seeds.claim((x, y));
            }
            let Some((quad, new)) = claimed else {
                return Err(Error::Usage(
                    "the view takes all seed quads of the plan, and leaves none to trees that only cast shadows: raise \
                     zfield_min_pixels or memory_mib"
                        .into(),
                ));
            };
            if new {
                filling.fresh.push(quad);
            }
            filling.records += records;
            for block in into {
                let caster = caster_quad(seeds, &cascades[blocks[block].cascade], &blocks[block], [x, y]);
                let (region, wind_phases) = (quad.region, quad.wind_phases);
                let caster = CasterQuad { region, block: block as u32, wind_phases, ..caster };
                filling.quads.entry(block).or_default().push(caster);
            }
        }
        filling.close(&mut work, &mut fresh);
        number(seeds.region_capacity, &mut work);
        recorder.renew(&mut self.quads, "caster quads", &work.quads)?;
        recorder.renew(&mut self.seed_quads, "caster seed quads", &fresh)?;
        recorder.renew(&mut self.commands, "caster draws", &draw_commands(&work))?;
        let none = PlainDraw { vertex_count: self.mesh_corners, ..bytemuck::Zeroable::zeroed() };
        let none = vec![none; work.batches.len() * work.blocks];
        recorder.renew(&mut self.mesh_commands, "mesh caster draws", &none)?;
        self.work = work;
        Ok(())
    }

    /// Number of quads whose seeds are to be produced.
    pub fn fresh_quads(&self) -> u32 {
        self.work.batches.iter().map(|b| b.fresh.1).sum()
    }

    /// Quads whose seeds a batch wants produced.
    pub fn fresh(&self, batch: &CasterBatch) -> FreshSeeds<'_> {
        (&self.seed_quads, batch.fresh)
    }

    /// Records the finding of a batch's casters.
    #[allow(clippy::too_many_arguments)]
    pub fn record(
        &self,
        recorder: &mut Recorder,
        view: &Buffer,
        (blocks, sums): (&Buffer, &Buffer),
        seeds: &SeedData,
        species: &SpeciesData,
        batch: usize,
    ) {
        let work = &self.work;
        recorder.compute(pass::CASTERS, |pass| {
            let Some(b) = work.batches.get(batch) else { return };
            pass.bind(
                &self.program,
                &[
                    ("view", Resource::Buffer(view)),
                    ("quads", Resource::Buffer(&self.quads)),
                    ("blocks", Resource::Buffer(blocks)),
                    ("sums", Resource::Buffer(sums)),
                    ("draws", Resource::Buffer(&seeds.draws)),
                    ("seeds", Resource::Buffer(&seeds.seeds)),
                    ("species", Resource::Buffer(&species.table)),
                    ("casters", Resource::Buffer(&self.casters)),
                    ("commands", Resource::Buffer(&self.commands)),
                    ("mesh_commands", Resource::Buffer(&self.mesh_commands)),
                ],
            );
            let groups_per_region = seeds.region_capacity / CULL_GROUP;
            pass.push(&CasterParameters {
                first_quad: b.quads.0,
                groups_per_region,
                region_capacity: seeds.region_capacity,
                first_command: (batch * work.blocks) as u32,
            });
            pass.dispatch([b.quads.1 * groups_per_region, 1, 1]);
        });
    }

    /// Has the draw commands read back, with how many trees each draws: one a block, batch after batch.
    ///
    /// # Errors
    /// Those of [`Recorder::read`].
    pub fn read_commands(&self, recorder: &mut Recorder) -> Result<Later<DrawCommand>> {
        recorder.read(&self.commands, 0, self.work.batches.len() * self.work.blocks)
    }
}

impl Filling {
    /// Ends the batch, unless it is empty, and begins the next.
    fn close(&mut self, work: &mut CasterWork, fresh: &mut Vec<SeedQuad>) {
        let done = std::mem::take(self);
        if done.quads.is_empty() {
            return;
        }
        let (first, first_fresh) = (work.quads.len() as u32, fresh.len() as u32);
        let blocks = done.quads.keys().copied().collect();
        work.quads.extend(done.quads.into_values().flatten());
        let quads = (first, work.quads.len() as u32 - first);
        work.batches.push(CasterBatch { quads, fresh: (first_fresh, done.fresh.len() as u32), blocks });
        fresh.extend(done.fresh);
    }
}

/// Gives every block of every batch its records: as many as its quads have regions for.
fn number(region_capacity: u32, work: &mut CasterWork) {
    for batch in &work.batches {
        let (mut base, mut block, mut next) = (0, u32::MAX, 0);
        for quad in &mut work.quads[batch.quads.0 as usize..][..batch.quads.1 as usize] {
            if quad.block != block {
                (block, base) = (quad.block, next);
            }
            quad.base = base;
            next += region_capacity;
        }
    }
}

/// Draw commands of no tree yet.
fn draw_commands(work: &CasterWork) -> Vec<DrawCommand> {
    let none = DrawCommand { instance_count: 1, ..bytemuck::Zeroable::zeroed() };
    let mut commands = vec![none; work.batches.len() * work.blocks];
    for (k, batch) in work.batches.iter().enumerate() {
        for quad in &work.quads[batch.quads.0 as usize..][..batch.quads.1 as usize] {
            commands[k * work.blocks + quad.block as usize].vertex_offset = 4 * quad.base as i32;
        }
    }
    commands
}

/// The quads, (row, column), that may cast into blocks, and into which.
fn casting_quads(
    seeds: &SeedData,
    tree: &Quadtree,
    cascades: &[Cascade],
    blocks: &[DrawnBlock],
) -> BTreeMap<(i32, i32), Vec<usize>> {
    let mut quads: BTreeMap<(i32, i32), Vec<usize>> = BTreeMap::new();
    for (k, b) in blocks.iter().enumerate() {
        let cascade = &cascades[b.cascade];
        let casts = |low: [u32; 2], high: [u32; 2]| {
            let bounds = seeds.bounds(tree, low.map(|v| v as i32), high.map(|v| v as i32));
            b.pages.touches(cascade, &bounds) && cascade.grid.before_the_end(&bounds)
        };
        for [x, y] in grid_cells(seeds.count(), &casts) {
            quads.entry((y as i32, x as i32)).or_default().push(k);
        }
    }
    quads
}

/// A quad in a block.
fn caster_quad(seeds: &SeedData, cascade: &Cascade, b: &DrawnBlock, quad: [i32; 2]) -> CasterQuad {
    let [x, y] = quad.map(|v| f64::from(v) * seeds.side);
    let corner = cascade.grid.place([x, y, f64::from(b.gpu.ground)]);
    CasterQuad { corner: b.block.within(corner), ..bytemuck::Zeroable::zeroed() }
}

/// Pages of a block, first and last of both axes, that a tree with views of so many texels may cast into, none where a last is before a first; twin of
/// `caster_place` and `caster_pages` in `shaders/forest/casters.glsl`, to the bit.
pub fn reached(
    b: &ShadowBlock,
    quad: &CasterQuad,
    seed: &Seed,
    species: &Species,
    resolution: u32,
) -> [[i32; 2]; 2] {
    let height = (seed.ground - b.ground) + species.centre * seed.scale;
    let within = [seed.position[0], seed.position[1], height];
    let along = |a: [f32; 3]| (a[0] * within[0] + a[1] * within[1]) + a[2] * within[2];
    let place = [quad.corner[0] + along(b.x), quad.corner[1] + along(b.y)];
    let around = (species.bounding_radius * seed.scale) * b.texels_per_metre;
    let reach = around + (1.5 * around / resolution as f32).max(2.0);
    let page = |v: f32, k: usize| {
        (v * b.pages_per_texel).floor().clamp(b.first[k] as f32 - 1.0, b.last[k] as f32) as i32
    };
    let first = [0, 1].map(|k| page(place[k] - reach, k).max(b.first[k]));
    let last = [0, 1].map(|k| page(place[k] + reach, k).min(b.last[k] - 1));
    [first, last]
}
