//! Estimates on disk, to be resumed.
//!
//! A line that says what it is, the length of a JSON header and the header (what the estimate depends on, its size, its
//! number of samples), the sums of every pixel as they are in memory, and the BLAKE3 hash of all that. Sums are doubles, so
//! that nothing is lost: 152 bytes a pixel.

use std::path::Path;

use super::estimate::{Estimate, Sums};
use super::key::Key;
use super::render::MOST_SAMPLES;
use crate::files::write_whole;
use crate::{Error, Result};

const MAGIC: &[u8] = b"canopy reference 1\n";
/// As it is written here; a machine with the other byte order reads something else.
const ORDER: u32 = 0x0102_0304;
const HASH: usize = blake3::OUT_LEN;
/// Longest header: keys of thousands of species.
const MOST_HEADER: usize = 1 << 20;

#[derive(serde::Serialize, serde::Deserialize)]
struct Header {
    byte_order: u32,
    size: [u32; 2],
    samples: u32,
    key: Key,
}

impl Estimate {
    /// Writes the estimate, whole or not at all.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn save(&self, path: &Path) -> Result<()> {
        let header = Header {
            byte_order: u32::from_le_bytes(ORDER.to_ne_bytes()),
            size: self.size,
            samples: self.samples,
            key: self.key.clone(),
        };
        let header = serde_json::to_vec(&header).map_err(|e| Error::io(path, std::io::Error::other(e)))?;
        let mut bytes = MAGIC.to_vec();
        bytes.extend((header.len() as u32).to_le_bytes());
        bytes.extend(header);
        bytes.extend_from_slice(bytemuck::cast_slice(&self.sums));
        let hash = blake3::hash(&bytes);
        bytes.extend(hash.as_bytes());
        write_whole(path, &bytes)
    }

    /// Reads an estimate.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Input`] for anything but an estimate that was written whole.
    pub fn load(path: &Path) -> Result<Self> {
        let bytes = std::fs::read(path).map_err(|e| Error::io(path, e))?;
        parse(&bytes).map_err(|what| {
            let remedy = "name a file that `canopy render --representation reference --resume` wrote, or remove it to begin anew";
            Error::input(path, "", what, remedy)
        })
    }
}

fn parse(bytes: &[u8]) -> std::result::Result<Estimate, String> {
    let rest = bytes.strip_prefix(MAGIC).ok_or("this is no estimate of a reference image")?;
    let damaged = || "the file is damaged".to_string();
    let (body, hash) = bytes.split_at_checked(bytes.len().saturating_sub(HASH)).ok_or_else(damaged)?;
    if blake3::hash(body).as_bytes() != hash {
        return Err(damaged());
    }
    let (length, rest) = rest.split_first_chunk::<4>().ok_or_else(damaged)?;
    let length = u32::from_le_bytes(*length) as usize;
    let (header, rest) =
        rest.split_at_checked(length).filter(|_| length <= MOST_HEADER).ok_or_else(damaged)?;
    let header: Header = serde_json::from_slice(header).map_err(|e| format!("its header: {e}"))?;
    if header.byte_order != u32::from_le_bytes(ORDER.to_ne_bytes()) {
        return Err("it was written on a machine with the other byte order".into());
    }
    let pixels = header.size[0] as usize * header.size[1] as usize;
    let sums = rest.len().checked_sub(HASH).map(|n| &rest[..n]).ok_or_else(damaged)?;
    if pixels.checked_mul(size_of::<Sums>()) != Some(sums.len()) || header.samples > MOST_SAMPLES {
        return Err(damaged());
    }
    // Not aligned in the file.
    let sums = sums.chunks_exact(size_of::<Sums>()).map(bytemuck::pod_read_unaligned).collect();
    Ok(Estimate { size: header.size, samples: header.samples, key: header.key, sums })
}
