//! Bytes with a hash at their end, which tells whether they are whole and as they were written; and hashes as text.

use sha2::{Digest, Sha256};

/// Bytes of a hash.
pub const BYTES: usize = 32;

/// Bytes and their hash.
pub fn sealed(mut bytes: Vec<u8>) -> Vec<u8> {
    let hash = Sha256::digest(&bytes);
    bytes.extend(hash);
    bytes
}

/// The bytes before the hash, if it is theirs.
pub fn opened(bytes: &[u8]) -> Option<&[u8]> {
    let (body, hash) = bytes.split_last_chunk::<BYTES>()?;
    (Sha256::digest(body).as_slice() == hash).then_some(body)
}

/// Bytes as hexadecimal digits.
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}
