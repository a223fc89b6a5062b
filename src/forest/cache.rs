//! Which key holds which slot of a fixed number: least recently used goes first, what this frame uses never.

use std::collections::HashMap;
use std::hash::Hash;

/// Slots by key.
#[derive(Clone, Debug)]
pub struct SlotCache<K> {
    slots: Vec<Option<K>>,
    used: Vec<u64>,
    index: HashMap<K, u32>,
    frame: u64,
    evicted: u64,
}

/// What asking for a key gave.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Slot {
    /// Index of the slot.
    pub index: u32,
    /// It does not hold the key's content yet: produce it.
    pub fresh: bool,
}

impl<K: Copy + Eq + Hash> SlotCache<K> {
    /// A cache of `slots` empty slots.
    pub fn new(slots: u32) -> Self {
        SlotCache {
            slots: vec![None; slots as usize],
            used: vec![0; slots as usize],
            index: HashMap::new(),
            frame: 0,
            evicted: 0,
        }
    }

    /// Begins a frame: from now on, slots asked for are safe until the next.
    pub fn begin_frame(&mut self) {
        self.frame += 1;
    }

    /// The slot of a key; `None` when every slot is in use by this frame.
    pub fn slot(&mut self, key: K) -> Option<Slot> {
        if let Some(&index) = self.index.get(&key) {
            self.used[index as usize] = self.frame;
            return Some(Slot { index, fresh: false });
        }
        // The first of the least recently used: the same sequence of keys gives the same slots.
        let (index, &used) = self.used.iter().enumerate().min_by_key(|(_, used)| **used)?;
        if used == self.frame {
            return None;
        }
        if let Some(old) = self.slots[index].replace(key) {
            self.index.remove(&old);
            self.evicted += 1;
        }
        self.used[index] = self.frame;
        self.index.insert(key, index as u32);
        Some(Slot { index: index as u32, fresh: true })
    }

    /// The slot of a key that this frame uses, without asking for it.
    pub fn find(&self, key: &K) -> Option<u32> {
        self.index.get(key).copied().filter(|k| self.used[*k as usize] == self.frame)
    }

    /// Number of slots.
    pub fn capacity(&self) -> u32 {
        self.slots.len() as u32
    }

    /// Contents thrown out so far.
    pub fn evicted(&self) -> u64 {
        self.evicted
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_least_recently_used_goes_first_and_this_frame_stays() {
        let mut c = SlotCache::new(2);
        c.begin_frame();
        assert_eq!(c.slot('a'), Some(Slot { index: 0, fresh: true }));
        assert_eq!(c.slot('b'), Some(Slot { index: 1, fresh: true }));
        assert_eq!(c.slot('c'), None);
        c.begin_frame();
        assert_eq!(c.slot('b'), Some(Slot { index: 1, fresh: false }));
        assert_eq!(c.slot('c'), Some(Slot { index: 0, fresh: true }));
        assert_eq!((c.find(&'a'), c.find(&'b'), c.evicted()), (None, Some(1), 1));
    }
}
