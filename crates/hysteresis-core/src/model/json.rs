//! Model files: JSON with a schema version, refused unless every field is present, known and valid.
//!
//! ```json
//! {"schema": "mpi_hyst/model/1", "model": "modified", "weights": [0.0043], "r": [0.0], "ra": [0.0], "rb": [0.0],
//!  "rc": [0.0], "input_offset": 0.0, "output_offset": 0.0}
//! ```

use alloc::string::{String, ToString};
use alloc::vec::Vec;
use core::fmt;

use serde::{Deserialize, Serialize};

use super::{Model, ModifiedPrandtlIshlinskii, Offsets, PrandtlIshlinskii};
use crate::error::Error;
use crate::operator::{CoupledPlay, Play};

/// The schema that this version writes, and the only one it reads.
pub const SCHEMA: &str = "mpi_hyst/model/1";

/// Why a text is not a model.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum JsonError {
    /// Not JSON, cut off, or a field is missing, unknown or of the wrong type; the message tells where, on one line.
    Syntax(String),
    /// JSON, but of another schema.
    Schema {
        /// The schema that came, if any.
        got: Option<String>,
    },
    /// A field holds what no model may have.
    Model(Error),
}

impl fmt::Display for JsonError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Syntax(message) => write!(f, "not a model file: {message}"),
            Self::Schema { got: Some(got) } => write!(f, "schema: expected {SCHEMA:?}, got {got:?}"),
            Self::Schema { got: None } => write!(f, "schema: expected {SCHEMA:?}, got none"),
            Self::Model(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for JsonError {}

/// Read first, alone, so that a file of another schema is called just that.
#[derive(Deserialize)]
#[serde(expecting = "an object with a schema")]
struct Header {
    schema: Option<String>,
}

#[derive(Deserialize, Serialize)]
#[serde(tag = "model", rename_all = "lowercase", deny_unknown_fields)]
enum File {
    Conventional {
        schema: String,
        weights: Vec<f64>,
        thresholds: Vec<f64>,
        input_offset: f64,
        output_offset: f64,
    },
    Modified {
        schema: String,
        weights: Vec<f64>,
        r: Vec<f64>,
        ra: Vec<f64>,
        rb: Vec<f64>,
        rc: Vec<f64>,
        input_offset: f64,
        output_offset: f64,
    },
}

impl Model {
    /// The model as JSON text; every number reads back bit for bit.
    ///
    /// ```
    /// use hysteresis_core::{Model, Offsets, PrandtlIshlinskii};
    /// let model = Model::from(PrandtlIshlinskii::new(&[1.0, 0.1], &[0.0, 0.3], Offsets::default())?);
    /// assert_eq!(Model::from_json(&model.to_json()).unwrap(), model);
    /// # Ok::<(), hysteresis_core::Error>(())
    /// ```
    #[must_use]
    pub fn to_json(&self) -> String {
        let schema = SCHEMA.to_string();
        let file = match self {
            Self::Conventional(model) => File::Conventional {
                schema,
                weights: model.weights().to_vec(),
                thresholds: model.operators().iter().map(Play::r).collect(),
                input_offset: model.offsets().input,
                output_offset: model.offsets().output,
            },
            Self::Modified(model) => File::Modified {
                schema,
                weights: model.weights().to_vec(),
                r: model.operators().iter().map(CoupledPlay::r).collect(),
                ra: model.operators().iter().map(CoupledPlay::ra).collect(),
                rb: model.operators().iter().map(CoupledPlay::rb).collect(),
                rc: model.operators().iter().map(CoupledPlay::rc).collect(),
                input_offset: model.offsets().input,
                output_offset: model.offsets().output,
            },
        };
        // Serialising plain numbers and strings into memory has no way to fail.
        serde_json::to_string_pretty(&file).unwrap_or_default()
    }

    /// Reads what [`to_json`](Self::to_json) wrote.
    ///
    /// # Errors
    /// [`JsonError`] that tells a cut-off text, another schema and an invalid model apart.
    pub fn from_json(text: &str) -> Result<Self, JsonError> {
        let syntax = |error: serde_json::Error| JsonError::Syntax(error.to_string().replace(['\n', '\r'], " "));
        let header: Header = serde_json::from_str(text).map_err(syntax)?;
        if header.schema.as_deref() != Some(SCHEMA) {
            return Err(JsonError::Schema { got: header.schema });
        }
        match serde_json::from_str(text).map_err(syntax)? {
            File::Conventional { weights, thresholds, input_offset, output_offset, .. } => {
                let offsets = Offsets { input: input_offset, output: output_offset };
                PrandtlIshlinskii::new(&weights, &thresholds, offsets).map(Self::from)
            }
            File::Modified { weights, r, ra, rb, rc, input_offset, output_offset, .. } => {
                let offsets = Offsets { input: input_offset, output: output_offset };
                ModifiedPrandtlIshlinskii::new(&weights, &r, &ra, &rb, &rc, offsets).map(Self::from)
            }
        }
        .map_err(JsonError::Model)
    }
}
