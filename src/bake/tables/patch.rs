//! Patches of forest to measure: tori of Wang tiles, or of Poisson points.

use super::ForestSettings;
use crate::land::pattern::Pattern;
use crate::physics::crown::Crown;
use crate::physics::hash::{Stream, hash2};

/// Steps of a turn: azimuths of rays relative to trees are rounded to these. A step moves the edge of a crown of 5 m by
/// 3 cm, less than a tenth of a texel.
pub const TURNS: u32 = 1024;
/// Points of a Wang tile, as the renderer's.
const TILE_POINTS: u32 = 256;
/// Tiles along a patch.
const TILES: u32 = 4;
/// Seed of the canonical pattern: tables do not depend on a scene's seed.
const SEED: u32 = 0x7ab1e5;
/// Most cells along a patch.
const MAX_CELLS: f32 = 512.0;

/// One tree of a patch.
#[derive(Clone, Copy, Debug)]
pub struct Tree {
    /// Position of the trunk, m.
    pub position: [f32; 2],
    /// Size relative to the model.
    pub scale: f32,
    /// Rotation, in [0, [`TURNS`]).
    pub turn: u32,
    /// Number in the patch.
    pub index: u32,
}

/// Trees sorted by cells of a grid; cells with the same first coordinate are neighbours in memory.
struct Sorted {
    start: Vec<u32>,
    trees: Vec<Tree>,
}

/// Trees on a torus at the pattern's full density.
pub struct Patch {
    /// Side of the torus, m.
    pub side: f32,
    /// All trees, by their number.
    pub trees: Vec<Tree>,
    cells: i32,
    cell: f32,
    /// By x first, and by y first.
    sorted: [Sorted; 2],
}

/// A horizontal segment, from `origin` along the unit vector `along`.
#[derive(Clone, Copy, Debug)]
pub struct Segment {
    /// Where it starts, m.
    pub origin: [f32; 2],
    /// Unit vector.
    pub along: [f32; 2],
    /// Length, m.
    pub length: f32,
    /// Half width of the corridor around it in which trees may be met, m.
    pub reach: f32,
}

/// The integer below; without a call, unlike `f32::floor` on processors of 2003.
#[inline(always)]
fn floor(x: f32) -> i32 {
    let i = x as i32;
    i - i32::from(x < i as f32)
}

/// The patches of a forest, each an independent tiling.
pub fn patches(crown: &Crown, forest: &ForestSettings, count: usize) -> Vec<Patch> {
    let density = forest.measured_density(crown);
    let reach = crown.frame.half_width.max(crown.radius) * forest.scale_range[1];
    with_density(forest, density, reach, count as u32)
}

/// The patches of a forest at its pattern's own density, for whoever looks at all trees of one.
pub fn whole_patches(forest: &ForestSettings, count: u32) -> Vec<Patch> {
    with_density(forest, forest.pattern_density, f32::MAX, count)
}

/// Patches of as many trees per m², to look for trees up to `reach` m beside a segment.
fn with_density(forest: &ForestSettings, density: f64, reach: f32, count: u32) -> Vec<Patch> {
    let pattern = Pattern::new(TILE_POINTS, SEED);
    (0..count).map(|k| Patch::of(&pattern, forest, (density, reach), k)).collect()
}

/// Points of a torus of Wang tiles with edge colours by hash, in tile sides.
fn wang(pattern: &Pattern, key: u32) -> Vec<[f64; 2]> {
    let colour = |x: u32, y: u32, axis: u32| (hash2(key + axis, hash2(x % TILES, y % TILES)) & 1) as usize;
    let mut points = Vec::new();
    for (x, y) in (0..TILES * TILES).map(|k| (k % TILES, k / TILES)) {
        let kind =
            colour(x, y, 1) | colour(x, y + 1, 1) << 1 | colour(x, y, 2) << 2 | colour(x + 1, y, 2) << 3;
        let corner = [f64::from(x), f64::from(y)];
        points.extend(pattern.tiles[kind].iter().map(|p| [0, 1].map(|k| corner[k] + f64::from(p[k]))));
    }
    points
}

/// Number of points of a Poisson process in patch `k`. Every second patch has as many more than the mean as the one before has
/// less: numbers vary as they must, and their mean is exact.
fn poisson(k: u32, mean: f64) -> u32 {
    let mut stream = Stream::new(hash2(!SEED, k / 2));
    // Gaps of a Poisson process in time are exponential: as many points as come before `mean`.
    let (mut time, mut count) = (0.0, 0);
    loop {
        time -= (1.0 - stream.unit()).ln();
        if time >= mean {
            break;
        }
        count += 1;
    }
    if k.is_multiple_of(2) { count } else { ((2.0 * mean).round() as u32).saturating_sub(count) }
}

impl Patch {
    fn of(pattern: &Pattern, forest: &ForestSettings, (density, reach): (f64, f32), k: u32) -> Self {
        let tile = (pattern.mean_points() / density).sqrt();
        let mut stream = Stream::new(hash2(SEED, k));
        let points = if forest.poisson {
            let count = poisson(k, pattern.mean_points() * f64::from(TILES * TILES));
            (0..count).map(|_| [(); 2].map(|()| stream.unit() * f64::from(TILES))).collect()
        } else {
            wang(pattern, hash2(SEED, k))
        };
        let [low, high] = forest.scale_range;
        let trees = points.iter().enumerate().map(|(index, p)| Tree {
            position: p.map(|x| (x * tile) as f32),
            scale: low + (high - low) * stream.unit() as f32,
            turn: stream.bits() % TURNS,
            index: index as u32,
        });
        Patch::new((tile * f64::from(TILES)) as f32, trees.collect(), reach)
    }

    fn new(side: f32, trees: Vec<Tree>, reach: f32) -> Self {
        // Cells of half a crown: corridors are little wider than they must be.
        let cells = (side / (0.5 * reach)).clamp(1.0, MAX_CELLS).floor();
        let cell = side / cells;
        let count = cells as usize;
        let at = |x: f32| ((x / cell) as usize).min(count - 1);
        let sorted = [0, 1].map(|first| {
            let key = |t: &Tree| at(t.position[first]) * count + at(t.position[1 - first]);
            let mut sorted = trees.clone();
            sorted.sort_by_key(key);
            let mut start = vec![0; count * count + 1];
            sorted.iter().for_each(|t| start[key(t) + 1] += 1);
            for k in 0..count * count {
                start[k + 1] += start[k];
            }
            Sorted { start, trees: sorted }
        });
        Patch { side, trees, cells: cells as i32, cell, sorted }
    }

    /// Calls `meet` with every tree whose trunk lies within the segment's reach, perhaps others near by, and the vector
    /// from the trunk to the segment's origin; a tree once for each of its images on the torus.
    #[inline]
    pub fn visit(&self, segment: &Segment, mut meet: impl FnMut(&Tree, [f32; 2])) {
        let Segment { origin, along, length, reach } = *segment;
        // Along the axis of which the segment covers more, so that it crosses few cells across.
        let first = usize::from(along[1].abs() > along[0].abs());
        let sorted = &self.sorted[first];
        let (p0, s0) = (origin[first], origin[1 - first]);
        let slope = along[1 - first] / along[first];
        let p1 = p0 + length * along[first];
        let width = reach * (1.0 + slope * slope).sqrt();
        let (low, high) = (p0.min(p1), p0.max(p1));
        let inverse = 1.0 / self.cell;
        let cell = |x: f32| floor(x * inverse);
        for column in cell(low - reach)..=cell(high + reach) {
            // The line's range across, over the part of the column that the segment's trees may lie in.
            let (left, right) = (column as f32 * self.cell, (column + 1) as f32 * self.cell);
            let (sa, sb) = (s0 + slope * (left - p0), s0 + slope * (right - p0));
            let (mut row, last) = (cell(sa.min(sb) - width), cell(sa.max(sb) + width));
            let wrapped = column.rem_euclid(self.cells);
            let shift_p = (column - wrapped) as f32 * self.cell;
            while row <= last {
                let wrapped_row = row.rem_euclid(self.cells);
                let run = (last - row).min(self.cells - 1 - wrapped_row);
                let shift_s = (row - wrapped_row) as f32 * self.cell;
                let from = (wrapped * self.cells + wrapped_row) as usize;
                let range = sorted.start[from] as usize..sorted.start[from + run as usize + 1] as usize;
                for tree in &sorted.trees[range] {
                    let mut offset = [0.0; 2];
                    offset[first] = p0 - tree.position[first] - shift_p;
                    offset[1 - first] = s0 - tree.position[1 - first] - shift_s;
                    meet(tree, offset);
                }
                row += run + 1;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::crown::Frame;

    fn forest(poisson: bool) -> ForestSettings {
        ForestSettings {
            pattern_density: 0.03,
            scale_range: [0.8, 1.2],
            poisson,
            ..ForestSettings::default()
        }
    }

    fn crown() -> Crown {
        Crown {
            frame: Frame { centre: 5.0, half_width: 4.0, half_height: 5.0 },
            radius: 3.0,
            base: 2.0,
            height: 10.0,
            leaf_shadow: 0.0,
            extinction: 1.0,
            ..Crown::default()
        }
    }

    #[test]
    fn patches_have_the_density_of_the_pattern() {
        for poisson in [false, true] {
            let patches = patches(&crown(), &forest(poisson), 16);
            let trees: usize = patches.iter().map(|p| p.trees.len()).sum();
            let area: f64 = patches.iter().map(|p| f64::from(p.side).powi(2)).sum();
            let ratio = trees as f64 / area / 0.03;
            // Tiles differ in their numbers of points; those of Poisson patches cancel but for rounding.
            assert!((ratio - 1.0).abs() < if poisson { 1e-3 } else { 5e-3 }, "{ratio}");
        }
    }

    #[test]
    fn tiles_keep_their_distance_across_the_torus() {
        let patch = &patches(&crown(), &forest(false), 1)[0];
        let least = Pattern::new(TILE_POINTS, SEED).distance as f32 * patch.side / TILES as f32;
        for a in &patch.trees {
            let nearest = patch.trees.iter().filter(|b| b.index != a.index).map(|b| {
                let d = [0, 1].map(|k| {
                    let d = (a.position[k] - b.position[k]).abs();
                    d.min(patch.side - d)
                });
                d[0].hypot(d[1])
            });
            assert!(nearest.fold(f32::INFINITY, f32::min) > least - 1e-3);
        }
    }

    /// Every tree near a segment is met once an image, against all images within three tori.
    #[test]
    fn segments_meet_every_tree_near_them() {
        let patch = &patches(&crown(), &forest(true), 1)[0];
        let mut stream = Stream::new(5);
        for k in 0..200 {
            let angle = stream.unit() as f32 * std::f32::consts::TAU;
            let angle = if k < 8 { k as f32 * std::f32::consts::FRAC_PI_4 } else { angle };
            let segment = Segment {
                origin: [0, 1].map(|_| stream.unit() as f32 * patch.side),
                along: [angle.cos(), angle.sin()],
                length: if k % 4 == 0 { 0.0 } else { stream.unit() as f32 * 1.8 * patch.side },
                reach: 4.8,
            };
            let mut met = std::collections::HashMap::new();
            patch.visit(&segment, |t, o| {
                let image =
                    [0, 1].map(|k| ((segment.origin[k] - o[k] - t.position[k]) / patch.side).round() as i32);
                *met.entry((t.index, image)).or_insert(0) += 1;
            });
            assert!(met.values().all(|n| *n == 1));
            for t in &patch.trees {
                for image in (0..25).map(|k| [k % 5 - 2, k / 5 - 2]) {
                    let d = [0, 1].map(|k| t.position[k] + image[k] as f32 * patch.side - segment.origin[k]);
                    let along =
                        (d[0] * segment.along[0] + d[1] * segment.along[1]).clamp(0.0, segment.length);
                    let off = (d[0] - along * segment.along[0]).hypot(d[1] - along * segment.along[1]);
                    if off < segment.reach - 0.01 {
                        assert!(met.contains_key(&(t.index, image)), "{segment:?} {t:?}");
                    }
                }
            }
        }
    }
}
