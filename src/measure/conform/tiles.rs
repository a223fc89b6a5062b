//! Compute tiles against the graphics pipeline: two ways to the same samples.

use super::images::encode;
use super::scenes::{RASTERIZERS, SIZE, SceneCase};
use super::{Comparison, Finding, Options, finding, frames, with_device};
use crate::measure::metrics::flip;
use crate::plan::Rasterizer;
use crate::{Error, Result};

/// Largest mean FLIP. What may differ: which of two trees at the same depth a sample sees, a tree's coefficients as half floats, and
/// how four texels are weighed, which a sampler does in 8 bits. Measured: 0.002 to 0.009.
const FLIP: f64 = 0.02;
/// Largest difference of the mean over all pixels and channels, of 255. None of these has a sign, so pictures are as
/// bright; measured: 0.04 at most.
const BIAS: f64 = 0.1;

/// Draws a scene both ways and compares.
pub(super) fn check(options: &Options, case: &SceneCase) -> Result<Finding> {
    let mut drawn = Vec::new();
    with_device(options, |gpu| {
        for rasterizer in RASTERIZERS {
            drawn.push(frames::draw(gpu, options, case, rasterizer, false)?.rgb());
        }
        Ok(finding(&[], String::new()))
    })?;
    let [graphics, tiles] = &drawn[..] else { return Err(Error::Check("nothing was drawn".into())) };
    let mean = |rgb: &[u8]| rgb.iter().map(|v| f64::from(*v)).sum::<f64>() / rgb.len() as f64;
    let (map, bias) = (flip(SIZE, graphics, tiles), mean(tiles) - mean(graphics));
    let found = format!("mean FLIP {:.5}, bias {bias:+.4} of 255", map.mean());
    let far = map.mean() > FLIP || bias.abs() > BIAS;
    let problem = far.then(|| format!("{found}: at most {FLIP} and {BIAS} from the graphics pipeline"));
    let reference = Some((Rasterizer::Graphics.name().to_string(), encode(graphics)?));
    let comparison = Comparison { reference, actual: encode(tiles)?, map: Some(encode(&map.colours)?) };
    Ok(Finding { comparison: Some(comparison), ..finding(problem.as_slice(), found) })
}
