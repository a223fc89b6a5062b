//! Species to data: z-field views, occlusion, optics; cached on disk by content.

/// Everything that drawing one species needs, baked from its mesh once.
#[derive(Clone, Debug, PartialEq)]
pub struct SpeciesBake {
    /// The depth views.
    pub views: ZField,
    /// Centre of the crown box, m above the trunk base along z, on the trunk axis: `o` = (0, 0, `center`).
    pub center: f32,
    /// Half extent of the tree in x and y about the trunk axis, m: S = diag(radius, radius, half_height).
    pub radius: f32,
    /// Half extent of the tree in z, m.
    pub half_height: f32,
    /// Extinction coefficient of the crown, 1/m.
    pub extinction: f32,
    /// Leaf single-scattering albedo, linear RGB: reflectance + transmittance.
    pub albedo: [f32; 3],
    /// Horizontal projected area of the unscaled tree, m² (A of BN12 for scale 1).
    pub area: f32,
    /// Foliage (crown) half width, m.
    pub crown_radius: f32,
    /// Height of the crown's base, m.
    pub crown_base: f32,
    /// Height of the tree, m.
    pub height: f32,
}

/// Depth views of one tree: a texture array with one layer a view and mip levels down to 1 × 1.
#[derive(Clone, Debug, PartialEq)]
pub struct ZField {
    /// n of the 2n(n+1)+1 views.
    pub n: u32,
    /// Texels a side of level 0; a power of two.
    pub resolution: u32,
    /// Per level, all layers one after the other, rows from the bottom (v = 0) up, RGBA8:
    /// premultiplied nearest depth, farthest depth, occlusion; opacity.
    pub levels: Vec<Vec<u8>>,
}
