//! A sweep's presets and the paper's choices as Markdown tables, for a README.

use super::design::HOME;
use super::judge::{Judged, Row, judge};
use super::report::{PAPER_HEADINGS, against, known, mean, paper, shown};
use super::result::SweepResult;
use crate::measure::metrics::{AVERAGED, RadianceError};
use crate::settings::PRESETS;

/// What stands in a preset's column.
type Cell<'a> = dyn Fn(&Row) -> String + 'a;

/// The presets that were measured, with every metric, then those of BN12's choices that were.
pub fn markdown(result: &SweepResult) -> String {
    let judged = judge(result);
    let [width, height] = result.identity.size;
    let (name, against) = (&result.identity.scene.name, against(&judged));
    let mut text = format!("| {name}, {width} × {height}, against the {against} |");
    let rows: Vec<&Row> = PRESETS.iter().filter_map(|p| judged.row(result, p)).collect();
    for r in &rows {
        text += &format!(" {} |", result.points[r.point].name);
    }
    text += &format!("\n|---|{}\n", "---|".repeat(rows.len()));
    let quantity =
        if result.quantity == "cpu_ms" { "CPU time of a frame, all threads" } else { "GPU time of a frame" };
    let radiance = |r: &Row, of: fn(&RadianceError) -> f64, squares: bool| {
        let value = mean(&result.points[r.point], |e| {
            let d = shown(e);
            Some(of(if squares { &d.averaged } else { &d.foreground }.as_ref()?))
        });
        value.map_or("–".into(), |v| format!("{:.1} %", 100.0 * v))
    };
    let seen = |value: Option<f64>| value.map_or("–".into(), |v| format!("{v:.3}"));
    let squares = format!("RMSE of means of {AVERAGED} × {AVERAGED} pixels");
    let lines: [(&str, &Cell); 8] = [
        (quantity, &|r| format!("{:.0} ms", r.ms)),
        (&format!("over {HOME}'s (95 % interval)"), &|r| known(r.ratio, 1.0, 2)),
        ("MiB planned / allocated", &|r| {
            let p = &result.points[r.point];
            format!("{} / {}", p.planned_bytes >> 20, p.allocated_bytes >> 20)
        }),
        ("RMSE of pixels", &|r| radiance(r, |e| e.rmse.value, false)),
        (&squares, &|r| radiance(r, |e| e.rmse.value, true)),
        ("bias", &|r| radiance(r, |e| e.bias.value, false)),
        ("FLIP", &|r| seen(mean(&result.points[r.point], |e| Some(shown(e).flip?.value)))),
        ("structural similarity", &|r| seen(mean(&result.points[r.point], |e| Some(shown(e).ssim?.value)))),
    ];
    for (what, cell) in lines {
        let cells: Vec<String> = rows.iter().map(|r| cell(r)).collect();
        text += &format!("| {what} | {} |\n", cells.join(" | "));
    }
    text + &choices(result, &judged)
}

/// BN12's choices that were measured; empty without any.
fn choices(result: &SweepResult, judged: &Judged) -> String {
    let rows: Vec<[String; 5]> = paper(result, judged).into_iter().filter(|r| !r[2].is_empty()).collect();
    if rows.is_empty() {
        return String::new();
    }
    let mut text = format!("\n| {} |\n|---|---|---|---|---|\n", PAPER_HEADINGS.join(" | "));
    let mut last = "";
    for row in &rows {
        // What stands above is not said again.
        let first = if row[0] == last { "" } else { &row[0] };
        last = &row[0];
        text += &format!("| {first} | {} |\n", row[1..].join(" | "));
    }
    text
}
