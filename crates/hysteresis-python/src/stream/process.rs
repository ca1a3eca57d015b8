//! What every operator, filter and stream offers, but for `step` and `peek`: those are in `single_argument`.

use hysteresis_core::Process;
use hysteresis_python_macros::methods;
use numpy::PyArray1;
use pyo3::prelude::*;

use super::blocks::{self, Single};
use super::single_argument::Stepper;
use super::streams::{Forward, Inverse};
use crate::control::filters::Filter;
use crate::convert::objects::exclusive;
use crate::model::duhem::{Duhem, DuhemInverse};
use crate::model::operators::{CoupledPlay, Play};
use crate::plant::oscillator::OscillatorForward;
use crate::stage::streams::{StageForward, StageInverse};

#[methods(
    Play,
    CoupledPlay,
    Duhem,
    DuhemInverse,
    Filter,
    Forward,
    Inverse,
    OscillatorForward,
    StageForward,
    StageInverse
)]
impl Each {
    /// Takes an array of samples, bit for bit like `step` in a loop, into `out` or a new array.
    fn run<'py>(
        slf: &Bound<'py, Self>,
        #[py("ArrayLike")] input: &Bound<'py, PyAny>,
        #[py("Vector | None" = None)] out: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        blocks::run(input, out, |block| block.through(slf.py(), &mut Single(exclusive(slf)?.process_mut())))
    }

    /// Back to the start: at rest, or at the initial outputs that were given.
    fn reset(slf: &Bound<'_, Self>) -> PyResult<()> {
        exclusive(slf)?.process_mut().reset();
        Ok(())
    }

    /// How many samples were not finite, or beyond 1e100.
    #[getter]
    fn rejected(&self) -> u64 {
        Stepper::rejected(self)
    }
}
