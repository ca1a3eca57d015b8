//! The exact inverse of a stage without its fast dynamics, also behind an amplifier.

use super::beside::{Beside, check_rises};
use super::map::MapPiece;
use super::parts::{MAX_KNOTS, QuasiStatic};
use super::stage::{QuasiStaticState, Stage, unmapped};
use crate::duhem::Duhem;
use crate::engine::CompiledModel;
use crate::error::{Error, MAX_MAGNITUDE, check_finite, check_length, check_model, is_admissible};
use crate::fingerprint::Fingerprint;
use crate::process::Process;
use crate::real::{check_limits, check_within_limits};
use crate::stream::{Inverse, Look};

impl QuasiStatic {
    /// A stream from positions to drives, at rest at the input offset of the hysteresis, or at the limit nearest to it.
    ///
    /// # Errors
    /// [`Error::NotInvertible`] if the hysteresis may not be, unless a Duhem operator whose z rises stands beside it
    /// and no weight is negative; [`Error::Domain`] unless limits are finite and low < high, or for an operator whose z
    /// falls as steeply as the hysteresis may rise.
    pub fn inverse(&self, limits: Option<(f64, f64)>) -> Result<QuasiStaticInverse, Error> {
        QuasiStaticInverse::new(self, limits)
    }

    /// Whether there is an inverse.
    ///
    /// # Errors
    /// As for [`inverse`](Self::inverse) without limits.
    pub fn check_invertible(&self) -> Result<(), Error> {
        check_rises(&self.hysteresis, self.duhem())
    }
}

/// The exact inverse of a stage without its fast dynamics, sample by sample: the drive that brings its position to the
/// target, u = gamma^-1(H^-1\[phi^-1(g^-1(y - sum_j c_j q_j) - s)\]).
///
/// What the position will have crept at a sample, by how much its loop will have shifted and by which gain, is known
/// before its drive is: so the target without these is what [`Inverse`] is asked for. The drive never leaves the
/// limits. A target out of reach puts it at a limit and sets [`saturated`](Self::saturated); creep goes on from the
/// position that was really reached, loop shift and slow gain from the drive that was really put out.
///
/// An amplifier may stand in front of all: see [`behind_amplifier`](Self::behind_amplifier).
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
    stage: Stage<Inverse>,
    limits: (f64, f64),
    /// The limits behind gamma, each with the drive that it stands for: low, high.
    mapped_limits: [(f64, f64); 2],
    amplifier: Option<Amplifier>,
}

/// A lag in front of an inverse, and where it is.
#[derive(Clone, Copy, Debug)]
struct Amplifier {
    /// What of a voltage is left behind it after a sample.
    left: f64,
    /// The target behind the same lag.
    target: f64,
    /// What goes into it; what comes out is the drive of the stage.
    drive: f64,
    saturated: bool,
}

impl Amplifier {
    /// What comes out a sample later.
    #[inline]
    fn behind(&self, before: f64, drive: f64) -> f64 {
        self.left * before + (1.0 - self.left) * drive
    }

    /// What must go in for that.
    #[inline]
    fn in_front(&self, before: f64, after: f64) -> f64 {
        (after - self.left * before) / (1.0 - self.left)
    }

    /// The same lag where the drive has been for long.
    fn at_rest(self, drive: f64, position: f64) -> Self {
        Self { target: position, drive, saturated: false, ..self }
    }
}

impl QuasiStaticInverse {
    pub(super) fn new(model: &QuasiStatic, limits: Option<(f64, f64)>) -> Result<Self, Error> {
        let (low, high) = check_limits(limits)?;
        model.check_invertible()?;
        let behind = |drive| (model.input_map.as_ref().map_or(drive, |map| map.at(drive)), drive);
        let mut mapped_limits = [behind(low), behind(high)];
        if mapped_limits[0].0 > mapped_limits[1].0 {
            mapped_limits.reverse();
        }
        let behind = limits.map(|_| (mapped_limits[0].0, mapped_limits[1].0));
        let hysteresis = Inverse::in_sum(&model.hysteresis, behind)?;
        let start = hysteresis.output();
        let stage = Stage::new(model, Beside::new(model, hysteresis, start), |map| map.inverse_piece_at(0.0));
        let mut stream = Self { stage, limits: (low, high), mapped_limits, amplifier: None };
        stream.reset();
        Ok(stream)
    }

    /// The same behind an amplifier, a lag of first order of which `left` of a voltage is left after a sample, exp(-2
    /// pi f T).
    ///
    /// Lag and hysteresis do not commute: the lag comes first, so its inverse comes last. A target is that of the
    /// position ahead of the same lag: so no drive need jump where a target does. What the lag makes of it is where the
    /// position is a sample later; the exact inverse says which voltage leads there, and u(k) = (v(k+1) - `left` v(k))
    /// / (1 - `left`) which drive. Drives stay within the limits.
    ///
    /// ```
    /// use hysteresis_core::{CompiledModel, Offsets, PrandtlIshlinskii, Process, QuasiStatic};
    /// let plays = PrandtlIshlinskii::new(&[1.0, 0.5], &[0.0, 2.0], Offsets::default())?;
    /// let stage = QuasiStatic::new(&CompiledModel::new(&(&plays).into()));
    /// let mut inverse = stage.inverse(Some((-10.0, 10.0)))?.behind_amplifier(0.5)?;
    /// let (mut voltage, mut forward, mut lagged) = (0.0, stage.forward(), 0.0);
    /// for target in [1.0, 2.0, 4.0, 3.0, 1.0] {
    ///     voltage = 0.5 * voltage + 0.5 * inverse.step(target);
    ///     lagged = 0.5 * lagged + 0.5 * target;
    ///     assert!((forward.step(voltage) - lagged).abs() < 1e-14);
    /// }
    /// # Ok::<(), hysteresis_core::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::Domain`] unless `left` is 0 or more and below 1.
    pub fn behind_amplifier(mut self, left: f64) -> Result<Self, Error> {
        if !(0.0..1.0).contains(&left) {
            return Err(Error::domain("left", None, "a number of 0 or more, below 1", left));
        }
        let amplifier = Amplifier { left, target: 0.0, drive: 0.0, saturated: false };
        self.amplifier = Some(amplifier.at_rest(self.stage.output, self.position()));
        self.sign();
        Ok(self)
    }

    /// Whether it is behind an amplifier.
    #[must_use]
    pub fn is_behind_amplifier(&self) -> bool {
        self.amplifier.is_some()
    }

    /// Gives the stream the fingerprint of its model, and of its amplifier if there is one.
    fn sign(&mut self) {
        let mut fingerprint = self.stage.model.fingerprint();
        if let Some(Amplifier { left, .. }) = self.amplifier {
            let mut hash = Fingerprint::continued(fingerprint);
            hash.numbers(&[left]);
            fingerprint = hash.finish();
        }
        self.stage.fingerprint = fingerprint;
    }

    /// As [`step`](Process::step), and the drive besides within `low` and `high`, which lie within the limits: as a
    /// slew rate allows. Whether they did not hold it back.
    #[inline]
    pub fn step_between(&mut self, target: f64, (low, high): (f64, f64)) -> bool {
        let wanted = self.peek(target);
        let allowed = wanted.max(low).min(high);
        if allowed == wanted {
            self.step(target);
            return true;
        }
        let aim = self.amplifier.map(|amplifier| amplifier.behind(amplifier.target, target));
        self.follow_drive(allowed);
        if let (Some(amplifier), Some(aim)) = (&mut self.amplifier, aim.filter(|aim| is_admissible(*aim))) {
            // The next target makes up for what was held back.
            amplifier.target = aim;
        }
        false
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
            within(unmapped(self.stage.model.input_map.as_ref(), x, on_gamma), self.limits)
        }
    }

    /// The position without creep, from what the hysteresis puts out now.
    fn reached(&self) -> f64 {
        self.behind(self.stage.hysteresis.reached())
    }

    /// The position without creep behind an output of the hysteresis.
    #[inline]
    fn behind(&self, z: f64) -> f64 {
        let h = self.stage.model.output_map.as_ref().map_or(z, |map| map.at(z));
        self.stage.past.as_ref().map_or(h, |past| past.added(h))
    }

    /// Creep, loop shift and slow gain go on from the position without creep and the drive that are held now.
    #[inline]
    fn hold(&mut self, h: f64) {
        self.stage.creep.hold(h);
        if let Some(past) = &mut self.stage.past {
            past.hold(self.stage.output);
        }
    }

    /// The last drive.
    #[must_use]
    pub fn output(&self) -> f64 {
        self.amplifier.map_or(self.stage.output, |amplifier| amplifier.drive)
    }

    /// Whether the last target was out of reach and the drive is at a limit.
    #[must_use]
    pub fn saturated(&self) -> bool {
        let is_held_back = self.amplifier.is_some_and(|amplifier| amplifier.saturated);
        is_held_back || self.stage.hysteresis.hysteresis.saturated()
    }

    /// By how much the position misses the last target; behind an amplifier, what its lag makes of the targets.
    #[must_use]
    pub fn missed(&self, target: f64) -> f64 {
        self.amplifier.map_or(target, |amplifier| amplifier.target) - self.position()
    }

    /// The limits of the drive (low, high), if there are any.
    #[must_use]
    pub fn limits(&self) -> Option<(f64, f64)> {
        (self.limits != (-MAX_MAGNITUDE, MAX_MAGNITUDE)).then_some(self.limits)
    }

    /// The Duhem operator beside the hysteresis, if there is one.
    #[must_use]
    pub fn duhem(&self) -> Option<&Duhem<MAX_KNOTS>> {
        self.stage.model.duhem()
    }

    /// The inverse of the hysteresis inside.
    #[must_use]
    pub fn hysteresis(&self) -> &Inverse {
        &self.stage.hysteresis.hysteresis
    }

    /// How many targets were not finite (or beyond 1e100) and left drive and memory as they were.
    #[must_use]
    pub fn rejected(&self) -> u64 {
        self.stage.rejected
    }

    /// At rest since forever at a drive, or the limit nearest to it: the hysteresis virgin but for the way there, the
    /// loop not shifted, the gain 1, the creep at its end. Returns the position. A drive that is not finite is counted
    /// and changes nothing else.
    pub fn settle(&mut self, drive: f64) -> f64 {
        if is_admissible(drive) {
            self.stage.hysteresis.reset();
            self.move_to(drive);
            self.rest();
        } else {
            self.stage.reject();
        }
        self.position()
    }

    /// What the drive has been since forever is what it is now.
    fn rest(&mut self) {
        if let Some(past) = &mut self.stage.past {
            past.settle(self.stage.output);
        }
        let h = self.reached();
        self.stage.creep.settle(h);
        self.amplifier = self.amplifier.map(|amplifier| amplifier.at_rest(self.stage.output, self.position()));
    }

    /// The position of now: what the hysteresis has reached, with loop shift, relaxing plays, slow gain and creep.
    #[must_use]
    pub fn position(&self) -> f64 {
        self.reached() + self.stage.creep.crept()
    }

    fn move_to(&mut self, drive: f64) {
        self.stage.output = within(drive, self.limits);
        self.stage.hysteresis.follow_drive(self.in_front(self.stage.output));
    }

    /// The input of the hysteresis at a drive.
    #[inline]
    fn in_front(&self, drive: f64) -> f64 {
        self.stage.model.input_map.as_ref().map_or(drive, |map| map.at(drive))
    }

    /// Where [`step`](Process::step) would come to without an amplifier; for a target that it would not take, where the
    /// drive is.
    #[inline]
    pub(crate) fn look(&self, target: f64) -> Look {
        let mut on_gamma = self.stage.on_gamma;
        let Some(z) = self.asked(target) else {
            return Look { drive: self.stage.output, reached: self.position(), saturated: true };
        };
        let Look { drive, reached, saturated } = self.stage.hysteresis.look(z);
        let reached = self.behind(reached) + self.stage.creep.crept();
        Look { drive: self.drive_at(drive, &mut on_gamma), reached, saturated }
    }

    /// The position that [`follow_drive`](Self::follow_drive) would come to without an amplifier.
    #[inline]
    pub(crate) fn look_at_drive(&self, drive: f64) -> f64 {
        let z = self.stage.hysteresis.look_at_drive(self.in_front(within(drive, self.limits)));
        self.behind(z) + self.stage.creep.crept()
    }

    /// Puts out another drive than the one that a target asks for, and remembers it: what a controller does that adds
    /// feedback or limits a slew. Within the limits; a drive that is not finite is counted and changes nothing else.
    #[inline]
    pub fn follow_drive(&mut self, drive: f64) -> f64 {
        if !is_admissible(drive) {
            self.stage.reject();
            return self.output();
        }
        let Some(mut amplifier) = self.amplifier else {
            self.follow_voltage(drive);
            return self.stage.output;
        };
        (amplifier.drive, amplifier.saturated) = (within(drive, self.limits), false);
        self.follow_voltage(amplifier.behind(self.stage.output, amplifier.drive));
        amplifier.target = self.position();
        self.amplifier = Some(amplifier);
        amplifier.drive
    }

    #[inline]
    fn follow_voltage(&mut self, voltage: f64) {
        self.move_to(voltage);
        self.hold(self.reached());
    }

    /// The drive for an amplifier in front of the voltage that leads to a target, and the amplifier then; where limits
    /// hold it back, the voltage that it leads to.
    #[inline]
    fn amplified(&self, mut amplifier: Amplifier, target: f64) -> (Amplifier, Option<f64>) {
        amplifier.target = amplifier.behind(amplifier.target, target);
        let before = self.stage.output;
        let wanted = amplifier.in_front(before, self.peek_voltage(amplifier.target));
        amplifier.drive = within(wanted, self.limits);
        amplifier.saturated = amplifier.drive != wanted;
        let held_back = amplifier.saturated.then(|| amplifier.behind(before, amplifier.drive));
        (amplifier, held_back)
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
    /// As there, and [`Error::Domain`] as for [`QuasiStatic::inverse`]; the stream is as before then.
    pub fn set_model(&mut self, hysteresis: &CompiledModel) -> Result<(), Error> {
        check_rises(hysteresis, self.stage.model.duhem())?;
        self.stage.set_model(hysteresis, Inverse::set_model_in_sum)?;
        self.sign();
        Ok(())
    }

    /// Everything that the stream remembers. Allocates.
    #[must_use]
    pub fn state(&self) -> QuasiStaticState {
        let mut state = self.stage.state(self.stage.hysteresis.state());
        if let Some(Amplifier { target, drive, saturated, .. }) = self.amplifier {
            state.loop_shift.extend([target, drive, if saturated { 1.0 } else { 0.0 }]);
        }
        state
    }

    /// Continues from `state`, bit for bit.
    ///
    /// # Errors
    /// [`Error::OtherModel`] for a state of another model, [`Error::State`], [`Error::Length`] or [`Error::Domain`] for
    /// one that this stream cannot be in; the stream is as before then.
    pub fn set_state(&mut self, state: &QuasiStaticState) -> Result<(), Error> {
        check_model(self.stage.fingerprint, state.model)?;
        check_within_limits("state.last_output", &[state.last_output], self.limits)?;
        let Some(amplifier) = self.amplifier else { return self.stage.restore(state, Inverse::set_state) };
        let Some((others, &[target, drive, saturated])) = state.loop_shift.split_last_chunk() else {
            return check_length("state.loop_shift", 3, state.loop_shift.len());
        };
        check_finite("state.loop_shift", None, target)?;
        check_within_limits("state.loop_shift", &[drive], self.limits)?;
        let amplifier = Amplifier { target, drive, saturated: saturated == 1.0, ..amplifier };
        self.stage.restore(&QuasiStaticState { loop_shift: others.to_vec(), ..state.clone() }, Inverse::set_state)?;
        self.amplifier = Some(amplifier);
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

impl QuasiStaticInverse {
    /// The step to a target behind the amplifier, if there is one.
    #[inline]
    fn step_voltage(&mut self, target: f64) -> f64 {
        let h = target - self.stage.creep.crept();
        let rigid = self.stage.past.as_ref().map_or(h, |past| past.removed(h));
        let z = unmapped(self.stage.model.output_map.as_ref(), rigid, &mut self.stage.on_phi);
        if !(is_admissible(target) && is_admissible(z)) {
            return self.stage.reject();
        }
        let x = self.stage.hysteresis.step(z);
        let mut on_gamma = self.stage.on_gamma;
        self.stage.output = self.drive_at(x, &mut on_gamma);
        self.stage.on_gamma = on_gamma;
        // Creep goes on without waiting for the drive, unless a limit keeps the position from the target.
        let h = if self.stage.hysteresis.hysteresis.saturated() { self.reached() } else { h };
        self.hold(h);
        self.stage.output
    }

    /// The output of the hysteresis that is asked for with a target, unless it would not be taken.
    #[inline]
    fn asked(&self, target: f64) -> Option<f64> {
        let mut on_phi = self.stage.on_phi;
        let h = target - self.stage.creep.crept();
        let rigid = self.stage.past.as_ref().map_or(h, |past| past.removed(h));
        let z = unmapped(self.stage.model.output_map.as_ref(), rigid, &mut on_phi);
        (is_admissible(target) && is_admissible(z)).then_some(z)
    }

    #[inline]
    fn peek_voltage(&self, target: f64) -> f64 {
        let mut on_gamma = self.stage.on_gamma;
        let to = |z| self.drive_at(self.stage.hysteresis.peek(z), &mut on_gamma);
        self.asked(target).map_or(self.stage.output, to)
    }
}

impl Process for QuasiStaticInverse {
    #[inline]
    fn step(&mut self, target: f64) -> f64 {
        let Some(amplifier) = self.amplifier else { return self.step_voltage(target) };
        if !is_admissible(target) {
            self.stage.reject();
            return amplifier.drive;
        }
        let (amplifier, held_back) = self.amplified(amplifier, target);
        self.amplifier = Some(amplifier);
        match held_back {
            None => _ = self.step_voltage(amplifier.target),
            Some(voltage) => self.follow_voltage(voltage),
        }
        amplifier.drive
    }

    #[inline]
    fn peek(&self, target: f64) -> f64 {
        match self.amplifier {
            None => self.peek_voltage(target),
            Some(amplifier) if !is_admissible(target) => amplifier.drive,
            Some(amplifier) => self.amplified(amplifier, target).0.drive,
        }
    }

    fn reset(&mut self) {
        self.stage.hysteresis.reset();
        let mut on_gamma = self.stage.on_gamma;
        self.stage.output = self.drive_at(self.stage.hysteresis.hysteresis.output(), &mut on_gamma);
        self.stage.rejected = 0;
        self.rest();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_drive_beyond_a_limit_becomes_the_limit() {
        let drives = [-1.5, -1.0, 0.0, 2.0, 2.5].map(|drive| within(drive, (-1.0, 2.0)));
        assert_eq!(drives, [-1.0, -1.0, 0.0, 2.0, 2.0]);
    }
}
