use super::creep::CreepMemory;
use super::{QuasiStatic, QuasiStaticState, mapped, unmapped};
use crate::error::{Error, MAX_MAGNITUDE, check_within_limits, is_admissible};
use crate::memory::Kernel;
use crate::process::Process;
use crate::stream::{Inverse, check_limits, check_model};

/// The exact inverse of a stage without its fast dynamics, sample by sample: the drive that brings its position to the
/// target, u = gamma^-1(H^-1\[phi^-1(y - sum_j c_j q_j)\]).
///
/// What the position will have crept at a sample is known before its drive is: so the target without it is what
/// [`Inverse`] is asked for. The drive never leaves the limits. A target out of reach puts it at a limit and sets
/// [`saturated`](Self::saturated); creep goes on from the position that was really reached.
///
/// ```
/// use hysteresis_core::{CreepTerms, Kernel, Offsets, PrandtlIshlinskii, Process, QuasiStatic};
/// let linear = PrandtlIshlinskii::new(&[2.0], &[0.0], Offsets::default())?;
/// let stage = QuasiStatic::new(&Kernel::new(&(&linear).into())).with_creep(CreepTerms::new(&[0.1], &[0.5])?);
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
    creep: CreepMemory,
    /// The lines of the maps on which the last sample lay: gamma, phi.
    cursors: [usize; 2],
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
        let behind = |drive| (mapped(model.input_map.as_deref(), drive, &mut 0), drive);
        let mut mapped_limits = [behind(low), behind(high)];
        if mapped_limits[0].0 > mapped_limits[1].0 {
            mapped_limits.reverse();
        }
        let hysteresis = Inverse::new(&model.hysteresis, limits.map(|_| (mapped_limits[0].0, mapped_limits[1].0)))?;
        let mut stream = Self {
            model: model.clone(),
            hysteresis,
            creep: CreepMemory::new(model.creep.as_deref()),
            cursors: [0; 2],
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
    fn drive_at(&self, x: f64, cursor: &mut usize) -> f64 {
        let [low, high] = self.mapped_limits;
        if x <= low.0 {
            low.1
        } else if x >= high.0 {
            high.1
        } else {
            let drive = unmapped(self.model.input_map.as_deref(), x, cursor);
            drive.max(self.limits.0).min(self.limits.1)
        }
    }

    /// What the hysteresis must put out for a target.
    #[inline]
    fn wanted(&self, target: f64, cursor: &mut usize) -> f64 {
        let h = super::within_magnitude(target - self.creep.crept());
        unmapped(self.model.output_map.as_deref(), h, cursor)
    }

    /// The position without creep that the hysteresis puts out now.
    #[inline]
    fn reached(&mut self) -> f64 {
        mapped(self.model.output_map.as_deref(), self.hysteresis.reached(), &mut self.cursors[1])
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

    /// At rest since forever at a drive, or the limit nearest to it: the hysteresis virgin but for the way there, the
    /// creep at its end. Returns the position. A drive that is not finite is counted and changes nothing else.
    pub fn settle(&mut self, drive: f64) -> f64 {
        if is_admissible(drive) {
            self.hysteresis.reset();
            self.move_to(drive);
            self.rest();
        } else {
            self.rejected = self.rejected.saturating_add(1);
        }
        self.position()
    }

    /// What the drive has been since forever is what it is now.
    fn rest(&mut self) {
        let h = self.reached();
        self.creep.settle(h);
    }

    /// The position of now: what the hysteresis has reached and what has crept.
    #[must_use]
    pub fn position(&self) -> f64 {
        let mut cursor = self.cursors[1];
        mapped(self.model.output_map.as_deref(), self.hysteresis.reached(), &mut cursor) + self.creep.crept()
    }

    fn move_to(&mut self, drive: f64) {
        self.drive = drive.max(self.limits.0).min(self.limits.1);
        let x = mapped(self.model.input_map.as_deref(), self.drive, &mut self.cursors[0]);
        self.hysteresis.follow_drive(x);
    }

    /// Puts out another drive than the one that a target asks for, and remembers it: what a controller does that adds
    /// feedback or limits a slew. Within the limits; a drive that is not finite is counted and changes nothing else.
    #[inline]
    pub fn follow_drive(&mut self, drive: f64) -> f64 {
        if is_admissible(drive) {
            self.move_to(drive);
            let h = self.reached();
            self.creep.hold(h);
        } else {
            self.rejected = self.rejected.saturating_add(1);
        }
        self.drive
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
    pub fn set_model(&mut self, hysteresis: &Kernel) -> Result<(), Error> {
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
        self.hysteresis.set_state(&state.hysteresis)?;
        self.creep.restore(&state.creep);
        (self.drive, self.rejected) = (state.last_output, state.rejected);
        Ok(())
    }
}

impl Process for QuasiStaticInverse {
    #[inline]
    fn step(&mut self, target: f64) -> f64 {
        if !is_admissible(target) {
            self.rejected = self.rejected.saturating_add(1);
            return self.drive;
        }
        let mut cursor = self.cursors[1];
        let wanted = self.wanted(target, &mut cursor);
        self.cursors[1] = cursor;
        let x = self.hysteresis.step(wanted);
        let mut cursor = self.cursors[0];
        self.drive = self.drive_at(x, &mut cursor);
        self.cursors[0] = cursor;
        let h = self.reached();
        self.creep.hold(h);
        self.drive
    }

    #[inline]
    fn peek(&self, target: f64) -> f64 {
        if !is_admissible(target) {
            return self.drive;
        }
        let mut cursors = self.cursors;
        let x = self.hysteresis.peek(self.wanted(target, &mut cursors[1]));
        self.drive_at(x, &mut cursors[0])
    }

    fn reset(&mut self) {
        self.hysteresis.reset();
        self.drive = self.drive_at(self.hysteresis.output(), &mut 0);
        self.rejected = 0;
        self.rest();
    }
}
