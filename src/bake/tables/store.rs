//! Tables on disk, keyed by the z-field that they are measured from and by all settings.

use std::path::{Path, PathBuf};

use super::crown::LeafOptics;
use super::field::FieldCrown;
use super::{ForestSettings, RESOLUTION, check, measure};
use crate::Result;
use crate::bake::file::{Fields, Format, load_or_build};
use crate::bake::{CacheState, SpeciesBake};
use crate::physics::crown::{Crown, Frame};
use crate::physics::tables::ForestTables;

const FORMAT: Format = Format { magic: *b"CANOPYFT", version: 5, extension: "forest" };

/// The tables of a species in a forest, from the cache in `cache_dir` if they are there, else measured and put there. With
/// `None` nothing is read or written.
///
/// # Errors
/// [`crate::Error::Usage`] for settings out of range. A cache that is damaged or cannot be written costs only time.
pub fn load_or_measure(
    bake: &SpeciesBake,
    forest: &ForestSettings,
    cache_dir: Option<&Path>,
    quiet: bool,
) -> Result<(ForestTables, CacheState)> {
    check(forest)?;
    let (n, m) = (forest.angles as usize, forest.densities as usize);
    let pairs = 16 * m * n * n * n;
    load_or_build(
        (cache_dir, &FORMAT, &key(bake, forest)),
        &[24, pairs, pairs, 16 * m * n, 16 * m * n, 8 * m, 8 * m],
        |parts| decode(&parts, forest),
        |t, put| {
            put(&little(&[t.max_thickness, t.area, t.vertical_scale, t.hole, t.sky[0], t.sky[1]]))?;
            for part in [&t.pair, &t.pair_stderr] {
                put(&little(part.as_flattened()))?;
            }
            for part in [&t.view, &t.view_stderr] {
                put(&little(part.as_flattened()))?;
            }
            [&t.ground, &t.ground_stderr].into_iter().try_for_each(|p| put(&little(p.as_flattened())))
        },
        || {
            let crown = FieldCrown::new(bake, RESOLUTION, forest.view_iterations, forest.light_iterations);
            measure(&crown, forest, quiet)
        },
        quiet,
    )
}

/// BLAKE3 of everything that tables depend on.
pub fn key(bake: &SpeciesBake, forest: &ForestSettings) -> [u8; 32] {
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
    let Crown {
        frame: Frame { centre, half_width, half_height },
        radius,
        base,
        height,
        leaf_shadow,
        extinction,
    } = bake.crown;
    let crown = [centre, half_width, half_height, radius, base, height, leaf_shadow, extinction];
    fields.put(&little(&crown));
    let leaf = LeafOptics::of(bake);
    fields.put(&little(&[leaf.scattered[0], leaf.scattered[1], leaf.turning, leaf.albedo]));
    fields.put(&bake.views.n.to_le_bytes());
    fields.put(&bake.views.resolution.to_le_bytes());
    // Only these levels are looked at.
    for level in bake.views.levels.iter().skip(FieldCrown::level(bake, RESOLUTION)).take(2) {
        fields.put(level);
    }
    for band in &bake.transfer.bands {
        fields.put(&band[0]);
    }
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
    let [max_thickness, area, vertical_scale, hole, sky0, sky1] = rows(&parts[0])[0];
    ForestTables {
        angles: forest.angles,
        densities: forest.densities,
        max_thickness,
        area,
        vertical_scale,
        hole,
        sky: [sky0, sky1],
        pair: rows(&parts[1]),
        pair_stderr: rows(&parts[2]),
        view: rows(&parts[3]),
        view_stderr: rows(&parts[4]),
        ground: rows(&parts[5]),
        ground_stderr: rows(&parts[6]),
    }
}
