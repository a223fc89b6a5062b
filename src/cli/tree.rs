//! `canopy tree`.

use std::path::PathBuf;

use canopy::Result;
use canopy::scene::model::load_model_bytes;
use canopy::tree::{self, Preset};
use clap::builder::PossibleValuesParser;

use super::SCHEMA_VERSION;
use super::options::PrintOptions;
use super::output;

const EXAMPLES: &str = "\
Examples:
  canopy tree oak -o oak.glb                the tree of builtin:oak
  canopy tree birch -o b7.glb --seed 7      another individual
A scene uses it with `model = \"oak.glb\"` in a [[species]] table.";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Species
    #[arg(value_parser = PossibleValuesParser::new(Preset::ALL.map(Preset::name)))]
    preset: String,
    /// File to write; left out: PRESET.glb
    #[arg(short, long, value_name = "FILE.glb")]
    output: Option<PathBuf>,
    /// Individual of the species
    #[arg(long, value_name = "N", default_value_t = tree::BUILTIN_SEED)]
    seed: u32,
    #[command(flatten)]
    print: PrintOptions,
}

#[derive(serde::Serialize)]
struct Report<'a> {
    schema_version: u32,
    command: &'static str,
    preset: &'a str,
    seed: u32,
    vertices: usize,
    triangles: usize,
    bytes: usize,
    output: String,
}

pub fn run(args: &Args) -> Result<()> {
    let preset: Preset = args.preset.parse()?;
    let path = args.output.clone().unwrap_or_else(|| format!("{}.glb", preset.name()).into());
    output::check(&path, "glb")?;
    let glb = tree::glb(preset, args.seed);
    // Read back as any model is: what is written here will load.
    let mesh = load_model_bytes(&path, &glb, None, None)?;
    canopy::files::write_whole(&path, &glb)?;
    let report = Report {
        schema_version: SCHEMA_VERSION,
        command: "tree",
        preset: preset.name(),
        seed: args.seed,
        vertices: mesh.positions.len(),
        triangles: mesh.triangles.len(),
        bytes: glb.len(),
        output: path.display().to_string(),
    };
    if args.print.json {
        return output::json(&report);
    }
    if args.print.quiet {
        return Ok(());
    }
    let Report { vertices, triangles, output, .. } = &report;
    output::print(&format!(
        "{output}: {}, {vertices} vertices, {triangles} triangles, {}\n",
        report.preset,
        output::bytes(report.bytes as u64)
    ))
}
