//! Arrays in and out.

use hysteresis_core::Process;
use numpy::{BorrowError, PyArray1, PyArrayMethods, PyReadonlyArray1, PyReadwriteArray1, PyUntypedArrayMethods};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::errors;

/// Samples between two looks at pending signals (Ctrl-C).
const BLOCK: usize = 1 << 20;

/// A one-dimensional array of real numbers: in place if it is C-contiguous float64, else converted once.
pub(crate) fn vector<'py>(name: &str, value: &Bound<'py, PyAny>) -> PyResult<PyReadonlyArray1<'py, f64>> {
    if let Ok(array) = value.cast_exact::<PyArray1<f64>>()
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
    if array.getattr(intern!(py, "ndim"))?.extract::<usize>()? != 1 {
        let shape = array.getattr(intern!(py, "shape"))?;
        return Err(PyValueError::new_err(format!("{name}: expected a one-dimensional array, got shape {shape}")));
    }
    let arguments = (array, numpy::dtype::<f64>(py), ["C", "ALIGNED"]);
    let converted = numpy.call_method1(intern!(py, "require"), arguments)?;
    Ok(converted.cast_into::<PyArray1<f64>>()?.readonly())
}

/// Whether the elements lie one after the other where the processor expects numbers.
fn is_slice(array: &Bound<'_, PyArray1<f64>>) -> bool {
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

/// `process.run(input, out)` for arrays; the result is `out` where it is given, as in numpy.
pub(crate) fn run<'py>(
    process: &mut impl Process,
    input: &Bound<'py, PyAny>,
    out: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let py = input.py();
    let samples = vector("input", input)?;
    let Some(out) = out else {
        let out = PyArray1::zeros(py, samples.len(), false);
        run_blocks(py, process, samples.as_slice()?, &mut out.readwrite())?;
        return Ok(out);
    };
    let out = output(out, samples.len())?;
    if out.is(&*samples) {
        drop(samples);
        run_in_place(py, process, &mut out.readwrite())?;
    } else if !is_slice(&out) {
        // numpy moves the results to wherever strides and alignment put them.
        let dense = PyArray1::zeros(py, samples.len(), false);
        run_blocks(py, process, samples.as_slice()?, &mut dense.readwrite())?;
        out.set_item(py.Ellipsis(), dense)?;
    } else if let Ok(mut free) = out.try_readwrite() {
        run_blocks(py, process, samples.as_slice()?, &mut free)?;
    } else {
        // The output overlaps the input: what is written must not be read back as input.
        let copy = samples.as_slice()?.to_vec();
        drop(samples);
        run_blocks(py, process, &copy, &mut out.readwrite())?;
    }
    Ok(out)
}

fn run_blocks(
    py: Python<'_>,
    process: &mut impl Process,
    input: &[f64],
    out: &mut PyReadwriteArray1<'_, f64>,
) -> PyResult<()> {
    for (x, y) in input.chunks(BLOCK).zip(out.as_slice_mut()?.chunks_mut(BLOCK)) {
        py.check_signals()?;
        process.run(x, y).map_err(errors::core)?;
    }
    Ok(())
}

fn run_in_place(py: Python<'_>, process: &mut impl Process, samples: &mut PyReadwriteArray1<'_, f64>) -> PyResult<()> {
    for block in samples.as_slice_mut()?.chunks_mut(BLOCK) {
        py.check_signals()?;
        for sample in block {
            *sample = process.step(*sample);
        }
    }
    Ok(())
}

/// `out`, if as many samples can be written to it.
fn output<'py>(out: &Bound<'py, PyAny>, samples: usize) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let Ok(array) = out.cast::<PyArray1<f64>>() else {
        let got = out.get_type().name()?;
        return Err(PyTypeError::new_err(format!(
            "out: expected a one-dimensional float64 array of {samples} elements, got {got}"
        )));
    };
    if array.len() != samples {
        return Err(PyValueError::new_err(format!("out: expected {samples} elements, got {}", array.len())));
    }
    match array.try_readwrite() {
        Err(BorrowError::NotWriteable) => Err(PyValueError::new_err("out: expected an array that can be written to")),
        _ => Ok(array.clone()),
    }
}
