//! What moves a place beside the operators, with either sign: drift in the time of each drive, and a temperature behind its lag.
//!
//! Both are linear, so their amplitudes are found with the weights. Drift is no part of the stage: it tells the pairs apart from it.

use hysteresis_control::stage::TemperatureTerm;
use hysteresis_core::Error as CoreError;

use crate::places::given::Given;
use crate::places::rows::{Rows, value_at};
use crate::records::signal::as_f64;

/// Drift begins this share of a drive after its start: at first fast, later as the logarithm of time, beside a constant rate.
const DRIFT_BEGINS: f64 = 0.05;

/// How many amplitudes the drift of a drive has.
const DRIFTS: usize = 2;

/// The step of the derivative by the thermal lag, as a share of it; at least a sample.
const LAG_STEP: f64 = 0.01;

/// The columns beside the operators at a point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Beside {
    pub(crate) drift: bool,
    /// The thermal lag in seconds, if there is a temperature.
    pub(crate) lag: Option<f64>,
    /// The sensitivity at which the derivative by the lag is taken, if it is.
    pub(crate) slope_at: Option<f64>,
}

/// What the two amplitudes of a drift make of a place at a share of the drive: a rate, and a logarithm of time.
fn drifts(share: f64) -> [f64; DRIFTS] {
    [share, (1.0 + share / DRIFT_BEGINS).ln() / (1.0 + 1.0 / DRIFT_BEGINS).ln()]
}

/// Drift at every sample of a drive.
pub(crate) fn drift_of(amplitudes: [f64; DRIFTS], samples: usize) -> Vec<f64> {
    let last = as_f64(samples.max(2) - 1);
    let at = |k: usize| drifts(as_f64(k) / last).iter().zip(amplitudes).map(|(of, amplitude)| of * amplitude).sum();
    (0..samples).map(at).collect()
}

impl Beside {
    /// How many columns for so many drives.
    pub(crate) fn columns(drift: bool, temperature: bool, drives: usize) -> usize {
        usize::from(drift) * DRIFTS * drives + usize::from(temperature)
    }

    /// The amplitudes of the drift of every drive.
    pub(crate) fn drift_amplitudes(&self, amplitudes: &[f64]) -> Vec<[f64; DRIFTS]> {
        let drifts = &amplitudes[..amplitudes.len() - usize::from(self.lag.is_some())];
        drifts.chunks_exact(DRIFTS).map(|pair| [pair[0], pair[1]]).collect()
    }

    /// Writes the columns behind so many of the operators, and the derivative by the lag behind all others.
    pub(crate) fn write(&self, given: &Given<'_>, columns: usize, rows: &mut Rows) {
        if self.drift {
            for ((drive, instants), row) in given.equations().zip(rows.iter_mut()) {
                let last = as_f64(given.drives[drive].len() - 1);
                let [before, after] = instants.map(|at| drifts(at / last));
                let place = &mut row[columns + DRIFTS * drive..][..DRIFTS];
                place.iter_mut().zip(after).zip(before).for_each(|((value, after), before)| *value = after - before);
            }
        }
        let Some(lag) = self.lag else { return };
        let at = columns + Self::columns(self.drift, true, given.drives.len()) - 1;
        let thetas = lagged(given, lag);
        Self::write_differences(given, &thetas, at, rows);
        if let Some(sensitivity) = self.slope_at {
            let step = (LAG_STEP * lag).max(given.dt);
            let slope = |(ahead, theta): (&Vec<f64>, &Vec<f64>)| -> Vec<f64> {
                ahead.iter().zip(theta).map(|(ahead, theta)| sensitivity * (ahead - theta) / step).collect()
            };
            let slopes: Vec<Vec<f64>> = lagged(given, lag + step).iter().zip(&thetas).map(slope).collect();
            Self::write_differences(given, &slopes, rows.width - 1, rows);
        }
    }

    fn write_differences(given: &Given<'_>, values: &[Vec<f64>], column: usize, rows: &mut Rows) {
        for ((drive, [first, second]), row) in given.equations().zip(rows.iter_mut()) {
            row[column] = value_at(&values[drive], second) - value_at(&values[drive], first);
        }
    }
}

/// The temperatures of all drives behind a lag.
fn lagged(given: &Given<'_>, lag: f64) -> Vec<Vec<f64>> {
    let behind = |temperature: &Vec<f64>| -> Result<Vec<f64>, CoreError> {
        TemperatureTerm::new(1.0, lag, 0.0)?.response(temperature, given.dt)
    };
    // Temperatures, interval and lag are checked: none is refused.
    given.temperatures.iter().map(|temperature| behind(temperature).unwrap_or_else(|_| temperature.clone())).collect()
}
