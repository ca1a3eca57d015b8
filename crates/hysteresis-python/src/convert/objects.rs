//! Borrowing of objects, after all arguments were converted.
//!
//! A conversion may run Python code and let other threads run: what they would find borrowed would raise for no fault of
//! theirs. So a method that converts takes `slf: &Bound<Self>`, converts, and borrows then.

use pyo3::PyClass;
use pyo3::prelude::*;
use pyo3::pyclass::boolean_struct::False;

use super::errors::{in_use, unexpected};

/// The object to read from.
pub(crate) fn shared<'py, C: PyClass>(object: &Bound<'py, C>) -> PyResult<PyRef<'py, C>> {
    object.try_borrow().map_err(|_| busy(object))
}

/// The object to change.
pub(crate) fn exclusive<'py, C: PyClass<Frozen = False>>(object: &Bound<'py, C>) -> PyResult<PyRefMut<'py, C>> {
    object.try_borrow_mut().map_err(|_| busy(object))
}

/// The argument as an object of a class, or an error that says which was expected.
pub(crate) fn instance<'a, 'py, C: PyClass>(
    name: &str,
    expected: &str,
    value: &'a Bound<'py, PyAny>,
) -> PyResult<&'a Bound<'py, C>> {
    value.cast::<C>().map_err(|_| unexpected(name, expected, value))
}

/// The error of an object that another call has not let go of.
#[cold]
fn busy<C: PyClass>(object: &Bound<'_, C>) -> PyErr {
    match object.as_any().get_type().name() {
        Ok(name) => in_use(format_args!("this {name}")),
        Err(error) => error,
    }
}
