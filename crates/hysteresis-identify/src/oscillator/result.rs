//! What the identification of an oscillator returns.

use faer::Mat;
use hysteresis_control::oscillator::HystereticOscillator;

use super::descent::Fit;
use crate::algebra::factor::{back_substitute, triangle_of};
use crate::fit::colour::{Autoregression, Colour, RowFilter};
use crate::judge::finding::{Finding, Verdict};
use crate::judge::finding_code::FindingCode;
use crate::judge::residual::{coloured, poor_fit};
use crate::records::signal::as_f64;

/// An oscillator with hysteresis inside, and how well it follows its record.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct OscillatorIdentification {
    /// The oscillator.
    pub model: HystereticOscillator,
    /// What is added to its position, in the unit of y.
    pub output_offset: f64,
    /// The sampling interval in seconds.
    pub dt: f64,
    /// What the drive does between samples: "zero" or `"band_limited"`.
    pub hold: String,
    /// The number of integration steps in a sampling interval.
    pub sub_steps: usize,
    /// The number of periods that were averaged; 1 if the record does not repeat.
    pub periods: usize,
    /// The rms error over all fitted samples, of the mean of the periods: noise included.
    pub rms: f64,
    /// That of the best linear oscillator, fitted to the same samples.
    pub linear_rms: f64,
    /// The rms error of the chosen number of knots over samples to which it was not fitted.
    pub held_out_rms: f64,
    /// Standard deviation of the noise of a measured sample, if several periods tell it.
    pub noise: Option<f64>,
    /// Whether the knots cover all of z over the record: beyond them f is extrapolated.
    pub covered: bool,
    /// Standard errors of b, c, k, f+ and f- at the knots, and the output offset, for noise with the spectrum of what
    /// the fit leaves; infinite where the record does not tell a parameter.
    pub standard_errors: Vec<f64>,
    /// The linear oscillator and every number of knots that was tried.
    pub tried: Vec<OscillatorTrial>,
    /// What makes the numbers doubtful.
    pub warnings: Vec<Finding>,
    /// How many passes over the record the search took.
    pub evaluations: usize,
}

/// A model that was tried.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct OscillatorTrial {
    /// The number of knots; 0 is the linear oscillator.
    pub knots: usize,
    /// The number of parameters, the output offset included.
    pub parameters: usize,
    /// The rms error over the samples that it was fitted to.
    pub fitted_rms: f64,
    /// The rms error over those held out.
    pub held_out_rms: f64,
}

impl OscillatorIdentification {
    /// Whether the result deserves trust: the worst of its [`warnings`](Self::warnings).
    #[must_use]
    pub fn verdict(&self) -> Verdict {
        Verdict::of(&self.warnings)
    }

    /// The standard errors of f+ and of f- at the knots.
    #[must_use]
    pub fn of_slopes(&self) -> (&[f64], &[f64]) {
        let slopes = &self.standard_errors[3..self.standard_errors.len() - 1];
        slopes.split_at(slopes.len() / 2)
    }

    /// The numbers as a text: the model, its parameters with their standard errors, and what was tried.
    #[must_use]
    pub fn summary(&self) -> String {
        let operator = self.model.hysteresis();
        let (knots, count) = (operator.knots().count(), self.standard_errors.len());
        let mut lines = vec![format!("Oscillator with hysteresis inside, {knots} knots, {count} parameters")];
        let values = [self.model.gain(), self.model.damping(), self.model.stiffness()];
        let named = ["gain b", "damping c (1/s)", "stiffness k (1/s^2)"].into_iter().zip(values);
        for ((name, value), error) in named.zip(&self.standard_errors) {
            lines.push(format!("  {name:<20} {value:>13.6e} +- {error:.1e}"));
        }
        let (rising, falling) = self.of_slopes();
        let slopes = operator.rising().zip(rising).zip(operator.falling().zip(falling));
        for (z, ((up, up_error), (down, down_error))) in operator.knots().zip(slopes) {
            let slopes = format!("f+ {up:>12.5e} +- {up_error:.1e}, f- {down:>12.5e} +- {down_error:.1e}");
            lines.push(format!("  z = {z:>12.5e}:  {slopes}"));
        }
        let noise = self.noise.map_or_else(String::new, |noise| format!(", noise of a sample {noise:.3e}"));
        lines.push(format!("Error {:.3e} rms over {} period(s){noise}; drive: {}", self.rms, self.periods, self.hold));
        if !self.covered {
            lines.push("z goes beyond the knots: f there is extrapolated".to_owned());
        }
        lines.push("Tried:    knots  parameters  fitted rms  held-out rms".to_owned());
        for OscillatorTrial { knots, parameters, fitted_rms, held_out_rms } in &self.tried {
            let mark = if *held_out_rms == self.held_out_rms { "  <- chosen" } else { "" };
            let name = if *knots == 0 { "linear".to_owned() } else { knots.to_string() };
            lines.push(format!("  {name:>13}  {parameters:>10}  {fitted_rms:>10.3e}  {held_out_rms:>12.3e}{mark}"));
        }
        lines.extend(self.warnings.iter().map(ToString::to_string));
        lines.join("\n")
    }
}

/// The held-out error of a model with hysteresis is at most this share of that of the linear oscillator.
const LESS_THAN_LINEAR: f64 = 0.9;

/// What makes a result doubtful: what the chosen model leaves, and whether the linear oscillator, the first that was
/// tried, predicts as well.
pub(super) fn findings(residual: &[f64], range: f64, tried: &[OscillatorTrial], chosen: usize) -> Vec<Finding> {
    let (linear, held_out) = (tried[0].held_out_rms, tried[chosen].held_out_rms);
    let message =
        format!("over samples that were not fitted it is {held_out:.3e} off, a linear oscillator {linear:.3e}");
    let code = FindingCode::HysteresisInsideNotTold;
    let hint = "the hysteresis is of another kind, or there is more than one mode, or a dead time: this model has one \
                mode and none";
    let told = Finding::new(code, held_out / linear, LESS_THAN_LINEAR, message);
    let coloured = coloured(Colour::new(residual, range), range).map(|finding| finding.try_next(hint.to_owned()));
    let findings = [poor_fit(residual, range).try_next(hint.to_owned()), told];
    // Without any error at all there is nothing to compare.
    findings.into_iter().filter(|finding| finding.value > finding.limit).chain(coloured).collect()
}

/// Standard errors from the derivatives J at the end of a fit: the roots of the diagonal of (J'J)^-1 J' Omega J
/// (J'J)^-1, Omega the covariance of an autoregressive process with the spectrum of what the fit leaves.
pub(super) fn standard_errors(fit: &Fit) -> Vec<f64> {
    let jacobian = &fit.at.jacobian;
    let (rows, columns) = (jacobian.nrows(), jacobian.ncols());
    // Columns of unit size, as their units differ by many orders.
    let norms: Vec<f64> = (0..columns).map(|j| jacobian.col(j).norm_l2()).collect();
    // The record tells nothing of a parameter that moves no sample.
    let told: Vec<usize> = (0..columns).filter(|j| norms[*j] > 0.0).collect();
    let count = told.len();
    let entry = |i: usize, j: usize| jacobian[(i, told[j])] / norms[told[j]];
    let colour = Autoregression::of(&fit.at.residual);
    let mut filter = RowFilter::new(&colour, count);
    let mut coloured = Mat::zeros(rows, count);
    for i in 0..rows {
        let row: Vec<f64> = (0..count).map(|j| entry(i, j)).collect();
        filter.coloured(&row).iter().enumerate().for_each(|(j, value)| coloured[(i, j)] = *value);
    }
    let triangle = triangle_of(Mat::from_fn(rows, count, entry));
    let mut inverse = Mat::zeros(count, count);
    for j in 0..count {
        let column = inverse.col_as_slice_mut(j);
        column[j] = 1.0;
        back_substitute(triangle.as_ref(), column);
    }
    let root = triangle_of(coloured) * &inverse * inverse.transpose();
    let freedom = as_f64(rows) / as_f64(rows.saturating_sub(count).max(1));
    let mut errors = vec![f64::INFINITY; columns];
    for (place, j) in told.into_iter().enumerate() {
        let error = freedom.sqrt() * root.col(place).norm_l2() / norms[j];
        errors[j] = if error.is_finite() { error } else { f64::INFINITY };
    }
    errors
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::oscillator::pass::{Linearised, Point};

    #[test]
    fn a_parameter_that_the_record_does_not_tell_spoils_no_other() {
        let fit = |columns: usize, place: &dyn Fn(usize) -> Option<i32>| {
            let entry = |i: usize, j: usize| place(j).map_or(0.0, |power| (0.1 * as_f64(i)).powi(power));
            let jacobian = Mat::from_fn(20, columns, entry);
            let point = Point { knots: Vec::new(), parameters: vec![0.0; columns - 1], offset: 0.0 };
            let residual = (0..20).map(|i| if i % 2 == 0 { 0.1 } else { -0.1 }).collect();
            let at = Linearised { residual, jacobian, squares: 0.2, range: (0.0, 0.0) };
            standard_errors(&Fit { point, at, passes: 1 })
        };
        // A straight line and a parabola: the errors of its coefficients.
        let alone = fit(3, &|j| [Some(0), Some(1), Some(2)][j]);
        let beside = fit(4, &|j| [Some(0), None, Some(1), Some(2)][j]);
        assert_eq!(beside, [alone[0], f64::INFINITY, alone[1], alone[2]]);
        assert!(alone.iter().all(|error| error.is_finite() && *error > 0.0));
    }
}
