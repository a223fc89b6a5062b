//! `canopy render --representation reference`.

use std::path::Path;
use std::time::{Duration, Instant};

use canopy::camera::Eye;
use canopy::progress::Progress;
use canopy::reference::{Estimate, Options, Until, World};
use canopy::scene::{Camera, Scene};
use canopy::{Error, Result};

use super::SCHEMA_VERSION;
use super::options::PrintOptions;
use super::output::{self, Table};

/// When to stop if no one says: a picture to look at.
pub const DEFAULT_UNTIL: Until = Until::Samples(16);
/// Time between two writings of the file to resume from.
const CHECKPOINT: Duration = Duration::from_secs(30);
/// Steps of the progress bar.
const STEPS: f64 = 1000.0;

/// What to draw and where to write it.
pub struct Request<'a> {
    pub scene: &'a Scene,
    pub camera: &'a Camera,
    pub size: [u32; 2],
    pub options: Options,
    pub resume: Option<&'a Path>,
    pub exposure: f64,
    pub png: &'a Path,
    pub exr: Option<&'a Path>,
    pub load_s: f64,
    pub print: PrintOptions,
}

#[derive(serde::Serialize)]
struct Report<'a> {
    schema_version: u32,
    command: &'static str,
    representation: &'static str,
    scene: &'a str,
    seed: u32,
    camera: &'a str,
    size: [u32; 2],
    exposure: f64,
    light: &'static str,
    /// `null`: any number.
    bounces: Option<u32>,
    sample_seed: u32,
    trees: usize,
    triangles: usize,
    samples: u32,
    resumed_samples: u32,
    relative_error: f64,
    relative_error_of_mean: f64,
    rays: u64,
    rays_per_s: f64,
    load_s: f64,
    build_s: f64,
    trace_s: f64,
    outputs: Outputs,
}

#[derive(serde::Serialize)]
struct Outputs {
    png: String,
    exr: Option<String>,
    resume: Option<String>,
}

pub fn render(r: Request) -> Result<()> {
    let resumed = match r.resume {
        Some(path) => {
            canopy::files::check_writable(path)?;
            path.exists().then(|| Estimate::load(path)).transpose()?
        }
        None => None,
    };
    let resumed_samples = resumed.as_ref().map_or(0, |e| e.samples);
    let start = Instant::now();
    let eye = Eye::new(r.camera, &r.scene.terrain, r.size);
    let world = World::new(r.scene, &[eye])?;
    let build_s = start.elapsed().as_secs_f64();

    let start = Instant::now();
    let progress = Progress::new("tracing", STEPS as u64, r.print.quiet);
    let (mut rays, mut saved, mut failed) = (0, Instant::now(), None::<Error>);
    let estimate = world.render(&eye, &r.options, resumed, &mut |p| {
        rays = p.rays;
        let error = 100.0 * p.estimate.relative_error();
        progress.set((STEPS * p.done) as u64, &format!("error {error:.2} %, {} spp", p.estimate.samples));
        if let Some(path) = r.resume.filter(|_| saved.elapsed() > CHECKPOINT) {
            // The image goes on; what failed is said at the end.
            failed = p.estimate.save(path).err().or(failed.take());
            saved = Instant::now();
        }
    })?;
    progress.finish();
    let trace_s = start.elapsed().as_secs_f64();
    if let Some(path) = r.resume {
        estimate.save(path)?;
    }
    if let Some(error) = failed {
        return Err(error);
    }
    let picture = estimate.picture(r.exposure);
    picture.write_png(r.png)?;
    if let Some(exr) = r.exr {
        picture.write_exr(exr)?;
    }
    let report = Report {
        schema_version: SCHEMA_VERSION,
        command: "render",
        representation: "reference",
        scene: &r.scene.name,
        seed: r.scene.seed,
        camera: &r.camera.name,
        size: r.size,
        exposure: r.exposure,
        light: r.options.light.name(),
        bounces: r.options.bounces,
        sample_seed: r.options.seed,
        trees: world.tree_count(),
        triangles: world.triangle_count(),
        samples: estimate.samples,
        resumed_samples,
        relative_error: estimate.relative_error(),
        relative_error_of_mean: estimate.relative_error_of_mean(),
        rays,
        rays_per_s: rays as f64 / trace_s.max(1e-9),
        load_s: r.load_s,
        build_s,
        trace_s,
        outputs: Outputs {
            png: r.png.display().to_string(),
            exr: r.exr.map(|p| p.display().to_string()),
            resume: r.resume.map(|p| p.display().to_string()),
        },
    };
    if r.print.json {
        output::json(&report)
    } else if r.print.quiet {
        Ok(())
    } else {
        output::print(&text(&report))
    }
}

fn text(r: &Report) -> String {
    let mut text = format!("{}, camera {}, {} x {}, reference\n\n", r.scene, r.camera, r.size[0], r.size[1]);
    let mut table = Table::new(1, &["paths", ""]);
    let bounces = r.bounces.map_or("any number of".into(), |n| n.to_string());
    for (what, value) in [
        ("light", r.light.to_string()),
        ("surfaces on its way", bounces),
        ("trees", r.trees.to_string()),
        ("triangles of all species", r.triangles.to_string()),
        ("samples a pixel", r.samples.to_string()),
        ("of them resumed", r.resumed_samples.to_string()),
        ("error of a pixel, %", format!("{:.3}", 100.0 * r.relative_error)),
        ("error of the mean, %", format!("{:.4}", 100.0 * r.relative_error_of_mean)),
        ("million rays", format!("{:.1}", r.rays as f64 * 1e-6)),
        ("million rays a second", format!("{:.2}", r.rays_per_s * 1e-6)),
        ("load, s", format!("{:.2}", r.load_s)),
        ("build, s", format!("{:.2}", r.build_s)),
        ("trace, s", format!("{:.2}", r.trace_s)),
    ] {
        table.row([what.into(), value]);
    }
    text += &format!("{}\nwrote {}\n", table.text(), r.outputs.png);
    for path in r.outputs.exr.iter().chain(&r.outputs.resume) {
        text += &format!("wrote {path}\n");
    }
    text
}
