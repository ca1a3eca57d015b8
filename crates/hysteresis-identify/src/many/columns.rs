//! The outputs of all operators of one point and the rows that are made of them, with the widest instructions that the processor has.
//!
//! Sums and products are those of the plain loop, element by element, so the processor changes no bit but the sign of zero.

use fearless_simd::Simd;

use super::visits::Visits;
use crate::fit::bank::{OperatorBank, max, min};
use crate::fit::bank_lanes::{BLOCK, BankLanes, Runs};
use crate::fit::eight::{LANES, SimdLoop, copy_signals, dispatch};

/// z of every operator, visit by visit.
pub(super) struct Outputs {
    operators: usize,
    z: Vec<f64>,
}

impl Outputs {
    /// What operators put out for inputs that begin at rest.
    pub(super) fn new(bank: &OperatorBank, input_offset: f64, inputs: &[f64]) -> Self {
        let operators = bank.len();
        let (mut lanes, mut runs) = (BankLanes::new(bank), Runs::new());
        let mut block = vec![[0.0; LANES]; lanes.eights() * BLOCK];
        let mut z = vec![0.0; inputs.len() * operators];
        for (inputs, z) in inputs.chunks(BLOCK).zip(z.chunks_mut(BLOCK * operators)) {
            let mut xs = [0.0; BLOCK];
            xs.iter_mut().zip(inputs).for_each(|(x, u)| *x = u - input_offset);
            let xs = &xs[..inputs.len()];
            runs.take(xs);
            lanes.put_out(xs, &runs, &mut block);
            for (k, row) in z.chunks_exact_mut(operators).enumerate() {
                copy_signals(|eight| &block[eight * BLOCK + k], row);
            }
        }
        Self { operators, z }
    }

    /// Writes the columns of a row behind the dead time: one for each operator, or, in a row twice as long, one for its output
    /// above zero and one for that below.
    #[inline(always)]
    pub(super) fn write(&self, (place, before): (usize, usize), fraction: f64, row: &mut [f64]) {
        let n = self.operators;
        let (now, before) = (&self.z[place * n..(place + 1) * n], &self.z[before * n..(before + 1) * n]);
        let (above, below) = row.split_at_mut(n);
        if below.is_empty() {
            for i in 0..n {
                above[i] = now[i] + fraction * (before[i] - now[i]);
            }
            return;
        }
        let below = &mut below[..n];
        for i in 0..n {
            let (high, low) = (max(now[i], 0.0), min(now[i], 0.0));
            above[i] = high + fraction * (max(before[i], 0.0) - high);
            below[i] = low + fraction * (min(before[i], 0.0) - low);
        }
    }
}

/// Fills rows \[1 | columns of the weights | derivatives | residual\] one after the other.
pub(super) struct Rows<'a> {
    pub(super) visits: &'a Visits<'a>,
    pub(super) z: &'a Outputs,
    /// The output of the model at the point.
    pub(super) here: &'a [f64],
    /// For each axis the outputs at a neighbour, or none for the dead time; and over what the change is divided.
    pub(super) there: &'a [(Option<Vec<f64>>, f64)],
    /// The measured positions, row by row, without the output offset.
    pub(super) measured: &'a [f64],
}

impl Rows<'_> {
    /// The rows from number `first` on, as many as find room.
    pub(super) fn write(&self, first: usize, columns: usize, block: &mut [f64]) {
        dispatch(Write { rows: self, first, columns, block });
    }

    #[inline(always)]
    fn fill(&self, first: usize, columns: usize, block: &mut [f64]) {
        let fraction = self.visits.fraction();
        let slopes = columns - 1 - self.there.len();
        for (number, row) in (first..).zip(block.chunks_exact_mut(columns)) {
            let (place, before) = self.visits.places(number);
            row[0] = 1.0;
            self.z.write((place, before), fraction, &mut row[1..slopes]);
            let (now, then) = (self.here[place], self.here[before]);
            let output = now + fraction * (then - now);
            for (slope, (there, distance)) in row[slopes..columns - 1].iter_mut().zip(self.there) {
                let change = match there {
                    Some(there) => there[place] + fraction * (there[before] - there[place]) - output,
                    None => then - now,
                };
                *slope = change / distance;
            }
            row[columns - 1] = self.measured[number] - output;
        }
    }
}

/// The work of [`Rows::write`].
struct Write<'a> {
    rows: &'a Rows<'a>,
    first: usize,
    columns: usize,
    block: &'a mut [f64],
}

impl SimdLoop for Write<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, _: S) {
        self.rows.fill(self.first, self.columns, self.block);
    }
}

#[cfg(test)]
mod tests {
    use hysteresis_core::Ratios;
    use proptest::prelude::*;

    use super::*;
    use crate::fit::course::Course;
    use crate::fit::regressor::{OperatorsAt, Regressor};
    use crate::record::Record;

    proptest! {
        /// The rows of a regressor, bit for bit, on all samples and on a thinned course, whole and split.
        #[test]
        fn rows_are_those_of_a_regressor(
            input in prop::collection::vec(-10.0..10.0_f64, 40..80),
            r in prop::collection::vec(0.0..8.0_f64, 1..20),
            delay in 0.0..5.0_f64,
            stride in 1_usize..5,
            families in 1_usize..3,
        ) {
            let ratios = Ratios::PAPER;
            let record = Record::new(&input, &input, 3).unwrap();
            let course = Course::new(&record, stride, 0).with_all_turns(&input);
            let visits = Visits::new(&input, &course, delay);
            let bank = OperatorBank::from_ratios(&r, ratios);
            let outputs = Outputs::new(&bank, 0.5, visits.inputs());
            let operators = OperatorsAt::alone(bank, 0.5);
            let mut regressor = Regressor::new(&operators, &input, delay, 1.0);
            let mut rows = [vec![0.0; families * r.len()], vec![0.0; families * r.len()]];
            for number in 0..course.len() {
                regressor.go_to(course.sample(number));
                regressor.row(&[], &mut rows[0]);
                outputs.write(visits.places(number), visits.fraction(), &mut rows[1]);
                prop_assert_eq!(&rows[0], &rows[1], "row {}", number);
            }
        }
    }
}
