//! The terms of a controller as an object.

use hysteresis_core::Terms;
use hysteresis_python_macros::methods;
use pyo3::prelude::*;
use serde::{Deserialize, Serialize};

/// What a sample of a `HybridController` was made of: positions in um, terms in volts.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> stage = mh.Stage(mh.paper.table_1_recovered(), limits=(-500.0, 500.0))
/// >>> controller = stage.controller(dt=1e-4)
/// >>> drive = controller.step(1.0, 0.25)  # um, um
/// >>> controller.terms.error, controller.terms.drive == drive
/// (0.75, True)
#[pyclass(module = "mpi_hyst.control", frozen, get_all)]
#[derive(Serialize, Deserialize)]
pub(crate) struct ControllerTerms {
    /// The reference of the feedback.
    reference: f64,
    /// What the feed-forward was to reach.
    target: f64,
    /// Reference minus measurement; without a usable measurement the last one there was.
    error: f64,
    /// The error behind the filters.
    filtered_error: f64,
    /// The output of the feed-forward, or the number given instead.
    feedforward: f64,
    /// kp times the filtered error.
    proportional: f64,
    /// The sum of ki dt times the filtered errors, this sample included.
    integral: f64,
    /// What keeps starts and switches from being jumps; it goes to zero.
    bumpless: f64,
    /// What the law asks for: the sum of the four terms.
    unlimited_drive: f64,
    /// What the limiter lets through.
    drive: f64,
    /// Whether the unlimited drive lay beyond the limits.
    saturated: bool,
    /// Whether the unlimited drive was farther from the last drive than the slew allows.
    slewing: bool,
}

impl From<Terms> for ControllerTerms {
    fn from(terms: Terms) -> Self {
        let Terms {
            reference,
            target,
            error,
            filtered_error,
            feedforward,
            proportional,
            integral,
            bumpless,
            unlimited_drive,
            drive,
            saturated,
            slewing,
        } = terms;
        Self {
            reference,
            target,
            error,
            filtered_error,
            feedforward,
            proportional,
            integral,
            bumpless,
            unlimited_drive,
            drive,
            saturated,
            slewing,
        }
    }
}

#[methods]
impl ControllerTerms {
    fn __repr__(&self) -> String {
        let Self { error, feedforward, proportional, integral, bumpless, drive, .. } = self;
        format!(
            "<ControllerTerms drive {drive:?} of feedforward {feedforward:?}, proportional {proportional:?}, integral \
             {integral:?}, bumpless {bumpless:?}; error {error:?}>"
        )
    }
}
