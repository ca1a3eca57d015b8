//! Where a stage comes from and how far it can be trusted.

use serde::{Deserialize, Deserializer, Serialize, Serializer};

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
    /// "amber", or "red" where the stage is not to be used; files that do not say it have "amber".
    #[serde(default = "amber")]
    pub severity: String,
    /// What it says, in one sentence.
    pub message: String,
    /// The number on which it rests.
    #[serde(with = "number")]
    pub value: f64,
    /// The limit that the number broke.
    #[serde(with = "number")]
    pub limit: f64,
    /// What to try next.
    pub hint: String,
}

fn amber() -> String {
    "amber".into()
}

/// What identification knows of a stage besides its parts. Two are equal if they are written to files alike: then a number
/// that was not determined is equal to itself.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Identified {
    /// The lowest and the highest drive of the records.
    pub drive_range: (f64, f64),
    /// The lowest and the highest position of the records, which may hold ringing and noise; what the stage reaches is
    /// [`Stage::position_range`](super::Stage::position_range).
    pub position_range: (f64, f64),
    /// The sampling intervals of the records, in seconds; empty if they are not known.
    pub dt: Vec<f64>,
    /// Root mean square of the residual, in the unit of the position.
    #[serde(with = "number")]
    pub rmse: f64,
    /// The largest residual, in the unit of the position.
    #[serde(with = "number")]
    pub max_error: f64,
    /// The names of the parameters that the covariance counts.
    pub parameters: Vec<String>,
    /// The covariance of the parameters, row by row.
    #[serde(with = "numbers")]
    pub covariance: Vec<Vec<f64>>,
    /// What makes numbers doubtful.
    pub warnings: Vec<StageWarning>,
    /// The records.
    pub records: Vec<RecordSource>,
}

impl PartialEq for Identified {
    fn eq(&self, other: &Self) -> bool {
        // Serialising plain numbers and strings into memory has no way to fail.
        serde_json::to_string(self).ok() == serde_json::to_string(other).ok()
    }
}

/// A number that may be infinite or none at all: JSON has no word for those, so they are written as text. Bytes have the number
/// itself.
#[derive(Clone, Copy, Serialize, Deserialize)]
#[serde(untagged)]
enum AnyNumber {
    Finite(f64),
    Other(Other),
}

#[derive(Clone, Copy, Serialize, Deserialize)]
enum Other {
    #[serde(rename = "inf")]
    Infinite,
    #[serde(rename = "-inf")]
    MinusInfinite,
    #[serde(rename = "nan")]
    NotANumber,
}

impl From<f64> for AnyNumber {
    fn from(number: f64) -> Self {
        if number.is_finite() {
            Self::Finite(number)
        } else if number.is_nan() {
            Self::Other(Other::NotANumber)
        } else {
            Self::Other(if number > 0.0 { Other::Infinite } else { Other::MinusInfinite })
        }
    }
}

impl From<AnyNumber> for f64 {
    fn from(number: AnyNumber) -> Self {
        match number {
            AnyNumber::Finite(number) => number,
            AnyNumber::Other(Other::Infinite) => f64::INFINITY,
            AnyNumber::Other(Other::MinusInfinite) => f64::NEG_INFINITY,
            AnyNumber::Other(Other::NotANumber) => f64::NAN,
        }
    }
}

mod number {
    use super::{AnyNumber, Deserialize, Deserializer, Serialize, Serializer};

    #[expect(clippy::trivially_copy_pass_by_ref, reason = "as serde calls it")]
    pub(super) fn serialize<S: Serializer>(number: &f64, serializer: S) -> Result<S::Ok, S::Error> {
        if !serializer.is_human_readable() {
            return number.serialize(serializer);
        }
        AnyNumber::from(*number).serialize(serializer)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
        if !deserializer.is_human_readable() {
            return f64::deserialize(deserializer);
        }
        AnyNumber::deserialize(deserializer).map(f64::from)
    }
}

mod numbers {
    use super::{AnyNumber, Deserialize, Deserializer, Serialize, Serializer};

    pub(super) fn serialize<S: Serializer>(rows: &[Vec<f64>], serializer: S) -> Result<S::Ok, S::Error> {
        if !serializer.is_human_readable() {
            return rows.serialize(serializer);
        }
        let rows: Vec<Vec<AnyNumber>> =
            rows.iter().map(|row| row.iter().map(|x| AnyNumber::from(*x)).collect()).collect();
        rows.serialize(serializer)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<Vec<f64>>, D::Error> {
        if !deserializer.is_human_readable() {
            return Vec::deserialize(deserializer);
        }
        let rows = Vec::<Vec<AnyNumber>>::deserialize(deserializer)?;
        Ok(rows.into_iter().map(|row| row.into_iter().map(f64::from).collect()).collect())
    }
}
