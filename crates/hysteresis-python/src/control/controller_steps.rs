//! How a controller takes samples.

use hysteresis_core::Command;
use hysteresis_python_macros::methods;
use numpy::PyArray1;
use pyo3::prelude::*;

use super::controller::HybridController;
use crate::convert::objects::{exclusive, shared};
use crate::stream::blocks::run_both;

#[methods]
impl HybridController {
    /// Takes a sample and returns the drive in volts.
    ///
    /// `reference` and `measurement` in um, with a preview the reference of `preview.ahead` samples later; `feedforward`:
    /// volts that replace the output of the source, which follows the target all the same; `target`: what the feed-forward
    /// is to reach, if not the reference or what the preview makes of it; `correction`: what is added to that, as
    /// `IterativeLearning.correction`.
    fn step(
        slf: &Bound<'_, Self>,
        reference: f64,
        measurement: f64,
        #[py(= None)] feedforward: Option<f64>,
        #[py(*, = None)] target: Option<f64>,
        #[py(= 0.0)] correction: f64,
    ) -> PyResult<f64> {
        let command = command(reference, feedforward, target, correction);
        Ok(exclusive(slf)?.stage_controller.step(command, measurement))
    }

    /// Takes arrays of references and measurements, bit for bit like `step` in a loop; returns the drives, in `out` or a new array.
    fn run<'py>(
        slf: &Bound<'py, Self>,
        #[py("ArrayLike")] references: &Bound<'py, PyAny>,
        #[py("ArrayLike")] measurements: &Bound<'py, PyAny>,
        #[py("Vector | None" = None)] out: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        run_both(slf, [("references", references), ("measurements", measurements)], out, |this, x, y, drives| {
            this.stage_controller.run(x, y, drives)
        })
    }

    /// The drive that `step` would return, without taking the sample.
    fn peek(
        slf: &Bound<'_, Self>,
        reference: f64,
        measurement: f64,
        #[py(= None)] feedforward: Option<f64>,
        #[py(*, = None)] target: Option<f64>,
        #[py(= 0.0)] correction: f64,
    ) -> PyResult<f64> {
        let command = command(reference, feedforward, target, correction);
        Ok(shared(slf)?.stage_controller.peek(command, measurement))
    }

    /// The drive for a sample, which only `commit` takes: write it to the amplifier between the two, and if that fails,
    /// leave it; memory and terms are still those of the drive that is there.
    ///
    /// A plan replaces the one before; any change of the controller drops it.
    fn plan(
        slf: &Bound<'_, Self>,
        reference: f64,
        measurement: f64,
        #[py(= None)] feedforward: Option<f64>,
        #[py(*, = None)] target: Option<f64>,
        #[py(= 0.0)] correction: f64,
    ) -> PyResult<f64> {
        let command = command(reference, feedforward, target, correction);
        Ok(exclusive(slf)?.stage_controller.plan(command, measurement))
    }

    /// Takes the sample that was planned; False if there is none.
    fn commit(slf: &Bound<'_, Self>) -> PyResult<bool> {
        Ok(exclusive(slf)?.stage_controller.commit())
    }
}

#[inline]
fn command(reference: f64, feedforward: Option<f64>, target: Option<f64>, correction: f64) -> Command {
    Command { target, correction, feedforward, ..reference.into() }
}
