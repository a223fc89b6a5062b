//! Values of an image with their intervals, from blocks of its pixels.

use crate::measure::statistics::block_bootstrap;

/// Least side of a block, pixels.
const SIDE: u32 = 16;
/// Most blocks along a side of the image.
const MOST: u32 = 16;

/// A value and how well it is known.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Estimate {
    /// The value.
    pub value: f64,
    /// 95 % interval; `None` where there are fewer than two blocks to tell from.
    pub interval: Option<[f64; 2]>,
}

impl Estimate {
    /// Passed through a function that grows.
    pub fn map(self, grows: impl Fn(f64) -> f64) -> Self {
        Estimate { value: grows(self.value), interval: self.interval.map(|i| i.map(&grows)) }
    }
}

/// Sums of K quantities over the blocks of an image: 16 × 16 pixels, or a sixteenth of its longer side if that is more.
/// `of` gives a pixel's, or `None` for one that does not count; blocks without any pixel that counts are left out.
pub fn block_sums<const K: usize>(size: [u32; 2], of: impl Fn(usize) -> Option<[f64; K]>) -> Vec<[f64; K]> {
    let [width, height] = size;
    let side = SIDE.max(width.max(height).div_ceil(MOST));
    let across = width.div_ceil(side);
    let mut sums: Vec<Option<[f64; K]>> = vec![None; (across * height.div_ceil(side)) as usize];
    for y in 0..height {
        for x in 0..width {
            if let Some(values) = of((y * width + x) as usize) {
                let block = sums[(y / side * across + x / side) as usize].get_or_insert([0.0; K]);
                block.iter_mut().zip(values).for_each(|(s, v)| *s += v);
            }
        }
    }
    sums.into_iter().flatten().collect()
}

/// A statistic of the sums over all blocks, and its interval by a bootstrap of the blocks; `None` if it is not finite.
pub fn estimate<const K: usize>(
    blocks: &[[f64; K]],
    statistic: impl Fn([f64; K]) -> f64,
) -> Option<Estimate> {
    let total = |drawn: &[[f64; K]]| {
        let mut sums = [0.0; K];
        drawn.iter().for_each(|b| sums.iter_mut().zip(b).for_each(|(s, v)| *s += v));
        statistic(sums)
    };
    let value = total(blocks);
    if !value.is_finite() {
        return None;
    }
    let interval = (blocks.len() > 1).then(|| block_bootstrap(blocks, 1, 0.95, total));
    Some(Estimate { value, interval: interval.filter(|i| i.iter().all(|v| v.is_finite())) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_hold_every_pixel_once() {
        for size in [[1, 1], [16, 16], [17, 40], [1000, 3], [300, 257]] {
            let sums = block_sums(size, |k| Some([1.0, k as f64]));
            let n = f64::from(size[0] * size[1]);
            let all = sums.iter().fold([0.0; 2], |a, b| [a[0] + b[0], a[1] + b[1]]);
            assert_eq!(all, [n, n * (n - 1.0) / 2.0], "{size:?}");
            assert!(sums.len() <= 256);
        }
        assert!(block_sums([40, 40], |_| None::<[f64; 1]>).is_empty());
    }

    #[test]
    fn one_block_has_a_value_and_no_interval() {
        assert_eq!(estimate(&[[1.0, 2.0]], |s| s[1] / s[0]), Some(Estimate { value: 2.0, interval: None }));
        assert_eq!(estimate(&[[0.0, 2.0]], |s| s[1] / s[0]), None);
        assert_eq!(estimate(&[[f64::NAN]; 3], |s| s[0]), None);
    }
}
