//! How what is reported changes with what is fitted.

use core::f64::consts::TAU;

use super::point::Parameter;
use super::projection::ProjectedFit;
use super::space::Space;
use super::weight_basis::WeightBasis;
use crate::options::Order;

/// What is reported of a fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Quantity {
    /// The weight of a column.
    Weight(usize),
    Ra,
    Rb,
    Rc,
    InputOffset,
    DeadTime,
    Frequency,
    Damping,
    /// Dead time and lags of amplifier and dynamics together.
    Lag,
    Creep(usize),
}

/// A quantity as a sum of fitted parameters, unknowns of the weights first, each with its factor. Known ones are left out.
pub(crate) type Gradient = Vec<(usize, f64)>;

/// The gradients at a fit.
pub(crate) struct Gradients<'a> {
    pub(crate) fit: &'a ProjectedFit,
    pub(crate) basis: &'a WeightBasis,
    pub(crate) space: &'a Space,
}

impl Gradients<'_> {
    pub(crate) fn of(&self, quantity: Quantity) -> Gradient {
        let point = &self.fit.point;
        let frequency = point.get(Parameter::LogFrequency).exp();
        let damping = point.get(Parameter::LogDamping).exp();
        match quantity {
            Quantity::Weight(i) => (0..self.fit.unknowns.len())
                .map(|j| (j, self.basis.derivative(i, j)))
                .filter(|(_, slope)| *slope != 0.0)
                .collect(),
            Quantity::Ra => self.searched(&[(Parameter::Ra, 1.0)]),
            // rb is searched as its share of ra.
            Quantity::Rb => self.searched(&[
                (Parameter::Ra, point.get(Parameter::RbShare)),
                (Parameter::RbShare, point.get(Parameter::Ra)),
            ]),
            Quantity::Rc => self.searched(&[(Parameter::Rc, 1.0)]),
            Quantity::InputOffset => self.searched(&[(Parameter::InputOffset, 1.0)]),
            Quantity::DeadTime => self.searched(&[(Parameter::DeadTime, 1.0)]),
            Quantity::Frequency => self.searched(&[(Parameter::LogFrequency, frequency)]),
            Quantity::Damping => self.searched(&[(Parameter::LogDamping, damping)]),
            Quantity::Creep(number) => self.searched(&[(Parameter::Creep(number), 1.0)]),
            Quantity::Lag => {
                // 1 / w, or 2 zeta / w
                let lag = match self.space.order() {
                    None => 0.0,
                    Some(Order::First) => 1.0 / (TAU * frequency),
                    Some(Order::Second) => 2.0 * damping / (TAU * frequency),
                };
                let slopes = [
                    (Parameter::DeadTime, 1.0),
                    (Parameter::LogBandwidth, -self.space.linear_part(point).amplifier_lag()),
                    (Parameter::LogFrequency, -lag),
                    (Parameter::LogDamping, lag),
                ];
                self.searched(&slopes)
            }
        }
    }

    fn searched(&self, slopes: &[(Parameter, f64)]) -> Gradient {
        let (unknowns, axes) = (self.fit.unknowns.len(), self.space.axes());
        let place = |parameter| axes.iter().position(|axis| axis.parameter == parameter);
        slopes.iter().filter_map(|(parameter, slope)| Some((unknowns + place(*parameter)?, *slope))).collect()
    }
}
