//! How true the renderer is for forests of many kinds: patches of a fixed design against path tracing of the same trees.
//!
//! * [`design`] says which forests, densities, suns and slopes, and which of them are kept apart from all tuning.
//! * [`run`] measures one cell after the other, and keeps each in a file of its own: what was traced stays, whatever becomes of the
//!   renderer; what was drawn stays until the program or its settings change.
//! * [`score`] makes errors of them, and says which term is wrong.
//! * [`report`] writes them for people, the worst first.

pub mod design;
pub mod report;
pub mod run;
pub mod score;

use std::collections::BTreeMap;

use super::host::Host;
use super::reflectance::Measured;
use super::results::DeviceIdentity;
use design::Cell;
use score::Score;

/// Version of [`Accuracy`]; raised when a key changes its meaning or goes.
pub const ACCURACY_SCHEMA_VERSION: u32 = 1;

/// What was drawn of a cell by a ladder from a distance.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Drawn {
    /// The ladder, as users write it.
    pub ladder: String,
    /// Distance, m.
    pub distance: f64,
    /// As many as the reference's.
    pub views: Vec<Measured>,
}

impl Drawn {
    /// `LADDER@METRES`.
    pub fn name(&self) -> String {
        format!("{}@{}", self.ladder, self.distance)
    }
}

/// A cell, measured.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct CellResult {
    /// Which.
    pub cell: Cell,
    /// Path-traced.
    pub reference: Vec<Measured>,
    /// What was drawn, and how far that is from the reference.
    pub drawn: Vec<(Drawn, Score)>,
}

/// All that was measured of a design.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Accuracy {
    /// [`ACCURACY_SCHEMA_VERSION`].
    pub schema_version: u32,
    /// `accuracy`.
    pub command: String,
    /// Value of every knob.
    pub settings: BTreeMap<String, f64>,
    /// Which device drew.
    pub device: DeviceIdentity,
    /// Which machine and build.
    pub host: Host,
    /// Cells in the order of the design.
    pub cells: Vec<CellResult>,
    /// Names of cells that are not measured yet.
    pub missing: Vec<String>,
}
