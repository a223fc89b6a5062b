//! The trade of time for accuracy: each knob moved around each preset, then a small product of the knobs that matter.
//!
//! * [`design`] says which settings, and in which order.
//! * [`truth`] path-traces the reference, where none is given.
//! * [`run`] measures one: time in turn with the preset that it is a variation of (A B, B A, in one process), device memory, and
//!   the error of its images against a reference (if there is one) and against the most accurate setting.
//! * [`SweepResult`] holds what was measured, as it is written after every setting and read back to go on.
//! * [`judge`] makes sense of it: which settings lie on the [`front`], what each knob does, and which setting fits a budget.
//! * [`report`] writes it for people, [`mod@markdown`] for a README; [`kept`] finds it again.

mod chart;
pub mod design;
pub mod front;
pub mod judge;
pub mod kept;
pub mod markdown;
pub mod report;
mod result;
pub mod run;
pub mod truth;

pub use result::{CameraError, Identity, Point, SWEEP_SCHEMA_VERSION, Sample, SweepResult, Time};
