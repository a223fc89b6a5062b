//! Covering a skeleton: generalized cylinders for stems, crossed cards for sprays of leaves.

use glam::DVec3;

use super::parameters::{Leaves, Parameters};
use super::skeleton::{Skeleton, Stem};

/// A surface of one material: z up, metres.
#[derive(Clone, Debug, Default)]
pub(crate) struct Surface {
    /// Vertex positions, m.
    pub positions: Vec<[f32; 3]>,
    /// Unit normals.
    pub normals: Vec<[f32; 3]>,
    /// Texture coordinates, v = 0 at the image's top.
    pub uvs: Vec<[f32; 2]>,
    /// Triangles, counter-clockwise from outside.
    pub indices: Vec<u32>,
}

impl Surface {
    fn vertex(&mut self, at: DVec3, normal: DVec3, uv: [f64; 2]) -> u32 {
        self.positions.push(at.as_vec3().to_array());
        self.normals.push(normal.normalize().as_vec3().to_array());
        self.uvs.push(uv.map(|c| c as f32));
        self.positions.len() as u32 - 1
    }
}

/// The bark: each stem a tapered generalized cylinder with shared vertices and smooth normals.
pub(super) fn bark(parameters: &Parameters, skeleton: &Skeleton) -> Surface {
    let mut surface = Surface::default();
    let levels = parameters.levels();
    for stem in &skeleton.stems {
        cylinder(&mut surface, levels[stem.level].sides, parameters.bark.repeat, stem);
    }
    surface
}

fn cylinder(surface: &mut Surface, sides: u32, repeat: f64, stem: &Stem) {
    let last = stem.sections.len() - 1;
    let step = stem.length / last as f64;
    // A whole number of repeats around, so that the texture meets itself.
    let around = (std::f64::consts::TAU * stem.sections[0].radius / (0.5 * repeat)).round().max(1.0);
    let first = surface.positions.len() as u32;
    for (i, section) in stem.sections.iter().enumerate() {
        // The ring stands across the mean of the segments that meet there, or it would be pinched.
        let before = stem.sections[i.saturating_sub(1)].frame.z_axis;
        let axis = if i == last { before } else { (before + section.frame.z_axis).normalize() };
        let x = section.frame.x_axis.reject_from_normalized(axis).normalize();
        let y = axis.cross(x);
        let (a, b) = (&stem.sections[i.saturating_sub(1)], &stem.sections[(i + 1).min(last)]);
        let slope = (a.radius - b.radius) / (step * if i == 0 || i == last { 1.0 } else { 2.0 });
        for k in 0..=sides {
            let angle = f64::from(k % sides) * std::f64::consts::TAU / f64::from(sides);
            let out = x * angle.cos() + y * angle.sin();
            let uv = [around * f64::from(k) / f64::from(sides), -(i as f64) * step / repeat];
            surface.vertex(section.at + out * section.radius, out + axis * slope, uv);
        }
    }
    for i in 0..last as u32 {
        for k in 0..sides {
            let a = first + i * (sides + 1) + k;
            let (b, c, d) = (a + 1, a + sides + 1, a + sides + 2);
            surface.indices.extend([a, b, d, a, d, c]);
        }
    }
}

/// The leaves: each spray a card, or two crossed along its axis.
pub(super) fn leaves(leaves: &Leaves, skeleton: &Skeleton) -> Surface {
    let mut surface = Surface::default();
    for spray in &skeleton.sprays {
        let length = leaves.length * spray.scale;
        let (along, half) = (spray.frame.z_axis * length, 0.5 * leaves.width * length);
        let crossed = [(spray.frame.x_axis, spray.frame.y_axis), (spray.frame.y_axis, -spray.frame.x_axis)];
        for (side, normal) in crossed.into_iter().take(leaves.cards as usize) {
            let (left, right) = (spray.at - side * half, spray.at + side * half);
            let a = surface.vertex(left, -normal, [0.0, 1.0]);
            let b = surface.vertex(right, -normal, [1.0, 1.0]);
            let c = surface.vertex(right + along, -normal, [1.0, 0.0]);
            let d = surface.vertex(left + along, -normal, [0.0, 0.0]);
            surface.indices.extend([a, b, c, a, c, d]);
        }
    }
    surface
}
