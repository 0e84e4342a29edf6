//! One wall, or one centre line, in a file.
//!
//! A line of text names the format, the key follows, then what is kept in bytes that keep every bit of a number, and a hash of all that at
//! the end.

use std::path::Path;
use std::time::UNIX_EPOCH;

use endowire_core::vessel::{CentrelineRecipe, CentrelineTree, Wall, WallRecipe};
use serde::Serialize;
use sha2::{Digest, Sha256};

use endowire_sweep::seal;

/// The first line.
const FORMAT: &str = "endowire wall 1\n";
/// Largest file that is read, bytes.
const SIZE_LIMIT: u64 = 2 << 30;
/// How files of what is kept end.
pub(super) const EXTENSION: &str = "wall";
/// How they end until they are whole.
pub(super) const UNFINISHED: &str = ".part";

/// Hash of all that the bits of what is kept depend on: its recipe and the program.
pub(super) type Key = [u8; 32];

/// What is kept, as bytes.
pub(super) trait Kept: Sized {
    /// Puts it behind bytes.
    fn extend(&self, begun: Vec<u8>) -> postcard::Result<Vec<u8>>;

    /// It from these bytes, if they are its.
    fn of_bytes(bytes: &[u8]) -> Option<Self>;
}

impl Kept for Wall {
    fn extend(&self, begun: Vec<u8>) -> postcard::Result<Vec<u8>> {
        postcard::to_extend(self, begun)
    }

    fn of_bytes(bytes: &[u8]) -> Option<Self> {
        postcard::from_bytes(bytes).ok()
    }
}

/// Its table, which keeps every bit of a number too.
impl Kept for CentrelineTree {
    fn extend(&self, mut begun: Vec<u8>) -> postcard::Result<Vec<u8>> {
        begun.extend(self.table("").into_bytes());
        Ok(begun)
    }

    fn of_bytes(bytes: &[u8]) -> Option<Self> {
        Self::from_bytes(bytes, Path::new("")).ok()
    }
}

/// What something is made of.
#[derive(Serialize)]
pub(super) enum Recipe<'a> {
    Wall(&'a WallRecipe<'a>),
    Centreline(&'a CentrelineRecipe<'a>),
}

/// The key of a recipe; `None` where the program cannot tell which one it is.
pub(super) fn key(recipe: &Recipe<'_>) -> Option<Key> {
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
pub(super) fn bytes(key: &Key, kept: &impl Kept) -> postcard::Result<Vec<u8>> {
    kept.extend([FORMAT.as_bytes(), key].concat()).map(seal::sealed)
}

/// What a file holds, if it is there, whole, and that of the key.
pub(super) fn read<T: Kept>(path: &Path, key: &Key) -> Option<T> {
    let bytes = endowire_core::file::read(path, SIZE_LIMIT).ok()?;
    T::of_bytes(seal::opened(&bytes)?.strip_prefix(FORMAT.as_bytes())?.strip_prefix(key)?)
}
