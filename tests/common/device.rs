//! What tests on a device share: the device, probes of shader functions, and small scenes.

use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use canopy::bake::{Baked, Needs, load_or_bake_scene};
use canopy::camera::Eye;
use canopy::frame::Renderer;
use canopy::gpu::interface::Seed;
use canopy::gpu::{Gpu, GpuOptions, Resource, Shader, Validation};
use canopy::ladder::Ladder;
use canopy::measure::conform::probe;
pub use canopy::measure::conform::probe::{Arguments, Function, Words, float, words};
use canopy::physics::hash::Stream;
use canopy::plan::Plan;
use canopy::scene::{self, Camera, Scene};

/// A device with core and synchronization validation. Without one the test fails: it must not pass unseen.
pub fn open() -> Gpu {
    open_with(&GpuOptions { validation: Validation::Full, ..GpuOptions::default() })
}

/// A device as these options say.
pub fn open_with(options: &GpuOptions) -> Gpu {
    Gpu::new(options)
        .unwrap_or_else(|e| panic!("this test needs a Vulkan 1.3 device and the validation layer: {e}"))
}

/// The results of a function for many arguments.
pub fn evaluate(gpu: &Gpu, function: Function, arguments: &[Arguments]) -> Vec<Words> {
    probe::evaluate(gpu, function, arguments).unwrap()
}

/// Runs a probe over `count` inputs; `more` follows the count in the push constants.
pub fn dispatch<T: bytemuck::Pod>(
    gpu: &Gpu,
    shader: &'static Shader,
    constants: &[(&str, u32)],
    resources: &[(&str, Resource)],
    count: usize,
    more: &[u32],
) -> Vec<T> {
    probe::dispatch(gpu, shader, constants, resources, count, more).unwrap()
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

/// What makes a scene coarse, small and so quick to bake and draw.
const SMALL: &str = "\n[quality]\npreset = \"fast\"\nview_rings = 2\nview_resolution = 32\nocclusion_rays = 8\n\
                     cascade_size = 256\ncoverage_size = 64\nzfield_min_pixels = 4\n\
                     table_angles = 6\ntable_densities = 3\ntable_rays = 64\n";

/// A scene from text, with coarse views and small shadow maps so that it is quick to bake and draw.
pub fn small_scene(text: &str) -> Scene {
    let mut scene = scene::parse(&format!("{text}{SMALL}"), Path::new("test.toml")).unwrap();
    // Meshes have tests of their own.
    scene.ladder = Ladder::BN12;
    scene
}

/// Species of a scene, baked once for all tests and runs.
pub fn bake(scene: &Scene) -> Vec<Baked> {
    bake_with(scene, Needs::ALL)
}

/// The same with what drawing them as meshes takes.
pub fn bake_meshes(scene: &Scene) -> Vec<Baked> {
    bake_with(scene, Needs { envelopes: true, ..Needs::ALL })
}

/// The same with what a ladder takes.
pub fn bake_for(scene: &Scene, ladder: Ladder) -> Vec<Baked> {
    bake_with(scene, Needs::of([ladder]))
}

fn bake_with(scene: &Scene, needs: Needs) -> Vec<Baked> {
    let cache = folder().join("bakes");
    load_or_bake_scene(scene, needs, Some(&cache), true).unwrap().into_iter().map(|(b, _)| b).collect()
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

/// Where a soak's camera stands in a frame: anywhere over and beyond the terrain, looking anywhere, never the same twice.
pub fn jump(scene: &Scene, frame: u32) -> Camera {
    let mut stream = Stream::new(frame);
    let mut within = |low: f64, high: f64| low + (high - low) * stream.unit();
    let [width, height] = scene.terrain.extent;
    let eye =
        [within(-0.1, 1.1) * width, within(-0.1, 1.1) * height, within(0.1f64.ln(), 3000f64.ln()).exp()];
    let [x, y, _] = eye;
    camera(eye, [x + within(-300.0, 300.0), y + within(-300.0, 300.0), within(-200.0, 200.0)])
}

/// Two species on ridges, for soaks.
pub const WOODS: &str = "[terrain]\nheightmap = \"builtin:ridge\"\n[[species]]\nname = \"oak\"\nmodel = \"builtin:oak\"\n\
    density = 0.02\n[[species]]\nname = \"pine\"\nmodel = \"builtin:pine\"\ndensity = 0.01\nbelow_slope = 30.0\n\
    [sun]\nazimuth = 180.0\nelevation = 40.0\nirradiance = 1.0\n[sky]\nradiance = 0.1\n\
    [[camera]]\nname = \"a\"\nposition = [0.0, 0.0, 10.0]\ntarget = [9.0, 9.0, 5.0]\nvertical_fov = 50.0\n";

/// Draws frames from cameras that jump at random, and passes the number of each on to `after`. What lives on the device
/// must stay what it was after the first: a buffer made anew leaves its elder for the next frame to free, and lists of quads,
/// with what they are uploaded through, grow by a per cent.
pub fn soak(gpu: &Gpu, scene: &Scene, frames: u32, after: impl FnMut(u32)) {
    soak_in_flight(gpu, scene, (frames, 1), after);
}

/// The same with so many frames in flight.
pub fn soak_in_flight(
    gpu: &Gpu,
    scene: &Scene,
    (frames, in_flight): (u32, usize),
    mut after: impl FnMut(u32),
) {
    let size = [96, 64];
    let mut renderer = renderer(gpu, scene, &jump(scene, 0), size, false);
    let bytes = |report: &[(String, u64)]| report.iter().map(|(_, bytes)| bytes).sum::<u64>();
    let (mut first, mut waiting) = (Vec::new(), VecDeque::new());
    for frame in 0..frames {
        let eye = Eye::new(&jump(scene, frame), &scene.terrain, size);
        let cascades = renderer.cascades(&eye);
        waiting.push_back(renderer.submit(&eye, &cascades, 1.0).unwrap());
        if waiting.len() == in_flight {
            renderer.finish(waiting.pop_front().unwrap()).unwrap();
        }
        let now = gpu.memory_report();
        if (frame as usize) < in_flight {
            first = now;
        } else {
            assert!(now.len() <= first.len() + 2, "frame {frame}: {now:?} where there was {first:?}");
            assert!(
                100 * bytes(&now) <= 101 * bytes(&first),
                "frame {frame}: {now:?} where there was {first:?}"
            );
        }
        after(frame);
    }
}
