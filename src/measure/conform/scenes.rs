//! The scenes of the suite: a few builtin trees on a plain or on the builtin ridge, drawn small. Each is there for a reason,
//! which its name tells.

use std::path::Path;

use crate::ladder::Ladder;
use crate::plan::{Rasterizer, ViewMode};
use crate::scene::{self, Camera, Scene};
use crate::{Error, Result};

/// Size of the pictures.
pub const SIZE: [u32; 2] = [128, 96];

/// Time of the pictures, s: some way into what the wind does.
const TIME: f64 = 3.0;

/// Both ways of finding samples.
pub const RASTERIZERS: [Rasterizer; 2] = [Rasterizer::Graphics, Rasterizer::Tiles];

/// One picture of the suite.
pub struct SceneCase {
    pub name: &'static str,
    ground: &'static str,
    /// Where the camera stands, above the ground there, what it looks at, and its vertical field of view in degrees.
    camera: ([f64; 3], [f64; 3], f64),
    /// Azimuth, elevation and irradiance of the sun.
    sun: [f64; 3],
    /// Radiance of the sky.
    pub sky: f64,
    /// Speed of the wind, m/s; 0: none.
    wind: f64,
    knobs: &'static [(&'static str, f64)],
    pub mode: ViewMode,
    /// The ladder, where trees are meshes, clouds of cards or slices, which compute tiles alone draw; else empty, and that of BN12.
    near: &'static str,
}

const PLAIN: &str = "[terrain]\nextent = 1200.0\nalbedo = [0.13, 0.11, 0.08]\n\
    [[species]]\nname = \"birch\"\nmodel = \"builtin:birch\"\ndensity = 0.006\nscale = [0.7, 1.2]\n\
    [[species]]\nname = \"pine\"\nmodel = \"builtin:pine\"\ndensity = 0.006\nscale = [0.6, 1.0]\n";
const RIDGE: &str = "[terrain]\nheightmap = \"builtin:ridge\"\nalbedo = [0.13, 0.11, 0.08]\n\
    [[species]]\nname = \"birch\"\nmodel = \"builtin:birch\"\ndensity = 0.012\nbetween_heights = [0.0, 380.0]\nbelow_slope = 38.0\n\
    [[species]]\nname = \"pine\"\nmodel = \"builtin:pine\"\ndensity = 0.012\nbetween_heights = [220.0, 560.0]\n";

/// A clear day over the plain, from the south-west at the height of the crowns.
const GROVE: SceneCase = SceneCase {
    name: "grove",
    ground: PLAIN,
    camera: ([560.0, 560.0, 12.0], [600.0, 600.0, 6.0], 50.0),
    sun: [210.0, 35.0, 1.0],
    sky: 0.08,
    wind: 0.0,
    knobs: &[],
    mode: ViewMode::Radiance,
    near: "",
};
/// The same with the nearest trees as meshes.
const NEAR: SceneCase = SceneCase { name: "near", near: NEAR_LADDER, ..GROVE };
/// Hills a kilometre and more away.
const HILLS: SceneCase = SceneCase {
    name: "hills",
    ground: RIDGE,
    camera: ([2900.0, 2700.0, 45.0], [4300.0, 4800.0, -300.0], 45.0),
    ..GROVE
};
/// From above, into the middle of the plain.
const ABOVE: SceneCase =
    SceneCase { name: "above", camera: ([600.0, 599.0, 260.0], [600.0, 600.0, 0.0], 50.0), ..GROVE };
/// From the direction of the sun, 35 degrees high: the shadow of the eye is in the middle of the picture.
const HOTSPOT: SceneCase =
    SceneCase { name: "hotspot", camera: ([550.0, 513.4, 70.0], [600.0, 600.0, 0.0], 40.0), ..GROVE };
/// Meshes down to trees so small that some in a small picture are.
const NEAR_LADDER: &str = "mesh:32,zfield,shader-map";
/// Full clouds and far forms of cards, until the shader-map: small pictures show both, and the fade between them.
const CARD_LADDER: &str = "cards:8,shader-map";
/// Every rung.
const ALL_RUNGS: &str = "mesh:48,cards:24,zfield:6,shader-map";
/// Small clouds.
const FEW_CARDS: &[(&str, f64)] = &[("cards", 30.0), ("card_atlas", 256.0), ("cloud_min_pixels", 24.0)];
/// The same grove by clouds of cards.
const CARDS: SceneCase = SceneCase { name: "cards", near: CARD_LADDER, knobs: FEW_CARDS, ..GROVE };
/// Slices of a forest behind z-fields.
const SHELL_LADDER: &str = "zfield:12,shells";
/// Few and coarse ones.
const FEW_SLICES: &[(&str, f64)] = &[("shell_slices", 8.0), ("shell_texels", 32.0)];
/// Hills whose far trees are slices.
const SHELLS: SceneCase = SceneCase { name: "shells", near: SHELL_LADDER, knobs: FEW_SLICES, ..HILLS };
/// The whole forest by the shader-map.
const FAR: &[(&str, f64)] = &[("zfield_min_pixels", 64.0)];

/// Every scene.
pub const ALL: &[SceneCase] = &[
    GROVE,
    HILLS,
    ABOVE,
    HOTSPOT,
    SceneCase { name: "backlit", sun: [45.0, 12.0, 1.0], ..GROVE },
    SceneCase { name: "overcast", sun: [210.0, 35.0, 0.0], sky: 0.3, ..GROVE },
    SceneCase { name: "moonless", sky: 0.0, ..GROVE },
    SceneCase { name: "sunset", sun: [120.0, 0.5, 1.0], ..HILLS },
    SceneCase { name: "hills-shader-map", knobs: FAR, ..HILLS },
    SceneCase { name: "hotspot-shader-map", knobs: FAR, ..HOTSPOT },
    SceneCase {
        name: "hand-over",
        camera: ([600.0, 40.0, 60.0], [600.0, 600.0, 0.0], 40.0),
        knobs: &[("zfield_min_pixels", 3.0)],
        ..GROVE
    },
    SceneCase { name: "silhouettes", knobs: &[("zfield_min_pixels", 8.0)], ..HILLS },
    SceneCase { name: "inside", camera: ([600.0, 600.0, 3.0], [640.0, 590.0, 6.0], 80.0), ..GROVE },
    SceneCase { name: "telephoto", camera: ([200.0, 200.0, 40.0], [600.0, 600.0, 5.0], 4.0), ..GROVE },
    SceneCase { name: "one-sample", knobs: &[("samples", 1.0)], ..GROVE },
    SceneCase { name: "accumulated", knobs: &[("accumulation", 4.0)], ..GROVE },
    SceneCase { name: "one-cascade", knobs: &[("cascades", 1.0)], ..ABOVE },
    SceneCase {
        name: "accurate-rays",
        knobs: &[("view_iterations", 3.0), ("light_iterations", 2.0), ("transfer_bands", 2.0)],
        ..GROVE
    },
    SceneCase { name: "light-transfer", knobs: &[("transfer_bands", 1.0)], ..GROVE },
    SceneCase { name: "all-orders", knobs: &[("indirect", 1.0)], ..HILLS },
    SceneCase { name: "windy", wind: 15.0, ..GROVE },
    NEAR,
    SceneCase { name: "near-inside", camera: ([600.0, 600.0, 3.0], [640.0, 590.0, 6.0], 80.0), ..NEAR },
    SceneCase { name: "near-all-orders", sun: [45.0, 12.0, 1.0], knobs: &[("indirect", 1.0)], ..NEAR },
    SceneCase { name: "near-windy", wind: 15.0, ..NEAR },
    SceneCase { name: "near-accumulated", knobs: &[("accumulation", 4.0)], ..NEAR },
    SceneCase { name: "near-harmonics", knobs: &[("light_model", 1.0)], ..NEAR },
    CARDS,
    // Upright cards edge-on, of which the level one is left.
    SceneCase { name: "cards-above", near: CARD_LADDER, knobs: FEW_CARDS, ..ABOVE },
    SceneCase { name: "cards-inside", camera: ([600.0, 600.0, 3.0], [640.0, 590.0, 6.0], 80.0), ..CARDS },
    SceneCase { name: "cards-sunset", sun: [120.0, -0.5, 1.0], ..CARDS },
    SceneCase { name: "cards-windy", wind: 15.0, ..CARDS },
    SceneCase {
        name: "cards-all-orders",
        knobs: &[("cards", 30.0), ("card_atlas", 256.0), ("cloud_min_pixels", 24.0), ("indirect", 1.0)],
        ..CARDS
    },
    SceneCase {
        name: "cards-one-sample",
        knobs: &[("cards", 30.0), ("card_atlas", 256.0), ("samples", 1.0)],
        ..CARDS
    },
    SHELLS,
    // Slices from straight above, and many trees one by one that hand over to them.
    SceneCase { name: "shells-above", near: SHELL_LADDER, knobs: FEW_SLICES, ..ABOVE },
    // The eye is below all slices but the lowest, and there is nothing else.
    SceneCase {
        name: "shells-inside",
        camera: ([600.0, 600.0, 3.0], [640.0, 590.0, 6.0], 80.0),
        near: "shells",
        knobs: FEW_SLICES,
        ..GROVE
    },
    SceneCase { name: "shells-sunset", sun: [120.0, -0.5, 1.0], ..SHELLS },
    SceneCase { name: "shells-windy", wind: 15.0, ..SHELLS },
    SceneCase {
        name: "shells-all-orders",
        knobs: &[("shell_slices", 8.0), ("shell_texels", 32.0), ("indirect", 1.0)],
        ..SHELLS
    },
    SceneCase {
        name: "shells-one-sample",
        knobs: &[("shell_slices", 8.0), ("shell_texels", 32.0), ("samples", 1.0)],
        ..SHELLS
    },
    SceneCase {
        name: "cards-shells",
        near: "mesh:48,cards:16,shells",
        knobs: &[("cards", 30.0), ("card_atlas", 256.0), ("shell_slices", 8.0), ("shell_texels", 32.0)],
        ..HILLS
    },
    SceneCase { name: "shells-lod", near: SHELL_LADDER, mode: ViewMode::Lod, ..SHELLS },
    SceneCase { name: "all-rungs", near: ALL_RUNGS, ..CARDS },
    SceneCase { name: "all-rungs-lod", near: ALL_RUNGS, mode: ViewMode::Lod, ..CARDS },
    SceneCase { name: "mode-fractions", mode: ViewMode::Fractions, ..GROVE },
    SceneCase { name: "mode-coverage", mode: ViewMode::Coverage, ..ABOVE },
    SceneCase { name: "mode-lod", mode: ViewMode::Lod, ..HILLS },
    SceneCase { name: "mode-cascades", mode: ViewMode::Cascades, ..GROVE },
    SceneCase { name: "mode-normals", mode: ViewMode::Normals, ..HILLS },
];

/// A scene by name.
pub fn find(name: &str) -> Result<&'static SceneCase> {
    let found = ALL.iter().find(|s| s.name == name);
    found.ok_or_else(|| Error::Usage(format!("no scene \"{name}\" in the suite")))
}

impl SceneCase {
    /// Whether near trees are meshes or clouds of cards.
    pub fn is_near(&self) -> bool {
        !self.near.is_empty()
    }

    /// What finds the samples of its trees: what must hold of a frame must hold of each.
    pub fn rasterizers(&self) -> &'static [Rasterizer] {
        if self.is_near() { &[Rasterizer::Tiles] } else { &RASTERIZERS }
    }

    /// The scene, with coarse views and small maps so that it is quick to bake and draw, and its camera.
    pub fn load(&self) -> Result<(Scene, Camera)> {
        let (position, target, fov) = self.camera;
        let [azimuth, elevation, irradiance] = self.sun;
        let text = format!(
            "name = \"{}\"\nseed = 7\n{}[sun]\nazimuth = {azimuth:?}\nelevation = {elevation:?}\nirradiance = {irradiance:?}\n\
             [sky]\nradiance = {:?}\n[wind]\nspeed = {:?}\nazimuth = 300.0\ngustiness = 0.7\n\
             [[camera]]\nname = \"c\"\nposition = {position:?}\ntarget = {target:?}\nvertical_fov = {fov:?}\n\
             [quality]\npreset = \"fast\"\nview_rings = 4\nview_resolution = 64\nocclusion_rays = 16\ncascade_size = 256\n\
             coverage_size = 64\nzfield_min_pixels = 4.0\ntable_angles = 8\ntable_densities = 4\ntable_rays = 128\n",
            self.name, self.ground, self.sky, self.wind
        );
        let mut scene = scene::parse(&text, Path::new(self.name))?;
        scene.time = TIME;
        scene.ladder = match self.is_near() {
            true => self.near.parse().map_err(|e| Error::Usage(format!("{}: {e}", self.name)))?,
            false => Ladder::BN12,
        };
        for (knob, value) in self.knobs {
            scene.settings.set(knob, *value)?;
        }
        let camera = scene.cameras.first().cloned();
        let camera = camera.ok_or_else(|| Error::Usage(format!("{}: no camera", self.name)))?;
        Ok((scene, camera))
    }
}
