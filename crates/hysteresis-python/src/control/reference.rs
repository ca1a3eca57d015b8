//! References: samples, or an object that knows its derivatives.

use hysteresis_core::check_all_finite;
use pyo3::prelude::*;

use super::trajectories::trajectory;
use crate::convert::arrays::numbers;
use crate::convert::errors::{self, raise};

/// The positions at 0, dt, 2 dt and so on: finite samples as they are, or those of a trajectory.
pub(crate) fn samples(name: &'static str, reference: &Bound<'_, PyAny>, dt: f64) -> PyResult<Vec<f64>> {
    positions(name, reference, dt, None)
}

/// The same of so many seconds, which only a trajectory has none of its own.
pub(crate) fn positions(
    name: &'static str,
    reference: &Bound<'_, PyAny>,
    dt: f64,
    seconds: Option<f64>,
) -> PyResult<Vec<f64>> {
    if let Some(trajectory) = trajectory(reference) {
        let motions = trajectory.sample(dt, seconds).map_err(raise)?;
        return Ok(motions.into_iter().map(|motion| motion.position).collect());
    }
    if let Some(seconds) = seconds {
        let expected = "None for samples, which have a length of their own";
        return Err(errors::value("seconds", format_args!("expected {expected}, got {seconds:?}")));
    }
    let samples = numbers(name, reference)?;
    check_all_finite(name, &samples).map_err(raise)?;
    Ok(samples)
}
