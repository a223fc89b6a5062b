//! The Monte-Carlo reference against closed forms, and against itself.
//!
//! Bounds on random results are five standard errors, as the estimate itself states them: one in two million runs would
//! fail, and the seeds are fixed.

mod common;

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use canopy::camera::Eye;
use canopy::physics::hash::Stream;
use canopy::physics::raster::Raster;
use canopy::reference::{Estimate, Light, Options, Until, World};
use canopy::scene::{self, Distribution, Material, Mesh, Scene, Sky, TreePosition};
use common::{ellipsoid, material, push_triangle};

/// A scene of one species with this mesh, and trees where they are listed.
fn forest(mesh: Mesh, trees: Vec<TreePosition>, extent: f64, lights: &str) -> Scene {
    let text = format!(
        "seed = 5\n[terrain]\nextent = {extent:?}\nalbedo = 1.0\n\
         [[species]]\nname = \"a\"\nmodel = \"builtin:birch\"\ndensity = 0.0\n{lights}\n\
         [[camera]]\nname = \"c\"\nposition = [0.0, 0.0, 10.0]\ntarget = [9.0, 9.0, 5.0]\nvertical_fov = 50.0\n"
    );
    let mut scene = scene::parse(&text, Path::new("test.toml")).unwrap();
    scene.species[0].mesh = Arc::new(mesh);
    scene.species[0].distribution = Distribution::Positions(Arc::new(trees));
    scene
}

fn tree(x: f64, y: f64) -> TreePosition {
    TreePosition { x, y, scale: None, rotation: None }
}

fn colours(scene: &mut Scene, r: [f32; 3], t: [f32; 3], bark: [f32; 3]) {
    let optics = &mut scene.species[0].optics;
    optics.leaf_reflectance = Some(r);
    optics.leaf_transmittance = Some(t);
    optics.bark_reflectance = Some(bark);
}

fn ground(scene: &mut Scene, albedo: [f32; 3]) {
    scene.terrain.albedo = canopy::scene::Albedo::Uniform(albedo);
}

/// Looks at a point from a zenith angle and an azimuth (degrees, towards the viewer, clockwise from north) and far away,
/// at a square of this side.
fn from_afar(target: [f64; 3], zenith: f64, azimuth: f64, side: f64, pixels: u32) -> Eye {
    let (t, a) = (zenith.to_radians(), azimuth.to_radians());
    let v = [t.sin() * a.sin(), t.sin() * a.cos(), t.cos()];
    let away = 300.0 * side;
    let fov = 2.0 * (0.5 * side / away).atan().to_degrees();
    Eye::looking([0, 1, 2].map(|k| target[k] + away * v[k]), v.map(|c| -c), fov, [pixels; 2])
}

fn render(scene: &Scene, eye: &Eye, options: &Options) -> Estimate {
    let world = World::new(scene, &[*eye]).unwrap().without_tints();
    world.render(eye, options, None, &mut |_| ()).unwrap()
}

/// A quarter-metre trunk with a dozen leaves around its top, some of them crossing.
fn shrub() -> Mesh {
    let mut mesh = Mesh { materials: vec![material(true), material(false)], ..Mesh::default() };
    let mut random = Stream::new(3);
    let uv = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
    for k in 0..6 {
        let at = |k: usize, z: f32| {
            let (s, c) = (std::f32::consts::TAU * (k % 6) as f32 / 6.0).sin_cos();
            [0.25 * c, 0.25 * s, z]
        };
        push_triangle(&mut mesh, [at(k, -0.5), at(k + 1, -0.5), at(k + 1, 3.0)], uv, 1);
        push_triangle(&mut mesh, [at(k, -0.5), at(k + 1, 3.0), at(k, 3.0)], uv, 1);
    }
    for _ in 0..24 {
        let mut point = |size: f64| [0; 3].map(|_| (size * (random.unit() - 0.5)) as f32);
        let middle = point(3.0);
        let corners =
            [0; 3].map(|_| point(2.5)).map(|p| [middle[0] + p[0], middle[1] + p[1], 3.2 + middle[2] + p[2]]);
        push_triangle(&mut mesh, corners, uv, 0);
    }
    mesh
}

const EVEN_SKY: &str = "[sky]\nradiance = 1.0";

/// Where nothing absorbs and light is the same from everywhere, everything has that radiance: whatever a wrong weight, a lost
/// path, a wrong normal or a gap in a surface takes away or adds is seen. Leaves that are grey have weights of exactly 1, so
/// that every lost path shows. Where colours differ by channel, the choice between reflection and transmission, which all
/// channels share, makes weights random.
#[test]
fn in_a_furnace_everything_looks_the_same() {
    for rough in [false, true] {
        // Light under the horizon would come from beyond the plain: from 5 m above it, 1e-4 of the directions of a wall.
        let extent = if rough { 300.0 } else { 50_000.0 };
        let middle = 0.5 * extent;
        let trees = (0..9).map(|k| tree(middle + 2.2 * f64::from(k % 3), middle + 2.2 * f64::from(k / 3)));
        let mut scene = forest(shrub(), trees.collect(), extent, EVEN_SKY);
        if rough {
            // Waves of 4 m in a bowl with a level rim, above everything: no ray leaves under the horizon.
            let n = 61u32;
            let samples = (0..n * n)
                .map(|k| {
                    let (x, y) = (f64::from(k % n) - 30.0, f64::from(k / n) - 30.0);
                    let rim = (x.abs().max(y.abs()) / 30.0).powi(2);
                    (2.0 * (1.9 * x).sin() * (1.3 * y).cos() * (1.0 - rim) + 54.0 * rim) as f32
                })
                .collect();
            scene.terrain.cell_size = 5.0;
            scene.terrain.heights = Some(Raster { width: n, height: n, samples });
        }
        let centre = [middle + 2.2, middle + 2.2, 2.0];
        for (zenith, grey) in [(20.0, false), (75.0, false), (20.0, true), (75.0, true)] {
            let (r, t) = if grey { ([0.5; 3], [0.5; 3]) } else { ([0.2, 0.5, 0.9], [0.8, 0.5, 0.1]) };
            colours(&mut scene, r, t, [1.0; 3]);
            let eye = from_afar(centre, zenith, 40.0, 9.0, 24);
            let options = Options { until: Until::Samples(48), ..Options::default() };
            let estimate = render(&scene, &eye, &options);
            let mean = estimate.mean();
            println!(
                "rough {rough}, from {zenith}: {:?} ± {:?}, {:?}",
                mean.sky, mean.stderr, mean.fractions
            );
            assert!(mean.fractions[3] > 0.2 && mean.fractions[1] > 0.05, "leaves and ground are in view");
            for k in 0..3 {
                // Of grey leaves only paths that roulette ends after 1,024 surfaces, and those that leave between the plain's
                // end and the horizon, are not 1.
                let room = if grey { 3e-4 } else { 5.0 * mean.stderr[k] + 3e-4 };
                assert!((mean.sky[k] - 1.0).abs() < room, "channel {k}: {}", mean.sky[k]);
                assert!(grey || (1e-3..0.01).contains(&mean.stderr[k]), "random, and yet sure");
            }
        }
    }
}

/// Level ground of albedo a under a sky of radiance cos θ (1 + ½ cos(azimuth − 0.7 rad)), an image: the irradiance is that of cos θ, 2π/3, and
/// the ground's radiance 2a/3, for one half of the sky has what the other lacks. Against the sky itself the eye sees the
/// image, the right way round.
#[test]
fn a_sky_image_lights_the_ground_as_its_integral_says() {
    let (width, height) = (64u32, 64u32);
    let radiance = |zenith: f64, azimuth: f64| zenith.cos().max(0.0) * (1.0 + 0.5 * (azimuth - 0.7).cos());
    let pixels = (0..width * height)
        .flat_map(|k| {
            let zenith = (f64::from(k / width) + 0.5) / f64::from(height) * std::f64::consts::PI;
            let azimuth = (f64::from(k % width) + 0.5) / f64::from(width) * std::f64::consts::TAU;
            [1.0f64, 2.0, 0.5].map(|c| (c * radiance(zenith, azimuth)) as f32)
        })
        .collect();
    let mut scene = forest(shrub(), vec![tree(100.0, 100.0)], 50_000.0, EVEN_SKY);
    scene.sky = Sky::LatLong { width, height, pixels: Arc::new(pixels) };
    ground(&mut scene, [0.3; 3]);
    let options = Options { until: Until::Samples(64), ..Options::default() };
    let seen = render(&scene, &from_afar([25_000.0, 25_000.0, 0.0], 30.0, 40.0, 9.0, 24), &options).mean();
    for (k, colour) in [1.0, 2.0, 0.5].into_iter().enumerate() {
        let want = colour * 2.0 * 0.3 / 3.0;
        // Texels of 2.8 degrees are a step of cos θ of 1/64 of its range at most, and hold their centres' values: 1e-3.
        assert!((seen.sky[k] - want).abs() < 5.0 * seen.stderr[k] + 1e-3 * want, "{:?} {want}", seen.sky);
        assert!(seen.stderr[k] < 0.01 * want, "{:?}", seen.stderr);
    }
    for (azimuth, elevation) in [(0.0f64, 30.0f64), (90.0, 30.0), (180.0, 60.0), (300.0, 10.0)] {
        let ((sa, ca), (se, ce)) = (azimuth.to_radians().sin_cos(), elevation.to_radians().sin_cos());
        let eye = Eye::looking([25_000.0, 25_000.0, 5.0], [ce * sa, ce * ca, se], 1.0, [4; 2]);
        let seen = render(&scene, &eye, &options).mean().sky[0];
        let want = radiance((90.0 - elevation).to_radians(), azimuth.to_radians());
        // Linear between texels of 0.05 and 0.1 rad: an eighth of the square, of what is 1.5 at most.
        assert!((seen - want).abs() < 2.5e-3, "{azimuth} {elevation}: {seen} {want}");
    }
}

/// A leaf as wide as a field over Lambertian ground: R = r + t² a/(1 − r a) of all light, and order by order r, nothing, t² a,
/// nothing, t² a² r, as light goes to and fro.
#[test]
fn a_wide_leaf_over_the_ground_has_the_closed_form_of_two_layers() {
    let mut mesh = Mesh { materials: vec![material(true), material(false)], ..Mesh::default() };
    let (s, z) = (500.0, 0.5);
    let uv = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
    push_triangle(&mut mesh, [[-s, -s, z], [s, -s, z], [s, s, z]], uv, 0);
    push_triangle(&mut mesh, [[-s, -s, z], [s, s, z], [-s, s, z]], uv, 0);
    // Gives it height; a hair.
    push_triangle(&mut mesh, [[0.0, 0.0, 0.0], [1e-3, 0.0, 0.0], [0.0, 0.0, z]], uv, 1);
    let lights =
        "[sky]\nradiance = [1.0, 2.0, 3.0]\n[sun]\nazimuth = 90.0\nelevation = 30.0\nirradiance = 2.0";
    let mut scene = forest(mesh, vec![tree(1000.0, 1000.0)], 2000.0, lights);
    scene.species[0].scale = [1.0; 2];
    let (r, t, a) = ([0.1, 0.3, 0.5], [0.05, 0.3, 0.45], [0.2, 0.5, 0.9]);
    colours(&mut scene, r, t, [0.0; 3]);
    ground(&mut scene, a);
    let eye = from_afar([1005.0, 1007.0, z.into()], 35.0, 200.0, 4.0, 16);
    let sky = [1.0, 2.0, 3.0];
    // Lambertian: radiance E sin(elevation)/π.
    let sun = 2.0 * 0.5 / std::f64::consts::PI;
    for (bounces, light) in [
        (Some(1), Light::All),
        (Some(2), Light::All),
        (Some(3), Light::All),
        (Some(5), Light::Sun),
        (Some(5), Light::Sky),
        (None, Light::All),
    ] {
        let options = Options { light, bounces, seed: 2, until: Until::Samples(300) };
        let mean = render(&scene, &eye, &options).mean();
        println!("{bounces:?} {light:?}: sun {:?} sky {:?} ± {:?}", mean.sun, mean.sky, mean.stderr);
        for k in 0..3 {
            let [r, t, a] = [r[k], t[k], a[k]].map(f64::from);
            let whole = match bounces {
                Some(1 | 2) => r,
                Some(3) => r + t * t * a,
                Some(_) => r + t * t * a * (1.0 + r * a),
                None => r + t * t * a / (1.0 - r * a),
            };
            // Rays that leave between leaf and ground at the rim: 0.5 m of 500 m. Singles: 1e-6 of the value.
            let room = 5.0 * mean.stderr[k] + 2e-5;
            let (sun, sky) = (
                if light == Light::Sky { 0.0 } else { whole * sun },
                if light == Light::Sun { 0.0 } else { whole * sky[k] },
            );
            assert!((mean.sun[k] - sun).abs() < room, "{bounces:?} {light:?}: sun {} {sun}", mean.sun[k]);
            assert!((mean.sky[k] - sky).abs() < room, "{bounces:?} {light:?}: sky {} {sky}", mean.sky[k]);
        }
        assert!(mean.stderr[2] < 0.02 && mean.fractions[2] > 0.9999, "{:?}", mean.fractions);
    }
    // Over hardly any ground nothing comes from below: under the horizon there is no sky.
    scene.terrain.extent = [1e-3; 2];
    scene.species[0].distribution = Distribution::Positions(Arc::new(vec![tree(5e-4, 5e-4)]));
    let eye = from_afar([5.0, 7.0, z.into()], 35.0, 200.0, 4.0, 16);
    let mean = render(&scene, &eye, &Options { until: Until::Samples(200), ..Options::default() }).mean();
    for k in 0..3 {
        let want = f64::from(r[k]) * sky[k];
        assert!((mean.sky[k] - want).abs() < 5.0 * mean.stderr[k] + 1e-5, "{} {want}", mean.sky[k]);
    }
}

/// Area of the union of two ellipses, the shadows along u and v of a sphere of radius r that rests on the ground: semi-axes r/cos
/// θ and r, around r tan θ in the direction of the light. By the midpoint rule along lines, exact across them.
fn union(r: f64, u: [f64; 3], v: [f64; 3]) -> f64 {
    let chord = |d: [f64; 3], y: f64| {
        // Points x of the line at y: the square of the distance of the sphere's centre from the ray from (x, y, 0) along d,
        // r². |c|² − (c·d)² with c = (−x, −y, r).
        let a = 1.0 - d[0] * d[0];
        let half_b = d[0] * (r * d[2] - y * d[1]);
        let c = y * y + r * r - (r * d[2] - y * d[1]).powi(2) - r * r;
        let root = half_b * half_b - a * c;
        (root > 0.0).then(|| [(-half_b - root.sqrt()) / a, (-half_b + root.sqrt()) / a])
    };
    let (n, reach) = (20_000, 8.0 * r);
    let step = 2.0 * reach / f64::from(n);
    let length = |k: i32| {
        let y = -reach + step * (f64::from(k) + 0.5);
        match (chord(u, y), chord(v, y)) {
            (Some(a), Some(b)) => a[1] - a[0] + b[1] - b[0] - (a[1].min(b[1]) - a[0].max(b[0])).max(0.0),
            (Some(a), None) | (None, Some(a)) => a[1] - a[0],
            (None, None) => 0.0,
        }
    };
    (0..n).map(length).sum::<f64>() * step
}

/// Opaque spheres at Poisson points: ground is seen with the probability exp(−λ A/cos θ), and is lit as well with
/// exp(−λ |E_v ∪ E_l|), for the ellipses around a point of the ground where a sphere hides the viewer, or the sun.
#[test]
fn poisson_spheres_have_the_closed_forms() {
    let (radius, density, side, margin) = (2.0f64, 0.03f64, 700.0f64, 60.0f64);
    let mut mesh = ellipsoid(radius as f32, radius as f32, 24);
    mesh.materials[0] = Material { foliage: false, ..material(false) };
    // Any convex body's mean shadow is a quarter of its surface (Cauchy): the radius that the facets stand for.
    let area: f64 = mesh
        .triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.vertices.map(|v| glam::Vec3::from(mesh.positions[v as usize]).as_dvec3());
            0.5 * (b - a).cross(c - a).length()
        })
        .sum();
    let facets = (area / (4.0 * std::f64::consts::PI)).sqrt();
    assert!((0.99..1.0).contains(&(facets / radius)));
    let extent = side + 2.0 * margin;
    let mut random = Stream::new(8);
    let count = (density * extent * extent).round() as usize;
    let trees = (0..count)
        .map(|_| TreePosition { scale: Some(1.0), ..tree(extent * random.unit(), extent * random.unit()) });
    let sun = "[sky]\nradiance = 0.0\n[sun]\nazimuth = 180.0\nelevation = 50.0\nirradiance = 1.0";
    let mut scene = forest(mesh, trees.collect(), extent, sun);
    colours(&mut scene, [0.5; 3], [0.0; 3], [0.5; 3]);
    let towards = |zenith: f64, azimuth: f64| {
        let (t, a) = (zenith.to_radians(), azimuth.to_radians());
        [t.sin() * a.sin(), t.sin() * a.cos(), t.cos()]
    };
    let l = towards(40.0, 180.0);
    for (zenith, azimuth) in [(0.0, 0.0), (40.0, 180.0), (40.0, 0.0), (50.0, 90.0), (30.0, 180.0)] {
        let v = towards(zenith, azimuth);
        let visible = (-density * union(facets, v, v)).exp();
        let lit = (-density * union(facets, v, l)).exp();
        let one = std::f64::consts::PI * facets * facets / v[2];
        assert!((visible - (-density * one).exp()).abs() < 1e-4, "the ellipse has its area");
        let eye = from_afar([0.5 * extent, 0.5 * extent, 0.0], zenith, azimuth, 400.0, 160);
        let options = Options { light: Light::Sun, bounces: Some(1), seed: 3, until: Until::Samples(2) };
        let [lit_ground, shadowed_ground, lit_tree, shadowed_tree] =
            render(&scene, &eye, &options).mean().fractions;
        println!(
            "{zenith} {azimuth}: visible {} {visible}, lit {lit_ground} {lit}",
            lit_ground + shadowed_ground
        );
        // The patch is one of all that could be: the variance of its mean is q² ∫(e^{λγ(h)} − 1)dh over its area, γ the
        // overlap of a shadow with itself h away: less than q² (e^{λA} − 1) A over it. Five of that, and 0.2 % for facets.
        let spread = |q: f64, area: f64| {
            let patch = 400.0 * 400.0 / v[2];
            5.0 * (q * q * ((density * area).exp() - 1.0) * area / patch).sqrt() + 0.002
        };
        let (e, both) = (union(facets, v, v), union(facets, v, l));
        assert!(spread(lit, both) < 0.035, "the bound says something: {}", spread(lit, both));
        assert!((lit_ground + shadowed_ground - visible).abs() < spread(visible, e));
        assert!((lit_ground - lit).abs() < spread(lit, both), "{lit_ground} {lit}");
        assert!((lit_ground + shadowed_ground + lit_tree + shadowed_tree - 1.0).abs() < 1e-12);
        if (zenith, azimuth) == (40.0, 180.0) {
            // Seen from the sun there is no shadow; but for rays of the image that are 1/600 off, by limbs of 1/24 of a turn a
            // facet.
            assert!(shadowed_ground < 1e-3 && shadowed_tree < 1e-3, "{shadowed_ground} {shadowed_tree}");
        }
    }
}

/// Light goes both ways alike (Helmholtz): trees on black ground send as much of a beam from l to v as of one from v to l.
#[test]
fn sun_and_viewer_may_be_swapped() {
    let trees = vec![tree(100.0, 100.0), tree(102.0, 101.0), tree(99.0, 103.0)];
    let sun = "[sky]\nradiance = 0.0\n[sun]\nazimuth = 0.0\nelevation = 90.0\nirradiance = 1.0";
    let mut scene = forest(shrub(), trees, 200.0, sun);
    scene.species[0].scale = [1.0; 2];
    colours(&mut scene, [0.5, 0.2, 0.6], [0.1, 0.7, 0.4], [0.3; 3]);
    ground(&mut scene, [0.0; 3]);
    let power = |scene: &mut Scene, light: [f64; 2], view: [f64; 2]| {
        scene.sun.elevation = 90.0 - light[0];
        scene.sun.azimuth = light[1];
        let eye = from_afar([100.0, 101.0, 2.5], view[0], view[1], 16.0, 64);
        render(scene, &eye, &Options { seed: 4, until: Until::Samples(200), ..Options::default() }).mean()
    };
    for (a, b) in [([20.0, 30.0], [70.0, 100.0]), ([50.0, 0.0], [60.0, 180.0])] {
        let (there, back) = (power(&mut scene, a, b), power(&mut scene, b, a));
        for k in 0..3 {
            let room = 5.0 * there.stderr[k].hypot(back.stderr[k]);
            println!("{a:?} {b:?}: {} {} within {room}", there.sun[k], back.sun[k]);
            // Seen from so far, rays of an image are parallel to 16/4800: 0.2 % at most.
            assert!((there.sun[k] - back.sun[k]).abs() < room + 0.002 * there.sun[k]);
            assert!(room < 0.06 * there.sun[k], "the bound says something");
        }
    }
}

/// A clearing with some shrubs, half lit.
fn clearing() -> (Scene, Eye) {
    let trees = (0..12).map(|k| tree(50.0 + 2.5 * f64::from(k % 4), 50.0 + 2.5 * f64::from(k / 4)));
    let lights = "[sky]\nradiance = [0.1, 0.2, 0.3]\n[sun]\nazimuth = 100.0\nelevation = 40.0\nirradiance = [1.0, 0.9, 0.8]";
    let mut scene = forest(shrub(), trees.collect(), 100.0, lights);
    colours(&mut scene, [0.4, 0.3, 0.2], [0.3, 0.2, 0.1], [0.2; 3]);
    ground(&mut scene, [0.3, 0.25, 0.2]);
    (scene, from_afar([54.0, 53.0, 1.0], 50.0, 10.0, 14.0, 20))
}

/// Two estimates from different seeds differ by what their variances say: Σ (a − b)²/(σa² + σb²) is the number of terms.
#[test]
fn independent_estimates_agree_within_their_stated_error() {
    let (scene, eye) = clearing();
    let world = World::new(&scene, &[eye]).unwrap();
    let take = |seed: u32| {
        let options = Options { seed, until: Until::Samples(128), ..Options::default() };
        world.render(&eye, &options, None, &mut |_| ()).unwrap()
    };
    let (a, b) = (take(1), take(2));
    let (va, vb) = (a.variance(), b.variance());
    let (la, lb) = (a.linear(), b.linear());
    type Part<'a> = (&'a str, &'a [[f32; 3]], &'a [[f32; 3]], &'a [[f64; 3]], &'a [[f64; 3]]);
    let parts: [Part; 2] =
        [("sun", &la.sun, &lb.sun, &va.sun, &vb.sun), ("sky", &la.sky, &lb.sky, &va.sky, &vb.sky)];
    for (name, x, y, vx, vy) in parts {
        let (mut sum, mut terms) = (0.0, 0.0);
        for k in 0..x.len() {
            for c in 0..3 {
                let variance = vx[k][c] + vy[k][c];
                if variance > 0.0 {
                    sum += f64::from(x[k][c] - y[k][c]).powi(2) / variance;
                    terms += 1.0;
                }
            }
        }
        let ratio = sum / terms;
        println!("{name}: {ratio:.3} over {terms} values");
        // 400 independent pixels (channels go together): the mean of χ² has a standard error of √(2/400) = 0.07; normal but
        // for skewness, of which a fifth is allowed. Wrong by a factor of n in variance, it would be off by 100.
        assert!(terms > 900.0 && (0.7..1.35).contains(&ratio), "{name}: {ratio}");
    }
    // The mean's error, too, and the relative errors are those of the definitions.
    let (ma, mb) = (a.mean(), b.mean());
    for k in 0..3 {
        let (x, y) = (ma.sun[k] + ma.sky[k], mb.sun[k] + mb.sky[k]);
        assert!((x - y).abs() < 5.0 * ma.stderr[k].hypot(mb.stderr[k]));
    }
    let largest = (0..3).map(|k| ma.stderr[k] / (ma.sun[k] + ma.sky[k])).fold(0.0, f64::max);
    assert_eq!(a.relative_error_of_mean(), largest);
    // Four times the samples, half the error.
    let more = Options { until: Until::Samples(512), ..Options::default() };
    let longer = world.render(&eye, &more, Some(a.clone()), &mut |_| ()).unwrap();
    let gain = a.relative_error() / longer.relative_error();
    assert!((1.7..2.3).contains(&gain), "{gain}");
}

#[test]
fn threads_and_interruptions_do_not_change_a_bit() {
    let (scene, eye) = clearing();
    let world = World::new(&scene, &[eye]).unwrap();
    let take = |samples: u32, from: Option<Estimate>| {
        let options = Options { until: Until::Samples(samples), ..Options::default() };
        world.render(&eye, &options, from, &mut |_| ()).unwrap()
    };
    let threads = |n: usize| rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
    let whole = threads(2).install(|| take(13, None));
    assert_eq!(whole, threads(1).install(|| take(13, None)));
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("half.sums");
    take(5, None).save(&path).unwrap();
    let resumed = take(13, Some(Estimate::load(&path).unwrap()));
    assert_eq!(whole, resumed);
    assert_eq!(whole.picture(1.0).digest(), resumed.picture(1.0).digest());
    // Enough already: nothing is added.
    assert_eq!(take(8, Some(whole.clone())), whole);
}

#[test]
fn nothing_else_is_resumed() {
    let (scene, eye) = clearing();
    let short = Options { until: Until::Samples(2), ..Options::default() };
    let take = |scene: &Scene, eye: &Eye, options: &Options, from: Option<Estimate>| {
        World::new(scene, &[*eye]).unwrap().render(eye, options, from, &mut |_| ())
    };
    let first = take(&scene, &eye, &short, None).unwrap();
    let refused = |scene: &Scene, eye: &Eye, options: &Options, what: &str| {
        let error = take(scene, eye, options, Some(first.clone())).unwrap_err();
        assert_eq!(error.exit_code(), 2);
        let text = error.to_string();
        assert!(text.contains(what) && !text.contains("version"), "{what}: {text}");
    };
    let mut darker = scene.clone();
    darker.sun.irradiance[1] = 0.5;
    refused(&darker, &eye, &short, "differs: sun");
    let mut moved = scene.clone();
    moved.seed = 6;
    refused(&moved, &eye, &short, "seed of the scene, trees");
    let mut greener = scene.clone();
    greener.species[0].optics.leaf_reflectance = Some([0.1; 3]);
    refused(&greener, &eye, &short, "model of species \"a\"");
    refused(&scene, &Eye { position: [50.0, 50.0, 30.0], ..eye }, &short, "camera");
    refused(&scene, &Eye { size: [20, 21], ..eye }, &short, "size of the image");
    refused(&scene, &eye, &Options { bounces: Some(2), ..short }, "differs: number of bounces");
    refused(&scene, &eye, &Options { light: Light::Sky, ..short }, "differs: light");
    refused(&scene, &eye, &Options { seed: 9, ..short }, "differs: seed of the samples");
    // Going on to another end is fine.
    take(
        &scene,
        &eye,
        &Options { until: Until::Time(Duration::from_millis(1)), ..short },
        Some(first.clone()),
    )
    .unwrap();

    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.sums");
    first.save(&path).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    for (k, wrong) in [bytes[..bytes.len() - 9].to_vec(), b"PNG".to_vec(), Vec::new()].iter().enumerate() {
        std::fs::write(&path, wrong).unwrap();
        let error = Estimate::load(&path).unwrap_err();
        assert!(error.exit_code() == 2 && error.to_string().contains("a.sums"), "{k}: {error}");
    }
    for at in [25, 200, bytes.len() - 40] {
        let mut wrong = bytes.clone();
        wrong[at] ^= 4;
        std::fs::write(&path, wrong).unwrap();
        assert!(Estimate::load(&path).unwrap_err().to_string().contains("damaged"));
    }
}

#[test]
fn too_many_trees_and_wrong_options_are_refused() {
    let (mut scene, eye) = clearing();
    for until in [Until::Samples(1), Until::Error(0.0), Until::Error(f64::NAN), Until::Time(Duration::ZERO)] {
        let options = Options { until, ..Options::default() };
        let world = World::new(&scene, &[eye]).unwrap();
        assert_eq!(world.render(&eye, &options, None, &mut |_| ()).unwrap_err().exit_code(), 2);
    }
    let density =
        Distribution::Density { map: None, max_density: 1.0, between_heights: None, below_slope: None };
    scene.species[0].distribution = density;
    scene.terrain.extent = [5000.0; 2];
    let wide = Eye::looking([0.0, 0.0, 50.0], [1.0, 1.0, -0.2], 60.0, [8, 8]);
    let error = World::new(&scene, &[wide]).err().expect("25 million trees").to_string();
    assert!(error.contains("4000000 trees"), "{error}");
}

/// The program in an empty folder, where no Vulkan driver is found.
fn program(dir: &Path, words: &str) -> std::process::Output {
    let mut c = std::process::Command::new(env!("CARGO_BIN_EXE_canopy"));
    c.env("VK_DRIVER_FILES", "/nonexistent").env("VK_ICD_FILENAMES", "/nonexistent");
    c.current_dir(dir).args(words.split_whitespace()).output().unwrap()
}

const SCENE: &str = "name = \"small\"\n[terrain]\nextent = 120.0\n[[species]]\nname = \"birch\"\nmodel = \"builtin:birch\"\n\
    density = 0.01\n[sun]\nazimuth = 180.0\nelevation = 40.0\nirradiance = 1.0\n[sky]\nradiance = 0.1\n[[camera]]\nname = \"a\"\n\
    position = [60.0, 20.0, 9.0]\ntarget = [60.0, 60.0, 5.0]\nvertical_fov = 45.0\n";

#[test]
fn the_program_draws_and_resumes_a_reference_without_a_device() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("s.toml"), SCENE).unwrap();
    let render = "render s.toml --representation reference --size 24x16 --json --quiet";
    let run = |words: &str| {
        let out = program(dir.path(), &format!("{render} {words}"));
        assert!(out.status.success(), "{words}: {}", String::from_utf8_lossy(&out.stderr));
        serde_json::from_slice::<serde_json::Value>(&out.stdout).unwrap()
    };
    let whole = run("--until 6spp -o whole.png --exr whole.exr");
    let half = run("--until 3spp -o half.png --resume half.sums");
    let rest = run("--until 6spp -o rest.png --exr rest.exr --resume half.sums");
    assert_eq!((half["samples"].as_u64(), half["resumed_samples"].as_u64()), (Some(3), Some(0)));
    assert_eq!((rest["samples"].as_u64(), rest["resumed_samples"].as_u64()), (Some(6), Some(3)));
    assert_eq!(whole["relative_error"], rest["relative_error"]);
    let read = |name: &str| std::fs::read(dir.path().join(name)).unwrap();
    assert!(read("whole.png") == read("rest.png") && read("whole.exr") == read("rest.exr"));
    // The layers of the renderer's image, and two more.
    let image = exr::prelude::read_all_data_from_file(dir.path().join("rest.exr")).unwrap();
    let names: Vec<String> = image
        .layer_data
        .iter()
        .filter_map(|l| l.attributes.layer_name.as_ref())
        .map(|n| n.to_string())
        .collect();
    let wanted = "radiance sun sky depth trees species fractions variance samples";
    assert_eq!(names, wanted.split(' ').collect::<Vec<_>>());
    assert!(run("--until 50% -o e.png")["relative_error"].as_f64().unwrap() <= 0.5);
    assert_eq!(run("--until 2spp --light sky --bounces 1 -o k.png")["bounces"].as_u64(), Some(1));

    for (words, wanted) in [
        (
            format!("{render} -o x.png --until 6spp --bounces 2 --resume half.sums"),
            "What differs: number of bounces",
        ),
        (format!("{render} -o x.png --until 1spp"), "which a variance needs"),
        (format!("{render} -o x.png --until 5"), "such as 1%"),
        (format!("{render} -o x.png --bounces 0"), "from 1 on"),
        (format!("{render} -o x.png --frames 2"), "--frames"),
        (format!("{render} -o x.png --resume s.toml"), "no estimate of a reference"),
        ("render s.toml -o x.png --until 3spp".into(), "--until is for --representation reference"),
        ("render s.toml -o x.png --resume half.sums".into(), "--resume is for"),
        ("reflectance s.toml --bounces 1".into(), "--bounces is for"),
    ] {
        let out = program(dir.path(), &words);
        let said = String::from_utf8_lossy(&out.stderr);
        assert_eq!(out.status.code(), Some(2), "{words}: {said}");
        assert!(said.contains(wanted), "{words}: {said}");
        assert!(!dir.path().join("x.png").exists());
    }
}

#[test]
fn the_program_measures_reflectance_by_the_reference_without_a_device() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("s.toml"), SCENE).unwrap();
    let reflectance = "reflectance s.toml --representation reference --patches 2 --patch-side 60 --patch-pixels 24 \
        --view-zenith -30,30 --distance 100,900 --until 5% --quiet";
    let out = program(dir.path(), reflectance);
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let text = String::from_utf8(out.stdout).unwrap();
    let rows: Vec<Vec<&str>> = text.lines().map(|l| l.split(',').collect()).collect();
    assert_eq!((rows.len(), rows[0].len(), rows[1][0]), (5, 22, "reference"));
    // Distance means nothing to it.
    assert_eq!((rows[1][1], rows[3][1]), ("100", "900"));
    assert_eq!(rows[1][2..], rows[3][2..]);
    let value = |row: usize, column: &str| -> f64 {
        rows[row][rows[0].iter().position(|c| *c == column).unwrap()].parse().unwrap()
    };
    let k = ["k_lit_ground", "k_shadowed_ground", "k_lit_tree", "k_shadowed_tree"];
    assert!((k.iter().map(|k| value(1, k)).sum::<f64>() - 1.0).abs() < 1e-6);
    // The sun is behind the viewer of the second row: less shadow, more light.
    assert!(value(2, "k_shadowed_ground") < value(1, "k_shadowed_ground"));
    assert!(value(2, "sun_g") > value(1, "sun_g") && value(1, "sky_g") > 0.0);
    let out = program(dir.path(), &format!("{reflectance} --json --bounces 1"));
    let report: serde_json::Value = serde_json::from_slice(&out.stdout).unwrap();
    for row in report["rows"].as_array().unwrap() {
        let radiance = |c: usize| row["sun"][c].as_f64().unwrap() + row["sky"][c].as_f64().unwrap();
        let noise = (0..3).map(|c| row["noise"][c].as_f64().unwrap() / radiance(c)).fold(0.0, f64::max);
        // Each of two images to 5 %.
        assert!(noise > 0.0 && noise < 0.05 / 2f64.sqrt() * 1.1, "{noise}");
        // Single scattering is less light than all of it.
        assert!(row["sun"][1].as_f64().unwrap() < value(2, "sun_g"));
    }
}
