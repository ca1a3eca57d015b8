//! What is left of the identification of many actuators: small, and enough to run them.

use hysteresis_core::{Model, Ratios};

use crate::error::Error;
use crate::finding::{Finding, Severity, Verdict};
use crate::finding_code::FindingCode;
use crate::options::Options;

/// A finding without its sentence.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct BriefFinding {
    /// Which.
    pub code: FindingCode,
    /// Amber or red.
    pub severity: Severity,
    /// The number that was compared; what it is says [`FindingCode`].
    pub value: f64,
}

impl From<&Finding> for BriefFinding {
    fn from(found: &Finding) -> Self {
        Self { code: found.code, severity: found.severity, value: found.value }
    }
}

/// The model of one of many actuators, and how well it fits.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct ActuatorFit {
    /// The hysteresis, with its offsets: before the dead time.
    pub model: Model,
    /// The ratios of its thresholds.
    pub ratios: Ratios,
    /// What the output lags the input, in seconds; in samples where there is no sampling interval.
    pub dead_time: f64,
    /// The root mean square error over the fitted samples, in the unit of the output.
    pub rmse: f64,
    /// The largest error, in the unit of the output.
    pub max_error: f64,
    /// Peak-to-peak of the measured output over the fitted samples.
    pub range: f64,
    /// The standard deviation of the noise, as [`Identification::noise`](crate::Identification::noise) has it.
    pub noise: f64,
    /// What makes record or result doubtful: the codes that [`identify`](crate::identify()) finds without dynamics and creep.
    pub findings: Vec<BriefFinding>,
}

impl ActuatorFit {
    /// `rmse` / `range`.
    #[must_use]
    pub fn nrmse(&self) -> f64 {
        self.rmse / self.range
    }

    /// Whether the result deserves trust: the worst of its findings.
    #[must_use]
    pub fn verdict(&self) -> Verdict {
        self.findings.iter().map(|found| Verdict::from(found.severity)).max().unwrap_or(Verdict::Green)
    }
}

/// The identified actuators.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct ManyIdentifications {
    /// One for each actuator, or why it could not be fitted: [`Error::Record`] with its number.
    pub actuators: Vec<Result<ActuatorFit, Error>>,
    /// As asked for, with what was chosen for all actuators.
    pub options: Options,
}
