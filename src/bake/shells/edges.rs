//! Cover from straight above by distance from the edges of tiles, against rays cast at the same trees: whether what becomes of crowns that reach
//! over an edge leaves as much cover there as meshes have. Of the stack as one slice, which from above is a picture of what is hidden: layers and
//! filters add nothing to its mean.

use glam::{DVec2, DVec3, Vec3};
use rayon::prelude::*;

use super::march::{March, Stack};
use super::verify::{Truth, mean};
use super::{Forest, Shells};
use crate::Result;
use crate::land::candidate::tile_kind;
use crate::land::pattern::TILES;
use crate::physics::hash::Stream;
use crate::rays;
use crate::scene::Scene;

/// Tiles a side of the ground that is looked at: enough that most tiles have had most neighbours.
const BLOCK: i32 = 24;
/// Distances from the nearest edge up to which cover is told apart, in tile sides.
const DISTANCES: [f64; 4] = [1.0 / 32.0, 1.0 / 16.0, 1.0 / 8.0, 0.5];

/// Shares of the full density that are looked at: where trees are few, those that are missing show.
const SHARES: [f64; 2] = [0.5, 0.25];

/// Cover at some distance from the edges of tiles.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Near {
    /// Share of the full density.
    pub share: f64,
    /// Distances, m.
    pub distance: [f64; 2],
    /// Share of the ground that meshes hide, no crown of which ends at an edge.
    pub truth: f64,
    /// What the stack merged to one slice hides, less that.
    pub difference: f64,
    /// Standard error of the difference, from the spread of the four sides of sixteen tiles.
    pub error: f64,
}

/// A point of the ground.
struct Point {
    /// Tile and nearest edge, of 64.
    side: usize,
    /// From the nearest edge, in tile sides.
    distance: f64,
    /// 1 where meshes hide it, by density.
    hidden: [f64; 2],
    /// What the slice hides, by density.
    cover: [f64; 2],
}

/// Looks at so many points of the ground.
///
/// # Errors
/// Those of [`Forest::new`].
pub fn edges(scene: &Scene, shells: &Shells, forest: &Forest, points: u32) -> Result<Vec<Near>> {
    let truth = Truth::new(scene, forest, -1..BLOCK + 1, SHARES)?;
    let one = Stack::new(shells, scene.seed, shells.levels.len() - 1, 0);
    let seen: Vec<Point> = (0..points)
        .into_par_iter()
        .map_init(rays::Stack::new, |open, k| {
            let mut stream = Stream::new(k);
            let place = DVec2::new(stream.unit(), stream.unit()) * f64::from(BLOCK);
            let ground = place * shells.tile_side;
            let tile = place.floor();
            let within = place - tile;
            let to_edges = [within.y, 1.0 - within.y, within.x, 1.0 - within.x];
            let nearest = (0..4).min_by(|a, b| to_edges[*a].total_cmp(&to_edges[*b])).unwrap_or(0);
            let kind = tile_kind(scene.seed, tile.x as i32, tile.y as i32);
            Point {
                side: 4 * kind + nearest,
                distance: to_edges[nearest],
                hidden: truth.hidden(ground, Vec3::Z, open),
                cover: one.passes(ground, DVec3::Z, &SHARES).map(|p| 1.0 - p[March::Level as usize]),
            }
        })
        .collect();
    Ok(near(&seen, shells.tile_side))
}

/// By distance from edges.
fn near(seen: &[Point], tile_side: f64) -> Vec<Near> {
    let mut found = Vec::new();
    for (d, share) in SHARES.into_iter().enumerate() {
        let mut from = 0.0;
        for to in DISTANCES {
            let here = || seen.iter().filter(move |p| (from..to).contains(&p.distance));
            // The same crowns end at an edge wherever a tile lies: chance is in the tiles, not in the points.
            let sides = (0..4 * TILES).filter_map(|side| {
                let of = here().filter(|p| p.side == side).map(|p| p.cover[d] - p.hidden[d]);
                (of.clone().count() > 0).then(|| mean(of).0)
            });
            let (difference, error) = mean(sides.collect::<Vec<_>>().into_iter());
            let truth = mean(here().map(|p| p.hidden[d])).0;
            let distance = [from * tile_side, to * tile_side];
            found.push(Near { share, distance, truth, difference, error });
            from = to;
        }
    }
    found
}
