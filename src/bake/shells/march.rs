//! Rays through the slices of shells over flat ground, tiled by the pattern's rule.
//!
//! A slice is a plane at the middle of its slab, and shows one cover wherever a ray meets it. Three ways through a stack:
//! - [`March::Level`]: each slice once, whatever the angle: a low ray goes through 1/cos θ times as much of a slab as one from the zenith, and is
//!   hidden no more.
//! - [`March::Long`]: a slice hides 1 − (1 − α)^(1/cos θ), as a slab of even stuff would over the longer way.
//! - [`March::Slanted`]: BCF05's: each triangle of a slice is turned about its middle m towards the viewer, its corners x raised by v·(m − x)/|v|
//!   (f = 1). A low ray then meets a slice more than once, 1 + sin θ tan θ times in the mean.

use glam::{DVec2, DVec3};

use super::Shells;
use super::slices::SHARES;
use crate::land::candidate::tile_kind;

/// Ways through a stack.
pub const MARCHES: usize = 3;
/// Quads a side of a tile whose two triangles are slanted: of a few metres, as the slices of a renderer would be.
const QUADS: f64 = 32.0;

/// A way through a stack.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum March {
    /// Level slices, each as opaque as from above.
    Level,
    /// Level slices, more opaque the lower the ray.
    Long,
    /// Triangles slanted towards the viewer.
    Slanted,
}

impl March {
    /// All of them.
    pub const ALL: [March; MARCHES] = [March::Level, March::Long, March::Slanted];

    /// The name in tables.
    pub fn name(self) -> &'static str {
        ["level", "long", "slanted"][self as usize]
    }

    /// Share of a ray that a slice of these covers lets through, at a share of the full density and a cosine of the zenith angle.
    pub fn long(cover: [f64; SHARES], share: f64, cos: f64) -> f64 {
        // Weights of texels may add up to more than 1 by rounding.
        (1.0 - at_share(cover, share)).max(0.0).powf(1.0 / cos)
    }
}

/// One mip of one level of shells, laid over the plane.
pub struct Stack<'a> {
    cover: &'a [u8],
    /// Texels a side of a tile, and a tile's side, m.
    texels: i32,
    side: f64,
    slices: u32,
    height: f64,
    seed: u32,
}

impl<'a> Stack<'a> {
    /// The shells of a scene of this seed.
    pub fn new(shells: &'a Shells, seed: u32, level: usize, mip: usize) -> Self {
        let image = &shells.levels[level][mip];
        Stack {
            cover: &image.cover,
            texels: image.side as i32,
            side: shells.tile_side,
            slices: shells.settings.slices >> level,
            height: f64::from(shells.height),
            seed,
        }
    }

    /// Share of a ray that a stack lets through, by density (a share of the full one) and way; the ray starts on the ground and goes towards
    /// the viewer, a unit vector.
    pub fn passes<const N: usize>(
        &self,
        ground: DVec2,
        toward: DVec3,
        shares: &[f64; N],
    ) -> [[f64; MARCHES]; N] {
        let mut passes = [[1.0; MARCHES]; N];
        for cover in self.level(ground, toward) {
            for (p, share) in passes.iter_mut().zip(shares) {
                p[March::Level as usize] *= 1.0 - at_share(cover, *share);
                p[March::Long as usize] *= March::long(cover, *share, toward.z);
            }
        }
        self.slanted(ground, toward, |cover| {
            for (p, share) in passes.iter_mut().zip(shares) {
                p[March::Slanted as usize] *= 1.0 - at_share(cover, *share);
            }
        });
        passes
    }

    /// Covers where a ray meets level slices, from the ground up.
    pub fn level(&self, ground: DVec2, toward: DVec3) -> Vec<[f64; SHARES]> {
        let at = |slice| ground + toward.truncate() * (self.height_of(slice) / toward.z);
        (0..self.slices).map(|slice| self.cover(slice, at(slice))).collect()
    }

    /// Where a ray meets a level slice: the index of the texel, among those of a mip that is so many times coarser.
    pub fn texel_at(&self, slice: u32, ground: DVec2, toward: DVec3, coarser: u32) -> usize {
        let at = ground + toward.truncate() * (self.height_of(slice) / toward.z);
        let n = self.texels / coarser as i32;
        let place = (at * (f64::from(n) / self.side)).floor();
        self.index(slice, n, [place.x as i32, place.y as i32])
    }

    fn height_of(&self, slice: u32) -> f64 {
        (f64::from(slice) + 0.5) / f64::from(self.slices) * self.height
    }

    /// Covers where a ray meets slanted triangles.
    fn slanted(&self, ground: DVec2, toward: DVec3, mut meets: impl FnMut([f64; SHARES])) {
        let quad = self.side / QUADS;
        let along = toward.truncate();
        // No corner is raised by more than the quad's diagonal.
        let end = (self.height + 2.0 * quad) / toward.z;
        let mut from = 0.0;
        while from < end {
            let at = ((ground + along * (from + 1e-9 * end)) / quad).floor();
            // Where the ray leaves the quad's column.
            let leaves = |k: usize| match along[k] {
                d if d > 0.0 => ((at[k] + 1.0) * quad - ground[k]) / d,
                d if d < 0.0 => (at[k] * quad - ground[k]) / d,
                _ => f64::INFINITY,
            };
            let to = leaves(0).min(leaves(1)).max(from + 1e-9 * end);
            for upper in [false, true] {
                let third = if upper { 2.0 / 3.0 } else { 1.0 / 3.0 };
                let middle = (at + third) * quad;
                for slice in 0..self.slices {
                    // v·(m − x) raises x, so on the triangle z = height − along·(x − m).
                    let t = (self.height_of(slice) - along.dot(ground - middle))
                        / (toward.z + along.length_squared());
                    let x = ground + along * t;
                    let within = x / quad - at;
                    if (from..to.min(end)).contains(&t) && (within.x + within.y > 1.0) == upper {
                        meets(self.cover(slice, x));
                    }
                }
            }
            from = to;
        }
    }

    /// Cover at a place, m, at each of the [`SHARES`]: linear between the middles of texels, those of the next tile behind an edge.
    pub fn cover(&self, slice: u32, at: DVec2) -> [f64; SHARES] {
        let place = at * (f64::from(self.texels) / self.side) - 0.5;
        let first = place.floor();
        let part = place - first;
        let [x, y] = [first.x as i32, first.y as i32];
        let mut cover = [0.0; SHARES];
        for (dx, dy, weight) in [
            (0, 0, (1.0 - part.x) * (1.0 - part.y)),
            (1, 0, part.x * (1.0 - part.y)),
            (0, 1, (1.0 - part.x) * part.y),
            (1, 1, part.x * part.y),
        ] {
            let texel = self.texel(slice, x + dx, y + dy);
            cover.iter_mut().zip(texel).for_each(|(c, t)| *c += weight * f64::from(t) / 255.0);
        }
        cover
    }

    /// A texel, counted east and north from the corner of tile 0, 0.
    fn texel(&self, slice: u32, x: i32, y: i32) -> [u8; SHARES] {
        let k = self.index(slice, self.texels, [x, y]);
        std::array::from_fn(|c| self.cover[SHARES * k + c])
    }

    /// Index of a texel where a tile has n a side, counted east and north from the corner of tile 0, 0.
    fn index(&self, slice: u32, n: i32, [x, y]: [i32; 2]) -> usize {
        let kind = tile_kind(self.seed, x.div_euclid(n), y.div_euclid(n)) as u32;
        let [column, row, n] = [x.rem_euclid(n), y.rem_euclid(n), n].map(|v| v as usize);
        ((kind * self.slices + slice) as usize * n + row) * n + column
    }
}

/// Cover at a share of the full density, from those at the shares that are kept and none at 0: linear between them, as if a tree between
/// two of them appeared little by little.
pub fn at_share(cover: [f64; SHARES], share: f64) -> f64 {
    let place = (share * SHARES as f64).clamp(0.0, SHARES as f64);
    let below = (place as usize).min(SHARES - 1);
    let low = if below > 0 { cover[below - 1] } else { 0.0 };
    low + (place - below as f64) * (cover[below] - low)
}
