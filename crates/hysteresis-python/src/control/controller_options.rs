//! The options of a controller, from Python and back.

use hysteresis_core::{AntiWindup, ControllerOptions, Law, Mode};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::filters::as_tuple;
use crate::argument::Words;
use crate::convert::errors::{self, Place};
use crate::convert::pickling::keywords;

impl Words for Law {
    const WORDS: &'static [(&'static str, Self)] =
        &[("positional", Self::Positional), ("incremental", Self::Incremental)];
}

/// The word for a way against wind-up; the tracking time belongs to one of them.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Windup {
    Conditional,
    BackCalculation,
}

impl Words for Windup {
    const WORDS: &'static [(&'static str, Self)] =
        &[("conditional", Self::Conditional), ("back_calculation", Self::BackCalculation)];
}

impl Windup {
    pub(super) fn with(self, tracking_time: Option<f64>) -> PyResult<AntiWindup> {
        match (self, tracking_time) {
            (Self::Conditional, None) => Ok(AntiWindup::Conditional),
            (Self::Conditional, Some(time)) => {
                let expected = "None unless anti_windup=\"back_calculation\"";
                Err(errors::value("tracking_time", format_args!("expected {expected}, got {time:?}")))
            }
            (Self::BackCalculation, tracking_time) => Ok(AntiWindup::BackCalculation { tracking_time }),
        }
    }
}

pub(super) fn mode_name(mode: Mode) -> &'static str {
    match mode {
        Mode::Run => "run",
        Mode::Feedforward => "feedforward",
        Mode::Hold => "hold",
        Mode::Stop => "stop",
    }
}

/// A mode that can be set: a stop has a method of its own.
pub(super) fn mode_of(place: &str, name: &str) -> PyResult<Mode> {
    let modes = [Mode::Run, Mode::Feedforward, Mode::Hold];
    match modes.into_iter().find(|known| mode_name(*known) == name) {
        Some(mode) => Ok(mode),
        None => Err(errors::value(Place::part("mode", place), format_args!("expected {MODES}, got \"{name}\""))),
    }
}

/// The words that [`mode_of`] takes.
pub(super) const MODES: &str = "\"run\", \"feedforward\" or \"hold\"";

/// The keywords that make these options.
pub(super) fn as_keywords<'py>(py: Python<'py>, options: &ControllerOptions) -> PyResult<Bound<'py, PyDict>> {
    let (anti_windup, tracking_time) = match options.anti_windup {
        AntiWindup::Conditional => ("conditional", None),
        AntiWindup::BackCalculation { tracking_time } => ("back_calculation", tracking_time),
    };
    Ok(keywords!(
        py,
        kp = options.kp,
        ki = options.ki,
        dt = options.dt,
        limits = options.limits,
        slew = options.slew,
        law = options.law.word(),
        anti_windup = anti_windup,
        tracking_time = tracking_time,
        bumpless_time = options.bumpless_time,
        max_missing = options.max_missing,
        measurement_range = options.measurement_range,
        max_measurement_step = options.max_measurement_step,
        filters = as_tuple(py, &options.filters)?,
        start_drive = options.start_drive,
    ))
}
