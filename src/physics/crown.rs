//! Proportions of a species' tree, and how its crown shades itself: what bakes, tables and shaders know of a mesh beside its
//! views.

use glam::Vec3;

use super::correction::Correction;

/// The affine map between a tree and its scaled space, p' = S⁻¹ (p − o): a cylinder r ≤ 1, |z| ≤ 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Frame {
    /// Height of o above the trunk's base, m; o is on the trunk's axis.
    pub centre: f32,
    /// Largest horizontal distance from the trunk's axis, m: S = diag(`half_width`, `half_width`, `half_height`).
    pub half_width: f32,
    /// Half the range of z, m.
    pub half_height: f32,
}

impl Frame {
    /// S, as a vector, m.
    pub fn scale(&self) -> Vec3 {
        Vec3::new(self.half_width, self.half_width, self.half_height)
    }

    /// Into scaled tree space.
    pub fn to_scaled(self, p: Vec3) -> Vec3 {
        (p - Vec3::Z * self.centre) / self.scale()
    }

    /// Into metres about the trunk's base.
    pub fn to_metres(self, p: Vec3) -> Vec3 {
        p * self.scale() + Vec3::Z * self.centre
    }
}

/// A tree of scale 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Crown {
    /// Its scaled space.
    pub frame: Frame,
    /// Radius of a disc of the crown's horizontal area, m.
    pub radius: f32,
    /// Height of the crown's base, m.
    pub base: f32,
    /// Height of the tree, m.
    pub height: f32,
    /// c of the crown's self-shadow ([`super::light::self_shadow`]), 1/√rad.
    pub leaf_shadow: f32,
    /// τ of the crown's self-shadow, 1/(m rad).
    pub extinction: f32,
    /// What that law leaves out of the share that is lit; nothing in the hotspot, where all is lit.
    pub lit: Correction,
    /// What that law and uniform leaves leave out of the sunlight that is sent to the viewer.
    pub sent: Correction,
}

impl Crown {
    /// k of S = diag(1, 1, k): crown diameter over crown height.
    pub fn vertical_scale(&self) -> f64 {
        let height = f64::from(self.height);
        2.0 * f64::from(self.radius) / (height - f64::from(self.base)).max(1e-3 * height)
    }

    /// Height of the crown's base in the scaled space: there is only bark under it.
    pub fn bare_below(&self) -> f32 {
        (self.base - self.frame.centre) / self.frame.half_height
    }

    /// Share of bark, in [0, 1], in what is seen at a height of the scaled space.
    pub fn bark_share(&self, z: f32) -> f32 {
        let t = ((z - (self.bare_below() - 0.05)) / 0.1).clamp(0.0, 1.0);
        1.0 - t * t * (3.0 - 2.0 * t)
    }
}
