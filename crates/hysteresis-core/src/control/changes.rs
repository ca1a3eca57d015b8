//! Changes of a controller that runs.

use super::command::Mode;
use super::controller::HybridController;
use super::loop_state::{LoopState, StopRamp};
use super::options::{Gains, check_drive};
use super::source::DriveSource;
use crate::error::{Error, check_within_limits};
use crate::filter::Sections;

impl<S: DriveSource> HybridController<S> {
    /// Changes what the controller does with its samples, from the next one on and without a jump. A hold forgets neither
    /// memory nor integral; the motion after it starts from the drive that was held.
    ///
    /// # Errors
    /// [`Error::StopWithoutRate`] for [`Mode::Stop`], which [`stop`](Self::stop) enters; the controller is as before then.
    pub fn set_mode(&mut self, mode: Mode) -> Result<(), Error> {
        match mode {
            Mode::Stop => return Err(Error::StopWithoutRate),
            Mode::Hold => self.hold(),
            Mode::Run | Mode::Feedforward => {
                self.now.resumes = mode;
                self.release();
            }
        }
        Ok(())
    }

    /// Holds the drive: as [`set_mode`](Self::set_mode) with [`Mode::Hold`].
    pub fn hold(&mut self) {
        self.end_motion();
        (self.now.mode, self.now.stop) = (Mode::Hold, None);
    }

    /// Ramps the drive to `rest_drive` at `rate` volts per second, or at the slew if that is slower, and holds it there.
    ///
    /// From the next sample on every [`step`](Self::step) puts out the next drive of the ramp, whatever reference and
    /// measurement come, also NaN. [`mode`](Self::mode) is [`Mode::Stop`]. A new stop replaces the one before. An inverse
    /// that feeds forward remembers the drives of the ramp; a model that is itself an inverse cannot, and stays as it is.
    /// [`release`](Self::release), or another mode, starts a motion from the drive that is reached then. The integral stays
    /// as it is, as in a hold; [`reset`](Self::reset) forgets it.
    ///
    /// # Errors
    /// [`Error::Domain`] unless the rate is above zero and the rest drive within the limits; the controller is as before
    /// then.
    ///
    /// ```
    /// use hysteresis_core::{ControllerOptions, FeedForward, HybridController};
    /// let set = ControllerOptions::new(2.0, 0.0, 1e-3, (-10.0, 10.0));
    /// let options = ControllerOptions { start_drive: Some(1.0), ..set };
    /// let mut controller = HybridController::new(FeedForward::None, None, &options)?;
    /// controller.stop(500.0, 0.0)?; // 0.5 V per sample
    /// let drives = [0; 3].map(|_| controller.step(f64::NAN.into(), f64::NAN));
    /// assert_eq!(drives, [0.5, 0.0, 0.0]);
    /// # Ok::<(), hysteresis_core::Error>(())
    /// ```
    pub fn stop(&mut self, rate: f64, rest_drive: f64) -> Result<(), Error> {
        let ramp = StopRamp { rate, rest_drive };
        ramp.check(["rate", "rest_drive"], self.options.limits)?;
        self.end_motion();
        (self.now.mode, self.now.stop) = (Mode::Stop, Some(ramp));
        Ok(())
    }

    /// The drive moves by at most so many volts per sample from now on, besides the slew: for samples that come closer together than
    /// `dt`. Infinity takes the bound back; 0 and NaN hold the drive where it is. It is no part of the state.
    ///
    /// ```
    /// use hysteresis_core::{ControllerOptions, FeedForward, HybridController};
    /// let options = ControllerOptions { slew: Some(1e3), ..ControllerOptions::new(2.0, 0.0, 1e-3, (-10.0, 10.0)) }; // 1 V per sample
    /// let mut controller = HybridController::new(FeedForward::None, None, &options)?;
    /// controller.stop(1e6, 9.0)?;
    /// let drives = [0.25, f64::INFINITY].map(|bound| {
    ///     controller.bound_step(bound);
    ///     controller.step(f64::NAN.into(), f64::NAN)
    /// });
    /// assert_eq!(drives, [0.25, 1.25]);
    /// # Ok::<(), hysteresis_core::Error>(())
    /// ```
    pub fn bound_step(&mut self, volts: f64) {
        self.planned = None;
        self.limiter.bound_step(volts);
    }

    /// Back from a hold or a stop to the mode before it.
    pub fn release(&mut self) {
        self.planned = None;
        (self.now.mode, self.now.stop) = (self.now.resumes, None);
    }

    /// The next sample starts a motion from the present drive.
    fn end_motion(&mut self) {
        self.planned = None;
        self.now.end_motion();
        if let Some(preview) = &mut self.preview {
            preview.restart();
        }
    }

    /// Changes the gains (V/um and V/um/s) without a jump.
    ///
    /// # Errors
    /// [`Error::Domain`] for a gain that is negative (a proportional one may be, behind filters) or not finite; the controller is
    /// as before then.
    pub fn set_gains(&mut self, kp: f64, ki: f64) -> Result<(), Error> {
        let gains = Gains::new(kp, ki, self.options.dt, &self.rules.filters)?;
        self.planned = None;
        self.rules.gains = gains;
        (self.options.kp, self.options.ki) = (kp, ki);
        self.restate_proportional();
        Ok(())
    }

    /// Goes on with other filters, without a jump: with the same error what they put out stays as it was, and goes on from there.
    ///
    /// # Errors
    /// [`Error::Domain`] for no filter behind a negative gain; the controller is as before then.
    pub fn set_filters(&mut self, filters: &Sections) -> Result<(), Error> {
        let Self { options, rules, now, .. } = self;
        rules.gains = Gains::new(options.kp, options.ki, options.dt, filters)?;
        self.planned = None;
        now.filter = filters.taking_over(&now.filter, &rules.filters);
        now.terms.filtered_error = now.filter.output;
        (rules.filters, options.filters) = (*filters, *filters);
        self.restate_proportional();
        Ok(())
    }

    /// Restates the last sample with the present gain and filters.
    fn restate_proportional(&mut self) {
        if self.now.feedback_active {
            let proportional = self.rules.gains.kp * self.now.filter.output;
            self.now.carry(self.now.terms.proportional - proportional, self.rules.bumpless_samples);
            self.now.terms.proportional = proportional;
        }
    }

    /// Goes on with another source of the feed-forward, without a jump. While a motion is under way the new source first
    /// moves to the last target. Volts that are given are not known before the next sample: that one repeats the drive.
    ///
    /// # Errors
    /// [`Error::OtherLimits`] for an inverse that has not the limits of the controller; the controller is as before then.
    pub fn set_feedforward(&mut self, source: S) -> Result<(), Error> {
        source.check_limits(self.options.limits)?;
        let LoopState { terms, feedforward_given: given, .. } = self.now;
        // What the last target would give at the next sample: an inverse with creep moves on by itself.
        let old = if given { terms.feedforward } else { self.source.peek(terms.target) };
        self.planned = None;
        self.source = source;
        if self.source.is_given() {
            self.now.started = false;
        } else if self.now.started {
            self.source.step(terms.target);
            let new = self.source.peek(terms.target);
            self.now.change_feedforward(old, new, self.rules.bumpless_samples);
        }
        Ok(())
    }

    /// As made, but for options and gains that were changed since and for the drive, which stays: the next motion starts
    /// from it. Source and preview forget, the counters are zero, the mode is [`Mode::Run`].
    pub fn reset(&mut self) {
        self.restart(self.now.terms.drive);
    }

    /// [`reset`](Self::reset), the amplifier being at another drive now.
    ///
    /// # Errors
    /// [`Error::Domain`] for a drive outside the limits; the controller is as before then.
    pub fn reset_at(&mut self, drive: f64) -> Result<(), Error> {
        check_drive("drive", None, drive, self.options.limits)?;
        self.restart(drive);
        Ok(())
    }

    /// Goes on from another drive that the amplifier has, with everything that is remembered: after a state was loaded into
    /// a controller whose amplifier is not at its drive. The next motion starts from there.
    ///
    /// # Errors
    /// [`Error::Domain`] for a drive outside the limits; the controller is as before then.
    ///
    /// ```
    /// use hysteresis_core::{ControllerOptions, HybridController, ModifiedPrandtlIshlinskii, Offsets, Ratios};
    /// let weights = [4.3e-3, 1.7e-3, 1.7e-3]; // um/V
    /// let model = ModifiedPrandtlIshlinskii::from_ratios(&weights, &[0.0, 150.0, 300.0], Ratios::PAPER, Offsets::default())?;
    /// let inverse = model.inverse(Some((-500.0, 500.0)))?;
    /// let options = ControllerOptions::new(60.0, 6e3, 1e-4, (-500.0, 500.0));
    /// let mut controller = HybridController::new(inverse.into(), None, &options)?;
    /// controller.step(1.5.into(), 0.0);
    /// let saved = controller.state();
    /// controller.set_state(&saved)?;
    /// controller.start_at(35.0)?;
    /// assert_eq!(controller.step(1.5.into(), 0.2), 35.0); // and from there over to what the law says
    /// # Ok::<(), hysteresis_core::Error>(())
    /// ```
    pub fn start_at(&mut self, drive: f64) -> Result<(), Error> {
        check_drive("drive", None, drive, self.options.limits)?;
        self.end_motion();
        self.now.terms.drive = drive;
        Ok(())
    }

    /// Takes over what was driven before, oldest drive first, one per sampling interval: the feed-forward remembers it, and
    /// the next motion starts from the last of the drives. Without any nothing changes.
    ///
    /// # Errors
    /// [`Error::Domain`] for a drive that is not finite or outside the limits, [`Error::CannotFollow`] for a feed-forward by
    /// a model that is itself an inverse, as it knows targets alone; the controller is as before then.
    ///
    /// ```
    /// use hysteresis_core::{ControllerOptions, HybridController, Offsets, PrandtlIshlinskii};
    /// let limits = (-10.0, 10.0);
    /// let inverse = PrandtlIshlinskii::new(&[1.0, 0.5], &[0.0, 2.0], Offsets::default())?.inverse(Some(limits))?;
    /// let options = ControllerOptions { bumpless_time: 0.0, ..ControllerOptions::new(0.0, 0.0, 1e-4, limits) };
    /// let mut controller = HybridController::new(inverse.into(), None, &options)?;
    /// controller.follow(&[8.0, 4.0])?;
    /// assert_eq!(controller.step(7.0.into(), 0.0), 4.0);
    /// assert_eq!(controller.step(7.0.into(), 0.0), 4.0); // 7 = 4 + 0.5 * 6: the play remembers the 8
    /// # Ok::<(), hysteresis_core::Error>(())
    /// ```
    pub fn follow(&mut self, drives: &[f64]) -> Result<(), Error> {
        let Some(last) = drives.last() else { return Ok(()) };
        check_within_limits("drives", drives, self.options.limits)?;
        self.source.follow(drives)?;
        self.end_motion();
        self.now.terms.drive = *last;
        Ok(())
    }

    fn restart(&mut self, drive: f64) {
        self.end_motion();
        self.source.reset();
        self.now = LoopState::at(drive);
    }
}
