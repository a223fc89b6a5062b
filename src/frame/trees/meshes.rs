//! Trees that are their models' meshes (BBP08): which they are, which triangle each sample sees, and the light on that.

use crate::forest::cull::CullData;
use crate::forest::forest_sky::ForestSky;
use crate::forest::meshes::MeshData;
use crate::frame::Forest;
use crate::frame::targets::{ImageTargets, build_of};
use crate::gpu::interface::{
    DrawCommand, HIDING_STEPS, MESH_DRAWS, MESH_TREES, MeshKind, MeshLightParameters, MeshParameters,
    TILE_SIDE,
};
use crate::gpu::{
    Buffer, DepthTest, Gpu, GraphicsDesc, Image, Later, Layers, Program, Recorder, Resource, Sampler,
    Targets, shaders, vk,
};
use crate::plan::Plan;
use crate::plan::names::pass;
use crate::scene::Scene;
use crate::{Error, Result};

/// Finds, draws and lights meshes.
pub struct Meshes {
    list: Program,
    draw: Program,
    light: Program,
    tiles: [u32; 2],
    size: [u32; 2],
    /// Least side of a leaf card on the screen, pixels.
    leaf_pixels: f32,
    /// Whether the device takes all draws at once, as many as a shader has counted, and each names its tree.
    counted: bool,
    /// Whether they are lit by spherical harmonics.
    harmonics: bool,
}

impl Meshes {
    /// Makes the programs.
    ///
    /// # Errors
    /// [`crate::Error::Device`] if the device fails.
    pub fn new(gpu: &Gpu, scene: &Scene, plan: &Plan, data: &MeshData) -> Result<Self> {
        let builds = [
            &shaders::FRAME_TREES_MESHES_LIGHT_COMP,
            &shaders::FRAME_TREES_MESHES_LIGHT_SINGLE_COMP,
            &shaders::FRAME_TREES_MESHES_LIGHT_LAYERS_COMP,
            &shaders::FRAME_TREES_MESHES_LIGHT_LAYERS_SINGLE_COMP,
        ];
        Ok(Meshes {
            list: gpu.compute(&shaders::FRAME_TREES_MESHES_LIST_COMP, &[])?,
            draw: gpu.graphics(&GraphicsDesc {
                vert: &shaders::FRAME_TREES_MESHES_MESH_VERT,
                frag: &shaders::FRAME_TREES_MESHES_MESH_FRAG,
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
                    ("LEAF_DIRECTIONS", scene.settings.leaf_directions),
                    ("LEAF_POWER", data.power),
                    ("INDIRECT", u32::from(plan.indirect > 0)),
                    ("HARMONICS", u32::from(plan.mesh_harmonics)),
                    ("Z_FIELDS", u32::from(plan.shows_z_fields())),
                    ("WIND", u32::from(plan.wind)),
                    ("VIEW_MODE", plan.view_mode as u32),
                ],
            )?,
            tiles: plan.size.map(|n| n.div_ceil(TILE_SIDE)),
            size: plan.size,
            leaf_pixels: scene.settings.leaf_pixels,
            counted: gpu.info().counted_draws,
            harmonics: plan.mesh_harmonics,
        })
    }

    /// Records which of the trees in view, up to a distance in metres, are meshes, how much of each is drawn, and which triangle of them each
    /// sample sees.
    pub fn see(
        &self,
        recorder: &mut Recorder,
        view: &Buffer,
        (cull, data, range): (&CullData, &MeshData, f64),
        targets: &ImageTargets,
    ) {
        let all = [
            ("view", Resource::Buffer(view)),
            ("trees", Resource::Texels(&cull.trees)),
            ("lists", Resource::Buffer(&cull.lists)),
            ("starts", Resource::Buffer(&cull.starts)),
            ("totals", Resource::Buffer(&cull.totals)),
            ("kinds", Resource::Buffer(&data.kinds)),
            ("draws", Resource::Buffer(&data.draws)),
            ("draw_count", Resource::Buffer(&data.draw_count)),
            ("indices", Resource::Texels(&data.indices)),
            ("mesh_trees", Resource::Buffer(&data.trees)),
            ("corners", Resource::Texels(&data.corners)),
            ("faces", Resource::Texels(&data.faces)),
            ("masks", Resource::Texture(&data.masks, Sampler::LinearRepeat)),
        ];
        recorder.compute(pass::MESH_LISTS, |pass| {
            pass.bind(&self.list, &all);
            pass.push(&MeshParameters {
                bins: cull.bins_within(range),
                species_count: data.species,
                leaf_pixels: self.leaf_pixels,
                named: u32::from(self.counted),
            });
            pass.dispatch([1, 1, 1]);
        });
        let colors: Vec<_> = targets.quads.iter().map(|q| q.attachment(None, false)).collect();
        let depth = Some(targets.depth.attachment(None, false));
        recorder.render(pass::MESHES, &Targets { colors: &colors, depth, layers: Layers::One(0) }, |pass| {
            pass.bind(&self.draw, &all);
            let most = MESH_DRAWS * MESH_TREES;
            if self.counted {
                pass.push(&0u32);
                pass.draw_indexed_counted(&data.indices, (&data.draws, 0), &data.draw_count, most);
                return;
            }
            for draw in 0..most {
                pass.push(&(draw / MESH_DRAWS));
                let command = u64::from(draw) * size_of::<DrawCommand>() as u64;
                pass.draw_indexed_indirect(&data.indices, &data.draws, command);
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
        (cull, data, sky): (&CullData, &MeshData, Option<&ForestSky>),
        shadow_map: &Image,
        seen: Option<&Buffer>,
        targets: &ImageTargets,
    ) {
        let Some(quads_seen) = &targets.quads else { return };
        recorder.compute(pass::MESH_LIGHT, |pass| {
            let shown = targets.shown();
            let all = [
                ("view", Resource::Buffer(view)),
                ("trees", Resource::Texels(&cull.trees)),
                ("species", Resource::Buffer(&forest.species.table)),
                ("kinds", Resource::Buffer(&data.kinds)),
                ("mesh_trees", Resource::Buffer(&data.trees)),
                ("corners", Resource::Texels(&data.corners)),
                ("faces", Resource::Texels(&data.faces)),
                ("envelopes", Resource::Texels(&data.envelopes)),
                ("rule", Resource::Buffer(&data.rule)),
                ("hiding", Resource::Texels(&data.hiding)),
                // Without harmonics nothing of it is read.
                ("forest_sky", Resource::Texture(sky.map_or(&data.masks, |s| &s.table), Sampler::Linear)),
                ("optics", Resource::Buffer(&data.optics)),
                ("handed_light", Resource::Texels(&forest.indirect.handed)),
                // Without z-fields nothing of it is read.
                ("seen", Resource::Texels(seen.unwrap_or(&cull.trees))),
                ("shadow_map", Resource::Texture(shadow_map, Sampler::NearestRepeat)),
                ("depth", Resource::Texture(targets.depth.drawn(), Sampler::Nearest)),
                ("quads_seen", Resource::Texture(quads_seen.drawn(), Sampler::Nearest)),
            ];
            pass.bind(&self.light, &[&all[..], &shown].concat());
            let top = sky.filter(|_| self.harmonics).map_or(data.top, |s| s.top);
            pass.push(&MeshLightParameters { size: self.size, heights: [top, HIDING_STEPS as f32 / top] });
            pass.dispatch([self.tiles[1], self.tiles[0], 1]);
        });
    }

    /// That a frame drew all of its meshes.
    ///
    /// # Errors
    /// [`Error::Usage`] when there were more than lists hold.
    pub fn check(kinds: &[MeshKind]) -> Result<()> {
        let total: u32 = kinds.iter().map(|k| k.tree_count).sum();
        if total > MESH_TREES {
            return Err(Error::Usage(format!(
                "{total} trees in view are near enough to be meshes, and {MESH_TREES} can be: raise mesh_min_pixels"
            )));
        }
        Ok(())
    }

    /// Has read back how many trees of each species are meshes.
    ///
    /// # Errors
    /// Those of [`Recorder::read`].
    pub fn read_kinds(&self, recorder: &mut Recorder, data: &MeshData) -> Result<Later<MeshKind>> {
        recorder.read(&data.kinds, 0, data.species as usize)
    }
}
