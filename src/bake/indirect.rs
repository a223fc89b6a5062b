//! Light that met more than one surface ([`crate::physics::indirect`]), measured by paths through a forest of a species' meshes.
//!
//! Rays from viewers in random directions, above the forest or on its ground, meet a tree that stands among others, and from there paths go
//! on as light came: at every surface but the first they ask for the sun, and what leaves for the sky without meeting another surface counts for that. The ground is level, with the scene's
//! mean reflectance. What a path brings, per irradiance of a sun in a random place, is a sample of L at this view, sun and height;
//! coefficients are what makes Σ (L − Σ c Y)² least. A path's light varies by about twice its mean, and 131,072 rays for
//! `table_rays` = 2048, of which in a dense forest an eighth meet
//! what such a viewer sees of the tree, leave less than two hundredths of it to each of fifteen coefficients.

mod fit;
mod place;

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use self::fit::Fit;
use self::place::{GROUND_STEP, Place, open, scattered, sphere};
use super::SpeciesBake;
use super::foliage::Foliage;
use super::grove::{Grove, Tree};
use super::self_shadow::direction;
use super::tables::{ForestSettings, Patch, mean_area, whole_patches};
use crate::Result;
use crate::physics::hash::{Stream, hash2};
use crate::physics::indirect::{
    Angles, COEFFICIENTS, Indirect, NEAR_SKY, NEAR_SUN, OPEN, SKY_TERMS, SUN_TERMS, near_sky_terms,
    near_sun_terms, open_terms, sky_terms, sun_terms,
};
use crate::physics::tables::density_node;
use crate::physics::views::{self, Basis};
use crate::physics::zfield::{self, Ray};
use crate::progress::Progress;
use crate::rays::Stack;
use crate::scene::{Mesh, OpticsOverride};

/// Rays at every density to one of the knob `table_rays`.
const RAYS: u32 = 64;
/// Of these one in so many leaves the ground.
const GROUND_RAYS: u32 = 4;
/// Rays of a random stream; streams are the unit of work.
const CHUNK: u32 = 512;
/// Places in the forest at every density.
const PLACES: u32 = 8;
/// Trees stand around such a place as far as so many heights of the tallest, and no more than so many.
const AROUND: f64 = 8.0;
const MOST: f64 = 1500.0;
/// Fainter view rays of z-fields show next to nothing.
const FAINTEST: f64 = 0.02;
/// Seeds.
const SEED: u32 = 0x1d1;

/// A species of a forest.
#[derive(Clone, Debug)]
pub struct Kind<'a> {
    /// The model.
    pub mesh: &'a Mesh,
    /// What the scene says of its reflectances.
    pub optics: &'a OpticsOverride,
    /// What was baked of its views.
    pub bake: &'a SpeciesBake,
    /// Key of that.
    pub key: [u8; 32],
    /// Trees of it per m² where the forest is densest.
    pub density: f64,
    /// Range of uniformly distributed scales.
    pub scale: [f32; 2],
}

/// A forest: what stands around each of its trees.
#[derive(Clone, Debug)]
pub struct Mix<'a> {
    /// Its species, which thin out together.
    pub kinds: Vec<Kind<'a>>,
    /// Reflectance of the ground, linear RGB.
    pub ground: [f32; 3],
    /// Nodes of the density, and what the knob `table_rays` says.
    pub nodes: u32,
    /// See there.
    pub rays: u32,
    /// Poisson points (for species with listed positions) instead of the Wang pattern.
    pub poisson: bool,
}

impl Mix<'_> {
    /// Trees per m² where it is densest.
    fn density(&self) -> f64 {
        self.kinds.iter().map(|k| k.density).sum()
    }

    /// x = λA there, of all species.
    pub fn thickness(&self) -> f64 {
        self.kinds.iter().map(|k| k.density * mean_area(&k.bake.crown, k.scale)).sum()
    }
}

/// What of the light that leaves scatter comes from the sky, as a tree's z-field has it where a ray at (a, b) of its box goes to `view`: half of
/// the sky visibility there, for leaves of any orientation. `None` where it shows next to nothing.
fn field_sky(bake: &SpeciesBake, tree: &Tree, view: DVec3, (a, b): (f64, f64)) -> Option<f32> {
    let field = &bake.views;
    let [c, s] = tree.turn.map(f64::from);
    // In the tree's own axes.
    let turned = |p: DVec3| DVec3::new(c * p.x + s * p.y, c * p.y - s * p.x, p.z);
    let scale = bake.crown.frame.scale().as_dvec3();
    let basis = Basis::new((view / scale).normalize());
    let origin = turned(basis.right * a + basis.up * (b * basis.extent));
    let to = (turned(view) / scale).normalize();
    let seen = zfield::intersect(field, 0, &views::lookup(field.n, to), &Ray { origin, to }, 2);
    (seen.alpha > FAINTEST).then_some(0.5 * seen.occlusion as f32)
}

/// What is fitted at one density.
#[derive(Clone, Copy, Default)]
struct Fits {
    /// What bark sends of what leaves would in its place.
    bark: Vec3,
    near_sun: Fit<NEAR_SUN>,
    near_sky: Fit<NEAR_SKY>,
    /// Channels: the share of what is scattered that comes from the sky past all trees, and that which the z-field has.
    open: Fit<OPEN>,
    far_sun: Fit<SUN_TERMS>,
    far_sky: Fit<SKY_TERMS>,
    ground_sun: Fit<3>,
    ground_sky: Fit<1>,
}

impl Fits {
    fn merged(mut self, other: Fits) -> Fits {
        self.near_sun.merge(&other.near_sun);
        self.near_sky.merge(&other.near_sky);
        self.open.merge(&other.open);
        self.far_sun.merge(&other.far_sun);
        self.far_sky.merge(&other.far_sky);
        self.ground_sun.merge(&other.ground_sun);
        self.ground_sky.merge(&other.ground_sky);
        self
    }

    fn solve(self) -> [[f32; 3]; COEFFICIENTS] {
        let all = [
            &self.near_sun.solve()[..],
            &self.near_sky.solve(),
            &self.open.solve(),
            &self.far_sun.solve(),
            &self.far_sky.solve(),
            &self.ground_sun.solve(),
            &self.ground_sky.solve(),
        ]
        .concat();
        std::array::from_fn(|i| all[i])
    }

    /// A ray to the first tree of a place, from anywhere.
    fn at_tree(&mut self, place: &Place, bake: &SpeciesBake, stream: &mut Stream, stack: &mut Stack) {
        let (view, light) = (sphere(stream), direction(stream));
        let (tree, frame) = (place.grove.trees[0], bake.crown.frame);
        let scale = frame.scale().as_dvec3();
        let basis = Basis::new((view / scale).normalize());
        let (a, b) = (2.0 * stream.unit() - 1.0, 2.0 * stream.unit() - 1.0);
        let box_point = basis.right * a + basis.up * (b * basis.extent) + basis.w * 2.0;
        let from = frame.to_metres(box_point.as_vec3()) * tree.scale;
        // The box is that of the tree as it was modelled; around its trunk it is the same turned.
        let Some(met) = place.grove.nearest_of(0, from, -view.as_vec3(), f32::MAX, stack) else { return };
        let met = place.leaf(0, &met, -view);
        let z = (met.at.z / f64::from(tree.scale) - f64::from(frame.centre)) / scale.z;
        let angles = Angles { view: view.z, sun: light.z, between: view.dot(light) };
        let above = met.at + met.normal * met.step;
        let seen = view.z > 0.0 && place.open(above, view, stack);
        let near = seen || (view.z < 0.0 && place.free(above, view, above.z / -view.z, stack));
        if !near {
            return;
        }
        let all = open(place, &met, stream, stack);
        if let Some(field) = field_sky(bake, &tree, view, (a, b)) {
            self.open.add(&open_terms(view.z, z), Vec3::ONE, Vec3::new(all, field, 0.0));
        }
        let share = if met.thin { Vec3::ONE } else { self.bark };
        let [of_sun, of_sky] = place.handed(met, light, stream, stack);
        self.near_sun.add(&near_sun_terms(angles, z), share, of_sun);
        self.near_sky.add(&near_sky_terms(view.z, z), share, of_sky);
        if seen {
            self.far_sun.add(&sun_terms(angles), Vec3::ONE, of_sun);
            self.far_sky.add(&sky_terms(view.z), Vec3::ONE, of_sky);
        }
    }

    /// A ray from the ground, to what sends light there after it met a surface.
    fn at_ground(&mut self, place: &Place, around: f64, stream: &mut Stream, stack: &mut Stack) {
        let (up, light) = ((DVec3::Z + sphere(stream)).normalize_or(DVec3::Z), direction(stream));
        let (r, turn) = (around * stream.unit().sqrt(), TAU * stream.unit());
        let from = DVec3::new(r * turn.cos(), r * turn.sin(), GROUND_STEP);
        let mut sums = [Vec3::ZERO; 2];
        if up.z > 0.0
            && let Some(met) = place.nearest(from, up, stack)
        {
            sums[0] = place.sent(&met, light, stack);
            // What this surface has straight from the sky is light from trees as well.
            let mut weight = Vec3::ONE;
            if let Some((o, d)) = scattered(&met, &mut weight, false, stream)
                && place.open(o, d, stack)
            {
                sums[1] = weight;
            }
            let [a, b] = place.handed(met, light, stream, stack);
            sums = [sums[0] + a, sums[1] + b];
        }
        self.ground_sun.add(&[1.0, light.z, light.z * light.z], Vec3::ONE, sums[0]);
        self.ground_sky.add(&[1.0], Vec3::ONE, sums[1]);
    }
}

/// Measures the light of a species of a forest, on all threads of the current rayon pool; the same bits for any number of them.
///
/// # Errors
/// [`crate::Error::Usage`] for a mesh without extent.
pub fn measure(mix: &Mix, species: usize, quiet: bool) -> Result<Indirect> {
    let foliage = mix.kinds.iter().map(|k| Ok(Arc::new(Foliage::new(k.mesh, k.optics)?)));
    let foliage = foliage.collect::<Result<Vec<_>>>()?;
    let settings =
        ForestSettings { pattern_density: mix.density(), poisson: mix.poisson, ..ForestSettings::default() };
    let patches = whole_patches(&settings, PLACES);
    let count = mix.nodes as usize;
    let progress = Progress::new("measuring light between leaves", count as u64, quiet);
    let nodes = (0..count)
        .map(|j| {
            let density = density_node(count, j, mix.density());
            let node = at_density((mix, &foliage, &patches), species, density, j as u32);
            progress.step(1);
            node
        })
        .collect();
    progress.finish();
    Ok(Indirect { max_thickness: mix.thickness() as f32, nodes })
}

/// The coefficients of a species at a density of all, trees per m².
fn at_density(
    (mix, foliage, patches): (&Mix, &[Arc<Foliage>], &[Patch]),
    species: usize,
    density: f64,
    node: u32,
) -> [[f32; 3]; COEFFICIENTS] {
    let heights = mix.kinds.iter().map(|k| f64::from(k.bake.crown.height * k.scale[1]));
    let tallest = heights.fold(0.0, f64::max);
    let radius = (AROUND * tallest).min((MOST / (PI * density.max(1e-12))).sqrt());
    let places: Vec<[Place; 2]> = (0..PLACES)
        .into_par_iter()
        .map(|k| {
            let mut stream = Stream::new(hash2(SEED ^ node, k));
            let patch = &patches[k as usize];
            [Some(species), None].map(|about| {
                let trees = standing(mix, (patch, density / mix.density()), radius, about, &mut stream);
                Place { grove: Grove::new(foliage.to_vec(), trees), ground: Vec3::from(mix.ground) }
            })
        })
        .collect();
    let bake = mix.kinds[species].bake;
    let bark = Vec3::from(bake.bark_ratio());
    let chunks = (mix.rays * RAYS).div_ceil(CHUNK).max(PLACES);
    let parts: Vec<Fits> = (0..chunks)
        .into_par_iter()
        .map(|k| {
            let [tree, ground] = &places[(k % PLACES) as usize];
            let (mut stream, mut stack) = (Stream::new(hash2(SEED + 1 + node, k)), Stack::new());
            let mut fits = Fits { bark, ..Fits::default() };
            for _ in 0..CHUNK {
                fits.at_tree(tree, bake, &mut stream, &mut stack);
            }
            for _ in 0..CHUNK / GROUND_RAYS {
                fits.at_ground(ground, 0.25 * radius, &mut stream, &mut stack);
            }
            fits
        })
        .collect();
    // One after the other: sums of the same bits whoever was first.
    parts.into_iter().fold(Fits::default(), Fits::merged).solve()
}

/// Trees at the points of a patch up to `radius` m around a random place, as the grove's origin, or about one that is of the species `about`, and the
/// first; at each other a tree stands with the chance `share`.
fn standing(
    mix: &Mix,
    (patch, share): (&Patch, f64),
    radius: f64,
    about: Option<usize>,
    stream: &mut Stream,
) -> Vec<Tree> {
    let side = f64::from(patch.side);
    let place = |[x, y]: [f64; 2], species: usize, stream: &mut Stream| {
        let (s, c) = (TAU * stream.unit()).sin_cos();
        let [low, high] = mix.kinds[species].scale;
        Tree {
            base: Vec3::new(x as f32, y as f32, 0.0),
            scale: low + (high - low) * stream.unit() as f32,
            turn: [c as f32, s as f32],
            tint: 1.0,
            species: species as u32,
        }
    };
    let drawn = |u: f64| {
        let mut left = u * mix.density();
        let found = mix.kinds.iter().position(|k| {
            left -= k.density;
            left < 0.0
        });
        found.unwrap_or(mix.kinds.len() - 1)
    };
    let chosen = ((stream.unit() * patch.trees.len() as f64) as usize).min(patch.trees.len() - 1);
    let middle = &patch.trees[chosen];
    let origin = if about.is_some() {
        middle.position.map(f64::from)
    } else {
        [stream.unit() * side, stream.unit() * side]
    };
    let mut all = Vec::new();
    if let Some(species) = about {
        all.push(place([0.0; 2], species, stream));
    }
    // Images of the patch, whose trees are from 0 to its side.
    let images = [0, 1]
        .map(|k| ((origin[k] - radius) / side).floor() as i64..=((origin[k] + radius) / side).floor() as i64);
    for (x, y) in images[0].clone().flat_map(|x| images[1].clone().map(move |y| (x, y))) {
        for t in &patch.trees {
            let at = [
                f64::from(t.position[0]) + x as f64 * side - origin[0],
                f64::from(t.position[1]) + y as f64 * side - origin[1],
            ];
            let itself = about.is_some() && t.index == middle.index && x == 0 && y == 0;
            if !itself && at[0].hypot(at[1]) < radius && stream.unit() < share {
                let species = drawn(stream.unit());
                all.push(place(at, species, stream));
            }
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bake::{BakeSettings, bake_species};
    use crate::physics::indirect::Handed;
    use crate::scene::mesh::{Material, Triangle};

    /// A level board of 4 m² at 8 m, and a speck on the ground under it, so that a tree is 8 m high.
    fn board() -> Mesh {
        let mut mesh = Mesh { materials: vec![Material::leaf()], ..Mesh::default() };
        mesh.positions = vec![
            [-1.0, -1.0, 8.0],
            [1.0, -1.0, 8.0],
            [1.0, 1.0, 8.0],
            [-1.0, 1.0, 8.0],
            [0.0, 0.0, 0.0],
            [0.01, 0.0, 0.0],
            [0.0, 0.01, 0.01],
        ];
        mesh.normals = vec![[0.0, 0.0, 1.0]; 7];
        mesh.uvs = vec![[0.0; 2]; 7];
        mesh.triangles =
            [[0, 1, 2], [0, 2, 3], [4, 5, 6]].map(|vertices| Triangle { vertices, material: 0 }).to_vec();
        mesh
    }

    fn measured(ground: f32, scatters: f32, density: f64) -> Indirect {
        let (mesh, rgb) = (board(), Some([scatters; 3]));
        let optics =
            OpticsOverride { leaf_reflectance: rgb, leaf_transmittance: rgb, ..OpticsOverride::default() };
        let settings = BakeSettings {
            rings: 2,
            resolution: 16,
            occlusion_rays: 8,
            transfer_bands: 0,
            transfer_resolution: 8,
        };
        let bake = bake_species(&mesh, &optics, &settings, true).unwrap();
        let kind = Kind { mesh: &mesh, optics: &optics, bake: &bake, key: [0; 32], density, scale: [1.0; 2] };
        let mix = Mix { kinds: vec![kind], ground: [ground; 3], nodes: 2, rays: 512, poisson: true };
        measure(&mix, 0, true).unwrap()
    }

    #[test]
    fn a_board_gets_what_the_ground_sends_and_passes_half_of_it_on_to_either_side() {
        // The ground under a sun of irradiance 1 at the cosine l sends 0.2 l / π, which is the same from all of it but the board's own shadow,
        // 2 % of what the board sees. Of that irradiance, 0.2 l, it scatters 0.3 to either side; of an even sky's, 0.2 π, likewise. The share
        // that is open to the sky of what it scatters is that of all ways up, a half.
        let light = measured(0.2, 0.3, 1e-6);
        for (view, sun) in [(-0.9, 0.9), (-0.7, 0.4), (0.8, 0.6), (0.9, 0.9)] {
            let [of_sun, of_sky] = light.near(0.0, Angles { view, sun, between: view * sun });
            let close = |handed: Handed, want: f64, what: &str| {
                // Some 6,000 paths, half of which go down: 1.3 % of noise a coefficient, of which a few matter, and the shadow.
                assert!(
                    (handed.at(1.0)[1] / want - 1.0).abs() < 0.07,
                    "{what} {view} {sun}: {:?} {want}",
                    handed.at(1.0)
                );
            };
            close(of_sun, 0.3 * 0.2 * sun / PI, "sun");
            close(of_sky, 0.3 * 0.2, "sky");
        }
        assert!(light.ground(0.0, 0.7)[0].iter().all(|g| *g < 1e-6), "no trees, no light from them");
    }

    #[test]
    fn where_nothing_scatters_nothing_is_handed_on() {
        let black = measured(0.0, 0.0, 0.01);
        assert!(black.nodes.iter().flatten().enumerate().all(|(k, c)| {
            // All but what is open to the sky, which has no colour.
            (20..20 + OPEN).contains(&(k % COEFFICIENTS)) || c.iter().all(|x| *x == 0.0)
        }));
    }

    #[test]
    fn any_number_of_threads_gives_the_same_bits() {
        let on = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| measured(0.2, 0.3, 0.02))
        };
        assert_eq!(on(1), on(3));
    }
}
