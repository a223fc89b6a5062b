//! How light comes to a model's faces, in the cache.

use std::path::Path;

use super::{Harmonics, RAYS, SKY_DIRECTIONS, seen};
use crate::Result;
use crate::bake::CacheState;
use crate::bake::cache::{bytes, floats, put_mesh};
use crate::bake::file::{Fields, Format, load_or_build};
use crate::bake::hiding::HEIGHTS;
use crate::bake::surface::Surface;
use crate::physics::correction::{Correction, TERMS};
use crate::physics::harmonics::KEPT;
use crate::scene::Mesh;

const FORMAT: Format = Format { magic: *b"CANOPYSH", version: 2, extension: "harmonics" };

/// That of a mesh from the cache if it is there, else made and put there.
pub fn load(mesh: &Mesh, dir: Option<&Path>, quiet: bool) -> Result<(Harmonics, CacheState)> {
    let surface = Surface::new(mesh)?;
    load_or_build(
        (dir, &FORMAT, &key(mesh)),
        &[4 * 2 * KEPT * surface.faces.len(), 4 * HEIGHTS * SKY_DIRECTIONS, CORRECTIONS],
        |read| Harmonics {
            faces: bytemuck::pod_collect_to_vec(&read[0]),
            hiding: floats(&read[1]),
            seen: corrections(&read[2]),
        },
        |built, put| {
            put(bytemuck::cast_slice(&built.faces))?;
            put(&bytes(&built.hiding))?;
            put(&corrections_bytes(&built.seen))
        },
        || Harmonics::new(mesh, quiet),
        quiet,
    )
}

/// Bytes of corrections.
pub const CORRECTIONS: usize = 4 * 3 * 2 * TERMS;

/// Corrections of their bytes.
pub fn corrections(bytes: &[u8]) -> seen::Corrections {
    let all: Vec<[f32; 2 * TERMS]> = bytemuck::pod_collect_to_vec(bytes);
    std::array::from_fn(|k| all.get(k).map_or(Correction::default(), |c| Correction::from_coefficients(*c)))
}

/// The reverse.
pub fn corrections_bytes(seen: &seen::Corrections) -> Vec<u8> {
    bytemuck::cast_slice(&seen.map(|c| c.coefficients())).to_vec()
}

/// BLAKE3 of everything that it depends on.
pub fn key(mesh: &Mesh) -> [u8; 32] {
    let mut fields = Fields::new("canopy harmonics");
    for x in [FORMAT.version, RAYS, SKY_DIRECTIONS as u32, seen::RAYS] {
        fields.put(&x.to_le_bytes());
    }
    put_mesh(&mut fields, mesh);
    fields.key()
}
