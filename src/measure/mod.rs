//! What the program measures of itself. Draws through [`crate::frame`]; never touches Vulkan.

pub mod conform;
pub mod reflectance;
