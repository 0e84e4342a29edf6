//! Where results come from.

use sha2::{Digest, Sha256};

/// The program that computes.
#[derive(Debug, Clone, Copy)]
pub struct Program {
    /// Its version.
    pub version: &'static str,
    /// The revision of its source.
    pub git_revision: &'static str,
}

/// SHA-256 of file contents, in order, as hexadecimal digits.
pub fn hash_inputs(inputs: &[impl AsRef<[u8]>]) -> String {
    let mut hash = Sha256::new();
    for input in inputs.iter().map(AsRef::as_ref) {
        // Lengths keep two inputs from hashing like their concatenation cut elsewhere.
        hash.update((input.len() as u64).to_le_bytes());
        hash.update(input);
    }
    hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}
