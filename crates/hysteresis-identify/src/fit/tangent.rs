//! The output of the model and its derivatives, row by row.

use super::course::Course;
use super::filtered_rows::FilteredRows;
use super::linear_part::LinearPart;
use super::plain_rows::PlainRows;
use super::regressor::OperatorsAt;

/// How the derivative by a searched parameter is made.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) enum Slope {
    /// By a parameter of the operators or of the maps and the amplifier beside them: those of a neighbour, and how far away it
    /// is.
    Operators(OperatorsAt, f64),
    /// By the bandwidth of the amplifier: the operators of a neighbour, the dynamics that it has, and how far away it is.
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
    /// One for each column: those at which derivatives and the slope of an output map are taken; none where there are neither.
    pub(crate) weights: Vec<f64>,
    pub(crate) slopes: Vec<Slope>,
}

impl Tangent {
    /// The rows of a record, before the first; `dt` in the unit of the dead time. With a course they are those of its samples, one after the
    /// other; without, those of any.
    pub(crate) fn rows<'a>(&'a self, input: &'a [f64], dt: f64, course: Option<&'a Course>) -> TangentRows<'a> {
        let dead_time_alone = self.linear.is_dead_time_alone();
        let is_plain = dead_time_alone && self.linear.dead_time >= 0.0;
        if is_plain {
            TangentRows::Plain(Box::new(PlainRows::new(self, input, dt, course)))
        } else {
            TangentRows::Filtered(Box::new(FilteredRows::new(self, input, dt)))
        }
    }
}

/// The rows of one record: \[columns | derivatives\], with the widest instructions of the processor.
pub(crate) enum TangentRows<'a> {
    /// Hysteresis and a dead time: between rows only the turns of the input need to be seen.
    Plain(Box<PlainRows<'a>>),
    /// With dynamics or creep every sample counts.
    Filtered(Box<FilteredRows<'a>>),
}

impl TangentRows<'_> {
    /// Goes to a sample, not before the last one, and writes its row. Returns what is known beside the columns: zero
    /// without an output map.
    pub(crate) fn write(&mut self, sample: usize, row: &mut [f64]) -> f64 {
        match self {
            Self::Plain(rows) => rows.write(sample, row),
            Self::Filtered(rows) => rows.write(sample, row),
        }
    }
}
