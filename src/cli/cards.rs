//! `canopy cards`.

use std::path::PathBuf;
use std::time::Instant;

use canopy::bake::cards::{self, CardQuality, CardSettings};
use canopy::scene::model::{load_model_bytes, load_named};
use canopy::{Result, bake};

use super::SCHEMA_VERSION;
use super::options::PrintOptions;
use super::output::{self, Table};

const EXAMPLES: &str = "\
Examples:
  canopy cards oak.glb -o oak-cards.glb                a cloud of at most 200 cards
  canopy cards builtin:pine --cards 60 -o pine60.glb   fewer
  canopy cards oak.glb -o c.glb --verify 50            and how well its silhouettes agree with the model's, from 50 directions
  canopy cards oak.glb -o c.glb --verify 50 --min-iou 0.7   with exit code 1 if they do less from one
A scene uses it with `model = \"oak-cards.glb\"` and `foliage = [\"leaf\"]` in a [[species]] table: its bark has holes too.";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Model (.glb, .gltf), or builtin:NAME of a species of `canopy tree`
    model: PathBuf,
    /// File to write
    #[arg(short, long, value_name = "FILE.glb")]
    output: PathBuf,
    /// Most cards
    #[arg(long, value_name = "N", default_value_t = 200, value_parser = clap::value_parser!(u32).range(2..=4096))]
    cards: u32,
    /// Texels along the height of the tree
    #[arg(long, value_name = "N", default_value_t = 512, value_parser = clap::value_parser!(u32).range(16..=4096))]
    texels: u32,
    /// Crossed cards: a cluster's box has a second and a third one if the root of the product of the sides along it is more than F times the
    /// box's third side (BCF05: 0.5)
    #[arg(long, value_name = "F", default_value_t = 0.5, value_parser = flatness)]
    flatness: f32,
    /// Height of an unscaled tree, m; left out: as modelled
    #[arg(long, value_name = "METRES")]
    height: Option<f64>,
    /// Compare silhouettes with the model's from N directions
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    verify: Option<u32>,
    /// Exit with code 1 if they agree less from one of these (intersection over union)
    #[arg(long, value_name = "0..1", requires = "verify")]
    min_iou: Option<f64>,
    #[command(flatten)]
    print: PrintOptions,
}

#[derive(serde::Serialize)]
struct Report {
    schema_version: u32,
    command: &'static str,
    model: String,
    model_triangles: usize,
    clusters_bark_leaf: [usize; 2],
    cards_bark_leaf: [usize; 2],
    texels_bark_leaf: [[u32; 2]; 2],
    bytes: usize,
    seconds: f64,
    verify: Vec<CardQuality>,
    output: String,
}

pub fn run(args: &Args) -> Result<()> {
    output::check(&args.output, "glb")?;
    let mesh = load_named(&args.model, args.height)?;
    let start = Instant::now();
    let cloud = cards::cloud(
        &mesh,
        CardSettings { cards: args.cards, texels: args.texels, flatness: args.flatness },
    )?;
    let seconds = start.elapsed().as_secs_f64();
    // Read back as any model is: what is written here will load.
    let loaded = load_model_bytes(&args.output, &cloud.glb, None, Some(&cloud.foliage))?;
    let verify = args.verify.map(|n| cards::verify(&mesh, &loaded, n)).transpose()?.unwrap_or_default();
    canopy::files::write_whole(&args.output, &cloud.glb)?;
    let report = Report {
        schema_version: SCHEMA_VERSION,
        command: "cards",
        model: args.model.display().to_string(),
        model_triangles: mesh.triangles.len(),
        clusters_bark_leaf: cloud.clusters,
        cards_bark_leaf: cloud.cards,
        texels_bark_leaf: cloud.texels,
        bytes: cloud.glb.len(),
        seconds,
        verify,
        output: args.output.display().to_string(),
    };
    if args.print.json {
        output::json(&report)?;
    } else if !args.print.quiet {
        output::print(&text(&report))?;
    }
    let Some(least) = args.min_iou else { return Ok(()) };
    bake::demand(&report.model, "cards and model", worst(&report), least, "--cards or --texels")
}

/// The least agreement from a direction.
fn worst(r: &Report) -> f64 {
    r.verify.iter().map(|v| v.iou).fold(f64::INFINITY, f64::min)
}

fn flatness(text: &str) -> std::result::Result<f32, String> {
    match text.parse() {
        Ok(f) if (0.0..=10.0).contains(&f) => Ok(f),
        _ => Err("write a number from 0 to 10".into()),
    }
}

fn text(r: &Report) -> String {
    let mut table = Table::new(2, &[r.output.as_str(), "bark", "leaves"]);
    let pair = |a: [usize; 2]| a.map(|n| n.to_string());
    let row = |name: &str, [a, b]: [String; 2]| [name.to_string(), a, b];
    table.row(row("clusters", pair(r.clusters_bark_leaf)));
    table.row(row("cards", pair(r.cards_bark_leaf)));
    table.row(row("atlas, texels", r.texels_bark_leaf.map(|[w, h]| format!("{w} x {h}"))));
    let mut text = format!(
        "{}\n{} triangles in {:.1} s, {}\n",
        table.text(),
        r.model_triangles,
        r.seconds,
        output::bytes(r.bytes as u64)
    );
    if !r.verify.is_empty() {
        let n = r.verify.len() as f64;
        let mean = |of: fn(&CardQuality) -> f64| r.verify.iter().map(of).sum::<f64>() / n;
        text += &format!(
            "silhouettes from {n} directions: IoU {:.4} in the mean, {:.4} at worst; coverage {:.4} of the model's\n",
            mean(|v| v.iou),
            worst(r),
            mean(|v| v.coverage_ratio)
        );
    }
    text
}
