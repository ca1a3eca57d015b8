use super::creep::CreepMemory;
use super::loop_shift::LoopShiftMemory;
use super::map::MapPiece;
use super::{QuasiStatic, QuasiStaticState, first_piece, mapped};
use crate::engine::CompiledModel;
use crate::error::{Error, check_all_finite, check_finite, is_admissible};
use crate::process::Process;
use crate::stream::{Forward, check_model};

/// The position of a stage without its fast dynamics, sample by sample: y = creep(phi(H\[gamma(u)\]) + s).
///
/// The position belongs to the moment at which the drive is put out; loop shift s and creep move on from sample to sample.
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
    model: QuasiStatic,
    hysteresis: Forward,
    loop_shift: LoopShiftMemory,
    creep: CreepMemory,
    /// The lines of gamma and phi on which the last sample lay.
    on_gamma: MapPiece,
    on_phi: MapPiece,
    position: f64,
    rejected: u64,
    fingerprint: u64,
}

impl QuasiStaticForward {
    pub(super) fn new(model: &QuasiStatic) -> Self {
        let mut stream = Self {
            model: model.clone(),
            hysteresis: Forward::new(&model.hysteresis),
            loop_shift: LoopShiftMemory::new(model.loop_shift.as_ref()),
            creep: CreepMemory::new(model.creep.as_deref()),
            on_gamma: first_piece(model.input_map.as_ref()),
            on_phi: first_piece(model.output_map.as_ref()),
            position: 0.0,
            rejected: 0,
            fingerprint: model.fingerprint(),
        };
        stream.reset();
        stream
    }

    /// The last position.
    #[must_use]
    pub fn output(&self) -> f64 {
        self.position
    }

    /// The hysteresis inside.
    #[must_use]
    pub fn hysteresis(&self) -> &Forward {
        &self.hysteresis
    }

    /// How many drives were not finite (or beyond 1e100) and left position and memory as they were.
    #[must_use]
    pub fn rejected(&self) -> u64 {
        self.rejected
    }

    /// At rest since forever at a drive: the hysteresis virgin but for the way there, the loop not shifted, the creep
    /// at its end. Returns the position. A drive that is not finite is counted and changes nothing else.
    pub fn settle(&mut self, drive: f64) -> f64 {
        let x = mapped(self.model.input_map.as_ref(), drive, &mut self.on_gamma);
        if !(is_admissible(drive) && is_admissible(x)) {
            return self.reject();
        }
        self.hysteresis.reset();
        let z = self.hysteresis.step(x);
        self.rest_at(z, drive)
    }

    #[cold]
    fn reject(&mut self) -> f64 {
        self.rejected = self.rejected.saturating_add(1);
        self.position
    }

    /// The drive, and so z, has been held since forever.
    fn rest_at(&mut self, z: f64, drive: f64) -> f64 {
        self.loop_shift.settle(drive);
        let h = mapped(self.model.output_map.as_ref(), z, &mut self.on_phi);
        self.creep.settle(h);
        self.position = h + self.creep.crept();
        self.position
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
            last_output: self.position,
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
        check_finite("state.last_output", None, state.last_output)?;
        self.creep.check(&state.creep)?;
        self.loop_shift.check(&state.loop_shift)?;
        self.hysteresis.set_state(&state.hysteresis)?;
        self.creep.restore(&state.creep);
        self.loop_shift.restore(&state.loop_shift);
        (self.position, self.rejected) = (state.last_output, state.rejected);
        Ok(())
    }
}

impl Process for QuasiStaticForward {
    #[inline]
    fn step(&mut self, drive: f64) -> f64 {
        let x = mapped(self.model.input_map.as_ref(), drive, &mut self.on_gamma);
        if !(is_admissible(drive) && is_admissible(x)) {
            return self.reject();
        }
        let z = self.hysteresis.step(x);
        let h = mapped(self.model.output_map.as_ref(), z, &mut self.on_phi) + self.loop_shift.shift();
        self.position = h + self.creep.crept();
        self.creep.hold(h);
        self.loop_shift.hold(drive);
        self.position
    }

    #[inline]
    fn peek(&self, drive: f64) -> f64 {
        let (mut on_gamma, mut on_phi) = (self.on_gamma, self.on_phi);
        let x = mapped(self.model.input_map.as_ref(), drive, &mut on_gamma);
        if !(is_admissible(drive) && is_admissible(x)) {
            return self.position;
        }
        let h = mapped(self.model.output_map.as_ref(), self.hysteresis.peek(x), &mut on_phi);
        h + self.loop_shift.shift() + self.creep.crept()
    }

    fn reset(&mut self) {
        self.hysteresis.reset();
        self.rejected = 0;
        let x = self.model.hysteresis.offsets.input;
        let drive = self.model.input_map.as_ref().map_or(x, |map| map.inverse_at(x));
        self.rest_at(self.hysteresis.output(), drive);
    }
}
