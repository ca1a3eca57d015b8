//! A model at a point with its tangent: what rows are made of.

use crate::fit::response::OperatorsAt;
use crate::terms::dynamics::LinearPart;

/// How the derivative by a searched parameter is made.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) enum Slope {
    /// By a parameter of the operators or of the maps and the amplifier beside them: those of a neighbour, and how far
    /// away it is.
    Operators(OperatorsAt, f64),
    /// By the bandwidth of the amplifier: the operators of a neighbour, the dynamics that it has, and how far away it
    /// is.
    Amplifier(OperatorsAt, LinearPart, f64),
    /// By the dead time.
    DeadTime,
    /// By a parameter of the dynamics: those of a neighbour, and how far away it is.
    Dynamics(LinearPart, f64),
    /// By an amplitude of creep: what its unit makes of every c_j.
    Creep(Vec<f64>),
}

/// The model at a point with its tangent: the columns of the weights, and the derivatives by the searched parameters.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Tangent {
    pub(crate) operators: OperatorsAt,
    pub(crate) linear: LinearPart,
    /// How many columns there are.
    pub(crate) columns: usize,
    /// One for each column: those at which derivatives and the slope of an output map are taken; none where there are
    /// neither.
    pub(crate) weights: Vec<f64>,
    pub(crate) slopes: Vec<Slope>,
}
