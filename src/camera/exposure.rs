//! How bright the picture is.

use super::Light;
use crate::physics::light::luminance;
use crate::scene::Scene;

/// The exposure at which a level forest floor of 6 % reflectance, under this sun and sky, is drawn at a seventh of the
/// display's linear range: forests are dark, and snow would be white.
pub fn auto_exposure(scene: &Scene) -> f64 {
    let light = Light::new(scene);
    let up = light.direction[2].max(0.2);
    let radiance = 0.06 / std::f64::consts::PI * (luminance(light.sun) * up) + 0.06 * luminance(light.sky);
    if radiance > 0.0 { 0.15 / radiance } else { 1.0 }
}
