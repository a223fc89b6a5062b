//! The models in double precision, without Vulkan: the oracle for the shaders of the same names.

pub mod views;
pub mod zfield;
