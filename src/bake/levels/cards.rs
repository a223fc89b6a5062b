//! The order in which a tree's leaves are thinned.

use glam::Vec3;

use crate::bake::envelope::leaves;
use crate::bake::surface::{Face, Surface};
use crate::physics::hash::Stream;
use crate::scene::Mesh;

/// Key of the shuffle.
const SHUFFLE: u32 = 0x1eaf;

/// What hangs together is a card up to this radius, as a part of the tree's half width; of what is larger each face is its own.
const LARGEST: f32 = 0.3;

/// Cards of leaves: faces of foliage that hang together.
#[derive(Clone, Debug, PartialEq)]
pub struct Cards {
    /// Faces that are leaves, card after card in the shuffled order, those of a card as in the model.
    pub order: Vec<u32>,
    /// Of every face of the surface the rank of its card in that order, in (0, 1): share of all leaf area before it and half of its own. 0 of bark.
    pub rank: Vec<f32>,
    /// Of every face the middle of its card by area, in scaled tree space. Of bark 0.
    pub middle: Vec<Vec3>,
    /// Middle of all leaves by their area, in scaled tree space.
    pub centre: Vec3,
    /// Cards.
    pub count: usize,
    /// Side of a square of a card's mean area, m.
    pub side: f64,
}

impl Cards {
    /// Shuffles the leaves of a surface.
    pub fn new(mesh: &Mesh, surface: &Surface) -> Self {
        let (card_of, cards) = leaves(mesh, surface, LARGEST);
        let mut faces = vec![Vec::new(); cards];
        for (face, card) in (0u32..).zip(&card_of) {
            if let Some(card) = card {
                faces[*card as usize].push(face);
            }
        }
        let areas: Vec<f64> = faces
            .iter()
            .map(|f| f.iter().map(|k| area(surface, &surface.faces[*k as usize])).sum())
            .collect();
        let all = areas.iter().sum::<f64>().max(f64::MIN_POSITIVE);
        let count = surface.faces.len();
        let mut all_cards = Cards {
            order: Vec::new(),
            rank: vec![0.0; count],
            middle: vec![Vec3::ZERO; count],
            centre: middle(surface, &faces.concat()),
            count: cards,
            side: (all / cards.max(1) as f64).sqrt(),
        };
        let mut before = 0.0;
        for card in shuffled(cards) {
            let rank = (before + 0.5 * areas[card]) / all;
            before += areas[card];
            let middle = middle(surface, &faces[card]);
            for face in &faces[card] {
                all_cards.rank[*face as usize] = rank as f32;
                all_cards.middle[*face as usize] = middle;
            }
            all_cards.order.extend(&faces[card]);
        }
        all_cards
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
