//! What a plan lists for trees that are their models' meshes.

use std::collections::HashMap;

use super::Plan;
use super::items::Items;
use super::names::resource;
use crate::gpu::interface::{
    DrawCommand, HIDING_STEPS, MESH_DRAWS, MESH_TREES, MESH_TRIANGLES, MeshFace, MeshKind, MeshTree,
};
use crate::gpu::{BufferDesc, Description, ImageDesc, vk};
use crate::physics::levels::BARK_LEVELS;
use crate::scene::mesh::Triangle;
use crate::scene::{Distribution, Mesh, Scene, Species};
use crate::{Error, Result};

/// Format and bytes of the texels as which corners, faces and envelopes are read.
const WORDS: (vk::Format, u64) = (vk::Format::R32G32B32A32_UINT, 16);
/// The same for what trees hide of the sky.
const PAIRS: (vk::Format, u64) = (vk::Format::R32G32_SFLOAT, 8);
/// The same for indices.
const INDEX: (vk::Format, u64) = (vk::Format::R32_UINT, 4);
/// 16-byte words of how light comes to a face: nine coefficients of either side, half floats.
pub const FACE_TRANSFER_WORDS: u64 = 3;
/// Bytes of a corner: its place and its texture coordinates.
const CORNER_BYTES: u64 = 16;
/// Texels along a side of a leaf mask, at most and at least.
const MASK_SIDES: [u32; 2] = [16, 1024];

/// Texels along a side of the masks of some meshes, which are layers of one array: as many as the largest has; and how many there are.
/// A material without holes has none.
fn leaf_masks<'a>(meshes: impl Iterator<Item = &'a Mesh>) -> (u32, u32) {
    let [least, most] = MASK_SIDES;
    let masked = meshes.flat_map(|m| &m.materials).filter(|m| m.alpha_cutoff.is_some());
    let sides = masked.filter_map(|m| m.texture.as_ref()).map(|t| t.width.max(t.height));
    let sides: Vec<u32> = sides.collect();
    let side = sides.iter().copied().max().unwrap_or(least).clamp(least, most);
    (side.next_power_of_two().min(most), sides.len() as u32)
}

/// Mean side of the leaves of a scene's models at their smallest scale, m, of the model with the smallest. Leaves are mostly cards of two
/// triangles: a leaf's side is that of a square of twice a triangle's area.
pub(super) fn leaf_side(scene: &Scene) -> f64 {
    let of = |mesh: &Mesh| -> f64 {
        let any = mesh.materials.iter().any(|m| m.foliage);
        let leaves = mesh.triangles.iter().filter(|t| !any || mesh.materials[t.material as usize].foliage);
        let (sides, count) = leaves.fold((0.0, 0u32), |(sum, count), t| {
            let [a, b, c] = t.vertices.map(|v| glam::Vec3::from(mesh.positions[v as usize]));
            (sum + f64::from((b - a).cross(c - a).length()).sqrt(), count + 1)
        });
        sides / f64::from(count.max(1))
    };
    let sides = scene.species.iter().map(|s| of(&s.mesh) * f64::from(s.scale[0]));
    sides.fold(f64::INFINITY, f64::min)
}

/// Most trees that may be within the ranges of meshes, m at a scale of 1, of an eye somewhere in a scene. Of a density, as many as
/// there are in a disc at full density, and five standard deviations more: points that keep a distance spread less than Poisson's. Of a
/// list, the most in any three by three squares as wide as the range, which hold every disc.
pub(super) fn most_in_range(scene: &Scene, ranges: &[f64]) -> f64 {
    let of = |(species, range): (&Species, &f64)| -> f64 {
        let range = range * species.largest_scale();
        if range <= 0.0 {
            return 0.0;
        }
        match &species.distribution {
            Distribution::Density { max_density, .. } => {
                let mean = f64::from(*max_density) * std::f64::consts::PI * range * range;
                mean + 5.0 * mean.sqrt()
            }
            Distribution::Positions(list) => {
                let mut squares: HashMap<[i64; 2], u32> = HashMap::new();
                for tree in list.iter() {
                    *squares.entry([tree.x, tree.y].map(|v| (v / range).floor() as i64)).or_default() += 1;
                }
                let mut nines: HashMap<[i64; 2], u32> = HashMap::new();
                for ([x, y], count) in &squares {
                    let around = (-1..=1).flat_map(|dx| (-1..=1).map(move |dy| [x + dx, y + dy]));
                    around.for_each(|at| *nines.entry(at).or_default() += count);
                }
                f64::from(nines.into_values().max().unwrap_or(0))
            }
        }
    };
    scene.species.iter().zip(ranges).map(of).sum()
}

/// 16-byte words of a triangle's envelope for viewers above or below, eight half floats each.
pub fn envelope_words(directions: u32) -> u32 {
    directions.div_ceil(8)
}

/// Most triangles of a mesh with its levels of bark, each of which has at most half of what the finer one has; and of the orders in which they are drawn: the whole, the leaves,
/// and the bark with its levels.
fn most_triangles(mesh: &Mesh) -> [u64; 2] {
    let foliage = |t: &&Triangle| mesh.materials[t.material as usize].foliage;
    let (all, leaves) = (mesh.triangles.len() as u64, mesh.triangles.iter().filter(foliage).count() as u64);
    // Without foliage all are leaves.
    let bark = if leaves > 0 { all - leaves } else { 0 };
    [all + bark, all + all + bark * (BARK_LEVELS as u64 - 1)]
}

/// That no model can have more triangles with its levels of bark, before these are made, than can be drawn.
pub(super) fn check_size(scene: &Scene) -> Result<()> {
    match scene.species.iter().find(|s| most_triangles(&s.mesh)[0] > u64::from(MESH_TRIANGLES)) {
        Some(species) => Err(Error::Usage(format!(
            "species \"{}\" may have {} triangles with its levels of bark, and meshes of up to {MESH_TRIANGLES} are drawn: simplify the model",
            species.name,
            most_triangles(&species.mesh)[0]
        ))),
        None => Ok(()),
    }
}

impl Plan {
    /// Corners, faces, crowns around leaves, and holes.
    pub(super) fn list_meshes(&self, scene: &Scene, items: &mut Items) {
        let words = |name, bytes| BufferDesc { texels: Some(WORDS), ..BufferDesc::new(name, bytes) };
        let most = scene.species.iter().map(|s| most_triangles(&s.mesh));
        let [triangles, drawn] = most.fold([0; 2], |sum, of| [sum[0] + of[0], sum[1] + of[1]]);
        let corners = words(resource::MESH_CORNERS, 3 * triangles * CORNER_BYTES);
        let faces = words(resource::MESH_FACES, triangles * size_of::<MeshFace>() as u64);
        let indices = BufferDesc {
            texels: Some(INDEX),
            ..BufferDesc::new(resource::MESH_INDICES, 3 * drawn * INDEX.1)
        };
        let kinds =
            BufferDesc::new(resource::MESH_KINDS, (scene.species.len() * size_of::<MeshKind>()) as u64);
        let reason = format!(
            "{} models and their levels of detail, whose triangles are drawn to {:.0} m",
            scene.species.len(),
            self.last_mesh_range
        );
        items.add("data", "meshes", reason, [corners, faces, indices, kinds]);
        if self.mesh_harmonics {
            let transfers = words(resource::FACE_TRANSFERS, triangles * 16 * FACE_TRANSFER_WORDS);
            items.add(
                "data",
                "face transfers",
                "how light comes to each face, as spherical harmonics",
                [transfers],
            );
        } else {
            let directions = scene.settings.leaf_directions;
            let envelopes =
                words(resource::ENVELOPES, 2 * triangles * 16 * u64::from(envelope_words(directions)));
            let reason = format!("how thick the crown around each leaf is in {directions} directions");
            let pairs = u64::from(directions) * u64::from(HIDING_STEPS);
            let hiding =
                BufferDesc { texels: Some(PAIRS), ..BufferDesc::new(resource::HIDING, pairs * PAIRS.1) };
            items.add("data", "leaf envelopes", reason, [envelopes, hiding]);
        }
        let (side, layers) = leaf_masks(scene.species.iter().map(|s| s.mesh.as_ref()));
        if layers > 0 {
            let image = ImageDesc {
                layers,
                levels: side.ilog2() + 1,
                ..ImageDesc::plain(resource::LEAF_MASKS, vk::Format::R8_UNORM, [side; 2])
            };
            items.add("data", "leaf masks", format!("{layers} materials have holes"), [image]);
        }
        let commands = u64::from(MESH_DRAWS * MESH_TREES) * size_of::<DrawCommand>() as u64;
        let draws = BufferDesc::new(resource::MESH_DRAWS, commands);
        let trees =
            BufferDesc::new(resource::MESH_TREES, u64::from(MESH_TREES) * size_of::<MeshTree>() as u64);
        let all: [Description; 2] = [draws.into(), trees.into()];
        items.add("target", "mesh trees", format!("up to {MESH_TREES} trees are meshes"), all);
    }
}
