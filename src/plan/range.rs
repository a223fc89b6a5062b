//! How far trees are drawn one by one, and whether any tree can come so near.

use super::{Plan, Representation};
use crate::camera::Eye;
use crate::physics::raster::Raster;
use crate::scene::{Distribution, Scene};

impl Plan {
    /// The range of every species and of all, the size of trees, and where they are drawn in another way.
    pub(super) fn ranges(&mut self, scene: &Scene, eye: &Eye) {
        let s = &scene.settings;
        for species in &scene.species {
            let height = species.mesh.positions.iter().map(|p| p[2]).fold(0.0, f32::max).max(1e-3);
            let apparent = f64::from(height) * eye.pixels_at_1m / f64::from(s.zfield_min_pixels);
            let range = self.representation.range(apparent);
            self.species_range.push(range);
            let mut scale = f64::from(species.scale[1]);
            if let Distribution::Positions(list) = &species.distribution {
                let largest = list.iter().filter_map(|p| p.scale).fold(0.0, f32::max);
                scale = scale.max(f64::from(largest));
            }
            self.range = self.range.max(range);
            let reach = species.mesh.positions.iter().map(|p| p[0].hypot(p[1]).max(p[2])).fold(0.0, f32::max);
            self.tallest = self.tallest.max(f64::from(reach) * scale);
        }
        // The box of a tree is no wider than twice its reach. Filtered search is worth its price up to sqrt 2 texels a
        // pixel; and views 10 degrees apart differ by less than a pixel under about eleven pixels: sin 10 degrees of
        // half the size.
        let widest = 2.0 * self.tallest * eye.pixels_at_1m;
        let near = widest * std::f64::consts::SQRT_2 / f64::from(s.view_resolution);
        self.draw_limits = [near, widest / 11.0, (f64::from(s.convergence) * self.range).max(widest / 11.0)];
        if tree_density(scene) <= 0.0 {
            self.range = 0.0;
            return;
        }
        // Level ground has no silhouettes. A shader-map at any distance, and trees at any distance, leave them as they are.
        if scene.terrain.heights.is_some() && self.representation == Representation::Auto {
            let ratio = f64::from(s.zfield_min_pixels) / f64::from(s.silhouette_min_pixels);
            self.silhouette_ratio = ratio.max(1.0);
        }
    }

    /// How far shadows are drawn.
    pub(super) fn shadows(&mut self, scene: &Scene, eye: &Eye) {
        let s = &scene.settings;
        let diagonal = scene.terrain.extent[0].hypot(scene.terrain.extent[1]);
        self.shadow_distance = match f64::from(s.shadow_distance) {
            // Farther out the average light includes its shadows.
            0.0 if self.range > 0.0 => {
                (f64::from(s.convergence) * self.range).min(diagonal + eye.position[2].abs())
            }
            0.0 => diagonal,
            chosen => chosen,
        };
    }

    /// Distance to which any tree is drawn, m: those on silhouettes go on beyond the range.
    pub fn last_range(&self) -> f64 {
        self.range * self.silhouette_ratio
    }

    /// Whether any tree on ground of this extent between two heights may be near enough to a place to be drawn by itself:
    /// whether the box of their centres reaches into the range, with room for the rounding of single precision.
    pub fn trees_in_range(&self, extent: [f64; 2], [lowest, highest]: [f64; 2], place: [f64; 3]) -> bool {
        let (low, high) = ([0.0, 0.0, lowest], [extent[0], extent[1], highest + self.tallest]);
        let apart: f64 = (0..3).map(|k| (place[k] - place[k].clamp(low[k], high[k])).powi(2)).sum();
        self.representation != Representation::ShaderMap
            && self.range > 0.0
            && apart.sqrt() <= 1.001 * self.last_range() + 1.0
    }

    /// The same for a scene's whole terrain. Its nearest ground, below most cameras, saves looking at all of it.
    pub(super) fn scene_in_range(&self, scene: &Scene, place: [f64; 3]) -> bool {
        let terrain = &scene.terrain;
        let [x, y] = [0, 1].map(|k| place[k].clamp(0.0, terrain.extent[k]));
        self.trees_in_range(terrain.extent, [terrain.height_at(x, y); 2], place)
            || terrain
                .heights
                .as_ref()
                .is_some_and(|h| self.trees_in_range(terrain.extent, height_range(h), place))
    }
}

/// Trees per m² of all species together, at most.
pub(super) fn tree_density(scene: &Scene) -> f64 {
    let of = |d: &Distribution| match d {
        Distribution::Density { max_density, .. } => f64::from(*max_density),
        Distribution::Positions(list) => {
            list.len() as f64 / (scene.terrain.extent[0] * scene.terrain.extent[1])
        }
    };
    scene.species.iter().map(|s| of(&s.distribution)).sum()
}

/// The farthest that trees are from an eye, m: as far as the terrain is, seen from here or from anywhere on it.
pub(super) fn farthest_trees(scene: &Scene, eye: &Eye) -> f64 {
    let extent = scene.terrain.extent;
    let farthest = [0, 1].map(|k| eye.position[k].abs().max((eye.position[k] - extent[k]).abs()));
    let farthest = farthest[0].hypot(farthest[1]).hypot(eye.position[2]);
    farthest.max(extent[0].hypot(extent[1]))
}

/// The lowest and the highest height of a height map, with what its bicubic interpolation may add.
fn height_range(heights: &Raster) -> [f64; 2] {
    let fold = |start: f32, f: fn(f32, f32) -> f32| f64::from(heights.samples.iter().copied().fold(start, f));
    let [low, high] = [fold(f32::INFINITY, f32::min), fold(f32::NEG_INFINITY, f32::max)];
    // Catmull-Rom weights: at most 9/8 in each direction.
    let room = 0.3 * (high - low);
    [low - room, high + room]
}
