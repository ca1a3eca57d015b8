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

/// Checks as many admissible numbers, or names the one that is none.
pub(crate) fn check_numbers(parameter: &'static str, expected: usize, got: &[f64]) -> Result<(), Error> {
    #[expect(clippy::cast_precision_loss, reason = "only shown")]
    if got.len() != expected {
        let expected = "as many numbers as here";
        return Err(Error::domain(parameter, None, expected, got.len() as f64));
    }
    match got.iter().position(|x| !is_admissible(*x)) {
        None => Ok(()),
        Some(index) => {
            let expected = "a finite number (at most 1e100 in magnitude)";
            Err(Error::domain(parameter, Some(index), expected, got[index]))
        }
    }
}
