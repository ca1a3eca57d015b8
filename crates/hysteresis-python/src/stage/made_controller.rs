//! A controller made from a stage.

use hysteresis_control::feedforward::PreviewOptions;
use hysteresis_control::learning::RepetitiveOptions;
use hysteresis_control::stage::PEAK_SENSITIVITY;
use pyo3::prelude::*;
use pyo3::types::PyString;

use super::object::Stage;
use super::streams::StageInverse;
use crate::control::controller::HybridController;
use crate::control::learning::RepetitiveControl;
use crate::control::learning::told;
use crate::control::observer::Observer;
use crate::convert::arguments::{numbers, unknown};
use crate::convert::errors::{self, raise, unexpected};

/// The words for the feed-forward of a controller.
pub(super) const SOURCES: &str = "\"inverse\", \"preview\" or \"given\"";

impl Stage {
    pub(super) fn made_controller(
        &self,
        py: Python<'_>,
        dt: f64,
        limits: Option<(f64, f64)>,
        feedforward: &str,
        wishes: Wishes,
    ) -> PyResult<HybridController> {
        let Wishes { gains, ahead, smoothing, drift, period, uncertainty: (frequency, damping) } = wishes;
        if feedforward != "preview" {
            let expected = "expected None without feedforward=\"preview\"";
            if ahead.is_some() {
                return Err(errors::value("ahead", expected));
            }
            if smoothing != 0.0 {
                return Err(errors::value("smoothing", expected));
            }
        }
        for (name, given) in [("frequency_uncertainty", frequency), ("damping_uncertainty", damping)] {
            if period.is_none() && given.is_some() {
                return Err(errors::value(name, "expected None without period; for gains alone ask stage.tune"));
            }
        }
        let uncertainty = told(self.0.loop_uncertainty(), frequency, damping);
        let options = match both(gains)? {
            Some(gains) => self.0.controller_options_with_gains(dt, limits, gains),
            None => self.0.tuning_options(dt, PEAK_SENSITIVITY).and_then(|mut asked| {
                asked.uncertainty = uncertainty.modes;
                self.0.controller_options_tuned(&asked, limits)
            }),
        };
        let options = options.map_err(raise)?;
        let source = match feedforward {
            "inverse" | "preview" => {
                let stream = self.0.inverse(dt, Some(options.limits)).map_err(raise)?;
                Bound::new(py, StageInverse { stream, stage: self.0.clone(), dt })?.into_any()
            }
            "given" => PyString::new(py, "given").into_any(),
            other => return unknown("feedforward", SOURCES, other),
        };
        let preview = match feedforward {
            "preview" => {
                let options = PreviewOptions::new(ahead.map_or_else(|| self.ahead(dt), Ok)?);
                let preview = self.made_preview(dt, &options)?;
                Some(Py::new(py, if smoothing == 0.0 { preview } else { preview.behind_smoothing(smoothing)? })?)
            }
            _ => None,
        };
        let observer = drift.map(|drift| Py::new(py, Observer::of(self.0.clone(), dt, drift, None)?)).transpose()?;
        let repetitive = period.map(|period| {
            let feedback = self.0.feedback_loop(dt, (options.kp, options.ki), options.filters).map_err(raise)?;
            let learning = RepetitiveOptions { uncertainty, ..RepetitiveOptions::default() };
            Py::new(py, RepetitiveControl::of(feedback, period, learning)?)
        });
        HybridController::of(Some(&source), preview, &options)?.with_parts(py, observer, repetitive.transpose()?)
    }

    /// Seconds, or what the modes of this stage need.
    pub(super) fn smoothing(&self, smoothing: &Bound<'_, PyAny>) -> PyResult<f64> {
        match smoothing.extract::<&str>() {
            Ok("modes") => Ok(self.0.smoothing()),
            Ok(_) => Err(unexpected("smoothing", "seconds or \"modes\"", smoothing)),
            Err(_) => {
                numbers!(smoothing);
                Ok(smoothing)
            }
        }
    }
}

/// What is asked of a controller besides.
#[derive(Default)]
pub(super) struct Wishes {
    /// kp and ki instead of tuned ones, both or none.
    pub(super) gains: (Option<f64>, Option<f64>),
    /// How many samples a preview looks ahead, unless that is left to the stage.
    pub(super) ahead: Option<usize>,
    /// Over how many seconds references are smoothed.
    pub(super) smoothing: f64,
    /// Of an observer.
    pub(super) drift: Option<f64>,
    /// Of learning in the loop, in samples.
    pub(super) period: Option<usize>,
    /// How far frequency and damping of modes may be from what is known, where learning is asked for.
    pub(super) uncertainty: (Option<f64>, Option<f64>),
}

/// Gains are found together: one of them beside a tuned other one may make the loop unstable.
pub(super) fn both(gains: (Option<f64>, Option<f64>)) -> PyResult<Option<(f64, f64)>> {
    match gains {
        (Some(kp), Some(ki)) => Ok(Some((kp, ki))),
        (None, None) => Ok(None),
        (Some(kp), None) => Err(errors::value("ki", format_args!("expected a number beside kp = {kp:?}, got None"))),
        (None, Some(ki)) => Err(errors::value("kp", format_args!("expected a number beside ki = {ki:?}, got None"))),
    }
}
