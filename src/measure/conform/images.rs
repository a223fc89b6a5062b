//! Pictures against references, by FLIP (Andersson et al. 2020): what an eye would see of the difference.

use std::path::PathBuf;

use super::scenes::{SIZE, SceneCase};
use super::{Finding, Suite, driver_key, finding, frames, with_device};
use crate::image::png;
use crate::measure::metrics::flip;
use crate::{Error, Result};

/// Largest mean FLIP against a reference of the same driver build. Its images are the same to the bit on one processor; the
/// compiler behind it may fuse products and sums on another, which moves a sample here and there to the other side of an
/// edge: one of the four samples of a pixel that turns from leaf to sky is a mean FLIP of 7.5e-5. A dozen of them; 2 % of
/// brightness are 0.07.
const SAME_DRIVER: f64 = 0.001;
/// Largest mean FLIP against a reference of another driver, whose filters round otherwise and whose rasteriser may own other
/// pixels of an edge. Lavapipe 22.3.6 and 25.0.7 differ by 0.0005 at most; a GPU has other edges, not other light.
const OTHER_DRIVER: f64 = 0.02;

/// A picture, its reference and the map of their difference, each as PNG.
#[derive(Clone, Debug)]
pub struct Comparison {
    /// The reference, and whose it is; `None` if there is none.
    pub reference: Option<(String, Vec<u8>)>,
    /// What was drawn.
    pub actual: Vec<u8>,
    /// FLIP at each pixel in the colours of magma; `None` without a reference.
    pub map: Option<Vec<u8>>,
}

/// Draws a scene and compares it, or blesses it.
pub(super) fn check(suite: &Suite, case: &SceneCase) -> Result<Finding> {
    let options = &suite.options;
    let mut drawn = None;
    with_device(options, |gpu| {
        let first = case.rasterizers()[0];
        drawn = Some(frames::draw(gpu, options, case, first, false)?);
        Ok(finding(&[], String::new()))
    })?;
    let Some(picture) = drawn else { return Err(Error::Check("nothing was drawn".into())) };
    let actual = picture.rgb();
    let own = options.references.join(driver_key(&suite.driver));
    let file = format!("{}.png", case.name);
    if options.bless {
        std::fs::create_dir_all(&own).map_err(|e| Error::io(&own, e))?;
        picture.write_png(&own.join(&file))?;
        return Ok(finding(&[], "blessed".into()));
    }
    let Some((whose, path, bound)) = reference(suite, &own, &file)? else {
        let comparison = Comparison { reference: None, actual: encode(&actual)?, map: None };
        let missing = format!("no reference {}; canopy conform --bless writes it", own.join(&file).display());
        return Ok(Finding { failure: Some(missing), measured: String::new(), comparison: Some(comparison) });
    };
    let bytes = std::fs::read(&path).map_err(|e| Error::io(&path, e))?;
    let reference = image::load_from_memory(&bytes).map_err(|e| {
        Error::input(&path, "", format!("not a picture: {e}"), "restore it, or write it anew with --bless")
    })?;
    let reference = reference.to_rgb8();
    if [reference.width(), reference.height()] != SIZE {
        return Err(Error::input(&path, "", "another size than the suite's", "write it anew with --bless"));
    }
    let map = flip(SIZE, reference.as_raw(), &actual);
    let mean = map.mean();
    let problem = (mean > bound).then(|| format!("mean FLIP {mean:.5} against {whose}, at most {bound}"));
    Ok(Finding {
        comparison: Some(Comparison {
            reference: Some((whose.clone(), bytes)),
            actual: encode(&actual)?,
            map: Some(encode(&map.colours)?),
        }),
        ..finding(problem.as_slice(), format!("mean FLIP {mean:.5} against {whose}"))
    })
}

/// The reference of a picture, whose it is, and the largest mean FLIP. A driver with references of its own must have all of
/// them; one without any is held against whichever there are, first by name.
fn reference(suite: &Suite, own: &std::path::Path, file: &str) -> Result<Option<(String, PathBuf, f64)>> {
    if own.is_dir() {
        let path = own.join(file);
        return Ok(path.is_file().then(|| (driver_key(&suite.driver), path, SAME_DRIVER)));
    }
    let folder = &suite.options.references;
    let entries = std::fs::read_dir(folder).map_err(|e| Error::io(folder, e))?;
    let mut others: Vec<PathBuf> = entries.filter_map(|e| e.ok()).map(|e| e.path().join(file)).collect();
    others.retain(|p| p.is_file());
    others.sort();
    Ok(others.into_iter().next().map(|path| {
        let whose =
            path.parent().and_then(|p| p.file_name()).unwrap_or_default().to_string_lossy().into_owned();
        (whose, path, OTHER_DRIVER)
    }))
}

pub(super) fn encode(rgb: &[u8]) -> Result<Vec<u8>> {
    png(rgb, SIZE).map_err(|e| Error::Check(format!("cannot encode a picture: {e}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mean(reference: &[u8], actual: &[u8]) -> f64 {
        flip(SIZE, reference, actual).mean()
    }

    #[test]
    fn flip_sees_what_differs_and_how_much() {
        let pixels = 3 * (SIZE[0] * SIZE[1]) as usize;
        let grey = vec![128u8; pixels];
        assert_eq!(mean(&grey, &grey), 0.0);
        let mut near = grey.clone();
        near.iter_mut().for_each(|v| *v += 4);
        let mut far = grey.clone();
        far.iter_mut().for_each(|v| *v = 255);
        let (a, b) = (mean(&grey, &near), mean(&grey, &far));
        assert!(0.0 < a && a < 0.1 && b > 0.4, "{a} {b}");
    }

    #[test]
    fn bounds_let_single_samples_pass_and_no_change_of_light() {
        let bytes = include_bytes!("../../../tests/conformance/llvmpipe-22.3.6/grove.png");
        let grove = image::load_from_memory(bytes).unwrap().to_rgb8().into_raw();
        // One of four samples of a pixel turns from leaf to sky, in ten pixels all over the picture.
        let mut samples = grove.clone();
        for k in 0..10 {
            let pixel = 3 * (1200 * k + 77);
            samples[pixel..pixel + 3]
                .iter_mut()
                .for_each(|v| *v = v.saturating_add((180 - *v.min(&mut 180)) / 4));
        }
        // All of it 2 % brighter or darker on the display.
        let brighter: Vec<u8> = grove.iter().map(|v| (f32::from(*v) * 1.02).round() as u8).collect();
        let (a, b) = (mean(&grove, &samples), mean(&grove, &brighter));
        assert!(0.0 < a && a < SAME_DRIVER, "{a}");
        assert!(b > 2.0 * SAME_DRIVER, "{b}");
        println!("ten samples {a:.6}, 2 % brighter {b:.6}");
    }
}
