//! Learning from recorded periods.

use std::fmt;

use hysteresis_core::{Bound, Error as CoreError, Fingerprint, check_model, is_admissible};
use serde::{Deserialize, Serialize};

use super::feedback_loop::FeedbackLoop;
use super::harmonics::{Belief, Harmonics, LearningOptions};
use crate::as_f64;
use crate::checks::{check_number, check_numbers, check_same, check_same_count, check_whole};
use crate::linear::Error;

/// An error this much above the best one is not learning any more.
const DIVERGED: f64 = 2.0;

/// An error below this share of the best one so far shows that steps may be larger again, one above this factor that
/// they must be smaller: what a correction changes at other harmonics belongs to no belief.
const TRUSTED: f64 = 0.9;
const WORSE: f64 = 1.1;

/// So many periods that do not lower the error to this share of the best one before end the learning.
const PATIENCE: usize = 5;
const HELPS: f64 = 0.99;

/// A target that moves by less than this share of its range is at rest.
const SAME_PLACE: f64 = 1e-6;

/// An error that has grown by this factor since shows that something has changed.
const GROWN: f64 = 1.25;

/// No error may be larger: variances are squares of it, and must stay admissible. The code of an overflow that many
/// instruments send, 9.9e37, is still one.
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
    state: IterativeState,
}

impl IterativeLearning {
    /// Starts from one period of the target: the reference, or what dynamic feed-forward makes of it.
    ///
    /// # Errors
    /// [`Error`] for a loop that is not stable or may not be, an option outside its domain, fewer than two samples or a
    /// target that is not finite.
    pub fn new(feedback: &FeedbackLoop, target: &[f64], options: &LearningOptions) -> Result<Self, Error> {
        options.check()?;
        check_whole("target", target.len() >= 2, "at least two samples of a period", target.len())?;
        if let Some((index, got)) = target.iter().enumerate().find(|(_, y)| !is_admissible(**y)) {
            return Err(Error::domain("target", Some(index), "a finite number (at most 1e100 in magnitude)", *got));
        }
        let harmonics = Harmonics::new(feedback, target.len(), options)?;
        let within = |y: &f64| options.target_limits.map_or(*y, |(low, high)| y.clamp(low, high));
        let goal: Vec<f64> = target.iter().map(within).collect();
        let state = IterativeState {
            model: fingerprint(target, &harmonics),
            dt: feedback.dt,
            options: *options,
            target: goal.clone(),
            settling: options.settle,
            best: goal.clone(),
            goal,
            best_rmse: None,
            beliefs: Vec::new(),
            noise: 0.0,
            trust: 1.0,
            since: 0,
            finished: false,
            trials: Vec::new(),
        };
        Ok(Self { harmonics, base: target.to_vec(), state })
    }

    /// One period of the target for the feed-forward, in the unit of the displacement.
    #[must_use]
    pub fn target(&self) -> &[f64] {
        &self.state.target
    }

    /// What is added to the target with which learning began: for a reference that also drifts from period to period,
    /// as the slow axis of a raster does, add it to that.
    #[must_use]
    pub fn correction(&self) -> impl ExactSizeIterator<Item = f64> + '_ {
        self.state.target.iter().zip(&self.base).map(|(target, base)| target - base)
    }

    /// Whether learning has stopped by itself: over the last five periods the error did not come down by a hundredth.
    /// The target is that of the best period then, and stays. Learning goes on when the error grows by a quarter.
    #[must_use]
    pub fn is_finished(&self) -> bool {
        self.state.finished
    }

    /// What every period was like so far.
    #[must_use]
    pub fn trials(&self) -> &[Trial] {
        &self.state.trials
    }

    /// Learns from the measured error, reference minus measurement, of a period that was run with the present target. A
    /// period in which the loop settles is only noted.
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
        let settled = self.state.settling == 0;
        // The best target itself no longer does what it did: it is not learning that made it worse.
        let changed = self.state.goal == self.state.best && rmse > DIVERGED * self.best_rmse();
        if settled && (changed || (self.state.finished && rmse > GROWN * self.best_rmse())) {
            self.begin_again();
        }
        let accepted = settled && rmse <= DIVERGED * self.best_rmse();
        let trial = Trial { max_error, rmse, accepted };
        self.state.trials.push(trial);
        if self.state.finished || !settled {
            self.state.settling = self.state.settling.saturating_sub(1);
            self.state.target.clone_from(&self.state.goal);
            return Ok(trial);
        }
        if rmse < TRUSTED * self.best_rmse() {
            self.state.trust = (2.0 * self.state.trust).min(1.0);
        } else if rmse > WORSE * self.best_rmse() {
            self.state.trust *= 0.5;
        }
        if rmse < self.best_rmse() {
            self.state.best_rmse = Some(rmse);
            self.state.best.clone_from(&self.state.goal);
        }
        let last = self.state.goal.clone();
        if !accepted {
            self.state.goal.clone_from(&self.state.best);
        } else if self.no_longer_helps() {
            self.state.finished = true;
            self.state.goal.clone_from(&self.state.best);
        } else {
            self.learn(error, rmse > WORSE * self.best_rmse());
        }
        self.go_over_from(&last);
        Ok(trial)
    }

    /// Where there are periods to settle, the target goes over from the last one to the next within a tenth of the
    /// first of them: a jump would ring for longer than that.
    fn go_over_from(&mut self, last: &[f64]) {
        self.state.settling = self.state.options.settle;
        self.state.target.clone_from(&self.state.goal);
        if self.state.settling == 0 || self.state.options.on_demand {
            return;
        }
        let fade = self.state.target.len() / 10;
        for (k, (target, last)) in self.state.target.iter_mut().zip(last).take(fade).enumerate() {
            let share = 0.5 * (1.0 + (core::f64::consts::PI * as_f64(k + 1) / as_f64(fade + 1)).cos());
            *target += share * (last - *target);
        }
    }

    fn best_rmse(&self) -> f64 {
        self.state.best_rmse.unwrap_or(f64::INFINITY)
    }

    /// Whether the periods of late are no better than those before.
    fn no_longer_helps(&self) -> bool {
        let rmse: Vec<f64> =
            self.state.trials[self.state.since..].iter().filter(|t| t.accepted).map(|t| t.rmse).collect();
        let Some((before, late)) = rmse.split_at_checked(rmse.len().saturating_sub(PATIENCE)) else { return false };
        let least = |periods: &[f64]| periods.iter().copied().fold(f64::INFINITY, f64::min);
        !before.is_empty() && least(late) > HELPS * least(before)
    }

    /// Something has changed: what was measured before no longer counts, but the corrections are a beginning.
    fn begin_again(&mut self) {
        self.state.since = self.state.trials.len();
        (self.state.finished, self.state.best_rmse, self.state.trust) = (false, None, 1.0);
        self.state.beliefs.clear();
    }

    /// Everything that it remembers and what it belongs to.
    #[must_use]
    pub fn state(&self) -> IterativeState {
        self.state.clone()
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
        check_model(self.state.model, state.model)?;
        if let Some(got) = state.best_rmse.filter(|rmse| !(is_admissible(*rmse) && *rmse >= 0.0)) {
            return Err(Error::domain("state.best_rmse", None, "a finite number >= 0", got));
        }
        check_number("state.trust", (0.0..=1.0).contains(&state.trust), "0 to 1", state.trust)?;
        let holds = is_admissible(state.noise) && state.noise >= 0.0;
        check_number("state.noise", holds, "a finite number >= 0", state.noise)?;
        check_whole("state.since", state.since <= state.trials.len(), "at most the number of trials", state.since)?;
        check_beliefs(&state.beliefs, self.harmonics.len())?;
        self.state = IterativeState { options: self.state.options, ..state.clone() };
        Ok(())
    }

    fn check_options(&self, state: &IterativeState) -> Result<(), Error> {
        check_same("state.dt", self.state.dt, state.dt)?;
        let (own, saved) = (&self.state.options, &state.options);
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

    /// The goal moves towards the target that promises the least error, by the share that is trusted: from the last
    /// one, or from the best one where the last was worse.
    fn learn(&mut self, error: &[f64], was_worse: bool) {
        let beside = |target: &[f64]| target.iter().zip(&self.base).map(|(y, base)| y - base).collect::<Vec<f64>>();
        let run = beside(&self.state.goal);
        let from = if was_worse { beside(&self.state.best) } else { run.clone() };
        let IterativeState { options, beliefs, noise, .. } = &mut self.state;
        let mut next = self.harmonics.learn(error, [&run, &from], options, (beliefs, noise));
        self.fade_at_rest(&mut next);
        for ((goal, base), (old, new)) in self.state.goal.iter_mut().zip(&self.base).zip(from.iter().zip(next)) {
            let moved = base + old + self.state.trust * (new - old);
            *goal = self.state.options.target_limits.map_or(moved, |(low, high)| moved.clamp(low, high));
        }
    }

    /// On demand nothing is corrected before and behind the motion: where it rests at its ends, the correction comes
    /// and goes smoothly.
    fn fade_at_rest(&self, correction: &mut [f64]) {
        if !self.state.options.on_demand {
            return;
        }
        fade_in(correction.iter_mut(), resting(self.base.iter()));
        fade_in(correction.iter_mut().rev(), resting(self.base.iter().rev()));
    }

    /// By how much the error of the slowest harmonic shrinks in the first period if `truth` is the loop: max |Q (1 - L
    /// M')|, the mean apart. Below 1 learning converges.
    ///
    /// # Errors
    /// As [`FeedbackLoop::impulse_response`], and for another sampling interval.
    pub fn convergence_rate(&self, truth: &FeedbackLoop) -> Result<f64, Error> {
        check_same("dt", self.state.dt, truth.dt)?;
        self.harmonics.rate(truth)
    }
}

impl fmt::Debug for IterativeLearning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let IterativeState { target, options, trials, .. } = &self.state;
        f.debug_struct("IterativeLearning")
            .field("samples", &target.len())
            .field("options", options)
            .field("trials", trials)
            .finish_non_exhaustive()
    }
}

/// Of the filters, and so of the loop, and of the target to begin with.
fn fingerprint(base: &[f64], harmonics: &Harmonics) -> u64 {
    let mut fingerprint = Fingerprint::new();
    fingerprint.numbers(base);
    let numbers: Vec<f64> = harmonics.numbers().collect();
    fingerprint.numbers(&numbers);
    fingerprint.finish()
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

/// What a period was like.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Trial {
    /// The largest magnitude of the measured error.
    pub max_error: f64,
    /// The root mean square of the measured error.
    pub rmse: f64,
    /// Whether it was used. If not, the loop was settling, or the error had grown to twice the best: the target went
    /// back to the best one then, and the steps were halved.
    pub accepted: bool,
}

/// Everything that an [`IterativeLearning`](super::IterativeLearning) remembers: restored, it continues bit for bit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct IterativeState {
    /// The fingerprint of the loop and of the target with which it began.
    pub model: u64,
    /// The sampling interval in seconds.
    pub dt: f64,
    /// How it learns.
    pub options: LearningOptions,
    /// The target of the next period, which may begin where the last one ended.
    pub target: Vec<f64>,
    /// The target without that beginning.
    pub goal: Vec<f64>,
    /// So many periods pass before the next one that is learned from.
    pub settling: u32,
    /// The target of the period with the least error, and the root mean square of that error.
    pub best: Vec<f64>,
    /// The root mean square of the least error; none before the first period.
    pub best_rmse: Option<f64>,
    /// What the periods so far tell of every harmonic; none before the first one.
    pub beliefs: Vec<Belief>,
    /// The variance of the noise in a harmonic.
    pub noise: f64,
    /// The share of a step that is taken: halved with every period that was not accepted, doubled where the error comes
    /// down.
    pub trust: f64,
    /// The first period that counts: those before are forgotten.
    pub since: usize,
    /// Whether learning has stopped because it no longer helps.
    pub finished: bool,
    /// What every period was like.
    pub trials: Vec<Trial>,
}

/// Checks what was believed of as many harmonics as there are, or of none.
fn check_beliefs(beliefs: &[Belief], harmonics: usize) -> Result<(), Error> {
    let holds = beliefs.is_empty() || beliefs.len() == harmonics;
    check_whole("state.beliefs", holds, "one for every harmonic, or none", beliefs.len())?;
    for (index, belief) in beliefs.iter().enumerate() {
        let [.., error_variance, response_variance] = belief.numbers();
        let wrong = belief.numbers().into_iter().find(|number| !is_admissible(*number));
        if let Some(got) = wrong.or([error_variance, response_variance].into_iter().find(|variance| *variance < 0.0)) {
            let expected = "finite numbers, variances not negative";
            return Err(Error::domain("state.beliefs", Some(index), expected, got));
        }
    }
    Ok(())
}
