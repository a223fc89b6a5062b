//! Bakes on disk, each artefact in a file of its own under a key of what it is made of, so that one knob does not bake all anew:
//!
//! - `.zfield`, the depth views with their occlusion, and the measured crown and optics: of the model and the knobs of views. All
//!   else is made from these.
//! - `.transfer`, the light transfer of the views: of these, of its texels and of the number of bands, whose coefficients are fitted together.
//! - `.indirect`, light that met more than one surface ([`super::indirect`]): of a forest, its
//!   models, their reflectances and densities, and the ground.
//! - `.levels`, coarser meshes ([`super::levels`]): of the model.
//! - `.envelopes`, the crown around each leaf ([`super::envelope`]): of the model and of the number of directions.
//! - `.harmonics`, how light comes to the faces of a model ([`super::harmonics`]): of the model.
//! - `.cards`, a cloud of cards ([`super::cards`]): of the model and of the knobs of cards.
//! - `.shells`, forest far away as slices ([`super::shells`]): of a forest's models, reflectances, scales, densities and point pattern.
//! - `.forest`, the tables of far forests ([`super::tables`]): of both.

use std::path::{Path, PathBuf};

use super::cards::{self, CardCloud, CloudSettings};
use super::envelope::{Envelopes, Parts, RAYS};
use super::file::{Fields, Format, load_or_build};
use super::harmonics::{self, Harmonics};
use super::hiding::HEIGHTS;
use super::indirect::{self, Mix};
use super::levels::{self, Levels};
use super::surface::Surface;
use super::{
    BakeSettings, ForestSettings, SpeciesBake, Turned, bake_transfer, bake_views, check, load_or_measure,
};
use crate::Result;
use crate::physics::correction::{Correction, TERMS};
use crate::physics::crown::{Crown, Frame};
use crate::physics::indirect::{COEFFICIENTS, Indirect};
use crate::physics::leaf::Directions;
use crate::physics::tables::ForestTables;
use crate::physics::transfer::Transfer;
use crate::physics::views;
use crate::physics::zfield::ZField;
use crate::scene::{Mesh, OpticsOverride, Texture};

const VIEWS: Format = Format { magic: *b"CANOPYZF", version: 14, extension: "zfield" };
const TRANSFER: Format = Format { magic: *b"CANOPYLT", version: 4, extension: "transfer" };
const INDIRECT: Format = Format { magic: *b"CANOPYIL", version: 14, extension: "indirect" };
const ENVELOPES: Format = Format { magic: *b"CANOPYLE", version: 5, extension: "envelopes" };
/// Numbers at the head of a file of views.
const SCALARS: usize = 23 + 4 * TERMS;

/// Where a bake came from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CacheState {
    /// Read from the cache.
    Hit,
    /// Not in the cache (or there is none): baked.
    Baked,
    /// The cached file was damaged: baked again.
    Rebuilt,
}

impl CacheState {
    /// In a word, for reports.
    pub fn name(self) -> &'static str {
        match self {
            CacheState::Hit => "hit",
            CacheState::Baked => "baked",
            CacheState::Rebuilt => "rebuilt",
        }
    }
}

/// The user's cache directory: `$CANOPY_CACHE`, else `$XDG_CACHE_HOME/canopy`, else `~/.cache/canopy`; `None`
/// if none of these variables is set.
pub fn default_dir() -> Option<PathBuf> {
    let var = |name| std::env::var_os(name).filter(|v| !v.is_empty()).map(PathBuf::from);
    var("CANOPY_CACHE")
        .or_else(|| var("XDG_CACHE_HOME").map(|d| d.join("canopy")))
        .or_else(|| var("HOME").map(|d| d.join(".cache").join("canopy")))
}

/// A species to bake, and where its bakes are kept.
///
/// A cache that is damaged or cannot be written costs time and a line on the standard error (none when quiet), never the
/// result.
pub struct Source<'a> {
    mesh: &'a Mesh,
    optics: &'a OpticsOverride,
    settings: BakeSettings,
    dir: Option<&'a Path>,
    quiet: bool,
    views: [u8; 32],
    transfer: Option<[u8; 32]>,
}

impl<'a> Source<'a> {
    /// A mesh to be baked with some settings; with `None` for a cache nothing is read or written.
    ///
    /// # Errors
    /// [`crate::Error::Usage`] for settings out of range.
    pub fn new(
        mesh: &'a Mesh,
        optics: &'a OpticsOverride,
        settings: &BakeSettings,
        dir: Option<&'a Path>,
        quiet: bool,
    ) -> Result<Self> {
        check(settings)?;
        let views = views_key(mesh, optics, settings);
        let transfer = transfer_key(&views, settings);
        Ok(Source { mesh, optics, settings: *settings, dir, quiet, views, transfer })
    }

    /// The bake without light transfer, from the cache if it is there, else baked and put there.
    ///
    /// # Errors
    /// Those of [`bake_views`].
    pub fn load_views(&self) -> Result<(SpeciesBake, CacheState)> {
        let sizes: Vec<usize> = std::iter::once(4 * SCALARS)
            .chain(level_sizes(self.settings.rings, self.settings.resolution))
            .collect();
        load_or_build(
            (self.dir, &VIEWS, &self.views),
            &sizes,
            |parts| decode(parts, &self.settings),
            |bake, put| {
                put(&scalars(bake).map(f32::to_le_bytes).concat())?;
                bake.views.levels.iter().try_for_each(|l| put(l))
            },
            || bake_views(self.mesh, self.optics, &self.settings, self.quiet),
            self.quiet,
        )
    }

    /// Gives a bake its light transfer, likewise; `None` if the settings ask for none.
    ///
    /// # Errors
    /// Those of [`bake_transfer`].
    pub fn load_transfer(&self, bake: &mut SpeciesBake) -> Result<Option<CacheState>> {
        let Some(key) = &self.transfer else { return Ok(None) };
        let (bands, resolution) = (self.settings.transfer_bands, self.settings.transfer_resolution);
        let band: Vec<usize> = level_sizes(self.settings.rings, resolution).collect();
        let (transfer, state) = load_or_build(
            (self.dir, &TRANSFER, key),
            &[&[8 * TERMS][..], &band.repeat(bands as usize)].concat(),
            |parts| {
                let sent: Vec<f32> =
                    parts[0].as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect();
                let sent = Correction::from_coefficients(std::array::from_fn(|i| sent[i]));
                let bands = parts[1..].chunks(band.len()).map(<[_]>::to_vec).collect();
                Transfer { resolution, bands, sent }
            },
            |transfer, put| {
                put(&transfer.sent.coefficients().map(f32::to_le_bytes).concat())?;
                transfer.bands.iter().flatten().try_for_each(|l| put(l))
            },
            || bake_transfer(self.mesh, bake, &self.settings, self.quiet),
            self.quiet,
        )?;
        bake.transfer = transfer;
        Ok(Some(state))
    }

    /// The crown around each leaf in a number of directions, likewise.
    ///
    /// # Errors
    /// [`crate::Error::Usage`] for a mesh without extent, or a number of directions that there is no rule of.
    pub fn load_envelopes(&self, directions: u32) -> Result<(Envelopes, CacheState)> {
        let wrong =
            || crate::Error::Usage(format!("{directions} directions of a leaf; there are 8, 14 or 26"));
        let rule = Directions::new(directions as usize).ok_or_else(wrong)?;
        let surface = Surface::new(self.mesh)?;
        let parts = Parts::new(self.mesh, &surface);
        load_or_build(
            (self.dir, &ENVELOPES, &envelopes_key(self.mesh, directions)),
            &[2 * 4 * parts.count * rule.len(), 4 * HEIGHTS * rule.len()],
            |read| Envelopes {
                parts: parts.clone(),
                thickness: floats(&read[0]),
                directions: rule.len(),
                hiding: floats(&read[1]),
            },
            |built, put| {
                put(&bytes(&built.thickness))?;
                put(&bytes(&built.hiding))
            },
            || Ok(Envelopes::new(&surface, parts.clone(), &rule, RAYS, self.quiet)),
            self.quiet,
        )
    }

    /// Its mesh's levels of detail, likewise.
    ///
    /// # Errors
    /// [`crate::Error::Usage`] for a mesh without extent.
    pub fn load_levels(&self) -> Result<(Levels, CacheState)> {
        levels::file::load(self.mesh, self.dir, self.quiet)
    }

    /// How light comes to its faces, likewise.
    ///
    /// # Errors
    /// [`crate::Error::Usage`] for a mesh without extent.
    pub fn load_harmonics(&self) -> Result<(Harmonics, CacheState)> {
        harmonics::file::load(self.mesh, self.dir, self.quiet)
    }

    /// A cloud of cards, to whose faces light comes so, likewise.
    ///
    /// # Errors
    /// Those of [`CardCloud::new`].
    pub fn load_cards(&self, light: &Harmonics, settings: CloudSettings) -> Result<(CardCloud, CacheState)> {
        cards::file::load(self.mesh, light, settings, self.dir, self.quiet)
    }

    /// The tables of a forest of the species, likewise. Light transfer has a part in them: where they have to be measured, the
    /// bake gets its own first, if it has none, and `transfer` says from where.
    ///
    /// # Errors
    /// Those of [`load_or_measure`] and [`Source::load_transfer`].
    pub fn load_tables(
        &self,
        forest: &ForestSettings,
        bake: &mut SpeciesBake,
        transfer: &mut Option<CacheState>,
    ) -> Result<(ForestTables, CacheState)> {
        let whole = move || {
            let bake = bake;
            if transfer.is_none() {
                *transfer = self.load_transfer(bake)?;
            }
            Ok(&*bake)
        };
        load_or_measure((self.dir, &self.key()), forest, whole, self.quiet)
    }

    /// BLAKE3 of everything that its views depend on.
    pub fn views_key(&self) -> [u8; 32] {
        self.views
    }

    /// BLAKE3 of everything that the whole bake depends on.
    pub fn key(&self) -> [u8; 32] {
        self.transfer.unwrap_or(self.views)
    }

    /// The file of the views, if there is a cache.
    pub fn views_path(&self) -> Option<PathBuf> {
        Some(VIEWS.path(self.dir?, &self.views))
    }

    /// The file of the light transfer, if there is a cache and the settings ask for any.
    pub fn transfer_path(&self) -> Option<PathBuf> {
        Some(TRANSFER.path(self.dir?, self.transfer.as_ref()?))
    }
}

/// BLAKE3 of everything that the light transfer of some views depends on; `None` without bands.
fn transfer_key(views: &[u8; 32], settings: &BakeSettings) -> Option<[u8; 32]> {
    let mut fields = Fields::new("canopy light transfer");
    fields.put(&TRANSFER.version.to_le_bytes());
    fields.put(&settings.transfer_bands.to_le_bytes());
    // The half of the views' texels is not named: it is what all had before there was a choice.
    if 2 * settings.transfer_resolution != settings.resolution {
        fields.put(&settings.transfer_resolution.to_le_bytes());
    }
    fields.put(views);
    (settings.transfer_bands > 0).then(|| fields.key())
}

/// Numbers of single precision, as they are kept.
pub(super) fn floats(bytes: &[u8]) -> Vec<f64> {
    bytes.as_chunks::<4>().0.iter().map(|b| f64::from(f32::from_le_bytes(*b))).collect()
}

pub(super) fn bytes(floats: &[f64]) -> Vec<u8> {
    floats.iter().flat_map(|x| (*x as f32).to_le_bytes()).collect()
}

/// BLAKE3 of everything that the envelopes of a mesh depend on.
fn envelopes_key(mesh: &Mesh, directions: u32) -> [u8; 32] {
    let mut fields = Fields::new("canopy leaf envelopes");
    for x in [ENVELOPES.version, directions, RAYS] {
        fields.put(&x.to_le_bytes());
    }
    put_mesh(&mut fields, mesh);
    fields.key()
}

/// Light that met more than one surface, of a species of a forest, from the cache if it is there, else measured and put there.
///
/// # Errors
/// [`crate::Error::Usage`] for a mesh without extent.
pub fn load_indirect(
    dir: Option<&Path>,
    mix: &Mix,
    species: usize,
    quiet: bool,
) -> Result<(Indirect, CacheState)> {
    load_or_build(
        (dir, &INDIRECT, &indirect_key(mix, species)),
        &[4, 3 * 4 * COEFFICIENTS * mix.nodes as usize],
        |read| {
            let all: Vec<[f32; 3]> = bytemuck::pod_collect_to_vec(&read[1]);
            let nodes = all.as_chunks::<COEFFICIENTS>().0.to_vec();
            Indirect { max_thickness: floats(&read[0])[0] as f32, nodes }
        },
        |built, put| {
            put(&built.max_thickness.to_le_bytes())?;
            built.nodes.iter().try_for_each(|node| put(bytemuck::cast_slice(node)))
        },
        || indirect::measure(mix, species, quiet),
        quiet,
    )
}

/// BLAKE3 of everything that light which met more than one surface depends on.
fn indirect_key(mix: &Mix, species: usize) -> [u8; 32] {
    let mut fields = Fields::new("canopy indirect light");
    for x in [INDIRECT.version, mix.nodes, mix.rays, u32::from(mix.poisson), species as u32] {
        fields.put(&x.to_le_bytes());
    }
    fields.put(bytemuck::bytes_of(&mix.ground));
    for kind in &mix.kinds {
        fields.put(&kind.density.to_le_bytes());
        fields.put(bytemuck::bytes_of(&kind.scale));
        fields.put(&kind.key);
    }
    fields.key()
}

/// BLAKE3 of everything that views depend on: geometry, masks and colours, optical overrides, the knobs of views and
/// the version of the bake. Vertex normals, material names and light transfer have no part in it.
pub fn views_key(mesh: &Mesh, optics: &OpticsOverride, settings: &BakeSettings) -> [u8; 32] {
    let mut fields = Fields::new("canopy species bake");
    let mut put = |bytes: &[u8]| fields.put(bytes);
    put(&VIEWS.version.to_le_bytes());
    // Bands of light transfer once stood at the end: with none it is the key that views without them have always had, also as
    // the identity of models in the results of benches.
    for x in [settings.rings, settings.resolution, settings.occlusion_rays, 0] {
        put(&x.to_le_bytes());
    }
    for rgb in [optics.leaf_reflectance, optics.leaf_transmittance, optics.bark_reflectance] {
        put(rgb.as_ref().map_or(&[], bytemuck::bytes_of));
    }
    put(optics.extinction.as_ref().map_or(&[], bytemuck::bytes_of));
    put_mesh(&mut fields, mesh);
    fields.key()
}

/// Geometry, masks and colours of a mesh.
pub(super) fn put_mesh(fields: &mut Fields, mesh: &Mesh) {
    let mut put = |bytes: &[u8]| fields.put(bytes);
    put(bytemuck::cast_slice(&mesh.positions));
    put(bytemuck::cast_slice(&mesh.uvs));
    let triangles: Vec<[u32; 4]> =
        mesh.triangles.iter().map(|t| [t.vertices[0], t.vertices[1], t.vertices[2], t.material]).collect();
    put(bytemuck::cast_slice(&triangles));
    for m in &mesh.materials {
        put(&[u8::from(m.foliage), u8::from(m.double_sided)]);
        put(bytemuck::bytes_of(&m.base_color));
        put(m.alpha_cutoff.as_ref().map_or(&[], bytemuck::bytes_of));
        let mut put_texture = |texture| {
            let (size, rgba) = Texture::content(texture);
            put(bytemuck::bytes_of(&size));
            put(rgba);
        };
        put_texture(&m.texture);
        if let Some(t) = &m.transmission {
            put_texture(&t.factor_texture);
            put_texture(&t.color_texture);
            put(bytemuck::bytes_of(&t.factor));
            put(bytemuck::bytes_of(&t.color));
        }
    }
}

fn scalars(b: &SpeciesBake) -> [f32; SCALARS] {
    let ([r0, r1, r2], [t0, t1, t2], [b0, b1, b2]) = (b.reflectance, b.transmittance, b.bark_reflectance);
    let Crown {
        frame: Frame { centre, half_width, half_height },
        radius,
        base,
        height,
        leaf_shadow,
        extinction,
        lit,
        sent,
    } = b.crown;
    let Turned { reflected, slope, passed, bark_reflected, bark_share } = b.turned;
    #[rustfmt::skip]
    let all = [
        centre, half_width, half_height, reflected, slope, passed, bark_reflected, bark_share, leaf_shadow, extinction,
        r0, r1, r2, t0, t1, t2, b0, b1, b2, b.area, radius, base, height,
    ];
    let corrections = [lit, sent].map(|c| c.coefficients());
    let mut scalars = [0.0; SCALARS];
    scalars.iter_mut().zip(all.iter().chain(corrections.iter().flatten())).for_each(|(to, from)| *to = *from);
    scalars
}

/// Bytes of every mip level of `rings` rings of views of `resolution`² texels.
fn level_sizes(rings: u32, resolution: u32) -> impl Iterator<Item = usize> {
    let count = views::count(rings) as usize;
    (0..=resolution.ilog2()).map(move |l| count * 4 * (resolution as usize >> l).pow(2))
}

fn decode(mut parts: Vec<Vec<u8>>, settings: &BakeSettings) -> SpeciesBake {
    let levels = parts.split_off(1);
    let mut x = [0f32; SCALARS];
    for (x, from) in x.iter_mut().zip(parts[0].as_chunks::<4>().0) {
        *x = f32::from_le_bytes(*from);
    }
    #[rustfmt::skip]
    let [
        centre, half_width, half_height, reflected, slope, passed, bark_reflected, bark_share, leaf_shadow, extinction,
        r0, r1, r2, t0, t1, t2, b0, b1, b2, area, radius, base, height, ..
    ] = x;
    let [lit, sent] = [SCALARS - 4 * TERMS, SCALARS - 2 * TERMS]
        .map(|first| Correction::from_coefficients(std::array::from_fn(|i| x[first + i])));
    let frame = Frame { centre, half_width, half_height };
    SpeciesBake {
        views: ZField { n: settings.rings, resolution: settings.resolution, levels },
        transfer: Transfer::default(),
        crown: Crown { frame, radius, base, height, leaf_shadow, extinction, lit, sent },
        turned: Turned { reflected, slope, passed, bark_reflected, bark_share },
        reflectance: [r0, r1, r2],
        transmittance: [t0, t1, t2],
        bark_reflectance: [b0, b1, b2],
        area,
    }
}
