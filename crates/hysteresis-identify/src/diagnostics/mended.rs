//! Positions with something plausible in the place of what was left out.

use crate::fit::chain::Chain;
use crate::numeric::as_f64;
use crate::record::Record;

/// The position of every record, left-out samples replaced by the prediction and a straight line between the residuals about
/// them: what they were says nothing about the stage.
pub(super) fn mended_positions(records: &[Record<'_>], chain: &Chain) -> Vec<Vec<f64>> {
    let mend = |(place, record): (usize, &Record<'_>)| {
        let mut output = record.output().to_vec();
        let predicted = chain.response_in(place, record.input(), record.dt().unwrap_or(chain.dt));
        let left = |k: usize| record.output()[k] - predicted[k];
        let fitted: Vec<usize> = record.fitted().collect();
        for k in record.left_out() {
            let next = fitted.partition_point(|other| other < k);
            let (before, after) = (next.checked_sub(1).map(|place| fitted[place]), fitted.get(next).copied());
            let residual = match (before, after) {
                (Some(p), Some(q)) => left(p) + (left(q) - left(p)) * as_f64(k - p) / as_f64(q - p),
                (one, other) => one.or(other).map_or(0.0, left),
            };
            output[*k] = predicted[*k] + residual;
        }
        output
    };
    records.iter().enumerate().map(mend).collect()
}

/// The same records with these positions, of which nothing is left out.
pub(super) fn with_positions<'a>(records: &[Record<'a>], positions: &'a [Vec<f64>]) -> Vec<Record<'a>> {
    // What is fitted varies and what is predicted is finite: no position is refused.
    records.iter().zip(positions).map(|(record, position)| record.with_output(position).unwrap_or(*record)).collect()
}
