//! Changes of a running controller: gains, model, feed-forward, stops, histories and states.

use hysteresis_control::binary::Binary;
use hysteresis_python_macros::methods;
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyList, PyTuple};
use pythonize::{depythonize, pythonize};
use serde::{Deserialize, Serialize};

use super::controller::HybridController;
use super::filters::sections;
use super::source::source;
use crate::convert::arrays::vector;
use crate::convert::errors::{self, raise};
use crate::convert::objects::{exclusive, shared};
use crate::convert::pickling::bytes_of;
use crate::model::object::compiled_of;

impl HybridController {
    /// Another controller in the same state, made of a copy of what this one was made of.
    pub(crate) fn duplicate(&self, py: Python<'_>) -> PyResult<Self> {
        let copy = |source: &Py<PyAny>| {
            Ok::<_, PyErr>(py.import(intern!(py, "copy"))?.call_method1(intern!(py, "copy"), (source,))?.unbind())
        };
        Ok(Self {
            stage_controller: self.stage_controller.clone(),
            source: self.source.as_ref().map(copy).transpose()?,
            preview: self.preview.as_ref().map(|preview| preview.clone_ref(py)),
            observer: self.observer.as_ref().map(|observer| observer.clone_ref(py)),
            repetitive: self.repetitive.as_ref().map(|repetitive| repetitive.clone_ref(py)),
        })
    }

    /// A controller that is made again begins with the model that this one goes on with.
    pub(super) fn remember_model(&self, model: &Bound<'_, PyAny>) -> PyResult<()> {
        let source = self.source.as_ref().map(|source| source.bind(model.py()));
        source.map_or(Ok(()), |source| source.call_method1(intern!(model.py(), "set_model"), (model,)).map(drop))
    }
}

#[methods]
impl HybridController {
    /// Changes the gains without a jump. The integral is kept in volts.
    fn set_gains(slf: &Bound<'_, Self>, kp: f64, ki: f64) -> PyResult<()> {
        exclusive(slf)?.controller_mut().set_gains(kp, ki).map_err(raise)
    }

    /// Changes the filters of the feedback without a jump: what they put out stays as it was, and goes on from there.
    fn set_filters(
        slf: &Bound<'_, Self>,
        #[py("AnyFilter | Sequence[AnyFilter]")] filters: &Bound<'_, PyAny>,
    ) -> PyResult<()> {
        let mut this = exclusive(slf)?;
        let sections = sections(filters, this.controller().options().dt)?;
        this.controller_mut().set_filters(&sections).map_err(raise)
    }

    /// Goes on with the weights and the output offset of another model of the same operators, without a jump: as
    /// `Inverse.set_model` or `Forward.set_model` of the feed-forward.
    ///
    /// Raises ValueError that names what differs, NotInvertibleError if an inverse of the model may not exist; the
    /// controller is as before then.
    fn set_model(slf: &Bound<'_, Self>, #[py("Model")] model: &Bound<'_, PyAny>) -> PyResult<()> {
        let compiled = compiled_of("model", model)?;
        let mut this = exclusive(slf)?;
        this.controller_mut().set_model(&compiled).map_err(raise)?;
        this.remember_model(model)
    }

    /// Goes on with another feed-forward (as at construction) without a jump. While a motion is under way the new stream
    /// first moves to the last target; a change to "given" repeats the drive for one sample.
    fn set_feedforward(
        slf: &Bound<'_, Self>,
        #[py("FeedForward")] feedforward: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let dt = shared(slf)?.controller().options().dt;
        let (feedforward, source) = source(feedforward, dt)?;
        let mut this = exclusive(slf)?;
        this.controller_mut().set_feedforward(feedforward).map_err(raise)?;
        this.source = source;
        Ok(())
    }

    /// Back to the start, in mode "run", with the memory of the feed-forward at rest and all counters at zero. The drive
    /// stays as it is, or is `drive` if the amplifier has another one now.
    fn reset(slf: &Bound<'_, Self>, #[py(= None)] drive: Option<f64>) -> PyResult<()> {
        exclusive(slf)?.stage_controller.reset(drive).map_err(raise)
    }

    /// Ramps the drive to `rest_drive` (V) at `rate` (V/s), or at the slew if that is slower, and holds it there.
    ///
    /// From the next sample on every `step` puts out the next drive of the ramp, for any reference and measurement. `hold = False` starts a motion
    /// from the drive that is reached then.
    fn stop(slf: &Bound<'_, Self>, rate: f64, #[py(= 0.0)] rest_drive: f64) -> PyResult<()> {
        exclusive(slf)?.controller_mut().stop(rate, rest_drive).map_err(raise)
    }

    /// Takes over what was driven before, oldest drive first, one per sampling interval; the next motion starts from the last.
    fn follow(slf: &Bound<'_, Self>, #[py("ArrayLike")] drives: &Bound<'_, PyAny>) -> PyResult<()> {
        let drives = vector("drives", drives)?;
        exclusive(slf)?.stage_controller.follow(drives.as_slice()?).map_err(raise)
    }

    /// Goes on from another drive that the amplifier has, with everything that is remembered.
    ///
    /// For a state that was loaded into a controller whose amplifier is not at its drive: the next motion starts from there.
    fn start_at(slf: &Bound<'_, Self>, drive: f64) -> PyResult<()> {
        exclusive(slf)?.stage_controller.start_at(drive).map_err(raise)
    }

    /// Everything that the controller remembers, as a dictionary to keep; set it to continue from there bit for bit. The
    /// amplifier must be at its drive. A controller with other gains, dt or limits refuses it; the model is not part of it.
    #[getter]
    #[py(-> "dict[str, Any]")]
    pub(super) fn state<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let state = shared(slf)?.stage_controller.state();
        let is_plain = state.observer.is_none() && state.repetitive.is_none();
        Ok(if is_plain { pythonize(slf.py(), &state.controller) } else { pythonize(slf.py(), &state) }?)
    }

    /// What `state` says, as bytes: `state` takes them too.
    fn state_bytes<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyBytes>> {
        let state = shared(slf)?.stage_controller.state();
        let is_plain = state.observer.is_none() && state.repetitive.is_none();
        Ok(PyBytes::new(slf.py(), &if is_plain { state.controller.to_bytes() } else { state.to_bytes() }))
    }

    #[setter]
    pub(super) fn set_state(
        slf: &Bound<'_, Self>,
        #[py("dict[str, Any] | bytes")] state: &Bound<'_, PyAny>,
    ) -> PyResult<()> {
        let is_plain = {
            let this = shared(slf)?;
            this.observer.is_none() && this.repetitive.is_none()
        };
        if is_plain {
            let state = bytes_of(state).unwrap_or_else(|| plain_state(state))?;
            return exclusive(slf)?.controller_mut().set_state(&state).map_err(raise);
        }
        let state = bytes_of(state).unwrap_or_else(|| plain_state(state))?;
        exclusive(slf)?.stage_controller.set_state(&state).map_err(raise)
    }
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
