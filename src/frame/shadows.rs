//! All cascades in one layered pass: the terrain, then the trees, where they stop light. What was drawn is kept: a frame draws
//! the pages that it needs and the frames before did not.

use super::receivers;
use super::shadow_ground::squares;
use crate::Result;
use crate::camera::Eye;
use crate::camera::cascades::{Cascade, cascades};
use crate::forest::casters::{CasterData, DrawnBlock};
use crate::forest::meshes::MeshData;
use crate::forest::pages::{Block, Held, blocks};
use crate::forest::seeds::SeedData;
use crate::forest::species::SpeciesData;
use crate::forest::terrain::TerrainData;
use crate::gpu::interface::{GroundCaster, SHADOW_CELLS, SHADOW_PAGES, ShadowBlock};
use crate::gpu::{
    Attachment, Buffer, DepthTest, Gpu, GraphicsDesc, Image, ImageDesc, Layers, Program, Recorder,
    RenderPass, Resource, Sampler, Targets, shaders, vk,
};
use crate::land::quadtree::Quadtree;
use crate::physics::wind::Motion;
use crate::plan::Plan;
use crate::plan::names::{pass, resource};
use crate::scene::Scene;

/// Push constants of a draw of ground.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct GroundPush {
    block: ShadowBlock,
    /// North-east corner of the terrain on its finest grid.
    last: [f32; 2],
    /// Metres a step of it.
    step: f32,
    /// Height map texels a step of it.
    texels_per_step: f32,
}

/// Push constants of a draw of meshes.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct MeshPush {
    block: ShadowBlock,
    first_caster: u32,
}

/// Shadow maps and the programs that draw them.
pub struct Shadows {
    /// Depth of the caster nearest the sun, one layer a cascade; it repeats.
    pub map: Image,
    /// What this frame draws.
    pub work: ShadowWork,
    held: Held,
    /// Layers that are drawn together, one after the other.
    layers: Vec<Layers>,
    blocks: Buffer,
    sums: Buffer,
    squares: Buffer,
    /// Indices of a square's mesh.
    indices: Buffer,
    programs: Programs,
    /// The wind of what is held.
    motion: Option<Motion>,
    /// Largest texel of cascades that meshes cast into, m.
    mesh_texel: f64,
}

/// What draws: without relief no ground, and trees if any are drawn by themselves.
struct Programs {
    ground: Option<Program>,
    trees: Option<Program>,
    meshes: Option<Program>,
}

/// What a frame draws.
#[derive(Clone, Debug, Default)]
pub struct ShadowWork {
    /// Blocks with pages to draw.
    pub blocks: Vec<DrawnBlock>,
    /// First and number of each block's squares of ground.
    pub ground: Vec<(u32, u32)>,
}

/// What casts besides the ground.
#[derive(Clone, Copy)]
pub struct CastingTrees<'a> {
    /// Where they are found.
    pub data: &'a CasterData,
    /// Their seeds.
    pub seeds: &'a SeedData,
    /// Their species.
    pub species: &'a SpeciesData,
    /// What those are drawn from that cast as meshes, where any do.
    pub meshes: Option<&'a MeshData>,
}

impl Shadows {
    /// Allocates for a plan; without sun, one texel that nothing is drawn to.
    ///
    /// # Errors
    /// [`crate::Error::Device`] when out of memory.
    pub fn new(gpu: &Gpu, scene: &Scene, plan: &Plan) -> Result<Self> {
        let on = plan.cascades > 0;
        let none = ImageDesc::stand_in(resource::CASCADES, vk::Format::D32_SFLOAT);
        let map = gpu.image(plan.images(resource::CASCADES).next().unwrap_or(&none))?;
        let program = |vert, frag, constants| {
            let depth = DepthTest::Reverse;
            gpu.graphics(&GraphicsDesc { vert, frag, colors: &[], samples: 1, depth, constants })
        };
        let s = &scene.settings;
        let wind = [("WIND", u32::from(plan.wind))];
        let resolution = (s.view_resolution as f32).to_bits();
        let views = [("VIEW_RINGS", s.view_rings), ("VIEW_RESOLUTION", resolution), wind[0]];
        let chosen = gpu.info().vertex_layers;
        let (ground, trees, meshes) = match chosen {
            true => (
                &shaders::FRAME_TERRAIN_SHADOW_VERT,
                &shaders::FRAME_TREES_ZFIELD_SHADOW_VERT,
                &shaders::FRAME_TREES_MESHES_SHADOW_VERT,
            ),
            false => (
                &shaders::FRAME_TERRAIN_SHADOW_LAYER_VERT,
                &shaders::FRAME_TREES_ZFIELD_SHADOW_LAYER_VERT,
                &shaders::FRAME_TREES_MESHES_SHADOW_LAYER_VERT,
            ),
        };
        // Level ground shades nothing.
        let ground = (on && scene.terrain.heights.is_some())
            .then(|| program(ground, &shaders::FRAME_TERRAIN_SHADOW_FRAG, &[]));
        let trees =
            (on && plan.near_trees).then(|| program(trees, &shaders::FRAME_TREES_ZFIELD_SHADOW_FRAG, &views));
        let meshes =
            (on && plan.meshes).then(|| program(meshes, &shaders::FRAME_TREES_MESHES_SHADOW_FRAG, &wind));
        let side = SHADOW_CELLS + 1;
        let cells = (0..SHADOW_CELLS * SHADOW_CELLS).map(|k| k % SHADOW_CELLS + side * (k / SHADOW_CELLS));
        let indices: Vec<u32> =
            cells.flat_map(|k| [k, k + 1, k + side + 1, k, k + side + 1, k + side]).collect();
        let layers = map.layers();
        Ok(Shadows {
            layers: match chosen {
                true => vec![Layers::Chosen(layers)],
                false => (0..layers).map(Layers::One).collect(),
            },
            map,
            work: ShadowWork::default(),
            held: Held::default(),
            blocks: gpu.buffer("shadow blocks", 16 * size_of::<ShadowBlock>() as u64)?,
            sums: gpu.buffer("shadow page sums", 0)?,
            squares: gpu.buffer("casting ground", 1024 * size_of::<GroundCaster>() as u64)?,
            indices: gpu.buffer_with("casting ground indices", &indices)?,
            programs: Programs {
                ground: ground.transpose()?,
                trees: trees.transpose()?,
                meshes: meshes.transpose()?,
            },
            motion: None,
            mesh_texel: plan.mesh_texel,
        })
    }

    /// How many of the cascades meshes cast into: the first ones.
    pub fn mesh_cascades(plan: &Plan, cascades: &[Cascade]) -> usize {
        cascades.iter().take_while(|c| c.grid.texel <= plan.mesh_texel).count()
    }

    /// The cascades of an eye.
    pub fn cascades(scene: &Scene, plan: &Plan, eye: &Eye, sun: [f64; 3], highest: f64) -> Vec<Cascade> {
        if plan.cascades == 0 {
            return Vec::new();
        }
        let s = &scene.settings;
        let near = (0.02 * plan.shadow_distance).min(5.0);
        // Nothing is nearer than the highest treetop is below the eye. In steps of factors of two: where cascades begin decides how
        // large their texels are, and all has to be drawn anew when those change.
        let clear = (eye.position[2] - highest).clamp(0.0, 0.5 * plan.shadow_distance);
        let clear = if clear > near { clear.log2().floor().exp2().max(near) } else { 0.0 };
        let (count, split) = (plan.cascades, f64::from(s.cascade_split));
        cascades(eye, sun, (clear, near.max(clear), plan.shadow_distance), count, split, s.cascade_size)
    }

    /// Which pages of the cascades an eye needs that are not there; from now on they are taken to be, until
    /// [`Shadows::forget`].
    ///
    /// # Errors
    /// [`crate::Error::Device`] if the device fails.
    pub fn update(
        &mut self,
        recorder: &mut Recorder,
        (scene, plan): (&Scene, &Plan),
        tree: &Quadtree,
        eye: &Eye,
        cascades: &[Cascade],
    ) -> Result<()> {
        let needed = receivers::needed(tree, eye, cascades, if plan.near_trees { plan.tallest } else { 0.0 });
        let fresh = self.held.take(cascades, &needed);
        let [lowest, highest] = tree.total_range();
        let (mut work, mut sums) = (ShadowWork::default(), Vec::new());
        for (k, (cascade, pages)) in cascades.iter().zip(&fresh).enumerate() {
            for (block, pages) in blocks(cascade, pages) {
                let gpu = shader_block(cascade, k, &block, 0.5 * (lowest + highest), sums.len());
                work.blocks.push(DrawnBlock { cascade: k, texel: cascade.grid.texel, block, pages, gpu });
            }
            if !pages.is_empty() {
                sums.extend(pages.sums());
            }
        }
        if work.blocks.is_empty() {
            self.work = work;
            return Ok(());
        }
        let on_gpu: Vec<ShadowBlock> = work.blocks.iter().map(|b| b.gpu).collect();
        recorder.renew(&mut self.blocks, "shadow blocks", &on_gpu)?;
        recorder.renew(&mut self.sums, "shadow page sums", &sums)?;
        if self.programs.ground.is_some() {
            let pixels = f64::from(scene.settings.terrain_pixels);
            let (all, ranges) = squares(tree, cascades, &work.blocks, pixels);
            recorder.renew(&mut self.squares, "casting ground", &all)?;
            work.ground = ranges;
        }
        self.work = work;
        Ok(())
    }

    /// Takes the wind of a moment: where what casts has moved, all is drawn anew.
    pub fn moved(&mut self, motion: Option<Motion>) {
        if self.motion != motion {
            self.motion = motion;
            self.forget();
        }
    }

    /// What was to be drawn may not have been: all is drawn anew.
    pub fn forget(&mut self) {
        self.held = Held::default();
    }

    /// Records the passes.
    pub fn record(
        &self,
        recorder: &mut Recorder,
        view: &Buffer,
        terrain: &TerrainData,
        trees: Option<CastingTrees>,
    ) {
        let work = &self.work;
        if self.map.size() == [1; 2] {
            return;
        }
        let batches = trees.map_or(0, |t| t.data.work.batches.len());
        for batch in 0..batches.max(1) {
            if let Some(t) = trees.filter(|_| !work.blocks.is_empty()) {
                // Seeds of the first batch are produced with those that the camera sees.
                if let Some(b) = t.data.work.batches.get(batch).filter(|_| batch > 0) {
                    t.seeds.produce(recorder, &[t.data.fresh(b)], terrain, t.species);
                }
                let buffers = (&self.blocks, &self.sums);
                t.data.record(recorder, view, buffers, t.seeds, t.species, batch);
            }
            for layers in &self.layers {
                let depth = Some(Attachment { image: &self.map, resolve: None, clear: None });
                let targets = Targets { colors: &[], depth, layers: *layers };
                recorder.render(pass::SHADOWS, &targets, |pass| {
                    if batch == 0 {
                        self.draw_ground(pass, terrain, work, *layers);
                    }
                    if let (Some(program), Some(t)) = (&self.programs.trees, trees) {
                        self.draw_trees(pass, program, view, (work, *layers), t, batch);
                    }
                    if let (Some(program), Some(t)) = (&self.programs.meshes, trees) {
                        self.draw_meshes(pass, program, view, (work, *layers), t, batch);
                    }
                });
            }
        }
    }

    /// Clears the pages, and draws the ground.
    fn draw_ground(&self, pass: &mut RenderPass, terrain: &TerrainData, work: &ShadowWork, layers: Layers) {
        for b in work.blocks.iter().filter(|b| b.in_layers(layers)) {
            let layer = if let Layers::One(_) = layers { 0 } else { b.cascade as u32 };
            let page = self.page();
            let texel = |at: usize, shift: i64| (at as i64 - shift) as u32 * page;
            for [low, high] in b.pages.rectangles() {
                let [low, high] = [low, high].map(|p| [0, 1].map(|k| texel(p[k], b.block.shift[k])));
                pass.clear_depth([low, high], layer, 0.0);
            }
        }
        let Some(ground) = &self.programs.ground else { return };
        if work.blocks.is_empty() {
            return;
        }
        pass.bind(
            ground,
            &[
                ("squares", Resource::Buffer(&self.squares)),
                ("heights", Resource::Texture(&terrain.heights, Sampler::Nearest)),
            ],
        );
        let p = terrain.parameters(0);
        let blocks = work.blocks.iter().zip(&work.ground);
        for (b, (first, count)) in blocks.filter(|(b, _)| b.in_layers(layers)) {
            self.scissor(pass, b);
            let (last, step, texels_per_step) = (p.last, p.step, p.texels_per_step);
            pass.push(&GroundPush { block: b.gpu, last, step, texels_per_step });
            pass.draw_indexed(&self.indices, 6 * SHADOW_CELLS * SHADOW_CELLS, *first..*first + *count);
        }
    }

    fn draw_trees(
        &self,
        pass: &mut RenderPass,
        program: &Program,
        view: &Buffer,
        (work, layers): (&ShadowWork, Layers),
        trees: CastingTrees,
        batch: usize,
    ) {
        let Some(b) = trees.data.work.batches.get(batch) else { return };
        pass.bind(
            program,
            &[
                ("view", Resource::Buffer(view)),
                ("casters", Resource::Buffer(&trees.data.casters)),
                ("species", Resource::Buffer(&trees.species.table)),
                ("bases", Resource::Buffer(&trees.species.bases)),
                ("views", Resource::Texture(&trees.species.views, Sampler::LinearBorder)),
            ],
        );
        for block in &b.blocks {
            let drawn = &work.blocks[*block];
            if !drawn.in_layers(layers) || self.casts_meshes(drawn) {
                continue;
            }
            self.scissor(pass, drawn);
            pass.push(&drawn.gpu);
            let command = trees.data.work.command(batch, *block);
            pass.draw_indexed_indirect(&trees.seeds.quad_indices, &trees.data.commands, command);
        }
    }

    /// Whether trees cast into a block as meshes.
    fn casts_meshes(&self, b: &DrawnBlock) -> bool {
        self.programs.meshes.is_some() && b.texel <= self.mesh_texel
    }

    fn draw_meshes(
        &self,
        pass: &mut RenderPass,
        program: &Program,
        view: &Buffer,
        (work, layers): (&ShadowWork, Layers),
        trees: CastingTrees,
        batch: usize,
    ) {
        let (Some(b), Some(meshes)) = (trees.data.work.batches.get(batch), trees.meshes) else { return };
        let wanted = |block: &&usize| {
            work.blocks[**block].in_layers(layers) && self.casts_meshes(&work.blocks[**block])
        };
        if !b.blocks.iter().any(|block| wanted(&block)) {
            return;
        }
        pass.bind(
            program,
            &[
                ("view", Resource::Buffer(view)),
                ("casters", Resource::Buffer(&trees.data.casters)),
                ("kinds", Resource::Buffer(&meshes.kinds)),
                ("corners", Resource::Texels(&meshes.corners)),
                ("faces", Resource::Texels(&meshes.faces)),
                ("masks", Resource::Texture(&meshes.masks, Sampler::LinearRepeat)),
            ],
        );
        for block in b.blocks.iter().filter(wanted) {
            let drawn = &work.blocks[*block];
            self.scissor(pass, drawn);
            let (command, first_caster) = trees.data.work.mesh_command(batch, *block);
            pass.push(&MeshPush { block: drawn.gpu, first_caster });
            pass.draw_indirect(&trees.data.mesh_commands, command);
        }
    }

    /// What lies beyond a block in its image belongs to others.
    fn scissor(&self, pass: &mut RenderPass, b: &DrawnBlock) {
        let texels = |pages: [i64; 2]| pages.map(|p| p as u32 * self.page());
        pass.scissor([texels(b.block.first), texels(b.block.last)]);
    }

    /// Texels along a page.
    fn page(&self) -> u32 {
        self.map.size()[0] / SHADOW_PAGES
    }
}

/// A block as shaders take it; `ground` is the height that corners refer to, m, and `sums` where its cascade's sums begin.
fn shader_block(cascade: &Cascade, k: usize, b: &Block, ground: f64, sums: usize) -> ShadowBlock {
    let g = &cascade.grid;
    let axis = |k: usize, scale: f64| g.axes[k].map(|v| (v / scale) as f32);
    let row = i64::from(SHADOW_PAGES) + 1;
    ShadowBlock {
        x: axis(0, g.texel),
        y: axis(1, g.texel),
        z: axis(2, g.depth()),
        cascade: k as u32,
        to_clip: 2.0 / g.texels as f32,
        ground: ground as f32,
        first: b.first.map(|v| v as i32),
        last: b.last.map(|v| v as i32),
        sums: (sums as i64 + b.shift[1] * row + b.shift[0]) as i32,
        texels_per_metre: (1.0 / g.texel) as f32,
        pages_per_texel: 1.0 / g.page() as f32,
        depth_per_metre: (1.0 / g.depth()) as f32,
    }
}
