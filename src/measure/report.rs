//! Bench results as a table in Markdown.

use super::results::BenchResult;
use super::statistics::median;

/// A column a result: what was drawn, what each pass took, what came before. On software drivers a pass's time is CPU time of
/// all threads.
pub fn markdown(results: &[BenchResult]) -> String {
    let mut names: Vec<String> = Vec::new();
    for r in results {
        names.extend(r.pass_names().into_iter().filter(|n| !names.contains(n)).collect::<Vec<_>>());
    }
    let row = |name: &str, cell: &dyn Fn(&BenchResult) -> String| {
        let cells: Vec<String> = results.iter().map(cell).collect();
        format!("| {name} | {} |\n", cells.join(" | "))
    };
    let middle = |r: &BenchResult, value: &dyn Fn(&super::results::Frame) -> f64| {
        median(&r.frames.iter().map(value).collect::<Vec<_>>())
    };
    let metric = |r: &BenchResult, name: &str| {
        let s = r.metrics.get(name);
        s.map_or("–".into(), |s| format!("{} ({} – {})", ms(s.median), ms(s.p5), ms(s.p95)))
    };
    let heading =
        |r: &BenchResult| format!("{}, {}, {} × {}", r.scene.name, r.path.name, r.size[0], r.size[1]);
    let mut text = row("", &heading);
    text += &format!("|---|{}\n", "---|".repeat(results.len()));
    text += &row("trees drawn one by one", &|r| format!("{:.0}", middle(r, &|f| f64::from(f.trees_zfield))));
    text +=
        &row("casters in all cascades", &|r| format!("{:.0}", middle(r, &|f| f64::from(f.shadow_casters))));
    for name in &names {
        let cpu = format!("pass.{name}.cpu_ms");
        let gpu = format!("pass.{name}.gpu_ms");
        text += &row(name, &|r| metric(r, if r.metrics.contains_key(&cpu) { &cpu } else { &gpu }));
    }
    text += &row("whole frame, CPU time of all threads", &|r| metric(r, "frame.cpu_ms"));
    text += &row("whole frame, wall time", &|r| metric(r, "frame.wall_ms"));
    text += &row("first frame", &|r| ms(1e3 * r.cold.first_frame_s));
    let mib = |bytes: u64| bytes >> 20;
    text + &row("device memory, planned / allocated", &|r| {
        let all: u64 = r.memory.allocations.values().sum();
        format!("{} / {} MiB", mib(r.memory.planned), mib(all))
    })
}

/// Milliseconds for people.
fn ms(v: f64) -> String {
    match v {
        ..10.0 => format!("{v:.2} ms"),
        ..100.0 => format!("{v:.1} ms"),
        ..10_000.0 => format!("{v:.0} ms"),
        _ => format!("{:.1} s", 1e-3 * v),
    }
}
