//! What the user describes: a terrain, species, a sun, a sky, cameras. Everything here is validated:
//! whoever holds a [`Scene`] holds finite numbers, existing textures and sane sizes.
//!
//! World axes: x east, y north, z up, metres, relative to the south-west corner of the terrain.

mod file;
pub mod mesh;
pub mod model;
pub mod positions;
pub mod raster;
mod ridge;
pub mod texture;

use std::sync::Arc;

use crate::ladder::Ladder;
use crate::physics::light::sun_disc_fraction;
use crate::physics::raster::Raster;
use crate::physics::terrain::height_and_slope;
use crate::physics::tonemap;
use crate::physics::wind::Wind;
use crate::settings::{Settings, nearest};
use crate::{Error, Result};
pub use file::{default_scene, load, load_at, parse};
pub use mesh::{Material, Mesh, Texture, Transmission};

/// A whole scene, ready to plan and render.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Name, for titles and file names.
    pub name: String,
    /// Seed of everything random.
    pub seed: u32,
    /// The ground.
    pub terrain: Terrain,
    /// The trees.
    pub species: Vec<Species>,
    /// The sun.
    pub sun: Sun,
    /// The sky.
    pub sky: Sky,
    /// The wind; `None` where nothing moves.
    pub wind: Option<Wind>,
    /// Time of the first frame, s: of a scene without wind all times are alike.
    pub time: f64,
    /// At least one camera; the first is the default.
    pub cameras: Vec<Camera>,
    /// Preset and knobs.
    pub settings: Settings,
    /// What stands for a tree, near to far.
    pub ladder: Ladder,
}

impl Scene {
    /// The camera of a name, or without one the first.
    ///
    /// # Errors
    /// [`Error::Usage`] names the nearest camera, and all of them.
    pub fn camera(&self, name: Option<&str>) -> Result<&Camera> {
        let Some(name) = name else {
            return self.cameras.first().ok_or_else(|| Error::Usage("the scene has no camera".into()));
        };
        self.cameras.iter().find(|c| c.name == name).ok_or_else(|| {
            let names: Vec<&str> = self.cameras.iter().map(|c| c.name.as_str()).collect();
            let hint = nearest(name, names.iter().copied())
                .map_or(String::new(), |n| format!("did you mean \"{n}\"? "));
            Error::Usage(format!("no camera \"{name}\"; {hint}the scene has: {}", names.join(", ")))
        })
    }
}

/// The ground.
#[derive(Clone, Debug)]
pub struct Terrain {
    /// Coordinates of the south-west corner in the scene file's system (subtracted from everything on loading), m.
    pub origin: [f64; 2],
    /// Extent east and north, m.
    pub extent: [f64; 2],
    /// Metres between samples of `heights`.
    pub cell_size: f64,
    /// Heights, m; `None` for a level plain at z = 0.
    pub heights: Option<Raster>,
    /// Lambertian reflectance.
    pub albedo: Albedo,
}

impl Terrain {
    /// Height of the ground at a position in metres from the south-west corner; outside, that of the nearest border.
    pub fn height_at(&self, x: f64, y: f64) -> f64 {
        self.heights.as_ref().map_or(0.0, |raster| {
            let limit = |v: f64, n: u32| (v / self.cell_size).clamp(0.0, f64::from(n - 1));
            height_and_slope(raster, limit(x, raster.width), limit(y, raster.height))[0]
        })
    }

    /// Mean reflectance, linear RGB.
    pub fn mean_albedo(&self) -> [f32; 3] {
        match &self.albedo {
            Albedo::Uniform(rgb) => *rgb,
            Albedo::Image(t) => {
                let linear: Vec<f64> = (0..=255).map(|k| tonemap::linear(f64::from(k) / 255.0)).collect();
                let mut sum = [0.0; 3];
                for pixel in t.rgba.chunks_exact(4) {
                    (0..3).for_each(|c| sum[c] += linear[pixel[c] as usize]);
                }
                sum.map(|s| (s / f64::from((t.width * t.height).max(1))) as f32)
            }
        }
    }
}

/// Ground reflectance.
#[derive(Clone, Debug)]
pub enum Albedo {
    /// The same everywhere, linear RGB.
    Uniform([f32; 3]),
    /// An image over the whole terrain, sRGB; row 0 is **north** as in the file.
    Image(Arc<Texture>),
}

/// One species of tree.
#[derive(Clone, Debug)]
pub struct Species {
    /// Name, unique in the scene.
    pub name: String,
    /// The model of an unscaled tree, z up, trunk base at the origin, already scaled to the species' `height`.
    pub mesh: Arc<Mesh>,
    /// Range of the random scale.
    pub scale: [f32; 2],
    /// Where trees stand.
    pub distribution: Distribution,
    /// Optical overrides; `None` is measured from the mesh.
    pub optics: OpticsOverride,
}

impl Species {
    /// The largest scale that a tree of it has.
    pub fn largest_scale(&self) -> f64 {
        let listed = match &self.distribution {
            Distribution::Positions(list) => list.iter().filter_map(|p| p.scale).fold(0.0, f32::max),
            Distribution::Density { .. } => 0.0,
        };
        f64::from(self.scale[1].max(listed))
    }

    /// Trees of it per m² of a terrain of this extent: at most, or where they are listed on average.
    pub fn full_density(&self, extent: [f64; 2]) -> f64 {
        match &self.distribution {
            Distribution::Density { max_density, .. } => f64::from(*max_density),
            Distribution::Positions(list) => list.len() as f64 / (extent[0] * extent[1]),
        }
    }
}

/// Optical properties that the scene states instead of the model.
#[derive(Clone, Debug, Default)]
pub struct OpticsOverride {
    /// Leaf reflectance, RGB.
    pub leaf_reflectance: Option<[f32; 3]>,
    /// Leaf transmittance, RGB.
    pub leaf_transmittance: Option<[f32; 3]>,
    /// Bark reflectance, RGB.
    pub bark_reflectance: Option<[f32; 3]>,
    /// τ of the crown's self-shadow ([`crate::physics::light::self_shadow`]), 1/(m rad).
    pub extinction: Option<f32>,
}

/// Where the trees of a species stand.
#[derive(Clone, Debug)]
pub enum Distribution {
    /// A density, in trees per m² of horizontal ground, thinned from the point pattern.
    Density {
        /// Relative density in [0, 1] over the whole terrain; `None` is 1 everywhere.
        map: Option<Arc<Raster>>,
        /// Density where the map is 1, trees per m².
        max_density: f32,
        /// Smooth limits of height, m.
        between_heights: Option<[f32; 2]>,
        /// Smooth upper limit of slope, degrees.
        below_slope: Option<f32>,
    },
    /// A list of trees.
    Positions(Arc<Vec<TreePosition>>),
}

/// One listed tree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TreePosition {
    /// East, m from the south-west corner.
    pub x: f64,
    /// North, m from the south-west corner.
    pub y: f64,
    /// Scale; `None` draws it from the species' range.
    pub scale: Option<f32>,
    /// Rotation about the vertical, degrees; `None` draws it.
    pub rotation: Option<f32>,
}

/// The sun.
#[derive(Clone, Copy, Debug)]
pub struct Sun {
    /// Degrees clockwise from north.
    pub azimuth: f64,
    /// Degrees above the horizon; may be negative.
    pub elevation: f64,
    /// RGB irradiance on a plane facing the sun.
    pub irradiance: [f32; 3],
}

impl Sun {
    /// Whether any of it is above a level horizon, and gives light.
    pub fn shines(&self) -> bool {
        sun_disc_fraction(self.elevation) > 0.0 && self.irradiance.iter().any(|e| *e > 0.0)
    }
}

/// The sky.
#[derive(Clone, Debug)]
pub enum Sky {
    /// The same radiance everywhere, RGB.
    Uniform([f32; 3]),
    /// A latitude-longitude image, linear RGB: `width * height * 3` floats, row 0 at the zenith, column 0 at north, turning east.
    LatLong {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
        /// Linear RGB radiance.
        pixels: Arc<Vec<f32>>,
    },
}

/// A camera.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// Name, unique in the scene.
    pub name: String,
    /// x, y from the south-west corner, z above the ground there, m.
    pub position: [f64; 3],
    /// What it looks at, in the same coordinates.
    pub target: [f64; 3],
    /// Vertical field of view, degrees.
    pub vertical_fov: f64,
}
