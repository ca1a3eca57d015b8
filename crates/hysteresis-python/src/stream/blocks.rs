//! Arrays of samples through what takes samples, block by block.

use std::fmt;

use hysteresis_core::{self as core, Process};
use numpy::ndarray::Dimension;
use numpy::{BorrowError, PyArray, PyArray1, PyArrayMethods, PyReadonlyArray, PyUntypedArrayMethods};
use pyo3::PyClass;
use pyo3::prelude::*;
use pyo3::pyclass::boolean_struct::False;

use crate::convert::arrays;
use crate::convert::arrays::{is_slice, vector, zeros};
use crate::convert::errors::{self, in_use, raise, wrong_type};
use crate::convert::objects::exclusive;

/// Samples between two looks at pending signals (Ctrl-C).
pub(crate) const BLOCK: usize = 1 << 20;

/// What takes samples and gives as many outputs.
pub(crate) trait Samples {
    /// Takes the samples in `input` and writes the outputs to `output`, which is as long.
    fn take(&mut self, py: Python<'_>, input: &[f64], output: &mut [f64]) -> PyResult<()>;

    /// Takes the samples and writes each output to where its sample was.
    fn take_in_place(&mut self, py: Python<'_>, samples: &mut [f64]) -> PyResult<()>;
}

/// Samples and where their outputs go: converted, checked and allocated, so that no Python code runs but signal handlers.
pub(crate) enum Block<'a> {
    Apart(&'a [f64], &'a mut [f64]),
    InPlace(&'a mut [f64]),
}

impl Block<'_> {
    pub(crate) fn through(self, py: Python<'_>, process: &mut impl Samples) -> PyResult<()> {
        match self {
            Self::Apart(input, output) => process.take(py, input, output),
            Self::InPlace(samples) => process.take_in_place(py, samples),
        }
    }
}

/// One stream, sample after sample.
pub(crate) struct Single<'a, P>(pub(crate) &'a mut P);

impl<P: Process> Samples for Single<'_, P> {
    fn take(&mut self, py: Python<'_>, input: &[f64], output: &mut [f64]) -> PyResult<()> {
        for (x, y) in input.chunks(BLOCK).zip(output.chunks_mut(BLOCK)) {
            py.check_signals()?;
            self.0.run(x, y).map_err(raise)?;
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

/// One-dimensional `input` through `work`; the result is `out` where it is given, as in numpy.
pub(crate) fn run<'py>(
    input: &Bound<'py, PyAny>,
    out: Option<&Bound<'py, PyAny>>,
    work: impl FnOnce(Block<'_>) -> PyResult<()>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    apply(vector("input", input)?, out, work)
}

/// Two arrays side by side through an object: `work` takes as many samples of both and writes as many outputs; the result is `out`
/// where it is given.
pub(crate) fn run_both<'py, C: PyClass<Frozen = False>>(
    object: &Bound<'py, C>,
    [(name, input), (other, beside)]: [(&str, &Bound<'py, PyAny>); 2],
    out: Option<&Bound<'py, PyAny>>,
    mut work: impl FnMut(&mut C, &[f64], &[f64], &mut [f64]) -> Result<(), core::Error>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    /// Samples that are copied at a time where the outputs take their place.
    const COPIED: usize = 512;
    let (py, samples, both) = (input.py(), vector(name, input)?, vector(other, beside)?);
    if both.len() != samples.len() {
        let (expected, got) = (samples.len(), both.len());
        return Err(errors::value(other, format_args!("expected {expected} elements, as in {name}, got {got}")));
    }
    if out.is_some_and(|out| out.is(beside)) && !input.is(beside) {
        return Err(errors::value("out", format_args!("expected another array than {other}")));
    }
    let beside = both.as_slice()?;
    apply(samples, out, |block| {
        // For the whole run: what a signal handler does between two blocks is no part of it.
        let mut object = exclusive(object)?;
        match block {
            Block::Apart(input, output) => {
                for ((x, y), z) in input.chunks(BLOCK).zip(beside.chunks(BLOCK)).zip(output.chunks_mut(BLOCK)) {
                    py.check_signals()?;
                    work(&mut object, x, y, z).map_err(raise)?;
                }
            }
            Block::InPlace(samples) => {
                let mut copy = [0.0; COPIED];
                for (x, y) in samples.chunks_mut(COPIED).zip(beside.chunks(COPIED)) {
                    py.check_signals()?;
                    copy[..x.len()].copy_from_slice(x);
                    work(&mut object, &copy[..y.len()], y, x).map_err(raise)?;
                }
            }
        }
        Ok(())
    })
}

/// All samples, in C order, through `work` into `out` or a new array.
pub(crate) fn apply<'py, D: Dimension>(
    samples: PyReadonlyArray<'py, f64, D>,
    out: Option<&Bound<'py, PyAny>>,
    work: impl FnOnce(Block<'_>) -> PyResult<()>,
) -> PyResult<Bound<'py, PyArray<f64, D>>> {
    let py = samples.py();
    let Some(out) = out else {
        let out = zeros(py, samples.dims())?;
        work(Block::Apart(samples.as_slice()?, out.readwrite().as_slice_mut()?))?;
        return Ok(out);
    };
    let out = output(out, &samples)?;
    if out.is(&*samples) {
        drop(samples);
        let mut both = out.try_readwrite().map_err(|_| in_use("out"))?;
        work(Block::InPlace(both.as_slice_mut()?))?;
    } else if !is_slice(&out) {
        // numpy moves the results to wherever strides and alignment put them.
        let dense = zeros(py, samples.dims())?;
        work(Block::Apart(samples.as_slice()?, dense.readwrite().as_slice_mut()?))?;
        out.set_item(py.Ellipsis(), dense)?;
    } else if let Ok(mut free) = out.try_readwrite() {
        work(Block::Apart(samples.as_slice()?, free.as_slice_mut()?))?;
    } else {
        // The output overlaps the input: what is written must not be read back as input.
        let copy = arrays::copy("input", samples.as_slice()?)?;
        drop(samples);
        let mut free = out.try_readwrite().map_err(|_| in_use("out"))?;
        work(Block::Apart(&copy, free.as_slice_mut()?))?;
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
        return Err(wrong_type("out", format_args!("expected {expected}, got {got}")));
    };
    if array.shape() != samples.shape() {
        let (expected, got) = (Extent(samples.shape()), Extent(array.shape()));
        return Err(errors::value("out", format_args!("expected {expected}, got {got}")));
    }
    match array.try_readwrite() {
        Err(BorrowError::NotWriteable) => Err(errors::value("out", "expected an array that can be written to")),
        _ => Ok(array.clone()),
    }
}
