//! A Kalman filter for a random walk at the input of linear dynamics.

use core::slice::{ChunksExact, ChunksExactMut};

use hysteresis_core::is_admissible;
use nalgebra::{DMatrix, DVector};

use super::options::ObserverOptions;
use super::riccati::stationary;
use crate::linear::{Error, LinearDynamics, check_positive};

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
pub(super) struct Filter {
    /// Of (e, d), row by row.
    transition: Box<[f64]>,
    /// (c, G).
    output: Box<[f64]>,
    /// (-g, 1).
    input: Box<[f64]>,
    /// The variance of v in units of that of the measurement.
    growth: f64,
    /// The covariance before the measurement in units of the variance of the measurement: the one in which it settles, and
    /// the present one, which differs where measurements are missing.
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
    pub(super) fn new(dynamics: &LinearDynamics, dt: f64, options: &ObserverOptions) -> Result<Self, Error> {
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
        let covariance = (!slow && is_admissible(growth)).then(|| stationary(&transition, &output, &input, growth));
        let Some(covariance) = covariance.flatten() else {
            let expected = "a drift for which the filter settles";
            return Err(Error::domain("drift", None, expected, drift));
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
    pub(super) fn output(&self) -> f64 {
        dot(&self.output, &self.state)
    }

    /// d.
    pub(super) fn disturbance(&self) -> f64 {
        self.state.last().copied().unwrap_or_default()
    }

    /// What a unit of difference between measurement and estimate adds to the output and to d, with the present gain.
    pub(super) fn gains(&self) -> (f64, f64) {
        (dot(&self.output, &self.gain), self.gain.last().copied().unwrap_or_default())
    }

    /// One sampling interval on.
    #[inline]
    pub(super) fn advance(&mut self) {
        let n = self.order();
        for (next, row) in self.next.iter_mut().zip(rows(&self.transition, n)) {
            *next = dot(row, &self.state);
        }
        core::mem::swap(&mut self.state, &mut self.next);
    }

    /// What [`output`](Self::output) would be after [`correct`](Self::correct).
    #[inline]
    pub(super) fn peek(&self, difference: Option<f64>) -> f64 {
        let Some(difference) = difference else { return self.output() };
        let error = difference - self.output();
        let corrected = self.state.iter().zip(&self.gain).map(|(x, gain)| x + gain * error);
        self.output.iter().zip(corrected).map(|(c, x)| c * x).sum()
    }

    /// Takes the difference between a measurement and the known part of the position, if there is one.
    #[inline]
    pub(super) fn correct(&mut self, difference: Option<f64>) {
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

    /// From one covariance P before the measurement to the next: F (P - g h'P) F' + q v v', without a measurement F P F' +
    /// q v v'.
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
    pub(super) fn reset(&mut self) {
        self.state.fill(0.0);
        copy(&mut self.present, &self.stationary);
        self.settled = true;
        self.renew_gain();
    }

    /// e and d.
    pub(super) fn state(&self) -> &[f64] {
        &self.state
    }

    /// The covariance, row by row, where it has not settled.
    pub(super) fn covariance(&self) -> Option<&[f64]> {
        (!self.settled).then_some(&*self.present)
    }

    /// Goes on from a state that was checked to be of its size and finite.
    pub(super) fn restore(&mut self, state: &[f64], covariance: Option<&[f64]>) {
        self.reset();
        self.state.copy_from_slice(state);
        if let Some(covariance) = covariance {
            self.present.copy_from_slice(covariance);
            self.settled = false;
            self.renew_gain();
        }
    }
}

#[inline]
fn dot(one: &[f64], other: &[f64]) -> f64 {
    one.iter().zip(other).map(|(x, y)| x * y).sum()
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
