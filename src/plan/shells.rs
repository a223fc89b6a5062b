//! What a plan lists for trees that are slices of a forest over the ground.

use super::Plan;
use super::items::Items;
use super::names::resource;
use crate::gpu::interface::ShellTable;
use crate::gpu::{BufferDesc, Description, DeviceInfo, ImageDesc, vk};
use crate::land::pattern::TILES;
use crate::scene::{Distribution, Scene};
use crate::{Error, Result};

/// Texels of cover along a side of one of light on shells: 4 × 4 texels have 256 samples a slice, enough for a mean transfer and for rays from places
/// of their own; and neighbouring crowns, some metres wide, are still told apart where a tile is 76 m.
pub const SHELL_LIGHT_TEXELS: u32 = 4;
/// Images of light on shells, of four numbers each.
pub const SHELL_LIGHTS: usize = 7;

impl Plan {
    /// Whether the picture shows trees that are slices of a forest.
    pub fn shows_shells(&self) -> bool {
        self.shells && self.view_mode != super::ViewMode::Coverage
    }

    /// That shells can show all trees of a scene, on this device.
    pub(super) fn check_shells(&self, scene: &Scene, device: Option<&DeviceInfo>) -> Result<()> {
        if !self.shells {
            return Ok(());
        }
        let listed = scene.species.iter().find(|s| matches!(s.distribution, Distribution::Positions(_)));
        if let Some(species) = listed {
            return Err(Error::Usage(format!(
                "ladder {}: shells are tiles of forest, and trees of species \"{}\" are listed one by one; end the ladder with shader-map",
                self.ladder, species.name
            )));
        }
        let layers = shell_layers(scene.settings.shell_slices);
        match device {
            Some(d) if d.max_layers < layers => Err(Error::Usage(format!(
                "shells of {} slices take images of {layers} layers, and {} has {} at most: lower shell_slices",
                scene.settings.shell_slices, d.name, d.max_layers
            ))),
            _ => Ok(()),
        }
    }

    /// Distance from which on some trees are slices, m.
    pub fn shells_from(&self) -> f64 {
        if self.near_trees { self.averages_from() } else { 0.0 }
    }

    /// The stack, and how light comes to it.
    pub(super) fn list_shells(&self, scene: &Scene, items: &mut Items) {
        let s = &scene.settings;
        let layers = shell_layers(s.shell_slices);
        let image = |name, format, side: u32, layers| {
            Description::Image(ImageDesc {
                layers,
                levels: side.ilog2() + 1,
                ..ImageDesc::plain(name, format, [side; 2])
            })
        };
        let seen = |name| image(name, vk::Format::R8G8B8A8_UNORM, s.shell_texels, layers);
        let light = (s.shell_texels / SHELL_LIGHT_TEXELS).max(1);
        let reason = format!(
            "{} slices of {TILES} tiles of forest, from {:.0} m on",
            s.shell_slices,
            self.shells_from()
        );
        let mut all: Vec<Description> = vec![
            BufferDesc::new(resource::SHELL_TABLE, size_of::<ShellTable>() as u64).into(),
            seen(resource::SHELL_COVERS),
            seen(resource::SHELL_REFLECTANCES),
            seen(resource::SHELL_TRANSMITTANCES),
        ];
        let lights = image(resource::SHELL_LIGHTS, vk::Format::R8G8B8A8_SNORM, light, layers);
        all.extend([lights; SHELL_LIGHTS]);
        items.add("data", "shells", reason, all);
    }
}

/// Layers of images of stacks of so many slices, and of half as many, down to one.
fn shell_layers(slices: u32) -> u32 {
    TILES as u32 * (2 * slices - 1)
}
