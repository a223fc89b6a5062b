//! The terrain pass.

use super::Forest;
use super::shader_map::ShaderMap;
use super::targets::ImageTargets;
use crate::Result;
use crate::forest::coverage;
use crate::forest::terrain::{TerrainData, TerrainDraws};
use crate::gpu::interface::{ForestNode, TERRAIN_CELLS, TERRAIN_HEIGHTS};
use crate::gpu::{
    Buffer, DepthTest, Gpu, GraphicsDesc, Image, ImageDesc, Program, Recorder, Resource, Sampler, Targets,
    shaders, vk,
};
use crate::plan::{Plan, ViewMode};

/// Draws the ground.
pub struct Ground {
    /// Indices of a quad's mesh.
    pub indices: Buffer,
    /// For quads that shadow cascades reach, if there are any.
    shadowed: Option<Program>,
    /// For those beyond: its shader looks into no shadow map.
    beyond: Program,
    /// Stands for coverage tiles in scenes without trees.
    no_coverage: Image,
    no_nodes: Buffer,
}

impl Ground {
    /// Makes the program.
    ///
    /// # Errors
    /// [`crate::Error::Device`] if the device fails.
    pub fn new(gpu: &Gpu, plan: &Plan) -> Result<Self> {
        let formats: Vec<_> = ImageTargets::formats(plan.layers).iter().map(|f| f.1).collect();
        let side = TERRAIN_HEIGHTS;
        let cells =
            (0..TERRAIN_CELLS * TERRAIN_CELLS).map(|k| (k % TERRAIN_CELLS) + side * (k / TERRAIN_CELLS));
        // Diagonals run the same way at every level, so that a morphed quad is the coarser one exactly.
        let indices: Vec<u32> =
            cells.flat_map(|k| [k, k + 1, k + side + 1, k, k + side + 1, k + side]).collect();
        let program = |shadowed: bool| {
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
                constants: &[
                    (0, plan.cover_channels),
                    (1, (plan.coverage_size as f32).to_bits()),
                    (5, u32::from(plan.cascades > 0)),
                    (6, u32::from(shadowed)),
                    (12, plan.view_mode as u32),
                ],
            })
        };
        Ok(Ground {
            indices: gpu.buffer_with("terrain indices", &indices)?,
            shadowed: (plan.cascades > 0).then(|| program(true)).transpose()?,
            beyond: program(false)?,
            no_coverage: gpu.image(&ImageDesc {
                name: "no coverage",
                format: coverage::format(plan.cover_channels),
                size: [1; 2],
                layers: 1,
                levels: 1,
                samples: 1,
                usage: vk::ImageUsageFlags::empty(),
            })?,
            no_nodes: gpu.buffer("no nodes", size_of::<ForestNode>() as u64)?,
        })
    }

    /// Records the pass. With `sky` the image starts from that colour, else from what is there.
    #[allow(clippy::too_many_arguments)]
    pub fn record(
        &self,
        recorder: &mut Recorder,
        view: &Buffer,
        (terrain, draws): (&TerrainData, &TerrainDraws),
        forest: Option<(&Forest, &ShaderMap)>,
        shadow_map: &Image,
        targets: &ImageTargets,
        sky: Option<[f32; 3]>,
    ) {
        let color = |k: usize| match (targets.colors.len(), k) {
            // With layers the background is sky light that no tree or ground reflects.
            (1, _) => sky.map(|c| [c[0], c[1], c[2], 0.0]),
            (_, 1) => sky.map(|c| [c[0], c[1], c[2], 0.0]),
            _ => sky.map(|_| [0.0; 4]),
        };
        let last = forest.is_none_or(|(f, _)| f.near.is_none());
        let colors: Vec<_> =
            targets.colors.iter().enumerate().map(|(k, t)| t.attachment(color(k), last)).collect();
        let depth = Some(targets.depth.attachment(Some([0.0; 4]), last));
        let (tiles, nodes) =
            forest.map_or((&self.no_coverage, &self.no_nodes), |(f, map)| (&f.coverage.tiles, &map.nodes));
        recorder.render("terrain", &Targets { colors: &colors, depth, layers: 1 }, |pass| {
            let resources = [
                ("view", Resource::Buffer(view)),
                ("quads", Resource::Buffer(&terrain.quads)),
                ("height_tiles", Resource::Texture(&terrain.height_tiles, Sampler::Nearest)),
                ("slope_tiles", Resource::Texture(&terrain.slope_tiles, Sampler::Linear)),
                ("albedo", Resource::Texture(&terrain.albedo, Sampler::Linear)),
                ("shadow_map", Resource::Texture(shadow_map, Sampler::NearestRepeat)),
                ("cover_tiles", Resource::Texture(tiles, Sampler::Trilinear)),
                ("nodes", Resource::Buffer(nodes)),
            ];
            let near = self.shadowed.iter().map(|p| (p, 0..draws.shadowed));
            for (program, quads) in near.chain([(&self.beyond, draws.shadowed..draws.camera.1)]) {
                pass.bind(program, &resources);
                pass.push(&terrain.parameters(draws.camera.0));
                pass.draw_indexed(&self.indices, 6 * TERRAIN_CELLS * TERRAIN_CELLS, quads);
            }
        });
    }
}
