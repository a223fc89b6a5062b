//! Inputs shared by the tests of the bake: the real trees, and simple shapes.
#![allow(dead_code)] // Each test file uses its own part of this module.

use std::sync::Arc;

use canopy::scene::mesh::Triangle;
use canopy::scene::{Material, Mesh, Texture};

/// A tree of tests/data, z up.
pub fn real_tree(name: &str) -> Mesh {
    let path = format!("{}/tests/data/{name}.glb", env!("CARGO_MANIFEST_DIR"));
    let glb = gltf::Gltf::open(path).unwrap();
    let blob = glb.blob.as_deref().unwrap();
    let texture = |t: gltf::texture::Info| {
        let gltf::image::Source::View { view, .. } = t.texture().source().source() else {
            panic!("embedded")
        };
        let bytes = &blob[view.offset()..view.offset() + view.length()];
        let image = image::load_from_memory(bytes).unwrap().to_rgba8();
        Arc::new(Texture { width: image.width(), height: image.height(), rgba: image.into_raw() })
    };
    let materials = glb.materials().map(|m| {
        let pbr = m.pbr_metallic_roughness();
        let name = m.name().unwrap().to_string();
        Material {
            foliage: name == "leaf",
            name,
            base_color: pbr.base_color_factor(),
            texture: pbr.base_color_texture().map(texture),
            alpha_cutoff: (m.alpha_mode() == gltf::material::AlphaMode::Mask)
                .then(|| m.alpha_cutoff().unwrap_or(0.5)),
            double_sided: m.double_sided(),
            transmission: None,
        }
    });
    let mut mesh = Mesh { materials: materials.collect(), ..Mesh::default() };
    let up = |[x, y, z]: [f32; 3]| [x, -z, y];
    for primitive in glb.meshes().flat_map(|m| m.primitives()) {
        let reader = primitive.reader(|_| Some(blob));
        let base = mesh.positions.len() as u32;
        mesh.positions.extend(reader.read_positions().unwrap().map(up));
        mesh.normals.extend(reader.read_normals().unwrap().map(up));
        mesh.uvs.extend(reader.read_tex_coords(0).unwrap().into_f32());
        let indices: Vec<u32> = reader.read_indices().unwrap().into_u32().map(|i| base + i).collect();
        let material = primitive.material().index().unwrap() as u32;
        for v in indices.chunks_exact(3) {
            mesh.triangles.push(Triangle { vertices: [v[0], v[1], v[2]], material });
        }
    }
    mesh
}

/// A material without texture.
pub fn material(foliage: bool) -> Material {
    Material {
        name: if foliage { "leaf" } else { "bark" }.into(),
        foliage,
        base_color: [0.4, 0.5, 0.2, 1.0],
        texture: None,
        alpha_cutoff: None,
        double_sided: foliage,
        transmission: None,
    }
}

/// Adds a flat triangle; its texture coordinates are the unit triangle's.
pub fn push_triangle(mesh: &mut Mesh, p: [[f32; 3]; 3], uv: [[f32; 2]; 3], material: u32) {
    let base = mesh.positions.len() as u32;
    mesh.positions.extend(p);
    mesh.normals.extend([[0.0, 0.0, 1.0]; 3]);
    mesh.uvs.extend(uv);
    mesh.triangles.push(Triangle { vertices: [base, base + 1, base + 2], material });
}

/// An ellipsoid of radii a (horizontal) and c (vertical) standing on the ground, of 4·n² triangles.
pub fn ellipsoid(a: f32, c: f32, n: u32) -> Mesh {
    let mut mesh = Mesh { materials: vec![material(true)], ..Mesh::default() };
    let point = |i: u32, j: u32| {
        let (st, ct) = (std::f32::consts::PI * i as f32 / n as f32).sin_cos();
        let (sa, ca) = (std::f32::consts::PI * (j % (2 * n)) as f32 / n as f32).sin_cos();
        [a * st * ca, a * st * sa, c + c * ct]
    };
    for i in 0..n {
        for j in 0..2 * n {
            let (p, q, r, s) = (point(i, j), point(i + 1, j), point(i + 1, j + 1), point(i, j + 1));
            let uv = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
            if i + 1 < n {
                push_triangle(&mut mesh, [p, q, r], uv, 0);
            }
            if i > 0 {
                push_triangle(&mut mesh, [p, r, s], uv, 0);
            }
        }
    }
    mesh
}
