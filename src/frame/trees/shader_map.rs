//! The shader-map pass: forest fractions and radiances from the tables, at every second vertex of the terrain (BN12, section 6).

use crate::Result;
use crate::forest::indirect::IndirectData;
use crate::forest::terrain::{TerrainData, TerrainDraws};
use crate::frame::Forest;
use crate::gpu::{Buffer, Gpu, Program, Recorder, Resource, Sampler, shaders};
use crate::plan::Plan;
use crate::plan::names::{pass, resource};

/// Nodes of every terrain quad in view, and what computes them.
pub struct ShaderMap {
    /// [`crate::gpu::interface::ForestNode`]s, 17 × 17 a quad, in the order of the camera's terrain quads.
    pub nodes: Buffer,
    program: Program,
}

impl ShaderMap {
    /// Allocates for a plan.
    ///
    /// # Errors
    /// [`crate::Error::Device`] when out of memory.
    pub fn new(gpu: &Gpu, plan: &Plan, forest: &Forest) -> Result<Self> {
        let float = |n: u32| (n as f32).to_bits();
        Ok(ShaderMap {
            nodes: gpu.described_buffer(&plan.buffer(resource::NODES))?,
            program: gpu.compute(
                &shaders::FRAME_TREES_SHADER_MAP_COMP,
                &[
                    ("COVER_CHANNELS", plan.cover_channels),
                    ("SPECIES_COUNT", forest.species.count),
                    ("TABLE_ANGLES", float(forest.tables.angles)),
                    ("TABLE_DENSITIES", float(forest.tables.densities)),
                    ("PAIR_TABLES", u32::from(plan.pair_tables)),
                    ("INDIRECT", u32::from(plan.indirect > 0)),
                    ("SHOWS_TREES", u32::from(!plan.shells)),
                    ("INDIRECT_FIRST", IndirectData::first_species(plan)),
                ],
            )?,
        })
    }

    /// Records the pass.
    pub fn record(
        &self,
        recorder: &mut Recorder,
        view: &Buffer,
        (terrain, draws): (&TerrainData, &TerrainDraws),
        forest: &Forest,
    ) {
        if draws.camera.1 == 0 {
            return;
        }
        recorder.compute(pass::SHADER_MAP, |pass| {
            pass.bind(
                &self.program,
                &[
                    ("view", Resource::Buffer(view)),
                    ("quads", Resource::Buffer(&terrain.quads)),
                    ("height_tiles", Resource::Texture(&terrain.height_tiles, Sampler::Nearest)),
                    ("slope_tiles", Resource::Texture(&terrain.slope_tiles, Sampler::Nearest)),
                    ("cover_tiles", Resource::Texture(&forest.coverage.tiles, Sampler::Linear)),
                    ("nodes", Resource::Buffer(&self.nodes)),
                    ("pair_table", Resource::Texture(&forest.tables.pairs, Sampler::Linear)),
                    ("view_table", Resource::Texture(&forest.tables.views, Sampler::Linear)),
                    ("indirect", Resource::Texels(&forest.indirect.nodes)),
                    ("species", Resource::Buffer(&forest.species.table)),
                ],
            );
            pass.push(&terrain.parameters(draws.camera.0));
            pass.dispatch([draws.camera.1, 1, 1]);
        });
    }
}
