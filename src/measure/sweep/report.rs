//! A sweep for people: CSV for tables of their own, one HTML page that needs nothing else.

use std::path::Path;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use super::chart::{Mark, scatter};
use super::design::HOME;
use super::judge::{Judged, PAPER, Row, Tried, judge, values_of};
use super::result::{CameraError, Point, SweepResult};
use super::run::picture_file;
use crate::Result;
use crate::measure::metrics::{Difference, Estimate};
use crate::measure::page::{escape, head, table};
use crate::settings::{KNOBS, Knob, PRESETS};

/// Columns of [`csv()`].
pub const CSV_COLUMNS: [&str; 24] = [
    "setting",
    "base",
    "group",
    "ms",
    "time_ratio",
    "time_ratio_low",
    "time_ratio_high",
    "wall_ms",
    "planned_bytes",
    "allocated_bytes",
    "samples",
    "error_against",
    "rmse",
    "rmse_low",
    "rmse_high",
    "bias",
    "flip",
    "ssim",
    "popping",
    "distance_spread",
    "rmse_to_most_accurate",
    "front",
    "dominated_by",
    "refused",
];

/// Mean over the cameras that have it; `None` if none has.
pub(super) fn mean(point: &Point, of: impl Fn(&CameraError) -> Option<f64>) -> Option<f64> {
    let all: Vec<f64> = point.errors.iter().filter_map(of).collect();
    (!all.is_empty()).then(|| all.iter().sum::<f64>() / all.len() as f64)
}

/// What errors are judged by.
pub(super) fn shown(e: &CameraError) -> &Difference {
    e.against_reference.as_ref().unwrap_or(&e.against_most_accurate)
}

pub(super) fn against(judged: &Judged) -> &'static str {
    if judged.against_reference { "reference" } else { "most accurate setting" }
}

/// A table with fixed columns, a row a setting. What is not known is empty.
pub fn csv(result: &SweepResult) -> String {
    let judged = judge(result);
    let mut text = CSV_COLUMNS.join(",") + "\n";
    let number = |v: Option<f64>| v.map_or(String::new(), |v| format!("{v:.6}"));
    let three = |e: Option<Estimate>| {
        let ends = e.and_then(|e| e.interval);
        [number(e.map(|e| e.value)), number(ends.map(|i| i[0])), number(ends.map(|i| i[1]))]
    };
    for (k, p) in result.points.iter().enumerate() {
        let row = judged.rows.iter().find(|r| r.point == k);
        let mut cells = vec![p.name.clone(), p.base.clone(), format!("{:?}", p.group).to_lowercase()];
        cells.push(number(p.time.as_ref().map(|t| t.ms)));
        cells.extend(three(row.map(|r| r.ratio)));
        cells.push(number(p.time.as_ref().map(|t| t.wall_ms.value)));
        cells.extend([p.planned_bytes.to_string(), p.allocated_bytes.to_string(), p.samples.to_string()]);
        cells.push(against(&judged).into());
        cells.extend(three(row.map(|r| r.error)));
        cells.push(number(mean(p, |e| Some(shown(e).foreground?.bias.value))));
        cells.push(number(mean(p, |e| Some(shown(e).flip?.value))));
        cells.push(number(mean(p, |e| Some(shown(e).ssim?.value))));
        cells.push(number(mean(p, |e| Some(e.popping?.value))));
        cells.push(number(mean(p, |e| shown(e).distance_spread)));
        cells.push(number(mean(p, |e| Some(e.against_most_accurate.foreground?.rmse.value))));
        cells.push(row.map_or(String::new(), |r| r.dominated_by.is_none().to_string()));
        cells.push(row.and_then(|r| r.dominated_by).map_or(String::new(), |q| result.points[q].name.clone()));
        cells.push(p.refused.replace(['\n', ',', '"'], " "));
        text += &(cells.join(",") + "\n");
    }
    text
}

/// A value with its interval, in parts of 1 or per cent.
pub(super) fn known(e: Estimate, factor: f64, digits: usize) -> String {
    let number = |v: f64| format!("{:.digits$}", factor * v);
    let interval = e.interval.map_or("?".into(), |[a, b]| format!("{} – {}", number(a), number(b)));
    format!("{} ({interval})", number(e.value))
}

/// Whether a row is on the front, in words.
fn verdict(result: &SweepResult, row: &Row) -> String {
    row.dominated_by.map_or("on the front".into(), |q| format!("dominated by {}", result.points[q].name))
}

/// A row of the tables of settings: name, time, ratio, memory, error, FLIP, popping, verdict.
pub const HEADINGS: [&str; 8] = [
    "setting",
    "ms",
    "time / balanced",
    "MiB planned / allocated",
    "error, %",
    "FLIP",
    "popping, %",
    "verdict",
];

/// Cells under [`HEADINGS`].
pub fn cells(result: &SweepResult, row: &Row) -> [String; 8] {
    let p = &result.points[row.point];
    let number =
        |v: Option<f64>, factor: f64, digits| v.map_or("none".into(), |v| format!("{:.digits$}", factor * v));
    [
        p.name.clone(),
        format!("{:.1}", row.ms),
        known(row.ratio, 1.0, 3),
        format!("{} / {}", p.planned_bytes >> 20, p.allocated_bytes >> 20),
        known(row.error, 100.0, 2),
        number(mean(p, |e| Some(shown(e).flip?.value)), 1.0, 4),
        number(mean(p, |e| Some(e.popping?.value)), 100.0, 2),
        verdict(result, row),
    ]
}

/// Headings of [`paper`].
pub const PAPER_HEADINGS: [&str; 5] = ["BN12's choice", "value", "time / balanced", "error, %", "verdict"];

/// The choices of BN12, each with all values tried; the paper's own is marked and judged.
pub fn paper(result: &SweepResult, judged: &Judged) -> Vec<[String; 5]> {
    let mut rows = Vec::new();
    for choice in &PAPER {
        let tried = values_of(result, judged, HOME, choice.knob);
        let words = format!("{} ({}), {}", choice.words, choice.section, choice.knob);
        if !tried.iter().any(|t| t.value == choice.value) || tried.len() < 2 {
            rows.push([words, choice.value.to_string(), String::new(), String::new(), "not measured".into()]);
            continue;
        }
        for t in &tried {
            let own = t.value == choice.value;
            let by = t.dominated_by.map_or("on the front".into(), |v| format!("dominated by {v}"));
            let value = if own { format!("{} (the paper's)", t.value) } else { t.value.to_string() };
            rows.push([words.clone(), value, known(t.ratio, 1.0, 3), known(t.error, 100.0, 2), by]);
        }
    }
    rows
}

/// The page. `pictures` is the folder of kept pictures.
///
/// # Errors
/// [`crate::Error::Check`] for a chart that cannot be drawn.
pub fn html(result: &SweepResult, pictures: &Path) -> Result<String> {
    let judged = judge(result);
    let [width, height] = result.identity.size;
    let name = &result.identity.scene.name;
    let mut page = head(&format!("canopy sweep: {name}"), &format!("Time and accuracy: {name}"));
    let h = &result.host;
    page += &format!(
        "<p>{width} × {height}, {} cameras, {} on {} with {} threads, canopy {} ({}). Times are {}, each setting drawn in turn \
         with its preset; parentheses hold 95 % intervals. Errors are the root of the mean squared error of linear radiance \
         over everything but the background, relative to its mean, against the {}. A setting is on the front \
         unless another is significantly better in both, by {:.0} % of the time and {:.0} % of the error at least, or in \
         one and surely no worse in the other by as much.</p>\n",
        result.identity.cameras.len(),
        escape(&result.identity.device.name),
        escape(&h.cpu),
        h.threads,
        escape(&h.version),
        escape(h.revision.as_deref().unwrap_or("unknown revision")),
        if result.quantity == "cpu_ms" { "CPU time of all threads" } else { "GPU time" },
        against(&judged),
        100.0 * judged.least.time,
        100.0 * judged.least.error,
    );
    if !result.left.is_empty() {
        page += &format!("<p>Not measured: {}.</p>\n", escape(&result.left.join("; ")));
    }
    let mark = |r: &Row| {
        let p = &result.points[r.point];
        let preset = PRESETS.contains(&p.name.as_str());
        let label = if preset { p.name.clone() } else { String::new() };
        Mark { ratio: r.ratio, error: r.error, label, front: r.dominated_by.is_none(), large: preset }
    };
    let marks: Vec<Mark> = judged.rows.iter().map(mark).collect();
    page += &scatter((900, 520), "All settings; filled: on the front", &marks, &[])?;
    page += "<h2>Presets</h2>\n";
    let presets: Vec<&Row> = PRESETS.iter().filter_map(|p| judged.row(result, p)).collect();
    page += &table(HEADINGS, presets.iter().map(|r| cells(result, r)));
    page += "<h2>BN12's choices</h2>\n<p>One knob at a time around <code>balanced</code>; verdicts are among the values of the knob.</p>\n";
    page += &table(PAPER_HEADINGS, paper(result, &judged));
    page += "<h2>The front</h2>\n";
    let mut on_front: Vec<&Row> = judged.rows.iter().filter(|r| r.dominated_by.is_none()).collect();
    on_front.sort_by(|a, b| a.ms.total_cmp(&b.ms));
    page += &table(HEADINGS, on_front.iter().map(|r| cells(result, r)));
    page +=
        "<h2>Knobs</h2>\n<p>Each knob moved from each preset; joined are the values from one preset.</p>\n";
    let is_swept = |k: &&Knob| result.identity.knobs.iter().any(|n| n.split('=').next() == Some(k.name));
    for knob in KNOBS.iter().filter(is_swept) {
        let tried: Vec<Vec<Tried>> = PRESETS
            .iter()
            .map(|p| values_of(result, &judged, p, knob.name))
            .filter(|t| t.len() > 1)
            .collect();
        if !tried.is_empty() {
            page += &knob_chart(knob.name, &tried)?;
        }
    }
    page += "<h2>Pictures</h2>\n<p>Presets: the picture, and FLIP.</p>\n<table>\n";
    for row in &presets {
        let name = &result.points[row.point].name;
        page += &format!("<tr><td>{}</td>", escape(name));
        for camera in 0..result.identity.cameras.len() {
            for kind in ["", " flip"] {
                // A picture that is gone leaves its cell empty.
                let png = std::fs::read(picture_file(pictures, name, camera, kind)).unwrap_or_default();
                page += &format!(
                    "<td><img src=\"data:image/png;base64,{}\" alt=\"\"></td>",
                    STANDARD.encode(png)
                );
            }
        }
        page += "</tr>\n";
    }
    page += "</table>\n<h2>All settings</h2>\n";
    page += &table(HEADINGS, judged.rows.iter().map(|r| cells(result, r)));
    let refused: Vec<[String; 2]> = result
        .points
        .iter()
        .filter(|p| !p.refused.is_empty())
        .map(|p| [p.name.clone(), p.refused.clone()])
        .collect();
    if !refused.is_empty() {
        page += &format!("<h2>Refused</h2>\n{}", table(["setting", "reason"], refused));
    }
    Ok(page)
}

/// The values of a knob, a line a preset.
fn knob_chart(name: &str, tried: &[Vec<Tried>]) -> Result<String> {
    let mut lines = Vec::new();
    let mut marks = Vec::new();
    for values in tried {
        lines.push((marks.len()..marks.len() + values.len()).collect());
        marks.extend(values.iter().map(|t| Mark {
            ratio: t.ratio,
            error: t.error,
            label: t.value.to_string(),
            front: t.dominated_by.is_none(),
            large: false,
        }));
    }
    scatter((440, 300), name, &marks, &lines)
}
