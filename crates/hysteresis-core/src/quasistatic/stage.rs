//! The streams of a stage without its fast dynamics: from drives to positions, and the exact inverse.

use alloc::boxed::Box;
use alloc::sync::Arc;
use alloc::vec::Vec;

use super::beside::{Beside, check_rises};
use super::creep::CreepMemory;
use super::map::{MapPiece, PiecewiseLinearMap};
use super::parts::{MAX_KNOTS, QuasiStatic};
use super::past_drives::PastDrives;
use crate::duhem::Duhem;
use crate::engine::CompiledModel;
use crate::error::{Error, MAX_MAGNITUDE, check_all_finite, check_finite, check_model, is_admissible};
use crate::process::Process;
use crate::real::check_within_limits;
use crate::stream::{Forward, Inverse, StreamState, check_limits};

impl QuasiStatic {
    /// A stream from drives to positions, at rest at the input offset of the hysteresis.
    #[must_use]
    pub fn forward(&self) -> QuasiStaticForward {
        QuasiStaticForward::new(self)
    }

    /// A stream from positions to drives, at rest at the input offset of the hysteresis, or at the limit nearest to it.
    ///
    /// # Errors
    /// [`Error::NotInvertible`] if the hysteresis may not be, unless a Duhem operator whose z rises stands beside it and no
    /// weight is negative; [`Error::Domain`] unless limits are finite and low < high, or for an operator whose z falls as
    /// steeply as the hysteresis may rise.
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

/// Everything that a [`QuasiStaticForward`] or [`QuasiStaticInverse`] remembers: restored, it continues bit for bit.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct QuasiStaticState {
    /// The fingerprint of maps, hysteresis, Duhem operator, loop shift, slow gain and creep: [`QuasiStatic::fingerprint`].
    pub model: u64,
    /// What the hysteresis remembers.
    pub hysteresis: StreamState,
    /// What each creep term has crept, c_j q_j, in the unit of the position.
    pub creep: Vec<f64>,
    /// What the loop shift remembers, m, n and f of [`LoopShiftTerms`](super::LoopShiftTerms), behind it m and f of [`SlowGainTerms`](super::SlowGainTerms), and behind
    /// these the Duhem operator: its last input, x and z where its exponential began, and 1 if x rose last, -1 if it fell.
    /// Nothing of what the stage does not have.
    #[cfg_attr(feature = "serde", serde(default))]
    pub loop_shift: Vec<f64>,
    /// The last output: position (forward) or drive (inverse).
    pub last_output: f64,
    /// How many inputs were rejected.
    pub rejected: u64,
}

/// What a map makes of x, from the line on which the stream was; without a map x itself.
#[inline]
fn mapped(map: Option<&Arc<PiecewiseLinearMap>>, x: f64, on: &mut MapPiece) -> f64 {
    if !on.holds(x) {
        change_piece(map, on, |map| map.piece_at(x));
    }
    on.at(x)
}

/// What a map makes y of, from the line on which the stream was; without a map y itself.
#[inline]
fn unmapped(map: Option<&Arc<PiecewiseLinearMap>>, y: f64, on: &mut MapPiece) -> f64 {
    if !on.holds(y) {
        change_piece(map, on, |map| map.inverse_piece_at(y));
    }
    on.at(y)
}

#[cold]
#[inline(never)]
fn change_piece(
    map: Option<&Arc<PiecewiseLinearMap>>,
    on: &mut MapPiece,
    found: impl FnOnce(&PiecewiseLinearMap) -> MapPiece,
) {
    if let Some(map) = map {
        *on = found(map);
    }
}

/// What both streams of a stage are made of, around the hysteresis or its inverse.
#[derive(Clone, Debug)]
struct Stage<H> {
    model: QuasiStatic,
    hysteresis: Beside<H>,
    past: Option<Box<PastDrives>>,
    creep: CreepMemory,
    /// The lines of gamma and phi, or of their inverses, on which the last sample lay.
    on_gamma: MapPiece,
    on_phi: MapPiece,
    /// The last position, or the last drive.
    output: f64,
    rejected: u64,
    fingerprint: u64,
}

impl<H: Process> Stage<H> {
    /// `first` is the line of a map, or of its inverse, to start from.
    fn new(model: &QuasiStatic, hysteresis: Beside<H>, first: impl Fn(&PiecewiseLinearMap) -> MapPiece) -> Self {
        let piece = |map: &Option<Arc<PiecewiseLinearMap>>| map.as_deref().map_or_else(MapPiece::identity, &first);
        Self {
            hysteresis,
            past: PastDrives::new(model.loop_shift.as_ref(), model.slow_gain.as_ref()),
            creep: CreepMemory::new(model.creep.as_deref()),
            on_gamma: piece(&model.input_map),
            on_phi: piece(&model.output_map),
            output: 0.0,
            rejected: 0,
            fingerprint: model.fingerprint(),
            model: model.clone(),
        }
    }

    #[cold]
    fn reject(&mut self) -> f64 {
        self.rejected = self.rejected.saturating_add(1);
        self.output
    }

    /// Goes on with another hysteresis of the same operators.
    fn set_model(
        &mut self,
        hysteresis: &CompiledModel,
        set_model: impl FnOnce(&mut H, &CompiledModel) -> Result<(), Error>,
    ) -> Result<(), Error> {
        set_model(&mut self.hysteresis.hysteresis, hysteresis)?;
        self.hysteresis.take_over(hysteresis);
        self.model.hysteresis = hysteresis.clone();
        self.fingerprint = self.model.fingerprint();
        Ok(())
    }

    /// What the stream remembers, `hysteresis` being what the hysteresis does.
    fn state(&self, hysteresis: StreamState) -> QuasiStaticState {
        let mut others = self.past.as_ref().map_or_else(Vec::new, |past| past.states());
        others.extend(self.hysteresis.memory().into_iter().flatten());
        QuasiStaticState {
            model: self.fingerprint,
            hysteresis,
            creep: self.creep.states(),
            loop_shift: others,
            last_output: self.output,
            rejected: self.rejected,
        }
    }

    /// Continues from a state whose last output was checked.
    fn restore(
        &mut self,
        state: &QuasiStaticState,
        set_state: impl FnOnce(&mut H, &StreamState) -> Result<(), Error>,
    ) -> Result<(), Error> {
        self.creep.check(&state.creep)?;
        let (of_past, of_duhem) = self.hysteresis.split(&state.loop_shift);
        PastDrives::check(self.past.as_deref(), of_past)?;
        self.hysteresis.restore(of_duhem, |hysteresis| set_state(hysteresis, &state.hysteresis))?;
        self.creep.restore(&state.creep);
        if let Some(past) = &mut self.past {
            past.restore(of_past);
        }
        (self.output, self.rejected) = (state.last_output, state.rejected);
        Ok(())
    }
}

/// The position of a stage without its fast dynamics, sample by sample: y = creep(g(phi(H\[gamma(u)\]) + s)).
///
/// The position belongs to the moment at which the drive is put out; s, g and creep move on from sample to sample.
///
/// ```
/// use hysteresis_core::{CreepTerms, CompiledModel, Offsets, PrandtlIshlinskii, Process, QuasiStatic};
/// let linear = PrandtlIshlinskii::new(&[2.0], &[0.0], Offsets::default())?;
/// let stage = QuasiStatic::new(&CompiledModel::new(&(&linear).into())).with_creep(CreepTerms::new(&[0.1], &[0.5])?);
/// let mut forward = stage.forward();
/// assert_eq!([forward.step(1.0), forward.step(1.0), forward.step(1.0)], [2.0, 2.1, 2.15]);
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct QuasiStaticForward {
    stage: Stage<Forward>,
}

impl QuasiStaticForward {
    pub(super) fn new(model: &QuasiStatic) -> Self {
        let hysteresis = Beside::new(model, Forward::new(&model.hysteresis), model.hysteresis.offsets.input);
        let mut stream = Self { stage: Stage::new(model, hysteresis, |map| map.piece_at(0.0)) };
        stream.reset();
        stream
    }

    /// The last position.
    #[must_use]
    pub fn output(&self) -> f64 {
        self.stage.output
    }

    /// The hysteresis inside.
    #[must_use]
    pub fn hysteresis(&self) -> &Forward {
        &self.stage.hysteresis.hysteresis
    }

    /// How many drives were not finite (or beyond 1e100) and left position and memory as they were.
    #[must_use]
    pub fn rejected(&self) -> u64 {
        self.stage.rejected
    }

    /// At rest since forever at a drive: the hysteresis virgin but for the way there, the loop not shifted, the
    /// gain 1, the creep at its end. Returns the position. A drive that is not finite is counted and changes nothing else.
    pub fn settle(&mut self, drive: f64) -> f64 {
        let x = mapped(self.stage.model.input_map.as_ref(), drive, &mut self.stage.on_gamma);
        if !(is_admissible(drive) && is_admissible(x)) {
            return self.stage.reject();
        }
        self.stage.hysteresis.reset(&self.stage.model.hysteresis);
        let z = self.stage.hysteresis.step(x);
        self.rest_at(z, drive)
    }

    /// The drive, and so z, has been held since forever.
    fn rest_at(&mut self, z: f64, drive: f64) -> f64 {
        if let Some(past) = &mut self.stage.past {
            past.settle(drive);
        }
        let h = mapped(self.stage.model.output_map.as_ref(), z, &mut self.stage.on_phi);
        self.stage.creep.settle(h);
        self.stage.output = h + self.stage.creep.crept();
        self.stage.output
    }

    /// Takes over what was driven before, oldest drive first, one per sampling interval.
    ///
    /// # Errors
    /// [`Error::Domain`] for a drive that is not finite; nothing is taken then.
    pub fn follow(&mut self, drives: &[f64]) -> Result<(), Error> {
        check_all_finite("drives", drives)?;
        for drive in drives {
            self.step(*drive);
        }
        Ok(())
    }

    /// Goes on with another hysteresis of the same operators: [`Forward::set_model`].
    ///
    /// # Errors
    /// As there; the stream is as before then.
    pub fn set_model(&mut self, hysteresis: &CompiledModel) -> Result<(), Error> {
        self.stage.set_model(hysteresis, Forward::set_model)
    }

    /// Everything that the stream remembers. Allocates.
    #[must_use]
    pub fn state(&self) -> QuasiStaticState {
        self.stage.state(self.stage.hysteresis.state())
    }

    /// Continues from `state`, bit for bit.
    ///
    /// # Errors
    /// [`Error::OtherModel`] for a state of another model, [`Error::State`], [`Error::Length`] or [`Error::Domain`] for one
    /// that this stream cannot be in; the stream is as before then.
    pub fn set_state(&mut self, state: &QuasiStaticState) -> Result<(), Error> {
        check_model(self.stage.fingerprint, state.model)?;
        check_finite("state.last_output", None, state.last_output)?;
        self.stage.restore(state, Forward::set_state)
    }
}

impl Process for QuasiStaticForward {
    #[inline]
    fn step(&mut self, drive: f64) -> f64 {
        let x = mapped(self.stage.model.input_map.as_ref(), drive, &mut self.stage.on_gamma);
        if !(is_admissible(drive) && is_admissible(x)) {
            return self.stage.reject();
        }
        let z = self.stage.hysteresis.step(x);
        let mut h = mapped(self.stage.model.output_map.as_ref(), z, &mut self.stage.on_phi);
        if let Some(past) = &mut self.stage.past {
            h = past.added(h);
            past.hold(drive);
        }
        self.stage.output = h + self.stage.creep.crept();
        self.stage.creep.hold(h);
        self.stage.output
    }

    #[inline]
    fn peek(&self, drive: f64) -> f64 {
        let (mut on_gamma, mut on_phi) = (self.stage.on_gamma, self.stage.on_phi);
        let x = mapped(self.stage.model.input_map.as_ref(), drive, &mut on_gamma);
        if !(is_admissible(drive) && is_admissible(x)) {
            return self.stage.output;
        }
        let h = mapped(self.stage.model.output_map.as_ref(), self.stage.hysteresis.peek(x), &mut on_phi);
        self.stage.past.as_ref().map_or(h, |past| past.added(h)) + self.stage.creep.crept()
    }

    fn reset(&mut self) {
        self.stage.hysteresis.reset(&self.stage.model.hysteresis);
        self.stage.rejected = 0;
        let x = self.stage.model.hysteresis.offsets.input;
        let drive = self.stage.model.input_map.as_ref().map_or(x, |map| map.inverse_at(x));
        self.rest_at(self.stage.hysteresis.output(), drive);
    }
}

/// The exact inverse of a stage without its fast dynamics, sample by sample: the drive that brings its position to the
/// target, u = gamma^-1(H^-1\[phi^-1(g^-1(y - sum_j c_j q_j) - s)\]).
///
/// What the position will have crept at a sample, by how much its loop will have shifted and by which gain, is known
/// before its drive is: so the target without these is what [`Inverse`] is asked for. The drive never leaves the limits.
/// A target out of reach puts it at a limit and sets [`saturated`](Self::saturated); creep goes on from the position that was really
/// reached, loop shift and slow gain from the drive that was really put out.
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
        let mut stream = Self { stage, limits: (low, high), mapped_limits };
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
            within(unmapped(self.stage.model.input_map.as_ref(), x, on_gamma), self.limits)
        }
    }

    /// The position without creep, from what the hysteresis puts out now.
    fn reached(&self) -> f64 {
        let z = self.stage.hysteresis.reached();
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
        self.stage.output
    }

    /// Whether the last target was out of reach and the drive is at a limit.
    #[must_use]
    pub fn saturated(&self) -> bool {
        self.stage.hysteresis.hysteresis.saturated()
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

    /// At rest since forever at a drive, or the limit nearest to it: the hysteresis virgin but for the way there, the loop
    /// not shifted, the gain 1, the creep at its end. Returns the position. A drive that is not finite is counted and
    /// changes nothing else.
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
    }

    /// The position of now: what the hysteresis has reached, with loop shift, slow gain and creep.
    #[must_use]
    pub fn position(&self) -> f64 {
        self.reached() + self.stage.creep.crept()
    }

    fn move_to(&mut self, drive: f64) {
        self.stage.output = within(drive, self.limits);
        let x = self.stage.model.input_map.as_ref().map_or(self.stage.output, |map| map.at(self.stage.output));
        self.stage.hysteresis.follow_drive(x);
    }

    /// Puts out another drive than the one that a target asks for, and remembers it: what a controller does that adds
    /// feedback or limits a slew. Within the limits; a drive that is not finite is counted and changes nothing else.
    #[inline]
    pub fn follow_drive(&mut self, drive: f64) -> f64 {
        if is_admissible(drive) {
            self.move_to(drive);
            self.hold(self.reached());
            self.stage.output
        } else {
            self.stage.reject()
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
    /// As there, and [`Error::Domain`] as for [`QuasiStatic::inverse`]; the stream is as before then.
    pub fn set_model(&mut self, hysteresis: &CompiledModel) -> Result<(), Error> {
        check_rises(hysteresis, self.stage.model.duhem())?;
        self.stage.set_model(hysteresis, Inverse::set_model_in_sum)
    }

    /// Everything that the stream remembers. Allocates.
    #[must_use]
    pub fn state(&self) -> QuasiStaticState {
        self.stage.state(self.stage.hysteresis.state())
    }

    /// Continues from `state`, bit for bit.
    ///
    /// # Errors
    /// [`Error::OtherModel`] for a state of another model, [`Error::State`], [`Error::Length`] or [`Error::Domain`] for one
    /// that this stream cannot be in; the stream is as before then.
    pub fn set_state(&mut self, state: &QuasiStaticState) -> Result<(), Error> {
        check_model(self.stage.fingerprint, state.model)?;
        check_within_limits("state.last_output", &[state.last_output], self.limits)?;
        self.stage.restore(state, Inverse::set_state)
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

    #[inline]
    fn peek(&self, target: f64) -> f64 {
        let (mut on_gamma, mut on_phi) = (self.stage.on_gamma, self.stage.on_phi);
        let h = target - self.stage.creep.crept();
        let rigid = self.stage.past.as_ref().map_or(h, |past| past.removed(h));
        let z = unmapped(self.stage.model.output_map.as_ref(), rigid, &mut on_phi);
        if !(is_admissible(target) && is_admissible(z)) {
            return self.stage.output;
        }
        self.drive_at(self.stage.hysteresis.peek(z), &mut on_gamma)
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
