//! Changes of a controller that runs.

use alloc::vec::Vec;

use super::controller::{ArrayController, copy};
use super::loop_state::ArrayControllerState;
use super::options::Gains;
use crate::control::Mode;
use crate::control::options::check_drives;
use crate::engine::CompiledModel;
use crate::error::{Bound, Error, check_positive};
use crate::stream::Inverse;

impl ArrayController {
    /// Holds all drives, for any reference and measurement.
    pub fn hold(&mut self) {
        self.now.end_motion();
        self.now.mode = Mode::Hold;
    }

    /// Back from a hold or a stop: the next sample starts a motion from the present drives.
    pub fn release(&mut self) {
        self.now.mode = Mode::Run;
    }

    /// Ramps every drive to its rest drive at `rate` volts per second, or at the slew if that is slower, and holds it there.
    ///
    /// From the next sample on every [`step`](Self::step) puts out the next drives of the ramp, whatever comes, also NaN. The
    /// limits of differences hold on the way. [`release`](Self::release) starts a motion from the drives that are reached then.
    ///
    /// # Errors
    /// [`Error::Domain`] unless the rate is above zero and each rest drive within its limits, [`Error::Length`] unless there are M
    /// of them; the controller is as before then.
    pub fn stop(&mut self, rate: f64, rest_drives: &[f64]) -> Result<(), Error> {
        check_positive("rate", rate)?;
        check_drives("rest_drive", rest_drives, self.limits.iter().copied())?;
        self.now.end_motion();
        (self.now.mode, self.now.stop_rate) = (Mode::Stop, rate);
        copy(&mut self.now.rest_drives, rest_drives);
        Ok(())
    }

    /// Changes the gains, per second. The integral is a displacement, so nothing jumps.
    ///
    /// # Errors
    /// [`Error::Domain`] for a gain that is negative or not finite, or a leak above 1 / dt; the controller is as before then.
    pub fn set_gains(&mut self, ki: f64, leak: f64) -> Result<(), Error> {
        self.gains = Gains::new(ki, leak, self.options.dt)?;
        (self.options.ki, self.options.leak) = (ki, leak);
        Ok(())
    }

    /// One actuator goes on with the weights and the output offset of another model of the same operators, without a jump: the
    /// bumpless term takes the difference. Allocates nothing, and frees what the old model holds if no other clone of it is left.
    ///
    /// # Errors
    /// [`Error::Whole`] for an actuator that does not exist, and as [`Inverse::set_model`]; the controller is as before then.
    pub fn set_model(&mut self, actuator: usize, model: &CompiledModel) -> Result<(), Error> {
        let last = self.len().saturating_sub(1);
        let bumpless = self.now.bumpless.get_mut(actuator);
        let (Some(stream), Some(bumpless)) = (self.inverse.streams_mut().get_mut(actuator), bumpless) else {
            let (expected, got) = (Bound::FromTo { first: 0, last }, actuator as u64);
            return Err(Error::Whole { parameter: "actuator", index: None, expected, got });
        };
        let before = stream.reached();
        stream.set_model(model)?;
        let difference = stream.reached() - before;
        if self.now.started && difference != 0.0 {
            *bumpless += difference;
            self.now.bumpless_samples = self.bumpless_samples;
        }
        Ok(())
    }

    /// As made, but for gains and models that were changed since and for the drives, which stay: the memory is that of a move from
    /// rest to them. The counters are zero, the mode is [`Mode::Run`].
    pub fn reset(&mut self) {
        self.inverse.reset();
        self.now.reset();
        self.follow_present_drives();
    }

    /// [`reset`](Self::reset), the amplifiers being at other drives now.
    ///
    /// # Errors
    /// [`Error::Length`] unless there are M drives, [`Error::Domain`] for one outside its limits; the controller is as before then.
    pub fn reset_at(&mut self, drives: &[f64]) -> Result<(), Error> {
        check_drives("drive", drives, self.limits.iter().copied())?;
        copy(&mut self.now.drives, drives);
        self.reset();
        Ok(())
    }

    /// Takes over what was driven before, rows of M drives, oldest first: the inverses remember it, and the next motion starts from
    /// the last row. Without any nothing changes.
    ///
    /// # Errors
    /// [`Error::Rows`] unless they are whole rows, [`Error::Domain`] for a drive that is not finite or outside its limits; the
    /// controller is as before then.
    pub fn follow(&mut self, drives: &[f64]) -> Result<(), Error> {
        let (width, got) = (self.len().max(1), drives.len());
        if !got.is_multiple_of(width) {
            return Err(Error::Rows { parameter: "drives", width, got });
        }
        let limits = || self.limits.iter().copied();
        drives.chunks_exact(width).try_for_each(|row| check_drives("drives", row, limits()))?;
        for row in drives.chunks_exact(width) {
            copy(&mut self.now.drives, row);
            self.follow_present_drives();
            self.now.end_motion();
        }
        Ok(())
    }

    /// The inverses move to the present drives.
    pub(super) fn follow_present_drives(&mut self) {
        for (stream, drive) in self.inverse.streams_mut().iter_mut().zip(&self.now.drives) {
            if stream.output() != *drive {
                stream.follow_drive(*drive);
            }
        }
    }

    /// Everything that the controller remembers. Allocates.
    #[must_use]
    pub fn state(&self) -> ArrayControllerState {
        let now = &self.now;
        ArrayControllerState {
            setup: self.options.fingerprint(),
            dt: self.options.dt,
            ki: self.options.ki,
            leak: self.options.leak,
            streams: self.inverse.streams().iter().map(Inverse::state).collect(),
            drives: now.drives.to_vec(),
            integral: now.integral.to_vec(),
            bumpless: now.bumpless.to_vec(),
            started: now.started,
            bumpless_samples: now.bumpless_samples,
            integral_rest_samples: now.integral_rest_samples,
            mode: now.mode,
            stop: now.stop(),
            counters: now.counters,
        }
    }

    /// Continues from `state`, bit for bit. The amplifiers must be at its drives. Allocates.
    ///
    /// # Errors
    /// [`Error::Domain`] that names the field for a state of a controller with other gains or sampling interval;
    /// [`Error::State`], [`Error::Domain`], [`Error::Length`] or [`Error::OtherModel`] for one that this controller cannot be in.
    /// The controller is as before then.
    pub fn set_state(&mut self, state: &ArrayControllerState) -> Result<(), Error> {
        let own = &self.options;
        let same =
            [("state.dt", own.dt, state.dt), ("state.ki", own.ki, state.ki), ("state.leak", own.leak, state.leak)];
        for (parameter, value, got) in same {
            if value != got {
                let expected = Bound::EqualTo { value, what: "as in this controller" };
                return Err(Error::Domain { parameter, index: None, expected, got });
            }
        }
        if state.setup != own.fingerprint() {
            let expected = "the state of a controller with the same reconstruction, pairs, slew and bumpless time";
            return Err(Error::State { expected });
        }
        state.check(&self.limits)?;
        let mut restored = self.inverse.clone();
        for (stream, saved) in restored.streams_mut().iter_mut().zip(&state.streams) {
            stream.set_state(saved)?;
        }
        let remembered: Vec<f64> = restored.streams().iter().map(Inverse::output).collect();
        let actuators = remembered.iter().zip(&state.drives).zip(&self.limits);
        for ((remembered, drive), (low, high)) in actuators {
            if (remembered - drive).abs() > SAME_DRIVE * (high - low) {
                return Err(Error::State { expected: "streams that are at the drives of the state" });
            }
        }
        self.inverse = restored;
        self.now.restore(state);
        Ok(())
    }
}

/// How far, relative to its limits, a drive of a state may be from what its inverse remembers: they agree to rounding.
const SAME_DRIVE: f64 = 1e-9;
