//! What a bench found: every sample, and what it was taken of and on. The same structures are written as JSON and read back.

use std::collections::BTreeMap;
use std::path::Path;

use super::host::Host;
use super::path::Keyframe;
use super::statistics::Summary;
use crate::frame::Tiles;
use crate::gpu::{DeviceInfo, PipelineStatistics, Stamps, TimingOptions};
use crate::scene::Scene;
use crate::settings::{KNOBS, Settings};
use crate::{Error, Result};

/// Version of [`BenchResult`]; raised when a key changes its meaning or goes.
pub const BENCH_SCHEMA_VERSION: u32 = 1;

/// Everything a bench found.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct BenchResult {
    /// [`BENCH_SCHEMA_VERSION`].
    pub schema_version: u32,
    /// `bench`.
    pub command: String,
    /// Which scene.
    pub scene: SceneIdentity,
    /// Which views.
    pub path: PathIdentity,
    /// Image size, pixels.
    pub size: [u32; 2],
    /// Value of every knob.
    pub settings: BTreeMap<String, f64>,
    /// What found the samples of trees: `graphics` or `tiles`; absent from results that are older than the choice.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rasterizer: Option<String>,
    /// What stood for a tree, near to far, as it was asked for; absent from results that are older than ladders.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ladder: Option<String>,
    /// How passes were timed.
    pub timing: TimingIdentity,
    /// Which device.
    pub device: DeviceIdentity,
    /// Which machine and build.
    pub host: Host,
    /// What came before the first sample.
    pub cold: Cold,
    /// Device memory.
    pub memory: Memory,
    /// Summary of every metric, by name.
    pub metrics: BTreeMap<String, Summary>,
    /// What several frames in flight get done; absent where it was not measured, and from results that are older.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub throughput: Option<Throughput>,
    /// Every frame in order, drawn alone.
    pub frames: Vec<Frame>,
}

/// What several frames in flight get done: the path again, each frame submitted before the ones before it are done.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Throughput {
    /// Frames in flight at once.
    pub in_flight: u32,
    /// Frames a second.
    pub frames_per_s: f64,
    /// CPU time of all threads of the process, ms a frame.
    pub cpu_ms: Option<f64>,
    /// From the end of a frame to the end of the next, ms.
    pub interval_ms: Vec<f64>,
}

impl Throughput {
    /// Of frames that ended then, ns, and took so much CPU time from the first end to the last.
    pub fn new(in_flight: u32, ends_ns: &[u64], cpu_ms: Option<f64>) -> Self {
        let between = |pair: &[u64]| pair[1].saturating_sub(pair[0]) as f64 * 1e-6;
        let interval_ms: Vec<f64> = ends_ns.windows(2).map(between).collect();
        let frames = interval_ms.len().max(1) as f64;
        let total = interval_ms.iter().sum::<f64>().max(1e-6);
        Throughput {
            in_flight,
            frames_per_s: 1e3 * frames / total,
            cpu_ms: cpu_ms.map(|ms| ms / frames),
            interval_ms,
        }
    }
}

/// Which scene.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct SceneIdentity {
    /// Name.
    pub name: String,
    /// Seed.
    pub seed: u32,
    /// BLAKE3 of the heights and of each species' model and places, in hexadecimal.
    pub assets: BTreeMap<String, String>,
}

impl SceneIdentity {
    /// Of a scene.
    pub fn new(scene: &Scene) -> Self {
        let mut assets = BTreeMap::new();
        let mut put = |name: String, content: &dyn std::fmt::Debug, bytes: &[u8]| {
            let mut hasher = blake3::Hasher::new();
            hasher.update(format!("{content:?}").as_bytes()).update(bytes);
            assets.insert(name, hasher.finalize().to_hex().to_string());
        };
        let terrain = &scene.terrain;
        let heights = terrain.heights.as_ref().map_or(&[][..], |r| &r.samples);
        put("terrain".into(), &(terrain.extent, terrain.cell_size), bytemuck::cast_slice(heights));
        let fixed = crate::bake::BakeSettings {
            rings: 1,
            resolution: 16,
            occlusion_rays: 8,
            transfer_bands: 0,
            transfer_resolution: 8,
        };
        for s in &scene.species {
            let model = crate::bake::cache::views_key(&s.mesh, &s.optics, &fixed);
            put(format!("species {}", s.name), &(s.scale, &s.distribution), &model);
        }
        put("light".into(), &(scene.sun, &scene.sky), &[]);
        if let Some(wind) = &scene.wind {
            put("wind".into(), wind, &[]);
        }
        SceneIdentity { name: scene.name.clone(), seed: scene.seed, assets }
    }
}

/// Which views, in which order.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct PathIdentity {
    /// Name.
    pub name: String,
    /// Seconds of the path between frames.
    pub step_s: f64,
    /// Views of a round: frame `k` draws view `k` modulo this.
    pub views: u32,
    /// The path.
    pub keyframes: Vec<Keyframe>,
}

/// How passes were timed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct TimingIdentity {
    /// With timestamps around every pass.
    pub stamps: bool,
    /// Each pass a submission of its own.
    pub apart: bool,
    /// With pipeline statistics.
    pub pipeline_statistics: bool,
}

impl From<TimingOptions> for TimingIdentity {
    fn from(o: TimingOptions) -> Self {
        TimingIdentity {
            stamps: o.stamps == Stamps::Scopes,
            apart: o.apart,
            pipeline_statistics: o.statistics,
        }
    }
}

/// Which device.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct DeviceIdentity {
    /// Name.
    pub name: String,
    /// Device UUID.
    pub uuid: String,
    /// `cpu`, `integrated`, `discrete`, `virtual` or `other`.
    pub kind: String,
    /// Driver and its version.
    pub driver: String,
    /// Vulkan version.
    pub api: String,
}

impl From<&DeviceInfo> for DeviceIdentity {
    fn from(d: &DeviceInfo) -> Self {
        let DeviceInfo { name, uuid, driver, api, .. } = d.clone();
        DeviceIdentity { name, uuid, kind: d.kind.into(), driver, api }
    }
}

/// Wall times before the first sample, s.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Cold {
    /// Reading the scene.
    pub load_s: f64,
    /// Baking or reading the species and tables.
    pub bake_s: f64,
    /// What the cache had: species by name, `hit`, `baked` or `rebuilt`.
    pub bake_cache: BTreeMap<String, String>,
    /// Pipelines, buffers, images and their first content.
    pub build_s: f64,
    /// The first frame, with which drivers compile what they have put off, and which fills the caches.
    pub first_frame_s: f64,
    /// The second frame of the same view.
    pub second_frame_s: f64,
}

/// Device memory, bytes.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Memory {
    /// What the plan says.
    pub planned: u64,
    /// By heap, as `0 device-local`.
    pub heaps: BTreeMap<String, u64>,
    /// By buffer or image name: caches, data and targets.
    pub allocations: BTreeMap<String, u64>,
}

/// One frame.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Frame {
    /// How many times the path was gone through before.
    pub round: u32,
    /// Which view of the path.
    pub view: u32,
    /// Milliseconds from the beginning of the bench to the frame's.
    pub start_ms: f64,
    /// The same to its first submission.
    pub submit_ms: f64,
    /// The same until the device was done.
    pub done_ms: f64,
    /// The same to the first timestamp, where host and device share a clock.
    pub gpu_start_ms: Option<f64>,
    /// Choosing what is drawn and uploading it, CPU wall time, ms.
    pub stream_ms: f64,
    /// Recording commands, CPU wall time, ms.
    pub record_ms: f64,
    /// From submission to done, ms; of all submissions.
    pub wait_ms: f64,
    /// From the first to the last timestamp, ms.
    pub gpu_ms: Option<f64>,
    /// CPU time of all threads of the process, ms.
    pub cpu_ms: Option<f64>,
    /// CPU time that fixed work took just before, ms: how fast the machine was; on software drivers.
    pub pace_ms: Option<f64>,
    /// Draw commands.
    pub draws: u32,
    /// Dispatches.
    pub dispatches: u32,
    /// Trees in view drawn one by one.
    pub trees_zfield: u32,
    /// Casters of all cascades.
    pub shadow_casters: u32,
    /// Terrain quads drawn.
    pub terrain_quads: u32,
    /// Tiles produced.
    pub produced: Tiles,
    /// Tiles thrown out.
    pub evicted: Tiles,
    /// Timestamps that were missing or went backwards.
    pub lost_stamps: u32,
    /// Passes in order.
    pub passes: Vec<Scope>,
    /// Stages of several passes.
    pub stages: Vec<Scope>,
}

impl Frame {
    /// From beginning to done, ms.
    pub fn wall_ms(&self) -> f64 {
        self.done_ms - self.start_ms
    }
}

/// A pass or stage of a frame.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Scope {
    /// Name.
    pub name: String,
    /// Milliseconds from the frame's first timestamp.
    pub start_ms: f64,
    /// GPU time, ms.
    pub gpu_ms: f64,
    /// CPU time of all threads, ms; passes submitted apart on software drivers.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cpu_ms: Option<f64>,
    /// What the pipeline did.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub statistics: Option<PipelineStatistics>,
}

impl BenchResult {
    /// Reads a result that `canopy bench --json` wrote.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Input`] for another kind of file or another version.
    pub fn load(file: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(file).map_err(|e| Error::io(file, e))?;
        let remedy = "write one with `canopy bench --json`";
        let any: serde_json::Value =
            serde_json::from_str(&text).map_err(|e| Error::input(file, "", e.to_string(), remedy))?;
        let version = any["schema_version"].as_u64();
        if any["command"] != "bench" || version != Some(BENCH_SCHEMA_VERSION.into()) {
            let what = format!("no bench result of schema_version {BENCH_SCHEMA_VERSION}");
            return Err(Error::input(file, "", what, remedy));
        }
        serde_json::from_value(any).map_err(|e| Error::input(file, "", e.to_string(), remedy))
    }

    /// Every knob by name.
    pub fn settings_of(settings: &Settings) -> BTreeMap<String, f64> {
        KNOBS.iter().filter_map(|k| Some((k.name.to_string(), settings.get(k.name)?))).collect()
    }

    /// Names of all passes, in the order of a frame.
    pub fn pass_names(&self) -> Vec<String> {
        let mut names: Vec<String> = Vec::new();
        for frame in &self.frames {
            let mut after = 0;
            for p in &frame.passes {
                match names.iter().position(|n| *n == p.name) {
                    Some(k) => after = k + 1,
                    None => {
                        names.insert(after, p.name.clone());
                        after += 1;
                    }
                }
            }
        }
        names
    }

    /// Names of all metrics in the order of a table: frame, stages, passes, throughput, host.
    pub fn metric_names(&self) -> Vec<String> {
        let mut names: Vec<String> = ["wall_ms", "cpu_ms", "gpu_ms", "stream_ms", "record_ms", "wait_ms"]
            .map(|m| format!("frame.{m}"))
            .into();
        let stages = ["stream", "visibility", "image"].map(|s| format!("stage.{s}.gpu_ms"));
        names.extend(stages);
        for pass in self.pass_names() {
            names.extend(["cpu_ms", "gpu_ms"].map(|m| format!("pass.{pass}.{m}")));
        }
        names.push("throughput.interval_ms".into());
        names.push("host.pace_ms".into());
        names.retain(|n| self.metrics.contains_key(n));
        names
    }

    /// Samples of every metric in the order of frames, by name; passes that a frame does not have give none.
    pub fn samples(&self) -> BTreeMap<String, Vec<f64>> {
        let mut all: BTreeMap<String, Vec<f64>> = BTreeMap::new();
        let mut put = |name: String, value: Option<f64>| {
            if let Some(v) = value {
                all.entry(name).or_default().push(v);
            }
        };
        for f in &self.frames {
            put("frame.wall_ms".into(), Some(f.wall_ms()));
            put("frame.stream_ms".into(), Some(f.stream_ms));
            put("frame.record_ms".into(), Some(f.record_ms));
            put("frame.wait_ms".into(), Some(f.wait_ms));
            put("frame.gpu_ms".into(), f.gpu_ms);
            put("frame.cpu_ms".into(), f.cpu_ms);
            put("host.pace_ms".into(), f.pace_ms);
            for (kind, scopes) in [("pass", &f.passes), ("stage", &f.stages)] {
                for s in scopes {
                    put(format!("{kind}.{}.gpu_ms", s.name), self.timing.stamps.then_some(s.gpu_ms));
                    put(format!("{kind}.{}.cpu_ms", s.name), s.cpu_ms);
                }
            }
        }
        for interval in self.throughput.iter().flat_map(|t| &t.interval_ms) {
            put("throughput.interval_ms".into(), Some(*interval));
        }
        all
    }

    /// With its samples summarised.
    pub fn summarised(mut self) -> Self {
        let samples = self.samples();
        self.metrics = samples.into_iter().filter_map(|(name, s)| Some((name, Summary::new(&s)?))).collect();
        self
    }

    /// Rows of a table with [`CSV_COLUMNS`]: one a frame, stage and pass, of this setting ("A", or "B" with `--against`); then
    /// one an interval between ends of frames in flight, as wall time.
    pub fn csv_rows(&self, setting: &str) -> String {
        let mut text = String::new();
        let number = |v: Option<f64>| v.map_or(String::new(), |v| format!("{v:.6}"));
        for (k, f) in self.frames.iter().enumerate() {
            let at = format!("{setting},{k},{},{}", f.round, f.view);
            let made = f.produced.terrain + f.produced.seeds + f.produced.coverage;
            let gone = f.evicted.terrain + f.evicted.seeds + f.evicted.coverage;
            text += &format!(
                "{at},frame,frame,{:.6},{},{},{:.6},{:.6},{:.6},{:.6},{},{},{},{},{},{made},{gone}\n",
                f.start_ms,
                number(f.gpu_ms),
                number(f.cpu_ms),
                f.wall_ms(),
                f.stream_ms,
                f.record_ms,
                f.wait_ms,
                f.draws,
                f.dispatches,
                f.trees_zfield,
                f.shadow_casters,
                f.terrain_quads,
            );
            for (kind, scopes) in [("stage", &f.stages), ("pass", &f.passes)] {
                for s in scopes {
                    let start = f.gpu_start_ms.unwrap_or(f.submit_ms) + s.start_ms;
                    let cpu = number(s.cpu_ms);
                    text += &format!(
                        "{at},{kind},{},{start:.6},{:.6},{cpu}{}\n",
                        s.name,
                        s.gpu_ms,
                        ",".repeat(11)
                    );
                }
            }
        }
        if let Some(t) = &self.throughput {
            for (k, interval) in t.interval_ms.iter().enumerate() {
                let name = format!("in flight {}", t.in_flight);
                text += &format!("{setting},{k},,,throughput,{name},,,,{interval:.6}{}\n", ",".repeat(10));
            }
        }
        text
    }

    /// Bencher Metric Format: a benchmark `SCENE/PATH/METRIC`, its median in milliseconds with its 95 % interval. What makes
    /// this setting another than the scene's (`KNOB=VALUE`) stands behind the path's name, if something does.
    pub fn bmf(&self, knobs: &[String]) -> serde_json::Map<String, serde_json::Value> {
        let mut all = serde_json::Map::new();
        let setting: String = knobs.iter().map(|k| format!(" {k}")).collect();
        for (name, s) in &self.metrics {
            let [lower, upper] = s.interval;
            let value = serde_json::json!({ "value": s.median, "lower_value": lower, "upper_value": upper });
            let benchmark = format!("{}/{}{setting}/{name}", self.scene.name, self.path.name);
            all.insert(benchmark, serde_json::json!({ "milliseconds": value }));
        }
        all
    }
}

/// Columns of [`BenchResult::csv_rows`].
pub const CSV_COLUMNS: [&str; 20] = [
    "setting",
    "frame",
    "round",
    "view",
    "scope",
    "name",
    "start_ms",
    "gpu_ms",
    "cpu_ms",
    "wall_ms",
    "stream_ms",
    "record_ms",
    "wait_ms",
    "draws",
    "dispatches",
    "trees_zfield",
    "shadow_casters",
    "terrain_quads",
    "tiles_produced",
    "tiles_evicted",
];
