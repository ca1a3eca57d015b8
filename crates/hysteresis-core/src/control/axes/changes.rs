//! Changes of all axes at once, and what they remember.

use alloc::vec::Vec;

use super::controller::MultiAxisController;
use crate::control::options::check_drives;
use crate::control::{ControllerState, HybridController, Mode};
use crate::error::{Bound, Error, check_positive};

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
        check_positive("rate", rate)?;
        check_drives("rest_drives", rest_drives, self.limits())?;
        let mut each = self.controllers.iter_mut().zip(rest_drives);
        each.try_for_each(|(controller, rest_drive)| controller.stop(rate, *rest_drive))
    }

    /// The controller of one actuator, to change it alone: its gains, filters, model or mode. A change drops what is planned.
    ///
    /// # Errors
    /// [`Error::Whole`] that names `axis` unless there is such an actuator.
    ///
    /// ```
    /// use hysteresis_core::{ControllerOptions, FeedForward, HybridController, MultiAxisController};
    /// let options = ControllerOptions::new(2.0, 500.0, 1e-3, (-10.0, 10.0));
    /// let controller = HybridController::new(FeedForward::None, None, &options)?;
    /// let mut axes = MultiAxisController::new(vec![controller; 2], None)?;
    /// axes.controller_mut(1)?.set_gains(1.0, 300.0)?;
    /// assert_eq!([0, 1].map(|i| axes.controllers()[i].options().kp), [2.0, 1.0]);
    /// assert_eq!(axes.controller_mut(2).unwrap_err().parameter(), Some("axis"));
    /// # Ok::<(), hysteresis_core::Error>(())
    /// ```
    pub fn controller_mut(&mut self, axis: usize) -> Result<&mut HybridController, Error> {
        let last = self.controllers.len().saturating_sub(1);
        let (expected, got) = (Bound::FromTo { first: 0, last }, axis as u64);
        self.controllers.get_mut(axis).ok_or(Error::Whole { parameter: "axis", index: None, expected, got })
    }

    /// All axes as made, but for options and gains that were changed since and for the drives, which stay.
    pub fn reset(&mut self) {
        self.controllers.iter_mut().for_each(HybridController::reset);
    }

    /// [`reset`](Self::reset), the amplifiers being at other drives now.
    ///
    /// # Errors
    /// As [`start_at`](Self::start_at); all is as before then.
    pub fn reset_at(&mut self, drives: &[f64]) -> Result<(), Error> {
        self.start_at(drives)?;
        self.reset();
        Ok(())
    }

    /// Takes over what was driven before, rows of one drive for each actuator, oldest first: see [`HybridController::follow`].
    /// Without any nothing changes. Allocates.
    ///
    /// # Errors
    /// [`Error::Rows`] unless they are whole rows, [`Error::Domain`] for a drive that is not finite or outside its limits,
    /// [`Error::CannotFollow`] for a feed-forward that knows targets alone; all is as before then.
    ///
    /// ```
    /// use hysteresis_core::{ControllerOptions, FeedForward, HybridController, MultiAxisController};
    /// let options = ControllerOptions::new(2.0, 500.0, 1e-3, (-10.0, 10.0));
    /// let controller = HybridController::new(FeedForward::None, None, &options)?;
    /// let mut axes = MultiAxisController::new(vec![controller; 2], None)?;
    /// axes.follow(&[8.0, 1.0, 4.0, 2.0])?;
    /// assert_eq!([0, 1].map(|i| axes.controllers()[i].drive()), [4.0, 2.0]);
    /// # Ok::<(), hysteresis_core::Error>(())
    /// ```
    pub fn follow(&mut self, drives: &[f64]) -> Result<(), Error> {
        let (width, got) = (self.controllers.len().max(1), drives.len());
        if !got.is_multiple_of(width) {
            return Err(Error::Rows { parameter: "drives", width, got });
        }
        drives.chunks_exact(width).try_for_each(|row| check_drives("drives", row, self.limits()))?;
        let mut moved = self.controllers.clone();
        for (i, controller) in moved.iter_mut().enumerate() {
            let column: Vec<f64> = drives.iter().skip(i).step_by(width).copied().collect();
            controller.follow(&column)?;
        }
        self.controllers = moved;
        Ok(())
    }

    /// The limits of the drive of every actuator.
    fn limits(&self) -> impl ExactSizeIterator<Item = (f64, f64)> + '_ {
        self.controllers.iter().map(|controller| controller.options().limits)
    }

    /// Goes on from other drives that the amplifiers have, with everything that is remembered.
    ///
    /// # Errors
    /// [`Error::Length`] unless there is a drive for each actuator, [`Error::Domain`] for one outside its limits; all is as
    /// before then.
    pub fn start_at(&mut self, drives: &[f64]) -> Result<(), Error> {
        check_drives("drives", drives, self.limits())?;
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
