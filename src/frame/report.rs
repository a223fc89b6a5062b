//! What a frame took and drew; and a frame in flight, whose report is whole when the device is done.

use crate::clock::{process_cpu_ms_since, process_cpu_ns};
use crate::forest::cull::TreeCounts;
use crate::gpu::interface::{CardKind, DrawCommand, MeshKind, TileState, View};
use crate::gpu::{Done, InFlight, Later, Timing};

/// Contents of the caches, by cache.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Tiles {
    /// Quads of terrain: heights and slopes.
    pub terrain: u32,
    /// Quads of tree seeds.
    pub seeds: u32,
    /// Coverage tiles.
    pub coverage: u32,
}

impl Tiles {
    /// What came since there were so many; a cache that is made anew begins to count again.
    pub(super) fn since(self, before: Tiles) -> Tiles {
        Tiles {
            terrain: self.terrain.saturating_sub(before.terrain),
            seeds: self.seeds.saturating_sub(before.seeds),
            coverage: self.coverage.saturating_sub(before.coverage),
        }
    }
}

/// What a frame took and drew.
#[derive(Clone, Debug, Default, serde::Serialize)]
pub struct FrameReport {
    /// What its recording measured: GPU time of every pass, in order.
    pub timing: Timing,
    /// When it began, on the clock of [`crate::clock::monotonic_ns`].
    pub start_ns: u64,
    /// CPU wall time of choosing what is drawn and uploading it, ms.
    pub stream_ms: f64,
    /// CPU wall time of recording commands, ms.
    pub record_ms: f64,
    /// CPU time of all threads of the process from its beginning until the device was done, ms; of frames that were in flight
    /// meanwhile too.
    pub cpu_ms: Option<f64>,
    /// Tiles produced.
    pub produced: Tiles,
    /// Tiles thrown out of their caches for others.
    pub evicted: Tiles,
    /// Trees drawn.
    pub trees: TreeCounts,
    /// Terrain quads drawn to the image.
    pub terrain_quads: u32,
    /// Seed quads culled.
    pub seed_quads: u32,
}

/// When a frame began.
pub(super) struct Began {
    pub start_ns: u64,
    cpu: Option<u64>,
}

impl Began {
    pub fn now() -> Self {
        Began { start_ns: crate::clock::monotonic_ns(), cpu: process_cpu_ns() }
    }

    /// CPU time of all threads since, ms.
    pub fn cpu_ms(&self) -> Option<f64> {
        process_cpu_ms_since(self.cpu)
    }
}

/// What a frame has read back.
#[derive(Default)]
pub(super) struct ReadBacks {
    /// What the tiles found.
    pub tiles: Option<Later<TileState>>,
    /// Species as meshes, with how many trees are such.
    pub meshes: Option<Later<MeshKind>>,
    /// Species as clouds of cards, with how many trees are such.
    pub cards: Option<Later<CardKind>>,
    /// Trees in view.
    pub trees: Option<Later<u32>>,
    /// Draws of casters, and the cascade of each of a batch's.
    pub casters: Option<(Later<DrawCommand>, Vec<usize>)>,
    /// Cascades drawn to.
    pub cascades: usize,
}

impl ReadBacks {
    /// How many trees the frame drew.
    pub fn counts(&self, done: &Done) -> TreeCounts {
        let mut counts = TreeCounts { cascades: vec![0; self.cascades], ..TreeCounts::default() };
        if let Some(total) = &self.trees {
            counts.camera = done.get(total)[0];
        }
        if let Some(draws) = &self.meshes {
            counts.meshes = done.get(draws).iter().map(|k| k.tree_count).sum();
        }
        if let Some(draws) = &self.cards {
            counts.cards = done.get(draws).iter().map(|k| k.tree_count).sum();
        }
        if let Some((commands, cascades)) = &self.casters {
            for (command, cascade) in done.get(commands).iter().zip(cascades.iter().cycle()) {
                counts.cascades[*cascade] += command.index_count / 6;
            }
        }
        counts
    }
}

/// A frame that the device works on; [`super::Renderer::finish`] waits for it. Dropped, it is waited for and not reported.
#[must_use]
pub struct Ticket {
    pub(super) flight: InFlight,
    pub(super) reads: ReadBacks,
    pub(super) view: View,
    pub(super) began: Began,
    /// When recording began, ns.
    pub(super) record_ns: u64,
    /// What is known already.
    pub(super) report: FrameReport,
}

impl FrameReport {
    /// Adds what is known when the device is done.
    pub(super) fn complete(
        self,
        began: &Began,
        record_ns: u64,
        done: Done,
        trees: TreeCounts,
    ) -> FrameReport {
        let ms = |from: u64, to: u64| to.saturating_sub(from) as f64 * 1e-6;
        let timing = done.timing;
        FrameReport {
            start_ns: began.start_ns,
            stream_ms: ms(began.start_ns, record_ns),
            record_ms: (ms(record_ns, timing.done_ns) - timing.wait_ms).max(0.0),
            cpu_ms: began.cpu_ms(),
            timing,
            trees,
            ..self
        }
    }
}
