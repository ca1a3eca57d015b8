//! References: samples, or an object that knows its derivatives.

use hysteresis_core::is_admissible;
use pyo3::prelude::*;

use super::trajectories::trajectory;
use crate::convert::arrays::numbers;
use crate::convert::errors::{self, Place, raise};

/// The positions at 0, dt, 2 dt and so on: finite samples as they are, or those of a trajectory.
pub(crate) fn samples(name: &str, reference: &Bound<'_, PyAny>, dt: f64) -> PyResult<Vec<f64>> {
    positions(name, reference, dt, None)
}

/// The same of so many seconds, which only a trajectory has none of its own.
pub(crate) fn positions(name: &str, reference: &Bound<'_, PyAny>, dt: f64, seconds: Option<f64>) -> PyResult<Vec<f64>> {
    if let Some(trajectory) = trajectory(reference) {
        let motions = trajectory.sample(dt, seconds).map_err(raise)?;
        return Ok(motions.into_iter().map(|motion| motion.position).collect());
    }
    if let Some(seconds) = seconds {
        let expected = "None for samples, which have a length of their own";
        return Err(errors::value("seconds", format_args!("expected {expected}, got {seconds:?}")));
    }
    let samples = numbers(name, reference)?;
    match samples.iter().position(|sample| !is_admissible(*sample)) {
        None => Ok(samples),
        Some(index) => {
            let (expected, got) = ("a finite number (at most 1e100 in magnitude)", samples[index]);
            let place = format!("{name}[{index}]");
            Err(errors::value(Place::part(name, &place), format_args!("expected {expected}, got {got:?}")))
        }
    }
}
