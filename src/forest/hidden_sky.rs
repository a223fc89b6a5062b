//! What the trees of a scene hide of the sky from leaves of each other, put together from what one of each species does
//! ([`crate::bake::hiding`]).

use super::species::mean_squared_scale;
use crate::bake::Baked;
use crate::bake::hiding::{HEIGHTS, at_height};
use crate::physics::crown::Crown;
use crate::scene::{Scene, Species};

/// Species share it as they do in the whole scene: where each of them stands is not known.
pub struct HiddenSky {
    /// Crowns of the species and their middle scale.
    crowns: Vec<(Crown, f64)>,
    /// Share of each in the optical thickness of all.
    shares: Vec<f64>,
    /// Of each, what it hides: direction by direction, every height; empty where that is not known.
    nodes: Vec<Vec<f64>>,
    /// Height of the top of the tallest of middle scale, m.
    pub top: f64,
}

impl HiddenSky {
    /// Of species that hide what `nodes` say.
    pub fn new(scene: &Scene, baked: &[Baked], nodes: Vec<Vec<f64>>) -> Self {
        let crowns: Vec<(Crown, f64)> = scene
            .species
            .iter()
            .zip(baked)
            .map(|(s, b)| (b.species.crown, 0.5 * f64::from(s.scale[0] + s.scale[1])))
            .collect();
        let top_of =
            |(crown, scale): &(Crown, f64)| f64::from(crown.frame.centre + crown.frame.half_height) * scale;
        let shares: Vec<f64> =
            scene.species.iter().zip(&crowns).map(|(s, (crown, _))| thickness(scene, s, crown)).collect();
        let total = shares.iter().sum::<f64>().max(1e-12);
        HiddenSky {
            top: crowns.iter().map(top_of).fold(1e-3, f64::max),
            shares: shares.iter().map(|s| s / total).collect(),
            crowns,
            nodes,
        }
    }

    /// In a direction, at a height in metres above the ground: a unit of the optical thickness of all crowns.
    pub fn at(&self, direction: usize, metres: f64) -> f64 {
        let of = |k: usize| {
            let (crown, scale) = &self.crowns[k];
            let height =
                (metres / scale - f64::from(crown.frame.centre)) / f64::from(crown.frame.half_height);
            let nodes = self.nodes[k].get(direction * HEIGHTS..).map_or(&[][..], |n| &n[..HEIGHTS]);
            if nodes.is_empty() { 0.0 } else { self.shares[k] * at_height(nodes, height) }
        };
        (0..self.crowns.len()).map(of).sum()
    }
}

/// Optical thickness of a species' crowns from above in all of a scene, at its full density.
fn thickness(scene: &Scene, species: &Species, crown: &Crown) -> f64 {
    let density = species.full_density(scene.terrain.extent);
    density * std::f64::consts::PI * f64::from(crown.radius).powi(2) * mean_squared_scale(species)
}
