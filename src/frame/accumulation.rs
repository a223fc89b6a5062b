//! Pictures that are means of several frames, each shifted by a part of a pixel (Haeberli & Akeley 1990, "The accumulation
//! buffer"). What is streamed, culled and cast into shadow maps is so once; what is drawn to the image is drawn once a frame.

use super::targets::ImageTargets;
use crate::Result;
use crate::gpu::interface::AccumulationParameters;
use crate::gpu::{Buffer, Gpu, Program, Recorder, Resource, shaders};
use crate::plan::Plan;
use crate::plan::names::{pass, resource};

/// How far from its place the first or last row and column of a picture are sampled, pixels: no shift is larger.
pub const MARGIN: f64 = 0.5;

/// By how many pixels, to the right and down, frame `k` of `count` is shifted. Each of a pixel's samples stands for a square of
/// 1/√samples a side, and over all frames it goes through its own: with one sample a pixel the mean is that over the pixel, with
/// several their squares, which overlap a little, reach an eighth of a pixel beyond it. Points of the golden lattice (k/n, k φ)
/// fill the square: lines that part it are a third nearer to the share than with points of as good a sequence, where n is not
/// known. The last frame is not shifted, so that what is not a mean, depth and species, is what it is without accumulation.
pub fn shift(k: u32, count: u32, samples: u32) -> [f64; 2] {
    /// 1 over the golden ratio.
    const STEP: f64 = 0.618_033_988_749_894_8;
    let side = 1.0 / f64::from(samples).sqrt();
    let before_last = f64::from(count - 1 - k);
    [before_last / f64::from(count), before_last * STEP].map(|p| ((p + 0.5).fract() - 0.5) * side)
}

/// By how much the dithers of frame `k` of `count` differ from those of the last, 2⁻³²: steps of the golden ratio, so that a
/// tree's number of covered samples is rounded up in as many frames as its opacity asks for.
pub fn dither_turn(k: u32, count: u32) -> u32 {
    0x9e37_79b9_u32.wrapping_mul(count - 1 - k)
}

/// What sums frames up.
pub struct Accumulation {
    program: Program,
    sums: Buffer,
}

impl Accumulation {
    /// Makes it where the plan has pictures of several frames.
    ///
    /// # Errors
    /// [`crate::Error::Device`] when out of memory.
    pub fn new(gpu: &Gpu, plan: &Plan) -> Result<Option<Self>> {
        if plan.accumulation <= 1 {
            return Ok(None);
        }
        let program = gpu.compute(&shaders::FRAME_ACCUMULATION_COMP, &[])?;
        let sums = gpu.described_buffer(&plan.buffer(resource::SUMS_OF_FRAMES))?;
        Ok(Some(Accumulation { program, sums }))
    }

    /// Adds what frame `k` of the picture shows; after the last one, the images hold the means.
    pub fn record(&self, recorder: &mut Recorder, targets: &ImageTargets, plan: &Plan, k: u32) {
        let [width, height] = plan.size;
        let (pixels, last) = (width * height, k + 1 == plan.accumulation);
        recorder.compute(pass::ACCUMULATION, |pass| {
            let shown = plan.colors().iter().zip(&targets.colors).filter(|(c, _)| plan.is_mean(c));
            for (first, (_, color)) in shown.enumerate() {
                let image = Resource::Storage(&color.image);
                pass.bind(&self.program, &[("shown", image), ("sums", Resource::Buffer(&self.sums))]);
                let part = if last { 1.0 / plan.accumulation as f32 } else { 0.0 };
                pass.push(&AccumulationParameters {
                    pixels,
                    width,
                    first: first as u32 * pixels,
                    frame: k,
                    part,
                });
                pass.dispatch([pixels.div_ceil(64), 1, 1]);
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shifts_stay_in_their_samples_squares_and_fill_them() {
        for samples in [1, 4, 8] {
            let side = 1.0 / f64::from(samples).sqrt();
            for count in [1, 2, 4, 16, 64] {
                let all: Vec<_> = (0..count).map(|k| shift(k, count, samples)).collect();
                assert!(all.iter().flatten().all(|s| s.abs() <= 0.5 * side && s.abs() <= MARGIN));
                assert_eq!(all.last(), Some(&[0.0, 0.0]));
                // Means of x and x² over a square are 0 and side² / 12; of so many points of low discrepancy they are within
                // their number's reciprocal, but for a factor that three holds.
                for axis in [0, 1] {
                    let mean =
                        |f: fn(f64) -> f64| all.iter().map(|s| f(s[axis])).sum::<f64>() / f64::from(count);
                    let bound = 3.0 / f64::from(count);
                    assert!(mean(|x| x).abs() < bound * 0.5 * side);
                    assert!((mean(|x| x * x) - side * side / 12.0).abs() < bound * 0.25 * side * side);
                }
            }
        }
    }

    #[test]
    fn dithers_round_up_as_often_as_opacity_asks() {
        let frames = 16;
        for (own, opacity) in [(0x1234_5678_u32, 0.3), (0xfedc_ba98, 0.06), (7, 0.71)] {
            let covered = (0..frames)
                .filter(|k| {
                    let dither = f64::from(own.wrapping_add(dither_turn(*k, frames))) / 4_294_967_296.0;
                    opacity + dither >= 1.0
                })
                .count();
            // Of steps of the golden ratio any interval holds its share within one and a half.
            assert!((covered as f64 - opacity * f64::from(frames)).abs() < 1.5, "{opacity}: {covered}");
        }
        assert_eq!(dither_turn(frames - 1, frames), 0);
    }
}
