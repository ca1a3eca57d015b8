//! What can go wrong, and what the message says: the parameter, what was expected, what came.

use core::fmt;

/// The largest magnitude that any input, threshold, weight or offset may have: 1e100.
///
/// Products and sums of admissible numbers stay finite, so the hot path needs no overflow check.
/// NaN and infinities fail the same single comparison.
pub const MAX_MAGNITUDE: f64 = 1e100;

/// True for a finite number of magnitude at most [`MAX_MAGNITUDE`]: what streams take, and nothing else.
///
/// ```
/// use hysteresis_core::is_admissible;
/// assert!(is_admissible(-500.0));
/// assert!(![f64::NAN, f64::INFINITY, 1e101].into_iter().any(is_admissible));
/// ```
#[inline]
#[must_use]
pub fn is_admissible(value: f64) -> bool {
    value.abs() <= MAX_MAGNITUDE
}

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

/// Why a model, a stream or a state could not be made.
///
/// Everything that can fail fails at construction; `step` and `peek` never do.
///
/// ```
/// use hysteresis_core::{CoupledPlay, Error};
/// let error = CoupledPlay::new(10.0, 8.0, 9.0, 4.0).unwrap_err();
/// assert_eq!(error.to_string(), "rb: expected 0 <= rb <= ra = 8.0, got 9.0");
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Error {
    /// An array that needs at least one element has none.
    Empty {
        /// The name of the argument.
        parameter: &'static str,
    },
    /// Two arrays that belong together differ in length.
    Length {
        /// The name of the argument.
        parameter: &'static str,
        /// The length it must have.
        expected: usize,
        /// The length that came.
        got: usize,
    },
    /// A block for an array of streams that does not consist of whole rows.
    Rows {
        /// The name of the argument.
        parameter: &'static str,
        /// The length of a row: the number of actuators.
        width: usize,
        /// The length that came.
        got: usize,
    },
    /// A number lies outside its domain.
    Domain {
        /// The name of the argument.
        parameter: &'static str,
        /// Where in the array, for arrays.
        index: Option<usize>,
        /// The domain in words.
        expected: Bound,
        /// The number that came.
        got: f64,
    },
    /// A whole number, such as a count, lies outside its domain.
    Whole {
        /// The name of the argument.
        parameter: &'static str,
        /// Where in the array, for arrays.
        index: Option<usize>,
        /// The domain in words.
        expected: Bound,
        /// The number that came.
        got: u64,
    },
    /// A word is none of those that can be chosen here.
    Choice {
        /// The name of the argument.
        parameter: &'static str,
        /// What can be chosen.
        expected: &'static str,
        /// The word that came.
        got: &'static str,
    },
    /// The slope of the model is not positive everywhere, so one output may belong to several inputs.
    NotInvertible {
        /// Sum of the weights of operators whose thresholds are all zero: the slope right after a reversal. Of a split
        /// operator the smaller weight, here and below.
        identity_weight: f64,
        /// Sum of the negative weights of all other operators.
        negative_sum: f64,
    },
    /// The closed form needs thresholds that grow from zero and positive partial sums of the weights.
    NoClosedForm {
        /// The first operator that breaks the condition.
        index: usize,
        /// The condition in words.
        expected: &'static str,
        /// The number that came.
        got: f64,
    },
    /// A model whose weights a running stream cannot take over: its memory belongs to other operators.
    OtherOperators {
        /// What differs.
        what: &'static str,
        /// What the running stream has.
        expected: f64,
        /// What the model has.
        got: f64,
    },
    /// A saved state of another model.
    OtherModel {
        /// The fingerprint of the model that is to continue.
        expected: u64,
        /// The fingerprint in the state.
        got: u64,
    },
    /// A controller whose feed-forward has no model cannot take over another.
    NoModel,
    /// The inverse that is to feed forward has other limits than its controller, or none.
    OtherLimits {
        /// The limits of the controller.
        expected: (f64, f64),
        /// The limits of the inverse.
        got: Option<(f64, f64)>,
    },
    /// A controller that a stage leads has a feed-forward of its own.
    NotGiven {
        /// Which controller.
        index: usize,
    },
    /// A feed-forward that knows targets alone cannot take over drives.
    CannotFollow,
    /// A stop is no mode to be set: it needs a rate and a rest drive.
    StopWithoutRate,
    /// A saved state does not belong to this stream.
    State {
        /// What the state must satisfy.
        expected: &'static str,
    },
}

impl Error {
    /// A number outside the domain that the words describe.
    #[must_use]
    pub fn domain(parameter: &'static str, index: Option<usize>, expected: &'static str, got: f64) -> Self {
        Self::Domain { parameter, index, expected: Bound::Words(expected), got }
    }

    /// A count, or another whole number, outside the domain that the words describe.
    ///
    /// ```
    /// use hysteresis_core::Error;
    /// let error = Error::whole("sections", None, "at most 6", 7);
    /// assert_eq!(error.to_string(), "sections: expected at most 6, got 7");
    /// ```
    #[must_use]
    pub fn whole(parameter: &'static str, index: Option<usize>, expected: &'static str, got: usize) -> Self {
        Self::Whole { parameter, index, expected: Bound::Words(expected), got: got as u64 }
    }

    /// The same about a number with another name: what callers know it by.
    #[must_use]
    pub fn renamed(self, parameter: &'static str, got: f64) -> Self {
        match self {
            Self::Domain { expected, .. } => Self::Domain { parameter, index: None, expected, got },
            other => other,
        }
    }

    /// The name of the parameter that is wrong, if it is one.
    #[must_use]
    pub fn parameter(&self) -> Option<&'static str> {
        match *self {
            Self::Empty { parameter }
            | Self::Length { parameter, .. }
            | Self::Rows { parameter, .. }
            | Self::Domain { parameter, .. }
            | Self::Whole { parameter, .. }
            | Self::Choice { parameter, .. } => Some(parameter),
            Self::OtherOperators { .. } | Self::NoModel => Some("model"),
            Self::OtherLimits { .. } => Some("feedforward"),
            Self::NotGiven { .. } => Some("controllers"),
            Self::CannotFollow => Some("drives"),
            Self::StopWithoutRate => Some("mode"),
            Self::OtherModel { .. } | Self::State { .. } => Some("state"),
            Self::NotInvertible { .. } | Self::NoClosedForm { .. } => None,
        }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Empty { parameter } => write!(f, "{parameter}: expected at least one element, got none"),
            Self::Length { parameter, expected, got } => {
                write!(f, "{parameter}: expected {expected} elements, got {got}")
            }
            Self::Rows { parameter, width, got } => {
                write!(f, "{parameter}: expected whole rows of {width} elements, got {got} elements")
            }
            Self::Domain { parameter, index: None, expected, got } => {
                write!(f, "{parameter}: expected {expected}, got {got:?}")
            }
            Self::Domain { parameter, index: Some(index), expected, got } => {
                write!(f, "{parameter}[{index}]: expected {expected}, got {got:?}")
            }
            Self::Whole { parameter, index: None, expected, got } => {
                write!(f, "{parameter}: expected {expected}, got {got}")
            }
            Self::Whole { parameter, index: Some(index), expected, got } => {
                write!(f, "{parameter}[{index}]: expected {expected}, got {got}")
            }
            Self::Choice { parameter, expected, got } => write!(f, "{parameter}: expected {expected}, got {got:?}"),
            Self::NotInvertible { identity_weight, negative_sum } => write!(
                f,
                "the model is not invertible: its slope is only known to be positive if the weight of the identity \
                 operator (all thresholds zero) plus the sum of the negative weights exceeds 1e-100, and 1e-12 of \
                 the sum of all magnitudes (in f32 1e-11 and 5e-4), but these are {identity_weight:?} and {negative_sum:?}"
            ),
            Self::NoClosedForm { index, expected, got } => {
                write!(f, "no closed-form inverse: operator {index}: expected {expected}, got {got:?}")
            }
            Self::OtherOperators { what, expected, got } => {
                write!(f, "model: expected the {what} of the running stream, {expected}, got {got}")
            }
            Self::OtherModel { expected, got } => {
                write!(
                    f,
                    "state.model: expected the fingerprint of this model, {expected:#x}, got {got:#x}: the state was saved with another model"
                )
            }
            Self::NoModel => write!(f, "model: expected a feed-forward that has one, got a controller without"),
            Self::OtherLimits { expected, got } => {
                write!(f, "feedforward: expected an inverse with the limits of the controller, {expected:?}, got ")?;
                match got {
                    Some(limits) => write!(f, "one with the limits {limits:?}"),
                    None => write!(f, "one without limits"),
                }
            }
            Self::NotGiven { index } => {
                write!(f, "controllers[{index}]: expected a feed-forward that is given, got one of its own or none")
            }
            Self::CannotFollow => {
                write!(f, "drives: expected a feed-forward that follows drives, got a model that is itself an inverse")
            }
            Self::StopWithoutRate => {
                write!(f, "mode: expected run, feedforward or hold, got stop; call stop with a rate and a rest drive")
            }
            Self::State { expected } => write!(f, "state: expected {expected}"),
        }
    }
}

impl core::error::Error for Error {}

/// Checks one number, or names it.
pub(crate) fn check_finite(parameter: &'static str, index: Option<usize>, got: f64) -> Result<f64, Error> {
    if is_admissible(got) { Ok(got) } else { Err(Error::Domain { parameter, index, expected: Bound::Finite, got }) }
}

/// Checks that all numbers are admissible, or names the first that is not.
///
/// ```
/// use hysteresis_core::check_all_finite;
/// assert!(check_all_finite("drives", &[1.0, 2.0]).is_ok());
/// let error = check_all_finite("drives", &[1.0, f64::NAN]).unwrap_err();
/// assert_eq!(error.to_string(), "drives[1]: expected a finite number (at most 1e100 in magnitude), got NaN");
/// ```
///
/// # Errors
/// [`Error::Domain`] for a number that is not finite, or beyond 1e100.
pub fn check_all_finite(parameter: &'static str, numbers: &[f64]) -> Result<(), Error> {
    numbers.iter().enumerate().try_for_each(|(index, got)| check_finite(parameter, Some(index), *got).map(drop))
}

/// Checks how many elements there are, or names what has them.
///
/// # Errors
/// [`Error::Length`].
pub fn check_length(parameter: &'static str, expected: usize, got: usize) -> Result<(), Error> {
    if got == expected { Ok(()) } else { Err(Error::Length { parameter, expected, got }) }
}

/// Checks that a saved state is one of the model with the fingerprint `expected`.
///
/// # Errors
/// [`Error::OtherModel`].
pub fn check_model(expected: u64, got: u64) -> Result<(), Error> {
    if expected == got { Ok(()) } else { Err(Error::OtherModel { expected, got }) }
}

/// Checks that a block consists of whole rows, or names it.
#[cfg(feature = "alloc")]
pub(crate) fn check_rows(parameter: &'static str, width: usize, got: usize) -> Result<(), Error> {
    if got.is_multiple_of(width) { Ok(()) } else { Err(Error::Rows { parameter, width, got }) }
}

/// The error about the number of a thing that is none of so many, counted from 0.
#[cfg(feature = "alloc")]
pub(crate) fn no_such(parameter: &'static str, index: Option<usize>, got: usize, count: usize) -> Error {
    let expected = Bound::FromTo { first: 0, last: count.saturating_sub(1) };
    Error::Whole { parameter, index, expected, got: got as u64 }
}

/// Checks a number against the two that it must lie between, or names it.
pub(crate) fn check_between(
    parameter: &'static str,
    index: Option<usize>,
    got: f64,
    (low, high): (f64, f64),
) -> Result<f64, Error> {
    if low <= got && got <= high {
        Ok(got)
    } else {
        Err(Error::Domain { parameter, index, expected: Bound::Between { low, high }, got })
    }
}

/// Checks one number for each of these limits, or names it.
#[cfg(feature = "alloc")]
pub(crate) fn check_each_between(
    parameter: &'static str,
    numbers: &[f64],
    limits: impl ExactSizeIterator<Item = (f64, f64)>,
) -> Result<(), Error> {
    check_length(parameter, limits.len(), numbers.len())?;
    let mut each = numbers.iter().zip(limits).enumerate();
    each.try_for_each(|(i, (number, limits))| check_between(parameter, Some(i), *number, limits).map(drop))
}

/// Checks rows of one number for each of these limits, or names them.
#[cfg(feature = "alloc")]
pub(crate) fn check_rows_between(
    parameter: &'static str,
    rows: &[f64],
    limits: &(impl ExactSizeIterator<Item = (f64, f64)> + Clone),
) -> Result<(), Error> {
    check_rows(parameter, limits.len(), rows.len())?;
    let mut rows = rows.chunks_exact(limits.len().max(1));
    rows.try_for_each(|row| check_each_between(parameter, row, limits.clone()))
}

/// Checks one outer threshold, or names it.
pub(crate) fn check_non_negative(parameter: &'static str, index: Option<usize>, got: f64) -> Result<f64, Error> {
    if is_admissible(got) && got >= 0.0 {
        Ok(got)
    } else {
        Err(Error::Domain { parameter, index, expected: Bound::NonNegative, got })
    }
}

/// Checks a number that must be above zero, or names it.
pub(crate) fn check_positive(parameter: &'static str, got: f64) -> Result<f64, Error> {
    if is_admissible(got) && got > 0.0 {
        Ok(got)
    } else {
        Err(Error::Domain { parameter, index: None, expected: Bound::Positive, got })
    }
}

/// Checks one inner threshold against the outer one that bounds it, or names it.
pub(crate) fn check_within(
    inner: &'static str,
    index: Option<usize>,
    got: f64,
    outer: &'static str,
    limit: f64,
) -> Result<f64, Error> {
    if got >= 0.0 && got <= limit {
        Ok(got)
    } else {
        Err(Error::Domain { parameter: inner, index, expected: Bound::Within { inner, outer, limit }, got })
    }
}

/// How far a saved number may be from the model's: relative to the scale of what was rounded, far above rounding and
/// far below any use; and no less than what the smallest numbers lose.
#[cfg(feature = "alloc")]
pub(crate) fn restore_tolerance(scale: f64) -> f64 {
    1e-9 * scale + f64::MIN_POSITIVE
}

/// Checks a number of a new model against that of the running stream, or names it.
#[cfg(feature = "alloc")]
pub(crate) fn check_same(what: &'static str, expected: f64, got: f64) -> Result<(), Error> {
    if expected == got { Ok(()) } else { Err(Error::OtherOperators { what, expected, got }) }
}
