//! The numbers that make a species (Weber and Penn 1995, section 4 and appendix), with the paper's names.
//!
//! Left out: segment splits, lobes and pruning; three levels of stems and cards showing whole sprays of leaves make up
//! for the finer levels.

use super::Preset;

/// The crown's outline: how long a branch is by its place on the trunk (paper, section 4.3).
#[derive(Clone, Copy, Debug)]
pub(super) enum Shape {
    /// Longest below.
    Conical,
    /// Longest in the middle.
    Spherical,
    /// A leaf-shaped outline with a narrow base.
    TendFlame,
}

impl Shape {
    /// `ShapeRatio(shape, ratio)`; the ratio is 0 at the crown's top and 1 at its base.
    pub fn ratio(self, ratio: f64) -> f64 {
        match self {
            Shape::Conical => 0.2 + 0.8 * ratio,
            Shape::Spherical => 0.2 + 0.8 * (std::f64::consts::PI * ratio).sin(),
            Shape::TendFlame if ratio <= 0.7 => 0.5 + 0.5 * ratio / 0.7,
            Shape::TendFlame => 0.5 + 0.5 * (1.0 - ratio) / 0.3,
        }
    }
}

/// A number and its variation, `n ± nV`.
pub(super) type Varied = [f64; 2];

/// The stems of one level; angles in degrees. Level 0 is the trunk.
#[derive(Clone, Copy, Debug)]
pub(super) struct Level {
    /// `nBranches`: stems of this level on the longest stem of the level below.
    pub branches: f64,
    /// `nLength`, relative to the tree (trunk) or to the parent.
    pub length: Varied,
    /// `nDownAngle` from the parent's axis; a negative variation makes it depend on the place on the parent.
    pub down_angle: Varied,
    /// `nRotate` about the parent from one stem to the next.
    pub rotate: Varied,
    /// `nCurve`: the bend from base to tip, of the first half if there is a `curve_back`.
    pub curve: f64,
    /// `nCurveBack`: the bend of the second half, or 0.
    pub curve_back: f64,
    /// `nCurveV`: random bend, spread over the segments.
    pub curve_variation: f64,
    /// `nCurveRes`: segments of a stem.
    pub segments: u32,
    /// `nTaper`: 0 a cylinder, 1 a cone.
    pub taper: f64,
    /// Sides of a cross-section.
    pub sides: u32,
}

/// The leaf cards, each showing a spray.
#[derive(Clone, Copy, Debug)]
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
}

/// A species.
#[derive(Clone, Copy, Debug)]
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
    /// Trunk, branches, twigs.
    pub levels: [Level; 3],
    /// The leaves on the twigs.
    pub leaves: Leaves,
    /// Height that one repeat of the bark texture covers, m; it is half as wide.
    pub bark_repeat: f64,
}

/// The parameters of a preset.
pub(super) fn of(preset: Preset) -> Parameters {
    match preset {
        Preset::Oak => Parameters {
            shape: Shape::Spherical,
            base_size: 0.16,
            scale: [13.2, 0.5],
            ratio: 0.026,
            ratio_power: 1.3,
            flare: 0.6,
            attraction_up: 0.25,
            levels: [
                Level {
                    branches: 1.0,
                    length: [0.92, 0.0],
                    down_angle: [0.0, 0.0],
                    rotate: [0.0, 0.0],
                    curve: 0.0,
                    curve_back: 0.0,
                    curve_variation: 24.0,
                    segments: 9,
                    taper: 1.0,
                    sides: 12,
                },
                Level {
                    branches: 36.0,
                    length: [0.54, 0.05],
                    down_angle: [64.0, -28.0],
                    rotate: [140.0, 18.0],
                    curve: -25.0,
                    curve_back: 20.0,
                    curve_variation: 55.0,
                    segments: 6,
                    taper: 1.0,
                    sides: 6,
                },
                Level {
                    branches: 18.0,
                    length: [0.40, 0.08],
                    down_angle: [48.0, 14.0],
                    rotate: [140.0, 35.0],
                    curve: -10.0,
                    curve_back: 0.0,
                    curve_variation: 80.0,
                    segments: 2,
                    taper: 1.0,
                    sides: 3,
                },
            ],
            leaves: Leaves {
                count: 5.0,
                length: 0.72,
                width: 0.9,
                down_angle: [42.0, 18.0],
                rotate: [140.0, 40.0],
            },
            bark_repeat: 1.6,
        },
        Preset::Pine => Parameters {
            shape: Shape::Conical,
            base_size: 0.1,
            scale: [19.2, 0.6],
            ratio: 0.014,
            ratio_power: 1.3,
            flare: 0.4,
            attraction_up: 0.15,
            levels: [
                Level {
                    branches: 1.0,
                    length: [1.0, 0.0],
                    down_angle: [0.0, 0.0],
                    rotate: [0.0, 0.0],
                    curve: 0.0,
                    curve_back: 0.0,
                    curve_variation: 12.0,
                    segments: 8,
                    taper: 1.0,
                    sides: 10,
                },
                Level {
                    branches: 70.0,
                    length: [0.2, 0.02],
                    down_angle: [78.0, -22.0],
                    rotate: [140.0, 20.0],
                    curve: -22.0,
                    curve_back: 0.0,
                    curve_variation: 30.0,
                    segments: 4,
                    taper: 1.0,
                    sides: 4,
                },
                Level {
                    branches: 15.0,
                    length: [0.36, 0.05],
                    down_angle: [60.0, -18.0],
                    rotate: [-160.0, 40.0],
                    curve: -12.0,
                    curve_back: 0.0,
                    curve_variation: 30.0,
                    segments: 2,
                    taper: 1.0,
                    sides: 3,
                },
            ],
            leaves: Leaves {
                count: 3.0,
                length: 0.78,
                width: 0.74,
                down_angle: [38.0, 15.0],
                rotate: [140.0, 30.0],
            },
            bark_repeat: 1.4,
        },
        Preset::Birch => Parameters {
            shape: Shape::TendFlame,
            base_size: 0.18,
            scale: [12.6, 0.4],
            ratio: 0.012,
            ratio_power: 1.4,
            flare: 0.35,
            attraction_up: -0.45,
            levels: [
                Level {
                    branches: 1.0,
                    length: [1.0, 0.0],
                    down_angle: [0.0, 0.0],
                    rotate: [0.0, 0.0],
                    curve: 0.0,
                    curve_back: 0.0,
                    curve_variation: 14.0,
                    segments: 9,
                    taper: 1.0,
                    sides: 10,
                },
                Level {
                    branches: 42.0,
                    length: [0.25, 0.04],
                    down_angle: [50.0, -18.0],
                    rotate: [140.0, 25.0],
                    curve: -15.0,
                    curve_back: 55.0,
                    curve_variation: 60.0,
                    segments: 5,
                    taper: 1.0,
                    sides: 5,
                },
                Level {
                    branches: 16.0,
                    length: [0.36, 0.08],
                    down_angle: [52.0, 15.0],
                    rotate: [140.0, 35.0],
                    curve: 10.0,
                    curve_back: 0.0,
                    curve_variation: 50.0,
                    segments: 3,
                    taper: 1.0,
                    sides: 3,
                },
            ],
            leaves: Leaves {
                count: 4.0,
                length: 0.5,
                width: 0.8,
                down_angle: [45.0, 18.0],
                rotate: [140.0, 40.0],
            },
            bark_repeat: 1.6,
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shape_ratios_are_continuous_and_positive() {
        for shape in [Shape::Conical, Shape::Spherical, Shape::TendFlame] {
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
