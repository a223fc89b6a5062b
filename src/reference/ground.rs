//! The ground as rays meet it.
//!
//! A level plain is a plane. Relief is what the renderer draws nearby: the bicubic interpolation of the height map, sampled
//! on a grid of an eighth of its cells (coarser where there would be more than [`MOST_CELLS`] of them) and triangulated
//! along the same diagonal. A ray walks over this grid in three steps, ever finer, and skips what lies wholly above or
//! below it. Along a ray the triangulated height is piecewise linear, so where the ray goes under it is found exactly, and
//! neighbouring triangles leave no gap. Grid heights are computed where a ray comes near, and kept.

use std::sync::OnceLock;

use glam::{DVec2, DVec3};

use crate::land::quadtree::Quadtree;
use crate::physics::raster::Raster;
use crate::physics::terrain::height_and_slope;
use crate::physics::tonemap::linear;
use crate::scene::{Albedo, Terrain};

/// Grid cells along a block: the unit that is skipped within a tile.
const BLOCK: usize = 8;
/// Blocks along a tile: the unit that is computed at once.
const BLOCKS: usize = 8;
/// Cells along a tile.
const TILE: usize = BLOCK * BLOCKS;
/// Most cells of the grid: half a gigabyte of heights, were all of them looked at.
const MOST_CELLS: f64 = 1.3e8;

/// The ground of a scene, in coordinates from the terrain's south-west corner, m.
pub struct Ground {
    extent: DVec2,
    relief: Option<Relief>,
    albedo: Reflectance,
}

enum Reflectance {
    Uniform([f32; 3]),
    Image { width: usize, height: usize, texels: Vec<[f32; 3]> },
}

struct Relief {
    raster: Raster,
    /// Grid cells a cell of the raster.
    fine: f64,
    /// Metres a grid cell.
    step: f64,
    /// Grid cells, east and north.
    cells: [usize; 2],
    /// Tiles, east and north.
    tiles: [usize; 2],
    /// Lowest and highest ground of each tile, at most.
    bounds: Vec<[f64; 2]>,
    content: Vec<OnceLock<Tile>>,
    /// Lowest and highest of all ground, with some room.
    range: [f64; 2],
}

struct Tile {
    /// Heights of the (TILE + 1)² grid points, m.
    heights: Vec<f32>,
    /// Lowest and highest of each block.
    bounds: Vec<[f32; 2]>,
}

impl Ground {
    /// The ground of a terrain.
    pub fn new(terrain: &Terrain) -> Self {
        Ground {
            extent: DVec2::from(terrain.extent),
            relief: terrain.heights.as_ref().map(|raster| Relief::new(terrain, raster)),
            albedo: match &terrain.albedo {
                Albedo::Uniform(c) => Reflectance::Uniform(*c),
                Albedo::Image(t) => Reflectance::Image {
                    width: t.width as usize,
                    height: t.height as usize,
                    texels: t
                        .rgba
                        .chunks_exact(4)
                        .map(|p| [0, 1, 2].map(|k| linear(f64::from(p[k]) / 255.0) as f32))
                        .collect(),
                },
            },
        }
    }

    /// Where a ray from above goes under the ground, between 0 and `t_max`, and the unit normal there.
    pub fn nearest(&self, origin: DVec3, direction: DVec3, t_max: f64) -> Option<(f64, DVec3)> {
        let Some(relief) = &self.relief else {
            let t = -origin.z / direction.z;
            let at = origin + direction * t;
            let on = at.x >= 0.0 && at.y >= 0.0 && at.x <= self.extent.x && at.y <= self.extent.y;
            return (direction.z < 0.0 && t >= 0.0 && t < t_max && on).then_some((t, DVec3::Z));
        };
        relief.nearest(origin, direction, t_max)
    }

    /// Lambertian reflectance at a place: bilinear between texel centres, borders repeated, as samplers do.
    pub fn albedo(&self, x: f64, y: f64) -> [f32; 3] {
        match &self.albedo {
            Reflectance::Uniform(c) => *c,
            Reflectance::Image { width, height, texels } => {
                let place = |t: f64, n: usize| {
                    let at = t.clamp(0.0, 1.0) * n as f64 - 0.5;
                    let index = |k: f64| k.clamp(0.0, n as f64 - 1.0) as usize;
                    (index(at.floor()), index(at.floor() + 1.0), (at - at.floor()) as f32)
                };
                let (x0, x1, fx) = place(x / self.extent.x, *width);
                // Row 0 is north.
                let (y0, y1, fy) = place(1.0 - y / self.extent.y, *height);
                let at = |x: usize, y: usize| texels[y * width + x];
                let (a, b, c, d) = (at(x0, y0), at(x1, y0), at(x0, y1), at(x1, y1));
                std::array::from_fn(|k| {
                    let row = |a: f32, b: f32| a + fx * (b - a);
                    row(a[k], b[k]) * (1.0 - fy) + row(c[k], d[k]) * fy
                })
            }
        }
    }
}

impl Relief {
    fn new(terrain: &Terrain, raster: &Raster) -> Self {
        let across = [raster.width, raster.height].map(|n| f64::from(n - 1));
        let fine = [8.0, 4.0, 2.0].into_iter().find(|f| across[0] * across[1] * f * f <= MOST_CELLS);
        let fine = fine.unwrap_or(1.0);
        let step = terrain.cell_size / fine;
        let cells = across.map(|n| (n * fine) as usize);
        let tiles = cells.map(|n| n.div_ceil(TILE));
        let tree = Quadtree::new(terrain, f64::INFINITY);
        let side = step * TILE as f64;
        let [low, high] = tree.total_range();
        let bounds = (0..tiles[0] * tiles[1])
            .map(|k| {
                let low = [k % tiles[0], k / tiles[0]].map(|v| v as f64 * side);
                let b = tree.ground_bounds(low, low.map(|v| v + side));
                [b.low[2], b.high[2]]
            })
            .collect();
        let content = (0..tiles[0] * tiles[1]).map(|_| OnceLock::new()).collect();
        let range = [low - 1.0, high + 1.0];
        Relief { raster: raster.clone(), fine, step, cells, tiles, bounds, content, range }
    }

    fn tile(&self, x: usize, y: usize) -> &Tile {
        self.content[y * self.tiles[0] + x].get_or_init(|| {
            let at = |v: usize, tile: usize, axis: usize| {
                ((tile * TILE + v).min(self.cells[axis])) as f64 / self.fine
            };
            let heights: Vec<f32> = (0..(TILE + 1) * (TILE + 1))
                .map(|k| {
                    let (i, j) = (k % (TILE + 1), k / (TILE + 1));
                    height_and_slope(&self.raster, at(i, x, 0), at(j, y, 1))[0] as f32
                })
                .collect();
            let bounds = (0..BLOCKS * BLOCKS)
                .map(|k| {
                    let (i, j) = (k % BLOCKS * BLOCK, k / BLOCKS * BLOCK);
                    let mut range = [f32::INFINITY, f32::NEG_INFINITY];
                    for row in heights.chunks_exact(TILE + 1).skip(j).take(BLOCK + 1) {
                        for h in &row[i..=i + BLOCK] {
                            range = [range[0].min(*h), range[1].max(*h)];
                        }
                    }
                    range
                })
                .collect();
            Tile { heights, bounds }
        })
    }

    fn nearest(&self, origin: DVec3, direction: DVec3, t_max: f64) -> Option<(f64, DVec3)> {
        // Between grid points: one a unit.
        let inverse = 1.0 / self.step;
        let (o, d) = (origin.truncate() * inverse, direction.truncate() * inverse);
        let z = |t: f64| origin.z + direction.z * t;
        let outside = |[low, high]: [f64; 2], from: f64, to: f64| {
            let (a, b) = (z(from), z(to));
            a.min(b) > high || a.max(b) < low
        };
        // To the part over the terrain.
        let (mut from, mut to) = (0.0f64, t_max);
        for k in 0..2 {
            let (o, d, end) = (o[k], d[k], self.cells[k] as f64);
            if d == 0.0 {
                if !(0.0..=end).contains(&o) {
                    return None;
                }
                continue;
            }
            let (a, b) = (-o / d, (end - o) / d);
            (from, to) = (from.max(a.min(b)), to.min(a.max(b)));
        }
        // And between its lowest and highest ground.
        let [low, high] = self.range;
        if direction.z != 0.0 {
            let (a, b) = ((low - origin.z) / direction.z, (high - origin.z) / direction.z);
            (from, to) = (from.max(a.min(b)), to.min(a.max(b)));
        } else if !(low..=high).contains(&origin.z) {
            return None;
        }
        if from >= to {
            return None;
        }
        let tiles = [[0; 2], self.tiles];
        walk(o, d, TILE, tiles, from, to, &mut |tx, ty, from, to| {
            if outside(self.bounds[ty * self.tiles[0] + tx], from, to) {
                return None;
            }
            let tile = self.tile(tx, ty);
            let first = [tx * BLOCKS, ty * BLOCKS];
            let blocks = [first, first.map(|v| v + BLOCKS)];
            walk(o, d, BLOCK, blocks, from, to, &mut |bx, by, from, to| {
                let [low, high] = tile.bounds[(by - first[1]) * BLOCKS + bx - first[0]];
                if outside([f64::from(low), f64::from(high)], from, to) {
                    return None;
                }
                let cells = [[bx * BLOCK, by * BLOCK], [(bx + 1) * BLOCK, (by + 1) * BLOCK]];
                walk(o, d, 1, cells, from, to, &mut |cx, cy, from, to| {
                    let row = (cy - ty * TILE) * (TILE + 1) + cx - tx * TILE;
                    let corner = |k: usize| f64::from(tile.heights[row + k]);
                    let heights = [corner(0), corner(1), corner(TILE + 1), corner(TILE + 2)];
                    let at = DVec2::new(cx as f64, cy as f64);
                    self.enters(heights, o - at, d, from, to, &z)
                })
            })
        })
    }

    /// Where a ray goes under the two triangles of a cell between two parameters; `o` and `d` are from the cell's corner, in
    /// cells, and heights are those of the south-west, south-east, north-west and north-east corner.
    fn enters(
        &self,
        [sw, se, nw, ne]: [f64; 4],
        o: DVec2,
        d: DVec2,
        from: f64,
        to: f64,
        z: &dyn Fn(f64) -> f64,
    ) -> Option<(f64, DVec3)> {
        // Height above the triangulated ground: south-east of the diagonal x = y and north-west of it.
        let slopes = |below: bool| if below { [se - sw, ne - se] } else { [ne - nw, nw - sw] };
        let above = |t: f64| {
            let p = o + d * t;
            let [sx, sy] = slopes(p.x >= p.y);
            z(t) - (sw + sx * p.x + sy * p.y)
        };
        let diagonal = (o.y - o.x) / (d.x - d.y);
        let middle = if diagonal > from && diagonal < to { Some(diagonal) } else { None };
        let mut start = (from, above(from));
        for t in middle.into_iter().chain([to]) {
            let end = (t, above(t));
            if start.1 > 0.0 && end.1 <= 0.0 {
                let hit = start.0 + (end.0 - start.0) * start.1 / (start.1 - end.1);
                let p = o + d * (0.5 * (start.0 + end.0));
                let [sx, sy] = slopes(p.x >= p.y);
                return Some((hit, DVec3::new(-sx / self.step, -sy / self.step, 1.0).normalize()));
            }
            start = end;
        }
        None
    }
}

/// Visits the cells of a grid, `side` units a cell, that a ray crosses between two parameters, in order, among those from
/// `range[0]` up to `range[1]`; `visit` gets a cell and the parameters between which the ray is in it, and ends the walk
/// by an answer.
fn walk<T>(
    o: DVec2,
    d: DVec2,
    side: usize,
    range: [[usize; 2]; 2],
    from: f64,
    to: f64,
    visit: &mut dyn FnMut(usize, usize, f64, f64) -> Option<T>,
) -> Option<T> {
    let size = side as f64;
    let start = o + d * from;
    let first: [usize; 2] = std::array::from_fn(|k| {
        let cell = (start[k] / size).floor();
        (cell.max(0.0) as usize).clamp(range[0][k], range[1][k] - 1)
    });
    let mut cell = first;
    let mut t = from;
    loop {
        // Where the ray leaves the cell along each axis.
        let leave: [f64; 2] = std::array::from_fn(|k| {
            let border = if d[k] > 0.0 { cell[k] + 1 } else { cell[k] } as f64 * size;
            if d[k] == 0.0 { f64::INFINITY } else { (border - o[k]) / d[k] }
        });
        let axis = usize::from(leave[1] < leave[0]);
        let end = leave[axis].min(to).max(t);
        if let Some(found) = visit(cell[0], cell[1], t, end) {
            return Some(found);
        }
        if leave[axis] >= to {
            return None;
        }
        t = end;
        if d[axis] > 0.0 {
            cell[axis] += 1;
            if cell[axis] >= range[1][axis] {
                return None;
            }
        } else {
            if cell[axis] <= range[0][axis] {
                return None;
            }
            cell[axis] -= 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::hash::Stream;

    fn hills() -> Terrain {
        let (width, height) = (41, 30);
        let samples = (0..width * height)
            .map(|k| {
                let (x, y) = (f64::from(k % width), f64::from(k / width));
                (60.0 * (x * 0.7).sin() * (y * 0.5).cos()) as f32
            })
            .collect();
        Terrain {
            origin: [0.0; 2],
            extent: [f64::from(width - 1) * 25.0, f64::from(height - 1) * 25.0],
            cell_size: 25.0,
            heights: Some(Raster { width, height, samples }),
            albedo: Albedo::Uniform([0.1; 3]),
        }
    }

    #[test]
    fn a_ray_meets_the_ground_where_marching_along_it_does() {
        let terrain = hills();
        let ground = Ground::new(&terrain);
        let mut random = Stream::new(4);
        let (mut hits, mut misses) = (0, 0);
        for k in 0..2000 {
            let [x, y] = [0, 1].map(|k| terrain.extent[k] * random.unit());
            // Down, level and up; along the axes now and then.
            let mut d = DVec3::new(random.unit() - 0.5, random.unit() - 0.5, 0.6 * random.unit() - 0.4);
            if k % 10 == 0 {
                d.x = 0.0;
            }
            if k % 15 == 0 {
                d.y = 0.0;
            }
            let d = d.normalize_or(-DVec3::Z);
            let o = DVec3::new(x, y, terrain.height_at(x, y) + 0.5 + 80.0 * random.unit());
            // Steps of a quarter of a metre against the smooth surface.
            let inside = |p: DVec3| {
                (0.0..=terrain.extent[0]).contains(&p.x) && (0.0..=terrain.extent[1]).contains(&p.y)
            };
            let mut marched = None;
            for step in 1..8000 {
                let p = o + d * (0.25 * f64::from(step));
                if !inside(p) || p.z > 70.0 && d.z >= 0.0 {
                    break;
                }
                if p.z < terrain.height_at(p.x, p.y) {
                    marched = Some(0.25 * f64::from(step));
                    break;
                }
            }
            let met = ground.nearest(o, d, f64::INFINITY);
            match (marched, met) {
                (Some(a), Some((b, n))) => {
                    hits += 1;
                    let p = o + d * b;
                    // Triangles with a diagonal of 4.4 m under a curvature of 60 · (0.7² + 0.5²)/25² /m: 4.4²/8 of it is
                    // 17 cm, and the cubic's may be half as much again.
                    let off = p.z - terrain.height_at(p.x, p.y);
                    assert!(off.abs() < 0.25, "ray {k}: {off} m from the ground");
                    // It meets the same slope, but where it grazes a crest that the triangles cut off.
                    assert!((a - b).abs() < 0.3 + 0.25 / d.dot(n).abs().max(1e-3), "ray {k}: {a} {b}");
                    assert!(d.dot(n) < 0.0 && (n.length() - 1.0).abs() < 1e-12);
                    // A facet's slope is the ground's half a facet away, at most: 2.2 m of a curvature of 0.07 /m, 1.7 slopes
                    // beside it of the cubic's jumps between samples.
                    let [_, sx, sy] = height_and_slope(
                        terrain.heights.as_ref().unwrap(),
                        p.x / terrain.cell_size,
                        p.y / terrain.cell_size,
                    );
                    let slope = DVec2::new(sx, sy) / terrain.cell_size;
                    let off = (DVec2::new(-n.x, -n.y) / n.z - slope).length();
                    assert!(off < 0.3, "ray {k}: slope {slope}, normal {n}");
                }
                (None, None) => misses += 1,
                // Only a ray that grazes within that distance may do one without the other.
                (a, b) => {
                    let t = a.or(b.map(|b| b.0)).unwrap();
                    let least = (0..400)
                        .map(|k| o + d * (t + 0.25 * f64::from(k)))
                        .filter(|p| inside(*p))
                        .map(|p| p.z - terrain.height_at(p.x, p.y))
                        .fold(f64::INFINITY, f64::min);
                    assert!(least > -0.25, "ray {k}: {a:?} {b:?}, {least} m under the ground");
                }
            }
        }
        println!("{hits} hits, {misses} misses");
        assert!(hits > 500 && misses > 300);
    }

    #[test]
    fn limits_are_kept_and_a_plain_ends() {
        let plain = Ground::new(&Terrain { heights: None, extent: [100.0, 50.0], ..hills() });
        let down = |x: f64, y: f64, t| plain.nearest(DVec3::new(x, y, 10.0), -DVec3::Z, t);
        assert_eq!(down(99.0, 49.0, 11.0), Some((10.0, DVec3::Z)));
        assert_eq!(down(99.0, 49.0, 9.0), None);
        assert_eq!(down(99.0, 51.0, 11.0), None);
        assert_eq!(plain.nearest(DVec3::new(5.0, 5.0, -1.0), DVec3::Z, 9.0), None, "from below");
        let hills = Ground::new(&hills());
        let o = DVec3::new(500.0, 300.0, 500.0);
        let (t, _) = hills.nearest(o, -DVec3::Z, f64::INFINITY).unwrap();
        assert!(hills.nearest(o, -DVec3::Z, t * 0.999).is_none());
    }
}
