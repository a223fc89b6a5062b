//! `canopy difference`.

use std::path::PathBuf;

use canopy::image::Layers;
use canopy::measure::metrics::{
    AVERAGED, Detail, Difference, Estimate, difference, display, flip, key_exposure, popping,
};
use canopy::{Error, Result};

use super::SCHEMA_VERSION;
use super::options::PrintOptions;
use super::output::{self, Table};

const EXAMPLES: &str = "\
Examples:
  canopy render --quality fast --exr fast.exr; canopy render --quality accurate --exr accurate.exr
  canopy difference fast.exr accurate.exr             every metric of the first against the second
  canopy difference a.exr reference.exr -o flip.png   where they differ, as a map of FLIP
  canopy difference a.exr reference.exr --moved a2.exr reference2.exr   and popping, from where the camera was before
  canopy difference a.exr reference.exr --json        for a script

Errors of radiance are relative to the mean radiance of the reference in the same region. A reference with a layer `variance`
has its noise taken out of each metric. Intervals are of 95 %. Exit code 1 if either image has values that are no finite number.";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Linear image (of canopy render --exr)
    actual: PathBuf,
    /// Linear image that it is held against, as large
    reference: PathBuf,
    /// Factor of radiance for FLIP and structural similarity; left out: the mean of the reference becomes a grey of 18 %
    #[arg(long, value_name = "FACTOR", value_parser = factor)]
    exposure: Option<f64>,
    /// Write the map of FLIP, black (the same) to white
    #[arg(short, long, value_name = "FILE.png")]
    output: Option<PathBuf>,
    /// The same two after a small move of the camera: what changes in the image beyond what changes in the reference (popping)
    #[arg(long, num_args = 2, value_names = ["ACTUAL", "REFERENCE"])]
    moved: Option<Vec<PathBuf>>,
    #[command(flatten)]
    print: PrintOptions,
}

#[derive(serde::Serialize)]
struct Report {
    schema_version: u32,
    command: &'static str,
    actual: String,
    reference: String,
    size: [u32; 2],
    exposure: f64,
    #[serde(flatten)]
    difference: Difference,
    /// Over the reference's mean radiance; given with --moved.
    #[serde(skip_serializing_if = "Option::is_none")]
    popping: Option<Estimate>,
}

pub fn run(args: &Args) -> Result<()> {
    if let Some(png) = &args.output {
        output::check(png, "png")?;
    }
    let (actual, reference) = (Layers::read(&args.actual)?, Layers::read(&args.reference)?);
    let exposure = args.exposure.unwrap_or_else(|| key_exposure(&reference.radiance));
    let difference = difference(&actual, &reference, exposure)?;
    let popping = match args.moved.as_deref() {
        Some([a, r]) => moved([&actual, &reference], [a, r])?,
        _ => None,
    };
    if let Some(png) = &args.output {
        let shown = [&reference, &actual].map(|l| display(&l.radiance, exposure));
        canopy::image::write_png(png, &flip(reference.size, &shown[0], &shown[1]).colours, reference.size)?;
    }
    let report = Report {
        schema_version: SCHEMA_VERSION,
        command: "difference",
        actual: args.actual.display().to_string(),
        reference: args.reference.display().to_string(),
        size: reference.size,
        exposure,
        difference,
        popping,
    };
    if args.print.json {
        output::json(&report)?;
    } else if !args.print.quiet {
        output::print(&text(&report))?;
    }
    match report.difference.not_finite {
        0 => Ok(()),
        n => {
            Err(Error::Check(format!("{n} values are no finite numbers; metrics that meet one are left out")))
        }
    }
}

/// Popping between two pairs of images.
fn moved([actual, reference]: [&Layers; 2], paths: [&PathBuf; 2]) -> Result<Option<Estimate>> {
    let [actual_moved, reference_moved] = paths.map(|p| Layers::read(p));
    let (actual_moved, reference_moved) = (actual_moved?, reference_moved?);
    for (path, l) in paths.into_iter().zip([&actual_moved, &reference_moved]) {
        if l.size != reference.size {
            let ([w, h], [rw, rh]) = (l.size, reference.size);
            return Err(Error::Usage(format!(
                "{}: {w} x {h} pixels, and the reference has {rw} x {rh}; render it with --size {rw}x{rh}",
                path.display()
            )));
        }
    }
    Ok(popping([actual, &actual_moved], [reference, &reference_moved]))
}

fn factor(text: &str) -> std::result::Result<f64, String> {
    match text.parse::<f64>() {
        Ok(f) if f.is_finite() && f > 0.0 => Ok(f),
        _ => Err("write a number greater than 0".into()),
    }
}

/// A value and its interval, `digits` after the point.
pub fn shown(e: Option<Estimate>, factor: f64, digits: usize) -> [String; 2] {
    let Some(e) = e else { return ["none".into(), String::new()] };
    let number = |v: f64| format!("{:.digits$}", factor * v);
    let interval =
        e.interval.map_or("unknown".into(), |[low, high]| format!("{} – {}", number(low), number(high)));
    [number(e.value), interval]
}

/// The tables.
fn text(r: &Report) -> String {
    let d = &r.difference;
    let mut text = format!("{} against {}, {} x {}\n\n", r.actual, r.reference, r.size[0], r.size[1]);
    let mut errors =
        Table::new(1, &["radiance, %", "RMSE", "95 % interval", "bias", "95 % interval", "pixels"]);
    let named = |region| format!("{region:?}").to_lowercase();
    let squares = format!("foreground, means of {AVERAGED} x {AVERAGED} pixels");
    let whole = [("image", &d.image), ("foreground", &d.foreground), (&squares, &d.averaged)];
    let rows = whole.into_iter().filter_map(|(name, e)| Some((name.to_string(), e.as_ref()?)));
    for (name, e) in rows.chain(d.regions.iter().map(|(region, e)| (named(region), e))) {
        let ([rmse, rmse_interval], [bias, bias_interval]) =
            (shown(Some(e.rmse), 100.0, 2), shown(Some(e.bias), 100.0, 2));
        errors.row([name, rmse, rmse_interval, bias, bias_interval, e.pixels.to_string()]);
    }
    text += &errors.text();
    let mut seen = Table::new(1, &["as displayed", "", "95 % interval"]);
    let of_detail = |of: fn(&Detail) -> Estimate| d.detail.as_ref().map(of);
    for (name, e) in [
        ("FLIP", d.flip),
        ("structural similarity", d.ssim),
        ("detail of crowns: gradient", of_detail(|d| d.gradient)),
        ("detail of crowns: Laplacian", of_detail(|d| d.laplacian)),
    ] {
        let [value, interval] = shown(e, 1.0, 4);
        seen.row([name.into(), value, interval]);
    }
    if r.popping.is_some() {
        let [value, interval] = shown(r.popping, 1.0, 4);
        seen.row(["popping, of mean radiance".into(), value, interval]);
    }
    text += &format!("\n{}", seen.text());
    let mut far = Table::new(1, &["from, m", "radiance / reference", "95 % interval", "pixels"]);
    for bin in &d.over_distance {
        let [ratio, interval] = shown(bin.ratio, 1.0, 3);
        far.row([format!("{:.0}", bin.from_m), ratio, interval, bin.pixels.to_string()]);
    }
    text += &format!("\n{}", far.text());
    if let Some(noise) = d.reference_noise {
        text += &format!("\nnoise of the reference: {:.2} % a pixel and channel, taken out\n", 100.0 * noise);
    }
    text
}
