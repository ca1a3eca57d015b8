//! What is sampled: the error of parameters that no signal or trajectory can have, and how long either may be.

use core::fmt;
use std::borrow::Cow;

use realfft::RealFftPlanner;
use realfft::num_complex::Complex64;

/// The longest signal, excitation or trajectory, in samples: 2^27. That is 1 GiB of numbers, 3.7 hours at 10 kHz.
pub const MAX_SAMPLES: u32 = 1 << 27;

/// Why a signal, an excitation or a trajectory could not be made.
///
/// ```
/// use hysteresis_control::trajectory::{Sine, Trajectory};
/// let sine = Sine::new(3.0, 2.0, 1.0)?;
/// let error = sine.sample(1e-4, Some(1e5)).unwrap_err();
/// assert_eq!(error.to_string(), "seconds: expected at most 134217728 samples (2^27), got 1000000000");
/// assert_eq!(error.parameter(), "seconds");
/// # Ok::<(), hysteresis_control::sampling::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Error {
    /// A parameter outside its domain.
    Domain {
        /// The name of the argument.
        parameter: &'static str,
        /// The domain in words.
        expected: Cow<'static, str>,
        /// The number that came.
        got: f64,
    },
    /// A whole number outside its domain.
    Whole {
        /// The name of the argument.
        parameter: &'static str,
        /// The domain in words.
        expected: Cow<'static, str>,
        /// The number that came.
        got: u32,
    },
    /// More than [`MAX_SAMPLES`] samples.
    TooLarge {
        /// The name of the argument that asks for so many.
        parameter: &'static str,
        /// How many: a whole number, or infinity.
        samples: f64,
    },
    /// Samples for which there is no memory.
    OutOfMemory {
        /// The name of the argument that asks for so many.
        parameter: &'static str,
        /// How many.
        samples: u32,
    },
}

impl Error {
    /// A parameter outside its domain.
    pub fn domain(parameter: &'static str, expected: impl Into<Cow<'static, str>>, got: f64) -> Self {
        Self::Domain { parameter, expected: expected.into(), got }
    }

    /// A whole number outside its domain.
    pub fn whole(parameter: &'static str, expected: impl Into<Cow<'static, str>>, got: u32) -> Self {
        Self::Whole { parameter, expected: expected.into(), got }
    }

    /// The name of the argument.
    #[must_use]
    pub fn parameter(&self) -> &'static str {
        match self {
            Self::Domain { parameter, .. }
            | Self::Whole { parameter, .. }
            | Self::TooLarge { parameter, .. }
            | Self::OutOfMemory { parameter, .. } => parameter,
        }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Domain { parameter, expected, got } => write!(f, "{parameter}: expected {expected}, got {got:?}"),
            Self::Whole { parameter, expected, got } => write!(f, "{parameter}: expected {expected}, got {got}"),
            Self::TooLarge { parameter, samples } => {
                write!(f, "{parameter}: expected at most {MAX_SAMPLES} samples (2^27), got {samples}")
            }
            Self::OutOfMemory { parameter, samples } => {
                write!(f, "{parameter}: expected samples that fit in memory, got {samples}")
            }
        }
    }
}

impl core::error::Error for Error {}

/// Checks what a number must be, or names it.
///
/// # Errors
/// [`Error::Domain`] unless it holds.
pub fn check_number(parameter: &'static str, holds: bool, expected: &'static str, got: f64) -> Result<(), Error> {
    if holds { Ok(()) } else { Err(Error::domain(parameter, expected, got)) }
}

/// Checks what a whole number must be, or names it.
///
/// # Errors
/// [`Error::Whole`] unless it holds.
pub fn check_whole(parameter: &'static str, holds: bool, expected: &'static str, got: u32) -> Result<(), Error> {
    if holds { Ok(()) } else { Err(Error::whole(parameter, expected, got)) }
}

/// Checks a number that must be finite, or names it.
///
/// # Errors
/// [`Error::Domain`] unless it is.
pub fn check_finite(parameter: &'static str, got: f64) -> Result<(), Error> {
    check_number(parameter, got.is_finite(), "a finite number", got)
}

/// Checks a number that must be finite and above 0, or names it.
///
/// # Errors
/// [`Error::Domain`] unless it is.
pub fn check_positive(parameter: &'static str, got: f64) -> Result<(), Error> {
    check_number(parameter, got > 0.0 && got.is_finite(), "a finite number above 0", got)
}

/// The number of samples that `parameter` asks for, a whole number that is not negative.
///
/// # Errors
/// [`Error::TooLarge`] for more than [`MAX_SAMPLES`].
pub fn check_count(parameter: &'static str, samples: f64) -> Result<u32, Error> {
    if samples <= f64::from(MAX_SAMPLES) {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most 2^27")]
        return Ok(samples as u32);
    }
    Err(Error::TooLarge { parameter, samples })
}

/// Room for as many samples as `parameter` asks for.
///
/// # Errors
/// [`Error::OutOfMemory`] if there is none.
pub fn reserve<T>(parameter: &'static str, samples: u32) -> Result<Vec<T>, Error> {
    let mut room = Vec::new();
    match room.try_reserve_exact(samples as usize) {
        Ok(()) => Ok(room),
        Err(_) => Err(Error::OutOfMemory { parameter, samples }),
    }
}

/// One period of a sum of cosines, 2 cos(2 pi l n / samples + phase) over `lines` of (l, phase), with n from 0 to
/// samples - 1: an inverse Fourier transform.
///
/// It stands here as every crate that plans a transform compiles all algorithms of all lengths, which takes longer than
/// the crate.
///
/// ```
/// use hysteresis_control::sampling::cosines;
/// let period = cosines(4, &[(1, 0.0)])?;
/// assert!(period.iter().zip([2.0, 0.0, -2.0, 0.0]).all(|(got, expected)| (got - expected).abs() < 1e-15));
/// # Ok::<(), hysteresis_control::sampling::Error>(())
/// ```
///
/// # Errors
/// [`Error::Whole`] for a line that is not above 0 and below half of the samples, [`Error::OutOfMemory`] for more
/// samples than fit.
#[expect(clippy::missing_panics_doc, reason = "both have the lengths of the plan, and the mean is real")]
pub fn cosines(samples: u32, lines: &[(u32, f64)]) -> Result<Vec<f64>, Error> {
    lines.iter().try_for_each(|(line, _)| check_line(*line, samples))?;
    let inverse = RealFftPlanner::<f64>::new().plan_fft_inverse(samples as usize);
    let mut spectrum = inverse.make_input_vec();
    for (line, phase) in lines {
        spectrum[*line as usize] = Complex64::from_polar(1.0, *phase);
    }
    let mut period: Vec<f64> = reserve("samples", samples)?;
    period.resize(samples as usize, 0.0);
    inverse.process(&mut spectrum, &mut period).expect("both have the lengths of the plan, and the mean is real");
    Ok(period)
}

/// A line of the spectrum of a period that is neither its mean nor half of the sampling rate.
///
/// # Errors
/// [`Error::Whole`] for another one.
pub fn check_line(line: u32, samples: u32) -> Result<(), Error> {
    if line > 0 && 2 * u64::from(line) < u64::from(samples) {
        return Ok(());
    }
    let expected = format!("whole numbers above 0, below half of the {samples} samples of a period");
    Err(Error::whole("lines", expected, line))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_too_large_names_its_argument() {
        assert_eq!(check_count("seconds", f64::from(MAX_SAMPLES)), Ok(MAX_SAMPLES));
        let error = check_count("seconds", f64::INFINITY).unwrap_err();
        assert_eq!(error.to_string(), "seconds: expected at most 134217728 samples (2^27), got inf");
        // No machine has 2^27 times 64 GiB.
        let error = reserve::<[u64; 1 << 33]>("cycles", MAX_SAMPLES).unwrap_err();
        assert_eq!(error.to_string(), "cycles: expected samples that fit in memory, got 134217728");
        assert_eq!(error.parameter(), "cycles");
    }
}
