//! `canopy shells` as a script sees it: what is baked is kept, held against meshes and drawn.

use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

const SCENE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/plain.toml");

fn run(cache: &Path, args: &[&str]) -> Output {
    let mut program = Command::new(env!("CARGO_BIN_EXE_canopy"));
    program.env("CANOPY_CACHE", cache).arg("shells").args(args).output().unwrap()
}

#[test]
fn shells_are_kept_measured_and_drawn() {
    let dir = tempfile::tempdir().unwrap();
    let picture = dir.path().join("stack.png");
    let small = [SCENE, "--slices", "4", "--texels", "16", "--quiet", "--json"];
    let json = |more: &[&str]| -> Value {
        let out = run(dir.path(), &[&small[..], more].concat());
        assert!(out.status.success() && out.stderr.is_empty(), "{}", String::from_utf8_lossy(&out.stderr));
        serde_json::from_slice(&out.stdout).unwrap()
    };
    let first = json(&["--verify", "3", "--rays", "300", "-o", picture.to_str().unwrap()]);
    let again = json(&[]);
    assert_eq!((&first["cache"], &again["cache"]), (&"baked".into(), &"hit".into()));
    // Sixteen tiles of 4 + 2 + 1 slices, mips of 256 to 1 texels of 12 bytes, and 16 to 1 of 28.
    assert_eq!(first["bytes"], 16 * 7 * (12 * (256 + 64 + 16 + 4 + 1) + 28 * (16 + 4 + 1)));
    // 256 trees of 0.0165 a m² on a tile; the pattern has about as many.
    let side = first["tile_side"].as_f64().unwrap();
    assert!((side - (256.0f64 / 0.0165).sqrt()).abs() < 0.04 * side, "{side}");
    let verify = &first["verify"];
    let angles = verify["angles"].as_array().unwrap();
    assert_eq!(angles.len(), 3 * 2, "each angle at full and half density");
    assert_eq!(angles[4]["zenith"], 80.0);
    for angle in angles {
        // Texels of 8 m are as large as crowns: this is about numbers that make sense, not about good ones.
        let long = &angle["stack"][1];
        assert_eq!(long["march"], "long");
        assert!(long["difference"].as_f64().unwrap().abs() < 0.2, "{angle}");
    }
    assert_eq!(verify["edges"].as_array().unwrap().len(), 2 * 4);
    assert_eq!(verify["coarse"].as_array().unwrap().len(), 3 * 5 * 2 * 2);
    assert_eq!(verify["seams"].as_array().unwrap().len(), 4);
    assert!(again["verify"].is_null());
    let image = image::open(&picture).unwrap();
    // A row of slices, one of densities, and four by four tiles, of 16 texels.
    assert_eq!((image.width(), image.height()), (4 * 16, 6 * 16));
    let text = run(dir.path(), &small[..5]);
    let text = String::from_utf8(text.stdout).unwrap();
    assert!(text.starts_with("plain: 16 tiles of ") && text.contains("(hit, "), "{text}");
}

#[test]
fn what_cannot_be_made_is_wrong_usage() {
    let dir = tempfile::tempdir().unwrap();
    for (args, said) in [
        (&[SCENE, "--slices", "12"][..], "powers of two"),
        (&[SCENE, "--texels", "1024"], "powers of two"),
        (&[SCENE, "-o", "stack.exr"], "png"),
        (&[SCENE, "--rays", "9"], "--verify"),
        (&["no.toml"], "no.toml"),
    ] {
        let out = run(dir.path(), args);
        let text = String::from_utf8(out.stderr).unwrap();
        assert!(out.status.code() == Some(2) && text.contains(said), "{args:?}: {text}");
    }
    assert!(std::fs::read_dir(dir.path()).unwrap().next().is_none(), "nothing is kept");
}
