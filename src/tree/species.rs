//! Species from presets and from files of one's own, with numbers changed one by one.

use std::path::{Path, PathBuf};

use toml::de::{DeTable, DeValue};

use super::keys::{KEYS, Takes, check};
use super::parameters::Parameters;
use super::{Preset, individual, limits};
use crate::input::read_text;
use crate::keys::Source;
use crate::{Error, Result};

/// Most bytes of a species file.
const MAX_BYTES: u64 = 1 << 20;

/// A species that is ready to grow.
#[derive(Clone, Debug)]
pub struct Species {
    name: String,
    text: String,
    parameters: Parameters,
}

impl Species {
    /// What a person names as a tree, a preset or a species file, with numbers set as `NAME=VALUE`. A file is what ends
    /// in `.toml`.
    ///
    /// # Errors
    /// [`Error::Usage`] for an unknown preset, or a setting that has no `=` or no table to be set in; [`Error::Io`] for a
    /// file that cannot be read; [`Error::Input`] with the key, its range or the nearest key for what a file or a setting
    /// gets wrong.
    pub fn named(tree: &str, settings: &[String]) -> Result<Self> {
        let path = Path::new(tree);
        let is_file = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml"));
        let (name, text) = if is_file {
            (path.file_stem().unwrap_or_default().to_string_lossy().into(), read_text(path, MAX_BYTES)?)
        } else {
            let preset: Preset = tree.parse()?;
            (preset.name().to_string(), preset.text().to_string())
        };
        // The file is checked before anything in it is changed: its lines are then those that a person sees.
        read(path, &text)?;
        let text = settings.iter().try_fold(text, |text, setting| set(&text, setting))?;
        let parameters = read(path, &text)?;
        Ok(Species { name, text, parameters })
    }

    /// Name of the preset, or of the file without its ending.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The species as TOML, with what was set.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// One individual, as [`glb`](super::glb).
    pub fn glb(&self, seed: u32) -> Vec<u8> {
        individual(&self.parameters, seed)
    }
}

/// Reads and checks a whole species.
fn read(path: &Path, text: &str) -> Result<Parameters> {
    let source = Source { path, text };
    // Names, types and ranges first, whose errors say more than those of deserialising.
    check(&source, true, || Ok(()))?;
    let parameters = toml::from_str(text).map_err(|e| source.syntax(&e))?;
    check(&source, true, || limits::check(&parameters))?;
    Ok(parameters)
}

/// A text with one key set, in the place where it stands.
fn set(text: &str, setting: &str) -> Result<String> {
    // One line: a second would set what nobody checks.
    let pair = setting.split_once('=').filter(|_| !setting.contains('\n'));
    let Some((name, value)) = pair.map(|(n, v)| (n.trim(), v.trim())) else {
        return Err(Error::Usage(format!("--set {setting}: write NAME=VALUE, such as base_size=0.4")));
    };
    let value = complete(text, name, value);
    let line = format!("{name} = {value}");
    let path = PathBuf::from(format!("--set {setting}"));
    check(&Source { path: &path, text: &line }, false, || Ok(()))?;
    edited(text, name, &value).ok_or_else(|| {
        let table = name.split('.').next().unwrap_or_default();
        Error::Usage(format!("--set {setting}: the species has no table [{table}] of its own"))
    })
}

/// A value as TOML: a bare word gets its quotes, and a number alone for a pair keeps the second number of the text.
fn complete(text: &str, name: &str, value: &str) -> String {
    let takes = KEYS.iter().find(|k| k.name == name).map(|k| k.takes);
    match takes {
        Some(Takes::Pair(..)) if value.parse::<f64>().is_ok() => {
            let second = toml::from_str::<toml::Table>(text).ok().and_then(|document| {
                let (table, own) = name.split_once('.').unwrap_or(("", name));
                let table = if table.is_empty() { &document } else { document.get(table)?.as_table()? };
                table.get(own)?.get(1).cloned()
            });
            format!("[{value}, {}]", second.unwrap_or(toml::Value::Float(0.0)))
        }
        Some(Takes::Word(_)) if !value.starts_with(['"', '\'']) => toml::Value::from(value).to_string(),
        _ => value.to_string(),
    }
}

/// Puts a value in the place of an older one, or at the top of its table if there is none.
fn edited(text: &str, name: &str, value: &str) -> Option<String> {
    let document = DeTable::parse(text).ok()?;
    let (table, own) = name.split_once('.').unwrap_or(("", name));
    let table: &DeTable = match table {
        "" => document.get_ref(),
        table => match document.get_ref().get(table)?.get_ref() {
            DeValue::Table(table) => table,
            _ => return None,
        },
    };
    let mut text = text.to_string();
    match table.get(own) {
        Some(old) => text.replace_range(old.span(), value),
        None => {
            let first = table.keys().map(|k| k.span().start).min()?;
            let line = text[..first].rfind('\n').map_or(0, |end| end + 1);
            text.insert_str(line, &format!("{own} = {value}\n"));
        }
    }
    Some(text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tree::random::Random;
    use crate::tree::{skeleton, surface};

    fn named(tree: &str, settings: &[&str]) -> Result<Species> {
        Species::named(tree, &settings.iter().map(|s| s.to_string()).collect::<Vec<_>>())
    }

    fn refused(tree: &str, settings: &[&str]) -> String {
        let error = named(tree, settings).expect_err(&format!("{settings:?}"));
        assert_eq!(error.exit_code(), 2);
        error.to_string()
    }

    #[test]
    fn settings_move_numbers_and_nothing_else() {
        let oak = named("oak", &[]).unwrap();
        assert_eq!((oak.name(), oak.text()), ("oak", Preset::Oak.text()));
        let settings =
            ["base_size=0.4", "branches.count = 60", "twigs.length=0.5", "twigs.droop=30", "shape=spire"];
        let set = named("oak", &settings).unwrap();
        let p = &set.parameters;
        assert_eq!((p.base_size, p.branches.count, p.twigs.droop), (0.4, 60.0, 30.0));
        assert_eq!(p.twigs.length, [0.5, 0.08], "a number alone keeps the variation");
        let plain = |text: &str| text.lines().map(str::to_string).collect::<std::collections::BTreeSet<_>>();
        let (before, after) = (plain(oak.text()), plain(set.text()));
        assert_eq!(before.difference(&after).count(), 4, "the other lines stay");
        assert_eq!(after.difference(&before).count(), 5);
        assert!(set.text().starts_with("# Oak"), "comments stay");
    }

    #[test]
    fn mistakes_are_named_with_their_remedy() {
        for (setting, hints) in [
            ("bas_size=0.4", &["bas_size", "`base_size`?"][..]),
            ("branches.cuont=60", &["branches.cuont", "`count`?"]),
            ("branch.count=60", &["`branches`?"]),
            ("base_size=2", &["base_size", "2 is outside 0 to 0.95"]),
            ("base_size=nan", &["base_size"]),
            ("branches.count=2.5", &["a whole number"]),
            ("branches.length=[1, 2, 3]", &["2 are needed"]),
            ("branches.length=7", &["7 is outside 0.01 to 2"]),
            ("shape=cubical", &["conical", "tend-flame"]),
            ("bark.light=[0.1, 0.2, 1.5]", &["1.5 is outside 0 to 1"]),
            ("base_size", &["NAME=VALUE"]),
            ("base_size=0.9", &["line 3, key `base_size`", "at most 0.874"]),
            ("scale=[1, 5]", &["key `scale`", "at most 0.9"]),
            ("twigs.curve=360", &["key `twigs.segments`", "degrees"]),
            ("ratio=0.1\nflare=1", &["NAME=VALUE"]),
        ] {
            let text = refused("oak", &[setting]);
            assert!(hints.iter().all(|h| text.contains(h)), "{setting}: {text}");
        }
        assert!(refused("snag", &["leaves.count=3"]).contains("[leaves]"));
        let many = refused("oak", &["branches.count=500", "twigs.count=100"]);
        assert!(many.contains("triangles") && many.contains("200000"), "{many}");
    }

    #[test]
    fn files_are_read_and_their_mistakes_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("elm.toml");
        let tree = path.to_str().unwrap();
        let write = |text: &str| std::fs::write(&path, text).unwrap();
        write(Preset::Birch.text());
        let elm = named(tree, &[]).unwrap();
        assert!(elm.name() == "elm" && elm.glb(3) == crate::tree::glb(Preset::Birch, 3));
        write(&Preset::Birch.text().replace("ratio = ", "ration = "));
        let text = refused(tree, &[]);
        assert!(text.contains("elm.toml: line 5, key `ration`") && text.contains("`ratio`?"), "{text}");
        write(&Preset::Birch.text().replace("flare = 0.35\n", ""));
        assert!(refused(tree, &[]).contains("`flare` is missing"));
        write(&Preset::Birch.text().replace("[twigs]", "[twig]"));
        assert!(refused(tree, &[]).contains("`twigs`?"));
        write("base_size = [");
        assert!(refused(tree, &["base_size=0.1"]).contains("line 1"));
        assert!(refused("/nonexistent/elm.toml", &[]).contains("/nonexistent/elm.toml"));
        assert!(refused("elm", &[]).contains("birch"));
    }

    /// A value of a key, mostly near 0, where counts and bends leave room for others.
    fn any(takes: Takes, random: &mut Random) -> String {
        let mut within = |[low, high]: [f64; 2]| {
            let from = 0f64.clamp(low, high);
            let to = if random.unit() < 0.5 { low } else { high };
            from + (to - from) * random.unit().powi(2)
        };
        match takes {
            Takes::Number(range) => within(range).to_string(),
            Takes::Whole(range) => within(range).round().to_string(),
            Takes::Pair(first, second) => format!("[{}, {}]", within(first), within(second)),
            Takes::Color => format!("[{}, 0, 1]", within([0.0, 1.0])),
            Takes::Word(words) => words[(within([0.0, 1.0]) * (words.len() - 1) as f64) as usize].into(),
        }
    }

    #[test]
    fn whatever_is_allowed_grows_finite_and_small() {
        let mut random = Random::new(1, 1);
        let mut grown = 0;
        for _ in 0..300 {
            let mut settings = Vec::new();
            for key in KEYS {
                if random.unit() < 0.2 {
                    settings.push(format!("{}={}", key.name, any(key.takes, &mut random)));
                }
            }
            let Ok(species) = Species::named("oak", &settings) else { continue };
            let skeleton = skeleton::grow(&species.parameters, 1);
            let bark = surface::bark(&species.parameters, &skeleton);
            let leaves = surface::leaves(&species.parameters.leaves.unwrap(), &skeleton);
            for surface in [bark, leaves] {
                let numbers = surface.positions.iter().chain(&surface.normals).flatten();
                assert!(numbers.copied().all(|n| n.abs() < 1e4), "{settings:?}");
                assert!(surface.indices.len() <= 600_000, "{settings:?}");
            }
            grown += 1;
        }
        assert!(grown > 20, "only {grown} of these were allowed");
    }
}
