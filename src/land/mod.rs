//! Where things are, without Vulkan: quads of ground, the trees on them, how dense they stand, and which of them stand out on
//! silhouettes.

pub mod candidate;
pub mod density;
pub mod listed;
pub mod pattern;
pub mod quadtree;
pub mod silhouette;
