//! Measuring: ground points for G, P, Γ, D and C; points on crowns for T and E.
//!
//! Every estimate is a mean over independent patches, and its standard error follows from how they differ. Points and
//! azimuths are the same for all angles and densities: tables come out smooth, and differences between entries are known
//! better than the entries.

use std::f64::consts::TAU;

use rayon::prelude::*;

use super::ForestSettings;
use super::crown::{CrownModel, TransferAt};
use super::patch::{Patch, Segment, TURNS, patches};
use super::sky::SkySeen;
use super::statistics::{Moments, Sequence, mean, product, ratio};
use super::trace::{Azimuth, Heading, Hit, Light, Marks, Receiver, Toward, light, own, view};
use crate::physics::hash::{Stream, hash2};
use crate::physics::tables::{azimuth_node, density_node, light_node, zenith_node};
use crate::progress::Progress;

/// Independent patches.
pub const PATCHES: usize = 32;
/// Points on crowns to a ground point: light on them varies more than light on the ground, of which the means over view and
/// light alone are known better.
const CROWNS_PER_GROUND: u32 = 4;
/// Ground points for means that need one ray only, to a ground point of G.
const SINGLES: u32 = 16;
/// Points on crowns of which light is followed through their own crown only, to a point of T.
const OWN: u32 = 4;

/// An estimate and its standard error.
pub type Estimate = (f64, f64);

/// Estimates at one density and pair of directions.
#[derive(Clone, Copy, Debug, Default)]
pub struct PairEstimate {
    /// G; at density 0 the limit of −ln G / q, q being the share of active points.
    pub ground: Estimate,
    /// Share of the ground that is lit; at density 0 likewise.
    pub lit: Estimate,
    /// T_leaf.
    pub leaf: Estimate,
    /// T_bark.
    pub bark: Estimate,
    /// M; 1 where nothing is lit.
    pub transfer: Estimate,
}

/// Estimates at one density and view direction.
#[derive(Clone, Copy, Debug, Default)]
pub struct ViewEstimate {
    /// P; at density 0 the limit of −ln P / q.
    pub ground: Estimate,
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
    /// By v.
    pub sky: Vec<SkySeen>,
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
    /// Points of G and of T a patch.
    grounds: u32,
    crowns: u32,
}

/// Sums over the rays of one patch.
type Lanes<const M: usize> = [f32; M];

fn add<const M: usize>(sum: &mut Lanes<M>, x: &Lanes<M>) {
    sum.iter_mut().zip(x).for_each(|(s, x)| *s += x);
}

/// Sums of light over leaves and over bark.
#[derive(Clone, Copy)]
struct Split<const M: usize>([Lanes<M>; 2]);

impl<const M: usize> Split<M> {
    #[inline]
    fn add(&mut self, weight: &Lanes<M>, light: f32, bark_share: f32) {
        let [leaf, wood] = [light * (1.0 - bark_share), light * bark_share];
        for (x, w) in weight.iter().enumerate() {
            self.0[0][x] += w * leaf;
            self.0[1][x] += w * wood;
        }
    }
}

/// Sums over the points on crowns of a patch, of what their own crowns leave of the light: over all, over those whose light
/// is followed on, and over these of what others leave of it.
#[derive(Clone, Copy)]
struct TreeSums<const M: usize> {
    isolated: Split<M>,
    sampled: Split<M>,
    lit: Split<M>,
    /// `lit` of leaves and bark together, with light transfer.
    transferred: Lanes<M>,
}

impl<const M: usize> Default for TreeSums<M> {
    fn default() -> Self {
        let none = Split([[0.0; M]; 2]);
        TreeSums { isolated: none, sampled: none, lit: none, transferred: [0.0; M] }
    }
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
    bark_share: f32,
    transfer: TransferAt,
    /// Crowns in front, of one in [`OWN`] points: the others are looked at for light through their own crown only.
    front: Option<Vec<(u32, f32)>>,
}

/// A crown on a ray, of which some become points.
struct SeenCrown<const M: usize> {
    hit: Hit,
    /// a_k at each density, times the ray's weight.
    weight: Lanes<M>,
    ray: u32,
    /// Where the ray's crowns start.
    first: usize,
    /// The ray's ground point and azimuth.
    position: [f32; 2],
    angle: f64,
}

/// Points of a view direction, by patch, and sums over them.
struct ViewPoints<A, const M: usize> {
    heading: Heading<A>,
    ground: Vec<Vec<GroundPoint<M>>>,
    crown: Vec<Vec<CrownPoint<M>>>,
    /// Σ visible and Σ weight, by patch.
    visible: Vec<Lanes<M>>,
    weight: Vec<Lanes<M>>,
    /// Mean of `visible` over the single points, by patch.
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
pub fn measure<C: CrownModel, const M: usize>(
    crown: &C,
    forest: &ForestSettings,
    progress: &Progress,
) -> Measured {
    let (n, m) = (forest.angles as usize, forest.densities as usize);
    let full = forest.measured_density(crown.crown());
    let share = |j: usize| density_node(m, j, forest.pattern_density) / full;
    let q = std::array::from_fn(|j| if j < m { share(j) as f32 } else { 0.0 });
    let scene = Scene::<C, M> {
        crown,
        forest,
        patches: patches(crown.crown(), forest, PATCHES),
        q,
        density: q.map(|q| q * full as f32),
        vertical_scale: crown.crown().vertical_scale(),
        largest: forest.scale_range[1],
        grounds: forest.rays.div_ceil(PATCHES as u32 * CROWNS_PER_GROUND),
        crowns: forest.rays.div_ceil(PATCHES as u32),
    };
    let ground = scene.ground();
    let by_view: Vec<(Vec<ViewEstimate>, SkySeen, Vec<PairEstimate>)> = (0..n)
        .into_par_iter()
        .map(|v| {
            let theta_v = zenith_node(n, v);
            let (points, estimates, sky) = scene.view_points(theta_v);
            let pairs: Vec<PairEstimate> = (0..n)
                .into_par_iter()
                .flat_map_iter(|l| {
                    let pairs = scene.pairs(&points, light_node(n, l, theta_v));
                    progress.step(1);
                    pairs
                })
                .collect();
            (estimates, sky, pairs)
        })
        .collect();
    let mut measured = Measured { pair: Vec::new(), view: Vec::new(), sky: Vec::new(), ground };
    for (view, sky, pair) in by_view {
        measured.view.extend(view);
        measured.sky.push(sky);
        measured.pair.extend(pair);
    }
    measured
}

impl<C: CrownModel, const M: usize> Scene<'_, C, M> {
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
        let radius = self.crown.crown().radius;
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
                for i in 0..SINGLES * self.grounds {
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
        let share = 1.0 / f64::from(SINGLES * self.grounds);
        let of = |k: usize, x: usize| mean(sums.iter().map(move |s| f64::from(s[k][x]) * share));
        (0..self.densities())
            .map(|x| {
                let (uncovered, error) = of(1, x);
                [of(0, x), (1.0 - uncovered, error)]
            })
            .collect()
    }

    /// View rays of a direction: the points that light is then cast to, and what needs no light.
    fn view_points(&self, theta_v: f64) -> (ViewPoints<C::Aim, M>, Vec<ViewEstimate>, SkySeen) {
        let heading = Heading::new(self.crown, theta_v, self.vertical_scale);
        let by_patch: Vec<_> = (0..PATCHES)
            .into_par_iter()
            .map(|p| {
                let (visible, uncovered) = self.marginals(p, &heading);
                let (crown, sky) = self.crown_points(p, &heading);
                (visible, uncovered, self.ground_points(p, &heading), crown, sky)
            })
            .collect();
        let share = 1.0 / f64::from(SINGLES * self.grounds);
        let estimates = (0..self.densities())
            .map(|x| ViewEstimate {
                ground: mean(by_patch.iter().map(|p| f64::from(p.0[x]) * share)),
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
            heading,
            ground: Vec::new(),
            crown: Vec::new(),
            visible: Vec::new(),
            weight: Vec::new(),
            expected,
        };
        let mut sky_seen = SkySeen::default();
        for (_, _, ground, crown, sky) in by_patch {
            sky_seen.add(&sky);
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
        (points, estimates, sky_seen)
    }

    /// Σ visible, and Σ of visible where no disc covers the ground, over the single points of a patch.
    fn marginals(&self, p: usize, heading: &Heading<C::Aim>) -> (Lanes<M>, Lanes<M>) {
        let patch = &self.patches[p];
        let (mut hits, mut discs) = (Vec::new(), Vec::new());
        let (mut visible, mut uncovered) = ([0.0; M], [0.0; M]);
        let random = sequence(MARGINAL, p);
        for i in 0..SINGLES * self.grounds {
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
        (0..self.grounds)
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

    /// The points of T in a patch, and what all crowns on the rays see of the sky.
    ///
    /// Rays go through points of crowns' boxes, so that few are wasted where trees are few: a ray is found with a density
    /// ∝ Σ 1/scale² over the boxes that it passes, and weighs the inverse. Crown k on it is seen with
    /// a_k = α_k ∏_{j in front} (1 − q α_j). Points of T are chosen among all crowns of all rays, systematically, with
    /// probabilities ∝ the mean over densities of their share of Σ a, so that all count about the same at every density.
    fn crown_points(&self, p: usize, heading: &Heading<C::Aim>) -> (Vec<CrownPoint<M>>, SkySeen) {
        let patch = &self.patches[p];
        let shape = self.crown.crown();
        let (mut sky, full) = (SkySeen::default(), self.densities() - 1);
        let (mut hits, mut seen): (Vec<Hit>, Vec<SeenCrown<M>>) = (Vec::new(), Vec::new());
        let mut total = [0.0; M];
        let (extent, random) = (heading.extent(), sequence::<4>(CROWNS, p));
        for i in 0..if patch.trees.is_empty() { 0 } else { OWN * self.crowns } {
            let [u, v, turned, t] = random.at(i);
            let tree = &patch.trees[((t * patch.trees.len() as f64) as usize).min(patch.trees.len() - 1)];
            let angle = turn(turned);
            let azimuth = Azimuth::new(angle);
            let (a, b) = ((2.0 * u - 1.0) as f32, (2.0 * v - 1.0) as f32 * extent);
            let position = heading.ground(self.crown, patch, tree, &azimuth, (a, b));
            let boxes = view(self.crown, patch, heading, &azimuth, position, self.largest, &mut hits);
            // The chosen tree's own box counts even if rounding has put the ray just beside it.
            let ray = 1.0 / boxes.max(1.0 / (self.largest * self.largest));
            let mut through = [ray; M];
            let first = seen.len();
            for h in &hits {
                let weight = through.map(|t| t * h.alpha);
                through.iter_mut().zip(&self.q).for_each(|(t, q)| *t *= 1.0 - q * h.alpha);
                add(&mut total, &weight);
                seen.push(SeenCrown { hit: *h, weight, ray: i, first, position, angle });
                let scale = patch.trees[h.tree as usize].scale;
                let below_top = (1.0 - h.height).max(0.0) * shape.frame.half_height * scale;
                sky.note([weight[0], weight[full]], h.occlusion, self.density[full] * below_top * below_top);
            }
        }
        let lanes = self.densities();
        let share: Vec<f64> = seen
            .iter()
            .map(|s| (0..lanes).map(|x| f64::from(s.weight[x] / total[x].max(f32::MIN_POSITIVE))).sum())
            .collect();
        let step = share.iter().sum::<f64>() / f64::from(OWN * self.crowns);
        let mut next = Stream::new(hash2(CHOICE, p as u32)).unit() * step;
        let mut points = Vec::new();
        for (index, (s, share)) in seen.iter().zip(&share).enumerate() {
            next -= share;
            while next < 0.0 {
                next += step;
                let azimuth = Azimuth::new(s.angle);
                let (position, z) = heading.point(s.position, &azimuth, s.hit.metres);
                points.push(CrownPoint {
                    receiver: Receiver {
                        position,
                        z,
                        tree: Some(patch.trees[s.hit.tree as usize]),
                        height: s.hit.height,
                    },
                    azimuth: s.angle,
                    side: side(CROWNS, p, s.ray),
                    weight: s.weight.map(|w| (f64::from(w) / share) as f32),
                    bark_share: shape.bark_share(s.hit.height),
                    transfer: heading.transfer(self.crown, &s.hit),
                    front: (points.len() % OWN as usize == OWN as usize / 2)
                        .then(|| seen[s.first..index].iter().map(|f| (f.hit.tree, f.hit.alpha)).collect()),
                });
            }
        }
        (points, sky)
    }

    /// All densities and azimuths of a pair of zenith angles, by (x, φ).
    fn pairs(&self, points: &ViewPoints<C::Aim, M>, theta_l: f64) -> Vec<PairEstimate> {
        let (n, m) = (self.forest.angles as usize, self.densities());
        let heading = Heading::new(self.crown, theta_l, self.vertical_scale);
        let towards: Vec<Toward> =
            (0..n).map(|k| Toward::new(self.crown, &points.heading, &heading, azimuth_node(n, k))).collect();
        let mut marks = Marks::new(self.patches.iter().map(|p| p.trees.len()).max().unwrap_or(0));
        // By patch: the mean share of lit ground; by azimuth and patch, sums of y, t_l, and lit leaves and bark.
        let lit: Vec<[f64; M]> = (0..PATCHES).map(|p| self.lit(p, &heading, &mut marks)).collect();
        let mut sums = vec![[[[0f32; M]; 2]; PATCHES]; n];
        let mut trees = vec![[TreeSums::<M>::default(); PATCHES]; n];
        let mut second = vec![[[0f64; M]; 5]; n];
        for (p, patch) in self.patches.iter().enumerate() {
            let mut products = vec![[[0f32; M]; 5]; n];
            for g in &points.ground[p] {
                marks.set(&g.front);
                let receiver = Receiver { position: g.position, z: 0.0, tree: None, height: 0.0 };
                for k in 0..n {
                    let azimuth = Azimuth::new(g.azimuth + g.side * azimuth_node(n, k));
                    let receiver = (&receiver, 0.0, &marks);
                    let light: Light<M> =
                        light(self.crown, patch, &heading, &azimuth, receiver, &self.q, self.largest);
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
                if let Some(front) = &c.front {
                    marks.set(front);
                }
                for (k, trees) in trees.iter_mut().enumerate() {
                    let trees = &mut trees[p];
                    let azimuth = Azimuth::new(c.azimuth + c.side * azimuth_node(n, k));
                    let own = own(self.crown, patch, &heading, &azimuth, (&c.receiver, &towards[k]));
                    trees.isolated.add(&c.weight, own.lit, c.bark_share);
                    if c.front.is_none() {
                        continue;
                    }
                    let receiver = (&c.receiver, own.entry, &marks);
                    let light: Light<M> =
                        light(self.crown, patch, &heading, &azimuth, receiver, &self.q, self.largest);
                    trees.sampled.add(&c.weight, own.lit, c.bark_share);
                    let weight = std::array::from_fn(|x| c.weight[x] * light.joint[x]);
                    trees.lit.add(&weight, own.lit, c.bark_share);
                    let toward = c.receiver.tree.map_or([0.0, 0.0, 1.0], |t| heading.toward(&azimuth, &t));
                    let sent = own.sent * c.transfer.of(toward, towards[k].strength());
                    add(&mut trees.transferred, &weight.map(|w| w * sent));
                }
            }
        }
        let mut all = vec![PairEstimate::default(); m * n];
        for (x, row) in all.chunks_exact_mut(n).enumerate() {
            for (k, estimate) in row.iter_mut().enumerate() {
                let rays = f64::from(self.grounds);
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
                // Light through the own crown, known from many points, times the share that others leave of it.
                let tree = |kind: usize| {
                    product(trees[k].iter().zip(&points.weight).map(|(t, w)| {
                        [t.isolated.0[kind][x], w[x], t.lit.0[kind][x], t.sampled.0[kind][x]].map(f64::from)
                    }))
                };
                *estimate = PairEstimate {
                    ground: mean(ground),
                    lit: mean(lit.iter().map(|l| l[x])),
                    leaf: tree(0),
                    bark: tree(1),
                    transfer: match ratio(trees[k].iter().map(|t| {
                        let plain = t.lit.0.map(|lanes| f64::from(lanes[x]));
                        (f64::from(t.transferred[x]), plain[0] + plain[1])
                    })) {
                        (0.0, _) => (1.0, 0.0),
                        estimate => estimate,
                    },
                };
            }
        }
        all
    }

    /// Mean light at the single ground points of a patch; at density 0, mean Σ α'.
    fn lit(&self, p: usize, heading: &Heading<C::Aim>, marks: &mut Marks) -> [f64; M] {
        let mut sum = [0.0; M];
        marks.set(&[]);
        let (patch, random) = (&self.patches[p], sequence(MARGINAL, p));
        for i in 0..SINGLES * self.grounds {
            let (position, azimuth) = self.ground_point(patch, random.at(i));
            let receiver = Receiver { position, z: 0.0, tree: None, height: 0.0 };
            let around = Azimuth::new(azimuth);
            let mut light: Light<M> =
                light(self.crown, patch, heading, &around, (&receiver, 0.0, marks), &self.q, self.largest);
            light.alone[0] = light.sum;
            add(&mut sum, &light.alone);
        }
        sum.map(|s| f64::from(s) / f64::from(SINGLES * self.grounds))
    }
}

/// ±1 by hash.
fn side(purpose: u32, patch: usize, i: u32) -> f64 {
    if hash2(hash2(purpose, patch as u32), i) & 1 == 0 { 1.0 } else { -1.0 }
}
