//! README's table of knobs says what the program does.

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
