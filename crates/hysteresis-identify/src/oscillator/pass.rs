//! One pass of an oscillator over the record, with the derivatives of every sample.

use faer::Mat;
use hysteresis_control::oscillator::Hold;
use hysteresis_control::oscillator::drive::FineDrive;
use hysteresis_control::oscillator::equation::{Equation, Scalar, State};

use super::data::{Data, Part};
use super::dual::Dual;
use crate::records::signal::{as_f64, bounds};

/// b, c, k, then f+ and f- at every knot; an output offset; and the knots. Without knots the oscillator is linear: b,
/// c, k.
#[derive(Clone, Debug)]
pub(super) struct Point {
    pub(super) knots: Vec<f64>,
    pub(super) parameters: Vec<f64>,
    pub(super) offset: f64,
}

/// The numbers of knots that are tried.
pub(super) const KNOTS: [usize; 3] = [3, 5, 9];

impl Point {
    fn equation<S: Scalar>(&self, parameter: impl Fn(usize) -> S) -> Equation<S> {
        let linear = [parameter(0), parameter(1), parameter(2)];
        let n = self.knots.len();
        if n == 0 {
            let none = [S::constant(0.0); 2];
            return Equation::new(linear, &[-1.0, 1.0], &none, &none);
        }
        let (rising, falling): (Vec<S>, Vec<S>) = (0..n).map(|i| (parameter(3 + i), parameter(3 + n + i))).unzip();
        Equation::new(linear, &self.knots, &rising, &falling)
    }

    pub(super) fn rising(&self) -> &[f64] {
        &self.parameters[3..3 + self.knots.len()]
    }

    pub(super) fn falling(&self) -> &[f64] {
        &self.parameters[3 + self.knots.len()..]
    }
}

/// The drive on its sub-steps.
pub(super) struct Excitation<'a> {
    pub(super) data: &'a Data,
    fine: FineDrive,
    sub_step: f64,
}

/// What a pass with derivatives finds.
#[derive(Clone)]
pub(super) struct Linearised {
    /// y - offset - model, over the fitted samples.
    pub(super) residual: Vec<f64>,
    /// The derivatives of the model by the parameters, and by the offset.
    pub(super) jacobian: Mat<f64>,
    pub(super) squares: f64,
    /// The least and the largest z.
    pub(super) range: (f64, f64),
}

impl<'a> Excitation<'a> {
    /// By samples of a drive, that of the record or another, with so many sub-steps in a sample. A period comes again.
    pub(super) fn new(data: &'a Data, input: &[f64], hold: Hold, sub_steps: usize) -> Self {
        let fine = FineDrive::new(input, hold, data.periods > 1, sub_steps);
        Self { data, fine, sub_step: data.dt / as_f64(sub_steps) }
    }

    /// Shows every state at a sample, after a period to settle if the drive repeats. False if the motion leaves all
    /// bounds.
    fn run<S: Scalar>(&self, equation: &Equation<S>, mut visit: impl FnMut(usize, &State<S>)) -> bool {
        let (mut state, settle) = (State::rest(), usize::from(self.data.periods > 1));
        for period in 0..=settle {
            for k in 0..self.data.u.len() {
                if period == settle {
                    visit(k, &state);
                }
                state = self.fine.sub_steps(k).fold(state, |state, u| equation.step(&state, self.sub_step, u));
                if !hysteresis_core::is_admissible(state.position.value()) {
                    return false;
                }
            }
        }
        true
    }

    /// Position, without offset, velocity and z at every sample. None if the motion leaves all bounds.
    pub(super) fn states(&self, point: &Point) -> Option<Vec<State<f64>>> {
        let equation = point.equation(|i| point.parameters[i]);
        let mut states = Vec::with_capacity(self.data.u.len());
        self.run(&equation, |_, state| states.push(*state)).then_some(states)
    }

    /// The positions, without offset.
    pub(super) fn response(&self, point: &Point) -> Option<Vec<f64>> {
        Some(self.states(point)?.iter().map(|state| state.position).collect())
    }

    /// The least and the largest z.
    pub(super) fn range(&self, point: &Point) -> Option<(f64, f64)> {
        Some(bounds(&self.states(point)?.iter().map(|state| state.hysteresis).collect::<Vec<_>>()))
    }

    /// y - offset - model over the samples of a part.
    pub(super) fn residual(&self, point: &Point, part: Part) -> Option<Vec<f64>> {
        let positions = self.response(point)?;
        Some(self.data.samples(part).map(|k| self.data.y[k] - point.offset - positions[k]).collect())
    }

    /// A pass with derivatives. None if the motion leaves all bounds.
    pub(super) fn linearise(&self, point: &Point, part: Part) -> Option<Linearised> {
        match point.knots.len() {
            0 => self.with::<3>(point, part),
            3 => self.with::<9>(point, part),
            5 => self.with::<13>(point, part),
            _ => self.with::<21>(point, part),
        }
    }

    fn with<const P: usize>(&self, point: &Point, part: Part) -> Option<Linearised> {
        let equation = point.equation(|i| Dual::<P>::parameter(point.parameters[i], i));
        let (mut residual, mut rows) = (Vec::new(), Vec::new());
        let mut range = (f64::INFINITY, f64::NEG_INFINITY);
        let finite = self.run(&equation, |k, state| {
            let z = state.hysteresis.value();
            range = (range.0.min(z), range.1.max(z));
            if self.data.holds(part, k) {
                residual.push(self.data.y[k] - point.offset - state.position.value());
                rows.push(*state.position.tangent());
            }
        });
        let jacobian = Mat::from_fn(rows.len(), P + 1, |i, j| rows[i].get(j).copied().unwrap_or(1.0));
        let squares: f64 = residual.iter().map(|e| e * e).sum();
        (finite && squares.is_finite()).then_some(Linearised { residual, jacobian, squares, range })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tangents_are_those_of_differences() {
        let u: Vec<f64> = (0..300_u32).map(f64::from).map(|k| (0.05 * k).sin() + (0.21 * k).cos()).collect();
        let data = Data::new(&u, &u, 0.1, None, 0).unwrap();
        let excitation = Excitation::new(&data, &u, Hold::Zero, 4);
        let parameters = vec![0.7, 0.3, 0.5, 1.5, 1.0, 0.5, 0.6, 1.1, 1.4];
        let point = Point { knots: vec![-1.0, 0.0, 1.0], parameters, offset: 0.1 };
        let found = excitation.linearise(&point, Part::All).unwrap();
        assert_eq!(found.residual, excitation.residual(&point, Part::All).unwrap());
        let moved = |i: usize, by: f64| {
            let mut there = point.clone();
            if let Some(parameter) = there.parameters.get_mut(i) {
                *parameter += by;
            } else {
                there.offset += by;
            }
            excitation.residual(&there, Part::All).unwrap()
        };
        for i in 0..10 {
            let (more, less) = (moved(i, 1e-6), moved(i, -1e-6));
            for k in 0..300 {
                let difference = (less[k] - more[k]) / 2e-6;
                assert!((found.jacobian[(k, i)] - difference).abs() < 1e-6, "{i} {k} {difference}");
            }
        }
    }
}
