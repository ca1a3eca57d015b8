//! The stream of a stage without its fast dynamics from drives to positions, and what its inverse has in common with
//! it.

use alloc::boxed::Box;
use alloc::sync::Arc;
use alloc::vec::Vec;

use super::beside::Beside;
use super::creep::CreepMemory;
use super::map::{MapPiece, PiecewiseLinearMap};
use super::parts::QuasiStatic;
use super::past_drives::PastDrives;
use crate::engine::CompiledModel;
use crate::error::{Error, check_all_finite, check_finite, check_model, is_admissible};
use crate::process::Process;
use crate::stream::{Forward, StreamState};

impl QuasiStatic {
    /// A stream from drives to positions, at rest at the input offset of the hysteresis.
    #[must_use]
    pub fn forward(&self) -> QuasiStaticForward {
        QuasiStaticForward::new(self)
    }
}

/// Everything that a [`QuasiStaticForward`] or [`QuasiStaticInverse`](super::QuasiStaticInverse) remembers: restored,
/// it continues bit for bit.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct QuasiStaticState {
    /// The fingerprint of maps, hysteresis, Duhem operator, loop shift, relaxing plays, slow gain and creep:
    /// [`QuasiStatic::fingerprint`].
    pub model: u64,
    /// What the hysteresis remembers.
    pub hysteresis: StreamState,
    /// What each creep term has crept, c_j q_j, in the unit of the position.
    pub creep: Vec<f64>,
    /// What the loop shift remembers, m, n and f of [`LoopShiftTerms`](super::LoopShiftTerms), behind it m and f of
    /// [`SlowGainTerms`](super::SlowGainTerms), z and s of [`RelaxingPlayTerms`](super::RelaxingPlayTerms), and behind
    /// these the Duhem operator: its last input, x and z where its exponential began, and 1 if x rose last, -1 if it
    /// fell. Last, of an inverse behind an amplifier, the lagged
    /// target, the drive, and 1 if that is at a limit. Nothing of what the stage does not have.
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
pub(super) fn unmapped(map: Option<&Arc<PiecewiseLinearMap>>, y: f64, on: &mut MapPiece) -> f64 {
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
pub(super) struct Stage<H> {
    pub(super) model: QuasiStatic,
    pub(super) hysteresis: Beside<H>,
    pub(super) past: Option<Box<PastDrives>>,
    pub(super) creep: CreepMemory,
    /// The lines of gamma and phi, or of their inverses, on which the last sample lay.
    pub(super) on_gamma: MapPiece,
    pub(super) on_phi: MapPiece,
    /// The last position, or the last drive.
    pub(super) output: f64,
    pub(super) rejected: u64,
    pub(super) fingerprint: u64,
}

impl<H: Process> Stage<H> {
    /// `first` is the line of a map, or of its inverse, to start from.
    pub(super) fn new(
        model: &QuasiStatic,
        hysteresis: Beside<H>,
        first: impl Fn(&PiecewiseLinearMap) -> MapPiece,
    ) -> Self {
        let piece = |map: &Option<Arc<PiecewiseLinearMap>>| map.as_deref().map_or_else(MapPiece::identity, &first);
        Self {
            hysteresis,
            past: PastDrives::new(model),
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
    pub(super) fn reject(&mut self) -> f64 {
        self.rejected = self.rejected.saturating_add(1);
        self.output
    }

    /// Goes on with another hysteresis of the same operators.
    pub(super) fn set_model(
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
    pub(super) fn state(&self, hysteresis: StreamState) -> QuasiStaticState {
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
    pub(super) fn restore(
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

    /// At rest since forever at a drive: the hysteresis virgin but for the way there, the loop not shifted, the gain 1,
    /// the creep at its end. Returns the position. A drive that is not finite is counted and changes nothing else.
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
        let mut h = mapped(self.stage.model.output_map.as_ref(), z, &mut self.stage.on_phi);
        if let Some(past) = &mut self.stage.past {
            past.settle(drive);
            h = past.added(h);
        }
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
    /// [`Error::OtherModel`] for a state of another model, [`Error::State`], [`Error::Length`] or [`Error::Domain`] for
    /// one that this stream cannot be in; the stream is as before then.
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
