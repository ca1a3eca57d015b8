//! The loop shift: how far the centre of a loop moves with what the drive did before; a time constant, and one
//! amplitude or two.
//!
//! It stands beside the operators as columns, and so do powers of the drive.

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

    /// The columns for records whose inputs lie between `low` and `high`; for [`Auto`](Self::Auto) those of all
    /// candidates.
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

/// Which columns there are beside the operators, with everything that is not linear in their amplitudes: first the
/// powers of x, then those of the loop shift.
///
/// With x(k) = (u(k) - center) / half_range, e(k) the difference of x(k) and a follower of time constant tau / 4,
/// bounded by `limit`, the columns are one-pole means of time constant tau: m of e^2 and n of x |e|. Both know the
/// drives before the sample only.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct ShiftColumns {
    pub(crate) center: f64,
    pub(crate) half_range: f64,
    /// How many powers of x there are, from x^2 on. Only a comparison of models has any.
    #[cfg_attr(feature = "serde", serde(default))]
    pub(crate) powers: usize,
    pub(crate) filters: Vec<ShiftFilter>,
}

/// The columns of one time constant.
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
}

impl ShiftColumns {
    /// How many columns there are.
    pub(crate) fn len(&self) -> usize {
        self.powers + self.filters.iter().map(ShiftFilter::columns).sum::<usize>()
    }

    /// Which columns a model has.
    pub(crate) fn used_by(&self, model: LoopShiftModel) -> Vec<bool> {
        let of_filter = |filter: &ShiftFilter| {
            let (square, product) = match model {
                LoopShiftModel::None => (false, false),
                LoopShiftModel::Auto => (true, true),
                LoopShiftModel::Square(tau) => (filter.time_constant == tau, false),
                LoopShiftModel::Both(tau) => (filter.time_constant == tau, filter.time_constant == tau),
            };
            [Some(square), filter.both.then_some(product)].into_iter().flatten()
        };
        let powers = std::iter::repeat_n(true, self.powers);
        powers.chain(self.filters.iter().flat_map(of_filter)).collect()
    }

    /// The same with the largest |e| of these inputs, each with its sampling interval, as limits.
    pub(crate) fn limited_by<'a>(mut self, inputs: impl Iterator<Item = (&'a [f64], f64)>) -> Self {
        let mut largest = vec![0.0; self.filters.len()];
        for filter in &mut self.filters {
            filter.limit = f64::INFINITY;
        }
        for (input, dt) in inputs {
            let mut lane = ShiftLane::new(&self, dt);
            for u in input {
                lane.next(*u);
                for (largest, memory) in largest.iter_mut().zip(&lane.memories) {
                    *largest = f64::max(*largest, memory.distance(lane.x).abs());
                }
            }
        }
        for (filter, largest) in self.filters.iter_mut().zip(largest) {
            filter.limit = largest;
        }
        self
    }
}

/// The columns of one record, sample by sample; at rest before its first.
pub(crate) struct ShiftLane<'a> {
    columns: &'a ShiftColumns,
    memories: Vec<Memory>,
    /// The newest sample, once there is one.
    x: f64,
    is_at_rest: bool,
}

/// What the filters of one time constant remember.
struct Memory {
    /// exp(-dt / tau), exp(-4 dt / tau), and what e^2 and x |e| make of m and n.
    decay: f64,
    fast: f64,
    square: f64,
    product: f64,
    limit: f64,
    follower: f64,
    m: f64,
    n: f64,
}

impl<'a> ShiftLane<'a> {
    pub(crate) fn new(columns: &'a ShiftColumns, dt: f64) -> Self {
        let memory = |filter: &ShiftFilter| {
            let decay = (-dt / filter.time_constant).exp();
            let fast = decay.powi(4);
            let (square, product) = ((decay - fast * fast) / 7.0, (decay - fast) / 3.0);
            Memory { decay, fast, square, product, limit: filter.limit, follower: 0.0, m: 0.0, n: 0.0 }
        };
        Self { columns, memories: columns.filters.iter().map(memory).collect(), x: 0.0, is_at_rest: true }
    }

    /// Goes on to the next sample.
    pub(crate) fn next(&mut self, u: f64) {
        let x = (u - self.columns.center) / self.columns.half_range;
        for memory in &mut self.memories {
            if self.is_at_rest {
                memory.follower = x;
            } else {
                memory.hold(self.x);
            }
        }
        (self.x, self.is_at_rest) = (x, false);
    }

    /// The columns of the newest sample.
    #[inline]
    pub(crate) fn write<'r>(&self, mut row: impl Iterator<Item = &'r mut f64>) {
        let mut power = self.x;
        for place in row.by_ref().take(self.columns.powers) {
            power *= self.x;
            *place = power;
        }
        for (memory, filter) in self.memories.iter().zip(&self.columns.filters) {
            let both = [Some(memory.m), filter.both.then_some(memory.n)];
            both.into_iter().flatten().zip(&mut row).for_each(|(value, place)| *place = value);
        }
    }
}

impl Memory {
    /// e for a drive x.
    fn distance(&self, x: f64) -> f64 {
        (x - self.follower).clamp(-self.limit, self.limit)
    }

    /// x is held for one interval, in which e decays as exp(-4 t / tau).
    fn hold(&mut self, x: f64) {
        let (a, e) = (self.decay, self.distance(x));
        self.m = a * self.m + self.square * e * e;
        self.n = a * self.n + self.product * x * e.abs();
        // At the limit the drive pulls the follower along.
        self.follower = x - self.fast * e;
    }
}

#[cfg(test)]
mod tests_of_loop_shift_model {
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

#[cfg(test)]
mod tests_of_shift {
    use super::*;

    fn columns() -> ShiftColumns {
        let filter = |time_constant, both| ShiftFilter { time_constant, limit: 1.0, both };
        ShiftColumns { center: 2.0, half_range: 4.0, powers: 0, filters: vec![filter(0.1, true), filter(0.4, false)] }
    }

    fn last(columns: &ShiftColumns, input: impl Iterator<Item = f64>, dt: f64) -> Vec<f64> {
        let mut lane = ShiftLane::new(columns, dt);
        input.for_each(|u| lane.next(u));
        let mut row = vec![0.0; columns.len()];
        lane.write(row.iter_mut());
        row
    }

    #[test]
    fn powers_stand_first_and_have_no_memory() {
        let both = ShiftColumns { powers: 2, ..columns() };
        let input = || (0..50_u32).map(|k| f64::from(k * k % 7));
        let (row, alone) = (last(&both, input(), 0.01), last(&columns(), input(), 0.01));
        assert_eq!((both.len(), columns().len()), (5, 3));
        assert_eq!(both.used_by(LoopShiftModel::None), [true, true, false, false, false]);
        let x = (f64::from(49_u32 * 49 % 7) - 2.0) / 4.0;
        assert_eq!(row[..2], [x * x, x * x * x]);
        assert_eq!(row[2..], alone);
    }

    /// On a long ramp of x the follower is tau / 4 times the speed behind, and so are the means.
    #[test]
    fn a_ramp_has_the_square_of_its_speed() {
        let (dt, speed) = (1e-4, 0.25);
        let ramp = |u0: f64| (0..30_000_u32).map(move |k| u0 + 4.0 * speed * dt * f64::from(k));
        let row = last(&columns(), ramp(-1.0), dt);
        for (m, tau) in [(row[0], 0.1), (row[2], 0.4)] {
            let e: f64 = 0.25 * tau * speed;
            assert!((m / (e * e) - 1.0).abs() < 0.01, "{tau}: {m}");
        }
        // x |e|, x as it was a time constant before
        let x = -0.75 + speed * (3.0 - 0.1);
        assert!((row[1] / (x * 0.025 * speed) - 1.0).abs() < 0.01, "{}", row[1]);
    }

    #[test]
    fn a_hold_may_be_split() {
        let coarse = last(&columns(), (0..40_u32).map(|k| f64::from(k * k % 7)), 0.02);
        let fine = last(&columns(), (0..160_u32).map(|k| f64::from((k / 4) * (k / 4) % 7)), 0.005);
        // The last sample of the coarse one is put out and not held yet: 3 of the fine ones are.
        let fine_there = last(&columns(), (0..157_u32).map(|k| f64::from((k / 4) * (k / 4) % 7)), 0.005);
        assert_ne!(fine, fine_there);
        for (a, b) in coarse.iter().zip(&fine_there) {
            assert!((a - b).abs() < 1e-13, "{a} {b}");
        }
    }

    #[test]
    fn the_limit_is_the_largest_distance_of_the_records() {
        let input: Vec<f64> = (0..2000_u32).map(|k| 2.0 + 4.0 * (0.01 * f64::from(k)).sin()).collect();
        let limited = columns().limited_by(std::iter::once((&input[..], 0.001)));
        let limits: Vec<f64> = limited.filters.iter().map(|filter| filter.limit).collect();
        // Amplitude 1 at 10 rad/s behind a follower of 0.025 and 0.1 s: w theta / sqrt(1 + (w theta)^2).
        assert!((limits[0] - 0.2425).abs() < 0.02 && (limits[1].powi(2) - 0.5).abs() < 0.05, "{limits:?}");
        let inside: Vec<f64> = last(&limited, input.iter().copied(), 0.001);
        assert_eq!(inside, last(&columns(), input.iter().copied(), 0.001));
    }
}
