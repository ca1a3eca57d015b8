//! Rows of samples through an array of streams, the actuators shared out among threads.

use std::sync::{Mutex, PoisonError};
use std::thread;

use hysteresis_core::{Process, StreamArray};
use numpy::ndarray::{ArrayView2, ArrayViewMut2, Axis};
use pyo3::prelude::*;

use super::blocks::{BLOCK, Samples};
use crate::convert::errors::raise;

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
