//! What a scene requires: every table, view set, cache, target and pass, with the reason and the bytes, before anything
//! is allocated. What no one needs is not in the plan, and is not built.

mod tiles;

use crate::camera::Eye;
use crate::gpu::DeviceInfo;
use crate::gpu::interface as gpu;
use crate::land::candidate::{Layout, POINTS};
use crate::land::density::density_map_size;
use crate::land::listed::fullest_listed;
use crate::land::pattern::Pattern;
use crate::land::quadtree::{MIN_REFINE, quad_count};
use crate::physics::raster::Raster;
use crate::physics::views;
use crate::scene::{Albedo, Camera, Distribution, Scene, Sky};
use crate::{Error, Result};

pub use tiles::{Drawing, Rasterizer, TILE_STEPS, TileBuffer, TileBuffers};

/// Seed quads along the range, at most.
const QUADS_IN_RANGE: f64 = 24.0;
/// Quads with trees on silhouettes along the distance beyond the range, at most.
const SILHOUETTE_QUADS: f64 = 8.0;
/// Side that no quad of the finest level of a plain with trees exceeds, m: their coverage tiles get fine near the camera.
const PLAIN_SIDE: f64 = 160.0;
/// Seed quads that only cast shadows which memory holds at once; where there are more they take turns.
const SHADOW_QUADS: f64 = 128.0;
/// Trees whose casting memory holds at once; where there are more they take turns.
const CASTERS: u32 = 1 << 17;
/// Coverage tiles for a view whose terrain is as coarse as it may be: about thirty quads a level, eight levels.
const COVER_SLOTS: f64 = 256.0;
/// Storage buffers that every Vulkan device binds, when no device is known.
const ASSUMED_STORAGE: u64 = 128 << 20;

/// Pipelines of the graphics rasteriser's tree pass, and for which trees.
const TREE_PIPELINES: [(&str, &str); 4] = [
    ("trees magnified", "near trees: texels larger than pixels, filtered estimates"),
    ("trees", "trees of many pixels: unfiltered estimates"),
    ("trees small", "trees of few pixels: no estimates"),
    ("trees converged", "trees whose light is the average"),
];

/// How trees are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Representation {
    /// z-fields near, the shader-map far, blended between (BN12, section 7).
    #[default]
    Auto,
    /// z-fields at any distance.
    #[serde(rename = "zfield")]
    ZField,
    /// The shader-map at any distance.
    ShaderMap,
}

impl Representation {
    /// All, with the names that users write.
    pub const NAMES: [(&'static str, Representation); 3] = [
        ("auto", Representation::Auto),
        ("zfield", Representation::ZField),
        ("shader-map", Representation::ShaderMap),
    ];

    /// The name that users write.
    pub fn name(self) -> &'static str {
        Self::NAMES.iter().find(|(_, r)| *r == self).map_or("", |(n, _)| n)
    }

    /// Distance to which a species is drawn tree by tree, m, from that of [`Representation::Auto`].
    fn range(self, auto: f64) -> f64 {
        match self {
            Representation::Auto => auto,
            // Finite, so that its square is so in single precision.
            Representation::ZField => 1e15,
            Representation::ShaderMap => 1e-3,
        }
    }
}

/// What a picture shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum ViewMode {
    /// Radiance.
    #[default]
    Radiance,
    /// Lit and shadowed ground, lit and shadowed trees.
    Fractions,
    /// Coverage of the ground by trees, from above.
    Coverage,
    /// What represents a tree, and the level of the coverage.
    Lod,
    /// Shadow cascades.
    Cascades,
    /// Normals of the ground.
    Normals,
}

impl ViewMode {
    /// All, with the names that users write.
    pub const NAMES: [(&'static str, ViewMode); 6] = [
        ("radiance", ViewMode::Radiance),
        ("fractions", ViewMode::Fractions),
        ("coverage", ViewMode::Coverage),
        ("lod", ViewMode::Lod),
        ("cascades", ViewMode::Cascades),
        ("normals", ViewMode::Normals),
    ];
}

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

/// What will be built and drawn.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Plan {
    /// Everything, in the order of building.
    pub items: Vec<Item>,
    /// How trees are drawn.
    pub representation: Representation,
    /// What the picture shows; [`Plan::new`] says radiance, and whoever wants another mode sets it before the renderer is made.
    pub view_mode: ViewMode,
    /// What finds the samples of trees.
    pub rasterizer: Rasterizer,
    /// Steps of writing the tiles' lists, at most: [`TILE_STEPS`]; tests set fewer before the renderer is made.
    #[serde(skip)]
    pub tile_steps: u32,
    /// Image size, pixels.
    pub size: [u32; 2],
    /// Samples a pixel.
    pub samples: u32,
    /// Layers of the image apart: sun, sky, coverage, species.
    pub layers: bool,
    /// Whether trees are drawn one by one: any can come within the range of an eye. Without, the shader-map shows all.
    pub z_fields: bool,
    /// Whether light meets the average light that the pair tables hold (BN12, G and T): that of a sun, and where it
    /// converges at any distance that there is.
    pub pair_tables: bool,
    /// Bands of light transfer: how well texels of trees that are drawn one by one know from where the sun reaches them.
    pub transfer_bands: u32,
    /// Shadow cascades; 0 without sun.
    pub cascades: u32,
    /// Distance that the cascades reach, m.
    pub shadow_distance: f64,
    /// Distance to which each species is drawn tree by tree (s_max of BN12), m.
    pub species_range: Vec<f64>,
    /// The largest of these, m; 0 without trees.
    pub range: f64,
    /// Range of trees on silhouettes of the ground over that of others (1: no such trees).
    #[serde(rename = "silhouette_reach")]
    pub silhouette_ratio: f64,
    /// Distances under which texels of some tree are magnified, from which every tree covers only a few pixels, and from
    /// which its light has converged to the average, m, ascending: the search for its surface needs filtered estimates, or
    /// none, and then no light ray or shadow either.
    pub draw_limits: [f64; 3],
    /// Height of the tallest tree, m.
    pub tallest: f64,
    /// Side of a seed quad, m.
    pub quad_side: f64,
    /// Side of a Wang tile, m.
    pub tile_side: f64,
    /// Wang tiles along a seed quad.
    pub tiles_per_quad: u32,
    /// Points of the pattern per m².
    pub pattern_density: f64,
    /// Regions of the seed buffer.
    pub seed_regions: u32,
    /// Of these, how many there are for quads beyond the range with trees on silhouettes. Where there are more in view, the
    /// farthest go without such trees.
    pub silhouette_quads: u32,
    /// Of them also, how many there are for quads that the camera does not see, whose trees cast shadows.
    pub shadow_quads: u32,
    /// Seeds a region.
    pub region_capacity: u32,
    /// Trees drawn one by one, at most.
    pub tree_capacity: u32,
    /// Trees that cast which are drawn at once, at most.
    pub caster_capacity: u32,
    /// Quads of terrain in a frame, at most.
    pub terrain_tiles: u32,
    /// Tiles of heights and slopes: as many, or the one of level ground.
    pub height_tiles: u32,
    /// Side that no quad of the finest level of a level plain exceeds, m.
    #[serde(skip)]
    pub plain_side: f64,
    /// Texels a side of a coverage tile.
    pub coverage_size: u32,
    /// Coverage tiles.
    pub cover_slots: u32,
    /// Channels of a coverage tile as stored: coverage and one a species, two or whole layers of four; 0 without trees.
    pub cover_channels: u32,
    /// The point pattern, if any density needs it.
    #[serde(skip)]
    pub pattern: Option<Pattern>,
}

impl Plan {
    /// Plans an image of a scene.
    ///
    /// # Errors
    /// [`Error::Usage`] when the plan exceeds the device's limits or the memory budget; it names the largest items.
    pub fn new(
        scene: &Scene,
        camera: &Camera,
        size: [u32; 2],
        layers: bool,
        device: Option<&DeviceInfo>,
    ) -> Result<Self> {
        Self::for_eye(scene, &Eye::new(camera, &scene.terrain, size), layers, Drawing::default(), device)
    }

    /// Plans an image of a scene as an eye sees it.
    ///
    /// # Errors
    /// As [`Plan::new`].
    pub fn for_eye(
        scene: &Scene,
        eye: &Eye,
        layers: bool,
        drawing: impl Into<Drawing>,
        device: Option<&DeviceInfo>,
    ) -> Result<Self> {
        Self::for_path(scene, eye, &[], layers, drawing, device)
    }

    /// Plans an image of a scene as an eye sees it that will also be at other places, of the same optics.
    ///
    /// # Errors
    /// As [`Plan::new`].
    pub fn for_path(
        scene: &Scene,
        eye: &Eye,
        places: &[[f64; 3]],
        layers: bool,
        drawing: impl Into<Drawing>,
        device: Option<&DeviceInfo>,
    ) -> Result<Self> {
        let Drawing { representation, rasterizer } = drawing.into();
        let s = &scene.settings;
        let has_sun = scene.sun.shines();
        let mut plan = Plan {
            items: Vec::new(),
            representation,
            view_mode: ViewMode::Radiance,
            rasterizer: Rasterizer::Graphics,
            tile_steps: TILE_STEPS,
            size: eye.size,
            samples: samples(s.samples, device),
            layers,
            z_fields: false,
            pair_tables: false,
            transfer_bands: 0,
            cascades: if has_sun { s.cascades } else { 0 },
            shadow_distance: 0.0,
            species_range: Vec::new(),
            range: 0.0,
            silhouette_ratio: 1.0,
            draw_limits: [0.0; 3],
            tallest: 0.0,
            quad_side: 1.0,
            tile_side: 1.0,
            tiles_per_quad: 1,
            pattern_density: 0.0,
            seed_regions: 1,
            silhouette_quads: 0,
            shadow_quads: 0,
            region_capacity: gpu::CULL_GROUP,
            tree_capacity: 1,
            caster_capacity: 0,
            terrain_tiles: if scene.terrain.heights.is_some() { 1024 } else { 1 },
            height_tiles: 1,
            plain_side: f64::INFINITY,
            coverage_size: s.coverage_size,
            cover_slots: 0,
            cover_channels: 0,
            pattern: None,
        };
        if scene.species.len() > gpu::MAX_SPECIES as usize {
            return Err(Error::Usage(format!(
                "{} species; at most {} fit a scene",
                scene.species.len(),
                gpu::MAX_SPECIES
            )));
        }
        plan.trees(scene, eye, device);
        if plan.range > 0.0 {
            plan.coverage(scene, eye, device);
            // At a range without end the average has no share, at any distance.
            plan.pair_tables = has_sun && representation != Representation::ZField;
            plan.z_fields =
                std::iter::once(&eye.position).chain(places).any(|p| plan.scene_in_range(scene, *p));
            if plan.z_fields && has_sun {
                plan.transfer_bands = scene.settings.transfer_bands;
            }
            if !plan.z_fields {
                (plan.seed_regions, plan.silhouette_quads, plan.shadow_quads) = (0, 0, 0);
                (plan.tree_capacity, plan.caster_capacity) = (0, 0);
            }
        }
        if scene.terrain.heights.is_some() {
            plan.height_tiles = plan.terrain_tiles;
        }
        let diagonal = scene.terrain.extent[0].hypot(scene.terrain.extent[1]);
        plan.shadow_distance = match f64::from(s.shadow_distance) {
            // Farther out the average light includes its shadows.
            0.0 if plan.range > 0.0 => {
                (f64::from(s.convergence) * plan.range).min(diagonal + eye.position[2].abs())
            }
            0.0 => diagonal,
            chosen => chosen,
        };
        plan.choose_rasterizer(rasterizer, device)?;
        plan.list(scene);
        plan.check(s.memory_mib, device)?;
        Ok(plan)
    }

    /// Device memory of the whole plan, bytes.
    pub fn bytes(&self) -> u64 {
        self.items.iter().map(|i| i.bytes).sum()
    }

    /// Distance to which any tree is drawn, m: those on silhouettes go on beyond the range.
    pub fn last_range(&self) -> f64 {
        self.range * self.silhouette_ratio
    }

    /// Whether the picture shows trees that are drawn one by one: in a view mode of the ground they would hide it.
    pub fn shows_trees(&self) -> bool {
        self.z_fields && self.view_mode != ViewMode::Coverage
    }

    /// Layers of a coverage tile.
    pub fn cover_layers(&self) -> u32 {
        self.cover_channels.div_ceil(4)
    }

    /// Bytes of the shader-map's nodes.
    pub fn node_bytes(&self) -> u64 {
        let nodes = u64::from(self.terrain_tiles) * u64::from(gpu::FOREST_NODES * gpu::FOREST_NODES);
        nodes * size_of::<gpu::ForestNode>() as u64
    }

    /// Whether any tree on ground of this extent between two heights may be near enough to a place to be drawn by itself:
    /// whether the box of their centres reaches into the range, with room for the rounding of single precision.
    pub fn trees_in_range(&self, extent: [f64; 2], [lowest, highest]: [f64; 2], place: [f64; 3]) -> bool {
        let (low, high) = ([0.0, 0.0, lowest], [extent[0], extent[1], highest + self.tallest]);
        let apart: f64 = (0..3).map(|k| (place[k] - place[k].clamp(low[k], high[k])).powi(2)).sum();
        self.representation != Representation::ShaderMap
            && self.range > 0.0
            && apart.sqrt() <= 1.001 * self.last_range() + 1.0
    }

    /// The same for a scene's whole terrain. Its nearest ground, below most cameras, saves looking at all of it.
    fn scene_in_range(&self, scene: &Scene, place: [f64; 3]) -> bool {
        let terrain = &scene.terrain;
        let [x, y] = [0, 1].map(|k| place[k].clamp(0.0, terrain.extent[k]));
        self.trees_in_range(terrain.extent, [terrain.height_at(x, y); 2], place)
            || terrain
                .heights
                .as_ref()
                .is_some_and(|h| self.trees_in_range(terrain.extent, height_range(h), place))
    }

    /// Trees: how far, in which quads, in how much memory.
    fn trees(&mut self, scene: &Scene, eye: &Eye, device: Option<&DeviceInfo>) {
        let s = &scene.settings;
        let mut area_density = 0.0;
        for species in &scene.species {
            let height = species.mesh.positions.iter().map(|p| p[2]).fold(0.0, f32::max).max(1e-3);
            let apparent = f64::from(height) * eye.pixels_at_1m / f64::from(s.zfield_min_pixels);
            let range = self.representation.range(apparent);
            self.species_range.push(range);
            let mut scale = f64::from(species.scale[1]);
            match &species.distribution {
                Distribution::Density { max_density, .. } => {
                    area_density += f64::from(*max_density);
                }
                Distribution::Positions(list) => {
                    let largest = list.iter().filter_map(|p| p.scale).fold(0.0, f32::max);
                    scale = scale.max(f64::from(largest));
                    area_density += list.len() as f64 / (scene.terrain.extent[0] * scene.terrain.extent[1]);
                }
            }
            self.range = self.range.max(range);
            let reach = species.mesh.positions.iter().map(|p| p[0].hypot(p[1]).max(p[2])).fold(0.0, f32::max);
            self.tallest = self.tallest.max(f64::from(reach) * scale);
        }
        // The box of a tree is no wider than twice its reach. Filtered search is worth its price up to sqrt 2 texels a
        // pixel; and views 10 degrees apart differ by less than a pixel under about eleven pixels: sin 10 degrees of
        // half the size.
        let widest = 2.0 * self.tallest * eye.pixels_at_1m;
        let near = widest * std::f64::consts::SQRT_2 / f64::from(s.view_resolution);
        self.draw_limits = [near, widest / 11.0, (f64::from(s.convergence) * self.range).max(widest / 11.0)];
        if area_density <= 0.0 {
            self.range = 0.0;
            return;
        }
        // Level ground has no silhouettes. A shader-map at any distance, and trees at any distance, leave them as they are.
        if scene.terrain.heights.is_some() && self.representation == Representation::Auto {
            let ratio = f64::from(s.zfield_min_pixels) / f64::from(s.silhouette_min_pixels);
            self.silhouette_ratio = ratio.max(1.0);
        }
        // Trees are no farther than the terrain, seen from here or from anywhere on it.
        let extent = scene.terrain.extent;
        let farthest = [0, 1].map(|k| eye.position[k].abs().max((eye.position[k] - extent[k]).abs()));
        let farthest = farthest[0].hypot(farthest[1]).hypot(eye.position[2]);
        let farthest = farthest.max(extent[0].hypot(extent[1]));
        let drawn = self.range.min(farthest);
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
            self.quad_side = (1000.0 / area_density).sqrt().max(drawn / QUADS_IN_RANGE);
            self.region_capacity = 0;
        }
        self.region_capacity =
            (self.region_capacity + fullest_listed(scene, self.quad_side)).next_multiple_of(gpu::CULL_GROUP);
        // Every quad within range; no more than exist or can be bound.
        let storage = device.map_or(ASSUMED_STORAGE, |d| d.max_storage_bytes.min(1 << 30));
        let across = |k: usize| {
            let exist = (scene.terrain.extent[k] / self.quad_side).ceil().max(1.0);
            (2.0 * ((drawn + self.tallest) / self.quad_side + 1.0).ceil() + 1.0).min(exist)
        };
        let region_bytes = u64::from(self.region_capacity) * size_of::<gpu::Seed>() as u64;
        let most = (storage / region_bytes).max(1);
        let exist = [0, 1].map(|k| (extent[k] / self.quad_side).ceil().max(1.0));
        let exist = exist[0] * exist[1];
        let spare = if self.cascades > 0 { SHADOW_QUADS.min(most as f64 / 2.0).floor() } else { 0.0 };
        let near = (across(0) * across(1)).min(most as f64 - spare);
        let spare = spare.min(exist - near);
        // Silhouettes beyond are lines: a few quads wide at any distance, however many quads there are.
        let lines = if self.silhouette_ratio > 1.0 {
            SILHOUETTE_QUADS * (self.last_range().min(farthest) - drawn) / self.quad_side
        } else {
            0.0
        };
        self.silhouette_quads =
            lines.min(exist - near - spare).min(most as f64 - near - spare).max(0.0) as u32;
        self.shadow_quads = spare as u32;
        self.seed_regions = near as u32 + self.silhouette_quads + self.shadow_quads;
        // Few trees of such a quad stand on the line.
        let slots =
            (near as u64 + u64::from(self.silhouette_quads.div_ceil(4))) * u64::from(self.region_capacity);
        self.tree_capacity =
            u64::from(s.zfield_max_trees).min(slots).min(storage / size_of::<gpu::Tree>() as u64).max(1)
                as u32;
        if self.cascades > 0 {
            // A quad may cast into four blocks of each cascade.
            let most = storage / size_of::<gpu::Caster>() as u64;
            let seeds = u64::from(self.seed_regions) * u64::from(self.region_capacity);
            let one = 4 * u64::from(self.cascades) * u64::from(self.region_capacity);
            self.caster_capacity = u64::from(CASTERS).min(2 * seeds).max(one).min(most) as u32;
        }
    }

    /// Coverage tiles: how many, for a view at the terrain's level of detail.
    fn coverage(&mut self, scene: &Scene, eye: &Eye, device: Option<&DeviceInfo>) {
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
        let room = (u64::from(s.memory_mib) << 20) / 4 / self.cover_tile_bytes();
        let layers = device.map_or(2048, |d| d.max_layers) / self.cover_layers();
        let most = wanted.min(quad_count(&scene.terrain, self.plain_side)).min(room).min(layers.into());
        self.cover_slots = most.max(1) as u32;
    }

    /// Bytes of a coverage tile with its mip levels.
    fn cover_tile_bytes(&self) -> u64 {
        u64::from(self.cover_channels) * u64::from(self.coverage_size).pow(2) * 2 * 85 / 64
    }

    /// Writes down every item.
    fn list(&mut self, scene: &Scene) {
        let s = &scene.settings;
        let mut items = Vec::new();
        let mut add = |kind, name: &str, reason: String, bytes: u64| {
            items.push(Item { kind, name: name.into(), reason, bytes });
        };
        let size_of_raster = |w: u32, h: u32| u64::from(w) * u64::from(h) * 4;
        if let Some(r) = &scene.terrain.heights {
            add("data", "height map", "the terrain has relief".into(), size_of_raster(r.width, r.height));
        }
        if let Albedo::Image(t) = &scene.terrain.albedo {
            add(
                "data",
                "ground albedo",
                "the ground's albedo is an image".into(),
                size_of_raster(t.width, t.height),
            );
        }
        if let Sky::LatLong { width, height, .. } = &scene.sky {
            add("data", "sky image", "the sky is an image".into(), 2 * size_of_raster(*width, *height));
        }
        let tile = u64::from(gpu::TERRAIN_HEIGHTS).pow(2) * 4 + u64::from(gpu::TERRAIN_SLOPES).pow(2) * 8;
        add(
            "cache",
            "terrain tiles",
            match &scene.terrain.heights {
                Some(_) => format!("{} quads of heights and slopes", self.height_tiles),
                None => "level ground: all quads share one tile of no height and no slope".into(),
            },
            u64::from(self.height_tiles) * tile,
        );
        let trees = self.range > 0.0;
        if self.z_fields {
            let views =
                u64::from(views::count(s.view_rings)) * u64::from(s.view_resolution).pow(2) * 4 * 4 / 3;
            for species in &scene.species {
                let reason = format!("species \"{}\" is drawn tree by tree", species.name);
                add("data", &format!("z-field views of {}", species.name), reason, views);
                if self.transfer_bands > 0 {
                    // Half as many texels a side.
                    let bytes = u64::from(self.transfer_bands) * views / 4;
                    let reason = format!("sunlight on leaves of species \"{}\", tree by tree", species.name);
                    add("data", &format!("light transfer of {}", species.name), reason, bytes);
                }
            }
        }
        if trees {
            let (n, m) = (u64::from(s.table_angles), u64::from(s.table_densities));
            for species in &scene.species {
                let name = &species.name;
                if self.pair_tables {
                    // The share of the average grows from distance 0 on (BN12, eq. 22): no ground is so near as to go without.
                    let reason =
                        format!("sunlight in forests of species \"{name}\", converged to from nearby on");
                    add("data", &format!("pair tables of {name}"), reason, n * n * n * m * 8);
                }
                let reason = format!("ground, skylight and trees of species \"{name}\" at any distance");
                add("data", &format!("view tables of {name}"), reason, (n + 1) * m * 8);
            }
            let maps: Vec<[u32; 2]> =
                scene.species.iter().filter_map(|s| density_map_size(s, scene.terrain.extent)).collect();
            if !maps.is_empty() {
                let side = |k: usize| maps.iter().map(|m| m[k]).max().unwrap_or(1);
                let bytes = size_of_raster(side(0), side(1)) * maps.len() as u64;
                let reason = format!("{} species have a density map or a list of trees", maps.len());
                add("data", "density maps", reason, bytes);
            }
            if self.pattern.is_some() {
                let reason = "densities thin a Poisson-disk pattern".to_string();
                add("data", "point pattern", reason, 16 * 8 * u64::from(POINTS));
            }
        }
        let slots = u64::from(self.seed_regions) * u64::from(self.region_capacity);
        if self.z_fields {
            let near = self.seed_regions - self.silhouette_quads - self.shadow_quads;
            let mut reason = format!("{near} quads of {:.0} m within {:.0} m", self.quad_side, self.range);
            if self.silhouette_quads > 0 {
                let far = self.last_range();
                reason += &format!(", {} with silhouettes to {far:.0} m", self.silhouette_quads);
            }
            if self.shadow_quads > 0 {
                reason += &format!(", {} whose trees only cast shadows", self.shadow_quads);
            }
            add("cache", "seeds", reason, slots * size_of::<gpu::Seed>() as u64);
        }
        if trees {
            add(
                "cache",
                "coverage tiles",
                format!(
                    "what trees of {} species cover of {} quads of terrain, to the horizon",
                    scene.species.len(),
                    self.cover_slots
                ),
                u64::from(self.cover_slots) * self.cover_tile_bytes(),
            );
            let texels = u64::from(self.coverage_size).pow(2);
            add(
                "data",
                "coverage sums",
                format!("{} coverage tiles are drawn at once", gpu::COVER_SCRATCH),
                u64::from(gpu::COVER_SCRATCH) * texels * 4,
            );
            let capacity = u64::from(self.tree_capacity);
            if self.z_fields {
                add(
                    "target",
                    "trees and lists",
                    format!("up to {capacity} trees in a frame"),
                    capacity * (size_of::<gpu::Tree>() as u64 + 4 + 24)
                        + slots * 4
                        + slots / u64::from(gpu::CULL_GROUP) * 4 * u64::from(gpu::TREE_LISTS),
                );
            }
            if self.z_fields && self.cascades > 0 {
                add(
                    "target",
                    "casters",
                    format!("up to {} trees that cast at once", self.caster_capacity),
                    u64::from(self.caster_capacity) * size_of::<gpu::Caster>() as u64,
                );
            }
            add(
                "target",
                "shader-map nodes",
                format!("trees far away on {} quads of terrain", self.terrain_tiles),
                self.node_bytes(),
            );
        }
        if self.cascades > 0 {
            add(
                "target",
                "shadow cascades",
                format!("the sun is up: {} cascades to {:.0} m", self.cascades, self.shadow_distance),
                u64::from(self.cascades) * u64::from(s.cascade_size).pow(2) * 4,
            );
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
        add("target", "image", reason, pixels * (multi * drawn + colour + 4 + 4));
        if tiles {
            let reason = "which quad of the ground each sample sees, so that it is lit once".to_string();
            add("target", "quads seen", reason, pixels * (multi + 1) * 4);
            if self.layers {
                let reason = "layers apart: how deep each pixel's first sample is".to_string();
                add("target", "first depth", reason, pixels * 4);
            }
        }
        if self.z_fields && tiles {
            for buffer in TileBuffers::new(self).all() {
                let (name, reason, bytes) = buffer.item();
                add("target", name, reason, bytes);
            }
        }
        if tiles {
            add("pipeline", "ground", "light on the ground, once a pixel that sees it".into(), 0);
        }
        if self.z_fields {
            let pipelines = if tiles { &tiles::TREE_PIPELINES[..] } else { &TREE_PIPELINES };
            for (name, reason) in pipelines {
                add("pipeline", name, (*reason).into(), 0);
            }
            if self.cascades > 0 {
                let reason =
                    format!("the sun is up: {} iterations to where its light enters", s.light_iterations);
                add("pipeline", "light ray of trees", reason, 0);
            }
        }
        let mut pass = |name: &str, reason: &str| add("pass", name, reason.into(), 0);
        if scene.terrain.heights.is_some() {
            pass("terrain tiles", "new quads of terrain");
        }
        if self.z_fields {
            pass("seeds", "new quads of trees");
        }
        if trees {
            pass("coverage tiles", "new quads of terrain with trees");
        }
        if self.z_fields {
            for name in ["cull", "prefix sums", "draw commands", "compact"] {
                pass(name, "which trees are seen, in order");
            }
        }
        if self.z_fields && self.cascades > 0 {
            pass("casters", "which trees cast shadows");
        }
        if self.cascades > 0 {
            pass("shadows", "the sun is up");
        }
        if matches!(scene.sky, Sky::LatLong { .. }) {
            pass("sky", "the sky is an image");
        }
        if trees {
            pass("shader-map", "trees beyond range, and average light");
        }
        pass("terrain", "the ground");
        if self.z_fields && tiles {
            tiles::TREE_PASSES.iter().for_each(|(name, reason)| pass(name, reason));
        }
        if tiles {
            pass("ground", "light on the ground, once a pixel that sees it");
        }
        if self.z_fields && tiles {
            pass("tree light", "light on trees, once a pixel and tree that it sees");
        }
        if self.z_fields && !tiles {
            pass("trees", "trees within range");
        }
        pass("tone map", "the picture for display");
        self.items = items;
    }

    fn check(&self, budget_mib: u32, device: Option<&DeviceInfo>) -> Result<()> {
        let budget = u64::from(budget_mib) << 20;
        let largest = || {
            let mut items: Vec<&Item> = self.items.iter().filter(|i| i.bytes > 0).collect();
            items.sort_by_key(|i| std::cmp::Reverse(i.bytes));
            let named: Vec<String> =
                items.iter().take(3).map(|i| format!("{} ({} MiB)", i.name, i.bytes >> 20)).collect();
            named.join(", ")
        };
        if self.bytes() > budget {
            return Err(Error::Usage(format!(
                "the plan takes {} MiB, more than memory_mib = {budget_mib}; the largest items: {}",
                self.bytes() >> 20,
                largest()
            )));
        }
        let Some(d) = device else { return Ok(()) };
        if self.bytes() > d.device_bytes {
            return Err(Error::Usage(format!(
                "the plan takes {} MiB; {} has {} MiB; the largest items: {}",
                self.bytes() >> 20,
                d.name,
                d.device_bytes >> 20,
                largest()
            )));
        }
        if self.size.iter().any(|n| *n == 0 || *n > d.max_image_side) {
            return Err(Error::Usage(format!(
                "an image of {} x {} pixels; {} draws 1 to {} a side",
                self.size[0], self.size[1], d.name, d.max_image_side
            )));
        }
        Ok(())
    }
}

/// The lowest and the highest height of a height map, with what its bicubic interpolation may add.
fn height_range(heights: &Raster) -> [f64; 2] {
    let fold = |start: f32, f: fn(f32, f32) -> f32| f64::from(heights.samples.iter().copied().fold(start, f));
    let [low, high] = [fold(f32::INFINITY, f32::min), fold(f32::NEG_INFINITY, f32::max)];
    // Catmull-Rom weights: at most 9/8 in each direction.
    let room = 0.3 * (high - low);
    [low - room, high + room]
}

/// The largest supported number of samples up to the wanted one.
fn samples(wanted: u32, device: Option<&DeviceInfo>) -> u32 {
    let supported = device.map_or(0b1_0101, |d| d.sample_counts);
    [8, 4, 1].into_iter().find(|n| *n <= wanted && supported & n != 0).unwrap_or(1)
}
