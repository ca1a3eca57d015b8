//! What was expected of a number, in words.

use core::fmt;

/// The domain that a number had to lie in.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Bound {
    /// Finite and at most [`MAX_MAGNITUDE`](crate::MAX_MAGNITUDE) in magnitude.
    Finite,
    /// Finite and at most 1e11 in magnitude: a number that must fit `f32`.
    Single,
    /// Finite and not below zero.
    NonNegative,
    /// Finite and above zero.
    Positive,
    /// A whole number between two others.
    FromTo {
        /// The least.
        first: usize,
        /// The largest.
        last: usize,
    },
    /// `0 <= inner <= outer`: the inner threshold of a coupled play and the outer one that bounds it.
    Within {
        /// The name of the inner threshold.
        inner: &'static str,
        /// The name of the outer threshold.
        outer: &'static str,
        /// The outer threshold.
        limit: f64,
    },
    /// What the words say.
    Words(&'static str),
    /// Between two numbers.
    Between {
        /// The least.
        low: f64,
        /// The most.
        high: f64,
    },
    /// Equal to a number that is described in words.
    EqualTo {
        /// The number.
        value: f64,
        /// What it is.
        what: &'static str,
    },
    /// A count that is described in words.
    Exactly {
        /// The count.
        count: usize,
        /// What it is.
        what: &'static str,
    },
    /// Below another number, named in words.
    Below {
        /// What bounds it from above.
        what: &'static str,
        /// The bound.
        limit: f64,
    },
    /// Above another number, named in words.
    Above {
        /// What bounds it from below.
        what: &'static str,
        /// The bound.
        limit: f64,
    },
}

impl fmt::Display for Bound {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Finite => write!(f, "a finite number (at most 1e100 in magnitude)"),
            Self::Single => write!(f, "a finite number (at most 1e11 in magnitude)"),
            Self::NonNegative => write!(f, "a finite number >= 0"),
            Self::Positive => write!(f, "a finite number > 0"),
            Self::FromTo { first, last } => write!(f, "a whole number from {first} to {last}"),
            Self::Words(words) => f.write_str(words),
            Self::Within { inner, outer, limit } => write!(f, "0 <= {inner} <= {outer} = {limit:?}"),
            Self::Between { low, high } => write!(f, "a number from {low:?} to {high:?}"),
            Self::EqualTo { value, what } => write!(f, "{value:?}, {what}"),
            Self::Exactly { count, what } => write!(f, "{count}, {what}"),
            Self::Below { what, limit } => write!(f, "a number below {what} = {limit:?}"),
            Self::Above { what, limit } => write!(f, "a number above {what} = {limit:?}"),
        }
    }
}
