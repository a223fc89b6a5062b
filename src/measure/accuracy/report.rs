//! Accuracy for people: tables, worst cells first, and one HTML page with their curves.

use plotters::prelude::*;

use super::design::Part;
use super::{Accuracy, CellResult, Drawn, Score};
use crate::measure::page::{head, table};
use crate::measure::reflectance::Measured;
use crate::physics::light::luminance;
use crate::{Error, Result};

/// Suns lower than this, degrees, are summed up apart: shadows are long and most crowns dark.
pub const LOW_SUN: f64 = 20.0;
/// Cells of which the page shows curves.
const CURVES: usize = 24;

/// Headings of [`row`].
pub const HEADINGS: [&str; 11] = [
    "cell",
    "trees/m²",
    "sun °",
    "slope °",
    "drawn",
    "rms %",
    "bias %",
    "worst % at view °",
    "fractions",
    "hotspot %",
    "cover / shadow / leaf / sky, %",
];

/// Headings of [`summary`].
pub const SUMMARY_HEADINGS: [&str; 7] =
    ["cells", "sun", "drawn", "number", "rms %", "largest bias %", "largest rms %"];

/// One cell as drawn in one way, worst first.
pub fn worst(a: &Accuracy) -> Vec<(&CellResult, &Drawn, &Score)> {
    let mut all: Vec<_> = a.cells.iter().flat_map(|c| c.drawn.iter().map(move |(d, s)| (c, d, s))).collect();
    all.sort_by(|a, b| b.2.all.rms.total_cmp(&a.2.all.rms));
    all
}

fn percent(x: f64) -> String {
    format!("{:.1}", 100.0 * x)
}

fn signed(x: f64) -> String {
    format!("{:+.1}", 100.0 * x)
}

/// Cells under [`HEADINGS`].
pub fn row((c, d, s): (&CellResult, &Drawn, &Score)) -> [String; 11] {
    let kept = if c.cell.part == Part::Kept { " (kept)" } else { "" };
    let [view, around] = s.all.worst.view;
    let around = if around == 0.0 { String::new() } else { format!(", {around:.0}") };
    [
        format!("{}{kept}", c.cell.name),
        format!("{:.4}", c.cell.density),
        format!("{:.0}", c.cell.sun_elevation),
        format!("{:.0}", c.cell.slope),
        d.name(),
        percent(s.all.rms),
        signed(s.all.bias),
        format!("{} at {view:.0}{around}", signed(s.all.worst.error)),
        format!("{:.3}", s.fraction()),
        signed(s.hotspot.bias),
        s.terms.named().map(|t| signed(t.1)).join(" / "),
    ]
}

/// Over cells of a kind: for tuning or kept apart, under a high or a low sun, drawn in one way.
pub fn summary(a: &Accuracy) -> Vec<[String; 7]> {
    let names: Vec<String> =
        a.cells.first().map_or(Vec::new(), |c| c.drawn.iter().map(|(d, _)| d.name()).collect());
    let mut rows = Vec::new();
    for (words, part) in Part::NAMES {
        for (sun, low) in [("20° and higher", false), ("lower", true)] {
            for (k, name) in names.iter().enumerate() {
                let of = |c: &&CellResult| c.cell.part == part && (c.cell.sun_elevation < LOW_SUN) == low;
                let all: Vec<&Score> = a.cells.iter().filter(of).map(|c| &c.drawn[k].1).collect();
                if all.is_empty() {
                    continue;
                }
                let largest = |of: &dyn Fn(&Score) -> f64| {
                    all.iter().map(|s| of(s)).fold(0.0, |a: f64, b| if b.abs() > a.abs() { b } else { a })
                };
                let square: f64 = all.iter().map(|s| s.all.rms.powi(2)).sum();
                rows.push([
                    words.into(),
                    sun.into(),
                    name.clone(),
                    all.len().to_string(),
                    percent((square / all.len() as f64).sqrt()),
                    signed(largest(&|s| s.all.bias)),
                    percent(largest(&|s| s.all.rms)),
                ]);
            }
        }
    }
    rows
}

/// The page.
///
/// # Errors
/// [`Error::Check`] for a chart that cannot be drawn.
pub fn html(a: &Accuracy) -> Result<String> {
    let mut page = head("canopy accuracy", "Accuracy for forests of many kinds");
    page += &format!(
        "<p>{} cells on {}, canopy {}. Patches of each forest are drawn and path-traced (light that met one surface) from {} directions \
         or so; errors are of luminance, relative to the reference at each view, without the hotspot and with the reference's noise taken \
         out. Fractions are the largest of the four root mean square errors of lit and shadowed ground and trees. The last column says \
         where the bias comes from: how much is trees, how much is lit, what a lit leaf sends to the viewer, the sky.</p>\n",
        a.cells.len(),
        crate::measure::page::escape(&a.device.name),
        crate::measure::page::escape(&a.host.version),
        a.cells.first().map_or(0, |c| c.reference.len()),
    );
    if !a.missing.is_empty() {
        page += &format!("<p>Not measured: {}.</p>\n", a.missing.join(", "));
    }
    page += "<h2>Summary</h2>\n";
    page += &table(SUMMARY_HEADINGS, summary(a));
    page += "<h2>All cells, the worst first</h2>\n";
    page += &table(HEADINGS, worst(a).into_iter().map(row));
    page += "<h2>The worst cells in the plane of the sun</h2>\n<p>Luminance over the view's zenith angle; black: reference.</p>\n";
    let mut shown: Vec<&CellResult> = Vec::new();
    for (c, _, _) in worst(a) {
        if shown.len() < CURVES && !shown.iter().any(|s| s.cell.name == c.cell.name) {
            shown.push(c);
        }
    }
    for c in shown {
        page += &curves(c)?;
    }
    Ok(page)
}

/// Luminances in the plane of the sun, by view zenith angle.
fn along(views: &[Measured]) -> Vec<(f64, f64)> {
    let plane = views.iter().filter(|m| m.view[1] == 0.0);
    let mut all: Vec<(f64, f64)> = plane.map(|m| (m.view[0], luminance(m.radiance()))).collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    all
}

/// A cell's curves, as SVG.
fn curves(c: &CellResult) -> Result<String> {
    let mut svg = String::new();
    draw_curves(&mut svg, c).map_err(|e| Error::Check(format!("chart of {}: {e}", c.cell.name)))?;
    Ok(svg)
}

fn draw_curves(svg: &mut String, c: &CellResult) -> std::result::Result<(), Box<dyn std::error::Error>> {
    let root = SVGBackend::with_string(svg, (440, 280)).into_drawing_area();
    root.fill(&WHITE)?;
    let mut lines = vec![("reference".to_string(), along(&c.reference))];
    lines.extend(c.drawn.iter().map(|(d, _)| (d.name(), along(&d.views))));
    let top = lines.iter().flat_map(|l| &l.1).map(|p| p.1).fold(1e-9, f64::max);
    let mut chart = ChartBuilder::on(&root)
        .caption(&c.cell.name, ("sans-serif", 16))
        .margin(8)
        .x_label_area_size(32)
        .y_label_area_size(52)
        .build_cartesian_2d(-80.0..80.0, 0.0..1.1 * top)?;
    chart
        .configure_mesh()
        .x_desc("view zenith angle, °; the sun's side is positive")
        .light_line_style(TRANSPARENT)
        .draw()?;
    for (k, (name, points)) in lines.into_iter().enumerate() {
        let colour = if k == 0 { BLACK.to_rgba() } else { Palette99::pick(k).to_rgba() };
        chart
            .draw_series(LineSeries::new(points, colour.stroke_width(2)))?
            .label(name)
            .legend(move |(x, y)| PathElement::new(vec![(x, y), (x + 14, y)], colour.stroke_width(2)));
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperLeft)
        .label_font(("sans-serif", 11))
        .draw()?;
    root.present()?;
    Ok(())
}
