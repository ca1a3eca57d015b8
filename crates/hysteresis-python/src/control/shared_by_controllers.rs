//! What the controllers of one axis, of several and of arrays share: where feed-forward comes from, modes, terms, saved
//! states.

use hysteresis_core::{FeedForward, Mode, Terms};
use hysteresis_python_macros::{copies, methods};
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyTuple};
use pythonize::{depythonize, pythonize};
use serde::{Deserialize, Serialize};

use crate::argument::Words;
use crate::convert::arguments::is_word;
use crate::convert::errors::{self, unexpected};
use crate::convert::objects::shared;
use crate::model::models::compiled_if_model;
use crate::stage::streams::StageInverse;
use crate::stream::streams::{Forward, Inverse};

/// Refuses what was made for another sampling interval than `dt`; what has none of its own fits any.
pub(crate) fn check_interval(name: &str, got: Option<f64>, dt: f64) -> PyResult<()> {
    match got {
        // Rounding apart: 1 / 10 kHz is one number, 0.1 ms may be another.
        Some(got) if (got / dt - 1.0).abs() > 1e-9 => {
            let expected = format!("one made for the sampling interval of {dt:?} s");
            Err(errors::value(name, format_args!("expected {expected}, got one for {got:?} s")))
        }
        _ => Ok(()),
    }
}

/// The source of the feed-forward as a copy, and an object like the one that it was made of: a copy too, with which a
/// controller can be made again.
pub(super) fn source(value: Option<&Bound<'_, PyAny>>, dt: f64) -> PyResult<(FeedForward, Option<Py<PyAny>>)> {
    let Some(value) = value else { return Ok((FeedForward::None, None)) };
    let source = if let Ok(stream) = value.cast::<Inverse>() {
        shared(stream)?.stream.clone().into()
    } else if let Ok(stream) = value.cast::<Forward>() {
        shared(stream)?.stream.clone().into()
    } else if let Ok(stream) = value.cast::<StageInverse>() {
        check_interval("feedforward", Some(shared(stream)?.dt), dt)?;
        shared(stream)?.stream.clone().into()
    } else if is_word(value, "given") {
        return Ok((FeedForward::Given, Some(value.clone().unbind())));
    } else {
        let expected = if compiled_if_model(value).is_some() {
            "model.inverse(limits) of an actuator's model, or model.forward() of a model that is itself an inverse"
        } else {
            "model.inverse(limits), stage.inverse(dt), model.forward(), \"given\" or None"
        };
        return Err(unexpected("feedforward", expected, value));
    };
    let copy = value.py().import(intern!(value.py(), "copy"))?.call_method1(intern!(value.py(), "copy"), (value,))?;
    Ok((source, Some(copy.unbind())))
}

/// What a sample of a `HybridController` was made of: positions in um, terms in volts.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> stage = mh.Stage(mh.paper.table_1_recovered(), limits=(-500.0, 500.0))
/// >>> controller = stage.controller(dt=1e-4)
/// >>> drive = controller.step(1.0, 0.25)  # um, um
/// >>> controller.terms.error, controller.terms.drive == drive
/// (0.75, True)
#[copies(Terms)]
#[pyclass(module = "mpi_hyst.control", frozen, get_all)]
#[derive(Serialize, Deserialize)]
pub(crate) struct ControllerTerms {
    /// The reference of the feedback.
    reference: f64,
    /// What the feed-forward was to reach.
    target: f64,
    /// Reference minus measurement; without a usable measurement the last one there was.
    error: f64,
    /// The error behind the filters.
    filtered_error: f64,
    /// The output of the feed-forward, or the number given instead.
    feedforward: f64,
    /// kp times the filtered error.
    proportional: f64,
    /// The sum of ki dt times the filtered errors, this sample included.
    integral: f64,
    /// What keeps starts and switches from being jumps; it goes to zero.
    bumpless: f64,
    /// What the law asks for: the sum of the four terms.
    unlimited_drive: f64,
    /// What the limiter lets through.
    drive: f64,
    /// Whether the unlimited drive lay beyond the limits.
    saturated: bool,
    /// Whether the unlimited drive was farther from the last drive than the slew allows.
    slewing: bool,
}

#[methods]
impl ControllerTerms {
    fn __repr__(&self) -> String {
        let Self { error, feedforward, proportional, integral, bumpless, drive, .. } = self;
        format!(
            "<ControllerTerms drive {drive:?} of feedforward {feedforward:?}, proportional {proportional:?}, integral \
             {integral:?}, bumpless {bumpless:?}; error {error:?}>"
        )
    }
}

/// The modes that can be set: a stop has a method of its own.
impl Words for Mode {
    const WORDS: &'static [(&'static str, Self)] =
        &[("run", Self::Run), ("feedforward", Self::Feedforward), ("hold", Self::Hold)];
}

/// The word of any mode.
pub(super) fn mode_name(mode: Mode) -> &'static str {
    if mode == Mode::Stop { "stop" } else { mode.word() }
}

/// A state from a dictionary that says exactly that.
pub(super) fn plain_state<T: Serialize + for<'de> Deserialize<'de>>(state: &Bound<'_, PyAny>) -> PyResult<T> {
    let wrong = |what: &str| errors::value("state", format_args!("expected what .state returned; {what}"));
    let plain: T = depythonize(state).map_err(|error| wrong(&error.to_string()))?;
    // The conversion takes anything for a truth value.
    if is_same(&pythonize(state.py(), &plain)?, state)? {
        Ok(plain)
    } else {
        Err(wrong("a value has another type, or is NaN"))
    }
}

/// Whether a state says what was made of it. Lists may be tuples, and an older state may lack what is new.
fn is_same(made: &Bound<'_, PyAny>, given: &Bound<'_, PyAny>) -> PyResult<bool> {
    let is_sequence = |value: &Bound<'_, PyAny>| value.is_instance_of::<PyList>() || value.is_instance_of::<PyTuple>();
    if let (Ok(made), Ok(given)) = (made.cast::<PyDict>(), given.cast::<PyDict>()) {
        for (key, value) in given {
            let Some(made) = made.get_item(key)? else { return Ok(false) };
            if !is_same(&made, &value)? {
                return Ok(false);
            }
        }
        Ok(true)
    } else if is_sequence(made) && is_sequence(given) {
        for pair in made.try_iter()?.zip(given.try_iter()?) {
            if !is_same(&pair.0?, &pair.1?)? {
                return Ok(false);
            }
        }
        Ok(made.len()? == given.len()?)
    } else {
        made.eq(given)
    }
}
