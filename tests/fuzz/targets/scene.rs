//! Scene files. Their models, rasters and tables are the seeds of the other targets.
#![no_main]

mod common;

use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    // The built-in trees and terrain take milliseconds each and read nothing.
    if text.contains("builtin") {
        return;
    }
    let path = common::seeds("scene").join("fuzzed.toml");
    if let Some(scene) = common::settled(canopy::scene::parse(text, &path)) {
        assert!(!scene.cameras.is_empty());
        assert!(scene.terrain.extent.iter().all(|e| e.is_finite() && *e > 0.0));
        let numbers = |c: &canopy::scene::Camera| c.position.into_iter().chain(c.target).chain([c.vertical_fov]);
        assert!(scene.cameras.iter().flat_map(numbers).all(f64::is_finite));
        assert!(scene.sun.irradiance.iter().all(|v| v.is_finite() && *v >= 0.0));
    }
});
