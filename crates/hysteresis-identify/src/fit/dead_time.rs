//! Whether a dead time beside dynamics is told by the records.

use super::gradients::{Gradients, Quantity};
use super::joint::{JointFit, JointProblem};
use super::monitor::SearchMonitor;
use super::point::Parameter;
use super::root::Root;
use crate::colour::Colour;
use crate::error::Error;
use crate::numeric::as_f64;
use crate::record::Record;

/// A dead time must lower the sum of squares by this many variances of the noise: three standard errors.
const MIN_EVIDENCE: f64 = 9.0;

/// A dead time of so many standard errors is told without a fit that has none.
const SURE: f64 = 20.0;

/// A negative dead time that is shorter, in samples, is none: a record that is off by a row has -1.
pub(crate) const MIN_NEGATIVE_SAMPLES: f64 = 0.5;

/// Below this, in samples, a dead time is rounding.
const ROUNDING: f64 = 1e-6;

impl JointProblem<'_> {
    /// The fit with no dead time, unless the records tell one; and the standard error of the dead time in samples, widened for
    /// correlated residuals, or not a number if it cannot be told at all. No error where none is searched beside dynamics.
    pub(crate) fn settle_dead_time(
        &self,
        found: JointFit,
        monitor: &mut SearchMonitor<'_>,
    ) -> Result<(JointFit, Option<f64>), Error> {
        let searched = found.space.order().is_some() && found.space.axis(Parameter::DeadTime).is_some();
        if !searched {
            return Ok((found, None));
        }
        let rows = found.rows(self.records);
        let root = Root::of(&found.fit, &found.linearised, &found.space, rows);
        let spread = self.colour(&found).correlation_time.sqrt();
        let dt = found.space.intervals().smallest();
        let gradients = Gradients { fit: &found.fit, basis: self.basis, space: &found.space };
        let error = root.error_of(&gradients.of(Quantity::DeadTime));
        let samples = found.fit.point.get(Parameter::DeadTime) / dt;
        let deviations = samples * dt / (error * spread);
        if samples > 0.0 && deviations > SURE {
            return Ok((found, Some(error * spread / dt)));
        }
        let none = self.with_dead_time(&found, 0.0, monitor)?;
        let gained = (none.fit.objective - found.fit.objective) / (root.deviation * spread).powi(2);
        let told =
            gained > MIN_EVIDENCE && samples.abs() > ROUNDING && !(-MIN_NEGATIVE_SAMPLES..0.0).contains(&samples);
        Ok((if told { found } else { none }, Some(error * spread / dt)))
    }

    /// How the residuals of all records follow from each other.
    pub(crate) fn colour(&self, found: &JointFit) -> Colour {
        let of_record = |(record, residual): (&Record<'_>, Vec<f64>)| {
            (Colour::new(&residual, record.output_range()), as_f64(record.fitted_samples()))
        };
        Colour::pooled(&self.records.iter().zip(self.residuals(found)).map(of_record).collect::<Vec<_>>())
    }

    /// By how many variances of the noise of each record one fit lowers the sums of squares of another, all together.
    pub(crate) fn evidence(&self, without: &JointFit, with: &JointFit) -> f64 {
        self.evidence_between(self.residuals(without), self.residuals(with)).into_iter().sum()
    }

    /// The same for each record, from the residuals.
    pub(super) fn evidence_between(
        &self,
        without: impl Iterator<Item = Vec<f64>>,
        with: impl Iterator<Item = Vec<f64>>,
    ) -> Vec<f64> {
        let squares = |values: &[f64]| values.iter().map(|value| value * value).sum::<f64>();
        let pairs = without.zip(with);
        let of_record = |(record, (without, with)): (&Record<'_>, (Vec<f64>, Vec<f64>))| {
            let colour = Colour::new(&with, record.output_range());
            let noise = squares(&with) / as_f64(with.len()) * colour.correlation_time;
            if noise > 0.0 { (squares(&without) - squares(&with)) / noise } else { 0.0 }
        };
        self.records.iter().zip(pairs).map(of_record).collect()
    }

    /// What a fit leaves of the fitted samples of every record.
    pub(crate) fn residuals(&self, found: &JointFit) -> impl Iterator<Item = Vec<f64>> {
        let chain = found.chain(1.0);
        self.records.iter().enumerate().map(move |(place, record)| {
            let predicted = chain.response_in(place, record.input(), found.space.intervals().of_record(place));
            let left = |k: usize| record.output()[k] - predicted[k] - found.fit.output_offsets[place];
            record.fitted().map(left).collect()
        })
    }
}
