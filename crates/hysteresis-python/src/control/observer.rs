//! The position behind a noisy measurement.

use hysteresis_control::ObserverOptions;
use hysteresis_control::linear::LinearDynamics;
use hysteresis_control::stage::{self, StageParts};
use hysteresis_python_macros::methods;
use numpy::PyArray1;
use pyo3::prelude::*;
use pythonize::pythonize;

use crate::argument::{Asked, Class};
use crate::convert::arrays::vector;
use crate::convert::errors::raise;
use crate::convert::objects::{Reduced, exclusive, keywords, reduce, saved, shared};
use crate::stage::stage::{Stage, stage_or_around};
use crate::stream::blocks::run_both;

/// A state observer: what the model of a stage and a noisy measurement say together of the position.
///
/// The applied drive moves the model of the stage, which has no lag for what it knows. What it does not know (drift,
/// its own error) is a disturbance at the input of the modes that wanders by `drift`; a Kalman filter estimates it from
/// the difference between measurement and model. Feed the estimate to the controller instead of the measurement. Where
/// measurements are missing the gain is that of what is known then, and comes back to the stationary one.
///
/// Parameters
/// ----------
/// stage : Stage, PrandtlIshlinskii or ModifiedPrandtlIshlinskii
///     A model with the keywords `dynamics` and `dead_time` makes a stage.
/// drift : float
///     By how much what the model does not know changes in one second, root mean square, in the unit of the position.
/// dt : float
///     Sampling interval in seconds.
/// noise : float, optional
///     Root mean square of the measurement noise, in the unit of the position; by default that of the stage.
/// dynamics : FirstOrder, SecondOrder, Antiresonance, Modes, StateSpace, or a list of them in series, optional
/// dead_time : float
///     What the sensor shows later than hysteresis and dynamics explain, in seconds.
///
/// Raises
/// ------
/// ValueError, TypeError
///     That name the argument, what was expected and what came.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> stage = mh.Stage(mh.paper.table_1_recovered(), dynamics=mh.plant.SecondOrder(400.0, 0.95), noise=0.016)
/// >>> observer = mh.control.Observer(stage, drift=0.5, dt=1e-4)
/// >>> estimate = observer.step(0.0, 0.1)  # at rest, a first sample that is mostly noise
/// >>> 0.0 < estimate < 0.02
/// True
#[pyclass(module = "mpi_hyst.control", skip_from_py_object)]
#[derive(Clone)]
pub(crate) struct Observer {
    pub(crate) observer: hysteresis_control::Observer,
    pub(super) stage: stage::Stage,
    pub(super) options: ObserverOptions,
}

impl Observer {
    /// An observer of a stage; without a noise, with that of the stage.
    pub(crate) fn of(stage: stage::Stage, dt: f64, drift: f64, noise: Option<f64>) -> PyResult<Self> {
        let noise = noise.or(stage.parts().noise).ok_or(stage::Error::NoNoise).map_err(raise)?;
        let options = ObserverOptions { noise, drift };
        let observer = hysteresis_control::Observer::new(&stage, dt, &options).map_err(raise)?;
        Ok(Self { observer, stage, options })
    }
}

impl Class for Observer {
    const CALLED: &'static str = "a mh.control.Observer";
}

#[methods]
impl Observer {
    #[new]
    fn new(
        #[py("Model | Stage")] stage: &Bound<'_, PyAny>,
        #[py(*)] drift: f64,
        dt: f64,
        #[py(= None)] noise: Option<f64>,
        #[py(= None)] dynamics: LinearDynamics,
        #[py(= 0.0)] dead_time: Asked<f64>,
    ) -> PyResult<Self> {
        let parts = StageParts { dynamics, ..StageParts::default() };
        Self::of(stage_or_around("stage", stage, parts, dead_time)?, dt, drift, noise)
    }

    /// Takes the drive that was held since the last sample, and the measurement of now; returns the position of now.
    ///
    /// Without a finite measurement the model goes on alone; that is counted. One that was in a loop has taken the
    /// drive that is held now: its next step goes on from that.
    fn step(slf: &Bound<'_, Self>, drive: f64, measurement: f64) -> PyResult<f64> {
        Ok(exclusive(slf)?.observer.step(drive, measurement))
    }

    /// Takes arrays of drives and measurements, bit for bit like `step` in a loop; returns the positions, in `out` or a
    /// new array.
    fn run<'py>(
        slf: &Bound<'py, Self>,
        #[py("ArrayLike")] drives: &Bound<'py, PyAny>,
        #[py("ArrayLike")] measurements: &Bound<'py, PyAny>,
        #[py("Vector | None" = None)] out: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        run_both(slf, [("drives", drives), ("measurements", measurements)], out, |this, x, y, positions| {
            this.observer.run(x, y, positions)
        })
    }

    /// What the model does not know, at the input of the modes, in the unit of the position.
    #[getter]
    fn disturbance(&self) -> f64 {
        self.observer.disturbance()
    }

    /// What the position takes of the difference between measurement and prediction, from 0 to 1.
    #[getter]
    fn position_gain(&self) -> f64 {
        self.observer.position_gain()
    }

    /// What the disturbance takes of the difference between measurement and prediction.
    #[getter]
    fn disturbance_gain(&self) -> f64 {
        self.observer.disturbance_gain()
    }

    /// The sampling interval in seconds.
    #[getter]
    fn dt(&self) -> f64 {
        self.observer.dt()
    }

    /// How many drives or measurements were not finite; before a controller, also how many of its measurements were
    /// implausible.
    #[getter]
    fn rejected(&self) -> u64 {
        self.observer.rejected()
    }

    /// Back to rest.
    fn reset(slf: &Bound<'_, Self>) -> PyResult<()> {
        exclusive(slf)?.observer.reset();
        Ok(())
    }

    /// Takes over what was driven before, oldest drive first, one per sampling interval, without measurements.
    fn follow(slf: &Bound<'_, Self>, #[py("ArrayLike")] drives: &Bound<'_, PyAny>) -> PyResult<()> {
        let drives = vector("drives", drives)?;
        exclusive(slf)?.observer.follow(drives.as_slice()?).map_err(raise)
    }

    /// Everything that is remembered, as a dictionary to keep; set it to continue from there bit for bit.
    #[getter]
    #[py(-> "dict[str, Any]")]
    fn state<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let state = shared(slf)?.observer.state();
        Ok(pythonize(slf.py(), &state)?)
    }

    #[setter]
    fn set_state(slf: &Bound<'_, Self>, #[py("dict[str, Any]")] state: &Bound<'_, PyAny>) -> PyResult<()> {
        let state = saved(state)?;
        exclusive(slf)?.observer.set_state(&state).map_err(raise)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> Reduced<'py> {
        let (py, this) = (slf.py(), shared(slf)?);
        let ObserverOptions { noise, drift } = this.options;
        let keywords = keywords!(py, drift = drift, dt = this.dt(), noise = noise);
        reduce(py.get_type::<Self>().into_any(), (Stage(this.stage.clone()),), keywords, Some(Self::state(slf)?))
    }

    fn __repr__(&self) -> String {
        let ObserverOptions { noise, drift } = self.options;
        format!("<Observer at dt {} s, noise {noise}, drift {drift}>", self.dt())
    }
}
