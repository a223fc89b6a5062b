//! Weighted means on a grid of texels and on coarser ones, without holes.

/// Sums of N numbers, and their weights.
pub struct Means<const N: usize> {
    size: [usize; 2],
    texels: Vec<([f32; N], f32)>,
}

impl<const N: usize> Means<N> {
    /// Nothing yet.
    pub fn new(size: [u32; 2]) -> Self {
        let size = size.map(|n| n as usize);
        Means { size, texels: vec![([0.0; N], 0.0); size[0] * size[1]] }
    }

    /// Adds numbers of a weight of 1 to a texel.
    pub fn add(&mut self, [x, y]: [u32; 2], numbers: [f32; N]) {
        self.merge(y as usize * self.size[0] + x as usize, (numbers, 1.0));
    }

    fn merge(&mut self, texel: usize, (numbers, weight): ([f32; N], f32)) {
        let (sums, weights) = &mut self.texels[texel];
        sums.iter_mut().zip(numbers).for_each(|(s, x)| *s += x);
        *weights += weight;
    }

    /// A grid of half as many texels a side, rounded up.
    fn halved(&self) -> Self {
        let mut half = Means::new(self.size.map(|n| n.div_ceil(2) as u32));
        for (k, texel) in self.texels.iter().enumerate() {
            half.merge(k / self.size[0] / 2 * half.size[0] + k % self.size[0] / 2, *texel);
        }
        half
    }

    /// The means of every level, the finest first and down to one texel. What has no weight takes what the next level has there.
    pub fn filled(self) -> Vec<Vec<[f32; N]>> {
        let mut levels = vec![self];
        while levels[levels.len() - 1].texels.len() > 1 {
            levels.push(levels[levels.len() - 1].halved());
        }
        let mut all: Vec<Vec<[f32; N]>> = Vec::new();
        for level in levels.iter().rev() {
            let (width, wide) = (level.size[0], level.size[0].div_ceil(2));
            let coarser = |k: usize| all.last().map_or([0.0; N], |c| c[k / width / 2 * wide + k % width / 2]);
            let mean = |(k, (sums, weight)): (usize, &([f32; N], f32))| match *weight > 0.0 {
                true => sums.map(|s| s / weight),
                false => coarser(k),
            };
            let filled = level.texels.iter().enumerate().map(mean).collect();
            all.push(filled);
        }
        all.reverse();
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn holes_take_what_is_near_and_means_are_weighted() {
        let mut means = Means::new([5, 3]);
        means.add([0, 0], [1.0]);
        means.add([0, 0], [2.0]);
        means.add([1, 1], [6.0]);
        means.add([4, 2], [-7.0]);
        let levels = means.filled();
        assert_eq!(levels.iter().map(Vec::len).collect::<Vec<_>>(), [15, 6, 2, 1]);
        // By hand: (1 + 2 + 6)/3 in the corner; next to what is there; a mean over all at the end.
        assert_eq!(levels[1], [[3.0], [3.0], [-7.0], [3.0], [3.0], [-7.0]]);
        assert_eq!(levels[0][..6], [[1.5], [3.0], [3.0], [3.0], [-7.0], [3.0]]);
        assert_eq!(levels[0][6..8], [[6.0], [3.0]]);
        assert_eq!(levels[3], [[0.5]]);
    }
}
