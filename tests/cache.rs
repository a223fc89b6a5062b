//! The disk cache of bakes: what it keeps, and that damage never comes through.

mod common;

use std::collections::BTreeMap;
use std::fs;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};
use std::time::SystemTime;

use canopy::bake::cache::{self, CacheState, Source};
use canopy::bake::{BakeSettings, Baked, BakedFrom, Needs, SpeciesBake, bake_species, load_or_bake_scene};
use canopy::plan::Plan;
use canopy::scene::{self, Albedo, Mesh, OpticsOverride, Scene, Texture};

const SMALL: BakeSettings =
    BakeSettings { rings: 1, resolution: 16, occlusion_rays: 1, transfer_bands: 2, transfer_resolution: 8 };
const OPTICS: OpticsOverride = OpticsOverride {
    leaf_reflectance: None,
    leaf_transmittance: None,
    bark_reflectance: None,
    extinction: None,
};
/// Of views and of light transfer.
type States = (CacheState, Option<CacheState>);
const BAKED: States = (CacheState::Baked, Some(CacheState::Baked));
const HIT: States = (CacheState::Hit, Some(CacheState::Hit));

fn tree() -> &'static Mesh {
    static TREE: OnceLock<Mesh> = OnceLock::new();
    TREE.get_or_init(|| {
        let mut mesh = common::ellipsoid(1.0, 2.0, 6);
        let rgba = vec![255; 4 * 4 * 4];
        mesh.materials[0].texture = Some(Arc::new(Texture { width: 4, height: 4, rgba }));
        mesh.materials[0].alpha_cutoff = Some(0.5);
        mesh
    })
}

fn source<'a>(settings: &BakeSettings, dir: Option<&'a Path>) -> Source<'a> {
    Source::new(tree(), &OPTICS, settings, dir, true).unwrap()
}

fn get(dir: Option<&Path>) -> (SpeciesBake, States) {
    let source = source(&SMALL, dir);
    let (mut bake, views) = source.load_views().unwrap();
    let transfer = source.load_transfer(&mut bake).unwrap();
    (bake, (views, transfer))
}

/// Every file of a folder, and what changes when it is written anew.
fn files(dir: &Path) -> BTreeMap<PathBuf, (u64, SystemTime)> {
    let entry = |e: std::io::Result<fs::DirEntry>| {
        let e = e.unwrap();
        let metadata = e.metadata().unwrap();
        (e.path(), (metadata.ino(), metadata.modified().unwrap()))
    };
    fs::read_dir(dir).unwrap().map(entry).collect()
}

/// The files of a kind.
fn of_kind(dir: &Path, extension: &str) -> BTreeMap<PathBuf, (u64, SystemTime)> {
    files(dir).into_iter().filter(|(p, _)| p.extension().is_some_and(|e| e == extension)).collect()
}

#[test]
fn a_bake_comes_back_as_it_was() {
    let dir = tempfile::tempdir().unwrap();
    let (first, state) = get(Some(dir.path()));
    assert_eq!(state, BAKED);
    let (second, state) = get(Some(dir.path()));
    assert_eq!(state, HIT);
    assert!(first == second);
    // A file each and no leftovers.
    let source = source(&SMALL, Some(dir.path()));
    let written = [source.views_path(), source.transfer_path()].map(Option::unwrap);
    assert!(written.iter().eq(files(dir.path()).keys()) || written.iter().rev().eq(files(dir.path()).keys()));
    assert!(first == bake_species(tree(), &OPTICS, &SMALL, true).unwrap());
    assert!(get(None) == (first, BAKED));
}

#[test]
fn damage_anywhere_is_found_and_repaired() {
    let dir = tempfile::tempdir().unwrap();
    let (good, _) = get(Some(dir.path()));
    let source = source(&SMALL, Some(dir.path()));
    let [views, transfer] = [source.views_path(), source.transfer_path()].map(Option::unwrap);
    // What is damaged is baked anew, and the other artefact is read.
    let rebuilt = Some(CacheState::Rebuilt);
    let (hit, again) = (HIT.0, CacheState::Rebuilt);
    for (path, other, expected) in [(&views, &transfer, (again, HIT.1)), (&transfer, &views, (hit, rebuilt))]
    {
        let (whole, untouched) = (fs::read(path).unwrap(), files(dir.path())[other]);
        let flipped = (0..whole.len())
            .step_by(499)
            .chain((0..96).step_by(7))
            .chain((whole.len() - 40..whole.len()).step_by(7))
            .map(|at| {
                let mut bytes = whole.clone();
                bytes[at] ^= 0x10;
                (format!("bit at {at}"), bytes)
            });
        let cut = [0, 1, 7, 50, whole.len() / 2, whole.len() - 1]
            .map(|n| (format!("cut at {n}"), whole[..n].to_vec()));
        let longer = ("longer".to_string(), [&whole[..], &[0]].concat());
        let foreign = ("foreign".to_string(), b"\x89PNG\r\n\x1a\n".repeat(100));
        let exchanged = ("the other's".to_string(), fs::read(other).unwrap());
        for (what, bytes) in flipped.chain(cut).chain([longer, foreign, exchanged]) {
            let what = format!("{}, {what}", path.display());
            fs::write(path, bytes).unwrap();
            let (bake, state) = get(Some(dir.path()));
            assert_eq!(state, expected, "{what}");
            assert!(bake == good, "{what}");
            assert!(fs::read(path).unwrap() == whole, "{what}");
        }
        assert_eq!(files(dir.path())[other], untouched);
    }
    assert_eq!(get(Some(dir.path())).1, HIT);
}

#[test]
fn everything_that_a_bake_depends_on_is_in_the_key() {
    let mut keys = vec![cache::views_key(tree(), &OPTICS, &SMALL)];
    for s in [
        BakeSettings { rings: 2, ..SMALL },
        BakeSettings { resolution: 32, ..SMALL },
        BakeSettings { occlusion_rays: 2, ..SMALL },
    ] {
        keys.push(cache::views_key(tree(), &OPTICS, &s));
    }
    let rgb = Some([0.1, 0.2, 0.3]);
    for o in [
        OpticsOverride { leaf_reflectance: rgb, ..OpticsOverride::default() },
        OpticsOverride { leaf_transmittance: rgb, ..OpticsOverride::default() },
        OpticsOverride { bark_reflectance: rgb, ..OpticsOverride::default() },
        OpticsOverride { extinction: Some(1.0), ..OpticsOverride::default() },
    ] {
        keys.push(cache::views_key(tree(), &o, &SMALL));
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
        let mut mesh = tree().clone();
        change(&mut mesh);
        keys.push(cache::views_key(&mesh, &OPTICS, &SMALL));
    }
    // Light transfer is of the views and of its bands.
    let more_views = BakeSettings { rings: 2, ..SMALL };
    let one_band = BakeSettings { transfer_bands: 1, ..SMALL };
    keys.extend([SMALL, more_views, one_band].map(|s| source(&s, None).key()));
    let mut distinct = keys.clone();
    distinct.sort_unstable();
    distinct.dedup();
    assert_eq!(distinct.len(), keys.len());
    // And what it does not depend on is not.
    let mut mesh = tree().clone();
    mesh.materials[0].name = "another name".into();
    assert_eq!(cache::views_key(&mesh, &OPTICS, &SMALL), keys[0]);
    assert_eq!(cache::views_key(tree(), &OPTICS, &one_band), keys[0]);
    let no_band = BakeSettings { transfer_bands: 0, ..SMALL };
    assert_eq!(source(&no_band, None).key(), keys[0]);
}

#[test]
fn a_cache_that_cannot_be_written_costs_nothing_but_time() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("file");
    fs::write(&file, "in the way").unwrap();
    let (bake, _) = get(Some(&file.join("cache")));
    assert!(bake == get(Some(&dir.path().join("new/and/deep"))).0);
}

#[test]
fn many_writers_at_once_leave_whole_files() {
    let dir = tempfile::tempdir().unwrap();
    let bakes: Vec<SpeciesBake> = std::thread::scope(|s| {
        let all: Vec<_> = (0..8).map(|_| s.spawn(|| get(Some(dir.path())).0)).collect();
        all.into_iter().map(|t| t.join().unwrap()).collect()
    });
    assert!(bakes.windows(2).all(|b| b[0] == b[1]));
    assert_eq!(get(Some(dir.path())).1, HIT);
    assert_eq!(files(dir.path()).len(), 2);
}

/// A forest of that tree, with everything small.
fn forest() -> Scene {
    let text = "seed = 4\n[terrain]\nextent = 300.0\nalbedo = 0.2\n\
         [[species]]\nname = \"a\"\nmodel = \"builtin:birch\"\ndensity = 0.03\n\
         [sun]\nazimuth = 210.0\nelevation = 25.0\nirradiance = 1.0\n[sky]\nradiance = 0.1\n\
         [[camera]]\nname = \"c\"\nposition = [40.0, 60.0, 15.0]\ntarget = [150.0, 180.0, 0.0]\nvertical_fov = 50.0\n\
         [quality]\npreset = \"fast\"\nview_rings = 1\nview_resolution = 16\nocclusion_rays = 8\n\
         transfer_bands = 1\ntransfer_resolution = 8\ntable_angles = 4\ntable_densities = 2\ntable_rays = 32\n";
    let mut scene = scene::parse(text, Path::new("test.toml")).unwrap();
    scene.species[0].mesh = Arc::new(tree().clone());
    scene
}

fn of_scene(scene: &Scene, needs: Needs, dir: &Path) -> (Baked, BakedFrom) {
    let mut all = load_or_bake_scene(scene, needs, Some(dir), true).unwrap();
    assert_eq!(all.len(), 1);
    all.remove(0)
}

fn from(views: CacheState, transfer: Option<CacheState>, tables: CacheState) -> BakedFrom {
    BakedFrom {
        views,
        transfer,
        tables,
        envelopes: None,
        levels: None,
        harmonics: None,
        cards: None,
        shells: None,
        indirect: None,
    }
}

/// Baked once with all.
fn baked(scene: &Scene, dir: &Path) -> Baked {
    let (baked, states) = of_scene(scene, Needs::ALL, dir);
    assert_eq!(states, from(BAKED.0, BAKED.1, CacheState::Baked));
    baked
}

#[test]
fn a_knob_of_tables_bakes_tables_only() {
    let dir = tempfile::tempdir().unwrap();
    let mut scene = forest();
    baked(&scene, dir.path());
    let before = files(dir.path());
    let changes: [fn(&mut Scene); 3] = [
        |s| s.settings.table_angles = 5,
        |s| s.settings.table_densities = 3,
        |s| s.settings.light_iterations = 0,
    ];
    for (k, change) in changes.into_iter().enumerate() {
        change(&mut scene);
        let (_, states) = of_scene(&scene, Needs::ALL, dir.path());
        assert_eq!(states, from(HIT.0, HIT.1, CacheState::Baked), "change {k}");
        // Nothing that was there is written again, and one file is new.
        let after = files(dir.path());
        assert!(before.iter().all(|(path, id)| after[path] == *id), "change {k}");
        assert_eq!(after.len(), before.len() + k + 1);
    }
}

#[test]
fn texels_of_light_transfer_leave_the_views() {
    let dir = tempfile::tempdir().unwrap();
    let mut scene = forest();
    let coarse = baked(&scene, dir.path());
    scene.settings.transfer_resolution = 16;
    let (fine, states) = of_scene(&scene, Needs::ALL, dir.path());
    assert_eq!(states, from(HIT.0, Some(CacheState::Baked), CacheState::Baked));
    let side = |b: &Baked| b.species.transfer.resolution;
    assert_eq!((side(&coarse), side(&fine)), (8, 16));
}

#[test]
fn bands_bake_light_transfer_and_the_tables_that_it_is_in() {
    let dir = tempfile::tempdir().unwrap();
    let mut scene = forest();
    let one = baked(&scene, dir.path());
    let views = of_kind(dir.path(), "zfield");
    scene.settings.transfer_bands = 2;
    let (two, states) = of_scene(&scene, Needs::ALL, dir.path());
    assert_eq!(states, from(HIT.0, Some(CacheState::Baked), CacheState::Baked));
    assert!(
        two.tables != one.tables,
        "tables do not depend on light transfer: they need not have been measured"
    );
    assert!(two.species.transfer.bands.len() == 2 && two.species.views == one.species.views);
    assert_eq!((of_kind(dir.path(), "zfield"), of_kind(dir.path(), "transfer").len()), (views.clone(), 2));
    scene.settings.transfer_bands = 0;
    let (none, states) = of_scene(&scene, Needs::ALL, dir.path());
    assert_eq!(states, from(HIT.0, None, CacheState::Baked));
    assert!(none.species.transfer.bands.is_empty());
    assert_eq!((of_kind(dir.path(), "zfield"), of_kind(dir.path(), "transfer").len()), (views, 2));
    // What was there before still is.
    scene.settings.transfer_bands = 1;
    let (again, states) = of_scene(&scene, Needs::ALL, dir.path());
    assert_eq!(states, from(HIT.0, HIT.1, CacheState::Hit));
    assert!(again.species == one.species && again.tables == one.tables);
}

#[test]
fn damaged_light_transfer_leaves_views_and_tables_in_use() {
    let dir = tempfile::tempdir().unwrap();
    let scene = forest();
    let good = baked(&scene, dir.path());
    let before = files(dir.path());
    let (path, _) = of_kind(dir.path(), "transfer").pop_first().unwrap();
    let mut bytes = fs::read(&path).unwrap();
    bytes[100] ^= 1;
    fs::write(&path, bytes).unwrap();
    let (bake, states) = of_scene(&scene, Needs::ALL, dir.path());
    assert_eq!(states, from(HIT.0, Some(CacheState::Rebuilt), CacheState::Hit));
    assert!(bake.species == good.species && bake.tables == good.tables);
    let after = files(dir.path());
    assert_eq!(after.len(), before.len());
    assert!(after.iter().all(|(p, id)| (before[p] == *id) == (*p != path)), "{after:?} {before:?}");
}

#[test]
fn what_a_plan_does_not_need_is_not_baked() {
    let scene = forest();
    let needs =
        |scene: &Scene| Needs::from(&Plan::new(scene, &scene.cameras[0], [64, 48], false, None).unwrap());
    let all = Needs { indirect: false, ..Needs::ALL };
    assert_eq!(needs(&scene), all);
    let without = |change: fn(&mut Scene)| {
        let mut other = scene.clone();
        change(&mut other);
        needs(&other)
    };
    let average = Needs { transfer: false, ..all };
    assert_eq!(without(|s| s.settings.transfer_bands = 0), average);
    assert_eq!(without(|s| s.sun.irradiance = [0.0; 3]), average);
    assert_eq!(without(|s| s.cameras[0].position[2] = 1e5), average);
    assert_eq!(without(|s| s.settings.indirect = 1), Needs::ALL);
    let bare = without(|s| s.species.clear());
    assert_eq!(
        bare,
        Needs {
            trees: false,
            transfer: false,
            envelopes: false,
            cards: false,
            shells: false,
            indirect: false
        }
    );

    let dir = tempfile::tempdir().unwrap();
    assert!(load_or_bake_scene(&scene, bare, Some(dir.path()), true).unwrap().is_empty());
    assert!(files(dir.path()).is_empty());
    // To measure tables the light transfer is needed; it comes with them.
    let (first, states) = of_scene(&scene, average, dir.path());
    assert_eq!(states, from(BAKED.0, BAKED.1, CacheState::Baked));
    // Once measured, they are all that is read beside the views: what is not needed is not missed.
    let (path, _) = of_kind(dir.path(), "transfer").pop_first().unwrap();
    fs::remove_file(&path).unwrap();
    let (again, states) = of_scene(&scene, average, dir.path());
    assert_eq!(states, from(HIT.0, None, CacheState::Hit));
    assert!(again.species.transfer.bands.is_empty() && again.tables == first.tables);
    assert!(!path.exists());
    // And comes when it is.
    let (whole, states) = of_scene(&scene, Needs::ALL, dir.path());
    assert_eq!(states, from(HIT.0, BAKED.1, CacheState::Hit));
    assert!(whole.species == first.species);
}

#[test]
fn indirect_light_is_baked_where_it_counts_and_again_where_what_it_is_made_of_changes() {
    let dir = tempfile::tempdir().unwrap();
    let mut scene = forest();
    let state = |scene: &Scene, needs: Needs| of_scene(scene, needs, dir.path()).1.indirect;
    assert_eq!(state(&scene, Needs::ALL), None, "fast leaves it out");
    assert!(of_kind(dir.path(), "indirect").is_empty());
    scene.settings.indirect = 1;
    assert_eq!(state(&scene, Needs { indirect: false, ..Needs::ALL }), None, "a plan without it");
    let (first, states) = of_scene(&scene, Needs::ALL, dir.path());
    assert_eq!((states.indirect, states.tables), (Some(CacheState::Baked), CacheState::Hit));
    let (again, states) = of_scene(&scene, Needs::ALL, dir.path());
    assert_eq!(states.indirect, Some(CacheState::Hit));
    assert!(first.indirect.is_some() && first.indirect == again.indirect);
    // Light transfer has no part in it; the ground, the leaves' reflectance, densities and rays have.
    scene.settings.transfer_bands = 2;
    assert_eq!(state(&scene, Needs::ALL), Some(CacheState::Hit));
    let changes: [fn(&mut Scene); 4] = [
        |s| s.terrain.albedo = Albedo::Uniform([0.3; 3]),
        |s| s.species[0].optics.leaf_reflectance = Some([0.2; 3]),
        |s| s.species[0].scale = [0.5, 1.0],
        |s| s.settings.table_rays = 64,
    ];
    for (k, change) in changes.into_iter().enumerate() {
        change(&mut scene);
        assert_eq!(state(&scene, Needs::ALL), Some(CacheState::Baked), "change {k}");
    }
    assert_eq!(of_kind(dir.path(), "indirect").len(), 5);
}
