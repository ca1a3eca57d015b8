//! The hybrid controller: feed-forward and feedback, one sample in, one drive out.

use std::ffi::CString;

use hysteresis_core::{self as core, AntiWindup, Command, ControllerOptions, FeedForward, Law, Mode};
use pyo3::exceptions::PyUserWarning;
use pyo3::prelude::*;
use pythonize::{depythonize, pythonize};

use super::preview::Preview;
use super::terms::ControllerTerms;
use crate::convert::arguments::{is_word, numbers, pair, whole};
use crate::convert::errors::{self, raise, unexpected};
use crate::convert::objects::{exclusive, shared};
use crate::model::object::{kernel, kernel_of};
use crate::stream::streams::{Forward, Inverse};

/// Feed-forward and proportional-integral feedback within limits: equation (8) with errata 10 to 12.
///
/// u(k) = H^-1[target(k)] + kp e(k) + ki (e(0) + ... + e(k)) + transition(k), e = reference - measurement. The drive is
/// finite, within `limits` and no farther than slew dt from the last one, whatever comes. A motion starts from the present
/// drive, and switches while it runs are no jumps: `transition` takes the difference and goes down to nothing.
///
/// A reference, target or feed-forward that is not finite (or beyond 1e100) holds the drive and is counted in `rejected`. A
/// measurement that is not finite does so too (`missing`); after `max_missing` in a row feed-forward goes on alone, the
/// integral frozen, until a measurement returns.
///
/// Parameters
/// ----------
/// feedforward : Inverse, Forward, "given" or None
///     model.inverse(limits), the exact inverse, with the limits of the controller; or model.forward() of a model that is
///     itself an inverse, um in and volts out (Table II, a closed form). The controller goes on with a copy, memory
///     included. "given": volts that come with every sample. None: feedback alone.
/// kp, ki : float
///     Gains in V/um and V/um/sample, not negative.
/// dt : float
///     The sampling interval in seconds.
/// limits : (low, high)
///     Of the drive, in volts.
/// slew : float, optional
///     How fast the drive may move, in V/s.
/// law : "positional", "incremental" or "printed"
///     Equation (8) as it must be meant; from the last drive on, u += change of H^-1 + kp (change of e) + ki e, which loses
///     what a limit cuts off; or as printed, u += H^-1 + kp (change of e) + ki e, which runs to the rail within some 25
///     samples and is for comparison only (a UserWarning says so).
/// anti_windup : "conditional" or "back_calculation"
///     Of the positional law, for limits and slew: the sum takes no error that pushes a limited drive further; or it also
///     takes what was cut off, over `tracking_time` seconds (by default the integral time kp / ki samples).
/// transition : float
///     How long it takes, in seconds, until the difference at a start or a switch is gone, in a straight line. From a
///     start on the integral rests for that time.
/// max_missing : int
///     How many measurements in a row may be missing before feed-forward goes on alone.
/// preview : Preview, optional
///     Makes the target of references that then come `preview.ahead` samples early.
/// start_drive : float, optional
///     The drive that the amplifier has at the start: by default zero or the limit nearest to it.
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
/// >>> controller = mh.control.HybridController(model.inverse(limits), kp=5.0, ki=0.6, limits=limits)
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
pub(crate) struct HybridController(pub(crate) core::HybridController);

/// The source of the feed-forward, as a copy.
fn source(value: Option<&Bound<'_, PyAny>>) -> PyResult<FeedForward> {
    let Some(value) = value else { return Ok(FeedForward::None) };
    if let Ok(stream) = value.cast::<Inverse>() {
        return Ok(shared(stream)?.stream.clone().into());
    }
    if let Ok(stream) = value.cast::<Forward>() {
        return Ok(shared(stream)?.stream.clone().into());
    }
    if is_word(value, "given") {
        return Ok(FeedForward::Given);
    }
    let expected = if kernel(value).is_some() {
        "model.inverse(limits) of an actuator's model, or model.forward() of a model that is itself an inverse"
    } else {
        "model.inverse(limits), model.forward(), \"given\" or None"
    };
    Err(unexpected("feedforward", expected, value))
}

fn unknown<T>(name: &str, expected: &str, got: &str) -> PyResult<T> {
    Err(errors::value(name, format_args!("expected {expected}, got \"{got}\"")))
}

fn law(name: &str) -> PyResult<Law> {
    match name {
        "positional" => Ok(Law::Positional),
        "incremental" => Ok(Law::Incremental),
        "printed" => Ok(Law::Printed),
        _ => unknown("law", "\"positional\", \"incremental\" or \"printed\"", name),
    }
}

fn anti_windup(name: &str, tracking_time: Option<f64>) -> PyResult<AntiWindup> {
    match (name, tracking_time) {
        ("conditional", None) => Ok(AntiWindup::Conditional),
        ("conditional", Some(time)) => {
            let expected = "None unless anti_windup=\"back_calculation\"";
            Err(errors::value("tracking_time", format_args!("expected {expected}, got {time:?}")))
        }
        ("back_calculation", tracking_time) => Ok(AntiWindup::BackCalculation { tracking_time }),
        _ => unknown("anti_windup", "\"conditional\" or \"back_calculation\"", name),
    }
}

fn mode_name(mode: Mode) -> &'static str {
    match mode {
        Mode::Run => "run",
        Mode::Feedforward => "feedforward",
        Mode::Hold => "hold",
    }
}

fn warn_of(py: Python<'_>, law: Law) -> PyResult<()> {
    if law.is_sound() {
        return Ok(());
    }
    let message = "law=\"printed\" sums up the feed-forward and runs to the rail (erratum 10): for comparison only";
    PyErr::warn(py, &py.get_type::<PyUserWarning>(), &CString::new(message)?, 1)
}

#[pymethods]
impl HybridController {
    #[new]
    #[pyo3(signature = (feedforward, *, kp, ki, dt=None, limits, slew=None, law="positional", anti_windup="conditional",
        tracking_time=None, transition=None, max_missing=None, preview=None, start_drive=None),
        text_signature = "(feedforward, *, kp, ki, dt=0.0001, limits, slew=None, law='positional', \
        anti_windup='conditional', tracking_time=None, transition=0.005, max_missing=10, preview=None, start_drive=None)")]
    #[expect(clippy::too_many_arguments, reason = "keyword arguments of Python")]
    fn new(
        py: Python<'_>,
        feedforward: Option<&Bound<'_, PyAny>>,
        kp: &Bound<'_, PyAny>,
        ki: &Bound<'_, PyAny>,
        dt: Option<&Bound<'_, PyAny>>,
        limits: &Bound<'_, PyAny>,
        slew: Option<&Bound<'_, PyAny>>,
        law: &str,
        anti_windup: &str,
        tracking_time: Option<&Bound<'_, PyAny>>,
        transition: Option<&Bound<'_, PyAny>>,
        max_missing: Option<&Bound<'_, PyAny>>,
        preview: Option<&Preview>,
        start_drive: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        numbers!(kp, ki, dt, slew, tracking_time, transition, start_drive);
        let (source, law) = (source(feedforward)?, self::law(law)?);
        let anti_windup = self::anti_windup(anti_windup, tracking_time)?;
        let mut options = ControllerOptions::new(kp, ki, pair("limits", limits)?);
        if let Some(number) = max_missing {
            options.max_missing = whole("max_missing", number)?;
        }
        options.dt = dt.unwrap_or(options.dt);
        options.transition = transition.unwrap_or(options.transition);
        let options = ControllerOptions { slew, law, anti_windup, start_drive, ..options };
        let preview = preview.map(|made| made.preview.clone());
        let made = core::HybridController::new(source, preview, &options).map_err(raise)?;
        warn_of(py, law)?;
        Ok(Self(made))
    }

    /// Takes a sample and returns the drive in volts.
    ///
    /// `reference` and `measurement` in um, with a preview the reference of `preview.ahead` samples later; `feedforward`:
    /// volts that replace the output of the source, which follows the target all the same; `target`: what the feed-forward
    /// is to reach, if not the reference or what the preview makes of it.
    #[pyo3(signature = (reference, measurement, feedforward=None, *, target=None))]
    fn step(
        slf: &Bound<'_, Self>,
        reference: f64,
        measurement: f64,
        feedforward: Option<f64>,
        target: Option<f64>,
    ) -> PyResult<f64> {
        Ok(exclusive(slf)?.0.step(Command { reference, target, feedforward }, measurement))
    }

    /// The drive that `step` would return, without taking the sample.
    #[pyo3(signature = (reference, measurement, feedforward=None, *, target=None))]
    fn peek(
        slf: &Bound<'_, Self>,
        reference: f64,
        measurement: f64,
        feedforward: Option<f64>,
        target: Option<f64>,
    ) -> PyResult<f64> {
        Ok(shared(slf)?.0.peek(Command { reference, target, feedforward }, measurement))
    }

    /// The drive for a sample, which only `commit` takes: write it to the amplifier between the two, and if that fails,
    /// leave it; memory and terms are still those of the drive that is there.
    ///
    /// A plan replaces the one before; any change of the controller drops it.
    #[pyo3(signature = (reference, measurement, feedforward=None, *, target=None))]
    fn plan(
        slf: &Bound<'_, Self>,
        reference: f64,
        measurement: f64,
        feedforward: Option<f64>,
        target: Option<f64>,
    ) -> PyResult<f64> {
        Ok(exclusive(slf)?.0.plan(Command { reference, target, feedforward }, measurement))
    }

    /// Takes the sample that was planned; False if there is none.
    fn commit(&mut self) -> bool {
        self.0.commit()
    }

    /// The present drive in volts: what the amplifier has.
    #[getter]
    fn drive(&self) -> f64 {
        self.0.drive()
    }

    /// What the last sample that was acted upon was made of.
    #[getter]
    fn terms(&self) -> ControllerTerms {
        ControllerTerms(self.0.terms())
    }

    /// "run"; "feedforward": the proportional term is off, the integral is frozen and stays part of the drive; "hold": the
    /// drive stays and nothing advances. Set it at any time: no change of mode is a jump.
    #[getter]
    fn mode(&self) -> &'static str {
        mode_name(self.0.mode())
    }

    #[setter]
    fn set_mode(&mut self, mode: &str) -> PyResult<()> {
        let modes = [Mode::Run, Mode::Feedforward, Mode::Hold];
        match modes.into_iter().find(|known| mode_name(*known) == mode) {
            Some(mode) => self.0.set_mode(mode),
            None => return unknown("mode", "\"run\", \"feedforward\" or \"hold\"", mode),
        }
        Ok(())
    }

    /// Whether the drive is held. An attribute: set it to True to stop, to False to go on in the mode before.
    #[getter]
    fn hold(&self) -> bool {
        self.0.mode() == Mode::Hold
    }

    #[setter]
    fn set_hold(&mut self, hold: bool) {
        if hold {
            self.0.set_mode(Mode::Hold);
        } else {
            self.0.release();
        }
    }

    /// The proportional gain in V/um.
    #[getter]
    fn kp(&self) -> f64 {
        self.0.options().kp
    }

    /// The integral gain in V/um/sample.
    #[getter]
    fn ki(&self) -> f64 {
        self.0.options().ki
    }

    /// The limits of the drive (low, high) in volts.
    #[getter]
    fn limits(&self) -> (f64, f64) {
        self.0.options().limits
    }

    /// The sampling interval in seconds.
    #[getter]
    fn dt(&self) -> f64 {
        self.0.options().dt
    }

    /// Changes the gains without a jump. The integral is kept in volts.
    fn set_gains(slf: &Bound<'_, Self>, kp: &Bound<'_, PyAny>, ki: &Bound<'_, PyAny>) -> PyResult<()> {
        numbers!(kp, ki);
        exclusive(slf)?.0.set_gains(kp, ki).map_err(raise)
    }

    /// Goes on with the weights and the output offset of another model of the same operators, without a jump: as
    /// `Inverse.set_model` or `Forward.set_model` of the feed-forward.
    ///
    /// Raises ValueError that names what differs, NotInvertibleError if an inverse of the model may not exist; the
    /// controller is as before then.
    fn set_model(slf: &Bound<'_, Self>, model: &Bound<'_, PyAny>) -> PyResult<()> {
        let kernel = kernel_of("model", model)?;
        exclusive(slf)?.0.set_model(&kernel).map_err(raise)
    }

    /// Goes on with another feed-forward (as at construction) without a jump. While a motion is under way the new stream
    /// first moves to the last target; a change to "given" repeats the drive for one sample.
    fn set_feedforward(slf: &Bound<'_, Self>, feedforward: Option<&Bound<'_, PyAny>>) -> PyResult<()> {
        let source = source(feedforward)?;
        exclusive(slf)?.0.set_feedforward(source);
        Ok(())
    }

    /// Back to the start, in mode "run", with the memory of the feed-forward at rest and all counters at zero. The drive
    /// stays as it is, or is `drive` if the amplifier has another one now.
    #[pyo3(signature = (drive=None))]
    fn reset(slf: &Bound<'_, Self>, drive: Option<&Bound<'_, PyAny>>) -> PyResult<()> {
        numbers!(drive);
        let mut controller = exclusive(slf)?;
        match drive {
            Some(drive) => controller.0.reset_at(drive).map_err(raise)?,
            None => controller.0.reset(),
        }
        Ok(())
    }

    /// How many references, targets or given feed-forwards were not finite, or beyond 1e100, or missing.
    #[getter]
    fn rejected(&self) -> u64 {
        self.0.counters().rejected
    }

    /// How many measurements were not finite, or beyond 1e100.
    #[getter]
    fn missing(&self) -> u64 {
        self.0.counters().missing
    }

    /// How many samples demanded a drive beyond the limits.
    #[getter]
    fn saturated(&self) -> u64 {
        self.0.counters().saturated
    }

    /// How many samples demanded a faster move than the slew allows.
    #[getter]
    fn slewing(&self) -> u64 {
        self.0.counters().slewing
    }

    /// Goes on from another drive that the amplifier has, with everything that is remembered.
    ///
    /// For a state that was loaded into a controller whose amplifier is not at its drive: the next motion starts from there.
    fn start_at(slf: &Bound<'_, Self>, drive: &Bound<'_, PyAny>) -> PyResult<()> {
        numbers!(drive);
        exclusive(slf)?.0.start_at(drive).map_err(raise)
    }

    /// Everything that the controller remembers, as a dictionary to keep; set it to continue from there bit for bit. The
    /// amplifier must be at its drive. Arguments, gains and models are not part of it.
    #[getter]
    fn state<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(pythonize(py, &self.0.state())?)
    }

    #[setter]
    fn set_state(slf: &Bound<'_, Self>, state: &Bound<'_, PyAny>) -> PyResult<()> {
        let wrong = |what: &str| errors::value("state", format_args!("expected what .state returned; {what}"));
        let plain: core::ControllerState = depythonize(state).map_err(|error| wrong(&error.to_string()))?;
        // The conversion takes anything for a truth value.
        if !pythonize(state.py(), &plain)?.eq(state)? {
            return Err(wrong("a value has another type, or is NaN"));
        }
        exclusive(slf)?.0.set_state(&plain).map_err(raise)
    }

    fn __repr__(&self) -> String {
        let ControllerOptions { kp, ki, limits: (low, high), .. } = *self.0.options();
        format!("<HybridController kp {kp}, ki {ki}, limits ({low}, {high}), mode {}>", self.mode())
    }
}
