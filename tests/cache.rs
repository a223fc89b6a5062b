//! The disk cache of bakes: what it keeps, and that damage never comes through.

mod common;

use std::fs;
use std::path::Path;
use std::sync::Arc;

use canopy::bake::cache::{self, CacheState, load_or_bake};
use canopy::bake::{BakeSettings, SpeciesBake};
use canopy::scene::{Mesh, OpticsOverride, Texture};

const SMALL: BakeSettings = BakeSettings { rings: 1, resolution: 16, occlusion_rays: 1, transfer_bands: 2 };

fn tree() -> Mesh {
    let mut mesh = common::ellipsoid(1.0, 2.0, 6);
    let rgba = vec![255; 4 * 4 * 4];
    mesh.materials[0].texture = Some(Arc::new(Texture { width: 4, height: 4, rgba }));
    mesh.materials[0].alpha_cutoff = Some(0.5);
    mesh
}

fn get(dir: &Path) -> (SpeciesBake, CacheState) {
    load_or_bake(&tree(), &OpticsOverride::default(), &SMALL, Some(dir), true).unwrap()
}

#[test]
fn a_bake_comes_back_as_it_was() {
    let dir = tempfile::tempdir().unwrap();
    let (first, state) = get(dir.path());
    assert_eq!(state, CacheState::Baked);
    let (second, state) = get(dir.path());
    assert_eq!(state, CacheState::Hit);
    assert!(first == second);
    // One file and no leftovers.
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
    let without = load_or_bake(&tree(), &OpticsOverride::default(), &SMALL, None, true).unwrap();
    assert!(without == (first, CacheState::Baked));
}

#[test]
fn damage_anywhere_is_found_and_repaired() {
    let dir = tempfile::tempdir().unwrap();
    let (good, _) = get(dir.path());
    let path = cache::path(dir.path(), &cache::key(&tree(), &OpticsOverride::default(), &SMALL));
    let whole = fs::read(&path).unwrap();
    let flipped = (0..whole.len())
        .step_by(499)
        .chain((0..96).step_by(7))
        .chain((whole.len() - 40..whole.len()).step_by(7))
        .map(|at| {
            let mut bytes = whole.clone();
            bytes[at] ^= 0x10;
            (format!("bit at {at}"), bytes)
        });
    let cut =
        [0, 1, 7, 50, whole.len() / 2, whole.len() - 1].map(|n| (format!("cut at {n}"), whole[..n].to_vec()));
    let longer = ("longer".to_string(), [&whole[..], &[0]].concat());
    let foreign = ("foreign".to_string(), b"\x89PNG\r\n\x1a\n".repeat(100));
    for (what, bytes) in flipped.chain(cut).chain([longer, foreign]) {
        fs::write(&path, bytes).unwrap();
        let (bake, state) = get(dir.path());
        assert_eq!(state, CacheState::Rebuilt, "{what}");
        assert!(bake == good, "{what}");
        assert!(fs::read(&path).unwrap() == whole, "{what}");
    }
    assert_eq!(get(dir.path()).1, CacheState::Hit);
}

#[test]
fn everything_that_a_bake_depends_on_is_in_the_key() {
    let optics = OpticsOverride::default();
    let mut keys = vec![cache::key(&tree(), &optics, &SMALL)];
    for s in [
        BakeSettings { rings: 2, ..SMALL },
        BakeSettings { resolution: 32, ..SMALL },
        BakeSettings { occlusion_rays: 2, ..SMALL },
        BakeSettings { transfer_bands: 0, ..SMALL },
        BakeSettings { transfer_bands: 1, ..SMALL },
    ] {
        keys.push(cache::key(&tree(), &optics, &s));
    }
    let rgb = Some([0.1, 0.2, 0.3]);
    for o in [
        OpticsOverride { leaf_reflectance: rgb, ..OpticsOverride::default() },
        OpticsOverride { leaf_transmittance: rgb, ..OpticsOverride::default() },
        OpticsOverride { bark_reflectance: rgb, ..OpticsOverride::default() },
        OpticsOverride { extinction: Some(1.0), ..OpticsOverride::default() },
    ] {
        keys.push(cache::key(&tree(), &o, &SMALL));
    }
    let changes: [fn(&mut Mesh); 10] = [
        |m| m.positions[3][1] += 1e-3,
        |m| m.uvs[3][1] += 1e-3,
        |m| m.triangles[0].vertices.swap(0, 1),
        |m| m.triangles.truncate(5),
        |m| m.materials[0].foliage = false,
        |m| m.materials[0].double_sided = false,
        |m| m.materials[0].base_color[2] = 0.9,
        |m| m.materials[0].alpha_cutoff = None,
        |m| m.materials[0].texture = None,
        |m| Arc::make_mut(m.materials[0].texture.as_mut().unwrap()).rgba[17] = 254,
    ];
    for change in changes {
        let mut mesh = tree();
        change(&mut mesh);
        keys.push(cache::key(&mesh, &optics, &SMALL));
    }
    let mut distinct = keys.clone();
    distinct.sort_unstable();
    distinct.dedup();
    assert_eq!(distinct.len(), keys.len());
    // And what it does not depend on is not.
    let mut mesh = tree();
    mesh.materials[0].name = "another name".into();
    assert_eq!(cache::key(&mesh, &optics, &SMALL), keys[0]);
}

#[test]
fn a_cache_that_cannot_be_written_costs_nothing_but_time() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("file");
    fs::write(&file, "in the way").unwrap();
    let (bake, _) = get(&file.join("cache"));
    assert!(bake == get(&dir.path().join("new/and/deep")).0);
}

#[test]
fn many_writers_at_once_leave_one_whole_file() {
    let dir = tempfile::tempdir().unwrap();
    let bakes: Vec<SpeciesBake> = std::thread::scope(|s| {
        let all: Vec<_> = (0..8).map(|_| s.spawn(|| get(dir.path()).0)).collect();
        all.into_iter().map(|t| t.join().unwrap()).collect()
    });
    assert!(bakes.windows(2).all(|b| b[0] == b[1]));
    assert_eq!(get(dir.path()).1, CacheState::Hit);
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
}
