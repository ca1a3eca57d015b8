//! The loop itself: one sample at every deadline, until it rests.

use std::hint::black_box;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

use hysteresis_control::StageController;
use hysteresis_core::{Command, ControllerOptions, Mode, is_admissible};

use crate::clock::Clock;
use crate::io::{Fault, Io};
use crate::latency::{Times, seconds};
use crate::pace::Pace;
use crate::policy::{Deadlines, MissPolicy, Schedule};
use crate::reference::Reference;
use crate::report::{Counts, EndReason};
use crate::rest::{Rest, refused};
use crate::ring::{Row, Sender};
use crate::settings::Settings;
use crate::stop::{Live, StopFlag};
use crate::watchdog::Watchdog;

/// What the loop is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    Running,
    /// On the way to the rest drive.
    Resting(EndReason),
    Ended(EndReason),
}

/// How often things happened, and how long they took.
#[derive(Debug)]
pub(crate) struct Observed {
    pub(crate) counts: Counts,
    pub(crate) latency: Times,
    pub(crate) compute: Times,
    pub(crate) period: Times,
    pub(crate) last_fault: Option<Fault>,
}

/// A loop that is ready to run: all memory is there.
pub(crate) struct Loop<I, C> {
    pub(crate) controller: StageController,
    pub(crate) io: I,
    clock: C,
    reference: Reference,
    /// How many samples early references enter.
    ahead: u64,
    pub(crate) rest: Rest,
    misses: MissPolicy,
    /// In nanoseconds.
    spin: u64,
    most_write_faults: u32,
    /// The deadline at which it goes to rest, and why.
    last: Option<(u64, EndReason)>,
    stop: StopFlag,
    live: Arc<Live>,
    sender: Option<Sender>,
    schedule: Schedule,
    pace: Pace,
    /// How far the drive may move in a sample, besides the slew of the controller.
    step: f64,
    start: u64,
    watchdog: Watchdog,
    phase: Phase,
    /// Whether the present hold is one of this loop.
    holds: bool,
    /// Samples in a row without a measurement.
    missing: u32,
    /// What the controller was given last.
    measurement: f64,
    write_faults: u32,
    began_before: Option<u64>,
    observed: Observed,
}

/// What a loop is made of besides controller, input and output, and clock.
pub(crate) struct Surroundings {
    pub(crate) reference: Reference,
    pub(crate) stop: StopFlag,
    pub(crate) live: Arc<Live>,
    pub(crate) sender: Option<Sender>,
}

impl<I: Io, C: Clock> Loop<I, C> {
    /// The settings have been checked. The first deadline is one interval from now.
    pub(crate) fn new(controller: StageController, io: I, clock: C, settings: &Settings, around: Surroundings) -> Self {
        let Surroundings { reference, stop, live, sender } = around;
        let ControllerOptions { dt, slew, .. } = *controller.controller().options();
        let ahead = controller.controller().preview().map_or(0, |preview| preview.ahead() as u64);
        let mut made = Self {
            ahead,
            rest: Rest::new(settings),
            misses: settings.misses,
            spin: nanoseconds(settings.spin),
            most_write_faults: settings.write_faults,
            last: last_deadline(&reference, settings.seconds, dt),
            schedule: Schedule::new(dt, 0),
            pace: Pace::new(slew, dt, 0),
            step: f64::INFINITY,
            start: 0,
            watchdog: Watchdog::new(None, 0),
            phase: Phase::Running,
            holds: false,
            missing: 0,
            measurement: f64::NAN,
            write_faults: 0,
            began_before: None,
            observed: Observed {
                counts: Counts::default(),
                latency: Times::new(),
                compute: Times::new(),
                period: Times::new(),
                last_fault: None,
            },
            controller,
            io,
            clock,
            reference,
            stop,
            live,
            sender,
        };
        made.start = made.clock.now() + nanoseconds(dt);
        made.schedule = Schedule::new(dt, made.start);
        made.pace = Pace::new(slew, dt, made.start);
        made.watchdog = Watchdog::new(settings.watchdog, made.start);
        made
    }

    /// Runs until the drive rests, or cannot be written. Does not allocate, lock or log.
    pub(crate) fn run(&mut self) -> EndReason {
        loop {
            let deadline = self.schedule.deadline();
            self.wait_for(deadline);
            let began = self.clock.now();
            self.look_for_an_end();
            self.sample(began, began.saturating_sub(deadline));
            let done = self.clock.now();
            self.observe(began, deadline, done);
            let policy = if self.phase == Phase::Running { self.misses } else { MissPolicy::Skip };
            if self.schedule.advance(began, done, policy) && policy == MissPolicy::Stop {
                self.go_to_rest(EndReason::DeadlineMissed);
            }
            self.live.show_deadlines(&self.schedule.deadlines());
            if let Phase::Ended(reason) = self.phase {
                return reason;
            }
        }
    }

    /// Sleeps, and spins for the last moments. Before it spins it looks at the coming sample without taking it: while others had the
    /// processor, code and tables have left its caches.
    #[inline]
    fn wait_for(&mut self, deadline: u64) {
        self.clock.sleep_until(deadline.saturating_sub(self.spin));
        if self.spin > 0 && self.clock.now() < deadline {
            let command = self.reference.at(self.schedule.index().saturating_add(self.ahead)).into();
            black_box(self.controller.peek(command, self.measurement));
            self.clock.spin_until(deadline);
        }
    }

    #[inline]
    fn observe(&mut self, began: u64, deadline: u64, done: u64) {
        self.observed.latency.record(began.saturating_sub(deadline));
        self.observed.compute.record(done.saturating_sub(began));
        if let Some(before) = self.began_before.replace(began) {
            self.observed.period.record(began.saturating_sub(before));
        }
    }

    #[inline]
    fn look_for_an_end(&mut self) {
        if self.stop.is_requested() {
            self.go_to_rest(EndReason::Requested);
        } else if let Some((last, reason)) = self.last
            && self.schedule.index() >= last
        {
            self.go_to_rest(reason);
        }
    }

    /// From the next drive on, and for good. The first reason stays.
    fn go_to_rest(&mut self, reason: EndReason) {
        if self.phase != Phase::Running {
            return;
        }
        let stopped = self.controller.controller_mut().stop(self.rest.rate, self.rest.drive);
        // Rate and drive were checked before the start.
        self.phase = if stopped.is_ok() { Phase::Resting(reason) } else { Phase::Ended(reason) };
    }

    fn sample(&mut self, began: u64, late: u64) {
        let reference = self.reference.at(self.schedule.index());
        let measurement = self.measure(began);
        self.measurement = measurement;
        let command = self.reference.at(self.schedule.index().saturating_add(self.ahead));
        self.bound_step(late);
        self.put_out(command.into(), measurement);
        let drive = self.controller.controller().drive();
        if let Phase::Resting(reason) = self.phase {
            self.observed.counts.rest_samples += 1;
            let written = (self.write_faults == 0).then_some(drive);
            if self.rest.is_over(written, &self.io) {
                self.phase = Phase::Ended(reason);
            }
        }
        self.live.show_sample(measurement, drive, self.observed.counts.stale);
        if let Some(sender) = &mut self.sender {
            let time = seconds(began - self.start);
            sender.send(Row { time, reference, measurement, drive, lateness: seconds(late) });
        }
    }

    /// What the controller is given for a measurement.
    #[inline]
    fn measure(&mut self, now: u64) -> f64 {
        let refused_before = refused(&self.io);
        let came = match guarded(|| self.io.read()) {
            Ok(came) => came,
            Err(fault) => {
                self.observed.counts.read_faults += 1;
                self.take_fault(fault);
                None
            }
        };
        if came.is_some() {
            self.rest.take_measurement(refused_before);
        }
        let controller = self.controller.controller();
        let believed = came.is_some_and(|came| is_admissible(came) && controller.believes(came));
        let judged = self.watchdog.judge(now, came, believed);
        let counts = &mut self.observed.counts;
        *if believed {
            &mut counts.fresh
        } else if judged.stale {
            &mut counts.stale
        } else {
            &mut counts.stood_in
        } += 1;
        self.missing = if judged.stale { self.missing.saturating_add(1) } else { 0 };
        if judged.rest {
            self.go_to_rest(EndReason::Watchdog);
        }
        self.hold_without_measurements();
        judged.measurement
    }

    /// After `max_missing` samples the controller would go on by feed-forward alone.
    #[inline]
    fn hold_without_measurements(&mut self) {
        if self.phase != Phase::Running {
            return;
        }
        let controller = self.controller.controller_mut();
        if self.holds && self.missing == 0 {
            controller.release();
            self.holds = false;
        } else if !self.holds && self.missing > controller.options().max_missing && controller.mode() == Mode::Run {
            controller.hold();
            self.holds = true;
        }
        self.observed.counts.held += u64::from(self.holds);
    }

    /// Samples that are caught up drive no faster than those that are on time.
    #[inline]
    fn bound_step(&mut self, late: u64) {
        let step = self.pace.step(self.clock.now(), late);
        if step != self.step {
            self.controller.controller_mut().bound_step(step);
            self.step = step;
        }
    }

    #[inline]
    fn put_out(&mut self, command: Command, measurement: f64) {
        let before = self.controller.controller().drive();
        let drive = if I::WRITE_MAY_FAIL {
            self.controller.plan(command, measurement)
        } else {
            self.controller.step(command, measurement)
        };
        match guarded(|| self.io.write(drive)) {
            Ok(()) => {
                self.write_faults = 0;
                self.pace.moved(drive - before, self.clock.now());
                if I::WRITE_MAY_FAIL {
                    self.controller.commit();
                }
            }
            Err(fault) => {
                self.observed.counts.write_faults += 1;
                self.write_faults += 1;
                self.take_fault(fault);
                if self.write_faults >= self.most_write_faults {
                    self.phase = Phase::Ended(EndReason::WriteFailed);
                }
            }
        }
    }

    /// What raises once may do so again, but a drive must still go to rest.
    fn take_fault(&mut self, fault: Fault) {
        self.observed.last_fault = Some(fault);
        if matches!(fault, Fault::Panicked | Fault::Raised) {
            self.go_to_rest(EndReason::Panicked);
        }
    }

    pub(crate) fn observed(&self) -> &Observed {
        &self.observed
    }

    pub(crate) fn deadlines(&self) -> Deadlines {
        self.schedule.deadlines()
    }

    /// From the first deadline until now.
    pub(crate) fn seconds(&self) -> f64 {
        seconds(self.clock.now().saturating_sub(self.start))
    }

    /// Controller, input and output; the recorder is told that no more rows come.
    pub(crate) fn into_parts(mut self) -> (StageController, I) {
        self.controller.controller_mut().bound_step(f64::INFINITY);
        (self.controller, self.io)
    }

    /// Lets go of the ring, and returns how many rows were lost.
    pub(crate) fn close_ring(&mut self) -> u64 {
        self.sender.take().map_or(0, |sender| sender.lost())
    }
}

/// A panic of a driver must not leave the drive where it is.
#[inline]
fn guarded<T>(work: impl FnOnce() -> Result<T, Fault>) -> Result<T, Fault> {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or(Err(Fault::Panicked))
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most ten seconds")]
fn nanoseconds(time: f64) -> u64 {
    (time * 1e9).round() as u64
}

/// The deadline at which time or reference are over, whichever comes first.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates, and is not negative")]
fn last_deadline(reference: &Reference, seconds: Option<f64>, dt: f64) -> Option<(u64, EndReason)> {
    let time = seconds.map(|seconds| ((seconds / dt).round() as u64, EndReason::TimeOver));
    let length = reference.length().map(|length| (length, EndReason::ReferenceOver));
    time.into_iter().chain(length).min_by_key(|(deadline, _)| *deadline)
}

#[cfg(test)]
mod tests {
    use hysteresis_control::stage::FeedForwardKind;
    use hysteresis_simulate::paper::Benchmark;

    use super::*;
    use crate::clock::SimulatedClock;
    use crate::ring::ring;

    #[test]
    fn a_running_loop_does_not_allocate() {
        let stage = Benchmark::A1.stage();
        let options = stage.controller_options(1e-4, None).unwrap();
        let controller = stage.controller(FeedForwardKind::Inverse, &options).unwrap().into();
        let settings = Settings { seconds: Some(0.5), ..Settings::new(0.0, 1e4) };
        // Wakes up late at every 97th deadline, so that some are missed.
        let clock = SimulatedClock::waking_late(|deadline| if deadline % 97 == 0 { 250_000 } else { 1_000 });
        let (sender, _receiver) = ring(10);
        let reference = Reference::periodic((0..100).map(|k| 0.03 * f64::from(k)).collect()).unwrap();
        let around = Surroundings { reference, stop: StopFlag::default(), live: Arc::default(), sender: Some(sender) };
        let mut made = Loop::new(controller, Benchmark::A1.plant(0), clock, &settings, around);
        assert_eq!(allocations::count(|| assert_eq!(made.run(), EndReason::TimeOver)), 0);
        assert!(made.deadlines().missed > 10 && made.rest.is_reached());
    }
}
