//! What past drives leave for the next sample, known before its drive is: a loop that has shifted, and a gain.

use alloc::boxed::Box;
use alloc::vec::Vec;

use super::loop_shift::{LoopShiftTerms, Motion};
use super::slow_gain::{Activity, SlowGainTerms};
use crate::error::{Error, check_all_finite, check_length, check_non_negative};

/// The name under which a state has both.
const STATE: &str = "state.loop_shift";

/// How loop shift s and slow gain g change a position h: v = zero + g (h + s - zero).
#[derive(Clone, Debug)]
pub(super) struct PastDrives {
    /// s
    shift: f64,
    /// g, 1 / g, and zero (1 - g)
    gain: f64,
    reciprocal: f64,
    rest: f64,
    motion: Option<Motion>,
    activity: Option<Activity>,
}

impl PastDrives {
    /// At rest; nothing without either, so that all that both cost a stage that has none is one question per sample.
    pub(super) fn new(shift: Option<&LoopShiftTerms>, gain: Option<&SlowGainTerms>) -> Option<Box<Self>> {
        let (motion, activity) = (shift.map(Motion::new), gain.map(Activity::new));
        (motion.is_some() || activity.is_some())
            .then(|| Box::new(Self { shift: 0.0, gain: 1.0, reciprocal: 1.0, rest: 0.0, motion, activity }))
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
        if let Some(activity) = &mut self.activity {
            activity.settle(drive);
        }
        self.renew();
    }

    #[inline]
    fn renew(&mut self) {
        if let Some(motion) = &self.motion {
            self.shift = motion.shift();
        }
        if let Some(activity) = &self.activity {
            self.gain = activity.gain();
            self.reciprocal = 1.0 / self.gain;
            self.rest = activity.zero() * (1.0 - self.gain);
        }
    }

    /// m, n and f of the loop shift, then m and f of the slow gain.
    pub(super) fn states(&self) -> Vec<f64> {
        let motion = self.motion.as_ref().map(Motion::states);
        let activity = self.activity.as_ref().map(Activity::states);
        [motion, activity].into_iter().flatten().flatten().collect()
    }

    /// Whether `past`, which may be nothing, can be in this state.
    pub(super) fn check(past: Option<&Self>, states: &[f64]) -> Result<(), Error> {
        let has_motion = past.is_some_and(|past| past.motion.is_some());
        let has_activity = past.is_some_and(|past| past.activity.is_some());
        let of_motion = if has_motion { 3 } else { 0 };
        check_length(STATE, of_motion + if has_activity { 2 } else { 0 }, states.len())?;
        check_all_finite(STATE, states)?;
        let (motion, activity) = states.split_at_checked(of_motion).unwrap_or((states, &[]));
        // A mean of squares, and one of squares of at most 1.
        motion.first().map_or(Ok(()), |mean| check_non_negative(STATE, Some(0), *mean).map(drop))?;
        activity.first().map_or(Ok(()), |mean| Activity::check(STATE, of_motion, *mean))
    }

    /// Continues from states that were checked.
    pub(super) fn restore(&mut self, states: &[f64]) {
        let mut rest = states;
        if let (Some(motion), Some((first, others))) = (&mut self.motion, rest.split_first_chunk::<3>()) {
            motion.restore(*first);
            rest = others;
        }
        if let (Some(activity), [mean_square, follower]) = (&mut self.activity, rest) {
            activity.restore(*mean_square, *follower);
        }
        self.renew();
    }
}
