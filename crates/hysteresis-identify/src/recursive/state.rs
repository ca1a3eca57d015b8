//! What the identifier remembers, as a plain value.

use hysteresis_control::linear::LinearState;

/// Why the last sample changed no weight.
///
/// ```
/// use hysteresis_identify::Frozen;
/// assert_eq!(Frozen::PoorExcitation.name(), "poor_excitation");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum Frozen {
    /// The sample says less than forgetting would lose: its leverage z' P z is below 1.25 (1 - forgetting). One regressor
    /// repeated for ever, as at standstill, comes to 1 - forgetting; m independent ones average m times that. Nothing is
    /// forgotten meanwhile. Never at forgetting = 1.
    PoorExcitation,
    /// Input or output, or what follows from them, is not a finite number (or beyond 1e100). The sample is counted as
    /// rejected; a good input moves the operators all the same.
    NotFinite,
}

impl Frozen {
    /// The reason as one word: "poor_excitation" or "not_finite".
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::PoorExcitation => "poor_excitation",
            Self::NotFinite => "not_finite",
        }
    }
}

/// Everything that a [`RecursiveIdentifier`](super::RecursiveIdentifier) remembers: restored, it continues bit for bit.
///
/// The unknowns are the weights times the scale X of the input and then the output offset, if it is fitted; estimate,
/// published and covariance have them in an order of their own.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct RecursiveState {
    /// The operator outputs z_i, in the unit of the input.
    pub outputs: Vec<f64>,
    /// The states of the dynamics behind them, in units of their largest threshold rounded up to a power of two; none
    /// without dynamics.
    pub lags: Vec<LinearState>,
    /// The estimate before the projection.
    pub estimate: Vec<f64>,
    /// The estimate within its bounds: that of the model.
    pub published: Vec<f64>,
    /// Which unknown stands at each place of what is above and below: a permutation.
    pub order: Vec<usize>,
    /// How many of the first are not at their bounds.
    pub free: usize,
    /// U above the diagonal, column by column, of the covariance P = U D U'.
    pub upper: Vec<f64>,
    /// D of the covariance.
    pub diagonal: Vec<f64>,
    /// Whose covariance is bounded next.
    pub turn: usize,
    /// The last prediction error.
    pub last_error: f64,
    /// Why the last sample changed no weight, if it did not.
    pub frozen: Option<Frozen>,
    /// How many samples were not finite.
    pub rejected: u64,
}
