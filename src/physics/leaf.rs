//! Light on a leaf among leaves (Boulanger, Bouatouch & Pattanaik 2008, "BBP08"): of the sky, of the sun, and of the sun by one bounce
//! off the leaves around.
//!
//! A leaf's surroundings are its **envelope**: for a few directions ω_j over the whole sphere, how thick the foliage is from the leaf
//! outwards, τ s_max(P, ω_j) of BBP08, as an optical thickness. Lengths appear nowhere else: with g = G3/τ, A ρ = 2 τ (eq. 5) and
//! t_j = τ s_max(P, ω_j), equations 7 and 18 to 25 hold in thicknesses alone, whatever the size of leaf or tree.
//!
//! Departures, each measured by `canopy leaves`:
//! - Directions have the weights of a Lebedev rule instead of 1/N each, which for 8 is the same: 14 and 26 integrate polynomials of degree
//!   5 and 7.
//! - The sky's light comes from above the horizon: of cells that straddle it, what is above counts, from its own middle direction
//!   ([`hemisphere`]).
//! - What a leaf gathers is brought to the exact integral of its own cosine ([`Gather`]), so that a constant sky lights an open leaf
//!   rightly whatever its normal is; with the bare sum of 8 directions of eq. 6 it is −18 to +15 % off.
//! - Towards the sun the mean over directions is of what the foliage leaves of its light, not of thicknesses, and with more directions nearer
//!   ones count more ([`Sun::visible`], [`Directions::power`]).
//! - Beyond where a neighbour's path to the sun would be negative (eq. 22, which then gives it more than the sun has) it is 0; the
//!   integral of eq. 20 stays closed ([`gathered`]).

use std::f64::consts::PI;

mod directions;

pub use directions::Directions;

/// What a leaf's two sides do with light (BBP08, section 3.3), in one channel; Lambertian.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Leaf {
    /// Reflectance of the front, on the side of the normal, and of the back.
    pub reflectance: [f64; 2],
    /// Transmittance for light that enters by the front, and by the back.
    pub transmittance: [f64; 2],
}

impl Leaf {
    /// The same on both sides.
    pub fn uniform(reflectance: f64, transmittance: f64) -> Self {
        Leaf { reflectance: [reflectance; 2], transmittance: [transmittance; 2] }
    }

    /// What of light from one side is seen on a side (0 front, 1 back): reflected on its own, transmitted to the other.
    pub fn scattered(&self, lit: usize, seen: usize) -> f64 {
        if lit == seen { self.reflectance[lit] } else { self.transmittance[lit] }
    }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Scattering times cosine, F(P, ω_o, ω) of BBP08 eq. 4, 1/sr: radiance towards the viewer per irradiance on a plane facing the light.
pub fn scattering(leaf: Leaf, normal: [f64; 3], viewer: [f64; 3], light: [f64; 3]) -> f64 {
    let (seen, cosine) = (usize::from(dot(normal, viewer) < 0.0), dot(normal, light));
    leaf.scattered(usize::from(cosine < 0.0), seen) * cosine.abs() / PI
}

/// Mean over uniform normals of the cosines to a viewer and a light on the same side of a leaf, zero where they are on different ones: the
/// angle between the ray's direction ω_j and the sun is `angle`, from 0 to π (BBP08 eq. 32; A_vr). By its series where terms cancel.
pub fn reflected_cosines(angle: f64) -> f64 {
    if angle < 0.01 {
        return angle.powi(3) * (1.0 - angle * angle / 10.0) / (18.0 * PI);
    }
    (angle.sin() - angle * angle.cos()) / (6.0 * PI)
}

/// The same where they are on different sides (BBP08 eq. 31; A_vt).
pub fn transmitted_cosines(angle: f64) -> f64 {
    reflected_cosines(PI - angle)
}

/// How a leaf of one normal gathers what comes along the directions: solid angle times |cosine| of each, sr, so that the sums over
/// the front's and over the back's directions are π each.
pub struct Gather {
    /// Of each direction; positive from the front.
    pub cosines: Vec<f64>,
}

impl Gather {
    /// For a unit normal.
    pub fn new(directions: &Directions, normal: [f64; 3]) -> Self {
        let of = |k: usize| 4.0 * PI * directions.weights[k] * dot(normal, directions.to[k]);
        let mut cosines: Vec<f64> = (0..directions.len()).map(of).collect();
        let side = |sign: f64| cosines.iter().map(|c| (sign * c).max(0.0)).sum::<f64>();
        let factors = [side(1.0), side(-1.0)].map(|sum| if sum > 0.0 { PI / sum } else { 0.0 });
        for c in &mut cosines {
            *c *= factors[usize::from(*c < 0.0)];
        }
        Gather { cosines }
    }

    /// Radiance that one side sends (0 front, 1 back) where `incoming` comes along each direction.
    pub fn radiance(&self, leaf: Leaf, seen: usize, incoming: impl Fn(usize) -> f64) -> f64 {
        let part =
            |(k, c): (usize, &f64)| leaf.scattered(usize::from(*c < 0.0), seen) * c.abs() * incoming(k);
        self.cosines.iter().enumerate().map(part).sum::<f64>() / PI
    }
}

/// Irradiance on the front and on the back of a leaf of one normal from an even sky (or ground) of radiance 1/π, of which `visible` is left in
/// each direction; `half` is [`Directions::half`] of it.
///
/// The parts of the sphere are faced as they are, and what they leave out of the cosine where they straddle the leaf's plane is made good by the exact
/// integral over the hemisphere: (1 ± n_z) / 2 of π.
pub fn hemisphere(
    half: &[[f64; 3]],
    above: bool,
    normal: [f64; 3],
    visible: impl Fn(usize) -> f64,
) -> [f64; 2] {
    let up = if above { normal[2] } else { -normal[2] };
    [1.0, -1.0].map(|side| {
        let (mut all, mut left) = (0.0, 0.0);
        for (k, cell) in half.iter().enumerate() {
            let faced = (side * dot(*cell, normal)).max(0.0);
            all += faced;
            left += faced * visible(k);
        }
        if all > 0.0 { left / all * 0.5 * (1.0 + side * up) } else { 0.0 }
    })
}

/// All that the sun's direction and the leaves' material say, the same for every leaf of a tree (G1, G2 and G3 of BBP08, eq. 18, 24
/// and 25).
pub struct Sun {
    /// M(ω_l·ω_j)ᵖ with the directions' weights, over their sum: what each direction says of the foliage towards the sun (eq. 7).
    pub towards: Vec<f64>,
    /// Source of the bounce along each direction, per irradiance and unit of thickness, 1/sr.
    pub source: Vec<f64>,
    /// What of a neighbour's path to the sun a unit of thickness on the way to it takes off (1 − G3/τ).
    pub nearer: Vec<f64>,
}

impl Sun {
    /// For a unit direction towards the sun.
    pub fn new(directions: &Directions, leaf: Leaf, sun: [f64; 3]) -> Self {
        let lobe =
            |k: usize| directions.weights[k] * dot(sun, directions.to[k]).max(0.0).powi(directions.power);
        let total: f64 = (0..directions.len()).map(lobe).sum();
        let towards: Vec<f64> = (0..directions.len()).map(|k| lobe(k) / total).collect();
        let reflectance = leaf.reflectance[0] + leaf.reflectance[1];
        let transmittance = leaf.transmittance[0] + leaf.transmittance[1];
        let source = |w: &[f64; 3]| {
            let angle = dot(*w, sun).clamp(-1.0, 1.0).acos();
            // Of leaves of unit extinction, whose area a volume is 2 (eq. 5): eq. 16.
            2.0 / PI * (reflectance * reflected_cosines(angle) + transmittance * transmitted_cosines(angle))
        };
        let nearer =
            |w: &[f64; 3]| towards.iter().zip(&directions.to).map(|(m, other)| m * dot(*w, *other)).sum();
        Sun {
            source: directions.to.iter().map(source).collect(),
            nearer: directions.to.iter().map(nearer).collect(),
            towards,
        }
    }

    /// What the tree leaves of the sun at a leaf of this envelope: the mean of what it leaves along the directions. (BBP08 eq. 7 takes
    /// the mean of the thickness, which by Jensen's inequality leaves too little, where crowns have gaps far too little.)
    pub fn visible(&self, envelope: &[f64]) -> f64 {
        self.towards.iter().zip(envelope).map(|(m, t)| m * (-t).exp()).sum()
    }

    /// Radiance of the bounce that comes along a direction to a leaf of this envelope, per irradiance (BBP08 eq. 20 and 23).
    pub fn bounce(&self, envelope: &[f64], direction: usize) -> f64 {
        let path = -self.visible(envelope).max(f64::MIN_POSITIVE).ln();
        self.source[direction] * gathered(envelope[direction], path, self.nearer[direction])
    }
}

/// ∫₀ᵗ exp(−s) exp(−max(p − n s, 0)) ds: what leaves along a way of thickness t pass on of the sun, whose own way to it is p at the
/// beginning and n shorter a unit (BBP08 eq. 19 to 23, with g = 1 − n).
pub fn gathered(thickness: f64, path: f64, nearer: f64) -> f64 {
    // Where the sun would be in front of the leaf.
    let end = if nearer > 0.0 { thickness.min(path / nearer) } else { thickness };
    let g = 1.0 - nearer;
    let shaded = if (g * end).abs() < 1e-9 { end } else { -(-g * end).exp_m1() / g };
    (-path).exp() * shaded + ((-end).exp() - (-thickness).exp())
}

#[cfg(test)]
mod tests;
