//! Periodic signals: every one starts at its offset and keeps within offset +- amplitude.

use hysteresis_control::sampling::{Error, check_count, check_finite, check_positive, reserve};

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

impl Wave {
    fn check(&self) -> Result<(), Error> {
        check_finite("amplitude", self.amplitude)?;
        check_finite("offset", self.offset)?;
        check_positive("frequency", self.frequency)?;
        check_positive("rate", self.rate)
    }

    /// The samples of `shape`, a function of the number of cycles so far, for a duration in cycles.
    fn sample(&self, cycles: f64, parameter: &'static str, shape: impl Fn(f64) -> f64) -> Result<Vec<f64>, Error> {
        self.check()?;
        let count = (cycles / self.frequency * self.rate).round();
        if count.is_nan() || count < 0.0 {
            let got = if parameter == "seconds" { cycles / self.frequency } else { cycles };
            return Err(Error::domain(parameter, "a finite number, 0 or more", got));
        }
        let count = check_count(parameter, count)?;
        let cycles_per_sample = self.frequency / self.rate;
        let mut samples = reserve(parameter, count)?;
        samples.extend((0..count).map(|k| self.offset + self.amplitude * shape(f64::from(k) * cycles_per_sample)));
        Ok(samples)
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
/// [`Error`] for a frequency or rate that is not positive, or a number that is not finite, or more samples than
/// [`MAX_SAMPLES`](hysteresis_control::sampling::MAX_SAMPLES) or than fit in memory.
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
/// [`Error`] for a frequency or rate that is not positive, or a number that is not finite, or more samples than
/// [`MAX_SAMPLES`](hysteresis_control::sampling::MAX_SAMPLES) or than fit in memory.
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

/// A triangle of one cycle at full swing, which then shrinks linearly to nothing until the end of `cycles`.
///
/// The full strokes make an unknown memory known; then every reversal differs from all others, so a record of it
/// tells the weights of all operators that it reaches. At the end the actuator is demagnetised.
///
/// # Errors
/// [`Error`] for a frequency or rate that is not positive, or a number that is not finite, or more samples than
/// [`MAX_SAMPLES`](hysteresis_control::sampling::MAX_SAMPLES) or than fit in memory.
///
/// ```
/// use hysteresis_simulate::signals::{Wave, decaying_triangle};
/// let wave = Wave { amplitude: 1.0, frequency: 1.0, rate: 4.0, offset: 0.0 };
/// let reversals: Vec<f64> = decaying_triangle(wave, 3.0)?.into_iter().skip(1).step_by(2).collect();
/// assert_eq!(reversals, [1.0, -1.0, 0.875, -0.625, 0.375, -0.125]);
/// # Ok::<(), hysteresis_simulate::signals::Error>(())
/// ```
pub fn decaying_triangle(wave: Wave, cycles: f64) -> Result<Vec<f64>, Error> {
    wave.sample(cycles, "cycles", |done| ((cycles - done) / (cycles - 1.0).max(0.0)).min(1.0) * unit_triangle(done))
}

#[cfg(test)]
mod tests {
    use super::*;

    const WAVE: Wave = Wave { amplitude: 500.0, frequency: 2.0, rate: 1000.0, offset: 10.0 };

    #[test]
    fn a_wave_keeps_within_its_swing_and_starts_at_its_offset() {
        for samples in [sine(WAVE, 3.0), triangle(WAVE, 3.0), decaying_triangle(WAVE, 6.0)] {
            let samples = samples.unwrap();
            assert_eq!(samples.len(), 3000);
            assert_eq!(samples[0], 10.0);
            let (low, high) = samples.iter().fold((f64::MAX, f64::MIN), |(l, h), x| (l.min(*x), h.max(*x)));
            assert!((low + 490.0).abs() < 1e-9 && (high - 510.0).abs() < 1e-9, "{low} to {high}");
        }
    }

    #[test]
    fn a_decaying_triangle_of_one_cycle_is_a_triangle() {
        assert_eq!(decaying_triangle(WAVE, 1.0).unwrap(), triangle(WAVE, 0.5).unwrap());
    }

    #[test]
    fn what_no_signal_can_have_is_named() {
        let named = |result: Result<Vec<f64>, Error>| result.unwrap_err().to_string();
        assert_eq!(named(sine(Wave { rate: 0.0, ..WAVE }, 1.0)), "rate: expected a finite number above 0, got 0.0");
        assert_eq!(
            named(triangle(Wave { frequency: f64::NAN, ..WAVE }, 1.0)),
            "frequency: expected a finite number above 0, got NaN"
        );
        assert_eq!(
            named(triangle(Wave { amplitude: f64::INFINITY, ..WAVE }, 1.0)),
            "amplitude: expected a finite number, got inf"
        );
        assert_eq!(named(decaying_triangle(WAVE, f64::NAN)), "cycles: expected a finite number, 0 or more, got NaN");
        assert_eq!(named(sine(WAVE, -1.0)), "seconds: expected a finite number, 0 or more, got -1.0");
    }
}
