//! Images: paths through every pixel, a round of samples after the other, on all threads.

use std::time::{Duration, Instant};

use glam::DVec3;
use rayon::prelude::*;

use super::estimate::{Estimate, Sums};
use super::key::Key;
use super::sampling::Random;
use super::world::World;
use super::{Options, Until};
use crate::camera::{Eye, NEAR_PLANE};
use crate::rays::Stack;
use crate::{Error, Result};

/// Pixels a piece of work.
const PIECE: usize = 64;
/// Most samples of a pixel.
pub(super) const MOST_SAMPLES: u32 = 1 << 24;

/// How far an image is, after every round of samples.
pub struct Progress<'a> {
    /// What is known so far.
    pub estimate: &'a Estimate,
    /// Share of the work that is done, estimated from the error where that is the end.
    pub done: f64,
    /// Rays traced, those of a resumed run not counted.
    pub rays: u64,
    /// Wall time of the run, without resumed ones.
    pub elapsed: Duration,
}

impl World {
    /// Estimates the image that an eye sees, on the threads of the current rayon pool; the same bits for any number of them.
    /// A `resume`d estimate is continued: the samples that are added are those that one long run would have added.
    /// `progress` is called after every round of samples.
    ///
    /// The eye should be one of those the world was made for.
    ///
    /// # Errors
    /// [`Error::Usage`] for a resumed estimate of something else, naming what differs, and for options out of range.
    pub fn render(
        &self,
        eye: &Eye,
        options: &Options,
        resume: Option<Estimate>,
        progress: &mut dyn FnMut(Progress<'_>),
    ) -> Result<Estimate> {
        options.check()?;
        let key = self.key(eye, options);
        let mut estimate = match resume {
            Some(old) => {
                old.check_same(&key)?;
                old
            }
            None => Estimate::new(eye.size, key),
        };
        let (start, before, mut rays) = (Instant::now(), estimate.samples, 0);
        while let Some(wanted) = next(options.until, &estimate, before, start.elapsed()) {
            rays += self.add(eye, options, &mut estimate, wanted);
            let done = done(options.until, &estimate, start.elapsed());
            progress(Progress { estimate: &estimate, done, rays, elapsed: start.elapsed() });
        }
        Ok(estimate)
    }

    /// What every sample of such an image depends on; not when it is good enough.
    pub fn key(&self, eye: &Eye, options: &Options) -> Key {
        self.key.with(eye, options)
    }

    /// Adds samples up to so many a pixel; returns the number of rays.
    fn add(&self, eye: &Eye, options: &Options, estimate: &mut Estimate, wanted: u32) -> u64 {
        let [width, height] = eye.size.map(f64::from);
        let samples = estimate.samples..wanted;
        let forward = DVec3::from(eye.forward);
        let (right, up) = (DVec3::from(eye.right), DVec3::from(eye.up));
        let rays = estimate
            .sums
            .par_chunks_mut(PIECE)
            .enumerate()
            .map_init(Stack::new, |stack, (piece, pixels)| {
                let mut rays = 0;
                for (k, sums) in pixels.iter_mut().enumerate() {
                    let pixel = (piece * PIECE + k) as u32;
                    let (column, row) = (f64::from(pixel % eye.size[0]), f64::from(pixel / eye.size[0]));
                    for sample in samples.clone() {
                        let mut random = Random::new(options.seed, pixel, sample);
                        // A box over the pixel, as the renderer's samples are averaged.
                        let x = 2.0 * (column + random.unit()) / width - 1.0;
                        let y = 1.0 - 2.0 * (row + random.unit()) / height;
                        let ahead = forward + right * (x * eye.tangents[0]) + up * (y * eye.tangents[1]);
                        let length = ahead.length();
                        let direction = ahead / length;
                        let from = DVec3::from(eye.position) + ahead * NEAR_PLANE;
                        let found = self.trace(from, direction, options, &mut random, stack);
                        rays += u64::from(found.rays);
                        // Distance along the axis, as the renderer's depth.
                        let depth = found.first.map(|f| f.t / length + NEAR_PLANE);
                        sums.add(&found, depth, sample == 0);
                    }
                }
                rays
            })
            .sum();
        estimate.samples = wanted;
        rays
    }
}

/// Samples a pixel after the next round; `None` at the end. Rounds grow, and end at the same numbers whatever the time, so
/// that a run that stops at an error is repeatable.
fn next(until: Until, estimate: &Estimate, before: u32, elapsed: Duration) -> Option<u32> {
    let n = estimate.samples;
    // A variance needs two.
    let round = if n < 2 { 2 - n } else { (1 << (n.ilog2())) / 4 }.max(1);
    let most = |limit: u32| if n >= limit { None } else { Some((n + round).min(limit)) };
    match until {
        Until::Samples(limit) => most(limit),
        Until::Error(error) => {
            if n >= 2 && estimate.relative_error() <= error {
                None
            } else {
                most(MOST_SAMPLES)
            }
        }
        Until::ErrorOfMean(error) => {
            if n >= 2 && estimate.relative_error_of_mean() <= error {
                None
            } else {
                most(MOST_SAMPLES)
            }
        }
        Until::Time(limit) => {
            if n < 2 {
                return most(MOST_SAMPLES);
            }
            let left = limit.checked_sub(elapsed)?.as_secs_f64();
            let fits = match n - before {
                0 => round,
                taken => (left * f64::from(taken) / elapsed.as_secs_f64().max(1e-9)) as u32,
            };
            if fits == 0 { None } else { most((n + round.min(fits)).min(MOST_SAMPLES)) }
        }
    }
}

/// Share of the work that is done.
fn done(until: Until, estimate: &Estimate, elapsed: Duration) -> f64 {
    // Work goes with the inverse square of the error.
    let by = |wanted: f64, now: f64| if now > wanted { (wanted / now).powi(2) } else { 1.0 };
    match until {
        Until::Samples(n) => f64::from(estimate.samples) / f64::from(n),
        Until::Error(e) => by(e, estimate.relative_error()),
        Until::ErrorOfMean(e) => by(e, estimate.relative_error_of_mean()),
        Until::Time(limit) => (elapsed.as_secs_f64() / limit.as_secs_f64()).min(1.0),
    }
}

impl Options {
    /// Refuses what cannot be done.
    fn check(&self) -> Result<()> {
        let bad = |text: &str| Err(Error::Usage(text.into()));
        match self.until {
            Until::Samples(n) if !(2..=MOST_SAMPLES).contains(&n) => {
                bad("samples a pixel: 2, which a variance needs, to 16,777,216")
            }
            Until::Error(e) | Until::ErrorOfMean(e) if !(1e-6..1.0).contains(&e) => {
                bad("a relative error: 0.0001 % to less than 100 %")
            }
            Until::Time(t) if t.is_zero() => bad("a time: more than 0 s"),
            _ if self.bounces == Some(0) => bad("bounces: at least 1; no light comes without any"),
            _ => Ok(()),
        }
    }
}

impl Sums {
    /// Adds a sample.
    fn add(&mut self, found: &super::path::Sample, depth: Option<f64>, is_first: bool) {
        let (sun, sky) = (found.sun.as_dvec3().to_array(), found.sky.as_dvec3().to_array());
        for k in 0..3 {
            self.sun[k] += sun[k];
            self.sky[k] += sky[k];
            self.sun_squares[k] += sun[k] * sun[k];
            self.sky_squares[k] += sky[k] * sky[k];
            self.squares[k] += (sun[k] + sky[k]).powi(2);
        }
        if let Some(first) = found.first {
            self.depth += depth.unwrap_or(0.0);
            if is_first {
                self.species = first.species.map_or(0, |s| s + 1);
            }
            self.counts[usize::from(first.species.is_some()) * 2 + usize::from(!first.lit)] += 1;
        }
    }
}
