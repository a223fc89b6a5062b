//! The pyramid of slices (BCF05 3.3): neighbours merged two by two, each level with mips of its own.
//!
//! All that a texel holds is premultiplied by its cover, so that "over" is associative: it does not matter which slices are merged
//! before and which while drawing. Cover is kept at four shares of the full density, each merged by itself; a mean activation
//! threshold would make a texel of a mip, in which many trees are, appear all at once.
//!
//! **Cover is kept.** "Over" takes what two slices hide of a texel for independent, and it is not: a crown's slices hide the same part of a texel at
//! its rim, and in a mip all slices hide the same places, those under trees. Stacks of means would hide far too much. What a stack as a whole
//! hides from straight above is known, though, from the samples; so in each texel of each mip the slices' optical depths −ln(1 − α) are
//! multiplied by the one factor that makes the stack hide just that ([`Slices::fitted`]), before slices are merged. All levels of a mip then
//! have the same cover from above, and all mips have it in the mean. Optics go with cover.
//!
//! Mips are means of the texels of one tile, down to one texel a tile. They mix no tiles, so a tile's cover is the same whichever its neighbours
//! are. A filter that reaches over an edge takes the texels of the tile that lies there (`march.rs` does), or stays in its own tile (clamps);
//! no gutter could hold them, for eight tiles fit an edge.

use super::slices::SHARES;

/// Values of a texel beside cover: reflectance (3), leaf share, transmittance (3), height.
pub const VALUES: usize = 8;

/// Least share of a texel that a stack lets through: an infinite depth could not be shared out among slices.
const CLEAR: f32 = 1e-4;

/// A texel of a slice, all of it premultiplied by cover.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Texel<const N: usize = VALUES> {
    /// Share of it that is covered at 1/4, 2/4, 3/4 and all of the full density.
    pub cover: [f32; SHARES],
    /// At full density, of what is seen: reflectance RGB, share of leaves, transmittance RGB, height above the ground over the stack's; or how
    /// light comes to it (`light.rs`).
    pub values: [f32; N],
}

impl<const N: usize> Default for Texel<N> {
    fn default() -> Self {
        Texel { cover: [0.0; SHARES], values: [0.0; N] }
    }
}

impl<const N: usize> Texel<N> {
    /// This texel over one of a slice below.
    pub fn over(&self, below: &Self) -> Self {
        let through = 1.0 - self.cover[SHARES - 1];
        Texel {
            cover: std::array::from_fn(|k| self.cover[k] + (1.0 - self.cover[k]) * below.cover[k]),
            values: std::array::from_fn(|k| self.values[k] + through * below.values[k]),
        }
    }
}

/// Slices of one tile; by slice from the ground up, row from the south, and column.
#[derive(Clone, Debug, PartialEq)]
pub struct Slices<const N: usize = VALUES> {
    /// Texels a side.
    pub side: usize,
    /// The texels.
    pub texels: Vec<Texel<N>>,
    /// What all slices together hide of each texel's ground from straight above, at each of the shares of the density.
    pub above: Vec<[f32; SHARES]>,
}

impl<const N: usize> Slices<N> {
    /// Half as many slices: each two that are neighbours, the upper over the lower.
    pub fn merged(&self) -> Self {
        let size = self.side * self.side;
        let pairs = self.texels.chunks_exact(2 * size);
        let merge = |pair: &[Texel<N>]| {
            let (low, high) = pair.split_at(size);
            high.iter().zip(low).map(|(h, l)| h.over(l)).collect::<Vec<_>>()
        };
        Slices { side: self.side, texels: pairs.flat_map(merge).collect(), above: self.above.clone() }
    }

    /// The same with covers that hide together what the stack hides from straight above.
    pub fn fitted(mut self) -> Self {
        let size = self.side * self.side;
        for (k, shares) in self.above.iter().enumerate() {
            for (share, above) in shares.iter().enumerate() {
                let depths = self.texels[k..].iter().step_by(size).map(|t| -(1.0 - t.cover[share]).ln());
                let factor = -(1.0 - above).max(CLEAR).ln() / depths.sum::<f32>();
                // Nothing is there, or a slice is opaque: then the stack is, too.
                if !(factor.is_finite() && factor > 0.0) {
                    continue;
                }
                for t in self.texels[k..].iter_mut().step_by(size) {
                    let cover = 1.0 - (1.0 - t.cover[share]).powf(factor);
                    if share == SHARES - 1 && t.cover[share] > 0.0 {
                        let ratio = cover / t.cover[share];
                        t.values.iter_mut().for_each(|v| *v *= ratio);
                    }
                    t.cover[share] = cover;
                }
            }
        }
        self
    }

    /// The next mip: means of two by two texels of each slice.
    pub fn halved(&self) -> Self {
        let side = self.side / 2;
        let mean = |of: [Texel<N>; 4]| Texel {
            cover: std::array::from_fn(|k| 0.25 * of.iter().map(|t| t.cover[k]).sum::<f32>()),
            values: std::array::from_fn(|k| 0.25 * of.iter().map(|t| t.values[k]).sum::<f32>()),
        };
        let mut texels = Vec::with_capacity(self.texels.len() / 4);
        for slice in self.texels.chunks_exact(self.side * self.side) {
            for (y, x) in (0..side).flat_map(|y| (0..side).map(move |x| (y, x))) {
                let k = 2 * (y * self.side + x);
                texels.push(mean([slice[k], slice[k + 1], slice[k + self.side], slice[k + self.side + 1]]));
            }
        }
        let above = (0..side * side).map(|k| 2 * (k / side * self.side + k % side)).map(|k| {
            let of = [k, k + 1, k + self.side, k + self.side + 1];
            std::array::from_fn(|share| 0.25 * of.iter().map(|k| self.above[*k][share]).sum::<f32>())
        });
        Slices { side, texels, above: above.collect() }
    }
}
