//! The ladder: what stands for a tree, from near to far, and where one rung hands over to the next.
//!
//! A user writes it as `mesh:256,zfield:4,shader-map`: rungs, each with the apparent height of a tree in pixels down to which it is
//! used, and the last without, because it goes on to the horizon. Where a rung says no height the knob does that is for it. `auto` is
//! `mesh,zfield,shader-map`, and `zfield,shader-map` where meshes cannot be drawn; who writes the rungs gets them, or an error.
//!
//! Hand-overs are one band of the range (BN12, section 7): each tree fades over a tenth of its range at a time of its own, and what
//! comes behind takes over as all do together. Its numbers stand once, in `shaders/interface.glsl`, with their law in
//! [`crate::physics::handover`].

use std::fmt;
use std::str::FromStr;

use crate::gpu::interface::{FADE_FIRST, FADE_RATE};
use crate::settings::{KNOBS, Settings, nearest};

/// One way to stand for a tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rung {
    /// The model's own triangles, lit leaf by leaf (BBP08).
    Mesh,
    /// A cloud of textured cards a tree, and fewer of them farther away (BCF05, section 2).
    Cards,
    /// A quad a tree, which shows three of its depth views (BN12, section 5).
    ZField,
    /// A shader of the ground, for all trees together (BN12, section 6).
    ShaderMap,
    /// Slices of the forest over the ground, for all trees together (BCF05, section 3).
    Shells,
}

/// Number of rungs.
const RUNGS: usize = 5;

impl Rung {
    /// All, near to far, with the names that users write.
    pub const NAMES: [(&'static str, Rung); RUNGS] = [
        ("mesh", Rung::Mesh),
        ("cards", Rung::Cards),
        ("zfield", Rung::ZField),
        ("shader-map", Rung::ShaderMap),
        ("shells", Rung::Shells),
    ];

    /// Whether it shows all trees together, and so goes on to the horizon.
    fn is_last(self) -> bool {
        matches!(self, Rung::ShaderMap | Rung::Shells)
    }

    /// The name that users write.
    pub fn name(self) -> &'static str {
        Self::NAMES.iter().find(|(_, r)| *r == self).map_or("", |(n, _)| n)
    }
}

/// A rung of a ladder.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Step {
    rung: Rung,
    /// Apparent height of a tree down to which it is used, pixels; `None` for the last, and where the knob says it.
    pixels: Option<f64>,
}

/// Rungs near to far. No rung stands twice, so there are at most as many steps as rungs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ladder {
    steps: [Option<Step>; RUNGS],
    /// Whether trees may be z-fields where they should be meshes and cannot.
    yields: bool,
}

impl Default for Ladder {
    fn default() -> Self {
        Ladder::AUTO
    }
}

impl Ladder {
    /// What scenes have that say nothing: all rungs, and no meshes where the rasteriser, the device or the memory does not take them.
    pub const AUTO: Ladder =
        Ladder { steps: steps(&[Rung::Mesh, Rung::ZField, Rung::ShaderMap]), yields: true };
    /// z-fields near, the shader-map far (BN12).
    pub const BN12: Ladder = Ladder { steps: steps(&[Rung::ZField, Rung::ShaderMap]), yields: false };
    /// z-fields at any distance.
    pub const ZFIELD: Ladder = Ladder { steps: steps(&[Rung::ZField]), yields: false };
    /// The shader-map at any distance.
    pub const SHADER_MAP: Ladder = Ladder { steps: steps(&[Rung::ShaderMap]), yields: false };

    /// Ladders that have a name of their own.
    pub const SHORTHANDS: [(&'static str, Ladder); 3] =
        [("auto", Ladder::AUTO), ("zfield", Ladder::ZFIELD), ("shader-map", Ladder::SHADER_MAP)];

    /// Its name, if it has one, or itself as users write it.
    pub fn name(&self) -> String {
        let named = Self::SHORTHANDS.iter().find(|(_, ladder)| ladder == self);
        named.map_or_else(|| self.to_string(), |(name, _)| name.to_string())
    }

    /// The same without meshes, for a ladder that may go without; `None` for others.
    pub fn without_meshes(&self) -> Option<Ladder> {
        let mut steps = self.steps;
        steps.rotate_left(1);
        steps[RUNGS - 1] = None;
        self.yields.then_some(Ladder { steps, yields: false })
    }

    fn has(&self, rung: Rung) -> bool {
        self.steps.iter().flatten().any(|s| s.rung == rung)
    }

    /// Whether a rung draws trees one by one.
    pub fn draws_trees(&self) -> bool {
        self.cards() || self.z_fields()
    }

    /// Whether some of them are clouds of cards.
    pub fn cards(&self) -> bool {
        self.has(Rung::Cards)
    }

    /// Whether some of them, behind all others, are z-fields.
    pub fn z_fields(&self) -> bool {
        self.has(Rung::ZField)
    }

    /// Whether the nearest of them are their models' meshes.
    pub fn meshes(&self) -> bool {
        self.has(Rung::Mesh)
    }

    /// Whether the last rung is the average of a forest.
    pub fn averages(&self) -> bool {
        self.has(Rung::ShaderMap)
    }

    /// Whether the last rung is slices of a forest.
    pub fn shells(&self) -> bool {
        self.has(Rung::Shells)
    }

    /// Whether the last rung shows all trees together, to the horizon.
    pub fn goes_on(&self) -> bool {
        self.averages() || self.shells()
    }

    /// Whether trees that are drawn one by one hand over to their average.
    pub fn hands_over(&self) -> bool {
        self.draws_trees() && self.averages()
    }

    /// The same with the heights that the knobs say written down.
    pub fn resolved(mut self, settings: &Settings) -> Ladder {
        let mut rest = self.steps.iter_mut().flatten().peekable();
        while let Some(step) = rest.next() {
            if rest.peek().is_some() {
                let knob = match step.rung {
                    Rung::Mesh => settings.mesh_min_pixels,
                    Rung::Cards => settings.cards_min_pixels,
                    _ => settings.zfield_min_pixels,
                };
                step.pixels = step.pixels.or(Some(f64::from(knob)));
            }
        }
        self
    }

    /// Apparent height under which a rung is no longer used, pixels; 0 where it goes on to the horizon.
    fn pixels_of(&self, rung: Rung, settings: &Settings) -> f64 {
        let resolved = self.resolved(settings);
        resolved.steps.iter().flatten().find(|s| s.rung == rung).and_then(|s| s.pixels).unwrap_or(0.0)
    }

    /// Apparent height under which trees are no longer drawn one by one, pixels; 0 where they always are.
    pub fn least_pixels(&self, settings: &Settings) -> f64 {
        self.pixels_of(if self.z_fields() { Rung::ZField } else { Rung::Cards }, settings)
    }

    /// Distance to which trees are meshes that would be `pixels` high at one metre, m; 0 where none is.
    pub fn mesh_range(&self, settings: &Settings, pixels: f64) -> f64 {
        if self.meshes() { pixels / self.pixels_of(Rung::Mesh, settings) } else { 0.0 }
    }

    /// Distance to which trees that would be `pixels` high at one metre are clouds of cards, m, where z-fields are behind them; `None` where cards are
    /// the last that are drawn one by one; 0 where none is.
    pub fn card_range(&self, settings: &Settings, pixels: f64) -> Option<f64> {
        match (self.cards(), self.z_fields()) {
            (false, _) => Some(0.0),
            (true, true) => Some(pixels / self.pixels_of(Rung::Cards, settings)),
            (true, false) => None,
        }
    }

    /// Distance to which trees are drawn one by one that would be `pixels` high at one metre, m: to where they hand over, or, where
    /// they do not, so far that those at the distance `farthest` have not begun to fade; 0 where none is.
    pub fn range(&self, settings: &Settings, pixels: f64, farthest: f64) -> f64 {
        match (self.draws_trees(), self.goes_on()) {
            (false, _) => 0.0,
            (true, true) => pixels / self.least_pixels(settings),
            (true, false) => farthest / fade_begin(),
        }
    }

    /// That heights written down grow smaller from rung to rung, or what is wrong and the remedy.
    pub fn descends(&self) -> Result<(), (String, String)> {
        let written: Vec<f64> = self.steps.iter().flatten().filter_map(|s| s.pixels).collect();
        match written.iter().zip(written.iter().skip(1)).find(|(near, far)| near <= far) {
            Some((near, far)) => {
                Err((format!("{far} pixels behind {near}"), "write smaller heights from rung to rung".into()))
            }
            None => Ok(()),
        }
    }

    /// Distance to which every tree of a range is opaque, m.
    pub fn opaque_to(&self, range: f64) -> f64 {
        // Room for the rounding of one product and one quotient.
        range * fade_begin() * (1.0 + 1e-9)
    }
}

/// Steps of these rungs, none of which says a height.
const fn steps(rungs: &[Rung]) -> [Option<Step>; RUNGS] {
    let mut steps = [None; RUNGS];
    let mut k = 0;
    while k < rungs.len() {
        steps[k] = Some(Step { rung: rungs[k], pixels: None });
        k += 1;
    }
    steps
}

/// Part of its range to which every tree of a species is opaque, and nothing is handed over.
fn fade_begin() -> f64 {
    f64::from(FADE_FIRST) - 1.0 / f64::from(FADE_RATE)
}

impl fmt::Display for Ladder {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        for (k, step) in self.steps.iter().flatten().enumerate() {
            let comma = if k > 0 { "," } else { "" };
            write!(f, "{comma}{}", step.rung.name())?;
            step.pixels.map_or(Ok(()), |pixels| write!(f, ":{pixels}"))?;
        }
        Ok(())
    }
}

impl serde::Serialize for Ladder {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// What is wrong with a ladder as it was written, and how to put it right.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LadderError {
    /// Where, and what is wrong there.
    pub what: String,
    /// What to write instead.
    pub remedy: String,
}

impl fmt::Display for LadderError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}; {}", self.what, self.remedy)
    }
}

impl std::error::Error for LadderError {}

/// What must stand behind meshes.
const MESHES_HAND_OVER: &str =
    "meshes hand over to z-fields or cards: write mesh:256,zfield:4,shader-map or mesh:256,cards:30,shells";

/// The rungs by name, for messages.
fn rung_names() -> String {
    Rung::NAMES.map(|n| n.0).join(", ")
}

impl FromStr for Ladder {
    type Err = LadderError;

    fn from_str(text: &str) -> Result<Self, LadderError> {
        if text.trim() == "auto" {
            return Ok(Ladder::AUTO);
        }
        let parts: Vec<&str> = text.split(',').map(str::trim).collect();
        let mut steps = [None; RUNGS];
        let mut last: Option<Rung> = None;
        for (k, part) in parts.iter().enumerate() {
            let wrong = |what: String, remedy: String| LadderError {
                what: format!("rung {} of \"{text}\": {what}", k + 1),
                remedy,
            };
            let (name, pixels) =
                part.split_once(':').map_or((*part, None), |(n, p)| (n.trim(), Some(p.trim())));
            let rung = rung(name).map_err(|(what, remedy)| wrong(what, remedy))?;
            if let Some(before) = last.filter(|before| *before as usize >= rung as usize) {
                let what = format!("{name} after {}", before.name());
                let remedy = format!("write each rung once, near to far: {}", rung_names());
                return Err(wrong(what, remedy));
            }
            let pixels = match pixels {
                Some(given) if k + 1 == parts.len() && rung != Rung::Mesh => {
                    let what = "the last rung goes on to the horizon".to_string();
                    let behind = if rung.is_last() { "" } else { ", or write a rung behind it" };
                    return Err(wrong(what, format!("leave out \":{given}\"{behind}")));
                }
                Some(given) => Some(height(rung, given).map_err(|(what, remedy)| wrong(what, remedy))?),
                None => None,
            };
            if last.is_some_and(Rung::is_last) {
                let what = format!("{name} behind {}", last.map_or("", Rung::name));
                return Err(wrong(what, "either goes on to the horizon: write one of them".into()));
            }
            if last == Some(Rung::Mesh) && rung.is_last() {
                let what = format!("{name} behind mesh");
                return Err(wrong(what, MESHES_HAND_OVER.into()));
            }
            // Rungs ascend, so there are no more than steps.
            steps[k] = Some(Step { rung, pixels });
            last = Some(rung);
        }
        let ladder = Ladder { steps, yields: false };
        if last == Some(Rung::Mesh) {
            return Err(LadderError {
                what: format!("\"{text}\": mesh at any distance"),
                remedy: MESHES_HAND_OVER.into(),
            });
        }
        ladder
            .descends()
            .map_err(|(what, remedy)| LadderError { what: format!("\"{text}\": {what}"), remedy })?;
        Ok(ladder)
    }
}

/// The rung of a name, or what is wrong and the remedy.
fn rung(name: &str) -> Result<Rung, (String, String)> {
    if let Some((_, rung)) = Rung::NAMES.iter().find(|(n, _)| *n == name) {
        return Ok(*rung);
    }
    let what = if name.is_empty() { "no name".into() } else { format!("there is no rung \"{name}\"") };
    let near = nearest(name, Rung::NAMES.iter().map(|n| n.0));
    let hint = near.map_or(String::new(), |n| format!("did you mean \"{n}\"? "));
    Err((what, format!("{hint}the rungs are: {}", rung_names())))
}

/// An apparent height in pixels, in the range of the knob that it takes the place of.
fn height(rung: Rung, text: &str) -> Result<f64, (String, String)> {
    let (knob, example) = match rung {
        Rung::Mesh => ("mesh_min_pixels", "mesh:256"),
        Rung::Cards => ("cards_min_pixels", "cards:30"),
        _ => ("zfield_min_pixels", "zfield:4"),
    };
    let range = KNOBS.iter().find(|k| k.name == knob).map_or(0.0..=0.0, |k| k.min..=k.max);
    match text.parse::<f64>() {
        Ok(pixels) if range.contains(&pixels) => Ok(pixels),
        _ => Err((
            format!("\"{text}\" is no height that a rung is used down to"),
            format!("write {} to {} pixels, such as {example}", range.start(), range.end()),
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::interface::{FADE_SPREAD, HANDOVER_FROM, HANDOVER_RATE};
    use crate::physics::handover;

    #[test]
    fn what_is_printed_is_what_was_written() {
        for text in [
            "mesh:256,zfield:4,shader-map",
            "mesh,zfield",
            "mesh:256,cards:30,shader-map",
            "mesh:256,cards,zfield:4,shader-map",
            "mesh:256,cards:30,shells",
            "mesh:256,zfield:12,shells",
            "mesh:256,cards:64,zfield:12,shells",
            "shells",
            "cards",
            "zfield:0.25,shader-map",
            "zfield,shader-map",
            "zfield",
            "shader-map",
        ] {
            assert_eq!(text.parse::<Ladder>().unwrap().to_string(), text);
        }
        assert_eq!(
            " zfield : 6.5 , shader-map ".parse::<Ladder>().unwrap().to_string(),
            "zfield:6.5,shader-map"
        );
        for (name, ladder) in Ladder::SHORTHANDS {
            assert_eq!(ladder.name(), name);
            assert_eq!(name.parse::<Ladder>().unwrap(), ladder);
        }
        // Rungs that are written out are demanded.
        let demanded = Ladder::AUTO.to_string().parse::<Ladder>().unwrap();
        assert_eq!((demanded.to_string(), demanded.without_meshes()), (Ladder::AUTO.to_string(), None));
        assert_eq!(Ladder::AUTO.without_meshes(), Some(Ladder::BN12));
        let four = "zfield:4,shader-map".parse::<Ladder>().unwrap();
        assert_eq!(four.name(), "zfield:4,shader-map");
        assert_eq!(serde_json::to_value(four).unwrap(), "zfield:4,shader-map");
    }

    #[test]
    fn what_is_no_ladder_is_refused_with_the_place_and_a_remedy() {
        for (text, what, remedy) in [
            ("", "rung 1 of \"\": no name", "the rungs are: mesh, cards, zfield, shader-map, shells"),
            ("mesh", "mesh at any distance", "write mesh:256,zfield:4,shader-map"),
            ("mesh:256", "mesh at any distance", "write mesh:256,zfield:4,shader-map"),
            (
                "mesh:256,shader-map",
                "rung 2 of \"mesh:256,shader-map\": shader-map behind mesh",
                "hand over to z-fields",
            ),
            ("mesh:8,zfield:4", "\"8\" is no height", "16 to 65536 pixels, such as mesh:256"),
            ("mesh:16,zfield:32,shader-map", "32 pixels behind 16", "smaller heights"),
            ("zfield:4,mesh:256", "mesh after zfield", "near to far"),
            (
                "zfield:4,slices",
                "no rung \"slices\"",
                "the rungs are: mesh, cards, zfield, shader-map, shells",
            ),
            ("zfield:4,shader-map,shells", "shells behind shader-map", "write one of them"),
            ("mesh:256,shells", "shells behind mesh", "hand over to z-fields or cards"),
            ("zfield:4,shells:2", "the last rung goes on to the horizon", "leave out \":2\""),
            ("zfeild", "no rung \"zfeild\"", "did you mean \"zfield\"?"),
            ("zfield:4", "the last rung goes on to the horizon", "leave out \":4\""),
            ("zfield:4,shader-map:2", "rung 2 of", "leave out \":2\""),
            ("zfield:four,shader-map", "\"four\" is no height", "0.25 to 64 pixels"),
            ("zfield:0,shader-map", "\"0\" is no height", "0.25 to 64 pixels"),
            ("zfield:nan,shader-map", "\"nan\" is no height", "0.25 to 64 pixels"),
            ("zfield:,shader-map", "\"\" is no height", "0.25 to 64 pixels"),
            (
                "shader-map:4,zfield",
                "rung 2 of \"shader-map:4,zfield\": zfield after shader-map",
                "near to far",
            ),
            ("zfield:12,cards:4,shader-map", "cards after zfield", "near to far"),
            ("mesh:256,cards:4", "the last rung goes on to the horizon", "leave out \":4\""),
            ("cards:0,shader-map", "\"0\" is no height", "0.25 to 4096 pixels, such as cards:30"),
            ("zfield:4,zfield", "zfield after zfield", "each rung once"),
            ("zfield:4,", "rung 2 of \"zfield:4,\": no name", "the rungs are"),
        ] {
            let wrong = text.parse::<Ladder>().unwrap_err();
            assert!(wrong.what.contains(what) && wrong.remedy.contains(remedy), "{text}: {wrong}");
        }
    }

    #[test]
    fn a_range_ends_where_trees_hand_over_or_beyond_the_last_tree() {
        let mut settings = Settings::default();
        settings.set("zfield_min_pixels", 5.0).unwrap();
        let four: Ladder = "zfield:4,shader-map".parse().unwrap();
        assert_eq!(four.range(&settings, 1000.0, 3000.0), 250.0);
        assert_eq!(Ladder::BN12.range(&settings, 1000.0, 3000.0), 200.0);
        assert_eq!(Ladder::AUTO.resolved(&settings).to_string(), "mesh:256,zfield:5,shader-map");
        assert_eq!(four.resolved(&settings), four);
        // What is written may contradict what knobs say.
        let both: Ladder = "mesh:20,cards,shader-map".parse().unwrap();
        assert!(
            both.descends().is_ok()
                && both.resolved(&settings).descends().unwrap_err().0.contains("30 pixels behind 20")
        );
        assert_eq!(Ladder::SHADER_MAP.range(&settings, 1000.0, 3000.0), 0.0);
        let near: Ladder = "mesh:200,zfield,shader-map".parse().unwrap();
        assert_eq!((near.mesh_range(&settings, 1000.0), near.range(&settings, 1000.0, 3000.0)), (5.0, 200.0));
        assert_eq!(near.resolved(&settings).to_string(), "mesh:200,zfield:5,shader-map");
        assert_eq!(Ladder::BN12.mesh_range(&settings, 1000.0), 0.0);
        assert_eq!(Ladder::BN12.card_range(&settings, 1000.0), Some(0.0));
        // Cards hand over to what is behind them; where that is the average, as the last that are drawn one by one do.
        let [to_zfields, last]: [Ladder; 2] =
            ["mesh:200,cards:20,zfield:4,shader-map", "mesh:200,cards:20,shader-map"]
                .map(|l| l.parse().unwrap());
        assert_eq!(
            (to_zfields.card_range(&settings, 1000.0), to_zfields.range(&settings, 1000.0, 3000.0)),
            (Some(50.0), 250.0)
        );
        assert_eq!((last.card_range(&settings, 1000.0), last.range(&settings, 1000.0, 3000.0)), (None, 50.0));
        assert!(last.draws_trees() && last.cards() && !last.z_fields() && last.hands_over());
        // The farthest tree of z-fields alone is opaque, and nothing is handed over there.
        let relative = 3000.0 / Ladder::ZFIELD.range(&settings, 1000.0, 3000.0);
        assert!((handover::tree_fade(relative, 0.0) - 1.0).abs() < 1e-6 && relative > 0.79);
        assert!(handover::handed_over(relative) < 1e-12);
        assert_eq!(Ladder::ZFIELD.resolved(&settings).to_string(), "zfield");
    }

    #[test]
    fn there_is_one_band() {
        assert_eq!(
            [f64::from(FADE_FIRST) as f32, FADE_SPREAD, FADE_RATE, HANDOVER_FROM, HANDOVER_RATE],
            [
                handover::FADE_FIRST,
                handover::FADE_SPREAD,
                handover::FADE_RATE,
                handover::HANDOVER_FROM,
                handover::HANDOVER_RATE
            ]
            .map(|v| v as f32)
        );
        // It begins where the first tree does, and ends where the last has.
        assert!((fade_begin() - handover::HANDOVER_FROM).abs() < 1e-6);
        let end = handover::HANDOVER_FROM + 1.0 / handover::HANDOVER_RATE;
        assert!((end - handover::fade_end(1.0)).abs() < 1e-12);
    }
}
