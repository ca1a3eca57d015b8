//! Learning from one period to the next.

use hysteresis_control::learning::{self, FeedbackLoop, LearningOptions};
use hysteresis_core::Sections;
use hysteresis_python_macros::methods;
use numpy::PyArray1;
use pyo3::prelude::*;
use pythonize::pythonize;

use super::feedback_loop::{linear_part, loop_keywords, truth, uncertainty, uncertainty_keywords};
use super::filters::sections;
use crate::convert::arguments::{OrDefault, numbers, pair, whole};
use crate::convert::arrays::{numbers, read_only, vector};
use crate::convert::errors::raise;
use crate::convert::memory::{FIT, check_room};
use crate::convert::objects::{exclusive, shared};
use crate::convert::pickling::{Reduced, keywords, reduce, saved};

type Vector<'py> = PyResult<Bound<'py, PyArray1<f64>>>;

/// Iterative learning control of a periodic reference: after every period, a better target for the next one.
///
/// A correction v of the target of the feed-forward leaves e = e0 - M v, e = reference - measurement over a period, M the response of
/// the feedback loop. At every harmonic a Gaussian tells what is believed of e0 and M; each period makes it narrower. The correction
/// moves towards the one with the least mean square of the error to be expected, with P the variance of M and C its covariance with e0:
///
/// v <- Q (v + (conj(M) (e0 - M v) + C - (P + 0.02^2) v) / (|M|^2 + P + 0.02^2 + 0.05^2))
///
/// So little is learned where the loop is not known, and nothing where no error shows above the noise. A loop that is another one than
/// was believed is learned with the errors. Learning stops by itself (`finished`). An error of twice the best one is not used: the
/// target goes back to the best.
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
///     The root mean square of the measurement noise, um. Without it the upper half of the harmonics of the first period tells it.
/// frequency_uncertainty, damping_uncertainty, slope_uncertainty : float
///     How far the true loop may be: a share of the frequency of lightly damped modes, factors of their damping and of the slope.
/// settle : int
///     Periods that pass before the first one that is learned from, and after each change of the target: one for a lightly damped
///     loop. Call `update` for them too.
/// on_demand : bool
///     The motion is repeated on demand, from rest to rest. If not, one period follows the other. Where the target rests at its ends, up
///     to a tenth of it at each, the correction comes and goes smoothly: so nothing jumps there.
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
    fn new(
        #[py("ArrayLike")] target: &Bound<'_, PyAny>,
        #[py(*)] kp: f64,
        ki: f64,
        slope: f64,
        #[py("Dynamics")] dynamics: &Bound<'_, PyAny>,
        dt: f64,
        #[py(= None)] bandwidth: Option<f64>,
        #[py(= 0.0)] dead_time: f64,
        #[py("float" = 0.15)] min_gain: Option<&Bound<'_, PyAny>>,
        #[py("Sequence[float] | None" = None)] target_limits: Option<&Bound<'_, PyAny>>,
        #[py("AnyFilter | Sequence[AnyFilter]" = ())] filters: Option<&Bound<'_, PyAny>>,
        #[py(= None)] noise: Option<f64>,
        #[py("float" = 0.05)] frequency_uncertainty: Option<&Bound<'_, PyAny>>,
        #[py("float" = 2.0)] damping_uncertainty: Option<&Bound<'_, PyAny>>,
        #[py("float" = 1.0)] slope_uncertainty: Option<&Bound<'_, PyAny>>,
        #[py("int" = 0)] settle: Option<&Bound<'_, PyAny>>,
        #[py("bool" = false)] on_demand: OrDefault<'_>,
    ) -> PyResult<Self> {
        numbers!(min_gain);
        numbers!(frequency_uncertainty, damping_uncertainty, slope_uncertainty);
        let filters = filters.map_or(Ok(Sections::default()), |filters| sections(filters, dt))?;
        let feedback = FeedbackLoop { kp, ki, filters, slope, dynamics: linear_part(dynamics, dead_time)?, dt };
        let options = LearningOptions {
            bandwidth,
            min_gain: min_gain.unwrap_or(LearningOptions::default().min_gain),
            target_limits: target_limits.map(|target_limits| pair("target_limits", target_limits)).transpose()?,
            noise,
            uncertainty: uncertainty(frequency_uncertainty, damping_uncertainty, slope_uncertainty),
            settle: settle.map_or(Ok(0), |settle| whole("settle", settle))?,
            on_demand: on_demand.flag("on_demand")?,
        };
        Self::of(feedback, target, options)
    }

    /// One period of the target for the feed-forward, read-only.
    #[getter]
    fn target<'py>(&self, py: Python<'py>) -> Vector<'py> {
        read_only(py, self.learning.target().iter().copied())
    }

    /// What is added to the target with which learning began: for a reference that also drifts from period to period, as the slow
    /// axis of a raster does, add it to that. Read-only.
    #[getter]
    fn correction<'py>(&self, py: Python<'py>) -> Vector<'py> {
        read_only(py, self.learning.correction())
    }

    /// Whether learning has stopped by itself: five periods did not lower the error by a hundredth. The target is that of the best
    /// period then. Learning goes on when the error grows by a quarter.
    #[getter]
    fn finished(&self) -> bool {
        self.learning.is_finished()
    }

    /// Learns from the measured error of a period that was run with the present target; whether it was used, which it is not while the
    /// loop settles.
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

    fn __setstate__(slf: &Bound<'_, Self>, state: &Bound<'_, PyAny>) -> PyResult<()> {
        Self::set_state(slf, state)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> Reduced<'py> {
        let (py, this) = (slf.py(), shared(slf)?);
        let keywords = loop_keywords(py, &this.feedback)?;
        let LearningOptions { bandwidth, min_gain, target_limits, noise, uncertainty, settle, on_demand } =
            this.options;
        let options = keywords!(
            py,
            bandwidth = bandwidth,
            min_gain = min_gain,
            target_limits = target_limits,
            noise = noise,
            settle = settle,
            on_demand = on_demand
        );
        keywords.update(options.as_mapping())?;
        keywords.update(uncertainty_keywords(py, uncertainty)?.as_mapping())?;
        let first = PyArray1::from_slice(py, &this.first);
        reduce(py.get_type::<Self>().into_any(), (first,), keywords, Some(Self::state(slf)?))
    }

    fn __repr__(&self) -> String {
        let (samples, periods) = (self.first.len(), self.learning.trials().len());
        format!("<IterativeLearning of {samples} samples, {periods} periods so far>")
    }
}
