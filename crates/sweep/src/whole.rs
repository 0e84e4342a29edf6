//! Files that are there whole or not at all: written beside their place, then renamed into it.

use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// What a file is called until it is whole.
pub fn unfinished(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".part");
    name.into()
}

/// Writes a file with `write`, which gets the path to write to; its failure leaves nothing.
///
/// # Errors
/// What `write` says, and a file that cannot be put into its place.
pub fn write(path: &Path, write: impl FnOnce(&Path) -> io::Result<()>) -> io::Result<()> {
    let part = unfinished(path);
    let written = write(&part).and_then(|()| std::fs::rename(&part, path));
    if written.is_err() {
        let _ = std::fs::remove_file(&part);
    }
    written
}

/// Removes a file, if it is there.
///
/// # Errors
/// One that cannot be removed.
pub fn remove(path: &Path) -> io::Result<()> {
    match std::fs::remove_file(path) {
        // The second is what a path through something that is no folder gives.
        Err(e) if matches!(e.kind(), io::ErrorKind::NotFound | io::ErrorKind::NotADirectory) => Ok(()),
        other => other,
    }
}

/// Writes bytes, and waits for the disk before they take the place of what was there.
///
/// # Errors
/// As [`write()`].
pub fn write_bytes(path: &Path, bytes: &[u8]) -> io::Result<()> {
    write(path, |part| {
        let mut file = File::create(part)?;
        file.write_all(bytes)?;
        file.sync_all()
    })
}
