//! Two bench results: which passes got slower or faster, by how much, and how sure that is.
//!
//! Noise of a shared machine is one-sided (others can only slow a frame down), alike for neighbouring frames, and drifts from
//! run to run for all passes alike. Hence:
//!
//! * **Views are blocks.** Frame k of both results shows the same view, so only times of the same view are compared; the first
//!   round, whose caches are colder, is left out where there are later ones.
//! * **The least of several rounds** stands for a view. Only the views are samples then, and a path should have a dozen or more.
//! * **What all passes have in common** is the machine, not a pass: on software drivers, whose two results come one after the
//!   other, the median pass (by time) is taken off every pass, and listed apart. Results drawn in turn, and times of a
//!   GPU's own clock, are compared as they are.
//! * **Several passes are tested at once**, so p is corrected for that (Holm); it is the larger of the Mann-Whitney test's and
//!   that of its paired form, Wilcoxon's signed ranks.
//! * **A verdict needs size as well as significance**: [`Criteria`] says how much.

use std::collections::BTreeMap;

use super::results::{BenchResult, Frame};
use super::statistics::{block_bootstrap, holm, mann_whitney, median, signed_rank};
use crate::ladder::Ladder;
use crate::plan::Rasterizer;
use crate::{Error, Result};

/// Version of [`Comparison`]; raised when a key changes its meaning or goes.
pub const COMPARE_SCHEMA_VERSION: u32 = 1;

/// Row of the whole frame.
pub const FRAME: &str = "frame";
/// Row of what all passes have in common.
pub const COMMON: &str = "all passes alike";

/// Part of the frame from which a pass has a say in what is common.
const COMMON_SHARE: f64 = 0.05;
/// Passes that have a say at least, so that one that changed is outvoted.
const COMMON_PASSES: usize = 3;

/// What counts as a change.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Criteria {
    /// Probability that any of the rows is called changed when none is.
    pub level: f64,
    /// Least relative change of a pass.
    pub least_change: f64,
    /// Least relative change of the whole frame.
    pub least_frame: f64,
    /// Least change of a pass, ms: noise that any pass has, however short and however long the frame, because each is
    /// submitted and waited for. On software drivers at most 0.41 ms between runs of one build on two cores that others used
    /// meanwhile; long passes have at most 1.5 % besides.
    pub least_ms: f64,
    /// Least relative change that all passes have in common: smaller ones are the machine's from run to run.
    pub least_common: f64,
}

impl Criteria {
    /// Those for CPU times on software drivers, or for GPU times; measured on two shared cores (`tests/proofs/bench.rs`).
    pub fn new(cpu: bool) -> Self {
        let level = 0.05;
        if cpu {
            Criteria { level, least_change: 0.02, least_frame: 0.03, least_ms: 0.5, least_common: 0.10 }
        } else {
            Criteria { level, least_change: 0.01, least_frame: 0.01, least_ms: 0.01, least_common: 0.10 }
        }
    }
}

/// What a row is called.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// Too small or too uncertain to call.
    NoDifference,
    /// B takes more time than A.
    Slower,
    /// B takes less.
    Faster,
}

/// A pass, the frame, or what all passes have in common.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Row {
    /// Name of the pass, [`FRAME`] or [`COMMON`].
    pub name: String,
    /// Mean over the views of the least time of A, ms.
    pub a_ms: f64,
    /// The same of B, as measured.
    pub b_ms: f64,
    /// B over A, without what all passes have in common.
    pub ratio: f64,
    /// 95 % interval of the ratio.
    pub interval: [f64; 2],
    /// p of the Mann-Whitney test on times less their view's mean.
    pub mann_whitney_p: f64,
    /// p of Wilcoxon's signed ranks on the differences of views.
    pub signed_rank_p: f64,
    /// The larger of the two, corrected for the number of rows.
    pub corrected_p: f64,
    /// The least ratio (or its inverse) that would be called a change.
    pub least_ratio: f64,
    /// What the row is called.
    pub verdict: Verdict,
}

/// Two results compared.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Comparison {
    /// [`COMPARE_SCHEMA_VERSION`].
    pub schema_version: u32,
    /// `compare`.
    pub command: String,
    /// What is compared: `cpu_ms` or `gpu_ms`.
    pub quantity: &'static str,
    /// The results were drawn in turn in one process.
    pub in_turn: bool,
    /// What counted.
    pub criteria: Criteria,
    /// Views that both results have.
    pub views: u32,
    /// Fixed work on the CPU, B over A: how much slower the machine was.
    pub pace_ratio: Option<f64>,
    /// In what the results differ besides times.
    pub differences: Vec<Difference>,
    /// The frame, what is common, and every pass.
    pub rows: Vec<Row>,
}

/// Something that two results do not share.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Difference {
    /// Kind, for `--allow-different`: one of [`Difference::KINDS`].
    pub kind: &'static str,
    /// What differs, with both values.
    pub what: String,
}

impl Difference {
    /// Kinds of differences that make times incomparable.
    pub const KINDS: [&str; 6] = ["scene", "path", "size", "settings", "timing", "device"];
}

/// In what two results differ that makes their times incomparable.
pub fn differences(a: &BenchResult, b: &BenchResult) -> Vec<Difference> {
    let mut found = Vec::new();
    let mut check = |kind, what: &str, a: &dyn std::fmt::Debug, b: &dyn std::fmt::Debug| {
        let (a, b) = (format!("{a:?}"), format!("{b:?}"));
        if a != b {
            found.push(Difference { kind, what: format!("{what}: {a} and {b}") });
        }
    };
    check("scene", "scene", &a.scene.name, &b.scene.name);
    check("scene", "seed", &a.scene.seed, &b.scene.seed);
    for name in
        a.scene.assets.keys().chain(b.scene.assets.keys().filter(|k| !a.scene.assets.contains_key(*k)))
    {
        let short =
            |r: &BenchResult| r.scene.assets.get(name).map(|h| h.chars().take(12).collect::<String>());
        check("scene", name, &short(a), &short(b));
    }
    check(
        "path",
        "path",
        &(&a.path.name, a.path.step_s, a.path.views),
        &(&b.path.name, b.path.step_s, b.path.views),
    );
    if a.path.name == b.path.name {
        check("path", "keyframes", &a.path.keyframes, &b.path.keyframes);
    }
    check("size", "size", &a.size, &b.size);
    for name in a.settings.keys().chain(b.settings.keys().filter(|k| !a.settings.contains_key(*k))) {
        check("settings", name, &a.settings.get(name), &b.settings.get(name));
    }
    // Older results, of the time when there was only the graphics pipeline, do not say.
    let rasterizer =
        |r: &BenchResult| r.rasterizer.clone().unwrap_or_else(|| Rasterizer::Graphics.name().into());
    check("settings", "rasterizer", &rasterizer(a), &rasterizer(b));
    // Those of before ladders had this one.
    let ladder = |r: &BenchResult| r.ladder.clone().unwrap_or_else(|| Ladder::BN12.to_string());
    check("settings", "ladder", &ladder(a), &ladder(b));
    check("timing", "timing", &a.timing, &b.timing);
    check("device", "device", &a.device, &b.device);
    check("device", "cpu", &a.host.cpu, &b.host.cpu);
    check("device", "threads", &a.host.threads, &b.host.threads);
    check("device", "driver variables", &a.host.variables, &b.host.variables);
    found
}

/// A view of the first or of a later round.
type Place = (bool, u32);
/// Times of a pass by place, in the order of rounds; logarithms of ms.
type Times = BTreeMap<Place, Vec<f64>>;

/// Compares two results; `in_turn` if they were drawn in turn in one process.
///
/// # Errors
/// [`Error::Usage`] when they have no view in common, or no times.
pub fn compare(a: &BenchResult, b: &BenchResult, in_turn: bool) -> Result<Comparison> {
    let cpu = a.device.kind == "cpu" && [a, b].iter().all(|r| r.frames.iter().all(|f| f.cpu_ms.is_some()));
    let criteria = Criteria::new(cpu);
    // The first round has colder caches and one sample a view: later ones, if there are several, know better.
    let last = |r: &BenchResult| r.frames.iter().map(|f| f.round).max().unwrap_or(0);
    let from = u32::from(last(a).min(last(b)) >= 2);
    let pairs =
        |time: &dyn Fn(&Frame) -> Option<f64>| Pairs::new(&times(a, from, time), &times(b, from, time));
    let frame = pairs(&|f| time(f, FRAME, cpu))
        .ok_or_else(|| Error::Usage("the two results have no view with times in common".into()))?;
    let mut names = a.pass_names();
    names.extend(b.pass_names().into_iter().filter(|n| !names.contains(n)).collect::<Vec<_>>());
    let passes: Vec<(String, Pairs)> =
        names.into_iter().filter_map(|n| pairs(&|f| time(f, &n, cpu)).map(|pairs| (n, pairs))).collect();
    let drift = cpu && !in_turn;
    // The median change of the passes that matter: short ones have noise of their own.
    let mut longest: Vec<(f64, f64)> = passes.iter().map(|(_, p)| (p.mean_ms()[0], p.change())).collect();
    longest.sort_by(|x, y| y.0.total_cmp(&x.0));
    let whole = frame.mean_ms()[0];
    let enough = longest.iter().filter(|(ms, _)| *ms >= COMMON_SHARE * whole).count().max(COMMON_PASSES);
    longest.truncate(enough);
    let changes: Vec<f64> = longest.iter().map(|(_, change)| *change).collect();
    let common = if drift && !changes.is_empty() { median(&changes) } else { 0.0 };
    let mut rows = vec![frame.row(FRAME, common)];
    rows.extend(passes.iter().map(|(name, pairs)| pairs.row(name, common)));
    let corrected = holm(&rows.iter().map(|r| r.mann_whitney_p.max(r.signed_rank_p)).collect::<Vec<_>>());
    for (row, p) in rows.iter_mut().zip(corrected) {
        row.corrected_p = p;
        let least = if row.name == FRAME { criteria.least_frame } else { criteria.least_change };
        // Of the smaller of the two times, so that A and B may change places.
        let smaller = row.a_ms * row.ratio.min(1.0);
        row.least_ratio = 1.0 + least.max(criteria.least_ms / smaller);
        row.judge(criteria.level);
    }
    if drift {
        let mut row = frame.row(COMMON, 0.0);
        let ratio = common.exp();
        row.interval = row.interval.map(|i| i / row.ratio * ratio);
        (row.ratio, row.corrected_p) = (ratio, row.mann_whitney_p.max(row.signed_rank_p));
        row.least_ratio = 1.0 + criteria.least_common;
        row.judge(criteria.level);
        rows.insert(1, row);
    }
    let pace = pairs(&|f| f.pace_ms).map(|p| p.change().exp());
    Ok(Comparison {
        schema_version: COMPARE_SCHEMA_VERSION,
        command: "compare".into(),
        quantity: if cpu { "cpu_ms" } else { "gpu_ms" },
        in_turn,
        criteria,
        views: frame.0.len() as u32,
        pace_ratio: pace,
        differences: differences(a, b),
        rows,
    })
}

impl Comparison {
    /// Rows that are slower by more than a part, for a gate.
    pub fn slower_than(&self, part: f64) -> Vec<&Row> {
        self.rows.iter().filter(|r| r.verdict == Verdict::Slower && r.ratio > 1.0 + part).collect()
    }
}

/// Time of a pass, or of the frame, ms.
fn time(frame: &Frame, name: &str, cpu: bool) -> Option<f64> {
    if name == FRAME {
        return if cpu { frame.cpu_ms } else { frame.gpu_ms };
    }
    let pass = frame.passes.iter().find(|p| p.name == name)?;
    if cpu { pass.cpu_ms } else { Some(pass.gpu_ms) }
}

/// Times of the frames from a round on, by place.
fn times(r: &BenchResult, from: u32, time: &dyn Fn(&Frame) -> Option<f64>) -> Times {
    let mut all = Times::new();
    for f in r.frames.iter().filter(|f| f.round >= from) {
        if let Some(ms) = time(f).filter(|ms| *ms > 0.0) {
            all.entry((f.round > 0, f.view)).or_default().push(ms.ln());
        }
    }
    all
}

fn least(times: &[f64]) -> f64 {
    times.iter().copied().fold(f64::INFINITY, f64::min)
}

/// Times of A and B of the same places, logarithms of ms: the least of all rounds.
struct Pairs(Vec<[f64; 2]>);

impl Pairs {
    /// `None` if there is no place with times in both.
    fn new(a: &Times, b: &Times) -> Option<Self> {
        let both = a.iter().filter_map(|(place, x)| Some((x, b.get(place)?)));
        // The same number of rounds of each: the least of more would be less.
        let pairs = both.map(|(x, y)| {
            let n = x.len().min(y.len());
            [least(&x[..n]), least(&y[..n])]
        });
        let pairs: Vec<_> = pairs.collect();
        (!pairs.is_empty()).then_some(Pairs(pairs))
    }

    /// Logarithm of B over A in the middle.
    fn change(&self) -> f64 {
        median(&self.0.iter().map(|[a, b]| b - a).collect::<Vec<_>>())
    }

    /// Means of the least times, ms.
    fn mean_ms(&self) -> [f64; 2] {
        [0, 1].map(|k| self.0.iter().map(|p| p[k].exp()).sum::<f64>() / self.0.len() as f64)
    }

    /// A row without verdict; `common` is taken off the logarithms.
    fn row(&self, name: &str, common: f64) -> Row {
        let changes: Vec<f64> = self.0.iter().map(|[a, b]| b - a - common).collect();
        // Less the mean of the view, each is half the change away.
        let aligned = |side: f64| changes.iter().map(|c| side * c).collect::<Vec<_>>();
        let [a_ms, b_ms] = self.mean_ms();
        Row {
            name: name.into(),
            a_ms,
            b_ms,
            ratio: median(&changes).exp(),
            interval: block_bootstrap(&changes, 2, 0.95, median).map(f64::exp),
            mann_whitney_p: mann_whitney(&aligned(-0.5), &aligned(0.5)),
            signed_rank_p: signed_rank(&changes),
            corrected_p: 1.0,
            least_ratio: f64::INFINITY,
            verdict: Verdict::NoDifference,
        }
    }
}

impl Row {
    fn judge(&mut self, level: f64) {
        self.verdict = if self.corrected_p >= level {
            Verdict::NoDifference
        } else if self.ratio >= self.least_ratio {
            Verdict::Slower
        } else if self.ratio <= 1.0 / self.least_ratio {
            Verdict::Faster
        } else {
            Verdict::NoDifference
        };
    }
}
