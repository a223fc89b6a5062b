//! Line charts as SVG.

use std::path::Path;

use plotters::prelude::*;

/// Draws lines over an axis that is logarithmic if `log`, with names in a legend where there are few.
pub fn lines(
    path: &Path,
    title: &str,
    (x_name, y_name): (&str, &str),
    y_range: (f64, f64),
    log: bool,
    series: &[(String, Vec<[f64; 2]>)],
) {
    let root = SVGBackend::new(path, (900, 560)).into_drawing_area();
    root.fill(&WHITE).unwrap();
    let place = |x: f64| if log { x.log10() } else { x };
    let all = || series.iter().flat_map(|(_, points)| points.iter().map(|p| place(p[0])));
    let (low, high) = (all().fold(f64::INFINITY, f64::min), all().fold(f64::NEG_INFINITY, f64::max));
    let mut chart = ChartBuilder::on(&root)
        .caption(title, ("sans-serif", 20))
        .margin(12)
        .x_label_area_size(40)
        .y_label_area_size(56)
        .build_cartesian_2d(low..high, y_range.0..y_range.1)
        .unwrap();
    chart
        .configure_mesh()
        .x_desc(x_name)
        .y_desc(y_name)
        .x_label_formatter(&|x| if log { format!("{:.0}", 10f64.powf(*x)) } else { format!("{x:.0}") })
        .draw()
        .unwrap();
    for (k, (name, points)) in series.iter().enumerate() {
        let colour = HSLColor(k as f64 / series.len() as f64, 0.75, 0.42);
        let line = LineSeries::new(points.iter().map(|p| (place(p[0]), p[1])), colour.stroke_width(1));
        let drawn = chart.draw_series(line).unwrap();
        if series.len() <= 8 {
            drawn.label(name).legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], colour));
        }
    }
    if series.len() <= 8 {
        chart.configure_series_labels().background_style(WHITE).border_style(BLACK).draw().unwrap();
    }
    root.present().unwrap();
}
