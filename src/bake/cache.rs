//! Bakes on disk, keyed by content: the scalars of [`SpeciesBake`], then the bytes of every mip level.

use std::path::{Path, PathBuf};

use super::file::{Fields, Format, load_or_build};
use super::{BakeSettings, SpeciesBake, Turned, bake_species, check};
use crate::Result;
use crate::physics::crown::{Crown, Frame};
use crate::physics::transfer::Transfer;
use crate::physics::views;
use crate::physics::zfield::ZField;
use crate::scene::{Mesh, OpticsOverride};

const FORMAT: Format = Format { magic: *b"CANOPYZF", version: 13, extension: "zfield" };
const SCALARS: usize = 23;

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

/// The bake of a mesh, from the cache in `cache_dir` if it is there, else baked and put there. With `None`
/// nothing is read or written.
///
/// A cache that is damaged or cannot be written costs time and a line on the standard error (none when
/// `quiet`), never the result. Errors are those of [`bake_species`].
pub fn load_or_bake(
    mesh: &Mesh,
    optics: &OpticsOverride,
    settings: &BakeSettings,
    cache_dir: Option<&Path>,
    quiet: bool,
) -> Result<(SpeciesBake, CacheState)> {
    check(settings)?;
    if cache_dir.is_none() {
        return Ok((bake_species(mesh, optics, settings, quiet)?, CacheState::Baked));
    }
    let sizes: Vec<usize> = std::iter::once(4 * SCALARS).chain(level_sizes(settings)).collect();
    load_or_build(
        (cache_dir, &FORMAT, &key(mesh, optics, settings)),
        &sizes,
        |parts| decode(parts, settings),
        |bake, put| {
            put(&scalars(bake).map(f32::to_le_bytes).concat())?;
            bake.views.levels.iter().chain(bake.transfer.bands.iter().flatten()).try_for_each(|l| put(l))
        },
        || bake_species(mesh, optics, settings, quiet),
        quiet,
    )
}

/// BLAKE3 of everything that a bake depends on: geometry, masks and colours, optical overrides, settings and
/// the version of the bake. Vertex normals and material names have no part in it.
pub fn key(mesh: &Mesh, optics: &OpticsOverride, settings: &BakeSettings) -> [u8; 32] {
    let mut fields = Fields::new("canopy species bake");
    let mut put = |bytes: &[u8]| fields.put(bytes);
    put(&FORMAT.version.to_le_bytes());
    for x in [settings.rings, settings.resolution, settings.occlusion_rays, settings.transfer_bands] {
        put(&x.to_le_bytes());
    }
    for rgb in [optics.leaf_reflectance, optics.leaf_transmittance, optics.bark_reflectance] {
        put(rgb.as_ref().map_or(&[], bytemuck::bytes_of));
    }
    put(optics.extinction.as_ref().map_or(&[], bytemuck::bytes_of));
    put(bytemuck::cast_slice(&mesh.positions));
    put(bytemuck::cast_slice(&mesh.uvs));
    let triangles: Vec<[u32; 4]> =
        mesh.triangles.iter().map(|t| [t.vertices[0], t.vertices[1], t.vertices[2], t.material]).collect();
    put(bytemuck::cast_slice(&triangles));
    for m in &mesh.materials {
        put(&[u8::from(m.foliage), u8::from(m.double_sided)]);
        put(bytemuck::bytes_of(&m.base_color));
        put(m.alpha_cutoff.as_ref().map_or(&[], bytemuck::bytes_of));
        let (size, rgba): ([u32; 2], &[u8]) =
            m.texture.as_ref().map_or(([0; 2], &[]), |t| ([t.width, t.height], &t.rgba));
        put(bytemuck::bytes_of(&size));
        put(rgba);
    }
    fields.key()
}

/// The file of a key.
pub fn path(dir: &Path, key: &[u8; 32]) -> PathBuf {
    FORMAT.path(dir, key)
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
    } = b.crown;
    let Turned { reflected, slope, passed, bark_reflected, bark_share } = b.turned;
    #[rustfmt::skip]
    let all = [
        centre, half_width, half_height, reflected, slope, passed, bark_reflected, bark_share, leaf_shadow, extinction,
        r0, r1, r2, t0, t1, t2, b0, b1, b2, b.area, radius, base, height,
    ];
    all
}

/// Bytes of every level of z-field and transfer, from the settings alone.
fn level_sizes(settings: &BakeSettings) -> impl Iterator<Item = usize> {
    let views = views::count(settings.rings) as usize;
    let levels = move |resolution: u32| {
        (0..=resolution.ilog2()).map(move |l| views * 4 * (resolution as usize >> l).pow(2))
    };
    let transfer = (0..settings.transfer_bands).flat_map(move |_| levels(settings.resolution / 2));
    levels(settings.resolution).chain(transfer)
}

fn decode(mut parts: Vec<Vec<u8>>, settings: &BakeSettings) -> SpeciesBake {
    let mut levels = parts.split_off(1);
    let transfer = levels.split_off(settings.resolution.ilog2() as usize + 1);
    let resolution = if settings.transfer_bands > 0 { settings.resolution / 2 } else { 0 };
    let bands = transfer.chunks(settings.resolution.ilog2() as usize).map(<[_]>::to_vec).collect();
    let mut x = [0f32; SCALARS];
    for (x, from) in x.iter_mut().zip(parts[0].as_chunks::<4>().0) {
        *x = f32::from_le_bytes(*from);
    }
    #[rustfmt::skip]
    let [
        centre, half_width, half_height, reflected, slope, passed, bark_reflected, bark_share, leaf_shadow, extinction,
        r0, r1, r2, t0, t1, t2, b0, b1, b2, area, radius, base, height,
    ] = x;
    let frame = Frame { centre, half_width, half_height };
    SpeciesBake {
        views: ZField { n: settings.rings, resolution: settings.resolution, levels },
        transfer: Transfer { resolution, bands },
        crown: Crown { frame, radius, base, height, leaf_shadow, extinction },
        turned: Turned { reflected, slope, passed, bark_reflected, bark_share },
        reflectance: [r0, r1, r2],
        transmittance: [t0, t1, t2],
        bark_reflectance: [b0, b1, b2],
        area,
    }
}
