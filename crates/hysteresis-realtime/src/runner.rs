//! The loop itself: one sample at every deadline, until it rests.

use std::hint::black_box;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

use hysteresis_control::StageController;
use hysteresis_core::{Command, ControllerOptions, Mode, is_admissible};

use crate::clock::Clock;
use crate::io::{Fault, Io};
use crate::recorder::{Row, Sender};
use crate::report::{Counts, EndReason, Live, StopFlag, Times, seconds};
use crate::schedule::{Deadlines, Pace, Schedule};
use crate::settings::{MissPolicy, Reference, Settings, WatchdogTimes};

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
        let observed = Observed {
            counts: Counts::default(),
            latency: Times::new(),
            compute: Times::new(),
            period: Times::new(),
            last_fault: None,
        };
        // What takes a while was made before.
        let start = clock.now() + nanoseconds(dt);
        Self {
            ahead,
            rest: Rest::new(settings),
            misses: settings.misses,
            spin: nanoseconds(settings.spin),
            most_write_faults: settings.write_faults,
            last: last_deadline(&reference, settings.seconds, dt),
            schedule: Schedule::new(dt, start),
            pace: Pace::new(slew, dt, start),
            step: f64::INFINITY,
            start,
            watchdog: Watchdog::new(settings.watchdog, start),
            phase: Phase::Running,
            holds: false,
            missing: 0,
            measurement: f64::NAN,
            write_faults: 0,
            began_before: None,
            observed,
            controller,
            io,
            clock,
            reference,
            stop,
            live,
            sender,
        }
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

    /// Sleeps, and spins for the last moments. Before it spins it looks at the coming sample without taking it: while
    /// others had the processor, code and tables have left its caches.
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

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates, and is not negative")]
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

/// What the watchdog makes of a sample.
#[derive(Clone, Copy, Debug)]
struct Judged {
    /// What the controller is given: NaN for nothing.
    measurement: f64,
    /// Whether the last fresh measurement is too old to stand in.
    stale: bool,
    /// Whether it is time to go to rest.
    pub(crate) rest: bool,
}

/// The age of the last fresh measurement, in nanoseconds.
#[derive(Clone, Debug)]
struct Watchdog {
    /// None for a loop that waits for ever: (stale after, rest after).
    times: Option<(u64, u64)>,
    last: f64,
    last_at: u64,
}

impl Watchdog {
    /// The time for the first measurement runs from `start`.
    pub(crate) fn new(times: Option<WatchdogTimes>, start: u64) -> Self {
        let times = times.map(|times| (nanoseconds(times.stale_after), nanoseconds(times.rest_after)));
        Self { times, last: f64::NAN, last_at: start }
    }

    /// `came` is what the input gave, fresh if it is also to be believed.
    #[inline]
    fn judge(&mut self, now: u64, came: Option<f64>, believed: bool) -> Judged {
        if let (Some(measurement), true) = (came, believed) {
            (self.last, self.last_at) = (measurement, now);
            return Judged { measurement, stale: false, rest: false };
        }
        // What is not believed goes on to the controller, which counts it.
        let missing = came.unwrap_or(f64::NAN);
        let Some((stale_after, rest_after)) = self.times else {
            return Judged { measurement: missing, stale: true, rest: false };
        };
        let age = now.saturating_sub(self.last_at);
        let stale = age >= stale_after || self.last.is_nan();
        let measurement = if stale { missing } else { self.last };
        Judged { measurement, stale, rest: age >= rest_after }
    }
}

/// The rest drive, and how often it was written.
#[derive(Debug)]
pub(crate) struct Rest {
    drive: f64,
    /// How fast the drive goes there.
    rate: f64,
    /// For how many samples in a row.
    written: u32,
    /// How many datagrams had been refused when it was written first.
    refused_before: u64,
    /// How many datagrams had been refused before the last measurement came.
    refused_before_measurement: u64,
}

impl Rest {
    pub(crate) fn new(settings: &Settings) -> Self {
        Self {
            drive: settings.rest_drive,
            rate: settings.rest_rate,
            written: 0,
            refused_before: 0,
            refused_before_measurement: 0,
        }
    }

    /// Takes what a sample wrote, if its write succeeded. True if that is enough.
    fn is_over(&mut self, written: Option<f64>, io: &impl Io) -> bool {
        self.written = if written == Some(self.drive) { self.written.saturating_add(1) } else { 0 };
        if self.written == 1 {
            self.refused_before = refused(io);
        }
        self.written >= io.rest_writes()
    }

    /// Whether the drive written last is the rest drive.
    pub(crate) fn is_reached(&self) -> bool {
        self.written > 0
    }

    /// For how many samples in a row the rest drive was written.
    pub(crate) fn written(&self) -> u32 {
        self.written
    }

    /// A measurement came, and so many datagrams had been refused before it was read.
    #[inline]
    fn take_measurement(&mut self, refused_before: u64) {
        self.refused_before_measurement = refused_before;
    }

    /// How often the other side has said that nobody listens: since the last measurement came or since the rest drive
    /// was written first, whichever is longer ago. Computers bound how often they say so, so the rest drive alone may
    /// not be answered. 0 if the rest drive was not written.
    pub(crate) fn refused(&self, io: &impl Io) -> u64 {
        let before = self.refused_before.min(self.refused_before_measurement);
        if self.is_reached() { refused(io).saturating_sub(before) } else { 0 }
    }
}

/// How many datagrams have been refused.
#[inline]
pub(crate) fn refused(io: &impl Io) -> u64 {
    io.datagrams().map_or(0, |counts| counts.refused)
}

#[cfg(test)]
mod tests {
    use hysteresis_control::stage::FeedForwardKind;
    use hysteresis_simulate::paper::Benchmark;

    use super::*;
    use crate::clock::SimulatedClock;
    use crate::recorder::ring;

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

    fn watchdog() -> Watchdog {
        Watchdog::new(Some(WatchdogTimes { stale_after: 2e-6, rest_after: 5e-6 }), 1000)
    }

    fn judge(watchdog: &mut Watchdog, now: u64, came: Option<f64>, believed: bool) -> (f64, bool, bool) {
        let Judged { measurement, stale, rest } = watchdog.judge(now, came, believed);
        (if measurement.is_nan() { -1.0 } else { measurement }, stale, rest)
    }

    #[test]
    fn the_last_one_stands_in_then_there_is_none_then_rest() {
        let mut watchdog = watchdog();
        assert_eq!(judge(&mut watchdog, 2000, Some(3.0), true), (3.0, false, false));
        assert_eq!(judge(&mut watchdog, 3999, None, false), (3.0, false, false));
        assert_eq!(judge(&mut watchdog, 4000, None, false), (-1.0, true, false));
        assert_eq!(judge(&mut watchdog, 6999, None, false), (-1.0, true, false));
        assert_eq!(judge(&mut watchdog, 7000, None, false), (-1.0, true, true));
    }

    #[test]
    fn a_fresh_one_starts_the_time_anew() {
        let mut watchdog = watchdog();
        judge(&mut watchdog, 5000, Some(3.0), true);
        assert_eq!(judge(&mut watchdog, 9999, Some(4.0), true), (4.0, false, false));
        assert_eq!(judge(&mut watchdog, 11_000, None, false), (4.0, false, false));
    }

    #[test]
    fn before_the_first_one_nothing_stands_in() {
        let mut watchdog = watchdog();
        assert_eq!(judge(&mut watchdog, 1001, None, false), (-1.0, true, false));
        assert_eq!(judge(&mut watchdog, 6000, None, false), (-1.0, true, true));
    }

    #[test]
    fn what_is_not_believed_is_not_fresh_and_is_passed_on_when_stale() {
        let mut watchdog = watchdog();
        judge(&mut watchdog, 2000, Some(3.0), true);
        assert_eq!(judge(&mut watchdog, 3000, Some(99.0), false), (3.0, false, false));
        assert_eq!(judge(&mut watchdog, 4000, Some(99.0), false), (99.0, true, false));
        assert_eq!(judge(&mut watchdog, 7000, Some(99.0), false), (99.0, true, true));
    }

    #[test]
    fn without_times_it_waits_for_ever() {
        let mut watchdog = Watchdog::new(None, 0);
        assert_eq!(judge(&mut watchdog, u64::MAX, None, false), (-1.0, true, false));
    }
}
