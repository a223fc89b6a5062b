//! Every key of a species file: what it takes and what it means, in one place.

use super::parameters::{BLADES, RELIEFS, SHAPES};
use crate::Result;
use crate::keys::{Item, Source, Table};
use crate::settings::nearest;
use toml::de::DeTable;

use Takes::{Color, Number, Pair, Whole, Word};

/// A range, both ends allowed.
type Range = [f64; 2];

/// What a key takes.
#[derive(Clone, Copy, Debug)]
pub(super) enum Takes {
    /// A number.
    Number(Range),
    /// A whole number.
    Whole(Range),
    /// Two numbers; mostly a value and its variation.
    Pair(Range, Range),
    /// Linear reflectance, three numbers.
    Color,
    /// One of these words.
    Word(&'static [&'static str]),
}

/// A key of a species file.
#[derive(Clone, Copy, Debug)]
pub struct Key {
    /// Its name, after that of its table and a dot if it is in one.
    pub name: &'static str,
    pub(super) takes: Takes,
    /// Whether every species file has it.
    pub(super) needed: bool,
    /// Meaning, in a line.
    pub meaning: &'static str,
}

const fn key(name: &'static str, takes: Takes, meaning: &'static str) -> Key {
    Key { name, takes, needed: true, meaning }
}

const fn optional(name: &'static str, takes: Takes, meaning: &'static str) -> Key {
    Key { name, takes, needed: false, meaning }
}

const LENGTH: Takes = Pair([0.01, 2.0], [0.0, 2.0]);
const ANGLE: Takes = Pair([-180.0, 180.0], [-180.0, 180.0]);
const TURN: Takes = Pair([-360.0, 360.0], [0.0, 360.0]);
const BEND: Takes = Number([-360.0, 360.0]);
const PART: Takes = Number([0.0, 0.95]);
const UNIT: Takes = Number([0.0, 1.0]);

/// Every key, in the order of the files.
pub const KEYS: &[Key] = &[
    key("shape", Word(&SHAPES), "outline of the crown"),
    key("base_size", PART, "part of the height, from the ground, without branches"),
    key("scale", Pair([0.5, 100.0], [0.0, 50.0]), "height, m, and its variation"),
    key("ratio", Number([0.001, 0.2]), "radius of the trunk by its length"),
    key("ratio_power", Number([0.0, 5.0]), "how fast radii fall with length from stem to stem"),
    key("flare", Number([0.0, 5.0]), "how much wider the trunk's foot is"),
    key("attraction_up", Number([-5.0, 5.0]), "how much twigs turn up; negative, they hang"),
    key("trunk.length", LENGTH, "length by the height, and its variation"),
    optional("trunk.curve", BEND, "bend, degrees; of the lower half if there is a curve_back"),
    optional("trunk.curve_back", BEND, "bend of the upper half, degrees"),
    key("trunk.curve_variation", BEND, "random bend, degrees"),
    key("trunk.segments", Whole([1.0, 32.0]), "straight pieces"),
    key("trunk.taper", UNIT, "0 a cylinder, 1 a cone"),
    key("trunk.sides", Whole([3.0, 32.0]), "sides of a cross-section"),
    key("branches.count", Whole([1.0, 500.0]), "branches on the trunk"),
    key("branches.length", LENGTH, "length by the trunk's, and its variation"),
    key(
        "branches.down_angle",
        ANGLE,
        "degrees from the trunk's axis, and their variation; if that is negative, it is steady from base to top",
    ),
    key(
        "branches.rotate",
        TURN,
        "degrees about the trunk from one to the next; negative: on alternate sides",
    ),
    optional("branches.curve", BEND, "bend, degrees; of the first half if there is a curve_back"),
    optional("branches.curve_back", BEND, "bend of the second half, degrees"),
    key("branches.curve_variation", BEND, "random bend, degrees"),
    optional("branches.droop", BEND, "degrees turned towards the ground; negative: towards the sky"),
    optional("branches.bare", PART, "part of a branch, from its base, without twigs"),
    key("branches.segments", Whole([1.0, 32.0]), "straight pieces"),
    key("branches.taper", UNIT, "0 a cylinder, 1 a cone"),
    key("branches.sides", Whole([3.0, 32.0]), "sides of a cross-section"),
    key("twigs.count", Whole([1.0, 100.0]), "twigs on the longest branch"),
    key("twigs.length", LENGTH, "length by the branch's, and its variation"),
    key("twigs.down_angle", ANGLE, "as branches.down_angle, from the branch's axis"),
    key("twigs.rotate", TURN, "as branches.rotate, about the branch"),
    optional("twigs.curve", BEND, "as branches.curve"),
    optional("twigs.curve_back", BEND, "as branches.curve_back"),
    key("twigs.curve_variation", BEND, "random bend, degrees"),
    optional("twigs.droop", BEND, "as branches.droop"),
    optional("twigs.bare", PART, "part of a twig, from its base, without leaves"),
    key("twigs.segments", Whole([1.0, 32.0]), "straight pieces"),
    key("twigs.taper", UNIT, "0 a cylinder, 1 a cone"),
    key("twigs.sides", Whole([3.0, 32.0]), "sides of a cross-section"),
    key("leaves.count", Whole([1.0, 50.0]), "sprays of leaves on a twig"),
    key("leaves.length", Number([0.02, 5.0]), "length of a spray, m"),
    key("leaves.width", Number([0.05, 5.0]), "width of a spray by its length"),
    key("leaves.down_angle", ANGLE, "degrees from the twig's axis, and their variation"),
    key("leaves.rotate", TURN, "degrees about the twig from one spray to the next"),
    key("leaves.cards", Whole([1.0, 2.0]), "cards of a spray: one, or two crossed"),
    key("leaves.blade", Word(&BLADES), "shape of a leaf"),
    key("leaves.pairs", Whole([1.0, 12.0]), "pairs of leaves, or of shoots with needles, on a spray"),
    optional("leaves.leaflets", Whole([0.0, 12.0]), "pairs of leaflets of a compound leaf; 0: simple leaves"),
    key(
        "leaves.blade_size",
        Pair([0.02, 1.0], [0.002, 0.5]),
        "length of a leaf, and half its width or that of a leaflet, by the spray's card",
    ),
    key("leaves.color", Color, "linear reflectance, red, green, blue"),
    key("leaves.drawing", Whole([0.0, 1e6]), "which random drawing of a spray"),
    key("bark.relief", Word(&RELIEFS), "kind of bark"),
    key("bark.dark", Color, "linear reflectance of its depths"),
    key("bark.light", Color, "linear reflectance of its heights"),
    optional("bark.spots", Color, "linear reflectance of lenticels and patches over it"),
    key("bark.repeat", Number([0.05, 20.0]), "height of one repeat of the texture, m"),
];

/// Tables of a species file; only `leaves` may be left out, by trees that have none.
const TABLES: [&str; 5] = ["trunk", "branches", "twigs", "leaves", "bark"];

impl Key {
    /// What it takes, in words.
    pub fn takes(&self) -> String {
        let range = |[low, high]: Range| format!("{low} to {high}");
        match self.takes {
            Number(r) => range(r),
            Whole(r) => format!("whole, {}", range(r)),
            Pair(first, second) => format!("[{}, {}]", range(first), range(second)),
            Color => "[0 to 1, 0 to 1, 0 to 1]".into(),
            Word(words) => words.join(", "),
        }
    }

    fn check(&self, item: &Item) -> Result<()> {
        match self.takes {
            Number([low, high]) => item.number(low..=high, "").map(drop),
            Whole([low, high]) => {
                item.whole()?;
                item.number(low..=high, "").map(drop)
            }
            Pair(first, second) => {
                item.numbers::<2>(f64::MIN..=f64::MAX, "")?;
                let entries = item.array("an array of 2 numbers")?;
                let ranges = [first, second];
                entries.iter().zip(ranges).try_for_each(|(e, [low, high])| e.number(low..=high, "").map(drop))
            }
            Color => item.numbers::<3>(0.0..=1.0, "").map(drop),
            Word(words) if words.contains(&item.text()?) => Ok(()),
            Word(words) => {
                let remedy = match nearest(item.text()?, words.iter().copied()) {
                    Some(near) => format!("did you mean \"{near}\"? There are {}", words.join(", ")),
                    None => format!("there are {}", words.join(", ")),
                };
                Err(item.error(format!("there is no {} \"{}\"", item.name(), item.text()?), &remedy))
            }
        }
    }
}

/// The own name of a key in a table, or at the top without one.
fn own(key: &Key, table: Option<&str>) -> Option<&'static str> {
    match (key.name.split_once('.'), table) {
        (None, None) => Some(key.name),
        (Some((of, name)), Some(table)) if of == table => Some(name),
        _ => None,
    }
}

fn names(table: Option<&str>) -> Vec<&'static str> {
    KEYS.iter().filter_map(|k| own(k, table)).collect()
}

/// Checks the keys of one table; if `whole`, those that are needed must be there.
fn check_table(table: &Table, name: Option<&str>, whole: bool) -> Result<()> {
    for key in KEYS {
        let Some(own) = own(key, name) else { continue };
        match table.get(own) {
            Some(item) => key.check(&item)?,
            None if whole && key.needed => drop(table.require(own)?),
            None => {}
        }
    }
    Ok(())
}

/// Checks every key of a text and, if it is a `whole` species, that none is missing; then asks `rest` whether they go
/// together: it names a key, what is wrong with it, and a remedy.
pub(super) fn check(
    source: &Source,
    whole: bool,
    rest: impl FnOnce() -> std::result::Result<(), Fault>,
) -> Result<()> {
    let document = DeTable::parse(source.text).map_err(|e| source.syntax(&e))?;
    let known = [names(None), TABLES.to_vec()].concat();
    let root = Table::root(source, document.get_ref(), &known)?;
    check_table(&root, None, whole)?;
    for name in TABLES {
        match root.get(name) {
            Some(item) => check_table(&item.table(&names(Some(name)))?, Some(name), whole)?,
            None if whole && name != "leaves" => drop(root.require(name)?),
            None => {}
        }
    }
    let Err(fault) = rest() else { return Ok(()) };
    let (table, own) = match fault.key.split_once('.') {
        Some((table, own)) => (root.require(table)?.table(&names(Some(table)))?, own),
        None => (root, fault.key),
    };
    Err(match table.get(own) {
        Some(item) => item.error(fault.what, &fault.remedy),
        None => table.error(fault.what, &fault.remedy),
    })
}

/// What is wrong with numbers that are each in their range.
pub(super) struct Fault {
    /// The key to blame.
    pub key: &'static str,
    /// What is wrong.
    pub what: String,
    /// What to do about it.
    pub remedy: String,
}
