//! Height and density maps: PNG and TIFF.
#![no_main]

mod common;

use canopy::physics::raster::Raster;
use canopy::scene::raster::{load_density, load_heights};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let path = common::file(bytes);
    let whole = |r: &Raster| {
        assert_eq!(r.samples.len(), r.width as usize * r.height as usize);
        assert!(r.samples.iter().all(|v| v.is_finite()));
    };
    if let Some(r) = common::settled(load_density(&path)) {
        whole(&r);
        assert!(r.samples.iter().all(|v| (0.0..=1.0).contains(v)));
    }
    for range in [None, Some([-400.0, 9000.0])] {
        if let Some(r) = common::settled(load_heights(&path, range)) {
            whole(&r);
        }
    }
});
