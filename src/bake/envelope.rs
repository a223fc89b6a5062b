//! Envelopes of leaves (BBP08 section 6): for every leaf, how thick the tree around it is in a few directions.
//!
//! BBP08 multiply the solid angles of neighbour leaves sorted by distance, all as if they were seen from the front. Here rays are cast at
//! the mesh, through leaf masks, bark included: the share of rays of a direction's cell of the sphere that leave the tree is e^(−t), and t the
//! optical thickness. A leaf does not hide itself. Of a leaf places count as they are seen. A cell that no ray leaves has the
//! thickness of half a ray. Bark has envelopes as well, patch by patch, for the sky's light on its outside; what light leaves hand to each other knows
//! leaves alone.

use glam::Vec3;
use rayon::prelude::*;

use super::hiding::hiding;
use super::occlusion::sphere_direction;
use super::surface::{Caster, Face, Surface};
use crate::physics::hash::hash2;
use crate::physics::leaf::Directions;
use crate::progress::Progress;
use crate::rays::Stack;
use crate::scene::Mesh;

/// Rays a direction, on average.
pub const RAYS: u32 = 32;
/// Of these, rays from one place of the leaf, over the whole sphere.
const RAYS_A_PLACE: u32 = 32;
/// Faces that hang together are one leaf up to this radius, as a part of the tree's half width; in larger ones each is its own.
pub(super) const LARGEST: f32 = 0.1;

/// Which faces of a surface share an envelope: those of a leaf, and of bark those whose middles lie in the same cube.
#[derive(Clone, Debug, PartialEq)]
pub struct Parts {
    /// Part of every face of the surface; leaves come first.
    pub of: Vec<u32>,
    /// How many are leaves.
    pub leaves: usize,
    /// How many there are.
    pub count: usize,
}

/// Parts of a tree, and what each knows of the tree around it.
#[derive(Clone, Debug, PartialEq)]
pub struct Envelopes {
    /// Which faces are of which part.
    pub parts: Parts,
    /// Optical thickness of the tree in each direction around what is seen of a part from above, and from below; part after part. Numbers of
    /// single precision, as they are kept.
    pub thickness: Vec<f64>,
    /// Directions a part.
    pub directions: usize,
    /// What the tree hides of the sky from its neighbours' leaves ([`super::hiding::hiding`]).
    pub hiding: Vec<f64>,
}

impl Envelopes {
    /// Casts `rays` a direction and part, on average.
    pub fn new(surface: &Surface, parts: Parts, directions: &Directions, rays: u32, quiet: bool) -> Self {
        let mut faces = vec![Vec::new(); parts.count];
        for (face, part) in parts.of.iter().enumerate() {
            faces[*part as usize].push(face as u32);
        }
        let caster = Caster::new(surface);
        let progress = Progress::new("baking envelopes of leaves", faces.len() as u64, quiet);
        let thickness = faces
            .par_iter()
            .enumerate()
            .map_init(Stack::new, |stack, (part, faces)| {
                progress.step(1);
                // A leaf does not hide itself; of bark, only the triangle where a ray begins does not.
                let origin = |k| place(surface, faces, k);
                let own = |from: u32, face: u32| {
                    if part < parts.leaves { parts.of[face as usize] == part as u32 } else { face == from }
                };
                let out = |from: u32, w: Vec3| part < parts.leaves || caster.normal(from).dot(w) > 0.0;
                thickness((&caster, own, out), origin, directions, rays, part as u32, stack)
            })
            .flatten()
            .map(|t| f64::from(t as f32))
            .collect();
        progress.finish();
        let hiding = hiding(surface, &caster, directions);
        Envelopes { parts, thickness, directions: directions.len(), hiding }
    }

    /// What a face's part knows: around what is seen of it from above, and from below.
    pub fn of(&self, face: u32) -> [&[f64]; 2] {
        let first = 2 * self.parts.of[face as usize] as usize * self.directions;
        [0, 1].map(|side| &self.thickness[first + side * self.directions..][..self.directions])
    }

    /// The same around what is seen of it by a viewer in a direction of which this is the height, −1 to 1.
    pub fn seen(&self, face: u32, height: f64) -> Vec<f64> {
        let [above, below] = self.of(face);
        let from = 0.5 + 0.5 * height;
        above.iter().zip(below).map(|(a, b)| from * a + (1.0 - from) * b).collect()
    }
}

impl Parts {
    /// Faces of foliage that share a corner are one leaf. Without foliage all faces stand for leaves.
    pub fn new(mesh: &Mesh, surface: &Surface) -> Self {
        let (leaf_of, leaves) = leaves(mesh, surface, LARGEST);
        let side = LARGEST * surface.frame.half_width;
        let (mut cells, mut count) = (std::collections::HashMap::new(), leaves as u32);
        let mut cell = |face: &Face| {
            let middle = face.p.iter().map(|p| surface.frame.to_metres(*p)).sum::<Vec3>() / 3.0;
            *cells.entry((middle / side).floor().as_ivec3()).or_insert_with(|| {
                count += 1;
                count - 1
            })
        };
        let of = surface.faces.iter().zip(&leaf_of).map(|(face, leaf)| leaf.unwrap_or_else(|| cell(face)));
        let of = of.collect();
        Parts { of, leaves, count: count as usize }
    }
}

/// Leaf of every face, and how many there are: faces that share a corner are one, up to a radius as a part of the tree's half width. Without foliage all faces stand for
/// leaves.
pub(super) fn leaves(mesh: &Mesh, surface: &Surface, largest: f32) -> (Vec<Option<u32>>, usize) {
    let any = surface.faces.iter().any(|f| mesh.materials[f.material as usize].foliage);
    let is_leaf = |f: &Face| !any || mesh.materials[f.material as usize].foliage;
    let roots = joined(surface, is_leaf);
    let mut bounds = vec![(Vec3::INFINITY, Vec3::NEG_INFINITY); roots.len()];
    for (face, root) in surface.faces.iter().zip(&roots) {
        let b = &mut bounds[*root as usize];
        *b = face.p.iter().fold(*b, |(low, high), p| (low.min(*p), high.max(*p)));
    }
    let large = |root: u32| {
        let (low, high) = bounds[root as usize];
        0.5 * ((high - low) * surface.frame.scale()).length() > largest * surface.frame.half_width
    };
    let (mut names, mut count) = (std::collections::HashMap::new(), 0u32);
    let mut name = |key: u32| {
        *names.entry(key).or_insert_with(|| {
            count += 1;
            count - 1
        })
    };
    let leaf_of = (0u32..).zip(&surface.faces).map(|(k, face)| {
        is_leaf(face).then(|| name(if large(roots[k as usize]) { k } else { roots[k as usize] }))
    });
    let leaf_of = leaf_of.collect();
    (leaf_of, count as usize)
}

/// Of every face the one that stands for all that it hangs together with: those that are leaves and share a corner. Of others it is the face itself.
pub(super) fn joined(surface: &Surface, is_leaf: impl Fn(&Face) -> bool) -> Vec<u32> {
    // Each corner's faces lead to one of them, the root.
    let mut parent: Vec<u32> = (0..surface.faces.len() as u32).collect();
    let mut at_corner = std::collections::HashMap::new();
    for (k, face) in surface.faces.iter().enumerate().filter(|(_, f)| is_leaf(f)) {
        for p in face.p {
            let first = *at_corner.entry(p.to_array().map(f32::to_bits)).or_insert(k as u32);
            let (a, b) = (root(&mut parent, first), root(&mut parent, k as u32));
            parent[a.max(b) as usize] = a.min(b);
        }
    }
    (0..parent.len() as u32).map(|k| root(&mut parent, k)).collect()
}

/// The face that stands for all that a face hangs together with.
fn root(parent: &mut [u32], mut k: u32) -> u32 {
    while parent[k as usize] != k {
        parent[k as usize] = parent[parent[k as usize] as usize];
        k = parent[k as usize];
    }
    k
}

/// Point k of an even sequence over a part's faces in turn, m, and the face; where its masks leave nothing, their middles.
pub(super) fn place(surface: &Surface, faces: &[u32], k: u32) -> (Vec3, u32) {
    let on = faces[k as usize % faces.len()];
    let face = &surface.faces[on as usize];
    let [a, b, c] = face.p.map(|p| surface.frame.to_metres(p));
    // One of a few next places that are no holes.
    let (s, t) = (0..8).find_map(|more| surface.spread(face, 8 * k + more)).unwrap_or((1.0 / 3.0, 1.0 / 3.0));
    (a + (b - a) * s + (c - a) * t, on)
}

/// Rays of a direction, how many leave, and the same weighted by how open their places are to viewers above and below.
#[derive(Clone, Copy, Default)]
struct Cell {
    all: u32,
    open: u32,
    weight: [u32; 2],
    weighted: [u32; 2],
}

/// Thickness around what is seen of a part from above, and from below.
///
/// A viewer outside sees a place of it with the probability that a ray leaves from there to his side, its openness o. So what the light of a
/// direction finds there, V (1 or 0), has the mean Σ o V / Σ o over places: more than Σ V, because open places are open to all, and most
/// where light and viewer are on the same side. A ray's own V is left out of its place's o, or its noise would count as openness.
fn thickness(
    (caster, own, out): (&Caster, impl Fn(u32, u32) -> bool, impl Fn(u32, Vec3) -> bool),
    origin: impl Fn(u32) -> (Vec3, u32),
    directions: &Directions,
    rays: u32,
    seed: u32,
    stack: &mut Stack,
) -> Vec<f64> {
    let places = (rays * directions.len() as u32).div_ceil(RAYS_A_PLACE);
    let mut cells = vec![Cell::default(); directions.len()];
    for place in 0..places {
        let ((origin, on), seeds) = (origin(place), [0, 1].map(|half| hash2(seed, 2 * place + half)));
        let own = |face| own(on, face);
        // Cell, whether below the horizon, and whether the ray leaves the tree; nothing of rays into the bark.
        let found: [Option<(usize, usize, u32)>; RAYS_A_PLACE as usize] = std::array::from_fn(|k| {
            let w = sphere_direction(k as u32, RAYS_A_PLACE, seeds);
            if !out(on, w) {
                return None;
            }
            let leaves = !caster.occluded_by_others(origin, w, &own, stack);
            Some((directions.nearest(w.as_dvec3().to_array()), usize::from(w.z < 0.0), u32::from(leaves)))
        });
        let mut open = [0; 2];
        found.iter().flatten().for_each(|(_, side, leaves)| open[*side] += leaves);
        for (cell, side, leaves) in found.into_iter().flatten() {
            // Of cells that straddle the horizon what is above it counts: there are sky and sun.
            if side == 1 && directions.to[cell][2] > -1e-9 {
                continue;
            }
            let cell = &mut cells[cell];
            cell.all += 1;
            cell.open += leaves;
            for (viewer, open) in open.into_iter().enumerate() {
                let others = open - if viewer == side { leaves } else { 0 };
                cell.weight[viewer] += others;
                cell.weighted[viewer] += others * leaves;
            }
        }
    }
    let thickness = |c: &Cell, viewer: usize| match (c.all, c.open, c.weighted[viewer]) {
        (0, ..) => 0.0,
        (all, 0, _) => (2.0 * f64::from(all)).ln(),
        // Single rays leave from places that are open to nothing else on that side.
        (all, open, 0) => (f64::from(all) / f64::from(open)).ln(),
        (_, _, weighted) => (f64::from(c.weight[viewer]) / f64::from(weighted)).ln(),
    };
    [0, 1].iter().flat_map(|viewer| cells.iter().map(|c| thickness(c, *viewer)).collect::<Vec<_>>()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::mesh::{Material, Triangle};

    fn square(mesh: &mut Mesh, [x, z]: [f32; 2], half: f32) {
        let base = mesh.positions.len() as u32;
        for (dx, dy) in [(-half, -half), (half, -half), (half, half), (-half, half)] {
            mesh.positions.push([x + dx, dy, z]);
            mesh.normals.push([0.0, 0.0, 1.0]);
            mesh.uvs.push([0.0; 2]);
        }
        for vertices in [[base, base + 1, base + 2], [base, base + 2, base + 3]] {
            mesh.triangles.push(Triangle { vertices, material: 0 });
        }
    }

    /// Leaves of half a metre, apart from each other, under a roof; or without it.
    fn envelopes(roof: bool) -> Envelopes {
        let mut mesh = Mesh::default();
        mesh.materials.push(Material::leaf());
        square(&mut mesh, [0.0, 1.0], 0.25);
        square(&mut mesh, [10.0, 1.0], 0.25);
        square(&mut mesh, [0.0, 0.0], 0.01);
        if roof {
            square(&mut mesh, [0.0, 2.0], 1000.0);
        } else {
            // As wide, and in nobody's way.
            square(&mut mesh, [1000.0, 1.0], 0.25);
        }
        let surface = Surface::new(&mesh).unwrap();
        let parts = Parts::new(&mesh, &surface);
        Envelopes::new(&surface, parts, &Directions::new(26).unwrap(), 64, true)
    }

    #[test]
    fn a_roof_closes_what_is_above_and_a_leaf_does_not_hide_itself() {
        let directions = Directions::new(26).unwrap();
        let (open, roofed) = (envelopes(false), envelopes(true));
        // Faces that share corners are one leaf; a roof of two faces larger than a leaf can be is two.
        assert_eq!((open.parts.count, roofed.parts.count), (4, 5));
        assert_eq!((open.parts.leaves, &open.parts.of[..4]), (4, &[0, 0, 1, 1][..]));
        for (k, w) in directions.to.iter().enumerate() {
            // The small square below takes a thousandth of the lower cell.
            assert!(open.of(0)[0][k] < 0.1, "{w:?}: {}", open.of(0)[0][k]);
            let t = roofed.of(0)[1][k];
            match w[2] {
                z if z > 0.5 => assert!(t > 64f64.ln(), "{w:?}: {t}"),
                z if z < -0.5 => assert!(t < 0.1, "{w:?}: {t}"),
                // What is above the horizon of a level cell is under the roof, and half as many rays.
                _ => assert!(t > 32f64.ln(), "{w:?}: {t}"),
            }
        }
    }
}
