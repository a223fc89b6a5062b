//! Real trees through their z-fields, from directions between the stored views, against the meshes rendered
//! from there.

mod common;

use canopy::bake::{BakeSettings, bake_species, verify};

fn check(name: &str, depth: f64) {
    let mesh = common::real_tree(name);
    let settings = BakeSettings {
        rings: 9,
        resolution: 256,
        occlusion_rays: 8,
        transfer_bands: 0,
        transfer_resolution: 128,
    };
    let bake = bake_species(&mesh, &Default::default(), &settings, true).unwrap();
    let report = verify(&mesh, &bake, 10, 2).unwrap();
    for v in &report.views {
        assert!(v.iou > 0.85, "{name}: {v:?}");
        assert!((v.coverage_ratio - 1.0).abs() < 0.05, "{name}: {v:?}");
    }
    let iou = report.mean(|v| v.iou);
    assert!(iou >= 0.9, "{name}: mean silhouette IoU {iou}");
    let median = report.mean(|v| v.median_depth_error);
    assert!(median < depth, "{name}: median depth error {median} m");
    // One iteration more does not do worse.
    let more = verify(&mesh, &bake, 10, 3).unwrap();
    assert!(more.mean(|v| v.iou) > iou - 0.002, "{name}: {} after {iou}", more.mean(|v| v.iou));
}

#[test]
fn oak_between_its_views() {
    check("oak", 0.2);
}

#[test]
fn pine_between_its_views() {
    check("pine", 0.2);
}
