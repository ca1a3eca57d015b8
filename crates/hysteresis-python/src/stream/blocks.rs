//! Arrays through streams, block by block: one signal, and rows of many.

use std::sync::{Mutex, PoisonError};
use std::{fmt, thread};

use hysteresis_core::{self as core, Process, StreamArray};
use numpy::ndarray::{ArrayView2, ArrayViewMut2, Axis, Dimension};
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

/// Samples and where their outputs go: converted, checked and allocated, so that no Python code runs but signal
/// handlers.
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

/// Two arrays side by side through an object: `work` takes as many samples of both and writes as many outputs; the
/// result is `out` where it is given.
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

/// Parts of the actuators for each thread: one that is done early, or another on a slower processor, takes or leaves
/// some.
const PARTS: usize = 4;

/// More threads than that are never started, whatever is asked for.
const MOST: usize = 256;

/// One sample for each actuator.
pub(crate) struct Step<'a, P>(pub(crate) &'a mut StreamArray<P>);

impl<P: Process> Samples for Step<'_, P> {
    fn take(&mut self, _: Python<'_>, input: &[f64], output: &mut [f64]) -> PyResult<()> {
        self.0.step(input, output).map_err(raise)
    }

    fn take_in_place(&mut self, _: Python<'_>, samples: &mut [f64]) -> PyResult<()> {
        for (stream, sample) in self.0.streams_mut().iter_mut().zip(samples) {
            *sample = stream.step(*sample);
        }
        Ok(())
    }
}

/// One sample for each actuator, not taken.
pub(crate) struct Peek<'a, P>(pub(crate) &'a StreamArray<P>);

impl<P: Process> Samples for Peek<'_, P> {
    fn take(&mut self, _: Python<'_>, input: &[f64], output: &mut [f64]) -> PyResult<()> {
        self.0.peek(input, output).map_err(raise)
    }

    fn take_in_place(&mut self, _: Python<'_>, samples: &mut [f64]) -> PyResult<()> {
        for (stream, sample) in self.0.streams().iter().zip(samples) {
            *sample = stream.peek(*sample);
        }
        Ok(())
    }
}

/// Rows of one sample for each actuator.
///
/// Every actuator is moved by one thread alone through its own column, so the outputs are the same bits for any number
/// of threads.
pub(crate) struct Rows<'a, P> {
    array: &'a mut StreamArray<P>,
    threads: usize,
    /// Samples between two looks at pending signals: whole rows, and enough to be worth starting threads.
    block: usize,
}

impl<'a, P: Process + Send> Rows<'a, P> {
    pub(crate) fn new(array: &'a mut StreamArray<P>, threads: usize) -> Self {
        let width = array.len();
        let threads = threads.min(width).min(MOST);
        Self { array, threads, block: (threads * BLOCK).next_multiple_of(width) }
    }

    /// Moves every actuator through its column of `output`, whose samples are those of `input` or already there.
    fn share_out(&mut self, input: Option<&[f64]>, output: &mut [f64]) {
        let actuators = self.array.len();
        let shape = (output.len() / actuators, actuators);
        let width = actuators.div_ceil(PARTS * self.threads);
        let view = |input| ArrayView2::from_shape(shape, input).expect("whole rows");
        let mut output = ArrayViewMut2::from_shape(shape, output).expect("whole rows");
        let mut input = input.map(view);
        let mut input = input.as_mut().map(|view| view.axis_chunks_iter(Axis(1), width));
        let parts = self.array.streams_mut().chunks_mut(width).zip(output.axis_chunks_iter_mut(Axis(1), width));
        let parts = parts.map(|(streams, output)| (streams, input.as_mut().and_then(Iterator::next), output));
        let parts = Mutex::new(parts.collect::<Vec<_>>().into_iter());
        let next = || parts.lock().unwrap_or_else(PoisonError::into_inner).next();
        let work = || {
            while let Some((streams, input, output)) = next() {
                run_columns(streams, input, output);
            }
        };
        thread::scope(|scope| {
            for _ in 1..self.threads {
                // A thread that the system refuses leaves its parts to the others.
                let _ = thread::Builder::new().spawn_scoped(scope, work);
            }
            work();
        });
    }
}

fn run_columns<P: Process>(streams: &mut [P], input: Option<ArrayView2<'_, f64>>, mut output: ArrayViewMut2<'_, f64>) {
    for (k, row) in output.rows_mut().into_iter().enumerate() {
        match input {
            Some(input) => {
                for ((stream, x), y) in streams.iter_mut().zip(input.row(k)).zip(row) {
                    *y = stream.step(*x);
                }
            }
            None => {
                for (stream, sample) in streams.iter_mut().zip(row) {
                    *sample = stream.step(*sample);
                }
            }
        }
    }
}

impl<P: Process + Send> Samples for Rows<'_, P> {
    fn take(&mut self, py: Python<'_>, input: &[f64], output: &mut [f64]) -> PyResult<()> {
        for (x, y) in input.chunks(self.block).zip(output.chunks_mut(self.block)) {
            py.check_signals()?;
            if self.threads == 1 {
                self.array.run(x, y).map_err(raise)?;
            } else {
                self.share_out(Some(x), y);
            }
        }
        Ok(())
    }

    fn take_in_place(&mut self, py: Python<'_>, samples: &mut [f64]) -> PyResult<()> {
        for block in samples.chunks_mut(self.block) {
            py.check_signals()?;
            self.share_out(None, block);
        }
        Ok(())
    }
}
