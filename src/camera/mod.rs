//! What varies from frame to frame: where the eye is, the light that falls on the scene, how its shadow is split into cascades, and
//! the exposure of the picture.

mod bounds;
pub mod cascades;
mod exposure;
mod eye;
mod light;

pub use bounds::Bounds;
pub use cascades::Cascade;
pub use exposure::auto_exposure;
pub use eye::{Eye, NEAR_PLANE};
pub(crate) use eye::{add, cross, dot, normalize};
pub use light::{Light, sun_direction};
