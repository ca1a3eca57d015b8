//! What a saved state must have in common with what it is restored into.

use hysteresis_core::is_admissible;

use crate::linear::Error;

/// Checks a number of the configuration against a saved one, or names it.
pub(crate) fn check_same(parameter: &'static str, own: f64, got: f64) -> Result<(), Error> {
    let expected = "the same as here";
    if own == got { Ok(()) } else { Err(Error::domain(parameter, None, expected, got)) }
}

/// Checks the fingerprint of parameters against a saved one. One of 53 bits is a number exactly.
#[expect(clippy::cast_precision_loss, reason = "53 bits")]
pub(crate) fn check_model(own: u64, got: u64) -> Result<(), Error> {
    let expected = "the fingerprint of the parameters here";
    if own == got { Ok(()) } else { Err(Error::domain("state.model", None, expected, got as f64)) }
}

/// What products and sums of admissible numbers may come to in what a filter remembers.
const LARGEST_TERM: f64 = 1e250;

/// Checks as many admissible numbers, or names the one that is none.
pub(crate) fn check_numbers(parameter: &'static str, expected: usize, got: &[f64]) -> Result<(), Error> {
    check_all(parameter, (expected, got), is_admissible, "a finite number (at most 1e100 in magnitude)")
}

/// Checks as many numbers that a filter may have made of admissible ones, or names the one that cannot be.
pub(crate) fn check_terms(parameter: &'static str, expected: usize, got: &[f64]) -> Result<(), Error> {
    let may_be = |x: f64| x.abs() <= LARGEST_TERM;
    check_all(parameter, (expected, got), may_be, "a finite number (at most 1e250 in magnitude)")
}

fn check_all(
    parameter: &'static str,
    (count, got): (usize, &[f64]),
    may_be: impl Fn(f64) -> bool,
    expected: &'static str,
) -> Result<(), Error> {
    #[expect(clippy::cast_precision_loss, reason = "only shown")]
    if got.len() != count {
        let expected = "as many numbers as here";
        return Err(Error::domain(parameter, None, expected, got.len() as f64));
    }
    match got.iter().position(|x| !may_be(*x)) {
        None => Ok(()),
        Some(index) => Err(Error::domain(parameter, Some(index), expected, got[index])),
    }
}
