//! What steps: a Duhem operator with its state, and the inverse of a slope and an operator.

use crate::duhem::motion::{DuhemState, Motion};
use crate::duhem::parameters::Duhem;
use crate::error::{Bound, Error, MAX_MAGNITUDE, check_finite, is_admissible};
use crate::process::Process;
use crate::real::check_limits;

/// The output z of a Duhem operator, sample by sample; x goes straight from one sample to the next.
///
/// Begins at x = 0 and z = 0, or where [`starting_at`](Self::starting_at) says. An input that is not finite, or
/// beyond 1e100, leaves output and memory as they are and is counted. z is held within 1e100.
///
/// ```
/// use hysteresis_core::{Duhem, DuhemForward, Process};
/// let mut forward = DuhemForward::new(Duhem::<3>::from_bouc_wen(1.0, 1.0, 0.5, 0.25)?);
/// let up = forward.step(1.0);
/// assert!((up - (1.0 - f64::exp(-0.75)) / 0.75).abs() < 1e-15);
/// assert!(forward.step(0.0) < 0.0 && forward.peek(1.0) > forward.output());
/// assert_eq!((forward.step(f64::NAN), forward.rejected()), (forward.output(), 1));
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct DuhemForward<const N: usize> {
    duhem: Duhem<N>,
    start: Motion,
    motion: Motion,
    rejected: u64,
}

impl<const N: usize> DuhemForward<N> {
    /// At x = 0 and z = 0.
    #[must_use]
    pub fn new(duhem: Duhem<N>) -> Self {
        let start = Motion::at(&duhem, 0.0, 0.0);
        Self { duhem, start, motion: start, rejected: 0 }
    }

    /// At any x and z.
    ///
    /// # Errors
    /// [`Error::Domain`] for a number that is not finite or beyond 1e100.
    pub fn starting_at(duhem: Duhem<N>, x: f64, z: f64) -> Result<Self, Error> {
        let start = Motion::at(&duhem, check_finite("x", None, x)?, check_finite("z", None, z)?);
        Ok(Self { duhem, start, motion: start, rejected: 0 })
    }

    /// The last input.
    #[must_use]
    pub fn input(&self) -> f64 {
        self.motion.input()
    }

    /// The last output.
    #[must_use]
    pub fn output(&self) -> f64 {
        self.motion.output()
    }

    /// How many inputs were not admissible.
    #[must_use]
    pub fn rejected(&self) -> u64 {
        self.rejected
    }

    /// Its parameters.
    #[must_use]
    pub fn duhem(&self) -> &Duhem<N> {
        &self.duhem
    }

    /// Everything that it remembers.
    #[must_use]
    pub fn state(&self) -> DuhemState {
        self.motion.state(&self.duhem)
    }

    /// The input at which the output is a target, on the straight way there.
    #[cfg(feature = "alloc")]
    pub(crate) fn input_at(&self, target: f64) -> f64 {
        let mut motion = self.motion;
        motion.move_sum(&self.duhem, 0.0, motion.output(), target);
        motion.input()
    }

    /// Goes on from a saved state, bit for bit.
    ///
    /// # Errors
    /// [`Error::OtherModel`] for a state of another operator, [`Error::Domain`] for a number that is not finite, or an
    /// anchor ahead of the input; the stream is as before then.
    pub fn set_state(&mut self, state: &DuhemState) -> Result<(), Error> {
        self.motion = Motion::restored(&self.duhem, state)?;
        Ok(())
    }
}

impl<const N: usize> Process for DuhemForward<N> {
    #[inline]
    fn step(&mut self, input: f64) -> f64 {
        if is_admissible(input) {
            self.motion.move_to(&self.duhem, input);
        } else {
            self.rejected += 1;
        }
        self.motion.output()
    }

    #[inline]
    fn peek(&self, input: f64) -> f64 {
        let mut motion = self.motion;
        if is_admissible(input) {
            motion.move_to(&self.duhem, input);
        }
        motion.output()
    }

    fn reset(&mut self) {
        (self.motion, self.rejected) = (self.start, 0);
    }
}

/// The x at which `gain` x + z\[x\] is a target, sample by sample: the exact inverse of a Duhem operator beside a
/// slope.
///
/// On a branch the sum rises with x as long as `gain` + f is above 0. It holds x and an exponential of x, so there is
/// no closed form but for a constant f: the piece on which it ends is found by its end values, and the x there by
/// Newton's method from one side within a bracket, to the last bits. Every target that is admissible is reached,
/// unless x would be beyond 1e100. A target that is not finite, or beyond 1e100, leaves everything as it is and is
/// counted.
///
/// x may have limits ([`within`](Self::within)). Then it is a source for the feed-forward of a
/// [`HybridController`](crate::HybridController::with_source), also where nothing may allocate.
///
/// ```
/// use hysteresis_core::{Duhem, DuhemForward, DuhemInverse, Process};
/// let duhem = Duhem::<3>::from_bouc_wen(1.0, 1.0, 0.5, 0.25)?;
/// let (mut inverse, mut forward) = (DuhemInverse::new(duhem, 0.3)?, DuhemForward::new(duhem));
/// for target in [1.0, 0.4, -3.0, 2.0] {
///     let x = inverse.step(target);
///     assert!((0.3 * x + forward.step(x) - target).abs() < 1e-15 * 8.0);
/// }
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct DuhemInverse<const N: usize> {
    duhem: Duhem<N>,
    gain: f64,
    motion: Motion,
    target: f64,
    limits: (f64, f64),
    rejected: u64,
}

/// Everything that the inverse remembers.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct DuhemInverseState {
    /// The memory of the operator.
    pub operator: DuhemState,
    /// The last target.
    pub target: f64,
}

impl<const N: usize> DuhemInverse<N> {
    /// At x = 0 and z = 0.
    ///
    /// # Errors
    /// [`Error::Domain`] unless `gain` is at most 1e50 and above minus the smallest f, [`Duhem::min_slope`], by more
    /// than rounding.
    pub fn new(duhem: Duhem<N>, gain: f64) -> Result<Self, Error> {
        let slope = duhem.min_slope();
        if gain.is_nan() || gain > 1e50 || gain + slope < 1e-12 * slope.abs() {
            let expected = "a number above minus the smallest f, at most 1e50, so that the sum rises with x";
            return Err(Error::domain("gain", None, expected, gain));
        }
        let limits = (-MAX_MAGNITUDE, MAX_MAGNITUDE);
        Ok(Self { duhem, gain, motion: Motion::at(&duhem, 0.0, 0.0), target: 0.0, limits, rejected: 0 })
    }

    /// The same whose x never leaves (low, high): a target out of reach holds the limit before it. It begins where x is
    /// 0, or at the limit nearest to that.
    ///
    /// ```
    /// use hysteresis_core::{Duhem, DuhemInverse, Process};
    /// let duhem = Duhem::<3>::from_bouc_wen(1.0, 1.0, 0.5, 0.25)?;
    /// let mut inverse = DuhemInverse::new(duhem, 0.3)?.within((-2.0, 2.0))?;
    /// assert_eq!(inverse.step(99.0), 2.0);
    /// assert!(inverse.step(0.5) < 2.0); // and comes back at once
    /// # Ok::<(), hysteresis_core::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::Domain`] unless both limits are finite and low < high.
    pub fn within(mut self, limits: (f64, f64)) -> Result<Self, Error> {
        self.limits = check_limits(Some(limits))?;
        self.reset();
        Ok(self)
    }

    /// The limits of x (low, high), if there are any.
    #[must_use]
    pub fn limits(&self) -> Option<(f64, f64)> {
        (self.limits != (-MAX_MAGNITUDE, MAX_MAGNITUDE)).then_some(self.limits)
    }

    /// Puts out another x than the one that a target asks for, within the limits, and remembers it. Returns the sum
    /// there. An x that is not finite is counted and changes nothing else.
    pub fn follow_drive(&mut self, x: f64) -> f64 {
        if is_admissible(x) {
            let (low, high) = self.limits;
            self.motion.move_to(&self.duhem, x.max(low).min(high));
            self.target = self.sum(&self.motion);
        } else {
            self.rejected += 1;
        }
        self.target
    }

    /// The last x.
    #[must_use]
    pub fn output(&self) -> f64 {
        self.motion.input()
    }

    /// z there.
    #[must_use]
    pub fn hysteresis(&self) -> f64 {
        self.motion.output()
    }

    /// How many targets were not admissible.
    #[must_use]
    pub fn rejected(&self) -> u64 {
        self.rejected
    }

    /// The slope beside the operator.
    #[must_use]
    pub fn gain(&self) -> f64 {
        self.gain
    }

    /// The parameters of the operator.
    #[must_use]
    pub fn duhem(&self) -> &Duhem<N> {
        &self.duhem
    }

    /// Everything that it remembers.
    #[must_use]
    pub fn state(&self) -> DuhemInverseState {
        DuhemInverseState { operator: self.motion.state(&self.duhem), target: self.target }
    }

    /// Goes on from a saved state, bit for bit.
    ///
    /// # Errors
    /// As [`DuhemForward::set_state`], and [`Error::Domain`] for an x outside the limits.
    pub fn set_state(&mut self, state: &DuhemInverseState) -> Result<(), Error> {
        let target = check_finite("state.target", None, state.target)?;
        let (motion, (low, high)) = (Motion::restored(&self.duhem, &state.operator)?, self.limits);
        let got = motion.input();
        if !(low <= got && got <= high) {
            let expected = Bound::Between { low, high };
            return Err(Error::Domain { parameter: "state.input", index: None, expected, got });
        }
        (self.motion, self.target) = (motion, target);
        Ok(())
    }

    /// `gain` x + z.
    fn sum(&self, motion: &Motion) -> f64 {
        self.gain * motion.input() + motion.output()
    }

    /// The motion to a target, or to the limit before it, and what is reached there.
    #[inline]
    fn moved(&self, target: f64) -> (Motion, f64) {
        let mut motion = self.motion;
        motion.move_sum(&self.duhem, self.gain, self.target, target);
        let (low, high) = self.limits;
        let within = motion.input().max(low).min(high);
        if within == motion.input() {
            return (motion, target);
        }
        let mut motion = self.motion;
        motion.move_to(&self.duhem, within);
        (motion, self.sum(&motion))
    }
}

impl<const N: usize> Process for DuhemInverse<N> {
    #[inline]
    fn step(&mut self, target: f64) -> f64 {
        if is_admissible(target) {
            (self.motion, self.target) = self.moved(target);
        } else {
            self.rejected += 1;
        }
        self.motion.input()
    }

    #[inline]
    fn peek(&self, target: f64) -> f64 {
        if is_admissible(target) { self.moved(target).0.input() } else { self.motion.input() }
    }

    fn reset(&mut self) {
        self.motion = Motion::at(&self.duhem, 0.0, 0.0);
        self.follow_drive(0.0);
        self.rejected = 0;
    }
}
