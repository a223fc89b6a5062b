//! The program where something outside it fails: device, memory, disk, cache, or its own life. Exit codes, messages, and
//! files that are whole or not there.
#![cfg(unix)]

use std::fs::{self, File};
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Command, Output, Stdio};

/// Small and coarse: what is tested here is the program, not the picture.
const COARSE: &str = "--size 48x32 --quality fast --quiet --set view_rings=2 --set view_resolution=32 \
    --set zfield_min_pixels=16 --set cascade_size=64 --set coverage_size=32 --set occlusion_rays=8 --set table_angles=6 \
    --set table_densities=3 --set table_rays=64";

const BAKE: &str =
    "bake builtin:birch --quiet --set view_rings=3 --set view_resolution=64 --set occlusion_rays=8";

/// A cache that the tests of this file share and no one else.
fn program() -> Command {
    let mut c = Command::new(env!("CARGO_BIN_EXE_canopy"));
    c.env("CANOPY_CACHE", Path::new(env!("CARGO_TARGET_TMPDIR")).join("robustness-cache"));
    c
}

/// The program through a shell that first limits the size of files it may write: to `blocks` of 512 bytes. Beyond them
/// the process is killed in the middle of the write, or with `told` the write fails, as on a full disk.
fn limited(blocks: u32, told: bool) -> Command {
    let mut c = Command::new("sh");
    let trap = if told { "trap '' XFSZ; " } else { "" };
    c.arg("-c")
        .arg(format!("{trap}ulimit -f {blocks}; exec \"$@\""))
        .arg("sh")
        .arg(env!("CARGO_BIN_EXE_canopy"));
    c.env("CANOPY_CACHE", Path::new(env!("CARGO_TARGET_TMPDIR")).join("robustness-cache"));
    // The driver's own cache of compiled shaders would meet the limit first.
    c.env("MESA_SHADER_CACHE_DISABLE", "true").env("MESA_GLSL_CACHE_DISABLE", "true");
    c
}

fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split_whitespace()
}

fn said(out: &Output) -> String {
    String::from_utf8_lossy(&out.stderr).into_owned()
}

/// Names of what a folder holds.
fn listed(dir: &Path) -> Vec<String> {
    let mut names: Vec<_> =
        fs::read_dir(dir).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// One species on a plain, so that most of a run is what is tested.
const SCENE: &str = "[terrain]\nextent = 500.0\n[[species]]\nname = \"birch\"\nmodel = \"builtin:birch\"\ndensity = 0.01\n\
    [sun]\nazimuth = 180.0\nelevation = 40.0\nirradiance = 1.0\n[[camera]]\nname = \"a\"\n\
    position = [250.0, 200.0, 9.0]\ntarget = [250.0, 250.0, 0.0]\nvertical_fov = 45.0\n";

fn render(c: &mut Command, png: &Path) -> Output {
    let scene = png.with_file_name("scene.toml");
    fs::write(&scene, SCENE).unwrap();
    let out = c.arg("render").arg(&scene).args(["--validate", "-o"]).arg(png).args(words(COARSE)).output();
    fs::remove_file(&scene).unwrap();
    out.unwrap()
}

#[test]
fn memory_that_runs_out_and_a_lost_device_are_6() {
    let dir = tempfile::tempdir().unwrap();
    let png = dir.path().join("a.png");
    // Opening the device has seven places; the others are in the frame.
    for place in [
        "device-memory:1",
        "device-memory:2",
        "device-memory:7",
        "device-memory:200",
        "host-memory:3",
        "host-memory:90",
        "lost:1",
        "lost:2",
        "lost:40",
    ] {
        let out = render(program().env("CANOPY_FAIL", place), &png);
        let text = said(&out);
        assert_eq!(out.status.code(), Some(6), "{place}: {text}");
        let clear = ["out of device memory", "out of host memory", "the device was lost"];
        assert!(text.starts_with("error: ") && clear.iter().any(|c| text.contains(c)), "{place}: {text}");
        assert!(listed(dir.path()).is_empty(), "{place}");
    }
    let out = render(program().env("CANOPY_FAIL", "lost:100000"), &png);
    assert_eq!(out.status.code(), Some(0), "{}", said(&out));
    let out = render(program().env("CANOPY_FAIL", "sometimes"), &png);
    assert_eq!(out.status.code(), Some(2));
    assert!(said(&out).contains("device-memory:N"), "{}", said(&out));
}

#[test]
fn a_check_that_fails_is_1() {
    let bake = |least| {
        let args = words(BAKE).filter(|w| *w != "--quiet").chain(["--verify", "4", "--min-iou", least]);
        program().args(args).output().unwrap()
    };
    let (good, bad) = (bake("0.1"), bake("0.9999"));
    assert_eq!(good.status.code(), Some(0), "{}", said(&good));
    assert_eq!(bad.status.code(), Some(1), "{}", said(&bad));
    assert!(
        said(&bad).starts_with("error: builtin:birch: ") && said(&bad).contains("0.9999"),
        "{}",
        said(&bad)
    );
    assert_eq!(good.stdout.is_empty(), bad.stdout.is_empty(), "the table is printed all the same");
}

/// Before the scene is baked and before a device is looked for: with a wrong device the exit code would be 3.
#[test]
fn outputs_that_cannot_be_written_are_found_out_first() {
    let dir = tempfile::tempdir().unwrap();
    let cache = dir.path().join("cache");
    let file = dir.path().join("file");
    fs::write(&file, "in the way").unwrap();
    // Nothing can be made in /proc, not even by the superuser.
    for folder in [&file, Path::new("/proc"), Path::new("/nonexistent")] {
        let at = |name: &str| folder.join(name).to_str().unwrap().to_string();
        let png = dir.path().join("good.png").to_str().unwrap().to_string();
        for args in [
            vec!["render", "--device", "none", "-o", &at("a.png")],
            vec!["render", "--device", "none", "-o", &png, "--exr", &at("a.exr")],
            vec!["reflectance", "--device", "none", "--out", &at("a.csv")],
            vec!["tree", "oak", "-o", &at("a.glb")],
        ] {
            let out = program().env("CANOPY_CACHE", &cache).args(&args).output().unwrap();
            let text = said(&out);
            assert_eq!(out.status.code(), Some(2), "{args:?}: {text}");
            assert!(text.contains(folder.to_str().unwrap()), "{args:?}: {text}");
        }
    }
    assert_eq!(listed(dir.path()), ["file"], "something was baked or left behind");
}

#[test]
fn a_full_disk_is_2_and_leaves_what_was_there() {
    let dir = tempfile::tempdir().unwrap();
    let glb = dir.path().join("a.glb");
    fs::write(&glb, "what was there").unwrap();
    let out = limited(8, true).args(["tree", "oak", "-o"]).arg(&glb).output().unwrap();
    assert_eq!(out.status.code(), Some(2), "{}", said(&out));
    assert!(said(&out).contains("a.glb"), "{}", said(&out));
    assert_eq!(fs::read_to_string(&glb).unwrap(), "what was there");
    let png = dir.path().join("a.png");
    // Traced: drivers keep device memory in files (lavapipe from Mesa 24 on), which the limit would end first.
    let scene = dir.path().join("s.toml");
    fs::write(&scene, SCENE).unwrap();
    let traced = ["--size", "48x32", "--representation", "reference", "--until", "2spp", "--quiet", "-o"];
    let out = limited(1, true).arg("render").arg(&scene).args(traced).arg(&png).output().unwrap();
    assert_eq!(out.status.code(), Some(2), "{}", said(&out));
    assert!(said(&out).contains("a.png"), "{}", said(&out));
    assert_eq!(listed(dir.path()), ["a.glb", "s.toml"]);
    // And the standard output.
    for args in ["plan --json", "devices", "plan"] {
        let full = Stdio::from(File::options().write(true).open("/dev/full").unwrap());
        let out = program().args(words(args)).stdout(full).output().unwrap();
        assert_eq!(out.status.code(), Some(2), "{args}: {}", said(&out));
        assert!(said(&out).contains("standard output"), "{args}: {}", said(&out));
    }
}

/// The kernel kills the process at the first byte beyond the limit: in the middle of the write, every time.
#[test]
fn a_run_killed_while_it_writes_leaves_what_was_there() {
    let dir = tempfile::tempdir().unwrap();
    let glb = dir.path().join("a.glb");
    fs::write(&glb, "what was there").unwrap();
    let out = limited(8, false).args(["tree", "oak", "-o"]).arg(&glb).output().unwrap();
    assert!(out.status.signal().is_some(), "{:?} {}", out.status, said(&out));
    assert_eq!(fs::read_to_string(&glb).unwrap(), "what was there");
    assert!(program().args(["tree", "oak", "--quiet", "-o"]).arg(&glb).status().unwrap().success());
    canopy::scene::model::load_model(&glb, None).unwrap();
}

#[test]
fn a_killed_bake_leaves_a_cache_that_works() {
    let dir = tempfile::tempdir().unwrap();
    let whole =
        |dir: &Path| -> Vec<String> { listed(dir).into_iter().filter(|n| n.ends_with(".zfield")).collect() };
    // While it writes.
    let out = limited(8, false).env("CANOPY_CACHE", dir.path()).args(words(BAKE)).output().unwrap();
    assert!(out.status.signal().is_some(), "{:?} {}", out.status, said(&out));
    assert!(whole(dir.path()).is_empty());
    // At any time, from the start on until one run lives long enough.
    let mut pause = std::time::Duration::ZERO;
    loop {
        let mut child = program().env("CANOPY_CACHE", dir.path()).args(words(BAKE)).spawn().unwrap();
        std::thread::sleep(pause);
        // SIGKILL; a process that has ended by itself is left alone.
        let _ = child.kill();
        let status = child.wait().unwrap();
        if status.success() {
            break;
        }
        assert_eq!(status.signal(), Some(9), "{status:?}");
        // By a quarter more each time: a slow bake must not take a hundred runs.
        pause = pause * 5 / 4 + std::time::Duration::from_millis(20);
    }
    let bake = |cache: &Path| {
        let out = program().env("CANOPY_CACHE", cache).args(words(BAKE)).arg("--json").output().unwrap();
        assert!(out.status.success(), "{}", said(&out));
        serde_json::from_slice::<serde_json::Value>(&out.stdout).unwrap()["species"][0].clone()
    };
    let again = bake(dir.path());
    assert_eq!(again["cache"], "hit");
    let fresh = tempfile::tempdir().unwrap();
    let path = |b: &serde_json::Value| fs::read(b["path"].as_str().unwrap()).unwrap();
    assert!(path(&again) == path(&bake(fresh.path())));
    assert_eq!(whole(dir.path()).len(), 1);
}

#[test]
fn a_cache_that_cannot_be_used_costs_a_line_and_no_more() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("file");
    fs::write(&file, "in the way").unwrap();
    let args: Vec<&str> = words(BAKE).filter(|w| *w != "--quiet").collect();
    for cache in [file.join("cache"), "/proc/canopy".into(), "/dev/null".into()] {
        let out = program().env("CANOPY_CACHE", &cache).args(&args).output().unwrap();
        assert_eq!(out.status.code(), Some(0), "{}: {}", cache.display(), said(&out));
        assert!(said(&out).contains("going on without"), "{}: {}", cache.display(), said(&out));
    }
    // A disk that is full when the bake is to be kept.
    let full = dir.path().join("full");
    let out = limited(8, true).env("CANOPY_CACHE", &full).args(&args).output().unwrap();
    assert_eq!(out.status.code(), Some(0), "{}", said(&out));
    assert!(said(&out).contains("going on without"), "{}", said(&out));
    assert!(listed(&full).is_empty(), "{:?}", listed(&full));
}

/// A link to nowhere or to a file that never ends, a pipe, a folder.
#[test]
fn foreign_things_in_the_cache_are_no_bakes() {
    let dir = tempfile::tempdir().unwrap();
    let args = || words(BAKE).chain(["--json"]);
    let bake = || -> serde_json::Value {
        let out = program().env("CANOPY_CACHE", dir.path()).args(args()).output().unwrap();
        assert!(out.status.success(), "{}", said(&out));
        serde_json::from_slice::<serde_json::Value>(&out.stdout).unwrap()["species"][0].clone()
    };
    let first = bake();
    let path = first["path"].as_str().unwrap().to_string();
    let whole = fs::read(&path).unwrap();
    for thing in ["/dev/zero", "/dev/null", "/nonexistent/target", "/proc/self/mem"] {
        fs::remove_file(&path).unwrap();
        std::os::unix::fs::symlink(thing, &path).unwrap();
        let again = bake();
        assert_ne!(again["cache"], "hit", "{thing}");
        assert_eq!(again["optics"], first["optics"], "{thing}");
        assert!(fs::read(&path).unwrap() == whole, "{thing}");
    }
    // A pipe that no one writes to.
    fs::remove_file(&path).unwrap();
    assert!(Command::new("mkfifo").arg(&path).status().unwrap().success());
    assert_eq!(bake()["optics"], first["optics"]);
    assert!(fs::read(&path).unwrap() == whole);
    fs::remove_file(&path).unwrap();
    fs::create_dir(&path).unwrap();
    let again = bake();
    assert_eq!((again["cache"].as_str(), &again["optics"]), (Some("rebuilt"), &first["optics"]));
}
