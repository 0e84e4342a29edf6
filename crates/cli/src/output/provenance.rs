//! Where a result comes from: carried by every JSON document.

use std::path::Path;

use serde::Serialize;
use sha2::{Digest, Sha256};

use super::seal;
use crate::failure::Failure;

/// Version, revision, input and seed of a result.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Provenance {
    version: &'static str,
    git_revision: &'static str,
    /// SHA-256 of the scene's text and of the files it names; of nothing where there is no scene.
    scene_hash: String,
    seed: u64,
}

impl Provenance {
    /// For a result of `inputs`: file contents, in order.
    pub(crate) fn new(inputs: &[impl AsRef<[u8]>], seed: u64) -> Self {
        let mut hash = Sha256::new();
        for input in inputs.iter().map(AsRef::as_ref) {
            // Lengths keep two inputs from hashing like their concatenation cut elsewhere.
            hash.update((input.len() as u64).to_le_bytes());
            hash.update(input);
        }
        let scene_hash = seal::hex(&hash.finalize());
        Self {
            version: env!("CARGO_PKG_VERSION"),
            git_revision: env!("ENDOWIRE_GIT_REVISION"),
            scene_hash,
            seed,
        }
    }

    /// SHA-256 of the inputs.
    pub(crate) fn scene_hash(&self) -> &str {
        &self.scene_hash
    }

    /// For a result that depends on the program and its arguments alone.
    pub(crate) fn of_program(arguments: &str) -> Self {
        Self::new(&[arguments.as_bytes()], 0)
    }
}

/// Reads an input file whole, for its hash.
pub(crate) fn read_input(path: &Path) -> Result<Vec<u8>, Failure> {
    Ok(endowire_core::file::read(path, u64::MAX)?)
}
