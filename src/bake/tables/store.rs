//! Tables on disk, under a key of what the z-field is made of that they are measured from, and of all settings.

use std::path::{Path, PathBuf};

use super::{ForestSettings, check, measure_species};
use crate::Result;
use crate::bake::file::{Fields, Format, load_or_build};
use crate::bake::{CacheState, SpeciesBake};
use crate::physics::tables::ForestTables;

const FORMAT: Format = Format { magic: *b"CANOPYFT", version: 14, extension: "forest" };

/// The tables of a species in a forest, from the cache if they are there, else measured and put there; `species` is asked for only
/// then. With `None` for a cache nothing is read or written; `source` is the key of what the species is baked from
/// ([`crate::bake::Source::key`]).
///
/// # Errors
/// [`crate::Error::Usage`] for settings out of range, and those of `species`. A cache that is damaged or cannot be written costs
/// only time.
pub fn load_or_measure<'a>(
    (cache_dir, source): (Option<&Path>, &[u8; 32]),
    forest: &ForestSettings,
    species: impl FnOnce() -> Result<&'a SpeciesBake>,
    quiet: bool,
) -> Result<(ForestTables, CacheState)> {
    check(forest)?;
    let (n, m) = (forest.angles as usize, forest.densities as usize);
    let pairs = 16 * m * n * n * n;
    load_or_build(
        (cache_dir, &FORMAT, &key(source, forest)),
        &[16, pairs, pairs, 16 * m * n, 16 * m * n, 8 * m, 8 * m, 4 * m * n, 4 * m * n],
        |parts| decode(&parts, forest),
        |t, put| {
            put(&little(&[t.max_thickness, t.area, t.vertical_scale, t.hole]))?;
            for part in [&t.pair, &t.pair_stderr] {
                put(&little(part.as_flattened()))?;
            }
            for part in [&t.view, &t.view_stderr] {
                put(&little(part.as_flattened()))?;
            }
            [&t.ground, &t.ground_stderr].into_iter().try_for_each(|p| put(&little(p.as_flattened())))?;
            [&t.seen_sky, &t.near_sky].into_iter().try_for_each(|p| put(&little(p)))
        },
        || measure_species(species()?, forest, quiet),
        quiet,
    )
}

/// BLAKE3 of everything that tables depend on: what the species is baked from, and how they are measured.
pub fn key(source: &[u8; 32], forest: &ForestSettings) -> [u8; 32] {
    let ForestSettings {
        angles,
        densities,
        rays,
        pattern_density,
        scale_range,
        poisson,
        hole_radius,
        light_iterations,
        view_iterations,
    } = *forest;
    let mut fields = Fields::new("canopy forest tables");
    for x in [FORMAT.version, angles, densities, rays, u32::from(poisson), light_iterations, view_iterations]
    {
        fields.put(&x.to_le_bytes());
    }
    fields.put(&pattern_density.to_le_bytes());
    fields.put(&little(&[scale_range[0], scale_range[1], hole_radius]));
    fields.put(source);
    fields.key()
}

/// The file of a key.
pub fn path(dir: &Path, key: &[u8; 32]) -> PathBuf {
    FORMAT.path(dir, key)
}

fn little(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|x| x.to_le_bytes()).collect()
}

fn decode(parts: &[Vec<u8>], forest: &ForestSettings) -> ForestTables {
    fn rows<const N: usize>(bytes: &[u8]) -> Vec<[f32; N]> {
        let floats: Vec<f32> = bytes.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect();
        floats.as_chunks::<N>().0.to_vec()
    }
    let [max_thickness, area, vertical_scale, hole] = rows(&parts[0])[0];
    ForestTables {
        angles: forest.angles,
        densities: forest.densities,
        max_thickness,
        area,
        vertical_scale,
        hole,
        pair: rows(&parts[1]),
        pair_stderr: rows(&parts[2]),
        view: rows(&parts[3]),
        view_stderr: rows(&parts[4]),
        ground: rows(&parts[5]),
        ground_stderr: rows(&parts[6]),
        seen_sky: rows::<1>(&parts[7]).concat(),
        near_sky: rows::<1>(&parts[8]).concat(),
    }
}
