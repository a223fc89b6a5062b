//! Shell textures (Behrendt et al. 2005, section 3): forest far away as a stack of level slices over the ground, tile by tile.
//!
//! A patch of forest for each of the sixteen Wang tiles of the scene's pattern ([`Patch`]) is cut into slabs that are painted from above
//! (`slices.rs`), and slices are merged two by two into a pyramid (`pyramid.rs`). [`verify`] holds the stack against rays cast at the same
//! trees.
//!
//! **What a stack cannot be.** Slices are seen from above: of what stands upright, as trunks do, they show next to nothing, and a ray that
//! comes in low meets as many slices as one from above, where forest would hide more; `verify.rs` has the two ways around that, and measures
//! them. At a lower density than the full one the mix of species stays, and so do the optics of what is seen.

mod coarse;
mod edges;
mod file;
mod light;
mod lit;
mod march;
mod patch;
mod picture;
mod pyramid;
mod seams;
mod slices;
mod sun;
mod verify;

use std::path::Path;

use glam::Vec2;
use rayon::prelude::*;

pub use coarse::Coarse;
pub use edges::Near;
pub use light::{FREE_RANGE, FREE_RAYS, LIGHT, LIGHT_IMAGES, LIGHT_TEXELS, LightMip, Lights};
pub use lit::{Lit, Told};
pub use march::{March, Stack, at_share};
pub use patch::{Image, Patch};
pub use picture::picture;
pub use pyramid::{Slices, Texel, VALUES};
pub use seams::Seam;
pub use slices::{Kind, SAMPLES, SHARES, Samples, Seen, Window};
pub use sun::{SUN_RAYS, SunCorrections, SunTold};
pub use verify::{Agreement, Quality, Verified, verify};

use super::CacheState;
use super::optics::{Colours, colours};
use crate::land::pattern::TILES;
use crate::progress::Progress;
use crate::scene::Scene;
use crate::settings::Settings;
use crate::{Error, Result};

/// Rows of texels that are painted at once: so many samples of all slices are held.
const BAND: u32 = 16;
/// Colours of trees are their species' times as much at most.
const TINT: f32 = 1.15;

/// What is asked of shells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ShellSettings {
    /// Slices of the finest stack: a power of two, 2 to 32.
    pub slices: u32,
    /// Texels a side of a tile: a power of two, 16 to 256.
    pub texels: u32,
}

impl Default for ShellSettings {
    fn default() -> Self {
        ShellSettings { slices: 16, texels: 128 }
    }
}

impl From<&Settings> for ShellSettings {
    fn from(s: &Settings) -> Self {
        ShellSettings { slices: s.shell_slices, texels: s.shell_texels }
    }
}

impl ShellSettings {
    fn check(self) -> Result<()> {
        let fits = |n: u32, low: u32, high: u32| n.is_power_of_two() && (low..=high).contains(&n);
        // The most of both are 1.1 GiB.
        if fits(self.slices, 2, 32) && fits(self.texels, 16, 256) {
            return Ok(());
        }
        Err(Error::Usage(format!(
            "cannot make shells of {} slices of {} texels: powers of two, 2 to 32 slices and 16 to 256 texels",
            self.slices, self.texels
        )))
    }
}

/// One mip of one level: three images of four bytes a texel, of `TILES × slices` layers (all slices of tile 0 from the ground up, then of
/// tile 1, …), rows from the south.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mip {
    /// Texels a side.
    pub side: u32,
    /// Cover at 1/4, 2/4, 3/4 and all of the full density, × 255.
    pub cover: Vec<u8>,
    /// Reflectance RGB over [`Shells::most`] and share of leaves, both premultiplied, × 255.
    pub reflected: Vec<u8>,
    /// Transmittance RGB over [`Shells::most`] and height over [`Shells::height`], both premultiplied, × 255.
    pub passed: Vec<u8>,
}

impl Mip {
    /// The images, in the order of files.
    fn images(&self) -> [&Vec<u8>; 3] {
        [&self.cover, &self.reflected, &self.passed]
    }
}

/// Shell textures of a scene's forest.
#[derive(Clone, Debug, PartialEq)]
pub struct Shells {
    /// What they were made with.
    pub settings: ShellSettings,
    /// Side of a tile, m.
    pub tile_side: f64,
    /// Height of the stack, m: that of the tallest tree. Slice k of n stands at (k + ½)/n of it.
    pub height: f32,
    /// Reflectance and transmittance that a byte of 255 stands for, linear RGB.
    pub most: [[f32; 3]; 2],
    /// By level, from all slices to one, each with its mips from the finest to one texel a tile.
    pub levels: Vec<Vec<Mip>>,
    /// What texels leave out of the sun on what is seen.
    pub sun: SunCorrections,
    /// How light comes there, by level, each with its mips from the finest, [`LIGHT_TEXELS`] times as coarse as that of cover, to one texel a tile.
    pub light: Vec<Vec<LightMip>>,
}

/// A scene's forest as shells are made of it.
pub struct Forest {
    /// Its species.
    pub kinds: Vec<Kind>,
    /// Their reflectances.
    colours: Vec<Colours>,
    /// The patches.
    pub patch: Patch,
    /// Height of the tallest tree, m.
    pub height: f32,
}

impl Forest {
    /// The forest of a scene.
    ///
    /// # Errors
    /// As [`Patch::new`], and [`Error::Usage`] for a model without extent.
    pub fn new(scene: &Scene) -> Result<Self> {
        let kinds = scene.species.iter().map(|s| Kind::new(&s.mesh)).collect::<Result<Vec<_>>>()?;
        let reaches: Vec<f32> = kinds.iter().map(|k| k.reach).collect();
        let patch = Patch::new(scene, &reaches)?;
        let grown = |s: &crate::scene::Species, k: &Kind| s.scale[1] * k.height;
        let standing = scene.species.iter().zip(&kinds).filter(|(s, _)| s.full_density([1.0; 2]) > 0.0);
        Ok(Forest {
            height: standing.map(|(s, k)| grown(s, k)).fold(0.0, f32::max),
            colours: scene
                .species
                .iter()
                .zip(&kinds)
                .map(|(s, k)| colours(&s.mesh, &k.surface, &s.optics))
                .collect(),
            kinds,
            patch,
        })
    }

    /// Largest reflectance and transmittance of any tree, linear RGB.
    fn most(&self) -> [[f32; 3]; 2] {
        let of = |value: &dyn Fn(&Colours) -> [f32; 3]| {
            let each = self.colours.iter().map(value);
            let most = each.fold([1e-6f32; 3], |a, b| std::array::from_fn(|i| a[i].max(b[i])));
            most.map(|m| (TINT * m).min(1.0))
        };
        let reflected = |c: &Colours| std::array::from_fn(|i| c.reflectance[i].max(c.bark_reflectance[i]));
        [of(&reflected), of(&|c| c.transmittance)]
    }

    /// What a texel keeps of a surface of a tree of a tile, in a stack of so many slices.
    fn values(&self, image: &Image, seen: &Seen, slices: u32) -> [f32; VALUES] {
        let (species, tint) = (image.tree.species as usize, image.tree.tint);
        let colours = &self.colours[species];
        let leaf = self.kinds[species].leaf[seen.face as usize];
        let (r, t) = if leaf {
            (colours.reflectance, colours.transmittance)
        } else {
            (colours.bark_reflectance, [0.0; 3])
        };
        // No tint makes a surface scatter more than it gets.
        let tint: [f32; 3] = std::array::from_fn(|i| tint.min(1.0 / (r[i] + t[i]).max(1e-6)));
        let [r0, r1, r2] = std::array::from_fn(|i| r[i] * tint[i]);
        let [t0, t1, t2] = std::array::from_fn(|i| t[i] * tint[i]);
        [r0, r1, r2, f32::from(u8::from(leaf)), t0, t1, t2, seen.height / slices as f32]
    }

    /// The finest slices of a tile. Painted by bands of rows, for no one needs the samples of all rows at once; `show` gets those of each band.
    pub fn tile(&self, kind: usize, settings: ShellSettings, mut show: impl FnMut(&Samples)) -> Slices {
        let ShellSettings { slices, texels } = settings;
        let texel = self.patch.side as f32 / texels as f32;
        let size = (texels * texels) as usize;
        let none = vec![Texel::default(); size * slices as usize];
        let mut all = Slices { side: texels as usize, texels: none, above: Vec::with_capacity(size) };
        for first in (0..texels).step_by(BAND as usize) {
            let low = Vec2::new(0.0, first as f32 * texel);
            let window = Window { low, texel, size: [texels, BAND], slices, height: self.height };
            let images = &self.patch.tiles[kind];
            let samples = Samples::paint(&self.kinds, images, window);
            let value = |seen: &Seen| self.values(&images[seen.tree as usize], seen, slices);
            let rows = (BAND * texels) as usize;
            for (slice, from) in samples.texels(value).chunks_exact(rows).enumerate() {
                let at = slice * size + (first * texels) as usize;
                let to = all.texels[at..at + rows].iter_mut().zip(from);
                to.for_each(|(to, (cover, values))| *to = Texel { cover: *cover, values: *values });
            }
            all.above.extend(samples.above());
            show(&samples);
        }
        all
    }
}

impl Shells {
    /// Makes them, on all threads of the current rayon pool; the result is the same bits for any number of them. How light comes to the faces of
    /// the species is in the cache in `dir`, or made and put there.
    ///
    /// # Errors
    /// [`Error::Usage`] for settings out of range, and as [`Forest::new`].
    pub fn bake(scene: &Scene, settings: ShellSettings, dir: Option<&Path>, quiet: bool) -> Result<Self> {
        settings.check()?;
        let forest = Forest::new(scene)?;
        let lights = Lights::new(scene, &forest, dir, quiet)?;
        let mut shells = Shells::of(&forest, &lights, settings, quiet);
        shells.sun = sun::measure(scene.seed, &forest, &lights.foliage, &shells);
        Ok(shells)
    }

    /// Those of a forest.
    fn of(forest: &Forest, lights: &Lights, settings: ShellSettings, quiet: bool) -> Self {
        let progress = Progress::new("baking shells", TILES as u64, quiet);
        let most = forest.most();
        let of = |kind| {
            let mut light = lights.tile(forest, kind, settings);
            let finest = forest.tile(kind, settings, |samples| light.add(samples));
            let light = levels(light.slices(&finest), LightMip::new);
            progress.step(1);
            (levels(finest, |slices| quantised(slices, most)), light)
        };
        let tiles: Vec<_> = (0..TILES).into_par_iter().map(of).collect();
        progress.finish();
        let mut shells = Shells {
            settings,
            tile_side: forest.patch.side,
            height: forest.height,
            most,
            sun: SunCorrections::default(),
            levels: empty(settings),
            light: LightMip::empty(settings),
        };
        for (levels, light) in &tiles {
            for (to, from) in shells.levels.iter_mut().flatten().zip(levels.iter().flatten()) {
                to.cover.extend(&from.cover);
                to.reflected.extend(&from.reflected);
                to.passed.extend(&from.passed);
            }
            for (to, from) in shells.light.iter_mut().flatten().zip(light.iter().flatten()) {
                to.images.iter_mut().zip(&from.images).for_each(|(to, from)| to.extend(from));
            }
        }
        shells
    }

    /// The same from the cache in `dir` if it is there, else made and put there.
    ///
    /// # Errors
    /// As [`Shells::bake`].
    pub fn load(
        scene: &Scene,
        settings: ShellSettings,
        dir: Option<&Path>,
        quiet: bool,
    ) -> Result<(Self, CacheState)> {
        settings.check()?;
        file::load(scene, settings, dir, quiet)
    }

    /// Bytes of all images.
    pub fn bytes(&self) -> u64 {
        self.images().map(|image| image.len() as u64).sum()
    }

    /// All images, in the order of files.
    fn images(&self) -> impl Iterator<Item = &Vec<u8>> {
        let light = self.light.iter().flatten().flat_map(|mip| &mip.images);
        self.levels.iter().flatten().flat_map(Mip::images).chain(light)
    }
}

/// Levels and mips of one tile, as bytes.
fn levels<const N: usize, T>(finest: Slices<N>, bytes: impl Fn(&Slices<N>) -> T) -> Vec<Vec<T>> {
    let halved = |s: &Slices<N>| (s.side > 1).then(|| s.halved());
    let merged = |s: &Slices<N>| (s.texels.len() > s.above.len()).then(|| s.merged());
    let mut levels: Vec<Vec<T>> = Vec::new();
    for mip in std::iter::successors(Some(finest), halved) {
        for (level, slices) in std::iter::successors(Some(mip.fitted()), merged).enumerate() {
            if levels.len() == level {
                levels.push(Vec::new());
            }
            levels[level].push(bytes(&slices));
        }
    }
    levels
}

/// Slices as bytes.
fn quantised(slices: &Slices, [reflectance, transmittance]: [[f32; 3]; 2]) -> Mip {
    let mut mip = Mip { side: slices.side as u32, ..Mip::default() };
    let byte = |v: f32| (255.0 * v.clamp(0.0, 1.0) + 0.5) as u8;
    for t in &slices.texels {
        let [r0, r1, r2, leaf, t0, t1, t2, height] = t.values;
        let over = |v: [f32; 3], most: [f32; 3]| [0, 1, 2].map(|i| byte(v[i] / most[i]));
        mip.cover.extend(t.cover.map(byte));
        mip.reflected.extend(over([r0, r1, r2], reflectance));
        mip.reflected.push(byte(leaf));
        mip.passed.extend(over([t0, t1, t2], transmittance));
        mip.passed.push(byte(height));
    }
    mip
}

/// Levels and mips of these settings, without texels.
fn empty(settings: ShellSettings) -> Vec<Vec<Mip>> {
    let mips = || (0..=settings.texels.ilog2()).map(|m| Mip { side: settings.texels >> m, ..Mip::default() });
    (0..=settings.slices.ilog2()).map(|_| mips().collect()).collect()
}

#[cfg(test)]
mod light_tests;
#[cfg(test)]
mod tests;
