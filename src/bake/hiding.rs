//! What a tree hides of the sky from leaves of its neighbours.
//!
//! From a place at height z in a forest of λ trees a square metre that stand anywhere, the part exp(−λ A(ω, z)) of the sky in direction ω
//! is seen: A is the horizontal area of places at that height from where one tree hides it, which is that of its shadow along ω of all
//! that is higher than z (the probability of no point of a Poisson process in A). It is measured here by parallel rays, through the leaf masks.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::surface::{Caster, Surface};
use crate::physics::leaf::Directions;
use crate::rays::Stack;

/// Heights for which it is known, evenly from the bottom of the tree's box to its top, where it is 0.
pub const HEIGHTS: usize = 9;
/// Rays along a side of the square that all shadows of a direction are in.
const RAYS: usize = 96;

/// The area A(ω, z) for what of every direction's cell is above the horizon, towards the middle of that, and, direction by direction, every
/// height; over the area that the tree covers from above. 0 of directions that look down.
pub fn hiding(surface: &Surface, caster: &Caster, directions: &Directions) -> Vec<f64> {
    let of = |w: &[f64; 3]| {
        let w = DVec3::from(*w).normalize_or_zero();
        if w.z > 1e-9 { hidden(surface, caster, w) } else { [0.0; HEIGHTS] }
    };
    let above = hidden(surface, caster, DVec3::Z)[0].max(1e-9);
    let all: Vec<[f64; HEIGHTS]> = directions.half(true).par_iter().map(of).collect();
    all.into_iter().flatten().map(|area| f64::from((area / above) as f32)).collect()
}

/// The area in m² for one direction.
fn hidden(surface: &Surface, caster: &Caster, w: DVec3) -> [f64; HEIGHTS] {
    let scale = surface.frame.scale().as_dvec3();
    let radius = scale.x.hypot(scale.z) * 1.001;
    let centre = DVec3::Z * f64::from(surface.frame.centre);
    let right = w.any_orthonormal_vector();
    let up = w.cross(right);
    let mut stack = Stack::new();
    let mut higher = [0u32; HEIGHTS];
    for k in 0..RAYS * RAYS {
        let at = |n: usize| (2.0 * (n as f64 + 0.5) / RAYS as f64 - 1.0) * radius;
        let origin = centre + right * at(k % RAYS) + up * at(k / RAYS) + w * (2.0 * radius);
        let Some(met) = caster.first(origin.as_vec3(), (-w).as_vec3(), &mut stack) else { continue };
        // The first that is met is the highest.
        let height = (origin.as_vec3() - w.as_vec3() * met.t).dot(Vec3::Z) - surface.frame.centre;
        for (node, count) in higher.iter_mut().enumerate() {
            *count += u32::from(f64::from(height) > node_height(node) * scale.z);
        }
    }
    // A square metre across the rays is 1 / sin(elevation) on the level.
    let each = (2.0 * radius / RAYS as f64).powi(2) / w.z;
    higher.map(|count| f64::from(count) * each)
}

/// The area at a height in scaled tree space, from its nodes: over what is higher than the tree it hides nothing, and under its box as much as
/// at the bottom.
pub fn at_height(nodes: &[f64], height: f64) -> f64 {
    let place = (0.5 * height + 0.5).clamp(0.0, 1.0) * (HEIGHTS - 1) as f64;
    let node = (place as usize).min(HEIGHTS - 2);
    nodes[node] + (nodes[node + 1] - nodes[node]) * (place - node as f64)
}

/// Height of a node in scaled tree space.
fn node_height(node: usize) -> f64 {
    2.0 * node as f64 / (HEIGHTS - 1) as f64 - 1.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Mesh;
    use crate::scene::mesh::{Material, Triangle};

    #[test]
    fn a_board_hides_its_area_from_below_and_a_wall_its_shadow() {
        let mut mesh = Mesh { materials: vec![Material::leaf()], ..Mesh::default() };
        let mut square = |corners: [[f32; 3]; 4]| {
            let base = mesh.positions.len() as u32;
            for p in corners {
                mesh.positions.push(p);
                mesh.normals.push([0.0, 0.0, 1.0]);
                mesh.uvs.push([0.0; 2]);
            }
            for vertices in [[base, base + 1, base + 2], [base, base + 2, base + 3]] {
                mesh.triangles.push(Triangle { vertices, material: 0 });
            }
        };
        // A board of 4 m² at 3 m, and a wall in the plane of x and z from the ground to 2 m, 2 m long.
        square([[-1.0, -1.0, 3.0], [1.0, -1.0, 3.0], [1.0, 1.0, 3.0], [-1.0, 1.0, 3.0]]);
        square([[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 0.0, 2.0], [-1.0, 0.0, 2.0]]);
        let surface = Surface::new(&mesh).unwrap();
        let rule = Directions::new(14).unwrap();
        let all = hiding(&surface, &Caster::new(&surface), &rule);
        let of = |w: [f64; 3]| {
            let k = rule.to.iter().position(|to| (0..3).all(|i| (to[i] - w[i]).abs() < 1e-6)).unwrap();
            &all[k * HEIGHTS..][..HEIGHTS]
        };
        // Nodes at 0, 3/8, … 3 m. Along the zenith the board is all there is, from every height under it; from below nothing.
        assert!(of([0.0, 0.0, 1.0])[..8].iter().all(|a| (a - 1.0).abs() < 0.06), "{all:?}");
        assert!(of([0.0, 0.0, -1.0]).iter().all(|a| *a == 0.0));
        // Along a diagonal of the cube a point h metres high throws its shadow h to the side in x and in y: the wall's is a parallelogram 2 m
        // long and 2 m across. Above a place of it that the board, 4 m², also hides, the wall hides nothing more: rays that pass y = 0
        // under 2 m come from x and y 1 m and more to the side of the board's middle at 3 m, past its edge.
        let diagonal = of([1.0, 1.0, 1.0].map(|c: f64| c / 3f64.sqrt()));
        assert!((diagonal[0] - 2.0).abs() < 0.15, "{diagonal:?}");
        // From 1.5 m on only half a metre of it.
        assert!((diagonal[4] - 1.25).abs() < 0.12, "{diagonal:?}");
        assert!(diagonal.windows(2).all(|w| w[1] <= w[0]) && diagonal[8] == 0.0);
    }
}
