//! The program as a script sees it: exit codes, JSON, files, and the same bits every time.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

/// Small and coarse: what is tested here is the program, not the picture.
const COARSE: [&str; 21] = [
    "--size",
    "96x64",
    "--quality",
    "fast",
    "--set",
    "view_rings=2",
    "--set",
    "view_resolution=32",
    "--set",
    "zfield_min_pixels=16",
    "--set",
    "cascade_size=256",
    "--set",
    "occlusion_rays=8",
    "--set",
    "table_angles=6",
    "--set",
    "table_densities=3",
    "--set",
    "table_rays=64",
    "--quiet",
];

/// A cache that the tests of this file share and no one else.
fn program() -> Command {
    let mut c = Command::new(env!("CARGO_BIN_EXE_canopy"));
    c.env("CANOPY_CACHE", Path::new(env!("CARGO_TARGET_TMPDIR")).join("cli-cache"));
    c
}

fn run(args: &[&str]) -> Output {
    program().args(args).output().unwrap()
}

/// Runs what must succeed, and reads its JSON.
fn json(args: &[&str]) -> Value {
    let out = run(args);
    assert!(out.status.success(), "{args:?}: {}", String::from_utf8_lossy(&out.stderr));
    serde_json::from_slice(&out.stdout).unwrap()
}

/// Runs what must fail with a code, and returns what it says.
fn refused(code: i32, args: &[&str]) -> String {
    let out = run(args);
    let text = String::from_utf8(out.stderr).unwrap();
    assert_eq!(out.status.code(), Some(code), "{args:?}: {text}");
    assert!(text.starts_with("error: "), "{text}");
    assert!(out.stdout.is_empty(), "{args:?} printed to the standard output");
    text
}

fn scene(dir: &Path, text: &str) -> String {
    let path = dir.join("scene.toml");
    std::fs::write(&path, text).unwrap();
    path.to_str().unwrap().into()
}

/// Names of what a folder holds: nothing unfinished may stay behind.
fn listed(dir: &Path) -> Vec<String> {
    let mut names: Vec<_> =
        std::fs::read_dir(dir).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn wrong_usage_is_2_and_says_what_to_do() {
    for (args, hint) in [
        (&["plan", "--size", "10"][..], "1024x768"),
        (&["plan", "--size", "0x10"], "1 to 65536"),
        (&["plan", "--set", "cascade=2"], "\"cascades\""),
        (&["plan", "--set", "samples=3"], "1, 4 or 8"),
        (&["plan", "--set", "samples"], "KNOB=VALUE"),
        (&["plan", "--camera", "ridgeline"], "did you mean \"ridge-line\"?"),
        (&["plan", "--quality", "best"], "accurate"),
        (&["plan", "--set", "memory_mib=16"], "largest items"),
        (&["plan", "/nonexistent/scene.toml"], "/nonexistent/scene.toml"),
        (&["render", "-o", "/nonexistent/a.png"], "no folder /nonexistent"),
        (&["render", "-o", "a.jpg"], "*.png"),
        (&["render", "--exr", "a.png"], "*.exr"),
        (&["render", "--exposure", "lots"], "-64 to 64"),
        (&["render", "--time", "soon"], "write seconds"),
        (&["bench", "--time", "inf"], "write seconds"),
        (&["render", "--capture-frame", "3", "--frames", "2"], "--capture-frame 3"),
        (&["render", "--capture-frame", "1"], "RenderDoc"),
        (&["conform", "--shard", "3/2"], "2/8"),
        (&["conform", "no-such-case"], "--list"),
        (&["render", "--frames", "0"], "--frames"),
        (&["bake", "builtin:oka"], "\"oak\""),
        (&["bake", "/nonexistent.glb"], "/nonexistent.glb"),
        (&["bake", "builtin:oak", "--height", "0"], "0.01 to 1000"),
        (&["tree", "elm"], "birch"),
        (&["tree", "oka"], "\"oak\""),
        (&["tree", "oak", "--set", "bas_size=0.4"], "`base_size`?"),
        (&["tree", "oak", "--set", "base_size=4"], "0 to 0.95"),
        (&["tree", "/nonexistent/elm.toml"], "/nonexistent/elm.toml"),
        (&["tree", "oak", "-o", "/nonexistent/oak.glb"], "no folder /nonexistent"),
    ] {
        let text = refused(2, args);
        assert!(text.contains(hint), "{args:?}: {text}");
    }
    assert_eq!(run(&[]).status.code(), Some(2));
    assert_eq!(run(&["rendr"]).status.code(), Some(2));
}

#[test]
fn a_bad_scene_names_file_and_line() {
    let dir = tempfile::tempdir().unwrap();
    let bad = scene(dir.path(), "[terrain]\nextent = 100.0\n[[camera]]\nnane = \"a\"\n");
    let text = refused(2, &["plan", &bad]);
    assert!(text.contains("scene.toml") && text.contains('4') && text.contains("`name`"), "{text}");
}

#[test]
fn no_such_device_is_3() {
    let text = refused(3, &["plan", "--device", "no such device"]);
    assert!(text.contains("no such device"), "{text}");
    let dir = tempfile::tempdir().unwrap();
    let png = dir.path().join("a.png");
    refused(3, &["render", "--device", "nonsense", "-o", png.to_str().unwrap()]);
    assert!(listed(dir.path()).is_empty());
}

#[test]
fn a_plan_needs_no_driver_unless_one_is_named() {
    let mut without = program();
    without.env("VK_DRIVER_FILES", "/nonexistent").env("VK_ICD_FILENAMES", "/nonexistent");
    let out = without.args(["plan", "--json"]).output().unwrap();
    assert!(out.status.success());
    let plan: Value = serde_json::from_slice(&out.stdout).unwrap();
    assert!(plan["device"].is_null() && plan["total_bytes"].as_u64().unwrap() > 0);
    let out = without.args(["--device", "any"]).output().unwrap();
    assert_eq!(out.status.code(), Some(3));
}

/// The layers' best practices disagree with some choices made here on purpose; asked for through the environment,
/// they prove that a message makes the exit code 4.
#[test]
fn a_validation_message_is_4_and_none_is_0() {
    let dir = tempfile::tempdir().unwrap();
    let png = dir.path().join("a.png");
    let render = |with: bool| {
        let mut c = program();
        c.args(["render", "--validate", "-o", png.to_str().unwrap()]).args(COARSE);
        if with {
            c.env("VK_LAYER_ENABLES", "VK_VALIDATION_FEATURE_ENABLE_BEST_PRACTICES_EXT");
            c.env("VK_KHRONOS_VALIDATION_VALIDATE_BEST_PRACTICES", "true");
        }
        c.output().unwrap()
    };
    let (clean, warned) = (render(false), render(true));
    assert_eq!(clean.status.code(), Some(0), "{}", String::from_utf8_lossy(&clean.stderr));
    let text = String::from_utf8_lossy(&warned.stderr);
    assert_eq!(warned.status.code(), Some(4), "{text}");
    assert!(text.contains("validation message") && text.contains("BestPractices"), "{text}");
}

#[test]
fn plan_lists_what_the_scene_needs_and_no_more() {
    let names = |args: &[&str]| -> Vec<String> {
        let plan = json(args);
        let items = plan["plan"]["items"].as_array().unwrap();
        let sum: u64 = items.iter().map(|i| i["bytes"].as_u64().unwrap()).sum();
        assert_eq!(plan["total_bytes"].as_u64(), Some(sum));
        assert!(items.iter().all(|i| !i["reason"].as_str().unwrap().is_empty()));
        items.iter().map(|i| i["name"].as_str().unwrap().to_string()).collect()
    };
    let all = names(&["plan", "--json"]);
    for name in ["height map", "z-field views of oak", "seeds", "shadow cascades", "image", "tone map"] {
        assert!(all.iter().any(|n| n == name), "{name} is not in {all:?}");
    }
    for (rasterizer, own, other) in
        [("graphics", "trees converged", "tile lists"), ("tiles", "tile lists", "trees converged")]
    {
        let args = ["plan", "--rasterizer", rasterizer, "--json"];
        assert_eq!(json(&args)["plan"]["rasterizer"], rasterizer);
        let names = names(&args);
        assert!(
            names.iter().any(|n| n == own) && names.iter().all(|n| n != other),
            "{rasterizer}: {names:?}"
        );
    }
    let dir = tempfile::tempdir().unwrap();
    let bare = scene(
        dir.path(),
        "[terrain]\nextent = 100.0\n[[camera]]\nname = \"a\"\nposition = [0.0, 0.0, 2.0]\n\
         target = [50.0, 50.0, 0.0]\nvertical_fov = 45.0\n",
    );
    let few = names(&["plan", &bare, "--json"]);
    for absent in ["height map", "seeds", "shadow cascades", "trees"] {
        assert!(few.iter().all(|n| n != absent), "{absent} is in {few:?}");
    }
}

#[test]
fn a_ladder_is_the_scenes_or_the_one_that_is_given() {
    let dir = tempfile::tempdir().unwrap();
    let file = scene(dir.path(), &format!("{PATCHES}\n[quality]\nladder = \"zfield:8,shader-map\"\n"));
    let ladder = |args: &[&str]| {
        let plan = json(&[&["plan", &file, "--json"], args].concat());
        (plan["plan"]["ladder"].as_str().unwrap().to_string(), plan["plan"]["range"].as_f64().unwrap())
    };
    let (own, range) = ladder(&[]);
    assert_eq!(own, "zfield:8,shader-map");
    // But for the last digit, which reading JSON rounds.
    let is = |args: &[&str], text: &str, wanted: f64| {
        let (printed, range) = ladder(args);
        assert!(printed == text && (range - wanted).abs() <= 1e-12 * wanted, "{args:?}: {printed}, {range}");
    };
    // Half as high, twice as far; and where it does not say, the knob does.
    is(&["--ladder", "zfield:4,shader-map"], "zfield:4,shader-map", 2.0 * range);
    let knob = ["--set", "zfield_min_pixels=2"];
    for (asked, rungs) in [
        (["--ladder", "zfield,shader-map"], "zfield:2,shader-map"),
        (["--ladder", "auto"], "mesh:256,zfield:2,shader-map"),
        (["--representation", "auto"], "mesh:256,zfield:2,shader-map"),
    ] {
        is(&[&asked[..], &knob].concat(), rungs, 4.0 * range);
    }
    // The scene's own height is no knob.
    is(&knob, "zfield:8,shader-map", range);
    for asked in ["--ladder", "--representation"] {
        is(&[asked, "shader-map"], "shader-map", 0.0);
        let (alone, far) = ladder(&[asked, "zfield"]);
        // Not to infinity: as far as the scene needs.
        assert!(alone == "zfield" && far > 500.0 && far < 2000.0, "{far}");
    }
    let quiet = ["--quiet", "--json"];
    for command in ["render", "bench", "plan", "reflectance"] {
        for (args, hint) in [
            (
                &["--ladder", "slices:256,zfield:4,shader-map"][..],
                "the rungs are: mesh, cards, zfield, shader-map, shells",
            ),
            (&["--ladder", "zfield:4"], "the last rung goes on to the horizon"),
            (&["--ladder", "shader-map,zfield"], "near to far"),
            (&["--ladder", "zfield,shader-map", "--representation", "auto"], "cannot be used with"),
        ] {
            let text = refused(2, &[&[command, &file], args, &quiet[..]].concat());
            assert!(text.contains(hint), "{command} {args:?}: {text}");
        }
    }
    let folder = dir.path().join("s").display().to_string();
    let text = refused(2, &["sweep", &file, "-o", &folder, "--ladder", "slices"]);
    assert!(text.contains("the rungs are: mesh, cards, zfield, shader-map, shells"), "{text}");
}

#[test]
fn quality_goes_preset_then_scene_then_set() {
    let dir = tempfile::tempdir().unwrap();
    let text = "[terrain]\nextent = 100.0\n[[camera]]\nname = \"a\"\nposition = [0.0, 0.0, 2.0]\n\
                target = [50.0, 50.0, 0.0]\nvertical_fov = 45.0\n[quality]\npreset = \"accurate\"\ncascades = 1\n\
                coverage_size = 64\n";
    let file = scene(dir.path(), text);
    let args = ["plan", &file, "--json", "--quality", "fast", "--set", "coverage_size=32", "--seed", "9"];
    let settings = json(&args)["settings"].clone();
    let size = |preset| canopy::settings::Settings::preset(preset).unwrap().cascade_size;
    assert_eq!(settings["cascade_size"], size("fast"), "the preset of --quality");
    assert_eq!(settings["cascades"], 1, "the scene's own knob");
    assert_eq!(settings["coverage_size"], 32, "--set");
    assert_eq!(json(&args[..3])["settings"]["cascade_size"], size("accurate"), "the scene's preset");
}

#[test]
fn devices_and_trees() {
    let devices = json(&["devices", "--json"]);
    assert_eq!(devices["schema_version"], 2);
    for key in ["name", "uuid", "kind", "driver", "api", "missing"] {
        assert!(!devices["devices"][0][key].is_null(), "{key}");
    }
    let dir = tempfile::tempdir().unwrap();
    for preset in ["oak", "pine", "birch"] {
        let path = dir.path().join(format!("{preset}.glb"));
        let report = json(&["tree", preset, "-o", path.to_str().unwrap(), "--seed", "3", "--json"]);
        let mesh = canopy::scene::model::load_model(&path, None).unwrap();
        assert_eq!(report["triangles"], mesh.triangles.len());
        assert_eq!(report["bytes"], path.metadata().unwrap().len());
    }
    assert_eq!(listed(dir.path()), ["birch.glb", "oak.glb", "pine.glb"]);
}

#[test]
fn a_bake_is_measured_and_kept() {
    let cache = tempfile::tempdir().unwrap();
    let model = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/oak.glb");
    let args = ["bake", model, "--verify", "4", "--json", "--quiet", "--set", "view_rings=2"];
    let args = [&args[..], &["--set", "view_resolution=32", "--set", "occlusion_rays=8"]].concat();
    let bake = || -> Value {
        let out = program().env("CANOPY_CACHE", cache.path()).args(&args).output().unwrap();
        assert!(out.status.success() && out.stderr.is_empty());
        serde_json::from_slice::<Value>(&out.stdout).unwrap()["species"][0].clone()
    };
    let (first, again) = (bake(), bake());
    assert_eq!((&first["cache"], &again["cache"]), (&"baked".into(), &"hit".into()));
    assert_eq!(first["optics"], again["optics"]);
    assert_eq!(first["verify"], again["verify"]);
    let verify = first["verify"].as_array().unwrap();
    assert_eq!(verify.len(), 2, "one row for each iteration of the preset");
    assert!(verify.iter().all(|v| v["iou_mean"].as_f64().unwrap() > 0.5), "{verify:?}");
    let path = PathBuf::from(first["path"].as_str().unwrap());
    assert!(path.starts_with(cache.path()) && path.is_file());
    // Light transfer and tables are artefacts of their own: one band fewer bakes no views.
    let transfer = |b: &Value| (b["transfer"]["bands"].clone(), b["transfer"]["cache"].clone());
    assert_eq!(transfer(&first), (2.into(), "baked".into()));
    assert_eq!(transfer(&again), (2.into(), "hit".into()));
    let path = PathBuf::from(again["transfer"]["path"].as_str().unwrap());
    assert!(path.starts_with(cache.path()) && path.is_file());
    let out = program()
        .env("CANOPY_CACHE", cache.path())
        .args(["bake", model, "--set", "view_rings=2", "--set", "view_resolution=32"])
        .args(["--set", "occlusion_rays=8", "--set", "transfer_bands=1"])
        .output()
        .unwrap();
    let told = String::from_utf8(out.stdout).unwrap();
    let row = |what: &str| told.lines().find(|l| l.contains(what)).unwrap_or_else(|| panic!("{told}"));
    assert!(row("cache: views").contains(" hit /"), "{told}");
    assert!(row("cache: light transfer").contains(" baked /"), "{told}");
}

#[test]
fn the_same_image_twice_and_on_one_thread() {
    let dir = tempfile::tempdir().unwrap();
    let render = |name: &str, threads: Option<&str>| -> (Vec<u8>, Vec<u8>, Value) {
        let at = |e: &str| dir.path().join(format!("{name}.{e}"));
        let mut c = program();
        c.args(["render", "--json", "--camera", "near", "-o"]).arg(at("png")).arg("--exr").arg(at("exr"));
        if let Some(n) = threads {
            c.env("LP_NUM_THREADS", n).env("RAYON_NUM_THREADS", n);
        }
        let out = c.args(COARSE).output().unwrap();
        assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
        let report = serde_json::from_slice(&out.stdout).unwrap();
        (std::fs::read(at("png")).unwrap(), std::fs::read(at("exr")).unwrap(), report)
    };
    let (first, again, single) = (render("a", None), render("b", None), render("c", Some("1")));
    for other in [&again, &single] {
        assert!(first.0 == other.0, "the PNGs differ");
        assert!(first.1 == other.1, "the EXRs differ");
    }
    assert_eq!(listed(dir.path()), ["a.exr", "a.png", "b.exr", "b.png", "c.exr", "c.png"]);

    let report = &first.2;
    for key in [
        "schema_version",
        "command",
        "scene",
        "settings",
        "device",
        "plan",
        "bakes",
        "passes",
        "gpu_ms",
        "trees",
        "terrain_quads",
        "seed_quads",
        "memory",
        "timings",
        "validation",
        "outputs",
    ] {
        assert!(!report[key].is_null(), "{key}");
    }
    assert!(report["trees"]["by_rung"]["zfield"].as_u64().unwrap() > 0);
    assert!(report["passes"].as_array().unwrap().iter().all(|p| p["gpu_ms"].as_f64().unwrap() >= 0.0));
    assert!(report["memory"]["allocated_bytes"].as_u64() >= report["memory"]["planned_bytes"].as_u64());

    let picture = image::load_from_memory(&first.0).unwrap().to_rgb8();
    assert_eq!(picture.dimensions(), (96, 64));
    assert!(picture.pixels().any(|p| p != picture.get_pixel(0, 0)), "the picture is empty");
    check_layers(&dir.path().join("a.exr"));
}

/// The EXR's layers by name, its numbers finite, radiance the sum of sun and sky.
fn check_layers(path: &Path) {
    use exr::prelude::{FlatSamples, ReadChannels, ReadLayers, read};
    let file = read().no_deep_data().largest_resolution_level().all_channels().all_layers().all_attributes();
    let file = file.from_file(path).unwrap();
    let mut found = std::collections::BTreeMap::new();
    for layer in &file.layer_data {
        assert_eq!((layer.size.0, layer.size.1), (96, 64));
        let name = layer.attributes.layer_name.as_ref().unwrap().to_string();
        for c in &layer.channel_data.list {
            let values: Vec<f64> = match &c.sample_data {
                FlatSamples::F16(v) => v.iter().map(|x| x.to_f64()).collect(),
                FlatSamples::F32(v) => v.iter().map(|x| f64::from(*x)).collect(),
                FlatSamples::U32(v) => v.iter().map(|x| f64::from(*x)).collect(),
            };
            assert!(values.iter().all(|x| x.is_finite() && *x >= 0.0), "{name}.{}", c.name);
            found.insert(format!("{name}.{}", c.name), values);
        }
    }
    let names: Vec<&str> = found.keys().map(String::as_str).collect();
    let rgb = |l| ["B", "G", "R"].map(|c| format!("{l}.{c}"));
    let expected = [
        &["depth.Z".to_string()][..],
        &["lit_ground", "lit_tree", "shadowed_ground", "shadowed_tree"].map(|c| format!("fractions.{c}")),
        &rgb("radiance"),
        &rgb("sky"),
        &["species.id".into()],
        &rgb("sun"),
        &["trees.coverage".into()],
    ];
    assert_eq!(names, expected.concat());
    for c in ["R", "G", "B"] {
        let at = |l: &str| found[&format!("{l}.{c}")].iter();
        for ((sum, sun), sky) in at("radiance").zip(at("sun")).zip(at("sky")) {
            assert!((sum - sun - sky).abs() <= 1e-6 * sum.max(1e-9), "{sum} {sun} {sky}");
        }
    }
    // Ground and trees, lit and not: shares of a pixel, four of them in half floats.
    let fractions =
        |k: usize| found.iter().filter(|(n, _)| n.starts_with("fractions.")).map(move |(_, v)| v[k]);
    for k in 0..96 * 64 {
        let sum: f64 = fractions(k).sum();
        assert!(sum <= 1.0 + 4.0 / 2048.0, "{k}: {sum}");
    }
    assert!(found["trees.coverage"].iter().any(|a| *a > 0.0) && found["species.id"].iter().any(|s| *s > 0.0));
}

const PATCHES: &str = "[terrain]\nextent = 500.0\nalbedo = 0.2\n\
    [[species]]\nname = \"a\"\nmodel = \"builtin:birch\"\ndensity = 0.02\n\
    [sun]\nazimuth = 210.0\nelevation = 40.0\nirradiance = 1.0\n[sky]\nradiance = 0.1\n\
    [[camera]]\nname = \"c\"\nposition = [40.0, 60.0, 15.0]\ntarget = [150.0, 180.0, 0.0]\nvertical_fov = 50.0\n";

#[test]
fn reflectance_is_a_table_of_numbers() {
    let dir = tempfile::tempdir().unwrap();
    let scene = scene(dir.path(), PATCHES);
    let csv = dir.path().join("brf.csv");
    let out = csv.to_str().unwrap();
    let small = ["--patches", "2", "--patch-side", "20", "--patch-pixels", "16", "--out", out];
    let lists = [
        "--sun-zenith",
        "45",
        "--view-zenith",
        "-60:60:30",
        "--azimuth",
        "0,90",
        "--distance",
        "50,20000",
        "--slope",
        "0,-35",
        "--representation",
        "auto,shader-map",
        "--validate",
    ];
    let done = run(&[&["reflectance", &scene], &COARSE[..], &small, &lists].concat());
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let text = std::fs::read_to_string(&csv).unwrap();
    let mut lines = text.lines();
    let header = "representation,distance_m,sun_zenith_deg,view_zenith_deg,relative_azimuth_deg,slope_deg,k_lit_ground,\
                  k_shadowed_ground,k_lit_tree,k_shadowed_tree,radiance_r,radiance_g,radiance_b,sun_r,sun_g,sun_b,sky_r,sky_g,\
                  sky_b,stderr_r,stderr_g,stderr_b";
    assert_eq!(lines.next(), Some(header));
    let rows: Vec<Vec<&str>> = lines.map(|l| l.split(',').collect()).collect();
    // Two representations and two distances; of the five by two views of the slope, which descends away from the sun, that of
    // 60 degrees towards the sun turns its back.
    assert_eq!(rows.len(), 2 * 2 * (10 + 9));
    for row in &rows {
        assert_eq!(row.len(), 22);
        assert!(["auto", "shader-map"].contains(&row[0]), "{row:?}");
        let v: Vec<f64> = row[1..].iter().map(|t| t.parse().unwrap()).collect();
        assert!(v.iter().all(|x| x.is_finite()) && v[5..].iter().all(|x| *x >= 0.0), "{row:?}");
        // Means of half floats.
        assert!((v[5..9].iter().sum::<f64>() - 1.0).abs() < 2.0 / 1024.0, "{row:?}");
        for c in 0..3 {
            // Seven decimals of each.
            assert!((v[9 + c] - v[12 + c] - v[15 + c]).abs() < 2e-7 && v[9 + c] > 0.0, "{row:?}");
        }
    }
    let views = |slope: f64| {
        let of = |r: &&Vec<&str>| r[0] == "auto" && r[1] == "50" && r[5].parse() == Ok(slope);
        rows.iter().filter(of).map(|r| (r[3].to_string(), r[4].to_string())).collect::<Vec<_>>()
    };
    let all: Vec<_> = ["0", "90"]
        .iter()
        .flat_map(|a| ["-60", "-30", "0", "30", "60"].map(|z| (z.to_string(), a.to_string())))
        .collect();
    assert_eq!(views(0.0), all);
    assert_eq!(
        views(-35.0),
        all.iter().filter(|(z, a)| (z.as_str(), a.as_str()) != ("60", "0")).cloned().collect::<Vec<_>>()
    );
    // Without --out the same goes to the standard output.
    let printed = run(&[&["reflectance", &scene], &COARSE[..], &small[..6], &lists].concat());
    assert!(String::from_utf8(printed.stdout).unwrap() == text, "printed and written differ");
    let one = ["--view-zenith", "0", "--json"];
    let report = json(&[&["reflectance", &scene], &COARSE[..], &small[..6], &one].concat());
    assert_eq!(
        (&report["command"], report["rows"].as_array().unwrap().len()),
        (&Value::from("reflectance"), 1)
    );
    assert_eq!(report["rows"][0]["sun_zenith_deg"], 50.0, "left out: the scene's");
}

#[test]
fn reflectance_refuses_what_cannot_be_measured() {
    let dir = tempfile::tempdir().unwrap();
    let bare = scene(dir.path(), &PATCHES.replace("density = 0.02", "density = 0.0"));
    for (args, hint) in [
        (&["--view-zenith", "90"][..], "--view-zenith 90"),
        (&["--view-zenith", "-86"], "--view-zenith -86"),
        (&["--view-zenith", "a"], "--view-zenith"),
        (&["--view-zenith", "0:90"], "FROM:TO:STEP"),
        (&["--view-zenith", "0:60:0"], "--view-zenith"),
        (&["--view-zenith", "0:60:-5"], "--view-zenith"),
        (&["--azimuth", "0,,90"], "--azimuth"),
        (&["--azimuth", "inf"], "--azimuth"),
        (&["--sun-zenith", "100"], "--sun-zenith 100"),
        (&["--sun-zenith", "nan"], "--sun-zenith"),
        (&["--sun-zenith", "-5"], "--sun-zenith"),
        (&["--slope", "0,70"], "--slope 70"),
        (&["--distance", "0"], "--distance 0"),
        (&["--distance", "1e9"], "--distance 1000000000"),
        (&["--distance", "-5"], "--distance"),
        (&["--density", "0"], "--density"),
        (&["--density", "nan"], "--density"),
        (&["--representation", "mesh"], "shader-map"),
        (&["--ladder", "mesh"], "write mesh:256,zfield:4,shader-map"),
        (&["--patches", "0"], "--patches"),
        (&["--patch-side", "1000"], "--patch-side 1000"),
        (&["--patch-side", "nan"], "--patch-side"),
        (&["--patch-pixels", "4"], "--patch-pixels"),
        (&["--out", "a.txt"], "*.csv"),
        (&[&bare, "--quiet"], "no trees"),
    ] {
        let text = refused(2, &[&["reflectance"], args].concat());
        assert!(text.contains(hint), "{args:?}: {text}");
    }
}

#[test]
fn the_reader_may_leave() {
    let mut child = program().args(["plan", "--json"]).stdout(std::process::Stdio::piped()).spawn().unwrap();
    // Closes the pipe before anything is written to it.
    drop(child.stdout.take());
    assert_eq!(child.wait().unwrap().code(), Some(0));
}
