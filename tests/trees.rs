//! The procedural species: valid, repeatable, varied, and of the right size.

use std::path::Path;
use std::process::Command;

use canopy::scene::Mesh;
use canopy::scene::model::{load_model, load_model_bytes};
use canopy::tree::Preset;

fn load(preset: Preset, seed: u32) -> Mesh {
    load_model_bytes(Path::new(preset.name()), &canopy::tree::glb(preset, seed), None, None).unwrap()
}

fn top(mesh: &Mesh) -> f32 {
    mesh.positions.iter().map(|p| p[2]).fold(f32::MIN, f32::max)
}

#[test]
fn seeds_decide_everything() {
    for preset in Preset::ALL {
        let bytes = canopy::tree::glb(preset, 1);
        assert!(bytes == canopy::tree::glb(preset, 1), "{preset:?} differs from itself");
        assert!(bytes != canopy::tree::glb(preset, 2), "{preset:?} ignores its seed");
    }
}

/// Height and range of the crown's radius, m.
fn size(preset: Preset) -> (f32, std::ops::Range<f32>) {
    match preset {
        Preset::Oak => (15.0, 5.0..9.0),
        Preset::Pine => (20.0, 3.0..6.0),
        Preset::Birch => (14.0, 2.0..4.5),
        Preset::Poplar => (22.0, 1.5..3.5),
        Preset::Acacia => (9.0, 5.0..8.5),
        Preset::Willow => (11.0, 4.0..7.0),
        Preset::Ash => (16.0, 5.0..9.0),
        Preset::Catalpa => (10.0, 4.5..7.5),
        Preset::Spruce => (24.0, 4.5..6.5),
        Preset::Snag => (12.0, 3.0..7.0),
    }
}

#[test]
fn trees_keep_to_their_budget_and_size() {
    for preset in Preset::ALL {
        let (height, radius) = size(preset);
        for seed in 0..8 {
            let mesh = load(preset, seed);
            assert_eq!(mesh.dropped_triangles, 0, "{preset:?} {seed}");
            let triangles = mesh.triangles.len();
            assert!((5_000..=25_000).contains(&triangles), "{preset:?} {seed}: {triangles} triangles");
            let top = top(&mesh);
            assert!((top / height - 1.0).abs() < 0.12, "{preset:?} {seed}: {top} m");
            let wide = mesh.positions.iter().map(|p| p[0].hypot(p[1])).fold(0.0, f32::max);
            assert!(radius.contains(&wide), "{preset:?} {seed}: crown radius {wide} m");
            let base = mesh.positions.iter().map(|p| p[2]).fold(f32::MAX, f32::min);
            assert!((-1.0..0.3).contains(&base), "{preset:?} {seed}: base at {base} m");
        }
    }
}

#[test]
fn materials_are_bark_and_leaf() {
    for preset in Preset::ALL {
        let mesh = load(preset, 1);
        let bark = &mesh.materials[0];
        assert_eq!((bark.name.as_str(), bark.foliage, bark.alpha_cutoff), ("bark", false, None));
        assert!(bark.texture.is_some());
        if preset == Preset::Snag {
            assert_eq!(mesh.materials.len(), 1, "a dead tree has no leaves");
            continue;
        }
        let [_, leaf] = &mesh.materials[..] else { panic!("{:?}", mesh.materials.len()) };
        assert_eq!((leaf.name.as_str(), leaf.foliage, leaf.alpha_cutoff), ("leaf", true, Some(0.5)));
        assert!(leaf.double_sided && leaf.texture.is_some());
    }
}

/// Seen from each of eight sides, the upper crown has leaves: no side is bare. The ash is meant to have gaps, and the
/// dead tree no leaves.
#[test]
fn crowns_are_full_all_around() {
    for preset in Preset::ALL.into_iter().filter(|p| !matches!(p, Preset::Ash | Preset::Snag)) {
        for seed in 0..4 {
            let mesh = load(preset, seed);
            let height = top(&mesh);
            let mut sectors = [0.0f32; 8];
            for t in mesh.triangles.iter().filter(|t| mesh.materials[t.material as usize].foliage) {
                let [a, b, c] = t.vertices.map(|i| glam::Vec3::from(mesh.positions[i as usize]));
                let centre = (a + b + c) / 3.0;
                if centre.z > 0.3 * height {
                    let turn = centre.y.atan2(centre.x) / std::f32::consts::TAU;
                    sectors[(turn.rem_euclid(1.0) * 8.0) as usize % 8] += 0.5 * (b - a).cross(c - a).length();
                }
            }
            let mean = sectors.iter().sum::<f32>() / 8.0;
            assert!(sectors.iter().all(|s| *s > 0.35 * mean), "{preset:?} {seed}: {sectors:?} m²");
        }
    }
}

/// The outside of bark and its normals agree, or it would be lit from within.
#[test]
fn bark_faces_outward() {
    for preset in Preset::ALL {
        let mesh = load(preset, 3);
        for t in mesh.triangles.iter().filter(|t| !mesh.materials[t.material as usize].foliage) {
            let [a, b, c] = t.vertices.map(|i| glam::Vec3::from(mesh.positions[i as usize]));
            let smooth: glam::Vec3 =
                t.vertices.iter().map(|i| glam::Vec3::from(mesh.normals[*i as usize])).sum();
            assert!((b - a).cross(c - a).dot(smooth) > 0.0, "{preset:?}: {a} {b} {c}");
        }
    }
}

/// Runs `canopy tree` in a folder and returns what it printed.
fn tree(folder: &Path, args: &[&str]) -> String {
    let mut program = Command::new(env!("CARGO_BIN_EXE_canopy"));
    let out = program.current_dir(folder).arg("tree").args(args).output().unwrap();
    assert!(out.status.success(), "{args:?}: {}", String::from_utf8_lossy(&out.stderr));
    String::from_utf8(out.stdout).unwrap()
}

#[test]
fn a_species_of_ones_own_is_printed_changed_and_grown() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| std::fs::read(folder.path().join(name)).unwrap();
    let text = tree(folder.path(), &["birch", "--print"]);
    assert_eq!(text, Preset::Birch.text());
    std::fs::write(folder.path().join("elm.toml"), text).unwrap();
    tree(folder.path(), &["elm.toml", "--seed", "4"]);
    assert!(file("elm.glb") == canopy::tree::glb(Preset::Birch, 4), "the same numbers are the same tree");
    tree(folder.path(), &["elm.toml", "--seed", "4", "--set", "scale=20", "-o", "tall.glb"]);
    let heights = ["elm.glb", "tall.glb"].map(|f| top(&load_model(&folder.path().join(f), None).unwrap()));
    assert!(heights[1] > 1.4 * heights[0], "{heights:?}");
    let bare = tree(folder.path(), &["birch", "--set", "base_size=0.3", "--print"]);
    assert!(bare.contains("\nbase_size = 0.3\n"), "{bare}");
}
