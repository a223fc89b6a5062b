//! Models of the species as meshes on the GPU: corners, faces, their levels of detail, the crowns around leaves, holes, and what their surfaces
//! reflect.

use glam::Vec2;
use half::f16;

use crate::bake::Baked;
use crate::bake::envelope::Envelopes;
use crate::bake::harmonics::Harmonics;
use crate::bake::harmonics::seen::Corrections;
use crate::bake::levels::Levels;
use crate::bake::surface::{Face, Mask, Surface};
use crate::bake::turning::{Turning, packed_place, turning};
use crate::forest::hidden_sky::HiddenSky;
use crate::forest::species::optics_block;
use crate::gpu::interface::{
    BARK_LEVELS, BARK_PIXELS, FADE_BAND, HIDING_STEPS, LEAF_OCTAVES, LEAST_SHARE, MESH_TRIANGLES, MeshFace,
    MeshKind, NO_PAGE,
};
use crate::gpu::{Buffer, Gpu, Image, ImageDesc, vk};
use crate::physics::leaf::Directions;
use crate::physics::levels::{self, OCTAVES};
use crate::plan::names::resource;
use crate::plan::{FACE_TRANSFER_WORDS, Plan, envelope_words};
use crate::scene::{Scene, Species};
use crate::{Error, Result};

const _: () = assert!(LEAF_OCTAVES as usize == OCTAVES && BARK_LEVELS as usize == levels::BARK_LEVELS);
const _: () = assert!(LEAST_SHARE == levels::LEAST_SHARE as f32 && FADE_BAND == levels::FADE_BAND as f32);
const _: () = assert!(BARK_PIXELS == levels::BARK_PIXELS as f32);

/// Steps of texture coordinates along a texture; as `UV_STEPS` in `shaders/frame/trees/meshes/corner.glsl`.
const UV_STEPS: f32 = 2048.0;
/// Format and bytes of a texel of what trees hide.
const PAIR: (vk::Format, u64) = (vk::Format::R32G32_SFLOAT, 8);
/// Most directions of an envelope.
const MOST_DIRECTIONS: usize = 26;

/// What meshes are drawn from.
pub struct MeshData {
    /// Corners of all triangles, species after species.
    pub corners: Buffer,
    /// [`MeshFace`]s of all triangles.
    pub faces: Buffer,
    /// Optical thickness of the crown around each triangle, or how light comes to it as spherical harmonics.
    pub envelopes: Buffer,
    /// Where materials are holes, one a layer.
    pub masks: Image,
    /// [`MeshKind`]s of the species; how many trees are of each is each frame's.
    pub kinds: Buffer,
    /// Indices of corners, in the orders in which they are drawn.
    pub indices: Buffer,
    /// [`crate::gpu::interface::MeshTree`]s in view, species after species.
    pub trees: Buffer,
    /// [`crate::gpu::interface::DrawCommand`]s of these, [`crate::gpu::interface::MESH_DRAWS`] each.
    pub draws: Buffer,
    /// How many of them there are.
    pub draw_count: Buffer,
    /// Directions of envelopes with their weights, and what of their cells is sky.
    pub rule: Buffer,
    /// What trees hide of the sky from neighbours: a step of height a texel, direction by direction.
    pub hiding: Buffer,
    /// Height to which those steps go, m.
    pub top: f32,
    /// Reflectance and transmittance of leaves, and reflectance of bark, of each species, and what harmonics leave out of the sun there.
    pub optics: Buffer,
    /// Number of species.
    pub species: u32,
    /// Power of the lobe by which directions count for those between them.
    pub power: u32,
}

/// What is known of light at the faces of a model.
enum FaceLight<'a> {
    /// The crown around them.
    Envelopes(&'a Envelopes),
    /// How light comes to them.
    Harmonics(&'a Harmonics),
}

impl FaceLight<'_> {
    /// At a face, in whole words of eight half floats: what its surroundings leave of light above and then below; or both of its sides'
    /// coefficients.
    fn of(&self, face: u32) -> Vec<f16> {
        let padded = |numbers: Vec<f64>, words: usize| {
            let halves = numbers.into_iter().map(f16::from_f64);
            halves.chain(std::iter::repeat(f16::ZERO)).take(8 * words).collect::<Vec<_>>()
        };
        match self {
            FaceLight::Envelopes(envelopes) => {
                let words = envelope_words(envelopes.directions as u32) as usize;
                envelopes.of(face).iter().flat_map(|thickness| padded(thickness.to_vec(), words)).collect()
            }
            FaceLight::Harmonics(harmonics) => {
                let both = harmonics.faces[face as usize].as_flattened();
                padded(both.iter().map(|x| f64::from(*x)).collect(), FACE_TRANSFER_WORDS as usize)
            }
        }
    }
}

/// What all meshes put together hold.
#[derive(Default)]
struct Content {
    corners: Vec<[u32; 4]>,
    faces: Vec<MeshFace>,
    envelopes: Vec<f16>,
    indices: Vec<u32>,
    kinds: Vec<MeshKind>,
    /// Triangles of the models themselves so far.
    names: u32,
    masks: Vec<Mask>,
}

impl MeshData {
    /// Uploads the models of a plan with meshes.
    ///
    /// # Errors
    /// [`Error::Usage`] for bakes without envelopes, and for models of more triangles than a sample's word can name;
    /// [`Error::Device`] when out of memory.
    pub fn new(gpu: &Gpu, scene: &Scene, plan: &Plan, baked: &[Baked]) -> Result<Self> {
        let rule = Directions::new(scene.settings.leaf_directions as usize)
            .ok_or_else(|| Error::Usage("leaf_directions is 8, 14 or 26".into()))?;
        let mut all = Content::default();
        for (species, bake) in scene.species.iter().zip(baked) {
            let light = if plan.mesh_harmonics {
                bake.harmonics.as_deref().map(FaceLight::Harmonics)
            } else {
                bake.envelopes.as_deref().filter(|e| e.directions == rule.len()).map(FaceLight::Envelopes)
            };
            let light = light.ok_or_else(|| {
                Error::Usage("a species was baked without what the plan lists of light at its leaves".into())
            })?;
            let levels = bake.levels.as_ref().ok_or_else(|| {
                Error::Usage("a species was baked without the levels of detail that the plan lists".into())
            })?;
            all.add(species, &light, levels, plan.wind)?;
        }
        let (pairs, top) = match plan.mesh_harmonics {
            true => (Vec::new(), 1.0),
            false => hiding_pairs(scene, baked, rule.len()),
        };
        let texels = |name, bytes: &[u8]| -> Result<Buffer> {
            // Faces that are nowhere to be seen are in the plan, and not here.
            let described = plan.buffer(name);
            let mut content = bytes.to_vec();
            content.resize(described.bytes as usize, 0);
            gpu.described_buffer_with(&described, &content)
        };
        Ok(MeshData {
            corners: texels(resource::MESH_CORNERS, bytemuck::cast_slice(&all.corners))?,
            faces: texels(resource::MESH_FACES, bytemuck::cast_slice(&all.faces))?,
            envelopes: texels(
                if plan.mesh_harmonics { resource::FACE_TRANSFERS } else { resource::ENVELOPES },
                bytemuck::cast_slice(&bits(&all.envelopes)),
            )?,
            masks: masks(gpu, plan, &all.masks)?,
            indices: texels(resource::MESH_INDICES, bytemuck::cast_slice(&all.indices))?,
            kinds: gpu.described_buffer_with(&plan.buffer(resource::MESH_KINDS), &all.kinds)?,
            draws: gpu.described_buffer(&plan.buffer(resource::MESH_DRAWS))?,
            draw_count: gpu.buffer("mesh draw count", 4)?,
            trees: gpu.described_buffer(&plan.buffer(resource::MESH_TREES))?,
            rule: gpu.buffer_with("leaf directions", &rule_block(&rule))?,
            hiding: match pairs.is_empty() {
                true => gpu.texel_buffer("no hidden sky", PAIR.1, PAIR)?,
                false => gpu.described_buffer_with(&plan.buffer(resource::HIDING), &pairs)?,
            },
            top: top as f32,
            optics: gpu.buffer_with("leaf optics", &optics_block(baked, seen))?,
            species: all.kinds.len() as u32,
            power: rule.power as u32,
        })
    }
}

/// What harmonics leave out of the sun on a species' mesh, where they light it: its one form.
fn seen(baked: &Baked) -> [Corrections; 2] {
    let one = baked.harmonics.as_ref().map(|h| h.seen).unwrap_or_default();
    [one, one]
}

impl Content {
    fn add(&mut self, species: &Species, light: &FaceLight, levels: &Levels, wind: bool) -> Result<()> {
        let mesh = &species.mesh;
        let surface = Surface::new(mesh)?;
        let count = surface.faces.len() + levels.extra();
        if count > MESH_TRIANGLES as usize {
            return Err(Error::Usage(format!(
                "species \"{}\" has {count} triangles with its levels of bark, and meshes of up to {MESH_TRIANGLES} are drawn: simplify the model, or use \
                 a ladder without mesh",
                species.name,
            )));
        }
        let any = mesh.materials.iter().any(|m| m.foliage);
        let (first_face, first_mask) = (self.faces.len() as u32, self.masks.len() as u32);
        let is_leaf = |f: &Face| !any || mesh.materials[f.material as usize].foliage;
        let turning = if wind { turning(&surface, is_leaf) } else { Vec::new() };
        for (k, face) in (0u32..).zip(&surface.faces) {
            let at = k as usize;
            let leaf = u32::from(is_leaf(face));
            // Triangles of a leaf that turns keep together: their middle is the leaf's, also where a level draws few of them.
            let card = packed_place(levels.cards.middle[at]);
            let [turns, middle] = turning.get(at).copied().flatten().map_or([0, card], Turning::packed);
            let kind = MeshFace {
                mask: face.mask.map_or(NO_PAGE, |m| first_mask + m),
                foliage: leaf | turns,
                rank: levels.cards.rank[at],
                middle,
            };
            self.push((&surface, face), kind, light.of(k));
        }
        let face_count = self.faces.len() as u32 - first_face;
        let mut kind = MeshKind {
            half_box: surface.frame.scale().to_array(),
            card_side: levels.cards.side as f32,
            first_face,
            face_count,
            first_name: self.names,
            first_whole: self.order(first_face, 0..face_count),
            first_leaf: self.order(first_face, levels.cards.order.iter().copied()),
            leaf_count: levels.cards.order.len() as u32,
            bark_levels: levels.bark.len() as u32,
            leaf_middle: (levels.cards.centre * surface.frame.scale()).to_array(),
            pull: levels.pull.map(|w| w as f32),
            ..bytemuck::Zeroable::zeroed()
        };
        self.names += face_count;
        for (level, bark) in levels.bark.iter().enumerate() {
            let first_new = self.faces.len() as u32 - first_face;
            for new in &bark.new {
                let none = MeshFace { mask: NO_PAGE, ..bytemuck::Zeroable::zeroed() };
                self.push((&surface, &new.face(&surface)), none, light.of(new.like));
            }
            let all = bark.kept.iter().copied().chain((first_new..).take(bark.new.len()));
            kind.first_bark[level] = self.order(first_face, all);
            kind.bark_count[level] = (bark.kept.len() + bark.new.len()) as u32;
            // No less than it is.
            kind.bark_error[level] = (bark.error as f32).next_up();
        }
        self.kinds.push(kind);
        self.masks.extend(surface.masks);
        Ok(())
    }

    /// A triangle, and what is known of light at it.
    fn push(&mut self, (surface, face): (&Surface, &Face), kind: MeshFace, light: Vec<f16>) {
        self.corners.extend(corners(surface, face));
        self.faces.push(kind);
        self.envelopes.extend(light);
    }

    /// Indices of a model's triangles in an order, and the first of them.
    fn order(&mut self, first_face: u32, triangles: impl Iterator<Item = u32>) -> u32 {
        let first = self.indices.len() as u32;
        self.indices.extend(triangles.flat_map(|k| [0, 1, 2].map(|corner| 3 * (first_face + k) + corner)));
        first
    }
}

/// A face's corners: places from the middle of the tree's box, m, and texture coordinates.
fn corners(surface: &Surface, face: &Face) -> [[u32; 4]; 3] {
    std::array::from_fn(|k| {
        let [x, y, z] = (face.p[k] * surface.frame.scale()).to_array().map(f32::to_bits);
        // They are small: what has more textures along a triangle than there is room for stays within.
        let [u, v] = (face.uv[k] * UV_STEPS).to_array().map(|c| c.round().clamp(0.0, 65535.0) as u32);
        [x, y, z, u | v << 16]
    })
}

fn bits(halves: &[f16]) -> Vec<u16> {
    halves.iter().map(|h| h.to_bits()).collect()
}

/// Directions as the shader takes them: each with its weight, and how a surface faces what of its cell of the sphere is sky.
fn rule_block(rule: &Directions) -> Vec<[f32; 4]> {
    let mut block = Vec::new();
    for ((to, weight), sky) in rule.to.iter().zip(&rule.weights).zip(rule.half(true)) {
        block.push([to[0], to[1], to[2], *weight].map(|x| x as f32));
        block.push([sky[0], sky[1], sky[2], 0.0].map(|x| x as f32));
    }
    block.resize(2 * MOST_DIRECTIONS, [0.0; 4]);
    block
}

/// What the scene's trees hide of the sky at heights above the ground, evenly to the top of the tallest of middle scale: of each direction, pairs of
/// what it is at a step and how much more at the next, a unit of the optical thickness of all crowns. Also the height of the top, m.
fn hiding_pairs(scene: &Scene, baked: &[Baked], directions: usize) -> (Vec<[f32; 2]>, f64) {
    let of = |b: &Baked| b.envelopes.as_ref().map_or(Vec::new(), |e| e.hiding.clone());
    let hidden = HiddenSky::new(scene, baked, baked.iter().map(of).collect());
    let steps = HIDING_STEPS as usize;
    let node = |direction: usize, step: usize| hidden.at(direction, hidden.top * step as f64 / steps as f64);
    let pair = |k: usize| {
        let (direction, step) = (k / steps, k % steps);
        let here = node(direction, step);
        [here, node(direction, step + 1) - here].map(|x| x as f32)
    };
    ((0..directions * steps).map(pair).collect(), hidden.top)
}

/// Uploads masks as layers of one array. Of the finest level texels are opacities, of which a half is the cutoff; of the others, shares of the
/// finest that is no hole, so that a mask keeps its area however far it is.
fn masks(gpu: &Gpu, plan: &Plan, masks: &[Mask]) -> Result<Image> {
    let none = ImageDesc::stand_in(resource::LEAF_MASKS, vk::Format::R8_UNORM);
    let image = gpu.image(plan.images(resource::LEAF_MASKS).next().unwrap_or(&none))?;
    let side = image.size()[0];
    for (layer, mask) in masks.iter().enumerate() {
        let place = |k: u32| Vec2::new((k % side) as f32 + 0.5, (k / side) as f32 + 0.5) / side as f32;
        let finest: Vec<u8> = (0..side * side).map(|k| mask.opacity(place(k))).collect();
        gpu.upload_image(&image, 0, layer as u32, 1, &finest)?;
        let mut shares: Vec<f32> =
            (0..side * side).map(|k| f32::from(u8::from(mask.opaque(place(k))))).collect();
        let mut width = side;
        for level in 1..image.levels() {
            width /= 2;
            let mean = |k: u32| {
                let at = (2 * (k / width) * 2 * width + 2 * (k % width)) as usize;
                let below = at + 2 * width as usize;
                0.25 * (shares[at] + shares[at + 1] + shares[below] + shares[below + 1])
            };
            shares = (0..width * width).map(mean).collect();
            let bytes: Vec<u8> = shares.iter().map(|s| (s * 255.0).round() as u8).collect();
            gpu.upload_image(&image, level, layer as u32, 1, &bytes)?;
        }
    }
    Ok(image)
}
