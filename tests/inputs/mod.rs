//! What the tests of inputs share.
// Each test program uses some of these.
#![allow(dead_code)]

use std::path::{Path, PathBuf};

use canopy::scene::Mesh;

/// A file in tests/data.
pub fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

/// The message of an error that is the user's to mend.
pub fn message<T>(result: canopy::Result<T>) -> String {
    let error = result.err().expect("this must be refused");
    assert_eq!(error.exit_code(), 2, "{error}");
    error.to_string()
}

/// The promises of [`Mesh`].
pub fn assert_valid(mesh: &Mesh) {
    assert!(!mesh.triangles.is_empty());
    assert_eq!((mesh.positions.len(), mesh.positions.len()), (mesh.normals.len(), mesh.uvs.len()));
    assert!(mesh.positions.iter().flatten().chain(mesh.uvs.iter().flatten()).all(|v| v.is_finite()));
    for n in &mesh.normals {
        assert!((glam::Vec3::from(*n).length() - 1.0).abs() < 1e-4, "{n:?}");
    }
    for t in &mesh.triangles {
        assert!((t.material as usize) < mesh.materials.len());
        let [a, b, c] = t.vertices.map(|i| glam::Vec3::from(mesh.positions[i as usize]).as_dvec3());
        assert!((b - a).cross(c - a).length() > 0.0);
    }
    for texture in mesh.materials.iter().filter_map(|m| m.texture.as_ref()) {
        assert_eq!(texture.rgba.len(), texture.width as usize * texture.height as usize * 4);
    }
}

/// An empty RGBA image.
pub fn png(width: u32, height: u32) -> Vec<u8> {
    let mut out = std::io::Cursor::new(Vec::new());
    image::RgbaImage::new(width, height).write_to(&mut out, image::ImageFormat::Png).unwrap();
    out.into_inner()
}

/// A PNG whose header announces more pixels than anyone reads, with the right checksum and nothing behind it.
pub fn huge_png() -> Vec<u8> {
    hollow_png(60000)
}

/// A PNG whose header announces so many pixels a side, with the right checksum and nothing behind it.
pub fn hollow_png(side: u32) -> Vec<u8> {
    let mut out = b"\x89PNG\r\n\x1a\n\0\0\0\x0d".to_vec();
    let mut header = b"IHDR".to_vec();
    header.extend(side.to_be_bytes());
    header.extend(side.to_be_bytes());
    header.extend([8, 0, 0, 0, 0]);
    let crc = header.iter().fold(!0u32, |crc, b| {
        (0..8).fold(crc ^ u32::from(*b), |c, _| if c & 1 == 1 { (c >> 1) ^ 0xedb8_8320 } else { c >> 1 })
    });
    out.extend(&header);
    out.extend((!crc).to_be_bytes());
    out.extend(b"\0\0\0\0IDAT\x35\xaf\x06\x1e");
    out
}

/// Copies of a file with one to four bytes changed, the same every time.
pub fn damaged(whole: &[u8], count: usize) -> impl Iterator<Item = Vec<u8>> {
    let mut state = 1u64;
    let mut random = move |n: usize| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % n
    };
    (0..count).map(move |_| {
        let mut bytes = whole.to_vec();
        for _ in 0..1 + random(4) {
            let at = random(bytes.len());
            bytes[at] = match random(3) {
                0 => random(256) as u8,
                1 => bytes[at] ^ (1 << random(8)),
                // Digits keep a text whole and make its numbers wrong.
                _ => b'0' + random(10) as u8,
            };
        }
        bytes
    })
}
