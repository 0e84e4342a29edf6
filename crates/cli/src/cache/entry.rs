//! Files of the cache, each with one wall or one centre line.
//!
//! The first line names the format, the key follows, then the content in a binary format that keeps every bit of a
//! number, and a hash of all this at the end.

use std::path::Path;
use std::time::UNIX_EPOCH;

use endowire_core::vessel::{CentrelineRecipe, CentrelineTree, Wall, WallRecipe};
use endowire_recording::seal;
use serde::Serialize;
use sha2::{Digest, Sha256};

/// The first line.
const FORMAT: &str = "endowire wall 1\n";
/// Largest file that is read, bytes.
const SIZE_LIMIT: u64 = 2 << 30;
/// Extension of complete files.
pub(super) const EXTENSION: &str = "wall";
/// Extension of unfinished files.
pub(super) const UNFINISHED: &str = ".part";

/// Hash of everything that the content depends on to the bit: its recipe and the program.
pub(super) type Key = [u8; 32];

/// Content that can be stored as bytes.
pub(super) trait Kept: Sized {
    /// Appends it to bytes.
    fn extend(&self, begun: Vec<u8>) -> postcard::Result<Vec<u8>>;

    /// Decodes it; `None` if the bytes are invalid.
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

/// A centre line is stored as its table, which keeps every bit of a number too.
impl Kept for CentrelineTree {
    fn extend(&self, mut begun: Vec<u8>) -> postcard::Result<Vec<u8>> {
        begun.extend(self.table("").into_bytes());
        Ok(begun)
    }

    fn of_bytes(bytes: &[u8]) -> Option<Self> {
        Self::from_bytes(bytes, Path::new("")).ok()
    }
}

/// The inputs from which a content is computed.
#[derive(Serialize)]
pub(super) enum Recipe<'a> {
    Wall(&'a WallRecipe<'a>),
    Centreline(&'a CentrelineRecipe<'a>),
}

/// The key of a recipe; `None` if the program cannot identify itself.
pub(super) fn key(recipe: &Recipe<'_>) -> Option<Key> {
    let mut hash = Sha256::new();
    for part in [FORMAT, env!("CARGO_PKG_VERSION"), env!("ENDOWIRE_GIT_REVISION")] {
        hash.update(part);
        hash.update([0]);
    }
    // During development, sources change without a new version or revision, so the key contains the time of the
    // build.
    let program = std::env::current_exe().and_then(std::fs::metadata).ok()?;
    let built = program.modified().ok()?.duration_since(UNIX_EPOCH).ok()?;
    hash.update(built.as_nanos().to_le_bytes());
    hash.update(program.len().to_le_bytes());
    hash.update(postcard::to_allocvec(recipe).ok()?);
    Some(hash.finalize().into())
}

/// The bytes of a file.
pub(super) fn bytes(key: &Key, kept: &impl Kept) -> postcard::Result<Vec<u8>> {
    kept.extend([FORMAT.as_bytes(), key].concat()).map(seal::sealed)
}

/// The content of a file, if it exists, is complete, and has this key.
pub(super) fn read<T: Kept>(path: &Path, key: &Key) -> Option<T> {
    let bytes = endowire_core::file::read(path, SIZE_LIMIT).ok()?;
    T::of_bytes(seal::opened(&bytes)?.strip_prefix(FORMAT.as_bytes())?.strip_prefix(key)?)
}
