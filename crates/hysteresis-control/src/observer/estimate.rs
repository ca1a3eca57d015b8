use hysteresis_core::{Error as CoreError, check_length, is_admissible};

use super::filter::Filter;
use super::options::ObserverOptions;
use super::state::ObserverState;
use crate::saved::{check_numbers, check_same, check_terms};
use crate::stage::{Error, Stage, StageForward};

/// A state observer: what the model of a stage and a noisy measurement say together of the position.
///
/// The applied drive moves the [model of the stage](StageForward), which has no lag for what it knows. What it does not
/// know (creep, drift, its own error) is a disturbance d at the input of the modes that wanders by `drift`. A Kalman
/// filter with the stationary gain estimates it and what the modes make of it from the difference between measurement and
/// model. So noise goes down by the ratio of the filter's bandwidth to that of the sampling, and only what the model does
/// not know is tracked as slowly as `drift` says. Where measurements are missing, the Riccati equation goes on without
/// them, and the gain is that for what it has come to: the stationary one would not be stable then.
///
/// [`step`](Self::step) does not allocate, lock, panic, log or read a clock.
///
/// ```
/// use hysteresis_control::linear::SecondOrder;
/// use hysteresis_control::stage::{Stage, StageParts};
/// use hysteresis_control::{Observer, ObserverOptions};
/// use hysteresis_core::{ModifiedPrandtlIshlinskii, Offsets, Ratios};
/// let weights = [4.3e-3, 1.7e-3, 1.7e-3]; // um/V
/// let model = ModifiedPrandtlIshlinskii::from_ratios(&weights, &[0.0, 150.0, 300.0], Ratios::PAPER, Offsets::default())?;
/// let stage = Stage::new(StageParts { dynamics: SecondOrder::new(400.0, 0.95)?.into(), ..StageParts::new(model) })?;
/// let mut observer = Observer::new(&stage, 1e-4, &ObserverOptions { noise: 0.016, drift: 0.5 })?;
/// let estimate = observer.step(0.0, 0.1); // a first sample that is mostly noise
/// assert!(estimate > 0.0 && estimate < 0.02);
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Observer {
    model: StageForward,
    filter: Filter,
    rest_drive: f64,
    options: ObserverOptions,
    /// Whether the model has been moved on to the measurement that comes next.
    predicted: bool,
    rejected: u64,
}

impl Observer {
    /// An observer of a stage that rests at its [rest drive](Stage::rest_drive).
    ///
    /// # Errors
    /// [`Error`] for a number outside its domain, a negative dead time, or noise and drift so far apart that the gain does
    /// not settle.
    pub fn new(stage: &Stage, dt: f64, options: &ObserverOptions) -> Result<Self, Error> {
        let filter = Filter::new(&stage.parts().dynamics, dt, options)?;
        let (model, rest_drive) = (stage.forward(dt)?, stage.rest_drive());
        Ok(Self { model, filter, rest_drive, options: *options, predicted: false, rejected: 0 })
    }

    /// Takes the drive that was put out at the last sample and held until now, and the measurement of now, read just before
    /// the next drive is put out; returns the position of now: bit for bit [`predict`](Self::predict) and
    /// [`correct`](Self::correct).
    ///
    /// Without a finite measurement the model goes on alone, without a finite drive it stays at the last one; either is
    /// counted.
    #[inline]
    pub fn step(&mut self, drive: f64, measurement: f64) -> f64 {
        self.count(is_admissible(drive) && is_admissible(measurement));
        self.move_on(drive);
        self.take(measurement)
    }

    /// Takes the drive that is held until the next measurement, as soon as it is put out. Once for each measurement: what comes
    /// again changes nothing.
    #[inline]
    pub fn predict(&mut self, drive: f64) {
        self.count(is_admissible(drive));
        self.move_on(drive);
    }

    /// Takes the measurement of now and returns the position of now, after [`predict`](Self::predict).
    #[inline]
    pub fn correct(&mut self, measurement: f64) -> f64 {
        self.count(is_admissible(measurement));
        self.take(measurement)
    }

    #[inline]
    fn count(&mut self, admissible: bool) {
        self.rejected = self.rejected.saturating_add(u64::from(!admissible));
    }

    #[inline]
    fn move_on(&mut self, drive: f64) {
        if self.predicted {
            return;
        }
        self.model.advance(if is_admissible(drive) { drive } else { self.model.drive() });
        self.filter.advance();
        self.predicted = true;
    }

    #[inline]
    fn take(&mut self, measurement: f64) -> f64 {
        self.filter.correct(self.difference(measurement));
        self.predicted = false;
        self.model.output() + self.filter.output()
    }

    /// What [`correct`](Self::correct) would return.
    #[must_use]
    #[inline]
    pub fn peek(&self, measurement: f64) -> f64 {
        self.model.output() + self.filter.peek(self.difference(measurement))
    }

    /// Between a measurement and what the model knows of the position.
    #[inline]
    fn difference(&self, measurement: f64) -> Option<f64> {
        is_admissible(measurement).then(|| measurement - self.model.output())
    }

    /// Takes a block of samples: bit for bit the positions of repeated [`step`](Self::step).
    ///
    /// # Errors
    /// [`CoreError::Length`] unless all three slices have the same length; nothing is taken then.
    pub fn run(&mut self, drives: &[f64], measurements: &[f64], positions: &mut [f64]) -> Result<(), CoreError> {
        check_length("measurements", drives.len(), measurements.len())?;
        check_length("positions", drives.len(), positions.len())?;
        for ((drive, measurement), position) in drives.iter().zip(measurements).zip(positions) {
            *position = self.step(*drive, *measurement);
        }
        Ok(())
    }

    /// What the model does not know, at the input of the modes, in the unit of the position.
    #[must_use]
    pub fn disturbance(&self) -> f64 {
        self.filter.disturbance()
    }

    /// What the position takes of the difference between measurement and prediction, from 0 to 1. After a while of
    /// measurements without a gap it is the variance of the estimate in units of that of the noise.
    #[must_use]
    pub fn position_gain(&self) -> f64 {
        self.filter.gains().0
    }

    /// What the disturbance takes of the difference between measurement and prediction.
    #[must_use]
    pub fn disturbance_gain(&self) -> f64 {
        self.filter.gains().1
    }

    /// How many drives or measurements were not finite.
    #[must_use]
    pub fn rejected(&self) -> u64 {
        self.rejected
    }

    /// The sampling interval in seconds.
    #[must_use]
    pub fn dt(&self) -> f64 {
        self.model.dt()
    }

    /// Back to rest at the rest drive of the stage.
    pub fn reset(&mut self) {
        self.model.settle(self.rest_drive);
        self.filter.reset();
        (self.predicted, self.rejected) = (false, 0);
    }

    /// Takes over what was driven before, oldest drive first, one per sampling interval, without measurements.
    ///
    /// # Errors
    /// [`CoreError::Domain`] for a drive that is not finite; nothing is taken then.
    pub fn follow(&mut self, drives: &[f64]) -> Result<(), CoreError> {
        self.model.follow(drives)?;
        self.predicted = false;
        Ok(())
    }

    /// Everything that it remembers and what it belongs to. Allocates.
    #[must_use]
    pub fn state(&self) -> ObserverState {
        ObserverState {
            options: self.options,
            stage: self.model.state(),
            unknown: self.filter.state().to_vec(),
            covariance: self.filter.covariance().map(<[f64]>::to_vec),
            predicted: self.predicted,
            rejected: self.rejected,
        }
    }

    /// Goes on from a state of an observer of the same stage with the same sampling interval and options, bit for bit.
    ///
    /// # Errors
    /// [`Error`] that names what differs, or a number that is not finite; nothing changes then.
    pub fn set_state(&mut self, state: &ObserverState) -> Result<(), Error> {
        check_same("state.noise", self.options.noise, state.options.noise)?;
        check_same("state.drift", self.options.drift, state.options.drift)?;
        let mut model = self.model.clone();
        model.set_state(&state.stage)?;
        let order = self.filter.state().len();
        check_terms("state.unknown", order, &state.unknown)?;
        if let Some(covariance) = &state.covariance {
            check_numbers("state.covariance", order * order, covariance)?;
        }
        self.model = model;
        self.filter.restore(&state.unknown, state.covariance.as_deref());
        (self.predicted, self.rejected) = (state.predicted, state.rejected);
        Ok(())
    }
}
