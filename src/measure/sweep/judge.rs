//! What a sweep's points say: the front, what each knob does, what of the paper's choices lies on the front, what fits a budget.

use super::design::{Group, HOME};
use super::front::{Candidate, Least, front};
use super::result::{Point, SweepResult};
use crate::measure::compare::Criteria;
use crate::measure::metrics::{Estimate, estimate};
use crate::settings::{KNOBS, Knob};

/// Least relative difference of errors that matters.
const LEAST_ERROR: f64 = 0.01;
/// Width of a 95 % interval in standard errors.
const WIDTH: f64 = 3.92;

/// A choice of BN12: what the paper says it is, and the knob with its value.
pub struct PaperChoice {
    /// In the paper's words.
    pub words: &'static str,
    /// Section.
    pub section: &'static str,
    /// The knob.
    pub knob: &'static str,
    /// The paper's value of it.
    pub value: f64,
}

/// The choices of BN12 that are knobs.
pub const PAPER: [PaperChoice; 8] = [
    PaperChoice { words: "181 views", section: "§5", knob: "view_rings", value: 9.0 },
    PaperChoice { words: "views of 256 × 256", section: "§5", knob: "view_resolution", value: 256.0 },
    PaperChoice { words: "two iterations", section: "§5", knob: "view_iterations", value: 2.0 },
    PaperChoice { words: "shader-map under 3 pixels", section: "§7", knob: "zfield_min_pixels", value: 3.0 },
    PaperChoice { words: "4 samples a pixel", section: "§8", knob: "samples", value: 4.0 },
    PaperChoice { words: "tables of 16³", section: "§6", knob: "table_angles", value: 16.0 },
    PaperChoice { words: "8 densities", section: "§6", knob: "table_densities", value: 8.0 },
    PaperChoice { words: "a hole of radius 2/√Λ", section: "§5", knob: "hole_radius", value: 2.0 },
];

/// A point, judged.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Index in [`SweepResult::points`].
    pub point: usize,
    /// Time over that of [`HOME`].
    pub ratio: Estimate,
    /// Time where [`HOME`] takes what it took, ms.
    pub ms: f64,
    /// Root of the mean squared error of radiance over all cameras, relative to the mean radiance.
    pub error: Estimate,
    /// Index, in the points, of one that dominates it; `None` on the front.
    pub dominated_by: Option<usize>,
    /// For fronts of some of the points.
    pub candidate: Candidate,
}

/// All points that have a time and an error.
#[derive(Clone, Debug, PartialEq)]
pub struct Judged {
    /// Errors are against the reference, not the most accurate setting.
    pub against_reference: bool,
    /// What differences have to exceed.
    pub least: Least,
    /// The points, in their order.
    pub rows: Vec<Row>,
}

impl Judged {
    /// The row of a point by name.
    pub fn row(&self, result: &SweepResult, name: &str) -> Option<&Row> {
        self.rows.iter().find(|r| result.points[r.point].name == name)
    }
}

/// Judges all points.
pub fn judge(result: &SweepResult) -> Judged {
    let against_reference = !result.identity.references.is_empty();
    let least = Least { time: Criteria::new(result.quantity == "cpu_ms").least_frame, error: LEAST_ERROR };
    let mut rows: Vec<Row> =
        (0..result.points.len()).filter_map(|k| row(result, k, against_reference)).collect();
    let candidates: Vec<Candidate> = rows.iter().map(|r| r.candidate.clone()).collect();
    let places: Vec<usize> = rows.iter().map(|r| r.point).collect();
    for (row, by) in rows.iter_mut().zip(front(&candidates, least)) {
        row.dominated_by = by.map(|q| places[q]);
    }
    Judged { against_reference, least, rows }
}

/// Squared errors by block, of all cameras one after the other.
fn blocks(point: &Point, against_reference: bool) -> Option<Vec<f64>> {
    let of = |e: &super::CameraError| match against_reference {
        true => e.reference_blocks.clone(),
        false => e.most_accurate_blocks.clone(),
    };
    let all: Vec<Vec<f64>> = point.errors.iter().map(of).collect();
    (!all.is_empty() && all.iter().all(|b| !b.is_empty())).then(|| all.concat())
}

/// A point's time through its preset's, and its error; `None` where one of them is not known.
fn row(result: &SweepResult, point: usize, against_reference: bool) -> Option<Row> {
    let find = |name: &str| result.points.iter().find(|p| p.name == name)?.time.as_ref();
    let p = &result.points[point];
    let own = log_time(p.time.as_ref()?.ratio);
    let base = log_time(find(&p.base)?.ratio);
    let (log_time, log_time_error) = (own.0 + base.0, own.1.hypot(base.1));
    let half = 0.5 * WIDTH * log_time_error;
    let squared_errors = blocks(p, against_reference)?;
    let sums: Vec<[f64; 2]> = squared_errors.iter().map(|e| [1.0, *e]).collect();
    let interval = half.is_finite().then(|| [log_time - half, log_time + half].map(f64::exp));
    Some(Row {
        point,
        ratio: Estimate { value: log_time.exp(), interval },
        ms: find(HOME)?.ms * log_time.exp(),
        error: estimate(&sums, |[n, e]| (e / n).max(0.0).sqrt())?,
        dominated_by: None,
        candidate: Candidate { log_time, log_time_error, squared_errors },
    })
}

/// Logarithm of a ratio and its standard error, infinite if that is not known.
fn log_time(ratio: Estimate) -> (f64, f64) {
    let error = ratio.interval.map_or(f64::INFINITY, |[low, high]| (high / low).ln() / WIDTH);
    (ratio.value.ln(), error)
}

/// The knobs whose moves from [`HOME`] change time or error most, of those that change either significantly: the larger of the
/// relative changes counts.
pub fn knobs_that_matter(result: &SweepResult, count: usize) -> Vec<&'static Knob> {
    let judged = judge(result);
    let Some(home) = judged.row(result, HOME) else { return Vec::new() };
    let mut effects: Vec<(f64, &Knob)> = Vec::new();
    for knob in KNOBS {
        let moved = judged.rows.iter().filter(|r| {
            let p = &result.points[r.point];
            p.base == HOME && p.group == Group::Knob && p.changed.contains_key(knob.name)
        });
        let effect = moved.map(|r| effect(&home.candidate, &r.candidate, judged.least)).fold(0.0, f64::max);
        if effect > 0.0 {
            effects.push((effect, knob));
        }
    }
    effects.sort_by(|a, b| b.0.total_cmp(&a.0));
    effects.into_iter().take(count).map(|(_, knob)| knob).collect()
}

/// The larger of the significant changes of time and of error, as the logarithm of a ratio; 0 if neither is significant.
fn effect(a: &Candidate, b: &Candidate, least: Least) -> f64 {
    let time =
        if a.is_faster(b, least) || b.is_faster(a, least) { (a.log_time - b.log_time).abs() } else { 0.0 };
    let closer = a.is_closer(b, least) || b.is_closer(a, least);
    let errors = [a.error(), b.error()];
    // An error of 0 is the reference itself: any other is as large as it gets.
    let most = if errors.contains(&0.0) { 1.0 } else { (errors[0] / errors[1]).ln().abs() };
    time.max(if closer { most } else { 0.0 })
}

/// Values of a knob, the others as in [`HOME`], with their verdicts among themselves.
#[derive(Clone, Debug, PartialEq)]
pub struct Tried {
    /// The value.
    pub value: f64,
    /// Time over that of [`HOME`].
    pub ratio: Estimate,
    /// Error.
    pub error: Estimate,
    /// The value of this knob that dominates it; `None` on the front.
    pub dominated_by: Option<f64>,
}

/// All values of a knob that were tried from a preset, ascending.
pub fn values_of(result: &SweepResult, judged: &Judged, base: &str, knob: &str) -> Vec<Tried> {
    let of = |r: &&Row| {
        let p = &result.points[r.point];
        p.name == base || (p.base == base && p.group == Group::Knob && p.changed.contains_key(knob))
    };
    let value = |r: &Row| result.points[r.point].settings.get(knob).unwrap_or(f64::NAN);
    let mut rows: Vec<&Row> = judged.rows.iter().filter(of).collect();
    rows.sort_by(|a, b| value(a).total_cmp(&value(b)));
    let candidates: Vec<Candidate> = rows.iter().map(|r| r.candidate.clone()).collect();
    let verdicts = front(&candidates, judged.least);
    let tried = |(r, by): (&&Row, Option<usize>)| Tried {
        value: value(r),
        ratio: r.ratio,
        error: r.error,
        dominated_by: by.map(|q| value(rows[q])),
    };
    rows.iter().zip(verdicts).map(tried).collect()
}

/// The most accurate point whose wall time, with its interval, is within a budget, ms.
pub fn fit(result: &SweepResult, budget_ms: f64) -> Option<(&Point, Row)> {
    let judged = judge(result);
    let fits = |r: &Row| {
        let t = result.points[r.point].time.as_ref()?;
        let most = t.wall_ms.interval.map_or(t.wall_ms.value, |i| i[1]);
        (most <= budget_ms).then_some(r.candidate.error())
    };
    let found = judged.rows.iter().filter_map(|r| Some((fits(r)?, r)));
    let (_, row) = found.min_by(|a, b| a.0.total_cmp(&b.0))?;
    Some((&result.points[row.point], row.clone()))
}

/// The least wall time of any point, ms; `None` without points.
pub fn least_ms(result: &SweepResult) -> Option<f64> {
    result.points.iter().filter_map(|p| Some(p.time.as_ref()?.wall_ms.value)).reduce(f64::min)
}
