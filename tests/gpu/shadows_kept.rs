//! What is kept of the shadow maps is what a fresh renderer draws, to the bit, whatever came before.

use crate::casters::hills;
use crate::device;
use canopy::camera::Eye;
use canopy::camera::sun_direction;
use canopy::frame::receivers::needed;
use canopy::frame::shadows::Shadows;
use canopy::frame::{FrameReport, Renderer};
use canopy::gpu::Gpu;
use canopy::image::Picture;
use canopy::scene::{Camera, Scene};

const SIZE: [u32; 2] = [96, 64];

/// Where the camera is and what shines, of a frame.
#[derive(Clone)]
struct Moment {
    camera: Camera,
    azimuth: f64,
}

fn at(position: [f64; 3], target: [f64; 3]) -> Moment {
    Moment { camera: device::camera(position, target), azimuth: 210.0 }
}

fn draw(renderer: &mut Renderer, scene: &Scene, moment: &Moment) -> FrameReport {
    renderer.set_sun(canopy::scene::Sun { azimuth: moment.azimuth, ..scene.sun }).unwrap();
    renderer.render(&moment.camera, 1.0).unwrap()
}

/// The texels of the pages that a moment needs, cascade after cascade, and the picture.
fn result(gpu: &Gpu, renderer: &Renderer, moment: &Moment) -> (Vec<u32>, Picture) {
    let (scene, plan, tree) = (renderer.scene(), renderer.plan(), &renderer.terrain().tree);
    let eye = Eye::new(&moment.camera, &scene.terrain, SIZE);
    let highest = tree.total_range()[1] + plan.tallest;
    let cascades = Shadows::cascades(scene, plan, &eye, sun_direction(&scene.sun), highest);
    let mut texels = Vec::new();
    for (k, (cascade, pages)) in cascades.iter().zip(needed(tree, &eye, &cascades, plan.tallest)).enumerate()
    {
        let map: Vec<u32> = gpu.read_image(&renderer.shadows().map, 0, k as u32).unwrap();
        let (side, page) = (i64::from(cascade.grid.texels), cascade.grid.page());
        for y in 0..side {
            for x in 0..side {
                if pages.rows[(y / page) as usize] >> (x / page) & 1 != 0 {
                    let [u, v] = [cascade.first[0] + x, cascade.first[1] + y].map(|p| p.rem_euclid(side));
                    texels.push(map[(v * side + u) as usize]);
                }
            }
        }
    }
    (texels, renderer.picture().unwrap())
}

/// Draws moments one after the other with one renderer; each is what a fresh one draws. Returns the trees that each drew
/// into shadow maps, and those that fresh renderers did.
fn compare(gpu: &Gpu, scene: &Scene, moments: &[Moment]) -> Vec<[u32; 2]> {
    let new = || device::renderer(gpu, scene, &moments[0].camera, SIZE, true);
    let mut renderer = new();
    let casters = |r: &FrameReport| r.trees.cascades.iter().sum::<u32>();
    let mut counts = Vec::new();
    for (k, moment) in moments.iter().enumerate() {
        let kept = casters(&draw(&mut renderer, scene, moment));
        let mut other = new();
        counts.push([kept, casters(&draw(&mut other, scene, moment))]);
        let (got, want) = (result(gpu, &renderer, moment), result(gpu, &other, moment));
        let wrong = got.0.iter().zip(&want.0).filter(|(a, b)| a != b).count();
        assert!(want.0.iter().any(|t| *t != 0), "moment {k}: the map is empty");
        assert_eq!((wrong, got.0.len()), (0, want.0.len()), "moment {k}: texels of the shadow maps");
        assert!(got.1 == want.1, "moment {k}: the picture differs");
    }
    counts
}

#[test]
fn a_slow_flight_keeps_most_and_a_still_camera_draws_nothing() {
    let gpu = device::open();
    let scene = hills();
    let step = |k: u32| {
        let s = 1.3 * f64::from(k);
        at([300.0 + s, 320.0 + 0.6 * s, 40.0], [360.0 + s, 380.0 + 0.6 * s, 0.0])
    };
    let mut moments: Vec<Moment> = (0..8).map(step).collect();
    moments.push(step(7));
    let counts = compare(&gpu, &scene, &moments);
    println!("casters drawn, and by fresh renderers: {counts:?}");
    assert!(counts[0][0] == counts[0][1] && counts[0][0] > 100);
    let (kept, fresh) = counts[1..8].iter().fold((0, 0), |(a, b), c| (a + c[0], b + c[1]));
    assert!(kept > 0 && 2 * kept < fresh, "{kept} of {fresh} casters are drawn again");
    assert_eq!(counts[8][0], 0, "nothing moved");
    gpu.close().unwrap();
}

#[test]
fn turns_jumps_and_returns_leave_no_trace() {
    let gpu = device::open();
    let scene = hills();
    let here =
        |angle: f64| at([350.0, 340.0, 12.0], [350.0 + 60.0 * angle.sin(), 340.0 + 60.0 * angle.cos(), 6.0]);
    let moments = [
        here(0.0),
        here(0.4),
        here(2.9),
        here(0.0),
        at([90.0, 600.0, 30.0], [150.0, 500.0, 0.0]),
        // High up, where cascades are coarser.
        at([350.0, 340.0, 95.0], [350.0, 350.0, 0.0]),
        here(0.2),
        at([350.4, 340.1, 12.0], [300.0, 300.0, 6.0]),
        here(0.0),
    ];
    let counts = compare(&gpu, &scene, &moments);
    println!("casters drawn, and by fresh renderers: {counts:?}");
    gpu.close().unwrap();
}

#[test]
fn a_sun_that_moves_and_comes_back_finds_what_it_left() {
    let gpu = device::open();
    let scene = hills();
    let camera = at([300.0, 320.0, 20.0], [360.0, 380.0, 0.0]);
    let under = |azimuth: f64| Moment { azimuth, ..camera.clone() };
    let counts = compare(&gpu, &scene, &[under(210.0), under(212.0), under(210.0), under(90.0), under(90.0)]);
    println!("casters drawn, and by fresh renderers: {counts:?}");
    assert!(counts[..4].iter().all(|c| c[0] == c[1]), "another sun draws all anew");
    assert_eq!(counts[4][0], 0);
    gpu.close().unwrap();
}
