//! Species on the GPU: the table, the z-field views of all species in one array, view bases, masks and density maps.

use crate::bake::harmonics::seen::Corrections;
use crate::bake::{Baked, tables};
use crate::gpu::interface::{MAX_SPECIES, NO_PAGE, OPTICS, Species as Row, ViewBasis};
use crate::gpu::{Buffer, Gpu, Image, ImageDesc, Resource, Sampler, vk};
use crate::land::density::{DensityMap, HEIGHT_SOFTNESS, SLOPE_SOFTNESS, density_map};
use crate::physics::correction::Correction;
use crate::physics::crown::Crown;
use crate::physics::crown::Frame;
use crate::physics::forest;
use crate::physics::masks::combination_table;
use crate::physics::outline;
use crate::physics::raster::Raster;
use crate::physics::transfer::NEUTRAL;
use crate::physics::views;
use crate::physics::zfield::ZField;
use crate::plan::Plan;
use crate::plan::names::resource;
use crate::scene::{Distribution, Scene, Species, TreePosition};
use crate::{Error, Result};

/// Everything about species that shaders read.
pub struct SpeciesData {
    /// Rows of the table, also for the CPU's twin of the cull.
    pub rows: Vec<Row>,
    /// Number of species.
    pub count: u32,
    /// The table.
    pub table: Buffer,
    /// z-field views, species after species.
    pub views: Image,
    /// Outlines of the same views, if tiles look for trees; else nothing.
    pub outlines: Buffer,
    /// Light transfer of the same views by band; of bands that are not used one texel.
    pub transfer: [Image; 2],
    /// Bases of the views, species after species.
    pub bases: Buffer,
    /// Combination table of sample masks.
    pub masks: Buffer,
    /// Rows of the combination table.
    pub mask_rows: u32,
    /// Density maps, also of listed trees, one a layer.
    pub densities: Image,
    /// Number of density maps.
    pub map_count: u32,
}

impl SpeciesData {
    /// Uploads baked species.
    ///
    /// # Errors
    /// [`Error::Usage`] for bakes of other species or settings, or without what the plan needs; [`Error::Device`] when out of
    /// memory.
    pub fn new(gpu: &Gpu, scene: &Scene, plan: &Plan, baked: &[Baked]) -> Result<Self> {
        if baked.len() != scene.species.len() {
            let (has, wants) = (baked.len(), scene.species.len());
            return Err(Error::Usage(format!("{has} species were baked of the scene's {wants}")));
        }
        let n = scene.settings.view_rings;
        let view_count = views::count(n);
        let resolution = scene.settings.view_resolution;
        let none = ImageDesc::stand_in(resource::VIEWS, vk::Format::R8G8B8A8_UNORM);
        let texels = gpu.image(plan.images(resource::VIEWS).next().unwrap_or(&none))?;
        for (k, bake) in baked.iter().map(|b| &b.species).enumerate() {
            if bake.views.resolution != resolution || bake.views.n != n {
                return Err(Error::Usage("a species was baked with other settings than the scene's".into()));
            }
            for (level, bytes) in bake.views.levels.iter().enumerate().filter(|_| plan.draws_views()) {
                gpu.upload_image(&texels, level as u32, k as u32 * view_count, view_count, bytes)?;
            }
        }
        let transfer = [transfer(gpu, plan, baked, 0)?, transfer(gpu, plan, baked, 1)?];
        let bases: Vec<ViewBasis> = baked.iter().flat_map(|b| view_bases(&b.species.views)).collect();
        let maps: Vec<Option<DensityMap>> =
            scene.species.iter().map(|s| density_map(s, scene.terrain.extent)).collect();
        let rows = rows(scene, plan, baked, &maps, view_count);
        let maps: Vec<&Raster> = maps.iter().flatten().map(|m| m.relative.as_ref()).collect();
        let map_count = maps.len() as u32;
        let none = ImageDesc::stand_in(resource::DENSITY_MAPS, vk::Format::R32_SFLOAT);
        let densities = gpu.image(plan.images(resource::DENSITY_MAPS).next().unwrap_or(&none))?;
        let size = densities.size();
        for (layer, map) in maps.iter().enumerate() {
            let mut padded = vec![0f32; (size[0] * size[1]) as usize];
            for y in 0..map.height as usize {
                let row = &map.samples[y * map.width as usize..][..map.width as usize];
                padded[y * size[0] as usize..][..row.len()].copy_from_slice(row);
            }
            gpu.upload_image(&densities, 0, layer as u32, 1, bytemuck::cast_slice(&padded))?;
        }
        let masks = combination_table(plan.samples);
        Ok(SpeciesData {
            table: gpu.buffer_with("species", &block(&rows))?,
            rows,
            count: scene.species.len() as u32,
            views: texels,
            outlines: outlines(gpu, plan, baked)?,
            transfer,
            bases: {
                let bytes = size_of_val(bases.as_slice()) as u64;
                let texels = (vk::Format::R32G32B32A32_SFLOAT, 16);
                let buffer = gpu.texel_buffer("view bases", bytes, texels)?;
                gpu.upload(&buffer, 0, &bases)?;
                buffer
            },
            mask_rows: masks.len() as u32,
            masks: gpu.buffer_with("sample masks", &masks)?,
            densities,
            map_count,
        })
    }
}

impl SpeciesData {
    /// Takes the ranges of another plan.
    ///
    /// # Errors
    /// [`Error::Device`] if the device fails.
    pub fn set_ranges(&mut self, gpu: &Gpu, plan: &Plan) -> Result<()> {
        for (row, range) in self.rows.iter_mut().zip(&plan.species_range) {
            row.range = *range as f32;
        }
        for (row, range) in self.rows.iter_mut().zip(&plan.mesh_range) {
            row.mesh_range = if plan.meshes { *range as f32 } else { 0.0 };
        }
        for (row, range) in self.rows.iter_mut().zip(&plan.card_range) {
            row.card_range = if plan.cards { *range as f32 } else { 0.0 };
        }
        gpu.upload(&self.table, 0, &block(&self.rows))
    }

    /// What lighting z-field trees reads of all species, by the names that shaders have for it.
    pub fn lit(&self) -> [(&'static str, Resource<'_>); 4] {
        [
            ("species", Resource::Buffer(&self.table)),
            ("views", Resource::Texture(&self.views, Sampler::LinearBorder)),
            ("transfer_1", Resource::Texture(&self.transfer[0], Sampler::Linear)),
            ("transfer_2", Resource::Texture(&self.transfer[1], Sampler::Linear)),
        ]
    }
}

/// Radius of a sphere about the middle of a tree's box that holds the tree, however the wind moves it, m.
fn bounding_radius(scene: &Scene, frame: &Frame) -> f32 {
    let still = frame.half_width.hypot(frame.half_height);
    let height = f64::from(frame.centre + frame.half_height);
    still + scene.wind.map_or(0.0, |w| w.reach(height, f64::from(frame.half_width)) as f32)
}

/// The rows as a uniform block, which has its whole size.
fn block(rows: &[Row]) -> Vec<Row> {
    let mut block = rows.to_vec();
    block.resize(MAX_SPECIES as usize, bytemuck::Zeroable::zeroed());
    block
}

/// Uploads outlines of the views of all species.
fn outlines(gpu: &Gpu, plan: &Plan, baked: &[Baked]) -> Result<Buffer> {
    let described = plan.buffer(resource::OUTLINES);
    let words = match described.bytes {
        0 => Vec::new(),
        _ => baked.iter().flat_map(|b| outline::outlines(&b.species.views)).collect(),
    };
    gpu.described_buffer_with(&described, &words)
}

/// Uploads a band of the light transfer of all species.
fn transfer(gpu: &Gpu, plan: &Plan, baked: &[Baked], band: u32) -> Result<Image> {
    let Some(described) = plan.images(resource::TRANSFER).nth(band as usize) else {
        let none = ImageDesc::stand_in(resource::TRANSFER, vk::Format::R8G8B8A8_UNORM);
        let image = gpu.image(&none)?;
        gpu.upload_image(&image, 0, 0, 1, &NEUTRAL)?;
        return Ok(image);
    };
    let image = gpu.image(described)?;
    for (k, bake) in baked.iter().map(|b| &b.species).enumerate() {
        let view_count = views::count(bake.views.n);
        let Some(levels) = bake.transfer.bands.get(band as usize) else {
            let message = "a species was baked without the light transfer that the plan lists";
            return Err(Error::Usage(message.into()));
        };
        for (level, bytes) in levels.iter().enumerate() {
            gpu.upload_image(&image, level as u32, k as u32 * view_count, view_count, bytes)?;
        }
    }
    Ok(image)
}

/// The projection into every view of a species, and what each view shows.
fn view_bases(field: &ZField) -> Vec<ViewBasis> {
    let side = field.resolution as usize;
    let texels = field.levels[0].chunks_exact(4 * side * side);
    views::pairs(field.n)
        .zip(texels)
        .map(|((i, j), texels)| {
            // u = 1/2 + (p · right) / (2 m), v = 1/2 + (p · up) / (2 m extent), with a border of one texel.
            let basis = views::Basis::new(views::direction(field.n, i, j));
            let m = side as f64 / (side as f64 - 2.0);
            let row = |a: glam::DVec3, s: f64| [a.x * s, a.y * s, a.z * s, 0.0].map(|x| x as f32);
            // First and last column and row with any opacity, as borders of texels.
            let (mut low, mut high) = ([side; 2], [0; 2]);
            for (k, _) in texels.chunks_exact(4).enumerate().filter(|(_, t)| t[3] > 0) {
                for (axis, at) in [k % side, k / side].into_iter().enumerate() {
                    low[axis] = low[axis].min(at);
                    high[axis] = high[axis].max(at + 1);
                }
            }
            let along = |at: usize, extent: f64| ((at as f64 / side as f64 - 0.5) * 2.0 * m * extent) as f32;
            let bounds = if high[0] == 0 {
                [0.0; 4]
            } else {
                let e = basis.extent;
                [along(low[0], 1.0), along(high[0], 1.0), along(low[1], e), along(high[1], e)]
            };
            ViewBasis {
                u: row(basis.right, 0.5 / m),
                v: row(basis.up, 0.5 / (basis.extent * m)),
                depth: row(basis.w, 1.0),
                bounds,
            }
        })
        .collect()
}

/// Mean horizontal area of a species' trees, m² (A of BN12).
pub(super) fn mean_area(species: &Species, crown: &Crown) -> f32 {
    std::f32::consts::PI * crown.radius.powi(2) * mean_squared_scale(species) as f32
}

/// Mean of the squared scale of a species' trees.
pub(super) fn mean_squared_scale(species: &Species) -> f64 {
    let drawn = tables::mean_squared_scale(species.scale);
    match &species.distribution {
        Distribution::Positions(list) if !list.is_empty() => {
            let square = |p: &TreePosition| p.scale.map_or(drawn, |s| f64::from(s).powi(2));
            list.iter().map(square).sum::<f64>() / list.len() as f64
        }
        _ => drawn,
    }
}

/// Reflectance and transmittance of leaves, and reflectance of bark, of every species, and what harmonics leave out of the sun on
/// each of these in two forms of a tree, as shaders read them.
pub(super) fn optics_block(baked: &[Baked], seen: impl Fn(&Baked) -> [Corrections; 2]) -> Vec<[f32; 4]> {
    let mut block = Vec::new();
    for one in baked {
        let s = &one.species;
        let colours = [s.reflectance, s.transmittance, s.bark_reflectance];
        block.extend(colours.map(|[r, g, b]| [r, g, b, 0.0]));
        block.extend(seen(one).iter().flatten().flat_map(coefficients));
    }
    block.resize((OPTICS * MAX_SPECIES) as usize, [0.0; 4]);
    block
}

/// A correction's coefficients as the table has them.
fn coefficients(c: &Correction) -> [[f32; 4]; 4] {
    let all = c.coefficients();
    std::array::from_fn(|k| std::array::from_fn(|i| all[4 * k + i]))
}

fn rows(
    scene: &Scene,
    plan: &Plan,
    baked: &[Baked],
    maps: &[Option<DensityMap>],
    view_count: u32,
) -> Vec<Row> {
    let mut next_map = 0;
    let mut rows = Vec::new();
    for (k, (species, Baked { species: bake, tables, .. })) in scene.species.iter().zip(baked).enumerate() {
        let (mut max_density, mut between, mut slope) = (0.0, None, None);
        if let Distribution::Density { max_density: d, between_heights, below_slope, .. } =
            &species.distribution
        {
            (max_density, between, slope) = (*d, *between_heights, *below_slope);
        }
        let density_layer = match &maps[k] {
            Some(_) => {
                next_map += 1;
                next_map - 1
            }
            None => NO_PAGE,
        };
        let map_size =
            maps[k].as_ref().map_or([1.0; 2], |m| [m.relative.width as f32, m.relative.height as f32]);
        let [low, high] = between.unwrap_or([-1e30, 1e30]);
        let tangent = slope.map_or(1e30, |s| s.to_radians().tan());
        let crown = &bake.crown;
        let [reflectance, transmittance] = bake.crown_leaves();
        rows.push(Row {
            scale_to_metres: crown.frame.scale().into(),
            centre: crown.frame.centre,
            reflectance,
            extinction: crown.extinction,
            leaf_shadow: crown.leaf_shadow,
            albedo: bake.sky_albedo(),
            turning: bake.turned.slope_of(),
            lit: coefficients(&crown.lit),
            sent: coefficients(&bake.sent()),
            transmittance,
            mesh_range: if plan.meshes { plan.mesh_range[k] as f32 } else { 0.0 },
            card_range: if plan.cards { plan.card_range[k] as f32 } else { 0.0 },
            range: plan.species_range[k] as f32,
            crown_radius: crown.radius,
            bounding_radius: bounding_radius(scene, &crown.frame),
            first_layer: k as u32 * view_count,
            scale_range: species.scale,
            max_density,
            density_layer,
            between_heights: [low, high],
            below_slope: tangent,
            height_softness: if between.is_some() { HEIGHT_SOFTNESS * (high - low) } else { 1.0 },
            map_size,
            slope_softness: if slope.is_some() { SLOPE_SOFTNESS * tangent } else { 1.0 },
            bare_below: crown.bare_below(),
            bark_ratio: bake.bark_ratio(),
            mean_area: mean_area(species, crown),
            vertical_scale: tables.vertical_scale,
            sky_path: forest::sky_path(tables) as f32,
            hole: tables.hole,
            max_thickness: tables.max_thickness,
            listed_density: maps[k].as_ref().map_or(0.0, |m| m.listed as f32),
            ..bytemuck::Zeroable::zeroed()
        });
    }
    rows
}
