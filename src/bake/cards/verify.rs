//! How well a cloud stands for its model: silhouettes from many directions.

use rayon::prelude::*;

use crate::Result;
use crate::bake::raster::{Raster, SUBSAMPLES, View};
use crate::bake::surface::Surface;
use crate::physics::views::{self, Basis};
use crate::scene::Mesh;

/// Texels along a side of the views that are compared.
const RESOLUTION: u32 = 128;

/// Agreement of a cloud with its model from one direction.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct CardQuality {
    /// Towards the viewer, in scaled tree space.
    pub direction: [f64; 3],
    /// Intersection over union of the silhouettes (opacity at least one half), 128 texels along the tree.
    pub iou: f64,
    /// Mean opacity of the cloud over that of the model.
    pub coverage_ratio: f64,
}

/// Compares a cloud, loaded as any model is, with the model that it was made of.
///
/// # Errors
/// [`crate::Error::Usage`] for models without extent.
pub fn verify(mesh: &Mesh, cards: &Mesh, directions: u32) -> Result<Vec<CardQuality>> {
    let model = Surface::new(mesh)?;
    let mut cloud = Surface::new(cards)?;
    // Both in the model's space.
    for p in cloud.faces.iter_mut().flat_map(|f| &mut f.p) {
        *p = model.frame.to_scaled(cloud.frame.to_metres(*p));
    }
    let all: Vec<_> = views::spread().take(directions as usize).collect();
    let pair = || [Raster::new(RESOLUTION), Raster::new(RESOLUTION)];
    Ok(all
        .into_par_iter()
        .map_init(pair, |rasters, w| {
            let view = View::new(&Basis::new(w), RESOLUTION);
            let [truth, drawn] = rasters;
            truth.draw(&model, &view);
            drawn.draw(&cloud, &view);
            let (mut both, mut either, mut sums) = (0u32, 0u32, [0u32; 2]);
            for texel in 0..RESOLUTION * RESOLUTION {
                let counts = [&*truth, &*drawn].map(|r| covered(r, texel));
                let [a, b] = counts.map(|c| 2 * c >= SUBSAMPLES * SUBSAMPLES);
                both += u32::from(a && b);
                either += u32::from(a || b);
                (0..2).for_each(|k| sums[k] += counts[k]);
            }
            CardQuality {
                direction: w.to_array(),
                iou: f64::from(both) / f64::from(either.max(1)),
                coverage_ratio: f64::from(sums[1]) / f64::from(sums[0].max(1)),
            }
        })
        .collect())
}

/// Samples of a texel that see anything.
fn covered(raster: &Raster, texel: u32) -> u32 {
    let (x, y) = (texel % RESOLUTION * SUBSAMPLES, texel / RESOLUTION * SUBSAMPLES);
    let seen = |k: u32| {
        let at = (y + k / SUBSAMPLES) * raster.size + x + k % SUBSAMPLES;
        raster.nearest[at as usize].is_finite()
    };
    (0..SUBSAMPLES * SUBSAMPLES).filter(|k| seen(*k)).count() as u32
}
