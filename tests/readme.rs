//! README's tables of knobs and of costs say what the program does, and what was measured.

use canopy::measure::path::CameraPath;
use canopy::measure::report::markdown;
use canopy::measure::results::BenchResult;
use canopy::measure::sweep::{self, SweepResult};
use canopy::settings::KNOBS;

#[test]
fn the_table_of_knobs_is_that_of_the_settings() {
    let mut table = String::from("| knob | unit | range | fast | balanced | accurate | meaning and cost |\n");
    table += "|---|---|---|---|---|---|---|\n";
    for k in KNOBS {
        let [fast, balanced, accurate] = k.presets;
        table += &format!("| `{}` | {} | {} – {} ", k.name, k.unit, k.min, k.max);
        table += &format!("| {fast} | {balanced} | {accurate} | {} |\n", k.help);
    }
    let readme = include_str!("../README.md");
    assert!(readme.contains(&table), "README.md must hold this table:\n\n{table}");
}

/// Files of `benches/results`, or a folder in it, that are sweeps, or benches.
fn results(within: &str, sweeps: bool) -> Vec<std::path::PathBuf> {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/results").join(within);
    let mut files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    let is_sweep = |f: &std::path::PathBuf| f.file_name().unwrap().to_str().unwrap().starts_with("sweep-");
    files.retain(|f| f.is_file() && is_sweep(f) == sweeps);
    files.sort();
    files
}

#[test]
fn the_table_of_costs_is_that_of_the_results() {
    let table = |within| {
        let files = results(within, false);
        markdown(&files.iter().map(|f| BenchResult::load(f).unwrap()).collect::<Vec<_>>())
    };
    let own = table("");
    assert!(include_str!("../README.md").contains(&own), "README.md must hold this table:\n\n{own}");
    let gpu = table("nvidia-h200-580.159.04");
    assert!(include_str!("../docs/gpu.md").contains(&gpu), "docs/gpu.md must hold this table:\n\n{gpu}");
}

#[test]
fn the_tables_of_sweeps_are_those_of_the_results() {
    for file in results("", true) {
        let tables = sweep::markdown::markdown(&SweepResult::load(&file).unwrap());
        for table in tables.split("\n\n") {
            let found = include_str!("../README.md").contains(table.trim_end());
            assert!(found, "README.md must hold this table of {}:\n\n{table}", file.display());
        }
    }
}

#[test]
fn the_conformance_cases_are_counted() {
    let counted = format!("check a driver: {} named cases", canopy::measure::conform::cases().len());
    assert!(include_str!("../README.md").contains(&counted), "README.md must say: {counted}");
}

#[test]
fn paths_are_named() {
    let readme = include_str!("../README.md");
    for (name, _) in CameraPath::BUILTIN {
        assert!(readme.contains(&format!("`{name}`")), "{name}");
    }
}
