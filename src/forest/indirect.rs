//! What leaves, bark and ground hand to each other of light ([`crate::physics::indirect`]), on the GPU: the nodes of all species in one
//! buffer, after those of the ground, and what of it each tree in view sends.

use crate::bake::Baked;
use crate::gpu::{Buffer, Gpu};
use crate::physics::indirect::{COEFFICIENTS, GROUND, Indirect};
use crate::plan::names::resource;
use crate::plan::{NODE_TEXELS, Plan, TREE_TEXELS};
use crate::{Error, Result};

/// Coefficients of a species' node: all but the ground's.
const NODE: usize = COEFFICIENTS - GROUND;

/// The light.
pub struct IndirectData {
    /// Coefficients, a texel each: of the ground node by node, then species by species. w of the first: the thickness at the last node.
    pub nodes: Buffer,
    /// Light that each tree in view sends, in the order of their records.
    pub handed: Buffer,
}

impl IndirectData {
    /// Uploads the light of a plan that has it; else one texel of each stands for what nobody reads.
    ///
    /// # Errors
    /// [`Error::Usage`] for bakes without it; [`Error::Device`] when out of memory.
    pub fn new(gpu: &Gpu, plan: &Plan, baked: &[Baked]) -> Result<Self> {
        let none = || gpu.texel_buffer("no handed light", TREE_TEXELS.1, TREE_TEXELS);
        if plan.indirect == 0 {
            let nodes = gpu.texel_buffer("no indirect light", NODE_TEXELS.1, NODE_TEXELS)?;
            return Ok(IndirectData { nodes, handed: none()? });
        }
        let missing =
            || Error::Usage("a species was baked without the indirect light that the plan lists".into());
        let all: Vec<&Indirect> = baked
            .iter()
            .map(|b| {
                b.indirect.as_deref().filter(|i| i.nodes.len() == plan.indirect as usize).ok_or_else(missing)
            })
            .collect::<Result<_>>()?;
        let texels = [ground(&all), species(&all)].concat();
        let handed =
            if plan.near_trees { gpu.described_buffer(&plan.buffer(resource::HANDED))? } else { none()? };
        Ok(IndirectData {
            nodes: gpu.described_buffer_with(&plan.buffer(resource::INDIRECT), &texels)?,
            handed,
        })
    }

    /// Texel where the first species' nodes begin.
    pub fn first_species(plan: &Plan) -> u32 {
        plan.indirect * GROUND as u32
    }
}

/// Nodes of the species, one after the other.
fn species(all: &[&Indirect]) -> Vec<[f32; 4]> {
    let nodes = all.iter().flat_map(|i| &i.nodes).flat_map(|node| &node[..NODE]);
    nodes.map(|[r, g, b]| [*r, *g, *b, 0.0]).collect()
}

/// Nodes of the ground, which is that of all species: the mean of what was measured with each.
fn ground(all: &[&Indirect]) -> Vec<[f32; 4]> {
    let Some(one) = all.first() else { return Vec::new() };
    let mut nodes = vec![[0.0f32; 4]; one.nodes.len() * GROUND];
    for indirect in all {
        let rows = indirect.nodes.iter().flat_map(|node| &node[NODE..]);
        for (sum, row) in nodes.iter_mut().zip(rows) {
            (0..3).for_each(|c| sum[c] += row[c] / all.len() as f32);
        }
    }
    nodes[0][3] = one.max_thickness;
    nodes
}
