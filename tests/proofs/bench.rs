//! What timing costs, and what two benches of one build say of each other on this machine.

use std::sync::Arc;

use canopy::clock::{process_cpu_ms_since, process_cpu_ns};
use canopy::frame::Renderer;
use canopy::gpu::{Gpu, GpuOptions, Stamps, TimingOptions};
use canopy::measure::bench::{Request, Subject, plan, run};
use canopy::measure::compare::{FRAME, Verdict, compare};
use canopy::measure::path::CameraPath;
use canopy::measure::results::{BenchResult, Cold};
use canopy::measure::statistics::{block_bootstrap, median};

use crate::device;

/// Oaks on a plain in 160 x 120 pixels: frames of some 80 ms of CPU time on llvmpipe.
fn subject(gpu: &Gpu) -> (Subject, CameraPath) {
    let scene = device::small_scene(
        "[terrain]\nextent = 600.0\n[[species]]\nname = \"oak\"\nmodel = \"builtin:oak\"\ndensity = 0.01\n\
         [sun]\nazimuth = 120.0\nelevation = 35.0\nirradiance = [1.0, 0.95, 0.85]\n\
         [[camera]]\nname = \"c\"\nposition = [300.0, 150.0, 20.0]\ntarget = [300.0, 400.0, 5.0]\nvertical_fov = 45.0\n",
    );
    let path = CameraPath::builtin("approach", &scene, &scene.cameras[0]).unwrap();
    let plan = plan(&scene, &path.views(0.5).unwrap(), [160, 120], None, gpu).unwrap();
    let baked = device::bake(&scene);
    let renderer = Renderer::new(gpu, Arc::new(scene), plan, &baked).unwrap();
    (Subject { renderer, cold: Cold::default() }, path)
}

fn open() -> Gpu {
    Gpu::new(&GpuOptions::default()).unwrap()
}

/// Each view once with and once without, in turn, which first alternating: CPU time of the process, logarithms.
fn overhead(gpu: &Gpu, subject: &mut Subject, path: &CameraPath, with: TimingOptions) -> (f64, [f64; 2]) {
    let off = TimingOptions { stamps: Stamps::None, apart: false, statistics: false };
    let views = path.views(0.5).unwrap();
    let mut pairs = Vec::new();
    for k in 0..12 * views.len() {
        let mut time = |options| {
            gpu.set_timing(options);
            let start = process_cpu_ns();
            subject.renderer.render(&views[k % views.len()], 1.0).unwrap();
            process_cpu_ms_since(start).unwrap().ln()
        };
        let (a, b) = if k % 2 == 0 {
            (time(off), time(with))
        } else {
            let b = time(with);
            (time(off), b)
        };
        pairs.push(b - a);
    }
    let middle = median(&pairs).exp() - 1.0;
    (middle, block_bootstrap(&pairs, 8, 0.95, median).map(|x| x.exp() - 1.0))
}

#[test]
#[ignore = "takes minutes"]
fn stamps_cost_at_most_two_per_cent() {
    let gpu = open();
    let (mut subject, path) = subject(&gpu);
    for view in path.views(0.5).unwrap() {
        subject.renderer.render(&view, 1.0).unwrap();
    }
    let stamps = TimingOptions { stamps: Stamps::Scopes, apart: false, statistics: false };
    for (name, options, bound) in [
        ("stamps", stamps, 0.02),
        // Not a stamp: what a submission for each pass costs, in the shortest frames that anyone benches.
        ("stamps, each pass apart", TimingOptions { apart: true, ..stamps }, f64::INFINITY),
        ("stamps and pipeline statistics", TimingOptions { statistics: true, ..stamps }, f64::INFINITY),
    ] {
        let (cost, interval) = overhead(&gpu, &mut subject, &path, options);
        println!(
            "{name}: {:+.2} %, 95 % interval {:+.2} to {:+.2} %",
            1e2 * cost,
            1e2 * interval[0],
            1e2 * interval[1]
        );
        assert!(cost <= bound);
    }
    drop(subject);
    gpu.close().unwrap();
}

/// A path of two minutes at most, each frame alone.
fn request(path: CameraPath) -> Request {
    Request {
        path,
        step: 0.5,
        frames: 128,
        duration: 120.0,
        timing: TimingOptions::default(),
        pace: false,
        in_flight: 0,
        validate: false,
    }
}

/// What is missing are the stamps and barriers between passes; the median frame, because others may take the core between two.
#[test]
#[ignore = "takes minutes"]
fn passes_are_all_of_the_frame_within_three_per_cent() {
    let gpu = open();
    let (subject, path) = subject(&gpu);
    let timing = TimingOptions { stamps: Stamps::Scopes, apart: false, statistics: false };
    let request = Request { timing, ..request(path) };
    let mut subjects = [subject];
    let result = run(&gpu, &mut subjects, &request, true).unwrap().swap_remove(0);
    let parts: Vec<f64> = result
        .frames
        .iter()
        .map(|f| f.passes.iter().map(|p| p.gpu_ms).sum::<f64>() / f.gpu_ms.unwrap())
        .collect();
    let middle = median(&parts);
    let least = parts.iter().copied().fold(f64::INFINITY, f64::min);
    println!(
        "passes are {:.2} % of their frame in the median, {:.2} % in the worst",
        1e2 * middle,
        1e2 * least
    );
    drop(subjects);
    gpu.close().unwrap();
    assert!((0.97..=1.0).contains(&middle));
}

/// Benches one after the other, each compared with the one before; then the same with 5 % planted into a pass.
#[test]
#[ignore = "takes minutes"]
fn a_build_is_itself_and_five_per_cent_are_found() {
    let gpu = open();
    let (subject, path) = subject(&gpu);
    let timing = TimingOptions { stamps: Stamps::Scopes, apart: true, statistics: false };
    let request = Request { frames: 256, timing, pace: true, ..request(path) };
    let mut subjects = [subject];
    let runs: Vec<BenchResult> =
        (0..21).map(|_| run(&gpu, &mut subjects, &request, true).unwrap().swap_remove(0)).collect();
    let changed = |a: &BenchResult, b: &BenchResult| -> Vec<String> {
        let rows = compare(a, b, false).unwrap().rows;
        let changed = rows.into_iter().filter(|r| r.verdict != Verdict::NoDifference);
        changed.map(|r| format!("{} {:+.1} %", r.name, 100.0 * (r.ratio - 1.0))).collect()
    };
    let mut same = 0;
    for pair in runs.windows(2) {
        let found = changed(&pair[0], &pair[1]);
        same += usize::from(found.is_empty());
        if !found.is_empty() {
            println!("differs from itself: {found:?}");
        }
    }
    println!("no difference in {same} of 20");
    let mut all = vec![same];
    for pass in ["trees", "shadows", "terrain"] {
        let mut found = 0;
        for pair in runs.windows(2) {
            let mut slow = pair[1].clone();
            for f in &mut slow.frames {
                let p = f.passes.iter_mut().find(|p| p.name == pass).unwrap();
                let more = 0.05 * p.cpu_ms.unwrap();
                p.cpu_ms = p.cpu_ms.map(|t| t + more);
                f.cpu_ms = f.cpu_ms.map(|t| t + more);
            }
            let names = changed(&pair[0], &slow);
            let only = names.iter().all(|n| n.starts_with(pass) || n.starts_with(FRAME));
            found += usize::from(only && names.iter().any(|n| n.starts_with(pass)));
        }
        println!("5 % of {pass}: found and named in {found} of 20");
        all.push(found);
    }
    drop(subjects);
    gpu.close().unwrap();
    assert!(all.iter().all(|n| *n >= 19), "{all:?}");
}
