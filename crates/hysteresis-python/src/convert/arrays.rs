//! Arrays in and out.

use std::fmt;

use numpy::ndarray::{Dimension, IntoDimension, IxDyn};
use numpy::npyffi::PY_ARRAY_API;
use numpy::{PyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray, PyReadonlyArray1, PyUntypedArrayMethods};
use pyo3::exceptions::{PyMemoryError, PyTypeError, PyValueError};
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::convert::errors::{self, Place, in_use, no_memory, wrong_type};

/// A one-dimensional array of real numbers: in place if it is C-contiguous float64, else converted once.
pub(crate) fn vector<'a, 'py>(
    place: impl Into<Place<'a>>,
    value: &Bound<'py, PyAny>,
) -> PyResult<PyReadonlyArray1<'py, f64>> {
    array(place, value, format_args!("a one-dimensional array"))
}

/// A copy of a one-dimensional array of real numbers: for work that lets the interpreter go, or calls Python.
pub(crate) fn numbers<'a>(place: impl Into<Place<'a>>, value: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
    let place = place.into();
    copy(place, vector(place, value)?.as_slice()?)
}

/// An array of real numbers with as many dimensions as D has: in place if it is C-contiguous float64, else converted
/// once. `expected` says in words what has these dimensions.
pub(crate) fn array<'a, 'py, D: Dimension>(
    place: impl Into<Place<'a>>,
    value: &Bound<'py, PyAny>,
    expected: fmt::Arguments<'_>,
) -> PyResult<PyReadonlyArray<'py, f64, D>> {
    let place = place.into();
    if let Ok(array) = value.cast_exact::<PyArray<f64, D>>()
        && is_slice(array)
    {
        return array.try_readonly().map_err(|_| in_use(place));
    }
    let py = value.py();
    let numpy = py.import(intern!(py, "numpy"))?;
    if numpy.getattr(intern!(py, "ma"))?.call_method1(intern!(py, "is_masked"), (value,))?.extract()? {
        return Err(wrong_type(place, "expected an array without masked elements"));
    }
    let array = numpy.call_method1(intern!(py, "asarray"), (value,)).map_err(|error| {
        if error.is_instance_of::<PyMemoryError>(py)
            && let Ok(samples) = value.len()
        {
            return no_memory(place, samples);
        }
        // Whatever else was raised is not about the argument: what the object's own conversion ran into.
        if !error.is_instance_of::<PyValueError>(py) && !error.is_instance_of::<PyTypeError>(py) {
            return error;
        }
        errors::value(place, format_args!("expected an array, got {}", error.value(py)))
    })?;
    let dtype = array.getattr(intern!(py, "dtype"))?;
    let kind: String = dtype.getattr(intern!(py, "kind"))?.extract()?;
    if !matches!(kind.as_str(), "b" | "i" | "u" | "f") {
        return Err(wrong_type(place, format_args!("expected real numbers, got dtype {dtype}")));
    }
    let dimensions: usize = array.getattr(intern!(py, "ndim"))?.extract()?;
    if D::NDIM.is_some_and(|expected| expected != dimensions) {
        let shape = array.getattr(intern!(py, "shape"))?;
        return Err(errors::value(place, format_args!("expected {expected}, got shape {shape}")));
    }
    let arguments = (array, numpy::dtype::<f64>(py), ["C", "ALIGNED"]);
    let converted = numpy.call_method1(intern!(py, "require"), arguments)?;
    converted.cast_into::<PyArray<f64, D>>()?.try_readonly().map_err(|_| in_use(place))
}

/// Whether the elements lie one after the other where the processor expects numbers.
pub(crate) fn is_slice<D: Dimension>(array: &Bound<'_, PyArray<f64, D>>) -> bool {
    array.is_c_contiguous() && array.data().is_aligned()
}

/// A new array of zeros, or a MemoryError: `PyArray::zeros` panics where there is no memory.
pub(crate) fn zeros<D: Dimension>(py: Python<'_>, shape: D) -> PyResult<Bound<'_, PyArray<f64, D>>> {
    let mut shape: Vec<_> = shape.into_dimension().slice().iter().map(|length| length.cast_signed()).collect();
    let dimensions = i32::try_from(shape.len()).expect("an array has few dimensions");
    // SAFETY: the shape is read during the call alone, which takes over the reference to the dtype and gives back a new
    // reference to an array of that dtype and as many dimensions, or null with an exception set.
    unsafe {
        let dtype = numpy::dtype::<f64>(py).into_ptr().cast();
        let array = PY_ARRAY_API.PyArray_Zeros(py, dimensions, shape.as_mut_ptr(), dtype, 0);
        Ok(Bound::from_owned_ptr_or_err(py, array)?.cast_into_unchecked())
    }
}

/// Numbers as a new array that nobody can write to.
pub(crate) fn read_only(py: Python<'_>, values: impl Iterator<Item = f64>) -> PyResult<Bound<'_, PyArray1<f64>>> {
    let array = PyArray1::from_iter(py, values);
    let flags = PyDict::new(py);
    flags.set_item(intern!(py, "write"), false)?;
    array.call_method(intern!(py, "setflags"), (), Some(&flags))?;
    Ok(array)
}

/// Rows of equal length as a new matrix that nobody can write to.
pub(crate) fn matrix<'py>(py: Python<'py>, rows: &[Vec<f64>], columns: usize) -> PyResult<Bound<'py, PyArray2<f64>>> {
    read_only(py, rows.iter().flatten().copied())?.reshape([rows.len(), columns])
}

/// One number for all, or an array of one for each.
pub(crate) fn one_or_more(name: &str, value: &Bound<'_, PyAny>, expected: fmt::Arguments<'_>) -> PyResult<Vec<f64>> {
    let given = array::<IxDyn>(name, value, expected)?;
    if given.ndim() > 1 || given.len() == 0 {
        let shape = given.getattr(intern!(value.py(), "shape"))?;
        return Err(errors::value(name, format_args!("expected {expected}, got shape {shape}")));
    }
    Ok(given.as_slice()?.to_vec())
}

/// A number for each of `count`: one for all is repeated.
pub(crate) fn each(name: &str, value: &Bound<'_, PyAny>, count: usize) -> PyResult<Vec<f64>> {
    let given = one_or_more(name, value, format_args!("a number or an array of shape ({count},)"))?;
    match given.len() {
        1 => Ok(vec![given[0]; count]),
        got if got == count => Ok(given),
        got => {
            let expected = format!("a number or an array of shape ({count},)");
            Err(errors::value(name, format_args!("expected {expected}, got {got} elements")))
        }
    }
}

/// Bytes for each sample that a fit needs beside the samples themselves: residuals, thinned courses, columns of the
/// linear parts.
pub(crate) const FIT: usize = 160;

/// Bytes for each sample of a simulation or an inversion: what goes in, what comes out, and what lies between.
pub(crate) const PASS: usize = 64;

/// Bytes for each sample of a Fourier transform: spectrum, result, and what a length without small factors needs.
pub(crate) const SPECTRUM: usize = 96;

/// Bytes for each operator of a model: its parameters, its entry and tables in the engine, its place in the memory of a
/// stream.
pub(crate) const OPERATOR: usize = 1024;

/// Checks that there is memory for so many samples, each of so many bytes.
pub(crate) fn check_room<'a>(place: impl Into<Place<'a>>, samples: usize, bytes: usize) -> PyResult<()> {
    reserve::<u8>(place, samples.saturating_mul(bytes), samples).map(drop)
}

/// A copy of samples.
pub(crate) fn copy<'a>(place: impl Into<Place<'a>>, samples: &[f64]) -> PyResult<Vec<f64>> {
    let mut room = reserve(place, samples.len(), samples.len())?;
    room.extend_from_slice(samples);
    Ok(room)
}

fn reserve<'a, T>(place: impl Into<Place<'a>>, elements: usize, samples: usize) -> PyResult<Vec<T>> {
    let mut room = Vec::new();
    match room.try_reserve_exact(elements) {
        Ok(()) => Ok(room),
        Err(_) => Err(no_memory(place, samples)),
    }
}
