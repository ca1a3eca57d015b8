//! The columns beside the operators: powers of the drive, the loop shift, and plays that relax. All are linear in
//! weights of their own, and stand behind the output map.

use crate::terms::loop_shift::{LoopShiftModel, Memory, ShiftFilter};
use crate::terms::relaxing_plays::{RelaxingColumns, RelaxingLane};

/// How many columns there are beside the operators.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Sides {
    /// Powers and loop shift, which come first.
    pub(crate) of_any_sign: usize,
    /// Plays that relax.
    pub(crate) non_negative: usize,
}

impl Sides {
    /// The number of all of them.
    pub(crate) fn len(self) -> usize {
        self.of_any_sign + self.non_negative
    }
}

/// Which columns there are beside the operators, with everything that is not linear in their weights: first the powers
/// of x(k) = (u(k) - center) / half_range, then those of the loop shift, then those of the plays that relax.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct SideColumns {
    pub(crate) center: f64,
    pub(crate) half_range: f64,
    /// How many powers of x there are, from x^2 on. Only a comparison of models has any.
    #[cfg_attr(feature = "serde", serde(default))]
    pub(crate) powers: usize,
    pub(crate) filters: Vec<ShiftFilter>,
    #[cfg_attr(feature = "serde", serde(default))]
    pub(crate) relaxing: Option<RelaxingColumns>,
}

impl SideColumns {
    /// The columns of a loop shift and of plays that relax, for records whose inputs lie between two bounds; none where
    /// there are neither.
    pub(crate) fn of(
        filters: Vec<ShiftFilter>,
        relaxing: Option<RelaxingColumns>,
        (low, high): (f64, f64),
    ) -> Option<Self> {
        let is_any = !filters.is_empty() || relaxing.is_some();
        let (center, half_range) = (0.5 * (low + high), 0.5 * (high - low));
        (is_any && low < high).then_some(Self { center, half_range, powers: 0, filters, relaxing })
    }

    /// How many columns there are.
    pub(crate) fn sides(&self) -> Sides {
        let shifts = self.filters.iter().map(ShiftFilter::columns).sum::<usize>();
        let non_negative = self.relaxing.as_ref().map_or(0, RelaxingColumns::len);
        Sides { of_any_sign: self.powers + shifts, non_negative }
    }

    /// The number of all of them.
    pub(crate) fn len(&self) -> usize {
        self.sides().len()
    }

    /// Which columns there are with a loop shift of this kind.
    pub(crate) fn used_by(&self, model: LoopShiftModel) -> Vec<bool> {
        let others = |count| std::iter::repeat_n(true, count);
        let shifts = self.filters.iter().flat_map(|filter| filter.used_by(model));
        others(self.powers).chain(shifts).chain(others(self.sides().non_negative)).collect()
    }

    /// The same with the largest |e| of these inputs, each with its sampling interval, as limits.
    pub(crate) fn limited_by<'a>(mut self, inputs: impl Iterator<Item = (&'a [f64], f64)>) -> Self {
        let mut largest = vec![0.0; self.filters.len()];
        for filter in &mut self.filters {
            filter.limit = f64::INFINITY;
        }
        for (input, dt) in inputs {
            let mut lane = SideLane::new(&self, dt);
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
pub(crate) struct SideLane<'a> {
    columns: &'a SideColumns,
    memories: Vec<Memory>,
    relaxing: Option<RelaxingLane>,
    /// The newest sample, once there is one.
    x: f64,
    is_at_rest: bool,
}

impl<'a> SideLane<'a> {
    pub(crate) fn new(columns: &'a SideColumns, dt: f64) -> Self {
        let memories = columns.filters.iter().map(|filter| Memory::new(filter, dt)).collect();
        let relaxing = columns.relaxing.as_ref().map(|relaxing| RelaxingLane::new(relaxing, dt));
        Self { columns, memories, relaxing, x: 0.0, is_at_rest: true }
    }

    /// Goes on to the next sample.
    pub(crate) fn next(&mut self, u: f64) {
        let x = (u - self.columns.center) / self.columns.half_range;
        for memory in &mut self.memories {
            if self.is_at_rest {
                memory.settle(x);
            } else {
                memory.hold(self.x);
            }
        }
        if let Some(relaxing) = &mut self.relaxing {
            relaxing.next(u);
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
        let relaxed = self.relaxing.iter().flat_map(RelaxingLane::columns);
        relaxed.zip(row).for_each(|(value, place)| *place = *value);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn columns() -> SideColumns {
        let filter = |time_constant, both| ShiftFilter { time_constant, limit: 1.0, both };
        SideColumns {
            center: 2.0,
            half_range: 4.0,
            powers: 0,
            filters: vec![filter(0.1, true), filter(0.4, false)],
            relaxing: None,
        }
    }

    fn last(columns: &SideColumns, input: impl Iterator<Item = f64>, dt: f64) -> Vec<f64> {
        let mut lane = SideLane::new(columns, dt);
        input.for_each(|u| lane.next(u));
        let mut row = vec![0.0; columns.len()];
        lane.write(row.iter_mut());
        row
    }

    #[test]
    fn powers_stand_first_and_have_no_memory() {
        let both = SideColumns { powers: 2, ..columns() };
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
