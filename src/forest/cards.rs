//! Clouds of cards on the GPU (Behrendt et al. 2005): cards of all species in one buffer, their pictures a species a layer.

use super::species::optics_block;
use crate::bake::Baked;
use crate::bake::cards::{CardCloud, CloudCard, FAR};
use crate::bake::harmonics::seen::Corrections;
use crate::gpu::interface::{CARD_LEVELS, Card, CardKind, FAR_CARDS, TRANSFER_SCALE};
use crate::gpu::{Buffer, Gpu, Image};
use crate::physics::harmonics;
use crate::plan::names::resource;
use crate::plan::{Plan, TRANSFER_LAYERS};
use crate::scene::Scene;
use crate::{Error, Result};

const _: () = assert!(TRANSFER_SCALE == harmonics::RANGE as f32 && FAR_CARDS as usize == FAR);

/// What clouds of cards are drawn from.
pub struct CardData {
    /// [`Card`]s of all species: of each its full cloud and then its far form.
    pub cards: Buffer,
    /// [`CardKind`]s of the species; how many trees are of each is each frame's.
    pub kinds: Buffer,
    /// [`crate::gpu::interface::PlainDraw`]s of full clouds and of far forms.
    pub draws: Buffer,
    /// How many draws each of them is: one.
    pub one: Buffer,
    /// Opacity of the pictures.
    pub opacities: Image,
    /// What is painted there.
    pub surfaces: Image,
    /// How light comes to that.
    pub transfers: Image,
    /// Reflectance and transmittance of leaves, and reflectance of bark, of each species, and what harmonics leave out of the sun there.
    pub optics: Buffer,
    /// Number of species.
    pub species: u32,
    /// Cards of the largest full cloud.
    pub cloud_cards: u32,
}

impl CardData {
    /// Uploads the clouds of a plan with cards.
    ///
    /// # Errors
    /// [`Error::Usage`] for bakes without clouds, or with others than the plan lists; [`Error::Device`] when out of memory.
    pub fn new(gpu: &Gpu, scene: &Scene, plan: &Plan, baked: &[Baked]) -> Result<Self> {
        let clouds: Vec<&CardCloud> =
            baked.iter().map(|b| cloud(b, scene.settings.card_atlas)).collect::<Result<_>>()?;
        let (mut cards, mut kinds) = (Vec::new(), Vec::new());
        for cloud in &clouds {
            kinds.push(CardKind {
                first_card: cards.len() as u32,
                full_count: cloud.full,
                far_count: cloud.cards.len() as u32 - cloud.full,
                tree_count: 0,
            });
            cards.extend(cloud.cards.iter().map(card));
        }
        let described = plan.buffer(resource::CARDS);
        let none: Card = bytemuck::Zeroable::zeroed();
        cards.resize(described.bytes as usize / size_of::<Card>(), none);
        let image = |name| {
            let image = plan.images(name).next();
            gpu.image(image.ok_or_else(|| Error::Usage("the plan lists no cards".into()))?)
        };
        let [opacities, surfaces, transfers] =
            [resource::CARD_OPACITIES, resource::CARD_SURFACES, resource::CARD_TRANSFERS].map(image);
        let (opacities, surfaces, transfers) = (opacities?, surfaces?, transfers?);
        for (k, cloud) in (0u32..).zip(&clouds) {
            for level in 0..CARD_LEVELS {
                gpu.upload_image(&opacities, level, k, 1, &cloud.opacity[level as usize])?;
                gpu.upload_image(&surfaces, level, k, 1, &cloud.surface[level as usize])?;
            }
            for (layer, bytes) in (TRANSFER_LAYERS * k..).zip(&cloud.harmonics) {
                gpu.upload_image(&transfers, 0, layer, 1, bytes)?;
            }
        }
        Ok(CardData {
            cards: gpu.described_buffer_with(&described, &cards)?,
            kinds: gpu.described_buffer_with(&plan.buffer(resource::CARD_KINDS), &kinds)?,
            draws: gpu.described_buffer(&plan.buffer(resource::CARD_DRAWS))?,
            one: gpu.buffer_with("card draw count", &[1u32])?,
            opacities,
            surfaces,
            transfers,
            optics: gpu.buffer_with("leaf optics of cards", &optics_block(baked, seen))?,
            species: clouds.len() as u32,
            cloud_cards: clouds.iter().map(|c| c.full).max().unwrap_or(0),
        })
    }
}

/// The cloud of a species, in an atlas of the plan's size.
fn cloud(baked: &Baked, side: u32) -> Result<&CardCloud> {
    let cloud = baked.cards.as_deref().filter(|c| c.size == [side; 2]);
    cloud.ok_or_else(|| {
        Error::Usage("a species was baked without the cloud of cards that the plan lists".into())
    })
}

/// What harmonics leave out of the sun on a species' full cloud and far form.
fn seen(baked: &Baked) -> [Corrections; 2] {
    baked.cards.as_ref().map(|c| c.seen).unwrap_or_default()
}

fn card(c: &CloudCard) -> Card {
    let pair = |[a, b]: [u32; 2]| a | b << 16;
    Card {
        centre: c.centre,
        depth: c.depth,
        right: c.right,
        front: pair(c.front),
        up: c.up,
        back: pair(c.back),
        size: pair(c.size),
        ..bytemuck::Zeroable::zeroed()
    }
}
