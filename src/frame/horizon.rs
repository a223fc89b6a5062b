//! The sky, and the trees of the shader-map that stand before it where the ground ends. Where silhouettes of the ground are looked for,
//! trees there are drawn one by one, and there is no such pass ([`Plan::horizon`]).

use super::Forest;
use super::targets::{ImageTargets, build_of};
use super::trees::shader_map::ShaderMap;
use crate::Result;
use crate::forest::terrain::{TerrainData, TerrainDraws};
use crate::gpu::interface::TILE_SIDE;
use crate::gpu::{Buffer, Gpu, Layers, Program, Recorder, Resource, Sampler, Targets, shaders};
use crate::plan::Plan;
use crate::plan::names::pass;
use crate::scene::{Scene, Sky};

/// Puts far trees before the sky.
pub struct Horizon {
    program: Program,
    tiles: [u32; 2],
    /// Of a uniform sky, which is not in the picture yet.
    clears: bool,
}

impl Horizon {
    /// Makes the program, if the plan lists the pass.
    ///
    /// # Errors
    /// [`crate::Error::Device`] if the device fails.
    pub fn new(gpu: &Gpu, scene: &Scene, plan: &Plan) -> Result<Option<Self>> {
        if !plan.horizon() {
            return Ok(None);
        }
        let builds = [
            &shaders::FRAME_HORIZON_COMP,
            &shaders::FRAME_HORIZON_SINGLE_COMP,
            &shaders::FRAME_HORIZON_LAYERS_COMP,
            &shaders::FRAME_HORIZON_LAYERS_SINGLE_COMP,
        ];
        let image = matches!(scene.sky, Sky::LatLong { .. });
        let constants = [
            ("COVER_CHANNELS", plan.cover_channels),
            ("COVER_SIDE", plan.coverage_size),
            ("SAMPLES", plan.samples),
            ("SKY_DRAWN", u32::from(image)),
            ("WIND", u32::from(plan.wind)),
        ];
        let tiles = plan.size.map(|n| n.div_ceil(TILE_SIDE));
        Ok(Some(Horizon { program: gpu.compute(build_of(plan, builds), &constants)?, tiles, clears: !image }))
    }

    /// Records the pass of a frame in which no tree is of the shader-map: the sky alone, of this radiance if it is uniform.
    pub fn clear(&self, recorder: &mut Recorder, sky: [f32; 3], targets: &ImageTargets) {
        if !self.clears {
            return;
        }
        let color = |k: usize| targets.sky_clear(k, sky);
        let colors: Vec<_> =
            targets.colors.iter().enumerate().map(|(k, t)| t.attachment(Some(color(k)), false)).collect();
        recorder.render(
            pass::HORIZON,
            &Targets { colors: &colors, depth: None, layers: Layers::One(0) },
            |_| {},
        );
    }

    /// Records the pass, once it is known where samples see the ground.
    pub fn record(
        &self,
        recorder: &mut Recorder,
        view: &Buffer,
        (terrain, draws): (&TerrainData, &TerrainDraws),
        (forest, map): (&Forest, &ShaderMap),
        targets: &ImageTargets,
    ) {
        let Some(quads_seen) = &targets.quads else { return };
        recorder.compute(pass::HORIZON, |pass| {
            let more = targets.shown();
            let all = [
                ("view", Resource::Buffer(view)),
                ("quads", Resource::Texels(&terrain.quads)),
                ("slope_tiles", Resource::Texture(&terrain.slope_tiles, Sampler::Linear)),
                ("cover_tiles", Resource::Texture(&forest.coverage.tiles, Sampler::Trilinear)),
                ("nodes", Resource::Texels(&map.nodes)),
                ("depth", Resource::Texture(targets.depth.drawn(), Sampler::Nearest)),
                ("quads_seen", Resource::Texture(quads_seen.drawn(), Sampler::Nearest)),
            ];
            pass.bind(&self.program, &[&all[..], &more].concat());
            pass.push(&terrain.parameters(draws.camera.0));
            pass.dispatch([self.tiles[1], self.tiles[0], 1]);
        });
    }
}
