//! `canopy sweep` as a script sees it: it ends, goes on, parts and joins, and refuses what is stale; and `canopy render --budget`
//! takes what it found. `canopy difference` on the images that are compared.

#[path = "common/keys.rs"]
mod keys;

use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

/// A forest that is quick to bake and draw: presets differ in what is neither baked nor large.
const SCENE: &str = r#"
name = "small"
[terrain]
extent = 300.0
[[species]]
name = "oak"
model = "builtin:oak"
density = 0.01
[sun]
azimuth = 120.0
elevation = 35.0
irradiance = [1.0, 0.95, 0.85]
[sky]
radiance = 0.1
[[camera]]
name = "near"
position = [150.0, 30.0, 20.0]
target = [150.0, 200.0, 5.0]
vertical_fov = 45.0
[quality]
view_rings = 2
view_resolution = 32
view_iterations = 1
light_iterations = 1
occlusion_rays = 8
cascade_size = 128
coverage_size = 64
table_angles = 6
table_densities = 3
table_rays = 64
"#;

const SIZE: &str = "48x32";

fn program(folder: &Path, args: &[&str]) -> Output {
    std::fs::write(folder.join("small.toml"), SCENE).unwrap();
    let mut c = Command::new(env!("CARGO_BIN_EXE_canopy"));
    c.env("CANOPY_CACHE", Path::new(env!("CARGO_TARGET_TMPDIR")).join("sweep-cache")).current_dir(folder);
    c.args(args).output().unwrap()
}

fn done(folder: &Path, args: &[&str]) -> Output {
    let out = program(folder, args);
    assert!(out.status.success(), "{args:?}: {}", String::from_utf8_lossy(&out.stderr));
    out
}

/// One knob, which changes the images, against the most accurate setting.
fn sweep(folder: &Path, out: &str, more: &[&str]) -> Output {
    let knobs = ["sweep", "small.toml", "--size", SIZE, "--knobs", "samples", "--rounds", "2"];
    let against = ["--reference", "none"];
    program(folder, &[&knobs[..], &against, &["--product", "1", "--quiet", "-o", out], more].concat())
}

fn result(folder: &Path, out: &str) -> Value {
    serde_json::from_slice(&std::fs::read(folder.join(out).join("sweep.json")).unwrap()).unwrap()
}

/// What does not depend on the machine's pace: settings, memory and errors, by name.
fn still(result: &Value) -> Vec<Value> {
    let mut points = result["points"].as_array().unwrap().clone();
    points.iter_mut().for_each(|p| {
        let p = p.as_object_mut().unwrap();
        p.remove("time");
        p.remove("allocated_bytes");
    });
    points
}

fn names(result: &Value) -> Vec<String> {
    result["points"].as_array().unwrap().iter().map(|p| p["name"].as_str().unwrap().into()).collect()
}

#[test]
fn a_sweep_ends_goes_on_parts_and_joins() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let ok = |out: Output| assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    ok(sweep(at, "whole", &[]));
    let whole = result(at, "whole");
    let all = names(&whole);
    assert_eq!(all[..3], ["balanced", "fast", "accurate"]);
    for name in ["balanced samples=1", "balanced samples=8", "fast samples=1", "accurate samples=4"] {
        assert!(all.iter().any(|n| n == name), "{name} is not in {all:?}");
    }
    assert_eq!(whole["left"], Value::Array(Vec::new()));

    // Names of the JSON and CSV stay.
    let mut one = whole.clone();
    one["identity"]["presets"] = whole["identity"]["presets"]["fast"].clone();
    let named =
        ["presets", "settings", "most_accurate", "assets", "variables", "changed", "regions", "ranges"];
    let found = keys::keys(&one, &named);
    assert!(found == include_str!("data/sweep_keys.txt"), "{found}");
    let csv = std::fs::read_to_string(at.join("whole/sweep.csv")).unwrap();
    let header = "setting,base,group,ms,time_ratio,time_ratio_low,time_ratio_high,wall_ms,planned_bytes,allocated_bytes,samples,\
                  error_against,rmse,rmse_low,rmse_high,bias,flip,ssim,popping,distance_spread,rmse_to_most_accurate,front,\
                  dominated_by,refused";
    assert_eq!(csv.lines().next(), Some(header));
    assert_eq!(csv.lines().count(), all.len() + 1);
    assert!(csv.lines().all(|l| l.split(',').count() == header.split(',').count()));
    let html = std::fs::read_to_string(at.join("whole/report.html")).unwrap();
    assert!(html.contains("BN12") && html.matches("<svg").count() == 2 && !html.contains("src=\"http"));
    assert_eq!(html.matches("data:image/png;base64,iVBOR").count(), 3 * 2);

    // Fewer samples are an error.
    let points = whole["points"].as_array().unwrap();
    let point = |name: &str| points.iter().find(|p| p["name"] == name).unwrap();
    let error = |name: &str| {
        point(name)["errors"][0]["against_most_accurate"]["foreground"]["rmse"]["value"].as_f64().unwrap()
    };
    assert!(error("balanced samples=1") > error("balanced") && error("balanced") > 0.0);
    for p in points {
        let [planned, allocated] = ["planned_bytes", "allocated_bytes"].map(|k| p[k].as_f64().unwrap());
        assert!((0.7..1.5).contains(&(allocated / planned)), "{}: {planned} planned, {allocated}", p["name"]);
    }
    assert_eq!(point("balanced")["time"]["ratio"]["value"], 1.0);

    // Two shards find what the whole found; joined, nothing is left to measure and the points are in the same order.
    ok(sweep(at, "s1", &["--shard", "1/2"]));
    // A budget that is over at once begins nothing, and says what is left.
    ok(sweep(at, "s2", &["--shard", "2/2", "--budget", "0s"]));
    let nothing = result(at, "s2");
    assert!(names(&nothing).is_empty() && nothing["left"].as_array().unwrap().len() >= 6);
    ok(sweep(at, "s2", &["--shard", "2/2"]));
    let parts = ["s1", "s2"].map(|s| names(&result(at, s)));
    assert!(!parts[0].is_empty() && parts[0].iter().all(|n| !parts[1].contains(n)));
    ok(sweep(at, "joined", &["--from", "s1", "--from", "s2"]));
    let joined = result(at, "joined");
    let singles = |r: &Value| still(r).into_iter().filter(|p| p["group"] != "product").collect::<Vec<_>>();
    assert_eq!(singles(&joined), singles(&whole));

    // Once more: nothing is measured again, so that every time stays.
    let before = std::fs::read(at.join("joined/sweep.json")).unwrap();
    ok(sweep(at, "joined", &[]));
    let again = result(at, "joined");
    assert_eq!(serde_json::from_slice::<Value>(&before).unwrap()["points"], again["points"]);
    // What was lost is measured again, and only that.
    let mut torn = again.clone();
    torn["points"].as_array_mut().unwrap().remove(1);
    std::fs::write(at.join("joined/sweep.json"), torn.to_string()).unwrap();
    ok(sweep(at, "joined", &[]));
    let mended = result(at, "joined");
    assert_eq!(names(&mended), names(&again));
    assert!(
        mended["points"][0] == again["points"][0]
            && mended["points"][1]["time"] != again["points"][1]["time"]
    );

    // Another sweep does not go on with this one.
    let stale = sweep(at, "joined", &["--set", "cascades=1"]);
    let text = String::from_utf8_lossy(&stale.stderr).to_string();
    assert_eq!(stale.status.code(), Some(2), "{text}");
    assert!(
        text.contains("another sweep: most_accurate, presets differ") && text.contains("remedy"),
        "{text}"
    );
    assert_eq!(result(at, "joined"), mended);

    render_within_a_budget(at);
}

/// The most accurate setting that holds a time, taken from the sweep in `joined`.
fn render_within_a_budget(at: &Path) {
    let render = |budget: &str, size: &str, more: &[&str]| {
        let args =
            ["render", "small.toml", "--sweep", "joined/sweep.json", "--budget", budget, "-o", "a.png"];
        program(at, &[&args[..], &["--json", "--quiet", "--size", size], more].concat())
    };
    let out = render("1h", SIZE, &[]);
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let report: Value = serde_json::from_slice(&out.stdout).unwrap();
    let chosen = &report["budget"];
    let swept = result(at, "joined");
    let point = swept["points"].as_array().unwrap().iter().find(|p| p["name"] == chosen["setting"]).unwrap();
    assert_eq!((&point["settings"], &point["time"]["wall_ms"]), (&report["settings"], &chosen["wall_ms"]));
    // With an hour a frame nothing but accuracy counts.
    let error = |p: &Value| -> f64 {
        let blocks = p["errors"]
            .as_array()
            .unwrap()
            .iter()
            .flat_map(|e| e["most_accurate_blocks"].as_array().unwrap());
        blocks.map(|b| b.as_f64().unwrap()).sum()
    };
    assert!(swept["points"].as_array().unwrap().iter().all(|p| error(p) >= error(point)));
    for (budget, size, more, hint) in [
        ("0.001ms", SIZE, &[][..], "no setting"),
        ("1h", "50x32", &[], "--size 48x32"),
        ("1h", SIZE, &["--quality", "fast"], "cannot be used with"),
        ("soon", SIZE, &[], "50ms"),
    ] {
        let out = render(budget, size, more);
        let text = String::from_utf8_lossy(&out.stderr);
        assert!(out.status.code() == Some(2) && text.contains(hint), "{budget} {size} {more:?}: {text}");
    }
    let none = program(at, &["render", "small.toml", "--budget", "1s", "--size", "20x20", "-o", "b.png"]);
    let text = String::from_utf8_lossy(&none.stderr);
    assert!(none.status.code() == Some(2) && text.contains("canopy sweep"), "{text}");
}

#[test]
fn a_sweep_traces_its_reference_once() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let swept = |out: &str, more: &[&str]| {
        let args =
            ["sweep", "small.toml", "--size", "24x16", "--knobs", "samples", "--rounds", "2", "--quiet"];
        program(at, &[&args[..], &["--reference-until", "4spp", "-o", out], more].concat())
    };
    let ok = |out: Output| assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    // Traced even where no time is left for settings.
    ok(swept("a", &["--budget", "0s"]));
    let image = |out: &str| std::fs::read(at.join(out).join("near.exr")).unwrap();
    let written = || std::fs::metadata(at.join("a/near.exr")).unwrap().modified().unwrap();
    let before = (image("a"), written());
    // Its errors are against the reference, and going on takes that which is there.
    ok(swept("a", &["--shard", "1/7"]));
    assert!(before == (image("a"), written()));
    let points = result(at, "a")["points"].as_array().unwrap().clone();
    let error = &points[0]["errors"][0]["against_reference"];
    assert!(points[0]["name"] == "balanced" && error["foreground"]["rmse"]["value"].as_f64().unwrap() > 0.0);
    assert!(error["reference_noise"].as_f64().unwrap() > 0.0, "{error}");
    // The same anywhere, so that shards join.
    ok(swept("b", &["--budget", "0s"]));
    assert_eq!(image("a"), image("b"));
    ok(swept("c", &["--budget", "0s", "--from", "a"]));
    assert!(image("c") == image("a") && result(at, "c")["points"] == result(at, "a")["points"]);
    // Another goal, and an image that was changed, are not taken for it.
    for (out, more, hint) in [
        ("a", &["--bounces", "2"][..], "reference of something else"),
        ("a", &["--reference", "near.exr"], "cannot be used with"),
    ] {
        let out = swept(out, more);
        let text = String::from_utf8_lossy(&out.stderr);
        assert!(out.status.code() == Some(2) && text.contains(hint), "{more:?}: {text}");
    }
    done(at, &["render", "small.toml", "--size", "24x16", "--quiet", "-o", "x.png", "--exr", "b/near.exr"]);
    assert_eq!(swept("b", &["--budget", "0s"]).status.code(), Some(2));
}

#[test]
fn differences_of_images_are_told() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    for (name, samples) in [("a", "samples=1"), ("b", "samples=4")] {
        let (png, exr) = (format!("{name}.png"), format!("{name}.exr"));
        let args =
            ["render", "small.toml", "--size", SIZE, "--quiet", "--set", samples, "-o", &png, "--exr", &exr];
        done(at, &args);
    }
    let json = |a: &str, b: &str| -> Value {
        serde_json::from_slice(&done(at, &["difference", a, b, "--json", "-o", "flip.png"]).stdout).unwrap()
    };
    let same = json("b.exr", "b.exr");
    assert_eq!((&same["image"]["rmse"]["value"], &same["flip"]["value"]), (&0.0.into(), &0.0.into()));
    assert!((same["ssim"]["value"].as_f64().unwrap() - 1.0).abs() < 1e-9);
    let other = json("a.exr", "b.exr");
    assert!(
        other["foreground"]["rmse"]["value"].as_f64().unwrap() > 0.01
            && other["flip"]["value"].as_f64().unwrap() > 0.0
    );
    let keys: Vec<&str> = other.as_object().unwrap().keys().map(String::as_str).collect();
    let expected = [
        "actual",
        "averaged",
        "command",
        "detail",
        "distance_spread",
        "exposure",
        "flip",
        "foreground",
        "image",
        "not_finite",
        "over_distance",
        "ranges",
        "reference",
        "reference_noise",
        "regions",
        "schema_version",
        "size",
        "ssim",
    ];
    assert_eq!(keys, expected);
    // As much changes in the image as in the reference; and nothing in the reference.
    let popping = |moved: [&str; 2]| -> f64 {
        let args = ["difference", "a.exr", "b.exr", "--json", "--moved", moved[0], moved[1]];
        let found: Value = serde_json::from_slice(&done(at, &args).stdout).unwrap();
        found["popping"]["value"].as_f64().unwrap()
    };
    assert!(popping(["b.exr", "a.exr"]).abs() < 1e-6);
    assert!(popping(["b.exr", "b.exr"]) > 0.01 && popping(["a.exr", "a.exr"]) < -0.01);
    assert_eq!(image::open(at.join("flip.png")).unwrap().to_rgb8().dimensions(), (48, 32));
    for (args, hint) in [
        (&["difference", "a.exr", "small.toml"][..], "not a linear image"),
        (&["difference", "a.exr", "none.exr"], "none.exr"),
        (&["difference", "a.exr", "b.exr", "-o", "flip.jpg"], "*.png"),
        (&["difference", "a.exr", "b.exr", "--moved", "a.exr", "none.exr"], "none.exr"),
        (&["sweep", "small.toml", "-o", "s", "--knobs", "sample"], "\"samples\""),
        (&["sweep", "-o", "s", "--reference", "a.exr"], "one image, and there are 4 cameras"),
        (&["sweep", "small.toml", "-o", "s", "--reference", "a.exr"], "--size 48x32"),
    ] {
        let out = program(at, args);
        let text = String::from_utf8_lossy(&out.stderr);
        assert!(out.status.code() == Some(2) && text.contains(hint), "{args:?}: {text}");
    }
}
