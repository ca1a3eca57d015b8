//! The numbers that streams work with: f64, or f32 where the processor has nothing wider.

use core::fmt::Debug;
use core::ops::{Add, Div, Mul, Neg, Sub};

#[cfg(feature = "alloc")]
use crate::error::check_same;
use crate::error::{Bound, Error, MAX_MAGNITUDE};

/// The numbers of inputs, outputs and thresholds: `f64` or `f32`.
///
/// Sums over operators are always kept in `f64` and rounded once, to the line on which a stream is. So `f32` loses what
/// its own inputs and outputs cannot hold, and nothing more, however many operators and turning points there are. Where
/// the processor has no `f64` in hardware, that costs time where a line changes; a sample that stays on its line takes
/// none.
///
/// ```
/// use hysteresis_core::Real;
/// assert_eq!(<f64 as Real>::MAX_MAGNITUDE, hysteresis_core::MAX_MAGNITUDE);
/// assert!(<f32 as Real>::MAX_MAGNITUDE.is_admissible() && !f32::NAN.is_admissible());
/// ```
pub trait Real:
    sealed::Sealed
    + Copy
    + Debug
    + Default
    + PartialEq
    + PartialOrd
    + Neg<Output = Self>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + 'static
{
    /// 0.
    const ZERO: Self;
    /// 1.
    const ONE: Self;
    /// 1/2.
    const HALF: Self;
    /// Above all others.
    const INFINITY: Self;
    /// No number.
    const NAN: Self;
    /// The lowest finite number.
    const MIN: Self;
    /// The largest magnitude that any input, threshold, weight or offset may have, so that products of three and sums
    /// over operators stay finite: 1e100, in `f32` 1e11.
    const MAX_MAGNITUDE: Self;
    /// In words, what is admissible.
    #[doc(hidden)]
    const FINITE: Bound;
    /// Slopes below this share of the sum of |w| are not told from zero after rounding.
    #[doc(hidden)]
    const MIN_RELATIVE_SLOPE: f64;

    /// The same number in `f64`.
    #[must_use]
    fn wide(self) -> f64;

    /// The nearest number to one in `f64`.
    #[must_use]
    fn narrow(wide: f64) -> Self;

    /// The magnitude.
    #[must_use]
    fn abs(self) -> Self;

    /// The larger of two numbers, `other` if this is none.
    #[must_use]
    fn max(self, other: Self) -> Self;

    /// The smaller of two numbers, `other` if this is none.
    #[must_use]
    fn min(self, other: Self) -> Self;

    /// One over it.
    #[must_use]
    fn recip(self) -> Self;

    /// The whole number at or below it, within what 32 bits can count; 0 for what is none.
    #[must_use]
    fn whole(self) -> usize;

    /// Whether it is finite and at most [`MAX_MAGNITUDE`](Self::MAX_MAGNITUDE) in magnitude: what streams take, and
    /// nothing else.
    #[inline]
    #[must_use]
    fn is_admissible(self) -> bool {
        self.abs() <= Self::MAX_MAGNITUDE
    }
}

mod sealed {
    pub trait Sealed {}
    impl Sealed for f64 {}
    impl Sealed for f32 {}
}

macro_rules! real {
    ($real:ident, $largest:expr, $finite:expr, $min_slope:expr, $wide:expr, $narrow:expr) => {
        impl Real for $real {
            const ZERO: Self = 0.0;
            const ONE: Self = 1.0;
            const HALF: Self = 0.5;
            const INFINITY: Self = $real::INFINITY;
            const NAN: Self = $real::NAN;
            const MIN: Self = $real::MIN;
            const MAX_MAGNITUDE: Self = $largest;
            const FINITE: Bound = $finite;
            const MIN_RELATIVE_SLOPE: f64 = $min_slope;

            #[inline(always)]
            fn wide(self) -> f64 {
                $wide(self)
            }

            #[inline(always)]
            fn narrow(wide: f64) -> Self {
                $narrow(wide)
            }

            #[inline(always)]
            fn abs(self) -> Self {
                $real::abs(self)
            }

            #[inline(always)]
            fn max(self, other: Self) -> Self {
                $real::max(self, other)
            }

            #[inline(always)]
            fn min(self, other: Self) -> Self {
                $real::min(self, other)
            }

            #[inline(always)]
            fn recip(self) -> Self {
                $real::recip(self)
            }

            #[inline(always)]
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates, and NaN gives 0")]
            fn whole(self) -> usize {
                self as u32 as usize
            }
        }
    };
}

#[expect(clippy::cast_possible_truncation, reason = "to the nearest that there is")]
const fn rounded(wide: f64) -> f32 {
    wide as f32
}

real!(f64, MAX_MAGNITUDE, Bound::Finite, 1e-12, core::convert::identity, core::convert::identity);
// As many roundings above zero as in f64.
real!(f32, 1e11, Bound::Single, 5e-4, f64::from, rounded);

/// Checks one number of either kind, or names it.
fn check_admissible<T: Real>(parameter: &'static str, index: Option<usize>, got: T) -> Result<T, Error> {
    if got.is_admissible() {
        return Ok(got);
    }
    Err(Error::Domain { parameter, index, expected: T::FINITE, got: got.wide() })
}

/// Checks a pair (low, high) of admissible numbers, or names it.
pub(crate) fn check_range<T: Real>(
    parameter: &'static str,
    (low, high): (T, T),
    low_name: &'static str,
) -> Result<(), Error> {
    check_admissible(parameter, Some(0), low)?;
    check_admissible(parameter, Some(1), high)?;
    if low < high {
        return Ok(());
    }
    let expected = Bound::Above { what: low_name, limit: low.wide() };
    Err(Error::Domain { parameter, index: Some(1), expected, got: high.wide() })
}

/// A state that decays by itself, and 0 once it has faded.
///
/// Decays end at numbers below 2.2e-308, with which processors work many times slower: a stage at rest would take
/// longer than one that moves. What is left out is below 1e-150, in the unit of the state. It is looked for where what
/// drives the state has faded, too: nothing else fades, and a branch that is foreseen costs a moving stage nothing.
///
/// ```
/// use hysteresis_core::unless_faded;
/// assert_eq!([1e-9, -1e-149, 1e-151, -1e-310].map(unless_faded), [1e-9, -1e-149, 0.0, 0.0]);
/// ```
#[inline]
#[must_use]
pub fn unless_faded(state: f64) -> f64 {
    /// No factor of a sample brings a number from here below 2.2e-308 and leaves something to decay further.
    const FADED: f64 = 1e-150;
    if state.abs() < FADED { 0.0 } else { state }
}

/// Limits of a drive that has none.
pub(crate) fn unlimited<T: Real>() -> (T, T) {
    (-T::MAX_MAGNITUDE, T::MAX_MAGNITUDE)
}

/// Limits (low, high) of a drive, checked; without any, all that is admissible.
pub(crate) fn check_limits<T: Real>(limits: Option<(T, T)>) -> Result<(T, T), Error> {
    let Some(limits) = limits else { return Ok(unlimited()) };
    check_range("limits", limits, "the low limit")?;
    Ok(limits)
}

/// Checks that drives lie within limits, or names the first that does not.
pub(crate) fn check_within_limits<T: Real>(
    parameter: &'static str,
    drives: &[T],
    (low, high): (T, T),
) -> Result<(), Error> {
    match drives.iter().enumerate().find(|(_, drive)| !(low <= **drive && **drive <= high)) {
        None => Ok(()),
        Some((index, got)) => {
            let expected = Bound::Between { low: low.wide(), high: high.wide() };
            Err(Error::Domain { parameter, index: Some(index), expected, got: got.wide() })
        }
    }
}

/// A count as a number, exact below 2^53.
#[expect(clippy::cast_precision_loss, reason = "a count of things in memory")]
pub(crate) fn count_as_f64(count: usize) -> f64 {
    count as f64
}

/// Checks how many operators a new model has against the running stream.
#[cfg(feature = "alloc")]
pub(crate) fn check_same_count(expected: usize, got: usize) -> Result<(), Error> {
    check_same("number of operators", count_as_f64(expected), count_as_f64(got))
}
