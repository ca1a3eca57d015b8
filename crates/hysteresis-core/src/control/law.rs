//! Equation (8) for one sample: from one state of the loop to the next.

use super::Mode;
use super::limiter::Limiter;
use super::state::LoopState;
use super::terms::Terms;
use crate::error::{Error, check_non_negative};

/// The gains of the feedback.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gains {
    pub(super) kp: f64,
    pub(super) ki: f64,
}

impl Gains {
    /// Negative gains would drive away from the reference.
    pub(super) fn new(kp: f64, ki: f64) -> Result<Self, Error> {
        Ok(Self { kp: check_non_negative("kp", None, kp)?, ki: check_non_negative("ki", None, ki)? })
    }

    /// The share of what the limiter cut off that the integral takes at a sample: one over the integral time.
    fn share(self) -> f64 {
        if self.ki < self.kp { self.ki / self.kp } else { 1.0 }
    }
}

/// What the integral keeps of a sample. The incremental laws start from the drive that went out: they are positional with
/// an integral that takes all of what the limiter cut off at once.
#[derive(Clone, Copy, Debug)]
pub(super) enum Keep {
    UnlessPushing,
    /// The share is that of the gains unless given.
    Tracking {
        share: Option<f64>,
    },
    WhatIsLeft,
    WhatIsLeftAndFeedForward,
}

/// What does not change from sample to sample.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rules {
    pub(super) gains: Gains,
    pub(super) keep: Keep,
    /// How many samples a transition takes.
    pub(super) fading: u32,
    pub(super) max_missing: u32,
}

/// Numbers that were found admissible.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    pub(super) reference: f64,
    pub(super) target: f64,
    /// Reference minus measurement, if there is one.
    pub(super) error: Option<f64>,
    /// Volts instead of those of the source.
    pub(super) given: Option<f64>,
}

impl Rules {
    /// The loop after a sample that is acted upon, whose feed-forward is `feedforward`.
    #[inline]
    pub(super) fn act(&self, before: &LoopState, limiter: &Limiter, sample: &Sample, feedforward: f64) -> LoopState {
        let feedback = sample.error.is_some() && before.mode == Mode::Run;
        let error = sample.error.unwrap_or(before.terms.error);
        let proportional = if feedback { self.gains.kp * error } else { 0.0 };
        let change = if feedback && before.resting == 0 { self.gains.ki * error } else { 0.0 };
        let integral = before.integral + change;
        let wanted = feedforward + proportional + integral;
        let last = before.terms.drive;
        let (transition, fading, demanded) = if before.started {
            let (transition, fading) = self.transition(before, feedback, proportional);
            (transition, fading, wanted + transition)
        } else {
            (last - wanted, if last == wanted { 0 } else { self.fading }, last)
        };
        let limited = limiter.limit(demanded, last);
        let kept = if feedback {
            self.kept(before.integral, change, demanded - limited.drive, feedforward)
        } else {
            before.integral
        };
        let given = sample.given.is_some();
        let resting = if before.started { before.resting.saturating_sub(1) } else { before.resting.min(fading) };
        let mut after = LoopState { integral: kept, started: true, fading, resting, feedback, given, ..*before };
        after.terms = Terms {
            reference: sample.reference,
            target: sample.target,
            error,
            feedforward,
            proportional,
            integral,
            transition,
            demanded,
            drive: limited.drive,
            saturated: limited.saturated,
            slewing: limited.slewing,
        };
        after.counters.saturated = before.counters.saturated.saturating_add(limited.saturated.into());
        after.counters.slewing = before.counters.slewing.saturating_add(limited.slewing.into());
        after
    }

    /// What is left of the transition, and for how many samples: it goes down by the same amount at every sample. The
    /// proportional term comes in from nothing, and goes out of what it was.
    #[inline]
    fn transition(&self, before: &LoopState, feedback: bool, proportional: f64) -> (f64, u32) {
        let (transition, fading) = if before.fading > 1 {
            let left = before.fading - 1;
            (before.terms.transition * (f64::from(left) / f64::from(before.fading)), left)
        } else {
            (0.0, 0)
        };
        if feedback && !before.feedback {
            (transition - proportional, self.fading)
        } else if before.feedback && !feedback {
            (transition + before.terms.proportional, self.fading)
        } else {
            (transition, fading)
        }
    }

    /// What the integral keeps, `excess` being what the limiter cut off.
    #[inline]
    fn kept(&self, integral: f64, change: f64, excess: f64, feedforward: f64) -> f64 {
        let sum = integral + change;
        match self.keep {
            Keep::UnlessPushing => {
                let pushing = (excess > 0.0 && change > 0.0) || (excess < 0.0 && change < 0.0);
                if pushing { integral } else { sum }
            }
            // Without integral action there is nothing that could wind up, nor bring back what is taken.
            Keep::Tracking { .. } if self.gains.ki == 0.0 => sum,
            Keep::Tracking { share } => sum - excess * share.unwrap_or_else(|| self.gains.share()),
            Keep::WhatIsLeft => sum - excess,
            Keep::WhatIsLeftAndFeedForward => sum - excess + feedforward,
        }
    }
}
