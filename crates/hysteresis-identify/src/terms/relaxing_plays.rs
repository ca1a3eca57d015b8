//! Plays that relax: loops whose width depends on the rate. Thresholds and time constants are known, the weights are
//! columns beside the operators.

use hysteresis_control::stage::RelaxingPlays;
use hysteresis_core::{Error as CoreError, Ratios, unless_faded};

use crate::error::Error;
use crate::records::signal::as_f64;
use crate::terms::operators::OperatorBank;

/// The thresholds, as shares of half the range of the drive. More of them fit no better: what relaxes is a small part
/// of the loop.
const THRESHOLDS: [f64; 5] = [0.0, 0.06, 0.15, 0.3, 0.6];

/// The time constants that are tried where none are given, in seconds: what is faster belongs to the dynamics.
const SPAN: (f64, f64) = (1e-3, 100.0);

/// The shortest of them in samples, and the longest as a share of the longest record.
const FASTEST_SAMPLES: f64 = 10.0;
const SLOWEST_SHARE: f64 = 1.0 / 3.0;

/// How many of them there are in a decade.
const PER_DECADE: f64 = 2.0;

/// How many time constants there may be.
const MOST: usize = 12;

/// Plays that relax, beside the hysteresis: r(k) = sum_j s_j(k), s_j(k+1) = a_j s_j(k) + (1 - a_j) sum_i v_ij z_i(k),
/// with z_i plays of the drive and a_j = exp(-dt / tau_j). See
/// [`RelaxingPlays`](hysteresis_control::stage::RelaxingPlays). The thresholds are five from 0 to 0.6 of half the range
/// of the drive; the weights v_ij >= 0 are fitted with those of the operators.
///
/// ```
/// use hysteresis_identify::{Options, RelaxingPlaysModel};
/// let options =
///     Options { dt: Some(1e-3), relaxing_plays: RelaxingPlaysModel::TimeConstants(vec![0.05]), ..Options::default() };
/// assert_ne!(options.relaxing_plays, RelaxingPlaysModel::default());
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum RelaxingPlaysModel {
    /// None.
    None,
    /// [`Fit`](Self::Fit) or none, as cross-validation over stretches of the records asks for; none without a sampling
    /// interval.
    #[default]
    Auto,
    /// Two time constants in a decade, from 1 ms to 100 s, but not below ten samples and not above a third of the
    /// longest record.
    Fit,
    /// These time constants, in seconds: at most 12.
    TimeConstants(Vec<f64>),
}

/// Which columns there are: of every time constant those of all thresholds.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct RelaxingColumns {
    /// r_i.
    thresholds: Vec<f64>,
    /// The drive at which all plays are virgin.
    origin: f64,
    /// tau_j, in seconds.
    time_constants: Vec<f64>,
}

impl RelaxingPlaysModel {
    /// Whether there are such plays in the model.
    pub(crate) fn has_terms(&self) -> bool {
        matches!(self, Self::Fit | Self::TimeConstants(_))
    }

    /// Whether records of this length and sampling interval tell them.
    pub(crate) fn is_told(&self, longest: f64, dt: f64) -> bool {
        self.columns((0.0, 1.0), 0.0, longest, dt).is_ok()
    }

    /// The columns for records whose inputs lie between `low` and `high`, of plays that are virgin at `origin`.
    ///
    /// `longest` is the length of the longest record and `dt` the smallest sampling interval, both in seconds.
    pub(crate) fn columns(
        &self,
        (low, high): (f64, f64),
        origin: f64,
        longest: f64,
        dt: f64,
    ) -> Result<Option<RelaxingColumns>, Error> {
        let time_constants = match self {
            Self::None | Self::Auto => return Ok(None),
            Self::Fit => usual(longest, dt)?,
            Self::TimeConstants(given) => checked(given)?,
        };
        let thresholds = THRESHOLDS.iter().map(|share| share * 0.5 * (high - low)).collect();
        Ok((low < high).then_some(RelaxingColumns { thresholds, origin, time_constants }))
    }
}

/// The time constants that records of this length and sampling interval tell.
fn usual(longest: f64, dt: f64) -> Result<Vec<f64>, Error> {
    let (start, end) = (SPAN.0.max(FASTEST_SAMPLES * dt), SPAN.1.min(SLOWEST_SHARE * longest));
    if start.is_nan() || end < start {
        let expected = "records of thirty samples or more, longer than 3 ms";
        return Err(Error::domain("relaxing_plays", None, expected, longest));
    }
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few decades")]
    let steps = (PER_DECADE * (end / start).log10()).ceil() as usize;
    let step = (end / start).powf(as_f64(steps.max(1)).recip());
    Ok((0..=steps).map(|j| start * step.powf(as_f64(j))).collect())
}

fn checked(given: &[f64]) -> Result<Vec<f64>, Error> {
    if given.len() > MOST {
        return Err(Error::whole("relaxing_plays", "at most 12 time constants", given.len()));
    }
    match RelaxingPlays::new(&[0.0], 0.0, given, &vec![vec![0.0]; given.len()]) {
        Ok(_) => Ok(given.to_vec()),
        Err(CoreError::Domain { index, got, .. }) => {
            let expected = "time constants in seconds, finite, above 0 and strictly increasing";
            Err(Error::domain("relaxing_plays", index, expected, got))
        }
        Err(_) => Err(Error::whole("relaxing_plays", "at least one time constant", given.len())),
    }
}

impl RelaxingColumns {
    /// How many columns there are.
    pub(crate) fn len(&self) -> usize {
        self.thresholds.len() * self.time_constants.len()
    }

    /// The plays of these weights, one for each column: without thresholds and time constants of which none weighs
    /// anything; none where there is nothing left.
    pub(crate) fn plays(&self, weights: &[f64]) -> Result<Option<RelaxingPlays>, Error> {
        let (rows, plays) = self.used(weights);
        if rows.is_empty() {
            return Ok(None);
        }
        let of_row = |j: &usize| plays.iter().map(|i| weights[j * self.thresholds.len() + i]).collect();
        let thresholds: Vec<f64> = plays.iter().map(|i| self.thresholds[*i]).collect();
        let time_constants: Vec<f64> = rows.iter().map(|j| self.time_constants[*j]).collect();
        let weights: Vec<Vec<f64>> = rows.iter().map(of_row).collect();
        Ok(Some(RelaxingPlays::new(&thresholds, self.origin, &time_constants, &weights)?))
    }

    /// What a column is called: its row and its place in the weights of [`plays`](Self::plays), which it must be in.
    pub(crate) fn name_of(&self, weights: &[f64], column: usize) -> String {
        let (rows, plays) = self.used(weights);
        let (j, i) = (column / self.thresholds.len(), column % self.thresholds.len());
        let before = |used: &[usize], number: usize| used.iter().filter(|one| **one < number).count();
        format!("relaxing_plays[{},{}]", before(&rows, j), before(&plays, i))
    }

    /// A value of every column in the order of the weights of [`plays`](Self::plays).
    pub(crate) fn in_use(&self, weights: &[f64], value: impl Fn(usize) -> f64) -> Vec<Vec<f64>> {
        let (rows, plays) = self.used(weights);
        rows.iter().map(|j| plays.iter().map(|i| value(j * self.thresholds.len() + i)).collect()).collect()
    }

    /// The time constants and the thresholds that weigh anything, by their places.
    fn used(&self, weights: &[f64]) -> (Vec<usize>, Vec<usize>) {
        let count = self.thresholds.len();
        let weighs = |j: usize, i: usize| weights[j * count + i] != 0.0;
        let rows = (0..self.time_constants.len()).filter(|j| (0..count).any(|i| weighs(*j, i)));
        let plays = (0..count).filter(|i| (0..self.time_constants.len()).any(|j| weighs(j, *i)));
        (rows.collect(), plays.collect())
    }
}

/// The columns along one record, sample by sample; at rest before its first.
pub(crate) struct RelaxingLane {
    origin: f64,
    bank: OperatorBank,
    decays: Vec<f64>,
    /// z_i of the newest sample, once there is one, and of the one before.
    plays: Vec<f64>,
    before: Vec<f64>,
    is_at_rest: bool,
    /// What of every z_i has relaxed, time constant by time constant.
    relaxed: Vec<f64>,
}

impl RelaxingLane {
    pub(crate) fn new(at: &RelaxingColumns, dt: f64) -> Self {
        let rest = vec![0.0; at.thresholds.len()];
        Self {
            origin: at.origin,
            bank: OperatorBank::from_ratios(&at.thresholds, Ratios::PLAY),
            decays: at.time_constants.iter().map(|tau| (-dt / tau).exp()).collect(),
            plays: rest.clone(),
            before: rest,
            is_at_rest: true,
            relaxed: vec![0.0; at.len()],
        }
    }

    /// Goes on to the next sample.
    pub(crate) fn next(&mut self, u: f64) {
        let is_first = std::mem::take(&mut self.is_at_rest);
        let count = self.plays.len();
        if !is_first {
            for (row, decay) in self.relaxed.chunks_exact_mut(count).zip(&self.decays) {
                for (relaxed, play) in row.iter_mut().zip(&self.plays) {
                    *relaxed = unless_faded(decay * *relaxed + (1.0 - decay) * play);
                }
            }
        }
        std::mem::swap(&mut self.before, &mut self.plays);
        self.bank.next(&self.before, u - self.origin, &mut self.plays);
        if is_first {
            self.relaxed.chunks_exact_mut(count).for_each(|row| row.copy_from_slice(&self.plays));
        }
    }

    /// The columns of the newest sample.
    pub(crate) fn columns(&self) -> &[f64] {
        &self.relaxed
    }
}

#[cfg(test)]
mod tests {
    use hysteresis_control::stage::{Stage, StageParts};
    use hysteresis_core::{ModifiedPrandtlIshlinskii, Offsets, Process};

    use super::*;

    #[test]
    fn the_columns_are_those_of_the_stage() {
        let dt = 1e-3;
        let model = RelaxingPlaysModel::TimeConstants(vec![0.01, 0.2]);
        let columns = model.columns((-1.0, 3.0), 0.5, 10.0, dt).unwrap().unwrap();
        assert_eq!(columns.len(), 10);
        // One threshold weighs nothing.
        let weight = |k: usize| if k % 5 == 3 { 0.0 } else { 0.1 * as_f64(k + 1) };
        let weights: Vec<f64> = (0..10).map(weight).collect();
        let plays = columns.plays(&weights).unwrap().unwrap();
        assert_eq!((plays.thresholds().len(), plays.time_constants()), (4, &[0.01, 0.2][..]));
        assert_eq!(columns.in_use(&weights, |k| weights[k]), plays.weights());
        let identity =
            ModifiedPrandtlIshlinskii::from_ratios(&[1.0], &[0.0], Ratios::PLAY, Offsets::default()).unwrap();
        let stage = Stage::new(StageParts { relaxing_plays: Some(plays), ..StageParts::new(identity) }).unwrap();
        let mut forward = stage.forward(dt).unwrap();
        let mut lane = RelaxingLane::new(&columns, dt);
        let input: Vec<f64> = (0..600_u32).map(|k| 1.0 + 2.0 * (0.05 * f64::from(k)).sin()).collect();
        forward.settle(input[0]);
        for u in input {
            lane.next(u);
            let got: f64 = lane.columns().iter().zip(&weights).map(|(column, weight)| column * weight).sum();
            let want = forward.step(u) - u;
            assert!((got - want).abs() < 1e-13, "{got} {want}");
        }
    }

    #[test]
    fn what_weighs_nothing_is_left_out() {
        let columns = RelaxingPlaysModel::Fit.columns((0.0, 1.0), 0.0, 3.0, 1e-4).unwrap().unwrap();
        assert!(columns.plays(&vec![0.0; columns.len()]).unwrap().is_none());
    }

    #[test]
    fn time_constants_are_those_that_the_records_tell() {
        let ends = |longest, dt| {
            let usual = usual(longest, dt).unwrap();
            (usual[0], usual[usual.len() - 1], usual.len())
        };
        let is_near = |(a, b, count): (f64, f64, usize), (c, d, want): (f64, f64, usize)| {
            assert!((a / c - 1.0).abs() < 1e-9 && (b / d - 1.0).abs() < 1e-9 && count == want, "{a} {b} {count}");
        };
        is_near(ends(1e4, 1e-5), (1e-3, 100.0, 11));
        is_near(ends(9.0, 1e-3), (1e-2, 3.0, 6));
        is_near(ends(0.036, 1e-3), (1e-2, 1.2e-2, 2));
        let error = usual(0.02, 1e-3).unwrap_err().to_string();
        assert!(error.starts_with("relaxing_plays: expected records of thirty samples"), "{error}");
    }

    #[test]
    fn what_is_given_is_checked() {
        let error = |given: &[f64]| {
            let model = RelaxingPlaysModel::TimeConstants(given.to_vec());
            model.columns((0.0, 1.0), 0.0, 1.0, 1e-3).unwrap_err().to_string()
        };
        assert!(error(&[0.1, 0.1]).starts_with("relaxing_plays[1]: expected time constants in seconds"));
        assert!(error(&[-1.0]).starts_with("relaxing_plays[0]: expected time constants in seconds"));
        assert!(error(&[]).starts_with("relaxing_plays: expected at least one time constant"));
        assert!(error(&[0.1; 13]).starts_with("relaxing_plays: expected at most 12 time constants"));
    }
}
