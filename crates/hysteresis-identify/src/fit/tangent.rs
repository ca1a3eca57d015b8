//! The output of the model and its derivatives, row by row.
#![expect(clippy::inline_always, reason = "what is called must be compiled for the instructions of the caller")]

use pulp::{Arch, Simd, WithSimd};

use super::filtered_rows::FilteredRows;
use super::linear_part::LinearPart;
use super::regressor::{OperatorsAt, Regressor};

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
    /// The rows of a record, before the first; `dt` in the unit of the dead time.
    pub(crate) fn rows<'a>(&'a self, input: &'a [f64], dt: f64) -> TangentRows<'a> {
        let dead_time_alone = self.linear.is_dead_time_alone();
        let is_plain = dead_time_alone && self.linear.dead_time >= 0.0;
        let rows = if is_plain {
            Rows::Plain(Box::new(PlainRows::new(self, input, dt)))
        } else {
            Rows::Filtered(Box::new(FilteredRows::new(self, input, dt, Arch::new())))
        };
        TangentRows { rows, arch: Arch::new() }
    }
}

/// The rows of one record: \[columns | derivatives\].
pub(crate) struct TangentRows<'a> {
    rows: Rows<'a>,
    arch: Arch,
}

enum Rows<'a> {
    /// Hysteresis and a dead time: between rows only the turns of the input need to be seen.
    Plain(Box<PlainRows<'a>>),
    /// With dynamics or creep every sample counts.
    Filtered(Box<FilteredRows<'a>>),
}

impl TangentRows<'_> {
    /// Goes to a sample, not before the last one, and writes its row, with the widest instructions of the processor. `turns` as
    /// for [`Regressor::go_to`]. Returns what is known beside the columns, as [`Regressor::row`].
    pub(crate) fn write(&mut self, sample: usize, turns: Option<&[usize]>, row: &mut [f64]) -> f64 {
        match &mut self.rows {
            Rows::Plain(rows) => self.arch.dispatch(Write { rows, sample, turns, row }),
            Rows::Filtered(rows) => rows.write(sample, row),
        }
    }
}

/// See [`TangentRows::write`].
struct Write<'r, 'a> {
    rows: &'r mut PlainRows<'a>,
    sample: usize,
    turns: Option<&'r [usize]>,
    row: &'r mut [f64],
}

impl WithSimd for Write<'_, '_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> f64 {
        self.rows.write(self.sample, self.turns, self.row)
    }
}

/// See [`Rows::Plain`].
struct PlainRows<'a> {
    tangent: &'a Tangent,
    dt: f64,
    here: Regressor<'a>,
    there: Vec<Option<(Regressor<'a>, f64)>>,
}

impl<'a> PlainRows<'a> {
    fn new(tangent: &'a Tangent, input: &'a [f64], dt: f64) -> Self {
        let delay = tangent.linear.dead_time / dt;
        let start = |at: &'a OperatorsAt| Regressor::new(at, input, delay, dt);
        let there = |slope: &'a Slope| match slope {
            Slope::Operators(at, distance) => Some((start(at), *distance)),
            _ => None,
        };
        Self { tangent, dt, here: start(&tangent.operators), there: tangent.slopes.iter().map(there).collect() }
    }

    #[inline(always)]
    fn write(&mut self, sample: usize, turns: Option<&[usize]>, row: &mut [f64]) -> f64 {
        let weights = &self.tangent.weights;
        let (columns, slopes) = row.split_at_mut(self.tangent.columns);
        self.here.go_to(sample, turns);
        let known = self.here.row(weights, columns);
        if slopes.is_empty() {
            return known;
        }
        let output = self.here.output(weights);
        for (slope, there) in slopes.iter_mut().zip(&mut self.there) {
            *slope = match there {
                Some((there, distance)) => {
                    there.go_to(sample, turns);
                    (there.output(weights) - output) / *distance
                }
                // Only the dead time has no neighbour here: an amplifier comes with dynamics.
                None => self.here.slope_over_delay(weights) / self.dt,
            };
        }
        known
    }
}
