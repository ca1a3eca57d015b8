//! What a saved state must have in common with what it is restored into.

use hysteresis_core::{Bound, is_admissible};

use crate::linear::Error;

/// Checks a number of the configuration against a saved one, or names it.
pub(crate) fn check_same(parameter: &'static str, own: f64, got: f64) -> Result<(), Error> {
    let expected = "the same as here";
    if own == got { Ok(()) } else { Err(Error::domain(parameter, None, expected, got)) }
}

/// Checks a count of the configuration against a saved one, or names it.
pub(crate) fn check_same_count(parameter: &'static str, own: usize, got: usize) -> Result<(), Error> {
    if own == got { Ok(()) } else { Err(Error::whole(parameter, None, "the same as here", got)) }
}

/// Checks the fingerprint of parameters against a saved one.
pub(crate) fn check_model(own: u64, got: u64) -> Result<(), Error> {
    let (parameter, expected) = ("state.model", Bound::Words("the fingerprint of the parameters here"));
    if own == got { Ok(()) } else { Err(Error::Whole { parameter, index: None, expected, got }) }
}

/// Checks as many admissible numbers, or names the one that is none.
pub(crate) fn check_numbers(parameter: &'static str, expected: usize, got: &[f64]) -> Result<(), Error> {
    if got.len() != expected {
        return Err(Error::whole(parameter, None, "as many numbers as here", got.len()));
    }
    match got.iter().position(|x| !is_admissible(*x)) {
        None => Ok(()),
        Some(index) => {
            let expected = "a finite number (at most 1e100 in magnitude)";
            Err(Error::domain(parameter, Some(index), expected, got[index]))
        }
    }
}
