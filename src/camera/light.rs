//! Sun and sky of a moment.

use crate::physics::light::sun_disc_fraction;
use crate::scene::{Scene, Sky, Sun};

/// Sun and sky of a scene, as the shaders take them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// Unit vector towards the sun.
    pub direction: [f64; 3],
    /// Irradiance on a plane facing what of the sun is above the horizon, RGB.
    pub sun: [f64; 3],
    /// Mean radiance of the upper hemisphere, RGB.
    pub sky: [f64; 3],
    /// Radiances are drawn times this, so that half floats hold them for any unit.
    pub scale: f64,
}

impl Light {
    /// The light of a scene.
    pub fn new(scene: &Scene) -> Self {
        let fraction = sun_disc_fraction(scene.sun.elevation);
        let sun = scene.sun.irradiance.map(|e| f64::from(e) * fraction);
        let sky = mean_radiance(&scene.sky);
        let brightest = sun.iter().chain(&sky).copied().fold(0.0, f64::max);
        Light {
            direction: sun_direction(&scene.sun),
            sun,
            sky,
            scale: if brightest > 0.0 { 1.0 / brightest } else { 1.0 },
        }
    }
}

/// Unit vector towards the sun; x east, y north. A setting sun shines from a hair above the horizon.
pub fn sun_direction(sun: &Sun) -> [f64; 3] {
    let (a, e) = (sun.azimuth.to_radians(), sun.elevation.max(0.05).to_radians());
    [a.sin() * e.cos(), a.cos() * e.cos(), e.sin()]
}

/// Mean radiance over the upper hemisphere.
fn mean_radiance(sky: &Sky) -> [f64; 3] {
    match sky {
        Sky::Uniform(c) => c.map(f64::from),
        Sky::LatLong { width, height, pixels } => {
            let (mut sum, mut weight) = ([0.0; 3], 0.0);
            for (k, p) in pixels.chunks_exact(3).enumerate() {
                let zenith = std::f64::consts::PI * ((k / *width as usize) as f64 + 0.5) / f64::from(*height);
                if zenith < std::f64::consts::FRAC_PI_2 {
                    let w = zenith.sin();
                    weight += w;
                    (0..3).for_each(|i| sum[i] += w * f64::from(p[i]));
                }
            }
            sum.map(|s| if weight > 0.0 { s / weight } else { 0.0 })
        }
    }
}
