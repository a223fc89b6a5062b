//! How far trees are drawn one by one, and whether any tree can come so near.

use super::{Plan, meshes};
use crate::camera::Eye;
use crate::gpu::interface::MESH_TREES;
use crate::scene::Scene;

impl Plan {
    /// The range of every species and of all, the size of trees, and where they are drawn in another way.
    pub(super) fn ranges(&mut self, scene: &Scene, eye: &Eye, places: &[[f64; 3]], ground: [f64; 2]) {
        let s = &scene.settings;
        self.forest = tree_density(scene) > 0.0;
        self.wind = self.forest && scene.wind.is_some();
        for species in &scene.species {
            let scale = species.largest_scale();
            let reach = species.mesh.positions.iter().map(|p| p[0].hypot(p[1]).max(p[2])).fold(0.0, f32::max);
            // Bushes may reach as far to the sides as up, and farther where they sway.
            let sway = scene.wind.map_or(0.0, |w| w.reach(f64::from(reach), f64::from(reach)));
            self.tallest = self.tallest.max((f64::from(reach) + sway) * scale);
        }
        let mut heights = Vec::new();
        let farthest = self.farthest(scene, std::iter::once(&eye.position).chain(places), ground);
        for species in &scene.species {
            let height = species.mesh.positions.iter().map(|p| p[2]).fold(0.0, f32::max).max(1e-3);
            let range = self.ladder.range(s, f64::from(height) * eye.pixels_at_1m, farthest);
            heights.push(f64::from(height) * eye.pixels_at_1m);
            self.species_range.push(range);
            let mesh = self.ladder.mesh_range(s, f64::from(height) * eye.pixels_at_1m);
            self.mesh_range.push(mesh);
            self.last_mesh_range = self.last_mesh_range.max(mesh * species.largest_scale());
            self.range = self.range.max(range);
        }
        self.last_mesh_range *= self.fit_meshes(scene);
        // Slices are no average: trees before them keep light of their own.
        if self.ladder.averages() {
            self.convergence = f64::from(s.convergence);
        }
        // The box of a tree is no wider than twice its reach. Filtered search is worth its price up to sqrt 2 texels a
        // pixel; and views 10 degrees apart differ by less than a pixel under about eleven pixels: sin 10 degrees of
        // half the size. Light that never converges does not within the range either.
        let widest = 2.0 * self.tallest * eye.pixels_at_1m;
        let near = widest * std::f64::consts::SQRT_2 / f64::from(s.view_resolution);
        let converged = if self.convergence > 0.0 { self.convergence * self.range } else { self.range };
        self.draw_limits = [near, widest / 11.0, converged.max(widest / 11.0)];
        if !self.forest {
            self.range = 0.0;
            self.card_ranges(scene, &heights);
            return;
        }
        // Level ground has no silhouettes. A shader-map at any distance, and trees at any distance, leave them as they are.
        if scene.terrain.heights.is_some() && self.ladder.hands_over() {
            let ratio = self.ladder.least_pixels(s) / f64::from(s.silhouette_min_pixels);
            self.silhouette_ratio = ratio.max(1.0);
        }
        self.card_ranges(scene, &heights);
    }

    /// Shortens the ranges of meshes until the lists hold them all wherever an eye is, where the ladder leaves that to the plan. The factor.
    fn fit_meshes(&mut self, scene: &Scene) -> f64 {
        let mut factor = 1.0;
        if self.ladder.without_meshes().is_none() {
            return factor;
        }
        loop {
            let most = meshes::most_in_range(scene, &self.mesh_range);
            if most <= f64::from(MESH_TREES) {
                break;
            }
            // Of evenly spread trees the number goes with the square. So many in one place that they never fit are no forest, and stay
            // z-fields.
            let step = if factor > 1e-6 { (f64::from(MESH_TREES) / most).sqrt().min(0.9) } else { 0.0 };
            self.mesh_range.iter_mut().for_each(|range| *range *= step);
            factor *= step;
        }
        factor
    }

    /// How far shadows are drawn, if any are needed.
    pub(super) fn shadows(&mut self, scene: &Scene, eye: &Eye) {
        let s = &scene.settings;
        let diagonal = scene.terrain.extent[0].hypot(scene.terrain.extent[1]);
        let seen = diagonal + eye.position[2].abs();
        self.shadow_distance = match f64::from(s.shadow_distance) {
            // The average light includes its shadows, at any distance or farther out.
            0.0 if self.forest && !self.ladder.draws_trees() => {
                self.cascades = 0;
                0.0
            }
            0.0 if self.forest && self.convergence > 0.0 => (self.convergence * self.range).min(seen),
            // What stands for them beyond knows of its shadows.
            0.0 if self.forest && self.ladder.goes_on() => self.range.min(seen),
            0.0 if self.forest => seen,
            0.0 => diagonal,
            chosen => chosen,
        };
    }

    /// The farthest that a tree of the terrain may be from any of these places, m, or from any on the terrain.
    fn farthest<'a>(
        &self,
        scene: &Scene,
        places: impl Iterator<Item = &'a [f64; 3]>,
        ground: [f64; 2],
    ) -> f64 {
        let trees = self.trees_box(scene.terrain.extent, ground);
        places.copied().chain(trees).map(|place| farthest_in(trees, place)).fold(0.0, f64::max)
    }

    /// The box of all trees on ground of this extent between two heights.
    fn trees_box(&self, extent: [f64; 2], [lowest, highest]: [f64; 2]) -> [[f64; 3]; 2] {
        [[0.0, 0.0, lowest], [extent[0], extent[1], highest + self.tallest]]
    }

    /// Distance to which any tree is drawn, m: those on silhouettes go on beyond the range.
    pub fn last_range(&self) -> f64 {
        self.range * self.silhouette_ratio
    }

    /// Whether any tree on ground of this extent between two heights may be near enough to a place to be drawn by itself:
    /// whether the box of their centres reaches into the range, with room for the rounding of single precision.
    pub fn trees_in_range(&self, extent: [f64; 2], ground: [f64; 2], place: [f64; 3]) -> bool {
        self.trees_within_of(self.last_range(), extent, ground, place)
    }

    /// Whether any tree on ground of this extent between two heights may be so near a place that it is its model's mesh.
    pub fn mesh_in_range(&self, extent: [f64; 2], ground: [f64; 2], place: [f64; 3]) -> bool {
        self.trees_within_of(self.last_mesh_range, extent, ground, place)
    }

    /// The same of clouds of cards.
    pub fn card_in_range(&self, extent: [f64; 2], ground: [f64; 2], place: [f64; 3]) -> bool {
        // Where cards are the last rung before all trees together, their range is wider than that of single trees, and these end.
        self.trees_within_of(self.last_card_range.min(self.last_range()), extent, ground, place)
    }

    /// Whether a tree of a range may be within it from a place.
    fn trees_within_of(&self, range: f64, extent: [f64; 2], ground: [f64; 2], place: [f64; 3]) -> bool {
        let [low, high] = self.trees_box(extent, ground);
        let apart: f64 = (0..3).map(|k| (place[k] - place[k].clamp(low[k], high[k])).powi(2)).sum();
        range > 0.0 && apart.sqrt() <= 1.001 * range + 1.0
    }

    /// Whether trees of a ladder that hands over to no average are all drawn, on ground of this extent between two heights, as seen
    /// from a place: whether none of them has begun to fade.
    pub fn trees_within(&self, extent: [f64; 2], ground: [f64; 2], place: [f64; 3]) -> bool {
        let farthest = farthest_in(self.trees_box(extent, ground), place);
        !self.forest || self.ladder.goes_on() || farthest <= self.ladder.opaque_to(self.range)
    }

    /// Distance to which no tree has begun to hand over to what shows all together, m.
    pub fn averages_from(&self) -> f64 {
        let nearest = self.species_range.iter().copied().fold(f64::INFINITY, f64::min);
        if self.ladder.goes_on() { self.ladder.opaque_to(nearest) } else { f64::INFINITY }
    }

    /// Whether any tree of a scene may be near enough to a place to be drawn by itself, on ground between two heights.
    pub(super) fn scene_in_range(&self, scene: &Scene, ground: [f64; 2], place: [f64; 3]) -> bool {
        near_ground(scene, ground, place, |extent, ground| self.trees_in_range(extent, ground, place))
    }

    /// Whether any tree of a scene may be so near a place that it is its model's mesh.
    pub(super) fn scene_has_mesh_at(&self, scene: &Scene, ground: [f64; 2], place: [f64; 3]) -> bool {
        near_ground(scene, ground, place, |extent, ground| self.mesh_in_range(extent, ground, place))
    }

    /// Whether any may be a cloud of cards.
    pub(super) fn scene_has_cards_at(&self, scene: &Scene, ground: [f64; 2], place: [f64; 3]) -> bool {
        near_ground(scene, ground, place, |extent, ground| self.card_in_range(extent, ground, place))
    }
}

/// Whether something is so of the ground nearest to a place, or of all ground: its extent and two heights.
fn near_ground(
    scene: &Scene,
    ground: [f64; 2],
    place: [f64; 3],
    is: impl Fn([f64; 2], [f64; 2]) -> bool,
) -> bool {
    let terrain = &scene.terrain;
    let [x, y] = [0, 1].map(|k| place[k].clamp(0.0, terrain.extent[k]));
    is(terrain.extent, [terrain.height_at(x, y); 2])
        || terrain.heights.is_some() && is(terrain.extent, ground)
}

/// The farthest that a point of a box is from a place, m.
fn farthest_in([low, high]: [[f64; 3]; 2], place: [f64; 3]) -> f64 {
    let axes = [0, 1, 2].map(|k| (place[k] - low[k]).abs().max((place[k] - high[k]).abs()));
    axes[0].hypot(axes[1]).hypot(axes[2])
}

/// Trees per m² of all species together, at most.
pub(super) fn tree_density(scene: &Scene) -> f64 {
    scene.species.iter().map(|s| s.full_density(scene.terrain.extent)).sum()
}

/// The farthest that trees are from an eye, m: as far as the terrain is, seen from here or from anywhere on it.
pub(super) fn farthest_trees(scene: &Scene, eye: &Eye) -> f64 {
    let extent = scene.terrain.extent;
    let farthest = [0, 1].map(|k| eye.position[k].abs().max((eye.position[k] - extent[k]).abs()));
    let farthest = farthest[0].hypot(farthest[1]).hypot(eye.position[2]);
    farthest.max(extent[0].hypot(extent[1]))
}

/// The lowest and the highest ground of a scene, with what bicubic interpolation may add.
pub(super) fn ground_range(scene: &Scene) -> [f64; 2] {
    let Some(heights) = &scene.terrain.heights else { return [0.0; 2] };
    let fold = |start: f32, f: fn(f32, f32) -> f32| f64::from(heights.samples.iter().copied().fold(start, f));
    let [low, high] = [fold(f32::INFINITY, f32::min), fold(f32::NEG_INFINITY, f32::max)];
    // Catmull-Rom weights: at most 9/8 in each direction.
    let room = 0.3 * (high - low);
    [low - room, high + room]
}
