//! Tests that need a Vulkan device: one program, because each costs a link of the whole crate.

#[path = "../common/device.rs"]
mod device;

mod accumulation;
mod cards;
mod casters;
mod coverage;
mod cull;
mod determinism;
mod extremes;
mod failures;
mod faults;
mod frugal;
mod ground;
mod handover;
mod harmonics;
mod in_flight;
mod indirect;
mod leaf;
mod levels;
mod light;
mod light_on_ground;
mod meshes;
mod paths;
mod plan;
mod program;
mod resize;
mod seeds;
mod shader_map;
mod shadows_kept;
mod shells;
mod silhouettes;
mod soak;
mod tables;
mod tiles;
mod transfer;
mod tree;
mod views;
mod wind;
mod zfield;
