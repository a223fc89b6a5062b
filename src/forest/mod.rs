//! What lives between frames: the terrain quadtree and its tiles, tree seeds, coverage tiles, and the lists of trees that a
//! frame draws.

pub mod cache;
pub mod candidate;
pub mod casters;
pub mod coverage;
pub mod cull;
pub mod density;
pub mod listed;
pub mod pattern;
pub mod quadtree;
pub mod seeds;
pub mod silhouette;
pub mod species;
pub mod tables;
pub mod terrain;
