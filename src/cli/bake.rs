//! `canopy bake`.

mod as_mesh;

use std::path::PathBuf;
use std::time::Instant;

use canopy::Result;
use canopy::bake::tables::{self, ForestSettings};
use canopy::bake::{self, BakeSettings, CacheState, Needs, Source, SpeciesBake, cache};
use canopy::scene::{Mesh, OpticsOverride};
use canopy::settings::Settings;

use super::SCHEMA_VERSION;
use super::options::{PrintOptions, QualityOptions, knobs_help};
use super::output::{self, Table};

const EXAMPLES: &str = "\
Examples:
  canopy bake builtin:oak                   what the built-in scene would bake on first use
  canopy bake oak.glb --height 15           as a scene with `height = 15.0` needs it
  canopy bake my.toml                       every species of a scene
  canopy bake oak.glb --verify 64           how well the z-field stands for the mesh
  canopy bake oak.glb --verify 64 --min-iou 0.8   and exit code 1 if it is worse than that
  canopy bake oak.glb --set view_rings=6    with fewer views
  canopy bake my.toml --ahead               and all else that drawing it takes, meshes too: nothing is baked on first use
  canopy bake oak.glb --forest 0.03         and the tables of a far forest of 0.03 trees per m²
Bakes are kept in $CANOPY_CACHE, else $XDG_CACHE_HOME/canopy, else ~/.cache/canopy: views (.zfield), light transfer (.transfer), crowns
around leaves (.envelopes), levels of detail (.levels), clouds of cards (.cards), slices of its scene's forest (.shells), light of all orders (.indirect) and tables (.forest) apart. Of each it is said whether it was read from there (hit), baked, or baked again because the file
was damaged (rebuilt).";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES, after_long_help = format!("{EXAMPLES}\n\n{}", knobs_help()))]
pub struct Args {
    /// Model (.glb, .gltf), builtin:NAME of a species of `canopy tree`, or a scene file (.toml): its every species
    model: PathBuf,
    /// Height of an unscaled tree, m; left out: as modelled
    #[arg(long, value_name = "METRES")]
    height: Option<f64>,
    /// Make what drawing would make on first use as well: of a model what meshes take (the crowns around its leaves, its levels of detail), of a
    /// scene's species also their tables, light of all orders, and clouds of cards and slices of forest if its ladder has them
    #[arg(long)]
    ahead: bool,
    /// Compare the bake with its mesh from N directions between the stored views, and the mesh's levels of detail with the whole
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    verify: Option<u32>,
    /// Exit with code 1 if the worst of these directions agrees less (IoU of the silhouettes, after the most iterations)
    #[arg(long, value_name = "0..1", requires = "verify")]
    min_iou: Option<f64>,
    /// Measure the tables of the species' far forest, for patterns of D trees per m²
    #[arg(long, value_name = "D")]
    forest: Option<f64>,
    #[command(flatten)]
    quality: QualityOptions,
    #[command(flatten)]
    print: PrintOptions,
}

/// Agreement of z-field and mesh at a number of iterations.
#[derive(serde::Serialize)]
struct Quality {
    iterations: u32,
    directions: u32,
    iou_mean: f64,
    iou_min: f64,
    coverage_ratio_mean: f64,
    median_depth_error_m_mean: f64,
    depth_error_m_mean: f64,
}

#[derive(serde::Serialize)]
struct Optics {
    height_m: f32,
    crown_radius_m: f32,
    crown_base_m: f32,
    projected_area_m2: f32,
    extinction_per_m: f32,
    leaf_reflectance: [f32; 3],
    leaf_transmittance: [f32; 3],
}

/// Light transfer of the views.
#[derive(serde::Serialize)]
struct Transfer {
    bands: u32,
    resolution: u32,
    bytes: usize,
    cache: &'static str,
    path: Option<String>,
    seconds: f64,
}

/// Tables of a far forest.
#[derive(serde::Serialize)]
struct Forest {
    trees_per_m2: f64,
    max_thickness: f32,
    cache: &'static str,
    path: Option<String>,
    seconds: f64,
    /// Largest standard errors.
    ground_error: f32,
    tree_light_error: f32,
    /// At full density: visible ground, and light on what is seen of trees from the light's own direction, by degrees.
    samples: Vec<[f64; 3]>,
}

/// Where from the rest came that a scene's species are drawn with.
#[derive(serde::Serialize)]
struct Ahead {
    tables: &'static str,
    indirect: Option<&'static str>,
}

#[derive(serde::Serialize)]
struct Baked {
    name: String,
    triangles: usize,
    views: u32,
    resolution: u32,
    bytes: usize,
    /// Of the views, with crown and optics.
    cache: &'static str,
    path: Option<String>,
    /// Of all but the tables.
    seconds: f64,
    transfer: Option<Transfer>,
    optics: Optics,
    verify: Vec<Quality>,
    forest: Option<Forest>,
    mesh: Option<as_mesh::AsMesh>,
    ahead: Option<Ahead>,
}

#[derive(serde::Serialize)]
struct Report {
    schema_version: u32,
    command: &'static str,
    species: Vec<Baked>,
}

pub fn run(args: &Args) -> Result<()> {
    let mut species = Vec::new();
    if args.model.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml")) {
        let mut scene = canopy::scene::load_at(Some(&args.model), args.quality.preset.as_deref())?;
        args.quality.set(&mut scene.settings)?;
        for s in &scene.species {
            species.push(one(args, s.name.clone(), (&s.mesh, &s.optics, s.scale), &scene.settings)?);
        }
        if args.ahead {
            let needs = Needs { envelopes: true, ..Needs::of([scene.ladder]) };
            let all =
                bake::load_or_bake_scene(&scene, needs, cache::default_dir().as_deref(), args.print.quiet)?;
            for (s, (_, from)) in species.iter_mut().zip(&all) {
                s.ahead =
                    Some(Ahead { tables: from.tables.name(), indirect: from.indirect.map(CacheState::name) });
            }
        }
    } else {
        let settings = args.quality.settings()?;
        let mesh = canopy::scene::model::load_named(&args.model, args.height)?;
        let name = args.model.display().to_string();
        species.push(one(args, name, (&mesh, &OpticsOverride::default(), [1.0; 2]), &settings)?);
    }
    let report = Report { schema_version: SCHEMA_VERSION, command: "bake", species };
    if args.print.json {
        output::json(&report)?;
    } else if !args.print.quiet {
        output::print(&report.species.iter().map(text).collect::<String>())?;
    }
    let Some(least) = args.min_iou else { return Ok(()) };
    let last = report.species.iter().filter_map(|b| Some((b, b.verify.last()?)));
    let remedy = "view_rings, view_resolution or view_iterations";
    last.into_iter()
        .try_for_each(|(b, q)| bake::demand(&b.name, "z-field and mesh", q.iou_min, least, remedy))
}

/// Bakes one species and, if asked, compares.
fn one(
    args: &Args,
    name: String,
    (mesh, optics, scale): (&Mesh, &OpticsOverride, [f32; 2]),
    settings: &Settings,
) -> Result<Baked> {
    let wanted = BakeSettings::from(settings);
    let dir = cache::default_dir();
    let start = Instant::now();
    let source = Source::new(mesh, optics, &wanted, dir.as_deref(), args.print.quiet)?;
    let (mut bake, from) = source.load_views()?;
    let begun = Instant::now();
    let state = source.load_transfer(&mut bake)?;
    let (seconds, transfer_s) = (start.elapsed().as_secs_f64(), begun.elapsed().as_secs_f64());
    let transfer = state.map(|state| Transfer {
        bands: wanted.transfer_bands,
        resolution: bake.transfer.resolution,
        bytes: bake.transfer.bands.iter().flatten().map(Vec::len).sum(),
        cache: state.name(),
        path: kept(source.transfer_path()),
        seconds: transfer_s,
    });
    let verify = match args.verify {
        Some(n) => {
            (1..=settings.view_iterations).map(|i| quality(mesh, &bake, n, i)).collect::<Result<_>>()?
        }
        None => Vec::new(),
    };
    let tables =
        |density| forest(&source, (&mut bake, state), ForestSettings::new(settings, density, scale, false));
    let forest = args.forest.map(tables).transpose()?;
    let mesh_too = args.ahead || args.verify.is_some();
    let mesh_takes =
        mesh_too.then(|| as_mesh::as_mesh(args.verify, &source, (mesh, &bake), settings)).transpose()?;
    Ok(Baked {
        name,
        triangles: mesh.triangles.len(),
        views: canopy::physics::views::count(wanted.rings),
        resolution: wanted.resolution,
        bytes: bake.views.levels.iter().map(Vec::len).sum(),
        cache: from.name(),
        path: kept(source.views_path()),
        seconds,
        transfer,
        optics: Optics {
            height_m: bake.crown.height,
            crown_radius_m: bake.crown.radius,
            crown_base_m: bake.crown.base,
            projected_area_m2: bake.area,
            extinction_per_m: bake.crown.extinction,
            leaf_reflectance: bake.reflectance,
            leaf_transmittance: bake.transmittance,
        },
        verify,
        forest,
        mesh: mesh_takes,
        ahead: None,
    })
}

/// A file of the cache, if it is there.
fn kept(path: Option<PathBuf>) -> Option<String> {
    Some(path.filter(|p| p.is_file())?.display().to_string())
}

/// Measures the tables of a species, or reads them.
fn forest(
    source: &Source,
    (bake, mut transfer): (&mut SpeciesBake, Option<CacheState>),
    wanted: ForestSettings,
) -> Result<Forest> {
    let start = Instant::now();
    let (t, from) = source.load_tables(&wanted, bake, &mut transfer)?;
    let seconds = start.elapsed().as_secs_f64();
    let path = cache::default_dir().map(|d| tables::path(&d, &tables::key(&source.key(), &wanted)));
    let x = f64::from(t.max_thickness);
    let sample = |degrees: f64| {
        let a = degrees.to_radians();
        let [_, leaf, bark, _] = canopy::physics::tables::pair(&t, a, a, 0.0, x);
        [degrees, canopy::physics::tables::visible_ground(&t, a, x), leaf + bark]
    };
    Ok(Forest {
        trees_per_m2: wanted.pattern_density,
        max_thickness: t.max_thickness,
        cache: from.name(),
        path: kept(path),
        seconds,
        ground_error: t.pair_stderr.iter().map(|e| e[0]).fold(0.0, f32::max),
        tree_light_error: t.pair_stderr.iter().map(|e| e[1]).fold(0.0, f32::max),
        samples: [0.0, 30.0, 60.0, 80.0].map(sample).to_vec(),
    })
}

fn quality(mesh: &Mesh, bake: &SpeciesBake, directions: u32, iterations: u32) -> Result<Quality> {
    let report = bake::verify(mesh, bake, directions, iterations)?;
    Ok(Quality {
        iterations,
        directions,
        iou_mean: report.mean(|v| v.iou),
        iou_min: report.min_iou(),
        coverage_ratio_mean: report.mean(|v| v.coverage_ratio),
        median_depth_error_m_mean: report.mean(|v| v.median_depth_error),
        depth_error_m_mean: report.mean(|v| v.mean_depth_error),
    })
}

fn text(b: &Baked) -> String {
    let o = &b.optics;
    let transfer = b.transfer.as_ref();
    let bands = |t: &Transfer| {
        format!("{} of {2} x {2} texels, {}", t.bands, output::bytes(t.bytes as u64), t.resolution)
    };
    let cached =
        |cache: &str, path: &Option<String>| format!("{cache} {}", path.as_deref().unwrap_or("(not kept)"));
    let rgb = |c: [f32; 3]| format!("{:.4} {:.4} {:.4}", c[0], c[1], c[2]);
    let mut table = Table::new(2, &[b.name.as_str(), ""]);
    for (what, value) in [
        ("triangles", b.triangles.to_string()),
        (
            "views",
            format!("{} of {2} x {2} texels, {}", b.views, output::bytes(b.bytes as u64), b.resolution),
        ),
        ("bands of light transfer", transfer.map_or("none".into(), bands)),
        ("height", format!("{:.2} m", o.height_m)),
        ("crown", format!("radius {:.2} m, from {:.2} m up", o.crown_radius_m, o.crown_base_m)),
        ("projected area", format!("{:.2} m²", o.projected_area_m2)),
        ("extinction", format!("{:.3} /m", o.extinction_per_m)),
        ("leaf reflectance", rgb(o.leaf_reflectance)),
        ("leaf transmittance", rgb(o.leaf_transmittance)),
        ("time", format!("{:.2} s", b.seconds)),
        ("cache: views", cached(b.cache, &b.path)),
        ("cache: light transfer", transfer.map_or("not asked for".into(), |t| cached(t.cache, &t.path))),
    ] {
        table.row([format!("  {what}"), value]);
    }
    let mut text = table.text();
    if let Some(f) = &b.forest {
        let title = format!("  forest of {} trees per m²", f.trees_per_m2);
        let mut table = Table::new(2, &[title.as_str(), ""]);
        table.row(["  λA".into(), format!("{:.3}", f.max_thickness)]);
        table.row(["  time".into(), format!("{:.2} s", f.seconds)]);
        table.row(["  cache: tables".into(), cached(f.cache, &f.path)]);
        table.row([
            "  largest error of G, T".into(),
            format!("{:.4}, {:.4}", f.ground_error, f.tree_light_error),
        ]);
        for [degrees, visible, lit] in &f.samples {
            table
                .row([format!("  ground seen, light seen at {degrees}°"), format!("{visible:.4}, {lit:.4}")]);
        }
        text += &table.text();
    }
    if !b.verify.is_empty() {
        let headings = ["iterations", "IoU mean", "IoU min", "coverage", "depth error: median", "mean"];
        let mut table = Table::new(0, &headings);
        for q in &b.verify {
            table.row([
                q.iterations.to_string(),
                format!("{:.4}", q.iou_mean),
                format!("{:.4}", q.iou_min),
                format!("{:.4}", q.coverage_ratio_mean),
                format!("{:.3} m", q.median_depth_error_m_mean),
                format!("{:.3} m", q.depth_error_m_mean),
            ]);
        }
        text += &format!("  z-field against mesh, {} directions\n{}", b.verify[0].directions, table.text());
    }
    text + &b.mesh.as_ref().map_or(String::new(), as_mesh::text)
        + &b.ahead.as_ref().map_or(String::new(), ahead_text)
}

fn ahead_text(a: &Ahead) -> String {
    let mut table = Table::new(2, &["  ahead", ""]);
    table.row(["  cache: tables".into(), a.tables.to_string()]);
    table.row(["  cache: light of all orders".into(), a.indirect.unwrap_or("not asked for").to_string()]);
    table.text()
}
