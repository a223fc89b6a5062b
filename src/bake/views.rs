//! The texels of a z-field: rasters resolved to premultiplied RGBA8, with mips.

use std::f32::consts::SQRT_2;

use rayon::prelude::*;

use super::occlusion::Occlusion;
use super::raster::{Raster, SUBSAMPLES, View};
use super::surface::Surface;
use crate::physics::views::{self, Basis};
use crate::physics::zfield::ZField;
use crate::progress::Progress;

/// A depth in [−√2, √2] as stored: (d + √2)/(2√2).
pub fn encode_depth(d: f32) -> f32 {
    (d + SQRT_2) / (2.0 * SQRT_2)
}

/// Rasters of all views of a surface, and what is made `of` each, in the order of the layers.
pub fn rasters<T: Send>(
    surface: &Surface,
    n: u32,
    resolution: u32,
    progress: &Progress,
    of: impl Fn(&Raster, &View) -> T + Sync,
) -> Vec<T> {
    let pairs: Vec<_> = views::pairs(n).collect();
    let draw = |raster: &mut Raster, &(i, j): &(i32, i32)| {
        let view = View::new(&Basis::new(views::direction(n, i, j)), resolution);
        raster.draw(surface, &view);
        let made = of(raster, &view);
        progress.step(1);
        made
    };
    pairs.par_iter().map_init(|| Raster::new(resolution), draw).collect()
}

/// All views of a surface. Each view depends on nothing but the surface: the same bits for any number of threads.
pub fn draw(
    surface: &Surface,
    occlusion: &Occlusion,
    n: u32,
    resolution: u32,
    progress: &Progress,
) -> ZField {
    let layers: Vec<Vec<Vec<u8>>> = rasters(surface, n, resolution, progress, |raster, view| {
        mips(resolve(raster, view, occlusion), resolution)
    });
    let count = resolution.ilog2() as usize + 1;
    let levels = (0..count)
        .map(|level| {
            let mut all = Vec::with_capacity(layers.len() * layers[0][level].len());
            layers.iter().for_each(|l| all.extend_from_slice(&l[level]));
            all
        })
        .collect();
    ZField { n, resolution, levels }
}

/// Level 0 in floats: the mean over each texel's sub-samples, those without a surface counting as zero, so
/// that everything comes out multiplied by the opacity.
fn resolve(raster: &Raster, view: &View, occlusion: &Occlusion) -> Vec<[f32; 4]> {
    let resolution = raster.size / SUBSAMPLES;
    let share = 1.0 / (SUBSAMPLES * SUBSAMPLES) as f32;
    let mut texels = vec![[0f32; 4]; (resolution * resolution) as usize];
    for (row, samples) in raster.nearest.chunks_exact(raster.size as usize).enumerate() {
        let row = row as u32;
        let texel_row = &mut texels[(row / SUBSAMPLES * resolution) as usize..][..resolution as usize];
        for (column, &near) in samples.iter().enumerate().filter(|(_, d)| d.is_finite()) {
            let far = raster.farthest[(row * raster.size) as usize + column];
            let column = column as u32;
            let seen = occlusion.at(view.point(raster.size, column, row, near));
            let texel = &mut texel_row[(column / SUBSAMPLES) as usize];
            for (t, x) in texel.iter_mut().zip([encode_depth(near), encode_depth(far), seen, 1.0]) {
                *t += share * x;
            }
        }
    }
    // No surface comes into the border but by rounding.
    let last = resolution as usize - 1;
    for (i, texel) in texels.iter_mut().enumerate() {
        let (x, y) = (i % resolution as usize, i / resolution as usize);
        if x == 0 || y == 0 || x == last || y == last {
            *texel = [0.0; 4];
        }
    }
    texels
}

/// Rounds a level to bytes, and averages it 2 × 2 for the next, down to one texel; the averages are of
/// unrounded values.
fn mips(mut level: Vec<[f32; 4]>, resolution: u32) -> Vec<Vec<u8>> {
    let mut levels = Vec::new();
    let mut size = resolution as usize;
    loop {
        levels.push(level.iter().flat_map(|t| t.map(|x| (x * 255.0 + 0.5) as u8)).collect());
        if size == 1 {
            return levels;
        }
        let half = size / 2;
        level = (0..half * half)
            .map(|i| {
                let at = 2 * (i / half) * size + 2 * (i % half);
                let four = [level[at], level[at + 1], level[at + size], level[at + size + 1]];
                std::array::from_fn(|c| 0.25 * (four[0][c] + four[1][c] + four[2][c] + four[3][c]))
            })
            .collect();
        size = half;
    }
}
