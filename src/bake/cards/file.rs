//! Clouds of cards in the cache.

use std::path::Path;

use super::CloudSettings;
use super::artefact::{CardCloud, CloudCard, FAR};
use super::picture::LEVELS;
use crate::Result;
use crate::bake::CacheState;
use crate::bake::cache::put_mesh;
use crate::bake::file::{Fields, Format, load_or_build};
use crate::bake::harmonics::file::{CORRECTIONS, corrections, corrections_bytes};
use crate::bake::harmonics::{Harmonics, RAYS, seen};
use crate::scene::Mesh;

const FORMAT: Format = Format { magic: *b"CANOPYCC", version: 5, extension: "cards" };

/// A cloud of a mesh from the cache if it is there, else made and put there.
pub fn load(
    mesh: &Mesh,
    light: &Harmonics,
    settings: CloudSettings,
    dir: Option<&Path>,
    quiet: bool,
) -> Result<(CardCloud, CacheState)> {
    let most = settings.cards as usize + FAR;
    let head = [4, most * size_of::<CloudCard>(), 2 * CORRECTIONS];
    load_or_build(
        (dir, &FORMAT, &key(mesh, settings)),
        &head.into_iter().chain(CardCloud::sizes(settings.atlas)).collect::<Vec<_>>(),
        |read| decode(read, settings),
        |cloud, put| {
            put(&cloud.full.to_le_bytes())?;
            let mut cards = cloud.cards.clone();
            cards.resize(most, CloudCard::default());
            put(bytemuck::cast_slice(&cards))?;
            put(&cloud.seen.iter().flat_map(corrections_bytes).collect::<Vec<_>>())?;
            cloud.textures().try_for_each(|t| put(t))
        },
        || CardCloud::new(mesh, light, settings),
        quiet,
    )
}

fn decode(mut read: Vec<Vec<u8>>, settings: CloudSettings) -> CardCloud {
    let full = bytemuck::pod_read_unaligned::<u32>(&read[0]);
    let mut cards: Vec<CloudCard> = bytemuck::pod_collect_to_vec(&read[1]);
    cards.truncate((full as usize).saturating_add(FAR));
    let mut opacity = read.split_off(3);
    let mut surface = opacity.split_off(LEVELS as usize);
    let harmonics = surface.split_off(LEVELS as usize);
    let [near, far] = [&read[2][..CORRECTIONS], &read[2][CORRECTIONS..]].map(corrections);
    CardCloud { cards, full, size: [settings.atlas; 2], opacity, surface, harmonics, seen: [near, far] }
}

/// BLAKE3 of everything that it depends on.
fn key(mesh: &Mesh, settings: CloudSettings) -> [u8; 32] {
    let mut fields = Fields::new("canopy cloud of cards");
    for x in [FORMAT.version, RAYS, seen::RAYS, settings.cards, settings.atlas] {
        fields.put(&x.to_le_bytes());
    }
    put_mesh(&mut fields, mesh);
    fields.key()
}
