//! The pyramid of slices (BCF05 3.3): neighbours merged two by two, each level with mips of its own.
//!
//! All that a texel holds is premultiplied by its cover, so that "over" is associative: it does not matter which slices are merged
//! before and which while drawing. Cover is kept at four shares of the full density, each merged by itself; a mean activation
//! threshold would make a texel of a mip, in which many trees are, appear all at once.
//!
//! Mips are means of the texels of one tile. They mix no tiles, so a tile's mean cover is the same in every mip, whichever its neighbours
//! are, down to one texel a tile. A filter that reaches over an edge takes the texels of the tile that lies there (`verify.rs` does), or stays in
//! its own tile (clamps); no gutter could hold them, for eight tiles fit an edge.

use super::slices::SHARES;

/// Values of a texel beside cover: reflectance (3), leaf share, transmittance (3), height.
pub const VALUES: usize = 8;

/// A texel of a slice, all of it premultiplied by cover.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Texel {
    /// Share of it that is covered at 1/4, 2/4, 3/4 and all of the full density.
    pub cover: [f32; SHARES],
    /// At full density, of what is seen: reflectance RGB, share of leaves, transmittance RGB, height above the ground over the stack's.
    pub values: [f32; VALUES],
}

impl Texel {
    /// This texel over one of a slice below.
    pub fn over(&self, below: &Texel) -> Texel {
        let through = 1.0 - self.cover[SHARES - 1];
        Texel {
            cover: std::array::from_fn(|k| self.cover[k] + (1.0 - self.cover[k]) * below.cover[k]),
            values: std::array::from_fn(|k| self.values[k] + through * below.values[k]),
        }
    }
}

/// Slices of one tile; by slice from the ground up, row from the south, and column.
#[derive(Clone, Debug, PartialEq)]
pub struct Slices {
    /// Texels a side.
    pub side: usize,
    /// The texels.
    pub texels: Vec<Texel>,
}

impl Slices {
    /// Half as many slices: each two that are neighbours, the upper over the lower.
    pub fn merged(&self) -> Slices {
        let size = self.side * self.side;
        let pairs = self.texels.chunks_exact(2 * size);
        let merge = |pair: &[Texel]| {
            let (low, high) = pair.split_at(size);
            high.iter().zip(low).map(|(h, l)| h.over(l)).collect::<Vec<_>>()
        };
        Slices { side: self.side, texels: pairs.flat_map(merge).collect() }
    }

    /// The next mip: means of two by two texels of each slice.
    pub fn halved(&self) -> Slices {
        let side = self.side / 2;
        let mean = |of: [Texel; 4]| Texel {
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
        Slices { side, texels }
    }
}
