//! What an experiment is asked to be, with its defaults and checks.

use hysteresis_control::sampling::{Error, check_finite, check_positive};

use super::super::decay::ExcitationOptions;
use super::super::moves::Shape;
use super::fast::fast_seconds;
use super::{Experiment, FastSignal};

/// Cycles of decaying amplitude at the second frequency: five sizes tell rate from amplitude.
pub(super) const SECOND_CYCLES: u32 = 5;

/// The least ratio of the two frequencies of the loops: less does not tell rate from amplitude.
const APART: f64 = 3.0;

/// Limits, rates and sizes of an experiment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExperimentOptions {
    /// The lowest value of the drive, in its unit (V).
    pub low: f64,
    /// The highest value of the drive.
    pub high: f64,
    /// The largest speed, in the unit of the drive per second.
    pub slew: f64,
    /// Samples per second of loops and rests, in Hz.
    pub rate: f64,
    /// Samples per second of the fast signal, in Hz.
    pub fast_rate: f64,
    /// The two frequencies of a full stroke, in Hz, the lower one first. Where the slew rate is too low for the second
    /// one, it is what the slew rate allows. The first one is at most a third of the second one.
    pub frequencies: (f64, f64),
    /// How many cycles the reversals take to decay, and again to grow.
    pub cycles: u32,
    /// How the drive goes from one reversal to the next.
    pub shape: Shape,
    /// What the reversals decay to, between the limits.
    pub center: f64,
    /// The rest drive: where every part starts and ends, within the limits.
    pub start: f64,
    /// How long each of the four rests lasts, in seconds.
    pub rest: f64,
    /// The small signal that tells modes and dead time.
    pub fast_signal: FastSignal,
    /// Its largest amplitude, in the unit of the drive. At high frequencies the slew rate may ask for less.
    pub fast_amplitude: f64,
    /// Its highest frequency, in Hz, at most half of `fast_rate`.
    pub fast_frequency: f64,
}

/// The fewest cycles of its highest frequency for as long as the fast signal lasts.
const MIN_FAST_CYCLES: f64 = 8.0;

impl ExperimentOptions {
    /// The defaults: frequencies of 1 and 10 Hz, 20 cycles of triangles about the middle of the limits, rests of 10 s,
    /// at 0 or the limit nearest to it before and after; a chirp of 1 % of half the range up to 0.4 of the Nyquist
    /// frequency, at the rate of the loops.
    #[must_use]
    pub fn new(low: f64, high: f64, slew: f64, rate: f64) -> Self {
        Self {
            low,
            high,
            slew,
            rate,
            fast_rate: rate,
            frequencies: (1.0, 10.0),
            cycles: 20,
            shape: Shape::Triangle,
            center: 0.5 * low + 0.5 * high,
            // Not clamp, which panics if low is above high: `experiment` says what is wrong with them.
            start: 0.0_f64.max(low).min(high),
            rest: 10.0,
            fast_signal: FastSignal::Chirp,
            fast_amplitude: 0.005 * (high - low),
            fast_frequency: Self::default_fast_frequency(rate),
        }
    }

    /// 0.4 of the Nyquist frequency: between samples a held drive is a poor sine at frequencies near to it.
    #[must_use]
    pub fn default_fast_frequency(fast_rate: f64) -> f64 {
        0.2 * fast_rate
    }

    /// The drives of the experiment: the fast signal, then loops and rests. Each starts and ends at `start`.
    ///
    /// # Errors
    /// [`Error`] that names the parameter outside its domain.
    ///
    /// ```
    /// use hysteresis_simulate::excitation::ExperimentOptions;
    /// let options = ExperimentOptions { fast_rate: 1e4, ..ExperimentOptions::new(0.0, 150.0, 2000.0, 1e3) };
    /// let [fast, loops] = &options.experiment()?.parts[..] else { unreachable!() };
    /// assert_eq!((fast.rate, loops.rate), (1e4, 1e3));
    /// let names: Vec<_> = loops.segments.iter().map(|segment| segment.name).collect();
    /// assert_eq!(names[1..5], ["settle", "major", "decaying", "growing"]);
    /// assert!(loops.drive.len() < 120_000); // 120 s
    /// # Ok::<(), hysteresis_simulate::signals::Error>(())
    /// ```
    pub fn experiment(&self) -> Result<Experiment, Error> {
        self.check()?;
        Ok(Experiment { parts: vec![self.fast()?, self.loops()?] })
    }

    /// The two frequencies of a full stroke that the slew rate allows, in Hz.
    pub(super) fn allowed_frequencies(&self) -> (f64, f64) {
        let fastest = self.slew / (2.0 * (self.high - self.low) * self.shape.stretch());
        let second = self.frequencies.1.min(fastest);
        (self.frequencies.0.min(second / APART), second)
    }

    /// The largest speed of full strokes at a frequency.
    pub(super) fn speed(&self, frequency: f64) -> f64 {
        // The slew rate itself if that is what sets the frequency: the product may be off by a rounding.
        (2.0 * (self.high - self.low) * self.shape.stretch() * frequency).min(self.slew)
    }

    /// Decaying reversals at a frequency.
    pub(super) fn decay(&self, frequency: f64, cycles: u32) -> ExcitationOptions {
        let Self { low, high, rate, shape, center, start, .. } = *self;
        ExcitationOptions { low, high, slew: self.speed(frequency), rate, cycles, shape, center, start }
    }

    fn check(&self) -> Result<(), Error> {
        ExcitationOptions { slew: self.slew, ..self.decay(1.0, self.cycles) }.check_domain()?;
        let (first, second) = self.frequencies;
        if !(0.0 < first && first < second && second.is_finite()) {
            let got = if 0.0 < first && first.is_finite() { second } else { first };
            return Err(Error::domain("frequencies", "two numbers above 0, the lower one first", got));
        }
        let (first, second) = self.allowed_frequencies();
        self.decay(first, self.cycles).check_steps()?;
        self.decay(second, SECOND_CYCLES).check_steps()?;
        if self.rest < 0.0 {
            return Err(Error::domain("rest", "a finite number, 0 or more", self.rest));
        }
        check_finite("rest", self.rest)?;
        check_positive("fast_rate", self.fast_rate)?;
        let least = MIN_FAST_CYCLES / fast_seconds(self.fast_rate);
        if !(least <= self.fast_frequency && self.fast_frequency <= 0.5 * self.fast_rate) {
            let expected = format!("a number from {least:?} to half of `fast_rate`, {:?} Hz", self.fast_rate);
            return Err(Error::domain("fast_frequency", expected, self.fast_frequency));
        }
        let most = 0.5 * (self.high - self.low);
        if !(0.0 < self.fast_amplitude && self.fast_amplitude <= most) {
            let expected = format!("a number above 0, at most half of the range, {most:?}");
            return Err(Error::domain("fast_amplitude", expected, self.fast_amplitude));
        }
        Ok(())
    }
}
