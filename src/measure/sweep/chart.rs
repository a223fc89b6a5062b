//! Charts of time against error, as SVG.

use plotters::coord::Shift;
use plotters::prelude::*;

use crate::measure::metrics::Estimate;
use crate::{Error, Result};

/// Part of an axis that stays free around the points.
const MARGIN: f64 = 0.08;

/// A point of a chart.
pub struct Mark {
    /// Time over that of the preset `balanced`.
    pub ratio: Estimate,
    /// Error.
    pub error: Estimate,
    /// What stands beside it; may be empty.
    pub label: String,
    /// On the front.
    pub front: bool,
    /// Larger than the others.
    pub large: bool,
}

/// A chart of marks over time (logarithmic), with their intervals; those of a `line` are joined in its order. Points of the front
/// are filled.
///
/// # Errors
/// [`Error::Check`] if it cannot be drawn.
pub fn scatter(size: (u32, u32), title: &str, marks: &[Mark], lines: &[Vec<usize>]) -> Result<String> {
    let mut svg = String::new();
    draw(&SVGBackend::with_string(&mut svg, size).into_drawing_area(), title, marks, lines)
        .map_err(|e| Error::Check(format!("chart \"{title}\": {e}")))?;
    Ok(svg)
}

fn range(values: impl Iterator<Item = f64>) -> std::ops::Range<f64> {
    let (low, high) = values
        .filter(|v| v.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
    if low > high {
        return 0.0..1.0;
    }
    let margin = (MARGIN * (high - low)).max(1e-3 * high.abs()).max(1e-3);
    low - margin..high + margin
}

fn ends(e: Estimate) -> [f64; 2] {
    e.interval.unwrap_or([e.value; 2])
}

fn draw(
    root: &DrawingArea<SVGBackend, Shift>,
    title: &str,
    marks: &[Mark],
    lines: &[Vec<usize>],
) -> std::result::Result<(), Box<dyn std::error::Error>> {
    root.fill(&WHITE)?;
    let x = range(marks.iter().flat_map(|m| ends(m.ratio).map(f64::log2)));
    let y = range(marks.iter().flat_map(|m| ends(m.error).map(|e| 100.0 * e)));
    let mut chart = ChartBuilder::on(root)
        .caption(title, ("sans-serif", 16))
        .margin(8)
        .x_label_area_size(36)
        .y_label_area_size(48)
        .build_cartesian_2d(x, y.start.max(0.0)..y.end)?;
    chart
        .configure_mesh()
        .x_desc("time over balanced")
        .y_desc("error, %")
        .x_label_formatter(&|x| format!("{:.2}", x.exp2()))
        .y_label_formatter(&|y| format!("{y:.1}"))
        .x_labels(6)
        .y_labels(6)
        .light_line_style(TRANSPARENT)
        .draw()?;
    let at = |m: &Mark| (m.ratio.value.log2(), 100.0 * m.error.value);
    for line in lines {
        let points = line.iter().map(|k| at(&marks[*k]));
        chart.draw_series(LineSeries::new(points, RGBColor(120, 120, 120).stroke_width(1)))?;
    }
    for m in marks {
        let (x, y) = at(m);
        let bars = [ends(m.ratio).map(|e| (e.log2(), y)), ends(m.error).map(|e| (x, 100.0 * e))];
        let pale = RGBColor(190, 190, 190).stroke_width(1);
        chart.draw_series(bars.map(|[a, b]| PathElement::new(vec![a, b], pale)))?;
    }
    for m in marks {
        let colour = if m.large { RGBColor(200, 60, 30) } else { RGBColor(30, 100, 60) };
        let radius = if m.large { 5 } else { 3 };
        let style = if m.front { colour.filled() } else { colour.stroke_width(1) };
        chart.draw_series([Circle::new(at(m), radius, style)])?;
        let text = EmptyElement::at(at(m)) + Text::new(m.label.clone(), (7, -5), ("sans-serif", 12));
        chart.draw_series([text])?;
    }
    root.present()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn charts_show_every_mark() {
        let known = |v: f64| Estimate { value: v, interval: Some([0.9 * v, 1.1 * v]) };
        let mark = |t: f64, e: f64, label: &str| Mark {
            ratio: known(t),
            error: known(e),
            label: label.into(),
            front: true,
            large: false,
        };
        let marks = [mark(1.0, 0.1, "one <&>"), mark(2.0, 0.05, "two")];
        let svg = scatter((400, 300), "chart", &marks, &[vec![0, 1]]).unwrap();
        assert!(
            svg.contains("one &lt;&amp;&gt;") && svg.contains("two") && svg.matches("<circle").count() == 2
        );
        // Nothing to show, and all in one place, are no reason to fail.
        scatter((400, 300), "chart", &[], &[]).unwrap();
        let point = Mark {
            ratio: Estimate { value: 1.0, interval: None },
            error: Estimate { value: 0.0, interval: None },
            ..mark(1.0, 1.0, "")
        };
        scatter((400, 300), "chart", &[point], &[]).unwrap();
    }
}
