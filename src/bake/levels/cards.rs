//! The order in which a tree's leaves are thinned.

use glam::Vec3;

use super::super::envelope::Parts;
use super::super::surface::{Face, Surface};
use crate::physics::hash::Stream;

/// Key of the shuffle.
const SHUFFLE: u32 = 0x1eaf;

/// Cards of leaves: faces of foliage that hang together ([`Parts`]; of what is larger than a leaf each face is its own).
#[derive(Clone, Debug, PartialEq)]
pub struct Cards {
    /// Faces that are leaves, card after card in the shuffled order, those of a card as in the model.
    pub order: Vec<u32>,
    /// Of every face of the surface the rank of its card in that order, in (0, 1): share of all leaf area before it and half of its own. 0 of bark.
    pub rank: Vec<f32>,
    /// Of every face the middle of its card by area, in scaled tree space. Of bark 0.
    pub middle: Vec<Vec3>,
    /// Cards.
    pub count: usize,
    /// Side of a square of a card's mean area, m.
    pub side: f64,
}

impl Cards {
    /// Shuffles the leaves of a surface.
    pub fn new(surface: &Surface, parts: &Parts) -> Self {
        let mut faces = vec![Vec::new(); parts.leaves];
        for (face, part) in parts.of.iter().enumerate().filter(|(_, part)| (**part as usize) < parts.leaves) {
            faces[*part as usize].push(face as u32);
        }
        let areas: Vec<f64> = faces
            .iter()
            .map(|f| f.iter().map(|k| area(surface, &surface.faces[*k as usize])).sum())
            .collect();
        let all = areas.iter().sum::<f64>().max(f64::MIN_POSITIVE);
        let count = surface.faces.len();
        let mut cards = Cards {
            order: Vec::new(),
            rank: vec![0.0; count],
            middle: vec![Vec3::ZERO; count],
            count: parts.leaves,
            side: (all / parts.leaves.max(1) as f64).sqrt(),
        };
        let mut before = 0.0;
        for card in shuffled(parts.leaves) {
            let rank = (before + 0.5 * areas[card]) / all;
            before += areas[card];
            let middle = middle(surface, &faces[card]);
            for face in &faces[card] {
                cards.rank[*face as usize] = rank as f32;
                cards.middle[*face as usize] = middle;
            }
            cards.order.extend(&faces[card]);
        }
        cards
    }
}

/// 0 to `count` in an order that depends on the count alone (Fisher and Yates).
fn shuffled(count: usize) -> Vec<usize> {
    let mut all: Vec<usize> = (0..count).collect();
    let mut stream = Stream::new(SHUFFLE);
    for k in (1..count).rev() {
        all.swap(k, ((k + 1) as f64 * stream.unit()) as usize);
    }
    all
}

/// Area of a face, m².
fn area(surface: &Surface, face: &Face) -> f64 {
    let [a, b, c] = face.p.map(|p| p * surface.frame.scale());
    0.5 * f64::from((b - a).cross(c - a).length())
}

/// Middle of some faces by their area.
fn middle(surface: &Surface, faces: &[u32]) -> Vec3 {
    let (mut sum, mut all) = (Vec3::ZERO, 1e-30f32);
    for face in faces.iter().map(|k| &surface.faces[*k as usize]) {
        let area = area(surface, face) as f32;
        sum += face.p.iter().sum::<Vec3>() * (area / 3.0);
        all += area;
    }
    sum / all
}
