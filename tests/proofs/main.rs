//! Proofs that take minutes, behind a command of their own:
//! `cargo test --release --test proofs -- --ignored --nocapture [NAME]`.
//!
//! Each prints its figures, and writes pictures, plots and tables to `target/tmp/proofs`.

mod bench;
mod cost;
#[path = "../common/device.rs"]
#[allow(dead_code, unused_imports)] // Each test program uses its own part of this module.
mod device;
mod effects;
mod near;
mod planted;
mod plot;
mod popping;
mod precision;
mod scale;
mod soak;

use std::path::PathBuf;

use canopy::bake::{Baked, Needs, load_or_bake_scene};
use canopy::physics::light::luminance;
use canopy::scene::{self, Scene};

/// Where proofs leave what they made.
fn folder() -> PathBuf {
    let path = device::folder().join("proofs");
    std::fs::create_dir_all(&path).unwrap();
    path
}

/// A scene of the real oak on a plain, and what it bakes to.
fn oaks(density: f64, more: &str) -> (Scene, Vec<Baked>) {
    let text = format!(
        "name = \"oaks\"\nseed = 3\n[terrain]\nextent = 4000.0\nalbedo = [0.13, 0.11, 0.08]\n\
         [[species]]\nname = \"oak\"\nmodel = \"{}/tests/data/oak.glb\"\nscale = [0.8, 1.2]\ndensity = {density:?}\n\
         [sun]\nazimuth = 180.0\nelevation = 45.0\nirradiance = [1.0, 0.95, 0.85]\n\
         [sky]\nradiance = [0.06, 0.09, 0.14]\n\
         [[camera]]\nname = \"c\"\nposition = [2000.0, 2000.0, 100.0]\ntarget = [2000.0, 2500.0, 0.0]\nvertical_fov = 45.0\n\
         [quality]\npreset = \"balanced\"\n{more}",
        env!("CARGO_MANIFEST_DIR")
    );
    let scene = scene::parse(&text, std::path::Path::new("oaks.toml")).unwrap();
    let baked = bake(&scene);
    (scene, baked)
}

fn bake(scene: &Scene) -> Vec<Baked> {
    let cache = device::folder().join("bakes");
    load_or_bake_scene(scene, Needs::ALL, Some(&cache), false).unwrap().into_iter().map(|(b, _)| b).collect()
}
