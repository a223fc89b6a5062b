//! The surface of one species as rays meet it: triangles four at a time, through the leaf masks.

use std::collections::HashSet;

use glam::{Vec2, Vec3, Vec4};

use super::hierarchy::{Hierarchy, Stack};
use crate::Result;
use crate::bake::optics::{Colours, colours};
use crate::bake::surface::{Face, Surface};
use crate::scene::Species;

/// Four triangles: a corner and two edges each. A triangle that is not there has no edges, and is never hit.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(16))]
struct Pack {
    corner: [Vec4; 3],
    edges: [[Vec4; 3]; 2],
    faces: [u32; 4],
}

/// A species: its mesh in a hierarchy, and its reflectances.
#[derive(Clone, Debug)]
pub struct Foliage {
    surface: Surface,
    /// Unit normals of the faces.
    normals: Vec<Vec3>,
    /// Whether each material is leaves.
    leaves: Vec<bool>,
    packs: Vec<Pack>,
    hierarchy: Hierarchy,
    /// Reflectances, as the renderer has them.
    pub colours: Colours,
    /// Convex hull of the mesh as seen from above, m.
    hull: Vec<Vec2>,
}

/// Where a ray meets a tree, in the tree's own metres.
#[derive(Clone, Copy, Debug)]
pub struct Met {
    /// Index of the face.
    pub face: u32,
    /// Parameter along the ray.
    pub t: f32,
    /// Barycentric coordinates of the second and third corner.
    pub at: [f32; 2],
}

impl Foliage {
    /// Builds the hierarchy of a species' mesh.
    ///
    /// # Errors
    /// [`crate::Error::Usage`] for a mesh without extent.
    pub fn new(species: &Species) -> Result<Self> {
        let mesh = &species.mesh;
        let mut surface = Surface::new(mesh)?;
        let colours = colours(mesh, &surface, &species.optics);
        // A card modelled as two triangles, one for each side, is one leaf.
        let mut seen = HashSet::new();
        surface.faces.retain(|f| {
            let mut key = f.p.map(|p| p.to_array().map(f32::to_bits));
            key.sort_unstable();
            !mesh.materials[f.material as usize].foliage || seen.insert(key)
        });
        let corners: Vec<[Vec3; 3]> =
            surface.faces.iter().map(|f| f.p.map(|p| surface.frame.to_metres(p))).collect();
        let boxes: Vec<(Vec3, Vec3)> =
            corners.iter().map(|[a, b, c]| (a.min(*b).min(*c), a.max(*b).max(*c))).collect();
        let mut packs = Vec::new();
        let hierarchy = Hierarchy::new(&boxes, 4, |faces| {
            packs.push(Pack::new(&corners, faces));
            packs.len() as u32 - 1
        });
        Ok(Foliage {
            normals: corners.iter().map(|[a, b, c]| (*b - *a).cross(*c - *a).normalize_or(Vec3::Z)).collect(),
            leaves: mesh.materials.iter().map(|m| m.foliage).collect(),
            surface,
            packs,
            hierarchy,
            colours,
            hull: hull(corners.iter().flatten().map(|p| p.truncate()).collect()),
        })
    }

    /// Farthest coordinate of the mesh from the trunk's base, m.
    pub fn reach(&self) -> f32 {
        self.hierarchy.low.abs().max(self.hierarchy.high.abs()).max_element()
    }

    /// Number of triangles.
    pub fn triangles(&self) -> usize {
        self.normals.len()
    }

    /// Bounds of the tree turned counterclockwise by an angle of this cosine and sine.
    pub fn bounds(&self, [c, s]: [f32; 2]) -> (Vec3, Vec3) {
        let (mut low, mut high) = (Vec2::INFINITY, Vec2::NEG_INFINITY);
        for p in &self.hull {
            let turned = Vec2::new(c * p.x - s * p.y, s * p.x + c * p.y);
            (low, high) = (low.min(turned), high.max(turned));
        }
        (low.extend(self.hierarchy.low.z), high.extend(self.hierarchy.high.z))
    }

    /// The nearest surface along a ray between 0 and `t_max`.
    pub fn nearest(&self, origin: Vec3, direction: Vec3, t_max: f32, stack: &mut Stack) -> Option<Met> {
        let mut met = None;
        self.hierarchy.walk(origin, direction, t_max, stack, |_, pack, mut t_max| {
            let pack = &self.packs[pack as usize];
            if let Some((hit, t, u, v)) = pack.hits(origin, direction, t_max) {
                for lane in (0..4).filter(|k| hit >> k & 1 != 0) {
                    if t[lane] < t_max && self.opaque(pack.faces[lane], u[lane], v[lane]) {
                        t_max = t[lane];
                        met = Some(Met { face: pack.faces[lane], t: t_max, at: [u[lane], v[lane]] });
                    }
                }
            }
            t_max
        });
        met
    }

    /// Whether any surface is on a ray beyond 0.
    pub fn occludes(&self, origin: Vec3, direction: Vec3, stack: &mut Stack) -> bool {
        let end = self.hierarchy.walk(origin, direction, f32::MAX, stack, |_, pack, t_max| {
            let pack = &self.packs[pack as usize];
            let found = pack.hits(origin, direction, t_max).is_some_and(|(hit, _, u, v)| {
                (0..4).any(|k| hit >> k & 1 != 0 && self.opaque(pack.faces[k], u[k], v[k]))
            });
            if found { -1.0 } else { t_max }
        });
        end < 0.0
    }

    /// Unit normal of a face.
    pub fn normal(&self, face: u32) -> Vec3 {
        self.normals[face as usize]
    }

    /// Whether a face is a leaf, and not bark.
    pub fn is_leaf(&self, face: u32) -> bool {
        self.leaves[self.surface.faces[face as usize].material as usize]
    }

    /// The point of a face with these barycentric coordinates, m.
    pub fn point(&self, met: &Met) -> Vec3 {
        let [a, b, c] = self.surface.faces[met.face as usize].p.map(|p| self.surface.frame.to_metres(p));
        a + (b - a) * met.at[0] + (c - a) * met.at[1]
    }

    fn opaque(&self, face: u32, u: f32, v: f32) -> bool {
        let f: &Face = &self.surface.faces[face as usize];
        f.mask.is_none() || self.surface.opaque(f, f.uv[0] * (1.0 - u - v) + f.uv[1] * u + f.uv[2] * v)
    }
}

/// Convex hull by Andrew's monotone chains.
fn hull(mut points: Vec<Vec2>) -> Vec<Vec2> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup();
    let chain = |points: &mut dyn Iterator<Item = &Vec2>| {
        let mut chain: Vec<Vec2> = Vec::new();
        for p in points {
            while let [.., a, b] = chain[..]
                && (b - a).perp_dot(*p - a) <= 0.0
            {
                chain.pop();
            }
            chain.push(*p);
        }
        chain
    };
    let mut all = chain(&mut points.iter());
    all.extend(chain(&mut points.iter().rev()));
    all
}

impl Pack {
    fn new(corners: &[[Vec3; 3]], faces: &[u32]) -> Self {
        let lanes = |f: &dyn Fn(&[Vec3; 3]) -> f32| {
            Vec4::from_array(std::array::from_fn(|k| faces.get(k).map_or(0.0, |i| f(&corners[*i as usize]))))
        };
        Pack {
            corner: [0, 1, 2].map(|k| lanes(&|c| c[0][k])),
            edges: [1, 2].map(|e| [0, 1, 2].map(|k| lanes(&|c| c[e][k] - c[0][k]))),
            faces: std::array::from_fn(|k| faces.get(k).copied().unwrap_or(0)),
        }
    }

    /// Möller and Trumbore's intersection: which of the four are hit between 0 and `t_max`, where, and the barycentric
    /// coordinates. Comparisons with NaN, of triangles seen from their edge, are false.
    #[inline]
    #[allow(clippy::type_complexity)]
    fn hits(&self, o: Vec3, d: Vec3, t_max: f32) -> Option<(u32, [f32; 4], [f32; 4], [f32; 4])> {
        let (dx, dy, dz) = (Vec4::splat(d.x), Vec4::splat(d.y), Vec4::splat(d.z));
        let [[ax, ay, az], [bx, by, bz]] = self.edges;
        let (px, py, pz) = (dy * bz - dz * by, dz * bx - dx * bz, dx * by - dy * bx);
        let inverse = (ax * px + ay * py + az * pz).recip();
        let [cx, cy, cz] = self.corner;
        let (sx, sy, sz) = (Vec4::splat(o.x) - cx, Vec4::splat(o.y) - cy, Vec4::splat(o.z) - cz);
        let u = (sx * px + sy * py + sz * pz) * inverse;
        let (qx, qy, qz) = (sy * az - sz * ay, sz * ax - sx * az, sx * ay - sy * ax);
        let v = (dx * qx + dy * qy + dz * qz) * inverse;
        let t = (bx * qx + by * qy + bz * qz) * inverse;
        let inside = u.cmpge(Vec4::ZERO) & v.cmpge(Vec4::ZERO) & (u + v).cmple(Vec4::ONE);
        let hit = (inside & t.cmpgt(Vec4::ZERO) & t.cmplt(Vec4::splat(t_max))).bitmask();
        (hit != 0).then(|| (hit, t.to_array(), u.to_array(), v.to_array()))
    }
}
