//! The feedback loop that learning believes in, and another one to judge it by.

use hysteresis_control::learning::FeedbackLoop;
use pyo3::prelude::*;

use super::linear::part::given_dynamics;

/// The loop with other dynamics, slope or dead time, where they are given.
pub(super) fn truth(
    feedback: FeedbackLoop,
    dynamics: Option<&Bound<'_, PyAny>>,
    slope: Option<f64>,
    dead_time: Option<f64>,
) -> PyResult<FeedbackLoop> {
    Ok(FeedbackLoop {
        dynamics: dynamics.map(given_dynamics).transpose()?.unwrap_or(feedback.dynamics),
        slope: slope.unwrap_or(feedback.slope),
        delay: dead_time.map_or(feedback.delay, |dead_time| dead_time / feedback.dt),
        ..feedback
    })
}
