//! The `[terrain]` table.

use std::path::Path;
use std::sync::Arc;

use super::super::{Albedo, Terrain, raster, ridge, texture};
use super::{MAX_METRES, existing};
use crate::Result;
use crate::keys::{Item, Table};
use crate::physics::raster::Raster;

/// The heightmap that needs no file.
const BUILTIN: &str = "builtin:ridge";

/// Reflectance of forest soil and litter, where the scene states none.
const ALBEDO: [f32; 3] = [0.13, 0.11, 0.08];

/// Largest coordinate of the south-west corner, m: positions keep a hundredth of a millimetre in f64.
const MAX_ORIGIN: f64 = 1e9;

const KEYS: [&str; 6] = ["origin", "extent", "heightmap", "cell_size", "height_range", "albedo"];

/// Reads the terrain; errors name the line.
pub(super) fn read(item: &Item, folder: &Path) -> Result<Terrain> {
    let table = item.table(&KEYS)?;
    let origin =
        table.get("origin").map_or(Ok([0.0; 2]), |i| i.numbers::<2>(-MAX_ORIGIN..=MAX_ORIGIN, "m"))?;
    let albedo = match table.get("albedo") {
        Some(item) if item.is_text() => {
            Albedo::Image(Arc::new(texture::load_texture(&existing(&item, folder)?)?))
        }
        Some(item) => Albedo::Uniform(item.color(0.0..=1.0)?),
        None => Albedo::Uniform(ALBEDO),
    };
    let Some(map) = table.get("heightmap") else {
        table.forbid(&["cell_size", "height_range"], "this belongs to a heightmap, and there is none")?;
        let side = table.require("extent")?.number(1.0..=MAX_METRES, "m")?;
        return Ok(Terrain { origin, extent: [side; 2], cell_size: side, heights: None, albedo });
    };
    table.forbid(&["extent"], "the extent follows from the heightmap and `cell_size`")?;
    let (heights, cell_size) = match map.text()? {
        BUILTIN => {
            table.forbid(&["cell_size", "height_range"], "the built-in terrain has its own")?;
            (ridge::ridge(), ridge::CELL_SIZE)
        }
        name if name.starts_with("builtin:") => {
            return Err(
                map.error(format!("there is no terrain \"{name}\""), &format!("did you mean \"{BUILTIN}\"?"))
            );
        }
        _ => from_file(&table, &map, folder)?,
    };
    let extent = [heights.width, heights.height].map(|n| f64::from(n - 1) * cell_size);
    if extent.iter().any(|e| !(1.0..=MAX_METRES).contains(e)) {
        let what = format!("the terrain would be {} × {} m", extent[0], extent[1]);
        return Err(table.require("cell_size")?.error(what, "correct `cell_size`, in metres"));
    }
    Ok(Terrain { origin, extent, cell_size, heights: Some(heights), albedo })
}

fn from_file(table: &Table, map: &Item, folder: &Path) -> Result<(Raster, f64)> {
    let cell_size = table.require("cell_size")?.number(0.001..=1e6, "m")?;
    let range = table.get("height_range").map(|i| i.interval(-12_000.0..=50_000.0, "m")).transpose()?;
    Ok((raster::load_heights(&existing(map, folder)?, range)?, cell_size))
}
