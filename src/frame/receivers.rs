//! Where a view looks into its shadow cascades: the pages that what it sees may be in.

use crate::camera::cascades::Cascade;
use crate::camera::{Bounds, Eye};
use crate::forest::pages::PageSet;
use crate::land::quadtree::Quadtree;

/// A rectangle of ground is cut until it is at most so many pages long.
const PAGES: f64 = 4.0;
/// The camera's mesh is coarser than the ground: a cell of it, the next coarser one that it morphs to, is at most this part of
/// the distance to its quad ([`crate::land::quadtree::MIN_REFINE`], [`crate::gpu::interface::TERRAIN_CELLS`]), with room.
const CELL: f64 = 1.0 / 40.0;

struct Search<'a> {
    tree: &'a Quadtree,
    eye: &'a Eye,
    planes: Vec<[f64; 4]>,
    cascades: &'a [Cascade],
    tall: f64,
    needed: Vec<PageSet>,
}

/// The pages of each cascade that an eye may look into, on ground with trees up to `tall` metres high, and as far to the sides.
/// What is seen is in the frustum; a tree looks into the cascade of its middle, which may be as far from what is seen of it.
pub fn needed(tree: &Quadtree, eye: &Eye, cascades: &[Cascade], tall: f64) -> Vec<PageSet> {
    let needed = vec![PageSet::default(); cascades.len()];
    let mut search = Search { tree, eye, planes: eye.planes(), cascades, tall, needed };
    search.visit([-tall; 2], tree.extent().map(|e| e + tall));
    search.needed
}

impl Search<'_> {
    fn visit(&mut self, low: [f64; 2], high: [f64; 2]) {
        let bounds = self.bounds(low, high);
        let nearest = bounds.distance(self.eye.position);
        if !bounds.touches(&self.planes, self.eye.position) {
            return;
        }
        let from = |c: usize| if c == 0 { 0.0 } else { self.cascades[c - 1].far };
        let farthest = bounds.farthest(self.eye.position);
        // Room for single precision, with which shaders choose.
        let within = |c: &usize| {
            nearest <= 1.0001 * self.cascades[*c].far + self.tall && farthest >= 0.9999 * from(*c) - self.tall
        };
        let reached: Vec<usize> = (0..self.cascades.len()).filter(within).collect();
        let Some(finest) = reached.first() else { return };
        let grid = &self.cascades[*finest].grid;
        // Boxes are as high as trees: parts much narrower than that tell no more.
        let enough = (PAGES * grid.page() as f64 * grid.texel).max(self.tall / 16.0);
        let size = [0, 1].map(|k| high[k] - low[k]);
        if size[0].max(size[1]) <= enough {
            for c in reached {
                self.needed[c].add(&self.cascades[c], &bounds);
            }
            return;
        }
        // The longer side is cut, so that parts are about square.
        let k = usize::from(size[1] > size[0]);
        let middle = low[k] + 0.5 * size[k];
        let (mut first, mut second) = (high, low);
        (first[k], second[k]) = (middle, middle);
        self.visit(low, first);
        self.visit(second, high);
    }

    /// Bounds of what is drawn above a rectangle: ground as the camera's mesh has it, and what of trees reaches there.
    fn bounds(&self, low: [f64; 2], high: [f64; 2]) -> Bounds {
        let flat = Bounds { low: [low[0], low[1], 0.0], high: [high[0], high[1], 0.0] };
        let eye = self.eye.position;
        let cell = (CELL * flat.farthest([eye[0], eye[1], 0.0]).hypot(eye[2])).max(self.tree.step());
        let around = cell.max(self.tall);
        let ground = self.tree.ground_bounds(low.map(|v| v - around), high.map(|v| v + around));
        Bounds { low: [low[0], low[1], ground.low[2]], high: [high[0], high[1], ground.high[2] + self.tall] }
    }
}
