//! Directions in which a leaf knows the foliage around it.

use super::dot;

/// Directions over the whole sphere, and what part of it each stands for.
#[derive(Clone, Debug)]
pub struct Directions {
    /// Unit vectors.
    pub to: Vec<[f64; 3]>,
    /// Weights; their sum is 1.
    pub weights: Vec<f64>,
    /// Power of the cosine by which they count for directions between them: as wide a lobe as they are apart.
    pub power: i32,
}

impl Directions {
    /// How many there may be.
    pub const COUNTS: [usize; 3] = [8, 14, 26];

    /// The corners of a cube (8: BBP08 eq. 26), with the middles of its faces (14), with the middles of its edges (26), by the weights of
    /// Lebedev's rules (Lebedev 1976): exact for polynomials of degree 3, 5 and 7. `None` for another number.
    pub fn new(count: usize) -> Option<Self> {
        // Of a corner, a face and an edge; directions are 70.5, 54.7 and 35.3 to 45 degrees apart.
        let (corner, face, edge, power) = match count {
            8 => (1.0 / 8.0, 0.0, 0.0, 1),
            14 => (3.0 / 40.0, 1.0 / 15.0, 0.0, 2),
            26 => (9.0 / 280.0, 1.0 / 21.0, 4.0 / 105.0, 6),
            _ => return None,
        };
        let (mut to, mut weights) = (Vec::new(), Vec::new());
        // Corners first, so that the first eight are the paper's, in its order: x changes fastest.
        for (zeros, weight) in [(0, corner), (2, face), (1, edge)] {
            for k in 0..27 {
                let digits = [k % 3, k / 3 % 3, k / 9].map(|d| f64::from(d) - 1.0);
                let length = dot(digits, digits).sqrt();
                if digits.iter().filter(|d| **d == 0.0).count() == zeros && weight > 0.0 {
                    to.push(digits.map(|d| d / length));
                    weights.push(weight);
                }
            }
        }
        Some(Directions { to, weights, power })
    }

    /// How many there are.
    #[allow(clippy::len_without_is_empty)]
    pub fn len(&self) -> usize {
        self.to.len()
    }

    /// Of each direction's cell of the sphere, the directions that are nearest to it, what is above the horizon (or below it): the integral of its
    /// unit vectors over the sphere's area, so that a surface of normal n faces it with n · that.
    pub fn half(&self, above: bool) -> Vec<[f64; 3]> {
        let (mut cells, n) = (vec![[0.0; 3]; self.len()], 8192);
        for k in 0..n {
            // Even over the sphere: equal steps of height, turned by the golden angle.
            let (z, angle) =
                (1.0 - (2.0 * f64::from(k) + 1.0) / f64::from(n), f64::from(k) * 2.399_963_229_728_653);
            let radius = (1.0 - z * z).sqrt();
            let w = [radius * angle.cos(), radius * angle.sin(), z];
            if (z > 0.0) == above {
                let cell: &mut [f64; 3] = &mut cells[self.nearest(w)];
                cell.iter_mut().zip(w).for_each(|(sum, x)| *sum += x / f64::from(n));
            }
        }
        cells
    }

    /// Which is nearest to a direction.
    pub fn nearest(&self, w: [f64; 3]) -> usize {
        let mut best = (0, f64::NEG_INFINITY);
        for (k, to) in self.to.iter().enumerate() {
            let cosine = dot(w, *to);
            if cosine > best.1 {
                best = (k, cosine);
            }
        }
        best.0
    }
}
