//! What a card's two sides show, as textures: opacity, which surface there is, and how light comes to it.

use glam::Vec3;

use super::atlas::GUTTER;
use super::means::Means;
use super::paint::{Painted, Seen};
use super::{Card, is_leaf};
use crate::bake::harmonics::{Harmonics, Transfer};
use crate::bake::surface::Surface;
use crate::physics::harmonics::{KEPT, encode};
use crate::scene::Mesh;

/// Mip levels of opacity and surface.
pub const LEVELS: u32 = 4;
/// Layers of harmonics: four numbers in each.
pub const LAYERS: usize = (2 * KEPT).div_ceil(4);
/// A picture with its gutters fills whole texels of every level.
const STEP: u32 = 1 << (LEVELS - 1);

/// What pictures show of faces.
pub struct Shown<'a> {
    /// Unit normals, of the order of corners.
    normals: Vec<Vec3>,
    /// Leaves, as against bark.
    leaf: Vec<bool>,
    /// Light to front and back.
    transfers: &'a [[Transfer; 2]],
}

impl<'a> Shown<'a> {
    /// Of all faces.
    pub fn new(mesh: &Mesh, surface: &Surface, light: &'a Harmonics) -> Self {
        let normal = |f: &crate::bake::surface::Face| {
            let [a, b, c] = f.p.map(|p| surface.frame.to_metres(p));
            (b - a).cross(c - a).normalize_or_zero()
        };
        Shown {
            normals: surface.faces.iter().map(normal).collect(),
            leaf: (0..surface.faces.len() as u32).map(|f| is_leaf(mesh, surface, f)).collect(),
            transfers: &light.faces,
        }
    }
}

/// One side of a card with its gutters, all levels and layers, rows from the top; bytes as [`super::CardCloud`] has them.
pub struct Picture {
    /// Texels with gutters: multiples of 8.
    pub size: [u32; 2],
    /// One byte a texel.
    pub opacity: Vec<Vec<u8>>,
    /// Four.
    pub surface: Vec<Vec<u8>>,
    /// Four, of half as many texels a side.
    pub harmonics: Vec<Vec<u8>>,
}

impl Picture {
    /// Of the front (side 0) or back (side 1) of a card that has been painted, with half of its depth.
    pub fn new(card: &Card, painted: &Painted, depth: f32, side: usize, shown: &Shown) -> Self {
        let size = padded(painted.size);
        let toward = [1.0, -1.0][side];
        let (right, up) = (card.right.normalize_or_zero(), card.up.normalize_or_zero());
        let out = right.cross(up) * toward;
        let (mut surface, mut light) =
            (Means::<5>::new(size), Means::<{ 2 * KEPT }>::new(size.map(|n| n / 2)));
        for (texel, seen) in painted.samples() {
            let Seen { depth: d, face, .. } = seen[side];
            let (at, normal) = (texel.map(|x| x + GUTTER), shown.normals[face as usize]);
            let front = normal.dot(out) >= 0.0;
            let n = if front { normal } else { -normal };
            let leaf = f32::from(u8::from(shown.leaf[face as usize]));
            surface.add(at, [leaf, toward * d / depth.max(1e-9), n.dot(right), n.dot(up), n.dot(out)]);
            let [own, other] = shown.transfers[face as usize];
            let [reflected, passed] = if front { [own, other] } else { [other, own] };
            let both = std::array::from_fn(|k| if k < KEPT { reflected[k] } else { passed[k - KEPT] });
            light.add(at.map(|x| x / 2), both);
        }
        let bytes = |level: Vec<[f32; 5]>| level.into_iter().flat_map(surface_bytes).collect();
        let light = light.filled().swap_remove(0);
        Picture {
            size,
            opacity: opacity(painted, size),
            surface: surface.filled().into_iter().take(LEVELS as usize).map(bytes).collect(),
            harmonics: (0..LAYERS).map(|l| light.iter().flat_map(|x| light_bytes(x, l)).collect()).collect(),
        }
    }
}

/// Texels of a picture with its gutters.
pub fn padded(size: [u32; 2]) -> [u32; 2] {
    size.map(|n| (n + 2 * GUTTER).next_multiple_of(STEP))
}

/// Share of leaf, depth and normal as bytes.
fn surface_bytes([leaf, depth, x, y, z]: [f32; 5]) -> [u8; 4] {
    let byte = |v: f32| (255.0 * v.clamp(0.0, 1.0)).round() as u8;
    let [x, y] = octahedral([x, y, z]);
    [byte(leaf), byte(0.5 + 0.5 * depth), byte(0.5 + 0.5 * x), byte(0.5 + 0.5 * y)]
}

/// A direction with z ≥ 0 on the octahedron's upper half, seen from above: x and y over |x| + |y| + z.
fn octahedral([x, y, z]: [f32; 3]) -> [f32; 2] {
    let sum = (x.abs() + y.abs() + z.max(0.0)).max(1e-9);
    [x / sum, y / sum]
}

/// Numbers of a layer as signed bytes; none after the last is 0.
fn light_bytes(x: &[f32; 2 * KEPT], layer: usize) -> [u8; 4] {
    std::array::from_fn(|k| x.get(4 * layer + k).map_or(0, |x| encode(f64::from(*x)).cast_unsigned()))
}

/// The finest level as it was painted; of coarser ones the share of texels that count as covered in it.
fn opacity(painted: &Painted, size: [u32; 2]) -> Vec<Vec<u8>> {
    let mut finest = vec![0; (size[0] * size[1]) as usize];
    for (k, alpha) in (0..).zip(painted.opacity()) {
        let (x, y) = (k % painted.size[0] + GUTTER, k / painted.size[0] + GUTTER);
        finest[(y * size[0] + x) as usize] = alpha;
    }
    let coarser = |level: u32| {
        let width = size[0] >> level;
        let mut counts = vec![0u32; (width * (size[1] >> level)) as usize];
        for (k, alpha) in (0..).zip(&finest) {
            counts[(((k / size[0]) >> level) * width + ((k % size[0]) >> level)) as usize] +=
                u32::from(*alpha >= 128);
        }
        let all = 1 << (2 * level);
        counts.into_iter().map(|n| ((255 * n + all / 2) / all) as u8).collect()
    };
    let rest: Vec<Vec<u8>> = (1..LEVELS).map(coarser).collect();
    std::iter::once(finest).chain(rest).collect()
}
