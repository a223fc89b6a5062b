//! Sub-pixel coverage masks (BN12, section 8); twin of `shaders/physics/masks.glsl`.
//!
//! A pixel has S samples. A tree of opacity α covers k of them, k being αS rounded up or down so that its mean is αS;
//! *which* k is drawn from a combination table by the tree's seed. n such trees then cover 1 − (1 − α)ⁿ of the samples
//! on average, because any sample is covered with probability α independently from tree to tree.

/// Number of samples covered by opacity `alpha`, for a dither uniform in [0, 1).
pub fn covered_samples(alpha: f32, dither: f32, samples: u32) -> u32 {
    (alpha * samples as f32 + dither).floor().clamp(0.0, samples as f32) as u32
}

/// So many samples in turn from one on, around the end.
pub fn run_mask(count: u32, first: u32, samples: u32) -> u32 {
    let run = (1u32 << count) - 1;
    (run << first | run >> (samples - first)) & ((1 << samples) - 1)
}

/// The samples in which a tree is its mesh: so many from one on that the lower bits of its dither choose.
pub fn mesh_mask(count: u32, dither_bits: u32, samples: u32) -> u32 {
    run_mask(count, dither_bits & (samples - 1), samples)
}

/// Samples that its z-field covers: so many of those that the mesh leaves.
pub fn rest_mask(covered: u32, count: u32, dither_bits: u32, samples: u32) -> u32 {
    let (rest, first) = ((samples - count).max(1), ((dither_bits & (samples - 1)) + count) & (samples - 1));
    let some = run_mask(covered.min(rest), (dither_bits >> 3) % rest, rest);
    (some << first | some >> (samples - first)) & ((1 << samples) - 1)
}

/// A tree's row of the combination table, packed as the shaders take it: column k holds a mask with k bits set.
pub type Row = [u32; 4];

/// The combination table: rows in which column k runs through every combination of k of `samples` bits equally often,
/// so that every sample is as likely as any other.
pub fn combination_table(samples: u32) -> Vec<Row> {
    let combinations: Vec<Vec<u32>> =
        (0..=samples).map(|k| (0u32..1 << samples).filter(|m| m.count_ones() == k).collect()).collect();
    let rows = combinations.iter().map(Vec::len).fold(1, lcm);
    (0..rows)
        .map(|r| {
            let mut row = [0u32; 4];
            for (k, masks) in combinations.iter().enumerate() {
                // Columns run at different strides through their combinations; coprime steps decorrelate them.
                let mask = masks[(r + r / masks.len()) % masks.len()];
                let bit = k as u32 * samples;
                row[(bit / 32) as usize] |= mask << (bit % 32);
            }
            row
        })
        .collect()
}

/// Column k of a row.
pub fn mask_column(row: &Row, k: u32, samples: u32) -> u32 {
    let bit = k * samples;
    (row[(bit / 32) as usize] >> (bit % 32)) & ((1 << samples) - 1)
}

fn lcm(a: usize, b: usize) -> usize {
    let (mut x, mut y) = (a, b);
    while y != 0 {
        (x, y) = (y, x % y);
    }
    a / x * b
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_combination_is_as_frequent_as_any_other() {
        for samples in [1, 4, 8] {
            let table = combination_table(samples);
            for k in 0..=samples {
                let mut seen = std::collections::BTreeMap::new();
                for row in &table {
                    let m = mask_column(row, k, samples);
                    assert_eq!(m.count_ones(), k);
                    *seen.entry(m).or_insert(0) += 1;
                }
                let first = *seen.values().next().unwrap();
                assert!(seen.values().all(|n| *n == first), "{samples} samples, {k} set: {seen:?}");
            }
        }
        assert_eq!(combination_table(4).len(), 12);
        assert_eq!(combination_table(8).len(), 280);
    }

    #[test]
    fn mesh_and_z_field_part_a_pixels_samples() {
        for samples in [1, 4, 8] {
            for count in 0..=samples {
                let mut seen = vec![[0u32; 2]; samples as usize];
                for bits in 0..1024 {
                    let mesh = mesh_mask(count, bits, samples);
                    assert_eq!(mesh.count_ones(), count);
                    let all = rest_mask(samples - count, count, bits, samples);
                    assert_eq!((mesh | all, mesh & all), ((1 << samples) - 1, 0), "{samples} {count} {bits}");
                    for covered in 0..=samples - count {
                        let rest = rest_mask(covered, count, bits, samples);
                        assert_eq!(
                            (rest.count_ones(), rest & mesh),
                            (covered, 0),
                            "{samples} {count} {bits}"
                        );
                    }
                    let one = if count < samples { rest_mask(1, count, bits, samples) } else { 0 };
                    for (k, seen) in seen.iter_mut().enumerate() {
                        *seen = [seen[0] + (mesh >> k & 1), seen[1] + (one >> k & 1)];
                    }
                }
                // Any sample is as likely as any other, to within what 128 remainders by 3, 5, 6 or 7 leave.
                let even = |k: usize| {
                    seen.iter().map(|s| s[k]).max().unwrap() - seen.iter().map(|s| s[k]).min().unwrap()
                };
                assert!(even(0) == 0 && even(1) <= 16, "{samples} {count}: {seen:?}");
            }
        }
    }

    #[test]
    fn expected_coverage_is_the_opacity() {
        for samples in [1, 4, 8] {
            for step in 0..=50 {
                let alpha = step as f32 / 50.0;
                let n = 4096;
                let mean = (0..n)
                    .map(|d| covered_samples(alpha, (d as f32 + 0.5) / n as f32, samples))
                    .sum::<u32>() as f64
                    / f64::from(n * samples);
                assert!((mean - f64::from(alpha)).abs() < 1.0 / f64::from(n), "{alpha} {mean}");
            }
        }
    }
}
