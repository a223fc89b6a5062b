//! Trees far away as slices of a forest over the ground (Behrendt et al. 2005, section 3): which slice each sample sees, and the light on that.
//!
//! Slices are the ground's own mesh, raised, with every fourth of its vertices: a quad is drawn once for every slice of the stack that its nearest point has, and each of them shows nothing
//! where one that it has merged with does.

use crate::Result;
use crate::camera::Eye;
use crate::forest::indirect::IndirectData;
use crate::forest::shells::ShellData;
use crate::forest::terrain::TerrainDraws;
use crate::frame::ground::mesh_indices;
use crate::frame::targets::{ImageTargets, build_of};
use crate::frame::world::{Forest, World};
use crate::gpu::interface::{NO_PAGE, SHELL_CELLS, SHELL_ROOM, ShellLightParameters, TILE_SIDE};
use crate::gpu::{
    Buffer, DepthTest, Gpu, GraphicsDesc, Layers, Program, Recorder, Resource, Sampler, Targets, shaders, vk,
};
use crate::plan::names::pass;
use crate::plan::{Plan, SHELL_LIGHT_TEXELS};
use crate::scene::Scene;

/// Bits of an instance that say which slice it is.
const CODE_BITS: u32 = 6;

/// Draws and lights slices.
pub struct Shells {
    draw: Program,
    light: Program,
    /// Of the mesh of a slice over a quad.
    indices: Buffer,
    tiles: [u32; 2],
    size: [u32; 2],
    /// Distance from which on there are any, m.
    from: f64,
    /// Apparent height under which slices merge, pixels.
    spread: f64,
}

impl Shells {
    /// Makes the programs.
    ///
    /// # Errors
    /// [`crate::Error::Device`] if the device fails.
    pub fn new(gpu: &Gpu, scene: &Scene, plan: &Plan, data: &ShellData) -> Result<Self> {
        let builds = [
            &shaders::FRAME_TREES_SHELLS_LIGHT_COMP,
            &shaders::FRAME_TREES_SHELLS_LIGHT_SINGLE_COMP,
            &shaders::FRAME_TREES_SHELLS_LIGHT_LAYERS_COMP,
            &shaders::FRAME_TREES_SHELLS_LIGHT_LAYERS_SINGLE_COMP,
        ];
        Ok(Shells {
            draw: gpu.graphics(&GraphicsDesc {
                vert: &shaders::FRAME_TREES_SHELLS_SHELL_VERT,
                frag: &shaders::FRAME_TREES_SHELLS_SHELL_FRAG,
                colors: &[vk::Format::R32_UINT],
                samples: plan.samples,
                depth: DepthTest::Reverse,
                constants: &[
                    ("SAMPLES", plan.samples),
                    ("COVER_CHANNELS", plan.cover_channels),
                    ("COVER_SIDE", plan.coverage_size),
                    ("WIND", u32::from(plan.wind)),
                ],
            })?,
            light: gpu.compute(
                build_of(plan, builds),
                &[
                    ("SAMPLES", plan.samples),
                    ("COVER_CHANNELS", plan.cover_channels),
                    ("HAS_SUN", u32::from(plan.sun)),
                    ("SHADOWED", u32::from(plan.cascades > 0)),
                    ("INDIRECT", u32::from(plan.indirect > 0)),
                    ("INDIRECT_FIRST", IndirectData::first_species(plan)),
                    ("INDIRECT_NODES", plan.indirect.max(2)),
                    ("SPECIES_COUNT", data.species),
                    ("Z_FIELDS", u32::from(plan.shows_z_fields())),
                    ("WIND", u32::from(plan.wind)),
                    ("VIEW_MODE", plan.view_mode as u32),
                ],
            )?,
            indices: mesh_indices(gpu, "shell indices", SHELL_CELLS)?,
            tiles: plan.size.map(|n| n.div_ceil(TILE_SIDE)),
            size: plan.size,
            from: plan.shells_from(),
            spread: f64::from(scene.settings.shell_slice_pixels),
        })
    }

    /// Records which slice each sample sees.
    pub fn see(
        &self,
        recorder: &mut Recorder,
        world: &World,
        (eye, draws, (forest, data)): (&Eye, &TerrainDraws, (&Forest, &ShellData)),
        targets: &ImageTargets,
    ) {
        let terrain = &world.terrain;
        let colors: Vec<_> = targets.quads.iter().map(|q| q.attachment(None, false)).collect();
        let depth = Some(targets.depth.attachment(None, false));
        recorder.render(pass::SHELLS, &Targets { colors: &colors, depth, layers: Layers::One(0) }, |pass| {
            pass.bind(
                &self.draw,
                &[
                    ("view", Resource::Buffer(&world.view)),
                    ("quads", Resource::Buffer(&terrain.quads)),
                    ("height_tiles", Resource::Texture(&terrain.height_tiles, Sampler::Nearest)),
                    ("cover_tiles", Resource::Texture(&forest.coverage.tiles, Sampler::Linear)),
                    ("covers", Resource::Texture(&data.covers, Sampler::Linear)),
                    ("table", Resource::Buffer(&data.table)),
                ],
            );
            pass.push(&terrain.parameters(draws.camera.0));
            for (quad, (key, drawn)) in (0u32..).zip(draws.keys.iter().zip(&draws.quads)) {
                if drawn.cover_layer == NO_PAGE || terrain.tree.farthest(*key, eye.position) < self.from {
                    continue;
                }
                let nearest = terrain.tree.nearest(*key, eye.position).max(f64::from(SHELL_ROOM) * self.from);
                let slices = data.slices(nearest, eye.pixels_at_1m / self.spread);
                let first = (quad << CODE_BITS) + slices;
                pass.draw_indexed(&self.indices, 6 * SHELL_CELLS * SHELL_CELLS, first..first + slices);
            }
        });
    }

    /// Records the pass that lights what samples see of them where they see no z-field of `seen`, if there are any, beside what else their pixels
    /// show.
    pub fn light(
        &self,
        recorder: &mut Recorder,
        world: &World,
        (forest, data): (&Forest, &ShellData),
        seen: Option<&Buffer>,
        targets: &ImageTargets,
    ) {
        let Some(quads_seen) = &targets.quads else { return };
        let terrain = &world.terrain;
        recorder.compute(pass::SHELL_LIGHT, |pass| {
            let shown = targets.shown();
            let [l0, l1, l2, l3, l4, l5, l6] = &data.lights;
            let texture = |image| Resource::Texture(image, Sampler::Linear);
            let all = [
                ("view", Resource::Buffer(&world.view)),
                ("quads", Resource::Texels(&terrain.quads)),
                ("slope_tiles", texture(&terrain.slope_tiles)),
                ("cover_tiles", texture(&forest.coverage.tiles)),
                ("table", Resource::Buffer(&data.table)),
                ("covers", texture(&data.covers)),
                ("reflectances", texture(&data.reflectances)),
                ("transmittances", texture(&data.transmittances)),
                ("light_0", texture(l0)),
                ("light_1", texture(l1)),
                ("light_2", texture(l2)),
                ("light_3", texture(l3)),
                ("light_4", texture(l4)),
                ("light_5", texture(l5)),
                ("light_6", texture(l6)),
                ("indirect", Resource::Texels(&forest.indirect.nodes)),
                // Without z-fields nothing of it is read.
                ("seen", Resource::Texels(seen.unwrap_or(&terrain.quads))),
                ("shadow_map", Resource::Texture(&world.shadows.map, Sampler::NearestRepeat)),
                ("depth", Resource::Texture(targets.depth.drawn(), Sampler::Nearest)),
                ("quads_seen", Resource::Texture(quads_seen.drawn(), Sampler::Nearest)),
            ];
            pass.bind(&self.light, &[&all[..], &shown].concat());
            pass.push(&ShellLightParameters {
                size: self.size,
                step: terrain.tree.step() as f32,
                larger: SHELL_LIGHT_TEXELS.ilog2() as f32,
            });
            pass.dispatch([self.tiles[1], self.tiles[0], 1]);
        });
    }
}
