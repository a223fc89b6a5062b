//! What a sweep measured, as it is written and read back.

use std::collections::BTreeMap;
use std::path::Path;

use super::design::Group;
use crate::measure::host::Host;
use crate::measure::metrics::{Difference, Estimate};
use crate::measure::results::{DeviceIdentity, SceneIdentity};
use crate::settings::Settings;
use crate::{Error, Result};

/// Version of [`SweepResult`]; raised when a key changes its meaning or goes.
pub const SWEEP_SCHEMA_VERSION: u32 = 1;

/// Everything that a sweep found so far.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct SweepResult {
    /// [`SWEEP_SCHEMA_VERSION`].
    pub schema_version: u32,
    /// `sweep`.
    pub command: String,
    /// What all of it depends on.
    pub identity: Identity,
    /// BLAKE3 of `identity`, in hexadecimal: results of another one are not gone on with.
    pub digest: String,
    /// Which machine and build.
    pub host: Host,
    /// What is timed: `cpu_ms` on software drivers, else `gpu_ms`.
    pub quantity: String,
    /// The settings measured, in the order of measuring.
    pub points: Vec<Point>,
    /// Settings that were not measured: other shards', or left when the time was up.
    pub left: Vec<String>,
}

/// What the results of a sweep depend on.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Identity {
    /// Which scene.
    pub scene: SceneIdentity,
    /// Image size, pixels.
    pub size: [u32; 2],
    /// Cameras, with where they stand.
    pub cameras: Vec<String>,
    /// The presets as the scene and the user change them.
    pub presets: BTreeMap<String, Settings>,
    /// The most accurate setting.
    pub most_accurate: Settings,
    /// Knobs that are swept, those with values of their own as `samples=1/4`.
    pub knobs: Vec<String>,
    /// What finds the samples of trees, where it was chosen: `graphics` or `tiles`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rasterizer: Option<String>,
    /// What stands for a tree, near to far, where that is not the usual.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ladder: Option<String>,
    /// Ladders that are drawn at every preset.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub ladders: Vec<String>,
    /// Frames of each camera and setting that are timed, the first of which only warms up.
    pub rounds: u32,
    /// Which device.
    pub device: DeviceIdentity,
    /// CPU and hardware threads, which software drivers draw with.
    pub cpu: (String, u32),
    /// BLAKE3 of the program file.
    pub program: Option<String>,
    /// BLAKE3 of the reference of each camera, if there is one.
    pub references: Vec<String>,
}

impl Identity {
    /// BLAKE3 of it as JSON, in hexadecimal.
    ///
    /// # Errors
    /// [`Error::Check`] if it cannot be written as JSON.
    pub fn digest(&self) -> Result<String> {
        let text = serde_json::to_string(self).map_err(|e| Error::Check(format!("identity as JSON: {e}")))?;
        Ok(blake3::hash(text.as_bytes()).to_hex().to_string())
    }
}

/// A setting measured.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Point {
    /// Preset and what differs from it.
    pub name: String,
    /// The preset that it was drawn in turn with.
    pub base: String,
    /// Why it was measured.
    pub group: Group,
    /// Knobs that differ from those of its preset.
    pub changed: BTreeMap<String, f64>,
    /// What stands for a tree, where it is not what the sweep's scene says.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ladder: Option<String>,
    /// Every knob.
    pub settings: Settings,
    /// Why it cannot be drawn; empty if it can. Nothing else was measured then.
    pub refused: String,
    /// Time of a frame.
    pub time: Option<Time>,
    /// Device memory that the plan says, bytes.
    pub planned_bytes: u64,
    /// Device memory that it allocated, bytes.
    pub allocated_bytes: u64,
    /// Samples a pixel that were drawn: as many as the setting says, as far as the device goes.
    pub samples: u32,
    /// Error of the images, by camera.
    pub errors: Vec<CameraError>,
}

/// Time of a frame, against the preset that was drawn in turn.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Time {
    /// Over the preset's, with its interval: median of the rounds, of which each is the geometric mean of its cameras.
    pub ratio: Estimate,
    /// Median over all frames, ms.
    pub ms: f64,
    /// Wall time: median over the rounds of the mean of their cameras, ms.
    pub wall_ms: Estimate,
    /// Every frame.
    pub samples: Vec<Sample>,
}

/// A frame of a setting and of the preset drawn beside it.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Sample {
    /// Round, from 0: the first only warms up.
    pub round: u32,
    /// Camera.
    pub view: u32,
    /// The setting's, ms.
    pub ms: f64,
    /// The preset's, ms.
    pub base_ms: f64,
    /// The setting's wall time, ms.
    pub wall_ms: f64,
}

/// Error of one camera's image.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct CameraError {
    /// Camera.
    pub camera: String,
    /// Against the reference, if there is one.
    pub against_reference: Option<Difference>,
    /// Against the most accurate setting.
    pub against_most_accurate: Difference,
    /// Squared errors of blocks of the foreground against the reference.
    pub reference_blocks: Vec<f64>,
    /// The same against the most accurate setting.
    pub most_accurate_blocks: Vec<f64>,
    /// Change under a small move of the camera beyond that of the most accurate setting.
    pub popping: Option<Estimate>,
}

impl SweepResult {
    /// Reads a result that `canopy sweep` wrote.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Input`] for another kind of file or another version.
    pub fn load(file: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(file).map_err(|e| Error::io(file, e))?;
        let remedy = "write one with `canopy sweep -o DIR`";
        let any: serde_json::Value =
            serde_json::from_str(&text).map_err(|e| Error::input(file, "", e.to_string(), remedy))?;
        if any["command"] != "sweep" || any["schema_version"].as_u64() != Some(SWEEP_SCHEMA_VERSION.into()) {
            let what = format!("no sweep of schema_version {SWEEP_SCHEMA_VERSION}");
            return Err(Error::input(file, "", what, remedy));
        }
        serde_json::from_value(any).map_err(|e| Error::input(file, "", e.to_string(), remedy))
    }

    /// Writes it as a whole.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn write(&self, file: &Path) -> Result<()> {
        let text = serde_json::to_string(self).map_err(|e| Error::io(file, std::io::Error::other(e)))?;
        crate::files::write_whole(file, (text + "\n").as_bytes())
    }

    /// Takes over the points of a result of the same sweep that this one has not.
    ///
    /// # Errors
    /// [`Error::Input`] for a result of another sweep, which says in what it differs.
    pub fn take(&mut self, other: SweepResult, file: &Path) -> Result<()> {
        if other.digest != self.digest {
            let parts = |i: &Identity| serde_json::to_value(i).unwrap_or_default();
            let (mine, its) = (parts(&self.identity), parts(&other.identity));
            let differing = mine.as_object().into_iter().flatten().filter(|(k, v)| its[k.as_str()] != **v);
            let names: Vec<&str> = differing.map(|(k, _)| k.as_str()).collect();
            let what = format!("results of another sweep: {} differ", names.join(", "));
            let remedy = "give another folder with -o, or remove this one's sweep.json";
            return Err(Error::input(file, "", what, remedy));
        }
        for point in other.points {
            if self.points.iter().all(|p| p.name != point.name) {
                self.points.push(point);
            }
        }
        Ok(())
    }
}
