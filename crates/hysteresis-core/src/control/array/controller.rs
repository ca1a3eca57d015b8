use alloc::boxed::Box;
use alloc::vec;
use alloc::vec::Vec;

use super::counters::ArrayCounters;
use super::feedback::Feedback;
use super::loop_state::LoopState;
use super::options::{ArrayOptions, Gains};
use super::pairs::Pairs;
use crate::control::Mode;
use crate::control::limiter::Limiter;
use crate::control::options::check_drives;
use crate::error::{Bound, Error, check_length, check_positive};
use crate::stream::{Inverse, StreamArray};

/// Feed-forward through the exact inverses of M actuators, and an integral behind a reconstruction matrix, within limits at
/// every sample.
///
/// ```text
/// a_i(k) = a_i(k-1) + dt (ki e_i(k) - leak a_i(k-1)),   e = R (sensor reference - measurement)
/// target_i(k) = reference_i(k) + a_i(k) + bumpless_i(k),   u_i(k) = H_i^-1[target_i](k)
/// ```
///
/// R is the M x S matrix [`reconstruction`](ArrayOptions::reconstruction), and the sensor reference is zero unless it is given:
/// the feedback brings the sensors to zero, as a mirror flattens a wavefront. Without a matrix sensor i measures actuator i, and
/// the sensor reference is the reference. References, integral and bumpless term are displacements, in the unit of the models'
/// output; ki and leak are per second. Behind the exact inverse the loop is linear, so one gain suits all actuators.
///
/// **Drives** are always finite, within the limits of their inverses and no farther than slew times dt from the last ones. The
/// inverses remember the drives that go out, so what feedback, slew and limits do to them is part of their memory. Where limits
/// hold an actuator back, its integral takes of its change what the actuator can follow, and no more.
///
/// **Differences.** The modelled positions of a pair of [`neighbours`](ArrayOptions::neighbours) are never farther apart than
/// [`max_difference`](ArrayOptions::max_difference). A pair that is too far apart at the start never grows. Targets that are too
/// far apart are drawn together; then the actuators go from the present positions, which satisfy all limits, towards these
/// targets as far as all limits allow. The promise holds as far as rounding errors of positions are below 1e-9 of the
/// difference, which is kept as a margin.
///
/// **No jumps.** A motion starts from the present drives: at the first sample, after [`reset`](Self::reset), a hold or a stop,
/// and after samples that were rejected. The first drives are the last ones, to the bit. `bumpless` is the difference, and goes
/// to zero in a straight line over [`bumpless_time`](ArrayOptions::bumpless_time). From the first sample of all, after a reset, a
/// hold and a stop the integral rests for that time.
///
/// **Bad samples.** A reference that is not finite (or beyond 1e100) holds all drives. A measurement that is not finite lets the
/// integral rest: that of its actuator without a matrix, all of them with one. Feed-forward goes on. Both are counted.
///
/// [`step`](Self::step), [`peek`](Self::peek), [`run`](Self::run), [`stop`](Self::stop) and the changes of mode and gains do not
/// allocate, lock, panic, log or read a clock.
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
pub struct ArrayController {
    pub(super) inverse: StreamArray<Inverse>,
    pub(super) limits: Box<[(f64, f64)]>,
    pub(super) limiters: Box<[Limiter]>,
    pub(super) gains: Gains,
    pub(super) feedback: Feedback,
    pub(super) pairs: Pairs,
    pub(super) bumpless_samples: u32,
    pub(super) now: LoopState,
    pub(super) work: Work,
    pub(super) options: ArrayOptions,
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

/// What a sample needs while it is decided upon: allocated once.
#[derive(Clone, Debug)]
pub(super) struct Work {
    /// The modelled positions before the sample.
    pub(super) present: Box<[f64]>,
    /// The changes of the integral.
    pub(super) changes: Box<[f64]>,
    /// The targets as the law has them.
    pub(super) wanted: Box<[f64]>,
    /// The positions that are to be reached.
    pub(super) positions: Box<[f64]>,
    /// The positions for which limits of differences are worked out.
    pub(super) targets: Box<[f64]>,
    /// The drives that reach the positions.
    pub(super) drives: Box<[f64]>,
    /// Whether the inverse alone comes to the drive, with its target.
    pub(super) by_target: Box<[bool]>,
}

impl Work {
    fn new(actuators: usize) -> Self {
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

impl ArrayController {
    /// A controller that goes on from the memory of the inverses, each of which has its limits.
    ///
    /// The inverses then take over the start drives, as a move from where they are.
    ///
    /// # Errors
    /// [`Error::Domain`], [`Error::Length`] or [`Error::Empty`] that name the option, what was expected and what came.
    pub fn new(inverse: StreamArray<Inverse>, options: &ArrayOptions) -> Result<Self, Error> {
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
        let bumpless_samples = options.bumpless_samples()?;
        let start = match &options.start_drive {
            Some(drives) => drives.clone(),
            None => limits.iter().map(|(low, high)| 0.0_f64.max(*low).min(*high)).collect(),
        };
        check_drives("start_drive", &start, limits.iter().copied())?;
        let now = LoopState::at(start);
        let (work, options) = (Work::new(actuators), options.clone());
        let mut made = Self { inverse, limits, limiters, gains, feedback, pairs, bumpless_samples, now, work, options };
        made.follow_present_drives();
        Ok(made)
    }

    /// Takes one sample and writes the M drives.
    ///
    /// # Errors
    /// [`Error::Length`] unless reference and drives have M elements, measurement and sensor reference S; nothing is taken then.
    pub fn step(&mut self, sample: &ArraySample<'_>, drives: &mut [f64]) -> Result<(), Error> {
        self.check(sample, drives)?;
        self.take(sample);
        copy(drives, &self.now.drives);
        Ok(())
    }

    /// The drives that [`step`](Self::step) would write, without taking the sample. It needs the controller's work space, and
    /// changes nothing else.
    ///
    /// # Errors
    /// As for [`step`](Self::step).
    pub fn peek(&mut self, sample: &ArraySample<'_>, drives: &mut [f64]) -> Result<(), Error> {
        self.check(sample, drives)?;
        self.decide(sample);
        copy(drives, &self.work.drives);
        Ok(())
    }

    /// Takes a block of samples, row by row: bit for bit the drives of repeated [`step`](Self::step).
    ///
    /// # Errors
    /// [`Error::Rows`] unless the references are whole rows of M, [`Error::Length`] unless there are as many rows of everything
    /// else; nothing is taken then.
    pub fn run(&mut self, block: &ArraySample<'_>, drives: &mut [f64]) -> Result<(), Error> {
        let (actuators, sensors) = (self.len().max(1), self.sensors());
        let got = block.reference.len();
        if !got.is_multiple_of(actuators) {
            return Err(Error::Rows { parameter: "reference", width: actuators, got });
        }
        let rows = got / actuators;
        check_length("drives", got, drives.len())?;
        for (parameter, given) in optional(block) {
            given.map_or(Ok(()), |given| check_length(parameter, rows.saturating_mul(sensors), given.len()))?;
        }
        let references = block.reference.chunks_exact(actuators);
        for (k, (reference, drives)) in references.zip(drives.chunks_exact_mut(actuators)).enumerate() {
            let (measurement, sensor_reference) =
                (row(block.measurement, k, sensors), row(block.sensor_reference, k, sensors));
            self.take(&ArraySample { reference, measurement, sensor_reference });
            copy(drives, &self.now.drives);
        }
        Ok(())
    }

    fn take(&mut self, sample: &ArraySample<'_>) {
        let decision = self.decide(sample);
        self.commit(sample, &decision);
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
        self.inverse.len()
    }

    /// Whether there is no actuator, which cannot be.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.inverse.is_empty()
    }

    /// The number of sensors S.
    #[must_use]
    pub fn sensors(&self) -> usize {
        self.feedback.sensors()
    }

    /// The present drives: what the amplifiers have.
    #[must_use]
    pub fn drives(&self) -> &[f64] {
        &self.now.drives
    }

    /// Where the models are at the present drives.
    pub fn positions(&self) -> impl ExactSizeIterator<Item = f64> + '_ {
        self.inverse.streams().iter().map(Inverse::reached)
    }

    /// The integral of every actuator, in the unit of the models' output.
    #[must_use]
    pub fn integral(&self) -> &[f64] {
        &self.now.integral
    }

    /// The limits (low, high) of every drive.
    #[must_use]
    pub fn limits(&self) -> &[(f64, f64)] {
        &self.limits
    }

    /// How many samples and drives were unusual.
    #[must_use]
    pub fn counters(&self) -> ArrayCounters {
        self.now.counters
    }

    /// The options, with the present gains.
    #[must_use]
    pub fn options(&self) -> &ArrayOptions {
        &self.options
    }

    /// What the controller does with its samples: [`Mode::Run`], [`Mode::Hold`] or [`Mode::Stop`].
    #[must_use]
    pub fn mode(&self) -> Mode {
        self.now.mode
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

/// The limits of every inverse, which must have them.
fn limits(inverse: &StreamArray<Inverse>) -> Result<Box<[(f64, f64)]>, Error> {
    let of = |(actuator, stream): (usize, &Inverse)| {
        stream.limits().ok_or(Error::Domain {
            parameter: "limits",
            index: Some(actuator),
            expected: Bound::Words("finite limits of every drive"),
            got: f64::INFINITY,
        })
    };
    inverse.streams().iter().enumerate().map(of).collect::<Result<Vec<_>, _>>().map(Vec::into_boxed_slice)
}

/// Copies as many numbers as both have.
#[inline]
pub(super) fn copy(to: &mut [f64], from: &[f64]) {
    to.iter_mut().zip(from).for_each(|(to, from)| *to = *from);
}
