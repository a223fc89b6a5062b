//! Scene files and what they refer to: every mistake is one clear error, never a panic; good input arrives unchanged.

mod inputs;

use std::path::Path;
use std::time::{Duration, Instant};

use canopy::Error;
use canopy::scene::{self, Albedo, Distribution, Scene, Sky};
use inputs::{assert_valid, damaged, data, hollow_png, huge_png, message, png};

const PLAIN: &str = "[terrain]\nextent = 1000.0\n[[camera]]\nname = \"a\"\nposition = [1.0, 2.0, 3.0]\ntarget = [4.0, 5.0, 6.0]\nvertical_fov = 45.0\n";

fn in_folder(folder: &Path, text: &str) -> canopy::Result<Scene> {
    scene::parse(text, &folder.join("scene.toml"))
}

fn parse(text: &str) -> canopy::Result<Scene> {
    scene::parse(text, Path::new("scene.toml"))
}

#[test]
fn the_default_scene_is_complete() {
    let scene = scene::default_scene().unwrap();
    assert_eq!(scene.species.iter().map(|s| s.name.as_str()).collect::<Vec<_>>(), ["oak", "pine", "birch"]);
    assert_eq!(scene.terrain.extent, [8000.0; 2]);
    assert!(scene.cameras.len() >= 4);
    for camera in &scene.cameras {
        assert!((0..2).all(|i| (0.0..=8000.0).contains(&camera.position[i])), "{}", camera.name);
    }
    scene.species.iter().for_each(|s| assert_valid(&s.mesh));
}

#[test]
fn a_small_scene_has_documented_defaults() {
    let scene = parse(PLAIN).unwrap();
    assert_eq!((scene.name.as_str(), scene.seed, scene.species.len()), ("scene", 0, 0));
    assert_eq!(scene.sun.irradiance, [0.0; 3]);
    assert!(matches!(scene.sky, Sky::Uniform([0.0, 0.0, 0.0])));
    assert_eq!(scene.settings, canopy::settings::Settings::default());
    assert!(scene.terrain.heights.is_none() && matches!(scene.terrain.albedo, Albedo::Uniform(_)));
}

#[test]
fn wrong_scenes_name_line_key_and_remedy() {
    let oak = "[[species]]\nname = \"oak\"\nmodel = \"builtin:oak\"\n";
    let with = |extra: &str| format!("{PLAIN}{extra}");
    let species = |extra: &str| format!("{PLAIN}{oak}{extra}");
    let replaced = |a: &str, b: &str| {
        assert!(PLAIN.contains(a));
        PLAIN.replace(a, b)
    };
    for (text, wanted) in [
        (String::new(), "`terrain` is missing"),
        ("[terrain]\nextent = 9.0\n".into(), "`camera` is missing"),
        (
            replaced("[terrain]", "[terain]"),
            "line 1, key `terain`: there is no key `terain` here\n  remedy: did you mean `terrain`?",
        ),
        (replaced("extent = 1000.0", "extend = 1.0"), "line 2, key `terrain.extend`"),
        (replaced("extent = 1000.0", ""), "`extent` is missing"),
        (
            replaced("1000.0", "\"1000\""),
            "line 2, key `terrain.extent`: this is a string; a number is needed",
        ),
        (replaced("1000.0", "1e8"), "line 2, key `terrain.extent`"),
        (replaced("1000.0", "nan"), "line 2"),
        (replaced("1000.0", "inf"), "line 2"),
        (replaced("1000.0", "-5.0"), "line 2"),
        (replaced("1000.0", "1000.0\ncell_size = 3.0"), "line 3, key `terrain.cell_size`"),
        (
            replaced("extent = 1000.0", "heightmap = \"none.png\"\ncell_size = 1.0"),
            "line 2, key `terrain.heightmap`: \"none.png\" cannot be read",
        ),
        (replaced("extent = 1000.0", "heightmap = \"builtin:ridges\""), "\"builtin:ridge\"?"),
        (
            replaced("extent = 1000.0", "heightmap = \"builtin:ridge\"\nextent = 4.0"),
            "line 3, key `terrain.extent`",
        ),
        (
            replaced("extent = 1000.0", "heightmap = \"builtin:ridge\"\ncell_size = 4.0"),
            "line 3, key `terrain.cell_size`",
        ),
        (replaced("1000.0", "1000.0\norigin = [1.0]"), "this array has 1 entries; 2 are needed"),
        (replaced("1000.0", "1000.0\nalbedo = 1.5"), "line 3, key `terrain.albedo`"),
        (replaced("1000.0", "1000.0\nalbedo = \"none.png\""), "line 3, key `terrain.albedo`"),
        (replaced("[terrain]", "terrain = 3\n[x]"), "there is no key `x`"),
        (replaced("[terrain]", "[terrain"), "line 1"),
        (replaced("name = \"a\"", "name = \"\""), "line 4, key `camera[0].name`"),
        (replaced("[4.0, 5.0, 6.0]", "[1.0, 2.0, 3.0]"), "line 6, key `camera[0].target`"),
        (replaced("[4.0, 5.0, 6.0]", "[1.0, 2.0]"), "line 6, key `camera[0].target`"),
        (replaced("[4.0, 5.0, 6.0]", "[1.0, 2.0e8, 0]"), "line 6, key `camera[0].target`"),
        (replaced("[4.0, 5.0, 6.0]", "[1.0, nan, 0]"), "line 6, key `camera[0].target[1]`"),
        (replaced("fov = 45.0", "fov = 0.0"), "line 7, key `camera[0].vertical_fov`"),
        (replaced("fov = 45.0", "fov = 180"), "line 7"),
        (replaced("fov = 45.0", "fov = 181"), "line 7"),
        (replaced("[[camera]]", "[camera]"), "this is a table; an array of tables"),
        (
            with(PLAIN.split_once("1000.0\n").unwrap().1),
            "line 9, key `camera[1].name`: entry 0 has this name too",
        ),
        (format!("camera = []\n{}", "[terrain]\nextent = 9.0"), "there is no camera"),
        (format!("name = 3\n{PLAIN}"), "line 1, key `name`"),
        (format!("name = \"../a\"\n{PLAIN}"), "line 1, key `name`"),
        (format!("seed = -1\n{PLAIN}"), "line 1, key `seed`"),
        (format!("seed = 1.5\n{PLAIN}"), "a whole number is needed"),
        (format!("seed = 4294967296\n{PLAIN}"), "line 1, key `seed`"),
        (with("[sun]\nazimuth = 1\nelevation = 91\nirradiance = 1"), "line 10, key `sun.elevation`"),
        (with("[sun]\nazimuth = 1\nelevation = 9\nirradiance = -1"), "line 11, key `sun.irradiance`"),
        (with("[sun]\nazimuth = 1\nirradiance = 1"), "`elevation` is missing"),
        (with("[sky]\nradiance = [1, 2]"), "line 9, key `sky.radiance`"),
        (with("[sky]\nradiance = true"), "line 9, key `sky.radiance`"),
        (with("[quality]\npreset = \"fsat\""), "\"fast\"?"),
        (
            with("[quality]\nladder = \"slices:256,zfield\""),
            "the rungs are: mesh, cards, zfield, shader-map, shells",
        ),
        (with("[quality]\nladder = \"zfield:4,shader-map:2\""), "the last rung goes on to the horizon"),
        (with("[quality]\nladder = 4"), "quality.ladder"),
        (with("[quality]\ncascade = 4"), "did you mean `cascades`?"),
        (with("[quality]\ncascades = 99"), "line 9, key `quality.cascades`"),
        (with("[quality]\ncascades = \"4\""), "line 9, key `quality.cascades`"),
        (species(""), "neither `density` nor `positions`"),
        (
            species("density = 0.1\npositions = \"a.csv\""),
            "line 12, key `species[0].positions`: the species has both",
        ),
        (species("density = -0.1"), "line 11, key `species[0].density`"),
        (species("density = 2e4"), "line 11, key `species[0].density`"),
        (species("density = \"none.png\""), "`max_density` is missing"),
        (species("density = \"none.png\"\nmax_density = 1"), "line 11, key `species[0].density`"),
        (species("density = 0.1\nmax_density = 1"), "line 12, key `species[0].max_density`"),
        (species("positions = \"none.csv\"\nbelow_slope = 3"), "line 12, key `species[0].below_slope`"),
        (
            species("density = 0.1\nscale = [1.2, 0.8]"),
            "line 12, key `species[0].scale`: the first number, 1.2, exceeds",
        ),
        (species("density = 0.1\nscale = [0.0, 0.8]"), "line 12, key `species[0].scale[0]`"),
        (species("density = 0.1\nbelow_slope = 91"), "line 12, key `species[0].below_slope`"),
        (species("density = 0.1\nheight = 0"), "line 12, key `species[0].height`"),
        (
            species("density = 0.1\nleaf_reflectance = 0.7\nleaf_transmittance = 0.4"),
            "line 13, key `species[0].leaf_transmittance`",
        ),
        (species("density = 0.1\nfoliage = [\"leef\"]"), "\"leaf\"?"),
        (with("[wind]\nspeed = 8.0\nazimuth = 90.0"), "`gustiness` is missing"),
        (
            with("[wind]\nspeed = -1.0\nazimuth = 90.0\ngustiness = 0.5"),
            "key `wind.speed`: -1 is outside 0 to 100 m/s",
        ),
        (with("[wind]\nspeed = 8.0\nazimuth = 361.0\ngustiness = 0.5"), "key `wind.azimuth`"),
        (with("[wind]\nspeed = 8.0\nazimuth = 90.0\ngustiness = 1.5"), "key `wind.gustiness`"),
        (with("[wind]\nspeed = nan\nazimuth = 90.0\ngustiness = 0.5"), "key `wind.speed`"),
        (with("[wind]\nspeed = 8.0\nazimuth = 90.0\ngustyness = 0.5"), "did you mean `gustiness`?"),
        (species("density = 0.1\nfoliage = [3]"), "line 12, key `species[0].foliage[0]`"),
        (species("density = 0.1\nextinction = -1"), "line 12, key `species[0].extinction`"),
        (species("density = 0.1").replace("builtin:oak", "builtin:aok"), "\"builtin:oak\"?"),
        (species("density = 0.1").replace("builtin:oak", "none.glb"), "line 10, key `species[0].model`"),
        (species(&format!("density = 0.1\n{oak}")), "line 13, key `species[1].name`"),
    ] {
        let error = message(parse(&text));
        assert!(error.contains(wanted), "for\n{text}\nwanted {wanted:?}, got\n{error}");
        assert!(error.contains("remedy: "), "{error}");
    }
}

#[test]
fn settings_and_lights_arrive() {
    let scene = parse(&format!(
        "{PLAIN}[quality]\npreset = \"fast\"\ncascades = 2\n[sun]\nazimuth = 210\nelevation = -5.5\nirradiance = 2\n[sky]\nradiance = [1, 2, 3]"
    ));
    let scene = scene.unwrap();
    assert_eq!((scene.settings.cascades, scene.settings.samples), (2, 4));
    assert_eq!(
        (scene.settings.view_resolution, scene.sun.elevation, scene.sun.irradiance),
        (128, -5.5, [2.0; 3])
    );
    assert!(matches!(scene.sky, Sky::Uniform([1.0, 2.0, 3.0])));
    assert!(scene.wind.is_none());
    let wind = |speed: &str| {
        let text = format!("{PLAIN}[wind]\nspeed = {speed}\nazimuth = -90\ngustiness = 0.25");
        parse(&text).unwrap().wind.map(|w| [w.speed, w.azimuth, w.gustiness])
    };
    assert_eq!((wind("8"), wind("0"), wind("0.0")), (Some([8.0, -90.0, 0.25]), None, None));
}

#[test]
fn real_terrain_has_its_heights() {
    let map = data("jacksboro_u16.png");
    let terrain = format!(
        "heightmap = {:?}\ncell_size = 80.0\nheight_range = [243.0, {}]",
        map.display().to_string(),
        243.0 + 65535.0 / 32.0
    );
    let scene = parse(&PLAIN.replace("extent = 1000.0", &terrain)).unwrap();
    assert_eq!(scene.terrain.extent, [364.0 * 80.0, 387.0 * 80.0]);
    let heights = scene.terrain.heights.unwrap();
    let span = heights.samples.iter().fold((f32::MAX, f32::MIN), |(l, h), v| (l.min(*v), h.max(*v)));
    assert!((span.0 - 243.0).abs() < 1.0 && (span.1 - 1071.0).abs() < 1.0, "{span:?}");
    // Row 0 of the file is north, the last row of the raster.
    let file = image::open(&map).unwrap().into_luma16();
    let north_west = 243.0 + f32::from(file.get_pixel(0, 0)[0]) / 32.0;
    assert!((heights.samples[387 * 365] - north_west).abs() < 0.01);
    let error = message(parse(&PLAIN.replace("extent = 1000.0", terrain.rsplit_once('\n').unwrap().0)));
    assert!(error.contains("height_range"), "{error}");
}

fn tiff<C: tiff::encoder::colortype::ColorType>(path: &Path, width: u32, height: u32, samples: &[C::Inner])
where
    [C::Inner]: tiff::encoder::TiffValue,
{
    let file = std::fs::File::create(path).unwrap();
    tiff::encoder::TiffEncoder::new(file).unwrap().write_image::<C>(width, height, samples).unwrap();
}

#[test]
fn rasters_of_every_format() {
    use canopy::scene::raster::{load_density, load_heights};
    use tiff::encoder::colortype::{Gray8, Gray16, Gray32Float, RGB8};
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    tiff::<Gray32Float>(&path("f.tif"), 2, 2, &[1.0, 2.0, 3.0, 4.5]);
    assert_eq!(load_heights(&path("f.tif"), None).unwrap().samples, [3.0, 4.5, 1.0, 2.0]);
    assert!(message(load_heights(&path("f.tif"), Some([0.0, 1.0]))).contains("remove `height_range`"));
    tiff::<Gray16>(&path("u.tif"), 2, 2, &[0, 65535, 0, 0]);
    assert_eq!(load_heights(&path("u.tif"), Some([10.0, 20.0])).unwrap().samples, [10.0, 10.0, 10.0, 20.0]);
    assert!(message(load_heights(&path("u.tif"), None)).contains("add `height_range"));
    assert_eq!(load_density(&path("u.tif")).unwrap().samples, [0.0, 0.0, 0.0, 1.0]);
    tiff::<Gray8>(&path("d.tif"), 1, 2, &[255, 51]);
    assert_eq!(load_density(&path("d.tif")).unwrap().samples, [0.2, 1.0]);
    for (name, bad) in [("nan", f32::NAN), ("inf", f32::INFINITY), ("void", -9999.0), ("far", -3.4e38)] {
        tiff::<Gray32Float>(&path(name), 2, 2, &[1.0, bad, 3.0, 4.0]);
        let error = message(load_heights(&path(name), None));
        assert!(error.contains("column 1, row 0 (row 0 is north)"), "{error}");
    }
    assert!(message(load_density(&path("f.tif"))).contains("not 0 to 1"));
    tiff::<RGB8>(&path("rgb.tif"), 2, 2, &[0; 12]);
    assert!(message(load_density(&path("rgb.tif"))).contains("one grey channel"));
    std::fs::write(path("rgba.png"), png(2, 2)).unwrap();
    assert!(message(load_density(&path("rgba.png"))).contains("one grey channel"));
    std::fs::write(path("huge.png"), huge_png()).unwrap();
    assert!(message(load_density(&path("huge.png"))).contains("60000 × 60000"));
    std::fs::write(path("text.png"), "not an image").unwrap();
    assert!(message(load_density(&path("text.png"))).contains("neither PNG nor TIFF"));
    tiff::<Gray16>(&path("thin.tif"), 1, 2, &[0, 1]);
    assert!(message(load_heights(&path("thin.tif"), Some([0.0, 1.0]))).contains("spans no ground"));
    for name in ["f.tif", "u.tif"] {
        let whole = std::fs::read(path(name)).unwrap();
        for length in 0..whole.len() {
            std::fs::write(path("cut"), &whole[..length]).unwrap();
            // What is cut may be padding behind the last tag: reading it is no error then.
            if let Err(error) = load_density(&path("cut")) {
                assert_eq!(error.exit_code(), 2);
            }
        }
    }
}

#[test]
fn skies_are_read_and_checked() {
    let folder = tempfile::tempdir().unwrap();
    let pixel = |x: usize, y: usize| (x as f32, y as f32, 0.25f32);
    exr::prelude::write_rgb_file(folder.path().join("s.exr"), 4, 2, pixel).unwrap();
    let text = format!("{PLAIN}[sky]\nradiance = \"s.exr\"");
    let Sky::LatLong { width, height, pixels } = in_folder(folder.path(), &text).unwrap().sky else {
        panic!("an image sky")
    };
    assert_eq!((width, height, &pixels[(4 + 3) * 3..]), (4, 2, &[3.0, 1.0, 0.25][..]));
    exr::prelude::write_rgb_file(folder.path().join("s.exr"), 4, 2, |_, _| (0.0f32, -1.0f32, 0.0f32))
        .unwrap();
    assert!(message(in_folder(folder.path(), &text)).contains("column 0, row 0: the radiance is -1"));
    exr::prelude::write_rgb_file(folder.path().join("s.exr"), 3, 2, pixel).unwrap();
    assert!(message(in_folder(folder.path(), &text)).contains("twice as wide as high"));
    let whole = std::fs::read(folder.path().join("s.exr")).unwrap();
    for length in 0..whole.len() {
        std::fs::write(folder.path().join("s.exr"), &whole[..length]).unwrap();
        message(in_folder(folder.path(), &text));
    }
    let file = std::fs::File::create(folder.path().join("s.hdr")).unwrap();
    let rgb = [image::Rgb([1.0f32, 2.0, 4.0]); 8];
    image::codecs::hdr::HdrEncoder::new(file).encode(&rgb, 4, 2).unwrap();
    let scene = in_folder(folder.path(), &text.replace("exr", "hdr")).unwrap();
    let Sky::LatLong { pixels, .. } = scene.sky else { panic!("an image sky") };
    assert_eq!(pixels[..3], [1.0, 2.0, 4.0]);
}

#[test]
fn a_moved_origin_changes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let scene = |move_by: f64| {
        let m = |v: f64| v + move_by;
        let rows = [(10.5, 20.25), (999.0, 1000.0)].map(|(x, y)| format!("{},{}\n", m(x), m(y))).concat();
        std::fs::write(folder.path().join("t.csv"), format!("x,y\n{rows}")).unwrap();
        let text = format!(
            "[terrain]\norigin = [{0}, {0}]\nextent = 1000.0\n[[camera]]\nname = \"a\"\nposition = [{1}, {2}, 3.0]\n\
             target = [{3}, {1}, 6.0]\nvertical_fov = 45.0\n[[species]]\nname = \"t\"\nmodel = \"builtin:birch\"\npositions = \"t.csv\"",
            m(0.0),
            m(1.5),
            m(2.25),
            m(4.0)
        );
        in_folder(folder.path(), &text).unwrap()
    };
    let (here, there) = (scene(0.0), scene(1e7));
    assert_eq!(there.terrain.origin, [1e7, 1e7]);
    assert_eq!(here.cameras, there.cameras);
    assert_eq!(here.cameras[0].position, [1.5, 2.25, 3.0]);
    let list = |s: &Scene| match &s.species[0].distribution {
        Distribution::Positions(p) => p.to_vec(),
        other => panic!("{other:?}"),
    };
    assert_eq!(list(&here), list(&there));
    assert_eq!((list(&here)[1].x, list(&here)[1].y), (999.0, 1000.0));
    assert_eq!(format!("{:?}", here.terrain.extent), format!("{:?}", there.terrain.extent));
}

#[test]
fn a_species_from_files_arrives_whole() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::copy(data("oak.glb"), folder.path().join("oak.glb")).unwrap();
    image::GrayImage::from_raw(1, 2, vec![255, 0]).unwrap().save(folder.path().join("d.png")).unwrap();
    let text = format!(
        "{PLAIN}[[species]]\nname = \"oak\"\nmodel = \"oak.glb\"\nheight = 7.5\nscale = [0.5, 1]\ndensity = \"d.png\"\n\
         max_density = 0.03\nbetween_heights = [300, 900]\nbelow_slope = 30\nleaf_reflectance = 0.1\nextinction = 0.5"
    );
    let scene = in_folder(folder.path(), &text).unwrap();
    let species = &scene.species[0];
    let top = species.mesh.positions.iter().map(|p| p[2]).fold(f32::MIN, f32::max);
    assert!((top - 7.5).abs() < 1e-4);
    assert_eq!(
        (species.scale, species.optics.leaf_reflectance, species.optics.extinction),
        ([0.5, 1.0], Some([0.1; 3]), Some(0.5))
    );
    let Distribution::Density { map: Some(map), max_density, between_heights, below_slope } =
        &species.distribution
    else {
        panic!("{:?}", species.distribution)
    };
    assert_eq!((&map.samples[..], *max_density), (&[0.0, 1.0][..], 0.03));
    assert_eq!((*between_heights, *below_slope), (Some([300.0, 900.0]), Some(30.0)));
    assert!(matches!(scene::load(&folder.path().join("none.toml")), Err(Error::Io { .. })));
}

/// Damage to every other kind of file: an error or a value, never a panic, and soon.
#[test]
fn damaged_files_never_panic() {
    use canopy::scene::positions::load_positions;
    use canopy::scene::raster::{load_density, load_heights};
    use canopy::scene::texture::{load_sky, load_texture};
    type Load = fn(&Path) -> canopy::Result<()>;
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let ramp: Vec<u16> = (0..64).map(|i| i * 1000).collect();
    tiff::<tiff::encoder::colortype::Gray16>(&path("a.tif"), 8, 8, &ramp);
    tiff::<tiff::encoder::colortype::Gray32Float>(&path("b.tif"), 8, 8, &[0.5; 64]);
    image::ImageBuffer::<image::Luma<u16>, _>::from_raw(8, 8, ramp).unwrap().save(path("c.png")).unwrap();
    exr::prelude::write_rgb_file(path("d.exr"), 8, 4, |x, y| (x as f32, y as f32, 0.5f32)).unwrap();
    let file = std::fs::File::create(path("e.hdr")).unwrap();
    image::codecs::hdr::HdrEncoder::new(file).encode(&[image::Rgb([1.0f32, 2.0, 4.0]); 32], 8, 4).unwrap();
    image::RgbImage::from_pixel(8, 8, image::Rgb([9, 99, 199])).save(path("f.jpg")).unwrap();
    std::fs::write(path("g.csv"), "x,y,scale,rotation\n1,2,0.5,90\n10,20,1.5,-90\n").unwrap();
    std::fs::write(path("h.toml"), format!("seed = 3\n{PLAIN}[sky]\nradiance = [1, 2, 3]\n")).unwrap();
    let start = Instant::now();
    for (name, load) in [
        ("a.tif", (|p| load_heights(p, Some([0.0, 100.0])).map(drop)) as Load),
        ("b.tif", |p| load_heights(p, None).map(drop)),
        ("c.png", |p| load_density(p).map(drop)),
        ("d.exr", |p| load_sky(p).map(drop)),
        ("e.hdr", |p| load_sky(p).map(drop)),
        ("f.jpg", |p| load_texture(p).map(drop)),
        ("g.csv", |p| load_positions(p, [0.0; 2], [100.0; 2]).map(drop)),
        ("h.toml", |p| scene::load(p).map(drop)),
    ] {
        let whole = std::fs::read(path(name)).unwrap();
        load(&path(name)).unwrap_or_else(|e| panic!("{name}: {e}"));
        let cuts = (0..whole.len()).map(|n| whole[..n].to_vec());
        let mut refused = 0;
        for bytes in cuts.chain(damaged(&whole, 600)) {
            std::fs::write(path("damaged"), bytes).unwrap();
            if let Err(error) = load(&path("damaged")) {
                assert_eq!(error.exit_code(), 2, "{name}: {error}");
                refused += 1;
            }
        }
        assert!(refused > 50, "{name}: only {refused} refused");
    }
    assert!(start.elapsed() < Duration::from_secs(60), "{:?}", start.elapsed());
}

/// Sizes that are allowed, in files that are too small for them: refused before a gigabyte is set aside.
#[test]
fn images_that_the_file_cannot_hold_are_refused() {
    use canopy::scene::raster::{MAX_SIDE, load_heights};
    use canopy::scene::texture::{self, load_sky, load_texture};
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    std::fs::write(path("a.png"), hollow_png(MAX_SIDE)).unwrap();
    tiff::<tiff::encoder::colortype::Gray32Float>(&path("b.tif"), 2, 2, &[1.0; 4]);
    let mut bytes = std::fs::read(path("b.tif")).unwrap();
    // Width and height: tags 256 and 257, one 32-bit value each.
    for tag in [256u16, 257] {
        let entry = [&tag.to_le_bytes()[..], &[4, 0, 1, 0, 0, 0]].concat();
        let at = bytes.windows(8).position(|w| w == entry).unwrap() + 8;
        bytes[at..at + 4].copy_from_slice(&MAX_SIDE.to_le_bytes());
    }
    std::fs::write(path("b.tif"), bytes).unwrap();
    let [high, wide] = [texture::MAX_SIDE, 2 * texture::MAX_SIDE];
    std::fs::write(path("c.png"), hollow_png(high)).unwrap();
    std::fs::write(path("d.hdr"), format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {high} +X {wide}\n"))
        .unwrap();
    exr::prelude::write_rgb_file(path("e.exr"), 4, 2, |_, _| (0.5f32, 0.5f32, 0.5f32)).unwrap();
    let bytes = std::fs::read(path("e.exr")).unwrap();
    let corner = |w: u32, h: u32| [0, 0, w - 1, h - 1].map(u32::to_le_bytes).concat();
    let (small, large) = (corner(4, 2), corner(wide, high));
    let large: Vec<u8> = (0..bytes.len())
        .map(|i| {
            let start = (0..16).find(|k| i >= *k && bytes[i - k..].starts_with(&small));
            start.map_or(bytes[i], |k| large[k])
        })
        .collect();
    std::fs::write(path("e.exr"), large).unwrap();
    for error in [
        message(load_heights(&path("a.png"), Some([0.0, 1.0]))),
        message(load_heights(&path("b.tif"), None)),
        message(load_texture(&path("c.png"))),
        message(load_sky(&path("d.hdr"))),
        message(load_sky(&path("e.exr"))),
    ] {
        assert!(error.contains("the header announces"), "{error}");
    }
}

/// Seeds and findings of the fuzz targets in tests/fuzz: what was found once stays mended.
#[test]
fn fuzz_seeds_and_findings_are_read_or_refused() {
    use canopy::scene::model::load_model_bytes;
    use canopy::scene::positions::load_positions;
    use canopy::scene::raster::{load_density, load_heights};
    use canopy::scene::texture::{load_sky, load_texture};
    type Load = fn(&Path) -> canopy::Result<()>;
    let fuzz = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fuzz");
    let targets: [(&str, &[Load]); 5] = [
        ("scene", &[|p| scene::load(p).map(drop)]),
        ("model", &[|p| load_model_bytes(p, &std::fs::read(p).unwrap(), None, None).map(drop)]),
        (
            "raster",
            &[
                |p| load_heights(p, None).map(drop),
                |p| load_heights(p, Some([0.0, 100.0])).map(drop),
                |p| load_density(p).map(drop),
            ],
        ),
        ("picture", &[|p| load_texture(p).map(drop), |p| load_sky(p).map(drop)]),
        (
            "inventory",
            &[
                |p| load_positions(p, [0.0; 2], [100.0; 2]).map(drop),
                |p| load_positions(p, [5e5, 4e6], [1e7; 2]).map(drop),
            ],
        ),
    ];
    for (target, loads) in targets {
        for kind in ["seeds", "findings"] {
            let Ok(folder) = std::fs::read_dir(fuzz.join(kind).join(target)) else {
                assert_eq!(kind, "findings", "the seeds of {target} are missing");
                continue;
            };
            for file in folder {
                let path = file.unwrap().path();
                let mut read = 0;
                for load in loads {
                    match load(&path) {
                        Ok(()) => read += 1,
                        Err(error) => assert_eq!(error.exit_code(), 2, "{}: {error}", path.display()),
                    }
                }
                // A seed that no reader takes would lead the fuzzer nowhere; the one scene shows every kind of number.
                let meant = kind == "findings" || path.ends_with("inline.toml");
                assert!(read > 0 || meant, "{} is refused", path.display());
            }
        }
    }
}
