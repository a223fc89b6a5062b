//! Trees on silhouettes: beyond the hand-over to the shader-map, which has no thickness, those stay that stand out from the
//! ground, before the sky or far ground. [`clearance`] is the CPU's twin of the decision, tree by tree;
//! [`silhouette_quads`] says which quads may have such trees at all.

use std::collections::BTreeSet;
use std::f64::consts::{PI, TAU};

use crate::camera::{Eye, add};
use crate::gpu::interface::{Seed, SeedQuad, View};
use crate::physics::raster::Raster;
use crate::scene::Terrain;

/// Distances from a tree at which its sight line is compared with the ground, each twice the one before.
const STEPS: u32 = 7;
/// First of them before the tree at which the line must have left the canopy.
const CANOPY_STEP: u32 = 4;
/// Most sight lines, and most places along each, that the selection of quads takes.
const MOST_LINES: f64 = 2048.0;

/// 1 / sqrt(x), with operations that every device rounds alike.
fn reciprocal_root(x: f32) -> f32 {
    let mut y = f32::from_bits(0x5f37_59df - (x.to_bits() >> 1));
    let h = 0.5 * x;
    for _ in 0..3 {
        y *= 1.5 - (h * y) * y;
    }
    y
}

/// The four samples around a position in texels inside the raster, and where it is between them.
fn samples(heights: &Raster, low: [u32; 2]) -> [f32; 4] {
    let high = [(low[0] + 1).min(heights.width - 1), (low[1] + 1).min(heights.height - 1)];
    let at = |x: u32, y: u32| heights.samples[y as usize * heights.width as usize + x as usize];
    [at(low[0], low[1]), at(high[0], low[1]), at(low[0], high[1]), at(high[0], high[1])]
}

/// Height of the ground at a position in texels; beyond the border it falls.
fn ground_height(heights: &Raster, position: [f32; 2], cell: f32) -> f32 {
    let last = [(heights.width - 1) as f32, (heights.height - 1) as f32];
    let inside = [0, 1].map(|k| position[k].clamp(0.0, last[k]));
    let low = inside.map(f32::floor);
    let f = [0, 1].map(|k| inside[k] - low[k]);
    let [h00, h10, h01, h11] = samples(heights, low.map(|l| l as u32));
    let south = h00 + f[0] * (h10 - h00);
    let north = h01 + f[0] * (h11 - h01);
    let outside = [0, 1].map(|k| (position[k] - inside[k]).abs());
    (south + f[1] * (north - south)) - (outside[0] + outside[1]) * (4.0 * cell)
}

/// How far sight lines to a tree pass above the ground, m, at most half its height; twin of `silhouette` in
/// `shaders/land/silhouette.glsl`, where it is explained, to the bit. The tree stays where it is above 0.
pub fn clearance(
    view: &View,
    quad: &SeedQuad,
    seed: &Seed,
    centre: [f32; 3],
    height: f32,
    heights: &Raster,
) -> f32 {
    let d2 = (centre[0] * centre[0] + centre[1] * centre[1]) + centre[2] * centre[2];
    let ground = |position: [f32; 2]| {
        let texel = [0, 1]
            .map(|k| quad.texel[k] as f32 + (quad.texel_offset[k] + position[k] * view.cells_per_metre));
        ground_height(heights, texel, view.height_cell) - view.camera_height
    };
    let mut u = view.silhouette_step * reciprocal_root(d2);
    let top = centre[2] + 0.5 * height;
    let mut least = 0.5 * height;
    for k in 0..STEPS {
        if least <= 0.0 {
            break;
        }
        let behind = ground([0, 1].map(|k| seed.position[k] + centre[k] * u));
        least = least.min((top + top * u) - behind);
        let w = u.min(0.5);
        let before = ground([0, 1].map(|k| seed.position[k] - centre[k] * w));
        let end = if k < CANOPY_STEP { centre[2] + height } else { centre[2] - height };
        least = least.min((end - end * w) - before);
        u += u;
    }
    least
}

/// A terrain with relief.
pub struct Ground<'a> {
    /// Its heights.
    pub heights: &'a Raster,
    /// All of it.
    pub terrain: &'a Terrain,
    /// The lowest of it, m.
    pub lowest: f64,
}

impl Ground<'_> {
    /// Height at a place, m; there is none beyond the border.
    fn height(&self, place: [f64; 2]) -> f64 {
        if [0, 1].iter().any(|k| !(0.0..=self.terrain.extent[*k]).contains(&place[*k])) {
            return f64::NEG_INFINITY;
        }
        let last = [self.heights.width - 1, self.heights.height - 1];
        let at = [0, 1].map(|k| (place[k] / self.terrain.cell_size).min(f64::from(last[k])));
        let low = at.map(f64::floor);
        let f = [0, 1].map(|k| at[k] - low[k]);
        let [h00, h10, h01, h11] = samples(self.heights, low.map(|l| l as u32)).map(f64::from);
        let (south, north) = (h00 + f[0] * (h10 - h00), h01 + f[0] * (h11 - h01));
        south + f[1] * (north - south)
    }
}

/// Where trees on silhouettes are looked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Belt {
    /// Distance to which all trees are drawn, m.
    pub from: f64,
    /// Distance to which those on silhouettes are, m.
    pub to: f64,
    /// Side of a seed quad, m.
    pub quad_side: f64,
    /// Height of the tallest tree, m.
    pub tallest: f64,
}

/// Seed quads whose trees may stand on a silhouette in a belt around the eye.
///
/// Vertical sections through the eye, one every few cells of the height map: along each, [`clearance`] is estimated from
/// the heights in the section, to the tree's favour, and what the terrain before it hides is left out. Trees are as tall as
/// the tallest, or half of that.
pub fn silhouette_quads(ground: &Ground, eye: &Eye, belt: &Belt) -> BTreeSet<(i32, i32)> {
    let extent = ground.terrain.extent;
    let farthest = [0, 1].map(|k| eye.position[k].abs().max((eye.position[k] - extent[k]).abs()));
    let seen = farthest[0].hypot(farthest[1]).min(view_distance(eye, ground.lowest));
    let to = belt.to.min(seen);
    let from = belt.from - 2.0 * belt.quad_side;
    let mut found = BTreeSet::new();
    if from >= to {
        return found;
    }
    let spacing = ground.terrain.cell_size.max(belt.quad_side / 8.0).max(to / MOST_LINES);
    let (first, width) = azimuths(eye);
    let lines = (width * to / spacing).ceil().clamp(1.0, MOST_LINES);
    for line in 0..lines as u32 {
        let (sin, cos) = (first + width * (f64::from(line) + 0.5) / lines).sin_cos();
        let place = |d: f64| [eye.position[0] + d * cos, eye.position[1] + d * sin];
        section(
            |d| ground.height(place(d)),
            eye.position[2],
            belt.tallest,
            spacing,
            [from, to],
            |d| {
                let at = place(d);
                for (i, j) in [(-0.5, -0.5), (0.5, -0.5), (-0.5, 0.5), (0.5, 0.5)] {
                    let quad = [at[0] + i * spacing, at[1] + j * spacing]
                        .map(|v| v / belt.quad_side)
                        .map(|v| v.floor());
                    let last = extent.map(|e| (e / belt.quad_side).ceil().max(1.0) - 1.0);
                    if (0..2).all(|k| quad[k] >= 0.0 && quad[k] <= last[k]) {
                        found.insert((quad[0] as i32, quad[1] as i32));
                    }
                }
            },
        );
    }
    found
}

/// Finds where along a vertical section through an eye at height `z` trees may stand on a silhouette.
fn section(
    height: impl Fn(f64) -> f64,
    z: f64,
    tall: f64,
    spacing: f64,
    [from, to]: [f64; 2],
    mut found: impl FnMut(f64),
) {
    let looked = tall * f64::from(1u32 << (STEPS - 1));
    let count = ((to + looked) / spacing).ceil() as usize + 2;
    let distance = |k: usize| (k as f64 + 0.5) * spacing;
    // Heights above the eye.
    let heights: Vec<f64> = (0..count).map(|k| height(distance(k)) - z).collect();
    let around = |k: usize| &heights[k.saturating_sub(1)..(k + 2).min(count)];
    let lowest = |d: f64| {
        let k = ((d / spacing) as usize).min(count - 1);
        around(k).iter().copied().fold(f64::INFINITY, f64::min)
    };
    // The steepest sight line that touches the ground before.
    let mut horizon = f64::NEG_INFINITY;
    for k in 2..count {
        let d = distance(k);
        if d > to {
            break;
        }
        horizon = horizon.max(heights[k - 2] / distance(k - 2));
        if d < from || heights[k] == f64::NEG_INFINITY {
            continue;
        }
        let base = around(k).iter().copied().fold(f64::NEG_INFINITY, f64::max);
        // The rest as for one tree, and a tenth of the height more, so that the quad is there before its first tree.
        let clear = |step: u32| {
            let t = tall * f64::from(1u32 << step);
            let (top, skirt) = (base + 1.1 * tall, base - 0.15 * tall);
            let before = (d - t).max(0.5 * d);
            top * (d + t) > lowest(d + t) * d && (step < CANOPY_STEP || skirt * before > lowest(before) * d)
        };
        if base + 1.6 * tall > horizon * d && (0..STEPS).all(clear) {
            found(d);
        }
    }
}

/// The four edges of what the eye sees, as directions.
fn corners(eye: &Eye) -> [[f64; 3]; 4] {
    let [tx, ty] = eye.reach();
    [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)]
        .map(|(i, j)| add(add(eye.forward, eye.right, i * tx), eye.up, j * ty))
}

/// Horizontal distance beyond which an eye that looks down sees nothing as high as `lowest`. No sight line descends less
/// than all corners of the image do, because z + m·|(x, y)| is convex.
fn view_distance(eye: &Eye, lowest: f64) -> f64 {
    let slope = corners(eye).map(|[x, y, z]| z / x.hypot(y)).into_iter().fold(f64::NEG_INFINITY, f64::max);
    if slope < 0.0 { (eye.position[2] - lowest).max(0.0) / -slope } else { f64::INFINITY }
}

/// First azimuth and width of what the eye sees, radians from east to north.
fn azimuths(eye: &Eye) -> (f64, f64) {
    let [tx, ty] = eye.reach();
    // Straight up or down in view: every azimuth is.
    let (f, r, u) = (eye.forward[2], eye.right[2], eye.up[2]);
    if r.abs() <= tx * f.abs() && u.abs() <= ty * f.abs() {
        return (0.0, TAU);
    }
    let middle = eye.forward[1].atan2(eye.forward[0]);
    let (mut low, mut high) = (0.0f64, 0.0f64);
    for corner in corners(eye) {
        let turn = (corner[1].atan2(corner[0]) - middle + PI).rem_euclid(TAU) - PI;
        (low, high) = (low.min(turn), high.max(turn));
    }
    (middle + low, high - low)
}
