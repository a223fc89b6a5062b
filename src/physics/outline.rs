//! Outlines of z-field views: where in each row of a view anything can be seen of the tree. More than half of the pixels in trees'
//! boxes show nothing of them, and each would cost a whole search.

use rayon::prelude::*;

use super::zfield::ZField;

/// Rows of an outline; each is a word.
pub const ROWS: usize = 16;
/// Rows that the lower and the upper half of a word stand for, from its own on. Lines of pixels are a little slanted in a view.
const SPANS: [usize; 2] = [2, 4];
/// Steps of a coordinate u that an interval's bytes count, from −½ on: a bilinear sample reaches half a texel beyond the view, and
/// the last level has a single texel.
const STEPS: f64 = 128.0;
/// What the shader's floats may be wrong by in u.
const SLACK: f64 = 1.0 / 1024.0;

/// Least and greatest u at which there is something; from −∞ or to ∞ where nearest texels are those of the view's edge.
type Interval = [f64; 2];

const NOTHING: Interval = [f64::INFINITY, f64::NEG_INFINITY];

/// The smallest that holds two.
fn both(a: Interval, b: Interval) -> Interval {
    [a[0].min(b[0]), a[1].max(b[1])]
}

/// Two bytes, rounded outward: least u, greatest u. Byte 0 of the least is −∞, byte 255 of the greatest is ∞; nothing is (255, 0).
fn bytes([low, high]: Interval) -> u32 {
    if low > high {
        return 255;
    }
    let step = |u: f64| (u + 0.5) * STEPS;
    let low = step(low - SLACK).floor().clamp(0.0, 254.0) as u32;
    let high = step(high + SLACK).ceil().clamp(1.0, 255.0) as u32;
    low | high << 8
}

/// First and last texel of each row of a level that has any opacity.
fn extents(texels: &[u8], side: usize) -> Vec<Option<[usize; 2]>> {
    let seen = |t: &[u8]| t[3] > 0;
    let row = |row: &[u8]| {
        let first = row.chunks_exact(4).position(seen)?;
        Some([first, row.chunks_exact(4).rposition(seen)?])
    };
    texels.chunks_exact(4 * side).map(row).collect()
}

/// Where samples between the heights `v` may find opacity: bilinear ones, which read the rows and columns of texels around
/// them, and if `clamped` nearest ones, of points outside the view the texel of its edge.
fn interval(extents: &[Option<[usize; 2]>], v: [f64; 2], clamped: bool) -> Interval {
    let side = extents.len() as f64;
    let row = |v: f64| (v * side - 0.5).floor().max(0.0) as usize;
    let rows = row(v[0])..=(row(v[1] + 1.0 / side)).min(extents.len() - 1);
    rows.filter_map(|y| extents[y])
        .map(|[first, last]| {
            let low = if clamped && first == 0 { f64::NEG_INFINITY } else { (first as f64 - 0.5) / side };
            let high =
                if clamped && last + 1 == extents.len() { f64::INFINITY } else { (last as f64 + 1.5) / side };
            [low, high]
        })
        .fold(NOTHING, both)
}

/// Outlines of a species' views for every level at which a search may be done, [`ROWS`] words a level of a view: what a bilinear
/// sample of the level, or a bilinear or the nearest texel of the next coarser one, may find at a height. A search that starts
/// where neither finds opacity stays there and sees nothing.
pub fn outlines(field: &ZField) -> Vec<u32> {
    let layers = super::views::count(field.n) as usize;
    let levels = field.levels.len();
    let layer = |layer: usize| -> Vec<u32> {
        let extents: Vec<_> = field
            .levels
            .iter()
            .enumerate()
            .map(|(level, texels)| {
                let side = (field.resolution as usize >> level).max(1);
                extents(&texels[4 * side * side * layer..][..4 * side * side], side)
            })
            .collect();
        let word = |level: usize, row: usize| {
            let half = |span: usize| {
                // Slack in v too; rows beyond the last are outside the view.
                let v = [row as f64 / ROWS as f64 - SLACK, (row + span) as f64 / ROWS as f64 + SLACK];
                let coarser = &extents[(level + 1).min(levels - 1)];
                bytes(both(interval(&extents[level], v, false), interval(coarser, v, true)))
            };
            half(SPANS[0]) | half(SPANS[1]) << 16
        };
        (0..levels)
            .flat_map(|level| (0..ROWS).map(move |row| (level, row)))
            .map(|(l, r)| word(l, r))
            .collect()
    };
    (0..layers).into_par_iter().flat_map_iter(layer).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::hash::{hash, unit};
    use crate::physics::views;
    use crate::physics::zfield::sample;

    /// One ring of views of 32² texels with a few blobs, also at the edge; coarser levels hold something wherever finer ones do.
    fn field() -> ZField {
        let (n, resolution) = (1, 32usize);
        let layers = views::count(n) as usize;
        let mut levels = Vec::new();
        for level in 0..6 {
            let side = resolution >> level;
            let mut texels = vec![0u8; 4 * side * side * layers];
            for layer in 0..layers {
                for blob in 0..3u32 {
                    let place = hash(layer as u32 * 3 + blob) as usize % (resolution * resolution);
                    let (x, y) = ((place % resolution) >> level, (place / resolution) >> level);
                    texels[4 * (layer * side * side + y * side + x) + 3] = 9;
                }
            }
            levels.push(texels);
        }
        ZField { n, resolution: resolution as u32, levels }
    }

    /// What the shader takes from a word for the heights `v`.
    fn holds(words: &[u32], u: f64, v: [f64; 2]) -> bool {
        let row = |v: f64| (v * ROWS as f64).clamp(0.0, ROWS as f64 - 1.0) as usize;
        let rows = row(v[1]) - row(v[0]);
        let half =
            SPANS.iter().position(|span| rows < *span).map_or(0xff00, |k| words[row(v[0])] >> (16 * k));
        let (low, high) = (half & 255, half >> 8 & 255);
        let at = |byte: u32| f64::from(byte) / STEPS - 0.5;
        (low == 0 || u >= at(low)) && (high == 255 || u <= at(high))
    }

    /// The texel that holds a point; of points outside the view the nearest.
    fn nearest(field: &ZField, level: usize, layer: u32, u: f64, v: f64) -> u8 {
        let side = (field.resolution >> level) as usize;
        let at = |x: f64| ((x * side as f64).floor().max(0.0) as usize).min(side - 1);
        field.levels[level][4 * (layer as usize * side * side + at(v) * side + at(u)) + 3]
    }

    /// Wherever a sample of any kind finds opacity, the outline holds the point; and it is no wider than it must be: of points where
    /// samples find nothing, it leaves out most.
    #[test]
    fn an_outline_holds_what_samples_find_and_little_else() {
        let field = field();
        let outlines = outlines(&field);
        let levels = field.levels.len();
        let (mut empty, mut left_out) = (0, 0);
        for k in 0..200_000u32 {
            let random = |salt: u32| f64::from(unit(hash(hash(k) ^ salt)));
            let layer = (random(1) * 5.0) as u32;
            let level = (random(2) * levels as f64) as usize;
            let (u, v) = (2.0 * random(3) - 0.5, 2.0 * random(4) - 0.5);
            let reach = 0.25 * random(5) * random(6);
            let coarser = (level + 1).min(levels - 1);
            let found = sample(&field, level, layer, u, v).alpha > 0.0
                || sample(&field, coarser, layer, u, v).alpha > 0.0
                || nearest(&field, coarser, layer, u, v) > 0;
            let words = &outlines[ROWS * (layer as usize * levels + level)..][..ROWS];
            let held = holds(words, u, [v - reach, v + reach * random(7)]);
            assert!(held || !found, "level {level} of view {layer} at {u}, {v}");
            empty += u32::from(!found);
            left_out += u32::from(!held);
        }
        assert!(left_out * 2 > empty, "{left_out} of {empty}");
    }

    #[test]
    fn of_a_view_without_opacity_nothing_is_seen_and_of_a_full_one_all_at_its_edges() {
        let field =
            |byte: u8| ZField { n: 1, resolution: 2, levels: vec![vec![byte; 4 * 4 * 5], vec![byte; 4 * 5]] };
        assert!(outlines(&field(0)).iter().all(|word| *word == 0x00ff_00ff));
        assert!(outlines(&field(1)).iter().all(|word| *word == 0xff00_ff00));
    }
}
