//! Levels of detail in the cache: what does not follow from the mesh at once.

use std::path::Path;

use super::{BarkLevel, Levels, NewFace, bark};
use crate::Result;
use crate::bake::CacheState;
use crate::bake::cache::{bytes, floats, put_mesh};
use crate::bake::file::{Fields, Format, load_or_build};
use crate::bake::surface::Surface;
use crate::physics::levels::{BARK_LEVELS, OCTAVES};
use crate::scene::Mesh;

const FORMAT: Format = Format { magic: *b"CANOPYLV", version: 2, extension: "levels" };

/// Levels of a mesh from the cache if they are there, else made and put there.
pub fn load(mesh: &Mesh, dir: Option<&Path>, quiet: bool) -> Result<(Levels, CacheState)> {
    let surface = Surface::new(mesh)?;
    let whole = Levels::whole(mesh, &surface);
    let (holed, opaque) = bark::parted(&surface, &whole.bark[0].kept);
    // A level that there is not has no triangles.
    let sizes = (1..BARK_LEVELS).map(|level| size_of::<NewFace>() * bark::most(opaque.len(), level));
    load_or_build(
        (dir, &FORMAT, &key(mesh)),
        &std::iter::once(4 * OCTAVES + 8 * BARK_LEVELS).chain(sizes).collect::<Vec<_>>(),
        |read| decode(&read, whole.clone(), &holed),
        |built, put| {
            put(&head(built))?;
            (1..BARK_LEVELS).try_for_each(|level| {
                let mut new = built.bark.get(level).map_or_else(Vec::new, |b| b.new.clone());
                new.resize(bark::most(opaque.len(), level), NewFace::default());
                put(bytemuck::cast_slice(&new))
            })
        },
        || Ok(whole.clone().completed(&surface)),
        quiet,
    )
}

/// BLAKE3 of everything that they depend on.
fn key(mesh: &Mesh) -> [u8; 32] {
    let mut fields = Fields::new("canopy mesh levels");
    fields.put(&FORMAT.version.to_le_bytes());
    put_mesh(&mut fields, mesh);
    fields.key()
}

/// The pull on cards; of each level of bark its triangles and its error.
fn head(levels: &Levels) -> Vec<u8> {
    let mut head = bytes(&levels.pull);
    for level in 0..BARK_LEVELS {
        let of = levels.bark.get(level).map_or((0, 0.0), |b| (b.new.len() as u32, b.error as f32));
        head.extend(of.0.to_le_bytes().into_iter().chain(of.1.to_le_bytes()));
    }
    head
}

/// The levels of a file, whose leaves' order and whole bark follow from the mesh.
fn decode(read: &[Vec<u8>], whole: Levels, holed: &[u32]) -> Levels {
    let pull = floats(&read[0][..4 * OCTAVES]);
    let mut levels = Levels { pull: std::array::from_fn(|k| pull[k]), ..whole };
    for (level, part) in read.iter().enumerate().skip(1) {
        let [count, error] = [0, 4].map(|at| {
            let from = 4 * OCTAVES + 8 * level + at;
            std::array::from_fn::<u8, 4, _>(|k| read[0][from + k])
        });
        let count = (u32::from_le_bytes(count) as usize).min(part.len() / size_of::<NewFace>());
        if count == 0 {
            break;
        }
        let new = bytemuck::pod_collect_to_vec(&part[..count * size_of::<NewFace>()]);
        let error = f64::from(f32::from_le_bytes(error));
        levels.bark.push(BarkLevel { kept: holed.to_vec(), new, error });
    }
    levels
}
