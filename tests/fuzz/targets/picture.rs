//! Textures (PNG, JPEG) and skies (Radiance HDR, OpenEXR).
#![no_main]

mod common;

use std::path::Path;

use canopy::scene::Sky;
use canopy::scene::texture::{decode_texture, load_sky};
use libfuzzer_sys::fuzz_target;

fuzz_target!(init: {
    // The reader catches what decoders of others throw. libFuzzer's hook would end the run before it can; a panic that no
    // one catches still ends it.
    std::panic::set_hook(Box::new(|_| ()));
}, |bytes: &[u8]| {
    if let Some(t) = common::settled(decode_texture(Path::new("fuzzed.png"), "", bytes)) {
        assert_eq!(t.rgba.len(), t.width as usize * t.height as usize * 4);
    }
    if let Some(Sky::LatLong { width, height, pixels }) = common::settled(load_sky(&common::file(bytes))) {
        assert_eq!(pixels.len(), width as usize * height as usize * 3);
        assert!(width == 2 * height && pixels.iter().all(|v| v.is_finite() && *v >= 0.0));
    }
});
