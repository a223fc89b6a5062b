//! What a frame draws to.

use crate::gpu::{Attachment, Buffer, Gpu, Image, ImageDesc, vk};
use crate::plan::Plan;
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
            multisampled: (plan.samples > 1)
                .then(|| make(plan.samples, usage | vk::ImageUsageFlags::SAMPLED))
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
        Ok(ImageTargets {
            colors: formats
                .iter()
                .map(|(name, format)| ColorTarget::new(gpu, plan, name, *format, color))
                .collect::<Result<_>>()?,
            depth: ColorTarget::new(
                gpu,
                plan,
                "depth",
                vk::Format::D32_SFLOAT,
                vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT,
            )?,
            picture: gpu.buffer("picture", pixels * 4)?,
        })
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
