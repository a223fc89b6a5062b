//! Random numbers for growing trees: SplitMix64 (Steele, Lea, Flood, OOPSLA 2014), integers only until the last step.

/// A stream of random numbers.
pub(super) struct Random(u64);

impl Random {
    /// A stream of its own for each seed and purpose.
    pub fn new(seed: u32, purpose: u32) -> Self {
        let mut random = Random(u64::from(seed) << 32 | u64::from(purpose));
        // Neighbouring seeds start in neighbouring states: one step parts them.
        Random(random.next())
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in [0, 1).
    pub fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Uniform in [-variation, variation): what the paper writes as ±.
    pub fn around(&mut self, variation: f64) -> f64 {
        variation * (2.0 * self.unit() - 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_are_uniform_and_apart() {
        let draw = |seed, purpose| {
            let mut r = Random::new(seed, purpose);
            (0..1000).map(|_| r.unit()).collect::<Vec<_>>()
        };
        let a = draw(1, 0);
        assert!((a.iter().sum::<f64>() / 1000.0 - 0.5).abs() < 0.03);
        assert!(a.iter().all(|v| (0.0..1.0).contains(v)));
        assert_ne!(a, draw(2, 0));
        assert_ne!(a, draw(1, 1));
        assert_eq!(a, draw(1, 0));
    }
}
