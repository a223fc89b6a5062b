//! The terrain pass.

use super::Forest;
use super::targets::ImageTargets;
use super::trees::shader_map::ShaderMap;
use crate::Result;
use crate::forest::terrain::{TerrainData, TerrainDraws};
use crate::gpu::interface::{ForestNode, TERRAIN_CELLS};
use crate::gpu::{
    Buffer, DepthTest, Gpu, GraphicsDesc, Image, ImageDesc, Layers, Program, Recorder, Resource, Sampler,
    Targets, shaders,
};
use crate::plan::names::pass;
use crate::plan::{NODE_TEXELS, Plan, ViewMode};

/// Indices of a mesh over a quad of terrain, of so many cells a side.
///
/// # Errors
/// [`crate::Error::Device`] when out of memory.
pub fn mesh_indices(gpu: &Gpu, name: &str, cells: u32) -> Result<Buffer> {
    let side = cells + 1;
    let cells = (0..cells * cells).map(|k| (k % cells) + side * (k / cells));
    // Diagonals run the same way at every level, so that a morphed quad is the coarser one exactly.
    let indices: Vec<u32> = cells.flat_map(|k| [k, k + 1, k + side + 1, k, k + side + 1, k + side]).collect();
    gpu.buffer_with(name, &indices)
}

/// What stands for the forest's data on the ground in scenes without trees.
pub struct NoTrees {
    coverage: Image,
    nodes: Buffer,
    indirect: Buffer,
}

impl NoTrees {
    /// Allocates.
    ///
    /// # Errors
    /// [`crate::Error::Device`] when out of memory.
    pub fn new(gpu: &Gpu, plan: &Plan) -> Result<Self> {
        Ok(NoTrees {
            coverage: gpu.image(&ImageDesc::stand_in("no coverage", plan.cover_format()))?,
            nodes: gpu.texel_buffer("no nodes", size_of::<ForestNode>() as u64, NODE_TEXELS)?,
            indirect: gpu.texel_buffer("no indirect light", NODE_TEXELS.1, NODE_TEXELS)?,
        })
    }

    /// Coverage tiles, shader-map nodes and indirect light of the forest, or these.
    pub fn or<'a>(&'a self, forest: Option<(&'a Forest, &'a ShaderMap)>) -> (&'a Image, [&'a Buffer; 2]) {
        forest.map_or((&self.coverage, [&self.nodes, &self.indirect]), |(f, map)| {
            (&f.coverage.tiles, [&map.nodes, &f.indirect.nodes])
        })
    }
}

/// Draws the ground, every fragment lit.
pub struct Ground {
    /// For quads that shadow cascades reach, if there are any.
    shadowed: Option<Program>,
    /// For those beyond: its shader looks into no shadow map.
    beyond: Program,
    none: NoTrees,
}

impl Ground {
    /// Makes the program.
    ///
    /// # Errors
    /// [`crate::Error::Device`] if the device fails.
    pub fn new(gpu: &Gpu, plan: &Plan) -> Result<Self> {
        let formats = plan.color_formats();
        let program = |shadowed: bool| {
            let mut constants = vec![
                ("COVER_CHANNELS", plan.cover_channels),
                ("COVER_SIDE", plan.coverage_size),
                ("HAS_SUN", u32::from(plan.sun)),
                ("SHADOWED", u32::from(shadowed)),
                ("INDIRECT", u32::from(plan.indirect > 0)),
                ("INDIRECT_NODES", plan.indirect.max(2)),
                ("WIND", u32::from(plan.wind)),
            ];
            if plan.view_mode != ViewMode::Radiance {
                constants.push(("VIEW_MODE", plan.view_mode as u32));
            }
            gpu.graphics(&GraphicsDesc {
                vert: &shaders::FRAME_TERRAIN_VERT,
                frag: match plan.view_mode {
                    ViewMode::Radiance if plan.layers => &shaders::FRAME_TERRAIN_LAYERS_FRAG,
                    ViewMode::Radiance => &shaders::FRAME_TERRAIN_FRAG,
                    _ => &shaders::FRAME_TERRAIN_MODE_FRAG,
                },
                colors: &formats,
                samples: plan.samples,
                depth: DepthTest::Reverse,
                constants: &constants,
            })
        };
        Ok(Ground {
            shadowed: (plan.cascades > 0).then(|| program(true)).transpose()?,
            beyond: program(false)?,
            none: NoTrees::new(gpu, plan)?,
        })
    }

    /// Records the pass. With `sky` the image starts from that colour, else from what is there.
    #[allow(clippy::too_many_arguments)]
    pub fn record(
        &self,
        recorder: &mut Recorder,
        view: &Buffer,
        indices: &Buffer,
        (terrain, draws): (&TerrainData, &TerrainDraws),
        forest: Option<(&Forest, &ShaderMap)>,
        shadow_map: &Image,
        targets: &ImageTargets,
        sky: Option<[f32; 3]>,
    ) {
        let color = |k: usize| sky.map(|radiance| targets.sky_clear(k, radiance));
        let last = forest.is_none_or(|(f, _)| f.near.is_none());
        let colors: Vec<_> =
            targets.colors.iter().enumerate().map(|(k, t)| t.attachment(color(k), last)).collect();
        let depth = Some(targets.depth.attachment(Some([0.0; 4]), last));
        let (tiles, [nodes, indirect]) = self.none.or(forest);
        recorder.render(pass::TERRAIN, &Targets { colors: &colors, depth, layers: Layers::One(0) }, |pass| {
            let resources = [
                ("view", Resource::Buffer(view)),
                ("quads", Resource::Buffer(&terrain.quads)),
                ("height_tiles", Resource::Texture(&terrain.height_tiles, Sampler::Nearest)),
                ("slope_tiles", Resource::Texture(&terrain.slope_tiles, Sampler::Linear)),
                ("albedo", Resource::Texture(&terrain.albedo, Sampler::Linear)),
                ("shadow_map", Resource::Texture(shadow_map, Sampler::NearestRepeat)),
                ("cover_tiles", Resource::Texture(tiles, Sampler::Trilinear)),
                ("nodes", Resource::Buffer(nodes)),
                ("indirect", Resource::Texels(indirect)),
            ];
            let near = self.shadowed.iter().map(|p| (p, 0..draws.shadowed));
            for (program, quads) in near.chain([(&self.beyond, draws.shadowed..draws.camera.1)]) {
                pass.bind(program, &resources);
                pass.push(&terrain.parameters(draws.camera.0));
                pass.draw_indexed(indices, 6 * TERRAIN_CELLS * TERRAIN_CELLS, quads);
            }
        });
    }
}
