//! Learning from periods that repeat.

use hysteresis_simulate::learning::{self, FeedbackLoop, LearningOptions, RepetitiveOptions};
use numpy::PyArray1;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arguments::{count, pair};
use crate::arrays::{read_only, vector};
use crate::errors;
use crate::linear::{given_dynamics, invalid};

type Vector<'py> = PyResult<Bound<'py, PyArray1<f64>>>;

/// The loop with other dynamics, slope or delay, where they are given.
fn truth(
    feedback: FeedbackLoop,
    dynamics: Option<&Bound<'_, PyAny>>,
    slope: Option<f64>,
    delay: Option<f64>,
) -> PyResult<FeedbackLoop> {
    Ok(FeedbackLoop {
        dynamics: dynamics.map(given_dynamics).transpose()?.unwrap_or(feedback.dynamics),
        slope: slope.unwrap_or(feedback.slope),
        delay: delay.unwrap_or(feedback.delay),
        ..feedback
    })
}

/// Iterative learning control of a periodic reference: after every period, a better target for the next one.
///
/// v <- Q (v + gamma L e), e = reference - measurement over a period, v the correction of the target of the feed-forward;
/// Q = 1 / (1 + (f / bandwidth)^4) has no phase; L = conj(M) / (|M|^2 + 0.05^2) inverts the response M of the feedback
/// loop to a correction, as far as it responds; gamma = 1 / j at the j-th period, at least `least_gain`. An error of twice
/// the best one is not learned from: the target goes back to the best.
///
/// Parameters
/// ----------
/// target : array of n floats
///     One period of the target: the reference, or what dynamic feed-forward makes of it.
/// kp, ki : float
///     Gains of the feedback, V/um and V/um/sample.
/// slope : float
///     Of the actuator where it works, um/V: between its w_0 and the sum of its weights.
/// dynamics : SecondOrder or FirstOrder
///     The linear dynamics behind the hysteresis.
/// bandwidth : float
///     Up to which frequency to learn, in Hz; a third of that of the dynamics is a good start.
/// delay : float
///     What the position lags besides, in samples.
/// dt : float
///     Sampling interval in seconds.
/// least_gain : float
///     gamma never falls below.
/// reach : (float, float), optional
///     The target never leaves (low, high).
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
/// >>> stage = mh.SecondOrder(400.0, 0.95)
/// >>> reference = np.sin(2 * np.pi * np.arange(100) / 100)
/// >>> learning = mh.IterativeLearning(
/// ...     reference, kp=0.0, ki=0.0, slope=1.0, dynamics=stage, bandwidth=1000.0, dt=1e-4
/// ... )
/// >>> for _ in range(4):
/// ...     position = stage.response(np.tile(learning.target, 3), dt=1e-4)[199:299]
/// ...     accepted = learning.update(reference - position)
/// >>> bool(learning.rmses[0] > 0.2), bool(learning.rmses[-1] < 1e-3), learning.rate() < 0.1
/// (True, True, True)
#[pyclass(module = "mpi_hyst")]
pub(crate) struct IterativeLearning {
    learning: learning::IterativeLearning,
    feedback: FeedbackLoop,
}

#[pymethods]
impl IterativeLearning {
    #[new]
    #[pyo3(signature = (target, *, kp, ki, slope, dynamics, bandwidth, delay=0.0, dt=1e-4, least_gain=0.15, reach=None))]
    #[expect(clippy::too_many_arguments, reason = "keywords in Python")]
    fn new(
        target: &Bound<'_, PyAny>,
        kp: f64,
        ki: f64,
        slope: f64,
        dynamics: &Bound<'_, PyAny>,
        bandwidth: f64,
        delay: f64,
        dt: f64,
        least_gain: f64,
        reach: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let feedback = FeedbackLoop { kp, ki, slope, dynamics: given_dynamics(dynamics)?, delay, dt };
        let reach = reach.map(|reach| pair("reach", reach)).transpose()?;
        let options = LearningOptions { bandwidth, least_gain, reach };
        let target = vector("target", target)?;
        let learning = learning::IterativeLearning::new(&feedback, target.as_slice()?, &options).map_err(invalid)?;
        Ok(Self { learning, feedback })
    }

    /// One period of the target for the feed-forward, read-only.
    #[getter]
    fn target<'py>(&self, py: Python<'py>) -> Vector<'py> {
        read_only(py, self.learning.target().iter().copied())
    }

    /// Learns from the measured error of a period that was run with the present target; whether it was learned from.
    fn update(&mut self, error: &Bound<'_, PyAny>) -> PyResult<bool> {
        let error = vector("error", error)?;
        Ok(self.learning.update(error.as_slice()?).map_err(errors::core)?.accepted)
    }

    /// The largest measured error of every period so far.
    #[getter]
    fn max_errors<'py>(&self, py: Python<'py>) -> Vector<'py> {
        read_only(py, self.learning.trials().iter().map(|trial| trial.max_error))
    }

    /// The root mean square of the measured error of every period so far.
    #[getter]
    fn rmses<'py>(&self, py: Python<'py>) -> Vector<'py> {
        read_only(py, self.learning.trials().iter().map(|trial| trial.rmse))
    }

    /// By how much the error of the slowest harmonic shrinks in a period at gain 1, the mean apart: max |Q (1 - L M')|.
    ///
    /// M' is the loop with what is given here instead of what learning believes. Below 1 learning converges.
    #[pyo3(signature = (*, dynamics=None, slope=None, delay=None))]
    fn rate(&self, dynamics: Option<&Bound<'_, PyAny>>, slope: Option<f64>, delay: Option<f64>) -> PyResult<f64> {
        self.learning.rate(&truth(self.feedback, dynamics, slope, delay)?).map_err(invalid)
    }
}

/// Repetitive control: the correction of the target, learned in the running loop, one period later.
///
/// v(k) = sum_i q_i v(k - N + i) + gain sum_i l_i e(k - N + i) - mean of v, i = -m..m: Q and L of `IterativeLearning` as
/// finite impulse responses around the present place of the last period of N samples. The static error is left to a
/// feedback that integrates.
///
/// Parameters
/// ----------
/// period : int
///     Samples in a period of the reference, 8 to 2^22.
/// kp, ki, slope, dynamics, bandwidth, delay, dt
///     As for `IterativeLearning`.
/// gain : float
///     gamma, above 0 and at most 1: less averages noise over more periods.
/// settle : int
///     Periods that pass before the first one that is learned from.
/// limit : float
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
/// >>> repetitive = mh.RepetitiveControl(
/// ...     100, kp=0.0, ki=0.0, slope=1.0, dynamics=mh.FirstOrder(50.0), bandwidth=100.0, dt=1e-3
/// ... )
/// >>> y, decay, errors = 0.0, math.exp(-2 * math.pi * 50.0 * 1e-3), []
/// >>> for k in range(3000):
/// ...     errors.append(math.sin(2 * math.pi * k / 100) - y)
/// ...     target = y + errors[-1] + repetitive.step(errors[-1])
/// ...     y = target + decay * (y - target)
/// >>> max(errors[:100]) > 0.1, max(errors[-100:]) < 2e-3
/// (True, True)
#[pyclass(module = "mpi_hyst")]
pub(crate) struct RepetitiveControl {
    pub(crate) control: learning::RepetitiveControl,
    feedback: FeedbackLoop,
}

#[pymethods]
impl RepetitiveControl {
    #[new]
    #[pyo3(signature = (
        period, *, kp, ki, slope, dynamics, bandwidth, delay=0.0, dt=1e-4, gain=0.3, settle=1, limit=f64::INFINITY
    ), text_signature = "(period, *, kp, ki, slope, dynamics, bandwidth, delay=0.0, dt=0.0001, gain=0.3, settle=1, \
        limit=inf)")]
    #[expect(clippy::too_many_arguments, reason = "keywords in Python")]
    fn new(
        period: &Bound<'_, PyAny>,
        kp: f64,
        ki: f64,
        slope: f64,
        dynamics: &Bound<'_, PyAny>,
        bandwidth: f64,
        delay: f64,
        dt: f64,
        gain: f64,
        settle: i64,
        limit: f64,
    ) -> PyResult<Self> {
        let feedback = FeedbackLoop { kp, ki, slope, dynamics: given_dynamics(dynamics)?, delay, dt };
        let settle = usize::try_from(settle).map_err(|_| {
            PyValueError::new_err(format!("settle: expected a whole number of periods >= 0, got {settle}"))
        })?;
        let options = RepetitiveOptions { bandwidth, gain, settle, limit };
        let control = learning::RepetitiveControl::new(&feedback, count("period", period)?, &options);
        Ok(Self { control: control.map_err(invalid)?, feedback })
    }

    /// Takes the measured error of this sample and returns the correction of this sample's target.
    fn step(&mut self, error: f64) -> f64 {
        self.control.step(error)
    }

    /// Forgets everything learned.
    fn reset(&mut self) {
        self.control.reset();
    }

    /// Samples in a period.
    #[getter]
    fn period(&self) -> usize {
        self.control.period()
    }

    /// How many errors were not finite: they teach nothing.
    #[getter]
    fn rejected(&self) -> u64 {
        self.control.rejected()
    }

    /// By how much the error shrinks in a period at the worst frequency from the first harmonic up: max |Q - gain L M'|.
    ///
    /// M' is the loop with what is given here instead of what is believed. Below 1 the loop is stable with learning.
    #[pyo3(signature = (*, dynamics=None, slope=None, delay=None))]
    fn rate(&self, dynamics: Option<&Bound<'_, PyAny>>, slope: Option<f64>, delay: Option<f64>) -> PyResult<f64> {
        self.control.rate(&truth(self.feedback, dynamics, slope, delay)?).map_err(invalid)
    }
}
