//! Light that met more than one surface: what leaves, bark and ground hand to each other. Twin of `shaders/physics/indirect.glsl`.
//!
//! BN12 counts light that met one surface, and BBP08 that of two. In a forest what met more than one is a tenth to a third of all, most of
//! it where one looks away from the sun or into deep crowns. It is smooth: after a second surface nothing is left of single leaves'
//! shadows. So it is known here as a mean over what is seen of a tree from one direction at one height,
//!
//! L(z) = E_sun (Σ_i a_i Y_i + z (b₀ + b₁ l + b₂ v) + z² (c₀ + c₁ l)) + L_sky (Σ_i d_i Z_i + e z + f z²),
//! Y = 1, l, l², v, v², q, q², v l, q l, q v,   Z = 1, v, v²,
//!
//! with E_sun the sun's irradiance, L_sky the mean radiance of the sky, v and l the cosines of the zenith angles of viewer and sun, q that of
//! the angle between them, and z in [−1, 1] from the trunk's foot to the tree's top. Far trees, of which the others leave
//! to see what they leave, have Σ_i a'_i Y_i and Σ_i d'_i Z_i, and the ground gets g₀ + g₁ l + g₂ l² times E_sun/π and g₃ times L_sky
//! from trees. All coefficients are of one species in a forest at one density; between such nodes they are linear in √density, on which nodes
//! lie evenly ([`super::tables::density_coordinate`]). [`crate::bake::indirect`] measures them.
//!
//! Held against the paths that they were not fitted to, in cells of height, view and sun, this is off by 0.4 to 1.1 % of all light (oak and
//! pine, alone and at 0.012 and 0.03 trees per m²); without z² by up to 1.9 %, without z by 5 to 10.

use super::light::luminance;
use super::tables::density_coordinate;

/// Terms Y, and with them those in z and z².
pub const SUN_TERMS: usize = 10;
/// Terms of the sun's light on near trees.
pub const NEAR_SUN: usize = SUN_TERMS + 5;
/// Terms Z.
pub const SKY_TERMS: usize = 3;
/// Terms of the sky's light on near trees.
pub const NEAR_SKY: usize = SKY_TERMS + 2;
/// Terms of the light on the ground: three of the sun's, one of the sky's.
pub const GROUND: usize = 4;
/// Coefficients of a node, in this order: near trees' of the sun and of the sky, far trees' likewise, the ground's.
pub const COEFFICIENTS: usize = NEAR_SUN + NEAR_SKY + SUN_TERMS + SKY_TERMS + GROUND;
/// Where a tree's light is named by its colour: its height for [`Handed`].
pub const NAMED: f64 = 0.5;
/// Most of a profile's slopes, so that half floats hold them.
const STEEPEST: f64 = 1e4;

/// The light of a species of a forest.
#[derive(Clone, Debug, PartialEq)]
pub struct Indirect {
    /// Largest x = Σ λA of all species of the forest, at the last node.
    pub max_thickness: f32,
    /// The coefficients of every node of the density, linear RGB.
    pub nodes: Vec<[[f32; 3]; COEFFICIENTS]>,
}

/// Cosines that light depends on: of the zenith angles of viewer and sun, and of the angle between them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Angles {
    /// v.
    pub view: f64,
    /// l.
    pub sun: f64,
    /// q.
    pub between: f64,
}

/// Y.
pub fn sun_terms(a: Angles) -> [f64; SUN_TERMS] {
    let Angles { view: v, sun: l, between: q } = a;
    [1.0, l, l * l, v, v * v, q, q * q, v * l, q * l, q * v]
}

/// Y and what stands beside it in z.
pub fn near_sun_terms(a: Angles, z: f64) -> [f64; NEAR_SUN] {
    let y = sun_terms(a);
    let heights = [z, z * a.sun, z * a.view, z * z, z * z * a.sun];
    std::array::from_fn(|i| if i < SUN_TERMS { y[i] } else { heights[i - SUN_TERMS] })
}

/// Z.
pub fn sky_terms(view: f64) -> [f64; SKY_TERMS] {
    [1.0, view, view * view]
}

/// Z and what stands beside it in z.
pub fn near_sky_terms(view: f64, z: f64) -> [f64; NEAR_SKY] {
    let [a, b, c] = sky_terms(view);
    [a, b, c, z, z * z]
}

/// Light that a tree hands on, by height: colour · max(1 + b (z − ½) + c (z² − ¼), 0), what is linear RGB being so at z = ½, inside every
/// crown, and the profile that of luminance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Handed {
    /// At z = ½.
    pub colour: [f64; 3],
    /// b and c.
    pub profile: [f64; 2],
}

impl Handed {
    fn new(colour: [f64; 3], slopes: [[f64; 3]; 2]) -> Self {
        let colour = colour.map(|c| c.max(0.0));
        let bright = luminance(colour).max(1e-9);
        let slope = |s: [f64; 3]| (luminance(s) / bright).clamp(-STEEPEST, STEEPEST);
        Handed { colour, profile: slopes.map(slope) }
    }

    /// At a height.
    pub fn at(&self, z: f64) -> [f64; 3] {
        let [b, c] = self.profile;
        let factor = (1.0 + b * (z - NAMED) + c * (z * z - NAMED * NAMED)).max(0.0);
        self.colour.map(|x| x * factor)
    }
}

impl Indirect {
    /// Coefficients at a thickness x = λA.
    fn at(&self, x: f64) -> [[f64; 3]; COEFFICIENTS] {
        let at = density_coordinate(self.nodes.len(), f64::from(self.max_thickness), x);
        let first = (at as usize).min(self.nodes.len() - 2);
        let part = at - first as f64;
        let [a, b] = [&self.nodes[first], &self.nodes[first + 1]];
        std::array::from_fn(|i| {
            std::array::from_fn(|c| f64::from(a[i][c]) * (1.0 - part) + f64::from(b[i][c]) * part)
        })
    }

    /// What a near tree sends: per irradiance of the sun, and per radiance of the sky.
    pub fn near(&self, x: f64, angles: Angles) -> [Handed; 2] {
        let all = self.at(x);
        let colour = |terms: &[f64], first: usize| sum(terms, &all[first..]);
        let (sun, sky) = (near_sun_terms(angles, NAMED), near_sky_terms(angles.view, NAMED));
        let (l, v) = (angles.sun, angles.view);
        [
            Handed::new(
                colour(&sun, 0),
                [sum(&[1.0, l, v], &all[SUN_TERMS..]), sum(&[1.0, l], &all[SUN_TERMS + 3..])],
            ),
            Handed::new(colour(&sky, NEAR_SUN), [all[NEAR_SUN + SKY_TERMS], all[NEAR_SUN + SKY_TERMS + 1]]),
        ]
    }

    /// The same of far trees, all of them that are seen.
    pub fn far(&self, x: f64, angles: Angles) -> [[f64; 3]; 2] {
        let all = self.at(x);
        let first = NEAR_SUN + NEAR_SKY;
        [sum(&sun_terms(angles), &all[first..]), sum(&sky_terms(angles.view), &all[first + SUN_TERMS..])]
            .map(|rgb| rgb.map(|c| c.max(0.0)))
    }

    /// What trees send to the ground: irradiance over π, per irradiance of the sun at the cosine `sun`, and per radiance of the sky.
    pub fn ground(&self, x: f64, sun: f64) -> [[f64; 3]; 2] {
        let all = self.at(x);
        let g = &all[COEFFICIENTS - GROUND..];
        [sum(&[1.0, sun, sun * sun], g), g[3]].map(|rgb| rgb.map(|c| c.max(0.0)))
    }
}

fn sum(terms: &[f64], coefficients: &[[f64; 3]]) -> [f64; 3] {
    std::array::from_fn(|c| terms.iter().zip(coefficients).map(|(t, k)| t * k[c]).sum())
}
