//! `canopy leaves`.

use std::path::PathBuf;

use canopy::measure::leaves::{self, Agreement, Light, TERMS};
use canopy::physics::leaf::Directions;
use canopy::scene::{Mesh, OpticsOverride, model};
use canopy::{Error, Result};

use super::SCHEMA_VERSION;
use super::options::PrintOptions;
use super::output::{self, Table};

const EXAMPLES: &str = "\
Examples:
  canopy leaves                             the built-in oak and a ball of leaves
  canopy leaves oak.glb --elevation 20      one's own tree, under a low sun
  canopy leaves --ball 4                    a denser ball
  canopy leaves pine.glb --directions 8     with as many directions as the paper alone
Of each tree seven pictures in parallel: the sky's light, the sun's, one bounce of the sun, and all of them, beside paths traced from the
very places. Error: mean absolute difference of squares of 8 x 8 pixels, over the term's mean. The paper (Boulanger et al. 2008, figure 7)
has 5, 7.5 and 6 % with 8 directions.";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Models (.glb, .gltf), or builtin:NAME of a species of `canopy tree`; left out: the oak, and a ball
    models: Vec<PathBuf>,
    /// Height of each model, m; left out: as modelled
    #[arg(long, value_name = "METRES")]
    height: Option<f64>,
    /// A ball of leaves of this optical thickness from its middle outwards
    #[arg(long, value_name = "THICKNESS")]
    ball: Option<f64>,
    /// Numbers of directions of an envelope, of 8, 14 and 26
    #[arg(long, value_name = "N,…", value_delimiter = ',', default_values_t = Directions::COUNTS)]
    directions: Vec<usize>,
    /// Elevation of the sun, degrees
    #[arg(long, value_name = "DEGREES", default_value_t = 45.0, allow_negative_numbers = true)]
    elevation: f64,
    /// Radiance of the sky, of a sun of irradiance 1
    #[arg(long, value_name = "RADIANCE", default_value_t = 0.1)]
    sky: f64,
    /// Reflectance of the ground
    #[arg(long, value_name = "0..1", default_value_t = 0.11)]
    ground: f64,
    #[command(flatten)]
    print: PrintOptions,
}

#[derive(serde::Serialize)]
struct Tree {
    name: String,
    agreement: Vec<Agreement>,
}

#[derive(serde::Serialize)]
struct Report {
    schema_version: u32,
    command: &'static str,
    terms: [&'static str; 4],
    trees: Vec<Tree>,
}

pub fn run(args: &Args) -> Result<()> {
    let light = checked(args)?;
    let mut trees = Vec::new();
    let mut add = |name: String, mesh: &Mesh| -> Result<()> {
        let counts = &args.directions;
        let agreement = leaves::measure(mesh, &OpticsOverride::default(), light, counts, args.print.quiet)?;
        trees.push(Tree { name, agreement });
        Ok(())
    };
    let oak = [PathBuf::from("builtin:oak")];
    let alone = args.models.is_empty() && args.ball.is_none();
    for path in if alone { &oak[..] } else { &args.models } {
        add(path.display().to_string(), &model::load_named(path, args.height)?)?;
    }
    if let Some(thickness) = args.ball.or(alone.then_some(2.0)) {
        add(format!("ball of thickness {thickness}"), &leaves::ball(thickness))?;
    }
    let report = Report { schema_version: SCHEMA_VERSION, command: "leaves", terms: TERMS, trees };
    if args.print.json {
        output::json(&report)
    } else if args.print.quiet {
        Ok(())
    } else {
        output::print(&report.trees.iter().map(text).collect::<String>())
    }
}

/// The light, if all numbers make sense.
fn checked(args: &Args) -> Result<Light> {
    if let Some(n) = args.directions.iter().find(|n| !Directions::COUNTS.contains(n)) {
        return Err(Error::Usage(format!("--directions {n}: there are 8, 14 and 26")));
    }
    let within = |what: &str, value: f64, [low, high]: [f64; 2]| {
        let fits = (low..=high).contains(&value);
        let wrong = || Error::Usage(format!("{what} {value}: expected a number from {low} to {high}"));
        fits.then_some(()).ok_or_else(wrong)
    };
    within("--elevation", args.elevation, [0.0, 90.0])?;
    within("--sky", args.sky, [0.0, 1e6])?;
    within("--ground", args.ground, [0.0, 1.0])?;
    args.ball.map_or(Ok(()), |ball| within("--ball", ball, [0.01, 50.0]))?;
    Ok(Light { elevation: args.elevation, sky: args.sky, ground: args.ground })
}

fn text(tree: &Tree) -> String {
    let [a, b, c, d] = TERMS;
    let mut table = Table::new(1, &[&tree.name, "leaves", "bake", a, b, c, d]);
    for x in &tree.agreement {
        let [sky, sun, bounce, all] =
            x.terms.map(|t| format!("{:.1} % ({:+.1})", 100.0 * t.error, 100.0 * t.bias));
        let name = format!("  {} directions: error (bias)", x.directions);
        table.row([name, x.leaves.to_string(), format!("{:.2} s", x.bake_s), sky, sun, bounce, all]);
    }
    if let Some(first) = tree.agreement.first() {
        let [sky, sun, bounce, all] = first.terms.map(|t| format!("{:.0} %", 100.0 * t.share));
        table.row(["  share of the light".into(), String::new(), String::new(), sky, sun, bounce, all]);
    }
    table.text() + "\n"
}
