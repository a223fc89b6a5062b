//! `canopy bench` as a script sees it: names that stay, times that add up, one clock, and what is refused.

#[path = "common/keys.rs"]
mod keys;

use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

/// A forest that is quick to bake and draw.
const SCENE: &str = r#"
name = "small"
[terrain]
extent = 400.0
[[species]]
name = "oak"
model = "builtin:oak"
density = 0.01
[sun]
azimuth = 120.0
elevation = 35.0
irradiance = [1.0, 0.95, 0.85]
[[camera]]
name = "c"
position = [200.0, 50.0, 20.0]
target = [200.0, 300.0, 5.0]
vertical_fov = 45.0
[quality]
preset = "fast"
view_rings = 2
view_resolution = 32
occlusion_rays = 8
cascade_size = 128
coverage_size = 64
table_angles = 6
table_densities = 3
table_rays = 64
"#;

fn bench(folder: &Path, args: &[&str]) -> Output {
    let scene = folder.join("small.toml");
    std::fs::write(&scene, SCENE).unwrap();
    let mut c = Command::new(env!("CARGO_BIN_EXE_canopy"));
    c.env("CANOPY_CACHE", Path::new(env!("CARGO_TARGET_TMPDIR")).join("bench-cache")).current_dir(folder);
    c.args(["bench", "small.toml", "--size", "96x64", "--quiet"]).args(args).output().unwrap()
}

fn json(folder: &Path, args: &[&str]) -> Value {
    let out = bench(folder, &[args, &["--json"]].concat());
    assert!(out.status.success(), "{args:?}: {}", String::from_utf8_lossy(&out.stderr));
    serde_json::from_slice(&out.stdout).unwrap()
}

#[test]
fn names_of_the_json_and_csv_stay() {
    let dir = tempfile::tempdir().unwrap();
    let files = [
        "--csv",
        "b.csv",
        "--bmf",
        "m.json",
        "-o",
        "o.json",
        "--pipeline-statistics",
        "--rasterizer",
        "graphics",
    ];
    let result = json(dir.path(), &[&["--frames", "3", "--step", "4"], &files[..]].concat());
    let named = ["settings", "assets", "bake_cache", "heaps", "allocations", "variables", "metrics"];
    let found = keys::keys(&result, &named);
    assert!(found == include_str!("data/bench_keys.txt"), "{found}");
    assert_eq!(result["rasterizer"], "graphics");
    let read = |name: &str| std::fs::read_to_string(dir.path().join(name)).unwrap();
    assert_eq!(serde_json::from_str::<Value>(&read("o.json")).unwrap(), result);

    let metrics: Vec<&str> = result["metrics"].as_object().unwrap().keys().map(|k| k.as_str()).collect();
    for name in
        ["frame.wall_ms", "frame.gpu_ms", "pass.trees.gpu_ms", "stage.image.gpu_ms", "pass.seeds.gpu_ms"]
    {
        assert!(metrics.contains(&name) || name == "pass.seeds.gpu_ms", "{name} is not in {metrics:?}");
    }
    let csv = read("b.csv");
    let header = "setting,frame,round,view,scope,name,start_ms,gpu_ms,cpu_ms,wall_ms,stream_ms,record_ms,wait_ms,draws,\
                  dispatches,trees_zfield,shadow_casters,terrain_quads,tiles_produced,tiles_evicted";
    assert_eq!(csv.lines().next(), Some(header));
    let columns = header.split(',').count();
    assert!(csv.lines().all(|l| l.split(',').count() == columns));
    let bmf: Value = serde_json::from_str(&read("m.json")).unwrap();
    let wall = &bmf["small/approach/frame.wall_ms"]["milliseconds"];
    assert_eq!(wall["value"], result["metrics"]["frame.wall_ms"]["median"]);
    // A triangle list of two triangles a tree: the pipeline counts at least the trees' vertices.
    let frame = &result["frames"][0];
    let trees = frame["passes"].as_array().unwrap().iter().find(|p| p["name"] == "trees").unwrap();
    let vertices = trees["statistics"]["input_vertices"].as_u64().unwrap();
    assert_eq!(vertices, 6 * frame["trees_zfield"].as_u64().unwrap());
}

/// One submission a frame, as on hardware, and one a pass. How nearly the passes add up to their frame is a proof's to say
/// (`tests/proofs/bench.rs`): here, that they are no more than it.
#[test]
fn passes_add_up_follow_their_submission_and_do_not_overlap() {
    let dir = tempfile::tempdir().unwrap();
    for together in [&["--together"][..], &[]] {
        let args = ["--frames", "8", "--step", "1", "--trace", "t.json"];
        let result = json(dir.path(), &[&args, together].concat());
        for f in result["frames"].as_array().unwrap() {
            assert_eq!(f["lost_stamps"], 0);
            let passes = f["passes"].as_array().unwrap();
            let sum: f64 = passes.iter().map(|p| p["gpu_ms"].as_f64().unwrap()).sum();
            assert!(sum > 0.0 && sum <= f["gpu_ms"].as_f64().unwrap() + 1e-6);
            assert!(f["cpu_ms"].as_f64().unwrap() > 0.0);
        }
        let trace: Value =
            serde_json::from_str(&std::fs::read_to_string(dir.path().join("t.json")).unwrap()).unwrap();
        check_trace(&trace, 1, &result);
    }
}

/// Complete events; on each thread they nest or are apart (half a microsecond of rounding); the GPU's lie within their frame.
fn check_trace(trace: &Value, process: u32, result: &Value) {
    let all = trace["traceEvents"].as_array().unwrap();
    let events: Vec<&Value> = all.iter().filter(|e| e["pid"] == process).collect();
    let number = |e: &Value, k: &str| e[k].as_f64().unwrap();
    let slack = 0.5;
    for thread in [1, 2] {
        let mut spans: Vec<(f64, f64, &str)> = events
            .iter()
            .filter(|e| e["ph"] == "X" && e["tid"] == thread)
            .map(|e| (number(e, "ts"), number(e, "ts") + number(e, "dur"), e["name"].as_str().unwrap()))
            .collect();
        assert!(!spans.is_empty() && spans.iter().all(|s| s.0 >= 0.0 && s.1 >= s.0));
        spans.sort_by(|a, b| a.0.total_cmp(&b.0).then(b.1.total_cmp(&a.1)));
        let mut open: Vec<(f64, f64, &str)> = Vec::new();
        for s in spans {
            while open.last().is_some_and(|o| o.1 <= s.0 + slack) {
                open.pop();
            }
            assert!(open.last().is_none_or(|o| s.1 <= o.1 + slack), "{s:?} overlaps {open:?}");
            open.push(s);
        }
    }
    let gpu = events.iter().filter(|e| e["ph"] == "X" && e["tid"] == 2);
    let frames = result["frames"].as_array().unwrap();
    for e in gpu {
        let at = number(e, "ts") / 1e3;
        let owner = frames.iter().find(|f| number(f, "submit_ms") - 1e-3 <= at && at <= number(f, "done_ms"));
        assert!(owner.is_some(), "{e} is in no frame's time from submission to done");
    }
    assert!(events.iter().any(|e| e["ph"] == "M" && e["name"] == "thread_name"));
}

#[test]
fn stamps_can_be_left_out_and_time_limits_count() {
    let dir = tempfile::tempdir().unwrap();
    let args = ["--frames", "100000", "--duration", "0.001", "--step", "4", "--no-stamps", "--together"];
    let result = json(dir.path(), &args);
    assert_eq!(result["frames"].as_array().unwrap().len(), 1);
    assert_eq!(result["frames"][0]["gpu_ms"], Value::Null);
    let metrics = result["metrics"].as_object().unwrap();
    assert!(metrics.contains_key("frame.wall_ms") && !metrics.keys().any(|k| k.ends_with("gpu_ms")));
}

#[test]
fn two_settings_are_drawn_in_turn() {
    let dir = tempfile::tempdir().unwrap();
    let args = ["--frames", "4", "--step", "4", "--against", "cascades=1", "--against", "cascade_size=64"];
    let files = ["--csv", "b.csv", "--trace", "t.json", "--bmf", "m.json", "-o", "o.json"];
    let both = json(dir.path(), &[&args[..], &files].concat());
    let other = &both["against"]["result"];
    assert_eq!((&both["settings"]["cascades"], &other["settings"]["cascades"]), (&3.0.into(), &1.0.into()));
    assert_eq!(other["settings"]["cascade_size"], 64.0);
    assert_eq!(both["against"]["comparison"]["in_turn"], true);
    // A B, B A: starts of the four frames.
    let start = |r: &Value, k: usize| r["frames"][k]["start_ms"].as_f64().unwrap();
    assert!(start(&both, 0) < start(other, 0) && start(other, 1) < start(&both, 1));
    assert!(start(other, 0) < start(other, 1) && start(&both, 1) < start(&both, 2));

    // Every file has both settings.
    let read = |name: &str| std::fs::read_to_string(dir.path().join(name)).unwrap();
    let parsed = |name: &str| serde_json::from_str::<Value>(&read(name)).unwrap();
    assert_eq!(parsed("o.json"), both);
    let csv = read("b.csv");
    for setting in ["A,", "B,"] {
        let frames = csv.lines().filter(|l| l.starts_with(setting) && l.contains(",frame,frame,"));
        assert_eq!(frames.count(), 4, "{csv}");
    }
    check_trace(&parsed("t.json"), 1, &both);
    check_trace(&parsed("t.json"), 2, other);
    let bmf = parsed("m.json");
    for (name, result) in [("", &both), (" cascades=1 cascade_size=64", other)] {
        let value = &bmf[&format!("small/approach{name}/frame.cpu_ms")]["milliseconds"]["value"];
        assert!(value.is_number() && *value == result["metrics"]["frame.cpu_ms"]["median"], "{bmf}");
    }
}

#[test]
fn what_is_wrong_is_refused_before_anything_is_drawn() {
    let dir = tempfile::tempdir().unwrap();
    for (args, hint) in [
        (&["--path", "orbt"][..], "did you mean \"orbit\"?"),
        (&["--step", "0"], "in steps of 0 s"),
        (&["--duration", "0"], "no time"),
        (&["--against", "cascade=1"], "\"cascades\""),
        (&["--csv", "a.txt"], "*.csv"),
        (&["--trace", "/nonexistent/a.json"], "no folder"),
    ] {
        let out = bench(dir.path(), args);
        let text = String::from_utf8_lossy(&out.stderr);
        assert_eq!(out.status.code(), Some(2), "{args:?}: {text}");
        assert!(text.contains(hint), "{args:?}: {text}");
    }
}
