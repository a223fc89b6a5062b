//! Tree inventories: CSV.
#![no_main]

mod common;

use canopy::scene::positions::load_positions;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let path = common::file(bytes);
    for (origin, extent) in [([0.0; 2], [1000.0; 2]), ([5e5, 4e6], [1e7; 2])] {
        for t in common::settled(load_positions(&path, origin, extent)).unwrap_or_default() {
            assert!((0.0..=extent[0]).contains(&t.x) && (0.0..=extent[1]).contains(&t.y));
            assert!(t.scale.is_none_or(|s| s.is_finite() && s > 0.0));
            assert!(t.rotation.is_none_or(|r| r.abs() <= 360.0));
        }
    }
});
