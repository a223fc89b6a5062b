//! Which forests, suns and slopes: a fixed design, drawn from a seed.
//!
//! Densities, suns and slopes are spread evenly over their ranges (a Latin hypercube: every one of n cells of a forest lies in a
//! stratum of its own of each), so that few cells meet all of what there is, and nothing that is tuned on them fits a grid.
//! A third of the cells, and some forests altogether, are kept apart ([`Part::Kept`]): nothing may be tuned on them, so that they say
//! what a forest has to expect that the program has never seen.

use std::path::Path;
use std::sync::Arc;

use crate::measure::reflectance::mean_densities;
use crate::physics::hash::{Stream, hash2};
use crate::scene::{Distribution, Scene, load_at, parse};
use crate::{Error, Result};

/// Trees per m², all species together, from and to.
const DENSITIES: [f64; 2] = [0.003, 0.06];
/// Of a user's scene, over its own mean density.
const PARTS: [f64; 2] = [0.25, 1.0];
/// Elevations of the sun, degrees.
const ELEVATIONS: [f64; 2] = [10.0, 80.0];
/// Steepest slope, degrees; half of the cells are level.
const STEEPEST: f64 = 30.0;
/// Least angle of the sun above a slope, degrees.
const LEAST_OVER_SLOPE: f64 = 5.0;
/// Seed of the design.
const SEED: u32 = 0xacc0;
/// Every so many cells of a forest one is kept apart.
const KEPT_EVERY: usize = 3;

/// What a cell is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Part {
    /// May be looked at while the program is changed.
    Tuning,
    /// Only for a last run.
    Kept,
}

impl Part {
    /// Both, with the names that users write.
    pub const NAMES: [(&'static str, Part); 2] = [("tuning", Part::Tuning), ("kept", Part::Kept)];
}

/// A forest to make cells of: a scene whose species stand in the proportions of their densities.
#[derive(Clone)]
pub struct Forest {
    /// Name, for cells and files.
    pub name: String,
    /// Species, ground, sun's and sky's light.
    pub scene: Arc<Scene>,
    /// Trees per m² of every species, for a scene's cells at the most.
    densities: Vec<f64>,
    /// Range of the cells' total density, trees per m².
    range: [f64; 2],
    /// All of its cells are kept apart.
    kept: bool,
}

/// One forest under one sun on one slope.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Cell {
    /// Unique in the design.
    pub name: String,
    /// The forest's name.
    pub forest: String,
    /// Trees per m² of map, all species together.
    pub density: f64,
    /// Degrees above the horizon.
    pub sun_elevation: f64,
    /// Degrees; descends towards the sun where positive.
    pub slope: f64,
    /// What it is for.
    pub part: Part,
}

/// A species of a built-in forest: name, model, range of scales, share of the trees.
type Member = (&'static str, &'static str, [f32; 2], f64);

/// A built-in forest: name, species, whether all of its cells are kept apart.
type Built = (&'static str, &'static [Member], bool);

const OAK: Member = ("oak", "builtin:oak", [0.75, 1.2], 1.0);
const PINE: Member = ("pine", "builtin:pine", [0.6, 1.2], 1.0);
const BIRCH: Member = ("birch", "builtin:birch", [0.7, 1.15], 1.0);
const BUSH: Member = ("bush", "builtin:oak", [0.15, 0.2], 2.0);
const POPLAR: Member = ("poplar", "builtin:poplar", [0.7, 1.1], 1.0);
const ACACIA: Member = ("acacia", "builtin:acacia", [0.8, 1.2], 1.0);
const ASH: Member = ("ash", "builtin:ash", [0.7, 1.2], 1.0);
const SPRUCE: Member = ("spruce", "builtin:spruce", [0.5, 1.1], 1.0);
const WILLOW: Member = ("willow", "builtin:willow", [0.7, 1.1], 1.0);
const CATALPA: Member = ("catalpa", "builtin:catalpa", [0.7, 1.2], 1.0);
const SNAG: Member = ("snag", "builtin:snag", [0.6, 1.2], 1.0);

/// The built-in forests.
const BUILT: &[Built] = &[
    ("oak", &[OAK], false),
    ("pine", &[PINE], false),
    ("birch", &[BIRCH], false),
    ("bush", &[BUSH], false),
    ("poplar", &[POPLAR], false),
    ("acacia", &[ACACIA], false),
    ("ash", &[ASH], false),
    ("spruce", &[SPRUCE], false),
    ("oak+pine", &[OAK, PINE], false),
    ("oak+bush", &[OAK, BUSH], false),
    ("willow", &[WILLOW], true),
    ("catalpa", &[CATALPA], true),
    ("snag", &[SNAG], true),
    ("spruce+birch", &[SPRUCE, BIRCH], true),
    ("eight", &[OAK, PINE, BIRCH, POPLAR, ACACIA, ASH, SPRUCE, WILLOW], true),
];

/// The scene of a built-in forest, with one tree per m² in all.
fn built((name, members, _): &Built, preset: Option<&str>) -> Result<Scene> {
    let mut text = format!(
        "name = \"{name}\"\n[terrain]\nextent = 2400.0\nalbedo = [0.13, 0.11, 0.08]\n\
         [sun]\nazimuth = 180.0\nelevation = 45.0\nirradiance = [1.0, 0.95, 0.85]\n[sky]\nradiance = [0.06, 0.09, 0.14]\n\
         [[camera]]\nname = \"patch\"\nposition = [1200.0, 1200.0, 1000.0]\ntarget = [1200.0, 1300.0, 0.0]\nvertical_fov = 45.0\n\
         [quality]\npreset = \"{}\"\n",
        preset.unwrap_or("balanced")
    );
    let total: f64 = members.iter().map(|m| m.3).sum();
    for (species, model, [low, high], share) in *members {
        text += &format!(
            "[[species]]\nname = \"{species}\"\nmodel = \"{model}\"\nscale = [{low:?}, {high:?}]\ndensity = {:?}\n",
            share / total
        );
    }
    parse(&text, Path::new(name))
}

/// The built-in forests, at a preset.
///
/// # Errors
/// [`Error::Usage`] for an unknown preset.
pub fn built_in(preset: Option<&str>) -> Result<Vec<Forest>> {
    BUILT
        .iter()
        .map(|b| {
            let scene = built(b, preset)?;
            let densities = mean_densities(&scene);
            Ok(Forest { name: b.0.into(), scene: Arc::new(scene), densities, range: DENSITIES, kept: b.2 })
        })
        .collect()
}

/// The forest of a user's scene: its mix of species, from a quarter of its mean density up to that.
///
/// # Errors
/// [`Error::Input`]; [`Error::Usage`] where no tree stands.
pub fn of_file(path: &Path, preset: Option<&str>) -> Result<Forest> {
    let scene = load_at(Some(path), preset)?;
    let densities = mean_densities(&scene);
    let total: f64 = densities.iter().sum();
    if total <= 0.0 {
        return Err(Error::Usage(format!("{}: no trees to measure", path.display())));
    }
    let name = scene.name.clone();
    Ok(Forest { name, scene: Arc::new(scene), densities, range: PARTS.map(|p| p * total), kept: false })
}

impl Forest {
    /// Trees per m² of every species in a cell.
    pub fn densities(&self, cell: &Cell) -> Vec<f64> {
        let total: f64 = self.densities.iter().sum();
        self.densities.iter().map(|d| d * cell.density / total).collect()
    }

    /// Its scene with densities that are those of a cell where they are full, so that trees keep the distances that they have in a
    /// forest of that density.
    pub fn scene_of(&self, cell: &Cell) -> Scene {
        let mut scene = Scene::clone(&self.scene);
        for (species, density) in scene.species.iter_mut().zip(self.densities(cell)) {
            species.distribution = Distribution::Density {
                map: None,
                max_density: density as f32,
                between_heights: None,
                below_slope: None,
            };
        }
        scene.sun.elevation = cell.sun_elevation;
        scene
    }

    /// Its cells, `count` of them, or half as many of a forest that is kept apart.
    pub fn cells(&self, count: usize) -> Vec<Cell> {
        let n = if self.kept { count.div_ceil(2) } else { count };
        let name = u32::from_str_radix(&crate::files::digest(self.name.as_bytes())[..8], 16).unwrap_or(0);
        let mut stream = Stream::new(hash2(SEED, name));
        let [densities, suns, slopes] = [(); 3].map(|()| strata(n, &mut stream));
        (0..n)
            .map(|k| {
                let [low, high] = self.range.map(f64::ln);
                let sun = ELEVATIONS[0] + (ELEVATIONS[1] - ELEVATIONS[0]) * suns[k];
                // The lower half of the stratum is level; the other goes evenly from one way to the other.
                let tilt = if k % 2 == 0 { 0.0 } else { STEEPEST * (2.0 * slopes[k] - 1.0) };
                let least = (LEAST_OVER_SLOPE - sun).min(0.0);
                let kept = self.kept || k % KEPT_EVERY == KEPT_EVERY - 1;
                Cell {
                    name: format!("{}-{}", self.name, k + 1),
                    forest: self.name.clone(),
                    density: round((low + (high - low) * densities[k]).exp(), 1e4),
                    sun_elevation: round(sun, 1.0),
                    slope: round(tilt.max(least), 1.0),
                    part: if kept { Part::Kept } else { Part::Tuning },
                }
            })
            .collect()
    }
}

/// To so many parts of one, for names and tables that people read.
fn round(x: f64, parts: f64) -> f64 {
    (x * parts).round() / parts
}

/// A random place in each of n strata of [0, 1), in random order.
fn strata(n: usize, stream: &mut Stream) -> Vec<f64> {
    let mut places: Vec<f64> = (0..n).map(|k| (k as f64 + stream.unit()) / n as f64).collect();
    for k in (1..n).rev() {
        places.swap(k, ((k + 1) as f64 * stream.unit()) as usize);
    }
    places
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_the_same_every_time_and_fill_their_ranges() {
        let forest = built_in(None).unwrap().remove(0);
        let cells = forest.cells(12);
        assert_eq!(cells, forest.cells(12));
        for third in 0..3 {
            let within =
                |x: f64, [low, high]: [f64; 2]| ((3.0 * (x - low) / (high - low)) as usize).min(2) == third;
            // Four of twelve, one more or less by the rounding to whole degrees.
            let suns = cells.iter().filter(|c| within(c.sun_elevation, ELEVATIONS)).count();
            let dense = cells.iter().filter(|c| within(c.density.ln(), DENSITIES.map(f64::ln))).count();
            assert!((3..=5).contains(&suns) && (3..=5).contains(&dense), "{third}: {suns} {dense}");
        }
        assert_eq!(cells.iter().filter(|c| c.part == Part::Kept).count(), 4);
        assert!(cells.iter().all(|c| c.sun_elevation + c.slope >= LEAST_OVER_SLOPE - 1.0));
        assert_eq!(cells.iter().filter(|c| c.slope == 0.0).count(), 6, "{cells:?}");
    }

    #[test]
    fn species_stand_in_their_proportions() {
        let forests = built_in(None).unwrap();
        let mix = forests.iter().find(|f| f.name == "oak+bush").unwrap();
        let cell = &mix.cells(3)[0];
        let [oak, bush] = mix.densities(cell)[..] else { panic!("two species") };
        // To the rounding of a density in the scene's file.
        assert!((bush / oak - 2.0).abs() < 1e-6 && (oak + bush - cell.density).abs() < 1e-12);
        let total: f64 = mean_densities(&mix.scene_of(cell)).iter().sum();
        assert!((total / cell.density - 1.0).abs() < 1e-6);
    }
}
