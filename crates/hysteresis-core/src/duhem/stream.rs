//! What steps: a Duhem operator with its state, and the inverse of a slope and an operator.

use crate::duhem::motion::{DuhemState, Motion};
use crate::duhem::parameters::Duhem;
use crate::error::{Error, check_finite, is_admissible};
use crate::process::Process;

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
        Ok(Self { duhem, gain, motion: Motion::at(&duhem, 0.0, 0.0), target: 0.0, rejected: 0 })
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
    /// As [`DuhemForward::set_state`].
    pub fn set_state(&mut self, state: &DuhemInverseState) -> Result<(), Error> {
        let target = check_finite("state.target", None, state.target)?;
        self.motion = Motion::restored(&self.duhem, &state.operator)?;
        self.target = target;
        Ok(())
    }

    /// The motion to a target.
    #[inline]
    fn moved(&self, target: f64) -> Motion {
        let mut motion = self.motion;
        motion.move_sum(&self.duhem, self.gain, self.target, target);
        motion
    }
}

impl<const N: usize> Process for DuhemInverse<N> {
    #[inline]
    fn step(&mut self, target: f64) -> f64 {
        if is_admissible(target) {
            (self.motion, self.target) = (self.moved(target), target);
        } else {
            self.rejected += 1;
        }
        self.motion.input()
    }

    #[inline]
    fn peek(&self, target: f64) -> f64 {
        if is_admissible(target) { self.moved(target).input() } else { self.motion.input() }
    }

    fn reset(&mut self) {
        self.motion = Motion::at(&self.duhem, 0.0, 0.0);
        (self.target, self.rejected) = (0.0, 0);
    }
}
