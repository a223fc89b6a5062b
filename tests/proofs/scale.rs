//! The same radiance at every distance (BN12, figure 7), and its dependence on the view (figure 8).

use canopy::ladder::Ladder;
use canopy::measure::reflectance::{Method, Request, measure, measure_reference};
use canopy::reference::{Options, Until};

use crate::{device, folder, luminance, oaks, plot};

const SIZE: [u32; 2] = [1024, 768];

#[test]
#[ignore = "takes half an hour"]
fn radiance_does_not_depend_on_distance() {
    // Oaks of 15 m are 256 pixels high at 54 m and 3 pixels at 4.6 km, the hand-over; 20 times that is 93 km.
    let distances = [54.0, 220.0, 600.0, 1300.0, 2600.0, 3700.0, 4300.0, 4700.0, 92_700.0];
    let gpu = device::open();
    let (scene, baked) = oaks(0.05, "");
    let method = Method { patches: 1, pixels: 144, ..Method::default() };
    let views: Vec<[f64; 2]> = [0.0, 45.0, 90.0, 135.0, 180.0]
        .iter()
        .flat_map(|a| [0.0, 20.0, 40.0, 60.0, 70.0].map(|z| [z, *a]))
        .filter(|[z, a]| *z > 0.0 || *a == 0.0)
        .collect();
    let (mut worst, mut all, mut csv) =
        (vec![], vec![], String::from("density,sun,view,azimuth,distance,ratio\n"));
    for density in [0.005, 0.02, 0.05] {
        for sun_zenith in [20.0, 45.0, 70.0] {
            let mut curves: Vec<Vec<[f64; 2]>> = vec![Vec::new(); views.len()];
            for distance in distances {
                let request = Request {
                    sun_zenith,
                    slope: 0.0,
                    distance,
                    drawing: Ladder::BN12.into(),
                    views: views.clone(),
                };
                let camera = (&scene.cameras[0], SIZE);
                let found =
                    measure(&gpu, &scene, &[density], &baked, camera, &method, &request, &mut || ()).unwrap();
                for (curve, m) in curves.iter_mut().zip(found) {
                    curve.push([distance, luminance(m.radiance())]);
                }
            }
            for (view, mut curve) in views.iter().zip(curves) {
                let near = curve[0][1];
                for point in &mut curve {
                    point[1] /= near;
                    csv += &format!(
                        "{density},{sun_zenith},{},{},{},{:.4}\n",
                        view[0], view[1], point[0], point[1]
                    );
                    worst.push((
                        (point[1] - 1.0).abs(),
                        format!("density {density}, sun {sun_zenith}, view {view:?}: {point:.3?}"),
                    ));
                }
                all.push((format!("{density} {sun_zenith} {view:?}"), curve));
            }
        }
    }
    gpu.close().unwrap();
    std::fs::write(folder().join("scale_consistency.csv"), csv).unwrap();
    let title = "Radiance over that of the nearest z-field, 189 views, suns and densities";
    let file = folder().join("scale_consistency.svg");
    plot::lines(&file, title, ("distance, m", "ratio"), (0.8, 1.2), true, &all);
    worst.sort_by(|a, b| b.0.total_cmp(&a.0));
    let within = |bound: f64| worst.iter().filter(|w| w.0 <= bound).count() as f64 / worst.len() as f64;
    println!("within 2 %: {:.3}, 5 %: {:.3}, 10 %: {:.3}", within(0.02), within(0.05), within(0.1));
    worst.iter().take(12).for_each(|w| println!("{:.3}  {}", w.0, w.1));
    // The aim is 0.05 everywhere; what is beyond is within a few degrees of v = l, see the README.
    assert!(within(0.05) >= 0.8 && worst[0].0 <= 0.15);
}

#[test]
#[ignore = "takes minutes"]
fn both_chains_over_distance() {
    // A tree of 15 m is 256 pixels high at 54 m, 30 at 460 m, 12 at 1.2 km and 4 at 3.5 km: each chain's hand-overs are in here.
    let distances = [40.0, 60.0, 200.0, 350.0, 500.0, 800.0, 1300.0, 2600.0, 3600.0, 5000.0, 20_000.0];
    let chains = [
        ("BN12", "mesh:256,zfield:4,shader-map"),
        ("BCF05", "mesh:256,cards:30,shells"),
        ("mixed", "mesh:256,zfield:12,shells"),
    ];
    let views = vec![[0.0, 0.0], [40.0, 0.0], [40.0, 180.0], [60.0, 0.0], [60.0, 180.0]];
    let gpu = device::open();
    let (scene, baked) = oaks(0.008, "");
    let method = Method { patches: 4, pixels: 96, ..Method::default() };
    let options = Options { until: Until::Samples(64), ..Options::default() };
    let truth =
        measure_reference(&scene, &[0.008], &method, [45.0, 0.0], &views, &options, &mut |_| ()).unwrap();
    let mut series: Vec<(String, Vec<[f64; 2]>)> = Vec::new();
    let mut csv = String::from("chain,distance,view,azimuth,ratio,error\n");
    for (name, ladder) in chains {
        let mut lines = vec![Vec::new(); 3];
        for distance in distances {
            let drawing = ladder.parse::<Ladder>().unwrap().into();
            let request = Request { sun_zenith: 45.0, slope: 0.0, distance, drawing, views: views.clone() };
            let camera = (&scene.cameras[0], SIZE);
            let found =
                measure(&gpu, &scene, &[0.008], &baked, camera, &method, &request, &mut || ()).unwrap();
            let ratios: Vec<f64> = found
                .iter()
                .zip(&truth)
                .map(|(m, t)| luminance(m.radiance()) / luminance(t.radiance()))
                .collect();
            for ((view, ratio), t) in views.iter().zip(&ratios).zip(&truth) {
                let error = luminance(t.stderr) / luminance(t.radiance());
                csv += &format!("{name},{distance},{},{},{ratio:.4},{error:.4}\n", view[0], view[1]);
            }
            let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
            println!("{name}, {distance} m: {mean:.3} of the truth; views {ratios:.3?}");
            for (line, ratio) in lines.iter_mut().zip([mean, ratios[3], ratios[4]]) {
                line.push([distance, ratio]);
            }
            // Any chain, anywhere: what docs/shells.md has, and room for its noise.
            assert!(
                (mean - 1.0).abs() < 0.2 && ratios.iter().all(|r| (r - 1.0).abs() < 0.35),
                "{name}, {distance}"
            );
        }
        let what = ["mean of five views", "60\u{b0}, sun behind", "60\u{b0}, sun before"];
        let shown = if name == "mixed" { 1 } else { 3 };
        series
            .extend(what.iter().zip(lines).take(shown).map(|(what, line)| (format!("{name}, {what}"), line)));
    }
    gpu.close().unwrap();
    std::fs::write(folder().join("chains_over_distance.csv"), csv).unwrap();
    let title = "Radiance of oaks over path-traced truth, by the distance that they are drawn for";
    plot::lines(
        &folder().join("chains_over_distance.svg"),
        title,
        ("distance, m", "ratio"),
        (0.7, 1.3),
        true,
        &series,
    );
}

#[test]
#[ignore = "takes minutes"]
fn the_principal_plane_is_a_bowl_with_a_hotspot() {
    let gpu = device::open();
    // BN12, figure 8: sun at 60 degrees, black ground, a1 = 0.2, a2 = 20.
    let (mut scene, baked) = oaks(0.012, "hotspot_amplitude = 0.2\nhotspot_width = 20.0\n");
    scene.terrain.albedo = canopy::scene::Albedo::Uniform([0.0; 3]);
    let views: Vec<[f64; 2]> = (-15..=15).map(|k| [5.0 * f64::from(k), 0.0]).collect();
    let mut series = Vec::new();
    for (name, distance) in [("near, 200 m", 200.0), ("far, 20 km", 20_000.0)] {
        let request = Request {
            sun_zenith: 60.0,
            slope: 0.0,
            distance,
            drawing: Ladder::BN12.into(),
            views: views.clone(),
        };
        let camera = (&scene.cameras[0], SIZE);
        let method = Method { patches: 4, ..Method::default() };
        let found = measure(&gpu, &scene, &[0.012], &baked, camera, &method, &request, &mut || ()).unwrap();
        let curve: Vec<[f64; 2]> = found.iter().map(|m| [m.view[0], luminance(m.radiance())]).collect();
        let at = |zenith: f64| curve.iter().find(|p| p[0] == zenith).unwrap()[1];
        println!("{name}: {curve:.5?}");
        // A bowl: brighter towards both horizons than straight down, but for the peak at the sun's own direction.
        assert!(at(-75.0) > at(-30.0) && at(75.0) > at(0.0), "no bowl");
        let peak = at(60.0);
        assert!(peak > at(50.0) && peak > at(70.0), "no hotspot at 60 degrees");
        assert!(at(45.0) > 1.3 * at(-45.0), "not brighter with the sun behind");
        series.push((name.to_string(), curve));
    }
    gpu.close().unwrap();
    let highest = series.iter().flat_map(|s| &s.1).map(|p| p[1]).fold(0.0, f64::max);
    let title = "Radiance in the plane of the sun at 60 degrees, black ground";
    let axes = ("view zenith, degrees (positive: sun behind)", "luminance");
    plot::lines(&folder().join("principal_plane.svg"), title, axes, (0.0, 1.1 * highest), false, &series);
}
