//! Ground, sky and shadows of whole frames, where the answer is known in closed form.

use crate::device::{self, Worst};
use canopy::camera::Eye;
use canopy::gpu::Gpu;
use canopy::image::Linear;
use canopy::physics::raster::Raster;
use canopy::scene::{Camera, Distribution, Scene, Sky, TreePosition};
use std::f64::consts::PI;
use std::sync::Arc;

const SIZE: [u32; 2] = [64, 48];
const E: [f64; 3] = [1.0, 0.9, 0.8];
const SKY: [f64; 3] = [0.1, 0.2, 0.3];
const ALBEDO: [f64; 3] = [0.2, 0.15, 0.1];

/// A bare plain at one sample a pixel, so that a pixel is what its centre sees.
fn plain(elevation: f64) -> Scene {
    let mut scene = device::small_scene(&format!(
        "seed = 2\n[terrain]\nextent = 400.0\nalbedo = {ALBEDO:?}\n\
         [sun]\nazimuth = 90.0\nelevation = {elevation:?}\nirradiance = {E:?}\n[sky]\nradiance = {SKY:?}\n\
         [[camera]]\nname = \"c\"\nposition = [150.0, 120.0, 30.0]\ntarget = [200.0, 200.0, 0.0]\nvertical_fov = 50.0\n"
    ));
    scene.settings.set("samples", 1.0).unwrap();
    scene
}

fn hills(scene: &mut Scene, amplitude: f64) {
    let (width, height) = (41u32, 41);
    let samples = (0..width * height)
        .map(|k| {
            (amplitude * (f64::from(k % width) * 0.35).sin() * (f64::from(k / width) * 0.3).cos()) as f32
        })
        .collect();
    scene.terrain.heights = Some(Raster { width, height, samples });
    scene.terrain.cell_size = 10.0;
}

fn frame(gpu: &Gpu, scene: &Scene, camera: &Camera) -> Linear {
    let mut renderer = device::renderer(gpu, scene, camera, SIZE, true);
    renderer.render(camera, 1.0).unwrap();
    renderer.picture().unwrap().linear.unwrap()
}

/// Direction through a pixel's centre, with a component of 1 along the view axis.
fn ray(eye: &Eye, k: usize) -> [f64; 3] {
    let (x, y) = ((k % SIZE[0] as usize) as f64 + 0.5, (k / SIZE[0] as usize) as f64 + 0.5);
    let (u, v) = (2.0 * x / f64::from(SIZE[0]) - 1.0, 1.0 - 2.0 * y / f64::from(SIZE[1]));
    [0, 1, 2].map(|i| eye.forward[i] + u * eye.tangents[0] * eye.right[i] + v * eye.tangents[1] * eye.up[i])
}

#[test]
fn a_plain_is_as_far_and_as_bright_as_geometry_says() {
    let gpu = device::open();
    for elevation in [90.0, 35.0, 3.0] {
        let scene = plain(elevation);
        let eye = Eye::new(&scene.cameras[0], &scene.terrain, SIZE);
        let l = frame(&gpu, &scene, &scene.cameras[0]);
        let (mut depth, mut sun, mut sky) = (Worst::default(), Worst::default(), Worst::default());
        let mut ground = 0;
        for k in 0..l.depth.len() {
            let d = ray(&eye, k);
            let t = -eye.position[2] / d[2];
            let hit = [0, 1].map(|i| eye.position[i] + t * d[i]);
            // A pixel at the border may go either way.
            let inside = |room: f64| t > 0.0 && hit.iter().all(|v| (room..=400.0 - room).contains(v));
            if inside(1.0) {
                ground += 1;
                // Corners of triangles are rounded to 1/256 pixel where a device has the 8 sub-pixel bits that are promised:
                // half of one moves the ground that a pixel sees by 1/512 of what it is farther a pixel higher up. Depth itself
                // is a single.
                let pixel = 2.0 / f64::from(SIZE[1]) * eye.tangents[1] * eye.up[2] / d[2].abs();
                // llvmpipe does better.
                let bound = if gpu.info().kind == "cpu" { 2e-4 } else { pixel / 512.0 + 1e-6 };
                depth.note((f64::from(l.depth[k]) / t - 1.0).abs() / bound, || {
                    format!("pixel {k}: {} {t}", l.depth[k])
                });
                for c in 0..3 {
                    let want = ALBEDO[c] * elevation.to_radians().sin() * E[c] / PI;
                    sun.note((f64::from(l.sun[k][c]) / want - 1.0).abs(), || {
                        format!("pixel {k}: {:?} {want}", l.sun[k])
                    });
                    let want = ALBEDO[c] * SKY[c];
                    sky.note((f64::from(l.sky[k][c]) / want - 1.0).abs(), || {
                        format!("pixel {k}: {:?} {want}", l.sky[k])
                    });
                }
            } else if !inside(-1.0) {
                assert_eq!(l.depth[k], 0.0, "pixel {k} shows the sky");
                assert_eq!(l.sun[k], [0.0; 3]);
                for (drawn, given) in l.sky[k].iter().zip(SKY) {
                    sky.note((f64::from(*drawn) / given - 1.0).abs(), || {
                        format!("pixel {k}: {:?}", l.sky[k])
                    });
                }
            }
        }
        assert!(ground > 1000, "{ground}");
        depth.within(1.0, "depth, in units of its bound");
        // Half floats: half a step of 2^-10, twice where the reference value rounds as well. No pixel is in shadow.
        sun.within(1.0 / 1024.0, &format!("sunlight at {elevation} degrees"));
        sky.within(1.0 / 1024.0, "skylight");
    }
    gpu.close().unwrap();
}

#[test]
fn hills_gentler_than_the_sun_shade_nothing() {
    let gpu = device::open();
    for (elevation, amplitude) in [(60.0, 6.0), (35.0, 6.0), (20.0, 3.0), (89.9, 6.0)] {
        let mut scene = plain(elevation);
        // Slopes up to 0.35 * 6 / 10: 12 degrees, and 6 for the low sun.
        hills(&mut scene, amplitude);
        let shadowed = frame(&gpu, &scene, &scene.cameras[0]);
        // Cascades that end before the ground begins are as good as none.
        scene.settings.set("shadow_distance", 0.5).unwrap();
        let open = frame(&gpu, &scene, &scene.cameras[0]);
        let wrong = shadowed.sun.iter().zip(&open.sun).filter(|(a, b)| a != b).count();
        println!("sun at {elevation}: {wrong} of {} pixels shade themselves", open.sun.len());
        assert_eq!(wrong, 0, "sun at {elevation}: pixels in their own shadow");
        assert!(open.sun.iter().any(|c| c[0] > 0.0));
    }
    gpu.close().unwrap();
}

#[test]
fn a_ridge_and_a_tree_throw_their_shadows_away_from_the_sun() {
    let gpu = device::open();
    // A ridge along x = 200, 40 m high, 80 m wide; the sun in the east at 20 degrees: shadow to the west of it.
    let mut scene = plain(20.0);
    let samples =
        (0..41 * 41u32).map(|k| (40.0 - 10.0 * (f64::from(k % 41) - 20.0).abs()).max(0.0) as f32).collect();
    scene.terrain.heights = Some(Raster { width: 41, height: 41, samples });
    scene.terrain.cell_size = 10.0;
    let above = device::camera([200.0, 200.0, 300.0], [200.0, 200.0, 0.0]);
    let eye = Eye::new(&above, &scene.terrain, SIZE);
    let l = frame(&gpu, &scene, &above);
    let lit = E[0] * ALBEDO[0] * 20f64.to_radians().sin() / PI;
    // Ground at x metres, on the row through the middle.
    let at = |x: f64| {
        let k = (0..SIZE[0] as usize)
            .map(|c| c + SIZE[0] as usize * (SIZE[1] as usize / 2))
            .min_by_key(|k| {
                let d = ray(&eye, *k);
                ((eye.position[0] + f64::from(l.depth[*k]) * d[0] - x).abs() * 1e3) as u64
            })
            .unwrap();
        f64::from(l.sun[k][0]) / lit
    };
    // The crest's shadow reaches 40 / tan 20 = 110 m: to x = 90.
    println!("60 m: {}, 110 m: {}, 140 m: {}, 260 m: {}", at(60.0), at(110.0), at(140.0), at(260.0));
    assert!((at(60.0) - 1.0).abs() < 0.01 && (at(260.0) - 1.0).abs() < 0.01);
    assert!(at(110.0) < 0.01 && at(140.0) < 0.01);

    // A birch in the middle of a plain; the sun in the east at 45 degrees. Where is the ground darker?
    let mut scene = plain(45.0);
    let with_tree = device::small_scene(
        "[terrain]\nextent = 400.0\n[[species]]\nname = \"a\"\nmodel = \"builtin:birch\"\ndensity = 0.0\n\
         [[camera]]\nname = \"c\"\nposition = [0.0, 0.0, 9.0]\ntarget = [9.0, 9.0, 0.0]\nvertical_fov = 50.0\n",
    );
    scene.species = with_tree.species;
    // Near enough to have its own light, not the average.
    scene.settings.set("zfield_min_pixels", 0.5).unwrap();
    let tree = TreePosition { x: 200.0, y: 200.0, scale: Some(1.0), rotation: Some(0.0) };
    scene.species[0].distribution = Distribution::Positions(Arc::new(vec![tree]));
    let above = device::camera([200.0, 200.0, 70.0], [200.0, 200.0, 0.0]);
    let eye = Eye::new(&above, &scene.terrain, SIZE);
    let l = frame(&gpu, &scene, &above);
    let lit = E[0] * ALBEDO[0] * 45f64.to_radians().sin() / PI;
    let (mut dark, mut centre) = (0.0, [0.0; 2]);
    for k in (0..l.sun.len()).filter(|k| l.species[*k] == 0 && l.depth[*k] > 0.0) {
        let missing = 1.0 - f64::from(l.sun[k][0]) / lit;
        assert!(missing > -0.002, "pixel {k} is brighter than the sun makes it: {missing}");
        let d = ray(&eye, k);
        dark += missing.max(0.0);
        (0..2).for_each(|i| {
            centre[i] += missing.max(0.0) * (eye.position[i] + f64::from(l.depth[k]) * d[i] - 200.0)
        });
    }
    let centre = centre.map(|c| c / dark);
    let pixel = 70.0 * 2.0 * eye.tangents[1] / f64::from(SIZE[1]);
    let area = dark * pixel * pixel;
    let bake = &device::bake(&scene)[0].species;
    println!(
        "shadow of {area:.1} m2 at {centre:?}; the tree covers {} m2, {} m high",
        bake.area, bake.crown.height
    );
    // At 45 degrees what is at a height falls as far to the west; crowns of birches are at a third to all of it. What
    // the crown itself hides of its shadow is near the trunk, so the centre lies farther out than the crown's, if at all.
    let height = f64::from(bake.crown.height);
    assert!(centre[0] < -0.3 * height && centre[0] > -height, "{centre:?}");
    assert!(centre[1].abs() < 1.0, "{centre:?}");
    assert!(area > 0.3 * f64::from(bake.area), "{area}");
    gpu.close().unwrap();
}

#[test]
fn a_sky_image_is_seen_where_it_is() {
    let gpu = device::open();
    let mut scene = plain(35.0);
    let uniform = frame(&gpu, &scene, &scene.cameras[0]);
    let (width, height) = (16u32, 8u32);
    let image = |f: &dyn Fn(u32, u32) -> [f32; 3]| Sky::LatLong {
        width,
        height,
        pixels: Arc::new((0..width * height).flat_map(|k| f(k % width, k / width)).collect()),
    };
    // An image of one colour is the uniform sky. Half floats twice, on the way in and out.
    scene.sky = image(&|_, _| SKY.map(|c| c as f32));
    let same = frame(&gpu, &scene, &scene.cameras[0]);
    let mut worst = Worst::default();
    for (a, b) in uniform.sky.iter().zip(&same.sky) {
        for c in 0..3 {
            worst.note((f64::from(b[c]) / f64::from(a[c]) - 1.0).abs(), || format!("{a:?} {b:?}"));
        }
    }
    worst.within(2.0 / 1024.0, "one colour");
    // Red grows from the zenith down, green from north by east around, except at the seam.
    scene.sky = image(&|x, y| [(y as f32 + 0.5) / height as f32, (x as f32 + 0.5) / width as f32, 0.5]);
    let mut worst = Worst::default();
    for (x, y, z) in
        [(1.0, 0.2, 0.6), (-0.4, -1.0, 0.5), (0.5, 1.0, 1.0), (-1.0, 0.3, 2.0), (0.2, -0.5, -0.3)]
    {
        let from = [200.0, 200.0, 30.0];
        let camera = device::camera(from, [from[0] + x, from[1] + y, from[2] + z]);
        let eye = Eye::new(&camera, &scene.terrain, SIZE);
        let l = frame(&gpu, &scene, &camera);
        for k in (0..l.sky.len()).filter(|k| l.depth[*k] == 0.0) {
            let d = ray(&eye, k);
            let east = d[0].atan2(d[1]).rem_euclid(2.0 * PI) / (2.0 * PI);
            let down = d[0].hypot(d[1]).atan2(d[2]) / PI;
            let near = |v: f64, n: u32| v < 0.5 / f64::from(n) || v > 1.0 - 0.5 / f64::from(n);
            if near(east, width) || near(down, height) {
                continue;
            }
            let error = (f64::from(l.sky[k][0]) - down).abs().max((f64::from(l.sky[k][1]) - east).abs());
            worst.note(error, || format!("{d:?}: {:?}, {down} {east}", l.sky[k]));
        }
    }
    // Half floats in and out (2^-11 each of values up to 1), and 1/256 of a texel of a gradient of 1/8.
    worst.within(1.0 / 1024.0 + 1.0 / 2048.0, "place in the sky");
    gpu.close().unwrap();
}
