//! Walls that took long to make, and centre lines that were found in them, kept on disk: the next run with the same wall starts at once.
//!
//! Each is found by a hash of all that it was made of, so nothing has to be told when a file or an option changes. Whatever is
//! wrong with the cache costs time and nothing else.

mod entry;
mod place;
mod room;

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use std::{io, io::Write};

use endowire_core::Result;
use endowire_core::vessel::{CentrelineRecipe, CentrelineTree, Wall, WallRecipe, WallStore};

use crate::args::CacheArgs;
use crate::output::tell;
use endowire_sweep::seal;
use entry::{EXTENSION, Kept, Key, Recipe};

/// What takes less to make is not kept: to read it back would save nothing to speak of.
const LEAST: Duration = Duration::from_millis(5);

/// Walls and centre lines in a folder; without one, all are made.
pub(crate) struct Cache {
    folder: Option<PathBuf>,
    /// Whether it was told that the folder cannot be written.
    told: AtomicBool,
}

impl Cache {
    /// The user's, unless the command line asks for none.
    pub(crate) fn new(args: &CacheArgs) -> Self {
        let folder = if args.no_cache { None } else { place::folder() };
        Self { folder, told: AtomicBool::new(false) }
    }

    /// Where walls are kept, if they are.
    pub(crate) fn folder(&self) -> Option<&Path> {
        self.folder.as_deref()
    }

    /// What a recipe makes, kept or made.
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
            && !self.told.swap(true, Ordering::Relaxed)
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

/// Writes a file beside its place and renames it into it: others who read or write the same wall at the same time see a whole one.
fn write(folder: &Path, key: &Key, made: &impl Kept) -> io::Result<()> {
    let bytes = entry::bytes(key, made).map_err(io::Error::other)?;
    std::fs::create_dir_all(folder)?;
    room::make(folder, bytes.len() as u64)?;
    let mut part = tempfile::Builder::new().suffix(entry::UNFINISHED).tempfile_in(folder)?;
    part.write_all(&bytes)?;
    part.persist(path(folder, key))?;
    Ok(())
}

#[cfg(test)]
mod tests;
