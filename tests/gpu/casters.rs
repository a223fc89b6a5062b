//! Which trees cast into what is drawn of the shadow maps: exactly those that the CPU says.

use crate::device;
use canopy::forest::casters::reached;
use canopy::frame::Renderer;
use canopy::gpu::Gpu;
use canopy::gpu::interface::{Caster, CasterQuad, DrawCommand, Seed};
use canopy::physics::hash::{HASH_DITHER, hash};
use canopy::physics::raster::Raster;
use canopy::plan::Plan;
use canopy::scene::Scene;
use std::sync::Arc;

/// Hills of 700 m with a dense species and a thin one of another size.
pub fn hills() -> Scene {
    let mut scene = device::small_scene(
        "seed = 3\n[terrain]\nextent = 700.0\nalbedo = 0.2\n\
         [[species]]\nname = \"a\"\nmodel = \"builtin:birch\"\ndensity = 0.03\nscale = [0.5, 1.5]\n\
         [[species]]\nname = \"b\"\nmodel = \"builtin:birch\"\ndensity = 0.003\nscale = [2.0, 3.0]\n\
         [sun]\nazimuth = 210.0\nelevation = 25.0\nirradiance = 1.0\n[sky]\nradiance = 0.1\n\
         [[camera]]\nname = \"c\"\nposition = [350.0, 350.0, 9.0]\ntarget = [390.0, 380.0, 5.0]\nvertical_fov = 50.0\n",
    );
    let (width, height) = (36, 36);
    let samples = (0..width * height)
        .map(|k: u32| (20.0 * (f64::from(k % width) * 0.4).sin() * (f64::from(k / width) * 0.3).cos()) as f32)
        .collect();
    scene.terrain.heights = Some(Raster { width, height, samples });
    scene.terrain.cell_size = 20.0;
    scene.settings.set("cascades", 3.0).unwrap();
    scene
}

/// Compares what the last frame found with what the CPU says, and returns how many casters each block has.
fn check(gpu: &Gpu, renderer: &Renderer) -> Vec<usize> {
    let forest = renderer.forest().unwrap();
    let (seeds, data, blocks) = (&forest.seeds, renderer.casters().unwrap(), &renderer.shadows().work.blocks);
    assert_eq!(data.work.batches.len(), 1, "seeds of an earlier batch are gone");
    let capacity = seeds.region_capacity as usize;
    let regions = renderer.plan().seed_regions as usize;
    let all: Vec<Seed> = gpu.read(&seeds.seeds, 0, regions * capacity).unwrap();
    let counts: Vec<DrawCommand> = gpu.read(&seeds.draws, 0, regions).unwrap();
    let mut want: Vec<Vec<u32>> = vec![Vec::new(); blocks.len()];
    let casts = |quad: &CasterQuad, seed: &Seed| {
        let b = &blocks[quad.block as usize];
        let [first, last] = reached(
            &b.gpu,
            quad,
            seed,
            &forest.species.rows[device::species(seed)],
            renderer.scene().settings.view_resolution,
        );
        (first[1]..=last[1]).any(|y| {
            let row = b.pages.rows[(i64::from(y) + b.block.shift[1]) as usize];
            (first[0]..=last[0]).any(|x| row >> (i64::from(x) + b.block.shift[0]) & 1 != 0)
        })
    };
    for quad in &data.work.quads {
        let count = counts[quad.region as usize].index_count as usize / 6;
        for seed in &all[quad.region as usize * capacity..][..count] {
            if casts(quad, seed) {
                let cascade = blocks[quad.block as usize].cascade as u32;
                // With the tree's name in its last bits.
                let name = hash(seed.identity ^ HASH_DITHER) & 255;
                want[quad.block as usize].push(hash(seed.identity ^ HASH_DITHER ^ cascade) & !255 | name);
            }
        }
    }
    let commands: Vec<DrawCommand> = gpu.read(&data.commands, 0, blocks.len()).unwrap();
    for (k, (command, want)) in commands.iter().zip(&mut want).enumerate() {
        let offset = u64::from(command.vertex_offset as u32 / 4) * size_of::<Caster>() as u64;
        let found: Vec<Caster> = gpu.read(&data.casters, offset, command.index_count as usize / 6).unwrap();
        let mut found: Vec<u32> = found.iter().map(|c| c.dither).collect();
        found.sort_unstable();
        want.sort_unstable();
        assert_eq!(&found, want, "block {k}");
    }
    want.iter().map(Vec::len).collect()
}

#[test]
fn those_that_cast_into_drawn_pages_are_those_of_the_cpu() {
    let gpu = device::open();
    let scene = hills();
    let cameras = [
        ("inside the forest", device::camera([350.0, 350.0, 3.0], [390.0, 370.0, 3.0])),
        ("a step aside", device::camera([354.0, 357.0, 3.0], [390.0, 370.0, 3.0])),
        ("aerial", device::camera([330.0, 200.0, 120.0], [350.0, 360.0, 0.0])),
        ("at the border", device::camera([5.0, 690.0, 8.0], [100.0, 600.0, 0.0])),
    ];
    let mut plan = Plan::new(&scene, &cameras[0].1, [96, 64], false, Some(gpu.info())).unwrap();
    // All in one batch.
    plan.caster_capacity *= 16;
    plan.list(&scene);
    let baked = device::bake(&scene);
    let mut renderer = Renderer::new(&gpu, Arc::new(scene.clone()), plan, &baked).unwrap();
    for (name, camera) in &cameras {
        let report = renderer.render(camera, 1.0).unwrap();
        let found = check(&gpu, &renderer);
        println!("{name}: {found:?} in {:?}", report.trees.cascades);
        assert!(found.iter().sum::<usize>() > 20, "{name} tests nothing");
        assert_eq!(report.trees.cascades.iter().sum::<u32>() as usize, found.iter().sum::<usize>());
    }
    drop(renderer);
    gpu.close().unwrap();
}
