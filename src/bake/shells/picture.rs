//! Shells to look at.

use super::slices::SHARES;
use super::{Mip, Shells};
use crate::land::candidate::tile_kind;
use crate::land::pattern::TILES;
use crate::physics::tonemap;

/// Tiles a side of the picture.
const ACROSS: usize = 4;
/// Ground under the slices, linear RGB over the brightest reflectance there is.
const GROUND: [f32; 3] = [0.5, 0.3, 0.2];

/// RGB bytes and size of a picture, four tiles wide, north up: all slices of one tile from the ground up; the tile as one slice at a quarter, a half,
/// three quarters and all of the full density; and below that four by four tiles of the plane from above, where seams would be
/// seen. Reflectances are over the brightest one of all, without light.
pub fn picture(shells: &Shells, seed: u32) -> (Vec<u8>, [u32; 2]) {
    let side = shells.settings.texels as usize;
    let slices = shells.settings.slices as usize;
    let (finest, single) = (&shells.levels[0][0], &shells.levels[shells.levels.len() - 1][0]);
    let rows = slices.div_ceil(ACROSS);
    // The tile that lies in the south-west of the plane below.
    let shown = tile_kind(seed, 0, 0);
    let mut cells: Vec<(&Mip, usize, usize)> = (0..slices).map(|k| (finest, shown * slices + k, 3)).collect();
    cells.resize(rows * ACROSS, (finest, TILES * slices, 3));
    cells.extend((0..SHARES).map(|share| (single, shown, share)));
    let tiles = (0..ACROSS).rev().flat_map(|y| (0..ACROSS).map(move |x| (x as i32, y as i32)));
    cells.extend(tiles.map(|(x, y)| (single, tile_kind(seed, x, y), 3)));
    let size = [ACROSS * side, cells.len() / ACROSS * side];
    let mut rgb = vec![0; 3 * size[0] * size[1]];
    for (cell, (mip, layer, share)) in cells.into_iter().enumerate() {
        for (x, y) in (0..side).flat_map(|y| (0..side).map(move |x| (x, y))) {
            let texel = (layer * side + side - 1 - y) * side + x;
            let at = 3 * ((cell / ACROSS * side + y) * size[0] + cell % ACROSS * side + x);
            rgb[at..at + 3].copy_from_slice(&colour(shells, mip, texel, share));
        }
    }
    (rgb, size.map(|n| n as u32))
}

/// sRGB of a texel over the ground at one of the shares; black where there is no such layer.
fn colour(shells: &Shells, mip: &Mip, texel: usize, share: usize) -> [u8; 3] {
    let Some(cover) = mip.cover.get(SHARES * texel..SHARES * (texel + 1)) else { return [0; 3] };
    let brightest = shells.most[0].iter().copied().fold(0.0, f32::max);
    // What is seen at full density stands for what is seen at any.
    let part = f32::from(cover[share]) / f32::from(cover[SHARES - 1].max(1));
    let hidden = f32::from(cover[share]) / 255.0;
    std::array::from_fn(|c| {
        let reflected = f32::from(mip.reflected[4 * texel + c]) / 255.0 * shells.most[0][c] / brightest;
        let linear = part * reflected + (1.0 - hidden) * GROUND[c];
        (255.0 * tonemap::srgb(f64::from(linear.clamp(0.0, 1.0))) + 0.5) as u8
    })
}
