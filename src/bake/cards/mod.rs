//! Billboard clouds (Behrendt et al. 2005, section 2): a tree as a few dozen textured cards.
//!
//! A model's triangles are put together into clusters of near ones, bark and leaves apart; each cluster gets the box of least
//! volume around it, and one, two or three cards through the box's middle, on which all of the cluster is painted.
//!
//! [`cloud`] writes that as a model like any other, with one texture of leaves and one of bark; [`CardCloud`] has both sides of each
//! card with what a renderer needs to light it.

mod artefact;
mod atlas;
mod boxes;
mod cluster;
pub(super) mod file;
mod means;
mod paint;
mod picture;
mod seen;
mod verify;

use glam::{Vec2, Vec3};
use image::RgbaImage;
use rayon::prelude::*;

use super::surface::Surface;
use crate::scene::Mesh;
use crate::settings::Settings;
use crate::tree::export::{self, Part};
use crate::{Error, Result};
use atlas::Atlas;
use boxes::OrientedBox;
use cluster::Piece;
use paint::Painted;

pub use artefact::{CardCloud, CloudCard, FAR};
pub use verify::{CardQuality, verify};

/// Shares of all clusters that bark has at least and at most: a trunk is little area and much of what one looks at.
const BARK: [f64; 2] = [0.15, 0.4];

/// What is asked of a cloud.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CardSettings {
    /// Most cards.
    pub cards: u32,
    /// Texels along the height of the tree.
    pub texels: u32,
    /// f: a box has a second and third card if the root of the product of the sides along it is more than f times the third side.
    pub flatness: f32,
}

/// What is asked of a cloud for a renderer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CloudSettings {
    /// Most cards of the full cloud.
    pub cards: u32,
    /// Texels a side of the atlas that all pictures are in, a multiple of 8.
    pub atlas: u32,
}

impl From<&Settings> for CloudSettings {
    fn from(s: &Settings) -> Self {
        CloudSettings { cards: s.cards, atlas: s.card_atlas }
    }
}

/// f of clouds for a renderer, as Behrendt et al. 2005 have it.
const FLATNESS: f32 = 0.5;

/// A card: a rectangle about its centre, m.
#[derive(Clone, Debug)]
struct Card {
    /// Its middle.
    centre: Vec3,
    /// From there to the middle of its right edge.
    right: Vec3,
    /// And of its upper one.
    up: Vec3,
    /// Faces of the model that are painted on it.
    faces: Vec<u32>,
}

/// A cloud of cards as a model.
pub struct Cloud {
    /// Clusters of bark and of leaves.
    pub clusters: [usize; 2],
    /// Cards of bark and of leaves.
    pub cards: [usize; 2],
    /// Texels of the atlas of each, 0 where there is none.
    pub texels: [[u32; 2]; 2],
    /// The model, as binary glTF 2.0.
    pub glb: Vec<u8>,
    /// Its materials that are leaves: bark has holes too, and so would count as leaves.
    pub foliage: Vec<String>,
}

/// Makes a model of a cloud of a model.
///
/// # Errors
/// [`Error::Usage`] for a model without extent, and where the cards do not fit into a texture.
pub fn cloud(mesh: &Mesh, settings: CardSettings) -> Result<Cloud> {
    let surface = Surface::new(mesh)?;
    let boxes = clusters_for(&surface, &parted(mesh, &surface), settings.cards, settings.flatness);
    let texel = 2.0 * surface.frame.half_height / settings.texels as f32;
    let mut out =
        Cloud { clusters: [0; 2], cards: [0; 2], texels: [[0; 2]; 2], glb: Vec::new(), foliage: Vec::new() };
    let mut drawn = Vec::new();
    for (k, clusters) in boxes.iter().enumerate() {
        let cards: Vec<Card> =
            clusters.iter().flat_map(|(b, faces)| b.cards(settings.flatness, faces)).collect();
        (out.clusters[k], out.cards[k]) = (clusters.len(), cards.len());
        if cards.is_empty() {
            continue;
        }
        let picture = |c| Painted::new(&surface, c, texel).picture(mesh, &surface);
        let pictures: Vec<RgbaImage> = cards.par_iter().map(picture).collect();
        let atlas = Atlas::new(&pictures).ok_or_else(|| do_not_fit(cards.len(), settings))?;
        let name = ["bark", "leaf"][k];
        if k == 1 {
            out.foliage.push(name.into());
        }
        out.texels[k] = [atlas.image.width(), atlas.image.height()];
        drawn.push((name, atlas.surface(&cards), atlas.image));
    }
    let parts = drawn.iter().map(|(name, surface, image)| Part { name, surface, image, cutout: true });
    out.glb = export::glb(&parts.collect::<Vec<_>>());
    Ok(out)
}

fn do_not_fit(cards: usize, settings: CardSettings) -> Error {
    Error::Usage(format!(
        "{cards} cards of {} texels along the tree do not fit into a texture: fewer of either",
        settings.texels
    ))
}

/// Whether a face is a leaf's, as against bark. Without foliage all stand for leaves, as where trees are meshes.
fn is_leaf(mesh: &Mesh, surface: &Surface, face: u32) -> bool {
    let any = mesh.materials.iter().any(|m| m.foliage);
    !any || mesh.materials[surface.faces[face as usize].material as usize].foliage
}

/// Faces of bark, and those of leaves.
fn parted(mesh: &Mesh, surface: &Surface) -> [Vec<u32>; 2] {
    let of = |leaves: bool| -> Vec<u32> {
        let is = |f: &u32| is_leaf(mesh, surface, *f) == leaves;
        (0..surface.faces.len() as u32).filter(is).collect()
    };
    [of(false), of(true)]
}

/// Clusters of bark and of leaves, as many as have no more than so many cards, each with its box.
fn clusters_for(
    surface: &Surface,
    parts: &[Vec<u32>; 2],
    most: u32,
    flatness: f32,
) -> [Vec<(OrientedBox, Vec<u32>)>; 2] {
    let pieces =
        parts.each_ref().map(|faces| faces.iter().map(|f| Piece::new(surface, *f)).collect::<Vec<_>>());
    let area = pieces.each_ref().map(|p| p.iter().map(|p| f64::from(p.area)).sum::<f64>());
    let share = match parts.each_ref().map(Vec::is_empty) {
        [true, _] => 0.0,
        [_, true] => 1.0,
        _ => (area[0] / (area[0] + area[1]).max(1e-12)).clamp(BARK[0], BARK[1]),
    };
    let make = |count: f64| {
        let wanted = [count * share, count * (1.0 - share)];
        [0, 1].map(|k| {
            let least = usize::from(!parts[k].is_empty());
            let found = cluster::clusters(&pieces[k], (wanted[k].round() as usize).max(least));
            let boxed = |members: Vec<u32>| {
                let faces: Vec<u32> = members.iter().map(|m| parts[k][*m as usize]).collect();
                let metres = |f: &u32| surface.faces[*f as usize].p.map(|p| surface.frame.to_metres(p));
                (OrientedBox::around(&faces.iter().flat_map(metres).collect::<Vec<_>>()), faces)
            };
            found.into_par_iter().map(boxed).collect::<Vec<_>>()
        })
    };
    // How many cards boxes have is known when there are boxes: fewer clusters, until they have no more than are wanted.
    let cards = |all: &[Vec<(OrientedBox, Vec<u32>)>; 2]| -> usize {
        all.iter().flatten().map(|(b, _)| b.card_count(flatness)).sum()
    };
    let mut count = f64::from(most);
    let mut found = make(count);
    loop {
        let has = cards(&found);
        if has <= most as usize || found.iter().all(|c| c.len() <= 1) {
            return found;
        }
        count *= 0.98 * f64::from(most) / has as f64;
        found = make(count);
    }
}

/// Corners of a card from its upper left one on, clockwise as its front is seen, with their texture coordinates in it.
fn corners(card: &Card) -> [(Vec3, Vec2); 4] {
    [(-1.0, 1.0), (1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)]
        .map(|(x, y)| (card.centre + card.right * x + card.up * y, Vec2::new(0.5 + 0.5 * x, 0.5 - 0.5 * y)))
}

#[cfg(test)]
mod tests;
