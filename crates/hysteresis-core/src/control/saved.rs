//! Saved states of a controller and other models in it: what needs an allocator.

use super::controller::HybridController;
use super::preview::Preview;
use super::source::DriveSource;
use super::state::{ControllerState, DriveLimits};
use crate::engine::CompiledModel;
use crate::error::Error;

impl HybridController {
    /// Goes on with the weights and the offset of another model of the same operators, as
    /// [`Inverse::set_model`](crate::Inverse::set_model) or [`Forward::set_model`](crate::Forward::set_model) of the source,
    /// without a jump. Allocates nothing, and frees what the old model holds if no other clone of it is left.
    ///
    /// # Errors
    /// As there, and [`Error::NoModel`] without a source that has one; the controller is as before then.
    pub fn set_model(&mut self, model: &CompiledModel) -> Result<(), Error> {
        let old = self.source.peek(self.now.terms.target);
        self.source.set_model(model)?;
        self.planned = None;
        if self.now.started && !self.now.feedforward_given {
            let new = self.source.peek(self.now.terms.target);
            self.now.change_feedforward(old, new, self.rules.bumpless_samples);
        }
        Ok(())
    }

    /// Everything that the controller remembers. Allocates.
    #[must_use]
    pub fn state(&self) -> ControllerState {
        let (low, high) = self.options.limits;
        ControllerState {
            kp: self.options.kp,
            ki: self.options.ki,
            dt: self.options.dt,
            filters: self.options.filters.as_slice().to_vec(),
            limits: DriveLimits { low, high },
            feedback_loop: self.now,
            feedforward: self.source.state(),
            preview: self.preview.as_ref().map(Preview::state),
        }
    }

    /// Continues from `state`, bit for bit. The amplifier must be at the drive of the state.
    ///
    /// # Errors
    /// [`Error::Domain`] that names the field for a state of a controller with other gains, sampling interval or limits;
    /// [`Error::State`], [`Error::Domain`] or [`Error::Length`] for one that this controller cannot be in. The controller
    /// is as before then.
    pub fn set_state(&mut self, state: &ControllerState) -> Result<(), Error> {
        state.check(&self.options)?;
        match (&mut self.preview, &state.preview) {
            (None, None) => self.source.set_state(state.feedforward.as_ref())?,
            (Some(preview), Some(saved)) => {
                preview.check(saved)?;
                self.source.set_state(state.feedforward.as_ref())?;
                preview.set_state(saved);
            }
            _ => return Err(Error::State { expected: "a preview if, and only if, the controller has one" }),
        }
        self.planned = None;
        self.now = state.feedback_loop;
        Ok(())
    }
}
