//! How what is reported changes with what is fitted.

use hysteresis_control::linear::Dynamics;

use super::point::Parameter;
use super::projection::ProjectedFit;
use super::space::Space;
use super::weight_basis::WeightBasis;

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
    /// Of a mode by its number, 0 for the first one, or of a lag.
    Frequency(usize),
    Damping(usize),
    Gain(usize),
    /// Dead time and lags of amplifier and dynamics together.
    Lag,
    Creep(usize),
}

/// A quantity as a sum of fitted parameters, unknowns of the weights first, each with its factor. Known ones are left out.
pub(crate) type Gradient = Vec<(usize, f64)>;

/// The frequency of a mode, 0 for the first one, or of a lag.
pub(crate) fn log_frequency(mode: usize) -> Parameter {
    mode.checked_sub(1).map_or(Parameter::LogFrequency, Parameter::ModeLogFrequency)
}

pub(crate) fn log_damping(mode: usize) -> Parameter {
    mode.checked_sub(1).map_or(Parameter::LogDamping, Parameter::ModeLogDamping)
}

/// The gradients at a fit.
pub(crate) struct Gradients<'a> {
    pub(crate) fit: &'a ProjectedFit,
    pub(crate) basis: &'a WeightBasis,
    pub(crate) space: &'a Space,
}

impl Gradients<'_> {
    pub(crate) fn of(&self, quantity: Quantity) -> Gradient {
        let point = &self.fit.point;
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
            Quantity::Frequency(mode) => {
                let parameter = log_frequency(mode);
                self.searched(&[(parameter, point.get(parameter).exp())])
            }
            Quantity::Damping(mode) => {
                let parameter = log_damping(mode);
                self.searched(&[(parameter, point.get(parameter).exp())])
            }
            // The first mode has what the others leave.
            Quantity::Gain(0) => {
                let others: Vec<_> =
                    (1..self.space.modes()).map(|mode| (Parameter::ModeGain(mode - 1), -1.0)).collect();
                self.searched(&others)
            }
            Quantity::Gain(mode) => self.searched(&[(Parameter::ModeGain(mode - 1), 1.0)]),
            Quantity::Creep(number) => self.searched(&[(Parameter::Creep(number), 1.0)]),
            Quantity::Lag => self.searched(&self.slopes_of_lag()),
        }
    }

    /// How the lag of dead time, amplifier and dynamics changes.
    fn slopes_of_lag(&self) -> Vec<(Parameter, f64)> {
        let part = self.space.linear_part(&self.fit.point);
        let mut slopes = vec![(Parameter::DeadTime, 1.0), (Parameter::LogBandwidth, -part.amplifier_lag())];
        if let Some(Dynamics::FirstOrder(lag)) = part.dynamics {
            slopes.push((Parameter::LogFrequency, -lag.time_constant()));
        }
        let modes = part.modes();
        for (number, mode) in modes.iter().enumerate() {
            let lag = mode.gain * mode.lag();
            slopes.extend([(log_frequency(number), -lag), (log_damping(number), lag)]);
            if number > 0 {
                slopes.push((Parameter::ModeGain(number - 1), mode.lag() - modes[0].lag()));
            }
        }
        slopes
    }

    fn searched(&self, slopes: &[(Parameter, f64)]) -> Gradient {
        let (unknowns, axes) = (self.fit.unknowns.len(), self.space.axes());
        let place = |parameter| axes.iter().position(|axis| axis.parameter == parameter);
        slopes.iter().filter_map(|(parameter, slope)| Some((unknowns + place(*parameter)?, *slope))).collect()
    }
}
