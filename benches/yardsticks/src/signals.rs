//! The drive signals of the benches, in V at 10 kHz.

use std::f64::consts::TAU;
use std::fmt;

use serde::{Deserialize, Serialize};

/// Samples of each signal: one second, a whole period of the slowest.
pub const SAMPLES: u32 = 10_000;

/// The reach of the actuator, in V to either side.
pub const REACH: f64 = 500.0;

/// A drive signal. Noise is the same in every run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Signal {
    /// A sine of 1 Hz and 500 V: thousands of samples between reversals.
    #[serde(rename = "1 Hz sine")]
    SlowSine,
    /// A sine of 50 Hz and 500 V, with 0.1 V rms of noise: now and then the noise reverses the direction.
    #[serde(rename = "50 Hz sine + 0.1 V noise")]
    NoisySine,
    /// Ten cycles of 10 Hz that shrink from 500 V to nothing: every reversal is remembered to the end.
    #[serde(rename = "decaying triangle")]
    Triangle,
    /// Uniform over +-500 V, every sample anew: each is a jump past many thresholds.
    #[serde(rename = "white noise, full range")]
    White,
    /// Steps of 1 V rms, reflected at +-500 V: every other sample reverses the direction.
    #[serde(rename = "1 V random walk")]
    Walk,
    /// A sine of 5 Hz and 443 V: a stroke of 2.5 um to either side.
    #[serde(rename = "5 Hz sine, 2.5 um")]
    Stroke,
}

impl Signal {
    /// Those of single actuators, in the order of the tables.
    pub const ALL: [Self; 5] = [Self::SlowSine, Self::NoisySine, Self::Triangle, Self::White, Self::Walk];

    /// As a file name.
    #[must_use]
    pub fn slug(self) -> &'static str {
        match self {
            Self::SlowSine => "sine",
            Self::NoisySine => "noisy-sine",
            Self::Triangle => "triangle",
            Self::White => "white",
            Self::Walk => "walk",
            Self::Stroke => "stroke",
        }
    }

    /// Whether one second of it differs from another.
    #[must_use]
    pub fn is_noise(self) -> bool {
        matches!(self, Self::NoisySine | Self::White | Self::Walk)
    }

    /// One second of the signal; `seed` chooses the noise.
    #[must_use]
    pub fn samples(self, seed: u64) -> Vec<f64> {
        let (mut noise, mut level) = (Noise(fastrand::Rng::with_seed(seed)), 0.0);
        let sample = |k: u32| match self {
            Self::SlowSine => REACH * sine(1.0, k),
            Self::NoisySine => REACH * sine(50.0, k) + noise.rms(0.1),
            Self::Triangle => REACH * decaying_triangle(10.0, 10.0, k),
            Self::White => noise.within(REACH),
            Self::Walk => {
                level = reflect(level + noise.rms(1.0));
                level
            }
            Self::Stroke => 443.0 * sine(5.0, k),
        };
        (0..SAMPLES).map(sample).collect()
    }
}

impl fmt::Display for Signal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.serialize(f)
    }
}

/// Sample k of a sine of this frequency in Hz.
fn sine(frequency: f64, k: u32) -> f64 {
    (TAU * cycles(frequency, k)).sin()
}

/// Sample k of a triangle that shrinks from its second cycle on, to nothing at the end of `count` cycles.
fn decaying_triangle(frequency: f64, count: f64, k: u32) -> f64 {
    let done = cycles(frequency, k);
    let phase = (done + 0.25).rem_euclid(1.0);
    ((count - done) / (count - 1.0)).min(1.0) * (1.0 - 4.0 * (phase - 0.5).abs())
}

fn cycles(frequency: f64, k: u32) -> f64 {
    f64::from(k) * (frequency / f64::from(SAMPLES))
}

/// Uniform noise around zero.
struct Noise(fastrand::Rng);

impl Noise {
    fn within(&mut self, amplitude: f64) -> f64 {
        amplitude * (2.0 * self.0.f64() - 1.0)
    }

    fn rms(&mut self, rms: f64) -> f64 {
        self.within(3.0_f64.sqrt() * rms)
    }
}

fn reflect(x: f64) -> f64 {
    if x.abs() > REACH { (2.0 * REACH).copysign(x) - x } else { x }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_signal_is_one_second_within_reach_and_the_same_every_time() {
        for signal in Signal::ALL.into_iter().chain([Signal::Stroke]) {
            let samples = signal.samples(1);
            assert_eq!(samples.len(), SAMPLES as usize, "{signal}");
            let largest = samples.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
            assert!((5.0..=REACH + 0.1 * 3.0_f64.sqrt()).contains(&largest), "{signal}: {largest}");
            assert_eq!(samples, signal.samples(1), "{signal}");
        }
    }

    #[test]
    fn the_walk_is_reflected_and_its_steps_are_1_v_rms() {
        assert_eq!([reflect(500.5), reflect(-501.0), reflect(3.0)], [499.5, -499.0, 3.0]);
        let walk = Signal::Walk.samples(1);
        let squares: f64 = walk.windows(2).map(|pair| (pair[1] - pair[0]).powi(2)).sum();
        let rms = (squares / f64::from(SAMPLES - 1)).sqrt();
        assert!((rms - 1.0).abs() < 0.02, "{rms}");
    }
}
