//! What the wind does to trees; twin of `shaders/physics/wind.glsl`.
//!
//! All motion is about the rest pose, which is how the models stand: in the mean wind. Every term is a sine of time, so that its mean over a
//! period is nothing, and every amplitude has a bound that is stated.
//!
//! **A whole tree** is sheared about its base: what is h metres above it moves sideways by s h,
//!
//! s(x, t) = ŵ (g G(x, t) + o 0.9 sin 2π(m t/T + φ)) + ŵ⊥ o 0.43 sin 2π(m′ t/T + φ′),   |s| ≤ g + o ≤ A ≤ [`MOST_SHEAR`],
//!
//! with ŵ to where the wind of speed U blows. The drag on a crown grows with U², until it bends out of the wind:
//! A = [`MOST_SHEAR`] U²/(U² + 20²), of which gusts have two thirds at `gustiness` 1 (g = ⅔ A γ), and what a tree does by itself one
//! (o = A/3).
//!
//! - **Gusts** travel over the ground with the wind, as a pattern that does not change on its way (Taylor's hypothesis of frozen
//!   turbulence, 1938): G(x, t) = Σ wᵢ sin 2π kᵢ·(x − U t ŵ), three waves ([`WAVES`]) of which the longest is about that of the peak of the
//!   spectrum of turbulence over a forest. All trees and the shader-map know the same G.
//! - **By itself** a tree of height H sways at its natural frequency, 0.0766 + 3.1219 D/H² Hz with D in cm (Moore & Maguire 2004, a fit to
//!   602 conifers) and a trunk of D = 1.5 H, within 15 % of it and at a phase of its own.
//!
//! A shear maps straight lines to straight lines: to a ray, a swaying tree is a still one and another ray.
//!
//! **Branches** of a mesh swing by d(p) = b r/(r + 1 m) (0.8 sin 2πα ẑ × p + 0.6 sin 2πβ r ẑ) at the distance r from the trunk, b = A, with
//! phases that change with the place, so that what lies close together moves together, and the trunk not at all; |d| ≤ b r.
//!
//! **Leaves** of a mesh turn about an axis in their own plane, through their middle, by ϑ sin 2π(n t/T + φ), ϑ = 0.6 U²/(U² + 8²), at 2 to
//! 6 Hz. As θ is odd over its period, the mean normal n ⟨cos θ⟩ + a × n ⟨sin θ⟩ is n times a number: what the crown
//! leaves of the light that falls on a leaf stays (Boulanger et al. 2008, section 7).
//!
//! Frequencies are whole numbers of periods in T = [`PERIOD`], and time is a part of T in units of 2⁻³²: products with whole numbers wrap
//! around as turns do, so that any time is as exact as any other.

use std::f64::consts::TAU;

/// Largest shear of a tree: metres sideways per metre of height.
pub const MOST_SHEAR: f64 = 0.12;
/// Time in which everything but gusts begins anew, s.
pub const PERIOD: f64 = 64.0;
/// Waves of gusts: length, m; direction from the wind's, degrees; share of the amplitude.
pub const WAVES: [[f64; 3]; 3] = [[230.0, 0.0, 0.5], [97.0, 24.0, 0.3], [41.0, -33.0, 0.2]];
/// Speed at which a tree bends half as much as it ever will, m/s.
const TREE_SPEED: f64 = 20.0;
/// The same of leaves, m/s.
const LEAF_SPEED: f64 = 8.0;
/// Largest angle of a leaf, rad.
const MOST_FLUTTER: f64 = 0.6;
/// Bound on the reach of leaves that turn, from what they turn about, over that of their tree to the sides.
pub const LEAF_REACH: f64 = 0.2;

/// The wind of a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wind {
    /// Mean speed among the crowns, m/s; more than 0.
    pub speed: f64,
    /// Where it comes from, degrees clockwise from north, as the sun's.
    pub azimuth: f64,
    /// How much of the trees' motion gusts have, from 0, none, to 1.
    pub gustiness: f64,
}

/// The wind at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// Unit vector to where it blows: east, north.
    pub toward: [f64; 2],
    /// Amplitude g of the shear by gusts.
    pub gust: f64,
    /// Amplitude o of a tree's own shear.
    pub own: f64,
    /// Amplitude b of branches.
    pub branch: f64,
    /// Amplitude ϑ of leaves, rad.
    pub leaf: f64,
    /// Phases of the waves at the origin of the world, turns.
    pub waves: [f64; 3],
    /// Part of [`PERIOD`] that has passed, 2⁻³².
    pub clock: u32,
}

/// The unit vector across, to the left.
fn across([x, y]: [f64; 2]) -> [f64; 2] {
    [-y, x]
}

/// What a sine of so many turns is.
fn sine(turns: f64) -> f64 {
    (TAU * (turns - turns.round())).sin()
}

/// Of its greatest value what an effect of drag has at a speed, if it has half of it at `half`.
fn bent(speed: f64, half: f64) -> f64 {
    let ratio = speed / half;
    if ratio > 1e3 { 1.0 } else { ratio * ratio / (1.0 + ratio * ratio) }
}

/// The turns of a wave on the way `x` m east and north: its vector is that of [`WAVES`] about the direction of the wind.
fn wave_turns(k: usize, toward: [f64; 2], x: [f64; 2]) -> f64 {
    let [length, angle, _] = WAVES[k];
    let (sin, cos) = angle.to_radians().sin_cos();
    let side = across(toward);
    (0..2).map(|i| (cos * toward[i] + sin * side[i]) * x[i]).sum::<f64>() / length
}

impl Wind {
    /// Unit vector to where it blows.
    pub fn toward(&self) -> [f64; 2] {
        let a = self.azimuth.to_radians();
        [-a.sin(), -a.cos()]
    }

    /// The wind at a time in seconds, which may be any finite number.
    pub fn at(&self, seconds: f64) -> Motion {
        let (toward, shear) = (self.toward(), self.shear());
        // Beyond, doubles tell no parts of a second apart, and what follows might be no number.
        let seconds = seconds.clamp(-1e15, 1e15);
        // Each wave is as long along the wind as its vector's part there says.
        let passed = |k: usize| WAVES[k][1].to_radians().cos() / WAVES[k][0] * self.speed * seconds;
        let part = (seconds / PERIOD).rem_euclid(1.0);
        Motion {
            toward,
            gust: 2.0 / 3.0 * shear * self.gustiness,
            own: shear / 3.0,
            branch: shear,
            leaf: self.flutter(),
            waves: std::array::from_fn(|k| (-passed(k)).rem_euclid(1.0)),
            clock: (part * 4_294_967_296.0) as u64 as u32,
        }
    }

    /// Bound on the shear of a tree.
    pub fn shear(&self) -> f64 {
        MOST_SHEAR * bent(self.speed, TREE_SPEED)
    }

    /// Bound on how far anything of a tree is moved that reaches so high and so far to the sides, m.
    pub fn reach(&self, height: f64, radius: f64) -> f64 {
        // What flutters is on a branch, and the shear is of the height to which that has swung.
        let leaf = self.flutter() * LEAF_REACH * radius;
        let branch = self.shear() * radius;
        self.shear() * (height + branch + leaf) + branch + leaf
    }

    /// Largest angle of a leaf, rad.
    pub fn flutter(&self) -> f64 {
        MOST_FLUTTER * bent(self.speed, LEAF_SPEED)
    }

    /// Phases of the waves at a place less those at the origin, in 1/1024 turn, ten bits each.
    pub fn place_phases(&self, x: [f64; 2]) -> u32 {
        let of = |k: usize| {
            ((wave_turns(k, self.toward(), x).rem_euclid(1.0) * 1024.0).round() as u32 & 1023) << (10 * k)
        };
        (0..3).map(of).sum()
    }
}

impl Motion {
    /// G of gusts so far from a place with these phases.
    pub fn gusts(&self, phases: [f64; 3], x: [f64; 2]) -> f64 {
        (0..3).map(|k| WAVES[k][2] * sine(phases[k] + wave_turns(k, self.toward, x))).sum()
    }

    /// Phases of the waves at a place, turns.
    pub fn phases_at(&self, x: [f64; 2]) -> [f64; 3] {
        std::array::from_fn(|k| (self.waves[k] + wave_turns(k, self.toward, x)).rem_euclid(1.0))
    }

    /// Turns after `count` periods in [`PERIOD`], from −½ to ½.
    fn turns(&self, count: u32) -> f64 {
        f64::from(self.clock.wrapping_mul(count) as i32) / 4_294_967_296.0
    }

    /// Shear s of a tree, east and north: of its height, m; of what gusts are there; and of its own hash.
    pub fn sway(&self, gusts: f64, height: f64, hash: u32) -> [f64; 2] {
        let bits =
            |first: u32, count: u32| f64::from(hash >> first & ((1 << count) - 1)) / f64::from(1u32 << count);
        let frequency = natural_frequency(height) * (0.85 + 0.3 * bits(0, 8));
        let count = (frequency * PERIOD).round() as u32;
        let along = self.gust * gusts + 0.9 * self.own * sine(self.turns(count) + bits(8, 10));
        let aside = 0.43 * self.own * sine(self.turns(count + 1 + (hash >> 30)) + bits(18, 12));
        let side = across(self.toward);
        [0, 1].map(|i| along * self.toward[i] + aside * side[i])
    }

    /// How far a branch moves, m: at a place from the middle of its model's box, of a tree of this name (of eight bits).
    pub fn branch(&self, p: [f64; 3], name: u32) -> [f64; 3] {
        let (r, own) = (p[0].hypot(p[1]), f64::from(name) / 256.0);
        let count = (PERIOD * (0.8 + 0.8 * own)).round() as u32;
        let turns = self.turns(count) + 5.0 * own + 0.13 * p[0] + 0.09 * p[1] + 0.07 * p[2];
        let swing = self.branch * r / (r + 1.0);
        let (aside, up) = (0.8 * swing * sine(turns), 0.6 * swing * sine(1.0 / 3.0 + turns - 0.22 * p[0]));
        [-p[1] * aside, p[0] * aside, r * up]
    }

    /// Angle of a leaf of this hash, rad.
    pub fn flutter(&self, hash: u32) -> f64 {
        let count = 128 + (hash & 255);
        self.leaf * sine(self.turns(count) + f64::from(hash >> 8) / 16_777_216.0)
    }
}

/// Natural frequency of a tree of a height in metres, Hz (Moore & Maguire 2004), at most 4.
pub fn natural_frequency(height: f64) -> f64 {
    (0.0766 + 3.1219 * 1.5 / height.max(1e-3)).min(4.0)
}

/// A vector turned about a unit axis by an angle in radians (Rodrigues).
pub fn turned(v: [f64; 3], axis: [f64; 3], angle: f64) -> [f64; 3] {
    let (sin, cos) = angle.sin_cos();
    let [x, y, z] = axis;
    let across = [y * v[2] - z * v[1], z * v[0] - x * v[2], x * v[1] - y * v[0]];
    let along = (1.0 - cos) * (x * v[0] + y * v[1] + z * v[2]);
    std::array::from_fn(|i| cos * v[i] + sin * across[i] + along * axis[i])
}

/// A tree's shear as 28 bits, from the fourth of a word on: fourteen an axis, in steps of [`MOST_SHEAR`] / 8191.
pub fn pack_sway(s: [f64; 2]) -> u32 {
    let of =
        |v: f64| (v.clamp(-MOST_SHEAR, MOST_SHEAR) * (8191.0 / MOST_SHEAR)).round() as i32 as u32 & 0x3fff;
    of(s[0]) << 4 | of(s[1]) << 18
}

/// The shear of such a word.
pub fn unpack_sway(word: u32) -> [f64; 2] {
    [(word << 14) as i32 >> 18, word as i32 >> 18].map(|v| f64::from(v) * (MOST_SHEAR / 8191.0))
}

#[cfg(test)]
mod tests;
