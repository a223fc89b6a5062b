//! The ground as it casts: squares of one size a cascade, about as fine as the camera's mesh is where the cascade ends.

use crate::camera::cascades::Cascade;
use crate::forest::casters::DrawnBlock;
use crate::gpu::interface::{GroundCaster, SHADOW_CELLS};
use crate::land::quadtree::{Quadtree, grid_cells};

/// Squares of ground that may cast into blocks, block after block, and the first and number of each.
pub fn squares(
    tree: &Quadtree,
    cascades: &[Cascade],
    blocks: &[DrawnBlock],
    terrain_pixels: f64,
) -> (Vec<GroundCaster>, Vec<(u32, u32)>) {
    let (mut all, mut ranges) = (Vec::new(), Vec::new());
    for b in blocks {
        let cascade = &cascades[b.cascade];
        let spacing = spacing(tree, cascade, terrain_pixels);
        let steps = SHADOW_CELLS * spacing;
        let side = f64::from(steps) * tree.step();
        let casts = |low: [u32; 2], high: [u32; 2]| {
            let corner = |at: [u32; 2]| at.map(|v| f64::from(v) * side);
            let bounds = tree.ground_bounds(corner(low), corner(high));
            b.pages.touches(cascade, &bounds) && cascade.grid.before_the_end(&bounds)
        };
        let first = all.len() as u32;
        for [x, y] in grid_cells(tree.extent().map(|e| (e / side).ceil() as u32), &casts) {
            let corner = |i: u32, j: u32| {
                let [x, y] = [x + i, y + j].map(|v| f64::from(v) * side);
                let [x, y, z] = b.block.within(cascade.grid.place([x, y, f64::from(b.gpu.ground)]));
                [x, y, z, 0.0]
            };
            all.push(GroundCaster {
                corners: [corner(0, 0), corner(1, 0), corner(0, 1), corner(1, 1)],
                corner: [x, y].map(|v| (v * steps) as i32),
                spacing: spacing as i32,
                ..bytemuck::Zeroable::zeroed()
            });
        }
        ranges.push((first, all.len() as u32 - first));
    }
    (all, ranges)
}

/// Steps of the finest grid along a mesh cell: a texel is about as large as a pixel where the cascade ends, and there the camera's
/// cells are half of `terrain_pixels` long, or more.
fn spacing(tree: &Quadtree, cascade: &Cascade, terrain_pixels: f64) -> u32 {
    let wanted = 0.5 * terrain_pixels * cascade.grid.texel / tree.step();
    // No coarser than the root's.
    let levels = (0..tree.levels()).rev().map(|level| tree.spacing(level));
    levels.clone().find(|s| f64::from(*s) >= wanted).unwrap_or(tree.spacing(0))
}
