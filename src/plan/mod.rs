//! What a scene requires: every table, view set, cache, target and pass, with the reason and the bytes, before anything
//! is allocated. What no one needs is not in the plan, and is not built.

mod cards;
mod check;
mod cover;
mod data;
mod items;
mod meshes;
pub mod names;
mod passes;
mod range;
mod seeds;
mod shells;
mod targets;
mod tiles;

use crate::Result;
use crate::camera::Eye;
use crate::gpu::DeviceInfo;
use crate::gpu::interface as gpu;
use crate::ladder::Ladder;
use crate::land::pattern::Pattern;
use crate::scene::{Camera, Scene};

pub use cards::{CARD_DRAWS, TRANSFER_LAYERS};
pub use data::{NODE_TEXELS, QUAD_INDEX_BYTES, TREE_TEXELS, tables};
pub use items::Item;
pub use meshes::{FACE_TRANSFER_WORDS, envelope_words};
pub use shells::{SHELL_LIGHT_TEXELS, SHELL_LIGHTS};
pub use tiles::{Drawing, Rasterizer, TILE_STEPS, TileBuffer, TileBuffers};

/// Storage buffers that every Vulkan device binds, when no device is known.
const ASSUMED_STORAGE: u64 = 128 << 20;

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

/// What will be built and drawn.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Plan {
    /// Everything, in the order of building.
    pub items: Vec<Item>,
    /// What stands for a tree, near to far, with the apparent heights between the rungs.
    pub ladder: Ladder,
    /// Why trees near an eye are no meshes, where the ladder would have them so and may go without.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub no_meshes: Option<String>,
    /// What the picture shows; [`Plan::new`] says radiance, and whoever wants another mode sets it before the renderer is made, and has the
    /// plan listed anew ([`Plan::list`]).
    pub view_mode: ViewMode,
    /// What finds the samples of trees.
    pub rasterizer: Rasterizer,
    /// Steps of writing the tiles' lists, at most: [`TILE_STEPS`]; tests set fewer before the renderer is made.
    #[serde(skip)]
    pub tile_steps: u32,
    /// Invocations that write them; the lists are the same for any number.
    #[serde(skip)]
    pub list_lanes: u32,
    /// Whether a pixel of a tile passes over trees on whose views' outlines it is not, and is done when all that it sees is nearer
    /// than its next tree can be: that saves time and changes no bit, which conformance proves by a renderer without.
    #[serde(skip)]
    pub tile_shortcuts: bool,
    /// Image size, pixels.
    pub size: [u32; 2],
    /// Samples a pixel.
    pub samples: u32,
    /// Frames whose mean a picture is, each shifted by a part of a pixel.
    pub accumulation: u32,
    /// Layers of the image apart: sun, sky, coverage, species.
    pub layers: bool,
    /// Whether a sun shines.
    pub sun: bool,
    /// Whether wind moves the trees; left out of reports where none does.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub wind: bool,
    /// Whether any tree stands in the scene.
    pub forest: bool,
    /// Whether trees are drawn one by one: any can come within the range of an eye. Without, the shader-map shows all.
    pub near_trees: bool,
    /// Whether some of them are z-fields.
    pub z_fields: bool,
    /// Distance to which trees of each species are their models' meshes, m, times their scale: 0 where none is.
    pub mesh_range: Vec<f64>,
    /// The same of the largest tree of any, m.
    pub last_mesh_range: f64,
    /// Whether any tree can come within that of an eye.
    pub meshes: bool,
    /// Distance to which trees of each species are clouds of cards at most, m, times their scale: 0 where none is.
    pub card_range: Vec<f64>,
    /// The same of the largest tree of any, m.
    pub last_card_range: f64,
    /// Distance to which any of them is a full cloud, m.
    pub cloud_range: f64,
    /// Distance from which on any of them shows its far form, m.
    pub far_from: f64,
    /// Whether any tree can come so near an eye that it is a cloud of cards.
    pub cards: bool,
    /// Whether trees that are not drawn one by one are slices of a forest over the ground.
    pub shells: bool,
    /// Whether meshes are lit by spherical harmonics, as cards are.
    pub mesh_harmonics: bool,
    /// Largest texel of shadow maps that tell leaves of these apart, m, into which they cast as meshes; 0 where none is a mesh.
    pub mesh_texel: f64,
    /// Whether light meets the average light that the pair tables hold (BN12, G and T): that of a sun, and where it
    /// converges at any distance that there is.
    pub pair_tables: bool,
    /// Bands of light transfer: how well texels of trees that are drawn one by one know from where the sun reaches them.
    pub transfer_bands: u32,
    /// Nodes of the density at which light that met more than one surface is known; 0 where it is left out.
    pub indirect: u32,
    /// Shadow cascades; 0 without sun, and where average light, which includes its shadows, is all that there is.
    pub cascades: u32,
    /// Distance that the cascades reach, m.
    pub shadow_distance: f64,
    /// Distance to which each species is drawn tree by tree (s_max of BN12), m.
    pub species_range: Vec<f64>,
    /// The largest of these, m; 0 where no tree is drawn by itself.
    pub range: f64,
    /// Part of the range from which on light and shadow are the average's; 0: they never are.
    pub convergence: f64,
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
    /// [`crate::Error::Usage`] when the plan exceeds the device's limits or the memory budget; it names the largest items.
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
        let drawing = drawing.into();
        let asked = drawing.ladder.unwrap_or(scene.ladder);
        let with =
            |ladder| Self::with_ladder(scene, eye, places, layers, (ladder, drawing.rasterizer), device);
        match (with(asked), asked.without_meshes()) {
            (Err(why), Some(fewer)) => {
                // What is wrong without meshes too is not their fault.
                with(fewer).map(|plan| Plan { no_meshes: Some(why.to_string()), ..plan })
            }
            (plan, _) => plan,
        }
    }

    fn with_ladder(
        scene: &Scene,
        eye: &Eye,
        places: &[[f64; 3]],
        layers: bool,
        (ladder, rasterizer): (Ladder, Option<Rasterizer>),
        device: Option<&DeviceInfo>,
    ) -> Result<Self> {
        let ladder = ladder.resolved(&scene.settings);
        if let Err((what, remedy)) = ladder.descends() {
            return Err(crate::Error::Usage(format!(
                "ladder {ladder}, as the knobs have it: {what}; {remedy}"
            )));
        }
        let mut plan = Plan::empty(scene, eye, layers, ladder, device);
        plan.check_species(scene)?;
        let ground = range::ground_range(scene);
        plan.ranges(scene, eye, places, ground);
        plan.shadows(scene, eye);
        if plan.forest {
            plan.seeds(scene, eye, device);
            plan.coverage(scene, eye, device);
            plan.pair_tables = plan.sun && ladder.goes_on();
            plan.shells = ladder.shells();
            if scene.settings.indirect > 0 {
                plan.indirect = scene.settings.table_densities;
            }
            let mut all = std::iter::once(&eye.position).chain(places);
            plan.near_trees = all.clone().any(|p| plan.scene_in_range(scene, ground, *p));
            plan.z_fields = plan.near_trees && ladder.z_fields();
            plan.meshes = plan.near_trees && all.clone().any(|p| plan.scene_has_mesh_at(scene, ground, *p));
            plan.cards = plan.near_trees && all.any(|p| plan.scene_has_cards_at(scene, ground, *p));
            if plan.meshes {
                if ladder.without_meshes().is_some() {
                    meshes::check_size(scene)?;
                }
                plan.mesh_texel = meshes::leaf_side(scene) / f64::from(scene.settings.mesh_shadow_texels);
            }
            if plan.z_fields && plan.sun {
                plan.transfer_bands = scene.settings.transfer_bands;
            }
            if !plan.near_trees {
                (plan.seed_regions, plan.silhouette_quads, plan.shadow_quads) = (0, 0, 0);
                (plan.tree_capacity, plan.caster_capacity) = (0, 0);
            }
        }
        plan.check_cards()?;
        plan.check_shells(scene, device)?;
        plan.choose_rasterizer(rasterizer, device)?;
        plan.list(scene);
        plan.check(scene.settings.memory_mib, device)?;
        Ok(plan)
    }

    /// A plan of a scene without trees, before anything is worked out.
    fn empty(scene: &Scene, eye: &Eye, layers: bool, ladder: Ladder, device: Option<&DeviceInfo>) -> Self {
        let s = &scene.settings;
        let terrain_tiles = if scene.terrain.heights.is_some() { 1024 } else { 1 };
        Plan {
            items: Vec::new(),
            ladder,
            no_meshes: None,
            view_mode: ViewMode::Radiance,
            rasterizer: Rasterizer::Graphics,
            tile_steps: TILE_STEPS,
            list_lanes: 0,
            tile_shortcuts: true,
            size: eye.size,
            samples: check::samples(s.samples, device),
            accumulation: s.accumulation,
            layers,
            sun: scene.sun.shines(),
            wind: false,
            forest: false,
            near_trees: false,
            z_fields: false,
            card_range: Vec::new(),
            last_card_range: 0.0,
            cloud_range: 0.0,
            far_from: 0.0,
            cards: false,
            shells: false,
            mesh_harmonics: s.light_model == 1,
            mesh_range: Vec::new(),
            last_mesh_range: 0.0,
            meshes: false,
            mesh_texel: 0.0,
            pair_tables: false,
            indirect: 0,
            transfer_bands: 0,
            cascades: if scene.sun.shines() { s.cascades } else { 0 },
            shadow_distance: 0.0,
            species_range: Vec::new(),
            range: 0.0,
            convergence: 0.0,
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
            terrain_tiles,
            height_tiles: terrain_tiles,
            plain_side: f64::INFINITY,
            coverage_size: s.coverage_size,
            cover_slots: 0,
            cover_channels: 0,
            pattern: None,
        }
    }

    /// Whether the picture shows trees that are meshes.
    pub fn shows_meshes(&self) -> bool {
        self.meshes && self.shows_trees()
    }

    /// Whether the picture shows trees that are clouds of cards.
    pub fn shows_cards(&self) -> bool {
        self.cards && self.shows_trees()
    }

    /// Whether the picture shows trees that are z-fields.
    pub fn shows_z_fields(&self) -> bool {
        self.z_fields && self.shows_trees()
    }

    /// Whether the picture shows trees that are drawn one by one: in a view mode of the ground they would hide it.
    pub fn shows_trees(&self) -> bool {
        self.near_trees && self.view_mode != ViewMode::Coverage
    }

    /// Whether z-field views are drawn, into the picture or into shadow maps.
    pub fn draws_views(&self) -> bool {
        self.z_fields || self.near_trees && self.cascades > 0
    }
}
