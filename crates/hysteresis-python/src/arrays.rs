//! Arrays in and out.

use std::fmt;

use hysteresis_core::Process;
use numpy::ndarray::Dimension;
use numpy::{BorrowError, PyArray, PyArray1, PyArrayMethods, PyReadonlyArray, PyReadonlyArray1, PyUntypedArrayMethods};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::errors;

/// Samples between two looks at pending signals (Ctrl-C).
pub(crate) const BLOCK: usize = 1 << 20;

/// A one-dimensional array of real numbers: in place if it is C-contiguous float64, else converted once.
pub(crate) fn vector<'py>(name: &str, value: &Bound<'py, PyAny>) -> PyResult<PyReadonlyArray1<'py, f64>> {
    array(name, value, format_args!("a one-dimensional array"))
}

/// An array of real numbers with as many dimensions as D has: in place if it is C-contiguous float64, else converted
/// once. `expected` says in words what has these dimensions.
pub(crate) fn array<'py, D: Dimension>(
    name: &str,
    value: &Bound<'py, PyAny>,
    expected: fmt::Arguments<'_>,
) -> PyResult<PyReadonlyArray<'py, f64, D>> {
    if let Ok(array) = value.cast_exact::<PyArray<f64, D>>()
        && is_slice(array)
    {
        return Ok(array.readonly());
    }
    let py = value.py();
    let numpy = py.import(intern!(py, "numpy"))?;
    if numpy.getattr(intern!(py, "ma"))?.call_method1(intern!(py, "is_masked"), (value,))?.extract()? {
        return Err(PyTypeError::new_err(format!("{name}: expected an array without masked elements")));
    }
    let array = numpy
        .call_method1(intern!(py, "asarray"), (value,))
        .map_err(|error| PyValueError::new_err(format!("{name}: expected an array, got {}", error.value(py))))?;
    let dtype = array.getattr(intern!(py, "dtype"))?;
    let kind: String = dtype.getattr(intern!(py, "kind"))?.extract()?;
    if !matches!(kind.as_str(), "b" | "i" | "u" | "f") {
        return Err(PyTypeError::new_err(format!("{name}: expected real numbers, got dtype {dtype}")));
    }
    let dimensions: usize = array.getattr(intern!(py, "ndim"))?.extract()?;
    if D::NDIM.is_some_and(|expected| expected != dimensions) {
        let shape = array.getattr(intern!(py, "shape"))?;
        return Err(PyValueError::new_err(format!("{name}: expected {expected}, got shape {shape}")));
    }
    let arguments = (array, numpy::dtype::<f64>(py), ["C", "ALIGNED"]);
    let converted = numpy.call_method1(intern!(py, "require"), arguments)?;
    Ok(converted.cast_into::<PyArray<f64, D>>()?.readonly())
}

/// Whether the elements lie one after the other where the processor expects numbers.
fn is_slice<D: Dimension>(array: &Bound<'_, PyArray<f64, D>>) -> bool {
    array.is_c_contiguous() && array.data().is_aligned()
}

/// Numbers as a new array that nobody can write to.
pub(crate) fn read_only(py: Python<'_>, values: impl Iterator<Item = f64>) -> PyResult<Bound<'_, PyArray1<f64>>> {
    let array = PyArray1::from_iter(py, values);
    let flags = PyDict::new(py);
    flags.set_item(intern!(py, "write"), false)?;
    array.call_method(intern!(py, "setflags"), (), Some(&flags))?;
    Ok(array)
}

/// What takes samples and gives as many outputs.
pub(crate) trait Samples {
    /// Takes the samples in `input` and writes the outputs to `output`, which is as long.
    fn take(&mut self, py: Python<'_>, input: &[f64], output: &mut [f64]) -> PyResult<()>;

    /// Takes the samples and writes each output to where its sample was.
    fn take_in_place(&mut self, py: Python<'_>, samples: &mut [f64]) -> PyResult<()>;
}

/// One stream, sample after sample.
struct Single<'a, P>(&'a mut P);

impl<P: Process> Samples for Single<'_, P> {
    fn take(&mut self, py: Python<'_>, input: &[f64], output: &mut [f64]) -> PyResult<()> {
        for (x, y) in input.chunks(BLOCK).zip(output.chunks_mut(BLOCK)) {
            py.check_signals()?;
            self.0.run(x, y).map_err(errors::core)?;
        }
        Ok(())
    }

    fn take_in_place(&mut self, py: Python<'_>, samples: &mut [f64]) -> PyResult<()> {
        for block in samples.chunks_mut(BLOCK) {
            py.check_signals()?;
            for sample in block {
                *sample = self.0.step(*sample);
            }
        }
        Ok(())
    }
}

/// `process.run(input, out)` for arrays; the result is `out` where it is given, as in numpy.
pub(crate) fn run<'py>(
    process: &mut impl Process,
    input: &Bound<'py, PyAny>,
    out: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    apply(&mut Single(process), vector("input", input)?, out)
}

/// Takes all samples, in C order, into `out` or a new array.
pub(crate) fn apply<'py, D: Dimension>(
    process: &mut impl Samples,
    samples: PyReadonlyArray<'py, f64, D>,
    out: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyArray<f64, D>>> {
    let py = samples.py();
    let Some(out) = out else {
        let out = PyArray::zeros(py, samples.dims(), false);
        process.take(py, samples.as_slice()?, out.readwrite().as_slice_mut()?)?;
        return Ok(out);
    };
    let out = output(out, &samples)?;
    if out.is(&*samples) {
        drop(samples);
        process.take_in_place(py, out.readwrite().as_slice_mut()?)?;
    } else if !is_slice(&out) {
        // numpy moves the results to wherever strides and alignment put them.
        let dense = PyArray::<f64, D>::zeros(py, samples.dims(), false);
        process.take(py, samples.as_slice()?, dense.readwrite().as_slice_mut()?)?;
        out.set_item(py.Ellipsis(), dense)?;
    } else if let Ok(mut free) = out.try_readwrite() {
        process.take(py, samples.as_slice()?, free.as_slice_mut()?)?;
    } else {
        // The output overlaps the input: what is written must not be read back as input.
        let copy = samples.as_slice()?.to_vec();
        drop(samples);
        process.take(py, &copy, out.readwrite().as_slice_mut()?)?;
    }
    Ok(out)
}

/// A shape in words.
struct Extent<'a>(&'a [usize]);

impl fmt::Display for Extent<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            [elements] => write!(f, "{elements} elements"),
            [rows, columns] => write!(f, "shape ({rows}, {columns})"),
            shape => write!(f, "shape {shape:?}"),
        }
    }
}

/// `out`, if outputs for all samples can be written to it.
fn output<'py, D: Dimension>(
    out: &Bound<'py, PyAny>,
    samples: &PyReadonlyArray<'py, f64, D>,
) -> PyResult<Bound<'py, PyArray<f64, D>>> {
    let Ok(array) = out.cast::<PyArray<f64, D>>() else {
        let (words, got) = (if samples.ndim() == 1 { "one" } else { "two" }, out.get_type().name()?);
        let expected = format!("a {words}-dimensional float64 array of {}", Extent(samples.shape()));
        return Err(PyTypeError::new_err(format!("out: expected {expected}, got {got}")));
    };
    if array.shape() != samples.shape() {
        let (expected, got) = (Extent(samples.shape()), Extent(array.shape()));
        return Err(PyValueError::new_err(format!("out: expected {expected}, got {got}")));
    }
    match array.try_readwrite() {
        Err(BorrowError::NotWriteable) => Err(PyValueError::new_err("out: expected an array that can be written to")),
        _ => Ok(array.clone()),
    }
}
