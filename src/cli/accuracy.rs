//! `canopy accuracy`.

use std::path::PathBuf;

use canopy::ladder::Ladder;
use canopy::measure::accuracy::design::{Cell, Forest, Part, built_in, of_file};
use canopy::measure::accuracy::report;
use canopy::measure::accuracy::run::{From, Request, USUAL, run as measure};
use canopy::measure::host::Host;
use canopy::measure::reflectance::Method;
use canopy::reference::Until;
use canopy::{Error, Result};

use super::options::{self, DeviceOptions, Goal, PrintOptions, QualityOptions};
use super::output::{self, Table};

const EXAMPLES: &str = "\
Examples:
  canopy accuracy -o accuracy                          the built-in design: accuracy/accuracy.html, accuracy.json
  canopy accuracy -o a --only oak,birch --part tuning  cells of these forests that may be looked at while tuning
  canopy accuracy my.toml -o a --cells 9               the forest of a scene, thinned to a quarter and less, under nine suns
  canopy accuracy -o a --drawn zfield@100 --drawn zfield:8,shader-map@1500
  canopy accuracy -o a --quality accurate              the same cells at another preset
  canopy accuracy -o a --shard 2/4                     every fourth cell; shards may share the folder, or be copied into one
  canopy accuracy --list                               the design, without measuring
  canopy accuracy -o a                                 again: goes on where it stopped
Each cell is a forest at a density, under a sun, on a slope: patches of it are drawn and path-traced (light of as many orders as the knob indirect counts) from
the same directions. A third of the cells is kept apart (--part kept): look at them last, when nothing is tuned any more.
A reference is traced once and kept whatever becomes of the program; what was drawn is kept until the program or a knob changes.";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Scenes whose forests are measured, thinned; left out: the built-in forests
    scenes: Vec<PathBuf>,
    /// Folder for accuracy.html, accuracy.json and what is kept of each cell
    #[arg(short, long, value_name = "DIR", required_unless_present = "list")]
    output: Option<PathBuf>,
    /// Cells of a forest; half as many of one that is kept apart
    #[arg(long, value_name = "N", default_value_t = 6, value_parser = clap::value_parser!(u32).range(1..=1000))]
    cells: u32,
    /// Only cells for tuning, or only those that are kept apart from it
    #[arg(long, value_name = "PART", value_parser = options::named(Part::NAMES))]
    part: Option<Part>,
    /// Only these forests or cells, with commas between, such as oak,birch-2
    #[arg(long, value_name = "NAME,…", value_delimiter = ',')]
    only: Vec<String>,
    /// What is drawn of each cell: a ladder (see canopy render) and a distance in metres; repeatable. Left out: zfield@200, zfield@1000,
    /// auto@3000, shader-map@6000
    #[arg(long, value_name = "LADDER@METRES", value_parser = from)]
    drawn: Vec<From>,
    /// When the reference of a patch is good enough: an error of its mean such as 1%, or samples a pixel such as 16spp
    #[arg(long, value_name = "1%|16spp", default_value = "1%", value_parser = options::goal)]
    until: Goal,
    /// Patches of each cell
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..=64))]
    patches: u32,
    /// Part K of N of the cells, such as 2/8
    #[arg(long, value_name = "K/N", value_parser = options::shard)]
    shard: Option<(usize, usize)>,
    /// Print the design and measure nothing
    #[arg(long)]
    list: bool,
    #[command(flatten)]
    quality: QualityOptions,
    #[command(flatten)]
    device: DeviceOptions,
    #[command(flatten)]
    print: PrintOptions,
}

pub fn run(args: &Args) -> Result<()> {
    let forests = forests(args)?;
    let cells = cells(args, &forests)?;
    let Some(folder) = args.output.as_ref().filter(|_| !args.list) else {
        return if args.print.json { output::json(&cells) } else { output::print(&listed(&cells)) };
    };
    std::fs::create_dir_all(folder).map_err(|e| Error::io(folder, e))?;
    let until = match args.until.0 {
        Until::Error(e) => Until::ErrorOfMean(e),
        Until::Time(_) => {
            return Err(Error::Usage(
                "--until: an error or a number of samples, which give the same anywhere".into(),
            ));
        }
        other => other,
    };
    let usual = USUAL.to_vec();
    let found = args.device.with(|gpu| {
        let request = Request {
            forests: &forests,
            cells: &cells,
            from: if args.drawn.is_empty() { &usual } else { &args.drawn },
            method: Method { patches: args.patches, ..Method::default() },
            until,
            shard: args.shard.unwrap_or((1, 1)),
            host: Host::here(&gpu.info().name, args.device.validate),
            quiet: args.print.quiet,
        };
        measure(gpu, &request, folder)
    })?;
    let json = serde_json::to_string(&found).map_err(|e| Error::io(folder, std::io::Error::other(e)))?;
    canopy::files::write_whole(&folder.join("accuracy.json"), (json + "\n").as_bytes())?;
    canopy::files::write_whole(&folder.join("accuracy.html"), report::html(&found)?.as_bytes())?;
    if args.print.json {
        return output::json(&found);
    }
    if args.print.quiet {
        return Ok(());
    }
    let mut rows = Table::new(1, &report::HEADINGS);
    report::worst(&found).into_iter().for_each(|r| rows.row(report::row(r)));
    let mut summary = Table::new(3, &report::SUMMARY_HEADINGS);
    report::summary(&found).into_iter().for_each(|r| summary.row(r));
    let missing = match &found.missing[..] {
        [] => String::new(),
        names => format!("\nnot measured ({}): {}\n", names.len(), names.join(", ")),
    };
    output::print(&format!("{}\n{}{missing}", rows.text(), summary.text()))
}

/// The forests of the scenes that were named, or the built-in ones, with the knobs that were set.
fn forests(args: &Args) -> Result<Vec<Forest>> {
    let preset = args.quality.preset.as_deref();
    let mut forests = match &args.scenes[..] {
        [] => built_in(preset)?,
        files => files.iter().map(|f| of_file(f, preset)).collect::<Result<_>>()?,
    };
    for f in &mut forests {
        args.quality.set(&mut std::sync::Arc::make_mut(&mut f.scene).settings)?;
    }
    for (k, f) in forests.iter().enumerate() {
        if forests[..k].iter().any(|other| other.name == f.name) {
            return Err(Error::Usage(format!(
                "two scenes are named \"{}\": their cells would have one name",
                f.name
            )));
        }
    }
    Ok(forests)
}

/// The cells that were asked for.
fn cells(args: &Args, forests: &[Forest]) -> Result<Vec<Cell>> {
    let all: Vec<Cell> = forests.iter().flat_map(|f| f.cells(args.cells as usize)).collect();
    if let Some(unknown) = args.only.iter().find(|o| !all.iter().any(|c| c.forest == **o || c.name == **o)) {
        let names: Vec<&str> = forests.iter().map(|f| f.name.as_str()).collect();
        return Err(Error::Usage(format!("no forest or cell \"{unknown}\"; forests: {}", names.join(", "))));
    }
    let wanted = |c: &Cell| {
        args.part.is_none_or(|p| p == c.part)
            && (args.only.is_empty() || args.only.iter().any(|o| *o == c.forest || *o == c.name))
    };
    Ok(all.into_iter().filter(wanted).collect())
}

fn listed(cells: &[Cell]) -> String {
    let mut table = Table::new(2, &["cell", "part", "trees/m²", "sun °", "slope °"]);
    for c in cells {
        let part = Part::NAMES.iter().find(|p| p.1 == c.part).map_or("", |p| p.0);
        table.row([
            c.name.clone(),
            part.into(),
            format!("{:.4}", c.density),
            c.sun_elevation.to_string(),
            c.slope.to_string(),
        ]);
    }
    table.text()
}

/// `LADDER@METRES`.
fn from(text: &str) -> std::result::Result<From, String> {
    let (ladder, distance) = text.rsplit_once('@').ok_or("write LADDER@METRES, such as zfield@200")?;
    let named = Ladder::SHORTHANDS.iter().find(|(name, _)| *name == ladder).map(|(_, l)| *l);
    let ladder = match named {
        Some(ladder) => ladder,
        None => ladder.parse::<Ladder>().map_err(|e| e.to_string())?,
    };
    let distance: f64 =
        distance.trim().parse().map_err(|_| format!("\"{distance}\" is no distance in metres"))?;
    if (1.0..=1e7).contains(&distance) {
        Ok(From { ladder, distance })
    } else {
        Err("1 to 10,000,000 m".into())
    }
}
