//! One hysteresis operator as a state machine: equations (1)-(3) and (5).
//!
//! An operator is a pure map from its last output and the new input to its new output. [`Tracked`] joins such a
//! map with its state, so that it can be stepped, peeked, reset and saved like every other stream.

use crate::error::{Error, check_all_finite, check_finite, check_non_negative, check_within, is_admissible};
use crate::process::Process;

/// A rate-independent operator whose whole memory is its last output.
pub trait Operator {
    /// The new output z(k) from the last output z(k-1) and the new input x(k).
    fn next(&self, last_output: f64, input: f64) -> f64;
}

/// An operator with its state.
///
/// ```
/// use hysteresis_core::{CoupledPlay, Process, Tracked};
/// let mut z = Tracked::new(CoupledPlay::new(10.0, 8.0, 3.0, 4.0)?); // Fig. 5 of the paper
/// let walk = [0.0, 20.0, -20.0, 15.0, 6.0, 25.0, -15.0, -5.0].map(|x| z.step(x));
/// assert_eq!(walk, [0.0, 10.0, -12.0, 5.0, 5.0, 15.0, -7.0, -7.0]);
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Tracked<O> {
    operator: O,
    output: f64,
    rejected: u64,
}

impl<O: Operator> Tracked<O> {
    /// The operator at rest: z = 0, projected onto the reachable interval by the first sample.
    pub fn new(operator: O) -> Self {
        Self { operator, output: 0.0, rejected: 0 }
    }

    /// The operator's parameters.
    pub fn operator(&self) -> &O {
        &self.operator
    }

    /// The last output, in the unit of the input: the whole memory of the operator.
    pub fn state(&self) -> f64 {
        self.output
    }

    /// Continues from the output `state`; the next sample projects it onto the reachable interval (erratum 6).
    ///
    /// # Errors
    /// [`Error::Domain`] unless `state` is finite.
    pub fn set_state(&mut self, state: f64) -> Result<(), Error> {
        self.output = check_finite("state", None, state)?;
        Ok(())
    }

    /// Takes over the inputs before, oldest first.
    ///
    /// # Errors
    /// [`Error::Domain`] for an input that is not finite; nothing is taken then.
    pub fn follow(&mut self, inputs: &[f64]) -> Result<(), Error> {
        check_all_finite("inputs", inputs)?;
        for input in inputs {
            self.step(*input);
        }
        Ok(())
    }

    /// How many inputs were not finite (or beyond 1e100) and left output and state as they were.
    pub fn rejected(&self) -> u64 {
        self.rejected
    }
}

impl<O: Operator> Process for Tracked<O> {
    #[inline]
    fn step(&mut self, input: f64) -> f64 {
        if is_admissible(input) {
            self.output = self.operator.next(self.output, input);
        } else {
            self.rejected = self.rejected.saturating_add(1);
        }
        self.output
    }

    #[inline]
    fn peek(&self, input: f64) -> f64 {
        if is_admissible(input) { self.operator.next(self.output, input) } else { self.output }
    }

    fn reset(&mut self) {
        self.output = 0.0;
        self.rejected = 0;
    }
}

/// The play (backlash) operator, equations (1)-(3): z(k) = max(x - r, min(x + r, z(k-1))).
///
/// `r >= 0` is the threshold in the unit of the input; the loop is 2 r wide.
///
/// ```
/// use hysteresis_core::{Operator, Play};
/// let play = Play::new(10.0)?;
/// assert_eq!(play.next(0.0, 25.0), 15.0); // pushed from the left
/// assert_eq!(play.next(15.0, 20.0), 15.0); // inside the gap nothing moves
/// assert_eq!(Play::default().next(0.0, 25.0), 25.0); // no gap: the identity
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Play {
    r: f64,
}

impl Play {
    /// A play of half-width `r`.
    ///
    /// # Errors
    /// [`Error::Domain`] unless `r` is finite and not negative.
    pub fn new(r: f64) -> Result<Self, Error> {
        Self::indexed("r", None, r)
    }

    /// [`new`](Self::new) for a threshold of another name, so that an error says it.
    pub(crate) fn indexed(parameter: &'static str, index: Option<usize>, r: f64) -> Result<Self, Error> {
        Ok(Self { r: check_non_negative(parameter, index, r)? })
    }

    /// The threshold r.
    #[must_use]
    pub fn r(&self) -> f64 {
        self.r
    }
}

impl Operator for Play {
    #[inline]
    fn next(&self, last_output: f64, input: f64) -> f64 {
        (input - self.r).max((input + self.r).min(last_output))
    }
}

/// The coupled-play (CP) operator, equation (5) with errata 1-6: z(k) = max(lo, min(hi, z(k-1))) with
/// lo(x) = max(x - r, min(0, x - rc)) and hi(x) = min(x + ra, max(0, x + rb)).
///
/// Rising, z follows x - rc below zero, sticks at zero from x = rc to x = r, then follows x - r. Falling, it
/// follows x + rb above zero, sticks at zero from x = -rb to x = -ra, then follows x + ra. All thresholds in the
/// unit of the input, r >= rc >= 0 and ra >= rb >= 0. With four equal thresholds it is the [`Play`](Play).
///
/// ```
/// use hysteresis_core::{CoupledPlay, Operator};
/// let cp = CoupledPlay::new(10.0, 8.0, 3.0, 4.0)?;
/// assert_eq!(cp.next(0.0, 20.0), 10.0);
/// assert_eq!(cp.next(10.0, 2.0), 5.0); // falling above zero: x + rb
/// assert_eq!(cp.next(5.0, -5.0), 0.0); // sticks at zero
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoupledPlay {
    r: f64,
    ra: f64,
    rb: f64,
    rc: f64,
}

impl CoupledPlay {
    /// A coupled play with the rising thresholds `r >= rc` and the falling thresholds `ra >= rb`.
    ///
    /// # Errors
    /// [`Error::Domain`] unless r >= rc >= 0 and ra >= rb >= 0, all finite.
    pub fn new(r: f64, ra: f64, rb: f64, rc: f64) -> Result<Self, Error> {
        Self::indexed(None, r, ra, rb, rc)
    }

    /// [`new`](Self::new) for operator `index` of a model, so that an error names it.
    pub(crate) fn indexed(index: Option<usize>, r: f64, ra: f64, rb: f64, rc: f64) -> Result<Self, Error> {
        let r = check_non_negative("r", index, r)?;
        let ra = check_non_negative("ra", index, ra)?;
        let rb = check_within("rb", index, rb, "ra", ra)?;
        let rc = check_within("rc", index, rc, "r", r)?;
        Ok(Self { r, ra, rb, rc })
    }

    /// Rising above zero: z = x - r.
    #[must_use]
    pub fn r(&self) -> f64 {
        self.r
    }

    /// Falling below zero: z = x + ra.
    #[must_use]
    pub fn ra(&self) -> f64 {
        self.ra
    }

    /// Falling above zero: z = x + rb.
    #[must_use]
    pub fn rb(&self) -> f64 {
        self.rb
    }

    /// Rising below zero: z = x - rc.
    #[must_use]
    pub fn rc(&self) -> f64 {
        self.rc
    }

    /// True if all thresholds are zero: z = x without memory.
    #[must_use]
    pub fn is_identity(&self) -> bool {
        self.r == 0.0 && self.ra == 0.0
    }
}

/// Four equal thresholds: max(x - r, min(x + r, z)) on both sides of zero.
impl From<Play> for CoupledPlay {
    fn from(play: Play) -> Self {
        let r = play.r();
        Self { r, ra: r, rb: r, rc: r }
    }
}

impl Operator for CoupledPlay {
    #[inline]
    fn next(&self, last_output: f64, input: f64) -> f64 {
        let lo = (input - self.r).max((input - self.rc).min(0.0));
        let hi = (input + self.ra).min((input + self.rb).max(0.0));
        lo.max(hi.min(last_output))
    }
}
