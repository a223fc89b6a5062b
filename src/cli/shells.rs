//! `canopy shells`.

use std::path::PathBuf;
use std::time::Instant;

use canopy::bake::shells::{self, March, Quality, Seam, ShellSettings, Shells};
use canopy::{Result, bake, image, scene};

use super::SCHEMA_VERSION;
use super::options::PrintOptions;
use super::output::{self, Table};

const EXAMPLES: &str = "\
Examples:
  canopy shells                                       bakes those of the built-in scene, and says what they take
  canopy shells my.toml --slices 32 --texels 256      finer ones, of yours
  canopy shells my.toml --verify 9 --no-cache         how well they hide the ground from 9 angles, and whether tiles show
  canopy shells my.toml -o stack.png                  a picture of the slices, and of the plane from above";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Scene file (TOML); left out: the built-in scene
    scene: Option<PathBuf>,
    /// Slices of the finest stack, from the ground to the top of the tallest tree: a power of two, 2 to 64
    #[arg(long, value_name = "N", default_value_t = ShellSettings::default().slices)]
    slices: u32,
    /// Texels a side of a tile: a power of two, 16 to 512
    #[arg(long, value_name = "N", default_value_t = ShellSettings::default().texels)]
    texels: u32,
    /// Compare cover of the ground with rays cast at the same trees, from N angles between the zenith and 80 degrees, and look for
    /// seams between tiles
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1000))]
    verify: Option<u32>,
    /// Rays an angle
    #[arg(long, value_name = "N", default_value_t = 20_000, requires = "verify", value_parser = clap::value_parser!(u32).range(2..=100_000_000))]
    rays: u32,
    /// Picture of the stack: slices of a tile from the ground up, that tile at a quarter to all of the density, and tiles from above
    #[arg(short, long, value_name = "FILE.png")]
    output: Option<PathBuf>,
    /// Seed of everything random, instead of the scene's
    #[arg(long, value_name = "N")]
    seed: Option<u32>,
    /// Bake anew, and keep nothing
    #[arg(long)]
    no_cache: bool,
    #[command(flatten)]
    print: PrintOptions,
}

#[derive(serde::Serialize)]
struct Report {
    schema_version: u32,
    command: &'static str,
    scene: String,
    slices: u32,
    texels: u32,
    tile_side: f64,
    height: f32,
    bytes: u64,
    cache: &'static str,
    seconds: f64,
    verify: Vec<Quality>,
    seams: Vec<Seam>,
    output: Option<String>,
}

pub fn run(args: &Args) -> Result<()> {
    if let Some(path) = &args.output {
        output::check(path, "png")?;
    }
    let mut scene = scene::load_at(args.scene.as_deref(), None)?;
    if let Some(seed) = args.seed {
        scene.seed = seed;
    }
    let settings = ShellSettings { slices: args.slices, texels: args.texels };
    let dir = if args.no_cache { None } else { bake::cache::default_dir() };
    let start = Instant::now();
    let (shells, cache) = Shells::load(&scene, settings, dir.as_deref(), args.print.quiet)?;
    let seconds = start.elapsed().as_secs_f64();
    let verify = args.verify.map(|n| shells::verify(&scene, &shells, n, args.rays)).transpose()?;
    let seams = args.verify.map_or(Vec::new(), |_| shells::seams(&shells).into());
    if let Some(path) = &args.output {
        let (rgb, size) = shells::picture(&shells, scene.seed);
        image::write_png(path, &rgb, size)?;
    }
    let report = Report {
        schema_version: SCHEMA_VERSION,
        command: "shells",
        scene: scene.name.clone(),
        slices: args.slices,
        texels: args.texels,
        tile_side: shells.tile_side,
        height: shells.height,
        bytes: shells.bytes(),
        cache: cache.name(),
        seconds,
        verify: verify.unwrap_or_default(),
        seams,
        output: args.output.as_ref().map(|p| p.display().to_string()),
    };
    if args.print.json {
        output::json(&report)
    } else if args.print.quiet {
        Ok(())
    } else {
        output::print(&text(&report))
    }
}

fn text(r: &Report) -> String {
    let mut text = format!(
        "{}: 16 tiles of {:.1} m, {} slices of {} x {} texels up to {:.1} m, {} ({}, {:.1} s)\n",
        r.scene,
        r.tile_side,
        r.slices,
        r.texels,
        r.texels,
        r.height,
        output::bytes(r.bytes),
        r.cache,
        r.seconds
    );
    if r.verify.is_empty() {
        return text;
    }
    let headings = ["zenith", "density", "meshes"].into_iter().chain(March::ALL.map(March::name));
    let mut cover = Table::new(0, &headings.collect::<Vec<_>>());
    for q in &r.verify {
        let [a, b, c] = q.stack.map(|s| format!("{:+.4} ±{:.4}", s.difference, s.error));
        let truth = format!("{:.4} ±{:.4}", q.truth, q.error);
        cover.row([format!("{:.0}°", q.zenith), format!("{}", q.share), truth, a, b, c]);
    }
    text += "cover of the ground, and how much more of it the stack hides (± standard error):\n";
    text += &cover.text();
    let mut edges = Table::new(0, &["density", "edges", "inside", "step inside", "across", "wrong"]);
    for s in &r.seams {
        let with = |[mean, error]: [f64; 2]| format!("{mean:.4} ±{error:.4}");
        let [a, b, c] = [s.step_inside, s.step_across, s.step_wrong].map(|v| format!("{v:.4}"));
        edges.row([format!("{}", s.share), with(s.band), with(s.inside), a, b, c]);
    }
    text += "cover from above along the edges of tiles and inside, and steps from texel to texel:\n";
    text + &edges.text()
}
