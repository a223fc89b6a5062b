//! Procedural species, written as glTF and read back as glTF.
//!
//! The model is that of Weber and Penn, "Creation and Rendering of Realistic Trees" (SIGGRAPH 1995): stems in three
//! levels, each described by a table of numbers (`parameters`; `keys`; `species/*.toml`), grown into a skeleton (`skeleton`),
//! covered with tapered cylinders and leaf cards (`surface`), and dressed in two made textures (`bark`, `cards`). A
//! species and a seed give the same bytes every time.

mod bark;
mod cards;
pub(crate) mod export;
mod keys;
mod limits;
mod parameters;
mod random;
mod skeleton;
mod species;
pub(crate) mod surface;

use std::str::FromStr;

use self::parameters::Parameters;
pub use keys::{KEYS, Key};
pub use species::Species;

/// Seed of built-in models: every scene shows the same individual, so that what is baked from it is shared.
pub const BUILTIN_SEED: u32 = 1;

macro_rules! presets {
    ($count:literal: $($preset:ident $name:literal, $meaning:literal;)*) => {
        /// A species that needs no file.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum Preset { $(#[doc = $meaning] $preset,)* }

        impl Preset {
            /// Every preset.
            pub const ALL: [Preset; $count] = [$(Preset::$preset,)*];

            /// The name on the command line and after `builtin:`.
            pub fn name(self) -> &'static str {
                match self { $(Preset::$preset => $name,)* }
            }

            /// What it looks like, in a line.
            pub fn meaning(self) -> &'static str {
                match self { $(Preset::$preset => $meaning,)* }
            }

            /// Its numbers, as TOML.
            pub fn text(self) -> &'static str {
                match self { $(Preset::$preset => include_str!(concat!("species/", $name, ".toml")),)* }
            }
        }
    };
}

presets! { 10:
    Oak "oak", "a broad, round crown, about 15 m";
    Pine "pine", "a conical crown of long needles, about 20 m";
    Birch "birch", "slender, with hanging twigs, about 14 m";
    Poplar "poplar", "a dense, very slim column, about 22 m";
    Acacia "acacia", "a flat, wide umbrella on a bare trunk, about 9 m";
    Willow "willow", "long twigs that hang to the ground, about 11 m";
    Ash "ash", "an open crown with big gaps, about 16 m";
    Catalpa "catalpa", "few, very big leaves, about 10 m";
    Spruce "spruce", "a dense cone down to the ground, about 24 m";
    Snag "snag", "dead: bare to its twigs, about 12 m";
}

impl FromStr for Preset {
    type Err = crate::Error;

    /// The preset of a name; the error names the nearest one.
    fn from_str(name: &str) -> crate::Result<Self> {
        Preset::ALL.into_iter().find(|p| p.name() == name).ok_or_else(|| {
            let names = Preset::ALL.map(Preset::name);
            let hint = match crate::settings::nearest(name, names) {
                Some(near) => format!("did you mean \"{near}\"?"),
                None => format!("there are {}", names.join(", ")),
            };
            crate::Error::Usage(format!("no tree \"{name}\"; {hint}"))
        })
    }
}

/// One individual of a preset as binary glTF 2.0: metres, y up, trunk base at the origin, materials `bark` and, unless
/// the species is bare, `leaf`.
///
/// The same preset and seed give the same bytes; different seeds differ in every branch.
pub fn glb(preset: Preset, seed: u32) -> Vec<u8> {
    let parameters = toml::from_str(preset.text()).expect("a test reads the text of every preset");
    individual(&parameters, seed)
}

fn individual(parameters: &Parameters, seed: u32) -> Vec<u8> {
    let skeleton = skeleton::grow(parameters, seed);
    let bark = (surface::bark(parameters, &skeleton), bark::draw(&parameters.bark));
    let leaves = parameters.leaves.map(|l| (surface::leaves(&l, &skeleton), cards::draw(&l)));
    let mut parts = vec![export::Part { name: "bark", surface: &bark.0, image: &bark.1, cutout: false }];
    if let Some((surface, image)) = &leaves {
        parts.push(export::Part { name: "leaf", surface, image, cutout: true });
    }
    export::glb(&parts)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_round_trip_and_mistakes_get_a_hint() {
        for preset in Preset::ALL {
            assert_eq!(preset.name().parse::<Preset>().unwrap(), preset);
        }
        let e = "brich".parse::<Preset>().unwrap_err();
        assert!(e.to_string().contains("\"birch\"") && e.exit_code() == 2, "{e}");
    }
}
