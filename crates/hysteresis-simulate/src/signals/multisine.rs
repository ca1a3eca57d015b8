//! Sines of many frequencies at once, all lines of one discrete Fourier transform.

use core::f64::consts::{PI, TAU};

use hysteresis_control::sampling::{Error, check_count, check_finite, reserve};
use rand_distr::{Distribution, StandardUniform};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng;
use realfft::RealFftPlanner;
use realfft::num_complex::Complex64;

use super::fade;

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
        if self.lines.is_empty() {
            return Err(Error::whole("lines", "at least one line", 0));
        }
        let mut seen = self.lines.clone();
        seen.sort_unstable();
        if let Some(twice) = seen.windows(2).find(|pair| pair[0] == pair[1]) {
            return Err(Error::whole("lines", "every line once", twice[0]));
        }
        match seen.iter().find(|line| **line == 0 || 2 * u64::from(**line) >= u64::from(self.samples)) {
            None => Ok(()),
            Some(line) => {
                let expected = format!("whole numbers above 0, below half of the {} samples of a period", self.samples);
                Err(Error::whole("lines", expected, *line))
            }
        }
    }

    /// One period with a peak of 1.
    fn period(&self) -> Result<Vec<f64>, Error> {
        let inverse = RealFftPlanner::<f64>::new().plan_fft_inverse(self.samples as usize);
        let mut spectrum = inverse.make_input_vec();
        for (line, phase) in self.lines.iter().zip(self.phases()) {
            spectrum[*line as usize] = Complex64::from_polar(1.0, phase);
        }
        let mut period: Vec<f64> = reserve("samples", self.samples)?;
        period.resize(self.samples as usize, 0.0);
        #[expect(clippy::expect_used, reason = "both have the lengths of the plan, and the mean is real")]
        inverse.process(&mut spectrum, &mut period).expect("lengths of the plan");
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
