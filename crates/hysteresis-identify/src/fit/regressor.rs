//! The regressor: one row of operator outputs per sample, made on the fly.

use hysteresis_core::{CoupledPlay, Model, Offsets, Ratios};

use super::shift::{ShiftColumns, ShiftLane};

/// The thresholds of all operators, one array per kind, so that the compiler works on several operators at a time.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct OperatorBank {
    r: Vec<f64>,
    ra: Vec<f64>,
    rb: Vec<f64>,
    rc: Vec<f64>,
}

impl OperatorBank {
    /// The operators of thresholds `r` in these proportions: the same products as in the core.
    pub(crate) fn from_ratios(r: &[f64], ratios: Ratios) -> Self {
        let scaled = |ratio: f64| r.iter().map(|r| ratio * r).collect();
        Self { r: r.to_vec(), ra: scaled(ratios.ra), rb: scaled(ratios.rb), rc: scaled(ratios.rc) }
    }

    pub(crate) fn from_operators(operators: impl Iterator<Item = CoupledPlay> + Clone) -> Self {
        Self {
            r: operators.clone().map(|z| z.r()).collect(),
            ra: operators.clone().map(|z| z.ra()).collect(),
            rb: operators.clone().map(|z| z.rb()).collect(),
            rc: operators.map(|z| z.rc()).collect(),
        }
    }

    /// The operators of a model, its weights as [`Regressor::output`] takes them, and its offsets.
    pub(crate) fn of_model(model: &Model) -> (Self, Vec<f64>, Offsets) {
        match model {
            Model::Conventional(model) => {
                let plays = model.operators().iter().map(|play| CoupledPlay::from(*play));
                (Self::from_operators(plays), model.weights().to_vec(), model.offsets())
            }
            Model::Modified(model) => {
                let below = if model.is_split() { model.weights_negative() } else { &[] };
                let operators = model.operators().iter().copied();
                (Self::from_operators(operators), [model.weights(), below].concat(), model.offsets())
            }
        }
    }

    pub(crate) fn len(&self) -> usize {
        self.r.len()
    }

    /// The threshold r of every operator.
    pub(crate) fn thresholds(&self) -> &[f64] {
        &self.r
    }

    /// z(k) = max(lo, min(hi, z(k-1))) for every operator: `CoupledPlay` of the core, as a loop over arrays.
    fn next(&self, last: &[f64], x: f64, z: &mut [f64]) {
        let n = z.len();
        let (r, ra, rb, rc, last) = (&self.r[..n], &self.ra[..n], &self.rb[..n], &self.rc[..n], &last[..n]);
        for i in 0..n {
            let lo = max(x - r[i], min(x - rc[i], 0.0));
            let hi = min(x + ra[i], max(x + rb[i], 0.0));
            z[i] = max(lo, min(hi, last[i]));
        }
    }
}

/// `f64::max` without its care for NaN, of which a record has none: one instruction, and it vectorises.
#[inline]
fn max(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// `f64::min` likewise.
#[inline]
fn min(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// The operators at a point, and the loop shift beside them.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct OperatorsAt {
    pub(crate) bank: OperatorBank,
    pub(crate) input_offset: f64,
    pub(crate) shift: Option<ShiftColumns>,
}

/// The rows of one record: row k holds z_i(k - delay), i = 0..n-1, of the operators at u - `input_offset`, and the columns
/// of the loop shift.
///
/// The operators start from z = 0 projected by the first sample. Between samples their outputs are interpolated,
/// not the input, so that the delay clips no reversal; samples before the record's start hold the first one.
pub(crate) struct Regressor<'a> {
    bank: &'a OperatorBank,
    input: &'a [f64],
    input_offset: f64,
    whole: usize,
    fraction: f64,
    /// The newest sample that the operators saw.
    seen: Option<usize>,
    /// How many of the turns they saw.
    turned: usize,
    /// z `whole` samples before the current one.
    now: Vec<f64>,
    /// z one sample earlier still.
    before: Vec<f64>,
    /// Where the terms of a weighed sum are put.
    terms: Vec<f64>,
    shift: Option<Shift<'a>>,
}

/// The columns beside the operators, now and one sample earlier.
struct Shift<'a> {
    lane: ShiftLane<'a>,
    now: Vec<f64>,
    before: Vec<f64>,
}

impl<'a> Regressor<'a> {
    /// The regressor before the record's first sample; `delay` in samples, not negative, `dt` in seconds.
    pub(crate) fn new(operators: &'a OperatorsAt, input: &'a [f64], delay: f64, dt: f64) -> Self {
        let OperatorsAt { bank, input_offset, shift } = operators;
        let shift = shift.as_ref().map(|columns| {
            let rest = vec![0.0; columns.len()];
            Shift { lane: ShiftLane::new(columns, dt), now: rest.clone(), before: rest }
        });
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a delay is not negative")]
        let whole = delay.floor() as usize;
        let rest = vec![0.0; bank.len()];
        let fraction = delay - delay.floor();
        let (now, before, terms) = (rest.clone(), rest.clone(), rest);
        let input_offset = *input_offset;
        Self { bank, input, input_offset, whole, fraction, seen: None, turned: 0, now, before, terms, shift }
    }

    /// Goes to a sample of the record, not before the last one. With `turns`, the samples at which the input turns
    /// round, the operators see only those on the way, and the two that the row is made of; a loop shift needs all.
    pub(crate) fn go_to(&mut self, sample: usize, turns: Option<&[usize]>) {
        let last = sample.saturating_sub(self.whole);
        let turns = turns.filter(|_| self.shift.is_none());
        if self.seen.is_none() {
            self.bank.next(&self.before, self.input[0] - self.input_offset, &mut self.now);
            self.before.copy_from_slice(&self.now);
            if let Some(shift) = &mut self.shift {
                shift.next(self.input[0]);
                shift.before.copy_from_slice(&shift.now);
            }
        }
        let mut seen = self.seen.unwrap_or(0);
        while seen < last {
            seen = match turns {
                None => seen + 1,
                Some(turns) => {
                    while turns.get(self.turned).is_some_and(|turn| *turn <= seen) {
                        self.turned += 1;
                    }
                    let row = (last - 1).max(seen + 1);
                    turns.get(self.turned).map_or(row, |turn| row.min(*turn))
                }
            };
            std::mem::swap(&mut self.before, &mut self.now);
            self.bank.next(&self.before, self.input[seen] - self.input_offset, &mut self.now);
            if let Some(shift) = &mut self.shift {
                shift.next(self.input[seen]);
            }
        }
        self.seen = Some(seen);
    }

    /// Writes the row of the current sample: one column for each operator, or, in a row twice as long, one for its
    /// output above zero and one for that below; then those of the loop shift.
    pub(crate) fn row(&self, row: &mut [f64]) {
        let n = self.now.len();
        let (row, shifts) = row.split_at_mut(row.len() - self.shift.as_ref().map_or(0, |shift| shift.now.len()));
        if let Some(shift) = &self.shift {
            for ((place, now), before) in shifts.iter_mut().zip(&shift.now).zip(&shift.before) {
                *place = self.between(*now, *before);
            }
        }
        if row.len() == n {
            for ((z, now), before) in row.iter_mut().zip(&self.now).zip(&self.before) {
                *z = self.between(*now, *before);
            }
            return;
        }
        let (above, below) = row.split_at_mut(n);
        for (i, (now, before)) in self.now.iter().zip(&self.before).enumerate() {
            above[i] = self.between(max(*now, 0.0), max(*before, 0.0));
            below[i] = self.between(min(*now, 0.0), min(*before, 0.0));
        }
    }

    /// The row of the current sample times the weights, of which there may be one or two for each operator, and those of the
    /// loop shift.
    pub(crate) fn output(&mut self, weights: &[f64]) -> f64 {
        let fraction = self.fraction;
        self.weigh(weights, |now, before| interpolated(now, before, fraction))
    }

    /// The derivative of [`output`](Self::output) by the delay.
    pub(crate) fn slope_over_delay(&mut self, weights: &[f64]) -> f64 {
        self.weigh(weights, |now, before| before - now)
    }

    /// The weighed sum of a value of every operator: first all terms, then their sum, so that the compiler works on
    /// several operators at a time.
    #[inline]
    fn weigh(&mut self, weights: &[f64], value: impl Fn(f64, f64) -> f64) -> f64 {
        let n = self.now.len();
        let (above, rest) = weights.split_at(n);
        let (below, shifts) = rest.split_at(rest.len() - self.shift.as_ref().map_or(0, |shift| shift.now.len()));
        let shifted = self.shift.as_ref().map_or(0.0, |shift| {
            let both = shift.now.iter().zip(&shift.before);
            shifts.iter().zip(both).map(|(amplitude, (now, before))| amplitude * value(*now, *before)).sum()
        });
        let (terms, now, before) = (&mut self.terms[..n], &self.now[..n], &self.before[..n]);
        if below.is_empty() {
            for i in 0..n {
                terms[i] = above[i] * value(now[i], before[i]);
            }
        } else {
            let below = &below[..n];
            for i in 0..n {
                terms[i] = above[i] * value(max(now[i], 0.0), max(before[i], 0.0))
                    + below[i] * value(min(now[i], 0.0), min(before[i], 0.0));
            }
        }
        shifted + sum(terms)
    }

    fn between(&self, now: f64, before: f64) -> f64 {
        interpolated(now, before, self.fraction)
    }
}

impl Shift<'_> {
    fn next(&mut self, u: f64) {
        std::mem::swap(&mut self.before, &mut self.now);
        self.lane.next(u);
        self.lane.write(&mut self.now);
    }
}

#[inline]
fn interpolated(now: f64, before: f64, fraction: f64) -> f64 {
    // Not (1 - fraction) now + fraction before: a whole delay must give the operator's own bits.
    now + fraction * (before - now)
}

/// The sum in four strands that do not wait for each other.
fn sum(terms: &[f64]) -> f64 {
    let (fours, rest) = terms.as_chunks::<4>();
    let mut sums = [0.0; 4];
    for four in fours {
        for (sum, term) in sums.iter_mut().zip(four) {
            *sum += term;
        }
    }
    sums[0] + sums[1] + (sums[2] + sums[3]) + rest.iter().sum::<f64>()
}

#[cfg(test)]
mod tests {
    use hysteresis_core::Operator;
    use proptest::prelude::*;

    use super::*;

    fn at(bank: OperatorBank, input_offset: f64) -> OperatorsAt {
        OperatorsAt { bank, input_offset, shift: None }
    }

    proptest! {
        /// Bit for bit the operators of the core, with the input offset and a whole delay.
        #[test]
        fn equals_the_core(
            input in prop::collection::vec(-10.0..10.0_f64, 2..60),
            r in prop::collection::vec(0.0..8.0_f64, 1..9),
            (ra, rb, rc) in (0.0..2.0_f64, 0.0..=1.0_f64, 0.0..=1.0_f64),
            input_offset in -5.0..5.0_f64,
            delay in 0_usize..5,
        ) {
            let ratios = Ratios { ra, rb: rb * ra, rc };
            let operators_at = at(OperatorBank::from_ratios(&r, ratios), input_offset);
            #[expect(clippy::cast_precision_loss, reason = "small")]
            let mut regressor = Regressor::new(&operators_at, &input, delay as f64, 1.0);
            let operators: Vec<_> = r.iter().map(|r| CoupledPlay::new(*r, ra * r, ratios.rb * r, rc * r).unwrap()).collect();
            let mut z = vec![0.0; r.len()];
            let mut row = z.clone();
            let mut taken = 0;
            for k in 0..input.len() {
                regressor.go_to(k, None);
                while taken <= k.saturating_sub(delay) {
                    for (z, operator) in z.iter_mut().zip(&operators) {
                        *z = operator.next(*z, input[taken] - input_offset);
                    }
                    taken += 1;
                }
                regressor.row(&mut row);
                prop_assert_eq!(&row, &z, "sample {}", k);
            }
        }
    }

    proptest! {
        /// Rows of a thinned course are those of all samples, bit for bit, if no reversal is left out.
        #[test]
        fn turns_are_enough(
            input in prop::collection::vec(prop_oneof![-10.0..10.0_f64, Just(1.0)], 2..80),
            delay in 0.0..5.0_f64,
            rows in prop::sample::subsequence((0..80).collect::<Vec<_>>(), 1..20),
        ) {
            let bank = at(OperatorBank::from_ratios(&[0.0, 1.0, 3.0], Ratios::PAPER), 0.5);
            let turns = crate::fit::course::turns(&input, 0.0);
            let (mut every, mut some) = (Regressor::new(&bank, &input, delay, 1.0), Regressor::new(&bank, &input, delay, 1.0));
            let (mut one, mut other) = ([0.0; 6], [0.0; 6]);
            for k in rows.into_iter().filter(|k| *k < input.len()) {
                every.go_to(k, None);
                some.go_to(k, Some(&turns));
                every.row(&mut one);
                some.row(&mut other);
                prop_assert_eq!(one, other, "sample {}", k);
                let (weights, whole) = ([1.0, 0.3, 0.2, 1.0, 0.3, 0.2], every.output(&[1.0, 0.3, 0.2]));
                prop_assert!((every.output(&weights) - whole).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn a_fractional_delay_lies_between_its_neighbours() {
        let bank = at(OperatorBank::from_ratios(&[0.0, 1.0], Ratios::PAPER), 0.0);
        let input = [0.0, 4.0, -4.0, 3.0];
        let outputs = |delay| {
            let mut regressor = Regressor::new(&bank, &input, delay, 1.0);
            let mut row = [0.0; 2];
            [0, 1, 2, 3].map(|k| {
                regressor.go_to(k, None);
                regressor.row(&mut row);
                row
            })
        };
        // The identity shows the interpolation; samples before the start hold the first.
        assert_eq!(outputs(0.25).map(|row| row[0]), [0.0, 3.0, -2.0, 1.25]);
        assert_eq!(outputs(1.25).map(|row| row[0]), [0.0, 0.0, 3.0, -2.0]);
        // The reversal of the operator is not clipped: it is interpolated after the operator saw its peak.
        assert_eq!(outputs(0.0).map(|row| row[1]), [0.0, 3.0, -3.05, 2.0]);
        let (whole, later) = (outputs(0.0), outputs(1.0));
        for (k, row) in outputs(0.5).iter().enumerate() {
            assert!((row[1] - 0.5 * (whole[k][1] + later[k][1])).abs() < 1e-15);
        }
    }
}
