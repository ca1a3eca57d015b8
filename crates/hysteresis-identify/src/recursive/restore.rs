//! From the identifier to its state, and back.

use super::identifier::RecursiveIdentifier;
use super::state::RecursiveState;
use crate::error::Error;

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
            return wrong("one number for each operator, each unknown and each pair of unknowns, a state for each lag");
        }
        let numbers = [&state.outputs, &state.estimate, &state.published, &state.upper, &state.diagonal];
        let numbers = numbers.into_iter().flatten().chain([&state.last_error]);
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
