//! Streams of a stage: the whole chain, the exact inverse of its slow part, and the bracket of an unknown memory.

use hysteresis_control::binary::{Binary, Sampled};
use hysteresis_control::stage::{self, StageParts};
use hysteresis_core::{self as core, Process};
use hysteresis_python_macros::methods;
use numpy::PyArray1;
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use pythonize::pythonize;
use serde::Deserialize;

use super::stage::{Stage, checked_limits};
use crate::convert::errors::{Place, raise, value};
use crate::convert::objects::{Reduced, exclusive, keywords, reduce, saved_or_bytes, shared};
use crate::model::models::{compiled_of, model_of};
use crate::stream::bracket::Bracket;
use crate::stream::single_argument::Stepper;

#[methods]
impl Stage {
    /// The whole chain, sample by sample, at rest.
    fn forward(&self, dt: f64) -> PyResult<StageForward> {
        Ok(StageForward { stream: self.0.forward(dt).map_err(raise)?, stage: self.0.clone(), dt })
    }

    /// The exact inverse of maps, hysteresis, loop shift, relaxing plays, slow gain and creep, sample by sample, at
    /// rest; `limits` must lie within the stage's, by default `drive_range`.
    ///
    /// With `amplifier=True` that of the amplifier comes last, as its lag is in front of all: a target is then what
    /// amplifier and modes are to get, as `preview` makes it. The position is at what the lag makes of the targets, a
    /// sample later.
    fn inverse(
        &self,
        py: Python<'_>,
        dt: f64,
        #[py("Sequence[float] | None" = None)] limits: Option<(f64, f64)>,
        #[py(*, = false)] amplifier: bool,
    ) -> PyResult<StageInverse> {
        StageInverse::made(&self.0, dt, checked_limits(py, &self.0, limits)?, amplifier)
    }

    /// The inverse for a copy: whoever made the first one has been warned.
    fn _inverse(&self, dt: f64, limits: Option<(f64, f64)>, #[py(= false)] amplifier: bool) -> PyResult<StageInverse> {
        StageInverse::made(&self.0, dt, limits, amplifier)
    }

    /// The bracket for a copy.
    fn _bracket(slf: &Bound<'_, Self>, limits: Option<(f64, f64)>) -> PyResult<Bracket> {
        Ok(Bracket::made(slf.as_any(), slf.get().0.bracket(limits).map_err(raise)?))
    }

    /// How uncertain the position is when the history between the limits is unknown, without loop shift,
    /// relaxing plays, slow gain, creep and dynamics.
    fn bracket(
        slf: &Bound<'_, Self>,
        #[py("Sequence[float] | None" = None)] limits: Option<(f64, f64)>,
    ) -> PyResult<Bracket> {
        let this = &slf.get().0;
        let limits = checked_limits(slf.py(), this, limits)?;
        if this.limits(limits).map_err(raise)?.is_none() {
            return Err(raise(stage::Error::NoLimits));
        }
        Ok(Bracket::made(slf.as_any(), this.bracket(limits).map_err(raise)?))
    }
}

/// The position of a stage, sample by sample: made by `stage.forward(dt)`.
///
/// `step(u)` returns the row y(k) of a record: the position at the moment at which the drive u(k) is put out.
/// `advance(u)` returns the position one interval later, just before the next drive: what a controller reads next.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> stage = mh.Stage(mh.paper.table_1_recovered(), dynamics=mh.plant.SecondOrder(400.0, 0.95), dead_time=1e-4)
/// >>> forward = stage.forward(dt=1e-4)
/// >>> forward.run([100.0, 100.0, 100.0, 100.0]).round(3)  # one sample of dead time, one that the mode needs
/// array([0.   , 0.   , 0.013, 0.044])
#[pyclass(module = "mpi_hyst")]
pub(crate) struct StageForward {
    pub(crate) stream: stage::StageForward,
    pub(crate) stage: stage::Stage,
    pub(crate) dt: f64,
}

/// The exact inverse of a stage without its fast dynamics, sample by sample: made by `stage.inverse(dt)`.
///
/// It inverts input map, hysteresis, output map, loop shift, relaxing plays, slow gain and creep, and with
/// `amplifier=True` the amplifier in front of all. The drive never leaves the limits; a target out of reach puts it at
/// a limit and sets `saturated`.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> creep = mh.plant.Creep.logarithmic(0.012, 0.01, 100.0, 8)
/// >>> stage = mh.Stage(mh.paper.table_1_recovered(), creep=creep, limits=(-500.0, 500.0))
/// >>> forward, inverse = stage.forward(dt=1e-4), stage.inverse(dt=1e-4)
/// >>> target = mh.signals.sine(2.5, 10.0, seconds=0.2, rate=10e3)
/// >>> bool(abs(forward.run(inverse.run(target)) - target).max() < 1e-13)
/// True
#[pyclass(module = "mpi_hyst")]
pub(crate) struct StageInverse {
    pub(crate) stream: core::QuasiStaticInverse,
    pub(crate) stage: stage::Stage,
    pub(crate) dt: f64,
}

impl StageForward {
    fn sampled(&self) -> Sampled<stage::StageState> {
        Sampled { dt: self.dt, stream: self.stream.state() }
    }
}

impl StageInverse {
    /// Behind the amplifier of the stage, if that is asked for.
    pub(super) fn made(stage: &stage::Stage, dt: f64, limits: Option<(f64, f64)>, amplifier: bool) -> PyResult<Self> {
        let stream = if amplifier { stage.inverse_behind_amplifier(dt, limits) } else { stage.inverse(dt, limits) };
        Ok(Self { stream: stream.map_err(raise)?, stage: stage.clone(), dt })
    }

    fn sampled(&self) -> Sampled<core::QuasiStaticState> {
        Sampled { dt: self.dt, stream: self.stream.state() }
    }
}

/// A saved state of a stream that runs at this sampling interval.
pub(crate) fn state_at<T>(state: &Bound<'_, PyAny>, dt: f64) -> PyResult<T>
where
    Sampled<T>: Binary + for<'de> Deserialize<'de>,
{
    let state: Sampled<T> = saved_or_bytes(state)?;
    let place = Place::part("state", "state.dt");
    state.at(dt).map_err(|got| value(place, format_args!("expected {dt:?}, got {got:?}")))
}

/// The same stage around another hysteresis.
pub(crate) fn with_hysteresis(stage: &stage::Stage, model: &Bound<'_, PyAny>) -> PyResult<stage::Stage> {
    let hysteresis = model_of("model", model)?.into();
    stage::Stage::new(StageParts { hysteresis, ..stage.parts().clone() }).map_err(raise)
}

// What both streams of a stage offer.
#[methods(StageForward, StageInverse)]
impl Each {
    /// The sampling interval in seconds.
    #[getter]
    fn dt(&self) -> f64 {
        self.dt
    }

    /// What `state` says, as bytes: `state` takes them too.
    fn state_bytes<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyBytes>> {
        Ok(PyBytes::new(slf.py(), &shared(slf)?.sampled().to_bytes()))
    }

    /// Everything that the stream remembers, as a dictionary to keep; set it to continue from there bit for bit.
    #[getter]
    #[py(-> "dict[str, Any]")]
    fn state<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let state = shared(slf)?.sampled();
        Ok(pythonize(slf.py(), &state)?)
    }

    #[setter]
    fn set_state(slf: &Bound<'_, Self>, #[py("dict[str, Any] | bytes")] state: &Bound<'_, PyAny>) -> PyResult<()> {
        let state = state_at(state, shared(slf)?.dt)?;
        exclusive(slf)?.stream.set_state(&state).map_err(raise)
    }

    /// Takes over what was driven before, oldest drive first, one per sampling interval.
    fn follow(slf: &Bound<'_, Self>, drives: Vec<f64>) -> PyResult<()> {
        exclusive(slf)?.stream.follow(&drives).map_err(raise)
    }

    /// At rest since forever at a drive: creep and modes at their ends, the hysteresis virgin but for the way there.
    /// Returns the position.
    fn settle(slf: &Bound<'_, Self>, drive: f64) -> PyResult<f64> {
        Ok(exclusive(slf)?.stream.settle(drive))
    }
}

impl Stepper for StageForward {
    fn process(&self) -> &impl Process {
        &self.stream
    }

    fn process_mut(&mut self) -> &mut impl Process {
        &mut self.stream
    }

    fn rejected(&self) -> u64 {
        self.stream.rejected()
    }
}

#[methods]
impl StageForward {
    /// Holds a drive for one sampling interval and returns the position at its end, just before the next drive.
    fn advance(slf: &Bound<'_, Self>, drive: f64) -> PyResult<f64> {
        Ok(exclusive(slf)?.stream.advance(drive))
    }

    /// How many drives lay beyond the limits of the stage and were clamped.
    #[getter]
    fn clamped(&self) -> u64 {
        self.stream.clamped()
    }

    /// The last position.
    #[getter]
    fn position(&self) -> f64 {
        self.stream.output()
    }

    fn __repr__(&self) -> String {
        format!("<StageForward at dt {} s, position {}>", self.dt, self.stream.output())
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> Reduced<'py> {
        let (py, this) = (slf.py(), shared(slf)?);
        let stage = Bound::new(py, Stage(this.stage.clone()))?;
        reduce(stage.getattr(intern!(py, "forward"))?, (this.dt,), keywords!(py), Some(Self::state(slf)?))
    }
}

impl Stepper for StageInverse {
    fn process(&self) -> &impl Process {
        &self.stream
    }

    fn process_mut(&mut self) -> &mut impl Process {
        &mut self.stream
    }

    fn rejected(&self) -> u64 {
        self.stream.rejected()
    }
}

#[methods]
impl StageInverse {
    /// Goes on with another model of the same thresholds and input offset as the hysteresis, without a jump of the
    /// drive.
    ///
    /// Raises ValueError that names what differs; the stream is as before then.
    fn set_model(slf: &Bound<'_, Self>, #[py("Model")] model: &Bound<'_, PyAny>) -> PyResult<()> {
        let compiled = compiled_of("model", model)?;
        let mut this = exclusive(slf)?;
        let stage = with_hysteresis(&this.stage, model)?;
        this.stream.set_model(&compiled).map_err(raise)?;
        this.stage = stage;
        Ok(())
    }

    /// Whether the last target was out of reach and the drive is at a limit.
    #[getter]
    fn saturated(&self) -> bool {
        self.stream.saturated()
    }

    /// The limits of the drive (low, high), or None.
    #[getter]
    fn limits(&self) -> Option<(f64, f64)> {
        self.stream.limits()
    }

    /// The last drive.
    #[getter]
    fn drive(&self) -> f64 {
        self.stream.output()
    }

    /// The reversals of the input of the hysteresis that still determine its output, oldest first.
    #[getter]
    fn memory<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_vec(py, self.stream.hysteresis().turning_points())
    }

    fn __repr__(&self) -> String {
        match self.stream.limits() {
            Some((low, high)) => format!("<StageInverse at dt {} s, limits ({low}, {high})>", self.dt),
            None => format!("<StageInverse at dt {} s>", self.dt),
        }
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> Reduced<'py> {
        let (py, this) = (slf.py(), shared(slf)?);
        let stage = Bound::new(py, Stage(this.stage.clone()))?;
        let arguments = (this.dt, this.stream.limits(), this.stream.is_behind_amplifier());
        reduce(stage.getattr(intern!(py, "_inverse"))?, arguments, keywords!(py), Some(Self::state(slf)?))
    }
}
