//! A species' mesh as the bake sees it: triangles in the scaled tree's space, and leaf masks.

use glam::{Vec2, Vec3};

use crate::physics::crown::Frame;
use crate::rays::{Met, Stack, Triangles};
use crate::scene::{Material, Mesh};
use crate::{Error, Result};

/// The scaled space of a mesh, a hair wider than the mesh so that rounding leaves no vertex outside.
fn frame(mesh: &Mesh) -> Result<Frame> {
    let points = || mesh.triangles.iter().flat_map(|t| t.vertices).map(|v| mesh.positions[v as usize]);
    let (mut low, mut high, mut radius) = (f32::INFINITY, f32::NEG_INFINITY, 0f32);
    for [x, y, z] in points() {
        low = low.min(z);
        high = high.max(z);
        radius = radius.max(x.hypot(y));
    }
    let (half_width, half_height) = (radius * 1.0001, 0.5 * (high - low) * 1.0001);
    if !(half_width > 0.0 && half_height > 0.0 && half_width.is_finite() && half_height.is_finite()) {
        return Err(Error::Usage(
            "a tree model needs triangles that extend both sideways and upwards".into(),
        ));
    }
    Ok(Frame { centre: 0.5 * (low + high), half_width, half_height })
}

/// Where a material is a hole: opacity below its cutoff.
#[derive(Clone, Debug)]
pub struct Mask {
    width: u32,
    height: u32,
    /// Opacity × 255 of the texture.
    alpha: Vec<u8>,
    /// Opaque where the sum of four alphas with weights of 1/256² is at least this.
    threshold: u32,
}

impl Mask {
    /// The mask of a material; `None` if it has no holes.
    pub fn of(material: &Material) -> Option<Self> {
        let (cutoff, texture) = (material.alpha_cutoff?, material.texture.as_ref()?);
        let threshold = (f64::from(cutoff) / f64::from(material.base_color[3]) * 255.0 * 65536.0).ceil();
        let alpha: Vec<u8> = texture.rgba.chunks_exact(4).map(|p| p[3]).collect();
        let hole = |a: &u8| f64::from(*a) * 65536.0 < threshold;
        alpha.iter().any(hole).then(|| Mask {
            width: texture.width,
            height: texture.height,
            threshold: threshold.min(f64::from(u32::MAX)) as u32,
            alpha,
        })
    }

    /// Opacity at texture coordinates, × 255, scaled so that there is a surface from a half on.
    pub fn opacity(&self, uv: Vec2) -> u8 {
        let scaled = 127.5 * f64::from(self.sum(uv)) / f64::from(self.threshold.max(1));
        // From where on there is one, to the bit.
        let least = if self.opaque(uv) { 128.0 } else { 0.0 };
        scaled.clamp(least, if least > 0.0 { 255.0 } else { 127.0 }) as u8
    }

    /// Whether there is a surface at texture coordinates `uv` ≥ 0, which wrap around: bilinear, 8 bits of fraction.
    #[inline]
    pub fn opaque(&self, uv: Vec2) -> bool {
        self.sum(uv) >= self.threshold
    }

    /// The four alphas around, weighted.
    #[inline]
    fn sum(&self, uv: Vec2) -> u32 {
        // Half a texel back, and a whole texture on so that it stays positive.
        let x = ((uv.x + 1.0) * (self.width * 256) as f32 - 128.0) as u32;
        let y = ((uv.y + 1.0) * (self.height * 256) as f32 - 128.0) as u32;
        let (fx, fy) = (x & 255, y & 255);
        let wrap = |i: u32, n: u32| if n.is_power_of_two() { i & (n - 1) } else { i % n };
        let (x0, x1) = (wrap(x >> 8, self.width), wrap((x >> 8) + 1, self.width));
        let (y0, y1) = (wrap(y >> 8, self.height) * self.width, wrap((y >> 8) + 1, self.height) * self.width);
        let at = |i: u32| u32::from(self.alpha[i as usize]);
        let low = at(y0 + x0) * (256 - fx) + at(y0 + x1) * fx;
        let high = at(y1 + x0) * (256 - fx) + at(y1 + x1) * fx;
        low * (256 - fy) + high * fy
    }
}

/// A triangle in scaled tree space.
#[derive(Clone, Copy, Debug)]
pub struct Face {
    /// Corners.
    pub p: [Vec3; 3],
    /// Texture coordinates of the corners, moved by whole textures so that all are ≥ 0 and small.
    pub uv: [Vec2; 3],
    /// Index into [`Surface::masks`]; `None` for a triangle without holes.
    pub mask: Option<u32>,
    /// Index of the material.
    pub material: u32,
}

/// A mesh ready for rasterising and ray casting.
#[derive(Clone, Debug)]
pub struct Surface {
    /// The scaled space.
    pub frame: Frame,
    /// The triangles.
    pub faces: Vec<Face>,
    /// Masks of the materials that have one.
    pub masks: Vec<Mask>,
}

impl Surface {
    /// Prepares a mesh; an error if it has no extent.
    pub fn new(mesh: &Mesh) -> Result<Self> {
        let frame = frame(mesh)?;
        let mut masks = Vec::new();
        // A material whose factor alone falls below its cutoff is invisible.
        let invisible = |m: &Material| m.alpha_cutoff.is_some_and(|c| m.base_color[3] < c);
        let of_material: Vec<(Option<u32>, bool)> = mesh
            .materials
            .iter()
            .map(|m| {
                let mask = Mask::of(m).map(|mask| {
                    masks.push(mask);
                    masks.len() as u32 - 1
                });
                (mask, invisible(m))
            })
            .collect();
        let faces = mesh
            .triangles
            .iter()
            .filter(|t| !of_material[t.material as usize].1)
            .map(|t| {
                let p = t.vertices.map(|v| frame.to_scaled(Vec3::from(mesh.positions[v as usize])));
                let uv = t.vertices.map(|v| Vec2::from(mesh.uvs[v as usize]));
                let base = uv[0].min(uv[1]).min(uv[2]).floor();
                let mask = of_material[t.material as usize].0;
                Face { p, uv: uv.map(|c| c - base), mask, material: t.material }
            })
            .collect();
        Ok(Surface { frame, faces, masks })
    }

    /// Point `k` of an even sequence over a face, as (s, t) of a + s (b − a) + t (c − a), unless there is a hole: the plane's
    /// additive recurrence, folded into the triangle.
    pub fn spread(&self, face: &Face, k: u32) -> Option<(f32, f32)> {
        let (s, t) = ((0.5 + k as f32 * 0.754_877_7).fract(), (0.5 + k as f32 * 0.569_840_3).fract());
        let (s, t) = if s + t > 1.0 { (1.0 - s, 1.0 - t) } else { (s, t) };
        let uv = face.uv[0] * (1.0 - s - t) + face.uv[1] * s + face.uv[2] * t;
        self.opaque(face, uv).then_some((s, t))
    }

    /// Whether the face is there at the texture coordinates, rather than a hole in it.
    #[inline]
    pub fn opaque(&self, face: &Face, uv: Vec2) -> bool {
        face.mask.is_none_or(|m| self.masks[m as usize].opaque(uv))
    }

    /// The same by a face's index, where the second and third corner have these barycentric coordinates.
    #[inline]
    pub fn is_at(&self, face: u32, u: f32, v: f32) -> bool {
        let f = &self.faces[face as usize];
        f.mask.is_none() || self.opaque(f, f.uv[0] * (1.0 - u - v) + f.uv[1] * u + f.uv[2] * v)
    }
}

/// A surface that rays are cast at, in metres, through the leaf masks.
pub struct Caster<'a> {
    surface: &'a Surface,
    triangles: Triangles,
    /// Unit normals of the faces, to either side.
    normals: Vec<Vec3>,
}

impl<'a> Caster<'a> {
    /// Builds the hierarchy.
    pub fn new(surface: &'a Surface) -> Self {
        let corners: Vec<[Vec3; 3]> =
            surface.faces.iter().map(|f| f.p.map(|p| surface.frame.to_metres(p))).collect();
        let normal = |[a, b, c]: &[Vec3; 3]| (*b - *a).cross(*c - *a).normalize_or_zero();
        Caster { surface, normals: corners.iter().map(normal).collect(), triangles: Triangles::new(&corners) }
    }

    /// Whether any surface lies on the ray beyond the parameter `t_min`.
    pub fn occluded(&self, origin: Vec3, direction: Vec3, t_min: f32, stack: &mut Stack) -> bool {
        self.triangles.occluded(origin, direction, t_min, stack, |f, u, v| self.surface.is_at(f, u, v))
    }

    /// Whether any surface is on the ray but that of some faces.
    pub fn occluded_by_others(
        &self,
        origin: Vec3,
        direction: Vec3,
        own: &impl Fn(u32) -> bool,
        stack: &mut Stack,
    ) -> bool {
        let opaque = |f, u, v| !own(f) && self.surface.is_at(f, u, v);
        self.triangles.occluded(origin, direction, 0.0, stack, opaque)
    }

    /// The first surface on the ray but that of some faces, if there is any.
    pub fn first_of_others(
        &self,
        origin: Vec3,
        direction: Vec3,
        own: &impl Fn(u32) -> bool,
        stack: &mut Stack,
    ) -> Option<Met> {
        let opaque = |face, u, v| !own(face) && self.surface.is_at(face, u, v);
        self.triangles.nearest(origin, direction, f32::MAX, stack, opaque)
    }

    /// The first surface on the ray, if there is any.
    pub fn first(&self, origin: Vec3, direction: Vec3, stack: &mut Stack) -> Option<Met> {
        self.first_of_others(origin, direction, &|_| false, stack)
    }

    /// Unit normal of a face, to either side.
    pub fn normal(&self, face: u32) -> Vec3 {
        self.normals[face as usize]
    }
}
