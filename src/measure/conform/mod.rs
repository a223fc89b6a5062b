//! Conformance: does this driver draw what canopy means? Small scenes and function probes, each a named case.
//!
//! - `image/…`: a picture of the graphics pipeline against the reference of this driver by FLIP; on a driver without references of its own, against the
//!   nearest one's, loosely.
//! - `tiles/…`: the picture of compute tiles against that of the graphics pipeline, both drawn there and then.
//! - `frame/…`: what must hold of the same scenes on any driver, by either rasteriser: every number finite, fractions that sum to one, no light
//!   from nowhere.
//! - `probe/…`: shader functions against their twins in double precision; the coverage law of sample masks.
//! - `determinism/…`: the same bits from another renderer, after a flight, for any number of driver threads, and whatever tiles skip.
//! - `validation/…`: silence of each kind of validation, after a deliberate fault has proved it awake.

mod expectations;
mod frames;
mod images;
mod law;
pub mod probe;
mod report;
mod scenes;
mod tiles;
mod validation;

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use crate::gpu::{Gpu, GpuOptions, find};
use crate::plan::ViewMode;
use crate::{Error, Result};

pub use expectations::{Expectation, Expectations};
pub use images::Comparison;
pub use report::{junit, sheet};

/// Where a suite finds and leaves things.
#[derive(Clone, Debug)]
pub struct Options {
    /// Device by UUID or part of its name; `None` takes the best that fits.
    pub device: Option<String>,
    /// Folder with `expectations.txt` and a folder of pictures for each driver.
    pub references: PathBuf,
    /// Write references instead of comparing with them.
    pub bless: bool,
    /// The program, for cases that need a process of their own.
    pub program: PathBuf,
    /// Bakes on disk; `None` bakes every time.
    pub cache: Option<PathBuf>,
}

/// A named case.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Case {
    /// `kind/name`.
    pub name: String,
    kind: Kind,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Image(usize),
    Tiles(usize),
    Frame(usize),
    Probe(usize),
    Threads(&'static str),
    Again,
    Return,
    Shortcuts,
    Validation(usize),
}

/// What a case came to, before anything is expected of it.
#[derive(Clone, Debug)]
pub struct Finding {
    /// Why it failed; `None` if it passed.
    pub failure: Option<String>,
    /// What was measured.
    pub measured: String,
    /// The pictures of an image case.
    pub comparison: Option<Comparison>,
}

/// How a case ended, given what is expected of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// As it should be.
    Pass,
    /// Wrong.
    Fail,
    /// Wrong, as expected on this driver.
    ExpectedFail,
    /// Right, though a failure is expected: the expectation is out of date. Counts as a failure.
    UnexpectedPass,
    /// Right or wrong from run to run, as expected on this driver.
    Flake,
    /// Not run, as told by the expectations.
    Skip,
}

impl Verdict {
    /// Whether the suite fails by it.
    pub fn is_failure(self) -> bool {
        matches!(self, Verdict::Fail | Verdict::UnexpectedPass)
    }

    /// Its name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Verdict::Pass => "pass",
            Verdict::Fail => "fail",
            Verdict::ExpectedFail => "expected-fail",
            Verdict::UnexpectedPass => "unexpected-pass",
            Verdict::Flake => "flake",
            Verdict::Skip => "skip",
        }
    }
}

/// A case that was run, or skipped.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Name of the case.
    pub name: String,
    /// How it ended.
    pub verdict: Verdict,
    /// Why it failed or was skipped; empty if neither.
    pub reason: String,
    /// What was measured.
    pub measured: String,
    /// How long it took.
    pub time: Duration,
    /// The pictures of an image case.
    pub comparison: Option<Comparison>,
}

/// Every case, in a stable order.
pub fn cases() -> Vec<Case> {
    let case = |kind: &str, name: &str, k: Kind| Case { name: format!("{kind}/{name}"), kind: k };
    let scenes = || scenes::ALL.iter().enumerate();
    let mut all: Vec<Case> = scenes().map(|(k, s)| case("image", s.name, Kind::Image(k))).collect();
    all.extend(scenes().filter(|(_, s)| !s.is_near()).map(|(k, s)| case("tiles", s.name, Kind::Tiles(k))));
    let radiance = scenes().filter(|(_, s)| s.mode == ViewMode::Radiance);
    all.extend(radiance.map(|(k, s)| case("frame", s.name, Kind::Frame(k))));
    all.extend(probe::ALL.iter().enumerate().map(|(k, p)| case("probe", p.0, Kind::Probe(k))));
    all.push(case("determinism", "again", Kind::Again));
    all.push(case("determinism", "return", Kind::Return));
    all.push(case("determinism", "shortcuts", Kind::Shortcuts));
    all.extend(["0", "1", "2"].map(|n| case("determinism", &format!("threads-{n}"), Kind::Threads(n))));
    all.extend(validation::ALL.iter().enumerate().map(|(k, v)| case("validation", v.0, Kind::Validation(k))));
    all
}

/// The cases whose names contain one of the filters (all without any), and of these the `k`-th of every `n`, counted from 1.
pub fn select(filters: &[String], (k, n): (usize, usize)) -> Vec<Case> {
    let wanted = |c: &Case| filters.is_empty() || filters.iter().any(|f| c.name.contains(f.as_str()));
    cases().into_iter().filter(wanted).enumerate().filter(|(i, _)| i % n == k - 1).map(|(_, c)| c).collect()
}

/// The suite on one driver.
pub struct Suite {
    options: Options,
    expectations: Expectations,
    /// Of the driver: name and version.
    driver: String,
}

impl Suite {
    /// Reads the expectations for the driver of the device.
    ///
    /// # Errors
    /// [`Error::NoDevice`]; [`Error::Io`] and [`Error::Input`] of the expectations.
    pub fn open(options: Options) -> Result<Self> {
        let driver = find(options.device.as_deref())?.driver;
        let expectations = Expectations::load(&options.references.join("expectations.txt"))?;
        Ok(Suite { options, expectations, driver })
    }

    /// The driver, as it names itself.
    pub fn driver(&self) -> &str {
        &self.driver
    }

    /// Runs a case and judges it by what is expected on this driver.
    ///
    /// # Errors
    /// What keeps any case from running: no device, an unwritable reference. What a case meets is its failure.
    pub fn run(&self, case: &Case) -> Result<Outcome> {
        let expected = self.expectations.find(&self.driver, &case.name);
        let done = |verdict, reason: String| Outcome {
            name: case.name.clone(),
            verdict,
            reason,
            measured: String::new(),
            time: Duration::ZERO,
            comparison: None,
        };
        if let Some((Expectation::Skip, reason)) = expected {
            return Ok(done(Verdict::Skip, reason.to_string()));
        }
        let start = Instant::now();
        let found = match self.find_out(case) {
            Ok(found) => found,
            Err(e @ (Error::NoDevice(_) | Error::Io { .. })) => return Err(e),
            Err(e) => Finding { failure: Some(e.to_string()), measured: String::new(), comparison: None },
        };
        let (verdict, reason) = match (expected, found.failure) {
            (None, None) => (Verdict::Pass, String::new()),
            (None, Some(why)) => (Verdict::Fail, why),
            (Some((Expectation::Flake, reason)), None) => (Verdict::Flake, reason.into()),
            (Some((Expectation::Flake, reason)), Some(why)) => (Verdict::Flake, format!("{reason}: {why}")),
            (Some((_, reason)), Some(why)) => (Verdict::ExpectedFail, format!("{reason}: {why}")),
            (Some((_, reason)), None) => (
                Verdict::UnexpectedPass,
                format!("passes, but a failure is expected ({reason}): remove the line"),
            ),
        };
        Ok(Outcome {
            measured: found.measured,
            time: start.elapsed(),
            comparison: found.comparison,
            ..done(verdict, reason)
        })
    }

    fn find_out(&self, case: &Case) -> Result<Finding> {
        let o = &self.options;
        match case.kind {
            Kind::Image(k) => images::check(self, &scenes::ALL[k]),
            Kind::Tiles(k) => tiles::check(o, &scenes::ALL[k]),
            Kind::Frame(k) => with_device(o, |gpu| frames::check(gpu, o, &scenes::ALL[k])),
            Kind::Probe(k) => with_device(o, |gpu| probe::ALL[k].1(gpu)),
            Kind::Again => with_device(o, |gpu| frames::again(gpu, o)),
            Kind::Shortcuts => with_device(o, |gpu| frames::shortcuts(gpu, o)),
            Kind::Return => with_device(o, |gpu| frames::return_flight(gpu, o)),
            Kind::Threads(n) => with_device(o, |gpu| frames::threads(gpu, o, n)),
            Kind::Validation(k) => validation::check(o, &validation::ALL[k]),
        }
    }
}

/// The bits of a scene's frame by each rasteriser as hashes: what a process of its own prints for `determinism/threads-…`.
///
/// # Errors
/// [`Error::Usage`] for a scene that is not in the suite, and what drawing it meets.
pub fn digest(options: &Options, scene: &str) -> Result<String> {
    let gpu = Gpu::new(&GpuOptions { device: options.device.clone(), ..Default::default() })?;
    let digests = frames::digests(&gpu, options, scene)?;
    gpu.close()?;
    Ok(digests.join(" "))
}

/// Opens a device for one case; closing reports what it left behind.
fn with_device(options: &Options, work: impl FnOnce(&Gpu) -> Result<Finding>) -> Result<Finding> {
    let gpu = Gpu::new(&GpuOptions { device: options.device.clone(), ..Default::default() })?;
    let found = work(&gpu)?;
    gpu.close()?;
    Ok(found)
}

/// Folder of a driver's references: its name and version, such as `llvmpipe-22.3.6`.
fn driver_key(driver: &str) -> String {
    let name = driver.split_whitespace().next().unwrap_or("unknown").to_lowercase();
    let digits = |w: &str| w.chars().take_while(|c| c.is_ascii_digit() || *c == '.').collect::<String>();
    let version = driver.split_whitespace().map(digits).find(|v| v.contains('.'));
    match version {
        Some(version) => format!("{name}-{}", version.trim_end_matches('.')),
        None => name,
    }
}

/// A failure unless all holds.
fn finding(problems: &[String], measured: String) -> Finding {
    Finding { failure: (!problems.is_empty()).then(|| problems.join("; ")), measured, comparison: None }
}

/// Default folder of the references: that of a checkout.
pub fn default_references() -> &'static Path {
    Path::new("tests/conformance")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique_and_shards_part_them() {
        let all = cases();
        let mut names: Vec<&str> = all.iter().map(|c| c.name.as_str()).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), all.len());
        let mut parts: Vec<String> = (1..=3).flat_map(|k| select(&[], (k, 3))).map(|c| c.name).collect();
        parts.sort_unstable();
        assert_eq!(parts, names);
        assert!(select(&["image/".into()], (1, 1)).iter().all(|c| c.name.starts_with("image/")));
        assert!(select(&["nothing like it".into()], (1, 1)).is_empty());
    }

    #[test]
    fn drivers_have_short_keys() {
        assert_eq!(driver_key("llvmpipe Mesa 22.3.6 (LLVM 15.0.6)"), "llvmpipe-22.3.6");
        assert_eq!(driver_key("llvmpipe Mesa 25.0.7-2~bpo12+1 (LLVM 15.0.6)"), "llvmpipe-25.0.7");
        assert_eq!(driver_key("NVIDIA 550.54.15"), "nvidia-550.54.15");
        assert_eq!(driver_key("odd"), "odd");
    }
}
