//! The ground and its coverage by trees: how many tiles, for a view at the terrain's level of detail.

use super::Plan;
use super::names::resource;
use crate::camera::Eye;
use crate::gpu::interface as gpu;
use crate::gpu::{DeviceInfo, ImageDesc, vk};
use crate::land::quadtree::{MIN_REFINE, quad_count};
use crate::scene::Scene;

/// Side that no quad of the finest level of a plain with trees exceeds, m: their coverage tiles get fine near the camera.
const PLAIN_SIDE: f64 = 160.0;
/// Coverage tiles for a view whose terrain is as coarse as it may be: about thirty quads a level, eight levels.
const COVER_SLOTS: f64 = 256.0;

impl Plan {
    /// Coverage tiles: how many, for a view at the terrain's level of detail.
    pub(super) fn coverage(&mut self, scene: &Scene, eye: &Eye, device: Option<&DeviceInfo>) {
        let s = &scene.settings;
        // One species needs one density beside the coverage.
        self.cover_channels =
            if scene.species.len() == 1 { 2 } else { 4 * (1 + scene.species.len() as u32).div_ceil(4) };
        if scene.terrain.heights.is_none() {
            self.plain_side = PLAIN_SIDE;
            self.terrain_tiles = quad_count(&scene.terrain, PLAIN_SIDE).min(1024) as u32;
        }
        // The number of quads in view grows with the square of the distance to which a level is refined.
        let cells = f64::from(gpu::TERRAIN_CELLS) * f64::from(s.terrain_pixels);
        let refine = (eye.pixels_at_1m / cells).max(MIN_REFINE) / MIN_REFINE;
        let wanted = (COVER_SLOTS * refine * refine).min(f64::from(self.terrain_tiles)) as u64;
        let room = (u64::from(s.memory_mib) << 20) / 4 / self.cover_tiles(1).bytes();
        let layers = device.map_or(2048, |d| d.max_layers) / self.cover_layers();
        let most = wanted.min(quad_count(&scene.terrain, self.plain_side)).min(room).min(layers.into());
        self.cover_slots = most.max(1) as u32;
    }

    /// Layers of a coverage tile.
    pub fn cover_layers(&self) -> u32 {
        self.cover_channels.div_ceil(4)
    }

    /// Format of coverage tiles.
    pub fn cover_format(&self) -> vk::Format {
        if self.cover_channels == 2 { vk::Format::R16G16_SFLOAT } else { vk::Format::R16G16B16A16_SFLOAT }
    }

    /// Coverage tiles, as many as these.
    pub(super) fn cover_tiles(&self, count: u32) -> ImageDesc<'static> {
        ImageDesc {
            layers: count * self.cover_layers(),
            levels: gpu::COVER_LEVELS,
            usage: vk::ImageUsageFlags::STORAGE,
            ..ImageDesc::plain(resource::COVERAGE, self.cover_format(), [self.coverage_size; 2])
        }
    }
}
