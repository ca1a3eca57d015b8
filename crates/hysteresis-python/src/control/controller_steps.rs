//! How a controller takes samples.

use hysteresis_core::Command;
use numpy::PyArray1;
use pyo3::prelude::*;

use super::controller::HybridController;
use crate::convert::fast_number::{Correction, Feedforward, Measurement, Number, Reference, Target};
use crate::convert::objects::{exclusive, shared};
use crate::stream::blocks::run_both;

#[pymethods]
impl HybridController {
    /// Takes a sample and returns the drive in volts.
    ///
    /// `reference` and `measurement` in um, with a preview the reference of `preview.ahead` samples later; `feedforward`:
    /// volts that replace the output of the source, which follows the target all the same; `target`: what the feed-forward
    /// is to reach, if not the reference or what the preview makes of it; `correction`: what is added to that, as
    /// `IterativeLearning.correction`.
    #[pyo3(
        signature = (reference, measurement, feedforward=None, *, target=None, correction=Number::from(0.0)),
        text_signature = "($self, reference, measurement, feedforward=None, *, target=None, correction=0.0)"
    )]
    fn step(
        slf: &Bound<'_, Self>,
        reference: Number<Reference>,
        measurement: Number<Measurement>,
        feedforward: Option<Number<Feedforward>>,
        target: Option<Number<Target>>,
        correction: Number<Correction>,
    ) -> PyResult<f64> {
        let command = command(&reference, feedforward, target, correction);
        Ok(exclusive(slf)?.stage_controller.step(command, measurement.0))
    }

    /// Takes arrays of references and measurements, bit for bit like `step` in a loop; returns the drives, in `out` or a new array.
    #[pyo3(signature = (references, measurements, out=None))]
    fn run<'py>(
        slf: &Bound<'py, Self>,
        references: &Bound<'py, PyAny>,
        measurements: &Bound<'py, PyAny>,
        out: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        run_both(slf, [("references", references), ("measurements", measurements)], out, |this, x, y, drives| {
            this.stage_controller.run(x, y, drives)
        })
    }

    /// The drive that `step` would return, without taking the sample.
    #[pyo3(
        signature = (reference, measurement, feedforward=None, *, target=None, correction=Number::from(0.0)),
        text_signature = "($self, reference, measurement, feedforward=None, *, target=None, correction=0.0)"
    )]
    fn peek(
        slf: &Bound<'_, Self>,
        reference: Number<Reference>,
        measurement: Number<Measurement>,
        feedforward: Option<Number<Feedforward>>,
        target: Option<Number<Target>>,
        correction: Number<Correction>,
    ) -> PyResult<f64> {
        let command = command(&reference, feedforward, target, correction);
        Ok(shared(slf)?.stage_controller.peek(command, measurement.0))
    }

    /// The drive for a sample, which only `commit` takes: write it to the amplifier between the two, and if that fails,
    /// leave it; memory and terms are still those of the drive that is there.
    ///
    /// A plan replaces the one before; any change of the controller drops it.
    #[pyo3(
        signature = (reference, measurement, feedforward=None, *, target=None, correction=Number::from(0.0)),
        text_signature = "($self, reference, measurement, feedforward=None, *, target=None, correction=0.0)"
    )]
    fn plan(
        slf: &Bound<'_, Self>,
        reference: Number<Reference>,
        measurement: Number<Measurement>,
        feedforward: Option<Number<Feedforward>>,
        target: Option<Number<Target>>,
        correction: Number<Correction>,
    ) -> PyResult<f64> {
        let command = command(&reference, feedforward, target, correction);
        Ok(exclusive(slf)?.stage_controller.plan(command, measurement.0))
    }

    /// Takes the sample that was planned; False if there is none.
    fn commit(slf: &Bound<'_, Self>) -> PyResult<bool> {
        Ok(exclusive(slf)?.stage_controller.commit())
    }
}

#[inline]
fn command(
    reference: &Number<Reference>,
    feedforward: Option<Number<Feedforward>>,
    target: Option<Number<Target>>,
    correction: Number<Correction>,
) -> Command {
    Command {
        target: target.map(|target| target.0),
        correction: correction.0,
        feedforward: feedforward.map(|feedforward| feedforward.0),
        ..reference.0.into()
    }
}
