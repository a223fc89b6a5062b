//! `canopy bench`.

use std::path::{Path, PathBuf};
use std::time::Instant;

use canopy::bake::cache;
use canopy::gpu::{Gpu, Stamps, TimingOptions};
use canopy::measure::bench::{Request, Subject, plan, run as measure};
use canopy::measure::compare::{Comparison, compare};
use canopy::measure::path::CameraPath;
use canopy::measure::report::markdown;
use canopy::measure::results::{BenchResult, CSV_COLUMNS};
use canopy::measure::trace::trace;
use canopy::scene::Scene;
use canopy::settings::Settings;
use canopy::{Error, Result};

use super::options::{
    DeviceOptions, LadderOptions, PrintOptions, RasterizerOptions, SceneOptions, assignment, knobs_help,
};
use super::output::{self, Table};

const EXAMPLES: &str = "\
Examples:
  canopy bench                                        the built-in scene, from behind the camera into the trees
  canopy bench my.toml --path orbit --frames 64       another path; built in: approach, orbit, ridge-flight, far-sweep
  canopy bench --path flight.csv --step 0.1           your own: time,x,y,z,target_x,target_y,target_z,vertical_fov
  canopy bench --json > before.json                   every sample, for `canopy compare`
  canopy bench --csv b.csv --trace b.json --bmf m.json --quiet
  canopy bench --against cascade_size=512             two settings drawn in turn: the fair comparison
A path file in TOML has [[keyframe]] tables with time, position, target and vertical_fov; coordinates as in the scene file.

Metrics, ms: frame.wall_ms (begin to done), frame.stream_ms (choosing and uploading), frame.record_ms, frame.wait_ms
(submit to done), frame.gpu_ms (first to last timestamp), frame.cpu_ms (CPU time of all threads), pass.NAME.gpu_ms,
pass.NAME.cpu_ms, stage.NAME.gpu_ms, throughput.interval_ms (from the end of a frame to that of the next with --in-flight
frames at once; all other times are of frames drawn alone: their latency), host.pace_ms (CPU time of fixed work before a
frame: how fast the machine was).
Reading back and encoding are not in any of them. On software drivers each pass is submitted by itself, so that its
CPU time is known, which is steadier than wall time (--together: as on hardware).";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES, after_long_help = format!("{EXAMPLES}\n\n{}", knobs_help()))]
pub struct Args {
    #[command(flatten)]
    scene: SceneOptions,
    /// Camera path: approach, orbit, ridge-flight, far-sweep, or a .csv or .toml file of keyframes
    #[arg(long, value_name = "NAME|FILE", default_value = "approach")]
    path: String,
    /// Seconds of the path between frames
    #[arg(long, value_name = "SECONDS", default_value_t = 0.5)]
    step: f64,
    /// Most frames (of each setting); the path is gone through again and again
    #[arg(long, value_name = "N", default_value_t = 128, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    frames: u32,
    /// Most seconds for all frames; whichever of --frames and --duration is reached first ends the bench
    #[arg(long, value_name = "SECONDS", default_value_t = 120.0)]
    duration: f64,
    /// Measure a second setting in turn with the first (A B, B A, …), which differs in this knob; repeatable: several knobs
    #[arg(long, value_name = "KNOB=VALUE", value_parser = assignment)]
    against: Vec<(String, f64)>,
    #[command(flatten)]
    ladder: LadderOptions,
    #[command(flatten)]
    rasterizer: RasterizerOptions,
    /// Count vertices, primitives, fragments and invocations of each pass
    #[arg(long)]
    pipeline_statistics: bool,
    /// Then draw the path with so many frames in flight, for a quarter of the frames and time at most, and tell frames a second
    /// (0: do not)
    #[arg(long, value_name = "N", default_value_t = 2, value_parser = clap::value_parser!(u32).range(0..=8))]
    in_flight: u32,
    /// No timestamps: to see what they cost themselves
    #[arg(long)]
    no_stamps: bool,
    /// On software drivers too, one submission a frame, without CPU times of passes
    #[arg(long)]
    together: bool,
    /// Write one row a frame, stage and pass
    #[arg(long, value_name = "FILE.csv")]
    csv: Option<PathBuf>,
    /// Write a trace for Perfetto (ui.perfetto.dev)
    #[arg(long, value_name = "FILE.json")]
    trace: Option<PathBuf>,
    /// Write Bencher Metric Format
    #[arg(long, value_name = "FILE.json")]
    bmf: Option<PathBuf>,
    /// Write the result with every sample, as --json prints it
    #[arg(short, long, value_name = "FILE.json")]
    output: Option<PathBuf>,
    /// Print a table in Markdown instead
    #[arg(long, conflicts_with = "json")]
    markdown: bool,
    #[command(flatten)]
    device: DeviceOptions,
    #[command(flatten)]
    print: PrintOptions,
}

/// What `--json` prints: a result, and with `--against` the second one.
#[derive(serde::Serialize)]
struct Report<'a> {
    #[serde(flatten)]
    result: &'a BenchResult,
    #[serde(skip_serializing_if = "Option::is_none")]
    against: Option<Against<'a>>,
}

/// The second setting, and both compared.
#[derive(serde::Serialize)]
struct Against<'a> {
    result: &'a BenchResult,
    comparison: Comparison,
}

pub fn run(args: &Args) -> Result<()> {
    if let Some(csv) = &args.csv {
        output::check(csv, "csv")?;
    }
    for json in [&args.trace, &args.bmf, &args.output].into_iter().flatten() {
        output::check(json, "json")?;
    }
    if args.duration.is_nan() || args.duration <= 0.0 {
        return Err(Error::Usage(format!("--duration {} s is no time", args.duration)));
    }
    let start = Instant::now();
    let (mut scene, camera) = args.scene.load()?;
    args.ladder.set(&mut scene);
    let load_s = start.elapsed().as_secs_f64();
    let path = match CameraPath::BUILTIN.iter().any(|b| b.0 == args.path) || !Path::new(&args.path).exists() {
        true => CameraPath::builtin(&args.path, &scene, &camera)?,
        false => CameraPath::load(Path::new(&args.path), &scene)?,
    };
    let mut settings = vec![scene.settings.clone()];
    if !args.against.is_empty() {
        let mut other = scene.settings.clone();
        args.against.iter().try_for_each(|(name, value)| other.set(name, *value))?;
        settings.push(other);
    }
    let results = args.device.with(|gpu| bench(args, gpu, &scene, settings, path, load_s))?;
    report(args, &results)
}

/// Everything between opening and closing the device.
fn bench(
    args: &Args,
    gpu: &Gpu,
    scene: &Scene,
    settings: Vec<Settings>,
    path: CameraPath,
    load_s: f64,
) -> Result<Vec<BenchResult>> {
    if args.pipeline_statistics && !gpu.info().pipeline_statistics {
        return Err(Error::NoDevice(format!("{} has no pipeline statistics", gpu.info().name)));
    }
    let software = gpu.info().kind == "cpu";
    let request = Request {
        path,
        step: args.step,
        frames: args.frames,
        duration: args.duration,
        timing: TimingOptions {
            stamps: if args.no_stamps { Stamps::None } else { Stamps::Scopes },
            apart: software && !args.together,
            statistics: args.pipeline_statistics,
        },
        pace: software,
        in_flight: args.in_flight,
        validate: args.device.validate,
    };
    let views = request.path.views(request.step)?;
    let subject = |settings| {
        let scene = Scene { settings, ..scene.clone() };
        let plan = plan(&scene, &views, args.scene.size, args.rasterizer.chosen(), gpu)?;
        let mut subject = Subject::new(gpu, scene, plan, cache::default_dir().as_deref(), args.print.quiet)?;
        subject.cold.load_s = load_s;
        Ok(subject)
    };
    let mut subjects = settings.into_iter().map(subject).collect::<Result<Vec<_>>>()?;
    measure(gpu, &mut subjects, &request, args.print.quiet)
}

/// Writes and prints.
fn report(args: &Args, results: &[BenchResult]) -> Result<()> {
    let first = &results[0];
    let knobs: Vec<String> = args.against.iter().map(|(k, v)| format!("{k}={v}")).collect();
    let settings: Vec<(&BenchResult, &[String])> = results.iter().zip([&[][..], &knobs]).collect();
    if let Some(file) = &args.csv {
        let rows: String = results.iter().zip(["A", "B"]).map(|(r, setting)| r.csv_rows(setting)).collect();
        write(file, &format!("{}\n{rows}", CSV_COLUMNS.join(",")))?;
    }
    if let Some(file) = &args.trace {
        write(file, &trace(&settings).to_string())?;
    }
    if let Some(file) = &args.bmf {
        let all: serde_json::Map<_, _> = settings.iter().flat_map(|(r, knobs)| r.bmf(knobs)).collect();
        write(file, &format!("{:#}\n", serde_json::Value::from(all)))?;
    }
    let against = match results.get(1) {
        Some(result) => Some(Against { result, comparison: compare(first, result, true)? }),
        None => None,
    };
    let report = Report { result: first, against };
    if let Some(file) = &args.output {
        let text = serde_json::to_string(&report).map_err(|e| Error::io(file, std::io::Error::other(e)))?;
        write(file, &(text + "\n"))?;
    }
    if args.print.json {
        output::json(&report)
    } else if args.markdown {
        output::print(&markdown(results))
    } else if args.print.quiet {
        Ok(())
    } else {
        let compared = report.against.map_or(String::new(), |a| {
            let knobs = knobs.join(", ");
            format!("\nA as above, B with {knobs}, drawn in turn\n\n{}", super::compare::text(&a.comparison))
        });
        output::print(&(text(first) + &compared))
    }
}

fn write(file: &Path, text: &str) -> Result<()> {
    canopy::files::write_whole(file, text.as_bytes())
}

/// The table.
fn text(r: &BenchResult) -> String {
    let mut text = format!(
        "{}, path {}, {} x {} on {}{}\n{} frames, {} views a round\n\n",
        r.scene.name,
        r.path.name,
        r.size[0],
        r.size[1],
        r.device.name,
        [("ladder", &r.ladder), ("rasterizer", &r.rasterizer)]
            .map(|(what, name)| name.as_ref().map_or(String::new(), |name| format!(", {what} {name}")))
            .concat(),
        r.frames.len(),
        r.path.views
    );
    let headings = ["ms", "median", "95 % interval", "p5", "p95", "p99", "1 % low", "MAD", "n"];
    let mut table = Table::new(1, &headings);
    for name in r.metric_names() {
        let Some(s) = r.metrics.get(&name) else { continue };
        let ms = |v: f64| format!("{v:.3}");
        let interval = format!("{} – {}", ms(s.interval[0]), ms(s.interval[1]));
        let (p5, p95, p99) = (ms(s.p5), ms(s.p95), ms(s.p99));
        let (low, mad, n) = (ms(s.low_1_percent), ms(s.mad), s.count.to_string());
        table.row([name, ms(s.median), interval, p5, p95, p99, low, mad, n]);
    }
    text += &table.text();
    if let Some(t) = &r.throughput {
        let cpu = t.cpu_ms.map_or(String::new(), |ms| format!(", {ms:.3} ms of CPU time each"));
        text += &format!("\n{} in flight: {:.2} frames a second{cpu}\n", t.in_flight, t.frames_per_s);
    }
    let mut cold = Table::new(1, &["before the first sample", "s"]);
    let c = &r.cold;
    for (what, s) in [
        ("load", c.load_s),
        ("bake", c.bake_s),
        ("build, with pipelines", c.build_s),
        ("first frame", c.first_frame_s),
        ("second frame", c.second_frame_s),
    ] {
        cold.row([what.into(), format!("{s:.3}")]);
    }
    text + "\n" + &cold.text()
}
