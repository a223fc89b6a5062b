//! The view buffer: everything of a frame that does not depend on the object drawn.

use super::accumulation::{dither_turn, shift};
use super::shadows::Shadows;
use crate::camera::{Cascade, Eye, Light};
use crate::forest::cull::bin_end;
use crate::forest::seeds::SeedData;
use crate::gpu::interface::{DISTANCE_BINS, HANDOVER_FROM, View};
use crate::physics::wind::Motion;
use crate::plan::Plan;
use crate::scene::Scene;

fn matrix(m: [[f64; 4]; 4]) -> [[f32; 4]; 4] {
    m.map(|c| c.map(|v| v as f32))
}

/// The view of frame `k` of those whose mean a picture is.
pub fn frame_view(view: View, eye: &Eye, plan: &Plan, k: u32) -> View {
    let frames = plan.accumulation;
    let eye = Eye { shift: shift(k, frames, plan.samples), ..*eye };
    View {
        clip_from_world: matrix(eye.clip()),
        shift: eye.clip_shift().map(|v| v as f32),
        dither_turn: dither_turn(k, frames),
        frames_before: k,
        ..view
    }
}

/// Fills the view of a frame.
pub fn view(
    scene: &Scene,
    plan: &Plan,
    eye: &Eye,
    (light, motion): (&Light, Option<Motion>),
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
    (view.wang_camera, view.wang_offset) = split(ground, plan.tile_side);
    view.wang_offset = view.wang_offset.map(|v| (f64::from(v) / plan.tile_side) as f32);
    let scaled = |c: [f64; 3]| c.map(|v| (v * light.scale) as f32);
    view.sun_direction = light.direction.map(|v| v as f32);
    view.cascade_count = cascades.len() as u32;
    view.mesh_cascades = Shadows::mesh_cascades(plan, cascades) as u32;
    view.sun_irradiance = scaled(light.sun);
    view.sky_radiance = scaled(light.sky);
    view.camera_height = eye.position[2] as f32;
    view.pixels_at_1m = eye.pixels_at_1m as f32;
    view.footprint = (eye.raster_at_1m() / eye.pixels_at_1m).log2() as f32;
    view.hotspot_amplitude = s.hotspot_amplitude;
    view.hotspot_width = s.hotspot_width;
    view.ground_contrast = s.ground_contrast;
    // Under slices there are no shadows of single trees, but slices themselves are no average.
    view.convergence = if plan.ladder.shells() { -HANDOVER_FROM } else { plan.convergence as f32 };
    view.silhouette_ratio = plan.silhouette_ratio as f32;
    view.silhouette_step = plan.tallest as f32;
    view.height_cell = scene.terrain.cell_size as f32;
    view.cells_per_metre = (1.0 / scene.terrain.cell_size) as f32;
    if let Some(m) = motion {
        let ([x, y], [a, b, c], [d, e, f]) = (m.toward, m.waves, m.phases_at(ground));
        view.wind = [x, y, m.gust, m.own].map(|v| v as f32);
        view.wind_waves = [a, b, c, m.leaf].map(|v| v as f32);
        view.wind_here = [d, e, f, m.branch].map(|v| v as f32);
        view.wind_clock = m.clock;
    }
    view
}
