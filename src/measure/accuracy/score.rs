//! How far what was drawn of a cell is from its reference, and which part of the model that comes from.

use crate::measure::reflectance::{Measured, cosine};
use crate::physics::light::luminance;

/// Views so near to the sun's direction, degrees, are the hotspot's: judged by themselves.
pub const HOTSPOT: f64 = 5.0;
/// Views that pass a slope at a smaller angle, degrees, look over the end of its patch, or at it from below: they are not judged.
pub const LEAST_VIEW: f64 = 10.0;

/// A signed error at a view.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Worst {
    /// View zenith angle and relative azimuth, degrees.
    pub view: [f64; 2],
    /// Relative error.
    pub error: f64,
}

/// Relative errors over views.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Errors {
    /// Root of the mean square, less the noise.
    pub rms: f64,
    /// Mean.
    pub bias: f64,
    /// Largest.
    pub worst: Worst,
    /// Root of the mean square of the reference's own standard error.
    pub noise: f64,
}

/// What a radiance is made of, and what each part adds to its error: parts of the reference's radiance, means over views. They sum to
/// the bias.
///
/// Of the sun, L = (1 − c) g G + c t f: c trees' share of what is seen, g and t lit shares of ground and trees, G the radiance of
/// lit ground, f that of lit trees. Terms replace the reference's by the renderer's, one after the other.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Terms {
    /// How much is trees.
    pub cover: f64,
    /// How much of either is lit.
    pub shadow: f64,
    /// What a lit leaf, or lit ground, sends to the viewer.
    pub leaf: f64,
    /// Light of the sky.
    pub sky: f64,
}

impl Terms {
    /// With their names.
    pub fn named(&self) -> [(&'static str, f64); 4] {
        [("cover", self.cover), ("shadow", self.shadow), ("leaf", self.leaf), ("sky", self.sky)]
    }

    fn add(&mut self, other: Terms) {
        self.cover += other.cover;
        self.shadow += other.shadow;
        self.leaf += other.leaf;
        self.sky += other.sky;
    }
}

/// What was drawn of a cell against its reference.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Score {
    /// All light, without the hotspot.
    pub all: Errors,
    /// The sun's, parts of the reference's radiance of all light.
    pub sun: Errors,
    /// The sky's, likewise.
    pub sky: Errors,
    /// All light in the hotspot.
    pub hotspot: Errors,
    /// Root mean square errors of the fractions of lit and shadowed ground, lit and shadowed trees, without the hotspot.
    pub fractions: [f64; 4],
    /// Where the bias comes from.
    pub terms: Terms,
}

impl Score {
    /// Largest of the fractions' errors.
    pub fn fraction(&self) -> f64 {
        self.fractions.into_iter().fold(0.0, f64::max)
    }
}

/// What the score needs of a cell.
#[derive(Clone, Copy, Debug)]
pub struct Lit {
    /// Zenith angle of the sun, degrees.
    pub sun_zenith: f64,
    /// Degrees that the ground descends towards the sun.
    pub slope: f64,
    /// Luminance of lit ground.
    pub ground: f64,
    /// Whether what was drawn is the mean over all forests of its kind and not of the reference's own trees: what patches differ by is
    /// noise then.
    pub averages: bool,
}

/// An error and the reference's standard error there.
type Sample = ([f64; 2], f64, f64);

fn errors(samples: &[Sample]) -> Errors {
    let n = samples.len().max(1) as f64;
    let mean = |of: &dyn Fn(&Sample) -> f64| samples.iter().map(of).sum::<f64>() / n;
    let noise = mean(&|s| s.2 * s.2);
    let worst = samples.iter().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
    Errors {
        rms: (mean(&|s| s.1 * s.1) - noise).max(0.0).sqrt(),
        bias: mean(&|s| s.1),
        worst: worst.map_or(Worst::default(), |s| Worst { view: s.0, error: s.1 }),
        noise: noise.sqrt(),
    }
}

/// Luminance of the sun's part by its factors, with those of `reference` replaced by `drawn`'s one after the other.
fn terms(reference: &Measured, drawn: &Measured, ground: f64) -> Terms {
    // c, g, t and f.
    let parts = |m: &Measured| {
        let [lit, dark, lit_tree, dark_tree] = m.fractions;
        let share = |a: f64, b: f64| if a + b > 0.0 { a / (a + b) } else { 0.0 };
        let leaf = luminance(m.sun) - lit * ground;
        [lit_tree + dark_tree, share(lit, dark), share(lit_tree, dark_tree), leaf / lit_tree.max(1e-9)]
    };
    let light = |[c, g, t, f]: [f64; 4]| (1.0 - c) * g * ground + c * t * f;
    let ([c, g, t, f], [c1, g1, t1, f1]) = (parts(reference), parts(drawn));
    let steps = [[c, g, t, f], [c1, g, t, f], [c1, g1, t1, f], [c1, g1, t1, f1]].map(light);
    let all = luminance(reference.radiance()).max(1e-12);
    Terms {
        cover: (steps[1] - steps[0]) / all,
        shadow: (steps[2] - steps[1]) / all,
        leaf: (steps[3] - steps[2]) / all,
        sky: (luminance(drawn.sky) - luminance(reference.sky)) / all,
    }
}

/// Judges what was drawn of the views of a reference.
pub fn score(reference: &[Measured], drawn: &[Measured], lit: &Lit) -> Score {
    let mut score = Score::default();
    let (mut all, mut sun, mut sky, mut hot) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let above = |r: &Measured| cosine(r.view, lit.slope) >= LEAST_VIEW.to_radians().sin();
    for (r, d) in reference.iter().zip(drawn).filter(|(r, _)| above(r)) {
        let truth = luminance(r.radiance()).max(1e-12);
        let noise = luminance(if lit.averages { r.stderr } else { r.noise }) / truth;
        let of = |a: [f64; 3], b: [f64; 3]| (r.view, (luminance(a) - luminance(b)) / truth, noise);
        let sample = of(d.radiance(), r.radiance());
        if cosine(r.view, lit.sun_zenith) > HOTSPOT.to_radians().cos() {
            hot.push(sample);
            continue;
        }
        all.push(sample);
        sun.push(of(d.sun, r.sun));
        sky.push(of(d.sky, r.sky));
        score.terms.add(terms(r, d, lit.ground));
        for (sum, k) in score.fractions.iter_mut().zip(0..) {
            *sum += (d.fractions[k] - r.fractions[k]).powi(2);
        }
    }
    let n = all.len().max(1) as f64;
    score.fractions = score.fractions.map(|s| (s / n).sqrt());
    let Terms { cover, shadow, leaf, sky: sky_term } = score.terms;
    score.terms = Terms { cover: cover / n, shadow: shadow / n, leaf: leaf / n, sky: sky_term / n };
    Score { all: errors(&all), sun: errors(&sun), sky: errors(&sky), hotspot: errors(&hot), ..score }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn measured(zenith: f64, fractions: [f64; 4], leaf: f64, sky: f64) -> Measured {
        let sun = fractions[0] * 0.1 + fractions[2] * leaf;
        Measured { view: [zenith, 0.0], fractions, sun: [sun; 3], sky: [sky; 3], ..Measured::default() }
    }

    const LIT: Lit = Lit { sun_zenith: 45.0, slope: 0.0, ground: 0.1, averages: false };

    #[test]
    fn terms_say_what_is_wrong_and_sum_to_the_bias() {
        let truth = [-30.0, 0.0].map(|z| measured(z, [0.2, 0.1, 0.4, 0.3], 0.05, 0.02));
        let leaf = [-30.0, 0.0].map(|z| measured(z, [0.2, 0.1, 0.4, 0.3], 0.06, 0.02));
        let s = score(&truth, &leaf, &LIT);
        // 0.4 of the picture is a fifth too bright: 0.004 of 0.06.
        assert!((s.terms.leaf - 0.004 / 0.06).abs() < 1e-12 && s.terms.shadow.abs() < 1e-12, "{s:?}");
        assert!((s.all.bias - s.terms.leaf).abs() < 1e-12 && s.all.rms > 0.06 && s.fraction() == 0.0);
        let shade = [-30.0, 0.0].map(|z| measured(z, [0.1, 0.2, 0.5, 0.2], 0.05, 0.01));
        let s = score(&truth, &shade, &LIT);
        let sum: f64 = s.terms.named().iter().map(|t| t.1).sum();
        assert!((sum - s.all.bias).abs() < 1e-12 && s.terms.cover.abs() < 1e-12, "{s:?}");
        assert!((s.terms.sky + 0.01 / 0.06).abs() < 1e-12 && (s.fraction() - 0.1).abs() < 1e-12);
    }

    #[test]
    fn the_hotspot_and_the_noise_stand_apart() {
        let mut truth = [45.0, 0.0].map(|z| measured(z, [0.0, 0.0, 1.0, 0.0], 0.1, 0.0));
        let drawn =
            [45.0, 0.0].map(|z| measured(z, [0.0, 0.0, 1.0, 0.0], if z > 0.0 { 0.2 } else { 0.11 }, 0.0));
        let s = score(&truth, &drawn, &LIT);
        assert!((s.hotspot.bias - 1.0).abs() < 1e-12 && (s.all.bias - 0.1).abs() < 1e-12, "{s:?}");
        // Of a slope of 81 degrees that faces away from the sun, one from above is 9 degrees off, and one from the sun sees its back.
        let facing_away = Lit { slope: -81.0, ..LIT };
        assert_eq!(score(&truth, &drawn, &facing_away).all.rms, 0.0);
        truth[1].noise = [0.008; 3];
        let s = score(&truth, &drawn, &LIT);
        assert!((s.all.rms - 0.06).abs() < 1e-12 && (s.all.noise - 0.08).abs() < 1e-12, "{s:?}");
    }
}
