//! The Python face of the workspace: `mpi_hyst._core`. Conversion and error mapping only, no numerics.
//!
//! | Python | Rust |
//! |---|---|
//! | `float64` array, C-contiguous | `&[f64]`, read in place |
//! | any other real array or sequence | converted once |
//! | `state` | a dictionary of plain numbers and lists, by serde |
//! | `ValueError`, `TypeError`, `NotInvertibleError`, `OSError` | the `Error` of each crate, mapped in [`errors`] |
//!
//! The interpreter stays attached while a stream runs, so that nothing can change an array under it; blocks are short
//! (a million samples take milliseconds) and signals are looked at between them. The threads of an array of streams are
//! Rust's own and end before the call does. Identification works on its own copy
//! and lets the interpreter go.

mod actuators;
mod arguments;
mod arrays;
mod chains;
mod closed_loop;
mod controller;
mod controller_terms;
mod diagnostics;
mod dynamics;
mod errors;
mod excitation;
mod files;
mod identification;
mod identify;
mod identify_arguments;
mod learning;
mod linear;
mod model_values;
mod models;
mod observer;
mod operators;
mod paper;
mod plant;
mod precompensate;
mod preview;
mod process;
mod records;
mod recursive;
mod rows;
mod shaping;
mod signals;
mod single_argument;
mod stream_arrays;
mod streams;
mod tracking;
mod trajectories;
mod tuning;

use pyo3::prelude::*;

/// The compiled core of `mpi_hyst`.
#[pymodule]
mod _core {
    use pyo3::prelude::*;

    use crate::single_argument;

    #[pymodule_export]
    use crate::actuators::ActuatorArray;
    #[pymodule_export]
    use crate::closed_loop::{Metrics, Run};
    #[pymodule_export]
    use crate::controller::HybridController;
    #[pymodule_export]
    use crate::controller_terms::ControllerTerms;
    #[pymodule_export]
    use crate::diagnostics::{Finding, diagnose, loop_width};
    #[pymodule_export]
    use crate::dynamics::{DynamicsIdentification, identify_dynamics};
    #[pymodule_export]
    use crate::errors::NotInvertibleError;
    #[pymodule_export]
    use crate::excitation::{Excitation, demagnetize, excitation};
    #[pymodule_export]
    use crate::files::{load, write_file};
    #[pymodule_export]
    use crate::identification::{Identification, LeftOutLoop, Quality};
    #[pymodule_export]
    use crate::identify::identify;
    #[pymodule_export]
    use crate::learning::{IterativeLearning, RepetitiveControl};
    #[pymodule_export]
    use crate::linear::{Creep, FirstOrder, SecondOrder};
    #[pymodule_export]
    use crate::models::{ModifiedPrandtlIshlinskii, PrandtlIshlinskii};
    #[pymodule_export]
    use crate::observer::Observer;
    #[pymodule_export]
    use crate::operators::{CoupledPlay, Play};
    #[pymodule_export]
    use crate::paper::{gains, plant, table_1, table_1_recovered, table_2};
    #[pymodule_export]
    use crate::plant::Plant;
    #[pymodule_export]
    use crate::precompensate::{precompensate, shape};
    #[pymodule_export]
    use crate::preview::Preview;
    #[pymodule_export]
    use crate::recursive::RecursiveIdentifier;
    #[pymodule_export]
    use crate::shaping::preview;
    #[pymodule_export]
    use crate::signals::{decaying_triangle, sine, triangle};
    #[pymodule_export]
    use crate::stream_arrays::{ForwardArray, InverseArray};
    #[pymodule_export]
    use crate::streams::{Forward, Inverse};
    #[pymodule_export]
    use crate::tracking::simulate;
    #[pymodule_export]
    use crate::trajectories::{PointToPoint, RoundedTriangle, Sine};
    #[pymodule_export]
    use crate::tuning::{Margins, Tuning, tune};

    #[pymodule_init]
    fn add_steps(module: &Bound<'_, PyModule>) -> PyResult<()> {
        let py = module.py();
        single_argument::add::<CoupledPlay>(py)?;
        single_argument::add::<Play>(py)?;
        single_argument::add::<Forward>(py)?;
        single_argument::add::<Inverse>(py)
    }
}
