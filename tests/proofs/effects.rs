//! The six effects of BN12, figure 9, near and far, each as a number and a picture.

use canopy::camera::Eye;
use canopy::frame::Renderer;
use canopy::ladder::Ladder;
use canopy::measure::reflectance::{Measured, Method, Request, measure, patch_scene};
use canopy::plan::Plan;
use canopy::scene::{Scene, Sky};

use crate::{bake, device, folder, luminance, oaks};

const SIZE: [u32; 2] = [1024, 768];
/// Near, z-fields of 140 pixels; far, the shader-map.
const DISTANCES: [(&str, f64); 2] = [("near", 100.0), ("far", 20_000.0)];

struct Bench {
    scene: Scene,
    baked: Vec<canopy::bake::Baked>,
    gpu: canopy::gpu::Gpu,
}

impl Bench {
    fn at(
        &self,
        distance: f64,
        sun_zenith: f64,
        slope: f64,
        density: f64,
        views: &[[f64; 2]],
    ) -> Vec<Measured> {
        let drawing = Ladder::BN12.into();
        let request = Request { sun_zenith, slope, distance, drawing, views: views.to_vec() };
        let camera = (&self.scene.cameras[0], SIZE);
        let method = Method { patches: 2, ..Method::default() };
        measure(&self.gpu, &self.scene, &[density], &self.baked, camera, &method, &request, &mut || ())
            .unwrap()
    }

    fn radiance(&self, distance: f64, sun_zenith: f64, slope: f64, view: [f64; 2]) -> f64 {
        luminance(self.at(distance, sun_zenith, slope, 0.02, &[view])[0].radiance())
    }
}

#[test]
#[ignore = "takes minutes"]
fn the_six_effects_near_and_far() {
    let (scene, baked) = oaks(0.02, "");
    let b = Bench { scene, baked, gpu: device::open() };
    for (name, d) in DISTANCES {
        let behind = b.radiance(d, 50.0, 0.0, [40.0, 0.0]) / b.radiance(d, 50.0, 0.0, [-40.0, 0.0]);
        println!("{name}: 1. sun behind the viewer over against the sun: {behind:.2}");
        assert!(behind > 1.5);

        let slopes = [-25.0, 0.0, 25.0].map(|s| b.radiance(d, 50.0, s, [0.0, 0.0]));
        println!("{name}: 2. slope away from the sun, level, towards it: {slopes:.5?}");
        assert!(slopes[0] < slopes[1] && slopes[1] < slopes[2]);

        let peak = b.radiance(d, 50.0, 0.0, [50.0, 0.0]);
        let around = 0.5 * (b.radiance(d, 50.0, 0.0, [42.0, 0.0]) + b.radiance(d, 50.0, 0.0, [58.0, 0.0]));
        println!("{name}: 3. hotspot over 8 degrees beside it: {:.3}", peak / around);
        assert!(peak > 1.05 * around);

        // Under an overcast sky one looks down between trees at their dark bases, and at grazing views at their tops.
        let sky = |density: f64, view: f64| {
            let m = &b.at(d, 50.0, 0.0, density, &[[view, 0.0]])[0];
            (luminance(m.sky), m.fractions)
        };
        let per_tree = |(sky, k): (f64, [f64; 4])| sky / (k[2] + k[3]);
        let (down, across) = (per_tree(sky(0.05, 0.0)), per_tree(sky(0.05, 75.0)));
        println!(
            "{name}: 5. dark bases, skylight of dense trees from above over from the side: {:.3}",
            down / across
        );
        assert!(down < across);
    }
    let rim = silver_lining(&b);
    println!("near: 4. silver lining, lit fraction of thin over thick parts of backlit crowns: {rim:.2}");
    assert!(rim > 1.3);
    // 6. Dark ground under trees: the sky's light on it, by density, is table D near and far alike.
    let ground = |d: f64, density: f64| {
        let mut black = b.scene.clone();
        black.species[0].optics.leaf_reflectance = Some([0.0; 3]);
        black.species[0].optics.leaf_transmittance = Some([0.0; 3]);
        black.species[0].optics.bark_reflectance = Some([0.0; 3]);
        let baked = bake(&black);
        let bench = Bench { scene: black, baked, gpu: b.gpu.clone() };
        let m = &bench.at(d, 50.0, 0.0, density, &[[0.0, 0.0]])[0];
        luminance(m.sky) / (m.fractions[0] + m.fractions[1])
    };
    for (name, d) in DISTANCES {
        let (open, closed) = (ground(d, 0.001), ground(d, 0.015));
        println!(
            "{name}: 6. dark ground, skylight on it at 0.015 over at 0.001 trees per m²: {:.3}",
            closed / open
        );
        assert!(closed < 0.7 * open);
    }
    pictures(&b);
    b.gpu.close().unwrap();
}

/// Sparse trees against a low sun: the light that thin parts let through over that of thick ones. Far away they are one pixel,
/// and table T holds their mean.
fn silver_lining(b: &Bench) -> f64 {
    let scene = patch_scene(&b.scene, &[0.0008], 75.0, 0.0).unwrap();
    let eye = Eye::looking([1200.0, 1330.0, 18.0], [0.0, -1.0, -0.06], 40.0, [480, 360]);
    let plan = Plan::for_eye(&scene, &eye, true, Ladder::BN12, Some(b.gpu.info())).unwrap();
    let mut renderer = Renderer::new(&b.gpu, std::sync::Arc::new(scene), plan, &b.baked).unwrap();
    renderer.render_eye(&eye, 1.0).unwrap();
    let l = renderer.picture().unwrap().linear.unwrap();
    // Thin is where some of the pixel's samples show the background.
    let mean = |keep: &dyn Fn(f32) -> bool| {
        let lit: Vec<f64> = (0..l.sun.len())
            .filter(|k| l.coverage[*k] > 0.2 && keep(l.coverage[*k]))
            .map(|k| f64::from(l.fractions[k][2] / (l.fractions[k][2] + l.fractions[k][3]).max(1e-6)))
            .collect();
        lit.iter().sum::<f64>() / lit.len() as f64
    };
    mean(&|c| c < 0.8) / mean(&|c| c >= 0.999)
}

/// One picture an effect, near and far.
fn pictures(b: &Bench) {
    let overcast = |s: &mut Scene| {
        s.sun.irradiance = [0.0; 3];
        s.sky = Sky::Uniform([0.3; 3]);
    };
    for (near, zoom) in [("near", 1.0), ("far", 40.0)] {
        for (name, view, sun, slope) in [
            ("1_sun_behind", [60.0, 0.0], 50.0, 0.0),
            ("1_against_sun", [-60.0, 0.0], 50.0, 0.0),
            ("2_slope_to_sun", [30.0, 0.0], 50.0, 25.0),
            ("2_slope_from_sun", [30.0, 0.0], 50.0, -25.0),
            ("3_hotspot", [50.0, 0.0], 50.0, 0.0),
            ("4_silver_lining", [-78.0, 0.0], 75.0, 0.0),
            ("5_6_overcast", [55.0, 0.0], 50.0, 0.0),
        ] {
            let mut scene = patch_scene(&b.scene, &[0.012], sun, slope).unwrap();
            if name.starts_with("5") {
                overcast(&mut scene);
            }
            let (t, a) = (f64::to_radians(view[0]), f64::to_radians(view[1]));
            let v = [t.sin() * a.sin(), -t.sin() * a.cos(), t.cos()];
            let ground = scene.terrain.height_at(1200.0, 1200.0);
            let distance = 180.0 * if zoom > 1.0 { 5.0 } else { 1.0 };
            let position = [1200.0 + distance * v[0], 1200.0 + distance * v[1], ground + distance * v[2]];
            // Far is the same patch of ground in pixels that are as many times larger.
            let mut eye = Eye::looking(position, v.map(|c| -c), 40.0, [480, 360]);
            eye.pixels_at_1m /= zoom;
            let exposure = canopy::camera::auto_exposure(&scene);
            let plan = Plan::for_eye(&scene, &eye, false, Ladder::BN12, Some(b.gpu.info())).unwrap();
            let mut renderer = Renderer::new(&b.gpu, std::sync::Arc::new(scene), plan, &b.baked).unwrap();
            renderer.render_eye(&eye, exposure).unwrap();
            let file = folder().join(format!("effect_{name}_{near}.png"));
            renderer.picture().unwrap().write_png(&file).unwrap();
        }
    }
}
