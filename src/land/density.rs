//! Density of a species: at a place (twin of `shaders/land/density.glsl`), and the map of it over the terrain.

use std::borrow::Cow;

use super::listed;
use crate::physics::raster::Raster;
use crate::physics::terrain::height_and_slope;
use crate::scene::{Distribution, Species, Terrain};

/// Width of smooth height limits, as a part of the range between them.
pub const HEIGHT_SOFTNESS: f32 = 0.1;
/// Width of the smooth slope limit, as a part of its tangent.
pub const SLOPE_SOFTNESS: f32 = 1.0 / 6.0;

/// Trees per m² of horizontal ground at a position, m from the south-west corner; 0 for a list of trees.
pub fn local(distribution: &Distribution, terrain: &Terrain, x: f64, y: f64) -> f64 {
    let Distribution::Density { map, max_density, between_heights, below_slope } = distribution else {
        return 0.0;
    };
    let [height, dx, dy] = terrain
        .heights
        .as_ref()
        .map_or([0.0; 3], |r| height_and_slope(r, x / terrain.cell_size, y / terrain.cell_size));
    let mut density = f64::from(*max_density);
    if let Some(map) = map {
        density *= bilinear(map, x / terrain.extent[0], y / terrain.extent[1]);
    }
    if let Some([low, high]) = between_heights.map(|b| b.map(f64::from)) {
        let soft = f64::from(HEIGHT_SOFTNESS) * (high - low);
        density *=
            smoothstep(low - soft, low + soft, height) * (1.0 - smoothstep(high - soft, high + soft, height));
    }
    if let Some(limit) = below_slope {
        let (t, slope) = (f64::from(limit.to_radians().tan()), dx.hypot(dy) / terrain.cell_size);
        let soft = f64::from(SLOPE_SOFTNESS) * t;
        density *= 1.0 - smoothstep(t - soft, t + soft, slope);
    }
    density
}

/// A density over the whole terrain.
pub struct DensityMap<'a> {
    /// Relative to its largest value.
    pub relative: Cow<'a, Raster>,
    /// Listed trees per m² where it is 1.
    pub listed: f64,
}

/// The map of a species' density, or of its listed trees; `None`: the same everywhere.
pub fn density_map(species: &Species, extent: [f64; 2]) -> Option<DensityMap<'_>> {
    match &species.distribution {
        Distribution::Density { map, .. } => {
            map.as_deref().map(|m| DensityMap { relative: Cow::Borrowed(m), listed: 0.0 })
        }
        Distribution::Positions(list) => {
            let (relative, listed) = listed::density(extent, list);
            Some(DensityMap { relative: Cow::Owned(relative), listed })
        }
    }
}

/// Texels of the map that a species' density needs.
pub fn density_map_size(species: &Species, extent: [f64; 2]) -> Option<[u32; 2]> {
    match &species.distribution {
        Distribution::Density { map, .. } => map.as_ref().map(|m| [m.width, m.height]),
        Distribution::Positions(list) => Some(listed::grid_size(extent, list.len())),
    }
}

fn smoothstep(low: f64, high: f64, x: f64) -> f64 {
    let t = ((x - low) / (high - low).max(1e-30)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Bilinear between texel centres, at a position in [0, 1]².
fn bilinear(map: &Raster, u: f64, v: f64) -> f64 {
    let place = |t: f64, n: u32| {
        let at = t.clamp(0.0, 1.0) * f64::from(n) - 0.5;
        let low = at.floor();
        let index = |k: f64| k.clamp(0.0, f64::from(n - 1)) as usize;
        (index(low), index(low + 1.0), at - low)
    };
    let ((x0, x1, fx), (y0, y1, fy)) = (place(u, map.width), place(v, map.height));
    let at = |x: usize, y: usize| f64::from(map.samples[y * map.width as usize + x]);
    let row = |y: usize| at(x0, y) + fx * (at(x1, y) - at(x0, y));
    row(y0) + fy * (row(y1) - row(y0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Albedo;
    use std::sync::Arc;

    #[test]
    fn maps_and_limits_thin_the_trees() {
        let map = Raster { width: 2, height: 1, samples: vec![0.0, 1.0] };
        let heights = Raster { width: 2, height: 2, samples: vec![0.0, 100.0, 0.0, 100.0] };
        let terrain = Terrain {
            origin: [0.0; 2],
            extent: [100.0; 2],
            cell_size: 100.0,
            heights: Some(heights),
            albedo: Albedo::Uniform([0.1; 3]),
        };
        let at = |between_heights, below_slope, x: f64| {
            let d = Distribution::Density {
                map: Some(Arc::new(map.clone())),
                max_density: 0.02,
                between_heights,
                below_slope,
            };
            local(&d, &terrain, x, 50.0)
        };
        assert!((at(None, None, 50.0) - 0.01).abs() < 1e-9);
        assert!((at(None, None, 90.0) - 0.02).abs() < 1e-9);
        assert_eq!(at(Some([0.0, 40.0]), None, 90.0), 0.0);
        assert_eq!(at(None, Some(20.0), 50.0), 0.0);
    }
}
