//! Coarser bark: edge collapses by quadric errors (meshoptimizer), and how far the outcome really is from the whole.
//!
//! A quadric error tells how far places move off the surface. So twigs thinner than the error may go altogether, from end to end, and the plain distance of the whole
//! bark from what is left is the length of a twig. What counts is what is seen: that a place moved, by its distance, or that a twig is gone, by
//! half of how thick it was. The error of a level is the largest of either, over places of both surfaces.

use std::collections::HashMap;

use glam::Vec3;
use meshopt::{SimplifyOptions, VertexDataAdapter};
use rayon::prelude::*;

use super::nearest::Nearest;
use crate::bake::surface::{Face, Surface};
use crate::physics::levels::BARK_LEVELS;
use crate::rays::{Stack, Triangles};

/// How far collapses may go, m: however far it takes. What the outcome may be used for, its error says.
const LIMIT: f32 = 1e6;

/// A level of a tree's bark.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BarkLevel {
    /// Faces of the surface that are in it as they are.
    pub kept: Vec<u32>,
    /// Triangles of its own.
    pub new: Vec<NewFace>,
    /// How far any place of it is from the whole bark, and any place of the whole bark from it or, where it is thinner, half of its thickness, m; no less than of finer levels.
    pub error: f64,
}

/// A triangle between corners of the whole bark.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct NewFace {
    /// Corners: three times a face of the surface, and which of its corners.
    pub corners: [u32; 3],
    /// The face of the surface that is nearest to its middle, whose surroundings it has.
    pub like: u32,
}

impl NewFace {
    /// The triangle.
    pub fn face(&self, surface: &Surface) -> Face {
        let of = |c: u32| &surface.faces[c as usize / 3];
        Face {
            p: self.corners.map(|c| of(c).p[c as usize % 3]),
            uv: self.corners.map(|c| of(c).uv[c as usize % 3]),
            ..*of(3 * self.like)
        }
    }
}

/// Most triangles of a level's own, where so many are to be simplified.
pub fn most(opaque: usize, level: usize) -> usize {
    opaque >> level
}

/// Of some faces, those that stay in every level, because they have holes; and those that are simplified.
pub fn parted(surface: &Surface, whole: &[u32]) -> (Vec<u32>, Vec<u32>) {
    whole.iter().copied().partition(|k| surface.faces[*k as usize].mask.is_some())
}

/// Levels with a half, a quarter and so on of the triangles, as far as there are such.
pub(super) fn simplified(surface: &Surface, whole: &[u32]) -> Vec<BarkLevel> {
    let (holed, opaque) = parted(surface, whole);
    let welded = Welded::new(surface, &opaque);
    let levels: Vec<Option<BarkLevel>> = (1..BARK_LEVELS)
        .into_par_iter()
        .map(|level| {
            let new = welded.simplify(surface, &opaque, most(opaque.len(), level))?;
            let error = error(surface, &opaque, &new);
            Some(BarkLevel { kept: holed.clone(), new, error })
        })
        .collect();
    let mut farthest = 0f64;
    let mut found: Vec<BarkLevel> = levels.into_iter().map_while(|level| level).collect();
    for level in &mut found {
        // As it is kept, and no less.
        farthest = farthest.max(f64::from((level.error as f32).next_up()));
        level.error = farthest;
    }
    found
}

/// Bark whose faces share corners where these are at the same place: what is bark has no seams of texture.
struct Welded {
    /// Places, m.
    places: Vec<Vec3>,
    /// A corner that is there.
    corners: Vec<u32>,
    indices: Vec<u32>,
}

impl Welded {
    fn new(surface: &Surface, faces: &[u32]) -> Self {
        let mut welded = Welded { places: Vec::new(), corners: Vec::new(), indices: Vec::new() };
        let mut at = HashMap::new();
        for face in faces {
            for (k, p) in (0u32..).zip(surface.faces[*face as usize].p) {
                let index = *at.entry(p.to_array().map(f32::to_bits)).or_insert_with(|| {
                    welded.places.push(p * surface.frame.scale());
                    welded.corners.push(3 * face + k);
                    welded.places.len() as u32 - 1
                });
                welded.indices.push(index);
            }
        }
        welded
    }

    /// At most so many triangles in place of all; `None` where so few cannot be had.
    fn simplify(&self, surface: &Surface, opaque: &[u32], most: usize) -> Option<Vec<NewFace>> {
        if most == 0 {
            return None;
        }
        let bytes = bytemuck::cast_slice(&self.places);
        let places = VertexDataAdapter::new(bytes, size_of::<Vec3>(), 0).ok()?;
        let options = SimplifyOptions::ErrorAbsolute;
        let found = meshopt::simplify(&self.indices, &places, 3 * most, LIMIT, options, None);
        if found.is_empty() || found.len() > 3 * most {
            return None;
        }
        let whole: Vec<[Vec3; 3]> = triangles(surface, opaque);
        let nearest = Nearest::new(&whole);
        let new = found.as_chunks::<3>().0.iter().map(|corners| {
            let middle = corners.iter().map(|c| self.places[*c as usize]).sum::<Vec3>() / 3.0;
            let like = opaque[nearest.find(middle, f32::INFINITY).1 as usize];
            NewFace { corners: corners.map(|c| self.corners[c as usize]), like }
        });
        Some(new.collect())
    }
}

/// Corners of faces, m from the middle of the tree's box.
fn triangles(surface: &Surface, faces: &[u32]) -> Vec<[Vec3; 3]> {
    faces.iter().map(|k| surface.faces[*k as usize].p.map(|p| p * surface.frame.scale())).collect()
}

/// What is lost between the whole and a level, m (see above): over corners and middles of edges of the level, and over places within triangles of the whole, from where lines
/// cross the branch.
pub(super) fn error(surface: &Surface, whole: &[u32], new: &[NewFace]) -> f64 {
    let whole = triangles(surface, whole);
    let new: Vec<[Vec3; 3]> =
        new.iter().map(|n| n.face(surface).p.map(|p| p * surface.frame.scale())).collect();
    let (to_whole, to_new) = (Nearest::new(&whole), Nearest::new(&new));
    let moved = new.iter().flat_map(places).map(|p| to_whole.find(p, f32::INFINITY).0);
    let (rays, mut stack) = (Triangles::new(&whole), Stack::new());
    let lost = (0u32..).zip(&whole).flat_map(|(k, t)| within(t).map(|p| (k, t, p))).map(|(k, t, p)| {
        let normal = (t[1] - t[0]).cross(t[2] - t[0]).normalize_or_zero();
        // To both sides, because not all models wind their faces alike; and at angles, because between a tube's rings are gaps, and its ends are open.
        let ways = [normal, -normal].into_iter().flat_map(|side| {
            let tilted = t.map(|corner| side + (corner - p).normalize_or_zero());
            [side, tilted[0], tilted[1], tilted[2]]
        });
        let depth = |way: Vec3| {
            let met = rays.nearest(p, way, f32::MAX, &mut stack, |face, _, _| face != k);
            met.map_or(f32::INFINITY, |met| met.t * way.dot(normal).abs())
        };
        let thickness = ways.map(depth).fold(f32::INFINITY, f32::min);
        to_new.find(p, 0.5 * thickness).0
    });
    f64::from(moved.chain(lost).fold(0.0, f32::max))
}

/// Places within a triangle.
fn within([a, b, c]: &[Vec3; 3]) -> [Vec3; 4] {
    let middle = (*a + *b + *c) / 3.0;
    [middle, (*a + middle) * 0.5, (*b + middle) * 0.5, (*c + middle) * 0.5]
}

/// Corners, middles of edges and the middle of a triangle.
fn places([a, b, c]: &[Vec3; 3]) -> [Vec3; 7] {
    [*a, *b, *c, (*a + *b) * 0.5, (*b + *c) * 0.5, (*c + *a) * 0.5, (*a + *b + *c) / 3.0]
}
