//! Tree models from glTF 2.0, `.glb` and `.gltf`.
//!
//! The default scene's nodes are walked and their transforms applied; triangles, strips and fans become one list.
//! glTF's y-up metres become z-up: (x, y, z) → (x, −z, y). Vertex colours, skins, morph targets and animations are
//! left out: a tree is drawn as it stands.

mod accessors;
mod buffers;
mod materials;
mod transmission;

use std::collections::HashMap;
use std::path::Path;

use glam::{DMat3, DMat4, DVec3, Vec3};
use gltf::mesh::Mode;

use self::buffers::Buffers;
use self::materials::Materials;
use super::mesh::{Mesh, Triangle};
use crate::input::read_bytes;
use crate::{Error, Result, tree};

/// Most vertices, and most triangles, of a model.
pub const MAX_ELEMENTS: usize = 16_000_000;

/// Largest coordinate of a model, m; beyond it the units are wrong.
const MAX_COORDINATE: f64 = 10_000.0;

const MAX_BYTES: u64 = 2 << 30;

/// Reads a model file. `foliage` names the materials that are leaves; without it, materials with alpha mode MASK or
/// BLEND and double-sided ones are.
///
/// Errors name the accessor, mesh, material or URI: truncated files, views and indices out of range, numbers that are
/// not finite, no triangles, missing buffers, URIs that leave the model's folder, unsupported formats, images that are
/// too large, names in `foliage` that no material has.
pub fn load_model(path: &Path, foliage: Option<&[String]>) -> Result<Mesh> {
    load_model_bytes(path, &read_bytes(path, MAX_BYTES)?, path.parent(), foliage)
}

/// Reads what a person names as a model: a file, or `builtin:` and a tree; scaled to a `height` in metres, if given.
///
/// Errors as [`load_model`], for an unknown tree, and for a height out of 0.01 to 1000 m.
pub fn load_named(name: &Path, height: Option<f64>) -> Result<Mesh> {
    let builtin = name.to_str().and_then(|n| n.strip_prefix("builtin:"));
    let mut mesh = match builtin {
        Some(tree) => load_model_bytes(name, &tree::glb(tree.parse()?, tree::BUILTIN_SEED), None, None)?,
        None => load_model(name, None)?,
    };
    if let Some(height) = height {
        if !(0.01..=1000.0).contains(&height) {
            return Err(Error::Usage(format!("a height of {height} m; it takes 0.01 to 1000")));
        }
        scale_to_height(&mut mesh, height, name)?;
    }
    Ok(mesh)
}

/// Reads a model from memory, as [`load_model`]; `name` is for messages, and relative URIs are looked up in `folder`.
pub fn load_model_bytes(
    name: &Path,
    bytes: &[u8],
    folder: Option<&Path>,
    foliage: Option<&[String]>,
) -> Result<Mesh> {
    let (document, buffers) = buffers::open(name, bytes, folder)?;
    let mut builder = Builder {
        name,
        buffers: &buffers,
        materials: Materials::new(name, &document, &buffers, foliage)?,
        mesh: Mesh::default(),
        vertices: 0,
        triangles: 0,
    };
    builder.walk(&document)?;
    let Builder { mut mesh, materials, .. } = builder;
    if mesh.triangles.is_empty() {
        let what = match mesh.dropped_triangles {
            0 => "the model has no triangles in its default scene".to_string(),
            n => format!("all {n} triangles of the model have no area"),
        };
        return Err(Error::input(name, "", what, "export the tree as triangles in the default scene"));
    }
    mesh.materials = materials.finish();
    Ok(mesh)
}

/// Scales a mesh uniformly so that its highest vertex is `height` metres above z = 0.
///
/// Errors if the mesh has nothing above its base; `name` is for the message.
pub fn scale_to_height(mesh: &mut Mesh, height: f64, name: &Path) -> Result<()> {
    let top = mesh.positions.iter().map(|p| p[2]).fold(f32::MIN, f32::max);
    if top <= 0.0 {
        let what = format!("the model's top is at {top} m, not above its base");
        return Err(Error::input(name, "", what, "put the trunk's base at the origin, with y up"));
    }
    let factor = height / f64::from(top);
    for p in &mut mesh.positions {
        *p = p.map(|c| (f64::from(c) * factor) as f32);
    }
    Ok(())
}

struct Builder<'a> {
    name: &'a Path,
    buffers: &'a Buffers,
    materials: Materials<'a>,
    mesh: Mesh,
    vertices: usize,
    triangles: usize,
}

impl<'a> Builder<'a> {
    fn error(&self, place: &str, what: impl Into<String>, remedy: &str) -> Error {
        Error::input(self.name, place, what, remedy)
    }

    fn walk(&mut self, document: &'a gltf::Document) -> Result<()> {
        let Some(scene) = document.default_scene().or_else(|| document.scenes().next()) else {
            return Err(self.error("scenes", "the file has no scene", "export the tree in a scene"));
        };
        let mut seen = vec![false; document.nodes().len()];
        let mut stack: Vec<_> = scene.nodes().map(|n| (n, DMat4::IDENTITY)).collect();
        // A stack pops the last first: reversed, nodes come in the order of the file.
        stack.reverse();
        while let Some((node, parent)) = stack.pop() {
            let place = format!("nodes[{}]", node.index());
            // glTF requires a strict tree; without this check a cycle would never end.
            if std::mem::replace(&mut seen[node.index()], true) {
                return Err(self.error(&place, "the node is reached twice", "make the nodes a tree"));
            }
            let local = DMat4::from_cols_array_2d(&node.transform().matrix().map(|c| c.map(f64::from)));
            let world = parent * local;
            if !world.is_finite() {
                return Err(self.error(
                    &place,
                    "the transform is not finite",
                    "correct the node's transform",
                ));
            }
            if let Some(mesh) = node.mesh() {
                for primitive in mesh.primitives() {
                    let place = format!("meshes[{}].primitives[{}]", mesh.index(), primitive.index());
                    self.primitive(&primitive, &world, &place)?;
                }
            }
            let from = stack.len();
            stack.extend(node.children().map(|c| (c, world)));
            stack[from..].reverse();
        }
        Ok(())
    }

    fn primitive(&mut self, primitive: &gltf::Primitive<'a>, world: &DMat4, place: &str) -> Result<()> {
        let mode = primitive.mode();
        if !matches!(mode, Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) {
            return Ok(());
        }
        let read = accessors::Reader { name: self.name, place, buffers: self.buffers };
        let Some(accessor) = primitive.get(&gltf::Semantic::Positions) else {
            return Err(self.error(place, "the primitive has no POSITION", "export vertex positions"));
        };
        let positions = read.positions(accessor)?;
        let uv_set = materials::uv_set(&primitive.material());
        let normals =
            primitive.get(&gltf::Semantic::Normals).map(|a| read.normals(a, positions.len())).transpose()?;
        let uvs = primitive.get(&gltf::Semantic::TexCoords(uv_set));
        let mut uvs = uvs.map(|a| read.uvs(a, positions.len())).transpose()?;
        if let Some(uvs) = &mut uvs {
            materials::transform_uv(&primitive.material(), uvs);
            if !uvs.iter().flatten().all(|c| c.is_finite()) {
                return Err(self.error(
                    place,
                    "KHR_texture_transform makes texture coordinates infinite",
                    "correct it",
                ));
            }
        }
        let indices = primitive.indices().map(|a| read.indices(a, positions.len())).transpose()?;
        let indices = indices.unwrap_or_else(|| (0..positions.len() as u32).collect());
        let corners = triangles(mode, &indices).ok_or_else(|| {
            self.error(
                place,
                format!("{} indices are no whole triangles", indices.len()),
                "export whole triangles",
            )
        })?;
        self.vertices += positions.len();
        self.triangles += corners.len();
        if self.vertices.max(self.triangles) > MAX_ELEMENTS {
            let what = format!("more than {MAX_ELEMENTS} vertices or triangles");
            return Err(self.error(place, what, "simplify the model"));
        }
        // Beyond the bounds of f32 the conversion gives infinity, which the next check refuses.
        let positions: Vec<Vec3> = positions
            .iter()
            .map(|p| z_up(world.transform_point3(Vec3::from(*p).as_dvec3())).as_vec3())
            .collect();
        if let Some(i) =
            positions.iter().position(|p| p.as_dvec3().abs().max_element() >= MAX_COORDINATE || p.is_nan())
        {
            let what = format!("vertex {i} is at {} m after the node's transform", positions[i]);
            return Err(self.error(place, what, "export the tree near the origin, in metres"));
        }
        let normals = normals.map(|n| transform_normals(&n, world));
        let mirrored = DMat3::from_mat4(*world).determinant() < 0.0;
        let material = self.materials.index(&primitive.material())?;
        self.append(&Part { positions, normals, uvs, corners, mirrored, material });
        Ok(())
    }

    /// Adds a part's triangles that have area, and the vertices they use.
    fn append(&mut self, part: &Part) {
        let mut kept = Vec::with_capacity(part.corners.len());
        let mut summed = vec![Vec3::ZERO; part.positions.len()];
        for corners in &part.corners {
            let mut v = corners.map(|i| i as usize);
            if part.mirrored {
                v.swap(1, 2);
            }
            let [a, b, c] = v.map(|i| part.positions[i].as_dvec3());
            let cross = (b - a).cross(c - a);
            let longest =
                (b - a).length_squared().max((c - a).length_squared()).max((c - b).length_squared());
            // Relative to the triangle: rounding leaves collinear corners a speck of area.
            if cross.length() <= 1e-9 * longest {
                self.mesh.dropped_triangles += 1;
                continue;
            }
            // Scaled by the size first: tiny areas would vanish in f32.
            let weighted = (cross / longest).as_vec3();
            for i in v {
                summed[i] += weighted;
            }
            kept.push(v);
        }
        let mut renumbered = HashMap::new();
        for v in kept {
            let vertices = v.map(|i| {
                *renumbered.entry(i).or_insert_with(|| {
                    let given = part.normals.as_ref().map(|n| n[i]).filter(|n| *n != Vec3::ZERO);
                    let normal = given.unwrap_or_else(|| summed[i].normalize_or(Vec3::Z));
                    self.mesh.positions.push(part.positions[i].to_array());
                    self.mesh.normals.push(normal.to_array());
                    self.mesh.uvs.push(part.uvs.as_ref().map_or([0.0; 2], |u| u[i]));
                    self.mesh.positions.len() as u32 - 1
                })
            });
            self.mesh.triangles.push(Triangle { vertices, material: part.material });
        }
    }
}

struct Part {
    positions: Vec<Vec3>,
    /// Unit, or zero where the file has none.
    normals: Option<Vec<Vec3>>,
    uvs: Option<Vec<[f32; 2]>>,
    corners: Vec<[u32; 3]>,
    mirrored: bool,
    material: u32,
}

fn z_up(v: DVec3) -> DVec3 {
    DVec3::new(v.x, -v.z, v.y)
}

/// Normals go with the cofactor matrix, the inverse transpose times the determinant, which exists for every matrix.
fn transform_normals(normals: &[[f32; 3]], world: &DMat4) -> Vec<Vec3> {
    let m = DMat3::from_mat4(*world);
    let [a, b, c] = [m.x_axis, m.y_axis, m.z_axis];
    let sign = if m.determinant() < 0.0 { -1.0 } else { 1.0 };
    let cofactor = DMat3::from_cols(b.cross(c), c.cross(a), a.cross(b)) * sign;
    normals
        .iter()
        .map(|n| {
            z_up(cofactor * Vec3::from(*n).as_dvec3()).try_normalize().map_or(Vec3::ZERO, |n| n.as_vec3())
        })
        .collect()
}

/// The corners of each triangle (glTF 2.0, 3.7.2.1); `None` if the indices make no whole triangles.
fn triangles(mode: Mode, indices: &[u32]) -> Option<Vec<[u32; 3]>> {
    match mode {
        Mode::Triangles => {
            let (triples, rest) = indices.as_chunks::<3>();
            rest.is_empty().then(|| triples.to_vec())
        }
        _ if indices.len() < 3 => None,
        // Every other triangle of a strip has its winding turned.
        Mode::TriangleStrip => Some(
            (0..indices.len() - 2)
                .map(|i| [indices[i], indices[i + 1 + i % 2], indices[i + 2 - i % 2]])
                .collect(),
        ),
        _ => Some(indices[1..].windows(2).map(|w| [w[0], w[1], indices[0]]).collect()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_and_fans_keep_their_winding() {
        let strip = triangles(Mode::TriangleStrip, &[0, 1, 2, 3]).unwrap();
        assert_eq!(strip, [[0, 1, 2], [1, 3, 2]]);
        assert_eq!(triangles(Mode::TriangleFan, &[0, 1, 2, 3]).unwrap(), [[1, 2, 0], [2, 3, 0]]);
        assert_eq!(triangles(Mode::Triangles, &[0, 1, 2, 3]), None);
        assert_eq!(triangles(Mode::TriangleFan, &[0, 1]), None);
    }

    #[test]
    fn normals_stay_perpendicular_under_stretching_and_mirroring() {
        let m = DMat4::from_scale(DVec3::new(-2.0, 1.0, 1.0));
        // A plane x + y = 0 is stretched to x/-2 + y = 0: its normal is (-1/2, 1, 0), in glTF axes.
        let n = transform_normals(&[[1.0, 1.0, 0.0]], &m)[0];
        let expected = Vec3::new(-0.5, 0.0, 1.0).normalize();
        assert!((n - expected).length() < 1e-6, "{n}");
    }
}
