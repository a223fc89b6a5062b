//! What a forest leaves of an even sky, as the zonal spherical harmonics of light that comes through it from above: of a height and of the
//! thickness of all crowns. Where a table of it is looked up is in `shaders/physics/forest_sky.glsl` too.

use std::f64::consts::PI;

use super::harmonics;

/// Elevations of the quadrature.
const STEPS: usize = 64;

/// The coefficients of orders 0 of bands 0, 1 and 2 of a sky of radiance 1 of which trees of a thickness leave exp(−thickness · hides). Of some elevations,
/// `hides` has the sine and how much is hidden, a unit of the thickness, ascending; between them it goes linearly with the sine over the
/// sine, as paths through layers do.
pub fn zonal(hides: &[[f64; 2]], thickness: f64) -> [f64; 3] {
    let mut sums = [0.0; 3];
    for k in 0..STEPS {
        let sine = (k as f64 + 0.5) / STEPS as f64;
        let path = across(hides, sine) / sine;
        // Where nothing is hidden no thickness hides it.
        let open = if path > 0.0 { (-thickness * path).exp() } else { 1.0 };
        let y = harmonics::evaluate([(1.0 - sine * sine).sqrt(), 0.0, sine]);
        for (sum, at) in sums.iter_mut().zip([0, 2, 6]) {
            *sum += open * y[at] * 2.0 * PI / STEPS as f64;
        }
    }
    sums
}

/// What is hidden at an elevation times its sine.
fn across(hides: &[[f64; 2]], sine: f64) -> f64 {
    let flat = |[s, h]: [f64; 2]| s * h;
    let above = hides.iter().position(|[s, _]| *s >= sine);
    match above {
        Some(0) => flat(hides[0]),
        None => hides.last().map_or(0.0, |last| flat(*last)),
        Some(k) => {
            let ([s0, _], [s1, _]) = (hides[k - 1], hides[k]);
            let part = (sine - s0) / (s1 - s0).max(1e-12);
            flat(hides[k - 1]) * (1.0 - part) + flat(hides[k]) * part
        }
    }
}

/// Where a table has a height, over that to which it goes, and a thickness: steps from 0 to `steps` − 1; twin of `sky_place`.
pub fn place(height: f64, thickness: f64, steps: u32) -> [f64; 2] {
    [height.clamp(0.0, 1.0), thickness / (1.0 + thickness)].map(|u| u * f64::from(steps - 1))
}

/// The thickness at a step: infinite at the last.
pub fn thickness_at(step: u32, steps: u32) -> f64 {
    let u = f64::from(step) / f64::from(steps - 1);
    u / (1.0 - u)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_trees_it_is_the_sky_and_under_a_layer_its_exponential_integral() {
        let free = zonal(&[[0.3, 5.0], [1.0, 1.0]], 0.0);
        let sky = harmonics::even_sky();
        // The midpoint rule in the sine: exact for the first two, and 1 / (4 · 64²) of 3 sin² − 1 over its 64 steps.
        for (a, b) in free.iter().zip([sky[0], sky[2], sky[6]]) {
            assert!((a - b).abs() < 2e-4, "{free:?}");
        }
        // A layer hides 1 over the sine: irradiance from above is 2π E₃(x), of which E₃(1) = 0.1096919670.
        let layer = zonal(&[[0.2, 5.0], [0.5, 2.0], [1.0, 1.0]], 1.0);
        let k1 = (3.0 / (4.0 * PI)).sqrt();
        assert!((layer[1] - k1 * 2.0 * PI * 0.109_691_967).abs() < 1e-3 * layer[1], "{layer:?}");
        assert_eq!(zonal(&[[1.0, 1.0]], f64::INFINITY), [0.0; 3]);
    }

    #[test]
    fn steps_of_thickness_are_where_they_are_looked_for() {
        for step in 0..15 {
            let x = thickness_at(step, 16);
            assert!((place(0.5, x, 16)[1] - f64::from(step)).abs() < 1e-12);
        }
        assert_eq!(thickness_at(15, 16), f64::INFINITY);
        assert_eq!(place(2.0, 0.0, 16), [15.0, 0.0]);
    }
}
