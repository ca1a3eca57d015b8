//! What a model puts out for an input, sample by sample: the plain loops that `rows` is compared with.
//!
//! Operators and the columns beside them first, from the virgin state; then creep, dynamics and dead time.

use hysteresis_control::linear::Block;
use hysteresis_core::{DuhemForward, Process};

use crate::fit::own_columns::underway;
use crate::terms::creep::CreepBasis;
use crate::terms::duhem::{DuhemTable, MOST_KNOTS};
use crate::terms::dynamics::{DynamicsFilter, LinearPart, SampledPart};
use crate::terms::maps::{Curve, DrivePath, PathLane};
use crate::terms::operators::{OperatorBank, max, min};
use crate::terms::side_columns::{SideColumns, SideLane, Sides};
use crate::terms::slow_gain::{GainAt, GainLane};

/// The operators at a point with what the drive passes before them, the output map behind them, and the columns beside
/// them.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct OperatorsAt {
    pub(crate) bank: OperatorBank,
    pub(crate) input_offset: f64,
    pub(crate) path: DrivePath,
    pub(crate) output_map: Option<Curve>,
    pub(crate) side: Option<SideColumns>,
    #[cfg_attr(feature = "serde", serde(default))]
    pub(crate) gain: Option<GainAt>,
    #[cfg_attr(feature = "serde", serde(default))]
    pub(crate) duhem: Option<DuhemTable>,
}

impl OperatorsAt {
    /// Operators and nothing else.
    pub(crate) fn alone(bank: OperatorBank, input_offset: f64) -> Self {
        Self { bank, input_offset, path: DrivePath::default(), output_map: None, side: None, gain: None, duhem: None }
    }

    /// How many columns there are beside the operators.
    pub(crate) fn sides(&self) -> Sides {
        self.side.as_ref().map_or_else(Sides::default, SideColumns::sides)
    }

    /// Whether they need no samples between turns and rows: columns beside them, a slow gain and an amplifier need all.
    pub(crate) fn need_turns_alone(&self) -> bool {
        self.side.is_none() && self.gain.is_none() && self.path.keeps_turns()
    }

    /// Whether the slow gain is that of others: of the same voltage.
    pub(crate) fn has_gain_of(&self, other: &Self) -> bool {
        self.gain.is_none() || (self.gain == other.gain && self.path.bandwidth == other.path.bandwidth)
    }

    /// Whether the columns beside them are those of others: the same ones of the same voltage.
    pub(crate) fn has_side_of(&self, other: &Self) -> bool {
        self.side.is_none() || (self.side == other.side && self.path.bandwidth == other.path.bandwidth)
    }
}

/// The rows of one record: row k holds z_i(k - delay), i = 0..n-1, of the operators at u - `input_offset`, and the
/// columns beside the operators.
///
/// Behind an output map phi the rows are those of phi(h) linearised: with h the output for the weights of reference,
/// the columns are phi'(h) z_i, and phi(h) - phi'(h) h is known. Behind an amplifier and in front of dynamics, row k is
/// that at the end of the interval in which u(k) is held.
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
    /// z `whole` samples before the current one.
    now: Vec<f64>,
    /// z one sample earlier still.
    before: Vec<f64>,
    path: PathLane<'a>,
    output_map: Option<&'a Curve>,
    side: Option<Side<'a>>,
    gain: Option<Gain>,
    duhem: Option<Beside>,
}

/// The Duhem operator, with its output now and one sample earlier.
struct Beside {
    stream: DuhemForward<MOST_KNOTS>,
    now: f64,
    before: f64,
}

/// The slow gain, now and one sample earlier.
struct Gain {
    lane: GainLane,
    now: f64,
    before: f64,
}

/// The columns beside the operators, now and one sample earlier.
struct Side<'a> {
    lane: SideLane<'a>,
    now: Vec<f64>,
    before: Vec<f64>,
}

impl<'a> Regressor<'a> {
    /// The regressor before the record's first sample; `delay` in samples, not negative, `dt` in seconds.
    pub(crate) fn new(operators: &'a OperatorsAt, input: &'a [f64], delay: f64, dt: f64) -> Self {
        let OperatorsAt { bank, input_offset, path, output_map, side, gain, duhem } = operators;
        let side = side.as_ref().map(|columns| {
            let rest = vec![0.0; columns.len()];
            Side { lane: SideLane::new(columns, dt), now: rest.clone(), before: rest }
        });
        let gain = gain.as_ref().map(|at| Gain { lane: GainLane::new(at, dt), now: 1.0, before: 1.0 });
        let duhem = duhem.as_ref().map(|table| Beside { stream: table.stream(), now: 0.0, before: 0.0 });
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a delay is not negative")]
        let whole = delay.floor() as usize;
        let rest = vec![0.0; bank.len()];
        let fraction = delay - delay.floor();
        let (now, before) = (rest.clone(), rest);
        let input_offset = *input_offset;
        let (path, output_map) = (path.lane(dt), output_map.as_ref());
        Self {
            bank,
            input,
            input_offset,
            whole,
            fraction,
            seen: None,
            now,
            before,
            path,
            output_map,
            side,
            gain,
            duhem,
        }
    }

    /// Goes to a sample of the record, not before the last one.
    #[inline(always)]
    pub(crate) fn go_to(&mut self, sample: usize) {
        let last = sample.saturating_sub(self.whole);
        if self.seen.is_none() {
            let x = self.path.next(self.input[0]) - self.input_offset;
            self.bank.next(&self.before, x, &mut self.now);
            self.before.copy_from_slice(&self.now);
            if let Some(duhem) = &mut self.duhem {
                duhem.next(x);
                duhem.before = duhem.now;
            }
            if let Some(side) = &mut self.side {
                side.next(self.input[0]);
                side.before.copy_from_slice(&side.now);
            }
            if let Some(gain) = &mut self.gain {
                gain.next(self.input[0]);
                gain.before = gain.now;
            }
        }
        let mut seen = self.seen.unwrap_or(0);
        while seen < last {
            seen += 1;
            std::mem::swap(&mut self.before, &mut self.now);
            let x = self.path.next(self.input[seen]) - self.input_offset;
            self.bank.next(&self.before, x, &mut self.now);
            if let Some(duhem) = &mut self.duhem {
                duhem.next(x);
            }
            if let Some(side) = &mut self.side {
                side.next(self.path.voltage(self.input[seen]));
            }
            if let Some(gain) = &mut self.gain {
                gain.next(self.path.voltage(self.input[seen]));
            }
        }
        self.seen = Some(seen);
    }

    fn side_len(&self) -> usize {
        self.side.as_ref().map_or(0, |side| side.now.len())
    }

    /// The output for these weights, of which there may be one or two for each operator, and those of the columns
    /// beside them: their sum behind the output map, and what stands beside it.
    #[inline(always)]
    pub(crate) fn output(&mut self, weights: &[f64]) -> f64 {
        let fraction = self.fraction;
        if self.gain.is_some() {
            let (now, before) = self.both(weights);
            return interpolated(now, before, fraction);
        }
        let side = self.beside(weights, |now, before| interpolated(now, before, fraction));
        let Some(map) = self.output_map else {
            // Behind a linear part that has the dead time there is nothing between samples: half of the work.
            return side
                + if fraction == 0.0 {
                    self.operators(weights, |now, _| now)
                } else {
                    self.operators(weights, |now, before| interpolated(now, before, fraction))
                };
        };
        let (now, before) = (self.operators(weights, |now, _| now), self.operators(weights, |_, before| before));
        side + self.between(map.at(now).0, map.at(before).0)
    }

    /// The output now and one sample earlier, without the dead time.
    fn both(&self, weights: &[f64]) -> (f64, f64) {
        let mapped = |sum: f64| self.output_map.map_or(sum, |map| map.at(sum).0);
        let (now, before) = (self.operators(weights, |now, _| now), self.operators(weights, |_, before| before));
        let (now, before) = (
            mapped(now) + self.beside(weights, |now, _| now),
            mapped(before) + self.beside(weights, |_, before| before),
        );
        let (gain_now, gain_before) = self.gain.as_ref().map_or((1.0, 1.0), |gain| (gain.now, gain.before));
        (gain_now * now, gain_before * before)
    }

    /// The weighed sum of a value of every column beside the operators.
    #[inline(always)]
    fn beside(&self, weights: &[f64], value: impl Fn(f64, f64) -> f64) -> f64 {
        let Some(side) = &self.side else { return 0.0 };
        let amplitudes = &weights[weights.len() - side.now.len()..];
        let both = side.now.iter().zip(&side.before);
        amplitudes.iter().zip(both).map(|(amplitude, (now, before))| amplitude * value(*now, *before)).sum()
    }

    /// The weighed sum of a value of every operator, and that of what stands beside them.
    #[inline(always)]
    fn operators(&self, weights: &[f64], value: impl Fn(f64, f64) -> f64) -> f64 {
        let beside = self.duhem.as_ref().map_or(0.0, |duhem| value(duhem.now, duhem.before));
        beside + self.plays(weights, value)
    }

    /// The weighed sum of a value of every play.
    #[inline(always)]
    fn plays(&self, weights: &[f64], value: impl Fn(f64, f64) -> f64) -> f64 {
        let (now, before) = (&self.now, &self.before);
        let (above, below) = weights[..weights.len() - self.side_len()].split_at(now.len());
        if below.is_empty() {
            return weighed(above, now, before, value);
        }
        weighed(above, now, before, |now, before| value(max(now, 0.0), max(before, 0.0)))
            + weighed(below, now, before, |now, before| value(min(now, 0.0), min(before, 0.0)))
    }

    fn between(&self, now: f64, before: f64) -> f64 {
        interpolated(now, before, self.fraction)
    }
}

/// What the rows of a tangent are compared with.
#[cfg(test)]
impl Regressor<'_> {
    /// Writes the row of the current sample: one column for each operator, or, in a row twice as long, one for its
    /// output above zero and one for that below; then those beside them. Returns what is known beside them: zero
    /// without an output map, which is taken as linear about the output for the weights of `reference`.
    pub(crate) fn row(&mut self, reference: &[f64], row: &mut [f64]) -> f64 {
        let n = self.now.len();
        let (row, sides) = row.split_at_mut(row.len() - self.side_len());
        if let Some(side) = &self.side {
            for ((place, now), before) in sides.iter_mut().zip(&side.now).zip(&side.before) {
                *place = self.between(*now, *before);
            }
        }
        let (slopes, known) = self.about(reference);
        let between = |now: f64, before: f64| interpolated(slopes.0 * now, slopes.1 * before, self.fraction);
        if row.len() == n && self.fraction == 0.0 && self.output_map.is_none() {
            row.copy_from_slice(&self.now);
            return known;
        }
        if row.len() == n {
            for ((z, now), before) in row.iter_mut().zip(&self.now).zip(&self.before) {
                *z = between(*now, *before);
            }
            return known;
        }
        let (above, below) = row.split_at_mut(n);
        for (i, (now, before)) in self.now.iter().zip(&self.before).enumerate() {
            above[i] = between(max(*now, 0.0), max(*before, 0.0));
            below[i] = between(min(*now, 0.0), min(*before, 0.0));
        }
        known
    }

    /// The slopes of the output map now and one sample earlier, at the output for these weights, and what is known.
    fn about(&mut self, reference: &[f64]) -> ((f64, f64), f64) {
        let beside = self.duhem.as_ref().map_or(0.0, |duhem| self.between(duhem.now, duhem.before));
        let Some(map) = self.output_map else { return ((1.0, 1.0), beside) };
        let (now, before) = (self.operators(reference, |now, _| now), self.operators(reference, |_, before| before));
        let ((value, slope), (value_before, slope_before)) = (map.at(now), map.at(before));
        let (now, before) = (self.plays(reference, |now, _| now), self.plays(reference, |_, before| before));
        let known = self.between(value - slope * now, value_before - slope_before * before);
        ((slope, slope_before), known)
    }

    /// The derivative of [`output`](Self::output) by the delay, for the tests of the rows.
    #[cfg(test)]
    pub(crate) fn slope_over_delay(&mut self, weights: &[f64]) -> f64 {
        let side = self.beside(weights, |now, before| before - now);
        let Some(map) = self.output_map else {
            return side + self.operators(weights, |now, before| before - now);
        };
        let (now, before) = (self.operators(weights, |now, _| now), self.operators(weights, |_, before| before));
        side + map.at(before).0 - map.at(now).0
    }
}

impl Beside {
    fn next(&mut self, x: f64) {
        (self.before, self.now) = (self.now, self.stream.step(x));
    }
}

impl Gain {
    fn next(&mut self, u: f64) {
        self.before = self.now;
        self.lane.next(u);
        self.now = self.lane.gain();
    }
}

impl Side<'_> {
    fn next(&mut self, u: f64) {
        std::mem::swap(&mut self.before, &mut self.now);
        self.lane.next(u);
        self.lane.write(self.now.iter_mut());
    }
}

#[inline(always)]
pub(crate) fn interpolated(now: f64, before: f64, fraction: f64) -> f64 {
    // Not (1 - fraction) now + fraction before: a whole delay must give the operator's own bits.
    now + fraction * (before - now)
}

/// A weighed sum in four strands that do not wait for each other.
#[inline(always)]
fn weighed(weights: &[f64], now: &[f64], before: &[f64], value: impl Fn(f64, f64) -> f64) -> f64 {
    let ((fours, weights), (now_fours, now), (before_fours, before)) =
        (weights.as_chunks::<4>(), now.as_chunks::<4>(), before.as_chunks::<4>());
    let mut sums = [0.0; 4];
    for (weights, (now, before)) in fours.iter().zip(now_fours.iter().zip(before_fours)) {
        for i in 0..4 {
            sums[i] += weights[i] * value(now[i], before[i]);
        }
    }
    let rest = weights.iter().zip(now.iter().zip(before)).map(|(weight, (now, before))| weight * value(*now, *before));
    sums[0] + sums[1] + (sums[2] + sums[3]) + rest.sum::<f64>()
}

/// The weighted sum of the operators' outputs from the virgin state, through what follows them, at rest at the first.
pub(crate) fn response(
    operators: &OperatorsAt,
    weights: &[f64],
    linear: &LinearPart,
    input: &[f64],
    dt: f64,
) -> Vec<f64> {
    if linear.is_dead_time_alone() && linear.dead_time >= 0.0 {
        return hysteresis(operators, weights, input, linear.dead_time / dt, dt);
    }
    through(linear, &hysteresis(operators, weights, input, 0.0, dt), dt)
}

/// The weighted sum of the operators' outputs from the virgin state, and what stands beside them, `delay` samples
/// later.
pub(crate) fn hysteresis(operators: &OperatorsAt, weights: &[f64], input: &[f64], delay: f64, dt: f64) -> Vec<f64> {
    let mut regressor = Regressor::new(operators, input, delay, dt);
    let next = |k| {
        regressor.go_to(k);
        regressor.output(weights)
    };
    (0..input.len()).map(next).collect()
}

/// A signal through creep, dynamics and dead time, at rest at its first value.
pub(crate) fn through(linear: &LinearPart, signal: &[f64], dt: f64) -> Vec<f64> {
    let part = SampledPart::new(linear, dt);
    let (mut creep, mut dynamics) = (part.creep_at(signal.first().copied()), DynamicsFilter::new(&part));
    let (mut taken, mut rest) = (0, 0.0);
    let reading = |k| {
        let source = part.source(k);
        while taken < source.map_or(1, |source| source + 1) {
            let p = creep.step(signal[taken.min(signal.len() - 1)]);
            if taken == 0 {
                rest = p;
            }
            dynamics.take(p);
            taken += 1;
        }
        if source.is_none() { rest } else { dynamics.reading() }
    };
    (0..signal.len()).map(reading).collect()
}

/// What predicts: the operators and the columns beside them with their weights, and what follows them.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Chain {
    pub(crate) operators: OperatorsAt,
    pub(crate) weights: Vec<f64>,
    pub(crate) linear: LinearPart,
    /// The creep that was under way in the records that were fitted, one amplitude each, and what it is made of.
    pub(crate) underway: Vec<f64>,
    pub(crate) creep_underway: CreepBasis,
    /// The sampling interval of records that have none of their own, in seconds; 1, in samples, if none is known.
    pub(crate) dt: f64,
}

impl Chain {
    /// One without creep under way when a record begins.
    pub(crate) fn from_rest(operators: OperatorsAt, weights: Vec<f64>, linear: LinearPart, dt: f64) -> Self {
        Self { operators, weights, linear, underway: Vec::new(), creep_underway: CreepBasis::default(), dt }
    }

    /// What of an output offset stands in front of the creep, which creeps with it.
    pub(crate) fn rest_of(&self, output_offset: f64) -> f64 {
        output_offset / (1.0 + self.linear.amplitudes.iter().sum::<f64>())
    }

    /// The output but for the output offset.
    pub(crate) fn response(&self, input: &[f64], dt: f64) -> Vec<f64> {
        response(&self.operators, &self.weights, &self.linear, input, dt)
    }

    /// The same for a record that was fitted, with the creep that was under way.
    pub(crate) fn response_in(&self, place: usize, input: &[f64], dt: f64) -> Vec<f64> {
        let mut predicted = self.response(input, dt);
        if let Some(amplitude) = self.underway.get(place).filter(|amplitude| **amplitude != 0.0) {
            let more = underway(&self.creep_underway, input.len(), dt);
            predicted.iter_mut().zip(more).for_each(|(y, more)| *y += amplitude * more);
        }
        predicted
    }
}

#[cfg(test)]
mod tests_of_the_operators {
    use hysteresis_core::{CoupledPlay, Operator, Ratios};
    use proptest::prelude::*;

    use super::*;

    fn at(bank: OperatorBank, input_offset: f64) -> OperatorsAt {
        OperatorsAt::alone(bank, input_offset)
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
                regressor.go_to(k);
                while taken <= k.saturating_sub(delay) {
                    for (z, operator) in z.iter_mut().zip(&operators) {
                        *z = operator.next(*z, input[taken] - input_offset);
                    }
                    taken += 1;
                }
                regressor.row(&[], &mut row);
                prop_assert_eq!(&row, &z, "sample {}", k);
                // The same weights above zero and below are those of all outputs.
                let whole = regressor.output(&vec![0.3; r.len()]);
                prop_assert!((regressor.output(&vec![0.3; 2 * r.len()]) - whole).abs() < 1e-12);
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
                regressor.go_to(k);
                regressor.row(&[], &mut row);
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

#[cfg(test)]
mod tests_of_the_linear_part {
    use hysteresis_control::linear::{Dynamics, FirstOrder, LinearDynamics, SecondOrder};

    use super::*;

    fn signal() -> Vec<f64> {
        (0..60_u32).map(|k| 2.0 + (f64::from(k * k) / 7.0).sin() * f64::from(k % 11)).collect()
    }

    /// The whole linear part is what the blocks of a stage make of a signal: creep at the samples, then dynamics behind
    /// a dead time, whole or not.
    #[test]
    fn equals_the_blocks_of_a_stage() {
        let dt = 1e-4;
        let all: [Option<Dynamics>; 4] = [
            None,
            Some(FirstOrder::new(279.0).unwrap().into()),
            Some(SecondOrder::new(800.0, 0.02).unwrap().into()),
            Some(SecondOrder::new(400.0, 1.7).unwrap().into()),
        ];
        for dynamics in all {
            for dead_time in [0.0, 0.3e-4, 1e-4, 2.65e-4] {
                let part = LinearPart {
                    dynamics,
                    amplitudes: vec![0.02, 0.1],
                    time_constants: vec![4e-4, 3e-3],
                    dead_time,
                    ..LinearPart::default()
                };
                let linear = dynamics.map_or_else(LinearDynamics::none, LinearDynamics::from);
                let mut block = linear.with_dead_time(dead_time).unwrap().block(dt).unwrap();
                let mut q = [signal()[0]; 2];
                block.settle(signal()[0] * 1.12);
                for (k, (h, got)) in signal().iter().zip(through(&part, &signal(), dt)).enumerate() {
                    let want = block.step(h + 0.02 * q[0] + 0.1 * q[1]);
                    q[0] += (1.0 - (-dt / 4e-4_f64).exp()) * (h - q[0]);
                    q[1] += (1.0 - (-dt / 3e-3_f64).exp()) * (h - q[1]);
                    assert!((got - want).abs() < 1e-11, "{dynamics:?} {dead_time} {k}: {got} {want}");
                }
            }
        }
    }

    /// Behind an amplifier the input goes exponentially from each value to the next: as many small steps.
    #[test]
    fn an_amplifier_leads_the_input_from_value_to_value() {
        let dt = 1e-4;
        for (bandwidth, zeta) in [(400.0, 0.02), (5000.0, 0.4), (800.0, 1.0)] {
            let dynamics = SecondOrder::new(800.0, zeta).unwrap();
            let part = LinearPart {
                dynamics: Some(dynamics.into()),
                dead_time: 0.4e-4,
                bandwidth: Some(bandwidth),
                ..LinearPart::default()
            };
            let signal = signal();
            let (pieces, sigma) = (1000_u32, core::f64::consts::TAU * bandwidth);
            let mut block = dynamics.block(dt / f64::from(pieces)).unwrap();
            let mut fine = vec![block.settle(signal[0])];
            let mut before = signal[0];
            for p in &signal {
                let end = before + (p - before) / -(-sigma * dt).exp_m1();
                for piece in 0..pieces {
                    let t = dt * (f64::from(piece) + 0.5) / f64::from(pieces);
                    fine.push(block.advance(end + (before - end) * (-sigma * t).exp()));
                }
                before = *p;
            }
            let mut filter = DynamicsFilter::new(&SampledPart::new(&part, dt));
            for (k, p) in signal.iter().enumerate() {
                filter.take(*p);
                let got = filter.reading();
                let want = fine[1000 * k + 600];
                assert!((got - want).abs() < 1e-4, "{bandwidth} {zeta} {k}: {got} {want}");
            }
        }
    }

    /// A negative dead time reads ahead: the same rows, earlier.
    #[test]
    fn a_negative_dead_time_reads_ahead() {
        let part = |dead_time| LinearPart {
            dynamics: Some(SecondOrder::new(800.0, 0.1).unwrap().into()),
            dead_time,
            ..LinearPart::default()
        };
        let (later, now, earlier) = (
            through(&part(0.4e-4), &signal(), 1e-4),
            through(&part(0.0), &signal(), 1e-4),
            through(&part(-1e-4), &signal(), 1e-4),
        );
        let ahead = through(&part(-1.6e-4), &signal(), 1e-4);
        for k in 0..50 {
            assert!((earlier[k] - now[k + 1]).abs() < 1e-12);
            assert!((ahead[k] - later[k + 2]).abs() < 1e-12);
        }
    }

    #[test]
    fn at_rest_nothing_moves() {
        let part = LinearPart {
            dynamics: Some(SecondOrder::new(800.0, 0.02).unwrap().into()),
            amplitudes: vec![0.01],
            time_constants: vec![0.1],
            dead_time: 0.3e-4,
            ..LinearPart::default()
        };
        let held = through(&part, &[0.3; 40], 1e-4);
        assert!(held.iter().all(|y| *y == held[0]));
    }
}
