//! One pass over the records with all operators of a model.

use faer::Mat;

use super::slow;
use crate::finding::Finding;
use crate::finding_code::FindingCode;
use crate::fit::chain::Chain;
use crate::fit::factor::TriangularFactor;
use crate::fit::regressor::OperatorsAt;
use crate::fit::tangent::Tangent;
use crate::numeric::as_f64;
use crate::record::Record;
use crate::signal;

/// What the pass leaves behind.
pub(super) struct Survey {
    /// Measured minus modelled output of the fitted samples of every record, without its mean.
    pub(super) residuals: Vec<Vec<f64>>,
    /// Smallest and largest output of every operator over all fitted samples.
    operator_bounds: Vec<(f64, f64)>,
    /// The threshold r of every operator.
    thresholds: Vec<f64>,
    /// R of [means | operators | slow columns | residual], in echelon form.
    factor: Mat<f64>,
    /// The norm of the outputs, each record's mean removed.
    output_norm: f64,
}

impl Survey {
    pub(super) fn of(records: &[Record<'_>], chain: &Chain) -> Self {
        let thresholds = chain.operators.bank.thresholds().to_vec();
        // The operators alone, whether their weights are split or not.
        let tangent = Tangent {
            operators: OperatorsAt { shift: None, output_map: None, ..chain.operators.clone() },
            linear: chain.linear.clone(),
            columns: thresholds.len(),
            weights: Vec::new(),
            slopes: Vec::new(),
        };
        let (means, n) = (records.len(), thresholds.len());
        let columns = means + n + slow::COLUMNS + 1;
        let mut factor = TriangularFactor::new(columns);
        let mut row = vec![0.0; columns];
        let mut operator_bounds = vec![(f64::INFINITY, f64::NEG_INFINITY); n];
        let (mut residuals, mut squares) = (Vec::new(), 0.0);
        for (place, record) in records.iter().enumerate() {
            let dt = record.dt().unwrap_or(chain.dt);
            let predicted = chain.response_in(place, record.input(), dt);
            let mut rows = tangent.rows(record.input(), dt, None);
            row[..means].fill(0.0);
            row[place] = 1.0;
            let mut slow = slow::Slow::of(record);
            let mut residual = Vec::with_capacity(record.fitted_samples());
            for (k, measured) in record.output().iter().enumerate().skip(record.skip()) {
                rows.write(k, &mut row[means..means + n]);
                slow.write(&mut row[means + n..columns - 1]);
                row[columns - 1] = measured - predicted[k];
                factor.push(&row);
                for ((low, high), z) in operator_bounds.iter_mut().zip(&row[means..]) {
                    (*low, *high) = (low.min(*z), high.max(*z));
                }
                residual.push(measured - predicted[k]);
            }
            residuals.push(centred(&residual));
            let output = centred(&record.output()[record.skip()..]);
            squares += as_f64(output.len()) * signal::rms(&output).powi(2);
        }
        let factor = factor.finish();
        Self { residuals, operator_bounds, thresholds, factor, output_norm: squares.sqrt() }
    }

    pub(super) fn operators(&self) -> usize {
        self.thresholds.len()
    }

    /// A slow change beside the operators.
    pub(super) fn slow_change(&self, records: &[Record<'_>], begins_wrong: bool) -> Option<Finding> {
        slow::change(&self.factor, records, begins_wrong)
    }

    fn is_moved(&self, operator: usize) -> bool {
        let (low, high) = self.operator_bounds[operator];
        low < high
    }

    /// Operators whose output is a constant.
    pub(super) fn unreached(&self) -> Option<Finding> {
        let still: Vec<f64> =
            (0..self.operators()).filter(|i| !self.is_moved(*i)).map(|i| self.thresholds[i]).collect();
        let smallest = still.iter().copied().fold(f64::INFINITY, f64::min);
        let message = format!(
            "{} of {} operators never move, thresholds from {smallest:.4} on: their weights are not determined",
            still.len(),
            self.operators()
        );
        let measured = Finding::new(FindingCode::UnreachedThreshold, as_f64(still.len()), 0.0, message);
        (!still.is_empty()).then_some(measured)
    }

    /// Operators that the record does not tell apart.
    pub(super) fn collinear(&self) -> Option<Finding> {
        const LIMIT: f64 = 1.0;
        // Singular values of unit columns are known to the rounding of the operators, about 1e-16.
        const SMALLEST_NOISE: f64 = 1e-9;
        let moved: Vec<usize> = (0..self.operators()).filter(|i| self.is_moved(*i)).collect();
        // Of the operators' outputs, each record's mean removed: all of it stands in as many rows as there are operators.
        let (means, rows) = (self.residuals.len(), self.operators());
        let column = |i: usize| (0..rows).map(|row| self.factor[(means + row, means + i)]).collect::<Vec<f64>>();
        let units: Vec<Vec<f64>> = moved.iter().map(|i| unit(&column(*i))).collect();
        let scaled = Mat::from_fn(rows, moved.len(), |row, i| units[i][row]);
        let smallest = scaled.singular_values().ok()?.into_iter().fold(f64::INFINITY, f64::min);
        let relative_noise = (self.residual_deviation() / self.output_norm).max(SMALLEST_NOISE);
        let value = as_f64(moved.len()) * relative_noise / smallest;
        let uncertain = if value.is_finite() {
            format!("uncertain by {value:.1} times what one contributes")
        } else {
            "not told".into()
        };
        let message = format!(
            "the record does not tell the {} operators apart: the least determined combination of them is {uncertain}; \
             their sum and the output are determined all the same",
            moved.len()
        );
        let measured = Finding::new(FindingCode::CollinearOperators, value, LIMIT, message);
        (moved.len() > 1 && value > LIMIT).then_some(measured)
    }

    /// The rms residual, widened for what correlated residuals add to the error of a mean.
    fn residual_deviation(&self) -> f64 {
        // What is correlated more changes too slowly for the operators to follow: drift, which has its own finding.
        const SLOWEST: f64 = 0.9;
        let samples: usize = self.residuals.iter().map(Vec::len).sum();
        let variance = |residual: &Vec<f64>| {
            let same = signal::neighbours(residual).clamp(0.0, SLOWEST);
            as_f64(residual.len()) * signal::rms(residual).powi(2) * (1.0 + same) / (1.0 - same)
        };
        (self.residuals.iter().map(variance).sum::<f64>() / as_f64(samples)).sqrt()
    }
}

fn centred(values: &[f64]) -> Vec<f64> {
    let mean = values.iter().sum::<f64>() / as_f64(values.len());
    values.iter().map(|value| value - mean).collect()
}

/// A column of length one; a column of zeros stays.
fn unit(column: &[f64]) -> Vec<f64> {
    let length = signal::rms(column) * as_f64(column.len()).sqrt();
    column.iter().map(|value| if length > 0.0 { value / length } else { 0.0 }).collect()
}
