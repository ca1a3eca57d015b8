//! How well a plant followed its reference.

use hysteresis_core::{Bound, Error, check_all_finite, is_admissible};

use crate::plant::check_range;

/// The samples of a closed loop. At the moment of sample k the position is `position[k]`, the controller reads
/// `measured[k]`, knows `reference[k]`, and puts out `drive[k]`, which is held until the next sample.
#[derive(Clone, Debug, PartialEq)]
pub struct LoopRecord {
    /// Where the position should be.
    pub reference: Vec<f64>,
    /// What the controller read; NaN where there was no reading.
    pub measured: Vec<f64>,
    /// Where the position was; NaN where it is not known.
    pub position: Vec<f64>,
    /// What was put out: quantised, within the limits, held where the controller gave no number.
    pub drive: Vec<f64>,
}

/// A record that was checked, and what its errors are measured by.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    record: LoopRecord,
    limits: Option<(f64, f64)>,
    period: Option<f64>,
}

/// The errors of a run, or of a part of it.
///
/// The measured error is reference - measured, what the paper plots; the position error is reference - position, what
/// matters, and free of measurement noise. Samples without a reading are left out of the measured errors, those whose
/// position is not known out of the position errors. Where nothing is left, these errors are NaN.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Metrics {
    /// How many samples they are of.
    pub samples: usize,
    /// Largest magnitude of the measured error.
    pub max_error: f64,
    /// Root mean square of the measured error.
    pub rmse: f64,
    /// Largest magnitude of the position error.
    pub max_position_error: f64,
    /// Root mean square of the position error.
    pub position_rmse: f64,
    /// Peak-to-peak of the reference: the base of `hysteresis_percent`.
    pub range: f64,
    /// Largest magnitude of the measured error in % of `range`: what the paper calls hysteresis in Fig. 12 and 13, but
    /// for rounding (erratum 15). None if the reference does not move, or nothing was read.
    pub hysteresis_percent: Option<f64>,
    /// Lowest drive.
    pub drive_low: f64,
    /// Highest drive.
    pub drive_high: f64,
    /// At how many samples the drive was at a limit of the plant.
    pub saturated_count: usize,
    /// At how many samples there was no reading.
    pub missing_count: usize,
}

impl Run {
    /// A record, with the limits of the drive and the period of the reference in samples, as far as known.
    ///
    /// # Errors
    /// [`Error`] that names the array and the sample: all four must have the same length, at least one sample, and only
    /// admissible numbers; the limits (low, high) must be in that order, the period above 0 and shorter than the
    /// record.
    ///
    /// ```
    /// use hysteresis_simulate::metrics::{LoopRecord, Run};
    /// let record = LoopRecord {
    ///     reference: vec![0.0, 2.0, 0.0, -2.0],
    ///     measured: vec![0.0, 1.5, 0.25, -2.0],
    ///     position: vec![0.0, 1.75, 0.0, -2.0],
    ///     drive: vec![10.0, 0.0, -10.0, 0.0],
    /// };
    /// let run = Run::new(record, Some((-10.0, 10.0)), Some(2.0))?;
    /// let (all, settled) = (run.metrics(), run.settled().unwrap());
    /// assert_eq!((all.max_error, all.max_position_error, all.saturated_count), (0.5, 0.25, 2));
    /// assert_eq!((all.range, all.hysteresis_percent), (4.0, Some(12.5)));
    /// assert_eq!((settled.samples, settled.max_error, settled.drive_low), (2, 0.25, -10.0));
    /// # Ok::<(), hysteresis_core::Error>(())
    /// ```
    pub fn new(record: LoopRecord, limits: Option<(f64, f64)>, period: Option<f64>) -> Result<Self, Error> {
        let run = Self::with_missing(record, limits, period)?;
        check_all_finite("measured", &run.record.measured)?;
        check_all_finite("position", &run.record.position)?;
        Ok(run)
    }

    /// As [`new`](Self::new), with NaN allowed where nothing was measured or the position is not known.
    ///
    /// # Errors
    /// As there.
    ///
    /// ```
    /// use hysteresis_simulate::metrics::{LoopRecord, Run};
    /// let (reference, measured) = (vec![0.0, 2.0, 0.0], vec![0.5, f64::NAN, 0.25]);
    /// let record = LoopRecord { reference, measured, position: vec![0.0, 1.75, 0.0], drive: vec![0.0; 3] };
    /// let metrics = Run::with_missing(record, None, None)?.metrics();
    /// assert_eq!((metrics.max_error, metrics.max_position_error, metrics.missing_count), (0.5, 0.25, 1));
    /// # Ok::<(), hysteresis_core::Error>(())
    /// ```
    pub fn with_missing(record: LoopRecord, limits: Option<(f64, f64)>, period: Option<f64>) -> Result<Self, Error> {
        check_reference(&record.reference, period)?;
        let expected = record.reference.len();
        for (parameter, samples) in
            [("measured", &record.measured), ("position", &record.position), ("drive", &record.drive)]
        {
            if samples.len() != expected {
                return Err(Error::Length { parameter, expected, got: samples.len() });
            }
            let is_missing = |x: &f64| x.is_nan() && parameter != "drive";
            let known: Vec<f64> = samples.iter().map(|x| if is_missing(x) { 0.0 } else { *x }).collect();
            check_all_finite(parameter, &known)?;
        }
        let limits = limits.map(|limits| check_range("limits", limits)).transpose()?;
        Ok(Self { record, limits, period })
    }

    /// Of a loop that has checked its input. A reading that is no admissible number is a missing one.
    pub(crate) fn of_loop(mut record: LoopRecord, limits: Option<(f64, f64)>, period: Option<f64>) -> Self {
        for reading in record.measured.iter_mut().chain(&mut record.position) {
            if !is_admissible(*reading) {
                *reading = f64::NAN;
            }
        }
        Self { record, limits, period }
    }

    /// Of a controller with limits of its own: those of the plant or its own, whichever are tighter.
    pub(crate) fn within(self, own: (f64, f64)) -> Self {
        let limits = self.limits.map_or(own, |(low, high)| (low.max(own.0), high.min(own.1)));
        Self { limits: Some(limits), ..self }
    }

    /// The samples.
    #[must_use]
    pub fn record(&self) -> &LoopRecord {
        &self.record
    }

    /// The limits of the drive (low, high), if there are any.
    #[must_use]
    pub fn limits(&self) -> Option<(f64, f64)> {
        self.limits
    }

    /// The period of the reference in samples, if it was given.
    #[must_use]
    pub fn period(&self) -> Option<f64> {
        self.period
    }

    /// The errors of the whole run.
    #[must_use]
    pub fn metrics(&self) -> Metrics {
        self.metrics_from(0)
    }

    /// The errors after the first period; None if no period was given.
    #[must_use]
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "shorter than the record")]
    pub fn settled(&self) -> Option<Metrics> {
        self.period.map(|period| self.metrics_from(period.ceil() as usize))
    }

    fn metrics_from(&self, first: usize) -> Metrics {
        let LoopRecord { reference, measured, position, drive } = &self.record;
        let (reference, drive) = (&reference[first..], &drive[first..]);
        let (max_error, rmse) = errors(reference, &measured[first..]);
        let (max_position_error, position_rmse) = errors(reference, &position[first..]);
        let (low, high) = extremes(reference);
        let (drive_low, drive_high) = extremes(drive);
        let at_limit = |u: &&f64| self.limits.is_some_and(|(low, high)| **u <= low || **u >= high);
        Metrics {
            samples: reference.len(),
            max_error,
            rmse,
            max_position_error,
            position_rmse,
            range: high - low,
            hysteresis_percent: (high > low && !max_error.is_nan()).then(|| 100.0 * max_error / (high - low)),
            drive_low,
            drive_high,
            saturated_count: drive.iter().filter(at_limit).count(),
            missing_count: measured[first..].iter().filter(|y| y.is_nan()).count(),
        }
    }
}

/// Largest magnitude and root mean square of what is missing, over the samples at which something was got.
fn errors(reference: &[f64], got: &[f64]) -> (f64, f64) {
    let missing = || reference.iter().zip(got).filter(|(_, y)| !y.is_nan()).map(|(r, y)| r - y);
    let known = missing().count();
    if known == 0 {
        return (f64::NAN, f64::NAN);
    }
    #[expect(clippy::cast_precision_loss, reason = "no array has 2^53 elements")]
    let count = known as f64;
    (missing().fold(0.0, |max, e| e.abs().max(max)), (missing().map(|e| e * e).sum::<f64>() / count).sqrt())
}

fn extremes(samples: &[f64]) -> (f64, f64) {
    samples.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (x.min(low), x.max(high)))
}

/// Checks a reference and its period, before anything runs.
pub(crate) fn check_reference(reference: &[f64], period: Option<f64>) -> Result<(), Error> {
    if reference.is_empty() {
        return Err(Error::Empty { parameter: "reference" });
    }
    check_all_finite("reference", reference)?;
    let Some(got) = period else { return Ok(()) };
    #[expect(clippy::cast_precision_loss, reason = "no array has 2^53 elements")]
    let high = (reference.len() - 1) as f64;
    if got > 0.0 && got <= high {
        Ok(())
    } else {
        let expected = Bound::Between { low: 0.0, high };
        Err(Error::Domain { parameter: "period", index: None, expected, got })
    }
}
