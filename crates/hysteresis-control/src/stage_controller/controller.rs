use hysteresis_core::{Command, Error as CoreError, HybridController, Mode, check_length};

use super::state::StageControllerState;
use crate::learning::RepetitiveControl;
use crate::observer::Observer;
use crate::saved::check_same;
use crate::stage::Error;

/// A [`HybridController`] with an [`Observer`] before its feedback, [`RepetitiveControl`] before its feed-forward, or both:
///
/// ```text
/// u(k) = controller(r(k), y^(k), v(k))     y^ = observer(u(k-1), y(k))     v = learned from r - y of the last period
/// ```
///
/// With a preview the error that is learned from is that of the reference of now. Without observer and learning it is the controller
/// alone, bit for bit.
///
/// **Limits** and slew, what is counted and the freedom from jumps are those of the controller: whatever is estimated or learned goes
/// through it. Nothing is learned from a sample with a measurement that the controller would not believe, nor while the feedback is
/// off.
///
/// **Missing measurements.** For up to `max_missing` of them in a row the observer stands in, and the loop goes on; after them the
/// controller is told that there are none. The observer counts them all.
///
/// [`step`](Self::step), [`peek`](Self::peek), [`plan`](Self::plan) and [`commit`](Self::commit) do not allocate, lock, panic, log or
/// read a clock.
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
    /// Measurements in a row for which the observer stands in, or no longer does.
    missing_in_a_row: u32,
    planned: Option<Sample>,
}

/// What becomes of a sample.
#[derive(Clone, Copy, Debug)]
struct Sample {
    command: Command,
    /// What the feedback sees.
    seen: f64,
    /// What the observer takes: NaN where the measurement is not believed.
    measurement: f64,
    /// What is learned from: NaN for nothing.
    error: f64,
}

impl From<HybridController> for StageController {
    fn from(controller: HybridController) -> Self {
        Self { controller, observer: None, repetitive: None, missing_in_a_row: 0, planned: None }
    }
}

impl StageController {
    /// With an observer, which takes the present drive for the one that is held until the first measurement.
    ///
    /// # Errors
    /// [`Error`] for an observer of another sampling interval.
    pub fn with_observer(mut self, mut observer: Observer) -> Result<Self, Error> {
        check_same("observer.dt", self.controller.options().dt, observer.dt())?;
        observer.predict(self.controller.drive());
        (self.observer, self.planned) = (Some(observer), None);
        Ok(self)
    }

    /// With learning in the running loop.
    ///
    /// # Errors
    /// [`Error`] for learning with another sampling interval.
    pub fn with_repetitive(mut self, repetitive: RepetitiveControl) -> Result<Self, Error> {
        check_same("repetitive.dt", self.controller.options().dt, repetitive.dt())?;
        (self.repetitive, self.planned) = (Some(repetitive), None);
        Ok(self)
    }

    /// Goes on without the observer, and returns it. It has taken the present drive.
    pub fn take_observer(&mut self) -> Option<Observer> {
        (self.planned, self.missing_in_a_row) = (None, 0);
        self.observer.take()
    }

    /// Goes on without learning, and returns it.
    pub fn take_repetitive(&mut self) -> Option<RepetitiveControl> {
        self.planned = None;
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
        let drive = self.controller.step(sample.command, sample.seen);
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
        let Sample { command, seen, .. } = self.sample(command, measurement);
        self.controller.peek(command, seen)
    }

    /// The drive for a sample, which only [`commit`](Self::commit) takes: as [`HybridController::plan`].
    pub fn plan(&mut self, command: Command, measurement: f64) -> f64 {
        let sample = self.sample(command, measurement);
        self.planned = Some(sample);
        self.controller.plan(sample.command, sample.seen)
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
        let mut error = f64::NAN;
        if let Some(repetitive) = &self.repetitive {
            if self.controller.mode() == Mode::Run {
                error = self.controller.reference_of_now(command.reference) - believed;
            }
            command.correction += repetitive.peek();
        }
        let seen = match &self.observer {
            None => measurement,
            Some(observer) if believed.is_finite() || self.missing_in_a_row < self.max_missing() => {
                observer.peek(believed)
            }
            Some(_) => f64::NAN,
        };
        Sample { command, seen, measurement: believed, error }
    }

    fn max_missing(&self) -> u32 {
        self.controller.options().max_missing
    }

    /// Observer and learning after a sample that the controller has taken.
    #[inline]
    fn take(&mut self, sample: &Sample) {
        if let Some(observer) = &mut self.observer {
            let missing = if sample.measurement.is_finite() { 0 } else { self.missing_in_a_row.saturating_add(1) };
            self.missing_in_a_row = missing;
            observer.correct(sample.measurement);
            observer.predict(self.controller.drive());
        }
        if let Some(repetitive) = &mut self.repetitive {
            repetitive.step(sample.error);
        }
    }

    /// The controller, with what it offers to look at.
    #[must_use]
    pub fn controller(&self) -> &HybridController {
        &self.controller
    }

    /// The controller, for changes of gains, filters, mode and feed-forward. Drives that it is told of by
    /// [`follow`](HybridController::follow) go to [`follow`](Self::follow) instead, and a start anew to [`reset`](Self::reset).
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

    /// Back to the start, at the present drive or another one that the amplifier has now: controller, observer and learning forget.
    ///
    /// # Errors
    /// As [`HybridController::reset_at`]; nothing changes then.
    pub fn reset(&mut self, drive: Option<f64>) -> Result<(), CoreError> {
        match drive {
            Some(drive) => self.controller.reset_at(drive)?,
            None => self.controller.reset(),
        }
        (self.planned, self.missing_in_a_row) = (None, 0);
        if let Some(observer) = &mut self.observer {
            observer.reset();
            observer.predict(self.controller.drive());
        }
        if let Some(repetitive) = &mut self.repetitive {
            repetitive.reset();
        }
        Ok(())
    }

    /// Takes over what was driven before, oldest drive first, one per sampling interval: as [`HybridController::follow`] and
    /// [`Observer::follow`].
    ///
    /// # Errors
    /// As [`HybridController::follow`]; nothing changes then.
    pub fn follow(&mut self, drives: &[f64]) -> Result<(), CoreError> {
        self.controller.follow(drives)?;
        if let (Some(observer), false) = (&mut self.observer, drives.is_empty()) {
            observer.follow(drives)?;
            observer.predict(self.controller.drive());
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
            missing_in_a_row: self.missing_in_a_row,
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
        (next.missing_in_a_row, next.planned) = (state.missing_in_a_row, None);
        *self = next;
        Ok(())
    }
}
