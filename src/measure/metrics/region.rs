//! Which pixels are trees, ground and silhouettes.

use crate::image::Layers;

/// Share of trees from which a pixel is trees, and one less this under which it is none.
const PURE: f32 = 0.95;

/// A part of the image, by what its reference shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Region {
    /// Trees cover more than 95 % of the pixel.
    Trees,
    /// Trees cover less than 5 % of it, background no more than 95 %.
    Ground,
    /// Trees cover 5 to 95 %, or the background begins here: among this pixel and its eight neighbours some are more than
    /// half background, and some are not.
    Silhouettes,
    /// Background, with nothing else beside it.
    Background,
}

/// The region of every pixel, from the fractions of the reference.
pub fn regions(reference: &Layers) -> Vec<Region> {
    let [width, height] = reference.size.map(|s| s as usize);
    let empty = |k: usize| reference.fractions[k].iter().sum::<f32>() < 0.5;
    (0..width * height)
        .map(|k| {
            let (x, y) = (k % width, k / width);
            let near = |c: usize, n: usize| c.saturating_sub(1)..(c + 2).min(n);
            let border = near(y, height).flat_map(|v| near(x, width).map(move |u| v * width + u));
            let [lit, shadowed, a, b] = reference.fractions[k];
            let trees = a + b;
            if (1.0 - PURE..=PURE).contains(&trees) || border.clone().any(|n| empty(n) != empty(k)) {
                Region::Silhouettes
            } else if trees > PURE {
                Region::Trees
            } else if lit + shadowed + trees < 1.0 - PURE {
                Region::Background
            } else {
                Region::Ground
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::fixtures::image;
    use super::*;

    #[test]
    fn every_pixel_is_in_the_region_that_its_reference_shows() {
        let mut picture = image([30, 3], |_| [0.0; 3]);
        picture.fractions[35] = [0.5, 0.0, 0.5, 0.0];
        let all = regions(&picture);
        let row = |y: usize| &all[30 * y..30 * y + 30];
        for (x, region) in row(0).iter().enumerate() {
            // The sky begins at 20: the pixels on both sides of that border see it.
            let expected = match x {
                0..10 => Region::Trees,
                10..19 => Region::Ground,
                19..21 => Region::Silhouettes,
                _ => Region::Background,
            };
            assert_eq!(*region, expected, "{x}");
        }
        assert_eq!(row(1)[5], Region::Silhouettes);
        assert_eq!(row(2), row(0));
        assert_eq!(regions(&image([1, 1], |_| [0.0; 3])), [Region::Trees]);
    }
}
