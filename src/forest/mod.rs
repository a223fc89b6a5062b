//! GPU data that lives between frames: terrain tiles, tree seeds, coverage tiles, species, and the lists of trees that a frame
//! draws.

pub mod cache;
pub mod cards;
pub mod casters;
pub mod coverage;
pub mod cull;
pub mod forest_sky;
pub mod hidden_sky;
pub mod indirect;
pub mod meshes;
pub mod pages;
pub mod seeds;
pub mod shells;
pub mod species;
pub mod tables;
pub mod terrain;
