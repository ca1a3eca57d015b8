//! The whole chain, sample by sample.

use core::f64::consts::TAU;

use hysteresis_core::{
    CompiledModel, Error as CoreError, Fingerprint, Forward, MAX_MAGNITUDE, Process, QuasiStaticForward,
    QuasiStaticState, check_all_finite, check_model, is_admissible,
};
use serde::{Deserialize, Serialize};

use super::{Error, Stage, StageParts};
use crate::checks::check_same;
use crate::linear::{Block, LinearBlock, LinearDynamics, LinearState};

/// The position of a stage, sample by sample: dead time, amplifier, maps, hysteresis, loop shift, relaxing plays, slow
/// gain, creep and modes.
///
/// [`step`](Process::step) returns the row y(k) of a record: the position at the moment at which u(k) is put out.
/// [`advance`](Self::advance) returns the position one interval later, just before the next drive: what a controller
/// reads next. Neither allocates, locks or panics. A drive beyond the limits of the stage is clamped and counted.
///
/// An amplifier in front of hysteresis and modes makes the voltage between samples an exponential. What the hysteresis
/// makes of it has no closed form, so each sampling interval then has sub-steps that hold the mean of the outputs of
/// the hysteresis at their ends. Everything else is discretised exactly.
#[derive(Clone, Debug)]
pub struct StageForward {
    amplifier: Option<LinearBlock>,
    quasi_static: QuasiStaticForward,
    linear: LinearBlock,
    has_modes: bool,
    sub_steps: u32,
    /// The last output of the quasi-static part.
    displacement: f64,
    position: f64,
    drive: f64,
    rejected: u64,
    /// The limits of the drive.
    limits: (f64, f64),
    clamped: u64,
    dt: f64,
    /// Of amplifier, modes and dead time.
    fingerprint: u64,
}

/// Everything that a [`StageForward`] remembers: restored, it continues bit for bit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StageState {
    /// The fingerprint of amplifier, modes and dead time.
    pub model: u64,
    /// The sampling interval in seconds.
    pub dt: f64,
    /// Maps, hysteresis, loop shift, relaxing plays, slow gain and creep.
    pub quasi_static: QuasiStaticState,
    /// Modes and dead time.
    pub linear: LinearState,
    /// The amplifier, if there is one.
    pub amplifier: Option<LinearState>,
    /// The last output of maps, hysteresis, loop shift, relaxing plays, slow gain and creep.
    pub displacement: f64,
    /// The last position.
    pub position: f64,
    /// The last drive.
    pub drive: f64,
    /// How many drives were rejected.
    pub rejected: u64,
    /// How many drives were clamped.
    pub clamped: u64,
}

/// How many sub-steps a sampling interval needs if an amplifier comes before the hysteresis: 16 per radian of the
/// faster parts, from 8 to 64. The error falls with the square of their number; on the benchmark plant P3 it is 0.005
/// nm of a sine of 20 Hz.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "from 8 to 64")]
fn sub_steps(parts: &StageParts, dt: f64) -> u32 {
    let Some(amplifier) = parts.amplifier.filter(|_| parts.dynamics.order() > 0) else { return 1 };
    let fastest = parts.dynamics.poles().iter().map(|pole| pole.norm()).fold(TAU * amplifier.frequency(), f64::max);
    let radians = dt * (TAU * amplifier.frequency() + fastest);
    (16.0 * radians).ceil().clamp(8.0, 64.0) as u32
}

/// Of amplifier, modes and dead time. Maps, hysteresis, loop shift, relaxing plays, slow gain and creep have their own
/// in their state.
fn fingerprint(parts: &StageParts) -> u64 {
    let modes = parts.dynamics.state_space();
    let mut fingerprint = Fingerprint::new();
    fingerprint.numbers(&[parts.amplifier.map_or(0.0, |lag| lag.frequency()), parts.dead_time, modes.d()]);
    fingerprint.numbers(modes.a().as_slice());
    fingerprint.numbers(modes.b().as_slice());
    fingerprint.numbers(modes.c().as_slice());
    fingerprint.finish()
}

impl StageForward {
    fn with_sub_steps(stage: &Stage, dt: f64, sub_steps: u32) -> Result<Self, Error> {
        let parts = stage.parts();
        let interval = dt / f64::from(sub_steps);
        let linear = parts.dynamics.clone().with_dead_time(stage.causal_dead_time()?)?;
        let amplifier = parts.amplifier.map(|lag| LinearDynamics::from(lag).block(interval)).transpose()?;
        let mut forward = Self {
            amplifier,
            quasi_static: stage.quasi_static(interval)?.forward(),
            linear: linear.block(interval)?,
            has_modes: linear.order() > 0,
            sub_steps,
            displacement: 0.0,
            position: 0.0,
            drive: 0.0,
            rejected: 0,
            limits: parts.limits.unwrap_or((-MAX_MAGNITUDE, MAX_MAGNITUDE)),
            clamped: 0,
            dt,
            fingerprint: fingerprint(parts),
        };
        forward.settle(stage.rest_drive());
        Ok(forward)
    }

    /// At rest since forever at a drive: the hysteresis virgin but for the way there, the loop not shifted, creep and
    /// modes at their ends. Returns the position. A drive that is not finite is counted and changes nothing else.
    pub fn settle(&mut self, drive: f64) -> f64 {
        if !is_admissible(drive) {
            return self.reject();
        }
        self.drive = self.within(drive);
        if let Some(amplifier) = &mut self.amplifier {
            amplifier.settle(self.drive);
        }
        self.displacement = self.quasi_static.settle(self.drive);
        self.position = self.linear.settle(self.displacement);
        self.position
    }

    /// The drive, or the limit of the stage nearest to it.
    #[inline]
    fn within(&self, drive: f64) -> f64 {
        drive.max(self.limits.0).min(self.limits.1)
    }

    /// Takes the drive within the limits; one beyond them is counted.
    #[inline]
    fn take(&mut self, drive: f64) -> f64 {
        let within = self.within(drive);
        self.clamped = self.clamped.saturating_add(u64::from(within != drive));
        self.drive = within;
        within
    }

    #[cold]
    fn reject(&mut self) -> f64 {
        self.rejected = self.rejected.saturating_add(1);
        self.position
    }

    /// Holds a drive for one sampling interval and returns the position at its end, just before the next drive. A drive
    /// that is not finite leaves position and memory as they are and is counted.
    #[inline]
    pub fn advance(&mut self, drive: f64) -> f64 {
        if !is_admissible(drive) {
            return self.reject();
        }
        let drive = self.take(drive);
        if self.amplifier.is_none() {
            self.displacement = self.quasi_static.step(drive);
            self.position = self.linear.advance(self.displacement);
        } else {
            for _ in 0..self.sub_steps {
                let held = self.sub_step(drive);
                self.position = self.linear.advance(held);
            }
            if !self.has_modes {
                self.position = self.linear.output(self.displacement);
            }
        }
        self.position
    }

    /// Moves amplifier and hysteresis by one sub-step; what the modes are held at meanwhile. A dead time alone takes
    /// what was put out at its start: between these it is straight.
    #[inline]
    fn sub_step(&mut self, drive: f64) -> f64 {
        let before = self.displacement;
        let voltage = self.amplifier.as_mut().map_or(drive, |amplifier| amplifier.advance(drive));
        self.displacement = self.quasi_static.step(voltage);
        if self.has_modes { 0.5 * (before + self.displacement) } else { before }
    }

    /// The last position.
    #[must_use]
    pub fn output(&self) -> f64 {
        self.position
    }

    /// The sampling interval in seconds.
    #[must_use]
    pub fn dt(&self) -> f64 {
        self.dt
    }

    /// The last drive.
    #[must_use]
    pub fn drive(&self) -> f64 {
        self.drive
    }

    /// Sub-steps per sample: 1, or more if an amplifier comes before hysteresis and modes.
    #[must_use]
    pub fn sub_steps(&self) -> u32 {
        self.sub_steps
    }

    /// The hysteresis inside.
    #[must_use]
    pub fn hysteresis(&self) -> &Forward {
        self.quasi_static.hysteresis()
    }

    /// How many drives were not finite (or beyond 1e100) and left position and memory as they were.
    #[must_use]
    pub fn rejected(&self) -> u64 {
        self.rejected
    }

    /// How many drives lay beyond the limits of the stage and were clamped.
    #[must_use]
    pub fn clamped(&self) -> u64 {
        self.clamped
    }

    /// Takes over what was driven before, oldest drive first, one per sampling interval.
    ///
    /// # Errors
    /// [`CoreError::Domain`] for a drive that is not finite; nothing is taken then.
    pub fn follow(&mut self, drives: &[f64]) -> Result<(), CoreError> {
        check_all_finite("drives", drives)?;
        for drive in drives {
            self.advance(*drive);
        }
        Ok(())
    }

    /// Goes on with another hysteresis of the same operators.
    ///
    /// # Errors
    /// [`CoreError::OtherOperators`] if thresholds, their number or the input offset differ.
    pub fn set_model(&mut self, hysteresis: &CompiledModel) -> Result<(), CoreError> {
        self.quasi_static.set_model(hysteresis)
    }

    /// Everything that the stream remembers.
    #[must_use]
    pub fn state(&self) -> StageState {
        StageState {
            model: self.fingerprint,
            dt: self.dt,
            quasi_static: self.quasi_static.state(),
            linear: self.linear.state(),
            amplifier: self.amplifier.as_ref().map(LinearBlock::state),
            displacement: self.displacement,
            position: self.position,
            drive: self.drive,
            rejected: self.rejected,
            clamped: self.clamped,
        }
    }

    /// Continues from a state of the same stage at the same sampling interval, bit for bit.
    ///
    /// # Errors
    /// [`Error`] that names what differs, or for a state that this stream cannot be in; it is as before then.
    pub fn set_state(&mut self, state: &StageState) -> Result<(), Error> {
        check_same("state.dt", self.dt, state.dt)?;
        check_model(self.fingerprint, state.model)?;
        let mut next = self.clone();
        match (&mut next.amplifier, &state.amplifier) {
            (None, None) => {}
            (Some(amplifier), Some(saved)) => amplifier.restore(saved)?,
            _ => return Err(CoreError::State { expected: "an amplifier where the stage has one" }.into()),
        }
        next.quasi_static.set_state(&state.quasi_static)?;
        next.linear.restore(&state.linear)?;
        let numbers = [state.displacement, state.position, state.drive];
        if !numbers.into_iter().all(f64::is_finite) {
            return Err(CoreError::State { expected: "finite positions and drives" }.into());
        }
        [next.displacement, next.position, next.drive] = numbers;
        (next.rejected, next.clamped) = (state.rejected, state.clamped);
        *self = next;
        Ok(())
    }
}

impl Process for StageForward {
    /// The row y(k) of a record, and holds the drive until t_(k+1).
    #[inline]
    fn step(&mut self, drive: f64) -> f64 {
        if !is_admissible(drive) {
            return self.reject();
        }
        let drive = self.take(drive);
        if self.amplifier.is_none() {
            self.displacement = self.quasi_static.step(drive);
            self.position = self.linear.step(self.displacement);
        } else {
            self.position = self.linear.output(self.displacement);
            for _ in 0..self.sub_steps {
                let held = self.sub_step(drive);
                self.linear.hold(held);
            }
        }
        self.position
    }

    #[inline]
    fn peek(&self, drive: f64) -> f64 {
        if !is_admissible(drive) {
            return self.position;
        }
        let drive = self.within(drive);
        let displacement = if self.amplifier.is_none() { self.quasi_static.peek(drive) } else { self.displacement };
        self.linear.output(displacement)
    }

    /// Back to rest at the drive 0: [`settle`](StageForward::settle) at another one.
    fn reset(&mut self) {
        (self.rejected, self.clamped) = (0, 0);
        self.settle(0.0);
    }
}

impl Stage {
    /// The whole chain without the converters, sample by sample, at rest at [`rest_drive`](Self::rest_drive).
    ///
    /// # Errors
    /// [`Error`] unless `dt` is finite and above 0, and no part of the dynamics is too fast or too slow for it.
    pub fn forward(&self, dt: f64) -> Result<StageForward, Error> {
        StageForward::with_sub_steps(self, dt, sub_steps(self.parts(), dt))
    }
}

#[cfg(test)]
mod tests {
    use hysteresis_core::{ModifiedPrandtlIshlinskii, Offsets, Ratios};

    use super::*;
    use crate::linear::{FirstOrder, SecondOrder};

    /// An actuator like that of the paper: +-500 V, 6 um.
    fn stage(amplifier: f64, dynamics: LinearDynamics) -> Stage {
        let r: Vec<f64> = (0..20).map(|i| 25.0 * f64::from(i)).collect();
        let w: Vec<f64> = (0..20).map(|i| if i == 0 { 4.26e-3 } else { 1.9e-4 }).collect();
        let model = ModifiedPrandtlIshlinskii::from_ratios(&w, &r, Ratios::PAPER, Offsets::default()).unwrap();
        let amplifier = Some(FirstOrder::new(amplifier).unwrap());
        Stage::new(StageParts { amplifier, dynamics, ..StageParts::new(model) }).unwrap()
    }

    fn response(stage: &Stage, drives: &[f64], sub_steps: Option<u32>) -> (u32, Vec<f64>) {
        let mut forward = match sub_steps {
            Some(count) => StageForward::with_sub_steps(stage, 1e-4, count),
            None => stage.forward(1e-4),
        }
        .unwrap();
        (forward.sub_steps(), drives.iter().map(|u| forward.advance(*u)).collect())
    }

    fn distance(one: &[f64], other: &[f64]) -> f64 {
        one.iter().zip(other).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max)
    }

    /// What `sub_steps` says of its error, against 1024 sub-steps, and that the rule is of second order.
    #[test]
    fn sub_steps_have_converged() {
        let sine: Vec<f64> = (0..2000).map(|k| 530.0 * (TAU * 20.0 * 1e-4 * f64::from(k)).sin()).collect();
        let jumps: Vec<f64> = (0..1000_u32).map(|k| if (k / 40) % 2 == 0 { 500.0 } else { -500.0 }).collect();
        for (bandwidth, frequency, damping) in
            [(279.0, 2000.0, 0.03), (279.0, 400.0, 0.95), (1000.0, 2000.0, 0.03), (3000.0, 800.0, 0.1)]
        {
            let stage = stage(bandwidth, SecondOrder::new(frequency, damping).unwrap().into());
            for (drives, bound) in [(&sine, 2e-5), (&jumps, 5e-4)] {
                let (count, chosen) = response(&stage, drives, None);
                let (_, exact) = response(&stage, drives, Some(1024));
                let (_, half) = response(&stage, drives, Some(count / 2));
                let (error, coarser) = (distance(&chosen, &exact), distance(&half, &exact));
                assert!(error < bound, "{bandwidth} {frequency}: {count} sub-steps, {error} um");
                // Half as many: four times the error, and kinks at the breakpoints of the model blur the order.
                assert!(coarser > 3.0 * error, "{bandwidth} {frequency}: {count} sub-steps, {coarser} and {error} um");
            }
        }
    }

    #[test]
    fn without_modes_only_the_end_of_the_interval_counts() {
        let stage = stage(279.0, LinearDynamics::none());
        let drives: Vec<f64> = (0..200_u32).map(|k| f64::from(k * k % 997) - 500.0).collect();
        let (count, once) = response(&stage, &drives, None);
        assert_eq!(count, 1);
        // The exponential is multiplied up 16 times instead of evaluated once.
        assert!(distance(&once, &response(&stage, &drives, Some(16)).1) < 1e-12);
    }

    /// The position is where the hysteresis was a dead time ago, straight between samples, whichever way it is asked
    /// for.
    #[test]
    fn a_dead_time_behind_an_amplifier_alone_is_straight_between_samples() {
        let drives: Vec<f64> = (0..200_u32).map(|k| f64::from(k * k % 997) - 500.0).collect();
        let without = stage(279.0, LinearDynamics::none());
        let (_, undelayed) = response(&without, &drives, None);
        for (samples, whole, share) in [(0.4, 0, 0.4), (1.0, 1, 0.0), (2.7, 2, 0.7)] {
            let delayed = Stage::new(StageParts { dead_time: samples * 1e-4, ..without.parts().clone() }).unwrap();
            let (_, got) = response(&delayed, &drives, None);
            let mut rows = delayed.forward(1e-4).unwrap();
            rows.step(drives[0]);
            for k in whole + 1..drives.len() - 1 {
                let want = (1.0 - share) * undelayed[k - whole] + share * undelayed[k - whole - 1];
                assert!((got[k] - want).abs() < 1e-12, "{samples} samples, row {k}: {} {want}", got[k]);
            }
            for (k, drive) in drives.iter().enumerate().skip(1) {
                assert_eq!(rows.peek(*drive), got[k - 1], "{samples} samples, row {k}");
                assert_eq!(rows.step(*drive), got[k - 1], "{samples} samples, row {k}");
            }
        }
    }
}
