//! Data and caches that a plan lists.

use super::Plan;
use super::items::Items;
use super::names::resource;
use super::tiles::Rasterizer;
use crate::gpu::interface as gpu;
use crate::gpu::{BufferDesc, Description, ImageDesc, VolumeDesc, vk};
use crate::land::density::density_map_size;
use crate::physics::indirect::{COEFFICIENTS, GROUND};
use crate::physics::outline::ROWS as OUTLINE_ROWS;
use crate::physics::views;
use crate::scene::{Albedo, Scene, Sky};

/// Format and bytes of the texels as which nodes of the shader-map are read.
pub const NODE_TEXELS: (vk::Format, u64) = (vk::Format::R32G32B32A32_SFLOAT, 16);
/// The same for records of trees.
pub const TREE_TEXELS: (vk::Format, u64) = (vk::Format::R32G32B32A32_UINT, 16);
/// Four half floats.
const HALVES: vk::Format = vk::Format::R16G16B16A16_SFLOAT;
/// Bytes of the six indices of a quad that shows a tree.
pub const QUAD_INDEX_BYTES: u64 = 24;

/// Pair tables and view tables of species, from their nodes of each angle and of the density.
pub fn tables(species: u32, angles: u32, densities: u32) -> (VolumeDesc, ImageDesc<'static>) {
    let size = [angles, angles, species * angles * densities];
    let pairs = VolumeDesc { name: resource::PAIR_TABLES, format: HALVES, size };
    let views = ImageDesc::plain(resource::VIEW_TABLES, HALVES, [2 * angles, densities]);
    (pairs, ImageDesc { layers: species, ..views })
}

/// Outlines of species' views: a word a row.
fn outlines(rings: u32, resolution: u32, species: u32) -> BufferDesc {
    let words = u64::from(views::count(rings) * species * (resolution.ilog2() + 1)) * OUTLINE_ROWS as u64;
    BufferDesc { texels: Some((vk::Format::R32_UINT, 4)), ..BufferDesc::new(resource::OUTLINES, 4 * words) }
}

impl Plan {
    /// The ground and the sky.
    pub(super) fn list_ground(&self, scene: &Scene, items: &mut Items) {
        if let Some(r) = &scene.terrain.heights {
            let image = ImageDesc::plain(resource::HEIGHT_MAP, vk::Format::R32_SFLOAT, [r.width, r.height]);
            items.add("data", "height map", "the terrain has relief", [image]);
        }
        if let Albedo::Image(t) = &scene.terrain.albedo {
            let image = ImageDesc::plain(resource::ALBEDO, vk::Format::R8G8B8A8_SRGB, [t.width, t.height]);
            items.add("data", "ground albedo", "the ground's albedo is an image", [image]);
        }
        if let Sky::LatLong { width, height, .. } = &scene.sky {
            let image = ImageDesc::plain(resource::SKY, vk::Format::R32G32B32A32_SFLOAT, [*width, *height]);
            items.add("data", "sky image", "the sky is an image", [image]);
        }
        let tiles = |name, format, side| ImageDesc {
            layers: self.height_tiles,
            usage: vk::ImageUsageFlags::STORAGE,
            ..ImageDesc::plain(name, format, [side; 2])
        };
        let heights = tiles(resource::HEIGHT_TILES, vk::Format::R32_SFLOAT, gpu::TERRAIN_HEIGHTS);
        let slopes = tiles(resource::SLOPE_TILES, HALVES, gpu::TERRAIN_SLOPES);
        let reason = match &scene.terrain.heights {
            Some(_) => format!("{} quads of heights and slopes", self.height_tiles),
            None => "level ground: all quads share one tile of no height and no slope".into(),
        };
        items.add("cache", "terrain tiles", reason, [heights, slopes]);
    }

    /// What z-fields are drawn from.
    pub(super) fn list_views(&self, scene: &Scene, items: &mut Items) {
        let s = &scene.settings;
        let count = scene.species.len() as u32;
        let array = |name, side: u32| {
            Description::Image(ImageDesc {
                layers: views::count(s.view_rings) * count,
                levels: side.ilog2() + 1,
                ..ImageDesc::plain(name, vk::Format::R8G8B8A8_UNORM, [side; 2])
            })
        };
        let views = array(resource::VIEWS, s.view_resolution);
        let outlines = Description::Buffer(outlines(s.view_rings, s.view_resolution, count));
        let band = array(resource::TRANSFER, s.transfer_side());
        for species in &scene.species {
            let name = &species.name;
            let reason = match self.z_fields {
                true => format!("species \"{name}\" is drawn tree by tree"),
                false => format!("trees of species \"{name}\" cast shadows"),
            };
            items.shared("data", &format!("z-field views of {name}"), reason, vec![views], count);
            if self.z_fields && self.rasterizer == Rasterizer::Tiles {
                let reason = format!("tiles look for species \"{name}\" only where it may be seen");
                items.shared("data", &format!("view outlines of {name}"), reason, vec![outlines], count);
            }
            if self.transfer_bands > 0 {
                let bands = vec![band; self.transfer_bands as usize];
                let reason = format!("sunlight on leaves of species \"{name}\", tree by tree");
                items.shared("data", &format!("light transfer of {name}"), reason, bands, count);
            }
        }
    }

    /// What the average of a forest is known from.
    pub(super) fn list_tables(&self, scene: &Scene, items: &mut Items) {
        let s = &scene.settings;
        let count = scene.species.len() as u32;
        let (pairs, views) = tables(count, s.table_angles, s.table_densities);
        for species in &scene.species {
            let name = &species.name;
            if self.pair_tables {
                // The share of the average grows from distance 0 on (BN12, eq. 22): no ground is so near as to go without.
                let reason =
                    format!("sunlight in forests of species \"{name}\", converged to from nearby on");
                items.shared("data", &format!("pair tables of {name}"), reason, vec![pairs.into()], count);
            }
            let reason = format!("ground, skylight and trees of species \"{name}\" at any distance");
            items.shared("data", &format!("view tables of {name}"), reason, vec![views.into()], count);
        }
    }

    /// Light that met more than one surface.
    pub(super) fn list_indirect(&self, scene: &Scene, items: &mut Items) {
        if self.indirect == 0 {
            return;
        }
        let (species, nodes) = (scene.species.len(), self.indirect as usize);
        let texels = nodes * (GROUND + species * (COEFFICIENTS - GROUND));
        let described = |name, count: u64, texels: (vk::Format, u64)| BufferDesc {
            texels: Some(texels),
            ..BufferDesc::new(name, count * texels.1)
        };
        let nodes = described(resource::INDIRECT, texels as u64, NODE_TEXELS);
        let reason = "light that met more than one surface, by density";
        items.add("data", "indirect light", reason, [nodes]);
        if self.near_trees {
            let texels = u64::from(self.tree_capacity) * size_of::<gpu::HandedLight>() as u64 / TREE_TEXELS.1;
            let handed = described(resource::HANDED, texels, TREE_TEXELS);
            let reason = format!("the same of up to {} trees in a frame", self.tree_capacity);
            items.add("target", "handed light", reason, [handed]);
        }
    }

    /// Where trees stand.
    pub(super) fn list_distribution(&self, scene: &Scene, items: &mut Items) {
        let maps: Vec<[u32; 2]> =
            scene.species.iter().filter_map(|s| density_map_size(s, scene.terrain.extent)).collect();
        if !maps.is_empty() {
            let side = |k: usize| maps.iter().map(|m| m[k]).max().unwrap_or(1);
            let image = ImageDesc {
                layers: maps.len() as u32,
                ..ImageDesc::plain(resource::DENSITY_MAPS, vk::Format::R32_SFLOAT, [side(0), side(1)])
            };
            let reason = format!("{} species have a density map or a list of trees", maps.len());
            items.add("data", "density maps", reason, [image]);
        }
        if let Some(pattern) = &self.pattern {
            let points = u64::from(pattern.max_points()) * pattern.tiles.len() as u64;
            let bytes = points * size_of::<gpu::PatternPoint>() as u64;
            let reason = "densities thin a Poisson-disk pattern";
            items.add("data", "point pattern", reason, [BufferDesc::new(resource::PATTERN, bytes)]);
        }
    }

    /// Seeds of the trees that are drawn one by one.
    pub(super) fn list_seeds(&self, items: &mut Items) {
        let near = self.seed_regions - self.silhouette_quads - self.shadow_quads;
        let mut reason = format!("{near} quads of {:.0} m within {:.0} m", self.quad_side, self.range);
        if self.silhouette_quads > 0 {
            let far = self.last_range();
            reason += &format!(", {} with silhouettes to {far:.0} m", self.silhouette_quads);
        }
        if self.shadow_quads > 0 {
            reason += &format!(", {} whose trees only cast shadows", self.shadow_quads);
        }
        let bytes = self.seed_slots() * size_of::<gpu::Seed>() as u64;
        items.add("cache", "seeds", reason, [BufferDesc::new(resource::SEEDS, bytes)]);
    }

    /// Seeds that memory holds.
    fn seed_slots(&self) -> u64 {
        u64::from(self.seed_regions) * u64::from(self.region_capacity)
    }

    /// What of the forest lives between frames, and what a frame makes of it.
    pub(super) fn list_forest(&self, scene: &Scene, items: &mut Items) {
        let reason = format!(
            "what trees of {} species cover of {} quads of terrain, to the horizon",
            scene.species.len(),
            self.cover_slots
        );
        items.add("cache", "coverage tiles", reason, [self.cover_tiles(self.cover_slots)]);
        let words = u64::from(gpu::COVER_SCRATCH) * u64::from(self.coverage_size).pow(2);
        let reason = format!("{} coverage tiles are drawn at once", gpu::COVER_SCRATCH);
        items.add("data", "coverage sums", reason, [BufferDesc::new(resource::COVERAGE_SUMS, 4 * words)]);
        if self.near_trees {
            let reason = format!("up to {} trees in a frame", self.tree_capacity);
            items.add("target", "trees and lists", reason, self.tree_buffers());
            if self.cascades > 0 {
                let reason = format!("up to {} trees that cast at once", self.caster_capacity);
                let bytes = u64::from(self.caster_capacity) * size_of::<gpu::Caster>() as u64;
                items.add("target", "casters", reason, [BufferDesc::new(resource::CASTERS, bytes)]);
            }
        }
        let nodes = u64::from(self.terrain_tiles) * u64::from(gpu::FOREST_NODES * gpu::FOREST_NODES);
        let bytes = nodes * size_of::<gpu::ForestNode>() as u64;
        let nodes = BufferDesc { texels: Some(NODE_TEXELS), ..BufferDesc::new(resource::NODES, bytes) };
        let reason = format!("trees far away on {} quads of terrain", self.terrain_tiles);
        items.add("target", "shader-map nodes", reason, [nodes]);
    }

    /// What the cull writes, and the quads that show trees and draw them into shadow maps.
    fn tree_buffers(&self) -> [BufferDesc; 5] {
        let (trees, slots) = (u64::from(self.tree_capacity), self.seed_slots());
        let quads = self.tree_capacity.max(self.region_capacity).max(self.caster_capacity);
        let groups = slots / u64::from(gpu::CULL_GROUP);
        [
            BufferDesc {
                texels: Some(TREE_TEXELS),
                ..BufferDesc::new(resource::TREES, trees * size_of::<gpu::Tree>() as u64)
            },
            BufferDesc::new(resource::TREE_LISTS, trees * 4),
            BufferDesc::new(resource::QUAD_INDICES, u64::from(quads) * QUAD_INDEX_BYTES),
            BufferDesc::new(resource::SEED_CLASSES, slots * 4),
            BufferDesc::new(resource::LIST_COUNTS, groups * 4 * u64::from(gpu::TREE_LISTS)),
        ]
    }
}
