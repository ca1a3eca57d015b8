//! One sample of an array: first it is decided what becomes of it, in the work space alone; then it is taken.

use alloc::boxed::Box;
use alloc::vec;
use alloc::vec::Vec;

use super::super::law::{Mode, add, bumpless_share};
use super::super::limiter::{Limiter, approach};
use super::inverse::ArrayInverse;
use super::options::Gains;
use super::pairs::Pairs;
use crate::error::{MAX_MAGNITUDE, is_admissible};
use crate::stream::{Look, StreamArray};

/// How many samples, or drives, of an [`ArrayController`](super::ArrayController) were unusual.
///
/// ```
/// use hysteresis_core::{ArrayController, ArrayCounters, ArrayOptions, ArraySample, CompiledModel, Offsets};
/// use hysteresis_core::{PrandtlIshlinskii, StreamArray};
/// let model = PrandtlIshlinskii::new(&[1.0, 0.5], &[0.0, 2.0], Offsets::default())?;
/// let models = [CompiledModel::new(&(&model).into()), CompiledModel::new(&(&model).into())];
/// let inverse = StreamArray::inverse(&models, Some((-10.0, 10.0))).map_err(|wrong| wrong.error)?;
/// let mut controller = ArrayController::new(inverse, &ArrayOptions::new(1e-3))?;
/// controller.step(&ArraySample::of(&[f64::NAN, 1.0]), &mut [0.0; 2])?;
/// assert_eq!(controller.counters(), ArrayCounters { rejected_count: 1, ..ArrayCounters::default() });
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct ArrayCounters {
    /// Samples with a reference that is not finite (or beyond 1e100): all drives were held.
    pub rejected_count: u64,
    /// Samples with a measurement that is not finite (or beyond 1e100).
    pub missing_count: u64,
    /// Drives that a target out of reach brought to a limit.
    pub saturated_count: u64,
    /// Drives that the slew held back.
    pub slewing_count: u64,
    /// Samples in which the limits of differences moved at least one target.
    pub pair_limited_count: u64,
}

/// What is asked of one sample.
///
/// ```
/// use hysteresis_core::ArraySample;
/// let flat = ArraySample { measurement: Some(&[0.2]), ..ArraySample::of(&[0.0, 0.0]) };
/// assert_eq!(flat.sensor_reference, None);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct ArraySample<'a> {
    /// The positions that are wanted, M numbers in the unit of the models' output.
    pub reference: &'a [f64],
    /// What the S sensors show; none for feed-forward alone, the integral staying as it is.
    pub measurement: Option<&'a [f64]>,
    /// What the sensors are to show, S numbers: by default zero, or the reference if there is no reconstruction matrix.
    pub sensor_reference: Option<&'a [f64]>,
}

impl<'a> ArraySample<'a> {
    /// Positions without a measurement.
    #[must_use]
    pub fn of(reference: &'a [f64]) -> Self {
        Self { reference, measurement: None, sensor_reference: None }
    }
}

/// What changes from sample to sample, apart from the streams.
#[derive(Clone, Debug)]
pub(super) struct LoopState {
    pub(super) drives: Box<[f64]>,
    /// The positions at the last sample, of inverses whose positions drift.
    pub(super) positions: Box<[f64]>,
    pub(super) integral: Box<[f64]>,
    pub(super) bumpless: Box<[f64]>,
    pub(super) started: bool,
    pub(super) bumpless_samples: u32,
    pub(super) integral_rest_samples: u32,
    pub(super) mode: Mode,
    pub(super) stop_rate: f64,
    pub(super) rest_drives: Box<[f64]>,
    pub(super) counters: ArrayCounters,
}

impl LoopState {
    /// At rest at these drives.
    pub(super) fn at(drives: Vec<f64>) -> Self {
        let zeros = || vec![0.0; drives.len()].into_boxed_slice();
        Self {
            positions: zeros(),
            integral: zeros(),
            bumpless: zeros(),
            rest_drives: zeros(),
            drives: drives.into(),
            started: false,
            bumpless_samples: 0,
            integral_rest_samples: u32::MAX,
            mode: Mode::Run,
            stop_rate: 0.0,
            counters: ArrayCounters::default(),
        }
    }

    /// As made, but for the drives.
    pub(super) fn reset(&mut self) {
        self.integral.fill(0.0);
        self.bumpless.fill(0.0);
        self.bumpless_samples = 0;
        self.mode = Mode::Run;
        self.counters = ArrayCounters::default();
        self.end_motion();
    }

    /// The next sample starts a motion from the present drives, with an integral that rests at first.
    pub(super) fn end_motion(&mut self) {
        (self.started, self.integral_rest_samples) = (false, u32::MAX);
    }
}

/// What makes errors of actuators of those of sensors.
#[derive(Clone, Debug)]
pub(super) struct Feedback {
    /// The matrix R, column by column: then the products of a column with one error are independent of each other, and
    /// the sum of every actuator runs over the sensors in their order.
    columns: Option<Box<[f64]>>,
    actuators: usize,
    sensors: usize,
    /// The errors of the sensors.
    errors: Box<[f64]>,
}

impl Feedback {
    /// Of a checked matrix, row by row.
    pub(super) fn new(rows: Option<&[f64]>, actuators: usize, sensors: usize) -> Self {
        let columns = rows.map(|rows| {
            let column = |s: usize| rows.iter().skip(s).step_by(sensors).copied();
            (0..sensors).flat_map(column).collect()
        });
        Self { columns, actuators, sensors, errors: vec![0.0; sensors].into() }
    }

    pub(super) fn sensors(&self) -> usize {
        self.sensors
    }

    /// The errors of the actuators, NaN for those of which nothing is known: whether any measurement is missing.
    #[inline]
    pub(super) fn read(&mut self, sample: &ArraySample<'_>, errors: &mut [f64]) -> bool {
        let Some(measurement) = sample.measurement else {
            errors.fill(f64::NAN);
            return false;
        };
        let missing = !measurement.iter().copied().all(is_admissible);
        match (&self.columns, sample.sensor_reference) {
            (None, reference) => difference(reference.unwrap_or(sample.reference), measurement, errors),
            // Every actuator needs all sensors.
            (Some(_), _) if missing => errors.fill(f64::NAN),
            (Some(columns), reference) => {
                match reference {
                    Some(reference) => difference(reference, measurement, &mut self.errors),
                    None => self.errors.iter_mut().zip(measurement).for_each(|(error, y)| *error = -y),
                }
                errors.fill(0.0);
                for (column, error) in columns.chunks_exact(self.actuators.max(1)).zip(&self.errors) {
                    for (sum, gain) in errors.iter_mut().zip(column) {
                        *sum += gain * error;
                    }
                }
            }
        }
        missing
    }
}

/// Reference minus measurement, NaN for a measurement that is missing.
#[inline]
fn difference(reference: &[f64], measurement: &[f64], errors: &mut [f64]) {
    for ((error, r), y) in errors.iter_mut().zip(reference).zip(measurement) {
        *error = if is_admissible(*y) { r - y } else { f64::NAN };
    }
}

/// What a sample needs while it is decided upon: allocated once.
#[derive(Clone, Debug)]
pub(super) struct Work {
    /// The modelled positions from which the sample goes on.
    pub(super) present: Box<[f64]>,
    /// The changes of the integral.
    changes: Box<[f64]>,
    /// The targets as the law has them.
    pub(super) wanted: Box<[f64]>,
    /// The positions that are to be reached.
    pub(super) positions: Box<[f64]>,
    /// The positions for which limits of differences are worked out.
    pub(super) targets: Box<[f64]>,
    /// The drives that reach the positions.
    pub(super) drives: Box<[f64]>,
    /// Whether the inverse alone comes to the drive, with its target.
    by_target: Box<[bool]>,
}

impl Work {
    pub(super) fn new(actuators: usize) -> Self {
        let zeros = || vec![0.0; actuators].into_boxed_slice();
        Self {
            present: zeros(),
            changes: zeros(),
            wanted: zeros(),
            positions: zeros(),
            targets: zeros(),
            drives: zeros(),
            by_target: vec![false; actuators].into(),
        }
    }
}

/// All actuators side by side, as the law moves them from sample to sample.
///
/// The law of one axis is another one: its integral is in volts, behind the inverse, this one is a displacement in
/// front of it. So the two have in common what stands around a loop: modes, limiter, counts, the way a bumpless term
/// goes to zero, checks of options and states. A step of the law is a loop of its own over plain arrays, as a processor
/// takes those as vectors.
#[derive(Clone, Debug)]
pub(super) struct Lanes<P> {
    pub(super) inverse: StreamArray<P>,
    pub(super) limiters: Box<[Limiter]>,
    pub(super) gains: Gains,
    pub(super) feedback: Feedback,
    pub(super) pairs: Pairs,
    pub(super) dt: f64,
    pub(super) bumpless_samples: u32,
    pub(super) now: LoopState,
    pub(super) work: Work,
}

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

impl<P: ArrayInverse> Lanes<P> {
    /// Takes a sample.
    pub(super) fn take(&mut self, sample: &ArraySample<'_>) {
        let decision = self.decide(sample);
        self.commit(sample, &decision);
    }

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
        let bumpless_share = bumpless_share(now.bumpless_samples).unwrap_or(0.0);
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
        let Self { work, now, limiters, inverse, dt, .. } = self;
        let step = now.stop_rate * *dt;
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
        let actuators = || inverse.streams().iter().zip(limiters.iter()).zip(&now.drives);
        for ((present, last), ((stream, limiter), drive)) in
            work.present.iter_mut().zip(&now.positions).zip(actuators())
        {
            *present = if P::DRIFTS { nearest(stream, limiter, *drive, *last) } else { stream.reached() };
        }
        if !pairs.begin(&work.present, &work.positions) {
            return;
        }
        decision.pair_limited = true;
        copy(&mut work.targets, &work.positions);
        pairs.draw_together(&mut work.targets);
        // What is drawn together may be out of reach.
        for (target, ((stream, limiter), last)) in work.targets.iter_mut().zip(actuators()) {
            *target = nearest(stream, limiter, *last, *target);
        }
        pairs.approach(&work.present, &work.targets, &mut work.positions);
        let out = work.drives.iter_mut().zip(&mut work.by_target);
        for (((drive, by_target), position), ((stream, limiter), last)) in out.zip(&work.positions).zip(actuators()) {
            *drive = limiter.limit(stream.peek(*position), *last).drive;
            *by_target = false;
        }
    }

    /// Takes the sample as it was decided.
    fn commit(&mut self, sample: &ArraySample<'_>, decision: &Decision) {
        match decision.status {
            Status::Held => self.wait(),
            Status::Rejected => {
                self.wait();
                self.now.started = false;
                add(&mut self.now.counters.rejected_count, 1);
            }
            Status::Starting => {
                self.start(sample);
                self.wait();
            }
            Status::Stopping => self.move_streams(),
            Status::Moving => {
                self.move_streams();
                self.keep_terms();
            }
        }
        let counters = &mut self.now.counters;
        add(&mut counters.missing_count, decision.missing.into());
        add(&mut counters.saturated_count, decision.saturated);
        add(&mut counters.slewing_count, decision.slewing);
        add(&mut counters.pair_limited_count, decision.pair_limited.into());
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

    /// The drives stay.
    #[inline]
    fn wait(&mut self) {
        self.note_positions();
        self.inverse.streams_mut().iter_mut().for_each(P::wait);
    }

    /// The positions at this sample are those of drives that stay.
    #[inline]
    pub(super) fn note_positions(&mut self) {
        if P::DRIFTS {
            let positions = self.now.positions.iter_mut().zip(self.inverse.streams());
            positions.for_each(|(position, stream)| *position = stream.reached());
        }
    }

    /// The inverses remember the drives that go out.
    #[inline]
    fn move_streams(&mut self) {
        let Self { work, now, inverse, .. } = self;
        let streams = inverse.streams_mut().iter_mut().zip(work.by_target.iter().zip(&work.wanted));
        for ((stream, (by_target, wanted)), (last, drive)) in streams.zip(now.drives.iter_mut().zip(&work.drives)) {
            if *by_target {
                stream.step(*wanted);
            } else {
                advance(stream, *last, *drive);
            }
            *last = *drive;
        }
        if P::DRIFTS {
            copy(&mut now.positions, &work.positions);
        }
    }

    /// What integral and bumpless term are after a sample.
    #[inline]
    fn keep_terms(&mut self) {
        let Self { work, now, .. } = self;
        let bumpless_share = bumpless_share(now.bumpless_samples).unwrap_or(0.0);
        let terms = now.integral.iter_mut().zip(&mut now.bumpless).zip(&work.changes);
        for (((integral, bumpless), change), (wanted, position)) in terms.zip(work.wanted.iter().zip(&work.positions)) {
            *integral += followed(*change, wanted - position);
            *bumpless *= bumpless_share;
        }
        now.bumpless_samples = now.bumpless_samples.saturating_sub(1);
        now.integral_rest_samples = now.integral_rest_samples.saturating_sub(1);
    }
}

/// The position nearest to a target that the drive may lead to.
#[inline]
fn nearest<P: ArrayInverse>(stream: &P, limiter: &Limiter, last: f64, target: f64) -> f64 {
    let Look { drive: wanted, reached, .. } = stream.look(target);
    let drive = limiter.limit(wanted, last).drive;
    if drive == wanted { reached } else { stream.look_at_drive(drive) }
}

/// An inverse remembers a drive, which may be the last one.
#[inline]
pub(super) fn advance<P: ArrayInverse>(stream: &mut P, last: f64, drive: f64) {
    if drive == last {
        stream.wait();
    } else {
        stream.follow_drive(drive);
    }
}

/// Copies as many numbers as both have.
#[inline]
pub(super) fn copy(to: &mut [f64], from: &[f64]) {
    to.iter_mut().zip(from).for_each(|(to, from)| *to = *from);
}

/// What of a change of the integral an actuator follows, `excess` being what limits cut off the target. A change that
/// brings the target back from a limit is taken as it is.
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
    use super::*;

    #[test]
    fn what_limits_cut_off_is_taken_from_a_change_that_pushes_against_them() {
        let cases = [(1.0, 0.25, 0.75), (-1.0, -0.25, -0.75), (1.0, 2.0, 0.0), (-1.0, -2.0, 0.0)];
        let back = [(1.0, -0.25, 1.0), (-1.0, 0.25, -1.0), (0.5, 0.0, 0.5), (0.0, -1.0, 0.0)];
        for (change, excess, expected) in cases.into_iter().chain(back) {
            assert_eq!(followed(change, excess), expected, "{change} with {excess}");
        }
    }
}
