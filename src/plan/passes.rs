//! Passes and pipelines that a plan lists.

use super::Plan;
use super::items::Items;
use super::tiles::{self, Rasterizer};
use crate::scene::{Scene, Sky};

/// Pipelines of the graphics rasteriser's tree pass, and for which trees.
const TREE_PIPELINES: [(&str, &str); 4] = [
    ("trees magnified", "near trees: texels larger than pixels, filtered estimates"),
    ("trees", "trees of many pixels: unfiltered estimates"),
    ("trees small", "trees of few pixels: no estimates"),
    ("trees converged", "trees whose light is the average"),
];

impl Plan {
    /// Pipelines that depend on more than the scene's having trees.
    pub(super) fn list_pipelines(&self, scene: &Scene, items: &mut Items) {
        let mut pipeline = |name: &str, reason: &str| items.add("pipeline", name, reason, 0);
        let tiles = self.rasterizer == Rasterizer::Tiles;
        if tiles {
            pipeline("ground", "light on the ground, once a pixel that sees it");
        }
        if self.z_fields {
            let pipelines = if tiles { &tiles::TREE_PIPELINES[..] } else { &TREE_PIPELINES };
            pipelines.iter().for_each(|(name, reason)| pipeline(name, reason));
            if self.cascades > 0 {
                let iterations = scene.settings.light_iterations;
                let reason = format!("the sun is up: {iterations} iterations to where its light enters");
                pipeline("light ray of trees", &reason);
            }
        }
    }

    /// Passes, in the order of drawing.
    pub(super) fn list_passes(&self, scene: &Scene, items: &mut Items) {
        let mut pass = |name: &str, reason: &str| items.add("pass", name, reason, 0);
        let trees = self.range > 0.0;
        if scene.terrain.heights.is_some() {
            pass("terrain tiles", "new quads of terrain");
        }
        if self.z_fields {
            pass("seeds", "new quads of trees");
        }
        if trees {
            pass("coverage tiles", "new quads of terrain with trees");
        }
        if self.z_fields {
            for name in ["cull", "prefix sums", "draw commands", "compact"] {
                pass(name, "which trees are seen, in order");
            }
        }
        if self.z_fields && self.cascades > 0 {
            pass("casters", "which trees cast shadows");
        }
        if self.cascades > 0 {
            pass("shadows", "the sun is up");
        }
        if matches!(scene.sky, Sky::LatLong { .. }) {
            pass("sky", "the sky is an image");
        }
        if trees {
            pass("shader-map", "trees beyond range, and average light");
        }
        pass("terrain", "the ground");
        let tiles = self.rasterizer == Rasterizer::Tiles;
        if self.z_fields && tiles {
            tiles::TREE_PASSES.iter().for_each(|(name, reason)| pass(name, reason));
        }
        if tiles {
            pass("ground", "light on the ground, once a pixel that sees it");
        }
        if self.z_fields && tiles {
            pass("tree light", "light on trees, once a pixel and tree that it sees");
        }
        if self.z_fields && !tiles {
            pass("trees", "trees within range");
        }
        pass("tone map", "the picture for display");
    }
}
