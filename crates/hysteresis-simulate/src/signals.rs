//! Sampled test signals. All keep within center +- amplitude.
//!
//! | signals | start and end |
//! |---|---|
//! | [`sine`], [`triangle`], [`decaying_triangle`] | starts at its offset |
//! | [`Chirp`]: a sine whose frequency sweeps | at its center, with a fade |
//! | [`Multisine`]: chosen lines of the discrete Fourier transform | at its center if it fades |

use core::f64::consts::{PI, TAU};

use hysteresis_control::sampling::{
    check_count, check_finite, check_line, check_number, check_positive, check_whole, cosines, reserve,
};
use rand_distr::{Distribution, StandardUniform};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng;

pub use hysteresis_control::sampling::Error;

/// The half cosine from 0 at `share` = 0 to 1 at `share` = 1 by which a signal fades in, and backwards out.
///
/// Its steepest slope is pi/2.
fn fade(share: f64) -> f64 {
    (core::f64::consts::FRAC_PI_2 * share).sin().powi(2)
}

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
        let holds = self.seconds >= 0.0 && self.seconds.is_finite();
        check_number("seconds", holds, "a finite number, 0 or more", self.seconds)?;
        check_number("taper", 0.0 < self.taper && self.taper <= 0.5, "a number above 0, at most 0.5", self.taper)?;
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

/// The phases of the lines: they set how far the peak lies above the rms (the crest factor).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Phases {
    /// -pi j (j - 1) / L for line number j of L (Schroeder 1970): a crest factor of 1.7 to 2 for neighbouring lines.
    #[default]
    Schroeder,
    /// Uniform over the circle, from xoshiro256++ seeded by `seed_from_u64`: a crest factor of 3 to 4 for many lines.
    Random(u64),
}

/// center + a sum over k in `lines` of cos(2 pi k n / `samples` + phi_k), scaled to a peak of `amplitude`.
///
/// Line k has the frequency k / (`samples` dt) for a sampling interval dt. A discrete Fourier transform over one
/// period holds the lines and nothing else, all of one size. With a `fade` the signal starts and ends at `center`, and
/// the whole periods are those between the fades.
///
/// ```
/// use hysteresis_simulate::signals::{Multisine, Phases};
/// let (lines, phases) = ((1..40).collect(), Phases::Schroeder);
/// let multisine = Multisine { amplitude: 2.0, center: 5.0, lines, phases, samples: 1000, periods: 3, fade: 200 };
/// let u = multisine.sample()?;
/// assert_eq!((u.len(), u[0], u[3399]), (200 + 3 * 1000 + 200, 5.0, 5.0));
/// assert_eq!(u[200..1200], u[1200..2200]);
/// # Ok::<(), hysteresis_simulate::signals::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Multisine {
    /// The largest distance from `center`, in the unit of the signal.
    pub amplitude: f64,
    /// Around which it swings, in the unit of the signal.
    pub center: f64,
    /// Cycles per period: whole numbers above 0 and below half of `samples`, each once.
    pub lines: Vec<u32>,
    /// The phases of the lines.
    pub phases: Phases,
    /// Samples of a period.
    pub samples: u32,
    /// Whole periods between the fades.
    pub periods: u32,
    /// Samples in which the signal fades in before the whole periods, along half a cosine, and out behind them.
    pub fade: u32,
}

impl Multisine {
    /// The samples: `periods` x `samples` + 2 `fade` of them.
    ///
    /// # Errors
    /// [`Error`] that names the parameter outside its domain, or more samples than
    /// [`MAX_SAMPLES`](hysteresis_control::sampling::MAX_SAMPLES) or than fit in memory.
    pub fn sample(&self) -> Result<Vec<f64>, Error> {
        self.check()?;
        let total = f64::from(self.samples) * f64::from(self.periods) + 2.0 * f64::from(self.fade);
        let total = check_count("periods", total)?;
        let period = self.period()?;
        let mut signal = reserve("periods", total)?;
        // The fade in ends where a period begins.
        let ahead = (self.samples - self.fade % self.samples) % self.samples;
        signal.extend((0..total).map(|n| {
            let sample = period[((ahead + n % self.samples) % self.samples) as usize];
            self.center + self.amplitude * self.window(n, total) * sample
        }));
        Ok(signal)
    }

    fn check(&self) -> Result<(), Error> {
        check_finite("amplitude", self.amplitude)?;
        check_finite("center", self.center)?;
        check_count("samples", f64::from(self.samples))?;
        check_whole("lines", !self.lines.is_empty(), "at least one line", 0)?;
        let mut seen = self.lines.clone();
        seen.sort_unstable();
        if let Some(twice) = seen.windows(2).find(|pair| pair[0] == pair[1]) {
            return Err(Error::whole("lines", "every line once", twice[0]));
        }
        seen.iter().try_for_each(|line| check_line(*line, self.samples))
    }

    /// One period with a peak of 1.
    fn period(&self) -> Result<Vec<f64>, Error> {
        let lines: Vec<(u32, f64)> = self.lines.iter().copied().zip(self.phases()).collect();
        let mut period = cosines(self.samples, &lines)?;
        let peak = period.iter().fold(0.0, |peak: f64, x| peak.max(x.abs()));
        for x in &mut period {
            *x /= peak;
        }
        Ok(period)
    }

    /// The phases of the lines, in radians.
    fn phases(&self) -> Vec<f64> {
        let count = self.lines.len();
        match self.phases {
            Phases::Random(seed) => {
                let generator = Xoshiro256PlusPlus::seed_from_u64(seed);
                StandardUniform.sample_iter(generator).take(count).map(|share: f64| TAU * share).collect()
            }
            Phases::Schroeder => {
                // Products that are whole turns in exact numbers would lose digits in large ones.
                let lines = count as u64;
                #[expect(clippy::cast_precision_loss, reason = "below 2^28")]
                (0..lines).map(|j| -PI * (j * (j + 1) % (2 * lines)) as f64 / count as f64).collect()
            }
        }
    }

    /// The fade at sample n.
    fn window(&self, n: u32, total: u32) -> f64 {
        let outside = self.fade.saturating_sub(n.min(total - 1 - n));
        if outside == 0 { 1.0 } else { fade(1.0 - f64::from(outside) / f64::from(self.fade)) }
    }
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

    fn multisine() -> Multisine {
        let (lines, phases) = ((1..=100).collect(), Phases::Schroeder);
        Multisine { amplitude: 3.0, center: 10.0, lines, phases, samples: 1000, periods: 2, fade: 0 }
    }

    fn crest(signal: &[f64]) -> f64 {
        let mean_square = signal.iter().map(|u| (u - 10.0).powi(2)).sum::<f64>() / 2000.0;
        3.0 / mean_square.sqrt()
    }

    #[test]
    fn schroeder_phases_have_a_low_crest_factor() {
        let schroeder = crest(&multisine().sample().unwrap());
        assert!(schroeder < 2.0, "{schroeder}");
        let random = crest(&Multisine { phases: Phases::Random(1), ..multisine() }.sample().unwrap());
        assert!((2.2..4.5).contains(&random), "{random}");
    }

    #[test]
    fn a_seed_makes_the_same_signal_and_another_seed_another() {
        let made = |seed| Multisine { phases: Phases::Random(seed), ..multisine() }.sample().unwrap();
        assert_eq!(made(1), made(1));
        assert_ne!(made(1), made(2));
    }

    #[test]
    fn one_line_is_a_cosine() {
        let signal = Multisine { lines: vec![3], ..multisine() }.sample().unwrap();
        for (n, u) in (0..2000_u32).zip(signal) {
            assert!((u - 10.0 - 3.0 * (TAU * 3.0 * f64::from(n) / 1000.0).cos()).abs() < 1e-12);
        }
    }

    #[test]
    fn a_fade_may_be_longer_than_a_period() {
        let signal = Multisine { fade: 2500, ..multisine() }.sample().unwrap();
        let plain = multisine().sample().unwrap();
        assert_eq!((signal.len(), signal[0], signal[6999]), (7000, 10.0, 10.0));
        assert_eq!(signal[2500..4500], plain);
    }

    #[test]
    fn what_no_multisine_can_have_is_named() {
        let named = |multisine: Multisine| multisine.sample().unwrap_err().to_string();
        let lines = |lines: Vec<u32>| named(Multisine { lines, ..multisine() });
        let range = "lines: expected whole numbers above 0, below half of the 1000 samples of a period, got ";
        assert_eq!(lines(vec![0, 1]), format!("{range}0"));
        assert_eq!(lines(vec![1, 500]), format!("{range}500"));
        assert_eq!(lines(vec![7, 3, 7]), "lines: expected every line once, got 7");
        assert_eq!(lines(Vec::new()), "lines: expected at least one line, got 0");
        assert!(named(Multisine { periods: 1 << 20, ..multisine() }).starts_with("periods: expected at most "));
        assert_eq!(
            named(Multisine { amplitude: f64::NAN, ..multisine() }),
            "amplitude: expected a finite number, got NaN"
        );
    }
}
