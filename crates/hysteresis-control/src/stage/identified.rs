//! Where a stage comes from and how far it can be trusted.

use serde::{Deserialize, Serialize};

/// The units in which a stage counts. Nothing is converted: they are names, shown wherever a number is.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Units {
    /// Of drives.
    pub drive: String,
    /// Of positions.
    pub position: String,
}

impl Default for Units {
    fn default() -> Self {
        Self { drive: "V".into(), position: "um".into() }
    }
}

/// A record that the stage was identified from.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecordSource {
    /// The name of the file, or of the record.
    pub name: String,
    /// SHA-256 of its bytes, in hexadecimal digits; nothing for what was no file.
    pub sha256: Option<String>,
}

/// A finding of the identification that makes some number doubtful.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StageWarning {
    /// The name of the finding.
    pub code: String,
    /// What it says, in one sentence.
    pub message: String,
    /// The number on which it rests.
    pub value: f64,
    /// The limit that the number broke.
    pub limit: f64,
    /// What to try next.
    pub hint: String,
}

/// What identification knows of a stage besides its parts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Identified {
    /// The lowest and the highest drive of the records.
    pub drive_range: (f64, f64),
    /// The lowest and the highest position of the records.
    pub position_range: (f64, f64),
    /// The sampling intervals of the records, in seconds; empty if they are not known.
    pub dt: Vec<f64>,
    /// Root mean square of the residual, in the unit of the position.
    pub rmse: f64,
    /// The largest residual, in the unit of the position.
    pub max_error: f64,
    /// The names of the parameters that the covariance counts.
    pub parameters: Vec<String>,
    /// The covariance of the parameters, row by row.
    pub covariance: Vec<Vec<f64>>,
    /// What makes numbers doubtful.
    pub warnings: Vec<StageWarning>,
    /// The records.
    pub records: Vec<RecordSource>,
}
