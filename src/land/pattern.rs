//! Poisson-disk patterns on Wang tiles (Cohen et al. 2003): sixteen tiles, one for every colouring of four edges with two
//! colours, which tile the plane aperiodically and keep their minimal distance across every edge and corner.
//!
//! Built from the corner outwards, so that no seam can break the distance r:
//! 1. one patch of points around the corner, the same for all tiles: the square of half side a = 1.75 r;
//! 2. per axis and colour, points of a strip of half width r along the edge, outside the patch, both sides together;
//! 3. per tile, the rest of the interior, against the strips that it shares with its neighbours.
//!
//! Points of strips that meet at a corner are at least √2 (a − r) = 1.06 r apart; points of two interiors are more than
//! 2 r apart. Each step throws darts until no room is left, so that the patterns are maximal but for slivers.

use crate::gpu::interface::PatternPoint;
use crate::physics::hash::Stream;

/// Sixteen tiles of unit side.
#[derive(Clone, Debug)]
pub struct Pattern {
    /// Points of each tile; index south | north << 1 | west << 2 | east << 3 of the edge colours.
    pub tiles: Vec<Vec<[f32; 2]>>,
    /// Minimal distance between points, in tile sides.
    pub distance: f64,
}

/// Tiles of a set.
pub const TILES: usize = 16;
/// Half side of the patch around a corner that all tiles share, in minimal distances.
pub const PATCH: f64 = 1.75;
/// Darts that must miss in a row, a unit of area of r², before a region counts as full.
const PATIENCE: f64 = 400.0;

impl Pattern {
    /// Patterns with about `points` points a tile, by seed.
    pub fn new(points: u32, seed: u32) -> Self {
        // Maximal Poisson-disk patterns hold about 0.70 / r² points per unit area.
        let r = (0.70 / f64::from(points.max(32))).sqrt();
        let a = PATCH * r;
        let mut stream = Stream::new(seed);
        // 1. The corner patch, around the origin.
        let mut corner = Vec::new();
        throw(&mut stream, r, [-a, -a], [a, a], &mut corner, &[], |_| true);
        // 2. Edge strips: along x from a to 1 − a, |y| < r; for the other axis the coordinates swap.
        let mut strips = [[Vec::new(), Vec::new()], [Vec::new(), Vec::new()]];
        for (axis, colours) in strips.iter_mut().enumerate() {
            let patch = corner.iter().map(|p| if axis == 0 { *p } else { [p[1], p[0]] });
            let fixed: Vec<[f64; 2]> = patch.flat_map(|p| [p, [p[0] + 1.0, p[1]]]).collect();
            for strip in colours.iter_mut() {
                throw(&mut stream, r, [a, -r], [1.0 - a, r], strip, &fixed, |_| true);
            }
        }
        // 3. Interiors.
        let tiles = (0..TILES)
            .map(|kind| {
                let colour = |k: usize| kind >> k & 1;
                let mut around = Vec::new();
                for (dx, dy) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
                    around.extend(corner.iter().map(|p| [p[0] + dx, p[1] + dy]));
                }
                around.extend(strips[0][colour(0)].iter().copied());
                around.extend(strips[0][colour(1)].iter().map(|p| [p[0], p[1] + 1.0]));
                around.extend(strips[1][colour(2)].iter().map(|p| [p[1], p[0]]));
                around.extend(strips[1][colour(3)].iter().map(|p| [p[1] + 1.0, p[0]]));
                let mut inner = Vec::new();
                throw(&mut stream, r, [r, r], [1.0 - r, 1.0 - r], &mut inner, &around, |p| {
                    let near = |v: f64| v < a || v > 1.0 - a;
                    !(near(p[0]) && near(p[1]))
                });
                let inside = |p: &&[f64; 2]| p.iter().all(|v| (0.0..1.0).contains(v));
                around.iter().filter(inside).chain(inner.iter()).map(|p| p.map(|v| v as f32)).collect()
            })
            .collect();
        Pattern { tiles, distance: r }
    }

    /// Mean number of points a tile; every tile is as frequent as any other.
    pub fn mean_points(&self) -> f64 {
        self.tiles.iter().map(Vec::len).sum::<usize>() as f64 / TILES as f64
    }

    /// Points of the fullest tile.
    pub fn max_points(&self) -> u32 {
        self.tiles.iter().map(Vec::len).max().unwrap_or(0) as u32
    }

    /// All tiles with as many slots each; unused slots have a negative x.
    pub fn packed(&self) -> Vec<PatternPoint> {
        let slots = self.max_points() as usize;
        let pad = std::iter::repeat_n([-1.0, -1.0], slots);
        self.tiles
            .iter()
            .flat_map(|t| t.iter().copied().chain(pad.clone()).take(slots))
            .map(|position| PatternPoint { position })
            .collect()
    }
}

/// Throws darts into a box until none fits any more; a dart must be `r` away from `points` and `fixed`.
fn throw(
    stream: &mut Stream,
    r: f64,
    low: [f64; 2],
    high: [f64; 2],
    points: &mut Vec<[f64; 2]>,
    fixed: &[[f64; 2]],
    allowed: impl Fn([f64; 2]) -> bool,
) {
    // A grid of cells of side r over the plane near the tile finds neighbours in constant time.
    let side = (4.0 / r).ceil() as usize;
    let cell = |v: f64| (((v + 1.5) / r) as usize).min(side - 1);
    let mut grid: Vec<Vec<[f64; 2]>> = vec![Vec::new(); side * side];
    for p in fixed.iter().chain(points.iter()) {
        grid[cell(p[1]) * side + cell(p[0])].push(*p);
    }
    let area = (high[0] - low[0]) * (high[1] - low[1]);
    let patience = (PATIENCE * area / (r * r)).ceil() as u64;
    let mut misses = 0;
    while misses < patience {
        let p = [0, 1].map(|k| low[k] + (high[k] - low[k]) * stream.unit());
        let (cx, cy) = (cell(p[0]), cell(p[1]));
        let free = allowed(p)
            && (cy.saturating_sub(1)..=(cy + 1).min(side - 1)).all(|y| {
                (cx.saturating_sub(1)..=(cx + 1).min(side - 1)).all(|x| {
                    grid[y * side + x].iter().all(|q| (p[0] - q[0]).powi(2) + (p[1] - q[1]).powi(2) >= r * r)
                })
            });
        if free {
            grid[cy * side + cx].push(p);
            points.push(p);
            misses = 0;
        } else {
            misses += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::hash::hash2;

    /// Points of an aperiodic tiling of n × n tiles.
    fn tiling(p: &Pattern, n: i32, seed: u32) -> Vec<[f64; 2]> {
        let colour = |x: i32, y: i32, axis: u32| (hash2(seed + axis, hash2(x as u32, y as u32)) & 1) as usize;
        let mut all = Vec::new();
        for y in 0..n {
            for x in 0..n {
                let kind = colour(x, y, 1)
                    | colour(x, y + 1, 1) << 1
                    | colour(x, y, 2) << 2
                    | colour(x + 1, y, 2) << 3;
                all.extend(
                    p.tiles[kind]
                        .iter()
                        .map(|q| [f64::from(q[0]) + f64::from(x), f64::from(q[1]) + f64::from(y)]),
                );
            }
        }
        all
    }

    #[test]
    fn no_two_points_of_any_tiling_are_too_near_and_no_hole_is_left() {
        let p = Pattern::new(128, 3);
        let all = tiling(&p, 8, 11);
        let mut nearest = vec![f64::INFINITY; all.len()];
        for i in 0..all.len() {
            for j in 0..i {
                let d = (all[i][0] - all[j][0]).hypot(all[i][1] - all[j][1]);
                nearest[i] = nearest[i].min(d);
                nearest[j] = nearest[j].min(d);
            }
        }
        let min = nearest.iter().copied().fold(f64::INFINITY, f64::min);
        // Positions are stored as f32 in [0, 1): half an ulp each.
        assert!(min >= p.distance - 2e-7, "{min} < {}", p.distance);
        // A maximal pattern leaves no point farther than 2 r from its nearest neighbour (inside the tiling).
        let inside = all.iter().zip(&nearest).filter(|(q, _)| q.iter().all(|v| (0.5..7.5).contains(v)));
        let max = inside.map(|(_, d)| *d).fold(0.0, f64::max);
        assert!(max <= 2.0 * p.distance, "{max}");
    }

    #[test]
    fn density_is_even_across_seams() {
        let p = Pattern::new(256, 5);
        assert!((p.mean_points() - 256.0).abs() < 0.06 * 256.0, "{}", p.mean_points());
        // Counts in a grid of 8 × 8 cells a tile, summed over all tiles: seams must be as dense as interiors.
        let mut cells = [0.0f64; 64];
        for t in &p.tiles {
            for q in t {
                cells[(q[1] * 8.0) as usize * 8 + (q[0] * 8.0) as usize] += 1.0;
            }
        }
        let mean = p.mean_points() * 16.0 / 64.0;
        // Edge cells: a quarter of their points is shared by all tiles, so their counts fluctuate as few draws do.
        let edge = (0..64).filter(|k| k % 8 == 0 || k % 8 == 7 || k / 8 == 0 || k / 8 == 7);
        let edge: Vec<f64> = edge.map(|k| cells[k]).collect();
        let edge_mean = edge.iter().sum::<f64>() / edge.len() as f64;
        assert!((edge_mean / mean - 1.0).abs() < 0.08, "{edge_mean} {mean}");
    }

    #[test]
    fn patterns_repeat_by_seed() {
        assert_eq!(Pattern::new(64, 1).tiles, Pattern::new(64, 1).tiles);
        assert_ne!(Pattern::new(64, 1).tiles, Pattern::new(64, 2).tiles);
    }
}
