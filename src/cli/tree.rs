//! `canopy tree`.

use std::path::PathBuf;

use canopy::Result;
use canopy::scene::model::load_model_bytes;
use canopy::tree::{self, KEYS, Preset, Species};

use super::SCHEMA_VERSION;
use super::options::PrintOptions;
use super::output;

const EXAMPLES: &str = "\
Examples:
  canopy tree oak -o oak.glb                the tree of builtin:oak
  canopy tree birch -o b7.glb --seed 7      another individual
  canopy tree oak --set base_size=0.4       with a longer bare trunk
  canopy tree oak --set branches.count=60   with more branches
  canopy tree oak --print > elm.toml        an oak's numbers, to make another species of
  canopy tree elm.toml                      that species, as elm.glb
A scene uses it with `model = \"oak.glb\"` in a [[species]] table.";

/// The species that need no file.
fn presets_help() -> String {
    let lines = Preset::ALL.map(|p| format!("  {:9} {}\n", p.name(), p.meaning()));
    format!("Species:\n{}", lines.concat())
}

/// Every key.
fn keys_help() -> String {
    let lines = KEYS.iter().map(|k| format!("  {}   [{}]\n      {}\n", k.name, k.takes(), k.meaning));
    format!("Keys for species files and --set:\n{}", lines.collect::<String>())
}

#[derive(clap::Args)]
#[command(
    after_help = format!("{}\n{EXAMPLES}", presets_help()),
    after_long_help = format!("{}\n{EXAMPLES}\n\n{}", presets_help(), keys_help())
)]
pub struct Args {
    /// Species below, or a file of one's own
    #[arg(value_name = "PRESET|FILE.toml")]
    tree: String,
    /// Set one number of the species; repeatable. Names are those of its file, after trunk., branches., twigs., leaves. or bark.
    /// if they are in a table; a number alone for a pair leaves the second as it is
    #[arg(long, value_name = "NAME=VALUE")]
    set: Vec<String>,
    /// Print the species' file, with what is set, instead of growing it
    #[arg(long = "print", conflicts_with_all = ["output", "seed", "json"])]
    show: bool,
    /// File to write; left out: the species' name and .glb
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
    let species = Species::named(&args.tree, &args.set)?;
    if args.show {
        return output::print(species.text());
    }
    let path = args.output.clone().unwrap_or_else(|| format!("{}.glb", species.name()).into());
    output::check(&path, "glb")?;
    let glb = species.glb(args.seed);
    // Read back as any model is: what is written here will load.
    let mesh = load_model_bytes(&path, &glb, None, None)?;
    canopy::files::write_whole(&path, &glb)?;
    let report = Report {
        schema_version: SCHEMA_VERSION,
        command: "tree",
        preset: species.name(),
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
