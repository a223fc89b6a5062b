//! `canopy reflectance`.

use std::path::PathBuf;

use canopy::bake::{Baked, Needs, cache, load_or_bake_scene};
use canopy::gpu::Gpu;
use canopy::ladder::Ladder;
use canopy::measure::reflectance::{
    Measured, Method, Request, mean_densities, measure, measure_reference, sees,
};
use canopy::progress::Progress;
use canopy::reference::Until;
use canopy::scene::{Camera, Scene};
use canopy::{Error, Result};

use super::SCHEMA_VERSION;
use super::options::{
    DeviceOptions, Drawn, PrintOptions, RasterizerOptions, ReferenceOptions, SceneOptions, knobs_help, named,
};
use super::output;

const EXAMPLES: &str = "\
Examples:
  canopy reflectance --view-zenith -75:75:5 --out brf.csv
      the built-in forest in the plane of the sun, from 1 km
  canopy reflectance scene.toml --sun-zenith 45 --view-zenith -75:75:5 --azimuth 0 \\
         --distance 50,200,1000,20000 --representation auto --out brf.csv
  canopy reflectance scene.toml --representation zfield,shader-map --distance 100,400
  canopy reflectance scene.toml --ladder zfield:8,shader-map --ladder zfield:2,shader-map --distance 200,400
  canopy reflectance scene.toml --density 0.01 --slope -20,0,20 --json
  canopy reflectance scene.toml --representation zfield,reference --bounces 1 --until 1%
      the renderer against path tracing of the real trees, both with light that met one surface
A list is numbers and ranges FROM:TO:STEP, with commas between. A negative view zenith is the side away from the sun; a
positive slope descends towards the sun. Pixels are those of --size and --camera.
The reference is Monte-Carlo, of the same trees through the same rays; distance means nothing to it, and its rows repeat. Each
image of a patch is traced until the standard error of its mean is that of --until (of the channel where it is largest,
default 1%). stderr is what patches differ by, divided by the root of their number: it contains the Monte-Carlo error, which
the noise of the --json report gives alone. Without --bounces light is scattered any number of times: the truth. --bounces 1 is light
that met one surface, which the renderer draws with the knob indirect at 0: what
differs then is how trees are represented.";

/// Error of the mean of an image of a patch if no one says.
const DEFAULT_UNTIL: Until = Until::ErrorOfMean(0.01);

const COLUMNS: [&str; 22] = [
    "representation",
    "distance_m",
    "sun_zenith_deg",
    "view_zenith_deg",
    "relative_azimuth_deg",
    "slope_deg",
    "k_lit_ground",
    "k_shadowed_ground",
    "k_lit_tree",
    "k_shadowed_tree",
    "radiance_r",
    "radiance_g",
    "radiance_b",
    "sun_r",
    "sun_g",
    "sun_b",
    "sky_r",
    "sky_g",
    "sky_b",
    "stderr_r",
    "stderr_g",
    "stderr_b",
];

#[derive(clap::Args)]
#[command(after_help = EXAMPLES, after_long_help = format!("{EXAMPLES}\n\n{}", knobs_help()))]
pub struct Args {
    #[command(flatten)]
    scene: SceneOptions,
    /// Sun zenith angles, degrees; left out: the scene's
    #[arg(long, value_name = "LIST", allow_hyphen_values = true, value_parser = list)]
    sun_zenith: Option<List>,
    /// View zenith angles, degrees
    #[arg(long, value_name = "LIST", default_value = "-75:75:15", allow_hyphen_values = true, value_parser = list)]
    view_zenith: List,
    /// Azimuths of the viewer relative to the sun, degrees
    #[arg(long, value_name = "LIST", default_value = "0", allow_hyphen_values = true, value_parser = list)]
    azimuth: List,
    /// Distances, m
    #[arg(long, value_name = "LIST", default_value = "1000", allow_hyphen_values = true, value_parser = list)]
    distance: List,
    /// Inclinations of the ground, degrees
    #[arg(long, value_name = "LIST", default_value = "0", allow_hyphen_values = true, value_parser = list)]
    slope: List,
    /// What stands for a tree, near to far, such as zfield:4,shader-map (see canopy render); repeatable. Left out: the scene's
    #[arg(long, value_name = "RUNG:PIXELS,…,RUNG", value_parser = str::parse::<Ladder>, conflicts_with = "representation")]
    ladder: Vec<Ladder>,
    /// Shorthands for ladders: auto, zfield, shader-map; or reference (path tracing on the CPU); several with commas between
    #[arg(long, value_name = "NAMES", value_delimiter = ',', value_parser = named(Drawn::names()))]
    representation: Vec<Drawn>,
    #[command(flatten)]
    rasterizer: RasterizerOptions,
    #[command(flatten)]
    reference: ReferenceOptions,
    /// Trees per m² of all species together, instead of the scene's mean
    #[arg(long, value_name = "TREES/M2", allow_negative_numbers = true)]
    density: Option<f64>,
    /// Patches to average over; the standard error is theirs
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..=64))]
    patches: u32,
    /// Side of a patch, m
    #[arg(long, value_name = "METRES", default_value_t = 150.0, allow_negative_numbers = true)]
    patch_side: f64,
    /// Pixels along a side of the image of a patch
    #[arg(long, value_name = "N", default_value_t = 192, value_parser = clap::value_parser!(u32).range(8..=2048))]
    patch_pixels: u32,
    /// CSV to write; left out: the standard output
    #[arg(short, long, value_name = "FILE.csv")]
    out: Option<PathBuf>,
    #[command(flatten)]
    device: DeviceOptions,
    #[command(flatten)]
    print: PrintOptions,
}

/// Numbers of an option.
#[derive(Clone, Debug)]
struct List(Vec<f64>);

/// A row of the CSV.
#[derive(serde::Serialize)]
struct Row {
    representation: String,
    distance_m: f64,
    sun_zenith_deg: f64,
    slope_deg: f64,
    #[serde(flatten)]
    measured: Measured,
}

#[derive(serde::Serialize)]
struct Report<'a> {
    schema_version: u32,
    command: &'static str,
    scene: &'a str,
    densities: &'a [f64],
    rows: &'a [Row],
}

pub fn run(args: &Args) -> Result<()> {
    if let Some(out) = &args.out {
        output::check(out, "csv")?;
    }
    check(args)?;
    if !args.representation.contains(&Drawn::Reference) {
        args.reference.refuse()?;
    }
    let (scene, camera) = args.scene.load()?;
    let mut densities = mean_densities(&scene);
    if let Some(wanted) = args.density {
        let total: f64 = densities.iter().sum();
        densities.iter_mut().for_each(|d| *d *= wanted / total.max(1e-30));
    }
    // Before anything is baked.
    if densities.iter().sum::<f64>() <= 0.0 {
        return Err(Error::Usage("the scene has no trees to measure".into()));
    }
    let rows = all(args, &scene, &camera, &densities)?;
    let text = csv(&rows);
    if let Some(out) = &args.out {
        canopy::files::write_whole(out, text.as_bytes())?;
    }
    if args.print.json {
        let command = "reflectance";
        output::json(&Report {
            schema_version: SCHEMA_VERSION,
            command,
            scene: &scene.name,
            densities: &densities,
            rows: &rows,
        })
    } else if let Some(out) = &args.out {
        if args.print.quiet {
            Ok(())
        } else {
            output::print(&format!("{} rows in {}\n", rows.len(), out.display()))
        }
    } else {
        output::print(&text)
    }
}

fn check(args: &Args) -> Result<()> {
    let bad = |text: String| Err(Error::Usage(text));
    let outside = |l: &List, low: f64, high: f64| l.0.iter().copied().find(|v| !(low..=high).contains(v));
    if let Some(v) = args.sun_zenith.as_ref().and_then(|l| outside(l, 0.0, 95.0)) {
        return bad(format!("--sun-zenith {v}: 0 to 95 degrees"));
    }
    if let Some(v) = outside(&args.view_zenith, -85.0, 85.0) {
        return bad(format!("--view-zenith {v}: -85 to 85 degrees"));
    }
    if let Some(v) = outside(&args.slope, -60.0, 60.0) {
        return bad(format!("--slope {v}: -60 to 60 degrees"));
    }
    if let Some(v) = outside(&args.distance, 1.0, 1e7) {
        return bad(format!("--distance {v}: 1 to 10,000,000 m"));
    }
    if args.density.is_some_and(|d| !(d > 0.0 && d <= 10.0)) {
        return bad("--density: more than 0, at most 10 trees per m²".into());
    }
    if !(10.0..=400.0).contains(&args.patch_side) {
        return bad(format!("--patch-side {}: 10 to 400 m", args.patch_side));
    }
    Ok(())
}

/// One sun and slope, for one or several distances.
#[derive(Clone)]
struct Setting {
    drawn: Drawn,
    sun_zenith: f64,
    slope: f64,
    views: Vec<[f64; 2]>,
}

/// What is measured: the ladders or representations asked for, else the scene's ladder.
fn drawn(args: &Args, scene: &Scene) -> Vec<Drawn> {
    let asked = args.ladder.iter().map(|l| Drawn::By(*l)).chain(args.representation.iter().copied());
    let asked: Vec<Drawn> = asked.collect();
    if asked.is_empty() { vec![Drawn::By(scene.ladder)] } else { asked }
}

/// All rows, in the order of ladders and representations, suns, slopes and distances.
fn all(args: &Args, scene: &Scene, camera: &Camera, densities: &[f64]) -> Result<Vec<Row>> {
    let method = Method { patches: args.patches, side: args.patch_side, pixels: args.patch_pixels };
    let suns = args.sun_zenith.clone().unwrap_or(List(vec![90.0 - scene.sun.elevation]));
    let all_views: Vec<[f64; 2]> =
        args.azimuth.0.iter().flat_map(|a| args.view_zenith.0.iter().map(|v| [*v, *a])).collect();
    let mut settings = Vec::new();
    for drawn in drawn(args, scene) {
        for (sun_zenith, slope) in suns.0.iter().flat_map(|s| args.slope.0.iter().map(|p| (*s, *p))) {
            // Ground that turns its back shows nothing.
            let views = all_views.iter().copied().filter(|v| sees(*v, slope)).collect();
            settings.push(Setting { drawn, sun_zenith, slope, views });
        }
    }
    let distances = args.distance.0.len() as u64;
    let images = |s: &Setting| {
        let times = if s.drawn == Drawn::Reference { 1 } else { distances };
        s.views.len() as u64 * u64::from(args.patches) * times
    };
    let renders = settings.iter().any(|s| s.drawn != Drawn::Reference);
    // Before the progress bar: baking has its own.
    let baked: Vec<Baked> = if renders {
        let ladders = settings.iter().filter_map(|s| if let Drawn::By(l) = s.drawn { Some(l) } else { None });
        let found =
            load_or_bake_scene(scene, Needs::of(ladders), cache::default_dir().as_deref(), args.print.quiet)?;
        found.into_iter().map(|(b, _)| b).collect()
    } else {
        Vec::new()
    };
    let progress = Progress::new("measuring", settings.iter().map(images).sum(), args.print.quiet);
    let (size, options) = (args.scene.size, args.reference.options(DEFAULT_UNTIL, true));
    let work = |gpu: Option<&Gpu>| -> Result<Vec<Row>> {
        let mut rows = Vec::new();
        for s in &settings {
            let mut add = |distance: f64, found: Vec<Measured>| {
                rows.extend(found.into_iter().map(|measured| Row {
                    representation: s.drawn.name(),
                    distance_m: distance,
                    sun_zenith_deg: s.sun_zenith,
                    slope_deg: s.slope,
                    measured,
                }));
            };
            match (s.drawn, gpu) {
                (Drawn::By(ladder), Some(gpu)) => {
                    for &distance in &args.distance.0 {
                        let (sun_zenith, slope, views) = (s.sun_zenith, s.slope, s.views.clone());
                        let drawing = args.rasterizer.drawing(Some(ladder));
                        let r = Request { sun_zenith, slope, distance, drawing, views };
                        let from = (camera, size);
                        let mut step = || progress.step(1);
                        add(distance, measure(gpu, scene, densities, &baked, from, &method, &r, &mut step)?);
                    }
                }
                _ => {
                    let angles = [s.sun_zenith, s.slope];
                    let mut step = |_| progress.step(1);
                    let found =
                        measure_reference(scene, densities, &method, angles, &s.views, &options, &mut step)?;
                    args.distance.0.iter().for_each(|d| add(*d, found.clone()));
                }
            }
        }
        Ok(rows)
    };
    let rows = if renders { args.device.with(|gpu| work(Some(gpu))) } else { work(None) }?;
    progress.finish();
    Ok(rows)
}

/// A field of a CSV row: quoted where it has commas of its own.
fn quoted(field: &str) -> String {
    if field.contains(',') { format!("\"{field}\"") } else { field.into() }
}

fn csv(rows: &[Row]) -> String {
    let mut text = COLUMNS.join(",") + "\n";
    for r in rows {
        let m = &r.measured;
        let angles = [r.distance_m, r.sun_zenith_deg, m.view[0], m.view[1], r.slope_deg];
        let values = angles.into_iter().map(|v| v.to_string());
        let measured = [&m.fractions[..], &m.radiance(), &m.sun, &m.sky, &m.stderr].concat();
        let all: Vec<String> = std::iter::once(quoted(&r.representation))
            .chain(values)
            .chain(measured.iter().map(|v| format!("{v:.7}")))
            .collect();
        text += &(all.join(",") + "\n");
    }
    text
}

/// Numbers and ranges, with commas between.
fn list(text: &str) -> std::result::Result<List, String> {
    let number = |t: &str| match t.trim().parse::<f64>() {
        Ok(v) if v.is_finite() => Ok(v),
        _ => Err(format!("\"{t}\" is no number; write numbers or FROM:TO:STEP with commas between")),
    };
    let mut all = Vec::new();
    for part in text.split(',') {
        match part.split(':').collect::<Vec<_>>()[..] {
            [one] => all.push(number(one)?),
            [from, to, step] => {
                let (from, to, step) = (number(from)?, number(to)?, number(step)?);
                let count = ((to - from) / step + 1e-9).floor();
                if !(0.0..10_000.0).contains(&count) {
                    return Err(format!(
                        "\"{part}\" does not lead from {from} to {to} in at most 10,000 steps"
                    ));
                }
                all.extend((0..=count as u32).map(|k| from + f64::from(k) * step));
            }
            _ => return Err(format!("\"{part}\": write FROM:TO:STEP")),
        }
    }
    Ok(List(all))
}
