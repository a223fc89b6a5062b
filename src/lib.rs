//! Canopy: forests in real time from a leaf to the horizon.
#![warn(missing_docs)]

pub mod bake;
pub mod error;
pub mod forest;
pub mod frame;
pub mod gpu;
pub mod image;
pub mod physics;
pub mod plan;
pub mod progress;
pub mod scene;
pub mod settings;
pub mod tree;

pub use error::{Error, Result};
