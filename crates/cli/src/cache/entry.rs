//! One wall in a file.
//!
//! A line of text names the format, the key of the wall follows, then the wall in bytes that keep every bit of a number, and a hash of
//! all that at the end.

use std::path::Path;
use std::time::UNIX_EPOCH;

use endowire_core::vessel::{Wall, WallRecipe};
use sha2::{Digest, Sha256};

use endowire_sweep::seal;

/// The first line.
const FORMAT: &str = "endowire wall 1\n";
/// Largest file that is read, bytes.
const SIZE_LIMIT: u64 = 2 << 30;
/// How files of walls end.
pub(super) const EXTENSION: &str = "wall";
/// How they end until they are whole.
pub(super) const UNFINISHED: &str = ".part";

/// Hash of all that a wall's bits depend on: its recipe and the program.
pub(super) type Key = [u8; 32];

/// The key of a recipe; `None` where the program cannot tell which one it is.
pub(super) fn key(recipe: &WallRecipe<'_>) -> Option<Key> {
    let mut hash = Sha256::new();
    for part in [FORMAT, env!("CARGO_PKG_VERSION"), env!("ENDOWIRE_GIT_REVISION")] {
        hash.update(part);
        hash.update([0]);
    }
    // Sources at work change without a new version or revision: a program that was built anew makes its walls anew.
    let program = std::env::current_exe().and_then(std::fs::metadata).ok()?;
    let built = program.modified().ok()?.duration_since(UNIX_EPOCH).ok()?;
    hash.update(built.as_nanos().to_le_bytes());
    hash.update(program.len().to_le_bytes());
    hash.update(postcard::to_allocvec(recipe).ok()?);
    Some(hash.finalize().into())
}

/// A file's bytes.
pub(super) fn bytes(key: &Key, wall: &Wall) -> postcard::Result<Vec<u8>> {
    let begun = [FORMAT.as_bytes(), key].concat();
    postcard::to_extend(wall, begun).map(seal::sealed)
}

/// The wall of a file, if it is there, whole, and that of the key.
pub(super) fn read(path: &Path, key: &Key) -> Option<Wall> {
    let bytes = endowire_core::file::read(path, SIZE_LIMIT).ok()?;
    let wall = seal::opened(&bytes)?.strip_prefix(FORMAT.as_bytes())?.strip_prefix(key)?;
    postcard::from_bytes(wall).ok()
}
