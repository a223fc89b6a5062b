//! What a frame draws to.

use half::f16;

use crate::camera::NEAR_PLANE;
use crate::gpu::{Attachment, Buffer, Gpu, Image, ImageDesc, vk};
use crate::image::{Linear, Picture};
use crate::plan::{Plan, Rasterizer};
use crate::{Result, gpu};

/// Radiance as half floats, relative to the scene's brightest light.
pub const RADIANCE: vk::Format = vk::Format::R16G16B16A16_SFLOAT;
/// Species, counted from 1; 0 where no tree is.
pub const SPECIES: vk::Format = vk::Format::R32_UINT;

/// A colour target: multisampled if the plan says so, and its resolved image.
pub struct ColorTarget {
    multisampled: Option<Image>,
    /// The resolved image.
    pub image: Image,
}

impl ColorTarget {
    fn new(
        gpu: &Gpu,
        plan: &Plan,
        name: &str,
        format: vk::Format,
        usage: vk::ImageUsageFlags,
        samples: u32,
    ) -> Result<Self> {
        let make = |samples, usage| {
            gpu.image(&ImageDesc { name, format, size: plan.size, layers: 1, levels: 1, samples, usage })
        };
        let resolved = usage
            | if format == vk::Format::D32_SFLOAT {
                vk::ImageUsageFlags::empty()
            } else {
                vk::ImageUsageFlags::STORAGE
            };
        Ok(ColorTarget {
            multisampled: (samples > 1)
                .then(|| make(samples, usage | vk::ImageUsageFlags::SAMPLED))
                .transpose()?,
            image: make(1, resolved)?,
        })
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

/// All targets of a plan.
pub struct ImageTargets {
    /// Radiance; with layers: sun part, sky part (with coverage in alpha), species, fractions (lit and shadowed ground,
    /// lit and shadowed trees).
    pub colors: Vec<ColorTarget>,
    /// Depth.
    pub depth: ColorTarget,
    /// Quad of terrain that each sample sees, counted from 1, where the ground is lit once it is known to be seen.
    pub quads: Option<ColorTarget>,
    /// Display picture, a word a pixel.
    pub picture: Buffer,
}

impl ImageTargets {
    /// Allocates for a plan.
    ///
    /// # Errors
    /// [`crate::Error::Device`] when out of memory.
    pub fn new(gpu: &Gpu, plan: &Plan) -> Result<Self> {
        let color = vk::ImageUsageFlags::COLOR_ATTACHMENT;
        let formats: &[(&str, vk::Format)] = Self::formats(plan.layers);
        let pixels = u64::from(plan.size[0]) * u64::from(plan.size[1]);
        let tiles = plan.rasterizer == Rasterizer::Tiles;
        // What tiles find by samples they put together by pixels.
        let drawn = if tiles { 1 } else { plan.samples };
        Ok(ImageTargets {
            colors: formats
                .iter()
                .map(|(name, format)| ColorTarget::new(gpu, plan, name, *format, color, drawn))
                .collect::<Result<_>>()?,
            depth: ColorTarget::new(
                gpu,
                plan,
                "depth",
                vk::Format::D32_SFLOAT,
                vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT,
                plan.samples,
            )?,
            quads: tiles
                .then(|| ColorTarget::new(gpu, plan, "quads seen", vk::Format::R32_UINT, color, plan.samples))
                .transpose()?,
            picture: gpu.buffer("picture", pixels * 4)?,
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
            let depth = gpu.read_image::<f32>(&self.depth.image, 0, 0)?;
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

    /// Colour attachments with and without layers.
    pub fn formats(layers: bool) -> &'static [(&'static str, gpu::vk::Format)] {
        if layers {
            &[("sun part", RADIANCE), ("sky part", RADIANCE), ("species", SPECIES), ("fractions", RADIANCE)]
        } else {
            &[("radiance", RADIANCE)]
        }
    }
}
