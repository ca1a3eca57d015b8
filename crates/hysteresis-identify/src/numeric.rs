//! Numbers from counts.

/// A count as a number; exact up to 2^53.
#[expect(clippy::cast_precision_loss, reason = "no record has 2^53 samples")]
pub(crate) fn as_f64(count: usize) -> f64 {
    count as f64
}
