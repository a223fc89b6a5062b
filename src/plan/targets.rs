//! What a frame draws to, as a plan lists it.

use super::Plan;
use super::items::Items;
use super::names::resource;
use super::tiles::{Rasterizer, TileBuffers};
use crate::gpu::{BufferDesc, Description, ImageDesc, vk};
use crate::scene::Scene;

/// Radiance as half floats, relative to the scene's brightest light.
const RADIANCE: vk::Format = vk::Format::R16G16B16A16_SFLOAT;
/// Species, counted from 1; 0 where no tree is.
const SPECIES: vk::Format = vk::Format::R32_UINT;

impl Plan {
    /// Names and formats of the colour images, with and without layers.
    pub fn colors(&self) -> &'static [(&'static str, vk::Format)] {
        if self.layers {
            &[("sun part", RADIANCE), ("sky part", RADIANCE), ("species", SPECIES), ("fractions", RADIANCE)]
        } else {
            &[("radiance", RADIANCE)]
        }
    }

    /// Formats of the colour images, with and without layers.
    pub fn color_formats(&self) -> Vec<vk::Format> {
        self.colors().iter().map(|c| c.1).collect()
    }

    /// Whether a colour image holds what there are means of: all do but that of species.
    pub fn is_mean(&self, (_, format): &(&str, vk::Format)) -> bool {
        *format == RADIANCE
    }

    /// What a frame draws to.
    pub(super) fn list_targets(&self, scene: &Scene, items: &mut Items) {
        if self.cascades > 0 {
            let reason =
                format!("the sun is up: {} cascades to {:.0} m", self.cascades, self.shadow_distance);
            let image = ImageDesc {
                layers: self.cascades,
                usage: vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT,
                ..ImageDesc::plain(
                    resource::CASCADES,
                    vk::Format::D32_SFLOAT,
                    [scene.settings.cascade_size; 2],
                )
            };
            items.add("target", "shadow cascades", reason, [image]);
        }
        self.list_image(items);
        if self.rasterizer == Rasterizer::Tiles {
            self.list_seen(items);
        }
    }

    /// The picture, its colours and its depth.
    fn list_image(&self, items: &mut Items) {
        let reason = format!(
            "{} x {} pixels of {} samples{}",
            self.size[0],
            self.size[1],
            self.samples,
            if self.layers { ", layers apart" } else { "" }
        );
        // What tiles find by samples they put together by pixels: only depth has samples.
        let drawn = if self.rasterizer == Rasterizer::Tiles { 1 } else { self.samples };
        let color = vk::ImageUsageFlags::COLOR_ATTACHMENT;
        let mut all: Vec<Description> = Vec::new();
        for (name, format) in self.colors() {
            all.extend(self.color_target(name, *format, color, drawn));
        }
        let depth = vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT;
        all.extend(self.color_target(resource::DEPTH, vk::Format::D32_SFLOAT, depth, self.samples));
        let pixels = u64::from(self.size[0]) * u64::from(self.size[1]);
        all.push(BufferDesc::new(resource::PICTURE, pixels * 4).into());
        items.add("target", "image", reason, all);
        if self.accumulation > 1 {
            let reason = format!("a picture is the mean of {} frames", self.accumulation);
            let images = self.colors().iter().filter(|c| self.is_mean(c)).count() as u64;
            let sums = BufferDesc::new(resource::SUMS_OF_FRAMES, pixels * images * 16);
            items.add("target", "sums of frames", reason, [sums]);
        }
    }

    /// What tiles find of each sample.
    fn list_seen(&self, items: &mut Items) {
        let reason = "which quad of the ground each sample sees, so that it is lit once";
        let color = vk::ImageUsageFlags::COLOR_ATTACHMENT;
        let quads = self.color_target(resource::QUADS_SEEN, vk::Format::R32_UINT, color, self.samples);
        items.add("target", "quads seen", reason, quads);
        if self.layers {
            let image = ImageDesc {
                usage: vk::ImageUsageFlags::STORAGE,
                ..ImageDesc::plain(resource::FIRST_DEPTH, vk::Format::R32_SFLOAT, self.size)
            };
            let reason = "layers apart: how deep each pixel's first sample is";
            items.add("target", "first depth", reason, [image]);
        }
        if self.z_fields {
            for buffer in TileBuffers::new(self).all() {
                items.add("target", buffer.desc.name, buffer.reason, [buffer.desc]);
            }
        }
    }

    /// The images of a target that is drawn to: of all samples, if there are several a pixel, and of one.
    fn color_target(
        &self,
        name: &'static str,
        format: vk::Format,
        usage: vk::ImageUsageFlags,
        samples: u32,
    ) -> impl Iterator<Item = Description> + use<> {
        let storage = match format {
            vk::Format::D32_SFLOAT => vk::ImageUsageFlags::empty(),
            _ => vk::ImageUsageFlags::STORAGE,
        };
        let one = ImageDesc { usage: usage | storage, ..ImageDesc::plain(name, format, self.size) };
        let many = ImageDesc { samples, usage: usage | vk::ImageUsageFlags::SAMPLED, ..one };
        let many = (samples > 1).then_some(many);
        many.into_iter().chain([one]).map(Description::from)
    }
}
