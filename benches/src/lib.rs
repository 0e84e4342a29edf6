//! Shared helpers of the benches.

use std::path::{Path, PathBuf};

use endowire_core::{Error, Result};

/// The scenes of `benches/hard`, in the order of their names.
///
/// # Errors
/// A folder that cannot be read.
pub fn hard_scenes() -> Result<Vec<PathBuf>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("hard");
    let entries = std::fs::read_dir(&folder).map_err(|error| Error::file(&folder, error))?;
    let mut paths: Vec<PathBuf> = entries.filter_map(|entry| entry.ok().map(|entry| entry.path())).collect();
    paths.retain(|path| path.extension().is_some_and(|ending| ending == "toml"));
    paths.sort();
    Ok(paths)
}
