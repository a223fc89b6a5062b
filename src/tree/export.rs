//! Writing surfaces and images as binary glTF 2.0.

use std::borrow::Cow;
use std::io::Cursor;

use image::RgbaImage;
use serde_json::{Value, json};

use super::surface::Surface;

/// One material and its surface.
pub(crate) struct Part<'a> {
    /// The material's name.
    pub name: &'static str,
    /// Geometry, z up.
    pub surface: &'a Surface,
    /// Base colour.
    pub image: &'a RgbaImage,
    /// Whether opacity cuts holes; such a material is double-sided.
    pub cutout: bool,
}

const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

#[derive(Default)]
struct Writer {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Writer {
    fn view(&mut self, bytes: &[u8], target: Option<u32>) -> usize {
        // Accessors start at multiples of their component's size.
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let mut view = json!({"buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len()});
        if let Some(target) = target {
            view["target"] = json!(target);
        }
        self.views.push(view);
        self.bytes.extend_from_slice(bytes);
        self.views.len() - 1
    }

    fn floats<const N: usize>(&mut self, values: &[[f32; N]], bounds: bool) -> usize {
        let bytes: Vec<u8> = values.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
        let view = self.view(&bytes, Some(ARRAY_BUFFER));
        let kind = format!("VEC{N}");
        let mut accessor =
            json!({"bufferView": view, "componentType": FLOAT, "count": values.len(), "type": kind});
        if bounds {
            let fold = |f: fn(f32, f32) -> f32| -> Vec<f32> {
                (0..N).map(|i| values.iter().map(|v| v[i]).reduce(f).unwrap_or(0.0)).collect()
            };
            accessor["min"] = json!(fold(f32::min));
            accessor["max"] = json!(fold(f32::max));
        }
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    fn indices(&mut self, values: &[u32]) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        let view = self.view(&bytes, Some(ELEMENT_ARRAY_BUFFER));
        self.accessors.push(
            json!({"bufferView": view, "componentType": UNSIGNED_INT, "count": values.len(), "type": "SCALAR"}),
        );
        self.accessors.len() - 1
    }
}

/// z up to glTF's y up: the inverse of what loading does.
fn y_up([x, y, z]: [f32; 3]) -> [f32; 3] {
    [x, z, -y]
}

fn png(image: &RgbaImage) -> Vec<u8> {
    let mut out = Cursor::new(Vec::new());
    image.write_to(&mut out, image::ImageFormat::Png).expect("an RGBA image in memory can be written as PNG");
    out.into_inner()
}

/// One mesh with a primitive, a material and a texture for each part.
pub(crate) fn glb(parts: &[Part]) -> Vec<u8> {
    let mut writer = Writer::default();
    let (mut primitives, mut materials, mut textures, mut images) = (vec![], vec![], vec![], vec![]);
    for (i, part) in parts.iter().enumerate() {
        let turn = |v: &[[f32; 3]]| v.iter().copied().map(y_up).collect::<Vec<_>>();
        let position = writer.floats(&turn(&part.surface.positions), true);
        let normal = writer.floats(&turn(&part.surface.normals), false);
        let uv = writer.floats(&part.surface.uvs, false);
        let indices = writer.indices(&part.surface.indices);
        let view = writer.view(&png(part.image), None);
        primitives.push(json!({
            "attributes": {"POSITION": position, "NORMAL": normal, "TEXCOORD_0": uv}, "indices": indices, "material": i,
        }));
        let mut material = json!({
            "name": part.name,
            "pbrMetallicRoughness": {"baseColorTexture": {"index": i}, "metallicFactor": 0.0, "roughnessFactor": 1.0},
        });
        if part.cutout {
            material["alphaMode"] = json!("MASK");
            material["alphaCutoff"] = json!(0.5);
            material["doubleSided"] = json!(true);
        }
        materials.push(material);
        textures.push(json!({"source": i, "sampler": 0}));
        images.push(json!({"name": part.name, "bufferView": view, "mimeType": "image/png"}));
    }
    writer.bytes.resize(writer.bytes.len().next_multiple_of(4), 0);
    let document = json!({
        "asset": {"version": "2.0", "generator": concat!("canopy ", env!("CARGO_PKG_VERSION"))},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"name": "tree", "mesh": 0}],
        "meshes": [{"name": "tree", "primitives": primitives}],
        "materials": materials,
        "textures": textures,
        "samplers": [{}],
        "images": images,
        "accessors": writer.accessors,
        "bufferViews": writer.views,
        "buffers": [{"byteLength": writer.bytes.len()}],
    });
    let text = document.to_string().into_bytes();
    let header = gltf::binary::Header { magic: *b"glTF", version: 2, length: 0 };
    let glb = gltf::Glb { header, json: Cow::Owned(text), bin: Some(Cow::Owned(writer.bytes)) };
    glb.to_vec().expect("chunks in memory can be written")
}
