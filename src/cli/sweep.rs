//! `canopy sweep`.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Duration;

use canopy::bake::cache;
use canopy::image::Layers;
use canopy::ladder::Ladder;
use canopy::measure::sweep::design::{knobs, used_by};
use canopy::measure::sweep::judge::judge;
use canopy::measure::sweep::markdown::markdown;
use canopy::measure::sweep::run::{PICTURES, Request, sweep};
use canopy::measure::sweep::{SweepResult, kept, report, truth};
use canopy::reference;
use canopy::scene::Camera;
use canopy::settings::{KNOBS, PRESETS};
use canopy::{Error, Result};

use super::options::{self, Bounces, DeviceOptions, Goal, LadderOptions, PrintOptions, RasterizerOptions};
use super::output::{self, Table};

const EXAMPLES: &str = "\
Examples:
  canopy sweep -o sweep                               the built-in scene: sweep/report.html, sweep.csv, sweep.json
  canopy sweep my.toml -o s --size 640x480 --budget 2h --cameras ridge-line,near
  canopy sweep -o s --knobs samples,view_iterations   these knobs only
  canopy sweep -o s --knobs view_rings=4/6/9 --product 0  these values only, around balanced
  canopy sweep -o s --reference truth/                errors against truth/CAMERA.exr, with a layer `variance` if it is noisy
  canopy sweep -o s --reference none                  errors against the most accurate setting only
  canopy sweep -o s --reference-until 1%                  a better reference
  canopy sweep -o s --ladders mesh:256,zfield:4,shader-map/mesh:256,cards:30,shader-map   both papers' chains at every preset, and no knobs
  canopy sweep -o s                                   again: goes on where it stopped
  canopy sweep -o s1 --shard 1/2; canopy sweep -o s2 --shard 2/2; canopy sweep -o s --from s1 --from s2
  canopy render --budget 50ms --sweep s/sweep.json    the most accurate setting that holds 50 ms there
Errors are against a path-traced reference, which is traced first if none is given (outside --budget; a few minutes) and kept as
CAMERA.exr beside the result, for going on and, through --from, for shards. Its noise is taken out of every error.
Order of work: presets, the knobs of balanced, those of fast and accurate, then a product of the knobs that matter most.";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES, after_long_help = format!("{EXAMPLES}\n\n{}", tries_help()))]
pub struct Args {
    /// Scene file (TOML); left out: the built-in scene, which needs no file
    scene: Option<PathBuf>,
    /// Image size in pixels
    #[arg(long, value_name = "WIDTHxHEIGHT", default_value = "320x240", value_parser = options::size)]
    size: [u32; 2],
    /// Cameras by name, with commas between; left out: all of the scene's
    #[arg(long, value_name = "NAME,…", value_delimiter = ',')]
    cameras: Vec<String>,
    /// Knobs to move, with commas between, such as `samples` or, with values that are tried around balanced only,
    /// `samples=1/4`; left out: all that have values to try
    #[arg(long, value_name = "KNOB,…", value_delimiter = ',')]
    knobs: Vec<String>,
    /// Ladders to draw at every preset as well, with slashes between, such as zfield:4,shader-map/cards:30,shader-map; knobs are then moved only if
    /// named
    #[arg(long, value_name = "LADDER/…", value_delimiter = '/', value_parser = str::parse::<Ladder>)]
    ladders: Vec<Ladder>,
    /// Set one knob in all presets; repeatable
    #[arg(long, value_name = "KNOB=VALUE", value_parser = options::assignment)]
    set: Vec<(String, f64)>,
    /// Linear image to hold errors against, a folder with CAMERA.exr for each camera, or none; left out: traced first
    #[arg(long, value_name = "FILE.exr|DIR|none")]
    reference: Option<PathBuf>,
    /// When the reference that is traced is good enough: an error of a pixel such as 2%, samples a pixel such as 64spp, or a
    /// time a camera such as 60s (shards then trace different ones)
    #[arg(long, value_name = "2%|64spp|60s", default_value = "2%", value_parser = options::goal, conflicts_with = "reference")]
    reference_until: Goal,
    /// Surfaces that light may meet on its way in that reference: full any number, 1 what the renderer has with indirect=0
    #[arg(long, value_name = "1|N|full", default_value = "full", value_parser = options::bounces, conflicts_with = "reference")]
    bounces: Bounces,
    /// Frames of each camera and setting; the first only warms up
    #[arg(long, value_name = "N", default_value_t = 6, value_parser = clap::value_parser!(u32).range(2..=10_000))]
    rounds: u32,
    /// Begin no setting after this, such as 90s, 30m or 2h; what is left is told
    #[arg(long, value_name = "TIME", value_parser = options::time)]
    budget: Option<Duration>,
    /// Part K of N of the settings, such as 2/8
    #[arg(long, value_name = "K/N", value_parser = options::shard)]
    shard: Option<(usize, usize)>,
    /// Take over what another sweep of the same kind measured, such as a shard; repeatable
    #[arg(long, value_name = "DIR")]
    from: Vec<PathBuf>,
    /// Knobs of the product: those that matter most
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u8).range(0..=6))]
    product: u8,
    /// Folder for sweep.json, sweep.csv, report.html and pictures; a result in it is gone on with
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Print Markdown tables of the presets and of BN12's choices
    #[arg(long, conflicts_with = "json")]
    markdown: bool,
    #[command(flatten)]
    ladder: LadderOptions,
    #[command(flatten)]
    rasterizer: RasterizerOptions,
    #[command(flatten)]
    device: DeviceOptions,
    #[command(flatten)]
    print: PrintOptions,
}

pub fn run(args: &Args) -> Result<()> {
    let mut presets = BTreeMap::new();
    for preset in PRESETS {
        let mut settings = canopy::scene::load_at(args.scene.as_deref(), Some(preset))?.settings;
        args.set.iter().try_for_each(|(name, value)| settings.set(name, *value))?;
        presets.insert(preset.to_string(), settings);
    }
    let mut scene = canopy::scene::load_at(args.scene.as_deref(), None)?;
    args.ladder.set(&mut scene);
    let cameras: Vec<Camera> = match &args.cameras[..] {
        [] => scene.cameras.clone(),
        names => names.iter().map(|n| scene.camera(Some(n)).cloned()).collect::<Result<_>>()?,
    };
    let given = match &args.reference {
        Some(path) if path.as_os_str() == "none" => Some(Vec::new()),
        Some(path) => Some(references(path, &cameras, args.size)?),
        None => None,
    };
    std::fs::create_dir_all(&args.output).map_err(|e| Error::io(&args.output, e))?;
    let swept = match (args.ladders.is_empty(), args.knobs.is_empty()) {
        (false, true) => Vec::new(),
        (true, true) => used_by(knobs(&[])?, &[scene.ladder]),
        _ => knobs(&args.knobs)?,
    };
    let mut request = Request {
        scene,
        cameras,
        size: args.size,
        presets,
        knobs: swept,
        ladders: args.ladders.clone(),
        rounds: args.rounds,
        budget: args.budget.unwrap_or(Duration::MAX),
        shard: args.shard.unwrap_or((1, 1)),
        product: args.product.into(),
        references: Vec::new(),
        rasterizer: args.rasterizer.chosen(),
        cache: cache::default_dir(),
        validate: args.device.validate,
        quiet: args.print.quiet,
    };
    let result = args.device.with(|gpu| {
        request.references = match given {
            Some(references) => references,
            None => trace(args, &request)?,
        };
        sweep(gpu, &request, &args.output, &args.from)
    })?;
    if let Some(file) = cache::default_dir().and_then(|dir| kept::file(&dir, &result.identity).ok()) {
        kept::keep(&file, &result)?;
    }
    let write = |name: &str, text: &str| canopy::files::write_whole(&args.output.join(name), text.as_bytes());
    write("sweep.csv", &report::csv(&result))?;
    write("report.html", &report::html(&result, &args.output.join(PICTURES))?)?;
    if args.print.json {
        output::json(&result)
    } else if args.markdown {
        output::print(&markdown(&result))
    } else if args.print.quiet {
        Ok(())
    } else {
        output::print(&text(&result))
    }
}

/// The reference of each camera, path-traced or as it was kept.
fn trace(args: &Args, request: &Request) -> Result<Vec<(Layers, String)>> {
    let options = reference::Options {
        bounces: args.bounces.0,
        until: args.reference_until.0,
        ..reference::Options::default()
    };
    let truth = truth::Request {
        scene: &request.scene,
        cameras: &request.cameras,
        size: request.size,
        options,
        quiet: request.quiet,
    };
    truth::references(&truth, &args.output, &args.from)
}

/// The reference of each camera: the file itself for one, else CAMERA.exr in a folder.
fn references(path: &std::path::Path, cameras: &[Camera], size: [u32; 2]) -> Result<Vec<(Layers, String)>> {
    let file = |c: &Camera| match path.is_dir() {
        true => truth::image_file(path, c),
        false => path.to_path_buf(),
    };
    if !path.is_dir() && cameras.len() > 1 {
        return Err(Error::Usage(format!(
            "{} is one image, and there are {} cameras; give a folder with CAMERA.exr for each, or one of --cameras",
            path.display(),
            cameras.len()
        )));
    }
    let read = |c: &Camera| {
        let file = file(c);
        let (layers, hash) = truth::read(&file)?;
        if layers.size != size {
            let [w, h] = layers.size;
            let remedy = format!("sweep with --size {w}x{h}");
            return Err(Error::input(
                &file,
                "",
                format!("{w}x{h} pixels, not {}x{}", size[0], size[1]),
                remedy,
            ));
        }
        Ok((layers, hash))
    };
    cameras.iter().map(read).collect()
}

/// The values of every knob that is swept, for `--help`.
fn tries_help() -> String {
    let mut text = String::from(
        "Values to try, to the most accurate; of each preset, those below and above it are measured:\n",
    );
    for k in KNOBS.iter().filter(|k| !k.tries.is_empty()) {
        let values: Vec<String> = k.tries.iter().map(f64::to_string).collect();
        let bakes = if k.bakes { "   (another bake each)" } else { "" };
        text += &format!("  {} = {}{bakes}\n", k.name, values.join(", "));
    }
    text
}

/// The tables.
fn text(result: &SweepResult) -> String {
    let judged = judge(result);
    let [w, h] = result.identity.size;
    let mut text =
        format!("{}, {w} x {h} on {}\n\n", result.identity.scene.name, result.identity.device.name);
    let mut settings = Table::new(1, &report::HEADINGS);
    for row in &judged.rows {
        settings.row(report::cells(result, row));
    }
    text += &settings.text();
    let mut paper = Table::new(1, &report::PAPER_HEADINGS);
    report::paper(result, &judged).into_iter().for_each(|row| paper.row(row));
    text += &format!("\n{}", paper.text());
    for p in result.points.iter().filter(|p| !p.refused.is_empty()) {
        text += &format!("\nrefused: {}: {}\n", p.name, p.refused);
    }
    if !result.left.is_empty() {
        text += &format!("\nnot measured ({}): {}\n", result.left.len(), result.left.join("; "));
    }
    text
}
