//! Changes of several running axes: gains, filters, models and feed-forward of one; modes, stops, histories and states of all.

use hysteresis_core as core;
use hysteresis_python_macros::methods;
use numpy::ndarray::Ix2;
use pyo3::prelude::*;
use pyo3::types::{PyString, PyTuple};
use pythonize::pythonize;

use super::controller_changes::plain_state;
use super::controller_options::{MODES, mode_name, mode_of};
use super::filters::sections;
use super::multi_axis::{MultiAxisController, one_each};
use super::source::source;
use crate::convert::arguments::whole;
use crate::convert::errors::{raise, unexpected};
use crate::convert::objects::{exclusive, shared};
use crate::model::object::compiled_of;
use crate::stream::stream_arrays::columns;

#[methods]
impl MultiAxisController {
    /// Changes the gains of actuator `axis`, counted from 0, without a jump: as `HybridController.set_gains`.
    ///
    /// A change of one actuator drops what is planned for all. What is refused leaves all as it was.
    fn set_gains(slf: &Bound<'_, Self>, #[py("int")] axis: &Bound<'_, PyAny>, kp: f64, ki: f64) -> PyResult<()> {
        let axis = whole("axis", axis)?;
        exclusive(slf)?.controller.controller_mut(axis).and_then(|one| one.set_gains(kp, ki)).map_err(raise)
    }

    /// Changes the filters of actuator `axis`, counted from 0, without a jump: as `HybridController.set_filters`.
    fn set_filters(
        slf: &Bound<'_, Self>,
        #[py("int")] axis: &Bound<'_, PyAny>,
        #[py("AnyFilter | Sequence[AnyFilter]")] filters: &Bound<'_, PyAny>,
    ) -> PyResult<()> {
        let axis = whole("axis", axis)?;
        let dt = shared(slf)?.dt();
        let sections = sections(filters, dt)?;
        exclusive(slf)?.controller.controller_mut(axis).and_then(|one| one.set_filters(&sections)).map_err(raise)
    }

    /// Actuator `axis`, counted from 0, goes on with the weights and the output offset of another model of the same operators,
    /// without a jump: as `HybridController.set_model`.
    ///
    /// Raises ValueError that names what differs, NotInvertibleError if an inverse of the model may not exist; all is as before
    /// then.
    ///
    /// Examples
    /// --------
    /// >>> import mpi_hyst as mh
    /// >>> model, limits = mh.paper.table_1_recovered(), (-500.0, 500.0)
    /// >>> single = mh.control.HybridController(model.inverse(limits), kp=5.0, ki=6e3, dt=1e-4, limits=limits)
    /// >>> axes = mh.control.MultiAxisController([single, single])
    /// >>> for _ in range(60):
    /// ...     before = axes.step([1.0, 0.5], [1.0, 0.5])
    /// >>> stiffer = mh.ModifiedPrandtlIshlinskii(0.9 * model.weights, model.r, model.ra, model.rb, model.rc)
    /// >>> axes.set_model(0, stiffer)
    /// >>> axes.set_gains(1, kp=4.0, ki=5e3)
    /// >>> bool(abs(axes.step([1.0, 0.5], [1.0, 0.5]) - before).max() < 1.0)  # V: no jump
    /// True
    /// >>> axes.kp.tolist(), axes.mode
    /// ([5.0, 4.0], ('run', 'run'))
    fn set_model(
        slf: &Bound<'_, Self>,
        #[py("int")] axis: &Bound<'_, PyAny>,
        #[py("Model")] model: &Bound<'_, PyAny>,
    ) -> PyResult<()> {
        let (axis, compiled) = (whole("axis", axis)?, compiled_of("model", model)?);
        let mut this = exclusive(slf)?;
        this.controller.controller_mut(axis).and_then(|one| one.set_model(&compiled)).map_err(raise)?;
        shared(this.made_of[axis].bind(slf.py()))?.remember_model(model)
    }

    /// Actuator `axis`, counted from 0, goes on with another feed-forward without a jump: as `HybridController.set_feedforward`.
    fn set_feedforward(
        slf: &Bound<'_, Self>,
        #[py("int")] axis: &Bound<'_, PyAny>,
        #[py("FeedForward")] feedforward: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let axis = whole("axis", axis)?;
        let dt = shared(slf)?.dt();
        let (feedforward, source) = source(feedforward, dt)?;
        let mut this = exclusive(slf)?;
        this.controller.controller_mut(axis).and_then(|one| one.set_feedforward(feedforward)).map_err(raise)?;
        exclusive(this.made_of[axis].bind(slf.py()))?.source = source;
        Ok(())
    }

    /// What each actuator does with its samples, N words: "run"; "feedforward": the proportional term is off, the integral is
    /// frozen and stays part of the drive; "hold": the drive stays and nothing advances; "stop", which `stop` begins.
    ///
    /// Set one of the first three at any time, or a list of N of them: no change of mode is a jump.
    #[getter]
    #[py(-> "tuple[Literal['run', 'feedforward', 'hold', 'stop'], ...]")]
    fn mode<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        PyTuple::new(py, self.controller.controllers().iter().map(|one| mode_name(one.mode())))
    }

    #[setter]
    fn set_mode(
        slf: &Bound<'_, Self>,
        #[py("Literal['run', 'feedforward', 'hold'] | Sequence[Literal['run', 'feedforward', 'hold']]")] mode: &Bound<
            '_,
            PyAny,
        >,
    ) -> PyResult<()> {
        let axes = shared(slf)?.axes();
        let modes = if let Ok(word) = mode.cast::<PyString>() {
            vec![mode_of("mode", word.to_str()?)?; axes]
        } else {
            let words = mode.extract::<Vec<String>>().ok().filter(|words| words.len() == axes);
            let words =
                words.ok_or_else(|| unexpected("mode", format_args!("{MODES}, or a list of {axes} of these"), mode))?;
            let each = words.iter().enumerate().map(|(i, word)| mode_of(&format!("mode[{i}]"), word));
            each.collect::<PyResult<Vec<_>>>()?
        };
        let mut this = exclusive(slf)?;
        let mut each = this.controller.controllers_mut().iter_mut().zip(modes);
        each.try_for_each(|(one, mode)| one.set_mode(mode)).map_err(raise)
    }

    /// Whether all drives are held. An attribute: set it to True to hold, to False to go on in the mode before, also after a
    /// stop.
    #[getter]
    fn hold(&self) -> bool {
        self.controller.controllers().iter().all(|controller| controller.mode() == core::Mode::Hold)
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

    /// Ramps every drive to its rest drive (V, an array of N, by default zeros) at `rate` (V/s), or at its slew if that is slower, and
    /// holds it there.
    ///
    /// From the next sample on every `step` puts out the next drives of the ramps, for any references and measurements. `hold = False` starts a motion
    /// from the drives that are reached then.
    fn stop(
        slf: &Bound<'_, Self>,
        rate: f64,
        #[py("ArrayLike | None" = None)] rest_drives: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let axes = shared(slf)?.axes();
        let rest_drives = match rest_drives {
            Some(given) => one_each("rest_drives", given, axes)?.as_slice()?.to_vec(),
            None => vec![0.0; axes],
        };
        exclusive(slf)?.controller.stop(rate, &rest_drives).map_err(raise)
    }

    /// All axes back to the start, in mode "run", with all counters at zero. The drives stay as they are, or are `drives` if the
    /// amplifiers have others now.
    fn reset(
        slf: &Bound<'_, Self>,
        #[py("ArrayLike | None" = None)] drives: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let axes = shared(slf)?.axes();
        let drives = drives.map(|given| one_each("drives", given, axes)).transpose()?;
        let mut this = exclusive(slf)?;
        match drives {
            Some(drives) => this.controller.reset_at(drives.as_slice()?).map_err(raise)?,
            None => this.controller.reset(),
        }
        Ok(())
    }

    /// Takes over what was driven before, an array of shape (samples, N), oldest drives first, one row per sampling interval; the
    /// next motion starts from the last row.
    fn follow(slf: &Bound<'_, Self>, #[py("ArrayLike")] drives: &Bound<'_, PyAny>) -> PyResult<()> {
        let axes = shared(slf)?.axes();
        let drives = columns::<Ix2>("drives", drives, axes, format_args!("an array of shape (samples, {axes})"))?;
        exclusive(slf)?.controller.follow(drives.as_slice()?).map_err(raise)
    }

    /// Goes on from other drives that the amplifiers have, with everything that is remembered.
    fn start_at(slf: &Bound<'_, Self>, #[py("ArrayLike")] drives: &Bound<'_, PyAny>) -> PyResult<()> {
        let axes = shared(slf)?.axes();
        let drives = one_each("drives", drives, axes)?;
        exclusive(slf)?.controller.start_at(drives.as_slice()?).map_err(raise)
    }

    /// Everything that the axes remember, as a dictionary to keep; set it to continue from there bit for bit. The amplifiers must
    /// be at its drives. Axes with another decoupling, other gains, dt or limits refuse it.
    #[getter]
    #[py(-> "dict[str, Any]")]
    fn state<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let state = shared(slf)?.controller.state();
        Ok(pythonize(slf.py(), &state)?)
    }

    #[setter]
    fn set_state(slf: &Bound<'_, Self>, #[py("dict[str, Any]")] state: &Bound<'_, PyAny>) -> PyResult<()> {
        let plain: core::MultiAxisState = plain_state(state)?;
        exclusive(slf)?.controller.set_state(&plain).map_err(raise)
    }
}
