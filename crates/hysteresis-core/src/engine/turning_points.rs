//! The memory of a family: a stack of turning points, each with fewer operators than the one below.

use alloc::boxed::Box;
use alloc::vec;
use core::hint::select_unpredictable;

use super::direction::Direction;

/// A reversal of the input that still determines the output of some operators.
///
/// The operators `[0, moved)` slid on the branch that ended here. Operator i among them was left at x - `a_i` if
/// the branch rose, and at max(0, x + `b_i`) if it fell; those before `at_zero` were left at zero.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct TurningPoint {
    /// The input at the reversal, in the family's own coordinate (mirrored for the negative family).
    pub input: f64,
    /// The output of the whole model at the reversal: back at this input, the model is back at this output.
    pub output: f64,
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
pub(crate) struct Remembered {
    pub(crate) point: TurningPoint,
    /// Sum of w p over the operators from `moved` on: those that older ones froze.
    pub(crate) beyond: f64,
    /// Where a branch of the other direction has set all its operators sliding again.
    pub(crate) released: f64,
}

impl Remembered {
    /// The bottom of every stack: all operators at zero, as if the input had come down to minus infinity. No move takes
    /// it off.
    pub(crate) const fn virgin(operators: usize) -> Self {
        let point = TurningPoint {
            input: f64::MIN,
            output: f64::MIN,
            ended: Direction::Falling,
            moved: operators,
            at_zero: operators,
            reversal: 0,
        };
        Self { point, beyond: 0.0, released: f64::INFINITY }
    }

    /// The input at which a branch in `direction` no longer needs it: back at the reversal, or all its operators slide.
    #[inline(always)]
    pub(crate) fn wiped_at(&self, direction: Direction) -> f64 {
        select_unpredictable(self.point.ended == direction, self.point.input, self.released)
    }
}

/// The turning points of a family above the virgin state, oldest first, in room allocated once. How many there are
/// is the branch's matter.
#[derive(Clone, Debug)]
pub(crate) struct Stack {
    room: Box<[Remembered]>,
    virgin: Remembered,
}

impl Stack {
    /// The stack of a family at rest. Upwards `moved` falls strictly, from n at most, and is never zero: n places
    /// suffice.
    pub(crate) fn new(operators: usize) -> Self {
        let virgin = Remembered::virgin(operators);
        Self { room: vec![virgin; operators].into(), virgin }
    }

    /// The oldest `count` turning points above the virgin state.
    pub(crate) fn points(&self, count: usize) -> impl Iterator<Item = TurningPoint> {
        self.room.iter().take(count).map(|remembered| remembered.point)
    }

    /// The turning point number `height`, the virgin state being number 0.
    #[inline(always)]
    pub(crate) fn get(&self, height: usize) -> &Remembered {
        self.room.get(height.wrapping_sub(1)).unwrap_or(&self.virgin)
    }

    /// Changes the output that is remembered at a turning point.
    pub(crate) fn set_output(&mut self, height: usize, output: f64) {
        if let Some(entry) = self.room.get_mut(height.wrapping_sub(1)) {
            entry.point.output = output;
        }
    }

    #[inline(always)]
    pub(crate) fn put(&mut self, height: usize, top: Remembered) {
        debug_assert!(height <= self.room.len());
        if let Some(entry) = self.room.get_mut(height.wrapping_sub(1)) {
            *entry = top;
        }
    }
}
