//! A fitted chain, and what it predicts.

use super::linear_part::LinearPart;
use super::regressor::OperatorsAt;
use super::response::response;

/// What predicts: the operators and the loop shift with their weights, and what follows them.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Chain {
    pub(crate) operators: OperatorsAt,
    pub(crate) weights: Vec<f64>,
    pub(crate) linear: LinearPart,
    /// The sampling interval of records that have none of their own, in seconds; 1, in samples, if none is known.
    pub(crate) dt: f64,
}

impl Chain {
    /// The output but for the output offset.
    pub(crate) fn response(&self, input: &[f64], dt: f64) -> Vec<f64> {
        response(&self.operators, &self.weights, &self.linear, input, dt)
    }
}
