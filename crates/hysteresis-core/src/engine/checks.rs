//! Checks of what is restored or exchanged in a running stream.

#[cfg(feature = "alloc")]
use crate::error::Error;

/// How far a saved number may be from the model's: relative to the scale of what was rounded, far above rounding and
/// far below any use; and no less than what the smallest numbers lose.
#[cfg(feature = "alloc")]
pub(super) fn restore_tolerance(scale: f64) -> f64 {
    1e-9 * scale + f64::MIN_POSITIVE
}

/// Checks a number of a new model against that of the running stream, or names it.
#[cfg(feature = "alloc")]
pub(crate) fn check_same(what: &'static str, expected: f64, got: f64) -> Result<(), Error> {
    if expected == got { Ok(()) } else { Err(Error::OtherOperators { what, expected, got }) }
}

#[cfg(feature = "alloc")]
pub(super) fn check_same_count(expected: usize, got: usize) -> Result<(), Error> {
    check_same("number of operators", count_as_f64(expected), count_as_f64(got))
}

/// A count as a number, exact below 2^53.
#[expect(clippy::cast_precision_loss, reason = "a count of things in memory")]
pub(crate) fn count_as_f64(count: usize) -> f64 {
    count as f64
}
