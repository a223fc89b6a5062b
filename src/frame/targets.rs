//! What a frame draws to.

use half::f16;

use crate::camera::NEAR_PLANE;
use crate::gpu::{Attachment, Buffer, Gpu, Image, Resource, Shader};
use crate::image::{Linear, Picture};
use crate::plan::Plan;
use crate::plan::names::resource;
use crate::{Error, Result};

/// A colour target: multisampled if the plan says so, and its resolved image.
pub struct ColorTarget {
    multisampled: Option<Image>,
    /// The resolved image.
    pub image: Image,
}

impl ColorTarget {
    /// The target of a name, if the plan lists it.
    fn new(gpu: &Gpu, plan: &Plan, name: &str) -> Result<Option<Self>> {
        let find = |many: bool| plan.images(name).find(|d| (d.samples > 1) == many);
        let Some(one) = find(false) else { return Ok(None) };
        let multisampled = find(true).map(|d| gpu.image(d)).transpose()?;
        Ok(Some(ColorTarget { multisampled, image: gpu.image(one)? }))
    }

    /// The image whose samples are drawn: the multisampled one, or, with one sample a pixel, the only one.
    pub fn drawn(&self) -> &Image {
        self.multisampled.as_ref().unwrap_or(&self.image)
    }

    /// As an attachment that starts from `clear` (or keeps its content), resolving at the end if `resolve`.
    pub fn attachment(&self, clear: Option<[f32; 4]>, resolve: bool) -> Attachment<'_> {
        match &self.multisampled {
            Some(image) => Attachment { image, resolve: resolve.then_some(&self.image), clear },
            None => Attachment { image: &self.image, resolve: None, clear },
        }
    }
}

/// Of a shader's builds the one that draws to what a plan lists: that of several samples a pixel, that of one, and both again for layers apart.
pub fn build_of(plan: &Plan, builds: [&'static Shader; 4]) -> &'static Shader {
    builds[2 * usize::from(plan.layers) + usize::from(plan.samples == 1)]
}

/// All targets of a plan.
pub struct ImageTargets {
    /// Radiance; with layers: sun part, sky part (with coverage in alpha), species, fractions (lit and shadowed ground,
    /// lit and shadowed trees).
    pub colors: Vec<ColorTarget>,
    /// Depth.
    pub depth: ColorTarget,
    /// Quad of terrain that each sample sees, counted from 1, where the ground is lit once it is known to be seen.
    pub quads: Option<ColorTarget>,
    /// Depth of each pixel's first sample, where tiles write layers: what they see is in no depth buffer.
    first_depth: Option<Image>,
    /// Display picture, a word a pixel.
    pub picture: Buffer,
}

impl ImageTargets {
    /// Allocates what a plan lists.
    ///
    /// # Errors
    /// [`Error::Usage`] when it lists no picture; [`Error::Device`] when out of memory.
    pub fn new(gpu: &Gpu, plan: &Plan) -> Result<Self> {
        let target = |name: &str| ColorTarget::new(gpu, plan, name);
        let missing = |name: &str| Error::Usage(format!("the plan lists no image \"{name}\""));
        let needed = |name: &str| target(name)?.ok_or_else(|| missing(name));
        Ok(ImageTargets {
            colors: plan.colors().iter().map(|(name, _)| needed(name)).collect::<Result<_>>()?,
            depth: needed(resource::DEPTH)?,
            quads: target(resource::QUADS_SEEN)?,
            first_depth: plan.images(resource::FIRST_DEPTH).next().map(|d| gpu.image(d)).transpose()?,
            picture: gpu.described_buffer(&plan.buffer(resource::PICTURE))?,
        })
    }

    /// Reads the frame drawn, with radiances times `scale`, to them.
    ///
    /// # Errors
    /// [`crate::Error::Device`] if the device fails.
    pub fn read(&self, gpu: &Gpu, plan: &Plan, scale: f64) -> Result<Picture> {
        let pixels = plan.size[0] as usize * plan.size[1] as usize;
        let words: Vec<u32> = gpu.read(&self.picture, 0, pixels)?;
        let display = bytemuck::cast_slice(&words).to_vec();
        let linear = plan.layers.then(|| -> Result<Linear> {
            let part = |k: usize| gpu.read_image::<[u16; 4]>(&self.colors[k].image, 0, 0);
            let (sun, sky) = (part(0)?, part(1)?);
            let rgb =
                |t: &[u16; 4]| [0, 1, 2].map(|k| (f64::from(f16::from_bits(t[k]).to_f32()) / scale) as f32);
            let depth =
                gpu.read_image::<f32>(self.first_depth.as_ref().unwrap_or(&self.depth.image), 0, 0)?;
            Ok(Linear {
                sun: sun.iter().map(rgb).collect(),
                sky: sky.iter().map(rgb).collect(),
                // Reverse Z with an infinite far plane: depth = near / distance.
                depth: depth.iter().map(|z| if *z > 0.0 { NEAR_PLANE as f32 / z } else { 0.0 }).collect(),
                coverage: sky.iter().map(|t| f16::from_bits(t[3]).to_f32()).collect(),
                species: gpu.read_image(&self.colors[2].image, 0, 0)?,
                fractions: part(3)?.iter().map(|t| t.map(|v| f16::from_bits(v).to_f32())).collect(),
                noise: None,
            })
        });
        Ok(Picture { size: plan.size, display, linear: linear.transpose()? })
    }

    /// What colour target k starts from where a uniform sky of this radiance is behind all: of the layers, the second is the sky's light.
    pub fn sky_clear(&self, k: usize, [r, g, b]: [f32; 3]) -> [f32; 4] {
        if self.colors.len() == 1 || k == 1 { [r, g, b, 0.0] } else { [0.0; 4] }
    }

    /// The resolved colour images by the names that compute shaders have for them.
    pub fn shown(&self) -> Vec<(&'static str, Resource<'_>)> {
        let names: &[&str] = match self.colors.len() {
            1 => &["radiance"],
            _ => &["sun_part", "sky_part", "species_at", "fractions"],
        };
        let colors = names.iter().zip(&self.colors).map(|(name, c)| (*name, &c.image));
        let depth = self.first_depth.iter().map(|image| ("depth_at", image));
        colors.chain(depth).map(|(name, image)| (name, Resource::Storage(image))).collect()
    }
}
