//! A value in a file of JSON that names its schema.

use std::fmt;

use hysteresis_core::Error;
use serde::Deserialize;
use serde::de::DeserializeOwned;

/// Why a saved value cannot be read.
#[derive(Debug)]
#[non_exhaustive]
pub enum FileError {
    /// It is no JSON of this form.
    Json(serde_json::Error),
    /// It is of another schema, if of any.
    Schema {
        /// The schema of such a value.
        expected: &'static str,
        /// What the file has.
        got: Option<String>,
    },
    /// It holds a number that no such value may have.
    Value(Error),
}

impl fmt::Display for FileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Json(error) => error.fmt(f),
            Self::Schema { expected, got: Some(got) } => write!(f, "schema: expected {expected:?}, got {got:?}"),
            Self::Schema { expected, got: None } => write!(f, "schema: expected {expected:?}, got none"),
            Self::Value(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for FileError {}

impl From<serde_json::Error> for FileError {
    fn from(error: serde_json::Error) -> Self {
        Self::Json(error)
    }
}

/// The schema that a text names, if any. It is read first, alone, so that a text of another schema is called just that.
pub(crate) fn schema_of(text: &str) -> Result<Option<String>, serde_json::Error> {
    #[derive(Deserialize)]
    struct Header {
        schema: Option<String>,
    }
    serde_json::from_str(text).map(|Header { schema }| schema)
}

/// Reads what is written as `F`, of a schema.
pub(crate) fn read<F, T>(text: &str, schema: &'static str) -> Result<T, FileError>
where
    F: DeserializeOwned,
    T: TryFrom<F, Error = Error>,
{
    let got = schema_of(text)?;
    if got.as_deref() != Some(schema) {
        return Err(FileError::Schema { expected: schema, got });
    }
    T::try_from(serde_json::from_str::<F>(text)?).map_err(FileError::Value)
}
