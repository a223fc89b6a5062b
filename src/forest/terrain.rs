//! Terrain tiles: heights and slopes of quads in texture arrays, least recently used first out.

use super::cache::SlotCache;
use crate::camera::Eye;
use crate::gpu::interface::{
    NO_PAGE, TERRAIN_CELLS, TERRAIN_HEIGHTS, TERRAIN_SLOPES, TerrainParameters, TerrainQuad,
};
use crate::gpu::{Buffer, Gpu, Image, ImageDesc, Program, Recorder, Resource, Sampler, shaders, vk};
use crate::land::quadtree::{MIN_REFINE, QuadKey, Quadtree};
use crate::plan::Plan;
use crate::plan::names::{pass, resource};
use crate::scene::{Albedo, Scene};
use crate::{Error, Result};

/// The ground: its quadtree, height map, tiles and reflectance.
pub struct TerrainData {
    /// Which quads at which level.
    pub tree: Quadtree,
    /// Height map; one texel for a level plain.
    pub heights: Image,
    /// Reflectance.
    pub albedo: Image,
    /// Heights of quads.
    pub height_tiles: Image,
    /// Slopes of quads.
    pub slope_tiles: Image,
    /// Quads of this frame: the camera's, then those to produce.
    pub quads: Buffer,
    cache: SlotCache<QuadKey>,
    /// What makes tiles; level ground has but the one that it begins with.
    program: Option<Program>,
    refine: f64,
    extent: [f64; 2],
    has_heights: bool,
    texels_per_step: f64,
    /// How high above the ground a quad of it shows something, m.
    above: f64,
}

/// What is drawn: quads, and where each draw's are in [`TerrainData::quads`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TerrainDraws {
    /// All quads.
    pub quads: Vec<TerrainQuad>,
    /// Keys of the camera's.
    pub keys: Vec<QuadKey>,
    /// First and number of the camera's quads.
    pub camera: (u32, u32),
    /// How many of them, the first, shadow cascades may reach.
    pub shadowed: u32,
    /// The same for tiles to produce.
    pub fresh: (u32, u32),
}

impl TerrainData {
    /// Uploads the height map and makes the caches.
    ///
    /// # Errors
    /// [`Error::Device`] when out of memory.
    pub fn new(gpu: &Gpu, scene: &Scene, plan: &Plan) -> Result<Self> {
        let terrain = &scene.terrain;
        let image = |name, or: vk::Format| {
            gpu.image(plan.images(name).next().unwrap_or(&ImageDesc::stand_in(name, or)))
        };
        let heights = image(resource::HEIGHT_MAP, vk::Format::R32_SFLOAT)?;
        let flat = [0f32];
        let samples = terrain.heights.as_ref().map_or(&flat[..], |r| &r.samples);
        gpu.upload_image(&heights, 0, 0, 1, bytemuck::cast_slice(samples))?;
        let albedo = image(resource::ALBEDO, vk::Format::R32G32B32A32_SFLOAT)?;
        match &terrain.albedo {
            Albedo::Uniform([r, g, b]) => {
                gpu.upload_image(&albedo, 0, 0, 1, bytemuck::cast_slice(&[*r, *g, *b, 1.0]))?;
            }
            Albedo::Image(t) => gpu.upload_image(&albedo, 0, 0, 1, &t.rgba)?,
        }
        let tree = Quadtree::new(terrain, plan.plain_side);
        let height_tiles = image(resource::HEIGHT_TILES, vk::Format::R32_SFLOAT)?;
        let slope_tiles = image(resource::SLOPE_TILES, vk::Format::R16G16B16A16_SFLOAT)?;
        // Without relief the tile of no height and no slope serves every quad.
        let made = plan.height_tiles > 1 || terrain.heights.is_some();
        if !made {
            gpu.upload_image(&height_tiles, 0, 0, 1, &[0; 4 * (TERRAIN_HEIGHTS * TERRAIN_HEIGHTS) as usize])?;
            gpu.upload_image(&slope_tiles, 0, 0, 1, &[0; 8 * (TERRAIN_SLOPES * TERRAIN_SLOPES) as usize])?;
        }
        Ok(TerrainData {
            heights,
            albedo,
            height_tiles,
            slope_tiles,
            // Each quad once for the camera, once when fresh.
            quads: gpu.texel_buffer(
                "terrain quads",
                2 * u64::from(plan.terrain_tiles) * size_of::<TerrainQuad>() as u64,
                (vk::Format::R32G32B32A32_UINT, 16),
            )?,
            cache: SlotCache::new(plan.terrain_tiles),
            program: made.then(|| gpu.compute(&shaders::FOREST_TERRAIN_TILE_COMP, &[])).transpose()?,
            refine: 0.0,
            extent: terrain.extent,
            has_heights: terrain.heights.is_some(),
            above: if plan.shells { plan.tallest } else { 0.0 },
            texels_per_step: if terrain.heights.is_some() { tree.step() / terrain.cell_size } else { 0.0 },
            tree,
        })
    }

    /// Contents thrown out of the cache so far.
    pub fn evicted(&self) -> u32 {
        if self.program.is_some() { self.cache.evicted() as u32 } else { 0 }
    }

    /// What was to be produced may not have been: no tile holds anything.
    pub fn forget(&mut self) {
        self.cache = SlotCache::new(self.cache.capacity());
    }

    /// Push constants of draws and dispatches, from a first quad on.
    pub fn parameters(&self, first_quad: u32) -> TerrainParameters {
        TerrainParameters {
            last: self.extent.map(|e| (e / self.tree.step()) as f32),
            step: self.tree.step() as f32,
            texels_per_step: self.texels_per_step as f32,
            extent: self.extent.map(|e| e as f32),
            first_quad,
            has_heights: u32::from(self.has_heights),
        }
    }

    /// Selects this frame's quads, with shadow cascades to `shadows` metres; [`TerrainData::upload`] them when they have their
    /// coverage tiles.
    ///
    /// # Errors
    /// [`Error::Usage`] when the view needs more tiles than the plan holds even at the coarsest.
    pub fn update(&mut self, eye: &Eye, shadows: f64, pixels: f64) -> Result<TerrainDraws> {
        let most = self.cache.capacity() as usize;
        let planes = eye.planes();
        let wanted = eye.pixels_at_1m / (f64::from(TERRAIN_CELLS) * pixels);
        let mut refine = wanted.max(MIN_REFINE);
        loop {
            self.refine = refine;
            let tree = &self.tree;
            let camera = tree
                .select(eye.position, refine, most, &|b| b.raised(self.above).touches(&planes, eye.position));
            if let Some(camera) = camera {
                let (mut near, far): (Vec<_>, Vec<_>) =
                    camera.into_iter().partition(|q| self.tree.nearest(*q, eye.position) <= shadows);
                let shadowed = near.len() as u32;
                near.extend(far);
                if let Some(draws) = self.assign(near) {
                    return Ok(TerrainDraws { shadowed, ..draws });
                }
            }
            if refine <= MIN_REFINE {
                return Err(Error::Usage(format!(
                    "this view needs more than the {most} terrain tiles of the plan"
                )));
            }
            // Coarser everywhere rather than holes somewhere.
            refine = (0.8 * refine).max(MIN_REFINE);
        }
    }

    fn assign(&mut self, keys: Vec<QuadKey>) -> Option<TerrainDraws> {
        self.cache.begin_frame();
        let (mut quads, mut fresh) = (Vec::new(), Vec::new());
        for key in &keys {
            let Some(slot) = self.cache.slot(*key) else {
                self.cache = SlotCache::new(self.cache.capacity());
                return None;
            };
            let spacing = self.tree.spacing(key.level);
            let quad = TerrainQuad {
                corner: [key.x, key.y].map(|v| (v * TERRAIN_CELLS * spacing) as i32),
                spacing: spacing as i32,
                layer: if self.program.is_some() { slot.index } else { 0 },
                morph: self.tree.morph(key.level, self.refine).map(|m| m as f32),
                cover_layer: NO_PAGE,
                ..bytemuck::Zeroable::zeroed()
            };
            quads.push(quad);
            if slot.fresh && self.program.is_some() {
                fresh.push(quad);
            }
        }
        let count = quads.len() as u32;
        let (camera, made) = ((0, count), (count, fresh.len() as u32));
        quads.extend(fresh);
        Some(TerrainDraws { quads, keys, camera, shadowed: 0, fresh: made })
    }

    /// Uploads the quads.
    ///
    /// # Errors
    /// [`Error::Device`] if the device fails.
    pub fn upload(&self, recorder: &mut Recorder, draws: &TerrainDraws) -> Result<()> {
        recorder.upload(&self.quads, 0, &draws.quads)
    }

    /// Records the production of fresh tiles.
    pub fn produce(&self, recorder: &mut Recorder, draws: &TerrainDraws) {
        let Some(program) = self.program.as_ref().filter(|_| draws.fresh.1 > 0) else { return };
        recorder.compute(pass::TERRAIN_TILES, |pass| {
            pass.bind(
                program,
                &[
                    ("quads", Resource::Buffer(&self.quads)),
                    ("heights", Resource::Texture(&self.heights, Sampler::Nearest)),
                    ("height_tiles", Resource::Storage(&self.height_tiles)),
                    ("slope_tiles", Resource::Storage(&self.slope_tiles)),
                ],
            );
            pass.push(&self.parameters(draws.fresh.0));
            pass.dispatch([(TERRAIN_SLOPES * TERRAIN_SLOPES).div_ceil(64), draws.fresh.1, 1]);
        });
    }
}
