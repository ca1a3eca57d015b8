use hysteresis_control::linear::LinearDynamics;
use hysteresis_core::{Bound, CompiledModel, Error as CoreError, MAX_MAGNITUDE, is_admissible};

use super::actuator::Actuator;
use super::error::Error;
use super::noise::Noise;
use super::options::PlantOptions;
use super::quantiser::{Quantiser, check_range};

/// What a plant had to put right since its start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
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
/// use hysteresis_core::{CompiledModel, Process};
/// use hysteresis_simulate::paper;
/// use hysteresis_control::linear::SecondOrder;
/// use hysteresis_simulate::plant::{PlantOptions, Plant};
/// let options = PlantOptions {
///     dynamics: Some(SecondOrder::new(400.0, 0.95)?.into()),
///     noise: 0.016,
///     limits: Some((-560.0, 560.0)),
///     ..PlantOptions::default()
/// };
/// let model = paper::table_1_recovered();
/// let mut plant = Plant::new(&CompiledModel::new(&model), &options)?;
/// let measured = (0..100).map(|_| plant.step(300.0)).last().unwrap();
/// assert!((plant.position() - model.forward().step(300.0)).abs() < 1e-6); // um
/// assert!((measured - plant.position()).abs() < 0.1);
/// plant.step(f64::NAN);
/// assert_eq!((plant.drive(), plant.events().rejected), (300.0, 1));
/// # Ok::<(), hysteresis_simulate::plant::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Plant {
    actuator: Actuator,
    limits: (f64, f64),
    dac: Option<Quantiser>,
    adc: Option<Quantiser>,
    noise: Noise,
    drive: f64,
    position: f64,
    measured: f64,
    events: Events,
    linear_part: LinearDynamics,
    slopes: (f64, f64),
    dt: f64,
}

/// Amplifier, dynamics and delay of a plant.
fn linear_part(options: &PlantOptions) -> LinearDynamics {
    let amplifier = options.amplifier.map_or_else(LinearDynamics::none, LinearDynamics::from);
    let dynamics = options.dynamics.map_or_else(LinearDynamics::none, LinearDynamics::from);
    amplifier.then(dynamics).then(options.delay)
}

/// Limits that no admissible drive meets.
const UNLIMITED: (f64, f64) = (-MAX_MAGNITUDE, MAX_MAGNITUDE);

/// Counts an event if there was one.
#[inline]
fn count(counter: &mut u64, happened: bool) {
    *counter = counter.saturating_add(u64::from(happened));
}

impl Plant {
    /// A plant at rest, the hysteresis that of the model.
    ///
    /// # Errors
    /// [`Error`] that names the parameter: noise that is negative or not finite, limits or a range of which the low end
    /// is not below the high one, bits outside 1 to 32, a D/A converter without limits, a `dt` that is not positive.
    pub fn new(compiled: &CompiledModel, options: &PlantOptions) -> Result<Self, Error> {
        if !(is_admissible(options.noise) && options.noise >= 0.0) {
            let (expected, got) = (Bound::NonNegative, options.noise);
            return Err(CoreError::Domain { parameter: "noise", index: None, expected, got }.into());
        }
        if !(is_admissible(options.dt) && options.dt > 0.0) {
            let (expected, got) = (Bound::Positive, options.dt);
            return Err(CoreError::Domain { parameter: "dt", index: None, expected, got }.into());
        }
        let limits = options.limits.map_or(Ok(UNLIMITED), |limits| check_range("limits", limits))?;
        let dac = match (options.dac_bits, options.limits) {
            (Some(dac_bits), None) => return Err(Error::NoLimits { dac_bits }),
            (Some(bits), Some(limits)) => Some(Quantiser::named(["dac_bits", "limits"], bits, limits)?),
            (None, _) => None,
        };
        let adc = options.adc.map(|(bits, range)| Quantiser::named(["adc_bits", "adc_range"], bits, range));
        let mut plant = Self {
            actuator: Actuator::new(compiled, options, 0.0)?,
            limits,
            dac,
            adc: adc.transpose()?,
            noise: Noise::new(options.noise, options.seed),
            drive: 0.0,
            position: 0.0,
            measured: 0.0,
            events: Events::default(),
            linear_part: linear_part(options),
            slopes: compiled.slope_range(),
            dt: options.dt,
        };
        plant.reset();
        Ok(plant)
    }

    /// Amplifier, dynamics and delay: what feedback has to reckon with.
    #[must_use]
    pub fn linear_part(&self) -> &LinearDynamics {
        &self.linear_part
    }

    /// The least and the greatest slope of the hysteresis.
    #[must_use]
    pub fn slope_range(&self) -> (f64, f64) {
        self.slopes
    }

    /// The drive that the D/A converter puts out for an admissible one.
    #[inline]
    fn put_out(&self, drive: f64) -> f64 {
        let within = drive.max(self.limits.0).min(self.limits.1);
        self.dac.map_or(within, |dac| dac.level(within))
    }

    /// Reads the A/D converter.
    #[inline]
    fn measure(&mut self) {
        let reading = self.position + self.noise.next();
        self.measured = match self.adc {
            Some(adc) => {
                let (low, high) = adc.range();
                count(&mut self.events.overrange, reading < low || reading > high);
                adc.level(reading)
            }
            None => reading,
        };
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
        self.position = self.actuator.advance(self.drive);
        self.measure();
        self.measured
    }

    /// Takes a block of drives: bit for bit what repeated [`step`](Self::step) returns, and the positions.
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
            *measured = self.step(*drive);
            *position = self.position;
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

    /// Sub-steps per sample: 1, or more if an amplifier comes before hysteresis and dynamics.
    ///
    /// ceil(16 2 pi (f_a + f_d) dt) with the frequencies of both, from 8 to 64. Each holds the mean of the model's
    /// outputs at its ends, which has no closed form in between; all else is discretised exactly. On the benchmark
    /// plant P3 that leaves 0.005 nm of a sine of 20 Hz, and 0.2 nm after steps across the whole range.
    #[must_use]
    pub fn sub_steps(&self) -> u32 {
        self.actuator.sub_steps()
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
        self.position = self.actuator.settle(self.drive);
        self.measure();
    }
}
