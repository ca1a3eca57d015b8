//! Why a stage, or something that is made from one, cannot be.

use core::fmt;

use hysteresis_core::Error as CoreError;

/// What is wrong: the parameter, what was expected, what came.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Error {
    /// A number outside its domain.
    Core(CoreError),
    /// A reference that begins elsewhere than the stage is, without a lead-in.
    Start {
        /// Where the stage is at the drive from which it starts, in the unit of the position.
        position: f64,
        /// That drive.
        drive: f64,
        /// Where the reference begins.
        got: f64,
    },
    /// A negative dead time, where something is to run sample by sample.
    NegativeDeadTime {
        /// The dead time in seconds.
        got: f64,
    },
    /// Parts with another lag than the one that was identified.
    Lag {
        /// The part that changes it.
        parameter: &'static str,
        /// The identified lag of amplifier, dynamics and dead time, in seconds.
        expected: f64,
        /// Their lag with this part.
        got: f64,
    },
    /// A stage whose position falls where the drive rises, under feedback.
    Falling,
    /// A stage without limits, where something would drive it.
    NoLimits,
    /// A stage without a noise of the sensor, where one is needed.
    NoNoise,
    /// A file that is no stage.
    File {
        /// What is wrong with it.
        message: String,
    },
    /// Bytes that are not what they should be.
    Bytes {
        /// What was expected.
        expected: &'static str,
        /// What came.
        got: String,
    },
}

impl Error {
    /// The name of the parameter that is wrong, if it is one.
    #[must_use]
    pub fn parameter(&self) -> Option<&'static str> {
        match self {
            Self::Core(error) => error.parameter(),
            Self::Start { .. } => Some("reference"),
            Self::Lag { parameter, .. } => Some(parameter),
            Self::NegativeDeadTime { .. } => Some("dead_time"),
            Self::Falling => Some("output_map"),
            Self::NoLimits => Some("limits"),
            Self::NoNoise => Some("noise"),
            Self::Bytes { .. } => Some("bytes"),
            Self::File { .. } => None,
        }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Core(error) => error.fmt(f),
            Self::Start { position, drive, got } => write!(
                f,
                "reference[0]: expected the position of the stage at its start drive {drive:?}, which is {position:?}, got \
                 {got:?}: give `lead_in`, the seconds of a smooth way there, or `start`, the drive at which the stage rests"
            ),
            Self::NegativeDeadTime { got } => write!(
                f,
                "dead_time: expected 0 s or more, got {got:?}: the records pair each drive with a position that was read \
                 later; shift the positions down by one row and identify again"
            ),
            Self::Lag { parameter, expected, got } => write!(
                f,
                "{parameter}: expected amplifier, dynamics and dead time with the lag that was identified, {expected:.6} s in \
                 all, got {got:.6} s: the dead time of an identified stage holds the lag of all that was not fitted; change \
                 the dead time by as much the other way, or identify again with these dynamics"
            ),
            Self::Falling => write!(
                f,
                "output_map: expected a position that rises with the drive, got one that falls: the gains of a feedback are \
                 positive; reverse the sign of the drive or of the position"
            ),
            Self::NoLimits => write!(f, "limits: expected (low, high), got None, and the stage has none"),
            Self::NoNoise => write!(f, "noise: expected the rms noise of the sensor, got none: the stage states none"),
            Self::Bytes { expected, got } => write!(f, "bytes: expected {expected} as bytes, got {got}"),
            Self::File { message } => write!(f, "not a stage file: {message}"),
        }
    }
}

impl core::error::Error for Error {}

impl From<CoreError> for Error {
    fn from(error: CoreError) -> Self {
        Self::Core(error)
    }
}
