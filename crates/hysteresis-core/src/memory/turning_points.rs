//! The memory of a family: a stack of turning points, each with fewer operators than the one below.

use alloc::boxed::Box;
use alloc::vec;

/// Which way the input moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum Direction {
    /// Towards larger inputs.
    Rising,
    /// Towards smaller inputs.
    Falling,
}

impl Direction {
    /// +1 or -1: turns a falling branch into a rising one of the mirrored input.
    #[inline]
    pub(crate) fn sign(self) -> f64 {
        match self {
            Self::Rising => 1.0,
            Self::Falling => -1.0,
        }
    }

    /// The one of two limits, low and high, that lies ahead.
    #[inline]
    pub(crate) fn limit(self, (low, high): (f64, f64)) -> f64 {
        match self {
            Self::Rising => high,
            Self::Falling => low,
        }
    }

    /// Whether a move goes the other way.
    #[inline]
    pub(crate) fn leads_away(self, from: f64, to: f64) -> bool {
        match self {
            Self::Rising => to < from,
            Self::Falling => to > from,
        }
    }

    /// Whether the input, come to `x`, has reached `mark`.
    #[inline]
    pub(crate) fn has_passed(self, mark: f64, x: f64) -> bool {
        match self {
            Self::Rising => mark <= x,
            Self::Falling => mark >= x,
        }
    }

    /// Of two inputs that lie ahead, the one that comes first.
    #[inline]
    pub(crate) fn nearer(self, one: f64, other: f64) -> f64 {
        match self {
            Self::Rising => one.min(other),
            Self::Falling => one.max(other),
        }
    }

    #[inline]
    pub(crate) fn reversed(self) -> Self {
        match self {
            Self::Rising => Self::Falling,
            Self::Falling => Self::Rising,
        }
    }
}

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

impl TurningPoint {
    /// The bottom of every stack: all operators at zero, as if the input had come down to minus infinity.
    pub(crate) const fn virgin(operators: usize) -> Self {
        Self {
            input: f64::MIN,
            output: f64::MIN,
            ended: Direction::Falling,
            moved: operators,
            at_zero: operators,
            reversal: 0,
        }
    }
}

/// A turning point with the sum of w p over the operators from `moved` on: those that older ones froze.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Remembered {
    pub(crate) point: TurningPoint,
    pub(crate) beyond: f64,
}

/// Room for the turning points of a family, oldest first, allocated once. How many there are is the branch's matter.
#[derive(Clone, Debug)]
pub(crate) struct Stack(Box<[Remembered]>);

impl Stack {
    /// The stack of a family at rest. `moved` falls strictly from the bottom (n) upwards and is never zero above
    /// it, so n + 1 places always suffice.
    pub(crate) fn new(operators: usize) -> Self {
        let virgin = Remembered { point: TurningPoint::virgin(operators), beyond: 0.0 };
        Self(vec![virgin; operators + 1].into())
    }

    /// The oldest `count` turning points above the virgin state.
    pub(crate) fn points(&self, count: usize) -> impl Iterator<Item = TurningPoint> {
        self.0[1..=count].iter().map(|remembered| remembered.point)
    }

    /// The turning point with `below` others under it.
    #[inline]
    pub(crate) fn get(&self, below: usize) -> Remembered {
        self.0[below]
    }

    #[inline]
    pub(crate) fn put(&mut self, below: usize, top: Remembered) {
        self.0[below] = top;
    }
}
