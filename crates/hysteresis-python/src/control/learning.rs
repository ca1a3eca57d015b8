//! Learning of motions that repeat, iterative and repetitive, and the feedback loop that it believes in.

use std::num::NonZeroUsize;

use hysteresis_control::learning::{self, FeedbackLoop, LearningOptions, LoopUncertainty, RepetitiveOptions};
use hysteresis_control::linear::LinearDynamics;
use hysteresis_control::tuning::ModeUncertainty;
use hysteresis_python_macros::methods;
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use pythonize::pythonize;

use crate::argument::Class;
use crate::control::filters::{Filters, as_tuple};
use crate::convert::arrays::{FIT, check_room, numbers, read_only, vector};
use crate::convert::errors::raise;
use crate::convert::objects::{Reduced, exclusive, keywords, reduce, saved, shared};
use crate::linear::dynamics::{dynamics_object, linear_dynamics};

/// The loop with other dynamics, slope or dead time, where they are given.
fn truth(
    feedback: FeedbackLoop,
    dynamics: Option<&Bound<'_, PyAny>>,
    slope: Option<f64>,
    dead_time: Option<f64>,
) -> PyResult<FeedbackLoop> {
    let own = feedback.dynamics.dead_time();
    let dynamics = match dynamics {
        Some(dynamics) => linear_part(dynamics, own)?,
        None => feedback.dynamics,
    };
    let dynamics = dynamics.with_dead_time(dead_time.unwrap_or(own)).map_err(raise)?;
    Ok(FeedbackLoop { dynamics, slope: slope.unwrap_or(feedback.slope), ..feedback })
}

/// What is known, with what was told of modes.
pub(crate) fn told(known: LoopUncertainty, frequency: Option<f64>, damping: Option<f64>) -> LoopUncertainty {
    LoopUncertainty {
        modes: ModeUncertainty {
            frequency: frequency.unwrap_or(known.modes.frequency),
            damping: damping.unwrap_or(known.modes.damping),
        },
        ..known
    }
}

/// The linear part of a loop: dynamics and dead time.
fn linear_part(dynamics: &Bound<'_, PyAny>, dead_time: f64) -> PyResult<LinearDynamics> {
    linear_dynamics("dynamics", dynamics)?.with_dead_time(dead_time).map_err(raise)
}

/// The keywords that make this loop.
fn loop_keywords<'py>(py: Python<'py>, feedback: &FeedbackLoop) -> PyResult<Bound<'py, PyDict>> {
    let FeedbackLoop { kp, ki, filters, slope, dynamics, dt } = feedback;
    let dead_time = dynamics.dead_time();
    let dynamics = dynamics_object(py, dynamics)?.unwrap_or_else(|| PyTuple::empty(py).into_any().unbind());
    let filters = as_tuple(py, filters)?;
    Ok(keywords!(
        py,
        kp = kp,
        ki = ki,
        filters = filters,
        slope = slope,
        dynamics = dynamics,
        dead_time = dead_time,
        dt = dt
    ))
}

type Vector<'py> = PyResult<Bound<'py, PyArray1<f64>>>;

/// Iterative learning control of a periodic reference: after every period, a better target for the next one.
///
/// A correction v of the target of the feed-forward leaves e = e0 - M v, e = reference - measurement over a period, M
/// the response of the feedback loop. At every harmonic a Gaussian tells what is believed of e0 and M; each period
/// makes it narrower. The correction moves towards the one with the least mean square of the error to be expected, with
/// P the variance of M and C its covariance with e0:
///
/// v <- Q (v + (conj(M) (e0 - M v) + C - (P + 0.02^2) v) / (|M|^2 + P + 0.02^2 + 0.05^2))
///
/// So little is learned where the loop is not known, and nothing where no error shows above the noise. A loop that is
/// another one than was believed is learned with the errors. Learning stops by itself (`finished`). An error of twice
/// the best one is not used: the target goes back to the best.
///
/// Parameters
/// ----------
/// target : array of n floats
///     One period of the target: the reference, or what dynamic feed-forward makes of it.
/// kp, ki : float
///     Gains of the feedback, V/um and V/um/s.
/// slope : float
///     Of the actuator where it works, um/V: between its w_0 and the sum of its weights.
/// dynamics : FirstOrder, SecondOrder, Antiresonance, Modes, StateSpace, or a list of them in series
///     The linear dynamics behind the hysteresis.
/// dt : float
///     Sampling interval in seconds.
/// bandwidth : float, optional
///     Q = 1 / (1 + (f / bandwidth)^4), in Hz, keeps corrections below it. Without one Q is 1.
/// dead_time : float
///     What the sensor shows later than the dynamics explain, in seconds.
/// min_gain : float
///     Old periods are forgotten so fast that the gain never falls below this. Less averages noise over more periods.
/// target_limits : (float, float), optional
///     The target never leaves (low, high).
/// filters : filter or sequence of filters
///     Of the feedback.
/// noise : float, optional
///     The root mean square of the measurement noise, um. Without it the upper half of the harmonics of the first
///     period tells it.
/// frequency_uncertainty, damping_uncertainty, slope_uncertainty : float
///     How far the true loop may be: a share of the frequency of lightly damped modes, factors of their damping and of
///     the slope.
/// settle : int
///     Periods that pass before the first one that is learned from, and after each change of the target: one for a
///     lightly damped loop. Call `update` for them too.
/// on_demand : bool
///     The motion is repeated on demand, from rest to rest. If not, one period follows the other. Where the target
///     rests at its ends, up to a tenth of it at each, the correction comes and goes smoothly: so nothing jumps there.
///
/// Raises
/// ------
/// ValueError, TypeError
///     That name the argument, what was expected and what came.
///
/// Examples
/// --------
/// >>> import numpy as np
/// >>> import mpi_hyst as mh
/// >>> stage = mh.plant.SecondOrder(400.0, 0.95)
/// >>> reference = np.sin(2 * np.pi * np.arange(100) / 100)
/// >>> learning = mh.control.IterativeLearning(
/// ...     reference, kp=0.0, ki=0.0, slope=1.0, dynamics=stage, bandwidth=1000.0, dt=1e-4
/// ... )
/// >>> for _ in range(4):
/// ...     position = stage.response(np.tile(learning.target, 3), dt=1e-4)[200:300]
/// ...     accepted = learning.update(reference - position)
/// >>> bool(learning.rmse[0] > 0.2), bool(learning.rmse[-1] < 1e-3), learning.convergence_rate() < 0.7
/// (True, True, True)
/// >>> import json
/// >>> kept = json.dumps(learning.state)  # for a file; another day
/// >>> again = mh.control.IterativeLearning(
/// ...     reference, kp=0.0, ki=0.0, slope=1.0, dynamics=stage, bandwidth=1000.0, dt=1e-4
/// ... )
/// >>> again.state = json.loads(kept)
/// >>> bool(np.all(again.target == learning.target))
/// True
#[pyclass(module = "mpi_hyst.control")]
pub(crate) struct IterativeLearning {
    learning: learning::IterativeLearning,
    feedback: FeedbackLoop,
    options: LearningOptions,
    /// The target to begin with.
    first: Vec<f64>,
}

impl IterativeLearning {
    /// Learning in this loop, from this target on.
    pub(crate) fn of(feedback: FeedbackLoop, target: &Bound<'_, PyAny>, options: LearningOptions) -> PyResult<Self> {
        let first = numbers("target", target)?;
        check_room("target", first.len(), FIT)?;
        let learning = learning::IterativeLearning::new(&feedback, &first, &options).map_err(raise)?;
        Ok(Self { learning, feedback, options, first })
    }
}

#[methods]
impl IterativeLearning {
    #[new]
    #[gather(options: LearningOptions, put_options)]
    fn new(
        #[py("ArrayLike")] target: &Bound<'_, PyAny>,
        #[py(*)] kp: f64,
        ki: f64,
        slope: f64,
        #[py("Dynamics")] dynamics: &Bound<'_, PyAny>,
        dt: f64,
        #[py(field, = None)] bandwidth: Option<f64>,
        #[py(= 0.0)] dead_time: f64,
        #[py(field, = 0.15)] min_gain: f64,
        #[py(field, "Sequence[float] | None" = None)] target_limits: Option<(f64, f64)>,
        #[py(= ())] filters: Filters,
        #[py(field, = None)] noise: Option<f64>,
        #[py(field(uncertainty.modes.frequency) = 0.05)] frequency_uncertainty: f64,
        #[py(field(uncertainty.modes.damping) = 2.0)] damping_uncertainty: f64,
        #[py(field(uncertainty.slope) = 1.0)] slope_uncertainty: f64,
        #[py(field, = 0)] settle: u32,
        #[py(field, = false)] on_demand: bool,
    ) -> PyResult<Self> {
        let (filters, dynamics) = (filters.sections(dt)?, linear_part(dynamics, dead_time)?);
        Self::of(FeedbackLoop { kp, ki, filters, slope, dynamics, dt }, target, options)
    }

    /// One period of the target for the feed-forward, read-only.
    #[getter]
    fn target<'py>(&self, py: Python<'py>) -> Vector<'py> {
        read_only(py, self.learning.target().iter().copied())
    }

    /// What is added to the target with which learning began: for a reference that also drifts from period to period,
    /// as the slow axis of a raster does, add it to that. Read-only.
    #[getter]
    fn correction<'py>(&self, py: Python<'py>) -> Vector<'py> {
        read_only(py, self.learning.correction())
    }

    /// Whether learning has stopped by itself: five periods did not lower the error by a hundredth. The target is that
    /// of the best period then. Learning goes on when the error grows by a quarter.
    #[getter]
    fn finished(&self) -> bool {
        self.learning.is_finished()
    }

    /// Learns from the measured error of a period that was run with the present target; whether it was used, which it
    /// is not while the loop settles.
    fn update(slf: &Bound<'_, Self>, #[py("ArrayLike")] error: &Bound<'_, PyAny>) -> PyResult<bool> {
        let error = vector("error", error)?;
        Ok(exclusive(slf)?.learning.update(error.as_slice()?).map_err(raise)?.accepted)
    }

    /// The largest measured error of every period so far.
    #[getter]
    fn max_error<'py>(&self, py: Python<'py>) -> Vector<'py> {
        read_only(py, self.learning.trials().iter().map(|trial| trial.max_error))
    }

    /// The root mean square of the measured error of every period so far.
    #[getter]
    fn rmse<'py>(&self, py: Python<'py>) -> Vector<'py> {
        read_only(py, self.learning.trials().iter().map(|trial| trial.rmse))
    }

    /// By how much the error of the slowest harmonic shrinks in the first period, the mean apart: max |Q (1 - L M')|.
    ///
    /// M' is the loop with what is given here instead of what learning believes. Below 1 learning converges.
    fn convergence_rate(
        slf: &Bound<'_, Self>,
        #[py(*, "Dynamics | None" = None)] dynamics: Option<&Bound<'_, PyAny>>,
        #[py(= None)] slope: Option<f64>,
        #[py(= None)] dead_time: Option<f64>,
    ) -> PyResult<f64> {
        let feedback = shared(slf)?.feedback.clone();
        let truth = truth(feedback, dynamics, slope, dead_time)?;
        shared(slf)?.learning.convergence_rate(&truth).map_err(raise)
    }

    /// Everything that is remembered, as a dictionary to keep; set it to continue from there bit for bit.
    #[getter]
    #[py(-> "dict[str, Any]")]
    fn state<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let state = shared(slf)?.learning.state();
        Ok(pythonize(slf.py(), &state)?)
    }

    #[setter]
    fn set_state(slf: &Bound<'_, Self>, #[py("dict[str, Any]")] state: &Bound<'_, PyAny>) -> PyResult<()> {
        let state = saved(state)?;
        exclusive(slf)?.learning.set_state(&state).map_err(raise)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> Reduced<'py> {
        let (py, this) = (slf.py(), shared(slf)?);
        let keywords = loop_keywords(py, &this.feedback)?;
        Self::put_options(&this.options, &keywords)?;
        let first = PyArray1::from_slice(py, &this.first);
        reduce(py.get_type::<Self>().into_any(), (first,), keywords, Some(Self::state(slf)?))
    }

    fn __repr__(&self) -> String {
        let (samples, periods) = (self.first.len(), self.learning.trials().len());
        format!("<IterativeLearning of {samples} samples, {periods} periods so far>")
    }
}

/// Repetitive control: the correction of the target, learned in the running loop, one period later.
///
/// v(k) = sum_i q_i v(k - N + i) + gain sum_i l_i e(k - N + i) - mean of v, i = -m..m: the filters Q = 1 / (1 + (f /
/// bandwidth)^4) and L = conj(M) / (|M|^2 + P + 0.05^2) as finite impulse responses around the present place of the
/// last period of N samples. M is the response of the loop to a correction, P its variance over what the loop may be.
/// The static error is left to a feedback that integrates.
///
/// Where the loop is too far from the model, learning diverges: the error grows from period to period. It is told by
/// the root mean square of the error in a period, or in as many as make 64 samples. Above three times the best (four
/// together) each that is larger than the one before counts once, by a half or more twice; a smaller one counts back.
/// At five counts, or where such an error has grown by a half beyond half the swing of the reference, learning stops
/// and fades out within one period. What changes of the reference explain does not count. Noise or vibration that stays
/// above three times the best error for long may come to five counts by chance.
///
/// Parameters
/// ----------
/// period : int
///     Samples in a period of the reference, 8 to 2^22.
/// kp, ki, slope, dynamics, dt, dead_time, filters, frequency_uncertainty, damping_uncertainty, slope_uncertainty
///     As for `IterativeLearning`.
/// bandwidth : float, optional
///     Up to which frequency to learn, in Hz. Without one, as far as learning converges on every loop that the true one
///     may be.
/// gain : float
///     gamma, above 0 and at most 1: less averages noise over more periods.
/// settle : int
///     Periods that pass before the first one that is learned from.
/// limit : float, optional
///     The correction never exceeds this magnitude, in the unit of the displacement.
///
/// Raises
/// ------
/// ValueError, TypeError
///     That name the argument, what was expected and what came.
///
/// Examples
/// --------
/// >>> import math
/// >>> import mpi_hyst as mh
/// >>> repetitive = mh.control.RepetitiveControl(
/// ...     100, kp=0.0, ki=0.0, slope=1.0, dynamics=mh.plant.FirstOrder(50.0), bandwidth=100.0, dt=1e-3
/// ... )
/// >>> y, decay, errors = 0.0, math.exp(-2 * math.pi * 50.0 * 1e-3), []
/// >>> for k in range(3000):
/// ...     errors.append(math.sin(2 * math.pi * k / 100) - y)
/// ...     target = y + errors[-1] + repetitive.step(errors[-1])
/// ...     y = target + decay * (y - target)
/// >>> max(errors[:100]) > 0.1, max(errors[-100:]) < 2e-3
/// (True, True)
#[pyclass(module = "mpi_hyst.control", skip_from_py_object)]
#[derive(Clone)]
pub(crate) struct RepetitiveControl {
    pub(crate) control: learning::RepetitiveControl,
    pub(super) feedback: FeedbackLoop,
    pub(super) options: RepetitiveOptions,
}

impl RepetitiveControl {
    /// Learning in this loop, of a period of so many samples.
    pub(crate) fn of(feedback: FeedbackLoop, period: usize, options: RepetitiveOptions) -> PyResult<Self> {
        let control = learning::RepetitiveControl::new(&feedback, period, &options).map_err(raise)?;
        Ok(Self { control, feedback, options })
    }
}

impl Class for RepetitiveControl {
    const CALLED: &'static str = "a mh.control.RepetitiveControl";
}

#[methods]
impl RepetitiveControl {
    #[new]
    #[gather(options: RepetitiveOptions, put_options)]
    fn new(
        period: NonZeroUsize,
        #[py(*)] kp: f64,
        ki: f64,
        slope: f64,
        #[py("Dynamics")] dynamics: &Bound<'_, PyAny>,
        dt: f64,
        #[py(field, = None)] bandwidth: Option<f64>,
        #[py(= 0.0)] dead_time: f64,
        #[py(field, = 0.3)] gain: f64,
        #[py(field, = 1)] settle: u32,
        #[py(field, = None)] limit: Option<f64>,
        #[py(= ())] filters: Filters,
        #[py(field(uncertainty.modes.frequency) = 0.05)] frequency_uncertainty: f64,
        #[py(field(uncertainty.modes.damping) = 2.0)] damping_uncertainty: f64,
        #[py(field(uncertainty.slope) = 1.0)] slope_uncertainty: f64,
    ) -> PyResult<Self> {
        let (filters, dynamics) = (filters.sections(dt)?, linear_part(dynamics, dead_time)?);
        Self::of(FeedbackLoop { kp, ki, filters, slope, dynamics, dt }, period.get(), options)
    }

    /// Takes the measured error of this sample and returns the correction of this sample's target.
    ///
    /// With the reference of this sample, errors that come from a reference that changes are not taken for divergence.
    fn step(slf: &Bound<'_, Self>, error: f64, #[py(= None)] reference: Option<f64>) -> PyResult<f64> {
        let mut this = exclusive(slf)?;
        Ok(match reference {
            Some(reference) => this.control.step_with(reference, error),
            None => this.control.step(error),
        })
    }

    /// "learning"; "fading": what was learned goes to zero; "stopped": learning has diverged, and corrects nothing
    /// until `restart`.
    #[getter]
    #[py(-> "LearningPhase")]
    fn phase(&self) -> &'static str {
        self.control.phase().name()
    }

    /// How often learning has diverged, and stopped.
    #[getter]
    fn divergence_count(&self) -> u64 {
        self.control.divergence_count()
    }

    /// Learns anew: at once after it has stopped, else as soon as what was learned has faded out, so that nothing
    /// jumps.
    fn restart(slf: &Bound<'_, Self>) -> PyResult<()> {
        exclusive(slf)?.control.restart();
        Ok(())
    }

    /// Forgets everything, the counters too.
    fn reset(slf: &Bound<'_, Self>) -> PyResult<()> {
        exclusive(slf)?.control.reset();
        Ok(())
    }

    /// Samples in a period.
    #[getter]
    fn period(&self) -> usize {
        self.control.period()
    }

    /// Up to which frequency it learns, in Hz.
    #[getter]
    fn bandwidth(&self) -> f64 {
        self.control.bandwidth()
    }

    /// How many errors were not finite: they teach nothing.
    #[getter]
    fn rejected(&self) -> u64 {
        self.control.rejected()
    }

    /// By how much the error shrinks in a period at the worst frequency from the first harmonic up: max |Q - gain L
    /// M'|.
    ///
    /// M' is the loop with what is given here instead of what is believed. Below 1 the loop is stable with learning.
    fn convergence_rate(
        slf: &Bound<'_, Self>,
        #[py(*, "Dynamics | None" = None)] dynamics: Option<&Bound<'_, PyAny>>,
        #[py(= None)] slope: Option<f64>,
        #[py(= None)] dead_time: Option<f64>,
    ) -> PyResult<f64> {
        let feedback = shared(slf)?.feedback.clone();
        let truth = truth(feedback, dynamics, slope, dead_time)?;
        shared(slf)?.control.convergence_rate(&truth).map_err(raise)
    }

    /// Everything that is remembered, as a dictionary to keep; set it to continue from there bit for bit.
    #[getter]
    #[py(-> "dict[str, Any]")]
    fn state<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let state = shared(slf)?.control.state();
        Ok(pythonize(slf.py(), &state)?)
    }

    #[setter]
    fn set_state(slf: &Bound<'_, Self>, #[py("dict[str, Any]")] state: &Bound<'_, PyAny>) -> PyResult<()> {
        let state = saved(state)?;
        exclusive(slf)?.control.set_state(&state).map_err(raise)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> Reduced<'py> {
        let (py, this) = (slf.py(), shared(slf)?);
        let keywords = loop_keywords(py, &this.feedback)?;
        Self::put_options(&this.options, &keywords)?;
        reduce(py.get_type::<Self>().into_any(), (this.period(),), keywords, Some(Self::state(slf)?))
    }

    fn __repr__(&self) -> String {
        format!("<RepetitiveControl of {} samples, gain {}>", self.period(), self.options.gain)
    }
}
