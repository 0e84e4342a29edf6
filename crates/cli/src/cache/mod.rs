//! A cache on disk for walls that took long to compute and centre lines extracted from them, so that the next run
//! with the same wall starts at once.
//!
//! The key is a hash of all inputs, so nothing needs to be invalidated when a file or an option changes. A fault of
//! the cache costs time and nothing else.

mod entry;
mod place;
mod room;

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use std::{io, io::Write};

use endowire_core::Result;
use endowire_core::file::whole::Part;
use endowire_core::vessel::{CentrelineRecipe, CentrelineTree, Wall, WallRecipe, WallStore};
use endowire_recording::seal;

use crate::args::CacheArgs;
use crate::output::tell;
use entry::{EXTENSION, Kept, Key, Recipe};

/// Shortest computation that is worth caching: reading back a faster one would save little.
const LEAST: Duration = Duration::from_millis(5);

/// Walls and centre lines in a folder; without a folder, nothing is cached.
pub(crate) struct Cache {
    folder: Option<PathBuf>,
    /// Whether the user was reported that the folder cannot be written.
    reported: AtomicBool,
}

impl Cache {
    /// The user's cache, unless the command line disables it.
    pub(crate) fn new(args: &CacheArgs) -> Self {
        let folder = if args.no_cache { None } else { place::folder() };
        Self { folder, reported: AtomicBool::new(false) }
    }

    /// Folder of the cache, if there is one.
    pub(crate) fn folder(&self) -> Option<&Path> {
        self.folder.as_deref()
    }

    /// The result of a recipe, from the cache or computed.
    fn kept_or<T: Kept>(&self, recipe: &Recipe<'_>, make: impl FnOnce() -> Result<T>) -> Result<T> {
        let Some((folder, key)) = self.folder.as_deref().zip(entry::key(recipe)) else { return make() };
        let path = path(folder, &key);
        if let Some(kept) = entry::read(&path, &key) {
            room::touch(&path);
            return Ok(kept);
        }
        let began = Instant::now();
        let made = make()?;
        if began.elapsed() >= LEAST {
            self.keep(folder, &key, &made);
        }
        Ok(made)
    }

    fn keep(&self, folder: &Path, key: &Key, made: &impl Kept) {
        if let Err(error) = write(folder, key, made)
            && !self.reported.swap(true, Ordering::Relaxed)
        {
            tell(format_args!(
                "endowire: the wall is not kept for the next run: {}: {error} (set ENDOWIRE_CACHE to a folder that can be \
                 written, or give --no-cache)",
                folder.display()
            ));
        }
    }
}

impl WallStore for Cache {
    fn wall(&self, recipe: &WallRecipe<'_>) -> Result<Wall> {
        self.kept_or(&Recipe::Wall(recipe), || recipe.make())
    }

    fn centreline(&self, recipe: &CentrelineRecipe<'_>) -> Result<CentrelineTree> {
        self.kept_or(&Recipe::Centreline(recipe), || recipe.make())
    }
}

fn path(folder: &Path, key: &Key) -> PathBuf {
    folder.join(seal::hex(key)).with_extension(EXTENSION)
}

/// Writes a file under a temporary name and renames it, so that concurrent readers and writers see only complete
/// files.
fn write(folder: &Path, key: &Key, made: &impl Kept) -> io::Result<()> {
    let bytes = entry::bytes(key, made).map_err(io::Error::other)?;
    std::fs::create_dir_all(folder)?;
    room::make(folder, bytes.len() as u64)?;
    // A wall that is lost when the power fails is made again.
    let mut part = Part::new(&path(folder, key))?;
    part.file().write_all(&bytes)?;
    part.finish()
}

#[cfg(test)]
mod tests;
