//! The oriented box of least volume around points, and the cards through it (Behrendt et al. 2005, section 2.2).

use glam::{Mat3, Vec3};

use super::Card;

/// Steps by which a box is turned, degrees: each as long as it makes the box smaller.
const STEPS: [f32; 6] = [24.0, 12.0, 6.0, 3.0, 1.5, 0.75];
/// No side counts as shorter than this part of all of the box, so that flat things have a best box too.
const LEAST: f32 = 1e-3;

/// A box: its sides are along three orthogonal unit vectors, the longest first.
#[derive(Clone, Copy, Debug)]
pub struct OrientedBox {
    /// Its middle, m.
    pub centre: Vec3,
    /// Directions of its sides.
    pub axes: [Vec3; 3],
    /// Half their lengths, m.
    pub half: [f32; 3],
}

impl OrientedBox {
    /// Turns boxes about their axes, by less and less, for as long as they become smaller, from several directions on; the smallest.
    pub fn around(points: &[Vec3]) -> Self {
        let starts = [
            Mat3::IDENTITY,
            Mat3::from_rotation_x(0.7),
            Mat3::from_rotation_y(0.7) * Mat3::from_rotation_z(0.4),
            Mat3::from_rotation_z(0.8) * Mat3::from_rotation_x(-0.5),
        ];
        let found = starts.map(|start| descend(points, start));
        let best = found.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)).map_or(Mat3::IDENTITY, |f| f.1);
        let (centre, half) = extent(points, best);
        let mut order = [0, 1, 2];
        order.sort_by(|a, b| half[*b].total_cmp(&half[*a]));
        OrientedBox { centre, axes: order.map(|i| best.col(i)), half: order.map(|i| half[i]) }
    }

    /// Pairs of sides along which there are cards: of the two longest, and of others if the root of their product is more than f
    /// times the third side.
    fn pairs(&self, f: f32) -> impl Iterator<Item = [usize; 2]> {
        let [a, b, c] = self.half;
        [([0, 1], a * b, c), ([0, 2], a * c, b), ([1, 2], b * c, a)]
            .into_iter()
            .enumerate()
            .filter(move |(k, (_, product, third))| *k == 0 || product.sqrt() > f * third)
            .map(|(_, (sides, ..))| sides)
    }

    /// How many cards it has.
    pub fn card_count(&self, f: f32) -> usize {
        self.pairs(f).count()
    }

    /// The cards, of some faces.
    pub fn cards(&self, f: f32, faces: &[u32]) -> Vec<Card> {
        let side = |k: usize| self.axes[k] * self.half[k];
        let card = |[r, u]: [usize; 2]| Card {
            centre: self.centre,
            right: side(r),
            up: side(u),
            faces: faces.to_vec(),
        };
        self.pairs(f).map(card).collect()
    }
}

/// Middle and half sides of the box with these axes.
fn extent(points: &[Vec3], axes: Mat3) -> (Vec3, [f32; 3]) {
    let back = axes.transpose();
    let inside = points.iter().map(|p| back * *p);
    let (low, high) = inside.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(l, h), p| (l.min(p), h.max(p)));
    if points.is_empty() {
        return (Vec3::ZERO, [0.0; 3]);
    }
    (axes * (0.5 * (low + high)), (0.5 * (high - low)).to_array())
}

/// The volume, for comparing.
fn volume(points: &[Vec3], axes: Mat3) -> f32 {
    let half = Vec3::from(extent(points, axes).1);
    (half + LEAST * half.length()).to_array().iter().product()
}

fn descend(points: &[Vec3], start: Mat3) -> (f32, Mat3) {
    let mut best = (volume(points, start), start);
    for step in STEPS {
        let angle = step.to_radians();
        loop {
            let turns = [Vec3::X, Vec3::Y, Vec3::Z]
                .into_iter()
                .flat_map(|axis| [angle, -angle].map(|a| best.1 * Mat3::from_axis_angle(axis, a)));
            let next = turns.map(|axes| (volume(points, axes), axes)).min_by(|a, b| a.0.total_cmp(&b.0));
            match next {
                Some(next) if next.0 < 0.999 * best.0 => best = next,
                _ => break,
            }
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::hash::Stream;

    /// Points in a box that is turned and moved.
    fn within(half: Vec3, turn: Mat3) -> Vec<Vec3> {
        let mut random = Stream::new(4);
        let mut side = || 2.0 * random.unit() as f32 - 1.0;
        let inner = (0..400).map(|_| Vec3::new(side(), side(), side())).collect::<Vec<_>>();
        let corners = (0..8).map(|k| Vec3::from([0, 1, 2].map(|b| if k >> b & 1 == 0 { -1.0 } else { 1.0 })));
        inner.into_iter().chain(corners).map(|p| turn * (p * half) + Vec3::new(3.0, -2.0, 7.0)).collect()
    }

    #[test]
    fn the_box_of_a_box_is_that_box() {
        for (k, half) in
            [Vec3::new(3.0, 2.0, 1.0), Vec3::new(5.0, 0.4, 0.3), Vec3::new(2.0, 1.5, 0.0)].iter().enumerate()
        {
            let turn = Mat3::from_rotation_z(0.3 + k as f32) * Mat3::from_rotation_x(0.9);
            let found = OrientedBox::around(&within(*half, turn));
            // Turned by half of the last step at most about each axis: a side grows by as many radians of the others.
            let off = 0.5f32.to_radians() * half.element_sum();
            let near = found.half.iter().zip(half.to_array()).all(|(a, b)| (a - b).abs() < 0.01 + off);
            assert!(near, "{half}: {:?}", found.half);
            assert!(
                (found.centre - Vec3::new(3.0, -2.0, 7.0)).length() < 0.01 + off,
                "{half}: {}",
                found.centre
            );
        }
    }

    #[test]
    fn flat_long_and_round_clusters_have_one_two_and_three_cards() {
        let count = |half: [f32; 3]| {
            OrientedBox { centre: Vec3::ZERO, axes: [Vec3::X, Vec3::Y, Vec3::Z], half }.card_count(0.5)
        };
        assert_eq!([count([3.0, 2.9, 0.2]), count([5.0, 1.0, 0.9]), count([1.0, 0.9, 0.8])], [1, 2, 3]);
        assert_eq!(count([1.0, 0.0, 0.0]), 1);
    }
}
