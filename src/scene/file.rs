//! The scene file: TOML to a validated [`Scene`].
//!
//! Required: `[terrain]` and one `[[camera]]`. Left out: `name` is the file's stem, `seed` 0, `[[species]]` none, `[sun]`
//! no sun, `[sky]` black, `[wind]` none, `[quality]` the balanced preset. Everything else that is left out, unknown or out of range is
//! an error that names the line.

mod species;
mod terrain;

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use toml::de::DeTable;

use super::{Camera, Scene, Sky, Sun, texture};
use crate::input::read_text;
use crate::keys::{Item, Source, Table};
use crate::ladder::{Ladder, LadderError};
use crate::physics::wind::Wind;
use crate::settings::{KNOBS, PRESETS, Settings, nearest};
use crate::{Error, Result};

const MAX_BYTES: u64 = 16 << 20;

/// Largest coordinate or extent, m.
const MAX_METRES: f64 = 1e7;

/// Largest speed of the wind, m/s: that of the strongest storms.
const MAX_WIND: f64 = 100.0;

/// Largest irradiance or radiance.
const MAX_LIGHT: f64 = 1e6;

/// Reads a scene file and everything it refers to.
///
/// Errors name the file, the line and the key, or the place in the model, raster or table that is wrong.
pub fn load(path: &Path) -> Result<Scene> {
    load_at(Some(path), None)
}

/// The embedded default scene: procedural ridges and trees, no file needed.
pub fn default_scene() -> Result<Scene> {
    load_at(None, None)
}

/// Reads a scene file, or without a path the embedded scene, at another quality: `preset` takes the place of the
/// scene's own, and the scene's own knobs still hold.
///
/// Errors as [`load`], and for an unknown preset.
pub fn load_at(path: Option<&Path>, preset: Option<&str>) -> Result<Scene> {
    match path {
        Some(path) => read(&read_text(path, MAX_BYTES)?, path, preset),
        None => read(include_str!("default.toml"), Path::new("default.toml"), preset),
    }
}

/// Reads a scene from text as if it were the file `path`: for messages, and as what relative paths start from.
pub fn parse(text: &str, path: &Path) -> Result<Scene> {
    read(text, path, None)
}

fn read(text: &str, path: &Path, preset: Option<&str>) -> Result<Scene> {
    let settings = preset.map_or(Ok(Settings::default()), |name| {
        Settings::preset(name).ok_or_else(|| {
            Error::Usage(format!("there is no preset \"{name}\"; the presets are: {}", PRESETS.join(", ")))
        })
    })?;
    let source = Source { path, text };
    let document = DeTable::parse(text).map_err(|e| source.syntax(&e))?;
    let known = ["name", "seed", "terrain", "species", "sun", "sky", "wind", "camera", "quality"];
    let root = Table::root(&source, document.get_ref(), &known)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let (settings, ladder) = match root.get("quality") {
        Some(item) => quality(&item, settings, preset.is_some())?,
        None => (settings, Ladder::default()),
    };
    let terrain = terrain::read(&root.require("terrain")?, folder)?;
    Ok(Scene {
        name: name(&root, path)?,
        seed: root.get("seed").map_or(Ok(0), |i| i.whole())?,
        // Cameras before species: a mistake there should not wait for the models to load.
        cameras: cameras(&root.require("camera")?, terrain.origin)?,
        settings,
        ladder,
        sun: root
            .get("sun")
            .map_or(Ok(Sun { azimuth: 0.0, elevation: 90.0, irradiance: [0.0; 3] }), |i| sun(&i))?,
        sky: root.get("sky").map_or(Ok(Sky::Uniform([0.0; 3])), |i| sky(&i, folder))?,
        wind: root.get("wind").map_or(Ok(None), |i| wind(&i))?,
        time: 0.0,
        species: root.get("species").map_or(Ok(Vec::new()), |i| species::read_all(&i, folder, &terrain))?,
        terrain,
    })
}

fn name(root: &Table, path: &Path) -> Result<String> {
    let Some(item) = root.get("name") else {
        return Ok(path.file_stem().map_or("scene".into(), |s| s.to_string_lossy().into_owned()));
    };
    let name = item.text()?;
    // The name becomes part of file names.
    if name.len() > 100 || name.contains(|c: char| c.is_control() || matches!(c, '/' | '\\' | ':')) {
        return Err(
            item.error("the name is no file name", "use at most 100 letters, digits, spaces, - and _")
        );
    }
    Ok(name.to_string())
}

/// The path at a key, relative to the scene file. Errors if there is no such file.
fn existing(item: &Item, folder: &Path) -> Result<PathBuf> {
    let path = folder.join(item.text()?);
    match path.metadata() {
        Ok(meta) if meta.is_file() => Ok(path),
        Ok(_) => Err(item.error(format!("\"{}\" is no file", path.display()), "name a file")),
        Err(e) => {
            let what = format!("\"{}\" cannot be read: {e}", path.display());
            Err(item.error(what, "paths are relative to the scene file"))
        }
    }
}

/// Whether a name is new; errors name the line of the first.
fn unique<'a>(seen: &mut HashMap<&'a str, usize>, item: &Item<'a>) -> Result<()> {
    match seen.insert(item.text()?, seen.len()) {
        Some(i) => Err(item.error(format!("entry {i} has this name too"), "give each its own name")),
        None => Ok(()),
    }
}

fn sun(item: &Item) -> Result<Sun> {
    let table = item.table(&["azimuth", "elevation", "irradiance"])?;
    Ok(Sun {
        azimuth: table.require("azimuth")?.number(-360.0..=360.0, "degrees")?,
        elevation: table.require("elevation")?.number(-90.0..=90.0, "degrees")?,
        irradiance: table.require("irradiance")?.color(0.0..=MAX_LIGHT)?,
    })
}

fn sky(item: &Item, folder: &Path) -> Result<Sky> {
    let radiance = item.table(&["radiance"])?.require("radiance")?;
    match radiance.is_text() {
        true => texture::load_sky(&existing(&radiance, folder)?),
        false => radiance.color(0.0..=MAX_LIGHT).map(Sky::Uniform),
    }
}

/// A wind of no speed is none.
fn wind(item: &Item) -> Result<Option<Wind>> {
    let table = item.table(&["speed", "azimuth", "gustiness"])?;
    let wind = Wind {
        speed: table.require("speed")?.number(0.0..=MAX_WIND, "m/s")?,
        azimuth: table.require("azimuth")?.number(-360.0..=360.0, "degrees")?,
        gustiness: table.require("gustiness")?.number(0.0..=1.0, "")?,
    };
    Ok((wind.speed > 0.0).then_some(wind))
}

fn cameras(item: &Item, origin: [f64; 2]) -> Result<Vec<Camera>> {
    let entries = item.array("an array of tables `[[camera]]`")?;
    if entries.is_empty() {
        return Err(item.error("there is no camera", "add a `[[camera]]`"));
    }
    let mut seen = HashMap::new();
    let mut cameras = Vec::with_capacity(entries.len());
    for entry in &entries {
        let table = entry.table(&["name", "position", "target", "vertical_fov"])?;
        let name = table.require("name")?;
        unique(&mut seen, &name)?;
        let place = |key: &str| -> Result<[f64; 3]> {
            let item = table.require(key)?;
            let [x, y, z] = item.numbers::<3>(f64::MIN..=f64::MAX, "m")?;
            let local = [x - origin[0], y - origin[1], z];
            if local.iter().any(|c| c.abs() > MAX_METRES) {
                let what = format!("{local:?} m from the south-west corner is beyond {MAX_METRES} m");
                return Err(item.error(what, "correct the place, or `origin` in [terrain]"));
            }
            Ok(local)
        };
        let (position, target) = (place("position")?, place("target")?);
        if position == target {
            let what = "the camera looks at its own position";
            return Err(table.require("target")?.error(what, "choose another target"));
        }
        let fov = table.require("vertical_fov")?;
        let vertical_fov = fov.number(0.0..=180.0, "degrees")?;
        if vertical_fov == 0.0 || vertical_fov == 180.0 {
            return Err(
                fov.error(format!("{vertical_fov}° shows nothing"), "write a number between 0 and 180")
            );
        }
        cameras.push(Camera { name: name.text()?.to_string(), position, target, vertical_fov });
    }
    Ok(cameras)
}

/// The preset, unless the caller has chosen one, then the knobs; and the ladder.
fn quality(item: &Item, mut settings: Settings, chosen: bool) -> Result<(Settings, Ladder)> {
    let known: Vec<&str> = ["preset", "ladder"].into_iter().chain(KNOBS.iter().map(|k| k.name)).collect();
    let table = item.table(&known)?;
    if let Some(preset) = table.get("preset") {
        let name = preset.text()?;
        let own = Settings::preset(name).ok_or_else(|| {
            let remedy = match nearest(name, PRESETS) {
                Some(near) => format!("did you mean \"{near}\"?"),
                None => format!("the presets are: {}", PRESETS.join(", ")),
            };
            preset.error(format!("there is no preset \"{name}\""), &remedy)
        })?;
        if !chosen {
            settings = own;
        }
    }
    for item in table.items().iter().filter(|i| !["preset", "ladder"].contains(&i.name())) {
        let value = item.number(f64::MIN..=f64::MAX, "")?;
        settings
            .set(item.name(), value)
            .map_err(|e| item.error(e.to_string(), "choose a value in the range"))?;
    }
    let ladder = table.get("ladder").map_or(Ok(Ladder::default()), |item| {
        item.text()?.parse().map_err(|e: LadderError| item.error(e.what, &e.remedy))
    })?;
    Ok((settings, ladder))
}
