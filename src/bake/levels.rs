//! Levels of detail of a species' mesh: the order in which its leaves are thinned, coarser bark, and how much wider fewer leaves have to be
//! (`src/physics/levels.rs` has the laws by which they are chosen).

mod bark;
mod cards;
mod coverage;
pub(super) mod file;
mod nearest;
mod verify;

pub use bark::{BarkLevel, NewFace};
pub use cards::Cards;
pub use verify::{Agreement, LevelQuality, Seen, verify};

use glam::Vec3;

use super::surface::{Face, Surface};
use crate::physics::levels::{OCTAVES, card_scale};
use crate::scene::Mesh;

/// A species' levels of detail.
#[derive(Clone, Debug, PartialEq)]
pub struct Levels {
    /// Its leaves.
    pub cards: Cards,
    /// Factor of how far cards are from the middle of all leaves, at shares u of 1, 1/2, 1/4 and so on.
    pub pull: [f64; OCTAVES],
    /// Its bark, from the whole to the coarsest.
    pub bark: Vec<BarkLevel>,
}

impl Levels {
    /// Makes them; the same bits on any number of threads.
    pub fn new(mesh: &Mesh, surface: &Surface) -> Self {
        Levels::whole(mesh, surface).completed(surface)
    }

    /// What the whole is made coarser to.
    fn completed(mut self, surface: &Surface) -> Self {
        self.bark.extend(bark::simplified(surface, &self.bark[0].kept));
        self.pull = coverage::pull(surface, &self);
        self
    }

    /// The leaves' order, and the whole bark alone.
    fn whole(mesh: &Mesh, surface: &Surface) -> Self {
        let cards = Cards::new(mesh, surface);
        // Ranks of leaves are above 0.
        let kept = (0u32..).zip(&cards.rank).filter(|(_, rank)| **rank == 0.0).map(|(k, _)| k).collect();
        Levels { cards, pull: [1.0; OCTAVES], bark: vec![BarkLevel { kept, ..BarkLevel::default() }] }
    }

    /// The surface that is drawn of leaves at a share, pulled by a factor, and a level of bark; and of which face of the whole surface each has the
    /// surroundings.
    pub fn surface(&self, surface: &Surface, share: f64, pull: f64, bark: usize) -> (Surface, Vec<u32>) {
        let (mut faces, mut like) = (Vec::new(), Vec::new());
        for k in &self.cards.order {
            let rank = f64::from(self.cards.rank[*k as usize]);
            let scale = card_scale(rank, share) as f32;
            if scale > 0.0 {
                let (middle, face) = (self.cards.middle[*k as usize], &surface.faces[*k as usize]);
                let to = self.cards.centre + (middle - self.cards.centre) * pull as f32;
                let moved = |p: Vec3| if share < 1.0 { to + (p - middle) * scale } else { p };
                faces.push(Face { p: face.p.map(moved), ..*face });
                like.push(*k);
            }
        }
        let level = &self.bark[bark];
        faces.extend(level.kept.iter().map(|k| surface.faces[*k as usize]));
        faces.extend(level.new.iter().map(|n| n.face(surface)));
        like.extend(level.kept.iter().copied().chain(level.new.iter().map(|n| n.like)));
        (Surface { frame: surface.frame, faces, masks: surface.masks.clone() }, like)
    }

    /// How many triangles that are not the model's own all levels of bark have together.
    pub fn extra(&self) -> usize {
        self.bark.iter().map(|b| b.new.len()).sum()
    }
}

#[cfg(test)]
mod tests;
