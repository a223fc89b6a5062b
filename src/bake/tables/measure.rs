//! Measuring: ground points for G, P, Γ, D and C; points on crowns for T and E.
//!
//! Every estimate is a mean over independent patches, and its standard error follows from how they differ. Points and
//! azimuths are the same for all angles and densities: tables come out smooth, and differences between entries are known
//! better than the entries.

use std::f64::consts::TAU;

use rayon::prelude::*;

use super::ForestSettings;
use super::crown::Crown;
use super::patch::{Patch, Segment, TURNS, patches};
use super::statistics::{Moments, Sequence, mean, ratio};
use super::trace::{Azimuth, Heading, Hit, Light, Marks, Receiver, light, view};
use crate::physics::hash::{Stream, hash2};
use crate::physics::tables::{azimuth_node, light_node, zenith_node};
use crate::progress::Progress;

/// Independent patches.
pub const PATCHES: usize = 32;
/// Points for quantities that need one ray only, to a point of G and T.
const EXTRA: u32 = 8;

/// An estimate and its standard error.
pub type Estimate = (f64, f64);

/// Estimates at one density and pair of directions.
#[derive(Clone, Copy, Debug, Default)]
pub struct PairEstimate {
    /// G; at density 0 the limit of −ln G / q, q being the share of active points.
    pub ground: Estimate,
    /// Share of the ground that is lit; at density 0 likewise.
    pub lit: f64,
    /// T_leaf.
    pub leaf: Estimate,
    /// T_bark.
    pub bark: Estimate,
}

/// Estimates at one density and view direction.
#[derive(Clone, Copy, Debug, Default)]
pub struct ViewEstimate {
    /// P; at density 0 the limit of −ln P / q.
    pub ground: Estimate,
    /// E_leaf.
    pub leaf: Estimate,
    /// E_bark.
    pub bark: Estimate,
    /// Γ_v.
    pub coverage: Estimate,
}

/// All that is measured.
pub struct Measured {
    /// By (v, l, x, φ), in this order.
    pub pair: Vec<PairEstimate>,
    /// By (v, x).
    pub view: Vec<ViewEstimate>,
    /// (D, C) by x.
    pub ground: Vec<[Estimate; 2]>,
}

/// What the rays of one measurement share.
struct Scene<'a, C, const M: usize> {
    crown: &'a C,
    forest: &'a ForestSettings,
    patches: Vec<Patch>,
    /// Share of active points at each density; 0 beyond the last.
    q: [f32; M],
    /// Trees per m² at each density.
    density: [f32; M],
    vertical_scale: f64,
    largest: f32,
    /// Rays of each kind a patch.
    rays: u32,
}

/// Sums over the rays of one patch.
type Lanes<const M: usize> = [f32; M];

fn add<const M: usize>(sum: &mut Lanes<M>, x: &Lanes<M>) {
    sum.iter_mut().zip(x).for_each(|(s, x)| *s += x);
}

/// A ground point with what its view ray meets.
struct GroundPoint<const M: usize> {
    position: [f32; 2],
    azimuth: f64,
    /// ±1: the side on which φ is laid off; forests look the same in a mirror on average.
    side: f64,
    /// ∏ (1 − q α); at density 0, Σ α.
    visible: Lanes<M>,
    front: Vec<(u32, f32)>,
}

/// A point on a crown, chosen on its view ray.
struct CrownPoint<const M: usize> {
    receiver: Receiver,
    azimuth: f64,
    side: f64,
    /// Visibility over the probability of choosing it.
    weight: Lanes<M>,
    bark: f32,
    front: Vec<(u32, f32)>,
}

/// Points of a view direction, by patch, and sums over them.
struct ViewPoints<const M: usize> {
    ground: Vec<Vec<GroundPoint<M>>>,
    crown: Vec<Vec<CrownPoint<M>>>,
    /// Σ visible and Σ weight, by patch.
    visible: Vec<Lanes<M>>,
    weight: Vec<Lanes<M>>,
    /// Mean of `visible` over the extra points, by patch.
    expected: Vec<[f64; M]>,
}

/// Random numbers of one purpose in one patch.
fn sequence<const D: usize>(purpose: u32, patch: usize) -> Sequence<D> {
    Sequence::new(hash2(purpose, patch as u32))
}

const GROUND: u32 = 1;
const MARGINAL: u32 = 2;
const CROWNS: u32 = 3;
const SKY: u32 = 4;
const CHOICE: u32 = 5;

fn turn(u: f64) -> f64 {
    // A whole step: φ = 0 is exactly the view's own direction for every tree.
    (u * f64::from(TURNS)).floor() * (TAU / f64::from(TURNS))
}

/// Measures everything for a crown, on all threads of the current rayon pool; the same bits for any number of them. M is the
/// number of densities or more.
pub fn measure<C: Crown, const M: usize>(
    crown: &C,
    forest: &ForestSettings,
    progress: &Progress,
) -> Measured {
    let (n, m) = (forest.angles as usize, forest.densities as usize);
    let q = std::array::from_fn(|j| if j < m { (j as f32 / (m - 1) as f32).powi(2) } else { 0.0 });
    let scene = Scene::<C, M> {
        crown,
        forest,
        patches: patches(crown.shape(), forest, PATCHES),
        q,
        density: q.map(|q| q * forest.pattern_density as f32),
        vertical_scale: crown.shape().vertical_scale(),
        largest: forest.scale_range[1],
        rays: forest.rays.div_ceil(PATCHES as u32),
    };
    let ground = scene.ground();
    let by_view: Vec<(Vec<ViewEstimate>, Vec<PairEstimate>)> = (0..n)
        .into_par_iter()
        .map(|v| {
            let theta_v = zenith_node(n, v);
            let (points, estimates) = scene.view_points(theta_v);
            let pairs: Vec<PairEstimate> = (0..n)
                .into_par_iter()
                .flat_map_iter(|l| {
                    let pairs = scene.pairs(&points, light_node(n, l, theta_v));
                    progress.step(1);
                    pairs
                })
                .collect();
            (estimates, pairs)
        })
        .collect();
    let (view, pair): (Vec<_>, Vec<_>) = by_view.into_iter().unzip();
    Measured { pair: pair.concat(), view: view.concat(), ground }
}

impl<C: Crown, const M: usize> Scene<'_, C, M> {
    fn densities(&self) -> usize {
        self.forest.densities as usize
    }

    /// ∏ (1 − q α) over opacities.
    fn product(&self, alphas: impl Iterator<Item = f32>) -> Lanes<M> {
        let mut product = [1.0; M];
        for alpha in alphas {
            product.iter_mut().zip(&self.q).for_each(|(p, q)| *p *= 1.0 - q * alpha);
        }
        product
    }

    /// A random ground point of a patch and an azimuth.
    fn ground_point(&self, patch: &Patch, [x, y, a]: [f64; 3]) -> ([f32; 2], f64) {
        ([x, y].map(|x| (x * f64::from(patch.side)) as f32), turn(a))
    }

    /// Trees whose disc covers a ground point.
    fn discs(&self, patch: &Patch, position: [f32; 2], discs: &mut Vec<u32>) {
        discs.clear();
        let radius = self.crown.shape().crown_radius;
        let segment =
            Segment { origin: position, along: [1.0, 0.0], length: 0.0, reach: radius * self.largest };
        patch.visit(&segment, |tree, d| {
            if d[0] * d[0] + d[1] * d[1] < (radius * tree.scale).powi(2) {
                discs.push(tree.index);
            }
        });
    }

    /// D and C at every density.
    fn ground(&self) -> Vec<[Estimate; 2]> {
        let sums: Vec<[Lanes<M>; 2]> = (0..PATCHES)
            .into_par_iter()
            .map(|p| {
                let patch = &self.patches[p];
                let (mut hits, mut discs) = (Vec::new(), Vec::new());
                let mut sums = [[0.0; M]; 2];
                let random = sequence::<4>(SKY, p);
                for i in 0..EXTRA * self.rays {
                    let [x, y, a, u] = random.at(i);
                    let position = [x, y].map(|x| (x * f64::from(patch.side)) as f32);
                    // Density of directions cos θ/π: sin² θ is uniform.
                    let heading = Heading::single(self.crown, u.sqrt().asin());
                    let azimuth = Azimuth::new(turn(a));
                    view(self.crown, patch, &heading, &azimuth, position, self.largest, &mut hits);
                    add(&mut sums[0], &self.product(hits.iter().map(|h| h.alpha)));
                    self.discs(patch, position, &mut discs);
                    add(&mut sums[1], &self.product(discs.iter().map(|_| 1.0)));
                }
                sums
            })
            .collect();
        let share = 1.0 / f64::from(EXTRA * self.rays);
        let of = |k: usize, x: usize| mean(sums.iter().map(move |s| f64::from(s[k][x]) * share));
        (0..self.densities())
            .map(|x| {
                let (uncovered, error) = of(1, x);
                [of(0, x), (1.0 - uncovered, error)]
            })
            .collect()
    }

    /// View rays of a direction: the points that light is then cast to, and what needs no light.
    fn view_points(&self, theta_v: f64) -> (ViewPoints<M>, Vec<ViewEstimate>) {
        let heading = Heading::new(self.crown, theta_v, self.vertical_scale);
        let by_patch: Vec<_> = (0..PATCHES)
            .into_par_iter()
            .map(|p| {
                let (visible, uncovered) = self.marginals(p, &heading);
                let (crown, sky) = self.crown_points(p, &heading);
                (visible, uncovered, self.ground_points(p, &heading), crown, sky)
            })
            .collect();
        let share = 1.0 / f64::from(EXTRA * self.rays);
        let estimates = (0..self.densities())
            .map(|x| ViewEstimate {
                ground: mean(by_patch.iter().map(|p| f64::from(p.0[x]) * share)),
                leaf: ratio(by_patch.iter().map(|p| (p.4[0][x], p.4[2][x]))),
                bark: ratio(by_patch.iter().map(|p| (p.4[1][x], p.4[2][x]))),
                coverage: if x == 0 {
                    (0.0, 0.0)
                } else {
                    let pairs = by_patch.iter().map(|p| (f64::from(p.1[x]), f64::from(p.0[x])));
                    let (uncovered, error) = ratio(pairs);
                    (1.0 - uncovered, error)
                },
            })
            .collect();
        let expected = by_patch.iter().map(|p| p.0.map(|v| f64::from(v) * share)).collect();
        let mut points = ViewPoints {
            ground: Vec::new(),
            crown: Vec::new(),
            visible: Vec::new(),
            weight: Vec::new(),
            expected,
        };
        for (_, _, ground, crown, _) in by_patch {
            let sum = |lanes: &mut dyn Iterator<Item = &Lanes<M>>| {
                lanes.fold([0.0; M], |mut s, x| {
                    add(&mut s, x);
                    s
                })
            };
            points.visible.push(sum(&mut ground.iter().map(|g| &g.visible)));
            points.weight.push(sum(&mut crown.iter().map(|c| &c.weight)));
            points.ground.push(ground);
            points.crown.push(crown);
        }
        (points, estimates)
    }

    /// Σ visible, and Σ of visible where no disc covers the ground, over the extra points of a patch.
    fn marginals(&self, p: usize, heading: &Heading<C::Aim>) -> (Lanes<M>, Lanes<M>) {
        let patch = &self.patches[p];
        let (mut hits, mut discs) = (Vec::new(), Vec::new());
        let (mut visible, mut uncovered) = ([0.0; M], [0.0; M]);
        let random = sequence(MARGINAL, p);
        for i in 0..EXTRA * self.rays {
            let (position, azimuth) = self.ground_point(patch, random.at(i));
            view(self.crown, patch, heading, &Azimuth::new(azimuth), position, self.largest, &mut hits);
            let mut lanes = self.product(hits.iter().map(|h| h.alpha));
            self.discs(patch, position, &mut discs);
            // A tree whose disc covers the point must be inactive, and then hides nothing either.
            let without = self.product(
                hits.iter()
                    .filter(|h| !discs.contains(&h.tree))
                    .map(|h| h.alpha)
                    .chain(discs.iter().map(|_| 1.0)),
            );
            add(&mut uncovered, &without);
            lanes[0] = hits.iter().map(|h| h.alpha).sum();
            add(&mut visible, &lanes);
        }
        (visible, uncovered)
    }

    /// The points of G in a patch.
    fn ground_points(&self, p: usize, heading: &Heading<C::Aim>) -> Vec<GroundPoint<M>> {
        let (patch, random) = (&self.patches[p], sequence(GROUND, p));
        let mut hits = Vec::new();
        (0..self.rays)
            .map(|i| {
                let (position, azimuth) = self.ground_point(patch, random.at(i));
                let around = Azimuth::new(azimuth);
                view(self.crown, patch, heading, &around, position, self.largest, &mut hits);
                let mut visible = self.product(hits.iter().map(|h| h.alpha));
                visible[0] = hits.iter().map(|h| h.alpha).sum();
                let front = hits.iter().map(|h| (h.tree, h.alpha)).collect();
                GroundPoint { position, azimuth, side: side(GROUND, p, i), visible, front }
            })
            .collect()
    }

    /// The points of T in a patch, and Σ of weighted sky visibility over leaves, over bark, and Σ of weights, for E.
    ///
    /// Rays go through points of crowns' boxes, so that none is wasted where trees are few: a ray is chosen with a density
    /// ∝ Σ 1/scale² over the boxes that it passes, and weighs the inverse. On it, the crown k of visibility
    /// a_k = α_k ∏_{j in front} (1 − q α_j) is chosen with the mean over densities of its share of Σ a.
    fn crown_points(&self, p: usize, heading: &Heading<C::Aim>) -> (Vec<CrownPoint<M>>, [[f64; M]; 3]) {
        let patch = &self.patches[p];
        let shape = self.crown.shape();
        let extent = heading.extent();
        let random = sequence::<4>(CROWNS, p);
        let top = shape.center + shape.half_height;
        let mut hits: Vec<Hit> = Vec::new();
        let mut weights: Vec<Lanes<M>> = Vec::new();
        let (mut points, mut sky) = (Vec::new(), [[0.0; M]; 3]);
        if patch.trees.is_empty() {
            return (points, sky);
        }
        for i in 0..EXTRA * self.rays {
            let [u, v, a, t] = random.at(i);
            let tree = &patch.trees[((t * patch.trees.len() as f64) as usize).min(patch.trees.len() - 1)];
            let angle = turn(a);
            let azimuth = Azimuth::new(angle);
            let (a, b) = ((2.0 * u - 1.0) as f32, (2.0 * v - 1.0) as f32 * extent);
            let [along, across] = heading.ground(self.crown, tree.scale, a, b);
            let [ca, sa] = azimuth.along;
            let position = [
                (tree.position[0] + along * ca - across * sa).rem_euclid(patch.side),
                (tree.position[1] + along * sa + across * ca).rem_euclid(patch.side),
            ];
            let boxes = view(self.crown, patch, heading, &azimuth, position, self.largest, &mut hits);
            // The chosen tree's own box counts even if rounding has put the ray just beside it.
            let ray = 1.0 / boxes.max(1.0 / (self.largest * self.largest));
            weights.clear();
            let (mut through, mut total) = ([1.0; M], [0.0; M]);
            for h in &hits {
                let a: Lanes<M> = std::array::from_fn(|x| ray * h.alpha * through[x]);
                through.iter_mut().zip(&self.q).for_each(|(t, q)| *t *= 1.0 - q * h.alpha);
                add(&mut total, &a);
                weights.push(a);
            }
            for (h, w) in hits.iter().zip(&weights) {
                let bark = shape.bark(h.height);
                let scale = patch.trees[h.tree as usize].scale;
                let below_top = (1.0 - h.height).max(0.0) * shape.half_height * scale;
                for x in 0..M {
                    let hole = self.density[x] * (below_top / self.forest.hole_radius).powi(2);
                    let lit = f64::from(w[x] * h.occlusion / (1.0 + hole));
                    sky[0][x] += lit * f64::from(1.0 - bark);
                    sky[1][x] += lit * f64::from(bark);
                    sky[2][x] += f64::from(w[x]);
                }
            }
            if i >= self.rays {
                continue;
            }
            let lanes = self.densities();
            let share = |w: &Lanes<M>| {
                (0..lanes).map(|x| w[x] / total[x].max(f32::MIN_POSITIVE)).sum::<f32>() / lanes as f32
            };
            let mut pick = Stream::new(hash2(hash2(CHOICE, p as u32), i)).unit() as f32;
            let chosen = weights.iter().position(|w| {
                pick -= share(w);
                pick < 0.0
            });
            let Some(k) = chosen.or(weights.len().checked_sub(1)) else { continue };
            let (hit, probability) = (&hits[k], share(&weights[k]).max(1e-6));
            let out = heading.sine_cosine();
            points.push(CrownPoint {
                receiver: Receiver {
                    position: [0, 1].map(|d| position[d] + hit.metres * out[0] * azimuth.along[d]),
                    z: (hit.metres * out[1]).min(top * self.largest),
                    tree: Some(patch.trees[hit.tree as usize]),
                },
                azimuth: angle,
                side: side(CROWNS, p, i),
                weight: weights[k].map(|w| w / probability),
                bark: shape.bark(hit.height),
                front: hits[..k].iter().map(|h| (h.tree, h.alpha)).collect(),
            });
        }
        (points, sky)
    }

    /// All densities and azimuths of a pair of zenith angles, by (x, φ).
    fn pairs(&self, points: &ViewPoints<M>, theta_l: f64) -> Vec<PairEstimate> {
        let (n, m) = (self.forest.angles as usize, self.densities());
        let heading = Heading::new(self.crown, theta_l, self.vertical_scale);
        let mut marks = Marks::new(self.patches.iter().map(|p| p.trees.len()).max().unwrap_or(0));
        // By patch: the mean share of lit ground; by azimuth and patch, sums of y, t_l, and lit leaves and bark.
        let lit: Vec<[f64; M]> = (0..PATCHES).map(|p| self.lit(p, &heading, &mut marks)).collect();
        let mut sums = vec![[[[0f32; M]; 4]; PATCHES]; n];
        let mut second = vec![[[0f64; M]; 5]; n];
        for (p, patch) in self.patches.iter().enumerate() {
            let mut products = vec![[[0f32; M]; 5]; n];
            for g in &points.ground[p] {
                marks.set(&g.front);
                let receiver = Receiver { position: g.position, z: 0.0, tree: None };
                for k in 0..n {
                    let azimuth = Azimuth::new(g.azimuth + g.side * azimuth_node(n, k));
                    let light: Light<M> = light(
                        self.crown,
                        patch,
                        &heading,
                        &azimuth,
                        (&receiver, &marks),
                        &self.q,
                        self.largest,
                    );
                    let (v, mut l) = (&g.visible, light.alone);
                    let mut y: Lanes<M> = std::array::from_fn(|x| v[x] * light.joint[x]);
                    l[0] = light.sum;
                    y[0] = v[0] + light.sum - light.overlap;
                    add(&mut sums[k][p][0], &y);
                    add(&mut sums[k][p][1], &l);
                    let [vv, ll, vl, yv, yl] = &mut products[k];
                    for x in 0..M {
                        vv[x] += v[x] * v[x];
                        ll[x] += l[x] * l[x];
                        vl[x] += v[x] * l[x];
                        yv[x] += y[x] * v[x];
                        yl[x] += y[x] * l[x];
                    }
                }
            }
            for (to, from) in second.iter_mut().flatten().flatten().zip(products.iter().flatten().flatten()) {
                *to += f64::from(*from);
            }
            for c in &points.crown[p] {
                marks.set(&c.front);
                for k in 0..n {
                    let azimuth = Azimuth::new(c.azimuth + c.side * azimuth_node(n, k));
                    let light: Light<M> = light(
                        self.crown,
                        patch,
                        &heading,
                        &azimuth,
                        (&c.receiver, &marks),
                        &self.q,
                        self.largest,
                    );
                    let [_, _, leaf, bark] = &mut sums[k][p];
                    for x in 0..M {
                        let lit = c.weight[x] * light.own * light.joint[x];
                        leaf[x] += lit * (1.0 - c.bark);
                        bark[x] += lit * c.bark;
                    }
                }
            }
        }
        let mut all = vec![PairEstimate::default(); m * n];
        for (x, row) in all.chunks_exact_mut(n).enumerate() {
            for (k, estimate) in row.iter_mut().enumerate() {
                let rays = f64::from(self.rays);
                let total = |of: &dyn Fn(usize) -> f32| (0..PATCHES).map(|p| f64::from(of(p))).sum::<f64>();
                let moments = Moments {
                    first: [
                        total(&|p| sums[k][p][0][x]),
                        total(&|p| points.visible[p][x]),
                        total(&|p| sums[k][p][1][x]),
                    ],
                    second: second[k].map(|s| s[x]),
                };
                let [bv, bl] = moments.controls(rays * PATCHES as f64);
                let ground = (0..PATCHES).map(|p| {
                    let [y, l] = [0, 1].map(|c| f64::from(sums[k][p][c][x]) / rays);
                    let v = f64::from(points.visible[p][x]) / rays;
                    y - bv * (v - points.expected[p][x]) - bl * (l - lit[p][x])
                });
                let tree = |c: usize| {
                    ratio((0..PATCHES).map(|p| (f64::from(sums[k][p][c][x]), f64::from(points.weight[p][x]))))
                };
                *estimate = PairEstimate {
                    ground: mean(ground),
                    lit: mean(lit.iter().map(|l| l[x])).0,
                    leaf: tree(2),
                    bark: tree(3),
                };
            }
        }
        all
    }

    /// Mean light at the extra ground points of a patch; at density 0, mean Σ α'.
    fn lit(&self, p: usize, heading: &Heading<C::Aim>, marks: &mut Marks) -> [f64; M] {
        let mut sum = [0.0; M];
        marks.set(&[]);
        let (patch, random) = (&self.patches[p], sequence(MARGINAL, p));
        for i in 0..EXTRA * self.rays {
            let (position, azimuth) = self.ground_point(patch, random.at(i));
            let receiver = Receiver { position, z: 0.0, tree: None };
            let around = Azimuth::new(azimuth);
            let mut light: Light<M> =
                light(self.crown, patch, heading, &around, (&receiver, marks), &self.q, self.largest);
            light.alone[0] = light.sum;
            add(&mut sum, &light.alone);
        }
        sum.map(|s| f64::from(s) / f64::from(EXTRA * self.rays))
    }
}

/// ±1 by hash.
fn side(purpose: u32, patch: usize, i: u32) -> f64 {
    if hash2(hash2(purpose, patch as u32), i) & 1 == 0 { 1.0 } else { -1.0 }
}
