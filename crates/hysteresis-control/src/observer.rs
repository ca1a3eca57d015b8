//! The position behind a noisy measurement: the model of a stage, and a Kalman filter for what it does not know.

use core::slice::{ChunksExact, ChunksExactMut};

use hysteresis_core::{Error as CoreError, check_length, is_admissible};
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

use crate::checks::{check_numbers, check_positive, check_same, check_terms};
use crate::linear::{LinearDynamics, dot};
use crate::riccati::filter_covariance;
use crate::stage::{Error, Stage, StageForward, StageState};

/// How much to believe.
///
/// ```
/// use hysteresis_control::ObserverOptions;
/// let options = ObserverOptions { noise: 0.016, drift: 0.5 }; // um, um per root of a second
/// assert_eq!(options.noise, 0.016);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ObserverOptions {
    /// The root mean square of the measurement noise, in the unit of the position.
    pub noise: f64,
    /// How fast what the model does not know may wander, in the unit of the position per square root of a second: the
    /// root mean square of its change over one second.
    pub drift: f64,
}

/// A state observer: what the model of a stage and a noisy measurement say together of the position.
///
/// The applied drive moves the [model of the stage](StageForward), which has no lag for what it knows. What it does not
/// know (creep, drift, its own error) is a disturbance d at the input of the modes that wanders by `drift`. A Kalman
/// filter with the stationary gain estimates it and what the modes make of it from the difference between measurement
/// and model. So noise goes down by the ratio of the filter's bandwidth to that of the sampling, and only what the
/// model does not know is tracked as slowly as `drift` says. Where measurements are missing, the Riccati equation goes
/// on without them, and the gain is that for what it has come to: the stationary one would not be stable then.
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
    /// [`Error`] for a number outside its domain, a negative dead time, or noise and drift so far apart that the gain
    /// does not settle.
    pub fn new(stage: &Stage, dt: f64, options: &ObserverOptions) -> Result<Self, Error> {
        let filter = Filter::new(&stage.parts().dynamics, dt, options)?;
        let (model, rest_drive) = (stage.forward(dt)?, stage.rest_drive());
        Ok(Self { model, filter, rest_drive, options: *options, predicted: false, rejected: 0 })
    }

    /// Takes the drive that was put out at the last sample and held until now, and the measurement of now, read just
    /// before the next drive is put out; returns the position of now: bit for bit [`predict`](Self::predict) and
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

    /// Takes the drive that is held until the next measurement, as soon as it is put out. Once for each measurement:
    /// what comes again changes nothing.
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

/// Everything that an [`Observer`](Observer) remembers: restored, it continues bit for bit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ObserverState {
    /// How much is believed.
    pub options: ObserverOptions,
    /// The model of the stage.
    pub stage: StageState,
    /// What the model does not know: the distance of the modes from rest, and the disturbance at their input.
    pub unknown: Vec<f64>,
    /// The covariance of the unknown, row by row, in units of the variance of the noise; none where it has settled.
    pub covariance: Option<Vec<f64>>,
    /// Whether the drive that is held until the next measurement has been taken.
    #[serde(default)]
    pub predicted: bool,
    /// How many drives or measurements were not finite.
    pub rejected: u64,
}

/// A filter slower than that many samples is not one for a control loop.
const SLOWEST: f64 = 1e6;

/// The covariance has settled again when it differs from the stationary one by no more than this share of the largest
/// entry: far above what rounding leaves between the two, far below what matters.
const SETTLED: f64 = 1e-8;

/// What dynamics make of a disturbance d at their input, as far as measurements of their output tell.
///
/// The disturbance is held over the sampling intervals and changes by v(k) at t_k, of variance drift^2 T. With e the
/// distance of the dynamics from rest and G their static gain
///
/// e(k+1) = Phi e(k) - g v(k),   d(k) = d(k-1) + v(k),   y(k+1) = G d(k) + c e(k+1).
///
/// All buffers are taken at construction.
#[derive(Clone, Debug)]
struct Filter {
    /// Of (e, d), row by row.
    transition: Box<[f64]>,
    /// (c, G).
    output: Box<[f64]>,
    /// (-g, 1).
    input: Box<[f64]>,
    /// The variance of v in units of that of the measurement.
    growth: f64,
    /// The covariance before the measurement in units of the variance of the measurement: the one in which it settles,
    /// and the present one, which differs where measurements are missing.
    stationary: Box<[f64]>,
    present: Box<[f64]>,
    settled: bool,
    /// The gain for the present covariance.
    gain: Box<[f64]>,
    state: Box<[f64]>,
    /// Where products are put together.
    work: Box<[f64]>,
    next: Box<[f64]>,
}

impl Filter {
    pub(crate) fn new(dynamics: &LinearDynamics, dt: f64, options: &ObserverOptions) -> Result<Self, CoreError> {
        let noise = check_positive("noise", None, options.noise)?;
        let drift = check_positive("drift", None, options.drift)?;
        let discrete = dynamics.clone().with_dead_time(0.0)?.sampled(dt)?;
        let (order, growth) = (discrete.g.len(), (drift / noise).powi(2) * dt);
        let mut transition = DMatrix::identity(order + 1, order + 1);
        transition.view_mut((0, 0), (order, order)).copy_from(&discrete.phi);
        let output = DVector::from_iterator(order + 1, discrete.c.iter().copied().chain([discrete.gain]));
        let input = DVector::from_iterator(order + 1, discrete.g.iter().map(|g| -g).chain([1.0]));
        // A random walk of the variance q that is measured is tracked over 1 / sqrt(q) samples.
        let slow = growth.sqrt() * discrete.gain.abs() * SLOWEST < 1.0;
        let covariance =
            (!slow && is_admissible(growth)).then(|| filter_covariance(&transition, &output, &input, growth));
        let Some(covariance) = covariance.flatten() else {
            let expected = "a drift for which the filter settles";
            return Err(CoreError::domain("drift", None, expected, drift));
        };
        // nalgebra stores columns: the transpose, read column by column, is the matrix row by row.
        let by_rows = |matrix: DMatrix<f64>| -> Box<[f64]> { matrix.transpose().as_slice().into() };
        let stationary = by_rows(covariance);
        let zeros = || vec![0.0; order + 1].into();
        let mut filter = Self {
            transition: by_rows(transition),
            output: output.as_slice().into(),
            input: input.as_slice().into(),
            growth,
            present: stationary.clone(),
            work: stationary.clone(),
            stationary,
            settled: true,
            gain: zeros(),
            state: zeros(),
            next: zeros(),
        };
        filter.renew_gain();
        Ok(filter)
    }

    fn order(&self) -> usize {
        self.output.len()
    }

    /// The output now.
    #[inline]
    fn output(&self) -> f64 {
        dot(&self.output, &self.state)
    }

    /// d.
    fn disturbance(&self) -> f64 {
        self.state.last().copied().unwrap_or_default()
    }

    /// What a unit of difference between measurement and estimate adds to the output and to d, with the present gain.
    fn gains(&self) -> (f64, f64) {
        (dot(&self.output, &self.gain), self.gain.last().copied().unwrap_or_default())
    }

    /// One sampling interval on.
    #[inline]
    fn advance(&mut self) {
        let n = self.order();
        for (next, row) in self.next.iter_mut().zip(rows(&self.transition, n)) {
            *next = dot(row, &self.state);
        }
        core::mem::swap(&mut self.state, &mut self.next);
    }

    /// What [`output`](Self::output) would be after [`correct`](Self::correct).
    #[inline]
    fn peek(&self, difference: Option<f64>) -> f64 {
        let Some(difference) = difference else { return self.output() };
        let error = difference - self.output();
        let corrected = self.state.iter().zip(&self.gain).map(|(x, gain)| x + gain * error);
        self.output.iter().zip(corrected).map(|(c, x)| c * x).sum()
    }

    /// Takes the difference between a measurement and the known part of the position, if there is one.
    #[inline]
    fn correct(&mut self, difference: Option<f64>) {
        if let Some(difference) = difference {
            let error = difference - self.output();
            for (x, gain) in self.state.iter_mut().zip(&self.gain) {
                *x += gain * error;
            }
        }
        if !(self.settled && difference.is_some()) {
            self.advance_covariance(difference.is_some());
        }
    }

    /// From one covariance P before the measurement to the next: F (P - g h'P) F' + q v v', without a measurement F P
    /// F' + q v v'.
    #[cold]
    fn advance_covariance(&mut self, measured: bool) {
        let n = self.order();
        if measured {
            self.next.fill(0.0);
            for (h, row) in self.output.iter().zip(rows(&self.present, n)) {
                add_multiple(&mut self.next, *h, row);
            }
            for (gain, row) in self.gain.iter().zip(rows_mut(&mut self.present, n)) {
                add_multiple(row, -gain, &self.next);
            }
        }
        for (product, row) in rows_mut(&mut self.work, n).zip(rows(&self.transition, n)) {
            product.fill(0.0);
            for (entry, row) in row.iter().zip(rows(&self.present, n)) {
                add_multiple(product, *entry, row);
            }
        }
        self.close_product();
        let largest = self.stationary.iter().fold(0.0, |most: f64, entry| most.max(entry.abs()));
        let differs = |(a, b): (&f64, &f64)| (a - b).abs() > SETTLED * largest;
        self.settled = !self.present.iter().zip(&self.stationary).any(differs);
        if self.settled {
            copy(&mut self.present, &self.stationary);
        }
        self.renew_gain();
    }

    /// P = W F' + q v v' from W = F P: one half, and the other is its mirror image.
    fn close_product(&mut self) {
        let n = self.order();
        for (i, (product, input)) in rows(&self.work, n).zip(&self.input).enumerate() {
            let (above, from_here) = self.present.split_at_mut_checked(i * n).unwrap_or_default();
            for (entry, (row, other)) in
                from_here.iter_mut().zip(rows(&self.transition, n).zip(&self.input)).take(i + 1)
            {
                *entry = dot(product, row) + self.growth * input * other;
            }
            for (row, entry) in rows_mut(above, n).zip(from_here) {
                if let Some(mirrored) = row.get_mut(i) {
                    *mirrored = *entry;
                }
            }
        }
    }

    /// g = P h / (1 + h'P h).
    fn renew_gain(&mut self) {
        let n = self.order();
        for (gain, row) in self.gain.iter_mut().zip(rows(&self.present, n)) {
            *gain = dot(row, &self.output);
        }
        let scale = 1.0 + dot(&self.output, &self.gain);
        self.gain.iter_mut().for_each(|gain| *gain /= scale);
    }

    /// Back to where nothing is unknown.
    fn reset(&mut self) {
        self.state.fill(0.0);
        copy(&mut self.present, &self.stationary);
        self.settled = true;
        self.renew_gain();
    }

    /// e and d.
    pub(crate) fn state(&self) -> &[f64] {
        &self.state
    }

    /// The covariance, row by row, where it has not settled.
    fn covariance(&self) -> Option<&[f64]> {
        (!self.settled).then_some(&*self.present)
    }

    /// Goes on from a state that was checked to be of its size and finite.
    pub(crate) fn restore(&mut self, state: &[f64], covariance: Option<&[f64]>) {
        self.reset();
        self.state.copy_from_slice(state);
        if let Some(covariance) = covariance {
            self.present.copy_from_slice(covariance);
            self.settled = false;
            self.renew_gain();
        }
    }
}

/// The rows of a matrix.
#[inline]
fn rows(matrix: &[f64], width: usize) -> ChunksExact<'_, f64> {
    matrix.chunks_exact(width.max(1))
}

#[inline]
fn rows_mut(matrix: &mut [f64], width: usize) -> ChunksExactMut<'_, f64> {
    matrix.chunks_exact_mut(width.max(1))
}

/// sum += factor row.
#[inline]
fn add_multiple(sum: &mut [f64], factor: f64, row: &[f64]) {
    for (sum, entry) in sum.iter_mut().zip(row) {
        *sum += factor * entry;
    }
}

/// Without a check of lengths, which could panic.
#[inline]
fn copy(to: &mut [f64], from: &[f64]) {
    for (to, from) in to.iter_mut().zip(from) {
        *to = *from;
    }
}
