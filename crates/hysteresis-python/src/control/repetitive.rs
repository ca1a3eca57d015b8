//! Learning in the running loop, one period later.

use hysteresis_control::learning::{self, FeedbackLoop, RepetitiveOptions};
use hysteresis_core::Sections;
use hysteresis_python_macros::methods;
use pyo3::prelude::*;
use pythonize::pythonize;

use super::feedback_loop::{linear_part, loop_keywords, truth, uncertainty, uncertainty_keywords};
use super::filters::sections;
use crate::argument::Class;
use crate::convert::arguments::{count, numbers, whole};
use crate::convert::errors::raise;
use crate::convert::objects::{exclusive, shared};
use crate::convert::pickling::{Reduced, keywords, reduce, saved};

/// Repetitive control: the correction of the target, learned in the running loop, one period later.
///
/// v(k) = sum_i q_i v(k - N + i) + gain sum_i l_i e(k - N + i) - mean of v, i = -m..m: the filters Q = 1 / (1 + (f / bandwidth)^4)
/// and L = conj(M) / (|M|^2 + P + 0.05^2) as finite impulse responses around the present place of the last period of N samples. M is
/// the response of the loop to a correction, P its variance over what the loop may be. The static error is left to a feedback that
/// integrates.
///
/// Where the loop is too far from the model, learning diverges: the error grows from period to period. It is told by the root mean square
/// of the error in a period, or in as many as make 64 samples. Above three times the best (four together) each that is larger than the
/// one before counts once, by a half or more twice; a smaller one counts back. At five counts, or where such an error has grown by a half
/// beyond half the swing of the reference, learning stops and fades out within one period. What changes of the reference explain does
/// not count. Noise or vibration that stays above three times the best error for long may come to five counts by chance.
///
/// Parameters
/// ----------
/// period : int
///     Samples in a period of the reference, 8 to 2^22.
/// kp, ki, slope, dynamics, dt, dead_time, filters, frequency_uncertainty, damping_uncertainty, slope_uncertainty
///     As for `IterativeLearning`.
/// bandwidth : float, optional
///     Up to which frequency to learn, in Hz. Without one, as far as learning converges on every loop that the true one may be.
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
    fn new(
        #[py("int")] period: &Bound<'_, PyAny>,
        #[py(*)] kp: f64,
        ki: f64,
        slope: f64,
        #[py("Dynamics")] dynamics: &Bound<'_, PyAny>,
        dt: f64,
        #[py(= None)] bandwidth: Option<f64>,
        #[py(= 0.0)] dead_time: f64,
        #[py("float" = 0.3)] gain: Option<&Bound<'_, PyAny>>,
        #[py("int" = 1)] settle: Option<&Bound<'_, PyAny>>,
        #[py(= None)] limit: Option<f64>,
        #[py("AnyFilter | Sequence[AnyFilter]" = ())] filters: Option<&Bound<'_, PyAny>>,
        #[py("float" = 0.05)] frequency_uncertainty: Option<&Bound<'_, PyAny>>,
        #[py("float" = 2.0)] damping_uncertainty: Option<&Bound<'_, PyAny>>,
        #[py("float" = 1.0)] slope_uncertainty: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        numbers!(gain);
        numbers!(frequency_uncertainty, damping_uncertainty, slope_uncertainty);
        let filters = filters.map_or(Ok(Sections::default()), |filters| sections(filters, dt))?;
        let feedback = FeedbackLoop { kp, ki, filters, slope, dynamics: linear_part(dynamics, dead_time)?, dt };
        let default = RepetitiveOptions::default();
        let options = RepetitiveOptions {
            bandwidth,
            gain: gain.unwrap_or(default.gain),
            settle: settle.map_or(Ok(default.settle), |settle| whole("settle", settle))?,
            limit,
            uncertainty: uncertainty(frequency_uncertainty, damping_uncertainty, slope_uncertainty),
        };
        Self::of(feedback, count("period", period)?, options)
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

    /// "learning"; "fading": what was learned goes to zero; "stopped": learning has diverged, and corrects nothing until `restart`.
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

    /// Learns anew: at once after it has stopped, else as soon as what was learned has faded out, so that nothing jumps.
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

    /// By how much the error shrinks in a period at the worst frequency from the first harmonic up: max |Q - gain L M'|.
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

    fn __setstate__(slf: &Bound<'_, Self>, state: &Bound<'_, PyAny>) -> PyResult<()> {
        Self::set_state(slf, state)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> Reduced<'py> {
        let (py, this) = (slf.py(), shared(slf)?);
        let keywords = loop_keywords(py, &this.feedback)?;
        let RepetitiveOptions { bandwidth, gain, settle, limit, uncertainty } = this.options;
        let options = keywords!(py, bandwidth = bandwidth, gain = gain, settle = settle, limit = limit);
        keywords.update(options.as_mapping())?;
        keywords.update(uncertainty_keywords(py, uncertainty)?.as_mapping())?;
        reduce(py.get_type::<Self>().into_any(), (this.period(),), keywords, Some(Self::state(slf)?))
    }

    fn __repr__(&self) -> String {
        format!("<RepetitiveControl of {} samples, gain {}>", self.period(), self.options.gain)
    }
}
