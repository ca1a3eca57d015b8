//! The drive that moves an oscillator as wanted, in one pass.

use hysteresis_core::{DuhemForward, Error, Process, check_all_finite, check_length};

use super::drive::Hold;
use super::model::HystereticOscillator;
use crate::as_f64;
use crate::checks::check_positive;

/// A wanted motion with its derivatives, sample by sample.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    position: Vec<f64>,
    velocity: Vec<f64>,
    acceleration: Vec<f64>,
    dt: f64,
}

/// Weights of central differences of eighth order, by the distance from the middle: of the first derivative, and of
/// the second.
const FIRST: [f64; 4] = [4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0];
const SECOND: [f64; 4] = [8.0 / 5.0, -1.0 / 5.0, 8.0 / 315.0, -1.0 / 560.0];

impl Motion {
    /// From positions, velocities and accelerations at intervals of `dt` seconds.
    ///
    /// # Errors
    /// [`Error::Length`] for unequal lengths, [`Error::Domain`] for a number that is not finite or an interval that
    /// is not above 0.
    pub fn new(position: Vec<f64>, velocity: Vec<f64>, acceleration: Vec<f64>, dt: f64) -> Result<Self, Error> {
        check_positive("dt", None, dt)?;
        check_length("velocity", position.len(), velocity.len())?;
        check_length("acceleration", position.len(), acceleration.len())?;
        for (parameter, values) in [("y", &position), ("velocity", &velocity), ("acceleration", &acceleration)] {
            check_all_finite(parameter, values)?;
        }
        Ok(Self { position, velocity, acceleration, dt })
    }

    /// From positions alone, by central differences of eighth order over nine samples. Before its beginning the
    /// motion is taken as still, behind its end it goes on as the cubic through its last four samples.
    ///
    /// With 20 samples in the shortest period that the motion holds, what they miss is below 1e-6; with 10 it is
    /// 1e-4.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn from_positions(position: Vec<f64>, dt: f64) -> Result<Self, Error> {
        check_positive("dt", None, dt)?;
        let ahead_of = continued(&position);
        let at = |k: usize, by: usize, ahead: bool| {
            if ahead { ahead_of[k + by] } else { position[k.saturating_sub(by)] }
        };
        let differences = |k: usize| {
            let pairs = (1..).zip(FIRST.iter().zip(SECOND));
            pairs.fold((0.0, 0.0), |(first, second), (by, (a, b))| {
                let (behind, ahead) = (at(k, by, false), at(k, by, true));
                (first + a * (ahead - behind), second + b * (ahead - 2.0 * position[k] + behind))
            })
        };
        let (velocity, acceleration) =
            (0..position.len()).map(differences).map(|(first, second)| (first / dt, second / (dt * dt))).unzip();
        Self::new(position, velocity, acceleration, dt)
    }

    /// Position, velocity and acceleration at a share of the interval behind sample k: the polynomial of fifth order
    /// that has those of both ends.
    fn between(&self, k: usize, s: f64) -> (f64, f64, f64) {
        let (h, next) = (self.dt, (k + 1).min(self.position.len() - 1));
        let [y, v, a] = [&self.position, &self.velocity, &self.acceleration].map(|row| [row[k], row[next]]);
        let [v, a] = [v.map(|v| v * h), a.map(|a| a * (h * h))];
        let rest = y[1] - y[0] - v[0] - 0.5 * a[0];
        let (rest_v, rest_a) = (v[1] - v[0] - a[0], a[1] - a[0]);
        let c3 = 10.0 * rest - 4.0 * rest_v + 0.5 * rest_a;
        let c4 = -15.0 * rest + 7.0 * rest_v - rest_a;
        let c5 = 6.0 * rest - 3.0 * rest_v + 0.5 * rest_a;
        let position = y[0] + s * (v[0] + s * (0.5 * a[0] + s * (c3 + s * (c4 + s * c5))));
        let velocity = v[0] + s * (a[0] + s * (3.0 * c3 + s * (4.0 * c4 + s * 5.0 * c5)));
        let acceleration = a[0] + s * (6.0 * c3 + s * (12.0 * c4 + s * 20.0 * c5));
        (position, velocity / h, acceleration / (h * h))
    }
}

/// The positions, and four more behind their end.
fn continued(position: &[f64]) -> Vec<f64> {
    let mut all = position.to_vec();
    for _ in 0..FIRST.len() {
        let next = match all[..] {
            [.., a, b, c, d] => 4.0 * (d + b) - 6.0 * c - a,
            [.., last] => last,
            [] => break,
        };
        all.push(next);
    }
    all
}

/// Intervals between samples in which turning points are looked for and drives averaged: an even number.
const PARTS: usize = 8;

impl HystereticOscillator {
    /// The drive that makes the oscillator follow a wanted motion: u = (y'' + c y' + k y + z\[y\]) / b, by one pass.
    ///
    /// Before the motion y has come straight from the virgin state, 0, to the first position. Between samples the
    /// motion is the polynomial of fifth order through position, velocity and acceleration; z is exact on it but for
    /// turning points, found to second order. A smooth drive is given at the samples. One that is held
    /// ([`Hold::Zero`]) is the mean over its interval: the drive at the sample would come half an interval late.
    ///
    /// ```
    /// use hysteresis_control::oscillator::{Hold, HystereticOscillator, Motion};
    /// use hysteresis_core::Duhem;
    /// let oscillator = HystereticOscillator::new(0.5, 5.0, 2.5e4, Duhem::from_bouc_wen(2.5e4, 1e3, 0.8, -1.1)?)?;
    /// let dt = 1e-4;
    /// // 0.5 mm at 20 Hz, begun softly.
    /// let wanted: Vec<f64> = (0..5000)
    ///     .map(|k| f64::from(k) * dt)
    ///     .map(|t| 5e-4 * (1.0 - (-(t / 0.1).powi(4)).exp()) * (125.7 * t).sin())
    ///     .collect();
    /// let u = oscillator.inverse(&Motion::from_positions(wanted.clone(), dt)?, Hold::Zero);
    /// let y = oscillator.response(&u, dt, Hold::Zero, None)?;
    /// assert!(y.iter().zip(&wanted).all(|(y, wanted)| (y - wanted).abs() < 5e-7)); // 0.1 %
    /// # Ok::<(), hysteresis_core::Error>(())
    /// ```
    #[must_use]
    pub fn inverse(&self, motion: &Motion, hold: Hold) -> Vec<f64> {
        let mut z = DuhemForward::new(*self.hysteresis());
        let mut before = motion.velocity.first().copied().unwrap_or_default();
        let force = |(y, v, a): (f64, f64, f64), z: f64| a + self.damping() * v + self.stiffness() * y + z;
        let mut drives = Vec::with_capacity(motion.position.len());
        for k in 0..motion.position.len() {
            let here = motion.between(k, 0.0);
            let first = force(here, z.step(here.0));
            let mut mean = 0.0;
            for part in 1..=PARTS {
                let to = motion.between(k, as_f64(part) / as_f64(PARTS));
                if before * to.1 < 0.0 {
                    let turn = (as_f64(part) - 1.0 + before / (before - to.1)) / as_f64(PARTS);
                    z.step(motion.between(k, turn).0);
                }
                let weight = if part == PARTS { 1.0 } else { 2.0 + 2.0 * as_f64(part % 2) };
                mean += weight * force(to, z.step(to.0));
                before = to.1;
            }
            let mean = (first + mean) / (3.0 * as_f64(PARTS));
            // Nothing is known of what comes behind the last sample.
            let is_mean = hold == Hold::Zero && k + 1 < motion.position.len();
            drives.push(if is_mean { mean } else { first } / self.gain());
        }
        drives
    }
}
