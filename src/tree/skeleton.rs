//! Growing stems and leaves from the parameters (Weber and Penn 1995, sections 4.1 to 4.6 and 4.8).
//!
//! Every frame's z axis runs along its stem. A child's frame is its parent's, turned by `nRotate` about z and by
//! `nDownAngle` about x, so that a positive bend about x leads on away from the parent.

use glam::{DMat3, DVec3};

use super::parameters::{Level, Parameters, Shape};
use super::random::Random;

/// A cross-section of a stem.
#[derive(Clone, Copy, Debug)]
pub(super) struct Section {
    /// Centre, m, z up.
    pub at: DVec3,
    /// Axes; z along the stem.
    pub frame: DMat3,
    /// Radius, m.
    pub radius: f64,
}

/// A stem from base to tip.
#[derive(Clone, Debug)]
pub(super) struct Stem {
    /// 0 trunk, 1 branch, 2 twig.
    pub level: usize,
    /// Its length along the axis, m.
    pub length: f64,
    /// Cross-sections at equal distances.
    pub sections: Vec<Section>,
}

/// Where a spray of leaves starts; z along it, y off its surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spray {
    /// Base, m.
    pub at: DVec3,
    /// Axes.
    pub frame: DMat3,
    /// Size relative to the species'.
    pub scale: f64,
}

/// A tree without its surface.
#[derive(Clone, Debug, Default)]
pub(super) struct Skeleton {
    /// Every stem, parents before children.
    pub stems: Vec<Stem>,
    /// Every spray.
    pub sprays: Vec<Spray>,
}

/// Grows one individual.
pub(super) fn grow(parameters: &Parameters, seed: u32) -> Skeleton {
    let mut random = Random::new(seed, 0);
    let scale = parameters.scale[0] + random.around(parameters.scale[1]);
    let [length, variation] = parameters.trunk.length;
    let length = (length + random.around(variation)) * scale;
    let (levels, skeleton) = (parameters.levels(), Skeleton::default());
    let mut grower = Grower { parameters, levels, scale, random, skeleton };
    let base = Section { at: DVec3::ZERO, frame: DMat3::IDENTITY, radius: length * parameters.ratio };
    let trunk = grower.stem(0, base, length);
    grower.branch(&trunk, None);
    grower.skeleton
}

struct Grower<'a> {
    parameters: &'a Parameters,
    levels: [Level; 3],
    scale: f64,
    random: Random,
    skeleton: Skeleton,
}

impl Grower<'_> {
    fn varied(&mut self, [value, variation]: [f64; 2]) -> f64 {
        value + self.random.around(variation)
    }

    /// Grows one stem from its base (section 4.1) and keeps it.
    fn stem(&mut self, index: usize, base: Section, length: f64) -> Stem {
        let level = self.levels[index];
        let step = length / f64::from(level.segments);
        let (mut at, mut frame) = (base.at, base.frame);
        let mut sections = Vec::with_capacity(level.segments as usize + 1);
        for i in 0..=level.segments {
            let along = f64::from(i) / f64::from(level.segments);
            sections.push(Section { at, frame, radius: self.radius(index, base.radius, along) });
            // The tip is the end of the last segment: it leads nowhere further.
            at += frame.z_axis * step;
            frame = self.bend(index, &level, frame, i);
        }
        let stem = Stem { level: index, length, sections };
        self.skeleton.stems.push(stem.clone());
        stem
    }

    /// Taper (section 4.4; `nTaper` up to 1 only) and, on the trunk, flare.
    fn radius(&self, index: usize, base: f64, along: f64) -> f64 {
        let tapered = base * (1.0 - self.levels[index].taper * along);
        // A tip of no radius would leave triangles of no area.
        let radius = tapered.max(0.06 * base);
        if index > 0 {
            return radius;
        }
        let y = (1.0 - 8.0 * along).max(0.0);
        radius * (1.0 + self.parameters.flare * (100f64.powf(y) - 1.0) / 100.0)
    }

    /// Turns a frame for the next segment: curve, random curve and vertical attraction (sections 4.1 and 4.8). The
    /// random part turns about x as in the paper and about y too, lest stems stay in one plane.
    fn bend(&mut self, index: usize, level: &Level, frame: DMat3, segment: u32) -> DMat3 {
        let n = f64::from(level.segments);
        let curve = match (level.curve_back, 2 * segment < level.segments) {
            (0.0, _) => level.curve / n,
            (_, true) => 2.0 * level.curve / n,
            (back, false) => 2.0 * back / n,
        };
        let about_x = (curve + self.random.around(level.curve_variation) / n).to_radians();
        let about_y = (self.random.around(level.curve_variation) / n).to_radians();
        let mut turned = frame * DMat3::from_rotation_x(about_x) * DMat3::from_rotation_y(about_y);
        if index >= 2 {
            // The paper's declination is the angle from the vertical; cos(orientation) is the height of the y axis.
            let declination = turned.z_axis.z.clamp(-1.0, 1.0).acos();
            let up = self.parameters.attraction_up * declination * turned.y_axis.z / n;
            turned *= DMat3::from_rotation_x(-up);
        }
        droop(turned, level.droop.to_radians() / n)
    }

    /// Grows the children of a stem (sections 4.2 and 4.3), or its leaves if it is a twig. `relative` is the stem's
    /// length over its parent's, over the largest there.
    fn branch(&mut self, parent: &Stem, relative: Option<f64>) {
        let index = parent.level + 1;
        let Some(&level) = self.levels.get(index) else { return self.leaves(parent) };
        let p = *self.parameters;
        // The longest stem carries `nBranches`, shorter ones fewer.
        let count = (level.count * relative.map_or(1.0, |r| 0.2 + 0.8 * r)).round().max(1.0) as u32;
        let base = if parent.level == 0 {
            p.base_size * self.scale
        } else {
            self.levels[parent.level].bare * parent.length
        };
        let mut turn = self.random.unit() * 360.0;
        for i in 0..count {
            let jitter = self.random.unit();
            let offset = base + (parent.length - base) * (f64::from(i) + jitter) / f64::from(count);
            let share = (parent.length - offset) / (parent.length - base);
            let largest = self.varied(level.length);
            let length = match parent.level {
                0 => parent.length * largest * p.shape.ratio(share),
                _ => largest * (parent.length - 0.6 * offset),
            };
            let down = match level.down_angle {
                [angle, v] if v < 0.0 => angle + v * (1.0 - 2.0 * Shape::Conical.ratio(share)),
                varied => self.varied(varied),
            };
            turn = self.turn(turn, level.rotate, i);
            let start = at(parent, offset);
            let radius = parent.sections[0].radius * (length / parent.length).powf(p.ratio_power);
            let radius = radius.min(start.radius);
            let frame = turned(start.frame, turn, down);
            let child = self.stem(index, Section { at: start.at, frame, radius }, length);
            self.branch(&child, Some((length / parent.length / level.length[0]).min(1.0)));
        }
    }

    /// The next angle about the parent: a helix, or for a negative `nRotate` alternating sides (section 4.2).
    fn turn(&mut self, last: f64, rotate: [f64; 2], i: u32) -> f64 {
        let variation = self.random.around(rotate[1]);
        match rotate[0] {
            side if side < 0.0 => 0.5 * if i.is_multiple_of(2) { -side } else { side } + variation,
            step => last + step + variation,
        }
    }

    /// Sprays along a twig beyond its bare part, the last one at its tip (section 4.6, with `Leaves` the same for every
    /// twig).
    fn leaves(&mut self, twig: &Stem) {
        let Some(leaves) = self.parameters.leaves else { return };
        let bare = self.levels[twig.level].bare * twig.length;
        let count = leaves.count as u32;
        let mut turn = self.random.unit() * 360.0;
        for i in 0..count {
            let offset = bare
                + (twig.length - bare) * (f64::from(i) + 0.5 + self.random.around(0.3)) / f64::from(count);
            turn = self.turn(turn, leaves.rotate, i);
            let down = self.varied(leaves.down_angle);
            let start = at(twig, offset);
            // Sprays near the tip run on along the twig.
            let share = offset / twig.length;
            let frame = turned(start.frame, turn, down * (1.0 - 0.7 * share * share));
            // Short twigs, as at the top, bear small sprays, or a pointed crown would end blunt.
            let small = (0.4 + twig.length / leaves.length).min(1.0);
            let scale = small * (1.0 + self.random.around(0.2));
            self.skeleton.sprays.push(Spray { at: start.at, frame, scale });
        }
    }
}

fn turned(frame: DMat3, about_z: f64, about_x: f64) -> DMat3 {
    frame * DMat3::from_rotation_z(about_z.to_radians()) * DMat3::from_rotation_x(about_x.to_radians())
}

/// Turns a frame towards the ground by an angle, but not beyond straight down; by a negative one towards the sky.
fn droop(frame: DMat3, angle: f64) -> DMat3 {
    let towards = if angle > 0.0 { DVec3::NEG_Z } else { DVec3::Z };
    let left = frame.z_axis.dot(towards).clamp(-1.0, 1.0).acos();
    match frame.z_axis.cross(towards).try_normalize() {
        Some(axis) if angle != 0.0 => DMat3::from_axis_angle(axis, angle.abs().min(left)) * frame,
        _ => frame,
    }
}

/// The cross-section of a stem at a distance from its base.
fn at(stem: &Stem, offset: f64) -> Section {
    let last = stem.sections.len() - 1;
    let place = (offset / stem.length).clamp(0.0, 1.0) * last as f64;
    let i = (place as usize).min(last - 1);
    let (a, b, t) = (stem.sections[i], stem.sections[i + 1], place - i as f64);
    // Segments are straight: the frame is that of the segment.
    Section { at: a.at.lerp(b.at, t), frame: a.frame, radius: a.radius + (b.radius - a.radius) * t }
}
