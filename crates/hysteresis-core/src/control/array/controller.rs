//! The controller of an array: its samples, changes while it runs, and what it remembers.

use alloc::boxed::Box;
use alloc::vec::Vec;

use super::super::law::{Mode, check_terms};
use super::super::limiter::Limiter;
use super::super::options::{bumpless_samples, check_stop, check_unchanged};
use super::inverse::ArrayInverse;
use super::law::{ArrayCounters, ArraySample, Feedback, Lanes, LoopState, Work, advance, copy};
use super::options::{ArrayOptions, Gains};
use super::pairs::Pairs;
use crate::engine::CompiledModel;
use crate::error::{
    Bound, Error, check_all_finite, check_each_between, check_length, check_positive, check_rows, check_rows_between,
    no_such,
};
use crate::stream::{Inverse, StreamArray, StreamState};

/// Feed-forward through the exact inverses of M actuators, and an integral behind a reconstruction matrix, within
/// limits at every sample.
///
/// The inverses are those of models of plays, [`Inverse`], or of stages without their fast dynamics,
/// [`QuasiStaticInverse`](crate::QuasiStaticInverse).
///
/// ```text
/// a_i(k) = a_i(k-1) + dt (ki e_i(k) - leak a_i(k-1)),   e = R (sensor reference - measurement)
/// target_i(k) = reference_i(k) + a_i(k) + bumpless_i(k),   u_i(k) = H_i^-1[target_i](k)
/// ```
///
/// R is the M x S matrix [`reconstruction`](ArrayOptions::reconstruction), and the sensor reference is zero unless it
/// is given: the feedback brings the sensors to zero, as a mirror flattens a wavefront. Without a matrix sensor i
/// measures actuator i, and the sensor reference is the reference. References, integral and bumpless term are
/// displacements, in the unit of the models' output; ki and leak are per second. Behind the exact inverse the loop is
/// linear, so one gain suits all actuators.
///
/// **Drives** are always finite, within the limits of their inverses and no farther than slew times dt from the last
/// ones. The inverses remember the drives that go out, so what feedback, slew and limits do to them is part of their
/// memory. Where limits hold an actuator back, its integral takes of its change what the actuator can follow, and no
/// more.
///
/// **Differences.** The modelled positions of a pair of [`neighbours`](ArrayOptions::neighbours) are never farther
/// apart than [`max_difference`](ArrayOptions::max_difference). A pair that is too far apart at the start never grows.
/// Targets that are too far apart are drawn together; then the actuators go from the present positions, which satisfy
/// all limits, towards these targets as far as all limits allow. The promise holds as far as rounding errors of
/// positions are below 1e-9 of the difference, which is kept as a margin.
///
/// Creep and loop shift of a stage move its position also while its drive stays. The controller counters that in every
/// motion and every stop. Only in samples in which the drives stay, and where limits or slew hold a drive back, may a
/// pair creep apart; the next motion does not let it grow.
///
/// **No jumps.** A motion starts from the present drives: at the first sample, after [`reset`](Self::reset), a hold or
/// a stop, and after samples that were rejected. The first drives are the last ones, to the bit. `bumpless` is the
/// difference, and goes to zero in a straight line over [`bumpless_time`](ArrayOptions::bumpless_time). From the first
/// sample of all, after a reset, a hold and a stop the integral rests for that time.
///
/// **Bad samples.** A reference that is not finite (or beyond 1e100) holds all drives. A measurement that is not finite
/// lets the integral rest: that of its actuator without a matrix, all of them with one. Feed-forward goes on. Both are
/// counted.
///
/// [`step`](Self::step), [`peek`](Self::peek), [`run`](Self::run), [`stop`](Self::stop) and the changes of mode and
/// gains do not allocate, lock, panic, log or read a clock.
///
/// ```
/// use hysteresis_core::{ArrayController, ArrayOptions, ArraySample, CompiledModel, ModifiedPrandtlIshlinskii, Offsets};
/// use hysteresis_core::{Ratios, StreamArray};
/// let weights = [4.3e-3, 1.7e-3, 1.7e-3]; // um/V
/// let model = ModifiedPrandtlIshlinskii::from_ratios(&weights, &[0.0, 150.0, 300.0], Ratios::PAPER, Offsets::default())?;
/// let models = vec![CompiledModel::new(&model); 2];
/// let mut mirror = StreamArray::forward(&models);
/// let inverse = StreamArray::inverse(&models, Some((-500.0, 500.0)))?;
/// let options = ArrayOptions { ki: 200.0, ..ArrayOptions::new(1e-3) }; // 1/s, s
/// let mut controller = ArrayController::new(inverse, &options)?;
/// let (mut drives, mut positions, mut measured) = ([0.0; 2], [0.0; 2], [0.0; 2]);
/// for _ in 0..100 {
///     let sample = ArraySample { measurement: Some(&measured), ..ArraySample::of(&[1.0, -0.5]) };
///     controller.step(&sample, &mut drives)?;
///     mirror.step(&drives, &mut positions)?;
///     measured = positions.map(|p| p + 0.1); // a disturbance that only the sensors know of
/// }
/// assert!((measured[0] - 1.0).abs() < 1e-6 && (measured[1] + 0.5).abs() < 1e-6);
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct ArrayController<P = Inverse> {
    lanes: Lanes<P>,
    limits: Box<[(f64, f64)]>,
    options: ArrayOptions,
}

impl<P: ArrayInverse> ArrayController<P> {
    /// A controller that goes on from the memory of the inverses, each of which has its limits.
    ///
    /// The inverses then take over the start drives, as a move from where they are.
    ///
    /// # Errors
    /// [`Error::Domain`], [`Error::Length`] or [`Error::Empty`] that name the option, what was expected and what came;
    /// [`Error::Whole`] for an inverse behind an amplifier, whose position at a sample is that of earlier drives too.
    pub fn new(inverse: StreamArray<P>, options: &ArrayOptions) -> Result<Self, Error> {
        let actuators = inverse.len();
        if actuators == 0 {
            return Err(Error::Empty { parameter: "inverse" });
        }
        let dt = check_positive("dt", options.dt)?;
        let limits = limits(&inverse)?;
        let gains = Gains::new(options.ki, options.leak, dt)?;
        let feedback = Feedback::new(options.reconstruction.as_deref(), actuators, options.sensors(actuators)?);
        let slew = options.checked_slew(actuators)?;
        let limiters = limits.iter().enumerate().map(|(i, limits)| Limiter::of(*limits, slew(i), dt)).collect();
        let pairs = Pairs::new(options, actuators)?;
        let bumpless_samples = bumpless_samples(options.bumpless_time, dt)?;
        let start = match &options.start_drive {
            Some(drives) => drives.clone(),
            None => limits.iter().map(|(low, high)| 0.0_f64.max(*low).min(*high)).collect(),
        };
        check_each_between("start_drive", &start, limits.iter().copied())?;
        let now = LoopState::at(start);
        let (work, options) = (Work::new(actuators), options.clone());
        let lanes = Lanes { inverse, limiters, gains, feedback, pairs, dt, bumpless_samples, now, work };
        let mut made = Self { lanes, limits, options };
        made.move_to_present_drives();
        Ok(made)
    }

    /// Takes one sample and writes the M drives.
    ///
    /// # Errors
    /// [`Error::Length`] unless reference and drives have M elements, measurement and sensor reference S; nothing is
    /// taken then.
    pub fn step(&mut self, sample: &ArraySample<'_>, drives: &mut [f64]) -> Result<(), Error> {
        self.check(sample, drives)?;
        self.lanes.take(sample);
        copy(drives, &self.lanes.now.drives);
        Ok(())
    }

    /// The drives that [`step`](Self::step) would write, without taking the sample. It needs the controller's work
    /// space, and changes nothing else.
    ///
    /// # Errors
    /// As for [`step`](Self::step).
    pub fn peek(&mut self, sample: &ArraySample<'_>, drives: &mut [f64]) -> Result<(), Error> {
        self.check(sample, drives)?;
        self.lanes.decide(sample);
        copy(drives, &self.lanes.work.drives);
        Ok(())
    }

    /// Takes a block of samples, row by row: bit for bit the drives of repeated [`step`](Self::step).
    ///
    /// # Errors
    /// [`Error::Rows`] unless the references are whole rows of M, [`Error::Length`] unless there are as many rows of
    /// everything else; nothing is taken then.
    pub fn run(&mut self, block: &ArraySample<'_>, drives: &mut [f64]) -> Result<(), Error> {
        let (actuators, sensors) = (self.len().max(1), self.sensors());
        let got = block.reference.len();
        check_rows("reference", actuators, got)?;
        let rows = got / actuators;
        check_length("drives", got, drives.len())?;
        for (parameter, given) in optional(block) {
            given.map_or(Ok(()), |given| check_length(parameter, rows.saturating_mul(sensors), given.len()))?;
        }
        let references = block.reference.chunks_exact(actuators);
        for (k, (reference, drives)) in references.zip(drives.chunks_exact_mut(actuators)).enumerate() {
            let (measurement, sensor_reference) =
                (row(block.measurement, k, sensors), row(block.sensor_reference, k, sensors));
            self.lanes.take(&ArraySample { reference, measurement, sensor_reference });
            copy(drives, &self.lanes.now.drives);
        }
        Ok(())
    }

    fn check(&self, sample: &ArraySample<'_>, drives: &[f64]) -> Result<(), Error> {
        check_length("reference", self.len(), sample.reference.len())?;
        check_length("drives", self.len(), drives.len())?;
        for (parameter, given) in optional(sample) {
            given.map_or(Ok(()), |given| check_length(parameter, self.sensors(), given.len()))?;
        }
        Ok(())
    }

    /// The number of actuators M.
    #[must_use]
    pub fn len(&self) -> usize {
        self.lanes.inverse.len()
    }

    /// Whether there is no actuator, which cannot be.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.lanes.inverse.is_empty()
    }

    /// The number of sensors S.
    #[must_use]
    pub fn sensors(&self) -> usize {
        self.lanes.feedback.sensors()
    }

    /// The present drives: what the amplifiers have.
    #[must_use]
    pub fn drives(&self) -> &[f64] {
        &self.lanes.now.drives
    }

    /// Where the models are at the present drives; with creep or a loop shift, where they were at the last sample.
    #[must_use]
    pub fn positions(&self) -> impl ExactSizeIterator<Item = f64> + '_ {
        let each = self.lanes.inverse.streams().iter().zip(&self.lanes.now.positions);
        each.map(|(stream, last)| if P::DRIFTS { *last } else { stream.reached() })
    }

    /// The integral of every actuator, in the unit of the models' output.
    #[must_use]
    pub fn integral(&self) -> &[f64] {
        &self.lanes.now.integral
    }

    /// The limits (low, high) of every drive.
    #[must_use]
    pub fn limits(&self) -> &[(f64, f64)] {
        &self.limits
    }

    /// How many samples and drives were unusual.
    #[must_use]
    pub fn counters(&self) -> ArrayCounters {
        self.lanes.now.counters
    }

    /// The options, with the present gains.
    #[must_use]
    pub fn options(&self) -> &ArrayOptions {
        &self.options
    }

    /// What the controller does with its samples: [`Mode::Run`], [`Mode::Hold`] or [`Mode::Stop`].
    #[must_use]
    pub fn mode(&self) -> Mode {
        self.lanes.now.mode
    }
}

/// What a sample need not have.
#[inline]
fn optional<'a>(sample: &ArraySample<'a>) -> [(&'static str, Option<&'a [f64]>); 2] {
    [("measurement", sample.measurement), ("sensor_reference", sample.sensor_reference)]
}

/// Row k of what need not be given.
#[inline]
fn row(given: Option<&[f64]>, k: usize, width: usize) -> Option<&[f64]> {
    given.and_then(|all| all.chunks_exact(width.max(1)).nth(k))
}

/// The limits of every inverse, which must have them, and lead to a position at once.
fn limits<P: ArrayInverse>(inverse: &StreamArray<P>) -> Result<Box<[(f64, f64)]>, Error> {
    if let Some(actuator) = inverse.streams().iter().position(P::lags) {
        let expected = "inverses of which none is behind an amplifier, unlike that of actuator";
        return Err(Error::whole("inverse", None, expected, actuator));
    }
    let of = |(actuator, stream): (usize, &P)| {
        stream.limits().ok_or(Error::Domain {
            parameter: "limits",
            index: Some(actuator),
            expected: Bound::Words("finite limits of every drive"),
            got: f64::INFINITY,
        })
    };
    inverse.streams().iter().enumerate().map(of).collect::<Result<Vec<_>, _>>().map(Vec::into_boxed_slice)
}

impl<P: ArrayInverse> ArrayController<P> {
    /// Holds all drives, for any reference and measurement.
    pub fn hold(&mut self) {
        self.lanes.now.end_motion();
        self.lanes.now.mode = Mode::Hold;
    }

    /// Back from a hold or a stop: the next sample starts a motion from the present drives.
    pub fn release(&mut self) {
        self.lanes.now.mode = Mode::Run;
    }

    /// Ramps every drive to its rest drive at `rate` volts per second, or at the slew if that is slower, and holds it
    /// there.
    ///
    /// From the next sample on every [`step`](Self::step) puts out the next drives of the ramp, whatever comes, also
    /// NaN. The limits of differences hold on the way. [`release`](Self::release) starts a motion from the drives that
    /// are reached then.
    ///
    /// # Errors
    /// [`Error::Domain`] unless the rate is above zero and each rest drive within its limits, [`Error::Length`] unless
    /// there are M of them; the controller is as before then.
    pub fn stop(&mut self, rate: f64, rest_drives: &[f64]) -> Result<(), Error> {
        check_stop(["rate", "rest_drive"], rate, rest_drives, self.limits.iter().copied())?;
        self.lanes.now.end_motion();
        (self.lanes.now.mode, self.lanes.now.stop_rate) = (Mode::Stop, rate);
        copy(&mut self.lanes.now.rest_drives, rest_drives);
        Ok(())
    }

    /// Changes the gains, per second. The integral is a displacement, so nothing jumps.
    ///
    /// # Errors
    /// [`Error::Domain`] for a gain that is negative or not finite, or a leak above 1 / dt; the controller is as before
    /// then.
    pub fn set_gains(&mut self, ki: f64, leak: f64) -> Result<(), Error> {
        self.lanes.gains = Gains::new(ki, leak, self.options.dt)?;
        (self.options.ki, self.options.leak) = (ki, leak);
        Ok(())
    }

    /// One actuator goes on with the weights and the output offset of another model of the same operators, without a
    /// jump: the bumpless term takes the difference. Allocates nothing, and frees what the old model holds if no other
    /// clone of it is left.
    ///
    /// # Errors
    /// [`Error::Whole`] for an actuator that does not exist, and as [`Inverse::set_model`]; the controller is as before
    /// then.
    pub fn set_model(&mut self, actuator: usize, model: &CompiledModel) -> Result<(), Error> {
        let actuators = self.len();
        let Lanes { inverse, now, bumpless_samples, .. } = &mut self.lanes;
        let terms = now.bumpless.get_mut(actuator).zip(now.positions.get_mut(actuator));
        let Some((stream, (bumpless, position))) = inverse.streams_mut().get_mut(actuator).zip(terms) else {
            return Err(no_such("actuator", None, actuator, actuators));
        };
        let before = stream.reached();
        stream.set_model(model)?;
        let difference = stream.reached() - before;
        *position += difference;
        if now.started && difference != 0.0 {
            *bumpless += difference;
            now.bumpless_samples = *bumpless_samples;
        }
        Ok(())
    }

    /// As made, but for gains and models that were changed since and for the drives, which stay: the memory is that of
    /// a move from rest to them. The counters are zero, the mode is [`Mode::Run`].
    pub fn reset(&mut self) {
        self.lanes.inverse.reset();
        self.lanes.now.reset();
        self.move_to_present_drives();
    }

    /// [`reset`](Self::reset), the amplifiers being at other drives now.
    ///
    /// # Errors
    /// [`Error::Length`] unless there are M drives, [`Error::Domain`] for one outside its limits; the controller is as
    /// before then.
    pub fn reset_at(&mut self, drives: &[f64]) -> Result<(), Error> {
        check_each_between("drive", drives, self.limits.iter().copied())?;
        copy(&mut self.lanes.now.drives, drives);
        self.reset();
        Ok(())
    }

    /// Takes over what was driven before, rows of M drives, oldest first: the inverses remember it, and the next motion
    /// starts from the last row. Without any nothing changes.
    ///
    /// # Errors
    /// [`Error::Rows`] unless they are whole rows, [`Error::Domain`] for a drive that is not finite or outside its
    /// limits; the controller is as before then.
    pub fn follow(&mut self, drives: &[f64]) -> Result<(), Error> {
        check_rows_between("drives", drives, &self.limits.iter().copied())?;
        for row in drives.chunks_exact(self.len().max(1)) {
            for (stream, drive) in self.lanes.inverse.streams_mut().iter_mut().zip(row) {
                advance(stream, stream.output(), *drive);
            }
            copy(&mut self.lanes.now.drives, row);
            self.lanes.note_positions();
            self.lanes.now.end_motion();
        }
        Ok(())
    }

    /// The inverses that are at other drives move to the present ones.
    fn move_to_present_drives(&mut self) {
        for (stream, drive) in self.lanes.inverse.streams_mut().iter_mut().zip(&self.lanes.now.drives) {
            if stream.output() != *drive {
                stream.follow_drive(*drive);
            }
        }
        self.lanes.note_positions();
    }

    /// Everything that the controller remembers. Allocates.
    #[must_use]
    pub fn state(&self) -> ArrayControllerState<P::State> {
        let now = &self.lanes.now;
        ArrayControllerState {
            setup: self.options.fingerprint(),
            dt: self.options.dt,
            ki: self.options.ki,
            leak: self.options.leak,
            streams: self.lanes.inverse.streams().iter().map(P::state).collect(),
            drives: now.drives.to_vec(),
            positions: if P::DRIFTS { now.positions.to_vec() } else { Vec::new() },
            integral: now.integral.to_vec(),
            bumpless: now.bumpless.to_vec(),
            started: now.started,
            bumpless_samples: now.bumpless_samples,
            integral_rest_samples: now.integral_rest_samples,
            mode: now.mode,
            stop: (now.mode == Mode::Stop)
                .then(|| ArrayStop { rate: now.stop_rate, rest_drive: now.rest_drives.to_vec() }),
            counters: now.counters,
        }
    }

    /// Continues from `state`, bit for bit. The amplifiers must be at its drives. Allocates.
    ///
    /// # Errors
    /// [`Error::Domain`] that names the field for a state of a controller with other gains or sampling interval;
    /// [`Error::State`], [`Error::Domain`], [`Error::Length`] or [`Error::OtherModel`] for one that this controller
    /// cannot be in. The controller is as before then.
    pub fn set_state(&mut self, state: &ArrayControllerState<P::State>) -> Result<(), Error> {
        let own = &self.options;
        check_unchanged([
            ("state.dt", own.dt, state.dt),
            ("state.ki", own.ki, state.ki),
            ("state.leak", own.leak, state.leak),
        ])?;
        if state.setup != own.fingerprint() {
            let expected = "the state of a controller with the same reconstruction, pairs, slew and bumpless time";
            return Err(Error::State { expected });
        }
        state.check(&self.limits)?;
        check_length("state.positions", if P::DRIFTS { self.len() } else { 0 }, state.positions.len())?;
        check_all_finite("state.positions", &state.positions)?;
        let mut restored = self.lanes.inverse.clone();
        for (stream, saved) in restored.streams_mut().iter_mut().zip(&state.streams) {
            stream.set_state(saved)?;
        }
        let remembered: Vec<f64> = restored.streams().iter().map(P::output).collect();
        let actuators = remembered.iter().zip(&state.drives).zip(&self.limits);
        for ((remembered, drive), (low, high)) in actuators {
            if (remembered - drive).abs() > SAME_DRIVE * (high - low) {
                return Err(Error::State { expected: "streams that are at the drives of the state" });
            }
        }
        self.lanes.inverse = restored;
        let now = &mut self.lanes.now;
        now.drives.copy_from_slice(&state.drives);
        copy(&mut now.positions, &state.positions);
        now.integral.copy_from_slice(&state.integral);
        now.bumpless.copy_from_slice(&state.bumpless);
        now.started = state.started;
        now.bumpless_samples = state.bumpless_samples;
        now.integral_rest_samples = state.integral_rest_samples;
        now.mode = state.mode;
        now.counters = state.counters;
        if let Some(stop) = &state.stop {
            now.stop_rate = stop.rate;
            now.rest_drives.copy_from_slice(&stop.rest_drive);
        }
        Ok(())
    }
}

/// How far, relative to its limits, a drive of a state may be from what its inverse remembers: they agree to rounding.
const SAME_DRIVE: f64 = 1e-9;

/// Where a stop goes, and how fast.
///
/// ```
/// use hysteresis_core::ArrayStop;
/// let stop = ArrayStop { rate: 100.0, rest_drive: vec![0.0, 5.0] };
/// assert_eq!(stop.rest_drive.len(), 2);
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct ArrayStop {
    /// How fast the drives move, in volts per second. A slower slew bounds it.
    pub rate: f64,
    /// The drives at which it ends, in volts.
    pub rest_drive: Vec<f64>,
}

/// Everything that an [`ArrayController`](super::ArrayController) remembers: restored, it continues bit for bit.
///
/// ```
/// use hysteresis_core::{ArrayController, ArrayOptions, ArraySample, CompiledModel, Offsets, PrandtlIshlinskii, StreamArray};
/// let model = PrandtlIshlinskii::new(&[1.0, 0.5], &[0.0, 2.0], Offsets::default())?;
/// let models = [CompiledModel::new(&(&model).into()), CompiledModel::new(&(&model).into())];
/// let inverse = StreamArray::inverse(&models, Some((-10.0, 10.0))).map_err(|wrong| wrong.error)?;
/// let mut controller = ArrayController::new(inverse, &ArrayOptions::new(1e-3))?;
/// let saved = controller.state();
/// let (mut drives, mut again) = ([0.0; 2], [0.0; 2]);
/// controller.step(&ArraySample::of(&[1.0, 2.0]), &mut drives)?;
/// controller.set_state(&saved)?;
/// controller.step(&ArraySample::of(&[1.0, 2.0]), &mut again)?;
/// assert_eq!(drives, again);
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct ArrayControllerState<S = StreamState> {
    /// The fingerprint of reconstruction, pairs, slew and bumpless time.
    pub setup: u64,
    /// The sampling interval in seconds.
    pub dt: f64,
    /// The integral gain per second.
    pub ki: f64,
    /// The leak per second.
    pub leak: f64,
    /// What each inverse remembers.
    pub streams: Vec<S>,
    /// The present drives.
    pub drives: Vec<f64>,
    /// The positions at the last sample, where they go on by themselves as by creep; none of plays alone.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Vec::is_empty"))]
    pub positions: Vec<f64>,
    /// The integral of every actuator, in the unit of the models' output.
    pub integral: Vec<f64>,
    /// What is left of the differences at a start or a change, in the same unit.
    pub bumpless: Vec<f64>,
    /// Whether a motion is under way. If not, the next sample starts one from the present drives.
    pub started: bool,
    /// For how many samples the bumpless term goes on.
    pub bumpless_samples: u32,
    /// For how many samples the integral still rests. A start shortens it to its bumpless time.
    pub integral_rest_samples: u32,
    /// What the controller does with its samples: run, hold or stop.
    pub mode: Mode,
    /// Where a stop goes; none in the other modes.
    pub stop: Option<ArrayStop>,
    /// What was counted.
    pub counters: ArrayCounters,
}

impl<S> ArrayControllerState<S> {
    /// Whether a controller with these limits can be in this state, as far as the streams do not say it.
    pub(super) fn check(&self, limits: &[(f64, f64)]) -> Result<(), Error> {
        let actuators = limits.len();
        check_length("state.streams", actuators, self.streams.len())?;
        check_each_between("state.drives", &self.drives, limits.iter().copied())?;
        for (parameter, terms) in [("state.integral", &self.integral), ("state.bumpless", &self.bumpless)] {
            check_length(parameter, actuators, terms.len())?;
            check_terms(terms)?;
        }
        match (self.mode, &self.stop) {
            (Mode::Stop, Some(stop)) => {
                let names = ["state.stop.rate", "state.stop.rest_drive"];
                check_stop(names, stop.rate, &stop.rest_drive, limits.iter().copied())
            }
            (Mode::Run | Mode::Hold, None) => Ok(()),
            _ => Err(Error::State { expected: "the mode run or hold, or a stop with its rate and rest drives" }),
        }
    }
}
