//! What makes an object a value.

use std::hash::{DefaultHasher, Hash, Hasher};

/// Equal models have equal hashes: +0 and -0, which are equal, count as one.
pub(crate) fn hash(values: impl Iterator<Item = f64>) -> u64 {
    let mut hasher = DefaultHasher::new();
    values.for_each(|value| (value + 0.0).to_bits().hash(&mut hasher));
    hasher.finish()
}
