//! Rays through a patch: what a viewer sees on them, and what light they bring.
//!
//! Trees are active with probability q = Λ / pattern density each, independently. Given the full pattern, expectations over
//! that thinning are exact products, for all densities from the same crowns: with opacities α_j on a view ray and α'_m on a
//! ray of light, E[∏ (1−α_j) ∏ (1−α'_m)] = ∏ (1 − q c), c = α for a crown on one ray and α + α' − αα' for one on both.

use std::f64::consts::{FRAC_PI_2, TAU};

use super::crown::{Cast, CrownModel, TransferAt};
use super::patch::{Patch, Segment, TURNS, Tree};
use crate::physics::tables::unscaled_zenith;
use crate::physics::{correction, transfer};

/// A direction of parallel rays: their slope in metres and in the scaled space of the tree.
pub struct Heading<A> {
    /// sin and cos of the zenith angle in metres.
    sine: f32,
    cosine: f32,
    /// The same of the unit vector w of the tree's scaled space.
    scaled: [f32; 2],
    /// Length of S⁻¹ v: depth in the scaled space a metre along the ray, for a tree of scale 1.
    depth_per_metre: f32,
    /// By azimuth in [`TURNS`] steps.
    aims: Vec<A>,
}

impl<A> Heading<A> {
    /// Rays at a zenith angle θ < 90°, rad, in the space scaled vertically by `vertical_scale`.
    pub fn new<C: CrownModel<Aim = A>>(crown: &C, theta: f64, vertical_scale: f64) -> Self {
        let zenith = unscaled_zenith(theta, vertical_scale);
        let tree_zenith = Self::tree_zenith(crown, zenith);
        let aims =
            (0..TURNS).map(|k| crown.aim(tree_zenith, TAU * f64::from(k) / f64::from(TURNS))).collect();
        Self::with(crown, zenith, aims)
    }

    /// A single ray at a zenith angle in metres, rad, with the azimuth that trees see it from.
    pub fn single<C: CrownModel<Aim = A>>(crown: &C, zenith: f64) -> Self {
        Self::with(crown, zenith.min(FRAC_PI_2 - 0.01), Vec::new())
    }

    fn tree_zenith<C: CrownModel<Aim = A>>(crown: &C, zenith: f64) -> f64 {
        let frame = crown.crown().frame;
        (zenith.sin() / f64::from(frame.half_width)).atan2(zenith.cos() / f64::from(frame.half_height))
    }

    fn with<C: CrownModel<Aim = A>>(crown: &C, zenith: f64, aims: Vec<A>) -> Self {
        let frame = crown.crown().frame;
        let (x, z) =
            (zenith.sin() / f64::from(frame.half_width), zenith.cos() / f64::from(frame.half_height));
        let (scaled_sine, scaled_cosine) = Self::tree_zenith(crown, zenith).sin_cos();
        Heading {
            sine: zenith.sin() as f32,
            cosine: zenith.cos() as f32,
            scaled: [scaled_sine as f32, scaled_cosine as f32],
            depth_per_metre: x.hypot(z) as f32,
            aims,
        }
    }

    /// Angle to another heading that an azimuth parts from it, rad; 0 exactly for the same.
    pub fn angle_to(&self, other: &Self, azimuth: f64) -> f64 {
        let [(s0, c0), (s1, c1)] = [self, other].map(|h| (f64::from(h.sine), f64::from(h.cosine)));
        let (across, along) = azimuth.sin_cos();
        let chord = (s0 - s1 * along).hypot(s1 * across).hypot(c0 - c1);
        2.0 * (0.5 * chord).min(1.0).asin()
    }

    /// Half extents of a crown's box across the ray: |a| ≤ 1, |b| ≤ sin + cos.
    pub fn extent(&self) -> f32 {
        self.scaled[0] + self.scaled[1]
    }

    /// Where a tree's ray (a, b) leaves the ground.
    pub fn ground<C: CrownModel>(
        &self,
        crown: &C,
        patch: &Patch,
        tree: &Tree,
        azimuth: &Azimuth,
        (a, b): (f32, f32),
    ) -> [f32; 2] {
        let frame = crown.crown().frame;
        let [s, c] = self.scaled;
        let metres = frame.half_width * tree.scale;
        let (along, across) = (-(b + s * frame.centre / frame.half_height) * metres / c, a * metres);
        let [ca, sa] = azimuth.along;
        let [x, y] = tree.position;
        [x + along * ca - across * sa, y + along * sa + across * ca].map(|v| v.rem_euclid(patch.side))
    }

    /// Light transfer of what a view ray along this heading has hit.
    pub fn transfer<C: CrownModel<Aim = A>>(&self, crown: &C, hit: &Hit) -> TransferAt {
        crown.transfer(&self.aims[hit.step as usize], hit.at)
    }

    /// The unit vector along the rays, in a tree's own axes.
    pub fn toward(&self, azimuth: &Azimuth, tree: &Tree) -> [f32; 3] {
        let (s, c) = (std::f32::consts::TAU * tree.turn as f32 / TURNS as f32).sin_cos();
        let [x, y] = azimuth.along;
        [self.sine * (x * c + y * s), self.sine * (y * c - x * s), self.cosine]
    }

    /// Horizontal position and height, `metres` along a ray from the ground.
    pub fn point(&self, ground: [f32; 2], azimuth: &Azimuth, metres: f32) -> ([f32; 2], f32) {
        ([0, 1].map(|k| ground[k] + metres * self.sine * azimuth.along[k]), metres * self.cosine)
    }
}

/// An azimuth: in steps of a turn, and as a unit vector.
#[derive(Clone, Copy, Debug)]
pub struct Azimuth {
    /// Nearest step.
    pub step: u32,
    /// Unit vector.
    pub along: [f32; 2],
}

impl Azimuth {
    /// Of an angle, rad.
    pub fn new(angle: f64) -> Self {
        let (s, c) = angle.sin_cos();
        let step = (angle / TAU * f64::from(TURNS)).round().rem_euclid(f64::from(TURNS)) as u32;
        Azimuth { step, along: [c as f32, s as f32] }
    }
}

/// A crown's box on a ray.
struct Met {
    a: f32,
    b: f32,
    /// Depth of the ray's origin along w.
    depth: f32,
    /// Metres along the ray for a unit of depth.
    metres: f32,
    /// Azimuth that the tree sees the ray from.
    step: u32,
}

/// The ray's coordinates at a tree, `offset` being from the trunk to the origin at height `z`; `None` where it misses the box.
#[inline]
fn at_tree<C: CrownModel>(
    crown: &C,
    heading: &Heading<C::Aim>,
    azimuth: &Azimuth,
    tree: &Tree,
    offset: [f32; 2],
    z: f32,
) -> Option<Met> {
    let frame = crown.crown().frame;
    let [ca, sa] = azimuth.along;
    let across = offset[1] * ca - offset[0] * sa;
    if across.abs() >= frame.half_width * tree.scale {
        return None;
    }
    let inverse = 1.0 / (tree.scale * frame.half_width);
    let horizontal = (offset[0] * ca + offset[1] * sa) * inverse;
    let vertical = (z / tree.scale - frame.centre) / frame.half_height;
    let [s, c] = heading.scaled;
    let b = s * vertical - c * horizontal;
    (b.abs() < s + c).then(|| Met {
        a: across * inverse,
        b,
        depth: s * horizontal + c * vertical,
        metres: tree.scale / heading.depth_per_metre,
        step: (azimuth.step + TURNS - tree.turn) & (TURNS - 1),
    })
}

/// A crown on a view ray.
#[derive(Clone, Copy, Debug)]
pub struct Hit {
    /// Number of the tree.
    pub tree: u32,
    /// Opacity.
    pub alpha: f32,
    /// Metres from the ground to p_v.
    pub metres: f32,
    /// Height of p_v in the scaled space of the tree.
    pub height: f32,
    /// Sky visibility δ_v.
    pub occlusion: f32,
    /// p_v in the axes of the ray at the tree: (a, b) and depth.
    pub at: [f32; 3],
    /// Azimuth that the tree sees the ray from.
    pub step: u32,
}

/// Half the corridor's width, m.
fn reach<C: CrownModel>(crown: &C, largest: f32) -> f32 {
    crown.crown().frame.half_width * largest
}

/// Where a ray from height `z` has passed above every tree, m along the ground.
fn length<C: CrownModel>(crown: &C, heading: &Heading<C::Aim>, z: f32, largest: f32) -> f32 {
    let frame = crown.crown().frame;
    let top = (frame.centre + frame.half_height) * largest;
    (top - z).max(0.0) * heading.sine / heading.cosine
}

/// The ray from a ground point to the viewer: `hits` from the viewer's end on, and `boxes`, the sum of 1/scale² of the trees
/// whose boxes it passes.
pub fn view<C: CrownModel>(
    crown: &C,
    patch: &Patch,
    heading: &Heading<C::Aim>,
    azimuth: &Azimuth,
    origin: [f32; 2],
    largest: f32,
    hits: &mut Vec<Hit>,
) -> f32 {
    hits.clear();
    let mut boxes = 0.0;
    let segment = Segment {
        origin,
        along: azimuth.along,
        length: length(crown, heading, 0.0, largest),
        reach: reach(crown, largest),
    };
    let [s, c] = heading.scaled;
    // A heading for one ray only: its aims are made as trees are met.
    let once = heading.aims.is_empty().then(|| f64::from(s.atan2(c)));
    patch.visit(&segment, |tree, offset| {
        let Some(met) = at_tree(crown, heading, azimuth, tree, offset, 0.0) else { return };
        boxes += 1.0 / (tree.scale * tree.scale);
        let seen = if let Some(zenith) = once {
            let aim = crown.aim(zenith, TAU * f64::from(met.step) / f64::from(TURNS));
            crown.seen(&aim, met.a, met.b)
        } else {
            crown.seen(&heading.aims[met.step as usize], met.a, met.b)
        };
        let metres = (seen.depth - met.depth) * met.metres;
        // What lies under the ground is not seen.
        if seen.alpha > 0.0 && metres > 0.0 {
            hits.push(Hit {
                tree: tree.index,
                alpha: seen.alpha.min(1.0),
                metres,
                height: met.b * s + seen.depth * c,
                occlusion: seen.occlusion,
                at: [met.a, met.b, seen.depth],
                step: met.step,
            });
        }
    });
    hits.sort_by(|a, b| b.metres.total_cmp(&a.metres));
    boxes
}

/// Opacities of the crowns in front of a point, by tree; forgotten all at once.
pub struct Marks {
    epoch: u32,
    of_tree: Vec<(u32, f32)>,
}

impl Marks {
    /// For patches of up to `trees` trees.
    pub fn new(trees: usize) -> Self {
        Marks { epoch: 0, of_tree: vec![(0, 0.0); trees] }
    }

    /// Replaces all marks.
    pub fn set(&mut self, front: &[(u32, f32)]) {
        self.epoch += 1;
        for &(tree, alpha) in front {
            self.of_tree[tree as usize] = (self.epoch, alpha);
        }
    }

    #[inline]
    fn get(&self, tree: u32) -> Option<f32> {
        let (epoch, alpha) = self.of_tree[tree as usize];
        (epoch == self.epoch).then_some(alpha)
    }
}

/// A point that light comes to.
#[derive(Clone, Copy, Debug)]
pub struct Receiver {
    /// Horizontal position, m.
    pub position: [f32; 2],
    /// Height above the ground, m.
    pub z: f32,
    /// The tree that it is on.
    pub tree: Option<Tree>,
    /// Height in the scaled space of that tree.
    pub height: f32,
}

/// Light on a ray, at every density.
#[derive(Clone, Copy, Debug)]
pub struct Light<const M: usize> {
    /// ∏ (1 − q α') over the crowns on it.
    pub alone: [f32; M],
    /// ∏ of (1 − q c)/(1 − q α) for marked crowns, 1 − q α' for others: times the view ray's ∏ (1 − q α), the joint product.
    pub joint: [f32; M],
    /// Σ α', and Σ α α' over marked crowns: the products' first orders.
    pub sum: f32,
    pub overlap: f32,
}

/// What depends on the directions of viewer and light only: the phase angle, rad, and the crown's corrections of the share that is lit
/// and of the light that is sent ([`crate::physics::correction`]).
#[derive(Clone, Copy, Debug)]
pub struct Toward {
    angle: f32,
    lit: [f64; 2],
    sent: [f64; 2],
}

impl Toward {
    /// Of two headings that an azimuth parts.
    pub fn new<C: CrownModel>(
        crown: &C,
        view: &Heading<C::Aim>,
        light: &Heading<C::Aim>,
        azimuth: f64,
    ) -> Self {
        let angle = view.angle_to(light, azimuth);
        let terms = correction::terms(view.cosine.into(), light.cosine.into(), angle);
        let crown = crown.crown();
        Toward {
            angle: angle as f32,
            lit: crown.lit.line(&terms, transfer::strength(angle)),
            sent: crown.sent.line(&terms, 1.0),
        }
    }

    /// Strength of light transfer.
    pub fn strength(&self) -> f32 {
        transfer::strength(self.angle.into()) as f32
    }
}

/// What a receiver's own tree makes of the light.
#[derive(Clone, Copy, Debug)]
pub struct Own {
    /// Share of it that is lit.
    pub lit: f32,
    /// Light that is sent to the viewer, over that of leaves that are all lit.
    pub sent: f32,
    /// Metres to where the ray enters the tree.
    pub entry: f32,
}

/// What a receiver's own tree leaves of the light ([`crate::physics::light::self_shadow`], corrected; metres of the model, because
/// what is in a crown grows with it).
#[inline]
pub fn own<C: CrownModel>(
    crown: &C,
    patch: &Patch,
    heading: &Heading<C::Aim>,
    azimuth: &Azimuth,
    (receiver, toward): (&Receiver, &Toward),
) -> Own {
    let Some(tree) = &receiver.tree else { return Own { lit: 1.0, sent: 1.0, entry: 0.0 } };
    // Across the torus the point may lie near another image of its tree.
    let offset = [0, 1].map(|k| {
        let d = receiver.position[k] - tree.position[k];
        d - (d / patch.side).round() * patch.side
    });
    let metres = at_tree(crown, heading, azimuth, tree, offset, receiver.z).and_then(|met| {
        let depth = crown.entry(&heading.aims[met.step as usize], met.a, met.b)?;
        Some(((depth - met.depth) * met.metres).max(0.0))
    });
    let metres = metres.unwrap_or(0.0);
    let shade = crown.crown();
    let angle = toward.angle;
    let through =
        (-(shade.leaf_shadow * angle.sqrt() + (shade.extinction / tree.scale * angle * metres).sqrt())).exp();
    let corrected = |line: [f64; 2]| through * correction::at(line, receiver.height.into()) as f32;
    Own { lit: corrected(toward.lit).min(1.0), sent: corrected(toward.sent), entry: metres }
}

/// What a crown stops of a ray of light before it has come down to `entry` m from its end: all that it stops where its back is nearer the
/// sun than that, and of an even crown that the ray's end is in, 1 − (1 − α')^t with the part t of it that lies before
/// (`shaders/frame/trees/zfield_shadow.frag`).
#[inline]
fn stopped(cast: &Cast, metres: impl Fn(f32) -> f32, entry: f32) -> f32 {
    let (back, front) = (metres(cast.back), metres(cast.front));
    if cast.alpha <= 0.0 || front <= entry {
        0.0
    } else if back >= entry {
        cast.alpha
    } else {
        1.0 - (1.0 - cast.alpha.min(0.999)).powf((front - entry) / (front - back))
    }
}

/// The ray of light to a receiver, past its own tree, which it enters after `entry` m: others shadow it from there on.
#[inline]
pub fn light<C: CrownModel, const M: usize>(
    crown: &C,
    patch: &Patch,
    heading: &Heading<C::Aim>,
    azimuth: &Azimuth,
    (receiver, entry, marks): (&Receiver, f32, &Marks),
    q: &[f32; M],
    largest: f32,
) -> Light<M> {
    let mut light = Light { alone: [1.0; M], joint: [1.0; M], sum: 0.0, overlap: 0.0 };
    let own = receiver.tree.map_or(u32::MAX, |t| t.index);
    let segment = Segment {
        origin: receiver.position,
        along: azimuth.along,
        length: length(crown, heading, receiver.z, largest),
        reach: reach(crown, largest),
    };
    patch.visit(&segment, |tree, offset| {
        if tree.index == own {
            return;
        }
        let Some(met) = at_tree(crown, heading, azimuth, tree, offset, receiver.z) else { return };
        let cast = crown.cast(&heading.aims[met.step as usize], met.a, met.b);
        let stopped = stopped(&cast, |depth| (depth - met.depth) * met.metres, entry);
        if stopped <= 0.0 {
            return;
        }
        light.sum += stopped;
        for (a, q) in light.alone.iter_mut().zip(q) {
            *a *= 1.0 - q * stopped;
        }
        match marks.get(tree.index) {
            Some(alpha) => {
                light.overlap += alpha * stopped;
                let both = alpha + stopped - alpha * stopped;
                for (j, q) in light.joint.iter_mut().zip(q) {
                    // Where both factors are 0 the product with the view ray's is 0 anyway.
                    *j *= (1.0 - q * both) / (1.0 - q * alpha).max(1e-6);
                }
            }
            None => {
                for (j, q) in light.joint.iter_mut().zip(q) {
                    *j *= 1.0 - q * stopped;
                }
            }
        }
    });
    light
}
