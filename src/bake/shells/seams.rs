//! Whether one can tell where tiles meet.

use super::Shells;
use super::slices::SHARES;
use super::verify::mean;
use crate::land::pattern::TILES;

/// Width of the band along edges, in parts of a tile's side: from the edge about as far as what all tiles share reaches.
const BAND: u32 = 16;

/// Tiles at their edges.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Seam {
    /// Share of the full density.
    pub share: f64,
    /// Cover from above of the band along edges, and its standard error. There is little chance in it: the trees there are those of two
    /// colours of two axes, so the error is from the spread of these four.
    pub band: [f64; 2],
    /// The same inside, where the error is from the spread of sixteen tiles.
    pub inside: [f64; 2],
    /// Root of the mean square step of cover from a texel to the next of the same slice: inside tiles,
    pub step_inside: f64,
    /// over an edge, between tiles that fit,
    pub step_across: f64,
    /// and between such that do not.
    pub step_wrong: f64,
}

/// Looks at the edges at each share of the full density.
pub fn seams(shells: &Shells) -> [Seam; SHARES] {
    std::array::from_fn(|k| {
        let finest = Tiles::new(shells, 0, k);
        let above = Tiles::new(shells, shells.levels.len() - 1, k);
        let [step_inside, step_across, step_wrong] = finest.steps();
        Seam {
            share: (k + 1) as f64 / SHARES as f64,
            band: above.band(),
            inside: above.inside(),
            step_inside,
            step_across,
            step_wrong,
        }
    })
}

/// Cover at one share in the finest mip of a level.
struct Tiles<'a> {
    cover: &'a [u8],
    side: u32,
    slices: u32,
    share: usize,
}

impl<'a> Tiles<'a> {
    fn new(shells: &'a Shells, level: usize, share: usize) -> Self {
        let mip = &shells.levels[level][0];
        Tiles { cover: &mip.cover, side: mip.side, slices: shells.settings.slices >> level, share }
    }

    fn at(&self, kind: usize, slice: u32, x: u32, y: u32) -> f64 {
        let line = (kind as u32 * self.slices + slice) * self.side + y;
        f64::from(self.cover[((line * self.side + x) as usize) * SHARES + self.share]) / 255.0
    }

    /// The texel at a place along an edge, and so far from it: south, north, west, east.
    fn along(&self, kind: usize, slice: u32, edge: usize, place: u32, depth: u32) -> f64 {
        let far = self.side - 1 - depth;
        match edge {
            0 => self.at(kind, slice, place, depth),
            1 => self.at(kind, slice, place, far),
            2 => self.at(kind, slice, depth, place),
            _ => self.at(kind, slice, far, place),
        }
    }

    /// Mean cover near edges, over the four kinds of edge, in the top slice of all.
    fn band(&self) -> [f64; 2] {
        let kinds = (0..4).map(|k| (k / 2, k % 2)).map(|(axis, colour)| {
            let sides = [2 * axis, 2 * axis + 1];
            let tiles = (0..TILES).flat_map(|t| sides.map(|e| (t, e)));
            let with = tiles.filter(|(t, e)| t >> e & 1 == colour);
            let depths = (self.side / BAND).max(1);
            let all = with.flat_map(|(t, e)| {
                (0..self.side).flat_map(move |p| (0..depths).map(move |d| self.along(t, 0, e, p, d)))
            });
            mean(all.collect::<Vec<_>>().into_iter()).0
        });
        mean(kinds.collect::<Vec<_>>().into_iter()).into()
    }

    /// Mean cover of tiles in the middle half of their sides.
    fn inside(&self) -> [f64; 2] {
        let middle = self.side / 4..3 * self.side / 4;
        let tiles = (0..TILES).map(|t| {
            let all = middle.clone().flat_map(|y| middle.clone().map(move |x| self.at(t, 0, x, y)));
            mean(all.collect::<Vec<_>>().into_iter()).0
        });
        mean(tiles.collect::<Vec<_>>().into_iter()).into()
    }

    /// Steps inside, over edges of one colour, and over edges of two.
    fn steps(&self) -> [f64; 3] {
        let mut sums = [[0.0; 2]; 3];
        let mut add = |k: usize, a: f64, b: f64| {
            sums[k][0] += (a - b).powi(2);
            sums[k][1] += 1.0;
        };
        for (slice, place) in (0..self.slices).flat_map(|s| (0..self.side).map(move |p| (s, p))) {
            for edge in [0, 2] {
                for (a, b) in (0..TILES).flat_map(|a| (0..TILES).map(move |b| (a, b))) {
                    // b lies before a's edge.
                    let fits = (a >> edge ^ b >> (edge + 1)) & 1 == 0;
                    let steps =
                        [self.along(a, slice, edge, place, 0), self.along(b, slice, edge + 1, place, 0)];
                    add(if fits { 1 } else { 2 }, steps[0], steps[1]);
                }
                for t in 0..TILES {
                    let depth = self.side / 2;
                    let [a, b] = [depth, depth + 1].map(|d| self.along(t, slice, edge, place, d));
                    add(0, a, b);
                }
            }
        }
        sums.map(|[sum, n]| (sum / n).sqrt())
    }
}
