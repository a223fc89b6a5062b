//! Triangles with holes, four at a time.

use glam::{Vec3, Vec4};

use super::{Hierarchy, Stack, WIDTH};

/// Four triangles: a corner and two edges each. A triangle that is not there has no edges, and is never hit.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(16))]
struct Pack {
    corner: [Vec4; 3],
    edges: [[Vec4; 3]; 2],
    faces: [u32; 4],
}

/// Where a ray meets a triangle.
#[derive(Clone, Copy, Debug)]
pub struct Met {
    /// Index of the triangle.
    pub face: u32,
    /// Parameter along the ray.
    pub t: f32,
    /// Barycentric coordinates of the second and third corner.
    pub at: [f32; 2],
}

/// A hierarchy over triangles, which may have holes.
#[derive(Clone, Debug)]
pub struct Triangles {
    packs: Vec<Pack>,
    hierarchy: Hierarchy,
}

impl Triangles {
    /// Builds the hierarchy over triangles by their corners.
    pub fn new(corners: &[[Vec3; 3]]) -> Self {
        let boxes: Vec<(Vec3, Vec3)> =
            corners.iter().map(|[a, b, c]| (a.min(*b).min(*c), a.max(*b).max(*c))).collect();
        let mut packs = Vec::new();
        let hierarchy = Hierarchy::new(&boxes, WIDTH, |faces| {
            packs.push(Pack::new(corners, faces));
            packs.len() as u32 - 1
        });
        Triangles { packs, hierarchy }
    }

    /// Smallest and largest corner of all of them.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        (self.hierarchy.low, self.hierarchy.high)
    }

    /// The nearest surface along a ray between 0 and `t_max`; `opaque` tells of a triangle, and the barycentric coordinates of its
    /// second and third corner, whether it is there or has a hole.
    pub fn nearest(
        &self,
        origin: Vec3,
        direction: Vec3,
        t_max: f32,
        stack: &mut Stack,
        opaque: impl Fn(u32, f32, f32) -> bool,
    ) -> Option<Met> {
        let mut met = None;
        self.hierarchy.walk(origin, direction, t_max, stack, |_, pack, mut t_max| {
            let pack = &self.packs[pack as usize];
            if let Some((hit, t, u, v)) = pack.hits(origin, direction, [0.0, t_max]) {
                for lane in (0..WIDTH).filter(|k| hit >> k & 1 != 0) {
                    if t[lane] < t_max && opaque(pack.faces[lane], u[lane], v[lane]) {
                        t_max = t[lane];
                        met = Some(Met { face: pack.faces[lane], t: t_max, at: [u[lane], v[lane]] });
                    }
                }
            }
            t_max
        });
        met
    }

    /// Whether any surface is on a ray beyond `t_min`, at least 0; `opaque` as in [`Triangles::nearest`].
    pub fn occluded(
        &self,
        origin: Vec3,
        direction: Vec3,
        t_min: f32,
        stack: &mut Stack,
        opaque: impl Fn(u32, f32, f32) -> bool,
    ) -> bool {
        let end = self.hierarchy.walk(origin, direction, f32::MAX, stack, |_, pack, t_max| {
            let pack = &self.packs[pack as usize];
            let found = pack.hits(origin, direction, [t_min, t_max]).is_some_and(|(hit, _, u, v)| {
                (0..WIDTH).any(|k| hit >> k & 1 != 0 && opaque(pack.faces[k], u[k], v[k]))
            });
            if found { -1.0 } else { t_max }
        });
        end < 0.0
    }
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

    /// Möller and Trumbore's intersection: which of the four are hit between two parameters, where, and the barycentric
    /// coordinates. Comparisons with NaN, of triangles seen from their edge, are false.
    #[inline]
    #[allow(clippy::type_complexity)]
    fn hits(
        &self,
        o: Vec3,
        d: Vec3,
        [t_min, t_max]: [f32; 2],
    ) -> Option<(u32, [f32; 4], [f32; 4], [f32; 4])> {
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
        let hit = (inside & t.cmpgt(Vec4::splat(t_min)) & t.cmplt(Vec4::splat(t_max))).bitmask();
        (hit != 0).then(|| (hit, t.to_array(), u.to_array(), v.to_array()))
    }
}
