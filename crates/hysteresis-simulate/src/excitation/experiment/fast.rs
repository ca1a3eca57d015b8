//! The small signal of high frequencies, at the rest drive or as near to it as the limits allow.

use core::f64::consts::TAU;

use hysteresis_control::sampling::{Error, check_count};

use super::Part;
use super::course::{Course, Leg, Sampling};
use super::loops::still;
use super::options::ExperimentOptions;
use crate::signals::{Chirp, Multisine, Phases, Sweep};

/// What tells modes and dead time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FastSignal {
    /// A linear sweep from a share of 1 / 200 of the highest frequency. Where the slew rate does not allow the amplitude, it falls as
    /// 1 / f.
    #[default]
    Chirp,
    /// Four periods of all lines up to the highest frequency, with Schroeder phases.
    Multisine,
}

/// The lowest frequency of the chirp as a share of the highest.
const LOWEST: f64 = 1.0 / 200.0;

/// Whole periods of the multisine.
const PERIODS: u32 = 4;

/// Fades that fit a period of it.
const FADES: u32 = 10;

/// Seconds at the rest drive before and after: modes ring down.
const STILL: f64 = 0.1;

/// Samples of the signal, unless they take less than 2 s or more than 10 s.
const SAMPLES: f64 = 20_000.0;

impl ExperimentOptions {
    /// The part with the fast signal.
    pub(super) fn fast(&self) -> Result<Part, Error> {
        let (unit, lowest) = self.unit_signal()?;
        let unit = self.eased(unit);
        let amplitude = self.fast_amplitude.min(self.slew / fastest(&unit, self.fast_rate));
        // As near to the rest drive as both swings stay within the limits. Not clamp, for roundings of half the range.
        let middle = self.start.max(self.low + amplitude).min(self.high - amplitude);
        let within = |x: f64| (middle + amplitude * x).clamp(self.low, self.high);
        let signal: Vec<f64> = unit.into_iter().map(within).collect();
        let slew = self.speed(self.allowed_frequencies().1);
        let name = match self.fast_signal {
            FastSignal::Chirp => "chirp",
            FastSignal::Multisine => "multisine",
        };
        let course = |name, purpose, legs| Course { name, purpose, slew, frequencies: (0.0, 0.0), legs };
        let mut courses = vec![still("start", "offset and noise of the sensor", STILL)];
        if (middle - self.start).abs() > 0.0 {
            courses.push(course("approach", "room for both swings within the limits", vec![Leg::To(middle)]));
        }
        let frequencies = (lowest, self.fast_frequency);
        courses.push(Course { frequencies, ..course(name, "modes and dead time", vec![Leg::Samples(signal)]) });
        courses.push(course("end", "the modes ring down", vec![Leg::To(self.start), Leg::Rest(STILL)]));
        let sampling = Sampling { parameter: "fast_rate", rate: self.fast_rate, shape: self.shape, start: self.start };
        sampling.part("fast", courses)
    }

    /// A chirp whose frequencies all have the amplitude that the slew rate allows; lines of a multisine all have the same.
    fn eased(&self, mut unit: Vec<f64>) -> Vec<f64> {
        if self.fast_signal == FastSignal::Chirp {
            let (lowest, seconds) = (LOWEST * self.fast_frequency, fast_seconds(self.fast_rate));
            let step = (self.fast_frequency - lowest) / (seconds * self.fast_rate);
            let mut frequency = lowest;
            for x in &mut unit {
                *x *= (self.slew / (self.fast_amplitude * TAU * frequency)).min(1.0);
                frequency += step;
            }
        }
        unit
    }

    /// The signal about 0 with an amplitude of 1, and its lowest frequency.
    fn unit_signal(&self) -> Result<(Vec<f64>, f64), Error> {
        let rate = self.fast_rate;
        let seconds = fast_seconds(rate);
        check_count("fast_rate", (seconds * rate).round())?;
        match self.fast_signal {
            FastSignal::Chirp => {
                let (start_frequency, stop_frequency) = (LOWEST * self.fast_frequency, self.fast_frequency);
                let (amplitude, center, sweep, taper) = (1.0, 0.0, Sweep::Linear, Chirp::TAPER);
                let chirp = Chirp { amplitude, center, start_frequency, stop_frequency, seconds, rate, sweep, taper };
                Ok((chirp.sample()?, start_frequency))
            }
            FastSignal::Multisine => {
                let period = seconds / f64::from(PERIODS);
                let samples = check_count("fast_rate", (period * rate).round())?;
                // Half of an even number of samples is no line.
                let highest = (self.fast_frequency * period).min(0.5 * f64::from(samples - 1));
                #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "below 2^26")]
                let lines = (1..=highest as u32).collect();
                let (amplitude, center, phases, fade) = (1.0, 0.0, Phases::Schroeder, samples / FADES);
                let multisine = Multisine { amplitude, center, lines, phases, samples, periods: PERIODS, fade };
                Ok((multisine.sample()?, 1.0 / period))
            }
        }
    }
}

/// How long the signal lasts, without the fades of a multisine.
pub(super) fn fast_seconds(rate: f64) -> f64 {
    (SAMPLES / rate).clamp(2.0, 10.0)
}

/// The fastest change of a signal, per second.
fn fastest(signal: &[f64], rate: f64) -> f64 {
    signal.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max) * rate
}
