//! glTF as users hand it in: every mistake is one clear error, never a panic; good models arrive whole.

mod inputs;

use std::path::Path;
use std::time::{Duration, Instant};

use canopy::scene::Mesh;
use canopy::scene::model::{load_model, load_model_bytes};
use inputs::{assert_valid, damaged, data, huge_png, message, png};
use serde_json::{Value, json};

fn leaves(mesh: &Mesh, foliage: bool) -> usize {
    mesh.triangles.iter().filter(|t| mesh.materials[t.material as usize].foliage == foliage).count()
}

#[test]
fn real_trees_load_with_their_counts() {
    for (name, bark, cards, dropped, height, cutoff) in
        [("oak.glb", 3166, 5320, 0, 15.0, 0.5), ("pine.glb", 10032, 4920, 8, 20.0f32, 0.3)]
    {
        let mesh = load_model(&data(name), None).unwrap();
        assert_valid(&mesh);
        assert_eq!(leaves(&mesh, false) + mesh.dropped_triangles as usize, bark, "{name}");
        assert_eq!(leaves(&mesh, true), 2 * cards, "{name}");
        assert_eq!(mesh.dropped_triangles, dropped, "{name}");
        let top = mesh.positions.iter().map(|p| p[2]).fold(f32::MIN, f32::max);
        assert!((top - height).abs() < 0.1, "{name} is {top} m tall");
        let leaf = mesh.materials.iter().find(|m| m.name == "leaf").unwrap();
        assert!(
            leaf.foliage && leaf.double_sided && leaf.alpha_cutoff == Some(cutoff) && leaf.texture.is_some()
        );
        assert!(!mesh.materials.iter().find(|m| m.name == "bark").unwrap().foliage);
    }
}

#[test]
fn foliage_can_be_named() {
    let mesh = load_model(&data("oak.glb"), Some(&["bark".to_string()])).unwrap();
    assert_eq!(leaves(&mesh, true), 3166);
    let error = message(load_model(&data("oak.glb"), Some(&["leef".to_string()])));
    assert!(error.contains("\"leef\"") && error.contains("\"leaf\"?"), "{error}");
}

fn glb(document: &Value, bin: &[u8]) -> Vec<u8> {
    let mut text = document.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut out = b"glTF\x02\0\0\0".to_vec();
    out.extend((12 + 8 + text.len() as u32 + 8 + bin.len() as u32).to_le_bytes());
    out.extend((text.len() as u32).to_le_bytes());
    out.extend(b"JSON");
    out.extend(&text);
    out.extend((bin.len() as u32).to_le_bytes());
    out.extend(b"BIN\0");
    out.extend(bin);
    out
}

/// A square of two triangles, glTF y up, 2 m tall, with every attribute: views 0 positions, 1 normals, 2 uvs,
/// 3 indices (u16), 4 image.
fn square() -> (Value, Vec<u8>) {
    let floats = |v: &[f32]| v.iter().flat_map(|f| f.to_le_bytes()).collect::<Vec<_>>();
    let parts = [
        floats(&[0., 0., 1., 1., 0., 1., 1., 2., 1., 0., 2., 1.]),
        floats(&[0., 0., 1., 0., 0., 1., 0., 0., 1., 0., 0., 1.]),
        floats(&[0., 1., 1., 1., 1., 0., 0., 0.]),
        [0u16, 1, 2, 0, 2, 3].iter().flat_map(|i| i.to_le_bytes()).collect(),
        png(2, 2),
    ];
    let (mut bin, mut views) = (Vec::new(), Vec::new());
    for part in parts {
        views.push(json!({"buffer": 0, "byteOffset": bin.len(), "byteLength": part.len()}));
        bin.extend(part);
        bin.resize(bin.len().next_multiple_of(4), 0);
    }
    let document = json!({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [
            {"attributes": {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2}, "indices": 3, "material": 0}]}],
        "materials": [{"name": "leaf", "alphaMode": "MASK",
            "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        "textures": [{"source": 0}], "images": [{"bufferView": 4, "mimeType": "image/png"}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0, 0, 1], "max": [1, 2, 1]},
            {"bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC3"},
            {"bufferView": 2, "componentType": 5126, "count": 4, "type": "VEC2"},
            {"bufferView": 3, "componentType": 5123, "count": 6, "type": "SCALAR"}],
        "bufferViews": views, "buffers": [{"byteLength": bin.len()}],
    });
    (document, bin)
}

fn read(bytes: &[u8]) -> canopy::Result<Mesh> {
    load_model_bytes(Path::new("square.glb"), bytes, None, None)
}

/// The square after a change to its document or binary.
fn changed(change: impl Fn(&mut Value, &mut Vec<u8>)) -> Vec<u8> {
    let (mut document, mut bin) = square();
    change(&mut document, &mut bin);
    glb(&document, &bin)
}

#[test]
fn axes_and_transforms() {
    let (document, bin) = square();
    let mesh = read(&glb(&document, &bin)).unwrap();
    assert_valid(&mesh);
    // glTF (x, y, z) becomes (x, -z, y): the square at z = 1 facing z is at y = -1 facing -y, its height up.
    assert_eq!(mesh.positions, [[0., -1., 0.], [1., -1., 0.], [1., -1., 2.], [0., -1., 2.]]);
    assert_eq!(mesh.normals, [[0., -1., 0.]; 4]);
    assert_eq!(mesh.uvs[2], [1., 0.]);
    // Nested nodes: a scale of -1 along x in a parent moved by 10 along glTF's y.
    let bytes = changed(|d, _| {
        d["nodes"] = json!([{"children": [1], "translation": [0, 10, 0]}, {"mesh": 0, "scale": [-1, 1, 1]}]);
        d["meshes"][0]["primitives"][0]["attributes"].as_object_mut().unwrap().remove("NORMAL");
    });
    let mesh = read(&bytes).unwrap();
    assert_valid(&mesh);
    assert!(mesh.positions.contains(&[-1., -1., 12.]));
    // Mirrored, the winding turns too: the computed normals still face -y.
    assert!(mesh.normals.iter().all(|n| n[1] < -0.99), "{:?}", mesh.normals);
}

#[test]
fn texture_transforms_are_applied() {
    let bytes = changed(|d, _| {
        d["extensionsUsed"] = json!(["KHR_texture_transform"]);
        let quarter = std::f32::consts::FRAC_PI_2;
        d["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["extensions"] =
            json!({"KHR_texture_transform": {"offset": [10, 20], "rotation": quarter, "scale": [2, 3]}});
    });
    // (0, 1), (1, 1), (1, 0) and (0, 0) are scaled, turned by a quarter (u, v) -> (v, -u), and shifted.
    let wanted = [[13.0, 20.0], [13.0, 18.0], [10.0, 18.0], [10.0, 20.0]];
    for (uv, wanted) in read(&bytes).unwrap().uvs.iter().zip(wanted) {
        assert!((0..2).all(|i| (uv[i] - wanted[i]).abs() < 1e-5f32), "{uv:?}, not {wanted:?}");
    }
}

/// What goes through leaves, from the extension, required or not; what cannot be meant is refused.
#[test]
fn diffuse_transmission_is_read() {
    let with = |value: Value| {
        changed(|d, _| {
            d["extensionsRequired"] = json!(["KHR_materials_diffuse_transmission"]);
            d["materials"][0]["extensions"] = json!({"KHR_materials_diffuse_transmission": value});
        })
    };
    let mesh = read(&with(json!({
        "diffuseTransmissionFactor": 0.25, "diffuseTransmissionColorFactor": [0.4, 0.8, 0.2],
        "diffuseTransmissionColorTexture": {"index": 0}})))
    .unwrap();
    let t = mesh.materials[0].transmission.as_ref().unwrap();
    assert_eq!((t.factor, t.color), (0.25, [0.4, 0.8, 0.2]));
    assert!(t.factor_texture.is_none());
    assert_eq!(t.color_texture.as_ref().unwrap().width, 2);
    let defaults = read(&with(json!({}))).unwrap();
    let t = defaults.materials[0].transmission.as_ref().unwrap();
    assert_eq!((t.factor, t.color), (0.0, [1.0; 3]));
    assert!(read(&changed(|_, _| ())).unwrap().materials[0].transmission.is_none());
    for (what, value) in [
        ("a factor is 2, not 0 to 1", json!({"diffuseTransmissionFactor": 2.0})),
        ("textures[9] is not there", json!({"diffuseTransmissionTexture": {"index": 9}})),
        ("other texture coordinates", json!({"diffuseTransmissionTexture": {"index": 0, "texCoord": 1}})),
        ("invalid type", json!({"diffuseTransmissionFactor": "half"})),
    ] {
        let e = read(&with(value)).unwrap_err().to_string();
        assert!(e.contains(what) && e.contains("material \"leaf\""), "{e}");
    }
}

#[test]
fn other_layouts_load() {
    for (what, change) in [
        (
            "u8 indices",
            (|d: &mut Value, b: &mut Vec<u8>| {
                let at = d["bufferViews"][3]["byteOffset"].as_u64().unwrap() as usize;
                b[at..at + 6].copy_from_slice(&[0, 1, 2, 0, 2, 3]);
                d["accessors"][3]["componentType"] = json!(5121);
            }) as fn(&mut Value, &mut Vec<u8>),
        ),
        ("fan without indices", |d, _| {
            d["meshes"][0]["primitives"][0].as_object_mut().unwrap().remove("indices");
            d["meshes"][0]["primitives"][0]["mode"] = json!(6);
        }),
        ("no normals, no uvs, no material", |d, _| {
            d["meshes"][0]["primitives"][0] = json!({"attributes": {"POSITION": 0}, "indices": 3});
        }),
        ("sparse positions", |d, _| {
            let value = json!({"count": 1, "indices": {"bufferView": 3, "componentType": 5123},
                "values": {"bufferView": 0}});
            d["accessors"][0]["sparse"] = value;
        }),
        ("a buffer as a data URI", |d, b| {
            use base64::Engine;
            let text = base64::engine::general_purpose::STANDARD.encode(b);
            d["buffers"][0]["uri"] = json!(format!("data:application/octet-stream;base64,{text}"));
        }),
    ] {
        let mesh = read(&changed(change)).unwrap_or_else(|e| panic!("{what}: {e}"));
        assert_valid(&mesh);
        assert_eq!(mesh.triangles.len(), 2, "{what}");
    }
}

#[test]
fn wrong_models_are_refused_with_the_place() {
    type Change = fn(&mut Value, &mut Vec<u8>);
    let cases: &[(&str, Change)] = &[
        ("POSITION 1 is", |_, b| b[12..16].copy_from_slice(&f32::NAN.to_le_bytes())),
        ("POSITION 0 is", |_, b| b[0..4].copy_from_slice(&f32::INFINITY.to_le_bytes())),
        ("NORMAL 0 is", |_, b| b[48..52].copy_from_slice(&f32::NAN.to_le_bytes())),
        ("TEXCOORD 0 is", |_, b| b[96..100].copy_from_slice(&f32::NAN.to_le_bytes())),
        ("primitives[0], accessors[3]: index 5 is 4, but there are 4 vertices", |d, b| {
            let at = d["bufferViews"][3]["byteOffset"].as_u64().unwrap() as usize;
            b[at + 10] = 4;
        }),
        ("no whole triangles", |d, _| d["accessors"][3]["count"] = json!(5)),
        ("no triangles", |d, _| d["meshes"][0]["primitives"][0]["mode"] = json!(1)),
        ("have no area", |_, b| b[0..48].fill(0)),
        ("[\"POSITION\"]: Missing data", |d, _| {
            d["meshes"][0]["primitives"][0]["attributes"].as_object_mut().unwrap().remove("POSITION");
        }),
        ("accessors[0]: 5 items", |d, _| {
            d["accessors"][0]["count"] = json!(5);
        }),
        ("NORMAL has 3 entries", |d, _| d["accessors"][1]["count"] = json!(3)),
        ("accessors[0]", |d, _| d["accessors"][0]["byteOffset"] = json!(u64::MAX)),
        ("accessors[0]", |d, _| d["accessors"][0]["count"] = json!(u64::MAX)),
        ("accessors[0]", |d, _| d["accessors"][0]["count"] = json!(0)),
        ("accessors[0]", |d, _| d["bufferViews"][0]["byteStride"] = json!(4)),
        ("accessors[0]", |d, _| d["bufferViews"][0]["byteLength"] = json!(u64::MAX)),
        ("accessors[0]", |d, _| {
            d["accessors"][0].as_object_mut().unwrap().remove("bufferView");
        }),
        ("accessors[0]", |d, _| {
            d["accessors"][0]["sparse"] = json!({"count": 9, "indices": {"bufferView": 3, "componentType": 5123},
                "values": {"bufferView": 0}});
        }),
        // A few bytes that ask for gigabytes of zeros.
        ("no bufferView and only 1 of its 16000000 entries", |d, _| {
            d["accessors"][0].as_object_mut().unwrap().remove("bufferView");
            d["accessors"][0]["count"] = json!(16_000_000);
            d["accessors"][0]["sparse"] = json!({"count": 1, "indices": {"bufferView": 3, "componentType": 5123},
                "values": {"bufferView": 0}});
        }),
        ("KHR_mesh_quantization", |d, _| d["accessors"][0]["componentType"] = json!(5122)),
        ("indices", |d, _| d["accessors"][3]["componentType"] = json!(5126)),
        ("buffers[0]", |d, _| d["buffers"][0]["byteLength"] = json!(1_000_000)),
        ("buffers[1]", |d, _| d["buffers"] = json!([d["buffers"][0], {"byteLength": 4}])),
        ("nodes[0]: the node is reached twice", |d, _| d["nodes"] = json!([{"mesh": 0, "children": [0]}])),
        ("nodes[0]: the transform is not finite", |d, _| d["nodes"][0]["scale"] = json!([1e39, 1, 1])),
        ("after the node's transform", |d, _| d["nodes"][0]["scale"] = json!([1e30, 1, 1])),
        ("no scene", |d, _| {
            d.as_object_mut().unwrap().remove("scene");
            d["scenes"] = json!([]);
        }),
        ("images[0]", |d, _| {
            d["images"][0].as_object_mut().unwrap().remove("mimeType");
            d["images"][0].as_object_mut().unwrap().remove("bufferView");
        }),
        ("images[0]: bufferViews[4] leaves", |d, _| d["bufferViews"][4]["byteOffset"] = json!(100_000)),
        ("images[0]: the image is neither PNG nor JPEG", |d, _| d["images"][0]["bufferView"] = json!(0)),
        ("alpha cutoff is 2", |d, _| d["materials"][0]["alphaCutoff"] = json!(2.0)),
        ("base colour", |d, _| {
            d["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = json!([-1, 0, 0, 1]);
        }),
        ("Unsupported", |d, _| d["extensionsRequired"] = json!(["KHR_draco_mesh_compression"])),
        ("primitives[0]: POSITION is accessors[99]", |d, _| {
            d["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = json!(99);
        }),
    ];
    for (i, (wanted, change)) in cases.iter().enumerate() {
        let error = message(read(&changed(change)));
        assert!(error.contains(wanted) && error.starts_with("square.glb"), "case {i}, {wanted:?}: {error}");
        assert!(error.contains("remedy: "), "case {i}: {error}");
    }
    let huge = changed(|d, b| {
        d["bufferViews"][4] = json!({"buffer": 0, "byteOffset": b.len(), "byteLength": huge_png().len()});
        b.extend(huge_png());
        d["buffers"][0]["byteLength"] = json!(b.len());
    });
    let error = message(read(&huge));
    assert!(error.contains("images[0]: the image is 60000 × 60000"), "{error}");
}

#[test]
fn uris_stay_in_the_folder() {
    let outer = tempfile::tempdir().unwrap();
    let folder = outer.path().join("model");
    std::fs::create_dir_all(folder.join("sub")).unwrap();
    let (document, bin) = square();
    for name in ["secret.bin", "model/a b.bin", "model/sub/c.bin"] {
        std::fs::write(outer.path().join(name), &bin).unwrap();
    }
    #[cfg(unix)]
    std::os::unix::fs::symlink(outer.path().join("secret.bin"), folder.join("link.bin")).unwrap();
    let load = |uri: &str| {
        let mut document = document.clone();
        document["buffers"][0]["uri"] = json!(uri);
        std::fs::write(folder.join("m.gltf"), document.to_string()).unwrap();
        load_model(&folder.join("m.gltf"), None)
    };
    for uri in ["a%20b.bin", "./sub/c.bin"] {
        assert_eq!(load(uri).unwrap_or_else(|e| panic!("{uri}: {e}")).triangles.len(), 2);
    }
    let absolute = outer.path().join("secret.bin").display().to_string();
    for uri in [
        "../secret.bin",
        "sub/../../secret.bin",
        "%2e%2e/secret.bin",
        "..%2fsecret.bin",
        "..\\secret.bin",
        absolute.as_str(),
        "file:///secret.bin",
        "https://example.com/a.bin",
        "C:/secret.bin",
        "%00",
        "%ff.bin",
        "",
        "link.bin",
        "none.bin",
        "sub",
        "data:application/octet-stream;base64,???",
        "data:text/plain,abc",
    ] {
        let error = message(load(uri));
        assert!(uri == "sub" || error.contains("buffers[0]"), "{uri}: {error}");
    }
    // A model from memory has no folder.
    let mut document = document.clone();
    document["buffers"][0]["uri"] = json!("a.bin");
    assert!(message(read(document.to_string().as_bytes())).contains("not in a folder"));
}

#[test]
fn truncated_and_damaged_models_never_panic() {
    let (document, bin) = square();
    let whole = glb(&document, &bin);
    let start = Instant::now();
    for length in 0..whole.len() {
        message(read(&whole[..length]));
        // A length field that agrees gets further.
        let mut bytes = whole[..length].to_vec();
        if let Some(field) = bytes.get_mut(8..12) {
            field.copy_from_slice(&(length as u32).to_le_bytes());
            assert!(read(&bytes).is_err());
        }
    }
    let (mut good, mut bad) = (0, 0);
    for bytes in damaged(&whole, 6000) {
        match read(&bytes) {
            Ok(mesh) => {
                assert_valid(&mesh);
                good += 1;
            }
            Err(error) => {
                assert_eq!(error.exit_code(), 2);
                bad += 1;
            }
        }
    }
    assert!(good > 200 && bad > 200, "{good} read, {bad} refused: the damage is too mild or too strong");
    assert!(start.elapsed() < Duration::from_secs(60), "{:?}", start.elapsed());
}
