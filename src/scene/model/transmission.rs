//! What of light goes through a material: the extension KHR_materials_diffuse_transmission, which is how glTF tells a leaf from a board. Of diffuse light
//! a share goes through, times a colour of its own, and the rest is reflected with the base colour.

use std::path::Path;

use serde::Deserialize;
use serde_json::Value;

use super::materials::uv_set;
use crate::{Error, Result};

/// The extension's name.
pub(super) const NAME: &str = "KHR_materials_diffuse_transmission";
const TEXTURE_TRANSFORM: &str = "KHR_texture_transform";

/// The extension of a material as the file has it.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Stated {
    /// Share of diffuse light that goes through.
    pub diffuse_transmission_factor: f32,
    /// Its opacity is a factor of the share.
    pub diffuse_transmission_texture: Option<TextureInfo>,
    /// Linear RGB of what goes through.
    pub diffuse_transmission_color_factor: [f32; 3],
    /// Its sRGB colour is a factor of that.
    pub diffuse_transmission_color_texture: Option<TextureInfo>,
}

/// A reference to a texture.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct TextureInfo {
    /// The texture's index.
    pub index: usize,
    #[serde(default)]
    tex_coord: u32,
    #[serde(default)]
    extensions: Value,
}

/// Texture coordinates: their set, and what KHR_texture_transform does to them.
#[derive(Debug, PartialEq)]
struct Coordinates {
    set: u32,
    offset: [f32; 2],
    rotation: f32,
    scale: [f32; 2],
}

/// KHR_texture_transform as the file has it.
#[derive(Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
struct Moved {
    offset: [f32; 2],
    rotation: f32,
    scale: Option<[f32; 2]>,
    tex_coord: Option<u32>,
}

impl Default for Stated {
    fn default() -> Self {
        Stated {
            diffuse_transmission_factor: 0.0,
            diffuse_transmission_texture: None,
            diffuse_transmission_color_factor: [1.0; 3],
            diffuse_transmission_color_texture: None,
        }
    }
}

impl Stated {
    /// What a material states, if it has the extension.
    ///
    /// # Errors
    /// [`Error::Input`] where that cannot be read, where a factor is not 0 to 1, and where a texture has other coordinates than the base colour's.
    pub fn of(name: &Path, place: &str, material: &gltf::Material) -> Result<Option<Stated>> {
        let Some(value) = material.extension_value(NAME) else { return Ok(None) };
        let bad = |what: String, remedy: &str| Error::input(name, place, format!("{NAME}: {what}"), remedy);
        let again = "correct the material and export the model again";
        let stated: Stated = serde_json::from_value(value.clone()).map_err(|e| bad(e.to_string(), again))?;
        let [r, g, b] = stated.diffuse_transmission_color_factor;
        if let Some(f) =
            [stated.diffuse_transmission_factor, r, g, b].iter().find(|f| !(0.0..=1.0).contains(*f))
        {
            return Err(bad(format!("a factor is {f}, not 0 to 1"), again));
        }
        for texture in stated.textures() {
            if coordinates(texture).map_err(|e| bad(e.to_string(), again))? != of_base_colour(material) {
                let remedy = "give its textures the base colour's texture coordinates and transform, or bake them to those";
                return Err(bad(
                    "a texture has other texture coordinates than the base colour".into(),
                    remedy,
                ));
            }
        }
        Ok(Some(stated))
    }

    fn textures(&self) -> impl Iterator<Item = &TextureInfo> {
        self.diffuse_transmission_texture.iter().chain(&self.diffuse_transmission_color_texture)
    }
}

fn coordinates(texture: &TextureInfo) -> serde_json::Result<Coordinates> {
    let moved = match texture.extensions.get(TEXTURE_TRANSFORM) {
        Some(value) => Moved::deserialize(value)?,
        None => Moved::default(),
    };
    Ok(Coordinates {
        set: moved.tex_coord.unwrap_or(texture.tex_coord),
        offset: moved.offset,
        rotation: moved.rotation,
        scale: moved.scale.unwrap_or([1.0; 2]),
    })
}

fn of_base_colour(material: &gltf::Material) -> Coordinates {
    let texture = material.pbr_metallic_roughness().base_color_texture();
    let moved = texture.as_ref().and_then(|t| t.texture_transform());
    Coordinates {
        set: uv_set(material),
        offset: moved.as_ref().map_or([0.0; 2], |t| t.offset()),
        rotation: moved.as_ref().map_or(0.0, |t| t.rotation()),
        scale: moved.as_ref().map_or([1.0; 2], |t| t.scale()),
    }
}
