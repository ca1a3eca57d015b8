//! Model files: JSON with a schema version, refused unless every field is present, known and valid.
//!
//! ```json
//! {"schema": "mpi_hyst/model/1", "model": "modified", "weights": [0.0043], "r": [0.0], "ra": [0.0], "rb": [0.0],
//!  "rc": [0.0], "input_offset": 0.0, "output_offset": 0.0}
//! ```
//!
//! A split model has a field more, `weights_negative`, and schema 2, so that a reader of schema 1 refuses it by its
//! schema. Every other model is written in schema 1.

use alloc::string::{String, ToString};
use alloc::vec::Vec;
use core::fmt;

use serde::{Deserialize, Serialize};

use super::prandtl_ishlinskii::{Model, ModifiedPrandtlIshlinskii, PrandtlIshlinskii};
use super::validity::Offsets;
use crate::error::Error;
use crate::operator::{CoupledPlay, Play};

/// The schema of every model that is not split.
pub const SCHEMA: &str = "mpi_hyst/model/1";

/// The schema of a split model.
pub const SCHEMA_SPLIT: &str = "mpi_hyst/model/2";

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
            Self::Schema { got: Some(got) } => {
                write!(f, "schema: expected {SCHEMA:?} or {SCHEMA_SPLIT:?}, got {got:?}")
            }
            Self::Schema { got: None } => write!(f, "schema: expected {SCHEMA:?} or {SCHEMA_SPLIT:?}, got none"),
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
        #[serde(default, deserialize_with = "present", skip_serializing_if = "Option::is_none")]
        weights_negative: Option<Vec<f64>>,
        r: Vec<f64>,
        ra: Vec<f64>,
        rb: Vec<f64>,
        rc: Vec<f64>,
        input_offset: f64,
        output_offset: f64,
    },
}

/// A field that is there is an array: `null` is none.
fn present<'de, D: serde::Deserializer<'de>>(deserializer: D) -> Result<Option<Vec<f64>>, D::Error> {
    Vec::deserialize(deserializer).map(Some)
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
        let split = matches!(self, Self::Modified(model) if model.is_split());
        let schema = if split { SCHEMA_SPLIT } else { SCHEMA }.to_string();
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
                weights_negative: model.is_split().then(|| model.weights_negative().to_vec()),
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
        let split = match header.schema.as_deref() {
            Some(SCHEMA) => false,
            Some(SCHEMA_SPLIT) => true,
            _ => return Err(JsonError::Schema { got: header.schema }),
        };
        let misplaced = |what: &str, schema| Err(JsonError::Syntax(alloc::format!("{what} for schema {schema:?}")));
        match serde_json::from_str(text).map_err(syntax)? {
            File::Conventional { .. } if split => return misplaced("a conventional model", SCHEMA_SPLIT),
            File::Modified { weights_negative: Some(_), .. } if !split => {
                return misplaced("unknown field `weights_negative`", SCHEMA);
            }
            File::Modified { weights_negative: None, .. } if split => {
                return misplaced("missing field `weights_negative`", SCHEMA_SPLIT);
            }
            File::Conventional { weights, thresholds, input_offset, output_offset, .. } => {
                let offsets = Offsets { input: input_offset, output: output_offset };
                PrandtlIshlinskii::new(&weights, &thresholds, offsets).map(Self::from)
            }
            File::Modified { weights, weights_negative, r, ra, rb, rc, input_offset, output_offset, .. } => {
                let offsets = Offsets { input: input_offset, output: output_offset };
                ModifiedPrandtlIshlinskii::new(&weights, &r, &ra, &rb, &rc, offsets)
                    .and_then(|model| match weights_negative {
                        Some(below) => model.with_negative_weights(&below),
                        None => Ok(model),
                    })
                    .map(Self::from)
            }
        }
        .map_err(JsonError::Model)
    }
}
