//! `canopy shells`.

use std::path::PathBuf;
use std::time::Instant;

use canopy::bake::shells::{self, Coarse, March, ShellSettings, Shells, Told, Verified};
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
    /// Slices of the finest stack, from the ground to the top of the tallest tree: a power of two, 2 to 32
    #[arg(long, value_name = "N", default_value_t = ShellSettings::default().slices)]
    slices: u32,
    /// Texels a side of a tile: a power of two, 16 to 256
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
    verify: Option<Verified>,
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
        verify,
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
    if let Some(v) = &r.verify {
        text += &verified(v);
    }
    text
}

/// Tables of what was found.
fn verified(v: &Verified) -> String {
    let plus = |difference: f64, error: f64| format!("{difference:+.4} ±{error:.4}");
    let headings = ["zenith", "density", "meshes"].into_iter().chain(March::ALL.map(March::name));
    let mut angles = Table::new(0, &headings.collect::<Vec<_>>());
    for q in &v.angles {
        let [a, b, c] = q.stack.map(|s| plus(s.difference, s.error));
        let truth = format!("{:.4} ±{:.4}", q.truth, q.error);
        angles.row([format!("{:.0}°", q.zenith), format!("{}", q.share), truth, a, b, c]);
    }
    let mut edges = Table::new(0, &["density", "from edges, m", "meshes", "one slice"]);
    for n in &v.edges {
        let [from, to] = n.distance;
        let distance = format!("{from:.1} to {to:.1}");
        let truth = format!("{:.4}", n.truth);
        edges.row([format!("{}", n.share), distance, truth, plus(n.difference, n.error)]);
    }
    let mut seams = Table::new(0, &["density", "edges", "inside", "step inside", "across", "wrong"]);
    for s in &v.seams {
        let with = |[mean, error]: [f64; 2]| format!("{mean:.4} ±{error:.4}");
        let [a, b, c] = [s.step_inside, s.step_across, s.step_wrong].map(|v| format!("{v:.4}"));
        seams.row([format!("{}", s.share), with(s.band), with(s.inside), a, b, c]);
    }
    format!(
        "cover of the ground, and how much more of it the stack hides (± standard error):\n{}\
         from above, by distance from the edges of tiles:\n{}\
         by texels and slices (on the long way) at half density; all of it with --json:\n{}\
         light of a sun and of the sky on what slices show, by rays, and how much more the bytes tell (rms):\n{}\
         the sun that is sent to viewers, by phase angle: by rays, over that by the bytes, with corrections and without:\n{}\
         cover from above along edges and inside, and steps from texel to texel:\n{}",
        angles.text(),
        edges.text(),
        coarse(v),
        light(v),
        sun(v),
        seams.text()
    )
}

/// Light past the own crown, past other trees, and past both: a row a light and side.
fn light(v: &Verified) -> String {
    let mut table = Table::new(1, &["light", "side", "own crown", "others", "both", "± of both"]);
    for l in &v.light {
        let light = l.elevation.map_or("sky".into(), |elevation| format!("{elevation:.0}°"));
        let side = if l.seen { "seen" } else { "other" };
        let told = |t: Told| format!("{:.3} {:+.3} ({:.3})", t.truth, t.difference, t.rms);
        let error = format!("{:.4}", l.both.error);
        table.row([light, side.into(), told(l.own), told(l.free), told(l.both), error]);
    }
    table.text()
}

/// The sun that is sent to viewers: a row a density and range of phase angles.
fn sun(v: &Verified) -> String {
    let mut table = Table::new(0, &["density", "phase", "trees", "shells", "uncorrected"]);
    for s in &v.sun {
        let phase = format!("{:.0}° to {:.0}°", s.from, s.to);
        let [truth, corrected, plain] = [s.truth, s.corrected, s.plain].map(|v| format!("{v:.4}"));
        table.row([format!("{}", s.share), phase, truth, corrected, plain]);
    }
    table.text()
}

/// Stacks of fewer slices and coarser texels: a row a size of texels and angle, a column a number of slices.
fn coarse(v: &Verified) -> String {
    let half: Vec<&Coarse> = v.coarse.iter().filter(|c| c.share < 1.0).collect();
    let mut slices: Vec<u32> = half.iter().map(|c| c.slices).collect();
    slices.sort_unstable_by(|a, b| b.cmp(a));
    slices.dedup();
    let names: Vec<String> = slices.iter().map(|n| format!("{n} slices")).collect();
    let headings = ["texel, m", "zenith"].into_iter().chain(names.iter().map(String::as_str));
    let mut table = Table::new(0, &headings.collect::<Vec<_>>());
    let mut rows: Vec<(f64, f64)> = half.iter().map(|c| (c.texel, c.zenith)).collect();
    rows.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    rows.dedup();
    for row in rows {
        let of = half.iter().filter(|c| (c.texel, c.zenith) == row);
        let cells = of.map(|c| format!("{:+.4} ±{:.4}", c.difference, c.error));
        table.cells([format!("{:.1}", row.0), format!("{:.0}°", row.1)].into_iter().chain(cells).collect());
    }
    table.text()
}
