//! A loop that cannot start.

use core::fmt;
use std::path::PathBuf;

use hysteresis_core::Mode;

/// Why a loop could not start: the message names the parameter, what was expected and what came.
#[derive(Debug)]
#[non_exhaustive]
pub enum Error {
    /// A number outside its domain.
    Parameter(hysteresis_core::Error),
    /// A controller whose feed-forward is given with every sample: the loop has references only.
    GivenFeedForward,
    /// A controller in a hold or a stop, in which nothing would move it.
    Rests(Mode),
    /// The file of the record.
    Record {
        /// Its path.
        path: PathBuf,
        /// What the system said.
        error: std::io::Error,
    },
    /// The thread of the loop.
    Thread(std::io::Error),
}

impl Error {
    /// The name of the parameter that is wrong, if it is one.
    #[must_use]
    pub fn parameter(&self) -> Option<&'static str> {
        match self {
            Self::Parameter(error) => error.parameter(),
            Self::GivenFeedForward | Self::Rests(_) => Some("controller"),
            Self::Record { .. } => Some("record"),
            Self::Thread(_) => None,
        }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Parameter(error) => error.fmt(f),
            Self::GivenFeedForward => f.write_str(
                "controller: expected a feed-forward from references, got one that is given with every sample",
            ),
            Self::Rests(mode) => {
                let mode = if *mode == Mode::Stop { "stop" } else { "hold" };
                write!(f, "controller: expected one that moves, got one in its {mode}; `release` lets it go on")
            }
            Self::Record { path, error } => {
                write!(f, "record: expected a file to write to, got {}: {error}", path.display())
            }
            Self::Thread(error) => write!(f, "the thread of the loop could not start: {error}"),
        }
    }
}

impl core::error::Error for Error {
    fn source(&self) -> Option<&(dyn core::error::Error + 'static)> {
        match self {
            Self::Parameter(error) => Some(error),
            Self::Record { error, .. } | Self::Thread(error) => Some(error),
            Self::GivenFeedForward | Self::Rests(_) => None,
        }
    }
}

impl From<hysteresis_core::Error> for Error {
    fn from(error: hysteresis_core::Error) -> Self {
        Self::Parameter(error)
    }
}
