//! Shells in the cache.

use std::path::Path;

use super::{
    FREE_RAYS, LIGHT_IMAGES, LIGHT_TEXELS, LightMip, SUN_RAYS, ShellSettings, Shells, empty, slices,
};
use crate::Result;
use crate::bake::CacheState;
use crate::bake::file::{Fields, Format, load_or_build};
use crate::bake::harmonics;
use crate::land::pattern::TILES;
use crate::physics::correction::{SHELL_TERMS, ShellCorrection};
use crate::scene::{Distribution, Scene};

const FORMAT: Format = Format { magic: *b"CANOPYSH", version: 7, extension: "shells" };
/// Bytes of the head: side of a tile, height, largest reflectance and transmittance, corrections.
const HEAD: usize = 8 + 4 + 4 * 6 + 4 * 2 * SHELL_TERMS;

/// Shells from the cache if they are there, else made and put there.
pub fn load(
    scene: &Scene,
    settings: ShellSettings,
    dir: Option<&Path>,
    quiet: bool,
) -> Result<(Shells, CacheState)> {
    load_or_build(
        (dir, &FORMAT, &key(scene, settings)),
        &sizes(settings),
        |parts| decode(parts, settings),
        |shells, put| {
            put(&head(shells))?;
            shells.images().try_for_each(|image| put(image))
        },
        || Shells::bake(scene, settings, dir, quiet),
        quiet,
    )
}

/// Bytes of the head, and of each image of each mip of each level.
fn sizes(settings: ShellSettings) -> Vec<usize> {
    let slices = |level: usize| settings.slices as usize >> level;
    let texels = |level: usize, side: u32| 4 * TILES * slices(level) * (side as usize).pow(2);
    let images = empty(settings)
        .into_iter()
        .enumerate()
        .flat_map(|(level, mips)| mips.into_iter().flat_map(move |mip| [texels(level, mip.side); 3]));
    let light = LightMip::empty(settings).into_iter().enumerate().flat_map(|(level, mips)| {
        mips.into_iter().flat_map(move |mip| [texels(level, mip.side); LIGHT_IMAGES])
    });
    std::iter::once(HEAD).chain(images).chain(light).collect()
}

/// BLAKE3 of everything that they depend on: the pattern, models, reflectances, scales and densities.
fn key(scene: &Scene, settings: ShellSettings) -> [u8; 32] {
    let mut fields = Fields::new("canopy shells");
    let numbers = [
        FORMAT.version,
        settings.slices,
        settings.texels,
        slices::SAMPLES,
        slices::SHARES as u32,
        LIGHT_TEXELS,
        FREE_RAYS,
        SUN_RAYS,
        scene.seed,
    ];
    fields.put(&numbers.map(u32::to_le_bytes).concat());
    for s in &scene.species {
        // A species that is only listed has no trees in shells, but its place among the others.
        let Distribution::Density { max_density, .. } = s.distribution else {
            fields.put(&[]);
            continue;
        };
        fields.put(&max_density.to_le_bytes());
        fields.put(bytemuck::bytes_of(&s.scale));
        for rgb in [s.optics.leaf_reflectance, s.optics.leaf_transmittance, s.optics.bark_reflectance] {
            fields.put(rgb.as_ref().map_or(&[], bytemuck::bytes_of));
        }
        // That of how light comes to the mesh is one of the mesh, too.
        fields.put(&harmonics::file::key(&s.mesh));
    }
    fields.key()
}

fn head(shells: &Shells) -> Vec<u8> {
    let mut head = shells.tile_side.to_le_bytes().to_vec();
    head.extend(shells.height.to_le_bytes());
    head.extend(shells.most.as_flattened().iter().flat_map(|v| v.to_le_bytes()));
    head.extend(shells.sun.iter().flat_map(|k| k.coefficients).flat_map(f32::to_le_bytes));
    head
}

/// Shells of a file, whose sizes are known to be right.
fn decode(parts: Vec<Vec<u8>>, settings: ShellSettings) -> Shells {
    let (side, rest) = parts[0].split_at(8);
    let number = |k: usize| f32::from_le_bytes(std::array::from_fn(|b| rest[4 * k + b]));
    let mut shells = Shells {
        settings,
        tile_side: f64::from_le_bytes(std::array::from_fn(|b| side[b])),
        height: number(0),
        most: [[number(1), number(2), number(3)], [number(4), number(5), number(6)]],
        sun: [0, 1].map(|k| ShellCorrection {
            coefficients: std::array::from_fn(|i| number(7 + SHELL_TERMS * k + i)),
        }),
        levels: empty(settings),
        light: LightMip::empty(settings),
    };
    let mut images = parts.into_iter().skip(1);
    for mip in shells.levels.iter_mut().flatten() {
        for image in [&mut mip.cover, &mut mip.reflected, &mut mip.passed] {
            *image = images.next().unwrap_or_default();
        }
    }
    for image in shells.light.iter_mut().flatten().flat_map(|mip| &mut mip.images) {
        *image = images.next().unwrap_or_default();
    }
    shells
}
