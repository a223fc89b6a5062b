//! What finds the samples of trees, and what compute tiles take for that.

use super::Plan;
use super::names::{pass, pipeline};
use crate::gpu::interface::{DEPTH_BINS, ORDER_LANES, SCAN_BLOCK, SIGHT_TEXELS, TileState};
use crate::gpu::{BufferDesc, DeviceInfo, tree_components, vk};
use crate::ladder::Ladder;
use crate::{Error, Result};

/// Steps of writing the lists (trees, and entries): an invocation takes 1/64 of them at most, and drivers end loops after 65,535 turns.
pub const TILE_STEPS: u32 = 3 << 20;
/// Invocations that write the lists on a CPU, and on a GPU, of which fewer would leave most idle; each has a count a list.
const LIST_LANES: [u32; 2] = [64, 512];
/// Lists of a picture, at most.
const MOST_LISTS: u32 = 16384;

/// Pipelines of the tiles that find and light trees.
pub(super) const TREE_PIPELINES: [(&str, &str); 6] = [
    (pipeline::TREE_ORDER, "trees of the tiles, sorted front to back"),
    (pipeline::TREE_SIGHTS, "what finding a tree's samples takes, once a tree"),
    (pipeline::TILE_LISTS, "which trees may be seen in which square of pixels"),
    (pipeline::TILES, "the tree that each sample sees before the ground"),
    (pipeline::TREE_LIGHT, "light on trees, once a pixel and tree that it sees"),
    (pipeline::TILE_SUMS, "prefix sums of the tiles' counts"),
];
/// Passes of the tiles that find trees.
pub(super) const TREE_PASSES: [(&str, &str); 5] = [
    (pass::TREE_ORDER, "trees in view front to back, so that tiles may stop early"),
    (pass::TREE_SIGHTS, "what finding a tree's samples takes, once a tree"),
    (pass::LIST_COUNTS, "no entries yet"),
    (pass::TILE_LISTS, "which trees may be seen in which square of pixels"),
    (pass::TILES, "the tree that each sample sees before the ground"),
];

/// What finds the samples of trees that are drawn one by one, and whether the ground is lit as it is drawn or where it is seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Rasterizer {
    /// The graphics pipeline: a quad a tree, every fragment lit.
    Graphics,
    /// Compute tiles: front to back, visibility first, then each pixel's trees lit once.
    Tiles,
}

impl Rasterizer {
    /// All, with the names that users write; `None` leaves the choice to the plan: tiles where the device can hold what they read, because
    /// layers of trees behind each other cost most, on CPUs and on the GPU where both were measured; else the graphics pipeline.
    pub const NAMES: [(&'static str, Option<Rasterizer>); 3] =
        [("auto", None), ("graphics", Some(Rasterizer::Graphics)), ("tiles", Some(Rasterizer::Tiles))];

    /// The name that users write.
    pub fn name(self) -> &'static str {
        Self::NAMES.iter().find(|(_, r)| *r == Some(self)).map_or("", |(n, _)| n)
    }
}

/// How a picture's trees are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Drawing {
    /// What stands for a tree, near to far; `None`: what the scene says.
    pub ladder: Option<Ladder>,
    /// What finds its samples; `None`: what suits the device (see [`Rasterizer::NAMES`]).
    pub rasterizer: Option<Rasterizer>,
}

impl From<Ladder> for Drawing {
    fn from(ladder: Ladder) -> Self {
        Drawing { ladder: Some(ladder), rasterizer: None }
    }
}

impl From<Rasterizer> for Drawing {
    fn from(rasterizer: Rasterizer) -> Self {
        Drawing { ladder: None, rasterizer: Some(rasterizer) }
    }
}

/// A buffer of the tiles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TileBuffer {
    /// What it is.
    pub desc: BufferDesc,
    /// What needs it.
    pub(super) reason: &'static str,
}

/// What compute tiles take for trees.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TileBuffers {
    /// log2 of the pixels along a side of a square that has a list.
    pub list_shift: u32,
    /// Lists along a row and down a column.
    pub lists: [u32; 2],
    /// Bin of depth of each tree.
    pub keys: TileBuffer,
    /// Trees a bin and invocation.
    pub depth_counts: TileBuffer,
    /// Trees front to back.
    pub order: TileBuffer,
    /// A record a tree, front to back.
    pub records: TileBuffer,
    /// A box a tree, front to back.
    pub boxes: TileBuffer,
    /// Steps before each tree's first.
    pub spans: TileBuffer,
    /// Which tree each of them is.
    pub ranked: TileBuffer,
    /// Where each part of a list ends.
    pub list_counts: TileBuffer,
    /// Sums of blocks of any of these counts.
    pub blocks: TileBuffer,
    /// Trees of the lists.
    pub entries: TileBuffer,
    /// What the passes find.
    pub state: TileBuffer,
    /// Tree that each sample sees.
    pub seen: TileBuffer,
    /// And how deep, for lists of several parts.
    pub depths: TileBuffer,
}

impl TileBuffers {
    /// For a plan's image and trees.
    pub fn new(plan: &Plan) -> Self {
        let lists_of = |shift: u32| plan.size.map(|n| n.div_ceil(1 << shift));
        let few = |shift: &u32| {
            let [across, down] = lists_of(*shift);
            across.checked_mul(down).is_some_and(|n| n <= MOST_LISTS)
        };
        let list_shift = (3..32).find(few).unwrap_or(31);
        let lists = lists_of(list_shift);
        let list_parts = u64::from(lists[0] * lists[1] * plan.list_lanes);
        let trees = u64::from(plan.tree_capacity);
        let counts = list_parts.max(trees).max(u64::from(DEPTH_BINS * ORDER_LANES));
        let blocks = counts.div_ceil(u64::from(SCAN_BLOCK));
        let samples = u64::from(plan.size[0]) * u64::from(plan.size[1]) * u64::from(plan.samples);
        let buffer = |name, bytes, texel, reason| {
            let texels = match texel {
                0 => None,
                4 => Some((vk::Format::R32_UINT, 4)),
                8 => Some((vk::Format::R32G32_UINT, 8)),
                _ => Some((vk::Format::R32G32B32A32_UINT, 16)),
            };
            TileBuffer { desc: BufferDesc { name, bytes, texels }, reason }
        };
        TileBuffers {
            list_shift,
            lists,
            keys: buffer("tree depth bins", trees * 4, 0, "depth of every tree in view"),
            depth_counts: buffer(
                "depth counts",
                4 + 4 * u64::from(DEPTH_BINS * ORDER_LANES),
                0,
                "sorting trees by depth without atomics",
            ),
            order: buffer("trees front to back", trees * 4, 0, "trees in view in the order of depth"),
            records: buffer(
                "tree sights",
                trees * 16 * u64::from(SIGHT_TEXELS),
                16,
                "what finding a tree's samples takes",
            ),
            boxes: buffer("tree boxes", trees * 8, 8, "where on the screen a tree may be"),
            spans: buffer("tree spans", 4 + trees * 4, 0, "in how many lists a tree is"),
            ranked: buffer("trees by rank", trees * 4, 4, "which tree a record is of"),
            list_counts: buffer(
                "list ends",
                4 + 4 * list_parts,
                4,
                "where the lists of squares of pixels end",
            ),
            blocks: buffer("block sums", 4 * blocks.max(1), 0, "prefix sums of counts by many workgroups"),
            entries: buffer(
                "list entries",
                4 * u64::from(plan.tile_steps.max(1)),
                4,
                "the trees of each square of pixels, front to back",
            ),
            state: buffer("tile state", size_of::<TileState>() as u64, 0, "how many trees there are"),
            seen: buffer("trees seen", 4 * samples, 4, "the tree that each sample sees"),
            depths: buffer("depths seen", 4 * samples, 0, "depth of samples, between parts of long lists"),
        }
    }

    /// Every buffer, in the order of allocation.
    pub fn all(&self) -> [&TileBuffer; 13] {
        [
            &self.keys,
            &self.depth_counts,
            &self.order,
            &self.records,
            &self.boxes,
            &self.spans,
            &self.ranked,
            &self.list_counts,
            &self.blocks,
            &self.entries,
            &self.state,
            &self.seen,
            &self.depths,
        ]
    }

    /// What of it a device does not take; empty if it takes all.
    fn beyond(&self, device: &DeviceInfo) -> Option<String> {
        let texels = u64::from(device.max_texel_elements);
        self.all().into_iter().find_map(|b| {
            let BufferDesc { name, bytes, texels: read } = b.desc;
            let wanted = read.map_or(0, |(_, texel)| bytes / texel);
            if wanted > texels {
                return Some(format!("\"{name}\" has {wanted} texels, and shaders read {texels} at most"));
            }
            (bytes > device.max_storage_bytes)
                .then(|| format!("\"{name}\" is larger than a storage buffer may be"))
        })
    }
}

impl Plan {
    /// Takes a rasteriser, or the one that suits the device.
    pub(super) fn choose_rasterizer(
        &mut self,
        wanted: Option<Rasterizer>,
        device: Option<&DeviceInfo>,
    ) -> Result<()> {
        self.list_lanes = LIST_LANES[usize::from(device.is_some_and(|d| d.kind != "cpu"))];
        let beyond = device
            .filter(|_| self.z_fields || !(self.cards || self.shells))
            .and_then(|d| TileBuffers::new(self).beyond(d));
        let narrow = device.filter(|d| self.z_fields && d.max_vertex_components < tree_components());
        if let Some(d) = narrow.filter(|_| wanted == Some(Rasterizer::Graphics) || beyond.is_some()) {
            return Err(Error::Usage(format!(
                "--rasterizer graphics: {} passes {} components from vertices to fragments, and its trees take {}: use --rasterizer \
                 tiles, for fewer trees or a smaller picture if need be",
                d.name,
                d.max_vertex_components,
                tree_components()
            )));
        }
        let near = match (self.meshes, self.cards, self.shells) {
            (true, ..) => Some(("meshes near this camera", "mesh")),
            (_, true, _) => Some(("clouds of cards near this camera", "cards")),
            (.., true) => Some(("slices of a forest", "shells")),
            _ => None,
        };
        if let Some((what, rung)) = near.filter(|_| wanted == Some(Rasterizer::Graphics)) {
            return Err(Error::Usage(format!(
                "--rasterizer graphics: trees are {what}, and those are lit where tiles see them: use --rasterizer \
                 tiles, or a ladder without {rung}"
            )));
        }
        self.rasterizer = match (wanted, beyond) {
            (None, Some(why)) if near.is_some() => {
                let (what, rung) = near.unwrap_or_default();
                return Err(Error::Usage(format!(
                    "trees are {what}, which takes tiles: {why} on this device: draw fewer trees or a smaller picture, \
                     or use a ladder without {rung}"
                )));
            }
            (Some(Rasterizer::Tiles), Some(why)) => {
                return Err(Error::Usage(format!(
                    "--rasterizer tiles: {why} on this device: draw fewer trees or a smaller picture, or use --rasterizer graphics"
                )));
            }
            (Some(rasterizer), _) => rasterizer,
            (None, None) => Rasterizer::Tiles,
            (None, Some(_)) => Rasterizer::Graphics,
        };
        Ok(())
    }
}
