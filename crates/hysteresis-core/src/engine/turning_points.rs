//! The memory of a family: a stack of turning points, each with fewer operators than the one below.

use core::hint::select_unpredictable;

use super::direction::Direction;
use crate::real::Real;
use crate::store::Store;

/// A reversal of the input that still determines the output of some operators.
///
/// The operators `[0, moved)` slid on the branch that ended here. Operator i among them was left at x - `a_i` if
/// the branch rose, and at max(0, x + `b_i`) if it fell; those before `at_zero` were left at zero.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct TurningPoint<T = f64> {
    /// The input at the reversal, in the family's own coordinate (mirrored for the negative family).
    pub input: T,
    /// The output of the whole model at the reversal: back at this input, the model is back at this output.
    pub output: T,
    /// The direction of the branch that ended here, in the same coordinate.
    pub ended: Direction,
    /// How many operators slid on that branch.
    pub moved: usize,
    /// How many of them rested at zero.
    pub at_zero: usize,
    /// The number of the reversal, counted from the virgin state: orders the memory in time.
    pub reversal: u64,
}

/// A turning point with what follows from it and from those below it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Remembered<T> {
    pub(crate) point: TurningPoint<T>,
    /// Sum of w p over the operators from `moved` on: those that older ones froze.
    pub(crate) beyond: f64,
    /// Where a branch of the other direction has set all its operators sliding again.
    pub(crate) released: T,
}

impl<T: Real> Remembered<T> {
    /// The bottom of every stack: all operators at zero, as if the input had come down to minus infinity. No move takes
    /// it off.
    pub(crate) fn virgin(operators: usize) -> Self {
        let point = TurningPoint {
            input: T::MIN,
            output: T::MIN,
            ended: Direction::Falling,
            moved: operators,
            at_zero: operators,
            reversal: 0,
        };
        Self { point, beyond: 0.0, released: T::INFINITY }
    }

    /// The input at which a branch in `direction` no longer needs it: back at the reversal, or all its operators slide.
    #[inline(always)]
    pub(crate) fn wiped_at(&self, direction: Direction) -> T {
        select_unpredictable(self.point.ended == direction, self.point.input, self.released)
    }
}

/// The turning points of a family above the virgin state, oldest first, in room allocated once. How many there are
/// is the branch's matter.
#[derive(Clone, Debug)]
pub(crate) struct Stack<T: Real, S: Store> {
    room: S::Of<Remembered<T>>,
    virgin: Remembered<T>,
}

impl<T: Real, S: Store> Stack<T, S> {
    /// The stack of a family at rest. Upwards `moved` falls strictly, from n at most, and is never zero: n places
    /// suffice.
    pub(crate) fn new(operators: usize) -> Self {
        let virgin = Remembered::virgin(operators);
        Self { room: S::filled(virgin, operators), virgin }
    }

    /// The oldest `count` turning points above the virgin state.
    #[cfg(feature = "alloc")]
    pub(crate) fn points(&self, count: usize) -> impl Iterator<Item = TurningPoint<T>> {
        self.room.as_ref().iter().take(count).map(|remembered| remembered.point)
    }

    /// The turning point number `height`, the virgin state being number 0.
    #[inline(always)]
    pub(crate) fn get(&self, height: usize) -> &Remembered<T> {
        self.room.as_ref().get(height.wrapping_sub(1)).unwrap_or(&self.virgin)
    }

    /// Changes the output that is remembered at a turning point.
    #[cfg(feature = "alloc")]
    pub(crate) fn set_output(&mut self, height: usize, output: T) {
        if let Some(entry) = self.room.as_mut().get_mut(height.wrapping_sub(1)) {
            entry.point.output = output;
        }
    }

    #[inline(always)]
    pub(crate) fn put(&mut self, height: usize, top: Remembered<T>) {
        debug_assert!(height <= self.room.as_ref().len());
        if let Some(entry) = self.room.as_mut().get_mut(height.wrapping_sub(1)) {
            *entry = top;
        }
    }
}
