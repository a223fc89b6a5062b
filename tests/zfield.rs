//! Baked views and the reconstruction of surfaces from them, against the closed form of an ellipsoid.

mod common;

use canopy::bake::{BakeSettings, SpeciesBake, bake_species};
use canopy::physics::views::{self, Basis};
use canopy::physics::zfield;
use glam::DVec3;

/// An ellipsoid fills the scaled cylinder as the unit sphere, whatever its proportions.
fn sphere(rings: u32) -> SpeciesBake {
    let settings = BakeSettings {
        rings,
        resolution: 128,
        occlusion_rays: 16,
        transfer_bands: 0,
        transfer_resolution: 64,
    };
    bake_species(&common::ellipsoid(3.0, 6.0, 96), &Default::default(), &settings, true).unwrap()
}

/// Step of an 8-bit depth in scaled space.
const STEP: f64 = 2.0 * std::f64::consts::SQRT_2 / 255.0;

#[test]
fn stored_depths_are_the_closed_form() {
    let bake = sphere(3);
    let field = &bake.views;
    let r = field.resolution as usize;
    let m = r as f64 / (r as f64 - 2.0);
    for (layer, (i, j)) in views::pairs(3).enumerate() {
        let basis = Basis::new(views::direction(3, i, j));
        for row in 0..r {
            for column in 0..r {
                let texel = &field.levels[0][4 * (layer * r * r + row * r + column)..][..4];
                let x = (2.0 * (column as f64 + 0.5) / r as f64 - 1.0) * m;
                let y = (2.0 * (row as f64 + 0.5) / r as f64 - 1.0) * m * basis.extent;
                let outside = x * x + y * y;
                let border = row == 0 || column == 0 || row == r - 1 || column == r - 1;
                if outside > 1.1 || border {
                    assert_eq!(texel, [0; 4], "view ({i}, {j}) at {column}, {row}");
                } else if outside < 0.8 {
                    assert_eq!(texel[3], 255);
                    let depth = (1.0 - outside).sqrt();
                    let decode = |b: u8| (2.0 * f64::from(b) / 255.0 - 1.0) * std::f64::consts::SQRT_2;
                    // Half a step of rounding, and what 96 facets a half turn and the texel's mean leave.
                    assert!(
                        (decode(texel[0]) - depth).abs() < 0.5 * STEP + 4e-3,
                        "{} {depth}",
                        decode(texel[0])
                    );
                    assert!(
                        (decode(texel[1]) + depth).abs() < 0.5 * STEP + 4e-3,
                        "{} {depth}",
                        decode(texel[1])
                    );
                }
            }
        }
    }
    assert_eq!(field.levels.len(), 8);
    let last = field.levels.last().unwrap();
    assert_eq!(last.len(), 4 * views::count(3) as usize);
}

/// The reconstruction finds the sphere from any direction, for viewers near and far, above and below.
#[test]
fn rays_meet_the_sphere() {
    let field = sphere(9).views;
    for zenith in [0.0f64, 3.0, 47.0, 83.0, 90.0, 97.0, 140.0, 180.0] {
        for azimuth in [0.0f64, 31.0, 45.0, 200.0] {
            let ((st, ct), (sa, ca)) = (zenith.to_radians().sin_cos(), azimuth.to_radians().sin_cos());
            let w = DVec3::new(st * ca, st * sa, ct);
            let basis = Basis::new(w);
            for distance in [4.0, 1000.0] {
                for k in 0..40 {
                    let (x, y) = (0.7 * (k as f64 * 0.61).sin(), 0.7 * (k as f64 * 1.3).cos());
                    let through = 0.8 * (x * basis.right + y * basis.up);
                    let c = distance * w;
                    let hit = zfield::view_ray(&field, 0, c, through, 2);
                    let error = (hit.point.length() - 1.0).abs();
                    assert!(error < 0.03, "{error} from {w} at {distance} through {through}");
                    assert!(hit.alpha > 0.9);
                    assert!((0.0..=1.0).contains(&hit.occlusion));
                    // Light from the same side enters where the view ray does.
                    let light = zfield::light_ray(&field, 0, hit.point, w, 1);
                    assert!((light.point - hit.point).length() < 0.05 + 1.0 / distance, "{light:?} {hit:?}");
                }
            }
        }
    }
}

#[test]
fn rays_past_the_tree_meet_nothing() {
    let field = sphere(2).views;
    for w in [DVec3::Z, DVec3::new(0.6, 0.0, 0.8), DVec3::X] {
        let beside = Basis::new(w).right * 1.5;
        let hit = zfield::view_ray(&field, 0, 100.0 * w, beside, 2);
        assert_eq!(hit.alpha, 0.0);
        assert!(hit.s.is_finite() && hit.point.is_finite());
    }
}

#[test]
fn opacity_is_kept_by_the_mips() {
    let bake = sphere(2);
    let field = &bake.views;
    let mean = |level: usize| {
        let bytes = &field.levels[level];
        bytes.chunks_exact(4).map(|t| f64::from(t[3])).sum::<f64>() / (bytes.len() / 4) as f64
    };
    for level in 1..field.levels.len() {
        assert!((mean(level) - mean(0)).abs() < 1.0, "level {level}");
    }
    // The whole tree in one texel: a disc of area π r² seen from above.
    let top = zfield::sample(field, field.levels.len() - 1, views::layer(2, 0, 0), 0.5, 0.5);
    let share = std::f64::consts::PI / 4.0 * (126.0f64 / 128.0).powi(2);
    assert!((top.alpha - share).abs() < 0.01, "{top:?} {share}");
}
