//! Where an operator is: on which branch, since when, and how far along it.

use crate::duhem::chain::{Chain, Piece, Place};
use crate::duhem::parameters::Duhem;
use crate::error::{Error, check_finite, check_model};

/// Everything that a Duhem operator remembers: its last input, and where its exponential began.
///
/// z follows from these. The anchor is where x turned round or z passed a knot, whichever came last, so a move in
/// parts has the bits of the whole move, and so has a restored one.
///
/// ```
/// use hysteresis_core::{Duhem, DuhemForward, Process};
/// let duhem = Duhem::<3>::from_bouc_wen(1.0, 1.0, 0.5, 0.25)?;
/// let mut forward = DuhemForward::new(duhem);
/// forward.step(0.5);
/// let saved = forward.state();
/// let next = forward.step(0.2);
/// forward.set_state(&saved)?;
/// assert_eq!(forward.step(0.2), next);
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct DuhemState {
    /// The fingerprint of the operator: [`Duhem::fingerprint`].
    pub model: u64,
    /// The last input x.
    pub input: f64,
    /// x where the present exponential began.
    pub anchor_input: f64,
    /// z there.
    pub anchor_output: f64,
    /// Whether x rose last.
    pub rising: bool,
}

/// A branch, in the coordinates in which it rises: x and z times the sign of their direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Motion {
    sign: f64,
    /// Of z: the same, or the other one where z falls as x rises.
    sign_of_z: f64,
    piece: Piece,
    /// The last x and z.
    last: f64,
    z: f64,
}

impl Motion {
    /// At rest.
    pub(super) fn at<const N: usize>(duhem: &Duhem<N>, x: f64, z: f64) -> Self {
        let z = duhem.sign * z;
        Self { sign: 1.0, sign_of_z: duhem.sign, piece: duhem.rising.piece(x, z, Place(0)), last: x, z }
    }

    #[inline]
    pub(super) fn input(&self) -> f64 {
        self.sign * self.last
    }

    #[inline]
    pub(super) fn output(&self) -> f64 {
        self.sign_of_z * self.z
    }

    #[inline]
    fn chain<'a, const N: usize>(&self, duhem: &'a Duhem<N>) -> &'a Chain<N> {
        if self.sign > 0.0 { &duhem.rising } else { &duhem.falling }
    }

    /// Begins a branch of the other direction where this one is.
    #[inline]
    fn turn<const N: usize>(&mut self, duhem: &Duhem<N>) {
        let near = self.chain(duhem).mirrored(self.piece.place);
        (self.sign, self.last) = (-self.sign, -self.last);
        (self.sign_of_z, self.z) = (-self.sign_of_z, -self.z);
        self.piece = self.chain(duhem).piece(self.last, self.z, near);
    }

    /// Goes on to a piece that has not `ended`, by the (x, z) of its end; `is_early` where a bound of an end cannot
    /// tell.
    #[inline]
    fn pass_knots<const N: usize>(&mut self, duhem: &Duhem<N>, is_early: bool, ended: impl Fn(f64, f64) -> bool) {
        let is_within = !ended(self.piece.end, self.piece.end_z);
        if is_within && (self.piece.end_is_exact || !is_early) {
            return;
        }
        let chain = self.chain(duhem);
        if !self.piece.end_is_exact {
            self.piece = chain.exact(&self.piece);
        }
        if ended(self.piece.end, self.piece.end_z) {
            self.piece = chain.behind(&self.piece, ended);
        }
    }

    /// Moves to an x.
    #[inline]
    pub(super) fn move_to<const N: usize>(&mut self, duhem: &Duhem<N>, x: f64) {
        if self.sign * x < self.last {
            self.turn(duhem);
        }
        let ahead = self.sign * x;
        self.pass_knots(duhem, false, |end, _| ahead >= end);
        (self.last, self.z) = (ahead, self.piece.at(ahead));
    }

    /// Moves to where `gain` x + z is `target`, having been `from`.
    #[inline]
    pub(super) fn move_sum<const N: usize>(&mut self, duhem: &Duhem<N>, gain: f64, from: f64, target: f64) {
        if self.sign * target < self.sign * from {
            self.turn(duhem);
        }
        let (ahead, sign) = (self.sign * target, duhem.sign);
        let sum = |x: f64, z: f64| gain * x + sign * z;
        // An end that is not exact comes too early: a bound of the sum from below unless `gain` is negative.
        self.pass_knots(duhem, gain < 0.0, |end, end_z| ahead >= sum(end, end_z));
        let growth = ahead - sum(self.piece.x, self.piece.z);
        // Rounding may put the solution behind the last one.
        self.last = self.piece.solve(gain, sign, growth.max(0.0), self.last.max(self.piece.x)).max(self.last);
        self.z = self.piece.at(self.last);
    }

    pub(super) fn state<const N: usize>(&self, duhem: &Duhem<N>) -> DuhemState {
        DuhemState {
            model: duhem.fingerprint(),
            input: self.input(),
            anchor_input: self.sign * self.piece.x,
            anchor_output: self.sign_of_z * self.piece.z,
            rising: self.sign > 0.0,
        }
    }

    /// From a saved state.
    pub(super) fn restored<const N: usize>(duhem: &Duhem<N>, state: &DuhemState) -> Result<Self, Error> {
        check_model(duhem.fingerprint(), state.model)?;
        let sign = if state.rising { 1.0 } else { -1.0 };
        let last = sign * check_finite("state.input", None, state.input)?;
        let x = sign * check_finite("state.anchor_input", None, state.anchor_input)?;
        let sign_of_z = sign * duhem.sign;
        let z = sign_of_z * check_finite("state.anchor_output", None, state.anchor_output)?;
        if x > last {
            let expected = "an input that does not lie ahead of the last one";
            return Err(Error::domain("state.anchor_input", None, expected, state.anchor_input));
        }
        let chain = if state.rising { &duhem.rising } else { &duhem.falling };
        let mut motion = Self { sign, sign_of_z, piece: chain.piece(x, z, Place(0)), last, z };
        motion.move_to(duhem, state.input);
        Ok(motion)
    }
}
