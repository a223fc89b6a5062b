//! What a plan lists for trees that are clouds of cards, and how far they are such.

use super::Plan;
use super::items::Items;
use super::names::resource;
use crate::gpu::interface::{CARD_LEVELS, CARD_TREES, Card, CardKind, FAR_CARDS, PlainDraw, SKY_STEPS};
use crate::gpu::{BufferDesc, Description, ImageDesc, vk};
use crate::scene::{Distribution, Scene, Species};
use crate::{Error, Result};

/// Format and bytes of the texels as which cards are read.
const WORDS: (vk::Format, u64) = (vk::Format::R32G32B32A32_UINT, 16);
/// Layers of light transfer a species: twice nine coefficients, four a layer.
pub const TRANSFER_LAYERS: u32 = 5;
/// Draws of cards: full clouds and far forms.
pub const CARD_DRAWS: u32 = 2;
/// A tree's box may be a little higher than its model.
const ROOM: f64 = 1.05;

/// The smallest scale of a species' trees.
fn smallest_scale(species: &Species) -> f64 {
    let drawn = species.scale[0];
    f64::from(match &species.distribution {
        Distribution::Positions(list) => list.iter().filter_map(|t| t.scale).fold(drawn, f32::min),
        Distribution::Density { .. } => drawn,
    })
}

impl Plan {
    /// How far trees are clouds of cards, and how far these are full, of trees that would be `pixels` high at one metre: species after species.
    pub(super) fn card_ranges(&mut self, scene: &Scene, pixels: &[f64]) {
        let s = &scene.settings;
        let last = self.last_range();
        self.far_from = f64::INFINITY;
        for (species, pixels) in scene.species.iter().zip(pixels) {
            let (small, large) = (smallest_scale(species), species.largest_scale());
            // Where they are the last that are drawn one by one they end where all such do: no fade of their own begins before.
            let range = self.ladder.card_range(s, *pixels).unwrap_or(2.0 * last / small.max(1e-6));
            self.card_range.push(range);
            self.last_card_range = self.last_card_range.max(range * large);
            let begin = pixels / f64::from(s.cloud_min_pixels);
            self.cloud_range = self.cloud_range.max(2.0 * ROOM * begin * large);
            self.far_from = self.far_from.min(begin * small / ROOM);
        }
        if !self.ladder.cards() {
            (self.cloud_range, self.far_from) = (0.0, 0.0);
        }
    }

    /// That a sample's word can name every tree in view.
    pub(super) fn check_cards(&self) -> Result<()> {
        if self.cards && self.tree_capacity > CARD_TREES {
            return Err(Error::Usage(format!(
                "up to {} trees in view, and of clouds of cards {CARD_TREES} can be told apart: lower zfield_max_trees",
                self.tree_capacity
            )));
        }
        Ok(())
    }

    /// Whether any surface is lit by spherical harmonics.
    pub fn harmonics(&self) -> bool {
        self.cards || self.meshes && self.mesh_harmonics
    }

    /// What the forest leaves of the sky, for what harmonics light.
    pub(super) fn list_forest_sky(&self, items: &mut Items) {
        let sky = ImageDesc::plain(resource::FOREST_SKY, vk::Format::R16G16B16A16_SFLOAT, [SKY_STEPS; 2]);
        items.add(
            "data",
            "forest sky",
            "what crowns leave of the sky to what spherical harmonics light",
            [sky],
        );
    }

    /// Cards and their pictures.
    pub(super) fn list_cards(&self, scene: &Scene, items: &mut Items) {
        let s = &scene.settings;
        let count = scene.species.len() as u32;
        let cards = u64::from(count) * u64::from(s.cards + FAR_CARDS);
        let pictures = |name, format, layers, side, levels| {
            Description::Image(ImageDesc { layers, levels, ..ImageDesc::plain(name, format, [side; 2]) })
        };
        let (r8, rgba8, snorm) =
            (vk::Format::R8_UNORM, vk::Format::R8G8B8A8_UNORM, vk::Format::R8G8B8A8_SNORM);
        let reason = format!(
            "clouds of up to {} cards of {count} species, full to {:.0} m",
            s.cards, self.cloud_range
        );
        let all: [Description; 6] = [
            BufferDesc {
                texels: Some(WORDS),
                ..BufferDesc::new(resource::CARDS, cards * size_of::<Card>() as u64)
            }
            .into(),
            BufferDesc::new(resource::CARD_KINDS, u64::from(count) * size_of::<CardKind>() as u64).into(),
            BufferDesc::new(resource::CARD_DRAWS, u64::from(CARD_DRAWS) * size_of::<PlainDraw>() as u64)
                .into(),
            pictures(resource::CARD_OPACITIES, r8, count, s.card_atlas, CARD_LEVELS),
            pictures(resource::CARD_SURFACES, rgba8, count, s.card_atlas, CARD_LEVELS),
            pictures(resource::CARD_TRANSFERS, snorm, TRANSFER_LAYERS * count, s.card_atlas / 2, 1),
        ];
        items.add("data", "cards", reason, all);
    }
}
