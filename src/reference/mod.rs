//! Monte-Carlo reference: path tracing of the species' own triangles on the renderer's own seeds, on the CPU, with the
//! variance of every pixel.
//!
//! # What is computed
//!
//! Radiance that arrives at the eye along −ω from the first surface y, by the rendering equation (Kajiya 1986)
//!
//! L(y, ω) = ∫ f(y, ω, ω′) L(y, −ω′) |cos θ′| dω′,
//!
//! with bi-Lambertian leaves, f = r/π where ω and ω′ are on the same side of the leaf and t/π where they are not
//! (Ross 1981), and Lambertian bark and ground, t = 0. Reflectances are those that the renderer has ([`crate::bake`]), and
//! so is each tree's tint. Leaves are the alpha-tested triangles of the glTF mesh, lit on both sides; normals are those of
//! the triangles, so that no energy is gained or lost. Light comes from
//!
//! - the **sun**: irradiance E on a plane facing the direction l, times [`crate::physics::light::sun_disc_fraction`]. At
//!   every surface of a path a ray goes to it (next-event estimation): f(ω, l) |n·l| E V.
//! - the **sky** above the horizon. A path goes on in a direction of the density |cos θ′|/π on the side that it chooses by
//!   the chance of reflection, r/(r + t) of its weight; what escapes brings the sky's radiance in that direction, so that
//!   no second sampling of the sky is needed while it is uniform. With an image it is noisier where the image has bright
//!   spots. (The renderer lights everything by the mean of the image; the reference by the image itself.) Below the
//!   horizon, where the terrain ends, nothing shines; the background shows the sky in any direction, as in the renderer.
//!
//! Paths end by Russian roulette after three surfaces, without bias. With `bounces` = 1 light meets one surface (sun or
//! sky → surface → eye), which is what the renderer's sun part is; `None` is all orders.
//!
//! The four fractions k of BN12 are those of the first surface along a pixel's paths: ground or tree, and whether a ray
//! from there reaches the sun. A leaf is lit from either side; bark and ground that turn away from the sun are in shadow.
//!
//! # How sure it is
//!
//! Samples of a pixel are independent: positions in the pixel (a box, as the renderer resolves its samples) and all
//! directions come from integer hashes of (seed, pixel, sample). So the variance of a pixel's mean is estimated without
//! bias by Σ(x − x̄)²/(n(n − 1)), pixels are independent of each other, the same samples come out for any number of
//! threads, and an image that is stopped, written ([`Estimate::save`]) and resumed has the bits of one that went through.
//!
//! # Where trees come from
//!
//! From [`crate::land::candidate`], the twin of the shader that makes the renderer's seeds: the same places, species,
//! rotations, scales and tints. At distances where the renderer draws a shader-map the reference still has the trees. Only
//! those are made that the eye may see, or that shade or light what it sees: trees within six heights of the tallest, and
//! those whose shadows reach it.
//!
//! ```no_run
//! # fn main() -> canopy::Result<()> {
//! use canopy::camera::Eye;
//! use canopy::reference::{Options, Until, World};
//!
//! let scene = canopy::scene::load("ridge.toml".as_ref())?;
//! let eye = Eye::new(scene.camera(None)?, &scene.terrain, [320, 240]);
//! let world = World::new(&scene, &[eye])?;
//! let options = Options { until: Until::Error(0.02), ..Options::default() };
//! let estimate = world.render(&eye, &options, None, &mut |p| println!("{:.0} %", 100.0 * p.done))?;
//! estimate.picture(canopy::camera::auto_exposure(&scene)).write_png("truth.png".as_ref())
//! # }
//! ```

mod estimate;
mod file;
mod ground;
mod key;
mod path;
mod render;
mod sampling;
mod trees;
mod world;

use std::time::Duration;

pub use estimate::{Estimate, Mean, Variance};
pub use key::Key;
pub use render::Progress;
pub use trees::MOST_TREES;
pub use world::World;

/// Which light is on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Light {
    /// Sun and sky; their parts are kept apart.
    #[default]
    All,
    /// The sun.
    Sun,
    /// The sky.
    Sky,
}

impl Light {
    /// All, with the names that users write.
    pub const NAMES: [(&'static str, Light); 3] =
        [("all", Light::All), ("sun", Light::Sun), ("sky", Light::Sky)];

    /// The name that users write.
    pub fn name(self) -> &'static str {
        Self::NAMES.iter().find(|(_, l)| *l == self).map_or("", |(n, _)| n)
    }
}

/// When an image is good enough.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Until {
    /// So many samples of every pixel, at least 2.
    Samples(u32),
    /// [`Estimate::relative_error`] at most this.
    Error(f64),
    /// [`Estimate::relative_error_of_mean`] at most this.
    ErrorOfMean(f64),
    /// Wall time of this run.
    Time(Duration),
}

/// What to estimate, and how well.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Which light is on.
    pub light: Light,
    /// Surfaces that light may meet on its way, at least 1; `None`: any number.
    pub bounces: Option<u32>,
    /// Seed of the samples: other seeds give independent estimates.
    pub seed: u32,
    /// When to stop.
    pub until: Until,
}

impl Default for Options {
    /// All light, all orders of scattering, 16 samples.
    fn default() -> Self {
        Options { light: Light::All, bounces: None, seed: 1, until: Until::Samples(16) }
    }
}
