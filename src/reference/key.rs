//! What an estimate depends on, part by part, so that it is resumed with nothing else.

use bytemuck::NoUninit;

use super::Options;
use crate::bake::grove::Tree;
use crate::camera::Eye;
use crate::scene::{Albedo, Distribution, Scene, Sky, Texture};

/// Raised when the same scene gives other samples than before.
const VERSION: u32 = 1;

/// Named hashes of everything that an estimate depends on.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Key {
    parts: Vec<(String, String)>,
}

/// Bytes of what a part is made of.
#[derive(Default)]
struct Bytes(blake3::Hasher);

impl Bytes {
    fn put<T: NoUninit>(&mut self, values: &[T]) -> &mut Self {
        // With its length, so that no two lists run into each other.
        self.0.update(&(values.len() as u64).to_le_bytes());
        self.0.update(bytemuck::cast_slice(values));
        self
    }
}

impl Key {
    /// Adds a part.
    pub(super) fn note(&mut self, name: &str, content: &[u8]) {
        self.add(name.into(), |b| {
            b.put(content);
        });
    }

    fn add(&mut self, name: String, content: impl FnOnce(&mut Bytes)) {
        let mut bytes = Bytes::default();
        content(&mut bytes);
        self.parts.push((name, bytes.0.finalize().to_hex()[..16].to_string()));
    }

    /// The key of a scene with these trees.
    pub(super) fn of_world(scene: &Scene, trees: &[Tree]) -> Self {
        let mut key = Key::default();
        key.note("the program's version of the reference", &VERSION.to_le_bytes());
        key.note("seed of the scene", &scene.seed.to_le_bytes());
        key.add("terrain".into(), |b| {
            let t = &scene.terrain;
            b.put(&t.extent).put(&[t.cell_size]);
            if let Some(r) = &t.heights {
                b.put(&[r.width, r.height]).put(&r.samples);
            }
            match &t.albedo {
                Albedo::Uniform(c) => b.put(c),
                Albedo::Image(i) => b.put(&[i.width, i.height]).put(&i.rgba),
            };
        });
        for s in &scene.species {
            key.add(format!("model of species \"{}\"", s.name), |b| {
                b.put(&s.mesh.positions).put(&s.mesh.uvs);
                for t in &s.mesh.triangles {
                    b.put(&t.vertices).put(&[t.material]);
                }
                for m in &s.mesh.materials {
                    b.put(&[u8::from(m.foliage), u8::from(m.double_sided)]);
                    b.put(&m.base_color).put(m.alpha_cutoff.as_slice());
                    if let Some(t) = &m.texture {
                        b.put(&[t.width, t.height]).put(&t.rgba);
                    }
                    if let Some(t) = &m.transmission {
                        b.put(&[t.factor]).put(&t.color);
                        for texture in [&t.factor_texture, &t.color_texture] {
                            let (size, rgba) = Texture::content(texture);
                            b.put(&size).put(rgba);
                        }
                    }
                }
                let o = &s.optics;
                for c in [o.leaf_reflectance, o.leaf_transmittance, o.bark_reflectance] {
                    b.put(c.as_ref().map_or(&[][..], |c| &c[..]));
                }
            });
            key.add(format!("distribution of species \"{}\"", s.name), |b| {
                b.put(&s.scale);
                match &s.distribution {
                    Distribution::Density { map, max_density, between_heights, below_slope } => {
                        b.put(&[*max_density]).put(below_slope.as_slice());
                        b.put(between_heights.as_ref().map_or(&[][..], |h| &h[..]));
                        if let Some(m) = map {
                            b.put(&[m.width, m.height]).put(&m.samples);
                        }
                    }
                    Distribution::Positions(list) => {
                        for p in list.iter() {
                            b.put(&[p.x, p.y]).put(p.scale.as_slice()).put(p.rotation.as_slice());
                        }
                    }
                }
            });
        }
        key.add("sun".into(), |b| {
            b.put(&[scene.sun.azimuth, scene.sun.elevation]).put(&scene.sun.irradiance);
        });
        key.add("sky".into(), |b| {
            match &scene.sky {
                Sky::Uniform(c) => b.put(c),
                Sky::LatLong { width, height, pixels } => b.put(&[*width, *height]).put(pixels),
            };
        });
        key.add("trees around what is seen".into(), |b| {
            for t in trees {
                b.put(&t.base.to_array()).put(&[t.scale, t.turn[0], t.turn[1], t.tint]).put(&[t.species]);
            }
        });
        key
    }

    /// The key of an image of a world.
    pub(super) fn with(&self, eye: &Eye, options: &Options) -> Self {
        let mut key = self.clone();
        key.add("camera".into(), |b| {
            b.put(&eye.position).put(&eye.forward).put(&eye.right).put(&eye.up).put(&eye.tangents);
        });
        key.note("size of the image", bytemuck::cast_slice(&eye.size));
        key.note("light", options.light.name().as_bytes());
        key.note("number of bounces", &options.bounces.unwrap_or(u32::MAX).to_le_bytes());
        key.note("seed of the samples", &options.seed.to_le_bytes());
        key
    }

    /// BLAKE3 of all parts, in hexadecimal.
    pub fn digest(&self) -> String {
        let mut all = blake3::Hasher::new();
        for (name, hash) in &self.parts {
            all.update(name.as_bytes()).update(b"\0").update(hash.as_bytes());
        }
        all.finalize().to_hex().to_string()
    }

    /// Names of the parts that differ.
    pub fn differences(&self, other: &Key) -> Vec<String> {
        let lacks = |a: &Key, part: &(String, String)| !a.parts.contains(part);
        let names = |a: &Key, b: &Key| -> Vec<String> {
            a.parts.iter().filter(|p| lacks(b, p)).map(|p| p.0.clone()).collect()
        };
        let mut all = names(self, other);
        all.extend(names(other, self).into_iter().filter(|n| !all.contains(n)).collect::<Vec<_>>());
        all
    }
}
