//! A structure of a stage of several axes: which hysteresis, where, and how well it does.

use super::descent::Fit;

/// A kind of hysteresis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AxesHysteresis {
    /// None: linear dynamics.
    None,
    /// Sums of plays.
    Plays,
    /// Free Duhem operators.
    Duhem,
}

impl AxesHysteresis {
    /// Its name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Plays => "plays",
            Self::Duhem => "duhem",
        }
    }
}

/// Where hysteresis stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AxesPlace {
    /// In front of the dynamics: an operator sees its drive.
    InFront,
    /// Inside them: it sees a combination of states and drives.
    Inside,
}

impl AxesPlace {
    /// Its name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::InFront => "in_front",
            Self::Inside => "inside",
        }
    }
}

/// A structure that was tried.
#[derive(Clone)]
pub(super) struct Candidate {
    pub(super) fit: Fit,
    pub(super) hysteresis: AxesHysteresis,
    pub(super) place: Option<AxesPlace>,
    /// The mean over the positions of errors over standard deviations, of held-out samples.
    pub(super) held_out: f64,
    pub(super) errors: Vec<f64>,
    /// Its row among all that was tried.
    pub(super) row: usize,
}
