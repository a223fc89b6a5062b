//! f64 models of the papers, without Vulkan: the oracle for the shaders of the same name in `shaders/physics/`.

pub mod correction;
pub mod crown;
pub mod forest;
pub mod forest_sky;
pub mod handover;
pub mod harmonics;
pub mod hash;
pub mod indirect;
pub mod leaf;
pub mod levels;
pub mod lift;
pub mod light;
pub mod masks;
pub mod outline;
pub mod raster;
pub mod shadow;
pub mod strata;
pub mod tables;
pub mod terrain;
pub mod tonemap;
pub mod transfer;
pub mod views;
pub mod wind;
pub mod zfield;
