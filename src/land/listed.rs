//! Listed trees: which stand in which quad, and their density (BN12, section 4: "the converse is also possible"), that is how
//! many stand around a place.
//!
//! Trees are counted on a grid of cells that hold sixteen on average, each shared bilinearly between the four cell
//! centres around it. Interpolated bilinearly again, as a density map is, that is a piecewise cubic kernel three to four
//! cells wide: about a hundred trees, so that the density is good to a tenth wherever it is near its mean.

use std::collections::HashMap;

use crate::gpu::interface::ListedTree;
use crate::physics::raster::Raster;
use crate::scene::{Distribution, Scene, TreePosition};

/// Mean number of trees a cell.
const TREES_A_CELL: f64 = 16.0;
/// Most cells along a side.
const MOST_CELLS: f64 = 1024.0;

/// Cells of the grid for so many trees on a terrain of this extent, m.
pub fn grid_size(extent: [f64; 2], trees: usize) -> [u32; 2] {
    let side = (extent[0] * extent[1] * TREES_A_CELL / trees.max(1) as f64).sqrt();
    extent.map(|e| (e / side).ceil().clamp(1.0, MOST_CELLS) as u32)
}

/// Density of listed trees relative to its largest value, and that, trees per m²; 0 for an empty list.
pub fn density(extent: [f64; 2], trees: &[TreePosition]) -> (Raster, f64) {
    let [width, height] = grid_size(extent, trees.len());
    let cell = [extent[0] / f64::from(width), extent[1] / f64::from(height)];
    let mut counts = vec![0.0; (width * height) as usize];
    for tree in trees {
        // Position in cells from the first cell's centre.
        let [x, y] = [tree.x / cell[0] - 0.5, tree.y / cell[1] - 0.5];
        let at = |v: f64, n: u32| v.clamp(0.0, f64::from(n - 1)) as usize;
        for (column, wx) in [(x.floor(), 1.0 - x + x.floor()), (x.floor() + 1.0, x - x.floor())] {
            for (row, wy) in [(y.floor(), 1.0 - y + y.floor()), (y.floor() + 1.0, y - y.floor())] {
                counts[at(row, height) * width as usize + at(column, width)] += wx * wy;
            }
        }
    }
    let most = counts.iter().copied().fold(0.0, f64::max);
    let relative = |count: &f64| if most > 0.0 { (count / most) as f32 } else { 0.0 };
    let samples = counts.iter().map(relative).collect();
    (Raster { width, height, samples }, most / (cell[0] * cell[1]))
}

/// First and number of the listed trees of a quad.
pub type ListedRanges = HashMap<(i32, i32), (u32, u32)>;

/// Listed trees quad by quad, in the order of species and lists, and each quad's first and number.
pub fn bin_listed(scene: &Scene, side: f64) -> (Vec<ListedTree>, ListedRanges) {
    let mut all: Vec<((i32, i32), ListedTree)> = Vec::new();
    for (species, s) in scene.species.iter().enumerate() {
        let Distribution::Positions(list) = &s.distribution else { continue };
        for (index, p) in list.iter().enumerate() {
            // A tree on the far border belongs to the last quad.
            let quad = [0, 1].map(|k| {
                let last = (scene.terrain.extent[k] / side).ceil().max(1.0) - 1.0;
                ([p.x, p.y][k] / side).floor().clamp(0.0, last)
            });
            let tree = ListedTree {
                position: [(p.x - quad[0] * side) as f32, (p.y - quad[1] * side) as f32],
                scale: p.scale.unwrap_or(0.0),
                turn: p.rotation.map_or(-1.0, |r| (r / 360.0).rem_euclid(1.0)),
                species: species as u32,
                index: index as u32,
            };
            all.push(((quad[1] as i32, quad[0] as i32), tree));
        }
    }
    all.sort_by_key(|(quad, _)| *quad);
    let mut ranges: HashMap<(i32, i32), (u32, u32)> = HashMap::new();
    for (k, ((y, x), _)) in all.iter().enumerate() {
        ranges.entry((*x, *y)).or_insert((k as u32, 0)).1 += 1;
    }
    (all.into_iter().map(|(_, t)| t).collect(), ranges)
}

/// Trees of the fullest quad of listed trees.
pub fn fullest_listed(scene: &Scene, side: f64) -> u32 {
    bin_listed(scene, side).1.values().map(|(_, n)| *n).max().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::hash::{hash, unit};

    #[test]
    fn every_tree_is_counted_once_and_where_it_stands() {
        let extent = [400.0, 250.0];
        let random = |k: u32| f64::from(unit(hash(k)));
        // Four in five in the west half.
        let trees: Vec<TreePosition> = (0..5000u32)
            .map(|k| TreePosition {
                x: 200.0 * random(k) + if k % 5 == 0 { 200.0 } else { 0.0 },
                y: 250.0 * random(k + 10_000),
                scale: None,
                rotation: None,
            })
            .collect();
        let (map, most) = density(extent, &trees);
        let cell = 400.0 * 250.0 / f64::from(map.width * map.height);
        let count = |keep: &dyn Fn(u32) -> bool| -> f64 {
            let kept = map.samples.iter().enumerate().filter(|(k, _)| keep(*k as u32 % map.width));
            kept.map(|(_, s)| f64::from(*s) * most * cell).sum()
        };
        assert!((count(&|_| true) - 5000.0).abs() < 0.01);
        // A cell on the border between the halves may lend or borrow: at most one column of the dense side's.
        assert!((count(&|x| x < map.width / 2) - 4000.0).abs() < 2.0 * 4000.0 / f64::from(map.width));
        assert!(
            (1200.0..=5000.0 / 16.0 * 5.0).contains(&(f64::from(map.width) * f64::from(map.height) * 4.0))
        );
        assert_eq!(map.samples.iter().copied().fold(0.0, f32::max), 1.0);
        let (none, most) = density(extent, &[]);
        assert!(most == 0.0 && none.samples == [0.0]);
    }
}
