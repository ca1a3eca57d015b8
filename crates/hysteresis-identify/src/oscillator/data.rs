//! A record as the fit sees it: one period or all of it, what is fitted and what is held out.

use crate::error::{Error, RecordError};
use crate::records::record::Record;
use crate::records::signal::{as_f64, bounds};

/// The most periods that are looked for.
const MOST_PERIODS: usize = 64;

/// A drive repeats if no sample differs by more than this share of its range.
const SAME_DRIVE: f64 = 1e-9;

/// The first period is steady if it differs from the second by at most this much more than the others differ; of two
/// periods, if their first halves differ by at most this much more than their second halves.
const STEADY: f64 = 1.2;

/// Periods drift if the last differs from the first by more than this times what neighbours differ.
const DRIFTS: f64 = 1.5;

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
            Some(got) if got < 1 || !u.len().is_multiple_of(got) => {
                return Err(Error::whole("periods", "a whole number above 0 that divides the number of samples", got));
            }
            Some(got) if !repeats(u, got) => {
                let expected = "a number of equal periods of u: it does not repeat so often";
                return Err(Error::whole("periods", expected, got));
            }
            Some(periods) => periods,
            None => found_periods(u, y),
        };
        if periods > 1 && skip > 0 {
            let expected = "0 for a record of equal periods (periods=1 takes it as one record)";
            return Err(Error::whole("skip", expected, skip));
        }
        let n = u.len() / periods;
        let average = |signal: &[f64]| -> Vec<f64> {
            (0..n).map(|k| signal[k..].iter().step_by(n).sum::<f64>() / as_f64(periods)).collect()
        };
        let (mean_u, mean_y) = (average(u), average(y));
        let noise = (periods > 1).then(|| {
            let squares: f64 = y.iter().zip(mean_y.iter().cycle()).map(|(y, mean)| (y - mean).powi(2)).sum();
            (squares / as_f64((periods - 1) * n)).sqrt()
        });
        Ok(Self { u: mean_u, y: mean_y, periods, noise, skip, dt })
    }

    /// How long the record is, or its period.
    pub(super) fn seconds(&self) -> f64 {
        as_f64(self.y.len()) * self.dt
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
}

/// Whether a drive is so many equal periods.
fn repeats(u: &[f64], count: usize) -> bool {
    let (low, high) = bounds(u);
    let n = u.len() / count;
    u.len().is_multiple_of(count)
        && u[n..].iter().zip(u).all(|(one, other)| (one - other).abs() <= SAME_DRIVE * (high - low))
}

/// How often the drive repeats while the output does so too: 1 if the first period is not steady, or all of them drift.
fn found_periods(u: &[f64], y: &[f64]) -> usize {
    let Some(count) = (2..=MOST_PERIODS.min(u.len() / 2)).rev().find(|count| repeats(u, *count)) else { return 1 };
    let n = u.len() / count;
    let distance = |one: &[f64], other: &[f64]| one.iter().zip(other).map(|(p, q)| (p - q).powi(2)).sum::<f64>().sqrt();
    let period = |number: usize| &y[number * n..(number + 1) * n];
    let differs = |number: usize| distance(period(number - 1), period(number));
    let least = 1e-6 * y.iter().map(|y| y * y).sum::<f64>().sqrt();
    if count == 2 {
        // No third period to compare with. What settles does so within the period; noise stays.
        let half = n / 2;
        let (early, late) = (distance(&y[..half], &y[n..n + half]), distance(&y[half..n], &y[n + half..]));
        return if early <= STEADY * late.max(least) { count } else { 1 };
    }
    let later = (2..count).map(differs).fold(least, f64::max);
    let is_steady = differs(1) <= STEADY * later && distance(period(0), period(count - 1)) <= DRIFTS * later;
    if is_steady { count } else { 1 }
}

#[cfg(test)]
mod tests {
    use super::*;

    const N: usize = 400;

    /// The drive of so many periods, and a position: its own, what dies out, and noise.
    fn record(count: usize, settling: f64, noise: f64) -> (Vec<f64>, Vec<f64>) {
        let mut seed = 7_u32;
        let at = |k: usize| {
            let phase = as_f64(k % N) / as_f64(N) * std::f64::consts::TAU;
            let u = phase.sin() + 0.3 * (3.0 * phase).cos();
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let random = f64::from(seed >> 8) / f64::from(1 << 24) - 0.5;
            (u, 2.0 * u + settling * (-as_f64(k) / 60.0).exp() + noise * random)
        };
        (0..count * N).map(at).unzip()
    }

    fn found(count: usize, settling: f64, noise: f64) -> usize {
        let (u, y) = record(count, settling, noise);
        Data::new(&u, &y, 1e-3, None, 0).unwrap().periods
    }

    #[test]
    fn two_noisy_periods_are_steady_and_two_that_settle_are_not() {
        assert_eq!([found(2, 0.0, 0.0), found(2, 0.0, 0.02), found(2, 0.5, 0.0), found(2, 0.5, 0.02)], [2, 2, 1, 1]);
        assert_eq!([found(4, 0.0, 0.02), found(4, 0.5, 0.02)], [4, 1]);
    }

    #[test]
    fn periods_that_drift_steadily_are_not_steady() {
        let (u, y) = record(4, 0.0, 0.02);
        let drifting = |by: f64| {
            let y: Vec<f64> = y.iter().enumerate().map(|(k, y)| y + by * as_f64(k) / as_f64(N)).collect();
            Data::new(&u, &y, 1e-3, None, 0).unwrap().periods
        };
        // The noise of a sample is 0.006.
        assert_eq!([drifting(0.0), drifting(1e-3), drifting(0.02), drifting(1.0)], [4, 4, 1, 1]);
    }

    #[test]
    fn periods_that_are_none_and_samples_to_skip_beside_periods_are_refused() {
        let (u, y) = record(4, 0.0, 0.02);
        let refused = |u: &[f64], periods, skip| {
            let error = Data::new(u, &y, 1e-3, periods, skip).err().unwrap();
            (error.parameter(), error.to_string())
        };
        let mut other = u.clone();
        other[N + 3] += 1e-6;
        assert_eq!(
            refused(&other, Some(4), 0),
            (
                Some("periods"),
                "periods: expected a number of equal periods of u: it does not repeat so often, got 4".to_owned()
            )
        );
        assert_eq!(refused(&u, Some(8), 0).0, Some("periods"));
        assert_eq!(refused(&u, Some(7), 0).0, Some("periods"));
        assert_eq!(refused(&u, Some(4), 5).0, Some("skip"));
        assert_eq!(refused(&u, None, 5).0, Some("skip"));
        assert_eq!(Data::new(&u, &y, 1e-3, Some(1), 5).unwrap().skip, 5);
        assert_eq!(Data::new(&u, &y, 1e-3, Some(2), 0).unwrap().periods, 2);
    }
}
