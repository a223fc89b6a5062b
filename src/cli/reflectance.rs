//! `canopy reflectance`.

use std::path::PathBuf;

use canopy::bake::{cache, load_or_bake_scene};
use canopy::gpu::Gpu;
use canopy::measure::reflectance::{Measured, Method, Request, mean_densities, measure};
use canopy::plan::Representation;
use canopy::progress::Progress;
use canopy::scene::Scene;
use canopy::{Error, Result};

use super::SCHEMA_VERSION;
use super::options::{DeviceOptions, PrintOptions, SceneOptions, knobs_help, named};
use super::output;

const EXAMPLES: &str = "\
Examples:
  canopy reflectance --view-zenith -75:75:5 --out brf.csv
      the built-in forest in the plane of the sun, from 1 km
  canopy reflectance scene.toml --sun-zenith 45 --view-zenith -75:75:5 --azimuth 0 \\
         --distance 50,200,1000,20000 --representation auto --out brf.csv
  canopy reflectance scene.toml --representation zfield,shader-map --distance 100,400
  canopy reflectance scene.toml --density 0.01 --slope -20,0,20 --json
A list is numbers and ranges FROM:TO:STEP, with commas between. A negative view zenith is the side away from the sun; a
positive slope descends towards the sun. Pixels are those of --size and --camera.";

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
    /// How trees are drawn: auto, zfield, shader-map; or several with commas between
    #[arg(long, value_name = "NAMES", default_value = "auto", value_delimiter = ',', value_parser = named(Representation::NAMES))]
    representation: Vec<Representation>,
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
    representation: &'static str,
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
    let rows = args.device.with(|gpu| all(args, gpu, &scene, &camera, &densities))?;
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

fn all(
    args: &Args,
    gpu: &Gpu,
    scene: &Scene,
    camera: &canopy::scene::Camera,
    densities: &[f64],
) -> Result<Vec<Row>> {
    let baked: Vec<_> = load_or_bake_scene(scene, cache::default_dir().as_deref(), args.print.quiet)?
        .into_iter()
        .map(|(b, _)| b)
        .collect();
    let method = Method { patches: args.patches, side: args.patch_side, pixels: args.patch_pixels };
    let suns = args.sun_zenith.clone().unwrap_or(List(vec![90.0 - scene.sun.elevation]));
    let all_views: Vec<[f64; 2]> =
        args.azimuth.0.iter().flat_map(|a| args.view_zenith.0.iter().map(|v| [*v, *a])).collect();
    let requests: Vec<Request> = args
        .representation
        .iter()
        .flat_map(|r| suns.0.iter().map(move |s| (*r, *s)))
        .flat_map(|(r, s)| args.slope.0.iter().map(move |slope| (r, s, *slope)))
        .flat_map(|(r, s, slope)| args.distance.0.iter().map(move |d| (r, s, slope, *d)))
        .map(|(representation, sun_zenith, slope, distance)| Request {
            sun_zenith,
            slope,
            distance,
            representation,
            // Ground that turns its back shows nothing.
            views: all_views.iter().copied().filter(|v| sees(*v, slope)).collect(),
        })
        .collect();
    let images = requests.iter().map(|r| r.views.len() as u64).sum::<u64>() * u64::from(args.patches);
    let progress = Progress::new("measuring", images, args.print.quiet);
    let mut rows = Vec::new();
    for r in &requests {
        let size = args.scene.size;
        let found =
            measure(gpu, scene, densities, &baked, (camera, size), &method, r, &mut || progress.step(1))?;
        rows.extend(found.into_iter().map(|measured| Row {
            representation: r.representation.name(),
            distance_m: r.distance,
            sun_zenith_deg: r.sun_zenith,
            slope_deg: r.slope,
            measured,
        }));
    }
    progress.finish();
    Ok(rows)
}

/// Whether a slope shows its face to a view direction, by five degrees at least.
fn sees([zenith, azimuth]: [f64; 2], slope: f64) -> bool {
    let (z, a, s) = (zenith.to_radians(), azimuth.to_radians(), slope.to_radians());
    z.sin() * a.cos() * s.sin() + z.cos() * s.cos() > 5f64.to_radians().sin()
}

fn csv(rows: &[Row]) -> String {
    let mut text = COLUMNS.join(",") + "\n";
    for r in rows {
        let m = &r.measured;
        let angles = [r.distance_m, r.sun_zenith_deg, m.view[0], m.view[1], r.slope_deg];
        let values = angles.into_iter().map(|v| v.to_string());
        let measured = [&m.fractions[..], &m.radiance(), &m.sun, &m.sky, &m.stderr].concat();
        let all: Vec<String> = std::iter::once(r.representation.to_string())
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
