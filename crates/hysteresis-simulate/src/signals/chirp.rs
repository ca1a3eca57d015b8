//! A sine whose frequency sweeps: what tells resonances.

use core::f64::consts::TAU;

use hysteresis_control::sampling::{Error, check_count, check_finite, check_positive, reserve};

use super::fade;

/// How the frequency goes from the first to the last.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sweep {
    /// f(t) = f0 + (f1 - f0) t / T: every Hz gets the same time.
    #[default]
    Linear,
    /// f(t) = f0 (f1 / f0)^(t / T): every octave gets the same time.
    Logarithmic,
}

/// center + amplitude w(t / T) sin(phi(t)), whose frequency phi' / (2 pi) sweeps from f0 to f1 in the time T.
///
/// w is the fade: with s = t / T and the share p = `taper` it is sin^2(pi s / (2 p)) for s < p, the same backwards for
/// s > 1 - p, and 1 between. So the signal starts and ends at `center`, at rest, and changes nowhere faster than
/// amplitude (2 pi max(f0, f1) + pi / (2 p T)).
///
/// ```
/// use hysteresis_simulate::signals::{Chirp, Sweep};
/// let chirp = Chirp {
///     amplitude: 2.0, center: 5.0, start_frequency: 1.0, stop_frequency: 20.0, seconds: 3.0, rate: 100.0,
///     sweep: Sweep::Linear, taper: Chirp::TAPER,
/// };
/// let samples = chirp.sample()?;
/// assert_eq!((samples.len(), samples[0], samples[299]), (300, 5.0, 5.0));
/// assert!(samples.iter().all(|u| (3.0..=7.0).contains(u)));
/// # Ok::<(), hysteresis_simulate::signals::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chirp {
    /// Half of the peak-to-peak swing between the fades, in the unit of the signal.
    pub amplitude: f64,
    /// Where it starts and ends, and around which it swings.
    pub center: f64,
    /// f0, in Hz: above 0 and at most half of `rate`.
    pub start_frequency: f64,
    /// f1, in Hz: above 0 and at most half of `rate`.
    pub stop_frequency: f64,
    /// Duration: the signal has `seconds` x `rate` samples, T lies between the first and the last.
    pub seconds: f64,
    /// Samples per second, in Hz.
    pub rate: f64,
    /// How the frequency goes from f0 to f1.
    pub sweep: Sweep,
    /// p, the share of T in which the signal fades in, and out: above 0, at most 0.5.
    pub taper: f64,
}

impl Chirp {
    /// The usual share in which it fades.
    pub const TAPER: f64 = 0.05;

    /// The samples.
    ///
    /// # Errors
    /// [`Error`] that names the parameter outside its domain, or more samples than
    /// [`MAX_SAMPLES`](hysteresis_control::sampling::MAX_SAMPLES) or than fit in memory.
    pub fn sample(&self) -> Result<Vec<f64>, Error> {
        self.check()?;
        let count = check_count("seconds", (self.seconds * self.rate).round())?;
        let mut samples = reserve("seconds", count)?;
        let last = f64::from(count.max(2) - 1);
        let seconds = last / self.rate;
        samples.extend((0..count).map(|k| {
            let share = f64::from(k) / last;
            let window = fade((share.min(1.0 - share) / self.taper).min(1.0));
            self.center + self.amplitude * window * (TAU * self.cycles(share, seconds)).sin()
        }));
        Ok(samples)
    }

    fn check(&self) -> Result<(), Error> {
        check_finite("amplitude", self.amplitude)?;
        check_finite("center", self.center)?;
        check_positive("rate", self.rate)?;
        for (name, frequency) in [("start_frequency", self.start_frequency), ("stop_frequency", self.stop_frequency)] {
            if !(0.0 < frequency && frequency <= 0.5 * self.rate) {
                let expected = format!("a number above 0, at most half of the rate of {:?} Hz", self.rate);
                return Err(Error::domain(name, expected, frequency));
            }
        }
        if !(self.seconds >= 0.0 && self.seconds.is_finite()) {
            return Err(Error::domain("seconds", "a finite number, 0 or more", self.seconds));
        }
        if !(0.0 < self.taper && self.taper <= 0.5) {
            return Err(Error::domain("taper", "a number above 0, at most 0.5", self.taper));
        }
        Ok(())
    }

    /// The cycles done after a share of the time T.
    fn cycles(&self, share: f64, seconds: f64) -> f64 {
        let (first, last) = (self.start_frequency, self.stop_frequency);
        let octaves = (last / first).ln();
        match self.sweep {
            // Both laws are the same for equal frequencies, where the second one is 0 / 0.
            Sweep::Logarithmic if octaves != 0.0 => first * seconds * (share * octaves).exp_m1() / octaves,
            _ => seconds * share * (first + 0.5 * (last - first) * share),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CHIRP: Chirp = Chirp {
        amplitude: 3.0,
        center: 10.0,
        start_frequency: 2.0,
        stop_frequency: 50.0,
        seconds: 4.0,
        rate: 1000.0,
        sweep: Sweep::Linear,
        taper: 0.1,
    };

    #[test]
    fn a_chirp_of_one_frequency_is_a_sine() {
        for sweep in [Sweep::Linear, Sweep::Logarithmic] {
            let samples = Chirp { stop_frequency: 2.0, sweep, ..CHIRP }.sample().unwrap();
            // behind the fade in, a tenth of 4 s
            for k in 400..3600_u32 {
                let sine = 10.0 + 3.0 * (TAU * 2.0 * f64::from(k) / 1000.0).sin();
                assert!((samples[k as usize] - sine).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn few_samples_rest_at_the_center() {
        for (seconds, count) in [(0.0, 0), (0.001, 1), (0.002, 2)] {
            assert_eq!(Chirp { seconds, ..CHIRP }.sample().unwrap(), vec![10.0; count]);
        }
    }

    #[test]
    fn what_no_chirp_can_have_is_named() {
        let named = |chirp: Chirp| chirp.sample().unwrap_err().to_string();
        assert_eq!(named(Chirp { taper: 0.6, ..CHIRP }), "taper: expected a number above 0, at most 0.5, got 0.6");
        assert_eq!(
            named(Chirp { stop_frequency: 501.0, ..CHIRP }),
            "stop_frequency: expected a number above 0, at most half of the rate of 1000.0 Hz, got 501.0"
        );
        assert_eq!(
            named(Chirp { start_frequency: f64::NAN, ..CHIRP }),
            "start_frequency: expected a number above 0, at most half of the rate of 1000.0 Hz, got NaN"
        );
        assert_eq!(named(Chirp { seconds: -1.0, ..CHIRP }), "seconds: expected a finite number, 0 or more, got -1.0");
        assert!(named(Chirp { seconds: 1e9, ..CHIRP }).starts_with("seconds: expected at most 134217728 samples"));
    }
}
