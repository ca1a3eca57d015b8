use super::creep::CreepMemory;
use super::loop_shift::LoopShiftMemory;
use super::map::MapPiece;
use super::{QuasiStatic, QuasiStaticState, first_inverse_piece, unmapped};
use crate::engine::CompiledModel;
use crate::error::{Error, MAX_MAGNITUDE, check_within_limits, is_admissible};
use crate::process::Process;
use crate::stream::{Inverse, check_limits, check_model};

/// The exact inverse of a stage without its fast dynamics, sample by sample: the drive that brings its position to the
/// target, u = gamma^-1(H^-1\[phi^-1(y - s - sum_j c_j q_j)\]).
///
/// What the position will have crept at a sample, and by how much its loop will have shifted, is known before its drive
/// is: so the target without both is what [`Inverse`] is asked for. The drive never leaves the limits. A target out of
/// reach puts it at a limit and sets [`saturated`](Self::saturated); creep goes on from the position that was really
/// reached, the loop shift from the drive that was really put out.
///
/// ```
/// use hysteresis_core::{CreepTerms, CompiledModel, Offsets, PrandtlIshlinskii, Process, QuasiStatic};
/// let linear = PrandtlIshlinskii::new(&[2.0], &[0.0], Offsets::default())?;
/// let stage = QuasiStatic::new(&CompiledModel::new(&(&linear).into())).with_creep(CreepTerms::new(&[0.1], &[0.5])?);
/// let mut inverse = stage.inverse(Some((0.0, 10.0)))?;
/// assert_eq!(inverse.step(2.0), 1.0);
/// assert_eq!(inverse.step(2.0), 0.95); // 0.1 of 2 has crept
/// assert_eq!((inverse.step(99.0), inverse.saturated()), (10.0, true));
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct QuasiStaticInverse {
    model: QuasiStatic,
    hysteresis: Inverse,
    loop_shift: LoopShiftMemory,
    creep: CreepMemory,
    /// The lines of gamma^-1 and phi^-1 on which the last sample lay.
    on_gamma: MapPiece,
    on_phi: MapPiece,
    limits: (f64, f64),
    /// The limits behind gamma, each with the drive that it stands for: low, high.
    mapped_limits: [(f64, f64); 2],
    drive: f64,
    rejected: u64,
    fingerprint: u64,
}

impl QuasiStaticInverse {
    pub(super) fn new(model: &QuasiStatic, limits: Option<(f64, f64)>) -> Result<Self, Error> {
        let (low, high) = check_limits(limits)?;
        let behind = |drive| (model.input_map.as_ref().map_or(drive, |map| map.at(drive)), drive);
        let mut mapped_limits = [behind(low), behind(high)];
        if mapped_limits[0].0 > mapped_limits[1].0 {
            mapped_limits.reverse();
        }
        let hysteresis = Inverse::new(&model.hysteresis, limits.map(|_| (mapped_limits[0].0, mapped_limits[1].0)))?;
        let mut stream = Self {
            model: model.clone(),
            hysteresis,
            loop_shift: LoopShiftMemory::new(model.loop_shift.as_ref()),
            creep: CreepMemory::new(model.creep.as_deref()),
            on_gamma: first_inverse_piece(model.input_map.as_ref()),
            on_phi: first_inverse_piece(model.output_map.as_ref()),
            limits: (low, high),
            mapped_limits,
            drive: 0.0,
            rejected: 0,
            fingerprint: model.fingerprint(),
        };
        stream.reset();
        Ok(stream)
    }

    /// The drive for an input of the hysteresis: at a limit the very limit, never beyond.
    #[inline]
    fn drive_at(&self, x: f64, on_gamma: &mut MapPiece) -> f64 {
        let [low, high] = self.mapped_limits;
        if x <= low.0 {
            low.1
        } else if x >= high.0 {
            high.1
        } else {
            within(unmapped(self.model.input_map.as_ref(), x, on_gamma), self.limits)
        }
    }

    /// The position without creep, from what the hysteresis puts out now.
    fn reached(&self) -> f64 {
        let z = self.hysteresis.reached();
        self.model.output_map.as_ref().map_or(z, |map| map.at(z)) + self.loop_shift.shift()
    }

    /// Creep and loop shift go on from the position without creep and the drive that are held now.
    #[inline]
    fn hold(&mut self, h: f64) {
        self.creep.hold(h);
        self.loop_shift.hold(self.drive);
    }

    /// The last drive.
    #[must_use]
    pub fn output(&self) -> f64 {
        self.drive
    }

    /// Whether the last target was out of reach and the drive is at a limit.
    #[must_use]
    pub fn saturated(&self) -> bool {
        self.hysteresis.saturated()
    }

    /// The limits of the drive (low, high), if there are any.
    #[must_use]
    pub fn limits(&self) -> Option<(f64, f64)> {
        (self.limits != (-MAX_MAGNITUDE, MAX_MAGNITUDE)).then_some(self.limits)
    }

    /// The inverse of the hysteresis inside.
    #[must_use]
    pub fn hysteresis(&self) -> &Inverse {
        &self.hysteresis
    }

    /// How many targets were not finite (or beyond 1e100) and left drive and memory as they were.
    #[must_use]
    pub fn rejected(&self) -> u64 {
        self.rejected
    }

    /// At rest since forever at a drive, or the limit nearest to it: the hysteresis virgin but for the way there, the loop
    /// not shifted, the creep at its end. Returns the position. A drive that is not finite is counted and changes nothing
    /// else.
    pub fn settle(&mut self, drive: f64) -> f64 {
        if is_admissible(drive) {
            self.hysteresis.reset();
            self.move_to(drive);
            self.rest();
        } else {
            self.reject();
        }
        self.position()
    }

    #[cold]
    fn reject(&mut self) -> f64 {
        self.rejected = self.rejected.saturating_add(1);
        self.drive
    }

    /// What the drive has been since forever is what it is now.
    fn rest(&mut self) {
        self.loop_shift.settle(self.drive);
        let h = self.reached();
        self.creep.settle(h);
    }

    /// The position of now: what the hysteresis has reached, by how much its loop has shifted, and what has crept.
    #[must_use]
    pub fn position(&self) -> f64 {
        self.reached() + self.creep.crept()
    }

    fn move_to(&mut self, drive: f64) {
        self.drive = within(drive, self.limits);
        let x = self.model.input_map.as_ref().map_or(self.drive, |map| map.at(self.drive));
        self.hysteresis.follow_drive(x);
    }

    /// Puts out another drive than the one that a target asks for, and remembers it: what a controller does that adds
    /// feedback or limits a slew. Within the limits; a drive that is not finite is counted and changes nothing else.
    #[inline]
    pub fn follow_drive(&mut self, drive: f64) -> f64 {
        if is_admissible(drive) {
            self.move_to(drive);
            self.hold(self.reached());
            self.drive
        } else {
            self.reject()
        }
    }

    /// Takes over what was driven before, oldest drive first, one per sampling interval.
    ///
    /// # Errors
    /// [`Error::Domain`] for a drive that is not finite or outside the limits; nothing is taken then.
    pub fn follow(&mut self, drives: &[f64]) -> Result<(), Error> {
        check_within_limits("drives", drives, self.limits)?;
        for drive in drives {
            self.follow_drive(*drive);
        }
        Ok(())
    }

    /// Goes on with another hysteresis of the same operators, without a jump of the drive: [`Inverse::set_model`].
    ///
    /// # Errors
    /// As there; the stream is as before then.
    pub fn set_model(&mut self, hysteresis: &CompiledModel) -> Result<(), Error> {
        self.hysteresis.set_model(hysteresis)?;
        self.model.hysteresis = hysteresis.clone();
        self.fingerprint = self.model.fingerprint();
        Ok(())
    }

    /// Everything that the stream remembers. Allocates.
    #[must_use]
    pub fn state(&self) -> QuasiStaticState {
        QuasiStaticState {
            model: self.fingerprint,
            hysteresis: self.hysteresis.state(),
            creep: self.creep.states(),
            loop_shift: self.loop_shift.states(),
            last_output: self.drive,
            rejected: self.rejected,
        }
    }

    /// Continues from `state`, bit for bit.
    ///
    /// # Errors
    /// [`Error::OtherModel`] for a state of another model, [`Error::State`], [`Error::Length`] or [`Error::Domain`] for one
    /// that this stream cannot be in; the stream is as before then.
    pub fn set_state(&mut self, state: &QuasiStaticState) -> Result<(), Error> {
        check_model(self.fingerprint, state.model)?;
        check_within_limits("state.last_output", &[state.last_output], self.limits)?;
        self.creep.check(&state.creep)?;
        self.loop_shift.check(&state.loop_shift)?;
        self.hysteresis.set_state(&state.hysteresis)?;
        self.creep.restore(&state.creep);
        self.loop_shift.restore(&state.loop_shift);
        (self.drive, self.rejected) = (state.last_output, state.rejected);
        Ok(())
    }
}

/// A number that is not below or above the limits: only rounding takes a drive there that comes from within them.
#[inline]
fn within(drive: f64, (low, high): (f64, f64)) -> f64 {
    if drive > high {
        high
    } else if drive < low {
        low
    } else {
        drive
    }
}

impl Process for QuasiStaticInverse {
    #[inline]
    fn step(&mut self, target: f64) -> f64 {
        let h = target - self.creep.crept();
        let z = unmapped(self.model.output_map.as_ref(), h - self.loop_shift.shift(), &mut self.on_phi);
        if !(is_admissible(target) && is_admissible(z)) {
            return self.reject();
        }
        let x = self.hysteresis.step(z);
        let mut on_gamma = self.on_gamma;
        self.drive = self.drive_at(x, &mut on_gamma);
        self.on_gamma = on_gamma;
        // Creep goes on without waiting for the drive, unless a limit keeps the position from the target.
        let h = if self.hysteresis.saturated() { self.reached() } else { h };
        self.hold(h);
        self.drive
    }

    #[inline]
    fn peek(&self, target: f64) -> f64 {
        let (mut on_gamma, mut on_phi) = (self.on_gamma, self.on_phi);
        let h = target - self.creep.crept() - self.loop_shift.shift();
        let z = unmapped(self.model.output_map.as_ref(), h, &mut on_phi);
        if !(is_admissible(target) && is_admissible(z)) {
            return self.drive;
        }
        self.drive_at(self.hysteresis.peek(z), &mut on_gamma)
    }

    fn reset(&mut self) {
        self.hysteresis.reset();
        let mut on_gamma = self.on_gamma;
        self.drive = self.drive_at(self.hysteresis.output(), &mut on_gamma);
        self.rejected = 0;
        self.rest();
    }
}

#[cfg(test)]
mod tests {
    use super::within;

    #[test]
    fn a_drive_beyond_a_limit_becomes_the_limit() {
        let drives = [-1.5, -1.0, 0.0, 2.0, 2.5].map(|drive| within(drive, (-1.0, 2.0)));
        assert_eq!(drives, [-1.0, -1.0, 0.0, 2.0, 2.0]);
    }
}
