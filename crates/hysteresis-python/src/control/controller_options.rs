//! The options of a controller, from Python and back.

use hysteresis_core::{AntiWindup, ControllerOptions, Law, Mode};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::filters::{as_tuple, sections};
use crate::convert::arguments::{numbers, pair, unknown, whole, word};
use crate::convert::errors::{self, Place};
use crate::convert::pickling::keywords;

fn law(name: &Bound<'_, PyAny>) -> PyResult<Law> {
    let expected = "\"positional\" or \"incremental\"";
    match word("law", expected, name)?.as_str() {
        "positional" => Ok(Law::Positional),
        "incremental" => Ok(Law::Incremental),
        got => unknown("law", expected, got),
    }
}

fn law_name(law: Law) -> &'static str {
    match law {
        Law::Positional => "positional",
        Law::Incremental => "incremental",
    }
}

fn anti_windup(name: Option<&Bound<'_, PyAny>>, tracking_time: Option<f64>) -> PyResult<AntiWindup> {
    let words = "\"conditional\" or \"back_calculation\"";
    let name = name.map_or_else(|| Ok("conditional".to_owned()), |name| word("anti_windup", words, name))?;
    match (name.as_str(), tracking_time) {
        ("conditional", None) => Ok(AntiWindup::Conditional),
        ("conditional", Some(time)) => {
            let expected = "None unless anti_windup=\"back_calculation\"";
            Err(errors::value("tracking_time", format_args!("expected {expected}, got {time:?}")))
        }
        ("back_calculation", tracking_time) => Ok(AntiWindup::BackCalculation { tracking_time }),
        (got, _) => unknown("anti_windup", words, got),
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

/// The keywords of a controller that have defaults, as they came.
#[derive(FromPyObject)]
pub(super) struct Given<'py> {
    pub(super) slew: Option<Bound<'py, PyAny>>,
    pub(super) law: Option<Bound<'py, PyAny>>,
    pub(super) anti_windup: Option<Bound<'py, PyAny>>,
    pub(super) tracking_time: Option<Bound<'py, PyAny>>,
    pub(super) bumpless_time: Option<Bound<'py, PyAny>>,
    pub(super) max_missing: Option<Bound<'py, PyAny>>,
    pub(super) measurement_range: Option<Bound<'py, PyAny>>,
    pub(super) max_measurement_step: Option<Bound<'py, PyAny>>,
    pub(super) filters: Option<Bound<'py, PyAny>>,
    pub(super) start_drive: Option<Bound<'py, PyAny>>,
}

impl Given<'_> {
    /// The options with these in place of the defaults.
    pub(super) fn over(self, options: &ControllerOptions) -> PyResult<ControllerOptions> {
        let Self { law, anti_windup, max_missing, measurement_range, filters, .. } = self;
        let (slew, tracking_time, bumpless_time) =
            (self.slew.as_ref(), self.tracking_time.as_ref(), self.bumpless_time.as_ref());
        let (max_measurement_step, start_drive) = (self.max_measurement_step.as_ref(), self.start_drive.as_ref());
        numbers!(slew, tracking_time, bumpless_time, max_measurement_step, start_drive);
        let range = measurement_range.as_ref().map(|range| pair("measurement_range", range)).transpose()?;
        Ok(ControllerOptions {
            slew: slew.or(options.slew),
            law: law.map_or(Ok(options.law), |name| self::law(&name))?,
            anti_windup: self::anti_windup(anti_windup.as_ref(), tracking_time)?,
            bumpless_time: bumpless_time.unwrap_or(options.bumpless_time),
            max_missing: max_missing.map_or(Ok(options.max_missing), |number| whole("max_missing", &number))?,
            measurement_range: range.or(options.measurement_range),
            max_measurement_step: max_measurement_step.or(options.max_measurement_step),
            filters: filters.map_or(Ok(options.filters), |filters| sections(&filters, options.dt))?,
            start_drive: start_drive.or(options.start_drive),
            ..*options
        })
    }
}

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
        law = law_name(options.law),
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
