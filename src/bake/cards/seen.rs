//! The sun on what is seen of a cloud of cards, over what the harmonics on them say ([`crate::bake::harmonics::seen`]).
//!
//! A cloud shows other leaves than its model does: on every card all of a cluster, also what the rest of the crown hides. So each form of it has
//! corrections of its own, by rays at the cards for what harmonics say, and by the same rays at the model for the truth. Both are summed up
//! over all rays, whatever each meets: as much light goes to the viewer from all of the cloud as from the model, and a cloud that covers a little more
//! is that much darker, so that nothing changes where one hands over to the other.

use glam::{DVec3, Vec3};

use super::{CardCloud, CloudCard};
use crate::bake::harmonics::Harmonics;
use crate::bake::harmonics::seen::{Corrections, Model, SEED, Sample, cast, directions, fit};
use crate::bake::surface::Surface;
use crate::physics::harmonics::{KEPT, decode, evaluate, irradiance};
use crate::physics::light::angle_between;
use crate::scene::Mesh;

/// Of the full cloud, and of the far form.
pub fn measure(mesh: &Mesh, surface: &Surface, light: &Harmonics, cloud: &CardCloud) -> [Corrections; 2] {
    let model = Model::new(mesh, surface, &light.faces);
    let truth = model.samples(SEED, directions);
    let (full, far) = cloud.cards.split_at(cloud.full as usize);
    [(full, false), (far, true)].map(|(cards, far)| {
        let form = Form { cloud, cards, far, surface };
        let mut samples = cast(surface.frame, SEED, directions, |from, view, suns, _| {
            let seen = form.seen(from, view)?;
            Some(suns.map(|sun| seen.under(view, sun)))
        });
        samples.extend(truth.iter().map(|s| Sample { said: [0.0; 3], ..*s }));
        fit(&samples)
    })
}

/// The cards of one form.
struct Form<'a> {
    cloud: &'a CardCloud,
    cards: &'a [CloudCard],
    far: bool,
    surface: &'a Surface,
}

/// What is seen at a place of a card.
struct Seen {
    /// In scaled space.
    height: f64,
    /// Share of leaf.
    leaf: f64,
    /// Of the side that is seen, and of the other.
    transfers: [[f64; KEPT]; 2],
}

/// Where a ray meets a card, as the shaders have it.
struct Met<'a> {
    card: &'a CloudCard,
    /// From the middle to the right and upper edges, -1 to 1.
    at: [f32; 2],
    /// Texel of the atlas.
    texel: [u32; 2],
    /// Of unit length, out of the side that is seen.
    out: Vec3,
}

impl Form<'_> {
    /// What a viewer sees along the ray from a place before the tree.
    fn seen(&self, from: Vec3, view: DVec3) -> Option<Seen> {
        let (eye, from) = (view.as_vec3(), from - Vec3::Z * self.surface.frame.centre);
        let met = (0..self.cards.len()).filter_map(|k| self.meets(k, from, eye));
        met.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, met)| self.shown(&met, eye))
    }

    /// How far away the ray meets a card where it is there.
    fn meets(&self, card: usize, from: Vec3, eye: Vec3) -> Option<(f32, Met<'_>)> {
        let c = &self.cards[card];
        let [centre, right, up] = [c.centre, c.right, c.up].map(Vec3::from);
        let normal = right.cross(up).normalize_or_zero();
        let away = normal.dot(from - centre) / normal.dot(eye);
        let place = from - eye * away - centre;
        let at = [place.dot(right) / right.length_squared(), place.dot(up) / up.length_squared()];
        if !(at.iter().all(|x| x.abs() < 1.0) && away.is_finite()) {
            return None;
        }
        let behind = normal.dot(eye) < 0.0;
        let origin = if behind { c.back } else { c.front };
        let within = [0.5 + 0.5 * at[0], 0.5 - 0.5 * at[1]];
        let texel = [0, 1].map(|k| origin[k] + (within[k] * c.size[k] as f32) as u32);
        let opacity = self.cloud.opacity[0][(texel[1] * self.cloud.size[0] + texel[0]) as usize];
        // The level card, the last of the far form, is for eyes above and below (shaders/frame/trees/cards/card.vert).
        let level = self.far && card + 1 == self.cards.len();
        let x = ((eye.z.abs() - 0.2) / 0.3).clamp(0.0, 1.0);
        let least = if level { 1.0 - x * x * (3.0 - 2.0 * x) } else { 0.0 };
        let gauss = (-2.0 * (at[0] * at[0] + at[1] * at[1])).exp();
        let there = opacity >= 128 && gauss >= least;
        there.then(|| (away, Met { card: c, at, texel, out: if behind { -normal } else { normal } }))
    }

    /// What is painted there (shaders/frame/trees/cards/light.glsl).
    fn shown(&self, met: &Met, eye: Vec3) -> Seen {
        let (c, [x, y], width) = (met.card, met.texel, self.cloud.size[0]);
        let [right, up] = [c.right, c.up].map(Vec3::from);
        let texel = 4 * (y * width + x) as usize;
        let byte = |k: usize| f32::from(self.cloud.surface[0][texel + k]) / 255.0;
        let place = Vec3::from(c.centre) + right * met.at[0] + up * met.at[1];
        let height = (place + met.out * ((2.0 * byte(1) - 1.0) * c.depth)).z / self.surface.frame.half_height;
        let [nx, ny] = [2, 3].map(|k| 2.0 * byte(k) - 1.0);
        let normal =
            right.normalize() * nx + up.normalize() * ny + met.out * (1.0 - nx.abs() - ny.abs()).max(0.0);
        let half = 4 * (y / 2 * (width / 2) + x / 2) as usize;
        let number = |n: usize| decode(self.cloud.harmonics[n / 4][half + n % 4].cast_signed());
        let mut transfers = [0, KEPT].map(|first| std::array::from_fn(|n| number(first + n)));
        // A leaf that the card shows from one side shows the other to who looks at it askew.
        if byte(0) > 0.5 && normal.dot(eye) < 0.0 {
            transfers.swap(0, 1);
        }
        Seen { height: height.into(), leaf: byte(0).into(), transfers }
    }
}

impl Seen {
    /// What harmonics say of it to a viewer under a sun.
    fn under(&self, view: DVec3, sun: DVec3) -> Sample {
        let light = evaluate(sun.into());
        let [seen, other] = self.transfers.map(|t| irradiance(&t, &light).max(0.0));
        Sample {
            up: [view.z, sun.z],
            angle: angle_between(view.into(), sun.into()),
            height: self.height,
            said: [self.leaf * seen, self.leaf * other, (1.0 - self.leaf) * seen],
            truth: [0.0; 3],
        }
    }
}
