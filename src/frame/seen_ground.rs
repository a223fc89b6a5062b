//! The ground, lit where it is seen: its mesh leaves the quad and the depth of every sample, and once the trees before it are
//! known, each pixel's ground is lit once, in compute.

use super::Forest;
use super::ground::NoTrees;
use super::targets::{ImageTargets, build_of};
use super::trees::shader_map::ShaderMap;
use crate::Result;
use crate::forest::terrain::{TerrainData, TerrainDraws};
use crate::gpu::interface::{TERRAIN_CELLS, TILE_SIDE};
use crate::gpu::{
    Buffer, DepthTest, Gpu, GraphicsDesc, Image, Layers, Program, Recorder, Resource, Sampler, Targets,
    shaders, vk,
};
use crate::plan::Plan;
use crate::plan::names::pass;
use crate::scene::{Scene, Sky};

/// Finds and lights the ground.
pub struct SeenGround {
    mesh: Program,
    light: Program,
    tiles: [u32; 2],
    none: NoTrees,
}

impl SeenGround {
    /// Makes the programs.
    ///
    /// # Errors
    /// [`crate::Error::Device`] if the device fails.
    pub fn new(gpu: &Gpu, scene: &Scene, plan: &Plan) -> Result<Self> {
        let builds = [
            &shaders::FRAME_GROUND_COMP,
            &shaders::FRAME_GROUND_SINGLE_COMP,
            &shaders::FRAME_GROUND_LAYERS_COMP,
            &shaders::FRAME_GROUND_LAYERS_SINGLE_COMP,
        ];
        Ok(SeenGround {
            mesh: gpu.graphics(&GraphicsDesc {
                vert: &shaders::FRAME_TERRAIN_SEEN_VERT,
                frag: &shaders::FRAME_TERRAIN_SEEN_FRAG,
                colors: &[vk::Format::R32_UINT],
                samples: plan.samples,
                depth: DepthTest::Reverse,
                constants: &[],
            })?,
            light: gpu.compute(
                build_of(plan, builds),
                &[
                    ("COVER_CHANNELS", plan.cover_channels),
                    ("COVER_SIDE", plan.coverage_size),
                    ("SAMPLES", plan.samples),
                    ("TREES", u32::from(plan.shows_z_fields())),
                    (
                        "NEAR_TREES",
                        u32::from(plan.shows_meshes() || plan.shows_cards() || plan.shows_shells()),
                    ),
                    ("SKY_DRAWN", u32::from(plan.horizon() || matches!(scene.sky, Sky::LatLong { .. }))),
                    ("HAS_SUN", u32::from(plan.sun)),
                    ("SHADOWED", u32::from(plan.cascades > 0)),
                    ("INDIRECT", u32::from(plan.indirect > 0)),
                    ("INDIRECT_NODES", plan.indirect.max(2)),
                    ("WIND", u32::from(plan.wind)),
                    ("VIEW_MODE", plan.view_mode as u32),
                ],
            )?,
            tiles: plan.size.map(|n| n.div_ceil(TILE_SIDE)),
            none: NoTrees::new(gpu, plan)?,
        })
    }

    /// Records the pass that finds which quad each sample sees, and its depth.
    pub fn see(
        &self,
        recorder: &mut Recorder,
        view: &Buffer,
        indices: &Buffer,
        (terrain, draws): (&TerrainData, &TerrainDraws),
        targets: &ImageTargets,
    ) {
        let colors: Vec<_> = targets.quads.iter().map(|q| q.attachment(Some([0.0; 4]), false)).collect();
        let depth = Some(targets.depth.attachment(Some([0.0; 4]), false));
        recorder.render(pass::TERRAIN, &Targets { colors: &colors, depth, layers: Layers::One(0) }, |pass| {
            pass.bind(
                &self.mesh,
                &[
                    ("view", Resource::Buffer(view)),
                    ("quads", Resource::Buffer(&terrain.quads)),
                    ("height_tiles", Resource::Texture(&terrain.height_tiles, Sampler::Nearest)),
                ],
            );
            pass.push(&terrain.parameters(draws.camera.0));
            pass.draw_indexed(indices, 6 * TERRAIN_CELLS * TERRAIN_CELLS, 0..draws.camera.1);
        });
    }

    /// Records the pass that lights what samples see of it where they see no tree of `trees_seen`, and puts it before the sky.
    #[allow(clippy::too_many_arguments)]
    pub fn light(
        &self,
        recorder: &mut Recorder,
        view: &Buffer,
        (terrain, draws): (&TerrainData, &TerrainDraws),
        forest: Option<(&Forest, &ShaderMap)>,
        shadow_map: &Image,
        trees_seen: Option<&Buffer>,
        targets: &ImageTargets,
    ) {
        let Some(quads_seen) = &targets.quads else { return };
        let (tiles, [nodes, indirect]) = self.none.or(forest);
        recorder.compute(pass::GROUND, |pass| {
            let more = targets.shown();
            let all = [
                ("view", Resource::Buffer(view)),
                ("quads", Resource::Texels(&terrain.quads)),
                ("slope_tiles", Resource::Texture(&terrain.slope_tiles, Sampler::Linear)),
                ("albedo", Resource::Texture(&terrain.albedo, Sampler::Linear)),
                ("shadow_map", Resource::Texture(shadow_map, Sampler::NearestRepeat)),
                ("cover_tiles", Resource::Texture(tiles, Sampler::Trilinear)),
                ("nodes", Resource::Texels(nodes)),
                ("indirect", Resource::Texels(indirect)),
                // Without trees nothing of it is read.
                ("trees_seen", Resource::Texels(trees_seen.unwrap_or(&terrain.quads))),
                ("depth", Resource::Texture(targets.depth.drawn(), Sampler::Nearest)),
                ("quads_seen", Resource::Texture(quads_seen.drawn(), Sampler::Nearest)),
            ];
            pass.bind(&self.light, &[&all[..], &more].concat());
            pass.push(&terrain.parameters(draws.camera.0));
            pass.dispatch([self.tiles[1], self.tiles[0], 1]);
        });
    }
}
