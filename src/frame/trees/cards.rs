//! Trees that are clouds of cards (Behrendt et al. 2005): how many, which card each sample sees, and the light on that.
//!
//! Cards are drawn by instances, a tree each: the full clouds of the nearest, and the far forms of the others, both in the order of the camera's lists.

use crate::Result;
use crate::forest::cards::CardData;
use crate::forest::cull::CullData;
use crate::forest::forest_sky::ForestSky;
use crate::frame::Forest;
use crate::frame::targets::{ImageTargets, build_of};
use crate::gpu::interface::{CardKind, CardLightParameters, CardParameters, PlainDraw, TILE_SIDE};
use crate::gpu::{
    Buffer, DepthTest, Gpu, GraphicsDesc, Image, Later, Layers, Program, Recorder, Resource, Sampler,
    Targets, shaders, vk,
};
use crate::plan::names::pass;
use crate::plan::{CARD_DRAWS, Plan};
use crate::scene::Scene;

/// Finds, draws and lights cards.
pub struct Cards {
    list: Program,
    draw: Program,
    light: Program,
    parameters: CardParameters,
    tiles: [u32; 2],
    size: [u32; 2],
    /// Whether the device takes counted draws, which those of meshes are then.
    counted: bool,
}

impl Cards {
    /// Makes the programs.
    ///
    /// # Errors
    /// [`crate::Error::Device`] if the device fails.
    pub fn new(gpu: &Gpu, scene: &Scene, plan: &Plan, (cull, data): (&CullData, &CardData)) -> Result<Self> {
        let builds = [
            &shaders::FRAME_TREES_CARDS_LIGHT_COMP,
            &shaders::FRAME_TREES_CARDS_LIGHT_SINGLE_COMP,
            &shaders::FRAME_TREES_CARDS_LIGHT_LAYERS_COMP,
            &shaders::FRAME_TREES_CARDS_LIGHT_LAYERS_SINGLE_COMP,
        ];
        Ok(Cards {
            list: gpu.compute(&shaders::FRAME_TREES_CARDS_LIST_COMP, &[])?,
            draw: gpu.graphics(&GraphicsDesc {
                vert: &shaders::FRAME_TREES_CARDS_CARD_VERT,
                frag: &shaders::FRAME_TREES_CARDS_CARD_FRAG,
                colors: &[vk::Format::R32_UINT],
                samples: plan.samples,
                depth: DepthTest::Reverse,
                constants: &[("SAMPLES", plan.samples), ("WIND", u32::from(plan.wind))],
            })?,
            light: gpu.compute(
                build_of(plan, builds),
                &[
                    ("SAMPLES", plan.samples),
                    ("HAS_SUN", u32::from(plan.sun)),
                    ("INDIRECT", u32::from(plan.indirect > 0)),
                    ("Z_FIELDS", u32::from(plan.shows_z_fields())),
                    ("WIND", u32::from(plan.wind)),
                    ("VIEW_MODE", plan.view_mode as u32),
                ],
            )?,
            parameters: CardParameters {
                tree_capacity: plan.tree_capacity,
                species_count: data.species,
                cloud_bins: cull.bins_within(plan.cloud_range),
                far_bins: cull.bins_before(plan.far_from),
                card_bins: cull.bins_within(plan.last_card_range),
                cloud_cards: data.cloud_cards,
                fade_pixels: scene.settings.cloud_min_pixels,
                far_form: 0,
            },
            tiles: plan.size.map(|n| n.div_ceil(TILE_SIDE)),
            size: plan.size,
            counted: gpu.info().counted_draws,
        })
    }

    /// Records how many of the trees in view are cards, and which card of them each sample sees.
    pub fn see(
        &self,
        recorder: &mut Recorder,
        view: &Buffer,
        forest: &Forest,
        (cull, data): (&CullData, &CardData),
        targets: &ImageTargets,
    ) {
        let all = [
            ("view", Resource::Buffer(view)),
            ("trees", Resource::Texels(&cull.trees)),
            ("lists", Resource::Buffer(&cull.lists)),
            ("starts", Resource::Buffer(&cull.starts)),
            ("totals", Resource::Buffer(&cull.totals)),
            ("species", Resource::Buffer(&forest.species.table)),
            ("kinds", Resource::Buffer(&data.kinds)),
            ("draws", Resource::Buffer(&data.draws)),
            ("cards", Resource::Texels(&data.cards)),
            ("opacities", Resource::Texture(&data.opacities, Sampler::Linear)),
        ];
        recorder.compute(pass::CARD_LISTS, |pass| {
            pass.bind(&self.list, &all);
            pass.push(&self.parameters);
            pass.dispatch([1, 1, 1]);
        });
        let colors: Vec<_> = targets.quads.iter().map(|q| q.attachment(None, false)).collect();
        let depth = Some(targets.depth.attachment(None, false));
        recorder.render(pass::CARDS, &Targets { colors: &colors, depth, layers: Layers::One(0) }, |pass| {
            pass.bind(&self.draw, &all);
            for far_form in 0..CARD_DRAWS {
                pass.push(&CardParameters { far_form, ..self.parameters });
                let command = u64::from(far_form) * size_of::<PlainDraw>() as u64;
                match self.counted {
                    true => pass.draw_indirect_counted((&data.draws, command), &data.one),
                    false => pass.draw_indirect(&data.draws, command),
                }
            }
        });
    }

    /// Records the pass that lights what samples see of them where they see no z-field of `seen`, if there are any, beside what else their pixels
    /// show.
    #[allow(clippy::too_many_arguments)]
    pub fn light(
        &self,
        recorder: &mut Recorder,
        view: &Buffer,
        forest: &Forest,
        (cull, data, sky): (&CullData, &CardData, &ForestSky),
        shadow_map: &Image,
        seen: Option<&Buffer>,
        targets: &ImageTargets,
    ) {
        let Some(quads_seen) = &targets.quads else { return };
        recorder.compute(pass::CARD_LIGHT, |pass| {
            let shown = targets.shown();
            let all = [
                ("view", Resource::Buffer(view)),
                ("trees", Resource::Texels(&cull.trees)),
                ("species", Resource::Buffer(&forest.species.table)),
                ("kinds", Resource::Buffer(&data.kinds)),
                ("cards", Resource::Texels(&data.cards)),
                ("surfaces", Resource::Texture(&data.surfaces, Sampler::Linear)),
                ("transfers", Resource::Texture(&data.transfers, Sampler::Linear)),
                ("forest_sky", Resource::Texture(&sky.table, Sampler::Linear)),
                ("optics", Resource::Buffer(&data.optics)),
                ("handed_light", Resource::Texels(&forest.indirect.handed)),
                // Without z-fields nothing of it is read.
                ("seen", Resource::Texels(seen.unwrap_or(&cull.trees))),
                ("shadow_map", Resource::Texture(shadow_map, Sampler::NearestRepeat)),
                ("depth", Resource::Texture(targets.depth.drawn(), Sampler::Nearest)),
                ("quads_seen", Resource::Texture(quads_seen.drawn(), Sampler::Nearest)),
            ];
            pass.bind(&self.light, &[&all[..], &shown].concat());
            pass.push(&CardLightParameters { size: self.size, top: [sky.top, 1.0 / sky.top] });
            pass.dispatch([self.tiles[1], self.tiles[0], 1]);
        });
    }

    /// Has read back how many trees of each species are cards.
    ///
    /// # Errors
    /// Those of [`Recorder::read`].
    pub fn read_kinds(&self, recorder: &mut Recorder, data: &CardData) -> Result<Later<CardKind>> {
        recorder.read(&data.kinds, 0, data.species as usize)
    }
}
