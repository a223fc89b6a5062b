//! Tables of a species' forest (G, T, D, E of BN12 §6): coordinates of their nodes, and lookups between them.
//!
//! # Angles
//! BN12 measures in a space scaled vertically so that crowns are as high as wide: S = diag(1, 1, k), with
//! k = `vertical_scale` = crown diameter / crown height. θ_v and θ_l are the zenith angles of S v and S l, v and l being
//! unit vectors from the ground to viewer and light; φ in [0, π] is the azimuth between them, 0 where v = l. Only the
//! labels live in the scaled space: rays are cast in metres, along S⁻¹ of the scaled direction.
//!
//! # Density
//! x = λA: trees per m², times their mean horizontal area A = π `crown.radius`² E(scale²).
//!
//! # Nodes
//! n = `angles` and m = `densities` of them:
//! - θ_i = θ_max i/(n−1), θ_max = 88°;
//! - θ_l relative to θ_v, so that the hotspot's ridge v = l is a grid line and has fine cells about it. With
//!   k₀ = ⌊(n−1)/2⌋: node j ≤ k₀ is θ_v − θ_v s(t), t = (k₀−j)/k₀; node j > k₀ is θ_v + (θ_max − θ_v) s(t),
//!   t = (j−k₀)/(n−1−k₀), s(t) = t² (3 − t²)/2: as t² at the ridge, and no coarser than it must be towards low suns (t² alone leaves a
//!   gap from 67° to 88° under a viewer above, in which T of an oak was up to 15 % off, of a pine 23 %);
//! - φ_k = π (k/(n−1))²;
//! - x_j = x_max (j/(m−1))².
//!
//! # Values
//! - pair, index ((x·n + v)·n + l)·n + φ: (W, S_leaf, S_bark, M). The probability that a ground point is visible and lit is
//!   k_g = exp(−x (sec θ_v + sec θ_l) W); at x = 0, W is the limit. For opaque Poisson spheres W is 1/2 on the ridge and
//!   nears 1 far from it. T = T_leaf + T_bark is the mean over what is visible of trees of the sun that arrives there
//!   (BN12 eq. 16), split by the share of bark under the crown; S = T/F(L_v, L_vl), with L_v = x sec θ_v V and L_vl = x (sec θ_v +
//!   sec θ_l) W the optical paths of the view and of view and light together, and F(a, j) = (1 − exp(−j))/j · a/(1 − exp(−a)) what is lit
//!   of an even layer among what is seen of it: S is what trees make of that, and as nearly constant as the others. M is the mean over the same, weighted by the sun that arrives,
//!   of light transfer ([`super::transfer`]).
//! - view, index x·n + v: (V, E_leaf, E_bark, Γ_v). Visible ground is P = k_g + k_ḡ = exp(−x sec θ_v V). E = E_leaf + E_bark
//!   is the mean over what is visible of trees of the sky's light on it (BN12 eq. 21), over what leaves of no orientation get under
//!   a free sky; Γ_v is the mean coverage by crown discs at
//!   visible ground points.
//! - ground, index x: (D, C), the ground's mean sky visibility (BN12 eq. 18, level) and its mean coverage by discs.
//! - seen_sky, index x·n + v: D_v, the mean sky visibility of the ground that is visible along v. BN12 light all ground with D. But
//!   ground is seen through the gaps that the sky is seen through: in a forest of oaks that covers half of it, what is visible from
//!   above gets a fifth more of the sky than the ground's mean. An even sky is many suns, so
//!   D_v = ∫ k_g(v, l) cos θ_l dl / (π P(v)), of the tables themselves (`crate::bake::tables`).
//! - near_sky, index x·n + v: s(v, x), E over what the hole of eq. 9 leaves of it on average: near trees' sky is brought to E by it.
//!
//! Logarithms per optical path are stored, not probabilities, because they hardly vary: what is interpolated is nearly
//! constant, and beyond x_max, where the last node holds, optical thickness still grows as x.

use std::f64::consts::PI;

use glam::DVec3;

/// Largest zenith angle of a node, rad: 88°.
pub const THETA_MAX: f64 = 88.0 * PI / 180.0;

/// The measured tables.
#[derive(Clone, Debug, PartialEq)]
pub struct ForestTables {
    /// Nodes n of each angle.
    pub angles: u32,
    /// Nodes m of the density.
    pub densities: u32,
    /// Largest x = λA.
    pub max_thickness: f32,
    /// Mean horizontal tree area A, m².
    pub area: f32,
    /// k of S = diag(1, 1, k).
    pub vertical_scale: f32,
    /// 1/r² of the hole around a tree, over the density (BN12, eq. 9).
    pub hole: f32,
    /// (W, S_leaf, S_bark, M).
    pub pair: Vec<[f32; 4]>,
    /// Standard errors of (k_g, S_leaf, S_bark, M).
    pub pair_stderr: Vec<[f32; 4]>,
    /// (V, E_leaf, E_bark, Γ_v).
    pub view: Vec<[f32; 4]>,
    /// Standard errors of (P, E_leaf, E_bark, Γ_v).
    pub view_stderr: Vec<[f32; 4]>,
    /// (D, C).
    pub ground: Vec<[f32; 2]>,
    /// Standard errors of (D, C).
    pub ground_stderr: Vec<[f32; 2]>,
    /// D_v.
    pub seen_sky: Vec<f32>,
    /// s(v, x), of the sky's light on near trees.
    pub near_sky: Vec<f32>,
}

/// Node i of the zenith angle of the view, rad.
pub fn zenith_node(n: usize, i: usize) -> f64 {
    THETA_MAX * i as f64 / (n - 1) as f64
}

/// Zenith angle of v, rad, given that of S v.
pub fn unscaled_zenith(theta: f64, vertical_scale: f64) -> f64 {
    (vertical_scale * theta.sin()).atan2(theta.cos())
}

/// Index of the node of the light's zenith angle that equals the view's.
pub fn ridge(n: usize) -> usize {
    (n - 1) / 2
}

/// s(t): how far from the ridge a node is, of the room on its side.
fn off_ridge(t: f64) -> f64 {
    0.5 * t * t * (3.0 - t * t)
}

/// The inverse; written so that nothing cancels near the ridge.
fn off_ridge_inverse(s: f64) -> f64 {
    let s = s.min(1.0);
    (2.0 * s / (1.5 + (2.25 - 2.0 * s).sqrt())).sqrt()
}

/// Node j of the zenith angle of the light, rad, for a view at zenith angle `theta_v` in [0, θ_max].
pub fn light_node(n: usize, j: usize, theta_v: f64) -> f64 {
    let k0 = ridge(n);
    if j <= k0 {
        let t = (k0 - j) as f64 / k0 as f64;
        theta_v - theta_v * off_ridge(t)
    } else {
        let t = (j - k0) as f64 / (n - 1 - k0) as f64;
        theta_v + (THETA_MAX - theta_v) * off_ridge(t)
    }
}

/// Node k of the azimuth between view and light, rad.
pub fn azimuth_node(n: usize, k: usize) -> f64 {
    let t = k as f64 / (n - 1) as f64;
    PI * t * t
}

/// Node j of the density x = λA.
pub fn density_node(m: usize, j: usize, max_thickness: f64) -> f64 {
    let t = j as f64 / (m - 1) as f64;
    max_thickness * t * t
}

/// Clamps, NaN to the lower bound: lookups must be finite for every input.
fn within(x: f64, low: f64, high: f64) -> f64 {
    x.max(low).min(high)
}

/// Coordinate of the view's zenith angle among its nodes, in [0, n−1]; inverse of [`zenith_node`].
pub fn zenith_coordinate(n: usize, theta_v: f64) -> f64 {
    within(theta_v, 0.0, THETA_MAX) / THETA_MAX * (n - 1) as f64
}

/// Coordinate of the light's zenith angle among its nodes, in [0, n−1]; inverse of [`light_node`]. Where all nodes of a side
/// are one angle (θ_v = 0, θ_v = θ_max), the ridge.
pub fn light_coordinate(n: usize, theta_v: f64, theta_l: f64) -> f64 {
    let (v, l) = (within(theta_v, 0.0, THETA_MAX), within(theta_l, 0.0, THETA_MAX));
    let k0 = ridge(n) as f64;
    // s(t) = |θ_l − θ_v| / (room on that side).
    if l < v {
        k0 - k0 * off_ridge_inverse((v - l) / v.max(1e-6))
    } else if l > v {
        k0 + ((n - 1) as f64 - k0) * off_ridge_inverse((l - v) / (THETA_MAX - v).max(1e-6))
    } else {
        k0
    }
}

/// Coordinate of the azimuth among its nodes, in [0, n−1]; inverse of [`azimuth_node`].
pub fn azimuth_coordinate(n: usize, phi: f64) -> f64 {
    (within(phi.abs(), 0.0, PI) / PI).sqrt() * (n - 1) as f64
}

/// Coordinate of the density among its nodes, in [0, m−1]; inverse of [`density_node`].
pub fn density_coordinate(m: usize, max_thickness: f64, x: f64) -> f64 {
    (within(x, 0.0, max_thickness) / max_thickness).sqrt() * (m - 1) as f64
}

/// sec θ, at most 1000.
pub fn secant(theta: f64) -> f64 {
    1.0 / theta.cos().max(1e-3)
}

/// Angles of viewer and light in scaled space (BN12, eq. 2–4), over ground that a shear has made level.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Angles {
    /// θ_v, rad.
    pub v: f64,
    /// θ_l, rad.
    pub l: f64,
    /// φ in [0, π], rad.
    pub phi: f64,
    /// sec θ_v, at most 1000.
    pub sec_v: f64,
    /// sec θ_l, at most 1000.
    pub sec_l: f64,
    /// Lengths of what has become of the unit vectors to viewer and light.
    pub lengths: [f64; 2],
}

/// Angles of unit vectors to viewer and light over ground of unit normal n, in the space scaled by S = diag(1, 1, k), k =
/// `vertical_scale`. Where v = l, and where either is vertical, φ is 0: nothing depends on it there.
pub fn angles(v: [f64; 3], l: [f64; 3], n: [f64; 3], vertical_scale: f64) -> Angles {
    let normal = DVec3::from(n);
    let level = vertical_scale / normal.z.max(1e-3);
    let sheared = |w: [f64; 3]| DVec3::new(w[0], w[1], level * DVec3::from(w).dot(normal));
    let (v, l) = (sheared(v), sheared(l));
    let zenith = |w: DVec3| w.truncate().length().atan2(w.z);
    // atan2(0, 0) = 0 where either is vertical.
    let (across, along) = (v.truncate().perp_dot(l.truncate()), v.truncate().dot(l.truncate()));
    Angles {
        v: zenith(v),
        l: zenith(l),
        // Never −0, of which atan2 makes π.
        phi: across.abs().atan2(along + 0.0),
        sec_v: 1.0 / (v.z / v.length()).max(1e-3),
        sec_l: 1.0 / (l.z / l.length()).max(1e-3),
        lengths: [v, l].map(DVec3::length),
    }
}

/// 1 where the sun, towards l, is above the horizon of a slope of normal n, smoothly 0 within two degrees of it.
pub fn sun_facing(l: [f64; 3], n: [f64; 3]) -> f64 {
    let t = (DVec3::from(l).dot(DVec3::from(n)) / 0.0349).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// The two nodes around a coordinate, and the weight of the second.
fn cell(coordinate: f64, count: usize) -> (usize, f64) {
    let first = (coordinate as usize).min(count - 2);
    (first, coordinate - first as f64)
}

/// (W, S_leaf, S_bark, M) between the nodes: linear in the four coordinates.
pub fn pair(t: &ForestTables, theta_v: f64, theta_l: f64, phi: f64, x: f64) -> [f64; 4] {
    let (n, m) = (t.angles as usize, t.densities as usize);
    let axes = [
        cell(density_coordinate(m, f64::from(t.max_thickness), x), m),
        cell(zenith_coordinate(n, theta_v), n),
        cell(light_coordinate(n, theta_v, theta_l), n),
        cell(azimuth_coordinate(n, phi), n),
    ];
    let mut sum = [0.0; 4];
    for corner in 0..16 {
        let (mut index, mut weight) = (0, 1.0);
        for (axis, &(first, f)) in axes.iter().enumerate() {
            let second = corner >> axis & 1;
            index = index * if axis == 0 { 1 } else { n } + first + second;
            weight *= if second == 1 { f } else { 1.0 - f };
        }
        for (s, value) in sum.iter_mut().zip(t.pair[index]) {
            *s += weight * f64::from(value);
        }
    }
    sum
}

/// (V, E_leaf, E_bark, Γ_v) between the nodes: linear in the two coordinates.
pub fn view(t: &ForestTables, theta_v: f64, x: f64) -> [f64; 4] {
    std::array::from_fn(|c| between(t, theta_v, x, |k| t.view[k][c]))
}

/// D_v between the nodes: linear in the two coordinates.
pub fn seen_sky(t: &ForestTables, theta_v: f64, x: f64) -> f64 {
    between(t, theta_v, x, |k| t.seen_sky[k])
}

/// s(v, x) between the nodes: linear in the two coordinates.
pub fn near_sky(t: &ForestTables, theta_v: f64, x: f64) -> f64 {
    between(t, theta_v, x, |k| t.near_sky[k])
}

/// What nodes x·n + v have, linear in the two coordinates.
fn between(t: &ForestTables, theta_v: f64, x: f64, node: impl Fn(usize) -> f32) -> f64 {
    let (n, m) = (t.angles as usize, t.densities as usize);
    let (xi, xf) = cell(density_coordinate(m, f64::from(t.max_thickness), x), m);
    let (vi, vf) = cell(zenith_coordinate(n, theta_v), n);
    let along = |x: usize| f64::from(node(x * n + vi)) * (1.0 - vf) + f64::from(node(x * n + vi + 1)) * vf;
    along(xi) * (1.0 - xf) + along(xi + 1) * xf
}

/// (D, C) between the nodes: linear in the coordinate.
pub fn ground(t: &ForestTables, x: f64) -> [f64; 2] {
    let m = t.densities as usize;
    let (i, f) = cell(density_coordinate(m, f64::from(t.max_thickness), x), m);
    std::array::from_fn(|c| f64::from(t.ground[i][c]) * (1.0 - f) + f64::from(t.ground[i + 1][c]) * f)
}

/// P = k_g + k_ḡ = exp(−x sec θ_v V): share of the ground that is visible.
pub fn visible_ground(t: &ForestTables, theta_v: f64, x: f64) -> f64 {
    (-x.max(0.0) * secant(theta_v) * view(t, theta_v, x)[0]).exp()
}

/// k_g = exp(−x (sec θ_v + sec θ_l) W): share of the ground that is visible and lit; at most P.
pub fn joint_ground(t: &ForestTables, theta_v: f64, theta_l: f64, phi: f64, x: f64) -> f64 {
    let w = pair(t, theta_v, theta_l, phi, x)[0];
    // At nodes W is bounded by V; between them, where both are interpolated, not to the last bit.
    (-x.max(0.0) * (secant(theta_v) + secant(theta_l)) * w).exp().min(visible_ground(t, theta_v, x))
}

/// Mean of exp(−x t) over t in [0, 1].
fn mean_through(x: f64) -> f64 {
    if x < 1e-6 { 1.0 - 0.5 * x } else { -(-x).exp_m1() / x }
}

/// F: what is lit of an even layer among what is seen of it, of the optical paths of the view and of view and light together.
pub fn lit_of_seen(seen: f64, joint: f64) -> f64 {
    mean_through(joint) / mean_through(seen)
}

/// (T_leaf, T_bark) and M over level ground, between the nodes.
pub fn light(t: &ForestTables, theta_v: f64, theta_l: f64, phi: f64, x: f64) -> [f64; 3] {
    let [w, leaf, bark, transfer] = pair(t, theta_v, theta_l, phi, x);
    let seen = x * secant(theta_v) * view(t, theta_v, x)[0];
    let layer = lit_of_seen(seen, (x * (secant(theta_v) + secant(theta_l)) * w).max(seen));
    // Between nodes the product of two interpolated factors may be a little more than all.
    let layer = layer.min(1.0 / (leaf + bark).max(1e-6));
    [layer * leaf, layer * bark, transfer]
}
