//! All metrics of one image against another.

use std::collections::BTreeMap;

use super::{
    Detail, DistanceBin, Estimate, RadianceError, Range, Region, detail, flip_error, over_distance,
    radiance_error, regions, relative_noise, spread, structural,
};
use crate::image::Layers;
use crate::{Error, Result};

/// Side of the squares of [`Difference::averaged`], pixels.
pub const AVERAGED: u32 = 4;

/// How far an image is from its reference.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Difference {
    /// Values of either image that are no finite numbers; metrics that meet one do not exist.
    pub not_finite: u64,
    /// Root of the reference's mean variance over its mean radiance; `None` for a reference without noise.
    pub reference_noise: Option<f64>,
    /// Error of radiance over the whole image, background included.
    pub image: Option<RadianceError>,
    /// The same without the background, which is right at any setting and may be brighter than all else.
    pub foreground: Option<RadianceError>,
    /// That of the mean radiance of squares of [`AVERAGED`]² pixels: what is left where single leaves do not count.
    pub averaged: Option<RadianceError>,
    /// The same by the reference's distance; ranges in which nothing is are left out.
    #[serde(default)]
    pub ranges: BTreeMap<Range, RadianceError>,
    /// That of single pixels by region of the reference; regions that do not exist are left out.
    pub regions: BTreeMap<Region, RadianceError>,
    /// Mean FLIP of the pictures as displayed.
    pub flip: Option<Estimate>,
    /// Structural similarity of the luminance as displayed.
    pub ssim: Option<Estimate>,
    /// Energy of detail within crowns over the reference's.
    pub detail: Option<Detail>,
    /// Radiance over the reference's by distance.
    pub over_distance: Vec<DistanceBin>,
    /// Largest of these ratios over the smallest, less 1.
    pub distance_spread: Option<f64>,
}

/// All metrics of an image against a reference, both displayed at an exposure.
///
/// # Errors
/// [`Error::Usage`] if they differ in size.
pub fn difference(actual: &Layers, reference: &Layers, exposure: f64) -> Result<Difference> {
    if actual.size != reference.size {
        let [[w, h], [rw, rh]] = [actual.size, reference.size];
        return Err(Error::Usage(format!(
            "an image of {w}x{h} pixels cannot be compared with one of {rw}x{rh}"
        )));
    }
    let wrong = |all: &[[f32; 3]]| all.iter().flatten().filter(|v| !v.is_finite()).count();
    let noise = reference.variance.as_deref().unwrap_or_default();
    let not_finite = wrong(&actual.radiance) + wrong(&reference.radiance) + wrong(noise);
    let all = regions(reference);
    let parts = [Region::Trees, Region::Ground, Region::Silhouettes, Region::Background];
    let of = |region| Some((region, radiance_error(actual, reference, |k| all[k] == region)?));
    let bins = over_distance(actual, reference);
    let squares = [actual, reference].map(|l| l.averaged(AVERAGED));
    let parts_of_squares = regions(&squares[1]);
    let seen = |k: usize| parts_of_squares[k] != Region::Background && squares[1].depth[k] > 0.0;
    let within = |(_, range): (_, Range)| {
        let counts = |k| seen(k) && Range::of(squares[1].depth[k]) == range;
        Some((range, radiance_error(&squares[0], &squares[1], counts)?))
    };
    Ok(Difference {
        not_finite: not_finite as u64,
        reference_noise: relative_noise(reference),
        image: radiance_error(actual, reference, |_| true),
        foreground: radiance_error(actual, reference, |k| all[k] != Region::Background),
        averaged: radiance_error(&squares[0], &squares[1], |k| parts_of_squares[k] != Region::Background),
        ranges: Range::NAMES.into_iter().filter_map(within).collect(),
        regions: parts.into_iter().filter_map(of).collect(),
        flip: flip_error(actual, reference, exposure),
        ssim: structural(actual, reference, exposure),
        detail: detail(actual, reference, &all),
        distance_spread: spread(&bins),
        over_distance: bins,
    })
}

#[cfg(test)]
mod tests {
    use super::super::fixtures::{mapped, texture};
    use super::*;

    #[test]
    fn regions_part_the_image() {
        let a = texture([60, 40], 1);
        let d = difference(&mapped(&a, |v| 1.2 * v), &a, 1.0).unwrap();
        let pixels: u64 = d.regions.values().map(|r| r.pixels).sum();
        let averaged = d.averaged.unwrap();
        assert!((averaged.bias.value - 0.2).abs() < 1e-6 && averaged.pixels < 2400 / 16, "{averaged:?}");
        assert_eq!((pixels, d.regions.len(), d.not_finite), (2400, 4, 0));
        assert!(d.regions.values().all(|r| (r.bias.value - 0.2).abs() < 1e-6), "{d:?}");
        assert!(d.distance_spread.unwrap() < 1e-6 && d.flip.unwrap().value > 0.0);
        assert!(difference(&a, &texture([40, 60], 1), 1.0).is_err());
    }

    #[test]
    fn ranges_are_those_of_the_distance() {
        let far = |metres: [f32; 3]| {
            let mut a = texture([60, 40], 1);
            a.depth = (0..2400).map(|k| metres[k % 60 / 20]).collect();
            a
        };
        let reference = far([20.0, 200.0, 2000.0]);
        // A third of the columns is half as bright again: all of one range.
        let mut brighter = reference.clone();
        for (_, c) in brighter.radiance.iter_mut().enumerate().filter(|(k, _)| k % 60 / 20 == 1) {
            *c = c.map(|v| 1.5 * v);
        }
        let d = difference(&brighter, &reference, 1.0).unwrap();
        let bias = |range: Range| d.ranges.get(&range).map(|e| e.bias.value);
        assert!(
            (bias(Range::Middle).unwrap() - 0.5).abs() < 1e-6 && bias(Range::Near).unwrap().abs() < 1e-6,
            "{:?}",
            d.ranges
        );
        // The third third is background, and of it only what borders on the rest counts.
        let far = d.ranges.get(&Range::Far).map_or(0, |e| e.pixels);
        assert!(2 * far < d.ranges[&Range::Near].pixels, "{:?}", d.ranges);
        assert_eq!([63.9, 64.0, 512.0].map(Range::of), [Range::Near, Range::Middle, Range::Far]);
    }

    #[test]
    fn numbers_that_are_none_are_counted_and_spoil_only_what_meets_them() {
        let a = texture([60, 40], 1);
        let mut broken = a.clone();
        // Two values of one pixel among the trees.
        broken.radiance[5] = [f32::NAN, 0.1, f32::INFINITY];
        let d = difference(&broken, &a, 1.0).unwrap();
        assert_eq!((d.not_finite, d.image, d.flip, d.ssim), (2, None, None, None));
        assert!(!d.regions.contains_key(&Region::Trees) && d.regions.contains_key(&Region::Ground));
    }
}
