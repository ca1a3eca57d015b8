//! One sample: first it is decided what becomes of it, in the work space alone; then it is taken.

use super::controller::{ArrayController, ArraySample, Work, copy};
use super::counters::count;
use crate::control::Mode;
use crate::control::limiter::approach;
use crate::error::{MAX_MAGNITUDE, is_admissible};
use crate::process::Process;

/// What becomes of a sample.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Status {
    /// Nothing: a hold.
    Held,
    /// The next drives of a stop.
    Stopping,
    /// A reference is not admissible.
    Rejected,
    /// A motion starts from the present drives.
    Starting,
    /// The law is at work.
    Moving,
}

/// What was decided, beside what the work space has.
#[derive(Clone, Copy, Debug)]
pub(super) struct Decision {
    status: Status,
    missing: bool,
    saturated: u64,
    slewing: u64,
    pair_limited: bool,
}

impl ArrayController {
    /// Writes the next drives, and how they come about, to the work space.
    pub(super) fn decide(&mut self, sample: &ArraySample<'_>) -> Decision {
        let status = self.status(sample);
        let mut decision = Decision { status, missing: false, saturated: 0, slewing: 0, pair_limited: false };
        match status {
            Status::Held | Status::Rejected => copy(&mut self.work.drives, &self.now.drives),
            Status::Starting => {
                decision.missing = self.feedback.read(sample, &mut self.work.changes);
                copy(&mut self.work.drives, &self.now.drives);
            }
            Status::Stopping => {
                self.next_of_stop();
                self.keep_together(&mut decision);
            }
            Status::Moving => {
                decision.missing = self.feedback.read(sample, &mut self.work.changes);
                self.wish(sample);
                self.reach_wanted(&mut decision);
                self.keep_together(&mut decision);
            }
        }
        decision
    }

    fn status(&self, sample: &ArraySample<'_>) -> Status {
        let usable = |numbers: &[f64]| numbers.iter().copied().all(is_admissible);
        match self.now.mode {
            Mode::Hold => Status::Held,
            Mode::Stop => Status::Stopping,
            Mode::Run | Mode::Feedforward => {
                if !usable(sample.reference) || !sample.sensor_reference.is_none_or(usable) {
                    Status::Rejected
                } else if self.now.started {
                    Status::Moving
                } else {
                    Status::Starting
                }
            }
        }
    }

    /// The changes of the integral, from the errors of the actuators, and the targets.
    #[inline]
    fn wish(&mut self, sample: &ArraySample<'_>) {
        let Self { work: Work { changes, wanted, .. }, now, gains, .. } = self;
        let rests = now.integral_rest_samples > 0;
        let bumpless_share = now.bumpless_share();
        let state = now.integral.iter().zip(&now.bumpless);
        for (((change, wanted), reference), (integral, bumpless)) in
            changes.iter_mut().zip(wanted).zip(sample.reference).zip(state)
        {
            // An error that is not known is NaN.
            let next = gains.ki * *change - gains.leak * integral;
            *change = if rests || change.is_nan() { 0.0 } else { next.clamp(-MAX_MAGNITUDE, MAX_MAGNITUDE) };
            *wanted = reference + (integral + *change) + bumpless * bumpless_share;
        }
    }

    /// The drives and positions for the targets, each actuator by itself.
    #[inline]
    fn reach_wanted(&mut self, decision: &mut Decision) {
        let Self { work, now, limiters, inverse, .. } = self;
        let out = work.positions.iter_mut().zip(&mut work.drives).zip(&mut work.by_target);
        let actuators = inverse.streams().iter().zip(limiters.iter()).zip(&now.drives);
        for ((((position, drive), by_target), wanted), ((stream, limiter), last)) in
            out.zip(&work.wanted).zip(actuators)
        {
            let look = stream.look(*wanted);
            *drive = limiter.limit(look.drive, *last).drive;
            *by_target = *drive == look.drive;
            *position = match (*by_target, look.saturated) {
                (true, false) => *wanted,
                (true, true) => look.reached,
                (false, _) => stream.look_at_drive(*drive),
            };
            decision.saturated += u64::from(look.saturated);
            decision.slewing += u64::from(!*by_target);
        }
    }

    /// The drives and positions of a stop, each actuator by itself.
    #[inline]
    fn next_of_stop(&mut self) {
        let Self { work, now, limiters, inverse, options, .. } = self;
        let step = now.stop_rate * options.dt;
        let out = work.positions.iter_mut().zip(&mut work.drives).zip(&mut work.by_target);
        let drives = now.rest_drives.iter().zip(&now.drives);
        for ((((position, drive), by_target), (rest, last)), (stream, limiter)) in
            out.zip(drives).zip(inverse.streams().iter().zip(limiters.iter()))
        {
            *drive = limiter.limit(approach(*rest, *last, step), *last).drive;
            *by_target = false;
            *position = stream.look_at_drive(*drive);
        }
    }

    /// Replaces drives and positions where the positions of neighbours would be too far apart.
    #[inline]
    fn keep_together(&mut self, decision: &mut Decision) {
        if self.pairs.is_empty() {
            return;
        }
        let Self { work, now, limiters, inverse, pairs, .. } = self;
        for (present, stream) in work.present.iter_mut().zip(inverse.streams()) {
            *present = stream.reached();
        }
        if !pairs.begin(&work.present, &work.positions) {
            return;
        }
        decision.pair_limited = true;
        copy(&mut work.targets, &work.positions);
        pairs.draw_together(&mut work.targets);
        let actuators = || inverse.streams().iter().zip(limiters.iter()).zip(&now.drives);
        // What is drawn together may be out of reach.
        for (target, ((stream, limiter), last)) in work.targets.iter_mut().zip(actuators()) {
            let look = stream.look(*target);
            let drive = limiter.limit(look.drive, *last).drive;
            *target = if drive == look.drive { look.reached } else { stream.look_at_drive(drive) };
        }
        pairs.approach(&work.present, &work.targets, &mut work.positions);
        let out = work.drives.iter_mut().zip(&mut work.by_target);
        for (((drive, by_target), position), ((stream, limiter), last)) in out.zip(&work.positions).zip(actuators()) {
            *drive = limiter.limit(stream.peek(*position), *last).drive;
            *by_target = false;
        }
    }

    /// Takes the sample as it was decided.
    pub(super) fn commit(&mut self, sample: &ArraySample<'_>, decision: &Decision) {
        match decision.status {
            Status::Held => {}
            Status::Rejected => {
                self.now.started = false;
                count(&mut self.now.counters.rejected_count, 1);
            }
            Status::Starting => self.start(sample),
            Status::Stopping => self.move_streams(),
            Status::Moving => {
                self.move_streams();
                self.keep_terms();
            }
        }
        let counters = &mut self.now.counters;
        count(&mut counters.missing_count, decision.missing.into());
        count(&mut counters.saturated_count, decision.saturated);
        count(&mut counters.slewing_count, decision.slewing);
        count(&mut counters.pair_limited_count, decision.pair_limited.into());
    }

    /// Begins a motion at the present positions.
    #[inline]
    fn start(&mut self, sample: &ArraySample<'_>) {
        let Self { now, inverse, .. } = self;
        let terms = now.bumpless.iter_mut().zip(&now.integral);
        for (((bumpless, integral), reference), stream) in terms.zip(sample.reference).zip(inverse.streams()) {
            *bumpless = stream.reached() - (reference + integral);
        }
        now.started = true;
        now.bumpless_samples = self.bumpless_samples;
        now.integral_rest_samples = now.integral_rest_samples.min(self.bumpless_samples);
    }

    /// The inverses remember the drives that go out.
    #[inline]
    fn move_streams(&mut self) {
        let Self { work, now, inverse, .. } = self;
        let streams = inverse.streams_mut().iter_mut().zip(work.by_target.iter().zip(&work.wanted));
        for ((stream, (by_target, wanted)), (last, drive)) in streams.zip(now.drives.iter_mut().zip(&work.drives)) {
            if *by_target {
                stream.step(*wanted);
            } else if drive != last {
                stream.follow_drive(*drive);
            }
            *last = *drive;
        }
    }

    /// What integral and bumpless term are after a sample.
    #[inline]
    fn keep_terms(&mut self) {
        let Self { work, now, .. } = self;
        let bumpless_share = now.bumpless_share();
        let terms = now.integral.iter_mut().zip(&mut now.bumpless).zip(&work.changes);
        for (((integral, bumpless), change), (wanted, position)) in terms.zip(work.wanted.iter().zip(&work.positions)) {
            *integral += followed(*change, wanted - position);
            *bumpless *= bumpless_share;
        }
        now.bumpless_samples = now.bumpless_samples.saturating_sub(1);
        now.integral_rest_samples = now.integral_rest_samples.saturating_sub(1);
    }
}

/// What of a change of the integral an actuator follows, `excess` being what limits cut off the target. A change that brings the
/// target back from a limit is taken as it is.
#[inline]
fn followed(change: f64, excess: f64) -> f64 {
    if change > 0.0 && excess > 0.0 {
        (change - excess).max(0.0)
    } else if change < 0.0 && excess < 0.0 {
        (change - excess).min(0.0)
    } else {
        change
    }
}

#[cfg(test)]
mod tests {
    use super::followed;

    #[test]
    fn what_limits_cut_off_is_taken_from_a_change_that_pushes_against_them() {
        let cases = [(1.0, 0.25, 0.75), (-1.0, -0.25, -0.75), (1.0, 2.0, 0.0), (-1.0, -2.0, 0.0)];
        let back = [(1.0, -0.25, 1.0), (-1.0, 0.25, -1.0), (0.5, 0.0, 0.5), (0.0, -1.0, 0.0)];
        for (change, excess, expected) in cases.into_iter().chain(back) {
            assert_eq!(followed(change, excess), expected, "{change} with {excess}");
        }
    }
}
