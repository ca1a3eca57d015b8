//! What a unit runs, and how: its `resources/settings.json`.

use hysteresis_control::stage::{FeedForwardKind, Stage};
use serde::{Deserialize, Serialize};

use crate::error::Error;

const SCHEMA: &str = "mpi_hyst/fmu/1";

/// What a unit runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// The stage: a drive in, the position out.
    Forward,
    /// The exact inverse of its slow part: a target in, the drive out.
    Inverse,
    /// Feed-forward and feedback: reference and measurement in, the drive out.
    Controller,
}

impl Kind {
    /// The kind of that name.
    ///
    /// # Errors
    /// [`Error::Argument`] that lists the names.
    pub fn of(name: &str) -> Result<Self, Error> {
        match name {
            "forward" => Ok(Self::Forward),
            "inverse" => Ok(Self::Inverse),
            "controller" => Ok(Self::Controller),
            other => Err(Error::argument("kind", "\"forward\", \"inverse\" or \"controller\"", other)),
        }
    }

    /// Its name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Forward => "forward",
            Self::Inverse => "inverse",
            Self::Controller => "controller",
        }
    }
}

/// Where the feed-forward of a controller comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Source {
    /// The exact inverse of the reference of now.
    #[default]
    Inverse,
    /// The same of references that come early, through the inverse of amplifier, modes and dead time too.
    Preview,
}

impl Source {
    /// The source of that name.
    ///
    /// # Errors
    /// [`Error::Argument`] that lists the names.
    pub fn of(name: &str) -> Result<Self, Error> {
        match name {
            "inverse" => Ok(Self::Inverse),
            "preview" => Ok(Self::Preview),
            other => Err(Error::argument("feedforward", "\"inverse\" or \"preview\"", other)),
        }
    }

    pub(super) fn feedforward(self, stage: &Stage, dt: f64) -> Result<FeedForwardKind, Error> {
        Ok(match self {
            Self::Inverse => FeedForwardKind::Inverse,
            Self::Preview => FeedForwardKind::Preview { ahead: stage.preview_ahead(dt)?, smoothing: 0.0 },
        })
    }
}

/// What a unit runs, and how.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// The schema of its file.
    pub schema: String,
    /// What tells this unit from others; [`MockUp`](super::MockUp) fills it in.
    pub guid: String,
    /// What it runs.
    pub kind: Kind,
    /// The sampling interval in seconds.
    pub dt: f64,
    /// Of a controller: where its feed-forward comes from.
    pub feedforward: Source,
    /// Of a controller: kp and ki instead of tuned gains and filters.
    pub gains: Option<(f64, f64)>,
}

impl Settings {
    /// A controller has tuned gains, and the exact inverse of the reference of now.
    #[must_use]
    pub fn new(kind: Kind, dt: f64) -> Self {
        let (schema, guid) = (SCHEMA.into(), String::new());
        Self { schema, guid, kind, dt, feedforward: Source::default(), gains: None }
    }

    /// As text.
    #[must_use]
    pub fn to_json(&self) -> String {
        // Serialising plain numbers and strings into memory has no way to fail.
        serde_json::to_string_pretty(self).unwrap_or_default()
    }

    /// What [`to_json`](Self::to_json) wrote.
    ///
    /// # Errors
    /// [`Error::Argument`] for a text that is something else.
    pub fn from_json(text: &str) -> Result<Self, Error> {
        let expected = || format!("settings of schema {SCHEMA:?}");
        let wrong = |error: serde_json::Error| Error::argument("settings.json", expected(), error.to_string());
        let settings: Self = serde_json::from_str(text).map_err(wrong)?;
        if settings.schema == SCHEMA {
            Ok(settings)
        } else {
            Err(Error::argument("settings.json", expected(), settings.schema))
        }
    }
}
