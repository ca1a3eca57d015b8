//! Where the feed-forward of a controller comes from.

use hysteresis_core::FeedForward;
use pyo3::intern;
use pyo3::prelude::*;

use crate::convert::arguments::is_word;
use crate::convert::errors::unexpected;
use crate::convert::objects::shared;
use crate::model::object::kernel;
use crate::stage::streams::StageInverse;
use crate::stream::streams::{Forward, Inverse};

/// The source of the feed-forward as a copy, and an object like the one that it was made of: a copy too, with which a
/// controller can be made again.
pub(super) fn source(value: Option<&Bound<'_, PyAny>>) -> PyResult<(FeedForward, Option<Py<PyAny>>)> {
    let Some(value) = value else { return Ok((FeedForward::None, None)) };
    let source = if let Ok(stream) = value.cast::<Inverse>() {
        shared(stream)?.stream.clone().into()
    } else if let Ok(stream) = value.cast::<Forward>() {
        shared(stream)?.stream.clone().into()
    } else if let Ok(stream) = value.cast::<StageInverse>() {
        shared(stream)?.stream.clone().into()
    } else if is_word(value, "given") {
        return Ok((FeedForward::Given, Some(value.clone().unbind())));
    } else {
        let expected = if kernel(value).is_some() {
            "model.inverse(limits) of an actuator's model, or model.forward() of a model that is itself an inverse"
        } else {
            "model.inverse(limits), stage.inverse(dt), model.forward(), \"given\" or None"
        };
        return Err(unexpected("feedforward", expected, value));
    };
    let copy = value.py().import(intern!(value.py(), "copy"))?.call_method1(intern!(value.py(), "copy"), (value,))?;
    Ok((source, Some(copy.unbind())))
}
