//! A stage between its two converters, as a controller sees it: drive in, measurement out.
//!
//! u -> limits, D/A converter -> [stage](hysteresis_control::stage::Stage) -> position -> noise -> A/D converter
//!
//! # Timing
//! At t_k the controller reads the measurement, computes its drive from it at once, and the drive is held until
//! t_(k+1):
//!
//! ```text
//! time       t_0                     t_1                     t_2
//! reading    measured()              step(u(0)) returns it   step(u(1)) returns it
//! drive         u(0)____________________u(1)____________________u(2)
//! row        (u(0), y(0))            (u(1), y(1))            (u(2), y(2))
//! ```
//!
//! [`Plant::step`] holds a drive for one interval and returns the next reading, taken just before the next drive.
//! [`Plant::run`] writes rows of a record: y(k) is read as u(k) is put out.

mod axes;
mod converters;

pub use axes::{MultiAxisPlant, MultiAxisPlantState};
pub use converters::Quantiser;
pub(crate) use converters::check_range;

use core::fmt;

use hysteresis_control::stage::{self, Stage, StageForward, StageState};
use hysteresis_core::{Bound, Error as CoreError, MAX_MAGNITUDE, Process, check_all_finite, is_admissible};
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::{Deserialize, Serialize};

use converters::Noise;

/// What a plant has besides its stage: converters, the seed of its noise, and the sampling interval.
///
/// ```
/// use hysteresis_simulate::plant::PlantOptions;
/// let options = PlantOptions { dac_bits: Some(16), ..PlantOptions::new(1e-4) };
/// assert_eq!((options.dt, options.seed, options.adc), (1e-4, 0, None));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlantOptions {
    /// The sampling interval in seconds.
    pub dt: f64,
    /// Seed of the noise of the sensor: the same seed gives the same numbers.
    pub seed: u64,
    /// Bits of the D/A converter, whose levels span the limits.
    pub dac_bits: Option<u32>,
    /// Bits of the A/D converter, and the lowest and highest measurement.
    pub adc: Option<(u32, (f64, f64))>,
}

impl PlantOptions {
    /// Without converters.
    #[must_use]
    pub fn new(dt: f64) -> Self {
        Self { dt, seed: 0, dac_bits: None, adc: None }
    }
}

/// What a plant had to put right since its start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Events {
    /// Drives that were not finite (or beyond 1e100): the one before was held.
    pub rejected: u64,
    /// Drives that were clamped to the limits.
    pub clamped: u64,
    /// Measurements that were clamped to the range of the A/D converter.
    pub overrange: u64,
}

/// A plant, sample by sample. A clone continues on its own from the same state.
///
/// It starts at rest: the drive has been 0, or the limit nearest to it, since forever, put out by the D/A converter.
///
/// [`step`](Self::step) and [`reset`](Self::reset) never fail, allocate, lock, panic or read a clock.
///
/// ```
/// use hysteresis_control::linear::SecondOrder;
/// use hysteresis_control::stage::{Stage, StageParts};
/// use hysteresis_core::Process;
/// use hysteresis_simulate::paper;
/// use hysteresis_simulate::plant::{Plant, PlantOptions};
/// let model = paper::table_1_recovered();
/// let stage = Stage::new(StageParts {
///     dynamics: SecondOrder::new(400.0, 0.95)?.into(),
///     noise: Some(0.016),
///     limits: Some((-560.0, 560.0)),
///     ..StageParts::new(model.clone())
/// })?;
/// let mut plant = Plant::new(&stage, &PlantOptions::new(1e-4))?;
/// let measured = (0..100).map(|_| plant.step(300.0)).last().unwrap();
/// assert!((plant.position() - model.forward().step(300.0)).abs() < 1e-6); // um
/// assert!((measured - plant.position()).abs() < 0.1);
/// plant.step(f64::NAN);
/// assert_eq!((plant.drive(), plant.events().rejected), (300.0, 1));
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Plant {
    stage: Stage,
    forward: StageForward,
    limits: (f64, f64),
    dac: Option<Quantiser>,
    adc: Option<Quantiser>,
    noise: Noise,
    drive: f64,
    position: f64,
    measured: f64,
    /// What the sensor adds to the position of now.
    reading_noise: f64,
    events: Events,
    dt: f64,
}

/// Limits that no admissible drive meets.
const UNLIMITED: (f64, f64) = (-MAX_MAGNITUDE, MAX_MAGNITUDE);

/// Counts an event if there was one.
#[inline]
fn count(counter: &mut u64, happened: bool) {
    *counter = counter.saturating_add(u64::from(happened));
}

impl Plant {
    /// A plant at rest around a stage, whose limits and sensor noise it has.
    ///
    /// # Errors
    /// [`Error`] that names the parameter: a stage that cannot run, bits outside 1 to 32, a range of which the low end
    /// is not below the high one, a D/A converter without limits, a `dt` that is not positive.
    pub fn new(stage: &Stage, options: &PlantOptions) -> Result<Self, Error> {
        if !(is_admissible(options.dt) && options.dt > 0.0) {
            let (expected, got) = (Bound::Positive, options.dt);
            return Err(CoreError::Domain { parameter: "dt", index: None, expected, got }.into());
        }
        let limits = stage.parts().limits;
        let dac = match (options.dac_bits, limits) {
            (Some(dac_bits), None) => return Err(Error::NoLimits { dac_bits }),
            (Some(bits), Some(limits)) => Some(Quantiser::named(["dac_bits", "limits"], bits, limits)?),
            (None, _) => None,
        };
        let adc = options.adc.map(|(bits, range)| Quantiser::named(["adc_bits", "adc_range"], bits, range));
        let mut plant = Self {
            forward: stage.forward(options.dt)?,
            limits: limits.unwrap_or(UNLIMITED),
            dac,
            adc: adc.transpose()?,
            noise: Noise::new(stage.parts().noise.unwrap_or(0.0), options.seed),
            drive: 0.0,
            position: 0.0,
            measured: 0.0,
            reading_noise: 0.0,
            events: Events::default(),
            dt: options.dt,
            stage: stage.clone(),
        };
        plant.reset();
        Ok(plant)
    }

    /// What lies between the converters.
    #[must_use]
    pub fn stage(&self) -> &Stage {
        &self.stage
    }

    /// The drive that the D/A converter puts out for an admissible one.
    #[inline]
    fn put_out(&self, drive: f64) -> f64 {
        let within = drive.max(self.limits.0).min(self.limits.1);
        self.dac.map_or(within, |dac| dac.level(within))
    }

    /// Reads the A/D converter at a position.
    #[inline]
    fn read(&mut self, position: f64) -> f64 {
        let reading = position + self.reading_noise;
        match self.adc {
            Some(adc) => {
                let (low, high) = adc.range();
                count(&mut self.events.overrange, reading < low || reading > high);
                adc.level(reading)
            }
            None => reading,
        }
    }

    /// Measures the position of now.
    #[inline]
    fn measure(&mut self) {
        self.reading_noise = self.noise.next();
        self.measured = self.read(self.position);
    }

    /// Holds the drive for one sampling interval and returns the measurement at its end.
    ///
    /// A drive beyond the limits is clamped, one that is not finite (or beyond 1e100) leaves that of the sample before;
    /// either is counted.
    #[inline]
    pub fn step(&mut self, drive: f64) -> f64 {
        if is_admissible(drive) {
            count(&mut self.events.clamped, drive < self.limits.0 || drive > self.limits.1);
            self.drive = self.put_out(drive);
        } else {
            count(&mut self.events.rejected, true);
        }
        self.position = self.forward.advance(self.drive);
        self.measure();
        self.measured
    }

    /// Takes over what was driven before, oldest drive first, one per sampling interval.
    ///
    /// # Errors
    /// [`CoreError::Domain`] for a drive that is not finite; nothing is taken then.
    pub fn follow(&mut self, drives: &[f64]) -> Result<(), CoreError> {
        check_all_finite("drives", drives)?;
        for drive in drives {
            self.step(*drive);
        }
        Ok(())
    }

    /// Takes a block of drives and writes the rows of a record: measurement and position at t_k, the moment at which
    /// drive k is put out. Modes have not answered to it yet; a plant without modes and dead time shows it at once.
    /// Afterwards the plant is where repeated [`step`](Self::step) leaves it.
    ///
    /// # Errors
    /// [`CoreError::Length`] unless all three slices have the same length; nothing is taken then.
    pub fn run(&mut self, drives: &[f64], measured: &mut [f64], position: &mut [f64]) -> Result<(), CoreError> {
        for (parameter, got) in [("measured", measured.len()), ("position", position.len())] {
            if got != drives.len() {
                return Err(CoreError::Length { parameter, expected: drives.len(), got });
            }
        }
        for ((drive, measured), position) in drives.iter().zip(measured).zip(position) {
            let put_out = if is_admissible(*drive) { self.put_out(*drive) } else { self.drive };
            *position = self.forward.peek(put_out);
            *measured = self.read(*position);
            self.step(*drive);
        }
        Ok(())
    }

    /// The measurement of now.
    #[must_use]
    pub fn measured(&self) -> f64 {
        self.measured
    }

    /// The true position of now.
    #[must_use]
    pub fn position(&self) -> f64 {
        self.position
    }

    /// The drive that was put out last.
    #[must_use]
    pub fn drive(&self) -> f64 {
        self.drive
    }

    /// The limits of the drive (low, high), if there are any.
    #[must_use]
    pub fn limits(&self) -> Option<(f64, f64)> {
        (self.limits != UNLIMITED).then_some(self.limits)
    }

    /// The sampling interval in seconds.
    #[must_use]
    pub fn dt(&self) -> f64 {
        self.dt
    }

    /// Sub-steps per sample: [`StageForward::sub_steps`].
    #[must_use]
    pub fn sub_steps(&self) -> u32 {
        self.forward.sub_steps()
    }

    /// What had to be put right since the start.
    #[must_use]
    pub fn events(&self) -> Events {
        self.events
    }

    /// Back to the start, at rest: the same drives give the same measurements again, noise included.
    pub fn reset(&mut self) {
        self.events = Events::default();
        self.noise.restart();
        self.drive = self.put_out(0.0);
        self.position = self.forward.settle(self.drive);
        self.measure();
    }
}

/// Everything that a [`Plant`] remembers: restored, it continues bit for bit, noise included.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlantState {
    /// The stage between the converters.
    pub stage: StageState,
    /// The drive that was put out last.
    pub drive: f64,
    /// The position of now.
    pub position: f64,
    /// The measurement of now.
    pub measured: f64,
    /// What the sensor adds to the position of now.
    pub reading_noise: f64,
    /// What had to be put right.
    pub events: Events,
    noise: Xoshiro256PlusPlus,
}

impl Plant {
    /// Everything that the plant remembers. Allocates.
    ///
    /// ```
    /// use hysteresis_simulate::paper::Benchmark;
    /// let mut plant = Benchmark::A1.plant(7);
    /// plant.step(300.0);
    /// let saved = plant.state();
    /// let next = plant.step(300.0);
    /// let mut other = Benchmark::A1.plant(0); // the noise is that of the state
    /// other.set_state(&saved)?;
    /// assert_eq!(other.step(300.0), next);
    /// # Ok::<(), hysteresis_simulate::plant::Error>(())
    /// ```
    #[must_use]
    pub fn state(&self) -> PlantState {
        PlantState {
            stage: self.forward.state(),
            drive: self.drive,
            position: self.position,
            measured: self.measured,
            reading_noise: self.reading_noise,
            events: self.events,
            noise: self.noise.generator().clone(),
        }
    }

    /// Continues from the state of a plant of the same stage, bit for bit; [`reset`](Self::reset) goes back to the
    /// start of this one.
    ///
    /// # Errors
    /// [`Error`] for a state of another stage or sampling interval, or numbers that are not finite; nothing changes
    /// then.
    pub fn set_state(&mut self, state: &PlantState) -> Result<(), Error> {
        let numbers = [state.drive, state.position, state.measured, state.reading_noise];
        if !numbers.into_iter().all(f64::is_finite) {
            return Err(CoreError::State { expected: "finite drives and positions" }.into());
        }
        self.forward.set_state(&state.stage)?;
        [self.drive, self.position, self.measured, self.reading_noise] = numbers;
        self.events = state.events;
        self.noise.resume(state.noise.clone());
        Ok(())
    }
}

/// Why a plant could not be made: the message names the parameter, what was expected and what came.
///
/// ```
/// use hysteresis_simulate::paper::Benchmark;
/// use hysteresis_simulate::plant::{Plant, PlantOptions};
/// let error = Plant::new(&Benchmark::A1.stage(), &PlantOptions::new(0.0)).unwrap_err();
/// assert_eq!(error.to_string(), "dt: expected a finite number > 0, got 0.0");
/// ```
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Error {
    /// A number outside its domain.
    Parameter(hysteresis_core::Error),
    /// A stage that cannot run.
    Stage(stage::Error),
    /// A D/A converter of so many bits without limits that it could span.
    NoLimits {
        /// The bits.
        dac_bits: u32,
    },
}

impl Error {
    /// The name of the parameter that is wrong, if it is one.
    #[must_use]
    pub fn parameter(&self) -> Option<&'static str> {
        match self {
            Self::Parameter(error) => error.parameter(),
            Self::Stage(error) => error.parameter(),
            Self::NoLimits { .. } => Some("limits"),
        }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Parameter(error) => error.fmt(f),
            Self::Stage(error) => error.fmt(f),
            Self::NoLimits { dac_bits } => {
                write!(f, "limits: expected (low, high) for the {dac_bits} bits of the D/A converter to span, got none")
            }
        }
    }
}

impl core::error::Error for Error {}

impl From<hysteresis_core::Error> for Error {
    fn from(error: hysteresis_core::Error) -> Self {
        Self::Parameter(error)
    }
}

impl From<stage::Error> for Error {
    fn from(error: stage::Error) -> Self {
        Self::Stage(error)
    }
}
