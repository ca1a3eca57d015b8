//! What the identifier remembers, as a plain value, and how it goes on from there.

use super::RecursiveIdentifier;
use crate::error::Error;

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
    pub lags: Vec<[f64; 2]>,
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

impl RecursiveIdentifier {
    /// Everything that is remembered. Allocates.
    #[must_use]
    pub fn state(&self) -> RecursiveState {
        let (upper, diagonal) = self.covariance.factors();
        let (outputs, lags) = self.regressors.state();
        RecursiveState {
            outputs,
            lags,
            estimate: self.estimate.to_vec(),
            published: self.published.to_vec(),
            order: self.bounds.order().to_vec(),
            free: self.bounds.free(),
            upper,
            diagonal,
            turn: self.turn,
            last_error: self.last_error,
            frozen: self.frozen,
            rejected: self.rejected,
        }
    }

    /// Continues from `state`, bit for bit.
    ///
    /// # Errors
    /// [`Error::Core`] with what a state of this identifier must satisfy; it is as before then.
    pub fn set_state(&mut self, state: &RecursiveState) -> Result<(), Error> {
        let wrong = |expected| Err(Error::Core(hysteresis_core::Error::State { expected }));
        let (n, m) = (self.regressors.len(), self.unknowns());
        let lengths = [state.estimate.len(), state.published.len(), state.diagonal.len()];
        let fits = self.regressors.fits(&state.outputs, &state.lags);
        if !fits || lengths != [m, m, m] || state.upper.len() != m * (m - 1) / 2 {
            return wrong("one number for each operator, each unknown and each pair of unknowns, two for each lag");
        }
        let numbers = [&state.outputs, &state.estimate, &state.published, &state.upper, &state.diagonal];
        let numbers = numbers.into_iter().flatten().chain(state.lags.iter().flatten()).chain([&state.last_error]);
        if !numbers.into_iter().all(|x| x.is_finite()) {
            return wrong("finite numbers");
        }
        let permuted = (0..m).all(|i| state.order.contains(&i)) && state.order.len() == m;
        if state.diagonal.iter().any(|d| *d < 0.0) || state.turn >= m || !permuted || state.free > m {
            return wrong("variances that are not negative, and every unknown once in the order");
        }
        let mut bounds = self.bounds.clone();
        bounds.restore(&state.order, state.free);
        let last = std::mem::replace(&mut self.bounds, bounds);
        if !(self.bounds.holds_only_bounded()
            && self.bounds.allow(&state.published)
            && self.has_inverse(&state.published))
        {
            self.bounds = last;
            return wrong("published weights of a model that has an inverse, none of them negative");
        }
        if n < m {
            self.regressor[self.bounds.place(n)] = 1.0;
        }
        self.regressors.restore(&state.outputs, &state.lags);
        self.estimate.copy_from_slice(&state.estimate);
        self.published.copy_from_slice(&state.published);
        self.covariance.restore(&state.upper, &state.diagonal);
        self.turn = state.turn;
        (self.last_error, self.frozen, self.rejected) = (state.last_error, state.frozen, state.rejected);
        Ok(())
    }
}
