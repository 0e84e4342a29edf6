//! Provenance of results.

use sha2::{Digest, Sha256};

/// The program that computes the results.
#[derive(Debug, Clone, Copy)]
pub struct Program {
    /// Its version.
    pub version: &'static str,
    /// Git revision of its source.
    pub git_revision: &'static str,
}

/// SHA-256 of file contents, in order, as hexadecimal digits.
pub fn hash_inputs(inputs: &[impl AsRef<[u8]>]) -> String {
    let mut hash = Sha256::new();
    for input in inputs.iter().map(AsRef::as_ref) {
        // The lengths ensure that different splits of the same bytes have different hashes.
        hash.update((input.len() as u64).to_le_bytes());
        hash.update(input);
    }
    hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}
