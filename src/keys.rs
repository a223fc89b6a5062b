//! Strict reading of TOML tables: every key known, every value of the right type and in its range.
//! Each failure is one [`Error::Input`] with the line and the full key.

use std::ops::RangeInclusive;
use std::path::Path;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::settings::nearest;
use crate::{Error, Result};

/// A text and its name, to turn byte offsets into lines.
pub(crate) struct Source<'a> {
    /// The file as the user named it.
    pub path: &'a Path,
    /// Its whole text.
    pub text: &'a str,
}

impl Source<'_> {
    /// The line number, from 1, of a byte offset.
    fn line(&self, offset: usize) -> usize {
        1 + self.text.as_bytes()[..offset.min(self.text.len())].iter().filter(|b| **b == b'\n').count()
    }

    /// An error in the TOML syntax itself.
    pub fn syntax(&self, error: &toml::de::Error) -> Error {
        let place = error.span().map_or(String::new(), |s| format!("line {}", self.line(s.start)));
        Error::input(self.path, place, error.message(), "correct the TOML syntax")
    }
}

/// A value at a key.
#[derive(Clone)]
pub(crate) struct Item<'a> {
    source: &'a Source<'a>,
    key: String,
    offset: usize,
    value: &'a DeValue<'a>,
}

/// A table whose keys are all known.
#[derive(Clone)]
pub(crate) struct Table<'a> {
    source: &'a Source<'a>,
    key: String,
    offset: usize,
    table: &'a DeTable<'a>,
}

fn join(parent: &str, key: &str) -> String {
    if parent.is_empty() { key.to_string() } else { format!("{parent}.{key}") }
}

fn error(source: &Source, offset: usize, key: &str, what: String, remedy: &str) -> Error {
    let line = source.line(offset);
    let place = if key.is_empty() { format!("line {line}") } else { format!("line {line}, key `{key}`") };
    Error::input(source.path, place, what, remedy)
}

impl<'a> Table<'a> {
    /// The table of a whole document. Errors name the first unknown key and the nearest of `known`.
    pub fn root(source: &'a Source<'a>, table: &'a DeTable<'a>, known: &[&str]) -> Result<Self> {
        Table { source, key: String::new(), offset: 0, table }.checked(known)
    }

    fn checked(self, known: &[&str]) -> Result<Self> {
        let unknown = self.table.keys().filter(|k| !known.contains(&k.get_ref().as_ref()));
        let Some(key) = unknown.min_by_key(|k| k.span().start) else { return Ok(self) };
        let name = key.get_ref().as_ref();
        let remedy = match nearest(name, known.iter().copied()) {
            Some(near) => format!("did you mean `{near}`?"),
            None => format!("the keys here are: {}", known.join(", ")),
        };
        let full = join(&self.key, name);
        Err(error(self.source, key.span().start, &full, format!("there is no key `{name}` here"), &remedy))
    }

    /// The value at a key, if it is there.
    pub fn get(&self, key: &str) -> Option<Item<'a>> {
        let (name, value) = self.table.get_key_value(key)?;
        let (source, key) = (self.source, join(&self.key, key));
        Some(Item { source, key, offset: name.span().start, value: value.get_ref() })
    }

    /// The value at a key that must be there.
    pub fn require(&self, key: &str) -> Result<Item<'a>> {
        self.get(key)
            .ok_or_else(|| self.error(format!("the key `{key}` is missing"), &format!("add `{key}`")))
    }

    /// An error if any of these keys is there: they mean nothing for the reason given.
    pub fn forbid(&self, keys: &[&str], because: &str) -> Result<()> {
        match keys.iter().find_map(|k| self.get(k)) {
            Some(item) => Err(item.error(because, "remove this key")),
            None => Ok(()),
        }
    }

    /// Every value, in the order of the text.
    pub fn items(&self) -> Vec<Item<'a>> {
        let mut items: Vec<Item> = self.table.keys().filter_map(|k| self.get(k.get_ref().as_ref())).collect();
        items.sort_by_key(|i| i.offset);
        items
    }

    /// An error about the table as a whole.
    pub fn error(&self, what: impl Into<String>, remedy: &str) -> Error {
        error(self.source, self.offset, &self.key, what.into(), remedy)
    }
}

impl<'a> Item<'a> {
    /// The key's own name, without the tables around it.
    pub fn name(&self) -> &str {
        self.key.rsplit('.').next().unwrap_or(&self.key)
    }

    /// An error about this value.
    pub fn error(&self, what: impl Into<String>, remedy: &str) -> Error {
        error(self.source, self.offset, &self.key, what.into(), remedy)
    }

    fn wrong_type(&self, wanted: &str) -> Error {
        let article = if self.value.type_str().starts_with(['a', 'i']) { "an" } else { "a" };
        self.error(
            format!("this is {article} {}; {wanted} is needed", self.value.type_str()),
            &format!("write {wanted}"),
        )
    }

    /// A table with these known keys.
    pub fn table(&self, known: &[&str]) -> Result<Table<'a>> {
        let table =
            self.value.as_table().ok_or_else(|| self.wrong_type(&format!("a table `[{}]`", self.key)))?;
        Table { source: self.source, key: self.key.clone(), offset: self.offset, table }.checked(known)
    }

    /// The entries of an array, with indices in their keys.
    pub fn array(&self, wanted: &str) -> Result<Vec<Item<'a>>> {
        let array = self.value.as_array().ok_or_else(|| self.wrong_type(wanted))?;
        let entry = |(i, v): (usize, &'a Spanned<DeValue<'a>>)| Item {
            source: self.source,
            key: format!("{}[{i}]", self.key),
            offset: v.span().start,
            value: v.get_ref(),
        };
        Ok(array.iter().enumerate().map(entry).collect())
    }

    /// Text that is not empty.
    pub fn text(&self) -> Result<&'a str> {
        match self.value.as_str() {
            Some("") => Err(self.error("the text is empty", "write something between the quotes")),
            Some(text) => Ok(text),
            None => Err(self.wrong_type("a text in quotes")),
        }
    }

    /// Whether this is text.
    pub fn is_text(&self) -> bool {
        self.value.is_str()
    }

    /// A finite number in a range; `unit` is for the message and may be empty.
    pub fn number(&self, range: RangeInclusive<f64>, unit: &str) -> Result<f64> {
        let value = match self.value {
            DeValue::Integer(i) => i64::from_str_radix(i.as_str(), i.radix()).ok().map(|i| i as f64),
            DeValue::Float(f) => f.as_str().parse().ok(),
            _ => return Err(self.wrong_type("a number")),
        };
        let value: f64 =
            value.ok_or_else(|| self.error("this number does not fit 64 bits", "write a smaller one"))?;
        if !range.contains(&value) {
            let bounds = format!("{} to {} {unit}", range.start(), range.end());
            let remedy = format!("write a number in the range {}", bounds.trim_end());
            return Err(self.error(format!("{value} is outside {}", bounds.trim_end()), &remedy));
        }
        Ok(value)
    }

    /// A whole number that fits 32 bits.
    pub fn whole(&self) -> Result<u32> {
        if !self.value.is_integer() {
            return Err(self.wrong_type("a whole number"));
        }
        self.number(0.0..=f64::from(u32::MAX), "").map(|v| v as u32)
    }

    /// `N` numbers, each in the range.
    pub fn numbers<const N: usize>(&self, range: RangeInclusive<f64>, unit: &str) -> Result<[f64; N]> {
        let entries = self.array(&format!("an array of {N} numbers"))?;
        if entries.len() != N {
            let what = format!("this array has {} entries; {N} are needed", entries.len());
            return Err(self.error(what, &format!("write {N} numbers")));
        }
        let mut out = [0.0; N];
        for (o, e) in out.iter_mut().zip(&entries) {
            *o = e.number(range.clone(), unit)?;
        }
        Ok(out)
    }

    /// Two numbers of the range, the first not larger than the second.
    pub fn interval(&self, range: RangeInclusive<f64>, unit: &str) -> Result<[f64; 2]> {
        let [low, high] = self.numbers::<2>(range, unit)?;
        if low > high {
            return Err(self
                .error(format!("the first number, {low}, exceeds the second, {high}"), "swap the numbers"));
        }
        Ok([low, high])
    }

    /// Three numbers in the range, or one number for all three channels.
    pub fn color(&self, range: RangeInclusive<f64>) -> Result<[f32; 3]> {
        if self.value.is_array() {
            return Ok(self.numbers::<3>(range, "")?.map(|v| v as f32));
        }
        if !self.value.is_integer() && !self.value.is_float() {
            return Err(self.wrong_type("a number or an array of 3 numbers"));
        }
        Ok([self.number(range, "")? as f32; 3])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with<T>(text: &str, known: &[&str], f: impl Fn(Table) -> Result<T>) -> Result<T> {
        let source = Source { path: Path::new("t.toml"), text };
        let table = DeTable::parse(text).map_err(|e| source.syntax(&e))?;
        f(Table::root(&source, table.get_ref(), known)?)
    }

    #[test]
    fn unknown_keys_name_line_and_nearest() {
        let e = with("# c\nseed = 1\nnmae = 2\n", &["name", "seed"], |_| Ok(())).unwrap_err().to_string();
        assert!(e.contains("t.toml: line 3, key `nmae`") && e.contains("`name`?"), "{e}");
    }

    #[test]
    fn numbers_are_checked() {
        let get = |text: &str| with(text, &["a"], |t| t.require("a")?.number(-1.0..=10.0, "m"));
        assert_eq!(get("a = 0x0A").unwrap(), 10.0);
        assert_eq!(get("a = -1").unwrap(), -1.0);
        assert_eq!(get("a = 1_0.0e-1").unwrap(), 1.0);
        for text in [
            "a = nan",
            "a = inf",
            "a = 10.5",
            "a = \"1\"",
            "a = 99999999999999999999",
            "",
            "a = true",
            "a = 1e999",
        ] {
            assert!(get(text).is_err(), "{text}");
        }
        assert!(with("a = [1, 2]", &["a"], |t| t.require("a")?.numbers::<3>(0.0..=9.0, "")).is_err());
        assert!(with("a = [2, 1]", &["a"], |t| t.require("a")?.interval(0.0..=9.0, "")).is_err());
        assert_eq!(with("a = 2", &["a"], |t| t.require("a")?.color(0.0..=9.0)).unwrap(), [2.0; 3]);
    }

    #[test]
    fn array_entries_have_their_own_lines() {
        let e = with("a = [\n 1,\n 77,\n 3]", &["a"], |t| t.require("a")?.numbers::<3>(0.0..=9.0, ""));
        let e = e.unwrap_err().to_string();
        assert!(e.contains("line 3, key `a[1]`"), "{e}");
    }
}
