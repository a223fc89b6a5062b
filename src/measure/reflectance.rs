//! Radiance of a forest patch against view angle, sun angle and distance (BN12, figures 7 and 8).
//!
//! A patch is a level or inclined plane with the scene's species at the scene's mean densities. It is looked at with parallel
//! rays, as far as a lens allows: from 24 patch sides away. Everything in the renderer that depends
//! on distance depends on the size of a pixel on the tree, and the texels of the shadow map; so the distance `s` is set
//! by the pixel, s / `pixels_at_1m`, and by the texels that the scene camera's cascades have there. All distances see the
//! same trees through the same rays, so that their ratio is much better known than either.
//!
//! The Monte-Carlo reference looks at the same patches along the same rays ([`measure_reference`]). To it a pixel is what is
//! in it, so its radiance does not depend on the distance.

use std::sync::Arc;

use crate::bake::Baked;
use crate::camera::{Cascade, Eye, cascades};
use crate::frame::Renderer;
use crate::gpu::Gpu;
use crate::physics::raster::Raster;
use crate::plan::{Drawing, Plan};
use crate::reference::{Options, World};
use crate::scene::{Camera, Distribution, Scene, Terrain};
use crate::{Error, Result};

/// Distance of the camera from a patch, in sides of the patch: rays diverge by 1.2 degrees.
const CAMERA_DISTANCES: f64 = 24.0;
/// Side of the plane that patches lie on, m.
const PLANE: f64 = 2400.0;
/// Samples of the plane's height map along a side.
const PLANE_SAMPLES: u32 = 25;
/// Largest side of the patch's shadow map, texels.
const LARGEST_SHADOW_MAP: f64 = 4096.0;

/// What to measure.
#[derive(Clone, Debug)]
pub struct Request {
    /// Sun zenith angle, degrees.
    pub sun_zenith: f64,
    /// Inclination of the patch, degrees; it descends towards the sun where positive, away from it where negative.
    pub slope: f64,
    /// Distance, m.
    pub distance: f64,
    /// How trees are drawn.
    pub drawing: Drawing,
    /// Directions of the viewer: zenith angle, negative away from the sun, and azimuth relative to the sun, degrees.
    pub views: Vec<[f64; 2]>,
}

/// How to measure.
#[derive(Clone, Copy, Debug)]
pub struct Method {
    /// Number of patches.
    pub patches: u32,
    /// Side of a patch, m.
    pub side: f64,
    /// Pixels along a side of the image of a patch.
    pub pixels: u32,
}

impl Default for Method {
    fn default() -> Self {
        Method { patches: 4, side: 150.0, pixels: 192 }
    }
}

/// Mean over the patches, and its standard error.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Measured {
    /// View zenith angle and relative azimuth, degrees.
    pub view: [f64; 2],
    /// Fractions k of lit and shadowed ground, lit and shadowed trees.
    pub fractions: [f64; 4],
    /// Radiance from the sun, RGB, in the scene's units.
    pub sun: [f64; 3],
    /// Radiance from the sky, RGB.
    pub sky: [f64; 3],
    /// Standard error of the radiance, RGB: what patches differ by; of a single patch, `noise`.
    pub stderr: [f64; 3],
    /// The part of it that comes from random samples and not from the choice of the patches, RGB; zero for the renderer.
    pub noise: [f64; 3],
}

impl Measured {
    /// Radiance, RGB.
    pub fn radiance(&self) -> [f64; 3] {
        std::array::from_fn(|k| self.sun[k] + self.sky[k])
    }
}

/// Trees per m² of every species, over the whole terrain on average.
pub fn mean_densities(scene: &Scene) -> Vec<f64> {
    let [width, height] = scene.terrain.extent;
    scene
        .species
        .iter()
        .map(|s| match &s.distribution {
            Distribution::Positions(list) => list.len() as f64 / (width * height),
            Distribution::Density { .. } => {
                let n = 64;
                let at = |k: usize, e: f64| e * (k as f64 + 0.5) / f64::from(n);
                let sum: f64 = (0..(n * n) as usize)
                    .map(|k| {
                        let (x, y) = (at(k % n as usize, width), at(k / n as usize, height));
                        crate::land::density::local(&s.distribution, &scene.terrain, x, y)
                    })
                    .sum();
                sum / f64::from(n * n)
            }
        })
        .collect()
}

/// The scene of a patch: the species at these densities, on a plane.
///
/// # Errors
/// [`Error::Usage`] when there is no tree at all.
pub fn patch_scene(scene: &Scene, densities: &[f64], sun_zenith: f64, slope: f64) -> Result<Scene> {
    if densities.iter().sum::<f64>() <= 0.0 {
        return Err(Error::Usage("the scene has no trees to measure".into()));
    }
    let mut patch = scene.clone();
    patch.sun.azimuth = 180.0;
    patch.sun.elevation = 90.0 - sun_zenith;
    let cell_size = PLANE / f64::from(PLANE_SAMPLES - 1);
    // The sun stands in the south: ground that descends towards it rises to the north.
    let heights = (slope != 0.0).then(|| Raster {
        width: PLANE_SAMPLES,
        height: PLANE_SAMPLES,
        samples: (0..PLANE_SAMPLES * PLANE_SAMPLES)
            .map(|k| (f64::from(k / PLANE_SAMPLES) * cell_size * slope.to_radians().tan()) as f32)
            .collect(),
    });
    patch.terrain = Terrain {
        origin: [0.0; 2],
        extent: [PLANE; 2],
        cell_size,
        heights,
        albedo: crate::scene::Albedo::Uniform(mean_albedo(&scene.terrain.albedo)),
    };
    for (species, density) in patch.species.iter_mut().zip(densities) {
        let most = match &species.distribution {
            Distribution::Density { max_density, .. } => max_density.max(*density as f32),
            Distribution::Positions(_) => *density as f32,
        };
        let relative = if most > 0.0 { (*density / f64::from(most)) as f32 } else { 0.0 };
        species.distribution = Distribution::Density {
            // Thinned from the pattern as in the scene.
            map: Some(Arc::new(Raster { width: 1, height: 1, samples: vec![relative] })),
            max_density: most,
            between_heights: None,
            below_slope: None,
        };
    }
    Ok(patch)
}

fn mean_albedo(albedo: &crate::scene::Albedo) -> [f32; 3] {
    match albedo {
        crate::scene::Albedo::Uniform(c) => *c,
        crate::scene::Albedo::Image(t) => {
            let linear = |v: u8| crate::physics::tonemap::linear(f64::from(v) / 255.0);
            let n = (t.rgba.len() / 4) as f64;
            std::array::from_fn(|k| (t.rgba.chunks_exact(4).map(|p| linear(p[k])).sum::<f64>() / n) as f32)
        }
    }
}

/// Measures one sun, slope, distance and ladder for all views; `progress` is called after every image.
///
/// # Errors
/// [`Error::Usage`] for angles that see no ground; [`Error::Device`] if the device fails.
#[allow(clippy::too_many_arguments)]
pub fn measure(
    gpu: &Gpu,
    scene: &Scene,
    densities: &[f64],
    baked: &[Baked],
    (camera, size): (&Camera, [u32; 2]),
    method: &Method,
    request: &Request,
    progress: &mut dyn FnMut(),
) -> Result<Vec<Measured>> {
    let mut patch = patch_scene(scene, densities, request.sun_zenith, request.slope)?;
    let optics = Eye::new(camera, &scene.terrain, size);
    let away = CAMERA_DISTANCES * method.side;
    // A pixel on the tree is as large as from the distance.
    let pixels_at_1m = optics.pixels_at_1m * away / request.distance;
    let scene_plan = Plan::new(scene, camera, size, false, Some(gpu.info()))?;
    let finest = shadow_texel(&patch, &scene_plan, &optics, request.distance);
    // Of one view: what the image shows, along the ground, and the trees around whose shadows fall into it.
    let span = |view: &[f64; 2]| 2.0 * (shown(*view, request.slope, method.side) + 2.0 * scene_plan.tallest);
    let widest = request.views.iter().map(span).fold(0.0, f64::max);
    let texels = (f64::from(cascades::map_for(widest / finest))).clamp(64.0, LARGEST_SHADOW_MAP);
    patch.settings.cascades = 1;
    patch.settings.cascade_size = texels as u32;
    let texel =
        |view: &[f64; 2]| finest.max(span(view) / f64::from(cascades::held(patch.settings.cascade_size)));
    let texels: Vec<f64> = request.views.iter().map(texel).collect();
    let patch = Arc::new(patch);
    let centres = centres(method.patches, request.slope);
    let eye =
        |view: [f64; 2], centre: [f64; 2]| eye(&patch.terrain, view, centre, away, method, pixels_at_1m);
    let places: Vec<[f64; 3]> =
        request.views.iter().flat_map(|v| centres.iter().map(|c| eye(*v, *c).position)).collect();
    let first = eye([0.0, 0.0], centres[0]);
    let plan = Plan::for_path(&patch, &first, &places, true, request.drawing, Some(gpu.info()))?;
    let mut renderer = Renderer::new(gpu, patch.clone(), plan, baked)?;
    let mut results = Vec::new();
    for (view, texel) in request.views.iter().zip(texels) {
        let mut samples = Vec::new();
        for centre in &centres {
            let eye = eye(*view, *centre);
            let shadows = if renderer.plan().cascades > 0 {
                vec![cascade(&patch, &eye, away, texel)]
            } else {
                Vec::new()
            };
            renderer.draw(&eye, &shadows, 1.0)?;
            samples.push(mean(&renderer)?);
            progress();
        }
        results.push(average(*view, &samples, [0.0; 3]));
    }
    Ok(results)
}

/// Measures one sun and slope for all views with the Monte-Carlo reference, each image until `options` says; `progress` is
/// called after every image, with the number of its rays.
///
/// # Errors
/// [`Error::Usage`] for angles that see no ground, and for more trees than a [`World`] holds.
pub fn measure_reference(
    scene: &Scene,
    densities: &[f64],
    method: &Method,
    [sun_zenith, slope]: [f64; 2],
    views: &[[f64; 2]],
    options: &Options,
    progress: &mut dyn FnMut(u64),
) -> Result<Vec<Measured>> {
    let patch = patch_scene(scene, densities, sun_zenith, slope)?;
    let away = CAMERA_DISTANCES * method.side;
    let centres = centres(method.patches, slope);
    let eyes: Vec<Eye> = views
        .iter()
        .flat_map(|view| centres.iter().map(|c| eye(&patch.terrain, *view, *c, away, method, 1.0)))
        .collect();
    let world = World::new(&patch, &eyes)?;
    let mut results = Vec::new();
    for (view, eyes) in views.iter().zip(eyes.chunks_exact(centres.len())) {
        let (mut samples, mut variance) = (Vec::new(), [0.0; 3]);
        for (k, eye) in eyes.iter().enumerate() {
            // Patches have random numbers of their own, or their errors would not average out.
            let options = Options { seed: options.seed.wrapping_add(k as u32), ..*options };
            let mut rays = 0;
            let m = world.render(eye, &options, None, &mut |p| rays = p.rays)?.mean();
            let all: Vec<f64> = [&m.fractions[..], &m.sun, &m.sky].concat();
            samples.push(std::array::from_fn(|i| all[i]));
            variance = std::array::from_fn(|c| variance[c] + m.stderr[c].powi(2));
            progress(rays);
        }
        results.push(average(*view, &samples, variance.map(|v| v.sqrt() / samples.len() as f64)));
    }
    Ok(results)
}

/// Where the patches are: on a grid in the middle of the plane, in steps of more than a shadow's length.
fn centres(count: u32, slope: f64) -> Vec<[f64; 2]> {
    let across = (f64::from(count).sqrt().ceil() as u32).max(1);
    // On slopes the edges of the height map bend the plane within a cell.
    let room = PLANE - if slope == 0.0 { 1000.0 } else { 1200.0 };
    let at = |k: u32| 0.5 * PLANE + room * ((f64::from(k) + 0.5) / f64::from(across) - 0.5);
    (0..count).map(|k| [at(k % across), at(k / across)]).collect()
}

/// The direction of a viewer, away from the ground: the sun is in the south, positive zenith angles are on its side.
fn direction([zenith, azimuth]: [f64; 2]) -> [f64; 3] {
    let (t, a) = (zenith.to_radians(), azimuth.to_radians());
    [t.sin() * a.sin(), -t.sin() * a.cos(), t.cos()]
}

/// Cosine of the angle from a view to a direction towards the sun's side at a zenith angle, degrees: the sun, or a slope's normal.
pub(super) fn cosine(view: [f64; 2], zenith: f64) -> f64 {
    let (v, z) = (direction(view), zenith.to_radians());
    v[2] * z.cos() - v[1] * z.sin()
}

/// Whether a slope shows its face to a view direction, by five degrees at least.
pub fn sees(view: [f64; 2], slope: f64) -> bool {
    cosine(view, slope) > 5f64.to_radians().sin()
}

/// How far from its centre the image of a patch shows the ground, m: half its side over the cosine to the ground's normal.
fn shown(view: [f64; 2], slope: f64, side: f64) -> f64 {
    side * (0.5 / cosine(view, slope).max(0.1) + 0.1)
}

/// The viewer of a patch.
fn eye(terrain: &Terrain, view: [f64; 2], centre: [f64; 2], away: f64, m: &Method, pixels_at_1m: f64) -> Eye {
    let v = direction(view);
    let ground = terrain.height_at(centre[0], centre[1]);
    let target = [centre[0], centre[1], ground];
    let position = std::array::from_fn(|k| target[k] + away * v[k]);
    let fov = 2.0 * (0.5 * m.side / away).atan().to_degrees();
    let eye = Eye::looking(position, v.map(|c| -c), fov, [m.pixels; 2]);
    Eye { pixels_at_1m, ..eye }
}

/// Metres a texel of the shadow map at a distance from the scene's camera.
fn shadow_texel(scene: &Scene, plan: &Plan, eye: &Eye, distance: f64) -> f64 {
    use crate::frame::shadows::Shadows;
    let cascades =
        Shadows::cascades(scene, plan, eye, crate::camera::sun_direction(&scene.sun), eye.position[2]);
    cascades.iter().find(|c| distance <= c.far).or(cascades.last()).map_or(1.0, |c| c.grid.texel)
}

/// One cascade around the patch.
fn cascade(scene: &Scene, eye: &Eye, away: f64, texel: f64) -> Cascade {
    let target = std::array::from_fn(|k| away * eye.forward[k]);
    let sun = crate::camera::sun_direction(&scene.sun);
    Cascade::around(sun, eye, target, texel, scene.settings.cascade_size, 2.0 * away)
}

/// Mean of an image: fractions, sun and sky part.
fn mean(renderer: &Renderer) -> Result<[f64; 10]> {
    let picture = renderer.picture()?;
    let linear = picture.linear.ok_or_else(|| Error::Usage("a patch is drawn with layers".into()))?;
    let mut sum = [0.0; 10];
    for k in 0..linear.sun.len() {
        let all = linear.fractions[k].iter().chain(&linear.sun[k]).chain(&linear.sky[k]);
        sum.iter_mut().zip(all).for_each(|(s, v)| *s += f64::from(*v));
    }
    Ok(sum.map(|s| s / linear.sun.len() as f64))
}

fn average(view: [f64; 2], samples: &[[f64; 10]], noise: [f64; 3]) -> Measured {
    let n = samples.len() as f64;
    let mean: [f64; 10] = std::array::from_fn(|k| samples.iter().map(|s| s[k]).sum::<f64>() / n);
    let stderr = std::array::from_fn(|c| {
        let radiance = |s: &[f64; 10]| s[4 + c] + s[7 + c];
        let square: f64 = samples.iter().map(|s| (radiance(s) - radiance(&mean)).powi(2)).sum();
        if n > 1.0 { (square / (n * (n - 1.0))).sqrt() } else { noise[c] }
    });
    Measured {
        view,
        fractions: [mean[0], mean[1], mean[2], mean[3]],
        sun: [mean[4], mean[5], mean[6]],
        sky: [mean[7], mean[8], mean[9]],
        stderr,
        noise,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Along a slope that falls away from the sun by 30° a viewer 50° from the zenith on the sun's side looks at 80° to its normal.
    #[test]
    fn a_patch_shows_more_of_a_slope_that_is_seen_along() {
        let along = |angle: f64| 150.0 * (0.5 / angle.to_radians().cos() + 0.1);
        for (view, slope, angle) in [
            (0.0, 0.0, 0.0),
            (60.0, 0.0, 60.0),
            (50.0, -30.0, 80.0),
            (-60.0, -30.0, 30.0),
            (20.0, 30.0, 10.0),
        ] {
            let got = shown([view, 0.0], slope, 150.0);
            assert!((got - along(angle)).abs() < 1e-9, "{view} {slope}: {got}");
        }
        // Never without end.
        assert_eq!(shown([70.0, 0.0], -30.0, 150.0), 150.0 * 5.1);
    }
}
