//! `canopy render`.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use canopy::bake::{Baked, CacheState, cache, load_or_bake_scene};
use canopy::camera::{Eye, auto_exposure};
use canopy::frame::{FrameReport, Renderer};
use canopy::gpu::{DeviceInfo, FrameCapture, Gpu, PassTime, Stamps, TimingOptions};
use canopy::ladder::{Ladder, Rung};
use canopy::measure::results::SceneIdentity;
use canopy::measure::sweep::kept::{self, Choice, Subject};
use canopy::plan::{Plan, ViewMode};
use canopy::progress::Progress;
use canopy::scene::{Camera, Scene};
use canopy::settings::Settings;
use canopy::{Error, Result};

use super::SCHEMA_VERSION;
use super::options::{
    self, DeviceOptions, Drawn, PrintOptions, RasterizerOptions, ReferenceOptions, SceneOptions, knobs_help,
    named,
};
use super::output::{self, Table};
use super::reference;

const EXAMPLES: &str = "\
Examples:
  canopy render -o ridge.png                          the built-in scene, first camera
  canopy render -o close.png --camera close           another of its cameras: ridge-line, near, aerial, close
  canopy render my.toml -o a.png --exr a.exr          your scene, and linear radiance in layers
  canopy render --size 320x240 --quality fast         small and quick
  canopy render --set samples=8 --set cascades=2      turn knobs; --help lists them all
  canopy render --set accumulation=16 -o still.png    the mean of 16 frames, each shifted by a part of a pixel: a smooth still
  canopy render --view-mode fractions -o k.png        lit and shadowed ground and trees
  canopy render --budget 50ms                         the most accurate setting that `canopy sweep` found to hold 50 ms
  canopy render --frames 5 --json > report.json       warm timings for a script
  canopy render --representation reference --camera near --size 512x384 --until 5% --resume near.sums -o truth.png
                                                      path tracing of the real trees on the CPU; run it again to go on
The reference is Monte-Carlo: every tree's own triangles, on the seeds that the renderer draws. Its error is the root mean
square, over pixels and channels, of the standard error of the radiance, over the root mean square radiance; a quarter of the
error takes sixteen times the time. Its EXR also has the layers variance (of the mean radiance) and samples. It opens no
Vulkan device. --bounces 1 is light that met one surface, as the renderer draws it with --set indirect=0.";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES, after_long_help = format!("{EXAMPLES}\n\n{}", knobs_help()))]
pub struct Args {
    #[command(flatten)]
    scene: SceneOptions,
    /// Picture to write; left out: NAME.png after the scene, or canopy.png
    #[arg(short, long, value_name = "FILE.png")]
    output: Option<PathBuf>,
    /// Linear image to write, with layers radiance, sun, sky, depth, trees, species, fractions
    #[arg(long, value_name = "FILE.exr")]
    exr: Option<PathBuf>,
    /// Draw what the renderer decides instead of light: fractions (lit and shadowed ground, lit and shadowed trees), coverage,
    /// lod, cascades, normals
    #[arg(long, value_name = "MODE", default_value = "radiance", value_parser = named(ViewMode::NAMES))]
    view_mode: ViewMode,
    /// Draw at the most accurate setting that a sweep found to hold this time, such as 50ms, instead of --quality and --set
    #[arg(long, value_name = "TIME", value_parser = options::time, conflicts_with_all = ["preset", "set"])]
    budget: Option<Duration>,
    /// Sweep that --budget takes the setting from; left out: the last one of this scene, size and device
    #[arg(long, value_name = "FILE.json", requires = "budget")]
    sweep: Option<PathBuf>,
    /// What stands for a tree, near to far: rungs, each with the apparent height of a tree in pixels down to which it is used, such
    /// as mesh:256,zfield:4,shader-map; a height that is left out is the knob's. Instead of the scene's [quality] ladder
    #[arg(long, value_name = "RUNG:PIXELS,…,RUNG", value_parser = str::parse::<Ladder>, conflicts_with = "representation")]
    ladder: Option<Ladder>,
    /// Shorthand for a ladder: auto (mesh,zfield,shader-map; without mesh where that cannot be drawn), zfield or shader-map at any distance; or reference: path tracing on the CPU
    #[arg(long, value_name = "NAME", value_parser = named(Drawn::names()))]
    representation: Option<Drawn>,
    #[command(flatten)]
    rasterizer: RasterizerOptions,
    #[command(flatten)]
    reference: ReferenceOptions,
    /// Reference: file to go on from, if it is there, and to write to: now and then, and at the end
    #[arg(long, value_name = "FILE")]
    resume: Option<PathBuf>,
    /// Stops brighter (or, negative, darker) than the automatic exposure
    #[arg(long, value_name = "EV", default_value_t = 0.0, allow_negative_numbers = true, value_parser = stops)]
    exposure: f64,
    /// Frames to draw. The first one also fills the caches; times of passes are the last one's
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    frames: u32,
    /// Capture frame N of --frames, from 1, with the RenderDoc that the program runs under
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    capture_frame: Option<u32>,
    #[command(flatten)]
    device: DeviceOptions,
    #[command(flatten)]
    print: PrintOptions,
}

#[derive(serde::Serialize)]
struct SceneReport<'a> {
    name: &'a str,
    seed: u32,
    species: Vec<&'a str>,
    camera: &'a str,
    size: [u32; 2],
    exposure: f64,
}

#[derive(serde::Serialize)]
struct Trees<'a> {
    in_view: u32,
    /// By the nearest rung that has a part in drawing them one by one.
    by_rung: BTreeMap<&'static str, u32>,
    casters_by_cascade: &'a [u32],
}

#[derive(serde::Serialize)]
struct Allocation {
    name: String,
    bytes: u64,
}

#[derive(serde::Serialize)]
struct Memory {
    planned_bytes: u64,
    allocated_bytes: u64,
    allocations: Vec<Allocation>,
}

/// Wall times, s.
#[derive(serde::Serialize)]
struct Timings {
    load_s: f64,
    bake_s: f64,
    build_s: f64,
    frames_s: Vec<f64>,
    write_s: f64,
}

#[derive(serde::Serialize)]
struct Bake<'a> {
    species: &'a str,
    /// Where its views came from.
    cache: &'static str,
    /// Where their light transfer came from; null where nothing needed it.
    transfer: Option<&'static str>,
    /// Where its tables came from.
    tables: &'static str,
}

#[derive(serde::Serialize)]
struct Validation {
    enabled: bool,
    messages: Vec<String>,
}

#[derive(serde::Serialize)]
struct Outputs {
    png: String,
    exr: Option<String>,
    captures: Vec<String>,
}

#[derive(serde::Serialize)]
struct Report<'a> {
    schema_version: u32,
    command: &'static str,
    scene: SceneReport<'a>,
    settings: &'a Settings,
    /// Left out without `--budget`.
    #[serde(skip_serializing_if = "Option::is_none")]
    budget: Option<Choice>,
    device: &'a DeviceInfo,
    plan: &'a Plan,
    bakes: Vec<Bake<'a>>,
    passes: &'a [PassTime],
    gpu_ms: f64,
    trees: Trees<'a>,
    terrain_quads: u32,
    seed_quads: u32,
    memory: Memory,
    timings: Timings,
    validation: Validation,
    outputs: Outputs,
}

pub fn run(args: &Args) -> Result<()> {
    if args.exr.is_some() && args.view_mode != ViewMode::Radiance {
        return Err(Error::Usage("--exr holds radiance: leave out --view-mode".into()));
    }
    if let Some(png) = &args.output {
        output::check(png, "png")?;
    }
    if let Some(exr) = &args.exr {
        output::check(exr, "exr")?;
    }
    let traced = args.representation == Some(Drawn::Reference);
    if traced {
        refuse_for_reference(args)?;
    } else {
        args.reference.refuse()?;
        if args.resume.is_some() {
            return Err(Error::Usage("--resume is for --representation reference".into()));
        }
    }
    let capture = args.capture_frame.map(|n| match n <= args.frames {
        true => FrameCapture::attached(),
        false => {
            Err(Error::Usage(format!("--capture-frame {n}: only {} of --frames are drawn", args.frames)))
        }
    });
    let capture = capture.transpose()?;
    let (quiet, start) = (args.print.quiet, Instant::now());
    let loading = Progress::new("loading", 1, quiet);
    let (mut scene, camera) = args.scene.load()?;
    loading.finish();
    let png = args.output.clone().unwrap_or_else(|| match args.scene.scene {
        Some(_) => format!("{}.png", scene.name).into(),
        None => "canopy.png".into(),
    });
    output::check(&png, "png")?;
    let load_s = start.elapsed().as_secs_f64();
    if traced {
        return reference::render(reference::Request {
            scene: &scene,
            camera: &camera,
            size: args.scene.size,
            options: args.reference.options(reference::DEFAULT_UNTIL, false),
            resume: args.resume.as_deref(),
            exposure: auto_exposure(&scene) * args.exposure.exp2(),
            png: &png,
            exr: args.exr.as_deref(),
            load_s,
            print: args.print,
        });
    }
    if let Some(Drawn::By(ladder)) = args.ladder.map(Drawn::By).or(args.representation) {
        scene.ladder = ladder;
    }
    args.device.with(|gpu| draw(args, gpu, scene, &camera, png, load_s, capture))
}

/// Refuses what only the renderer does.
fn refuse_for_reference(args: &Args) -> Result<()> {
    let given = [
        (args.view_mode != ViewMode::Radiance, "--view-mode"),
        (args.rasterizer.chosen().is_some(), "--rasterizer"),
        (args.frames != 1, "--frames"),
        (args.capture_frame.is_some(), "--capture-frame"),
        (args.device.device.is_some(), "--device"),
        (args.device.validate, "--validate"),
    ];
    match given.into_iter().find(|g| g.0) {
        Some((_, name)) => {
            Err(Error::Usage(format!("{name}: the reference is not drawn on a Vulkan device")))
        }
        None => Ok(()),
    }
}

fn stops(text: &str) -> std::result::Result<f64, String> {
    match text.parse() {
        Ok(ev) if (-64.0..=64.0).contains(&ev) => Ok(ev),
        _ => Err("write a number of stops from -64 to 64".into()),
    }
}

/// Everything between opening and closing the device.
#[allow(clippy::too_many_arguments)]
fn draw(
    args: &Args,
    gpu: &Gpu,
    mut scene: Scene,
    camera: &Camera,
    png: PathBuf,
    load_s: f64,
    mut capture: Option<FrameCapture>,
) -> Result<()> {
    let quiet = args.print.quiet;
    let budget = args.budget.map(|t| choose(args, gpu, &scene, t)).transpose()?;
    if let Some(choice) = &budget {
        scene.settings = choice.settings.clone();
    }
    let eye = Eye::new(camera, &scene.terrain, args.scene.size);
    let drawing = args.rasterizer.drawing(None);
    let mut plan = Plan::for_eye(&scene, &eye, args.exr.is_some(), drawing, Some(gpu.info()))?;
    plan.view_mode = args.view_mode;
    plan.list(&scene);
    let scene = Arc::new(scene);
    let start = Instant::now();
    let (mut baked, mut states): (Vec<Baked>, Vec<Bake>) = (Vec::new(), Vec::new());
    let found = load_or_bake_scene(&scene, &plan, cache::default_dir().as_deref(), quiet)?;
    for (s, (bake, from)) in scene.species.iter().zip(found) {
        baked.push(bake);
        let (cache, transfer) = (from.views.name(), from.transfer.map(CacheState::name));
        states.push(Bake { species: &s.name, cache, transfer, tables: from.tables.name() });
    }
    let bake_s = start.elapsed().as_secs_f64();

    let start = Instant::now();
    let mut renderer = Renderer::new(gpu, scene.clone(), plan, &baked)?;
    let build_s = start.elapsed().as_secs_f64();
    let exposure = auto_exposure(&scene) * args.exposure.exp2();
    // Passes wait for each other's stamps only where their times are told.
    let stamps = if quiet && !args.print.json { Stamps::Ends } else { Stamps::Scopes };
    gpu.set_timing(TimingOptions { stamps, ..TimingOptions::default() });
    let progress = Progress::new("drawing", args.frames.into(), quiet);
    let mut frames_s = Vec::new();
    let mut frame = None;
    for k in 1..=args.frames {
        let start = Instant::now();
        let mut draw = || renderer.render(camera, exposure);
        frame = Some(match capture.as_mut().filter(|_| args.capture_frame == Some(k)) {
            Some(capture) => capture.around(draw),
            None => draw(),
        }?);
        frames_s.push(start.elapsed().as_secs_f64());
        progress.step(1);
    }
    progress.finish();
    let Some(frame) = frame else { return Ok(()) };

    let start = Instant::now();
    let picture = renderer.picture()?;
    picture.write_png(&png)?;
    if let Some(exr) = &args.exr {
        picture.write_exr(exr)?;
    }
    let write_s = start.elapsed().as_secs_f64();

    let allocations: Vec<Allocation> =
        gpu.memory_report().into_iter().map(|(name, bytes)| Allocation { name, bytes }).collect();
    let plan = renderer.plan();
    let report = Report {
        schema_version: SCHEMA_VERSION,
        command: "render",
        scene: SceneReport {
            name: &scene.name,
            seed: scene.seed,
            species: scene.species.iter().map(|s| s.name.as_str()).collect(),
            camera: &camera.name,
            size: plan.size,
            exposure,
        },
        settings: &scene.settings,
        budget,
        device: gpu.info(),
        plan,
        bakes: states,
        passes: &frame.timing.passes,
        gpu_ms: frame.timing.passes.iter().map(|p| p.gpu_ms).sum(),
        trees: trees(&frame, plan),
        terrain_quads: frame.terrain_quads,
        seed_quads: frame.seed_quads,
        memory: Memory {
            planned_bytes: plan.bytes(),
            allocated_bytes: allocations.iter().map(|a| a.bytes).sum(),
            allocations,
        },
        timings: Timings { load_s, bake_s, build_s, frames_s, write_s },
        validation: Validation { enabled: args.device.validate, messages: gpu.messages() },
        outputs: Outputs {
            png: png.display().to_string(),
            exr: args.exr.as_ref().map(|p| p.display().to_string()),
            captures: capture.iter().flat_map(FrameCapture::files).map(|p| p.display().to_string()).collect(),
        },
    };
    if args.print.json {
        output::json(&report)
    } else if quiet {
        Ok(())
    } else {
        output::print(&text(&report))
    }
}

/// The setting that holds a time.
fn choose(args: &Args, gpu: &Gpu, scene: &Scene, time: Duration) -> Result<Choice> {
    let subject = Subject {
        scene: SceneIdentity::new(scene),
        size: args.scene.size,
        device: gpu.info().into(),
        rasterizer: args.rasterizer.chosen().map(|r| r.name().into()),
        ladder: kept::kept_ladder(&scene.ladder),
    };
    let file = match &args.sweep {
        Some(file) => file.clone(),
        None => {
            let cache =
                cache::default_dir().ok_or_else(|| Error::Usage("no cache; name a --sweep".into()))?;
            let [w, h] = subject.size;
            Some(kept::file(&cache, subject.clone())?).filter(|f| f.exists()).ok_or_else(|| {
                Error::Usage(format!(
                    "--budget: no sweep of this scene at {w}x{h} on {} is known\n  remedy: canopy sweep {}--size {w}x{h} \
                     -o DIR, or name one with --sweep FILE.json",
                    subject.device.name,
                    args.scene.scene.as_ref().map_or(String::new(), |s| format!("{} ", s.display()))
                ))
            })?
        }
    };
    kept::choose(&file, &subject, 1e3 * time.as_secs_f64())
}

fn trees<'a>(frame: &'a FrameReport, plan: &Plan) -> Trees<'a> {
    let [all, meshes, cards] = [frame.trees.camera, frame.trees.meshes, frame.trees.cards];
    // In the band of a hand-over a tree is on both of its sides.
    let rungs = [
        plan.meshes.then_some((Rung::Mesh.name(), meshes)),
        plan.cards.then_some((Rung::Cards.name(), cards)),
        (plan.z_fields || !plan.cards).then_some((Rung::ZField.name(), all - (meshes + cards).min(all))),
    ];
    Trees {
        in_view: all,
        by_rung: rungs.into_iter().flatten().collect(),
        casters_by_cascade: &frame.trees.cascades,
    }
}

fn text(r: &Report) -> String {
    let mut text = format!(
        "{}, camera {}, {} x {} on {}\n\n",
        r.scene.name, r.scene.camera, r.scene.size[0], r.scene.size[1], r.device.name
    );
    if let Some(c) = &r.budget {
        let differs = match &c.differs[..] {
            [] => String::new(),
            all => format!("; another {} than here", all.join(" and another ")),
        };
        text += &format!(
            "{} holds {} ms: frames took {:.1} ms, with an error of {:.2} %, on {} with {}{differs} ({})\n\n",
            c.setting,
            c.budget_ms,
            c.wall_ms.value,
            100.0 * c.error.value,
            c.device,
            c.cpu,
            c.sweep
        );
    }
    let mut passes = Table::new(1, &["pass", "GPU ms"]);
    for p in r.passes {
        passes.row([p.name.clone(), format!("{:.2}", p.gpu_ms)]);
    }
    passes.row(["total".into(), format!("{:.2}", r.gpu_ms)]);
    text += &passes.text();

    let mut drawn = Table::new(1, &["drawn", ""]);
    drawn.row(["rasterizer".into(), r.plan.rasterizer.name().into()]);
    drawn.row(["ladder".into(), r.plan.ladder.to_string()]);
    for (rung, n) in &r.trees.by_rung {
        drawn.row([format!("trees as {rung}"), n.to_string()]);
    }
    for (k, n) in r.trees.casters_by_cascade.iter().enumerate() {
        drawn.row([format!("trees in cascade {k}"), n.to_string()]);
    }
    drawn.row(["terrain quads".into(), r.terrain_quads.to_string()]);
    drawn.row(["seed quads".into(), r.seed_quads.to_string()]);
    text += &format!("\n{}", drawn.text());
    if let Some(why) = &r.plan.no_meshes {
        text += &format!("\nno tree is a mesh: {why}\n");
    }

    let mut memory = Table::new(1, &["device memory", ""]);
    for i in r.plan.items.iter().filter(|i| i.bytes() > 0) {
        memory.row([i.name.clone(), output::bytes(i.bytes())]);
    }
    memory.row(["planned".into(), output::bytes(r.memory.planned_bytes)]);
    memory.row(["allocated".into(), output::bytes(r.memory.allocated_bytes)]);
    text += &format!("\n{}", memory.text());

    let mut time = Table::new(1, &["time", "s"]);
    let t = &r.timings;
    let made =
        |b: &&Bake| [Some(b.cache), b.transfer, Some(b.tables)].into_iter().flatten().any(|c| c != "hit");
    let baked = r.bakes.iter().filter(made).count();
    let bakes = format!("bake ({baked} made, {} from the cache)", r.bakes.len() - baked);
    for (what, s) in [("load".into(), t.load_s), (bakes, t.bake_s), ("build".into(), t.build_s)] {
        time.row([what, format!("{s:.3}")]);
    }
    time.row(["first frame".into(), format!("{:.3}", t.frames_s[0])]);
    if let [_, .., last] = t.frames_s[..] {
        time.row(["last frame".into(), format!("{last:.3}")]);
    }
    time.row(["read back and write".into(), format!("{:.3}", t.write_s)]);
    text += &format!("\n{}\nwrote {}\n", time.text(), r.outputs.png);
    for path in r.outputs.exr.iter().chain(&r.outputs.captures) {
        text += &format!("wrote {path}\n");
    }
    text
}
