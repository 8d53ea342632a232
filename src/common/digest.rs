//! SHA-256 of bytes.

use sha2::{Digest, Sha256};

use crate::text::hex;

/// SHA-256 of bytes, in lower-case hexadecimal.
pub fn sha256_hex(bytes: impl AsRef<[u8]>) -> String {
    hex(&Sha256::digest(bytes))
}
