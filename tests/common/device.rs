//! What tests on a device share: the device, probes of shader functions, and small scenes.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use canopy::bake::{Baked, load_or_bake_scene};
use canopy::frame::Renderer;
use canopy::gpu::interface::Seed;
use canopy::gpu::{Gpu, GpuOptions, Resource, Shader};
use canopy::plan::Plan;
use canopy::scene::{self, Camera, Scene};

/// A device with core and synchronization validation. Without one the test fails: it must not pass unseen.
pub fn open() -> Gpu {
    Gpu::new(&GpuOptions { device: None, validate: true })
        .unwrap_or_else(|e| panic!("this test needs a Vulkan 1.3 device and the validation layer: {e}"))
}

/// Up to twelve words in.
pub type Arguments = [u32; 12];
/// Eight words out.
pub type Outcome = [u32; 8];

/// The functions of `shaders/probe/physics.comp`.
#[derive(Clone, Copy, Debug)]
pub enum Function {
    Hash = 0,
    ViewLookup,
    Hotspot,
    LeafPhase,
    HoleOcclusion,
    GroundContrast,
    CoveredSamples,
    MaskColumn,
    PlaneGradient,
    ToneCurve,
    Srgb,
    ViewLayer,
    Handover,
    TableAngles,
    TableCoordinates,
}

/// The outcomes of a function for many arguments.
pub fn evaluate(gpu: &Gpu, function: Function, arguments: &[Arguments]) -> Vec<Outcome> {
    let shader = &canopy::gpu::shaders::PROBE_PHYSICS_COMP;
    let inputs = gpu.buffer_with("probe inputs", arguments).unwrap();
    dispatch(
        gpu,
        shader,
        &[(0, function as u32)],
        &[("inputs", Resource::Buffer(&inputs))],
        arguments.len(),
        &[],
    )
}

/// Runs a probe over `count` inputs; `more` follows the count in the push constants.
pub fn dispatch<T: bytemuck::Pod>(
    gpu: &Gpu,
    shader: &'static Shader,
    constants: &[(u32, u32)],
    resources: &[(&str, Resource)],
    count: usize,
    more: &[u32],
) -> Vec<T> {
    let program = gpu.compute(shader, constants).unwrap();
    let results = gpu.buffer("probe results", (count * size_of::<T>()) as u64).unwrap();
    let mut all = resources.to_vec();
    all.push(("results", Resource::Buffer(&results)));
    let mut recorder = gpu.record().unwrap();
    recorder.compute("probe", |pass| {
        pass.bind(&program, &all);
        match *more {
            [] => pass.push(&(count as u32)),
            [a] => pass.push(&[count as u32, a]),
            _ => panic!("at most one more"),
        }
        pass.dispatch([(count as u32).div_ceil(64), 1, 1]);
    });
    recorder.submit().unwrap();
    gpu.read(&results, 0, count).unwrap()
}

/// Bits of floats, padded with zeros.
pub fn words(floats: &[f32]) -> Arguments {
    let mut all = [0; 12];
    floats.iter().zip(&mut all).for_each(|(f, w)| *w = f.to_bits());
    all
}

/// A float of an outcome.
pub fn float(outcome: &Outcome, k: usize) -> f64 {
    f64::from(f32::from_bits(outcome[k]))
}

/// The largest error of a check, for messages.
#[derive(Default)]
pub struct Worst {
    error: f64,
    at: String,
}

impl Worst {
    /// Takes note of an error. NaN counts as infinite.
    pub fn note(&mut self, error: f64, at: impl FnOnce() -> String) {
        let error = if error.is_nan() { f64::INFINITY } else { error };
        if error > self.error || self.at.is_empty() {
            self.error = error;
            self.at = at();
        }
    }

    /// Prints the largest error, and fails when it exceeds the bound.
    pub fn within(self, bound: f64, what: &str) {
        println!("{what}: largest error {:.3e}, bound {bound:.3e}, {}", self.error, self.at);
        assert!(self.error <= bound, "{what}: error {:e} exceeds {bound:e} at {}", self.error, self.at);
    }
}

/// Where tests keep what they make.
pub fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_TARGET_TMPDIR"))
}

/// A scene from text, with coarse views and small shadow maps so that it is quick to bake and draw.
pub fn small_scene(text: &str) -> Scene {
    let quality = "\n[quality]\npreset = \"fast\"\nview_rings = 2\nview_resolution = 32\nocclusion_rays = 8\n\
                   cascade_size = 256\ncoverage_size = 64\n\
                   table_angles = 6\ntable_densities = 3\ntable_rays = 64\n";
    scene::parse(&format!("{text}{quality}"), Path::new("test.toml")).unwrap()
}

/// Species of a scene, baked once for all tests and runs.
pub fn bake(scene: &Scene) -> Vec<Baked> {
    let cache = folder().join("bakes");
    load_or_bake_scene(scene, Some(&cache), true).unwrap().into_iter().map(|(b, _)| b).collect()
}

/// Index of a seed's species.
pub fn species(seed: &Seed) -> usize {
    (seed.species_density & 0xffff) as usize
}

/// A renderer of a scene for a camera.
pub fn renderer(gpu: &Gpu, scene: &Scene, camera: &Camera, size: [u32; 2], layers: bool) -> Renderer {
    let plan = Plan::new(scene, camera, size, layers, Some(gpu.info())).unwrap();
    Renderer::new(gpu, Arc::new(scene.clone()), plan, &bake(scene)).unwrap()
}

/// A camera of 50 degrees.
pub fn camera(position: [f64; 3], target: [f64; 3]) -> Camera {
    Camera { name: "test".into(), position, target, vertical_fov: 50.0 }
}
