//! The triangle mesh of one tree, as loaded and validated.

use std::sync::Arc;

/// A tree model: z up, trunk base near the origin, metres. Indices are in range, numbers are finite,
/// triangles have area.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Vertex positions, m.
    pub positions: Vec<[f32; 3]>,
    /// Unit vertex normals, as many as positions.
    pub normals: Vec<[f32; 3]>,
    /// Texture coordinates, as many as positions.
    pub uvs: Vec<[f32; 2]>,
    /// Triangles.
    pub triangles: Vec<Triangle>,
    /// Materials.
    pub materials: Vec<Material>,
    /// Zero-area triangles that were dropped on loading.
    pub dropped_triangles: u32,
}

/// A triangle and its material.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Triangle {
    /// Indices into the mesh's vertices.
    pub vertices: [u32; 3],
    /// Index into the mesh's materials.
    pub material: u32,
}

/// A surface: foliage or bark.
#[derive(Clone, Debug)]
pub struct Material {
    /// Name in the file.
    pub name: String,
    /// Leaves, as against bark.
    pub foliage: bool,
    /// Linear RGB and opacity, multiplied with the texture.
    pub base_color: [f32; 4],
    /// Base colour texture, if any; wraps around.
    pub texture: Option<Arc<Texture>>,
    /// Opacity below this is a hole; `None` for opaque materials.
    pub alpha_cutoff: Option<f32>,
    /// Seen from both sides.
    pub double_sided: bool,
    /// What of light goes through it, if the file says so.
    pub transmission: Option<Transmission>,
}

/// What of diffuse light goes through a surface (KHR_materials_diffuse_transmission): a share, times a colour of its own; the rest is reflected with the base colour.
#[derive(Clone, Debug)]
pub struct Transmission {
    /// The share.
    pub factor: f32,
    /// Its opacity is a factor of the share; has the base colour's texture coordinates.
    pub factor_texture: Option<Arc<Texture>>,
    /// Linear RGB of what goes through.
    pub color: [f32; 3],
    /// Its colour is a factor of that; has the base colour's texture coordinates.
    pub color_texture: Option<Arc<Texture>>,
}

impl Material {
    /// A leaf without texture, white and seen from both sides.
    pub fn leaf() -> Self {
        Material {
            name: "leaf".into(),
            foliage: true,
            base_color: [1.0; 4],
            texture: None,
            alpha_cutoff: None,
            double_sided: true,
            transmission: None,
        }
    }
}

/// An RGBA image, 8 bits, sRGB colour and linear opacity; row 0 is the top, texture coordinate v = 0.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Texture {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// `width * height * 4` bytes.
    pub rgba: Vec<u8>,
}

impl Texture {
    /// Columns and rows, and bytes, of a texture that a key is to hold; none of either where there is none.
    pub(crate) fn content(texture: &Option<Arc<Texture>>) -> ([u32; 2], &[u8]) {
        texture.as_ref().map_or(([0; 2], &[]), |t| ([t.width, t.height], &t.rgba))
    }
}
