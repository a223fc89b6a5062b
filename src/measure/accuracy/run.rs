//! Measuring: each cell's reference and what is drawn of it, from files where they are there.

use std::path::{Path, PathBuf};
use std::time::Instant;

use super::design::{Cell, Forest};
use super::score::{Lit, score};
use super::{ACCURACY_SCHEMA_VERSION, Accuracy, CellResult, Drawn};
use crate::bake::{Baked, Needs, cache, load_or_bake_scene};
use crate::camera::Light;
use crate::gpu::Gpu;
use crate::ladder::Ladder;
use crate::measure::host::Host;
use crate::measure::reflectance::{
    Measured, Method, Request as Patch, measure, measure_reference, patch_scene, sees,
};
use crate::measure::results::{BenchResult, DeviceIdentity, SceneIdentity};
use crate::physics::light::luminance;
use crate::plan::Drawing;
use crate::reference::{self, Until};
use crate::scene::{Albedo, Scene};
use crate::{Error, Result};

/// Raised when cells of the same name are measured in another way.
const VERSION: u32 = 2;
/// View zenith angles in the plane of the sun, degrees; negative on the side away from it.
const ALONG: [f64; 11] = [-75.0, -60.0, -45.0, -30.0, -15.0, 0.0, 15.0, 30.0, 45.0, 60.0, 75.0];
/// View zenith angles across it.
const ACROSS: [f64; 2] = [35.0, 65.0];
/// View zenith angles about the sun's, degrees.
const ABOUT: [f64; 3] = [-3.0, 0.0, 3.0];
/// Image that distances are meant for, pixels.
pub const SIZE: [u32; 2] = [1024, 768];
/// Beyond this no view is taken: ground is seen along.
const STEEPEST_VIEW: f64 = 80.0;

/// What to draw of every cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct From {
    /// What stands for a tree.
    pub ladder: Ladder,
    /// Distance, m.
    pub distance: f64,
}

/// What is drawn if no one says: z-fields near and farther off, both at the hand-over, the shader-map far away.
pub const USUAL: [From; 4] = [
    From { ladder: Ladder::ZFIELD, distance: 200.0 },
    From { ladder: Ladder::ZFIELD, distance: 1000.0 },
    From { ladder: Ladder::BN12, distance: 3000.0 },
    From { ladder: Ladder::SHADER_MAP, distance: 6000.0 },
];

/// What to measure.
pub struct Request<'a> {
    /// The forests of the cells.
    pub forests: &'a [Forest],
    /// The whole design.
    pub cells: &'a [Cell],
    /// What of each cell is drawn.
    pub from: &'a [From],
    /// Patches and pixels.
    pub method: Method,
    /// When a reference is good enough.
    pub until: Until,
    /// Part K of N of the cells.
    pub shard: (usize, usize),
    /// Which machine and build draws.
    pub host: Host,
    /// Without progress.
    pub quiet: bool,
}

/// What a file holds: of what, and the measurements.
#[derive(serde::Serialize, serde::Deserialize)]
struct Kept<T> {
    /// Hash of all that it depends on.
    key: String,
    of: T,
}

/// Directions of a viewer that sees the ground of a cell.
fn views(cell: &Cell) -> Vec<[f64; 2]> {
    let sun = 90.0 - cell.sun_elevation;
    let along = ALONG.into_iter().map(|z| [z, 0.0]);
    let all = along.chain(ACROSS.map(|z| [z, 90.0])).chain(ABOUT.map(|d| [sun + d, 0.0]));
    all.filter(|v| v[0].abs() <= STEEPEST_VIEW && sees(*v, cell.slope)).collect()
}

/// Measures the cells of a shard that `folder` lacks, and judges all that it then has.
///
/// # Errors
/// [`Error::Io`]; [`Error::Device`]; [`Error::Usage`] for a scene that cannot be traced or drawn.
pub fn run(gpu: &Gpu, request: &Request, folder: &Path) -> Result<Accuracy> {
    let (part, parts) = request.shard;
    let all: Vec<Work> =
        request.cells.iter().map(|c| Work::new(request, c, folder)).collect::<Result<_>>()?;
    let own: Vec<&Work> = all.iter().skip(part - 1).step_by(parts).collect();
    let (begun, mut worked) = (Instant::now(), 0);
    for (k, cell) in own.iter().enumerate() {
        let before = begun.elapsed();
        let traced = cell.trace()?;
        let drawn = cell.draw(gpu)?;
        worked += usize::from(traced || drawn > 0);
        if !request.quiet && (traced || drawn > 0) {
            let took = begun.elapsed() - before;
            let left = begun.elapsed().mul_f64((own.len() - k - 1) as f64 / worked as f64);
            crate::progress::say(&format!(
                "[{}/{}] {}: {:.0} s, at most {:.0} min left",
                k + 1,
                own.len(),
                cell.cell.name,
                took.as_secs_f64(),
                left.as_secs_f64() / 60.0
            ));
        }
    }
    judge(gpu, request, &all)
}

/// Judges all cells of the design that a folder has.
fn judge(gpu: &Gpu, request: &Request, all: &[Work]) -> Result<Accuracy> {
    let (mut cells, mut missing) = (Vec::new(), Vec::new());
    for work in all {
        let drawn: Option<Vec<Drawn>> = request.from.iter().map(|f| work.kept_drawing(*f)).collect();
        let (Some(reference), Some(drawn)) = (work.kept_reference(), drawn) else {
            missing.push(work.cell.name.clone());
            continue;
        };
        let judged = |(d, from): (Drawn, &From)| {
            let lit = Lit { averages: from.ladder.averages(), ..work.lit };
            let score = score(&reference, &d.views, &lit);
            (d, score)
        };
        let drawn = drawn.into_iter().zip(request.from).map(judged).collect();
        cells.push(CellResult { cell: work.cell.clone(), reference, drawn });
    }
    let settings = request.forests.first().map(|f| f.scene.settings.clone()).unwrap_or_default();
    Ok(Accuracy {
        schema_version: ACCURACY_SCHEMA_VERSION,
        command: "accuracy".into(),
        settings: BenchResult::settings_of(&settings),
        device: DeviceIdentity::from(gpu.info()),
        host: request.host.clone(),
        cells,
        missing,
    })
}

/// A cell, and where its files are.
struct Work<'a> {
    request: &'a Request<'a>,
    cell: &'a Cell,
    scene: Scene,
    /// The scene of its patches.
    patch: Scene,
    densities: Vec<f64>,
    views: Vec<[f64; 2]>,
    lit: Lit,
    /// Of all that the reference depends on.
    key: String,
    folder: PathBuf,
}

impl<'a> Work<'a> {
    fn new(request: &'a Request<'a>, cell: &'a Cell, folder: &Path) -> Result<Self> {
        let of = |f: &&Forest| f.name == cell.forest;
        let forest = request.forests.iter().find(of);
        let forest = forest.ok_or_else(|| Error::Usage(format!("no forest \"{}\"", cell.forest)))?;
        let (scene, densities) = (forest.scene_of(cell), forest.densities(cell));
        let light = Light::new(&scene);
        let sun_zenith = 90.0 - cell.sun_elevation;
        let patch = patch_scene(&scene, &densities, sun_zenith, cell.slope)?;
        let Albedo::Uniform(albedo) = patch.terrain.albedo else {
            return Err(Error::Usage("a patch is of one colour".into()));
        };
        let facing = (sun_zenith - cell.slope).to_radians().cos().max(0.0);
        let lit = |k: usize| f64::from(albedo[k]) * light.sun[k] * facing / std::f64::consts::PI;
        let lit =
            Lit { sun_zenith, slope: cell.slope, ground: luminance([0, 1, 2].map(lit)), averages: false };
        let views = views(cell);
        let what = (VERSION, cell, &views, SceneIdentity::new(&patch), albedo);
        let how = (request.method, format!("{:?}", request.until), scene.settings.indirect);
        let key = crate::files::digest(format!("{what:?} {how:?}").as_bytes())[..16].to_string();
        Ok(Work { request, cell, scene, patch, densities, views, lit, key, folder: folder.join("cells") })
    }

    fn reference_file(&self) -> PathBuf {
        self.folder.join(format!("{}.reference.json", self.cell.name))
    }

    fn drawing_file(&self, from: From) -> PathBuf {
        let ladder = from.ladder.name().replace([':', ','], "_");
        self.folder.join(format!("{}.{ladder}.{}m.json", self.cell.name, from.distance))
    }

    /// Of what is drawn: the reference's, the program and the knobs.
    fn drawing_key(&self) -> String {
        let knobs = BenchResult::settings_of(&self.scene.settings);
        crate::files::digest(format!("{} {knobs:?} {:?}", self.key, self.request.host.program).as_bytes())
            [..16]
            .to_string()
    }

    /// Surfaces that light may meet on its way in the reference: as many as what is drawn counts.
    fn bounces(&self) -> Option<u32> {
        if self.scene.settings.indirect > 0 { None } else { Some(1) }
    }

    fn kept_reference(&self) -> Option<Vec<Measured>> {
        read(&self.reference_file(), &self.key)
    }

    fn kept_drawing(&self, from: From) -> Option<Drawn> {
        read(&self.drawing_file(from), &self.drawing_key())
    }

    /// Traces the reference if it is not there; whether it was not.
    fn trace(&self) -> Result<bool> {
        if self.kept_reference().is_some() {
            return Ok(false);
        }
        let options = reference::Options {
            bounces: self.bounces(),
            until: self.request.until,
            ..reference::Options::default()
        };
        let angles = [self.lit.sun_zenith, self.cell.slope];
        let found = measure_reference(
            &self.scene,
            &self.densities,
            &self.request.method,
            angles,
            &self.views,
            &options,
            &mut |_| (),
        )?;
        write(&self.reference_file(), &self.key, &found)?;
        Ok(true)
    }

    /// Draws what is not there; how much that was.
    fn draw(&self, gpu: &Gpu) -> Result<usize> {
        let lacks = |f: &&From| self.kept_drawing(**f).is_none();
        let wanted: Vec<&From> = self.request.from.iter().filter(lacks).collect();
        if wanted.is_empty() {
            return Ok(0);
        }
        let baked = load_or_bake_scene(
            &self.patch,
            Needs::of(wanted.iter().map(|f| f.ladder)),
            cache::default_dir().as_deref(),
            self.request.quiet,
        )?;
        let baked: Vec<Baked> = baked.into_iter().map(|b| b.0).collect();
        let camera = self.scene.camera(None)?;
        for from in &wanted {
            let drawing = Drawing { ladder: Some(from.ladder), rasterizer: None };
            let request = Patch {
                sun_zenith: self.lit.sun_zenith,
                slope: self.cell.slope,
                distance: from.distance,
                drawing,
                views: self.views.clone(),
            };
            let views = measure(
                gpu,
                &self.scene,
                &self.densities,
                &baked,
                (camera, SIZE),
                &self.request.method,
                &request,
                &mut || (),
            )?;
            let drawn = Drawn { ladder: from.ladder.name(), distance: from.distance, views };
            write(&self.drawing_file(**from), &self.drawing_key(), &drawn)?;
        }
        Ok(wanted.len())
    }
}

/// What a file holds, if it is there and of this key.
fn read<T: serde::de::DeserializeOwned>(file: &Path, key: &str) -> Option<T> {
    let text = std::fs::read_to_string(file).ok()?;
    let kept: Kept<T> = serde_json::from_str(&text).ok()?;
    (kept.key == key).then_some(kept.of)
}

fn write<T: serde::Serialize>(file: &Path, key: &str, of: &T) -> Result<()> {
    if let Some(folder) = file.parent() {
        std::fs::create_dir_all(folder).map_err(|e| Error::io(folder, e))?;
    }
    let text = serde_json::to_string(&Kept { key: key.into(), of })
        .map_err(|e| Error::io(file, std::io::Error::other(e)))?;
    crate::files::write_whole(file, (text + "\n").as_bytes())
}
