//! Optics measured from meshes whose optics are known, and what a bake promises about its results.

mod common;

use std::sync::Arc;

use canopy::bake::{BakeSettings, bake_species};
use canopy::scene::{Mesh, OpticsOverride, Texture};

const SMALL: BakeSettings = BakeSettings { rings: 3, resolution: 64, occlusion_rays: 16 };

/// Square cards of side `side`, uniformly placed in a ball of radius `radius` on the ground, uniformly turned.
fn cloud(cards: u32, radius: f32, side: f32) -> Mesh {
    let mut mesh = Mesh { materials: vec![common::material(true)], ..Mesh::default() };
    let mut state = 1u64;
    let mut random = || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 40) as f32 / (1u64 << 24) as f32
    };
    let direction = |random: &mut dyn FnMut() -> f32| {
        let z = 2.0 * random() - 1.0;
        let (s, c) = (std::f32::consts::TAU * random()).sin_cos();
        let r = (1.0 - z * z).sqrt();
        glam::Vec3::new(r * c, r * s, z)
    };
    for _ in 0..cards {
        let center = direction(&mut random) * (radius * random().cbrt()) + glam::Vec3::Z * radius;
        let normal = direction(&mut random);
        let a = normal.any_orthonormal_vector() * side;
        let b = normal.cross(a);
        let p = |s: f32, t: f32| (center + a * s + b * t).to_array();
        let (p0, p1, p2, p3) = (p(-0.5, -0.5), p(0.5, -0.5), p(0.5, 0.5), p(-0.5, 0.5));
        common::push_triangle(&mut mesh, [p0, p1, p2], [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]], 0);
        common::push_triangle(&mut mesh, [p0, p2, p3], [[0.0, 0.0], [1.0, 1.0], [0.0, 1.0]], 0);
    }
    mesh
}

/// A texture of two halves: opaque to the left (u < ½), a hole to the right; one colour.
fn half_mask() -> Arc<Texture> {
    let rgba = (0..64 * 64).flat_map(|i| [188, 188, 188, if i % 64 < 32 { 255 } else { 0 }]).collect();
    Arc::new(Texture { width: 64, height: 64, rgba })
}

#[test]
fn extinction_of_a_dense_cloud_is_half_its_leaf_area_per_volume() {
    // 8 m² a m² of shadow: nearly every ray's first and last leaves lie near the ball's surface.
    let (radius, side) = (3.0f32, 0.2f32);
    let volume = 4.0 / 3.0 * std::f32::consts::PI * radius.powi(3);
    let cards = 15_000;
    let expected = 0.5 * cards as f32 * side * side / volume;
    let bake = bake_species(&cloud(cards, radius, side), &OpticsOverride::default(), &SMALL, true).unwrap();
    // The z-field's envelope lies a mean free path, 1/τ, inside the ball on either side.
    let ratio = bake.extinction / expected;
    assert!((1.0..1.4).contains(&ratio), "{} for {expected}", bake.extinction);
    let area = std::f32::consts::PI * radius * radius;
    assert!((bake.area / area - 1.0).abs() < 0.06, "{} for {area}", bake.area);
    assert!((bake.crown_radius / radius - 1.0).abs() < 0.03);
    assert!((bake.height - 2.0 * radius).abs() < 0.2 && bake.crown_base < 1.5);
    // Material colour, twice halved: r + r/2.
    for (albedo, color) in bake.albedo().iter().zip([0.4, 0.5, 0.2]) {
        assert!((albedo - 1.5 * color).abs() < 1e-5, "{:?}", bake.albedo());
    }
}

#[test]
fn masks_take_their_share_of_the_leaf_area() {
    let whole = cloud(6000, 3.0, 0.3);
    let mut half = whole.clone();
    half.materials[0].texture = Some(half_mask());
    half.materials[0].alpha_cutoff = Some(0.5);
    let optics = OpticsOverride::default();
    let (a, b) = (
        bake_species(&whole, &optics, &SMALL, true).unwrap(),
        bake_species(&half, &optics, &SMALL, true).unwrap(),
    );
    // Half the leaf area, in an envelope that lies a longer free path inside the ball.
    assert!((0.5..0.7).contains(&(b.extinction / a.extinction)), "{} {}", a.extinction, b.extinction);
    // sRGB 188 is 0.5 linear.
    assert!((b.albedo()[1] / a.albedo()[1] - 0.503).abs() < 0.01, "{:?} {:?}", a.albedo(), b.albedo());
    // The same cards a second time, as backs with their corners the other way round, count once.
    let mut doubled = whole.clone();
    for t in whole.triangles.iter() {
        let mut t = *t;
        t.vertices.swap(1, 2);
        doubled.triangles.push(t);
    }
    let c = bake_species(&doubled, &optics, &SMALL, true).unwrap();
    assert_eq!(c.extinction, a.extinction);
}

#[test]
fn stated_optics_win_and_trees_without_leaves_use_bark() {
    let mut mesh = cloud(500, 2.0, 0.4);
    let stated = OpticsOverride {
        leaf_reflectance: Some([0.1, 0.2, 0.3]),
        leaf_transmittance: Some([0.05, 0.0, 0.1]),
        bark_reflectance: Some([0.15; 3]),
        extinction: Some(0.7),
    };
    let bake = bake_species(&mesh, &stated, &SMALL, true).unwrap();
    assert_eq!(bake.extinction, 0.7);
    assert_eq!(bake.albedo(), [0.1f32 + 0.05, 0.2, 0.3 + 0.1]);
    mesh.materials[0].foliage = false;
    assert_eq!(bake_species(&mesh, &stated, &SMALL, true).unwrap().albedo(), [0.15; 3]);
    let bare = bake_species(&mesh, &OpticsOverride::default(), &SMALL, true).unwrap();
    assert_eq!(bare.albedo(), [0.4, 0.5, 0.2]);
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let mesh = cloud(800, 2.0, 0.4);
    let bake = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| bake_species(&mesh, &OpticsOverride::default(), &SMALL, true).unwrap())
    };
    let one = bake(1);
    assert!(one == bake(2) && one == bake(5));
}

#[test]
fn what_cannot_be_baked_is_refused() {
    let mesh = cloud(10, 1.0, 0.5);
    let optics = OpticsOverride::default();
    for settings in [
        BakeSettings { rings: 0, ..SMALL },
        BakeSettings { rings: 17, ..SMALL },
        BakeSettings { resolution: 8, ..SMALL },
        BakeSettings { resolution: 100, ..SMALL },
        BakeSettings { occlusion_rays: 0, ..SMALL },
    ] {
        assert_eq!(bake_species(&mesh, &optics, &settings, true).unwrap_err().exit_code(), 2, "{settings:?}");
    }
    assert!(bake_species(&Mesh::default(), &optics, &SMALL, true).is_err());
    let mut flat = Mesh { materials: vec![common::material(true)], ..Mesh::default() };
    let p = [[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0]];
    common::push_triangle(&mut flat, p, [[0.0; 2]; 3], 0);
    assert!(bake_species(&flat, &optics, &SMALL, true).is_err());
}
