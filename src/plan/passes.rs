//! Passes and pipelines that a plan lists.

use super::items::Items;
use super::names::{pass, pipeline};
use super::tiles::{self, Rasterizer};
use super::{Plan, ViewMode};
use crate::scene::{Scene, Sky};

/// Pipelines of the graphics rasteriser's tree pass, and for which trees.
const TREE_PIPELINES: [(&str, &str); 4] = [
    (pipeline::MAGNIFIED, "near trees: texels larger than pixels, filtered estimates"),
    (pipeline::TREES, "trees of many pixels: unfiltered estimates"),
    (pipeline::SMALL, "trees of few pixels: no estimates"),
    (pipeline::CONVERGED, "trees whose light is the average"),
];

/// Why there is a pass of its own for the sky.
const HORIZON: &str = "trees of the shader-map before the sky, where the ground ends";

/// Why there are passes for meshes.
const MESH_LISTS: &str = "which of the trees in view are near enough to be meshes, species by species";
const MESHES: &str = "the triangle of a mesh that each sample sees";
const MESH_LIGHT: &str = "light on leaves and bark, once a pixel and triangle that it sees";

/// Why there are passes for cards.
const CARD_LISTS: &str = "how many of the trees in view are clouds of cards";
const CARDS: &str = "the card that each sample sees";
const CARD_LIGHT: &str = "light on what is painted on cards, once a pixel and card that it sees";

/// Why there are passes for shells.
const SHELLS: &str = "the slice of forest that each sample sees beyond single trees";
const SHELL_LIGHT: &str = "light on slices, once a pixel and slice that it sees";

impl Plan {
    /// What the wind adds: no memory, because what a tree's sway takes is in words that its records have to spare.
    pub(super) fn list_wind(&self, scene: &Scene, items: &mut Items) {
        let Some(wind) = scene.wind else { return };
        let mut add = |name: &str, reason: &str| items.step("pipeline", name, reason);
        let shear = 100.0 * wind.shear();
        if self.near_trees {
            let from =
                format!("wind of {} m/s: trees lean by up to {shear:.1} % of their height", wind.speed);
            add(pipeline::SWAY, &from);
        }
        if self.meshes {
            let angle = wind.flutter().to_degrees();
            add(
                pipeline::FLUTTER,
                &format!("and leaves of meshes turn by up to {angle:.0} degrees about their middles"),
            );
        }
        if self.ladder.averages() {
            add(pipeline::GUSTS, "and the shader-map is looked up where gusts have moved crowns from");
        }
        if self.shells {
            add(pipeline::GUSTS_OF_SHELLS, "and slices are looked up where gusts have moved crowns from");
        }
    }

    /// Whether trees of the shader-map are put before the sky where the ground ends: in tiles, and where none are drawn one by one
    /// there because the ground's silhouettes are looked for.
    pub fn horizon(&self) -> bool {
        let shown = self.rasterizer == Rasterizer::Tiles && self.view_mode == ViewMode::Radiance;
        shown && self.forest && self.ladder.averages() && self.silhouette_ratio <= 1.0
    }

    /// Pipelines that depend on more than the scene's having trees.
    pub(super) fn list_pipelines(&self, scene: &Scene, items: &mut Items) {
        let mut add = |name: &str, reason: &str| items.step("pipeline", name, reason);
        let tiles = self.rasterizer == Rasterizer::Tiles;
        if tiles {
            if self.horizon() {
                add(pipeline::HORIZON, HORIZON);
            }
            add(pipeline::GROUND, "light on the ground, once a pixel that sees it");
        }
        if self.meshes {
            add(pipeline::MESH_LISTS, MESH_LISTS);
            add(pipeline::MESHES, MESHES);
            add(pipeline::MESH_LIGHT, MESH_LIGHT);
        }
        if self.cards {
            add(pipeline::CARD_LISTS, CARD_LISTS);
            add(pipeline::CARDS, CARDS);
            add(pipeline::CARD_LIGHT, CARD_LIGHT);
        }
        if self.shells {
            add(pipeline::SHELLS, SHELLS);
            add(pipeline::SHELL_LIGHT, SHELL_LIGHT);
        }
        if self.z_fields {
            let pipelines = if tiles { &tiles::TREE_PIPELINES[..] } else { &TREE_PIPELINES };
            pipelines.iter().for_each(|(name, reason)| add(name, reason));
            if self.sun {
                let iterations = scene.settings.light_iterations;
                let reason = format!("the sun is up: {iterations} iterations to where its light enters");
                add(pipeline::LIGHT_RAY, &reason);
            }
        }
    }

    /// Passes, in the order of drawing.
    pub(super) fn list_passes(&self, scene: &Scene, items: &mut Items) {
        let mut add = |name: &str, reason: &str| items.step("pass", name, reason);
        let trees = self.forest;
        if scene.terrain.heights.is_some() {
            add(pass::TERRAIN_TILES, "new quads of terrain");
        }
        if self.near_trees {
            add(pass::SEEDS, "new quads of trees");
        }
        if trees {
            add(pass::COVERAGE, "new quads of terrain with trees");
        }
        if self.near_trees {
            for name in [pass::CULL, pass::SUMS, pass::COMMANDS, pass::COMPACT] {
                add(name, "which trees are seen, in order");
            }
        }
        if self.near_trees && self.cascades > 0 {
            add(pass::CASTERS, "which trees cast shadows");
        }
        if self.cascades > 0 {
            let still = "the sun is up";
            let blown = "the sun is up, and what casts moves with the wind: at every time all of the maps is drawn anew";
            add(pass::SHADOWS, if self.wind { blown } else { still });
        }
        if matches!(scene.sky, Sky::LatLong { .. }) {
            add(pass::SKY, "the sky is an image");
        }
        if trees {
            let trees = if self.shells {
                "average light on the ground"
            } else {
                "trees beyond range, and average light"
            };
            add(pass::SHADER_MAP, trees);
        }
        add(pass::TERRAIN, "the ground");
        let tiles = self.rasterizer == Rasterizer::Tiles;
        if self.horizon() {
            add(pass::HORIZON, HORIZON);
        }
        if self.meshes {
            add(pass::MESH_LISTS, MESH_LISTS);
            add(pass::MESHES, MESHES);
        }
        if self.cards {
            add(pass::CARD_LISTS, CARD_LISTS);
            add(pass::CARDS, CARDS);
        }
        if self.shells {
            add(pass::SHELLS, SHELLS);
        }
        if self.z_fields && tiles {
            tiles::TREE_PASSES.iter().for_each(|(name, reason)| add(name, reason));
        }
        if tiles {
            add(pass::GROUND, "light on the ground, once a pixel that sees it");
        }
        if self.meshes {
            add(pass::MESH_LIGHT, MESH_LIGHT);
        }
        if self.cards {
            add(pass::CARD_LIGHT, CARD_LIGHT);
        }
        if self.shells {
            add(pass::SHELL_LIGHT, SHELL_LIGHT);
        }
        if self.z_fields && tiles {
            add(pass::TREE_LIGHT, "light on trees, once a pixel and tree that it sees");
        }
        if self.z_fields && !tiles {
            add(pass::TREES, "trees within range");
        }
        if self.accumulation > 1 {
            add(
                pass::ACCUMULATION,
                "a picture is the mean of several frames: all before it, from the sky on, is drawn once for each",
            );
        }
        add(pass::TONE_MAP, "the picture for display");
    }
}
