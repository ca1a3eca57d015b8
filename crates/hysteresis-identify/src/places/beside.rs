//! What moves a place beside the operators, with either sign: something in the time of each drive, and a temperature
//! behind its lag.
//!
//! Both are linear, so their amplitudes are found with the weights. What moves in the time of a drive is no part of the
//! stage: it tells the equations apart from it.

use hysteresis_control::stage::TemperatureTerm;
use hysteresis_core::Error as CoreError;

use crate::places::given::Given;
use crate::places::rows::{Rows, value_at};
use crate::records::signal::{as_f64, centred, rms};

/// Drift begins this share of a drive after its start: at first fast, later as the logarithm of time, beside a constant
/// rate.
const DRIFT_BEGINS: f64 = 0.05;

/// The step of derivatives by the thermal lag, as a share of it; at least a sample.
const LAG_STEP: f64 = 0.01;

/// What moves a place in the time of each drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum DriftModel {
    None,
    /// What is seen drifts against the stage.
    Steady,
    /// What was before the drive goes on: creep, and warmth, decay with the time constants that they have.
    Settling,
}

/// A sum of decays: amplitude and time constant in samples of each.
type Decay = Vec<(f64, f64)>;

/// The same at a point; every drive has its own amplitude of each course.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) enum Courses {
    /// A rate, and a logarithm of time.
    Steady,
    /// One for each term; none without a drift.
    Settling(Vec<Decay>),
}

impl Courses {
    pub(crate) fn none() -> Self {
        Self::Settling(Vec::new())
    }

    pub(crate) fn len(&self) -> usize {
        match self {
            Self::Steady => 2,
            Self::Settling(decays) => decays.len(),
        }
    }

    /// Each course at a sample of a drive with this last one.
    fn at(&self, sample: f64, last: f64) -> Vec<f64> {
        match self {
            Self::Steady => {
                let share = sample / last;
                vec![share, (1.0 + share / DRIFT_BEGINS).ln() / (1.0 + 1.0 / DRIFT_BEGINS).ln()]
            }
            Self::Settling(decays) => decays.iter().map(|decay| decayed(decay, sample)).collect(),
        }
    }

    /// What amplitudes make of every sample of a drive.
    pub(crate) fn of(&self, amplitudes: &[f64], samples: usize) -> Vec<f64> {
        let last = as_f64(samples.max(2) - 1);
        let sum =
            |k: usize| self.at(as_f64(k), last).iter().zip(amplitudes).map(|(of, amplitude)| of * amplitude).sum();
        (0..samples).map(sum).collect()
    }
}

fn decayed(decay: &[(f64, f64)], sample: f64) -> f64 {
    // What has no time constant is over at once.
    let going_on = decay.iter().filter(|(_, samples)| *samples > 0.0);
    going_on.map(|(amplitude, samples)| amplitude * (-sample / samples).exp()).sum()
}

/// The columns beside the operators at a point.
#[derive(Clone, Debug)]
pub(crate) struct Beside {
    pub(crate) courses: Courses,
    /// The thermal lag in seconds, if there is a temperature.
    pub(crate) lag: Option<f64>,
    /// The same with a lag that is a step longer, and the amplitudes of all these columns, if there is a derivative by
    /// the lag.
    pub(crate) ahead: Option<(Box<Self>, Vec<f64>)>,
}

impl Beside {
    /// How many columns for so many drives.
    pub(crate) fn columns(&self, drives: usize) -> usize {
        self.courses.len() * drives + usize::from(self.lag.is_some())
    }

    /// The amplitudes of the courses of every drive; none without any.
    pub(crate) fn course_amplitudes(&self, amplitudes: &[f64]) -> Vec<Vec<f64>> {
        let of_drives = &amplitudes[..amplitudes.len() - usize::from(self.lag.is_some())];
        of_drives.chunks_exact(self.courses.len().max(1)).map(<[f64]>::to_vec).collect()
    }

    /// Writes the columns behind so many of the operators, and the derivative by the lag behind all others.
    pub(crate) fn write(&self, given: &Given<'_>, columns: usize, rows: &mut Rows) {
        self.write_courses(given, columns, rows);
        let Some(lag) = self.lag else { return };
        let count = self.columns(given.drives.len());
        Self::write_differences(given, &lagged(given, lag), columns + count - 1, rows);
        let Some((ahead, amplitudes)) = &self.ahead else { return };
        let values = vec![0.0; count * rows.values.len() / rows.width];
        let mut moved = Rows { width: count, values };
        ahead.write(given, 0, &mut moved);
        let (step, last) = (lag_step(lag, given.dt), rows.width - 1);
        for (row, moved) in rows.iter_mut().zip(moved.iter()) {
            let changes = moved.iter().zip(&row[columns..][..count]).map(|(ahead, here)| (ahead - here) / step);
            row[last] = changes.zip(amplitudes).map(|(change, amplitude)| amplitude * change).sum();
        }
    }

    fn write_courses(&self, given: &Given<'_>, columns: usize, rows: &mut Rows) {
        let count = self.courses.len();
        if count == 0 {
            return;
        }
        for ((drive, instants), row) in given.equations().zip(rows.iter_mut()) {
            let last = as_f64(given.drives[drive].len() - 1);
            let [before, after] = instants.map(|at| self.courses.at(at, last));
            let place = &mut row[columns + count * drive..][..count];
            place.iter_mut().zip(after).zip(before).for_each(|((value, after), before)| *value = after - before);
        }
    }

    fn write_differences(given: &Given<'_>, values: &[Vec<f64>], column: usize, rows: &mut Rows) {
        for ((drive, [first, second]), row) in given.equations().zip(rows.iter_mut()) {
            row[column] = value_at(&values[drive], second) - value_at(&values[drive], first);
        }
    }
}

/// The step of a derivative by the lag.
pub(crate) fn lag_step(lag: f64, dt: f64) -> f64 {
    (LAG_STEP * lag).max(dt)
}

/// How much of what a temperature adds changes with a small error of its lag: rms over all drives, about the mean of
/// each.
pub(crate) fn moved_by(given: &Given<'_>, lag: f64, error: f64) -> f64 {
    let step = lag_step(lag, given.dt);
    let thetas = lagged(given, lag);
    let slope = |(ahead, thetas): (Vec<f64>, &Vec<f64>)| -> Vec<f64> {
        ahead.iter().zip(thetas).map(|(ahead, theta)| (ahead - theta) / step).collect()
    };
    let slopes: Vec<Vec<f64>> = lagged(given, lag + step).into_iter().zip(&thetas).map(slope).collect();
    let about_means = |all: &[Vec<f64>]| rms(&all.iter().flat_map(|one| centred(one)).collect::<Vec<_>>());
    error * about_means(&slopes) / about_means(&thetas)
}

/// The temperatures of all drives behind a lag.
fn lagged(given: &Given<'_>, lag: f64) -> Vec<Vec<f64>> {
    let behind = |temperature: &Vec<f64>| -> Result<Vec<f64>, CoreError> {
        TemperatureTerm::new(1.0, lag, 0.0)?.response(temperature, given.dt)
    };
    // Temperatures, interval and lag are checked: none is refused.
    given.temperatures.iter().map(|temperature| behind(temperature).unwrap_or_else(|_| temperature.clone())).collect()
}
