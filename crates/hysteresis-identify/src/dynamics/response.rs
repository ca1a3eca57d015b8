//! The simulated response, its linear coefficients, and its derivatives.

use faer::Mat;
use hysteresis_control::linear::{self, Block, Dynamics, FirstOrder, SecondOrder};

use super::options::Order;
use crate::fit::factor::TriangularFactor;
use crate::numeric::as_f64;

/// The step of a central difference in the logarithm of frequency or damping: its own error and that of rounding are
/// both about 1e-10 of the derivative.
const DIFFERENCE_STEP: f64 = 1e-5;

/// A column is taken as dependent on those before it if what is left of it is below this share of its norm.
pub(super) const MIN_INDEPENDENT_SHARE: f64 = 1e-11;

/// Below this share of the sum of squares of the output the errors are rounding.
const ROUNDING_SQUARES: f64 = 1e-28;

/// A parameter that enters the response nonlinearly.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(usize)]
pub(super) enum LinearParameter {
    LogFrequency,
    LogDamping,
    Delay,
}

/// A value for every [`LinearParameter`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LinearPoint([f64; 3]);

impl LinearPoint {
    pub(super) fn new(frequency: f64, damping: f64, delay: f64) -> Self {
        Self([frequency.ln(), damping.ln(), delay])
    }

    pub(super) fn get(&self, parameter: LinearParameter) -> f64 {
        self.0[parameter as usize]
    }

    pub(super) fn with(mut self, parameter: LinearParameter, value: f64) -> Self {
        self.0[parameter as usize] = value;
        self
    }

    /// The dynamics at this point.
    pub(super) fn dynamics(&self, order: Order) -> Result<Dynamics, linear::Error> {
        let frequency = self.get(LinearParameter::LogFrequency).exp();
        Ok(match order {
            Order::First => FirstOrder::new(frequency)?.into(),
            Order::Second => SecondOrder::new(frequency, self.get(LinearParameter::LogDamping).exp())?.into(),
        })
    }
}

/// The best linear coefficients at a point.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ResponseFit {
    pub(super) point: LinearPoint,
    /// Offset, gain, and gain times the amplitude of each term of creep.
    pub(super) coefficients: Vec<f64>,
    /// The sum of squared errors over the fitted samples.
    pub(super) squares: f64,
}

/// y(k) = offset + gain (1 + sum_k c_k lag_k) G v(k - delay), with v and y counted from their first values.
///
/// Everything is at rest before the record, at its first value.
pub(super) struct ResponseProblem<'a> {
    pub(super) order: Order,
    pub(super) dt: f64,
    /// The output of the hysteresis less its first value.
    pub(super) input: Vec<f64>,
    pub(super) output: &'a [f64],
    /// The first output, taken off so that a large offset costs no digits.
    pub(super) reference: f64,
    pub(super) skip: usize,
    /// The lags of creep.
    pub(super) lags: Vec<FirstOrder>,
    /// The searched parameters.
    pub(super) axes: Vec<LinearParameter>,
}

impl ResponseProblem<'_> {
    /// How many coefficients enter linearly.
    pub(super) fn coefficients(&self) -> usize {
        2 + self.lags.len()
    }

    /// How many unknowns there are.
    pub(super) fn unknowns(&self) -> usize {
        self.coefficients() + self.axes.len()
    }

    /// A sum of squared errors that is nothing but rounding.
    pub(super) fn rounding_squares(&self) -> f64 {
        let squares: f64 = self.output[self.skip..].iter().map(|y| (y - self.reference) * (y - self.reference)).sum();
        ROUNDING_SQUARES * squares
    }

    /// The response of the dynamics alone, without delay.
    pub(super) fn response(&self, point: &LinearPoint) -> Result<Vec<f64>, linear::Error> {
        let mut block = point.dynamics(self.order)?.block(self.dt)?;
        Ok(self.input.iter().map(|v| block.advance(*v)).collect())
    }

    /// The offset's, the gain's and the creep terms' columns.
    fn columns(&self, response: Vec<f64>) -> Result<Vec<Vec<f64>>, linear::Error> {
        let mut columns = vec![vec![1.0; response.len()]];
        let creeping = self.lags.iter().map(|lag| lagged(&response, *lag, self.dt)).collect::<Result<Vec<_>, _>>()?;
        columns.push(response);
        columns.extend(creeping);
        Ok(columns)
    }

    /// The exact least-squares coefficients at a point.
    pub(super) fn fit(&self, point: &LinearPoint) -> Result<ResponseFit, linear::Error> {
        let columns = self.columns(delayed(&self.response(point)?, point.get(LinearParameter::Delay)))?;
        let triangle = self.triangle(&columns);
        let coefficients = solve(&triangle, columns.len());
        let residual = triangle[(columns.len(), columns.len())];
        Ok(ResponseFit { point: *point, coefficients, squares: residual * residual })
    }

    /// The sum of squares that is left without dynamics: two neighbouring whole delays of the input in any proportion,
    /// which stand for any delay next to `lag` samples, with creep and offset.
    pub(super) fn squares_without_dynamics(&self, lag: f64) -> Result<f64, linear::Error> {
        let lag = lag.floor().min(as_f64(self.input.len() - 1));
        let mut columns = self.columns(delayed(&self.input, lag))?;
        columns.push(delayed(&self.input, lag + 1.0));
        let residual = self.triangle(&columns)[(columns.len(), columns.len())];
        Ok(residual * residual)
    }

    /// y less its prediction, over the fitted samples.
    pub(super) fn residuals(&self, fit: &ResponseFit) -> Result<Vec<f64>, linear::Error> {
        let columns = self.columns(delayed(&self.response(&fit.point)?, fit.point.get(LinearParameter::Delay)))?;
        let residual = |k: usize| {
            let predicted: f64 = columns.iter().zip(&fit.coefficients).map(|(column, c)| c * column[k]).sum();
            self.output[k] - self.reference - predicted
        };
        Ok((self.skip..self.input.len()).map(residual).collect())
    }

    /// The triangle of the columns of the coefficients, the derivatives by the axes, and the output.
    ///
    /// `cell` is the whole delay below which the delay does not go: on a whole delay the derivative is the one above.
    pub(super) fn linearise(&self, fit: &ResponseFit, cell: f64) -> Result<Mat<f64>, linear::Error> {
        let point = &fit.point;
        let response = self.response(point)?;
        let mut columns = self.columns(delayed(&response, point.get(LinearParameter::Delay)))?;
        for axis in &self.axes {
            let derivative = match axis {
                LinearParameter::Delay => {
                    let (early, late) = (delayed(&response, cell), delayed(&response, cell + 1.0));
                    early.iter().zip(late).map(|(early, late)| late - early).collect()
                }
                LinearParameter::LogFrequency | LinearParameter::LogDamping => {
                    let value = point.get(*axis);
                    let above = self.response(&point.with(*axis, value + DIFFERENCE_STEP))?;
                    let below = self.response(&point.with(*axis, value - DIFFERENCE_STEP))?;
                    let slope = |(above, below): (&f64, f64)| (above - below) / (2.0 * DIFFERENCE_STEP);
                    let slopes: Vec<f64> = above.iter().zip(below).map(slope).collect();
                    delayed(&slopes, point.get(LinearParameter::Delay))
                }
            };
            columns.push(self.creeping(&derivative, &fit.coefficients[1..])?);
        }
        Ok(self.triangle(&columns))
    }

    /// A signal with gain and creep applied.
    fn creeping(&self, signal: &[f64], gains: &[f64]) -> Result<Vec<f64>, linear::Error> {
        let mut sum: Vec<f64> = signal.iter().map(|s| gains[0] * s).collect();
        for (lag, gain) in self.lags.iter().zip(&gains[1..]) {
            for (sum, lagged) in sum.iter_mut().zip(lagged(signal, *lag, self.dt)?) {
                *sum += gain * lagged;
            }
        }
        Ok(sum)
    }

    /// The triangle of the fitted rows, the output last.
    fn triangle(&self, columns: &[Vec<f64>]) -> Mat<f64> {
        let mut factor = TriangularFactor::new(columns.len() + 1);
        let mut row = vec![0.0; columns.len() + 1];
        for k in self.skip..self.input.len() {
            for (place, column) in row.iter_mut().zip(columns) {
                *place = column[k];
            }
            row[columns.len()] = self.output[k] - self.reference;
            factor.push(&row);
        }
        factor.finish()
    }
}

/// R x = the last column, for the first `unknowns` columns; zero for those that depend on the ones before.
fn solve(triangle: &Mat<f64>, unknowns: usize) -> Vec<f64> {
    let last = triangle.ncols() - 1;
    let mut x = vec![0.0; unknowns];
    for i in (0..unknowns).rev() {
        let tail: f64 = (i + 1..unknowns).map(|j| triangle[(i, j)] * x[j]).sum();
        if is_independent(triangle, i) {
            x[i] = (triangle[(i, last)] - tail) / triangle[(i, i)];
        }
    }
    x
}

/// Whether a column is more than a sum of those before it.
pub(super) fn is_independent(triangle: &Mat<f64>, column: usize) -> bool {
    triangle[(column, column)].abs() > MIN_INDEPENDENT_SHARE * triangle.col(column).norm_l2()
}

/// The signal `delay` samples later, straight between samples; zero before its first sample.
pub(super) fn delayed(signal: &[f64], delay: f64) -> Vec<f64> {
    let share = delay.fract();
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 <= delay < length of the record")]
    let whole = delay as usize;
    let at = |k: usize, back: usize| if k >= back { signal[k - back] } else { 0.0 };
    let between = |k| if share == 0.0 { at(k, whole) } else { (1.0 - share) * at(k, whole) + share * at(k, whole + 1) };
    (0..signal.len()).map(between).collect()
}

fn lagged(signal: &[f64], lag: FirstOrder, dt: f64) -> Result<Vec<f64>, linear::Error> {
    let mut block = lag.block(dt)?;
    Ok(signal.iter().map(|s| block.advance(*s)).collect())
}
