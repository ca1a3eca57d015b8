//! A stage from what was identified.

use hysteresis_control::linear::LinearDynamics;
use hysteresis_control::stage::{self, Identified, Stage, StageParts, StageWarning};
use hysteresis_core::Error as CoreError;

use super::identification::Identification;
use crate::finding::Finding;

impl Identification {
    /// The stage: hysteresis, creep, dynamics and dead time, with the ranges of the records, the quality of the fit, the
    /// covariance and the findings. Its noise is that of the residuals. It has no limits of its own: what is made from it stays
    /// within the drives of the records.
    ///
    /// # Errors
    /// [`stage::Error`] that names `dt` for records without a sampling interval.
    pub fn stage(&self) -> Result<Stage, stage::Error> {
        let Some(dead_time) = self.dead_time else { return Err(CoreError::Empty { parameter: "dt" }.into()) };
        Stage::new(StageParts {
            dynamics: self.dynamics.map_or_else(LinearDynamics::none, LinearDynamics::from),
            creep: self.creep.clone(),
            dead_time,
            noise: Some(self.noise),
            identified: Some(self.identified()),
            ..StageParts::new(self.model.clone().into())
        })
    }

    fn identified(&self) -> Identified {
        Identified {
            drive_range: self.drive_range,
            position_range: self.position_range,
            dt: self.dt.clone(),
            rmse: self.fit.rmse,
            max_error: self.fit.max_error,
            parameters: self.covariance.parameters.clone(),
            covariance: self.covariance.matrix.clone(),
            warnings: self.warnings.iter().map(StageWarning::from).collect(),
            records: Vec::new(),
        }
    }
}

impl From<&Finding> for StageWarning {
    fn from(finding: &Finding) -> Self {
        Self {
            code: finding.code.name().into(),
            message: finding.message.clone(),
            value: finding.value,
            limit: finding.limit,
            hint: finding.hint.into(),
        }
    }
}
