//! Trees in a frame, one file a representation.

pub mod shader_map;
pub mod tiles;
pub mod zfield;
