//! The materials of a model, read when a primitive first uses them.

use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

use gltf::material::AlphaMode;

use super::buffers::Buffers;
use super::transmission::{Stated, TextureInfo};
use crate::scene::mesh::{Material, Texture, Transmission};
use crate::scene::texture::decode_texture;
use crate::settings::nearest;
use crate::{Error, Result};

/// The cutoff that glTF gives MASK materials by default; BLEND materials are cut there too.
const DEFAULT_CUTOFF: f32 = 0.5;

/// Collects the materials that are used, in order of first use.
pub(super) struct Materials<'a> {
    name: &'a Path,
    document: &'a gltf::Document,
    buffers: &'a Buffers,
    foliage: Option<&'a [String]>,
    used: Vec<Material>,
    indices: HashMap<Option<usize>, u32>,
    textures: HashMap<usize, Arc<Texture>>,
}

/// The set of texture coordinates that a material's base colour uses.
pub(super) fn uv_set(material: &gltf::Material) -> u32 {
    let texture = material.pbr_metallic_roughness().base_color_texture();
    texture.map_or(0, |t| t.texture_transform().and_then(|x| x.tex_coord()).unwrap_or(t.tex_coord()))
}

/// What KHR_texture_transform does to the coordinates of a material's base colour: scale, turn, shift.
pub(super) fn transform_uv(material: &gltf::Material, uvs: &mut [[f32; 2]]) {
    let texture = material.pbr_metallic_roughness().base_color_texture();
    let Some(t) = texture.and_then(|t| t.texture_transform()) else { return };
    let (sin, cos) = t.rotation().sin_cos();
    for uv in uvs {
        let [u, v] = [uv[0] * t.scale()[0], uv[1] * t.scale()[1]];
        *uv = [cos * u + sin * v + t.offset()[0], cos * v - sin * u + t.offset()[1]];
    }
}

fn name_of(material: &gltf::Material) -> String {
    match (material.name(), material.index()) {
        (Some(name), _) => name.to_string(),
        (None, Some(index)) => format!("material {index}"),
        (None, None) => "default".to_string(),
    }
}

impl<'a> Materials<'a> {
    /// Starts with none used. Errors if `foliage` names a material that the document does not have.
    pub fn new(
        name: &'a Path,
        document: &'a gltf::Document,
        buffers: &'a Buffers,
        foliage: Option<&'a [String]>,
    ) -> Result<Self> {
        let names: Vec<String> = document.materials().map(|m| name_of(&m)).collect();
        for wanted in foliage.into_iter().flatten() {
            if !names.contains(wanted) {
                let remedy = match nearest(wanted, names.iter().map(String::as_str)) {
                    Some(near) => format!("did you mean \"{near}\"?"),
                    None => format!("its materials are: {}", names.join(", ")),
                };
                return Err(Error::input(
                    name,
                    "materials",
                    format!("the model has no material \"{wanted}\""),
                    remedy,
                ));
            }
        }
        let (used, indices, textures) = Default::default();
        Ok(Materials { name, document, buffers, foliage, used, indices, textures })
    }

    /// The index of a material among those used. Errors name the material.
    pub fn index(&mut self, material: &gltf::Material) -> Result<u32> {
        if let Some(&index) = self.indices.get(&material.index()) {
            return Ok(index);
        }
        let read = self.read(material)?;
        let index = self.used.len() as u32;
        self.used.push(read);
        self.indices.insert(material.index(), index);
        Ok(index)
    }

    /// The materials used.
    pub fn finish(self) -> Vec<Material> {
        self.used
    }

    fn read(&mut self, material: &gltf::Material) -> Result<Material> {
        let name = name_of(material);
        let place = format!("material \"{name}\"");
        let unit = |value: f32, what: &str| {
            if (0.0..=1.0).contains(&value) {
                return Ok(());
            }
            let what = format!("{what} is {value}, not 0 to 1");
            Err(Error::input(self.name, &place, what, "correct the material and export the model again"))
        };
        let pbr = material.pbr_metallic_roughness();
        let base_color = pbr.base_color_factor();
        base_color.iter().try_for_each(|c| unit(*c, "the base colour factor"))?;
        let alpha_cutoff = match material.alpha_mode() {
            AlphaMode::Opaque => None,
            AlphaMode::Mask => Some(material.alpha_cutoff().unwrap_or(DEFAULT_CUTOFF)),
            AlphaMode::Blend => Some(DEFAULT_CUTOFF),
        };
        alpha_cutoff.iter().try_for_each(|c| unit(*c, "the alpha cutoff"))?;
        let texture =
            pbr.base_color_texture().map(|t| self.texture(t.texture().source().index())).transpose()?;
        let foliage = match self.foliage {
            Some(names) => names.contains(&name),
            None => alpha_cutoff.is_some() || material.double_sided(),
        };
        Ok(Material {
            name,
            foliage,
            base_color,
            texture,
            alpha_cutoff,
            double_sided: material.double_sided(),
            transmission: Stated::of(self.name, &place, material)?
                .map(|stated| self.transmission(&place, stated))
                .transpose()?,
        })
    }

    fn transmission(&mut self, place: &str, stated: Stated) -> Result<Transmission> {
        Ok(Transmission {
            factor: stated.diffuse_transmission_factor,
            factor_texture: self.named(place, stated.diffuse_transmission_texture)?,
            color: stated.diffuse_transmission_color_factor,
            color_texture: self.named(place, stated.diffuse_transmission_color_texture)?,
        })
    }

    /// A texture that an extension refers to.
    fn named(&mut self, place: &str, info: Option<TextureInfo>) -> Result<Option<Arc<Texture>>> {
        let Some(TextureInfo { index, .. }) = info else { return Ok(None) };
        let texture = self.document.textures().nth(index).ok_or_else(|| {
            let what = format!("textures[{index}] is not there");
            Error::input(self.name, place, what, "correct the material and export the model again")
        })?;
        self.texture(texture.source().index()).map(Some)
    }

    fn texture(&mut self, image: usize) -> Result<Arc<Texture>> {
        if let Some(texture) = self.textures.get(&image) {
            return Ok(texture.clone());
        }
        let bytes = self.buffers.image(self.name, self.document, image)?;
        let texture = Arc::new(decode_texture(self.name, &format!("images[{image}]"), &bytes)?);
        self.textures.insert(image, texture.clone());
        Ok(texture)
    }
}
