//! Rows of the equations: what the columns of a model, and its output's derivatives, differ by between the two instants
//! of each.

use crate::fit::tangent::Tangent;
use crate::places::beside::Beside;
use crate::places::given::Given;
use crate::places::rows::{Rows, between};
use crate::records::course::{Course, turns};

/// The equations of all drives, sorted by the samples that they need.
pub(crate) struct Equations<'a> {
    given: Given<'a>,
    drives: Vec<OfDrive<'a>>,
    count: usize,
}

struct OfDrive<'a> {
    input: &'a [f64],
    course: Course,
    parts: Vec<Part>,
}

/// What a sample adds to an equation.
#[derive(Clone, Copy)]
struct Part {
    sample: usize,
    equation: usize,
    factor: f64,
}

impl<'a> Equations<'a> {
    pub(crate) fn new(given: &Given<'a>) -> Self {
        let mut parts = vec![Vec::new(); given.drives.len()];
        let mut count = 0;
        for (equation, (drive, [first, second])) in given.equations().enumerate() {
            let last = given.drives[drive].len() - 1;
            for (instant, sign) in [(first, -1.0), (second, 1.0)] {
                let (sample, share) = between(instant);
                parts[drive].push(Part { sample, equation, factor: sign * (1.0 - share) });
                if share > 0.0 {
                    parts[drive].push(Part { sample: (sample + 1).min(last), equation, factor: sign * share });
                }
            }
            count = equation + 1;
        }
        let drives = given.drives.iter().zip(parts).map(|(input, parts)| OfDrive::new(input, parts)).collect();
        Self { given: *given, drives, count }
    }

    /// The rows at a point: one column for each weight, those beside the operators, then the derivatives.
    pub(crate) fn rows(&self, tangent: &Tangent, beside: &Beside) -> Rows {
        let of_tangent = tangent.columns + tangent.slopes.len();
        let further = beside.columns(self.given.drives.len());
        let width = of_tangent + further + usize::from(beside.ahead.is_some());
        let mut values = vec![0.0; width * self.count];
        let mut row = vec![0.0; of_tangent];
        for OfDrive { input, course, parts } in &self.drives {
            let mut rows = tangent.rows(input, self.given.dt, Some(course));
            let mut written = None;
            for Part { sample, equation, factor } in parts {
                if written != Some(*sample) {
                    rows.write(*sample, &mut row);
                    written = Some(*sample);
                }
                let place = &mut values[equation * width..][..width];
                let (columns, slopes) = row.split_at(tangent.columns);
                place.iter_mut().zip(columns).for_each(|(sum, value)| *sum += factor * value);
                let place = place.iter_mut().skip(tangent.columns + further);
                place.zip(slopes).for_each(|(sum, value)| *sum += factor * value);
            }
        }
        let mut rows = Rows { width, values };
        beside.write(&self.given, tangent.columns, &mut rows);
        rows
    }
}

impl<'a> OfDrive<'a> {
    fn new(input: &'a [f64], mut parts: Vec<Part>) -> Self {
        parts.sort_by_key(|part| part.sample);
        let mut rows: Vec<usize> = parts.iter().map(|part| part.sample).collect();
        rows.dedup();
        // Between the instants operators need to see the reversals alone.
        let course = Course::Some { rows, turns: Some(turns(input, 0.0)) };
        Self { input, course, parts }
    }
}

#[cfg(test)]
mod tests {
    use hysteresis_core::Ratios;

    use super::*;
    use crate::fit::response::{OperatorsAt, hysteresis};
    use crate::places::beside::Courses;
    use crate::places::given::{KnownLength, PlacePair};
    use crate::places::rows::value_at;
    use crate::terms::dynamics::LinearPart;
    use crate::terms::operators::OperatorBank;

    /// The rows times weights are the differences of the output at the instants, a straight line between samples.
    #[test]
    fn rows_are_differences_of_the_output() {
        let drive: Vec<f64> = (0..400_u32).map(|k| 5.0 * (f64::from(k) / 17.0).sin() * f64::from(k) / 400.0).collect();
        let drives = [&drive[..]];
        let pairs = [PlacePair::new(0, 31.25, 250.0), PlacePair::new(0, 399.0, 3.5)];
        let lengths = [KnownLength::new(0, 10.0, 77.7, 2.0)];
        let given = Given::new(&drives, &pairs, &lengths, 1e-3).unwrap();
        let operators = OperatorsAt::alone(OperatorBank::from_ratios(&[0.0, 1.0, 2.5], Ratios::PAPER), 0.3);
        let tangent = Tangent {
            operators: operators.clone(),
            linear: LinearPart::delay(2.4e-3),
            columns: 3,
            weights: Vec::new(),
            slopes: Vec::new(),
        };
        let weights = [1.0, 0.4, 0.2];
        let y = hysteresis(&operators, &weights, &drive, 2.4, 1e-3);
        let at = |instant: f64| {
            let (k, share) = between(instant);
            if share > 0.0 { y[k] + share * (y[k + 1] - y[k]) } else { y[k] }
        };
        let alone = Beside { courses: Courses::none(), lag: None, ahead: None };
        let got = Equations::new(&given).rows(&tangent, &alone).times(&weights);
        for (got, (_, [first, second])) in got.iter().zip(given.equations()) {
            assert!((got - (at(second) - at(first))).abs() < 1e-12, "{got}");
        }
    }

    /// Drift and temperature add what they differ by; the derivative by the lag is that of the columns.
    #[test]
    fn columns_beside_the_operators_are_differences() {
        let drive: Vec<f64> = (0..300_u32).map(|k| (f64::from(k) / 17.0).sin()).collect();
        let temperatures = [(0..300_u32).map(|k| 20.0 + (f64::from(k) / 90.0).sin()).collect::<Vec<f64>>()];
        let drives = [&drive[..]];
        let pairs = [PlacePair::new(0, 31.25, 250.0)];
        let lengths = [KnownLength::new(0, 10.0, 77.5, 2.0)];
        let given = Given::new(&drives, &pairs, &lengths, 0.1).unwrap().with_temperatures(&temperatures).unwrap();
        let operators = OperatorsAt::alone(OperatorBank::from_ratios(&[0.0, 0.5], Ratios::PAPER), 0.0);
        let linear = LinearPart::delay(0.0);
        let tangent = Tangent { operators, linear, columns: 2, weights: Vec::new(), slopes: Vec::new() };
        let at = |lag: f64| Beside { courses: Courses::Steady, lag: Some(lag), ahead: None };
        let with_slope = Beside { ahead: Some((Box::new(at(3.1)), vec![0.0, 0.0, 2.0])), ..at(3.0) };
        let rows = Equations::new(&given).rows(&tangent, &with_slope);
        assert_eq!(rows.width, 2 + 2 + 1 + 1);
        let ahead = Equations::new(&given).rows(&tangent, &at(3.05));
        for ((row, ahead), (_, instants)) in rows.iter().zip(ahead.iter()).zip(given.equations()) {
            let drift = Courses::Steady.of(&[1.5, -0.5], 300);
            let [before, after] = instants.map(|at| value_at(&drift, at));
            assert!((1.5 * row[2] - 0.5 * row[3] - (after - before)).abs() < 1e-4);
            assert!((row[5] - 2.0 * (ahead[4] - row[4]) / 0.05).abs() < 0.02 * row[5].abs());
        }
    }
}
