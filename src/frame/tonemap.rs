//! Linear radiance to the display picture.

use super::targets::ImageTargets;
use crate::Result;
use crate::gpu::interface::TonemapParameters;
use crate::gpu::{Gpu, Program, Recorder, Resource, Sampler, shaders};
use crate::plan::names::pass;
use crate::plan::{Plan, ViewMode};

/// Tone maps the resolved image.
pub struct Tonemap {
    program: Program,
    parts: u32,
}

impl Tonemap {
    /// Makes the program.
    ///
    /// # Errors
    /// [`crate::Error::Device`] if the device fails.
    pub fn new(gpu: &Gpu, plan: &Plan) -> Result<Self> {
        let parts = match plan.view_mode {
            ViewMode::Radiance if plan.layers => 2,
            ViewMode::Radiance => 1,
            _ => 0,
        };
        Ok(Tonemap { program: gpu.compute(&shaders::FRAME_TONEMAP_COMP, &[])?, parts })
    }

    /// Records the pass.
    pub fn record(&self, recorder: &mut Recorder, targets: &ImageTargets, plan: &Plan, exposure: f64) {
        let part = |k: usize| Resource::Texture(&targets.colors[k].image, Sampler::Nearest);
        recorder.compute(pass::TONE_MAP, |pass| {
            let (first, second) = (part(0), part(self.parts.saturating_sub(1) as usize));
            let picture = ("picture", Resource::Buffer(&targets.picture));
            pass.bind(&self.program, &[("radiance", first), ("second_part", second), picture]);
            pass.push(&TonemapParameters { size: plan.size, exposure: exposure as f32, parts: self.parts });
            pass.dispatch([(plan.size[0] * plan.size[1]).div_ceil(64), 1, 1]);
        });
    }
}
