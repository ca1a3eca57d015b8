//! Numbers that no parameter can have, and what a saved state must have in common with what it is restored into.

use hysteresis_core::{Error, MAX_MAGNITUDE, is_admissible};

/// The number, if it is finite and above zero by more than the reciprocal of the largest admissible magnitude.
pub(crate) fn check_positive(parameter: &'static str, index: Option<usize>, got: f64) -> Result<f64, Error> {
    if got.abs() <= MAX_MAGNITUDE && got >= 1.0 / MAX_MAGNITUDE {
        Ok(got)
    } else {
        Err(Error::domain(parameter, index, "a finite number above 0 (1e-100 to 1e100)", got))
    }
}

/// Checks what a number must be, or names it.
pub(crate) fn check_number(
    parameter: &'static str,
    holds: bool,
    expected: &'static str,
    got: f64,
) -> Result<(), Error> {
    if holds { Ok(()) } else { Err(Error::domain(parameter, None, expected, got)) }
}

/// Checks what a whole number must be, or names it.
pub(crate) fn check_whole(
    parameter: &'static str,
    holds: bool,
    expected: &'static str,
    got: usize,
) -> Result<(), Error> {
    if holds { Ok(()) } else { Err(Error::whole(parameter, None, expected, got)) }
}

/// The number of seconds, if it can be a dead time.
pub(crate) fn check_dead_time(got: f64) -> Result<f64, Error> {
    let holds = (0.0..=MAX_MAGNITUDE).contains(&got);
    check_number("dead_time", holds, "a finite number of seconds, 0 or more", got).map(|()| got)
}

/// Checks a number of the configuration against a saved one, or names it.
pub(crate) fn check_same(parameter: &'static str, own: f64, got: f64) -> Result<(), Error> {
    check_number(parameter, own == got, "the same as here", got)
}

/// Checks a count of the configuration against a saved one, or names it.
pub(crate) fn check_same_count(parameter: &'static str, own: usize, got: usize) -> Result<(), Error> {
    check_whole(parameter, own == got, "the same as here", got)
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
    check_whole(parameter, got.len() == count, "as many numbers as here", got.len())?;
    match got.iter().position(|x| !may_be(*x)) {
        None => Ok(()),
        Some(index) => Err(Error::domain(parameter, Some(index), expected, got[index])),
    }
}
