//! Seeds as the device produces them: where, how many, always the same.

use crate::device::{self, Worst};
use canopy::camera::Eye;
use canopy::frame::Renderer;
use canopy::gpu::Gpu;
use canopy::gpu::interface::{DrawCommand, Seed};
use canopy::land::candidate::{Layout, listed};
use canopy::physics::hash::{hash, unit};
use canopy::physics::raster::Raster;
use canopy::physics::terrain::height_and_slope;
use canopy::plan::Plan;
use canopy::scene::{Camera, Distribution, Scene, TreePosition};
use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

pub(super) const SIZE: [u32; 2] = [48, 48];

/// A level plain with two species, for everything to be seen from above.
pub(super) fn plain(side: f64, densities: [f64; 2]) -> Scene {
    let mut scene = device::small_scene(&format!(
        "seed = 9\n[terrain]\nextent = {side:?}\nalbedo = 0.2\n\
         [[species]]\nname = \"a\"\nmodel = \"builtin:birch\"\ndensity = {:?}\nscale = [0.9, 1.1]\n\
         [[species]]\nname = \"b\"\nmodel = \"builtin:birch\"\ndensity = {:?}\n\
         [sky]\nradiance = 0.1\n\
         [[camera]]\nname = \"c\"\nposition = [0.0, 0.0, 10.0]\ntarget = [9.0, 9.0, 5.0]\nvertical_fov = 50.0\n",
        densities[0], densities[1]
    ));
    scene.settings.set("zfield_min_pixels", 0.25).unwrap();
    scene
}

pub(super) fn hills(scene: &mut Scene) {
    let (width, height) = (31u32, 31);
    let samples = (0..width * height)
        .map(|k| (60.0 * (f64::from(k % width) * 0.4).sin() * (f64::from(k / width) * 0.3).cos()) as f32)
        .collect();
    scene.terrain.heights = Some(Raster { width, height, samples });
    scene.terrain.cell_size = scene.terrain.extent[0] / f64::from(width - 1);
}

/// From above the middle, the whole terrain in view.
pub(super) fn above(scene: &Scene) -> Camera {
    let [x, y] = scene.terrain.extent.map(|e| 0.5 * e);
    Camera { vertical_fov: 120.0, ..device::camera([x, y, 0.6 * scene.terrain.extent[0]], [x, y, 0.0]) }
}

/// The seeds of every visible quad, by the quad's column and row.
pub(super) fn seeds(gpu: &Gpu, scene: &Scene, renderer: &Renderer) -> BTreeMap<(i64, i64), Vec<Seed>> {
    let (forest, plan) = (renderer.forest().unwrap(), renderer.plan());
    let capacity = forest.seeds.region_capacity as usize;
    let counts: Vec<DrawCommand> = gpu.read(&forest.seeds.draws, 0, plan.seed_regions as usize).unwrap();
    let cell = if scene.terrain.heights.is_some() { scene.terrain.cell_size } else { plan.quad_side };
    let mut all = BTreeMap::new();
    for quad in &forest.seeds.visible_quads {
        let count = counts[quad.region as usize].index_count as usize / 6;
        let first = quad.region as usize * capacity * size_of::<Seed>();
        let index = [0, 1].map(|k| {
            let corner = (f64::from(quad.texel[k]) + f64::from(quad.texel_offset[k])) * cell;
            (corner / plan.quad_side).round() as i64
        });
        let old =
            all.insert((index[0], index[1]), gpu.read(&forest.seeds.seeds, first as u64, count).unwrap());
        assert!(old.is_none(), "quad {index:?} twice");
    }
    all
}

fn produce(gpu: &Gpu, scene: &Scene) -> (BTreeMap<(i64, i64), Vec<Seed>>, Plan) {
    let camera = above(scene);
    let mut renderer = device::renderer(gpu, scene, &camera, SIZE, false);
    renderer.render(&camera, 1.0).unwrap();
    let plan = renderer.plan().clone();
    let quads = scene.terrain.extent.map(|e| (e / plan.quad_side).ceil());
    let all = seeds(gpu, scene, &renderer);
    assert_eq!(all.len() as f64, quads[0] * quads[1], "every quad is in view");
    (all, plan)
}

/// Positions from the south-west corner of the terrain.
pub(super) fn positions(all: &BTreeMap<(i64, i64), Vec<Seed>>, side: f64) -> Vec<([f64; 2], Seed)> {
    all.iter()
        .flat_map(|((x, y), seeds)| {
            let corner = [*x as f64 * side, *y as f64 * side];
            seeds.iter().map(move |s| ([0, 1].map(|k| corner[k] + f64::from(s.position[k])), *s))
        })
        .collect()
}

#[test]
fn seeds_are_those_of_the_cpu() {
    let gpu = device::open();
    for with_hills in [false, true] {
        let mut scene = plain(450.0, [0.15, 0.05]);
        if with_hills {
            hills(&mut scene);
            if let Distribution::Density { below_slope, .. } = &mut scene.species[0].distribution {
                *below_slope = Some(45.0);
            }
        }
        let (all, plan) = produce(&gpu, &scene);
        let layout = Layout::new(&scene).unwrap();
        let (mut total, mut different) = (0, 0);
        for ((qx, qy), got) in &all {
            // In the same order.
            let want = layout.trees(&scene, [*qx as i32, *qy as i32], plan.tiles_per_quad as i32);
            total += got.len();
            let mut by_identity: HashMap<u32, &Seed> = got.iter().map(|s| (s.identity, s)).collect();
            for tree in &want {
                let Some(seed) = by_identity.remove(&tree.identity) else {
                    different += 1;
                    continue;
                };
                assert_eq!(seed.position, tree.position, "quad {qx}, {qy}");
                assert_eq!(seed.turn_tint, tree.turn_tint);
                assert!((seed.scale - tree.scale).abs() <= 2.0 * f32::EPSILON * tree.scale);
                assert!(
                    (f64::from(seed.ground) - tree.ground).abs() < 1e-3,
                    "{} {}",
                    seed.ground,
                    tree.ground
                );
                different += usize::from(device::species(seed) != tree.species as usize);
            }
            different += by_identity.len();
            if !with_hills {
                let order = |s: &Seed| s.identity;
                assert!(got.iter().map(order).eq(want.iter().map(|t| t.identity)), "quad {qx}, {qy}");
            }
        }
        println!("hills: {with_hills}: {total} seeds in {} quads, {different} different", all.len());
        assert!(all.len() >= 9 && total > if with_hills { 15_000 } else { 30_000 });
        // Densities that are equal everywhere have the same bits. On slopes they round differently: by 1e-5, as measured
        // below, which moves the choice of one tree in 10,000.
        assert!(different <= if with_hills { total / 3000 } else { 0 }, "{different} of {total}");
    }
    gpu.close().unwrap();
}

#[test]
fn no_two_seeds_are_nearer_than_the_pattern_allows_across_quads_too() {
    let gpu = device::open();
    let scene = plain(450.0, [0.2, 0.0]);
    let (all, plan) = produce(&gpu, &scene);
    let points = positions(&all, plan.quad_side);
    let radius = plan.pattern.as_ref().unwrap().distance * plan.tile_side;
    let cell = |p: &[f64; 2]| p.map(|v| (v / radius).floor() as i64);
    let mut grid: HashMap<[i64; 2], Vec<usize>> = HashMap::new();
    for (k, (p, _)) in points.iter().enumerate() {
        grid.entry(cell(p)).or_default().push(k);
    }
    let (mut nearest, mut across) = (f64::INFINITY, 0);
    for (k, (p, _)) in points.iter().enumerate() {
        let [cx, cy] = cell(p);
        for (x, y) in (-1..=1).flat_map(|i| (-1..=1).map(move |j| (cx + i, cy + j))) {
            for other in grid.get(&[x, y]).into_iter().flatten().filter(|o| **o < k) {
                let q = points[*other].0;
                nearest = nearest.min((p[0] - q[0]).hypot(p[1] - q[1]));
                let quad = |p: &[f64; 2]| p.map(|v| (v / plan.quad_side).floor() as i64);
                across += usize::from(quad(p) != quad(&q));
            }
        }
    }
    println!("{} seeds, nearest {nearest} m, radius {radius} m, {across} pairs across quads", points.len());
    assert!(across > 100);
    // Positions are singles from the quad's corner: two ulps of its side.
    assert!(nearest >= radius - 4.0 * 6e-8 * plan.quad_side, "{nearest} {radius}");
    gpu.close().unwrap();
}

fn smoothstep(low: f64, high: f64, v: f64) -> f64 {
    let t = ((v - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

#[test]
fn as_many_seeds_as_the_density_says() {
    let gpu = device::open();
    let mut scene = plain(450.0, [0.12, 0.08]);
    hills(&mut scene);
    let map = Arc::new(Raster {
        width: 9,
        height: 5,
        samples: (0..45).map(|k| (k * 7 % 11) as f32 / 10.0).collect(),
    });
    if let Distribution::Density { map: m, between_heights, below_slope, .. } =
        &mut scene.species[0].distribution
    {
        (*m, *between_heights, *below_slope) = (Some(map.clone()), Some([-20.0, 40.0]), Some(45.0));
    }
    let heights = scene.terrain.heights.clone().unwrap();
    let (cell, side, n) = (scene.terrain.cell_size, scene.terrain.extent[0], 900);
    // Height and slopes of the ground, and the density of either species.
    let asked = |x: f64, y: f64| {
        let [h, sx, sy] = height_and_slope(&heights, x / cell, y / cell);
        let (sx, sy) = (sx / cell, sy / cell);
        let slope = sx.hypot(sy);
        let sample = |a: f64, b: f64| {
            let at = |v: f64, n: u32| v.clamp(0.0, f64::from(n - 1)) as usize;
            f64::from(map.samples[at(b, 5) * 9 + at(a, 9)])
        };
        let (tx, ty) = (x / side * 9.0 - 0.5, y / side * 5.0 - 0.5);
        let (fx, fy) = (tx - tx.floor(), ty - ty.floor());
        let (tx, ty) = (tx.floor(), ty.floor());
        let m = (sample(tx, ty) * (1.0 - fx) + sample(tx + 1.0, ty) * fx) * (1.0 - fy)
            + (sample(tx, ty + 1.0) * (1.0 - fx) + sample(tx + 1.0, ty + 1.0) * fx) * fy;
        let t = 45f64.to_radians().tan();
        let first = 0.12
            * m
            * smoothstep(-26.0, -14.0, h)
            * (1.0 - smoothstep(34.0, 46.0, h))
            * (1.0 - smoothstep(t - t / 6.0, t + t / 6.0, slope));
        ([h, sx, sy], [first, 0.08])
    };
    // The densities' integrals by the midpoint rule, and over two halves, so that a mirrored map is seen.
    let mut expected = [[0.0; 2]; 2];
    for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
        let [x, y] = [i, j].map(|k| (f64::from(k) + 0.5) * side / f64::from(n));
        let (_, densities) = asked(x, y);
        let area = (side / f64::from(n)).powi(2);
        expected[0][usize::from(i >= n / 2)] += densities[0] * area;
        expected[1][usize::from(j >= n / 2)] += densities[1] * area;
    }
    // Several seeds of the scene: single counts, and their sum, in which a small bias would show.
    let (mut found, mut points) = ([[0.0; 2]; 2], Vec::new());
    for seed in 9..13 {
        scene.seed = seed;
        let (all, plan) = produce(&gpu, &scene);
        points = positions(&all, plan.quad_side);
        for species in 0..2 {
            for half in 0..2 {
                let inside = |p: &[f64; 2]| usize::from(p[species] >= 0.5 * side) == half;
                let count =
                    points.iter().filter(|(p, s)| device::species(s) == species && inside(p)).count() as f64;
                let want: f64 = expected[species][half];
                found[species][half] += count;
                // Thinning an even pattern varies less than a Poisson process, whose variance is its mean: five sigma.
                assert!(
                    (count - want).abs() < 5.0 * want.sqrt(),
                    "seed {seed}, species {species}: {count} of {want}"
                );
            }
        }
    }
    for (species, half) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
        let (found, want) = (found[species][half], 4.0 * expected[species][half]);
        println!("species {species} half {half}: {found} of {want:.1}");
        // Of the second species every point has the chance 0.08 / 0.2 to stay: 1 - 0.4 of Poisson's variance. The pattern
        // itself is even to a few points along the borders of a half: 0.2 %.
        let variance = if species == 1 { 0.6 * want } else { want };
        let room = 5.0 * variance.sqrt() + 0.002 * want;
        assert!(
            (found - want).abs() < room,
            "species {species} half {half}: {found} of {want}, within {room}"
        );
    }
    let (mut slopes, mut densities) = (Worst::default(), Worst::default());
    for (p, s) in &points {
        assert!(p.iter().all(|v| (-1e-4..=side + 1e-4).contains(v)), "{p:?} is outside");
        // Bicubic heights up to 60 m in singles, at a place known to a few ulp of the quad's side: slopes below 2.
        let ([want, sx, sy], each) = asked(p[0], p[1]);
        assert!((f64::from(s.ground) - want).abs() < 1e-3, "{p:?}: ground at {} {want}", s.ground);
        let range = [[0.9, 1.1], [1.0, 1.0]][device::species(s)];
        assert!((range[0]..=range[1]).contains(&s.scale), "{}", s.scale);
        let half = |bits: u32| f64::from(half::f16::from_bits(bits as u16).to_f32());
        // Half floats are within 2^-11; a place off by 1e-4 m moves a slope by its curvature, at most 0.4^2 60 m in cells of
        // 15 m squared: 4e-6.
        for (got, want) in [(half(s.slope), sx), (half(s.slope >> 16), sy)] {
            slopes.note((got - want).abs() - want.abs() / 2048.0, || format!("{p:?}: slope {got} {want}"));
        }
        // The root of the density at which trees of the seed's species would cover what all do: areas are as the mean squares of
        // scales, uniform from 0.9 to 1.1 and 1. Where limits are steep, 6 m of height and 0.17 of slope wide, 1e-3 m and
        // 1e-5 of slope are 3e-4 and 1e-4 of a density of 0.12; the root at its least, 0.08, doubles that over 0.57.
        let areas = [1.0 + 0.2 * 0.2 / 12.0, 1.0];
        let covered = each[0] * areas[0] + each[1] * areas[1];
        let (got, want) = (half(s.species_density >> 16), (covered / areas[device::species(s)]).sqrt());
        densities.note((got - want).abs() - want / 2048.0, || format!("{p:?}: density {got} {want}"));
    }
    slopes.within(1e-5, "slopes beyond rounding");
    densities.within(1e-4, "densities beyond rounding");
    gpu.close().unwrap();
}

#[test]
fn a_quad_has_the_same_seeds_when_it_is_produced_again() {
    let gpu = device::open();
    let mut scene = plain(2000.0, [0.02, 0.01]);
    scene.settings.set("zfield_min_pixels", 2.0).unwrap();
    let here = device::camera([300.0, 300.0, 20.0], [350.0, 350.0, 0.0]);
    let mut plan = Plan::new(&scene, &here, SIZE, false, Some(gpu.info())).unwrap();
    plan.seed_regions = 20;
    plan.list(&scene);
    let baked = device::bake(&scene);
    let mut renderer = Renderer::new(&gpu, Arc::new(scene.clone()), plan, &baked).unwrap();
    let mut visit = |camera: &Camera| {
        renderer.render_eye(&Eye::new(camera, &scene.terrain, SIZE), 1.0).unwrap();
        (seeds(&gpu, &scene, &renderer), renderer.forest().unwrap().seeds.visible_quads.clone())
    };
    let (first, quads) = visit(&here);
    let mut seen: std::collections::BTreeSet<_> = first.keys().copied().collect();
    for (x, y) in [300.0, 1000.0, 1700.0].into_iter().flat_map(|x| [300.0, 1000.0, 1700.0].map(|y| (x, y))) {
        let place = device::camera([x, y, 20.0], [x + 50.0, y - 50.0, 0.0]);
        seen.extend(visit(&place).0.keys().copied());
    }
    let (again, quads_again) = visit(&here);
    println!("{} quads here, {} in all places, 20 regions", first.len(), seen.len());
    assert!(seen.len() > 20, "nothing was evicted: {}", seen.len());
    let regions = |q: &[canopy::gpu::interface::SeedQuad]| q.iter().map(|q| q.region).collect::<Vec<_>>();
    assert_ne!(regions(&quads), regions(&quads_again), "the quads never left their regions");
    assert!(first.values().map(Vec::len).sum::<usize>() > 100);
    assert_eq!(first, again);
    drop(renderer);
    gpu.close().unwrap();
}

/// All over a terrain of this side, and on every border and corner of it exactly.
fn list(side: f64) -> Vec<TreePosition> {
    let mut list: Vec<TreePosition> = (0..3000u32)
        .map(|k| TreePosition {
            x: side * f64::from(unit(hash(k))),
            y: side * f64::from(unit(hash(k + 70_000))),
            scale: k.is_multiple_of(2).then_some(0.3 + 0.001 * k as f32),
            rotation: k.is_multiple_of(3).then_some(k as f32 * 0.731 - 900.0),
        })
        .collect();
    for k in 0..=90 {
        let v = side * f64::from(k) / 90.0;
        for (x, y) in [(v, 0.0), (v, side), (0.0, v), (side, v)] {
            list.push(TreePosition { x, y, scale: Some(1.0), rotation: Some(0.0) });
        }
    }
    list
}

/// A side of a terrain whose far border lies, in singles from the last quad's corner, outside of it.
fn awkward_side() -> f64 {
    (0..500)
        .map(|k| 300.0 + 0.37 * f64::from(k))
        .find(|side| {
            let mut scene = plain(*side, [0.0, 0.0]);
            scene.species[0].distribution = Distribution::Positions(Arc::new(list(*side)));
            let plan = Plan::new(&scene, &above(&scene), SIZE, false, None).unwrap();
            let last = (side / plan.quad_side).ceil() - 1.0;
            let position = (side - last * plan.quad_side) as f32;
            last as f32 * plan.quad_side as f32 + position > *side as f32
        })
        .expect("one in eight is")
}

#[test]
fn listed_trees_stand_where_the_list_says() {
    let gpu = device::open();
    for (with_hills, side) in [(false, 450.0), (true, 450.0), (false, awkward_side()), (true, 417.13)] {
        let mut scene = plain(side, [0.0, 0.0]);
        if with_hills {
            hills(&mut scene);
        }
        let list = list(side);
        scene.species[0].distribution = Distribution::Positions(Arc::new(list.clone()));
        let (all, plan) = produce(&gpu, &scene);
        let mut found: HashMap<u32, ([f64; 2], Seed)> = HashMap::new();
        for (p, s) in positions(&all, plan.quad_side) {
            assert!(found.insert(s.identity, (p, s)).is_none(), "two trees of one identity");
        }
        assert_eq!(found.len(), list.len(), "hills: {with_hills}");
        for (k, tree) in list.iter().enumerate() {
            let twin = listed(&scene, 0, k as u32, tree);
            let id = twin.identity;
            let (p, s) =
                found.get(&id).unwrap_or_else(|| panic!("tree {k} at {}, {} is lost", tree.x, tree.y));
            assert_eq!((s.turn_tint, s.scale.to_bits()), (twin.turn_tint, twin.scale.to_bits()), "tree {k}");
            // Half an ulp of a position in the quad.
            let room = 6e-8 * plan.quad_side;
            assert!((p[0] - tree.x).abs() <= room && (p[1] - tree.y).abs() <= room, "{p:?} {tree:?}");
            match tree.scale {
                Some(scale) => assert_eq!(s.scale, scale),
                None => assert!((0.9..=1.1).contains(&s.scale)),
            }
            if let Some(degrees) = tree.rotation {
                let turn = f64::from(s.turn_tint & 0xffff) / 65536.0;
                let off = (turn - f64::from(degrees) / 360.0).rem_euclid(1.0);
                // A step of 1/65536, cut; and the degrees as single.
                assert!(!(1e-6..=1.0 - 1.1 / 65536.0).contains(&off), "{degrees}: {turn}");
            }
            let want = scene.terrain.height_at(tree.x, tree.y);
            assert!((f64::from(s.ground) - want).abs() < 1e-3, "{tree:?}: ground at {} {want}", s.ground);
        }
    }
    gpu.close().unwrap();
}
