//! How far an estimate may be from the truth: standard errors, the covariance by name, and the spread of a prediction.
//!
//! All come from the root of the covariance and from how what is reported changes with what is fitted.

use faer::Mat;

use crate::fit::projection::ProjectedFit;
use crate::fit::space::Space;
use crate::fit::tangent::Tangent;
use crate::records::signal::as_f64;
use crate::terms::relaxing_plays::RelaxingColumns;
use crate::terms::weights::WeightBasis;
use crate::uncertainty::root::{Gradients, Quantity, Root};

/// Standard errors of what was identified: the square roots of the diagonal of (J'J)^-1 S (J'J)^-1, from the fit
/// linearised in weights and searched parameters together, J the derivatives of the output.
///
/// S is s^2 J'J for white residuals, s^2 the mean square error per degree of freedom. For others it is J' Omega J, with
/// Omega the covariance of an autoregressive process with the spectrum of the residuals. Where these follow lags of the
/// modelled output, as left-out creep and dynamics make them, S also has (J'd)(J'd)', with d what those lags add. The
/// errors of a dead time count the lag of left-out dynamics as part of it. What else follows the input and is not in
/// the model, such as a bend of the whole curve, is taken for noise: the truth may be several errors away then.
///
/// Zero for what was given. NaN for what lies at a bound (a weight of
/// zero, a ratio at its limit): it has no such error, and the others are those of the fit with it held there; and NaN
/// for a parameter that the data do not tell.
#[derive(Clone, Debug, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct StandardErrors {
    /// Of the weights w_i, in output unit per input unit.
    #[cfg_attr(feature = "serde", serde(with = "hysteresis_control::stage::number"))]
    pub weights: Vec<f64>,
    /// Of the weights v_i below zero; empty unless they are split.
    #[cfg_attr(feature = "serde", serde(with = "hysteresis_control::stage::number"))]
    pub weights_negative: Vec<f64>,
    /// Of ra/r, rb/r and rc/r.
    #[cfg_attr(feature = "serde", serde(with = "hysteresis_control::stage::number"))]
    pub ratios: [f64; 3],
    /// Of the input offset, in the unit of the input.
    #[cfg_attr(feature = "serde", serde(with = "hysteresis_control::stage::number"))]
    pub input_offset: f64,
    /// Of the dead time, in seconds; in samples for records without a sampling interval.
    #[cfg_attr(feature = "serde", serde(with = "hysteresis_control::stage::number"))]
    pub dead_time: f64,
    /// Of the frequency in Hz: of several modes, that of the first.
    #[cfg_attr(feature = "serde", serde(with = "hysteresis_control::stage::number"))]
    pub frequency: f64,
    /// Of the damping ratio, likewise.
    #[cfg_attr(feature = "serde", serde(with = "hysteresis_control::stage::number"))]
    pub damping: f64,
    /// Of frequency, damping ratio and gain of every mode, if there are several.
    #[cfg_attr(feature = "serde", serde(default, with = "hysteresis_control::stage::number"))]
    pub modes: Vec<[f64; 3]>,
    /// Of the lag of dynamics and dead time together, in the unit of the dead time.
    #[cfg_attr(feature = "serde", serde(with = "hysteresis_control::stage::number"))]
    pub lag: f64,
    /// Of the amplitudes of creep: of gamma for log-type creep, of every c_j for other.
    #[cfg_attr(feature = "serde", serde(with = "hysteresis_control::stage::number"))]
    pub creep: Vec<f64>,
    /// Of the amplitudes of the loop shift, in the unit of the output.
    #[cfg_attr(feature = "serde", serde(with = "hysteresis_control::stage::number"))]
    pub loop_shift: Vec<f64>,
    /// Of the weights of relaxing plays, a row for every time constant, in output unit per input unit.
    #[cfg_attr(feature = "serde", serde(default, with = "hysteresis_control::stage::number"))]
    pub relaxing_plays: Vec<Vec<f64>>,
    /// Of the amplitude of the slow gain, and of its time constant in seconds; zero without one.
    #[cfg_attr(feature = "serde", serde(default))]
    pub slow_gain: [f64; 2],
}

/// Bit for bit, so that equal results are equal where there is no error to tell.
impl PartialEq for StandardErrors {
    fn eq(&self, other: &Self) -> bool {
        let bits = |errors: &Self| {
            let lists = errors.weights.iter().chain(&errors.weights_negative).chain(&errors.creep);
            let lists = lists.chain(&errors.loop_shift).chain(errors.modes.iter().flatten());
            let lists = lists.chain(errors.relaxing_plays.iter().flatten());
            let Self { input_offset, dead_time, frequency, damping, lag, .. } = errors;
            let single = [input_offset, dead_time, frequency, damping, lag];
            lists.chain(&errors.ratios).chain(&errors.slow_gain).chain(single).map(|e| e.to_bits()).collect::<Vec<_>>()
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
        let weights: Vec<f64> = (0..fit.weights.len() - space.sides().len()).map(weight).collect();
        let amplitude = |j: usize| of(Quantity::Weight(weights.len() + j));
        let shifts = space.sides().of_any_sign;
        let loop_shift = (0..shifts).map(amplitude).collect();
        let of_play = |k: usize| weight(weights.len() + shifts + k);
        let in_use = |columns: &RelaxingColumns| columns.in_use(basis.relaxing(&fit.weights), of_play);
        let relaxing_plays = space.relaxing().map_or_else(Vec::new, in_use);
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
            relaxing_plays,
            slow_gain: [Quantity::SlowGain, Quantity::SlowGainTime].map(of),
        }
    }
}

/// The covariance of the parameters that were estimated, from the same linearisation as the
/// [`StandardErrors`](crate::StandardErrors).
///
/// What was given is left out, and so is what lies at a bound or is not told: it counts as known.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Covariance {
    /// The names, in the order of the rows: `weights[i]`, `weights_negative[i]`, `ra`, `rb`, `rc`, `input_offset`,
    /// `dead_time`, `frequency`, `damping`, `creep[j]`, `loop_shift[j]`, `relaxing_plays[j,i]`, `slow_gain`,
    /// `slow_gain_time_constant`, and `output_offset` of the first record. Several modes have `frequency[k]`,
    /// `damping[k]` and `gain[k]`, from the lowest frequency up.
    pub parameters: Vec<String>,
    /// The covariance, row by row, in the units of the parameters.
    #[cfg_attr(feature = "serde", serde(with = "hysteresis_control::stage::number"))]
    pub matrix: Vec<Vec<f64>>,
}

impl Covariance {
    pub(crate) fn new(fit: &ProjectedFit, root: &Root, basis: &WeightBasis, space: &Space) -> Self {
        let gradients = Gradients { fit, basis, space };
        let mut names = Vec::new();
        let mut roots: Vec<Vec<f64>> = Vec::new();
        for (name, quantity) in quantities(fit, basis, space) {
            let gradient = gradients.of(quantity);
            // A weight of zero is at its bound.
            let is_zero = matches!(quantity, Quantity::Weight(i) if fit.weights[i] == 0.0);
            if !gradient.is_empty() && !is_zero && (matches!(quantity, Quantity::Weight(_)) || root.tells(&gradient)) {
                names.push(name);
                roots.push(root.along(&gradient));
            }
        }
        names.push("output_offset".to_owned());
        roots.push(root.of_offset());
        let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let matrix = roots.iter().map(|a| roots.iter().map(|b| product(a, b)).collect()).collect();
        Self { parameters: names, matrix }
    }
}

fn quantities(fit: &ProjectedFit, basis: &WeightBasis, space: &Space) -> Vec<(String, Quantity)> {
    let (above, _) = basis.families(&fit.weights);
    let weights = fit.weights.len() - space.sides().len();
    let shifts = space.sides().of_any_sign;
    let name_of = |column| {
        let name = |plays: &RelaxingColumns| plays.name_of(basis.relaxing(&fit.weights), column);
        space.relaxing().map_or_else(String::new, name)
    };
    let weight = |i: usize| match (i.checked_sub(above.len()), i.checked_sub(weights)) {
        (_, Some(side)) => match side.checked_sub(shifts) {
            Some(column) => (name_of(column), Quantity::Weight(i)),
            None => (format!("loop_shift[{side}]"), Quantity::Weight(i)),
        },
        (None, _) => (format!("weights[{i}]"), Quantity::Weight(i)),
        (Some(below), _) => (format!("weights_negative[{below}]"), Quantity::Weight(i)),
    };
    let single = [
        ("ra", Quantity::Ra),
        ("rb", Quantity::Rb),
        ("rc", Quantity::Rc),
        ("input_offset", Quantity::InputOffset),
        ("dead_time", Quantity::DeadTime),
    ];
    let single = single.into_iter().map(|(name, quantity)| (name.to_owned(), quantity));
    let order: Vec<usize> = space.linear_part(&fit.point).in_order().into_iter().map(|(number, _)| number).collect();
    let of_mode = |(place, number): (usize, &usize)| {
        let named = [("frequency", Quantity::Frequency), ("damping", Quantity::Damping), ("gain", Quantity::Gain)]
            as [(&str, fn(usize) -> Quantity); 3];
        named.map(|(name, of)| (format!("{name}[{place}]"), of(*number)))
    };
    let one = [("frequency", Quantity::Frequency(0)), ("damping", Quantity::Damping(0))];
    let dynamics: Vec<_> = if order.len() > 1 {
        order.iter().enumerate().flat_map(of_mode).collect()
    } else {
        one.into_iter().map(|(name, quantity)| (name.to_owned(), quantity)).collect()
    };
    let creep = (0..space.creep_amplitudes()).map(|j| (format!("creep[{j}]"), Quantity::Creep(j)));
    let gain = [("slow_gain", Quantity::SlowGain), ("slow_gain_time_constant", Quantity::SlowGainTime)];
    let gain = gain.into_iter().map(|(name, quantity)| (name.to_owned(), quantity));
    (0..fit.weights.len()).map(weight).chain(single).chain(dynamics).chain(creep).chain(gain).collect()
}

/// What the covariance of all parameters makes of an output, linearised at the fit.
///
/// The output is g'p + o, with p the weights and searched parameters, o the output offset of the first record. So its
/// variance is
/// |X'(g, 1)|^2, with X X' the covariance of p and o that noise makes. Where the model lacks creep or dynamics, p moves so that it
/// predicts the records all the same: that is no error of what is predicted for records like them.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Spread {
    /// X, one row per weight, then one per axis.
    #[cfg_attr(feature = "serde", serde(with = "crate::saved::matrix"))]
    root: Mat<f64>,
    /// The row of the output offset.
    of_offset: Vec<f64>,
    tangent: Tangent,
}

impl Spread {
    pub(crate) fn new(fit: &ProjectedFit, root: &Root, basis: &WeightBasis, space: &Space) -> Self {
        let (unknowns, weights, axes) = (fit.unknowns.len(), fit.weights.len(), space.axes().len());
        let columns = root.of_noise();
        let of_parameter = |j: usize, k: usize| root.places[j].map_or(0.0, |place| root.x[(place, k)]);
        let of_weight = |i: usize, k: usize| (0..unknowns).map(|j| basis.derivative(i, j) * of_parameter(j, k)).sum();
        Self {
            root: Mat::from_fn(weights + axes, columns, |i, k| match i.checked_sub(weights) {
                None => of_weight(i, k),
                Some(axis) => of_parameter(unknowns + axis, k),
            }),
            of_offset: root.of_offset().into_iter().take(columns).collect(),
            tangent: space.tangent(&fit.point, weights, Some(&fit.weights)),
        }
    }

    /// About a tangent whose output is zero at the first sample of an input, with the root of the covariance of its
    /// weights and slopes.
    pub(crate) fn from_zero(root: Mat<f64>, tangent: Tangent, input: &[f64], dt: f64) -> Self {
        let mut first = vec![0.0; root.nrows()];
        tangent.rows(input, dt, None).write(0, &mut first);
        Self { of_offset: less(&first, &root), root, tangent }
    }

    /// The standard deviation of every sample of the output for an input that starts from the virgin state.
    pub(crate) fn of(&self, input: &[f64], dt: f64) -> Vec<f64> {
        self.beside(input, dt, &self.of_offset)
    }

    /// The same of the output about its mean over all samples.
    pub(crate) fn about_mean(&self, input: &[f64], dt: f64) -> Vec<f64> {
        let mut rows = self.tangent.rows(input, dt, None);
        let (mut gradient, mut mean) = (vec![0.0; self.root.nrows()], vec![0.0; self.root.nrows()]);
        for k in 0..input.len() {
            rows.write(k, &mut gradient);
            mean.iter_mut().zip(&gradient).for_each(|(mean, slope)| *mean += slope / as_f64(input.len()));
        }
        self.beside(input, dt, &less(&mean, &self.root))
    }

    /// The standard deviation of every sample of the output with an offset of this root.
    fn beside(&self, input: &[f64], dt: f64, of_offset: &[f64]) -> Vec<f64> {
        let mut rows = self.tangent.rows(input, dt, None);
        let mut gradient = vec![0.0; self.root.nrows()];
        let mut sums = of_offset.to_vec();
        let deviation = |k: usize| {
            rows.write(k, &mut gradient);
            for (j, (sum, of_offset)) in sums.iter_mut().zip(of_offset).enumerate() {
                let column = self.root.col(j);
                *sum = gradient.iter().enumerate().map(|(i, slope)| slope * column[i]).sum::<f64>() + of_offset;
            }
            sums.iter().map(|sum| sum * sum).sum::<f64>().sqrt()
        };
        (0..input.len()).map(deviation).collect()
    }
}

/// The root of an offset that takes an output with this gradient away.
fn less(gradient: &[f64], root: &Mat<f64>) -> Vec<f64> {
    let along = |k: usize| gradient.iter().enumerate().map(|(i, slope)| slope * root[(i, k)]).sum::<f64>();
    (0..root.ncols()).map(|k| -along(k)).collect()
}
