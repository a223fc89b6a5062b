//! What the CPU does: loading, planning, streaming and baking. `cargo bench [NAME]`; plots and comparisons with the run
//! before are criterion's, in target/criterion.

use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::time::Duration;

use canopy::bake::tables::measure_species;
use canopy::bake::{BakeSettings, ForestSettings, Source, bake_species};
use canopy::camera::Eye;
use canopy::land::pattern::Pattern;
use canopy::land::quadtree::{MIN_REFINE, Quadtree};
use canopy::physics::terrain::height_and_slope;
use canopy::plan::Plan;
use canopy::scene::{self, OpticsOverride, model};
use canopy::settings::Settings;
use canopy::tree::{self, Preset};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

fn loading(c: &mut Criterion) {
    let mut group = c.benchmark_group("load");
    group.sample_size(20);
    group.bench_function("default scene", |b| b.iter(|| scene::default_scene().unwrap()));
    let oak = std::fs::read(data("oak.glb")).unwrap();
    group.throughput(Throughput::Bytes(oak.len() as u64));
    let name = Path::new("oak.glb");
    group.bench_function("oak.glb", |b| {
        b.iter(|| model::load_model_bytes(name, black_box(&oak), None, None).unwrap())
    });
    let map = data("jacksboro_u16.png");
    group.throughput(Throughput::Elements(365 * 388));
    group.bench_function("height map", |b| {
        b.iter(|| scene::raster::load_heights(&map, Some([0.0, 2000.0])).unwrap())
    });
    group.bench_function("grow an oak", |b| b.iter(|| tree::glb(Preset::Oak, black_box(1))));
}

fn planning(c: &mut Criterion) {
    let scene = scene::default_scene().unwrap();
    c.bench_function("plan/default scene", |b| {
        b.iter(|| Plan::new(&scene, &scene.cameras[0], [1024, 768], false, None).unwrap())
    });
    for points in [64, 256] {
        c.bench_function(&format!("plan/pattern of {points} points"), |b| {
            b.iter(|| Pattern::new(black_box(points), 7))
        });
    }
}

fn streaming(c: &mut Criterion) {
    let scene = scene::default_scene().unwrap();
    let terrain = &scene.terrain;
    c.bench_function("quadtree/build", |b| b.iter(|| Quadtree::new(terrain, f64::INFINITY)));
    let quads = Quadtree::new(terrain, f64::INFINITY);
    for camera in &scene.cameras {
        let eye = Eye::new(camera, terrain, [1024, 768]);
        let planes = eye.planes();
        c.bench_function(&format!("quadtree/select {}", camera.name), |b| {
            b.iter(|| {
                quads.select(eye.position, MIN_REFINE, 100_000, &|box_| box_.touches(&planes, eye.position))
            })
        });
    }
    // What decides on a seed on the CPU, as the shaders do: height and slope of the ground under it.
    let heights = terrain.heights.as_ref().unwrap();
    let mut group = c.benchmark_group("seeds");
    group.throughput(Throughput::Elements(1000));
    group.bench_function("ground under 1000", |b| {
        b.iter(|| (0..1000).map(|k| height_and_slope(heights, f64::from(k) * 0.13, 40.0)[0]).sum::<f64>())
    });
}

fn baking(c: &mut Criterion) {
    let mesh = model::load_named(Path::new("builtin:birch"), None).unwrap();
    let (optics, settings) = (
        OpticsOverride::default(),
        BakeSettings {
            rings: 3,
            resolution: 64,
            occlusion_rays: 16,
            transfer_bands: 0,
            transfer_resolution: 32,
        },
    );
    let mut group = c.benchmark_group("bake");
    group.sample_size(10).measurement_time(Duration::from_secs(8));
    group.bench_function("birch, 25 views of 64²", |b| {
        b.iter(|| bake_species(&mesh, &optics, &settings, true).unwrap())
    });
    let cache = tempfile::tempdir().unwrap();
    let cached =
        || Source::new(&mesh, &optics, &settings, Some(cache.path()), true).unwrap().load_views().unwrap();
    let (species, _) = cached();
    group.bench_function("birch from the cache", |b| b.iter(cached));
    let mut knobs = Settings::preset("fast").unwrap();
    knobs.table_angles = 6;
    knobs.table_densities = 3;
    knobs.table_rays = 64;
    let forest = ForestSettings::new(&knobs, 0.03, [0.8, 1.2], false);
    group.bench_function("tables of far birches", |b| {
        b.iter(|| measure_species(&species, &forest, true).unwrap())
    });
}

fn quick() -> Criterion {
    Criterion::default().warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(2))
}

criterion_group! { name = cpu; config = quick(); targets = loading, planning, streaming, baking }
criterion_main!(cpu);
