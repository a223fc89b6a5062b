//! The view buffer: everything of a frame that does not depend on the object drawn.

use super::camera::Eye;
use super::cascades::Cascade;
use crate::forest::cull::bin_end;
use crate::forest::seeds::SeedData;
use crate::gpu::interface::{DISTANCE_BINS, View};
use crate::physics::light::sun_disc_fraction;
use crate::plan::Plan;
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

fn matrix(m: [[f64; 4]; 4]) -> [[f32; 4]; 4] {
    m.map(|c| c.map(|v| v as f32))
}

/// Fills the view of a frame.
pub fn view(
    scene: &Scene,
    plan: &Plan,
    eye: &Eye,
    light: &Light,
    cascades: &[Cascade],
    seeds: Option<&SeedData>,
    terrain_step: f64,
) -> View {
    let s = &scene.settings;
    let mut view: View = bytemuck::Zeroable::zeroed();
    view.clip_from_world = matrix(eye.clip());
    let planes = eye.planes();
    for (k, p) in view.planes.iter_mut().enumerate() {
        // The sixth plane has nothing outside.
        *p = planes.get(k).map_or([0.0, 0.0, 0.0, 1e30], |p| p.map(|v| v as f32));
    }
    for (c, cascade) in cascades.iter().enumerate() {
        let grid = &cascade.grid;
        view.cascade_from_world[c] = matrix(cascade.matrix(eye));
        // The map repeats.
        let turn = cascade.first.map(|f| f.rem_euclid(i64::from(grid.texels)) as f32);
        view.cascade_turn[c] = [turn[0], turn[1], 0.0, 0.0];
        (view.cascade_x, view.cascade_y) = (grid.axes[0].map(|v| v as f32), grid.axes[1].map(|v| v as f32));
        view.cascade_texel[c] = grid.texel as f32;
        view.cascade_far[c] = cascade.far as f32;
    }
    for k in 0..DISTANCE_BINS as usize {
        let d = bin_end(k as u32, plan.last_range());
        view.bins[k / 4][k % 4] = (d * d) as f32;
    }
    let split = |p: [f64; 2], side: f64| {
        let cell = p.map(|v| (v / side).floor());
        (cell.map(|c| c as i32), [0, 1].map(|k| (p[k] - cell[k] * side) as f32))
    };
    let ground = [eye.position[0], eye.position[1]];
    (view.grid_camera, view.grid_offset) = split(ground, terrain_step);
    if let Some(seeds) = seeds {
        view.quad_offset = seeds.camera_quad(eye).1.map(|v| v as f32);
    }
    let scaled = |c: [f64; 3]| c.map(|v| (v * light.scale) as f32);
    view.sun_direction = light.direction.map(|v| v as f32);
    view.cascade_count = cascades.len() as u32;
    view.sun_irradiance = scaled(light.sun);
    view.sky_radiance = scaled(light.sky);
    view.camera_height = eye.position[2] as f32;
    view.pixels_at_1m = eye.pixels_at_1m as f32;
    view.footprint = (eye.raster_at_1m() / eye.pixels_at_1m).log2() as f32;
    view.hotspot_amplitude = s.hotspot_amplitude;
    view.hotspot_width = s.hotspot_width;
    view.ground_contrast = s.ground_contrast;
    view.convergence = s.convergence;
    view.silhouette_reach = plan.silhouette_reach as f32;
    view.silhouette_step = plan.tallest as f32;
    view.height_cell = scene.terrain.cell_size as f32;
    view.cells_per_metre = (1.0 / scene.terrain.cell_size) as f32;
    view
}
