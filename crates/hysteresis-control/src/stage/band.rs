//! How far a position may be from the one that a stage predicts, said before anything is driven.
//!
//! What the model lacks depends on where the drive turned round last and on where it is now. So the squared errors on
//! held-out loops lie in a table over these two, with what stages lack besides by experience: a share of the width of
//! their loop, more where nothing was recorded. Identification fills the table; here it is read.

use core::f64::consts::{FRAC_1_SQRT_2, SQRT_2};

use hysteresis_core::{Error as CoreError, Process, check_all_finite, is_admissible};
use serde::{Deserialize, Serialize};

use super::{Error, PrecompensateOptions, Precompensated, Stage};
use crate::checks::check_positive;

/// Into how many cells the range of drives is cut, for the drive of now and for that of the last reversal.
pub const CELLS: usize = 12;

/// The drive turns round where it goes back by this share of its range: less is the noise of a converter.
const SWING: f64 = 0.02;

/// How many independent errors a branch, from one reversal to the next, counts for: a long one crosses many cells, and
/// errors differ within one.
const ERRORS_PER_BRANCH: i32 = 32;

/// What identification knows of the errors of its model on records that were not fitted.
///
/// With u the drive, u_r that of the last reversal, v = |u - u_r| / t the mean rate since then and t the time since
/// then, the error of the predicted position has the standard deviation
///
/// ```text
/// s = sqrt(E(u_r, u)^2 R(v) T(t) + (W b)^2)        b: how far u is beyond the records, as a share of their range
/// ```
///
/// E is a table of [`CELLS`] by [`CELLS`] rms errors on held-out loops, with a share of the loop width W that tells by
/// experience what loops leave open, more where none were recorded. R and T are factors that are 1 or more. A sample
/// that is measured has the noise of the sensor on top. The bounds of a level p are at z s, with P(|Z| <= z) = p for a
/// normal Z.
///
/// ```
/// use hysteresis_control::stage::{CELLS, ErrorBand};
/// let band = ErrorBand::new(0.003, (0.0, 150.0), 5.0, vec![vec![0.1; CELLS]; CELLS], vec![(300.0, 1.0)], vec![(10.0, 1.0)])?;
/// let half = band.half_widths(&[0.0, 50.0, 100.0], &[], 0.1, 0.95)?; // um
/// assert!((half[1] - 1.96 * 0.1_f64.hypot(0.003)).abs() < 1e-3);
/// assert!(band.half_widths(&[0.0, 180.0], &[], 1.0, 0.95)?[1] > 1.0); // far beyond the records
/// # Ok::<(), hysteresis_control::stage::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Numbers", into = "Numbers")]
pub struct ErrorBand(Numbers);

/// The numbers of a band as a file has them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Numbers {
    noise: f64,
    drive_range: (f64, f64),
    loop_width: f64,
    errors: Vec<Vec<f64>>,
    rates: Vec<(f64, f64)>,
    times: Vec<(f64, f64)>,
}

impl TryFrom<Numbers> for ErrorBand {
    type Error = Error;

    fn try_from(numbers: Numbers) -> Result<Self, Error> {
        numbers.check()?;
        Ok(Self(numbers))
    }
}

impl From<ErrorBand> for Numbers {
    fn from(band: ErrorBand) -> Self {
        band.0
    }
}

impl Numbers {
    fn check(&self) -> Result<(), Error> {
        let not_negative = |parameter, index, got: f64| {
            let holds = got >= 0.0 && is_admissible(got);
            if holds { Ok(()) } else { Err(CoreError::domain(parameter, index, "a finite number, 0 or more", got)) }
        };
        not_negative("noise", None, self.noise)?;
        not_negative("loop_width", None, self.loop_width)?;
        let (low, high) = self.drive_range;
        if !(is_admissible(low) && is_admissible(high) && low < high) {
            return Err(CoreError::domain("drive_range", Some(1), "finite drives, the low one first", high).into());
        }
        let expected = "a table of 12 rows of 12 rms errors";
        if let Some(got) = [self.errors.len()].into_iter().chain(self.errors.iter().map(Vec::len)).find(|n| *n != CELLS)
        {
            return Err(CoreError::whole("errors", None, expected, got).into());
        }
        self.errors.iter().flatten().enumerate().try_for_each(|(i, got)| not_negative("errors", Some(i), *got))?;
        for (parameter, factors) in [("rates", &self.rates), ("times", &self.times)] {
            if factors.is_empty() {
                return Err(CoreError::Empty { parameter }.into());
            }
            let mut last = 0.0;
            for (i, (limit, factor)) in factors.iter().enumerate() {
                let holds = *limit > last && is_admissible(*limit) && *factor >= 1.0 && is_admissible(*factor);
                if !holds {
                    let expected = "limits that rise from 0, each with a factor of 1 or more";
                    let got = if *limit > last { *factor } else { *limit };
                    return Err(CoreError::domain(parameter, Some(i), expected, got).into());
                }
                last = *limit;
            }
        }
        Ok(())
    }
}

impl ErrorBand {
    /// From the rms noise of the sensor, the drives between which the records lie, the width of the loop, the rms
    /// errors E by the cell of the last reversal (rows) and of the drive (columns), and the factors R and T: each up to
    /// a limit that rises, in drives per second and in seconds. Beyond the last limit R grows with the square of the
    /// rate, T with the time.
    ///
    /// # Errors
    /// [`Error`] that names the argument: numbers below 0 or not finite, a table of another shape, limits that do not
    /// rise, factors below 1.
    pub fn new(
        noise: f64,
        drive_range: (f64, f64),
        loop_width: f64,
        errors: Vec<Vec<f64>>,
        rates: Vec<(f64, f64)>,
        times: Vec<(f64, f64)>,
    ) -> Result<Self, Error> {
        Self::try_from(Numbers { noise, drive_range, loop_width, errors, rates, times })
    }

    /// The rms noise of the sensor, which every sample of a record has on top of the error of the model.
    #[must_use]
    pub fn noise(&self) -> f64 {
        self.0.noise
    }

    /// The standard deviation of the error of the predicted position, for every drive, without the noise of the sensor.
    /// `before` is what was driven before, oldest first: it says where the drive turned round last. Without it the
    /// stage has rested at the first drive.
    ///
    /// # Errors
    /// [`Error`] unless `dt` is finite and above 0, and all drives are finite.
    pub fn deviations(&self, drive: &[f64], before: &[f64], dt: f64) -> Result<Vec<f64>, Error> {
        check_positive("dt", None, dt)?;
        check_all_finite("drive", drive)?;
        check_all_finite("history", before)?;
        let Some(first) = before.first().or(drive.first()) else { return Ok(Vec::new()) };
        let mut branches = Branches::new(*first, self.0.drive_range);
        for drive in before {
            branches.step(*drive);
        }
        Ok(drive.iter().map(|drive| self.deviation(&branches.step(*drive), dt)).collect())
    }

    /// How far above and below the prediction a measured sample lies with probability `level`, for every drive: the
    /// error of the model and the noise of the sensor together.
    ///
    /// # Errors
    /// As [`deviations`](Self::deviations), and for a level that is not between 0 and 1.
    pub fn half_widths(&self, drive: &[f64], before: &[f64], dt: f64, level: f64) -> Result<Vec<f64>, Error> {
        let z = normal_quantile(check_level(level)?);
        let deviations = self.deviations(drive, before, dt)?;
        Ok(deviations.into_iter().map(|s| z * s.hypot(self.0.noise)).collect())
    }

    fn deviation(&self, at: &Place, dt: f64) -> f64 {
        let Numbers { drive_range: (low, high), loop_width, errors, rates, times, .. } = &self.0;
        let seconds = at.samples * dt;
        let beyond = (at.drive - high).max(low - at.drive).max(0.0) / (high - low);
        let factors = factor(rates, at.rate(dt), 2) * factor(times, seconds, 1);
        (errors[at.row()][at.column()] * factors.sqrt()).hypot(loop_width * beyond)
    }
}

/// The factor of the first limit that a number keeps; beyond the last limit it grows with a power of the number.
fn factor(factors: &[(f64, f64)], number: f64, power: i32) -> f64 {
    let kept = factors.iter().find(|(limit, _)| number <= *limit).map(|(_, factor)| *factor);
    let beyond = || factors.last().map_or(1.0, |(limit, factor)| factor * (number / limit).powi(power));
    kept.unwrap_or_else(beyond)
}

/// Where a drive is on its way: what a band depends on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// The drive.
    pub drive: f64,
    /// The drive at which it turned round last, or began.
    pub reversal: f64,
    /// How many samples ago that was.
    pub samples: f64,
    range: (f64, f64),
}

impl Place {
    /// The mean rate since that reversal, and two samples before it as right behind one it is not told.
    #[must_use]
    pub fn rate(&self, dt: f64) -> f64 {
        (self.drive - self.reversal).abs() / ((self.samples + 2.0) * dt)
    }

    /// The cell of the last reversal.
    #[must_use]
    pub fn row(&self) -> usize {
        self.cell(self.reversal)
    }

    /// The cell of the drive.
    #[must_use]
    pub fn column(&self) -> usize {
        self.cell(self.drive)
    }

    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        clippy::cast_precision_loss,
        reason = "below 12"
    )]
    fn cell(&self, drive: f64) -> usize {
        let (low, high) = self.range;
        let share = (drive - low) / (high - low) * CELLS as f64;
        share.clamp(0.0, (CELLS - 1) as f64) as usize
    }
}

/// Follows a drive from reversal to reversal.
#[derive(Clone, Debug)]
pub struct Branches {
    range: (f64, f64),
    rising: Option<bool>,
    /// The furthest drive of this branch, and how many samples ago it was.
    furthest: (f64, f64),
    /// The drive of the last reversal, and how many samples ago it was.
    reversal: (f64, f64),
    is_first: bool,
}

impl Branches {
    /// At rest at a drive, for records within this range of drives.
    #[must_use]
    pub fn new(first: f64, range: (f64, f64)) -> Self {
        Self { range, rising: None, furthest: (first, 0.0), reversal: (first, 0.0), is_first: true }
    }

    /// The place of the next drive.
    pub fn step(&mut self, drive: f64) -> Place {
        if !std::mem::take(&mut self.is_first) {
            self.furthest.1 += 1.0;
            self.reversal.1 += 1.0;
        }
        let swing = SWING * (self.range.1 - self.range.0);
        let ahead = drive - self.furthest.0;
        let goes_on = match self.rising {
            Some(true) => ahead >= 0.0,
            Some(false) => ahead <= 0.0,
            None => false,
        };
        if goes_on {
            self.furthest = (drive, 0.0);
        } else if ahead.abs() > swing {
            self.rising = Some(ahead > 0.0);
            self.reversal = self.furthest;
            self.furthest = (drive, 0.0);
        }
        Place { drive, reversal: self.reversal.0, samples: self.reversal.1, range: self.range }
    }
}

/// What may be said of the position before a drive is put out: the reference that the stage was to follow is missed by
/// no less than `low` and no more than `high`, position minus reference, and anywhere by at most `within`.
#[derive(Clone, Debug, PartialEq)]
pub struct ErrorBounds {
    /// The lower bound for every drive, the lead-in included: each for itself with the probability asked for.
    pub low: Vec<f64>,
    /// The upper bound for every drive.
    pub high: Vec<f64>,
    /// With the probability asked for, no position of the reference is missed by more than this: one number for the
    /// whole.
    pub within: f64,
}

impl Stage {
    /// What identification knows of the errors of this stage.
    ///
    /// # Errors
    /// [`Error::NoBand`] for a stage that was not identified, or by a release that knew no bands.
    pub fn error_band(&self) -> Result<&ErrorBand, Error> {
        self.parts().error_band.as_ref().ok_or(Error::NoBand)
    }

    /// By how much drives that [`precompensate`](Self::precompensate) made of the same reference and options will miss
    /// it: bounds that hold with probability `level`. They are of the position itself, without the noise of a sensor.
    /// What limits and slew rate held back is in them.
    ///
    /// # Errors
    /// [`Error::NoBand`]; otherwise as [`precompensate`](Self::precompensate), and for a level that is not between 0
    /// and 1.
    pub fn error_bounds(
        &self,
        found: &Precompensated,
        reference: &[f64],
        dt: f64,
        options: &PrecompensateOptions<'_>,
        level: f64,
    ) -> Result<ErrorBounds, Error> {
        let (band, z) = (self.error_band()?, normal_quantile(check_level(level)?));
        let wanted = self.wanted(reference, dt, options)?;
        if found.drive.len() != wanted.path.len() {
            let expected = "the reference that these drives were made of";
            return Err(CoreError::whole("reference", None, expected, reference.len()).into());
        }
        let mut before = vec![wanted.start];
        before.extend_from_slice(options.history);
        let deviations = band.deviations(&found.drive, &before, dt)?;
        let missed = self.missed(found, &wanted.path, &before, dt)?;
        let bound = |sign: f64| missed.iter().zip(&deviations).map(|(e, s)| e + sign * z * s).collect::<Vec<_>>();
        let branches = branches(found, &before, band, &missed, &deviations);
        Ok(ErrorBounds { low: bound(-1.0), high: bound(1.0), within: within(&branches, level) })
    }

    /// What the model itself misses, for every drive; nothing for a dead time below 0, which has no forward model.
    fn missed(&self, found: &Precompensated, path: &[f64], before: &[f64], dt: f64) -> Result<Vec<f64>, Error> {
        if self.parts().dead_time < 0.0 {
            return Ok(vec![0.0; path.len()]);
        }
        let mut forward = self.forward(dt)?;
        forward.settle(before[0]);
        for drive in &before[1..] {
            forward.step(*drive);
        }
        Ok(found.drive.iter().zip(path).map(|(drive, wanted)| forward.step(*drive) - wanted).collect())
    }
}

/// Of every branch of the reference the largest miss of the model and the largest deviation.
fn branches(
    found: &Precompensated,
    before: &[f64],
    band: &ErrorBand,
    missed: &[f64],
    deviations: &[f64],
) -> Vec<(f64, f64)> {
    let mut walk = Branches::new(before[0], band.0.drive_range);
    for drive in before {
        walk.step(*drive);
    }
    let mut branches: Vec<(f64, f64)> = Vec::new();
    let mut last = None;
    for (k, drive) in found.drive.iter().enumerate() {
        let reversal = walk.step(*drive).reversal;
        if k < found.lead_in_samples {
            continue;
        }
        if last != Some(reversal) {
            branches.push((0.0, 0.0));
        }
        last = Some(reversal);
        if let Some((miss, deviation)) = branches.last_mut() {
            (*miss, *deviation) = (miss.max(missed[k].abs()), deviation.max(deviations[k]));
        }
    }
    branches
}

/// What no branch exceeds with probability `level`, if their errors are independent.
fn within(branches: &[(f64, f64)], level: f64) -> f64 {
    let holds = |x: f64| {
        let share = |(miss, deviation): &(f64, f64)| match x - miss {
            room if room < 0.0 => 0.0,
            room if *deviation > 0.0 => normal_share(room / deviation),
            _ => 1.0,
        };
        branches.iter().map(|branch| share(branch).powi(ERRORS_PER_BRANCH)).product::<f64>() >= level
    };
    let largest = branches.iter().fold(0.0, |most: f64, (miss, deviation)| most.max(miss + 40.0 * deviation));
    least(largest, holds)
}

/// The least number from 0 to `most` from which on something holds, by halving; `most` if it never does.
fn least(most: f64, holds: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = (0.0, most);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if holds(middle) {
            high = middle;
        } else {
            low = middle;
        }
    }
    high
}

/// The probability of a bound, if it is one.
fn check_level(level: f64) -> Result<f64, Error> {
    if 0.0 < level && level < 1.0 {
        Ok(level)
    } else {
        Err(CoreError::domain("interval", None, "a probability between 0 and 1, such as 0.95", level).into())
    }
}

/// P(|Z| <= z) for a normal Z, to 2e-7: the fit of Chebyshev to the complementary error function of Numerical Recipes
/// (1992), 6.2.
fn normal_share(z: f64) -> f64 {
    const COEFFICIENTS: [f64; 10] = [
        0.170_872_77,
        -0.822_152_23,
        1.488_515_87,
        -1.135_203_98,
        0.278_868_07,
        -0.186_288_06,
        0.096_784_18,
        0.374_091_96,
        1.000_023_68,
        -1.265_512_23,
    ];
    let x = FRAC_1_SQRT_2 * z.abs();
    let t = 1.0 / (1.0 + 0.5 * x);
    1.0 - t * (COEFFICIENTS.iter().fold(0.0, |sum, c| sum * t + c) - x * x).exp()
}

/// The z with P(|Z| <= z) = level.
fn normal_quantile(level: f64) -> f64 {
    least(6.0 * SQRT_2, |z| normal_share(z) >= level)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn band(error: f64) -> ErrorBand {
        let table = vec![vec![error; CELLS]; CELLS];
        ErrorBand::new(0.0, (0.0, 12.0), 2.0, table, vec![(1.0, 1.0), (4.0, 2.0)], vec![(5.0, 1.0)]).unwrap()
    }

    #[test]
    fn quantiles_are_those_of_a_normal_variable() {
        for (level, z) in [(0.5, 0.674_490), (0.682_689, 1.0), (0.95, 1.959_964), (0.99, 2.575_829)] {
            assert!((normal_quantile(level) - z).abs() < 1e-5, "{level}: {}", normal_quantile(level));
        }
    }

    #[test]
    fn a_branch_begins_where_the_drive_turned_round() {
        let mut walk = Branches::new(0.0, (0.0, 10.0));
        let places: Vec<_> = [0.0, 4.0, 8.0, 7.9, 8.5, 5.0, 3.0].iter().map(|u| walk.step(*u)).collect();
        let reversals: Vec<_> = places.iter().map(|place| (place.reversal, place.samples)).collect();
        // 7.9 is a tremble of a converter.
        assert_eq!(reversals[4], (0.0, 4.0));
        assert_eq!(reversals[6], (8.5, 2.0));
        assert_eq!((places[6].row(), places[6].column()), (10, 3));
    }

    #[test]
    fn what_is_faster_later_or_farther_than_the_records_is_less_sure() {
        let at = |drive: &[f64], dt| *band(1.0).deviations(drive, &[], dt).unwrap().last().unwrap();
        assert!((at(&[0.0, 1.0], 1.0) - 1.0).abs() < 1e-12);
        assert!((at(&[0.0, 9.0], 1.0) - 2.0_f64.sqrt()).abs() < 1e-12);
        assert!((at(&[0.0, 8.0], 1.0 / 3.0) - 2.0_f64.sqrt() * 2.0).abs() < 1e-12);
        assert!((at(&[0.0, 1.0, 1.0], 10.0) - 2.0).abs() < 1e-12);
        let beyond = at(&[0.0, 18.0], 6.0);
        assert!((beyond * beyond - (1.0 * 6.0 / 5.0 + 1.0)).abs() < 1e-12);
    }

    #[test]
    fn one_number_for_all_branches_is_wider_than_the_bounds_of_one() {
        assert!((within(&[(0.0, 1.0)], 0.95_f64.powi(ERRORS_PER_BRANCH)) - normal_quantile(0.95)).abs() < 1e-5);
        assert!(within(&[(0.0, 1.0); 20], 0.95) > 3.8);
        // What limits hold back comes on top.
        assert!(within(&[(5.0, 1.0)], 0.95) > 6.0 && within(&[(5.0, 0.0)], 0.95) >= 5.0);
    }

    #[test]
    fn numbers_that_no_band_can_have_are_named() {
        let made = |noise, rates: Vec<(f64, f64)>, rows| {
            let table = vec![vec![1.0; CELLS]; rows];
            let error = ErrorBand::new(noise, (0.0, 1.0), 1.0, table, rates, vec![(1.0, 1.0)]).unwrap_err();
            error.parameter().unwrap()
        };
        assert_eq!(made(-1.0, vec![(1.0, 1.0)], CELLS), "noise");
        assert_eq!(made(1.0, vec![(1.0, 0.5)], CELLS), "rates");
        assert_eq!(made(1.0, vec![(1.0, 1.0), (1.0, 1.0)], CELLS), "rates");
        assert_eq!(made(1.0, Vec::new(), CELLS), "rates");
        assert_eq!(made(1.0, vec![(1.0, 1.0)], 3), "errors");
        assert!(band(1.0).half_widths(&[1.0], &[], 1.0, 1.5).unwrap_err().to_string().contains("interval"));
    }
}
