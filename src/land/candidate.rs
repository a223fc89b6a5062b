//! The trees of a seed quad on the CPU; twin of `shaders/land/candidate.glsl`: points of the quad's Wang tiles thinned to
//! the local density, then its listed trees.
//!
//! Identities, species, scales, rotations and tints are the shader's to the bit but where a hash falls within rounding of
//! a threshold: densities are doubles here. Heights of the ground differ by the rounding of singles.

use super::density::local;
use super::pattern::Pattern;
use crate::physics::hash::{hash, hash2, unit};
use crate::physics::terrain::height_and_slope;
use crate::scene::{Distribution, Scene, TreePosition};

/// Points of a Wang tile, about.
const POINTS: u32 = 256;
/// Purpose of a tree's random number, as in `shaders/physics/hash.glsl`: its rotation.
pub const HASH_TURN: u32 = 0x51ed_270b;
/// Its scale.
pub const HASH_SCALE: u32 = 0x2c1b_3c6d;
/// Its tint.
pub const HASH_TINT: u32 = 0x297a_2d39;
/// From which share of the full density on it stands.
pub const HASH_THIN: u32 = 0x68e3_1da4;
/// Its species.
pub const HASH_SPECIES: u32 = 0xb529_7a4d;
/// Purpose of the identity of a listed tree.
const LISTED: u32 = 0x9e37_79b9;

/// The point pattern of a scene, laid over its ground.
#[derive(Clone, Debug)]
pub struct Layout {
    /// The tiles.
    pub pattern: Pattern,
    /// Side of a tile, m.
    pub tile_side: f64,
    /// Points per m²: the largest densities of all species together.
    pub density: f64,
}

/// One tree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate {
    /// Position from the quad's south-west corner, m.
    pub position: [f32; 2],
    /// Height of the ground, m.
    pub ground: f64,
    /// Scale of the unscaled tree.
    pub scale: f32,
    /// Rotation counterclockwise seen from above, and tint, as in [`crate::gpu::interface::Seed::turn_tint`].
    pub turn_tint: u32,
    /// Index of the species.
    pub species: u32,
    /// Hash that every random number of the tree comes from.
    pub identity: u32,
}

impl Candidate {
    /// Rotation, rad.
    pub fn turn(&self) -> f64 {
        f64::from(self.turn_tint & 0xffff) * (std::f64::consts::TAU / 65536.0)
    }

    /// Factor of the tree's colours, 0.85 to 1.15.
    pub fn tint(&self) -> f64 {
        1.0 + 0.3 * (f64::from(self.turn_tint >> 16) / 65535.0 - 0.5)
    }
}

impl Layout {
    /// The layout of a scene; `None` where no species has a density.
    pub fn new(scene: &Scene) -> Option<Self> {
        let most = scene.species.iter().map(|s| match &s.distribution {
            Distribution::Density { max_density, .. } => f64::from(*max_density),
            Distribution::Positions(_) => 0.0,
        });
        let density: f64 = most.sum();
        (density > 0.0).then(|| {
            let pattern = Pattern::new(POINTS, scene.seed);
            Layout { tile_side: (pattern.mean_points() / density).sqrt(), pattern, density }
        })
    }

    /// Trees of a quad of `tiles` by `tiles` Wang tiles, in the shader's order; `quad` counts quads east and north from the
    /// terrain's south-west corner.
    pub fn trees(&self, scene: &Scene, quad: [i32; 2], tiles: i32) -> Vec<Candidate> {
        let side = f64::from(tiles) * self.tile_side;
        let (tile_side, full) = (self.tile_side as f32, self.density as f32);
        let mut found = Vec::new();
        let mut densities = vec![0f32; scene.species.len()];
        for k in 0..tiles * tiles {
            let within = [k % tiles, k / tiles];
            let (x, y) = (quad[0] * tiles + within[0], quad[1] * tiles + within[1]);
            for (slot, point) in self.pattern.tiles[tile_kind(scene.seed, x, y)].iter().enumerate() {
                let identity = hash2(scene.seed, hash2(x as u32, hash2(y as u32, slot as u32)));
                let thin = unit(hash(identity ^ HASH_THIN)) * full;
                let position = [0, 1].map(|c| (within[c] as f32 + point[c]) * tile_side);
                let world = [0, 1].map(|c| f64::from(quad[c]) * side + f64::from(position[c]));
                if !(0..2).all(|c| (0.0..=scene.terrain.extent[c]).contains(&world[c])) {
                    continue;
                }
                let mut total = 0.0f32;
                for (d, s) in densities.iter_mut().zip(&scene.species) {
                    *d = local(&s.distribution, &scene.terrain, world[0], world[1]) as f32;
                    total += *d;
                }
                if thin < total {
                    let mut pick = unit(hash(identity ^ HASH_SPECIES)) * total;
                    let mut species = 0;
                    for (k, d) in densities.iter().enumerate() {
                        if *d > 0.0 {
                            species = k as u32;
                        }
                        pick -= d;
                        if pick < 0.0 {
                            break;
                        }
                    }
                    found.push(candidate(scene, species, identity, position, world, None));
                }
            }
        }
        found
    }
}

/// Which of the sixteen tiles lies at a place of the plane, counted in tiles east and north: the colours of its edges come from a hash of
/// the edge.
pub fn tile_kind(seed: u32, x: i32, y: i32) -> usize {
    let colour = |x: i32, y: i32, axis: u32| hash2(seed.wrapping_add(axis), hash2(x as u32, y as u32)) & 1;
    kind_of(x, y, |x, y, axis| colour(x, y, axis) as usize)
}

/// The tile at a place, by the colours (0 or 1) of the edges south (axis 1) and west (axis 2) of each place.
pub fn kind_of(x: i32, y: i32, colour: impl Fn(i32, i32, u32) -> usize) -> usize {
    colour(x, y, 1) | colour(x, y + 1, 1) << 1 | colour(x, y, 2) << 2 | colour(x + 1, y, 2) << 3
}

/// The tree of a species' list; its position is from the terrain's south-west corner.
pub fn listed(scene: &Scene, species: u32, index: u32, tree: &TreePosition) -> Candidate {
    let identity = hash2(scene.seed, hash2(LISTED.wrapping_add(species), index));
    let position = [tree.x as f32, tree.y as f32];
    candidate(scene, species, identity, position, [tree.x, tree.y], Some(tree))
}

fn candidate(
    scene: &Scene,
    species: u32,
    identity: u32,
    position: [f32; 2],
    [x, y]: [f64; 2],
    listed: Option<&TreePosition>,
) -> Candidate {
    let cell = scene.terrain.cell_size;
    let heights = scene.terrain.heights.as_ref();
    let [low, high] = scene.species[species as usize].scale;
    let u = unit(hash(identity ^ HASH_SCALE));
    let degrees = listed.and_then(|t| t.rotation);
    let turn = degrees.map_or_else(
        || hash(identity ^ HASH_TURN) & 0xffff,
        |degrees| ((degrees / 360.0).rem_euclid(1.0) * 65536.0) as u32 & 0xffff,
    );
    Candidate {
        position,
        ground: heights.map_or(0.0, |r| height_and_slope(r, x / cell, y / cell)[0]),
        scale: listed.and_then(|t| t.scale).unwrap_or(low * (1.0 - u) + high * u),
        turn_tint: turn | (hash(identity ^ HASH_TINT) & 0xffff_0000),
        species,
        identity,
    }
}
