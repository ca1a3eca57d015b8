//! SHA-256 in hexadecimal digits.

use sha2::{Digest, Sha256};

/// Of texts, one behind the other.
pub(crate) fn digest(texts: &[&str]) -> String {
    let mut hash = Sha256::new();
    for text in texts {
        hash.update(text);
    }
    let digits = |byte: &u8| [byte >> 4, byte & 15].map(|digit| char::from_digit(digit.into(), 16).unwrap_or_default());
    hash.finalize().iter().flat_map(digits).collect()
}
