//! The feedback loop that learning believes in, and another one to judge it by.

use hysteresis_control::learning::{FeedbackLoop, LoopUncertainty};
use hysteresis_control::linear::LinearDynamics;
use hysteresis_control::tuning::ModeUncertainty;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use super::filters::as_tuple;
use super::linear::part::{dynamics_object, linear_dynamics};
use crate::convert::errors::raise;
use crate::convert::pickling::keywords;

/// The loop with other dynamics, slope or dead time, where they are given.
pub(super) fn truth(
    feedback: FeedbackLoop,
    dynamics: Option<&Bound<'_, PyAny>>,
    slope: Option<f64>,
    dead_time: Option<f64>,
) -> PyResult<FeedbackLoop> {
    let own = feedback.dynamics.dead_time();
    let dynamics = match dynamics {
        Some(dynamics) => linear_part(dynamics, own)?,
        None => feedback.dynamics,
    };
    let dynamics = dynamics.with_dead_time(dead_time.unwrap_or(own)).map_err(raise)?;
    Ok(FeedbackLoop { dynamics, slope: slope.unwrap_or(feedback.slope), ..feedback })
}

/// How far the true loop may be from this one, as it is by default unless told.
pub(super) fn uncertainty(frequency: Option<f64>, damping: Option<f64>, slope: Option<f64>) -> LoopUncertainty {
    let usual = LoopUncertainty::default();
    LoopUncertainty { slope: slope.unwrap_or(usual.slope), ..told(usual, frequency, damping) }
}

/// What is known, with what was told of modes.
pub(crate) fn told(known: LoopUncertainty, frequency: Option<f64>, damping: Option<f64>) -> LoopUncertainty {
    LoopUncertainty {
        modes: ModeUncertainty {
            frequency: frequency.unwrap_or(known.modes.frequency),
            damping: damping.unwrap_or(known.modes.damping),
        },
        ..known
    }
}

/// The keywords that make this uncertainty.
pub(super) fn uncertainty_keywords(py: Python<'_>, of: LoopUncertainty) -> PyResult<Bound<'_, PyDict>> {
    Ok(keywords!(
        py,
        frequency_uncertainty = of.modes.frequency,
        damping_uncertainty = of.modes.damping,
        slope_uncertainty = of.slope
    ))
}

/// The linear part of a loop: dynamics and dead time.
pub(super) fn linear_part(dynamics: &Bound<'_, PyAny>, dead_time: f64) -> PyResult<LinearDynamics> {
    linear_dynamics("dynamics", dynamics)?.with_dead_time(dead_time).map_err(raise)
}

/// The keywords that make this loop.
pub(super) fn loop_keywords<'py>(py: Python<'py>, feedback: &FeedbackLoop) -> PyResult<Bound<'py, PyDict>> {
    let FeedbackLoop { kp, ki, filters, slope, dynamics, dt } = feedback;
    let dead_time = dynamics.dead_time();
    let dynamics = dynamics_object(py, dynamics)?.unwrap_or_else(|| PyTuple::empty(py).into_any().unbind());
    let filters = as_tuple(py, filters)?;
    Ok(keywords!(
        py,
        kp = kp,
        ki = ki,
        filters = filters,
        slope = slope,
        dynamics = dynamics,
        dead_time = dead_time,
        dt = dt
    ))
}
