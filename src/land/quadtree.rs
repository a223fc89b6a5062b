//! The terrain's quadtree, on the CPU and in doubles: which quads are drawn at which level, without cracks or popping.
//!
//! A quad is split while its box is nearer the eye than `refine` times its side. A vertex of a quad of side s morphs to
//! the next coarser grid between (refine + 1.9) s and 2 refine s: nearer than that a finer neighbour may share it (its
//! distance is below refine s plus the quad's diagonal, 1.9 s on slopes up to 40°), and from there on a coarser one may
//! (its box is at least 2 refine s away). So shared vertices are equal in both, and levels change only where both agree.

use crate::camera::Bounds;
use crate::physics::raster::Raster;
use crate::scene::Terrain;

/// Smallest `refine` for which the morph range above is not empty, with room to spare.
pub const MIN_REFINE: f64 = 3.5;

/// A quad: level 0 is the root; x and y count quads of its level from the south-west corner.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct QuadKey {
    /// Level; 0 is the root.
    pub level: u32,
    /// Column.
    pub x: u32,
    /// Row.
    pub y: u32,
}

impl QuadKey {
    /// The quad itself, or its ancestor at this level where it is deeper.
    pub fn ancestor(self, level: u32) -> QuadKey {
        let up = self.level.saturating_sub(level);
        QuadKey { level: self.level - up, x: self.x >> up, y: self.y >> up }
    }
}

/// The quadtree over a terrain.
#[derive(Clone, Debug)]
pub struct Quadtree {
    extent: [f64; 2],
    step: f64,
    levels: u32,
    cell_size: f64,
    /// Smallest and largest sample of each cell of ever coarser grids; level k has cells of 2^k samples.
    pyramid: Vec<(u32, u32, Vec<[f32; 2]>)>,
}

impl Quadtree {
    /// The tree for a terrain. With relief, its finest mesh cells are an eighth of a height map cell; a level plain has
    /// quads down to a side of `plain_side` metres.
    pub fn new(terrain: &Terrain, plain_side: f64) -> Self {
        let (step, levels) = levels(terrain, plain_side);
        Quadtree {
            extent: terrain.extent,
            step,
            levels,
            cell_size: terrain.cell_size,
            pyramid: terrain.heights.as_ref().map_or_else(Vec::new, min_max_pyramid),
        }
    }

    /// Extent of the terrain, m.
    pub fn extent(&self) -> [f64; 2] {
        self.extent
    }

    /// Metres a step of the finest grid.
    pub fn step(&self) -> f64 {
        self.step
    }

    /// Number of levels.
    pub fn levels(&self) -> u32 {
        self.levels
    }

    /// Steps of the finest grid a mesh cell of a level.
    pub fn spacing(&self, level: u32) -> u32 {
        1 << (self.levels - 1 - level)
    }

    /// Side of a quad of a level, m.
    pub fn side(&self, level: u32) -> f64 {
        self.step * f64::from(crate::gpu::interface::TERRAIN_CELLS * self.spacing(level))
    }

    /// Distances at which vertices of a level begin and end to morph to the next coarser one, m.
    pub fn morph(&self, level: u32, refine: f64) -> [f64; 2] {
        let side = self.side(level);
        if level == 0 { [1e30, 2e30] } else { [(refine + 1.9) * side, 2.0 * refine * side] }
    }

    /// Bounds of a rectangle of ground, m; heights are bounded, not exact.
    pub fn ground_bounds(&self, low: [f64; 2], high: [f64; 2]) -> Bounds {
        let [min, max] = self.height_range(low, high);
        Bounds { low: [low[0], low[1], min], high: [high[0], high[1], max] }
    }

    /// Lowest and highest ground of the whole terrain, m.
    pub fn total_range(&self) -> [f64; 2] {
        self.height_range([0.0; 2], self.extent)
    }

    fn height_range(&self, low: [f64; 2], high: [f64; 2]) -> [f64; 2] {
        if self.pyramid.is_empty() {
            return [0.0, 0.0];
        }
        // Bicubic interpolation at a point reads one sample before and two after its cell.
        let first = [0, 1].map(|k| ((low[k] / self.cell_size).floor() - 1.0).max(0.0) as u32);
        let last = [0, 1].map(|k| ((high[k] / self.cell_size).floor() + 2.0).max(0.0) as u32);
        let span = (last[0].saturating_sub(first[0])).max(last[1].saturating_sub(first[1])).max(1);
        let level = (span.ilog2().saturating_sub(1) as usize).min(self.pyramid.len() - 1);
        let (w, h, cells) = &self.pyramid[level];
        let (mut min, mut max) = (f32::INFINITY, f32::NEG_INFINITY);
        for y in (first[1] >> level).min(h - 1)..=(last[1] >> level).min(h - 1) {
            for x in (first[0] >> level).min(w - 1)..=(last[0] >> level).min(w - 1) {
                let [a, b] = cells[(y * w + x) as usize];
                (min, max) = (min.min(a), max.max(b));
            }
        }
        // Negative lobes of Catmull-Rom: at most 1/8 a side along one axis, so 1.25² − 1 over both.
        let lobe = f64::from(max - min) * 0.5625 / 2.0;
        [f64::from(min) - lobe, f64::from(max) + lobe]
    }

    /// The ground of a quad, as far as the terrain goes: its south-west and north-east corners, m.
    fn rectangle(&self, quad: QuadKey) -> ([f64; 2], [f64; 2]) {
        let side = self.side(quad.level);
        let low = [f64::from(quad.x) * side, f64::from(quad.y) * side];
        (low, [(low[0] + side).min(self.extent[0]), (low[1] + side).min(self.extent[1])])
    }

    /// No point of a quad as it is drawn is nearer to `eye`, m. Where it morphs it has its parent's shape, which may leave its own
    /// bounds, but not its parent's heights.
    pub fn nearest(&self, quad: QuadKey, eye: [f64; 3]) -> f64 {
        self.drawn(quad).distance(eye)
    }

    /// No point of a quad as it is drawn is farther from `eye`, m.
    pub fn farthest(&self, quad: QuadKey, eye: [f64; 3]) -> f64 {
        self.drawn(quad).farthest(eye)
    }

    /// Bounds of a quad as it is drawn.
    fn drawn(&self, quad: QuadKey) -> Bounds {
        let (low, high) = self.rectangle(quad);
        let (parent_low, parent_high) = self.rectangle(quad.ancestor(quad.level.saturating_sub(1)));
        let [min, max] = self.height_range(parent_low, parent_high);
        Bounds { low: [low[0], low[1], min], high: [high[0], high[1], max] }
    }

    /// The quads to draw from `eye`, in order: those whose bounds `keep` keeps; `None` when there are more than `most`.
    pub fn select(
        &self,
        eye: [f64; 3],
        refine: f64,
        most: usize,
        keep: &dyn Fn(&Bounds) -> bool,
    ) -> Option<Vec<QuadKey>> {
        let mut found = Vec::new();
        let mut open = vec![QuadKey { level: 0, x: 0, y: 0 }];
        while let Some(quad) = open.pop() {
            let (low, high) = self.rectangle(quad);
            if low[0] >= self.extent[0] || low[1] >= self.extent[1] {
                continue;
            }
            let bounds = self.ground_bounds(low, high);
            if !keep(&bounds) {
                continue;
            }
            if quad.level + 1 < self.levels && bounds.distance(eye) < refine * self.side(quad.level) {
                let (level, x, y) = (quad.level + 1, 2 * quad.x, 2 * quad.y);
                open.extend([(0, 0), (1, 0), (0, 1), (1, 1)].map(|(i, j)| QuadKey {
                    level,
                    x: x + i,
                    y: y + j,
                }));
            } else {
                found.push(quad);
                if found.len() > most {
                    return None;
                }
            }
        }
        found.sort_unstable();
        Some(found)
    }
}

/// The cells of a grid that `keep` keeps, row after row; it is asked about rectangles of cells, from a corner to beyond the other.
pub fn grid_cells(count: [u32; 2], keep: &dyn Fn([u32; 2], [u32; 2]) -> bool) -> Vec<[u32; 2]> {
    let mut found = Vec::new();
    let mut open = vec![([0, 0], count)];
    while let Some((low, high)) = open.pop() {
        if (0..2).any(|k| low[k] >= high[k]) || !keep(low, high) {
            continue;
        }
        let size = [0, 1].map(|k| high[k] - low[k]);
        if size == [1, 1] {
            found.push(low);
            continue;
        }
        let k = usize::from(size[1] > size[0]);
        let middle = low[k] + size[k] / 2;
        let (mut first, mut second) = (high, low);
        (first[k], second[k]) = (middle, middle);
        open.extend([(low, first), (second, high)]);
    }
    found.sort_unstable_by_key(|[x, y]| (*y, *x));
    found
}

/// Metres a step of the finest grid, and the number of levels.
fn levels(terrain: &Terrain, plain_side: f64) -> (f64, u32) {
    let largest = terrain.extent[0].max(terrain.extent[1]);
    let cells = f64::from(crate::gpu::interface::TERRAIN_CELLS);
    let mut levels = 1;
    if terrain.heights.is_some() {
        let step = terrain.cell_size / 8.0;
        while step * cells * f64::from(1u32 << (levels - 1)) < largest {
            levels += 1;
        }
        return (step, levels);
    }
    // The root is the whole plain.
    while largest / f64::from(1u32 << (levels - 1)) > plain_side && levels < 20 {
        levels += 1;
    }
    (largest / (cells * f64::from(1u32 << (levels - 1))), levels)
}

/// Number of quads of all levels of a terrain's tree that [`Quadtree::new`] would make.
pub fn quad_count(terrain: &Terrain, plain_side: f64) -> u64 {
    let (step, levels) = levels(terrain, plain_side);
    let finest = step * f64::from(crate::gpu::interface::TERRAIN_CELLS);
    let along =
        |extent: f64, level: u32| (extent / (finest * f64::from(1u32 << level))).ceil().max(1.0) as u64;
    (0..levels).map(|l| along(terrain.extent[0], l) * along(terrain.extent[1], l)).sum()
}

fn min_max_pyramid(raster: &Raster) -> Vec<(u32, u32, Vec<[f32; 2]>)> {
    let mut levels =
        vec![(raster.width, raster.height, raster.samples.iter().map(|s| [*s, *s]).collect::<Vec<_>>())];
    while let Some((w, h, cells)) = levels.last() {
        if *w == 1 && *h == 1 {
            break;
        }
        let (w2, h2) = (w.div_ceil(2), h.div_ceil(2));
        let mut next = Vec::with_capacity((w2 * h2) as usize);
        for y in 0..h2 {
            for x in 0..w2 {
                let mut range = [f32::INFINITY, f32::NEG_INFINITY];
                for (i, j) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                    let (cx, cy) = ((2 * x + i).min(w - 1), (2 * y + j).min(h - 1));
                    let c = cells[(cy * w + cx) as usize];
                    range = [range[0].min(c[0]), range[1].max(c[1])];
                }
                next.push(range);
            }
        }
        levels.push((w2, h2, next));
    }
    levels
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Albedo;

    fn hills() -> Terrain {
        let (width, height) = (65, 50);
        let samples = (0..width * height)
            .map(|k| {
                let (x, y) = (f64::from(k % width), f64::from(k / width));
                (200.0 * (x * 0.3).sin() * (y * 0.2).cos()) as f32
            })
            .collect();
        Terrain {
            origin: [0.0; 2],
            extent: [f64::from(width - 1) * 80.0, f64::from(height - 1) * 80.0],
            cell_size: 80.0,
            heights: Some(Raster { width, height, samples }),
            albedo: Albedo::Uniform([0.1; 3]),
        }
    }

    #[test]
    fn quads_tile_the_terrain_and_neighbours_differ_by_one_level_at_most() {
        let terrain = hills();
        let tree = Quadtree::new(&terrain, f64::INFINITY);
        for eye in [[2000.0, 1500.0, 100.0], [-500.0, 0.0, 300.0], [2560.0, 1960.0, 5000.0]] {
            let quads = tree.select(eye, MIN_REFINE, 100_000, &|_| true).unwrap();
            let mut area = 0.0;
            for q in &quads {
                let s = tree.side(q.level);
                let (x, y) = (f64::from(q.x) * s, f64::from(q.y) * s);
                area += (terrain.extent[0] - x).min(s) * (terrain.extent[1] - y).min(s);
            }
            assert!((area / (terrain.extent[0] * terrain.extent[1]) - 1.0).abs() < 1e-9);
            for a in &quads {
                for b in &quads {
                    let (sa, sb) = (tree.side(a.level), tree.side(b.level));
                    let touch = |p: u32, q: u32| {
                        let (p, q) = (f64::from(p) * sa, f64::from(q) * sb);
                        p <= q + sb && q <= p + sa
                    };
                    if touch(a.x, b.x) && touch(a.y, b.y) {
                        assert!(a.level.abs_diff(b.level) <= 1, "{a:?} {b:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn cells_are_found_as_if_each_were_asked() {
        let wanted = |x: u32, y: u32| (x * 7 + y * 3).is_multiple_of(11) || (x == 36 && y == 4);
        let keep = |low: [u32; 2], high: [u32; 2]| {
            (low[1]..high[1]).any(|y| (low[0]..high[0]).any(|x| wanted(x, y)))
        };
        let all = (0..5).flat_map(|y| (0..37).map(move |x| [x, y]));
        let want: Vec<_> = all.filter(|[x, y]| wanted(*x, *y)).collect();
        assert_eq!(grid_cells([37, 5], &keep), want);
    }

    #[test]
    fn bounds_hold_the_interpolated_ground() {
        let terrain = hills();
        let tree = Quadtree::new(&terrain, f64::INFINITY);
        for k in 0..400 {
            let low = [f64::from(k % 20) * 230.0, f64::from(k / 20) * 180.0];
            let high = [low[0] + 97.0, low[1] + 143.0];
            let b = tree.ground_bounds(low, high);
            for i in 0..=4 {
                for j in 0..=4 {
                    let (x, y) = (low[0] + 97.0 * f64::from(i) / 4.0, low[1] + 143.0 * f64::from(j) / 4.0);
                    let z = terrain.height_at(x, y);
                    assert!((b.low[2]..=b.high[2]).contains(&z), "{z} {b:?}");
                }
            }
        }
    }

    #[test]
    fn no_ground_of_a_quad_or_of_its_parent_in_it_is_nearer_than_said() {
        let terrain = hills();
        let tree = Quadtree::new(&terrain, f64::INFINITY);
        let eye = [900.0, 400.0, 250.0];
        let all = tree.select(eye, MIN_REFINE, 10_000, &|_| true).unwrap();
        for quad in &all {
            let (side, said) = (tree.side(quad.level), tree.nearest(*quad, eye));
            for k in 0..81 {
                let [u, v] = [k % 9, k / 9].map(|c| f64::from(c) / 8.0);
                let x = ((f64::from(quad.x) + u) * side).min(tree.extent[0]);
                let y = ((f64::from(quad.y) + v) * side).min(tree.extent[1]);
                let z = terrain.height_at(x, y);
                let away = ((x - eye[0]).powi(2) + (y - eye[1]).powi(2) + (z - eye[2]).powi(2)).sqrt();
                assert!(said <= away + 1e-9, "{quad:?}: {said} {away}");
            }
        }
        assert!(all.iter().any(|q| tree.nearest(*q, eye) > 1000.0), "hardly anything is far");
    }
}
