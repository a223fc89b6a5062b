//! Pages of shadow cascades: which of them a view needs, which are drawn already, and what is to be drawn.
//!
//! A cascade holds a square of an endless map ([`ShadowGrid`]) in an image that repeats: every page of the map has one place in
//! the image, whatever square is held. So a page that was drawn stays where it is while the square moves on around it.

use crate::camera::Bounds;
use crate::camera::cascades::{Cascade, MARGIN, ShadowGrid};
use crate::gpu::interface::SHADOW_PAGES;

const SIDE: usize = SHADOW_PAGES as usize;

/// Some of the pages of a cascade's square; a row is a word, bit x is page x.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PageSet {
    /// Rows, south to north.
    pub rows: [u64; SIDE],
}

impl Default for PageSet {
    fn default() -> Self {
        PageSet { rows: [0; SIDE] }
    }
}

/// The pages from `low` to `high`, both included, of a row.
fn span(low: usize, high: usize) -> u64 {
    (u64::MAX >> (SIDE - 1 - high)) & (u64::MAX << low)
}

impl PageSet {
    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.rows.iter().all(|r| *r == 0)
    }

    /// Adds the pages that a box reaches into, with a margin for lookups.
    pub fn add(&mut self, cascade: &Cascade, bounds: &Bounds) {
        if let Some([[x0, y0], [x1, y1]]) = pages_of(cascade, bounds, f64::from(MARGIN) + 1.0) {
            let row = span(x0, x1);
            self.rows[y0..=y1].iter_mut().for_each(|r| *r |= row);
        }
    }

    /// Whether a box reaches into any of them.
    pub fn touches(&self, cascade: &Cascade, bounds: &Bounds) -> bool {
        pages_of(cascade, bounds, f64::from(MARGIN)).is_some_and(|[[x0, y0], [x1, y1]]| {
            let row = span(x0, x1);
            self.rows[y0..=y1].iter().any(|r| r & row != 0)
        })
    }

    /// Numbers of them before each page in x and y: row after row of one more than pages along a side.
    pub fn sums(&self) -> Vec<u32> {
        let side = SIDE + 1;
        let mut sums = vec![0; side * side];
        for (y, row) in self.rows.iter().enumerate() {
            let mut in_row = 0;
            for x in 0..SIDE {
                in_row += (row >> x & 1) as u32;
                sums[(y + 1) * side + x + 1] = sums[y * side + x + 1] + in_row;
            }
        }
        sums
    }

    /// They are all and only in these rectangles, corners south-west and (beyond the last) north-east.
    pub fn rectangles(&self) -> Vec<[[usize; 2]; 2]> {
        let mut found = Vec::new();
        let mut y = 0;
        while y < SIDE {
            let row = self.rows[y];
            let end = (y..SIDE).find(|k| self.rows[*k] != row).unwrap_or(SIDE);
            let mut x = 0;
            while row != 0 && x < SIDE {
                let ones = (row >> x).trailing_ones() as usize;
                if ones > 0 {
                    found.push([[x, y], [x + ones, end]]);
                }
                x += ones.max(1);
            }
            y = end;
        }
        found
    }
}

/// First and last page of a cascade's square that a box reaches into, with a margin in texels.
fn pages_of(cascade: &Cascade, bounds: &Bounds, margin: f64) -> Option<[[usize; 2]; 2]> {
    let g = &cascade.grid;
    let (mut first, mut last) = ([0; 2], [0; 2]);
    for k in 0..2 {
        let reach = |low: bool| -> f64 {
            let least = |i: usize| (g.axes[k][i] > 0.0) == low;
            (0..3).map(|i| g.axes[k][i] * if least(i) { bounds.low[i] } else { bounds.high[i] }).sum()
        };
        let page = |texel: f64| ((texel - cascade.first[k] as f64) / g.page() as f64).floor();
        let (low, high) = (page(reach(true) / g.texel - margin), page(reach(false) / g.texel + margin));
        if high < 0.0 || low >= SIDE as f64 {
            return None;
        }
        (first[k], last[k]) = (low.max(0.0) as usize, high.min(SIDE as f64 - 1.0) as usize);
    }
    Some([first, last])
}

/// What an image holds of the maps: by cascade, the map and the page at each place.
#[derive(Clone, Debug, Default)]
pub struct Held {
    cascades: Vec<(ShadowGrid, Vec<Option<[i64; 2]>>)>,
}

impl Held {
    /// Of the pages needed by each cascade those that are not held; from now on they are.
    pub fn take(&mut self, cascades: &[Cascade], needed: &[PageSet]) -> Vec<PageSet> {
        self.cascades.truncate(cascades.len());
        let mut fresh = Vec::new();
        for (k, (cascade, needed)) in cascades.iter().zip(needed).enumerate() {
            let none = || (cascade.grid.clone(), vec![None; SIDE * SIDE]);
            match self.cascades.get_mut(k) {
                Some((grid, _)) if *grid == cascade.grid => (),
                Some(other) => *other = none(),
                None => self.cascades.push(none()),
            }
            fresh.push(take(&mut self.cascades[k].1, cascade, needed));
        }
        fresh
    }
}

fn take(held: &mut [Option<[i64; 2]>], cascade: &Cascade, needed: &PageSet) -> PageSet {
    let first = cascade.first.map(|f| f / cascade.grid.page());
    // What is drawn reaches over the borders of the pages that it is drawn for, and so into the places of pages beyond the square.
    let last = first.map(|f| f + SIDE as i64);
    for place in held.iter_mut() {
        if place.is_some_and(|p| (0..2).any(|k| !(first[k]..last[k]).contains(&p[k]))) {
            *place = None;
        }
    }
    let mut fresh = PageSet::default();
    for (y, row) in needed.rows.iter().enumerate() {
        let mut rest = *row;
        while rest != 0 {
            let x = rest.trailing_zeros() as usize;
            rest &= rest - 1;
            let page = [first[0] + x as i64, first[1] + y as i64];
            let [u, v] = page.map(|p| p.rem_euclid(SIDE as i64) as usize);
            let place = &mut held[v * SIDE + u];
            if *place != Some(page) {
                *place = Some(page);
                fresh.rows[y] |= 1 << x;
            }
        }
    }
    fresh
}

/// What of a cascade's square lies between two seams of the image, at most four blocks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Block {
    /// Texel of the map at the image's first texel.
    pub origin: [i64; 2],
    /// First page of it in the square.
    pub first: [i64; 2],
    /// First page beyond.
    pub last: [i64; 2],
    /// Pages of the square before the block's origin; negative.
    pub shift: [i64; 2],
}

impl Block {
    /// A place of the map from the block's origin.
    pub fn within(&self, place: [f64; 3]) -> [f32; 3] {
        let [x, y, z] = place;
        [(x - self.origin[0] as f64) as f32, (y - self.origin[1] as f64) as f32, z as f32]
    }
}

/// The blocks of a cascade that hold any of these pages, and which.
pub fn blocks(cascade: &Cascade, pages: &PageSet) -> Vec<(Block, PageSet)> {
    let (texels, page) = (i64::from(cascade.grid.texels), cascade.grid.page());
    let side = SIDE as i64;
    let begin = cascade.first.map(|f| f.div_euclid(texels));
    let mut found = Vec::new();
    for (j, i) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
        let origin = [(begin[0] + i) * texels, (begin[1] + j) * texels];
        let shift = [0, 1].map(|k| (origin[k] - cascade.first[k]) / page);
        let first = shift.map(|s| (-s).max(0));
        let last = shift.map(|s| (side - s).min(side));
        if [0, 1].iter().any(|k| first[*k] >= last[*k]) {
            continue;
        }
        let in_square = |k: usize, p: i64| (p + shift[k]) as usize;
        let row = span(in_square(0, first[0]), in_square(0, last[0] - 1));
        let mut own = PageSet::default();
        for y in in_square(1, first[1])..=in_square(1, last[1] - 1) {
            own.rows[y] = pages.rows[y] & row;
        }
        if !own.is_empty() {
            found.push((Block { origin, first, last, shift }, own));
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cascade(first: [i64; 2]) -> Cascade {
        let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        Cascade { grid: ShadowGrid { axes, texel: 0.5, texels: 256, lowest: 0.0 }, first, far: 100.0 }
    }

    fn square(x: f64, y: f64, side: f64) -> Bounds {
        Bounds { low: [x, y, 0.0], high: [x + side, y + side, 1.0] }
    }

    fn count(set: &PageSet) -> u32 {
        set.rows.iter().map(|r| r.count_ones()).sum()
    }

    #[test]
    fn boxes_reach_the_pages_that_they_cover() {
        let c = cascade([1000, -2000]);
        let mut set = PageSet::default();
        // Pages are 2 m; the square begins at (500, -1000) m.
        set.add(&c, &square(510.2, -990.0, 0.2));
        assert_eq!(count(&set), 4, "margins of 1.5 m: pages 4 and 5 in both");
        assert!(
            set.touches(&c, &square(509.2, -991.0, 0.1)) && !set.touches(&c, &square(515.0, -990.0, 9.0))
        );
        assert!(!set.touches(&c, &square(490.0, -990.0, 5.0)));
        set.add(&c, &square(0.0, -2000.0, 4000.0));
        assert_eq!(count(&set), 64 * 64);
    }

    #[test]
    fn sums_and_rectangles_are_those_of_the_pages() {
        let mut set = PageSet::default();
        let mut stream = crate::physics::hash::Stream::new(3);
        for row in &mut set.rows {
            if stream.unit() < 0.8 {
                *row = (u64::from(stream.bits()) << 32 | u64::from(stream.bits()))
                    & u64::from(stream.bits()) << 20;
            }
        }
        set.rows[11] = set.rows[10];
        set.rows[63] = u64::MAX;
        let sums = set.sums();
        assert_eq!(sums[64 * 65 + 64], count(&set));
        let at = |x: usize, y: usize| sums[y * 65 + x];
        for (x, y) in [(0, 0), (31, 10), (63, 63), (20, 50)] {
            let one = at(x + 1, y + 1) + at(x, y) - at(x, y + 1) - at(x + 1, y);
            assert_eq!(u64::from(one), set.rows[y] >> x & 1);
        }
        let mut again = PageSet::default();
        for [[x0, y0], [x1, y1]] in set.rectangles() {
            for row in &mut again.rows[y0..y1] {
                assert_eq!(*row & span(x0, x1 - 1), 0, "twice");
                *row |= span(x0, x1 - 1);
            }
        }
        assert_eq!(again, set);
    }

    #[test]
    fn pages_are_drawn_once_while_the_square_moves_and_again_when_the_map_changes() {
        let mut held = Held::default();
        let all = PageSet { rows: [u64::MAX; SIDE] };
        let all = std::slice::from_ref(&all);
        let mut fresh = |c: &Cascade| count(&held.take(std::slice::from_ref(c), all)[0]);
        let mut c = cascade([-400, 84]);
        assert_eq!((fresh(&c), fresh(&c)), (4096, 0));
        c.first = [-392, 80];
        // Two columns and a row scroll in.
        assert_eq!((fresh(&c), fresh(&c)), (2 * 64 + 62, 0));
        c.first = [-392 + 256 * 7, 80];
        assert_eq!(fresh(&c), 4096, "the same places, other pages");
        c.first = [-392, 80];
        assert_eq!(fresh(&c), 4096, "which were drawn over");
        c.grid.lowest = 1.0;
        assert_eq!((fresh(&c), fresh(&c)), (4096, 0));
    }

    #[test]
    fn blocks_make_up_the_square_and_each_of_their_pages_has_its_place_in_the_image() {
        let all = PageSet { rows: [u64::MAX; SIDE] };
        for first in [[0, 0], [-400, 84], [256, -256], [4, 252], [-4, -1020]] {
            let c = cascade(first);
            let mut seen = PageSet::default();
            for (b, pages) in blocks(&c, &all) {
                assert_eq!(i64::from(count(&pages)), (b.last[0] - b.first[0]) * (b.last[1] - b.first[1]));
                for (k, first) in first.into_iter().enumerate() {
                    assert!(
                        b.origin[k] % 256 == 0
                            && (0..64).contains(&b.first[k])
                            && (1..=64).contains(&b.last[k])
                    );
                    assert_eq!(b.origin[k], first + 4 * b.shift[k]);
                }
                for y in b.first[1]..b.last[1] {
                    for x in b.first[0]..b.last[0] {
                        let bit = 1u64 << (x + b.shift[0]);
                        let row = &mut seen.rows[(y + b.shift[1]) as usize];
                        assert_eq!(*row & bit, 0);
                        *row |= bit;
                    }
                }
            }
            assert_eq!(seen, all, "{first:?}");
            let mut one = PageSet::default();
            one.rows[5] = 1 << 7;
            assert!(matches!(&blocks(&c, &one)[..], [(_, pages)] if *pages == one));
        }
    }
}
