//! The numbers that make a species (Weber and Penn 1995, section 4 and appendix), with the paper's names.
//!
//! Left out: segment splits, lobes and pruning; three levels of stems and cards showing whole sprays of leaves make up
//! for the finer levels.

use serde::Deserialize;

/// The crown's outline: how long a branch is by its place on the trunk (paper, section 4.3; its flame is left out, at
/// whose top branches have no length).
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Shape {
    /// Longest below.
    Conical,
    /// Longest below, to a point; not in the paper.
    Spire,
    /// Longest in the middle.
    Spherical,
    /// Longest below, with a round top.
    Hemispherical,
    /// The same everywhere.
    Cylindrical,
    /// Half as long above as below.
    TaperedCylindrical,
    /// Longest above.
    InverseConical,
    /// A leaf-shaped outline with a narrow base.
    TendFlame,
}

impl Shape {
    /// `ShapeRatio(shape, ratio)`; the ratio is 0 at the crown's top and 1 at its base.
    pub fn ratio(self, ratio: f64) -> f64 {
        match self {
            Shape::Conical => 0.2 + 0.8 * ratio,
            Shape::Spire => 0.04 + 0.96 * ratio,
            Shape::Spherical => 0.2 + 0.8 * (std::f64::consts::PI * ratio).sin(),
            Shape::Hemispherical => 0.2 + 0.8 * (std::f64::consts::FRAC_PI_2 * ratio).sin(),
            Shape::Cylindrical => 1.0,
            Shape::TaperedCylindrical => 0.5 + 0.5 * ratio,
            Shape::InverseConical => 1.0 - 0.8 * ratio,
            Shape::TendFlame if ratio <= 0.7 => 0.5 + 0.5 * ratio / 0.7,
            Shape::TendFlame => 0.5 + 0.5 * (1.0 - ratio) / 0.3,
        }
    }
}

/// The words for [`Shape`].
pub(super) const SHAPES: [&str; 8] = [
    "conical",
    "spire",
    "spherical",
    "hemispherical",
    "cylindrical",
    "tapered-cylindrical",
    "inverse-conical",
    "tend-flame",
];

/// A number and its variation, `n ± nV`.
pub(super) type Varied = [f64; 2];

/// Linear reflectance, red, green, blue.
pub(super) type Color = [f64; 3];

/// The trunk; angles in degrees.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Trunk {
    /// As [`Level::length`], relative to the tree's scale.
    pub length: Varied,
    /// As [`Level::curve`].
    #[serde(default)]
    pub curve: f64,
    /// As [`Level::curve_back`].
    #[serde(default)]
    pub curve_back: f64,
    /// As [`Level::curve_variation`].
    pub curve_variation: f64,
    /// As [`Level::segments`].
    pub segments: u32,
    /// As [`Level::taper`].
    pub taper: f64,
    /// As [`Level::sides`].
    pub sides: u32,
}

/// The stems of one level; angles in degrees. Level 0 is the trunk.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Level {
    /// `nBranches`: stems of this level on the longest stem of the level below.
    pub count: f64,
    /// `nLength`, relative to the tree (trunk) or to the parent.
    pub length: Varied,
    /// `nDownAngle` from the parent's axis; a negative variation makes it depend on the place on the parent.
    pub down_angle: Varied,
    /// `nRotate` about the parent from one stem to the next; negative: to alternate sides.
    pub rotate: Varied,
    /// `nCurve`: the bend from base to tip, of the first half if there is a `curve_back`.
    #[serde(default)]
    pub curve: f64,
    /// `nCurveBack`: the bend of the second half, or 0.
    #[serde(default)]
    pub curve_back: f64,
    /// `nCurveV`: random bend, spread over the segments.
    pub curve_variation: f64,
    /// How far the stem turns towards the ground, however it lies; negative: towards the sky. Not in the paper, whose
    /// attraction leaves stems alone whose plane of bending is level.
    #[serde(default)]
    pub droop: f64,
    /// Part of the stem, from its base, that bears nothing.
    #[serde(default)]
    pub bare: f64,
    /// `nCurveRes`: segments of a stem.
    pub segments: u32,
    /// `nTaper`: 0 a cylinder, 1 a cone.
    pub taper: f64,
    /// Sides of a cross-section.
    pub sides: u32,
}

/// The blade of a leaf.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Blade {
    /// Rounded lobes, as an oak's.
    Lobed,
    /// Triangular with a drawn-out tip, as a birch's.
    Ovate,
    /// Nearly round, widest near its base, as a catalpa's.
    Heart,
    /// Long and narrow, as a willow's.
    Lance,
    /// Shoots bristling with needles.
    Needles,
}

/// The words for [`Blade`].
pub(super) const BLADES: [&str; 5] = ["lobed", "ovate", "heart", "lance", "needles"];

/// The leaf cards, each showing a spray.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Leaves {
    /// `Leaves`: sprays on a stem of the last level.
    pub count: f64,
    /// `LeafScale`: length of a spray, m.
    pub length: f64,
    /// `LeafScaleX`: width relative to length.
    pub width: f64,
    /// Angle from the stem, degrees.
    pub down_angle: Varied,
    /// Angle about the stem from one spray to the next, degrees.
    pub rotate: Varied,
    /// Cards of a spray: one, or two crossed.
    pub cards: u32,
    /// What is drawn on the card.
    pub blade: Blade,
    /// Pairs of leaves, or of side shoots with needles, on a spray.
    pub pairs: u32,
    /// Pairs of leaflets of a compound leaf; 0: leaves are simple.
    #[serde(default)]
    pub leaflets: u32,
    /// Length of a leaf, and half its width or that of a leaflet, in card sizes.
    pub blade_size: [f64; 2],
    /// Colour.
    pub color: Color,
    /// Which random drawing.
    pub drawing: u32,
}

/// What bark looks like.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Relief {
    /// Deep fissures along the trunk, as an oak's.
    Fissured,
    /// Plates, as a pine's.
    Plated,
    /// Even, as a birch's.
    Smooth,
}

/// The words for [`Relief`].
pub(super) const RELIEFS: [&str; 3] = ["fissured", "plated", "smooth"];

/// The bark's texture.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Bark {
    /// Its relief.
    pub relief: Relief,
    /// Colour of its depths.
    pub dark: Color,
    /// Colour of its heights.
    pub light: Color,
    /// Colour of lenticels across and of patches over it, if there are any.
    pub spots: Option<Color>,
    /// Height that one repeat of the texture covers, m; it is half as wide.
    pub repeat: f64,
}

/// A species.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Parameters {
    /// `Shape` of the crown.
    pub shape: Shape,
    /// `BaseSize`: part of the trunk without branches.
    pub base_size: f64,
    /// `Scale`: height, m.
    pub scale: Varied,
    /// `Ratio` of the trunk's radius to its length.
    pub ratio: f64,
    /// `RatioPower`: how fast radii fall with length from level to level.
    pub ratio_power: f64,
    /// `Flare` of the trunk's foot.
    pub flare: f64,
    /// `AttractionUp`: how much stems from the second level on turn up; negative, they hang.
    pub attraction_up: f64,
    /// Level 0.
    pub trunk: Trunk,
    /// Level 1, on the trunk.
    pub branches: Level,
    /// Level 2, on the branches.
    pub twigs: Level,
    /// The leaves on the twigs; without them the tree is bare.
    pub leaves: Option<Leaves>,
    /// The bark.
    pub bark: Bark,
}

impl Parameters {
    /// Trunk, branches, twigs.
    pub fn levels(&self) -> [Level; 3] {
        let Trunk { length, curve, curve_back, curve_variation, segments, taper, sides } = self.trunk;
        let upright = Level {
            count: 1.0,
            length,
            down_angle: [0.0; 2],
            rotate: [0.0; 2],
            curve,
            curve_back,
            curve_variation,
            droop: 0.0,
            bare: 0.0,
            segments,
            taper,
            sides,
        };
        [upright, self.branches, self.twigs]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The words of a list as values of a type.
    fn words<T: serde::de::DeserializeOwned>(words: &[&str]) -> Vec<T> {
        words.iter().map(|w| toml::Value::from(*w).try_into().unwrap()).collect()
    }

    #[test]
    fn every_word_is_understood() {
        assert_eq!(words::<Blade>(&BLADES).len() + words::<Relief>(&RELIEFS).len(), 8);
    }

    #[test]
    fn shape_ratios_are_continuous_and_positive() {
        for shape in words::<Shape>(&SHAPES) {
            for i in 0..1000 {
                let (a, b) = (f64::from(i) / 1000.0, f64::from(i + 1) / 1000.0);
                assert!(
                    shape.ratio(a) > 0.0 && (shape.ratio(a) - shape.ratio(b)).abs() < 0.01,
                    "{shape:?} at {a}"
                );
            }
        }
    }
}
