//! Silence of the validation layers, each kind on its own, after a deliberate fault has proved it awake.

use super::{Finding, Options, finding, frames, probe, scenes};
use crate::Result;
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
const SCENES: [&str; 3] = ["hills", "grove", "overcast"];

/// GPU-assisted validation of the layers up to 1.3.239 at least does not know pushed descriptors, and calls each uninitialised.
const PUSHED: &str = "UNASSIGNED-Descriptor uninitialized";

/// Provokes a message, then draws without any.
pub(super) fn check(options: &Options, (_, validation, hint): &Watch) -> Result<Finding> {
    let open = || Gpu::new(&GpuOptions { device: options.device.clone(), validation: *validation });
    let mut problems = Vec::new();
    let gpu = open()?;
    provoke(&gpu, *validation)?;
    let said = gpu.messages();
    if !said.iter().any(|m| m.contains(hint)) {
        problems.push(format!("a deliberate fault went unseen; messages: {said:?}"));
    }
    // The fault's own message is what closing reports.
    drop(gpu);

    let mut frames_drawn = 0;
    for scene in scenes::ALL.iter().filter(|s| SCENES.contains(&s.name)) {
        for layers in [false, true] {
            let gpu = open()?;
            let drawn = frames::draw(&gpu, options, scene, layers);
            let said: Vec<String> = gpu.messages().into_iter().filter(|m| !m.contains(PUSHED)).collect();
            // What the layers say comes first: it may be why the drawing failed.
            match (said.is_empty(), drawn) {
                (false, _) => problems.push(format!("{}: {}", scene.name, said.join("; "))),
                (true, Err(e)) => problems.push(format!("{}: {e}", scene.name)),
                (true, Ok(_)) => frames_drawn += 2,
            }
        }
    }
    Ok(finding(&problems, format!("{frames_drawn} frames without a message")))
}

fn provoke(gpu: &Gpu, validation: Validation) -> Result<()> {
    match validation {
        Validation::GpuAssisted => {
            // Asks for one input more than there are.
            let inputs = gpu.buffer_with("one input", &[[0u32; 12]])?;
            let bound = [("inputs", Resource::Buffer(&inputs))];
            probe::dispatch::<probe::Words>(gpu, &shaders::PROBE_PHYSICS_COMP, &[(0, 0)], &bound, 2, &[])
                .map(drop)
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
