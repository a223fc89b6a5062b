//! Precomputed data on disk, keyed by content.
//!
//! A file holds, little endian: magic, format version, key, parts of bytes, and the BLAKE3 of all that. The sizes of the
//! parts follow from the settings, so nothing in the file is believed about lengths: a file of another size is not read.
//! Files are written aside and renamed when complete, so that two processes at once, or a crash, leave either a whole file
//! or none.

use std::fs::{self, File};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use super::CacheState;
use crate::Result;
use crate::files::Unfinished;
use crate::progress::say;

const HEADER: usize = 8 + 4 + 32;
const CHECKSUM: usize = 32;

/// A kind of file.
pub struct Format {
    /// First bytes.
    pub magic: [u8; 8],
    /// To be raised with every change of the format or of what it holds.
    pub version: u32,
    /// Of file names.
    pub extension: &'static str,
}

impl Format {
    /// The file of a key.
    pub fn path(&self, dir: &Path, key: &[u8; 32]) -> PathBuf {
        dir.join(format!("{}.{}", blake3::Hash::from_bytes(*key).to_hex(), self.extension))
    }

    fn header(&self, key: &[u8; 32]) -> [u8; HEADER] {
        let mut header = [0; HEADER];
        header[..8].copy_from_slice(&self.magic);
        header[8..12].copy_from_slice(&self.version.to_le_bytes());
        header[12..].copy_from_slice(key);
        header
    }
}

/// Data from the cache in `dir` if it is there, else built and put there; with `None` nothing is read or written.
///
/// `sizes` are the parts' bytes, `decode` makes the data of them and `encode` the reverse. A cache that is damaged or cannot
/// be written costs time and a line on the standard error (none when `quiet`), never the result; errors are those of `build`.
pub fn load_or_build<T>(
    (dir, format, key): (Option<&Path>, &Format, &[u8; 32]),
    sizes: &[usize],
    decode: impl FnOnce(Vec<Vec<u8>>) -> T,
    encode: impl FnOnce(&T, &mut dyn FnMut(&[u8]) -> io::Result<()>) -> io::Result<()>,
    build: impl FnOnce() -> Result<T>,
    quiet: bool,
) -> Result<(T, CacheState)> {
    let Some(dir) = dir else { return Ok((build()?, CacheState::Baked)) };
    let path = format.path(dir, key);
    let header = format.header(key);
    let state = match read(&path, &header, sizes) {
        Ok(parts) => return Ok((decode(parts), CacheState::Hit)),
        Err(e) if e.kind() == io::ErrorKind::NotFound => CacheState::Baked,
        Err(e) => {
            if !quiet {
                say(&format!("cache: {}: {e}; baking again", path.display()));
            }
            CacheState::Rebuilt
        }
    };
    let built = build()?;
    if let Err(e) = write(dir, &path, &header, |put| encode(&built, put)) {
        static WARNED: AtomicBool = AtomicBool::new(false);
        if !quiet && !WARNED.swap(true, Ordering::Relaxed) {
            say(&format!("cache: cannot write to {}: {e}; going on without", dir.display()));
        }
    }
    Ok((built, state))
}

/// A hash of contents field by field: a length before each, so that no two contents run together to the same bytes.
pub struct Fields(blake3::Hasher);

impl Fields {
    /// For keys of one purpose.
    pub fn new(context: &str) -> Self {
        Fields(blake3::Hasher::new_derive_key(context))
    }

    /// Adds a field.
    pub fn put(&mut self, bytes: &[u8]) {
        self.0.update(&(bytes.len() as u64).to_le_bytes());
        self.0.update(bytes);
    }

    /// The key.
    pub fn key(&self) -> [u8; 32] {
        *self.0.finalize().as_bytes()
    }
}

fn damaged(what: &str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, what)
}

fn read(path: &Path, header: &[u8; HEADER], sizes: &[usize]) -> io::Result<Vec<Vec<u8>>> {
    // Asked before it is opened: opening a pipe would wait for a writer.
    if !fs::metadata(path)?.is_file() {
        return Err(damaged("this is not a regular file"));
    }
    let mut file = File::open(path)?;
    let expected = HEADER + sizes.iter().sum::<usize>() + CHECKSUM;
    if file.metadata()?.len() != expected as u64 {
        return Err(damaged("the cached file has the wrong size"));
    }
    let mut hasher = blake3::Hasher::new();
    let mut bytes = [0; HEADER];
    file.read_exact(&mut bytes)?;
    hasher.update(&bytes);
    if bytes != *header {
        return Err(damaged("the cached file is not of this format or content"));
    }
    let mut parts = Vec::new();
    for size in sizes {
        let mut part = vec![0; *size];
        file.read_exact(&mut part)?;
        hasher.update(&part);
        parts.push(part);
    }
    let mut checksum = [0; CHECKSUM];
    file.read_exact(&mut checksum)?;
    if hasher.finalize() != checksum {
        return Err(damaged("the cached file is damaged (its checksum differs)"));
    }
    Ok(parts)
}

fn write(
    dir: &Path,
    path: &Path,
    header: &[u8; HEADER],
    encode: impl FnOnce(&mut dyn FnMut(&[u8]) -> io::Result<()>) -> io::Result<()>,
) -> io::Result<()> {
    fs::create_dir_all(dir)?;
    let mut file = Unfinished::new(path)?;
    let mut hasher = blake3::Hasher::new();
    let mut put = |part: &[u8]| {
        hasher.update(part);
        file.write_all(part)
    };
    put(header)?;
    encode(&mut put)?;
    file.write_all(hasher.finalize().as_bytes())?;
    file.finish()
}
