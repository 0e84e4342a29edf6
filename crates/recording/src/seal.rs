//! Bytes followed by their hash, which reveals truncation and corruption; and hashes as text.

use sha2::{Digest, Sha256};

/// Length of a hash in bytes.
pub const BYTES: usize = 32;

/// Appends the hash to bytes.
pub fn sealed(mut bytes: Vec<u8>) -> Vec<u8> {
    let hash = Sha256::digest(&bytes);
    bytes.extend(hash);
    bytes
}

/// The bytes without their hash; `None` if the hash does not match.
pub fn opened(bytes: &[u8]) -> Option<&[u8]> {
    let (body, hash) = bytes.split_last_chunk::<BYTES>()?;
    (Sha256::digest(body).as_slice() == hash).then_some(body)
}

/// Bytes as hexadecimal digits.
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}
