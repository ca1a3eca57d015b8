//! One object for the loop of a stage: controller, observer and learning.

use hysteresis_core::{
    Bound, Command, ControllerState, Error as CoreError, FeedForward, HybridController, Mode, check_length,
};
use serde::{Deserialize, Serialize};

use crate::learning::{RepetitiveControl, RepetitiveState};
use crate::observer::{Observer, ObserverState};
use crate::stage::Error;

/// A [`HybridController`] with an [`Observer`] before its feedback, [`RepetitiveControl`] before its feed-forward, or
/// both:
///
/// ```text
/// u(k) = controller(r(k), y^(k), v(k))     y^ = observer(u(k-1), y(k))     v = learned from r - y of the last period
/// ```
///
/// With a preview the error that is learned from is that of the reference of now. Without observer and learning it is
/// the controller alone, bit for bit.
///
/// **Limits** and slew, what is counted and the freedom from jumps are those of the controller: whatever is estimated
/// or learned goes through it. Nothing is learned from a sample with a measurement that the controller would not
/// believe, while the feedback is off, in the [lead-in](HybridController::lead_in) of a motion and for as long again:
/// that would be the error of the start. Learning that diverges stops and fades out: see [`RepetitiveControl::phase`].
///
/// **Missing measurements.** For up to `max_missing` of them in a row the observer stands in, and the loop goes on;
/// after them feed-forward goes on alone. They are counted as without an observer.
///
/// [`step`](Self::step), [`peek`](Self::peek), [`plan`](Self::plan) and [`commit`](Self::commit) do not allocate, lock,
/// panic, log or read a clock.
///
/// ```
/// use hysteresis_control::linear::SecondOrder;
/// use hysteresis_control::stage::{FeedForwardKind, Stage, StageParts};
/// use hysteresis_control::{Observer, ObserverOptions, StageController};
/// use hysteresis_core::{ModifiedPrandtlIshlinskii, Offsets, Ratios};
/// let weights = [4.3e-3, 1.7e-3, 1.7e-3]; // um/V
/// let model = ModifiedPrandtlIshlinskii::from_ratios(&weights, &[0.0, 150.0, 300.0], Ratios::PAPER, Offsets::default())?;
/// let parts = StageParts { dynamics: SecondOrder::new(400.0, 0.95)?.into(), limits: Some((-500.0, 500.0)), ..StageParts::new(model) };
/// let stage = Stage::new(parts)?;
/// let controller = stage.controller(FeedForwardKind::Inverse, &stage.controller_options(1e-4, None)?)?;
/// let observer = Observer::new(&stage, 1e-4, &ObserverOptions { noise: 0.016, drift: 0.5 })?;
/// let mut controller = StageController::from(controller).with_observer(observer)?;
/// let (mut plant, mut position) = (stage.forward(1e-4)?, 0.0);
/// for k in 0..2000 {
///     let reference = 1.0 - (-0.01 * f64::from(k)).exp(); // um
///     position = plant.advance(controller.step(reference.into(), position));
/// }
/// assert!((position - 1.0).abs() < 1e-3);
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct StageController {
    controller: HybridController,
    observer: Option<Observer>,
    repetitive: Option<RepetitiveControl>,
    /// For so many samples nothing is learned.
    rest_samples: u32,
    /// Whether learning waits where it is in its period.
    learning_waits: bool,
    planned: Option<Sample>,
}

/// What becomes of a sample.
#[derive(Clone, Copy, Debug)]
struct Sample {
    command: Command,
    measurement: f64,
    /// What the observer takes: NaN where the measurement is not believed.
    believed: f64,
    /// What there is to learn from: a reference, and what the measurement lacks.
    lesson: Option<(f64, f64)>,
}

impl From<HybridController> for StageController {
    fn from(controller: HybridController) -> Self {
        Self { controller, observer: None, repetitive: None, rest_samples: 0, learning_waits: false, planned: None }
    }
}

impl StageController {
    /// With an observer, which takes the present drive for the one that is held until the first measurement.
    ///
    /// # Errors
    /// [`Error`] for an observer of another sampling interval.
    pub fn with_observer(mut self, mut observer: Observer) -> Result<Self, Error> {
        self.check_interval("observer.dt", observer.dt())?;
        observer.predict(self.controller.drive());
        self.discard_plan();
        self.observer = Some(observer);
        Ok(self)
    }

    /// With learning in the running loop.
    ///
    /// # Errors
    /// [`Error`] for learning with another sampling interval, or for a controller without a feed-forward that targets
    /// reach.
    pub fn with_repetitive(mut self, repetitive: RepetitiveControl) -> Result<Self, Error> {
        self.check_interval("repetitive.dt", repetitive.dt())?;
        let got = match self.controller.feedforward() {
            FeedForward::None => Some("none"),
            FeedForward::Given => Some("given drives"),
            _ => None,
        };
        if let Some(got) = got {
            let expected = "a controller with a feed-forward that corrections reach";
            return Err(CoreError::Choice { parameter: "repetitive", expected, got }.into());
        }
        self.discard_plan();
        self.repetitive = Some(repetitive);
        Ok(self)
    }

    /// Rounding apart: 1 / 10 kHz is one number, 0.1 ms may be another.
    fn check_interval(&self, parameter: &'static str, got: f64) -> Result<(), CoreError> {
        let value = self.controller.options().dt;
        if (got / value - 1.0).abs() <= 1e-9 {
            return Ok(());
        }
        let expected = Bound::EqualTo { value, what: "the sampling interval of the controller in seconds" };
        Err(CoreError::Domain { parameter, index: None, expected, got })
    }

    /// Forgets a plan.
    pub fn discard_plan(&mut self) {
        self.planned = None;
        self.controller.discard_plan();
    }

    /// Goes on without the observer, and returns it. It has taken the present drive.
    pub fn take_observer(&mut self) -> Option<Observer> {
        self.discard_plan();
        self.observer.take()
    }

    /// Goes on without learning, and returns it.
    pub fn take_repetitive(&mut self) -> Option<RepetitiveControl> {
        self.discard_plan();
        self.repetitive.take()
    }

    /// Takes one sample and returns the drive: bit for bit [`plan`](Self::plan) and [`commit`](Self::commit).
    #[inline]
    pub fn step(&mut self, command: Command, measurement: f64) -> f64 {
        if self.is_plain() {
            return self.controller.step(command, measurement);
        }
        self.planned = None;
        let sample = self.sample(command, measurement);
        let drive = self.controller.step(sample.command, sample.measurement);
        self.take(&sample);
        drive
    }

    /// Takes a block of samples: bit for bit the drives of repeated [`step`](Self::step).
    ///
    /// # Errors
    /// [`CoreError::Length`] unless all three slices have the same length; nothing is taken then.
    pub fn run(&mut self, references: &[f64], measurements: &[f64], drives: &mut [f64]) -> Result<(), CoreError> {
        check_length("measurements", references.len(), measurements.len())?;
        check_length("drives", references.len(), drives.len())?;
        for ((reference, measurement), drive) in references.iter().zip(measurements).zip(drives) {
            *drive = self.step((*reference).into(), *measurement);
        }
        Ok(())
    }

    /// The drive that [`step`](Self::step) would return, without taking the sample.
    #[must_use]
    pub fn peek(&self, command: Command, measurement: f64) -> f64 {
        let Sample { command, measurement, .. } = self.sample(command, measurement);
        self.controller.peek(command, measurement)
    }

    /// The drive for a sample, which only [`commit`](Self::commit) takes: as [`HybridController::plan`].
    pub fn plan(&mut self, command: Command, measurement: f64) -> f64 {
        let sample = self.sample(command, measurement);
        self.planned = Some(sample);
        self.controller.plan(sample.command, sample.measurement)
    }

    /// Takes the sample that was planned; false if there is none, or the controller was changed since.
    pub fn commit(&mut self) -> bool {
        let (planned, committed) = (self.planned.take(), self.controller.commit());
        if let (Some(sample), true) = (planned, committed) {
            self.take(&sample);
        }
        committed
    }

    fn is_plain(&self) -> bool {
        self.observer.is_none() && self.repetitive.is_none()
    }

    #[inline]
    fn sample(&self, mut command: Command, measurement: f64) -> Sample {
        let believed = if self.controller.believes(measurement) { measurement } else { f64::NAN };
        command.estimate = self.observer.as_ref().map(|observer| observer.peek(believed));
        let mut lesson = None;
        if let Some(repetitive) = &self.repetitive {
            let learns = self.rest_samples == 0 && self.is_under_way() && believed.is_finite();
            let reference = self.controller.reference_of_now(command.reference);
            lesson = learns.then_some((reference, reference - believed));
            command.correction += repetitive.peek();
        }
        Sample { command, measurement, believed, lesson }
    }

    /// Observer and learning after a sample that the controller has taken.
    #[inline]
    fn take(&mut self, sample: &Sample) {
        if let Some(observer) = &mut self.observer {
            observer.correct(sample.believed);
            observer.predict(self.controller.drive());
        }
        let Some(repetitive) = &mut self.repetitive else { return };
        match sample.lesson {
            _ if self.learning_waits => {}
            Some((reference, error)) => _ = repetitive.step_with(reference, error),
            None => repetitive.wait(),
        }
        let rest = if self.is_under_way() { self.rest_samples } else { self.controller.bumpless_samples() + 1 };
        self.rest_samples = rest.saturating_sub(1);
    }

    /// Whether the feedback is on, and the drive that of the law.
    fn is_under_way(&self) -> bool {
        self.controller.mode() == Mode::Run && self.controller.lead_in() <= 0.0
    }

    /// Whether learning waits where it is in its period, until it is told to go on: while what is repeated has not
    /// begun.
    pub fn set_learning_waits(&mut self, waits: bool) {
        self.learning_waits = waits;
    }

    /// The controller, with what it offers to look at.
    #[must_use]
    pub fn controller(&self) -> &HybridController {
        &self.controller
    }

    /// The controller, for changes of gains, filters, model, mode and feed-forward: the observer keeps its model, and
    /// learning its filters. What the amplifier gets otherwise goes to [`follow`](Self::follow),
    /// [`start_at`](Self::start_at) and [`reset`](Self::reset) of the whole instead.
    pub fn controller_mut(&mut self) -> &mut HybridController {
        &mut self.controller
    }

    /// The observer, if there is one. It has taken the present drive.
    #[must_use]
    pub fn observer(&self) -> Option<&Observer> {
        self.observer.as_ref()
    }

    /// Learning, if there is any.
    #[must_use]
    pub fn repetitive(&self) -> Option<&RepetitiveControl> {
        self.repetitive.as_ref()
    }

    /// Lets learning begin anew, as [`RepetitiveControl::restart`]: false without learning.
    pub fn restart_learning(&mut self) -> bool {
        self.discard_plan();
        self.repetitive.as_mut().map(RepetitiveControl::restart).is_some()
    }

    /// Back to the start, at the present drive or another one that the amplifier has now: controller, observer and
    /// learning forget.
    ///
    /// # Errors
    /// As [`HybridController::reset_at`]; nothing changes then.
    pub fn reset(&mut self, drive: Option<f64>) -> Result<(), CoreError> {
        match drive {
            Some(drive) => self.controller.reset_at(drive)?,
            None => self.controller.reset(),
        }
        self.discard_plan();
        self.rest_samples = 0;
        if let Some(observer) = &mut self.observer {
            observer.reset();
            observer.predict(self.controller.drive());
        }
        if let Some(repetitive) = &mut self.repetitive {
            repetitive.reset();
        }
        Ok(())
    }

    /// Takes over what was driven before, oldest drive first, one per sampling interval: as
    /// [`HybridController::follow`] and [`Observer::follow`]. The last drive is held until the next measurement.
    ///
    /// # Errors
    /// As [`HybridController::follow`]; nothing changes then.
    pub fn follow(&mut self, drives: &[f64]) -> Result<(), CoreError> {
        let Some((last, before)) = drives.split_last() else { return Ok(()) };
        self.controller.follow(drives)?;
        if let Some(observer) = &mut self.observer {
            // Finite, or the controller would have refused them.
            observer.follow(before)?;
            observer.predict(*last);
        }
        Ok(())
    }

    /// Goes on from another drive that the amplifier has, with everything that is remembered: as
    /// [`HybridController::start_at`]. For the observer it is one sample more.
    ///
    /// # Errors
    /// As [`HybridController::start_at`]; nothing changes then.
    pub fn start_at(&mut self, drive: f64) -> Result<(), CoreError> {
        self.controller.start_at(drive)?;
        if let Some(observer) = &mut self.observer {
            observer.follow(&[])?;
            observer.predict(drive);
        }
        Ok(())
    }

    /// Everything that is remembered. Allocates.
    #[must_use]
    pub fn state(&self) -> StageControllerState {
        StageControllerState {
            controller: self.controller.state(),
            observer: self.observer.as_ref().map(Observer::state),
            repetitive: self.repetitive.as_ref().map(RepetitiveControl::state),
            rest_samples: self.rest_samples,
        }
    }

    /// Goes on from a state of the same set-up, bit for bit. The amplifier must be at the drive of the state.
    ///
    /// # Errors
    /// [`Error`] for a state with other parts, or that one of the parts refuses; nothing changes then.
    pub fn set_state(&mut self, state: &StageControllerState) -> Result<(), Error> {
        let mut next = self.clone();
        match (&mut next.observer, &state.observer) {
            (None, None) => {}
            (Some(observer), Some(saved)) => observer.set_state(saved)?,
            _ => {
                return Err(CoreError::State { expected: "an observer if, and only if, the controller has one" }.into());
            }
        }
        match (&mut next.repetitive, &state.repetitive) {
            (None, None) => {}
            (Some(repetitive), Some(saved)) => repetitive.set_state(saved)?,
            _ => return Err(CoreError::State { expected: "learning if, and only if, the controller learns" }.into()),
        }
        next.controller.set_state(&state.controller)?;
        if let Some(observer) = &mut next.observer {
            observer.predict(next.controller.drive());
        }
        (next.rest_samples, next.planned) = (state.rest_samples, None);
        *self = next;
        Ok(())
    }
}

/// Everything that a [`StageController`](StageController) remembers: restored, it continues bit for bit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StageControllerState {
    /// Feed-forward and feedback.
    pub controller: ControllerState,
    /// The observer, if there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub observer: Option<ObserverState>,
    /// Learning, if there is any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub repetitive: Option<RepetitiveState>,
    /// For how many samples nothing is learned.
    #[serde(default)]
    pub rest_samples: u32,
}
