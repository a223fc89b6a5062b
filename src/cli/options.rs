//! Options that several commands share.

use std::path::PathBuf;
use std::time::Duration;

use canopy::gpu::{Gpu, GpuOptions, Validation};
use canopy::ladder::Ladder;
use canopy::plan::{Drawing, Rasterizer};
use canopy::reference::{self, Light, Until};
use canopy::scene::{Camera, Scene};
use canopy::settings::{KNOBS, PRESETS, Settings};
use canopy::{Error, Result};
use clap::builder::{PossibleValuesParser, TypedValueParser};

/// Largest time of a scene, s.
const MOST_SECONDS: f64 = 1e9;

/// Which scene, from where, how large and how well.
#[derive(clap::Args)]
pub struct SceneOptions {
    /// Scene file (TOML); left out: the built-in scene, which needs no file
    pub scene: Option<PathBuf>,
    /// Image size in pixels
    #[arg(long, value_name = "WIDTHxHEIGHT", default_value = "1024x768", value_parser = size)]
    pub size: [u32; 2],
    /// Camera by its name in the scene; left out: the first
    #[arg(long, value_name = "NAME")]
    pub camera: Option<String>,
    /// Seed of everything random, instead of the scene's
    #[arg(long, value_name = "N")]
    pub seed: Option<u32>,
    /// Time of the scene, which moves what its [wind] does; along a camera path, that at which the path begins
    #[arg(long, value_name = "SECONDS", default_value_t = 0.0, allow_negative_numbers = true, value_parser = seconds)]
    pub time: f64,
    #[command(flatten)]
    pub quality: QualityOptions,
}

impl SceneOptions {
    /// The scene with everything that the options change, and the camera.
    pub fn load(&self) -> Result<(Scene, Camera)> {
        let mut scene = canopy::scene::load_at(self.scene.as_deref(), self.quality.preset.as_deref())?;
        self.quality.set(&mut scene.settings)?;
        if let Some(seed) = self.seed {
            scene.seed = seed;
        }
        scene.time = self.time;
        let camera = scene.camera(self.camera.as_deref())?.clone();
        Ok((scene, camera))
    }
}

/// Preset and knobs.
#[derive(clap::Args)]
pub struct QualityOptions {
    /// Preset of all knobs, instead of the scene's
    #[arg(long = "quality", value_name = "PRESET", value_parser = PossibleValuesParser::new(PRESETS))]
    pub preset: Option<String>,
    /// Set one knob; repeatable. The order: preset, then the scene's own knobs, then each --set
    #[arg(long, value_name = "KNOB=VALUE", value_parser = assignment)]
    pub set: Vec<(String, f64)>,
    /// How meshes are lit: leaf by leaf by the crown around them (BBP08), or by spherical harmonics as clouds of cards are (BCF05). Shorthand for the knob
    /// light_model
    #[arg(long, value_name = "NAME", value_parser = named(LIGHT_MODELS))]
    pub light_model: Option<f64>,
}

/// Values of the knob `light_model` with the names that users write.
const LIGHT_MODELS: [(&str, f64); 2] = [("leaf", 0.0), ("sh", 1.0)];

impl QualityOptions {
    /// Applies each `--set`, and `--light-model`.
    pub fn set(&self, settings: &mut Settings) -> Result<()> {
        let model = self.light_model.map(|value| ("light_model".to_string(), value));
        self.set.iter().chain(&model).try_for_each(|(name, value)| settings.set(name, *value))
    }

    /// The settings where no scene has a say.
    pub fn settings(&self) -> Result<Settings> {
        let preset = self.preset.as_deref().unwrap_or(PRESETS[1]);
        let mut settings =
            Settings::preset(preset).ok_or_else(|| Error::Usage(format!("no preset \"{preset}\"")))?;
        self.set(&mut settings)?;
        Ok(settings)
    }
}

/// On which device, and watched or not.
#[derive(clap::Args)]
pub struct DeviceOptions {
    /// Device by UUID or part of its name; left out: the best that fits (see `canopy devices`)
    #[arg(long, value_name = "UUID|NAME")]
    pub device: Option<String>,
    /// Watch with the Vulkan validation layers; any message makes the exit code 4
    #[arg(long)]
    pub validate: bool,
}

impl DeviceOptions {
    /// Opens the device, works with it and closes it. What the validation layers say comes first: it may be why the work
    /// failed.
    pub fn with<T>(&self, work: impl FnOnce(&Gpu) -> Result<T>) -> Result<T> {
        let validation = if self.validate { Validation::Full } else { Validation::Off };
        let gpu = Gpu::new(&GpuOptions { device: self.device.clone(), validation, ..GpuOptions::default() })?;
        let done = work(&gpu);
        match (gpu.close(), done) {
            (Err(e @ Error::Validation(_)), _) | (_, Err(e)) | (Err(e), Ok(_)) => Err(e),
            (Ok(()), Ok(value)) => Ok(value),
        }
    }
}

/// What finds the samples of trees.
#[derive(clap::Args, Clone, Copy)]
pub struct RasterizerOptions {
    /// What finds the samples of trees: the graphics pipeline, which lights every fragment, or compute tiles, which find what is
    /// seen and light it once. auto: tiles on devices that can read as many texels of a buffer as the plan's trees (eight each) and
    /// the image's samples take, else graphics, which draws no meshes
    #[arg(long = "rasterizer", value_name = "NAME", default_value = "auto", value_parser = rasterizers())]
    choice: RasterizerChoice,
}

impl RasterizerOptions {
    /// The one that was chosen; `None`: what suits the device.
    pub fn chosen(self) -> Option<Rasterizer> {
        self.choice.0
    }

    /// Trees drawn by a ladder, or by the scene's.
    pub fn drawing(self, ladder: Option<Ladder>) -> Drawing {
        Drawing { ladder, rasterizer: self.choice.0 }
    }
}

/// What stands for a tree.
#[derive(clap::Args, Clone, Copy)]
pub struct LadderOptions {
    /// What stands for a tree, near to far: rungs, each with the apparent height of a tree in pixels down to which it is used, such
    /// as mesh:256,zfield:4,shader-map; a height that is left out is the knob's. Instead of the scene's [quality] ladder
    #[arg(long, value_name = "RUNG:PIXELS,…,RUNG", value_parser = str::parse::<Ladder>, conflicts_with = "representation")]
    ladder: Option<Ladder>,
    /// Shorthand for a ladder: auto (mesh,zfield,shader-map; without mesh where that cannot be drawn), zfield or shader-map at any distance
    #[arg(long, value_name = "NAME", value_parser = named(Ladder::SHORTHANDS))]
    representation: Option<Ladder>,
}

impl LadderOptions {
    /// Gives a scene the ladder that was chosen, if one was.
    pub fn set(self, scene: &mut Scene) {
        scene.ladder = self.ladder.or(self.representation).unwrap_or(scene.ladder);
    }
}

/// A rasteriser, or none: whichever suits the device.
#[derive(Clone, Copy, Debug)]
pub struct RasterizerChoice(Option<Rasterizer>);

fn rasterizers() -> impl TypedValueParser<Value = RasterizerChoice> {
    named(Rasterizer::NAMES.map(|(name, r)| (name, RasterizerChoice(r))))
}

/// A parser of one of the names in a table, to its value.
pub fn named<T: Copy + Send + Sync + 'static, const N: usize>(
    names: [(&'static str, T); N],
) -> impl TypedValueParser<Value = T> {
    PossibleValuesParser::new(names.map(|n| n.0)).map(move |name| {
        // The parser lets only these through.
        names.iter().find(|n| n.0 == name).unwrap_or(&names[0]).1
    })
}

/// What draws: the renderer in one of its ways, or the Monte-Carlo reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Drawn {
    /// The renderer, on a Vulkan device.
    By(Ladder),
    /// The reference, on the CPU.
    Reference,
}

impl Drawn {
    /// All, with the names that users write.
    pub fn names() -> [(&'static str, Drawn); 4] {
        let [a, b, c] = Ladder::SHORTHANDS.map(|(name, r)| (name, Drawn::By(r)));
        [a, b, c, ("reference", Drawn::Reference)]
    }

    /// The name that users write.
    pub fn name(self) -> String {
        match self {
            Drawn::By(ladder) => ladder.name(),
            Drawn::Reference => "reference".into(),
        }
    }
}

/// How the Monte-Carlo reference is made.
#[derive(clap::Args, Clone, Copy, Debug)]
pub struct ReferenceOptions {
    /// Reference: when to stop. An error such as 1%, samples a pixel such as 16spp, or a time such as 60s
    #[arg(long, value_name = "1%|16spp|60s", value_parser = goal)]
    pub until: Option<Goal>,
    /// Reference: which light is on
    #[arg(long, value_name = "NAME", value_parser = named(Light::NAMES))]
    pub light: Option<Light>,
    /// Reference: surfaces that light may meet on its way. 1 is single scattering, full any number [default: full]
    #[arg(long, value_name = "1|N|full", value_parser = bounces)]
    pub bounces: Option<Bounces>,
    /// Reference: seed of the samples; other seeds give independent images [default: 1]
    #[arg(long, value_name = "N")]
    pub sample_seed: Option<u32>,
}

impl ReferenceOptions {
    /// Refuses them where nothing is drawn by the reference.
    pub fn refuse(&self) -> Result<()> {
        let given = [
            (self.until.is_some(), "--until"),
            (self.light.is_some(), "--light"),
            (self.bounces.is_some(), "--bounces"),
            (self.sample_seed.is_some(), "--sample-seed"),
        ];
        match given.into_iter().find(|g| g.0) {
            Some((_, name)) => Err(Error::Usage(format!("{name} is for --representation reference"))),
            None => Ok(()),
        }
    }

    /// The library's options; an error is the image's, or with `of_mean` that of its mean.
    pub fn options(&self, default: Until, of_mean: bool) -> reference::Options {
        let until = self.until.map_or(default, |g| match g.0 {
            Until::Error(e) if of_mean => Until::ErrorOfMean(e),
            other => other,
        });
        reference::Options {
            light: self.light.unwrap_or_default(),
            bounces: self.bounces.and_then(|b| b.0),
            seed: self.sample_seed.unwrap_or(1),
            until,
        }
    }
}

/// A goal as users write it.
#[derive(Clone, Copy, Debug)]
pub struct Goal(pub Until);

/// A number of bounces as users write it.
#[derive(Clone, Copy, Debug)]
pub struct Bounces(pub Option<u32>);

/// "1%", "16spp", "60s".
pub fn goal(text: &str) -> std::result::Result<Goal, String> {
    let form = || "write an error such as 1%, samples such as 16spp, or a time such as 60s".to_string();
    let number = |t: &str| t.trim().parse::<f64>().ok().filter(|v| v.is_finite()).ok_or_else(form);
    if let Some(percent) = text.strip_suffix('%') {
        let error = number(percent)? / 100.0;
        let fits = (1e-6..1.0).contains(&error);
        return if fits { Ok(Goal(Until::Error(error))) } else { Err("0.0001% to 99%".into()) };
    }
    if let Some(samples) = text.strip_suffix("spp") {
        return match samples.trim().parse().map_err(|_| form())? {
            n @ 2..=16_777_216 => Ok(Goal(Until::Samples(n))),
            _ => Err("2spp, which a variance needs, to 16777216spp".into()),
        };
    }
    let seconds = number(text.strip_suffix('s').ok_or_else(form)?)?;
    let fits = (0.001..=1e9).contains(&seconds);
    if fits {
        Ok(Goal(Until::Time(Duration::from_secs_f64(seconds))))
    } else {
        Err("0.001s to 1000000000s".into())
    }
}

/// "1", "full".
pub fn bounces(text: &str) -> std::result::Result<Bounces, String> {
    match (text, text.parse::<u32>()) {
        ("full", _) => Ok(Bounces(None)),
        (_, Ok(n @ 1..)) => Ok(Bounces(Some(n))),
        _ => Err("write a number from 1 on, or full".into()),
    }
}

/// What to print.
#[derive(clap::Args, Clone, Copy)]
pub struct PrintOptions {
    /// Print nothing but errors (and the object of --json)
    #[arg(long)]
    pub quiet: bool,
    /// Print one JSON object on the standard output, and nothing else there
    #[arg(long)]
    pub json: bool,
}

/// `WIDTHxHEIGHT`.
pub fn size(text: &str) -> std::result::Result<[u32; 2], String> {
    let form = || "write WIDTHxHEIGHT in pixels, such as 1024x768".to_string();
    let (width, height) = text.split_once(['x', 'X', '×']).ok_or_else(form)?;
    let side = |s: &str| -> std::result::Result<u32, String> {
        let n = s.trim().parse().map_err(|_| form())?;
        if (1..=65536).contains(&n) { Ok(n) } else { Err(format!("{n} pixels; a side has 1 to 65536")) }
    };
    Ok([side(width)?, side(height)?])
}

/// `KNOB=VALUE`.
pub fn assignment(text: &str) -> std::result::Result<(String, f64), String> {
    let (name, value) = text.split_once('=').ok_or("write KNOB=VALUE, such as samples=8")?;
    let number = value.trim().parse().map_err(|_| format!("\"{value}\" is no number"))?;
    Ok((name.trim().to_string(), number))
}

/// `K/N`, part K of N, from 1.
pub fn shard(text: &str) -> std::result::Result<(usize, usize), String> {
    let form = || "write K/N, such as 2/8: part K of N, from 1".to_string();
    let (k, n) = text.split_once('/').ok_or_else(form)?;
    let (k, n) = (k.parse().map_err(|_| form())?, n.parse().map_err(|_| form())?);
    if (1..=n).contains(&k) { Ok((k, n)) } else { Err(form()) }
}

/// "50ms", "90s", "30m", "2h".
pub fn time(text: &str) -> std::result::Result<Duration, String> {
    let form = || "write a time, such as 50ms, 90s, 30m or 2h".to_string();
    let digits = text.trim_end_matches(|c: char| c.is_ascii_alphabetic());
    let unit = match &text[digits.len()..] {
        "ms" => 1e-3,
        "s" => 1.0,
        "m" => 60.0,
        "h" => 3600.0,
        _ => return Err(form()),
    };
    let number: f64 = digits.trim().parse().map_err(|_| form())?;
    Duration::try_from_secs_f64(number * unit).map_err(|_| form())
}

/// A time of a scene, s.
pub fn seconds(text: &str) -> std::result::Result<f64, String> {
    match text.parse() {
        Ok(time) if (-MOST_SECONDS..=MOST_SECONDS).contains(&time) => Ok(time),
        _ => Err(format!("write seconds, from -{MOST_SECONDS} to {MOST_SECONDS}")),
    }
}

/// Every knob, for `--help`.
pub fn knobs_help() -> String {
    let mut text = String::from("Knobs for --set and [quality] (fast / balanced / accurate):\n");
    for k in KNOBS {
        let [fast, balanced, accurate] = k.presets;
        text += &format!("  {} = {fast} / {balanced} / {accurate}", k.name);
        text +=
            &format!("   [{} to {}{}{}]\n", k.min, k.max, if k.unit.is_empty() { "" } else { " " }, k.unit);
        text += &format!("      {}\n", k.help);
    }
    text
}
