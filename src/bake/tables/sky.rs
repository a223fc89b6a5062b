//! The sky's light on trees and on the ground: an even sky is many suns, of each of which the tables know what it does.
//!
//! With T what arrives of a sun's light at what is seen of trees, M what light transfer makes of it and ρp what leaves scatter of it
//! to the viewer, a sky of radiance 1 gives the radiance ∫ T M ρp dl; over half the albedo, which is what a leaf of no
//! orientation scatters of it, that is E(v, x) of the tables.
//!
//! Near trees are drawn from what a z-field knows of a point, its sky visibility δ in the isolated tree and its depth d under the
//! top, as s(v, x) δ / (1 + κ Λ d²): BN12's eq. 9, which has 1 for s, and κ = ¼ (a hole of radius 2/√Λ around every
//! tree). Here κ is what makes (s₀ + s₁ v_z) δ / (1 + κ Λ d²) most like E, of a crown by itself (x = 0) and of the full density; and
//! s(v, x) is what is then left between E and the mean of the rest, so that forests are as bright near as far, and lone trees too.
//!
//! Ground that is visible along v gets D_v of the sky, what suns get to it, over cos θ_l: with paths L of view and light together and
//! L_v of the view, k_g/P = exp(L_v − L). So integrated, the mean D over all ground comes out of exp(−L_l) a little off, by what the few
//! suns of the sum and the tables' nodes leave; D itself is measured (BN12, eq. 18), and D_v is taken over it.
//!
//! Leaves of uniform orientation, seen against an even sky by themselves, have s₀ = 1 and s₁ = ⅔ (r − t)/(r + t): from above more of
//! their upper sides is seen, which the sky lights, and they reflect more than they let through.

use std::f64::consts::{PI, TAU};

use super::ForestSettings;
use super::crown::LeafOptics;
use crate::physics::light;
use crate::physics::tables::ForestTables;
use crate::physics::tables::{
    angles, density_node, joint_ground, light as sunlight, unscaled_zenith as zenith, visible_ground,
    zenith_node,
};

/// Bins an octave of Λd², and octaves from 2⁻¹⁶ on.
const BINS: f64 = 8.0;
const OCTAVES: f64 = 24.0;
/// Most of s(v, x).
const MOST_NEAR: f64 = 8.0;
/// Bounds of κ.
const HOLES: [f64; 2] = [1e-3, 1e3];
/// Suns of the sky: of cos θ, and of φ over half a turn.
const SUNS: u32 = 16;

/// What is seen of the sky by what is seen of trees along a direction, of crowns by themselves and at the full density.
#[derive(Clone, Debug, Default)]
pub struct SkySeen([Points; 2]);

/// Points on trees, by how deep they are.
#[derive(Clone, Debug)]
struct Points {
    /// Σ a, a being what is seen of a point.
    seen: f64,
    /// Σ a δ and Σ a δ Λd², by bins of Λd² at the full density.
    bins: Vec<[f64; 2]>,
}

impl Default for Points {
    fn default() -> Self {
        Points { seen: 0.0, bins: vec![[0.0; 2]; (BINS * OCTAVES) as usize] }
    }
}

impl Points {
    /// Mean δ / (1 + κ Λ d²), with Λ a part of the full density.
    fn left(&self, hole: f64, part: f64) -> f64 {
        let bins = self.bins.iter().filter(|b| b[0] > 0.0);
        let sum: f64 = bins.map(|[w, wu]| w / (1.0 + hole * part * wu / w)).sum();
        if self.seen > 0.0 { sum / self.seen } else { 0.0 }
    }
}

impl SkySeen {
    /// Adds a point that sees `occlusion` of the sky in the isolated tree: what is seen of it there and at the full density, and Λd².
    pub fn note(&mut self, seen: [f32; 2], occlusion: f32, depth: f32) {
        let [occlusion, u] = [occlusion, depth].map(f64::from);
        let bin = (BINS * (u.max(1e-30).log2() + 16.0)).clamp(0.0, BINS * OCTAVES - 1.0) as usize;
        for (points, seen) in self.0.iter_mut().zip(seen.map(f64::from)) {
            points.seen += seen;
            points.bins[bin][0] += seen * occlusion;
            points.bins[bin][1] += seen * occlusion * u;
        }
    }

    /// Adds what was seen elsewhere.
    pub fn add(&mut self, other: &SkySeen) {
        for (points, other) in self.0.iter_mut().zip(&other.0) {
            points.seen += other.seen;
            points.bins.iter_mut().flatten().zip(other.bins.iter().flatten()).for_each(|(s, o)| *s += o);
        }
    }

    /// Mean δ / (1 + κ Λ d²), with Λ a part of the full density. What is seen goes over from crowns by themselves, of which inner
    /// leaves show, to those of the full density, which hide each other's.
    fn left(&self, hole: f64, part: f64) -> f64 {
        let [alone, full] = [0, 1].map(|k| self.0[k].left(hole, part));
        alone + part * (full - alone)
    }
}

/// Unit vectors to the suns of an even sky, of equal solid angles: half of them, for what a mirror at the view's plane leaves the same.
fn suns() -> impl Iterator<Item = [f64; 3]> {
    (0..SUNS * SUNS).map(|i| {
        let cosine = (f64::from(i / SUNS) + 0.5) / f64::from(SUNS);
        let (sine, turn) =
            ((1.0 - cosine * cosine).sqrt(), PI * (f64::from(i % SUNS) + 0.5) / f64::from(SUNS));
        [sine * turn.cos(), sine * turn.sin(), cosine]
    })
}

/// D_v at a view's zenith angle in scaled space, given D.
fn seen_sky(t: &ForestTables, theta_v: f64, x: f64, mean: f64) -> f64 {
    let zenith = zenith(theta_v, f64::from(t.vertical_scale));
    let v = [zenith.sin(), 0.0, zenith.cos()];
    let [mut seen, mut all] = [0.0; 2];
    for l in suns() {
        let a = angles(v, l, [0.0, 0.0, 1.0], f64::from(t.vertical_scale));
        seen += l[2] * joint_ground(t, a.v, a.l, a.phi, x);
        all += l[2] * visible_ground(t, a.l, x);
    }
    let visible = visible_ground(t, theta_v, x);
    // Where nothing is visible, or nothing lit, there is nothing to tell them by.
    if visible * all > 0.0 { (mean * seen / (visible * all)).clamp(0.0, 1.0) } else { mean }
}

/// Fills in E, D_v, κ and s, given all else.
pub fn fill(t: &mut ForestTables, seen: &[SkySeen], leaf: &LeafOptics, forest: &ForestSettings) {
    let (n, m) = (t.angles as usize, t.densities as usize);
    let errors = ForestTables { pair: t.pair_stderr.clone(), ..t.clone() };
    for k in 0..m * n {
        let x = density_node(m, k / n, f64::from(t.max_thickness));
        let [lit_leaf, lit_bark] = sky(t, leaf, zenith_node(n, k % n), x, |[leaf, bark, transfer]| {
            [leaf * transfer, bark * transfer]
        });
        t.view[k][1..3].copy_from_slice(&[lit_leaf as f32, lit_bark as f32]);
        // As if all suns were off by one and the same: at most that.
        let error = sky(&errors, leaf, zenith_node(n, k % n), x, |[leaf, bark, _]| [leaf, bark]);
        t.view_stderr[k][1..3].copy_from_slice(&error.map(|e| e as f32));
        t.seen_sky[k] = seen_sky(t, zenith_node(n, k % n), x, f64::from(t.ground[k / n][0])) as f32;
    }
    let k = f64::from(t.vertical_scale);
    // Cosine of the view's zenith angle, E, and what was seen.
    let nodes = |x: usize| {
        let view = &t.view[x * n..][..n];
        let up = move |v: usize| zenith(zenith_node(n, v), k).cos();
        seen.iter().enumerate().map(move |(v, s)| (up(v), f64::from(view[v][1] + view[v][2]), s))
    };
    let measured = hole_of(&[nodes(0).collect(), nodes(m - 1).collect()]);
    let hole = if forest.hole_radius > 0.0 { f64::from(forest.hole_radius).powi(-2) } else { measured };
    t.hole = hole as f32;
    for k in 0..m * n {
        let (seen, part) = (&seen[k % n], density_node(m, k / n, 1.0));
        let left = seen.left(measured, part);
        let sky = f64::from(t.view[k][1] + t.view[k][2]);
        // Where nothing was seen there is nothing to light.
        t.near_sky[k] = if left > 1e-6 { (sky / left).min(MOST_NEAR) as f32 } else { 1.0 };
        // Another hole than the measured one leaves other light, near and far.
        let ratio = if hole == measured { 1.0 } else { seen.left(hole, part) / left.max(1e-6) };
        t.view[k][1..3].iter_mut().for_each(|e| *e *= ratio as f32);
    }
}

/// A view: cosine of its zenith angle, E, and what was seen.
type Node<'a> = (f64, f64, &'a SkySeen);

/// κ: least squares of (s₀ + s₁ v_z) δ / (1 + κ Λ d²) over E, both of crowns by themselves and of the full density.
fn hole_of(views: &[Vec<Node>; 2]) -> f64 {
    // Given κ, s is linear; over κ the loss has one minimum.
    let loss = |ln_hole: f64| -> f64 {
        let hole = ln_hole.exp();
        let [alone, full] = views;
        let alone = alone.iter().map(|(up, sky, seen)| (*up, *sky, seen.left(hole, 0.0)));
        let all = alone.chain(full.iter().map(|(up, sky, seen)| (*up, *sky, seen.left(hole, 1.0))));
        let all: Vec<_> =
            all.filter(|(_, sky, _)| *sky > 1e-6).map(|(up, sky, law)| (up, law / sky)).collect();
        let sum = |f: &dyn Fn(f64, f64) -> f64| all.iter().map(|(up, g)| f(*up, *g)).sum::<f64>();
        let [a, b, c] = [sum(&|_, g| g * g), sum(&|up, g| g * g * up), sum(&|up, g| g * g * up * up)];
        let [y, z] = [sum(&|_, g| g), sum(&|up, g| g * up)];
        let det = a * c - b * b;
        let s = if det > 1e-9 * a * c { [(y * c - z * b) / det, (z * a - y * b) / det] } else { [1.0, 0.0] };
        sum(&|up, g| ((s[0] + s[1] * up) * g - 1.0).powi(2))
    };
    let [mut low, mut high] = HOLES.map(f64::ln);
    for _ in 0..60 {
        let (a, b) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
        if loss(a) < loss(b) { high = b } else { low = a }
    }
    low.exp()
}

/// Σ over the suns of an even sky of what is scattered to a view at the zenith angle `theta_v` of scaled space, by what `part` makes
/// of (T_leaf, T_bark, M), over half the albedo.
fn sky(
    t: &ForestTables,
    leaf: &LeafOptics,
    theta_v: f64,
    x: f64,
    part: impl Fn([f64; 3]) -> [f64; 2],
) -> [f64; 2] {
    let up = [0.0, 0.0, 1.0];
    let k = f64::from(t.vertical_scale);
    let (sine, cosine) = zenith(theta_v, k).sin_cos();
    let v = [sine, 0.0, cosine];
    let [r, p] = leaf.scattered.map(f64::from);
    let mut sum = [0.0; 2];
    for l in suns() {
        let (a, angle) = (angles(v, l, up, k), light::angle_between(v, l));
        let turned = light::turned_reflectance(f64::from(leaf.turning), angle);
        let scattered = light::leaf_phase(angle, r * turned, p);
        let parts = part(sunlight(t, a.v, a.l, a.phi, x));
        sum.iter_mut().zip(parts).for_each(|(s, x)| *s += scattered * x);
    }
    let half = 0.5 * f64::from(leaf.albedo).max(1e-6);
    sum.map(|s| s * TAU / f64::from(SUNS * SUNS) / half)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Leaves that nothing shadows: the closed form of the module's head.
    #[test]
    fn free_leaves_scatter_the_sky_as_derived() {
        let leaf = LeafOptics { scattered: [0.12, 0.06], turning: 0.0, albedo: 0.18 };
        let (n, m) = (8, 2);
        let mut t = ForestTables {
            angles: n,
            densities: m,
            max_thickness: 1.0,
            area: 10.0,
            vertical_scale: 0.7,
            hole: 0.0,
            // All that is seen is lit: T is S.
            pair: vec![[0.0, 1.0, 0.0, 1.0]; (m * n * n * n) as usize],
            pair_stderr: vec![[0.0; 4]; (m * n * n * n) as usize],
            view: vec![[1.0, 0.0, 0.0, 0.0]; (m * n) as usize],
            view_stderr: vec![[0.0; 4]; (m * n) as usize],
            ground: vec![[1.0, 0.0]; m as usize],
            ground_stderr: vec![[0.0; 2]; m as usize],
            seen_sky: vec![0.0; (m * n) as usize],
            near_sky: vec![0.0; (m * n) as usize],
        };
        // Points under Λd² = 1 that see all of the sky; half of the light is to be left at the full density.
        let mut seen = SkySeen::default();
        seen.note([1.0, 1.0], 1.0, 1.0);
        for p in &mut t.pair[(n * n * n) as usize..] {
            p[1] = 0.5;
        }
        let seen = vec![seen; n as usize];
        let forest = ForestSettings { angles: n, densities: m, ..ForestSettings::default() };
        fill(&mut t, &seen, &leaf, &forest);
        // 16 midpoints of a smooth integrand with a kink at most: a thousandth.
        for v in 0..n as usize {
            let zenith = (0.7 * zenith_node(8, v).sin()).atan2(zenith_node(8, v).cos());
            let want = 1.0 + 2.0 / 3.0 * (0.12 - 0.06) / 0.18 * zenith.cos();
            assert!((f64::from(t.view[v][1]) - want).abs() < 2e-3, "{v}: {} {want}", t.view[v][1]);
        }
        assert!(t.hole > 0.99 && t.hole < 1.01, "{}", t.hole);
        // Points see all of the sky by themselves, and half of it at the full density, which is what the hole says: s is E alone.
        for (k, s) in t.near_sky.iter().enumerate() {
            assert!((s - t.view[k % n as usize][1]).abs() < 5e-3, "{k}: {s}");
        }
        // BN12's hole, κ = 1/4: 1/(1 + 1/4) in place of 1/2, near and far.
        let measured = t.view[n as usize][1];
        fill(&mut t, &seen, &leaf, &ForestSettings { hole_radius: 2.0, ..forest });
        assert_eq!(t.hole, 0.25);
        assert!((t.view[n as usize][1] / measured - 1.6).abs() < 0.01);
    }
}
