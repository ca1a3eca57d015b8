//! Which loop shift to fit: a time constant, and one amplitude or two.

use crate::error::Error;
use crate::fit::shift::{ShiftColumns, ShiftFilter};

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
    /// The candidate nearest to the usual one that records of this length and sampling interval tell; none if they tell none.
    pub(crate) fn usual(longest: f64, dt: f64) -> Self {
        let distance = |tau: &f64| (tau / USUAL).ln().abs();
        let told = CANDIDATES.into_iter().filter(|tau| is_told(*tau, longest, dt));
        told.min_by(|a, b| distance(a).total_cmp(&distance(b))).map_or(Self::None, Self::Both)
    }

    /// The columns for records whose inputs lie between `low` and `high`; for [`Auto`](Self::Auto) those of all candidates.
    ///
    /// `longest` is the length of the longest record and `dt` the smallest sampling interval, both in seconds.
    pub(crate) fn columns(self, (low, high): (f64, f64), longest: f64, dt: f64) -> Result<Option<ShiftColumns>, Error> {
        let filter = |time_constant, both| ShiftFilter { time_constant, limit: f64::INFINITY, both };
        let filters = match self {
            Self::None => Vec::new(),
            Self::Auto => {
                let told = CANDIDATES.into_iter().filter(|tau| is_told(*tau, longest, dt));
                told.map(|tau| filter(tau, true)).collect()
            }
            Self::Square(tau) => vec![filter(checked(tau)?, false)],
            Self::Both(tau) => vec![filter(checked(tau)?, true)],
        };
        if filters.is_empty() || low >= high {
            return Ok(None);
        }
        Ok(Some(ShiftColumns { center: 0.5 * (low + high), half_range: 0.5 * (high - low), powers: 0, filters }))
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn candidates_are_those_that_the_records_tell() {
        let taus = |longest, dt| {
            let columns = LoopShiftModel::Auto.columns((0.0, 10.0), longest, dt).unwrap();
            columns.map_or(Vec::new(), |columns| columns.filters.iter().map(|filter| filter.time_constant).collect())
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
        let given = |model: LoopShiftModel| model.columns((-1.0, 3.0), 1.0, 1e-3);
        let columns = given(LoopShiftModel::Both(0.5)).unwrap().unwrap();
        assert_eq!((columns.center, columns.half_range, columns.len()), (1.0, 2.0, 2));
        assert!(given(LoopShiftModel::None).unwrap().is_none());
        let error = given(LoopShiftModel::Square(0.0)).unwrap_err().to_string();
        assert!(error.starts_with("loop_shift: expected a time constant"), "{error}");
    }
}
