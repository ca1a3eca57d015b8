//! Numbers that no linear block can have.

use hysteresis_core::{Error, MAX_MAGNITUDE};

/// The number, if it is finite and above zero by more than the reciprocal of the largest admissible magnitude.
pub(crate) fn check_positive(parameter: &'static str, index: Option<usize>, got: f64) -> Result<f64, Error> {
    if got.abs() <= MAX_MAGNITUDE && got >= 1.0 / MAX_MAGNITUDE {
        Ok(got)
    } else {
        Err(Error::domain(parameter, index, "a finite number above 0 (1e-100 to 1e100)", got))
    }
}

/// The number of seconds, if it can be a dead time.
pub(crate) fn check_dead_time(got: f64) -> Result<f64, Error> {
    if (0.0..=MAX_MAGNITUDE).contains(&got) {
        Ok(got)
    } else {
        Err(Error::domain("dead_time", None, "a finite number of seconds, 0 or more", got))
    }
}
