//! The hybrid controller: feed-forward and feedback, one sample in, one drive out.

use hysteresis_control::StageController;
use hysteresis_core::{self as core, ControllerOptions, Law, Mode};
use hysteresis_python_macros::methods;
use pyo3::prelude::*;
use pyo3::types::PyTuple;

use super::controller_options::{MODES, Windup, as_keywords, mode_name, mode_of};
use super::filters::{as_tuple, sections};
use super::observer::Observer;
use super::preview::Preview;
use super::repetitive::RepetitiveControl;
use super::source::{check_interval, source};
use super::terms::ControllerTerms;
use crate::convert::arguments::word;
use crate::convert::errors::raise;
use crate::convert::objects::{exclusive, shared};
use crate::convert::pickling::{Reduced, reduce};

/// Feed-forward and proportional-integral feedback within limits: equation (8) of the paper with its errata 10 to 12.
///
/// u(k) = H^-1[target(k)] + kp e(k) + ki dt (e(0) + ... + e(k)) + bumpless(k), e = F (reference - measurement) with the
/// filters F. The drive is always finite, within `limits`, and no farther than slew dt from the last one. A motion starts from the present drive, and
/// no change while it runs is a jump: `bumpless` takes the difference and goes to zero in a straight line.
///
/// A reference, target or feed-forward that is not finite (or beyond 1e100) repeats the last drive and is counted. So does a
/// measurement that is not finite, out of `measurement_range`, or farther than `max_measurement_step` from the last one;
/// after `max_missing` of these in a row feed-forward goes on alone, the integral frozen, until a plausible one returns. While
/// `bumpless` has not gone to zero since the drive was held last, the last error stands in: however many are lost,
/// the drive goes on.
///
/// Parameters
/// ----------
/// feedforward : Inverse, StageInverse, Forward, "given" or None
///     model.inverse(limits) or stage.inverse(dt), the exact inverse, with the limits of the controller; or model.forward() of
///     a model that is itself an inverse, um in and volts out (Table II, a closed form). The controller goes on with a copy,
///     memory included. "given": volts that come with every sample. None: feedback alone.
/// kp, ki : float
///     Gains in V/um and V/um/s. They are not negative, but for kp behind filters: that is active damping.
/// dt : float
///     The sampling interval in seconds.
/// limits : (low, high)
///     Of the drive, in volts.
/// slew : float, optional
///     How fast the drive may move, in V/s.
/// law : "positional" or "incremental"
///     Equation (8) as it must be meant; or from the last drive on, u += change of H^-1 + kp (change of e) + ki dt e, which
///     loses what a limit cuts off.
/// anti_windup : "conditional" or "back_calculation"
///     Of the positional law, for limits and slew: the integral takes no error that pushes a limited drive further; or it also
///     takes what was cut off, over `tracking_time` seconds (by default the integral time kp / ki).
/// tracking_time : float, optional
///     For back-calculation alone, in seconds.
/// bumpless_time : float
///     How long, in seconds, the difference at a start or a switch takes to go to zero. From a start on the integral rests for
///     that time.
/// max_missing : int
///     How many measurements in a row may be missing or implausible before feed-forward goes on alone. The first of them holds the
///     drive; where losses follow each other within `bumpless_time`, the last error stands in.
/// measurement_range : (low, high), optional
///     What the sensor can show.
/// max_measurement_step : float, optional
///     The largest plausible change from one measurement to the next. After k measurements in a row that could not be used,
///     k + 1 times as much is plausible; after `max_missing` of them the next finite one within `measurement_range` is taken,
///     wherever it is.
/// preview : Preview, optional
///     Makes the target of references that then come `preview.ahead` samples early.
/// start_drive : float, optional
///     The drive that the amplifier has at the start: by default zero or the limit nearest to it.
/// filters : Notch, LowPass, Lead, Biquad, or a list of them
///     F shapes the error before both gains. At most 6.
/// observer : Observer, optional
///     The feedback sees what it makes of measurement and drive. For up to `max_missing` measurements in a row that are missing or
///     implausible it stands in; they are counted all the same. The controller goes on with a copy, memory included. It keeps its model
///     when `set_model` changes that of the feed-forward, and takes the difference for a disturbance.
/// repetitive : RepetitiveControl, optional
///     Learns a correction of the target from the errors of the last period, while the feedback is on and no start or hold is still
///     under way. For a feed-forward that a target reaches. The controller goes on with a copy, whose filters stay those of the gains
///     that it was made for. If it diverges it stops and fades out: see `learning_phase` and `divergence_count`.
///
/// Raises
/// ------
/// ValueError, TypeError
///     That name the argument, what was expected and what came.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> model, limits = mh.paper.table_1_recovered(), (-500.0, 500.0)
/// >>> controller = mh.control.HybridController(model.inverse(limits), kp=5.0, ki=6e3, dt=1e-4, limits=limits)
/// >>> actuator, position = model.forward(), 0.0  # an ideal one: no dynamics, no noise
/// >>> for reference in mh.signals.sine(2.0, 10.0, seconds=0.2, rate=10_000):  # um
/// ...     position = actuator.step(controller.step(reference, position))
/// >>> abs(controller.terms.error) < 0.03  # one sample of motion: the measurement is the last one
/// True
/// >>> controller.hold = True
/// >>> controller.step(3.0, position) == controller.drive == controller.terms.drive
/// True
/// >>> controller.hold = False
/// >>> drive = controller.plan(3.0, position)  # changes nothing until it is committed
/// >>> controller.commit(), controller.drive == drive
/// (True, True)
#[pyclass(module = "mpi_hyst.control")]
pub(crate) struct HybridController {
    pub(crate) stage_controller: StageController,
    /// What the feed-forward, the preview, the observer and the learning were made of.
    pub(super) source: Option<Py<PyAny>>,
    pub(super) preview: Option<Py<Preview>>,
    pub(super) observer: Option<Py<Observer>>,
    pub(super) repetitive: Option<Py<RepetitiveControl>>,
}

impl HybridController {
    /// A controller with a copy of the feed-forward.
    pub(crate) fn of(
        feedforward: Option<&Bound<'_, PyAny>>,
        preview: Option<Py<Preview>>,
        options: &ControllerOptions,
    ) -> PyResult<Self> {
        let (feedforward, source) = source(feedforward, options.dt)?;
        check_interval("preview", preview.as_ref().and_then(|made| made.get().dt()), options.dt)?;
        let window = preview.as_ref().map(|made| made.get().preview.clone());
        let controller = core::HybridController::new(feedforward, window, options).map_err(raise)?;
        Ok(Self { stage_controller: controller.into(), source, preview, observer: None, repetitive: None })
    }

    /// Feed-forward and feedback, with what they offer to look at.
    pub(crate) fn controller(&self) -> &core::HybridController {
        self.stage_controller.controller()
    }

    pub(super) fn controller_mut(&mut self) -> &mut core::HybridController {
        self.stage_controller.controller_mut()
    }
}

#[methods]
impl HybridController {
    #[new]
    #[gather(options: ControllerOptions = ControllerOptions::new(kp, ki, dt, limits))]
    fn new<'py>(
        py: Python<'py>,
        #[py("FeedForward")] feedforward: Option<&Bound<'py, PyAny>>,
        #[py(*)] kp: f64,
        ki: f64,
        dt: f64,
        #[py("Sequence[float]")] limits: (f64, f64),
        #[py(field, = None)] slew: Option<f64>,
        #[py(field, "Literal['positional', 'incremental']" = "positional")] law: Law,
        #[py("Literal['conditional', 'back_calculation']" = "conditional")] anti_windup: Windup,
        #[py(= None)] tracking_time: Option<f64>,
        #[py(field, = 0.005)] bumpless_time: f64,
        #[py(field, = 10)] max_missing: u32,
        #[py(field, "Sequence[float] | None" = None)] measurement_range: Option<(f64, f64)>,
        #[py(field, = None)] max_measurement_step: Option<f64>,
        #[py(= None)] preview: Option<Bound<'py, Preview>>,
        #[py(field, = None)] start_drive: Option<f64>,
        #[py("AnyFilter | Sequence[AnyFilter]" = ())] filters: Option<Bound<'py, PyAny>>,
        #[py(= None)] observer: Option<Bound<'py, Observer>>,
        #[py(= None)] repetitive: Option<Bound<'py, RepetitiveControl>>,
    ) -> PyResult<Self> {
        let options = ControllerOptions {
            anti_windup: anti_windup.with(tracking_time)?,
            filters: filters.map_or(Ok(options.filters), |filters| sections(&filters, dt))?,
            ..options
        };
        let (observer, repetitive) = (observer.map(Bound::unbind), repetitive.map(Bound::unbind));
        Self::of(feedforward, preview.map(Bound::unbind), &options)?.with_parts(py, observer, repetitive)
    }

    /// The filters of the feedback, as sections.
    #[getter]
    #[py(-> "tuple[Biquad, ...]")]
    fn filters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        as_tuple(py, &self.controller().options().filters)
    }

    /// The preview, or None.
    #[getter]
    fn preview(&self, py: Python<'_>) -> Option<Py<Preview>> {
        self.preview.as_ref().map(|preview| preview.clone_ref(py))
    }

    /// The present drive in volts: what the amplifier has.
    #[getter]
    fn drive(&self) -> f64 {
        self.controller().drive()
    }

    /// What the last sample that was acted upon was made of.
    #[getter]
    fn terms(&self) -> ControllerTerms {
        self.controller().terms().into()
    }

    /// "run"; "feedforward": the proportional term is off, the integral is frozen and stays part of the drive; "hold": the
    /// drive stays and nothing advances; "stop", which `stop` begins. Set one of the first three at any time: no change of
    /// mode is a jump.
    #[getter]
    #[py(-> "Literal['run', 'feedforward', 'hold', 'stop']")]
    fn mode(&self) -> &'static str {
        mode_name(self.controller().mode())
    }

    #[setter]
    fn set_mode(
        slf: &Bound<'_, Self>,
        #[py("Literal['run', 'feedforward', 'hold']")] mode: &Bound<'_, PyAny>,
    ) -> PyResult<()> {
        let mode = mode_of("mode", &word("mode", MODES, mode)?)?;
        exclusive(slf)?.controller_mut().set_mode(mode).map_err(raise)
    }

    /// Whether the drive is held. An attribute: set it to True to hold, to False to go on in the mode before, also after a
    /// stop.
    #[getter]
    fn hold(&self) -> bool {
        self.controller().mode() == Mode::Hold
    }

    #[setter]
    fn set_hold(slf: &Bound<'_, Self>, hold: bool) -> PyResult<()> {
        if hold {
            exclusive(slf)?.controller_mut().hold();
        } else {
            exclusive(slf)?.controller_mut().release();
        }
        Ok(())
    }

    /// For how many seconds at most the drive is not yet that of the law, from the next sample on: until the window of the
    /// preview is full and the bumpless term is gone.
    #[getter]
    fn lead_in(&self) -> f64 {
        self.controller().lead_in()
    }

    /// The proportional gain in V/um.
    #[getter]
    fn kp(&self) -> f64 {
        self.controller().options().kp
    }

    /// The integral gain in V/um/s.
    #[getter]
    fn ki(&self) -> f64 {
        self.controller().options().ki
    }

    /// The limits of the drive (low, high) in volts.
    #[getter]
    fn limits(&self) -> (f64, f64) {
        self.controller().options().limits
    }

    /// The sampling interval in seconds.
    #[getter]
    fn dt(&self) -> f64 {
        self.controller().options().dt
    }

    /// How many references, targets or given feed-forwards were not finite, or beyond 1e100, or missing.
    #[getter]
    fn rejected_count(&self) -> u64 {
        self.controller().counters().rejected_count
    }

    /// How many measurements were not finite, or beyond 1e100.
    #[getter]
    fn missing_count(&self) -> u64 {
        self.controller().counters().missing_count
    }

    /// How many measurements were finite but out of their range, or too far from the last one.
    #[getter]
    fn implausible_count(&self) -> u64 {
        self.controller().counters().implausible_count
    }

    /// How many samples asked for a drive beyond the limits.
    #[getter]
    fn saturated_count(&self) -> u64 {
        self.controller().counters().saturated_count
    }

    /// How many samples asked for a faster move than the slew allows.
    #[getter]
    fn slewing_count(&self) -> u64 {
        self.controller().counters().slewing_count
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> Reduced<'py> {
        let (py, this) = (slf.py(), shared(slf)?);
        let keywords = as_keywords(py, this.controller().options())?;
        keywords.set_item("preview", &this.preview)?;
        keywords.set_item("observer", &this.observer)?;
        keywords.set_item("repetitive", &this.repetitive)?;
        let state = Self::state(slf)?;
        reduce(py.get_type::<Self>().into_any(), (&this.source,), keywords, Some(state))
    }

    fn __setstate__(slf: &Bound<'_, Self>, state: &Bound<'_, PyAny>) -> PyResult<()> {
        Self::set_state(slf, state)
    }

    fn __repr__(&self) -> String {
        let ControllerOptions { kp, ki, limits: (low, high), .. } = *self.controller().options();
        format!("<HybridController kp {kp}, ki {ki}, limits ({low}, {high}), mode {}>", self.mode())
    }
}
