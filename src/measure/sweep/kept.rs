//! Sweeps kept in the cache, found again by scene, image size and device; and the setting of one that holds a time.

use std::path::{Path, PathBuf};

use super::judge::{Row, fit, least_ms};
use super::result::{Identity, Point, SweepResult};
use crate::ladder::Ladder;
use crate::measure::metrics::Estimate;
use crate::measure::results::{DeviceIdentity, SceneIdentity};
use crate::settings::Settings;
use crate::{Error, Result};

/// What a frame is drawn of, how large and on what.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Subject {
    /// Which scene.
    pub scene: SceneIdentity,
    /// Image size, pixels.
    pub size: [u32; 2],
    /// Which device.
    pub device: DeviceIdentity,
    /// By which rasteriser, where one was chosen.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rasterizer: Option<String>,
    /// By which ladder, where that is not the usual.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ladder: Option<String>,
}

/// A ladder as it is kept: not at all if it is that of BN12, as with results of before there was a choice.
pub fn kept_ladder(ladder: &Ladder) -> Option<String> {
    (*ladder != Ladder::BN12).then(|| ladder.to_string())
}

impl From<&Identity> for Subject {
    fn from(i: &Identity) -> Self {
        Subject {
            scene: i.scene.clone(),
            size: i.size,
            device: i.device.clone(),
            rasterizer: i.rasterizer.clone(),
            ladder: i.ladder.clone(),
        }
    }
}

/// Where the sweep of a subject is kept in a cache.
///
/// # Errors
/// [`Error::Check`] if the subject cannot be written as JSON.
pub fn file(cache: &Path, subject: impl Into<Subject>) -> Result<PathBuf> {
    let text =
        serde_json::to_vec(&subject.into()).map_err(|e| Error::Check(format!("subject as JSON: {e}")))?;
    Ok(cache.join("sweeps").join(crate::files::digest(&text) + ".json"))
}

/// Keeps a result there.
///
/// # Errors
/// [`Error::Io`].
pub fn keep(file: &Path, result: &SweepResult) -> Result<()> {
    if let Some(folder) = file.parent() {
        std::fs::create_dir_all(folder).map_err(|e| Error::io(folder, e))?;
    }
    result.write(file)
}

/// The setting of a sweep that was taken for a budget.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Choice {
    /// Time that a frame may take, ms.
    pub budget_ms: f64,
    /// Name of the setting.
    pub setting: String,
    /// Wall time that its frames took, ms.
    pub wall_ms: Estimate,
    /// Root of its mean squared error of radiance, relative to the mean.
    pub error: Estimate,
    /// The sweep.
    pub sweep: String,
    /// CPU that it was measured on.
    pub cpu: String,
    /// Device that it was measured on.
    pub device: String,
    /// In what it differs from what is drawn now: `scene`, `device`, `rasterizer`, `ladder`; the time then says less.
    pub differs: Vec<&'static str>,
    /// Every knob.
    #[serde(skip)]
    pub settings: Settings,
}

/// The most accurate setting of a sweep whose wall time, with its interval, holds a budget.
///
/// # Errors
/// [`Error::Io`] and [`Error::Input`] for a file that is no sweep, or one of another image size: no time is scaled;
/// [`Error::Usage`] where no setting is as fast.
pub fn choose(file: &Path, subject: &Subject, budget_ms: f64) -> Result<Choice> {
    let result = SweepResult::load(file)?;
    let swept = Subject::from(&result.identity);
    if swept.size != subject.size {
        let [w, h] = swept.size;
        let what = format!("a sweep at {w}x{h}, which says nothing of other sizes");
        return Err(Error::input(
            file,
            "",
            what,
            format!("render with --size {w}x{h}, or sweep the size that you want"),
        ));
    }
    let differs = [
        ("scene", swept.scene != subject.scene),
        ("device", swept.device != subject.device),
        ("rasterizer", swept.rasterizer != subject.rasterizer),
        ("ladder", swept.ladder != subject.ladder),
    ];
    let (point, row): (&Point, Row) = fit(&result, budget_ms).ok_or_else(|| {
        let least = least_ms(&result).map_or("nothing was measured".into(), |ms| format!("the fastest takes {ms:.1} ms"));
        Error::Usage(format!(
            "no setting of {} holds {budget_ms} ms: {least}\n  remedy: allow more time, or sweep a smaller --size",
            file.display()
        ))
    })?;
    let wall_ms = point.time.as_ref().map_or(Estimate { value: f64::NAN, interval: None }, |t| t.wall_ms);
    Ok(Choice {
        budget_ms,
        setting: point.name.clone(),
        wall_ms,
        error: row.error,
        sweep: file.display().to_string(),
        cpu: result.identity.cpu.0.clone(),
        device: result.identity.device.name.clone(),
        differs: differs.into_iter().filter(|(_, differs)| *differs).map(|(what, _)| what).collect(),
        settings: point.settings.clone(),
    })
}
