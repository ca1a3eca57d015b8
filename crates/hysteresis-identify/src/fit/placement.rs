//! Where the thresholds lie.

use super::course::turns;
use crate::numeric::as_f64;
use crate::options::{ModelKind, Options, Thresholds};
use crate::record::Record;

/// Reversals nearer to each other than this share of the range count once.
const MERGED: f64 = 0.01;

/// The smallest threshold of geometric ones over the reach, and the largest factor between neighbours.
const SMALLEST: f64 = 0.01;
const OCTAVE: f64 = 2.0;

/// What the thresholds are made of.
#[derive(Clone)]
pub(crate) struct Placement {
    model: ModelKind,
    thresholds: Thresholds,
    /// The smallest and the largest input.
    low: f64,
    high: f64,
    /// The inputs at the reversals of every record, if the thresholds are made of them.
    reversals: Vec<Vec<f64>>,
}

impl Placement {
    pub(crate) fn new(records: &[Record<'_>], options: &Options) -> Self {
        let bounds = records.iter().map(Record::input_bounds);
        let (low, high) =
            bounds.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), (from, to)| (low.min(from), high.max(to)));
        let thresholds = options.thresholds.clone();
        let reversals = match thresholds {
            Thresholds::Quantiles(_) => records.iter().map(|record| reversals(record, MERGED * (high - low))).collect(),
            _ => Vec::new(),
        };
        Self { model: options.model, thresholds, low, high, reversals }
    }

    /// The smallest and the largest input.
    pub(crate) fn bounds(&self) -> (f64, f64) {
        (self.low, self.high)
    }

    /// The thresholds r_i for an input offset.
    pub(crate) fn thresholds(&self, offset: f64) -> Vec<f64> {
        let reach = match self.model {
            ModelKind::Modified => (self.high - offset).abs().max((self.low - offset).abs()),
            ModelKind::Conventional => 0.5 * (self.high - self.low),
        };
        match &self.thresholds {
            // Cross-validation puts a number in place of this before a space is made.
            Thresholds::Auto
            | Thresholds::AutoQuantiles
            | Thresholds::AutoGeometric
            | Thresholds::Refined
            | Thresholds::RefinedQuantiles
            | Thresholds::RefinedGeometric => Vec::new(),
            Thresholds::Given(thresholds) => thresholds.clone(),
            Thresholds::Uniform(n) => (0..*n).map(|i| as_f64(i) * reach / as_f64(*n)).collect(),
            Thresholds::Geometric(n) => geometric(*n, reach),
            Thresholds::Quantiles(n) => {
                let knots = self.amplitudes(offset, reach);
                (0..*n).map(|i| interpolated(&knots, as_f64(i) / as_f64(*n))).collect()
            }
        }
    }

    /// Zero, the amplitudes of the reversals in growing order and well apart, and the reach.
    fn amplitudes(&self, offset: f64, reach: f64) -> Vec<f64> {
        let mut amplitudes: Vec<f64> = match self.model {
            ModelKind::Modified => self.reversals.iter().flatten().map(|x| (x - offset).abs()).collect(),
            ModelKind::Conventional => {
                self.reversals.iter().flat_map(|x| x.windows(2).map(|x| 0.5 * (x[1] - x[0]).abs())).collect()
            }
        };
        amplitudes.sort_by(f64::total_cmp);
        let mut knots = vec![0.0];
        for amplitude in amplitudes {
            if amplitude - knots[knots.len() - 1] > MERGED * reach && amplitude < (1.0 - MERGED) * reach {
                knots.push(amplitude);
            }
        }
        knots.push(reach);
        knots
    }
}

/// Zero, and thresholds of which each is smaller than the next by the same factor, the reach behind the last.
fn geometric(n: usize, reach: f64) -> Vec<f64> {
    let factor = SMALLEST.recip().powf(1.0 / as_f64(n.saturating_sub(1).max(1))).min(OCTAVE);
    (0..n).map(|i| if i == 0 { 0.0 } else { reach / factor.powf(as_f64(n - i)) }).collect()
}

/// About the same weights at other thresholds: each is shared by the two next to it, so that sum and mean threshold stay.
pub(crate) fn spread(weights: &[f64], from: &[f64], to: &[f64]) -> Vec<f64> {
    let mut spread = vec![0.0; to.len()];
    for (weight, r) in weights.iter().zip(from) {
        let above = to.partition_point(|other| other <= r).clamp(1, to.len().max(2) - 1);
        let [Some(low), Some(high)] = [above - 1, above].map(|place| to.get(place)) else {
            spread[0] += weight;
            continue;
        };
        let share = ((r - low) / (high - low)).clamp(0.0, 1.0);
        spread[above - 1] += (1.0 - share) * weight;
        spread[above] += share * weight;
    }
    spread
}

fn reversals(record: &Record<'_>, dead_band: f64) -> Vec<f64> {
    turns(record.input(), dead_band).into_iter().map(|k| record.input()[k]).collect()
}

/// The value a share of the way through evenly spaced knots, straight between them.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a place among the knots")]
fn interpolated(knots: &[f64], share: f64) -> f64 {
    let place = share * as_f64(knots.len() - 1);
    let below = (place as usize).min(knots.len() - 2);
    knots[below] + (place - as_f64(below)) * (knots[below + 1] - knots[below])
}
