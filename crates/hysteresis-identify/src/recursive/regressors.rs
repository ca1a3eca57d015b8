//! What the unknown weights multiply: the operators of a model, and what the dynamics behind them make of each.

use hysteresis_control::linear::{Block, LinearBlock, LinearDynamics, LinearState};
use hysteresis_core::{
    CoupledPlay, MAX_MAGNITUDE, Model, ModifiedPrandtlIshlinskii, Offsets, Operator, Play, PrandtlIshlinskii,
};

use crate::error::Error;

/// The identity weight never falls below this share of that of the given model, so that an inverse exists.
pub const MIN_IDENTITY_SHARE: f64 = 1e-6;

/// Which part of an operator's output a weight counts for.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Side {
    Both,
    Above,
    Below,
}

/// One weight: of which operator, and of which part of it.
#[derive(Clone, Copy, Debug)]
struct Column {
    operator: usize,
    side: Side,
}

/// The columns of one row of the regressor but for that of an output offset: the weights first above, then below zero.
///
/// The weights enter linearly, so linear dynamics behind the hysteresis may act on every operator's output instead of
/// on their weighted sum.
#[derive(Clone, Debug)]
pub(crate) struct Regressors {
    operators: Box<[CoupledPlay]>,
    outputs: Box<[f64]>,
    columns: Box<[Column]>,
    /// One for each column, or none.
    lags: Box<[LinearBlock]>,
    /// The scale of the inputs: a power of two, so that scaling rounds nothing.
    scale: f64,
}

impl Regressors {
    /// At rest; and the weights of the model, one for each column.
    pub(crate) fn of_model(model: &Model, dynamics: Option<&(LinearDynamics, f64)>) -> Result<(Self, Vec<f64>), Error> {
        let (operators, above, below): (Box<[CoupledPlay]>, _, _) = match model {
            Model::Conventional(model) => {
                (model.operators().iter().map(|play| CoupledPlay::from(*play)).collect(), model.weights(), None)
            }
            Model::Modified(model) => {
                (model.operators().into(), model.weights(), model.is_split().then(|| model.weights_negative()))
            }
        };
        let (mut columns, mut weights, mut others) = (Vec::new(), Vec::new(), Vec::new());
        for (operator, w) in above.iter().enumerate() {
            let other = below.map(|below| below[operator]);
            // An identity that weighs the same on both sides is one straight line, and stays one.
            let one = other.is_none_or(|v| operators[operator].is_identity() && v == *w);
            columns.push(Column { operator, side: if one { Side::Both } else { Side::Above } });
            weights.push(*w);
            others.extend(other.filter(|_| !one).map(|v| (Column { operator, side: Side::Below }, v)));
        }
        columns.extend(others.iter().map(|(column, _)| *column));
        weights.extend(others.iter().map(|(_, v)| *v));
        let lags = match dynamics {
            Some((dynamics, dt)) => vec![dynamics.block(*dt)?; columns.len()],
            None => Vec::new(),
        };
        let outputs = operators.iter().map(|_| 0.0).collect();
        let scale = scale(&operators);
        Ok((Self { operators, outputs, columns: columns.into(), lags: lags.into(), scale }, weights))
    }

    /// How many weights there are.
    pub(crate) fn len(&self) -> usize {
        self.columns.len()
    }

    /// What a weight is multiplied with as an unknown.
    pub(crate) fn scale(&self) -> f64 {
        self.scale
    }

    /// Moves the operators to the input `x` and writes every column, in units of the scale.
    pub(crate) fn advance(&mut self, x: f64, mut write: impl FnMut(usize, f64)) {
        for (operator, z) in self.operators.iter().zip(&mut self.outputs) {
            *z = operator.next(*z, x);
        }
        let per_scale = self.scale.recip();
        let mut lags = self.lags.iter_mut();
        for (i, column) in self.columns.iter().enumerate() {
            let z = self.outputs[column.operator];
            let part = per_scale
                * match column.side {
                    Side::Both => z,
                    Side::Above => z.max(0.0),
                    Side::Below => z.min(0.0),
                };
            write(i, lags.next().map_or(part, |lag| lag.step(part)));
        }
    }

    /// The least that identities may weigh, and the most that all operators may: of a split operator the smaller and
    /// the greater weight.
    pub(crate) fn identity_and_sum(&self, weight: impl Fn(usize) -> f64) -> (f64, f64) {
        let n = self.operators.len();
        let mut others = (n..).zip(self.columns.iter().skip(n)).peekable();
        let (mut identity, mut sum) = (0.0, 0.0);
        for (i, operator) in self.operators.iter().enumerate() {
            let above = weight(i);
            let below = others.next_if(|(_, column)| column.operator == i).map_or(above, |(j, _)| weight(j));
            identity += if operator.is_identity() { above.min(below) } else { 0.0 };
            sum += above.max(below);
        }
        (identity, sum)
    }

    /// Zero for weights; above zero for the first identity of either side.
    pub(crate) fn lower_bounds(&self, weights: &[f64]) -> Vec<f64> {
        let mut lower = vec![0.0; self.columns.len()];
        for other in [Side::Below, Side::Above] {
            let identities = || {
                let counts = |column: &Column| column.side != other && self.operators[column.operator].is_identity();
                self.columns.iter().enumerate().filter(move |(_, column)| counts(column)).map(|(i, _)| i)
            };
            let identity: f64 = identities().map(|i| weights[i] * self.scale).sum();
            if let Some(first) = identities().next() {
                lower[first] = MIN_IDENTITY_SHARE * identity;
            }
        }
        lower
    }

    /// A model of these operators with other weights: its w_i, and its v_i if `given` is split.
    pub(crate) fn model(&self, given: &Model, weight: impl Fn(usize) -> f64, offsets: Offsets) -> Model {
        let n = self.operators.len();
        let above: Vec<f64> = (0..n).map(&weight).collect();
        let model = match given {
            Model::Conventional(given) => {
                let thresholds: Vec<f64> = given.operators().iter().map(Play::r).collect();
                PrandtlIshlinskii::new(&above, &thresholds, offsets).map(Model::from)
            }
            Model::Modified(given) => {
                let column = |threshold: fn(&CoupledPlay) -> f64| -> Vec<f64> {
                    given.operators().iter().map(threshold).collect()
                };
                let (r, ra) = (column(CoupledPlay::r), column(CoupledPlay::ra));
                let (rb, rc) = (column(CoupledPlay::rb), column(CoupledPlay::rc));
                let mut below = above.clone();
                for (i, column) in self.columns.iter().enumerate().skip(n) {
                    below[column.operator] = weight(i);
                }
                ModifiedPrandtlIshlinskii::new(&above, &r, &ra, &rb, &rc, offsets)
                    .and_then(|model| model.with_negative_weights(&below))
                    .map(Model::from)
            }
        };
        model.expect("admissible weights and the thresholds of a model")
    }

    pub(crate) fn reset(&mut self) {
        self.outputs.fill(0.0);
        for lag in &mut self.lags {
            lag.settle(0.0);
        }
    }

    /// The operators' outputs, and the states of the lags.
    pub(crate) fn state(&self) -> (Vec<f64>, Vec<LinearState>) {
        (self.outputs.to_vec(), self.lags.iter().map(LinearBlock::state).collect())
    }

    /// Whether there are as many numbers as [`state`](Self::state) gives, and those of the lags are finite.
    pub(crate) fn fits(&self, outputs: &[f64], lags: &[LinearState]) -> bool {
        let restores = |(lag, state): (&LinearBlock, _)| lag.clone().restore(state).is_ok();
        let as_many = outputs.len() == self.outputs.len() && lags.len() == self.lags.len();
        as_many && self.lags.iter().zip(lags).all(restores)
    }

    /// What fits.
    pub(crate) fn restore(&mut self, outputs: &[f64], lags: &[LinearState]) {
        self.outputs.copy_from_slice(outputs);
        for (lag, state) in self.lags.iter_mut().zip(lags) {
            lag.restore(state).expect("a state that fits");
        }
    }
}

/// The largest threshold, rounded up to a power of two; 1 without any.
fn scale(operators: &[CoupledPlay]) -> f64 {
    let largest = operators.iter().fold(0.0_f64, |largest, z| largest.max(z.r()).max(z.ra()));
    if largest > 0.0 { largest.max(MAX_MAGNITUDE.recip()).log2().ceil().exp2() } else { 1.0 }
}
