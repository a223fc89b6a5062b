//! All cascades in one layered pass: the terrain, then the trees' backs (BN12, section 5).

use crate::Result;
use crate::camera::{Cascade, Eye};
use crate::forest::cull::CullData;
use crate::forest::seeds::SeedData;
use crate::forest::species::SpeciesData;
use crate::forest::terrain::{TerrainData, TerrainDraws};
use crate::gpu::interface::{CAMERA_DRAWS, DrawCommand, TERRAIN_CELLS, TerrainParameters};
use crate::gpu::{
    Attachment, Buffer, DepthTest, Gpu, GraphicsDesc, Image, ImageDesc, Program, Recorder, Resource, Sampler,
    Targets, shaders, vk,
};
use crate::plan::Plan;
use crate::scene::Scene;

/// Push constants of a terrain draw.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
pub struct TerrainPush {
    /// Parameters of the terrain.
    pub parameters: TerrainParameters,
    /// Cascade drawn to.
    pub cascade: u32,
}

/// Shadow maps and the programs that draw them.
pub struct Shadows {
    /// Depth of the caster nearest the sun, one layer a cascade.
    pub map: Image,
    /// For the terrain, and for trees if any are drawn by themselves.
    programs: Option<(Program, Option<Program>)>,
}

impl Shadows {
    /// Allocates for a plan; without sun, one texel that nothing is drawn to.
    ///
    /// # Errors
    /// [`crate::Error::Device`] when out of memory.
    pub fn new(gpu: &Gpu, scene: &Scene, plan: &Plan) -> Result<Self> {
        let on = plan.cascades > 0;
        let side = if on { scene.settings.cascade_size } else { 1 };
        let layers = plan.cascades.max(1);
        let map = gpu.image(&ImageDesc {
            name: "shadow cascades",
            format: vk::Format::D32_SFLOAT,
            size: [side; 2],
            layers,
            levels: 1,
            samples: 1,
            usage: vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT,
        })?;
        let program = |vert, frag, constants| {
            gpu.graphics(&GraphicsDesc {
                vert,
                frag,
                colors: &[],
                samples: 1,
                depth: DepthTest::Reverse,
                constants,
            })
        };
        let s = &scene.settings;
        let views = [("VIEW_RINGS", s.view_rings), ("VIEW_RESOLUTION", (s.view_resolution as f32).to_bits())];
        if !on {
            return Ok(Shadows { map, programs: None });
        }
        Ok(Shadows {
            map,
            programs: Some((
                program(&shaders::FRAME_TERRAIN_SHADOW_VERT, &shaders::FRAME_TERRAIN_SHADOW_FRAG, &[])?,
                plan.z_fields
                    .then(|| {
                        program(
                            &shaders::FRAME_TREES_ZFIELD_SHADOW_VERT,
                            &shaders::FRAME_TREES_ZFIELD_SHADOW_FRAG,
                            &views,
                        )
                    })
                    .transpose()?,
            )),
        })
    }

    /// The cascades of an eye.
    pub fn cascades(scene: &Scene, plan: &Plan, eye: &Eye, sun: [f64; 3], highest: f64) -> Vec<Cascade> {
        if plan.cascades == 0 {
            return Vec::new();
        }
        // Nothing is nearer than the highest treetop is below the eye.
        let clear = (eye.position[2] - highest).clamp(0.0, 0.5 * plan.shadow_distance);
        let near = (0.02 * plan.shadow_distance).min(5.0).max(clear);
        let s = &scene.settings;
        let (count, split) = (plan.cascades, f64::from(s.cascade_split));
        crate::camera::cascades::cascades(
            eye,
            sun,
            (clear, near, plan.shadow_distance),
            count,
            split,
            s.cascade_size,
        )
    }

    /// Records the pass.
    pub fn record(
        &self,
        recorder: &mut Recorder,
        view: &Buffer,
        indices: &Buffer,
        (terrain, draws): (&TerrainData, &TerrainDraws),
        trees: Option<(&CullData, &SeedData, &SpeciesData)>,
    ) {
        let Some((ground, tree)) = &self.programs else { return };
        let targets = Targets {
            colors: &[],
            depth: Some(Attachment { image: &self.map, resolve: None, clear: Some([0.0; 4]) }),
            layers: self.map.layers(),
        };
        recorder.render("shadows", &targets, |pass| {
            pass.bind(
                ground,
                &[
                    ("view", Resource::Buffer(view)),
                    ("quads", Resource::Buffer(&terrain.quads)),
                    ("height_tiles", Resource::Texture(&terrain.height_tiles, Sampler::Nearest)),
                ],
            );
            for (c, (first, count)) in draws.cascades.iter().enumerate() {
                let parameters = terrain.parameters(*first);
                pass.push(&TerrainPush { parameters, cascade: c as u32 });
                pass.draw_indexed(indices, 6 * TERRAIN_CELLS * TERRAIN_CELLS, 0..*count);
            }
            let Some((tree, (cull, seeds, species))) = tree.as_ref().zip(trees) else { return };
            pass.bind(
                tree,
                &[
                    ("view", Resource::Buffer(view)),
                    ("trees", Resource::Buffer(&cull.trees)),
                    ("lists", Resource::Buffer(&cull.lists)),
                    ("species", Resource::Buffer(&species.table)),
                    ("bases", Resource::Buffer(&species.bases)),
                    ("views", Resource::Texture(&species.views, Sampler::LinearBorder)),
                ],
            );
            for c in 0..self.map.layers() {
                pass.push(&c);
                let command = u64::from(CAMERA_DRAWS + c) * size_of::<DrawCommand>() as u64;
                pass.draw_indexed_indirect(&seeds.quad_indices, &cull.commands, command);
            }
        });
    }
}
