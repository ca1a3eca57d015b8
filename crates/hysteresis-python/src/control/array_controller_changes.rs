//! Changes of a running controller of an array: gains, models, stops, histories and states.

use hysteresis_core::Mode;
use hysteresis_python_macros::methods;
use numpy::ndarray::Ix2;
use pyo3::prelude::*;
use pythonize::pythonize;

use super::array_controller::ArrayController;
use crate::convert::arguments::whole;
use crate::convert::arrays::each;
use crate::convert::errors::raise;
use crate::convert::objects::{exclusive, shared};
use crate::convert::pickling::saved;
use crate::model::object::compiled_of;
use crate::stream::stream_arrays::columns;

#[methods]
impl ArrayController {
    /// Changes the gains, per second, without a jump. The leak stays unless it is given.
    fn set_gains(slf: &Bound<'_, Self>, ki: f64, #[py(= None)] leak: Option<f64>) -> PyResult<()> {
        let mut this = exclusive(slf)?;
        let leak = leak.unwrap_or(this.controller.options().leak);
        this.controller.set_gains(ki, leak).map_err(raise)
    }

    /// One actuator goes on with the weights and the output offset of another model of the same thresholds and input offset,
    /// without a jump.
    ///
    /// Raises ValueError that names what differs, NotInvertibleError if an inverse of the model may not exist; the controller is
    /// as before then.
    fn set_model(
        slf: &Bound<'_, Self>,
        #[py("int")] actuator: &Bound<'_, PyAny>,
        #[py("Model")] model: &Bound<'_, PyAny>,
    ) -> PyResult<()> {
        let (actuator, compiled) = (whole::<usize>("actuator", actuator)?, compiled_of("model", model)?);
        let mut this = exclusive(slf)?;
        this.controller.set_model(actuator, &compiled).map_err(raise)?;
        this.made.set_model(actuator, model);
        Ok(())
    }

    /// Whether the drives are held. An attribute: set it to True to hold, to False to go on, also after a stop.
    #[getter]
    fn hold(&self) -> bool {
        self.controller.mode() == Mode::Hold
    }

    #[setter]
    fn set_hold(slf: &Bound<'_, Self>, hold: bool) -> PyResult<()> {
        if hold {
            exclusive(slf)?.controller.hold();
        } else {
            exclusive(slf)?.controller.release();
        }
        Ok(())
    }

    /// Ramps the drives to `rest_drive` (V), one for all or one for each, at `rate` (V/s), or at the slew if that is slower, and
    /// holds them there.
    ///
    /// From the next sample on every `step` puts out the next drives of the ramp, for any reference and measurement. `hold =
    /// False` starts a motion from the drives that are reached then.
    fn stop(
        slf: &Bound<'_, Self>,
        rate: f64,
        #[py("ArrayLike" = 0.0)] rest_drive: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let actuators = shared(slf)?.controller.len();
        let rest = rest_drive.map_or(Ok(vec![0.0; actuators]), |drive| each("rest_drive", drive, actuators))?;
        exclusive(slf)?.controller.stop(rate, &rest).map_err(raise)
    }

    /// Back to the start, in mode "run", with the memory of a move from rest to the present drives and all counters at zero. The
    /// drives stay as they are, or are `drive`, one for all or one for each, if the amplifiers have others now.
    fn reset(slf: &Bound<'_, Self>, #[py("ArrayLike | None" = None)] drive: Option<&Bound<'_, PyAny>>) -> PyResult<()> {
        let actuators = shared(slf)?.controller.len();
        let drive = drive.map(|drive| each("drive", drive, actuators)).transpose()?;
        let mut this = exclusive(slf)?;
        if let Some(drives) = drive {
            return this.controller.reset_at(&drives).map_err(raise);
        }
        this.controller.reset();
        Ok(())
    }

    /// Takes over what was driven before, an array of shape (samples, M), oldest drives first; the next motion starts from the
    /// last row.
    fn follow(slf: &Bound<'_, Self>, #[py("ArrayLike")] drives: &Bound<'_, PyAny>) -> PyResult<()> {
        let actuators = shared(slf)?.controller.len();
        let expected = format!("an array of shape (samples, {actuators})");
        let drives = columns::<Ix2>("drives", drives, actuators, format_args!("{expected}"))?;
        exclusive(slf)?.controller.follow(drives.as_slice()?).map_err(raise)
    }

    /// Everything that the controller remembers, as a dictionary to keep; set it to continue from there bit for bit. The
    /// amplifiers must be at its drives. A controller with other gains or dt refuses it; models and limits are not part of it.
    #[getter]
    #[py(-> "dict[str, Any]")]
    pub(super) fn state<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let state = shared(slf)?.controller.state();
        Ok(pythonize(slf.py(), &state)?)
    }

    #[setter]
    pub(super) fn set_state(slf: &Bound<'_, Self>, #[py("dict[str, Any]")] state: &Bound<'_, PyAny>) -> PyResult<()> {
        let state = saved(state)?;
        exclusive(slf)?.controller.set_state(&state).map_err(raise)
    }
}
