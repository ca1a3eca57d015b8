//! What a loop is asked for, as Python gives it and as Python names it.

use hysteresis_core::{self as core, Mode};
use hysteresis_realtime::{self as realtime, MissPolicy, WatchdogTimes};
use pyo3::prelude::*;

use crate::control::controller::HybridController;
use crate::convert::arguments::{OrDefault, OrNone, count, two};
use crate::convert::errors::{self, raise};
use crate::convert::objects::{instance, shared};
use crate::plant::plant::Plant;
use crate::stage::object::Stage;

/// A controller as it came, or one that a stage makes.
pub(super) fn checked_controller<'py>(
    given: &Bound<'py, PyAny>,
    rate: Option<f64>,
    io: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, HybridController>> {
    if given.cast::<Stage>().is_ok() {
        let Some(rate) = rate else {
            return Err(errors::value("rate", "expected samples per second beside a Stage, got None"));
        };
        check_rate(rate, io)?;
        let made = given.call_method1("controller", (1.0 / rate,));
        return Ok(made.map_err(|error| about_rate(io.py(), error))?.cast_into::<HybridController>()?);
    }
    let controller = instance::<HybridController>("controller", "a HybridController or a Stage", given)?;
    let own = 1.0 / shared(controller)?.stage_controller.controller().options().dt;
    match rate {
        Some(rate) if (rate / own - 1.0).abs() > 1e-9 => {
            Err(errors::value("rate", format_args!("expected {own:?}, as the controller has, got {rate:?}")))
        }
        _ => Ok(controller.clone()),
    }
}

/// Refuses a rate that no loop has, or another one than that of a simulated plant.
fn check_rate(rate: f64, io: &Bound<'_, PyAny>) -> PyResult<()> {
    let expected = if !(0.1..=1e6).contains(&rate) {
        "0.1 to 1e6 samples per second".to_owned()
    } else if let Ok(plant) = io.cast::<Plant>() {
        let own = 1.0 / shared(plant)?.plant.dt();
        if (rate / own - 1.0).abs() <= 1e-9 {
            return Ok(());
        }
        format!("{own:?}, for which the Plant that is `io` was made")
    } else {
        return Ok(());
    };
    Err(errors::value("rate", format_args!("expected {expected}, got {rate:?}")))
}

/// What the controller of a stage says of its interval, as about the rate.
fn about_rate(py: Python<'_>, error: PyErr) -> PyErr {
    let parameter = error.value(py).getattr("parameter").and_then(|parameter| parameter.extract::<String>());
    let message = error.to_string();
    match message.split_once("dt: ") {
        Some((_, said)) if parameter.is_ok_and(|parameter| parameter == "dt") => {
            errors::value("rate", format_args!("its sampling interval 1 / rate: {said}"))
        }
        _ => error,
    }
}

pub(super) fn policy(misses: &OrDefault<'_>, most_caught_up: Option<&Bound<'_, PyAny>>) -> PyResult<MissPolicy> {
    let expected = "\"skip\", \"catch_up\" or \"stop\"";
    let misses = misses.word("misses", expected, "skip")?;
    match (&misses[..], most_caught_up) {
        ("skip", None) => Ok(MissPolicy::Skip),
        ("stop", None) => Ok(MissPolicy::Stop),
        ("catch_up", given) => {
            let at_most = given.map_or(Ok(100), |given| count("most_caught_up", given))?;
            Ok(MissPolicy::CatchUp { at_most: u32::try_from(at_most).unwrap_or(u32::MAX) })
        }
        ("skip" | "stop", Some(_)) => Err(errors::value("most_caught_up", "expected None without misses=\"catch_up\"")),
        _ => Err(errors::value("misses", format_args!("expected {expected}, got \"{misses}\""))),
    }
}

pub(super) fn watchdog_times(given: &OrNone<'_>) -> PyResult<Option<WatchdogTimes>> {
    given.or(Some(WatchdogTimes { stale_after: 0.0, rest_after: 0.1 }), |times| {
        times
            .map(|times| {
                let (stale_after, rest_after) = two("watchdog", "(stale_after, rest_after) or None", times)?;
                Ok(WatchdogTimes { stale_after, rest_after })
            })
            .transpose()
    })
}

/// What could not start, by the names of the arguments.
pub(super) fn refused(error: realtime::Error) -> PyErr {
    match error {
        realtime::Error::Record { path, error } => errors::io(&path.display().to_string(), &error),
        realtime::Error::Rests(mode) => {
            let mode = if mode == Mode::Stop { "stop" } else { "hold" };
            let expected = "expected one that moves: set its `hold` to False";
            errors::value("controller", format_args!("{expected}, got one in mode \"{mode}\""))
        }
        realtime::Error::Parameter(core::Error::Domain { parameter, index, expected, got }) => {
            raise(core::Error::Domain { parameter: argument(parameter), index, expected, got })
        }
        realtime::Error::Parameter(core::Error::Whole { parameter, index, expected, got }) => {
            raise(core::Error::Whole { parameter: argument(parameter), index, expected, got })
        }
        error => raise(error),
    }
}

/// What the argument is called that a setting comes from.
fn argument(setting: &'static str) -> &'static str {
    match setting {
        "dt" => "controller",
        "write_faults" => "most_write_faults",
        "stale_after" | "rest_after" => "watchdog",
        other => other,
    }
}
