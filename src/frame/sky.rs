//! The sky behind everything, when it is an image; a uniform sky is a clear colour.

use super::targets::ImageTargets;
use crate::Result;
use crate::camera::Light;
use crate::gpu::{
    Buffer, DepthTest, Gpu, GraphicsDesc, Image, Layers, Program, Recorder, Resource, Sampler, Targets,
    shaders,
};
use crate::plan::names::{pass, resource};
use crate::plan::{Plan, Rasterizer};
use crate::scene::{Scene, Sky};

/// Draws a latitude-longitude sky.
pub struct SkyPass {
    image: Image,
    program: Program,
}

impl SkyPass {
    /// Uploads the image; `None` for a uniform sky.
    ///
    /// # Errors
    /// [`crate::Error::Device`] when out of memory.
    pub fn new(gpu: &Gpu, scene: &Scene, plan: &Plan) -> Result<Option<Self>> {
        let Sky::LatLong { pixels, .. } = &scene.sky else { return Ok(None) };
        let Some(described) = plan.images(resource::SKY).next() else { return Ok(None) };
        let image = gpu.image(described)?;
        let scale = Light::new(scene).scale as f32;
        // Half floats hold up to 65504: a sun's disc in the image is clamped there, relative to the mean light.
        let texels: Vec<[f32; 4]> = pixels
            .chunks_exact(3)
            .map(|p| [p[0], p[1], p[2]].map(|v| (v * scale).min(65504.0)))
            .map(|[r, g, b]| [r, g, b, 1.0])
            .collect();
        gpu.upload_image(&image, 0, 0, 1, bytemuck::cast_slice(&texels))?;
        let formats = plan.color_formats();
        let program = gpu.graphics(&GraphicsDesc {
            vert: &shaders::FRAME_SKY_VERT,
            frag: if plan.layers { &shaders::FRAME_SKY_LAYERS_FRAG } else { &shaders::FRAME_SKY_FRAG },
            colors: &formats,
            // Tiles put it behind what samples see pixel by pixel.
            samples: if plan.rasterizer == Rasterizer::Tiles { 1 } else { plan.samples },
            depth: DepthTest::None,
            constants: &[],
        })?;
        Ok(Some(SkyPass { image, program }))
    }

    /// Records the pass.
    pub fn record(&self, recorder: &mut Recorder, view: &Buffer, targets: &ImageTargets) {
        let colors: Vec<_> = targets.colors.iter().map(|t| t.attachment(Some([0.0; 4]), false)).collect();
        recorder.render(
            pass::SKY,
            &Targets { colors: &colors, depth: None, layers: Layers::One(0) },
            |pass| {
                let sky = ("sky", Resource::Texture(&self.image, Sampler::LinearRepeat));
                pass.bind(&self.program, &[("view", Resource::Buffer(view)), sky]);
                pass.draw(3, 1);
            },
        );
    }
}
