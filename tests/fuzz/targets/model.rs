//! glTF models, binary and text, with everything embedded.
#![no_main]

mod common;

use std::path::Path;

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let read = canopy::scene::model::load_model_bytes(Path::new("fuzzed.glb"), bytes, None, None);
    let Some(mesh) = common::settled(read) else { return };
    assert!(!mesh.triangles.is_empty());
    assert_eq!((mesh.positions.len(), mesh.positions.len()), (mesh.normals.len(), mesh.uvs.len()));
    assert!(mesh.positions.iter().flatten().chain(mesh.uvs.iter().flatten()).all(|v| v.is_finite()));
    assert!(mesh.normals.iter().flatten().all(|v| v.is_finite()));
    for t in &mesh.triangles {
        assert!((t.material as usize) < mesh.materials.len());
        assert!(t.vertices.iter().all(|v| (*v as usize) < mesh.positions.len()));
    }
    for texture in mesh.materials.iter().filter_map(|m| m.texture.as_ref()) {
        assert_eq!(texture.rgba.len(), texture.width as usize * texture.height as usize * 4);
    }
});
