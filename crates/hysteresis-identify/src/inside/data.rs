//! A record as the fit sees it: one period or all of it, what is fitted and what is held out, and the drive between samples.

use hysteresis_control::oscillator::Hold;
use hysteresis_control::oscillator::drive::FineDrive;

use crate::error::{Error, RecordError};
use crate::records::record::Record;
use crate::records::signal::{as_f64, bounds};

/// The most periods that are looked for.
const MOST_PERIODS: usize = 64;

/// A drive repeats if no sample differs by more than this share of its range.
const SAME_DRIVE: f64 = 1e-9;

/// The first period is steady if it differs from the second by at most this much more than the others differ.
const STEADY: f64 = 1.2;

/// Held-out samples are those of the last part of the record, or of the period: this share.
const HELD_OUT: f64 = 0.3;

/// One period of a steady record, averaged, or a whole record from rest.
pub(super) struct Data {
    pub(super) u: Vec<f64>,
    pub(super) y: Vec<f64>,
    /// The number of periods; 1 if the record does not repeat.
    pub(super) periods: usize,
    /// Standard deviation of the noise of a measured sample, if periods tell.
    pub(super) noise: Option<f64>,
    pub(super) skip: usize,
    pub(super) dt: f64,
}

/// Which samples a fit takes.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Part {
    Fitted,
    HeldOut,
    All,
}

impl Data {
    /// From a record, the number of its periods or None to look for them, and how many samples are not fitted.
    pub(super) fn new(u: &[f64], y: &[f64], dt: f64, periods: Option<usize>, skip: usize) -> Result<Self, Error> {
        let in_record = |error: RecordError| {
            error.renamed(|name| match name {
                "input" => "u",
                "output" => "y",
                other => other,
            })
        };
        Record::new(u, y, skip).map_err(|error| in_record(error).in_record(0))?.sampled_every(dt)?;
        let periods = match periods {
            Some(periods) if periods >= 1 && u.len().is_multiple_of(periods) => periods,
            Some(got) => {
                return Err(Error::whole("periods", "a whole number above 0 that divides the number of samples", got));
            }
            None => found_periods(u, y),
        };
        let n = u.len() / periods;
        let average = |signal: &[f64]| -> Vec<f64> {
            (0..n).map(|k| signal[k..].iter().step_by(n).sum::<f64>() / as_f64(periods)).collect()
        };
        let (mean_u, mean_y) = (average(u), average(y));
        let noise = (periods > 1).then(|| {
            let squares: f64 = y.iter().zip(mean_y.iter().cycle()).map(|(y, mean)| (y - mean).powi(2)).sum();
            (squares / as_f64((periods - 1) * n)).sqrt()
        });
        let skip = if periods > 1 { 0 } else { skip };
        Ok(Self { u: mean_u, y: mean_y, periods, noise, skip, dt })
    }

    /// Whether a sample belongs to a part.
    pub(super) fn holds(&self, part: Part, k: usize) -> bool {
        let fitted = as_f64(k - self.skip.min(k)) < (1.0 - HELD_OUT) * as_f64(self.y.len() - self.skip);
        k >= self.skip && (part == Part::All || fitted == (part == Part::Fitted))
    }

    /// The samples of a part.
    pub(super) fn samples(&self, part: Part) -> impl Iterator<Item = usize> + '_ {
        (0..self.y.len()).filter(move |k| self.holds(part, *k))
    }

    /// The drive between samples. A period comes again.
    pub(super) fn fine_drive(&self, hold: Hold, sub_steps: usize) -> FineDrive {
        FineDrive::new(&self.u, hold, self.periods > 1, sub_steps)
    }
}

/// How often the drive repeats while the output does so too: 1 if the first period is not steady.
fn found_periods(u: &[f64], y: &[f64]) -> usize {
    let (low, high) = bounds(u);
    let repeats = |count: usize| {
        let n = u.len() / count;
        u.len().is_multiple_of(count)
            && u[n..].iter().zip(u).all(|(one, other)| (one - other).abs() <= SAME_DRIVE * (high - low))
    };
    let Some(count) = (2..=MOST_PERIODS.min(u.len() / 2)).rev().find(|count| repeats(*count)) else { return 1 };
    let n = u.len() / count;
    let differs = |period: usize| {
        let (one, other) = (&y[(period - 1) * n..period * n], &y[period * n..(period + 1) * n]);
        one.iter().zip(other).map(|(p, q)| (p - q).powi(2)).sum::<f64>().sqrt()
    };
    let size = y.iter().map(|y| y * y).sum::<f64>().sqrt();
    let later = (2..count).map(differs).fold(1e-6 * size, f64::max);
    if differs(1) <= STEADY * later { count } else { 1 }
}
