//! Frame timings along a camera path. Several subjects (settings) are drawn in turn, so that what changes on the machine
//! changes for all of them.

use std::collections::{BTreeMap, VecDeque};
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::host::Host;
use super::pace::pace_ms;
use super::path::CameraPath;
use super::results::{
    BENCH_SCHEMA_VERSION, BenchResult, Cold, Frame, Memory, PathIdentity, SceneIdentity, Scope, Throughput,
};
use crate::Result;
use crate::bake::{Baked, load_or_bake_scene};
use crate::camera::{Eye, auto_exposure};
use crate::clock::{monotonic_ns, process_cpu_ms_since, process_cpu_ns};
use crate::frame::{FrameReport, Renderer, Ticket};
use crate::gpu::{Gpu, PassTime, Stamps, TimingOptions};
use crate::plan::{Drawing, Plan, Rasterizer};
use crate::progress::Progress;
use crate::scene::{Camera, Scene};

/// How to measure.
#[derive(Clone, Debug)]
pub struct Request {
    /// Where the camera goes.
    pub path: CameraPath,
    /// Seconds of the path between frames.
    pub step: f64,
    /// Most frames, of each subject.
    pub frames: u32,
    /// Most wall time of the samples, s.
    pub duration: f64,
    /// What recordings measure.
    pub timing: TimingOptions,
    /// The fixed work before every frame too.
    pub pace: bool,
    /// Frames in flight at once for [`Throughput`]; 0: it is not measured.
    pub in_flight: u32,
    /// The device is watched by the validation layers; for the report only.
    pub validate: bool,
}

/// One setting to measure.
pub struct Subject {
    /// What draws.
    pub renderer: Renderer,
    /// What it took to make it; the frames are added here.
    pub cold: Cold,
}

impl Subject {
    /// Bakes, or takes from the cache, and builds what draws a scene as planned.
    ///
    /// # Errors
    /// Those of [`load_or_bake_scene`] and [`Renderer::new`].
    pub fn new(gpu: &Gpu, scene: Scene, plan: Plan, cache: Option<&Path>, quiet: bool) -> Result<Self> {
        let start = Instant::now();
        let found = load_or_bake_scene(&scene, &plan, cache, quiet)?;
        let bake_s = start.elapsed().as_secs_f64();
        let named = scene.species.iter().zip(&found);
        let bake_cache = named.map(|(s, (_, from))| (s.name.clone(), from.views.name().into())).collect();
        let baked: Vec<Baked> = found.into_iter().map(|(baked, _)| baked).collect();
        let start = Instant::now();
        let renderer = Renderer::new(gpu, Arc::new(scene), plan, &baked)?;
        let build_s = start.elapsed().as_secs_f64();
        Ok(Subject { renderer, cold: Cold { bake_s, bake_cache, build_s, ..Cold::default() } })
    }

    /// Takes the time of a view of a path, which begins at the scene's.
    fn set_time(&mut self, request: &Request, view: usize) {
        let start = self.renderer.scene().time;
        self.renderer.set_time(start + request.path.time_of(view, request.step));
    }
}

/// The plan that holds every view: of the views' plans, each of which knows where the others are, the one that takes most
/// memory.
///
/// # Errors
/// As [`Plan::new`].
pub fn plan(
    scene: &Scene,
    views: &[Camera],
    size: [u32; 2],
    rasterizer: Option<Rasterizer>,
    gpu: &Gpu,
) -> Result<Plan> {
    let drawing = Drawing { rasterizer, ..Default::default() };
    let mut largest: Option<Plan> = None;
    let eyes: Vec<Eye> = views.iter().map(|v| Eye::new(v, &scene.terrain, size)).collect();
    // A narrower view's range is longer: each optics with every place. Of those with the same optics the highest eye sees farthest, or
    // that farthest from the middle.
    let places: Vec<[f64; 3]> = eyes.iter().map(|e| e.position).collect();
    let middle = scene.terrain.extent.map(|side| 0.5 * side);
    let up = |e: &Eye| e.position[2].abs();
    let aside = |e: &Eye| (e.position[0] - middle[0]).hypot(e.position[1] - middle[1]);
    let mut farthest: BTreeMap<u64, [&Eye; 2]> = BTreeMap::new();
    for eye in &eyes {
        let [high, far] = farthest.entry(eye.pixels_at_1m.to_bits()).or_insert([eye; 2]);
        if up(eye) > up(high) {
            *high = eye;
        }
        if aside(eye) > aside(far) {
            *far = eye;
        }
    }
    let mut some: Vec<&Eye> = farthest.into_values().flatten().collect();
    some.dedup_by(|a, b| std::ptr::eq(*a, *b));
    for eye in some {
        let plan = Plan::for_path(scene, eye, &places, false, drawing, Some(gpu.info()))?;
        if largest.as_ref().is_none_or(|l| plan.bytes() > l.bytes()) {
            largest = Some(plan);
        }
    }
    match largest {
        Some(plan) => Ok(plan),
        None => {
            let eye = Eye::new(scene.camera(None)?, &scene.terrain, size);
            Plan::for_eye(scene, &eye, false, drawing, Some(gpu.info()))
        }
    }
}

/// Warms each subject up, then draws the path with all of them in turn, round after round, until there are frames enough or
/// time is up. Of two subjects, which goes first alternates.
///
/// # Errors
/// Those of [`Renderer::render`], and of a path without views.
pub fn run(gpu: &Gpu, subjects: &mut [Subject], request: &Request, quiet: bool) -> Result<Vec<BenchResult>> {
    let views = request.path.views(request.step)?;
    gpu.set_timing(request.timing);
    let pace = request.pace.then_some(());
    let progress = Progress::new("warming up", 2 * subjects.len() as u64, quiet);
    for subject in subjects.iter_mut() {
        let exposure = auto_exposure(subject.renderer.scene());
        let mut draw = || -> Result<f64> {
            let start = Instant::now();
            subject.set_time(request, 0);
            subject.renderer.render(&views[0], exposure)?;
            progress.step(1);
            Ok(start.elapsed().as_secs_f64())
        };
        (subject.cold.first_frame_s, subject.cold.second_frame_s) = (draw()?, draw()?);
    }
    progress.finish();

    let progress = Progress::new("measuring", u64::from(request.frames) * subjects.len() as u64, quiet);
    let (origin, start) = (monotonic_ns(), Instant::now());
    let limit = Duration::try_from_secs_f64(request.duration).unwrap_or(Duration::MAX);
    let mut frames: Vec<Vec<Frame>> = subjects.iter().map(|_| Vec::new()).collect();
    for k in 0..request.frames as usize {
        let (round, view) = (k / views.len(), k % views.len());
        for turn in 0..subjects.len() {
            // A B, B A: neither is always the first, and a drift over four frames cancels.
            let which = if (round + view) % 2 == 0 { turn } else { subjects.len() - 1 - turn };
            let subject = &mut subjects[which];
            let pace_ms = pace.and_then(|()| pace_ms());
            let exposure = auto_exposure(subject.renderer.scene());
            subject.set_time(request, view);
            let report = subject.renderer.render(&views[view], exposure)?;
            let place = [round as u32, view as u32];
            frames[which].push(Frame { pace_ms, ..frame(report, place, origin) });
            progress.step(1);
        }
        if start.elapsed() >= limit {
            break;
        }
    }
    progress.finish();
    let mut flows = Vec::new();
    for subject in subjects.iter_mut() {
        flows.push(throughput(gpu, subject, &views, request)?);
    }
    let host = Host::here(&gpu.info().name, request.validate);
    let finished = subjects.iter().zip(frames).zip(flows).map(|((subject, frames), throughput)| {
        let found = BenchResult { throughput, ..result(gpu, subject, frames, request, views.len(), &host) };
        found.summarised()
    });
    Ok(finished.collect())
}

/// Draws the path with several frames in flight, for a quarter of the frames and time of the samples at most: how many frames a
/// second there are when none waits for the one before. Passes are not timed, and so do not wait for each other's stamps.
fn throughput(
    gpu: &Gpu,
    subject: &mut Subject,
    views: &[Camera],
    request: &Request,
) -> Result<Option<Throughput>> {
    let in_flight = request.in_flight as usize;
    if in_flight == 0 {
        return Ok(None);
    }
    gpu.set_timing(TimingOptions { stamps: Stamps::None, ..TimingOptions::default() });
    let renderer = &subject.renderer;
    let exposure = auto_exposure(renderer.scene());
    let eyes: Vec<Eye> =
        views.iter().map(|v| Eye::new(v, &renderer.scene().terrain, renderer.plan().size)).collect();
    let (frames, start) = ((request.frames as usize / 4).max(8), Instant::now());
    let limit = Duration::try_from_secs_f64(0.25 * request.duration).unwrap_or(Duration::MAX);
    let (mut waiting, mut ends, mut began) = (VecDeque::new(), Vec::new(), process_cpu_ns());
    for (view, eye) in eyes.iter().enumerate().cycle().take(in_flight + frames) {
        if waiting.len() == in_flight {
            ends.extend(waiting.pop_front().map(|t| finish(&mut subject.renderer, t)).transpose()?);
            if ends.len() == 1 {
                began = process_cpu_ns();
            }
            if ends.len() > 2 && start.elapsed() >= limit {
                break;
            }
        }
        subject.set_time(request, view);
        let renderer = &mut subject.renderer;
        let cascades = renderer.cascades(eye);
        waiting.push_back(renderer.submit(eye, &cascades, exposure)?);
    }
    for ticket in waiting {
        ends.push(finish(&mut subject.renderer, ticket)?);
    }
    gpu.set_timing(request.timing);
    let cpu_ms = process_cpu_ms_since(began);
    Ok(Some(Throughput::new(request.in_flight, &ends, cpu_ms)))
}

/// Waits for a frame; when it was done, ns.
fn finish(renderer: &mut Renderer, ticket: Ticket) -> Result<u64> {
    Ok(renderer.finish(ticket)?.0.timing.done_ns)
}

/// What is kept of a frame's report.
fn frame(report: FrameReport, [round, view]: [u32; 2], origin: u64) -> Frame {
    let t = report.timing;
    let since = |ns: u64| ns.saturating_sub(origin) as f64 * 1e-6;
    let scopes = |all: Vec<PassTime>| all.into_iter().map(Scope::from).collect();
    Frame {
        round,
        view,
        start_ms: since(report.start_ns),
        submit_ms: since(t.submit_ns),
        done_ms: since(t.done_ns),
        gpu_start_ms: t.gpu_start_ns.map(since),
        stream_ms: report.stream_ms,
        record_ms: report.record_ms,
        wait_ms: t.wait_ms,
        gpu_ms: t.gpu_ms,
        cpu_ms: report.cpu_ms,
        pace_ms: None,
        draws: t.draws,
        dispatches: t.dispatches,
        trees_zfield: report.trees.camera,
        shadow_casters: report.trees.cascades.iter().sum(),
        terrain_quads: report.terrain_quads,
        produced: report.produced,
        evicted: report.evicted,
        lost_stamps: t.lost,
        passes: scopes(t.passes),
        stages: scopes(t.stages),
    }
}

impl From<PassTime> for Scope {
    fn from(p: PassTime) -> Self {
        let PassTime { name, gpu_ms, start_ms, cpu_ms, statistics, .. } = p;
        Scope { name, start_ms, gpu_ms, cpu_ms, statistics }
    }
}

fn result(
    gpu: &Gpu,
    subject: &Subject,
    frames: Vec<Frame>,
    request: &Request,
    views: usize,
    host: &Host,
) -> BenchResult {
    let (scene, plan) = (subject.renderer.scene(), subject.renderer.plan());
    BenchResult {
        schema_version: BENCH_SCHEMA_VERSION,
        command: "bench".into(),
        scene: SceneIdentity::new(scene),
        path: PathIdentity {
            name: request.path.name.clone(),
            step_s: request.step,
            views: views as u32,
            keyframes: request.path.keyframes().to_vec(),
        },
        size: plan.size,
        settings: BenchResult::settings_of(&scene.settings),
        rasterizer: Some(plan.rasterizer.name().into()),
        ladder: Some(scene.ladder.to_string()),
        timing: gpu.timing().into(),
        device: gpu.info().into(),
        host: host.clone(),
        cold: subject.cold.clone(),
        memory: Memory {
            planned: plan.bytes(),
            heaps: gpu.heap_report().into_iter().collect(),
            allocations: gpu.memory_report().into_iter().fold(BTreeMap::new(), |mut all, (name, bytes)| {
                *all.entry(name).or_default() += bytes;
                all
            }),
        },
        metrics: BTreeMap::new(),
        throughput: None,
        frames,
    }
}
