//! Which settings a sweep measures, in which order.

use std::collections::BTreeMap;

use crate::ladder::Ladder;
use crate::settings::{KNOBS, Knob, PRESETS, Settings};
use crate::{Error, Result};

/// The preset that all times are relative to in the end.
pub const HOME: &str = PRESETS[1];

/// Why a setting is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Group {
    /// A preset.
    Preset,
    /// One knob moved from a preset.
    Knob,
    /// Several knobs moved from [`HOME`].
    Product,
    /// A preset with another ladder.
    Ladder,
}

/// A setting to measure.
#[derive(Clone, Debug, PartialEq)]
pub struct Setting {
    /// Preset and what differs from it, such as `balanced samples=8`.
    pub name: String,
    /// Preset that it is drawn in turn with; of the others' presets [`HOME`], of which itself.
    pub base: String,
    /// Why it is measured.
    pub group: Group,
    /// Knobs that differ from those of its preset.
    pub changed: BTreeMap<String, f64>,
    /// Every knob.
    pub settings: Settings,
    /// What stands for a tree, where it is not what the sweep's scene says.
    pub ladder: Option<Ladder>,
}

/// A knob that is swept.
#[derive(Clone, Debug)]
pub struct Swept {
    /// The knob.
    pub knob: &'static Knob,
    /// Its values around [`HOME`], and of no other preset; empty: those to try around every preset.
    pub values: Vec<f64>,
}

impl Swept {
    /// The values to move to from a preset's.
    fn around(&self, preset: &str, value: f64) -> Vec<f64> {
        match &self.values[..] {
            [] => self.knob.around(value),
            values if preset == HOME => values.iter().copied().filter(|v| *v != value).collect(),
            _ => Vec::new(),
        }
    }

    /// The most accurate of its values and that of the preset `accurate`: the one that the knob tries last.
    fn most_accurate(&self, preset: f64) -> f64 {
        let order = |v: f64| self.knob.tries.iter().position(|t| *t == v);
        let all = if self.values.is_empty() { self.knob.tries } else { &self.values };
        all.iter().copied().fold(preset, |best, v| if order(v) > order(best) { v } else { best })
    }

    /// The name, and the values that were named.
    pub fn label(&self) -> String {
        let values: Vec<String> = self.values.iter().map(f64::to_string).collect();
        if values.is_empty() {
            self.knob.name.into()
        } else {
            format!("{}={}", self.knob.name, values.join("/"))
        }
    }
}

/// The knobs of a sweep: all that have values to try, or those named, as `samples` or with values as `samples=1/4`.
///
/// # Errors
/// [`Error::Usage`] for a name that is no such knob, and for a value that is no number.
pub fn knobs(named: &[String]) -> Result<Vec<Swept>> {
    if named.is_empty() {
        let all = KNOBS.iter().filter(|k| !k.tries.is_empty());
        return Ok(all.map(|knob| Swept { knob, values: Vec::new() }).collect());
    }
    let find = |text: &String| {
        let (name, values) = text.split_once('=').unwrap_or((text, ""));
        // A knob that exists, or the settings' own message.
        let Some(knob) = KNOBS.iter().find(|k| k.name == name) else {
            return Err(Settings::default().set(name, 0.0).err().unwrap_or(Error::Usage(name.into())));
        };
        let number = |v: &str| {
            v.parse().map_err(|_| Error::Usage(format!("\"{text}\": write KNOB, or KNOB=VALUE/VALUE")))
        };
        let values: Vec<f64> =
            values.split('/').filter(|v| !v.is_empty()).map(number).collect::<Result<_>>()?;
        let fixed = Error::Usage(format!("knob \"{name}\" is no choice between time and accuracy"));
        if knob.tries.is_empty() { Err(fixed) } else { Ok(Swept { knob, values }) }
    };
    named.iter().map(find).collect()
}

/// Those of them that any of some ladders draws by: cards' are for ladders with cards, shells' for ladders with shells.
pub fn used_by(knobs: Vec<Swept>, ladders: &[Ladder]) -> Vec<Swept> {
    let cards = ladders.iter().any(Ladder::cards);
    let shells = ladders.iter().any(Ladder::shells);
    let of_cards = |s: &Swept| s.knob.name.starts_with("card") || s.knob.name.starts_with("cloud");
    let of_shells = |s: &Swept| s.knob.name.starts_with("shell");
    knobs.into_iter().filter(|s| (cards || !of_cards(s)) && (shells || !of_shells(s))).collect()
}

/// Presets, [`HOME`] first; then each knob's values below and above that of each preset, [`HOME`]'s first. `bases` are the
/// presets as the scene changes them. Settings that are the same as an earlier one are left out.
///
/// # Errors
/// [`Error::Usage`] for a value that no knob takes.
pub fn one_at_a_time(bases: &BTreeMap<String, Settings>, knobs: &[Swept]) -> Result<Vec<Setting>> {
    let mut order = vec![HOME];
    order.extend(PRESETS.iter().filter(|p| **p != HOME));
    let mut all: Vec<Setting> = Vec::new();
    for name in order.iter().filter(|n| bases.contains_key(**n)) {
        let group = Group::Preset;
        let (changed, settings) = (BTreeMap::new(), bases[*name].clone());
        all.push(Setting {
            name: name.to_string(),
            base: HOME.into(),
            group,
            changed,
            settings,
            ladder: None,
        });
    }
    for name in order.iter().filter(|n| bases.contains_key(**n)) {
        let base = &bases[*name];
        for swept in knobs {
            let knob = swept.knob.name;
            for value in swept.around(name, base.get(knob).unwrap_or(f64::NAN)) {
                let setting = moved(name, base, &[(knob, value)], Group::Knob)?;
                if all.iter().all(|s| s.settings != setting.settings) {
                    all.push(setting);
                }
            }
        }
    }
    Ok(all)
}

/// Every preset with each of some ladders.
pub fn with_ladders(bases: &BTreeMap<String, Settings>, ladders: &[Ladder]) -> Vec<Setting> {
    let mut all = Vec::new();
    for ladder in ladders {
        for preset in PRESETS.iter().filter(|p| bases.contains_key(**p)) {
            all.push(Setting {
                name: format!("{preset} {}", ladder.name()),
                base: HOME.into(),
                group: Group::Ladder,
                changed: BTreeMap::new(),
                settings: bases[*preset].clone(),
                ladder: Some(*ladder),
            });
        }
    }
    all
}

/// Every combination of the values around those of [`HOME`], and these, of several knobs, less what `done` has.
///
/// # Errors
/// [`Error::Usage`] for a value that no knob takes.
pub fn product(home: &Settings, knobs: &[Swept], done: &[Setting]) -> Result<Vec<Setting>> {
    let mut moves: Vec<Vec<(&str, f64)>> = vec![Vec::new()];
    for swept in knobs {
        let knob = swept.knob.name;
        let values = swept.around(HOME, home.get(knob).unwrap_or(f64::NAN));
        let with = |m: &Vec<(&'static str, f64)>, v: f64| {
            let mut m = m.clone();
            m.push((knob, v));
            m
        };
        moves = moves
            .iter()
            .flat_map(|m| std::iter::once(m.clone()).chain(values.iter().map(|v| with(m, *v))))
            .collect();
    }
    let mut all = Vec::new();
    for m in moves {
        let setting = moved(HOME, home, &m, Group::Product)?;
        if done.iter().all(|s| s.settings != setting.settings) {
            all.push(setting);
        }
    }
    Ok(all)
}

/// A base with knobs moved.
fn moved(base: &str, settings: &Settings, moves: &[(&str, f64)], group: Group) -> Result<Setting> {
    let mut setting = Setting {
        name: base.into(),
        base: base.into(),
        group,
        changed: BTreeMap::new(),
        settings: settings.clone(),
        ladder: None,
    };
    for (knob, value) in moves {
        setting.settings.set(knob, *value)?;
        setting.changed.insert(knob.to_string(), *value);
        setting.name += &format!(" {knob}={value}");
    }
    Ok(setting)
}

/// The most accurate setting: the preset `accurate`, with every knob that is swept at the most accurate of its values.
///
/// # Errors
/// [`Error::Usage`] without that preset.
pub fn most_accurate(bases: &BTreeMap<String, Settings>, knobs: &[Swept]) -> Result<Settings> {
    let preset = PRESETS[2];
    let base = bases.get(preset).ok_or_else(|| Error::Usage(format!("no preset \"{preset}\"")))?;
    let mut settings = base.clone();
    for swept in knobs {
        let knob = swept.knob.name;
        settings.set(knob, swept.most_accurate(base.get(knob).unwrap_or(f64::NAN)))?;
    }
    Ok(settings)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bases() -> BTreeMap<String, Settings> {
        PRESETS.iter().map(|p| (p.to_string(), Settings::preset(p).unwrap())).collect()
    }

    fn some(names: &[&str]) -> Vec<Swept> {
        knobs(&names.iter().map(|n| n.to_string()).collect::<Vec<_>>()).unwrap()
    }

    #[test]
    fn presets_come_first_and_no_setting_twice() {
        let all = one_at_a_time(&bases(), &knobs(&[]).unwrap()).unwrap();
        let first: Vec<&str> = all.iter().take(3).map(|s| s.name.as_str()).collect();
        assert_eq!(first, ["balanced", "fast", "accurate"]);
        for (k, s) in all.iter().enumerate() {
            assert!(all[..k].iter().all(|o| o.settings != s.settings && o.name != s.name), "{}", s.name);
            let differing = KNOBS
                .iter()
                .filter(|n| s.settings.get(n.name) != bases()[s.name.split(' ').next().unwrap()].get(n.name));
            assert_eq!(differing.count(), s.changed.len(), "{}", s.name);
        }
        // The paper's choices all have neighbours.
        for knob in [
            "view_rings",
            "view_resolution",
            "view_iterations",
            "zfield_min_pixels",
            "samples",
            "table_angles",
            "table_densities",
        ] {
            assert!(all.iter().any(|s| s.base == HOME && s.changed.contains_key(knob)), "{knob}");
        }
        let orders: Vec<usize> = ["balanced ", "fast ", "accurate "]
            .map(|p| all.iter().position(|s| s.name.starts_with(p)).unwrap())
            .into();
        assert!(orders.is_sorted(), "{orders:?}");
    }

    #[test]
    fn products_have_every_combination_once() {
        let home = Settings::default();
        let two = some(&["cascades", "view_iterations"]);
        let singles = one_at_a_time(&bases(), &two).unwrap();
        let new = product(&home, &two, &singles).unwrap();
        // 2 × 3 values (4 cascades are the most), less balanced itself and 1 + 2 neighbours.
        let names: Vec<&str> = new.iter().map(|s| s.name.as_str()).collect();
        assert_eq!(names, ["balanced cascades=3 view_iterations=1", "balanced cascades=3 view_iterations=3"]);
        assert_eq!(most_accurate(&bases(), &two).unwrap().view_iterations, 4);
    }

    #[test]
    fn ladders_are_drawn_at_every_preset() {
        let two: Vec<Ladder> =
            ["zfield:4,shader-map", "cards:30,shader-map"].map(|l| l.parse().unwrap()).into();
        let all = with_ladders(&bases(), &two);
        let names: Vec<&str> = all.iter().map(|s| s.name.as_str()).collect();
        assert_eq!(names[..2], ["fast zfield:4,shader-map", "balanced zfield:4,shader-map"]);
        assert!(names.len() == 6 && all.iter().all(|s| s.base == HOME && s.group == Group::Ladder));
        assert_eq!((all[5].ladder, &all[5].settings), (Some(two[1]), &bases()["accurate"]));
    }

    #[test]
    fn knobs_of_cards_are_for_ladders_with_cards() {
        let names = |ladder: &str| -> Vec<&str> {
            let all = used_by(knobs(&[]).unwrap(), &[Ladder::BN12, ladder.parse().unwrap()]);
            all.iter().map(|s| s.knob.name).collect()
        };
        assert!(names("cards:8,shader-map").contains(&"cloud_min_pixels"));
        let without = names("mesh:64,zfield:4,shader-map");
        assert!(!without.iter().any(|n| n.starts_with("card") || n.starts_with("cloud")));
        assert!(without.contains(&"cascades") && without.contains(&"cascade_size"), "{without:?}");
    }

    #[test]
    fn named_values_are_those_around_home() {
        let two = some(&["view_rings=6/9/12", "samples=1/4"]);
        let names = |s: &Setting| s.name.clone();
        let all: Vec<String> = one_at_a_time(&bases(), &two).unwrap().iter().map(names).collect();
        let moved = [
            "balanced view_rings=6",
            "balanced view_rings=9",
            "balanced view_rings=12",
            "balanced samples=1",
        ];
        assert_eq!(all, [&["balanced", "fast", "accurate"][..], &moved].concat());
        // The preset `accurate` has more rings and samples.
        let finest = most_accurate(&bases(), &two).unwrap();
        assert_eq!((finest.view_rings, finest.samples), (12, 8));
        assert_eq!([two[0].label(), some(&["samples"])[0].label()], ["view_rings=6/9/12", "samples"]);
        assert!(knobs(&["samples=few".into()]).is_err());
    }

    #[test]
    fn knobs_that_are_no_choice_are_refused() {
        for (name, hint) in [("cascade", "\"cascades\""), ("memory_mib", "no choice")] {
            let error = knobs(&[name.to_string()]).unwrap_err().to_string();
            assert!(error.contains(hint), "{error}");
        }
    }
}
