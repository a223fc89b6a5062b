//! Consistency of scale: radiance over the reference's, by distance.

use super::{Estimate, block_sums, estimate};
use crate::image::Layers;

/// Part of the pixels that a bin must have for a say in [`spread`].
const LEAST: f64 = 0.01;

/// The pixels at an octave of distances.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct DistanceBin {
    /// Least distance along the view axis, m; the largest is twice as far.
    pub from_m: f64,
    /// Pixels.
    pub pixels: u64,
    /// Mean radiance over the reference's; `None` if the reference is black there, or something is no finite number.
    pub ratio: Option<Estimate>,
}

/// A range of distances along the view axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Range {
    /// Up to 64 m: where trees are meshes or full clouds of cards in pictures of usual size.
    Near,
    /// Up to 512 m: where they are drawn one by one.
    Middle,
    /// Beyond: where their average is.
    Far,
}

impl Range {
    /// All, with their names.
    pub const NAMES: [(&'static str, Range); 3] =
        [("near", Range::Near), ("middle", Range::Middle), ("far", Range::Far)];

    /// That of a distance, m.
    pub fn of(metres: f32) -> Self {
        match metres {
            m if m < 64.0 => Range::Near,
            m if m < 512.0 => Range::Middle,
            _ => Range::Far,
        }
    }
}

/// Ratio of mean radiances in every octave of the reference's distance; background is left out. Noise of the reference
/// has no part in means but their intervals.
pub fn over_distance(actual: &Layers, reference: &Layers) -> Vec<DistanceBin> {
    let octave = |k: usize| {
        let depth = f64::from(reference.depth[k]);
        (depth.is_finite() && depth > 0.0).then(|| depth.log2().floor() as i32)
    };
    let mut octaves: Vec<i32> = (0..reference.depth.len()).filter_map(octave).collect();
    octaves.sort_unstable();
    octaves.dedup();
    let sum = |c: [f32; 3]| c.iter().map(|v| f64::from(*v)).sum::<f64>();
    octaves
        .into_iter()
        .map(|o| {
            let blocks = block_sums(reference.size, |k| {
                (octave(k) == Some(o)).then(|| [1.0, sum(actual.radiance[k]), sum(reference.radiance[k])])
            });
            DistanceBin {
                from_m: f64::from(o).exp2(),
                pixels: blocks.iter().map(|b| b[0]).sum::<f64>() as u64,
                ratio: estimate(&blocks, |[_, a, r]| if r > 0.0 { a / r } else { f64::NAN }),
            }
        })
        .collect()
}

/// Largest ratio over the smallest, less 1, of the bins with at least 1 % of the pixels: 0 where radiance is wrong by one
/// factor at every distance, or right. `None` without any.
pub fn spread(bins: &[DistanceBin]) -> Option<f64> {
    let all: u64 = bins.iter().map(|b| b.pixels).sum();
    let counted = bins.iter().filter(|b| b.pixels as f64 >= LEAST * all as f64);
    let ratios: Vec<f64> = counted.filter_map(|b| b.ratio.map(|r| r.value)).collect();
    let least = ratios.iter().copied().reduce(f64::min)?;
    let most = ratios.iter().copied().reduce(f64::max)?;
    (least > 0.0).then(|| most / least - 1.0)
}

#[cfg(test)]
mod tests {
    use super::super::fixtures::{image, mapped};
    use super::*;

    /// Distances 10 m, 20 m, 40 m … in columns of ten pixels.
    fn far(radiance: impl Fn(usize) -> f32) -> Layers {
        let mut all = image([40, 40], |k| [radiance(k % 40 / 10); 3]);
        all.depth = (0..1600).map(|k| 10.0 * 2f32.powi(k % 40 / 10)).collect();
        all
    }

    #[test]
    fn ratios_are_those_of_their_distance() {
        let reference = far(|_| 0.5);
        let bins = over_distance(&far(|octave| 0.5 + 0.05 * octave as f32), &reference);
        let found: Vec<(f64, u64)> = bins.iter().map(|b| (b.from_m, b.pixels)).collect();
        assert_eq!(found, [(8.0, 400), (16.0, 400), (32.0, 400), (64.0, 400)]);
        for (k, bin) in bins.iter().enumerate() {
            assert!((bin.ratio.unwrap().value - (1.0 + 0.1 * k as f64)).abs() < 1e-6);
        }
        assert!((spread(&bins).unwrap() - 0.3).abs() < 1e-6);
        // One factor everywhere is consistent.
        let even = over_distance(&mapped(&reference, |v| 1.7 * v), &reference);
        assert!(spread(&even).unwrap().abs() < 1e-6 && (even[0].ratio.unwrap().value - 1.7).abs() < 1e-6);
    }

    #[test]
    fn what_does_not_exist_is_none() {
        let sky = Layers { depth: vec![0.0; 1600], ..far(|_| 0.5) };
        assert!(over_distance(&sky, &sky).is_empty() && spread(&[]).is_none());
        let black = over_distance(&far(|_| 0.5), &far(|_| 0.0));
        assert!(black.iter().all(|b| b.ratio.is_none()) && spread(&black).is_none());
    }
}
