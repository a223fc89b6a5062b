//! Integer hashes; twin of `shaders/physics/hash.glsl`, equal to the bit.

/// PCG output permutation (Jarzynski & Olano 2020, "Hash Functions for GPU Rendering").
pub fn hash(v: u32) -> u32 {
    let s = v.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
    let w = ((s >> ((s >> 28) + 4)) ^ s).wrapping_mul(277_803_737);
    (w >> 22) ^ w
}

/// Hash of a pair, order matters.
pub fn hash2(a: u32, b: u32) -> u32 {
    hash(a.wrapping_add(hash(b)))
}

/// Uniform in [0, 1), exact multiples of 2⁻²⁴.
pub fn unit(h: u32) -> f32 {
    (h >> 8) as f32 * (1.0 / 16_777_216.0)
}

/// Purpose of a tree's random number: how its opacity rounds to samples and shadows.
pub const HASH_DITHER: u32 = 0x7feb_352d;
/// Purpose of a tree's random number: when it fades.
pub const HASH_FADE: u32 = 0x846c_a68b;

/// A stream of hashes, for patterns made on the CPU.
#[derive(Clone, Debug)]
pub struct Stream {
    key: u32,
    count: u32,
}

impl Stream {
    /// The stream of a key; different keys are independent.
    pub fn new(key: u32) -> Self {
        Stream { key: hash(key ^ 0x9e37_79b9), count: 0 }
    }

    /// Next 32 bits.
    pub fn bits(&mut self) -> u32 {
        self.count = self.count.wrapping_add(1);
        hash2(self.key, self.count)
    }

    /// Next uniform number in [0, 1).
    pub fn unit(&mut self) -> f64 {
        f64::from(unit(self.bits()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_uniform_and_purposes_uncorrelated() {
        let n = 1 << 16;
        let (mut sum, mut product) = (0.0, 0.0);
        for k in 0..n {
            let id = hash2(7, k);
            let (a, b) = (f64::from(unit(hash(id ^ 0x51ed_270b))), f64::from(unit(hash(id ^ 0x2c1b_3c6d))));
            assert!((0.0..1.0).contains(&a));
            sum += a;
            product += (a - 0.5) * (b - 0.5);
        }
        let n = f64::from(n);
        // Standard errors: 1/sqrt(12 n) = 0.0011 and 1/(12 sqrt n) = 0.00033; five of them.
        assert!((sum / n - 0.5).abs() < 0.0057, "{}", sum / n);
        assert!((product / n).abs() < 0.0017, "{}", product / n);
    }
}
