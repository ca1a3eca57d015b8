//! Learning from recorded periods.

use std::fmt;

use hysteresis_core::{Bound, Error as CoreError, Fingerprint, is_admissible};

use super::feedback_loop::FeedbackLoop;
use super::harmonics::Harmonics;
use super::options::{LearningOptions, Trial};
use super::spectra::as_f64;
use super::state::{IterativeState, check_beliefs};
use crate::linear::Error;
use crate::saved::{check_model, check_numbers, check_same, check_same_count};

/// An error this much above the best one is not learning any more.
const DIVERGED: f64 = 2.0;

/// An error below this share of the best one so far shows that steps may be larger again, one above this factor that they must be
/// smaller: what a correction changes at other harmonics belongs to no belief.
const TRUSTED: f64 = 0.9;
const WORSE: f64 = 1.1;

/// So many periods that do not lower the error to this share of the best one before end the learning.
const PATIENCE: usize = 5;
const HELPS: f64 = 0.99;

/// A target that moves by less than this share of its range is at rest.
const SAME_PLACE: f64 = 1e-6;

/// An error that has grown by this factor since shows that something has changed.
const GROWN: f64 = 1.25;

/// No error may be larger: variances are squares of it, and must stay admissible. The code of an overflow that many instruments
/// send, 9.9e37, is still one.
const MAX_ERROR: f64 = 1e40;

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
    harmonics: Harmonics,
    base: Vec<f64>,
    /// The target of the next period. It may begin where the last one ended.
    target: Vec<f64>,
    /// The target without that beginning.
    goal: Vec<f64>,
    best: Vec<f64>,
    best_rmse: f64,
    trust: f64,
    /// So many periods pass before the next one that is learned from.
    settling: u32,
    dt: f64,
    options: LearningOptions,
    trials: Vec<Trial>,
    since: usize,
    finished: bool,
}

impl IterativeLearning {
    /// Starts from one period of the target: the reference, or what dynamic feed-forward makes of it.
    ///
    /// # Errors
    /// [`Error`] for a loop that is not stable or may not be, an option outside its domain, fewer than two samples or a target that is
    /// not finite.
    pub fn new(feedback: &FeedbackLoop, target: &[f64], options: &LearningOptions) -> Result<Self, Error> {
        options.check()?;
        if target.len() < 2 {
            return Err(Error::whole("target", None, "at least two samples of a period", target.len()));
        }
        if let Some((index, got)) = target.iter().enumerate().find(|(_, y)| !is_admissible(**y)) {
            return Err(Error::domain("target", Some(index), "a finite number (at most 1e100 in magnitude)", *got));
        }
        let mut learning = Self {
            harmonics: Harmonics::new(feedback, target.len(), options)?,
            base: target.to_vec(),
            target: target.to_vec(),
            goal: target.to_vec(),
            best: target.to_vec(),
            best_rmse: f64::INFINITY,
            trust: 1.0,
            settling: options.settle,
            dt: feedback.dt,
            options: *options,
            trials: Vec::new(),
            since: 0,
            finished: false,
        };
        learning.keep_within_limits();
        learning.target.clone_from(&learning.goal);
        learning.best.clone_from(&learning.goal);
        Ok(learning)
    }

    /// One period of the target for the feed-forward, in the unit of the displacement.
    #[must_use]
    pub fn target(&self) -> &[f64] {
        &self.target
    }

    /// What is added to the target with which learning began: for a reference that also drifts from period to period, as the slow
    /// axis of a raster does, add it to that.
    #[must_use]
    pub fn correction(&self) -> impl ExactSizeIterator<Item = f64> + '_ {
        self.target.iter().zip(&self.base).map(|(target, base)| target - base)
    }

    /// Whether learning has stopped by itself: over the last five periods the error did not come down by a hundredth. The target is
    /// that of the best period then, and stays. Learning goes on when the error grows by a quarter.
    #[must_use]
    pub fn is_finished(&self) -> bool {
        self.finished
    }

    /// What every period was like so far.
    #[must_use]
    pub fn trials(&self) -> &[Trial] {
        &self.trials
    }

    /// Learns from the measured error, reference minus measurement, of a period that was run with the present target. A period in which
    /// the loop settles is only noted.
    ///
    /// # Errors
    /// [`CoreError::Length`] unless it has as many samples as the target, [`CoreError::Domain`] for one that is not
    /// finite or beyond 1e40 in magnitude; nothing is learned then.
    pub fn update(&mut self, error: &[f64]) -> Result<Trial, CoreError> {
        if error.len() != self.base.len() {
            return Err(CoreError::Length { parameter: "error", expected: self.base.len(), got: error.len() });
        }
        check_error(error)?;
        let (max_error, rmse) = magnitude(error);
        let settled = self.settling == 0;
        // The best target itself no longer does what it did: it is not learning that made it worse.
        let changed = self.goal == self.best && rmse > DIVERGED * self.best_rmse;
        if settled && (changed || (self.finished && rmse > GROWN * self.best_rmse)) {
            self.begin_again();
        }
        let accepted = settled && rmse <= DIVERGED * self.best_rmse;
        let trial = Trial { max_error, rmse, accepted };
        self.trials.push(trial);
        if self.finished || !settled {
            self.settling = self.settling.saturating_sub(1);
            self.target.clone_from(&self.goal);
            return Ok(trial);
        }
        if rmse < TRUSTED * self.best_rmse {
            self.trust = (2.0 * self.trust).min(1.0);
        } else if rmse > WORSE * self.best_rmse {
            self.trust *= 0.5;
        }
        if rmse < self.best_rmse {
            self.best_rmse = rmse;
            self.best.clone_from(&self.goal);
        }
        let last = self.goal.clone();
        if !accepted {
            self.goal.clone_from(&self.best);
        } else if self.no_longer_helps() {
            self.finished = true;
            self.goal.clone_from(&self.best);
        } else {
            self.learn(error, rmse > WORSE * self.best_rmse);
        }
        self.go_over_from(&last);
        Ok(trial)
    }

    /// Where there are periods to settle, the target goes over from the last one to the next within a tenth of the first of them: a jump
    /// would ring for longer than that.
    fn go_over_from(&mut self, last: &[f64]) {
        self.settling = self.options.settle;
        self.target.clone_from(&self.goal);
        if self.settling == 0 || self.options.on_demand {
            return;
        }
        let fade = self.target.len() / 10;
        for (k, (target, last)) in self.target.iter_mut().zip(last).take(fade).enumerate() {
            let share = 0.5 * (1.0 + (core::f64::consts::PI * as_f64(k + 1) / as_f64(fade + 1)).cos());
            *target += share * (last - *target);
        }
    }

    /// Whether the periods of late are no better than those before.
    fn no_longer_helps(&self) -> bool {
        let rmse: Vec<f64> = self.trials[self.since..].iter().filter(|t| t.accepted).map(|t| t.rmse).collect();
        let Some((before, late)) = rmse.split_at_checked(rmse.len().saturating_sub(PATIENCE)) else { return false };
        let least = |periods: &[f64]| periods.iter().copied().fold(f64::INFINITY, f64::min);
        !before.is_empty() && least(late) > HELPS * least(before)
    }

    /// Something has changed: what was measured before no longer counts, but the corrections are a beginning.
    fn begin_again(&mut self) {
        self.since = self.trials.len();
        (self.finished, self.best_rmse, self.trust) = (false, f64::INFINITY, 1.0);
        self.harmonics.beliefs.clear();
    }

    /// Everything that it remembers and what it belongs to.
    #[must_use]
    pub fn state(&self) -> IterativeState {
        IterativeState {
            model: self.fingerprint(),
            dt: self.dt,
            options: self.options,
            target: self.target.clone(),
            goal: self.goal.clone(),
            settling: self.settling,
            best: self.best.clone(),
            best_rmse: self.best_rmse.is_finite().then_some(self.best_rmse),
            beliefs: self.harmonics.beliefs.clone(),
            noise: self.harmonics.noise,
            trust: self.trust,
            since: self.since,
            finished: self.finished,
            trials: self.trials.clone(),
        }
    }

    /// Goes on from a state of the same loop, target to begin with and options, bit for bit.
    ///
    /// # Errors
    /// [`Error`] that names what differs, or a number outside its domain; nothing changes then.
    pub fn set_state(&mut self, state: &IterativeState) -> Result<(), Error> {
        self.check_options(state)?;
        check_numbers("state.target", self.base.len(), &state.target)?;
        check_numbers("state.goal", self.base.len(), &state.goal)?;
        check_numbers("state.best", self.base.len(), &state.best)?;
        check_model(self.fingerprint(), state.model)?;
        if let Some(got) = state.best_rmse.filter(|rmse| !(is_admissible(*rmse) && *rmse >= 0.0)) {
            return Err(Error::domain("state.best_rmse", None, "a finite number >= 0", got));
        }
        if !(0.0..=1.0).contains(&state.trust) {
            return Err(Error::domain("state.trust", None, "0 to 1", state.trust));
        }
        if !(is_admissible(state.noise) && state.noise >= 0.0) {
            return Err(Error::domain("state.noise", None, "a finite number >= 0", state.noise));
        }
        if state.since > state.trials.len() {
            return Err(Error::whole("state.since", None, "at most the number of trials", state.since));
        }
        check_beliefs(&state.beliefs, self.harmonics.len())?;
        self.target.clone_from(&state.target);
        self.goal.clone_from(&state.goal);
        self.settling = state.settling;
        self.best.clone_from(&state.best);
        self.best_rmse = state.best_rmse.unwrap_or(f64::INFINITY);
        self.harmonics.beliefs.clone_from(&state.beliefs);
        self.harmonics.noise = state.noise;
        (self.trust, self.since, self.finished) = (state.trust, state.since, state.finished);
        self.trials.clone_from(&state.trials);
        Ok(())
    }

    fn check_options(&self, state: &IterativeState) -> Result<(), Error> {
        check_same("state.dt", self.dt, state.dt)?;
        let (own, saved) = (&self.options, &state.options);
        let or_none = |number: Option<f64>| number.unwrap_or(f64::INFINITY);
        check_same("state.bandwidth", or_none(own.bandwidth), or_none(saved.bandwidth))?;
        check_same("state.min_gain", own.min_gain, saved.min_gain)?;
        check_same("state.noise", or_none(own.noise), or_none(saved.noise))?;
        let limits = |options: &LearningOptions| options.target_limits.unwrap_or((f64::NEG_INFINITY, f64::INFINITY));
        check_same("state.target_limits", limits(own).0, limits(saved).0)?;
        check_same("state.target_limits", limits(own).1, limits(saved).1)?;
        check_same_count("state.settle", own.settle as usize, saved.settle as usize)?;
        check_same_count("state.on_demand", own.on_demand.into(), saved.on_demand.into())
    }

    /// Of the filters, and so of the loop, and of the target to begin with.
    fn fingerprint(&self) -> u64 {
        let mut fingerprint = Fingerprint::new();
        fingerprint.numbers(&self.base);
        let numbers: Vec<f64> = self.harmonics.numbers().collect();
        fingerprint.numbers(&numbers);
        fingerprint.finish()
    }

    /// The goal moves towards the target that promises the least error, by the share that is trusted: from the last one, or from the best
    /// one where the last was worse.
    fn learn(&mut self, error: &[f64], was_worse: bool) {
        let beside = |target: &[f64]| target.iter().zip(&self.base).map(|(y, base)| y - base).collect::<Vec<f64>>();
        let run = beside(&self.goal);
        let from = if was_worse { beside(&self.best) } else { run.clone() };
        let mut next = self.harmonics.learn(error, [&run, &from], &self.options);
        self.fade_at_rest(&mut next);
        for ((goal, base), (old, new)) in self.goal.iter_mut().zip(&self.base).zip(from.iter().zip(next)) {
            *goal = base + old + self.trust * (new - old);
        }
        self.keep_within_limits();
    }

    /// On demand nothing is corrected before and behind the motion: where it rests at its ends, the correction comes and goes smoothly.
    fn fade_at_rest(&self, correction: &mut [f64]) {
        if !self.options.on_demand {
            return;
        }
        fade_in(correction.iter_mut(), resting(self.base.iter()));
        fade_in(correction.iter_mut().rev(), resting(self.base.iter().rev()));
    }

    fn keep_within_limits(&mut self) {
        if let Some((low, high)) = self.options.target_limits {
            self.goal.iter_mut().for_each(|y| *y = y.clamp(low, high));
        }
    }

    /// By how much the error of the slowest harmonic shrinks in the first period if `truth` is the loop: max |Q (1 - L M')|, the mean
    /// apart. Below 1 learning converges.
    ///
    /// # Errors
    /// As [`FeedbackLoop::impulse_response`], and for another sampling interval.
    pub fn convergence_rate(&self, truth: &FeedbackLoop) -> Result<f64, Error> {
        check_same("dt", self.dt, truth.dt)?;
        self.harmonics.rate(truth)
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

/// For how many samples a target stays where it begins, at most a tenth of it; none if it moves at once.
fn resting<'a>(target: impl ExactSizeIterator<Item = &'a f64> + Clone) -> usize {
    let (low, high) =
        target.clone().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), y| (y.min(low), y.max(high)));
    let (most, first) = (target.len() / 10, target.clone().next().copied().unwrap_or_default());
    let resting = target.take(most).take_while(|y| (**y - first).abs() <= SAME_PLACE * (high - low)).count();
    // The first sample is always where it is.
    if resting > 1 { resting } else { 0 }
}

/// Lets what comes rise from zero over so many samples.
fn fade_in<'a>(samples: impl Iterator<Item = &'a mut f64>, fade: usize) {
    for (k, sample) in samples.take(fade).enumerate() {
        *sample *= 0.5 * (1.0 - (core::f64::consts::PI * as_f64(k) / as_f64(fade)).cos());
    }
}

fn check_error(error: &[f64]) -> Result<(), CoreError> {
    let Some((index, got)) = error.iter().enumerate().find(|(_, e)| e.is_nan() || e.abs() > MAX_ERROR) else {
        return Ok(());
    };
    let within = Bound::Between { low: -MAX_ERROR, high: MAX_ERROR };
    let expected = if is_admissible(*got) { within } else { Bound::Finite };
    Err(CoreError::Domain { parameter: "error", index: Some(index), expected, got: *got })
}

fn magnitude(error: &[f64]) -> (f64, f64) {
    let (max, squares) = error.iter().fold((0.0_f64, 0.0), |(max, sum), e| (max.max(e.abs()), sum + e * e));
    (max, (squares / as_f64(error.len())).sqrt())
}
