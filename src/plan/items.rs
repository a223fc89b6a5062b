//! What a plan lists, and how what is allocated finds its description there.

use serde::ser::SerializeStruct;

use super::Plan;
use super::names::resource;
use crate::gpu::{BufferDesc, Description, ImageDesc, VolumeDesc};
use crate::scene::Scene;
use crate::{Error, Result};

/// One thing that the scene requires.
#[derive(Clone, Debug, PartialEq)]
pub struct Item {
    /// `data`, `cache`, `target`, `pipeline` or `pass`.
    pub kind: &'static str,
    /// Name in reports.
    pub name: String,
    /// What needs it.
    pub reason: String,
    /// What is allocated for it.
    pub allocations: Vec<Description>,
    /// How many items have even shares of these: where species' data lie in one array, each species has an item.
    pub shares: u32,
}

impl Item {
    /// Device memory, bytes.
    pub fn bytes(&self) -> u64 {
        self.allocations.iter().map(Description::bytes).sum::<u64>() / u64::from(self.shares.max(1))
    }
}

impl serde::Serialize for Item {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> std::result::Result<S::Ok, S::Error> {
        let mut item = serializer.serialize_struct("Item", 4)?;
        item.serialize_field("kind", self.kind)?;
        item.serialize_field("name", &self.name)?;
        item.serialize_field("reason", &self.reason)?;
        item.serialize_field("bytes", &self.bytes())?;
        item.end()
    }
}

/// A plan's items while they are written down.
#[derive(Default)]
pub(super) struct Items(Vec<Item>);

impl Items {
    /// Writes down what takes no memory of its own.
    pub fn step(&mut self, kind: &'static str, name: &str, reason: impl Into<String>) {
        self.shared(kind, name, reason, Vec::new(), 1);
    }

    /// Writes down what takes memory of its own.
    pub fn add(
        &mut self,
        kind: &'static str,
        name: &str,
        reason: impl Into<String>,
        allocations: impl IntoIterator<Item = impl Into<Description>>,
    ) {
        self.shared(kind, name, reason, allocations.into_iter().map(Into::into).collect(), 1);
    }

    /// Writes down one of the items that share memory evenly.
    pub fn shared(
        &mut self,
        kind: &'static str,
        name: &str,
        reason: impl Into<String>,
        allocations: Vec<Description>,
        shares: u32,
    ) {
        self.0.push(Item { kind, name: name.into(), reason: reason.into(), allocations, shares });
    }
}

impl Plan {
    /// Lists anew what its numbers ask for: for whoever changed one of them after the plan was made.
    pub fn list(&mut self, scene: &Scene) {
        self.items = self.listed(scene);
    }

    /// Every item that its numbers ask for.
    fn listed(&self, scene: &Scene) -> Vec<Item> {
        let mut items = Items::default();
        self.list_ground(scene, &mut items);
        if self.draws_views() {
            self.list_views(scene, &mut items);
        }
        if self.meshes {
            self.list_meshes(scene, &mut items);
        }
        if self.cards {
            self.list_cards(scene, &mut items);
        }
        if self.shells {
            self.list_shells(scene, &mut items);
        }
        if self.harmonics() {
            self.list_forest_sky(&mut items);
        }
        if self.wind {
            self.list_wind(scene, &mut items);
        }
        if self.forest {
            self.list_tables(scene, &mut items);
            self.list_indirect(scene, &mut items);
            self.list_distribution(scene, &mut items);
        }
        if self.near_trees {
            self.list_seeds(&mut items);
        }
        if self.forest {
            self.list_forest(scene, &mut items);
        }
        self.list_targets(scene, &mut items);
        self.list_pipelines(scene, &mut items);
        self.list_passes(scene, &mut items);
        items.0
    }

    /// Refuses a plan whose items are not those that its numbers ask for: what is allocated would not fit what is drawn.
    ///
    /// # Errors
    /// [`Error::Usage`] names the first item that differs.
    pub fn check_items(&self, scene: &Scene) -> Result<()> {
        let wanted = self.listed(scene);
        let same = |a: &Item, b: &Item| {
            (a.kind, &a.name, &a.allocations, a.shares) == (b.kind, &b.name, &b.allocations, b.shares)
        };
        let differs = (0..wanted.len().max(self.items.len())).find(
            |k| !matches!((self.items.get(*k), wanted.get(*k)), (Some(has), Some(wants)) if same(has, wants)),
        );
        let Some(k) = differs else { return Ok(()) };
        let told = |items: &[Item]| {
            items
                .get(k)
                .map_or("nothing".into(), |i| format!("{} \"{}\", {} bytes", i.kind, i.name, i.bytes()))
        };
        Err(Error::Usage(format!(
            "the plan lists {} where its numbers ask for {}: list it anew after a change",
            told(&self.items),
            told(&wanted)
        )))
    }

    /// Device memory of the whole plan, bytes.
    pub fn bytes(&self) -> u64 {
        self.items.iter().map(Item::bytes).sum()
    }

    /// Everything of a name that is allocated. Items that share an allocation all have it: it counts once.
    fn described<'a>(&'a self, name: &'a str) -> impl Iterator<Item = &'a Description> {
        let has = move |i: &&Item| i.allocations.iter().any(|d| d.name() == name);
        let first = self.items.iter().find(has);
        first.into_iter().flat_map(|i| &i.allocations).filter(move |d| d.name() == name)
    }

    /// The images of a name, if the plan lists any.
    pub fn images<'a>(&'a self, name: &'a str) -> impl Iterator<Item = &'a ImageDesc<'static>> {
        self.described(name).filter_map(|d| match d {
            Description::Image(d) => Some(d),
            _ => None,
        })
    }

    /// The volume of a name, if the plan lists it.
    pub fn volume(&self, name: &str) -> Option<VolumeDesc> {
        self.described(name).find_map(|d| match d {
            Description::Volume(d) => Some(*d),
            _ => None,
        })
    }

    /// Pair tables, if the sun's average light has a share, and view tables.
    ///
    /// # Errors
    /// [`Error::Usage`] for a plan without trees.
    pub fn tables(&self) -> Result<(Option<VolumeDesc>, &ImageDesc<'static>)> {
        let views = self.images(resource::VIEW_TABLES).next();
        let views = views.ok_or_else(|| Error::Usage("the plan lists no tables: it has no trees".into()))?;
        Ok((self.volume(resource::PAIR_TABLES), views))
    }

    /// The buffer of a name; one without content if the plan lists none.
    pub fn buffer(&self, name: &'static str) -> BufferDesc {
        let listed = self.described(name).find_map(|d| match d {
            Description::Buffer(d) => Some(*d),
            _ => None,
        });
        listed.unwrap_or(BufferDesc::new(name, 0))
    }
}
