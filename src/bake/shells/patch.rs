//! Sixteen patches of forest, one a Wang tile of the scene's own point pattern.
//!
//! **What is the same as in the scene.** Where a tile lies in the plane comes from the same hash of its edges as for the scene's seeds, and
//! its points are the same, so at full density a tree of a shell stands where a tree of the scene stands. Which tree it is is not the
//! same: a seed draws its species, scale, rotation and tint, and the density from which on it stands, from a hash of its tile's place in
//! the whole plane, and a patch knows only its own colours. Species come at their shares of the full density. So where a shell takes over
//! from single trees, crowns stay in place and change their size and kind; in forest that is thinned to a share q, of the trees that were
//! there q stay, and others stand up where none was.
//!
//! **Edges.** A tree belongs to the corner, to an edge of a colour, or to the inside of one tile (`src/land/pattern.rs`), and its identity is
//! a hash of that and of its number there. A tile shows all trees of its corners and edges, whichever side they stand on, so their crowns go
//! on in the next tile whichever it is. What a neighbour's inside puts over an edge cannot be known: colours say nothing of it. The part of
//! such a crown that is beyond its own tile (also of an edge's tree beyond the edge's ends) is *folded back*: the tree's mirror image in the
//! edge is drawn, of which the tile shows what the neighbour is denied. On either side of an edge as much comes back as is missed, so
//! the mean cover at any distance from an edge is what it would be; the crown itself ends at the edge.

use std::f64::consts::TAU;

use glam::{Vec2, Vec3};

use crate::bake::grove::Tree;
use crate::land::candidate::{HASH_SCALE, HASH_SPECIES, HASH_THIN, HASH_TINT, HASH_TURN, Layout};
use crate::land::pattern::{PATCH, TILES};
use crate::physics::hash::{hash, hash2, unit};
use crate::scene::{Distribution, Scene};
use crate::{Error, Result};

/// Purpose of the identities of a shell's trees.
const SHELL: u32 = 0x1b56_c4e9;

/// A tree as a tile shows it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Image {
    /// The tree; its base is in metres from the tile's south-west corner.
    pub tree: Tree,
    /// −1 along an axis that it is mirrored in, else 1: a point p about the base of the tree's own stands at base + flip · p.
    pub flip: Vec2,
    /// Share of the full density from which on it stands, in [0, 1).
    pub activation: f32,
}

/// The patches.
#[derive(Clone, Debug)]
pub struct Patch {
    /// Side of a tile, m.
    pub side: f64,
    /// What each tile shows: first the trees that stand in it.
    pub tiles: Vec<Vec<Image>>,
    /// How many stand in each tile.
    pub standing: Vec<usize>,
}

/// Where a point of a tile belongs.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Home {
    Corner,
    /// South, north, west, east.
    Edge(usize),
    Inside,
}

/// A point, in tile sides, with the hash that its tree is drawn from.
#[derive(Clone, Copy, Debug)]
struct Plant {
    at: [f64; 2],
    identity: u32,
    home: Home,
}

impl Plant {
    fn moved(self, [x, y]: [f64; 2]) -> Self {
        Plant { at: [self.at[0] + x, self.at[1] + y], ..self }
    }
}

impl Patch {
    /// The patches of a scene, whose species reach so many metres from their trunks at scale 1.
    ///
    /// # Errors
    /// [`Error::Usage`] where no species has a density, or crowns are wider than half a tile.
    pub fn new(scene: &Scene, reaches: &[f32]) -> Result<Self> {
        let Some(layout) = Layout::new(scene) else {
            return Err(Error::Usage(
                "shells are made of species with a density, and this scene only lists its trees".into(),
            ));
        };
        let widest = scene.species.iter().zip(reaches).map(|(s, reach)| f64::from(s.scale[1] * reach));
        let widest = widest.fold(0.0, f64::max);
        if widest > 0.5 * layout.tile_side {
            return Err(Error::Usage(format!(
                "crowns that reach {widest:.1} m do not fit into a tile of {:.1} m: shells need a lower density",
                layout.tile_side
            )));
        }
        let homes = Homes::new(scene.seed, &layout);
        let (mut tiles, mut standing) = (Vec::new(), Vec::new());
        for kind in 0..TILES {
            let (own, others) = homes.of_tile(kind);
            standing.push(own.len());
            let mut images: Vec<Image> =
                own.iter().map(|p| image(scene, &layout, *p, [false; 2], p.at)).collect();
            for plant in own.iter().chain(&others) {
                images.extend(folds(plant).filter_map(|(flips, at)| {
                    let image = image(scene, &layout, *plant, flips, at);
                    let reach = image.tree.scale * reaches[image.tree.species as usize];
                    let own = at == plant.at && (0..2).all(|k| (0.0..1.0).contains(&at[k]));
                    (!own && overlaps(image.tree.base.truncate(), reach, layout.tile_side as f32))
                        .then_some(image)
                }));
            }
            tiles.push(images);
        }
        Ok(Patch { side: layout.tile_side, tiles, standing })
    }

    /// The trees that stand in a tile.
    pub fn trees(&self, kind: usize) -> &[Image] {
        &self.tiles[kind][..self.standing[kind]]
    }
}

/// The pattern's points by where they belong.
struct Homes<'a> {
    layout: &'a Layout,
    seed: u32,
    /// Of the four quarters around a corner, as they lie in the tile's south-west, south-east, north-west and north-east.
    corners: Vec<Plant>,
    /// By edge of a tile and colour, the points on the tile's side.
    edges: [[Vec<Plant>; 2]; 4],
}

impl<'a> Homes<'a> {
    fn new(seed: u32, layout: &'a Layout) -> Self {
        let mut homes = Homes { layout, seed, corners: Vec::new(), edges: Default::default() };
        homes.corners = homes.listed(0, Home::Corner, 0);
        for edge in 0..4 {
            for colour in 0..2 {
                // Any tile with that edge will do.
                let code = 1 + 2 * edge as u32 + colour as u32;
                homes.edges[edge][colour] = homes.listed(colour << edge, Home::Edge(edge), code);
            }
        }
        homes
    }

    /// Points of a tile that belong somewhere, numbered in their order.
    fn listed(&self, kind: usize, home: Home, code: u32) -> Vec<Plant> {
        let key = hash2(self.seed ^ SHELL, code);
        let points = self.layout.pattern.tiles[kind].iter().map(|p| p.map(f64::from));
        let here = points.filter(|p| home_of(*p, self.layout.pattern.distance) == home);
        (0..).zip(here).map(|(k, at)| Plant { at, identity: hash2(key, k), home }).collect()
    }

    /// Trees that stand in a tile, and those of its edges and corners that stand around it.
    fn of_tile(&self, kind: usize) -> (Vec<Plant>, Vec<Plant>) {
        let colour = |edge: usize| kind >> edge & 1;
        let mut own = self.corners.clone();
        let mut others = Vec::new();
        for edge in 0..4 {
            own.extend(&self.edges[edge][colour(edge)]);
            // The next tile has this edge on its other side.
            let step = [[0.0, -1.0], [0.0, 1.0], [-1.0, 0.0], [1.0, 0.0]][edge];
            others.extend(self.edges[edge ^ 1][colour(edge)].iter().map(|p| p.moved(step)));
        }
        own.extend(self.listed(kind, Home::Inside, 16 + kind as u32));
        for (x, y) in (-1..=1).flat_map(|y| (-1..=1).map(move |x| (x, y))).filter(|c| *c != (0, 0)) {
            let moved = self.corners.iter().map(|p| p.moved([f64::from(x), f64::from(y)]));
            // Around one of this tile's own four corners.
            others.extend(moved.filter(|p| p.at.iter().all(|v| v.abs() < 0.5 || (v - 1.0).abs() < 0.5)));
        }
        (own, others)
    }
}

/// Where a point of a tile belongs, with points at least so many tile sides apart.
fn home_of([x, y]: [f64; 2], distance: f64) -> Home {
    let patch = PATCH * distance;
    let near = |v: f64| v < patch || v > 1.0 - patch;
    if near(x) && near(y) {
        return Home::Corner;
    }
    let edge = [y, 1.0 - y, x, 1.0 - x].iter().position(|d| *d < distance);
    edge.map_or(Home::Inside, Home::Edge)
}

/// A plant and its mirror images in the edges behind which no other tile shows it: which axes are mirrored, and where it then stands.
fn folds(plant: &Plant) -> impl Iterator<Item = ([bool; 2], [f64; 2])> {
    let folded = match plant.home {
        Home::Corner => [false, false],
        // Both sides of an edge show its trees; beyond its ends no one does.
        Home::Edge(edge) => [edge < 2, edge >= 2],
        Home::Inside => [true, true],
    };
    let along = |k: usize| {
        let v = plant.at[k];
        [(false, v), (true, -v), (true, 2.0 - v)].into_iter().filter(move |(flip, _)| folded[k] || !flip)
    };
    let ys: Vec<(bool, f64)> = along(1).collect();
    along(0).flat_map(move |x| ys.clone().into_iter().map(move |y| ([x.0, y.0], [x.1, y.1])))
}

/// Whether a disc reaches into the tile.
fn overlaps(at: Vec2, reach: f32, side: f32) -> bool {
    at.distance(at.clamp(Vec2::ZERO, Vec2::splat(side))) < reach
}

/// The tree of a plant, in metres.
fn image(scene: &Scene, layout: &Layout, plant: Plant, flips: [bool; 2], at: [f64; 2]) -> Image {
    let id = plant.identity;
    let species = species(scene, layout.density, unit(hash(id ^ HASH_SPECIES)));
    let [low, high] = scene.species[species].scale;
    let u = unit(hash(id ^ HASH_SCALE));
    let turn = f64::from(hash(id ^ HASH_TURN) & 0xffff) * (TAU / 65536.0);
    let tint = f64::from(hash(id ^ HASH_TINT) >> 16) / 65535.0;
    let [x, y] = at.map(|v| (v * layout.tile_side) as f32);
    Image {
        tree: Tree {
            base: Vec3::new(x, y, 0.0),
            scale: low * (1.0 - u) + high * u,
            turn: [turn.cos() as f32, turn.sin() as f32],
            tint: (1.0 + 0.3 * (tint - 0.5)) as f32,
            species: species as u32,
        },
        flip: Vec2::from_array(flips.map(|f| if f { -1.0 } else { 1.0 })),
        activation: unit(hash(id ^ HASH_THIN)),
    }
}

/// Species by their shares of the full density.
fn species(scene: &Scene, full: f64, u: f32) -> usize {
    let (mut pick, mut species) = (f64::from(u) * full, 0);
    for (k, s) in scene.species.iter().enumerate() {
        let Distribution::Density { max_density, .. } = s.distribution else { continue };
        if max_density > 0.0 {
            species = k;
        }
        pick -= f64::from(max_density);
        if pick < 0.0 {
            break;
        }
    }
    species
}
