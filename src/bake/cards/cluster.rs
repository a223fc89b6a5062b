//! Clusters of triangles that are near each other: k-means over their middles, weighed by area (Behrendt et al. 2005, section
//! 2.1), begun as k-means++ does (Arthur & Vassilvitskii 2007). The same clusters every time.

use glam::Vec3;
use rayon::prelude::*;

use crate::bake::surface::Surface;
use crate::physics::hash::Stream;

/// Rounds of moving middles, at most.
const ROUNDS: usize = 32;
const SEED: u32 = 0xbcf0_5001;

/// What a cluster knows of a triangle.
#[derive(Clone, Copy, Debug)]
pub struct Piece {
    /// Its middle, m.
    pub centre: Vec3,
    /// Its area, m².
    pub area: f32,
}

impl Piece {
    /// Of a face.
    pub fn new(surface: &Surface, face: u32) -> Self {
        let [a, b, c] = surface.faces[face as usize].p.map(|p| surface.frame.to_metres(p));
        Piece { centre: (a + b + c) / 3.0, area: 0.5 * (b - a).cross(c - a).length() }
    }
}

/// Members of each of at most `count` clusters, none of them empty, by index.
pub fn clusters(pieces: &[Piece], count: usize) -> Vec<Vec<u32>> {
    let count = count.min(pieces.len());
    if count == 0 {
        return Vec::new();
    }
    let mut middles = first_middles(pieces, count);
    let mut nearest = assign(pieces, &middles);
    for _ in 0..ROUNDS {
        let mut sums = vec![(Vec3::ZERO, 0.0f32); middles.len()];
        for (p, k) in pieces.iter().zip(&nearest) {
            let weight = p.area.max(f32::MIN_POSITIVE);
            sums[*k].0 += p.centre * weight;
            sums[*k].1 += weight;
        }
        for (middle, (sum, weight)) in middles.iter_mut().zip(sums).filter(|(_, s)| s.1 > 0.0) {
            *middle = sum / weight;
        }
        let next = assign(pieces, &middles);
        if next == nearest {
            break;
        }
        nearest = next;
    }
    let mut members = vec![Vec::new(); middles.len()];
    nearest.iter().enumerate().for_each(|(i, k)| members[*k].push(i as u32));
    members.retain(|m| !m.is_empty());
    members
}

/// Middles far from each other: each the next with a probability that grows with its area and squared distance from those before.
fn first_middles(pieces: &[Piece], count: usize) -> Vec<Vec3> {
    let mut random = Stream::new(SEED);
    let mut middles = Vec::with_capacity(count);
    let mut away = vec![1.0f32; pieces.len()];
    while middles.len() < count {
        let weight = |i: usize| f64::from(pieces[i].area) * f64::from(away[i]);
        let total: f64 = (0..pieces.len()).map(weight).sum();
        let mut left = random.unit() * total;
        let chosen = (0..pieces.len()).find(|i| {
            left -= weight(*i);
            left < 0.0
        });
        // Where all that is left lies on the middles there are, more would be empty.
        let Some(chosen) = chosen else { break };
        let middle = pieces[chosen].centre;
        let first = middles.is_empty();
        away.iter_mut().zip(pieces).for_each(|(d, p)| {
            let own = p.centre.distance_squared(middle);
            *d = if first { own } else { d.min(own) };
        });
        middles.push(middle);
    }
    if middles.is_empty() { vec![pieces[0].centre] } else { middles }
}

fn assign(pieces: &[Piece], middles: &[Vec3]) -> Vec<usize> {
    let nearest = |p: &Piece| {
        let near = |(k, m): (usize, &Vec3)| (p.centre.distance_squared(*m), k);
        middles.iter().enumerate().map(near).min_by(|a, b| a.0.total_cmp(&b.0)).map_or(0, |(_, k)| k)
    };
    pieces.par_iter().map(nearest).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_lies_apart_is_told_apart_and_nothing_is_lost() {
        let mut random = Stream::new(1);
        let spots =
            [Vec3::ZERO, Vec3::new(9.0, 0.0, 0.0), Vec3::new(0.0, 9.0, 3.0), Vec3::new(4.0, 4.0, 9.0)];
        let pieces: Vec<Piece> = (0..400)
            .map(|k| {
                let jitter = Vec3::new(random.unit() as f32, random.unit() as f32, random.unit() as f32);
                Piece { centre: spots[k % 4] + jitter, area: 0.1 + random.unit() as f32 }
            })
            .collect();
        let found = clusters(&pieces, 4);
        assert_eq!(found.len(), 4);
        for members in &found {
            assert_eq!(members.len(), 100);
            assert!(members.iter().all(|m| m % 4 == members[0] % 4));
        }
        assert_eq!(found, clusters(&pieces, 4));
        for count in [1, 7, 400, 1000] {
            let mut all: Vec<u32> = clusters(&pieces, count).concat();
            all.sort_unstable();
            assert!(all.iter().copied().eq(0..400), "{count}");
        }
    }

    #[test]
    fn pieces_that_are_all_in_one_place_are_one_cluster() {
        let same = [Piece { centre: Vec3::ONE, area: 0.0 }; 5];
        assert_eq!(clusters(&same, 3).concat().len(), 5);
        assert!(clusters(&[], 3).is_empty());
    }
}
