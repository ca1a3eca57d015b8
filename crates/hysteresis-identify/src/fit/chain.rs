//! A fitted chain, and what it predicts.

use super::linear_part::LinearPart;
use super::own_columns::underway;
use super::regressor::OperatorsAt;
use super::response::response;
use crate::creep_model::CreepBasis;

/// What predicts: the operators and the loop shift with their weights, and what follows them.
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
