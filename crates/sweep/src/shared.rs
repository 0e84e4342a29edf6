//! Data that several runs share and that are computed once.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

use endowire_core::Result;
use endowire_core::vessel::{CentrelineRecipe, CentrelineTree, Wall, WallRecipe, WallStore};
use sha2::{Digest, Sha256};

/// A cache for several threads; it keeps the most recently used values, by key.
pub(crate) struct Shared<T> {
    /// Most recently used first.
    entries: Mutex<VecDeque<Entry<T>>>,
    most: usize,
}

type Entry<T> = ([u8; 32], Arc<Mutex<Option<T>>>);

impl<T: Clone> Shared<T> {
    /// Creates a cache of at most `most` values.
    pub(crate) fn new(most: usize) -> Self {
        Self { entries: Mutex::new(VecDeque::new()), most }
    }

    /// Returns the value for `key`, computed by `make` if necessary. Threads that want the same value wait meanwhile;
    /// others do not.
    pub(crate) fn get(&self, key: &[u8], make: impl FnOnce() -> Result<T>) -> Result<T> {
        let entry = self.entry(Sha256::digest(key).into());
        // Failures are not cached: a second attempt fails again.
        let mut made = entry.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(made) = &*made {
            return Ok(made.clone());
        }
        let new = make()?;
        *made = Some(new.clone());
        Ok(new)
    }

    fn entry(&self, key: [u8; 32]) -> Arc<Mutex<Option<T>>> {
        let mut entries = self.entries.lock().unwrap_or_else(PoisonError::into_inner);
        let known = entries.iter().position(|(other, _)| *other == key);
        let entry = known.and_then(|index| entries.remove(index)).unwrap_or_else(|| (key, Arc::default()));
        let shared = Arc::clone(&entry.1);
        entries.push_front(entry);
        entries.truncate(self.most);
        shared
    }
}

/// An in-memory cache of walls and centre lines above another store.
pub(crate) struct SharedWalls<'a> {
    below: &'a (dyn WallStore + Sync),
    walls: Shared<Wall>,
    centrelines: Shared<CentrelineTree>,
}

impl<'a> SharedWalls<'a> {
    /// Caches the last `most` values of `below`.
    pub(crate) fn new(below: &'a (dyn WallStore + Sync), most: usize) -> Self {
        Self { below, walls: Shared::new(most), centrelines: Shared::new(most) }
    }
}

impl WallStore for SharedWalls<'_> {
    fn wall(&self, recipe: &WallRecipe<'_>) -> Result<Wall> {
        match postcard::to_extend(recipe, Vec::new()) {
            Ok(key) => self.walls.get(&key, || self.below.wall(recipe)),
            Err(_) => self.below.wall(recipe),
        }
    }

    fn centreline(&self, recipe: &CentrelineRecipe<'_>) -> Result<CentrelineTree> {
        match postcard::to_extend(recipe, Vec::new()) {
            Ok(key) => self.centrelines.get(&key, || self.below.centreline(recipe)),
            Err(_) => self.below.centreline(recipe),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;

    #[test]
    fn what_is_kept_is_not_made_again_and_the_oldest_goes_first() {
        let shared = Shared::new(2);
        let made = Cell::new(0);
        let get = |key: &str| {
            let make = || {
                made.set(made.get() + 1);
                Ok(made.get())
            };
            shared.get(key.as_bytes(), make).unwrap()
        };
        assert_eq!(["a", "b", "a", "c", "a", "b"].map(get), [1, 2, 1, 3, 1, 4]);
        let failed = shared.get(b"d", || Err(endowire_core::Error::Computation("no".into())));
        assert!(failed.is_err());
        assert_eq!(get("d"), 5);
    }
}
