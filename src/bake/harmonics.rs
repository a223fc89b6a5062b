//! How light of each direction reaches the two sides of a model's faces, as spherical harmonics (Sloan, Kautz & Snyder 2002; Behrendt
//! et al. 2005, section 4): the transfer of direct light through the model's own crown, shadows and cosine together.
//!
//! With n a face's normal (of the order of its corners), V(ω) what the model leaves free of that direction and Y the harmonics of
//! [`crate::physics::harmonics`], in the model's own axes,
//!
//! front = ∫ over n·ω > 0 of V (n·ω) Y dω,   back = ∫ over n·ω < 0 of V |n·ω| Y dω.
//!
//! Of a light L = ∫ L(ω) Y dω these are irradiances: a viewer on the side of n sees the radiance (ρ front + τ back)·L/π of a leaf that
//! reflects ρ and lets τ through, on the other side (ρ back + τ front)·L/π. Bark lets nothing through.
//!
//! What is seen of a crown is lit by another sun than these means say: [`seen`] corrects that.
//!
//! Rays are cast from places all over the face, through leaf masks, in directions spread by their cosines. A leaf does not hide itself
//! (nor do the crossed parts of one), a face of bark neither; bark's back finds the inside of its branch.

pub(in crate::bake) mod file;
pub mod seen;

use glam::Vec3;
use rayon::prelude::*;

use super::envelope::{LARGEST, leaves, place};
use super::hiding::hiding;
use super::surface::{Caster, Surface};
use crate::Result;
use crate::physics::harmonics::{KEPT, evaluate};
use crate::physics::hash::{hash2, unit};
use crate::physics::leaf::Directions;
use crate::progress::Progress;
use crate::rays::Stack;
use crate::scene::Mesh;

/// Rays a side of a face.
pub const RAYS: u32 = 64;

/// Transfer to one side of a face, of l = 0, 1, 2.
pub type Transfer = [f32; KEPT];

/// Directions in which it is known what trees hide of the sky from each other.
pub const SKY_DIRECTIONS: usize = 26;

/// What lighting a model by harmonics takes.
#[derive(Clone, Debug, PartialEq)]
pub struct Harmonics {
    /// Of every face the transfer to its front and to its back.
    pub faces: Vec<[Transfer; 2]>,
    /// What the tree hides of the sky from its neighbours' leaves, in [`SKY_DIRECTIONS`] directions ([`super::hiding::hiding`]).
    pub hiding: Vec<f64>,
    /// What the sun does on what is seen of leaves and bark, over what the coefficients say.
    pub seen: seen::Corrections,
}

impl Harmonics {
    /// Of a model.
    ///
    /// # Errors
    /// [`crate::Error::Usage`] for a model without extent.
    pub fn new(mesh: &Mesh, quiet: bool) -> Result<Self> {
        let surface = Surface::new(mesh)?;
        let faces = transfers(mesh, &surface, quiet);
        let rule = Directions::new(SKY_DIRECTIONS);
        let hiding = rule.map_or(Vec::new(), |rule| hiding(&surface, &Caster::new(&surface), &rule));
        let seen = seen::measure(mesh, &surface, &faces);
        Ok(Harmonics { faces, hiding, seen })
    }
}

/// Of every face of a surface the transfer to its front and to its back; the same bits on any number of threads.
pub fn transfers(mesh: &Mesh, surface: &Surface, quiet: bool) -> Vec<[Transfer; 2]> {
    let (leaf_of, _) = leaves(mesh, surface, LARGEST);
    let caster = Caster::new(surface);
    let progress = Progress::new("baking harmonics", surface.faces.len() as u64, quiet);
    let all = (0..surface.faces.len() as u32)
        .into_par_iter()
        .map_init(Stack::new, |stack, face| {
            progress.step(1);
            let leaf = leaf_of[face as usize];
            let own = |other| other == face || leaf.is_some() && leaf_of[other as usize] == leaf;
            [1.0, -1.0].map(|side| transfer(surface, &caster, (face, side), &own, stack))
        })
        .collect();
    progress.finish();
    all
}

/// Transfer to one side of a face: π times the mean of V Y over directions that are spread by their cosine.
fn transfer(
    surface: &Surface,
    caster: &Caster,
    (face, side): (u32, f32),
    own: &impl Fn(u32) -> bool,
    stack: &mut Stack,
) -> Transfer {
    let mut sum = [0.0; KEPT];
    let normal = caster.normal(face) * side;
    let turn = unit(hash2(face, side.to_bits()));
    for k in 0..RAYS {
        let w = cosine_direction(normal, k, turn);
        if !caster.occluded_by_others(place(surface, &[face], k).0, w, own, stack) {
            let y = evaluate(w.as_dvec3().to_array());
            sum.iter_mut().zip(y).for_each(|(s, y)| *s += y);
        }
    }
    sum.map(|s| (s * std::f64::consts::PI / f64::from(RAYS)) as f32)
}

/// Direction k of [`RAYS`] above a normal, as many a solid angle as their cosine: a spiral over the disc below them.
fn cosine_direction(normal: Vec3, k: u32, turn: f32) -> Vec3 {
    const GOLDEN: f32 = 0.618_034;
    let out = (k as f32 + 0.5) / RAYS as f32;
    let (s, c) = (std::f32::consts::TAU * (k as f32 * GOLDEN + turn).fract()).sin_cos();
    let (a, b) = normal.any_orthonormal_pair();
    (a * c + b * s) * out.sqrt() + normal * (1.0 - out).sqrt()
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::physics::harmonics::{clamped_cosine, even_sky, irradiance, sun};
    use crate::scene::Material;
    use crate::scene::mesh::Triangle;
    use std::f64::consts::PI;

    fn add(mesh: &mut Mesh, corners: [Vec3; 3], material: u32) {
        let first = mesh.positions.len() as u32;
        for p in corners {
            mesh.positions.push(p.to_array());
            mesh.normals.push([0.0, 0.0, 1.0]);
            mesh.uvs.push([0.0; 2]);
        }
        mesh.triangles.push(Triangle { vertices: [0, 1, 2].map(|k| first + k), material });
    }

    fn model() -> Mesh {
        let bark = Material { name: "bark".into(), foliage: false, double_sided: false, ..Material::leaf() };
        Mesh { materials: vec![Material::leaf(), bark], ..Mesh::default() }
    }

    fn bake(mesh: &Mesh) -> (Surface, Vec<[Transfer; 2]>) {
        let surface = Surface::new(mesh).unwrap();
        let all = transfers(mesh, &surface, true);
        (surface, all)
    }

    fn near(got: &Transfer, want: &[f64], bound: f64, what: &str) {
        for (k, (got, want)) in got.iter().zip(want).enumerate() {
            assert!((f64::from(*got) - want).abs() < bound, "{what}, {k}: {got} {want}");
        }
    }

    #[test]
    fn a_lone_leaf_has_a_clamped_cosine_on_each_side() {
        for turn in 0..20 {
            let mut mesh = model();
            let q = glam::Quat::from_euler(glam::EulerRot::ZYX, 0.4 * turn as f32, 1.1 * turn as f32, 0.3);
            add(&mut mesh, [Vec3::X, Vec3::Y, Vec3::ZERO].map(|p| q * p + Vec3::Z), 0);
            let (_, all) = bake(&mesh);
            let normal = (q * Vec3::Z).as_dvec3();
            // A spiral of 64 rays is out of balance by one at its rim, where harmonics reach 1: π/64.
            near(&all[0][0], &clamped_cosine(normal.into()), 0.05, "front");
            near(&all[0][1], &clamped_cosine((-normal).into()), 0.05, "back");
        }
    }

    /// Before a wall half of the sky is left: x > 0. The quarter's integrals of z Y are by hand.
    #[test]
    fn a_leaf_at_a_wall_has_half() {
        let mut mesh = model();
        add(&mut mesh, [Vec3::ZERO, Vec3::X * 0.02, Vec3::Y * 0.02], 0);
        add(
            &mut mesh,
            [Vec3::new(-1e-3, -1e4, -1e4), Vec3::new(-1e-3, 0.0, 2e4), Vec3::new(-1e-3, 1e4, -1e4)],
            1,
        );
        let (_, all) = bake(&mesh);
        let k = |n: f64, d: f64| (n / (d * PI)).sqrt();
        let mut want = [0.0; KEPT];
        want[0] = k(1.0, 4.0) * PI / 2.0;
        want[2] = k(3.0, 4.0) * PI / 3.0;
        want[3] = k(3.0, 4.0) * 2.0 / 3.0;
        want[6] = k(5.0, 16.0) * PI / 4.0;
        want[7] = k(15.0, 4.0) * PI / 8.0;
        // A spiral of 64 has half of its rays on either side to within two: 2 π/64 of harmonics of up to 1.
        near(&all[0][0], &want, 0.1, "above");
        // Below, z is the other way.
        [2, 7].into_iter().for_each(|odd: usize| want[odd] = -want[odd]);
        near(&all[0][1], &want, 0.1, "below");
    }

    /// A ball of bark, of triangles whose corners are on it: convex, so that nothing hides its outside, and all its inside.
    pub(in crate::bake) fn ball() -> Mesh {
        let mut mesh = model();
        let (rings, sides) = (16, 32);
        let at = |i: u32, j: u32| {
            let (polar, turn) =
                (PI * f64::from(i) / f64::from(rings), 2.0 * PI * f64::from(j) / f64::from(sides));
            let w = [polar.sin() * turn.cos(), polar.sin() * turn.sin(), polar.cos()];
            Vec3::from(w.map(|x| x as f32)) + Vec3::Z * 2.0
        };
        for i in 0..rings {
            for j in 0..sides {
                let (a, b, c, d) =
                    (at(i, j), at(i + 1, j), at(i + 1, (j + 1) % sides), at(i, (j + 1) % sides));
                if i + 1 < rings {
                    add(&mut mesh, [a, b, c], 1);
                }
                if i > 0 {
                    add(&mut mesh, [a, c, d], 1);
                }
            }
        }
        mesh
    }

    #[test]
    fn a_ball_of_bark_shines_as_closed_forms_say() {
        let (surface, all) = bake(&ball());
        let caster = Caster::new(&surface);
        let (mut worst_sky, mut worst_sun) = (0.0f64, 0.0f64);
        for (face, [front, back]) in (0..).zip(&all) {
            let n = caster.normal(face).as_dvec3();
            let front = front.map(f64::from);
            // A reflectance of 1: radiance is irradiance/pi. Of an even sky of radiance 1 it is (1 + n_z)/2.
            let sky = irradiance(&front, &even_sky()) / PI;
            worst_sky = worst_sky.max((sky - 0.5 * (1.0 + n.z)).abs());
            // Of a sun of irradiance 1, the clamped cosine of three bands.
            let to = glam::DVec3::new(0.48, -0.6, 0.64);
            let c = n.dot(to);
            let want = (0.25 + 0.5 * c + 5.0 / 32.0 * (3.0 * c * c - 1.0)) / PI;
            worst_sun = worst_sun.max((irradiance(&front, &sun(to.into())) / PI - want).abs());
            near(back, &[0.0; KEPT], 1e-6, "inside");
        }
        // A spiral of 64 rays out of balance by one at its rim: 2/64 of the even sky's difference between high and low, 1, and as much
        // of a sun's, from 1/(16π) to 1/π.
        assert!(worst_sky < 2.0 / 64.0 && worst_sun < 2.0 / 64.0, "{worst_sky} {worst_sun}");
    }

    #[test]
    fn any_number_of_threads_gives_the_same() {
        let mesh = ball();
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| bake(&mesh).1)
        };
        assert!(on(1) == on(3));
    }
}
