//! Every knob: unit, range, meaning and cost, in one place. Presets are points in this space.

use crate::{Error, Result};

/// What a knob is.
#[derive(Clone, Copy, Debug)]
pub struct Knob {
    /// Name as written in scene files and after `--set`.
    pub name: &'static str,
    /// Unit, or empty.
    pub unit: &'static str,
    /// Smallest value.
    pub min: f64,
    /// Largest value.
    pub max: f64,
    /// Only whole numbers.
    pub whole: bool,
    /// Values at presets fast, balanced, accurate.
    pub presets: [f64; 3],
    /// Values that a sweep tries, towards the last, which is the most accurate within reason; empty for knobs that are no choice
    /// between time and accuracy.
    pub tries: &'static [f64],
    /// Another value needs another bake: minutes, once.
    pub bakes: bool,
    /// Meaning and cost.
    pub help: &'static str,
}

impl Knob {
    /// The values to try just below and just above one, where there are such.
    pub fn around(&self, value: f64) -> Vec<f64> {
        let below = self.tries.iter().copied().filter(|t| *t < value).reduce(f64::max);
        let above = self.tries.iter().copied().filter(|t| *t > value).reduce(f64::min);
        below.into_iter().chain(above).collect()
    }
}

/// Names of the presets, in the order of [`Knob::presets`].
pub const PRESETS: [&str; 3] = ["fast", "balanced", "accurate"];

macro_rules! knobs {
    ($($field:ident: $ty:tt, $unit:literal, $min:literal..=$max:literal, [$f:literal, $b:literal, $a:literal], $cost:ident [$($try:literal),*], $help:literal;)*) => {
        /// The value of every knob. What was measured before there was a knob says nothing of it, and has it at its default.
        #[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
        #[serde(default)]
        pub struct Settings { $(#[doc = $help] pub $field: $ty,)* }

        /// Every knob, in the order of printing.
        pub const KNOBS: &[Knob] = &[$(Knob {
            name: stringify!($field), unit: $unit, min: $min as f64, max: $max as f64,
            whole: knobs!(@whole $ty), presets: [$f as f64, $b as f64, $a as f64],
            tries: &[$($try as f64),*], bakes: knobs!(@bakes $cost), help: $help,
        },)*];

        impl Settings {
            fn write(&mut self, name: &str, value: f64) {
                match name { $(stringify!($field) => self.$field = value as $ty,)* _ => unreachable!("checked by the caller") }
            }

            /// The value of a knob by name.
            pub fn get(&self, name: &str) -> Option<f64> {
                match name { $(stringify!($field) => Some(self.$field as f64),)* _ => None }
            }

            /// All knobs at a preset's values.
            fn at(index: usize) -> Self {
                Settings { $($field: [$f as f64, $b as f64, $a as f64][index] as $ty,)* }
            }
        }
    };
    (@whole u32) => { true };
    (@whole f32) => { false };
    (@bakes bake) => { true };
    (@bakes draw) => { false };
}

knobs! {
    view_rings: u32, "", 1..=16, [6, 10, 12], bake [4, 6, 9, 12], "rings n of z-field views: 2n(n+1)+1 views over the hemisphere (9: 181); memory and bake time grow with the square";
    view_resolution: u32, "texels", 16..=512, [128, 256, 256], bake [64, 128, 256, 512], "texels a side of a z-field view (a power of two); memory and bake time grow with the square";
    view_iterations: u32, "", 1..=4, [1, 2, 3], bake [1, 2, 3, 4], "fixed-point iterations for the view ray; each costs three texel fetches a fragment";
    light_iterations: u32, "", 0..=2, [2, 2, 2], bake [0, 1, 2], "iterations for the light ray; 0 leaves out what grows with its length; each costs three texel fetches a fragment; self-shadow is measured for 1";
    transfer_bands: u32, "", 0..=2, [1, 2, 2], bake [0, 1, 2], "bands of light transfer, which knows from where the sun reaches each texel's leaves (0: none); memory, and each three texel fetches a fragment";
    transfer_resolution: u32, "texels", 8..=512, [64, 128, 128], bake [32, 64, 128, 256], "texels a side of the light transfer of a view (a power of two, at most the view's): how sharp single leaves are lit where trees are large; memory grows with the square";
    occlusion_rays: u32, "", 8..=1024, [32, 64, 128], bake [16, 32, 64, 128, 256], "rays a cell for baked ambient occlusion; bake time";
    samples: u32, "", 1..=8, [4, 4, 8], draw [1, 4, 8], "samples a pixel (1, 4 or 8, as far as the device goes): levels of opacity; fill cost";
    accumulation: u32, "", 1..=64, [1, 1, 1], draw [1, 4, 16], "frames whose mean a picture is, each shifted by a part of a pixel; all that is drawn to the image is drawn so often, but streaming and shadow maps are not";
    mesh_min_pixels: f32, "px", 16.0..=65536.0, [384.0, 256.0, 192.0], draw [], "apparent tree height under which trees are no longer their models' meshes, where the ladder has that rung; cost grows with its inverse square";
    leaf_pixels: f32, "px", 0.0..=256.0, [8.0, 6.0, 4.0], draw [12.0, 8.0, 6.0, 4.0, 0.0], "least side of a card of leaves on the screen: meshes whose cards would be smaller have fewer and larger ones, and coarser bark (0: meshes are always whole); cost of far meshes falls with its inverse square";
    mesh_shadow_texels: f32, "texels", 1.0..=1024.0, [16.0, 8.0, 2.0], draw [32.0, 16.0, 8.0, 4.0, 2.0], "least texels of a shadow map along a leaf for trees to cast into it as meshes, where any are, rather than as z-fields; cost of shadows of a moving camera grows with the inverse square";
    leaf_directions: u32, "", 8..=26, [14, 26, 26], bake [], "directions (8, 14 or 26) in which a leaf of a mesh knows the crown around it (BBP08: 8); memory, and time a pixel of mesh, grow in proportion";
    light_model: u32, "", 0..=1, [0, 0, 0], bake [], "how meshes are lit: 0 leaf by leaf by the crown around them (BBP08), 1 by spherical harmonics of three bands, as clouds of cards are (BCF05), smoother and at a third of the memory";
    indirect: u32, "", 0..=1, [0, 1, 1], bake [0, 1], "1: light that met more than one surface counts, what leaves, bark and ground hand to each other (10 to 30 % of all); 0: it is left out; bake time";
    cards: u32, "", 12..=500, [60, 60, 200], bake [30, 60, 120, 200], "most cards of a tree's cloud (BCF05: 50 to 200), where the ladder has that rung; time grows in proportion";
    card_atlas: u32, "texels", 256..=4096, [512, 1024, 2048], bake [256, 512, 1024, 2048], "texels a side of the pictures of all cards of a species (a power of two); memory grows with the square: 12 MB at 1024";
    cards_min_pixels: f32, "px", 0.25..=4096.0, [30.0, 30.0, 30.0], draw [60.0, 30.0, 15.0], "apparent tree height under which trees are no longer clouds of cards, where the ladder has that rung; cost grows with its inverse square";
    cloud_min_pixels: f32, "px", 1.0..=65536.0, [128.0, 64.0, 32.0], draw [256.0, 128.0, 64.0, 32.0], "apparent tree height under which a cloud of cards begins to give way to its far form of three cards, which it has at half of it";
    shell_slices: u32, "", 2..=32, [8, 16, 16], bake [4, 8, 16, 32], "slices of shell textures from the ground to the top of the tallest tree (a power of two), where the ladder has that rung; memory grows in proportion: 142 MiB of 16 of 128 texels";
    shell_texels: u32, "texels", 16..=256, [64, 128, 128], bake [32, 64, 128, 256], "texels a side of a tile of forest of shell textures (a power of two); memory and bake time grow with the square";
    shell_slice_pixels: f32, "px", 0.25..=64.0, [3.0, 2.0, 1.0], draw [8.0, 4.0, 3.0, 2.0, 1.0], "apparent distance between slices of shell textures, as far as there are as many: slices merge where they would be nearer; cost grows with its inverse";
    zfield_min_pixels: f32, "px", 0.25..=64.0, [6.0, 4.0, 3.0], draw [8.0, 6.0, 4.0, 3.0, 2.0, 1.5], "apparent tree height under which trees are no longer drawn one by one; cost grows with its inverse square";
    convergence: f32, "", 0.1..=0.8, [0.4, 0.45, 0.45], draw [0.3, 0.4, 0.45, 0.6, 0.8], "part of the tree-by-tree range at which light and shadow have become the averages of the tables (BN12, eq. 22-25: 0.8); cost of shadows grows with the square";
    silhouette_min_pixels: f32, "px", 0.25..=64.0, [1.0, 1.0, 1.0], draw [2.0, 1.0, 0.5], "apparent height under which trees on the silhouettes of ridges are no longer drawn either; from zfield_min_pixels on they are as others";
    zfield_max_trees: u32, "", 1..=16000000, [1000000, 2000000, 4000000], draw [], "most trees drawn one by one; bounds memory";
    cascades: u32, "", 1..=4, [3, 4, 4], draw [1, 2, 3, 4], "shadow cascades; each draws the trees of its slice again";
    cascade_size: u32, "texels", 64..=8192, [512, 2048, 4096], draw [256, 512, 1024, 2048, 4096], "texels a side of a cascade; fill cost";
    cascade_split: f32, "", 0.0..=1.0, [0.99, 0.99, 0.99], draw [0.5, 0.8, 0.95, 0.99], "0 uniform, 1 logarithmic cascade ranges (parallel-split)";
    shadow_distance: f32, "m", 0.0..=1000000.0, [0.0, 0.0, 0.0], draw [], "range of the cascades; 0 is as far as light has not converged";
    coverage_size: u32, "texels", 32..=1024, [128, 256, 512], draw [64, 128, 256, 512], "texels a side of the coverage tile of a terrain quad; memory and the time to make one grow with the square";
    terrain_pixels: f32, "px", 1.0..=64.0, [12.0, 8.0, 4.0], draw [20.0, 12.0, 8.0, 4.0, 2.0], "size of a terrain mesh cell on the screen; vertices grow with the inverse square";
    hotspot_amplitude: f32, "", 0.0..=1.0, [0.0, 0.0, 0.0], draw [], "a1 of a hotspot (BN12, eq. 8: 0.2) on top of the one that is measured from each mesh";
    hotspot_width: f32, "1/rad", 0.0..=1000.0, [20.0, 20.0, 20.0], draw [], "a2 of that hotspot (BN12, eq. 8)";
    ground_contrast: f32, "", 0.0..=4.0, [0.3, 0.3, 0.3], draw [1.0, 0.3], "a3: how much darker the ground is under trees than between them (BN12, eq. 10)";
    hole_radius: f32, "", 0.0..=10.0, [0.0, 0.0, 0.0], bake [2.0, 0.0], "radius of the hole around a tree that sky comes through, times the square root of the density (BN12, eq. 9: 2); 0: as measured from each mesh";
    table_angles: u32, "", 4..=32, [16, 16, 16], bake [8, 16, 24], "nodes of each angle in the tables of far trees; memory grows with the cube";
    table_densities: u32, "", 2..=16, [8, 8, 8], bake [4, 8, 16], "nodes of the density in the tables of far trees; memory";
    table_rays: u32, "", 32..=1048576, [1024, 2048, 8192], bake [512, 1024, 2048, 8192, 32768], "points on crowns that light in the tables of far trees is measured at, four to a ground point; error falls with the root, time grows in proportion";
    memory_mib: u32, "MiB", 16..=1048576, [2048, 2048, 4096], draw [], "most device memory a plan may take";
}

impl Default for Settings {
    fn default() -> Self {
        Settings::at(1)
    }
}

impl Settings {
    /// Texels a side of the light transfer of a view: no more than the view has.
    pub fn transfer_side(&self) -> u32 {
        self.transfer_resolution.min(self.view_resolution)
    }

    /// Levels by which these texels are larger than the view's.
    pub fn transfer_levels(&self) -> u32 {
        (self.view_resolution / self.transfer_side()).ilog2()
    }

    /// All knobs at a preset's values; `None` if there is no such preset.
    pub fn preset(name: &str) -> Option<Self> {
        PRESETS.iter().position(|p| *p == name).map(Settings::at)
    }

    /// Sets a knob by name. Errors say what is allowed and name the nearest knob.
    pub fn set(&mut self, name: &str, value: f64) -> Result<()> {
        let Some(knob) = KNOBS.iter().find(|k| k.name == name) else {
            let hint = nearest(name, KNOBS.iter().map(|k| k.name))
                .map_or(String::new(), |n| format!("; the nearest is \"{n}\""));
            return Err(Error::Usage(format!("no knob \"{name}\"{hint}")));
        };
        let whole = !knob.whole || value.fract() == 0.0;
        let power = !matches!(
            name,
            "view_resolution"
                | "transfer_resolution"
                | "card_atlas"
                | "shell_slices"
                | "shell_texels"
                | "coverage_size"
                | "cascade_size"
        ) || (value as u64).is_power_of_two();
        let one_of = match name {
            "samples" => matches!(value as u32, 1 | 4 | 8),
            "leaf_directions" => matches!(value as u32, 8 | 14 | 26),
            _ => true,
        };
        if !value.is_finite() || value < knob.min || value > knob.max || !whole || !power || !one_of {
            let kind = match name {
                _ if !power
                    || name.ends_with("_size")
                    || name.ends_with("_resolution")
                    || name.ends_with("_atlas")
                    || name.starts_with("shell_") && knob.whole =>
                {
                    "a power of two, "
                }
                _ if knob.whole => "a whole number, ",
                _ => "",
            };
            let range = format!("{kind}{} to {} {}", knob.min, knob.max, knob.unit);
            let takes = match name {
                "samples" => "1, 4 or 8",
                "leaf_directions" => "8, 14 or 26",
                _ => range.trim_end(),
            };
            return Err(Error::Usage(format!("knob \"{name}\" is {value}; it takes {takes}")));
        }
        self.write(name, value);
        Ok(())
    }
}

/// The candidate with the smallest edit distance to `name`, if it is near enough to be meant.
pub fn nearest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    candidates
        .into_iter()
        .map(|c| (strsim::damerau_levenshtein(name, c), c))
        .min()
        .filter(|(d, c)| *d <= c.len().div_ceil(2))
        .map(|(_, c)| c)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn presets_are_in_range() {
        for (i, preset) in PRESETS.iter().enumerate() {
            let mut s = Settings::preset(preset).unwrap();
            for k in KNOBS {
                s.set(k.name, k.presets[i]).unwrap();
                assert_eq!(s.get(k.name), Some(k.presets[i] as f32 as f64).filter(|_| true), "{}", k.name);
            }
        }
    }

    #[test]
    fn values_to_try_are_allowed_and_lie_on_both_sides() {
        for k in KNOBS {
            let mut s = Settings::default();
            k.tries.iter().for_each(|t| s.set(k.name, *t).unwrap());
            assert!(k.tries.is_empty() || k.presets.iter().all(|p| !k.around(*p).is_empty()), "{}", k.name);
        }
        let pixels = KNOBS.iter().find(|k| k.name == "zfield_min_pixels").unwrap();
        assert_eq!((pixels.around(3.0), pixels.around(1.5)), (vec![2.0, 4.0], vec![2.0]));
        assert_eq!(pixels.around(5.0), [4.0, 6.0]);
    }

    #[test]
    fn wrong_knobs_are_refused_with_a_hint() {
        let mut s = Settings::default();
        let e = s.set("cascade", 4.0).unwrap_err().to_string();
        assert!(e.contains("\"cascades\""), "{e}");
        for (name, value) in [
            ("samples", 3.0),
            ("cascades", 2.5),
            ("cascade_size", 1000.0),
            ("terrain_pixels", f64::NAN),
            ("view_rings", 0.0),
        ] {
            assert!(s.set(name, value).is_err(), "{name} = {value}");
        }
        assert_eq!(s, Settings::default());
    }
}
