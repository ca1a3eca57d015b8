//! Where the feed-forward of a controller comes from.

use hysteresis_core::FeedForward;
use pyo3::intern;
use pyo3::prelude::*;

use crate::convert::arguments::is_word;
use crate::convert::errors::{self, unexpected};
use crate::convert::objects::shared;
use crate::model::object::compiled_if_model;
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
