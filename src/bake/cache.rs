//! Bakes on disk, keyed by content.
//!
//! A file holds, little endian: magic, format version, key, the scalars of [`SpeciesBake`], the bytes of every
//! mip level, and the BLAKE3 of all that. Its size follows from the settings, so nothing in the file is
//! believed about lengths: a file of another size is not read. Files are written under a name of their own and
//! renamed when complete, so that two processes at once, or a crash, leave either a whole file or none.

use std::collections::hash_map::RandomState;
use std::fs::{self, File, OpenOptions};
use std::hash::{BuildHasher, Hasher};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use super::{BakeSettings, SpeciesBake, ZField, bake_species, check};
use crate::Result;
use crate::physics::views;
use crate::scene::{Mesh, OpticsOverride};

const MAGIC: [u8; 8] = *b"CANOPYZF";
/// Goes into the key: to be raised with every change of the format or of what a bake computes.
const VERSION: u32 = 5;
const SCALARS: usize = 17;
const HEADER: usize = 8 + 4 + 32 + 4 * SCALARS;
const CHECKSUM: usize = 32;

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
    let Some(dir) = cache_dir else {
        return Ok((bake_species(mesh, optics, settings, quiet)?, CacheState::Baked));
    };
    let key = key(mesh, optics, settings);
    let path = path(dir, &key);
    let state = match read(&path, &key, settings) {
        Ok(bake) => return Ok((bake, CacheState::Hit)),
        Err(e) if e.kind() == io::ErrorKind::NotFound => CacheState::Baked,
        Err(e) => {
            if !quiet {
                // Not `eprintln!`, which panics when no one listens any more.
                let _ = writeln!(io::stderr(), "cache: {}: {e}; baking again", path.display());
            }
            CacheState::Rebuilt
        }
    };
    let bake = bake_species(mesh, optics, settings, quiet)?;
    if let Err(e) = write(dir, &path, &key, &bake) {
        static WARNED: AtomicBool = AtomicBool::new(false);
        if !quiet && !WARNED.swap(true, Ordering::Relaxed) {
            let _ = writeln!(io::stderr(), "cache: cannot write to {}: {e}; going on without", dir.display());
        }
    }
    Ok((bake, state))
}

/// BLAKE3 of everything that a bake depends on: geometry, masks and colours, optical overrides, settings and
/// the version of the bake. Vertex normals and material names have no part in it.
pub fn key(mesh: &Mesh, optics: &OpticsOverride, settings: &BakeSettings) -> [u8; 32] {
    let mut h = blake3::Hasher::new_derive_key("canopy species bake");
    let mut put = |bytes: &[u8]| {
        // A length before every field, so that no two contents run together to the same bytes.
        h.update(&(bytes.len() as u64).to_le_bytes());
        h.update(bytes);
    };
    put(&VERSION.to_le_bytes());
    for x in [settings.rings, settings.resolution, settings.occlusion_rays] {
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
    *h.finalize().as_bytes()
}

/// The file of a key.
pub fn path(dir: &Path, key: &[u8; 32]) -> PathBuf {
    dir.join(format!("{}.zfield", blake3::Hash::from_bytes(*key).to_hex()))
}

fn scalars(b: &SpeciesBake) -> [f32; SCALARS] {
    let ([r0, r1, r2], [t0, t1, t2], [b0, b1, b2]) = (b.reflectance, b.transmittance, b.bark);
    [
        b.center,
        b.radius,
        b.half_height,
        b.extinction,
        r0,
        r1,
        r2,
        t0,
        t1,
        t2,
        b0,
        b1,
        b2,
        b.area,
        b.crown_radius,
        b.crown_base,
        b.height,
    ]
}

fn header(key: &[u8; 32], scalars: &[f32; SCALARS]) -> [u8; HEADER] {
    let mut header = [0; HEADER];
    header[..8].copy_from_slice(&MAGIC);
    header[8..12].copy_from_slice(&VERSION.to_le_bytes());
    header[12..44].copy_from_slice(key);
    for (to, x) in header[44..].chunks_exact_mut(4).zip(scalars) {
        to.copy_from_slice(&x.to_le_bytes());
    }
    header
}

/// Bytes of every level, from the settings alone.
fn level_sizes(settings: &BakeSettings) -> impl Iterator<Item = usize> {
    let views = views::count(settings.rings) as usize;
    let resolution = settings.resolution as usize;
    (0..=resolution.ilog2()).map(move |l| views * 4 * (resolution >> l).pow(2))
}

fn damaged(what: &str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, what)
}

fn read(path: &Path, key: &[u8; 32], settings: &BakeSettings) -> io::Result<SpeciesBake> {
    let mut file = File::open(path)?;
    let expected = HEADER + level_sizes(settings).sum::<usize>() + CHECKSUM;
    if file.metadata()?.len() != expected as u64 {
        return Err(damaged("the cached file has the wrong size"));
    }
    let mut hasher = blake3::Hasher::new();
    let mut bytes = [0; HEADER];
    file.read_exact(&mut bytes)?;
    hasher.update(&bytes);
    let mut x = [0f32; SCALARS];
    for (x, from) in x.iter_mut().zip(bytes[44..].as_chunks::<4>().0) {
        *x = f32::from_le_bytes(*from);
    }
    if bytes[..44] != header(key, &x)[..44] {
        return Err(damaged("the cached file is not of this format or content"));
    }
    let mut levels = Vec::new();
    for size in level_sizes(settings) {
        let mut level = vec![0; size];
        file.read_exact(&mut level)?;
        hasher.update(&level);
        levels.push(level);
    }
    let mut checksum = [0; CHECKSUM];
    file.read_exact(&mut checksum)?;
    if hasher.finalize() != checksum {
        return Err(damaged("the cached file is damaged (its checksum differs)"));
    }
    let [
        center,
        radius,
        half_height,
        extinction,
        r0,
        r1,
        r2,
        t0,
        t1,
        t2,
        b0,
        b1,
        b2,
        area,
        crown_radius,
        crown_base,
        height,
    ] = x;
    Ok(SpeciesBake {
        views: ZField { n: settings.rings, resolution: settings.resolution, levels },
        center,
        radius,
        half_height,
        extinction,
        reflectance: [r0, r1, r2],
        transmittance: [t0, t1, t2],
        bark: [b0, b1, b2],
        area,
        crown_radius,
        crown_base,
        height,
    })
}

/// A file that is removed unless it has been renamed.
struct Temporary(PathBuf);

impl Drop for Temporary {
    fn drop(&mut self) {
        // It is gone after the rename, and there is nothing to be done about any other failure.
        let _ = fs::remove_file(&self.0);
    }
}

fn write(dir: &Path, path: &Path, key: &[u8; 32], bake: &SpeciesBake) -> io::Result<()> {
    fs::create_dir_all(dir)?;
    // A random name: process numbers repeat between containers that share a directory.
    let mine = format!("tmp-{:016x}", RandomState::new().build_hasher().finish());
    let temporary = path.with_extension(mine);
    let mut file = OpenOptions::new().write(true).create_new(true).open(&temporary)?;
    let temporary = Temporary(temporary);
    let mut hasher = blake3::Hasher::new();
    let header = header(key, &scalars(bake));
    for part in std::iter::once(&header[..]).chain(bake.views.levels.iter().map(Vec::as_slice)) {
        hasher.update(part);
        file.write_all(part)?;
    }
    file.write_all(hasher.finalize().as_bytes())?;
    file.sync_all()?;
    fs::rename(&temporary.0, path)
}
