//! What past drives leave for the next sample, known before its drive is: a loop that has shifted, plays that have
//! relaxed, and a gain.

use alloc::boxed::Box;
use alloc::vec::Vec;

use super::loop_shift::Motion;
use super::parts::QuasiStatic;
use super::relaxing_plays::Relaxation;
use super::slow_gain::Activity;
use crate::error::{Error, check_all_finite, check_length, check_non_negative};

/// The name under which a state has all of them.
const STATE: &str = "state.loop_shift";

/// How loop shift and relaxing plays, together s, and slow gain g change a position h: v = zero + g (h + s - zero).
#[derive(Clone, Debug)]
pub(super) struct PastDrives {
    /// s
    shift: f64,
    /// g, 1 / g, and zero (1 - g)
    gain: f64,
    reciprocal: f64,
    rest: f64,
    motion: Option<Motion>,
    relaxation: Option<Relaxation>,
    activity: Option<Activity>,
}

impl PastDrives {
    /// At rest; nothing without any, so that all that they cost a stage that has none is one question per sample.
    pub(super) fn new(model: &QuasiStatic) -> Option<Box<Self>> {
        let motion = model.loop_shift.as_ref().map(Motion::new);
        let relaxation = model.relaxing_plays.as_deref().map(Relaxation::new);
        let activity = model.slow_gain.as_ref().map(Activity::new);
        let is_any = motion.is_some() || relaxation.is_some() || activity.is_some();
        is_any
            .then(|| Box::new(Self { shift: 0.0, gain: 1.0, reciprocal: 1.0, rest: 0.0, motion, relaxation, activity }))
    }

    /// v for h.
    #[inline]
    pub(super) fn added(&self, h: f64) -> f64 {
        self.rest + self.gain * (h + self.shift)
    }

    /// h for v.
    #[inline]
    pub(super) fn removed(&self, v: f64) -> f64 {
        self.reciprocal * (v - self.rest) - self.shift
    }

    /// Holds a drive for one sampling interval.
    #[inline]
    pub(super) fn hold(&mut self, drive: f64) {
        if let Some(motion) = &mut self.motion {
            motion.hold(drive);
        }
        if let Some(relaxation) = &mut self.relaxation {
            relaxation.hold(drive);
        }
        if let Some(activity) = &mut self.activity {
            activity.hold(drive);
        }
        self.renew();
    }

    /// The drive has been held since forever.
    pub(super) fn settle(&mut self, drive: f64) {
        if let Some(motion) = &mut self.motion {
            motion.settle(drive);
        }
        if let Some(relaxation) = &mut self.relaxation {
            relaxation.settle(drive);
        }
        if let Some(activity) = &mut self.activity {
            activity.settle(drive);
        }
        self.renew();
    }

    #[inline]
    fn renew(&mut self) {
        let shifted = self.motion.as_ref().map_or(0.0, Motion::shift);
        self.shift = self.relaxation.as_ref().map_or(shifted, |relaxation| shifted + relaxation.relaxed());
        if let Some(activity) = &self.activity {
            self.gain = activity.gain();
            self.reciprocal = 1.0 / self.gain;
            self.rest = activity.zero() * (1.0 - self.gain);
        }
    }

    /// m, n and f of the loop shift, then m and f of the slow gain, then z and s of the relaxing plays.
    pub(super) fn states(&self) -> Vec<f64> {
        let motion = self.motion.as_ref().map(Motion::states);
        let activity = self.activity.as_ref().map(Activity::states);
        let relaxation = self.relaxation.as_ref().map(Relaxation::states);
        [motion, activity, relaxation].into_iter().flatten().flatten().collect()
    }

    /// How many of the states belong to the loop shift, and to that and the slow gain.
    fn ends(&self) -> (usize, usize) {
        let of_motion = if self.motion.is_some() { 3 } else { 0 };
        (of_motion, of_motion + if self.activity.is_some() { 2 } else { 0 })
    }

    /// Whether `past`, which may be nothing, can be in this state.
    pub(super) fn check(past: Option<&Self>, states: &[f64]) -> Result<(), Error> {
        let (of_motion, of_both) = past.map_or((0, 0), Self::ends);
        let relaxation = past.and_then(|past| past.relaxation.as_ref());
        check_length(STATE, of_both + relaxation.map_or(0, Relaxation::states_len), states.len())?;
        check_all_finite(STATE, states)?;
        // A mean of squares, and one of squares of at most 1.
        if let Some(mean) = states.first().filter(|_| of_motion > 0) {
            check_non_negative(STATE, Some(0), *mean)?;
        }
        match states.get(of_motion).filter(|_| of_both > of_motion) {
            Some(mean) => Activity::check(STATE, of_motion, *mean),
            None => Ok(()),
        }
    }

    /// Continues from states that were checked.
    pub(super) fn restore(&mut self, states: &[f64]) {
        let mut rest = states;
        if let (Some(motion), Some((first, others))) = (&mut self.motion, rest.split_first_chunk::<3>()) {
            motion.restore(*first);
            rest = others;
        }
        if let (Some(activity), [mean_square, follower, others @ ..]) = (&mut self.activity, rest) {
            activity.restore(*mean_square, *follower);
            rest = others;
        }
        if let Some(relaxation) = &mut self.relaxation {
            relaxation.restore(rest);
        }
        self.renew();
    }
}
