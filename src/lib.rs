//! Canopy: forests in real time from a leaf to the horizon, after Bruneton and Neyret, "Real-time Realistic Rendering
//! and Lighting of Forests" (Eurographics 2012), here BN12. On explicit Vulkan, headless, with each saving measured.
//!
//! # Draw an image
//!
//! ```no_run
//! use std::sync::Arc;
//! # fn main() -> canopy::Result<()> {
//! let scene = Arc::new(canopy::scene::load("ridge.toml".as_ref())?);
//! let gpu = canopy::gpu::Gpu::new(&Default::default())?;
//! let camera = scene.camera(None)?.clone();
//! let plan = canopy::plan::Plan::new(&scene, &camera, [1024, 768], false, Some(gpu.info()))?;
//! let cache = canopy::bake::cache::default_dir();
//! let baked = canopy::bake::load_or_bake_scene(&scene, &plan, cache.as_deref(), false)?;
//! let baked: Vec<_> = baked.into_iter().map(|(species, _)| species).collect();
//! let mut renderer = canopy::frame::Renderer::new(&gpu, scene.clone(), plan, &baked)?;
//! renderer.render(&camera, canopy::camera::auto_exposure(&scene))?;
//! renderer.picture()?.write_png("ridge.png".as_ref())?;
//! drop(renderer);
//! gpu.close() // Reports what the validation layers said, and what is still allocated.
//! # }
//! ```
//!
//! # Where things are
//!
//! Data flows one way: [`scene`] → [`plan`] → [`bake`] → [`forest`] → [`frame`] → [`image`] → [`measure`]. [`physics`] holds the
//! models in double precision and knows nobody: it is what the shaders are tested against. [`mod@reference`] draws scenes
//! without Vulkan, by path tracing. [`gpu`] holds all Vulkan and
//! all `unsafe`, and knows no forest.
//!
//! | paper | module | shader | test |
//! |---|---|---|---|
//! | BN12 §3, terrain quadtree | [`forest::terrain`], [`land::quadtree`], [`physics::terrain`] | `forest/terrain_tile.comp`, `physics/terrain.glsl` | `tests/gpu/ground.rs` |
//! | BN12 §4, seeds from densities | [`forest::seeds`], [`land::candidate`], [`land::pattern`], [`land::listed`] | `forest/seeds.comp`, `land/candidate.glsl`, `land/density.glsl` | `tests/gpu/seeds.rs` |
//! | BN12 §4, coverage | [`forest::coverage`] | `forest/coverage*`, `frame/cover.glsl` | `tests/gpu/coverage.rs` |
//! | BN12 §5, views of a z-field | [`bake`], [`physics::views`] | `physics/views.glsl` | `tests/views.rs`, `tests/bake.rs`, `tests/gpu/views.rs` |
//! | BN12 §5, surface along a ray | [`physics::zfield`] | `physics/zfield.glsl` | `tests/zfield.rs`, `tests/zfield_quality.rs`, `tests/gpu/zfield.rs` |
//! | BN12 eq. 7–12, light | [`physics::light`] | `physics/light.glsl`, `frame/trees/zfield_shade.glsl`, `frame/ground.glsl` | `tests/gpu/light.rs`, `tests/gpu/light_on_ground.rs` |
//! | self-shadow and leaf angles, measured instead of BN12 eq. 7 and 8 | [`bake`], [`physics::light::self_shadow`] | `physics/light.glsl`, `frame/trees/zfield_shade.glsl` | `tests/bake.rs`, `tests/gpu/light.rs` |
//! | light transfer (Sloan et al. 2002) of z-field texels | [`bake`], [`physics::transfer`] | `physics/transfer.glsl`, `frame/trees/zfield_shade.glsl` | `tests/bake.rs`, `tests/gpu/transfer.rs` |
//! | BN12 §6, tables G, T, D, E of far forests | [`bake::tables`], [`forest::tables`], [`physics::tables`], [`physics::forest`] | `physics/tables.glsl`, `physics/forest.glsl` | `tests/tables.rs`, `tests/gpu/tables.rs`, `tests/gpu/shader_map.rs` |
//! | BN12 §6, eq. 13–21, shader-map | [`frame::trees::shader_map`] | `frame/trees/shader_map.*`, `frame/ground.glsl` | `tests/gpu/shader_map.rs` |
//! | BN12 §7, eq. 22–27, hand-over | [`physics::handover`] | `physics/handover.glsl` | `tests/gpu/tables.rs`, `tests/proofs/` |
//! | BN12 §9, figures 7 and 8 | [`measure::reflectance`] | | `tests/proofs/scale.rs`, `tests/cli.rs` |
//! | BN12 §8, culling in order | [`forest::cull`] | `forest/cull.comp`, `forest/scan.comp`, `forest/compact.comp` | `tests/gpu/cull.rs` |
//! | BN12 §7, trees on silhouettes beyond the hand-over | [`land::silhouette`] | `land/silhouette.glsl` | `tests/gpu/silhouettes.rs` |
//! | BN12 §8, sub-pixel masks | [`physics::masks`] | `physics/masks.glsl` | `measure/conform/law.rs`, `tests/conform.rs` |
//! | BN12 §8, many layers of trees: seen first, lit once | [`frame::trees::tiles`], [`frame::seen_ground`] | `frame/trees/tiles/*`, `frame/ground*.comp` | `tests/gpu/tiles.rs`, `measure/conform/tiles.rs` |
//! | wind: sway, flutter, gusts (Boulanger et al. 2008, section 7) | [`physics::wind`] | `physics/wind.glsl`, `forest/sway.glsl`, `frame/trees/meshes/corner.glsl` | `tests/gpu/wind.rs` |
//! | Monte-Carlo reference (Kajiya 1986), error of every pixel | [`mod@reference`] | | `tests/reference.rs` |
//! | billboard clouds (Behrendt et al. 2005, section 2) | [`bake::cards`], [`forest::cards`], [`frame::trees::cards`] | `frame/trees/cards/*` | `tests/cards.rs`, `tests/gpu/cards.rs`, `tests/proofs/near.rs` |
//! | light by spherical harmonics (Behrendt et al. 2005, section 4; Sloan et al. 2002) | [`physics::harmonics`], [`bake::harmonics`], [`forest::forest_sky`] | `physics/harmonics.glsl`, `physics/received.glsl`, `physics/forest_sky.glsl` | `tests/gpu/harmonics.rs` |
//! | shell textures (Behrendt et al. 2005, section 3), their bake | [`bake::shells`] | | `tests/shells.rs` |
//! | pictures of several frames (Haeberli & Akeley 1990) | [`frame::accumulation`] | `frame/accumulation.comp` | `tests/gpu/accumulation.rs` |
//! | hand-over of meshes to z-fields, by direction and by distance | | | `tests/proofs/near.rs` |
//! | parallel-split shadow maps (Zhang et al. 2006) | [`camera::cascades`], [`frame::shadows`] | `frame/trees/zfield_shadow.*`, `physics/shadow.glsl` | `tests/gpu/light_on_ground.rs` |
//! | trees that need no file (Weber and Penn 1995) | [`tree`] | | `tests/trees.rs` |
//! | the scene file | [`scene`] | | `tests/scene_inputs.rs`, `tests/model_inputs.rs` |
//! | conformance of a driver | [`measure::conform`] | `probe/*` | `tests/conform.rs`, `tests/conformance/`, `tests/proofs/planted.rs` |
//! | bakes on disk | [`bake::cache`], [`bake::tables`] | | `tests/cache.rs`, `tests/tables.rs` |
//! | how much of a mesh is drawn at which size: Cook et al. 2007 for leaves, simplified bark | [`physics::levels`], [`bake::levels`] | `physics/levels.glsl`, `frame/trees/meshes/{list.comp, level.glsl}` | `tests/gpu/levels.rs` |
//! | what stands for a tree at which distance | [`ladder`], [`physics::handover`] | `physics/handover.glsl` | `tests/gpu/plan.rs`, `tests/cli.rs` |
//! | what a scene requires | [`plan`] | | `tests/gpu/plan.rs` |
//! | the whole frame: extremes, paths through them, the same bits again | [`frame`] | `frame/*` | `tests/gpu/extremes.rs`, `tests/gpu/paths.rs`, `tests/gpu/determinism.rs` |
//! | what few bits cost | | | `tests/proofs/precision.rs` |
//! | timestamps, statistics of the pipeline, CPU time a pass | [`gpu::Timing`], [`clock`] | | `tests/bench.rs`, `tests/proofs/bench.rs` |
//! | benches along camera paths | [`measure::bench`], [`measure::path`], [`measure::results`], [`measure::trace`] | | `tests/bench.rs` |
//! | what differs between two benches | [`measure::compare`], [`measure::statistics`] | | `tests/compare.rs`, `tests/proofs/bench.rs` |
//! | how far images are from a reference | [`measure::metrics`], [`image::Layers`] | | unit tests, `tests/sweep.rs` |
//! | time against accuracy of every knob | [`measure::sweep`] | | `tests/sweep.rs` |
//! | files whole or not at all | [`files`] | | `tests/robustness.rs` |
//! | what reads files, fuzzed | [`scene`], [`bake`] | | `tests/fuzz/` |
//! | memory that runs out, a lost device | [`gpu`] | | `tests/gpu/failures.rs`, `tests/robustness.rs` |
//! | the program | `src/cli/` | | `tests/cli.rs`, `tests/robustness.rs` |
//!
//! Structs and constants that Rust and GLSL share stand once, in `shaders/interface.glsl`; `build.rs` compiles and
//! reflects every shader and writes their Rust side, [`gpu::interface`]. Every knob stands once, in [`settings`].
#![warn(missing_docs)]

pub mod bake;
pub mod camera;
pub mod clock;
pub mod error;
pub mod files;
pub mod forest;
pub mod frame;
pub mod gpu;
pub mod image;
mod input;
mod keys;
pub mod ladder;
pub mod land;
pub mod measure;
pub mod physics;
pub mod plan;
pub mod progress;
pub mod rays;
pub mod reference;
pub mod scene;
pub mod settings;
pub mod tree;

pub use error::{Error, Result};
