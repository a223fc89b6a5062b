//! Measures settings one after the other, keeps what was measured, and goes on where it stopped.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::design::{HOME, Setting, Swept, most_accurate, one_at_a_time, product, with_ladders};
use super::judge;
use super::kept::kept_ladder;
use super::result::{CameraError, Identity, Point, SWEEP_SCHEMA_VERSION, Sample, SweepResult, Time};
use crate::camera::{Eye, auto_exposure};
use crate::gpu::{Gpu, Stamps, TimingOptions};
use crate::image::Layers;
use crate::ladder::Ladder;
use crate::measure::bench::{self, Subject};
use crate::measure::host::Host;
use crate::measure::metrics::{
    Estimate, Region, difference, display, flip, popping, regions, squared_errors,
};
use crate::measure::path::CameraPath;
use crate::measure::results::{BenchResult, SceneIdentity};
use crate::measure::statistics::{block_bootstrap, median};
use crate::plan::{Drawing, Plan, Rasterizer};
use crate::scene::{Camera, Scene};
use crate::settings::{Knob, Settings};
use crate::{Error, Result};

/// Name of the result in its folder.
pub const RESULT: &str = "sweep.json";
/// Folder of the pictures in the result's folder.
pub const PICTURES: &str = "pictures";
/// Part of the way to its target that a camera moves for popping.
const MOVE: f64 = 0.005;
/// Longest side of a kept picture, pixels.
const THUMBNAIL: u32 = 240;

/// What to sweep.
pub struct Request {
    /// The scene; its settings do not matter.
    pub scene: Scene,
    /// From where.
    pub cameras: Vec<Camera>,
    /// Image size, pixels.
    pub size: [u32; 2],
    /// The presets as the scene and the user change them, by name; [`HOME`] among them.
    pub presets: BTreeMap<String, Settings>,
    /// Knobs to move.
    pub knobs: Vec<Swept>,
    /// Ladders to draw at every preset.
    pub ladders: Vec<Ladder>,
    /// Frames of each camera and setting; the first only warms up.
    pub rounds: u32,
    /// No setting is begun after this.
    pub budget: Duration,
    /// Part k of n of the settings, from 1.
    pub shard: (usize, usize),
    /// Knobs of the product.
    pub product: usize,
    /// A reference for each camera, with a hash of its file; or none at all.
    pub references: Vec<(Layers, String)>,
    /// What finds the samples of trees; `None`: what suits the device.
    pub rasterizer: Option<Rasterizer>,
    /// Bakes on disk.
    pub cache: Option<PathBuf>,
    /// The device is watched by the validation layers; for the report only.
    pub validate: bool,
    /// Without progress.
    pub quiet: bool,
}

/// Sweeps, from what `folder` and those of `from` hold already. After each setting the result in `folder` is whole.
///
/// # Errors
/// [`Error::Usage`] for a preset that the device cannot draw, and where nothing fits; [`Error::Input`] for results of
/// another sweep; [`Error::Io`]; [`Error::Device`].
pub fn sweep(gpu: &Gpu, request: &Request, folder: &Path, from: &[PathBuf]) -> Result<SweepResult> {
    let deadline = Instant::now().checked_add(request.budget);
    let finest = most_accurate(&request.presets, &request.knobs)?;
    let mut result = empty(gpu, request, &finest)?;
    let pictures = folder.join(PICTURES);
    std::fs::create_dir_all(&pictures).map_err(|e| Error::io(&pictures, e))?;
    let file = folder.join(RESULT);
    if file.exists() {
        result.take(SweepResult::load(&file)?, &file)?;
    }
    for other in from {
        let file = other.join(RESULT);
        result.take(SweepResult::load(&file)?, &file)?;
        copy_pictures(&other.join(PICTURES), &pictures)?;
    }
    let mut runner = Runner { gpu, request, finest, images: None, base: None };
    let mut all = one_at_a_time(&request.presets, &request.knobs)?;
    all.extend(with_ladders(&request.presets, &request.ladders));
    let mut begun = 0;
    // The product can be chosen only when every knob has been moved.
    for part in [false, true] {
        if part {
            if all.iter().any(|s| result.points.iter().all(|p| p.name != s.name)) {
                break;
            }
            let chosen = judge::knobs_that_matter(&result, request.product);
            let swept = |k: &&Knob| request.knobs.iter().find(|s| s.knob.name == k.name).cloned();
            let knobs: Vec<Swept> = chosen.iter().filter_map(swept).collect();
            let Some(home) = request.presets.get(HOME) else { break };
            let new = product(home, &knobs, &all)?;
            begun = all.len();
            all.extend(new);
        }
        let (k, n) = request.shard;
        for (at, setting) in all.iter().enumerate().skip(begun).filter(|(at, _)| at % n == k - 1) {
            let late = deadline.is_some_and(|d| Instant::now() >= d);
            if late || result.points.iter().any(|p| p.name == setting.name) {
                continue;
            }
            let point = runner.measure(setting, &pictures)?;
            if !request.quiet {
                crate::progress::say(&format!("{}/{} {}", at + 1, all.len(), line(&point)));
            }
            result.points.push(point);
            result.write(&file)?;
        }
    }
    // In the order of the design, whoever measured them.
    let place = |name: &str| all.iter().position(|s| s.name == name).unwrap_or(all.len());
    result.points.sort_by_key(|p| place(&p.name));
    let missing = |s: &&Setting| result.points.iter().all(|p| p.name != s.name);
    result.left = all.iter().filter(missing).map(|s| s.name.clone()).collect();
    result.write(&file)?;
    Ok(result)
}

/// A point in a line.
fn line(p: &Point) -> String {
    match &p.time {
        Some(t) => format!("{}: {:.1} ms, {:.3} of {}", p.name, t.ms, t.ratio.value, p.base),
        None => format!("{}: {}", p.name, p.refused),
    }
}

fn copy_pictures(from: &Path, to: &Path) -> Result<()> {
    for entry in std::fs::read_dir(from).map_err(|e| Error::io(from, e))?.filter_map(|e| e.ok()) {
        let bytes = std::fs::read(entry.path()).map_err(|e| Error::io(entry.path(), e))?;
        crate::files::write_whole(&to.join(entry.file_name()), &bytes)?;
    }
    Ok(())
}

/// A result without points.
fn empty(gpu: &Gpu, request: &Request, finest: &Settings) -> Result<SweepResult> {
    let host = Host::here(&gpu.info().name, request.validate);
    let software = gpu.info().kind == "cpu";
    let identity = Identity {
        scene: SceneIdentity::new(&request.scene),
        size: request.size,
        cameras: request.cameras.iter().map(|c| format!("{c:?}")).collect(),
        presets: request.presets.clone(),
        most_accurate: finest.clone(),
        knobs: request.knobs.iter().map(Swept::label).collect(),
        rasterizer: request.rasterizer.map(|r| r.name().into()),
        ladder: kept_ladder(&request.scene.ladder),
        ladders: request.ladders.iter().map(Ladder::to_string).collect(),
        rounds: request.rounds,
        device: gpu.info().into(),
        cpu: (host.cpu.clone(), host.threads),
        program: host.program.clone(),
        references: request.references.iter().map(|(_, hash)| hash.clone()).collect(),
    };
    Ok(SweepResult {
        schema_version: SWEEP_SCHEMA_VERSION,
        command: "sweep".into(),
        digest: identity.digest()?,
        identity,
        host,
        quantity: if software { "cpu_ms" } else { "gpu_ms" }.into(),
        points: Vec::new(),
        left: Vec::new(),
    })
}

/// A camera's image, and that after a small move if the same plan holds it.
struct Shot {
    here: Layers,
    moved: Option<Layers>,
}

/// What lives between settings: the preset that is drawn in turn, and the images of the most accurate setting.
struct Runner<'a> {
    gpu: &'a Gpu,
    request: &'a Request,
    finest: Settings,
    images: Option<Vec<Shot>>,
    base: Option<(String, Subject)>,
}

impl Runner<'_> {
    fn scene(&self, settings: &Settings, ladder: Option<Ladder>) -> Scene {
        let scene = self.request.scene.clone();
        Scene { settings: settings.clone(), ladder: ladder.unwrap_or(scene.ladder), ..scene }
    }

    /// Measures a setting. One that the plan refuses is a point too.
    fn measure(&mut self, setting: &Setting, pictures: &Path) -> Result<Point> {
        let mut point = Point {
            name: setting.name.clone(),
            base: setting.base.clone(),
            group: setting.group,
            changed: setting.changed.clone(),
            ladder: setting.ladder.map(|l| l.to_string()),
            settings: setting.settings.clone(),
            refused: String::new(),
            time: None,
            planned_bytes: 0,
            allocated_bytes: 0,
            samples: 0,
            errors: Vec::new(),
        };
        match self.time(setting, &mut point).and_then(|()| self.errors(setting, &mut point, pictures)) {
            Err(Error::Usage(why)) if setting.name != HOME => point.refused = why,
            other => other?,
        }
        Ok(point)
    }

    /// Times a setting in turn with its preset.
    fn time(&mut self, setting: &Setting, point: &mut Point) -> Result<()> {
        let path = CameraPath::through("cameras", &self.request.cameras);
        let views = path.views(1.0)?;
        let request = bench::Request {
            step: 1.0,
            frames: self.request.rounds * views.len() as u32,
            duration: f64::INFINITY,
            timing: TimingOptions { stamps: Stamps::Ends, apart: false, statistics: false },
            pace: false,
            in_flight: 0,
            validate: self.request.validate,
            path,
        };
        let own_base = setting.name == setting.base;
        let kept = self.base.take().filter(|(name, _)| *name == setting.base && !own_base);
        let build = |settings: &Settings, ladder| {
            let scene = self.scene(settings, ladder);
            let plan = bench::plan(&scene, &views, self.request.size, self.request.rasterizer, self.gpu)?;
            Subject::new(self.gpu, scene, plan, self.request.cache.as_deref(), self.request.quiet)
        };
        let mut base = match kept {
            Some((_, subject)) => Some(subject),
            None if own_base => None,
            None => Some(build(&self.request.presets[&setting.base], None)?),
        };
        if let Some(base) = &mut base {
            // What was dropped is freed with the next frame, and not to be counted for this setting.
            base.renderer.render(&views[0], auto_exposure(&self.request.scene))?;
        }
        let bytes = || self.gpu.memory_report().iter().map(|(_, bytes)| bytes).sum::<u64>();
        let before = bytes();
        let own = build(&setting.settings, setting.ladder)?;
        let mut subjects: Vec<Subject> = base.into_iter().chain([own]).collect();
        let results = bench::run(self.gpu, &mut subjects, &request, true)?;
        point.allocated_bytes = bytes().saturating_sub(before);
        if let Some(own) = subjects.pop() {
            (point.planned_bytes, point.samples) = (own.renderer.plan().bytes(), own.renderer.plan().samples);
        }
        self.base = subjects.pop().map(|s| (setting.base.clone(), s));
        let (Some(own), Some(base)) = (results.last(), results.first()) else { return Ok(()) };
        point.time = Some(time(own, base, views.len())?);
        Ok(())
    }

    /// Draws a camera's image, and one a little nearer to its target.
    fn shot(&self, (settings, ladder): (&Settings, Option<Ladder>), camera: &Camera) -> Result<Shot> {
        let scene = self.scene(settings, ladder);
        let mut nearer = camera.clone();
        for (p, t) in nearer.position.iter_mut().zip(camera.target) {
            *p += MOVE * (t - *p);
        }
        let [eye, there] = [camera, &nearer].map(|c| Eye::new(c, &scene.terrain, self.request.size));
        let device = Some(self.gpu.info());
        let drawing = Drawing { rasterizer: self.request.rasterizer, ..Default::default() };
        let plan = Plan::for_path(&scene, &eye, &[there.position], true, drawing, device)?;
        let exposure = auto_exposure(&scene);
        let cache = self.request.cache.as_deref();
        let mut renderer = Subject::new(self.gpu, scene, plan, cache, self.request.quiet)?.renderer;
        let mut draw = |camera: &Camera| {
            renderer.render(camera, exposure)?;
            Layers::of(&renderer.picture()?).ok_or_else(|| Error::Check("a frame without layers".into()))
        };
        let here = draw(camera)?;
        let moved = match draw(&nearer) {
            Err(Error::Usage(_)) => None,
            other => Some(other?),
        };
        Ok(Shot { here, moved })
    }

    /// Errors of a setting's images, which are kept small.
    fn errors(&mut self, setting: &Setting, point: &mut Point, pictures: &Path) -> Result<()> {
        let request = self.request;
        let exposure = auto_exposure(&request.scene);
        // One device's memory: the preset's renderer makes room.
        let shots: Result<Vec<Shot>> =
            request.cameras.iter().map(|c| self.shot((&setting.settings, setting.ladder), c)).collect();
        let shots = shots?;
        if self.images.is_none() {
            let all: Result<Vec<Shot>> =
                request.cameras.iter().map(|c| self.shot((&self.finest, None), c)).collect();
            self.images = Some(all.map_err(|e| match e {
                Error::Usage(why) => Error::Usage(format!(
                    "the most accurate setting cannot be drawn: {why}\n  remedy: sweep fewer knobs (--knobs), or smaller"
                )),
                other => other,
            })?);
        }
        let Some(finest) = &self.images else { return Ok(()) };
        for (k, (shot, best)) in shots.iter().zip(finest).enumerate() {
            let reference = request.references.get(k).map(|(layers, _)| layers);
            let blocks = |reference: &Layers| {
                let parts = regions(reference);
                squared_errors(&shot.here, reference, |k| parts[k] != Region::Background).unwrap_or_default()
            };
            let moved = shot.moved.as_ref().zip(best.moved.as_ref());
            point.errors.push(CameraError {
                camera: request.cameras[k].name.clone(),
                against_reference: reference.map(|r| difference(&shot.here, r, exposure)).transpose()?,
                against_most_accurate: difference(&shot.here, &best.here, exposure)?,
                reference_blocks: reference.map(blocks).unwrap_or_default(),
                most_accurate_blocks: blocks(&best.here),
                popping: moved.and_then(|(a, r)| popping([&shot.here, a], [&best.here, r])),
            });
            let shown = [&shot.here, reference.unwrap_or(&best.here)].map(|l| display(&l.radiance, exposure));
            let map = flip(request.size, &shown[1], &shown[0]).colours;
            for (kind, rgb) in [("", &shown[0]), (" flip", &map)] {
                thumbnail(&picture_file(pictures, &setting.name, k, kind), rgb, request.size)?;
            }
        }
        Ok(())
    }
}

/// File of a setting's picture from a camera by number; `kind` is empty or ` flip`.
pub fn picture_file(folder: &Path, setting: &str, camera: usize, kind: &str) -> PathBuf {
    folder.join(format!("{setting} {camera}{kind}.png"))
}

/// Writes an RGB image, made smaller if it is large.
fn thumbnail(file: &Path, rgb: &[u8], [width, height]: [u32; 2]) -> Result<()> {
    let Some(full) = image::RgbImage::from_raw(width, height, rgb.to_vec()) else { return Ok(()) };
    let over = f64::from(width.max(height)) / f64::from(THUMBNAIL);
    if over <= 1.0 {
        return crate::image::write_png(file, rgb, [width, height]);
    }
    let size = [width, height].map(|s| ((f64::from(s) / over).round() as u32).max(1));
    let small = image::imageops::thumbnail(&full, size[0], size[1]);
    crate::image::write_png(file, small.as_raw(), size)
}

/// Time of a setting against that of its preset, frame by frame.
fn time(own: &BenchResult, base: &BenchResult, views: usize) -> Result<Time> {
    let software = own.device.kind == "cpu";
    let quantity = |f: &crate::measure::results::Frame| if software { f.cpu_ms } else { f.gpu_ms };
    let pairs = own.frames.iter().zip(&base.frames);
    let samples: Option<Vec<Sample>> = pairs
        .map(|(a, b)| {
            Some(Sample {
                round: a.round,
                view: a.view,
                ms: quantity(a)?,
                base_ms: quantity(b)?,
                wall_ms: a.wall_ms(),
            })
        })
        .collect();
    let samples = samples.ok_or_else(|| Error::NoDevice("this system tells no times of frames".into()))?;
    Ok(summarise(samples, views))
}

/// Ratio and medians of samples that follow one another round by round.
fn summarise(samples: Vec<Sample>, views: usize) -> Time {
    let rounds: Vec<&[Sample]> = samples.chunks(views.max(1)).collect();
    let warm = if rounds.len() > 1 { &rounds[1..] } else { &rounds[..] };
    let mean = |of: &dyn Fn(&Sample) -> f64| -> Vec<f64> {
        warm.iter().map(|r| r.iter().map(of).sum::<f64>() / r.len() as f64).collect()
    };
    let middle = |values: &[f64]| Estimate {
        value: median(values),
        interval: (values.len() > 2).then(|| block_bootstrap(values, 1, 0.95, median)),
    };
    let ratio = middle(&mean(&|s| (s.ms / s.base_ms).ln())).map(f64::exp);
    let wall_ms = middle(&mean(&|s| s.wall_ms));
    let ms: Vec<f64> = warm.iter().flat_map(|r| r.iter().map(|s| s.ms)).collect();
    Time { ratio, ms: median(&ms), wall_ms, samples }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(round: u32, view: u32, ms: f64, base_ms: f64) -> Sample {
        Sample { round, view, ms, base_ms, wall_ms: 2.0 * ms }
    }

    #[test]
    fn times_are_ratios_of_what_was_drawn_together() {
        // The machine gets slower round by round, and the first round is cold; the setting takes half in one view, twice in the other.
        let slow = [100.0, 1.0, 2.0, 3.0, 4.0];
        let all = (0..5u32).flat_map(|r| {
            let s = slow[r as usize];
            [sample(r, 0, 0.5 * s, s), sample(r, 1, if r == 0 { 9.0 } else { 2.0 } * s, s)]
        });
        let t = summarise(all.collect(), 2);
        assert!((t.ratio.value - 1.0).abs() < 1e-12, "{:?}", t.ratio);
        assert!(t.ratio.interval.unwrap().iter().all(|r| (r - 1.0).abs() < 1e-12));
        // Means of 0.5 and 2, twice, at 2.5 in the middle of the rounds.
        assert!((t.wall_ms.value - 2.0 * 1.25 * 2.5).abs() < 1e-12, "{:?}", t.wall_ms);
        let one = summarise(vec![sample(0, 0, 3.0, 2.0)], 1);
        assert!((one.ratio.value - 1.5).abs() < 1e-12 && one.ratio.interval.is_none());
    }
}
