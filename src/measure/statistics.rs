//! Statistics of samples: order statistics, bootstrap intervals, the Mann-Whitney test, correction for many tests.

use statrs::distribution::{ContinuousCDF, Normal};

use crate::physics::hash::hash;

/// Resamples of a bootstrap.
pub const RESAMPLES: u32 = 2000;

/// Order statistics of a set of samples, and how well its median is known.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Summary {
    /// Number of samples.
    pub count: u32,
    /// Median.
    pub median: f64,
    /// 5th percentile.
    pub p5: f64,
    /// 95th percentile.
    pub p95: f64,
    /// 99th percentile.
    pub p99: f64,
    /// Mean of the largest 1 % of the samples, at least one: the "1 % low" of frame rates, as a time.
    pub low_1_percent: f64,
    /// Median absolute deviation from the median, not scaled.
    pub mad: f64,
    /// 95 % interval of the median, from a bootstrap of blocks.
    pub interval: [f64; 2],
}

impl Summary {
    /// Of samples in the order in which they were taken; `None` without any. Samples taken one after the other are alike, so
    /// √n neighbours stay together in the bootstrap.
    pub fn new(samples: &[f64]) -> Option<Self> {
        if samples.is_empty() {
            return None;
        }
        let mut sorted = samples.to_vec();
        sorted.sort_by(f64::total_cmp);
        let middle = quantile(&sorted, 0.5);
        let block = (samples.len() as f64).sqrt().round() as usize;
        let worst = sorted.len().div_ceil(100);
        let tail = &sorted[sorted.len() - worst..];
        Some(Summary {
            count: samples.len() as u32,
            median: middle,
            p5: quantile(&sorted, 0.05),
            p95: quantile(&sorted, 0.95),
            p99: quantile(&sorted, 0.99),
            low_1_percent: tail.iter().sum::<f64>() / worst as f64,
            mad: median(&samples.iter().map(|x| (x - middle).abs()).collect::<Vec<_>>()),
            interval: block_bootstrap(samples, block, 0.95, median),
        })
    }
}

/// Quantile of ascending samples, interpolated (type 7 of Hyndman and Fan); NaN without any.
pub fn quantile(sorted: &[f64], q: f64) -> f64 {
    let Some(last) = sorted.len().checked_sub(1) else { return f64::NAN };
    let at = q.clamp(0.0, 1.0) * last as f64;
    let low = at.floor() as usize;
    let high = (low + 1).min(last);
    sorted[low] + (at - low as f64) * (sorted[high] - sorted[low])
}

/// Median of samples in any order; NaN without any.
pub fn median(samples: &[f64]) -> f64 {
    let mut sorted = samples.to_vec();
    sorted.sort_by(f64::total_cmp);
    quantile(&sorted, 0.5)
}

/// A sequence of random numbers, the same every time.
#[derive(Clone, Copy, Debug)]
pub struct Random {
    seed: u32,
    next: u32,
}

impl Random {
    /// The sequence of a seed.
    pub fn new(seed: u32) -> Self {
        Random { seed: hash(seed), next: 0 }
    }

    /// A whole number under `n`, which is not 0.
    pub fn below(&mut self, n: usize) -> usize {
        self.next = self.next.wrapping_add(1);
        let bits = hash(self.seed ^ hash(self.next));
        ((u64::from(bits) * n as u64) >> 32) as usize
    }

    /// A number from 0 to 1, neither included.
    pub fn unit(&mut self) -> f64 {
        (self.below(1 << 30) as f64 + 0.5) / (1u64 << 30) as f64
    }
}

/// Interval of a statistic at a confidence, from resampled blocks of neighbours (circular block bootstrap, percentiles).
pub fn block_bootstrap<T: Copy>(
    samples: &[T],
    block: usize,
    confidence: f64,
    statistic: impl Fn(&[T]) -> f64,
) -> [f64; 2] {
    let (n, block) = (samples.len(), block.clamp(1, samples.len().max(1)));
    let mut random = Random::new(n as u32);
    let mut found: Vec<f64> = (0..RESAMPLES)
        .map(|_| {
            let mut drawn = Vec::with_capacity(n + block);
            while drawn.len() < n {
                let first = random.below(n);
                drawn.extend((first..first + block).map(|k| samples[k % n]));
            }
            drawn.truncate(n);
            statistic(&drawn)
        })
        .collect();
    found.sort_by(f64::total_cmp);
    let tail = 0.5 * (1.0 - confidence);
    [quantile(&found, tail), quantile(&found, 1.0 - tail)]
}

/// Two-sided p of the Mann-Whitney test that neither set tends to larger values: exact for small sets without ties, else
/// the normal approximation with corrections for ties and continuity. 1 if either set is empty.
pub fn mann_whitney(a: &[f64], b: &[f64]) -> f64 {
    let (n, m) = (a.len(), b.len());
    if n == 0 || m == 0 {
        return 1.0;
    }
    let mut all: Vec<(f64, bool)> =
        a.iter().map(|x| (*x, true)).chain(b.iter().map(|x| (*x, false))).collect();
    all.sort_by(|x, y| x.0.total_cmp(&y.0));
    let (mut rank_sum, mut ties, mut k) = (0.0, 0.0, 0);
    while k < all.len() {
        let end = k + all[k..].iter().take_while(|x| x.0 == all[k].0).count();
        let (tied, rank) = ((end - k) as f64, 0.5 * (k + 1 + end) as f64);
        ties += tied * tied * tied - tied;
        rank_sum += rank * all[k..end].iter().filter(|x| x.1).count() as f64;
        k = end;
    }
    let (nf, mf) = (n as f64, m as f64);
    let u = rank_sum - 0.5 * nf * (nf + 1.0);
    let away = (u - 0.5 * nf * mf).abs();
    if ties == 0.0 && n * m <= 400 {
        return exact_two_sided(n, m, (0.5 * nf * mf + away).round() as usize);
    }
    let total = nf + mf;
    let variance = nf * mf / 12.0 * (total + 1.0 - ties / (total * (total - 1.0)));
    if variance <= 0.0 {
        return 1.0;
    }
    let z = (away - 0.5).max(0.0) / variance.sqrt();
    (2.0 * Normal::standard().sf(z)).min(1.0)
}

/// Two-sided p of U at least so large, by counting: the number of ways to get each U satisfies Mann and Whitney's recursion.
fn exact_two_sided(n: usize, m: usize, u: usize) -> f64 {
    let top = n * m;
    // ways[j][u]: arrangements of what is taken of the first set so far with j of the second.
    let mut ways = vec![vec![0.0f64; top + 1]; m + 1];
    ways.iter_mut().for_each(|w| w[0] = 1.0);
    for _ in 0..n {
        for j in 1..=m {
            // The largest is of the first set (it beats j of the second), or of the second.
            let row: Vec<f64> =
                (0..=top).map(|u| (if u >= j { ways[j][u - j] } else { 0.0 }) + ways[j - 1][u]).collect();
            ways[j] = row;
        }
    }
    let total: f64 = ways[m].iter().sum();
    let tail: f64 = ways[m][u.min(top)..].iter().sum();
    (2.0 * tail / total).min(1.0)
}

/// Two-sided p of Wilcoxon's signed ranks that differences of pairs tend to neither side: exact for up to 64 differences without
/// ties, else the normal approximation with continuity. Zeros are left out; 1 if nothing is left.
pub fn signed_rank(differences: &[f64]) -> f64 {
    let mut all: Vec<f64> = differences.iter().copied().filter(|d| *d != 0.0).collect();
    all.sort_by(|a, b| a.abs().total_cmp(&b.abs()));
    let n = all.len();
    if n == 0 {
        return 1.0;
    }
    let (mut plus, mut ties, mut k) = (0.0, 0.0, 0);
    while k < n {
        let end = k + all[k..].iter().take_while(|d| d.abs() == all[k].abs()).count();
        let (tied, rank) = ((end - k) as f64, 0.5 * (k + 1 + end) as f64);
        ties += tied * tied * tied - tied;
        plus += rank * all[k..end].iter().filter(|d| **d > 0.0).count() as f64;
        k = end;
    }
    let nf = n as f64;
    let total = nf * (nf + 1.0) / 2.0;
    let away = (plus - 0.5 * total).abs();
    if ties == 0.0 && n <= 64 {
        // Probability of each sum of ranks: every rank is in it or not.
        let mut p = vec![0.0f64; total as usize + 1];
        p[0] = 1.0;
        for rank in 1..=n {
            for sum in (0..p.len()).rev() {
                p[sum] = 0.5 * (p[sum] + if sum >= rank { p[sum - rank] } else { 0.0 });
            }
        }
        let from = (0.5 * total + away).round() as usize;
        return (2.0 * p[from..].iter().sum::<f64>()).min(1.0);
    }
    let variance = total * (2.0 * nf + 1.0) / 12.0 - ties / 48.0;
    (2.0 * Normal::standard().sf((away - 0.5).max(0.0) / variance.sqrt())).min(1.0)
}

/// Holm's correction: each p as it must be compared with the level for the family's error to stay under it.
pub fn holm(p: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..p.len()).collect();
    order.sort_by(|a, b| p[*a].total_cmp(&p[*b]));
    let mut corrected = vec![1.0; p.len()];
    let mut least = 0.0f64;
    for (k, &i) in order.iter().enumerate() {
        least = least.max((p.len() - k) as f64 * p[i]).min(1.0);
        corrected[i] = least;
    }
    corrected
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn order_statistics_of_a_known_set() {
        let samples: Vec<f64> = (0..=100).rev().map(f64::from).collect();
        let s = Summary::new(&samples).unwrap();
        assert_eq!((s.count, s.median, s.p5, s.p95, s.p99), (101, 50.0, 5.0, 95.0, 99.0));
        // Two samples are the largest 1 % of 101; deviations from 50 are 0, 1, 1, 2, 2 … 50, 50.
        assert_eq!((s.low_1_percent, s.mad), (99.5, 25.0));
        assert!(s.interval[0] < 50.0 && s.interval[1] > 50.0);
        assert_eq!(Summary::new(&[]), None);
        let one = Summary::new(&[3.0]).unwrap();
        assert_eq!((one.median, one.mad, one.interval), (3.0, 0.0, [3.0, 3.0]));
    }

    /// p of complete separation is 2 / C(n + m, n): 2/20, 2/252, 2/12870. Published: U = 10 of 8 and 8 has p = 0.0207.
    #[test]
    fn mann_whitney_matches_closed_values() {
        let up = |from: usize, n: usize| (from..from + n).map(|x| x as f64).collect::<Vec<_>>();
        for (n, ways) in [(3, 20.0), (5, 252.0), (8, 12870.0)] {
            let p = mann_whitney(&up(0, n), &up(n, n));
            assert!((p - 2.0 / ways).abs() < 1e-12, "{n}: {p}");
        }
        // Sums of ranks of 46 and 90: U = 10.
        let a = [1.0, 2.0, 3.0, 4.0, 5.0, 8.0, 9.0, 14.0];
        let b = [6.0, 7.0, 10.0, 11.0, 12.0, 13.0, 15.0, 16.0];
        assert_eq!(a.iter().sum::<f64>(), 46.0);
        assert!((mann_whitney(&a, &b) - 0.0207).abs() < 5e-5, "{}", mann_whitney(&a, &b));
        assert_eq!(mann_whitney(&[1.0; 30], &[1.0; 30]), 1.0);
        assert_eq!(mann_whitney(&[], &[1.0]), 1.0);
    }

    /// The approximation for large sets joins the exact values at its border, to a tenth of p.
    #[test]
    fn approximation_and_exact_values_agree() {
        let a: Vec<f64> = (0..20).map(|k| f64::from(k * 2)).collect();
        let b: Vec<f64> = (0..20).map(|k| f64::from(k * 2) + 9.1).collect();
        let exact = mann_whitney(&a, &b);
        let mut b21 = b.clone();
        b21.push(28.05);
        let approximate = mann_whitney(&a, &b21);
        assert!((approximate / exact - 1.0).abs() < 0.1, "{exact} {approximate}");
    }

    /// Over many sets of one distribution, one in twenty gives p under 0.05: 2000 draws have a standard error of 0.5 %.
    #[test]
    fn mann_whitney_errs_as_often_as_it_says() {
        let mut random = Random::new(1);
        let mut draw = |n: usize| (0..n).map(|_| random.unit()).collect::<Vec<_>>();
        let wrong = (0..2000).filter(|_| mann_whitney(&draw(12), &draw(12)) < 0.05).count();
        assert!((60..=120).contains(&wrong), "{wrong} of 2000");
    }

    /// All of n differences positive: 2 / 2^n. Published: W = 8 of 10 pairs has p = 0.0488.
    #[test]
    fn signed_ranks_match_closed_values() {
        let all: Vec<f64> = (1..=10).map(f64::from).collect();
        assert!((signed_rank(&all) - 2.0 / 1024.0).abs() < 1e-12);
        let some: Vec<f64> = all.iter().map(|d| if [1.0, 7.0].contains(d) { -d } else { *d }).collect();
        assert!((signed_rank(&some) - 0.048828).abs() < 1e-6, "{}", signed_rank(&some));
        let many: Vec<f64> = (1..=64).map(|k| f64::from(if k % 3 == 0 { -k } else { k })).collect();
        let mut tied = many.clone();
        tied.push(0.0);
        tied[0] = 2.0;
        assert!(
            (signed_rank(&tied) / signed_rank(&many) - 1.0).abs() < 0.1,
            "approximation joins exact values"
        );
        assert_eq!(signed_rank(&[0.0, 0.0]), 1.0);
    }

    #[test]
    fn holm_matches_the_textbook() {
        assert_eq!(holm(&[0.01, 0.04, 0.03, 0.005]), vec![0.03, 0.06, 0.06, 0.02]);
        assert_eq!(holm(&[0.9, 0.8]), vec![1.0, 1.0]);
        assert!(holm(&[]).is_empty());
    }

    /// Of normal samples the 95 % interval of the median holds the true one in 95 % of cases; a bootstrap's is a little narrow.
    #[test]
    fn bootstrap_intervals_cover() {
        let mut random = Random::new(7);
        let mut covered = 0;
        for _ in 0..200 {
            let samples: Vec<f64> =
                (0..40).map(|_| (0..12).map(|_| random.unit()).sum::<f64>() - 6.0).collect();
            let [low, high] = block_bootstrap(&samples, 1, 0.95, median);
            covered += usize::from(low <= 0.0 && high >= 0.0);
        }
        assert!((180..=198).contains(&covered), "{covered} of 200");
    }
}
