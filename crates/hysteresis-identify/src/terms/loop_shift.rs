//! The loop shift: how far the centre of a loop moves with what the drive did before; a time constant, and one
//! amplitude or two.
//!
//! It stands beside the operators as columns: see `side_columns`.

use hysteresis_core::unless_faded;

use crate::error::Error;

/// The time constants that cross-validation chooses from, in seconds.
const CANDIDATES: [f64; 5] = [0.02, 0.05, 0.1, 0.3, 1.0];

/// The one of them that stands for all while the rest of the model is searched.
const USUAL: f64 = 0.1;

/// The shortest time constant, in samples: its follower, four times as fast, needs one.
const SHORTEST_SAMPLES: f64 = 4.0;

/// The longest time constant as a share of the longest record.
const LONGEST_SHARE: f64 = 0.1;

/// The loop shift: how far the centre of a loop moves with its amplitude, which no model of the Preisach class has. See
/// [`LoopShift`](hysteresis_control::stage::LoopShift) for the equation.
///
/// ```
/// use hysteresis_identify::{LoopShiftModel, Options};
/// let options = Options { dt: Some(1e-3), loop_shift: LoopShiftModel::Square(0.1), ..Options::default() };
/// assert_ne!(options.loop_shift, LoopShiftModel::default());
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum LoopShiftModel {
    /// None.
    None,
    /// One of the others, as cross-validation over stretches of the records asks for; none without a sampling interval.
    #[default]
    Auto,
    /// s = `c_1` m, of this time constant in seconds.
    Square(f64),
    /// s = `c_1` m + `c_2` n, of this time constant in seconds.
    Both(f64),
}

impl LoopShiftModel {
    /// The candidate nearest to the usual one that records of this length and sampling interval tell; none if they tell
    /// none.
    pub(crate) fn usual(longest: f64, dt: f64) -> Self {
        let distance = |tau: &f64| (tau / USUAL).ln().abs();
        let told = CANDIDATES.into_iter().filter(|tau| is_told(*tau, longest, dt));
        told.min_by(|a, b| distance(a).total_cmp(&distance(b))).map_or(Self::None, Self::Both)
    }

    /// The filters of the columns; for [`Auto`](Self::Auto) those of all candidates.
    ///
    /// `longest` is the length of the longest record and `dt` the smallest sampling interval, both in seconds.
    pub(crate) fn filters(self, longest: f64, dt: f64) -> Result<Vec<ShiftFilter>, Error> {
        let filter = |time_constant, both| ShiftFilter { time_constant, limit: f64::INFINITY, both };
        Ok(match self {
            Self::None => Vec::new(),
            Self::Auto => {
                let told = CANDIDATES.into_iter().filter(|tau| is_told(*tau, longest, dt));
                told.map(|tau| filter(tau, true)).collect()
            }
            Self::Square(tau) => vec![filter(checked(tau)?, false)],
            Self::Both(tau) => vec![filter(checked(tau)?, true)],
        })
    }
}

fn is_told(time_constant: f64, longest: f64, dt: f64) -> bool {
    time_constant >= SHORTEST_SAMPLES * dt && time_constant <= LONGEST_SHARE * longest
}

fn checked(time_constant: f64) -> Result<f64, Error> {
    if time_constant.is_finite() && time_constant > 0.0 {
        return Ok(time_constant);
    }
    Err(Error::domain("loop_shift", None, "a time constant in seconds above 0", time_constant))
}

/// The columns of one time constant, with everything that is not linear in their amplitudes.
///
/// With x(k) = (u(k) - center) / half_range, e(k) the difference of x(k) and a follower of time constant tau / 4,
/// bounded by `limit`, the columns are one-pole means of time constant tau: m of e^2 and n of x |e|. Both know the
/// drives before the sample only.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct ShiftFilter {
    /// tau, in seconds.
    pub(crate) time_constant: f64,
    /// The largest |e|.
    pub(crate) limit: f64,
    /// Whether there is a column n beside m.
    pub(crate) both: bool,
}

impl ShiftFilter {
    pub(crate) fn columns(&self) -> usize {
        1 + usize::from(self.both)
    }

    /// Which of its columns a model has.
    pub(crate) fn used_by(&self, model: LoopShiftModel) -> impl Iterator<Item = bool> {
        let (square, product) = match model {
            LoopShiftModel::None => (false, false),
            LoopShiftModel::Auto => (true, true),
            LoopShiftModel::Square(tau) => (self.time_constant == tau, false),
            LoopShiftModel::Both(tau) => (self.time_constant == tau, self.time_constant == tau),
        };
        [Some(square), self.both.then_some(product)].into_iter().flatten()
    }
}

/// What the filters of one time constant remember.
pub(crate) struct Memory {
    /// exp(-dt / tau), exp(-4 dt / tau), and what e^2 and x |e| make of m and n.
    decay: f64,
    fast: f64,
    square: f64,
    product: f64,
    limit: f64,
    follower: f64,
    pub(crate) m: f64,
    pub(crate) n: f64,
}

impl Memory {
    pub(crate) fn new(filter: &ShiftFilter, dt: f64) -> Self {
        let decay = (-dt / filter.time_constant).exp();
        let fast = decay.powi(4);
        let (square, product) = ((decay - fast * fast) / 7.0, (decay - fast) / 3.0);
        Self { decay, fast, square, product, limit: filter.limit, follower: 0.0, m: 0.0, n: 0.0 }
    }

    /// x has been held since forever.
    pub(crate) fn settle(&mut self, x: f64) {
        self.follower = x;
    }

    /// e for a drive x.
    pub(crate) fn distance(&self, x: f64) -> f64 {
        (x - self.follower).clamp(-self.limit, self.limit)
    }

    /// x is held for one interval, in which e decays as exp(-4 t / tau).
    pub(crate) fn hold(&mut self, x: f64) {
        let (a, e) = (self.decay, self.distance(x));
        self.m = unless_faded(a * self.m + self.square * e * e);
        self.n = unless_faded(a * self.n + self.product * x * e.abs());
        // At the limit the drive pulls the follower along.
        self.follower = x - self.fast * e;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn candidates_are_those_that_the_records_tell() {
        let taus = |longest, dt| {
            let filters = LoopShiftModel::Auto.filters(longest, dt).unwrap();
            filters.iter().map(|filter| filter.time_constant).collect::<Vec<_>>()
        };
        assert_eq!(taus(40.0, 0.005), [0.02, 0.05, 0.1, 0.3, 1.0]);
        assert_eq!(taus(2.0, 0.02), [0.1]);
        assert!(taus(0.1, 1e-4).is_empty());
        let usual = |longest, dt| LoopShiftModel::usual(longest, dt);
        assert_eq!(usual(40.0, 0.005), LoopShiftModel::Both(0.1));
        assert_eq!(usual(0.5, 0.001), LoopShiftModel::Both(0.05));
        assert_eq!(usual(0.1, 1e-4), LoopShiftModel::None);
    }

    #[test]
    fn what_is_given_is_checked() {
        let given = |model: LoopShiftModel| model.filters(1.0, 1e-3);
        let columns: usize = given(LoopShiftModel::Both(0.5)).unwrap().iter().map(ShiftFilter::columns).sum();
        assert_eq!(columns, 2);
        assert!(given(LoopShiftModel::None).unwrap().is_empty());
        let error = given(LoopShiftModel::Square(0.0)).unwrap_err().to_string();
        assert!(error.starts_with("loop_shift: expected a time constant"), "{error}");
    }
}
