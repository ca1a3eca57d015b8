//! Sampled test signals: every one starts at its offset and keeps within offset +- amplitude.

use core::fmt;

/// A signal's swing, frequency and sampling.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wave {
    /// Half of the peak-to-peak swing, in the unit of the signal.
    pub amplitude: f64,
    /// Cycles per second, in Hz.
    pub frequency: f64,
    /// Samples per second, in Hz.
    pub rate: f64,
    /// The value around which the signal swings.
    pub offset: f64,
}

/// A parameter that no signal can have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Error {
    /// The name of the argument.
    pub parameter: &'static str,
    /// The domain in words.
    pub expected: &'static str,
    /// The number that came.
    pub got: f64,
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: expected {}, got {}", self.parameter, self.expected, self.got)
    }
}

impl std::error::Error for Error {}

/// The longest signal, in samples: 8 GiB of numbers.
const MAX_SAMPLES: f64 = 1_073_741_824.0;

impl Wave {
    fn check(&self) -> Result<(), Error> {
        let finite = |parameter, got: f64| {
            if got.is_finite() { Ok(()) } else { Err(Error { parameter, expected: "a finite number", got }) }
        };
        let positive = |parameter, got: f64| {
            if got > 0.0 && got.is_finite() {
                Ok(())
            } else {
                Err(Error { parameter, expected: "a finite number above 0", got })
            }
        };
        finite("amplitude", self.amplitude)?;
        finite("offset", self.offset)?;
        positive("frequency", self.frequency)?;
        positive("rate", self.rate)
    }

    /// The samples of `shape`, a function of the number of cycles so far, for a duration in cycles.
    fn sample(&self, cycles: f64, parameter: &'static str, shape: impl Fn(f64) -> f64) -> Result<Vec<f64>, Error> {
        self.check()?;
        let count = (cycles / self.frequency * self.rate).round();
        if !(0.0..=MAX_SAMPLES).contains(&count) {
            let got = if parameter == "seconds" { cycles / self.frequency } else { cycles };
            return Err(Error { parameter, expected: "a duration of 0 to 2^30 samples", got });
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "the range is checked above")]
        let count = count as u32;
        let cycles_per_sample = self.frequency / self.rate;
        Ok((0..count).map(|k| self.offset + self.amplitude * shape(f64::from(k) * cycles_per_sample)).collect())
    }
}

/// A triangle of unit amplitude over cycles: 0, +1, 0, -1, 0.
fn unit_triangle(cycles: f64) -> f64 {
    let phase = (cycles + 0.25).rem_euclid(1.0);
    1.0 - 4.0 * (phase - 0.5).abs()
}

/// offset + amplitude sin(2 pi f t), for `seconds`.
///
/// # Errors
/// [`Error`] for a frequency or rate that is not positive, or a number that is not finite.
///
/// ```
/// use hysteresis_simulate::signals::{Wave, sine};
/// let wave = Wave { amplitude: 2.0, frequency: 1.0, rate: 4.0, offset: 0.0 };
/// assert_eq!(sine(wave, 1.0)?[..2], [0.0, 2.0]);
/// # Ok::<(), hysteresis_simulate::signals::Error>(())
/// ```
pub fn sine(wave: Wave, seconds: f64) -> Result<Vec<f64>, Error> {
    wave.sample(seconds * wave.frequency, "seconds", |cycles| (core::f64::consts::TAU * cycles).sin())
}

/// A triangle that first rises, for `seconds`.
///
/// # Errors
/// [`Error`] for a frequency or rate that is not positive, or a number that is not finite.
///
/// ```
/// use hysteresis_simulate::signals::{Wave, triangle};
/// let wave = Wave { amplitude: 2.0, frequency: 1.0, rate: 8.0, offset: 1.0 };
/// assert_eq!(triangle(wave, 1.0)?, [1.0, 2.0, 3.0, 2.0, 1.0, 0.0, -1.0, 0.0]);
/// # Ok::<(), hysteresis_simulate::signals::Error>(())
/// ```
pub fn triangle(wave: Wave, seconds: f64) -> Result<Vec<f64>, Error> {
    wave.sample(seconds * wave.frequency, "seconds", unit_triangle)
}

/// A triangle whose swing shrinks linearly from the full amplitude to nothing over `cycles`.
///
/// Every reversal differs from all others, so a record of it tells the weights of all operators that it reaches. At
/// the end a known memory is left: the actuator is demagnetised.
///
/// # Errors
/// [`Error`] for a frequency or rate that is not positive, or a number that is not finite.
///
/// ```
/// use hysteresis_simulate::signals::{Wave, decaying_triangle};
/// let wave = Wave { amplitude: 1.0, frequency: 1.0, rate: 4.0, offset: 0.0 };
/// assert_eq!(decaying_triangle(wave, 2.0)?, [0.0, 0.875, 0.0, -0.625, 0.0, 0.375, 0.0, -0.125]);
/// # Ok::<(), hysteresis_simulate::signals::Error>(())
/// ```
pub fn decaying_triangle(wave: Wave, cycles: f64) -> Result<Vec<f64>, Error> {
    wave.sample(cycles, "cycles", |done| (1.0 - done / cycles) * unit_triangle(done))
}
