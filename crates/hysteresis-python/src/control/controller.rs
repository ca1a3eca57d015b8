//! The hybrid controller: feed-forward and feedback, one sample in, one drive out.

use hysteresis_control::binary::Binary;
use hysteresis_control::{StageController, learning};
use hysteresis_core::{self as core, AntiWindup, Command, ControllerOptions, Law, Mode};
use hysteresis_python_macros::methods;
use numpy::PyArray1;
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyTuple};
use pythonize::pythonize;

use crate::argument::Words;
use crate::control::filters::{Filters, as_tuple};
use crate::control::inverse_dynamics::Preview;
use crate::control::learning::RepetitiveControl;
use crate::control::observer::Observer;
use crate::control::shared_by_controllers::{ControllerTerms, check_interval, mode_name, plain_state, source};
use crate::convert::arrays::vector;
use crate::convert::errors::{self, raise};
use crate::convert::objects::{Reduced, bytes_of, exclusive, keywords, reduce, shared};
use crate::model::models::compiled_of;
use crate::stream::blocks::run_both;

/// Feed-forward and proportional-integral feedback within limits: equation (8) of the paper with its errata 10 to 12.
///
/// u(k) = H^-1[target(k)] + kp e(k) + ki dt (e(0) + ... + e(k)) + bumpless(k), e = F (reference - measurement) with the
/// filters F. The drive is always finite, within `limits`, and no farther than slew dt from the last one. A motion
/// starts from the present drive, and no change while it runs is a jump: `bumpless` takes the difference and goes to
/// zero in a straight line.
///
/// A reference, target or feed-forward that is not finite (or beyond 1e100) repeats the last drive and is counted. So
/// does a measurement that is not finite, out of `measurement_range`, or farther than `max_measurement_step` from the
/// last one; after `max_missing` of these in a row feed-forward goes on alone, the integral frozen, until a plausible
/// one returns. While `bumpless` has not gone to zero since the drive was held last, the last error stands in: however
/// many are lost, the drive goes on.
///
/// Parameters
/// ----------
/// feedforward : Inverse, StageInverse, Forward, "given" or None
///     model.inverse(limits) or stage.inverse(dt), the exact inverse, with the limits of the controller; or
///     model.forward() of a model that is itself an inverse, um in and volts out (Table II, a closed form). The
///     controller goes on with a copy, memory included. "given": volts that come with every sample. None: feedback
///     alone.
/// kp, ki : float
///     Gains in V/um and V/um/s. They are not negative, but for kp behind filters: that is active damping.
/// dt : float
///     The sampling interval in seconds.
/// limits : (low, high)
///     Of the drive, in volts.
/// slew : float, optional
///     How fast the drive may move, in V/s.
/// law : "positional" or "incremental"
///     Equation (8) as it must be meant; or from the last drive on, u += change of H^-1 + kp (change of e) + ki dt e,
///     which loses what a limit cuts off.
/// anti_windup : "conditional" or "back_calculation"
///     Of the positional law, for limits and slew: the integral takes no error that pushes a limited drive further; or
///     it also takes what was cut off, over `tracking_time` seconds (by default the integral time kp / ki).
/// tracking_time : float, optional
///     For back-calculation alone, in seconds.
/// bumpless_time : float
///     How long, in seconds, the difference at a start or a switch takes to go to zero. From a start on the integral
///     rests for that time.
/// max_missing : int
///     How many measurements in a row may be missing or implausible before feed-forward goes on alone. The first of
///     them holds the drive; where losses follow each other within `bumpless_time`, the last error stands in.
/// measurement_range : (low, high), optional
///     What the sensor can show.
/// max_measurement_step : float, optional
///     The largest plausible change from one measurement to the next. After k measurements in a row that could not be
///     used, k + 1 times as much is plausible; after `max_missing` of them the next finite one within
///     `measurement_range` is taken, wherever it is.
/// preview : Preview, optional
///     Makes the target of references that then come `preview.ahead` samples early.
/// start_drive : float, optional
///     The drive that the amplifier has at the start: by default zero or the limit nearest to it.
/// filters : Notch, LowPass, Lead, Biquad, or a list of them
///     F shapes the error before both gains. At most 6.
/// observer : Observer, optional
///     The feedback sees what it makes of measurement and drive. For up to `max_missing` measurements in a row that are
///     missing or implausible it stands in; they are counted all the same. The controller goes on with a copy, memory
///     included. It keeps its model when `set_model` changes that of the feed-forward, and takes the difference for a
///     disturbance.
/// repetitive : RepetitiveControl, optional
///     Learns a correction of the target from the errors of the last period, while the feedback is on and no start or
///     hold is still under way. For a feed-forward that a target reaches. The controller goes on with a copy, whose
///     filters stay those of the gains that it was made for. If it diverges it stops and fades out: see
///     `learning_phase` and `divergence_count`.
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
    #[gather(options: ControllerOptions = ControllerOptions::new(kp, ki, dt, limits), put_options)]
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
        #[py(= ())] filters: Filters,
        #[py(= None)] observer: Option<Bound<'py, Observer>>,
        #[py(= None)] repetitive: Option<Bound<'py, RepetitiveControl>>,
    ) -> PyResult<Self> {
        let options = ControllerOptions {
            anti_windup: anti_windup.with(tracking_time)?,
            filters: filters.sections(dt)?,
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

    /// "run"; "feedforward": the proportional term is off, the integral is frozen and stays part of the drive; "hold":
    /// the drive stays and nothing advances; "stop", which `stop` begins. Set one of the first three at any time: no
    /// change of mode is a jump.
    #[getter]
    #[py(-> "Literal['run', 'feedforward', 'hold', 'stop']")]
    fn mode(&self) -> &'static str {
        mode_name(self.controller().mode())
    }

    #[setter]
    fn set_mode(slf: &Bound<'_, Self>, mode: Mode) -> PyResult<()> {
        exclusive(slf)?.controller_mut().set_mode(mode).map_err(raise)
    }

    /// Whether the drive is held. An attribute: set it to True to hold, to False to go on in the mode before, also
    /// after a stop.
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

    /// For how many seconds at most the drive is not yet that of the law, from the next sample on: until the window of
    /// the preview is full and the bumpless term is gone.
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
        let options = this.controller().options();
        let (anti_windup, tracking_time) = match options.anti_windup {
            AntiWindup::Conditional => (Windup::Conditional, None),
            AntiWindup::BackCalculation { tracking_time } => (Windup::BackCalculation, tracking_time),
        };
        let keywords = keywords!(
            py,
            kp = options.kp,
            ki = options.ki,
            dt = options.dt,
            limits = options.limits,
            anti_windup = anti_windup.word(),
            tracking_time = tracking_time,
            filters = as_tuple(py, &options.filters)?,
            preview = &this.preview,
            observer = &this.observer,
            repetitive = &this.repetitive,
        );
        Self::put_options(options, &keywords)?;
        let state = Self::state(slf)?;
        reduce(py.get_type::<Self>().into_any(), (&this.source,), keywords, Some(state))
    }

    fn __repr__(&self) -> String {
        let ControllerOptions { kp, ki, limits: (low, high), .. } = *self.controller().options();
        format!("<HybridController kp {kp}, ki {ki}, limits ({low}, {high}), mode {}>", self.mode())
    }
}

impl Words for Law {
    const WORDS: &'static [(&'static str, Self)] =
        &[("positional", Self::Positional), ("incremental", Self::Incremental)];
}

/// The word for a way against wind-up; the tracking time belongs to one of them.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Windup {
    Conditional,
    BackCalculation,
}

impl Words for Windup {
    const WORDS: &'static [(&'static str, Self)] =
        &[("conditional", Self::Conditional), ("back_calculation", Self::BackCalculation)];
}

impl Windup {
    pub(super) fn with(self, tracking_time: Option<f64>) -> PyResult<AntiWindup> {
        match (self, tracking_time) {
            (Self::Conditional, None) => Ok(AntiWindup::Conditional),
            (Self::Conditional, Some(time)) => {
                let expected = "None unless anti_windup=\"back_calculation\"";
                Err(errors::value("tracking_time", format_args!("expected {expected}, got {time:?}")))
            }
            (Self::BackCalculation, tracking_time) => Ok(AntiWindup::BackCalculation { tracking_time }),
        }
    }
}

impl HybridController {
    /// With copies of an observer before the feedback and of learning before the feed-forward.
    pub(crate) fn with_parts(
        mut self,
        py: Python<'_>,
        observer: Option<Py<Observer>>,
        repetitive: Option<Py<RepetitiveControl>>,
    ) -> PyResult<Self> {
        let observer = observer.map(|given| Py::new(py, shared(given.bind(py))?.clone())).transpose()?;
        let repetitive = repetitive.map(|given| Py::new(py, shared(given.bind(py))?.clone())).transpose()?;
        if let Some(own) = &observer {
            let copy = own.borrow(py).observer.clone();
            self.stage_controller = self.stage_controller.with_observer(copy).map_err(raise)?;
        }
        if let Some(own) = &repetitive {
            let copy = own.borrow(py).control.clone();
            self.stage_controller = self.stage_controller.with_repetitive(copy).map_err(raise)?;
        }
        (self.observer, self.repetitive) = (observer, repetitive);
        Ok(self)
    }

    /// Whether its state is that of a controller alone.
    fn is_plain(&self) -> bool {
        self.observer.is_none() && self.repetitive.is_none()
    }
}

#[methods]
impl HybridController {
    /// The observer before the feedback, as a copy in its present state, or None. It has taken the present drive.
    #[getter]
    fn observer(&self, py: Python<'_>) -> Option<Observer> {
        let (made, now) = (self.observer.as_ref()?, self.stage_controller.observer()?);
        Some(Observer { observer: now.clone(), ..made.borrow(py).clone() })
    }

    /// Learning in the loop, as a copy in its present state, or None.
    #[getter]
    fn repetitive(&self, py: Python<'_>) -> Option<RepetitiveControl> {
        let (made, now) = (self.repetitive.as_ref()?, self.stage_controller.repetitive()?);
        Some(RepetitiveControl { control: now.clone(), ..made.borrow(py).clone() })
    }

    /// "learning"; "fading": what was learned goes to zero; "stopped": learning has diverged, and corrects nothing
    /// until `restart_learning` or `reset`. None without learning.
    #[getter]
    #[py(-> "LearningPhase | None")]
    fn learning_phase(&self) -> Option<&'static str> {
        self.stage_controller.repetitive().map(|repetitive| repetitive.phase().name())
    }

    /// How often learning has diverged: the error grew from period to period, on a stage that is too far from the
    /// model. It has stopped and faded out then.
    #[getter]
    fn divergence_count(&self) -> u64 {
        self.stage_controller.repetitive().map_or(0, learning::RepetitiveControl::divergence_count)
    }

    /// Lets learning begin anew: at once after it has stopped, else as soon as what was learned has faded out, so that
    /// nothing jumps.
    ///
    /// Raises ValueError for a controller that does not learn.
    fn restart_learning(slf: &Bound<'_, Self>) -> PyResult<()> {
        let learns = exclusive(slf)?.stage_controller.restart_learning();
        if learns { Ok(()) } else { Err(errors::value("repetitive", "expected a controller that learns, got None")) }
    }

    /// Measurements outside this range (low, high) are not believed, and counted in `implausible_count`; None without
    /// such a gate.
    #[getter]
    fn measurement_range(&self) -> Option<(f64, f64)> {
        self.controller().options().measurement_range
    }

    /// The largest change of the measurement from one sample to the next; None without such a gate. What is farther
    /// from the last good one is not believed, and counted in `implausible_count`; after `max_missing` in a row that
    /// were no good, and at least one, the next one is taken.
    #[getter]
    fn max_measurement_step(&self) -> Option<f64> {
        self.controller().options().max_measurement_step
    }
}

#[methods]
impl HybridController {
    /// Takes a sample and returns the drive in volts.
    ///
    /// `reference` and `measurement` in um, with a preview the reference of `preview.ahead` samples later;
    /// `feedforward`: volts that replace the output of the source, which follows the target all the same; `target`:
    /// what the feed-forward is to reach, if not the reference or what the preview makes of it; `correction`: what is
    /// added to that, as `IterativeLearning.correction`.
    fn step(
        slf: &Bound<'_, Self>,
        reference: f64,
        measurement: f64,
        #[py(= None)] feedforward: Option<f64>,
        #[py(*, = None)] target: Option<f64>,
        #[py(not_none = 0.0)] correction: f64,
    ) -> PyResult<f64> {
        let command = command(reference, feedforward, target, correction);
        Ok(exclusive(slf)?.stage_controller.step(command, measurement))
    }

    /// Takes arrays of references and measurements, bit for bit like `step` in a loop; returns the drives, in `out` or
    /// a new array.
    fn run<'py>(
        slf: &Bound<'py, Self>,
        #[py("ArrayLike")] references: &Bound<'py, PyAny>,
        #[py("ArrayLike")] measurements: &Bound<'py, PyAny>,
        #[py("Vector | None" = None)] out: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        run_both(slf, [("references", references), ("measurements", measurements)], out, |this, x, y, drives| {
            this.stage_controller.run(x, y, drives)
        })
    }

    /// The drive that `step` would return, without taking the sample.
    #[like(step)]
    fn peek(slf: &Bound<'_, Self>) -> PyResult<f64> {
        let command = command(reference, feedforward, target, correction);
        Ok(shared(slf)?.stage_controller.peek(command, measurement))
    }

    /// The drive for a sample, which only `commit` takes: write it to the amplifier between the two, and if that fails,
    /// leave it; memory and terms are still those of the drive that is there.
    ///
    /// A plan replaces the one before; any change of the controller drops it.
    #[like(step)]
    fn plan(slf: &Bound<'_, Self>) -> PyResult<f64> {
        let command = command(reference, feedforward, target, correction);
        Ok(exclusive(slf)?.stage_controller.plan(command, measurement))
    }

    /// Takes the sample that was planned; False if there is none.
    fn commit(slf: &Bound<'_, Self>) -> PyResult<bool> {
        Ok(exclusive(slf)?.stage_controller.commit())
    }
}

#[inline]
fn command(reference: f64, feedforward: Option<f64>, target: Option<f64>, correction: f64) -> Command {
    Command { target, correction, feedforward, ..reference.into() }
}

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
    fn set_filters(slf: &Bound<'_, Self>, filters: Filters) -> PyResult<()> {
        let mut this = exclusive(slf)?;
        let sections = filters.sections(this.controller().options().dt)?;
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

    /// Goes on with another feed-forward (as at construction) without a jump. While a motion is under way the new
    /// stream first moves to the last target; a change to "given" repeats the drive for one sample.
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

    /// Back to the start, in mode "run", with the memory of the feed-forward at rest and all counters at zero. The
    /// drive stays as it is, or is `drive` if the amplifier has another one now.
    fn reset(slf: &Bound<'_, Self>, #[py(= None)] drive: Option<f64>) -> PyResult<()> {
        exclusive(slf)?.stage_controller.reset(drive).map_err(raise)
    }

    /// Ramps the drive to `rest_drive` (V) at `rate` (V/s), or at the slew if that is slower, and holds it there.
    ///
    /// From the next sample on every `step` puts out the next drive of the ramp, for any reference and measurement.
    /// `hold = False` starts a motion from the drive that is reached then.
    fn stop(slf: &Bound<'_, Self>, rate: f64, #[py(= 0.0)] rest_drive: f64) -> PyResult<()> {
        exclusive(slf)?.controller_mut().stop(rate, rest_drive).map_err(raise)
    }

    /// Takes over what was driven before, oldest drive first, one per sampling interval; the next motion starts from
    /// the last.
    fn follow(slf: &Bound<'_, Self>, #[py("ArrayLike")] drives: &Bound<'_, PyAny>) -> PyResult<()> {
        let drives = vector("drives", drives)?;
        exclusive(slf)?.stage_controller.follow(drives.as_slice()?).map_err(raise)
    }

    /// Goes on from another drive that the amplifier has, with everything that is remembered.
    ///
    /// For a state that was loaded into a controller whose amplifier is not at its drive: the next motion starts from
    /// there.
    fn start_at(slf: &Bound<'_, Self>, drive: f64) -> PyResult<()> {
        exclusive(slf)?.stage_controller.start_at(drive).map_err(raise)
    }

    /// Everything that the controller remembers, as a dictionary to keep; set it to continue from there bit for bit.
    /// The amplifier must be at its drive. A controller with other gains, dt or limits refuses it; the model is not
    /// part of it.
    #[getter]
    #[py(-> "dict[str, Any]")]
    pub(super) fn state<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let (state, is_plain) = shared(slf).map(|this| (this.stage_controller.state(), this.is_plain()))?;
        Ok(if is_plain { pythonize(slf.py(), &state.controller) } else { pythonize(slf.py(), &state) }?)
    }

    /// What `state` says, as bytes: `state` takes them too.
    fn state_bytes<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyBytes>> {
        let (state, is_plain) = shared(slf).map(|this| (this.stage_controller.state(), this.is_plain()))?;
        Ok(PyBytes::new(slf.py(), &if is_plain { state.controller.to_bytes() } else { state.to_bytes() }))
    }

    #[setter]
    pub(super) fn set_state(
        slf: &Bound<'_, Self>,
        #[py("dict[str, Any] | bytes")] state: &Bound<'_, PyAny>,
    ) -> PyResult<()> {
        if shared(slf)?.is_plain() {
            let state = bytes_of(state).unwrap_or_else(|| plain_state(state))?;
            return exclusive(slf)?.controller_mut().set_state(&state).map_err(raise);
        }
        let state = bytes_of(state).unwrap_or_else(|| plain_state(state))?;
        exclusive(slf)?.stage_controller.set_state(&state).map_err(raise)
    }
}
