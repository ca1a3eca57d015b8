//! A hysteresis and a Duhem operator beside it: the sum of both, and its exact inverse.

use alloc::boxed::Box;

use super::parts::{MAX_KNOTS, QuasiStatic};
use crate::duhem::{Duhem, DuhemForward, DuhemState};
use crate::engine::CompiledModel;
use crate::error::{Error, MAX_MAGNITUDE, check_all_finite, check_length};
use crate::process::Process;
use crate::stream::{Forward, Inverse, Look, StreamState};

/// The name under which a state has the memory of the operator, behind others.
const STATE: &str = "state.loop_shift";

/// How many drives are looked at for a target at most; every fourth one halves what is left.
const MOST_LOOKS: u32 = 256;

/// The sum rises where its least slope is above this share of that of the hysteresis.
const LEAST_SLOPE: f64 = 1e-9;

/// A sum of two outputs is as near to a target as this times their magnitudes: rounding.
const ROUNDING: f64 = 2.0 * f64::EPSILON;

/// A hysteresis with the operator beside it, if there is one.
#[derive(Clone, Debug)]
pub(super) struct Beside<H> {
    pub(super) hysteresis: H,
    duhem: Option<Box<DuhemForward<MAX_KNOTS>>>,
    /// What says how far the drive may have to go for a target at most.
    most: Most,
}

/// How far the drive may have to go for a target of a sum at most.
#[derive(Clone, Copy, Debug)]
enum Most {
    /// To where the hysteresis alone would do the whole way, as both grow with the drive.
    Hysteresis,
    /// To where the operator alone would: the hysteresis has no inverse, as where it is flat after a reversal.
    Operator,
    /// To where the least slope of the sum leads, as z falls while the drive rises.
    Slope(f64),
}

impl Most {
    fn of(model: &CompiledModel, duhem: Option<&Duhem<MAX_KNOTS>>) -> Self {
        match duhem.map(Duhem::min_slope) {
            Some(z) if z < 0.0 => Self::Slope(model.slope_range().0 + z),
            Some(_) if model.invertible.is_err() => Self::Operator,
            _ => Self::Hysteresis,
        }
    }
}

/// Checks that the sum rises with the drive.
pub(super) fn check_rises(model: &CompiledModel, duhem: Option<&Duhem<MAX_KNOTS>>) -> Result<(), Error> {
    match Most::of(model, duhem) {
        Most::Operator if model.negative_weight().is_none() => Ok(()),
        Most::Slope(least) if model.invertible.is_ok() && least <= LEAST_SLOPE * model.slope_range().0 => {
            let expected = "a Duhem operator that falls less than the flattest slope of the hysteresis rises";
            Err(Error::domain("duhem", None, expected, duhem.map_or(0.0, Duhem::min_slope)))
        }
        _ => model.invertible,
    }
}

/// A drive, and what both put out there.
#[derive(Clone, Copy)]
struct At {
    x: f64,
    h: f64,
    z: f64,
}

impl At {
    fn sum(self) -> f64 {
        self.h + self.z
    }

    /// Whether it has this sum but for rounding.
    fn is_at(self, target: f64) -> bool {
        (target - self.sum()).abs() <= ROUNDING * (self.h.abs() + self.z.abs() + target.abs())
    }
}

impl<H: Process> Beside<H> {
    /// Both where the hysteresis is, at `x`; z is 0 at its input offset.
    pub(super) fn new(model: &QuasiStatic, hysteresis: H, x: f64) -> Self {
        let at_rest = |duhem: &Duhem<MAX_KNOTS>| {
            let mut duhem = DuhemForward::starting_at(*duhem, model.hysteresis().offsets.input, 0.0).ok()?;
            duhem.step(x);
            Some(Box::new(duhem))
        };
        let most = Most::of(model.hysteresis(), model.duhem());
        Self { hysteresis, duhem: model.duhem().and_then(at_rest), most }
    }

    /// z.
    #[inline]
    fn beside(&self) -> f64 {
        self.duhem.as_ref().map_or(0.0, |duhem| duhem.output())
    }

    #[inline]
    fn move_duhem(&mut self, x: f64) -> f64 {
        self.duhem.as_mut().map_or(0.0, |duhem| duhem.step(x))
    }

    /// The parameters of the hysteresis have changed: the operators are the same.
    pub(super) fn take_over(&mut self, model: &CompiledModel) {
        self.most = Most::of(model, self.duhem.as_ref().map(|duhem| duhem.duhem()));
    }

    /// Both at rest where the hysteresis begins, at `x`.
    fn reset_to(&mut self, x: impl FnOnce(&H) -> f64) {
        self.hysteresis.reset();
        let x = x(&self.hysteresis);
        if let Some(duhem) = &mut self.duhem {
            duhem.reset();
            duhem.step(x);
        }
    }

    /// The memory of the operator: its last input, where its exponential began, and 1 for rising or -1.
    pub(super) fn memory(&self) -> Option<[f64; 4]> {
        let of = |DuhemState { input, anchor_input, anchor_output, rising, .. }| {
            [input, anchor_input, anchor_output, if rising { 1.0 } else { -1.0 }]
        };
        self.duhem.as_ref().map(|duhem| of(duhem.state()))
    }

    /// Splits what a state has behind others into theirs and that of the operator.
    pub(super) fn split<'a>(&self, states: &'a [f64]) -> (&'a [f64], &'a [f64]) {
        let others = if self.duhem.is_some() { states.len().saturating_sub(4) } else { states.len() };
        states.split_at_checked(others).unwrap_or((states, &[]))
    }

    /// Continues from the memory of the operator and the state of the hysteresis, or stays as it is.
    pub(super) fn restore(
        &mut self,
        memory: &[f64],
        set_state: impl FnOnce(&mut H) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let Some(duhem) = &mut self.duhem else { return set_state(&mut self.hysteresis) };
        let &[input, anchor_input, anchor_output, direction] = memory else {
            return check_length(STATE, 4, memory.len());
        };
        check_all_finite(STATE, memory)?;
        if direction.abs() != 1.0 {
            return Err(Error::domain(STATE, None, "1 where x rose last, or -1, as the last number", direction));
        }
        let before = duhem.state();
        duhem.set_state(&DuhemState { input, anchor_input, anchor_output, rising: direction > 0.0, ..before })?;
        set_state(&mut self.hysteresis).inspect_err(|_| {
            // It was in that state.
            let _ = duhem.set_state(&before);
        })
    }
}

impl Beside<Forward> {
    pub(super) fn output(&self) -> f64 {
        self.hysteresis.output() + self.beside()
    }

    #[inline]
    pub(super) fn step(&mut self, x: f64) -> f64 {
        let h = self.hysteresis.step(x);
        if self.duhem.is_some() { h + self.move_duhem(x) } else { h }
    }

    #[inline]
    pub(super) fn peek(&self, x: f64) -> f64 {
        let h = self.hysteresis.peek(x);
        self.duhem.as_ref().map_or(h, |duhem| h + duhem.peek(x))
    }

    pub(super) fn reset(&mut self, model: &CompiledModel) {
        self.reset_to(|_| model.offsets.input);
    }

    pub(super) fn state(&self) -> StreamState {
        self.hysteresis.state()
    }
}

impl Beside<Inverse> {
    /// The sum at the present drive.
    #[inline]
    pub(super) fn reached(&self) -> f64 {
        self.hysteresis.reached() + self.beside()
    }

    #[inline]
    pub(super) fn step(&mut self, target: f64) -> f64 {
        let Some(duhem) = &mut self.duhem else { return self.hysteresis.step(target) };
        let look = look(&self.hysteresis, duhem, self.most, target);
        self.hysteresis.move_to_limit(look.drive, look.saturated);
        duhem.step(look.drive);
        look.drive
    }

    #[inline]
    pub(super) fn peek(&self, target: f64) -> f64 {
        match &self.duhem {
            Some(duhem) => look(&self.hysteresis, duhem, self.most, target).drive,
            None => self.hysteresis.peek(target),
        }
    }

    /// Where [`step`](Self::step) would come to.
    #[inline]
    pub(super) fn look(&self, target: f64) -> Look {
        match &self.duhem {
            Some(duhem) => look(&self.hysteresis, duhem, self.most, target),
            None => self.hysteresis.look(target),
        }
    }

    /// The sum that [`follow_drive`](Self::follow_drive) would come to.
    #[inline]
    pub(super) fn look_at_drive(&self, x: f64) -> f64 {
        let h = self.hysteresis.look_at_drive(x);
        self.duhem.as_ref().map_or(h, |duhem| h + duhem.peek(x))
    }

    #[inline]
    pub(super) fn follow_drive(&mut self, x: f64) {
        self.hysteresis.follow_drive(x);
        let x = self.hysteresis.output();
        self.move_duhem(x);
    }

    pub(super) fn reset(&mut self) {
        self.reset_to(Inverse::output);
    }

    pub(super) fn state(&self) -> StreamState {
        self.hysteresis.state()
    }
}

/// The drive at which the sum is a target, or the limit before it.
///
/// That to which it may have to go at `most` is too far. The present one is not far enough. In between Newton's method
/// looks, with the exact slope of z and that of the hysteresis between the last two looks: on one of its lines that is
/// exact, too.
fn look(hysteresis: &Inverse, duhem: &DuhemForward<MAX_KNOTS>, most: Most, target: f64) -> Look {
    let mut near = At { x: hysteresis.output(), h: hysteresis.reached(), z: duhem.output() };
    let found = |at: At, saturated| Look { drive: at.x, reached: at.sum(), saturated };
    let rising = target > near.sum();
    if near.is_at(target) {
        return found(near, false);
    }
    let at = |x: f64| At { x, h: hysteresis.look_at_drive(x), z: duhem.peek(x) };
    let is_beyond = |at: At| if rising { at.sum() > target } else { at.sum() < target };
    let within = |reach: f64| {
        let (low, high) = hysteresis.limits().unwrap_or((-MAX_MAGNITUDE, MAX_MAGNITUDE));
        (reach.max(low).min(high), !(low < reach && reach < high))
    };
    let (furthest, at_limit) = match most {
        Most::Hysteresis => {
            let alone = hysteresis.look(target - near.z);
            (alone.drive, alone.saturated)
        }
        Most::Operator => within(duhem.input_at(target - near.h)),
        Most::Slope(least) => within(near.x + (target - near.sum()) / least),
    };
    let mut far = at(furthest);
    if !is_beyond(far) {
        return found(far, at_limit && !far.is_at(target));
    }
    let (mut before, mut last) = (near, far);
    for number in 1..MOST_LOOKS {
        if last.is_at(target) {
            break;
        }
        let slope = (last.h - before.h) / (last.x - before.x) + duhem.duhem().slope(last.z, rising);
        let newton = last.x + (target - last.sum()) / slope;
        let is_between = (near.x < newton && newton < far.x) || (far.x < newton && newton < near.x);
        let next = if is_between && number % 4 != 0 { newton } else { near.x + 0.5 * (far.x - near.x) };
        if next == near.x || next == far.x {
            break;
        }
        (before, last) = (last, at(next));
        if is_beyond(last) {
            far = last;
        } else {
            near = last;
        }
    }
    found(last, false)
}
