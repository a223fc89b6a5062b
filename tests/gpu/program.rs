//! Pipelines take specialization constants by name: those that their shaders have, and no other.

use crate::device;
use canopy::gpu::{DepthTest, GraphicsDesc, Program, shaders, vk};
use canopy::{Error, Result};

fn refusal(program: Result<Program>) -> String {
    match program {
        Err(Error::Usage(text)) => text,
        Err(other) => panic!("another error: {other}"),
        Ok(_) => panic!("a pipeline was made"),
    }
}

#[test]
fn a_constant_that_no_stage_declares_and_one_that_is_missing_are_refused() {
    let gpu = device::open();
    let resolve = |constants: &[(&str, u32)]| gpu.compute(&shaders::FOREST_COVERAGE_RESOLVE_COMP, constants);
    let all = [("SPECIES_COUNT", 2), ("DENSITY_MAPS", 0), ("COVER_SIDE", 64)];
    drop(resolve(&all).expect("every constant, in any order"));
    let unknown = refusal(resolve(&[&all[..], &[("COVER_SIZE", 64)]].concat()));
    assert!(unknown.contains("coverage_resolve.comp") && unknown.contains("\"COVER_SIZE\""), "{unknown}");
    let missing = refusal(resolve(&all[..2]));
    assert!(missing.contains("coverage_resolve.comp") && missing.contains("\"COVER_SIDE\""), "{missing}");

    // Of two stages each may have its own; here the first has none.
    let draw = |constants: &[(&str, u32)]| {
        gpu.graphics(&GraphicsDesc {
            vert: &shaders::PROBE_MASKS_VERT,
            frag: &shaders::PROBE_MASKS_FRAG,
            colors: &[vk::Format::R16G16B16A16_SFLOAT],
            samples: 1,
            depth: DepthTest::None,
            constants,
        })
    };
    drop(draw(&[("SAMPLES", 1), ("MASK_ROWS", 12)]).expect("every constant of the fragment stage"));
    let unknown = refusal(draw(&[("SAMPLES", 1), ("MASK_ROWS", 12), ("VIEW_RINGS", 9)]));
    assert!(
        unknown.contains("masks.vert, probe/masks.frag") && unknown.contains("\"VIEW_RINGS\""),
        "{unknown}"
    );
    assert!(refusal(draw(&[("SAMPLES", 1)])).contains("\"MASK_ROWS\""));
    gpu.close().unwrap();
}
