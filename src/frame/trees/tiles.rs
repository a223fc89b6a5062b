//! The tile rasteriser: trees in view, seen first and lit once, in compute.
//!
//! 1. **order**: a stable counting sort of the camera's trees by the nearest depth that each can have.
//! 2. **sight**: a record a tree, of all that finding its samples takes, and its box on the screen.
//! 3. **lists**: for each square of pixels, the trees whose boxes reach into it, front to back.
//! 4. **see**: a tile of 8 × 8 pixels at a time, for each sample the nearest tree, by the same search, opacity and masks as the
//!    graphics pipeline's fragments; a pixel is done when all that it sees is nearer than the next tree can be.
//! 5. **shade**: each pixel's distinct trees, once each, and the pixel from them and the ground.
//!
//! Nothing is assumed of subgroups, and no atomics decide an order. More entries than the lists hold are no error: every tile then
//! looks at all trees in order (`TileState::whole`).

use crate::forest::cull::CullData;
use crate::frame::Forest;
use crate::frame::targets::ImageTargets;
use crate::gpu::interface::{DEPTH_BINS, ORDER_LANES, SCAN_BLOCK, TILE_SIDE, TileParameters, TileState};
use crate::gpu::{
    Buffer, ComputePass, Gpu, Image, Later, Program, Recorder, Resource, Sampler, Shader, shaders,
};
use crate::physics::outline;
use crate::plan::names::pass;
use crate::plan::{Plan, TileBuffer, TileBuffers};
use crate::scene::Scene;
use crate::{Error, Result};

/// Buffers and programs of the tiles.
pub struct TreeTiles {
    parameters: TileParameters,
    tiles: [u32; 2],
    /// Parts of all lists.
    list_parts: u32,
    /// Most trees.
    trees: u32,
    keys: Buffer,
    depth_counts: Buffer,
    order: Buffer,
    records: Buffer,
    boxes: Buffer,
    spans: Buffer,
    ranked: Buffer,
    list_counts: Buffer,
    blocks: Buffer,
    entries: Buffer,
    /// What the passes find.
    pub state: Buffer,
    /// Trees that samples see, counted from 1, `samples` a pixel.
    pub seen: Buffer,
    depths: Buffer,
    order_count: Program,
    order_fill: Program,
    /// Prefix sums: of blocks, of their sums, and within blocks.
    scan: [Program; 3],
    sight: Program,
    entries_count: Program,
    entries_fill: Program,
    see: Program,
    shade: Program,
}

impl TreeTiles {
    /// Allocates for a plan and makes the programs.
    ///
    /// # Errors
    /// [`Error::Device`] when out of memory.
    pub fn new(gpu: &Gpu, scene: &Scene, plan: &Plan, mask_rows: u32) -> Result<Self> {
        let s = &scene.settings;
        let sizes = TileBuffers::new(plan);
        let make = |b: &TileBuffer| gpu.described_buffer(&plan.buffer(b.desc.name));
        let lists = sizes.lists;
        let resolution = (s.view_resolution as f32).to_bits();
        let wind = ("WIND", u32::from(plan.wind));
        let before = s.view_iterations - 1;
        let see: &'static Shader = if plan.samples > 1 {
            &shaders::FRAME_TREES_TILES_SEE_COMP
        } else {
            &shaders::FRAME_TREES_TILES_SEE_SINGLE_COMP
        };
        Ok(TreeTiles {
            parameters: TileParameters {
                size: plan.size,
                lists,
                list_shift: sizes.list_shift,
                near: crate::camera::NEAR_PLANE as f32,
                step_capacity: plan.tile_steps,
                list_lanes: plan.list_lanes,
            },
            list_parts: lists[0] * lists[1] * plan.list_lanes,
            trees: plan.tree_capacity,
            tiles: plan.size.map(|n| n.div_ceil(TILE_SIDE)),
            keys: make(&sizes.keys)?,
            depth_counts: make(&sizes.depth_counts)?,
            order: make(&sizes.order)?,
            records: make(&sizes.records)?,
            boxes: make(&sizes.boxes)?,
            spans: make(&sizes.spans)?,
            ranked: make(&sizes.ranked)?,
            list_counts: make(&sizes.list_counts)?,
            blocks: make(&sizes.blocks)?,
            entries: make(&sizes.entries)?,
            state: make(&sizes.state)?,
            seen: make(&sizes.seen)?,
            depths: make(&sizes.depths)?,
            order_count: gpu.compute(&shaders::FRAME_TREES_TILES_ORDER_COUNT_COMP, &[wind])?,
            order_fill: gpu.compute(&shaders::FRAME_TREES_TILES_ORDER_FILL_COMP, &[])?,
            scan: [
                gpu.compute(&shaders::FRAME_TREES_TILES_SCAN_BLOCKS_COMP, &[])?,
                gpu.compute(&shaders::FRAME_TREES_TILES_SCAN_COMP, &[])?,
                gpu.compute(&shaders::FRAME_TREES_TILES_SCAN_WITHIN_COMP, &[])?,
            ],
            sight: gpu.compute(
                &shaders::FRAME_TREES_TILES_SIGHT_COMP,
                &[
                    ("VIEW_RINGS", s.view_rings),
                    ("VIEW_RESOLUTION", resolution),
                    ("MASK_ROWS", mask_rows),
                    ("SAMPLES", plan.samples),
                    wind,
                ],
            )?,
            entries_count: gpu.compute(&shaders::FRAME_TREES_TILES_ENTRIES_COUNT_COMP, &[])?,
            entries_fill: gpu.compute(&shaders::FRAME_TREES_TILES_ENTRIES_FILL_COMP, &[])?,
            see: gpu.compute(
                see,
                &[
                    ("SAMPLES", plan.samples),
                    ("ESTIMATES", before),
                    ("SHORTCUTS", u32::from(plan.tile_shortcuts)),
                    ("OUTLINE_ROWS", outline::ROWS as u32),
                    ("VIEW_LEVELS", s.view_resolution.ilog2() + 1),
                    wind,
                ],
            )?,
            shade: gpu.compute(
                if plan.layers {
                    &shaders::FRAME_TREES_TILES_SHADE_LAYERS_COMP
                } else {
                    &shaders::FRAME_TREES_TILES_SHADE_COMP
                },
                &[
                    ("SAMPLES", plan.samples),
                    ("ESTIMATES", before),
                    // Without sun no ray goes to it.
                    ("LIGHT_ITERATIONS", if plan.sun { s.light_iterations } else { 0 }),
                    ("HAS_SUN", u32::from(plan.sun)),
                    ("TRANSFER_BANDS", plan.transfer_bands),
                    ("TRANSFER_LEVELS", s.transfer_levels()),
                    ("INDIRECT", u32::from(plan.indirect > 0)),
                    wind,
                    ("VIEW_MODE", plan.view_mode as u32),
                ],
            )?,
        })
    }

    /// Records the passes that find which tree each sample sees before the ground.
    pub fn see(
        &self,
        recorder: &mut Recorder,
        view: &Buffer,
        forest: &Forest,
        cull: &CullData,
        targets: &ImageTargets,
    ) {
        let p = &self.parameters;
        let ground = targets.depth.drawn();
        let all = [
            ("view", Resource::Buffer(view)),
            ("trees", Resource::Texels(&cull.trees)),
            ("lists", Resource::Buffer(&cull.lists)),
            ("commands", Resource::Buffer(&cull.commands)),
            ("species", Resource::Buffer(&forest.species.table)),
            ("bases", Resource::Texels(&forest.species.bases)),
            ("masks", Resource::Buffer(&forest.species.masks)),
            ("keys", Resource::Buffer(&self.keys)),
            ("order", Resource::Buffer(&self.order)),
            ("spans", Resource::Buffer(&self.spans)),
            ("state", Resource::Buffer(&self.state)),
            ("depths", Resource::Buffer(&self.depths)),
            ("views", Resource::Texture(&forest.species.views, Sampler::LinearBorder)),
            ("outlines", Resource::Texels(&forest.species.outlines)),
        ];
        recorder.compute(pass::TREE_ORDER, |pass| {
            let depth = with(
                &all,
                &[("counts", Resource::Buffer(&self.depth_counts)), ("trees", Resource::Buffer(&cull.trees))],
            );
            pass.bind(&self.order_count, &depth);
            pass.dispatch([ORDER_LANES / 8, 1, 1]);
            pass.barrier();
            self.scan(pass, &self.depth_counts, Some(DEPTH_BINS * ORDER_LANES));
            pass.barrier();
            pass.bind(&self.order_fill, &depth);
            pass.dispatch([ORDER_LANES / 8, 1, 1]);
        });
        let own = with(
            &all,
            &[
                ("records", Resource::Buffer(&self.records)),
                ("boxes", Resource::Buffer(&self.boxes)),
                ("ranked", Resource::Buffer(&self.ranked)),
                ("counts", Resource::Buffer(&self.list_counts)),
                ("entries", Resource::Buffer(&self.entries)),
            ],
        );
        recorder.compute(pass::TREE_SIGHTS, |pass| {
            pass.bind(&self.sight, &own);
            pass.push(p);
            pass.dispatch_indirect(&self.state, std::mem::offset_of!(TileState, tree_groups) as u64);
        });
        recorder.fill(pass::LIST_COUNTS, &self.list_counts, 0);
        recorder.compute(pass::TILE_LISTS, |pass| {
            self.scan(pass, &self.spans, None);
            pass.barrier();
            pass.bind(&self.entries_count, &own);
            pass.push(p);
            pass.dispatch([p.list_lanes / 8, 1, 1]);
            pass.barrier();
            self.scan(pass, &self.list_counts, Some(self.list_parts));
            pass.barrier();
            pass.bind(&self.entries_fill, &own);
            pass.push(p);
            pass.dispatch([p.list_lanes / 8, 1, 1]);
        });
        let [across, down] = self.tiles;
        recorder.compute(pass::TILES, |pass| {
            let found = with(
                &all,
                &[
                    ("records", Resource::Texels(&self.records)),
                    ("boxes", Resource::Texels(&self.boxes)),
                    ("entries", Resource::Texels(&self.entries)),
                    ("ends", Resource::Texels(&self.list_counts)),
                    ("seen", Resource::Buffer(&self.seen)),
                    ("ground", Resource::Texture(ground, Sampler::Nearest)),
                ],
            );
            pass.bind(&self.see, &found);
            pass.push(p);
            pass.dispatch([down, across, 1]);
        });
    }

    /// Prefix sums of counts in place, of as many as given or as there are trees, with the total behind the last.
    fn scan(&self, pass: &mut ComputePass, sums: &Buffer, count: Option<u32>) {
        let bound = [
            ("sums", Resource::Buffer(sums)),
            ("state", Resource::Buffer(&self.state)),
            ("blocks", Resource::Buffer(&self.blocks)),
        ];
        let groups = count.unwrap_or(self.trees).div_ceil(SCAN_BLOCK).max(1);
        for (step, (program, groups)) in self.scan.iter().zip([groups, 1, groups]).enumerate() {
            if step > 0 {
                pass.barrier();
            }
            pass.bind(program, &bound);
            pass.push(&count.unwrap_or(0));
            pass.dispatch([groups, 1, 1]);
        }
    }

    /// Records the pass that lights them, on top of what else their pixels' samples see.
    pub fn shade(
        &self,
        recorder: &mut Recorder,
        view: &Buffer,
        forest: &Forest,
        cull: &CullData,
        shadow_map: &Image,
        targets: &ImageTargets,
    ) {
        let [across, down] = self.tiles;
        recorder.compute(pass::TREE_LIGHT, |pass| {
            let shown = targets.shown();
            let all = [
                ("view", Resource::Buffer(view)),
                ("trees", Resource::Texels(&cull.trees)),
                ("ranked", Resource::Texels(&self.ranked)),
                ("bases", Resource::Texels(&forest.species.bases)),
                ("seen", Resource::Texels(&self.seen)),
                ("handed_light", Resource::Texels(&forest.indirect.handed)),
                ("shadow_map", Resource::Texture(shadow_map, Sampler::NearestRepeat)),
            ];
            pass.bind(&self.shade, &[&all[..], &forest.species.lit(), &shown].concat());
            pass.push(&self.parameters);
            pass.dispatch([down, across, 1]);
        });
    }

    /// Has what the tiles find read back.
    ///
    /// # Errors
    /// Those of [`Recorder::read`].
    pub fn read_state(&self, recorder: &mut Recorder) -> Result<Later<TileState>> {
        recorder.read(&self.state, 0, 1)
    }

    /// Checks what a frame's tiles found.
    ///
    /// # Errors
    /// [`Error::Usage`] when a tile had more to look at than drivers let a shader do.
    pub fn check(state: &TileState) -> Result<()> {
        if state.overrun != 0 {
            return Err(Error::Usage(
                "more trees stand one behind the other than tiles can go through: use --rasterizer graphics"
                    .into(),
            ));
        }
        Ok(())
    }
}

/// Resources of a pass, and those of all, whose names it may take.
fn with<'a>(
    all: &[(&'static str, Resource<'a>)],
    more: &[(&'static str, Resource<'a>)],
) -> Vec<(&'static str, Resource<'a>)> {
    [more, all].concat()
}
