//! What the program measures of itself. Draws through [`crate::frame`]; never touches Vulkan.

pub mod accuracy;
pub mod bench;
pub mod compare;
pub mod conform;
pub mod host;
pub mod leaves;
pub mod metrics;
pub mod pace;
mod page;
pub mod path;
pub mod reflectance;
pub mod report;
pub mod results;
pub mod statistics;
pub mod sweep;
pub mod trace;
