//! Which way the input moves, and what that makes of "before" and "after".

use crate::real::Real;

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
    /// Of a move of the input; falling if it was nowhere before.
    #[cfg(feature = "alloc")]
    #[inline(always)]
    pub(crate) fn of_move(from: f64, to: f64) -> Self {
        if to >= from { Self::Rising } else { Self::Falling }
    }

    /// +1 or -1: turns a falling branch into a rising one of the mirrored input.
    #[inline(always)]
    pub(crate) fn sign<T: Real>(self) -> T {
        match self {
            Self::Rising => T::ONE,
            Self::Falling => -T::ONE,
        }
    }

    /// The one of two limits, low and high, that lies ahead.
    #[inline(always)]
    pub(crate) fn limit<T: Real>(self, (low, high): (T, T)) -> T {
        match self {
            Self::Rising => high,
            Self::Falling => low,
        }
    }

    /// Whether a move goes the other way.
    #[inline(always)]
    pub(crate) fn leads_away<T: Real>(self, from: T, to: T) -> bool {
        match self {
            Self::Rising => to < from,
            Self::Falling => to > from,
        }
    }

    /// Whether the input, come to `x`, has reached `mark`.
    #[inline(always)]
    pub(crate) fn has_passed<T: Real>(self, mark: T, x: T) -> bool {
        match self {
            Self::Rising => mark <= x,
            Self::Falling => mark >= x,
        }
    }

    /// Of two inputs, the one that comes first.
    #[inline(always)]
    pub(crate) fn nearer<T: Real>(self, one: T, other: T) -> T {
        match self {
            Self::Rising => {
                if one < other {
                    one
                } else {
                    other
                }
            }
            Self::Falling => {
                if one > other {
                    one
                } else {
                    other
                }
            }
        }
    }

    /// Of two inputs, the one that comes last.
    #[inline(always)]
    pub(crate) fn further<T: Real>(self, one: T, other: T) -> T {
        self.reversed().nearer(one, other)
    }

    #[inline(always)]
    pub(crate) fn reversed(self) -> Self {
        match self {
            Self::Rising => Self::Falling,
            Self::Falling => Self::Rising,
        }
    }
}
