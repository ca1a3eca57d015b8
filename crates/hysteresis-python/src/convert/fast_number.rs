//! Numbers of calls that are made for every sample: as fast as `f64`, whose own error does not name the argument.

use std::marker::PhantomData;

use pyo3::prelude::*;

use super::errors::not_converted;

/// A number that came as the argument N.
pub(crate) struct Number<N>(pub(crate) f64, PhantomData<N>);

/// A default.
impl<N> From<f64> for Number<N> {
    fn from(number: f64) -> Self {
        Self(number, PhantomData)
    }
}

/// What an argument is called.
pub(crate) trait Name {
    const NAME: &'static str;
}

impl<'py, N: Name> FromPyObject<'_, 'py> for Number<N> {
    type Error = PyErr;

    #[inline]
    fn extract(value: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        match value.extract() {
            Ok(number) => Ok(Self(number, PhantomData)),
            Err(error) => Err(not_converted(N::NAME, "a number", &value, error)),
        }
    }
}

macro_rules! names {
    ($($type:ident = $name:literal),+ $(,)?) => {
        $(
            pub(crate) struct $type;

            impl Name for $type {
                const NAME: &'static str = $name;
            }
        )+
    };
}

names!(
    Correction = "correction",
    Drive = "drive",
    Feedforward = "feedforward",
    Measurement = "measurement",
    MeasuredError = "error",
    Reference = "reference",
    Target = "target",
    U = "u",
    Y = "y",
);
