//! The tree pass: one quad a tree, front to back, each with its own sample mask (BN12, section 5 and 8).

use crate::Result;
use crate::forest::cull::CullData;
use crate::frame::Forest;
use crate::frame::targets::ImageTargets;
use crate::gpu::interface::{CAMERA_DRAWS, DrawCommand};
use crate::gpu::{
    Buffer, DepthTest, Gpu, GraphicsDesc, Image, Layers, Program, Recorder, Resource, Sampler, Targets,
    shaders,
};
use crate::plan::names::pass;
use crate::plan::{Plan, ViewMode};
use crate::scene::Scene;

/// Draws z-field trees.
pub struct Trees {
    /// For the near, middle, far and converged bins: texels magnified, estimates filtered; not magnified; without
    /// estimates; and without light of its own.
    programs: [Program; CAMERA_DRAWS as usize],
}

impl Trees {
    /// Makes the program.
    ///
    /// # Errors
    /// [`crate::Error::Device`] if the device fails.
    pub fn new(gpu: &Gpu, scene: &Scene, plan: &Plan, mask_rows: u32) -> Result<Self> {
        let s = &scene.settings;
        let formats = plan.color_formats();
        let before = s.view_iterations - 1;
        let program = |estimates: u32, magnified: bool, converged: bool| {
            let mut constants = vec![
                ("VIEW_RINGS", s.view_rings),
                ("VIEW_RESOLUTION", (s.view_resolution as f32).to_bits()),
                ("MASK_ROWS", mask_rows),
                ("SAMPLES", plan.samples),
                ("ESTIMATES", estimates),
                // Without sun no ray goes to it.
                ("LIGHT_ITERATIONS", if plan.sun { s.light_iterations } else { 0 }),
                ("HAS_SUN", u32::from(plan.sun)),
                ("MAGNIFIED", u32::from(magnified)),
                ("CONVERGED", u32::from(converged)),
                ("TRANSFER_BANDS", plan.transfer_bands),
                ("TRANSFER_LEVELS", s.transfer_levels()),
                ("INDIRECT", u32::from(plan.indirect > 0)),
                ("WIND", u32::from(plan.wind)),
            ];
            if plan.view_mode != ViewMode::Radiance {
                constants.push(("VIEW_MODE", plan.view_mode as u32));
            }
            gpu.graphics(&GraphicsDesc {
                vert: &shaders::FRAME_TREES_ZFIELD_VERT,
                frag: match plan.view_mode {
                    ViewMode::Radiance if plan.layers => &shaders::FRAME_TREES_ZFIELD_LAYERS_FRAG,
                    ViewMode::Radiance => &shaders::FRAME_TREES_ZFIELD_FRAG,
                    _ => &shaders::FRAME_TREES_ZFIELD_MODE_FRAG,
                },
                colors: &formats,
                samples: plan.samples,
                depth: DepthTest::Reverse,
                constants: &constants,
            })
        };
        Ok(Trees {
            programs: [
                program(before, true, false)?,
                program(before, false, false)?,
                program(0, false, false)?,
                program(0, false, true)?,
            ],
        })
    }

    /// Records the pass.
    pub fn record(
        &self,
        recorder: &mut Recorder,
        view: &Buffer,
        forest: &Forest,
        cull: &CullData,
        shadow_map: &Image,
        targets: &ImageTargets,
    ) {
        let colors: Vec<_> = targets.colors.iter().map(|t| t.attachment(None, true)).collect();
        let depth = Some(targets.depth.attachment(None, true));
        recorder.render(pass::TREES, &Targets { colors: &colors, depth, layers: Layers::One(0) }, |pass| {
            if forest.seeds.visible == 0 {
                return;
            }
            let bound = [
                ("view", Resource::Buffer(view)),
                ("trees", Resource::Buffer(&cull.trees)),
                ("lists", Resource::Buffer(&cull.lists)),
                ("bases", Resource::Buffer(&forest.species.bases)),
                ("masks", Resource::Buffer(&forest.species.masks)),
                ("handed_light", Resource::Buffer(&forest.indirect.handed)),
                ("shadow_map", Resource::Texture(shadow_map, Sampler::NearestRepeat)),
            ];
            let bound = [&bound[..], &forest.species.lit()].concat();
            for (k, program) in self.programs.iter().enumerate() {
                pass.bind(program, &bound);
                let command = (k * size_of::<DrawCommand>()) as u64;
                pass.draw_indexed_indirect(&forest.seeds.quad_indices, &cull.commands, command);
            }
        });
    }
}
