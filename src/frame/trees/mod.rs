//! Trees in a frame, one file a rung of the ladder, and the tile rasteriser.

pub mod cards;
pub mod meshes;
pub mod shader_map;
pub mod shells;
pub mod tiles;
pub mod zfield;
