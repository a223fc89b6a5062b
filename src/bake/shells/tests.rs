use std::sync::LazyLock;

use glam::{DVec2, Vec3};

use super::edges::edges;
use super::*;
use crate::bake::grove::Tree;
use crate::land::candidate::{Layout, tile_kind};
use crate::physics::hash::Stream;
use crate::scene::mesh::Triangle;
use crate::scene::{Material, Mesh, default_scene, parse};

/// The built-in scene.
static SCENE: LazyLock<Scene> = LazyLock::new(|| default_scene().unwrap());

/// A plain with pines everywhere.
fn pines(density: &str) -> Scene {
    plain("builtin:pine", "[0.5, 1.0]", density)
}

/// A plain with trees of one species everywhere.
pub(super) fn plain(model: &str, scale: &str, density: &str) -> Scene {
    let text = format!(
        "name = \"plain\"\nseed = 3\n[terrain]\nextent = 2000.0\nalbedo = [0.1, 0.1, 0.1]\n[[species]]\nname = \"tree\"\n\
         model = \"{model}\"\nscale = {scale}\n{density}\n[sun]\nazimuth = 0.0\nelevation = 45.0\nirradiance = [1.0, 1.0, 1.0]\n\
         [[camera]]\nname = \"a\"\nposition = [0.0, 0.0, 50.0]\ntarget = [100.0, 100.0, 0.0]\nvertical_fov = 40.0\n"
    );
    parse(&text, Path::new("plain.toml")).unwrap()
}

fn random(stream: &mut Stream) -> Texel {
    let mut unit = || stream.unit() as f32;
    let mut cover: [f32; SHARES] = std::array::from_fn(|_| unit());
    cover.sort_by(f32::total_cmp);
    Texel { cover, values: std::array::from_fn(|_| unit() * cover[SHARES - 1]) }
}

fn random_slices(side: usize, slices: usize) -> Slices {
    let mut stream = Stream::new(7);
    let size = side * side;
    let texels = (0..size * slices).map(|_| random(&mut stream)).collect();
    Slices { side, texels, above: (0..size).map(|_| random(&mut stream).cover).collect() }
}

fn distance(a: &Texel, b: &Texel) -> f32 {
    let pairs = a.cover.iter().zip(&b.cover).chain(a.values.iter().zip(&b.values));
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
}

#[test]
fn trees_stand_where_the_scene_has_them() {
    let scene = pines("density = 0.02");
    let patch = Patch::new(&scene, &[5.0]).unwrap();
    let seeds = Layout::new(&scene).unwrap().trees(&scene, [2, 1], 3);
    let mut stand: Vec<[f32; 2]> = Vec::new();
    for (x, y) in (0..3).flat_map(|y| (0..3).map(move |x| (x, y))) {
        let corner = Vec3::new(x as f32, y as f32, 0.0) * patch.side as f32;
        let here = patch.trees(tile_kind(scene.seed, 6 + x, 3 + y));
        stand.extend(here.iter().map(|i| (i.tree.base + corner).truncate().to_array()));
    }
    assert!(seeds.len() == stand.len() && stand.len() > 2000, "{} {}", seeds.len(), stand.len());
    for seed in &seeds {
        // Both round coordinates of up to 340 m to singles, a few times: 2⁻¹⁵ m each.
        let near = |p: &[f32; 2]| (0..2).all(|k| (p[k] - seed.position[k]).abs() < 2e-4);
        assert!(stand.iter().any(near), "{:?}", seed.position);
    }
}

#[test]
fn trees_of_an_edge_are_the_same_in_all_tiles_that_have_it_and_in_no_other() {
    let patch = Patch::new(&SCENE, &[6.8, 5.0, 3.3]).unwrap();
    let side = patch.side as f32;
    let strip = Layout::new(&SCENE).unwrap().pattern.distance as f32;
    let mut missing = 0;
    for (edge, step) in [(1, Vec3::Y), (3, Vec3::X)] {
        for (a, b) in (0..TILES).flat_map(|a| (0..TILES).map(move |b| (a, b))) {
            // Trees that a shows just behind its edge, in b; farther inside its neighbour may be another one.
            let across = edge / 2;
            let behind = |i: &&Image| {
                let at = i.tree.base / side - step;
                let (depth, along) = (at[1 - across], at[across]);
                (0.0..strip).contains(&depth) && (0.0..1.0).contains(&along)
            };
            let found: Vec<bool> = patch.tiles[a]
                .iter()
                .filter(behind)
                .map(|i| {
                    let base = i.tree.base - step * side;
                    // Half an ulp of 76 m for each side.
                    let is = |o: &Image| {
                        o.tree.base.distance(base) < 2e-5
                            && Tree { base: Vec3::ZERO, ..o.tree } == Tree { base: Vec3::ZERO, ..i.tree }
                            && o.activation == i.activation
                    };
                    patch.trees(b).iter().any(is)
                })
                .collect();
            assert!(found.len() > 10, "{} trees", found.len());
            if (a >> edge ^ b >> (edge - 1)) & 1 == 0 {
                assert!(found.iter().all(|f| *f), "{a} {b}");
            } else {
                missing += usize::from(found.iter().any(|f| !f));
            }
        }
    }
    // All pairs of tiles of two colours have other trees at that edge.
    assert_eq!(missing, 2 * TILES * TILES / 2);
}

#[test]
fn a_sample_sees_the_uppermost_surface_of_its_slab() {
    // A square of 2 m at a height of 1.5 m, and a smaller one of bark above its south-west quarter in the same slab, 1.75 m.
    let corners =
        |low: f32, high: f32, z: f32| [[low, low, z], [high, low, z], [high, high, z], [low, high, z]];
    let material = |foliage| Material { foliage, ..Material::leaf() };
    let mesh = Mesh {
        positions: [corners(-1.0, 1.0, 1.5), corners(-1.0, 0.0, 1.75)].concat(),
        normals: vec![[0.0, 0.0, 1.0]; 8],
        uvs: vec![[0.0; 2]; 8],
        triangles: [[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]]
            .iter()
            .enumerate()
            .map(|(k, v)| Triangle { vertices: *v, material: u32::from(k > 1) })
            .collect(),
        materials: vec![material(true), material(false)],
        dropped_triangles: 0,
    };
    let kinds = [Kind::new(&mesh).unwrap()];
    let tree = |x: f32, scale: f32, activation: f32| Image {
        tree: Tree { base: Vec3::new(x, 2.0, 0.0), scale, turn: [0.0, 1.0], tint: 1.0, species: 0 },
        activation,
    };
    let window = Window { low: Vec2::ZERO, texel: 1.0, size: [8, 4], slices: 4, height: 4.0 };
    // The third stands under the first, and from a lower density on.
    let trees = [tree(2.0, 1.0, 0.3), tree(5.5, 1.0, 0.8), tree(2.0, 0.7, 0.1)];
    let samples = Samples::paint(&kinds, &trees, window);
    let texels = samples.texels(|seen| [f32::from(u8::from(seen.face > 1)), seen.height, seen.tree as f32]);
    for (k, (cover, [bark, height, tree])) in texels.iter().enumerate() {
        let (slab, y, x) = (k / 32, k / 8 % 4, k % 8);
        let inside = slab == 1 && (1..3).contains(&y);
        // A quarter turn counterclockwise: bark is in the south-east.
        let expected = match (inside, x) {
            // Middles of samples within 0.7 m of the trunk: three of four each way.
            (true, 1) => ([0.5625, 1.0, 1.0, 1.0], 0.0, 1.5, 0.0),
            (true, 2) => ([0.5625, 1.0, 1.0, 1.0], f32::from(u8::from(y == 1)), 1.5, 0.0),
            // Half of the texel, from x = 4.5 on, and to 6.5; trees are told apart.
            (true, 4) => ([0.0, 0.0, 0.0, 0.5], 0.0, 0.75, 0.5),
            (true, 5) => ([0.0, 0.0, 0.0, 1.0], 0.5 * f32::from(u8::from(y == 1)), 1.5, 1.0),
            (true, 6) => ([0.0, 0.0, 0.0, 0.5], 0.5 * f32::from(u8::from(y == 1)), 0.75, 0.5),
            _ => ([0.0; 4], 0.0, 0.0, 0.0),
        };
        let over = expected.1 * 0.25;
        let close = |a: f32, b: f32| (a - b).abs() < 1e-5;
        assert!(cover.iter().zip(expected.0).all(|(a, b)| close(*a, b)), "{x} {y} {slab}: {cover:?}");
        assert!(
            close(*bark, expected.1) && close(*height, expected.2 + over) && close(*tree, expected.3),
            "{x} {y}"
        );
    }
    let above = samples.above();
    assert!(above.iter().zip(&texels[32..64]).all(|(a, t)| *a == t.0));
}

#[test]
fn merging_is_associative() {
    let mut stream = Stream::new(1);
    for _ in 0..1000 {
        let [a, b, c] = [0; 3].map(|_| random(&mut stream));
        // Three products and sums of numbers up to 1: three roundings of 6e-8 on either side.
        assert!(distance(&a.over(&b).over(&c), &a.over(&b.over(&c))) < 4e-7);
    }
    let slices = random_slices(4, 8);
    let one = std::iter::successors(Some(slices.clone()), |s| Some(s.merged())).nth(3).unwrap();
    assert_eq!(one.texels.len(), 16);
    for (k, merged) in one.texels.iter().enumerate() {
        let from_above = slices.texels[k..].iter().step_by(16).rev();
        let drawn = from_above.fold(Texel::default(), |sum, t| sum.over(t));
        assert!(distance(merged, &drawn) < 1e-6, "eight slices drawn one by one");
    }
}

#[test]
fn stacks_hide_from_above_what_they_should_in_every_mip_and_level() {
    let mean = |s: &Slices, share: usize| {
        s.above.iter().map(|a| f64::from(a[share])).sum::<f64>() / s.above.len() as f64
    };
    let finest = random_slices(8, 8);
    let mips: Vec<Slices> =
        std::iter::successors(Some(finest.clone()), |s| (s.side > 1).then(|| s.halved())).collect();
    assert_eq!(mips.iter().map(|m| m.side).collect::<Vec<_>>(), [8, 4, 2, 1]);
    for mip in &mips {
        let fitted = mip.clone().fitted();
        let one = fitted.merged().merged().merged();
        for share in 0..SHARES {
            assert!((mean(mip, share) - mean(&finest, share)).abs() < 1e-6, "a mip is the mean");
            for (k, above) in mip.above.iter().enumerate() {
                // A power of e to an optical depth of up to 20, in singles: 20 roundings of 6e-8, and as many of the sum.
                let (has, wants) = (one.texels[k].cover[share], above[share]);
                assert!((has - wants).abs() < 5e-6, "side {}, texel {k}: {has} {wants}", mip.side);
            }
        }
        // Optics per cover stay as they were.
        for (f, t) in fitted.texels.iter().zip(&mip.texels) {
            let ratio = |t: &Texel| t.values[5] / t.cover[SHARES - 1];
            assert!((ratio(f) - ratio(t)).abs() < 1e-4 * ratio(t).max(1.0), "{} {}", ratio(f), ratio(t));
        }
    }
    // Nothing and all are no faults.
    let mut extremes = random_slices(1, 2);
    extremes.texels[0].cover = [0.0, 0.0, 1.0, 1.0];
    extremes.texels[1].cover = [0.0, 0.3, 0.5, 1.0];
    extremes.above[0] = [0.0, 1.0, 1.0, 1.0];
    let fitted = extremes.fitted();
    assert!(fitted.texels.iter().all(|t| t.cover.iter().chain(&t.values).all(|v| v.is_finite())));
    assert!(fitted.merged().texels[0].cover[1] > 0.999 && fitted.texels[1].cover[0] == 0.0);
}

/// Shells of even cover.
fn even(cover: u8, slices: u32) -> Shells {
    let settings = ShellSettings { slices, texels: 16 };
    let mut levels = empty(settings);
    levels[0][0].cover = vec![cover; 4 * TILES * slices as usize * 256];
    Shells {
        settings,
        tile_side: 64.0,
        height: 20.0,
        most: [[1.0; 3]; 2],
        levels,
        sun: Default::default(),
        light: Vec::new(),
    }
}

#[test]
fn low_rays_meet_slanted_slices_as_often_as_they_should() {
    let shells = even(51, 8);
    let stack = Stack::new(&shells, 1, 0, 0);
    let mut stream = Stream::new(2);
    for zenith in [0.0f64, 30.0, 60.0, 80.0] {
        let (sin, cos) = zenith.to_radians().sin_cos();
        let n = 4000;
        let (mut meets, mut squares) = (0.0, 0.0);
        for _ in 0..n {
            let ground = DVec2::new(stream.unit(), stream.unit()) * 500.0;
            let toward = (DVec2::from_angle(stream.unit() * 6.3) * sin).extend(cos);
            let [[level, long, slanted]] = stack.passes(ground, toward, &[1.0]);
            // Each slice lets through 4/5.
            assert!((level - 0.8f64.powi(8)).abs() < 1e-12 && (long - level.powf(1.0 / cos)).abs() < 1e-12);
            let count = slanted.ln() / 0.8f64.ln() / 8.0;
            meets += count / f64::from(n);
            squares += count * count / f64::from(n);
        }
        let error = ((squares - meets * meets) / f64::from(n)).sqrt();
        let expected = 1.0 + sin * zenith.to_radians().tan();
        // Corners of the lowest slice, 1.25 m up, that are slanted by up to 1.5 m into the ground are too little to be seen in the mean.
        assert!((meets - expected).abs() < 4.0 * error + 1e-9, "{zenith}: {meets} ± {error}, {expected}");
    }
}

#[test]
fn cover_is_linear_between_shares_and_none_at_0() {
    let cover = [0.1, 0.3, 0.4, 0.8];
    for (share, expected) in [(0.0, 0.0), (0.125, 0.05), (0.25, 0.1), (0.5, 0.3), (0.875, 0.6), (1.0, 0.8)] {
        assert!((at_share(cover, share) - expected).abs() < 1e-12, "{share}");
    }
}

/// How much more of the ground a slice hides than meshes do, within 1/32 of a tile of its edges and more than 1/8, at a quarter of the density:
/// difference and error.
fn at_edges(scene: &Scene, forest: &Forest) -> [[f64; 2]; 2] {
    let lights = Lights::new(scene, forest, None, true).unwrap();
    let shells = Shells::of(forest, &lights, ShellSettings { slices: 2, texels: 64 }, true);
    let near = edges(scene, &shells, forest, 160_000).unwrap();
    let few: Vec<_> = near.iter().filter(|n| n.share == 0.25).collect();
    [few[0], few[3]].map(|n| [n.difference, n.error])
}

#[test]
fn edges_have_as_much_cover_as_meshes_have_there_because_tiles_have_neighbours() {
    // Oaks nearly twice as wide as far apart.
    let scene = plain("builtin:oak", "[1.6, 2.2]", "density = 0.02");
    let mut forest = Forest::new(&scene).unwrap();
    let [[edge, error], [inside, inside_error]] = at_edges(&scene, &forest);
    // One slice seen from above is a picture: its mean has no error but chance. Four standard errors, from the spread of tiles' sides.
    assert!(edge.abs() < 4.0 * error && inside.abs() < 4.0 * inside_error, "{edge} ± {error}, {inside}");
    // Without neighbours there would be less at edges than meshes hide; and with only those crowns that go on, too: 0.014 less, eight errors.
    let strip = Layout::new(&scene).unwrap().pattern.distance * forest.patch.side;
    let beyond = |i: &Image| {
        let base = i.tree.base.truncate();
        f64::from(base.distance(base.clamp(Vec2::ZERO, Vec2::splat(forest.patch.side as f32))))
    };
    for tile in &mut forest.patch.tiles {
        tile.retain(|i| beyond(i) < strip);
    }
    let [[edge, error], _] = at_edges(&scene, &forest);
    assert!(edge < -5.0 * error, "{edge} ± {error}");
}

#[test]
fn stacks_hide_what_meshes_hide_and_tiles_fit() {
    let shells = Shells::bake(&SCENE, ShellSettings { slices: 16, texels: 64 }, None, true).unwrap();
    let found = verify(&SCENE, &shells, 5, 4000).unwrap();
    for q in &found.angles {
        let [level, long, _] = q.stack;
        // Texels of 1.2 m, between which filters blur the rims of crowns, in each slice anew: from above half a forest hides 0.034 more, and
        // all of it 0.013. Low rays see crowns behind crowns: 0.006. Errors are up to 0.004, of which there is room for two.
        let most = if q.zenith > 50.0 { 0.014 } else { 0.043 - 0.021 * f64::from(u8::from(q.share == 1.0)) };
        assert!(long.difference.abs() < most, "{q:?}");
        // Level slices do not get more opaque the lower one looks.
        assert!(q.zenith < 50.0 || q.share == 1.0 || level.difference < -0.03, "{q:?}");
    }
    for c in found.coarse.iter().filter(|c| c.slices == 1 && c.zenith == 0.0) {
        // One slice from above is a picture of what is hidden, in any mip: only chance is left, and bytes.
        assert!(c.difference.abs() < 4.0 * c.error, "{c:?}");
    }
    for l in &found.light {
        // Of an irradiance of 1, with few bands and products of means. Four standard errors of 40 columns are up to 0.015.
        assert!(l.both.difference.abs() < 0.02 && l.both.rms < 0.08, "{l:?}");
        // V and the sky's share are for the side that is seen: the other one looks lower.
        let free = l.free.difference.abs();
        assert!(l.own.difference.abs() < 0.03 && (free < 0.06 || !l.seen), "{l:?}");
    }
    for s in found.sun.iter().filter(|s| s.from < 100.0) {
        // By rays that the corrections were not fitted to, where most light is. A bin has a tenth of the rays, of which a sixth to three quarters meet lit leaves.
        // Means without them know no gap that viewer and sun look through: half of the light and more is not there.
        assert!((s.corrected - 1.0).abs() < 0.08 && (s.plain < 0.5 || s.from > 0.0), "{s:?}");
    }
    for s in &found.seams {
        // From tile to tile cover changes as from texel to texel, but for crowns that end there (1.21 times at a quarter of the density); of tiles
        // that do not fit, 1.33 times and more.
        assert!(s.step_across < 1.27 * s.step_inside && s.step_wrong > 1.27 * s.step_inside, "{s:?}");
        // Trees of two colours of two axes are few: five standard errors.
        let error = s.band[1].hypot(s.inside[1]);
        assert!((s.band[0] - s.inside[0]).abs() < 5.0 * error, "{s:?}");
    }
}

#[test]
fn shells_are_the_same_on_any_number_of_threads_and_from_the_cache() {
    let scene = pines("density = 0.01");
    let settings = ShellSettings { slices: 2, texels: 16 };
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| Shells::bake(&scene, settings, None, true).unwrap())
    };
    let one = on(1);
    assert_eq!(one, on(3));
    // Levels of 2 and 1 slices, mips of 16 to 1 texels, 12 bytes each, and of light of 4 to 1, 28 bytes.
    assert_eq!(one.bytes(), 16 * (2 + 1) * (12 * (256 + 64 + 16 + 4 + 1) + 28 * (16 + 4 + 1)));
    let dir = tempfile::tempdir().unwrap();
    let load = |scene: &Scene, settings| Shells::load(scene, settings, Some(dir.path()), true).unwrap();
    assert_eq!(load(&scene, settings), (one.clone(), CacheState::Baked));
    assert_eq!(load(&scene, settings), (one, CacheState::Hit));
    assert_eq!(load(&scene, ShellSettings { texels: 32, ..settings }).1, CacheState::Baked);
    assert_eq!(load(&pines("density = 0.011"), settings).1, CacheState::Baked);
    assert_eq!(load(&Scene { seed: 4, ..scene.clone() }, settings).1, CacheState::Baked);
}

#[test]
fn what_no_shells_can_be_made_of_is_said() {
    let said = |scene: &Scene, slices, texels| {
        Shells::bake(scene, ShellSettings { slices, texels }, None, true)
            .err()
            .map(|e| e.to_string())
            .unwrap()
    };
    let thin = pines("density = 0.01");
    assert!(said(&thin, 12, 64).contains("powers of two") && said(&thin, 16, 8).contains("powers of two"));
    assert!(
        said(&thin, 64, 64).contains("2 to 32 slices") && said(&thin, 16, 512).contains("16 to 256 texels")
    );
    assert!(said(&pines("density = 5.0"), 16, 64).contains("do not fit into a tile"));
    let mut listed = pines("density = 0.01");
    listed.species[0].distribution = crate::scene::Distribution::Positions(Vec::new().into());
    assert!(said(&listed, 16, 64).contains("only lists"));
}
