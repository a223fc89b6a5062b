//! Tables of far forests against closed forms for opaque spheres, and what holds for all tables.

mod common;

use std::cell::Cell;
use std::f64::consts::PI;
use std::fs;
use std::sync::OnceLock;

use canopy::bake::tables::{
    Cast, CrownModel, FieldCrown, ForestSettings, LeafOptics, Seen, key, load_or_measure, measure,
    measure_species, path,
};
use canopy::bake::{BakeSettings, CacheState, SpeciesBake, bake_species};
use canopy::physics::correction::Correction;
use canopy::physics::crown::{Crown, Frame};
use canopy::physics::forest::{Known, forest};
use canopy::physics::tables::ForestTables;
use canopy::physics::{light, tables, views, zfield};
use glam::DVec3;

/// An opaque sphere: BN12's crown, of which everything is known.
struct Sphere(Crown, LeafOptics);

impl Sphere {
    fn new(radius: f32, centre: f32) -> Self {
        let crown = Crown {
            frame: Frame { centre, half_width: radius, half_height: radius },
            radius,
            base: centre - radius,
            height: centre + radius,
            leaf_shadow: 0.0,
            extinction: 1.0,
            lit: Correction::default(),
            sent: Correction::default(),
        };
        Sphere(crown, LeafOptics { scattered: [0.12, 0.06], turning: 0.0, albedo: 0.18 })
    }

    fn depth(a: f32, b: f32) -> Option<f32> {
        let square = 1.0 - a * a - b * b;
        (square > 0.0).then(|| square.sqrt())
    }
}

impl CrownModel for Sphere {
    type Aim = ();

    fn crown(&self) -> &Crown {
        &self.0
    }

    fn leaf(&self) -> &LeafOptics {
        &self.1
    }

    fn aim(&self, _: f64, _: f64) {}

    fn seen(&self, (): &(), a: f32, b: f32) -> Seen {
        Sphere::depth(a, b).map_or(Seen::default(), |depth| Seen { alpha: 1.0, depth, occlusion: 1.0 })
    }

    fn cast(&self, (): &(), a: f32, b: f32) -> Cast {
        Sphere::depth(a, b).map_or(Cast::default(), |depth| Cast { alpha: 1.0, back: -depth, front: depth })
    }

    fn entry(&self, (): &(), a: f32, b: f32) -> Option<f32> {
        Some(Sphere::depth(a, b).unwrap_or(0.0))
    }
}

const SMALL: ForestSettings = ForestSettings {
    angles: 5,
    densities: 4,
    rays: 16384,
    pattern_density: 0.03,
    scale_range: [1.0, 1.0],
    poisson: true,
    hole_radius: 0.0,
    light_iterations: 1,
    view_iterations: 2,
};

/// Spheres of radius 3 m, 5 m up.
fn spheres() -> &'static ForestTables {
    static TABLES: OnceLock<ForestTables> = OnceLock::new();
    TABLES.get_or_init(|| measure(&Sphere::new(3.0, 5.0), &SMALL, true).unwrap())
}

fn ellipsoids() -> &'static SpeciesBake {
    static BAKE: OnceLock<SpeciesBake> = OnceLock::new();
    BAKE.get_or_init(|| {
        let settings = BakeSettings {
            rings: 6,
            resolution: 64,
            occlusion_rays: 8,
            transfer_bands: 0,
            transfer_resolution: 32,
        };
        bake_species(&common::ellipsoid(2.0, 4.0, 24), &Default::default(), &settings, true).unwrap()
    })
}

const TINY: ForestSettings =
    ForestSettings { angles: 4, densities: 3, rays: 128, scale_range: [0.8, 1.2], poisson: false, ..SMALL };

/// Stands for the key of what a species is baked from.
const SOURCE: [u8; 32] = [7; 32];

fn tiny() -> &'static ForestTables {
    static TABLES: OnceLock<ForestTables> = OnceLock::new();
    TABLES.get_or_init(|| measure_species(ellipsoids(), &TINY, true).unwrap())
}

/// Overlap of the shadows of a sphere of radius r at height h: on level ground, from directions at zenith angles θ_v, θ_l and
/// azimuths 0, φ, by the midpoint rule.
fn overlap(r: f64, h: f64, theta_v: f64, theta_l: f64, phi: f64) -> f64 {
    let inside = |x: f64, y: f64, theta: f64, azimuth: f64| {
        let (s, c) = azimuth.sin_cos();
        // The shadow's centre lies h tan θ away; it is r across and r sec θ along.
        let along = (x * c + y * s + h * theta.tan()) * theta.cos();
        let across = y * c - x * s;
        along * along + across * across < r * r
    };
    let (n, reach) = (600, r / theta_v.cos());
    let mut sum = 0usize;
    for i in 0..n {
        for j in 0..n {
            let x = reach * (2.0 * (i as f64 + 0.5) / n as f64 - 1.0) - h * theta_v.tan();
            let y = r * (2.0 * (j as f64 + 0.5) / n as f64 - 1.0);
            sum += usize::from(inside(x, y, theta_v, 0.0) && inside(x, y, theta_l, phi));
        }
    }
    sum as f64 * 4.0 * reach * r / (n * n) as f64
}

#[test]
fn ground_under_poisson_spheres_is_the_closed_form() {
    let t = spheres();
    let (n, m) = (t.angles as usize, t.densities as usize);
    let (r, h) = (3.0, 5.0);
    let area = PI * r * r;
    assert!((f64::from(t.area) - area).abs() < 1e-4 && (t.vertical_scale - 1.0).abs() < 1e-6);
    let mut worst = [0f64; 4];
    let mut compare =
        |kind: usize, measured: f64, exact: f64| worst[kind] = worst[kind].max((measured - exact).abs());
    for j in 0..m {
        let x = tables::density_node(m, j, f64::from(t.max_thickness));
        let [d, c] = tables::ground(t, x);
        compare(0, d, light::ground_visibility(x));
        compare(1, c, 1.0 - (-x).exp());
        for i in 0..n {
            let v = tables::zenith_node(n, i);
            let visible = tables::visible_ground(t, v, x);
            compare(2, visible, (-x * tables::secant(v)).exp());
            for j in 0..n {
                let l = tables::light_node(n, j, v);
                for k in 0..n {
                    let phi = tables::azimuth_node(n, k);
                    let path = tables::secant(v) + tables::secant(l);
                    let exact = (-x * (path - overlap(r, h, v, l, phi) / area)).exp();
                    compare(3, tables::joint_ground(t, v, l, phi, x), exact);
                }
            }
            // On the ridge, what is seen is lit.
            let joint = tables::joint_ground(t, v, v, 0.0, x);
            assert!((joint - visible).abs() < 1e-3, "{joint} {visible}");
            let w = tables::pair(t, v, v, 0.0, 0.0)[0];
            assert!((w - 0.5).abs() < 0.01, "W on the ridge: {w}");
        }
    }
    println!("largest errors of D, C, P, G: {worst:?}");
    assert!(worst.iter().all(|e| *e < 0.01), "D, C, P, G: {worst:?}");
}

/// What is visible of the ground under Poisson spheres sees more of the sky than the rest: D_v = ∫ exp(−x (sec θ_l − overlap / A))
/// cos θ_l dl / π. Sixteen nodes an angle follow the overlap to a hundredth (five to three); without it D_v is D,
/// up to 0.1 less.
#[test]
fn sky_on_visible_ground_under_poisson_spheres_is_the_integral() {
    let forest = ForestSettings { angles: 16, rays: 4096, ..SMALL };
    let t = &measure(&Sphere::new(3.0, 5.0), &forest, true).unwrap();
    let (r, h, count) = (3.0, 5.0, 20);
    for (i, j) in [(0, 2), (0, 3), (7, 2), (7, 3)] {
        let v = tables::zenith_node(t.angles as usize, i);
        let x = tables::density_node(t.densities as usize, j, f64::from(t.max_thickness));
        let mut sum = 0.0;
        for k in 0..count * count {
            // cos² is uniform over a cosine-weighted hemisphere.
            let l = ((f64::from(k / count) + 0.5) / f64::from(count)).sqrt().acos();
            let phi = PI * (f64::from(k % count) + 0.5) / f64::from(count);
            sum += (-x * (tables::secant(l) - overlap(r, h, v, l, phi) / (PI * r * r))).exp();
        }
        let (want, got) = (sum / f64::from(count * count), tables::seen_sky(t, v, x));
        println!("{v:.2} {x}: D_v {got:.3}, exactly {want:.3}; D {:.3}", light::ground_visibility(x));
        assert!((got - want).abs() < 0.01, "{v} {x}: {got} {want}");
        assert!(want > light::ground_visibility(x) + 0.03, "nothing to tell apart: {want}");
    }
}

/// On the ridge all that is seen of opaque crowns is lit; T of a lone sphere elsewhere by integration over its visible half.
#[test]
fn light_on_spheres_is_the_closed_form() {
    let t = spheres();
    let n = t.angles as usize;
    for i in 0..n {
        let v = tables::zenith_node(n, i);
        for x in [0.0, 0.2, 0.5] {
            let [leaf, bark, _] = tables::light(t, v, v, 0.0, x);
            assert!((leaf + bark - 1.0).abs() < 0.01, "{leaf} + {bark} at {v}, {x}");
        }
        for k in 0..n {
            // Light from beside: exp(−τ s) with s the way through the sphere, over the visible disc.
            let (l, phi) = (v, tables::azimuth_node(n, k));
            let direction =
                |theta: f64, a: f64| DVec3::new(theta.sin() * a.cos(), theta.sin() * a.sin(), theta.cos());
            let basis = views::Basis::new(direction(v, 0.0));
            let to = direction(l, phi);
            let (mut sum, mut count, steps) = (0.0, 0.0, 200);
            for p in (0..steps * steps).map(|k| [k % steps, k / steps]) {
                let [a, b] = p.map(|k| 2.0 * (f64::from(k) + 0.5) / f64::from(steps) - 1.0);
                if a * a + b * b < 1.0 {
                    let at = a * basis.right + b * basis.up + (1.0 - a * a - b * b).sqrt() * basis.w;
                    sum += (-3.0 * (-2.0 * at.dot(to)).max(0.0)).exp();
                    count += 1.0;
                }
            }
            let [leaf, bark, _] = tables::light(t, v, l, phi, 0.0);
            let expected = sum / count;
            assert!((leaf + bark - expected).abs() < 0.03, "T at {v}, {phi}: {} {expected}", leaf + bark);
        }
    }
}

/// E and Γ_v of Poisson spheres: the more they are, the less of the sky each has. Visible ground that no disc covers is met by neither of two shadows, one of them straight down.
#[test]
fn sky_and_coverage_of_spheres_are_the_closed_form() {
    // The sky is many suns: five angles would leave 58 degrees between two of them, and E 9 % off; scenes have sixteen.
    let forest = ForestSettings { angles: 14, rays: 4096, ..SMALL };
    let t = &measure(&Sphere::new(3.0, 5.0), &forest, true).unwrap();
    let (n, m) = (t.angles as usize, t.densities as usize);
    let (r, h) = (3.0, 5.0);
    let area = PI * r * r;
    for j in 0..m {
        let x = tables::density_node(m, j, f64::from(t.max_thickness));
        for i in 0..n {
            let v = tables::zenith_node(n, i);
            let [_, leaf, bark, coverage] = tables::view(t, v, x);
            let [_, sparser, bark_sparser, _] = tables::view(t, v, 0.5 * x);
            // At grazing angles more trees leave less but the tops to be seen.
            assert!(
                leaf + bark <= sparser + bark_sparser + 0.005 || v > 1.0,
                "E at {x}, {v}: {} after {}",
                leaf + bark,
                sparser + bark_sparser
            );
            let exact = 1.0 - (-x * (1.0 - overlap(r, h, v, 0.0, 0.0) / area)).exp();
            // Known only as far as ground is seen.
            let seen = tables::visible_ground(t, v, x);
            assert!((coverage - exact).abs() * seen < 0.01, "coverage at {x}, {v}: {coverage} {exact}");
        }
    }
}

/// Spheres all of whose surface is lit scatter the sky, by themselves, as free leaves of uniform orientation do.
#[test]
fn sky_on_free_spheres_is_the_closed_form() {
    let mut sphere = Sphere::new(3.0, 5.0);
    sphere.0.extinction = 0.0;
    let forest = ForestSettings { densities: 2, rays: 1024, ..SMALL };
    let t = measure(&sphere, &forest, true).unwrap();
    for i in 0..forest.angles as usize {
        let v = tables::zenith_node(forest.angles as usize, i);
        let [_, leaf, bark, _] = tables::view(&t, v, 0.0);
        // Midpoints of 16 by 16 suns.
        let free = 1.0 + 2.0 / 3.0 * (0.12 - 0.06) / 0.18 * v.cos();
        assert!((leaf + bark - free).abs() < 2e-3, "E at {v}: {} {free}", leaf + bark);
    }
    // Near trees get the same: nothing of a single sphere is in a hole, and all of it sees the sky.
    for i in 0..forest.angles as usize {
        let v = tables::zenith_node(forest.angles as usize, i);
        let free = 1.0 + 2.0 / 9.0 * v.cos();
        assert!(
            (tables::near_sky(&t, v, 0.0) - free).abs() < 2e-3,
            "{v}: {} {free}",
            tables::near_sky(&t, v, 0.0)
        );
    }
}

fn sound(t: &ForestTables) {
    let (n, m) = (t.angles as usize, t.densities as usize);
    assert_eq!((t.pair.len(), t.view.len(), t.ground.len()), (m * n * n * n, m * n, m));
    assert_eq!((t.pair_stderr.len(), t.view_stderr.len(), t.ground_stderr.len()), (m * n * n * n, m * n, m));
    let finite = |x: &f32| x.is_finite() && *x >= 0.0;
    assert!(t.pair.as_flattened().iter().chain(t.pair_stderr.as_flattened()).all(finite));
    assert!(t.view.as_flattened().iter().chain(t.view_stderr.as_flattened()).all(finite));
    assert!(t.ground.as_flattened().iter().chain(t.ground_stderr.as_flattened()).all(finite));
    assert_eq!((t.seen_sky.len(), t.near_sky.len()), (m * n, m * n));
    assert!(t.seen_sky.iter().chain(&t.near_sky).all(finite) && t.seen_sky.iter().all(|d| *d <= 1.0));
    for xi in 0..m {
        let x = tables::density_node(m, xi, f64::from(t.max_thickness));
        for v in 0..n {
            let [vv, leaf, bark, coverage] = t.view[xi * n + v];
            assert!(vv > 0.0 && leaf + bark <= 5.0 / 3.0 && coverage <= 1.0, "{vv} {leaf} {bark} {coverage}");
            let sec_v = tables::secant(tables::zenith_node(n, v));
            for l in 0..n {
                let sec_l = tables::secant(tables::light_node(n, l, tables::zenith_node(n, v)));
                for k in 0..n {
                    let at = |x: usize| t.pair[((x * n + v) * n + l) * n + k];
                    let [w, _, _, transfer] = at(xi);
                    let [theta_v, phi] = [tables::zenith_node(n, v), tables::azimuth_node(n, k)];
                    let [leaf, bark, _] =
                        tables::light(t, theta_v, tables::light_node(n, l, theta_v), phi, x);
                    assert!(w > 0.0 && leaf + bark <= 1.0 + 1e-6, "{w} {leaf} {bark}");
                    assert!(transfer > 0.0 && transfer < 4.0, "{transfer}");
                    let (path, view) = (f64::from(w) * (sec_v + sec_l), f64::from(vv) * sec_v);
                    assert!(path >= view * (1.0 - 1e-6), "k_g > P at {xi}, {v}, {l}, {k}");
                    if xi > 0 {
                        let before = f64::from(at(xi - 1)[0])
                            * tables::density_node(m, xi - 1, f64::from(t.max_thickness));
                        assert!(f64::from(w) * x >= before * (1.0 - 1e-6), "G rises with the density");
                    }
                }
            }
        }
    }
}

#[test]
fn tables_are_sound() {
    sound(spheres());
    sound(tiny());
    // So sparse that hardly a ray meets a tree, and so dense that none gets through.
    for pattern_density in [1e-7, 3.0] {
        let forest = ForestSettings { pattern_density, rays: 32, ..TINY };
        sound(&measure_species(ellipsoids(), &forest, true).unwrap());
    }
    let still = ForestSettings { light_iterations: 0, view_iterations: 1, rays: 32, densities: 9, ..TINY };
    sound(&measure_species(ellipsoids(), &still, true).unwrap());
}

#[test]
fn settings_out_of_range_are_refused() {
    for forest in [
        ForestSettings { angles: 3, ..TINY },
        ForestSettings { densities: 17, ..TINY },
        ForestSettings { rays: 0, ..TINY },
        ForestSettings { pattern_density: 0.0, ..TINY },
        ForestSettings { pattern_density: f64::NAN, ..TINY },
        ForestSettings { scale_range: [1.0, 0.5], ..TINY },
        ForestSettings { scale_range: [1.0, f32::NAN], ..TINY },
        ForestSettings { view_iterations: 0, ..TINY },
    ] {
        assert!(measure_species(ellipsoids(), &forest, true).is_err(), "{forest:?}");
        let never = || -> canopy::Result<&SpeciesBake> { panic!("{forest:?} asked for a species") };
        assert!(load_or_measure((None, &SOURCE), &forest, never, true).is_err(), "{forest:?}");
    }
}

#[test]
fn any_number_of_threads_measures_the_same_bits() {
    for threads in [1, 3] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let again = pool.install(|| measure_species(ellipsoids(), &TINY, true).unwrap());
        assert!(again == *tiny(), "{threads} threads");
    }
}

#[test]
fn tables_come_back_from_the_cache_and_damage_does_not() {
    let dir = tempfile::tempdir().unwrap();
    let asked = Cell::new(0);
    let get = || {
        let species = || {
            asked.set(asked.get() + 1);
            Ok(ellipsoids())
        };
        load_or_measure((Some(dir.path()), &SOURCE), &TINY, species, true).unwrap()
    };
    assert!(get() == (tiny().clone(), CacheState::Baked));
    assert!(get() == (tiny().clone(), CacheState::Hit));
    assert_eq!(asked.get(), 1, "tables from the cache need no species");
    let file = path(dir.path(), &key(&SOURCE, &TINY));
    let whole = fs::read(&file).unwrap();
    for at in [0, 9, 20, 50, whole.len() / 2, whole.len() - 1] {
        let mut bytes = whole.clone();
        bytes[at] ^= 4;
        fs::write(&file, bytes).unwrap();
        assert!(get() == (tiny().clone(), CacheState::Rebuilt), "bit at {at}");
    }
    fs::write(&file, &whole[..whole.len() - 1]).unwrap();
    assert_eq!(get().1, CacheState::Rebuilt);
    assert!(fs::read(&file).unwrap() == whole);
}

#[test]
fn everything_that_tables_depend_on_is_in_the_key() {
    let mut other = SOURCE;
    other[31] ^= 1;
    let mut keys = vec![key(&SOURCE, &TINY), key(&other, &TINY)];
    for forest in [
        ForestSettings { angles: 5, ..TINY },
        ForestSettings { densities: 4, ..TINY },
        ForestSettings { rays: 129, ..TINY },
        ForestSettings { pattern_density: 0.031, ..TINY },
        ForestSettings { scale_range: [0.8, 1.3], ..TINY },
        ForestSettings { poisson: true, ..TINY },
        ForestSettings { hole_radius: 0.6, ..TINY },
        ForestSettings { light_iterations: 2, ..TINY },
        ForestSettings { view_iterations: 3, ..TINY },
    ] {
        keys.push(key(&SOURCE, &forest));
    }
    let count = keys.len();
    keys.sort_unstable();
    keys.dedup();
    assert_eq!(keys.len(), count);
}

#[test]
fn nodes_are_reproduced() {
    let t = tiny();
    let (n, m) = (t.angles as usize, t.densities as usize);
    let near = |a: f64, b: f32| (a - f64::from(b)).abs() < 1e-6;
    for xi in 0..m {
        let x = tables::density_node(m, xi, f64::from(t.max_thickness));
        assert!(tables::ground(t, x).iter().zip(t.ground[xi]).all(|(a, b)| near(*a, b)));
        for vi in 0..n {
            let v = tables::zenith_node(n, vi);
            assert!(tables::view(t, v, x).iter().zip(t.view[xi * n + vi]).all(|(a, b)| near(*a, b)));
            assert!(near(tables::seen_sky(t, v, x), t.seen_sky[xi * n + vi]));
            for li in 0..n {
                let l = tables::light_node(n, li, v);
                assert!(v > 0.0 || li > tables::ridge(n) || l == 0.0);
                for k in 0..n {
                    let at = tables::pair(t, v, l, tables::azimuth_node(n, k), x);
                    let stored = t.pair[((xi * n + vi) * n + li) * n + k];
                    // The square root that inverts the nodes keeps half of the digits near the ridge.
                    assert!(
                        at.iter().zip(stored).all(|(a, b)| (a - f64::from(b)).abs() < 1e-5),
                        "{at:?} {stored:?}"
                    );
                }
            }
        }
    }
}

/// Small steps across every seam change little, and nothing is ever not finite.
#[test]
fn lookups_are_continuous_and_finite() {
    let t = tiny();
    let max = f64::from(t.max_thickness);
    let all = |v: f64, l: f64, phi: f64, x: f64| -> Vec<f64> {
        let mut all = tables::pair(t, v, l, phi, x).to_vec();
        all.extend(tables::view(t, v, x));
        all.extend(tables::ground(t, x));
        all.extend([tables::visible_ground(t, v, x), tables::joint_ground(t, v, l, phi, x)]);
        all.extend([tables::seen_sky(t, v, x), tables::near_sky(t, v, x)]);
        all
    };
    let angles = [0.0, 1e-9, 0.3, 0.9, tables::THETA_MAX, 1.56, PI / 2.0, 2.0, PI];
    let thicknesses = [0.0, 1e-9, 0.01, 0.25 * max, max, 1.001 * max, 1e3];
    for v in angles {
        for l in angles {
            for phi in [0.0, 1e-9, 1.0, PI] {
                for x in thicknesses {
                    let here = all(v, l, phi, x);
                    assert!(here.iter().all(|x| x.is_finite()), "{v} {l} {phi} {x}");
                    assert!(here[11] <= here[10] && here[10] <= 1.0, "k_g > P at {v} {l} {phi} {x}");
                    // Square roots in the coordinates: a step of 1e-12 moves them by 1e-6 of a cell's range.
                    let e = 1e-12;
                    let steps =
                        [(e, 0.0, 0.0, 0.0), (0.0, e, 0.0, 0.0), (0.0, 0.0, e, 0.0), (0.0, 0.0, 0.0, e)];
                    for (dv, dl, dp, dx) in
                        steps.into_iter().chain([(-e, 0.0, 0.0, 0.0), (0.0, -e, 0.0, 0.0)])
                    {
                        // At the ends of θ_v all nodes of one side are one direction; its cells shrink to a point.
                        let end = |a: f64| !(1e-6..tables::THETA_MAX - 1e-6).contains(&a);
                        if end(v) && dv != 0.0 && (v - l).abs() < 1e-6 {
                            continue;
                        }
                        let there = all(v + dv, l + dl, phi + dp, x + dx);
                        let jump = here.iter().zip(&there).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                        assert!(jump < 1e-4, "{jump} at {v} {l} {phi} {x}: {here:?} {there:?}");
                    }
                }
            }
        }
    }
    for odd in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -1.0] {
        for k in 0..4 {
            let mut a = [0.5, 0.7, 1.0, 0.3];
            a[k] = odd;
            let [v, l, phi, x] = a;
            assert!(tables::pair(t, v, l, phi, x).iter().all(|x| x.is_finite()));
            assert!(tables::view(t, v, x).iter().chain(&tables::ground(t, x)).all(|x| x.is_finite()));
        }
    }
}

#[test]
fn angles_are_those_of_the_scaled_space() {
    let up = [0.0, 0.0, 1.0];
    let a = tables::angles([0.6, 0.0, 0.8], up, up, 1.0);
    assert!((a.v - 0.6f64.atan2(0.8)).abs() < 1e-12 && a.l == 0.0 && a.phi == 0.0 && a.lengths == [1.0; 2]);
    let a = tables::angles([0.6, 0.0, 0.8], [0.0, -0.6, 0.8], up, 0.5);
    assert!((a.v - 0.6f64.atan2(0.4)).abs() < 1e-12 && (a.l - a.v).abs() < 1e-12);
    assert!((a.phi - PI / 2.0).abs() < 1e-12 && (a.sec_v - (1.0f64 + 0.36 / 0.16).sqrt()).abs() < 1e-12);
    // A slope of 45 degrees that descends to the east, seen level from there: a metre ahead of a place the ground is a metre
    // lower, which crowns of half the width see as half of one; right above a place it is as far down as on level ground.
    let r = 0.5f64.sqrt();
    let a = tables::angles([1.0, 0.0, 0.0], up, [r, 0.0, r], 0.5);
    assert!((a.v - 2f64.atan()).abs() < 1e-12 && a.l == 0.0 && a.phi == 0.0);
    assert!((a.lengths[0] - 1.25f64.sqrt()).abs() < 1e-12 && (a.lengths[1] - 0.5).abs() < 1e-12);
    assert_eq!(tables::sun_facing(up, [r, 0.0, r]), 1.0);
    assert_eq!(tables::sun_facing([-r, 0.0, r], [r, 0.0, r]), 0.0);
}

/// Trees of a Poisson distribution on a slope hide what the areas of their shadows on it say, whatever the shear does to crowns; light
/// on them stays light; and level ground is as the tables have it, to the bit.
#[test]
fn slopes_hide_what_single_trees_say() {
    let t = spheres();
    let up = [0.0, 0.0, 1.0];
    let of = |zenith: f64, azimuth: f64| {
        [zenith.sin() * azimuth.cos(), zenith.sin() * azimuth.sin(), zenith.cos()]
    };
    for x in [0.01, 0.2, 0.8] {
        for (v, l) in
            [(of(0.5, 0.0), of(0.7, 2.0)), (of(1.1, 1.0), of(0.4, -1.0)), (of(0.6, 3.0), of(0.6, 3.0))]
        {
            let a = tables::angles(v, l, up, f64::from(t.vertical_scale));
            let level = forest(t, v, l, up, x, Known::own(x));
            assert_eq!(level.seen, x * a.sec_v * tables::view(t, a.v, x)[0]);
            let lit = tables::pair(t, a.v, a.l, a.phi, x)[1] * tables::lit_of_seen(level.seen, level.joint);
            assert_eq!(level.sun[0], lit);
            for tilt in [-0.5f64, -0.2, 0.3, 0.5] {
                let n = [tilt.sin(), 0.0, tilt.cos()];
                let cosine = v[0] * n[0] + v[2] * n[2];
                let f = forest(t, v, l, n, x, Known::own(x));
                // A sphere's shadow along v is its disc over the cosine to the slope, and as much less on the map.
                let path = x * n[2] / cosine;
                assert!((f.seen - path).abs() < 0.03 * path, "{v:?} {tilt} {x}: {} {path}", f.seen);
                assert!(f.joint >= f.seen && f.sun[0] >= 0.0 && f.sun[0] + f.sun[1] <= 1.0 + 1e-9, "{f:?}");
                if v == l {
                    // What is seen from the sun is lit.
                    assert!(f.sun[0] > 0.99 && f.joint < 1.01 * f.seen, "{f:?}");
                }
            }
        }
    }
}

/// The fast rays through a z-field are those of the oracle.
#[test]
fn fast_rays_agree_with_the_model() {
    let mesh = common::real_tree("oak");
    let settings = BakeSettings {
        rings: 4,
        resolution: 64,
        occlusion_rays: 4,
        transfer_bands: 0,
        transfer_resolution: 32,
    };
    let bake = bake_species(&mesh, &Default::default(), &settings, true).unwrap();
    for (resolution, level) in [(64, 0), (32, 1)] {
        for iterations in 1..=3 {
            let crown = FieldCrown::new(&bake, resolution, iterations, iterations);
            let (mut count, mut off) = (0, 0);
            for k in 0..4000u32 {
                let r = |j: u32| f64::from(canopy::physics::hash::unit(canopy::physics::hash::hash2(k, j)));
                let (zenith, azimuth) = (1.55 * r(0), 2.0 * PI * r(1));
                let aim = crown.aim(zenith, azimuth);
                let w = DVec3::new(zenith.sin() * azimuth.cos(), zenith.sin() * azimuth.sin(), zenith.cos());
                let basis = views::Basis::new(w);
                let (a, b) = (2.0 * r(2) - 1.0, (2.0 * r(3) - 1.0) * basis.extent);
                let origin = a * basis.right + b * basis.up;
                let (fa, fb) = (a as f32, b as f32);
                let seen = crown.seen(&aim, fa, fb);
                let lookup = views::lookup(bake.views.n, w);
                let ray = zfield::Ray { origin, to: w };
                let model = zfield::intersect(&bake.views, level, &lookup, &ray, iterations);
                let cast = crown.cast(&aim, fa, fb);
                let shadow = zfield::cast(&bake.views, level, &lookup, &ray);
                let entry = crown.entry(&aim, fa, fb).unwrap();
                let lit = zfield::light_ray(&bake.views, level, origin, w, iterations);
                let near = |a: f32, b: f64, weight: f64| (f64::from(a) - b).abs() * weight < 0.02;
                let same = near(seen.alpha, model.alpha, 1.0)
                    && near(seen.depth, model.s, model.alpha)
                    && near(seen.occlusion, model.occlusion, model.alpha)
                    && (near(cast.alpha, shadow.alpha, 1.0) || (cast.alpha == 0.0 && shadow.alpha < 0.02))
                    && near(cast.back, shadow.s, f64::from(cast.alpha))
                    && cast.front >= cast.back - 1e-3
                    && near(entry, lit.s, lit.alpha);
                count += u32::from(model.alpha > 0.0);
                off += u32::from(!same);
            }
            // Unfiltered first looks, and weights by agreement of views, may fall on either side of a border.
            assert!(
                count > 1000 && off * 100 < count,
                "{off} of {count} at level {level}, {iterations} iterations"
            );
        }
    }
}
