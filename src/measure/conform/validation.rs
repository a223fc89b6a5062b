//! Silence of the validation layers, each kind on its own, after a deliberate fault has proved it awake.

use bytemuck::Zeroable;

use super::{Finding, Options, finding, frames, scenes};
use crate::Result;
use crate::gpu::interface::CullParameters;
use crate::gpu::{Fault, Gpu, GpuOptions, Resource, Validation, shaders};

/// A kind of validation, and what its message about the deliberate fault contains.
pub(super) type Watch = (&'static str, Validation, &'static str);

/// Every kind.
pub(super) const ALL: &[Watch] = &[
    ("core", Validation::Core, "VUID-vkCmdCopyBuffer"),
    ("synchronization", Validation::Synchronization, "SYNC-HAZARD-WRITE"),
    ("gpu-assisted", Validation::GpuAssisted, "out of bounds"),
];

/// Scenes that use every pass between them.
const SCENES: [&str; 4] = ["grove", "hills", "overcast", "near"];

/// Provokes a message, then draws without any.
pub(super) fn check(options: &Options, (_, validation, hint): &Watch) -> Result<Finding> {
    let open = || {
        Gpu::new(&GpuOptions {
            device: options.device.clone(),
            validation: *validation,
            ..Default::default()
        })
    };
    let mut problems = Vec::new();
    let gpu = open()?;
    provoke(&gpu, *validation)?;
    let said = gpu.messages();
    if !said.iter().any(|m| m.contains(hint)) {
        problems.push(format!("a deliberate fault went unseen; messages: {said:?}"));
    }
    // The fault's own message is what closing reports.
    drop(gpu);

    // Instrumented shaders take minutes a scene: one.
    let few = *validation == Validation::GpuAssisted;
    let (scenes, targets): (&[&str], &[bool]) =
        if few { (&SCENES[..1], &[true]) } else { (&SCENES, &[false, true]) };
    let mut frames_drawn = 0;
    for scene in scenes::ALL.iter().filter(|s| scenes.contains(&s.name)) {
        let both = scene.rasterizers().iter();
        for (layers, rasterizer) in targets.iter().flat_map(|l| both.clone().map(|r| (*l, *r))) {
            let gpu = open()?;
            let drawn = frames::draw(&gpu, options, scene, rasterizer, layers);
            let said = gpu.messages();
            // What the layers say comes first: it may be why the drawing failed.
            match (said.is_empty(), drawn) {
                (false, _) => {
                    problems.push(format!("{}, {}: {}", scene.name, rasterizer.name(), said.join("; ")))
                }
                (true, Err(e)) => problems.push(format!("{}, {}: {e}", scene.name, rasterizer.name())),
                (true, Ok(_)) => frames_drawn += 2,
            }
        }
    }
    Ok(finding(&problems, format!("{frames_drawn} frames without a message")))
}

fn provoke(gpu: &Gpu, validation: Validation) -> Result<()> {
    match validation {
        Validation::GpuAssisted => {
            // Totals of one list where there are many: what is read beyond is only written to commands that nothing uses.
            let program = gpu.compute(&shaders::FOREST_COMMANDS_COMP, &[])?;
            let totals = gpu.buffer_with("one total", &[0u32])?;
            let commands = gpu.buffer("commands", 4096)?;
            let starts = gpu.buffer("starts", 4096)?;
            let mut recorder = gpu.record()?;
            recorder.compute("fault", |pass| {
                let bound = [("totals", &totals), ("commands", &commands), ("starts", &starts)];
                pass.bind(&program, &bound.map(|(name, b)| (name, Resource::Buffer(b))));
                pass.push(&CullParameters::zeroed());
                pass.dispatch([1, 1, 1]);
            });
            recorder.submit().map(drop)
        }
        _ => {
            let fault = match validation {
                Validation::Synchronization => Fault::WriteAfterWrite,
                _ => Fault::CopyBeyondTheEnd,
            };
            let buffer = gpu.buffer("victim", 64)?;
            gpu.record()?.fault_for_test(fault, &buffer);
            Ok(())
        }
    }
}
