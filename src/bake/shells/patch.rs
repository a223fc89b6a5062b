//! Sixteen patches of forest, one a Wang tile of the scene's own point pattern.
//!
//! **What is the same as in the scene.** Where a tile lies in the plane comes from the same hash of its edges as for the scene's seeds, and
//! its points are the same, so at full density a tree of a shell stands where a tree of the scene stands. Which tree it is is not the
//! same: a seed draws its species, scale, rotation and tint, and the density from which on it stands, from a hash of its tile's place in
//! the whole plane, and a patch knows only its own colours. Species come at their shares of the full density. So where a shell takes over
//! from single trees, crowns stay in place and change their size and kind; in forest that is thinned to a share q, of the trees that were
//! there q stay, and others stand up where none was.
//!
//! **Edges.** A tree belongs to a corner, to an edge of a colour, or to the inside of one tile (`src/land/pattern.rs`), and its identity is a hash of
//! that and of its number there. Each tile is painted amid eight neighbours that fit, and shows what their crowns put over its edges. Trees of corners
//! and edges, up to a minimal distance of the pattern to either side, are the same whichever neighbours these are, so such crowns go on
//! in the next tile. Crowns from farther inside that still reach over an edge end there, unless the neighbour happens to be the one that was painted
//! with: colours say nothing of its inside. But in their place stand those of a neighbour that might have been, which are as many, so the mean cover
//! at any distance from an edge is that of the forest.

use std::f64::consts::TAU;

use glam::{Vec2, Vec3};

use crate::bake::grove::Tree;
use crate::land::candidate::{HASH_SCALE, HASH_SPECIES, HASH_THIN, HASH_TINT, HASH_TURN, Layout, kind_of};
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
    /// Share of the full density from which on it stands, in [0, 1).
    pub activation: f32,
}

impl Image {
    /// The same tree, so many metres away.
    pub fn moved(self, by: Vec3) -> Self {
        Image { tree: Tree { base: self.tree.base + by, ..self.tree }, ..self }
    }
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
    /// The other trees of the eight neighbours that a tile is painted amid: they show nothing in it, and shade it.
    pub around: Vec<Vec<Image>>,
}

/// Where a point of a tile belongs.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Home {
    Corner,
    /// South, north, west, east.
    Edge(usize),
    Inside,
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
        let standing: Vec<Vec<Image>> = (0..TILES).map(|kind| plant(scene, &layout, kind)).collect();
        let side = layout.tile_side as f32;
        let reaches_in = |i: &Image| {
            let base = i.tree.base.truncate();
            let reach = i.tree.scale * reaches[i.tree.species as usize];
            base.distance(base.clamp(Vec2::ZERO, Vec2::splat(side))) < reach
        };
        let tiles = (0..TILES).map(|kind| {
            let moved = neighbours(scene.seed, kind)
                .into_iter()
                .flat_map(|(step, neighbour)| standing[neighbour].iter().map(move |i| i.moved(step * side)));
            let (shown, around): (Vec<Image>, Vec<Image>) = moved.partition(reaches_in);
            ([&standing[kind][..], &shown].concat(), around)
        });
        let (tiles, around) = tiles.unzip();
        Ok(Patch { side: layout.tile_side, tiles, around, standing: standing.iter().map(Vec::len).collect() })
    }

    /// The trees that stand in a tile.
    pub fn trees(&self, kind: usize) -> &[Image] {
        &self.tiles[kind][..self.standing[kind]]
    }
}

/// The trees that stand in a tile.
fn plant(scene: &Scene, layout: &Layout, kind: usize) -> Vec<Image> {
    // How many trees there were of each home so far.
    let mut counts = [0; 6];
    let points = layout.pattern.tiles[kind].iter();
    let tree = |point: &[f32; 2]| {
        let home = home_of(point.map(f64::from), layout.pattern.distance);
        let (place, code) = match home {
            Home::Corner => (0, 0),
            Home::Edge(edge) => (1 + edge, 1 + 2 * edge as u32 + (kind >> edge & 1) as u32),
            Home::Inside => (5, 16 + kind as u32),
        };
        // Tiles that share an edge or a corner have its points in one order.
        let identity = hash2(hash2(scene.seed ^ SHELL, code), counts[place]);
        counts[place] += 1;
        image(scene, layout, identity, *point)
    };
    points.map(tree).collect()
}

/// Eight tiles that fit around one, and steps to them in tile sides. Edges that are not the tile's own have colours by chance.
fn neighbours(seed: u32, kind: usize) -> Vec<(Vec3, usize)> {
    // South, north, west and east of the tile at 0, 0, as `tile_kind` numbers edges: by the tile north or east of them.
    let own = [(0, 0, 1), (0, 1, 1), (0, 0, 2), (1, 0, 2)];
    let colour = |x: i32, y: i32, axis: u32| match own.iter().position(|e| *e == (x, y, axis)) {
        Some(edge) => kind >> edge & 1,
        None => {
            (hash2(hash2(seed ^ SHELL, kind as u32), hash2(axis, hash2(x as u32, y as u32))) & 1) as usize
        }
    };
    let around = (-1..=1).flat_map(|y| (-1..=1).map(move |x| (x, y))).filter(|step| *step != (0, 0));
    around.map(|(x, y)| (Vec3::new(x as f32, y as f32, 0.0), kind_of(x, y, colour))).collect()
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

/// The tree of a point, in metres.
fn image(scene: &Scene, layout: &Layout, id: u32, at: [f32; 2]) -> Image {
    let species = species(scene, layout.density, unit(hash(id ^ HASH_SPECIES)));
    let [low, high] = scene.species[species].scale;
    let u = unit(hash(id ^ HASH_SCALE));
    let turn = f64::from(hash(id ^ HASH_TURN) & 0xffff) * (TAU / 65536.0);
    let tint = f64::from(hash(id ^ HASH_TINT) >> 16) / 65535.0;
    let [x, y] = at.map(|v| (f64::from(v) * layout.tile_side) as f32);
    Image {
        tree: Tree {
            base: Vec3::new(x, y, 0.0),
            scale: low * (1.0 - u) + high * u,
            turn: [turn.cos() as f32, turn.sin() as f32],
            tint: (1.0 + 0.3 * (tint - 0.5)) as f32,
            species: species as u32,
        },
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
