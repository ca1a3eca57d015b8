//! How far an estimate may be from the truth, given what the fit leaves.

use crate::fit::gradients::{Gradients, Quantity};
use crate::fit::projection::ProjectedFit;
use crate::fit::root::Root;
use crate::fit::space::Space;
use crate::fit::weight_basis::WeightBasis;

/// Standard errors of what was identified: the square roots of the diagonal of (J'J)^-1 S (J'J)^-1, from the fit linearised in
/// weights and searched parameters together, J the derivatives of the output.
///
/// S is s^2 J'J for white residuals, s^2 the mean square error per degree of freedom. For others it is J' Omega J, with Omega the
/// covariance of an autoregressive process with the spectrum of the residuals. Where these follow lags of the modelled output, as
/// left-out creep and dynamics make them, S also has (J'd)(J'd)', with d what those lags add. The errors of a dead time count
/// the lag of left-out dynamics as part of it. What else follows the input and is not in the model, such as a bend of the whole
/// curve, is taken for noise: the truth may be several errors away then.
///
/// Zero for what was given. NaN for what lies at a bound (a weight of
/// zero, a ratio at its limit): it has no such error, and the others are those of the fit with it held there; and NaN
/// for a parameter that the data do not tell.
#[derive(Clone, Debug, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct StandardErrors {
    /// Of the weights w_i, in output unit per input unit.
    pub weights: Vec<f64>,
    /// Of the weights v_i below zero; empty unless they are split.
    pub weights_negative: Vec<f64>,
    /// Of ra/r, rb/r and rc/r.
    pub ratios: [f64; 3],
    /// Of the input offset, in the unit of the input.
    pub input_offset: f64,
    /// Of the dead time, in seconds; in samples for records without a sampling interval.
    pub dead_time: f64,
    /// Of the frequency in Hz: of several modes, that of the first.
    pub frequency: f64,
    /// Of the damping ratio, likewise.
    pub damping: f64,
    /// Of frequency, damping ratio and gain of every mode, if there are several.
    #[cfg_attr(feature = "serde", serde(default))]
    pub modes: Vec<[f64; 3]>,
    /// Of the lag of dynamics and dead time together, in the unit of the dead time.
    pub lag: f64,
    /// Of the amplitudes of creep: of gamma for log-type creep, of every c_j for other.
    pub creep: Vec<f64>,
    /// Of the amplitudes of the loop shift, in the unit of the output.
    pub loop_shift: Vec<f64>,
}

/// Bit for bit, so that equal results are equal where there is no error to tell.
impl PartialEq for StandardErrors {
    fn eq(&self, other: &Self) -> bool {
        let bits = |errors: &Self| {
            let lists = errors.weights.iter().chain(&errors.weights_negative).chain(&errors.creep);
            let lists = lists.chain(&errors.loop_shift).chain(errors.modes.iter().flatten());
            let Self { input_offset, dead_time, frequency, damping, lag, .. } = errors;
            let single = [input_offset, dead_time, frequency, damping, lag];
            lists.chain(&errors.ratios).chain(single).map(|e| e.to_bits()).collect::<Vec<_>>()
        };
        let lengths =
            |errors: &Self| [errors.weights.len(), errors.creep.len(), errors.loop_shift.len(), errors.modes.len()];
        lengths(self) == lengths(other) && bits(self) == bits(other)
    }
}

impl StandardErrors {
    /// The same with the errors of other dynamics, and of the dead time and the lag with them.
    pub(crate) fn with_dynamics_of(self, other: Self) -> Self {
        let Self { dead_time, frequency, damping, modes, lag, .. } = other;
        Self { dead_time, frequency, damping, modes, lag, ..self }
    }

    pub(crate) fn of(fit: &ProjectedFit, root: &Root, basis: &WeightBasis, space: &Space) -> Self {
        let gradients = Gradients { fit, basis, space };
        let of = |quantity| root.error_of(&gradients.of(quantity));
        // An identity weighs no less than it may.
        let is_inside = |i: usize| fit.weights[i] > 0.0 && !(basis.is_identity(i) && fit.unknowns[0] == 0.0);
        let weight = |i: usize| if is_inside(i) { of(Quantity::Weight(i)) } else { f64::NAN };
        let weights: Vec<f64> = (0..fit.weights.len() - space.shift_len()).map(weight).collect();
        let amplitude = |j: usize| of(Quantity::Weight(weights.len() + j));
        let loop_shift = (0..space.shift_len()).map(amplitude).collect();
        let order = space.linear_part(&fit.point).in_order();
        let first = order.first().map_or(0, |(number, _)| *number);
        let of_mode = |number| [Quantity::Frequency(number), Quantity::Damping(number), Quantity::Gain(number)].map(of);
        let modes = order.iter().filter(|_| order.len() > 1).map(|(number, _)| of_mode(*number));
        let (above, below) = basis.families(&weights);
        Self {
            weights: above.to_vec(),
            weights_negative: below.unwrap_or(&[]).to_vec(),
            ratios: [of(Quantity::Ra), of(Quantity::Rb), of(Quantity::Rc)],
            input_offset: of(Quantity::InputOffset),
            dead_time: of(Quantity::DeadTime),
            frequency: of(Quantity::Frequency(first)),
            damping: of(Quantity::Damping(first)),
            modes: modes.collect(),
            lag: of(Quantity::Lag),
            creep: (0..space.creep_amplitudes()).map(|number| of(Quantity::Creep(number))).collect(),
            loop_shift,
        }
    }
}
