//! `canopy accuracy`: a design that is the same every time, and cells that are measured once.

use std::path::Path;
use std::process::Command;

fn canopy(args: &[&str]) -> (i32, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_canopy")).args(args).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code().unwrap(), text(&output.stdout), text(&output.stderr))
}

#[test]
fn the_design_is_listed_without_measuring() {
    let (code, text, _) = canopy(&["accuracy", "--list", "--json"]);
    assert_eq!(code, 0);
    let cells: Vec<serde_json::Value> = serde_json::from_str(&text).unwrap();
    let kept = cells.iter().filter(|c| c["part"] == "kept").count();
    // A third of six of the ten forests for tuning, and the three of each of five others.
    assert_eq!((cells.len(), kept), (75, 35));
    let (code, _, error) = canopy(&["accuracy", "--list", "--only", "baobab"]);
    assert!(code == 2 && error.contains("\"baobab\"") && error.contains("oak+bush"), "{error}");
    let (code, _, error) = canopy(&["accuracy"]);
    assert!(code == 2 && error.contains("--output"), "{error}");
    let (code, _, error) = canopy(&["accuracy", "--list", "--drawn", "zfield"]);
    assert!(code == 2 && error.contains("LADDER@METRES"), "{error}");
}

/// One small cell, measured; asked for again it is read, and with another knob drawn anew against the same reference.
#[test]
fn cells_are_measured_once() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().to_str().unwrap();
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/oaks.toml");
    let small = ["--set", "view_resolution=64", "--set", "view_rings=4", "--set", "table_rays=256"];
    let run = |more: &[&str]| {
        let args =
            ["accuracy", scene.to_str().unwrap(), "-o", out, "--cells", "1", "--patches", "1", "--json"];
        let args =
            [&args[..], &["--until", "4spp", "--drawn", "zfield@300", "--quality", "fast"], &small[..], more];
        let (code, text, error) = canopy(&args.concat());
        assert_eq!(code, 0, "{error}");
        (serde_json::from_str::<serde_json::Value>(&text).unwrap(), error)
    };
    let (first, said) = run(&[]);
    assert!(said.contains("[1/1] oaks-1"), "{said}");
    let score = &first["cells"][0]["drawn"][0][1];
    // A crude bake of 64 texels: what is meant is only that it is a score.
    assert!(
        score["all"]["rms"].as_f64().unwrap() < 0.3 && score["fractions"][2].as_f64().unwrap() < 0.2,
        "{score}"
    );
    let html = std::fs::read_to_string(folder.path().join("accuracy.html")).unwrap();
    assert!(html.contains("oaks-1") && html.contains("<svg"), "a row and a chart");
    let (second, said) = run(&[]);
    assert!(second["cells"] == first["cells"] && !said.contains("[1/1]"), "{said}");
    let (third, said) = run(&["--set", "light_iterations=0"]);
    assert!(said.contains("[1/1] oaks-1"), "{said}");
    assert_eq!(third["cells"][0]["reference"], first["cells"][0]["reference"]);
    assert_ne!(third["cells"][0]["drawn"], first["cells"][0]["drawn"]);
}
