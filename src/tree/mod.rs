//! Procedural species, written as glTF and read back as glTF.
//!
//! The model is that of Weber and Penn, "Creation and Rendering of Realistic Trees" (SIGGRAPH 1995): stems in three
//! levels, each described by a row of numbers (`parameters`), grown into a skeleton (`skeleton`), covered with
//! tapered cylinders and leaf cards (`surface`), and dressed in two made textures (`images`). A preset and a seed
//! give the same bytes every time.

mod export;
mod images;
mod parameters;
mod random;
mod skeleton;
mod surface;

use std::str::FromStr;

/// Seed of built-in models: every scene shows the same individual, so that what is baked from it is shared.
pub const BUILTIN_SEED: u32 = 1;

/// A species that needs no file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Preset {
    /// A broad-crowned oak, about 15 m.
    Oak,
    /// A conical pine, about 20 m.
    Pine,
    /// A slender birch with hanging twigs, about 14 m.
    Birch,
}

impl Preset {
    /// Every preset.
    pub const ALL: [Preset; 3] = [Preset::Oak, Preset::Pine, Preset::Birch];

    /// The name on the command line and after `builtin:`.
    pub fn name(self) -> &'static str {
        match self {
            Preset::Oak => "oak",
            Preset::Pine => "pine",
            Preset::Birch => "birch",
        }
    }
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

/// One individual of a species as binary glTF 2.0: metres, y up, trunk base at the origin, materials `bark` and `leaf`.
///
/// The same preset and seed give the same bytes; different seeds differ in every branch.
pub fn glb(preset: Preset, seed: u32) -> Vec<u8> {
    let parameters = parameters::of(preset);
    let skeleton = skeleton::grow(&parameters, seed);
    let bark = surface::bark(&parameters, &skeleton);
    let leaf = surface::leaves(&parameters, &skeleton);
    export::glb(&[
        export::Part { name: "bark", surface: &bark, image: &images::bark(preset), cutout: false },
        export::Part { name: "leaf", surface: &leaf, image: &images::leaves(preset), cutout: true },
    ])
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
