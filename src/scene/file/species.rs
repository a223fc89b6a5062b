//! The `[[species]]` tables.

use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

use super::super::model::{load_model, load_model_bytes, scale_to_height};
use super::super::{Distribution, Mesh, OpticsOverride, Species, Terrain, positions, raster};
use super::{existing, unique};
use crate::Result;
use crate::keys::{Item, Table};
use crate::settings::nearest;
use crate::tree::{self, BUILTIN_SEED, Preset};

/// Most trees per m²: seedlings in a nursery stand closer than any forest.
const MAX_DENSITY: f64 = 1e4;

const KEYS: [&str; 14] = [
    "name",
    "model",
    "height",
    "scale",
    "density",
    "max_density",
    "between_heights",
    "below_slope",
    "positions",
    "leaf_reflectance",
    "leaf_transmittance",
    "bark_reflectance",
    "extinction",
    "foliage",
];

/// Reads every species; errors name the line.
pub(super) fn read_all(item: &Item, folder: &Path, terrain: &Terrain) -> Result<Vec<Species>> {
    let entries = item.array("an array of tables `[[species]]`")?;
    let mut seen = HashMap::new();
    let mut tables = Vec::with_capacity(entries.len());
    for entry in &entries {
        let table = entry.table(&KEYS)?;
        unique(&mut seen, &table.require("name")?)?;
        tables.push(table);
    }
    tables.iter().map(|t| read(t, folder, terrain)).collect()
}

fn read(table: &Table, folder: &Path, terrain: &Terrain) -> Result<Species> {
    let scale = table.get("scale").map_or(Ok([1.0; 2]), |i| i.interval(0.001..=100.0, ""))?;
    let optics = optics(table)?;
    let distribution = distribution(table, folder, terrain)?;
    Ok(Species {
        name: table.require("name")?.text()?.to_string(),
        mesh: Arc::new(mesh(table, folder)?),
        scale: scale.map(|s| s as f32),
        distribution,
        optics,
    })
}

fn mesh(table: &Table, folder: &Path) -> Result<Mesh> {
    let model = table.require("model")?;
    let height = table.get("height").map(|i| i.number(0.01..=1000.0, "m")).transpose()?;
    let foliage = table.get("foliage").map(|i| foliage(&i)).transpose()?;
    let mut mesh = match model.text()?.strip_prefix("builtin:") {
        Some(name) => {
            let preset = name.parse::<Preset>().map_err(|_| {
                let names = Preset::ALL.map(Preset::name);
                let remedy = match nearest(name, names) {
                    Some(near) => format!("did you mean \"builtin:{near}\"?"),
                    None => format!("the built-in trees are: {}", names.join(", ")),
                };
                model.error(format!("there is no built-in tree \"{name}\""), &remedy)
            })?;
            let file = Path::new(model.text()?);
            load_model_bytes(file, &tree::glb(preset, BUILTIN_SEED), None, foliage.as_deref())?
        }
        None => load_model(&existing(&model, folder)?, foliage.as_deref())?,
    };
    if let Some(height) = height {
        scale_to_height(&mut mesh, height, Path::new(model.text()?))?;
    }
    Ok(mesh)
}

fn foliage(item: &Item) -> Result<Vec<String>> {
    let entries = item.array("an array of material names")?;
    entries.iter().map(|e| e.text().map(str::to_string)).collect()
}

fn optics(table: &Table) -> Result<OpticsOverride> {
    let color = |key: &str| table.get(key).map(|i| i.color(0.0..=1.0)).transpose();
    let optics = OpticsOverride {
        leaf_reflectance: color("leaf_reflectance")?,
        leaf_transmittance: color("leaf_transmittance")?,
        bark_reflectance: color("bark_reflectance")?,
        extinction: table
            .get("extinction")
            .map(|i| i.number(0.0..=1000.0, "1/m"))
            .transpose()?
            .map(|e| e as f32),
    };
    if let (Some(r), Some(t)) = (optics.leaf_reflectance, optics.leaf_transmittance)
        // A hair above one is rounding of two decimal numbers that sum to one.
        && r.iter().zip(t).any(|(r, t)| r + t > 1.0 + 1e-6)
    {
        let what = "leaf reflectance and transmittance sum to more than 1";
        return Err(table.require("leaf_transmittance")?.error(what, "lower one of them"));
    }
    Ok(optics)
}

fn distribution(table: &Table, folder: &Path, terrain: &Terrain) -> Result<Distribution> {
    let limits = ["max_density", "between_heights", "below_slope"];
    match (table.get("density"), table.get("positions")) {
        (Some(_), Some(positions)) => {
            Err(positions.error("the species has both `density` and `positions`", "remove one of them"))
        }
        (None, None) => {
            Err(table.error("the species has neither `density` nor `positions`", "add one of them"))
        }
        (None, Some(item)) => {
            table.forbid(&limits, "listed positions have no density")?;
            let path = existing(&item, folder)?;
            let trees = positions::load_positions(&path, terrain.origin, terrain.extent)?;
            Ok(Distribution::Positions(Arc::new(trees)))
        }
        (Some(item), None) => {
            let most = 0.0..=MAX_DENSITY;
            let (map, max_density) = if item.is_text() {
                let density = table.require("max_density")?.number(most, "trees per m²")?;
                (Some(Arc::new(raster::load_density(&existing(&item, folder)?)?)), density)
            } else {
                table.forbid(&["max_density"], "`density` is a number already; this is for density maps")?;
                (None, item.number(most, "trees per m²")?)
            };
            let heights =
                table.get("between_heights").map(|i| i.interval(-12_000.0..=12_000.0, "m")).transpose()?;
            let slope = table.get("below_slope").map(|i| i.number(0.0..=90.0, "degrees")).transpose()?;
            Ok(Distribution::Density {
                map,
                max_density: max_density as f32,
                between_heights: heights.map(|h| h.map(|v| v as f32)),
                below_slope: slope.map(|s| s as f32),
            })
        }
    }
}
