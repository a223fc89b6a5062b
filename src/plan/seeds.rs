//! Trees that are drawn one by one: in which quads, in how much memory.

use super::range::{farthest_trees, tree_density};
use super::{ASSUMED_STORAGE, Plan};
use crate::camera::Eye;
use crate::gpu::DeviceInfo;
use crate::gpu::interface as gpu;
use crate::land::candidate::Layout;
use crate::land::listed::fullest_listed;
use crate::scene::Scene;

/// Seed quads along the range, at most.
const QUADS_IN_RANGE: f64 = 24.0;
/// Quads with trees on silhouettes along the distance beyond the range, at most.
const SILHOUETTE_QUADS: f64 = 8.0;
/// Seed quads that only cast shadows which memory holds at once; where there are more they take turns.
const SHADOW_QUADS: f64 = 128.0;
/// Trees whose casting memory holds at once; where there are more they take turns.
const CASTERS: u32 = 1 << 17;

impl Plan {
    /// Quads of seeds, and how many trees there may be in view.
    pub(super) fn seeds(&mut self, scene: &Scene, eye: &Eye, device: Option<&DeviceInfo>) {
        let farthest = farthest_trees(scene, eye);
        let drawn = self.range.min(farthest);
        self.quads(scene, drawn);
        // Every quad within range; no more than exist or can be bound.
        let storage = device.map_or(ASSUMED_STORAGE, |d| d.max_storage_bytes.min(1 << 30));
        let region_bytes = u64::from(self.region_capacity) * size_of::<gpu::Seed>() as u64;
        let near = self.regions(scene, drawn, farthest, (storage / region_bytes).max(1) as f64);
        // Few trees of a quad with silhouettes stand on the line.
        let slots = (near + u64::from(self.silhouette_quads.div_ceil(4))) * u64::from(self.region_capacity);
        self.tree_capacity = u64::from(scene.settings.zfield_max_trees)
            .min(slots)
            .min(storage / size_of::<gpu::Tree>() as u64)
            .max(1) as u32;
        if self.cascades > 0 {
            // A quad may cast into four blocks of each cascade.
            let most = storage / size_of::<gpu::Caster>() as u64;
            let seeds = u64::from(self.seed_regions) * u64::from(self.region_capacity);
            let one = 4 * u64::from(self.cascades) * u64::from(self.region_capacity);
            self.caster_capacity = u64::from(CASTERS).min(2 * seeds).max(one).min(most) as u32;
        }
    }

    /// Size of a quad of seeds, for trees drawn to a distance, and how many there may be in one.
    fn quads(&mut self, scene: &Scene, drawn: f64) {
        if let Some(Layout { pattern, tile_side, density }) = Layout::new(scene) {
            (self.tile_side, self.pattern_density) = (tile_side, density);
            self.tiles_per_quad = 4;
            while drawn > QUADS_IN_RANGE * self.tile_side * f64::from(self.tiles_per_quad) {
                self.tiles_per_quad *= 2;
            }
            self.quad_side = self.tile_side * f64::from(self.tiles_per_quad);
            self.region_capacity = self.tiles_per_quad.pow(2) * pattern.max_points();
            self.pattern = Some(pattern);
        } else {
            // About a thousand listed trees a quad, if they stood evenly.
            self.quad_side = (1000.0 / tree_density(scene)).sqrt().max(drawn / QUADS_IN_RANGE);
            self.region_capacity = 0;
        }
        self.region_capacity =
            (self.region_capacity + fullest_listed(scene, self.quad_side)).next_multiple_of(gpu::CULL_GROUP);
    }

    /// Regions of the seed buffer, `most` at most: for quads in range, of which there are so many, on silhouettes, and for shadows.
    fn regions(&mut self, scene: &Scene, drawn: f64, farthest: f64, most: f64) -> u64 {
        let exist = scene.terrain.extent.map(|e| (e / self.quad_side).ceil().max(1.0));
        let across =
            |k: usize| (2.0 * ((drawn + self.tallest) / self.quad_side + 1.0).ceil() + 1.0).min(exist[k]);
        let exist = exist[0] * exist[1];
        let spare = if self.cascades > 0 { SHADOW_QUADS.min(most / 2.0).floor() } else { 0.0 };
        let near = (across(0) * across(1)).min(most - spare);
        let spare = spare.min(exist - near);
        // Silhouettes beyond are lines: a few quads wide at any distance, however many quads there are.
        let lines = if self.silhouette_ratio > 1.0 {
            SILHOUETTE_QUADS * (self.last_range().min(farthest) - drawn) / self.quad_side
        } else {
            0.0
        };
        self.silhouette_quads = lines.min(exist - near - spare).min(most - near - spare).max(0.0) as u32;
        self.shadow_quads = spare as u32;
        self.seed_regions = near as u32 + self.silhouette_quads + self.shadow_quads;
        near as u64
    }
}
