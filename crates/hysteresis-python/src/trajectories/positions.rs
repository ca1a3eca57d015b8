//! The positions of a reference, which is samples or a trajectory.

use hysteresis_control::trajectory::Trajectory;
use hysteresis_core::check_all_finite;
use pyo3::prelude::*;

use super::one_axis::{PointToPoint, RoundedTriangle, Sine};
use super::scans::ScanAxis;
use crate::convert::arrays::numbers;
use crate::convert::errors::{self, raise};

/// A trajectory, if the object is one.
fn trajectory<'a>(object: &'a Bound<'_, PyAny>) -> Option<&'a dyn Trajectory> {
    if let Ok(sine) = object.cast::<Sine>() {
        Some(&sine.get().0)
    } else if let Ok(triangle) = object.cast::<RoundedTriangle>() {
        Some(&triangle.get().0)
    } else if let Ok(moves) = object.cast::<PointToPoint>() {
        Some(&moves.get().0)
    } else {
        object.cast::<ScanAxis>().ok().map(|axis| &axis.get().0 as &dyn Trajectory)
    }
}

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
