//! Changes of all axes at once, and what they remember.

use alloc::vec::Vec;

use super::controller::MultiAxisController;
use crate::control::loop_state::StopRamp;
use crate::control::options::check_drive;
use crate::control::{ControllerState, HybridController, Mode};
use crate::error::{Error, check_length};

/// Everything that a [`MultiAxisController`] remembers: restored, it continues bit for bit.
///
/// It also names the decoupling of its controller: one with another decoupling refuses it.
///
/// ```
/// use hysteresis_core::{ControllerOptions, FeedForward, HybridController, MultiAxisController};
/// let options = ControllerOptions::new(2.0, 500.0, 1e-3, (-10.0, 10.0));
/// let controller = HybridController::new(FeedForward::None, None, &options)?;
/// let mut axes = MultiAxisController::new(vec![controller; 2], Some(&[1.0, 0.5, 0.0, 1.0]))?;
/// let (mut drives, mut again) = ([0.0; 2], [0.0; 2]);
/// axes.step((&[3.0, 1.0]).into(), &[0.5, 0.5], &mut drives)?;
/// let saved = axes.state();
/// axes.step((&[3.0, 2.0]).into(), &[1.0, 0.5], &mut drives)?;
/// axes.set_state(&saved)?;
/// axes.step((&[3.0, 2.0]).into(), &[1.0, 0.5], &mut again)?;
/// assert_eq!(again, drives);
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct MultiAxisState {
    /// The decoupling, row by row.
    pub decoupling: Vec<f64>,
    /// What the controller of each actuator remembers.
    pub controllers: Vec<ControllerState>,
}

impl MultiAxisController {
    /// Changes what all axes do with their samples; see [`HybridController::set_mode`].
    ///
    /// # Errors
    /// [`Error::StopWithoutRate`] for [`Mode::Stop`]; all is as before then.
    pub fn set_mode(&mut self, mode: Mode) -> Result<(), Error> {
        self.controllers.iter_mut().try_for_each(|controller| controller.set_mode(mode))
    }

    /// Holds all drives.
    pub fn hold(&mut self) {
        self.controllers.iter_mut().for_each(HybridController::hold);
    }

    /// Back from a hold or a stop, on all axes.
    pub fn release(&mut self) {
        self.controllers.iter_mut().for_each(HybridController::release);
    }

    /// Ramps every drive to its rest drive at `rate` volts per second; see
    /// [`HybridController::stop`].
    ///
    /// # Errors
    /// [`Error::Length`] unless there is a rest drive for each actuator, [`Error::Domain`] for a rate that is not above zero
    /// or a rest drive outside its limits; all is as before then.
    pub fn stop(&mut self, rate: f64, rest_drives: &[f64]) -> Result<(), Error> {
        check_length("rest_drives", self.controllers.len(), rest_drives.len())?;
        for (controller, rest_drive) in self.controllers.iter().zip(rest_drives) {
            let ramp = StopRamp { rate, rest_drive: *rest_drive };
            ramp.check(["rate", "rest_drives"], controller.options().limits)?;
        }
        let mut each = self.controllers.iter_mut().zip(rest_drives);
        each.try_for_each(|(controller, rest_drive)| controller.stop(rate, *rest_drive))
    }

    /// All axes as made, but for options and gains that were changed since and for the drives, which stay.
    pub fn reset(&mut self) {
        self.controllers.iter_mut().for_each(HybridController::reset);
    }

    /// Goes on from other drives that the amplifiers have, with everything that is remembered.
    ///
    /// # Errors
    /// [`Error::Length`] unless there is a drive for each actuator, [`Error::Domain`] for one outside its limits; all is as
    /// before then.
    pub fn start_at(&mut self, drives: &[f64]) -> Result<(), Error> {
        check_length("drives", self.controllers.len(), drives.len())?;
        for (controller, drive) in self.controllers.iter().zip(drives) {
            check_drive("drives", *drive, controller.options().limits)?;
        }
        let mut each = self.controllers.iter_mut().zip(drives);
        each.try_for_each(|(controller, drive)| controller.start_at(*drive))
    }

    /// Everything that the axes remember. Allocates.
    #[must_use]
    pub fn state(&self) -> MultiAxisState {
        MultiAxisState {
            decoupling: self.decoupling.entries().to_vec(),
            controllers: self.controllers.iter().map(HybridController::state).collect(),
        }
    }

    /// Continues from `state`, bit for bit. The amplifiers must be at the drives of the state. Allocates.
    ///
    /// # Errors
    /// [`Error::State`] for another decoupling or number of axes, and those of
    /// [`HybridController::set_state`]; all is as before then.
    pub fn set_state(&mut self, state: &MultiAxisState) -> Result<(), Error> {
        if state.decoupling != self.decoupling.entries() {
            return Err(Error::State { expected: "the decoupling that the controller has" });
        }
        if state.controllers.len() != self.controllers.len() {
            return Err(Error::State { expected: "as many controllers as there are axes" });
        }
        let mut restored = self.controllers.clone();
        for (controller, state) in restored.iter_mut().zip(&state.controllers) {
            controller.set_state(state)?;
        }
        self.controllers = restored;
        Ok(())
    }
}
