//! An argument of a call: any object of Python becomes a value of Rust, or an error with the name of the argument.
//!
//! The attributes `function` and `methods` convert every parameter by [`Argument`] of its type. What a parameter may
//! be, and what an error says that it may be, stands once: at the type that is made from an object.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use hysteresis_python_macros::py;
use numpy::PyReadonlyArray1;
use pyo3::prelude::*;
use pyo3::types::PyString;
use pyo3::{IntoPyObjectExt, PyClass};

use crate::convert::errors::{not_converted, unexpected};
use crate::convert::{arguments, arrays};

/// A type that arguments are converted to.
pub(crate) trait Argument<'py>: Sized {
    /// Whether None is a value of its own. Else it stands for the default, where there is one.
    const TAKES_NONE: bool = false;

    fn from_argument(name: &'static str, value: &Bound<'py, PyAny>) -> PyResult<Self>;

    /// The same value where it stands for an argument that was not given.
    #[must_use]
    fn into_default(self) -> Self {
        self
    }
}

/// An argument with a default.
pub(crate) enum Given<'a, 'py> {
    Default,
    Is(Borrowed<'a, 'py, PyAny>),
}

impl<'a, 'py> FromPyObject<'a, 'py> for Given<'a, 'py> {
    type Error = PyErr;

    #[inline]
    fn extract(value: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        Ok(Self::Is(value))
    }
}

impl<'py> Given<'_, 'py> {
    /// The value that was given, if one was.
    pub(crate) fn value<T: Argument<'py>>(self, name: &'static str) -> PyResult<Option<T>> {
        match self {
            Self::Is(value) if T::TAKES_NONE || !value.is_none() => T::from_argument(name, &value).map(Some),
            _ => Ok(None),
        }
    }

    /// The value that was given, or the default.
    #[inline]
    pub(crate) fn or<T: Argument<'py>>(self, name: &'static str, default: impl FnOnce() -> PyResult<T>) -> PyResult<T> {
        match self {
            Self::Is(value) if T::TAKES_NONE || !value.is_none() => T::from_argument(name, &value),
            _ => default(),
        }
    }

    /// The same where None is a wrong argument.
    #[inline]
    pub(crate) fn or_unless_given<T: Argument<'py>>(
        self,
        name: &'static str,
        default: impl FnOnce() -> PyResult<T>,
    ) -> PyResult<T> {
        match self {
            Self::Is(value) => T::from_argument(name, &value),
            Self::Default => default(),
        }
    }
}

/// The default that stands in a signature, converted like an argument.
pub(crate) fn of_default<T: for<'py> Argument<'py>>(
    name: &'static str,
    default: impl for<'py> IntoPyObject<'py>,
) -> PyResult<T> {
    Python::attach(|py| T::from_argument(name, &default.into_bound_py_any(py)?)).map(T::into_default)
}

/// The defaults that a function shows for the options that it gathers. In effect are those of the options, where
/// nothing is given.
pub(crate) struct Shown {
    pub(crate) function: &'static str,
    /// Each parameter, and whether both are the same.
    pub(crate) defaults: fn() -> Vec<(&'static str, bool)>,
}

inventory::collect!(Shown);

/// Whether the default that is shown is the one in effect.
pub(crate) fn is_shown<T: Into<F>, F: PartialEq>(shown: PyResult<T>, in_effect: &F) -> bool {
    shown.is_ok_and(|shown| shown.into() == *in_effect)
}

/// All defaults of gathered options by `function.parameter`, each with whether the one that is shown takes effect: for
/// the tests.
#[pyfunction]
#[pyo3(name = "_defaults")]
pub(crate) fn shown_defaults() -> Vec<(String, bool)> {
    let mut all = Vec::new();
    for Shown { function, defaults } in inventory::iter::<Shown> {
        all.extend(defaults().into_iter().map(|(parameter, is_same)| (format!("{function}.{parameter}"), is_same)));
    }
    all
}

/// A value and whether it was given: something else may have one of its own, which only one that was given contradicts.
#[derive(Clone, Copy)]
pub(crate) struct Asked<T> {
    pub(crate) value: T,
    pub(crate) is_given: bool,
}

impl<'py, T: Argument<'py>> Argument<'py> for Asked<T> {
    fn from_argument(name: &'static str, value: &Bound<'py, PyAny>) -> PyResult<Self> {
        Ok(Self { value: T::from_argument(name, value)?, is_given: true })
    }

    fn into_default(self) -> Self {
        Self { is_given: false, ..self }
    }
}

impl Argument<'_> for f64 {
    #[inline]
    fn from_argument(name: &'static str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        value.extract().map_err(|error| not_converted(name, "a number", value, error))
    }
}

impl Argument<'_> for bool {
    // A flag is True or False, and nothing that stands for the default.
    const TAKES_NONE: bool = true;

    fn from_argument(name: &'static str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        value.extract().map_err(|error| not_converted(name, "True or False", value, error))
    }
}

impl<'py, T: Argument<'py>> Argument<'py> for Option<T> {
    const TAKES_NONE: bool = true;

    #[inline]
    fn from_argument(name: &'static str, value: &Bound<'py, PyAny>) -> PyResult<Self> {
        if value.is_none() { Ok(None) } else { T::from_argument(name, value).map(Some) }
    }
}

/// A whole number that is not negative.
macro_rules! whole {
    ($($number:ty),+) => {
        $(
            impl Argument<'_> for $number {
                fn from_argument(name: &'static str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
                    arguments::whole(name, value)
                }
            }
        )+
    };
}

whole!(usize, u64, u32);

/// A text, of which messages say no more.
impl Argument<'_> for String {
    // A text is a text, and nothing that stands for the default.
    const TAKES_NONE: bool = true;

    fn from_argument(name: &'static str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        arguments::word(name, "a text", value)
    }
}

/// The path of a file.
#[py("str | PathLike[str]")]
impl Argument<'_> for PathBuf {
    fn from_argument(name: &'static str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        arguments::path(name, value)
    }
}

/// Two numbers (low, high).
impl Argument<'_> for (f64, f64) {
    fn from_argument(name: &'static str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        arguments::pair(name, value)
    }
}

/// A word of those that a type has.
pub(crate) trait Words: Copy + PartialEq + 'static {
    const WORDS: &'static [(&'static str, Self)];
    /// Whether None is a wrong word. Else it stands for the default, where there is one.
    const REFUSES_NONE: bool = false;

    /// The word of a value.
    fn word(self) -> &'static str {
        Self::WORDS.iter().find(|(_, value)| *value == self).map_or("", |(word, _)| word)
    }

    /// The value of a word.
    fn named(word: &str) -> Option<Self> {
        Self::WORDS.iter().find(|(known, _)| *known == word).map(|(_, value)| *value)
    }

    /// The words as messages show them.
    fn expected() -> String {
        let words: Vec<String> = Self::WORDS.iter().map(|(word, _)| format!("\"{word}\"")).collect();
        match &words[..] {
            [before @ .., last] if !before.is_empty() => format!("{} or {last}", before.join(", ")),
            _ => words.concat(),
        }
    }
}

impl<T: Words> Argument<'_> for T {
    const TAKES_NONE: bool = T::REFUSES_NONE;

    fn from_argument(name: &'static str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        let got = arguments::word(name, &Self::expected(), value)?;
        Self::named(&got).map_or_else(|| arguments::unknown(name, &Self::expected(), &got), Ok)
    }
}

/// The argument that makes a value again, when an object is made again.
pub(crate) trait AsArgument<'py> {
    fn as_argument(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>>;
}

impl<'py, T: Words> AsArgument<'py> for T {
    fn as_argument(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.word().into_bound_py_any(py)
    }
}

impl<'py, T: AsArgument<'py>> AsArgument<'py> for Option<T> {
    fn as_argument(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.as_ref().map_or_else(|| Ok(py.None().into_bound(py)), |value| value.as_argument(py))
    }
}

/// What is the same in both languages.
macro_rules! same {
    ($($plain:ty),+) => {
        $(
            impl<'py> AsArgument<'py> for $plain {
                fn as_argument(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
                    self.into_bound_py_any(py)
                }
            }
        )+
    };
}

same!(f64, bool, u32, (f64, f64));

/// A class whose objects are arguments.
pub(crate) trait Class: PyClass {
    /// What messages call an object of it, such as "a mh.Stage".
    const CALLED: &'static str;
}

impl<'py, C: Class> Argument<'py> for Bound<'py, C> {
    fn from_argument(name: &'static str, value: &Bound<'py, PyAny>) -> PyResult<Self> {
        value.cast::<C>().cloned().map_err(|_| unexpected(name, C::CALLED, value))
    }
}

/// A whole number of at least one.
impl Argument<'_> for NonZeroUsize {
    fn from_argument(name: &'static str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        arguments::count(name, value).map(|count| NonZeroUsize::new(count).expect("at least one"))
    }
}

/// A one-dimensional array of real numbers: in place if it is C-contiguous float64, else converted once.
#[py("ArrayLike")]
impl<'py> Argument<'py> for PyReadonlyArray1<'py, f64> {
    fn from_argument(name: &'static str, value: &Bound<'py, PyAny>) -> PyResult<Self> {
        arrays::vector(name, value)
    }
}

/// A copy of a one-dimensional array of real numbers: for work that lets the interpreter go, or calls Python.
#[py("ArrayLike")]
impl Argument<'_> for Vec<f64> {
    fn from_argument(name: &'static str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        arrays::numbers(name, value)
    }
}

/// A function of the caller, which may be left out.
pub(crate) struct Callable(pub(crate) Py<PyAny>);

impl Argument<'_> for Callable {
    fn from_argument(name: &'static str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        if value.is_callable() {
            Ok(Self(value.clone().unbind()))
        } else {
            Err(unexpected(name, "a callable or None", value))
        }
    }
}

/// An object that is handed on as it came.
pub(crate) struct Object(pub(crate) Py<PyAny>);

impl Argument<'_> for Object {
    fn from_argument(_: &'static str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        Ok(Self(value.clone().unbind()))
    }
}

/// A number of samples, which may be zero.
#[derive(Clone, Copy, PartialEq)]
pub(crate) struct SampleCount(pub(crate) usize);

#[py("int")]
impl Argument<'_> for SampleCount {
    fn from_argument(name: &'static str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        arguments::samples(name, value).map(Self)
    }
}

/// A count, or "auto".
pub(crate) struct CountOrAuto(Option<usize>);

#[py("int | Literal['auto']")]
impl Argument<'_> for CountOrAuto {
    fn from_argument(name: &'static str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        if arguments::is_word(value, "auto") {
            Ok(Self(None))
        } else if value.is_instance_of::<PyString>() {
            Err(unexpected(name, "a whole number or \"auto\"", value))
        } else {
            arguments::count(name, value).map(|count| Self(Some(count)))
        }
    }
}

impl From<CountOrAuto> for Option<usize> {
    fn from(CountOrAuto(count): CountOrAuto) -> Self {
        count
    }
}
