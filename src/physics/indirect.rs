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
//! lie evenly ([`super::tables::density_coordinate`]). [`crate::bake::indirect`] measures them. With them comes what of the sky is
//! open to near trees, by height ([`Open`]).
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
/// Terms of what of the sky's light other trees leave ([`open_terms`]).
pub const OPEN: usize = 4 * OPEN_HEIGHTS.len();
/// Terms of the light on the ground: three of the sun's, one of the sky's.
pub const GROUND: usize = 4;
/// Coefficients of a node, in this order: near trees' of the sun and of the sky, what of the sky is open to them, far trees' of the sun and of
/// the sky, the ground's.
pub const COEFFICIENTS: usize = NEAR_SUN + NEAR_SKY + OPEN + SUN_TERMS + SKY_TERMS + GROUND;
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

/// Heights between which what is open to the sky is linear, and beyond which it is as there.
pub const OPEN_HEIGHTS: [f64; 4] = [-0.75, -0.25, 0.25, 0.75];

/// How much a viewer is one who looks up from the ground, 1, rather than one above the forest, 0; some of each where v is nearly 0. They see other
/// leaves at the same height.
fn looks_up(view: f64) -> f64 {
    (0.5 - 5.0 * view).clamp(0.0, 1.0)
}

/// Weights of the heights at z.
fn tents(z: f64) -> [f64; 4] {
    let step = OPEN_HEIGHTS[1] - OPEN_HEIGHTS[0];
    let at = ((z - OPEN_HEIGHTS[0]) / step).clamp(0.0, 3.0);
    std::array::from_fn(|k| (1.0 - (at - k as f64).abs()).max(0.0))
}

/// What the heights' coefficients are of: viewers above the forest, with 1 and v, and likewise those on the ground.
fn sides(view: f64) -> [f64; 4] {
    let up = looks_up(view);
    [1.0 - up, (1.0 - up) * view, up, up * view]
}

/// Terms of what is open to the sky: the heights, for each of the sides.
pub fn open_terms(view: f64, z: f64) -> [f64; OPEN] {
    let (sides, tents) = (sides(view), tents(z));
    std::array::from_fn(|i| sides[i / 4] * tents[i % 4])
}

/// What there is of the sky's light among other trees over what a tree's z-field knows of it, at [`OPEN_HEIGHTS`]: in a forest of oaks and pines
/// about 0.1 to 0.9.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Open(pub [f64; 4]);

/// Most that it is; z-fields may know of less than there is.
const BRIGHTEST: f64 = 4.0;

impl Open {
    /// Of what all trees leave, and of what the z-field knows.
    fn new(all: [f64; 4], own: [f64; 4]) -> Self {
        Open(std::array::from_fn(|k| (all[k].max(0.0) / own[k].max(1e-6)).min(BRIGHTEST)))
    }

    /// At a height.
    pub fn at(&self, z: f64) -> f64 {
        tents(z).iter().zip(self.0).map(|(t, open)| t * open).sum()
    }
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

    /// What there is of the sky's light on a near tree over what its z-field knows.
    pub fn open(&self, x: f64, view: f64) -> Open {
        let (all, sides) = (self.at(x), sides(view));
        let open = &all[NEAR_SUN + NEAR_SKY..][..OPEN];
        let of =
            |c: usize| std::array::from_fn(|k| (0..4).map(|s| sides[s] * open[4 * s + k][c]).sum::<f64>());
        Open::new(of(0), of(1))
    }

    /// The same of far trees, all of them that are seen.
    pub fn far(&self, x: f64, angles: Angles) -> [[f64; 3]; 2] {
        let all = self.at(x);
        let first = NEAR_SUN + NEAR_SKY + OPEN;
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_is_linear_between_nodes_and_by_height_that_of_its_terms() {
        let node = |sun: f32| {
            let mut node = [[0.0; 3]; COEFFICIENTS];
            // 1 + z + z²/2 of the sun, and as much of the sky without heights.
            (node[0], node[SUN_TERMS], node[SUN_TERMS + 3]) = ([sun; 3], [sun; 3], [0.5 * sun; 3]);
            node[NEAR_SUN] = [sun; 3];
            node
        };
        let light = Indirect { max_thickness: 4.0, nodes: vec![node(0.0), node(1.0), node(2.0)] };
        let angles = Angles { view: 0.3, sun: 0.5, between: 0.2 };
        // Nodes lie at 0, 1 and 4: three quarters of the way from the second to the third at 1.75² = 3.0625.
        let [sun, sky] = light.near(3.0625, angles);
        for z in [-0.9, 0.0, 0.5, 1.0] {
            assert!((sun.at(z)[1] - 1.75 * (1.0 + z + 0.5 * z * z)).abs() < 1e-12);
            assert!((sky.at(z)[2] - 1.75).abs() < 1e-12);
        }
        assert_eq!(
            light.near(0.0, angles)[0].at(0.0),
            [0.0; 3],
            "nothing, though its profile is a ratio of nothings"
        );
        assert_eq!(light.near(9.0, angles), light.near(4.0, angles), "beyond the last node as there");
    }

    #[test]
    fn the_open_sky_is_that_of_its_heights_on_either_side() {
        let mut node = [[0.0; 3]; COEFFICIENTS];
        for k in 0..4 {
            // From above 0.2, 0.4, 0.6 and 0.8 of what the z-field has, from below half of that.
            let all = 0.1 * (k + 1) as f32;
            node[NEAR_SUN + NEAR_SKY + k] = [all, 0.5, 0.0];
            node[NEAR_SUN + NEAR_SKY + 8 + k] = [0.5 * all, 0.5, 0.0];
        }
        let light = Indirect { max_thickness: 1.0, nodes: vec![node; 2] };
        let at = |view: f64, z: f64| light.open(0.5, view).at(z);
        for (view, z, want) in
            [(0.9, -0.75, 0.2), (0.9, 0.0, 0.5), (0.9, 1.0, 0.8), (-0.5, 0.25, 0.3), (0.0, 0.25, 0.45)]
        {
            assert!((at(view, z) - want).abs() < 1e-6, "{view} {z}: {}", at(view, z));
        }
    }
}
