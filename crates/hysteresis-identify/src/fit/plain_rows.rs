//! Rows behind a dead time alone: between rows only the turns of the input need to be seen.

use super::bank_lanes::BLOCK;
use super::course::Course;
use super::eight::{LANES, Lanes};
use super::operator_blocks::OperatorBlocks;
use super::regressor::interpolated;
use super::seen_samples::SeenSamples;
use super::tangent::{Slope, Tangent};

/// The rows of one record; see [`TangentRows`](super::tangent::TangentRows).
pub(crate) struct PlainRows<'a> {
    tangent: &'a Tangent,
    dt: f64,
    /// The dead time in whole samples, and what is left of it.
    whole: usize,
    fraction: f64,
    to_see: SeenSamples<'a>,
    operators: OperatorBlocks<'a>,
    signals: Vec<Lanes>,
    /// The last sample of the block before.
    tail: Vec<Lanes>,
    samples: [usize; BLOCK],
    count: usize,
    /// Which of the block is the newest that a row needs.
    at: usize,
    row: Vec<Lanes>,
}

impl<'a> PlainRows<'a> {
    pub(super) fn new(tangent: &'a Tangent, input: &'a [f64], dt: f64, course: Option<&'a Course>) -> Self {
        let delay = tangent.linear.dead_time / dt;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a delay is not negative")]
        let whole = delay.floor() as usize;
        let operators = OperatorBlocks::new(tangent, input, dt);
        let eights = operators.layout.end.div_ceil(LANES);
        let course = course.filter(|_| tangent.operators.need_turns_alone());
        Self {
            tangent,
            dt,
            whole,
            fraction: delay - delay.floor(),
            to_see: SeenSamples::new(input.len(), course, whole),
            operators,
            signals: vec![[0.0; LANES]; eights * BLOCK],
            tail: vec![[0.0; LANES]; eights],
            samples: [0; BLOCK],
            count: 0,
            at: 0,
            row: vec![[0.0; LANES]; eights],
        }
    }

    pub(super) fn write(&mut self, sample: usize, row: &mut [f64]) -> f64 {
        let newest = sample.saturating_sub(self.whole);
        while self.count == 0 || self.samples[self.at] < newest {
            if self.at + 1 < self.count {
                self.at += 1;
            } else if !self.put_out() {
                break;
            }
        }
        let layout = self.operators.layout;
        for ((lanes, block), tail) in self.row.iter_mut().zip(self.signals.chunks_exact(BLOCK)).zip(&self.tail) {
            let (now, before) = (block[self.at], if self.at == 0 { *tail } else { block[self.at - 1] });
            *lanes = std::array::from_fn(|i| interpolated(now[i], before[i], self.fraction));
        }
        let lanes = &self.row;
        let signal = |lane: usize| lanes[lane / LANES][lane % LANES];
        let (columns, slopes) = row.split_at_mut(self.tangent.columns);
        layout.copy_columns(|eight| &lanes[eight], columns);
        let mut derivatives = layout.derivatives..;
        for (value, slope) in slopes.iter_mut().zip(&self.tangent.slopes) {
            *value = match slope {
                Slope::Operators(..) => derivatives.next().map_or(0.0, signal),
                // Only the dead time has no neighbour here: an amplifier comes with dynamics.
                _ => self.slope_over_dead_time(),
            };
        }
        if layout.end > layout.known { signal(layout.known) } else { 0.0 }
    }

    fn slope_over_dead_time(&self) -> f64 {
        let (eight, lane) = (self.operators.layout.output / LANES, self.operators.layout.output % LANES);
        let block = &self.signals[eight * BLOCK..];
        let before = if self.at == 0 { &self.tail[eight] } else { &block[self.at - 1] };
        (before[lane] - block[self.at][lane]) / self.dt
    }

    /// Goes on by a block; says whether there was any.
    fn put_out(&mut self) -> bool {
        let mut samples = [0; BLOCK];
        let mut count = 0;
        for (place, sample) in samples.iter_mut().zip(&mut self.to_see) {
            *place = sample;
            count += 1;
        }
        if count == 0 {
            return false;
        }
        let is_first = self.count == 0;
        for (tail, block) in self.tail.iter_mut().zip(self.signals.chunks_exact(BLOCK)) {
            *tail = block[self.at];
        }
        self.operators.put_out(&samples[..count], &mut self.signals);
        if is_first {
            // Samples before the record's start hold the first one.
            for (tail, block) in self.tail.iter_mut().zip(self.signals.chunks_exact(BLOCK)) {
                *tail = block[0];
            }
        }
        (self.samples, self.count, self.at) = (samples, count, 0);
        true
    }
}

#[cfg(test)]
mod tests {
    use hysteresis_core::Ratios;
    use proptest::prelude::*;

    use super::*;
    use crate::fit::bank::OperatorBank;
    use crate::fit::curve::Curve;
    use crate::fit::linear_part::LinearPart;
    use crate::fit::regressor::{OperatorsAt, Regressor};
    use crate::record::Record;

    proptest! {
        /// The rows of the regressor, sample by sample, thinned or not: columns bit for bit, derivatives but for rounding.
        #[test]
        fn equals_the_regressor(
            input in prop::collection::vec(prop_oneof![-10.0..10.0_f64, Just(1.0)], 5..150),
            r in prop::collection::vec(0.0..8.0_f64, 1..12),
            delay in prop_oneof![0.0..5.0_f64, Just(0.0), Just(2.0)],
            stride in 1_usize..5,
            families in 1_usize..3,
            has_map in any::<bool>(),
        ) {
            // An input that never moves is no record.
            prop_assume!(input[3..].iter().any(|u| *u != input[3]));
            let record = Record::new(&input, &input, 3).unwrap();
            let course = Course::new(&record, stride, 0).with_all_turns(&input);
            let map = has_map.then(|| Curve::new((-10.0, 10.0), [0.3, 0.1, 0.0]));
            let at = |ra| OperatorsAt {
                output_map: map.clone(),
                ..OperatorsAt::alone(OperatorBank::from_ratios(&r, Ratios { ra, ..Ratios::PAPER }), 0.5)
            };
            let weights: Vec<f64> = (1_u32..).take(families * r.len()).map(|i| 0.2 / f64::from(i)).collect();
            let dt = 0.5;
            let tangent = Tangent {
                operators: at(0.9),
                linear: LinearPart::delay(delay * dt),
                columns: weights.len(),
                weights: weights.clone(),
                slopes: vec![Slope::Operators(at(0.8), -0.1), Slope::DeadTime],
            };
            let neighbour = at(0.8);
            let mut rows = PlainRows::new(&tangent, &input, dt, Some(&course));
            let start = |at| Regressor::new(at, &input, delay, dt);
            let (mut here, mut there) = (start(&tangent.operators), start(&neighbour));
            let (mut got, mut want) = (vec![0.0; weights.len() + 2], vec![0.0; weights.len()]);
            for number in 0..course.len() {
                let k = course.sample(number);
                let known = rows.write(k, &mut got);
                here.go_to(k);
                there.go_to(k);
                let known_there = here.row(&weights, &mut want);
                let (columns, slopes) = got.split_at(weights.len());
                let is_close = |got: f64, want: f64| (got - want).abs() < 1e-10;
                for (got, want) in columns.iter().zip(&want) {
                    prop_assert!(if has_map { is_close(*got, *want) } else { got == want }, "sample {}", k);
                }
                prop_assert!(is_close(known, known_there), "sample {}: {} {}", k, known, known_there);
                let slope = (there.output(&weights) - here.output(&weights)) / -0.1;
                prop_assert!(is_close(slopes[0], slope), "sample {}: {} {}", k, slopes[0], slope);
                prop_assert!(is_close(slopes[1], here.slope_over_delay(&weights) / dt), "sample {}", k);
            }
        }
    }
}
