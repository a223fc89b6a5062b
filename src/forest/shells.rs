//! Slices of a forest on the GPU (Behrendt et al. 2005, section 3): all stacks of all Wang tiles in one array, and what they are of.

use super::species::mean_area;
use crate::bake::Baked;
use crate::bake::shells::{FREE_RANGE, Shells};
use crate::gpu::interface::{COVER_GROUPS, FREE_SCALE, MAX_SPECIES, ShellTable};
use crate::gpu::{Buffer, Gpu, Image};
use crate::land::pattern::TILES;
use crate::plan::names::resource;
use crate::plan::{Plan, SHELL_LIGHTS};
use crate::scene::Scene;
use crate::{Error, Result};

/// Layers of four channels.
const GROUPS: usize = COVER_GROUPS as usize;
const _: () = assert!(GROUPS * 4 > MAX_SPECIES as usize);
const _: () = assert!(FREE_SCALE == FREE_RANGE as f32);

/// What slices are drawn from.
pub struct ShellData {
    /// A [`ShellTable`].
    pub table: Buffer,
    /// Cover at a quarter, a half, three quarters and all of the full density; a layer a tile and slice of each stack, from the finest
    /// stack to that of one slice.
    pub covers: Image,
    /// Reflectance and share of leaves, likewise.
    pub reflectances: Image,
    /// Transmittance and height, likewise.
    pub transmittances: Image,
    /// How light comes to that, four numbers an image.
    pub lights: [Image; SHELL_LIGHTS],
    /// Number of species.
    pub species: u32,
    content: ShellTable,
}

impl ShellData {
    /// Uploads the shells of a plan that ends with them.
    ///
    /// # Errors
    /// [`Error::Usage`] for bakes without shells, or with others than the plan lists; [`Error::Device`] when out of memory.
    pub fn new(gpu: &Gpu, scene: &Scene, plan: &Plan, baked: &[Baked]) -> Result<Self> {
        let wanted = (&scene.settings).into();
        let shells = baked.first().and_then(|b| b.shells.as_deref()).filter(|s| s.settings == wanted);
        let missing = || Error::Usage("the scene was baked without the shells that the plan lists".into());
        let shells = shells.ok_or_else(missing)?;
        let image = |name| gpu.image(plan.images(name).next().ok_or_else(missing)?);
        let lights = plan.images(resource::SHELL_LIGHTS).map(|d| gpu.image(d)).collect::<Result<Vec<_>>>()?;
        let data = ShellData {
            table: gpu.described_buffer(&plan.buffer(resource::SHELL_TABLE))?,
            covers: image(resource::SHELL_COVERS)?,
            reflectances: image(resource::SHELL_REFLECTANCES)?,
            transmittances: image(resource::SHELL_TRANSMITTANCES)?,
            lights: lights.try_into().map_err(|_| missing())?,
            species: scene.species.len() as u32,
            content: content(scene, baked, shells),
        };
        data.upload(gpu, shells)?;
        data.set_ranges(gpu, plan)?;
        Ok(data)
    }

    /// Takes the distances of another plan.
    ///
    /// # Errors
    /// [`Error::Device`] if the device fails.
    pub fn set_ranges(&self, gpu: &Gpu, plan: &Plan) -> Result<()> {
        let mut nearness = [[0.0; 4]; GROUPS];
        for (k, range) in plan.species_range.iter().enumerate().filter(|(_, r)| **r > 0.0) {
            nearness[(k + 1) / 4][(k + 1) % 4] = (1.0 / range) as f32;
        }
        let begin = plan.shells_from() as f32;
        gpu.upload(&self.table, 0, &[ShellTable { nearness, begin, ..self.content }])
    }

    /// Slices of the stack that shows what is at a distance, m, where one that would be so many units high at one metre is to be one high at
    /// least.
    pub fn slices(&self, distance: f64, units_at_1m: f64) -> u32 {
        let fit = f64::from(self.content.height) * units_at_1m / distance.max(1e-3);
        // A hair more, for the shader reckons in singles.
        let detail = (1.001 * fit).log2().clamp(0.0, f64::from(self.content.slices.ilog2()));
        1 << detail.ceil() as u32
    }

    /// All levels and mips.
    fn upload(&self, gpu: &Gpu, shells: &Shells) -> Result<()> {
        let (mut first, mut slices) = (0, shells.settings.slices);
        for (seen, light) in shells.levels.iter().zip(&shells.light) {
            let layers = TILES as u32 * slices;
            for (level, mip) in (0u32..).zip(seen) {
                gpu.upload_image(&self.covers, level, first, layers, &mip.cover)?;
                gpu.upload_image(&self.reflectances, level, first, layers, &mip.reflected)?;
                gpu.upload_image(&self.transmittances, level, first, layers, &mip.passed)?;
            }
            for (level, mip) in (0u32..).zip(light) {
                for (image, texels) in self.lights.iter().zip(&mip.images) {
                    gpu.upload_image(image, level, first, layers, texels)?;
                }
            }
            (first, slices) = (first + layers, slices / 2);
        }
        Ok(())
    }
}

/// All of a table that no plan changes.
fn content(scene: &Scene, baked: &[Baked], shells: &Shells) -> ShellTable {
    let full: f64 = scene.species.iter().map(|s| s.full_density([1.0; 2])).sum();
    let mut shares = [[0.0; 4]; GROUPS];
    for (k, (species, bake)) in scene.species.iter().zip(baked).enumerate() {
        // Channels are densities times mean areas, behind the coverage.
        let area = f64::from(mean_area(species, &bake.species.crown));
        shares[(k + 1) / 4][(k + 1) % 4] = (1.0 / (area * full)) as f32;
    }
    let [reflectance, transmittance] = shells.most;
    ShellTable {
        shares,
        sun: std::array::from_fn(|i| {
            std::array::from_fn(|j| shells.sun[i / 5].coefficients[4 * (i % 5) + j])
        }),
        reflectance,
        transmittance,
        height: shells.height,
        tile_side: shells.tile_side as f32,
        spread: scene.settings.shell_slice_pixels,
        slices: shells.settings.slices,
        texels: shells.settings.texels,
        seed: scene.seed,
        ..bytemuck::Zeroable::zeroed()
    }
}
