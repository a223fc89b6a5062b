//! Coverage tiles: the discs of the very trees, the densities, without cuts between tiles and levels.

use crate::device::{self, Worst};
use crate::seeds::{SIZE, above, hills, plain, positions, seeds};
use canopy::frame::{FrameReport, Renderer};
use canopy::gpu::Gpu;
use canopy::gpu::interface::{COVER_GUTTER, Seed, TERRAIN_CELLS, TerrainQuad};
use canopy::land::quadtree::{MIN_REFINE, QuadKey, Quadtree};
use canopy::physics::raster::Raster;
use canopy::plan::Plan;
use canopy::scene::{Camera, Distribution, Scene, TreePosition};
use half::f16;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Texels of a tile, four channels each.
type Texels = Vec<[f64; 4]>;

/// A frame's tiles and trees.
struct Frame {
    report: FrameReport,
    plan: Plan,
    tree: Quadtree,
    /// Level 0 to 3 of each tile's first layer.
    tiles: BTreeMap<QuadKey, Vec<Texels>>,
    bits: BTreeMap<QuadKey, Vec<u16>>,
    /// Trees in view, from the south-west corner of the terrain.
    trees: Vec<([f64; 2], Seed)>,
    /// Crown radius and mean area of each species.
    crowns: Vec<[f64; 2]>,
}

fn keys(tree: &Quadtree) -> impl Iterator<Item = QuadKey> {
    (0..tree.levels()).flat_map(|level| {
        let n = 1 << level;
        (0..n * n).map(move |k| QuadKey { level, x: k % n, y: k / n })
    })
}

fn held(gpu: &Gpu, renderer: &Renderer) -> BTreeMap<QuadKey, Vec<Vec<u16>>> {
    let coverage = &renderer.forest().unwrap().coverage;
    let read = |level, layer| gpu.read_image::<u16>(&coverage.tiles, level, layer).unwrap();
    keys(&renderer.terrain().tree)
        .filter_map(|key| Some((key, coverage.layer(&key)?)))
        .map(|(key, layer)| (key, (0..4).map(|level| read(level, layer)).collect()))
        .collect()
}

fn draw(gpu: &Gpu, scene: &Scene, camera: &Camera) -> Frame {
    let mut renderer = device::renderer(gpu, scene, camera, SIZE, false);
    let report = renderer.render(camera, 1.0).unwrap();
    let halves = held(gpu, &renderer);
    let plan = renderer.plan().clone();
    let float =
        |h: &[u16]| [0, 1, 2, 3].map(|k| h.get(k).map_or(0.0, |bits| f64::from(f16::from_bits(*bits))));
    let channels = plan.cover_channels.min(4) as usize;
    let texels = |level: &Vec<u16>| level.chunks_exact(channels).map(float).collect();
    let rows = &renderer.forest().unwrap().species.rows;
    Frame {
        report,
        tree: renderer.terrain().tree.clone(),
        tiles: halves.iter().map(|(k, levels)| (*k, levels.iter().map(texels).collect())).collect(),
        bits: halves.into_iter().map(|(k, mut levels)| (k, levels.swap_remove(0))).collect(),
        trees: positions(&seeds(gpu, scene, &renderer), plan.quad_side),
        crowns: rows.iter().map(|r| [f64::from(r.crown_radius), f64::from(r.mean_area)]).collect(),
        plan,
    }
}

impl Frame {
    /// Texels a side, metres a texel, and the south-west corner of a tile, m.
    fn layout(&self, key: &QuadKey) -> (usize, f64, [f64; 2]) {
        let (size, gutter) = (self.plan.coverage_size, f64::from(COVER_GUTTER));
        let side = self.tree.side(key.level);
        let texel = side / (f64::from(size) - 2.0 * gutter);
        (size as usize, texel, [key.x, key.y].map(|v| f64::from(v) * side - gutter * texel))
    }

    /// Mean over a tile's quad of a function of its texels.
    fn mean(&self, key: &QuadKey, f: impl Fn([f64; 4]) -> f64) -> f64 {
        let (size, gutter) = (self.plan.coverage_size as usize, COVER_GUTTER as usize);
        let inner = gutter..size - gutter;
        let texels = inner.clone().flat_map(|y| inner.clone().map(move |x| y * size + x));
        texels.map(|k| f(self.tiles[key][0][k])).sum::<f64>() / ((size - 2 * gutter) as f64).powi(2)
    }

    /// The union of discs on a tile as shaders/forest/coverage.glsl has it, on a grid so fine that a mean disc has a
    /// radius of three quarters of a cell, or four times finer; and how much finer.
    fn discs(&self, key: &QuadKey, disc: f64) -> (Vec<f64>, usize) {
        let (size, texel, low) = self.layout(key);
        let radius = (disc / std::f64::consts::PI).sqrt() / texel;
        let fine = [1, 2].into_iter().find(|f| radius * *f as f64 >= 0.75).unwrap_or(4);
        let (side, cell) = (size * fine, texel / fine as f64);
        let mut open = vec![1.0; side * side];
        for (p, s) in &self.trees {
            let r = self.crowns[device::species(s)][0] * f64::from(s.scale) / cell;
            let c = [0, 1].map(|k| (p[k] - low[k]) / cell);
            let range = |k: usize| {
                let reach = |v: f64| v.clamp(0.0, side as f64) as usize;
                reach(c[k] - r - 2.0)..reach(c[k] + r + 3.0)
            };
            for (y, x) in range(1).flat_map(|y| range(0).map(move |x| (y, x))) {
                let d = [x as f64 + 0.5 - c[0], y as f64 + 0.5 - c[1]];
                let share = if r < 0.6 {
                    let tent = |v: f64| (1.0 - v.abs()).max(0.0);
                    std::f64::consts::PI * r * r * tent(d[0]) * tent(d[1])
                } else {
                    ((r * r - 1.0 / 12.0).sqrt() + 0.5 - d[0].hypot(d[1])).clamp(0.0, 1.0)
                };
                open[y * side + x] *= (1.0f64 - share).max(1.0 / 4096.0);
            }
        }
        let mut coverage = vec![0.0; size * size];
        for (k, o) in open.iter().enumerate() {
            coverage[k / side / fine * size + k % side / fine] += (1.0 - o) / (fine * fine) as f64;
        }
        (coverage, fine)
    }
}

/// Mean disc area of a scene, weighted by the species' densities, m².
fn mean_disc(scene: &Scene, crowns: &[[f64; 2]]) -> f64 {
    let density = scene.species.iter().map(|s| match &s.distribution {
        Distribution::Density { max_density, .. } => f64::from(*max_density),
        Distribution::Positions(list) => {
            list.len() as f64 / (scene.terrain.extent[0] * scene.terrain.extent[1])
        }
    });
    let (weight, area) = density.zip(crowns).fold((0.0, 0.0), |s, (d, c)| (s.0 + d, s.1 + d * c[1]));
    area / weight
}

/// From so high above the middle that the whole terrain is in view.
fn from_height(scene: &Scene, height: f64) -> Camera {
    let side = scene.terrain.extent[0];
    let vertical_fov = 2.2 * (0.5 * side / height).atan().to_degrees();
    Camera { vertical_fov, ..device::camera([0.5 * side, 0.5 * side, height], [0.5 * side, 0.5 * side, 0.0]) }
}

#[test]
fn tiles_show_the_discs_of_the_very_trees_that_are_drawn() {
    let gpu = device::open();
    let mut uneven = plain(450.0, [0.05, 0.03]);
    hills(&mut uneven);
    let list = (0..600u32).map(|k| TreePosition {
        x: 450.0 * f64::from(canopy::physics::hash::unit(canopy::physics::hash::hash(k))),
        y: 450.0 * f64::from(canopy::physics::hash::unit(canopy::physics::hash::hash(k + 999))),
        scale: k.is_multiple_of(2).then_some(0.4 + 0.002 * k as f32),
        rotation: None,
    });
    uneven.species[1].distribution = Distribution::Positions(Arc::new(list.collect()));
    // Levels of 112, 225 and 450 m, and of 56 m in the hills: texels of 1 to 9.4 m, and discs of 2.2 m or so.
    let even = plain(450.0, [0.05, 0.03]);
    let mut grids = std::collections::BTreeSet::new();
    for (scene, size, height) in [
        (&even, 128.0, 270.0),
        (&even, 64.0, 270.0),
        (&even, 64.0, 1000.0),
        (&even, 64.0, 2500.0),
        (&uneven, 64.0, 270.0),
    ] {
        let mut scene = scene.clone();
        scene.settings.set("coverage_size", size).unwrap();
        let frame = draw(&gpu, &scene, &from_height(&scene, height));
        assert!(frame.trees.len() > 4000, "{}", frame.trees.len());
        let mut worst = Worst::default();
        for key in frame.tiles.keys() {
            let (discs, fine) = frame.discs(key, mean_disc(&scene, &frame.crowns));
            grids.insert(fine);
            for (k, want) in discs.iter().enumerate() {
                let got = frame.tiles[key][0][k][0];
                worst.note((got - want).abs(), || format!("{key:?} texel {k}: {got} {want}"));
            }
        }
        println!("{height} m: {} tiles, {} trees", frame.tiles.len(), frame.trees.len());
        // Half floats under 1 have steps of 2^-11, and drivers may cut. Places are singles of up to 450 m, a ten-thousandth
        // of a texel at worst, and up to two edges cross a texel. Each disc
        // rounds its sum to 2^-13, half of it at most, and four may share a texel that is still open.
        worst.within(4.9e-4 + 2.0 * 1e-4 + 4.0 * 6.1e-5, "union of discs");
    }
    assert!(grids.into_iter().eq([1, 2, 4]), "every grid is drawn on");
    gpu.close().unwrap();
}

#[test]
fn neighbours_agree_in_their_gutters_at_every_level() {
    let gpu = device::open();
    let mut scene = plain(450.0, [0.05, 0.03]);
    hills(&mut scene);
    let frame = draw(&gpu, &scene, &above(&scene));
    let size = frame.plan.coverage_size as usize;
    let (mut worst, mut pairs) = (Worst::default(), 0);
    for (key, tile) in &frame.tiles {
        for (dx, dy) in [(1, 0), (0, 1)] {
            let other = QuadKey { x: key.x + dx, y: key.y + dy, ..*key };
            let Some(next) = frame.tiles.get(&other) else { continue };
            pairs += 1;
            for level in 0..4 {
                // Both gutters lie over each other: sixteen texels of level 0.
                let (n, shared) = (size >> level, (2 * COVER_GUTTER as usize) >> level);
                for k in 0..shared * n {
                    let (across, along) = (k % shared, k / shared);
                    let at = |x: usize, y: usize| if dx == 1 { y * n + x } else { x * n + y };
                    let (a, b) =
                        (tile[level][at(n - shared + across, along)], next[level][at(across, along)]);
                    for c in 0..4 {
                        worst.note((a[c] - b[c]).abs(), || {
                            format!("{key:?} {dx} {dy} level {level} {k}: {a:?} {b:?}")
                        });
                    }
                }
            }
        }
    }
    assert!(pairs >= 24, "{pairs}");
    // The same trees and densities, from places rounded differently: as against the CPU, twice half a step of values
    // under 1, and a ten-thousandth of a texel.
    worst.within(5e-4 + 4e-4, "gutters");
    gpu.close().unwrap();
}

#[test]
fn coverage_and_densities_are_those_of_the_trees() {
    let gpu = device::open();
    for density in [0.004, 0.03] {
        let scene = plain(450.0, [density, 0.0]);
        let frame = draw(&gpu, &scene, &above(&scene));
        let thickness = density * frame.crowns[0][1];
        let (mut mean, mut n) = (0.0, 0.0);
        for key in frame.tiles.keys() {
            let tile = frame.mean(key, |t| t[1]);
            assert!((tile / thickness - 1.0).abs() < 1.0 / 1024.0, "{key:?}: {tile} {thickness}");
            mean += frame.mean(key, |t| t[0]);
            n += 1.0;
        }
        mean /= n;
        let trees = density * 450.0 * 450.0;
        // An even pattern overlaps less than trees at random, 1 - exp(-x), and covers no more than its discs have, x. The
        // number of trees, and so both, varies by less than Poisson's root; a tenth of the discs' spread of area adds little.
        let room = 5.0 / trees.sqrt();
        println!(
            "density {density}: covered {mean}, at random {}, apart {thickness}",
            1.0 - (-thickness).exp()
        );
        assert!(mean > (1.0 - (-thickness).exp()) * (1.0 - room) && mean < thickness * (1.0 + room));
    }
    // On hills, with a map, limits and a list: the integral of each density is the number of trees, on either half.
    let mut scene = plain(450.0, [0.06, 0.0]);
    hills(&mut scene);
    let map = Raster { width: 9, height: 5, samples: (0..45).map(|k| (k * 7 % 11) as f32 / 10.0).collect() };
    if let Distribution::Density { map: m, between_heights, below_slope, .. } =
        &mut scene.species[0].distribution
    {
        (*m, *between_heights, *below_slope) = (Some(Arc::new(map)), Some([-20.0, 40.0]), Some(45.0));
    }
    let list = (0..4000u32).map(|k| {
        let random = |k: u32| f64::from(canopy::physics::hash::unit(canopy::physics::hash::hash(k)));
        // Three in four in the north.
        let y = if k % 4 == 0 { 0.0 } else { 225.0 } + 225.0 * random(k + 5000);
        TreePosition { x: 450.0 * random(k), y, scale: Some(1.0), rotation: None }
    });
    scene.species[1].distribution = Distribution::Positions(Arc::new(list.collect()));
    let frame = draw(&gpu, &scene, &above(&scene));
    let mut found = [[[0.0; 2]; 2]; 2];
    for key in frame.tiles.keys() {
        let (size, texel, low) = frame.layout(key);
        let gutter = COVER_GUTTER as usize;
        for k in 0..size * size {
            if (k % size).min(size - 1 - k % size).min(k / size).min(size - 1 - k / size) < gutter {
                continue;
            }
            let at = [low[0] + (k % size) as f64 * texel, low[1] + (k / size) as f64 * texel];
            for (species, found) in found.iter_mut().enumerate() {
                let trees = frame.tiles[key][0][k][1 + species] / frame.crowns[species][1] * texel * texel;
                (0..2).for_each(|axis| found[axis][usize::from(at[axis] >= 225.0 - 1e-9)] += trees);
            }
        }
    }
    for (species, axis, half) in (0..8).map(|k| (k & 1, k >> 1 & 1, k >> 2)) {
        let inside = |p: &[f64; 2]| usize::from(p[axis] >= 225.0) == half;
        let trees =
            frame.trees.iter().filter(|(p, s)| device::species(s) == species && inside(p)).count() as f64;
        let got = found[species][axis][half];
        println!("species {species} axis {axis} half {half}: {got:.0} of {trees}");
        // Thinned trees vary as a Poisson process at most. Listed ones are counted; but where the density jumps at the
        // middle, by 2000 trees in 225 m, the kernel (two hats of a cell of 28 m) lends 0.23 cells of it across, and at
        // random more or less by the root of as many trees as stand in a cell's width.
        let jump = if axis == 1 { 2000.0 / 225.0 * 28.3 * 0.233 } else { 0.0 };
        let room = if species == 0 {
            5.0 * trees.sqrt()
        } else {
            jump + 0.25 * (4000.0f64 / 450.0 * 28.3).sqrt() * 3.0
        };
        assert!((got - trees).abs() < room, "species {species}, axis {axis}, half {half}: {got} of {trees}");
    }
    gpu.close().unwrap();
}

#[test]
fn a_parent_is_the_mean_of_its_children() {
    let gpu = device::open();
    for (coverage_size, bound) in [(64.0, 5e-4), (256.0, 0.016)] {
        let mut scene = plain(450.0, [0.03, 0.02]);
        scene.settings.set("coverage_size", coverage_size).unwrap();
        let near = draw(&gpu, &scene, &from_height(&scene, 270.0));
        let far = draw(&gpu, &scene, &from_height(&scene, 1000.0));
        let (size, gutter) = (near.plan.coverage_size as usize, COVER_GUTTER as usize);
        let (inner, half) = (size - 2 * gutter, size / 2 - gutter);
        let (mut error, mut bias, mut n) = (0.0, 0.0, 0.0);
        for (key, child) in &near.tiles {
            let parent = &far.tiles[&QuadKey { level: key.level - 1, x: key.x / 2, y: key.y / 2 }];
            let corner = [key.x, key.y].map(|v| gutter + (v as usize & 1) * half);
            for (x, y) in (0..inner / 2).flat_map(|y| (0..inner / 2).map(move |x| (x, y))) {
                let c = child[1][(gutter / 2 + y) * (size / 2) + gutter / 2 + x];
                let p = parent[0][(corner[1] + y) * size + corner[0] + x];
                error += (c[0] - p[0]).abs();
                bias += c[0] - p[0];
                n += 1.0;
                (1..3).for_each(|k| assert!((c[k] - p[k]).abs() <= 2e-3 * c[k], "{key:?}: {c:?} {p:?}"));
            }
        }
        let (error, bias) = (error / n, bias / n);
        println!("{size} texels: mean difference {error:.2e}, bias {bias:.2e}, {} tiles", near.tiles.len());
        // With 64 texels both levels draw their discs on the same grid: what differs is rounding to half floats, twice. With
        // 256, an edge is a child's or a parent's texel wide: over a ring of a parent's texel around discs of 2.3, two in
        // three texels, the two differ by a few hundredths. Discs side by side share more of a parent's texels, each of
        // which the product leaves more open than they do: it covers a little less.
        assert!(error < bound && bias.abs() < 0.6 * bound, "{error} {bias}");
    }
    gpu.close().unwrap();
}

#[test]
fn nothing_jumps_when_quads_split() {
    let gpu = device::open();
    // No tree is drawn, no sun shines: what is seen is the ground as coverage darkens it, at a metre a pixel.
    let mut scene = plain(450.0, [0.02, 0.01]);
    scene.settings.set("zfield_min_pixels", 64.0).unwrap();
    scene.settings.set("ground_contrast", 1.0).unwrap();
    let frame = |height: f64| {
        let camera = Camera { vertical_fov: 30.0, ..from_height(&scene, height) };
        let mut renderer = device::renderer(&gpu, &scene, &camera, [480, 480], true);
        let report = renderer.render(&camera, 1.0).unwrap();
        assert_eq!(report.trees.camera, 0);
        (report.terrain_quads, renderer.picture().unwrap().linear.unwrap())
    };
    // Quads of 225 m split nearer than 3.5 sides.
    let split = MIN_REFINE * 225.0;
    let ((few, far), (many, near)) = (frame(split + 0.02), frame(split - 0.02));
    assert!(few == 4 && many > 4, "{few} quads, then {many}");
    let (mut worst, mut mean, mut spread) = (Worst::default(), 0.0, 0.0);
    for (k, (a, b)) in far.sky.iter().zip(&near.sky).enumerate() {
        let (a, b) = (f64::from(a[0]), f64::from(b[0]));
        worst.note((a / b - 1.0).abs(), || format!("pixel {k}: {a} {b}"));
        mean += a;
        spread += a * a;
    }
    let n = far.sky.len() as f64;
    let spread = (spread * n / (mean * mean) - 1.0).sqrt();
    println!("brightness varies by about {spread:.3}");
    // Ten times what a change may be.
    assert!(spread > 0.07, "there is nothing to jump");
    // Four centimetres of 787 m move the image's corner by 1/70 pixel, of five to a texel; contrast is at most one of
    // its mean a texel. Half floats: a step of 2^-10 at each of two frames and twice between texels.
    worst.within(1.0 / 70.0 / 5.0 * 2.0 + 4.0 / 1024.0, "change of brightness");
    gpu.close().unwrap();
}

/// A camera in a corner of a large plain sees quads of every level.
fn long_view() -> (Scene, Camera) {
    let mut scene = plain(4000.0, [0.01, 0.01]);
    scene.settings.set("zfield_min_pixels", 8.0).unwrap();
    (scene, device::camera([100.0, 100.0, 20.0], [600.0, 600.0, 0.0]))
}

#[test]
fn every_quad_finds_its_place_in_a_tile_also_with_few_slots() {
    let gpu = device::open();
    let (scene, camera) = long_view();
    let baked = device::bake(&scene);
    let mut finest = Vec::new();
    for slots in [0, 20, 6, 1] {
        let mut plan = Plan::new(&scene, &camera, SIZE, false, Some(gpu.info())).unwrap();
        plan.cover_slots = if slots > 0 { slots } else { plan.cover_slots };
        plan.list(&scene);
        let capacity = plan.cover_slots;
        let mut renderer = Renderer::new(&gpu, Arc::new(scene.clone()), plan, &baked).unwrap();
        let report = renderer.render(&camera, 1.0).unwrap();
        let (terrain, coverage) = (renderer.terrain(), &renderer.forest().unwrap().coverage);
        let quads: Vec<TerrainQuad> = gpu.read(&terrain.quads, 0, report.terrain_quads as usize).unwrap();
        let tree = &terrain.tree;
        let rows = &renderer.forest().unwrap().species.rows;
        let crowns: Vec<_> =
            rows.iter().map(|r| [f64::from(r.crown_radius), f64::from(r.mean_area)]).collect();
        let held: Vec<_> = keys(tree).filter_map(|k| coverage.layer(&k).map(|layer| (layer, k))).collect();
        assert!(held.len() as u32 == report.produced.coverage && report.produced.coverage <= capacity);
        let (size, gutter) = (f64::from(coverage.tiles.size()[0]), f64::from(COVER_GUTTER));
        for quad in &quads {
            let (_, key) =
                held.iter().find(|(layer, _)| *layer == quad.cover_layer).expect("a tile of this frame");
            let (own, side) =
                (tree.side(key.level), f64::from(quad.spacing) * tree.step() * f64::from(TERRAIN_CELLS));
            for corner in [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]] {
                for k in 0..2 {
                    let uv = f64::from(quad.cover_offset[k]) + corner[k] * f64::from(quad.cover_scale);
                    let place = (uv * size - gutter) / (size - 2.0 * gutter) * own
                        + f64::from([key.x, key.y][k]) * own;
                    let want = f64::from(quad.corner[k]) * tree.step() + corner[k] * side;
                    assert!(
                        (place - want).abs() < 1e-6 * 4000.0 + 1e-5 * own,
                        "{quad:?} {key:?}: {place} {want}"
                    );
                    assert!((gutter / size - 1e-6..=1.0 - gutter / size + 1e-6).contains(&uv), "{quad:?}");
                }
            }
            assert_eq!(
                quad.cover_floor == 1.0,
                own == side,
                "only a quad with a tile of its own fades to its parent's"
            );
            let texel = own / (size - 2.0 * gutter);
            let disc = mean_disc(&scene, &crowns) / (texel * texel);
            assert!((f64::from(quad.cover_disc) - disc.log2()).abs() < 1e-4, "{} {disc}", quad.cover_disc);
        }
        finest.push((capacity, held.len(), held.iter().map(|(_, k)| k.level).max().unwrap()));
    }
    println!("slots, tiles, finest level: {finest:?}");
    assert!(finest.windows(2).all(|w| w[1].2 < w[0].2), "fewer slots, coarser tiles: {finest:?}");
    assert_eq!(finest[3], (1, 1, 0));
    gpu.close().unwrap();
}

#[test]
fn tiles_stay_and_are_the_same_bits_when_they_come_back() {
    let gpu = device::open();
    let (scene, here) = long_view();
    let there = device::camera([3900.0, 3900.0, 20.0], [3400.0, 3400.0, 0.0]);
    let mut plan = Plan::new(&scene, &here, SIZE, false, Some(gpu.info())).unwrap();
    plan.cover_slots = 90;
    plan.list(&scene);
    let baked = device::bake(&scene);
    let mut renderer = Renderer::new(&gpu, Arc::new(scene.clone()), plan, &baked).unwrap();
    let mut visit = |camera: &Camera| {
        let produced = renderer.render(camera, 1.0).unwrap().produced.coverage;
        (produced, held(&gpu, &renderer))
    };
    let (first, tiles) = visit(&here);
    assert!(first > 20 && first as usize == tiles.len(), "{first}");
    assert_eq!(visit(&here), (0, tiles.clone()), "a second frame has all it needs");
    let elsewhere = visit(&there).0 + visit(&device::camera([3900.0, 100.0, 20.0], [3400.0, 600.0, 0.0])).0;
    let (again, same) = visit(&here);
    println!("{first} tiles here, {elsewhere} elsewhere, {again} again");
    assert!(again > 0, "nothing was evicted");
    assert!(tiles == same, "tiles changed");
    drop(renderer);
    // And in a fresh renderer, with slots for finer ones as well.
    let fresh = draw(&gpu, &scene, &here).bits;
    let common: Vec<_> = tiles.iter().filter(|(key, _)| fresh.contains_key(key)).collect();
    assert!(common.len() > 20, "{}", common.len());
    assert!(common.iter().all(|(key, levels)| fresh[key] == levels[0]), "a fresh renderer's differ");
    gpu.close().unwrap();
}

#[test]
fn without_trees_a_plain_is_one_quad_without_tiles() {
    let gpu = device::open();
    let (mut scene, camera) = long_view();
    let forest = draw(&gpu, &scene, &camera);
    assert!(forest.report.produced.coverage > 0 && forest.report.terrain_quads > 20);
    scene.species.clear();
    let mut renderer = device::renderer(&gpu, &scene, &camera, SIZE, false);
    let report = renderer.render(&camera, 1.0).unwrap();
    assert_eq!((report.terrain_quads, report.produced.coverage), (1, 0));
    assert_eq!(renderer.plan().terrain_tiles, 1);
    drop(renderer);
    gpu.close().unwrap();
}
