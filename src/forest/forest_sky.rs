//! What the forest leaves of the sky, as a table that surfaces are lit with whose light is known as spherical harmonics.

use half::f16;

use super::hidden_sky::HiddenSky;
use crate::bake::Baked;
use crate::bake::harmonics::SKY_DIRECTIONS;
use crate::gpu::interface::SKY_STEPS;
use crate::gpu::{Gpu, Image};
use crate::physics::forest_sky::{thickness_at, zonal};
use crate::physics::leaf::Directions;
use crate::plan::Plan;
use crate::plan::names::resource;
use crate::scene::Scene;
use crate::{Error, Result};

/// The table.
pub struct ForestSky {
    /// Zonal harmonics by height and thickness.
    pub table: Image,
    /// Height to which it goes, m.
    pub top: f32,
}

impl ForestSky {
    /// Makes and uploads it, for a plan that lists it.
    ///
    /// # Errors
    /// [`Error::Usage`] for a plan that does not, and for bakes without what trees hide; [`Error::Device`] when out of memory.
    pub fn new(gpu: &Gpu, scene: &Scene, plan: &Plan, baked: &[Baked]) -> Result<Self> {
        let missing = || Error::Usage("a species was baked without the harmonics that the plan lists".into());
        let nodes: Option<Vec<_>> =
            baked.iter().map(|b| Some(b.harmonics.as_ref()?.hiding.clone())).collect();
        let hidden = HiddenSky::new(scene, baked, nodes.ok_or_else(missing)?);
        let described = plan.images(resource::FOREST_SKY).next();
        let table =
            gpu.image(described.ok_or_else(|| Error::Usage("the plan lists no sky of the forest".into()))?)?;
        gpu.upload_image(&table, 0, 0, 1, bytemuck::cast_slice(&sky_table(&hidden)?))?;
        Ok(ForestSky { table, top: hidden.top as f32 })
    }
}

/// The sky of a forest: a column a step of the height, a row a step of the thickness.
fn sky_table(hidden: &HiddenSky) -> Result<Vec<[u16; 4]>> {
    let rule =
        Directions::new(SKY_DIRECTIONS).ok_or_else(|| Error::Usage("no such directions of a leaf".into()))?;
    let up = rule.half(true);
    let length = |w: &[f64; 3]| w.iter().map(|x| x * x).sum::<f64>().sqrt();
    // Directions of the same elevation count together.
    let mut sines: Vec<f64> = up.iter().filter(|w| w[2] > 1e-9).map(|w| w[2] / length(w)).collect();
    sines.sort_by(f64::total_cmp);
    sines.dedup_by(|a, b| (*a - *b).abs() < 1e-3);
    let hides = |metres: f64| -> Vec<[f64; 2]> {
        let mean = |sine: &f64| {
            let of = (0..up.len())
                .filter(|k| up[*k][2] > 1e-9 && (up[*k][2] / length(&up[*k]) - sine).abs() < 1e-3);
            let all: Vec<f64> = of.map(|k| hidden.at(k, metres)).collect();
            [*sine, all.iter().sum::<f64>() / all.len().max(1) as f64]
        };
        sines.iter().map(mean).collect()
    };
    let rows = 0..SKY_STEPS;
    let columns: Vec<Vec<[f64; 2]>> =
        rows.clone().map(|step| hides(hidden.top * f64::from(step) / f64::from(SKY_STEPS - 1))).collect();
    let texel = |row: u32, column: &Vec<[f64; 2]>| {
        let [a, b, c] = zonal(column, thickness_at(row, SKY_STEPS));
        [a, b, c, 0.0].map(|x| f16::from_f64(x).to_bits())
    };
    Ok(rows.flat_map(|row| columns.iter().map(move |c| texel(row, c)).collect::<Vec<_>>()).collect())
}
