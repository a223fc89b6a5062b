//! A cloud of cards as a renderer wants it: both sides of every card as textures of opacity, surface and light, in one atlas.

use glam::Vec3;
use rayon::prelude::*;

use super::atlas::{GUTTER, shelves};
use super::paint::{Painted, texels_of};
use super::picture::{LEVELS, Picture, Shown, padded};
use super::{Card, CloudSettings, FLATNESS, clusters_for, parted, seen};
use crate::bake::harmonics::Harmonics;
use crate::bake::harmonics::seen::Corrections;
use crate::bake::surface::Surface;
use crate::scene::Mesh;
use crate::{Error, Result};

/// Cards of the far form: two upright ones through the trunk, crossed, as Behrendt et al. have; and a level one, without which it would
/// vanish from above.
pub const FAR: usize = 3;

/// A card of a cloud: a rectangle, m, from the middle of the tree's box (on the trunk's axis, half way up:
/// [`crate::physics::crown::Frame::centre`]).
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct CloudCard {
    /// Its middle.
    pub centre: [f32; 3],
    /// From there to the middle of its right edge, as the viewer of its front sees it, towards whom right × up points.
    pub right: [f32; 3],
    /// And to that of its upper edge.
    pub up: [f32; 3],
    /// What is painted on it lies within this of its plane, m.
    pub depth: f32,
    /// Texel of the upper left corner of its front's picture in the atlas, multiples of 4.
    pub front: [u32; 2],
    /// And of its back's, which has each place of the card where the front has it: it is not turned round.
    pub back: [u32; 2],
    /// Texels of either.
    pub size: [u32; 2],
}

/// Cards, and an atlas of what they show to either side. Rows of all textures run from the top of a card down. Around every picture are
/// at least four texels in which nothing is.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CardCloud {
    /// The full cloud, then the far form of [`FAR`] cards.
    pub cards: Vec<CloudCard>,
    /// How many are the full cloud's.
    pub full: u32,
    /// Texels of the atlas.
    pub size: [u32; 2],
    /// R8 of mip levels 0 to 3. Of level 0, 128 and more means covered; of coarser ones the share of the finest's covered texels
    /// under a texel, so that coverage stays.
    pub opacity: Vec<Vec<u8>>,
    /// RGBA8 of the same levels: share of leaf (0 bark, 255 leaf); where between −depth and depth the surface is towards the picture's viewer,
    /// 0 to 255 (127.5 is in the card's plane); and the normal of its side that faces this viewer, in axes x to the card's right, y
    /// up and z to the viewer, as x and y over |x| + |y| + z (−1 to 1 as 0 to 255): z ≥ 0 for all, so there is no seam.
    /// Means by coverage; texels in which nothing is have what is near.
    pub surface: Vec<Vec<u8>>,
    /// RGBA8 with sign, of half of the atlas's texels a side, in layers of four: the [`crate::physics::harmonics::KEPT`] numbers of light that
    /// falls on the side of the surface that this viewer sees, then as many of what falls on the other side (for leaves to let
    /// through), as [`crate::physics::harmonics::decode`] reads them. Means and fills likewise.
    pub harmonics: Vec<Vec<u8>>,
    /// What the sun does on what is seen of the full cloud, and of the far form, over what these numbers say.
    pub seen: [Corrections; 2],
}

impl CardCloud {
    /// Makes a cloud of a model, with texels as small as the atlas has room for; the same bits on any number of threads.
    ///
    /// # Errors
    /// [`Error::Usage`] for a model without extent, and where the atlas is too small for so many cards.
    pub fn new(mesh: &Mesh, light: &Harmonics, settings: CloudSettings) -> Result<Self> {
        let surface = Surface::new(mesh)?;
        let parts = parted(mesh, &surface);
        let boxes = clusters_for(&surface, &parts, settings.cards, FLATNESS);
        let mut cards: Vec<Card> =
            boxes.iter().flatten().flat_map(|(b, faces)| b.cards(FLATNESS, faces)).collect();
        let full = cards.len() as u32;
        cards.extend(far(&surface, &parts[1]));
        let texel = texel(&cards, settings.atlas).ok_or_else(|| {
            Error::Usage(format!(
                "pictures of {} cards do not fit into an atlas of {1} x {1} texels\n  remedy: a larger card_atlas, or fewer cards",
                cards.len(),
                settings.atlas
            ))
        })?;
        let shown = Shown::new(mesh, &surface, light);
        let paint = |card: &Card| {
            let painted = Painted::new(&surface, card, texel);
            let depth = painted.depth();
            (painted.size, depth, [0, 1].map(|side| Picture::new(card, &painted, depth, side, &shown)))
        };
        let painted: Vec<_> = cards.par_iter().map(paint).collect();
        let pictures: Vec<&Picture> = painted.iter().flat_map(|(.., pictures)| pictures).collect();
        let (mut cloud, corners) = CardCloud::atlas(&pictures, settings.atlas);
        let middle = Vec3::Z * surface.frame.centre;
        let place = |(k, (card, (size, depth, _))): (usize, (&Card, &([u32; 2], f32, _)))| CloudCard {
            centre: (card.centre - middle).to_array(),
            right: card.right.to_array(),
            up: card.up.to_array(),
            depth: *depth,
            front: corners[2 * k].map(|x| x + GUTTER),
            back: corners[2 * k + 1].map(|x| x + GUTTER),
            size: *size,
        };
        cloud.cards = cards.iter().zip(&painted).enumerate().map(place).collect();
        cloud.full = full;
        cloud.seen = seen::measure(mesh, &surface, light, &cloud);
        Ok(cloud)
    }

    /// Bytes of each texture: levels of opacity, levels of surface, layers of harmonics.
    pub fn sizes(side: u32) -> impl Iterator<Item = usize> {
        let texels = move |level: u32| ((side >> level) * (side >> level)) as usize;
        let levels = |bytes: usize| (0..LEVELS).map(move |l| bytes * texels(l));
        levels(1).chain(levels(4)).chain(std::iter::repeat_n(4 * texels(1), super::picture::LAYERS))
    }

    /// All textures, in the order of [`CardCloud::sizes`].
    pub fn textures(&self) -> impl Iterator<Item = &Vec<u8>> {
        self.opacity.iter().chain(&self.surface).chain(&self.harmonics)
    }

    /// An atlas of this side without cards, and where each picture's gutter begins.
    fn atlas(pictures: &[&Picture], side: u32) -> (Self, Vec<[u32; 2]>) {
        let sizes: Vec<[u32; 2]> = pictures.iter().map(|p| p.size).collect();
        let (corners, _) = shelves(&sizes, side);
        let mut textures: Vec<Vec<u8>> = CardCloud::sizes(side).map(|n| vec![0; n]).collect();
        for (picture, corner) in pictures.iter().zip(&corners) {
            let from = picture.opacity.iter().chain(&picture.surface).chain(&picture.harmonics);
            for ((to, from), (bytes, level)) in textures.iter_mut().zip(from).zip(texture_kinds()) {
                let row = |y: u32, x: u32, w: u32| (bytes * (y * (w >> level) + x)) as usize;
                let wide = row(0, picture.size[0] >> level, 0);
                for (y, line) in (corner[1] >> level..).zip(from.chunks_exact(wide)) {
                    let at = row(y, corner[0] >> level, side);
                    to[at..at + wide].copy_from_slice(line);
                }
            }
        }
        let harmonics = textures.split_off(2 * LEVELS as usize);
        let surface = textures.split_off(LEVELS as usize);
        let cloud =
            CardCloud { size: [side; 2], opacity: textures, surface, harmonics, ..CardCloud::default() };
        (cloud, corners)
    }
}

/// The smallest side of a texel, m, with which both pictures of all cards fit into an atlas; `None` where those of a few texels do not.
fn texel(cards: &[Card], side: u32) -> Option<f32> {
    let fits = |texel: f32| {
        let sizes: Vec<[u32; 2]> = cards.iter().flat_map(|c| [padded(texels_of(c, texel)); 2]).collect();
        sizes.iter().all(|s| s[0] <= side) && shelves(&sizes, side).1 <= side
    };
    let longest = cards.iter().map(|c| c.right.length().max(c.up.length())).fold(0.0, f32::max);
    // Between a texel a card and as many along the longest as the atlas has.
    let (mut low, mut high) = (2.0 * longest / side as f32, 2.0 * longest);
    if !fits(high) {
        return None;
    }
    while high > 1.005 * low {
        let middle = (low * high).sqrt();
        if fits(middle) { high = middle } else { low = middle }
    }
    Some(high)
}

/// Bytes of a texel, and the level, of every texture.
fn texture_kinds() -> impl Iterator<Item = (u32, u32)> {
    let levels = |bytes: u32| (0..LEVELS).map(move |l| (bytes, l));
    levels(1).chain(levels(4)).chain(std::iter::repeat((4, 1)))
}

/// The far form: all faces on two upright cards through the trunk, and on a level one through the middle of the leaves.
fn far(surface: &Surface, leaves: &[u32]) -> [Card; FAR] {
    let all: Vec<u32> = (0..surface.faces.len() as u32).collect();
    let (low, high) = bounds(surface, &all);
    let crown = if leaves.is_empty() { (low, high) } else { bounds(surface, leaves) };
    let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
    let level = 0.5 * (crown.0.z + crown.1.z);
    let [x, y, z] = [Vec3::X * half.x, Vec3::Y * half.y, Vec3::Z * half.z];
    [
        (Vec3::new(middle.x, 0.0, middle.z), x, z),
        (Vec3::new(0.0, middle.y, middle.z), y, z),
        (Vec3::new(middle.x, middle.y, level), x, y),
    ]
    .map(|(centre, right, up)| Card { centre, right, up, faces: all.clone() })
}

/// Least and greatest corner of some faces, m.
fn bounds(surface: &Surface, faces: &[u32]) -> (Vec3, Vec3) {
    let corners = faces.iter().flat_map(|f| surface.faces[*f as usize].p.map(|p| surface.frame.to_metres(p)));
    corners.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)))
}
