//! From estimates to tables: logarithms, and what theory says of them.

use super::crown::LeafOptics;
use super::measure::{Estimate, Measured, PairEstimate};
use super::{ForestSettings, mean_area, sky};
use crate::physics::crown::Crown;
use crate::physics::tables::ForestTables;
use crate::physics::tables::{density_node, light_node, lit_of_seen, secant, zenith_node};

/// A transmittance counts as measured when it is this many times its standard error.
const SIGNIFICANT: f64 = 4.0;

/// −ln of a transmittance at every density, per density, from estimates of which the first is the limit already.
///
/// Optical thickness never falls with the density, nor below `least`. Where the transmittance drowns in its error, it goes on
/// from the last node that does not in proportion to `growth`, a thickness per density known better: the logarithm of noise
/// would be worse.
fn thickness(estimates: &[Estimate], nodes: &[f64], least: &[f64], growth: &[f64]) -> Vec<f64> {
    let mut all = vec![estimates[0].0.max(least[0])];
    let mut noise = false;
    for (j, &x) in nodes.iter().enumerate().skip(1) {
        let (mean, error) = estimates[j];
        noise |= mean <= SIGNIFICANT * error || mean <= 0.0;
        let measured = if noise { all[j - 1] * growth[j] / growth[j - 1] } else { -mean.ln() / x };
        all.push(measured.max(all[j - 1] * nodes[j - 1] / x).max(least[j]));
    }
    all
}

/// Makes the tables.
pub fn tables(
    (crown, leaf): (&Crown, &LeafOptics),
    forest: &ForestSettings,
    measured: &Measured,
) -> ForestTables {
    let (n, m) = (forest.angles as usize, forest.densities as usize);
    let area = mean_area(crown, forest.scale_range);
    let max_thickness = forest.pattern_density * area;
    let nodes: Vec<f64> = (0..m).map(|j| density_node(m, j, max_thickness)).collect();
    // Nothing is thinner than this, so that all that is divided by has a value.
    let (least, even) = (vec![1e-6; m], vec![1.0; m]);
    let full = forest.measured_density(crown) * area;
    let limit = |x: usize, e: Estimate| if x == 0 { (e.0 / full, e.1) } else { e };
    let mut t = ForestTables {
        angles: forest.angles,
        densities: forest.densities,
        max_thickness: max_thickness as f32,
        area: area as f32,
        vertical_scale: crown.vertical_scale() as f32,
        hole: 0.0,
        pair: vec![[0.0; 4]; m * n * n * n],
        pair_stderr: vec![[0.0; 4]; m * n * n * n],
        view: vec![[0.0; 4]; m * n],
        view_stderr: vec![[0.0; 4]; m * n],
        ground: measured.ground.iter().map(|g| g.map(|e| e.0.clamp(0.0, 1.0) as f32)).collect(),
        ground_stderr: measured.ground.iter().map(|g| g.map(|e| e.1 as f32)).collect(),
        seen_sky: vec![0.0; m * n],
        near_sky: vec![1.0; m * n],
    };
    for v in 0..n {
        let theta_v = zenith_node(n, v);
        let views = &measured.view[v * m..][..m];
        let path: Vec<Estimate> = views.iter().enumerate().map(|(x, e)| limit(x, e.ground)).collect();
        let path = thickness(&path, &nodes, &least, &even);
        for (x, e) in views.iter().enumerate() {
            let value = (path[x] / secant(theta_v)) as f32;
            t.view[x * n + v] = [value, 0.0, 0.0, e.coverage.0.clamp(0.0, 1.0) as f32];
            let ground = if x == 0 { 0.0 } else { e.ground.1 };
            t.view_stderr[x * n + v] = [ground, 0.0, 0.0, e.coverage.1].map(|e| e as f32);
        }
        for l in 0..n {
            let theta_l = light_node(n, l, theta_v);
            let mut estimates = measured.pair[(v * n + l) * m * n..][..m * n].to_vec();
            if theta_v == 0.0 || theta_l == 0.0 {
                estimates.chunks_exact_mut(n).for_each(isotropic);
            }
            let lit: Vec<Estimate> = (0..m).map(|x| limit(x, estimates[x * n].lit)).collect();
            let lit = thickness(&lit, &nodes, &least, &even);
            // No more is visible and lit than is visible, or than is lit.
            let least: Vec<f64> = path.iter().zip(&lit).map(|(p, l)| p.max(*l)).collect();
            let growth: Vec<f64> = path.iter().zip(&lit).map(|(p, l)| p + l).collect();
            for k in 0..n {
                let joint: Vec<Estimate> = (0..m).map(|x| limit(x, estimates[x * n + k].ground)).collect();
                let joint = thickness(&joint, &nodes, &least, &growth);
                for x in 0..m {
                    let e = &estimates[x * n + k];
                    let at = ((x * n + v) * n + l) * n + k;
                    let leaf = e.leaf.0.clamp(0.0, 1.0);
                    let w = joint[x] / (secant(theta_v) + secant(theta_l));
                    // Of an even layer of these paths.
                    let even = lit_of_seen(nodes[x] * path[x], nodes[x] * joint[x]);
                    let [leaf, bark] = [leaf, e.bark.0.clamp(0.0, 1.0 - leaf)].map(|t| t / even);
                    t.pair[at] = [w, leaf, bark, e.transfer.0].map(|v| v as f32);
                    let ground = if x == 0 { 0.0 } else { e.ground.1 };
                    t.pair_stderr[at] =
                        [ground, e.leaf.1 / even, e.bark.1 / even, e.transfer.1].map(|e| e as f32);
                }
            }
        }
    }
    sky::fill(&mut t, &measured.sky, leaf, forest);
    t
}

/// Where view or light is vertical nothing depends on φ: the mean over it, with the largest error of one.
fn isotropic(row: &mut [PairEstimate]) {
    let count = row.len() as f64;
    let mean = |of: fn(&PairEstimate) -> Estimate| {
        let (sum, error) = row.iter().map(of).fold((0.0, 0.0), |s: Estimate, e| (s.0 + e.0, s.1.max(e.1)));
        (sum / count, error)
    };
    let same = PairEstimate {
        ground: mean(|e| e.ground),
        lit: row[0].lit,
        leaf: mean(|e| e.leaf),
        bark: mean(|e| e.bark),
        transfer: mean(|e| e.transfer),
    };
    row.fill(same);
}
