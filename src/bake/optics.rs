//! What light meets in a crown, measured from the mesh.
//!
//! - Self-shadow, c and τ of [`crate::physics::light::self_shadow`], and how leaves are turned, κ: see [`super::self_shadow`].
//! - Albedo: leaf reflectance r is the mean linear colour of the foliage's opaque texels times the material's
//!   factor; transmittance t is r/2 unless the scene or the model states it; ρ = r + t. Measured broad leaves have t a
//!   little below r in the visible range and needles well below, and base colour textures carry no
//!   transmittance at all; r/2 lies between, and keeps ρ < 1 for every r < 2/3.
//! - A material with KHR_materials_diffuse_transmission, of a share f and a colour c: r = (1 − f) base colour, t = f c, texel by texel.
//! - A tree without foliage: all of its surface stands for leaves, with the bark's colour and t = 0.

use std::collections::HashSet;
use std::sync::Arc;

use glam::{Vec2, Vec3};

use super::surface::Surface;
use super::{SpeciesBake, self_shadow};
use crate::physics::crown::Crown;
use crate::physics::light::luminance;
use crate::physics::tonemap::linear as linear_from_srgb;
use crate::physics::transfer::Transfer;
use crate::physics::views;
use crate::physics::zfield::ZField;
use crate::scene::{Material, Mesh, OpticsOverride, Texture};

/// Subdivisions a side of a triangle for measuring masks and colours: 256 equal parts, sampled in the middle.
const PARTS: u32 = 16;

/// The foliage, or the whole surface where there is none.
#[derive(Clone, Debug, PartialEq)]
pub struct Leaves {
    /// Whether any of it is foliage.
    pub foliage: bool,
    /// One-sided area, m².
    pub area: f64,
    /// Mean reflectance, linear RGB.
    pub color: [f64; 3],
    /// Mean transmittance, if any of its materials states one; of others it is half of their reflectance.
    pub transmittance: Option<[f64; 3]>,
    /// Height under which 2 % of the area lie, m.
    pub base: f32,
    /// Mean linear colour of everything that is not foliage; that of the leaves where all is.
    pub bark: [f64; 3],
}

/// Measures leaf area, colours and base height.
pub fn leaves(mesh: &Mesh, surface: &Surface) -> Leaves {
    let foliage = surface.faces.iter().any(|f| mesh.materials[f.material as usize].foliage);
    let Measured { area, color, transmittance, mut heights } =
        measure(mesh, surface, |m| !foliage || m.foliage);
    let bark = measure(mesh, surface, |m| !m.foliage);
    heights.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut below = 0.0;
    let base = heights.iter().find(|(_, a)| {
        below += a;
        below >= 0.02 * area
    });
    Leaves {
        foliage,
        area,
        color,
        transmittance,
        base: base.map_or(0.0, |b| b.0),
        bark: if bark.area > 0.0 { bark.color } else { color },
    }
}

/// The surface of some materials.
struct Measured {
    area: f64,
    color: [f64; 3],
    transmittance: Option<[f64; 3]>,
    /// (height, area) of each part.
    heights: Vec<(f32, f64)>,
}

/// Measures the surface of some materials.
fn measure(mesh: &Mesh, surface: &Surface, keep: impl Fn(&Material) -> bool) -> Measured {
    let mut seen = HashSet::new();
    let stated = mesh.materials.iter().any(|m| keep(m) && m.transmission.is_some());
    let (mut area, mut color, mut through) = (0.0, [0.0; 3], [0.0; 3]);
    // (height, area) of each part of a triangle row.
    let mut heights: Vec<(f32, f64)> = Vec::new();
    let mut linear = [0f64; 256];
    for (i, x) in linear.iter_mut().enumerate() {
        *x = linear_from_srgb(i as f64 / 255.0);
    }
    for face in surface.faces.iter().filter(|f| keep(&mesh.materials[f.material as usize])) {
        let material = &mesh.materials[face.material as usize];
        let corners = face.p.map(|p| surface.frame.to_metres(p));
        let mut key = corners.map(|p| p.to_array().map(f32::to_bits));
        key.sort_unstable();
        if !seen.insert(key) {
            continue;
        }
        let [a, b, c] = corners.map(|p| p.as_dvec3());
        let part = 0.5 * (b - a).cross(c - a).length() / f64::from(PARTS * PARTS);
        for (s, t) in parts() {
            let uv = face.uv[0] * (1.0 - s - t) + face.uv[1] * s + face.uv[2] * t;
            if !surface.opaque(face, uv) {
                continue;
            }
            area += part;
            heights.push((corners[0].z * (1.0 - s - t) + corners[1].z * s + corners[2].z * t, part));
            let texel = texel_of(&material.texture, uv);
            let sent = material.transmission.as_ref().map(|t| {
                let opacity = f64::from(texel_of(&t.factor_texture, uv)[3]) / 255.0;
                (f64::from(t.factor) * opacity, t.color, texel_of(&t.color_texture, uv))
            });
            for i in 0..3 {
                let all = part * linear[texel[i] as usize] * f64::from(material.base_color[i]);
                match sent {
                    Some((share, c, colour)) => {
                        color[i] += (1.0 - share) * all;
                        through[i] += part * share * linear[colour[i] as usize] * f64::from(c[i]);
                    }
                    None => {
                        color[i] += all;
                        through[i] += 0.5 * all;
                    }
                }
            }
        }
    }
    let mean = |sum: [f64; 3]| sum.map(|c| if area > 0.0 { c / area } else { 0.0 });
    Measured { area, color: mean(color), transmittance: stated.then(|| mean(through)), heights }
}

/// Barycentric coordinates of the middles of a triangle's parts.
fn parts() -> impl Iterator<Item = (f32, f32)> {
    let n = PARTS;
    (0..n).flat_map(move |i| {
        (0..2 * (n - i) - 1).map(move |k| {
            // Upright parts in even places, upside-down ones between them.
            let (j, third) = (k / 2, if k % 2 == 0 { 1.0 / 3.0 } else { 2.0 / 3.0 });
            ((i as f32 + third) / n as f32, (j as f32 + third) / n as f32)
        })
    })
}

/// RGBA of a texture, white where there is none; wraps around.
pub(super) fn texel_of(texture: &Option<Arc<Texture>>, uv: Vec2) -> [u8; 4] {
    let Some(texture) = texture else { return [255; 4] };
    let wrap = |x: f32, n: u32| ((x - x.floor()) * n as f32) as u32 % n;
    let at = 4 * (wrap(uv.y, texture.height) * texture.width + wrap(uv.x, texture.width)) as usize;
    std::array::from_fn(|k| texture.rgba[at + k])
}

/// Horizontal projected area in units of the frame's `half_width`²: the opacity of the view from the zenith.
pub fn top_area(field: &ZField) -> f64 {
    let m = f64::from(field.resolution) / f64::from(field.resolution - 2);
    let size = (field.resolution * field.resolution * 4) as usize;
    let zenith = views::layer(field.n, 0, 0) as usize;
    let sum: u64 =
        field.levels[0][zenith * size..(zenith + 1) * size].chunks_exact(4).map(|t| u64::from(t[3])).sum();
    sum as f64 / 255.0 * (2.0 * m / f64::from(field.resolution)).powi(2)
}

/// Reflectances of a species, linear RGB.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Colours {
    /// Leaf reflectance; that of the whole surface where there is no foliage.
    pub reflectance: [f32; 3],
    /// Leaf transmittance; with the reflectance at most 1.
    pub transmittance: [f32; 3],
    /// Bark reflectance.
    pub bark_reflectance: [f32; 3],
}

/// Reflectances measured from a mesh; what the scene states wins.
pub fn colours(mesh: &Mesh, surface: &Surface, stated: &OpticsOverride) -> Colours {
    colours_of(&leaves(mesh, surface), stated)
}

fn colours_of(leaves: &Leaves, stated: &OpticsOverride) -> Colours {
    let color = leaves.color.map(|c| c as f32);
    let (reflectance, share) = if leaves.foliage {
        (stated.leaf_reflectance.unwrap_or(color), 0.5)
    } else {
        (stated.bark_reflectance.unwrap_or(color), 0.0)
    };
    let measured = leaves.transmittance.map(|t| t.map(|c| c as f32));
    let transmittance = match stated.leaf_transmittance.or(measured) {
        Some(t) if leaves.foliage => t,
        _ => reflectance.map(|r| share * r),
    };
    Colours {
        reflectance,
        // A leaf scatters no more than it gets.
        transmittance: std::array::from_fn(|i| transmittance[i].min(1.0 - reflectance[i])),
        bark_reflectance: stated.bark_reflectance.unwrap_or(leaves.bark.map(|c| c as f32)),
    }
}

/// Puts views and measurements together; what the scene states wins over what the mesh shows.
pub fn species(mesh: &Mesh, surface: &Surface, views: ZField, stated: &OpticsOverride) -> SpeciesBake {
    let leaves = leaves(mesh, surface);
    let frame = surface.frame;
    // A tree without foliage: all of it stands for leaves.
    let foliage: Vec<bool> = mesh.materials.iter().map(|m| m.foliage || !leaves.foliage).collect();
    let colours = colours_of(&leaves, stated);
    let luminances = [colours.reflectance, colours.transmittance, colours.bark_reflectance].map(luminance);
    let matter = self_shadow::Matter { foliage: &foliage, base: leaves.base, luminances };
    let self_shadow::Measured { shadow, turned, corrections: [lit, sent] } =
        self_shadow::measure(surface, &matter, &views);
    let [leaf_shadow, extinction] = shadow.map(|x| x as f32);
    let area = top_area(&views) * f64::from(frame.half_width).powi(2);
    SpeciesBake {
        views,
        transfer: Transfer::default(),
        crown: Crown {
            frame,
            radius: (area / std::f64::consts::PI).sqrt() as f32,
            base: leaves.base,
            height: surface.faces.iter().flat_map(|f| f.p).fold(f32::NEG_INFINITY, |h, p: Vec3| h.max(p.z))
                * frame.half_height
                + frame.centre,
            leaf_shadow,
            extinction: stated.extinction.unwrap_or(extinction),
            lit,
            sent,
        },
        turned,
        reflectance: colours.reflectance,
        bark_reflectance: colours.bark_reflectance,
        transmittance: colours.transmittance,
        area: area as f32,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Transmission;
    use crate::scene::mesh::Triangle;

    /// A square leaf of a colour, whose texture coordinates all are the middle of a texture.
    fn leaf(material: Material) -> Mesh {
        Mesh {
            positions: vec![[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 1.0, 2.0], [0.0, 1.0, 2.0]],
            normals: vec![[0.0, 0.0, 1.0]; 4],
            uvs: vec![[0.5; 2]; 4],
            triangles: [[0, 1, 2], [0, 2, 3]].map(|vertices| Triangle { vertices, material: 0 }).to_vec(),
            materials: vec![material],
            dropped_triangles: 0,
        }
    }

    fn measured(material: Material, stated: &OpticsOverride) -> [[f32; 3]; 2] {
        let mesh = leaf(material);
        let colours = colours(&mesh, &Surface::new(&mesh).unwrap(), stated);
        [colours.reflectance, colours.transmittance]
    }

    fn near(a: [f32; 3], b: [f32; 3]) -> bool {
        a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-6)
    }

    /// KHR_materials_diffuse_transmission: a share goes through with a colour of its own, the rest is reflected; the scene wins over the model.
    #[test]
    fn what_goes_through_a_leaf_is_what_its_material_says() {
        let texture = |rgba: [u8; 4]| Some(Arc::new(Texture { width: 1, height: 1, rgba: rgba.to_vec() }));
        let plain = Material { base_color: [0.2, 0.4, 0.1, 1.0], ..Material::leaf() };
        let none = OpticsOverride::default();
        let [r, t] = measured(plain.clone(), &none);
        assert!(near(r, [0.2, 0.4, 0.1]) && near(t, [0.1, 0.2, 0.05]), "{r:?} {t:?}");

        let transmission = Transmission {
            factor: 0.5,
            factor_texture: texture([0, 0, 0, 51]), // a fifth
            color: [1.0, 0.5, 0.25],
            color_texture: texture([255, 255, 0, 255]),
        };
        let sends = Material { transmission: Some(transmission), ..plain };
        let [r, t] = measured(sends.clone(), &none);
        assert!(near(r, [0.18, 0.36, 0.09]) && near(t, [0.1, 0.05, 0.0]), "{r:?} {t:?}");

        let stated = OpticsOverride { leaf_transmittance: Some([0.3; 3]), ..none };
        assert_eq!(measured(sends, &stated)[1], [0.3; 3]);
    }
}
