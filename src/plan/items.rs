//! What a plan lists: data, caches and targets, each with the reason why it is needed and its bytes.

use super::Plan;
use super::tiles::{Rasterizer, TileBuffers};
use crate::gpu::interface as gpu;
use crate::land::candidate::POINTS;
use crate::land::density::density_map_size;
use crate::physics::views;
use crate::scene::{Albedo, Scene, Sky};

/// One thing that the scene requires.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Item {
    /// `data`, `cache`, `target`, `pipeline` or `pass`.
    pub kind: &'static str,
    /// Name, as in captures and reports.
    pub name: String,
    /// What needs it.
    pub reason: String,
    /// Device memory, bytes.
    pub bytes: u64,
}

/// A plan's items while they are written down.
#[derive(Default)]
pub(super) struct Items(Vec<Item>);

impl Items {
    /// Writes one down.
    pub fn add(
        &mut self,
        kind: &'static str,
        name: impl Into<String>,
        reason: impl Into<String>,
        bytes: u64,
    ) {
        self.0.push(Item { kind, name: name.into(), reason: reason.into(), bytes });
    }
}

/// Bytes of an image of four bytes a texel.
fn raster_bytes(width: u32, height: u32) -> u64 {
    u64::from(width) * u64::from(height) * 4
}

impl Plan {
    /// Writes down every item.
    pub(super) fn list(&mut self, scene: &Scene) {
        let mut items = Items::default();
        self.list_ground(scene, &mut items);
        if self.z_fields {
            self.list_views(scene, &mut items);
        }
        if self.range > 0.0 {
            self.list_tables(scene, &mut items);
            self.list_distribution(scene, &mut items);
        }
        if self.z_fields {
            self.list_seeds(&mut items);
        }
        if self.range > 0.0 {
            self.list_forest(scene, &mut items);
        }
        self.list_targets(scene, &mut items);
        self.list_pipelines(scene, &mut items);
        self.list_passes(scene, &mut items);
        self.items = items.0;
    }

    /// The ground and the sky.
    fn list_ground(&self, scene: &Scene, items: &mut Items) {
        if let Some(r) = &scene.terrain.heights {
            items.add("data", "height map", "the terrain has relief", raster_bytes(r.width, r.height));
        }
        if let Albedo::Image(t) = &scene.terrain.albedo {
            let reason = "the ground's albedo is an image";
            items.add("data", "ground albedo", reason, raster_bytes(t.width, t.height));
        }
        if let Sky::LatLong { width, height, .. } = &scene.sky {
            items.add("data", "sky image", "the sky is an image", 2 * raster_bytes(*width, *height));
        }
        let tile = u64::from(gpu::TERRAIN_HEIGHTS).pow(2) * 4 + u64::from(gpu::TERRAIN_SLOPES).pow(2) * 8;
        let reason = match &scene.terrain.heights {
            Some(_) => format!("{} quads of heights and slopes", self.height_tiles),
            None => "level ground: all quads share one tile of no height and no slope".into(),
        };
        items.add("cache", "terrain tiles", reason, u64::from(self.height_tiles) * tile);
    }

    /// What z-fields are drawn from.
    fn list_views(&self, scene: &Scene, items: &mut Items) {
        let s = &scene.settings;
        let views = u64::from(views::count(s.view_rings)) * u64::from(s.view_resolution).pow(2) * 4 * 4 / 3;
        for species in &scene.species {
            let name = &species.name;
            let reason = format!("species \"{name}\" is drawn tree by tree");
            items.add("data", format!("z-field views of {name}"), reason, views);
            if self.transfer_bands > 0 {
                // Half as many texels a side.
                let bytes = u64::from(self.transfer_bands) * views / 4;
                let reason = format!("sunlight on leaves of species \"{name}\", tree by tree");
                items.add("data", format!("light transfer of {name}"), reason, bytes);
            }
        }
    }

    /// What the average of a forest is known from.
    fn list_tables(&self, scene: &Scene, items: &mut Items) {
        let s = &scene.settings;
        let (n, m) = (u64::from(s.table_angles), u64::from(s.table_densities));
        for species in &scene.species {
            let name = &species.name;
            if self.pair_tables {
                // The share of the average grows from distance 0 on (BN12, eq. 22): no ground is so near as to go without.
                let reason =
                    format!("sunlight in forests of species \"{name}\", converged to from nearby on");
                items.add("data", format!("pair tables of {name}"), reason, n * n * n * m * 8);
            }
            let reason = format!("ground, skylight and trees of species \"{name}\" at any distance");
            items.add("data", format!("view tables of {name}"), reason, (n + 1) * m * 8);
        }
    }

    /// Where trees stand.
    fn list_distribution(&self, scene: &Scene, items: &mut Items) {
        let maps: Vec<[u32; 2]> =
            scene.species.iter().filter_map(|s| density_map_size(s, scene.terrain.extent)).collect();
        if !maps.is_empty() {
            let side = |k: usize| maps.iter().map(|m| m[k]).max().unwrap_or(1);
            let bytes = raster_bytes(side(0), side(1)) * maps.len() as u64;
            let reason = format!("{} species have a density map or a list of trees", maps.len());
            items.add("data", "density maps", reason, bytes);
        }
        if self.pattern.is_some() {
            let reason = "densities thin a Poisson-disk pattern";
            items.add("data", "point pattern", reason, 16 * 8 * u64::from(POINTS));
        }
    }

    /// Seeds of the trees that are drawn one by one.
    fn list_seeds(&self, items: &mut Items) {
        let near = self.seed_regions - self.silhouette_quads - self.shadow_quads;
        let mut reason = format!("{near} quads of {:.0} m within {:.0} m", self.quad_side, self.range);
        if self.silhouette_quads > 0 {
            let far = self.last_range();
            reason += &format!(", {} with silhouettes to {far:.0} m", self.silhouette_quads);
        }
        if self.shadow_quads > 0 {
            reason += &format!(", {} whose trees only cast shadows", self.shadow_quads);
        }
        items.add("cache", "seeds", reason, self.seed_slots() * size_of::<gpu::Seed>() as u64);
    }

    /// Seeds that memory holds.
    fn seed_slots(&self) -> u64 {
        u64::from(self.seed_regions) * u64::from(self.region_capacity)
    }

    /// What of the forest lives between frames, and what a frame makes of it.
    fn list_forest(&self, scene: &Scene, items: &mut Items) {
        let reason = format!(
            "what trees of {} species cover of {} quads of terrain, to the horizon",
            scene.species.len(),
            self.cover_slots
        );
        let bytes = u64::from(self.cover_slots) * self.cover_tile_bytes();
        items.add("cache", "coverage tiles", reason, bytes);
        let texels = u64::from(self.coverage_size).pow(2);
        let reason = format!("{} coverage tiles are drawn at once", gpu::COVER_SCRATCH);
        items.add("data", "coverage sums", reason, u64::from(gpu::COVER_SCRATCH) * texels * 4);
        if self.z_fields {
            let (capacity, slots) = (u64::from(self.tree_capacity), self.seed_slots());
            let bytes = capacity * (size_of::<gpu::Tree>() as u64 + 4 + 24)
                + slots * 4
                + slots / u64::from(gpu::CULL_GROUP) * 4 * u64::from(gpu::TREE_LISTS);
            let reason = format!("up to {capacity} trees in a frame");
            items.add("target", "trees and lists", reason, bytes);
            if self.cascades > 0 {
                let reason = format!("up to {} trees that cast at once", self.caster_capacity);
                let bytes = u64::from(self.caster_capacity) * size_of::<gpu::Caster>() as u64;
                items.add("target", "casters", reason, bytes);
            }
        }
        let reason = format!("trees far away on {} quads of terrain", self.terrain_tiles);
        items.add("target", "shader-map nodes", reason, self.node_bytes());
    }

    /// What a frame draws to.
    fn list_targets(&self, scene: &Scene, items: &mut Items) {
        if self.cascades > 0 {
            let reason =
                format!("the sun is up: {} cascades to {:.0} m", self.cascades, self.shadow_distance);
            let bytes = u64::from(self.cascades) * u64::from(scene.settings.cascade_size).pow(2) * 4;
            items.add("target", "shadow cascades", reason, bytes);
        }
        let pixels = u64::from(self.size[0]) * u64::from(self.size[1]);
        let colour = if self.layers { 8 + 8 + 4 + 8 } else { 8 };
        let tiles = self.rasterizer == Rasterizer::Tiles;
        // What tiles find by samples they put together by pixels: only depth has samples.
        let drawn = if tiles { 4 } else { colour + 4 };
        let multi = if self.samples > 1 { u64::from(self.samples) } else { 0 };
        let reason = format!(
            "{} x {} pixels of {} samples{}",
            self.size[0],
            self.size[1],
            self.samples,
            if self.layers { ", layers apart" } else { "" }
        );
        items.add("target", "image", reason, pixels * (multi * drawn + colour + 4 + 4));
        if !tiles {
            return;
        }
        let reason = "which quad of the ground each sample sees, so that it is lit once";
        items.add("target", "quads seen", reason, pixels * (multi + 1) * 4);
        if self.layers {
            let reason = "layers apart: how deep each pixel's first sample is";
            items.add("target", "first depth", reason, pixels * 4);
        }
        if self.z_fields {
            for buffer in TileBuffers::new(self).all() {
                let (name, reason, bytes) = buffer.item();
                items.add("target", name, reason, bytes);
            }
        }
    }
}
