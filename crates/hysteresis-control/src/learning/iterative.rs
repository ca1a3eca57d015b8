//! Learning from recorded periods.

use std::fmt;

use hysteresis_core::{Bound, Error as CoreError, Fingerprint, is_admissible};

use super::feedback_loop::FeedbackLoop;
use super::options::{LearningOptions, Trial};
use super::spectra::{Spectra, as_f64, response};
use super::state::IterativeState;
use crate::linear::{Error, check_positive};
use crate::saved::{check_model, check_numbers, check_same};

/// An error this much above the best one is not learning any more.
const DIVERGED: f64 = 2.0;

/// Iterative learning control of a periodic reference: after every period, a better target for the next one.
///
/// See the [module](super) for the law. Everything is exact at the harmonics of the period; the mean of the target is
/// left to a feedback that integrates. Learning is for the time between two periods: it allocates.
///
/// ```
/// use hysteresis_control::learning::{FeedbackLoop, IterativeLearning, LearningOptions};
/// use hysteresis_control::linear::{Block, FirstOrder};
/// let lag = FirstOrder::new(50.0)?;
/// let open = (0.0, 0.0, hysteresis_core::Sections::default());
/// let feedback = FeedbackLoop { kp: open.0, ki: open.1, filters: open.2, slope: 1.0, dynamics: lag.into(), dt: 1e-3 };
/// let reference: Vec<f64> = (0..100).map(|k| (core::f64::consts::TAU * k as f64 / 100.0).sin()).collect();
/// let mut learning = IterativeLearning::new(&feedback, &reference, &LearningOptions::new(200.0))?;
/// let (mut plant, mut y) = (lag.block(1e-3)?, 0.0);
/// for period in 0..4 {
///     let mut error = Vec::new();
///     for (target, r) in learning.target().iter().zip(&reference) {
///         error.push(r - y);
///         y = plant.advance(*target);
///     }
///     learning.update(&error)?;
/// }
/// assert!(learning.trials()[0].rmse > 0.1 && learning.trials()[3].rmse < 1e-2);
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Clone)]
pub struct IterativeLearning {
    spectra: Spectra,
    base: Vec<f64>,
    target: Vec<f64>,
    best: Vec<f64>,
    best_rmse: f64,
    learned: u32,
    trust: f64,
    dt: f64,
    options: LearningOptions,
    trials: Vec<Trial>,
}

impl IterativeLearning {
    /// Starts from one period of the target: the reference, or what dynamic feed-forward makes of it.
    ///
    /// # Errors
    /// [`Error`] for a loop that is not stable, an option outside its domain, fewer than two samples or a target that is
    /// not finite.
    pub fn new(feedback: &FeedbackLoop, target: &[f64], options: &LearningOptions) -> Result<Self, Error> {
        check_positive("bandwidth", None, options.bandwidth)?;
        let error = |parameter, index, expected, got| Err(Error::domain(parameter, index, expected, got));
        if !(options.min_gain > 0.0 && options.min_gain <= 1.0) {
            return error("min_gain", None, "a number above 0, at most 1", options.min_gain);
        }
        if let Some((low, high)) = options.target_limits
            && !(is_admissible(low) && is_admissible(high) && low < high)
        {
            let (index, got) = if is_admissible(low) { (1, high) } else { (0, low) };
            return error("target_limits", Some(index), "finite limits, the high one above the low one", got);
        }
        if target.len() < 2 {
            return error("target", None, "at least two samples of a period", as_f64(target.len()));
        }
        if let Some((index, got)) = target.iter().enumerate().find(|(_, y)| !is_admissible(**y)) {
            return error("target", Some(index), "a finite number (at most 1e100 in magnitude)", *got);
        }
        let spectra = Spectra::new(feedback, target.len(), options.bandwidth)?;
        let mut learning = Self {
            spectra,
            base: target.to_vec(),
            target: target.to_vec(),
            best: target.to_vec(),
            best_rmse: f64::INFINITY,
            learned: 0,
            trust: 1.0,
            dt: feedback.dt,
            options: *options,
            trials: Vec::new(),
        };
        learning.keep_within_limits();
        learning.best.clone_from(&learning.target);
        Ok(learning)
    }

    /// One period of the target for the feed-forward, in the unit of the displacement.
    #[must_use]
    pub fn target(&self) -> &[f64] {
        &self.target
    }

    /// What every period was like so far.
    #[must_use]
    pub fn trials(&self) -> &[Trial] {
        &self.trials
    }

    /// Learns from the measured error, reference minus measurement, of a period that was run with the present target.
    ///
    /// # Errors
    /// [`CoreError::Length`] unless it has as many samples as the target, [`CoreError::Domain`] for one that is not
    /// finite; nothing is learned then.
    pub fn update(&mut self, error: &[f64]) -> Result<Trial, CoreError> {
        if error.len() != self.base.len() {
            return Err(CoreError::Length { parameter: "error", expected: self.base.len(), got: error.len() });
        }
        if let Some((index, got)) = error.iter().enumerate().find(|(_, e)| !is_admissible(**e)) {
            return Err(CoreError::Domain {
                parameter: "error",
                index: Some(index),
                expected: Bound::Finite,
                got: *got,
            });
        }
        let (max_error, rmse) = magnitude(error);
        let accepted = rmse <= DIVERGED * self.best_rmse;
        if accepted {
            if rmse < self.best_rmse {
                self.best_rmse = rmse;
                self.best.clone_from(&self.target);
            }
            self.learn(error);
        } else {
            self.trust *= 0.5;
            self.target.clone_from(&self.best);
        }
        let trial = Trial { max_error, rmse, accepted };
        self.trials.push(trial);
        Ok(trial)
    }

    /// Everything that it remembers and what it belongs to.
    #[must_use]
    pub fn state(&self) -> IterativeState {
        IterativeState {
            model: self.fingerprint(),
            dt: self.dt,
            options: self.options,
            target: self.target.clone(),
            best: self.best.clone(),
            best_rmse: self.best_rmse.is_finite().then_some(self.best_rmse),
            learned: self.learned,
            trust: self.trust,
            trials: self.trials.clone(),
        }
    }

    /// Goes on from a state of the same loop, target to begin with and options, bit for bit.
    ///
    /// # Errors
    /// [`Error`] that names what differs, or a number outside its domain; nothing changes then.
    pub fn set_state(&mut self, state: &IterativeState) -> Result<(), Error> {
        check_same("state.dt", self.dt, state.dt)?;
        let (own, saved) = (&self.options, &state.options);
        check_same("state.bandwidth", own.bandwidth, saved.bandwidth)?;
        check_same("state.min_gain", own.min_gain, saved.min_gain)?;
        let limits = |options: &LearningOptions| options.target_limits.unwrap_or((f64::NEG_INFINITY, f64::INFINITY));
        check_same("state.target_limits", limits(own).0, limits(saved).0)?;
        check_same("state.target_limits", limits(own).1, limits(saved).1)?;
        check_numbers("state.target", self.base.len(), &state.target)?;
        check_numbers("state.best", self.base.len(), &state.best)?;
        check_model(self.fingerprint(), state.model)?;
        if let Some(got) = state.best_rmse.filter(|rmse| !(is_admissible(*rmse) && *rmse >= 0.0)) {
            return Err(Error::domain("state.best_rmse", None, "a finite number >= 0", got));
        }
        if !(0.0..=1.0).contains(&state.trust) {
            return Err(Error::domain("state.trust", None, "0 to 1", state.trust));
        }
        self.target.clone_from(&state.target);
        self.best.clone_from(&state.best);
        self.best_rmse = state.best_rmse.unwrap_or(f64::INFINITY);
        (self.learned, self.trust) = (state.learned, state.trust);
        self.trials.clone_from(&state.trials);
        Ok(())
    }

    /// Of the filters, and so of the loop, and of the target to begin with.
    fn fingerprint(&self) -> u64 {
        let mut fingerprint = Fingerprint::new();
        fingerprint.numbers(&self.base);
        fingerprint.numbers(&self.spectra.low_pass);
        for l in &self.spectra.learning {
            fingerprint.numbers(&[l.re, l.im]);
        }
        fingerprint.finish()
    }

    /// v <- Q (v + gamma L e).
    fn learn(&mut self, error: &[f64]) {
        self.learned = self.learned.saturating_add(1);
        let gain = self.trust * f64::from(self.learned).recip().max(self.options.min_gain);
        let correction: Vec<f64> = self.target.iter().zip(&self.base).map(|(t, b)| t - b).collect();
        let mut spectrum = self.spectra.transform(&correction);
        let error = self.spectra.transform(error);
        let filters = self.spectra.low_pass.iter().zip(&self.spectra.learning);
        for ((v, e), (q, l)) in spectrum.iter_mut().zip(error).zip(filters) {
            *v = (*v + l * e * gain) * *q;
        }
        let correction = self.spectra.samples(spectrum);
        for ((target, base), v) in self.target.iter_mut().zip(&self.base).zip(correction) {
            *target = base + v;
        }
        self.keep_within_limits();
    }

    fn keep_within_limits(&mut self) {
        if let Some((low, high)) = self.options.target_limits {
            self.target.iter_mut().for_each(|y| *y = y.clamp(low, high));
        }
    }

    /// By how much the error of the slowest harmonic shrinks from period to period at gain 1 if `truth` is the loop:
    /// max |Q (1 - L M')|, the mean apart. Below 1 learning converges, and at any smaller gain too.
    ///
    /// # Errors
    /// As [`FeedbackLoop::impulse_response`], and for another sampling interval.
    pub fn convergence_rate(&self, truth: &FeedbackLoop) -> Result<f64, Error> {
        check_same("dt", self.dt, truth.dt)?;
        let response = response(truth, self.base.len())?;
        let filters = self.spectra.low_pass.iter().zip(&self.spectra.learning);
        let rates = response.iter().zip(filters).skip(1).map(|(m, (q, l))| q * (1.0 - l * m).norm());
        Ok(rates.fold(0.0, f64::max))
    }
}

impl fmt::Debug for IterativeLearning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { target, options, trials, .. } = self;
        f.debug_struct("IterativeLearning")
            .field("samples", &target.len())
            .field("options", options)
            .field("trials", trials)
            .finish_non_exhaustive()
    }
}

fn magnitude(error: &[f64]) -> (f64, f64) {
    let (max, squares) = error.iter().fold((0.0_f64, 0.0), |(max, sum), e| (max.max(e.abs()), sum + e * e));
    (max, (squares / as_f64(error.len())).sqrt())
}
